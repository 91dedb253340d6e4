//! Who feeds whom, as a picture.

use super::groups::Group;
use super::text::{escape, seconds};

/// More groups than this are told in a table alone.
const MOST: usize = 60;

const TALL: f64 = 40.0;
/// Between the edge of a box and its text.
const PAD: f64 = 8.0;
/// How far a character of the fixed-width font reaches, at most: names, and what became of the nodes.
const PITCH: (f64, f64) = (7.6, 7.0);
/// So many characters of a name are shown.
const NAME: usize = 32;
const ACROSS: f64 = 54.0;
const DOWN: f64 = 12.0;

/// The picture and the table of groups.
pub(super) fn network(groups: &[Group]) -> String {
    let rows = groups.iter().map(|group| {
        let from = group.fed_by.iter().map(|&from| escape(&groups[from].name));
        let ops: Vec<&str> = group.ops.iter().map(String::as_str).collect();
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape(&group.name),
            escape(&ops.join(", ")),
            fate(group),
            from.collect::<Vec<_>>().join(", ")
        )
    });
    let table = format!(
        "<details><summary>The same as a table</summary><table class=\"facts\"><thead><tr><th scope=\"col\">name</th>\
         <th scope=\"col\">operations</th><th scope=\"col\">nodes</th><th scope=\"col\">fed by</th></tr></thead>\
         <tbody>\n{}</tbody></table></details>",
        rows.collect::<String>()
    );
    let picture = if groups.len() <= MOST { picture(groups) } else { String::new() };
    format!("{picture}{table}")
}

/// What became of the nodes of a group.
fn fate(group: &Group) -> String {
    let mut said = Vec::new();
    if group.n_hit > 0 {
        said.push(format!("{} known", group.n_hit));
    }
    if group.n_ran > 0 {
        #[expect(clippy::cast_precision_loss, reason = "no run takes that long")]
        let took = seconds(group.millis as f64 / 1000.0);
        said.push(format!("{} ran, {took}", group.n_ran));
    }
    if group.n_failed > 0 {
        said.push(format!("{} failed", group.n_failed));
    }
    said.join("; ")
}

#[expect(clippy::cast_precision_loss, reason = "groups are few")]
fn picture(groups: &[Group]) -> String {
    let columns = order(groups);
    let tall = TALL;
    let deepest = columns.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let height = deepest * (tall + DOWN) + DOWN;
    let mut corners = vec![(0.0, 0.0); groups.len()];
    let mut wides = vec![0.0; groups.len()];
    let mut left = 2.0;
    for column in &columns {
        let wide = column.iter().map(|&group| needs(&groups[group])).fold(0.0, f64::max);
        let room = height - column.len() as f64 * (tall + DOWN) + DOWN;
        let top = room / 2.0;
        for (y, &group) in column.iter().enumerate() {
            corners[group] = (left, top + y as f64 * (tall + DOWN));
            wides[group] = wide;
        }
        left += wide + ACROSS;
    }
    let width = left - ACROSS + 2.0;
    let mut out = vec![format!(
        "<div class=\"wide\"><svg class=\"network\" width=\"{width}\" height=\"{height}\" role=\"img\" \
         aria-label=\"Who feeds whom\">"
    )];
    for (group, &(x, y)) in groups.iter().zip(&corners) {
        for &from in &group.fed_by {
            let (a, b) = (corners[from].0 + wides[from], corners[from].1 + tall / 2.0);
            let (c, d) = (x, y + tall / 2.0);
            let bend = ((c - a) / 2.0).abs().max(20.0);
            out.push(format!("<path d=\"M{a} {b}C{} {b} {} {d} {c} {d}\"/>", a + bend, c - bend));
        }
    }
    for ((group, &(x, y)), wide) in groups.iter().zip(&corners).zip(&wides) {
        let class = match group {
            _ if group.n_failed > 0 => "failed",
            _ if group.n_ran > 0 => "ran",
            _ => "known",
        };
        let ops: Vec<&str> = group.ops.iter().map(String::as_str).collect();
        // A picture within the picture clips what a font draws wider than was thought.
        out.push(format!(
            "<svg class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{tall}\"><title>{}: {}</title>\
             <rect x=\"1\" y=\"1\" width=\"{2}\" height=\"{3}\" rx=\"5\"/><text x=\"{PAD}\" y=\"16\">{4}</text>\
             <text class=\"fate\" x=\"{PAD}\" y=\"32\">{5}</text></svg>",
            escape(&group.name),
            escape(&ops.join(", ")),
            wide - 2.0,
            tall - 2.0,
            escape(&cut(&group.name, NAME)),
            escape(&fate(group))
        ));
    }
    out.push("</svg></div>".to_owned());
    out.concat()
}

