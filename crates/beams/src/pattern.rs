//! Patterns: a graph of beams held as a program of repeats, and never written out.
//!
//! A ball at [i, j, k] is Wᵏ Vʲ Uⁱ of the ball that is given, U, V, W similarities, as in the steady lattices of Gupta,
//! Kurzeja, Rossignac and others. What is pulled back by Wᵏ does not depend on k: so a hub, its fillets and its volume are
//! made once for all k but the first and the last. The same holds for j where V commutes with W, and for i where U
//! commutes with both (translations do, and turns and scalings about one axis): then there are as many different hubs as
//! in a pattern of three by three by three, however large it is.

mod laid;

pub use laid::Laid;

use crate::graph::{Beam, Graph, Hub, Profile};
use geometry::fault::{Fault, counted, number};
use geometry::math::{IDENTITY, Mat3, Vec3, add, apply, product, rotation, scale, sub, transpose};

/// x → s R x + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// s, greater than 0.
    pub scale: f64,
    /// R.
    pub turn: Mat3,
    /// t, mm.
    pub shift: Vec3,
}

impl Similarity {
    /// What leaves everything where it is.
    pub const STILL: Similarity = Similarity { scale: 1.0, turn: IDENTITY, shift: [0.0; 3] };

    /// Scaled by s and turned (degrees about x, y, z; z is turned first) about a point, then moved (mm).
    pub fn new(s: f64, rotate: Vec3, about: Vec3, by: Vec3) -> Similarity {
        let turn = rotation(rotate);
        Similarity { scale: s, turn, shift: add(by, sub(about, scale(apply(&turn, about), s))) }
    }

    /// Whether it only moves.
    pub fn moves(&self) -> bool {
        self.turn == IDENTITY && self.scale == 1.0
    }

    /// The image of a point.
    pub fn apply(&self, p: Vec3) -> Vec3 {
        add(scale(apply(&self.turn, p), self.scale), self.shift)
    }

    /// This one after another.
    pub fn after(&self, first: &Similarity) -> Similarity {
        Similarity {
            scale: self.scale * first.scale,
            turn: product(&self.turn, &first.turn),
            shift: self.apply(first.shift),
        }
    }

    /// What undoes it.
    pub fn inverse(&self) -> Similarity {
        let turn = transpose(&self.turn);
        let s = 1.0 / self.scale;
        Similarity { scale: s, turn, shift: scale(apply(&turn, self.shift), -s) }
    }

    /// The identity and its powers up to, not including, `count`.
    pub fn powers(&self, count: usize) -> Vec<Similarity> {
        let next = |p: &Similarity| Some(self.after(p));
        std::iter::successors(Some(Similarity::STILL), next).take(count).collect()
    }

    /// Whether the order of the two does not matter, to within rounding at points `size` (mm) from the origin.
    pub fn commutes(&self, other: &Similarity, size: f64) -> bool {
        let (a, b) = (self.after(other), other.after(self));
        let turn = (0..9).all(|n| (a.turn[n / 3][n % 3] - b.turn[n / 3][n % 3]).abs() < 1e-12);
        let far = size + geometry::math::norm(a.shift);
        turn && (0..3).all(|i| (a.shift[i] - b.shift[i]).abs() < 1e-12 * far)
    }
}

/// A strut of a pattern: from a node at [i, j, k] to one at [i, j, k] + `by`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strut {
    /// The nodes.
    pub ends: [u32; 2],
    /// How many repeats on the second node lies.
    pub by: [i32; 3],
    /// Its profile; lengths in it are those at [0, 0, 0], and scale with the repeats.
    pub profile: Profile,
}

/// A program of repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// The balls that are repeated.
    pub nodes: Vec<Hub>,
    /// The struts that are repeated, wherever both ends exist.
    pub struts: Vec<Strut>,
    /// U, V, W, and how often each is done, the original counted.
    pub steps: [(Similarity, u32); 3],
}

/// Most hubs of which different ones are made.
const MOST: f64 = 1e6;

