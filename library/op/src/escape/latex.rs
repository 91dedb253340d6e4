//! Text inside LaTeX.

use super::on_one_line;

/// Text in a cell or paragraph of LaTeX that means itself, wherever it stands in a row: behind `\\` too, where
/// `[` and `*` would be arguments.
///
/// The document is UTF-8, which has been LaTeX's default since 2018, and needs no package. Signs of mathematics
/// and Greek letters are set in math. Other letters stand as they are: pdfLaTeX has those of the languages of
/// Western Europe, `XeLaTeX` and `LuaLaTeX` those of the document's font.
#[must_use]
pub fn latex(text: &str) -> String {
    if text.parse::<f64>().is_ok_and(f64::is_finite) {
        return latex_number(text);
    }
    let chars = on_one_line(text);
    let mut safe = String::new();
    for (i, &c) in chars.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| chars[i]);
        let first = chars[..i].iter().all(|c| *c == ' ');
        match c {
            // TeX takes several blanks for one, and those at the ends of a cell for none.
            ' ' if before.is_none_or(|c| c == ' ') || i + 1 == chars.len() => safe.push('~'),
            '[' | '*' if first => safe.extend(['{', c, '}']),
            '-' | ',' if before == Some(c) => safe.extend(['{', '}', c]),
            '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{feff}' | '\u{ad}' => {
                let code = format!("\\textbackslash{{}}u\\{{{:x}\\}}", u32::from(c));
                safe.push_str(&code);
            }
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => safe.extend(['\\', c]),
            '0'..='9' | 'A'..='Z' | 'a'..='z' => safe.push(c),
            c => match command(c) {
                Some(command) => safe.push_str(command),
                None => safe.push(c),
            },
        }
    }
    safe
}

/// A number, or one with its interval, with minus signs and infinities in math.
#[must_use]
pub fn latex_number(text: &str) -> String {
    text.replace(['-', '−'], "$-$").replace('∞', "$\\infty$")
}

