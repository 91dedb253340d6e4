//! Shapes and arrows: what diagrams are made of.

use super::drawing::{Form, Tint};
use super::marks::Panel;
use super::render::inked;
use super::text::px;

/// The size of the text in and beside shapes.
const TEXT: f64 = 10.0;

/// A circle or rectangle, and what stands in it.
pub(super) fn shape(
    at: (f64, f64),
    (width, height): (f64, f64),
    (form, tint): (Form, Tint),
    text: &str,
    panel: &Panel,
) -> Vec<String> {
    let (x, y) = panel.at(at);
    let wide = panel.x.place(panel.x.low + width / 2.0, panel.width);
    let high = panel.y.place(panel.y.low + height / 2.0, panel.height);
    let (fill, ink) = match tint {
        Tint::White => ("#ffffff", "#222222"),
        Tint::Grey => ("#d4d4d4", "#222222"),
        Tint::Black => ("#222222", "#ffffff"),
        Tint::Green => ("#8fd3b6", "#222222"),
        Tint::Red => ("#f2b08a", "#222222"),
    };
    let look = format!(r##"fill="{fill}" stroke="#222222""##);
    let mut out = vec![match form {
        Form::Circle => {
            format!(r#"<circle cx="{}" cy="{}" r="{}" {look}/>"#, px(x), px(y), px(wide))
        }
        Form::Rectangle => format!(
            r#"<rect x="{}" y="{}" width="{}" height="{}" {look}/>"#,
            px(x - wide),
            px(y - high),
            px(2.0 * wide),
            px(2.0 * high)
        ),
    }];
    if !text.is_empty() {
        out.push(inked((x, y + 3.5), (TEXT, ink), "middle", text));
    }
    out
}

/// A curve from one place to another with a head at its end.
pub(super) fn arrow(
    from: (f64, f64),
    to: (f64, f64),
    bend: f64,
    text: &str,
    panel: &Panel,
) -> Vec<String> {
    let bend = panel.x.place(panel.x.low + bend, panel.width);
    let ((x0, y0), (x1, y1)) = (panel.at(from), panel.at(to));
    let (dx, dy) = (x1 - x0, y1 - y0);
    let length = dx.hypot(dy).max(1e-9);
    // Left of the way, where `y` goes down.
    let (left_x, left_y) = (dy / length, -dx / length);
    let middle = (f64::midpoint(x0, x1) + bend * left_x, f64::midpoint(y0, y1) + bend * left_y);
    // A quadratic curve passes half as far from the straight line as its control point lies.
    let control = (middle.0 + bend * left_x, middle.1 + bend * left_y);
    let (hx, hy) = (x1 - control.0, y1 - control.1);
    let along = hx.hypot(hy).max(1e-9);
    let (hx, hy) = (hx / along, hy / along);
    let wing = |side: f64| {
        format!("{} {}", px(x1 - 6.0 * hx - side * 3.0 * hy), px(y1 - 6.0 * hy + side * 3.0 * hx))
    };
    let mut out = vec![
        format!(
            r##"<path d="M{} {}Q{} {} {} {}" fill="none" stroke="#222222"/>"##,
            px(x0),
            px(y0),
            px(control.0),
            px(control.1),
            px(x1),
            px(y1)
        ),
        format!(
            r##"<path d="M{} {}L{}L{}Z" fill="#222222"/>"##,
            px(x1),
            px(y1),
            wing(1.0),
            wing(-1.0)
        ),
    ];
    if !text.is_empty() {
        let place = (middle.0 + 10.0 * left_x, middle.1 + 10.0 * left_y + 3.5);
        out.push(inked(place, (TEXT, "#222222"), "middle", text));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::scale::Scale;
    use super::*;

    /// One unit is one pixel, with `y` upwards from the bottom.
    const PANEL: Panel = Panel {
        width: 100.0,
        height: 100.0,
        x: Scale { low: 0.0, high: 100.0 },
        y: Scale { low: 0.0, high: 100.0 },
        log: false,
        valued: true,
    };

    #[test]
    fn shapes_lie_about_their_centre() {
        let circle = shape((10.0, 20.0), (8.0, 8.0), (Form::Circle, Tint::Black), "a<b", &PANEL);
        assert!(circle[0].contains(r##"cx="10" cy="80" r="4" fill="#222222""##), "{circle:?}");
        assert!(circle[1].contains(r##"fill="#ffffff""##) && circle[1].contains(">a&lt;b<"));
        let look = (Form::Rectangle, Tint::of(-0.5));
        let cell = shape((10.0, 20.0), (8.0, 4.0), look, "", &PANEL);
        assert!(cell[0].contains(r##"x="6" y="78" width="8" height="4" fill="#f2b08a""##));
        assert_eq!(cell.len(), 1);
    }

    #[test]
    fn an_arrow_bends_to_its_left() {
        // From left to right its left is above, and so is a smaller y of the picture.
        let bent = arrow((10.0, 50.0), (50.0, 50.0), 5.0, "p", &PANEL);
        assert!(bent[0].contains("M10 50Q30 40 50 50"), "{bent:?}");
        assert!(bent[2].contains(r#"x="30" y="38.5""#), "{bent:?}");
        let straight = arrow((10.0, 50.0), (50.0, 50.0), 0.0, "", &PANEL);
        assert!(straight[1].contains("M50 50L44 53L44 47Z"), "{straight:?}");
    }
}
