//! Long work in the background, while the calling thread reports progress and listens for Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bih_core::{Control, Error};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::errors::{BihError, Cancelled, to_exception};

/// How often the caller hears of the progress, and is heard where it wants to stop.
const INTERVAL: Duration = Duration::from_millis(5);

/// Run `work` without the interpreter lock, in `pool` or where none is given in the global one.
pub fn run<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    work: impl FnOnce(&Control) -> Result<T, Error> + Send,
) -> PyResult<T> {
    py.detach(|| in_pool(pool, || work(&Control::default()))).map_err(to_exception)
}

/// The same in a thread of its own. Every so often the calling thread, and no other, calls `progress` with the share
/// done; the work stops where that returns False or raises, or where a signal handler raises.
pub fn supervise<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Control) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let control = Control::default();
    report(progress, 0.0)?;
    let mut stopped = None;
    let is_done = AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        let caller = std::thread::current();
        let (shared_control, shared_done) = (&control, &is_done);
        let worker = std::thread::Builder::new()
            .spawn_scoped(scope, move || {
                let _wake = WakeOnDrop { done: shared_done, caller };
                in_pool(pool, || work(shared_control))
            })
            .map_err(|error| BihError::new_err(format!("threads: none could be started ({error})")))?;
        while !is_done.load(Ordering::Acquire) {
            py.detach(|| std::thread::park_timeout(INTERVAL));
            if stopped.is_none()
                && let Err(error) = py.check_signals().and_then(|()| report(progress, control.fraction()))
            {
                stopped = Some(error);
                control.cancel();
            }
        }
        Ok::<_, PyErr>(worker.join())
    })?;
    match (stopped, result) {
        (_, Err(panic)) => std::panic::resume_unwind(panic),
        (Some(error), Ok(_)) => Err(error),
        (None, Ok(result)) => {
            let value = result.map_err(to_exception)?;
            report(progress, 1.0)?;
            Ok(value)
        }
    }
}

/// Tells the caller that the work ended, also by a panic.
struct WakeOnDrop<'a> {
    done: &'a AtomicBool,
    caller: std::thread::Thread,
}

impl Drop for WakeOnDrop<'_> {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Release);
        self.caller.unpark();
    }
}

fn in_pool<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

fn report(progress: Option<&Bound<'_, PyAny>>, fraction: f64) -> PyResult<()> {
    let Some(progress) = progress else { return Ok(()) };
    let answer = progress.call1((fraction,))?;
    if matches!(answer.extract::<bool>(), Ok(false)) {
        return Err(Cancelled::new_err("cancelled by the progress callback"));
    }
    Ok(())
}
