//! The surface inside one tile.
//!
//! Marching cubes with every vertex strictly inside its own grid edge. Then the mesh is closed, manifold, free of
//! self-intersection and of degenerate triangles by construction (see `table`), whatever the field does; and rounding
//! to f32 cannot undo it, because rounding is monotone: it maps the grid to a grid and edges to edges.
//!
//! Two things move vertices, only ever along their edges:
//! - a bracketed Newton iteration puts them on the true surface, of lattice or region, whichever ends the solid first;
//! - a chord lies on one side of a curved surface, so a mesh with its vertices on the surface has a volume error of
//!   first order in curvature · h². Each triangle learns from the normals at its corners how far it lies from the
//!   surface, and its vertices share the move that cancels its volume error. What is left is of fourth order.
//!
//! Where a grid plane lies on a flat face of the region (signed distance exactly zero at its nodes), vertices go to
//! the node itself, so the face and its straight edges are reproduced exactly.
//!
//! Where lattice and region meet inside a cell, `crease` adds a vertex on their common curve.
//!
//! A tile looks one cell beyond itself. All it computes there is a function of the grid edge or triangle alone, done
//! in the same order, so neighbouring tiles find bit-identical vertices.

use std::ops::Range;

use multiversion::multiversion;

use crate::field::Field;
use crate::math::{Vec3, cross, dot, norm, sub, unit};
use crate::solid::Solid;

use super::crease;
use super::grid::{Content, Grid, TILE, content};
use super::table::{CASES, EDGES};

/// What a vertex lies on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum On {
    /// The lattice.
    Lattice,
    /// The region's surface.
    Region,
    /// A grid plane that is a flat face of the region.
    Plane,
    /// The curve where the lattice meets the region's surface.
    Crease,
}

/// The surface in one tile, by itself.
#[derive(Default)]
pub(super) struct Patch {
    /// Vertex positions.
    pub vertices: Vec<Vec3>,
    /// Global key of each vertex: grid node · 8 + axis of its edge, + 3 for the node itself, + 4 for its cell.
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
    /// Cells in which lattice and region may meet.
    rings: Vec<crease::Ring>,
    /// Vertices inside cells; their numbers follow those of the vertices on edges.
    centers: Vec<crease::Center>,
    /// Places of all vertices, and what they lie on.
    places: Vec<Vec3>,
    on: Vec<On>,
    /// Unit normals of the vertices on edges.
    normals: Vec<Vec3>,
    /// For each vertex on an edge: the volume it is to lose, and three times what it loses per mm along its edge.
    moments: Vec<(f64, f64)>,
    /// For each vertex on an edge, the one that stands for it; empty where all stand for themselves.
    stands: Vec<u32>,
}

/// A vertex on a grid edge, at `solid` + t · `reach` along `axis`.
#[derive(Clone, Copy)]
struct Vertex {
    /// The solid end of the edge.
    solid: Vec3,
    /// Signed length of the edge from its solid to its void end.
    reach: f64,
    /// Position on the edge from the solid end (0) to the void end (1).
    t: f64,
    /// Index in the block of the lower node of the edge.
    low: u32,
    axis: u8,
    on: On,
    /// Whether the vertex stands on the region's surface.
    skin: bool,
}

impl Vertex {
    #[inline]
    fn at(&self, t: f64) -> Vec3 {
        let mut p = self.solid;
        p[self.axis as usize] += t * self.reach;
        p
    }

    #[inline]
    fn place(&self) -> Vec3 {
        self.at(self.t)
    }

    /// Whether the solid end is the lower one.
    #[inline]
    fn up(&self) -> bool {
        self.reach > 0.0
    }
}

/// The nodes of a block, indexed.
pub(super) struct Nodes<'a> {
    pub axes: [&'a [f64]; 3],
    pub shape: [usize; 3],
    pub stride: [usize; 3],
}

impl Nodes<'_> {
    pub fn at(&self, n: usize) -> [usize; 3] {
        [
            n % self.shape[0],
            n / self.stride[1] % self.shape[1],
            n / self.stride[2],
        ]
    }
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
pub(super) const BATCH: usize = 2048;

/// The surface found in a tile, in the buffers that it was found in.
pub(super) struct View<'a> {
    s: &'a Scratch,
    nodes: Nodes<'a>,
    grid: &'a Grid,
    /// First node of the block.
    from: [usize; 3],
    /// Cells of the tile itself, in block coordinates.
    own: [Range<usize>; 3],
}

