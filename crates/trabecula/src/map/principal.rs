//! Principal directions of symmetric tensors, and how sure they are.

use geometry::math::{Mat3, Vec3, determinant, eigen, scale, transpose};

/// A share of the range in the part: a stress that is less counts as one of this size, so that its rounding has no
/// direction.
const LEAST: f64 = 1e-3;

/// Principal directions of a symmetric tensor, or those common to several.
#[derive(Clone, Copy)]
pub(super) struct Principal {
    /// The directions, as the columns of a right-handed frame.
    pub frame: Mat3,
    /// The principal values; of several tensors the roots of the mean squares of those along each direction.
    pub values: Vec3,
    /// The difference of the values of the other two directions, for each.
    pub apart: Vec3,
    /// The greatest absolute value.
    pub greatest: f64,
}

impl Principal {
    /// Of the tensor 11, 22, 33, 23, 13, 12.
    pub fn of(tensor: &[f64; 6]) -> Principal {
        let (v, axes) = eigen(&matrix(tensor));
        let frame = transpose(&axes);
        Principal {
            frame: if determinant(&frame) < 0.0 { frame.map(|r| r.map(|c| -c)) } else { frame },
            values: v,
            apart: [(v[1] - v[2]).abs(), (v[2] - v[0]).abs(), (v[0] - v[1]).abs()],
            greatest: v.iter().fold(0.0, |m, v| m.max(v.abs())),
        }
    }

    /// The greatest difference of two values.
    pub fn difference(&self) -> f64 {
        self.apart.into_iter().fold(0.0, f64::max)
    }

    /// How far each value is from the nearest other.
    pub fn gaps(&self) -> Vec3 {
        [0, 1, 2].map(|i| self.apart[(i + 1) % 3].min(self.apart[(i + 2) % 3]))
    }

    /// The same over the greatest value; `range` is that in the part.
    pub fn own_gaps(&self, range: f64) -> Vec3 {
        scale(self.gaps(), 1.0 / self.size(range))
    }

    /// The greatest absolute value, or what counts as the least; `range` is that in the part.
    pub fn size(&self, range: f64) -> f64 {
        self.greatest.max(LEAST * range)
    }
}

/// The matrix of the tensor 11, 22, 33, 23, 13, 12.
pub(super) fn matrix([xx, yy, zz, yz, xz, xy]: &[f64; 6]) -> Mat3 {
    [[*xx, *xy, *xz], [*xy, *yy, *yz], [*xz, *yz, *zz]]
}

/// The difference of two principal values that counts as large in a part: √3 times the root of the mean square of the greatest ones,
/// which is the greatest of all in a bent beam. A peak at a corner hardly changes it, nor do parts that carry nothing.
pub(super) fn range(found: &[Principal], outside: Option<&[f64]>) -> f64 {
    let counted = || found.iter().enumerate().filter(|(n, _)| outside.is_none_or(|d| d[*n] == 0.0));
    let squares: f64 = counted().map(|(_, p)| p.difference().powi(2)).sum();
    match counted().count() {
        // A thin part may have no node in it.
        0 => range(found, None),
        count => (3.0 * squares / count as f64).sqrt(),
    }
}
