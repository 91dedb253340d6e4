//! What a spec names outside of itself: files, programs, variables of the environment, and worlds of other programs.
//!
//! It is looked up when the spec is read, and what it was then is what runs.

use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::{ArgError, ArgKind, Args, Decl, Lit, Literal, Ty};

/// Something outside the spec, as it was when the spec was read.
///
/// Written down it is without its content: whoever reads that looks it up, and holds it against the digest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct External {
    /// What it is called: a file by where it appears in a working folder, never by where it lies.
    pub name: String,
    /// The digest of what it was.
    pub digest: [u8; 32],
    /// What it was.
    pub content: Content,
}

/// What stands behind a name outside the spec.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// A file.
    File {
        /// Its bytes.
        #[serde(skip)]
        bytes: Arc<[u8]>,
        /// Whether it may be executed.
        is_executable: bool,
    },
    /// Where a program lies.
    Program(#[serde(skip)] PathBuf),
    /// The value of a variable; none where it is not set.
    Variable(#[serde(skip)] Option<OsString>),
    /// A world of another program.
    Foreign {
        /// What the program says of it, in one line.
        #[serde(skip)]
        told: Arc<str>,
        /// Where the program lies.
        #[serde(skip)]
        program: PathBuf,
    },
}

/// A kind of thing outside the spec.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ExternalKind {
    /// A file of the project.
    File,
    /// A program of this machine.
    Program,
    /// A variable of the environment.
    Variable,
    /// A world of another program. What it is depends on all arguments of the call that names it, so that these are
    /// written there too.
    Foreign,
}

impl External {
    /// A file with these bytes.
    #[must_use]
    pub fn file(name: String, bytes: Vec<u8>, is_executable: bool) -> Self {
        let digest = Sha256::digest(&bytes).into();
        Self { name, digest, content: Content::File { bytes: bytes.into(), is_executable } }
    }

    /// A variable and its value.
    #[must_use]
    pub fn variable(name: String, value: Option<OsString>) -> Self {
        let mut hash = Sha256::new();
        if let Some(value) = &value {
            hash.update(b"=");
            hash.update(value.as_encoded_bytes());
        }
        Self { name, digest: hash.finalize().into(), content: Content::Variable(value) }
    }

    /// A world, by what the program at `program` tells of it.
    #[must_use]
    pub fn foreign(name: String, told: &str, program: PathBuf) -> Self {
        let digest = Sha256::digest(told).into();
        Self { name, digest, content: Content::Foreign { told: told.into(), program } }
    }

    /// What kind it is.
    #[must_use]
    pub fn kind(&self) -> ExternalKind {
        match self.content {
            Content::File { .. } => ExternalKind::File,
            Content::Program(_) => ExternalKind::Program,
            Content::Variable(_) => ExternalKind::Variable,
            Content::Foreign { .. } => ExternalKind::Foreign,
        }
    }
}

impl ExternalKind {
    /// What arguments of a type name; `None` if they name nothing outside.
    #[must_use]
    pub fn of(ty: &Ty) -> Option<Self> {
        match ty {
            Ty::External(kind) => Some(*kind),
            Ty::List(item) => Self::of(item),
            _ => None,
        }
    }
}

impl Decl {
    /// Its arguments that name something outside, by place.
    pub fn externals(&self) -> impl Iterator<Item = (usize, ExternalKind)> {
        self.args.iter().enumerate().filter_map(|(i, arg)| match &arg.kind {
            ArgKind::Literal(ty) => ExternalKind::of(ty).map(|kind| (i, kind)),
            _ => None,
        })
    }
}

impl fmt::Display for ExternalKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::File => "File",
            Self::Program => "Program",
            Self::Variable => "Variable",
            Self::Foreign => "Foreign",
        })
    }
}

/// Its name, its digest and whether it may be executed: what a key knows of it.
impl fmt::Display for External {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Keys of many thousand nodes are made of this.
        let digit = |nibble: u8| char::from(b"0123456789abcdef"[usize::from(nibble)]);
        let digits = self.digest.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]);
        let digest: String = digits.collect();
        write!(f, "{:?} sha256:{digest}", self.name)?;
        let is_executable = matches!(self.content, Content::File { is_executable: true, .. });
        f.write_str(if is_executable { " executable" } else { "" })
    }
}

