//! Asks before something is deleted.

use std::io::{self, BufRead, IsTerminal as _, Write};

/// Whether what was told may be done, by a person's word. Where there is none to ask, it may not.
pub(super) fn consent(err: &mut dyn Write) -> io::Result<bool> {
    let is_person = io::stdin().is_terminal() && io::stderr().is_terminal();
    let mut input = io::stdin().lock();
    ask(is_person.then_some(&mut input as &mut dyn BufRead), err)
}

fn ask(person: Option<&mut dyn BufRead>, err: &mut dyn Write) -> io::Result<bool> {
    let Some(person) = person else {
        writeln!(err, "error: nothing is removed: there is nobody to ask, and no `--yes`")?;
        return Ok(false);
    };
    write!(err, "remove that? [y/N] ")?;
    err.flush()?;
    let mut answer = String::new();
    person.read_line(&mut answer)?;
    let agrees = ["y", "yes"].contains(&answer.trim().to_lowercase().as_str());
    if !agrees {
        writeln!(err, "nothing is removed")?;
    }
    Ok(agrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(answer: Option<&str>, expected: bool, says: &str) {
        let mut err = Vec::new();
        let mut bytes = answer.map(str::as_bytes);
        let person = bytes.as_mut().map(|bytes| bytes as &mut dyn BufRead);
        let agreed = ask(person, &mut err).expect("vectors take everything");
        let said = String::from_utf8_lossy(&err).into_owned();
        assert_eq!((agreed, said.contains(says)), (expected, true), "{said}");
    }

    #[test]
    fn nothing_is_taken_for_consent_but_consent() {
        check(None, false, "no `--yes`");
        for answer in ["y\n", "Yes\n", " y"] {
            check(Some(answer), true, "remove that?");
        }
        for answer in ["", "\n", "n\n", "yep\n", "no\n"] {
            check(Some(answer), false, "nothing is removed");
        }
    }
}
