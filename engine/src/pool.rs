//! The threads of a run.

/// Threads, so many if the system starts them.
pub(crate) fn pool(threads: usize) -> rayon::ThreadPool {
    let threads = threads.max(1);
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(_) if threads > 1 => pool(threads / 2),
        Err(error) => panic!("the system starts no thread: {error}"),
    }
}
