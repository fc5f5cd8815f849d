//! Fitted cells: cells in which a surface with feature edges meets other surfaces, and the extra points in them.
//!
//! A fitted cell is divided into tetrahedra such that the patch of the surface with feature edges consists of their facets.
//! Each cell face is cut along its contours and into triangles; the tetrahedra join these to a point inside, or, where feature
//! edges divide the patch, to one point in each volume between patches. So that surface needs no values there. Every other
//! surface is linear in each tetrahedron, as in a feature cell, but the corners may be extra points as well as nodes.
//!
//! Invariant: on a grid edge the other surfaces cross where linear interpolation between its two nodes says, and at extra
//! points inside a face or a cell their values lie between those of the nodes around. So no surface appears where an adjacent
//! cell does not expect it.

use super::divided_faces::PolygonCorner;
use super::{EdgeStore, OtherSurfaces, SurfaceContext};
use crate::extract::feature_cells::FeatureCells;
use crate::extract::vertex_id::VertexId;
use geometry::math::Vec3;

impl EdgeStore {
    /// Whether the cell can use extra points on its faces and edges.
    pub(super) fn takes_extra_points<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        context: &SurfaceContext<P>,
        cell: [usize; 3],
    ) -> bool {
        if context.is_sole_surface(cell) {
            return true;
        }
        let dead = || OtherSurfaces::of(context.local, context.signs, context.surface, cell).is_dead();
        context.is_fitted() && (self.claims.is_fitted(context.nodes, cell) || dead())
    }
}

