//! Several lattices in one part: shares that make one everywhere, and the sum that they make.
//!
//! Each lattice has a core gᵢ, turned so that solid is where loᵢ ≤ gᵢ ≤ hiᵢ: a sheet has two such ends, a network only the
//! upper. The blend is solid where LO ≤ F ≤ HI with F = Σ wᵢ gᵢ. By value, as in Yang's sum (seed equation 16), LO and HI
//! are Σ wᵢ loᵢ and Σ wᵢ hiᵢ, and material is lost half-way: two fields that have nothing to do with each other are
//! rarely large together. By fraction (`levels`) both are moved so that the fraction stays what was asked for; the gᵢ
//! are then in units of their own root mean square, so that none drowns the others.

mod added;
mod constituent;
mod fill;
mod joint;
mod levels;
mod mixed;
mod near;
mod quantile;
mod seen;
mod simplex;
mod strand;
mod table;
mod weights;

use std::sync::Arc;

use crate::field::{Block, Field};
use crate::implicit::Implicit;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, scale, sub};

pub use constituent::Constituent;
pub use joint::Phases;
pub use weights::Weights;

use added::{At, End, HIGH, LOW};
use joint::Joint;
use levels::Levels;
use near::Near;
use seen::{Seen, zeros};
use simplex::Place;
use strand::Strand;

/// What a blend keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum By {
    /// The fractions that are asked for.
    #[default]
    Fraction,
    /// The sum of the fields as it comes.
    Value,
}

/// One of the two inequalities of a blend with sheets in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// F ≤ HI.
    High,
    /// F ≥ LO.
    Low,
}

/// A blend of lattices, as a field: the greater of F − HI and LO − F.
#[derive(Clone)]
pub struct Blend {
    strands: Arc<[Strand]>,
    weights: Weights,
    /// Set where the fraction is kept.
    levels: Option<Arc<Levels>>,
    /// Whether any lattice is a sheet, so that there is a lower end.
    two_sided: bool,
    /// Set for one side alone.
    side: Option<Side>,
    lipschitz: f64,
}

/// Places at which the root mean square of a core is found.
const LOOKS: usize = 4096;

impl Blend {
    /// Joins the lattices; `bounds` is where the part is.
    ///
    /// # Errors
    /// Fewer than two lattices, or another number of them than of weights.
    pub fn new(of: Vec<Constituent>, weights: Weights, by: By, bounds: &Aabb) -> Result<Blend, Fault> {
        if of.len() < 2 || of.len() != weights.len() || of.len() > fill::MOST {
            let message = format!(
                "{} lattices and {} weights; a blend is of 2 to {} lattices with a weight each",
                of.len(),
                weights.len(),
                fill::MOST
            );
            return Err(Fault::new("", message));
        }
        let joint = Joint::new(&of, bounds);
        let unit = by == By::Fraction;
        let strands: Arc<[Strand]> = looked(of, unit, &joint, bounds).into();
        let levels = unit.then(|| Arc::new(Levels::new(&strands, joint, &weights)));
        // Shares move no faster than a cell is long, or the blend is no blend: half as much again for them.
        let lipschitz = strands.iter().map(Strand::lipschitz).fold(0.0, f64::max) * 1.5;
        Ok(Blend { two_sided: strands.iter().any(Strand::is_sheet), strands, weights, levels, side: None, lipschitz })
    }

    /// The shares.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// The greatest length of a cell, mm.
    pub fn longest(&self) -> f64 {
        self.strands.iter().map(Strand::longest).fold(0.0, f64::max)
    }

    /// How the phases go together, where the fraction is kept.
    pub fn phases(&self) -> Option<Phases> {
        self.levels.as_ref().map(|l| l.joint.phases)
    }

