//! What worlds look like.

use ivx_op::{Artifact, Data, OpError, Tensors};
use serde::{Deserialize, Serialize};

/// `[x, y]` in the units of a picture.
pub type Place = [f64; 2];

/// A picture in units of its own: of a world of cells, a cell; of traffic, a metre. A unit is as wide as it is high.
///
/// `x` goes from 0 at the left to the width, and `y` from 0 at the top to the height; what lies outside is cut off.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// How wide and how high it is.
    pub size: [f64; 2],
    /// What is on it, later ones over earlier ones.
    pub shapes: Vec<Shape>,
}

/// Something that is filled with a colour, or a line of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Where it is.
    pub outline: Outline,
    /// Red, green and blue, as sRGB has them.
    pub colour: [u8; 3],
}

/// Where a shape is.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Within its corners, of which there are at least three.
    Polygon(Vec<Place>),
    /// About its centre, up to its radius.
    Circle(Place, f64),
    /// Along at least two places, so wide.
    Line(Vec<Place>, f64),
}

impl Outline {
    /// A rectangle about its centre, turned by so many radians from `x` to `y`.
    #[must_use]
    pub fn rectangle([x, y]: Place, [width, height]: [f64; 2], turned: f64) -> Self {
        let (sin, cos) = turned.sin_cos();
        let corner = |(along, across): (f64, f64)| {
            let (a, b) = (along * width / 2.0, across * height / 2.0);
            [x + a * cos - b * sin, y + a * sin + b * cos]
        };
        Self::Polygon([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec())
    }

    /// Its kind, its places, and its radius or width.
    fn parts(&self) -> (Kind, &[Place], f64) {
        match self {
            Self::Polygon(corners) => (Kind::Polygon, corners, 0.0),
            Self::Circle(centre, radius) => (Kind::Circle, std::slice::from_ref(centre), *radius),
            Self::Line(places, width) => (Kind::Line, places, *width),
        }
    }

    fn of(kind: Kind, places: &[Place], extent: f64) -> Self {
        match kind {
            Kind::Polygon => Self::Polygon(places.to_vec()),
            Kind::Circle => Self::Circle(places[0], extent),
            Kind::Line => Self::Line(places.to_vec(), extent),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    Polygon,
    Circle,
    Line,
}

impl Kind {
    /// Whether a shape of it has so many places, and this radius or width.
    fn has(self, n: usize, extent: f64) -> bool {
        match self {
            Self::Polygon => n >= 3 && extent == 0.0,
            Self::Circle => n == 1 && is_size(extent),
            Self::Line => n >= 2 && is_size(extent),
        }
    }
}

/// No picture is larger, and nothing on it farther off.
const LARGEST: f64 = 1e6;
/// And none is smaller.
const SMALLEST: f64 = 1e-6;

fn is_size(x: f64) -> bool {
    (SMALLEST..=LARGEST).contains(&x)
}

fn is_place(place: &Place) -> bool {
    place.iter().all(|x| x.abs() <= LARGEST)
}

impl Artifact for Picture {
    const KIND: &'static str = "Picture";

    /// Kinds and numbers of places are facts; places, radii and widths, and colours are arrays.
    fn encode(&self) -> Vec<u8> {
        let (mut facts, mut places, mut extents, mut colours) = (vec![], vec![], vec![], vec![]);
        for Shape { outline, colour } in &self.shapes {
            let (kind, own, extent) = outline.parts();
            facts.push((kind, own.len()));
            places.extend(own.as_flattened());
            extents.push(extent);
            colours.extend(colour);
        }
        let n = facts.len();
        let arrays = [
            ("size", Data::F64(vec![2], self.size.to_vec())),
            ("places", Data::F64(vec![places.len() / 2, 2], places)),
            ("extents", Data::F64(vec![n], extents)),
            ("colours", Data::U8(vec![n, 3], colours)),
        ];
        let arrays = arrays.map(|(name, data)| (name.to_owned(), data)).into();
        Tensors { arrays }.encode(Self::KIND, &facts)
    }

    fn is_kept(&self) -> Result<(), OpError> {
        let is_sound = |shape: &Shape| {
            let (kind, places, extent) = shape.outline.parts();
            kind.has(places.len(), extent) && places.iter().all(is_place)
        };
        if self.size.into_iter().all(is_size) && self.shapes.iter().all(is_sound) {
            return Ok(());
        }
        let why = "the picture has a shape of too few places, or numbers that nothing is drawn at";
        Err(OpError::Failed(why.to_owned()))
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, facts) = Tensors::decode::<Vec<(Kind, usize)>>(Self::KIND, bytes)?;
        let ((_, size), (shape, places)) = (tensors.f64("size")?, tensors.f64("places")?);
        let ((_, extents), (wide, colours)) = (tensors.f64("extents")?, tensors.u8("colours")?);
        let size: [f64; 2] = size.try_into().ok()?;
        let n = facts.len();
        if extents.len() != n || wide != [n, 3] || shape.get(1) != Some(&2) {
            return None;
        }
        let (mut rest, _) = places.as_chunks::<2>();
        let mut shapes = Vec::with_capacity(n);
        for (((kind, n), extent), colour) in
            facts.into_iter().zip(extents).zip(colours.as_chunks().0)
        {
            let (own, others) = rest.split_at_checked(n)?;
            if !kind.has(n, extent) {
                return None;
            }
            shapes.push(Shape { outline: Outline::of(kind, own, extent), colour: *colour });
            rest = others;
        }
        let picture = Self { size, shapes };
        (rest.is_empty() && picture.is_kept().is_ok()).then_some(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let shape = |outline, colour| Shape { outline, colour };
        Picture {
            size: [4.0, 2.5],
            shapes: vec![
                shape(Outline::Polygon(vec![[0.0, 0.0], [4.0, -1.0], [2.0, 2.5]]), [1, 2, 3]),
                shape(Outline::Circle([1.0, 1.0], 0.5), [255, 0, 9]),
                shape(Outline::Line(vec![[0.5, -0.0], [9.0, 1.0]], 0.1), [0, 0, 0]),
            ],
        }
    }

    #[test]
    fn it_survives_the_round_trip() {
        let bytes = picture().encode();
        assert_eq!(Picture::decode(&bytes), Some(picture()));
        assert_eq!(Picture::decode(&bytes).unwrap().encode(), bytes);
        let empty = Picture { shapes: vec![], ..picture() };
        assert_eq!(Picture::decode(&empty.encode()), Some(empty));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let check = |break_it: &dyn Fn(&mut Picture)| {
            let mut broken = picture();
            break_it(&mut broken);
            assert!(broken.is_kept().is_err(), "{broken:?}");
            assert_eq!(Picture::decode(&broken.encode()), None, "{broken:?}");
        };
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7] {
            check(&|picture| picture.size[1] = wrong);
            check(&|picture| picture.shapes[1].outline = Outline::Circle([1.0, 1.0], wrong));
        }
        for wrong in [f64::NAN, f64::NEG_INFINITY, 1e7] {
            check(&|picture| picture.shapes[1].outline = Outline::Circle([1.0, wrong], 1.0));
        }
        check(&|picture| picture.shapes[0].outline = Outline::Polygon(vec![[0.0; 2]; 2]));
        check(&|picture| picture.shapes[2].outline = Outline::Line(vec![[0.0; 2]], 1.0));
    }

    #[test]
    fn bytes_whose_counts_do_not_agree_are_refused() {
        let check = |facts: &[(Kind, usize)], n_places: usize, n: usize, channels: usize| {
            let arrays = [
                ("size", Data::F64(vec![2], vec![1.0; 2])),
                ("places", Data::F64(vec![n_places, 2], vec![0.5; 2 * n_places])),
                ("extents", Data::F64(vec![n], vec![0.5; n])),
                ("colours", Data::U8(vec![n, channels], vec![7; n * channels])),
            ];
            let arrays = arrays.map(|(name, data)| (name.to_owned(), data)).into();
            Picture::decode(&Tensors { arrays }.encode(Picture::KIND, &facts)).is_some()
        };
        let (circle, line) = (Kind::Circle, Kind::Line);
        assert!(check(&[(circle, 1), (line, 2)], 3, 2, 3));
        assert!(!check(&[(circle, 1), (line, 3)], 3, 2, 3));
        assert!(!check(&[(circle, 1), (line, 2)], 4, 2, 3));
        assert!(!check(&[(circle, 1), (line, usize::MAX)], 3, 2, 3));
        assert!(!check(&[(circle, 1), (line, 2)], 3, 3, 3));
        assert!(!check(&[(circle, 1), (line, 2)], 3, 2, 4));
        assert!(!check(&[(circle, 0)], 0, 1, 3));
    }

    #[test]
    fn a_rectangle_turns_from_x_to_y() {
        let Outline::Polygon(corners) = Outline::rectangle([1.0, 2.0], [4.0, 2.0], 0.0) else {
            panic!("a polygon")
        };
        assert_eq!(corners, [[-1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [-1.0, 3.0]]);
        let quarter = std::f64::consts::FRAC_PI_2;
        let Outline::Polygon(turned) = Outline::rectangle([1.0, 2.0], [4.0, 2.0], quarter) else {
            panic!("a polygon")
        };
        let near = |(a, b): (&Place, Place)| (0..2).all(|d| (a[d] - b[d]).abs() < 1e-12);
        let expected = [[2.0, 0.0], [2.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
        assert!(turned.iter().zip(expected).all(near), "{turned:?}");
    }
}
