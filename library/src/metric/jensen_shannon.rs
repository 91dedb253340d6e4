//! How much distributions disagree.

use ivx_math::disagreement::{decreasing, increasing, jensen_shannon};
use ivx_math::moments::real;
use ivx_op::{Array, AxisNames, Ctx, Facts, Named, Op, OpError, Wrong, declare};

use super::reduce::Groups;

declare! {
    /// The generalised Jensen-Shannon divergence of categorical distributions, in nats (Eqn. C.5): 0 where all are the
    /// same. The last of the dimensions that vanish is what a distribution is over, as `next` in
    /// `jensen_shannon(p, over: [member, next])`; those before tell the distributions apart.
    pub struct JensenShannon = "jensen_shannon" @ 1 -> Array [reduce p] {
        /// The probabilities.
        p: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// What each distribution weighs: the same (`equal`), or from the first to the last down to a third
        /// (`decreasing`) or up to three times as much (`increasing`).
        weights: String = "equal";
    }
    rule weights_are_known;
}

fn weights_are_known(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<String>("weights").map(|weights| weigh(&weights, 1)) {
        Some(Err(message)) => {
            let help = "write \"equal\", \"decreasing\" or \"increasing\"".to_owned();
            Err(Wrong { arg: "weights", message, help })
        }
        _ => Ok(()),
    }
}

fn weigh(weights: &str, n: usize) -> Result<Vec<f64>, String> {
    match weights {
        "equal" => Ok(vec![1.0 / real(n); n]),
        "decreasing" => Ok(decreasing(n)),
        "increasing" => Ok(increasing(n)),
        _ => Err(format!("no weights are called `{weights}`")),
    }
}

impl Op for JensenShannon {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let p = Array::stack(&self.p.0).map_err(OpError::Failed)?;
        let groups = Groups::of(&p, &self.over.0)?;
        let gone = p.dims.iter().rfind(|dim| self.over.0.contains(&dim.name));
        let (Some(places), Some(last)) = (gone, self.over.0.last()) else {
            return Err(OpError::Failed("name what distributions are over".to_owned()));
        };
        if places.name != *last || self.over.0.len() < 2 {
            return Err(OpError::Failed(format!(
                "name the distributions first, and then what they are over: `over: [.., {}]`",
                places.name
            )));
        }
        let weights = weigh(&self.weights, groups.offsets.len() / places.len());
        let weights = weights.map_err(OpError::Failed)?;
        let values = groups.starts.iter().map(|&start| {
            let all = groups.gather(&p, start);
            jensen_shannon(&all.chunks(places.len()).collect::<Vec<_>>(), &weights)
        });
        Ok(Array {
            values: values.collect(),
            dims: groups.kept.iter().map(|&d| p.dims[d].clone()).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::LN_2;

    use ivx_op::{Dim, Gathered, Labels};

    use super::*;

    fn divergence(over: &[&str], weights: &str) -> Result<Array, String> {
        let dim = |name, n: u32| Dim::new(name, Labels::Numbers((0..n).map(f64::from).collect()));
        // Two members say of two states: the same of the first, the opposite of the second.
        let of = |values: [f64; 4]| Array {
            dims: vec![dim("state", 2), dim("next", 2)],
            values: values.to_vec(),
        };
        let values = vec![of([0.5, 0.5, 1.0, 0.0]), of([0.5, 0.5, 0.0, 1.0])];
        let p = Named(Gathered { dims: vec![dim("#0", 2)], values, name: String::new() });
        let over = AxisNames(over.iter().map(|&name| name.to_owned()).collect());
        let op = JensenShannon { p, over, weights: weights.to_owned() };
        op.run(&Ctx::new("", 0, None)).map_err(|why| why.to_string())
    }

    #[test]
    fn what_is_opposite_disagrees_by_its_weights() {
        let found = divergence(&["#0", "next"], "equal").unwrap();
        assert_eq!(found.dims.len(), 1);
        assert!(found.values[0].abs() < 1e-12 && (found.values[1] - LN_2).abs() < 1e-12);
        // Weights of ¾ and ¼ either way: their entropy.
        let entropy = -0.75 * 0.75_f64.ln() - 0.25 * 0.25_f64.ln();
        for weights in ["decreasing", "increasing"] {
            let found = divergence(&["#0", "next"], weights).unwrap().values[1];
            assert!((found - entropy).abs() < 1e-12);
        }
    }

    #[test]
    fn what_distributions_are_over_comes_last() {
        let why = divergence(&["next", "#0"], "equal").unwrap_err();
        assert_eq!(
            why,
            "name the distributions first, and then what they are over: `over: [.., next]`"
        );
        assert!(divergence(&["next"], "equal").is_err() && divergence(&[], "equal").is_err());
        assert_eq!(divergence(&["#0", "next"], "odd").unwrap_err(), "no weights are called `odd`");
    }
}
