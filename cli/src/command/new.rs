//! `ivx new`

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

use crate::args::New;
use crate::source::is_spec;
use crate::{At as _, OK, Trouble, WRONG, project};

/// What a spec begins as; the name of the experiment stands for `first`.
const TEMPLATE: &str = include_str!("new.ivx");

pub(crate) fn new(args: &New, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let path =
        if is_spec(&args.name) { args.name.clone() } else { args.name.with_added_extension("ivx") };
    let name = project::stem(&path);
    if !is_name(&name) {
        writeln!(err, "error: `{name}` cannot be the name of an experiment")?;
        writeln!(err, "help: use letters, digits and `_`, and begin with a letter")?;
        return Ok(WRONG);
    }
    match write_new(&path, &TEMPLATE.replace("experiment first", &format!("experiment {name}"))) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            writeln!(err, "error: `{}` is already there", path.display())?;
            return Ok(WRONG);
        }
        Err(error) => return Err(error).at(&path),
    }
    writeln!(out, "wrote {0}; run it with `ivx exec {0}`", path.display())?;
    Ok(OK)
}

/// Writes a file that is not there yet.
fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())
}

/// Whether the language can read it as a name.
fn is_name(name: &str) -> bool {
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let reserved = ivx_grammar::parse(&format!("edition \"2026\"\nlet {name} = 1"), 0);
    name.chars().all(letters) && reserved.1.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_language() {
        for name in ["first", "a_2", "_x"] {
            assert!(is_name(name), "{name}");
        }
        for name in ["", "2a", "a-b", "let", "a = 1\nlet b"] {
            assert!(!is_name(name), "{name}");
        }
    }
}
