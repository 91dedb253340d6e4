//! Where a second store is, as a person says it.

use std::ffi::OsStr;
use std::fmt;
use std::path::PathBuf;

use super::{Folder, Store, StoreError};
use crate::Mode;

/// Where a second store is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In a folder.
    Folder(PathBuf),
    /// In an object storage, below a prefix.
    Bucket {
        /// Whose.
        service: Service,
        /// The bucket, or container.
        bucket: String,
        /// Plain words between slashes; empty for the whole bucket.
        prefix: String,
    },
}

/// Who keeps a bucket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// Amazon S3, and what speaks like it.
    S3,
    /// Google Cloud Storage.
    Gs,
    /// Azure Blob Storage.
    Az,
}

impl Place {
    /// The place that a text means: `s3://BUCKET/PREFIX`, `gs://` or `az://`, else a folder.
    ///
    /// # Errors
    /// Why it means none. The words have nothing of the text, which may hold a password.
    pub fn parse(text: &OsStr) -> Result<Self, String> {
        let Some((scheme, rest)) = text.to_str().and_then(|text| text.split_once("://")) else {
            return Ok(Self::Folder(text.into()));
        };
        let service = match scheme {
            "s3" => Service::S3,
            "gs" => Service::Gs,
            "az" => Service::Az,
            _ => return Err("a store is a folder, or begins with s3://, gs:// or az://".into()),
        };
        if rest.contains(['@', '?', '#']) {
            let why =
                "an address has no names, passwords or parameters: they come from the environment";
            return Err(why.into());
        }
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let prefix = prefix.trim_end_matches('/');
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.+=".contains(c);
        let is_word = |word: &str| !["", ".", ".."].contains(&word) && word.chars().all(plain);
        if !is_word(bucket) || !(prefix.is_empty() || prefix.split('/').all(is_word)) {
            let why = "an address is a bucket and plain words: letters, digits, `-`, `_`, `.`, `+` and `=`";
            return Err(why.into());
        }
        if cfg!(not(feature = "object-storage")) {
            let why = "this build of ivx has no object storage: releases and the wheel have it, and \
                       `cargo install --path cli --features object-storage`";
            return Err(why.into());
        }
        Ok(Self::Bucket { service, bucket: bucket.into(), prefix: prefix.into() })
    }

    /// The store there; one that is to be written is made if it is not there.
    ///
    /// # Errors
    /// If there is none, or it is of another format, or it fails.
    pub fn open(&self, mode: Mode) -> Result<Box<dyn Store>, StoreError> {
        match (self, mode) {
            (Self::Folder(folder), Mode::Read) => Ok(Box::new(Folder::open(folder)?)),
            (Self::Folder(folder), Mode::Write) => Ok(Box::new(Folder::create(folder)?)),
            #[cfg(feature = "object-storage")]
            (Self::Bucket { service, bucket, prefix }, mode) => {
                let bucket = super::bucket::Bucket::open(*service, bucket, prefix, mode)?;
                Ok(Box::new(bucket))
            }
            #[cfg(not(feature = "object-storage"))]
            (Self::Bucket { .. }, _) => unreachable!("no address means one in this build"),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (service, bucket, prefix) = match self {
            Self::Folder(folder) => return folder.display().fmt(f),
            Self::Bucket { service, bucket, prefix } => (service, bucket, prefix),
        };
        let scheme = match service {
            Service::S3 => "s3",
            Service::Gs => "gs",
            Service::Az => "az",
        };
        let slash = if prefix.is_empty() { "" } else { "/" };
        write!(f, "{scheme}://{bucket}{slash}{prefix}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_a_folder_or_an_address_without_secrets() {
        let check = |text: &str, expected: Result<&str, &str>| match (
            Place::parse(OsStr::new(text)),
            expected,
        ) {
            (Ok(place), Ok(shown)) => assert_eq!(place.to_string(), shown),
            (Err(why), Err(word)) => {
                assert!(why.contains(word) && !why.contains("secret"), "{text}: {why}");
            }
            (place, _) => panic!("{text}: {place:?}"),
        };
        check("results/store", Ok("results/store"));
        check("s3:/x", Ok("s3:/x"));
        for bad in ["s3://me:secret@b/p", "s3://b?sig=secret", "az://b/p#secret"] {
            check(bad, Err("come from the environment"));
        }
        for bad in ["s3://", "s3:///p", "gs://b/a//c", "gs://b/../c", "s3://b/a b", "s3://b/\u{1b}"]
        {
            check(bad, Err("plain words"));
        }
        check("https://secret/", Err("begins with s3://"));
        let known = ["s3://b", "gs://b/p/q", "az://b/p=1"];
        for text in known {
            let absent = Err("has no object storage");
            check(text, if cfg!(feature = "object-storage") { Ok(text) } else { absent });
        }
        if cfg!(feature = "object-storage") {
            check("s3://b/p//", Ok("s3://b/p"));
        }
    }
}
