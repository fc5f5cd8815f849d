//! Beams as finite elements: their axes within a region, in elements along them, with named sets.

use geometry::fault::Fault;
use geometry::fe_mesh::{BeamMesh, FeSet};
use geometry::math::{Aabb, Vec3, norm};
use geometry::roots::bisect;
use geometry::union_find::{labels, singles, unite};
use rayon::prelude::*;

use crate::region::Region;
use crate::volume_mesh::PLANES;
use beams::{Pencil, Quadors};

/// How beams are divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamMeshOptions {
    /// Longest element, mm; else four to a beam.
    pub edge: Option<f64>,
    /// Whether elements are quadratic.
    pub quadratic: bool,
    /// Whether the largest component alone is kept.
    pub largest: bool,
}

/// The mesh of beams in a region, and what it leaves out.
pub struct MeshedBeams {
    /// The mesh.
    pub mesh: BeamMesh,
    /// The beams of which some length is in the region, and those of them that the region cuts.
    pub beams: [usize; 2],
    /// Number of connected components.
    pub pieces: usize,
    /// Length of components that were left out, mm.
    pub loose: f64,
    /// The first set of the design that is empty.
    pub warning: Option<Fault>,
}

/// Elements of a beam of which no size is given.
const USUAL: f64 = 4.0;
/// Points at which a beam's axis is searched for the region's boundary, for each of its least radius.
const DENSE: f64 = 2.0;
/// Halvings of the distance of two such points after which the boundary is known: to 1e-12 of it.
const HALVINGS: usize = 40;
/// Most elements.
const MOST: f64 = 1e8;
/// A share of the mesh's size within which a node lies on a plane or in a region.
const NEAR: f64 = 1e-6;

/// The axes of beams within a region as finite elements, with the bounding planes and `sets` as named sets. Each element has the mean section
/// of the beam along it. The same for any number of threads.
///
/// # Errors
/// A region that holds none of the axes; more than 10⁸ elements.
pub fn beam_mesh(
    quadors: &Quadors,
    region: &Region,
    sets: &[(String, Region)],
    options: &BeamMeshOptions,
) -> Result<MeshedBeams, Fault> {
    let near = NEAR * norm(region.bounds().size());
    let runs: Vec<Vec<[f64; 2]>> =
        (0..quadors.beams()).into_par_iter().map(|b| within(quadors, b, region, near)).collect();
    let mut mesh = BeamMesh::default();
    // The node of each hub.
    let mut hubs = vec![u32::MAX; quadors.len()];
    let mut beams = [0; 2];
    for (b, runs) in runs.iter().enumerate().filter(|(_, runs)| !runs.is_empty()) {
        beams[0] += 1;
        beams[1] += usize::from(runs[..] != [[0.0, quadors.pencil(b).length]]);
        for run in runs {
            divide(&mut mesh, &mut hubs, (quadors, b), *run, options.edge)?;
        }
    }
    if mesh.elements.is_empty() {
        return Err(Fault::new("region", "the region holds none of the beams' axes"));
    }
    let (pieces, loose) = components(&mut mesh, options.largest);
    if options.quadratic {
        for [a, b] in mesh.elements.clone() {
            let middle = lerp(mesh.nodes[a as usize], mesh.nodes[b as usize], 0.5);
            mesh.middles.push(mesh.nodes.len() as u32);
            mesh.nodes.push(middle);
        }
    }
    let warning = add_sets(&mut mesh, sets);
    Ok(MeshedBeams { mesh, beams, pieces, loose, warning })
}

fn lerp(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    core::array::from_fn(|k| (1.0 - t) * a[k] + t * b[k])
}

