//! Values that parallel work computes once.

use std::sync::OnceLock;

/// The value of a cell, which `make` computes if it has none. Threads that ask at the same time may compute it each; the first is kept.
///
/// No lock is held meanwhile, as [`OnceLock::get_or_init`] would: a thread that waits for parallel work takes up other work, and where
/// this asks for the same value it would wait for itself.
pub fn computed<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    match cell.get() {
        Some(known) => known,
        None => {
            let made = make();
            cell.get_or_init(|| made)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_may_ask_for_what_it_computes() {
        let cell = OnceLock::new();
        let ask = || *computed(&cell, || 1);
        // As a thread does that takes up such work while it waits.
        let found = *computed(&cell, || rayon::join(ask, ask).0 + 1);
        assert_eq!((found, cell.get()), (1, Some(&1)), "the first is kept");
    }
}
