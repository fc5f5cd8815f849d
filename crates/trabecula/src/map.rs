//! Maps from position (mm) to phase (turns).

use crate::fault::Fault;
use crate::math::{Mat3, Vec3};

/// u = M x + b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// M, per mm.
    pub matrix: Mat3,
    /// b, turns.
    pub shift: Vec3,
}

/// A named shear: `(of, by, degrees)` moves axis `of` by tan(degrees) times coordinate `by`.
pub type Skew = (usize, usize, f64);

impl Affine {
    /// u = D Rᵀ (x − offset), after the shears are undone.
    pub fn rigid(wavelength: Vec3, rotate: Vec3, offset: Vec3, skew: &[Skew]) -> Result<Affine, Fault> {
        let _ = (wavelength, rotate, offset, skew);
        todo!()
    }

    /// u = Rᵀ D (x − offset): seed form of the SPARTAN note.
    pub fn spartan(wavelength: Vec3, rotate: Vec3, offset: Vec3) -> Result<Affine, Fault> {
        let _ = (wavelength, rotate, offset);
        todo!()
    }
}

/// A map.
#[derive(Clone, Debug)]
pub enum Map {
    /// u = M x + b.
    Affine(Affine),
}

impl Map {
    /// The smallest wavelength (mm): what `--per-cell` divides.
    pub fn wavelength(&self) -> f64 {
        todo!()
    }
}
