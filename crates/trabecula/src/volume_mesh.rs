//! Volume meshes: tetrahedra of a solid, of the pore or of both, that conform to its surfaces, edges and corners.
//!
//! A body-centred background that ends exactly at the region's bounding planes is cut along each implicit surface in turn, and shapes
//! are improved (`conforming_tets.rs`); the volume that chords cut off is balanced.

use geometry::fault::{Fault, number};
use geometry::fe_mesh::FeMesh;
use geometry::math::{Aabb, Vec3};
use geometry::progress::{Progress, Stopped};
use geometry::tetmesh::{self, FACES};
use geometry::union_find::{find, singles, unite};
use rayon::prelude::*;

use crate::conforming_tets::{
    FilledLayers, GONE, Partition, Shaping, SurfaceSet, Tet, components, images, interfaces, only, prepared,
};
use crate::region::Region;
use crate::solid::Solid;

mod body_centred;
mod carrier;
mod cyclic_nodes;
mod deviation;
mod domains;
mod mid_nodes;
mod named_sets;

use body_centred::CubeGrid;
pub use carrier::{CarrierContext, carrier};
pub(crate) use cyclic_nodes::PLANES;
use domains::Domains;
pub use domains::VolumeTarget;
pub use named_sets::is_own_name;

/// Most cubes of the background.
const CUBES: f64 = 4e9;

/// The most backgrounds that are tried for a periodic cell, each finer than the one before: where a surface nearly touches a bounding plane,
/// its chords may touch it at one image alone.
const BACKGROUNDS: usize = 8;

/// How a volume mesh is made.
#[derive(Clone, Debug)]
pub struct VolumeMeshOptions {
    /// Edge of the background's cubes (mm): the longest edges of tetrahedra; twelve tetrahedra fill a cube.
    pub edge: f64,
    /// What is meshed.
    pub of: VolumeTarget,
    /// 1 for linear tetrahedra, 2 for quadratic ones.
    pub order: u8,
    /// Whether nodes and faces on opposite bounding planes match.
    pub periodic: bool,
    /// Whether components other than the largest are left out: loose ones are held by no support. Of one domain that is not periodic.
    pub largest: bool,
}

/// A volume mesh and how good it is.
#[derive(Clone, Debug)]
pub struct MeshedVolume {
    /// The mesh.
    pub mesh: FeMesh,
    /// Greatest distance of its boundary from the surface (mm), at corners, edges and centroids of faces.
    pub deviation: f64,
    /// Edges of quadratic tetrahedra that stayed straight because a tetrahedron would be distorted.
    pub straight: usize,
    /// Connected components.
    pub pieces: usize,
    /// Volume that was left out: small components, flat tetrahedra, and where the boundary would touch itself (mm³).
    pub dropped: f64,
    /// Volume of the components other than the largest that were left out because that was asked for (mm³).
    pub loose: f64,
    /// Edges of the background's cubes, stretched so that a whole number fits (mm).
    pub step: Vec3,
}

/// The surfaces of the region's bounding planes: lower and upper, for each axis.
type Planes = [[Option<usize>; 2]; 3];

/// What has names in a solid.
#[derive(Clone, Copy)]
pub struct SolidNames<'a> {
    /// Names of what is solid whatever the lattice says, in the order of the solid.
    pub bodies: &'a [String],
    /// Regions whose surface is a set, by name.
    pub sets: &'a [(String, Region)],
}

