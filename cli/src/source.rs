//! Reads files that are text, and says where one is not.

use std::fs;
use std::io;
use std::path::Path;

use ivx_grammar::suggest;

/// The text of a file.
///
/// # Errors
/// If it cannot be read, or is no text: then with the place of the first byte that is none.
pub(crate) fn text(path: &Path) -> io::Result<String> {
    let kind = fs::metadata(path)?.file_type();
    if !kind.is_file() && !kind.is_dir() {
        // It may never end.
        return Err(io::Error::other("it is no file"));
    }
    String::from_utf8(fs::read(path)?).map_err(|error| not_text(error.as_bytes())).and_then(
        |text| {
            // These are characters, but not of any text that somebody wrote.
            if text.contains('\0') { Err(not_text(text.as_bytes())) } else { Ok(text) }
        },
    )
}

fn not_text(bytes: &[u8]) -> io::Error {
    let is_wide = match bytes {
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => true,
        // Without a mark, a letter beside nothing.
        [first, second, ..] => (*first == 0) != (*second == 0),
        _ => false,
    };
    let why = if is_wide {
        "it is UTF-16: save it as UTF-8".to_owned()
    } else {
        let valid = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), str::len);
        let nul = bytes[..valid].iter().position(|byte| *byte == 0);
        let place = nul.unwrap_or(valid);
        let before = String::from_utf8_lossy(&bytes[..place]);
        let line = 1 + before.matches('\n').count();
        let column = 1 + before.rsplit('\n').next().map_or(0, |last| last.chars().count());
        let (byte, help) = match bytes[place] {
            0 => (0, "it may be another kind of file"),
            byte => (byte, "save it as UTF-8"),
        };
        format!("it is not UTF-8 text: byte 0x{byte:02X} at line {line}, column {column}: {help}")
    };
    io::Error::new(io::ErrorKind::InvalidData, why)
}

/// Why a file cannot be read, for people.
pub(crate) fn plain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        _ => error.to_string(),
    }
}

/// Why a spec cannot be read, and what was perhaps meant.
pub(crate) fn no_spec(path: &Path, error: &io::Error) -> String {
    if path.as_os_str().is_empty() {
        return "the path of the spec is empty".to_owned();
    }
    if path.is_dir() {
        return match specs(path) {
            specs if specs.is_empty() => "it is a folder, without a spec in it".to_owned(),
            specs => format!("it is a folder; name a spec: {}", listed(&specs)),
        };
    }
    if error.kind() != io::ErrorKind::NotFound {
        return plain(error);
    }
    let with = path.with_added_extension("ivx");
    if with.is_file() {
        return format!("there is no such file: did you mean `{}`?", with.display());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return format!("there is no folder `{}`", folder.display());
    }
    let known = specs(folder);
    let name = if path.extension().is_none() { with } else { path.to_owned() };
    let name = name.display().to_string();
    let help = suggest(&name, known.iter().map(String::as_str)).map(String::from);
    match help {
        Some(help) => format!("there is no such file: {help}"),
        None if known.is_empty() => {
            "there is no such file, nor a spec beside it: `ivx new NAME` writes one".to_owned()
        }
        None => "there is no such file".to_owned(),
    }
}

/// Whether a path is called as specs are.
pub(crate) fn is_spec(path: &Path) -> bool {
    path.extension().is_some_and(|kind| kind == "ivx")
}

/// The specs in a folder, as they are named from here.
pub(crate) fn specs(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let specs = paths.filter(|path| is_spec(path));
    let shown =
        |path: std::path::PathBuf| path.strip_prefix("./").unwrap_or(&path).display().to_string();
    let mut specs: Vec<String> = specs.map(shown).collect();
    specs.sort();
    specs
}

/// The first few names.
pub(crate) fn listed(names: &[String]) -> String {
    const MOST: usize = 8;
    let quoted: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", quoted.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(bytes: &[u8], expected: Result<&str, &str>) {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let path = folder.path().join("x.ivx");
        fs::write(&path, bytes).expect("files can be written");
        let found = text(&path).map_err(|error| plain(&error));
        assert_eq!(found.as_deref().map_err(String::as_str), expected);
    }

    #[cfg(unix)]
    #[test]
    fn what_may_never_end_is_not_read() {
        let error = text(Path::new("/dev/null")).expect_err("it is no file");
        assert_eq!(plain(&error), "it is no file");
    }

    #[test]
    fn the_first_byte_that_is_no_text_is_named() {
        check("naïve\n".as_bytes(), Ok("naïve\n"));
        check(b"", Ok(""));
        let why = "it is not UTF-8 text: byte 0xE9 at line 1, column 4: save it as UTF-8";
        check(b"caf\xE9", Err(why));
        let why = "it is not UTF-8 text: byte 0xFF at line 3, column 3: save it as UTF-8";
        check("a\né\né \u{ff}".as_bytes(), Ok("a\né\né \u{ff}"));
        check(b"a\n\xC3\xA9\n\xC3\xA9 \xFF", Err(why));
        let why = "it is not UTF-8 text: byte 0xC3 at line 2, column 1: save it as UTF-8";
        check(b"a\n\xC3", Err(why));
        let why =
            "it is not UTF-8 text: byte 0x00 at line 1, column 5: it may be another kind of file";
        check(b"text\0\xFF", Err(why));
        for wide in [&b"\xFF\xFEe\0d\0"[..], b"\xFE\xFF\0e\0d", b"e\0d\0", b"\0e\0d"] {
            check(wide, Err("it is UTF-16: save it as UTF-8"));
        }
    }

    #[test]
    fn a_spec_that_is_not_there_leads_to_one_that_is() {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let said = |name: &str| {
            let path = folder.path().join(name);
            let error = fs::canonicalize(&path).err();
            let error = error.unwrap_or(io::ErrorKind::IsADirectory.into());
            no_spec(&path, &error).replace(&format!("{}/", folder.path().display()), "")
        };
        assert_eq!(
            said("demo"),
            "there is no such file, nor a spec beside it: `ivx new NAME` writes one"
        );
        fs::create_dir(folder.path().join("sub")).expect("the folder is empty");
        assert_eq!(said("sub"), "it is a folder, without a spec in it");
        for name in ["demo.ivx", "other.ivx"] {
            fs::write(folder.path().join(name), "").expect("files can be written");
        }
        assert_eq!(said("demo"), "there is no such file: did you mean `demo.ivx`?");
        assert_eq!(said("dmeo.ivx"), "there is no such file: did you mean `demo.ivx`?");
        assert_eq!(said("othr"), "there is no such file: did you mean `other.ivx`?");
        assert_eq!(said(""), "it is a folder; name a spec: `demo.ivx`, `other.ivx`");
        assert!(said("no/demo.ivx").starts_with("there is no folder"));
    }
}
