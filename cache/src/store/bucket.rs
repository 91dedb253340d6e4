//! A second store in an object storage: S3, Google Cloud Storage, Azure Blob Storage.
//!
//! Its files lie as those of a [`Folder`](super::Folder). Who may do what comes from the environment, as `object_store`
//! reads it.

use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use futures_util::{StreamExt as _, TryStreamExt as _, stream};
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::path::Path;
use object_store::{
    BackoffConfig, ClientConfigKey, Error, ObjectStore, ObjectStoreExt as _, PutMode, RetryConfig,
};
use tokio::runtime::Runtime;
use tokio::time::timeout;

use super::place::Service;
use super::{Store, StoreError, checked, shelves};
use crate::Mode;

/// How long a store may be silent, with all that is tried again.
const SILENCE: Duration = Duration::from_secs(10);
/// How often a request is made again after an error of the server or the network.
const N_RETRIES: usize = 3;
/// How many bytes a second an upload has at least, beyond the silence.
const RATE: u64 = 1 << 20;
/// Uploads of more bytes go one at a time, so that they do not slow each other down below the rate.
const LARGE: usize = 256 << 10;
/// How many requests are made at once.
const N_AT_ONCE: usize = 64;
/// How many names a listing has in one piece.
const PAGE: usize = 1000;
/// The most letters of an error that are told.
const N_TOLD: usize = 300;

/// A bucket that keeps bytes under names, below a prefix.
#[derive(Debug)]
pub(super) struct Bucket {
    store: Arc<dyn ObjectStore>,
    prefix: String,
    /// Whether it can put what is not there yet, and nothing else.
    has_conditions: bool,
    /// Where connections are seen to; requests wait on the threads that make them.
    runtime: Option<Runtime>,
    large: Mutex<()>,
}

impl Bucket {
    /// The store in a bucket; one that is to be written is made if it is not there.
    ///
    /// # Errors
    /// If there is none, or it is of another format, or it fails.
    pub(super) fn open(
        service: Service,
        bucket: &str,
        prefix: &str,
        mode: Mode,
    ) -> Result<Self, StoreError> {
        let failed = |error: Error| fault("address", &error);
        let bucket = Self {
            store: client(service, bucket).map_err(failed)?,
            prefix: prefix.to_owned(),
            has_conditions: service != Service::S3 || has_conditions(),
            runtime: Some(runtime().map_err(|source| failed_with("address", source))?),
            large: Mutex::default(),
        };
        checked(bucket, mode)
    }

    fn path(&self, name: &str) -> Path {
        let words = self.prefix.split('/').chain(name.split('/'));
        words.filter(|word| !word.is_empty()).collect()
    }

    /// What came of some requests, unless nothing does in time.
    fn wait<T>(
        &self,
        name: &str,
        limit: Duration,
        requests: impl Future<Output = Result<T, Error>>,
    ) -> Result<T, StoreError> {
        match self.block_on(async { timeout(limit, requests).await }) {
            Ok(done) => done.map_err(|error| fault(name, &error)),
            Err(_) => Err(silent(name)),
        }
    }

    /// The names below a folder, without it: up to `max`.
    async fn names(&self, folder: &str, max: usize) -> Result<Vec<String>, StoreError> {
        let path = self.path(folder);
        let mut names = Vec::new();
        let mut found = self.store.list(Some(&path));
        while names.len() < max
            && let Some(next) = timeout(SILENCE, found.next()).await.map_err(|_| silent(folder))?
        {
            let place = next.map_err(|error| fault(folder, &error))?.location;
            let below = place.as_ref().strip_prefix(path.as_ref());
            names.extend(below.and_then(|name| name.strip_prefix('/')).map(str::to_owned));
        }
        Ok(names)
    }

    fn block_on<T>(&self, work: impl Future<Output = T>) -> T {
        self.runtime.as_ref().expect("it is there until this is dropped").block_on(work)
    }
}

impl Drop for Bucket {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            // Whatever is under way has nobody who waits for it.
            runtime.shutdown_background();
        }
    }
}

