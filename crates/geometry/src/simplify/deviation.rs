//! How far the surface has moved: a bound that is proven, in both directions.
//!
//! A collapse replaces the triangles about an edge, the *patch*, by a *fan* about one new vertex with the same boundary
//! loop. Projected along a direction in which every triangle of both faces forwards and the fan goes round its vertex once,
//! the loop is a simple star-shaped polygon and both are graphs over it. So moving every point along that direction is a
//! one-to-one map of the patch onto the fan that leaves the boundary where it is, and all collapses one after the other make
//! a one-to-one map F of the first mesh onto the present one. Every point x of the first mesh is within |F(x) − x| of
//! the present mesh, and every point y of the present one within the same of the first, at x = F⁻¹(y).
//!
//! For each present triangle a box holds all F(x) − x of the points x that land on it. It is kept so: over the common
//! part of an old and a new triangle, a convex polygon, the two heights are linear, so the move along the direction is
//! between the least and the greatest of its values at the polygon's corners. These are the corners of both and the
//! points where an old edge crosses a new spoke. The new triangle's box is the union, over the old triangles that it
//! meets, of their boxes shifted by those moves: moves up and down cancel. (Successive mappings: J. Cohen, D. Manocha
//! and M. Olano, Simplifying polygonal models using successive mappings, 1997.)
//!
//! The bound adds up what each collapse can have done at worst, wherever on the triangle that was, and so is larger than
//! the distance, by a factor of some three to eight.

use crate::math::{Vec3, cross, dot, scale, sub, unit};

/// The least area, as a share of the patch's mean, that a triangle shows along the direction.
const SHOWN: f64 = 1e-9;
/// Points this close to an edge, as a share of a triangle, count for both its triangles.
const CLOSE: f64 = 1e-9;
/// Single-precision boxes are blown up by this share of their size for each sum.
const ROUNDED: f32 = 3e-7;

/// A box of displacements, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacements {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Displacements {
    /// The box that holds the zero vector alone.
    const ZERO: Displacements = Displacements { lo: [0.0; 3], hi: [0.0; 3] };
    /// No displacement at all yet.
    pub const NONE: Displacements = Displacements { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    /// The box with `other`, shifted by `s`, too.
    #[inline]
    fn cover(&mut self, other: &Displacements, s: [f32; 3]) {
        for k in 0..3 {
            self.lo[k] = self.lo[k].min(other.lo[k] + s[k]);
            self.hi[k] = self.hi[k].max(other.hi[k] + s[k]);
        }
    }

    /// The box with the displacement `d`, too.
    pub fn with(mut self, d: Vec3) -> Displacements {
        self.cover(&Displacements::ZERO, d.map(|c| c as f32));
        self.widened()
    }

    /// The longest displacement that it holds, mm.
    #[inline]
    pub fn longest(&self) -> f64 {
        let far = |k: usize| f64::from(self.hi[k].max(-self.lo[k]));
        (far(0) * far(0) + far(1) * far(1) + far(2) * far(2)).sqrt()
    }

    /// The box with room for the rounding of the sums that made it.
    fn widened(mut self) -> Displacements {
        for k in 0..3 {
            let margin = ROUNDED * self.hi[k].abs().max(self.lo[k].abs());
            self.lo[k] -= margin;
            self.hi[k] += margin;
        }
        self
    }
}

/// The triangles about an edge u–v, and what would replace them.
///
/// The boundary loop is counter-clockwise: from the corner x left of the edge about u to the corner y right of it, at `turn`,
/// and on about v. Triangle i of the patch and of the fan stands on the loop's edge from i to i + 1; the patch has two more,
/// u v x and v u y.
#[derive(Default)]
pub struct CollapsePatch {
    /// Ends of the edge, and what they become.
    pub u: Vec3,
    pub v: Vec3,
    pub w: Vec3,
    /// Positions of the boundary loop.
    pub boundary: Vec<Vec3>,
    /// The index of y in it.
    pub turn: usize,
    /// Displacements of the patch's triangles: those on the boundary, then u v x and v u y.
    pub old: Vec<Displacements>,
    /// Displacements of the fan's triangles, once `propagate` has found them.
    pub new: Vec<Displacements>,
    /// The boundary in the plane, and heights above it.
    flat: Vec<Vec3>,
    edges: Vec<InnerEdge>,
}

