//! Clean-up of a wire frame: what is twice, or of no length, is taken out, and told.

use std::collections::{HashMap, HashSet};

use super::wire::{Stars, Wire};
use geometry::math::{Vec3, norm, sub};
use geometry::union_find::{find, unite};

/// What a clean-up did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cleaned {
    /// Nodes that were merged into another at the same place.
    pub merged: usize,
    /// Struts left out because both ends are one node.
    pub short: usize,
    /// Struts left out because another joins the same nodes.
    pub duplicates: usize,
    /// Nodes left out because no strut ends there.
    pub isolated: usize,
    /// Struts with a free end left out, one after the other.
    pub dangling: usize,
}

impl Wire {
    /// Merges nodes at most `within` (mm) apart, each into the one of least number near it, and leaves out struts of no
    /// length, struts between the same two nodes, and nodes without struts. `radii`, if not empty, is kept in step.
    pub fn clean(&mut self, within: f64, radii: &mut Vec<f64>) -> Cleaned {
        let mut done = Cleaned::default();
        let root = self.merged(within);
        done.merged = (root.iter().enumerate()).filter(|(n, r)| *n != **r as usize).count();
        let mut seen = HashSet::with_capacity(self.struts.len());
        self.struts.retain_mut(|strut| {
            *strut = strut.map(|n| root[n as usize]);
            let [a, b] = *strut;
            if a == b {
                done.short += 1;
                return false;
            }
            let new = seen.insert([a.min(b), a.max(b)]);
            done.duplicates += usize::from(!new);
            new
        });
        let before = self.nodes.len();
        self.keep(radii);
        done.isolated = before - done.merged - self.nodes.len();
        done
    }

    /// Leaves out struts with an end that no other shares, until there are none; ends that are `held` are not free.
    /// Returns how many.
    pub fn drop_dangling(&mut self, held: &impl Fn(Vec3) -> bool, radii: &mut Vec<f64>) -> usize {
        let stars = Stars::of(self);
        let mut valence: Vec<usize> = (0..self.nodes.len()).map(|n| stars.at(n).len()).collect();
        let mut gone = vec![false; self.struts.len()];
        let free = |n: usize, valence: &[usize]| valence[n] == 1 && !held(self.nodes[n]);
        let mut open: Vec<usize> = (0..self.nodes.len()).filter(|n| free(*n, &valence)).collect();
        while let Some(n) = open.pop() {
            let Some(s) = stars.at(n).iter().find(|s| !gone[**s as usize]) else {
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
        let mut left = gone.iter();
        self.struts.retain(|_| left.next() == Some(&false));
        self.keep(radii);
        gone.iter().filter(|g| **g).count()
    }

    /// How many nodes have a single strut, ends that are `held` not counted.
    pub fn dangling(&self, held: &impl Fn(Vec3) -> bool) -> usize {
        let stars = Stars::of(self);
        let nodes = self.nodes.iter().enumerate();
        nodes.filter(|(n, p)| stars.at(*n).len() == 1 && !held(**p)).count()
    }

    /// For each node the one of least number that it is merged into.
    fn merged(&self, within: f64) -> Vec<u32> {
        let mut root: Vec<u32> = (0..self.nodes.len() as u32).collect();
        // Nodes that are near each other lie in neighbouring cubes, nearly always in the same.
        let edge = (4.0 * within).max(f64::MIN_POSITIVE);
        let cube = |p: Vec3| p.map(|v| (v / edge).floor());
        let mut cubes: HashMap<[u64; 3], Vec<u32>> = HashMap::with_capacity(self.nodes.len());
        let key = |c: Vec3| c.map(|v| (v + 0.0).to_bits());
        for (n, p) in self.nodes.iter().enumerate() {
            let (low, high) = (cube(p.map(|v| v - within)), cube(p.map(|v| v + within)));
            let axis = |a: usize| {
                if low[a] == high[a] { vec![low[a]] } else { vec![low[a], high[a]] }
            };
            for x in axis(0) {
                for y in axis(1) {
                    for z in axis(2) {
                        let near = cubes.get(&key([x, y, z])).into_iter().flatten();
                        for other in near {
                            if norm(sub(self.nodes[*other as usize], *p)) <= within {
                                unite(&mut root, n as u32, *other);
                            }
                        }
                    }
                }
            }
            cubes.entry(key(cube(*p))).or_default().push(n as u32);
        }
        (0..root.len() as u32).map(|n| find(&mut root, n)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_twice_goes_and_is_told() {
        let mut wire = Wire {
            nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [0.0, 1.0, 0.0], [5.0; 3], [-1e-9, 0.0, 0.0]],
            struts: vec![[0, 1], [2, 5], [1, 2], [1, 3], [3, 0]],
        };
        let mut radii = vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let done = wire.clean(1e-6, &mut radii);
        assert_eq!(done, Cleaned { merged: 2, short: 1, duplicates: 1, isolated: 1, dangling: 0 });
        assert_eq!(wire.struts, [[0, 1], [1, 2], [2, 0]]);
        assert_eq!(radii, [0.1, 0.2, 0.4]);
    }

    #[test]
    fn a_tail_goes_strut_by_strut_unless_it_is_held() {
        let line = |n: u32| Wire {
            nodes: (0..=n).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            struts: (0..n).map(|i| [i, i + 1]).collect(),
        };
        let mut loose = line(5);
        loose.struts.push([0, 2]);
        assert_eq!(loose.dangling(&|_| false), 1);
        assert_eq!(loose.drop_dangling(&|_| false, &mut Vec::new()), 3);
        assert_eq!((loose.nodes.len(), loose.struts.len()), (3, 3));
        let mut held = line(5);
        assert_eq!(held.drop_dangling(&|p| p[0] == 0.0 || p[0] == 5.0, &mut Vec::new()), 0);
        assert_eq!(line(5).drop_dangling(&|_| false, &mut Vec::new()), 5);
    }
}
