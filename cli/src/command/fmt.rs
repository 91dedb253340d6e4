//! `ivx fmt`

use std::io::Write;

use ivx_grammar::format;

use super::tell;
use crate::args::Fmt;
use crate::replace::replace;
use crate::{FAILED, OK, Trouble, WRONG, source};

pub(crate) fn fmt(args: &Fmt, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let mut code = OK;
    for path in &args.paths {
        let shown = path.display().to_string();
        let text = match source::text(path) {
            Ok(text) => text,
            Err(error) => {
                return Err(Trouble::Spec { path: shown, why: source::no_spec(path, &error) });
            }
        };
        match format(&text) {
            Ok(formatted) if formatted == text => {}
            Ok(formatted) => {
                if args.check {
                    code = code.max(FAILED);
                } else {
                    replace(path, &formatted)?;
                }
                writeln!(out, "{shown}")?;
            }
            Err(faults) => {
                code = WRONG;
                tell(&faults, &[(shown, text)], err)?;
            }
        }
    }
    Ok(code)
}
