//! Voxels of a solid as finite elements, each with its exact solid fraction.

use super::{VoxelGrid, voxel_fractions};
use crate::csg_tree::CsgSolid;
use crate::region::Region;
use crate::solid::Solid;
use geometry::fault::{Fault, number};
use geometry::fe_mesh::HexMesh;
use geometry::math::Vec3;
use geometry::progress::{Progress, Stopped};

/// Most voxels of a grid: their numbers fit 32 bits.
const MOST: f64 = 4e9;

/// The voxels of a solid over its region's bounds with edges of about `step` (mm), stretched so that a whole number fits, of which a share of
/// at least `least` is solid, in one piece. `sets` are regions by name: the faces whose centres are at most half a voxel outside are a set.
///
/// # Errors
/// A step too fine, no such voxel, an empty set, an interruption.
pub fn voxel_elements(
    solid: &Solid,
    sets: &[(String, Region)],
    (step, least): (f64, f64),
    progress: &dyn Progress,
) -> Result<HexMesh, Stopped> {
    let refused = |at: &str, message: String| Err(Stopped::Refused(Fault::new(at, message)));
    let bounds = solid.region.bounds();
    let counts = bounds.size().map(|s| (s / step - 1e-9).ceil().max(1.0));
    if counts.iter().product::<f64>() > MOST {
        let message =
            format!("a step of {} mm makes more than four thousand million voxels; use a greater one", number(step));
        return refused("step", message);
    }
    let shape = counts.map(|n| n as usize);
    let edges: Vec3 = core::array::from_fn(|a| bounds.size()[a] / counts[a]);
    let (surfaces, tree) = solid.surfaces();
    let grid = VoxelGrid { origin: bounds.min, step: edges, shape };
    let fractions = voxel_fractions(&CsgSolid { surfaces, tree }, &grid, progress)?;
    let mut mesh = HexMesh::of(&bounds, shape, &fractions, least);
    if mesh.hexes.is_empty() {
        let most = fractions.iter().fold(0.0f64, |m, f| m.max(*f));
        let message = format!("no voxel has a solid fraction of {} or more; the greatest is {most:.3}", number(least));
        return refused("least", message);
    }
    let faces = mesh.boundary();
    let middles: Vec<Vec3> = faces.iter().map(|f| mesh.middle(*f)).collect();
    let near = 0.5 * edges.into_iter().fold(0.0, f64::max);
    for (name, region) in sets {
        let mut depth = vec![0.0; middles.len()];
        region.values(&middles, &mut depth);
        let of: Vec<(u32, u8)> = faces.iter().zip(&depth).filter(|(_, d)| **d <= near).map(|(f, _)| *f).collect();
        if of.is_empty() {
            let nearest = depth.iter().fold(f64::INFINITY, |m, d| m.min(*d));
            let message = format!(
                "the set is empty: no face of the voxels lies within its region, the nearest is {nearest:.3} mm away; enlarge the \
                 region or move it"
            );
            return refused(&format!("set.{name}"), message);
        }
        mesh.add_set(name.clone(), of);
    }
    Ok(mesh)
}
