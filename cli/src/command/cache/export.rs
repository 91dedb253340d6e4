//! `ivx cache export`

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use ivx_cache::{Cache, Exported, Record};
use ivx_engine::{expand, platform, recorded};

use super::{count, root};
use crate::command::ready;
use crate::ending::unfinished;
use crate::{At as _, OK, Trouble, WRONG, args, project};

pub(super) fn export(
    args: &args::Export,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let (cache, wanted) = match &args.spec {
        None => (Cache::look(&root()?, &platform())?, None),
        Some(path) => {
            let (profile, sets) = (args.profile.clone(), args.sets.clone());
            let spec = args::Spec { path: path.clone(), profile, sets, max_nodes: None };
            let Some(ready) = ready(&spec, err)? else { return Ok(WRONG) };
            let plan = expand(&ready.spec, &ready.registry);
            let cache = Cache::look(&project::cache(&ready.loaded.root), &platform())?;
            let wanted = recorded(&plan, &ready.registry, &cache);
            (cache, Some(wanted))
        }
    };
    // Half an archive is never found under the name.
    let mut name = args.path.clone().into_os_string();
    name.push(".part");
    let temporary = PathBuf::from(name);
    let is_wanted =
        |record: &Record| wanted.as_ref().is_none_or(|wanted| wanted.contains(&record.key));
    let exported = unfinished(&temporary, || -> Result<Exported, Trouble> {
        let mut file = BufWriter::new(File::create(&temporary).at(&temporary)?);
        match ivx_cache::export(&cache, is_wanted, &mut file, &temporary) {
            Ok(exported) => fs::rename(&temporary, &args.path).at(&args.path).map(|()| exported),
            Err(error) => {
                // The first error is the one to tell.
                fs::remove_file(&temporary).ok();
                Err(error.into())
            }
        }
    })?;
    let Exported { records, objects, bytes, missing } = exported;
    let (records, objects) = (count(records, "record"), count(objects, "object"));
    writeln!(out, "{}: {records}, {objects} of {bytes} bytes", args.path.display())?;
    if missing > 0 {
        let missing = count(missing, "object");
        writeln!(err, "note: the cache has lost {missing}, which are made again where needed")?;
    }
    Ok(OK)
}
