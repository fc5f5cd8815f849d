//! The surface within one tetrahedron: marching tetrahedra on its small steps.
//!
//! The solid is where f − t < 0 (lower), > 0 (upper), or where both f − t < 0 and f + t > 0 (sheet). Each inequality cuts a
//! small tetrahedron in a triangle or a quadrilateral whose corners lie strictly inside its edges.
//!
//! *Embedded.* The triangles of a small tetrahedron stay in it. The two sides of a sheet keep their order along every edge; a
//! triangle of one then lies on one side of the plane of the other, or crosses it only beyond the diagonal that both
//! quadrilaterals have, where the other is not. So sheets thinner than a step keep both their sides.
//!
//! *Fitting.* A corner depends on values and slopes at the ends of its edge alone, and these are the same in all bits
//! from every tetrahedron that has the edge.

use super::cubic_root::first_root;
use super::small_simplices::{Template, Tile, pair};
use crate::cell::Part;
use crate::cell::tet::{Bary, SubdivisionNodes};
use geometry::tetmesh::{EDGES, FACES};
use geometry::union_find::{find, unite};

/// Least distance of a corner of the surface from a node, in steps: a margin above rounding.
pub(super) const MARGIN: f64 = 0.01;

/// No component.
pub(super) const NONE: u32 = u32::MAX;

/// A run of consecutive points that belong to one component of the surface (`NONE`: to none) and one of the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ComponentRun {
    pub count: u32,
    pub surface: u32,
    pub solid: u32,
}

fn push(runs: &mut Vec<ComponentRun>, surface: u32, solid: u32) {
    match runs.last_mut() {
        Some(r) if (r.surface, r.solid) == (surface, solid) => r.count += 1,
        _ => runs.push(ComponentRun { count: 1, surface, solid }),
    }
}

/// A surface in a tetrahedron, with the caps of those faces that lie on the mesh's boundary.
#[derive(Clone, Default)]
pub(super) struct TetSurface {
    /// Barycentric coordinates of the vertices: corners on edges in the order of the edges, then nodes of caps in theirs.
    pub vertices: Vec<Bary>,
    /// The coordinates that are zero at each, a bit for each.
    pub zero: Vec<u8>,
    /// The nodes that each lies between, and the share of the way from the first to the second.
    pub between: Vec<([u32; 2], f64)>,
    /// How many of them are corners on edges.
    pub crossings: usize,
    /// Triangles for a positive tetrahedron, component by component, and whether each is a cap.
    pub triangles: Vec<([u32; 3], bool)>,
    /// Number of triangles of each component.
    pub triangle_counts: Vec<u32>,
    /// The component of each vertex.
    pub component: Vec<u32>,
    /// Number of components of the solid.
    pub solids: u32,
    /// The component of the solid that each component of the surface bounds.
    pub solid_of: Vec<u32>,
    /// On each closed face, all corners, then all solid nodes.
    pub faces: [Vec<ComponentRun>; 4],
    /// On each closed edge, all vertices of caps.
    pub boundary_edges: [Vec<ComponentRun>; 6],
}

/// Input of the cut: f and the level at the nodes, and the change of f along the edges by its slope at both ends.
pub(super) struct Core<'a> {
    pub values: &'a [f64],
    pub slopes: &'a [[f64; 2]],
    pub levels: CornerLevels<'a>,
}

/// The level at the nodes.
#[derive(Clone, Copy)]
pub(super) enum CornerLevels<'a> {
    Same(f64),
    Each(&'a [f64]),
}

impl CornerLevels<'_> {
    #[inline]
    fn at(&self, node: u32) -> f64 {
        match self {
            CornerLevels::Same(t) => *t,
            CornerLevels::Each(t) => t[node as usize],
        }
    }
}

/// One inequality: f against `sign` · t.
#[derive(Clone, Copy)]
struct LevelInequality {
    sign: f64,
    below: bool,
}

fn sides(part: Part) -> &'static [LevelInequality] {
    const BELOW: LevelInequality = LevelInequality { sign: 1.0, below: true };
    const ABOVE: LevelInequality = LevelInequality { sign: 1.0, below: false };
    const BACK: LevelInequality = LevelInequality { sign: -1.0, below: false };
    match part {
        Part::Lower => &[BELOW],
        Part::Upper => &[ABOVE],
        Part::Sheet => &[BELOW, BACK],
    }
}

