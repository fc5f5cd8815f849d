//! The reach of a line (Federer, Curvature measures, Trans. Amer. Math. Soc. 93, 1959), within which a sweep neither folds nor
//! tears, and the refusal of regions in which it does.

use super::Sweep;
use super::line::{FINE, FramedCurve, SamplePoint};
use crate::field::Field;
use crate::map::Mapping;
use geometry::fault::{Fault, position};
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};

impl FramedCurve {
    /// Federer's reach: the least |q − p|²/(2 |the part of q − p across the tangent at p|) over points of the line, which is at
    /// most the least radius of curvature and half the width of the narrowest bottleneck. Open lines are followed `far` (mm)
    /// beyond their ends.
    pub fn reach(&self, far: f64) -> f64 {
        let mut least = f64::INFINITY;
        let mut all = self.sample_points.clone();
        let ends = [(0, -1.0), (self.sample_points.len() - 1, 1.0)];
        for (end, sign) in ends.into_iter().filter(|_| !self.closed) {
            let k = self.sample_points[end];
            let ahead = |i: usize| sign * far * i as f64 / (8 * FINE) as f64;
            all.extend(
                (1..=8 * FINE).map(|i| SamplePoint { position: add(k.position, scale(k.tangent, ahead(i))), ..k }),
            );
        }
        for k in &self.sample_points {
            least = least.min(1.0 / norm(k.bend).max(1e-300));
        }
        for k in &all {
            for q in &all {
                let step = sub(q.position, k.position);
                let off = norm(cross(step, k.tangent));
                if off > 1e-9 * self.length {
                    least = least.min(dot(step, step) / (2.0 * off));
                }
            }
        }
        // A tenth off: between the sample points it may be less.
        0.9 * least
    }
}

impl Sweep {
    /// Refuses a map that folds or tears at one of the positions `samples` in the region.
    pub(super) fn refuse_folds(&mut self, region: &dyn Field, samples: &[Vec3]) -> Result<(), Fault> {
        let fold = |p: Vec3, radius: f64| {
            let message = format!(
                "the lattice folds at {}: the line bends there with a radius of {radius:.3} mm, and the region reaches its \
                 centre; bend the line less, or keep the region nearer to it",
                position(p)
            );
            Err(Fault::new("points", message))
        };
        for k in &self.line.sample_points {
            let bent = norm(k.bend);
            let center = add(k.position, scale(k.bend, 1.0 / (bent * bent)));
            if bent > 1e-9 / self.line.length && region.value(center) <= 0.0 {
                let own = norm(sub(center, k.position)) <= self.away(center) * (1.0 + 1e-6);
                if own {
                    return fold(center, 1.0 / bent);
                }
            }
        }
        let mut range: [Option<(f64, Vec3)>; 2] = [None; 2];
        let h = 0.125 * self.wavelength.iter().copied().fold(f64::INFINITY, f64::min);
        for p in samples {
            let own = self.local(*p);
            if own.stretch <= 0.0 {
                return fold(*p, self.reach);
            }
            for (r, better) in range.iter_mut().zip([f64::lt, f64::gt]) {
                if r.is_none_or(|r| better(&own.stretch, &r.0)) {
                    *r = Some((own.stretch, *p));
                }
            }
            for a in 0..3 {
                let mut q = *p;
                q[a] += h;
                if region.value(q) > 0.0 {
                    continue;
                }
                let other = self.local(q);
                let mut apart = (other.s - own.s).abs();
                if self.line.closed {
                    apart = apart.min(self.line.length - apart);
                }
                // A step of length h changes s by at most h / (1 − κ·d).
                if apart > 4.0 * h / own.stretch.min(other.stretch).max(1e-3) {
                    let message = format!(
                        "the lattice tears at {}: two places of the line are as near, {apart:.3} mm apart along it; keep the \
                         region nearer to the line, or the line farther from itself",
                        position(*p)
                    );
                    return Err(Fault::new("points", message));
                }
            }
        }
        let [least, most] = range.map(|r| r.unwrap_or((1.0, self.line.sample_points[0].position)));
        self.along = [least.0, most.0].map(|r| r * self.wavelength[2]);
        self.extremes = [least.1, most.1].map(|p| self.jacobian(p));
        Ok(())
    }
}
