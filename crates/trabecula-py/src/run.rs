//! Long work off the interpreter: other Python threads run, Ctrl-C stops it, progress is reported on the calling thread.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use geometry::progress::{Cancellation, Progress};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

use crate::error;

/// How often signals are checked and progress is reported.
const TICK: Duration = Duration::from_millis(50);
/// How long an interrupt waits for work to come to a checkpoint.
const PATIENCE: Duration = Duration::from_millis(500);

/// Progress that the working threads write and the calling thread reads.
#[derive(Default)]
struct Shared {
    done: AtomicU64,
    total: AtomicU64,
    stop: AtomicBool,
}

impl Progress for Shared {
    fn step(&self, done: u64, total: u64) -> bool {
        self.done.fetch_max(done, Relaxed);
        self.total.store(total, Relaxed);
        !self.stop.load(Relaxed)
    }
}

/// Ends the processes that the work waits for: those of readers and meshers of other packages.
fn stop_children(py: Python<'_>) {
    let stop = || py.import("trabecula.io.children")?.call_method0("stop");
    drop(stop()); // the interrupt itself is what is raised
}

/// Whether this process was forked: the threads of its parent's pool are not in it.
static FORKED: AtomicBool = AtomicBool::new(false);

/// Has forks handled, where the system has these.
pub fn watch_forks(py: Python<'_>) -> PyResult<()> {
    let os = py.import("os")?;
    if !os.hasattr("register_at_fork")? {
        return Ok(());
    }
    let options = [("after_in_child", pyo3::wrap_pyfunction!(after_fork, py)?)].into_py_dict(py)?;
    os.call_method("register_at_fork", (), Some(&options)).map(drop)
}

/// In a forked process: what this thread does itself has this thread, work off the interpreter a pool of its own.
#[pyfunction]
fn after_fork() {
    FORKED.store(true, Relaxed);
    // Of this thread alone, so that nothing is started. It fails where the thread has a pool, as in the child of a child.
    if let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() {
        std::mem::forget(pool); // as long as the thread
    }
}

/// The pool of a forked process, by the number of the process.
static OWN: Mutex<Option<(u32, Arc<rayon::ThreadPool>)>> = Mutex::new(None);

/// All processors' threads, made once in each forked process.
fn own_pool() -> PyResult<Arc<rayon::ThreadPool>> {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, pool)) = own.as_ref().filter(|(of, _)| *of == process) {
        return Ok(pool.clone());
    }
    let built = rayon::ThreadPoolBuilder::new().build();
    let pool = Arc::new(built.map_err(|e| PyValueError::new_err(format!("threads cannot be started: {e}")))?);
    // That of a parent has threads no more, for which it would wait.
    std::mem::forget(own.replace((process, pool.clone())));
    Ok(pool)
}

/// The threads of a pool of their own, if a number is given.
fn pool(threads: Option<usize>) -> PyResult<Option<Arc<rayon::ThreadPool>>> {
    match threads {
        None if FORKED.load(Relaxed) => own_pool().map(Some),
        None => Ok(None),
        Some(n @ 1..=4096) => {
            let built = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            let pool = built.map_err(|e| PyValueError::new_err(format!("threads: {n} cannot be started: {e}")))?;
            Ok(Some(Arc::new(pool)))
        }
        Some(n) => Err(PyValueError::new_err(format!("threads is {n}; it must be from 1 to 4096"))),
    }
}

/// Runs `work`, which reports no progress, on `threads` threads (all processors if `None`). An interrupt ends it at its next
/// checkpoint; if none comes soon, it is left to itself and its result dropped.
pub fn run_apart<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads)?;
    py.detach(|| {
        let (finished, waiting) = channel::<()>();
        let request = Cancellation::default();
        let asked = request.clone();
        let work = move || {
            let _finished = finished; // dropped, and so signalled, even if the work panics
            match pool {
                Some(pool) => pool.install(|| asked.run(work)),
                None => asked.run(work),
            }
        };
        let worker = std::thread::Builder::new().spawn(work)?;
        while let Err(RecvTimeoutError::Timeout) = waiting.recv_timeout(TICK) {
            let raised = Python::attach(|py| py.check_signals().inspect_err(|_| stop_children(py)));
            if let Err(interrupt) = raised {
                request.cancel();
                let _ = waiting.recv_timeout(PATIENCE); // whichever comes first
                return Err(interrupt);
            }
        }
        let made = worker.join().map_err(error::internal)?;
        made.ok_or_else(|| PyKeyboardInterrupt::new_err(()))
    })
}

/// Runs `work` on `threads` threads (all processors if `None`), calling `tell(done, total)` now and then. An interrupt ends it at its
/// next report of progress or checkpoint.
pub fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    tell: Option<Py<PyAny>>,
    work: impl FnOnce(&dyn Progress) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let shared = Shared::default();
    let shared = &shared;
    py.detach(|| {
        std::thread::scope(|scope| {
            let (finished, waiting) = channel::<()>();
            let request = Cancellation::default();
            let asked = request.clone();
            let work = move || {
                let _finished = finished; // dropped, and so signalled, even if the work panics
                match pool {
                    Some(pool) => pool.install(|| asked.run(|| work(shared))),
                    None => asked.run(|| work(shared)),
                }
            };
            let worker = std::thread::Builder::new().spawn_scoped(scope, work)?;
            let mut raised = None;
            let mut reported = 0;
            while let Err(RecvTimeoutError::Timeout) = waiting.recv_timeout(TICK) {
                if raised.is_some() {
                    continue;
                }
                let news = Python::attach(|py| {
                    py.check_signals().inspect_err(|_| stop_children(py))?;
                    let (done, total) = (shared.done.load(Relaxed), shared.total.load(Relaxed));
                    if let Some(tell) = &tell
                        && total > 0
                        && done != reported
                    {
                        reported = done;
                        tell.call1(py, (done, total))?;
                    }
                    Ok(())
                });
                if let Err(e) = news {
                    shared.stop.store(true, Relaxed);
                    request.cancel();
                    raised = Some(e);
                }
            }
            let result = worker.join().map_err(error::internal);
            match raised {
                Some(e) => Err(e),
                None => result?.ok_or_else(|| PyKeyboardInterrupt::new_err(())),
            }
        })
    })
}