/// Buffers, used for one tetrahedron after another.
#[derive(Default)]
pub(super) struct TetBuffers {
    /// The vertex on each edge for each side.
    corner: Vec<[u32; 2]>,
    /// The vertex at each node.
    node: Vec<u32>,
    solid: Vec<bool>,
    below: [Vec<bool>; 2],
    /// Union-find of vertices by the surface; of vertices, then nodes, by the solid.
    surface: Vec<u32>,
    inner: Vec<u32>,
}

impl TetSurface {
    /// Cuts the tetrahedron; `mask` has a bit for each face that is to be capped.
    pub fn new(
        nodes: &SubdivisionNodes,
        template: &Template,
        core: &Core,
        part: Part,
        mask: u8,
        scratch: &mut TetBuffers,
    ) -> TetSurface {
        let sides = sides(part);
        let mut out = TetSurface::default();
        let count = template.zero.len();
        scratch.solid.clear();
        scratch.solid.resize(count, true);
        for (side, is) in sides.iter().zip(&mut scratch.below) {
            is.clear();
            // Below the level, on the side where it matters strictly: a node on the level is not solid.
            is.extend((0..count).map(|i| {
                let (f, t) = (core.values[i], side.sign * core.levels.at(i as u32));
                if side.below { f < t } else { f <= t }
            }));
            for (s, b) in scratch.solid.iter_mut().zip(is) {
                *s &= *b == side.below;
            }
        }
        scratch.corner.clear();
        scratch.corner.resize(template.edges.len(), [NONE; 2]);
        out.corners(nodes, template, core, sides, scratch);
        scratch.node.clear();
        scratch.node.resize(count, NONE);
        for (face, tiles) in template.faces.iter().enumerate() {
            if mask >> face & 1 == 1 {
                for n in tiles.iter().flat_map(|t| t.nodes) {
                    scratch.node[n as usize] = 0;
                }
            }
        }
        for n in 0..count {
            if scratch.node[n] == 0 && scratch.solid[n] {
                scratch.node[n] = out.vertices.len() as u32;
                out.vertices.push(nodes.grid.bary(nodes.whole[n]));
                out.zero.push(template.zero[n]);
                out.between.push(([n as u32; 2], 0.0));
            } else {
                scratch.node[n] = NONE;
            }
        }
        out.cut(template, sides, scratch);
        for (face, tiles) in template.faces.iter().enumerate() {
            if mask >> face & 1 == 1 {
                out.cap(tiles, sides, scratch);
            }
        }
        out.sort(template, mask, scratch);
        out
    }

    /// The corners on the edges.
    fn corners(
        &mut self,
        nodes: &SubdivisionNodes,
        template: &Template,
        core: &Core,
        sides: &[LevelInequality],
        scratch: &mut TetBuffers,
    ) {
        let n = nodes.grid.n as f64;
        for (e, [a, b]) in template.edges.iter().enumerate() {
            let crossed = |s: usize| scratch.below[s][*a as usize] != scratch.below[s][*b as usize];
            let both = sides.len() == 2 && crossed(0) && crossed(1);
            let mut last = None;
            // The lower level first along the edge from its lower end.
            for s in (0..sides.len()).rev().filter(|s| crossed(*s)) {
                let (fa, fb) = (core.values[*a as usize], core.values[*b as usize]);
                let (ta, tb) = (sides[s].sign * core.levels.at(*a), sides[s].sign * core.levels.at(*b));
                let [ga, gb] = core.slopes[e].map(|g| g - (tb - ta));
                let up = scratch.below[s][*a as usize];
                let at = if up { first_root(fa - ta, fb - tb, ga, gb) } else { first_root(fb - tb, fa - ta, -gb, -ga) };
                let at = match last {
                    None if both => at.clamp(MARGIN, 1.0 - 2.0 * MARGIN),
                    None => at.clamp(MARGIN, 1.0 - MARGIN),
                    Some(l) => at.clamp(l + MARGIN, 1.0 - MARGIN),
                };
                last = Some(at);
                let at = if up { at } else { 1.0 - at };
                scratch.corner[e][s] = NONE - 1;
                self.vertices.push([at; 4]);
            }
            // By side, so that indices ascend alike in every tetrahedron.
            if both {
                let n = self.vertices.len();
                self.vertices.swap(n - 1, n - 2);
            }
            let first = self.vertices.len() - scratch.corner[e].iter().filter(|c| **c != NONE).count();
            let (ka, kb) = (nodes.whole[*a as usize], nodes.whole[*b as usize]);
            let zero = template.zero[*a as usize] & template.zero[*b as usize];
            let named = scratch.corner[e].iter_mut().filter(|c| **c != NONE);
            for (next, name) in named.enumerate() {
                let v = first + next;
                let at = self.vertices[v][0];
                self.vertices[v] = core::array::from_fn(|i| {
                    let (x, y) = (f64::from(ka[i]), f64::from(kb[i]));
                    (x + at * (y - x)) / n
                });
                self.zero.push(zero);
                self.between.push(([*a, *b], at));
                *name = v as u32;
            }
        }
        self.crossings = self.vertices.len();
    }

