//! How far the surface has moved: a bound that is proven, in both directions.
//!
//! A collapse replaces the triangles about an edge, the *patch*, by a *fan* about one new vertex with the same rim. Seen
//! along a direction in which every triangle of both faces forwards and the fan goes round its vertex once, the rim is a
//! simple star-shaped polygon and both are graphs over it. So moving every point along that direction is a
//! one-to-one map of the patch onto the fan that leaves the rim where it is, and all collapses one after the other make
//! a one-to-one map F of the first mesh onto the present one. Every point x of the first mesh is within |F(x) − x| of
//! the present mesh, and every point y of the present one within the same of the first, at x = F⁻¹(y).
//!
//! For each present triangle a box holds all F(x) − x of the points x that land on it. It is kept so: over the common
//! part of an old and a new triangle, a convex polygon, the two heights are linear, so the move along the direction is
//! between the least and the greatest of its values at the polygon's corners. These are the corners of both and the
//! places where an old side crosses a new spoke. The new triangle's box is the union, over the old triangles that it
//! meets, of their boxes shifted by those moves: moves up and down cancel. (Successive mappings: J. Cohen, D. Manocha
//! and M. Olano, Simplifying polygonal models using successive mappings, 1997.)
//!
//! The bound adds up what each collapse can have done at worst, wherever on the triangle that was, and so is larger than
//! the distance, by a factor of some three to eight.

use crate::math::{Vec3, cross, dot, scale, sub, unit};

/// The least area, as a share of the patch's mean, that a triangle shows along the direction.
const SHOWN: f64 = 1e-9;
/// Places this close to a side, as a share of a triangle, count for both its triangles.
const CLOSE: f64 = 1e-9;
/// Single-precision boxes are blown up by this share of their size for each sum.
const ROUNDED: f32 = 3e-7;

