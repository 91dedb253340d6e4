//! The `ivx` command.

use std::io::Write as _;
use std::process::ExitCode;

/// A spec is many small pieces: with this one they are checked in three quarters of the time that the system's takes.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
    // Without a handler the command ends at once, and loses nothing but time.
    let handled = ctrlc::set_handler(ivx_cli::interrupt);
    if let Err(error) = handled {
        let _ = writeln!(err, "note: a run cannot be stopped cleanly: {error}");
    }
    ExitCode::from(ivx_cli::run(std::env::args_os(), &mut out, &mut err))
}
