//! How each element of a source stands: where a project has it, and what came out there.
//!
//! A list, which people write, says what the source has and where it is. Everything else is read from specs and from
//! what their runs registered, so that the page can be made anew wherever these are.

mod element;
mod judged;
mod list;
mod look;
mod tally;
mod write;

use std::collections::{BTreeMap, BTreeSet};

use ivx_grammar::ir::Spec;
pub use list::{Element, List, Place, Section};

use crate::registration::Registration;

/// A spec that a list names.
#[derive(Clone, Debug, Default)]
pub struct Named {
    /// Where it lies, seen from where the page lies.
    pub link: String,
    /// The spec as it is under each profile of the list.
    pub specs: BTreeMap<String, Spec>,
    /// The profiles of the list that it declares. Under others every parameter has its default.
    pub declared: BTreeSet<String>,
    /// What its runs registered, and those of specs that include it: the nearest first.
    pub runs: Vec<Run>,
}

/// What a run registered.
#[derive(Clone, Debug)]
pub struct Run {
    /// What it is called, and where it is registered, for messages.
    pub name: String,
    /// The profile in force.
    pub profile: Option<String>,
    /// What it claims, and what came out.
    pub registered: Registration,
}

/// A file of published numbers that a list names.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// Where it lies, seen from where the page lies.
    pub link: String,
    /// Where they are published.
    pub source: String,
}

/// What a list is about: each file by the name that the list gives it.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// The specs.
    pub specs: BTreeMap<String, Named>,
    /// The published numbers.
    pub published: BTreeMap<String, Numbers>,
    /// The files that try something, and where they lie, seen from where the page lies.
    pub tested: BTreeMap<String, String>,
}

/// What is wrong with a list, and what helps.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrong {
    /// What is wrong.
    pub message: String,
    /// What to do; empty where that is plain.
    pub help: String,
}

/// The page on which every element of a list stands, as Markdown.
///
/// # Errors
/// If the list names what is not there, hides a claim, or a run registered something else than a spec says.
pub fn standing(list: &List, files: &Files) -> Result<String, Vec<Wrong>> {
    let looked = look::look(list, files)?;
    Ok(write::page(list, files, &looked))
}
