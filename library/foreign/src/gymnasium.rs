//! Worlds of Gymnasium.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ivx_data::Misfit;
use ivx_op::{Args, Content, External, Fields, Foreign, How, Lit, OpError, Part, declare};
use ivx_world::{Env, Spec, World, Worlds};
use serde_json::{Map, Value};

use crate::bridge::{Asked, Bridge, hear};
use crate::hello::spec;

declare! {
    /// A world of Gymnasium, in a Python process that all its lanes share.
    ///
    /// It is asked for what it shows and takes when the spec is read, so that everything is written in the call itself:
    /// `gymnasium("FrozenLake-v1", kwargs: (map_name: "8x8", is_slippery: false))`. Results depend on the versions of
    /// Python, `NumPy`, gymnasium and whatever brings the environment, as they are then. Understood are observations
    /// `Box`, `Discrete`, `MultiBinary`, and `Dict` and `Tuple` of these, and actions `Discrete`, and `Box` of real
    /// numbers with bounds. Each episode begins with a seed of its own. `docs/agents.md` tells more.
    pub struct Gymnasium = "gymnasium" @ 1 {
        /// What the environment is called there, in quotes; `"module:Name-v0"` where a module has to be imported first.
        name: Foreign;
        /// What it is made with besides.
        kwargs: Fields = Part::default();
        /// The interpreter: a program found in PATH, or its absolute path.
        python: How<String> = "python3";
        /// After so long without an answer it is killed.
        time_limit: How<f64> = 60.0, in f64::MIN_POSITIVE.., unit "seconds";
    }
}

impl Gymnasium {
    /// What Python said of it, and where that lies.
    fn told(&self) -> (&str, &Path) {
        let Content::Foreign { told, program } = &self.name.0.content else {
            unreachable!("a world has the content of one")
        };
        (told, program)
    }
}

impl Env for Gymnasium {
    fn spec(&self) -> Result<Spec, Misfit> {
        let help = "choose another world, or wrap this one in Python";
        spec(self.told().0)
            .map_err(|why| Misfit::new(format!("`{}` {why}", self.name.0.name), help))
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        Err(OpError::Failed("worlds of another process are opened together".to_owned()))
    }

    fn open_all(&self, n: usize) -> Result<Box<dyn Worlds>, OpError> {
        let (told, program) = self.told();
        let kwargs = json(&self.kwargs.0).map_err(OpError::Failed)?;
        let asked = Asked {
            program,
            name: &self.name.0.name,
            kwargs: &kwargs,
            time_limit: *self.time_limit,
        };
        Ok(Box::new(Bridge::open(&asked, told, n)?))
    }
}

/// A world, as the interpreter at `program` tells of it. It is asked once for each.
///
/// # Errors
/// Why there is none.
pub fn look_up(
    program: &Path,
    name: &str,
    kwargs: &Args,
    time_limit: f64,
) -> Result<External, String> {
    type Known = BTreeMap<(PathBuf, String, String), Result<External, String>>;
    static KNOWN: Mutex<Known> = Mutex::new(BTreeMap::new());
    let kwargs = json(kwargs)?;
    let key = (program.to_owned(), name.to_owned(), kwargs.clone());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let found = known.entry(key).or_insert_with(|| {
        let (told, _) = hear(&Asked { program, name, kwargs: &kwargs, time_limit })?;
        spec(&told)?;
        Ok(External::foreign(name.to_owned(), &told, program.to_owned()))
    });
    found.clone()
}

/// A record as JSON.
fn json(fields: &Args) -> Result<String, String> {
    let fields = fields.iter().map(|(name, value)| Ok((name.to_owned(), value_of(value)?)));
    Ok(Value::Object(fields.collect::<Result<Map<_, _>, String>>()?).to_string())
}

fn value_of(lit: &Lit) -> Result<Value, String> {
    Ok(match lit {
        Lit::Bool(b) => Value::from(*b),
        Lit::Int(n) => Value::from(*n),
        Lit::Real(x) => Value::from(*x),
        Lit::Text(text) => Value::from(&**text),
        Lit::List(items) => items.iter().map(value_of).collect::<Result<_, _>>()?,
        Lit::Part(part) if part.name.is_empty() => {
            let fields = part.args.iter().map(|(name, lit)| Ok((name.to_owned(), value_of(lit)?)));
            Value::Object(fields.collect::<Result<_, String>>()?)
        }
        other => return Err(format!("{other} is nothing that Python is given")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn python_is_given_what_is_written() {
        let inner = Part::default().with("b", vec![1.0, 0.5]).with("a", -3_i64);
        let kwargs = Part::default().with("map", "4x4").with("is_slippery", false).with("c", inner);
        let expected = r#"{"c":{"a":-3,"b":[1.0,0.5]},"is_slippery":false,"map":"4x4"}"#;
        assert_eq!(json(&kwargs.args).as_deref(), Ok(expected));
        assert!(json(&Part::default().with("ke", Part::new("wcm")).args).is_err());
    }
}
