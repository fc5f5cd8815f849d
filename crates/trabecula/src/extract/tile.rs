//! The surface inside one tile.
//!
//! Where a single smooth face of the solid crosses a cell, that is nearly everywhere: marching cubes, with every vertex
//! strictly inside its own grid edge. Then the mesh is closed, manifold, free of self-intersection and of degenerate
//! triangles by construction (see `table`), whatever the face does; and rounding to f32 cannot undo it, because
//! rounding is monotone: it maps the grid to a grid and edges to edges.
//!
//! Two things move these vertices, only ever along their edges:
//! - a bracketed Newton iteration puts them on the true surface;
//! - a chord lies on one side of a curved surface, so a mesh with its vertices on the surface has a volume error of
//!   first order in curvature · h². Each triangle learns from the normals at its corners how far it lies from the
//!   surface, and its vertices share the move that cancels its volume error. What is left is of fourth order.
//!
//! Where faces meet, `knot` cuts the cell up. Where a flat face of the solid is a plane of the grid, `cap` closes it.
//!
//! A tile looks one cell beyond itself. All it computes there is a function of the grid edge or triangle alone, done
//! in the same order, so neighbouring tiles find bit-identical vertices.

use std::collections::HashSet;
use std::ops::Range;

use multiversion::multiversion;

use crate::field::{Block, Field};
use crate::math::{Vec3, unit};

use super::bodies::Bodies;
use super::cap;
use super::grid::{Flat, Grid, Local, TILE};
use super::knot::{Extra, Key, Knots};
use super::signs::{Signs, below, bits, negative, within};
use super::table::{CASES, EDGES, MOST};

/// The surface in one tile, by itself.
#[derive(Default)]
pub(super) struct Patch {
    /// Vertex positions.
    pub vertices: Vec<Vec3>,
    /// For each vertex, its name among all tiles if a neighbouring one may use it too.
    pub shared: Vec<Option<u128>>,
    /// Triangles of the tile's own cells.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, whether it lies on the region's surface.
    pub cut: Vec<bool>,
}

/// Buffers that one thread uses again and again.
#[derive(Default)]
pub(super) struct Scratch {
    /// Values of the live faces at the nodes.
    samples: Vec<Vec<f32>>,
    signs: Signs,
    numbers: Vec<Numbers>,
    points: Vec<Vec3>,
    values: Vec<f64>,
    gradients: Vec<Vec3>,
    vertices: Vec<Vertex>,
    plain: Plain,
    /// Places of all vertices: those on grid edges, then the extra ones.
    places: Vec<Vec3>,
    /// Unit normals of the vertices on edges.
    normals: Vec<[f32; 3]>,
    /// For each vertex on an edge: the volume it is to lose, and three times what it loses per mm along its edge.
    moments: Vec<(f32, f32)>,
    extra: Extra,
}

/// Numbers of the vertices of one face: those on x-edges, then y, then z, each in node order.
#[derive(Default)]
pub(super) struct Numbers {
    crossed: [Vec<u64>; 3],
    offset: [Vec<u32>; 3],
}

impl Numbers {
    /// The number of the vertex on the edge along `axis` from node i of a row, if it has one.
    #[inline]
    pub fn get(&self, axis: usize, row: usize, i: usize) -> Option<u32> {
        (self.crossed[axis][row] >> i & 1 == 1).then(|| self.of(axis, row, i))
    }

    /// The edges along `axis` of a row that have a vertex, and the number of the first one's.
    pub fn row(&self, axis: usize, row: usize) -> (u64, u32) {
        (self.crossed[axis][row], self.offset[axis][row])
    }

    #[inline(always)]
    fn of(&self, axis: usize, row: usize, i: usize) -> u32 {
        self.offset[axis][row] + (self.crossed[axis][row] & ((1u64 << i) - 1)).count_ones()
    }
}

/// What plain cells make.
#[derive(Default)]
struct Plain {
    /// Face by face.
    triangles: Vec<[u32; 3]>,
    /// Number of triangles of each face.
    counts: Vec<usize>,
    kinds: Vec<Kind>,
    /// The cells beside knotted ones: cell and face.
    seams: Vec<([usize; 3], usize)>,
}

