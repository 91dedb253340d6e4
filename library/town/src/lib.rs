//! Towns to drive in: their roads, what drives on them, and what a car sees of them.

mod autopilot;
mod body;
mod bounds;
mod car;
mod centre;
mod change;
mod command;
mod drive;
mod edges;
mod geometry;
mod grid;
mod ground;
mod kerbs;
mod lanes;
mod lidar;
mod map;
mod maps;
mod marks;
mod pid;
mod project;
mod relief;
mod route;
mod space;
mod streets;
mod tasks;
mod town;
mod traffic;
mod way;
mod xodr;

pub use autopilot::autopilot;
pub use body::{BREADTH, Body, LENGTH};
pub use car::{Ego, driven, pedals, pursuit};
pub use centre::{Point, centre, pose_along};
pub use command::{Command, command};
pub use drive::{ARRIVED, Drive, Happened, N_GOALS, drive};
pub use edges::edges;
pub use geometry::{Pose, is_paved, wrapped};
pub use ground::{Footing, Ground, ground};
pub use kerbs::{Kerb, kerbs};
pub use lanes::{At, Lane, Network, network};
pub use lidar::{Lidar, MOST_POINTS, SIDE, picture, scan};
pub use map::{
    Connection, Cubic, End, Junction, Kind, Line, Link, Map, Mark, Piece, Road, Section, Strip,
};
pub use maps::{town_map, town_names};
pub use marks::crossed;
pub use pid::{Controls, Follower, Pid};
pub use project::{Nearest, nearest};
pub use relief::{Relief, relief};
pub use route::{ROUTE_STEP, RouteError, Waypoint, route, route_length};
pub use space::{Cell, Space, space};
pub use streets::{N_STREETS, streets};
pub use tasks::{Task, tasks};
pub use town::{Town, town};
pub use traffic::{Car, DT, Traffic, traffic};
pub use xodr::{MapError, read_map};
