//! The environment of a program.

use std::ffi::OsString;
use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Content, OpError, Parts, Variable, Word, declare, family};

/// One variable of a program's environment.
pub trait Setting: Debug + Send + Sync {
    /// Its name and value; none where it is not set.
    ///
    /// # Errors
    /// If no variable can be called so.
    fn setting(&self) -> Result<Option<(String, OsString)>, OpError>;
}

declare! {
    /// A variable with a value written in the spec, such as a parameter or the seed.
    pub struct SetVariable = "variable" @ 1 {
        /// Its name: letters, digits and `_`.
        name: String;
        /// Its value.
        value: Word;
    }
}

impl Setting for SetVariable {
    fn setting(&self) -> Result<Option<(String, OsString)>, OpError> {
        if !is_name(&self.name) {
            return Err(OpError::Failed(format!("{:?} is no name of a variable", self.name)));
        }
        Ok(Some((self.name.clone(), (&self.value.0).into())))
    }
}

declare! {
    /// A variable as it is where ivx runs. Its value is part of what the program depends on: where
    /// the value differs, the program runs again.
    pub struct Inherited = "inherited" @ 1 {
        /// Its name, in quotes.
        name: Variable;
    }
}

impl Setting for Inherited {
    fn setting(&self) -> Result<Option<(String, OsString)>, OpError> {
        let Content::Variable(value) = &self.name.0.content else {
            unreachable!("a variable has the content of one")
        };
        Ok(value.clone().map(|value| (self.name.0.name.clone(), value)))
    }
}

/// Whether a variable can be called so.
pub(super) fn is_name(name: &str) -> bool {
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    !name.is_empty() && !name.starts_with(|c: char| c.is_ascii_digit()) && name.chars().all(letter)
}

/// The settings, by name.
pub(super) fn settings() -> &'static Parts<dyn Setting> {
    static TABLE: LazyLock<Parts<dyn Setting>> = LazyLock::new(|| {
        Parts::<dyn Setting>::new()
            .with(|x: SetVariable| Box::new(x))
            .with(|x: Inherited| Box::new(x))
    });
    &TABLE
}

family!(dyn Setting, "Setting", settings);
