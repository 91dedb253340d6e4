//! A second store behind a cache: what it must be able to do. Nothing that it says is believed
//! here; [`Second`](crate::Second) checks it.

#[cfg(feature = "object-storage")]
mod bucket;
mod folder;
mod place;

use std::fmt;
use std::io;

pub use folder::Folder;
pub use place::Place;

use crate::Mode;

const VERSION: &str = "version";
const FORMAT: &[u8] = b"ivx store 1\n";

/// A place that keeps bytes under names, shared by many caches.
///
/// A name is a path of plain words, such as `objects/ab/abcd`.
pub trait Store: fmt::Debug + Send + Sync {
    /// The names in a folder, without it and sorted; an error if there are more than `max`.
    ///
    /// # Errors
    /// If there is something else in its place, or the store fails.
    fn list(&self, folder: &str, max: usize) -> Result<Vec<String>, StoreError>;

    /// The names in the folders `00` to `ff` of a folder, each after its own: `ab/abcd`.
    ///
    /// - `max`: folders beyond so many names are refused.
    /// - `refused`: is told which can't be listed, while the store works.
    ///
    /// # Errors
    /// If the store fails.
    fn shelves(
        &self,
        folder: &str,
        max: usize,
        refused: &mut dyn FnMut(StoreError),
    ) -> Result<Vec<String>, StoreError> {
        let mut all = Vec::new();
        for shelf in shelves() {
            match self.list(&format!("{folder}/{shelf}"), max - all.len()) {
                Ok(names) => all.extend(names.iter().map(|name| format!("{shelf}/{name}"))),
                Err(error @ StoreError::Failed { .. }) => return Err(error),
                Err(error) => refused(error),
            }
        }
        Ok(all)
    }

    /// How many bytes lie under a name; `None` if there is nothing.
    ///
    /// # Errors
    /// As [`Self::get`].
    fn size(&self, name: &str) -> Result<Option<u64>, StoreError>;

    /// The bytes under a name; `None` if there is nothing.
    ///
    /// # Errors
    /// If there are more than `max`, or there is something else in their place, or the store
    /// fails.
    fn get(&self, name: &str, max: u64) -> Result<Option<Vec<u8>>, StoreError>;

    /// Puts bytes under a name, whole or not at all, in the place of what was there.
    ///
    /// # Errors
    /// If there is something in the way, or the store fails.
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError>;

    /// Puts bytes under a name if there is nothing; whether there was nothing. Of several who do so at once, it is one.
    ///
    /// # Errors
    /// As [`Self::put`].
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError>;

    /// [`Self::create`] where those who do so at once have the same bytes, so that it does not matter who is first.
    ///
    /// # Errors
    /// As [`Self::put`].
    fn add(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        // What is no plain file is replaced.
        if matches!(self.size(name), Ok(Some(_))) {
            return Ok(false);
        }
        self.put(name, bytes).map(|()| true)
    }

    /// Removes what lies under a name, if there is something.
    ///
    /// # Errors
    /// If it is something else than bytes, or the store fails.
    fn remove(&self, name: &str) -> Result<(), StoreError>;

    /// How many threads may as well ask at once.
    fn n_at_once(&self) -> usize {
        1
    }
}

/// `00` to `ff`.
fn shelves() -> impl Iterator<Item = String> {
    (0..=u8::MAX).map(|shelf| format!("{shelf:02x}"))
}

/// The store, if it is one of this format; one that is to be written becomes one if it has none.
fn checked<S: Store>(store: S, mode: Mode) -> Result<S, StoreError> {
    let version = || store.get(VERSION, FORMAT.len() as u64);
    let mut found = version()?;
    if found.is_none() && mode == Mode::Write {
        store.add(VERSION, FORMAT)?;
        found = version()?;
    }
    match found {
        None => Err(StoreError::refused(VERSION, "there is none: this is no store of results")),
        Some(found) if found == FORMAT => Ok(store),
        Some(_) => Err(StoreError::refused(VERSION, "a store of another format")),
    }
}

/// Why a store did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// What lies there is not what it should be; the rest of the store may be.
    #[error("{name}: {why}")]
    Refused {
        /// What was asked for.
        name: String,
        /// What is wrong with it.
        why: String,
    },
    /// The store does not work.
    #[error("{name}: {source}")]
    Failed {
        /// What was asked for.
        name: String,
        /// What the system said.
        source: io::Error,
    },
}

impl StoreError {
    pub(crate) fn refused(name: &str, why: impl Into<String>) -> Self {
        Self::Refused { name: name.to_owned(), why: why.into() }
    }
}
