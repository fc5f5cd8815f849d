//! Patterns: a graph of beams stored as repeated similarity transforms, never expanded.
//!
//! The hub at index [i, j, k] is Wᵏ Vʲ Uⁱ of a given hub, with similarities U, V, W (the steady lattices of Gupta,
//! Kurzeja, Rossignac and others). Transformed back by W⁻ᵏ a hub does not depend on k, so its half-beams, fillets and
//! volume are computed once for all k except those near the ends. The same holds for j where V commutes with W, and for
//! i where U commutes with both (translations commute, and rotations and scalings about one axis). Then a pattern of
//! any size has as many distinct hubs as one of 3 × 3 × 3 repeats.

mod pattern_field;

pub use pattern_field::PatternField;

use crate::graph::{Beam, Graph, HubBall, Profile};
use geometry::fault::{Fault, counted, number};
use geometry::similarity::Similarity;

/// A strut of a pattern: from a node at index [i, j, k] to a node at [i, j, k] + `by`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strut {
    /// Node indices.
    pub ends: [u32; 2],
    /// Index offset of the second node.
    pub offset: [i32; 3],
    /// Its profile; lengths are those at index [0, 0, 0] and scale with the repeats.
    pub profile: Profile,
}

/// Nodes and struts repeated by up to three similarity transforms.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// The hubs that are repeated.
    pub nodes: Vec<HubBall>,
    /// The struts that are repeated, wherever both ends exist.
    pub struts: Vec<Strut>,
    /// U, V, W, and their repeat counts, the original included.
    pub steps: [(Similarity, u32); 3],
}

/// Maximum number of distinct hubs.
const MAX_DISTINCT_HUBS: f64 = 1e6;

impl Pattern {
    /// Number of hubs and beams represented.
    pub fn counts(&self) -> (f64, f64) {
        let all = |offset: [i32; 3]| {
            let left = |a: usize| (f64::from(self.steps[a].1) - f64::from(offset[a].abs())).max(0.0);
            left(0) * left(1) * left(2)
        };
        let hubs = self.nodes.len() as f64 * all([0; 3]);
        (hubs, self.struts.iter().map(|s| all(s.offset)).sum())
    }

    /// Checks the pattern.
    ///
    /// # Errors
    /// A strut that names an unknown node or joins a node with itself; a scale or repeat count of zero; repeats that
    /// coincide.
    pub fn check(&self) -> Result<(), Fault> {
        let size = self.nodes.iter().map(|h| geometry::math::norm(h.center)).fold(0.0, f64::max);
        for (a, (step, count)) in self.steps.iter().enumerate() {
            if !(step.scale() > 0.0 && step.scale().is_finite()) || *count == 0 {
                let message =
                    format!("repeat count and scale must be positive, found {count} and {}", number(step.scale()));
                return Err(Fault::new(format!("repeat[{a}]"), message));
            }
            if let Some(period) = step.period(*count, size) {
                let steps = match period {
                    1 => "steps that move nothing coincide".into(),
                    n => format!("steps of {} degrees coincide after {n}", number(step.angle())),
                };
                let message = format!("{steps}: count must be at most {period}, found {count}");
                return Err(Fault::new(format!("repeat[{a}].count"), message).found(count.to_string()));
            }
        }
        for (i, s) in self.struts.iter().enumerate() {
            if let Some(n) = s.ends.iter().find(|n| **n as usize >= self.nodes.len()) {
                let message =
                    format!("unknown node {n}: the pattern has {}, numbered from 0", counted(self.nodes.len(), "node"));
                return Err(Fault::new(format!("struts[{i}]"), message));
            }
            if s.ends[0] == s.ends[1] && s.offset == [0; 3] {
                return Err(Fault::new(format!("struts[{i}]"), "the strut joins a node with itself"));
            }
        }
        if self.counts().1 == 0.0 {
            return Err(Fault::new("struts", "no strut has both ends in the pattern"));
        }
        Ok(())
    }