/// Extracts the surface of a tile; `None` when bounds or signs show that there is none.
pub(super) fn extract<'a>(
    solid: &Solid,
    grid: &'a Grid,
    tile: [usize; 3],
    s: &'a mut Scratch,
) -> Option<View<'a>> {
    let block = grid.block(tile);
    let Content::Surface { field, region } = content(solid, &block.bounds()) else {
        return None;
    };
    let lattice = solid.field.as_deref().filter(|_| field);
    let shape = block.shape();
    let nodes = Nodes {
        axes: block.axes,
        shape,
        stride: [1, shape[0], shape[0] * shape[1]],
    };

    // No samples mean: solid everywhere. Every sample is written, so nothing needs clearing.
    s.region.resize(if region { block.len() } else { 0 }, 0.0);
    s.field.resize(if field { block.len() } else { 0 }, 0.0);
    if region {
        solid.region.fill(&block, &mut s.region);
    }
    match lattice {
        Some(f) if region => f.fill_where(&block, &near_negative(&s.region, shape), &mut s.field),
        Some(f) => f.fill(&block, &mut s.field),
        None => {}
    }
    signs(s, shape);
    if crossings(s, shape) == 0 {
        return None;
    }
    list_vertices(s, &nodes);
    if region {
        find_planes(s, &*solid.region, grid.margin);
    }
    if let Some(f) = lattice {
        solve(s, &nodes, f, On::Lattice);
    }
    if region {
        solve(s, &nodes, &*solid.region, On::Region);
    }
    for v in &mut s.vertices {
        v.t = if v.on == On::Plane {
            grid.margin
        } else {
            v.t.clamp(grid.margin, 1.0 - grid.margin)
        };
    }
    let from = grid.nodes(tile).map(|r| r.start);
    let own = [0, 1, 2].map(|a| {
        let first = tile[a] * TILE - from[a];
        first..(first + TILE).min(shape[a] - 1)
    });
    list_triangles(s, shape, &own);
    if !s.own.iter().any(|&o| o) {
        return None;
    }
    s.places.clear();
    s.places.extend(s.vertices.iter().map(Vertex::place));
    s.on.clear();
    s.on.extend(s.vertices.iter().map(|v| v.on));
    s.centers.clear();
    if let (Some(f), true) = (lattice, region) {
        let draft = crease::Draft {
            triangles: &mut s.triangles,
            own: &mut s.own,
            places: &s.places,
            on: &s.on,
        };
        s.centers = crease::sharpen(&s.rings, draft, [f, &*solid.region], &nodes);
        s.places.extend(s.centers.iter().map(|c| c.place));
        s.on.extend(s.centers.iter().map(|_| On::Crease));
    }
    balance(s, grid.margin);
    merge_plane_vertices(s, &nodes);
    Some(View {
        s,
        nodes,
        grid,
        from,
        own,
    })
}

/// The word of signs of each row of nodes.
fn signs(s: &mut Scratch, shape: [usize; 3]) {
    let (nx, rows) = (shape[0], shape[1] * shape[2]);
    s.solid.clear();
    s.solid
        .resize(rows, if nx == 64 { u64::MAX } else { (1u64 << nx) - 1 });
    for samples in [&s.field, &s.region] {
        keep_negative(&mut s.solid, samples, nx);
    }
}

/// For each row, the nodes whose value is at most zero and those next to them.
fn near_negative(samples: &[f32], [nx, ny, nz]: [usize; 3]) -> Vec<u64> {
    let mut inside = vec![if nx == 64 { u64::MAX } else { (1u64 << nx) - 1 }; ny * nz];
    keep_negative(&mut inside, samples, nx);
    let at = |j: usize, k: usize| {
        if j < ny && k < nz {
            inside[k * ny + j]
        } else {
            0
        }
    };
    let around = |row: usize| {
        let (j, k) = (row % ny, row / ny);
        let w = at(j, k);
        let beside =
            at(j.wrapping_sub(1), k) | at(j + 1, k) | at(j, k.wrapping_sub(1)) | at(j, k + 1);
        w | w << 1 | w >> 1 | beside
    };
    (0..ny * nz).map(around).collect()
}