impl Store for Bucket {
    fn list(&self, folder: &str, max: usize) -> Result<Vec<String>, StoreError> {
        let mut names = self.block_on(self.names(folder, max.saturating_add(1)))?;
        if names.len() > max {
            return Err(StoreError::refused(folder, format!("more than {max} names")));
        }
        names.retain(|name| !name.contains('/'));
        names.sort_unstable();
        Ok(names)
    }

    /// One request where there is no more than a piece, else those of all shelves at once.
    fn shelves(
        &self,
        folder: &str,
        max: usize,
        refused: &mut dyn FnMut(StoreError),
    ) -> Result<Vec<String>, StoreError> {
        let listed = |shelf: String| async move {
            let names = self.names(&format!("{folder}/{shelf}"), max).await?;
            Ok(names.into_iter().map(|name| format!("{shelf}/{name}")).collect::<Vec<_>>())
        };
        self.block_on(async {
            let mut all = self.names(folder, PAGE).await?;
            if all.len() == PAGE {
                let each = stream::iter(shelves()).map(listed).buffered(N_AT_ONCE);
                all = each.try_concat().await?;
            }
            if all.len() > max {
                refused(StoreError::refused(folder, format!("more than {max} names")));
                all.truncate(max);
            }
            Ok(all)
        })
    }

    fn size(&self, name: &str) -> Result<Option<u64>, StoreError> {
        let path = self.path(name);
        self.wait(name, SILENCE, async { there(self.store.head(&path).await) })
            .map(|found| found.map(|found| found.size))
    }

    fn get(&self, name: &str, max: u64) -> Result<Option<Vec<u8>>, StoreError> {
        let path = self.path(name);
        let found = self.wait(name, SILENCE, async { there(self.store.get(&path).await) })?;
        let Some(found) = found else { return Ok(None) };
        let size = found.meta.size;
        if size > max {
            let why = format!("{size} bytes where at most {max} are expected");
            return Err(StoreError::refused(name, why));
        }
        let mut bytes = Vec::new();
        let mut pieces = found.into_stream();
        while let Some(piece) = self.wait(name, SILENCE, pieces.try_next())? {
            bytes.extend_from_slice(&piece);
            if bytes.len() as u64 > max {
                return Err(StoreError::refused(name, format!("more than {max} bytes")));
            }
        }
        Ok(Some(bytes))
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.upload(name, bytes, PutMode::Overwrite)?.map_err(|error| fault(name, &error))
    }

    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        match self.upload(name, bytes, PutMode::Create)? {
            Ok(()) => Ok(true),
            Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => Ok(false),
            Err(error) => Err(fault(name, &error)),
        }
    }

    fn add(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        if (bytes.len() > LARGE || !self.has_conditions) && self.size(name)?.is_some() {
            return Ok(false);
        }
        if self.has_conditions {
            return self.create(name, bytes);
        }
        self.put(name, bytes).map(|()| true)
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        let path = self.path(name);
        self.wait(name, SILENCE, async { there(self.store.delete(&path).await) }).map(drop)
    }

    fn n_at_once(&self) -> usize {
        N_AT_ONCE
    }
}

impl Bucket {
    fn upload(
        &self,
        name: &str,
        bytes: &[u8],
        mode: PutMode,
    ) -> Result<Result<(), Error>, StoreError> {
        let alone = || self.large.lock().unwrap_or_else(PoisonError::into_inner);
        let _alone = (bytes.len() > LARGE).then(alone);
        let limit = SILENCE + Duration::from_secs(bytes.len() as u64 / RATE);
        let path = self.path(name);
        let put = self.store.put_opts(&path, bytes.to_vec().into(), mode.into());
        self.wait(name, limit, async { Ok(put.await.map(drop)) })
    }
}

fn runtime() -> io::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()
}

