//! How the report says that a run was made.

use std::path::Path;

use ivx_cache::Digest;
use ivx_engine::{Origin, platform};

use crate::account::Account;
use crate::args::Spec;
use crate::date::spell_moment;

/// - `results`: the text of what came out.
pub(super) fn origin(args: &Spec, results: &str, run: &Account<'_>) -> Origin {
    let &Account { files, jobs, began, took, .. } = run;
    let fact = |what: &str, value: String| (what.to_owned(), value);
    Origin {
        command: command(args),
        facts: vec![
            fact("ivx", env!("CARGO_PKG_VERSION").to_owned()),
            fact("its library's source", ivx_library::SOURCE_DIGEST.to_owned()),
            fact("the spec's files", files.digest.to_string()),
            fact("results.ron", Digest::of(results.as_bytes()).to_string()),
            fact("platform", platform()),
            fact("nodes at once", jobs.to_string()),
            fact("started", spell_moment(began)),
        ],
        seconds: took.as_secs_f64(),
    }
}

/// The command as a shell takes it, from the folder of the spec's project.
fn command(Spec { path, profile, sets, .. }: &Spec) -> String {
    let mut words = vec!["ivx exec".to_owned(), word(&shown(path))];
    words.extend(profile.iter().map(|profile| format!("--profile {}", word(profile))));
    words.extend(sets.iter().map(|set| format!("--set {}", word(set))));
    words.join(" ")
}

/// A path without what is above the current folder.
fn shown(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(&here).unwrap_or(path).display().to_string()
}

/// A word, in quotes where a shell would read more into it.
fn word(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_command_as_it_was_meant() {
        let args = Spec {
            path: "a b.ivx".into(),
            profile: Some("quick".to_owned()),
            sets: vec!["n=3".to_owned(), "ke=wcm('x')".to_owned()],
            max_nodes: None,
        };
        let expected = "ivx exec 'a b.ivx' --profile quick --set n=3 --set 'ke=wcm('\\''x'\\'')'";
        assert_eq!(command(&args), expected);
    }
}
