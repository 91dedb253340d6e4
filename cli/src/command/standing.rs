//! `ivx standing`

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use ivx_engine::{Files, List, Named, Numbers, Run, standing as page};
use ivx_grammar::ast::{Item, ItemKind};
use ivx_grammar::check::Settings;
use ivx_library::registry;
use ivx_op::{Registry, read_published};

use super::{checked, lock};
use crate::load::{Loaded, load};
use crate::render::visible;
use crate::replace::replace;
use crate::source::{plain, text};
use crate::{FAILED, OK, Trouble, WRONG, args, place, project};

/// The profile in which every parameter has its default.
const DEFAULTS: &str = "paper";

/// Writes how each element of a list stands.
pub(crate) fn standing(
    args: &args::Standing,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let read = text(&args.list).map_err(|error| plain(&error));
    let read = read.and_then(|text| List::from_ron(&text).map_err(|why| why.to_string()));
    let list = match read {
        Ok(list) => list,
        Err(why) => {
            writeln!(err, "error: {}: {}", args.list.display(), visible(&why))?;
            return Ok(WRONG);
        }
    };
    let path = project::real(&args.list);
    let page_at = project::real(args.out.as_deref().unwrap_or(Path::new("page")));
    let [folder, seen_from] = [&path, &page_at].map(|file| file.parent().unwrap_or(file));
    let Some(files) = read_files(&list, folder, seen_from, err)? else { return Ok(WRONG) };
    match page(&list, &files) {
        Err(wrong) => {
            for wrong in &wrong {
                writeln!(err, "error: {}", visible(&wrong.message))?;
                if !wrong.help.is_empty() {
                    writeln!(err, "help: {}", visible(&wrong.help))?;
                }
            }
            Ok(WRONG)
        }
        Ok(page) => {
            match &args.out {
                Some(path) if args.check => {
                    // What cannot be read is not it either.
                    if text(path).is_ok_and(|written| written == page) {
                        return Ok(OK);
                    }
                    let path = path.display();
                    writeln!(out, "{path} is stale: without `--check` it is written anew")?;
                    return Ok(FAILED);
                }
                Some(path) => {
                    replace(path, &page)?;
                    writeln!(out, "{}: {} bytes", path.display(), page.len())?;
                }
                None => write!(out, "{page}")?,
            }
            Ok(OK)
        }
    }
}

/// What a list names, read; says so if some of it cannot be.
///
/// - `folder`: that of the list.
/// - `page`: that of the page.
fn read_files(
    list: &List,
    folder: &Path,
    page: &Path,
    err: &mut dyn Write,
) -> Result<Option<Files>, Trouble> {
    let registry = registry();
    let link = |path: &Path| {
        let link = project::seen_from(page, path);
        link.to_string_lossy().replace('\\', "/")
    };
    let mut files = Files::default();
    let named: BTreeSet<&String> =
        list.specs.iter().chain(list.places().map(|place| &place.file)).collect();
    let mut registered = Registered::default();
    for file in named {
        let path = folder.join(file);
        let loaded = load(&path, &registry)?;
        let Some(mut spec) = named_spec(list, &loaded, &registry, err)? else { return Ok(None) };
        spec.link = link(&loaded.spec);
        let around = list.specs.iter().map(|file| folder.join(file));
        spec.runs = registered.runs(&loaded, around, &list.profiles)?;
        files.specs.insert(file.clone(), spec);
    }
    for file in list.elements().flat_map(|element| &element.published) {
        let path = project::real(&folder.join(file));
        let read = text(&path).map_err(|error| plain(&error));
        match read.and_then(|text| read_published(&text)) {
            Ok(read) => {
                let numbers = Numbers { link: link(&path), source: read.source };
                files.published.insert(file.clone(), numbers);
            }
            Err(why) => {
                writeln!(err, "error: {}: {}", visible(file), visible(&why))?;
                return Ok(None);
            }
        }
    }
    for file in list.elements().flat_map(|element| &element.tested) {
        let path = project::real(&folder.join(file));
        if !path.is_file() {
            writeln!(err, "error: {}: there is no such file", visible(file))?;
            return Ok(None);
        }
        files.tested.insert(file.clone(), link(&path));
    }
    Ok(Some(files))
}

/// A spec under each profile of a list; says so if it has faults.
fn named_spec(
    list: &List,
    loaded: &Loaded,
    registry: &Registry,
    err: &mut dyn Write,
) -> Result<Option<Named>, Trouble> {
    let mut declared = BTreeSet::new();
    for file in &loaded.project.files {
        profiles(&file.ast.items, &mut declared);
    }
    let mut named = Named::default();
    for profile in &list.profiles {
        // Where nobody declares it, every parameter has its default.
        let is_declared = declared.contains(profile.as_str());
        let asked = if is_declared { profile } else { DEFAULTS };
        let settings = Settings { profile: Some(asked.to_owned()), ..Settings::default() };
        let Some((spec, _)) = checked(loaded, registry, &settings, err)? else { return Ok(None) };
        named.specs.insert(profile.clone(), spec);
        if is_declared {
            named.declared.insert(profile.clone());
        }
    }
    Ok(Some(named))
}

/// The profiles that items declare, those of experiments too.
fn profiles<'a>(items: &'a [Item], into: &mut BTreeSet<&'a str>) {
    for item in items {
        match &item.kind {
            ItemKind::Profile { name, .. } => drop(into.insert(&name.value)),
            ItemKind::Experiment { items, .. } => profiles(items, into),
            _ => {}
        }
    }
}

/// What the locks of a project have, read once.
#[derive(Default)]
struct Registered {
    locks: BTreeMap<PathBuf, ivx_engine::Locks>,
}

impl Registered {
    /// The runs of a spec, and of specs around it.
    fn runs(
        &mut self,
        loaded: &Loaded,
        around: impl Iterator<Item = PathBuf>,
        profiles: &[String],
    ) -> Result<Vec<Run>, Trouble> {
        let around = around.filter_map(|path| fs::canonicalize(path).ok());
        let mut specs: Vec<PathBuf> = vec![loaded.spec.clone()];
        specs.extend(around.filter(|path| *path != loaded.spec));
        let mut runs = Vec::new();
        for spec in specs {
            let path = spec.with_file_name(lock::FILE);
            if !self.locks.contains_key(&path) {
                self.locks.insert(path.clone(), lock::read(&spec)?);
            }
            let within = spec.strip_prefix(&loaded.root).unwrap_or(&spec);
            let names = [""].into_iter().chain(profiles.iter().map(String::as_str));
            for name in names.map(|variant| place::name(within, variant)) {
                let Some(own) = self.locks[&path].specs.get(&name) else { continue };
                let Some(registered) = &own.registered else { continue };
                let within = path.strip_prefix(&loaded.root).unwrap_or(&path).display();
                runs.push(Run {
                    name: format!("`{name}` in {within}"),
                    profile: own.profile.clone(),
                    registered: registered.clone(),
                });
            }
        }
        Ok(runs)
    }
}
