//! Checked program to results.
//!
//! `expand` makes the graph, `schedule` runs what is not known, `report` says what came out.
//! The engine knows the registry that it is given and no operation of its own.

pub mod address;
mod checkpoint;
mod crew;
mod diff;
mod difference;
mod durations;
mod event;
mod execute;
mod expand;
mod explanation;
mod family;
mod foresee;
mod judged;
mod key;
mod lock;
mod markdown;
mod moved;
mod options;
mod outcome;
mod page;
mod plan;
mod platform;
mod pool;
mod queue;
mod registration;
mod results;
mod schedule;
mod shift;
mod standing;
mod stop;
mod ticket;
mod tidy;
mod told;
mod verify;
mod why;

pub use crew::{Crew, News, Room, Word};
pub use diff::{Change, Flip, diff};
pub use difference::{Difference, Part};
pub use event::{Event, Listen, Silence};
pub use expand::expand;
pub use foresee::{Foreseen, consult, foresee, gone, outputs, record_of, recorded};
pub use judged::judged;
pub use key::{explain, key, number_digest};
pub use lock::{Lock, Locks};
pub use markdown::code;
pub use moved::{Beyond, Interval, Largest, Move, Outside};
pub use options::Options;
pub use outcome::{Fate, Node, Outcome};
pub use page::{Origin, page};
pub use petgraph::graph::NodeIndex;
pub use plan::{Draw, Family, Fed, Plan, Source, Step};
pub use platform::platform;
pub use registration::{Registered, Registration};
pub use results::{
    Claim, Corrected, ExperimentResults, Measure, Report, Results, Setting, marks, report,
    settings, wanted,
};
pub use schedule::{schedule, schedule_on};
pub use shift::{Ended, Made, Moved, Root, Shift, shifts};
pub use standing::{Element, Files, List, Named, Numbers, Place, Run, Section, Wrong, standing};
pub use stop::Stop;
pub use ticket::{Came, Refused, Ticket};
pub use tidy::{Coordinate, Row, Tidy, tidy};
pub use told::{notes, reason, verdict};
pub use verify::{Verified, verify};
pub use why::{Cause, Changed, Earlier, InputChange, Reason, Why, why};
