//! The surface inside one tile.
//!
//! Marching cubes with every vertex strictly inside its own grid edge. Then the mesh is closed, manifold, free of
//! self-intersection and of degenerate triangles by construction (see `table`), whatever the field does; and rounding
//! to f32 cannot undo it, because rounding is monotone: it maps the grid to a grid and edges to edges.
//!
//! Two things move vertices, only ever along their edges:
//! - a bracketed Newton iteration puts them on the true surface, of lattice or region, whichever ends the solid first;
//! - a chord lies on one side of a curved surface, so a mesh with its vertices on the surface has a volume error of
//!   first order in curvature · h². Each triangle measures how far its middle is from the surface, and its vertices
//!   share the move that cancels its volume error. What is left is of fourth order.
//!
//! Where a grid plane lies on a flat face of the region (signed distance exactly zero at its nodes), vertices go to
//! the node itself, so the face and its straight edges are reproduced exactly.
//!
//! A tile looks one cell beyond itself. All it computes there is a function of the grid edge or triangle alone, done
//! in the same order, so neighbouring tiles find bit-identical vertices.

use crate::field::Field;
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::solid::Solid;

use super::grid::{Content, Grid, TILE, content};
use super::table::{EDGES, TRIANGLES};

/// What a vertex lies on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum On {
    /// The lattice.
    Lattice,
    /// The region's surface.
    Region,
    /// A grid plane that is a flat face of the region.
    Plane,
}

/// The surface in one tile.
#[derive(Default)]
pub(super) struct Patch {
    /// Vertex positions.
    pub vertices: Vec<Vec3>,
    /// Global key of each vertex: grid node · 4 + axis of its edge, or + 3 for the node itself.
    pub keys: Vec<u64>,
    /// Whether a neighbouring tile may use the vertex too.
    pub shared: Vec<bool>,
    /// Triangles of the tile's own cells.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, whether it lies on the region's surface.
    pub cut: Vec<bool>,
}

/// Buffers that one thread uses again and again.
#[derive(Default)]
pub(super) struct Scratch {
    field: Vec<f32>,
    region: Vec<f32>,
    points: Vec<Vec3>,
    values: Vec<f64>,
    gradients: Vec<Vec3>,
    solid: Vec<u64>,
    crossed: [Vec<u64>; 3],
    offset: [Vec<u32>; 3],
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
    own: Vec<bool>,
    moments: Vec<(f64, Vec3)>,
}

/// A vertex on the grid edge from the node `inside` (solid) towards its neighbour along `axis`.
#[derive(Clone, Copy)]
struct Vertex {
    /// Index in the block of the lower node of the edge.
    low: u32,
    axis: u8,
    /// Whether the solid node is the lower one.
    up: bool,
    on: On,
    /// Position on the edge from the solid node (0) to the void node (1).
    t: f64,
    /// Whether the vertex stands on the region's surface.
    skin: bool,
}

/// The nodes of a block, indexed.
struct Nodes<'a> {
    axes: [&'a [f64]; 3],
    shape: [usize; 3],
    stride: [usize; 3],
}

impl Nodes<'_> {
    fn at(&self, n: usize) -> [usize; 3] {
        [n % self.shape[0], n / self.stride[1] % self.shape[1], n / self.stride[2]]
    }

    fn position(&self, n: usize) -> Vec3 {
        let i = self.at(n);
        [self.axes[0][i[0]], self.axes[1][i[1]], self.axes[2][i[2]]]
    }

    /// Solid node, direction (with the edge's length) towards the void node.
    fn ray(&self, v: &Vertex) -> (Vec3, f64) {
        let low = v.low as usize;
        let i = self.at(low)[v.axis as usize];
        let axis = self.axes[v.axis as usize];
        let length = axis[i + 1] - axis[i];
        let mut p = self.position(low);
        if !v.up {
            p[v.axis as usize] = axis[i + 1];
        }
        (p, if v.up { length } else { -length })
    }

    fn place(&self, v: &Vertex) -> Vec3 {
        let (mut p, reach) = self.ray(v);
        p[v.axis as usize] += v.t * reach;
        p
    }
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 2048;

