//! Towns to drive in: their roads, what drives on them, and what a car sees of them.

mod centre;
mod geometry;
mod grid;
mod ground;
mod lanes;
mod maps;
mod project;
mod relief;
mod route;
mod tasks;
mod town;
mod xodr;

pub use centre::{Point, centre, pose_along};
pub use geometry::{Pose, is_paved, wrapped};
pub use ground::{Footing, Ground, ground};
pub use lanes::{At, Lane, Network, network};
pub use maps::{town_map, town_names};
pub use project::{Nearest, nearest};
pub use relief::{Relief, relief};
pub use route::{ROUTE_STEP, RouteError, Waypoint, route, route_length};
pub use tasks::{Task, tasks};
pub use town::{Town, town};
pub use xodr::{
    Connection, Cubic, End, Junction, Kind, Line, Link, Map, MapError, Mark, Piece, Road, Section,
    Strip, read_map,
};
