//! `ivx exec --watch`

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use ivx_engine::{Claim, Results, verdict};
use serde_json::{Value, json};

use super::count;
use super::exec::{Ended, once};
use crate::args::Format;
use crate::changes::{Changes, Read, look};
use crate::ending::{begin_anew, is_ending, stop_run};
use crate::render::visible;
use crate::{STOPPED, Trouble, WRONG, args, project};

/// Runs a spec, and again whenever a file changes that it read, until the command is asked to end.
pub(super) fn watch(
    args: &args::Exec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let is_json = args.format == Format::Json;
    let (mut before, mut last) = (None, None);
    loop {
        begin_anew();
        let mut seen = None;
        let mut see = |read: &Read, out: &mut dyn Write| {
            if let Some(before) = &before {
                tell_changes(&changes(before, read), is_json, out)?;
            }
            seen = Some((read.clone(), watched(read)?));
            Ok(())
        };
        let ended = match (once(args, &mut see, out, err), &before) {
            // It was there before, and may be again.
            (Err(trouble @ Trouble::Spec { .. }), Some(before)) => {
                see(&before.keys().map(|path| (path.clone(), look(path))).collect(), out)?;
                writeln!(err, "error: {trouble}")?;
                Ended { code: WRONG, found: None }
            }
            (ended, _) => ended?,
        };
        if is_ending() {
            return Ok(STOPPED);
        }
        if ended.code == WRONG && is_json {
            writeln!(out, "{}", json!({ "event": "wrong" }))?;
        }
        if let (Some(last), Some(found)) = (&last, &ended.found) {
            tell_moved(&moved(last, found), is_json, out)?;
        }
        last = ended.found.or(last);
        let (read, mut changes) = seen.expect("a run that began has read something");
        if !changes.is_noticed() {
            let n_files = own(read.keys()).len();
            if is_json {
                writeln!(out, "{}", json!({ "event": "watching", "files": n_files }))?;
            } else {
                writeln!(out, "watching {}: Ctrl-C ends", count(n_files, "file"))?;
            }
        }
        out.flush()?;
        if !changes.wait() {
            return Err(unwatched("the system stopped to tell of any"));
        }
        before = Some(read);
    }
}

fn watched(read: &Read) -> Result<Changes, Trouble> {
    Changes::of(read.clone(), stop_run).map_err(|error| unwatched(&error.to_string()))
}

fn unwatched(why: &str) -> Trouble {
    let path = "`--watch`".to_owned();
    Trouble::Content { path, why: format!("changes of files cannot be noticed: {why}") }
}

/// The paths, but of one file that several lead to only where it lies.
fn own<'a>(paths: impl Iterator<Item = &'a PathBuf>) -> Vec<&'a PathBuf> {
    let paths: BTreeSet<&PathBuf> = paths.collect();
    let leads = |path: &PathBuf| {
        fs::canonicalize(path).is_ok_and(|real| real != *path && paths.contains(&real))
    };
    paths.iter().filter(|path| !leads(path)).copied().collect()
}

/// What became of a file.
type Changed<'a> = (&'a PathBuf, &'static str);

/// The files that are no longer as they were.
fn changes<'a>(before: &Read, now: &'a Read) -> Vec<Changed<'a>> {
    let others =
        now.iter().filter(|(path, found)| before.get(*path).is_some_and(|old| old != *found));
    let how = |path| match (before[path], now[path]) {
        (_, None) => "gone",
        (None, _) => "there",
        _ => "changed",
    };
    own(others.map(|(path, _)| path)).into_iter().map(|path| (path, how(path))).collect()
}

fn tell_changes(changes: &[Changed<'_>], is_json: bool, out: &mut dyn Write) -> io::Result<()> {
    if is_json {
        let files =
            changes.iter().map(|(path, how)| json!({ "file": project::shown(path), "how": how }));
        let files: Vec<Value> = files.collect();
        return writeln!(out, "{}", json!({ "event": "changed", "files": files }));
    }
    writeln!(out)?;
    for (path, how) in changes {
        writeln!(out, "{how}: {}", visible(&project::shown(path)))?;
    }
    Ok(())
}

/// A claim that stands otherwise than before, is new or is gone.
struct Moved<'a> {
    experiment: &'a str,
    words: &'a str,
    before: Option<String>,
    after: Option<String>,
}