/// An edge inside the patch: its ends in the plane, with their heights, and the triangles on both sides.
struct InnerEdge {
    ends: [Vec3; 2],
    triangles: [usize; 2],
}

/// Twice the area a → b → c turns left about in the plane.
#[inline]
fn turn(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl CollapsePatch {
    /// Finds the displacements of the fan. False if there is no direction that shows patch and fan as graphs, or one
    /// of the displacements would exceed `limit`.
    pub fn propagate(&mut self, limit: f64) -> bool {
        let m = self.boundary.len();
        let Some((area, normal, [u, v])) = self.project() else {
            return false;
        };
        let outline = Outline { boundary: &self.flat, turn: self.turn, u, v };
        if !outline.is_graph(SHOWN * area / m as f64) {
            return false;
        }
        self.new.clear();
        self.new.resize(m, Displacements::NONE);
        let mut moves = Moves { old: &self.old, new: &mut self.new, normal };
        moves.keep_boundary(&outline);
        // Boxes only grow: most of what fails does so before the long part.
        let exceeds = |new: &[Displacements]| new.iter().any(|d| d.longest() > limit);
        if !moves.move_ends(&outline) || !moves.move_vertex(&outline) || exceeds(moves.new) {
            return false;
        }
        outline.inner_edges(&mut self.edges);
        moves.cross(&outline, &self.edges);
        for d in &mut self.new {
            *d = d.widened();
            if d.longest().is_nan() || d.longest() > limit {
                return false;
            }
        }
        true
    }

    /// Projects the boundary along its area vector, with w as the origin; gives twice its area, the direction, and u and v.
    /// `None` where it has no area.
    fn project(&mut self) -> Option<(f64, Vec3, [Vec3; 2])> {
        let m = self.boundary.len();
        // The area vector of the boundary is that of patch and fan alike.
        let mut n = [0.0; 3];
        for i in 0..m {
            let after = if i + 1 == m { 0 } else { i + 1 };
            let c = cross(sub(self.boundary[i], self.u), sub(self.boundary[after], self.u));
            n = [n[0] + c[0], n[1] + c[1], n[2] + c[2]];
        }
        let size = dot(n, n).sqrt();
        if size.is_nan() || size <= 0.0 {
            return None;
        }
        let n = scale(n, 1.0 / size);
        let e = unit(if n[0].abs() < 0.6 { cross(n, [1.0, 0.0, 0.0]) } else { cross(n, [0.0, 1.0, 0.0]) });
        let f = cross(n, e);
        let o = self.w;
        let plane = |p: Vec3| {
            let d = sub(p, o);
            [dot(d, e), dot(d, f), dot(d, n)]
        };
        self.flat.clear();
        self.flat.extend(self.boundary.iter().map(|p| plane(*p)));
        Some((size, n, [plane(self.u), plane(self.v)]))
    }
}

/// The new vertex, in the plane.
const W: Vec3 = [0.0; 3];

/// A patch in the plane, with heights above it; the new vertex is the origin.
struct Outline<'a> {
    boundary: &'a [Vec3],
    turn: usize,
    u: Vec3,
    v: Vec3,
}

