//! Named sets of a volume mesh: bounding planes, what the region cuts, lattice, skin, keep zones.

use super::cyclic_nodes::PLANES;
use super::domains::Domains;
use crate::conforming_tets::{HELD, SurfaceSet, only};
use crate::field::Field;
use crate::region::Region;
use geometry::fault::Fault;
use geometry::fe_mesh::{FeMesh, FeSet};
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use rayon::prelude::*;

/// Nodes nearer to a bounding plane than this part of the region's size are on it.
pub(super) const FLAT: f64 = 1e-6;

/// Adds the sets that are not empty. `faces` are those on surfaces: tetrahedron and corner, their surfaces, whether only one tetrahedron
/// has them; `planes` the surfaces of the bounding planes; `bounds` those of the region; `bodies` the names of what is solid whatever the
/// lattice says.
pub(super) fn add_sets(
    mesh: &mut FeMesh,
    domains: &Domains,
    faces: &[((u32, u8), SurfaceSet, bool)],
    (planes, bounds): (&[[Option<usize>; 2]; 3], &Aabb),
    bodies: &[String],
) {
    let below = |n: usize| -> SurfaceSet { (1 << n) - 1 };
    let region = below(domains.region);
    let lattice = !below(domains.lattice) & !HELD;
    let several = domains.names.len() > 1;
    let near = FLAT * norm(bounds.size());
    for (axis, sides) in planes.iter().enumerate() {
        for (side, s) in sides.iter().enumerate() {
            let name = PLANES[axis][side];
            let at = [bounds.min, bounds.max][side][axis];
            // A mesh or an intersection may have flat faces at its bounds too.
            let flat = |f: (u32, u8)| mesh.face(f).iter().all(|n| (mesh.nodes[*n as usize][axis] - at).abs() <= near);
            let is_on = |(f, set, outer): &&((u32, u8), SurfaceSet, bool)| {
                *outer && s.map_or_else(|| set & region != 0 && flat(*f), |s| set & only(s) != 0)
            };
            let of: Vec<(u32, u8)> = faces.iter().filter(is_on).map(|f| f.0).collect();
            if several {
                for (d, domain) in domains.names.iter().enumerate() {
                    let of = of.iter().copied().filter(|f| mesh.domain[f.0 as usize] as usize == d).collect();
                    push(mesh, format!("{domain}_{name}"), of);
                }
            }
            push(mesh, name.into(), of);
        }
    }
    let cut = faces.iter().filter(|(_, set, outer)| *outer && set & region != 0).map(|f| f.0).collect();
    push(mesh, "CUT".into(), cut);
    let own = faces.iter().filter(|(_, set, _)| set & region == 0 && set & lattice != 0).map(|f| f.0).collect();
    push(mesh, "LATTICE".into(), own);
    let middle = |t: &[u32; 4]| scale(t.iter().fold([0.0; 3], |s, n| add(s, mesh.nodes[*n as usize])), 0.25);
    let middles: Vec<Vec3> = mesh.tets.par_iter().map(middle).collect();
    let mut first = domains.region;
    let is_solid = matches!(domains.names.first(), Some(&("SOLID" | "WALL")));
    for (body, name) in domains.filled.iter().zip(bodies) {
        let own = below(first + body.surfaces.len()) & !below(first);
        first += body.surfaces.len();
        if !is_solid {
            // Of a fluid the body is a wall; tetrahedra next to it may be within it by a part of a chord's height.
            let wall = faces.iter().filter(|(_, set, _)| set & region == 0 && set & own != 0).map(|f| f.0).collect();
            push(mesh, name.clone(), wall);
            continue;
        }
        let mut values = vec![0.0; middles.len()];
        values.par_chunks_mut(1024).zip(middles.par_chunks(1024)).for_each(|(v, p)| body.values(p, v));
        let within = |t: u32| values[t as usize] < 0.0 && mesh.domain[t as usize] == 0;
        // Its faces towards a fluid are on its surfaces.
        let is_on = |(f, set, outer): &&((u32, u8), SurfaceSet, bool)| (*outer || set & own != 0) && within(f.0);
        let of: Vec<(u32, u8)> = faces.iter().filter(is_on).map(|f| f.0).collect();
        let elements: Vec<u32> = (0..mesh.tets.len() as u32).filter(|t| within(*t)).collect();
        if !elements.is_empty() {
            let nodes = nodes_of(elements.iter().flat_map(|t| {
                let middles = mesh.middles.get(*t as usize).copied();
                mesh.tets[*t as usize].into_iter().chain(middles.into_iter().flatten())
            }));
            mesh.sets.push(FeSet { name: name.clone(), nodes, elements, faces: of, bulk: true });
        }
    }
}

/// Faces on a curved region have to face as it does, or away from it, to within 25 degrees.
const FACING: f64 = 0.9;

