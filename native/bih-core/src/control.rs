//! Progress and cancellation of long work, shared between the worker threads and whoever waits for them.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The work was stopped because the caller asked for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Counts finished work items and carries the wish to stop.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: AtomicBool,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Control {
    /// Announce how many items there are.
    pub fn start(&self, total: usize) {
        self.total.store(total, Ordering::Relaxed);
    }

    /// Report `items` finished; an error asks the worker to stop.
    pub fn advance(&self, items: usize) -> Result<(), Cancelled> {
        self.done.fetch_add(items, Ordering::Relaxed);
        self.check()
    }

    /// An error asks the worker to stop.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// Ask every worker to stop at its next `advance`.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Share of the work that is done, from 0 to 1.
    pub fn fraction(&self) -> f64 {
        let total = self.total.load(Ordering::Relaxed).max(1);
        (self.done.load(Ordering::Relaxed) as f64 / total as f64).min(1.0)
    }
}