/// What a triangle of a plain cell is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Only to balance its neighbours: it belongs to another tile, or something finer takes its place.
    Neighbour,
    /// The lattice's surface.
    Lattice,
    /// The region's surface.
    Cut,
}

/// A vertex on a grid edge. Small, as a tile has ten thousand of them: what the block tells is not kept.
#[derive(Clone, Copy)]
struct Vertex {
    /// The lower node of the edge.
    node: [u8; 3],
    axis: u8,
    face: u8,
    /// Whether the solid end is the lower one.
    up: bool,
    /// Whether a knotted cell has the edge too: then its way of placing the vertex holds.
    fixed: bool,
    /// Position on the edge from the solid end (0) to the void end (1). Rounding moves the vertex by 1e-7 of the edge.
    t: f32,
}

impl Vertex {
    /// The lower node, as an index in the block.
    #[inline]
    fn low(&self, nodes: &Nodes) -> usize {
        nodes.index(self.node.map(usize::from))
    }

    /// Signed length of the edge from its solid to its void end.
    #[inline]
    fn reach(&self, nodes: &Nodes) -> f64 {
        let axis = usize::from(self.axis) % 3;
        let length = nodes.steps[axis][usize::from(self.node[axis]) % 64];
        if self.up { length } else { -length }
    }

    #[inline]
    fn at(&self, nodes: &Nodes, t: f64) -> Vec3 {
        let s = if self.up { t } else { 1.0 - t };
        core::array::from_fn(|a| {
            let n = usize::from(self.node[a]) % 64;
            let share = if a == usize::from(self.axis) { s } else { 0.0 };
            nodes.places[a][n] + share * nodes.steps[a][n]
        })
    }
}

/// The nodes of a block, indexed.
pub(super) struct Nodes<'a> {
    pub axes: [&'a [f64]; 3],
    pub shape: [usize; 3],
    pub stride: [usize; 3],
    /// The coordinates again, and the steps to the next, where any index is within bounds.
    places: [[f64; 64]; 3],
    steps: [[f64; 64]; 3],
}

impl<'a> Nodes<'a> {
    fn new(block: &Block<'a>) -> Nodes<'a> {
        let shape = block.shape();
        let (mut places, mut steps) = ([[0.0; 64]; 3], [[0.0; 64]; 3]);
        for (a, axis) in block.axes.iter().enumerate() {
            places[a][..axis.len()].copy_from_slice(axis);
            for (step, ends) in steps[a].iter_mut().zip(axis.windows(2)) {
                *step = ends[1] - ends[0];
            }
        }
        Nodes {
            axes: block.axes,
            shape,
            stride: [1, shape[0], shape[0] * shape[1]],
            places,
            steps,
        }
    }

    pub fn at(&self, n: usize) -> [usize; 3] {
        [
            n % self.shape[0],
            n / self.stride[1] % self.shape[1],
            n / self.stride[2],
        ]
    }

    pub fn index(&self, at: [usize; 3]) -> usize {
        at[0] + at[1] * self.stride[1] + at[2] * self.stride[2]
    }

    pub fn place(&self, n: usize) -> Vec3 {
        let at = self.at(n);
        [0, 1, 2].map(|a| self.axes[a][at[a]])
    }
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 512;

/// The surface found in a tile, in the buffers that it was found in.
pub(super) struct View<'a> {
    s: &'a Scratch,
    pub nodes: Nodes<'a>,
    grid: &'a Grid,
    local: Local,
    /// First node of the block.
    from: [usize; 3],
    /// Cells of the tile itself, in block coordinates.
    pub own: [Range<usize>; 3],
}

/// Extracts the surface of a tile; `None` when bounds or signs show that there is none.
pub(super) fn extract<'a>(
    grid: &'a Grid,
    tile: [usize; 3],
    s: &'a mut Scratch,
) -> Option<View<'a>> {
    let block = grid.block(tile);
    let range = grid.nodes(tile);
    let local = grid.local(&range, &block.bounds())?;
    let nodes = Nodes::new(&block);
    let from = range.map(|r| r.start);
    let own = [0, 1, 2].map(|a| {
        let first = tile[a] * TILE - from[a];
        first..(first + TILE).min(nodes.shape[a] - 1)
    });
    sample(s, grid, &local, &block);
    let crossed = s.signs.sort(&local);
    if !crossed && local.flat.is_empty() {
        return None;
    }
    list_vertices(s, &nodes);
    let mut first = 0;
    for (i, &face) in local.live.iter().enumerate() {
        let count = s.vertices[first..]
            .iter()
            .take_while(|v| usize::from(v.face) == i)
            .count();
        solve(s, &nodes, &*grid.faces[face].field, i, first..first + count);
        first += count;
    }
    list_triangles(s, grid, &local, &own);
    let margin = grid.margin as f32;
    s.places.clear();
    s.places.extend(s.vertices.iter_mut().map(|v| {
        v.t = v.t.clamp(margin, 1.0 - margin);
        v.at(&nodes, f64::from(v.t))
    }));
    balance(s, grid, &local, &nodes);
    finish(s, grid, &local, &nodes, &own);
    let own_triangles =
        s.plain.kinds.iter().any(|k| *k != Kind::Neighbour) || !s.extra.triangles.is_empty();
    own_triangles.then_some(View {
        s,
        nodes,
        grid,
        local,
        from,
        own,
    })
}

