//! Addresses, taken apart: `e/model[ke=WCM,seed=0]/member[3]`, `e/figure "start"/curve`.
//!
//! What stands in quotes is a title or a label, whatever it holds.

/// What stands between the slashes.
#[must_use]
pub fn parts(address: &str) -> Vec<&str> {
    let mut cuts = vec![0];
    for (at, c, depth) in plain(address) {
        if c == '/' && depth == 0 {
            cuts.extend([at, at + 1]);
        }
    }
    cuts.push(address.len());
    cuts.chunks(2).map(|cut| &address[cut[0]..cut[1]]).collect()
}

/// A part without its coordinates and its number: `model` of `model[seed=0]#2`.
#[must_use]
pub fn stem(part: &str) -> &str {
    let end = plain(part).find(|(_, c, _)| matches!(c, '[' | '#'));
    &part[..end.map_or(part.len(), |(at, ..)| at)]
}

/// An address without coordinates: `e/model/member` of `e/model[seed=0]/member[3]`.
pub(crate) fn binding(address: &str) -> String {
    let mut binding = String::new();
    let mut from = 0;
    for (at, c, depth) in plain(address) {
        match c {
            '[' if depth == 1 => binding += &address[from..at],
            ']' if depth == 0 => from = at + 1,
            _ => {}
        }
    }
    binding + &address[from..]
}

/// The axes and labels in an address; the number of a member has no axis but its word.
pub(crate) fn coordinates(address: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    for part in parts(address) {
        let mut from = stem(part).len() + 1;
        for (at, c, depth) in plain(part) {
            let ends = c == ',' && depth == 1 || c == ']' && depth == 0;
            if ends && at > from {
                let coordinate = &part[from..at];
                found.push(coordinate.split_once('=').unwrap_or((stem(part), coordinate)));
                from = at + 1;
            }
        }
    }
    found
}

/// A label as it stands in an address: in quotes if it holds what takes addresses apart.
pub(crate) fn label(text: &str) -> String {
    let plain = |c: char| !c.is_control() && !"\"\\[]/,=#".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text.to_owned() } else { format!("{text:?}") }
}

/// The characters outside of quotes: where, which, and how many brackets are open behind it.
fn plain(address: &str) -> impl Iterator<Item = (usize, char, usize)> {
    let (mut quoted, mut escaped, mut depth) = (false, false, 0_usize);
    address.char_indices().filter_map(move |(at, c)| {
        if quoted {
            quoted = escaped || c != '"';
            escaped = !escaped && c == '\\';
            return None;
        }
        match c {
            '"' => quoted = true,
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        Some((at, c, depth))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_taken_apart_outside_of_quotes() {
        let address = r##"e/claim "a/b [c=d] \"#1"/sub[ke="x],y",seed=0]/member[3]#2"##;
        let [e, claim, sub, member] = parts(address)[..] else { panic!("{:?}", parts(address)) };
        assert_eq!(e, "e");
        assert_eq!((claim, stem(claim)), (r##"claim "a/b [c=d] \"#1""##, claim));
        assert_eq!((sub, stem(sub)), (r#"sub[ke="x],y",seed=0]"#, "sub"));
        assert_eq!((member, stem(member)), ("member[3]#2", "member"));
        assert_eq!(binding(address), r##"e/claim "a/b [c=d] \"#1"/sub/member#2"##);
        assert_eq!(coordinates(address), [("ke", r#""x],y""#), ("seed", "0"), ("member", "3")]);
        assert_eq!(coordinates("e/x"), []);
        assert_eq!((parts(""), stem(""), binding("")), (vec![""], "", String::new()));
    }

    #[test]
    fn labels_are_quoted_where_they_would_take_addresses_apart() {
        for plain in ["WCM", "0.5", "-1", "my label", "é"] {
            assert_eq!(label(plain), plain);
        }
        for odd in ["", "a/b", "a,b=c", "]", "#1", "\"", "\n", "\\"] {
            let address = format!("e/x[ke={},n=1]/y", label(odd));
            assert_eq!(parts(&address).len(), 3, "{address}");
            assert_eq!(coordinates(&address).len(), 2, "{address}");
            assert_eq!(binding(&address), "e/x/y");
        }
    }
}
