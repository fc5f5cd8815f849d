//! The level at which the largest ball that passes through the void has a given diameter.

use super::series::Series;
use super::{Cell, Part, pore};
use geometry::math::{Mat3, Vec3, dot, scale};
use geometry::once::computed;
use geometry::progress::checkpoint;

/// Solid fractions between which a level is sought: below and above, cells are specks of solid or void.
const FRACTIONS: [f64; 2] = [0.005, 0.995];
/// Share of the diameter to which it is met.
const NEAR: f64 = 1e-6;

/// Share of the diameter that a pore may be off.
const MET: f64 = 1e-3;
/// The same to either side of a step that is no jump of the void's.
const UNEVEN: f64 = 0.01;

/// Why no level has a pore: the greatest or the least (mm) that the cell has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoPore {
    /// All are narrower; 0 where the void is closed at every level.
    AtMost(f64),
    /// All are wider, but for those that are closed.
    AtLeast(f64),
}

impl Cell {
    /// Whether the grid on which pores are sought resolves the cell's finest wave: beyond it chambers are too many.
    pub fn resolves_pores(&self) -> bool {
        pore::resolves(self.series())
    }

    /// Diameters (mm) of the largest balls that pass through the void of a part at level `iso`, where u = `to_phase` · x: of a
    /// network the one void, of a sheet f < −iso and f > iso. See `pore`.
    pub fn pores(&self, part: Part, iso: f64, to_phase: &Mat3) -> Vec<f64> {
        let voids = voids(part, iso);
        if part == Part::Sheet && *computed(&self.alternates, || alternates(&self.plain)) {
            return vec![self.pore(voids[0].0, voids[0].1, to_phase); 2];
        }
        voids.into_iter().map(|(side, level)| self.pore(side, level, to_phase)).collect()
    }

    /// Of each void of a part whether it is connected with its translates in all three directions.
    pub fn passages(&self, part: Part, iso: f64) -> Vec<bool> {
        let through = |(side, level): (Part, f64)| {
            let beyond = |open: f64| if side == Part::Lower { level > open } else { level < open };
            self.openings(side).iter().flatten().take_while(|(at, _)| beyond(*at)).count() == 3
        };
        voids(part, iso).into_iter().map(through).collect()
    }

    /// Diameter (mm) of the largest ball that passes through the void f ≤ `level` (`Lower`) or f ≥ `level` (`Upper`), where phases
    /// relate to millimetres by u = `to_phase` · x: in as many independent directions as the void is connected with its
    /// translates. Zero where it is in none, infinite where nothing is solid. To about 1e-7 of the diameter; where several passes
    /// are nearly as wide, and in cells so stretched that a ball is narrower than a step of the grid, to a quarter of a step.
    pub fn pore(&self, side: Part, level: f64, to_phase: &Mat3) -> f64 {
        let beyond = |open: f64| if side == Part::Lower { level > open } else { level < open };
        let open = self.openings(side).iter().flatten().take_while(|(at, _)| beyond(*at)).collect::<Vec<_>>();
        let Some((_, saddle)) = open.last() else {
            return 0.0;
        };
        let to_plain = core::array::from_fn(|a| scale(to_phase[a], f64::from(self.repeats[a])));
        let plain =
            |(at, neck): &(Vec3, f64)| beyond(*neck).then(|| [0, 1, 2].map(|a| at[a] * f64::from(self.repeats[a])));
        let necks = self.necks(side).iter().filter_map(plain).collect();
        let (rank, saddle) = (open.len(), *saddle);
        let void = pore::Void { series: &self.plain, side, level, to_phase: &to_plain, rank, saddle, necks };
        void.pore()
    }