/// A box of displacements, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Drift {
    /// The box that holds the zero vector alone.
    const ZERO: Drift = Drift { lo: [0.0; 3], hi: [0.0; 3] };
    /// No displacement at all yet.
    pub const NONE: Drift = Drift { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    /// The box with `other`, shifted by `s`, too.
    #[inline]
    fn cover(&mut self, other: &Drift, s: [f32; 3]) {
        for k in 0..3 {
            self.lo[k] = self.lo[k].min(other.lo[k] + s[k]);
            self.hi[k] = self.hi[k].max(other.hi[k] + s[k]);
        }
    }

    /// The box with the displacement `d`, too.
    pub fn with(mut self, d: Vec3) -> Drift {
        self.cover(&Drift::ZERO, d.map(|c| c as f32));
        self.widened()
    }

    /// The longest displacement that it holds, mm.
    #[inline]
    pub fn longest(&self) -> f64 {
        let far = |k: usize| f64::from(self.hi[k].max(-self.lo[k]));
        (far(0) * far(0) + far(1) * far(1) + far(2) * far(2)).sqrt()
    }

    /// The box with room for the rounding of the sums that made it.
    fn widened(mut self) -> Drift {
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
/// The rim is counter-clockwise: from the corner x left of the edge about u to the corner y right of it, at `turn`, and
/// on about v. Triangle i of the patch and of the fan stands on the rim from i to i + 1; the patch has two more, u v x
/// and v u y.
#[derive(Default)]
pub struct Patch {
    /// Ends of the edge, and what they become.
    pub u: Vec3,
    pub v: Vec3,
    pub w: Vec3,
    /// Places of the rim.
    pub rim: Vec<Vec3>,
    /// The place of y in it.
    pub turn: usize,
    /// Displacements of the patch's triangles: those on the rim, then u v x and v u y.
    pub old: Vec<Drift>,
    /// Displacements of the fan's triangles, once `carry` has found them.
    pub new: Vec<Drift>,
    flat: Vec<Vec3>,
    sides: Vec<Side>,
}

/// A side inside the patch: its ends in the plane, with their heights, and the triangles on both hands.
struct Side {
    ends: [Vec3; 2],
    triangles: [usize; 2],
}

/// Twice the area a → b → c turns left about in the plane.
#[inline]
fn turn(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl Patch {
    /// Finds the displacements of the fan. False if there is no direction that shows patch and fan as graphs, or one
    /// of the displacements would exceed `limit`.
    pub fn carry(&mut self, limit: f64) -> bool {
        let m = self.rim.len();
        let after = |i: usize| if i + 1 == m { 0 } else { i + 1 };
        // The area vector of the rim is that of patch and fan alike.
        let mut n = [0.0; 3];
        for i in 0..m {
            let c = cross(sub(self.rim[i], self.u), sub(self.rim[after(i)], self.u));
            n = [n[0] + c[0], n[1] + c[1], n[2] + c[2]];
        }
        let size = dot(n, n).sqrt();
        if size.is_nan() || size <= 0.0 {
            return false;
        }
        let n = scale(n, 1.0 / size);
        let e = unit(if n[0].abs() < 0.6 { cross(n, [1.0, 0.0, 0.0]) } else { cross(n, [0.0, 1.0, 0.0]) });
        let f = cross(n, e);
        let o = self.w;
        let plane = |p: Vec3| {
            let d = sub(p, o);
            [dot(d, e), dot(d, f), dot(d, n)]
        };
        let (u, v, w) = (plane(self.u), plane(self.v), [0.0; 3]);
        self.flat.clear();
        self.flat.extend(self.rim.iter().map(|p| plane(*p)));
        let rim = &self.flat;
        let least = SHOWN * size / m as f64;
        let k = self.turn;
        let (x, y) = (rim[0], rim[k]);
        let hub = |i: usize| if i < k { u } else { v };
        // Both are graphs: all areas are positive, and the rim goes once about w.
        if turn(u, v, x) < least || turn(v, u, y) < least {
            return false;
        }
        let mut rounds = 0;
        for i in 0..m {
            let (a, b) = (rim[i], rim[after(i)]);
            if turn(w, a, b) < least || turn(hub(i), a, b) < least {
                return false;
            }
            rounds += usize::from(a[1] <= 0.0 && b[1] > 0.0);
        }
        if rounds != 1 {
            return false;
        }
        self.new.clear();
        self.new.resize(m, Drift::NONE);
        let corners = |i: usize| match i {
            i if i == m => [u, v, x],
            i if i > m => [v, u, y],
            _ => [hub(i), rim[i], rim[after(i)]],
        };
        let (old, new) = (&self.old, &mut self.new);
        // Old and new triangles have a common point, and it moves by `s`.
        let meet = |new: &mut [Drift], i: usize, j: usize, s: f64| {
            let shift = core::array::from_fn(|c| (s * n[c]) as f32);
            new[j].cover(&old[i], shift);
        };
        // The rim stays.
        for i in 0..m {
            let before = if i == 0 { m - 1 } else { i - 1 };
            for j in [before, i] {
                meet(new, before, j, 0.0);
                meet(new, i, j, 0.0);
                if i == 0 {
                    meet(new, m, j, 0.0);
                } else if i == k {
                    meet(new, m + 1, j, 0.0);
                }
            }
        }
        // The ends of the edge, on the fan.
        for (p, own) in [(u, 0..k), (v, k..m)] {
            let mut found = false;
            for j in 0..m {
                let Some(z) = height([w, rim[j], rim[after(j)]], p) else {
                    continue;
                };
                own.clone().chain([m, m + 1]).for_each(|i| meet(new, i, j, z - p[2]));
                found = true;
            }
            if !found {
                return false;
            }
        }
        // The new vertex, on the patch.
        let mut found = false;
        for i in 0..m + 2 {
            if let Some(z) = height(corners(i), w) {
                (0..m).for_each(|j| meet(new, i, j, -z));
                found = true;
            }
        }
        if !found {
            return false;
        }
        // Boxes only grow: most of what fails does so here, before the long part.
        if new.iter().any(|d| d.longest() > limit) {
            return false;
        }
        // Where sides of the patch cross spokes of the fan.
        self.sides.clear();
        self.sides.push(Side { ends: [u, v], triangles: [m, m + 1] });
        let mut side = |from_u: bool, i: usize, triangles| {
            self.sides.push(Side { ends: [if from_u { u } else { v }, rim[i]], triangles });
        };
        for i in 0..m {
            match i {
                0 => side(true, 0, [m, 0]),
                i if i < k => side(true, i, [i - 1, i]),
                i if i == k => side(true, i, [k - 1, m + 1]),
                _ => side(false, i, [i - 1, i]),
            }
        }
        side(false, 0, [m - 1, m]);
        side(false, k, [m + 1, k]);
        for j in 0..m {
            let r = rim[j];
            let before = if j == 0 { m - 1 } else { j - 1 };
            for s in &self.sides {
                // The spoke runs from the origin to r.
                let [a, b] = s.ends;
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
                for i in s.triangles {
                    meet(new, i, before, share * r[2] - p[2]);
                    meet(new, i, j, share * r[2] - p[2]);
                }
            }
        }
        for d in &mut self.new {
            *d = d.widened();
            if d.longest().is_nan() || d.longest() > limit {
                return false;
            }
        }
        true
    }
}

/// The height of a triangle over the place of `p`, if that lies in it or on its sides.
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
    fn patch(u: f64, v: f64, w: Vec3) -> Patch {
        let rim =
            [[0.5, 1.0, 0.0], [-1.0, 0.6, 0.0], [-1.0, -0.6, 0.0], [0.5, -1.0, 0.0], [2.0, -0.6, 0.0], [2.0, 0.6, 0.0]];
        Patch {
            u: [0.0, 0.0, u],
            v: [1.0, 0.0, v],
            w,
            rim: rim.to_vec(),
            turn: 3,
            old: vec![Drift::ZERO; 8],
            ..Patch::default()
        }
    }

    fn longest(p: &Patch) -> f64 {
        p.new.iter().map(Drift::longest).fold(0.0, f64::max)
    }

    #[test]
    fn a_flat_patch_does_not_move() {
        let mut p = patch(0.0, 0.0, [0.3, 0.1, 0.0]);
        assert!(p.carry(1e-12));
        assert_eq!((p.new.len(), longest(&p)), (6, 0.0));
    }

    #[test]
    fn a_tent_moves_by_its_height_and_back() {
        let mut p = patch(0.3, 0.2, [0.0, 0.0, 0.0]);
        assert!(p.carry(1.0));
        assert!((longest(&p) - 0.3).abs() < 1e-6);
        assert!(!p.carry(0.299));
        // What lay below and now comes up by as much as it lay below has not moved.
        let mut up = patch(0.0, 0.0, [0.5, 0.0, 0.3]);
        up.old = vec![Drift::NONE.with([0.0, 0.0, -0.3]); 8];
        assert!(up.carry(1.0));
        assert!((longest(&up) - 0.3).abs() < 1e-6);
        assert!(up.new.iter().all(|d| d.hi[2] < 1e-6));
    }

    #[test]
    fn folds_have_no_direction() {
        assert!(!patch(0.0, 0.0, [5.0, 0.0, 0.0]).carry(9.0));
        assert!(!patch(0.0, 0.0, [-3.0, 0.0, 0.0]).carry(9.0));
    }

    #[test]
    fn displacements_hold_all_points() {
        // Points of the patch, moved up or down onto the fan, by sampling.
        let mut p = patch(0.25, -0.1, [0.4, 0.15, 0.2]);
        assert!(p.carry(1.0));
        let m = p.rim.len();
        let fan = |q: Vec3| (0..m).find_map(|j| height([p.w, p.rim[j], p.rim[(j + 1) % m]], q).map(|z| (j, z - q[2])));
        for i in 0..m + 2 {
            let [a, b, c] = match i {
                6 => [p.u, p.v, p.rim[0]],
                7 => [p.v, p.u, p.rim[3]],
                i => [if i < 3 { p.u } else { p.v }, p.rim[i], p.rim[(i + 1) % m]],
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
