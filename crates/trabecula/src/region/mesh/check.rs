//! Whether a mesh is the boundary of one solid, and which triangles meet at its edges.

use rayon::prelude::*;

use crate::fault::Fault;
use crate::math::{Vec3, cross, dot, norm, sub};
use crate::mesh::Mesh;

/// Pairs of half-edges (3 · triangle + corner where the edge begins) that are one edge.
pub type Pairs = Vec<[u32; 2]>;

fn refuse(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// Half-edges (the edge's vertices, 3 · triangle + corner) in the order of their edges.
fn halves(mesh: &Mesh) -> Vec<(u64, u32)> {
    let mut halves: Vec<(u64, u32)> = mesh
        .triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, t)| {
            let edge = |k: usize| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                (
                    u64::from(a.min(b)) << 32 | u64::from(a.max(b)),
                    (3 * i + k) as u32,
                )
            };
            [edge(0), edge(1), edge(2)]
        })
        .collect();
    halves.par_sort_unstable();
    halves
}

/// Whether an edge has one triangle.
pub fn open(mesh: &Mesh) -> bool {
    halves(mesh)
        .chunk_by(|a, b| a.0 == b.0)
        .any(|edge| edge.len() == 1)
}

/// Gives the edges of a mesh that bounds one solid (cavities allowed), or says in numbers why it does not. The
/// mesh has passed `numbers`.
pub fn check(mesh: &Mesh) -> Result<Pairs, Fault> {
    let halves = halves(mesh);
    let forward = |h: u32| {
        let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
        t[k] < t[(k + 1) % 3]
    };
    let (mut open, mut crowded, mut flipped) = (0, 0, 0);
    let mut pairs = Pairs::with_capacity(halves.len() / 2);
    for edge in halves.chunk_by(|a, b| a.0 == b.0) {
        match edge {
            [_] => open += 1,
            [a, b] if forward(a.1) == forward(b.1) => flipped += 1,
            [a, b] => pairs.push([a.1, b.1]),
            _ => crowded += 1,
        }
    }
    let defects = [
        (open, "open edges"),
        (crowded, "edges with more than two triangles"),
        (flipped, "edges whose two triangles face opposite ways"),
        (duplicates(mesh), "duplicate triangles"),
        (degenerate(mesh), "degenerate triangles (no area)"),
    ];
    let found: Vec<String> = defects
        .iter()
        .filter(|d| d.0 > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    if !found.is_empty() {
        let (n, found) = (mesh.triangles.len(), found.join(", "));
        return Err(refuse(format!(
            "the mesh of {n} triangles is not a closed solid: {found}; repair it first"
        )));
    }
    bodies(mesh, &pairs)?;
    Ok(pairs)
}

/// Refuses indices out of range and coordinates that cannot be computed with.
pub fn numbers(mesh: &Mesh) -> Result<(), Fault> {
    let count = mesh.vertices.len();
    if mesh.triangles.len() < 4 {
        return Err(refuse(format!(
            "{} triangles: a solid has at least four",
            mesh.triangles.len()
        )));
    }
    if mesh.triangles.len() > (u32::MAX / 3) as usize {
        return Err(refuse(format!(
            "{} triangles: at most {}",
            mesh.triangles.len(),
            u32::MAX / 3
        )));
    }
    if let Some(i) = mesh
        .triangles
        .iter()
        .position(|t| t.iter().any(|v| *v as usize >= count))
    {
        return Err(refuse(format!(
            "triangle {i} is {:?}, but there are {count} vertices",
            mesh.triangles[i]
        )));
    }
    if let Some(i) = mesh
        .vertices
        .iter()
        .position(|p| p.iter().any(|x| !x.is_finite()))
    {
        return Err(refuse(format!(
            "vertex {i} at {:?} is not finite",
            mesh.vertices[i]
        )));
    }
    if mesh
        .bounds()
        .size()
        .iter()
        .any(|s| !(s * s * s).is_finite())
    {
        return Err(refuse(format!(
            "the mesh is {:?} mm large: beyond what can be computed with",
            mesh.bounds().size()
        )));
    }
    Ok(())
}

fn duplicates(mesh: &Mesh) -> usize {
    let sorted = |t: &[u32; 3]| {
        let mut t = *t;
        t.sort_unstable();
        t
    };
    let mut all: Vec<[u32; 3]> = mesh.triangles.par_iter().map(sorted).collect();
    all.par_sort_unstable();
    all.windows(2).filter(|w| w[0] == w[1]).count()
}

/// Triangles whose normal is lost in the rounding of their coordinates' differences.
fn degenerate(mesh: &Mesh) -> usize {
    (0..mesh.triangles.len())
        .filter(|&i| {
            let [a, b, c] = mesh.corners(i);
            let (u, v) = (sub(b, a), sub(c, a));
            norm(cross(u, v)) <= 4.0 * f64::EPSILON * norm(u) * norm(v)
        })
        .count()
}

/// Refuses anything but one body with cavities inside it.
fn bodies(mesh: &Mesh, pairs: &Pairs) -> Result<(), Fault> {
    // Union-find over the edges; the root of a body is its first triangle.
    let mut root: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for [a, b] in pairs {
        let (a, b) = (find(&mut root, a / 3), find(&mut root, b / 3));
        root[a.max(b) as usize] = a.min(b);
    }
    let center = mesh.bounds().center();
    let mut volumes: Vec<(u32, f64)> = Vec::new(); // by first triangle, ascending
    let mut areas: Vec<f64> = Vec::new();
    let mut slot = vec![0u32; root.len()];
    for i in 0..root.len() {
        let r = find(&mut root, i as u32);
        if r as usize == i {
            slot[i] = volumes.len() as u32;
            volumes.push((r, 0.0));
            areas.push(0.0);
        }
        let body = slot[r as usize] as usize;
        let [a, b, c] = mesh.corners(i).map(|p| sub(p, center));
        volumes[body].1 += dot(a, cross(b, c)) / 6.0;
        areas[body] += norm(cross(sub(b, a), sub(c, a))) / 2.0;
    }
    // A mean thickness that the rounding of the coordinates could make.
    let thin = 1e-12 * norm(mesh.bounds().size());
    let flat = volumes
        .iter()
        .zip(&areas)
        .find(|(v, area)| v.1.abs() <= thin * **area);
    if let Some(((_, v), _)) = flat {
        return Err(refuse(format!(
            "a body of the mesh has the volume {v:e} mm³: flat, not a solid"
        )));
    }
    let solids: Vec<u32> = volumes.iter().filter(|v| v.1 > 0.0).map(|v| v.0).collect();
    let [outer] = solids[..] else {
        return Err(refuse(match solids.len() {
            0 => format!(
                "the mesh is inside out (volume {:.6} mm³): reverse its triangles",
                mesh.volume()
            ),
            n => format!(
                "the mesh has {n} separate bodies: give one body per region and join them with a union"
            ),
        }));
    };
    let shell: Vec<usize> = (0..root.len())
        .filter(|&i| find(&mut root, i as u32) == outer)
        .collect();
    let cavities = volumes.iter().filter(|v| v.1 < 0.0);
    let outside = cavities
        .filter(|(first, _)| winding(mesh, &shell, mesh.corners(*first as usize)[0]) < 0.5)
        .count();
    if outside > 0 {
        let n = outside + 1;
        return Err(refuse(format!(
            "the mesh has {n} separate bodies, {outside} of them inside out and no cavity"
        )));
    }
    Ok(())
}

/// How often the triangles wind about a point: one inside, zero outside.
///
/// Source: A. van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125.
fn winding(mesh: &Mesh, triangles: &[usize], p: Vec3) -> f64 {
    let angle = |i: &usize| {
        let [a, b, c] = mesh.corners(*i).map(|q| sub(q, p));
        let (la, lb, lc) = (norm(a), norm(b), norm(c));
        let solid = dot(a, cross(b, c));
        2.0 * solid.atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * core::f64::consts::PI)
}
