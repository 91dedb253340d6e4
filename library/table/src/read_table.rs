//! The data set that lies in a file of the project.

use ivx_data::{Dataset, Form};
use ivx_op::{
    Args, Content, Ctx, Facts, Fields, File, Lit, Literal as _, Needs, Op, OpError, Part, Shapes,
    Word, Wrong, declare,
};

use crate::classes::Classes;
use crate::dataset::{Choice, dataset};
use crate::format::{Format, MEND, SMALL, TABLES, separator};
use crate::missing::Missing;

declare! {
    /// The data set that lies in a file of the project: each row an observation, some columns its inputs, and others its
    /// targets.
    ///
    /// The extension of the name says how it is written: `.csv` (RFC 4180, names in the first line), `.tsv`, `.npy`,
    /// `.npz`, `.safetensors`, or `.parquet` where ivx is built with it. Several inputs are a vector. Labels of classes
    /// become their indices: in the order of `classes`, or sorted, by size where all are numbers and by their letters
    /// where not. `docs/data.md` tells all of it.
    pub struct ReadTable = "read_table" @ 2 -> Dataset {
        /// A file beside the spec, in quotes.
        file: File;
        /// The column that is to be foretold.
        target: String = "";
        /// Several such, side by side, in the place of `target`.
        targets: Vec<String> = Vec::<i64>::new();
        /// The columns that are known of each observation; by default all that are no targets.
        inputs: Vec<String> = Vec::<i64>::new();
        /// In the place of `inputs`: columns that are none of them.
        except: Vec<String> = Vec::<i64>::new();
        /// The labels that the target may have, in the order in which they are counted from 0.
        classes: Vec<Word> = Vec::<i64>::new();
        /// Whether the target holds labels, which are counted in sorted order.
        labels: bool = false;
        /// The inputs that hold texts: each becomes as many numbers as it has different texts, in sorted order, of which
        /// one is 1 and the others are 0.
        one_hot: Vec<String> = Vec::<i64>::new();
        /// The texts that such inputs may have, such as `(colour: ["green", "red"])`, so that files of which each has some
        /// of them are read alike; by default those of the file.
        categories: Fields = Part::default();
        /// What becomes of rows in which something is missing.
        missing: Box<dyn Missing> = Part::new("refused");
        /// What stands between cells of text; by default a comma, in `.tsv` a tab.
        separator: String = "";
        /// Whether the first line of text has names; without, columns are called by their places from 0.
        header: bool = true;
    }
    rule is_table;
    shapes observations;
}

impl ReadTable {
    fn read(&self) -> Result<Dataset, String> {
        let Content::File { bytes, .. } = &self.file.0.content else {
            unreachable!("a file has the content of one")
        };
        let name = &self.file.0.name;
        let separator = separator(name, &self.separator)?;
        let data = dataset(name, bytes, (separator, self.header), &self.choice())?;
        if data.is_empty() {
            return Err("it has no rows".to_owned());
        }
        Ok(data)
    }

    fn choice(&self) -> Choice {
        let listed = || self.classes.iter().map(|Word(label)| label.clone()).collect();
        Choice {
            inputs: self.inputs.clone(),
            except: self.except.clone(),
            targets: match &*self.target {
                "" => self.targets.clone(),
                one => vec![one.to_owned()],
            },
            one_hot: self.one_hot.clone(),
            categories: self.categories.0.iter().filter_map(texts).collect(),
            classes: match (self.labels, self.classes.is_empty()) {
                (_, false) => Classes::Listed(listed()),
                (true, true) => Classes::Sorted,
                (false, true) => Classes::None,
            },
            gaps: self.missing.gaps(),
        }
    }

    /// What the checker knows of a call.
    fn of(facts: &Facts<'_>) -> Option<Self> {
        Some(Self {
            file: facts.arg("file")?,
            target: facts.arg("target")?,
            targets: facts.arg("targets")?,
            inputs: facts.arg("inputs")?,
            except: facts.arg("except")?,
            classes: facts.arg("classes")?,
            labels: facts.arg("labels")?,
            one_hot: facts.arg("one_hot")?,
            categories: facts.arg("categories")?,
            missing: facts.arg("missing")?,
            separator: facts.arg("separator")?,
            header: facts.arg("header")?,
        })
    }

    fn len(&self) -> usize {
        match &self.file.0.content {
            Content::File { bytes, .. } => bytes.len(),
            _ => 0,
        }
    }
}

