//! The patch over a rim: a cone, or several side by side where more than one edge of the face divides it.
//!
//! Of all that is tried, that is taken which the face and its edges are nearest to. One cone cannot meet itself, for a rim is
//! a simple curve on the boundary of a convex cell; whether several meet is only known once they are there.

use super::web::Web;
use super::{Edges, Grid, Nodes, nearest, within};
use crate::extract::key::Key;
use crate::extract::knot::{Knots, middle};
use crate::field::Field;
use geometry::math::{Vec3, add, norm, scale, sub};

/// More pieces of edges than this in one cell are not looked at one by one: they are far shorter than a step.
const MOST: usize = 128;

/// A cell, and the face whose patch is in it.
#[derive(Clone, Copy)]
pub(super) struct Cell<'a> {
    pub grid: &'a Grid,
    nodes: &'a Nodes<'a>,
    /// Its lowest node.
    node: usize,
    face: usize,
    field: &'a dyn Field,
}

/// The rim of a patch.
pub(super) struct Rim {
    /// The points, counter-clockwise seen from the void.
    pub places: Vec<Vec3>,
    /// The sides of the cell that each lies in, as bits: corners lie in one.
    pub sides: Vec<u8>,
}

/// Triangles over a rim: by the numbers of its points, and from their count on those of the points inside.
pub(super) struct Patch {
    pub inner: Vec<Vec3>,
    pub triangles: Vec<[usize; 3]>,
    /// Along the edges that divide it from one point of the rim to another.
    pub ways: Vec<Vec<usize>>,
}

/// What may be over a rim.
pub(super) struct Patches {
    /// Where edges divide it, if that is nearer to the face than a single cone.
    pub divided: Option<Patch>,
    pub cone: Patch,
}

impl Patches {
    pub fn best(&self, divided: bool) -> &Patch {
        (self.divided.as_ref().filter(|_| divided)).unwrap_or(&self.cone)
    }
}

impl Patch {
    fn cone(rim: &Rim, apex: Vec3) -> Patch {
        let n = rim.places.len();
        Patch { inner: vec![apex], triangles: (0..n).map(|i| [n, i, (i + 1) % n]).collect(), ways: Vec::new() }
    }
}

impl Cell<'_> {
    /// A point kept within the cell.
    pub fn within(&self, p: Vec3) -> Vec3 {
        let at = self.nodes.at(self.node);
        [0, 1, 2].map(|a| within(self.grid, self.nodes.axes[a], at[a], p[a]))
    }

    /// The sum of squares of how far the face is from the middles between a point and others.
    pub fn off(&self, from: Vec3, to: &[Vec3]) -> f64 {
        let middles: Vec<Vec3> = to.iter().map(|p| scale(add(from, *p), 0.5)).collect();
        let mut off = vec![0.0; middles.len()];
        self.field.values(&middles, &mut off);
        off.iter().map(|d| d * d).sum()
    }
}

impl<'a> Knots<'a> {
    pub(super) fn cell_of(&self, cell: [usize; 3], face: usize) -> Cell<'a> {
        let grid = self.grid;
        Cell {
            grid,
            nodes: self.nodes,
            node: self.nodes.index(cell),
            face,
            field: &*grid.faces[self.local.live[face]].field,
        }
    }

    /// The rim of a patch, by the names of its points.
    pub(super) fn rim(&mut self, cell: [usize; 3], keys: &[Key]) -> Rim {
        let sides = |k: &Key| {
            let at = self.nodes.at(k.node());
            let flat = (0..3).filter(|a| k.spans() >> a & 1 == 0);
            flat.fold(0, |w, a| w | 1u8 << (2 * a + usize::from(at[a] > cell[a])))
        };
        let sides = keys.iter().map(sides).collect();
        let names: Vec<u32> = keys.iter().map(|k| self.vertex(*k)).collect();
        let places = names.iter().map(|v| self.places[*v as usize]).collect();
        Rim { places, sides }
    }
}