/// Keeps the bits of each word whose value in the word's row is at most zero.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn keep_negative(words: &mut [u64], samples: &[f32], nx: usize) {
    for (word, row) in words.iter_mut().zip(samples.chunks_exact(nx)) {
        let mut bytes = [0u8; 64];
        for (byte, v) in bytes.iter_mut().zip(row) {
            *byte = u8::from(*v <= 0.0);
        }
        let mut signs = 0u64;
        for (i, eight) in bytes.chunks_exact(8).enumerate() {
            let mut low = [0u8; 8];
            low.copy_from_slice(eight);
            // Eight bytes of 0 or 1 gathered into the top byte, the first lowest.
            let bits = u64::from_le_bytes(low).wrapping_mul(0x0102_0408_1020_4080) >> 56;
            signs |= bits << (8 * i);
        }
        *word &= signs;
    }
}

/// Marks the grid edges whose ends differ and numbers them: x-edges, then y, then z, each in node order.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
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
#[inline(always)]
fn number(s: &Scratch, axis: usize, row: usize, i: usize) -> u32 {
    s.offset[axis][row] + (s.crossed[axis][row] & ((1u64 << i) - 1)).count_ones()
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
fn list_vertices(s: &mut Scratch, nodes: &Nodes) {
    s.vertices.clear();
    let [nx, ny, _] = nodes.shape;
    for axis in 0..3 {
        for (row, &word) in s.crossed[axis].iter().enumerate() {
            let mut bits = word;
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let node = [i, row % ny, row / ny];
                let mut solid = [
                    nodes.axes[0][node[0]],
                    nodes.axes[1][node[1]],
                    nodes.axes[2][node[2]],
                ];
                let length = nodes.axes[axis][node[axis] + 1] - nodes.axes[axis][node[axis]];
                let low = row * nx + i;
                let high = low + nodes.stride[axis];
                let up = s.solid[row] >> i & 1 == 1;
                let (a, b) = if up { (low, high) } else { (high, low) };
                if !up {
                    solid[axis] = nodes.axes[axis][node[axis] + 1];
                }
                let (ra, rb) = if s.region.is_empty() {
                    (-1.0, -1.0)
                } else {
                    (s.region[a], s.region[b])
                };
                let on = match rb > 0.0 {
                    // Perhaps; `find_planes` looks.
                    true if ra == 0.0 => On::Plane,
                    // The lattice may end the solid before the region does; `solve` finds out.
                    true => On::Region,
                    false => On::Lattice,
                };
                let skin = on == On::Plane || (ra == 0.0 && rb == 0.0);
                let reach = if up { length } else { -length };
                s.vertices.push(Vertex {
                    solid,
                    reach,
                    t: 1.0,
                    low: low as u32,
                    axis: axis as u8,
                    on,
                    skin,
                });
            }
        }
    }
}

/// Tells edges that leave the region through a flat face on their solid node from those that run within the face and
/// leave it farther on, at the rim.
fn find_planes(s: &mut Scratch, region: &dyn Field, margin: f64) {
    let Scratch {
        points,
        values,
        vertices,
        ..
    } = s;
    let candidates: Vec<usize> = (0..vertices.len())
        .filter(|&i| vertices[i].on == On::Plane)
        .collect();
    points.clear();
    points.extend(candidates.iter().map(|&i| vertices[i].at(margin)));
    values.resize(points.len(), 0.0);
    region.values(points, values);
    for (&i, v) in candidates.iter().zip(&*values) {
        if *v <= 0.0 {
            vertices[i].on = On::Region;
        }
    }
}

/// A root in hand: the nearest places known to be solid and void, with their values, and the present guess.
#[derive(Clone, Copy)]
struct Root {
    vertex: u32,
    solid: (f64, f64),
    void: (f64, f64),
    t: f64,
}

/// A step this small (as a share of the edge) ends the iteration: its square is the error that is left.
const SETTLED: f64 = 1e-3;
/// Most rounds of the iteration.
const ROUNDS: usize = 6;

