//! Voxels of a solid.

use geometry::fault::Fault;
use geometry::progress::{Progress, Stopped};
use geometry::voxels::Voxels;
use rayon::prelude::*;

use super::sampling_grid::Grid;
use crate::field::{Block, Field};
use crate::solid::Solid;

/// Voxels of edge `step` (mm) that cover the region's bounds, centred on them.
///
/// # Errors
/// A step or region for which no grid can be made; more than 2³³ voxels; an interruption.
pub fn voxels(solid: &Solid, step: f64, progress: &dyn Progress) -> Result<Voxels, Stopped> {
    Grid::new(solid, step).map_err(|f| Stopped::Refused(Fault::new("step", f.message)))?;
    let bounds = solid.region.bounds();
    let shape = bounds.size().map(|s| (s / step - 1e-9).ceil().max(1.0) as usize);
    let count = shape.iter().map(|&n| n as f64).product::<f64>();
    if count > (1u64 << 33) as f64 {
        let message = format!(
            "{step} mm makes {count:.2e} voxels; at most 8.6e9 are possible: use a step above {:.3} mm",
            step * (count / 8e9).cbrt()
        );
        return Err(Stopped::Refused(Fault::new("step", message)));
    }
    let extent = shape.map(|n| n as f64 * step);
    let origin = [0, 1, 2].map(|a| bounds.center()[a] - extent[a] / 2.0);
    let axes = [0, 1, 2].map(|a| (0..shape[a]).map(|i| origin[a] + (i as f64 + 0.5) * step).collect::<Vec<f64>>());
    let mut out = Voxels { origin, step, shape, solid: vec![0; shape.iter().product()] };
    let layer = shape[0] * shape[1];
    let slab = (layer * rayon::current_num_threads()).max(1);
    for (n, layers) in out.solid.chunks_mut(slab).enumerate() {
        layers.par_chunks_mut(layer).enumerate().for_each(|(i, layer)| {
            let z = n * rayon::current_num_threads() + i;
            let block = Block { axes: [&axes[0], &axes[1], &axes[2][z..=z]] };
            let mut samples = vec![0f32; layer.len()];
            solid.fill(&block, &mut samples);
            for (o, v) in layer.iter_mut().zip(&samples) {
                *o = u8::from(*v <= 0.0);
            }
        });
        if !progress.step((n + 1) as u64, shape[2].div_ceil(slab / layer) as u64) {
            return Err(Stopped::Interrupted);
        }
    }
    Ok(out)
}
