//! The specs that documents show, tried.
//!
//! What follows ` ```ivx ` says what a block is: nothing for one that checks without a word, `run`
//! for one that runs, `misses` for one that runs and of which a node fails, `fails=IVX0302` for one with that fault and no other, `file=world.ivx` for a
//! file that the blocks after it can use. So do ` ```sh,file=run.sh ` and ` ```csv,file=data.csv `, for other files. `python` is
//! for one that has no fault but that Python with gymnasium is not found, and none where `IVX_PYTHON` names one; `procgen` for
//! one that has none but that Procgen is not found.

use ivx_grammar::Code;

use crate::project::{Project, Said};

/// Tries every block of a document, and says how many there are.
///
/// # Panics
/// If a block does not do what it should.
pub(crate) fn try_all(name: &str, document: &str) -> usize {
    let mut files: Vec<(&str, &str)> = Vec::new();
    let blocks = blocks(document);
    for block in &blocks {
        let place = format!("{name}:{}", block.line);
        if let Some(file) = block.info.strip_prefix("file=") {
            files.push((file, block.text));
            continue;
        }
        let project = Project::with(&files);
        if block.info == "python" {
            try_python(&project, block.text, &place);
            continue;
        }
        project.write("spec.ivx", block.text);
        if block.info == "procgen" {
            let said = project.run("check", "spec.ivx", &[]);
            let found = codes(&said);
            let absent = found == [Code::File.to_string()] && said.err.contains("cannot be played");
            assert!(found.is_empty() || absent, "{place}: {}{}", said.out, said.err);
            continue;
        }
        let runs = ["run", "misses"].contains(&block.info);
        let said = project.run(if runs { "exec" } else { "check" }, "spec.ivx", &[]);
        let expected: Vec<&str> = block.info.strip_prefix("fails=").into_iter().collect();
        assert!(block.info.is_empty() || runs || !expected.is_empty(), "{place}");
        assert_eq!(codes(&said), expected, "{place}: {}{}", said.out, said.err);
        if expected.is_empty() {
            let code = u8::from(block.info == "misses");
            assert_eq!(said.code, code, "{place}: {}{}", said.out, said.err);
        }
    }
    blocks.len()
}

/// Checks a spec that needs Python.
fn try_python(project: &Project, text: &str, place: &str) {
    let python = std::env::var("IVX_PYTHON");
    let given = python.as_ref().map(|python| format!("python: {python:?}, kwargs: "));
    project.write("spec.ivx", &text.replace("kwargs: ", given.as_deref().unwrap_or("kwargs: ")));
    let said = project.run("check", "spec.ivx", &[]);
    let found = codes(&said);
    let absent = python.is_err() && found == [Code::File.to_string()];
    assert!(found.is_empty() || absent, "{place}: {}{}", said.out, said.err);
}

/// The faults that a run told.
fn codes(said: &Said) -> Vec<&str> {
    let mut codes: Vec<&str> =
        said.err.lines().map(str::trim).filter(|line| line.starts_with("IVX")).collect();
    codes.dedup();
    codes
}

pub(crate) struct Block<'a> {
    /// What follows the language.
    info: &'a str,
    pub(crate) text: &'a str,
    /// The line on which it begins.
    line: usize,
}

/// The blocks of a document that are tried, in order.
pub(crate) fn blocks(document: &str) -> Vec<Block<'_>> {
    let mut blocks = Vec::new();
    let starts =
        ["\n```ivx", "\n```sh,file=", "\n```csv,file="].map(|fence| document.match_indices(fence));
    let mut starts: Vec<usize> = starts.into_iter().flatten().map(|(at, _)| at).collect();
    starts.sort_unstable();
    for at in starts {
        let fence =
            ["\n```ivx", "\n```sh", "\n```csv"].into_iter().find(|f| document[at..].starts_with(f));
        let fence = fence.expect("it begins with one of them");
        let (info, rest) = document[at + fence.len()..].split_once('\n').expect("a block has text");
        let text = rest.split_once("\n```").expect("a block ends").0;
        let line = document[..at].lines().count() + 2;
        blocks.push(Block { info: info.trim_start_matches(','), text, line });
    }
    blocks
}

#[test]
fn blocks_are_found() {
    let found = blocks(
        "a\n```ivx\nlet\n```\n\n```sh\nls\n```\n```ivx,run\nlet\n```\n```sh,file=f\nx\n```\n",
    );
    let found: Vec<_> = found.iter().map(|block| (block.info, block.text, block.line)).collect();
    assert_eq!(found, [("", "let", 3), ("run", "let", 10), ("file=f", "x", 13)]);
}
