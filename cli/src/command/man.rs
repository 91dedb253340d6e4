//! `ivx man`

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use clap::{Command, CommandFactory as _};
use clap_mangen::Man;

use crate::args::{self, Args};
use crate::replace::replace;
use crate::{At as _, OK, Trouble, project};

/// What the pages belong to, as their heads say.
const MANUAL: &str = "ivx manual";

pub(crate) fn man(args: &args::Man, out: &mut dyn Write) -> Result<u8, Trouble> {
    // Pages do not change with every library: they say nothing of it.
    let mut command =
        Args::command().version(env!("CARGO_PKG_VERSION")).disable_help_subcommand(true);
    command.build();
    let folder = project::real(&args.folder);
    fs::create_dir_all(&folder).at(&folder)?;
    let n = write(&command, &folder)?;
    writeln!(
        out,
        "{n} pages in {}: `man -l {}` shows the first",
        args.folder.display(),
        args.folder.join("ivx.1").display()
    )?;
    Ok(OK)
}

/// Writes the page of a command and those of its subcommands. Returns how many.
fn write(command: &Command, folder: &Path) -> Result<usize, Trouble> {
    let (file, text) = page(command)?;
    replace(&folder.join(file), &text)?;
    let mut n = 1;
    for own in command.get_subcommands().filter(|own| !own.is_hide_set()) {
        n += write(own, folder)?;
    }
    Ok(n)
}

/// What a page is called, and its text.
fn page(command: &Command) -> io::Result<(String, String)> {
    let man = Man::new(command.clone()).manual(MANUAL);
    let mut text = Vec::new();
    man.render(&mut text)?;
    Ok((man.get_filename(), String::from_utf8_lossy(&text).into_owned()))
}
