//! Edges that a face has of its own, such as those of a mesh, in cells that it crosses in one plain patch.
//!
//! The line in which a patch meets the side of a cell runs straight from one grid edge to another. Where an edge of the
//! face pierces the side it gets a corner there, if it then lies nearer to the face; and the patch becomes the cone over
//! its rim, from a point of the edge inside the cell. The rim stays a simple curve on the boundary of a convex cell, so
//! the cone cannot meet itself. Whether a side gets its corner depends on what both its cells see alike.
//!
//! Source: corners in the sides of cells after C. Ho, F. Wu, B. Chen, Y. Chuang and M. Ouhyoung, Cubical marching squares,
//! Comput. Graph. Forum 24 (2005) 537.

use std::collections::HashMap;

use crate::face::Creases;
use crate::field::Field;
use crate::math::{Vec3, add, dot, norm, scale, sub};

use super::grid::{Grid, Local};
use super::knot::middle;
use super::signs::Signs;
use super::tile::Nodes;

/// Edges of faces in the cells of a block.
#[derive(Default)]
pub(super) struct Edges {
    /// For each row of cells: those with a corner in a side.
    pub cells: Vec<u64>,
    /// The corners, by the lowest node of the side and the axis normal to it.
    sides: HashMap<(usize, usize), Vec3>,
    /// Pieces of edges in cells, by the cells' lowest nodes.
    pieces: HashMap<usize, Vec<[Vec3; 2]>>,
    /// Places where edges end, meet or bend, likewise.
    corners: HashMap<usize, Vec<Vec3>>,
}

/// A side of a cell that edges of a face pierce.
struct Pierced {
    low: usize,
    axis: usize,
    /// The ends of the line in which the face meets it.
    ends: [Vec3; 2],
    /// Where edges pierce it.
    at: Vec<Vec3>,
}

impl Edges {
    pub fn clear(&mut self, shape: [usize; 3]) {
        self.cells.clear();
        self.cells.resize(shape[1] * shape[2], 0);
        self.sides.clear();
        self.pieces.clear();
        self.corners.clear();
    }

    /// Whether there are any.
    pub fn any(&self) -> bool {
        !self.sides.is_empty()
    }

    /// The corner of a side of a cell.
    pub fn side(&self, low: usize, axis: usize) -> Option<Vec3> {
        self.sides.get(&(low, axis)).copied()
    }

    /// Adds the edges of a live face, as far as they lie in the block. `place` gives the vertices of plain cells: by the
    /// lower node of their grid edge, and its axis.
    pub fn find(
        &mut self,
        grid: &Grid,
        local: &Local,
        nodes: &Nodes,
        signs: &Signs,
        (face, segments): (usize, &[u32]),
        place: impl Fn(usize, usize) -> Option<Vec3>,
    ) {
        let of = &grid.faces[local.live[face]];
        let mut pierced: Vec<((usize, usize), Vec3)> = Vec::new();
        for &i in segments {
            self.walk(nodes, of.creases.segments[i as usize], &mut pierced);
        }
        // In the order of the segments where they pierce one side.
        pierced.sort_by_key(|p| p.0);
        let sides: Vec<Pierced> = pierced
            .chunk_by(|a, b| a.0 == b.0)
            .filter_map(|all| {
                let (low, axis) = all[0].0;
                let ends = ends(grid, local, nodes, signs, face, (low, axis), &place)?;
                let at = all.iter().map(|p| inside(grid, nodes, low, axis, p.1));
                Some(Pierced {
                    low,
                    axis,
                    ends,
                    at: at.collect(),
                })
            })
            .collect();
        for (side, corner) in sides.iter().zip(nearer(&*of.field, &sides)) {
            let Some(corner) = corner else { continue };
            self.sides.insert((side.low, side.axis), corner);
            let mut cell = nodes.at(side.low);
            for _ in 0..2 {
                self.cells[cell[2] * nodes.shape[1] + cell[1]] |= 1 << cell[0];
                cell[side.axis] = cell[side.axis].wrapping_sub(1);
            }
        }
        if !self.sides.is_empty() {
            for p in &of.creases.corners {
                if let Some(cell) = cell_of(nodes, *p) {
                    self.corners.entry(nodes.index(cell)).or_default().push(*p);
                }
            }
        }
    }

