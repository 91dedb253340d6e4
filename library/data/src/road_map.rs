//! Where roads are.

use ivx_op::{Artifact, Data, OpError, Tensors};

use crate::Place;

/// The roads of a world from above, in metres: `x` goes to the right and `y` down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoadMap {
    /// Their edges, each a line of two places or more.
    pub edges: Vec<Vec<Place>>,
    /// The way from where every episode begins to where it shall end; none where that is drawn.
    pub route: Vec<Place>,
}

impl Artifact for RoadMap {
    const KIND: &'static str = "RoadMap";

    /// How many places each edge has is a fact; all places are arrays.
    fn encode(&self) -> Vec<u8> {
        let places =
            |places: &[Place]| Data::F64(vec![places.len(), 2], places.as_flattened().to_vec());
        let lengths: Vec<usize> = self.edges.iter().map(Vec::len).collect();
        let arrays = [("edges", places(&self.edges.concat())), ("route", places(&self.route))];
        let arrays = arrays.map(|(name, data)| (name.to_owned(), data)).into();
        Tensors { arrays }.encode(Self::KIND, &lengths)
    }

    fn is_kept(&self) -> Result<(), OpError> {
        let mut places = self.edges.iter().flatten().chain(&self.route);
        if places.all(|place| place.iter().all(|x| x.is_finite()))
            && self.edges.iter().all(|edge| edge.len() > 1)
        {
            return Ok(());
        }
        let why = "the map has an edge of one place, or a place that is nowhere";
        Err(OpError::Failed(why.to_owned()))
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, lengths) = Tensors::decode::<Vec<usize>>(Self::KIND, bytes)?;
        let mut places = |name: &str| {
            let (shape, numbers) = tensors.f64(name)?;
            (shape.get(1) == Some(&2)).then(|| numbers.as_chunks::<2>().0.to_vec())
        };
        let (all, route) = (places("edges")?, places("route")?);
        let mut rest = &all[..];
        let mut edges = Vec::with_capacity(lengths.len());
        for n in lengths {
            let (edge, others) = rest.split_at_checked(n)?;
            edges.push(edge.to_vec());
            rest = others;
        }
        rest.is_empty().then_some(Self { edges, route })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_survive_the_round_trip() {
        let edges = vec![vec![[0.0, 0.5], [1.0, -2.0]], vec![[3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]];
        for route in [Vec::new(), vec![[0.1, 0.2], [9.0, 9.0]]] {
            for edges in [Vec::new(), edges.clone()] {
                let map = RoadMap { edges, route: route.clone() };
                assert!(map.is_kept().is_ok());
                assert_eq!(RoadMap::decode(&map.encode()), Some(map));
            }
        }
        for bad in [vec![vec![[0.0, 0.0]]], vec![vec![[0.0, f64::NAN], [1.0, 1.0]]]] {
            assert!(RoadMap { edges: bad, route: Vec::new() }.is_kept().is_err());
        }
    }
}
