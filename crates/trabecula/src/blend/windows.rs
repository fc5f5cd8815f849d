//! Which phases of the lattices of a blend meet, and the windows in which their joint distribution is sampled.
//!
//! Every core is a function of its own phase, so the distribution of Σ wᵢ gᵢ depends on the joint distribution of the phases.
//! Where the maps are affine with a common period (*locked*) it is that over one common cell. Where all beats between their waves
//! are shorter than a cell (*independent*) it is the product of uniform distributions. Else phases *drift*: it is sampled in
//! windows, raised cosines about the nodes of a grid over the part, and interpolated trilinearly between them.

use std::sync::OnceLock;

use super::constituent::Constituent;
use geometry::math::{Aabb, Mat3, Vec3, apply, inverse, norm, product, sub, transpose};
use geometry::random::low_discrepancy;

/// How the phases of the lattices of a blend go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phases {
    /// The same in every cell.
    Locked,
    /// All combinations of phases within a few cells.
    Independent,
    /// Their combination changes from simplex to simplex.
    Drifting,
}

/// Number of sample positions where one distribution serves everywhere, and in each window. A thousand positions of a
/// low-discrepancy sequence give a fraction to some thousandths; adjacent windows use different ones, so that the mean over the
/// sixty-four about a point is far more accurate. Where phases drift slowly windows are fewer and have twice as many.
const COMMON_SAMPLES: usize = 1 << 16;
const SAMPLES: usize = 1 << 10;
const SLOW_SAMPLES: usize = 2 * SAMPLES;
/// Wave numbers of beats, per longest cell. Beats of at most `SLOW` are linear between windows a cell apart; those of at least
/// `AVERAGED` the window reduces to less than a twentieth.
const SLOW: f64 = 1.0 / 6.0;
const AVERAGED: f64 = 0.9;
/// Period of the sample positions, in windows along an axis.
const PERIOD: usize = 4;
/// Largest number of windows.
const MOST: f64 = 100_000.0;
/// Largest number of waves of a series whose beats are considered.
const WAVES: usize = 64;

/// The windows: one that serves everywhere, or those of a grid.
pub(super) struct Windows {
    pub phases: Phases,
    /// From the unit cube to the common cell (mm), where one window serves everywhere.
    common: Option<Mat3>,
    /// Centre of the first window, distance between adjacent ones (mm), and their number along each axis.
    origin: Vec3,
    step: f64,
    /// One over that.
    per: f64,
    pub shape: [usize; 3],
    /// Half-width of a window (mm), and its number of sample positions.
    reach: f64,
    count: usize,
    /// The part's bounds, where a lattice may end with it: solved maps, meshes of tetrahedra, beams.
    bounds: Option<Aabb>,
}

/// The windows about a point, each with its trilinear weight and the gradient of that (per mm).
pub(super) type Adjacent = [(usize, f64, Vec3); 8];