/// Finds where the function ends the solid on each edge that it crosses, and keeps the first end.
fn solve(s: &mut Scratch, nodes: &Nodes, f: &dyn Field, which: On) {
    let Scratch {
        field,
        region,
        points,
        values,
        gradients,
        vertices,
        normals,
        ..
    } = s;
    normals.resize(vertices.len(), [0.0; 3]);
    let samples = if which == On::Lattice {
        &*field
    } else {
        &*region
    };
    let mut roots = Vec::with_capacity(BATCH);
    let mut from = 0;
    while from < vertices.len() {
        roots.clear();
        while roots.len() < BATCH && from < vertices.len() {
            let v = &vertices[from];
            let (low, high) = (
                v.low as usize,
                v.low as usize + nodes.stride[v.axis as usize],
            );
            let (a, b) = if v.up() {
                (samples[low], samples[high])
            } else {
                (samples[high], samples[low])
            };
            // Vertices on flat faces are settled; on others the void end is positive if this function crosses.
            if v.on != On::Plane && b > 0.0 {
                let (a, b) = (f64::from(a), f64::from(b));
                // Along a flat face the value stays zero up to the rim: come from the void.
                let t = if a == 0.0 { 1.0 } else { -a / (b - a) };
                roots.push(Root {
                    vertex: from as u32,
                    solid: (0.0, a),
                    void: (1.0, b),
                    t,
                });
            }
            from += 1;
        }
        for round in 0..ROUNDS {
            points.clear();
            points.extend(roots.iter().map(|r| vertices[r.vertex as usize].at(r.t)));
            values.resize(roots.len(), 0.0);
            gradients.resize(roots.len(), [0.0; 3]);
            f.gradients(points, values, gradients);
            let mut open = 0;
            for n in 0..roots.len() {
                let (mut r, v) = (roots[n], values[n]);
                let vertex = &mut vertices[r.vertex as usize];
                *(if v <= 0.0 { &mut r.solid } else { &mut r.void }) = (r.t, v);
                let ((lo, a), (hi, b)) = (r.solid, r.void);
                let newton = r.t - v / (gradients[n][vertex.axis as usize] * vertex.reach);
                let next = if newton >= lo && newton <= hi {
                    newton
                } else {
                    lo - (hi - lo) * a / (b - a)
                };
                let step = (next - r.t).abs();
                r.t = next;
                if step > SETTLED && round + 1 < ROUNDS {
                    roots[open] = r;
                    open += 1;
                } else if r.t <= vertex.t {
                    // Nothing ended the solid before. (The lattice is solved first; where it does not, t is still 1.)
                    (vertex.t, vertex.on) = (r.t, which);
                    normals[r.vertex as usize] = unit(gradients[n]);
                }
            }
            roots.truncate(open);
            if roots.is_empty() {
                break;
            }
        }
    }
}

/// Lists the triangles of all cells of the block, halo included, and which belong to the tile itself; and the cells
/// with a single patch that meets both lattice and region, which `crease` fills in its own way.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
fn list_triangles(s: &mut Scratch, shape: [usize; 3], own: &[Range<usize>; 3]) {
    let [nx, ny, nz] = shape;
    let inner = (1u64 << (nx - 1)) - 1;
    let cases = &*CASES;
    let mixed = !s.field.is_empty() && !s.region.is_empty();
    let (mut triangles, mut rings) = (
        core::mem::take(&mut s.triangles),
        core::mem::take(&mut s.rings),
    );
    triangles.clear();
    rings.clear();
    s.own.clear();
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
                let corners = pair(w[0]) | pair(w[1]) << 2 | pair(w[2]) << 4 | pair(w[3]) << 6;
                let case = &cases[corners];
                let mine = mine && own[0].contains(&i);
                let mut names = [0u32; 12];
                for &e in &case.edges {
                    let (corner, axis) = EDGES[e as usize];
                    names[e as usize] = number(s, axis, rows[corner >> 1], i + (corner & 1));
                }
                let vertex = |e: u8| names[e as usize];
                if mixed && let Some(ring) = &case.ring {
                    let on = |w: On| ring.iter().any(|&e| s.vertices[vertex(e) as usize].on == w);
                    if on(On::Lattice) && on(On::Region) && !on(On::Plane) {
                        rings.push(crease::Ring {
                            cell: (row * nx + i) as u32,
                            corners: corners as u8,
                            points: ring.iter().map(|&e| vertex(e)).collect(),
                            // The fan about a vertex of the ring is kept until `crease` finds a better one.
                            triangles: triangles.len() as u32,
                            own: mine,
                        });
                    }
                }
                triangles.extend(case.triangles.iter().map(|t| t.map(&vertex)));
                s.own.resize(triangles.len(), mine);
            }
        }
    }
    (s.triangles, s.rings) = (triangles, rings);
}

