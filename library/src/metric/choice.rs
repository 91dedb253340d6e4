//! What lies where something else is lowest or highest: to choose by one measure, and report another.

use ivx_op::{Array, AxisNames, Ctx, Dim, Facts, Labels, Named, Op, OpError, Wrong, declare};

use super::broadcast::broadcast;
use super::reduce::Groups;

macro_rules! choices {
    ($($(#[doc = $doc:literal])+ $one:ident = $name:literal, $(#[doc = $some_doc:literal])+ $some:ident = $some_name:literal by $order:expr;)+) => {$(
        declare! {
            $(#[doc = $doc])+
            ///
            /// Of several equal ones, the first in the order of the values of the axis. What is not a number is chosen
            /// only where nothing else is there.
            pub struct $one = $name @ 1 -> Array [union] {
                /// What is compared.
                x: Named<Array>;
                /// The axes and dimensions along which it is.
                over: AxisNames;
                /// What is read there: another measure, or an axis for its value. Left out along one dimension of
                /// an array, such as places, it is that dimension's own number.
                of: Option<Named<Array>>;
            }
            rule says_what_is_read;
        }

        impl Op for $one {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                let (read, groups, ranked) = ranked(&self.x, &self.over, self.of.as_ref(), $order)?;
                let values = ranked.iter().map(|places| read.values[places[0]]).collect();
                Ok(Array { dims: groups.kept.iter().map(|&d| read.dims[d].clone()).collect(), values })
            }
        }

        declare! {
            $(#[doc = $some_doc])+
            ///
            /// Equal ones are in the order of the values of the axis, and what is not a number comes last.
            pub struct $some = $some_name @ 1 -> Array [union to rank] {
                /// What is compared.
                x: Named<Array>;
                /// How many are chosen.
                n: usize, in 1.0..=1e6;
                /// The axes and dimensions along which it is.
                over: AxisNames;
                /// What is read there, as by `argmin`.
                of: Option<Named<Array>>;
            }
            rule says_what_is_read;
        }

        impl Op for $some {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                let (read, groups, ranked) = ranked(&self.x, &self.over, self.of.as_ref(), $order)?;
                let there = groups.offsets.len();
                if self.n > there {
                    let message = format!("{} are to be chosen, and there are {there}", self.n);
                    return Err(OpError::Failed(message));
                }
                let mut dims: Vec<Dim> = groups.kept.iter().map(|&d| read.dims[d].clone()).collect();
                dims.push(Dim::new("rank", Labels::count(self.n)));
                let values = ranked.iter().flat_map(|places| &places[..self.n]);
                Ok(Array { dims, values: values.map(|&place| read.values[place]).collect() })
            }
        }
    )+};
}

choices! {
    /// What lies where `x` is lowest; written `argmin(x, over: a, of: y)`.
    ArgminOver = "argmin_over",
    /// What lies at the `n` places where `x` is lowest, over `rank`: 0 is the lowest.
    Lowest = "lowest" by |a, b| a < b;
    /// What lies where `x` is highest; written `argmax(x, over: a, of: y)`.
    ArgmaxOver = "argmax_over",
    /// What lies at the `n` places where `x` is highest, over `rank`: 0 is the highest.
    Highest = "highest" by |a, b| a > b;
}

/// Labels of axes do not travel, so that what is chosen along one is read of something that does.
fn says_what_is_read(facts: &Facts<'_>) -> Result<(), Wrong> {
    if let Some(axis) = facts.seen("of").iter().find(|axis| !facts.seen("x").contains(axis)) {
        let message = format!(
            "what is compared does not vary over `{axis}`, and so nothing chooses along it"
        );
        let help = "leave it out of `over`, or compare what varies over it".to_owned();
        return Err(Wrong { arg: "x", message, help });
    }
    if facts.is_given("of") || facts.seen("x").is_empty() {
        return Ok(());
    }
    let axis = &facts.seen("x")[0];
    Err(Wrong {
        arg: "of",
        message: format!("nothing says what is read where it is chosen along `{axis}`"),
        help: format!("write `of: {axis}` for the coordinate, or the measure that is reported"),
    })
}

/// What is read, how it falls into groups, and the places of each in the order of `x`.
fn ranked(
    x: &Named<Array>,
    over: &AxisNames,
    of: Option<&Named<Array>>,
    precedes: impl Fn(f64, f64) -> bool,
) -> Result<(Array, Groups, Vec<Vec<usize>>), OpError> {
    let x = Array::stack(&x.0).map_err(OpError::Failed)?;
    let of = match of {
        Some(of) => Array::stack(&of.0).map_err(OpError::Failed)?,
        None => own_numbers(&x, &over.0)?,
    };
    let (compared, read) = (broadcast(&x, &of, |x, _| x)?, broadcast(&x, &of, |_, of| of)?);
    let groups = Groups::of(&compared, &over.0)?;
    let order = |&a: &usize, &b: &usize| {
        let (a, b) = (compared.values[a], compared.values[b]);
        let before = |a: f64, b: f64| precedes(a, b) || b.is_nan() && !a.is_nan();
        before(b, a).cmp(&before(a, b))
    };
    let ranked = groups.starts.iter().map(|start| {
        let mut places: Vec<usize> = groups.offsets.iter().map(|offset| start + offset).collect();
        places.sort_by(order);
        places
    });
    let ranked = ranked.collect();
    Ok((read, groups, ranked))
}

/// The numbers along the one dimension over which is chosen.
fn own_numbers(x: &Array, over: &[String]) -> Result<Array, OpError> {
    let dim = match over {
        [one] => x.dims.iter().find(|dim| dim.name == *one),
        _ => None,
    };
    match dim.map(|dim| &dim.labels) {
        Some(Labels::Numbers(numbers)) => {
            Ok(Array::series(dim.expect("it has labels").clone(), numbers.clone()))
        }
        _ => Err(OpError::Failed(
            "what is chosen has no number of its own: `of:` says what is read there".to_owned(),
        )),
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::*;

    const CTX: Ctx = Ctx::new("", 0, None);

    fn dim(name: &str, n: usize) -> Dim {
        Dim::new(name, Labels::count(n))
    }

    /// Over the gathered axis `#0`, a row over `fold` each.
    fn rows(rows: &[[f64; 2]]) -> Named<Array> {
        let values = rows.iter().map(|row| Array::series(dim("fold", 2), row.to_vec())).collect();
        Named(Gathered { dims: vec![dim("#0", rows.len())], values, name: String::new() })
    }

    fn over(name: &str) -> AxisNames {
        AxisNames(vec![name.to_owned()])
    }

    #[test]
    fn one_measure_chooses_and_another_is_read() {
        // By fold: the lowest of (3, 1, 2) and of (1, 1, NaN), at 1 and at 0.
        let x = || rows(&[[3.0, 1.0], [1.0, 1.0], [2.0, f64::NAN]]);
        let of = || Some(rows(&[[10.0, 11.0], [20.0, 21.0], [30.0, 31.0]]));
        let least = ArgminOver { x: x(), over: over("#0"), of: of() }.run(&CTX).unwrap();
        assert_eq!(least, Array::series(dim("fold", 2), vec![20.0, 11.0]));
        let most = ArgmaxOver { x: x(), over: over("#0"), of: of() }.run(&CTX).unwrap();
        assert_eq!(most.values, [10.0, 11.0]);

        let two = Lowest { x: x(), n: 2, over: over("#0"), of: of() }.run(&CTX).unwrap();
        assert_eq!(two.dims, [dim("fold", 2), dim("rank", 2)]);
        assert_eq!(two.values, [20.0, 30.0, 11.0, 21.0]);
        let all = Highest { x: x(), n: 3, over: over("#0"), of: of() }.run(&CTX).unwrap();
        assert_eq!(all.values, [10.0, 30.0, 20.0, 11.0, 21.0, 31.0]);
        let four = Highest { x: x(), n: 4, over: over("#0"), of: of() }.run(&CTX).unwrap_err();
        assert_eq!(four.to_string(), "4 are to be chosen, and there are 3");
    }

    #[test]
    fn along_a_dimension_its_own_number_is_read() {
        let places = Dim::new("x", Labels::Numbers(vec![-1.0, 0.5, 2.0]));
        let curve = Array::series(places, vec![0.0, 7.0, 3.0]);
        let x =
            || Named(Gathered { dims: vec![], values: vec![curve.clone()], name: String::new() });
        let best = ArgmaxOver { x: x(), over: over("x"), of: None }.run(&CTX).unwrap();
        assert_eq!(best, Array::scalar(0.5));
        // What is read may vary over more: a value for each of these.
        let more = Array::series(dim("metric", 2), vec![1.0, 2.0]);
        let of =
            Some(Named(Gathered { dims: vec![], values: vec![more.clone()], name: String::new() }));
        assert_eq!(ArgmaxOver { x: x(), over: over("x"), of }.run(&CTX).unwrap(), more);
    }
}