/// The parts of a beam's axis that are in the region, each as two distances from its first hub, mm.
fn within(quadors: &Quadors, b: usize, region: &Region, near: f64) -> Vec<[f64; 2]> {
    let (pencil, [from, to]) = (quadors.pencil(b), quadors.ends(b).map(|h| quadors.center(h as usize)));
    let length = pencil.length;
    let at = |z: f64| lerp(from, to, z / length);
    let least = pencil.waist().min(pencil.radii[0]).min(pencil.radii[1]);
    let count = (DENSE * length / least).clamp(16.0, 1e4) as usize;
    let places: Vec<f64> =
        (0..=count).map(|i| if i == count { length } else { length * i as f64 / count as f64 }).collect();
    let mut values = vec![0.0; places.len()];
    region.values(&places.iter().map(|z| at(*z)).collect::<Vec<_>>(), &mut values);
    // An axis in the boundary is in the region, whichever way its values are rounded; one that crosses it ends there.
    let is_in = |v: f64| v <= near;
    let crossing = |inner: f64, outer: f64| match region.value(at(inner)) >= -near {
        true => inner,
        false => bisect([inner, outer], HALVINGS, |z| region.value(at(z)) <= 0.0)[0],
    };
    let mut runs: Vec<[f64; 2]> = Vec::new();
    let mut start = is_in(values[0]).then_some(0.0);
    for (z, v) in places.windows(2).zip(values.windows(2)) {
        match (start, is_in(v[1])) {
            (None, true) => start = Some(crossing(z[1], z[0])),
            (Some(s), false) => {
                runs.push([s, crossing(z[0], z[1])]);
                start = None;
            }
            _ => {}
        }
    }
    runs.extend(start.map(|s| [s, length]));
    runs.retain(|[a, b]| b - a > near.max(1e-6 * length));
    runs
}

/// Adds the elements of a part of a beam.
fn divide(
    mesh: &mut BeamMesh,
    hubs: &mut [u32],
    (quadors, b): (&Quadors, usize),
    [start, stop]: [f64; 2],
    edge: Option<f64>,
) -> Result<(), Fault> {
    let (pencil, ends) = (quadors.pencil(b), quadors.ends(b));
    let [from, to] = ends.map(|h| quadors.center(h as usize));
    let count = edge.map_or(USUAL, |e| ((stop - start) / e - 1e-9).ceil().max(1.0));
    if mesh.elements.len() as f64 + count > MOST {
        return Err(Fault::new("edge", format!("at most {MOST:.0e} elements are possible; use longer ones")));
    }
    let place = |i: f64| if i == count { stop } else { start + (stop - start) * i / count };
    let mut node = |z: f64| -> u32 {
        let next = mesh.nodes.len() as u32;
        let hub = if z == 0.0 { Some(ends[0]) } else { (z == pencil.length).then_some(ends[1]) };
        if let Some(h) = hub.map(|h| &mut hubs[h as usize]) {
            if *h != u32::MAX {
                return *h;
            }
            *h = next;
        }
        mesh.nodes.push(if z == pencil.length { to } else { lerp(from, to, z / pencil.length) });
        next
    };
    let nodes: Vec<u32> = (0..=count as usize).map(|i| node(place(i as f64))).collect();
    for (i, pair) in nodes.windows(2).enumerate() {
        mesh.elements.push([pair[0], pair[1]]);
        mesh.radii.push(mean_radius(pencil, [place(i as f64), place(i as f64 + 1.0)]));
    }
    Ok(())
}

/// The radius (mm) whose section is the mean of those of a beam between two places on its axis. Within a hub the beam goes on as it
/// touches the ball.
fn mean_radius(pencil: &Pencil, [a, b]: [f64; 2]) -> f64 {
    let [low, high] = [pencil.contact(0), pencil.length - pencil.contact(1)];
    let area = |z: f64| pencil.radius_squared(z.max(low).min(high)).max(0.0);
    // Simpson's rule is exact between the contacts, where ρ² is quadratic; pieces so that it is where one of them lies between.
    let mut places = vec![a, b];
    places.extend([low, high].into_iter().filter(|z| a < *z && *z < b));
    places.sort_by(f64::total_cmp);
    let rule = |p: &[f64]| (p[1] - p[0]) / 6.0 * (area(p[0]) + 4.0 * area(0.5 * (p[0] + p[1])) + area(p[1]));
    (places.windows(2).map(rule).sum::<f64>() / (b - a)).sqrt()
}