/// The volume mesh of a solid with sets by what is named. The same for any number of threads.
///
/// # Errors
/// An edge too fine; a side of what is no sheet; periodic where the solid is not; nothing to mesh; an empty set of the solid's surface;
/// an interruption.
pub fn volume_mesh(
    solid: &Solid,
    named: &SolidNames,
    options: &VolumeMeshOptions,
    progress: &dyn Progress,
) -> Result<MeshedVolume, Stopped> {
    let by_patches = (!options.periodic).then_some(options.edge);
    let domains = Domains::new(solid, options.of, by_patches).map_err(Stopped::Refused)?;
    let bounds = solid.region.bounds();
    let planes = bounding_planes(&domains, &bounds);
    let mut cubes = CubeGrid::new(&bounds, planes.map(|p| p.map(|p| p.is_some())), options.edge);
    if cubes.count.iter().map(|n| *n as f64).product::<f64>() > CUBES {
        let m = format!(
            "an edge of {} mm makes more than four thousand million cubes; use a greater one",
            number(options.edge)
        );
        return Err(Stopped::Refused(Fault::new("edge", m)));
    }
    let total = domains.own as u64 + 18;
    let done = std::sync::atomic::AtomicU64::new(0);
    let goes_on = || progress.step(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed).min(total), total);
    let mut partition = cut(&domains, &cubes, &planes, options, &goes_on)?;
    if options.periodic {
        for _ in 1..BACKGROUNDS {
            if partition.is_periodic(&|p| cubes.may_lack_image(p)) {
                break;
            }
            cubes = cubes.finer();
            partition = cut(&domains, &cubes, &planes, options, &goes_on)?;
        }
    }
    let step = cubes.step().into_iter().fold(0.0, f64::max);
    // Of a periodic cell components hold together by images.
    let one = options.of != VolumeTarget::All && !options.periodic;
    let (mut shaping, mut dropped) = prepared(partition, one);
    if shaping.tets.is_empty() {
        let m = format!(
            "nothing to mesh: no tetrahedron of edge {} mm lies in it; use a smaller edge",
            number(options.edge)
        );
        return Err(Stopped::Refused(Fault::new("edge", m)));
    }
    let mut whole = shaping.improve(&goes_on);
    if whole && !options.periodic && shaping.follow_creases(step) {
        whole = shaping.improve(&goes_on);
    }
    if !whole {
        return Err(Stopped::Interrupted);
    }
    shaping.mend();
    if options.of != VolumeTarget::All {
        dropped += shaping.shell(false);
        if shaping.mend() {
            dropped += shaping.shell(false);
        }
    }
    let loose = if options.largest && one { keep_largest(&mut shaping) } else { 0.0 };
    if options.order == 1 {
        shaping.balance(false, &FilledLayers::default());
    }
    let mut made =
        assembled(shaping, &domains, (&planes, &bounds, &cubes), named, options).map_err(Stopped::Refused)?;
    (made.dropped, made.loose, made.step) = (dropped, loose, cubes.step());
    Ok(made)
}

/// Leaves out all components but that of the greatest volume, of equal ones the first; the volume of the others.
fn keep_largest(shaping: &mut Shaping) -> f64 {
    let mut root = singles(shaping.nodes.len());
    let kept = |t: &&[u32; 4]| **t != GONE;
    for t in shaping.tets.iter().filter(kept) {
        t[1..].iter().for_each(|n| {
            unite(&mut root, t[0], *n);
        });
    }
    let mut volumes = vec![0.0; shaping.nodes.len()];
    for (i, t) in (0..).zip(&shaping.tets).filter(|(_, t)| **t != GONE) {
        volumes[find(&mut root, t[0]) as usize] += tetmesh::volume(shaping.corners(i));
    }
    let largest = (0..volumes.len()).fold(0, |m, i| if volumes[i] > volumes[m] { i } else { m }) as u32;
    for t in shaping.tets.iter_mut().filter(|t| **t != GONE) {
        if find(&mut root, t[0]) != largest {
            *t = GONE;
        }
    }
    volumes.iter().sum::<f64>() - volumes.get(largest as usize).copied().unwrap_or(0.0)
}

/// The planes at the region's bounds that all domains lie behind.
fn bounding_planes(domains: &Domains, bounds: &Aabb) -> Planes {
    let mut planes = [[None; 2]; 3];
    for tree in &domains.trees {
        tree.for_each_bounding(&mut |s| {
            if let Some(p) = domains.surfaces[s].plane {
                let side = usize::from(p.below);
                if p.at == [bounds.min, bounds.max][side][p.axis] {
                    planes[p.axis][side] = Some(s);
                }
            }
        });
    }
    planes
}

