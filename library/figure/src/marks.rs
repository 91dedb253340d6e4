//! Marks of a drawing as SVG elements inside the panel.

use ivx_op::shown;

use super::drawing::{Mark, Stroke};
use super::heat::cell;
use super::scale::{Scale, placeable};
use super::shapes::{arrow, shape};
use super::text::{escape, px, width as text_width};
use super::ways::{sign, swatch as way_swatch, ways};

/// Colours that colour-blind readers can tell apart (Okabe and Ito), without the pale yellow.
const COLOURS: [&str; 7] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];

/// Kinds of marker and of hatching; each colour meets each kind before a look recurs.
const N_SHAPES: usize = 7;

/// The height of a line of text.
const TEXT: f64 = 15.0;

/// A line has about this many markers.
const N_MARKERS: usize = 6;

/// What tells the marks of one label from those of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    /// The place of the label among all.
    pub(super) index: usize,
    /// Whether lines bear markers.
    pub(super) marked: bool,
}

/// The drawing area and the ranges of its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Panel {
    /// In pixels.
    pub(super) width: f64,
    /// In pixels.
    pub(super) height: f64,
    /// The horizontal range.
    pub(super) x: Scale,
    /// The vertical range.
    pub(super) y: Scale,
    /// Whether the vertical range is one of logarithms to base 10.
    pub(super) log: bool,
    /// Whether cells say their values.
    pub(super) valued: bool,
}

impl Panel {
    /// Where a point lies, from the left and the top.
    pub(super) fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x.place(x, self.width), self.height - self.y.place(y, self.height))
    }
}

