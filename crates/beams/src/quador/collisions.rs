//! Beams that intersect without a common hub: integrals over hubs would count their common part twice.

use rayon::prelude::*;

use crate::graph::position_text;
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

use super::Quadors;
use super::box_index::BoxIndex;

/// Two beams without a common hub that intersect or touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Indices of the beams.
    pub beams: [u32; 2],
    /// Midpoint of the shortest segment between both axes, mm.
    pub at: Vec3,
}

impl Quadors {
    /// Pairs of beams without a common hub whose axes come as close as the sum of their radii there, hubs included;
    /// sorted by the first beam. Each pair is tested where the axes are closest.
    pub fn collisions(&self) -> Vec<Collision> {
        self.near_misses(0.0)
    }

    /// As `collisions`, and pairs that are at most a distance (mm) apart.
    pub(super) fn near_misses(&self, apart: f64) -> Vec<Collision> {
        let axis = |b: usize| self.ends[b].map(|h| self.center(h as usize));
        let bounds: Vec<Aabb> = (0..self.beams())
            .into_par_iter()
            .map(|b| {
                let [p, q] = axis(b);
                Aabb::EMPTY.with(p).with(q).grown(self.max_radius(b) + 0.5 * apart)
            })
            .collect();
        let index = BoxIndex::new(bounds.iter().copied());
        let first = |a: usize| {
            let mut near: Vec<usize> = Vec::new();
            let meets = |b: &usize| {
                let (p, q) = (&bounds[a], &bounds[*b]);
                *b > a && (0..3).all(|k| p.min[k] <= q.max[k] && q.min[k] <= p.max[k])
            };
            index.about(&bounds[a], &mut |items| {
                near.extend(items.iter().map(|b| *b as usize).filter(meets));
            });
            near.sort_unstable();
            near.dedup();
            near.into_iter()
                .filter(|&b| self.ends[a].iter().all(|h| !self.ends[b].contains(h)))
                .filter_map(|b| {
                    let [s, t] = closest_parameters(axis(a), axis(b));
                    let position_text = |[p, q]: [Vec3; 2], s: f64| add(p, scale(sub(q, p), s));
                    let (x, y) = (position_text(axis(a), s), position_text(axis(b), t));
                    let radius_at = self.radius_at(a, s) + self.radius_at(b, t);
                    (norm(sub(x, y)) <= radius_at * (1.0 + 1e-9) + apart)
                        .then_some(Collision { beams: [a as u32, b as u32], at: scale(add(x, y), 0.5) })
                })
                .collect::<Vec<_>>()
        };
        let each: Vec<Vec<Collision>> = (0..self.beams()).into_par_iter().map(first).collect();
        each.into_iter().flatten().collect()
    }

    /// The volume of the whole (mm³), if beams meet in hubs alone.
    ///
    /// # Errors
    /// As for `volume`, and beams that intersect without a common hub.
    pub fn checked_volume(&self) -> Result<f64, Fault> {
        let found = self.collisions();
        let Some(c) = found.first() else {
            return self.volume();
        };
        Err(Fault::new(
            format!("beams[{}]", c.beams[0]),
            format!(
                "intersects beam {} at {} without a common node ({} in all): the common part has no closed form; make the beams \
                 thinner, or add nodes there",
                c.beams[1],
                position_text(c.at),
                counted(found.len(), "such pair")
            ),
        ))
    }

    /// The radius of a beam, with the balls at its ends, at the fraction s of its length, mm.
    fn radius_at(&self, beam: usize, s: f64) -> f64 {
        let p = &self.pencils[beam];
        let z = s * p.length;
        let [a, b] = self.ends[beam].map(|h| self.balls[h as usize].radius);
        let balls = (a * a - z * z).max(b * b - (p.length - z).powi(2));
        p.radius_squared(z).max(balls).max(0.0).sqrt()
    }

    /// Upper bound of the radius of a beam, mm.
    fn max_radius(&self, beam: usize) -> f64 {
        let half_beam = |h: u32| {
            let half_beams = self.hub(h as usize).half_beams;
            half_beams.iter().find(|s| s.beam as usize == beam)
        };
        let ends = self.ends[beam];
        let balls = ends.map(|h| self.balls[h as usize].radius);
        let sides = ends.map(|h| half_beam(h).map_or(0.0, |s| s.max_radius()));
        balls[0].max(balls[1]).max(sides[0]).max(sides[1])
    }
}

