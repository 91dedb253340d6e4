//! Labels as LaTeX, set by pdfLaTeX and read back.

use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use ivx_op::escape::latex;

/// Labels of every sign alone, doubled, before and inside words, and some that are known to bite.
fn labels() -> Vec<String> {
    let signs = "\\`*{}[]()<>#+-.!|~&$:@=\"'/,;%^?_";
    let of_sign = |c: char| {
        [
            format!("{c}"),
            format!("{c}{c}{c}"),
            format!("{c}2pt{c}"),
            format!("a{c}b"),
            format!("-{c}1"),
        ]
    };
    let known = [
        "[64, 64]",
        "[2pt]",
        "*",
        "*[1em]",
        "-1",
        "-0.5",
        "-1e-3",
        "1e-300",
        "--lr",
        "---",
        "''",
        "``",
        "?`",
        "!`",
        "<<a>>",
        ",,",
        "\\textbf{a}",
        "\\end{tabular}",
        "% a",
        "a & b",
        "σ² ≤ 1",
        "−3 ± 2",
        "λ = 0",
        "α→β",
        "é ü ß",
        "<b>x</b>",
        "pre-trained",
        "fi ffi fl",
        "a\nb",
        "#1",
        "$x$",
        "x^2",
        "x_1",
    ];
    signs.chars().flat_map(of_sign).chain(known.map(str::to_owned)).collect()
}

/// The text, without blanks and with one sign for those that readers of PDF do not tell apart.
fn folded(text: &str) -> String {
    let mut out = String::new();
    let text = text.replace("e\u{301}", "é").replace("u\u{308}", "ü");
    for c in text.chars().filter(|c| !c.is_whitespace()) {
        match c {
            '˜' | '∼' => out.push('~'),
            'ˆ' => out.push('^'),
            '∗' => out.push('*'),
            'ﬁ' => out.push_str("fi"),
            'ﬂ' => out.push_str("fl"),
            'ﬃ' => out.push_str("ffi"),
            'µ' => out.push('μ'),
            // TeX's own fonts draw it as a rule.
            '_' => {}
            c => out.push(c),
        }
    }
    out
}

#[test]
#[expect(clippy::print_stderr, reason = "who runs the tests should know what was not tried")]
fn a_label_behind_the_end_of_a_row_reads_back() {
    let runs = |program: &str| Command::new(program).arg("-v").output().is_ok();
    if !runs("pdflatex") || !runs("pdftotext") {
        eprintln!("skipped: pdflatex and pdftotext are not installed");
        return;
    }
    let labels = labels();
    assert!(labels.len() > 100);
    let mut pages = String::new();
    for label in &labels {
        let cell = latex(label);
        write!(pages, "\\begin{{tabular}}{{ll}}\nA & B \\\\\n{cell} & {cell} \\\\\n\\end{{tabular}}\\newpage\n").expect("strings take everything");
    }
    // No numbers of pages and no hyphens of its own.
    let head = "\\documentclass{article}\\pagestyle{empty}\\pdfcompresslevel=0\\begin{document}\n";
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    fs::write(folder.path().join("t.tex"), format!("{head}{pages}\\end{{document}}\n"))
        .expect("it is written");
    let run = |program: &str, args: &[&str]| {
        let output = Command::new(program).args(args).current_dir(folder.path()).output();
        let output = output.expect("the program starts");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = if program == "pdflatex" { "! " } else { "\u{0}" };
        let wrong: Vec<&str> = said.lines().filter(|line| line.starts_with(errors)).collect();
        assert!(output.status.success() && wrong.is_empty(), "{program}: {wrong:?}\n{said}");
        said
    };
    run("pdflatex", &["-interaction=nonstopmode", "t.tex"]);
    let read = run("pdftotext", &["-raw", "t.pdf", "-"]);
    let read: Vec<&str> = read.split('\u{c}').collect();
    let mut wrong = Vec::new();
    for (label, page) in labels.iter().zip(&read) {
        // A number has a minus sign, whichever it was written with.
        let is_number = label.parse::<f64>().is_ok();
        let shown = folded(&if is_number { label.replace('-', "−") } else { label.clone() });
        let expected = format!("AB{shown}{shown}");
        if folded(page) != expected {
            wrong.push(format!("{label:?} as {:?} reads {page:?}", latex(label)));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), labels.len(), wrong.join("\n"));
}
