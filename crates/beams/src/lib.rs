//! Beam lattices: a graph of hub balls joined by quadrics of revolution, with quadric fillets, exact as an implicit function,
//! as parametric faces, in plane slices and in volume integrals.
//!
//! Lengths are mm; negative is solid.

pub mod graph;
pub mod pattern;
pub mod quador;

use geometry::math::Vec3;

/// A number at every position: fills the second slice with the values at the points (mm) of the first, of equal length.
pub type Values<'a> = &'a (dyn Fn(&[Vec3], &mut [f64]) + Sync);
