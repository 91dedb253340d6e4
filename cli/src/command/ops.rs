//! `ivx ops`

use std::io::Write;

use ivx_grammar::suggest;
use ivx_library::registry;
use ivx_op::{Decl, Registry};

use crate::args::Ops;
use crate::reference::{body, groups};
use crate::{OK, Trouble, WRONG};

pub(crate) fn ops(args: &Ops, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let registry = registry();
    if let Some(name) = &args.name {
        let decls = meant(&registry, name);
        if decls.is_empty() {
            let help = suggest(name, registry.decls().map(|decl| decl.name)).map(String::from);
            writeln!(err, "error: no operation or part is called `{name}`")?;
            if let Some(help) = help {
                writeln!(err, "help: {help}")?;
            }
            return Ok(WRONG);
        }
        for (i, decl) in decls.iter().enumerate() {
            let apart = if i == 0 { "" } else { "\n" };
            write!(out, "{apart}{decl}\n\n{}", body(decl))?;
        }
        return Ok(OK);
    }
    for (title, decls) in groups(&registry) {
        writeln!(out, "{title}")?;
        for decl in decls {
            writeln!(out, "  {:<18} {}", decl.name, first_sentence(decl.docs))?;
        }
        writeln!(out)?;
    }
    writeln!(out, "`ivx ops NAME` shows one in full.")?;
    Ok(OK)
}

/// What is called so, and what says that it is written so.
fn meant<'r>(registry: &'r Registry, name: &str) -> Vec<&'r Decl> {
    let written = [format!("written `{name}("), format!("written `{name}`")];
    let is_written = |decl: &&Decl| written.iter().any(|as_this| decl.docs.contains(as_this));
    let others = registry.decls().filter(|decl| decl.name != name).filter(is_written);
    registry.decl(name).into_iter().chain(others).collect()
}

/// What a doc comment says before its first full stop, on one line.
fn first_sentence(docs: &str) -> String {
    let paragraph = docs.trim().lines().take_while(|line| !line.trim().is_empty());
    let line = paragraph.map(str::trim).collect::<Vec<_>>().join(" ");
    let end = line.match_indices(". ").find(|(i, _)| !line[..*i].ends_with("Eqn"));
    end.map_or(line.clone(), |(i, _)| line[..=i].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sentence_is_whole() {
        let docs = " The mean of the\n lowest scores (Eqn. 2.7a). Averse.\n\n More.\n";
        assert_eq!(first_sentence(docs), "The mean of the lowest scores (Eqn. 2.7a).");
        assert_eq!(first_sentence(" One"), "One");
    }

    #[test]
    fn what_is_written_otherwise_than_it_is_called_is_found() {
        let registry = registry();
        let check = |name: &str, expected: &[&str]| {
            let found: Vec<&str> = meant(&registry, name).iter().map(|decl| decl.name).collect();
            assert_eq!(found, expected, "{name}");
        };
        check("argmin", &["argmin_over"]);
        check("argmax", &["argmax", "argmax_over"]);
        check("max", &["max", "maximum"]);
        check("<", &["less"]);
        check("train", &["train"]);
        check("argm", &[]);
    }
}