/// The elements of one mark, one a line.
pub(super) fn draw(mark: &Mark, look: Look, panel: &Panel) -> Vec<String> {
    let at = |x, y| panel.at((x, y));
    match mark {
        Mark::Line(stroke, points) => line(*stroke, points, look, panel),
        Mark::Band(points) => band(points, look, panel),
        Mark::Points(points) => {
            let whole = points.iter().filter(|(x, y)| placeable(*x) && placeable(*y));
            whole.map(|&point| marker(look, panel.at(point), 3.0)).collect()
        }
        Mark::Level(_, y) if !placeable(*y) => Vec::new(),
        Mark::Level(stroke, y) => {
            let (_, y) = at(panel.x.low, *y);
            let mut out = vec![polyline(*stroke, look, &[(0.0, y), (panel.width, y)])];
            if look.marked && *stroke != Stroke::Thin {
                let places = level_markers(look).map(|share| (share * panel.width, y));
                out.extend(places.map(|place| marker(look, place, 3.0)));
            }
            out
        }
        Mark::Upright(_, x) if !placeable(*x) => Vec::new(),
        Mark::Upright(stroke, x) => {
            let (x, _) = at(*x, panel.y.low);
            let mut out = vec![polyline(*stroke, look, &[(x, panel.height), (x, 0.0)])];
            if look.marked && *stroke != Stroke::Thin {
                let places = level_markers(look).map(|share| (x, share * panel.height));
                out.extend(places.map(|place| marker(look, place, 3.0)));
            }
            out
        }
        Mark::Bar { y, .. } if !placeable(*y) => Vec::new(),
        Mark::Bar { x, width, y, whisker } => {
            let foot = if panel.log { panel.y.low } else { 0.0 };
            let ((left, end), (right, foot)) = (at(x - width / 2.0, *y), at(x + width / 2.0, foot));
            let inside = |y: f64| y.clamp(-9.0, panel.height + 9.0);
            let (top, bottom) = (inside(end.min(foot)), inside(end.max(foot)));
            let mut out = vec![bar(look, left, top, right - left, bottom - top)];
            if let Some((low, high)) = whisker.filter(|(low, high)| reaches(*low) && reaches(*high))
            {
                let cap = (right - left).min(24.0) / 4.0;
                out.extend(whisker_lines(panel, *x, (low, high), cap));
            }
            out.extend(beyond(panel, (left, right), *y));
            out
        }
        Mark::Cell { x, y, share, name, value } => cell((*x, *y), *share, (name, value), panel),
        Mark::Frame(x, y) => {
            let ((left, top), (right, bottom)) = (at(x - 0.5, y + 0.5), at(x + 0.5, y - 0.5));
            let (width, height) = (px(right - left - 4.0), px(bottom - top - 4.0));
            let place = format!(r#"x="{}" y="{}""#, px(left + 2.0), px(top + 2.0));
            vec![format!(
                r##"<rect {place} width="{width}" height="{height}" fill="none" stroke="#d55e00" stroke-width="2.5"/>"##
            )]
        }
        Mark::Text(x, y, text) => {
            let (x, y) = at(*x, *y);
            // Where its place is outside, it stands at the edge.
            let y = if y < 0.0 { TEXT } else { y.min(panel.height) };
            vec![format!(
                r##"<text x="{}" y="{}" font-size="11" fill="#222222" text-anchor="middle">{}</text>"##,
                px(x),
                px(y - 4.0),
                escape(text)
            )]
        }
        Mark::Shape { at, size, form, tint, text } => {
            shape(*at, *size, (*form, *tint), text, panel)
        }
        Mark::Ways(way, lines) => ways(*way, lines, look, panel),
        Mark::Sign { sign: what, at, from } => sign(*what, *at, *from, panel),
        Mark::Arrow { from, to, bend, text } => arrow(*from, *to, *bend, text, panel),
    }
}

/// The legend's picture of these marks, about `(x, y)`.
pub(super) fn swatch(marks: &[&Mark], look: Look, x: f64, y: f64) -> Vec<String> {
    let mut out = way_swatch(marks, look, (x, y));
    if marks.iter().any(|mark| matches!(mark, Mark::Bar { .. })) {
        out.push(bar(look, x - 9.0, y - 6.0, 18.0, 12.0));
    }
    if marks.iter().any(|mark| matches!(mark, Mark::Band(_))) {
        out.push(area(
            look,
            &[(x - 12.0, y - 6.0), (x + 12.0, y - 6.0), (x + 12.0, y + 6.0), (x - 12.0, y + 6.0)],
        ));
    }
    let strokes = marks.iter().filter_map(|mark| mark.stroke());
    if let Some(stroke) = strokes.clone().next() {
        out.push(polyline(stroke, look, &[(x - 12.0, y), (x + 12.0, y)]));
    }
    let marked = look.marked && strokes.clone().any(|stroke| stroke != Stroke::Thin);
    if marked || marks.iter().any(|mark| matches!(mark, Mark::Points(_))) {
        out.push(marker(look, (x, y), 3.0));
    }
    out
}

impl Look {
    pub(super) fn colour(self) -> &'static str {
        COLOURS[self.index % COLOURS.len()]
    }

    fn shape(self) -> usize {
        (self.index + self.index / COLOURS.len()) % N_SHAPES
    }
}

fn line(stroke: Stroke, points: &[(f64, f64)], look: Look, panel: &Panel) -> Vec<String> {
    let mut out = Vec::new();
    let whole = |&(x, y): &(f64, f64)| placeable(x) && placeable(y);
    for run in points.split(|point| !whole(point)).filter(|run| !run.is_empty()) {
        let run: Vec<(f64, f64)> = run.iter().map(|&point| panel.at(point)).collect();
        match run[..] {
            [(x, y)] => out.push(dot(look, x, y)),
            _ => out.push(polyline(stroke, look, &run)),
        }
    }
    if look.marked && stroke != Stroke::Thin {
        let step = points.len().div_ceil(N_MARKERS).max(1);
        // Lines that run together have their markers at different places.
        let stagger = (step / 4).max(1) * look.index % step;
        let few = points.len() <= 2 * N_MARKERS;
        let (start, step) = if few { (0, 1) } else { (stagger, step) };
        let chosen = points.iter().skip(start).step_by(step).filter(|point| whole(point));
        out.extend(chosen.map(|&point| marker(look, panel.at(point), 3.0)));
    }
    out
}

