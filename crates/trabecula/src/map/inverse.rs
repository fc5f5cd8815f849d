//! The inverse of a map, phase to position, by Newton's method.

use std::collections::BTreeMap;

use super::{Mapping, Phase};
use geometry::math::{Aabb, Vec3, add, apply, determinant, inverse, norm, scale, sub};

/// Steps of Newton's method, after which a phase counts as not found.
const STEPS: usize = 40;
/// Tolerance of the phase, turns.
const NEAR: f64 = 1e-11;
/// Samples per wavelength in the search for the cells of a solved map in a box.
const FINE: f64 = 2.0;

/// The cells in ranges of indices along each phase, each with a position (mm) near it: that of its middle, or else the
/// middle of the box. Those whose position is farther than `reach` (mm) from the box are left out.
pub(super) fn listed(map: &impl Mapping, ranges: [[i32; 2]; 3], b: &Aabb, reach: Option<f64>) -> Vec<([i32; 3], Vec3)> {
    let count = |a: usize| ranges[a][0]..=ranges[a][1];
    let mut cells = Vec::new();
    for k in count(2) {
        for j in count(1) {
            for i in count(0) {
                let middle = [i, j, k].map(|c| f64::from(c) + 0.5);
                let near = map.position(middle, b.center()).unwrap_or(b.center());
                if reach.is_none_or(|r| b.distance(near) <= r) {
                    cells.push(([i, j, k], near));
                }
            }
        }
    }
    cells
}

/// The whole number below, within the range of cell indices.
pub(super) fn whole(v: f64) -> i32 {
    v.floor().clamp(-1e9, 1e9) as i32
}

pub(super) fn corners(b: &Aabb) -> [Vec3; 8] {
    core::array::from_fn(|i| core::array::from_fn(|a| if i >> a & 1 == 0 { b.min[a] } else { b.max[a] }))
}

impl Phase {
    /// The position (mm) of the phase u by Newton's method from `near`, no step longer than a wavelength.
    pub(super) fn search(&self, u: Vec3, near: Vec3) -> Option<Vec3> {
        let longest = self.longest();
        let mut x = near;
        let mut at = [[0.0; 3]];
        // Phases jump by whole numbers where they grow round holes; the search follows them without jumps.
        let mut ahead = [0.0; 3];
        for _ in 0..STEPS {
            self.phases(&[x], &mut at);
            at[0] = add(at[0], ahead);
            let miss = sub(u, at[0]);
            if norm(miss) < NEAR {
                return Some(x);
            }
            let j = self.jacobian(x);
            if determinant(&j) <= 0.0 {
                return None;
            }
            let step = apply(&inverse(&j), miss);
            let long = norm(step);
            let next = add(x, scale(step, (longest / long).min(1.0)));
            ahead = self.continued(ahead, x, next);
            x = next;
        }
        None
    }

    /// The cells of a solved map that contain a sample of the box, and their neighbours.
    pub(super) fn searched(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        let step = self.wavelength() / FINE;
        let count = b.size().map(|s| (s / step).ceil().max(1.0) as usize);
        let at = |i: usize, a: usize| b.min[a] + b.size()[a] * i as f64 / count[a] as f64;
        let mut nearest: BTreeMap<[i32; 3], (f64, Vec3)> = BTreeMap::new();
        let mut u = vec![[0.0; 3]; count[0] + 1];
        for k in 0..=count[2] {
            for j in 0..=count[1] {
                let row: Vec<Vec3> = (0..=count[0]).map(|i| [at(i, 0), at(j, 1), at(k, 2)]).collect();
                self.phases(&row, &mut u);
                for (p, u) in row.iter().zip(&u) {
                    let off = norm(u.map(|v| v - v.floor() - 0.5));
                    let best = nearest.entry(u.map(whole)).or_insert((off, *p));
                    if off < best.0 {
                        *best = (off, *p);
                    }
                }
            }
        }
        let own: Vec<([i32; 3], Vec3)> = nearest.iter().map(|(c, s)| (*c, s.1)).collect();
        for (cell, near) in own {
            for n in 0..27 {
                let by = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
                let adjacent = core::array::from_fn(|a| cell[a] + by[a]);
                nearest.entry(adjacent).or_insert((f64::INFINITY, near));
            }
        }
        nearest.into_iter().map(|(c, s)| (c, s.1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grade::{Formula, Grade};
    use crate::map::{Affine, Map, Orientation, PhaseRequest, Round, SolverOptions};
    use std::sync::Arc;

    #[test]
    fn positions_have_the_requested_phases() {
        let bounds = Aabb { min: [-10.0; 3], max: [10.0; 3] };
        let turn = Grade::from(Formula::parse("3*x").expect("formula"));
        let still = Grade::Constant(0.0);
        let wave = Grade::Constant(3.0);
        let wanted = PhaseRequest {
            offset: [0.2, 0.3, -0.1],
            ..PhaseRequest::new([wave.clone(), wave.clone(), wave], Orientation::Angles([still.clone(), still, turn]))
        };
        let phase = Phase::solve(&bounds, &wanted, &SolverOptions::default()).expect("map");
        let round = |sphere: bool| {
            let (c, axis, radii) = ([1.0, 2.0, -1.0], [0.2, 0.3, 1.0], [1.0, 5.0, 9.0]);
            if sphere {
                Round::sphere(c, axis, 2.0, 12.0, radii)
            } else {
                Round::cylinder(c, axis, [2.0, 3.0], 12.0, radii)
            }
            .expect("map")
        };
        let affine = Affine::spartan([2.0, 3.0, 4.0], [10.0, 20.0, 30.0], [0.5; 3]).expect("map");
        let maps: [Map; 4] = [Arc::new(affine), Arc::new(phase), Arc::new(round(false)), Arc::new(round(true))];
        for map in maps {
            let cells = map.cells(&bounds);
            for i in 1..200 {
                let p = [0.8191725, 0.6710436, 0.5497005].map(|s| 18.0 * (s * f64::from(i)).fract() - 9.0);
                let mut u = [[0.0; 3]];
                map.phases(&[p], &mut u);
                let home = map.canonical(u[0].map(whole));
                assert!(cells.iter().any(|c| c.0 == home), "{home:?}");
                let near = add(p, [0.3, -0.2, 0.4]);
                let found = map.position(u[0], near).expect("a position");
                assert!(norm(sub(found, p)) < 1e-7, "{p:?} {found:?}");
            }
        }
    }
}
