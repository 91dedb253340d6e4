//! stub
use ivx_grammar::Diagnostic;
pub(crate) fn render(diagnostics: &[Diagnostic], sources: &[(String, String)], _c: bool) -> String {
    let mut s = String::new();
    for d in diagnostics {
        s += &format!("{} {}\n", d.code, d.message);
        for l in &d.labels {
            s += &format!("  {}:{} {}\n", sources[l.span.file as usize].0, l.span.start, l.text);
        }
        if let Some(h) = &d.help {
            s += &format!("  help: {h}\n");
        }
    }
    s
}
