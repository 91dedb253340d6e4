//! What `--set NAME=VALUE` says.

use ivx_grammar::ast::{Item, ItemKind, TyExpr};
use ivx_grammar::check::{File, Project};
use ivx_grammar::{article, parse, parse_literal, suggest};
use ivx_op::Lit;

/// A parameter as it is declared.
struct Declared<'a> {
    address: String,
    name: &'a str,
    ty: &'a TyExpr,
    file: &'a File,
    item: &'a Item,
}

/// The names and values of parameters; or what is wrong with one, a message and a help.
pub(crate) fn sets(
    texts: &[String],
    project: &Project,
) -> Result<Vec<(String, Lit)>, (String, String)> {
    texts.iter().map(|text| set(text, project)).collect()
}

fn set(text: &str, project: &Project) -> Result<(String, Lit), (String, String)> {
    let Some((name, value)) = text.split_once('=') else {
        let help = "write NAME=VALUE without spaces, such as `--set members=16`";
        return Err((format!("`--set {text}` has no `=`"), help.to_owned()));
    };
    let (name, value) = (name.trim(), value.trim());
    if name.is_empty() {
        let help = "write NAME=VALUE, such as `--set members=16`";
        return Err((format!("`--set {text}` names no parameter"), help.to_owned()));
    }
    if let Some(lit) = parse_literal(value) {
        return Ok((name.to_owned(), lit));
    }
    let declared = declared(project);
    let matching: Vec<&Declared<'_>> =
        declared.iter().filter(|own| own.address == name || own.name == name).collect();
    let Some(first) = matching.first() else {
        let known = declared.iter().flat_map(|own| [own.address.as_str(), own.name]);
        let help = suggest(name, known)
            .map_or_else(|| "the spec has no parameters".to_owned(), String::from);
        return Err((format!("no parameter is called `{name}`"), help));
    };
    if matching.len() > 1 {
        let all: Vec<&str> = matching.iter().map(|own| own.address.as_str()).collect();
        let message = format!("several parameters are called `{name}`");
        return Err((message, format!("say which: {}", all.join(", "))));
    }
    let why = if value.is_empty() { "has no value".to_owned() } else { why(value, first) };
    Err((format!("`--set {text}` {why}"), first.told()))
}

/// Why a text is no value of a parameter, and what is one.
fn why(value: &str, of: &Declared<'_>) -> String {
    let ty = of.written(of.ty.span.start, of.ty.span.end);
    let quoted = format!("\"{value}\"");
    match ty {
        "Str" if parse_literal(&quoted).is_some() => {
            format!("wants a Str, which has quotes: `--set '{}={quoted}'`", of.name)
        }
        "Bool" => format!("wants a Bool, which is `true` or `false`: `{value}` is neither"),
        _ => {
            let text = format!("edition \"2026\"\nparam value: {ty} = {value}");
            let reason = parse(&text, 0).1.into_iter().next();
            let reason = reason.map_or(String::new(), |fault| format!(": {}", fault.message));
            format!("wants {} {ty}, and `{value}` is none{reason}", article(ty))
        }
    }
}

impl Declared<'_> {
    /// Where it is declared, and how.
    fn told(&self) -> String {
        let line = self.file.text[..self.item.span.start as usize].matches('\n').count() + 1;
        let written = self.written(self.item.span.start, self.item.span.end);
        let written = written.lines().next().unwrap_or_default();
        let (path, address) = (&self.file.path, &self.address);
        format!("`{address}` is declared at {path}:{line}: `{}`", written.trim_end())
    }

    fn written(&self, start: u32, end: u32) -> &str {
        &self.file.text[start as usize..end as usize]
    }
}

/// All parameters of a project.
fn declared(project: &Project) -> Vec<Declared<'_>> {
    let mut all = Vec::new();
    for file in &project.files {
        of_items(&file.stem, &file.ast.items, file, &mut all);
        for item in &file.ast.items {
            if let ItemKind::Experiment { name, items } = &item.kind {
                of_items(&name.value, items, file, &mut all);
            }
        }
    }
    all
}

fn of_items<'a>(owner: &str, items: &'a [Item], file: &'a File, all: &mut Vec<Declared<'a>>) {
    for item in items {
        if let ItemKind::Param { name, ty, .. } = &item.kind {
            let (address, name) = (format!("{owner}.{}", name.value), name.value.as_str());
            all.push(Declared { address, name, ty, file, item });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "edition \"2026\"\nparam rate: Float = 0.5 /// how fast\n\
        experiment e {\n    param n: Int = 8\n    param s: Str = \"a\"\n    param b: Bool = true\n}\n\
        experiment f {\n    param n: Int = 8\n}\n";

    #[track_caller]
    fn check(text: &str, expected: &[&str]) {
        let (ast, faults) = parse(TEXT, 0);
        assert!(faults.is_empty());
        let file = File {
            path: "x.ivx".to_owned(),
            stem: "x".to_owned(),
            text: TEXT.to_owned(),
            ast: ast.into(),
            links: [].into(),
            texts: [].into(),
            externals: [].into(),
        };
        let project = Project { files: vec![file] };
        let said = match sets(&[text.to_owned()], &project) {
            Ok(sets) => format!("{sets:?}"),
            Err((message, help)) => format!("{message}; {help}"),
        };
        for part in expected {
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn a_value_of_another_kind_leads_to_the_declaration() {
        check("rate=0.25", &["[(\"rate\", Real(0.25))]"]);
        let declared = "`x.rate` is declared at x.ivx:2: `param rate: Float = 0.5";
        check("rate=abc", &["wants a Float, and `abc` is none", declared]);
        check("rate=", &["`--set rate=` has no value", declared]);
        check("x.rate=1,5", &["wants a Float", declared]);
        check("e.n=eight", &["wants an Int", "`e.n` is declared at x.ivx:4: `param n: Int = 8`"]);
        check("b=True", &["which is `true` or `false`"]);
        check("s=hello", &["--set 's=\"hello\"'"]);
    }

    #[test]
    fn names_lead_to_parameters() {
        check("rat=abc", &["no parameter is called `rat`", "did you mean `rate`?"]);
        check("n=abc", &["several parameters are called `n`", "say which: e.n, f.n"]);
        check("rate:5", &["has no `=`"]);
        check("=5", &["names no parameter"]);
    }
}