    /// Follows a piece of an edge through the cells of the block.
    fn walk(
        &mut self,
        nodes: &Nodes,
        [p, q]: [Vec3; 2],
        pierced: &mut Vec<((usize, usize), Vec3)>,
    ) {
        let along = sub(q, p);
        let mut stops = vec![0.0, 1.0];
        for a in 0..3 {
            let axis = nodes.axes[a];
            let [from, to] = [p, q].map(|x| axis.partition_point(|n| *n < x[a]));
            for n in from.min(to)..from.max(to) {
                let t = (axis[n] - p[a]) / along[a];
                stops.push(t);
                let mut at = add(p, scale(along, t));
                at[a] = axis[n];
                if let Some(mut cell) = cell_of(nodes, at) {
                    cell[a] = n;
                    pierced.push(((nodes.index(cell), a), at));
                }
            }
        }
        stops.sort_by(f64::total_cmp);
        for w in stops.windows(2).filter(|w| w[0] < w[1]) {
            let ends = [w[0], w[1]].map(|t| add(p, scale(along, t)));
            if let Some(cell) = cell_of(nodes, scale(add(ends[0], ends[1]), 0.5)) {
                self.pieces.entry(nodes.index(cell)).or_default().push(ends);
            }
        }
    }

    /// The point of a cell over which its patch becomes a cone: on the face's edges there, if any. `rim` are the points
    /// of its rim, `corners` those of them that are corners of sides.
    pub fn apex(
        &self,
        grid: &Grid,
        nodes: &Nodes,
        cell: usize,
        field: &dyn Field,
        rim: &[Vec3],
        corners: &[Vec3],
    ) -> Vec3 {
        let middle = middle(if corners.is_empty() { rim } else { corners });
        let mut tried = Vec::with_capacity(4);
        if let Some(pieces) = self.pieces.get(&cell) {
            let near = pieces.iter().map(|s| nearest(*s, middle));
            tried.extend(near.min_by(|a, b| far(*a, middle).total_cmp(&far(*b, middle))));
        }
        tried.extend(self.corners.get(&cell).into_iter().flatten());
        if tried.is_empty() {
            tried.push(middle);
        }
        let at = nodes.at(cell);
        for p in &mut tried {
            for a in 0..3 {
                p[a] = within(grid, nodes.axes[a], at[a], p[a]);
            }
        }
        if tried.len() == 1 {
            return tried[0];
        }
        let spokes: Vec<Vec3> = tried
            .iter()
            .flat_map(|p| rim.iter().map(|r| scale(add(*p, *r), 0.5)))
            .collect();
        let mut off = vec![0.0; spokes.len()];
        field.values(&spokes, &mut off);
        let worst = |i: usize| {
            let of = &off[i * rim.len()..(i + 1) * rim.len()];
            of.iter().fold(0.0f64, |m, d| m.max(d.abs()))
        };
        let best = (0..tried.len()).min_by(|a, b| worst(*a).total_cmp(&worst(*b)));
        tried[best.unwrap_or(0)]
    }
}

fn far(p: Vec3, q: Vec3) -> f64 {
    norm(sub(p, q))
}