/// Extracts the surface of a tile; `None` when bounds or signs show that there is none.
pub(super) fn extract(solid: &Solid, grid: &Grid, tile: [usize; 3], s: &mut Scratch) -> Option<Patch> {
    let block = grid.block(tile);
    let Content::Surface { field, region } = content(solid, &block.bounds()) else { return None };
    let lattice = solid.field.as_deref().filter(|_| field);
    let shape = block.shape();
    let nodes = Nodes { axes: block.axes, shape, stride: [1, shape[0], shape[0] * shape[1]] };

    s.field.clear();
    s.region.clear();
    if let Some(f) = lattice {
        s.field.resize(block.len(), 0.0);
        f.fill(&block, &mut s.field);
    }
    if region {
        s.region.resize(block.len(), 0.0);
        solid.region.fill(&block, &mut s.region);
    }
    signs(s, shape);
    let count = crossings(s, shape);
    if count == 0 {
        return None;
    }
    list_vertices(s, &nodes);
    if let Some(f) = lattice {
        solve(s, &nodes, f, On::Lattice);
    }
    if region {
        solve(s, &nodes, &*solid.region, On::Region);
    }
    for v in &mut s.vertices {
        if v.on != On::Plane {
            v.t = v.t.clamp(grid.margin, 1.0 - grid.margin);
        } else {
            v.t = grid.margin;
        }
    }
    let first = [0, 1, 2].map(|a| tile[a] * TILE);
    let nodes_from = grid.nodes(tile).map(|r| r.start);
    // Cells of the tile itself, in block coordinates.
    let own = [0, 1, 2].map(|a| {
        let from = first[a] - nodes_from[a];
        from..(from + TILE).min(shape[a] - 1)
    });
    list_triangles(s, shape, &own);
    if !s.own.iter().any(|&o| o) {
        return None;
    }
    balance(s, &nodes, lattice, solid, grid.margin);
    let merged = merge_plane_vertices(s, &nodes);
    Some(gather(s, &nodes, grid, nodes_from, &own, merged.as_deref()))
}

/// The word of signs of each row of nodes.
fn signs(s: &mut Scratch, shape: [usize; 3]) {
    let (nx, rows) = (shape[0], shape[1] * shape[2]);
    let full = if nx == 64 { u64::MAX } else { (1u64 << nx) - 1 };
    s.solid.clear();
    s.solid.resize(rows, full);
    for samples in [&s.field, &s.region] {
        for (word, row) in s.solid.iter_mut().zip(samples.chunks_exact(nx)) {
            *word &= negative(row);
        }
    }
}

/// Bits of the values that are at most zero.
fn negative(row: &[f32]) -> u64 {
    let mut word = 0u64;
    for (i, part) in row.chunks(8).enumerate() {
        let mut byte = 0u64;
        for (b, v) in part.iter().enumerate() {
            byte |= u64::from(*v <= 0.0) << b;
        }
        word |= byte << (8 * i);
    }
    word
}

/// Marks the grid edges whose ends differ and numbers them: x-edges, then y, then z, each in node order.
fn crossings(s: &mut Scratch, shape: [usize; 3]) -> usize {
    let [nx, ny, nz] = shape;
    let inner = (1u64 << (nx - 1)) - 1;
    let mut count = 0u32;
    for axis in 0..3 {
        s.crossed[axis].clear();
        s.offset[axis].clear();
        for k in 0..nz {
            for j in 0..ny {
                let row = k * ny + j;
                let w = s.solid[row];
                let word = match axis {
                    0 => (w ^ (w >> 1)) & inner,
                    1 if j + 1 < ny => w ^ s.solid[row + 1],
                    2 if k + 1 < nz => w ^ s.solid[row + ny],
                    _ => 0,
                };
                s.crossed[axis].push(word);
                s.offset[axis].push(count);
                count += word.count_ones();
            }
        }
    }
    count as usize
}

/// The number of the vertex on an edge.
#[inline]
fn number(s: &Scratch, axis: usize, row: usize, i: usize) -> u32 {
    s.offset[axis][row] + (s.crossed[axis][row] & ((1u64 << i) - 1)).count_ones()
}