    /// The triangles in the small tetrahedra.
    fn cut(&mut self, template: &Template, sides: &[LevelInequality], scratch: &mut TetBuffers) {
        let count = self.vertices.len() as u32;
        scratch.surface.clear();
        scratch.surface.extend(0..count);
        scratch.inner.clear();
        scratch.inner.extend(0..count + template.zero.len() as u32);
        for small in &template.tets {
            let mut first = NONE;
            for (s, side) in sides.iter().enumerate() {
                let is = |i: usize| scratch.below[s][small.nodes[i] as usize] == side.below;
                let inside = (0..4).fold(0, |m, i| m | u8::from(is(i)) << i);
                if inside == 0 || inside == 15 {
                    continue;
                }
                let corner = |a: usize, b: usize| scratch.corner[small.edges[pair(a, b)] as usize][s];
                let (triangles, quad) = crossing(inside, small.even);
                let number = if quad { 2 } else { 1 };
                for t in &triangles[..number] {
                    let t = t.map(|[a, b]| corner(a, b));
                    self.triangles.push((t, false));
                    unite(&mut scratch.surface, t[0], t[1]);
                    unite(&mut scratch.surface, t[0], t[2]);
                }
                for v in triangles[..number].iter().flatten().map(|[a, b]| corner(*a, *b)) {
                    if first == NONE {
                        first = v;
                    }
                    unite(&mut scratch.inner, first, v);
                }
            }
            for n in small.nodes.iter().filter(|n| scratch.solid[**n as usize]) {
                if first == NONE {
                    first = count + n;
                }
                unite(&mut scratch.inner, first, count + n);
            }
        }
    }

    /// The solid's trace on a face: a polygon in each tile, its corners on the tile's edges in order.
    fn cap(&mut self, tiles: &[Tile], sides: &[LevelInequality], scratch: &mut TetBuffers) {
        for tile in tiles {
            let mut around = [NONE; 6];
            let mut n = 0;
            let mut apex = 0;
            for i in 0..3 {
                let (a, b) = (tile.nodes[i], tile.nodes[(i + 1) % 3]);
                if scratch.solid[a as usize] {
                    // A fan from a node has no triangle of three corners on one edge.
                    apex = n;
                    around[n] = scratch.node[a as usize];
                    n += 1;
                }
                let on = scratch.corner[tile.edges[i] as usize];
                let crossed = on.iter().filter(|v| **v != NONE).count();
                if crossed == 2 {
                    // From below −t the side of −t comes first.
                    let rises = scratch.below[1][a as usize];
                    let order = if rises { [on[1], on[0]] } else { on };
                    around[n..n + 2].copy_from_slice(&order);
                    n += 2;
                } else if crossed == 1 {
                    around[n] = if on[0] == NONE { on[1] } else { on[0] };
                    n += 1;
                }
                debug_assert!(crossed <= sides.len() && (crossed < 2 || b != a));
            }
            for i in 1..n.max(2) - 1 {
                let t = [apex, apex + i, apex + i + 1].map(|k| around[k % n]);
                self.triangles.push((t, true));
                unite(&mut scratch.surface, t[0], t[1]);
                unite(&mut scratch.surface, t[0], t[2]);
            }
        }
    }