/// Fills the samples and signs of the live faces. The lattice's are dear, so they are asked for only where the region
/// can hold solid.
fn sample(s: &mut Scratch, grid: &Grid, local: &Local, block: &Block) {
    s.signs.shape = block.shape();
    let count = local.live.len();
    if s.samples.len() < count {
        s.samples.resize_with(count, Vec::new);
    }
    s.signs.negative.resize_with(count, Vec::new);
    let mut wanted = None;
    for (i, &f) in local.live.iter().enumerate() {
        let face = &grid.faces[f];
        let out = &mut s.samples[i];
        // Every sample is written, so nothing needs clearing.
        out.resize(block.len(), 0.0);
        if face.cut || (i == 0 && local.flat.is_empty()) {
            face.field.fill(block, out);
        } else {
            let wanted = wanted.get_or_insert_with(|| {
                let known = local.live.iter().filter(|f| grid.faces[**f].cut).count();
                s.signs.wanted(local, known)
            });
            face.field.fill_where(block, wanted, out);
        }
        negative(&mut s.signs.negative[i], out, block.shape()[0], face.cut);
    }
}

/// Lists the vertices of plain cells, face by face.
fn list_vertices(s: &mut Scratch, nodes: &Nodes) {
    let Scratch {
        signs,
        numbers,
        vertices,
        ..
    } = s;
    vertices.clear();
    numbers.resize_with(signs.negative.len(), Numbers::default);
    let any_knot = signs.knotted.iter().any(|w| *w != 0);
    for (face, numbers) in numbers.iter_mut().enumerate() {
        list_face(signs, numbers, vertices, nodes, face, any_knot);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
fn list_face(
    signs: &Signs,
    numbers: &mut Numbers,
    vertices: &mut Vec<Vertex>,
    nodes: &Nodes,
    face: usize,
    any_knot: bool,
) {
    let [nx, ny, nz] = nodes.shape;
    let inner = below(nx - 1);
    let n = &signs.negative[face];
    for axis in 0..3 {
        numbers.crossed[axis].clear();
        numbers.offset[axis].clear();
        for k in 0..nz {
            for j in 0..ny {
                let row = k * ny + j;
                let w = n[row];
                let change = match axis {
                    0 => (w ^ (w >> 1)) & inner,
                    1 if j + 1 < ny => w ^ n[row + 1],
                    2 if k + 1 < nz => w ^ n[row + ny],
                    _ => 0,
                };
                let used = change & signs.edges_of(&signs.plain[face], axis, j, k);
                numbers.crossed[axis].push(used);
                numbers.offset[axis].push(vertices.len() as u32);
                let fixed = if any_knot {
                    signs.edges_of(&signs.knotted, axis, j, k)
                } else {
                    0
                };
                let mut bits = used;
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let node = [i, j, k];
                    vertices.push(Vertex {
                        node: node.map(|n| n as u8),
                        axis: axis as u8,
                        face: face as u8,
                        up: w >> i & 1 == 1,
                        fixed: fixed >> i & 1 == 1,
                        t: 1.0,
                    });
                }
            }
        }
    }
}

/// A bracket of a root along an edge: positions and values at its solid and void end, and the next guess.
#[derive(Clone, Copy)]
struct Root {
    vertex: u32,
    solid: (f64, f64),
    void: (f64, f64),
    t: f64,
}

impl Root {
    /// Takes the value at the guess, and its slope along the edge; gives the step to the next guess.
    #[inline]
    fn narrow(&mut self, value: f64, slope: f64) -> f64 {
        *(if value <= 0.0 {
            &mut self.solid
        } else {
            &mut self.void
        }) = (self.t, value);
        let ((lo, a), (hi, b)) = (self.solid, self.void);
        let newton = self.t - value / slope;
        let next = if newton >= lo && newton <= hi {
            newton
        } else {
            lo - (hi - lo) * a / (b - a)
        };
        let step = next - self.t;
        self.t = next;
        step.abs()
    }
}

/// A step this small (as a share of the edge) ends the iteration: its square is the error that is left.
const SETTLED: f64 = 1e-3;
/// Most rounds of the iteration.
const ROUNDS: usize = 6;

/// Finds where a face crosses the edges of its vertices, and its normals there.
fn solve(s: &mut Scratch, nodes: &Nodes, f: &dyn Field, face: usize, which: Range<usize>) {
    let Scratch {
        samples,
        points,
        values,
        gradients,
        vertices,
        normals,
        ..
    } = s;
    normals.resize(vertices.len(), [0.0; 3]);
    let samples = &samples[face];
    let mut roots = Vec::with_capacity(BATCH);
    for from in which.clone().step_by(BATCH) {
        roots.clear();
        for (i, v) in (from..which.end)
            .zip(&vertices[from..which.end])
            .take(BATCH)
        {
            let low = v.low(nodes);
            let high = low + nodes.stride[usize::from(v.axis)];
            let (a, b) = if v.up { (low, high) } else { (high, low) };
            let (a, b) = (f64::from(samples[a]), f64::from(samples[b]));
            roots.push(Root {
                vertex: i as u32,
                solid: (0.0, a),
                void: (1.0, b),
                t: -a / (b - a),
            });
        }
        for round in 0..ROUNDS {
            points.clear();
            let place = |r: &Root| vertices[r.vertex as usize].at(nodes, r.t);
            points.extend(roots.iter().map(place));
            values.resize(roots.len(), 0.0);
            gradients.resize(roots.len(), [0.0; 3]);
            f.gradients(points, values, gradients);
            let mut open = 0;
            for n in 0..roots.len() {
                let mut r = roots[n];
                let v = &mut vertices[r.vertex as usize];
                let slope = gradients[n][usize::from(v.axis)] * v.reach(nodes);
                if r.narrow(values[n], slope) > SETTLED && round + 1 < ROUNDS {
                    roots[open] = r;
                    open += 1;
                } else {
                    v.t = r.t as f32;
                    normals[r.vertex as usize] = unit(gradients[n]).map(|x| x as f32);
                }
            }
            roots.truncate(open);
            if roots.is_empty() {
                break;
            }
        }
    }
}

/// Lists the triangles of all plain cells of the block, halo included; and the plain cells beside knotted ones, which
/// `knot` fills in its own way.
fn list_triangles(s: &mut Scratch, grid: &Grid, local: &Local, own: &[Range<usize>; 3]) {
    let Scratch {
        signs,
        numbers,
        plain,
        ..
    } = s;
    plain.triangles.clear();
    plain.counts.clear();
    plain.kinds.clear();
    plain.seams.clear();
    for (face, numbers) in numbers.iter().enumerate().take(local.live.len()) {
        let kind = if grid.faces[local.live[face]].cut {
            Kind::Cut
        } else {
            Kind::Lattice
        };
        let before = plain.triangles.len();
        list_patches(signs, numbers, face, own, kind, plain);
        plain.counts.push(plain.triangles.len() - before);
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
fn list_patches(
    signs: &Signs,
    numbers: &Numbers,
    face: usize,
    own: &[Range<usize>; 3],
    kind: Kind,
    out: &mut Plain,
) {
    let Plain {
        triangles,
        kinds,
        seams,
        ..
    } = out;
    let [_, ny, nz] = signs.shape;
    let cases = &*CASES;
    let mine_x = within(&own[0]);
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            let row = k * ny + j;
            let mut bits = signs.plain[face][row];
            if bits == 0 {
                continue;
            }
            let mine = if own[1].contains(&j) && own[2].contains(&k) {
                mine_x
            } else {
                0
            };
            let mut seam = 0;
            if mine != 0 {
                let kn = &signs.knotted;
                let here = kn[row];
                // The block's last row of words holds no cells, so the upper neighbours exist; the lower ones do for
                // cells of the tile itself, except at the grid's padding.
                let below =
                    if j > 0 { kn[row - 1] } else { 0 } | if k > 0 { kn[row - ny] } else { 0 };
                seam = (here << 1 | here >> 1 | kn[row + 1] | kn[row + ny] | below) & mine;
            }
            // For each edge of a cell, the row of grid edges that it is of: its crossings, and the first one's number.
            let rows = [row, row + 1, row + ny, row + ny + 1];
            let crossed = EDGES.map(|(corner, axis)| numbers.crossed[axis][rows[corner >> 1]]);
            let first = EDGES.map(|(corner, axis)| numbers.offset[axis][rows[corner >> 1]]);
            let signs = rows.map(|r| signs.negative[face][r]);
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let pair = |w: u64| (w >> i & 3) as usize;
                let corners = pair(signs[0])
                    | pair(signs[1]) << 2
                    | pair(signs[2]) << 4
                    | pair(signs[3]) << 6;
                let case = &cases[corners];
                // All edges, crossed or not, and room for the most triangles: to count them takes longer. Sixteen
                // names, so that four bits never lead outside.
                let below = [(1u64 << i) - 1, (2u64 << i) - 1];
                let mut names = [0u32; 16];
                for (e, &(corner, _)) in EDGES.iter().enumerate() {
                    names[e] = first[e] + (crossed[e] & below[corner & 1]).count_ones();
                }
                let mut kind = if mine >> i & 1 == 1 {
                    kind
                } else {
                    Kind::Neighbour
                };
                if seam >> i & 1 == 1 {
                    seams.push(([i, j, k], face));
                    kind = Kind::Neighbour;
                }
                let count = triangles.len() + case.count;
                triangles
                    .extend_from_slice(&case.triangles.map(|t| t.map(|e| names[e as usize & 15])));
                triangles.truncate(count);
                kinds.extend_from_slice(&[kind; MOST]);
                kinds.truncate(count);
            }
        }
    }
}

