//! Feature edges: curves across which the normal of one implicit surface is discontinuous, such as the edges of a mesh.
//!
//! In a cell that one surface alone crosses, the surface is reconstructed from the cell's faces inwards:
//!
//! 1. Each face gets *contours*, the polylines in which the surface meets it. They run from grid edge to grid edge, with a
//!    corner where a feature edge pierces the face if that brings the contours nearer to the surface and to its edges
//!    (`contours`). A grid edge that the surface crosses twice, because a feature edge is near, gets both points
//!    (`double_crossings`).
//! 2. The contours join to closed *boundary loops* on the cell's boundary (`boundary_loops`).
//! 3. Each loop is filled by a patch: a cone from a point of the feature edge inside the cell, or several fans where several
//!    edges divide it (`surface_patch`, `edge_graph`). A loop is a simple curve on the boundary of a convex cell, so a single cone
//!    cannot intersect itself; several fans are tested exactly.
//!
//! Cells where such a surface meets others are *fitted* (`fitted_cells`).
//!
//! Invariant: what a face or a grid edge gets is computed from data that all adjacent cells share, in whichever tile they are.
//!
//! Source: corners in cell faces after C. Ho, F. Wu, B. Chen, Y. Chuang and M. Ouhyoung, Cubical marching squares, Comput.
//! Graph. Forum 24 (2005) 537.

mod boundary_loops;
mod cell_claims;
mod cell_faces;
mod contours;
mod divided_faces;
mod double_crossings;
mod edge_graph;
mod fallback_fill;
mod fill_fitted;
mod fitted_cells;
mod loop_patch;
mod polygon_triangulation;
mod subvolumes;
mod surface_patch;
mod trace_edges;

use std::cmp::Ordering;

use rustc_hash::FxHashMap;

use crate::field::Field;
use geometry::math::{Vec3, add, dot, scale, sub};

use super::block_nodes::BlockNodes;
use super::sampling_grid::{LocalSolid, SamplingGrid};
use super::sign_words::Signs;
use super::vertex_id::VertexId;
use cell_claims::{CellClaims, OtherSurfaces, decides};
pub(super) use contours::Contour;
pub(super) use divided_faces::DividedFaces;
pub(super) use trace_edges::TracedEdges;
use trace_edges::cell_of;

/// A feature edge that passes a grid edge within this distance may pierce a face without a contour, in multiples of the least
/// distance of points from nodes. A wedge of 15° whose tip is as far beyond a grid edge crosses it in two points too near to
/// keep.
const NEAR_EDGE: f64 = 8.0;

/// Feature edges in the cells of a block, and the contours made from them. Filled in three steps: `traced`, `claims`, then
/// `find`; read-only afterwards.
#[derive(Default)]
pub(super) struct EdgeStore {
    pub traced: TracedEdges,
    pub claims: CellClaims,
    /// The contours of cell faces, by the lowest node of the face and the axis normal to it.
    contours: FxHashMap<(usize, usize), Vec<Contour>>,
    /// Both crossings of grid edges that a surface crosses twice, by the surface, the lower node and the axis; the lower point
    /// first.
    double_crossings: FxHashMap<(usize, usize, usize), [Vec3; 2]>,
    /// Positions of contour corners and double crossings.
    points: FxHashMap<VertexId, Vec3>,
    /// Points where feature edges end, meet or bend, and the number of edges there, by the surface and the lowest node of the
    /// cell.
    corners: FxHashMap<(usize, usize), Vec<(Vec3, usize)>>,
    /// A corner of the surface in an adjacent cell that the patch of this cell has as its apex, by the lowest node of this
    /// cell.
    neighbour_corners: FxHashMap<usize, Vec3>,
}

/// One surface in a block, with all that its contours depend on.
pub(super) struct SurfaceContext<'a, P: Fn(usize, usize) -> Option<Vec3>> {
    pub grid: &'a SamplingGrid,
    pub local: &'a LocalSolid,
    pub nodes: &'a BlockNodes<'a>,
    pub signs: &'a Signs,
    /// Index of the surface among the live ones, its samples and its function.
    pub surface: usize,
    pub samples: &'a [f32],
    pub field: &'a dyn Field,
    /// Vertices of plain cells, by the lower node of their grid edge and its axis.
    pub position: P,
}

impl EdgeStore {
    pub fn clear(&mut self, shape: [usize; 3]) {
        self.traced.clear(shape);
        self.claims.clear(shape);
        self.contours.clear();
        self.double_crossings.clear();
        self.points.clear();
        self.corners.clear();
        self.neighbour_corners.clear();
    }

    /// Whether a live surface has feature edges here.
    pub fn has(&self, surface: usize) -> bool {
        self.traced.pierced.iter().any(|p| p.0 == surface) || self.claims.surface.values().any(|f| *f == surface)
    }