/// Counts connected components, and drops all but the longest if asked to; gives the length that was left out, mm.
fn components(mesh: &mut BeamMesh, largest: bool) -> (usize, f64) {
    let mut root = singles(mesh.nodes.len());
    mesh.elements.iter().for_each(|[a, b]| _ = unite(&mut root, *a, *b));
    let (label, count) = labels(&mut root);
    if !largest || count == 1 {
        return (count, 0.0);
    }
    let mut lengths = vec![0.0; count];
    (0..mesh.elements.len()).for_each(|i| lengths[label[mesh.elements[i][0] as usize] as usize] += norm(mesh.axis(i)));
    let longest = (0..count).fold(0, |m, k| if lengths[k] > lengths[m] { k } else { m });
    let mut number = vec![u32::MAX; mesh.nodes.len()];
    let mut nodes = Vec::new();
    for (n, p) in mesh.nodes.iter().enumerate().filter(|(n, _)| label[*n] as usize == longest) {
        number[n] = nodes.len() as u32;
        nodes.push(*p);
    }
    mesh.nodes = nodes;
    let is_kept: Vec<bool> = mesh.elements.iter().map(|[a, _]| number[*a as usize] != u32::MAX).collect();
    let mut kept = is_kept.iter();
    mesh.radii.retain(|_| *kept.next().unwrap_or(&true));
    mesh.elements.retain(|[a, _]| number[*a as usize] != u32::MAX);
    mesh.elements.iter_mut().flatten().for_each(|n| *n = number[*n as usize]);
    (1, lengths.iter().sum::<f64>() - lengths[longest])
}

/// Adds the sets that are not empty; gives what to say of the first one of the design that is.
fn add_sets(mesh: &mut BeamMesh, sets: &[(String, Region)]) -> Option<Fault> {
    let bounds = mesh.nodes.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let near = NEAR * norm(bounds.size());
    for (k, name) in PLANES.iter().flatten().enumerate() {
        let (axis, at) = (k / 2, [bounds.min, bounds.max][k % 2][k / 2]);
        let on: Vec<bool> = mesh.nodes.iter().map(|p| (p[axis] - at).abs() <= near).collect();
        mesh.sets.extend(set_of(mesh, name, &on));
    }
    let mut empty = None;
    for (name, region) in sets {
        let mut depth = vec![0.0; mesh.nodes.len()];
        depth.par_chunks_mut(1024).zip(mesh.nodes.par_chunks(1024)).for_each(|(d, p)| region.values(p, d));
        let on: Vec<bool> = depth.iter().map(|d| *d <= near).collect();
        let set = set_of(mesh, name, &on);
        if set.is_none() {
            let nearest = depth.iter().fold(f64::INFINITY, |m, d| m.min(*d));
            let message = format!(
                "the set is empty: no node of the beams' axes lies within its region, the nearest is {nearest:.3} mm away; enlarge the \
                 region or move it"
            );
            empty = empty.or(Some(Fault::new(format!("set.{name}"), message)));
        }
        mesh.sets.extend(set);
    }
    empty
}

/// The set of these nodes: with the elements between them, and the ends there of elements that come from elsewhere, or of all if none do.
fn set_of(mesh: &BeamMesh, name: &str, on: &[bool]) -> Option<FeSet> {
    let nodes: Vec<u32> = (0..).zip(on).filter(|(_, on)| **on).map(|(n, _)| n).collect();
    let is_on = |e: &[u32; 2]| e.map(|n| on[n as usize]);
    let elements = (0..).zip(&mesh.elements).filter(|(_, e)| is_on(e) == [true; 2]).map(|(i, _)| i).collect();
    let ends = |all: bool| -> Vec<(u32, u8)> {
        let of = |(i, e): (u32, &[u32; 2])| {
            let [a, b] = is_on(e);
            [(a && (all || !b)).then_some((i, 0)), (b && (all || !a)).then_some((i, 1))]
        };
        (0..).zip(&mesh.elements).flat_map(of).flatten().collect()
    };
    let mut faces = ends(false);
    if faces.is_empty() {
        faces = ends(true);
    }
    (!nodes.is_empty()).then(|| FeSet { name: name.into(), nodes, elements, faces, bulk: false })
}
