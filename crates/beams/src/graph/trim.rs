//! Trimming of a wireframe to a region.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::wireframe::{GivenRadii, Wireframe};
use crate::Values;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Treatment of struts that leave the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trim {
    /// They stay; the region's surface cuts their solid.
    #[default]
    Cut,
    /// They are removed.
    Drop,
    /// They are shortened to end on the surface.
    Snap,
}

/// Struts that leave the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(rename = "TrimmedReport")]
pub struct Trimmed {
    /// Struts without a part in the region.
    pub outside: usize,
    /// Struts left out.
    pub dropped: usize,
    /// Struts shortened to the surface.
    pub snapped: usize,
}

/// Result for one strut.
enum Outcome {
    Kept,
    Outside,
    Dropped,
    /// From the inside node, this fraction of the length remains.
    Shortened([u32; 2], f64),
}

/// Nodes evaluated per batch.
const BATCH: usize = 1024;
/// Minimum number of steps along a strut: narrower concavities of the region are missed.
const MIN_STEPS: f64 = 256.0;
/// Tolerance of a surface crossing, as a fraction of the strut's length.
const TOLERANCE: f64 = 1e-10;

impl Trim {
    /// Trims a wireframe to a region given by its signed distance (Lipschitz bound 1). Struts within `reach` (mm, the
    /// largest hub radius) of the region are not outside. Ends up to `slack` (mm) outside count as inside. `radii` stay
    /// in the order of nodes and struts.
    pub fn apply(
        self,
        wireframe: &mut Wireframe,
        region: Values,
        reach: f64,
        slack: f64,
        radii: &mut GivenRadii,
    ) -> Trimmed {
        let mut depth = vec![0.0; wireframe.nodes.len()];
        let pieces = depth.par_chunks_mut(BATCH).zip(wireframe.nodes.par_chunks(BATCH));
        pieces.for_each(|(d, p)| region(p, d));
        let inside = |n: u32| depth[n as usize] <= slack;
        let at = |s: &[u32; 2]| s.map(|n| wireframe.nodes[n as usize]);
        let outcome = |s: &[u32; 2]| {
            let ends = s.map(inside);
            match self {
                Trim::Cut if ends.contains(&true) => Outcome::Kept,
                Trim::Cut if min_distance(region, at(s), reach) <= reach => Outcome::Kept,
                Trim::Cut => Outcome::Outside,
                Trim::Drop | Trim::Snap if ends == [true; 2] => match exit_parameter(region, at(s), slack) {
                    None => Outcome::Kept,
                    Some(_) => Outcome::Dropped,
                },
                Trim::Drop => Outcome::Dropped,
                Trim::Snap if ends == [false; 2] => Outcome::Outside,
                Trim::Snap => {
                    let from = if ends[0] { *s } else { [s[1], s[0]] };
                    // The far end is outside, so a crossing exists.
                    let left = exit_parameter(region, at(&from), slack).unwrap_or(1.0);
                    let [p, q] = at(&from);
                    // One that begins on the surface has nothing inside.
                    if left * norm(sub(q, p)) <= slack { Outcome::Outside } else { Outcome::Shortened(from, left) }
                }
            }
        };
        let outcomes: Vec<Outcome> = wireframe.struts.par_iter().map(outcome).collect();
        let mut done = Trimmed::default();
        let mut struts = Vec::with_capacity(wireframe.struts.len());
        let own = std::mem::take(&mut radii.struts);
        for (i, (s, outcome)) in wireframe.struts.iter().zip(outcomes).enumerate() {
            match outcome {
                Outcome::Kept => {
                    struts.push(*s);
                    radii.struts.extend(own.get(i));
                }
                Outcome::Outside => done.outside += 1,
                Outcome::Dropped => done.dropped += 1,
                Outcome::Shortened([from, to], t) => {
                    let [a, b] = [from, to].map(|n| wireframe.nodes[n as usize]);
                    struts.push([from, wireframe.nodes.len() as u32]);
                    wireframe.nodes.push(add(a, scale(sub(b, a), t)));
                    if !radii.nodes.is_empty() {
                        let [a, b] = [from, to].map(|n| radii.nodes[n as usize]);
                        radii.nodes.push(a + t * (b - a));
                    }
                    if let Some([r1, r2]) = own.get(i) {
                        let [a, b] = if from == s[0] { [*r1, *r2] } else { [*r2, *r1] };
                        radii.struts.push([a, a + t * (b - a)]);
                    }
                    done.snapped += 1;
                }
            }
        }
        wireframe.struts = struts;
        wireframe.drop_isolated(radii);
        done
    }
}

