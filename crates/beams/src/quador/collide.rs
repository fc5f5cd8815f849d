//! Beams that run into each other without a hub between them: integrals over hubs count what they share twice.

use rayon::prelude::*;

use crate::graph::place;
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

use super::Quadors;
use super::index::Index;

/// Two beams that have no hub in common and yet meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// The beams.
    pub beams: [u32; 2],
    /// Between both axes, where they are nearest, mm.
    pub at: Vec3,
}

impl Quadors {
    /// Pairs of beams without a common hub whose axes come nearer than both are thick there, hubs included, by the first beam.
    /// Each pair is looked at where the axes are nearest.
    pub fn collisions(&self) -> Vec<Collision> {
        let axis = |b: usize| self.ends[b].map(|h| self.center(h as usize));
        let held: Vec<Aabb> = (0..self.beams())
            .into_par_iter()
            .map(|b| {
                let [p, q] = axis(b);
                Aabb::EMPTY.with(p).with(q).grown(self.thickest(b))
            })
            .collect();
        let index = Index::new(held.iter().copied());
        let first = |a: usize| {
            let mut near: Vec<usize> = Vec::new();
            let meets = |b: &usize| {
                let (p, q) = (&held[a], &held[*b]);
                *b > a && (0..3).all(|k| p.min[k] <= q.max[k] && q.min[k] <= p.max[k])
            };
            index.about(&held[a], &mut |items| {
                near.extend(items.iter().map(|b| *b as usize).filter(meets));
            });
            near.sort_unstable();
            near.dedup();
            near.into_iter()
                .filter(|&b| self.ends[a].iter().all(|h| !self.ends[b].contains(h)))
                .filter_map(|b| {
                    let [s, t] = nearest(axis(a), axis(b));
                    let place = |[p, q]: [Vec3; 2], s: f64| add(p, scale(sub(q, p), s));
                    let (x, y) = (place(axis(a), s), place(axis(b), t));
                    let thick = self.thick(a, s) + self.thick(b, t);
                    (norm(sub(x, y)) < thick * (1.0 - 1e-9))
                        .then_some(Collision { beams: [a as u32, b as u32], at: scale(add(x, y), 0.5) })
                })
                .collect::<Vec<_>>()
        };
        let each: Vec<Vec<Collision>> = (0..self.beams()).into_par_iter().map(first).collect();
        each.into_iter().flatten().collect()
    }

    /// The volume of the whole, mm³, if beams meet in hubs alone.
    ///
    /// # Errors
    /// As for `volume`, and beams that run into each other elsewhere.
    pub fn sole_volume(&self) -> Result<f64, Fault> {
        let found = self.collisions();
        let Some(c) = found.first() else {
            return self.volume();
        };
        Err(Fault::new(
            format!("beams[{}]", c.beams[0]),
            format!(
                "it runs into beam {} at {} without a common node ({} in all), and what they share has no closed form: make them \
                 thinner, or put nodes there",
                c.beams[1],
                place(c.at),
                counted(found.len(), "such pair")
            ),
        ))
    }

    /// The radius of a beam, with the balls at its ends, at a share s of its length.
    fn thick(&self, beam: usize, s: f64) -> f64 {
        let p = &self.pencils[beam];
        let z = s * p.length;
        let [a, b] = self.ends[beam].map(|h| self.balls[h as usize].radius);
        let balls = (a * a - z * z).max(b * b - (p.length - z).powi(2));
        p.squared(z).max(balls).max(0.0).sqrt()
    }

    /// No less than the radius of a beam anywhere.
    fn thickest(&self, beam: usize) -> f64 {
        let stub = |h: u32| {
            let stubs = self.hub(h as usize).stubs;
            stubs.iter().find(|s| s.beam as usize == beam)
        };
        let ends = self.ends[beam];
        let balls = ends.map(|h| self.balls[h as usize].radius);
        let sides = ends.map(|h| stub(h).map_or(0.0, |s| s.thickest()));
        balls[0].max(balls[1]).max(sides[0]).max(sides[1])
    }
}

/// Where two segments are nearest, as shares of their lengths.
fn nearest([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> [f64; 2] {
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
    use crate::graph::{Beam, Graph, Hub, Profile};

    fn lone(ends: &[[Vec3; 2]]) -> Quadors {
        let hubs = ends.iter().flatten().map(|&center| Hub { center, radius: 0.5 });
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
        // Beside each other, and end to end.
        let beside = |y: f64| [[-5.0, y, 0.0], [5.0, y, 0.0]];
        assert_eq!(lone(&[x, beside(0.99)]).collisions().len(), 1);
        assert_eq!(lone(&[x, beside(1.01)]).collisions(), []);
        let on = |x: f64| [[x, 0.0, 0.0], [9.0, 0.0, 0.0]];
        assert_eq!(lone(&[x, on(5.99)]).collisions().len(), 1);
        assert_eq!(lone(&[x, on(6.01)]).collisions(), []);
    }

    /// Cylinders with round ends: nearer than a diameter somewhere, by looking everywhere along them.
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
        // Samples are off by half a step of both, an eighth of a mm at most.
        for a in 0..ends.len() {
            for b in a + 1..ends.len() {
                let told = found.iter().any(|c| c.beams == [a as u32, b as u32]);
                let d = apart(a, b);
                assert!(told || d >= 1.0 - 1e-9, "{a} {b}: {d}");
                assert!(!told || d < 1.0 + 0.125, "{a} {b}: {d}");
            }
        }
        assert!(found.len() > 5, "{}", found.len());
    }
}
