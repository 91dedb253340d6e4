//! Ends programs that would outlive this process, however it was ended.
//!
//! Nothing can run in a process that is killed by `SIGKILL`. So a shell is told which groups run, and
//! kills what is left when nobody is there any more to tell it anything.

use std::io::Write as _;
use std::os::unix::process::CommandExt as _;
use std::process::{ChildStdin, Command, Stdio};
use std::sync::{LazyLock, Mutex, PoisonError};

/// Keeps the groups that began and did not end; at the end of its input it kills them.
const SCRIPT: &str = "
    left=
    while read -r what group; do
        case $what in
            began) left=\"$left $group\" ;;
            ended)
                others=
                for other in $left; do
                    [ \"$other\" = \"$group\" ] || others=\"$others $other\"
                done
                left=$others ;;
        esac
    done
    for group in $left; do kill -9 -\"$group\"; done
";

/// Where the shell listens; none where there is no shell.
static WATCH: LazyLock<Mutex<Option<ChildStdin>>> = LazyLock::new(|| {
    let mut shell = Command::new("/bin/sh");
    shell.args(["-c", SCRIPT]).env_clear().current_dir("/");
    shell.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
    // Of its own group, so that what ends this process from a terminal does not end it too.
    let shell = shell.process_group(0).spawn();
    Mutex::new(shell.ok().and_then(|mut shell| shell.stdin.take()))
});

/// Sees to it that the shell listens. A program is started after that, so that there is hardly a
/// moment in which nobody would end it.
pub(crate) fn begin() {
    LazyLock::force(&WATCH);
}

/// Says that a group of processes runs.
pub(crate) fn began(group: u32) {
    say("began", group);
}

/// Says that it does not any more.
pub(crate) fn ended(group: u32) {
    say("ended", group);
}

fn say(what: &str, group: u32) {
    let mut watch = WATCH.lock().unwrap_or_else(PoisonError::into_inner);
    let said = watch.as_mut().map(|watch| watch.write_all(format!("{what} {group}\n").as_bytes()));
    if said.is_some_and(|said| said.is_err()) {
        *watch = None;
    }
}
