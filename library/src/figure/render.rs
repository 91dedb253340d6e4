//! A drawing as an SVG file.
//!
//! The format is written directly: `plotters` rounds coordinates to whole pixels, and lays its
//! legend over the data.

use std::collections::BTreeSet;

use ivx_op::Figure;

use super::drawing::{Axis, Drawing, Mark, Series, Stroke};
use super::marks::{Look, Panel, draw, entry_width, swatch};
use super::scale::{Scale, Ticks, scales, ticks};
use super::text::{escape, power_of_ten, px, width};

const SMALL: f64 = 11.0;
const INK: &str = "#222222";
const GRID: &str = "#e4e4e4";
const LEGEND_ROW: f64 = 18.0;

/// The drawing as a figure: the same bytes for the same drawing.
pub(super) fn render(drawing: &Drawing) -> Figure {
    let (x, y) = scales(drawing);
    let (x_ticks, y_ticks) = (axis_ticks(&drawing.x, x, 7), axis_ticks(&drawing.y, y, 6));
    let labels = legend_labels(drawing);
    let page = lay_out(drawing, (x, y), (&x_ticks, &y_ticks), &labels);

    let mut out = vec![
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}" font-family="sans-serif" role="img">"#,
            px(page.width),
            px(page.height)
        ),
        r##"<rect width="100%" height="100%" fill="#ffffff"/>"##.to_owned(),
    ];
    out.extend(grid(&page, &y_ticks));
    out.extend(marks(drawing, &page));
    out.extend(horizontal_axis(&drawing.x, &page, &x_ticks));
    out.extend(vertical_axis(&drawing.y, &page, &y_ticks));
    out.extend(title(&drawing.title, &page));
    out.extend(legend(drawing, &labels, &page));
    out.push("</svg>\n".to_owned());
    Figure { files: [("svg".to_owned(), out.join("\n"))].into() }
}

/// Where everything lies.
struct Page {
    width: f64,
    height: f64,
    /// The panel's left and top.
    left: f64,
    top: f64,
    panel: Panel,
    /// Whether the names below the panel are slanted, because they are too long.
    slanted: bool,
    /// How far the tick labels reach below the panel.
    below: f64,
}

fn lay_out(
    drawing: &Drawing,
    (x, y): (Scale, Scale),
    (x_ticks, y_ticks): (&Ticks, &Ticks),
    labels: &[&str],
) -> Page {
    let (n_names, n_series) = (drawing.x.names.len(), drawing.series.len());
    let room_for_names = count(n_names) * (5.0 * count(n_series)).max(16.0);
    let panel = Panel { width: room_for_names.max(400.0), height: 250.0, x, y };
    let widest = |labels: &[String]| labels.iter().map(|l| width(l, SMALL)).fold(0.0, f64::max);

    let slot = panel.width / count(n_names.max(1));
    let slanted = n_names > 0 && widest(&x_ticks.labels) > slot - 6.0;
    let below = if slanted { widest(&x_ticks.labels) * 0.64 + 20.0 } else { 22.0 };
    // Slanted names reach to the left of their place, the first ones past the panel.
    let overhang =
        |(label, at): (&String, &f64)| width(label, SMALL) * 0.77 - x.place(*at, panel.width);
    let overhang = x_ticks.labels.iter().zip(&x_ticks.at).map(overhang).fold(0.0, f64::max);

    let has = |text: &str, room: f64| if text.is_empty() { 0.0 } else { room };
    let left = 16.0 + has(&drawing.y.label, 18.0) + widest(&y_ticks.labels);
    let left = if slanted { left.max(overhang + 8.0) } else { left };
    let top = 14.0 + has(&drawing.title, 22.0) + if y_ticks.exponent == 0 { 0.0 } else { 14.0 };
    let has_last_line = !drawing.x.label.is_empty() || x_ticks.exponent != 0;
    let bottom = below + if has_last_line { 22.0 } else { 4.0 };

    let legend = labels.iter().map(|label| entry_width(label)).fold(0.0, f64::max);
    let right = if labels.is_empty() { 18.0 } else { 16.0 + 34.0 + legend + 8.0 };
    let rows = count(labels.len()) * LEGEND_ROW;
    let heading = width(&drawing.title, 13.0) * 1.1 + 16.0;
    Page {
        width: (left + panel.width + right).max(heading).ceil(),
        height: (top + panel.height + bottom).max(top + rows + 10.0).ceil(),
        left,
        top,
        panel,
        slanted,
        below,
    }
}

