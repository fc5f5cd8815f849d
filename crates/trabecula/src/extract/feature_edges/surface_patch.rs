//! The patch over a boundary loop: a cone, or several face by face where more than one edge of the surface divides it.
//!
//! Of all that is tried, that is taken which the surface and its edges are nearest to. One cone cannot meet itself, for a boundary loop is
//! a simple curve on the boundary of a convex cell; whether several meet is only known once they are there.

use super::edge_graph::EdgeGraph;
use super::{EdgeStore, Grid, Nodes, nearest, within};
use crate::extract::feature_cells::{FeatureCells, middle};
use crate::extract::vertex_id::VertexId;
use crate::field::Field;
use geometry::math::{Vec3, add, norm, scale, sub};

/// More pieces of edges than this in one cell are not looked at one by one: they are far shorter than a step.
const MOST: usize = 128;

/// A cell, and the surface whose patch is in it.
#[derive(Clone, Copy)]
pub(super) struct Cell<'a> {
    pub grid: &'a Grid,
    nodes: &'a Nodes<'a>,
    /// Its lowest node.
    node: usize,
    surface: usize,
    field: &'a dyn Field,
}

/// The boundary loop of a patch.
pub(super) struct BoundaryLoop {
    /// The points, counter-clockwise seen from the void.
    pub positions: Vec<Vec3>,
    /// The faces of the cell that each lies in, as bits: corners lie in one.
    pub faces: Vec<u8>,
}

/// Triangles over a boundary loop: by the numbers of its points, and from their count on those of the points inside.
pub(super) struct Patch {
    pub inner: Vec<Vec3>,
    pub triangles: Vec<[usize; 3]>,
    /// Along the edges that divide it from one point of the boundary loop to another.
    pub routes: Vec<Vec<usize>>,
}

/// What may be over a boundary loop.
pub(super) struct Patches {
    /// Where edges divide it, if that is nearer to the surface than a single cone.
    pub divided: Option<Patch>,
    pub cone: Patch,
}

impl Patches {
    pub fn best(&self, divided: bool) -> &Patch {
        (self.divided.as_ref().filter(|_| divided)).unwrap_or(&self.cone)
    }
}

impl Patch {
    fn cone(boundary_loop: &BoundaryLoop, apex: Vec3) -> Patch {
        let n = boundary_loop.positions.len();
        Patch { inner: vec![apex], triangles: (0..n).map(|i| [n, i, (i + 1) % n]).collect(), routes: Vec::new() }
    }
}

impl Cell<'_> {
    /// A point kept within the cell.
    pub fn within(&self, p: Vec3) -> Vec3 {
        let at = self.nodes.at(self.node);
        [0, 1, 2].map(|a| within(self.grid, self.nodes.axes[a], at[a], p[a]))
    }

    /// The sum of squares of how far the surface is from the middles between a point and others.
    pub fn off(&self, from: Vec3, to: &[Vec3]) -> f64 {
        let middles: Vec<Vec3> = to.iter().map(|p| scale(add(from, *p), 0.5)).collect();
        let mut off = vec![0.0; middles.len()];
        self.field.values(&middles, &mut off);
        off.iter().map(|d| d * d).sum()
    }
}

impl<'a> FeatureCells<'a> {
    pub(super) fn cell_of(&self, cell: [usize; 3], surface: usize) -> Cell<'a> {
        let grid = self.grid;
        Cell {
            grid,
            nodes: self.nodes,
            node: self.nodes.index(cell),
            surface,
            field: &*grid.surfaces[self.local.live[surface]].field,
        }
    }

    /// The boundary loop of a patch, by the names of its points.
    pub(super) fn boundary_loop(&mut self, cell: [usize; 3], keys: &[VertexId]) -> BoundaryLoop {
        let faces = |k: &VertexId| {
            let at = self.nodes.at(k.node());
            let flat = (0..3).filter(|a| k.spans() >> a & 1 == 0);
            flat.fold(0, |w, a| w | 1u8 << (2 * a + usize::from(at[a] > cell[a])))
        };
        let faces = keys.iter().map(faces).collect();
        let names: Vec<u32> = keys.iter().map(|k| self.vertex(*k)).collect();
        let positions = names.iter().map(|v| self.positions[*v as usize]).collect();
        BoundaryLoop { positions, faces }
    }
}

