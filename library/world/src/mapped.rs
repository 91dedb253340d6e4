//! Places that a function makes of others.

use ivx_op::{Function, Number, OpError, declare};

use super::Points;

declare! {
    /// The places that a function of the spec makes of others: with `let decade(x: Float) = pow(10.0, x)`,
    /// `mapped(grid(-3.0, 0.0, points: 4), by: decade)` is 0.001, 0.01, 0.1 and 1.
    pub struct Mapped = "mapped" @ 1 {
        /// The others.
        of: Box<dyn Points>;
        /// What is made of each.
        by: Function<Number>;
    }
}

impl Points for Mapped {
    fn places(&self) -> Result<Vec<f64>, OpError> {
        let of = self.of.places()?;
        let points = self.by.over(&[&of], of.len());
        match points.iter().zip(&of).find(|(x, _)| !x.is_finite()) {
            None => Ok(points),
            Some((x, of)) => {
                Err(OpError::Failed(format!("the function makes {x} of {of}, which is no place")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Formula, Maths, Node};

    use super::super::Grid;
    use super::*;

    #[test]
    fn each_place_goes_through_the_function() {
        let mapped = |low: f64| {
            let body = Node::Of(Maths::Log, vec![Node::Input(0)]);
            let by = Function::new(&Formula { inputs: vec!["x".to_owned()], body });
            Mapped { of: Box::new(Grid { low, high: 2.0, points: 2 }), by }.points()
        };
        assert_eq!(mapped(1.0), Ok(vec![0.0, 2.0_f64.ln()]));
        let one = Node::Input(0);
        let squared = Node::Of(Maths::Mul, vec![one.clone(), one]);
        let by = Function::new(&Formula { inputs: vec!["x".to_owned()], body: squared });
        let folded = Mapped { of: Box::new(Grid { low: -2.0, high: 2.0, points: 3 }), by };
        assert_eq!(folded.places(), Ok(vec![4.0, 0.0, 4.0]));
        assert!(folded.points().unwrap_err().to_string().contains("two of the places are `4`"));
        assert!(
            mapped(0.0).unwrap_err().to_string().contains("makes -inf of 0, which is no place")
        );
    }
}