#[expect(clippy::cast_precision_loss, reason = "names and labels are few")]
fn count(n: usize) -> f64 {
    n as f64
}

fn axis_ticks(axis: &Axis, scale: Scale, about: u32) -> Ticks {
    if axis.names.is_empty() {
        return ticks(scale, about);
    }
    let at = (0..).map(f64::from).take(axis.names.len()).collect();
    Ticks { at, labels: axis.names.clone(), exponent: 0 }
}

/// The distinct labels that need a legend. A single one that the axis already bears does not.
fn legend_labels(drawing: &Drawing) -> Vec<&str> {
    let mut labels: Vec<&str> = Vec::new();
    for Series { label, .. } in &drawing.series {
        if !label.is_empty() && !labels.contains(&label.as_str()) {
            labels.push(label);
        }
    }
    if labels == [drawing.y.label.as_str()] { Vec::new() } else { labels }
}

/// How each series looks: those of one label alike, one without a label like no other.
///
/// Lines bear markers where only colour would tell two of them apart.
fn looks(drawing: &Drawing) -> Vec<Look> {
    let mut kinds: Vec<&Series> = Vec::new();
    let mut indices = Vec::new();
    for series in &drawing.series {
        let alike = |kind: &&Series| !series.label.is_empty() && kind.label == series.label;
        indices.push(kinds.iter().position(alike).unwrap_or(kinds.len()));
        if indices.last() == Some(&kinds.len()) {
            kinds.push(series);
        }
    }
    let n_kinds_with = |stroke: Stroke| {
        let has = |series: &Series| series.marks.iter().any(|mark| mark.stroke() == Some(stroke));
        let with = drawing.series.iter().zip(&indices).filter(|(series, _)| has(series));
        with.map(|(_, index)| index).collect::<BTreeSet<_>>().len()
    };
    let marked = n_kinds_with(Stroke::Solid) > 1 || n_kinds_with(Stroke::Dashed) > 1;
    indices.into_iter().map(|index| Look { index, marked }).collect()
}