/// Moves vertices along their edges so that each triangle's chord error in volume cancels.
///
/// A surface that is locally quadratic, through the corners of a triangle, lies on average Σ II(e)/24 above it, e the
/// triangle's edges and II the second fundamental form; and II(e) = Δn · e with Δn the change of the unit normal along
/// e. The triangle hands this volume, with opposite sign, to its corners in shares (n · e)², e now the corner's grid
/// edge: what faces its edge can move without running far along it.
fn balance(s: &mut Scratch, grid: &Grid, local: &Local, nodes: &Nodes) {
    s.moments.clear();
    s.moments.resize(s.vertices.len(), (0.0, 0.0));
    let mut rest = &s.plain.triangles[..];
    for (face, numbers) in s.numbers.iter().enumerate().take(local.live.len()) {
        let (triangles, others) = rest.split_at(s.plain.counts[face]);
        rest = others;
        // The face's vertices on edges along x come first, then y, then z.
        let starts = [numbers.offset[1][0], numbers.offset[2][0]];
        let edged = grid.faces[local.live[face]].edged;
        share_out(
            triangles,
            starts,
            edged,
            &s.places,
            &s.normals,
            &mut s.moments,
        );
    }
    let margin = grid.margin as f32;
    for ((v, place), &(volume, area)) in s.vertices.iter_mut().zip(&mut s.places).zip(&s.moments) {
        // Volume gained per unit of t: a third of the ring's area as seen along the edge.
        let gain = area * v.reach(nodes) as f32 / 3.0;
        if gain > 0.0 {
            let step = (volume / gain).clamp(-0.25, 0.25);
            v.t = (v.t + step).clamp(margin, 1.0 - margin);
            *place = v.at(nodes, f64::from(v.t));
        }
    }
}