/// Moves vertices along their edges so that each triangle's chord error in volume cancels.
///
/// A surface that is locally quadratic, through the corners of a triangle, lies on average Σ II(e)/24 above it, e the
/// triangle's edges and II the second fundamental form; and II(e) = Δn · e with Δn the change of the unit normal along
/// e. The triangle hands this volume, with opposite sign, to its corners in shares (n · e)², e now the corner's grid
/// edge: what faces its edge can move without running far along it. Vertices on creases and flat faces stay.
fn balance(s: &mut Scratch, margin: f64) {
    let Scratch {
        vertices,
        triangles,
        places,
        on,
        normals,
        centers,
        moments,
        ..
    } = s;
    moments.clear();
    moments.resize(vertices.len(), (0.0, 0.0));
    for t in triangles.iter() {
        let kinds = t.map(|v| on[v as usize]);
        // The surface that all corners lie on, if there is one.
        let Some(&which) = kinds.iter().find(|k| **k != On::Crease) else {
            continue;
        };
        if which == On::Plane || kinds.iter().any(|k| *k != which && *k != On::Crease) {
            continue;
        }
        let [a, b, c] = t.map(|v| places[v as usize]);
        let [na, nb, nc] = t.map(|v| match normals.get(v as usize) {
            Some(n) => *n,
            None => centers[v as usize - normals.len()].normals[usize::from(which == On::Region)],
        });
        let (ab, bc, ca) = (sub(b, a), sub(c, b), sub(a, c));
        // A turn of more than 45 degrees within a triangle is an edge of the region, not its curvature.
        if which == On::Region && dot(na, nb).min(dot(nb, nc)).min(dot(nc, na)) < 0.7 {
            continue;
        }
        let above = (dot(sub(nb, na), ab) + dot(sub(nc, nb), bc) + dot(sub(na, nc), ca)) / 24.0;
        let n = cross(ab, sub(c, a));
        let volume = above * 0.5 * norm(n);
        let facing = t.map(|v| vertices.get(v as usize).map_or(0.0, |v| n[v.axis as usize]));
        let sum = facing[0] * facing[0] + facing[1] * facing[1] + facing[2] * facing[2];
        if sum > 0.0 {
            for (&v, facing) in t.iter().zip(facing) {
                if let Some(m) = moments.get_mut(v as usize) {
                    m.0 += volume * facing * facing / sum;
                    m.1 += 0.5 * facing;
                }
            }
        }
    }
    for ((v, place), &(volume, area)) in vertices.iter_mut().zip(places).zip(&*moments) {
        // Volume gained per unit of t: a third of the ring's area as seen along the edge.
        let gain = area * v.reach / 3.0;
        if gain > 0.0 {
            let step = (volume / gain).clamp(-0.25, 0.25);
            v.t = (v.t + step).clamp(margin, 1.0 - margin);
            *place = v.place();
        }
    }
}

/// Joins the vertices that a node on a flat face of the region sends out, and puts them on the node.
///
/// Only where the void directions of the node form one corner of space (at most one per axis, the diagonals between
/// them void too), so that joining keeps the surface a manifold; elsewhere the vertices stay apart by the margin.
fn merge_plane_vertices(s: &mut Scratch, nodes: &Nodes) {
    s.stands.clear();
    if !s.vertices.iter().any(|v| v.on == On::Plane) {
        return;
    }
    let solid = |i: [usize; 3]| s.solid[i[2] * nodes.shape[1] + i[1]] >> i[0] & 1 == 1;
    s.stands.extend(0..s.vertices.len() as u32);
    let mut first = std::collections::HashMap::new();
    for i in 0..s.vertices.len() {
        let v = s.vertices[i];
        if v.on != On::Plane {
            continue;
        }
        let axis = v.axis as usize;
        let node = v.low as usize + if v.up() { 0 } else { nodes.stride[axis] };
        let at = nodes.at(node);
        if (0..3).any(|a| at[a] == 0 || at[a] + 1 >= nodes.shape[a]) {
            continue;
        }
        let step = |from: [usize; 3], a: usize, up: bool| {
            let mut to = from;
            to[a] = if up { to[a] + 1 } else { to[a] - 1 };
            to
        };
        // Directions in which a flat face on the node ends the region.
        let leaves = |a: usize, up: bool| {
            let low = if up { at } else { step(at, a, false) };
            let row = low[2] * nodes.shape[1] + low[1];
            s.crossed[a][row] >> low[0] & 1 == 1
                && s.vertices[number(s, a, row, low[0]) as usize].on == On::Plane
        };
        let out: Vec<(usize, bool)> = (0..3)
            .flat_map(|a| [(a, false), (a, true)])
            .filter(|&(a, up)| leaves(a, up))
            .collect();
        let one_corner = (0..3).all(|a| out.iter().filter(|o| o.0 == a).count() < 2)
            && out.iter().all(|&(a, up)| {
                out.iter()
                    .all(|&(b, vp)| a == b || !solid(step(step(at, a, up), b, vp)))
            })
            && (out.len() < 3 || !solid(out.iter().fold(at, |p, &(a, up)| step(p, a, up))));
        if one_corner {
            s.stands[i] = *first.entry(node).or_insert(i as u32);
            s.vertices[i].t = 0.0;
            s.places[i] = s.vertices[i].solid;
        }
    }
}