/// The background where a domain may be, on the inner side of the bounding planes.
fn background<'a>(domains: &'a Domains, cubes: &CubeGrid, planes: &Planes) -> Partition<'a> {
    let matters = |b: &Aabb| domains.trees.iter().any(|t| t.bound(&|s| domains.surfaces[s].field.bound(b)).lo <= 0.0);
    let (nodes, tets) = cubes.tetrahedra(&cubes.active(&matters));
    let mut on = vec![0; nodes.len()];
    let mut negative: SurfaceSet = 0;
    for (axis, sides) in planes.iter().enumerate() {
        for (side, s) in sides.iter().enumerate() {
            let Some(s) = s else { continue };
            negative |= only(*s);
            let at = [cubes.bounds.min, cubes.bounds.max][side][axis];
            on.iter_mut().zip(&nodes).filter(|(_, p)| p[axis] == at).for_each(|(on, _)| *on |= only(*s));
        }
    }
    let next = (0..nodes.len() as u32).collect();
    let tets = tets.into_iter().map(|nodes| Tet { nodes, negative, positive: 0 }).collect();
    Partition { surfaces: &domains.surfaces, patched: &domains.patched, trees: &domains.trees, nodes, on, next, tets }
}

/// The background, cut along all surfaces.
///
/// # Errors
/// Periodic where the solid is not; an interruption.
fn cut<'a>(
    domains: &'a Domains,
    cubes: &CubeGrid,
    planes: &Planes,
    options: &VolumeMeshOptions,
    goes_on: &dyn Fn() -> bool,
) -> Result<Partition<'a>, Stopped> {
    let mut partition = background(domains, cubes, planes);
    if options.periodic {
        let lattice = &partition.surfaces[domains.lattice..];
        partition.next = cyclic_nodes::cycles(cubes, planes, &partition.nodes, lattice, &domains.filled)
            .map_err(Stopped::Refused)?;
    }
    let step = cubes.step().into_iter().fold(0.0, f64::max);
    let structural: Vec<usize> = planes.iter().flatten().flatten().copied().collect();
    for s in (0..domains.own).filter(|s| !structural.contains(s)) {
        if !goes_on() {
            return Err(Stopped::Interrupted);
        }
        partition.cut(s, step);
    }
    Ok(partition)
}

