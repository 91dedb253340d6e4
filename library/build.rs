//! Digests the source of the library, so that every record says what computed it.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

fn main() {
    let mut files = Vec::new();
    for folder in [
        "src",
        "op/src",
        "math/src",
        "data/src",
        "nn/src",
        "world/src",
        "foreign/src",
        "figure/src",
        "table/src",
        "town/src",
    ] {
        println!("cargo::rerun-if-changed={folder}");
        collect(Path::new(folder), &mut files);
    }
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        let text = fs::read(&file).expect("source files can be read");
        for part in [file.to_string_lossy().as_bytes(), &text] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    let mut digest = String::new();
    for byte in hash.finalize() {
        write!(digest, "{byte:02x}").expect("strings take everything");
    }
    println!("cargo::rustc-env=IVX_SOURCE_DIGEST={digest}");
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("source folders can be read") {
        let path = entry.expect("source folders can be read").path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push(path);
        }
    }
}
