//! A wire frame cut to a region.

use rayon::prelude::*;

use super::wire::Wire;
use crate::Values;
use geometry::math::{Vec3, add, norm, scale, sub};

/// What becomes of struts that leave the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trim {
    /// They stay, and are cut by the region's surface.
    #[default]
    Cut,
    /// They go.
    Drop,
    /// They end on the surface.
    Snap,
}

/// What was trimmed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trimmed {
    /// Struts that have no part in the region.
    pub outside: usize,
    /// Struts left out because they leave the region.
    pub dropped: usize,
    /// Struts that were shortened to the surface.
    pub snapped: usize,
}

/// What becomes of a strut.
enum Fate {
    Stays,
    Outside,
    Dropped,
    /// From the node inside it goes so far towards the other.
    Shortened([u32; 2], f64),
}

/// Nodes whose distance is taken at once.
const BATCH: usize = 1024;
/// Steps along a strut at least: beyond it a bay of the region is overlooked.
const STEPS: f64 = 256.0;
/// How near the surface (of the strut's length) a crossing is found.
const NEAR: f64 = 1e-10;

impl Trim {
    /// Trims a frame to a region, given by its signed distance (steeper nowhere than 1). Struts within `reach` (mm) of
    /// the region, a ball's radius, count as having a part in it. Ends within `slack` (mm) outside count as inside.
    /// `radii` of the nodes, if not empty, is kept in step.
    pub fn apply(self, wire: &mut Wire, region: Values, reach: f64, slack: f64, radii: &mut Vec<f64>) -> Trimmed {
        let mut depth = vec![0.0; wire.nodes.len()];
        let pieces = depth.par_chunks_mut(BATCH).zip(wire.nodes.par_chunks(BATCH));
        pieces.for_each(|(d, p)| region(p, d));
        let inside = |n: u32| depth[n as usize] <= slack;
        let at = |s: &[u32; 2]| s.map(|n| wire.nodes[n as usize]);
        let fate = |s: &[u32; 2]| {
            let ends = s.map(inside);
            match self {
                Trim::Cut if ends.contains(&true) => Fate::Stays,
                Trim::Cut if least(region, at(s), reach) <= reach => Fate::Stays,
                Trim::Cut => Fate::Outside,
                Trim::Drop | Trim::Snap if ends == [true; 2] => match leaves(region, at(s), slack) {
                    None => Fate::Stays,
                    Some(_) => Fate::Dropped,
                },
                Trim::Drop => Fate::Dropped,
                Trim::Snap if ends == [false; 2] => Fate::Outside,
                Trim::Snap => {
                    let from = if ends[0] { *s } else { [s[1], s[0]] };
                    // The far end is outside, so it leaves.
                    Fate::Shortened(from, leaves(region, at(&from), slack).unwrap_or(1.0))
                }
            }
        };
        let fates: Vec<Fate> = wire.struts.par_iter().map(fate).collect();
        let mut done = Trimmed::default();
        let mut struts = Vec::with_capacity(wire.struts.len());
        for (s, fate) in wire.struts.iter().zip(fates) {
            match fate {
                Fate::Stays => struts.push(*s),
                Fate::Outside => done.outside += 1,
                Fate::Dropped => done.dropped += 1,
                Fate::Shortened([from, to], t) => {
                    let [a, b] = [from, to].map(|n| wire.nodes[n as usize]);
                    struts.push([from, wire.nodes.len() as u32]);
                    wire.nodes.push(add(a, scale(sub(b, a), t)));
                    if !radii.is_empty() {
                        let [a, b] = [from, to].map(|n| radii[n as usize]);
                        radii.push(a + t * (b - a));
                    }
                    done.snapped += 1;
                }
            }
        }
        wire.struts = struts;
        wire.keep(radii);
        done
    }
}

fn value_at(field: Values, p: Vec3) -> f64 {
    let mut v = [0.0];
    field(&[p], &mut v);
    v[0]
}

/// The least distance along a segment, or some distance not above `enough`.
fn least(region: Values, [a, b]: [Vec3; 2], enough: f64) -> f64 {
    let along = sub(b, a);
    let length = norm(along);
    let (mut t, mut least) = (0.0, f64::INFINITY);
    while t < 1.0 {
        let d = value_at(region, add(a, scale(along, t)));
        least = least.min(d);
        if least <= enough {
            break;
        }
        // Nothing nearer than this within the distance that is missing.
        t += ((d - enough) / length).max(1.0 / STEPS);
    }
    least
}

/// How far along a segment (0 to 1) that begins inside it first leaves the region, by more than `slack`.
fn leaves(region: Values, [a, b]: [Vec3; 2], slack: f64) -> Option<f64> {
    let along = sub(b, a);
    let length = norm(along);
    let value = |t: f64| value_at(region, add(a, scale(along, t)));
    let mut t = 0.0;
    while t < 1.0 {
        let next = (t + (-value(t) / length).max(1.0 / STEPS)).min(1.0);
        if value(next) > slack {
            let (mut low, mut high) = (t, next);
            while high - low > NEAR {
                let middle = 0.5 * (low + high);
                if value(middle) > 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            return Some(low);
        }
        t = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comb() -> Wire {
        let nodes = (-6..=6).map(|i| [f64::from(i), 0.5, 0.0]).collect();
        Wire { nodes, struts: (0..12).map(|i| [i, i + 1]).collect() }
    }

    #[test]
    fn struts_are_cut_dropped_or_end_on_the_surface() {
        let ball: Values = &|p, out| out.iter_mut().zip(p).for_each(|(o, p)| *o = norm(*p) - 3.6);
        let mut cut = comb();
        let done = Trim::Cut.apply(&mut cut, ball, 0.3, 0.0, &mut Vec::new());
        assert_eq!((cut.struts.len(), done.outside), (8, 4));
        let mut dropped = comb();
        let done = Trim::Drop.apply(&mut dropped, ball, 0.3, 0.0, &mut Vec::new());
        assert_eq!((dropped.struts.len(), done.dropped), (6, 6));
        let mut snapped = comb();
        let done = Trim::Snap.apply(&mut snapped, ball, 0.3, 0.0, &mut Vec::new());
        assert_eq!((snapped.struts.len(), done.snapped, done.outside), (8, 2, 4));
        let on = snapped.nodes.iter().filter(|p| (norm(**p) - 3.6).abs() < 1e-9);
        assert_eq!(on.count(), 2);
        assert_eq!(snapped.nodes.len(), 9);
    }
}