fn list_vertices(s: &mut Scratch, nodes: &Nodes) {
    s.vertices.clear();
    let nx = nodes.shape[0];
    for axis in 0..3 {
        for (row, &word) in s.crossed[axis].iter().enumerate() {
            let mut bits = word;
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let low = row * nx + i;
                let high = low + nodes.stride[axis];
                let up = s.solid[row] >> i & 1 == 1;
                let (a, b) = if up { (low, high) } else { (high, low) };
                let edge = |v: &Vec<f32>| if v.is_empty() { (-1.0, -1.0) } else { (v[a], v[b]) };
                let ((_, fb), (ra, rb)) = (edge(&s.field), edge(&s.region));
                let on = match (fb > 0.0, rb > 0.0) {
                    (_, true) if ra == 0.0 => On::Plane,
                    // Both may end the solid here; `solve` finds which does so first.
                    (_, true) => On::Region,
                    _ => On::Lattice,
                };
                let skin = on == On::Plane || (ra == 0.0 && rb == 0.0);
                s.vertices.push(Vertex { low: low as u32, axis: axis as u8, up, on, t: 1.0, skin });
            }
        }
    }
}

/// Finds where the function ends the solid on each edge that it crosses, and keeps the first end.
fn solve(s: &mut Scratch, nodes: &Nodes, f: &dyn Field, which: On) {
    let Scratch { field, region, points, values, gradients, vertices, .. } = s;
    let samples = if which == On::Lattice { &*field } else { &*region };
    let ends = |v: &Vertex| {
        let (low, high) = (v.low as usize, v.low as usize + nodes.stride[v.axis as usize]);
        if v.up { (samples[low], samples[high]) } else { (samples[high], samples[low]) }
    };
    // The void end is positive; planes are settled already.
    let todo: Vec<usize> =
        (0..vertices.len()).filter(|&i| vertices[i].on != On::Plane && ends(&vertices[i]).1 > 0.0).collect();
    for batch in todo.chunks(BATCH) {
        // Bracket [lo, hi], value at lo ≤ 0 < value at hi, and the current guess.
        let mut state: Vec<(f64, f64, f64)> = batch
            .iter()
            .map(|&i| {
                let (a, b) = ends(&vertices[i]);
                let (a, b) = (f64::from(a), f64::from(b));
                (0.0, 1.0, (-a / (b - a)).clamp(0.0, 1.0))
            })
            .collect();
        values.resize(batch.len(), 0.0);
        gradients.resize(batch.len(), [0.0; 3]);
        for _ in 0..3 {
            points.clear();
            points.extend(batch.iter().zip(&state).map(|(&i, &(_, _, t))| {
                let v = &vertices[i];
                let (mut p, reach) = nodes.ray(v);
                p[v.axis as usize] += t * reach;
                p
            }));
            f.gradients(points, values, gradients);
            for ((&i, st), (&v, g)) in batch.iter().zip(&mut state).zip(values.iter().zip(&*gradients)) {
                let vertex = &vertices[i];
                let (_, reach) = nodes.ray(vertex);
                let (lo, hi, t) = *st;
                let (lo, hi) = if v <= 0.0 { (t, hi) } else { (lo, t) };
                let slope = g[vertex.axis as usize] * reach;
                let newton = t - v / slope;
                let next = if newton >= lo && newton <= hi { newton } else { 0.5 * (lo + hi) };
                *st = (lo, hi, next);
            }
        }
        for (&i, &(_, _, t)) in batch.iter().zip(&state) {
            let v = &mut vertices[i];
            // The lattice is solved first; where it does not end the edge, t is still 1.
            if t <= v.t {
                (v.t, v.on) = (t, which);
            }
        }
    }
}

