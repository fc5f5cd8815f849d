//! Blends: several lattices in one part, with shares wᵢ ≥ 0 that sum to one everywhere.
//!
//! Lattice i has a core gᵢ, signed so that it is solid where loᵢ ≤ gᵢ ≤ hiᵢ. The blend is solid where LO ≤ F ≤ HI with the convex
//! combination F = Σ wᵢ gᵢ. *By value* (Yang's sum, equation 16 of the paper) LO = Σ wᵢ loᵢ and HI = Σ wᵢ hiᵢ; material is lost
//! half-way, since two independent functions are rarely large at the same position. *By fraction* both are quantiles of F over a
//! window, such that its fraction is the weighted mean of those asked for (`levels`); the gᵢ are then divided by their root mean
//! square deviation, so that none dominates. `docs/concepts/blend.md` has the promise: within 0.01 in a window of two cells.
//!
//! Files import from those above them only:
//!
//! ```text
//! constituent · weights · ends · empirical · share_grid · node_table    what is blended · shares · quantiles of ends · distributions · tables
//! summand · windows                                                     gᵢ and its ends · where phases are sampled together
//! levels                                                                LO and HI, tabulated by shares and windows
//! window_cache · row_cache                                              tables about a point, along a row
//! level_offset                                                          LO and HI at a point, with gradients
//! sum                                                                   F, and the blend's data
//! evaluated · grid_row                                                  summands at points, on a row of a block
//! point_values · mixed_rows                                             the blend at points, on rows with several lattices
//! fill_block                                                            the blend on a block
//! ```

mod constituent;
mod empirical;
mod ends;
mod evaluated;
mod fill_block;
mod grid_row;
mod level_offset;
mod levels;
mod mixed_rows;
mod node_table;
mod point_values;
mod row_cache;
mod share_grid;
mod sum;
mod summand;
mod weights;
mod window_cache;
mod windows;

use std::sync::Arc;

use crate::field::{Block, Field};
use crate::implicit::{Implicit, SurfacePair};
use geometry::math::{Aabb, Interval, Vec3};

pub use constituent::Constituent;
pub use sum::{Blend, BlendRule};
pub use weights::Weights;
pub use windows::Phases;

use sum::BlendBound;
use summand::Summand;

impl Field for Blend {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.values_at(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.gradients_at(points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let mut w = vec![Interval::new(0.0, 0.0); self.summands.len()];
        self.weights.bound(b, &mut w);
        let join = |f: Interval, lo: Interval, hi: Interval| match self.side {
            Some(BlendBound::High) => f - hi,
            Some(BlendBound::Low) => lo - f,
            None if self.two_sided => (f - hi).max(lo - f),
            None => f - hi,
        };
        let ends = |s: &Summand, alone: bool| {
            let hi = s.upper_end_bound(b);
            let low = |high: f64| {
                if alone { s.lower_end_alone(high) } else { s.lower_end(high) }
            };
            let ends = [low(hi.lo), low(hi.hi)];
            (s.bound(b), Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1])), hi)
        };
        let mut here = (0..w.len()).filter(|i| w[*i].hi > 0.0);
        if let (Some(i), None) = (here.next(), here.next()) {
            if self.side == Some(BlendBound::Low) && !self.summands[i].is_sheet() {
                // The lower end of a network is below all its values.
                return Interval::new(f64::NEG_INFINITY, -f64::MIN_POSITIVE);
            }
            let (f, lo, hi) = ends(&self.summands[i], true);
            return join(f, lo, hi);
        }
        let zero = Interval::new(0.0, 0.0);
        let mut highs = vec![zero; w.len()];
        let (mut f, mut lo, mut hi) = (zero, zero, zero);
        for (i, s) in self.summands.iter().enumerate().filter(|(i, _)| w[*i].hi > 0.0) {
            let of = ends(s, false);
            highs[i] = of.2;
            f = f + w[i].times(of.0);
            lo = lo + w[i].times(of.1);
            hi = hi + w[i].times(of.2);
        }
        if let Some(levels) = &self.levels {
            let offset = levels.bound(&self.summands, b, &w, &highs);
            (lo, hi) = (lo + offset[0], hi + offset[1]);
        }
        // A network that may be alone has another lower end there.
        for (i, s) in self.summands.iter().enumerate() {
            if w[i].hi >= 1.0 - 1e-9 && w[i].hi > w[i].lo && !s.is_sheet() {
                lo = lo.union(Interval::new(s.lower_end_alone(0.0), s.lower_end_alone(0.0)));
            }
        }
        join(f, lo, hi)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_block([self.side], block, None, [out]);
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.fill_block([self.side], block, Some(wanted), [out]);
    }
}

impl Implicit for Blend {
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        if !self.is_whole_sheet() {
            return Vec::new();
        }
        SIDES.map(|side| Arc::new(Blend { side, ..self.clone() }) as Arc<dyn Implicit>).into()
    }

    fn pair(&self) -> Option<Arc<dyn SurfacePair>> {
        self.is_whole_sheet().then(|| Arc::new(self.clone()) as Arc<dyn SurfacePair>)
    }

    fn faces(&self) -> Option<[Arc<dyn Implicit>; 2]> {
        if self.summands.iter().all(Summand::is_sheet) { self.parts().try_into().ok() } else { None }
    }

    fn lipschitz(&self) -> f64 {
        self.lipschitz
    }
}

/// The sides in the order of the parts.
const SIDES: [Option<BlendBound>; 2] = [Some(BlendBound::High), Some(BlendBound::Low)];

impl SurfacePair for Blend {
    fn fill_both(&self, block: &Block, wanted: &[u64], out: [&mut [f32]; 2]) {
        self.fill_block(SIDES, block, Some(wanted), out);
    }
}

impl Blend {
    fn is_whole_sheet(&self) -> bool {
        self.two_sided && self.side.is_none()
    }
}