/// Gives the corners of a face's triangles their shares. `edged`: the face may have edges of its own.
///
/// Single precision is ample for a move that is a small share of an edge, and neighbouring tiles still agree: it is used
/// on differences of places that they have in common.
#[multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn share_out(
    triangles: &[[u32; 3]],
    starts: [u32; 2],
    edged: bool,
    places: &[Vec3],
    normals: &[[f32; 3]],
    moments: &mut [(f32, f32)],
) {
    type Short = [f32; 3];
    let sub = |a: Short, b: Short| -> Short { core::array::from_fn(|i| a[i] - b[i]) };
    let dot = |a: Short, b: Short| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for t in triangles {
        let [a, b, c] = t.map(|v| places[v as usize]);
        let [na, nb, nc] = t.map(|v| normals[v as usize]);
        let edge = |p: Vec3, q: Vec3| -> Short { core::array::from_fn(|i| (q[i] - p[i]) as f32) };
        let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
        // A turn of more than 45 degrees within a triangle is an edge of the face, not its curvature.
        if edged && dot(na, nb).min(dot(nb, nc)).min(dot(nc, na)) < 0.7 {
            continue;
        }
        let above = (dot(sub(nb, na), ab) + dot(sub(nc, nb), bc) + dot(sub(na, nc), ca)) / 24.0;
        let n = [
            ca[1] * ab[2] - ca[2] * ab[1],
            ca[2] * ab[0] - ca[0] * ab[2],
            ca[0] * ab[1] - ca[1] * ab[0],
        ];
        let volume = above * 0.5 * dot(n, n).sqrt();
        let facing = t.map(|v| match v {
            v if v < starts[0] => n[0],
            v if v < starts[1] => n[1],
            _ => n[2],
        });
        let sum = dot(facing, facing);
        if sum > 0.0 {
            let share = volume / sum;
            for (&v, facing) in t.iter().zip(facing) {
                let m = &mut moments[v as usize];
                m.0 += share * facing * facing;
                m.1 += 0.5 * facing;
            }
        }
    }
}

