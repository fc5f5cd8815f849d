//! The smooth union N(g) = max over y ≥ 0 of 2 y·g − yᵀRy of the half-beams of a hub.
//!
//! The active half-beams are those with y > 0; over them Ry = g, and N = gᵀR⁻¹g = y·g is a sum of squares of affine functions, one
//! more for each half-beam in Cholesky's order. No other half-beam has g above Ry.

use geometry::math::{Vec3, add, dot, scale, sub};

use super::affine_function::largest;
use super::fillet_matrix::{MANY, append, with_room};
use super::hub::Hub;

/// g above Ry by less than this part of the largest g does not make a half-beam active: rounding.
pub(super) const ROUNDING: f64 = 1e-14;
/// Number of active half-beams for which no memory is allocated.
const FEW: usize = 8;

/// What has to be known of N: the search ends as soon as it is surely more than the first number, or less than the second.
pub(super) type Limits = [f64; 2];
/// N itself.
pub(super) const EXACT: Limits = [f64::INFINITY, f64::NEG_INFINITY];

/// The smooth union N at one position, its gradient, and the active half-beams.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SmoothUnion {
    /// N, mm².
    pub value: f64,
    /// Its gradient, mm.
    pub gradient: Vec3,
    /// Label: a bit for each of the first 64 half-beams that are active.
    pub active: u64,
}

