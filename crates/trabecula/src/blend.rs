//! Several lattices in one part: shares that make one everywhere, and the sum that they make.
//!
//! Each lattice has a core gᵢ, turned so that solid is where loᵢ ≤ gᵢ ≤ hiᵢ: a sheet has two such ends, a network only the
//! upper. The blend is solid where LO ≤ F ≤ HI with F = Σ wᵢ gᵢ. By value, as in Yang's sum (seed equation 16), LO and HI
//! are Σ wᵢ loᵢ and Σ wᵢ hiᵢ, and material is lost half-way: two fields that have nothing to do with each other are
//! rarely large together. By fraction (`levels`) both are moved so that the fraction stays what was asked for; the gᵢ
//! are then in units of their own root mean square, so that none drowns the others.

mod fill;
mod joint;
mod levels;
mod quantile;
mod simplex;
mod strand;
mod weights;

use std::sync::Arc;

use crate::fault::Fault;
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, add, scale, sub};

pub use joint::Phases;
pub use strand::Constituent;
pub use weights::Weights;

use joint::Joint;
use levels::{End, Levels};
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
    slope: f64,
}

/// Places at which the root mean square of a core is found.
const LOOKS: usize = 4096;

impl Blend {
    /// Joins the lattices; `bounds` is where the part is.
    ///
    /// # Errors
    /// Fewer than two lattices, or another number of them than of weights.
    pub fn new(
        of: Vec<Constituent>,
        weights: Weights,
        by: By,
        bounds: &Aabb,
    ) -> Result<Blend, Fault> {
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
        let slope = strands.iter().map(Strand::slope).fold(0.0, f64::max) * 1.5;
        Ok(Blend {
            two_sided: strands.iter().any(Strand::is_sheet),
            strands,
            weights,
            levels,
            side: None,
            slope,
        })
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
                    for (k, o) in own
                        .iter_mut()
                        .enumerate()
                        .filter(|(k, _)| w[k * n + i] > 0.0)
                    {
                        *o = levels.share_found(&self.strands, points[k], i);
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

    /// F, LO and HI at points.
    fn ends(&self, points: &[Vec3]) -> Vec<[f64; 3]> {
        let n = self.strands.len();
        let mut w = vec![0.0; n * points.len()];
        self.weights.values(points, &mut w);
        let mut out = vec![[0.0; 3]; points.len()];
        let mut ends = vec![End::default(); n * points.len()];
        let graded = self.levels.as_ref().is_some_and(|l| !l.is_uniform());
        for (i, s) in self.strands.iter().enumerate() {
            let here: Vec<usize> = (0..points.len()).filter(|k| w[k * n + i] > 0.0).collect();
            let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
            let (mut g, mut high) = (vec![0.0; at.len()], vec![0.0; at.len()]);
            s.values(&at, &mut g);
            s.highs(&at, &mut high);
            for (k, (g, high)) in here.into_iter().zip(g.into_iter().zip(high)) {
                let w = w[k * n + i];
                let o = &mut out[k];
                let low = if w < 1.0 {
                    s.low(high)
                } else {
                    s.low_alone(high)
                };
                *o = [o[0] + w * g, o[1] + w * low, o[2] + w * high];
                if graded && w < 1.0 {
                    ends[k * n + i].quantiles = s.quantiles(high);
                }
            }
        }
        if let Some(levels) = &self.levels {
            let mut place = Place::default();
            for (k, o) in out.iter_mut().enumerate() {
                let w = &w[k * n..][..n];
                if !w.contains(&1.0) {
                    let more =
                        levels.added(&self.strands, points[k], w, &ends[k * n..][..n], &mut place);
                    *o = [o[0], o[1] + more[0], o[2] + more[1]];
                }
            }
        }
        out
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
        let near = (0..some).flat_map(|i| {
            joint
                .places((2 * i + 1) * joint.len() / (2 * some))
                .into_iter()
                .take(each)
        });
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
        let size = if unit && square > 0.0 {
            square.sqrt()
        } else {
            1.0
        };
        Strand::new(c, size, &values, bounds)
    });
    each.collect()
}

impl Field for Blend {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        const BATCH: usize = 1024;
        for (points, out) in points.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            for (o, ends) in out.iter_mut().zip(self.ends(points)) {
                *o = self.value_of(ends);
            }
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let n = self.strands.len();
        let (mut w, mut dw) = (
            vec![0.0; n * points.len()],
            vec![[0.0; 3]; n * points.len()],
        );
        self.weights.gradients(points, &mut w, &mut dw);
        let mut out = vec![([0.0; 3], [[0.0; 3]; 3]); points.len()];
        let mut ends = vec![End::default(); n * points.len()];
        let graded = self.levels.as_ref().is_some_and(|l| !l.is_uniform());
        for (i, s) in self.strands.iter().enumerate() {
            let here: Vec<usize> = (0..points.len()).filter(|k| w[k * n + i] > 0.0).collect();
            let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
            let zeros = || (vec![0.0; at.len()], vec![[0.0; 3]; at.len()]);
            let ((mut g, mut dg), (mut high, mut dhigh)) = (zeros(), zeros());
            s.gradients(&at, &mut g, &mut dg);
            s.high_gradients(&at, &mut high, &mut dhigh);
            // −HI for a sheet, nothing for a network.
            let down = if s.is_sheet() { -1.0 } else { 0.0 };
            for (j, k) in here.into_iter().enumerate() {
                let (w, dw) = (w[k * n + i], dw[k * n + i]);
                let low = if w < 1.0 {
                    s.low(high[j])
                } else {
                    s.low_alone(high[j])
                };
                let of = [
                    (g[j], dg[j]),
                    (low, scale(dhigh[j], down)),
                    (high[j], dhigh[j]),
                ];
                let (v, d) = &mut out[k];
                for (e, (value, slope)) in of.into_iter().enumerate() {
                    v[e] += w * value;
                    d[e] = add(d[e], add(scale(slope, w), scale(dw, value)));
                }
                if graded && w < 1.0 {
                    ends[k * n + i] = End {
                        quantiles: s.quantiles(high[j]),
                        slope: dhigh[j],
                    };
                }
            }
        }
        let mut place = Place::default();
        for (k, (mut v, mut d)) in out.into_iter().enumerate() {
            let own = (&w[k * n..][..n], &dw[k * n..][..n]);
            if let Some(levels) = self.levels.as_ref().filter(|_| !own.0.contains(&1.0)) {
                let ends = &ends[k * n..][..n];
                let (more, slope) =
                    levels.added_gradients(&self.strands, points[k], own, ends, &mut place);
                for e in 0..2 {
                    v[e + 1] += more[e];
                    d[e + 1] = add(d[e + 1], slope[e]);
                }
            }
            values[k] = self.value_of(v);
            let low = match self.side {
                Some(side) => side == Side::Low,
                None => self.two_sided && v[1] - v[0] > v[0] - v[2],
            };
            gradients[k] = if low {
                sub(d[1], d[0])
            } else {
                sub(d[0], d[2])
            };
        }
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
                if alone {
                    s.low_alone(high)
                } else {
                    s.low(high)
                }
            };
            let ends = [low(hi.lo), low(hi.hi)];
            (
                s.bound(b),
                Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1])),
                hi,
            )
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
        for (i, s) in self
            .strands
            .iter()
            .enumerate()
            .filter(|(i, _)| w[*i].hi > 0.0)
        {
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

    fn parts(&self) -> Vec<Arc<dyn Field>> {
        if !self.two_sided || self.side.is_some() {
            return Vec::new();
        }
        let side = |side| {
            Arc::new(Blend {
                side: Some(side),
                ..self.clone()
            }) as Arc<dyn Field>
        };
        vec![side(Side::High), side(Side::Low)]
    }

    fn slope(&self) -> f64 {
        self.slope
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_rows(block, None, out);
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.fill_rows(block, Some(wanted), out);
    }
}