    /// Fills the fraction that is asked for at points (mm): Σ wᵢ pᵢ. That of a field of another kind is what it has in the
    /// neighbourhood; by value nobody has looked, and where such a field counts the fraction is NaN.
    pub fn fractions(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.strands.len();
        let mut w = vec![0.0; n * points.len()];
        self.weights.values(points, &mut w);
        let mut own = vec![0.0; points.len()];
        out.fill(0.0);
        for (i, s) in self.strands.iter().enumerate() {
            match (s.lattice(), &self.levels) {
                (Some(l), _) => l.fractions(points, &mut own),
                (None, Some(levels)) => {
                    for (k, o) in own.iter_mut().enumerate().filter(|(k, _)| w[k * n + i] > 0.0) {
                        let [a, b] = levels.found(&self.strands, points[k], i).quantiles;
                        *o = b - a.max(0.0);
                    }
                }
                (None, None) => own.fill(f64::NAN),
            }
            for (k, (o, p)) in out.iter_mut().zip(&own).enumerate() {
                if w[k * n + i] > 0.0 {
                    *o += w[k * n + i] * p;
                }
            }
        }
    }

    /// The ends that count, of `LOW` and `HIGH`.
    fn ends(&self) -> &'static [usize] {
        match self.side {
            Some(Side::High) => &[HIGH],
            Some(Side::Low) => &[LOW],
            None if self.two_sided => &[HIGH, LOW],
            None => &[HIGH],
        }
    }

    /// Whether levels vary from place to place with what the quantiles of the lattices are.
    fn varied(&self) -> Option<&Levels> {
        self.levels.as_deref().filter(|l| !l.is_uniform())
    }

    /// Fills a lattice's upper end at points (mm), and the quantiles of both ends where levels vary.
    fn ends_of(&self, s: usize, points: &[Vec3], high: &mut [f64], quantiles: &mut [[f64; 2]]) {
        let strand = &self.strands[s];
        let Some(levels) = self.varied() else {
            return strand.highs(points, high);
        };
        if !strand.ends(points, high, quantiles) {
            for (q, p) in quantiles.iter_mut().zip(points) {
                *q = levels.found(&self.strands, *p, s).quantiles;
            }
        }
    }

    /// The value at a point where the lattices with shares `w` make the sum `f`, and their upper ends are `high`; their
    /// quantiles are there already.
    fn value_at(&self, p: Vec3, f: f64, (w, high): (&[f64], &[f64]), at: &mut At) -> f64 {
        let alone = w.contains(&1.0);
        let levels = self.levels.as_deref().filter(|_| !alone);
        if let Some(levels) = levels {
            levels.grid.place(w, &mut at.place);
        }
        let mut ends = [0.0; 2];
        for &end in self.ends() {
            for (i, s) in self.strands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                ends[end] += w[i] * s.end(end, high[i], alone);
            }
            if let Some(levels) = levels {
                ends[end] += levels.added(&self.strands, p, w, at, end);
            }
        }
        self.value_of([f, ends[LOW], ends[HIGH]])
    }

    /// Values and gradients of N lattices, or of any number if N is 0, with C neighbourhoods about each point.
    fn gradients_of<const N: usize, const C: usize>(
        &self,
        points: &[Vec3],
        values: &mut [f64],
        gradients: &mut [Vec3],
    ) {
        let n = if N > 0 { N } else { self.strands.len() };
        let strands = &self.strands[..n];
        let (mut w, mut dw) = zeros(n * points.len());
        self.weights.gradients(points, &mut w, &mut dw);
        let seen = |i: usize| Seen::where_counted(self, i, points, |k| w[k * n + i] > 0.0);
        let seen: Vec<Seen> = (0..n).map(seen).collect();
        let varied = self.varied().is_some();
        let mut quantiles = vec![End::default(); if varied { n } else { 0 }];
        let mut place = Place::default();
        let mut near = self.levels.as_deref().map(|l| Near::<C>::new(l, strands));
        for (k, p) in points.iter().enumerate() {
            let (w, dw) = (&w[k * n..][..n], &dw[k * n..][..n]);
            let there = || seen.iter().enumerate().filter(|(i, _)| w[*i] > 0.0);
            let (mut f, mut df) = (0.0, [0.0; 3]);
            for (i, of) in there() {
                f += w[i] * of.core[k];
                let own = add(scale(of.core_slope[k], w[i]), scale(dw[i], of.core[k]));
                df = add(df, own);
            }
            if varied {
                (quantiles.iter_mut().zip(&seen)).for_each(|(q, of)| *q = of.quantiles[k]);
            }
            let alone = w.contains(&1.0);
            let levels = self.levels.as_deref().filter(|_| !alone);
            if let (Some(levels), Some(near)) = (levels, &mut near) {
                levels.grid.place(w, &mut place);
                near.enter(*p);
            }
            for (e, &end) in self.ends().iter().enumerate() {
                let (mut level, mut slope) = (0.0, [0.0; 3]);
                for (i, of) in there() {
                    let s = &strands[i];
                    let v = s.end(end, of.high[k], alone);
                    level += w[i] * v;
                    let own = scale(of.high_slope[k], w[i] * s.end_slope(end));
                    slope = add(slope, add(own, scale(dw[i], v)));
                }
                if let (Some(levels), Some(near)) = (levels, &mut near) {
                    let own = (w, dw, &place);
                    let more = levels.added_gradients(strands, near, own, &quantiles, end);
                    (level, slope) = (level + more.0, add(slope, more.1));
                }
                let (v, g) = match end == HIGH {
                    true => (f - level, sub(df, slope)),
                    false => (level - f, sub(slope, df)),
                };
                if e == 0 || v > values[k] {
                    (values[k], gradients[k]) = (v, g);
                }
            }
        }
    }

    /// The value where F, LO and HI are these.
    fn value_of(&self, [f, lo, hi]: [f64; 3]) -> f64 {
        match self.side {
            Some(Side::High) => f - hi,
            Some(Side::Low) => lo - f,
            None if self.two_sided => (f - hi).max(lo - f),
            None => f - hi,
        }
    }
}

