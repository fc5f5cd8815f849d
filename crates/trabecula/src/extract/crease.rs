//! Sharp creases where the lattice meets the region's surface.
//!
//! A cell whose one patch lies partly on the lattice and partly on the region's surface gets a vertex of its own, on
//! the curve where the two meet, and the patch becomes the cone from that vertex over the patch's rim. A cone over a
//! simple curve on the boundary of a convex cell, from a point inside, never meets itself.
//!
//! Between two such cells the rim still cuts the corner: its segment on their common face runs from a point of the
//! lattice to one of the region. Turning that edge (from the two rim points to the two inner vertices) puts the
//! curve into the mesh. What changes is the cone, in each cell, over the triangle of the two rim points and the point
//! where the new edge passes the face; nothing else is there as long as the face holds no second segment and the edge
//! passes inside the face. So the mesh stays free of self-intersection, and its distance to the true solid is of
//! second order at creases too, where a chamfer is of first.
//!
//! Source: the vertex and the turned edge are those of Kobbelt, Botsch, Schwanecke and Seidel, SIGGRAPH 2001; the
//! conditions under which they cannot cross anything are our own.

use std::collections::HashMap;

use crate::field::Field;
use crate::math::{Vec3, add, dot, norm, scale, sub, unit};

use super::tile::{BATCH, Nodes, On};

/// A cell with one patch that touches both lattice and region.
pub(super) struct Ring {
    /// The cell, by the index of its lower node.
    pub cell: u32,
    /// Its pattern of solid corners.
    pub corners: u8,
    /// The rim, counter-clockwise seen from the void.
    pub points: Vec<u32>,
    /// First of the `points.len() - 2` triangles that fill it now.
    pub triangles: u32,
    /// Whether the cell belongs to the tile itself.
    pub own: bool,
}

/// A vertex inside a cell.
pub(super) struct Center {
    /// The cell, by the index of its lower node.
    pub cell: u32,
    pub place: Vec3,
    /// Unit normals of the lattice and of the region's surface.
    pub normals: [Vec3; 2],
}

/// The block's surface as it stands when creases are looked for.
pub(super) struct Draft<'a> {
    pub triangles: &'a mut Vec<[u32; 3]>,
    /// For each triangle, whether it belongs to the tile itself.
    pub own: &'a mut Vec<bool>,
    /// Places of the vertices, and what they lie on.
    pub places: &'a [Vec3],
    pub on: &'a [On],
}

/// Inner vertices keep this share of the cell away from its faces.
const INSET: f64 = 1.0 / 64.0;

/// Adds a vertex to every ring whose two surfaces meet inside its cell, and turns the edges between such cells.
/// `ends` are the lattice and the region.
pub(super) fn sharpen(
    rings: &[Ring],
    draft: Draft,
    ends: [&dyn Field; 2],
    nodes: &Nodes,
) -> Vec<Center> {
    let Draft {
        triangles,
        own,
        places,
        on,
    } = draft;
    let mut centers: Vec<Center> = Vec::new();
    // Rim segments that cut the corner, by their two points: their triangle, and their cell's inner vertex.
    let mut corners: HashMap<(u32, u32), (usize, usize)> = HashMap::new();
    let meetings = meet(rings, places, on, ends, nodes);
    for (ring, place) in rings.iter().zip(meetings) {
        let Some((place, normals)) = place else {
            continue;
        };
        let this = (places.len() + centers.len()) as u32;
        let n = ring.points.len();
        for k in 0..n {
            let (a, b) = (ring.points[k], ring.points[(k + 1) % n]);
            // The cone has two triangles more than the fan it replaces.
            let slot = if k < n - 2 {
                ring.triangles as usize + k
            } else {
                triangles.len()
            };
            if slot == triangles.len() {
                triangles.push([0; 3]);
                own.push(ring.own);
            }
            triangles[slot] = [this, a, b];
            if on[a as usize] == on[b as usize] {
                continue;
            }
            let segment = (a.min(b), a.max(b));
            match corners.remove(&segment) {
                None => {
                    corners.insert(segment, (slot, centers.len()));
                }
                Some((other, c)) if passes(ring, place, &centers[c], nodes) => {
                    let that = (places.len() + c) as u32;
                    // (that, b, a) and (this, a, b) share the segment; now they share the edge between inner vertices.
                    (triangles[other], triangles[slot]) = ([that, this, a], [this, that, b]);
                }
                Some(_) => {}
            }
        }
        centers.push(Center {
            cell: ring.cell,
            place,
            normals,
        });
    }
    centers
}

