//! The same asked of many, by several threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// What `of` makes of each item, in their order.
///
/// - `n`: the most threads, the own among them.
pub(crate) fn at_once<T: Sync, R: Send>(
    n: usize,
    items: &[T],
    of: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let n = n.min(items.len());
    if n <= 1 {
        return items.iter().map(of).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut own = Vec::new();
        while let i = next.fetch_add(1, Ordering::Relaxed)
            && let Some(item) = items.get(i)
        {
            own.push((i, of(item)));
        }
        own
    };
    let mut all = thread::scope(|scope| {
        let spawn = |_| thread::Builder::new().spawn_scoped(scope, work);
        // Where no more can be started, those that were do it all.
        let others: Vec<_> = (1..n).map_while(|i| spawn(i).ok()).collect();
        let mut all = work();
        for other in others {
            all.extend(other.join().expect("what is asked does not panic"));
        }
        all
    });
    all.sort_unstable_by_key(|(i, _)| *i);
    all.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        let items: Vec<usize> = (0..1000).collect();
        for n in [0, 1, 7, 2000] {
            let doubled: Vec<usize> = items.iter().map(|i| 2 * i).collect();
            assert_eq!(at_once(n, &items, |i| 2 * i), doubled);
        }
    }

    #[test]
    fn so_many_are_asked_at_once() {
        let all = Barrier::new(8);
        // Ends only if all eight wait at the same time.
        at_once(8, &[(); 8], |()| all.wait().is_leader());
    }
}
