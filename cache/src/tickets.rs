//! What machines that share a second store tell each other through it: what is to be run, and what has been.

use crate::{Cache, CacheError, Digest, Fetched, Record, Second};

/// The most bytes of what is to be run.
const TICKET_MAX: u64 = 64 << 20;

impl Cache {
    /// The record of a key: known here, or lying in the second store by now, where it may have come since that said what
    /// it has.
    pub fn fetch(&mut self, key: &Digest, platform: &str) -> Option<&Record> {
        if self.lookup(key).is_none()
            && let Some(second) = self.objects.second.clone()
            && let Some(record) = second.fetch(key, platform)
        {
            self.borrow(record);
        }
        self.lookup(key)
    }

    /// Puts what is known here of a key into the second store; whether it has all of it.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn share(&self, key: &Digest) -> Result<bool, CacheError> {
        let (Some(second), Some(record)) = (&self.objects.second, self.lookup(key)) else {
            return Ok(false);
        };
        if record.output.inline.is_none() && !second.has(&record.output) {
            match self.objects.read(&record.output)? {
                Fetched::Bytes(bytes) => second.put_object(&record.output.digest, &bytes),
                Fetched::Missing | Fetched::Corrupt { .. } => return Ok(false),
            }
        }
        second.put_record(record);
        Ok(true)
    }
}

impl Second {
    /// Says there what is to be run for a key; whether it could.
    #[must_use]
    pub fn put_ticket(&self, key: &Digest, text: &str) -> bool {
        self.put(&ticket_name(key), text.as_bytes())
    }

    /// What is to be run for a key.
    #[must_use]
    pub fn ticket(&self, key: &Digest) -> Option<String> {
        let bytes = self.get(&ticket_name(key), TICKET_MAX)?;
        String::from_utf8(bytes).ok()
    }
}

fn ticket_name(key: &Digest) -> String {
    let hex = key.to_string();
    format!("tickets/{}/{hex}", &hex[..2])
}
