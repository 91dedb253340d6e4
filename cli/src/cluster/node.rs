//! `ivx node exec`: runs keys whose tickets lie in a store, without a spec.

use std::env::var_os;
use std::io::{Read as _, Write};
use std::path::{Path, PathBuf};

use ivx_cache::{Cache, Digest, Fetched, Mode, Objects, Output, Second};
use ivx_engine::{Came, Options, Refused, Ticket, platform};
use ivx_library::{SOURCE_DIGEST, command, registry};
use ivx_op::{Content, External, ExternalKind, Registry};

use super::words::{Said, SaidWord};
use super::{end_with_parent, store};
use crate::ending::{STOP, heeding};
use crate::{BROKEN, OK, STOPPED, Trouble, WRONG, args};

/// The most bytes of a log that are kept: its end.
const LOG_MAX: usize = 16 << 20;

pub(crate) fn exec(
    args: &args::NodeExec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    end_with_parent();
    let mut say = |key: Digest, word: SaidWord| {
        let said = serde_json::to_string(&Said { key, word }).unwrap_or_default();
        writeln!(out, "{said}").and_then(|()| out.flush())
    };
    if let Some(asked) = args.library.as_ref().filter(|asked| *asked != SOURCE_DIGEST) {
        let refused =
            Refused::Library { asked: asked.clone(), own: SOURCE_DIGEST.to_owned() }.to_string();
        for key in &args.keys {
            say(*key, SaidWord::Refused(refused.clone()))?;
        }
        writeln!(err, "error: {refused}")?;
        return Ok(WRONG);
    }
    let shared = match store(&args.store) {
        Ok(store) => Second::unlisted(store, args.store.display().to_string(), Mode::Write),
        Err(why) => {
            writeln!(err, "error: the store {} cannot be used: {why}", args.store.display())?;
            return Ok(BROKEN);
        }
    };
    let platform = platform();
    let mut cache = Cache::open(&own_cache(args.cache.as_deref()), &platform)?;
    cache.attach(shared);
    let options = Options {
        jobs: args.threads,
        memory: u64::MAX,
        fail_fast: false,
        library: SOURCE_DIGEST.to_owned(),
        checkpoint: args.checkpoint,
        limit: args.node_limit,
        stop: STOP.clone(),
    };
    let registry = registry();
    let mut said = Vec::new();
    for &key in &args.keys {
        if STOP.asked() {
            break;
        }
        let came = heeding(|| run(key, &registry, &mut cache, &options))?;
        let word = match came {
            Ok(Came::Done) => SaidWord::Done(platform.clone()),
            Ok(Came::Failed(why)) => SaidWord::Failed(why),
            Ok(Came::Missing(digest)) => SaidWord::Missing(digest),
            Ok(Came::Stopped) => break,
            Err(why) => SaidWord::Refused(why.to_string()),
        };
        said.push((key, word));
    }
    let troubles = cache.close()?;
    for trouble in &troubles {
        writeln!(err, "note: {trouble}")?;
    }
    // Only now all that was put into the store is there.
    for (key, word) in said {
        say(key, word)?;
    }
    Ok(if STOP.asked() { STOPPED } else { OK })
}

fn run(
    key: Digest,
    registry: &Registry,
    cache: &mut Cache,
    options: &Options,
) -> Result<Result<Came, Refused>, Trouble> {
    let text = cache.second().and_then(|second| second.ticket(&key));
    let ticket = match text.as_deref().map(Ticket::read) {
        Some(Ok(ticket)) => ticket,
        Some(Err(refused)) => return Ok(Err(refused)),
        None => return Ok(Err(Refused::Damaged("there is none".to_owned()))),
    };
    let objects = cache.objects();
    let sizes = ticket.file_sizes().clone();
    let find = |named: &External| found(named, &objects, |digest| sizes.get(digest).copied());
    Ok(ticket.run(registry, cache, options, &find)?)
}

/// What something outside of a spec is on this machine.
fn found(
    named: &External,
    objects: &Objects,
    size: impl Fn(&Digest) -> Option<u64>,
) -> Result<External, String> {
    match (named.kind(), &named.content) {
        (ExternalKind::Program, _) => {
            command::program(&named.name, &var_os("PATH").unwrap_or_default())
        }
        (ExternalKind::Variable, _) => command::variable(&named.name),
        (ExternalKind::File, Content::File { is_executable, .. }) => {
            let digest = Digest(named.digest);
            let size = size(&digest).ok_or("is a file of unknown size")?;
            match objects.read(&Output { digest, size, inline: None }) {
                Ok(Fetched::Bytes(bytes)) => {
                    Ok(External::file(named.name.clone(), bytes.to_vec(), *is_executable))
                }
                Ok(_) => Err("is not in the store".to_owned()),
                Err(error) => Err(error.to_string()),
            }
        }
        (ExternalKind::File | ExternalKind::Foreign, _) => Err("does not travel".to_owned()),
    }
}

/// Where this machine keeps what it fetches and makes. Never the cache of a run, which has the right to what it hands
/// out: a node would wait for itself.
fn own_cache(asked: Option<&Path>) -> PathBuf {
    let variable = |name: &str| var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let below = |folder: PathBuf| folder.join("ivx").join("worker");
    asked
        .map(Path::to_owned)
        .or_else(|| variable("XDG_CACHE_HOME").map(below))
        .or_else(|| variable("HOME").map(|home| below(home.join(".cache"))))
        .unwrap_or_else(|| below(std::env::temp_dir()))
}

/// Keeps a log in a store, under a name.
pub(crate) fn log(args: &args::NodeLog, err: &mut dyn Write) -> Result<u8, Trouble> {
    let mut text = Vec::new();
    std::io::stdin().lock().read_to_end(&mut text)?;
    let text = &text[text.len().saturating_sub(LOG_MAX)..];
    let put = store(&args.store).and_then(|store| keep_log(&*store, &args.name, text));
    if let Err(why) = put {
        writeln!(err, "error: the log is not kept: {why}")?;
        return Ok(BROKEN);
    }
    Ok(OK)
}

/// Puts a log into a store.
pub(super) fn keep_log(
    store: &dyn ivx_cache::Store,
    name: &str,
    text: &[u8],
) -> Result<(), String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
        return Err(format!("`{name}` is no name: letters, digits, `.`, `-` and `_`"));
    }
    let text = &text[text.len().saturating_sub(LOG_MAX)..];
    store.put(&format!("logs/{name}"), text).map_err(|error| error.to_string())
}
