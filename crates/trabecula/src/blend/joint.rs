//! How the cores of a blend go together: their values at the same places.
//!
//! Every core is a function of its own phase, so what matters is which phases meet. Where the maps are affine and one is
//! a whole multiple of the other, the same phases meet in every cell: one cell tells all. Where the beats between
//! their waves are shorter than a cell, all phases meet everywhere. Else phases drift past each other, slowly, and
//! each neighbourhood has a distribution of its own.

use std::sync::OnceLock;

use super::constituent::Constituent;
use crate::map::Map;
use geometry::math::{Aabb, Mat3, Vec3, apply, inverse, norm, product, sub, transpose};

/// How the phases of the lattices of a blend go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phases {
    /// The same in every cell.
    Locked,
    /// All combinations in every neighbourhood.
    Independent,
    /// Their combination changes from place to place.
    Drifting,
}

/// Sample positions where one distribution serves all, and in each neighbourhood. A thousand even positions give a fraction
/// to some thousandths; the sixty-four neighbourhoods in a window of two cells look at other ones each, so that what is
/// left of their errors together is far below. Where phases drift slowly neighbourhoods are fewer, and twice as many serve.
const EVERYWHERE: usize = 1 << 16;
const NEARBY: usize = 1 << 10;
const SLOWLY: usize = 2 * NEARBY;
/// Beats longer than six of the longest cells are slow: linear between neighbourhoods a cell apart. Of those shorter than a
/// cell and a ninth the window leaves less than a twentieth.
const SLOW: f64 = 1.0 / 6.0;
const GONE: f64 = 0.9;
/// Neighbourhoods along an axis after which places are the same again.
const APART: usize = 4;
/// Most neighbourhoods.
const MOST: f64 = 100_000.0;
/// Largest number of waves of a series whose beats are considered.
const WAVES: usize = 64;

/// Where cores are sampled together.
pub(super) struct Joint {
    pub phases: Phases,
    /// Back to mm from the common cell, in turns, where one serves all.
    common: Option<Mat3>,
    /// Middle of the first neighbourhood, distance between them, and how many along each axis.
    pub origin: Vec3,
    pub step: f64,
    /// One over that.
    per: f64,
    pub shape: [usize; 3],
    /// Half-width (mm) of the window about a neighbourhood's centre, and its number of sample positions.
    reach: f64,
    count: usize,
    /// Where solved maps end, and meshes of tetrahedra and beams may; nothing else has an end.
    bounds: Option<Aabb>,
}

/// The neighbourhoods about a point: each with its share and the gradient of that (per mm).
pub(super) type Corners = [(usize, f64, Vec3); 8];

