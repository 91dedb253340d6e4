//! Where Procgen lies, and whether it is the one that is known here.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use sha2::{Digest as _, Sha256};

use super::libenv::{Library, Ready};

/// The libraries in the wheels of Procgen 0.10.7 for Linux on `x86_64`: the digest of `libenv.so`, and the version of
/// Python that the wheel is for. No other is called.
const LIBRARIES: [(&str, &str); 4] = [
    ("f44786431a902e9ae1a32cd44f4aa650f4bdad893240a322e49e6098d6a7a2ea", "3.10"),
    ("ba87206cdcca77f56fd0e3e5adbbb1b04182cda79acf746131d3450936370c5d", "3.9"),
    ("5163e92ffd98f1cadfe39a357c83fbf2db266305b7f88ce8d1a0c0e043987b73", "3.8"),
    ("af1f112ce03983375d5a700cb2987635d46129adfd19dd2abacbd13cfc2f53b7", "3.7"),
];

/// The digest of the pictures beside each of them. Where one is missing, the library ends the process.
const ASSETS: &str = "ba57c1d036cd0b0adc98304a9831541ba10ac8a535167afd5e10d924f835b725";

/// A library that was looked at, and the folder of its pictures.
pub(super) struct Known {
    /// Where the library lies.
    library: PathBuf,
    /// The folder of the pictures, links resolved.
    assets: PathBuf,
    /// What is known of both.
    told: String,
}

impl Known {
    /// Where the library lies.
    pub(super) fn library(&self) -> &Path {
        &self.library
    }

    /// The folder of the pictures.
    pub(super) fn assets(&self) -> &Path {
        &self.assets
    }
}

/// The library of this process, which takes one.
struct Loaded {
    told: String,
    library: &'static Library,
    /// Itself with its pictures, which it reads once.
    ready: Option<Ready>,
}

static LOADED: Mutex<Option<Loaded>> = Mutex::new(None);

/// Which library lies in a folder, as a key knows it. It is loaded, and has no pictures yet. A folder is looked at once.
///
/// # Errors
/// If there is none, or one that is not known here, or one that cannot be loaded.
pub(super) fn look(folder: &Path) -> Result<String, String> {
    static LOOKED: Mutex<BTreeMap<PathBuf, String>> = Mutex::new(BTreeMap::new());
    let mut looked = LOOKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(told) = looked.get(folder) {
        return Ok(told.clone());
    }
    let known = inspect(folder)?;
    load(&known, &mut LOADED.lock().unwrap_or_else(PoisonError::into_inner))?;
    looked.insert(folder.to_owned(), known.told.clone());
    Ok(known.told)
}

/// The library that was `told` of, with its pictures.
///
/// # Errors
/// If it is another by now.
pub(super) fn library(told: &str, folder: &Path) -> Result<Ready, String> {
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(Loaded { told: known, ready: Some(ready), .. }) = &*loaded
        && known == told
    {
        return Ok(*ready);
    }
    let known = inspect(folder)?;
    if known.told != told {
        return Err("Procgen is not what it was when the spec was read: run again".to_owned());
    }
    let one = load(&known, &mut loaded)?;
    Ok(*one.ready.get_or_insert_with(|| one.library.read_pictures(&known)))
}

/// Loads a library, unless it is already.
fn load<'a>(known: &Known, loaded: &'a mut Option<Loaded>) -> Result<&'a mut Loaded, String> {
    if loaded.is_none() {
        let library = Box::leak(Box::new(Library::load(known)?));
        *loaded = Some(Loaded { told: known.told.clone(), library, ready: None });
    }
    let one = loaded.as_mut().expect("one is loaded");
    if one.told != known.told {
        return Err(format!("{} is loaded already, and a process takes one", one.told));
    }
    Ok(one)
}

/// Looks at the library and the pictures in a folder.
fn inspect(folder: &Path) -> Result<Known, String> {
    let about = |path: &Path, error: &io::Error| format!("{}: {error}", path.display());
    let folder = &fs::canonicalize(folder).map_err(|error| about(folder, &error))?;
    let places = [folder.join("prebuilt/libenv.so"), folder.join("libenv.so")];
    let Some(library) = places.into_iter().find(|path| path.is_file()) else {
        return Err(format!("`{}` has no `prebuilt/libenv.so`", folder.display()));
    };
    let bytes = fs::read(&library).map_err(|error| about(&library, &error))?;
    let digest = hex(Sha256::digest(bytes));
    let Some((_, python)) = LIBRARIES.iter().find(|(known, _)| *known == digest) else {
        let path = library.display();
        return Err(format!("`{path}` is none of Procgen 0.10.7 for Linux on x86_64"));
    };
    let assets = folder.join("assets");
    let assets = fs::canonicalize(&assets).map_err(|error| about(&assets, &error))?;
    if assets.to_str().is_none() {
        return Err(format!("`{}` is no Unicode", assets.display()));
    }
    let pictures = digest_of(&assets).map_err(|error| about(&assets, &error))?;
    if pictures != ASSETS {
        return Err(format!(
            "`{}` are not the pictures of Procgen 0.10.7 ({pictures})",
            assets.display()
        ));
    }
    let told = format!("Procgen 0.10.7 for Python {python}, libenv.so {digest}, assets {pictures}");
    Ok(Known { library, assets, told })
}

/// The digest of all files below a folder, and of where they lie there.
fn digest_of(folder: &Path) -> io::Result<String> {
    let (mut files, mut todo) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = todo.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() { todo.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    let mut all = Sha256::new();
    for path in files {
        let name = path.strip_prefix(folder).expect("it lies below").as_os_str();
        all.update(name.as_encoded_bytes());
        all.update([0]);
        all.update(Sha256::digest(fs::read(&path)?));
    }
    Ok(hex(all.finalize()))
}

fn hex(digest: impl IntoIterator<Item = u8>) -> String {
    let digit = |nibble: u8| char::from(b"0123456789abcdef"[usize::from(nibble)]);
    digest.into_iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}