    /// The similarity that carries index [0, 0, 0] to [i, j, k]: Wᵏ Vʲ Uⁱ.
    pub fn at(&self, index: [u32; 3]) -> Similarity {
        let power = |a: usize| {
            let (mut done, mut square, mut n) = (Similarity::IDENTITY, self.steps[a].0, index[a]);
            while n > 0 {
                if n % 2 == 1 {
                    done = square.after(&done);
                }
                square = square.after(&square);
                n /= 2;
            }
            done
        };
        power(2).after(&power(1).after(&power(0)))
    }

    /// A profile scaled by `s`.
    fn scaled_profile(profile: Profile, s: f64) -> Profile {
        match profile {
            Profile::Mid(r) => Profile::Mid(s * r),
            Profile::Waist(r) => Profile::Waist(s * r),
            Profile::Cone | Profile::Cylinder | Profile::Lambda(_) => profile,
        }
    }

    /// The beams at one node at an index, carried back to [0, 0, 0]; this node is the first hub.
    fn star(&self, node: u32, index: [u32; 3]) -> Graph {
        let home = self.at(index).inverse();
        let ball = |n: u32, index: [u32; 3]| {
            let (at, h) = (home.after(&self.at(index)), self.nodes[n as usize]);
            HubBall { center: at.point(h.center), radius: at.scale() * h.radius }
        };
        let mut star = Graph { hubs: vec![ball(node, index)], beams: Vec::new() };
        for s in &self.struts {
            for (end, sign) in [(0, 1), (1, -1)] {
                if s.ends[end] != node {
                    continue;
                }
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(index[a]) + i64::from(sign * s.offset[a]));
                if (0..3).any(|a| other[a] < 0 || other[a] >= i64::from(self.steps[a].1)) {
                    continue;
                }
                let other = other.map(|v| v as u32);
                // A beam has the scale of its first end.
                let first = if end == 0 { index } else { other };
                let mut ends = [0, star.hubs.len() as u32];
                if end == 1 {
                    ends.reverse();
                }
                star.hubs.push(ball(s.ends[1 - end], other));
                star.beams.push(Beam {
                    ends,
                    profile: Pattern::scaled_profile(s.profile, home.scale() * self.at(first).scale()),
                });
            }
        }
        star
    }

    /// The whole graph, expanded: for small patterns and comparison.
    ///
    /// # Errors
    /// More hubs or beams than the maximum.
    pub fn expanded(&self) -> Result<Graph, Fault> {
        let (hubs, beams) = self.counts();
        if hubs.max(beams) > crate::graph::MAX_STRUTS {
            let message = format!(
                "the pattern has {hubs} hubs and {beams} beams; at most {} of each can be expanded",
                number(crate::graph::MAX_STRUTS)
            );
            return Err(Fault::new("", message));
        }
        let [u, v, w] = [0, 1, 2].map(|a| self.steps[a].1);
        let number = |n: u32, [i, j, k]: [u32; 3]| ((k * v + j) * u + i) * self.nodes.len() as u32 + n;
        let mut graph = Graph::default();
        let indices = || (0..w).flat_map(move |k| (0..v).flat_map(move |j| (0..u).map(move |i| [i, j, k])));
        for index in indices() {
            let at = self.at(index);
            graph.hubs.extend(
                self.nodes.iter().map(|h| HubBall { center: at.point(h.center), radius: at.scale() * h.radius }),
            );
        }
        for index in indices() {
            for s in &self.struts {
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(index[a]) + i64::from(s.offset[a]));
                if (0..3).all(|a| (0..i64::from(self.steps[a].1)).contains(&other[a])) {
                    graph.beams.push(Beam {
                        ends: [number(s.ends[0], index), number(s.ends[1], other.map(|v| v as u32))],
                        profile: Pattern::scaled_profile(s.profile, self.at(index).scale()),
                    });
                }
            }
        }
        Ok(graph)
    }
}