/// The lattices after a look at each; if `unit`, with their cores in units of their root mean square deviation from the mean.
fn looked(of: Vec<Constituent>, unit: bool, joint: &Joint, bounds: &Aabb) -> Vec<Strand> {
    let mut points = match joint.phases {
        Phases::Drifting => Vec::new(),
        Phases::Locked | Phases::Independent => joint.places(0),
    };
    if points.is_empty() {
        let each = LOOKS.div_ceil(joint.len()).max(64);
        // Neighbourhoods spread over all of them.
        let some = (LOOKS / each).min(joint.len()).max(1);
        let near = (0..some).flat_map(|i| joint.places((2 * i + 1) * joint.len() / (2 * some)).into_iter().take(each));
        points.extend(near);
    } else {
        points.truncate(LOOKS);
    }
    let mut values = vec![0.0; points.len()];
    let each = of.into_iter().map(|c| {
        c.cores(&points, &mut values);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        let size = if unit && square > 0.0 { square.sqrt() } else { 1.0 };
        Strand::new(c, size, &values, bounds)
    });
    each.collect()
}

impl Field for Blend {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        const BATCH: usize = 1024;
        let n = self.strands.len();
        let mut at = At::default();
        for (points, out) in points.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            let all = || vec![0.0; n * points.len()];
            let (mut w, mut high, mut f) = (all(), all(), vec![0.0; points.len()]);
            let mut quantiles = vec![[0.0; 2]; n * points.len()];
            self.weights.values(points, &mut w);
            for (i, s) in self.strands.iter().enumerate() {
                let here: Vec<usize> = (0..points.len()).filter(|k| w[k * n + i] > 0.0).collect();
                let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
                let (mut g, mut own) = (vec![0.0; at.len()], vec![0.0; at.len()]);
                let mut q = vec![[0.0; 2]; at.len()];
                s.values(&at, &mut g);
                self.ends_of(i, &at, &mut own, &mut q);
                for (j, k) in here.into_iter().enumerate() {
                    f[k] += w[k * n + i] * g[j];
                    (high[k * n + i], quantiles[k * n + i]) = (own[j], q[j]);
                }
            }
            for (k, (o, p)) in out.iter_mut().zip(points).enumerate() {
                let w = &w[k * n..][..n];
                let own = (w, &high[k * n..][..n]);
                at.q.clear();
                at.q.extend_from_slice(&quantiles[k * n..][..n]);
                *o = self.value_at(*p, f[k], own, &mut at);
            }
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        // The same each time; the compiler knows the number of few.
        let one = self.levels.as_deref().is_none_or(|l| l.joint.len() == 1);
        let of = match (self.strands.len(), one) {
            (2, false) => Blend::gradients_of::<2, 8>,
            (3, false) => Blend::gradients_of::<3, 8>,
            (_, false) => Blend::gradients_of::<0, 8>,
            (2, true) => Blend::gradients_of::<2, 1>,
            (3, true) => Blend::gradients_of::<3, 1>,
            (_, true) => Blend::gradients_of::<0, 1>,
        };
        of(self, points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let mut w = vec![Interval::new(0.0, 0.0); self.strands.len()];
        self.weights.bound(b, &mut w);
        let join = |f: Interval, lo: Interval, hi: Interval| match self.side {
            Some(Side::High) => f - hi,
            Some(Side::Low) => lo - f,
            None if self.two_sided => (f - hi).max(lo - f),
            None => f - hi,
        };
        let ends = |s: &Strand, alone: bool| {
            let hi = s.high_bound(b);
            let low = |high: f64| {
                if alone { s.low_alone(high) } else { s.low(high) }
            };
            let ends = [low(hi.lo), low(hi.hi)];
            (s.bound(b), Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1])), hi)
        };
        let mut here = (0..w.len()).filter(|i| w[*i].hi > 0.0);
        if let (Some(i), None) = (here.next(), here.next()) {
            if self.side == Some(Side::Low) && !self.strands[i].is_sheet() {
                // Its lower end is below all its values.
                return Interval::new(f64::NEG_INFINITY, -f64::MIN_POSITIVE);
            }
            let (f, lo, hi) = ends(&self.strands[i], true);
            return join(f, lo, hi);
        }
        let zero = Interval::new(0.0, 0.0);
        let mut highs = vec![zero; w.len()];
        let (mut f, mut lo, mut hi) = (zero, zero, zero);
        for (i, s) in self.strands.iter().enumerate().filter(|(i, _)| w[*i].hi > 0.0) {
            let of = ends(s, false);
            highs[i] = of.2;
            f = f + w[i].times(of.0);
            lo = lo + w[i].times(of.1);
            hi = hi + w[i].times(of.2);
        }
        if let Some(levels) = &self.levels {
            let more = levels.bound(&self.strands, b, &w, &highs);
            (lo, hi) = (lo + more[0], hi + more[1]);
        }
        // Where one of them may be alone its lower end is another one.
        for (i, s) in self.strands.iter().enumerate() {
            if w[i].hi >= 1.0 - 1e-9 && w[i].hi > w[i].lo && !s.is_sheet() {
                lo = lo.union(Interval::new(s.low_alone(0.0), s.low_alone(0.0)));
            }
        }
        join(f, lo, hi)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_rows(block, None, out);
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.fill_rows(block, Some(wanted), out);
    }
}

impl Implicit for Blend {
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        if !self.two_sided || self.side.is_some() {
            return Vec::new();
        }
        let side = |side| Arc::new(Blend { side: Some(side), ..self.clone() }) as Arc<dyn Implicit>;
        vec![side(Side::High), side(Side::Low)]
    }

    fn lipschitz(&self) -> f64 {
        self.lipschitz
    }
}