impl Joint {
    pub fn new(of: &[Constituent], bounds: &Aabb) -> Joint {
        let longest = of.iter().map(Constituent::longest).fold(0.0, f64::max);
        let maps: Option<Vec<Mat3>> = of.iter().map(|s| Some(s.lattice()?.map.affine()?.matrix)).collect();
        let found = maps.as_ref().and_then(|m| locked(m, 2.0 * longest));
        let (phases, common) = match (found, &maps) {
            (Some(back), _) => (Phases::Locked, Some(back)),
            (None, Some(maps)) if beats(of, maps, longest, |k| k >= 1.0 - 1e-9) => {
                let mut wide = [[0.0; 3]; 3];
                // So far that what is met there has no memory.
                (0..3).for_each(|a| wide[a][a] = 12_345.6 * longest);
                (Phases::Independent, Some(wide))
            }
            _ => (Phases::Drifting, None),
        };
        let ended = |s: &Constituent| s.lattice().is_none_or(|l| matches!(l.map, Map::Phase(_)));
        let size = bounds.size();
        let fine = |h: f64| size.map(|s| (s / h).ceil().max(0.0) + 1.0);
        // Half a cell: the fastest beats that a window two cells wide lets through are about two thirds of a cell long.
        let slow = (maps.as_ref()).is_some_and(|maps| beats(of, maps, longest, |k| k <= SLOW || k >= GONE));
        let mut step = if slow { longest } else { 0.5 * longest };
        while fine(step).iter().product::<f64>() > MOST {
            step *= 1.1;
        }
        let shape = if common.is_some() { [1; 3] } else { fine(step).map(|n| n as usize) };
        let origin = core::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a] - step * (shape[a] - 1) as f64));
        Joint {
            phases,
            common,
            origin,
            step,
            per: 1.0 / step,
            shape,
            reach: if slow { step } else { 2.0 * step },
            count: if slow { SLOWLY } else { NEARBY },
            bounds: of.iter().any(ended).then_some(*bounds),
        }
    }

    /// Number of neighbourhoods.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The sample positions of neighbourhood `i`: evenly over the common cell, or about its middle and
    /// ever fewer up to its reach along each axis (a raised cosine, in which whole waves leave no trace).
    pub fn places(&self, i: usize) -> Vec<Vec3> {
        if let Some(back) = &self.common {
            return (0..EVERYWHERE).map(even).map(|u| apply(back, u)).collect();
        }
        let [nx, ny, _] = self.shape;
        let at = [i % nx, i / nx % ny, i / nx / ny];
        let middle: Vec3 = core::array::from_fn(|a| self.origin[a] + self.step * at[a] as f64);
        let [x, y, z] = at.map(|n| n % APART);
        let some = &windows()[((z * APART + y) * APART + x) * SLOWLY..][..self.count];
        let place = |s: &Vec3| -> Vec3 {
            core::array::from_fn(|a| {
                // What ends at the region's bounds is not sampled beyond them: positions there are mirrored.
                let p = middle[a] + self.reach * s[a];
                let Some(b) = &self.bounds else { return p };
                let (lo, hi) = (b.min[a], b.max[a]);
                let p = if p > hi { 2.0 * hi - p } else { p };
                let p = if p < lo { 2.0 * lo - p } else { p };
                p.clamp(lo, hi)
            })
        };
        some.iter().map(place).collect()
    }

    /// How many neighbourhoods a coordinate lies past the first along an axis.
    #[inline]
    pub fn steps(&self, a: usize, v: f64) -> f64 {
        (v - self.origin[a]) * self.per
    }

    /// Between which neighbourhoods along an axis a coordinate lies: the first, the share of the second, and the slope of
    /// that (per mm).
    #[inline]
    pub fn along(&self, a: usize, v: f64) -> (usize, f64, f64) {
        let last = (self.shape[a] - 1) as f64;
        let s = self.steps(a, v);
        let inside = s.clamp(0.0, last);
        let i = (inside as usize).min(self.shape[a].saturating_sub(2));
        let within = s == inside && last > 0.0;
        (i, inside - i as f64, if within { self.per } else { 0.0 })
    }

    /// The box in which points have a neighbourhood among theirs, if there are several.
    pub fn support(&self, i: usize) -> Aabb {
        let [nx, ny, _] = self.shape;
        let at = [i % nx, i / nx % ny, i / nx / ny];
        let middle = |a: usize| self.origin[a] + self.step * at[a] as f64;
        Aabb {
            min: core::array::from_fn(|a| middle(a) - self.step),
            max: core::array::from_fn(|a| middle(a) + self.step),
        }
    }

    /// How many neighbourhoods points of a box have; `None` if it reaches beyond them.
    pub fn count_in(&self, b: &Aabb) -> Option<usize> {
        if self.common.is_some() {
            return Some(1);
        }
        let ends = |a: usize| (self.origin[a], self.origin[a] + self.step * (self.shape[a] - 1) as f64);
        let within = (0..3).all(|a| b.min[a] >= ends(a).0 && b.max[a] <= ends(a).1);
        let along = |a: usize| self.along(a, b.max[a]).0 - self.along(a, b.min[a]).0 + 2;
        within.then(|| (0..3).map(along).product())
    }

    /// Calls `each` with the neighbourhoods about the points of a box.
    pub fn each_in(&self, b: &Aabb, mut each: impl FnMut(usize)) {
        let [x, y, z] = core::array::from_fn(|a| {
            let last = self.shape[a] - 1;
            let (lo, hi) = (self.along(a, b.min[a]).0, self.along(a, b.max[a]).0);
            lo..=(hi + 1).min(last)
        });
        for k in z {
            for j in y.clone() {
                for i in x.clone() {
                    each((k * self.shape[1] + j) * self.shape[0] + i);
                }
            }
        }
    }

    /// The neighbourhoods about a point.
    pub fn corners(&self, p: Vec3) -> Corners {
        let mut out = [(0, 0.0, [0.0; 3]); 8];
        if self.common.is_some() {
            out[0].1 = 1.0;
            return out;
        }
        let [nx, ny, _] = self.shape;
        // Along each axis: number, share and slope of the two.
        let [xs, ys, zs]: [[(usize, f64, f64); 2]; 3] = core::array::from_fn(|a| {
            let (i, share, slope) = self.along(a, p[a]);
            let next = (i + 1).min(self.shape[a] - 1);
            [(i, 1.0 - share, -slope), (next, share, slope)]
        });
        for (c, o) in out.iter_mut().enumerate() {
            let ((x, sx, dx), (y, sy, dy), (z, sz, dz)) = (xs[c & 1], ys[c >> 1 & 1], zs[c >> 2]);
            let slope = [dx * sy * sz, sx * dy * sz, sx * sy * dz];
            *o = ((z * ny + y) * nx + x, sx * sy * sz, slope);
        }
        out
    }
}

