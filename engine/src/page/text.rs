//! Text inside HTML.

use ivx_op::shown_together;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html};

pub(super) use ivx_op::escape::xml as escape;

/// What is not prose.
pub(super) fn code(text: &str) -> String {
    format!("<code>{}</code>", escape(text))
}

/// Prose as its author wrote it, in Markdown: HTML in it is text, pictures are the words for them, and it links
/// only to the web.
pub(super) fn prose(markdown: &str) -> String {
    let events = Parser::new_ext(markdown, Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH);
    let events = events.filter(|event| {
        let is_picture =
            matches!(event, Event::Start(Tag::Image { .. }) | Event::End(TagEnd::Image));
        !is_picture
    });
    let events = events.map(|event| match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
            Event::Start(Tag::Link { link_type, dest_url: to_the_web(dest_url), title, id })
        }
        // The page has headings of its own above.
        Event::Start(Tag::Heading { .. }) => Event::Start(Tag::Paragraph),
        Event::End(TagEnd::Heading(_)) => Event::End(TagEnd::Paragraph),
        other => other,
    });
    let mut out = String::new();
    html::push_html(&mut out, events);
    out
}

fn to_the_web(url: CowStr<'_>) -> CowStr<'_> {
    let known = ["https://", "http://", "#"].iter().any(|start| url.starts_with(start));
    if known { url } else { CowStr::Borrowed("#") }
}

/// A duration.
pub(super) fn seconds(s: f64) -> String {
    match s {
        _ if s < 0.0005 => "under 1 ms".to_owned(),
        _ if s < 1.0 => format!("{:.0} ms", s * 1000.0),
        _ if s < 100.0 => format!("{s:.1} s"),
        _ => format!("{:.0} min", s / 60.0),
    }
}

/// Numbers that stand beside each other.
pub(super) fn numbers(xs: &[f64]) -> Vec<String> {
    shown_together(xs).iter().map(|number| typeset(number)).collect()
}

/// A number with signs as they are set.
pub(super) fn typeset(number: &str) -> String {
    if number == "NaN" { "n/a".to_owned() } else { number.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_prose_acts() {
        let found = prose(
            "# Title\n<script>alert(1)</script>\n\n*a* <img src=x onerror=y> [b](javascript:c) \
             [d](https://e.org) ![f](https://g.org/h.png)",
        );
        assert!(!found.contains("<script") && !found.contains("<img src=x"), "{found}");
        assert!(!found.contains("javascript") && !found.contains("h.png"), "{found}");
        assert!(!found.contains("<h1>"), "{found}");
        for kept in ["<em>a</em>", "&lt;script&gt;", "href=\"https://e.org\""] {
            assert!(found.contains(kept), "{kept} in {found}");
        }
    }

    #[test]
    fn numbers_and_times_are_short() {
        assert_eq!(
            [0.0, -0.25, 1.0 / 3.0, 1e-9, f64::NAN].map(|x| numbers(&[x]).remove(0)),
            ["0", "−0.25", "0.3333", "1e−9", "n/a"]
        );
        assert_eq!(
            [0.0, 0.25, 12.34, 600.0].map(seconds),
            ["under 1 ms", "250 ms", "12.3 s", "10 min"]
        );
    }
}
