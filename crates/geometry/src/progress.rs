//! Progress of long computations, and how they end early: by what their progress says, or at a checkpoint.

use std::cell::RefCell;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use crate::fault::Fault;

/// Receives the progress of a computation and may stop it.
pub trait Progress: Sync {
    /// `done` of `total` equal steps. `false` stops the work.
    fn step(&self, done: u64, total: u64) -> bool;
}

/// Reports nothing and never stops.
pub struct Silent;

impl Progress for Silent {
    fn step(&self, _: u64, _: u64) -> bool {
        true
    }
}

/// A stage of a longer computation, which takes it from one share of the whole to another.
pub struct Stage<'a> {
    /// The progress of the whole.
    pub whole: &'a dyn Progress,
    /// The shares, 0 to 1, at which the stage begins and ends.
    pub from: f64,
    /// See `from`.
    pub to: f64,
}

impl Progress for Stage<'_> {
    fn step(&self, done: u64, total: u64) -> bool {
        const FINE: f64 = 1e6;
        let share = self.from + (self.to - self.from) * done as f64 / total.max(1) as f64;
        self.whole.step((share * FINE) as u64, FINE as u64)
    }
}

/// Why a computation ended without a result.
#[derive(Debug)]
pub enum Stopped {
    /// The progress said so.
    Interrupted,
    /// The output could not be written.
    Io(io::Error),
    /// The request cannot be met (a spacing too fine for single precision, an unbounded region …).
    Refused(Fault),
}

/// A request to end work that has no progress to ask: solvers come to a [`checkpoint`] in each of their rounds. What it shares
/// with its clones is whether it was made.
#[derive(Clone, Debug, Default)]
pub struct Cancellation(Arc<AtomicBool>);

thread_local! {
    /// The request that may end the work of this thread.
    static CURRENT: RefCell<Option<Cancellation>> = const { RefCell::new(None) };
}

/// What unwinds a thread from a checkpoint.
struct Cancelled;

impl Cancellation {
    /// Asks the work to end.
    pub fn cancel(&self) {
        self.0.store(true, Relaxed);
    }

    /// The request that may end the work of this thread, to be [entered](Cancellation::enter) by threads that share in it.
    pub fn current() -> Cancellation {
        CURRENT.with_borrow(|c| c.clone().unwrap_or_default())
    }

    /// Runs a part of the work on this thread: after the request it unwinds from its next checkpoint.
    pub fn enter<T>(&self, work: impl FnOnce() -> T) -> T {
        struct Restored(Option<Cancellation>);
        impl Drop for Restored {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _restored = Restored(CURRENT.replace(Some(self.clone())));
        work()
    }

    /// Runs `work` on this thread; `None` if it came to a checkpoint after the request.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        // What the work has built is dropped with it.
        match catch_unwind(AssertUnwindSafe(|| self.enter(work))) {
            Ok(made) => Some(made),
            Err(reason) if reason.is::<Cancelled>() => None,
            Err(panic) => resume_unwind(panic),
        }
    }
}

/// Ends the work that [`Cancellation::run`] or [`Cancellation::enter`] runs on this thread, if that was asked for; elsewhere
/// nothing happens. To be called where no lock is held.
pub fn checkpoint() {
    let asked = CURRENT.with_borrow(|c| c.as_ref().is_some_and(|c| c.0.load(Relaxed)));
    if asked {
        resume_unwind(Box::new(Cancelled));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancelled_work_ends_at_its_next_checkpoint() {
        let request = Cancellation::default();
        let mut rounds = 0;
        let made = request.run(|| {
            for _ in 0..10 {
                checkpoint();
                rounds += 1;
                if rounds == 3 {
                    request.cancel();
                }
            }
        });
        assert_eq!((made, rounds), (None, 3));
        assert_eq!(
            Cancellation::default().run(|| {
                checkpoint();
                7
            }),
            Some(7)
        );
        checkpoint(); // nothing is asked of this thread any more
    }

    #[test]
    fn a_panic_goes_on() {
        let panic = catch_unwind(|| Cancellation::default().run(|| -> () { panic!("as it is") }));
        assert_eq!(panic.err().and_then(|p| p.downcast_ref::<&str>().copied()), Some("as it is"));
    }
}
