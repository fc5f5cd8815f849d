//! Tests whether a mesh is the boundary of a solid, and the pairs of half-edges at its edges.

use rayon::prelude::*;

use super::stitch::flat;
use crate::distance::winding::turn;
use crate::fault::{self, Fault};
use crate::math::{cross, dot, norm, sub};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, components, rises};
use crate::union_find::{labels, singles, unite};

/// Pairs of half-edges (3 · triangle + corner where the edge begins) that are one edge.
pub type Pairs = Vec<[u32; 2]>;

fn refuse(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// The edges of a closed, oriented mesh, or its defects in numbers. The mesh has passed `numbers`.
pub fn edges(mesh: &Mesh) -> Result<Pairs, String> {
    let forward = |h: u32| rises(&mesh.triangles, h);
    let (mut open, mut crowded, mut flipped) = (0, 0, 0);
    let mut pairs = Pairs::with_capacity(3 * mesh.triangles.len() / 2);
    for edge in Edges::of(&mesh.triangles).each() {
        match *edge {
            [_] => open += 1,
            [a, b] if forward(a) == forward(b) => flipped += 1,
            [a, b] => pairs.push([a, b]),
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
    let found: Vec<String> = defects.iter().filter(|d| d.0 > 0).map(|(n, what)| format!("{n} {what}")).collect();
    if found.is_empty() { Ok(pairs) } else { Err(found.join(", ")) }
}

/// Refuses indices out of range and coordinates that cannot be computed with.
pub fn numbers(mesh: &Mesh) -> Result<(), Fault> {
    let count = mesh.vertices.len();
    if mesh.triangles.len() < 4 {
        return Err(refuse(format!("the mesh has {} triangles; a solid has at least 4", mesh.triangles.len())));
    }
    if mesh.triangles.len() > (u32::MAX / 3) as usize {
        return Err(refuse(format!(
            "the mesh has {} triangles; at most {} are supported: simplify it first",
            mesh.triangles.len(),
            u32::MAX / 3
        )));
    }
    if let Some(i) = mesh.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= count)) {
        return Err(refuse(format!(
            "triangle {i} has the vertices {:?}, but there are {count} (counted from 0)",
            mesh.triangles[i]
        )));
    }
    if let Some(i) = mesh.vertices.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(refuse(format!("vertex {i} is at {:?}; coordinates must be finite", mesh.vertices[i])));
    }
    if mesh.bounds().size().iter().any(|s| !(s * s * s).is_finite()) {
        return Err(refuse(format!(
            "the mesh measures {:?} mm: its volume is not finite; scale the mesh down",
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

fn degenerate(mesh: &Mesh) -> usize {
    (0..mesh.triangles.len()).filter(|&i| flat(mesh.corners(i))).count()
}

/// Signed volume and area of each component, `number` being the component of each triangle.
fn volumes(mesh: &Mesh, number: &[u32], count: usize) -> Vec<(f64, f64)> {
    let center = mesh.bounds().center();
    let mut sums = vec![(0.0, 0.0); count];
    for (i, component) in number.iter().enumerate() {
        let [a, b, c] = mesh.corners(i).map(|p| sub(p, center));
        let s = &mut sums[*component as usize];
        s.0 += dot(a, cross(b, c)) / 6.0;
        s.1 += norm(cross(sub(b, a), sub(c, a))) / 2.0;
    }
    sums
}

/// A mean thickness that the rounding of the coordinates could make.
fn thin(mesh: &Mesh) -> f64 {
    1e-12 * norm(mesh.bounds().size())
}

/// Refuses a closed mesh none of whose components has volume.
pub fn thick(mesh: &Mesh) -> Result<(), Fault> {
    let thin = thin(mesh);
    let (number, count) = components(mesh);
    let sums = volumes(mesh, &number, count);
    if sums.iter().any(|(v, area)| v.abs() > thin * area) {
        return Ok(());
    }
    let volume: f64 = sums.iter().map(|s| s.0.abs()).sum();
    let volume = fault::number(volume);
    Err(refuse(format!("the volume of the mesh is {volume} mm³, zero to rounding: it is flat and bounds no solid")))
}

/// Whether a closed mesh (edges `pairs`) that does not cross itself is one component with cavities inside it.
pub fn plain(mesh: &Mesh, pairs: &Pairs) -> bool {
    let thin = thin(mesh);
    let mut root = singles(mesh.triangles.len());
    for [a, b] in pairs {
        unite(&mut root, a / 3, b / 3);
    }
    let (number, count) = labels(&mut root);
    let sums = volumes(mesh, &number, count);
    let mut solids = sums.iter().enumerate().filter(|(_, s)| s.0 > 0.0);
    let (Some((outer, _)), None) = (solids.next(), solids.next()) else {
        return false;
    };
    let mut tested = vec![false; sums.len()];
    (0..number.len()).all(|i| {
        let b = number[i] as usize;
        if tested[b] {
            return true;
        }
        tested[b] = true;
        let (volume, area) = sums[b];
        // About a cavity the other components wind once.
        let inside = |p| {
            let others = (0..number.len()).filter(|t| number[*t] as usize != b);
            others.map(|t| turn(mesh.corners(t), p)).sum::<f64>() > 0.5
        };
        volume.abs() > thin * area && (b == outer || inside(mesh.corners(i)[0]))
    })
}