fn value_at(field: Values, p: Vec3) -> f64 {
    let mut v = [0.0];
    field(&[p], &mut v);
    v[0]
}

/// The minimum distance along a segment, or some distance not above `enough`.
fn min_distance(region: Values, [a, b]: [Vec3; 2], enough: f64) -> f64 {
    let along = sub(b, a);
    let length = norm(along);
    let (mut t, mut min_distance) = (0.0, f64::INFINITY);
    while t < 1.0 {
        let d = value_at(region, add(a, scale(along, t)));
        min_distance = min_distance.min(d);
        if min_distance <= enough {
            break;
        }
        // By the Lipschitz bound no point before this step is within `enough`.
        t += ((d - enough) / length).max(1.0 / MIN_STEPS);
    }
    min_distance.min(value_at(region, b))
}

/// Parameter (0 to 1) at which a segment that begins inside first leaves the region by more than `slack`.
fn exit_parameter(region: Values, [a, b]: [Vec3; 2], slack: f64) -> Option<f64> {
    let along = sub(b, a);
    let length = norm(along);
    let value = |t: f64| value_at(region, add(a, scale(along, t)));
    let mut t = 0.0;
    while t < 1.0 {
        let next = (t + (-value(t) / length).max(1.0 / MIN_STEPS)).min(1.0);
        if value(next) > slack {
            let (mut low, mut high) = (t, next);
            while high - low > TOLERANCE {
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

    fn comb() -> Wireframe {
        let nodes = (-6..=6).map(|i| [f64::from(i), 0.5, 0.0]).collect();
        Wireframe { nodes, struts: (0..12).map(|i| [i, i + 1]).collect() }
    }

    #[test]
    fn struts_are_cut_dropped_or_end_on_the_surface() {
        let ball: Values = &|p, out| out.iter_mut().zip(p).for_each(|(o, p)| *o = norm(*p) - 3.6);
        let mut cut = comb();
        let done = Trim::Cut.apply(&mut cut, ball, 0.3, 0.0, &mut GivenRadii::default());
        assert_eq!((cut.struts.len(), done.outside), (8, 4));
        // Of one whose end alone is near, whichever it is.
        let tip: Values = &|p, out| out.iter_mut().zip(p).for_each(|(o, p)| *o = norm(sub(*p, [0.0, 3.0, 0.0])) - 1.0);
        for struts in [vec![[0, 1]], vec![[1, 0]]] {
            let mut tall = Wireframe { nodes: vec![[0.0, -7.0, 0.0], [0.0, 1.71, 0.0]], struts };
            let done = Trim::Cut.apply(&mut tall, tip, 0.3, 0.0, &mut GivenRadii::default());
            assert_eq!((tall.struts.len(), done.outside), (1, 0));
        }
        let mut dropped = comb();
        let done = Trim::Drop.apply(&mut dropped, ball, 0.3, 0.0, &mut GivenRadii::default());
        assert_eq!((dropped.struts.len(), done.dropped), (6, 6));
        let mut snapped = comb();
        let done = Trim::Snap.apply(&mut snapped, ball, 0.3, 0.0, &mut GivenRadii::default());
        assert_eq!((snapped.struts.len(), done.snapped, done.outside), (8, 2, 4));
        let on = snapped.nodes.iter().filter(|p| (norm(**p) - 3.6).abs() < 1e-9);
        assert_eq!(on.count(), 2);
        assert_eq!(snapped.nodes.len(), 9);
    }
}