impl Edges {
    /// The patches over the only rim of a cell. `beyond`: as for [`Edges::apex`].
    pub(super) fn patches(&self, cell: Cell, rim: &Rim, beyond: Option<Vec3>) -> Patches {
        let (apex, off) = self.apex(cell, rim, beyond);
        let is_exact = off < (cell.grid.margin * cell.grid.step).powi(2);
        let web = (!is_exact).then(|| Web::new(cell, rim, self.pieces_in(cell)));
        let divided = web.and_then(|w| w.patch(cell)).filter(|d| d.1 < off);
        Patches { divided: divided.map(|d| d.0), cone: Patch::cone(rim, apex) }
    }

    /// The same over one of several rims.
    pub(super) fn patches_among(&self, cell: Cell, rim: &Rim) -> Patches {
        let web = Web::new(cell, rim, self.pieces_in(cell));
        let own: Vec<[Vec3; 2]> = web.pieces().collect();
        let (apex, off) = self.best(cell, rim, &own, None);
        let divided = web.patch(cell).filter(|d| d.1 < off);
        Patches { divided: divided.map(|d| d.0), cone: Patch::cone(rim, apex) }
    }

    /// Where a corner in a cell beside this one is nearer to the face than any point of this.
    pub(super) fn beyond(&self, cell: Cell) -> Option<Vec3> {
        self.beyond.get(&cell.node).copied()
    }

    /// The point over which the only patch of a cell becomes a cone: on the face's edges there, if any; or `beyond`, where a
    /// corner in a cell beside it is nearer. And the mean square of how far the cone is from the face, and the edges from it.
    pub(super) fn apex(&self, cell: Cell, rim: &Rim, beyond: Option<Vec3>) -> (Vec3, f64) {
        self.best(cell, rim, self.pieces_in(cell), beyond)
    }

    /// The pieces of edges in a cell; none if there are too many.
    fn pieces_in(&self, cell: Cell) -> &[[Vec3; 2]] {
        let here = self.pieces.get(&(cell.face, cell.node));
        here.filter(|p| p.len() <= MOST).map_or(&[], |p| p)
    }

    /// The apex where only some pieces of edges belong to the patch.
    fn best(&self, cell: Cell, rim: &Rim, pieces: &[[Vec3; 2]], beyond: Option<Vec3>) -> (Vec3, f64) {
        let in_sides = rim.places.iter().zip(&rim.sides);
        let corners = in_sides.filter(|(_, s)| s.count_ones() == 1);
        let corners: Vec<Vec3> = corners.map(|(p, _)| *p).collect();
        let of = if corners.is_empty() { &rim.places } else { &corners };
        let center = middle(of);
        let far = |p: &Vec3| norm(sub(*p, center));
        let mut tried = Vec::with_capacity(4);
        let near = pieces.iter().map(|s| nearest(*s, center));
        tried.extend(near.min_by(|a, b| far(a).total_cmp(&far(b))));
        if !pieces.is_empty() {
            let inside = self.corners.get(&(cell.face, cell.node));
            tried.extend(inside.into_iter().flatten().map(|c| c.0));
        }
        // An edge that runs through needs no other choice.
        if corners.len() == 2 && tried.len() == 1 && far(&tried[0]) < 0.1 * cell.grid.step {
            return (cell.within(tried[0]), 0.0);
        }
        tried.push(center);
        for p in &mut tried {
            *p = cell.within(*p);
        }
        tried.extend(beyond);
        let samples: Vec<Vec3> = pieces.iter().flat_map(|s| [s[0], scale(add(s[0], s[1]), 0.5), s[1]]).collect();
        let off = |apex: &Vec3| {
            let away = |p: &Vec3| {
                let spokes = rim.places.iter();
                let all = spokes.map(|r| norm(sub(*p, nearest([*apex, *r], *p))));
                all.fold(f64::INFINITY, f64::min).powi(2)
            };
            let missed: f64 = samples.iter().map(away).sum();
            cell.off(*apex, &rim.places) / rim.places.len() as f64 + missed / samples.len().max(1) as f64
        };
        let all = tried.iter().map(|p| (*p, off(p)));
        let best = all.min_by(|a, b| a.1.total_cmp(&b.1));
        best.unwrap_or((center, f64::INFINITY))
    }
}