impl Pattern {
    /// How many hubs and beams it stands for.
    pub fn counts(&self) -> (f64, f64) {
        let all = |by: [i32; 3]| {
            let left = |a: usize| (f64::from(self.steps[a].1) - f64::from(by[a].abs())).max(0.0);
            left(0) * left(1) * left(2)
        };
        let hubs = self.nodes.len() as f64 * all([0; 3]);
        (hubs, self.struts.iter().map(|s| all(s.by)).sum())
    }

    /// Refuses what makes no pattern.
    ///
    /// # Errors
    /// A strut that names a node that is not there, or joins a node with itself; scales or counts of zero.
    pub fn check(&self) -> Result<(), Fault> {
        for (a, (step, count)) in self.steps.iter().enumerate() {
            if !(step.scale > 0.0 && step.scale.is_finite()) || *count == 0 {
                let message = format!("{count} repeats, scaled by {}; both must be greater than 0", number(step.scale));
                return Err(Fault::new(format!("repeat[{a}]"), message));
            }
        }
        for (i, s) in self.struts.iter().enumerate() {
            if let Some(n) = s.ends.iter().find(|n| **n as usize >= self.nodes.len()) {
                let message =
                    format!("there is no node {n}; there are {}, counted from 0", counted(self.nodes.len(), "node"));
                return Err(Fault::new(format!("struts[{i}]"), message));
            }
            if s.ends[0] == s.ends[1] && s.by == [0; 3] {
                return Err(Fault::new(format!("struts[{i}]"), "it joins a node with itself"));
            }
        }
        if self.counts().1 == 0.0 {
            return Err(Fault::new("struts", "no strut has both its ends in the pattern"));
        }
        Ok(())
    }

    /// Where what is at [0, 0, 0] comes to lie at [i, j, k]: Wᵏ Vʲ Uⁱ.
    pub fn at(&self, index: [u32; 3]) -> Similarity {
        let power = |a: usize| {
            let (mut done, mut square, mut n) = (Similarity::STILL, self.steps[a].0, index[a]);
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

    /// A profile `s` times as large.
    fn grown(profile: Profile, s: f64) -> Profile {
        match profile {
            Profile::Mid(r) => Profile::Mid(s * r),
            Profile::Waist(r) => Profile::Waist(s * r),
            Profile::Cone | Profile::Cylinder | Profile::Lambda(_) => profile,
        }
    }

    /// The beams of one node at an index, carried back to [0, 0, 0]: the node comes first, then the others.
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
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(index[a]) + i64::from(sign * s.by[a]));
                if (0..3).any(|a| other[a] < 0 || other[a] >= i64::from(self.steps[a].1)) {
                    continue;
                }
                let other = other.map(|v| v as u32);
                // A beam is as large as its first end is.
                let first = if end == 0 { index } else { other };
                let mut ends = [0, star.hubs.len() as u32];
                if end == 1 {
                    ends.reverse();
                }
                star.hubs.push(ball(s.ends[1 - end], other));
                star.beams.push(Beam { ends, profile: Pattern::grown(s.profile, home.scale * self.at(first).scale) });
            }
        }
        star
    }

    /// The whole graph, written out: for comparison, and for patterns that are small.
    ///
    /// # Errors
    /// More hubs or beams than are made.
    pub fn expanded(&self) -> Result<Graph, Fault> {
        let (hubs, beams) = self.counts();
        if hubs.max(beams) > crate::graph::MOST {
            let message = format!("{hubs} hubs and {beams} beams are too many to be written out");
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
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(index[a]) + i64::from(s.by[a]));
                if (0..3).all(|a| (0..i64::from(self.steps[a].1)).contains(&other[a])) {
                    graph.beams.push(Beam {
                        ends: [number(s.ends[0], index), number(s.ends[1], other.map(|v| v as u32))],
                        profile: Pattern::grown(s.profile, self.at(index).scale),
                    });
                }
            }
        }
        Ok(graph)
    }
}
