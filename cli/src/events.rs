//! What a program is told while a spec runs: an object a line.

use std::io::Write;

use ivx_engine::{Event, Listen};
use serde_json::{Value, json};

/// Follows a run.
pub(crate) struct Events<'a> {
    out: &'a mut dyn Write,
}

impl<'a> Events<'a> {
    /// Writes what happens to `out`.
    pub(crate) fn new(out: &'a mut dyn Write) -> Self {
        Self { out }
    }
}

impl Listen for Events<'_> {
    fn event(&mut self, event: Event<'_>) {
        // A closed pipe must not end the run.
        let _ = writeln!(self.out, "{}", as_json(&event));
        let _ = self.out.flush();
    }
}

fn as_json(event: &Event<'_>) -> Value {
    match event {
        Event::Planned { nodes } => json!({ "event": "planned", "nodes": nodes }),
        Event::Hit { address } => json!({ "event": "hit", "address": address }),
        Event::Started { address, expected_millis } => {
            json!({ "event": "started", "address": address, "expected_millis": expected_millis })
        }
        Event::Told { address, done, of, words, left_millis } => json!({
            "event": "told", "address": address, "done": done, "of": of, "words": words,
            "left_millis": left_millis,
        }),
        Event::Finished { address, millis, left_millis } => json!({
            "event": "finished", "address": address, "millis": millis, "left_millis": left_millis,
        }),
        Event::Failed { address, why } => {
            json!({ "event": "failed", "address": address, "why": why })
        }
        Event::Skipped { address, cause } => {
            json!({ "event": "skipped", "address": address, "cause": cause })
        }
        Event::Room { threads } => json!({ "event": "room", "threads": threads }),
        Event::Noted { what } => json!({ "event": "noted", "what": what }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_a_line() {
        let mut out = Vec::new();
        let mut events = Events::new(&mut out);
        events.event(Event::Planned { nodes: 2 });
        let (address, words, left_millis) = ("e/x", "loss 0.3\n\"", Some(70));
        events.event(Event::Told { address, done: 3, of: 10, words, left_millis });
        let lines: Vec<Value> = String::from_utf8(out)
            .unwrap()
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        assert_eq!(lines[0], json!({ "event": "planned", "nodes": 2 }));
        assert_eq!((&lines[1]["done"], &lines[1]["words"]), (&json!(3), &json!("loss 0.3\n\"")));
    }
}
