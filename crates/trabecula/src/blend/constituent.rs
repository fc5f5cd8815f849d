//! What may be blended: lattices, and fields of other kinds.

use std::sync::Arc;

use crate::implicit::Implicit;
use crate::lattice::Lattice;
use geometry::math::{Vec3, add, scale};

/// One of what is blended.
#[derive(Clone)]
pub enum Constituent {
    /// A lattice, by its core.
    Lattice(Arc<Lattice>),
    /// Any other field: solid where it is negative, and its fraction is measured in the windows about a point.
    Field {
        /// The field.
        field: Arc<dyn Implicit>,
        /// How long its cells are, mm.
        wavelength: f64,
    },
    /// A wall that is no lattice: the greater of its sides f − t and −f − t, by its core f.
    Wall {
        /// Both sides.
        sides: [Arc<dyn Implicit>; 2],
        /// t, where it does not vary.
        half: Option<f64>,
        /// How long its cells are, mm.
        wavelength: f64,
    },
}

impl Constituent {
    /// The lattice, if it is one.
    pub fn lattice(&self) -> Option<&Lattice> {
        match self {
            Constituent::Lattice(l) => Some(l),
            Constituent::Field { .. } | Constituent::Wall { .. } => None,
        }
    }

    /// Fills the core at points (mm).
    pub fn cores(&self, points: &[Vec3], out: &mut [f64]) {
        match self {
            Constituent::Lattice(l) => l.cores(points, out),
            Constituent::Field { field, .. } => field.values(points, out),
            Constituent::Wall { sides, .. } => {
                values_of(sides, points, out, |[a, b]| 0.5 * (a - b));
            }
        }
    }

    /// The greatest length of its cells, mm.
    pub fn longest(&self) -> f64 {
        match self {
            Constituent::Lattice(l) => l.map.longest(),
            Constituent::Field { wavelength, .. } | Constituent::Wall { wavelength, .. } => *wavelength,
        }
    }
}

/// Fills a function of two fields' values.
pub(super) fn values_of(
    sides: &[Arc<dyn Implicit>; 2],
    points: &[Vec3],
    out: &mut [f64],
    function: impl Fn([f64; 2]) -> f64,
) {
    let mut other = vec![0.0; points.len()];
    sides[0].values(points, out);
    sides[1].values(points, &mut other);
    (out.iter_mut().zip(other)).for_each(|(o, b)| *o = function([*o, b]));
}

/// Fills a multiple of the first field plus the second, and the gradient of the sum.
pub(super) fn gradients_of(
    sides: &[Arc<dyn Implicit>; 2],
    [first, second]: [f64; 2],
    points: &[Vec3],
    values: &mut [f64],
    gradients: &mut [Vec3],
) {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    sides[0].gradients(points, values, gradients);
    sides[1].gradients(points, &mut v, &mut g);
    for ((a, da), (b, db)) in values.iter_mut().zip(gradients).zip(v.into_iter().zip(g)) {
        *a = first * *a + second * b;
        *da = add(scale(*da, first), scale(db, second));
    }
}