/// Adds the faces within each region, by its name: those whose corners' mean is inside it, or within a millionth of the mesh's size, so that
/// a region may end where a flat face is, or that are chords of its surface where that is curved. Gives what to say of the first one that
/// is empty.
pub(super) fn add_regions(
    mesh: &mut FeMesh,
    faces: &[((u32, u8), SurfaceSet, bool)],
    sets: &[(String, Region)],
) -> Option<Fault> {
    let corners: Vec<[Vec3; 3]> = faces.iter().map(|f| mesh.face(f.0).map(|n| mesh.nodes[n as usize])).collect();
    let points: Vec<Vec3> = corners.iter().map(|[a, b, c]| scale(add(add(*a, *b), *c), 1.0 / 3.0)).collect();
    let bounds = mesh.nodes.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let near = FLAT * norm(bounds.size());
    let mut empty = None;
    for (name, region) in sets {
        let mut depth = vec![0.0; points.len()];
        depth.par_chunks_mut(1024).zip(points.par_chunks(1024)).for_each(|(d, p)| region.values(p, d));
        let within = |i: &usize| depth[*i] <= near || is_chord(&corners[*i], region, depth[*i]);
        let of: Vec<(u32, u8)> = (0..faces.len()).into_par_iter().filter(within).map(|i| faces[i].0).collect();
        if of.is_empty() && empty.is_none() {
            let nearest = depth.iter().fold(f64::INFINITY, |m, d| m.min(*d));
            let message = format!(
                "the set is empty: no face of the mesh lies within its region, the nearest is {nearest:.3} mm away; \
                 enlarge the region or move it"
            );
            empty = Some(Fault::new(format!("set.{name}"), message));
        }
        push(mesh, name.clone(), of);
    }
    empty
}

/// Whether a triangle whose middle is `depth` outside a region follows its surface: no farther from it than twice the height of an arc
/// with the triangle's longest edge L as chord, κ L² / 4 where the curvature κ is how fast normals turn along the edges. Nodes balance the
/// chords of all triangles about them, of which others may be half as long again.
fn is_chord(corners: &[Vec3; 3], region: &Region, depth: f64) -> bool {
    let ends = [[0, 1], [1, 2], [2, 0]];
    let edges = ends.map(|[a, b]| norm(sub(corners[b], corners[a])));
    let longest = edges.into_iter().fold(0.0, f64::max);
    // Normals differ by no more than √2 over an arc that a triangle may stand for.
    if depth > longest * 2f64.sqrt() / 8.0 {
        return false;
    }
    // Corners may be on an edge of the region, where it faces otherwise; the middle says how it faces.
    let [a, b, c] = *corners;
    let middle = scale(add(add(a, b), c), 1.0 / 3.0);
    let (mut values, mut normals) = ([0.0; 4], [[0.0; 3]; 4]);
    region.gradients(&[a, b, c, middle], &mut values, &mut normals);
    let turns = ends.iter().zip(edges).map(|([a, b], edge)| norm(sub(normals[*a], normals[*b])) / edge);
    let curvature = turns.fold(0.0, f64::max);
    let own = unit(cross(sub(b, a), sub(c, a)));
    depth <= curvature * longest.powi(2) / 4.0 && dot(normals[3], own).abs() >= FACING
}

/// Whether a name is that of a set or a domain that volume meshes have by themselves, in capitals or small letters.
pub fn is_own_name(name: &str) -> bool {
    const OWN: [&str; 17] = [
        "CUT", "LATTICE", "SKIN", "NET", "BORDER", "SHELL", "SOLID", "PORE", "WALL", "LOWER", "UPPER", "NALL", "REF",
        "REFX", "REFY", "REFZ", "SURFACE",
    ];
    let name = name.to_ascii_uppercase();
    let plane = |n: &str| PLANES.iter().flatten().any(|p| *p == n);
    let of_domain = || name.rsplit_once('_').is_some_and(|(d, p)| OWN.contains(&d) && plane(p));
    OWN.contains(&name.as_str())
        || name.starts_with("KEEP_")
        || name.starts_with("CORE_")
        || name.starts_with("FRACTION_")
        || plane(&name)
        || of_domain()
}

/// Adds a set of faces with their nodes and tetrahedra, unless it is empty.
pub(super) fn push(mesh: &mut FeMesh, name: String, mut faces: Vec<(u32, u8)>) {
    if faces.is_empty() {
        return;
    }
    faces.sort_unstable();
    let mut elements: Vec<u32> = faces.iter().map(|f| f.0).collect();
    elements.dedup();
    let nodes = nodes_of(
        faces.iter().flat_map(|f| mesh.face(*f).into_iter().chain(mesh.face_middles(*f).into_iter().flatten())),
    );
    mesh.sets.push(FeSet { name, nodes, elements, faces, bulk: false });
}

fn nodes_of(nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