impl EdgeStore {
    /// The patches over the only boundary loop of a cell. `beyond`: as for [`Edges::apex`].
    pub(super) fn patches(&self, cell: Cell, boundary_loop: &BoundaryLoop, neighbour_corners: Option<Vec3>) -> Patches {
        let (apex, off) = self.apex(cell, boundary_loop, neighbour_corners);
        let is_exact = off < (cell.grid.margin * cell.grid.step).powi(2);
        let graph = (!is_exact).then(|| EdgeGraph::new(cell, boundary_loop, self.segments_in(cell)));
        let divided = graph.and_then(|w| w.patch(cell)).filter(|d| d.1 < off);
        Patches { divided: divided.map(|d| d.0), cone: Patch::cone(boundary_loop, apex) }
    }

    /// The same over one of several boundary loops.
    pub(super) fn patches_among(&self, cell: Cell, boundary_loop: &BoundaryLoop) -> Patches {
        let graph = EdgeGraph::new(cell, boundary_loop, self.segments_in(cell));
        let own: Vec<[Vec3; 2]> = graph.segments().collect();
        let (apex, off) = self.best(cell, boundary_loop, &own, None);
        let divided = graph.patch(cell).filter(|d| d.1 < off);
        Patches { divided: divided.map(|d| d.0), cone: Patch::cone(boundary_loop, apex) }
    }

    /// Where a corner in a cell next to this one is nearer to the surface than any point of this.
    pub(super) fn neighbour_corners(&self, cell: Cell) -> Option<Vec3> {
        self.neighbour_corners.get(&cell.node).copied()
    }

    /// The point over which the only patch of a cell becomes a cone: on the surface's edges there, if any; or `beyond`, where a
    /// corner in a cell next to it is nearer. And the mean square of how far the cone is from the surface, and the edges from it.
    pub(super) fn apex(
        &self,
        cell: Cell,
        boundary_loop: &BoundaryLoop,
        neighbour_corners: Option<Vec3>,
    ) -> (Vec3, f64) {
        self.best(cell, boundary_loop, self.segments_in(cell), neighbour_corners)
    }

    /// The pieces of edges in a cell; none if there are too many.
    fn segments_in(&self, cell: Cell) -> &[[Vec3; 2]] {
        let here = self.segments.get(&(cell.surface, cell.node));
        here.filter(|p| p.len() <= MOST).map_or(&[], |p| p)
    }

    /// The apex where only some pieces of edges belong to the patch.
    fn best(
        &self,
        cell: Cell,
        boundary_loop: &BoundaryLoop,
        segments: &[[Vec3; 2]],
        neighbour_corners: Option<Vec3>,
    ) -> (Vec3, f64) {
        let in_faces = boundary_loop.positions.iter().zip(&boundary_loop.faces);
        let corners = in_faces.filter(|(_, s)| s.count_ones() == 1);
        let corners: Vec<Vec3> = corners.map(|(p, _)| *p).collect();
        let of = if corners.is_empty() { &boundary_loop.positions } else { &corners };
        let center = middle(of);
        let far = |p: &Vec3| norm(sub(*p, center));
        let mut tried = Vec::with_capacity(4);
        let near = segments.iter().map(|s| nearest(*s, center));
        tried.extend(near.min_by(|a, b| far(a).total_cmp(&far(b))));
        if !segments.is_empty() {
            let inside = self.corners.get(&(cell.surface, cell.node));
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
        tried.extend(neighbour_corners);
        let samples: Vec<Vec3> = segments.iter().flat_map(|s| [s[0], scale(add(s[0], s[1]), 0.5), s[1]]).collect();
        let off = |apex: &Vec3| {
            let away = |p: &Vec3| {
                let spokes = boundary_loop.positions.iter();
                let all = spokes.map(|r| norm(sub(*p, nearest([*apex, *r], *p))));
                all.fold(f64::INFINITY, f64::min).powi(2)
            };
            let missed: f64 = samples.iter().map(away).sum();
            cell.off(*apex, &boundary_loop.positions) / boundary_loop.positions.len() as f64
                + missed / samples.len().max(1) as f64
        };
        let all = tried.iter().map(|p| (*p, off(p)));
        let best = all.min_by(|a, b| a.1.total_cmp(&b.1));
        best.unwrap_or((center, f64::INFINITY))
    }
}
