//! Groups of points, as others grouped them from the same first centres.

use ivx_math::kmeans::lloyd;
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, numbers};

#[test]
fn golden_kmeans() {
    check_kind("rip_imitative_planning", "kmeans", kmeans);
}

/// A trajectory is a point of all its numbers.
fn kmeans(case: &Case, path: &[&str]) -> Option<Value> {
    let flat = |of: &Value| -> Vec<f64> {
        of.as_array().into_iter().flatten().flat_map(numbers).collect()
    };
    let all =
        |of: &Value| -> Vec<f64> { of.as_array().into_iter().flatten().flat_map(flat).collect() };
    let (points, first) = (&case.inputs["trajectories"], &case.inputs["init_centroids"]);
    let [steps, width] = [&first[0], &first[0][0]].map(|of| of.as_array().map_or(0, Vec::len));
    let found = lloyd(&all(points), all(first), steps * width, 1_000);
    let rows: Vec<&[f64]> = found.centres.chunks_exact(width).collect();
    match path {
        ["centroids"] => Some(json!(rows.chunks_exact(steps).collect::<Vec<_>>())),
        ["labels"] => Some(json!(found.groups)),
        ["inertia"] => Some(json!(found.inertia)),
        _ => None,
    }
}