impl Windows {
    pub fn new(of: &[Constituent], bounds: &Aabb) -> Windows {
        let longest = of.iter().map(Constituent::longest).fold(0.0, f64::max);
        let maps: Option<Vec<Mat3>> = of.iter().map(|s| Some(s.lattice()?.map.affine()?.matrix)).collect();
        let found = maps.as_ref().and_then(|m| locked(m, 2.0 * longest));
        let (phases, common) = match (found, &maps) {
            (Some(back), _) => (Phases::Locked, Some(back)),
            (None, Some(maps)) if beats(of, maps, longest, |k| k >= 1.0 - 1e-9) => {
                let mut wide = [[0.0; 3]; 3];
                // Many cells, so that phases are independent of each other.
                (0..3).for_each(|a| wide[a][a] = 12_345.6 * longest);
                (Phases::Independent, Some(wide))
            }
            _ => (Phases::Drifting, None),
        };
        let may_end = |s: &Constituent| s.lattice().is_none_or(|l| l.map.solved().is_some());
        let size = bounds.size();
        let nodes = |h: f64| size.map(|s| (s / h).ceil().max(0.0) + 1.0);
        // Half a cell: the shortest beats that a window two cells wide does not average out are about two thirds of a cell long.
        let slow = (maps.as_ref()).is_some_and(|maps| beats(of, maps, longest, |k| k <= SLOW || k >= AVERAGED));
        let mut step = if slow { longest } else { 0.5 * longest };
        while nodes(step).iter().product::<f64>() > MOST {
            step *= 1.1;
        }
        let shape = if common.is_some() { [1; 3] } else { nodes(step).map(|n| n as usize) };
        let origin = core::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a] - step * (shape[a] - 1) as f64));
        Windows {
            phases,
            common,
            origin,
            step,
            per: 1.0 / step,
            shape,
            reach: if slow { step } else { 2.0 * step },
            count: if slow { SLOW_SAMPLES } else { SAMPLES },
            bounds: of.iter().any(may_end).then_some(*bounds),
        }
    }

    /// Number of windows.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The sample positions (mm) of window `i`: uniform over the common cell, or with the density of a raised cosine along each
    /// axis about its centre, over which a wave has mean 0 where two or more whole wavelengths fit in.
    pub fn samples(&self, i: usize) -> Vec<Vec3> {
        if let Some(back) = &self.common {
            return (0..COMMON_SAMPLES).map(low_discrepancy).map(|u| apply(back, u)).collect();
        }
        let [nx, ny, _] = self.shape;
        let at = [i % nx, i / nx % ny, i / nx / ny];
        let centre: Vec3 = core::array::from_fn(|a| self.origin[a] + self.step * at[a] as f64);
        let [x, y, z] = at.map(|n| n % PERIOD);
        let offsets = &window_offsets()[((z * PERIOD + y) * PERIOD + x) * SLOW_SAMPLES..][..self.count];
        let position = |s: &Vec3| -> Vec3 {
            core::array::from_fn(|a| {
                // Lattices that end with the part are not sampled beyond its bounds: positions there are mirrored.
                let p = centre[a] + self.reach * s[a];
                let Some(b) = &self.bounds else { return p };
                let (lo, hi) = (b.min[a], b.max[a]);
                let p = if p > hi { 2.0 * hi - p } else { p };
                let p = if p < lo { 2.0 * lo - p } else { p };
                p.clamp(lo, hi)
            })
        };
        offsets.iter().map(position).collect()
    }

    /// A coordinate along an axis, in steps from the first window.
    #[inline]
    pub fn in_steps(&self, a: usize, v: f64) -> f64 {
        (v - self.origin[a]) * self.per
    }

    /// The interval between windows along an axis in which a coordinate lies: its first window, the weight of the second, and the
    /// slope of that weight (per mm), 0 beyond the outermost.
    #[inline]
    pub fn interval(&self, a: usize, v: f64) -> (usize, f64, f64) {
        let last = (self.shape[a] - 1) as f64;
        let s = self.in_steps(a, v);
        let inside = s.clamp(0.0, last);
        let i = (inside as usize).min(self.shape[a].saturating_sub(2));
        let within = s == inside && last > 0.0;
        (i, inside - i as f64, if within { self.per } else { 0.0 })
    }

    /// The box of the points that window `i` is interpolated to, if there are several.
    pub fn support(&self, i: usize) -> Aabb {
        let [nx, ny, _] = self.shape;
        let at = [i % nx, i / nx % ny, i / nx / ny];
        let middle = |a: usize| self.origin[a] + self.step * at[a] as f64;
        Aabb {
            min: core::array::from_fn(|a| middle(a) - self.step),
            max: core::array::from_fn(|a| middle(a) + self.step),
        }
    }

    /// Number of windows about the points of a box; `None` if it extends beyond the outermost.
    pub fn count_in(&self, b: &Aabb) -> Option<usize> {
        if self.common.is_some() {
            return Some(1);
        }
        let ends = |a: usize| (self.origin[a], self.origin[a] + self.step * (self.shape[a] - 1) as f64);
        let within = (0..3).all(|a| b.min[a] >= ends(a).0 && b.max[a] <= ends(a).1);
        let along = |a: usize| self.interval(a, b.max[a]).0 - self.interval(a, b.min[a]).0 + 2;
        within.then(|| (0..3).map(along).product())
    }

    /// Calls `each` with the windows about the points of a box.
    pub fn each_in(&self, b: &Aabb, mut each: impl FnMut(usize)) {
        let [x, y, z] = core::array::from_fn(|a| {
            let last = self.shape[a] - 1;
            let (lo, hi) = (self.interval(a, b.min[a]).0, self.interval(a, b.max[a]).0);
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

    /// The windows about a point.
    pub fn adjacent(&self, p: Vec3) -> Adjacent {
        let mut out = [(0, 0.0, [0.0; 3]); 8];
        if self.common.is_some() {
            out[0].1 = 1.0;
            return out;
        }
        let [nx, ny, _] = self.shape;
        // Along each axis: index, weight and slope of the two.
        let [xs, ys, zs]: [[(usize, f64, f64); 2]; 3] = core::array::from_fn(|a| {
            let (i, share, slope) = self.interval(a, p[a]);
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

/// Sample positions of `PERIOD`³ windows one after another, with the density Π (1 + cos πs)/2 on [−1, 1]³ (by the inverse of its
/// cumulative distribution).
fn window_offsets() -> &'static [Vec3] {
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
        (0..PERIOD.pow(3) * SLOW_SAMPLES).map(|k| low_discrepancy(k).map(warp)).collect()
    })
}

/// From the unit cube to a common period of all maps at most `most` mm long, if there is one.
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

/// Whether every beat between waves of two of the lattices meets a condition on its wave number (per `longest`); the waves of
/// products of two waves of a series count too, since the indicator of the solid is not linear. False for other fields and where
/// there are too many waves.
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
    // Each list has the opposite of every wave, so differences include sums.
    let meet = |a: &Vec3, b: &Vec3| meets(norm(sub(*a, *b)) * longest);
    (0..waves.len()).all(|i| (0..i).all(|j| waves[i].iter().all(|a| waves[j].iter().all(|b| meet(a, b)))))
}
