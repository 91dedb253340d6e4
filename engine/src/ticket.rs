//! One step as plain data, for who runs it without the spec.

use std::collections::BTreeMap;
use std::sync::{Arc, mpsc};
use std::thread::sleep;
use std::time::Duration;

use ivx_cache::{Cache, CacheError, Digest, Output, Record};
use ivx_op::{Content, External, Lit, MISSING, Registry};
use petgraph::graph::NodeIndex;
use serde::{Deserialize, Serialize};

use crate::checkpoint::Pace;
use crate::execute::{Bench, Problem, Task, execute};
use crate::key::{key, number_digest};
use crate::options::Options;
use crate::plan::{Source, Step};
use crate::platform::platform;
use crate::pool::pool;

/// How often a step that another process runs is looked at again.
const POLL: Duration = Duration::from_millis(50);

/// A step to run: all that its result depends on, but for the bytes of what it takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ticket {
    /// The digest of the source of the library that is to run it.
    library: String,
    /// The key of its result.
    key: Digest,
    /// The step, whose sources are places among the inputs.
    step: Step,
    /// What it takes; none where that could not be computed.
    inputs: Vec<Option<Taken>>,
    /// How many bytes the files have that its descriptions name.
    files: BTreeMap<Digest, u64>,
}

/// An input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Taken {
    digest: Digest,
    size: u64,
    /// Its bytes in hexadecimal, if they are so few that they are no object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inline: Option<String>,
}

/// What came of a ticket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Came {
    /// Its result is on record.
    Done,
    /// The operation failed.
    Failed(String),
    /// Bytes of this input are nowhere.
    Missing(Digest),
    /// It was told to end.
    Stopped,
}

/// Why a ticket is not run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// It does not read.
    #[error("the ticket is damaged: {0}")]
    Damaged(String),
    /// It is of another version.
    #[error(
        "the ticket is of library {asked}, and this is {own}: install the same ivx on all machines"
    )]
    Library {
        /// What it asks for.
        asked: String,
        /// What is here.
        own: String,
    },
    /// It is not what it is called.
    #[error("the ticket is of another key: {0}")]
    Key(Digest),
    /// Something outside of the spec is not the same here.
    #[error("{0}")]
    Outside(String),
}

impl Ticket {
    /// That of a step; none if it takes what only this machine has, such as the worlds of another program.
    ///
    /// - `output`: what is known of each node that it takes.
    pub(crate) fn new(
        step: &Step,
        key: Digest,
        library: &str,
        output: impl Fn(NodeIndex) -> Option<Output>,
    ) -> Option<(Self, Vec<Arc<External>>)> {
        let mut outside = Vec::new();
        step.args.values().for_each(|arg| externals(arg, &mut outside));
        let mut files = BTreeMap::new();
        for found in &outside {
            match &found.content {
                Content::File { bytes, .. } => {
                    _ = files.insert(Digest(found.digest), bytes.len() as u64);
                }
                Content::Foreign { .. } => return None,
                Content::Program(_) | Content::Variable(_) => {}
            }
        }
        let (mut step, mut places, mut inputs) = (step.clone(), BTreeMap::new(), Vec::new());
        for source in step.sources_mut() {
            if let Source::Node(node) = source {
                let place = *places.entry(*node).or_insert_with(|| {
                    inputs.push(output(*node).as_ref().map(Taken::of));
                    inputs.len() - 1
                });
                *node = NodeIndex::new(place);
            }
        }
        Some((Self { library: library.to_owned(), key, step, inputs, files }, outside))
    }

    /// As it is written.
    ///
    /// # Errors
    /// Never of one that was made of a step.
    pub fn write(&self) -> Result<String, ron::Error> {
        ron::to_string(self)
    }

    /// What was written.
    ///
    /// # Errors
    /// If it is none.
    pub fn read(text: &str) -> Result<Self, Refused> {
        ron::from_str(text).map_err(|error| Refused::Damaged(error.to_string()))
    }

    /// The address of its step, for people.
    #[must_use]
    pub fn address(&self) -> &str {
        &self.step.address
    }

    /// How many bytes the files have that it names, by digest.
    #[must_use]
    pub fn file_sizes(&self) -> &BTreeMap<Digest, u64> {
        &self.files
    }