    /// The ends of all contours.
    pub fn contour_ends(&self) -> impl Iterator<Item = VertexId> {
        let contours = self.contours.values().flatten();
        contours.flat_map(|c| [c.from, c.to])
    }

    /// The position of a contour corner or double crossing.
    pub fn position(&self, key: VertexId) -> Option<Vec3> {
        self.points.get(&key).copied()
    }

    /// Makes the contours of a surface whose feature edges were traced.
    pub fn find<P: Fn(usize, usize) -> Option<Vec3>>(&mut self, context: &SurfaceContext<P>) {
        let nodes = context.nodes;
        let of = &context.grid.surfaces[context.local.live[context.surface]].creases;
        if context.is_fitted() {
            let own = self.traced.segments.keys().filter(|p| p.0 == context.surface);
            let cells: Vec<usize> = own.map(|p| p.1).collect();
            self.find_double_crossings(context, cells);
        }
        // In the order of the segments, where several pierce one face.
        let mut at: FxHashMap<(usize, usize), Vec<Vec3>> = FxHashMap::default();
        for (_, face, p) in self.traced.pierced.iter().filter(|p| p.0 == context.surface) {
            at.entry(*face).or_default().push(context.inside(*face, *p));
        }
        // Faces whose four grid edges are all crossed.
        for &node in self.claims.surface.iter().filter(|f| *f.1 == context.surface).map(|f| f.0) {
            for axis in 0..3 {
                at.entry((node, axis)).or_default();
                at.entry((node + nodes.stride[axis], axis)).or_default();
            }
        }
        for &(_, node, axis) in self.double_crossings.keys().filter(|t| t.0 == context.surface) {
            for face in faces_around(nodes, (node, axis)) {
                at.entry(face).or_default();
            }
        }
        let adjacent = self.adjacent(context, &at);
        for face in adjacent.keys() {
            at.entry(*face).or_default();
        }
        for (&face, pierced) in &at {
            let also = adjacent.get(&face).map_or(&[][..], |p| p);
            let Some(contours) = self.contours(context, face, pierced, also) else {
                continue;
            };
            let mut cell = nodes.at(face.0);
            for _ in 0..2 {
                if context.is_sole_surface(cell) {
                    self.claims.add(nodes, cell, context.surface);
                }
                cell[face.1] = cell[face.1].wrapping_sub(1);
            }
            for c in &contours {
                self.points.extend(c.via.iter().copied());
            }
            self.contours.insert(face, contours);
        }
        if self.claims.any() {
            for p in &of.corners {
                if let Some(cell) = cell_of(nodes.axes, p.0) {
                    let here = (context.surface, nodes.index(cell));
                    self.corners.entry(here).or_default().push(*p);
                }
            }
            self.find_neighbour_corners(context, &at);
        }
    }

    /// Points where feature edges pierce a face so near to a grid edge that the surface does not cross that edge twice. The
    /// other faces around the edge may have their corners there as well, or instead.
    fn adjacent<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        context: &SurfaceContext<P>,
        pierced: &FxHashMap<(usize, usize), Vec<Vec3>>,
    ) -> FxHashMap<(usize, usize), Vec<Vec3>> {
        let nodes = context.nodes;
        let mut found: FxHashMap<(usize, usize), Vec<Vec3>> = FxHashMap::default();
        for (&face, positions) in pierced {
            for line in lines_of(nodes, face) {
                let (node, along) = line;
                if !context.ends_agree(line) || self.double_crossings.contains_key(&(context.surface, node, along)) {
                    continue;
                }
                let (from, across) = (nodes.position(node), 3 - along - face.1);
                let near = NEAR_EDGE * context.grid.margin * context.length(node, across);
                let is_near = |p: &&Vec3| (p[across] - from[across]).abs() < near;
                for p in positions.iter().filter(is_near) {
                    for other in faces_around(nodes, line).into_iter().filter(|s| *s != face) {
                        let mut q = *p;
                        q[other.1] = from[other.1];
                        found.entry(other).or_default().push(context.inside(other, q));
                    }
                }
            }
        }
        // The order must be the same in all tiles.
        for positions in found.values_mut() {
            positions.sort_by(|p, q| p.partial_cmp(q).unwrap_or(Ordering::Equal));
        }
        found
    }

    /// Finds corners that lie in a cell without other surface and whose edges all enter through one face. The patch of the
    /// adjacent cell behind that face then has its apex there: its boundary loop lies on the boundary of the two cells
    /// together, which is convex.
    fn find_neighbour_corners<P: Fn(usize, usize) -> Option<Vec3>>(
        &mut self,
        context: &SurfaceContext<P>,
        pierced: &FxHashMap<(usize, usize), Vec<Vec3>>,
    ) {
        let nodes = context.nodes;
        let mut found: Vec<(usize, Vec3)> = Vec::new();
        for (&(_, node), corners) in self.corners.iter().filter(|c| c.0.0 == context.surface) {
            let cell = nodes.at(node);
            let [(position, count)] = corners[..] else {
                continue;
            };
            let untouched = || context.is_sole_surface(cell) && context.untouched(cell);
            if count < 3 || self.claims.cells[cell[2] * nodes.shape[1] + cell[1]] >> cell[0] & 1 == 1 || !untouched() {
                continue;
            }
            let faces = (0..3).flat_map(|a| [(a, false), (a, true)]);
            let mut open = faces.filter_map(|(axis, upper)| {
                let low = node + if upper { nodes.stride[axis] } else { 0 };
                let here = pierced.get(&(low, axis)).map_or(0, Vec::len);
                (here > 0).then_some((axis, upper, here))
            });
            let (Some((axis, upper, here)), None) = (open.next(), open.next()) else {
                continue;
            };
            let plane = nodes.axes[axis][cell[axis] + usize::from(upper)];
            if here != count || context.grid.is_grid_plane(axis, plane) {
                continue;
            }
            let behind = if upper {
                node + nodes.stride[axis]
            } else if cell[axis] > 0 {
                node - nodes.stride[axis]
            } else {
                continue;
            };
            let position = [0, 1, 2].map(|a| within(context.grid, nodes.axes[a], cell[a], position[a]));
            found.push((behind, position));
        }
        // At most one for each patch.
        found.sort_by_key(|f| f.0);
        for pair in found.chunk_by(|a, b| a.0 == b.0) {
            if let [(behind, position)] = pair {
                self.neighbour_corners.insert(*behind, *position);
            }
        }
    }
}