impl FeatureCells<'_> {
    /// A value kept away from zero, as those at nodes are.
    pub(super) fn clamped_from_zero(&self, surface: usize, v: f64) -> f64 {
        let id = self.local.live[surface];
        let least = self.grid.margin * self.grid.surfaces[id].lipschitz * self.grid.step;
        if v <= 0.0 { v.min(-least) } else { v.max(least) }
    }

    /// The value of a surface at a share of a grid edge, interpolated between its nodes.
    pub(super) fn value_along(&self, surface: usize, node: usize, axis: usize, share: f64) -> f64 {
        let [a, b] = [node, node + self.offset(1 << axis)].map(|n| self.value(surface, n));
        self.clamped_from_zero(surface, a + (b - a) * share)
    }

    /// The share of a grid edge at which a position lies.
    pub(super) fn share_of(&self, node: usize, axis: usize, position: Vec3) -> f64 {
        let (axis_nodes, at) = (self.nodes.axes[axis], self.nodes.at(node)[axis]);
        (position[axis] - axis_nodes[at]) / (axis_nodes[at + 1] - axis_nodes[at])
    }

    /// The crossings of the fitted surface with a grid edge, the lower one first.
    pub(super) fn points_of(&self, node: usize, axis: usize, surface: usize) -> [Option<(VertexId, Vec3)>; 2] {
        if let Some(points) = self.edges.double_crossings.get(&(surface, node, axis)) {
            return [0, 1].map(|i| Some((VertexId::crossing(node, axis, surface, i), points[i])));
        }
        let [p, q] = [node, node + self.nodes.stride[axis]].map(|n| self.is_negative(surface, n));
        if p == q {
            return [None; 2];
        }
        let key = VertexId::new(node, &[1 << axis], &[surface]);
        let position = self.numbered(key).map_or_else(|| self.position(key), |v| self.positions[v as usize]);
        [Some((key, position)), None]
    }

    /// The crossing of another surface with a grid edge that the fitted surface crosses too: interpolated between the nodes,
    /// but on its own side of the fitted surface's crossings, and at a distance from these and from each other.
    pub fn position_along_edge(&self, key: VertexId) -> Option<Vec3> {
        let axis = (0..3).find(|a| key.is_along(*a))?;
        let fitted = self.grid.fitted?;
        let fitted = self.local.live.iter().position(|f| *f == fitted)?;
        let (node, surface) = (key.node(), key.surfaces().next()?);
        if surface == fitted {
            return None;
        }
        let (at, order) = self.order_along(node, axis, fitted);
        if at.is_empty() {
            return None;
        }
        let here = order.iter().find(|o| o.2 == surface)?.0;
        let stretch = order.iter().filter(|o| o.0 == here);
        let mut all: Vec<(f64, usize)> = stretch.map(|o| (o.1, o.2)).collect();
        let low = if here == 0 { 0.0 } else { at[here - 1] };
        let high = at.get(here).copied().unwrap_or(1.0);
        let count = all.len();
        let apart = self.grid.margin.min((high - low) / (count + 1) as f64);
        let mut before = low;
        for s in &mut all {
            s.0 = s.0.max(before + apart);
            before = s.0;
        }
        let mut after = high;
        for s in all.iter_mut().rev() {
            s.0 = s.0.min(after - apart);
            after = s.0;
        }
        let share = all.iter().find(|s| s.1 == surface)?.0;
        let mut position = self.nodes.position(node);
        let (axis_nodes, i) = (self.nodes.axes[axis], self.nodes.at(node)[axis]);
        position[axis] += share * (axis_nodes[i + 1] - axis_nodes[i]);
        Some(position)
    }

    /// The crossings of the fitted surface with a grid edge, as shares of it; and those of the other surfaces in order: the
    /// number of fitted crossings before each, its interpolated share, and its surface.
    fn order_along(&self, node: usize, axis: usize, fitted: usize) -> (Vec<f64>, Vec<(usize, f64, usize)>) {
        let points = self.points_of(node, axis, fitted).into_iter().flatten();
        let at: Vec<f64> = points.map(|p| self.share_of(node, axis, p.1)).collect();
        if at.is_empty() {
            return (at, Vec::new());
        }
        let stretch = |f: usize| {
            let same = |s: &&f64| (self.value_along(f, node, axis, **s) <= 0.0) == (self.value(f, node) <= 0.0);
            at.iter().take_while(same).count()
        };
        let others = self.crossings(&self.simplex(node, &[1 << axis]));
        let others = others.into_iter().filter(|(_, f)| *f != fitted);
        let mut order: Vec<_> = others.map(|(s, f)| (stretch(f), s, f)).collect();
        order.sort_by_key(|o| o.0);
        (at, order)
    }

    /// Whether a surface is negative where another one crosses a part of a grid edge that the fitted surface crosses too: by
    /// their order along the whole edge, which all adjacent faces and cells share. None if the part belongs to no such edge.
    pub fn sign_on_line(&self, ends: [usize; 2], other: usize, surface: usize) -> Option<bool> {
        let count = self.nodes.count();
        let line = |n: usize| self.divided_faces.line(n.checked_sub(count)?);
        let (node, axis) = line(ends[0]).or_else(|| line(ends[1]))?;
        let high = node + self.offset(1 << axis);
        let on = |n: usize| n == node || n == high || line(n) == Some((node, axis));
        if !ends.into_iter().all(on) {
            return None;
        }
        let at_ends = [node, high].map(|n| self.signs.is_negative(surface, n));
        if at_ends[0] == at_ends[1] {
            return Some(at_ends[0]);
        }
        let fitted = self.grid.fitted?;
        let fitted = self.local.live.iter().position(|f| *f == fitted)?;
        let (_, order) = self.order_along(node, axis, fitted);
        let position = |f: usize| order.iter().position(|o| o.2 == f);
        let passed = match (position(surface), position(other)) {
            (Some(own), Some(at)) => own < at,
            _ => false,
        };
        Some(at_ends[usize::from(passed)])
    }

    /// Adds an extra point with a value of each live surface; returns its number, which continues those of the nodes.
    pub(super) fn add_point(
        &mut self,
        position: Vec3,
        line: Option<(usize, usize)>,
        value: impl Fn(&Self, usize) -> f64,
    ) -> usize {
        for f in 0..self.local.live.len() {
            let v = value(self, f);
            self.divided_faces.values.push(v);
        }
        self.divided_faces.positions.push(position);
        self.divided_faces.lines.push(line);
        let id = self.nodes.count() + self.divided_faces.positions.len() - 1;
        self.divided_faces.first.push(id);
        id
    }

    /// The number that stands for a node or for all extra points at one position.
    pub(super) fn first_of(&self, id: usize) -> usize {
        id.checked_sub(self.nodes.count()).map_or(id, |p| self.divided_faces.first[p])
    }

    /// A copy of an extra point with pseudo-random values of the same signs.
    pub(super) fn perturbed(&mut self, low: usize, corner: &PolygonCorner, attempt: usize) -> usize {
        let Some(point) = corner.id.checked_sub(self.nodes.count()) else {
            return corner.id;
        };
        let perturbed = |k: &Self, f: usize| {
            let seed = k.local.live[f] + 64 * (corner.code + 16 * attempt);
            k.clamped_from_zero(f, k.divided_faces.value(point, f) * (1.0 + 0.7 * k.noise(seed, low)))
        };
        let id = self.add_point(self.divided_faces.positions[point], self.divided_faces.lines[point], perturbed);
        let first = self.divided_faces.first[point];
        self.divided_faces.first[id - self.nodes.count()] = first;
        id
    }

    /// The value of a live surface at a position, clamped to those at some nodes. The fitted surface needs none.
    pub(super) fn value_between(&self, f: usize, position: Vec3, around: &[usize]) -> f64 {
        let at = around.iter().map(|n| self.value(f, *n));
        let (low, high) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if (low <= 0.0) == (high <= 0.0) || self.is_fitted(f) {
            return low;
        }
        let id = self.local.live[f];
        self.clamped_from_zero(f, self.grid.surfaces[id].field.value(position).clamp(low, high))
    }
}