impl Outline<'_> {
    #[inline]
    fn after(&self, i: usize) -> usize {
        if i + 1 == self.boundary.len() { 0 } else { i + 1 }
    }

    #[inline]
    fn before(&self, i: usize) -> usize {
        if i == 0 { self.boundary.len() - 1 } else { i - 1 }
    }

    /// The end of the edge that triangle i of the patch stands on the boundary from.
    #[inline]
    fn end(&self, i: usize) -> Vec3 {
        if i < self.turn { self.u } else { self.v }
    }

    /// The corners of triangle i of the patch.
    #[inline]
    fn patch_triangle(&self, i: usize) -> [Vec3; 3] {
        let m = self.boundary.len();
        match i {
            i if i == m => [self.u, self.v, self.boundary[0]],
            i if i > m => [self.v, self.u, self.boundary[self.turn]],
            _ => [self.end(i), self.boundary[i], self.boundary[self.after(i)]],
        }
    }

    /// The corners of triangle j of the fan.
    #[inline]
    fn fan_triangle(&self, j: usize) -> [Vec3; 3] {
        [W, self.boundary[j], self.boundary[self.after(j)]]
    }

    /// Whether patch and fan are graphs over the plane: twice the area of each triangle is `least` or more, and the boundary
    /// goes once about the new vertex.
    fn is_graph(&self, least: f64) -> bool {
        let (u, v, x, y) = (self.u, self.v, self.boundary[0], self.boundary[self.turn]);
        if turn(u, v, x) < least || turn(v, u, y) < least {
            return false;
        }
        let mut rounds = 0;
        for i in 0..self.boundary.len() {
            let (a, b) = (self.boundary[i], self.boundary[self.after(i)]);
            if turn(W, a, b) < least || turn(self.end(i), a, b) < least {
                return false;
            }
            rounds += usize::from(a[1] <= 0.0 && b[1] > 0.0);
        }
        rounds == 1
    }

    /// Lists the edges inside the patch.
    fn inner_edges(&self, out: &mut Vec<InnerEdge>) {
        let (m, k) = (self.boundary.len(), self.turn);
        out.clear();
        out.push(InnerEdge { ends: [self.u, self.v], triangles: [m, m + 1] });
        let mut edge = |end: Vec3, i: usize, triangles| {
            out.push(InnerEdge { ends: [end, self.boundary[i]], triangles });
        };
        for i in 0..m {
            match i {
                0 => edge(self.u, 0, [m, 0]),
                i if i < k => edge(self.u, i, [i - 1, i]),
                i if i == k => edge(self.u, i, [k - 1, m + 1]),
                _ => edge(self.v, i, [i - 1, i]),
            }
        }
        edge(self.v, 0, [m - 1, m]);
        edge(self.v, k, [m + 1, k]);
    }
}

/// The displacements of the patch and those of the fan in the making.
struct Moves<'a> {
    old: &'a [Displacements],
    new: &'a mut [Displacements],
    normal: Vec3,
}

impl Moves<'_> {
    /// Triangle i of the patch and j of the fan have a common point, and it moves by `s` along the normal.
    #[inline]
    fn meet(&mut self, i: usize, j: usize, s: f64) {
        let shift = core::array::from_fn(|c| (s * self.normal[c]) as f32);
        self.new[j].cover(&self.old[i], shift);
    }

    /// The boundary stays.
    fn keep_boundary(&mut self, outline: &Outline) {
        let m = outline.boundary.len();
        for i in 0..m {
            let before = outline.before(i);
            for j in [before, i] {
                self.meet(before, j, 0.0);
                self.meet(i, j, 0.0);
                if i == 0 {
                    self.meet(m, j, 0.0);
                } else if i == outline.turn {
                    self.meet(m + 1, j, 0.0);
                }
            }
        }
    }

    /// The ends of the edge go to the fan; false if one is not over it.
    fn move_ends(&mut self, outline: &Outline) -> bool {
        let (m, k) = (outline.boundary.len(), outline.turn);
        for (p, own) in [(outline.u, 0..k), (outline.v, k..m)] {
            let mut found = false;
            for j in 0..m {
                let Some(z) = height(outline.fan_triangle(j), p) else {
                    continue;
                };
                own.clone().chain([m, m + 1]).for_each(|i| self.meet(i, j, z - p[2]));
                found = true;
            }
            if !found {
                return false;
            }
        }
        true
    }

    /// What is on the patch at the new vertex goes there; false if the patch is not over it.
    fn move_vertex(&mut self, outline: &Outline) -> bool {
        let m = outline.boundary.len();
        let mut found = false;
        for i in 0..m + 2 {
            if let Some(z) = height(outline.patch_triangle(i), W) {
                (0..m).for_each(|j| self.meet(i, j, -z));
                found = true;
            }
        }
        found
    }

    /// Edges of the patch cross spokes of the fan.
    fn cross(&mut self, outline: &Outline, edges: &[InnerEdge]) {
        for j in 0..outline.boundary.len() {
            let r = outline.boundary[j];
            let before = outline.before(j);
            for e in edges {
                // The spoke runs from the origin to r.
                let [a, b] = e.ends;
                let (ca, cb) = (r[0] * a[1] - r[1] * a[0], r[0] * b[1] - r[1] * b[0]);
                if ca * cb > 0.0 || ca == cb {
                    continue;
                }
                let along = ca / (ca - cb);
                let p: Vec3 = core::array::from_fn(|c| a[c] + along * (b[c] - a[c]));
                let share = (p[0] * r[0] + p[1] * r[1]) / (r[0] * r[0] + r[1] * r[1]);
                if !(-CLOSE..=1.0 + CLOSE).contains(&share) {
                    continue;
                }
                for i in e.triangles {
                    self.meet(i, before, share * r[2] - p[2]);
                    self.meet(i, j, share * r[2] - p[2]);
                }
            }
        }
    }
}

