//! A drawing as an SVG file.
//!
//! The format is written directly: `plotters` rounds coordinates to whole pixels, and lays its
//! legend over the data.

use ivx_op::Figure;

use super::drawing::{Axis, Drawing, Mark, Series, Stroke};
use super::legend::legend;
use super::looks::looks;
use super::marks::{Look, draw};
use super::page::{Page, SMALL};
use super::picture::drawn;
use super::text::{escape, power_of_ten, px, width};

const INK: &str = "#222222";
const GRID: &str = "#e4e4e4";

/// The drawing as a figure: the same bytes for the same drawing.
pub(super) fn render(drawing: &Drawing) -> Figure {
    let page = Page::of(drawing);
    let mut out = vec![
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}" font-family="sans-serif" role="img">"#,
            px(page.width),
            px(page.height)
        ),
        r##"<rect width="100%" height="100%" fill="#ffffff"/>"##.to_owned(),
    ];
    let looks = looks(drawing);
    for (panel, name) in drawing.panels().into_iter().enumerate() {
        if drawing.colours.is_none() {
            out.extend(grid(panel, &page));
        }
        out.extend(marks(drawing, &looks, (panel, name), &page));
        out.extend(horizontal_axis(&drawing.x, panel, &page));
        out.extend(vertical_axis(&drawing.y, panel, &page));
        if !name.is_empty() {
            let (left, top) = page.corner(panel);
            out.push(text(left + page.panel.width / 2.0, top - 5.0, SMALL, "middle", name));
        }
    }
    out.extend(axis_labels(drawing, &page));
    out.extend(title(&drawing.title, &page));
    out.extend(legend(drawing, &page));
    if !drawing.lacks.nothing() {
        out.push(text(8.0, page.height - 6.0, SMALL, "start", &drawing.lacks.told()));
    }
    out.push("</svg>\n".to_owned());
    Figure { files: [("svg".to_owned(), out.join("\n"))].into() }
}

