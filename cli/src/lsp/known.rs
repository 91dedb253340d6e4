//! What a run of a spec would do, and what the last one found out: asked beside the editor's work.

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, unbounded};
use ivx_cache::Cache;
use ivx_engine::address::{parts, stem};
use ivx_engine::{Foreseen, Results, expand, foresee, platform};
use ivx_grammar::check::Look;
use ivx_library::registry;

use super::seen::Seen;
use crate::{place, project};

/// What is known of a spec beside its text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Known {
    /// The nodes of each name, as addresses begin, and how many of them a run would take from the cache.
    pub(super) nodes: BTreeMap<String, Nodes>,
    /// What its last run found out.
    pub(super) results: Option<Results>,
    /// Its report, if there is one.
    pub(super) report: Option<PathBuf>,
}

/// How many nodes there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Nodes {
    pub(super) all: usize,
    pub(super) known: usize,
}

/// A question: what is known of a spec, at the version of its text.
pub(super) struct Question {
    path: PathBuf,
    root: PathBuf,
    /// The name of its run.
    name: String,
    look: Arc<Look>,
}

impl Question {
    /// What to ask of a spec that can run.
    pub(super) fn of(path: PathBuf, seen: &Seen) -> Self {
        let loaded = &seen.loaded;
        let below = loaded.spec.strip_prefix(&loaded.root).unwrap_or(&loaded.spec);
        let (root, look) = (loaded.root.clone(), Arc::clone(&seen.look));
        Self { path, root, name: place::name(below, ""), look }
    }
}

/// How long nothing is asked before anything is answered.
const QUIET: Duration = Duration::from_millis(200);

/// Answers questions on a thread of its own, of each spec the last one.
pub(super) fn answers() -> (Sender<Question>, Receiver<(PathBuf, Known)>) {
    let (ask, asked) = unbounded::<Question>();
    let (tell, told) = unbounded();
    thread::spawn(move || {
        while let Ok(first) = asked.recv() {
            let mut last = BTreeMap::from([(first.path.clone(), first)]);
            // Who types is not slowed down by what is asked beside.
            while let Ok(next) = asked.recv_timeout(QUIET) {
                last.insert(next.path.clone(), next);
            }
            for (path, question) in last {
                // Nothing that goes wrong here is worth the editor's faults: then nothing is known.
                let known = catch_unwind(AssertUnwindSafe(|| known(&question)));
                if tell.send((path, known.unwrap_or_default())).is_err() {
                    return;
                }
            }
        }
    });
    (ask, told)
}

fn known(question: &Question) -> Known {
    let folder = project::results(&question.root).join(&question.name);
    let text = fs::read_to_string(folder.join("results.ron")).ok();
    let report = folder.join("report.html");
    Known {
        nodes: nodes(question),
        results: text.and_then(|text| ron::from_str(&text).ok()),
        report: report.is_file().then_some(report),
    }
}

/// The nodes of each name. Of a cache that cannot be read nothing is known.
fn nodes(question: &Question) -> BTreeMap<String, Nodes> {
    let registry = registry();
    let plan = expand(&question.look.spec, &registry);
    let cache = Cache::look(&project::cache(&question.root), &platform());
    let foreseen = cache.map(|cache| foresee(&plan, &registry, &cache)).unwrap_or_default();
    let mut nodes: BTreeMap<String, Nodes> = BTreeMap::new();
    let mut add = |address: &str, node: usize| {
        let parts = parts(address);
        let own = parts.iter().take(2).map(|part| stem(part)).collect::<Vec<_>>().join("/");
        let count = nodes.entry(own).or_default();
        count.all += 1;
        count.known += usize::from(foreseen.get(node) == Some(&Foreseen::Hit));
    };
    for node in plan.graph.node_indices() {
        add(&plan.graph[node].address, node.index());
    }
    for (address, node) in &plan.aliases {
        add(address, node.index());
    }
    nodes
}

#[cfg(test)]
mod tests {
    use ivx_grammar::check::{Settings, look};

    use super::super::tests::SPEC;
    use super::*;
    use crate::load::load;

    #[test]
    fn what_goes_wrong_with_one_question_is_no_end_of_answers() {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let spec = folder.path().join("x.ivx");
        fs::write(&spec, SPEC).expect("files can be written");
        let registry = registry();
        let project = load(&spec, &registry).expect("it can be read").project;
        let (ask, told) = answers();
        let asked = |name: &str, is_broken: bool| {
            let mut look = look(&project, &registry, &Settings::default());
            if is_broken {
                look.spec.axes.clear();
            }
            let (root, path) = (folder.path().to_owned(), PathBuf::from(name));
            ask.send(Question { path, root, name: name.to_owned(), look: look.into() })
                .expect("somebody listens");
            told.recv().expect("it is answered").1.nodes.len()
        };
        assert_eq!(asked("broken", true), 0);
        assert_ne!(asked("whole", false), 0);
    }
}
