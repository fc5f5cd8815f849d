//! Periodic images: nodes of opposite bounding planes, tied from the beginning.

use rustc_hash::FxHashMap;

use super::body_centred::Cubes;
use crate::conforming_tets::SurfaceSet;
use crate::conforming_tets::images;
use crate::implicit::Surface;
use geometry::fault::{Fault, number};
use geometry::fe_mesh::Pair;
use geometry::math::Vec3;

/// Greatest difference of a surface between opposite planes, as a fraction of its change along a cube.
const OFF: f64 = 1e-6;
/// Names of the bounding planes.
pub const PLANES: [[&str; 2]; 3] = [["X0", "X1"], ["Y0", "Y1"], ["Z0", "Z1"]];

/// The next image of each node, along cycles; itself without images.
///
/// # Errors
/// A surface that differs between opposite planes; a region that is no box.
pub(super) fn cycles(
    cubes: &Cubes,
    planes: &[[Option<usize>; 2]; 3],
    nodes: &[Vec3],
    surfaces: &[Surface],
    lattice: usize,
) -> Result<Vec<u32>, Fault> {
    if planes.iter().flatten().any(Option::is_none) {
        return Err(Fault::new(
            "periodic",
            "a periodic mesh needs a box as its region, with whole cells along each axis",
        ));
    }
    let mut next: Vec<u32> = (0..nodes.len() as u32).collect();
    for axis in 0..3 {
        let (lo, hi) = (cubes.bounds.min[axis], cubes.bounds.max[axis]);
        let key = |p: &Vec3| [p[(axis + 1) % 3].to_bits(), p[(axis + 2) % 3].to_bits()];
        let low: FxHashMap<[u64; 2], u32> =
            (0..).zip(nodes).filter(|(_, p)| p[axis] == lo).map(|(i, p)| (key(p), i)).collect();
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for (i, p) in (0..).zip(nodes).filter(|(_, p)| p[axis] == hi) {
            if let Some(image) = low.get(&key(p)) {
                pairs.push([*image, i]);
                if !images(&next, i).any(|n| n == *image) {
                    next.swap(i as usize, *image as usize);
                }
            }
        }
        let step = cubes.step()[axis];
        for surface in &surfaces[lattice..] {
            let at = |k: usize| -> Vec<Vec3> { pairs.iter().map(|p| nodes[p[k] as usize]).collect() };
            let [v, w] = [at(0), at(1)].map(|p| crate::conforming_tets::evaluated(&*surface.field, &p));
            let off = v.iter().zip(&w).map(|(v, w)| (v - w).abs()).fold(0.0, f64::max) / surface.lipschitz;
            if off > OFF * step {
                let [a, b] = PLANES[axis];
                let message = format!(
                    "the lattice differs between {a} and {b} by about {} mm; the region must hold whole cells along each axis, and \
                     nothing may vary between them",
                    number(off)
                );
                return Err(Fault::new("periodic", message));
            }
        }
    }
    Ok(next)
}

/// The pairs of nodes with images, each tied to the one on no upper plane.
pub(super) fn pairs(nodes: &[Vec3], on: &[SurfaceSet], next: &[u32], upper: [SurfaceSet; 3]) -> Vec<Pair> {
    let along = |n: u32| upper.map(|s| on[n as usize] & s != 0);
    let mut out = Vec::new();
    for n in 0..nodes.len() as u32 {
        if along(n) != [false; 3]
            && let Some(image) = images(next, n).find(|m| along(*m) == [false; 3])
        {
            out.push(Pair { node: n, image, along: along(n) });
        }
    }
    out
}
