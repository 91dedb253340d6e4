//! Which records a sweep drops.

use std::collections::{BTreeMap, BTreeSet};

use crate::merge::WEEK;
use crate::sweep::Wanted;
use crate::{Digest, Record};

/// What is known of the use of records.
#[derive(Debug, Default)]
pub(crate) struct Uses {
    /// Keys whose records stay.
    pub(crate) roots: BTreeSet<Digest>,
    /// When a run last used a key.
    pub(crate) by_runs: BTreeMap<Digest, u64>,
    /// When a key was last written.
    pub(crate) written: BTreeMap<Digest, u64>,
}

/// Splits records into those that stay and those that go.
///
/// - `now`: as all times, in milliseconds since 1970.
/// - `others`: the bytes of what stays besides records and their outputs.
/// - `bytes`: those of a record, without an output that is an object.
pub(crate) fn select<'a>(
    records: impl Iterator<Item = &'a Record>,
    uses: &Uses,
    wanted: &Wanted,
    now: u64,
    others: u64,
    bytes: impl Fn(&Record) -> u64,
) -> (Vec<&'a Record>, Vec<&'a Record>) {
    let is_root = |record: &Record| {
        uses.roots.contains(&record.key) || wanted.locked.contains(&record.output.digest)
    };
    let used = |record: &Record| {
        let by_runs = uses.by_runs.get(&record.key);
        by_runs.or(uses.written.get(&record.key)).copied().unwrap_or(now)
    };
    let goes = |record: &Record| match (wanted.since, wanted.max_bytes, &wanted.runs) {
        (Some(since), _, _) => used(record) < since,
        (None, Some(_), _) | (None, None, None) => false,
        // What no run mentions may be of one that was killed, and goes on.
        (None, None, Some(_)) => {
            uses.by_runs.contains_key(&record.key) || used(record) < now.saturating_sub(WEEK)
        }
    };
    let (mut gone, mut kept): (Vec<_>, Vec<_>) =
        records.partition(|record| !is_root(record) && goes(record));
    if let Some(max) = wanted.max_bytes {
        let fits = fitting(&kept, max.saturating_sub(others), is_root, used, bytes);
        let (stay, go): (Vec<_>, Vec<_>) =
            kept.into_iter().enumerate().partition(|(i, _)| fits.contains(i));
        kept = stay.into_iter().map(|(_, record)| record).collect();
        gone.extend(go.into_iter().map(|(_, record)| record));
    }
    (kept, gone)
}

/// Which records stay so that all of them take at most `max` bytes: the roots, then those last
/// used, then those that took longest for their size.
fn fitting(
    records: &[&Record],
    max: u64,
    is_root: impl Fn(&Record) -> bool,
    used: impl Fn(&Record) -> u64,
    bytes: impl Fn(&Record) -> u64,
) -> BTreeSet<usize> {
    let mut order: Vec<usize> = (0..records.len()).collect();
    order.sort_by_cached_key(|i| {
        let record = records[*i];
        let cost = record.provenance.millis.saturating_mul(1 << 20) / record.output.size.max(1);
        std::cmp::Reverse((is_root(record), used(record), cost))
    });
    let (mut objects, mut total) = (BTreeSet::new(), 0_u64);
    let fits = |i: &usize| {
        let record = records[*i];
        total += bytes(record);
        // Records may share an object.
        if record.output.inline.is_none() && objects.insert(record.output.digest) {
            total += record.output.size;
        }
        total <= max || is_root(record)
    };
    order.into_iter().take_while(fits).collect()
}