/// The point of a segment nearest to another one.
fn nearest([p, q]: [Vec3; 2], to: Vec3) -> Vec3 {
    let along = sub(q, p);
    let square = dot(along, along);
    let t = if square > 0.0 {
        (dot(sub(to, p), along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    add(p, scale(along, t))
}

/// The cell of the block that a place lies in.
fn cell_of(nodes: &Nodes, p: Vec3) -> Option<[usize; 3]> {
    let mut cell = [0; 3];
    for a in 0..3 {
        let above = nodes.axes[a].partition_point(|n| *n <= p[a]);
        if above == 0 || above == nodes.axes[a].len() {
            return None;
        }
        cell[a] = above - 1;
    }
    Some(cell)
}

/// A coordinate kept within a step of the grid, away from its ends.
fn within(grid: &Grid, axis: &[f64], at: usize, x: f64) -> f64 {
    let (low, high) = (axis[at], axis[at + 1]);
    let margin = grid.margin * (high - low);
    x.clamp(low + margin, high - margin)
}

/// A point of a side kept within it.
fn inside(grid: &Grid, nodes: &Nodes, low: usize, axis: usize, mut p: Vec3) -> Vec3 {
    let at = nodes.at(low);
    for a in (0..3).filter(|a| *a != axis) {
        p[a] = within(grid, nodes.axes[a], at[a], p[a]);
    }
    p
}

/// The ends of the line in which a face meets a side, if both cells beside it are plain patches of that face.
fn ends(
    grid: &Grid,
    local: &Local,
    nodes: &Nodes,
    signs: &Signs,
    face: usize,
    (low, axis): (usize, usize),
    place: &impl Fn(usize, usize) -> Option<Vec3>,
) -> Option<[Vec3; 2]> {
    let _ = grid;
    let at = nodes.at(low);
    let laid = local.flat.iter().any(|f| f.axis == axis && f.at == at[axis]);
    if laid || at[axis] == 0 || (0..3).any(|a| at[a] + 1 >= nodes.shape[a]) {
        return None;
    }
    let mut below = at;
    below[axis] -= 1;
    let plain = |c: [usize; 3]| signs.plain[face][c[2] * nodes.shape[1] + c[1]] >> c[0] & 1 == 1;
    if !plain(at) || !plain(below) {
        return None;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (du, dv) = (nodes.stride[u], nodes.stride[v]);
    let edges = [(low, u), (low, v), (low + du, v), (low + dv, u)];
    let mut found = edges.iter().filter_map(|&(n, along)| {
        let sign = |n| signs.is_negative(face, n);
        (sign(n) != sign(n + nodes.stride[along])).then(|| place(n, along))
    });
    let ends = [found.next()??, found.next()??];
    found.next().is_none().then_some(ends)
}

/// For each side the point at which a corner brings its line nearest to the face; none if it does not bring it nearer.
fn nearer(field: &dyn Field, sides: &[Pierced]) -> Vec<Option<Vec3>> {
    let middle = |p: Vec3, q: Vec3| scale(add(p, q), 0.5);
    let mut places = Vec::with_capacity(3 * sides.len());
    for s in sides {
        places.push(middle(s.ends[0], s.ends[1]));
        for p in &s.at {
            places.extend(s.ends.map(|e| middle(e, *p)));
        }
    }
    let mut off = vec![0.0; places.len()];
    field.values(&places, &mut off);
    let mut rest = &off[..];
    let mut take = |n: usize| {
        let (first, others) = rest.split_at(n);
        rest = others;
        first.iter().fold(0.0f64, |m, d| m.max(d.abs()))
    };
    sides
        .iter()
        .map(|s| {
            let mut best = (take(1), None);
            for p in &s.at {
                let off = take(2);
                if off < best.0 {
                    best = (off, Some(*p));
                }
            }
            best.1
        })
        .collect()
}

/// The segments of a face's edges that come near the tiles, by the tiles' numbers.
pub(super) fn by_tile(grid: &Grid, creases: &Creases) -> HashMap<usize, Vec<u32>> {
    let mut found: HashMap<usize, Vec<u32>> = HashMap::new();
    let tiles = grid.tiles();
    for (i, [p, q]) in (0..).zip(&creases.segments) {
        let range = [0, 1, 2].map(|a| {
            let axis = &grid.axes[a];
            // The cells it lies in, and one more on either side: tiles look so far beyond themselves.
            let cell = |x: f64| axis.partition_point(|n| *n <= x).saturating_sub(1);
            let (low, high) = (cell(p[a].min(q[a])), cell(p[a].max(q[a])));
            let tile = |c: usize| (c / super::grid::TILE).min(tiles[a] - 1);
            tile(low.saturating_sub(2))..tile(high + 2) + 1
        });
        for k in range[2].clone() {
            for j in range[1].clone() {
                for t in range[0].clone() {
                    let tile = t + tiles[0] * (j + tiles[1] * k);
                    found.entry(tile).or_default().push(i);
                }
            }
        }
    }
    found
}