    /// Numbers the components, sorts triangles by component, and lists the runs on faces and on edges of the boundary.
    fn sort(&mut self, template: &Template, mask: u8, scratch: &mut TetBuffers) {
        let count = self.vertices.len();
        for (n, v) in scratch.node.iter().enumerate() {
            if *v != NONE {
                unite(&mut scratch.inner, *v, (count + n) as u32);
            }
        }
        let mut number = vec![NONE; scratch.inner.len()];
        let mut solids = 0;
        let mut solid_of = |inner: &mut [u32], i: usize| {
            let root = find(inner, i as u32) as usize;
            if number[root] == NONE {
                number[root] = solids;
                solids += 1;
            }
            number[root]
        };
        let mut named = vec![NONE; count];
        self.component = vec![NONE; count];
        for v in 0..count {
            let root = find(&mut scratch.surface, v as u32) as usize;
            if named[root] == NONE {
                named[root] = self.solid_of.len() as u32;
                self.solid_of.push(solid_of(&mut scratch.inner, v));
            }
            self.component[v] = named[root];
        }
        self.triangle_counts = vec![0; self.solid_of.len()];
        for (t, _) in &self.triangles {
            self.triangle_counts[self.component[t[0] as usize] as usize] += 1;
        }
        if self.triangle_counts.len() > 1 {
            let component = &self.component;
            self.triangles.sort_by_key(|(t, _)| component[t[0] as usize]);
        }
        for v in 0..self.crossings {
            let (component, solid) = (self.component[v], self.solid_of[self.component[v] as usize]);
            for face in 0..4 {
                if self.zero[v] >> face & 1 == 1 {
                    push(&mut self.faces[face], component, solid);
                }
            }
        }
        for (n, zero) in template.zero.iter().enumerate() {
            if scratch.solid[n] {
                let solid = solid_of(&mut scratch.inner, count + n);
                for face in 0..4 {
                    if zero >> face & 1 == 1 {
                        push(&mut self.faces[face], NONE, solid);
                    }
                }
            }
        }
        self.solids = solids;
        for (e, [a, b]) in EDGES.iter().enumerate() {
            let off = 15 ^ (1u8 << a | 1 << b);
            if mask & off == 0 {
                continue;
            }
            for v in 0..count {
                if self.zero[v] & off == off {
                    push(&mut self.boundary_edges[e], self.component[v], self.solid_of[self.component[v] as usize]);
                }
            }
        }
    }
}

/// One or two triangles, their corners on the edges between pairs of the small tetrahedron's nodes, counter-clockwise
/// viewed from outside the nodes of `inside`.
fn crossing(inside: u8, even: bool) -> ([[[usize; 2]; 3]; 2], bool) {
    let within = |i: usize| inside >> i & 1 == 1;
    let alone = |of: bool| (0..4).find(|i| within(*i) == of).unwrap_or(0);
    let turned = |t: [[usize; 2]; 3]| [t[0], t[2], t[1]];
    let (triangles, quad, out) = match inside.count_ones() {
        2 => {
            let (p, r) = (alone(true), alone(false));
            let q = (p + 1..4).find(|i| within(*i)).unwrap_or(3);
            let s = (r + 1..4).find(|i| !within(*i)).unwrap_or(3);
            // (0, 1, 2, 3), (0, 2, 1, 3), … : positive if an even number of pairs is out of order.
            let order = [p, q, r, s];
            let swaps = EDGES.iter().filter(|[a, b]| order[*a] > order[*b]).count();
            let two = [[[p, r], [p, s], [q, s]], [[p, r], [q, s], [q, r]]];
            (two, true, swaps % 2 == 0)
        }
        n => {
            let v = alone(n == 1);
            let t = FACES[v].map(|i| [v, i]);
            ([t, t], false, n == 1)
        }
    };
    if out == even { (triangles, quad) } else { (triangles.map(turned), quad) }
}