/// The improved mesh with sets, pairs and, of order 2, nodes on edges.
fn assembled(
    shaping: Shaping,
    domains: &Domains,
    (planes, bounds, cubes): (&Planes, &Aabb, &CubeGrid),
    named: &SolidNames,
    options: &VolumeMeshOptions,
) -> Result<MeshedVolume, Fault> {
    let Shaping { surfaces, mut nodes, mut on, next, tets, domain, .. } = shaping;
    let mut order: Vec<u32> = (0..tets.len() as u32).filter(|t| tets[*t as usize] != GONE).collect();
    order.sort_by_key(|t| domain[*t as usize]);
    let mut tets: Vec<[u32; 4]> = order.iter().map(|t| tets[*t as usize]).collect();
    let domain: Vec<u8> = order.iter().map(|t| domain[*t as usize]).collect();
    let next = compacted(&mut nodes, &mut on, next, &mut tets);
    let mut faces = faces_on_surfaces(&tets, &domain, &on);
    let upper = core::array::from_fn(|a| planes[a][1].map_or(0, only));
    let mut pairs = if options.periodic { cyclic_nodes::pairs(&nodes, &on, &next, upper) } else { Vec::new() };
    let (mut middles, mut straight) = (Vec::new(), 0);
    let corners = nodes.len() as u32;
    if options.order == 2 {
        let sets: Vec<([u32; 3], SurfaceSet)> =
            faces.iter().map(|((t, k), set, _)| (FACES[*k as usize].map(|c| tets[*t as usize][c]), *set)).collect();
        let mids = mid_nodes::mid_nodes(surfaces, &nodes, &next, &tets, &sets);
        if options.periodic {
            let along = |n: u32| upper.map(|s: SurfaceSet| on[n as usize] & s != 0);
            let tied = mid_nodes::tied(&mids, &nodes, &next, along).into_iter();
            pairs.extend(tied.map(|p| geometry::fe_mesh::Pair {
                node: p.node + corners,
                image: p.image + corners,
                ..p
            }));
        }
        nodes.extend(&mids.nodes);
        middles = mids.of.into_iter().map(|t| t.map(|n| n + corners)).collect();
        straight = mids.straight;
    }
    for patched in &domains.patched {
        faces.iter_mut().for_each(|f| f.1 = patched.folded(f.1));
    }
    let period = if options.periodic {
        core::array::from_fn(|a| {
            let at = |side: usize| planes[a][side].and_then(|s| surfaces[s].plane).map_or(0.0, |p| p.at);
            at(1) - at(0)
        })
    } else {
        [0.0; 3]
    };
    let names = domains.names.iter().map(|n| n.to_string()).collect();
    let mut mesh = FeMesh { nodes, tets, middles, domain, domains: names, pairs, period, ..FeMesh::default() };
    if options.periodic {
        cyclic_nodes::matched(&mesh, cubes, faces.iter().filter(|f| f.2).map(|f| f.0))?;
    }
    named_sets::add_sets(&mut mesh, domains, &faces, (planes, bounds), named.bodies);
    let empty = named_sets::add_regions(&mut mesh, &faces, named.sets);
    // A region of the solid's surface may hold none of a fluid's.
    if let (Some(fault), VolumeTarget::Solid | VolumeTarget::All) = (empty, options.of) {
        return Err(fault);
    }
    let deviation = deviation::deviation(&mesh, &faces, domains);
    let pieces = components(&mesh.tets, mesh.nodes.len());
    Ok(MeshedVolume { mesh, deviation, straight, pieces, dropped: 0.0, loose: 0.0, step: [0.0; 3] })
}

/// Removes nodes that no tetrahedron has; gives the cycles of images among the others.
fn compacted(nodes: &mut Vec<Vec3>, on: &mut Vec<SurfaceSet>, next: Vec<u32>, tets: &mut [[u32; 4]]) -> Vec<u32> {
    let mut to = vec![u32::MAX; nodes.len()];
    tets.iter().flatten().for_each(|n| to[*n as usize] = 0);
    let mut count = 0;
    for n in to.iter_mut().filter(|n| **n == 0) {
        *n = count;
        count += 1;
    }
    let mut cycles = vec![0; count as usize];
    for n in (0..to.len()).filter(|n| to[*n] != u32::MAX) {
        let after = images(&next, n as u32).skip(1).find(|m| to[*m as usize] != u32::MAX);
        cycles[to[n] as usize] = to[after.unwrap_or(n as u32) as usize];
        (nodes[to[n] as usize], on[to[n] as usize]) = (nodes[n], on[n]);
    }
    nodes.truncate(count as usize);
    on.truncate(count as usize);
    tets.iter_mut().flatten().for_each(|n| *n = to[*n as usize]);
    cycles
}

/// The faces of the boundary and between domains: tetrahedron and corner, surfaces, whether only one tetrahedron has them; of two
/// the one of the first domain.
fn faces_on_surfaces(tets: &[[u32; 4]], domain: &[u8], on: &[SurfaceSet]) -> Vec<((u32, u8), SurfaceSet, bool)> {
    let mut found: Vec<((u32, u8), SurfaceSet, bool)> = interfaces(tets, domain, &|n| on[n as usize] != 0)
        .into_par_iter()
        .map(|(f, at, outer)| {
            let set = f.iter().fold(SurfaceSet::MAX, |s, n| s & on[*n as usize]);
            ((at / 4, (at % 4) as u8), set, outer)
        })
        .collect();
    found.par_sort_unstable_by_key(|f| f.0);
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
