//! Why nodes are others, in words.

use ivx_engine::{Change, Difference, Moved, Root, Setting, Shift};

use super::{Block, told_together};

/// How many reasons are told before the rest is counted.
const MOST: usize = 5;
/// How much of a value is told.
const VALUE_MAX: usize = 60;

/// What happened to the nodes of a block, and why: a headline, and the reasons if there are
/// several.
pub(super) fn headline(block: &Block, changes: &[Change]) -> (String, Vec<String>) {
    let what = match block.how {
        Moved::Rekeyed => "re-keyed",
        Moved::Remade => "came out otherwise, of the same key",
        Moved::Failed if block.roots.is_empty() => "failed, of the same key",
        Moved::Failed => "failed, re-keyed",
        Moved::Skipped => "skipped",
        Moved::NotRun => "not run: the run ended before",
        Moved::Mended => "with a result again",
        Moved::Renamed => "renamed",
        Moved::Added => "new",
        Moved::Gone => "gone",
    };
    let mut reasons: Vec<String> = block.roots.iter().map(|root| because(root, changes)).collect();
    reasons.dedup();
    match &reasons[..] {
        [] => (what.to_owned(), reasons),
        [one] => (format!("{what} because {one}"), Vec::new()),
        _ => {
            let n_more = reasons.len().saturating_sub(MOST);
            reasons.truncate(MOST);
            if n_more > 0 {
                reasons.push(format!("and {n_more} other reasons"));
            }
            (format!("{what} because"), reasons)
        }
    }
}

/// `8 small/gap`, and what is to be said of these alone.
pub(super) fn own(shift: &Shift, block: &Block) -> String {
    let told = format!("{} {}", shift.nodes.len(), shift.binding);
    let roots: Vec<String> = match block.how {
        how if told_together(how) => Vec::new(),
        _ => shift.roots.iter().map(|root| shortened(&root.to_string())).collect(),
    };
    if roots.is_empty() { told } else { format!("{told} ({})", roots.join("; ")) }
}

/// A reason, by the parameter that made it where there is one.
fn because(root: &Root, changes: &[Change]) -> String {
    let Root::Differs { binding, difference } = root else { return root.to_string() };
    if let Some((name, before, after)) = parameter(root, changes) {
        return format!("param {name}: {before} -> {after} ({} in {binding})", difference.part);
    }
    let short = |text: &Option<String>| text.as_deref().map(shortened);
    let (before, after) = (short(&difference.before), short(&difference.after));
    format!("{} in {binding}", Difference { part: difference.part.clone(), before, after })
}

/// The one parameter that went from the value before to the one after, as a part of a key did:
/// one of the experiment, else of a file.
pub(super) fn parameter<'c>(
    root: &Root,
    changes: &'c [Change],
) -> Option<(&'c str, &'c Setting, &'c Setting)> {
    let Root::Differs { binding, difference } = root else { return None };
    let value =
        |text: &'_ Option<String>| Some(text.as_deref()?.trim_end_matches(" values").to_owned());
    let (old, new) = (value(&difference.before)?, value(&difference.after)?);
    let alike = changes.iter().filter_map(|change| match change {
        Change::Param { name, before, after } if is(before, &old) && is(after, &new) => {
            Some((name.as_str(), before, after))
        }
        _ => None,
    });
    let experiment = binding.split('/').next()?;
    let is_own = |name: &str| name.split_once('.').is_some_and(|(of, _)| of == experiment);
    let (own, others): (Vec<_>, Vec<_>) = alike.partition(|(name, ..)| is_own(name));
    match (&own[..], &others[..]) {
        ([one], _) | ([], [one]) => Some(*one),
        _ => None,
    }
}

/// Whether a parameter's value is what a key says.
fn is(setting: &Setting, text: &str) -> bool {
    let shown = setting.to_string();
    let numbers = shown.parse::<f64>().ok().zip(text.parse::<f64>().ok());
    let plain = matches!(setting, Setting::Text(own) if own == text);
    shown == text || plain || numbers.is_some_and(|(a, b)| a == b)
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= VALUE_MAX {
        return text.to_owned();
    }
    text.chars().take(VALUE_MAX).collect::<String>() + ".."
}

#[cfg(test)]
mod tests {
    use ivx_engine::Part;

    use super::*;

    fn change(name: &str, before: Setting, after: Setting) -> Change {
        Change::Param { name: name.to_owned(), before, after }
    }

    fn differs(before: &str, after: &str) -> Root {
        let part = Part::Argument("train.steps".to_owned());
        let (before, after) = (Some(before.to_owned()), Some(after.to_owned()));
        let difference = Difference { part, before, after };
        Root::Differs { binding: "e/fit".to_owned(), difference }
    }

    #[test]
    fn a_parameter_is_blamed_if_it_alone_went_that_way() {
        let own = change("e.steps", Setting::Int(8), Setting::Int(16));
        let file = change("lib.steps", Setting::Int(8), Setting::Int(16));
        let told = "param e.steps: 8 -> 16 (`train.steps` in e/fit)";
        assert_eq!(because(&differs("8.0", "16.0"), &[own.clone(), file.clone()]), told);
        let told = "param lib.steps: 8 -> 16 (`train.steps` in e/fit)";
        assert_eq!(because(&differs("8", "16"), &[file]), told);
        let other = change("e.more", Setting::Int(8), Setting::Int(16));
        let told = "`train.steps` was 8, is 16 in e/fit";
        assert_eq!(because(&differs("8", "16"), &[own.clone(), other]), told);
        assert_eq!(because(&differs("8", "16"), &[]), told);
        assert_eq!(parameter(&differs("8", "17"), &[own]), None);
        let text = |text: &str| Setting::Text(text.to_owned());
        let list = change("e.sizes", text("[8]"), text("[9]"));
        assert!(because(&differs("[8]", "[9]"), &[list]).starts_with("param e.sizes"));
        let long = because(&differs(&"8".repeat(100), "16"), &[]);
        assert!(long.len() < 120 && long.contains("88..,"), "{long}");
    }
}
