//! Foot points: the nearest points of a level surface f = level, in space, from points of it near them.
//!
//! Phases relate to space by u = M x. A foot is a vector (mm) from the point, so period boundaries need no special case.

use super::series::Series;
use geometry::math::{Mat3, Vec3, add, apply, dot, inverse, norm, product, scale, sub, transpose, unit};

/// The surface f = level in space.
pub(super) struct LevelSurface<'a> {
    series: &'a Series,
    level: f64,
    to_phase: Mat3,
    back: Mat3,
    /// Longest edge of the cell, mm: what rounding is relative to.
    edge: f64,
    /// How far (mm) a point near the surface may move to reach it.
    reach: f64,
}

impl<'a> LevelSurface<'a> {
    pub(super) fn new(series: &'a Series, level: f64, to_phase: &Mat3, reach: f64) -> LevelSurface<'a> {
        let edge = transpose(&inverse(to_phase)).map(norm).into_iter().fold(0.0, f64::max);
        LevelSurface { series, level, to_phase: *to_phase, back: transpose(to_phase), edge, reach }
    }

    /// Longest edge of the cell, mm.
    pub(super) fn edge(&self) -> f64 {
        self.edge
    }

    /// The phase `by` mm from the phase u.
    pub(super) fn moved(&self, u: Vec3, by: Vec3) -> Vec3 {
        add(u, apply(&self.to_phase, by))
    }

    /// f − level, ∇ₓf and second derivatives in space at `from` (mm) from the phase u.
    pub(super) fn second(&self, u: Vec3, from: Vec3) -> (f64, Vec3, Mat3) {
        let (f, g, h) = self.series.second(self.moved(u, from));
        let h = product(&self.back, &product(&h, &self.to_phase));
        (f - self.level, apply(&self.back, g), h)
    }

    /// The point of the surface near `from`, by Newton's method along the gradient.
    pub(super) fn onto(&self, u: Vec3, from: Vec3) -> Option<Vec3> {
        let mut at = from;
        for _ in 0..12 {
            let (f, g, _) = self.second(u, at);
            let step = scale(g, -f / dot(g, g));
            at = add(at, step);
            let moved = norm(sub(at, from));
            if moved.is_nan() || moved > self.reach {
                return None;
            }
            if norm(step) <= 1e-12 * self.edge {
                return Some(at);
            }
        }
        None
    }

    /// The nearest point of the surface to the phase u, from a point of the surface near it; never farther than that.
    pub(super) fn nearest(&self, u: Vec3, from: Vec3) -> Vec3 {
        if !from[0].is_finite() {
            return from;
        }
        match self.lagrange(u, from) {
            Some(foot) if dot(foot, foot) <= dot(from, from) * (1.0 + 1e-12) => foot,
            _ => self.descend(u, from),
        }
    }

    /// Newton's method on p + λ∇f = 0, f(p) = level: the vector p from u is normal to the surface.
    fn lagrange(&self, u: Vec3, from: Vec3) -> Option<Vec3> {
        let mut p = from;
        let mut multiplier = None;
        for _ in 0..10 {
            let (f, g, h) = self.second(u, p);
            let l = multiplier.unwrap_or(-dot(p, g) / dot(g, g));
            let mut a = h.map(|r| scale(r, l));
            (0..3).for_each(|i| a[i][i] += 1.0);
            let solve = inverse(&a);
            let (along, rest) = (apply(&solve, g), apply(&solve, add(p, scale(g, l))));
            let dl = (f - dot(g, rest)) / dot(g, along);
            let step = sub(scale(rest, -1.0), scale(along, dl));
            p = add(p, step);
            multiplier = Some(l + dl);
            let length = norm(step);
            if length.is_nan() || length > self.edge {
                return None;
            }
            // The next step would be its square: the distance, stationary at the foot, is known to 1e-12 of itself.
            if length <= (1e-6 * norm(p)).max(1e-12 * self.edge) {
                return Some(p);
            }
        }
        None
    }

    /// Towards the nearest point by going to the foot on the tangent plane and back to the surface, while that
    /// shortens the distance.
    fn descend(&self, u: Vec3, from: Vec3) -> Vec3 {
        let (mut p, mut pace) = (from, 1.0);
        for _ in 0..40 {
            let n = unit(self.second(u, p).1);
            let step = sub(scale(n, dot(n, p)), p);
            if norm(step) <= 1e-7 * self.edge || pace < 1e-3 {
                break;
            }
            match self.onto(u, add(p, scale(step, pace))) {
                Some(q) if dot(q, q) < dot(p, p) => p = q,
                _ => pace *= 0.5,
            }
        }
        p
    }
}
