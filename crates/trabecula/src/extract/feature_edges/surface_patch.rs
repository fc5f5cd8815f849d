//! Patches that fill a boundary loop: a cone, or several fans where more than one feature edge divides it.
//!
//! Of all candidates the one nearest to the surface and to its feature edges is taken. A single cone cannot intersect itself,
//! since the loop is a simple curve on the boundary of a convex cell; several fans are tested after they are made.

use super::edge_graph::EdgeGraph;
use super::loop_patch::{BoundaryLoop, LoopPatch, SurfaceCell};
use super::{EdgeStore, nearest};
use crate::extract::feature_cells::{FeatureCells, middle};
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Cells with more segments of feature edges than this are treated as if they had none: such segments are far shorter than a
/// grid step.
const MOST: usize = 128;

/// The candidates that fill a loop.
pub(super) struct PatchCandidates {
    /// Divided by feature edges, if that is nearer to the surface than a single cone.
    pub divided: Option<LoopPatch>,
    pub cone: LoopPatch,
}

impl PatchCandidates {
    pub fn best(&self, divided: bool) -> &LoopPatch {
        (self.divided.as_ref().filter(|_| divided)).unwrap_or(&self.cone)
    }
}

impl<'a> FeatureCells<'a> {
    pub(super) fn cell_of(&self, cell: [usize; 3], surface: usize) -> SurfaceCell<'a> {
        let grid = self.grid;
        SurfaceCell {
            grid,
            nodes: self.nodes,
            node: self.nodes.index(cell),
            surface,
            field: &*grid.surfaces[self.local.live[surface]].field,
        }
    }

    /// The boundary loop of a patch, by the ids of its points.
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
    /// The candidates for the only loop of a cell. `neighbour_corners`: as for [`EdgeStore::apex`].
    pub(super) fn patches(
        &self,
        cell: SurfaceCell,
        boundary_loop: &BoundaryLoop,
        neighbour_corners: Option<Vec3>,
    ) -> PatchCandidates {
        let (apex, off) = self.apex(cell, boundary_loop, neighbour_corners);
        let is_exact = off < (cell.grid.margin * cell.grid.step).powi(2);
        let graph = (!is_exact).then(|| EdgeGraph::new(cell, boundary_loop, self.segments_in(cell)));
        let divided = graph.and_then(|w| w.patch(cell)).filter(|d| d.1 < off);
        PatchCandidates { divided: divided.map(|d| d.0), cone: LoopPatch::cone(boundary_loop, apex) }
    }

    /// The candidates for one of several loops.
    pub(super) fn patches_among(&self, cell: SurfaceCell, boundary_loop: &BoundaryLoop) -> PatchCandidates {
        let graph = EdgeGraph::new(cell, boundary_loop, self.segments_in(cell));
        let own: Vec<[Vec3; 2]> = graph.segments().collect();
        let (apex, off) = self.best(cell, boundary_loop, &own, None);
        let divided = graph.patch(cell).filter(|d| d.1 < off);
        PatchCandidates { divided: divided.map(|d| d.0), cone: LoopPatch::cone(boundary_loop, apex) }
    }

    /// The corner in an adjacent cell that is the apex of this cell's patch, if there is one.
    pub(super) fn neighbour_corners(&self, cell: SurfaceCell) -> Option<Vec3> {
        self.neighbour_corners.get(&cell.node).copied()
    }

    /// The apex of the cone over the only loop of a cell, on a feature edge if there is one, or at `neighbour_corners` if that
    /// is nearer; and the mean square of the distances of the cone from the surface and from the feature edges.
    pub(super) fn apex(
        &self,
        cell: SurfaceCell,
        boundary_loop: &BoundaryLoop,
        neighbour_corners: Option<Vec3>,
    ) -> (Vec3, f64) {
        self.best(cell, boundary_loop, self.segments_in(cell), neighbour_corners)
    }

    /// The segments of feature edges in a cell; none if there are too many.
    fn segments_in(&self, cell: SurfaceCell) -> &[[Vec3; 2]] {
        let here = self.traced.segments.get(&(cell.surface, cell.node));
        here.filter(|p| p.len() <= MOST).map_or(&[], |p| p)
    }

    /// The best apex for some of the segments.
    fn best(
        &self,
        cell: SurfaceCell,
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
        // A single edge that passes through leaves no other choice.
        if corners.len() == 2 && tried.len() == 1 && far(&tried[0]) < 0.1 * cell.grid.step {
            return (cell.within(tried[0]), 0.0);
        }
        tried.push(center);
        for p in &mut tried {
            *p = cell.within(*p);
        }
        tried.extend(neighbour_corners);
        // Without feature edges there is no choice either, and no distance to ask for.
        if let [only] = tried[..] {
            return (only, 0.0);
        }
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
