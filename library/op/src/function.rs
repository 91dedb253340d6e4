//! Functions of a spec's own: descriptions that are evaluated where an operation runs.

use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{ArgError, Lit, Literal, Maths, Ty};

/// A function of numbers, as a spec writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Formula {
    /// What it is given, by name.
    pub inputs: Vec<String>,
    /// What it makes of that.
    pub body: Node,
}

/// A piece of a formula.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Node {
    /// A number.
    Number(f64),
    /// One of the inputs, by place.
    Input(usize),
    /// A function of what stands in it.
    Of(Maths, Vec<Node>),
}

impl Formula {
    /// The same function of inputs that bear other names: of one, whatever it is called, or of those among
    /// them. None if it has others.
    #[must_use]
    pub fn given(&self, names: &[impl AsRef<str>]) -> Option<Self> {
        let place = |own: &String| match (&self.inputs[..], names) {
            ([_], [_]) => Some(0),
            _ => names.iter().position(|name| name.as_ref() == own),
        };
        let places = self.inputs.iter().map(place).collect::<Option<Vec<usize>>>()?;
        let inputs = names.iter().map(|name| name.as_ref().to_owned()).collect();
        Some(Self { inputs, body: self.body.placed(&places) })
    }
}

impl Node {
    fn placed(&self, places: &[usize]) -> Self {
        match self {
            Self::Number(x) => Self::Number(*x),
            Self::Input(i) => Self::Input(places[*i]),
            Self::Of(maths, of) => {
                Self::Of(*maths, of.iter().map(|node| node.placed(places)).collect())
            }
        }
    }
}

/// What a key knows of it. The inputs are in the order of who takes it, and so bear numbers.
impl fmt::Display for Formula {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "function({}) {}", self.inputs.join(", "), self.body)
    }
}

impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x:?}"),
            Self::Input(i) => write!(f, "#{i}"),
            Self::Of(maths, of) => {
                write!(f, "{}(", maths.name())?;
                for (i, node) in of.iter().enumerate() {
                    write!(f, "{}{node}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str(")")
            }
        }
    }
}

/// The names of what a function is given, in the order of its numbers.
pub trait Inputs: fmt::Debug + Send + Sync + 'static {
    /// The names.
    const NAMES: &'static [&'static str];
}

/// A function that an operation or part takes, ready to be evaluated.
///
/// A spec may write one of fewer inputs: they are found by name, but a single one for a single one.
#[derive(Clone, Debug)]
pub struct Function<I> {
    code: Arc<[Code]>,
    /// The most numbers that wait at once.
    depth: usize,
    inputs: PhantomData<I>,
}

/// One step of a stack machine.
#[derive(Clone, Copy, Debug)]
enum Code {
    Number(f64),
    Input(usize),
    Of(Maths, usize),
}

/// So many numbers go through a step at once.
const BLOCK: usize = 64;

impl<I: Inputs> Function<I> {
    /// The function that a formula describes.
    ///
    /// # Panics
    /// If the formula has other inputs.
    #[must_use]
    pub fn new(formula: &Formula) -> Self {
        let formula = formula.given(I::NAMES).expect("it takes what it is given");
        let (mut code, mut depth) = (Vec::new(), 0);
        compile(&formula.body, 1, &mut code, &mut depth);
        Self { code: code.into(), depth, inputs: PhantomData }
    }

    /// Its value.
    ///
    /// - `inputs`: one number for each name.
    #[must_use]
    pub fn at(&self, inputs: &[f64]) -> f64 {
        let mut columns = vec![[0.0; 1]; self.depth];
        self.run(&mut columns, 1, &|i, out| out[0] = inputs[i]);
        columns[0][0]
    }

    /// Its value at each row.
    ///
    /// - `inputs`: a column for each name, all as long as `n`.
    #[must_use]
    pub fn over(&self, inputs: &[&[f64]], n: usize) -> Vec<f64> {
        let mut values = Vec::with_capacity(n);
        let mut columns = vec![[0.0; BLOCK]; self.depth];
        for start in (0..n).step_by(BLOCK) {
            let len = BLOCK.min(n - start);
            let rows = start..start + len;
            self.run(&mut columns, len, &|i, out| {
                out[..len].copy_from_slice(&inputs[i][rows.clone()]);
            });
            values.extend_from_slice(&columns[0][..len]);
        }
        values
    }

