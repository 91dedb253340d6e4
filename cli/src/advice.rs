//! What to write instead of a command line that does not read, beside what clap says.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::source::{is_spec, listed, specs};

/// A help for a command line, if there is one.
///
/// - `args`: the command line, the first being the command's name.
pub(crate) fn advice(usage: &clap::Error, args: &[OsString]) -> Option<String> {
    let text = |kind| match usage.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    match usage.kind() {
        ErrorKind::UnknownArgument => {
            let unknown = text(ContextKind::InvalidArg)?;
            split_set(args).or_else(|| {
                // Whatever is called alike: `--members` is no `--memory`.
                if let Some(name) = unknown.strip_prefix("--") {
                    let name = name.split('=').next().unwrap_or(name);
                    Some(format!("a parameter of the spec is set by `--set {name}=VALUE`"))
                } else if unknown.contains('=') {
                    Some(format!("a parameter is set by `--set {unknown}`"))
                } else if is_spec(Path::new(unknown)) {
                    let how = "a spec of its own can `include` several";
                    Some(format!("one spec is named at a time; {how}"))
                } else {
                    None
                }
            })
        }
        ErrorKind::InvalidSubcommand => {
            let unknown = text(ContextKind::InvalidSubcommand)?;
            let spec = args
                .iter()
                .skip(1)
                .filter_map(|arg| arg.to_str())
                .find(|arg| is_spec(Path::new(arg)));
            let is_run = ["run", "execute", "start"].contains(&unknown);
            let spec = spec.or(is_run.then_some("SPEC"))?;
            Some(format!("a spec is run by `ivx exec {spec}`"))
        }
        ErrorKind::MissingRequiredArgument => {
            let Some(ContextValue::Strings(missing)) = usage.get(ContextKind::InvalidArg) else {
                return None;
            };
            let here = specs(Path::new("."));
            let wanted = missing.iter().any(|missing| missing == "<SPEC>") && !here.is_empty();
            wanted.then(|| format!("specs here: {}", listed(&here)))
        }
        _ => None,
    }
}

/// Of `--set NAME VALUE`, in two words.
fn split_set(args: &[OsString]) -> Option<String> {
    let words: Vec<&str> = args.iter().filter_map(|arg| arg.to_str()).collect();
    let split = words.windows(3).find(|words| words[0] == "--set" && !words[1].contains('='))?;
    let value = split[2].trim_start_matches('=');
    let value = if value.is_empty() { "VALUE" } else { value };
    Some(format!("name and value are one word: `--set {}={value}`", split[1].trim_end_matches('=')))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::args::Args;

    #[track_caller]
    fn check(line: &str, expected: Option<&str>) {
        let args: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let usage = Args::try_parse_from(&args).expect_err(line);
        assert_eq!(advice(&usage, &args).as_deref(), expected, "{usage}");
    }

    #[test]
    fn wrong_command_lines_lead_to_right_ones() {
        let one = "one spec is named at a time; a spec of its own can `include` several";
        check("ivx exec a.ivx b.ivx", Some(one));
        check("ivx exec a.ivx n=3", Some("a parameter is set by `--set n=3`"));
        let set = "a parameter of the spec is set by `--set members=VALUE`";
        check("ivx exec a.ivx --members 3", Some(set));
        check("ivx exec a.ivx --members=3", Some(set));
        let words = "name and value are one word: `--set n=3`";
        check("ivx exec a.ivx --set n 3", Some(words));
        check("ivx exec --set n 3 a.ivx", Some(words));
        check("ivx exec --set n = 3 a.ivx", Some("name and value are one word: `--set n=VALUE`"));
        check("ivx run a.ivx", Some("a spec is run by `ivx exec a.ivx`"));
        check("ivx run", Some("a spec is run by `ivx exec SPEC`"));
        check("ivx a.ivx --jobs 3", Some("a spec is run by `ivx exec a.ivx`"));
        check("ivx chekc", None);
    }
}
