//! Patterns: a graph of beams stored as repeated similarity transforms, never expanded.
//!
//! The hub at index [i, j, k] is Wᵏ Vʲ Uⁱ of a given hub, with similarities U, V, W (the steady lattices of Gupta,
//! Kurzeja, Rossignac and others). Transformed back by W⁻ᵏ a hub does not depend on k, so its half-beams, fillets and
//! volume are computed once for all k except those near the ends. The same holds for j where V commutes with W, and for
//! i where U commutes with both (translations commute, and rotations and scalings about one axis). Then a pattern of
//! any size has as many distinct hubs as one of 3 × 3 × 3 repeats.

mod pattern_field;

pub use pattern_field::PatternField;

use crate::graph::{Beam, Graph, Hub, Profile};
use geometry::fault::{Fault, counted, number};
use geometry::math::{IDENTITY, Mat3, Vec3, add, apply, product, rotation, scale, sub, transpose};

/// A similarity x → s R x + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// s, positive.
    pub scale: f64,
    /// R, a rotation.
    pub rotation: Mat3,
    /// t, mm.
    pub shift: Vec3,
}

impl Similarity {
    /// The identity.
    pub const IDENTITY: Similarity = Similarity { scale: 1.0, rotation: IDENTITY, shift: [0.0; 3] };

    /// Scaling by s and rotation (degrees about x, y, z; z first) about a fixed point, then translation (mm).
    pub fn new(s: f64, rotate: Vec3, about: Vec3, by: Vec3) -> Similarity {
        let rotation = rotation(rotate);
        Similarity { scale: s, rotation, shift: add(by, sub(about, scale(apply(&rotation, about), s))) }
    }

    /// Whether it is a translation.
    pub fn is_translation(&self) -> bool {
        self.rotation == IDENTITY && self.scale == 1.0
    }

    /// The image of a point.
    pub fn apply(&self, p: Vec3) -> Vec3 {
        add(scale(apply(&self.rotation, p), self.scale), self.shift)
    }

    /// The composition: this after `first`.
    pub fn after(&self, first: &Similarity) -> Similarity {
        Similarity {
            scale: self.scale * first.scale,
            rotation: product(&self.rotation, &first.rotation),
            shift: self.apply(first.shift),
        }
    }

    /// The inverse.
    pub fn inverse(&self) -> Similarity {
        let rotation = transpose(&self.rotation);
        let s = 1.0 / self.scale;
        Similarity { scale: s, rotation, shift: scale(apply(&rotation, self.shift), -s) }
    }

    /// The powers 0 to `count` − 1.
    pub fn powers(&self, count: usize) -> Vec<Similarity> {
        let next = |p: &Similarity| Some(self.after(p));
        std::iter::successors(Some(Similarity::IDENTITY), next).take(count).collect()
    }

    /// Angle of the rotation, degrees.
    pub fn angle(&self) -> f64 {
        let r = &self.rotation;
        let sine = geometry::math::norm([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]);
        sine.atan2(r[0][0] + r[1][1] + r[2][2] - 1.0).to_degrees()
    }

    /// The first power below `count` that is the identity, within rounding at points up to `size` (mm) from the origin.
    pub fn period(&self, count: u32, size: f64) -> Option<u32> {
        if self.scale != 1.0 || self.is_translation() && self.shift != [0.0; 3] {
            return None;
        }
        let far = size + geometry::math::norm(self.shift);
        let mut power = *self;
        (1..count.min(LONGEST_PERIOD)).find(|n| {
            let off = 1e-12 + 1e-15 * f64::from(*n);
            let turned = (0..9).any(|i| (power.rotation[i / 3][i % 3] - IDENTITY[i / 3][i % 3]).abs() > off);
            let same = !turned && power.shift.iter().all(|t| t.abs() <= off * far);
            power = self.after(&power);
            same
        })
    }

    /// Whether the two commute, within rounding at points up to `size` (mm) from the origin.
    pub fn commutes(&self, other: &Similarity, size: f64) -> bool {
        let (a, b) = (self.after(other), other.after(self));
        let rotation = (0..9).all(|n| (a.rotation[n / 3][n % 3] - b.rotation[n / 3][n % 3]).abs() < 1e-12);
        let far = size + geometry::math::norm(a.shift);
        rotation && (0..3).all(|i| (a.shift[i] - b.shift[i]).abs() < 1e-12 * far)
    }
}

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
    pub nodes: Vec<Hub>,
    /// The struts that are repeated, wherever both ends exist.
    pub struts: Vec<Strut>,
    /// U, V, W, and their repeat counts, the original included.
    pub steps: [(Similarity, u32); 3],
}

/// Most repeats among which a step is searched for one that comes back to where it began.
const LONGEST_PERIOD: u32 = 100_000;

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
            if !(step.scale > 0.0 && step.scale.is_finite()) || *count == 0 {
                let message =
                    format!("repeat count and scale must be positive, found {count} and {}", number(step.scale));
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
            Hub { center: at.apply(h.center), radius: at.scale * h.radius }
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
                    profile: Pattern::scaled_profile(s.profile, home.scale * self.at(first).scale),
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
            graph
                .hubs
                .extend(self.nodes.iter().map(|h| Hub { center: at.apply(h.center), radius: at.scale * h.radius }));
        }
        for index in indices() {
            for s in &self.struts {
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(index[a]) + i64::from(s.offset[a]));
                if (0..3).all(|a| (0..i64::from(self.steps[a].1)).contains(&other[a])) {
                    graph.beams.push(Beam {
                        ends: [number(s.ends[0], index), number(s.ends[1], other.map(|v| v as u32))],
                        profile: Pattern::scaled_profile(s.profile, self.at(index).scale),
                    });
                }
            }
        }
        Ok(graph)
    }
}
