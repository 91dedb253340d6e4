//! A bit that flips anywhere in the cache is found or does no harm.

use std::fs;
use std::io;
use std::path::Path;

use ivx_cache::{Cache, Fetched, Record};
use ivx_engine::platform;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::project::{Project, Said};

const N_FLIPS: usize = 100;
const CACHE: &str = ".ivx/cache";
const WHOLE: &str = ".ivx/whole";
const RESULTS: &str = "results/flips/results.ron";

/// A project with results, and the files of a cache of those that `keep` says.
struct Flips {
    project: Project,
    results: String,
    cache: Vec<(String, Vec<u8>)>,
}

impl Flips {
    fn new(keep: impl Fn(&Record) -> bool) -> Self {
        let small = include_str!("specs/small.ivx").replace("hidden: [8]", "hidden: [32, 32]");
        let project = Project::in_memory(&[("flips.ivx", &small)]);
        assert!(project.executed("flips.ivx", &[]) > 0);
        let open = |path| Cache::open(&project.path(path), &platform()).expect("caches open");
        let (before, mut after) = (open(CACHE), open(WHOLE));
        for record in before.records().filter(|record| keep(record)) {
            let read = before.objects().read(&record.output).expect("the disk works");
            let Fetched::Bytes(bytes) = read else { panic!("{read:?}") };
            after.objects().put(&bytes).expect("the disk works");
            after.commit(record.clone()).expect("no key has two results");
        }
        after.hints().note_millis("known@1", 7);
        assert_eq!(after.close().expect("the disk works"), []);
        drop(before);
        fs::remove_dir_all(project.path(CACHE)).expect("the cache can be removed");
        let (results, cache) = (project.read(RESULTS), project.files(WHOLE));
        Self { project, results, cache }
    }

    /// Flips a bit of a file whose path begins so, `N_FLIPS` times, and runs the spec, which
    /// must find the same; then asks what else is true.
    fn each(&self, files: &str, check: impl Fn(&Said, &[u8])) {
        let files: Vec<_> = self.cache.iter().filter(|(path, _)| path.starts_with(files)).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for flip in 0..N_FLIPS {
            let (path, bytes) = files[flip % files.len()];
            let mut bytes = bytes.clone();
            let bit = rng.random_range(0..bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
            let place = format!("bit {bit} of {path}");
            let cache = self.project.path(CACHE);
            let damage = || {
                copy(&self.project.path(WHOLE), &cache)?;
                fs::remove_file(cache.join(path))?;
                fs::write(cache.join(path), &bytes)?;
                fs::remove_file(self.project.path(RESULTS))
            };
            damage().expect("files can be written");
            let said = self.project.run("exec", "flips.ivx", &[]);
            assert_eq!(said.code, 0, "{place}: {}{}", said.out, said.err);
            assert!(self.project.read(RESULTS) == self.results, "{place}: other results");
            check(&said, &bytes);
            fs::remove_dir_all(cache).expect("the cache can be removed");
        }
    }
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir(to)?;
    for entry in fs::read_dir(from)? {
        let from = entry?.path();
        let to = to.join(from.file_name().expect("a listed path has a name"));
        if from.is_dir() { copy(&from, &to)? } else { fs::copy(&from, &to).map(drop)? }
    }
    Ok(())
}

#[test]
fn a_flipped_bit_of_an_artifact_is_never_served() {
    // What needs the objects is not known, so that they are read.
    let flips = Flips::new(|record| record.output.inline.is_none());
    flips.each("objects/", |said, damaged| {
        let aside = flips.project.files(&format!("{CACHE}/corrupt"));
        // A reader that is late may put its successor aside, too, and run the node once more.
        let is_aside = aside.iter().any(|(_, bytes)| bytes == damaged);
        assert!(is_aside, "the damaged object is put aside: {}", said.err);
        assert!(said.err.contains("are gone: it runs again"), "{}", said.err);
    });
}

#[test]
fn a_flipped_bit_of_a_journal_costs_records_only() {
    let flips = Flips::new(|_| true);
    flips.each("journal/", |said, _| {
        let torn = !said.out.starts_with("0 of ") && !said.out.contains("\n0 of ");
        assert!(said.err.contains("note: ") || torn, "{}{}", said.out, said.err);
    });
}

#[test]
fn a_flipped_bit_of_the_hints_costs_hints_only() {
    // Something must run for the hints to be read.
    let flips = Flips::new(|record| !record.provenance.op.starts_with("regret"));
    flips.each("hints.sled/", |said, _| {
        assert!(said.err.contains("the hints were damaged"), "{}", said.err);
    });
}