/// The claims that stand otherwise than before.
fn moved<'a>(before: &'a Results, after: &'a Results) -> Vec<Moved<'a>> {
    let all = |results: &'a Results| {
        results.experiments.iter().flat_map(|(experiment, found)| {
            found.claims.keys().map(move |words| (experiment.as_str(), words.as_str()))
        })
    };
    let of = |results: &Results, (experiment, words): (&str, &str)| {
        results.experiments.get(experiment).and_then(|found| found.claims.get(words)).map(stands)
    };
    let names: BTreeSet<(&str, &str)> = all(before).chain(all(after)).collect();
    let each = names.into_iter().map(|name| {
        let (experiment, words) = name;
        Moved { experiment, words, before: of(before, name), after: of(after, name) }
    });
    each.filter(|moved| moved.before != moved.after).collect()
}

/// The verdict on a claim, with that among its family where it is another.
fn stands(claim: &Claim) -> String {
    let alone = verdict(claim.outcome);
    match claim.corrected.filter(|among| Some(among.outcome) != claim.outcome) {
        Some(among) => format!("{alone}, {} among {}", among.outcome, among.of),
        None => alone,
    }
}

fn tell_moved(all: &[Moved<'_>], is_json: bool, out: &mut dyn Write) -> io::Result<()> {
    if is_json {
        let verdicts = all.iter().map(|moved| {
            let Moved { experiment, words, before, after } = moved;
            json!({ "experiment": experiment, "claim": words, "before": before, "after": after })
        });
        let verdicts: Vec<Value> = verdicts.collect();
        return writeln!(out, "{}", json!({ "event": "moved", "verdicts": verdicts }));
    }
    match all.len() {
        0 => writeln!(out, "no verdict moved")?,
        n => writeln!(out, "{} moved:", count(n, "verdict"))?,
    }
    for Moved { experiment, words, before, after } in all {
        let how = match (before, after) {
            (Some(before), Some(after)) => format!("{before} → {after}"),
            (_, Some(after)) => format!("new, {after}"),
            _ => "gone".to_owned(),
        };
        writeln!(out, "  {how}  {experiment}: {}", visible(words))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use ivx_engine::{Corrected, ExperimentResults};
    use ivx_op::Outcome;

    use super::*;

    fn results(claims: &[(&str, Outcome, Option<Outcome>)]) -> Results {
        let claim = |(words, outcome, among): &(&str, Outcome, Option<Outcome>)| {
            let corrected =
                among.map(|outcome| Corrected { of: 2, p: 0.1, adjusted: 0.2, outcome });
            ((*words).to_owned(), Claim { outcome: Some(*outcome), corrected, ..Claim::default() })
        };
        let found = ExperimentResults {
            claims: claims.iter().map(claim).collect(),
            ..ExperimentResults::default()
        };
        Results { experiments: [("e".into(), found)].into(), ..Results::default() }
    }

    #[test]
    fn verdicts_that_moved_are_told_from_what_to_what() {
        use Outcome::{Fails, Holds, Undecided};
        let before =
            results(&[("same", Holds, None), ("flips", Fails, None), ("old", Holds, None)]);
        let after = results(&[
            ("same", Holds, Some(Undecided)),
            ("flips", Holds, None),
            ("x\n", Fails, None),
        ]);
        let told = |before, after| {
            let mut out = Vec::new();
            tell_moved(&moved(before, after), false, &mut out).expect("vectors take everything");
            String::from_utf8_lossy(&out).into_owned()
        };
        let expected = "4 verdicts moved:\n  fails → holds  e: flips\n  gone  e: old\n  \
                        holds → holds, undecided among 2  e: same\n  new, fails  e: x\\n\n";
        assert_eq!(told(&before, &after), expected);
        assert_eq!(told(&after, &after), "no verdict moved\n");
    }

    #[test]
    fn files_that_came_and_went_are_told() {
        let digest = |text: &str| Some(ivx_cache::Digest::of(text.as_bytes()));
        let read = |found: &[(&str, Option<ivx_cache::Digest>)]| -> Read {
            found.iter().map(|(path, digest)| (PathBuf::from(path), *digest)).collect()
        };
        let before =
            read(&[("/a", digest("1")), ("/b", digest("1")), ("/c", None), ("/d", digest("1"))]);
        let now = read(&[
            ("/a", digest("2")),
            ("/b", None),
            ("/c", digest("1")),
            ("/d", digest("1")),
            ("/e", digest("1")),
        ]);
        let told: Vec<_> =
            changes(&before, &now).into_iter().map(|(path, how)| (path.to_str(), how)).collect();
        assert_eq!(told, [(Some("/a"), "changed"), (Some("/b"), "gone"), (Some("/c"), "there")]);
    }
}
