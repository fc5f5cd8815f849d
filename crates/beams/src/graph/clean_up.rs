//! Clean-up of a wireframe: coincident nodes are merged; zero-length, duplicate and isolated parts are removed and
//! counted.

use std::collections::HashSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::wireframe::{GivenRadii, Incidence, Wireframe};
use geometry::math::{Vec3, norm, sub};
use geometry::union_find::{find, singles, unite};
use geometry::weld::PointHash;

/// Nodes and struts left out before beams are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(rename = "CleanedReport")]
pub struct Cleaned {
    /// Nodes merged into another at the same position.
    pub merged: usize,
    /// Struts of zero length.
    pub zero_length: usize,
    /// Struts that join the same nodes as another.
    pub duplicates: usize,
    /// Nodes without a strut.
    pub isolated: usize,
    /// Struts with a free end.
    pub dangling: usize,
}

impl Wireframe {
    /// Merges nodes at most `within` (mm) apart, each into the lowest-numbered node near it, and removes zero-length
    /// struts, duplicate struts and isolated nodes. `radii` are reduced with the nodes and struts.
    pub fn clean(&mut self, within: f64, radii: &mut GivenRadii) -> Cleaned {
        let mut counts = Cleaned::default();
        let root = self.merged(within);
        counts.merged = (root.iter().enumerate()).filter(|(n, r)| *n != **r as usize).count();
        let mut joined = HashSet::with_capacity(self.struts.len());
        let mut kept = Vec::with_capacity(self.struts.len());
        for strut in &mut self.struts {
            *strut = strut.map(|n| root[n as usize]);
            let [a, b] = *strut;
            let new = a != b && joined.insert([a.min(b), a.max(b)]);
            counts.zero_length += usize::from(a == b);
            counts.duplicates += usize::from(a != b && !new);
            kept.push(new);
        }
        self.keep(&kept, radii);
        let before = self.nodes.len();
        self.drop_isolated(radii);
        counts.isolated = before - counts.merged - self.nodes.len();
        counts
    }

    /// Removes struts that have an end of valence 1, repeatedly, until none is left; nodes for which `held` holds are
    /// not free ends. Returns the number removed.
    pub fn drop_dangling(&mut self, held: &impl Fn(Vec3) -> bool, radii: &mut GivenRadii) -> usize {
        let incidence = Incidence::of(self);
        let mut valence: Vec<usize> = (0..self.nodes.len()).map(|n| incidence.at(n).len()).collect();
        let mut gone = vec![false; self.struts.len()];
        let free = |n: usize, valence: &[usize]| valence[n] == 1 && !held(self.nodes[n]);
        let mut open: Vec<usize> = (0..self.nodes.len()).filter(|n| free(*n, &valence)).collect();
        while let Some(n) = open.pop() {
            let Some(s) = incidence.at(n).iter().find(|s| !gone[**s as usize]) else {
                continue;
            };
            gone[*s as usize] = true;
            for end in self.struts[*s as usize].map(|e| e as usize) {
                valence[end] -= 1;
                if free(end, &valence) {
                    open.push(end);
                }
            }
        }
        let kept: Vec<bool> = gone.iter().map(|g| !g).collect();
        self.keep(&kept, radii);
        self.drop_isolated(radii);
        gone.iter().filter(|g| **g).count()
    }

    /// Keeps some of the struts with their radii.
    fn keep(&mut self, kept: &[bool], radii: &mut GivenRadii) {
        let mut left = kept.iter();
        self.struts.retain(|_| left.next() == Some(&true));
        let mut left = kept.iter();
        radii.struts.retain(|_| left.next() == Some(&true));
    }

    /// Number of nodes of valence 1, `held` nodes excepted.
    pub fn dangling(&self, held: &impl Fn(Vec3) -> bool) -> usize {
        let incidence = Incidence::of(self);
        let nodes = self.nodes.iter().enumerate();
        nodes.filter(|(n, p)| incidence.at(*n).len() == 1 && !held(**p)).count()
    }

    /// For each node the lowest-numbered node that it is merged into.
    fn merged(&self, within: f64) -> Vec<u32> {
        let mut root = singles(self.nodes.len());
        let mut earlier = PointHash::new(within);
        for (n, p) in (0..).zip(&self.nodes) {
            earlier.near(*p, |other| {
                if norm(sub(self.nodes[other as usize], *p)) <= within {
                    unite(&mut root, n, other);
                }
            });
            earlier.insert(*p, n);
        }
        (0..root.len() as u32).map(|n| find(&mut root, n)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_twice_goes_and_is_told() {
        let mut wireframe = Wireframe {
            nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [0.0, 1.0, 0.0], [5.0; 3], [-1e-9, 0.0, 0.0]],
            struts: vec![[0, 1], [2, 5], [1, 2], [1, 3], [3, 0]],
        };
        let struts = (1..6).map(|i| [f64::from(i), 0.0]).collect();
        let mut radii = GivenRadii { nodes: vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6], struts };
        let counts = wireframe.clean(1e-6, &mut radii);
        assert_eq!(counts, Cleaned { merged: 2, zero_length: 1, duplicates: 1, isolated: 1, dangling: 0 });
        assert_eq!(wireframe.struts, [[0, 1], [1, 2], [2, 0]]);
        assert_eq!(radii.nodes, [0.1, 0.2, 0.4]);
        assert_eq!(radii.struts, [[1.0, 0.0], [4.0, 0.0], [5.0, 0.0]]);
    }

    #[test]
    fn a_tail_goes_strut_by_strut_unless_it_is_held() {
        let line = |n: u32| Wireframe {
            nodes: (0..=n).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            struts: (0..n).map(|i| [i, i + 1]).collect(),
        };
        let mut loose = line(5);
        loose.struts.push([0, 2]);
        assert_eq!(loose.dangling(&|_| false), 1);
        assert_eq!(loose.drop_dangling(&|_| false, &mut GivenRadii::default()), 3);
        assert_eq!((loose.nodes.len(), loose.struts.len()), (3, 3));
        let mut held = line(5);
        assert_eq!(held.drop_dangling(&|p| p[0] == 0.0 || p[0] == 5.0, &mut GivenRadii::default()), 0);
        assert_eq!(line(5).drop_dangling(&|_| false, &mut GivenRadii::default()), 5);
    }
}
