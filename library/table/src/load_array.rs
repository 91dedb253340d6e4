//! The numbers that lie in a file of the project.

use ivx_op::{Array, Content, Ctx, DimNames, Facts, Fields, File, Op, OpError, Wrong, declare};

use crate::array::{ARRAYS, array, is_read, labels};
use crate::format::{MEND, SMALL, separator};

declare! {
    /// The numbers of a file of the project, over dimensions that are named here: as `read_array` reads those that a
    /// program wrote.
    pub struct LoadArray = "load_array" @ 1 -> Array [named dims] {
        /// A file beside the spec, in quotes.
        file: File;
        /// The names of the dimensions, outermost first.
        dims: DimNames;
        /// Which numbers: a place in JSON such as `test.curve`, a column of a table or an array of an archive; by default
        /// all, or the only one.
        field: String = "";
        /// The labels of dimensions, such as `(epoch: [1, 5, 10])`; by default those that the file has, or 0, 1 and so on.
        labels: Fields = ivx_op::Part::default();
        /// What stands between cells of text; by default a comma, in `.tsv` a tab.
        separator: String = "";
        /// Whether the first line of text has names; without, rows and columns are labelled by their places from 0.
        header: bool = true;
    }
    rule is_array;
}

impl Op for LoadArray {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        self.read().map_err(OpError::Failed)
    }
}

impl LoadArray {
    fn bytes(&self) -> &[u8] {
        match &self.file.0.content {
            Content::File { bytes, .. } => bytes,
            _ => unreachable!("a file has the content of one"),
        }
    }

    fn read(&self) -> Result<Array, String> {
        let (name, DimNames(dims)) = (&self.file.0.name, &self.dims);
        let read = |separator| {
            let text = (separator, self.header);
            array(name, self.bytes(), text, &self.field, dims, &self.labels.0)
        };
        separator(name, &self.separator)
            .and_then(read)
            .map_err(|why| format!("`{name}` is not as expected: {why}"))
    }

    /// What the checker knows of a call.
    fn of(facts: &Facts<'_>) -> Option<Self> {
        Some(Self {
            file: facts.arg("file")?,
            dims: DimNames(facts.arg("dims")?),
            field: facts.arg("field")?,
            labels: facts.arg("labels")?,
            separator: facts.arg("separator")?,
            header: facts.arg("header")?,
        })
    }
}

/// What can be told before anything runs: of small files all.
fn is_array(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(load) = LoadArray::of(facts) else { return Ok(()) };
    asked_well(facts, "file", &load.file.0.name)?;
    if load.bytes().len() > SMALL {
        return Ok(());
    }
    let wrong = |message| Wrong { arg: "file", message, help: MEND.to_owned() };
    load.read().map(drop).map_err(wrong)
}

/// Whether what is asked of a file of this name can be asked.
///
/// - `arg`: the argument that names it.
///
/// # Errors
/// What cannot.
pub fn asked_well(facts: &Facts<'_>, arg: &'static str, name: &str) -> Result<(), Wrong> {
    if !is_read(name) {
        let message = format!("`{name}` does not say how it is written");
        return Err(Wrong { arg, message, help: format!("the name of an array ends in {ARRAYS}") });
    }
    if let Some(Err(message)) = facts.arg::<String>("separator").map(|own| separator(name, &own)) {
        let help = "write one character, such as `\";\"` or `\"\\t\"`".to_owned();
        return Err(Wrong { arg: "separator", message, help });
    }
    let dims = facts.arg::<Vec<String>>("dims").unwrap_or_default();
    for (name, given) in &facts.arg::<Fields>("labels").unwrap_or_default().0 {
        let fault =
            |message, help: &str| Err(Wrong { arg: "labels", message, help: help.to_owned() });
        if !dims.contains(name) {
            let message = format!("`labels` has `{name}`, which is none of `dims`");
            return fault(message, "a dimension has a name in `dims` first");
        }
        if labels(given).is_none() {
            let message = format!("the labels of `{name}` are a list of numbers or of texts");
            return fault(message, "write `labels: (epoch: [1, 5, 10])`");
        }
    }
    Ok(())
}
