//! The carrier of a lattice over tetrahedra as a mesh for finite elements: each of its tetrahedra is a solid of less stiffness, by the solid
//! fraction of its cell.

use super::cyclic_nodes::PLANES;
use super::named_sets::{FLAT, add_regions, push};
use crate::conforming_tets::SurfaceSet;
use crate::map::tet_map::NONE;
use crate::region::Region;
use crate::tiling::Tiling;
use geometry::fault::Fault;
use geometry::fe_mesh::{FeMesh, fraction_classes};
use geometry::math::{Aabb, Mat3, Vec3, add, determinant, dot, inverse, norm, scale, sub, transpose};
use geometry::tetmesh::EDGES;
use std::collections::HashMap;

/// Iterations of a polar decomposition: quadratic once near, each before that at least halves what is off.
const ROUNDS: usize = 24;

/// What is known of the zones and the region of a carrier.
pub struct CarrierContext<'a> {
    /// Names of zones with their numbers; without any, the numbers are names.
    pub zones: Vec<(String, Vec<i64>)>,
    /// Regions whose surface is a set, by name.
    pub sets: &'a [(String, Region)],
    /// Bounds of the region.
    pub bounds: Aabb,
    /// 1 for linear tetrahedra, 2 for quadratic ones, whose boundary edges are bent onto the region's surface.
    pub order: u8,
}

/// The carrier of a lattice, and the zone of each of its domains, by its place in `of.zones`. Domains are classes of the solid fraction, in
/// each zone where there are several; sets are SURFACE, the bounding planes and the regions given.
///
/// # Errors
/// An empty set; more than 256 domains.
pub fn carrier(tiling: &Tiling, of: &CarrierContext) -> Result<(FeMesh, Vec<usize>), Fault> {
    let map = &*tiling.map;
    let shares = tiling.shares();
    let mut mesh = FeMesh { nodes: map.nodes().to_vec(), ..FeMesh::default() };
    let mut from = Vec::with_capacity(map.len());
    let mut zone_of = Vec::new();
    for (zone, (prefix, tets)) in zones(tiling, &of.zones).into_iter().enumerate() {
        let fractions: Vec<f64> = tets.iter().map(|t| shares[*t]).collect();
        for (name, members) in fraction_classes(&fractions) {
            let Ok(domain) = u8::try_from(mesh.domains.len()) else {
                let message = "zones and classes of the solid fraction make more than 256 domains; take fewer zones, or levels that vary less";
                return Err(Fault::new("", message));
            };
            mesh.domains.push(format!("{prefix}{name}"));
            zone_of.push(zone);
            mesh.domain.extend(members.iter().map(|_| domain));
            from.extend(members.iter().map(|i| tets[*i]));
        }
    }
    mesh.fraction = from.iter().map(|t| shares[*t]).collect();
    mesh.axes = from.iter().map(|t| axes(map.corners(*t))).collect();
    // Nodes of the map are ascending; here they are positive.
    let order = |t: usize| if map.flipped(t) { [0, 1, 3, 2] } else { [0, 1, 2, 3] };
    mesh.tets = from.iter().map(|t| order(*t).map(|c| map.tet(*t)[c])).collect();
    if of.order == 2 {
        let mut numbers = HashMap::new();
        for (t, own) in from.iter().zip(&mesh.tets) {
            let middles = EDGES.map(|e| {
                let [a, b] = e.map(|c| own[c]);
                *numbers.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let half = map.tet(*t).map(|n| if n == a || n == b { 0.5 } else { 0.0 });
                    mesh.nodes.push(map.place(*t, half));
                    mesh.nodes.len() as u32 - 1
                })
            });
            mesh.middles.push(middles);
        }
    }
    let faces: Vec<((u32, u8), SurfaceSet, bool)> = (0..from.len())
        .flat_map(|i| {
            let across = map.across(from[i]);
            let outer = order(from[i]).map(|c| across[c] == NONE);
            (0..4u8).filter(move |k| outer[*k as usize]).map(move |k| ((i as u32, k), 0, true))
        })
        .collect();
    push(&mut mesh, "SURFACE".into(), faces.iter().map(|f| f.0).collect());
    let near = FLAT * norm(of.bounds.size());
    for (axis, names) in PLANES.iter().enumerate() {
        for (name, at) in names.iter().zip([of.bounds.min[axis], of.bounds.max[axis]]) {
            let flat = |f: (u32, u8)| mesh.face(f).iter().all(|n| (mesh.nodes[*n as usize][axis] - at).abs() <= near);
            let of = faces.iter().map(|f| f.0).filter(|f| flat(*f)).collect();
            push(&mut mesh, (*name).into(), of);
        }
    }
    add_regions(&mut mesh, &faces, of.sets).map_or(Ok((mesh, zone_of)), Err)
}

/// The axes, one row each, of the body-centred cubic lattice whose tetrahedra a tetrahedron is most like: those along its two longest
/// opposite edges and along the line between their middles, made orthogonal by the nearest rotation (polar decomposition).
fn axes(corners: [Vec3; 4]) -> Mat3 {
    let edge = |[i, j]: [usize; 2]| sub(corners[j], corners[i]);
    let length = |pair: &[[usize; 2]; 2]| pair.iter().map(|e| dot(edge(*e), edge(*e))).sum::<f64>();
    let pairs = [[[0, 1], [2, 3]], [[0, 2], [1, 3]], [[0, 3], [1, 2]]];
    let [first, second] = pairs.into_iter().fold(pairs[0], |m, p| if length(&p) > length(&m) { p } else { m });
    let twice = |[i, j]: [usize; 2]| add(corners[i], corners[j]);
    // In a tetrahedron of that lattice these are as long as the cube's edge, and orthogonal.
    let mut rows = [edge(first), sub(twice(second), twice(first)), edge(second)];
    if determinant(&rows) < 0.0 {
        rows[2] = scale(rows[2], -1.0);
    }
    let size = determinant(&rows).cbrt();
    rows = rows.map(|r| scale(r, 1.0 / size));
    // Newton's iteration: the mean of a matrix and its inverse transposed tends to the rotation.
    for _ in 0..ROUNDS {
        let other = transpose(&inverse(&rows));
        rows = core::array::from_fn(|k| scale(add(rows[k], other[k]), 0.5));
    }
    rows
}

/// The tetrahedra of each zone, with what their domains' names begin with.
fn zones(tiling: &Tiling, named: &[(String, Vec<i64>)]) -> Vec<(String, Vec<usize>)> {
    let map = &*tiling.map;
    let mut numbers: Vec<i64> = (0..map.len()).map(|t| map.zone(t)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.len() < 2 {
        return vec![(String::new(), (0..map.len()).collect())];
    }
    let own = || numbers.iter().map(|n| (n.to_string(), vec![*n]));
    let named = if named.is_empty() { own().collect() } else { named.to_vec() };
    let word = |name: &str| -> String {
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' }).collect()
    };
    let members = |of: &[i64]| (0..map.len()).filter(|t| of.contains(&map.zone(*t))).collect();
    named.iter().map(|(name, of)| (format!("ZONE_{}_", word(name)), members(of))).collect()
}