impl Hub<'_> {
    /// Calls `f` with G of all half-beams at x.
    #[inline]
    pub(super) fn with_g<T>(&self, x: Vec3, f: impl FnOnce(&[f64]) -> T) -> T {
        with_room::<MANY, T>(self.g.len(), |g| {
            for (g, of) in g.iter_mut().zip(self.g) {
                *g = of.at(x);
            }
            f(g)
        })
    }

    /// N at x, with gradient and label.
    #[inline]
    pub(crate) fn smooth_union(&self, x: Vec3) -> SmoothUnion {
        let mut out = SmoothUnion::default();
        self.with_g(x, |g| {
            self.each_active(g, largest(g), EXACT, &mut |i, y| {
                out.value += y * g[i];
                out.gradient = add(out.gradient, scale(self.g[i].a, 2.0 * y));
                out.active |= 1 << (i & 63);
            });
        });
        out
    }

    /// N at x, mm².
    #[inline]
    pub fn smooth_union_value(&self, x: Vec3) -> f64 {
        self.with_g(x, |g| self.union_of(g, largest(g), EXACT))
    }

    /// N for these G, mm²; or a number beyond the same limit.
    #[inline]
    pub(super) fn union_of(&self, g: &[f64], leader: (usize, f64), limits: Limits) -> f64 {
        let mut n = 0.0;
        self.each_active(g, leader, limits, &mut |i, y| n += y * g[i]);
        n
    }

    /// S − N at x, mm²: negative inside.
    #[inline]
    pub fn value(&self, x: Vec3) -> f64 {
        dot(x, x) - self.radius * self.radius - self.smooth_union_value(x)
    }

    /// S − N at x and its gradient.
    #[inline]
    pub fn gradient(&self, x: Vec3) -> (f64, Vec3) {
        let n = self.smooth_union(x);
        (dot(x, x) - self.radius * self.radius - n.value, sub(scale(x, 2.0), n.gradient))
    }

    /// Calls `f` with each active half-beam for these G, of which the largest is known, and its y. Mostly one or two
    /// are active. At the end y·g is N, or beyond the same limit.
    ///
    /// y·g of the active half-beams found so far is a lower bound of N, and s² y·g with the largest ratio s of g to Ry an upper one.
    #[inline]
    pub(super) fn each_active(
        &self,
        g: &[f64],
        (first, most): (usize, f64),
        limits: Limits,
        f: &mut impl FnMut(usize, f64),
    ) {
        if most <= 0.0 || self.most * most * most < limits[1] {
            return;
        }
        if self.sharp() || most * most > limits[0] {
            return f(first, most);
        }
        let own = &self.row(first)[..g.len()];
        let (mut second, mut above) = (first, ROUNDING * most);
        for (i, (g, own)) in g.iter().zip(own).enumerate() {
            let over = g - own * most;
            if over > above {
                (second, above) = (i, over);
            }
        }
        if second == first {
            return f(first, most);
        }
        let (other, tau) = (&self.row(second)[..g.len()], own[second]);
        let with = above / ((1.0 - tau) * (1.0 + tau));
        let alone = most - tau * with;
        let so_far = most * alone + g[second] * with;
        let (mut more, mut below) = (false, limits[1] > 0.0);
        for (i, ((g, own), other)) in g.iter().zip(own).zip(other).enumerate() {
            let held = own * alone + other * with;
            below &= *g <= 0.0 || g * g * so_far < limits[1] * held * held;
            more |= g - held > ROUNDING * most && i != second && i != first;
        }
        if !more || below || so_far > limits[0] {
            f(first, alone);
            return f(second, with);
        }
        self.each_of_many(g, limits, [(first, alone), (second, with)], f);
    }

    /// As `each_active`, where more than two are active, of which two and their y alone are known.
    #[inline(never)]
    fn each_of_many(&self, g: &[f64], limits: Limits, two: [(usize, f64); 2], f: &mut dyn FnMut(usize, f64)) {
        let [(first, alone), (second, with)] = two;
        let (own, other) = (self.row(first), self.row(second));
        let (mut active, mut count, mut work) = ([0; FEW], 2, [0.0; FEW * (FEW + 3)]);
        (active[0], active[1], work[0], work[1]) = (first, second, alone, with);
        // Those above Ry of the two join together.
        for (i, g_i) in g.iter().enumerate() {
            let over = g_i - (own[i] * alone + other[i] * with);
            if count < FEW && over > ROUNDING * g[first] && i != second && i != first {
                active[count] = i;
                count += 1;
            }
        }
        let count = self.active_set(g, limits, count, &mut active, &mut work, FEW);
        if count <= FEW {
            return (0..count).for_each(|k| f(active[k], work[k]));
        }
        let n = g.len();
        let (mut active, mut work) = (vec![0; n], vec![0.0; n * (n + 3)]);
        (active[0], active[1], work[0], work[1]) = (first, second, alone, with);
        let count = self.active_set(g, limits, 2, &mut active, &mut work, n);
        (0..count).for_each(|k| f(active[k], work[k]));
    }

    fn row(&self, i: usize) -> &[f64] {
        let n = self.g.len();
        &self.taus[i * n..(i + 1) * n]
    }

    /// The active half-beams for these G and the y of each, by the method of Lawson and Hanson: the half-beam that is most above Ry
    /// joins, and those whose y would become negative leave. It starts from `n` half-beams and their y, the first numbers of
    /// `work`. Returns their number, or more than `room` if there is no room for them.
    fn active_set(
        &self,
        g: &[f64],
        limits: Limits,
        mut n: usize,
        active: &mut [usize],
        work: &mut [f64],
        room: usize,
    ) -> usize {
        let (y, rest) = work.split_at_mut(room);
        let (z, rest) = rest.split_at_mut(room);
        let (h, l) = rest.split_at_mut(room);
        let (all, mut factored) = (self.g.len(), 0);
        let tolerance = ROUNDING * g[active[0]];
        // Each step raises 2 y·g − yᵀRy; the limit ends cycles of rounding.
        for _ in 0..4 * all + 16 {
            for k in factored..n {
                let (before, row) = l.split_at_mut(k * room);
                let own = &self.taus[active[k] * all..][..all];
                append(before, row, room, k, |c| own[active[c]], 1.0);
                h[k] = (g[active[k]] - (0..k).map(|c| row[c] * h[c]).sum::<f64>()) / row[k];
            }
            factored = n;
            for k in (0..n).rev() {
                let above = (k + 1..n).map(|c| l[c * room + k] * z[c]).sum::<f64>();
                z[k] = (h[k] - above) / l[k * room + k];
            }
            if z[..n].iter().all(|v| *v > 0.0) {
                y[..n].copy_from_slice(&z[..n]);
                let so_far: f64 = (0..n).map(|k| y[k] * g[active[k]]).sum();
                let (mut next, mut below) = ((usize::MAX, tolerance), limits[1] > 0.0);
                for (i, g) in g.iter().enumerate() {
                    // R is symmetric: its rows of the active half-beams lie together.
                    let held = (0..n).map(|k| self.taus[active[k] * all + i] * y[k]).sum::<f64>();
                    below &= *g <= 0.0 || g * g * so_far < limits[1] * held * held;
                    if g - held > next.1 && !active[..n].contains(&i) {
                        next = (i, g - held);
                    }
                }
                if below || so_far > limits[0] {
                    return n;
                }
                if next.0 == usize::MAX {
                    return n;
                }
                if n == room {
                    return room + 1;
                }
                (active[n], y[n]) = (next.0, 0.0);
                n += 1;
                continue;
            }
            let step = (0..n).filter(|k| z[*k] <= 0.0).map(|k| part_of(y[k], z[k])).fold(1.0, f64::min);
            let mut kept = 0;
            for k in 0..n {
                let leaves = z[k] <= 0.0 && part_of(y[k], z[k]) <= step;
                if !leaves {
                    (active[kept], y[kept]) = (active[k], y[k] + step * (z[k] - y[k]));
                    kept += 1;
                }
            }
            (n, factored) = (kept, 0);
        }
        n
    }
}

/// The part of the way from y to z at which zero is reached.
fn part_of(y: f64, z: f64) -> f64 {
    if y <= 0.0 { 0.0 } else { y / (y - z) }
}
