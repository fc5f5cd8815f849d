//! The bodies of a tile's surface: what hangs together within the tile, and what joins it to the rest.
//!
//! A body's own figures are added up here, where its triangles are at hand. Beyond the tile it goes on through the
//! vertices that other tiles may use, known by their names; and through the solid, which is told along the grid's lines
//! in x. On such a line the surface lets in and out of the solid by turns, at vertices. The two ends of a stretch of
//! solid bound the same piece of it, so they join a cavity to what it lies in, without a look inside.

use geometry::math::{Aabb, Vec3, cross, dot, norm, sub};
use geometry::union_find::{find, unite};

use super::grid::TILE;
use super::signs::{bits, within};
use super::tile::View;

/// No body.
pub(super) const NONE: u32 = u32::MAX;

/// What is added up over the triangles and vertices of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sum {
    pub triangles: u64,
    /// Every vertex in one tile only.
    pub vertices: u64,
    /// Signed, by cones from a point that all tiles share; mm³ once the body is whole.
    pub volume: f64,
    /// On the lattice and on the region's surface, mm².
    pub area: [f64; 2],
    pub bounds: Aabb,
}

impl Sum {
    pub const NONE: Sum = Sum { triangles: 0, vertices: 0, volume: 0.0, area: [0.0; 2], bounds: Aabb::EMPTY };

    pub fn add(&mut self, o: &Sum) {
        self.triangles += o.triangles;
        self.vertices += o.vertices;
        self.volume += o.volume;
        self.area[0] += o.area[0];
        self.area[1] += o.area[1];
        self.bounds = self.bounds.union(o.bounds);
    }
}

/// What a grid line in x meets in a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// The line's number among those of the tile.
    pub row: u32,
    /// The body where it first comes out of the solid, if it enters the tile in the solid.
    pub first: u32,
    /// The body where it last enters the solid, if it leaves the tile in it.
    pub last: u32,
}

/// Lines that belong to a tile.
pub(super) const LINES: usize = TILE * TILE;

/// The bodies of a tile, in the order of their first vertices.
#[derive(Debug)]
pub(super) struct Bodies {
    pub tile: [usize; 3],
    /// Triangles, volumes and areas are added up while the triangles are taken.
    pub sums: Vec<Sum>,
    /// The vertices that other tiles may use: name and body.
    pub border: Vec<(u128, u32)>,
    /// Bodies with a stretch of solid between them.
    pub beside: Vec<(u32, u32)>,
    pub lines: Vec<Line>,
}

impl Bodies {
    /// Finds the bodies of a tile's surface and calls `take` for its triangles, body by body, so that what is left out
    /// later lies together: with the corners' numbers, and whether it lies on the region's surface. Volumes are taken
    /// about `middle`.
    pub fn each_triangle(view: &View, middle: Vec3, mut take: impl FnMut([u32; 3], bool)) -> Bodies {
        let places = view.places();
        let mut root = vec![NONE; places.len()];
        for (t, _) in view.triangles() {
            join(&mut root, t);
        }
        let (body, mut sums) = number(root, places);
        let mut add = |sum: &mut Sum, t: [u32; 3], cut: bool| {
            let [a, b, c] = t.map(|v| places[v as usize]);
            let n = cross(sub(b, a), sub(c, a));
            sum.triangles += 1;
            sum.volume += dot(sub(a, middle), n) / 6.0;
            sum.area[usize::from(cut)] += norm(n) / 2.0;
            take(t, cut);
        };
        // Added up apart: what is not in memory need not go through it.
        if let [sum] = &mut sums[..] {
            let mut whole = *sum;
            view.triangles().for_each(|(t, cut)| add(&mut whole, t, cut));
            *sum = whole;
        } else {
            let apart = sorted(view, &body, sums.len());
            for (sum, triangles) in sums.iter_mut().zip(apart) {
                let mut whole = *sum;
                for (t, cut) in triangles {
                    add(&mut whole, t, cut);
                }
                *sum = whole;
            }
        }
        let border = border(view, &body, &mut sums);
        let (lines, beside) = lines(view, &body);
        Bodies { tile: view.tile(), border, beside, lines, sums }
    }
}

/// Joins the corners of a triangle; a corner that none has named yet goes straight to the others' root.
#[inline]
fn join(root: &mut [u32], [a, b, c]: [u32; 3]) {
    let [x, y, z] = [a, b, c].map(|v| root[v as usize]);
    if x == y && y == z && x != NONE {
        return;
    }
    let known = [(x, a), (y, b), (z, c)].into_iter().find(|k| k.0 != NONE);
    let to = known.map_or(a, |(_, v)| find(root, v));
    root[to as usize] = to;
    for (r, v) in [(x, a), (y, b), (z, c)] {
        if r == NONE {
            root[v as usize] = to;
        } else if r != to {
            unite(root, v, to);
        }
    }
}

