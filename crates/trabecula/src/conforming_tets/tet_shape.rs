//! Shape measure of a tetrahedron while nodes are moved.

use geometry::math::Vec3;
use geometry::tetmesh::{tet_quality::dihedral_cosines, volume};

/// The dihedral angles (degrees) at which a shape counts 1: the least and the greatest that isosurface stuffing of a uniform lattice may
/// leave, by enumeration of all cuts (Labelle & Shewchuk 2007). Here they are a scale, and what meshes of smooth surfaces are tested for.
pub const ANGLES: [f64; 2] = [10.7, 164.8];

/// 1 where the worst dihedral angle is one of `ANGLES`, more where all are better (16 in a regular tetrahedron); a small
/// angle and one short of 180 degrees count by the squares of what they are short of. Negative without volume.
pub(crate) fn shape(p: [Vec3; 4]) -> f64 {
    let [small, large] = shapes(p);
    small.min(large)
}

/// The same of its least and of its greatest angle.
pub(super) fn shapes(p: [Vec3; 4]) -> [f64; 2] {
    // 1 − cos 10.7°, 1 + cos 164.8°.
    const SMALL: f64 = 0.017_387;
    const LARGE: f64 = 0.034_984;
    let v = volume(p);
    if v <= 0.0 {
        return [-1.0; 2];
    }
    // NaN, of a face without area, counts as bad.
    let known = |part: f64| if part.is_nan() { -1.0 } else { part };
    let cosines = dihedral_cosines(p).into_iter();
    cosines.fold([f64::INFINITY; 2], |m, c| [m[0].min(known((1.0 - c) / SMALL)), m[1].min(known((1.0 + c) / LARGE))])
}
