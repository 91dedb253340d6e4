//! Driving among others: the highway and the roundabout of highway-env (Leurent, 2018, "An Environment for Autonomous
//! Driving Decision-Making"), and what chapter 4 of the thesis makes of them (§B.1.1, §B.1.2).
//!
//! Two releases are replayed, that of 2021 and 1.12.1: with the cars of a recorded episode each frame is that of the
//! original.

mod choices;
mod collision;
mod drawn;
mod driver;
mod driving_actions;
mod episode;
mod lane;
mod network;
mod on_highway;
mod on_roundabout;
mod release;
#[cfg(test)]
mod replay;
mod roads;
mod seen;
mod steering;
mod traffic;
mod vehicle;

pub use driving_actions::DrivingActions;
pub use on_highway::Highway;
pub use on_roundabout::Roundabout;