impl<P: Fn(usize, usize) -> Option<Vec3>> SurfaceContext<'_, P> {
    /// Whether cells are fitted to the surface.
    fn is_fitted(&self) -> bool {
        self.grid.fitted == Some(self.local.live[self.surface])
    }

    /// Whether the surface is the only one in a cell of the block, or would be if it crossed the cell.
    fn is_sole_surface(&self, cell: [usize; 3]) -> bool {
        let (signs, [i, j, k]) = (self.signs, cell);
        let row = k * signs.shape[1] + j;
        if signs.featured[row] >> i & 1 == 1 {
            return false;
        }
        if signs.plain[self.surface][row] >> i & 1 == 1 {
            return true;
        }
        let live = self.local.live.len();
        if (0..live).any(|f| signs.plain[f][row] >> i & 1 == 1) {
            return false;
        }
        decides(self.local, signs, self.surface, cell)
    }

    /// Whether both ends of a grid edge that is not on the border of the block are on the same side of the surface.
    fn ends_agree(&self, (node, along): (usize, usize)) -> bool {
        let (at, shape) = (self.nodes.at(node), self.nodes.shape);
        let ends = [node, node + self.nodes.stride[along]];
        (0..3).all(|a| at[a] > 0 && at[a] + 2 <= shape[a]) && {
            let [p, q] = ends.map(|n| self.signs.is_negative(self.surface, n));
            p == q
        }
    }

    /// A point of a face, clamped to its interior.
    fn inside(&self, (low, axis): (usize, usize), mut p: Vec3) -> Vec3 {
        let at = self.nodes.at(low);
        for a in (0..3).filter(|a| *a != axis) {
            p[a] = within(self.grid, self.nodes.axes[a], at[a], p[a]);
        }
        p
    }
}

/// The point of a segment nearest to another point.
fn nearest([p, q]: [Vec3; 2], to: Vec3) -> Vec3 {
    let along = sub(q, p);
    let square = dot(along, along);
    let t = if square > 0.0 { (dot(sub(to, p), along) / square).clamp(0.0, 1.0) } else { 0.0 };
    add(p, scale(along, t))
}

/// The grid edges of a face, each by its lower node and its axis.
fn lines_of(nodes: &BlockNodes, (low, axis): (usize, usize)) -> [(usize, usize); 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (du, dv) = (nodes.stride[u], nodes.stride[v]);
    [(low, u), (low + du, v), (low + dv, u), (low, v)]
}

/// The faces around a grid edge that is not on the border of the block.
fn faces_around(nodes: &BlockNodes, (node, along): (usize, usize)) -> [(usize, usize); 4] {
    let (u, v) = ((along + 1) % 3, (along + 2) % 3);
    let (du, dv) = (nodes.stride[u], nodes.stride[v]);
    [(node, u), (node - dv, u), (node, v), (node - du, v)]
}

/// A coordinate clamped to a grid step, without its ends.
fn within(grid: &SamplingGrid, axis: &[f64], at: usize, x: f64) -> f64 {
    let (low, high) = (axis[at], axis[at + 1]);
    let margin = grid.margin * (high - low);
    x.clamp(low + margin, high - margin)
}
