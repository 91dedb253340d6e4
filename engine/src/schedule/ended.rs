//! What workers tell of nodes, and what is read of those that have ended.

use std::collections::BTreeSet;

use ivx_cache::{CacheError, Committed, Fetched, Record};
use petgraph::graph::NodeIndex;

use super::Run;
use crate::event::Event;
use crate::execute::{Done, Message, Problem};
use crate::outcome::Fate;

impl Run<'_> {
    pub(super) fn receive(&mut self, message: Message) -> Result<(), CacheError> {
        match message {
            Message::Done { done, frees } => {
                let mut ready = Vec::new();
                done.into_iter().try_for_each(|done| self.ran(done, &mut ready))?;
                self.resolve(ready);
                if let Some(needs) = frees {
                    self.queue.end(needs);
                }
            }
            Message::Told { node, done, of, words } => {
                self.durations.told(node, done, of);
                let (address, words) = (&self.step(node).address, &words);
                let left_millis = self.durations.left_millis();
                self.listen.event(Event::Told { address, done, of, words, left_millis });
            }
            Message::Heard(news) => self.hear(news),
        }
        Ok(())
    }

    /// Commits what came of a node.
    ///
    /// - `ready`: is given the nodes that are ready by it.
    fn ran(&mut self, done: Done, ready: &mut Vec<NodeIndex>) -> Result<(), CacheError> {
        let Done { node, key, lock, result, busy: _busy } = done;
        match result {
            Ok((output, provenance)) => {
                let millis = provenance.millis;
                let platform = self.bench.platform.to_owned();
                let record = Record { key, platform, output: output.clone(), provenance };
                let committed = self.cache.commit(record);
                drop(lock);
                match committed {
                    Ok(Committed::Against) => (self.misled, self.stopped) = (true, true),
                    Ok(Committed::New | Committed::Known) => {}
                    Err(CacheError::Conflict(conflict)) => {
                        self.fail(node, &conflict.to_string());
                        return Ok(());
                    }
                    Err(error) => return Err(error),
                }
                self.durations.note(node, self.step(node), millis, self.cache.hints());
                ready.extend(self.done(node, output, Fate::Ran { millis }));
                let left_millis = self.durations.left_millis();
                let address = &self.step(node).address;
                self.listen.event(Event::Finished { address, millis, left_millis });
            }
            Err(Problem::Missing(inputs)) => {
                self.lacks(node, inputs);
            }
            // It may have been ended: that is no failure of its own.
            Err(Problem::Stopped) => {}
            Err(Problem::Failed(_)) if self.options.stop.asked() => {}
            Err(Problem::Failed(why)) => self.fail(node, &why),
            Err(Problem::Cache(error)) => return Err(error),
        }
        Ok(())
    }

    /// Reads the results asked for. Returns whether some must run again for it.
    pub(super) fn read(&mut self, wanted: &BTreeSet<NodeIndex>) -> Result<bool, CacheError> {
        let mut again = false;
        let outputs = wanted.iter().filter_map(|node| self.nodes[node.index()].output.as_ref());
        self.objects.bring(outputs)?;
        for &node in wanted {
            if self.options.stop.asked() {
                return Ok(false);
            }
            let Some(output) = &self.nodes[node.index()].output else { continue };
            if self.values.contains_key(&node) || self.lost(node).is_some() {
                continue;
            }
            if let Fetched::Bytes(bytes) = self.objects.read(output)? {
                self.values.insert(node, bytes);
            } else {
                self.force(node, None);
                again = true;
            }
        }
        Ok(again && !self.stopped)
    }
}