    /// Runs the step, unless its result is known, and commits that to the cache and what lies behind it.
    ///
    /// - `find`: what something outside of the spec is here, by its name and kind.
    ///
    /// # Errors
    /// If the cache fails; the inner one if the ticket is not run, which is decided before any work.
    ///
    /// # Panics
    /// If not one worker thread can be started.
    pub fn run(
        mut self,
        registry: &Registry,
        cache: &mut Cache,
        options: &Options,
        find: &dyn Fn(&External) -> Result<External, String>,
    ) -> Result<Result<Came, Refused>, CacheError> {
        let outputs = match self.outputs(registry, options, find) {
            Ok(outputs) => outputs,
            Err(refused) => return Ok(Err(refused)),
        };
        let platform = platform();
        cache.fetch(&self.key, &platform);
        let lock = loop {
            let lock = cache.try_lock(&self.key)?;
            if cache.lookup(&self.key).is_some() && cache.share(&self.key)? {
                return Ok(Ok(Came::Done));
            }
            if options.stop.asked() {
                return Ok(Ok(Came::Stopped));
            }
            match lock {
                Some(lock) => break lock,
                None => sleep(POLL),
            }
        };
        let version = registry.decl(&self.step.op).map_or(0, |decl| decl.version);
        let op = format!("{}@{version}", self.step.op);
        let (node, key) = (NodeIndex::new(0), self.key);
        let task = Task { node, step: &self.step, op, key, lock, outputs };
        let bench = Bench {
            registry,
            objects: cache.objects(),
            checkpoints: cache.checkpoints(),
            platform: &platform,
            library: &options.library,
            pace: Pace { every: options.checkpoint, limit: options.limit, stop: &options.stop },
        };
        let (tell, _told) = mpsc::channel();
        let (output, provenance) =
            match pool(options.jobs).install(|| execute(&task, &bench, &tell)) {
                Ok(made) => made,
                Err(Problem::Cache(error)) => return Err(error),
                Err(Problem::Stopped) => return Ok(Ok(Came::Stopped)),
                Err(Problem::Failed(_)) if options.stop.asked() => return Ok(Ok(Came::Stopped)),
                Err(Problem::Failed(why)) => return Ok(Ok(Came::Failed(why))),
                Err(Problem::Missing(nodes)) => {
                    let digest = task.outputs[&nodes[0]].digest;
                    return Ok(Ok(Came::Missing(digest)));
                }
            };
        match cache.commit(Record { key, platform: platform.clone(), output, provenance }) {
            Ok(_) => Ok(Ok(Came::Done)),
            Err(CacheError::Conflict(conflict)) => Ok(Ok(Came::Failed(conflict.to_string()))),
            Err(error) => Err(error),
        }
    }

    /// What the step takes, once the ticket is what it says.
    fn outputs(
        &mut self,
        registry: &Registry,
        options: &Options,
        find: &dyn Fn(&External) -> Result<External, String>,
    ) -> Result<BTreeMap<NodeIndex, Output>, Refused> {
        if self.library != options.library {
            let (asked, own) = (self.library.clone(), options.library.clone());
            return Err(Refused::Library { asked, own });
        }
        if registry.decl(&self.step.op).is_none() {
            return Err(Refused::Damaged(format!("no operation is called `{}`", self.step.op)));
        }
        for arg in self.step.args.values_mut() {
            supply(arg, find)?;
        }
        let mut outputs = BTreeMap::new();
        for (place, taken) in self.inputs.iter().enumerate() {
            if let Some(taken) = taken {
                outputs.insert(NodeIndex::new(place), taken.output()?);
            }
        }
        if self
            .step
            .sources()
            .filter_map(|s| s.node())
            .any(|node| node.index() >= self.inputs.len())
        {
            return Err(Refused::Damaged("it takes what it does not name".to_owned()));
        }
        let digest = |source: &Source| match source {
            Source::Number(x) => number_digest(*x),
            Source::Node(node) => {
                outputs.get(node).map_or_else(|| number_digest(MISSING), |own| own.digest)
            }
        };
        let key = key(&self.step, registry, digest);
        if key == self.key { Ok(outputs) } else { Err(Refused::Key(key)) }
    }
}

impl Taken {
    fn of(output: &Output) -> Self {
        let inline = output.inline.as_ref();
        let inline = inline.map(|bytes| hexadecimal(bytes));
        Self { digest: output.digest, size: output.size, inline }
    }

    fn output(&self) -> Result<Output, Refused> {
        let damaged = || Refused::Damaged(format!("the bytes of {} are others", self.digest));
        let inline = match &self.inline {
            None => None,
            Some(text) => {
                let bytes: Arc<[u8]> = bytes_of(text).ok_or_else(damaged)?.into();
                if Digest::of(&bytes) != self.digest || bytes.len() as u64 != self.size {
                    return Err(damaged());
                }
                Some(bytes)
            }
        };
        Ok(Output { digest: self.digest, size: self.size, inline })
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digit = |nibble: u8| char::from(b"0123456789abcdef"[usize::from(nibble)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}

fn bytes_of(text: &str) -> Option<Vec<u8>> {
    let (pairs, []) = text.as_bytes().as_chunks::<2>() else { return None };
    let digit = |byte: u8| char::from(byte).to_digit(16).and_then(|n| u8::try_from(n).ok());
    pairs.iter().map(|[high, low]| Some(digit(*high)? << 4 | digit(*low)?)).collect()
}

/// What a description names outside of the spec.
fn externals(lit: &Lit, found: &mut Vec<Arc<External>>) {
    match lit {
        Lit::External(own) => found.push(Arc::clone(own)),
        Lit::List(items) => items.iter().for_each(|item| externals(item, found)),
        Lit::Part(part) => part.args.values().for_each(|arg| externals(arg, found)),
        _ => {}
    }
}

/// Puts what is outside in its place.
fn supply(
    lit: &mut Lit,
    find: &dyn Fn(&External) -> Result<External, String>,
) -> Result<(), Refused> {
    match lit {
        Lit::External(own) => {
            let found = find(own);
            let found = found.map_err(|why| Refused::Outside(format!("`{}` {why}", own.name)))?;
            if found.digest != own.digest || found.kind() != own.kind() {
                let why = format!("`{}` is not the same on this machine", own.name);
                return Err(Refused::Outside(why));
            }
            *own = Arc::new(found);
            Ok(())
        }
        Lit::List(items) => items.iter_mut().try_for_each(|item| supply(item, find)),
        Lit::Part(part) => part.args.values_mut().try_for_each(|arg| supply(arg, find)),
        _ => Ok(()),
    }
}