    /// Leaves the values of some rows in the first column.
    fn run<const N: usize>(
        &self,
        columns: &mut [[f64; N]],
        rows: usize,
        input: &impl Fn(usize, &mut [f64; N]),
    ) {
        let mut top = 0;
        for code in self.code.iter() {
            match code {
                Code::Number(x) => columns[top] = [*x; N],
                Code::Input(i) => input(*i, &mut columns[top]),
                Code::Of(maths, arity) => {
                    top -= arity;
                    let (first, others) = columns[top..].split_at_mut(1);
                    for (row, out) in first[0][..rows].iter_mut().enumerate() {
                        let mut x = [*out, 0.0, 0.0];
                        for (x, other) in x[1..*arity].iter_mut().zip(&*others) {
                            *x = other[row];
                        }
                        *out = maths.of(&x[..*arity]);
                    }
                }
            }
            top += 1;
        }
    }
}

/// Writes what leaves the value of a node on top of the numbers that wait, `place` of them with it.
fn compile(node: &Node, place: usize, code: &mut Vec<Code>, depth: &mut usize) {
    *depth = place.max(*depth);
    match node {
        Node::Number(x) => code.push(Code::Number(*x)),
        Node::Input(i) => code.push(Code::Input(*i)),
        Node::Of(maths, of) => {
            for (i, node) in of.iter().enumerate() {
                compile(node, place + i, code, depth);
            }
            code.push(Code::Of(*maths, of.len()));
        }
    }
}

impl<I: Inputs> Literal for Function<I> {
    fn ty() -> Ty {
        Ty::Function(I::NAMES.iter().map(ToString::to_string).collect())
    }
    fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
        match lit {
            Lit::Function(formula) if formula.given(I::NAMES).is_some() => Ok(Self::new(formula)),
            _ => Err(ArgError::Type { expected: Self::ty(), found: lit.clone() }),
        }
    }
}

/// What a function of one number is given.
#[derive(Clone, Copy, Debug)]
pub struct Number;

impl Inputs for Number {
    const NAMES: &'static [&'static str] = &["x"];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug)]
    struct Two;

    impl Inputs for Two {
        const NAMES: &'static [&'static str] = &["state", "next"];
    }

    fn formula(inputs: &[&str], body: Node) -> Formula {
        Formula { inputs: inputs.iter().map(ToString::to_string).collect(), body }
    }

    fn of(maths: Maths, of: Vec<Node>) -> Node {
        Node::Of(maths, of)
    }

    #[test]
    fn a_function_is_evaluated_at_one_and_at_many() {
        // where(x < 1, x · x, exp(x - 1)).
        let x = || Node::Input(0);
        let one = || Node::Number(1.0);
        let square = of(Maths::Mul, vec![x(), x()]);
        let exp = of(Maths::Exp, vec![of(Maths::Sub, vec![x(), one()])]);
        let body = of(Maths::Where, vec![of(Maths::Less, vec![x(), one()]), square, exp]);
        let function = Function::<Number>::new(&formula(&["a"], body));
        let expected = |x: f64| if x < 1.0 { x * x } else { (x - 1.0).exp() };
        assert_eq!((function.at(&[0.5]), function.at(&[3.0])), (0.25, expected(3.0)));
        // More than a block, and no whole number of them.
        let xs: Vec<f64> = (0..150).map(|i| f64::from(i) / 50.0).collect();
        let values: Vec<f64> = xs.iter().map(|x| expected(*x)).collect();
        assert_eq!(function.over(&[&xs], xs.len()), values);
        assert_eq!(function.over(&[&[]], 0), Vec::<f64>::new());
    }

    #[test]
    fn inputs_are_found_by_name_but_one_for_one() {
        let next = formula(&["next"], Node::Input(0));
        assert_eq!(Function::<Two>::new(&next).at(&[1.0, 2.0]), 2.0);
        let both = of(Maths::Sub, vec![Node::Input(0), Node::Input(1)]);
        let swapped = formula(&["next", "state"], both);
        assert_eq!(Function::<Two>::new(&swapped).at(&[1.0, 5.0]), 4.0);
        assert_eq!(formula(&["x"], Node::Input(0)).given(Two::NAMES), None);
        let other = Lit::Function(formula(&["x"], Node::Input(0)).into());
        assert!(Function::<Two>::from_lit(&other).is_err());
        assert!(Function::<Number>::from_lit(&other).is_ok());
    }

    #[test]
    fn a_key_knows_neither_names_nor_their_order() {
        let body = |first: usize| of(Maths::Add, vec![Node::Input(first), Node::Number(-0.5)]);
        let shown = |formula: &Formula| formula.given(Two::NAMES).unwrap().to_string();
        let expected = "function(state, next) add(#1, -0.5)";
        assert_eq!(shown(&formula(&["next", "state"], body(0))), expected);
        assert_eq!(shown(&formula(&["next"], body(0))), expected);
        assert_eq!(shown(&formula(&["state", "next"], body(1))), expected);
    }
}