/// Adds what plain cells do not make: knots, the seams around them, and caps.
fn finish(s: &mut Scratch, grid: &Grid, local: &Local, nodes: &Nodes, own: &[Range<usize>; 3]) {
    s.extra.clear();
    let knotted = s.signs.knotted.iter().any(|w| *w != 0);
    if !knotted && local.flat.is_empty() {
        return;
    }
    let mut knots = Knots {
        nodes,
        grid,
        local,
        samples: &s.samples,
        signs: &s.signs,
        numbers: &s.numbers,
        places: &mut s.places,
        extra: &mut s.extra,
        moved: HashSet::new(),
    };
    if knotted {
        knots.all(own);
    }
    for (i, v) in s.vertices.iter().enumerate().filter(|(_, v)| v.fixed) {
        let key = Key::new(v.low(nodes), &[1 << v.axis], &[usize::from(v.face)]);
        knots.places[i] = knots.place(key);
    }
    for &(cell, face) in &s.plain.seams {
        knots.seam(cell, face);
    }
    for flat in 0..local.flat.len() {
        cap::close(&mut knots, flat, own);
    }
}

impl View<'_> {
    /// Places of the vertices that `triangles` names.
    pub fn places(&self) -> &[Vec3] {
        &self.s.places
    }

    /// The triangles of the tile's own cells, and whether they lie on the region's surface.
    pub fn triangles(&self) -> impl Iterator<Item = ([u32; 3], bool)> {
        let plain = self.s.plain.triangles.iter().zip(&self.s.plain.kinds);
        plain
            .filter(|(_, k)| **k != Kind::Neighbour)
            .map(|(t, k)| (*t, *k == Kind::Cut))
            .chain(self.s.extra.triangles.iter().copied())
    }

    /// The tile's surface by itself, body by body, with what stitching needs; and its bodies.
    pub fn patch(&self, middle: Vec3) -> (Patch, Bodies) {
        let mut patch = Patch::default();
        let mut renamed = vec![u32::MAX; self.s.places.len()];
        let mut shared = vec![false; self.s.places.len()];
        self.each_shared(&mut |v| shared[v as usize] = true);
        let bodies = Bodies::each_triangle(self, middle, |t, cut| {
            patch.cut.push(cut);
            patch.triangles.push(t.map(|v| {
                let slot = &mut renamed[v as usize];
                if *slot == u32::MAX {
                    *slot = patch.vertices.len() as u32;
                    patch.vertices.push(self.s.places[v as usize]);
                    patch
                        .shared
                        .push(shared[v as usize].then(|| self.name(v as usize)));
                }
                *slot
            }));
        });
        (patch, bodies)
    }

    /// The tile's position among the tiles.
    pub fn tile(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| (self.from[a] + self.own[a].start) / TILE)
    }

    /// For each live face, the numbers of its vertices on grid edges.
    pub fn numbers(&self) -> &[Numbers] {
        &self.s.numbers[..self.local.live.len()]
    }

    /// Where a live face is negative on a row of nodes.
    pub fn negative(&self, face: usize, row: usize) -> u64 {
        self.s.signs.negative[face][row]
    }

    /// The faces that are node planes.
    pub fn flat(&self) -> &[Flat] {
        &self.local.flat
    }

    /// The other vertices, with their names in the block.
    pub fn extra(&self) -> impl Iterator<Item = (u32, Key)> {
        (self.s.vertices.len() as u32..).zip(self.s.extra.keys.iter().copied())
    }

    fn key(&self, v: usize) -> Key {
        match self.s.vertices.get(v) {
            Some(v) => Key::new(v.low(&self.nodes), &[1 << v.axis], &[usize::from(v.face)]),
            None => self.s.extra.keys[v - self.s.vertices.len()],
        }
    }

    /// Tells of the vertices that a neighbouring tile may use as well, in their order.
    pub fn each_shared(&self, found: &mut impl FnMut(u32)) {
        let borders = |a: usize| [self.own[a].start, self.own[a].end];
        let at_x = borders(0).into_iter().fold(0, |w, i| w | 1u64 << i);
        let [_, ny, nz] = self.nodes.shape;
        for numbers in self.numbers() {
            for axis in 0..3 {
                for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
                    let whole = (axis != 1 && borders(1).contains(&j))
                        || (axis != 2 && borders(2).contains(&k));
                    let mask = match axis {
                        _ if whole => u64::MAX,
                        0 => continue,
                        _ => at_x,
                    };
                    let (crossed, first) = numbers.row(axis, k * ny + j);
                    for i in bits(crossed & mask) {
                        found(first + (crossed & below(i)).count_ones());
                    }
                }
            }
        }
        for (v, key) in self.extra() {
            let (at, spans) = (self.nodes.at(key.node()), key.spans());
            if (0..3).any(|a| spans >> a & 1 == 0 && borders(a).contains(&at[a])) {
                found(v);
            }
        }
    }

    /// The name of a vertex among all tiles.
    pub fn name(&self, v: usize) -> u128 {
        let key = self.key(v);
        let at = self.nodes.at(key.node());
        let all = self.grid.axes.each_ref().map(|a| a.len() as u128);
        let at = [0, 1, 2].map(|a| (at[a] + self.from[a]) as u128);
        let node = at[0] + all[0] * (at[1] + all[1] * at[2]);
        key.global(node, |f| self.local.live[f])
    }
}
