//! Pictures of worlds.

use ivx_data::{Outline, Picture, Place, Shape};
use ivx_op::{Ctx, Figure, One, Op, OpError, declare};

use super::drawing::{Axis, Drawing};
use super::marks::coordinates;
use super::render::render;
use super::text::px;

declare! {
    /// What a world looks like, such as CoinGrid in Figure 4.7a: a picture that `scene` made, as wide as it is high in its
    /// own units, and without axes.
    pub struct Pictured = "picture" @ 1 -> Figure {
        /// The picture.
        of: One<Picture>;
        /// Above it.
        title: String = "";
    }
}

/// The most pixels of a picture.
const ROOM: (f64, f64) = (640.0, 420.0);

/// And those that a unit of it has.
const UNIT: f64 = 44.0;

impl Op for Pictured {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let bare = || Axis { bare: true, ..Axis::default() };
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: bare(),
            y: bare(),
            picture: Some((String::new(), self.of.0.clone())),
            ..Drawing::default()
        }))
    }
}

/// How wide and high a picture is that stands alone.
pub(super) fn size(picture: &Picture) -> (f64, f64) {
    let unit = unit(picture, ROOM).min(UNIT);
    (picture.size[0] * unit, picture.size[1] * unit)
}

/// The pixels of a unit where a picture fills its room.
fn unit(picture: &Picture, room: (f64, f64)) -> f64 {
    (room.0 / picture.size[0]).min(room.1 / picture.size[1])
}

/// A picture as large as fits its room, in the middle of it; what lies outside of it is cut off.
pub(super) fn drawn(picture: &Picture, room: (f64, f64)) -> Vec<String> {
    let unit = unit(picture, room);
    let [width, height] = picture.size.map(|side| side * unit);
    let (left, top) = ((room.0 - width) / 2.0, (room.1 - height) / 2.0);
    let mut out = vec![format!(
        r#"<svg x="{}" y="{}" width="{}" height="{}">"#,
        px(left),
        px(top),
        px(width),
        px(height)
    )];
    out.extend(picture.shapes.iter().map(|one| shape(one, unit)));
    out.push("</svg>".to_owned());
    out
}

fn shape(Shape { outline, colour: [red, green, blue] }: &Shape, unit: f64) -> String {
    let colour = format!("#{red:02x}{green:02x}{blue:02x}");
    let points = |places: &[Place]| {
        let scaled: Vec<(f64, f64)> = places.iter().map(|[x, y]| (x * unit, y * unit)).collect();
        coordinates(&scaled)
    };
    match outline {
        Outline::Polygon(corners) => {
            format!(r#"<polygon points="{}" fill="{colour}"/>"#, points(corners))
        }
        Outline::Circle([x, y], radius) => {
            let [x, y, r] = [x, y, radius].map(|along| px(along * unit));
            format!(r#"<circle cx="{x}" cy="{y}" r="{r}" fill="{colour}"/>"#)
        }
        Outline::Line(places, width) => {
            let (points, width) = (points(places), px(width * unit));
            format!(
                r#"<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"/>"#
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(size: [f64; 2]) -> Picture {
        let shape = |outline, colour| Shape { outline, colour };
        let shapes = vec![
            shape(Outline::Polygon(vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]), [255, 0, 16]),
            shape(Outline::Circle([1.0, 0.5], 0.25), [0, 158, 115]),
            shape(Outline::Line(vec![[-1.0, 0.0], [0.5, 1.0]], 0.1), [0, 0, 0]),
        ];
        Picture { size, shapes }
    }

    #[test]
    fn a_unit_is_as_wide_as_it_is_high() {
        // 10 pixels a unit, and 10 to spare above and below.
        let found = drawn(&picture([2.0, 1.0]), (20.0, 30.0));
        assert_eq!(
            found,
            [
                r#"<svg x="0" y="10" width="20" height="10">"#,
                r##"<polygon points="0,0 20,0 20,10" fill="#ff0010"/>"##,
                r##"<circle cx="10" cy="5" r="2.5" fill="#009e73"/>"##,
                r##"<polyline points="-10,0 5,10" fill="none" stroke="#000000" stroke-width="1"/>"##,
                "</svg>",
            ]
        );
    }

    #[test]
    fn a_figure_is_as_large_as_looks_well_and_has_no_axes() {
        let check = |wide, high, expected| assert_eq!(size(&picture([wide, high])), expected);
        check(7.0, 7.0, (308.0, 308.0));
        check(100.0, 20.0, (640.0, 128.0));
        check(120.0, 120.0, (420.0, 420.0));
        let op = Pictured { of: One(picture([2.0, 1.0])), title: "T".to_owned() };
        let svg = &op.run(&Ctx::new("picture", 0, None)).unwrap().files["svg"];
        for part in [r#"width="88" height="44""#, r#"<circle cx="44" cy="22" r="11""#, ">T<"] {
            assert!(svg.contains(part), "{part} in {svg}");
        }
        assert_eq!((svg.matches("<text").count(), svg.matches("<path").count()), (1, 0));
    }
}
