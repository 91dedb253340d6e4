//! What programs wrote, as artifacts. Each reads one file, so that what depends on it does not run
//! again when only another has changed.

mod dataset;
mod file;
mod model;
mod scalar;

use std::collections::BTreeMap;

use ivx_op::OpError;

use crate::artifact::Outputs;

pub use dataset::ReadDataset;
pub use file::ReadFile;
pub use model::ReadModel;
pub use scalar::ReadScalar;

/// Arrays by name: their shapes and numbers, last dimension fastest.
pub(super) type Columns = BTreeMap<String, (Vec<usize>, Vec<f64>)>;

/// The bytes of one output.
fn output<'a>(outputs: &'a Outputs, name: &str) -> Result<&'a [u8], OpError> {
    outputs.files.get(name).map(Vec::as_slice).ok_or_else(|| {
        let names: Vec<String> = outputs.files.keys().map(|name| format!("`{name}`")).collect();
        OpError::Failed(format!("there is no output `{name}`; there is {}", names.join(", ")))
    })
}

/// A failure that names the file and what is wrong with it.
fn wrong(name: &str, why: &str) -> OpError {
    OpError::Failed(format!("`{name}` is not as expected: {why}"))
}
