//! A wire frame: nodes and struts without radii, and what is told of one.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use geometry::math::{Vec3, dot, norm, sub, unit};
use geometry::union_find::unite;

/// Nodes, and struts between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wire {
    /// Places of the nodes, mm.
    pub nodes: Vec<Vec3>,
    /// The nodes that each strut joins.
    pub struts: Vec<[u32; 2]>,
}

/// What is told of a wire frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// How many nodes have how many struts, of those inside.
    pub valence: BTreeMap<usize, usize>,
    /// How many struts have an end inside.
    pub struts: usize,
    /// Shortest and longest of them, mm.
    pub length: [f64; 2],
    /// Their length in all, mm.
    pub total: f64,
    /// The least angle between two struts of a node (degrees), and the node's place.
    pub angle: Option<(f64, Vec3)>,
    /// How many pieces hang together.
    pub pieces: usize,
}

/// For each node the struts that end there.
pub(super) struct Stars {
    from: Vec<u32>,
    struts: Vec<u32>,
}

impl Stars {
    /// Of a wire frame.
    pub fn of(wire: &Wire) -> Stars {
        let mut from = vec![0u32; wire.nodes.len() + 1];
        for end in wire.struts.iter().flatten() {
            from[*end as usize + 1] += 1;
        }
        for n in 0..wire.nodes.len() {
            from[n + 1] += from[n];
        }
        let mut next = from.clone();
        let mut struts = vec![0u32; 2 * wire.struts.len()];
        for (s, ends) in wire.struts.iter().enumerate() {
            for end in ends {
                let place = &mut next[*end as usize];
                struts[*place as usize] = s as u32;
                *place += 1;
            }
        }
        Stars { from, struts }
    }

    /// The struts that end in a node.
    pub fn at(&self, node: usize) -> &[u32] {
        &self.struts[self.from[node] as usize..self.from[node + 1] as usize]
    }
}

impl Wire {
    /// Length of a strut, mm.
    pub fn length(&self, strut: [u32; 2]) -> f64 {
        let [a, b] = strut.map(|n| self.nodes[n as usize]);
        norm(sub(b, a))
    }

    /// The frame without nodes that no strut ends in, the rest in the same order; and the new number of each node that
    /// is left.
    fn compact(&mut self) -> Vec<Option<u32>> {
        let mut used = vec![false; self.nodes.len()];
        for end in self.struts.iter().flatten() {
            used[*end as usize] = true;
        }
        let mut count = 0;
        let number = |used: &bool| {
            used.then(|| {
                count += 1;
                count - 1
            })
        };
        let numbers: Vec<Option<u32>> = used.iter().map(number).collect();
        let mut keep = used.iter();
        self.nodes.retain(|_| keep.next() == Some(&true));
        for end in self.struts.iter_mut().flatten() {
            *end = numbers[*end as usize].unwrap_or(0);
        }
        numbers
    }

    /// Leaves out nodes without struts, with their radii.
    pub(super) fn keep(&mut self, radii: &mut Vec<f64>) {
        let numbers = self.compact();
        if !radii.is_empty() {
            let mut kept = numbers.iter();
            radii.retain(|_| kept.next().is_some_and(Option::is_some));
        }
    }

    /// What is told of the part of the frame that is `inside`: its nodes, and the struts that have one of them.
    pub fn facts(&self, inside: &(impl Fn(Vec3) -> bool + Sync)) -> Facts {
        let within: Vec<bool> = self.nodes.par_iter().map(|p| inside(*p)).collect();
        let has = |s: &&[u32; 2]| s.iter().any(|n| within[*n as usize]);
        let part = Wire { nodes: self.nodes.clone(), struts: self.struts.iter().filter(has).copied().collect() };
        let stars = Stars::of(&part);
        let mut facts = Facts {
            struts: part.struts.len(),
            length: [f64::INFINITY, 0.0],
            pieces: part.pieces(),
            ..Facts::default()
        };
        for strut in &part.struts {
            let l = self.length(*strut);
            facts.length = [facts.length[0].min(l), facts.length[1].max(l)];
            facts.total += l;
        }
        let mut steepest = -1.0;
        let mut rays: Vec<Vec3> = Vec::new();
        for (n, place) in self.nodes.iter().enumerate() {
            if !within[n] {
                continue;
            }
            let star = stars.at(n);
            *facts.valence.entry(star.len()).or_default() += 1;
            rays.clear();
            rays.extend(star.iter().map(|s| {
                let [a, b] = part.struts[*s as usize];
                let other = if a as usize == n { b } else { a };
                unit(sub(self.nodes[other as usize], *place))
            }));
            for (i, a) in rays.iter().enumerate() {
                for b in &rays[..i] {
                    let cosine = dot(*a, *b);
                    // Equal angles differ by rounding: the first place is told.
                    if cosine > steepest + 1e-12 {
                        steepest = cosine;
                        // By the chord, as the cosine is flat where angles are small.
                        let half = 0.5 * norm(sub(*a, *b)).min(2.0);
                        facts.angle = Some((2.0 * half.asin().to_degrees(), *place));
                    }
                }
            }
        }
        facts
    }

    /// How many pieces hang together, by struts; nodes without struts are none.
    fn pieces(&self) -> usize {
        let mut root: Vec<u32> = (0..self.nodes.len() as u32).collect();
        let ends: BTreeSet<u32> = self.struts.iter().flatten().copied().collect();
        let mut pieces = ends.len();
        for [a, b] in &self.struts {
            pieces -= usize::from(unite(&mut root, *a, *b));
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_of_a_square_with_a_tail() {
        let wire = Wire {
            nodes: vec![
                [0.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [2.0, 2.0, 0.0],
                [0.0, 2.0, 0.0],
                [0.0, 5.0, 0.0],
                [9.0, 9.0, 9.0],
                [9.0, 9.0, 8.0],
            ],
            struts: vec![[0, 1], [1, 2], [2, 3], [3, 0], [3, 4], [5, 6]],
        };
        let facts = wire.facts(&|_| true);
        assert_eq!(facts.valence, BTreeMap::from([(1, 3), (2, 3), (3, 1)]));
        assert_eq!((facts.length, facts.pieces), ([1.0, 3.0], 2));
        assert!((facts.total - 12.0).abs() < 1e-12);
        assert!(facts.angle.is_some_and(|a| (a.0 - 90.0).abs() < 1e-9));
    }
}