/// How wide the box of a group is.
#[expect(clippy::cast_precision_loss, reason = "what is shown of a name is short")]
fn needs(group: &Group) -> f64 {
    // What is not of the Latin alphabet may take the room of two characters.
    let cells = |text: &str| text.chars().map(|c| if c < '\u{300}' { 1 } else { 2 }).sum::<usize>();
    let (name, fate) = (cells(&cut(&group.name, NAME)) as f64, cells(&fate(group)) as f64);
    (name * PITCH.0).max(fate * PITCH.1).ceil() + 2.0 * PAD
}

/// The groups of each layer, those fed by neighbours near each other.
fn order(groups: &[Group]) -> Vec<Vec<usize>> {
    let n_layers = groups.iter().map(|group| group.layer + 1).max().unwrap_or(0);
    let mut columns: Vec<Vec<usize>> = vec![Vec::new(); n_layers];
    for (place, group) in groups.iter().enumerate() {
        columns[group.layer].push(place);
    }
    let mut heights = vec![0.0; groups.len()];
    for column in &mut columns {
        let center = |place: &usize| {
            let from = &groups[*place].fed_by;
            #[expect(clippy::cast_precision_loss, reason = "groups are few")]
            let n = from.len().max(1) as f64;
            from.iter().map(|&from| heights[from]).sum::<f64>() / n
        };
        let mut sorted: Vec<(f64, usize)> = column.iter().map(|p| (center(p), *p)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        *column = sorted.into_iter().map(|(_, place)| place).collect();
        #[expect(clippy::cast_precision_loss, reason = "groups are few")]
        let half = column.len() as f64 / 2.0;
        for (i, &place) in column.iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "groups are few")]
            let at = i as f64 - half;
            heights[place] = at;
        }
    }
    columns
}

/// The beginning of a text that is too long; of what another experiment named, the name.
fn cut(text: &str, n: usize) -> String {
    let length = text.chars().count();
    if length <= n {
        text.to_owned()
    } else if text.contains(' ') || !text.contains('.') {
        text.chars().take(n - 1).chain(['…']).collect()
    } else {
        ['…'].into_iter().chain(text.chars().skip(length + 1 - n)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(name: &str, layer: usize, fed_by: &[usize]) -> Group {
        let fed_by = fed_by.iter().copied().collect();
        Group { name: name.into(), layer, fed_by, n_nodes: 1, n_hit: 1, ..Group::default() }
    }

    #[test]
    fn neighbours_stand_near_each_other() {
        let groups = [
            group("a", 0, &[]),
            group("b", 0, &[]),
            group("from b", 1, &[1]),
            group("from a", 1, &[0]),
        ];
        assert_eq!(order(&groups), [vec![0, 1], vec![3, 2]]);
    }

    #[test]
    fn a_picture_has_boxes_and_ways_between_them() {
        let long = "a name that is longer than any box should be";
        let groups = [group("data <1>", 0, &[]), group(long, 1, &[0])];
        let found = network(&groups);
        assert_eq!((found.matches("<rect").count(), found.matches("<path").count()), (2, 1));
        for text in ["data &lt;1&gt;", "a name that is longer than any …", "1 known"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        // 8 characters; 31 and an ellipsis, which may take the room of two.
        for wide in ["width=\"77\"", "width=\"267\""] {
            assert!(found.contains(wide), "{wide} in {found}");
        }
        let many: Vec<Group> = (0..=MOST).map(|i| group(&i.to_string(), i, &[])).collect();
        assert!(!network(&many).contains("<svg"));
    }
}
