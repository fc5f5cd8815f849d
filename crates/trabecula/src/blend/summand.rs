//! One summand gᵢ of a blend F = Σ wᵢ gᵢ: a lattice's core, signed and scaled so that it is solid where loᵢ ≤ gᵢ ≤ hiᵢ.
//!
//! gᵢ = ± fᵢ/σᵢ. A sheet of half-level t has both ends, ∓ t/σ. A network has the upper end alone; its lower end is below all its
//! values, so that the second face of a sheet vanishes inside the solid before the network is reached. The quantiles [aᵢ, bᵢ] of
//! the ends are the fractions of the cell in which gᵢ lies below each.

use super::constituent::{Constituent, gradients_of, values_of};
use super::ends::{EndQuantiles, HIGH, LOW};
use crate::cell::Part;
use crate::field::{Block, Field};
use crate::implicit::Implicit;
use crate::lattice::{self, Lattice, Level};
use geometry::math::{Aabb, Interval, Vec3, add, scale};

/// How far the lower end of a network lies below all its values, per range of values; its quantile is −`BELOW`.
const BELOW: f64 = 0.1;

/// A constituent with its core g signed and scaled.
#[derive(Clone)]
pub(super) struct Summand {
    of: Constituent,
    /// g over the core: the sign over the scale.
    factor: f64,
    /// The lower end of a network in a blend.
    lower: f64,
    /// The lower end of a network that is alone: below all values, proven.
    lower_alone: f64,
    /// Step of the core in finite differences of its distribution.
    difference: f64,
}

/// Least lower end, for fields without a bound; its square is finite in single precision too.
const LEAST: f64 = -1e18;

impl Summand {
    /// g is the core over `unit`, or its negative for `Part::Upper`. The range of a field that is no lattice is that of `samples`,
    /// values of it in `bounds`.
    pub fn new(of: Constituent, unit: f64, samples: &[f64], bounds: &Aabb) -> Summand {
        let negated = matches!(&of, Constituent::Lattice(l) if l.part == Part::Upper);
        let mut made = Summand {
            factor: if negated { -1.0 } else { 1.0 } / unit,
            of,
            lower: 0.0,
            lower_alone: 0.0,
            difference: 0.0,
        };
        let below = |range: Interval| range.lo - BELOW * (range.hi - range.lo);
        match &made.of {
            Constituent::Lattice(l) => {
                let range = l.distance().map_or_else(|| l.cell.range(), |d| d.range());
                made.lower = below(made.scaled(range));
                made.lower_alone = made.lower;
                let most = l.distance().map_or(f64::INFINITY, |d| d.range().abs().hi);
                made.difference = 2e-4 * l.cell.series().amplitude().min(most);
            }
            Constituent::Field { field, .. } => {
                // The proven bound is far below all values: with it a sheet's second face would vanish at once.
                let (lo, hi) =
                    (samples.iter()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                let proven = made.factor * field.bound(bounds).lo;
                made.lower = below(made.scaled(Interval::new(lo.min(hi), hi)));
                made.lower_alone = made.lower.min(proven.max(LEAST) - made.factor);
            }
            // It has both ends.
            Constituent::Wall { .. } => {}
        }
        made
    }

    pub fn lattice(&self) -> Option<&Lattice> {
        self.of.lattice()
    }

    /// Whether it has two ends.
    pub fn is_sheet(&self) -> bool {
        match &self.of {
            Constituent::Lattice(l) => l.part == Part::Sheet,
            Constituent::Field { .. } => false,
            Constituent::Wall { .. } => true,
        }
    }

    /// The greatest length of a cell, mm.
    pub fn longest(&self) -> f64 {
        self.of.longest()
    }

    /// A Lipschitz bound of g, per mm.
    pub fn lipschitz(&self) -> f64 {
        let own = match &self.of {
            Constituent::Lattice(l) => l.lipschitz(),
            Constituent::Field { field, .. } => field.lipschitz(),
            Constituent::Wall { sides, .. } => sides[0].lipschitz().max(sides[1].lipschitz()),
        };
        own * self.factor.abs()
    }

    /// Fills g at points (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.of.cores(points, out);
        out.iter_mut().for_each(|v| *v *= self.factor);
    }

