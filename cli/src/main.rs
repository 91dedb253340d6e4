//! The `ivx` command.

use std::io::Write as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
    // Without a handler the command ends at once, and loses nothing but time.
    let handled = ctrlc::set_handler(ivx_cli::interrupt);
    if let Err(error) = handled {
        let _ = writeln!(err, "note: a run cannot be stopped cleanly: {error}");
    }
    ExitCode::from(ivx_cli::run(std::env::args_os(), &mut out, &mut err))
}
