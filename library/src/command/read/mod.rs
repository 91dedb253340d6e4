//! What programs wrote, as artifacts. Each reads one file, so that what depends on it does not run
//! again when only another has changed.

mod array;
mod dataset;
mod file;
mod model;
mod scalar;

use ivx_data::{Blob, Outputs};
use ivx_op::{Facts, OpError, Wrong};

pub use array::ReadArray;
pub use dataset::ReadDataset;
pub use file::ReadFile;
pub use model::ReadModel;
pub use scalar::ReadScalar;

/// One output.
fn output<'a>(outputs: &'a Outputs, name: &str) -> Result<&'a Blob, OpError> {
    let found = outputs.files.get(name);
    found.ok_or_else(|| OpError::Failed(no_output(name, outputs.files.keys())))
}

fn no_output<'a>(name: &str, names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    match &names[..] {
        [] => format!("there is no output `{name}`, nor any other"),
        [one] => format!("there is no output `{name}`; there is {one}"),
        all => format!("there is no output `{name}`; there are {}", all.join(", ")),
    }
}

/// What is read is among the outputs, where these are known.
fn is_left_behind(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(known), Some(name)) = (facts.shapes("outputs"), facts.arg::<String>("name")) else {
        return Ok(());
    };
    if known.contains_key(&name) {
        return Ok(());
    }
    let message = no_output(&name, known.keys());
    let help = format!("name it in the `outputs` of the command: `outputs: [{name:?}]`");
    Err(Wrong { arg: "name", message, help })
}

/// A failure that names the file and what is wrong with it.
fn wrong(name: &str, why: &str) -> OpError {
    OpError::Failed(format!("`{name}` is not as expected: {why}"))
}
