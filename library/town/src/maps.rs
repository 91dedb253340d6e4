//! The maps that come with the crate.

use std::io::Read;

use flate2::read::GzDecoder;

use crate::map::Map;
use crate::xodr::{MapError, read_map};

/// Names of the towns, and their `OpenDRIVE` files, packed by gzip. `maps/README.md` says where they are from.
const TOWNS: [(&str, &[u8]); 5] = [
    ("Town01", include_bytes!("../maps/Town01.xodr.gz")),
    ("Town02", include_bytes!("../maps/Town02.xodr.gz")),
    ("Town03", include_bytes!("../maps/Town03.xodr.gz")),
    ("Town04", include_bytes!("../maps/Town04.xodr.gz")),
    ("Town05", include_bytes!("../maps/Town05.xodr.gz")),
];

/// Names of the towns whose maps come with the crate.
#[must_use]
pub fn town_names() -> Vec<&'static str> {
    TOWNS.iter().map(|(name, _)| *name).collect()
}

/// The map of a town that comes with the crate; `None` if there is no such town.
///
/// # Panics
/// Never: the files are part of the program, and a test reads all of them.
#[must_use]
pub fn town_map(name: &str) -> Option<Map> {
    let (_, packed) = TOWNS.iter().find(|(town, _)| *town == name)?;
    let mut text = String::new();
    GzDecoder::new(*packed).read_to_string(&mut text).expect("maps are packed by gzip");
    let map: Result<Map, MapError> = read_map(&text);
    Some(map.expect("the maps of the crate can be read"))
}
