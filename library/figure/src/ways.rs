//! Ways and signs: what maps are made of.

use super::drawing::{Mark, Sign, Way};
use super::marks::{Look, Panel};

impl Way {
    /// What lies below what, among all marks.
    pub(super) fn depth(self) -> u8 {
        match self {
            Self::Route => 0,
            Self::Road | Self::Frame | Self::Scale => 1,
            Self::Driven | Self::Dots => 3,
            Self::Shaded => 4,
        }
    }
}

/// What is drawn in dark.
const INK: &str = "#222222";

/// Lines of places, as one element; a line of one place is a dot.
pub(super) fn ways(way: Way, lines: &[Vec<(f64, f64)>], look: Look, panel: &Panel) -> Vec<String> {
    let line = |line: &Vec<(f64, f64)>| {
        let places: Vec<(f64, f64)> = line.iter().map(|place| panel.at(*place)).collect();
        outline(&places)
    };
    let path: Vec<String> = lines.iter().filter(|line| !line.is_empty()).map(line).collect();
    if path.is_empty() { Vec::new() } else { vec![element(way, look, &path.concat())] }
}

/// A sign at a place, to which one came from `from`.
pub(super) fn sign(sign: Sign, at: (f64, f64), from: (f64, f64), panel: &Panel) -> Vec<String> {
    drawn(sign, panel.at(at), panel.at(from))
}

/// The legend's picture of ways and signs, about `(x, y)`.
pub(super) fn swatch(marks: &[&Mark], look: Look, (x, y): (f64, f64)) -> Vec<String> {
    let of = |mark: &&Mark| match mark {
        Mark::Ways(Way::Dots, _) => vec![element(Way::Dots, look, &outline(&[(x, y)]))],
        Mark::Ways(way, _) => {
            vec![element(*way, look, &outline(&[(x - 12.0, y), (x + 12.0, y)]))]
        }
        Mark::Sign { sign, .. } => drawn(*sign, (x + 3.0, y), (x - 9.0, y)),
        _ => Vec::new(),
    };
    marks.iter().map(of).find(|found| !found.is_empty()).unwrap_or_default()
}

fn element(way: Way, look: Look, path: &str) -> String {
    let (colour, style) = match way {
        Way::Road => ("#a8a8a8", r#"stroke-width="0.8""#),
        Way::Frame => ("#d4d4d4", r#"stroke-width="1""#),
        Way::Scale => (INK, r#"stroke-width="1.2""#),
        Way::Route => ("#b9d6ee", r#"stroke-width="4" stroke-linecap="round""#),
        Way::Driven | Way::Dots => (look.colour(), r#"stroke-width="1.6" stroke-linecap="round""#),
        Way::Shaded => ("#8b0000", r#"stroke-width="2.6" stroke-linecap="round""#),
    };
    format!(r#"<path d="{path}" fill="none" stroke="{colour}" {style} stroke-linejoin="round"/>"#)
}

fn drawn(sign: Sign, (x, y): (f64, f64), (from_x, from_y): (f64, f64)) -> Vec<String> {
    let cross = |colour: &str, wide: f64| {
        let at = |dx: f64, dy: f64| format!("{} {}", short(x + dx), short(y + dy));
        let path =
            format!("M{} {}M{} {}", at(-3.2, -3.2), at(3.2, 3.2), at(-3.2, 3.2), at(3.2, -3.2));
        format!(r#"<path d="{path}" stroke="{colour}" stroke-width="{wide}"/>"#)
    };
    match sign {
        Sign::Start => vec![format!(
            r##"<circle cx="{}" cy="{}" r="3.4" fill="#ffffff" stroke="{INK}" stroke-width="1.4"/>"##,
            short(x),
            short(y)
        )],
        Sign::Goal => vec![format!(
            r##"<rect x="{}" y="{}" width="7.4" height="7.4" fill="{INK}" stroke="#ffffff"/>"##,
            short(x - 3.7),
            short(y - 3.7)
        )],
        Sign::End => {
            let (dx, dy) = (x - from_x, y - from_y);
            let long = dx.hypot(dy).max(1e-9);
            let (dx, dy) = (dx / long, dy / long);
            let at = |along: f64, aside: f64| {
                let (x, y) = (x + along * dx - aside * dy, y + along * dy + aside * dx);
                format!("{} {}", short(x), short(y))
            };
            let path = format!("M{} {} {}Z", at(3.5, 0.0), at(-4.5, 3.6), at(-4.5, -3.6));
            vec![format!(
                r##"<path d="{path}" fill="{INK}" stroke="#ffffff" stroke-width="0.8"/>"##
            )]
        }
        Sign::Fault => vec![cross("#ffffff", 4.0), cross(INK, 1.8)],
    }
}

/// A line as a path.
fn outline(places: &[(f64, f64)]) -> String {
    let pairs: Vec<String> =
        places.iter().map(|(x, y)| format!("{} {}", short(*x), short(*y))).collect();
    let dot = if pairs.len() == 1 { "h0" } else { "" };
    format!("M{}{dot}", pairs.join(" "))
}

/// A coordinate to a tenth of a pixel.
fn short(x: f64) -> String {
    (((x * 10.0).round() + 0.0) / 10.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::scale::Scale;
    use super::*;

    const PANEL: Panel = Panel {
        width: 100.0,
        height: 100.0,
        x: Scale { low: 0.0, high: 100.0 },
        y: Scale { low: 0.0, high: 100.0 },
        log: false,
        valued: true,
    };
    const LOOK: Look = Look { index: 0, marked: false };

    #[test]
    fn lines_are_one_element_and_places_alone_are_dots() {
        let lines = [vec![(1.0, 99.0), (2.04, 98.0), (3.0, 90.0)], Vec::new(), vec![(5.0, 50.0)]];
        let found = ways(Way::Driven, &lines, LOOK, &PANEL);
        assert_eq!(found.len(), 1);
        assert!(found[0].contains(r##"d="M1 1 2 2 3 10M5 50h0" fill="none" stroke="#0072B2""##));
        assert!(ways(Way::Road, &[Vec::new()], LOOK, &PANEL).is_empty());
    }

    #[test]
    fn an_end_points_where_one_came_to() {
        // To the right; the panel's y goes up.
        let end = sign(Sign::End, (50.0, 50.0), (40.0, 50.0), &PANEL);
        assert!(end[0].contains(r#"d="M53.5 50 45.5 53.6 45.5 46.4Z""#), "{end:?}");
        let up = sign(Sign::End, (50.0, 50.0), (50.0, 40.0), &PANEL);
        assert!(up[0].contains(r#"d="M50 46.5 "#), "{up:?}");
        let fault = sign(Sign::Fault, (50.0, 50.0), (40.0, 50.0), &PANEL);
        assert!(fault[1].contains("M46.8 46.8 53.2 53.2M46.8 53.2 53.2 46.8"), "{fault:?}");
    }
}
