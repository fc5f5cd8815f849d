//! Fourier series.
use crate::fault::Fault;
use crate::math::Vec3;

/// amplitude · cos 2π(h·u + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Integers (h, k, l).
    pub hkl: [i32; 3],
    /// Amplitude.
    pub amplitude: f64,
    /// Phase in turns.
    pub phase: f64,
}

/// A sum of terms.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    terms: Vec<Term>,
}

impl Series {
    /// A series from terms; refuses an empty or constant one, non-finite numbers and |h| > 64.
    pub fn new(terms: Vec<Term>) -> Result<Series, Fault> {
        Ok(Series { terms })
    }

    /// The terms.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Values and gradients (per turn) at phases `u` (turns).
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let _ = (u, values, gradients);
        todo!()
    }
}