/// Where a level bears markers, as shares of the width; different for different labels.
fn level_markers(look: Look) -> [f64; 2] {
    let first = [0.04, 0.25, 0.11, 0.32, 0.18, 0.39, 0.46][look.index % 7];
    [first, first + 0.5]
}

fn band(points: &[(f64, f64, f64)], look: Look, panel: &Panel) -> Vec<String> {
    let broken =
        |&(x, low, high): &(f64, f64, f64)| !placeable(x) || !reaches(low) || !reaches(high);
    let mut out = Vec::new();
    for run in points.split(broken).filter(|run| !run.is_empty()) {
        let lower = run.iter().map(|&(x, low, _)| end(panel, x, low));
        let upper = run.iter().rev().map(|&(x, _, high)| end(panel, x, high));
        if let [(x, low, high)] = run[..] {
            out.extend(whisker_lines(panel, x, (low, high), 3.0));
        } else {
            out.push(area(look, &lower.chain(upper).collect::<Vec<_>>()));
        }
    }
    out
}

/// Whether an interval may end here: an infinite end is open and lies on the frame.
fn reaches(x: f64) -> bool {
    placeable(x) || x.is_infinite()
}

/// Where an end of an interval lies.
fn end(panel: &Panel, x: f64, y: f64) -> (f64, f64) {
    match y {
        f64::INFINITY => (panel.at((x, panel.y.high)).0, 0.0),
        f64::NEG_INFINITY => (panel.at((x, panel.y.low)).0, panel.height),
        _ => panel.at((x, y)),
    }
}

fn polyline(stroke: Stroke, look: Look, points: &[(f64, f64)]) -> String {
    let style = match stroke {
        Stroke::Solid => r#"stroke-width="1.8""#,
        Stroke::Dashed => r#"stroke-width="1.8" stroke-dasharray="6 4""#,
        Stroke::Thin => r#"stroke-width="0.8" stroke-opacity="0.5""#,
    };
    format!(
        r#"<polyline points="{}" fill="none" stroke="{}" {style} stroke-linejoin="round"/>"#,
        coordinates(points),
        look.colour()
    )
}

fn area(look: Look, points: &[(f64, f64)]) -> String {
    format!(
        r#"<polygon points="{}" fill="{}" fill-opacity="0.2"/>"#,
        coordinates(points),
        look.colour()
    )
}