fn client(service: Service, bucket: &str) -> Result<Arc<dyn ObjectStore>, Error> {
    // Another part of the process may have chosen before.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let backoff = BackoffConfig {
        init_backoff: Duration::from_millis(100),
        max_backoff: Duration::from_secs(2),
        base: 2.0,
    };
    let retry = RetryConfig { backoff, max_retries: N_RETRIES, retry_timeout: SILENCE };
    // A large object takes longer than any limit for all; silence is looked for by who waits.
    let (key, long) = (ClientConfigKey::Timeout, "1day");
    Ok(match service {
        Service::S3 => {
            let builder = AmazonS3Builder::from_env().with_bucket_name(bucket);
            let builder = builder.with_config(AmazonS3ConfigKey::Client(key), long);
            Arc::new(builder.with_retry(retry).build()?)
        }
        Service::Gs => {
            let builder = GoogleCloudStorageBuilder::from_env().with_bucket_name(bucket);
            let builder = builder.with_config(GoogleConfigKey::Client(key), long);
            Arc::new(builder.with_retry(retry).build()?)
        }
        Service::Az => {
            let builder = MicrosoftAzureBuilder::from_env().with_container_name(bucket);
            let builder = builder.with_config(AzureConfigKey::Client(key), long);
            Arc::new(builder.with_retry(retry).build()?)
        }
    })
}

/// Whether what speaks like S3 was not said to lack conditions.
fn has_conditions() -> bool {
    let key = AmazonS3ConfigKey::ConditionalPut;
    AmazonS3Builder::from_env().get_config_value(&key).as_deref() != Some("disabled")
}

/// What was found, if anything.
fn there<T>(found: Result<T, Error>) -> Result<Option<T>, Error> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(Error::NotFound { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn silent(name: &str) -> StoreError {
    let why = format!("nothing was heard for {} s", SILENCE.as_secs());
    failed_with(name, io::Error::new(ErrorKind::TimedOut, why))
}

fn failed_with(name: &str, source: io::Error) -> StoreError {
    StoreError::Failed { name: name.to_owned(), source }
}

/// What went wrong, without what must not be told.
fn fault(name: &str, error: &Error) -> StoreError {
    let kind = match error {
        Error::NotFound { .. } => ErrorKind::NotFound,
        Error::PermissionDenied { .. } | Error::Unauthenticated { .. } => {
            ErrorKind::PermissionDenied
        }
        _ => ErrorKind::Other,
    };
    let mut deepest: &dyn std::error::Error = error;
    while let Some(source) = deepest.source() {
        deepest = source;
    }
    let refused = kind == ErrorKind::PermissionDenied;
    let before = if refused { "the store does not allow it: " } else { "" };
    let what = format!("{before}{}", tellable(&deepest.to_string()));
    failed_with(name, io::Error::new(kind, what))
}

/// A text of a server or a library on one line, without what addresses in it say beyond host and path: a signature may
/// be among that, or a password.
fn tellable(text: &str) -> String {
    let word = |word: &str| match word.split_once("://") {
        Some((before, rest)) => {
            let rest = rest.split(['?', '#']).next().unwrap_or_default();
            let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
            let host = host.rsplit('@').next().unwrap_or_default();
            format!("{before}://{host}/{path}")
        }
        None => word.to_owned(),
    };
    let printable: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let line: String = printable.split_whitespace().map(word).collect::<Vec<_>>().join(" ");
    line.chars().take(N_TOLD).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_of_an_error_has_no_secrets_and_is_one_line() {
        let check = |text: &str, expected: &str| assert_eq!(tellable(text), expected);
        check("refused (https://b.x/p/q?sig=secret#a)", "refused (https://b.x/p/q");
        check("at http://me:secret@host:9000 twice", "at http://host:9000/ twice");
        check(
            "<Error>\n  <Code>\u{1b}[2JNo</Code>\n</Error>",
            "<Error> <Code> [2JNo</Code> </Error>",
        );
        assert_eq!(tellable(&"é".repeat(1000)).chars().count(), N_TOLD);
    }

    #[test]
    fn every_service_has_a_client() {
        for service in [Service::S3, Service::Gs, Service::Az] {
            // Azure wants the name of an account, which is not an error of ours.
            if let Err(error) = client(service, "bucket") {
                assert_eq!(service, Service::Az, "{error}");
            }
        }
    }
}
