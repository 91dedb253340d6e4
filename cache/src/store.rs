//! A second store behind a cache: what it must be able to do. Nothing that it says is believed
//! here; [`Second`](crate::Second) checks it.

mod folder;

use std::fmt;
use std::io;

pub use folder::Folder;

/// A place that keeps bytes under names, shared by many caches.
///
/// A name is a path of plain words, such as `objects/ab/abcd`.
pub trait Store: fmt::Debug + Send + Sync {
    /// The names in a folder, without it and sorted; an error if there are more than `max`.
    ///
    /// # Errors
    /// If there is something else in its place, or the store fails.
    fn list(&self, folder: &str, max: usize) -> Result<Vec<String>, StoreError>;

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

    /// Removes what lies under a name, if there is something.
    ///
    /// # Errors
    /// If it is something else than bytes, or the store fails.
    fn remove(&self, name: &str) -> Result<(), StoreError>;
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