fn dot(look: Look, x: f64, y: f64) -> String {
    format!(r#"<circle cx="{}" cy="{}" r="1.5" fill="{}"/>"#, px(x), px(y), look.colour())
}

/// A whisker, on white so that it shows on any bar; an open end has no cap.
fn whisker_lines(panel: &Panel, x: f64, ends: (f64, f64), cap: f64) -> [String; 2] {
    let ((x, low), (_, high)) = (end(panel, x, ends.0), end(panel, x, ends.1));
    let (left, right) = (px(x - cap), px(x + cap));
    let cap = |value: f64, y: &str| {
        if value.is_finite() { format!("M{left} {y}L{right} {y}") } else { String::new() }
    };
    let (x, low, high) = (px(x), px(low), px(high));
    let (below, above) = (cap(ends.0, &low), cap(ends.1, &high));
    let path = format!("M{x} {low}L{x} {high}{below}{above}");
    [("#ffffff", "3"), ("#222222", "1.2")].map(|(colour, width)| {
        format!(r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"/>"#)
    })
}

/// An arrow at the edge that a bar goes beyond, and how far it goes where there is room for that.
fn beyond(panel: &Panel, (left, right): (f64, f64), y: f64) -> Vec<String> {
    let (tip, base, line) = match y {
        _ if y > panel.y.high => (2.0, 9.0, 20.0),
        _ if y < panel.y.low => (panel.height - 2.0, panel.height - 9.0, panel.height - 13.0),
        _ => return Vec::new(),
    };
    let (x, half) = (f64::midpoint(left, right), ((right - left) / 2.0).min(5.0));
    let path =
        [(x, tip), (x - half, base), (x + half, base)].map(|(x, y)| format!("{} {}", px(x), px(y)));
    let path = path.join("L");
    let mut out =
        vec![format!(r##"<path d="M{path}Z" fill="#ffffff" stroke="#222222" stroke-width="1"/>"##)];
    let value = shown(if panel.log { 10_f64.powf(y) } else { y }).replace('-', "−");
    let wide = text_width(&value, 10.0);
    if wide <= right - left {
        let place = format!(r#"x="{}" y="{}""#, px(x - wide / 2.0), px(line - 9.0));
        out.push(format!(r##"<rect {place} width="{}" height="12" fill="#ffffff"/>"##, px(wide)));
        let place = format!(r#"x="{}" y="{}""#, px(x), px(line));
        out.push(format!(
            r##"<text {place} font-size="10" fill="#222222" text-anchor="middle">{value}</text>"##
        ));
    }
    out
}

fn bar(look: Look, x: f64, y: f64, width: f64, height: f64) -> String {
    let (lines, colour) = (hatching(look.shape(), width, height), look.colour());
    let place =
        format!(r#"x="{}" y="{}" width="{}" height="{}""#, px(x), px(y), px(width), px(height));
    if lines.is_empty() {
        return format!(r#"<rect {place} fill="{colour}"/>"#);
    }
    // An inner `svg` clips its content, and needs no name that another figure might bear.
    let fill = format!(r#"<rect width="100%" height="100%" fill="{colour}"/>"#);
    let lines = format!(r##"<path d="{lines}" stroke="#ffffff" stroke-opacity="0.7"/>"##);
    format!("<svg {place}>{fill}{lines}</svg>")
}

/// Lines across a bar; none for the first kind.
fn hatching(kind: usize, width: f64, height: f64) -> String {
    let (rising, falling, level, upright) = match kind {
        1 => (true, false, false, false),
        2 => (false, true, false, false),
        3 => (false, false, true, false),
        4 => (false, false, false, true),
        5 => (true, true, false, false),
        6 => (false, false, true, true),
        _ => (false, false, false, false),
    };
    let steps =
        |length: f64| (0..).map(|i| f64::from(i) * 6.0 + 3.0).take_while(move |at| *at < length);
    let mut lines = Vec::new();
    let mut add = |a: f64, b: f64, c: f64, d: f64| {
        lines.push(format!("M{} {}L{} {}", px(a), px(b), px(c), px(d)));
    };
    for at in steps(width + height) {
        if rising {
            add(at, 0.0, at - height, height);
        }
        if falling {
            add(at - height, 0.0, at, height);
        }
    }
    if level {
        steps(height).for_each(|at| add(0.0, at, width, at));
    }
    if upright {
        steps(width).for_each(|at| add(at, 0.0, at, height));
    }
    lines.concat()
}

fn marker(look: Look, (x, y): (f64, f64), r: f64) -> String {
    let corners: &[(f64, f64)] = match look.shape() {
        0 => {
            let (x, y, r) = (px(x), px(y), px(r));
            return format!(r#"<circle cx="{x}" cy="{y}" r="{r}" {}/>"#, filled(look));
        }
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
        3 => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
        4 => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
        5 => return cross(look, x, y, r, r),
        _ => return cross(look, x, y, r * 1.3, 0.0),
    };
    let corners: Vec<_> = corners.iter().map(|(dx, dy)| (x + dx * r, y + dy * r)).collect();
    format!(r#"<polygon points="{}" {}/>"#, coordinates(&corners), filled(look))
}

/// Two strokes through a point: along `(a, b)` and across it.
fn cross(look: Look, x: f64, y: f64, a: f64, b: f64) -> String {
    format!(
        r#"<path d="M{} {}L{} {}M{} {}L{} {}" fill="none" stroke="{}" stroke-width="1.8"/>"#,
        px(x - a),
        px(y - b),
        px(x + a),
        px(y + b),
        px(x + b),
        px(y - a),
        px(x - b),
        px(y + a),
        look.colour()
    )
}

fn filled(look: Look) -> String {
    format!(r##"fill="{}" stroke="#ffffff" stroke-width="0.6""##, look.colour())
}

pub(super) fn coordinates(points: &[(f64, f64)]) -> String {
    let pairs: Vec<String> = points.iter().map(|&(x, y)| format!("{},{}", px(x), px(y))).collect();
    pairs.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One unit is one pixel, with `y` upwards from the bottom.
    const PANEL: Panel = Panel {
        width: 10.0,
        height: 10.0,
        x: Scale { low: 0.0, high: 10.0 },
        y: Scale { low: 0.0, high: 10.0 },
        log: false,
        valued: true,
    };

    const PLAIN: Look = Look { index: 0, marked: false };

    #[test]
    fn a_line_breaks_where_a_point_is_missing() {
        let points = [0.0, 1.0, f64::NAN, 3.0, f64::INFINITY, 5.0, 6.0];
        let points = (0..).map(f64::from).zip(points).collect();
        let found = draw(&Mark::Line(Stroke::Dashed, points), PLAIN, &PANEL);
        assert_eq!(found.len(), 3);
        assert!(found[0].contains(r#"points="0,10 1,9""#) && found[0].contains("stroke-dasharray"));
        assert!(found[1].contains(r#"<circle cx="3" cy="7""#));
        assert!(found[2].contains(r#"points="5,5 6,4""#));
    }

    #[test]
    fn a_band_runs_there_and_back() {
        let found = draw(&Mark::Band(vec![(0.0, 1.0, 2.0), (4.0, 3.0, 5.0)]), PLAIN, &PANEL);
        assert!(found[0].contains(r#"points="0,9 4,7 4,5 0,8""#), "{found:?}");
    }

    #[test]
    fn a_bar_hangs_from_zero_and_stays_near_the_panel() {
        let bar = |y| Mark::Bar { x: 5.0, width: 2.0, y, whisker: Some((y - 1.0, y + 1.0)) };
        let found = draw(&bar(4.0), PLAIN, &PANEL);
        assert!(found[0].contains(r#"x="4" y="6" width="2" height="4""#), "{found:?}");
        assert!(found[1].contains("M5 7L5 5"), "{found:?}");
        let found = draw(&bar(1e200), PLAIN, &PANEL);
        assert!(found[0].contains(r#"y="-9" width="2" height="19""#), "{found:?}");
        assert_eq!(draw(&bar(f64::NAN), PLAIN, &PANEL), Vec::<String>::new());
    }

    #[test]
    fn only_marked_lines_bear_markers() {
        let points: Vec<(f64, f64)> = (0..100).map(|i| (f64::from(i) / 10.0, 5.0)).collect();
        let count = |stroke, look| draw(&Mark::Line(stroke, points.clone()), look, &PANEL).len();
        let marked = Look { index: 1, marked: true };
        assert_eq!(count(Stroke::Solid, marked), 1 + N_MARKERS);
        assert_eq!(count(Stroke::Solid, PLAIN), 1);
        assert_eq!(count(Stroke::Thin, marked), 1);
        assert_eq!(draw(&Mark::Level(Stroke::Dashed, 5.0), marked, &PANEL).len(), 3);
        let upright = draw(&Mark::Upright(Stroke::Dashed, 5.0), PLAIN, &PANEL);
        assert!(upright[0].contains(r#"points="5,10 5,0""#), "{upright:?}");
    }

    #[test]
    fn no_two_of_many_labels_look_alike() {
        let looks = (0..COLOURS.len() * N_SHAPES).map(|index| Look { index, marked: false });
        let mut looks: Vec<_> = looks.map(|look| (look.colour(), look.shape())).collect();
        looks.sort_unstable();
        looks.dedup();
        assert_eq!(looks.len(), 49);
        assert_ne!(hatching(1, 8.0, 8.0), hatching(2, 8.0, 8.0));
    }
}
