//! Voxels of a solid.

use std::ops::Range;

use geometry::fault::Fault;
use geometry::math::Vec3;
use geometry::progress::{Progress, Stopped};
use geometry::voxels::Voxels;
use rayon::prelude::*;

use super::sampling_grid::SamplingGrid;
use crate::field::{Block, Field};
use crate::solid::Solid;

/// The voxels that cover a region's bounds, centred on them.
pub struct VoxelCentres {
    /// Lower corner of the first voxel, mm.
    pub origin: Vec3,
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Voxels along x, y, z.
    pub shape: [usize; 3],
    /// Their centres along the axes, mm.
    axes: [Vec<f64>; 3],
}

impl VoxelCentres {
    /// Voxels of edge `step` (mm) of a solid.
    ///
    /// # Errors
    /// A step or region for which no grid can be made.
    pub fn new(solid: &Solid, step: f64) -> Result<VoxelCentres, Fault> {
        SamplingGrid::new(solid, step).map_err(|f| Fault::new("step", f.message))?;
        let bounds = solid.region.bounds();
        let shape = bounds.size().map(|s| (s / step - 1e-9).ceil().max(1.0) as usize);
        let extent = shape.map(|n| n as f64 * step);
        let origin = [0, 1, 2].map(|a| bounds.center()[a] - extent[a] / 2.0);
        let axes = [0, 1, 2].map(|a| (0..shape[a]).map(|i| origin[a] + (i as f64 + 0.5) * step).collect());
        Ok(VoxelCentres { origin, step, shape, axes })
    }

    /// Number of voxels.
    pub fn count(&self) -> f64 {
        self.shape.iter().map(|&n| n as f64).product()
    }

    /// The voxels in some layers normal to z, x fastest: 1 where the centre is solid, else 0.
    ///
    /// # Errors
    /// An interruption.
    pub fn layers(&self, solid: &Solid, z: Range<usize>, progress: &dyn Progress) -> Result<Vec<u8>, Stopped> {
        let layer = self.shape[0] * self.shape[1];
        let mut out = vec![0; layer * z.len()];
        let at_once = rayon::current_num_threads();
        let total = z.len().div_ceil(at_once) as u64;
        for (n, layers) in out.chunks_mut((layer * at_once).max(1)).enumerate() {
            layers.par_chunks_mut(layer).enumerate().for_each(|(i, layer)| {
                let z = z.start + n * at_once + i;
                let block = Block { axes: [&self.axes[0], &self.axes[1], &self.axes[2][z..=z]] };
                let mut samples = vec![0f32; layer.len()];
                solid.fill(&block, &mut samples);
                for (o, v) in layer.iter_mut().zip(&samples) {
                    *o = u8::from(*v <= 0.0);
                }
            });
            if !progress.step((n + 1) as u64, total) {
                return Err(Stopped::Interrupted);
            }
        }
        Ok(out)
    }
}

/// Voxels of edge `step` (mm) that cover the region's bounds, centred on them.
///
/// # Errors
/// A step or region for which no grid can be made; more than 2³³ voxels; an interruption.
pub fn voxels(solid: &Solid, step: f64, progress: &dyn Progress) -> Result<Voxels, Stopped> {
    let grid = VoxelCentres::new(solid, step).map_err(Stopped::Refused)?;
    let count = grid.count();
    if count > (1u64 << 33) as f64 {
        let message = format!(
            "{step} mm makes {count:.2e} voxels, and at most 8.6e9 are held in memory: use a step above {:.3} mm, or write them in layers \
             (--resume, Solid.save_voxels)",
            step * (count / 8e9).cbrt()
        );
        return Err(Stopped::Refused(Fault::new("step", message)));
    }
    let solid = grid.layers(solid, 0..grid.shape[2], progress)?;
    Ok(Voxels { origin: grid.origin, step, shape: grid.shape, solid })
}