/// The k-th place of an even sequence in the unit cube: multiples of the powers of the root of x⁴ = x + 1.
fn even(k: usize) -> Vec3 {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3].map(|a| (0.5 + a * k as f64).fract())
}

/// Places of neighbourhoods, one after another, with the density Π (1 + cos πs)/2 on [−1, 1]³.
fn windows() -> &'static [Vec3] {
    static TABLE: OnceLock<Vec<Vec3>> = OnceLock::new();
    TABLE.get_or_init(|| {
        const N: usize = 512;
        let below = |s: f64| 0.5 * (1.0 + s + (std::f64::consts::PI * s).sin() / std::f64::consts::PI);
        let inverse = |share: f64| {
            let (mut lo, mut hi) = (-1.0, 1.0);
            for _ in 0..60 {
                let mid = 0.5 * (lo + hi);
                if below(mid) < share { lo = mid } else { hi = mid }
            }
            0.5 * (lo + hi)
        };
        let table: Vec<f64> = (0..=N).map(|i| inverse(i as f64 / N as f64)).collect();
        let warp = |u: f64| {
            let x = u * N as f64;
            let j = (x as usize).min(N - 1);
            table[j] + (table[j + 1] - table[j]) * (x - j as f64)
        };
        (0..APART.pow(3) * SLOWLY).map(|k| even(k).map(warp)).collect()
    })
}

/// Back to mm from a cell that all maps share and that is at most `most` mm long, if there is one.
fn locked(maps: &[Mat3], most: f64) -> Option<Mat3> {
    let back = inverse(maps.first()?);
    for size in 1..=4 {
        let cell = back.map(|r| r.map(|v| v * f64::from(size)));
        let whole = maps.iter().all(|m| product(m, &cell).iter().flatten().all(|v| (v - v.round()).abs() < 1e-9));
        if whole {
            let long = transpose(&cell).map(norm).into_iter().fold(0.0, f64::max);
            return (long <= most * (1.0 + 1e-9)).then_some(cell);
        }
    }
    None
}

/// Whether every beat between waves of two of the lattices meets a condition on its wave number (per `longest`); the waves
/// that products of two make count too, since what is solid is no linear matter. No, where there are too many.
fn beats(of: &[Constituent], maps: &[Mat3], longest: f64, meets: impl Fn(f64) -> bool) -> bool {
    let mut waves: Vec<Vec<Vec3>> = Vec::new();
    for (s, m) in of.iter().zip(maps) {
        let Some(l) = s.lattice() else { return false };
        let terms = l.cell.series().terms();
        if terms.len() > WAVES {
            return false;
        }
        let mut whole: Vec<[i32; 3]> = terms.iter().map(|t| t.hkl).collect();
        whole.extend(terms.iter().map(|t| t.hkl.map(|h| -h)));
        let pairs = whole.iter().flat_map(|a| whole.iter().map(|b| [0, 1, 2].map(|i| a[i] + b[i])));
        let mut all: Vec<[i32; 3]> = pairs.chain(whole.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all.retain(|h| *h != [0; 3]);
        let back = transpose(m);
        waves.push(all.into_iter().map(|h| apply(&back, h.map(f64::from))).collect());
    }
    // Each list has the opposite of every wave, so differences are all there is.
    let meet = |a: &Vec3, b: &Vec3| meets(norm(sub(*a, *b)) * longest);
    (0..waves.len()).all(|i| (0..i).all(|j| waves[i].iter().all(|a| waves[j].iter().all(|b| meet(a, b)))))
}
