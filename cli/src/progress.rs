//! What a person sees while a spec runs: a bar on a terminal, plain lines elsewhere.

use std::collections::BTreeMap;
use std::io::{IsTerminal as _, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ivx_engine::{Event, Listen};

use crate::render::visible;

/// So many different failures are told in full, the others by their last line.
const WHOLE: usize = 3;

/// How often a plain line is written.
const LINE: Duration = Duration::from_secs(5);

/// Follows a run.
pub(crate) struct Progress<'a> {
    err: &'a mut dyn Write,
    bar: Option<ProgressBar>,
    jobs: u64,
    started: Instant,
    last_line: Instant,
    nodes: u64,
    done: u64,
    hits: u64,
    /// What was told of nodes that failed: the first of each kind, and how many more there were.
    failed: BTreeMap<String, (String, usize)>,
}

impl<'a> Progress<'a> {
    /// Follows a run with so many jobs.
    pub(crate) fn new(err: &'a mut dyn Write, jobs: usize) -> Self {
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        let bar =
            terminal.then(|| ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()));
        let jobs = jobs.max(1) as u64;
        let failed = BTreeMap::new();
        Self { err, bar, jobs, started: now, last_line: now, nodes: 0, done: 0, hits: 0, failed }
    }

    /// Ends the following.
    pub(crate) fn finish(mut self) {
        for (first, n_more) in std::mem::take(&mut self.failed).into_values() {
            let nodes = if n_more == 1 { "node" } else { "nodes" };
            if n_more > 0 {
                self.say(&format!("failed: {n_more} more {nodes} like {first}"));
            }
        }
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }

    fn say(&mut self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprint_line(line)),
            // A closed pipe must not end the run.
            None => drop(writeln!(self.err, "{line}")),
        }
    }

    /// Tells how far the run is, and of what it was told last.
    fn goes_on(&mut self, what: &str, left_millis: Option<u64>) {
        let left = self.left(left_millis);
        if let Some(bar) = &self.bar {
            bar.set_prefix(left);
        } else if self.last_line.elapsed() >= LINE {
            self.last_line = Instant::now();
            let elapsed = spell(self.started.elapsed());
            let (done, nodes) = (self.done, self.nodes);
            self.say(&format!("[{done}/{nodes}] {elapsed}{left}: {what}"));
        }
    }

    fn left(&self, left_millis: Option<u64>) -> String {
        let left = left_millis.map(|millis| millis / self.jobs);
        left.map_or(String::new(), |millis| {
            format!(", about {} left", spell(Duration::from_millis(millis)))
        })
    }
}

impl Listen for Progress<'_> {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Planned { nodes } => {
                (self.nodes, self.done, self.hits) = (nodes as u64, 0, 0);
                if let Some(bar) = &self.bar {
                    bar.set_length(self.nodes);
                    bar.set_style(style());
                }
            }
            Event::Hit { .. } => {
                self.hits += 1;
                self.done += 1;
                if let Some(bar) = &self.bar {
                    bar.set_position(self.done);
                }
            }
            Event::Started { address, .. } => {
                if let Some(bar) = &self.bar {
                    bar.enable_steady_tick(Duration::from_millis(200));
                    bar.set_message(visible(address));
                }
            }
            Event::Told { address, done, of, words, left_millis } => {
                let words = under_way(address, (done, of), words);
                if let Some(bar) = &self.bar {
                    bar.set_message(words.clone());
                }
                self.goes_on(&words, left_millis);
            }
            Event::Finished { address, left_millis, .. } => {
                self.done += 1;
                if let Some(bar) = &self.bar {
                    bar.set_position(self.done);
                }
                self.goes_on(&visible(address), left_millis);
            }
            Event::Failed { address, why } => {
                self.done += 1;
                if let Some((_, n_more)) = self.failed.get_mut(why) {
                    *n_more += 1;
                } else {
                    let address = visible(address);
                    let told = if self.failed.len() < WHOLE { why.to_owned() } else { short(why) };
                    self.say(&format!("failed: {address}: {told}"));
                    self.failed.insert(why.to_owned(), (address, 0));
                }
            }
            Event::Skipped { .. } => self.done += 1,
            Event::Room { threads } => self.jobs = threads.max(1) as u64,
            Event::Noted { what } => self.say(&format!("note: {what}")),
        }
    }
}