/// Lists the triangles of all cells of the block, halo included, and which belong to the tile itself.
fn list_triangles(s: &mut Scratch, shape: [usize; 3], own: &[std::ops::Range<usize>; 3]) {
    let [nx, ny, nz] = shape;
    let inner = (1u64 << (nx - 1)) - 1;
    s.triangles.clear();
    s.own.clear();
    let table = &*TRIANGLES;
    let mut found = Vec::new();
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            let row = k * ny + j;
            let rows = [row, row + 1, row + ny, row + ny + 1];
            let w = rows.map(|r| s.solid[r]);
            let any = w[0] | w[1] | w[2] | w[3];
            let all = w[0] & w[1] & w[2] & w[3];
            let mut bits = (any | any >> 1) & !(all & all >> 1) & inner;
            let mine = own[1].contains(&j) && own[2].contains(&k);
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let pair = |w: u64| (w >> i & 3) as usize;
                let case = pair(w[0]) | pair(w[1]) << 2 | pair(w[2]) << 4 | pair(w[3]) << 6;
                let mine = mine && own[0].contains(&i);
                for t in &table[case] {
                    found.push(t.map(|e| {
                        let (corner, axis) = EDGES[e as usize];
                        number(s, axis, rows[corner >> 1], i + (corner & 1))
                    }));
                    s.own.push(mine);
                }
            }
        }
    }
    s.triangles = found;
}

/// Moves vertices along their edges so that each triangle's chord error in volume cancels.
///
/// For a surface that is locally quadratic about a triangle with its corners on it, the mean distance of the triangle
/// from the surface is 3/4 of that at the centroid. The triangle hands this volume, with opposite sign, to its
/// corners in shares (n · e)², e the corner's edge: what faces its edge can move without running far along it.
fn balance(s: &mut Scratch, nodes: &Nodes, lattice: Option<&dyn Field>, solid: &Solid, margin: f64) {
    let Scratch { points, values, gradients, vertices, triangles, moments, .. } = s;
    moments.clear();
    moments.resize(vertices.len(), (0.0, [0.0; 3]));
    let places: Vec<Vec3> = vertices.iter().map(|v| nodes.place(v)).collect();
    for which in [On::Lattice, On::Region] {
        let f: &dyn Field = match (which, lattice) {
            (On::Lattice, Some(f)) => f,
            (On::Lattice, None) => continue,
            _ => &*solid.region,
        };
        let smooth: Vec<usize> =
            (0..triangles.len()).filter(|&i| triangles[i].iter().all(|&v| vertices[v as usize].on == which)).collect();
        for batch in smooth.chunks(BATCH) {
            points.clear();
            points.extend(batch.iter().map(|&i| {
                let [a, b, c] = triangles[i].map(|v| places[v as usize]);
                scale(add(add(a, b), c), 1.0 / 3.0)
            }));
            values.resize(batch.len(), 0.0);
            gradients.resize(batch.len(), [0.0; 3]);
            f.gradients(points, values, gradients);
            for ((&i, &v), g) in batch.iter().zip(&*values).zip(&*gradients) {
                let corners = triangles[i];
                let [a, b, c] = corners.map(|v| places[v as usize]);
                let n = cross(sub(b, a), sub(c, a));
                let (twice, steep) = (norm(n), norm(*g));
                if !(steep > 0.0) {
                    continue;
                }
                let volume = 0.75 * (v / steep) * 0.5 * twice;
                let share = corners.map(|v| n[vertices[v as usize].axis as usize].powi(2));
                let sum = share[0] + share[1] + share[2];
                for (v, share) in corners.into_iter().zip(share) {
                    let m = &mut moments[v as usize];
                    m.0 += volume * share / sum;
                    m.1 = add(m.1, scale(n, 0.5));
                }
            }
        }
    }
    for (v, (volume, area)) in vertices.iter_mut().zip(&*moments) {
        let (_, reach) = nodes.ray(v);
        // Volume gained per unit of t: a third of the ring's area as seen along the edge.
        let gain = area[v.axis as usize] * reach / 3.0;
        if gain > 0.0 {
            let step = (volume / gain).clamp(-0.25, 0.25);
            v.t = (v.t - step).clamp(margin, 1.0 - margin);
        }
    }
}

