//! `ivx completions`

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write;

use clap::{Arg, Command, CommandFactory as _};
use clap_complete::{Shell, generate};

use crate::args::{self, Args};
use crate::{OK, Trouble};

pub(crate) fn completions(args: &args::Completions, out: &mut dyn Write) -> Result<u8, Trouble> {
    let mut command = Args::command();
    // It panics where it cannot write.
    let mut script = Vec::new();
    generate(args.shell, &mut command, "ivx", &mut script);
    let mut script = String::from_utf8_lossy(&script).into_owned();
    // Where a spec is wanted, other files are in the way.
    match args.shell {
        Shell::Bash => script += &bash(&command),
        Shell::Zsh => script = zsh(script, &command),
        Shell::Fish => script += &fish(&command),
        _ => {}
    }
    out.write_all(script.as_bytes())?;
    Ok(OK)
}

/// The subcommands that are given a spec, and the argument that is it.
fn given_specs(command: &Command) -> impl Iterator<Item = (&str, &Arg)> {
    command.get_subcommands().filter_map(|own| {
        let spec = own.get_positionals().find(|arg| {
            let names = arg.get_value_names().unwrap_or_default();
            names.iter().any(|name| name.split('|').any(|name| name == "SPEC"))
        });
        spec.map(|spec| (own.get_name(), spec))
    })
}

/// A function around that of the script, which offers specs and folders where it would offer any file.
fn bash(command: &Command) -> String {
    let names: Vec<&str> = given_specs(command).map(|(name, _)| name).collect();
    let mut options = BTreeSet::new();
    for own in command.get_subcommands().filter(|own| names.contains(&own.get_name())) {
        for option in own.get_opts().filter(|option| option.get_action().takes_values()) {
            options.extend(option.get_long().map(|long| format!("--{long}")));
            options.extend(option.get_short().map(|short| format!("-{short}")));
        }
    }
    let options: Vec<String> = options.into_iter().collect();
    format!(
        r#"
_ivx_specs() {{
    _ivx "$@"
    [[ $COMP_CWORD -ge 2 && "$2" != -* ]] || return 0
    case "${{COMP_WORDS[1]}}" in
        {}) ;;
        *) return 0 ;;
    esac
    case "$3" in
        {}) return 0 ;;
    esac
    if [[ "${{BASH_VERSINFO[0]}}" -ge 4 ]]; then
        compopt -o filenames
    fi
    local IFS=$'\n'
    COMPREPLY=( $(compgen -f -X '!*.ivx' -- "$2") $(compgen -d -- "$2") )
}}

complete -F _ivx_specs -o bashdefault -o default ivx
"#,
        names.join("|"),
        options.join("|"),
    )
}

/// The script, in which arguments that are specs are such files.
fn zsh(mut script: String, command: &Command) -> String {
    for (_, spec) in given_specs(command) {
        let help = spec.get_help().map(ToString::to_string).unwrap_or_default();
        let start =
            format!(":{} -- {}", spec.get_id(), help.replace('[', "\\[").replace(']', "\\]"));
        script =
            script.replace(&format!("{start}:_files'"), &format!("{start}:_files -g \"*.ivx\"'"));
    }
    script
}

/// Lines by which specs are offered before other files.
fn fish(command: &Command) -> String {
    let mut lines = String::new();
    for (name, _) in given_specs(command) {
        let when = format!("__fish_ivx_using_subcommand {name}");
        writeln!(lines, "complete -c ivx -n \"{when}\" -k -a \"(__fish_complete_suffix .ivx)\"")
            .expect("strings take everything");
    }
    lines
}