/// How far a node is: `e/model[seed=0], 1200 of 3000, loss 0.31`.
fn under_way(address: &str, (done, of): (u64, u64), words: &str) -> String {
    let words = if words.is_empty() { String::new() } else { format!(", {words}") };
    visible(&format!("{address}, {done} of {of}{words}"))
}

/// The first and the last line of what is wrong: a traceback ends with what it is about.
fn short(why: &str) -> String {
    match (why.split_once('\n'), why.rsplit_once('\n')) {
        (Some((first, _)), Some((_, last))) => format!("{first} {}", last.trim()),
        _ => why.to_owned(),
    }
}

#[expect(
    clippy::print_stderr,
    reason = "the bar is drawn there, and has stepped aside for the line"
)]
fn eprint_line(line: &str) {
    eprintln!("{line}");
}

fn style() -> ProgressStyle {
    let style =
        ProgressStyle::with_template("{bar:24} {pos}/{len} {elapsed}{prefix} {wide_msg:.dim}");
    style.expect("the template is well-formed")
}

/// A duration as people say it: `0.21 s`, `1 min 30 s`, `2 h 5 min`.
pub(crate) fn spell(duration: Duration) -> String {
    let seconds = duration.as_secs();
    match seconds {
        0..10 => format!("{:.2} s", duration.as_secs_f64()),
        10..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_spelt_as_people_say_them() {
        let spelt = [0.214, 42.9, 95.0, 7_500.0].map(|s| spell(Duration::from_secs_f64(s)));
        assert_eq!(spelt, ["0.21 s", "42 s", "1 min 35 s", "2 h 5 min"]);
    }

    #[test]
    fn a_long_node_says_how_far_it_is() {
        let mut err = Vec::new();
        let mut progress = Progress::new(&mut err, 2);
        progress.bar = None;
        progress.last_line = progress.last_line.checked_sub(LINE).expect("the machine is up");
        progress.event(Event::Planned { nodes: 9 });
        let (address, words, left_millis) = ("e/x", "loss 0.31", Some(240_000));
        for done in [1200, 1300] {
            progress.event(Event::Told { address, done, of: 3000, words, left_millis });
        }
        let said = String::from_utf8_lossy(&err).into_owned();
        assert!(said.starts_with("[0/9] "), "{said}");
        assert!(said.ends_with(", about 2 min 0 s left: e/x, 1200 of 3000, loss 0.31\n"), "{said}");
    }

    #[test]
    fn of_many_failures_the_first_are_told_in_full() {
        let mut err = Vec::new();
        let mut progress = Progress::new(&mut err, 2);
        progress.bar = None;
        for i in 0..5 {
            let why = format!("its standard error ends:\n    Traceback\n    bad {i}");
            progress.event(Event::Failed { address: "e/x", why: &why });
        }
        progress.finish();
        let said = String::from_utf8_lossy(&err).into_owned();
        assert_eq!(said.matches("Traceback").count(), WHOLE, "{said}");
        assert!(said.ends_with("failed: e/x: its standard error ends: bad 4\n"), "{said}");
    }

    #[test]
    fn without_a_terminal_failures_are_lines() {
        let mut err = Vec::new();
        let mut progress = Progress::new(&mut err, 2);
        progress.bar = None;
        progress.event(Event::Planned { nodes: 9 });
        for (address, why) in [("e/x", "no data"), ("e/y", "no disk"), ("e/z", "no data")] {
            progress.event(Event::Failed { address, why });
        }
        progress.finish();
        let expected = "failed: e/x: no data\nfailed: e/y: no disk\nfailed: 1 more node like e/x\n";
        assert_eq!(String::from_utf8_lossy(&err), expected);
    }
}