impl View<'_> {
    /// Places of the vertices that `triangles` names.
    pub fn places(&self) -> &[Vec3] {
        &self.s.places
    }

    /// The triangles of the tile's own cells, and whether they lie on the region's surface.
    pub fn triangles(&self) -> impl Iterator<Item = ([u32; 3], bool)> {
        let s = self.s;
        let stands = |v: u32| s.stands.get(v as usize).copied().unwrap_or(v);
        let own = s.triangles.iter().zip(&s.own).filter(|(_, own)| **own);
        own.map(move |(t, _)| {
            if s.stands.is_empty() {
                *t
            } else {
                t.map(stands)
            }
        })
        .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        .map(move |t| (t, self.is_cut(t)))
    }

    /// Whether a triangle lies on the region's surface: none of its corners is on the lattice alone, and where some
    /// are on the rim of a flat face, all are in that face's plane.
    fn is_cut(&self, t: [u32; 3]) -> bool {
        let s = self.s;
        let (mut rim, mut skin) = (false, true);
        for v in t.iter().filter_map(|&v| s.vertices.get(v as usize)) {
            rim |= v.on == On::Lattice;
            skin &= v.on != On::Lattice || v.skin;
        }
        let [a, b, c] = t.map(|v| s.places[v as usize]);
        skin && (!rim || (0..3).any(|k| a[k] == b[k] && b[k] == c[k]))
    }

    /// The tile's surface by itself, with what stitching needs.
    pub fn patch(&self) -> Patch {
        let mut patch = Patch::default();
        let mut renamed = vec![u32::MAX; self.s.places.len()];
        for (t, cut) in self.triangles() {
            patch.cut.push(cut);
            patch.triangles.push(t.map(|v| {
                let slot = &mut renamed[v as usize];
                if *slot == u32::MAX {
                    *slot = patch.vertices.len() as u32;
                    let (key, shared) = self.name(v as usize);
                    patch.vertices.push(self.s.places[v as usize]);
                    patch.keys.push(key);
                    patch.shared.push(shared);
                }
                *slot
            }));
        }
        patch
    }

    /// Global key of a vertex, and whether a neighbouring tile may use it as well.
    fn name(&self, v: usize) -> (u64, bool) {
        let View {
            s,
            nodes,
            grid,
            from,
            own,
        } = self;
        let (at, kind, shared) = match s.vertices.get(v) {
            Some(vertex) => {
                let mut at = nodes.at(vertex.low as usize);
                let axis = vertex.axis as usize;
                let on_node = vertex.t == 0.0;
                if on_node && !vertex.up() {
                    at[axis] += 1;
                }
                let border = |a: usize| at[a] == own[a].start || at[a] == own[a].end;
                let shared = (0..3).any(|a| (a != axis || on_node) && border(a));
                (at, if on_node { 3 } else { axis as u64 }, shared)
            }
            None => {
                let at = nodes.at(s.centers[v - s.vertices.len()].cell as usize);
                (
                    at,
                    4,
                    (0..3).any(|a| at[a] <= own[a].start || at[a] + 1 >= own[a].end),
                )
            }
        };
        let at = [0, 1, 2].map(|a| (at[a] + from[a]) as u64);
        let all = grid.axes.each_ref().map(|a| a.len() as u64);
        (
            (at[0] + all[0] * (at[1] + all[1] * at[2])) * 8 + kind,
            shared,
        )
    }
}