/// Joins the vertices that a node on a flat face of the region sends out, and puts them on the node.
///
/// Only where the void directions of the node form one corner of space (at most one per axis, the diagonals between
/// them void too), so that joining keeps the surface a manifold; elsewhere the vertices stay apart by the margin.
/// Returns for each vertex the one that stands for it.
fn merge_plane_vertices(s: &mut Scratch, nodes: &Nodes) -> Option<Vec<u32>> {
    if !s.vertices.iter().any(|v| v.on == On::Plane) {
        return None;
    }
    let solid = |i: [usize; 3]| s.solid[i[2] * nodes.shape[1] + i[1]] >> i[0] & 1 == 1;
    let mut stands: Vec<u32> = (0..s.vertices.len() as u32).collect();
    let mut first = std::collections::HashMap::new();
    for i in 0..s.vertices.len() {
        let v = s.vertices[i];
        if v.on != On::Plane {
            continue;
        }
        let axis = v.axis as usize;
        let node = v.low as usize + if v.up { 0 } else { nodes.stride[axis] };
        let at = nodes.at(node);
        if (0..3).any(|a| at[a] == 0 || at[a] + 1 >= nodes.shape[a]) {
            continue;
        }
        let step = |from: [usize; 3], a: usize, up: bool| {
            let mut to = from;
            to[a] = if up { to[a] + 1 } else { to[a] - 1 };
            to
        };
        // Void directions that leave the region.
        let leaves = |a: usize, up: bool| {
            let to = step(at, a, up);
            let n = to[0] + to[1] * nodes.stride[1] + to[2] * nodes.stride[2];
            !solid(to) && s.region[n] > 0.0
        };
        let out: Vec<(usize, bool)> =
            (0..3).flat_map(|a| [(a, false), (a, true)]).filter(|&(a, up)| leaves(a, up)).collect();
        let one_corner = (0..3).all(|a| out.iter().filter(|o| o.0 == a).count() < 2)
            && out.iter().all(|&(a, up)| {
                out.iter().all(|&(b, vp)| a == b || !solid(step(step(at, a, up), b, vp)))
            })
            && (out.len() < 3 || !solid(out.iter().fold(at, |p, &(a, up)| step(p, a, up))));
        if one_corner {
            stands[i] = *first.entry(node).or_insert(i as u32);
            s.vertices[i].t = 0.0;
        }
    }
    Some(stands)
}

/// Gathers the tile's own triangles and the vertices they use.
fn gather(
    s: &Scratch,
    nodes: &Nodes,
    grid: &Grid,
    from: [usize; 3],
    own: &[std::ops::Range<usize>; 3],
    stands: Option<&[u32]>,
) -> Patch {
    let mut patch = Patch::default();
    let mut renamed = vec![u32::MAX; s.vertices.len()];
    let all = grid.axes.each_ref().map(Vec::len);
    for (t, _) in s.triangles.iter().zip(&s.own).filter(|(_, own)| **own) {
        let t = stands.map_or(*t, |stands| t.map(|v| stands[v as usize]));
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            continue;
        }
        patch.cut.push(t.iter().all(|&v| s.vertices[v as usize].on != On::Lattice || s.vertices[v as usize].skin));
        patch.triangles.push(t.map(|v| {
            let slot = &mut renamed[v as usize];
            if *slot == u32::MAX {
                *slot = patch.vertices.len() as u32;
                let vertex = &s.vertices[v as usize];
                let at = nodes.at(vertex.low as usize);
                let axis = vertex.axis as usize;
                let on_node = vertex.t == 0.0;
                let mut key = at;
                if on_node && !vertex.up {
                    key[axis] += 1;
                }
                let border = |a: usize| key[a] == own[a].start || key[a] == own[a].end;
                patch.shared.push((0..3).any(|a| (a != axis || on_node) && border(a)));
                let key = [0, 1, 2].map(|a| (key[a] + from[a]) as u64);
                let node = key[0] + all[0] as u64 * (key[1] + all[1] as u64 * key[2]);
                patch.keys.push(node * 4 + if on_node { 3 } else { axis as u64 });
                patch.vertices.push(nodes.place(vertex));
            }
            *slot
        }));
    }
    patch
}