fn grid(page: &Page, y_ticks: &Ticks) -> Vec<String> {
    let line = |y: &f64| {
        let y = px(page.top + page.panel.height - page.panel.y.place(*y, page.panel.height));
        let (left, right) = (px(page.left), px(page.left + page.panel.width));
        format!(r#"<path d="M{left} {y}L{right} {y}" stroke="{GRID}" stroke-width="0.8"/>"#)
    };
    y_ticks.at.iter().map(line).collect()
}

fn marks(drawing: &Drawing, page: &Page) -> Vec<String> {
    let looks = looks(drawing);
    let all = drawing.series.iter().zip(&looks);
    let all = all.flat_map(|(series, look)| series.marks.iter().map(move |mark| (mark, *look)));
    let mut all: Vec<(&Mark, Look)> = all.collect();
    all.sort_by_key(|(mark, _)| depth(mark));

    let panel = &page.panel;
    // An inner `svg` clips its content, and needs no name that another figure might bear.
    let mut out = vec![format!(
        r#"<svg x="{}" y="{}" width="{}" height="{}">"#,
        px(page.left),
        px(page.top),
        px(panel.width),
        px(panel.height)
    )];
    out.extend(all.iter().flat_map(|(mark, look)| draw(mark, *look, panel)));
    let has_bars = all.iter().any(|(mark, _)| matches!(mark, Mark::Bar { .. }));
    if has_bars && panel.y.low < 0.0 && panel.y.high > 0.0 {
        let (y, right) = (px(panel.height - panel.y.place(0.0, panel.height)), px(panel.width));
        out.push(format!(r#"<path d="M0 {y}L{right} {y}" stroke="{INK}" stroke-width="1"/>"#));
    }
    out.push("</svg>".to_owned());
    out
}

/// What lies below what: areas, then many thin lines, then lines, then points and text.
fn depth(mark: &Mark) -> u8 {
    match mark {
        Mark::Band(_) | Mark::Bar { .. } => 0,
        Mark::Line(Stroke::Thin, _) | Mark::Level(Stroke::Thin, _) => 1,
        Mark::Level(..) => 2,
        Mark::Line(..) => 3,
        Mark::Points(_) => 4,
        Mark::Text(..) => 5,
    }
}

fn horizontal_axis(axis: &Axis, page: &Page, ticks: &Ticks) -> Vec<String> {
    let (panel, bottom) = (&page.panel, page.top + page.panel.height);
    let (left, right) = (page.left, page.left + panel.width);
    let mut out = vec![stroke(left, bottom, right, bottom)];
    for (at, label) in ticks.at.iter().zip(&ticks.labels) {
        let x = page.left + panel.x.place(*at, panel.width);
        out.push(stroke(x, bottom, x, bottom + 4.0));
        if page.slanted {
            let at = format!("{} {}", px(x + 3.0), px(bottom + 14.0));
            out.push(format!(
                r#"<text transform="translate({at}) rotate(-40)" font-size="{SMALL}" fill="{INK}" text-anchor="end">{}</text>"#,
                escape(label)
            ));
        } else {
            out.push(text(x, bottom + 17.0, SMALL, "middle", label));
        }
    }
    let last_line = bottom + page.below + 12.0;
    if !axis.label.is_empty() {
        out.push(text(left + panel.width / 2.0, last_line, 12.0, "middle", &axis.label));
    }
    if ticks.exponent != 0 {
        out.push(text(right, last_line, SMALL, "end", &power_of_ten(ticks.exponent)));
    }
    out
}

fn vertical_axis(axis: &Axis, page: &Page, ticks: &Ticks) -> Vec<String> {
    let (panel, bottom) = (&page.panel, page.top + page.panel.height);
    let mut out = vec![stroke(page.left, page.top, page.left, bottom)];
    for (at, label) in ticks.at.iter().zip(&ticks.labels) {
        let y = bottom - panel.y.place(*at, panel.height);
        out.push(stroke(page.left - 4.0, y, page.left, y));
        out.push(text(page.left - 7.0, y + 4.0, SMALL, "end", label));
    }
    if !axis.label.is_empty() {
        out.push(format!(
            r#"<text transform="translate(16 {}) rotate(-90)" font-size="12" fill="{INK}" text-anchor="middle">{}</text>"#,
            px(page.top + panel.height / 2.0),
            escape(&axis.label)
        ));
    }
    if ticks.exponent != 0 {
        out.push(text(page.left, page.top - 5.0, SMALL, "start", &power_of_ten(ticks.exponent)));
    }
    out
}

fn title(title: &str, page: &Page) -> Option<String> {
    let (left, y) = (page.left, 20.0);
    // Centred on the panel unless it would then leave the page.
    let half = width(title, 13.0) * 0.55;
    let x = (left + page.panel.width / 2.0).min(page.width - half - 4.0).max(half + 4.0);
    (!title.is_empty()).then(|| {
        text(x, y, 13.0, "middle", title).replace("<text ", r#"<text font-weight="bold" "#)
    })
}

fn legend(drawing: &Drawing, labels: &[&str], page: &Page) -> Vec<String> {
    let looks = looks(drawing);
    let x = page.left + page.panel.width + 16.0;
    let mut y = page.top + LEGEND_ROW / 2.0;
    let mut out = Vec::new();
    for label in labels {
        let alike =
            || drawing.series.iter().zip(&looks).filter(|(series, _)| series.label == *label);
        let marks: Vec<&Mark> = alike().flat_map(|(series, _)| &series.marks).collect();
        let look = alike().map(|(_, look)| *look).next().expect("labels are those of the series");
        out.extend(swatch(&marks, look, x + 12.0, y));
        out.push(text(x + 34.0, y + 4.0, SMALL, "start", label));
        y += LEGEND_ROW;
    }
    out
}

fn stroke(a: f64, b: f64, c: f64, d: f64) -> String {
    let path = format!("M{} {}L{} {}", px(a), px(b), px(c), px(d));
    format!(r#"<path d="{path}" stroke="{INK}" stroke-width="1"/>"#)
}

fn text(x: f64, y: f64, size: f64, anchor: &str, text: &str) -> String {
    format!(
        r#"<text x="{}" y="{}" font-size="{size}" fill="{INK}" text-anchor="{anchor}">{}</text>"#,
        px(x),
        px(y),
        escape(text)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(drawing: &Drawing) -> String {
        render(drawing).files["svg"].clone()
    }

    fn series(label: &str, marks: Vec<Mark>) -> Series {
        Series { label: label.to_owned(), marks }
    }

    fn axis(label: &str) -> Axis {
        Axis { label: label.to_owned(), ..Axis::default() }
    }

    fn sloping(up: f64) -> Mark {
        Mark::Line(Stroke::Solid, vec![(0.0, 0.0), (1.0, up)])
    }

    #[test]
    fn a_drawing_has_its_texts_and_marks() {
        let drawing = Drawing {
            title: "A & B".into(),
            x: axis("action"),
            y: axis("reward"),
            series: vec![series("up", vec![sloping(1.0)]), series("down", vec![sloping(-1.0)])],
        };
        let found = svg(&drawing);
        for text in [">A &amp; B<", ">action<", ">reward<", ">up<", ">down<", ">−1.0<", ">0.5<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        // Two lines, and one in each legend entry.
        assert_eq!(found.matches("<polyline").count(), 4);
        assert_eq!(found, svg(&drawing));
        assert!(!found.contains("NaN"));
    }

    #[test]
    fn series_of_one_label_look_alike_and_share_an_entry() {
        let level = Mark::Level(Stroke::Dashed, 0.5);
        let all = |names: [&str; 3]| {
            let [a, b, c] = names;
            let marks = vec![
                series(a, vec![sloping(1.0)]),
                series(b, vec![level.clone()]),
                series(c, vec![sloping(2.0)]),
            ];
            Drawing { series: marks, ..Drawing::default() }
        };
        let indices =
            |drawing: &Drawing| looks(drawing).iter().map(|look| look.index).collect::<Vec<_>>();
        assert_eq!(indices(&all(["a", "b", "a"])), [0, 1, 0]);
        assert_eq!(indices(&all(["", "", ""])), [0, 1, 2]);
        assert!(looks(&all(["a", "b", "c"])).iter().all(|look| look.marked));
        assert!(!looks(&all(["a", "b", "a"])).iter().any(|look| look.marked));
        assert_eq!(legend_labels(&all(["a", "b", "a"])), ["a", "b"]);
        assert_eq!(legend_labels(&all(["a", "a", ""])), ["a"]);
        let mut single = all(["a", "a", "a"]);
        single.y.label = "a".into();
        assert_eq!(legend_labels(&single), Vec::<&str>::new());
    }

    #[test]
    fn long_names_slant() {
        let bars = |name: &str| {
            let bar = |x| Mark::Bar { x, width: 0.7, y: -1.0, whisker: None };
            let names = vec![name.to_owned(); 8];
            let marks = (0..8).map(|x| bar(f64::from(x))).collect();
            let x = Axis { names, ..Axis::default() };
            svg(&Drawing { x, series: vec![series("", marks)], ..Drawing::default() })
        };
        assert!(!bars("MA").contains("rotate(-40)"));
        assert_eq!(bars("a rather long name").matches("rotate(-40)").count(), 8);
    }

    #[test]
    fn an_empty_drawing_is_still_a_panel() {
        let found = svg(&Drawing::default());
        assert!(found.contains(">0.0<") && found.contains(">1.0<") && found.ends_with("</svg>\n"));
    }
}