/// The height of a triangle above the point of the plane below `p`, if that lies in it or on its edges.
#[inline]
fn height([a, b, c]: [Vec3; 3], p: Vec3) -> Option<f64> {
    let (ta, tb, tc) = (turn(b, c, p), turn(c, a, p), turn(a, b, p));
    let all = turn(a, b, c);
    let edge = -CLOSE * all;
    (ta >= edge && tb >= edge && tc >= edge).then(|| (ta * a[2] + tb * b[2] + tc * c[2]) / all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hexagon about u and v in the plane z = 0, u and v raised.
    fn patch(u: f64, v: f64, w: Vec3) -> CollapsePatch {
        let boundary =
            [[0.5, 1.0, 0.0], [-1.0, 0.6, 0.0], [-1.0, -0.6, 0.0], [0.5, -1.0, 0.0], [2.0, -0.6, 0.0], [2.0, 0.6, 0.0]];
        CollapsePatch {
            u: [0.0, 0.0, u],
            v: [1.0, 0.0, v],
            w,
            boundary: boundary.to_vec(),
            turn: 3,
            old: vec![Displacements::ZERO; 8],
            ..CollapsePatch::default()
        }
    }

    fn longest(p: &CollapsePatch) -> f64 {
        p.new.iter().map(Displacements::longest).fold(0.0, f64::max)
    }

    #[test]
    fn a_flat_patch_does_not_move() {
        let mut p = patch(0.0, 0.0, [0.3, 0.1, 0.0]);
        assert!(p.propagate(1e-12));
        assert_eq!((p.new.len(), longest(&p)), (6, 0.0));
    }

    #[test]
    fn a_tent_moves_by_its_height_and_back() {
        let mut p = patch(0.3, 0.2, [0.0, 0.0, 0.0]);
        assert!(p.propagate(1.0));
        assert!((longest(&p) - 0.3).abs() < 1e-6);
        assert!(!p.propagate(0.299));
        // What lay below and now comes up by as much as it lay below has not moved.
        let mut up = patch(0.0, 0.0, [0.5, 0.0, 0.3]);
        up.old = vec![Displacements::NONE.with([0.0, 0.0, -0.3]); 8];
        assert!(up.propagate(1.0));
        assert!((longest(&up) - 0.3).abs() < 1e-6);
        assert!(up.new.iter().all(|d| d.hi[2] < 1e-6));
    }

    #[test]
    fn folds_have_no_direction() {
        assert!(!patch(0.0, 0.0, [5.0, 0.0, 0.0]).propagate(9.0));
        assert!(!patch(0.0, 0.0, [-3.0, 0.0, 0.0]).propagate(9.0));
    }

    #[test]
    fn displacements_hold_all_points() {
        // Points of the patch, moved up or down onto the fan, by sampling.
        let mut p = patch(0.25, -0.1, [0.4, 0.15, 0.2]);
        assert!(p.propagate(1.0));
        let m = p.boundary.len();
        let fan = |q: Vec3| {
            (0..m).find_map(|j| height([p.w, p.boundary[j], p.boundary[(j + 1) % m]], q).map(|z| (j, z - q[2])))
        };
        for i in 0..m + 2 {
            let [a, b, c] = match i {
                6 => [p.u, p.v, p.boundary[0]],
                7 => [p.v, p.u, p.boundary[3]],
                i => [if i < 3 { p.u } else { p.v }, p.boundary[i], p.boundary[(i + 1) % m]],
            };
            for s in 0..=40 {
                for t in 0..=40 - s {
                    let (s, t) = (f64::from(s) / 40.0, f64::from(t) / 40.0);
                    let q = core::array::from_fn(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
                    let (j, z) = fan(q).expect("over the fan");
                    let d = p.new[j];
                    assert!(f64::from(d.lo[2]) <= z + 1e-6 && z - 1e-6 <= f64::from(d.hi[2]));
                }
            }
        }
    }
}