fn grid(panel: usize, page: &Page) -> Vec<String> {
    let ((left, top), inside) = (page.corner(panel), page.panel(panel));
    let line = |y: &f64| {
        let y = px(top + inside.height - inside.y.place(*y, inside.height));
        let (left, right) = (px(left), px(left + inside.width));
        format!(r#"<path d="M{left} {y}L{right} {y}" stroke="{GRID}" stroke-width="0.8"/>"#)
    };
    page.y_ticks[panel].at.iter().map(line).collect()
}

fn marks(
    drawing: &Drawing,
    looks: &[Look],
    (place, name): (usize, &str),
    page: &Page,
) -> Vec<String> {
    let here = |series: &&Series| series.panel.is_empty() || series.panel == name;
    let all = drawing.series.iter().zip(looks).filter(|(series, _)| here(series));
    let all = all.flat_map(|(series, look)| series.marks.iter().map(move |mark| (mark, *look)));
    let mut all: Vec<(&Mark, Look)> = all.collect();
    all.sort_by_key(|(mark, _)| depth(mark));

    let (panel, (left, top)) = (&page.panel(place), page.corner(place));
    // An inner `svg` clips its content, and needs no name that another figure might bear.
    let mut out = vec![format!(
        r#"<svg x="{}" y="{}" width="{}" height="{}">"#,
        px(left),
        px(top),
        px(panel.width),
        px(panel.height)
    )];
    let picture = drawing.picture.iter().filter(|(own, _)| own == name);
    out.extend(picture.flat_map(|(_, picture)| drawn(picture, (panel.width, panel.height))));
    out.extend(all.iter().flat_map(|(mark, look)| draw(mark, *look, panel)));
    let has_bars = all.iter().any(|(mark, _)| matches!(mark, Mark::Bar { .. }));
    if has_bars && !panel.log && panel.y.low < 0.0 && panel.y.high > 0.0 {
        let (y, right) = (px(panel.height - panel.y.place(0.0, panel.height)), px(panel.width));
        out.push(format!(r#"<path d="M0 {y}L{right} {y}" stroke="{INK}" stroke-width="1"/>"#));
    }
    out.push("</svg>".to_owned());
    out
}

/// What lies below what: areas, then many thin lines, then lines, then points and text.
fn depth(mark: &Mark) -> u8 {
    match mark {
        Mark::Band(_) | Mark::Bar { .. } | Mark::Cell { .. } | Mark::Shape { .. } => 0,
        Mark::Line(Stroke::Thin, _)
        | Mark::Level(Stroke::Thin, _)
        | Mark::Upright(Stroke::Thin, _) => 1,
        Mark::Ways(way, _) => way.depth(),
        Mark::Level(..) | Mark::Upright(..) => 2,
        Mark::Line(..) => 3,
        Mark::Points(_) => 4,
        Mark::Frame(..) | Mark::Text(..) | Mark::Arrow { .. } | Mark::Sign { .. } => 5,
    }
}

/// The line below a panel, and what it says below the last of its column.
fn horizontal_axis(axis: &Axis, place: usize, page: &Page) -> Vec<String> {
    if axis.bare {
        return Vec::new();
    }
    let (panel, (left, top)) = (&page.panel, page.corner(place));
    let (bottom, right) = (top + panel.height, left + panel.width);
    let mut out = vec![stroke(left, bottom, right, bottom)];
    for (at, label) in page.x_ticks.at.iter().zip(&page.x_ticks.labels) {
        let x = left + panel.x.place(*at, panel.width);
        out.push(stroke(x, bottom, x, bottom + 4.0));
        if !page.is_last(place) {
            continue;
        }
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
    out
}

/// The line left of a panel, and what it says left of the first of its row.
fn vertical_axis(axis: &Axis, place: usize, page: &Page) -> Vec<String> {
    if axis.bare {
        return Vec::new();
    }
    let (panel, (left, top)) = (page.panel(place), page.corner(place));
    let bottom = top + panel.height;
    let mut out = vec![stroke(left, top, left, bottom)];
    let ticks = &page.y_ticks[place];
    for (at, label) in ticks.at.iter().zip(&ticks.labels) {
        let y = bottom - panel.y.place(*at, panel.height);
        out.push(stroke(left - 4.0, y, left, y));
        if axis.free || page.is_first(place) {
            out.push(text(left - 7.0, y + 4.0, SMALL, "end", label));
        }
    }
    out
}

/// What the axes measure, once for all panels.
fn axis_labels(drawing: &Drawing, page: &Page) -> Vec<String> {
    let ((left, top), (inside, down)) = (page.corner(0), page.extent());
    let (right, last_line) = (left + inside, top + down + page.below + 12.0);
    let mut out = Vec::new();
    if !drawing.x.label.is_empty() {
        out.push(text(left + inside / 2.0, last_line, 12.0, "middle", &drawing.x.label));
    }
    if page.x_ticks.exponent != 0 {
        let power = power_of_ten(page.x_ticks.exponent);
        out.push(text(right, last_line, SMALL, "end", &power));
    }
    if !drawing.y.label.is_empty() {
        out.push(format!(
            r#"<text transform="translate(16 {}) rotate(-90)" font-size="12" fill="{INK}" text-anchor="middle">{}</text>"#,
            px(top + down / 2.0),
            escape(&drawing.y.label)
        ));
    }
    let above = if drawing.panels()[0].is_empty() { 5.0 } else { 19.0 };
    let powers = page.y_ticks.iter().enumerate().filter(|(_, ticks)| ticks.exponent != 0);
    for (place, ticks) in powers.filter(|(place, _)| drawing.y.free || *place == 0) {
        let ((left, top), power) = (page.corner(place), power_of_ten(ticks.exponent));
        out.push(text(left, top - above, SMALL, "start", &power));
    }
    out
}

fn title(title: &str, page: &Page) -> Option<String> {
    let (left, y) = (page.corner(0).0, 20.0);
    // Centred on the panels unless it would then leave the page.
    let half = width(title, 13.0) * 0.55;
    let x = (left + page.extent().0 / 2.0).min(page.width - half - 4.0).max(half + 4.0);
    (!title.is_empty()).then(|| {
        text(x, y, 13.0, "middle", title).replace("<text ", r#"<text font-weight="bold" "#)
    })
}

fn stroke(a: f64, b: f64, c: f64, d: f64) -> String {
    let path = format!("M{} {}L{} {}", px(a), px(b), px(c), px(d));
    format!(r#"<path d="{path}" stroke="{INK}" stroke-width="1"/>"#)
}

pub(super) fn text(x: f64, y: f64, size: f64, anchor: &str, text: &str) -> String {
    inked((x, y), (size, INK), anchor, text)
}

/// Text of a size and a colour.
pub(super) fn inked(
    (x, y): (f64, f64),
    (size, ink): (f64, &str),
    anchor: &str,
    text: &str,
) -> String {
    format!(
        r#"<text x="{}" y="{}" font-size="{size}" fill="{ink}" text-anchor="{anchor}">{}</text>"#,
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
        Series { label: label.to_owned(), marks, ..Series::default() }
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
            ..Drawing::default()
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

    #[test]
    fn panels_share_what_the_axes_say() {
        let in_panel = |panel: &str, up| Series {
            panel: panel.to_owned(),
            ..series("line", vec![sloping(up)])
        };
        let level = series("level", vec![Mark::Level(Stroke::Dashed, 0.5)]);
        let found = svg(&Drawing {
            x: axis("n"),
            y: axis("gap"),
            series: vec![in_panel("WCM", 1.0), in_panel("MA", 10.0), level],
            columns: 2,
            ..Drawing::default()
        });
        for text in [">WCM<", ">MA<", ">n<", ">gap<", ">line<", ">10<"] {
            assert_eq!(found.matches(text).count(), 1, "{text} in {found}");
        }
        // A line and the level in each panel, and one of each in the legend.
        assert_eq!(found.matches("<polyline").count(), 6);
    }
}
