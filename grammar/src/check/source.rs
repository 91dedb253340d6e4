//! What a spec is written in: its files, their texts, and the numbers beside them.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Published, read_published};

use super::faults::Faults;
use super::scope::Scopes;
use super::{File, Project};
use crate::ast::ItemKind;
use crate::{Code, Diagnostic, Span, Spanned};

/// The files of a spec, and the published numbers that they name.
pub(super) struct Source<'a> {
    files: &'a [File],
    /// By the file that names them and the path as written.
    published: BTreeMap<(usize, String), Published>,
}

impl<'a> Source<'a> {
    /// Reads every file of published numbers, and reports those that do not read as such.
    pub(super) fn read(project: &'a Project, scopes: &Scopes<'a>, faults: &mut Faults) -> Self {
        let mut source = Self { files: &project.files, published: BTreeMap::new() };
        let mut seen = BTreeSet::new();
        for (i, scope) in scopes.all.iter().enumerate() {
            for item in scope.items {
                let ItemKind::Published { path, .. } = &item.kind else { continue };
                let id = (scopes.file_of(i), path.value.clone());
                let text = source.files[id.0].texts.get(&path.value);
                let Some(text) = text.filter(|_| seen.insert(id.clone())) else { continue };
                match read_published(text) {
                    Ok(published) => {
                        source.published.insert(id, published);
                    }
                    Err(why) => faults.add(unreadable(path, &why)),
                }
            }
        }
        source
    }

    /// The files, the root first.
    pub(super) fn files(&self) -> &'a [File] {
        self.files
    }

    /// The file that a stretch lies in.
    pub(super) fn file(&self, span: Span) -> &'a File {
        &self.files[span.file as usize]
    }

    /// What a stretch says; nothing if it is of another text.
    pub(super) fn text(&self, span: Span) -> Option<&'a str> {
        self.file(span).text.get(span.start as usize..span.end as usize)
    }

    /// The numbers that a file names by a path; `None` where they cannot be read.
    pub(super) fn published(&self, file: usize, path: &str) -> Option<&Published> {
        self.published.get(&(file, path.to_owned()))
    }
}

fn unreadable(path: &Spanned<String>, why: &str) -> Diagnostic {
    let message = format!("`{}` does not read as published numbers: {why}", path.value);
    let fault = Diagnostic::new(Code::Published, path.span, message, "not understood");
    fault.help("`ivx explain IVX0408` shows what such a file holds")
}
