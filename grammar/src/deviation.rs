//! What a doc comment says of how something differs from its source: `deviation "..."`.

/// The doc comment without its deviations, and these, in their order. A deviation begins a line, and may go on over
/// several until its quote ends.
#[must_use]
pub fn deviations(docs: &str) -> (String, Vec<String>) {
    let (mut kept, mut found) = (Vec::new(), Vec::new());
    let mut open: Option<Vec<&str>> = None;
    for line in docs.lines() {
        let text = line.trim();
        let begun = text.strip_prefix("deviation").map(str::trim_start);
        let part = match (&open, begun.and_then(|text| text.strip_prefix('"'))) {
            (Some(_), _) => text,
            (None, Some(begun)) => begun,
            (None, None) => {
                kept.push(line);
                continue;
            }
        };
        let mut words = open.take().unwrap_or_default();
        let end = part.strip_suffix('"');
        words.push(end.unwrap_or(part).trim());
        if end.is_some() {
            found.push(words.join(" "));
        } else {
            open = Some(words);
        }
    }
    // What never ends is read to the end.
    found.extend(open.map(|words| words.join(" ")));
    (kept.join("\n").trim().to_owned(), found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_told_apart_from_other_words() {
        let docs = "Thesis Example 2.8.\n\ndeviation \"a finer\n  grid\"\nThe deviation \"is\" small.\n\
                    deviation \"more seeds\"";
        let (rest, found) = deviations(docs);
        assert_eq!(rest, "Thesis Example 2.8.\n\nThe deviation \"is\" small.");
        assert_eq!(found, ["a finer grid", "more seeds"]);
        assert_eq!(deviations("deviation \"no end\nat all").1, ["no end at all"]);
    }
}