/// What can be told before anything runs: of small files all.
fn is_table(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(read) = ReadTable::of(facts) else { return Ok(()) };
    let wrong = |arg, message: String, help: &str| Err(Wrong { arg, message, help: help.into() });
    let name = &read.file.0.name;
    if Format::of(name).is_none() {
        let message = format!("`{name}` does not say how it is written");
        return wrong("file", message, &format!("the name of a table ends in {TABLES}"));
    }
    if let Err(message) = separator(name, &read.separator) {
        return wrong("separator", message, "write one character, such as `\";\"` or `\"\\t\"`");
    }
    match (&*read.target, &read.targets[..]) {
        ("", []) => {
            let message = format!("what of `{name}` is a target is not said");
            return wrong("target", message, "name a column: `target: \"y\"`");
        }
        ("", _) | (_, []) => {}
        _ => {
            let message = "`target` is one column, and `targets` are several".to_owned();
            return wrong("targets", message, "give one of both");
        }
    }
    twice("targets", &read.targets)?;
    twice("inputs", &read.inputs)?;
    twice("except", &read.except)?;
    twice("one_hot", &read.one_hot)?;
    for (name, said) in &read.categories.0 {
        if !read.one_hot.contains(name) {
            let message = format!("`categories` has `{name}`, which is no input of texts");
            return wrong("categories", message, "name it in `one_hot` too");
        }
        if texts((name, said)).is_none() {
            let message = format!("the texts of `{name}` are a list of texts");
            return wrong(
                "categories",
                message,
                "write `categories: (colour: [\"green\", \"red\"])`",
            );
        }
    }
    if !read.inputs.is_empty() && !read.except.is_empty() {
        let message = "`inputs` are columns, and `except` all others".to_owned();
        return wrong("except", message, "give one of both");
    }
    let classes: Vec<String> = read.classes.iter().map(|Word(label)| label.clone()).collect();
    twice("classes", &classes)?;
    if read.labels && !classes.is_empty() {
        let message = "`labels` counts labels in sorted order, and `classes` in its own".to_owned();
        return wrong("labels", message, "give one of both");
    }
    let choice = read.choice();
    if let Some(both) = choice.inputs.iter().find(|name| choice.targets.contains(name)) {
        let message = format!("`{both}` is an input and a target");
        return wrong("inputs", message, "a target that is known is not foretold");
    }
    if (read.labels || !classes.is_empty()) && choice.targets.len() > 1 {
        let arg = if read.labels { "labels" } else { "classes" };
        let message = "labels of classes are one target, and here are several".to_owned();
        return wrong(arg, message, "name one in `target`");
    }
    if read.len() > SMALL {
        return Ok(());
    }
    read.read()
        .map(drop)
        .or_else(|why| wrong("file", format!("`{name}` is not as expected: {why}"), MEND))
}

/// A name with a list of texts.
fn texts((name, said): (&String, &Lit)) -> Option<(String, Vec<String>)> {
    let Lit::List(items) = said else { return None };
    let text = |item: &Lit| match item {
        Lit::Text(text) => Some(text.clone()),
        _ => None,
    };
    Some((name.clone(), items.iter().map(text).collect::<Option<_>>()?))
}

pub(crate) fn twice(arg: &'static str, names: &[String]) -> Result<(), Wrong> {
    let again = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name));
    match again {
        None => Ok(()),
        Some((_, name)) => {
            let message = format!("`{name}` is named twice in `{arg}`");
            Err(Wrong { arg, message, help: "leave one out".to_owned() })
        }
    }
}

/// The shapes of small files, and of those whose arguments say them.
fn observations(facts: &Facts<'_>) -> Option<Shapes> {
    let read = ReadTable::of(facts)?;
    if read.len() <= SMALL {
        return read.read().ok().map(|data| data.form.shapes());
    }
    if read.inputs.is_empty() || !read.one_hot.is_empty() || read.labels {
        return None;
    }
    let text = matches!(Format::of(&read.file.0.name), Some(Format::Text | Format::Npy));
    let choice = read.choice();
    let side = |n: usize| if n == 1 { Vec::new() } else { vec![n] };
    let classes = (!read.classes.is_empty()).then_some(read.classes.len());
    let (input, target) = (side(choice.inputs.len()), side(choice.targets.len()));
    text.then(|| Form { input, target, classes, ..Form::default() }.shapes())
}

impl Op for ReadTable {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let name = &self.file.0.name;
        self.read().map_err(|why| OpError::Failed(format!("`{name}` is not as expected: {why}")))
    }

    fn needs(args: &Args, _: Option<&Shapes>, _: u64) -> Needs {
        let file = args.get("file").and_then(|file| File::from_lit(file).ok());
        let bytes = file.map_or(0, |File(file)| match file.content {
            Content::File { bytes, .. } => bytes.len() as u64,
            _ => 0,
        });
        // The columns and the rows made of them, eight bytes each where text has two at the least.
        Needs { memory: bytes.saturating_mul(8), ..Needs::default() }
    }
}