    /// The level at which the narrower void of a part lets a ball of diameter `pore` (mm) pass, where u = `to_phase` · x. Of several
    /// that with the void connected in most directions.
    ///
    /// # Errors
    /// The largest pore (mm) that the cell has, where it is less; the least, where it jumps past what is asked for.
    pub fn level_of_pore(&self, part: Part, pore: f64, to_phase: &Mat3) -> Result<f64, NoPore> {
        // How much is solid grows with this number; a level is it, or its negative.
        let sign = if part == Part::Upper { -1.0 } else { 1.0 };
        let narrower = |amount: f64| {
            checkpoint();
            let all = self.pores(part, sign * amount, to_phase);
            all.into_iter().fold(f64::INFINITY, f64::min)
        };
        let [least, full] = FRACTIONS.map(|p| sign * self.iso(part, p).0);
        let tiny = 1e-9 * (full - least);
        // Where a void becomes connected in fewer directions its pore falls to zero.
        let mut ends: Vec<(f64, bool)> = voids(part, 1.0)
            .into_iter()
            .flat_map(|(side, _)| self.openings(side).iter().flatten().map(move |(t, _)| (side, *t)))
            .map(|(side, t)| (if side == Part::Upper { t } else { -t }, true))
            .filter(|(t, _)| *t > least + tiny && *t < full)
            .collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends.push((full, false));
        let (mut from, mut most, mut fewest) = (least, 0.0f64, f64::INFINITY);
        for (end, closed) in ends {
            let (mut lo, mut hi) = ((from + tiny, narrower(from + tiny)), (end, 0.0));
            from = end;
            most = most.max(lo.1);
            if lo.1 < pore {
                continue;
            }
            if !closed {
                hi.1 = narrower(end);
            }
            if hi.1 > pore {
                fewest = fewest.min(hi.1);
                continue;
            }
            // Squares of diameters are nearly linear; the end that stays counts less (Anderson and Björck's rule).
            let off = |d: f64| d * d - pore * pore;
            let (mut a, mut b, mut last) = (off(lo.1), off(hi.1), 0.0);
            while hi.0 - lo.0 > tiny && (lo.1 / pore - 1.0).abs() > NEAR {
                let t = (lo.0 + (hi.0 - lo.0) * a / (a - b)).clamp(lo.0 + 0.01 * tiny, hi.0 - 0.01 * tiny);
                let d = narrower(t);
                if (d / pore - 1.0).abs() <= NEAR {
                    return Ok(sign * t);
                }
                let new = off(d);
                let less = |old: f64| if new / old < 1.0 { 1.0 - new / old } else { 0.5 };
                if d > pore {
                    (lo, a, b) = ((t, d), new, if last > 0.0 { b * less(a) } else { b });
                } else {
                    (hi, b, a) = ((t, d), new, if last < 0.0 { a * less(b) } else { a });
                }
                last = new;
            }
            if lo.1 <= (1.0 + MET) * pore {
                return Ok(sign * lo.0);
            }
            // Where the pass is found on the grid alone, pores are uneven; the void is there on both sides of such a step.
            if lo.1 < (1.0 + UNEVEN) * pore && hi.1 > (1.0 - UNEVEN) * pore {
                let nearest = if lo.1 - pore < pore - hi.1 { lo.0 } else { hi.0 };
                return Ok(sign * nearest);
            }
            fewest = fewest.min(lo.1);
        }
        Err(if fewest.is_finite() { NoPore::AtLeast(fewest) } else { NoPore::AtMost(most) })
    }
}

/// Whether a translation or an inversion takes f to −f, and so the void on one side of a sheet to that on the other: of a wave
/// cos 2π(h·u + p) a translation by s makes h·s half a turn, an inversion that takes 0 to s makes 2p + h·s half a turn.
fn alternates(series: &Series) -> bool {
    const PARTS: usize = 8;
    let half = |turns: f64| (turns.rem_euclid(1.0) - 0.5).abs() < 1e-9;
    (0..PARTS.pow(3)).any(|k| {
        let s = [k % PARTS, k / PARTS % PARTS, k / PARTS / PARTS].map(|i| i as f64 / PARTS as f64);
        let all = |phases: f64| series.terms().iter().all(|t| half(phases * t.phase + dot(t.hkl.map(f64::from), s)));
        all(0.0) || all(2.0)
    })
}

/// The voids of a part at level `iso`: sides of f and levels.
fn voids(part: Part, iso: f64) -> Vec<(Part, f64)> {
    match part {
        Part::Lower => vec![(Part::Upper, iso)],
        Part::Upper => vec![(Part::Lower, iso)],
        Part::Sheet => vec![(Part::Lower, -iso), (Part::Upper, iso)],
    }
}