/// Whether the edge from an inner vertex to that of a neighbouring cell passes inside their common face, and the face
/// holds one segment only.
fn passes(ring: &Ring, place: Vec3, neighbour: &Center, nodes: &Nodes) -> bool {
    let (here, there) = (
        nodes.at(ring.cell as usize),
        nodes.at(neighbour.cell as usize),
    );
    let Some(axis) = (0..3).find(|&a| here[a] != there[a]) else {
        return false;
    };
    let upper = here[axis] < there[axis];
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let solid =
        |du: usize, dv: usize| ring.corners >> (usize::from(upper) << axis | du << u | dv << v) & 1;
    if solid(0, 0) == solid(1, 1) && solid(0, 1) == solid(1, 0) {
        return false;
    }
    let face = nodes.axes[axis][here[axis].max(there[axis])];
    let s = (face - place[axis]) / (neighbour.place[axis] - place[axis]);
    [u, v].iter().all(|&a| {
        let (lo, hi) = (nodes.axes[a][here[a]], nodes.axes[a][here[a] + 1]);
        let x = place[a] + s * (neighbour.place[a] - place[a]);
        let inset = INSET / 4.0 * (hi - lo);
        x > lo + inset && x < hi - inset
    })
}

/// For each ring, the point of its cell on both surfaces and their unit normals, if there is one: Newton's method with the shortest step.
fn meet(
    rings: &[Ring],
    places: &[Vec3],
    on: &[On],
    ends: [&dyn Field; 2],
    nodes: &Nodes,
) -> Vec<Option<(Vec3, [Vec3; 2])>> {
    let mut found = Vec::with_capacity(rings.len());
    for batch in rings.chunks(BATCH) {
        let mut points: Vec<Vec3> = Vec::with_capacity(batch.len());
        let mut simple: Vec<bool> = Vec::with_capacity(batch.len());
        for ring in batch {
            let n = ring.points.len();
            let (mut sum, mut count) = ([0.0; 3], 0);
            for k in 0..n {
                let (a, b) = (ring.points[k] as usize, ring.points[(k + 1) % n] as usize);
                if on[a] != on[b] {
                    sum = add(sum, add(places[a], places[b]));
                    count += 1;
                }
            }
            points.push(scale(sum, 0.5 / f64::from(count.max(1))));
            // One crease enters and leaves; more of them in one cell are left as they are.
            simple.push(count == 2);
        }
        let mut values = [vec![0.0; batch.len()], vec![0.0; batch.len()]];
        let mut gradients = [vec![[0.0; 3]; batch.len()], vec![[0.0; 3]; batch.len()]];
        for round in 0..6 {
            for e in 0..2 {
                ends[e].gradients(&points, &mut values[e], &mut gradients[e]);
            }
            for (i, ring) in batch.iter().enumerate() {
                let steep = [norm(gradients[0][i]), norm(gradients[1][i])];
                let (f, g) = (values[0][i] / steep[0], values[1][i] / steep[1]);
                let (a, b) = (
                    scale(gradients[0][i], 1.0 / steep[0]),
                    scale(gradients[1][i], 1.0 / steep[1]),
                );
                let c = dot(a, b);
                let at = nodes.at(ring.cell as usize);
                let span = |k: usize| (nodes.axes[k][at[k]], nodes.axes[k][at[k] + 1]);
                let size = (0..3)
                    .map(|k| span(k).1 - span(k).0)
                    .fold(f64::INFINITY, f64::min);
                // Surfaces within ten degrees of each other have no crease worth a vertex. (NaN fails as well.)
                if c.is_nan() || 1.0 - c * c <= 0.03 {
                    simple[i] = false;
                    continue;
                }
                if round == 5 {
                    // The curve may pass just outside the cell, in one that holds no node of the solid: then the
                    // place in the cell nearest to it still beats a chamfer, and lets the curve go on.
                    simple[i] &= f.abs().max(g.abs()) < 0.5 * size;
                    continue;
                }
                let det = 1.0 - c * c;
                let step = add(scale(a, (f - c * g) / det), scale(b, (g - c * f) / det));
                let next = sub(points[i], step);
                for k in 0..3 {
                    let (lo, hi) = span(k);
                    let inset = INSET * (hi - lo);
                    points[i][k] = next[k].clamp(lo + inset, hi - inset);
                }
            }
        }
        found.extend((0..batch.len()).map(|i| {
            simple[i].then(|| (points[i], [unit(gradients[0][i]), unit(gradients[1][i])]))
        }));
    }
    found
}
