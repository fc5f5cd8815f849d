//! Eight numbers in a row: what a vector unit takes at once.

use std::ops::{Add, AddAssign, Mul, Sub};

/// Numbers in a row.
pub const LANES: usize = 8;

/// A floating-point number: f64 for results, f32 for the preconditioner.
pub trait Real:
    Copy + Default + PartialEq + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + AddAssign
{
    /// The nearest number of this type.
    fn of(v: f64) -> Self;
    /// The same number in f64.
    fn wide(self) -> f64;
}

impl Real for f32 {
    #[inline(always)]
    fn of(v: f64) -> f32 {
        v as f32
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn of(v: f64) -> f64 {
        v
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}
