//! Files of numbers, the data sets and arrays made of them, and how data sets are cut and scaled.

mod array;
mod classes;
mod columns;
mod dataset;
mod fill;
mod folds;
mod format;
mod joined;
pub mod json;
mod load_array;
mod missing;
mod npy;
pub mod npz;
mod one_hot;
#[cfg(feature = "parquet")]
mod parquet;
mod read_table;
mod read_tracks;
mod split;
mod standardised;
mod table;
mod take;
pub mod text;
pub mod tracks;

use ivx_op::Registry;

pub use array::{ARRAYS, array};
pub use classes::Classes;
pub use columns::{Inputs, Targets};
pub use dataset::{Choice, dataset};
pub use folds::Folds;
pub use format::{Format, TABLES, separator};
pub use joined::Joined;
pub use load_array::{LoadArray, asked_well};
pub use missing::{Gaps, Missing, Refused};
pub use one_hot::OneHot;
pub use read_table::ReadTable;
pub use read_tracks::ReadTracks;
pub use split::{Split, SplitData};
pub use standardised::Standardised;
pub use table::{Cells, Choose, Column, Style, Table, Values, Want};
pub use take::{Shuffled, Take};

/// Adds what this crate declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    registry
        .parts(missing::missing())
        .op::<ReadTable>()
        .op::<LoadArray>()
        .op::<ReadTracks>()
        .op::<SplitData>()
        .op::<Folds>()
        .op::<Joined>()
        .op::<Take>()
        .op::<Shuffled>()
        .op::<Standardised>()
        .op::<Targets>()
        .op::<Inputs>()
        .op::<OneHot>()
}
