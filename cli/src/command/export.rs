//! `ivx export`

#[cfg(feature = "parquet")]
mod parquet;

use std::fs;
use std::io::Write;
use std::path::Path;

use ivx_cache::{Cache, Fetched};
use ivx_engine::{Results, Tidy, consult, expand, judged, platform, record_of, tidy};
use ivx_grammar::suggest;
use ivx_library::command::npz;
use ivx_op::read_tensors;

use super::why::{named, swapped};
use super::{diff, ready};
use crate::args::{self, StoreMode};
use crate::source::is_spec;
use crate::{At as _, OK, Trouble, WRONG, project, store};

pub(crate) fn export(
    args: &args::Exported,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let kind = args.to.extension().and_then(|kind| kind.to_str()).unwrap_or_default();
    let path = &args.spec.path;
    let bytes = match kind {
        "csv" | "json" | "parquet" if is_spec(path) => {
            let why = "measures are exported from results: `ivx export results/NAME --to ..`";
            writeln!(err, "error: {why}")?;
            None
        }
        "csv" | "json" | "parquet" => measures(&diff::results(path)?, args, kind, err)?,
        "npz" | "safetensors" => node(args, kind, err)?,
        _ => {
            let why = "name it `.csv`, `.json` or `.parquet` for measures, `.npz` or `.safetensors` for a node";
            writeln!(err, "error: {} says nothing of its format: {why}", args.to.display())?;
            None
        }
    };
    let Some(bytes) = bytes else { return Ok(WRONG) };
    write(&args.to, &bytes)?;
    writeln!(out, "{}: {} bytes", args.to.display(), bytes.len())?;
    Ok(OK)
}

fn measures(
    results: &Results,
    args: &args::Exported,
    kind: &str,
    err: &mut dyn Write,
) -> Result<Option<Vec<u8>>, Trouble> {
    let name = args.name.as_deref().unwrap_or_default();
    let rows = tidy(results, name);
    if rows.rows.is_empty() && !name.is_empty() {
        let names = results.experiments.iter().flat_map(|(experiment, found)| {
            found.measures.keys().map(move |measure| format!("{experiment}/{measure}"))
        });
        let names: Vec<String> = names.collect();
        let help =
            suggest(name, names.iter().map(String::as_str)).map(String::from).unwrap_or_default();
        writeln!(err, "error: no measure is called `{name}`: {help}")?;
        return Ok(None);
    }
    match kind {
        "csv" => Ok(Some(rows.to_csv().into_bytes())),
        "json" => {
            let claims = if name.is_empty() { Some(judged(results)) } else { None };
            Ok(Some(object(&rows, claims.as_deref()).into_bytes()))
        }
        _ => columns(&rows, err),
    }
}

/// Measures, and all claims where no measure is asked for.
fn object(rows: &Tidy, claims: Option<&str>) -> String {
    let claims =
        claims.map_or(String::new(), |claims| format!(",\n\"claims\": {}", claims.trim_end()));
    format!("{{\"measures\": {}{claims}}}\n", rows.to_json().trim_end())
}

#[cfg(feature = "parquet")]
fn columns(rows: &Tidy, err: &mut dyn Write) -> Result<Option<Vec<u8>>, Trouble> {
    match parquet::parquet(rows) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(why) => {
            writeln!(err, "error: {why}")?;
            Ok(None)
        }
    }
}

#[cfg(not(feature = "parquet"))]
fn columns(_: &Tidy, err: &mut dyn Write) -> Result<Option<Vec<u8>>, Trouble> {
    let how = "`cargo install --path cli --features parquet`";
    writeln!(err, "error: this `ivx` was built without Parquet: {how} builds one with it")?;
    Ok(None)
}

/// The bytes of a node's result in a format.
fn node(
    args: &args::Exported,
    kind: &str,
    err: &mut dyn Write,
) -> Result<Option<Vec<u8>>, Trouble> {
    let Some(name) = &args.name else {
        writeln!(err, "error: name the node: `ivx plan --nodes` lists them")?;
        return Ok(None);
    };
    if let Some(spec) = swapped(&args.spec.path, name) {
        let path = args.spec.path.display();
        writeln!(err, "error: the spec comes before the node: `ivx export {spec} {path} --to ..`")?;
        return Ok(None);
    }
    let Some(ready) = ready(&args.spec, err)? else { return Ok(None) };
    let plan = expand(&ready.spec, &ready.registry);
    let Some((name, nodes)) = named(&plan, name, err)? else { return Ok(None) };
    let node = match nodes[..] {
        [node] => node,
        [] => unreachable!("a name means at least one node"),
        [first, second, ..] => {
            let (first, second) = (&plan.graph[first].address, &plan.graph[second].address);
            writeln!(err, "error: `{name}` is several nodes, such as {first} and {second}")?;
            return Ok(None);
        }
    };
    let mut cache = Cache::look(&project::cache(&ready.loaded.root), &platform())?;
    store::attach(&args.store, StoreMode::Read, &mut cache, err)?;
    consult(&plan, &ready.registry, &mut cache);
    store::notes(&mut cache, err)?;
    let output =
        record_of(&plan, &ready.registry, &cache, node).map(|record| record.output.clone());
    let fetched = output.map(|output| cache.objects().read(&output)).transpose()?;
    let Some(Fetched::Bytes(bytes)) = fetched else {
        let address = &plan.graph[node].address;
        writeln!(err, "error: the result of {address} is not known: `ivx exec` computes it")?;
        return Ok(None);
    };
    if kind == "safetensors" {
        return Ok(Some(bytes.to_vec()));
    }
    match read_tensors(&bytes) {
        Ok((tensors, _)) => Ok(Some(npz(&tensors.arrays))),
        Err(why) => {
            writeln!(err, "error: {why}")?;
            Ok(None)
        }
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Trouble> {
    fs::write(path, bytes).at(path)
}
