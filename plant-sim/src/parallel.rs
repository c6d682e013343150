//! The same work on every item of a list, on several threads.

use std::num::NonZero;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// What `work` makes of each item, in their order, on `jobs` threads, or as many as there are items.
pub(crate) fn map<I: Sync, O: Send + Sync>(
    items: &[I],
    jobs: NonZero<usize>,
    work: impl Fn(&I) -> O + Sync,
) -> Vec<O> {
    map_with(items, jobs, || (), |(), item| work(item))
}

/// The same, where each thread keeps what `begin` gives it from one item to the next; they come to it in their order.
pub(crate) fn map_with<I: Sync, O: Send + Sync, T>(
    items: &[I],
    jobs: NonZero<usize>,
    begin: impl Fn() -> T + Sync,
    work: impl Fn(&mut T, &I) -> O + Sync,
) -> Vec<O> {
    let next = AtomicUsize::new(0);
    let results: Vec<OnceLock<O>> = items.iter().map(|_| OnceLock::new()).collect();
    thread::scope(|scope| {
        for _ in 0..jobs.get().min(items.len()) {
            scope.spawn(|| {
                let mut own = begin();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { break };
                    let _ = results[index].set(work(&mut own, item));
                }
            });
        }
    });
    results
        .into_iter()
        .map(OnceLock::into_inner)
        .map(|result| result.expect("every index was taken by a thread"))
        .collect()
}