    /// g at points (mm), in single precision.
    pub fn single_values(&self, points: &[Vec3]) -> Vec<f32> {
        let mut out = vec![0f32; points.len()];
        match &self.of {
            Constituent::Lattice(l) if l.distance().is_none() => {
                let mut u = vec![[0.0; 3]; points.len()];
                l.map.phases(points, &mut u);
                let each = [0, 1, 2].map(|a| u.iter().map(|u| u[a]).collect());
                l.cell.series().fill(&each, &mut out);
            }
            of => {
                let mut values = vec![0.0; points.len()];
                of.cores(points, &mut values);
                out.iter_mut().zip(values).for_each(|(o, v)| *o = v as f32);
            }
        }
        let factor = self.factor as f32;
        out.iter_mut().for_each(|v| *v *= factor);
        out
    }

    /// Fills g and ∇g (per mm).
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match &self.of {
            Constituent::Lattice(l) => l.core_gradients(points, values, gradients),
            Constituent::Field { field, .. } => field.gradients(points, values, gradients),
            Constituent::Wall { sides, .. } => {
                gradients_of(sides, [0.5, -0.5], points, values, gradients);
            }
        }
        values.iter_mut().for_each(|v| *v *= self.factor);
        gradients.iter_mut().for_each(|g| *g = scale(*g, self.factor));
    }

    /// An interval that contains g in the box.
    pub fn bound(&self, b: &Aabb) -> Interval {
        self.scaled(match &self.of {
            Constituent::Lattice(l) => l.core_bound(b),
            Constituent::Field { field, .. } => field.bound(b),
            Constituent::Wall { sides, .. } => (sides[0].bound(b) - sides[1].bound(b)).times(Interval::new(0.5, 0.5)),
        })
    }

    /// An interval that contains the upper end in the box.
    pub fn upper_end_bound(&self, b: &Aabb) -> Interval {
        if let Some(high) = self.uniform_upper_end() {
            return Interval::new(high, high);
        }
        match &self.of {
            Constituent::Lattice(l) => self.scaled(l.iso_bound(b)),
            Constituent::Field { .. } => Interval::new(0.0, 0.0),
            Constituent::Wall { sides, .. } => {
                let sum = sides[0].bound(b) + sides[1].bound(b);
                self.scaled(sum.times(Interval::new(-0.5, -0.5)))
            }
        }
    }

    /// Core to g.
    pub fn scaled_value(&self, core: f64) -> f64 {
        self.factor * core
    }

    /// Core to g.
    fn scaled(&self, r: Interval) -> Interval {
        let ends = [self.factor * r.lo, self.factor * r.hi];
        Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1]))
    }

    /// The upper end, where it does not vary.
    pub fn uniform_upper_end(&self) -> Option<f64> {
        match &self.of {
            Constituent::Lattice(l) => l.uniform().map(|t| self.factor * t),
            Constituent::Field { .. } => Some(0.0),
            Constituent::Wall { half, .. } => half.map(|t| self.factor * t),
        }
    }

    /// Fills the upper end at points (mm).
    pub fn upper_ends(&self, points: &[Vec3], out: &mut [f64]) {
        match &self.of {
            Constituent::Lattice(l) => l.isos(points, out),
            Constituent::Field { .. } => out.fill(0.0),
            Constituent::Wall { half: Some(t), .. } => out.fill(*t),
            Constituent::Wall { sides, .. } => {
                values_of(sides, points, out, |[a, b]| -0.5 * (a + b));
            }
        }
        out.iter_mut().for_each(|v| *v *= self.factor);
    }

    /// Fills the upper end and its gradient (per mm).
    pub fn upper_end_gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match &self.of {
            Constituent::Lattice(l) => l.iso_gradients(points, values, gradients),
            Constituent::Field { .. } => {
                values.fill(0.0);
                gradients.fill([0.0; 3]);
            }
            Constituent::Wall { half: Some(t), .. } => {
                values.fill(*t);
                gradients.fill([0.0; 3]);
            }
            Constituent::Wall { sides, .. } => {
                gradients_of(sides, [-0.5, -0.5], points, values, gradients);
            }
        }
        values.iter_mut().for_each(|v| *v *= self.factor);
        gradients.iter_mut().for_each(|g| *g = scale(*g, self.factor));
    }

    /// The lower end in a blend, where the upper end is `high`.
    pub fn lower_end(&self, high: f64) -> f64 {
        if self.is_sheet() { -high } else { self.lower }
    }

    /// The lower end where this summand is alone.
    pub fn lower_end_alone(&self, high: f64) -> f64 {
        if self.is_sheet() { -high } else { self.lower_alone }
    }

    /// One end (`LOW` or `HIGH`), where the upper end is `high`.
    #[inline]
    pub fn end(&self, end: usize, high: f64, alone: bool) -> f64 {
        match (end, alone) {
            (HIGH, _) => high,
            (_, true) => self.lower_end_alone(high),
            (_, false) => self.lower_end(high),
        }
    }

    /// The derivative of an end by the upper end.
    pub fn end_slope(&self, end: usize) -> f64 {
        match end {
            HIGH => 1.0,
            _ if self.is_sheet() => -1.0,
            _ => 0.0,
        }
    }

    /// The quantiles of both ends, where the upper end is `high`: the fractions of the cell in which g is below them. `None` of
    /// fields that are no lattices, whose distribution is known from samples alone.
    pub fn quantiles(&self, high: f64) -> Option<[f64; 2]> {
        let l = self.lattice()?;
        let t = high / self.factor;
        Some(match l.part {
            Part::Lower => [-BELOW, l.below(t)],
            // g = −f: below the end is where f is above t.
            Part::Upper => [-BELOW, 1.0 - l.below(t)],
            Part::Sheet => [l.below(-t), l.below(t)],
        })
    }

    /// The same from `samples`, the values of g at positions (mm).
    pub fn empirical_quantiles(&self, positions: &[Vec3], samples: &[f32]) -> [f64; 2] {
        let mut high = vec![0.0; positions.len()];
        self.upper_ends(positions, &mut high);
        let mut count = [0usize; 2];
        for (v, high) in samples.iter().zip(high) {
            count[0] += usize::from(f64::from(*v) < -high);
            count[1] += usize::from(f64::from(*v) <= high);
        }
        let share = count.map(|n| n as f64 / samples.len() as f64);
        if self.is_sheet() { share } else { [-BELOW, share[1]] }
    }

    /// The derivatives of the quantiles by `high`, by central differences.
    fn quantile_slopes(&self, l: &Lattice, high: f64) -> [f64; 2] {
        let h = self.difference;
        let t = high / self.factor;
        let slope = |t: f64| (l.below(t + h) - l.below(t - h)) / (2.0 * h) / self.factor;
        match l.part {
            Part::Lower => [0.0, slope(t)],
            Part::Upper => [0.0, -slope(t)],
            Part::Sheet => [-slope(-t), slope(t)],
        }
    }

    /// Fills the upper end at points (mm) and, of a lattice, the quantiles of both ends; returns whether it is one.
    pub fn ends(&self, points: &[Vec3], high: &mut [f64], quantiles: &mut [[f64; 2]]) -> bool {
        let Some(l) = self.lattice() else {
            self.upper_ends(points, high);
            return false;
        };
        let both = |high: f64| self.quantiles(high).unwrap_or_default();
        match (&l.level, l.uniform()) {
            (_, Some(t)) => {
                high.fill(self.factor * t);
                quantiles.fill(both(self.factor * t));
            }
            (Level::Fraction(grade), None) => {
                grade.values(points, high);
                for (t, q) in high.iter_mut().zip(quantiles) {
                    let p = *t;
                    *t = self.factor * l.iso(p).0;
                    *q = self.quantiles_of_fraction(l, *t, p);
                }
            }
            _ => {
                self.upper_ends(points, high);
                (quantiles.iter_mut().zip(high)).for_each(|(q, high)| *q = both(*high));
            }
        }
        true
    }

    /// The same with gradients (per mm).
    pub fn end_gradients(
        &self,
        points: &[Vec3],
        high: &mut [f64],
        slopes: &mut [Vec3],
        quantiles: &mut [EndQuantiles],
    ) -> bool {
        let Some(l) = self.lattice() else {
            self.upper_end_gradients(points, high, slopes);
            return false;
        };
        let (Level::Fraction(grade), None) = (&l.level, l.uniform()) else {
            self.upper_end_gradients(points, high, slopes);
            for ((high, slope), q) in high.iter().zip(slopes).zip(quantiles) {
                q.quantiles = self.quantiles(*high).unwrap_or_default();
                q.slopes = self.quantile_slopes(l, *high).map(|by| scale(*slope, by));
            }
            return true;
        };
        grade.gradients(points, high, slopes);
        for ((t, dt), q) in high.iter_mut().zip(slopes).zip(quantiles) {
            let (p, dp) = (*t, *dt);
            let (iso, slope) = l.iso(p);
            (*t, *dt) = (self.factor * iso, scale(dp, self.factor * slope));
            q.quantiles = self.quantiles_of_fraction(l, *t, p);
            q.slopes = match l.part {
                Part::Sheet => {
                    let low = scale(*dt, self.quantile_slopes(l, *t)[LOW]);
                    [low, add(low, dp)]
                }
                Part::Lower | Part::Upper => [[0.0; 3], dp],
            };
        }
        true
    }

    /// The quantiles of a lattice of fraction p, whose upper end is `high`: one of them without its table of fractions.
    fn quantiles_of_fraction(&self, l: &Lattice, high: f64, p: f64) -> [f64; 2] {
        let p = p.clamp(0.0, 1.0);
        match l.part {
            Part::Sheet => {
                let low = l.below(-high / self.factor);
                [low, low + p]
            }
            Part::Lower | Part::Upper => [-BELOW, p],
        }
    }

    /// g on the rows of a block; `wanted` says where.
    pub fn rows<'a>(&'a self, block: &Block<'a>, wanted: Option<&[u64]>) -> SummandRows<'a> {
        let shape = [block.axes[0].len(), block.axes[1].len()];
        let filled = |field: &dyn Field| {
            let mut values = vec![0f32; block.len()];
            match wanted {
                Some(w) => field.fill_where(block, w, &mut values),
                None => field.fill(block, &mut values),
            }
            values
        };
        let of = match &self.of {
            Constituent::Lattice(l) => CoreRows::Lattice(Box::new(lattice::LatticeRows::new(l, block))),
            Constituent::Field { field, .. } => CoreRows::Filled(filled(&**field), shape),
            Constituent::Wall { sides, .. } => {
                let [mut a, b] = sides.each_ref().map(|side| filled(&**side));
                (a.iter_mut().zip(b)).for_each(|(a, b)| *a = 0.5 * (*a - b));
                CoreRows::Filled(a, shape)
            }
        };
        SummandRows { of, factor: self.factor }
    }
}

/// The core of a summand on the rows of a block.
pub(super) struct SummandRows<'a> {
    of: CoreRows<'a>,
    factor: f64,
}

enum CoreRows<'a> {
    Lattice(Box<lattice::LatticeRows<'a>>),
    Filled(Vec<f32>, [usize; 2]),
}

impl SummandRows<'_> {
    /// Makes ready for the rows of layer k.
    pub fn enter_layer(&mut self, k: usize) {
        if let CoreRows::Lattice(rows) = &mut self.of {
            rows.enter_layer(k);
        }
    }

    /// Fills the row (j, k) of the layer entered last with the core in single precision.
    pub fn fill(&mut self, j: usize, k: usize, wanted: u64, row: &mut [f32]) {
        match &mut self.of {
            CoreRows::Lattice(rows) => rows.fill(j, k, wanted, row),
            CoreRows::Filled(values, [nx, ny]) => {
                row.copy_from_slice(&values[(k * *ny + j) * *nx..][..*nx]);
            }
        }
    }

    /// g where the core is `core`.
    #[inline]
    pub fn value(&self, core: f32) -> f64 {
        self.factor * f64::from(core)
    }
}
