//! Occupancy on a grid of cubic voxels.

use crate::math::Vec3;

/// Occupancy on a grid of cubic voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Voxels {
    /// Lower corner of the first voxel, mm.
    pub origin: Vec3,
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Number of voxels along x, y, z.
    pub shape: [usize; 3],
    /// 1 where the voxel's centre is solid, x fastest.
    pub solid: Vec<u8>,
}