/// The body of each vertex, and the number and bounds of each body's vertices.
fn number(mut root: Vec<u32>, places: &[Vec3]) -> (Vec<u32>, Vec<Sum>) {
    let mut body = vec![NONE; root.len()];
    let mut sums: Vec<Sum> = Vec::new();
    for (v, place) in places.iter().enumerate() {
        if root[v] == NONE {
            continue;
        }
        let top = find(&mut root, v as u32) as usize;
        if body[top] == NONE {
            body[top] = sums.len() as u32;
            sums.push(Sum::NONE);
        }
        body[v] = body[top];
        let sum = &mut sums[body[v] as usize];
        sum.vertices += 1;
        sum.bounds = sum.bounds.with(*place);
    }
    (body, sums)
}

/// The vertices that other tiles may use, with their bodies; they are not counted in their tile.
fn border(view: &View, body: &[u32], sums: &mut [Sum]) -> Vec<(u128, u32)> {
    let mut border = Vec::new();
    view.each_shared(&mut |v| {
        let of = body[v as usize];
        if of != NONE {
            border.push((view.name(v as usize), of));
            sums[of as usize].vertices -= 1;
        }
    });
    border
}

/// The triangles of each body, in their order.
fn sorted(view: &View, body: &[u32], bodies: usize) -> Vec<Vec<([u32; 3], bool)>> {
    let mut of = vec![Vec::new(); bodies];
    for (t, cut) in view.triangles() {
        of[body[t[0] as usize] as usize].push((t, cut));
    }
    of
}

/// What the grid's lines in x meet in a tile, and which bodies have a stretch of solid between them on one.
fn lines(view: &View, body: &[u32]) -> (Vec<Line>, Vec<(u32, u32)>) {
    // Row, place, whether the solid begins there, body: in parts that are in order already.
    let mut met: Vec<(u32, f64, bool, u32)> = Vec::new();
    view.each_crossing(&mut |row, v, x, enters| {
        let body = body[v as usize];
        if body != NONE {
            met.push((row, x, enters, body));
        }
    });
    met.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (mut lines, mut beside) = (Vec::new(), Vec::new());
    for on_row in met.chunk_by(|a, b| a.0 == b.0) {
        let row = on_row[0].0;
        let (mut first, mut open) = (NONE, NONE);
        for (n, &(_, _, enters, body)) in on_row.iter().enumerate() {
            if enters {
                open = body;
                continue;
            }
            if n == 0 {
                first = body;
            } else if open != NONE && open != body && beside.last() != Some(&(open, body)) {
                beside.push((open, body));
            }
            open = NONE;
        }
        if first != NONE || open != NONE {
            lines.push(Line { row, first, last: open });
        }
    }
    (lines, beside)
}

impl View<'_> {
    /// Tells of every vertex at which a grid line in x, of those that belong to the tile, may pass through the surface:
    /// the line's number, the vertex's, its place on the line, and whether the solid lies beyond it.
    fn each_crossing(&self, found: &mut impl FnMut(u32, u32, f64, bool)) {
        let mine = within(&self.own[0]);
        let row_of = |j: usize, k: usize| {
            let inside = self.own[1].contains(&j) && self.own[2].contains(&k);
            inside.then(|| ((k - self.own[2].start) * TILE + j - self.own[1].start) as u32)
        };
        let ny = self.nodes.shape[1];
        for (face, numbers) in self.numbers().iter().enumerate() {
            for k in self.own[2].clone() {
                for j in self.own[1].clone() {
                    let Some(row) = row_of(j, k) else { continue };
                    let solid = self.negative(face, k * ny + j);
                    let (crossed, first) = numbers.row(0, k * ny + j);
                    for (n, i) in bits(crossed).enumerate() {
                        if mine >> i & 1 == 1 {
                            let v = first + n as u32;
                            found(row, v, self.places()[v as usize][0], solid >> i & 1 == 0);
                        }
                    }
                }
            }
        }
        for (v, key) in self.extra() {
            let [i, j, k] = self.nodes.at(key.node());
            let Some(row) = row_of(j, k) else { continue };
            let enters = if key.is_along(0) && mine >> i & 1 == 1 {
                key.faces().next().map(|f| (self.negative(f, k * ny + j) >> i & 1 == 0) != (key.index() == 2))
            } else if key.spans() == 0 {
                // A node of a cap: on lines that pass through the plane, it is where they do.
                let caps = self.flat().iter().filter(|f| f.axis == 0);
                caps.filter(|f| f.at == i).map(|f| !f.below).next()
            } else {
                None
            };
            if let Some(enters) = enters {
                found(row, v, self.places()[v as usize][0], enters);
            }
        }
    }
}