/// The closest points of two segments, as fractions of their lengths.
fn closest_parameters([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> [f64; 2] {
    let (u, v, w) = (sub(b, a), sub(d, c), sub(a, c));
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    let (uw, vw) = (dot(u, w), dot(v, w));
    let cross = uu * vv - uv * uv;
    let s = if cross > 1e-12 * uu * vv { ((uv * vw - vv * uw) / cross).clamp(0.0, 1.0) } else { 0.0 };
    let t = ((uv * s + vw) / vv).clamp(0.0, 1.0);
    [((uv * t - uw) / uu).clamp(0.0, 1.0), t]
}

#[cfg(test)]
mod tests {
    use super::super::Fillet;
    use super::super::tests::Random;
    use super::*;
    use crate::graph::{Beam, Graph, HubBall, Profile};

    fn lone(ends: &[[Vec3; 2]]) -> Quadors {
        let hubs = ends.iter().flatten().map(|&center| HubBall { center, radius: 0.5 });
        let beams = (0..ends.len() as u32).map(|i| Beam { ends: [2 * i, 2 * i + 1], profile: Profile::Cone });
        let graph = Graph { hubs: hubs.collect(), beams: beams.collect() };
        Quadors::new(&graph, Fillet::None).expect("beams")
    }

    #[test]
    fn beams_that_cross_without_a_hub_are_found() {
        let x = [[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
        let over = |z: f64| [[0.0, -5.0, z], [0.0, 5.0, z]];
        assert_eq!(lone(&[x, over(1.01)]).collisions(), []);
        let found = lone(&[x, over(0.9)]).collisions();
        let at = [0.0, 0.0, 0.45];
        let want = Collision { beams: [0, 1], at };
        assert_eq!(found, [want]);
        assert_eq!(lone(&[x, over(1.0)]).collisions().len(), 1, "they touch");
        assert_eq!(lone(&[x, over(1.0 + 1e-6)]).collisions(), []);
        // Parallel, and end to end.
        let beside = |y: f64| [[-5.0, y, 0.0], [5.0, y, 0.0]];
        assert_eq!(lone(&[x, beside(0.99)]).collisions().len(), 1);
        assert_eq!(lone(&[x, beside(1.01)]).collisions(), []);
        let on = |x: f64| [[x, 0.0, 0.0], [9.0, 0.0, 0.0]];
        assert_eq!(lone(&[x, on(5.99)]).collisions().len(), 1);
        assert_eq!(lone(&[x, on(6.01)]).collisions(), []);
    }

    /// Cylinders with round ends: compared with the minimum distance by dense sampling.
    #[test]
    fn all_pairs_of_a_heap_are_found_and_no_other() {
        let mut random = Random(8);
        let ends: Vec<[Vec3; 2]> = (0..120)
            .map(|_| {
                let p = [0; 3].map(|_| 30.0 * random.next());
                [p, add(p, scale(random.direction(), 2.0 + 6.0 * random.next()))]
            })
            .collect();
        let found = lone(&ends).collisions();
        let apart = |a: usize, b: usize| {
            let along = |[p, q]: [Vec3; 2], k: i32| add(p, scale(sub(q, p), f64::from(k) / 64.0));
            (0..=64 * 65 + 64)
                .map(|n| norm(sub(along(ends[a], n % 65), along(ends[b], n / 65))))
                .fold(f64::INFINITY, f64::min)
        };
        // Sampling is off by at most half a step of both, an eighth of a mm.
        for a in 0..ends.len() {
            for b in a + 1..ends.len() {
                let listed = found.iter().any(|c| c.beams == [a as u32, b as u32]);
                let d = apart(a, b);
                assert!(listed || d >= 1.0 - 1e-9, "{a} {b}: {d}");
                assert!(!listed || d < 1.0 + 0.125, "{a} {b}: {d}");
            }
        }
        assert!(found.len() > 5, "{}", found.len());
    }
}
