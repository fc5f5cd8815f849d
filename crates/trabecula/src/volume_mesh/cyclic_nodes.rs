//! Periodic images: nodes of opposite bounding planes, tied from the beginning.

use rustc_hash::{FxHashMap, FxHashSet};

use super::body_centred::CubeGrid;
use crate::conforming_tets::{SurfaceSet, evaluated, images};
use crate::csg_tree::CsgSolid;
use crate::implicit::Surface;
use geometry::fault::{Fault, number, position};
use geometry::fe_mesh::{FeMesh, Pair};
use geometry::math::Vec3;

/// Greatest difference of a surface between opposite planes, as a fraction of its change along a cube.
const OFF: f64 = 1e-6;
/// Names of the bounding planes.
pub const PLANES: [[&str; 2]; 3] = [["X0", "X1"], ["Y0", "Y1"], ["Z0", "Z1"]];

/// The next image of each node, along cycles; itself without images.
///
/// # Errors
/// A lattice, or what fills its place, that differs between opposite planes; a region that is no box.
pub(super) fn cycles(
    cubes: &CubeGrid,
    planes: &[[Option<usize>; 2]; 3],
    nodes: &[Vec3],
    lattice: &[Surface],
    filled: &[CsgSolid],
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
        let near = OFF * cubes.step()[axis];
        let [a, b] = PLANES[axis];
        let at = [0, 1].map(|k| pairs.iter().map(|p| nodes[p[k] as usize]).collect::<Vec<Vec3>>());
        for surface in lattice {
            let [v, w] = at.each_ref().map(|p| evaluated(&*surface.field, p));
            let off = v.iter().zip(&w).map(|(v, w)| (v - w).abs()).fold(0.0, f64::max) / surface.lipschitz;
            if off > near {
                let message = format!(
                    "the lattice differs between {a} and {b} by about {} mm; the region must hold whole cells along each axis, and \
                     nothing may vary between them",
                    number(off)
                );
                return Err(Fault::new("periodic", message));
            }
        }
        for body in filled {
            let [v, w] = at.each_ref().map(|p| evaluated(body, p));
            let differs = |i: &usize| v[*i].min(w[*i]) < -near && v[*i].max(w[*i]) > near;
            if let Some(i) = (0..pairs.len()).find(differs) {
                let message = format!(
                    "a keep zone or skin is solid at {} and not at {}, its image; let it be the same at {a} and {b}, or reach neither",
                    position(at[usize::from(v[i] > 0.0)][i]),
                    position(at[usize::from(v[i] < 0.0)][i]),
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

/// Whether nodes and faces at opposite planes are the same in all bits, and pairs hold all nodes at upper ones, but for nodes that may lack
/// an image. `faces` are those of the boundary.
///
/// # Errors
/// They are not.
pub(super) fn matched(mesh: &FeMesh, cubes: &CubeGrid, faces: impl Iterator<Item = (u32, u8)>) -> Result<(), Fault> {
    let bounds = &cubes.bounds;
    let faces: Vec<[u32; 3]> = faces.map(|f| mesh.face(f)).collect();
    let paired: FxHashSet<u32> = mesh.pairs.iter().map(|p| p.node).collect();
    let off = |p: &&Pair| {
        let [at, image] = [p.node, p.image].map(|n| mesh.nodes[n as usize]);
        (0..3).any(|k| (at[k], image[k]) != if p.along[k] { (bounds.max[k], bounds.min[k]) } else { (at[k], at[k]) })
    };
    let strict: Vec<u32> =
        (0..mesh.nodes.len() as u32).filter(|n| !cubes.may_lack_image(mesh.nodes[*n as usize])).collect();
    for axis in 0..3 {
        // Adding zero makes the two zeros one.
        let key = |n: u32| [1, 2].map(|k| (mesh.nodes[n as usize][(axis + k) % 3] + 0.0).to_bits());
        let planes = [bounds.min, bounds.max].map(|bound| {
            let there = |n: &u32| mesh.nodes[*n as usize][axis] == bound[axis];
            let nodes: FxHashSet<[u64; 2]> = strict.iter().copied().filter(there).map(key).collect();
            let all = faces.iter().filter(|f| f.iter().all(there)).map(|f| {
                let mut corners = f.map(key);
                corners.sort_unstable();
                corners
            });
            (nodes, all.collect::<FxHashSet<[[u64; 2]; 3]>>())
        });
        let [(nodes, faces), (other_nodes, other_faces)] = &planes;
        let loose = strict.iter().filter(|n| mesh.nodes[**n as usize][axis] == bounds.max[axis] && !paired.contains(n));
        let torn = mesh.pairs.iter().filter(|p| p.along[axis]).filter(off);
        let nodes = nodes.symmetric_difference(other_nodes).count().max(loose.count()).max(torn.count());
        let faces = faces.symmetric_difference(other_faces).count();
        if nodes + faces > 0 {
            let [a, b] = PLANES[axis];
            let message = format!(
                "{nodes} nodes and {faces} triangles at {a} and {b} have no image on the other: the surface nearly touches these planes; \
                 use another edge, or move the lattice a little"
            );
            return Err(Fault::new("periodic", message));
        }
    }
    Ok(())
}
