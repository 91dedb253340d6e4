//! `ivx explain`

use std::io::Write;

use ivx_grammar::{Code, suggest};

use crate::args::Explain;
use crate::{OK, Trouble, WRONG};

pub(crate) fn explain(
    args: &Explain,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(wanted) = &args.code else {
        for code in Code::ALL {
            writeln!(out, "{code}  {}", code.docs().trim())?;
        }
        writeln!(out, "\n`ivx explain CODE` shows one with an example.")?;
        return Ok(OK);
    };
    let Some(code) = Code::ALL.iter().find(|code| names(wanted, **code)) else {
        writeln!(err, "error: no fault has the code `{wanted}`")?;
        let known: Vec<String> = Code::ALL.iter().map(Code::to_string).collect();
        if let Some(help) =
            suggest(&wanted.to_uppercase(), known.iter().map(String::as_str)).map(String::from)
        {
            writeln!(err, "help: {help}")?;
        }
        return Ok(WRONG);
    };
    write!(out, "{}", page(*code))?;
    Ok(OK)
}

/// Whether a code is meant by what was typed: `IVX0302`, `ivx0302` or `302`.
fn names(typed: &str, code: Code) -> bool {
    typed.eq_ignore_ascii_case(&code.to_string()) || typed == (code as u16).to_string()
}

macro_rules! pages {
    ($($code:ident $page:literal)+) => {
        /// What there is to say about a fault.
        fn page(code: Code) -> &'static str {
            match code {
                $(Code::$code => include_str!(concat!("../../../docs/errors/", $page, ".md")),)+
            }
        }
    };
}

pages! {
    Syntax "IVX0101"
    Nesting "IVX0102"
    Number "IVX0103"
    Edition "IVX0104"
    StrayDoc "IVX0105"
    File "IVX0201"
    Cycle "IVX0202"
    Outside "IVX0203"
    UnknownName "IVX0301"
    UnknownCall "IVX0302"
    UnknownArgument "IVX0303"
    MissingArgument "IVX0304"
    TwiceGiven "IVX0305"
    UnknownAxis "IVX0306"
    UnknownLabel "IVX0307"
    UnknownParameter "IVX0308"
    Shadowing "IVX0309"
    Recursion "IVX0310"
    MissingArm "IVX0311"
    Type "IVX0401"
    Range "IVX0402"
    NotLiteral "IVX0403"
    Dimensions "IVX0404"
    Axis "IVX0405"
    ClaimAxes "IVX0406"
    Kind "IVX0407"
    Published "IVX0408"
    Rule "IVX0409"
    TooLarge "IVX0501"
    Unused "IVX0601"
    SharedStream "IVX0602"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_its_own_page() {
        for code in Code::ALL {
            let title = page(*code).lines().next().unwrap_or_default();
            let docs = code.docs().trim().trim_end_matches('.');
            let expected = format!("# {code}: {docs}");
            assert!(title.eq_ignore_ascii_case(&expected), "{title}\n{expected}");
        }
    }

    #[test]
    fn codes_are_named_in_three_ways() {
        for typed in ["IVX0302", "ivx0302", "302"] {
            assert!(names(typed, Code::UnknownCall), "{typed}");
            assert!(!names(typed, Code::Syntax), "{typed}");
        }
    }
}