macro_rules! external {
    ($($(#[doc = $doc:literal])+ $name:ident;)+) => {$(
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct $name(pub External);

        impl Literal for $name {
            fn ty() -> Ty {
                Ty::External(ExternalKind::$name)
            }
            fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
                match lit {
                    Lit::External(found) if found.kind() == ExternalKind::$name => {
                        Ok(Self(External::clone(found)))
                    }
                    _ => Err(ArgError::Type { expected: Self::ty(), found: lit.clone() }),
                }
            }
        }

        /// None where the name is empty.
        impl Literal for Option<$name> {
            fn ty() -> Ty {
                $name::ty()
            }
            fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
                match lit {
                    Lit::Text(name) if name.is_empty() => Ok(None),
                    _ => $name::from_lit(lit).map(Some),
                }
            }
        }
    )+};
}

external! {
    /// A file of the project, with its bytes.
    File;
    /// A program of this machine.
    Program;
    /// A variable of the environment, with its value.
    Variable;
    /// A world of another program, with what it says of itself.
    Foreign;
}

/// Text, or a number as the language writes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word(pub String);

impl Literal for Word {
    fn ty() -> Ty {
        Ty::Word
    }
    fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
        match lit {
            Lit::Text(text) => Ok(Self(text.clone())),
            Lit::Int(_) | Lit::Real(_) | Lit::Bool(_) => Ok(Self(lit.to_string())),
            _ => Err(ArgError::Type { expected: Self::ty(), found: lit.clone() }),
        }
    }
}

/// A record of any fields whose values are plain: truths, numbers, texts, and lists and records of these.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Fields(pub Args);

impl Literal for Fields {
    fn ty() -> Ty {
        Ty::Fields
    }
    fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
        match lit {
            Lit::Part(part) if is_plain(lit) => Ok(Self(part.args.clone())),
            _ => Err(ArgError::Type { expected: Self::ty(), found: lit.clone() }),
        }
    }
}

fn is_plain(lit: &Lit) -> bool {
    match lit {
        Lit::Bool(_) | Lit::Int(_) | Lit::Real(_) | Lit::Text(_) => true,
        Lit::List(items) => items.iter().all(is_plain),
        Lit::Part(part) => part.name.is_empty() && part.args.values().all(is_plain),
        Lit::Held(_) | Lit::External(_) | Lit::Function(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Part;

    #[test]
    fn a_key_knows_the_name_and_the_digest() {
        let file = |is_executable| External::file("run".into(), b"abc".to_vec(), is_executable);
        // SHA-256 of "abc", FIPS 180-2 appendix B.1.
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let shown = |is_executable| Lit::External(file(is_executable).into()).to_string();
        assert_eq!(shown(false), format!("\"run\" sha256:{digest}"));
        assert_eq!(shown(true), format!("\"run\" sha256:{digest} executable"));
        let variable = |value: Option<&str>| External::variable("A".into(), value.map(Into::into));
        assert_ne!(variable(None).digest, variable(Some("")).digest);
        assert_ne!(variable(Some("x")).digest, variable(Some("")).digest);
    }

    #[test]
    fn only_the_kind_asked_for_is_taken() {
        let file = Lit::External(External::file("a".into(), Vec::new(), false).into());
        assert!(File::from_lit(&file).is_ok() && Program::from_lit(&file).is_err());
        assert_eq!(Option::<File>::from_lit(&Lit::from("")), Ok(None));
        assert!(Option::<File>::from_lit(&Lit::from("a")).is_err());
    }

    #[test]
    fn records_of_what_is_plain_are_taken_whole() {
        let record = |value: Lit| Lit::from(Part::default().with("a", value));
        let plain = record(vec![record(0.5.into()), record("x".into())].into());
        let Lit::Part(part) = &plain else { unreachable!("it is a record") };
        assert_eq!(Fields::from_lit(&plain), Ok(Fields(part.args.clone())));
        assert_eq!(Fields::from_lit(&Part::default().into()), Ok(Fields::default()));
        let file = Lit::External(External::file("a".into(), Vec::new(), false).into());
        for other in [record(Part::new("wcm").into()), record(file), Part::new("wcm").into()] {
            assert!(Fields::from_lit(&other).is_err(), "{other}");
        }
    }

    #[test]
    fn numbers_are_words() {
        let word = |lit: Lit| Word::from_lit(&lit).map(|Word(text)| text).ok();
        assert_eq!(word(0.5.into()).as_deref(), Some("0.5"));
        assert_eq!(word((-3_i64).into()).as_deref(), Some("-3"));
        assert_eq!(word("a b".into()).as_deref(), Some("a b"));
        assert_eq!(word(vec![1.0].into()), None);
    }
}
