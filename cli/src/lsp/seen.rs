//! What is known of a spec as it stands in the editor.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use gen_lsp_types as lsp;
use ivx_grammar::ast::{Ast, Item, ItemKind};
use ivx_grammar::check::{Look, Settings, Value, look, runs};
use ivx_grammar::{Diagnostic, Means, Mention, Severity, Span, mentions};
use ivx_op::Registry;

use super::text::Text;
use super::uri;
use crate::Trouble;
use crate::load::{Loaded, Open, Parsed, load_open};

/// How the editor calls files, by the path with its links resolved.
pub(super) type Called = BTreeMap<PathBuf, lsp::Uri>;

/// A spec, checked.
pub(super) struct Seen {
    registry: Rc<Registry>,
    pub(super) loaded: Loaded,
    pub(super) look: Arc<Look>,
    /// What is named, once somebody asks.
    mentions: OnceCell<Vec<Mention>>,
    /// What is wrong with its texts and with what they say.
    pub(super) faults: Vec<Diagnostic>,
    /// Where its files lie, the spec first.
    pub(super) paths: Vec<PathBuf>,
    /// How the editor calls them.
    pub(super) uris: Vec<lsp::Uri>,
    /// Their texts.
    pub(super) texts: Vec<Text>,
}

/// Reads and checks a spec.
///
/// - `open`: what the editor has of files, and how it calls them.
pub(super) fn see(
    path: &Path,
    (open, called): (&Open<'_>, &Called),
    registry: &Rc<Registry>,
) -> Result<Seen, Trouble> {
    let loaded = load_open(path, registry, open)?;
    let look = Arc::new(look(&loaded.project, registry, &Settings::default()));
    // Of text that does not read, warnings would be noise.
    let whole = runs(&loaded.diagnostics);
    let found = look.diagnostics.iter();
    let found = found.filter(|fault| whole || fault.code.severity() == Severity::Error);
    let faults = loaded.diagnostics.iter().chain(found).cloned().collect();
    let files = &loaded.project.files;
    let paths: Vec<_> = files.iter().map(|file| loaded.root.join(&file.path)).collect();
    let uris = paths.iter().map(|path| called_as(path, called)).collect();
    let texts = files.iter().map(|file| Text::new(file.text.clone())).collect();
    let registry = Rc::clone(registry);
    Ok(Seen { registry, loaded, look, mentions: OnceCell::new(), faults, paths, uris, texts })
}

/// How the editor calls a file: as it did first, where it did.
pub(super) fn called_as(path: &Path, called: &Called) -> lsp::Uri {
    called.get(path).cloned().unwrap_or_else(|| uri(path))
}

impl Seen {
    /// What the spec's own text says.
    pub(super) fn text(&self) -> &Text {
        &self.texts[0]
    }

    pub(super) fn ast(&self) -> &Ast {
        &self.loaded.project.files[0].ast
    }

    /// What is named, in order of place.
    pub(super) fn mentions(&self) -> &[Mention] {
        self.mentions.get_or_init(|| mentions(&self.loaded.project, &self.registry))
    }

    /// Keeps its files that read without a fault, for what they will be after an edit.
    pub(super) fn keep(&self, parsed: &mut Parsed) {
        for (i, (path, file)) in self.paths.iter().zip(&self.loaded.project.files).enumerate() {
            let of =
                |fault: &Diagnostic| fault.labels.iter().any(|own| own.span.file as usize == i);
            if !self.loaded.diagnostics.iter().any(of) {
                parsed.insert(path.clone(), (file.text.clone(), Arc::clone(&file.ast)));
            }
        }
    }

    /// Whether it can run.
    pub(super) fn runs(&self) -> bool {
        runs(&self.faults)
    }

    /// What is named in the spec's own text at a byte, or just before it.
    pub(super) fn mention(&self, at: usize) -> Option<&Mention> {
        let own = self.mentions().iter().filter(|mention| mention.span.file == 0);
        let mut there = own.filter(|mention| holds(mention.span, at));
        there.next_back()
    }

    /// What the name that is declared at a place stands for.
    pub(super) fn value(&self, declared: Span) -> Option<&Value> {
        self.look.values.get(&declared)
    }

    /// The item that declares the name at a place, and the name of the experiment around it.
    pub(super) fn item(&self, declared: Span) -> Option<(&Item, Option<&str>)> {
        let file = self.loaded.project.files.get(declared.file as usize)?;
        let holds =
            |item: &&Item| item.span.start <= declared.start && declared.end <= item.span.end;
        let item = file.ast.items.iter().find(holds)?;
        match &item.kind {
            ItemKind::Experiment { name, items } if name.span != declared => {
                Some((items.iter().find(holds)?, Some(&name.value)))
            }
            _ => Some((item, None)),
        }
    }

    /// Where a label of an axis is declared, if it is written.
    pub(super) fn label(&self, axis: Span, label: &str) -> Option<Span> {
        let mut own = self
            .mentions()
            .iter()
            .filter(|mention| mention.span.file == axis.file && mention.span.start > axis.start);
        let same = |mention: &&Mention| matches!(&mention.means, Means::Label(of, text) if *of == axis && text == label);
        own.find(same).map(|mention| mention.span)
    }
}

/// Whether a byte lies in a stretch or just behind it.
pub(super) fn holds(span: Span, at: usize) -> bool {
    span.start as usize <= at && at <= span.end as usize
}