/// What LaTeX calls characters that would act, be drawn as others, or are in no font of text.
const COMMANDS: [(char, &str); 120] = [
    ('\\', "\\textbackslash{}"),
    ('~', "\\textasciitilde{}"),
    ('^', "\\textasciicircum{}"),
    ('<', "\\textless{}"),
    ('>', "\\textgreater{}"),
    ('|', "\\textbar{}"),
    ('`', "\\textasciigrave{}"),
    ('\'', "\\textquotesingle{}"),
    // By its number, since babel makes it act in some languages.
    ('"', "\\texttt{\\char34}"),
    ('\u{a0}', "~"),
    ('−', "$-$"),
    ('±', "$\\pm$"),
    ('∓', "$\\mp$"),
    ('×', "$\\times$"),
    ('÷', "$\\div$"),
    ('·', "$\\cdot$"),
    ('⋅', "$\\cdot$"),
    ('∗', "$\\ast$"),
    ('∘', "$\\circ$"),
    ('≤', "$\\leq$"),
    ('≥', "$\\geq$"),
    ('≠', "$\\neq$"),
    ('≈', "$\\approx$"),
    ('≡', "$\\equiv$"),
    ('≪', "$\\ll$"),
    ('«', "$\\ll$"),
    ('≫', "$\\gg$"),
    ('»', "$\\gg$"),
    ('∼', "$\\sim$"),
    ('∝', "$\\propto$"),
    ('→', "$\\rightarrow$"),
    ('←', "$\\leftarrow$"),
    ('↔', "$\\leftrightarrow$"),
    ('↑', "$\\uparrow$"),
    ('↓', "$\\downarrow$"),
    ('⇒', "$\\Rightarrow$"),
    ('⇔', "$\\Leftrightarrow$"),
    ('∞', "$\\infty$"),
    ('∂', "$\\partial$"),
    ('∇', "$\\nabla$"),
    ('∑', "$\\sum$"),
    ('∏', "$\\prod$"),
    ('∫', "$\\int$"),
    ('√', "$\\surd$"),
    ('∈', "$\\in$"),
    ('∉', "$\\notin$"),
    ('∅', "$\\emptyset$"),
    ('⊂', "$\\subset$"),
    ('⊆', "$\\subseteq$"),
    ('∪', "$\\cup$"),
    ('∩', "$\\cap$"),
    ('∧', "$\\wedge$"),
    ('∨', "$\\vee$"),
    ('¬', "$\\neg$"),
    ('∀', "$\\forall$"),
    ('∃', "$\\exists$"),
    ('′', "$'$"),
    ('ℓ', "$\\ell$"),
    ('⊕', "$\\oplus$"),
    ('⊗', "$\\otimes$"),
    ('⁻', "$^-$"),
    ('⁰', "$^0$"),
    ('⁴', "$^4$"),
    ('⁵', "$^5$"),
    ('⁶', "$^6$"),
    ('⁷', "$^7$"),
    ('⁸', "$^8$"),
    ('⁹', "$^9$"),
    ('₀', "$_0$"),
    ('₁', "$_1$"),
    ('₂', "$_2$"),
    ('₃', "$_3$"),
    ('₄', "$_4$"),
    ('₅', "$_5$"),
    ('₆', "$_6$"),
    ('₇', "$_7$"),
    ('₈', "$_8$"),
    ('₉', "$_9$"),
    ('α', "$\\alpha$"),
    ('β', "$\\beta$"),
    ('γ', "$\\gamma$"),
    ('δ', "$\\delta$"),
    ('ε', "$\\varepsilon$"),
    ('ϵ', "$\\epsilon$"),
    ('ζ', "$\\zeta$"),
    ('η', "$\\eta$"),
    ('θ', "$\\theta$"),
    ('ϑ', "$\\vartheta$"),
    ('ι', "$\\iota$"),
    ('κ', "$\\kappa$"),
    ('λ', "$\\lambda$"),
    ('\u{3bc}', "$\\mu$"),
    ('\u{b5}', "$\\mu$"),
    ('ν', "$\\nu$"),
    ('ξ', "$\\xi$"),
    ('ο', "$o$"),
    ('π', "$\\pi$"),
    ('ρ', "$\\rho$"),
    ('σ', "$\\sigma$"),
    ('ς', "$\\varsigma$"),
    ('τ', "$\\tau$"),
    ('υ', "$\\upsilon$"),
    ('φ', "$\\varphi$"),
    ('ϕ', "$\\phi$"),
    ('χ', "$\\chi$"),
    ('ψ', "$\\psi$"),
    ('ω', "$\\omega$"),
    ('Γ', "$\\Gamma$"),
    ('Δ', "$\\Delta$"),
    ('\u{2206}', "$\\Delta$"),
    ('Θ', "$\\Theta$"),
    ('Λ', "$\\Lambda$"),
    ('Ξ', "$\\Xi$"),
    ('Π', "$\\Pi$"),
    ('Σ', "$\\Sigma$"),
    ('Υ', "$\\Upsilon$"),
    ('Φ', "$\\Phi$"),
    ('Ψ', "$\\Psi$"),
    ('Ω', "$\\Omega$"),
    ('\u{2126}', "$\\Omega$"),
];

fn command(c: char) -> Option<&'static str> {
    COMMANDS.iter().find(|(known, _)| *known == c).map(|(_, command)| *command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_acts() {
        let check = |text: &str, expected: &str| assert_eq!(latex(text), expected, "{text}");
        check("[64, 64]", "{[}64, 64]");
        check("*", "{*}");
        check(" [1em]", "~{[}1em]");
        check("a*b [c]", "a*b [c]");
        check("-1", "$-$1");
        check("-1e-3", "$-$1e$-$3");
        check("1e-300", "1e$-$300");
        check("pre-trained", "pre-trained");
        check("--lr --- ,,", "-{}-lr -{}-{}- ,{},");
        check(
            "?`!`''",
            "?\\textasciigrave{}!\\textasciigrave{}\\textquotesingle{}\\textquotesingle{}",
        );
        check("a\u{1b}\nb  c ", "a\\textbackslash{}u\\{1b\\} b ~c~");
        check("σ² ≤ é", "$\\sigma$² $\\leq$ é");
        assert_eq!(latex_number("4.0 [1.00e-4, ∞)"), "4.0 [1.00e$-$4, $\\infty$)");
    }
}
