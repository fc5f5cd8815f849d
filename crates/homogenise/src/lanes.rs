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

/// Eight numbers.
#[derive(Clone, Copy, Default)]
pub struct Lanes<T>(pub [T; LANES]);

impl<T: Real> Lanes<T> {
    /// The first numbers of a slice of at least eight.
    #[inline(always)]
    pub fn load(from: &[T]) -> Self {
        let mut out = [T::default(); LANES];
        out.copy_from_slice(&from[..LANES]);
        Lanes(out)
    }

    /// Each number times `s`.
    #[inline(always)]
    pub fn times(mut self, s: T) -> Self {
        for v in &mut self.0 {
            *v = *v * s;
        }
        self
    }

    /// The numbers moved up by one, `first` before them; what was last is left out.
    #[inline(always)]
    pub fn shifted(self, first: T) -> Self {
        let [a, b, c, d, e, f, g, _] = self.0;
        Lanes([first, a, b, c, d, e, f, g])
    }
}

impl<T: Real> Add for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: Self) -> Self {
        for i in 0..LANES {
            self.0[i] += o.0[i];
        }
        self
    }
}

impl<T: Real> Sub for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: Self) -> Self {
        for i in 0..LANES {
            self.0[i] = self.0[i] - o.0[i];
        }
        self
    }
}

impl<T: Real> Mul for Lanes<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, o: Self) -> Self {
        for i in 0..LANES {
            self.0[i] = self.0[i] * o.0[i];
        }
        self
    }
}
