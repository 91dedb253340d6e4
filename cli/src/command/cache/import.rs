//! `ivx cache import`

use std::fs::File;
use std::io::Write;

use ivx_cache::{ArchiveError, Cache, Imported, Limits};
use ivx_engine::platform;

use super::count;
use crate::{At as _, OK, Trouble, args, project};

pub(super) fn import(args: &args::Import, out: &mut dyn Write) -> Result<u8, Trouble> {
    let archive = File::open(&args.path).at(&args.path)?;
    let mut cache = Cache::open(&project::cache(&project::here()), &platform())?;
    let imported = match ivx_cache::import(&mut cache, archive, &Limits::default()) {
        Ok(imported) => imported,
        Err(ArchiveError::Cache(error)) => return Err(error.into()),
        Err(refused) => {
            let (path, why) = (args.path.display().to_string(), refused.to_string());
            return Err(Trouble::Content { path, why });
        }
    };
    let Imported { records, new_records, objects, bytes } = imported;
    let (records, objects) = (count(records, "record"), count(objects, "object"));
    let path = args.path.display();
    writeln!(out, "{path}: {records}, {new_records} of them new, {objects} of {bytes} bytes")?;
    Ok(OK)
}
