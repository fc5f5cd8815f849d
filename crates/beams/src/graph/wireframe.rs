//! Wireframes: nodes and struts without radii, and their statistics.

use std::collections::BTreeMap;

use geometry::math::{Vec3, dot, norm, sub, unit};
use geometry::union_find::{singles, unite};

/// A wireframe: nodes, and struts between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wireframe {
    /// Node positions, mm.
    pub nodes: Vec<Vec3>,
    /// Indices of the two nodes of each strut.
    pub struts: Vec<[u32; 2]>,
}

/// Radii given for the nodes and struts of a wireframe, in their order, mm; NaN where none is given, empty if none at all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenRadii {
    /// Radii of hubs.
    pub nodes: Vec<f64>,
    /// Radii of beams at their two ends.
    pub struts: Vec<[f64; 2]>,
}

impl GivenRadii {
    /// Whether none is given.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.struts.is_empty()
    }
}

/// What of a wireframe is in a region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Within {
    /// Whether each strut is: all those of a node that is.
    pub struts: Vec<bool>,
    /// Whether each node is.
    pub nodes: Vec<bool>,
    /// Whether each node joins its struts there.
    pub joints: Vec<bool>,
}

/// Statistics of what of a wireframe is in a region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WireframeReport {
    /// Number of nodes by valence.
    pub valence: BTreeMap<usize, usize>,
    /// Number of struts.
    pub struts: usize,
    /// Minimum and maximum length of struts, mm; `None` without struts.
    pub length: Option<[f64; 2]>,
    /// Total length of struts, mm.
    pub total_length: f64,
    /// Minimum angle between two struts at a node (degrees), and the node's position, mm.
    pub min_angle: Option<(f64, Vec3)>,
    /// Number of connected components of struts that are joined.
    pub components: usize,
}

/// Struts incident to each node (compressed rows).
pub(super) struct Incidence {
    from: Vec<u32>,
    struts: Vec<u32>,
}

impl Incidence {
    /// The incidence of a wireframe.
    pub(super) fn of(wireframe: &Wireframe) -> Incidence {
        let mut from = vec![0u32; wireframe.nodes.len() + 1];
        for end in wireframe.struts.iter().flatten() {
            from[*end as usize + 1] += 1;
        }
        for n in 0..wireframe.nodes.len() {
            from[n + 1] += from[n];
        }
        let mut next = from.clone();
        let mut struts = vec![0u32; 2 * wireframe.struts.len()];
        for (s, ends) in wireframe.struts.iter().enumerate() {
            for end in ends {
                let slot = &mut next[*end as usize];
                struts[*slot as usize] = s as u32;
                *slot += 1;
            }
        }
        Incidence { from, struts }
    }

    /// The struts incident to a node.
    pub(super) fn at(&self, node: usize) -> &[u32] {
        &self.struts[self.from[node] as usize..self.from[node + 1] as usize]
    }
}

impl Wireframe {
    /// Length of a strut, mm.
    pub fn length(&self, strut: [u32; 2]) -> f64 {
        let [a, b] = strut.map(|n| self.nodes[n as usize]);
        norm(sub(b, a))
    }

    /// Removes nodes without struts, keeping the order; returns the new index of each node that remains.
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
        let mut drop_isolated = used.iter();
        self.nodes.retain(|_| drop_isolated.next() == Some(&true));
        for end in self.struts.iter_mut().flatten() {
            *end = numbers[*end as usize].unwrap_or(0);
        }
        numbers
    }

    /// Removes nodes without struts, and their radii.
    pub(super) fn drop_isolated(&mut self, radii: &mut GivenRadii) {
        let numbers = self.compact();
        if !radii.nodes.is_empty() {
            let mut kept = numbers.iter();
            radii.nodes.retain(|_| kept.next().is_some_and(Option::is_some));
        }
    }

    /// All of it.
    pub fn whole(&self) -> Within {
        let nodes = vec![true; self.nodes.len()];
        Within { struts: vec![true; self.struts.len()], joints: nodes.clone(), nodes }
    }

    /// Statistics of what is within a region; pairs of struts that `cross` are joined there.
    pub fn report(&self, within: &Within, cross: impl Iterator<Item = [u32; 2]>) -> WireframeReport {
        let mut numbers = vec![None; self.struts.len()];
        let kept = (0..self.struts.len()).filter(|s| within.struts[*s]);
        let kept = kept.enumerate().map(|(number, s)| {
            numbers[s] = Some(number as u32);
            self.struts[s]
        });
        let part = Wireframe { nodes: self.nodes.clone(), struts: kept.collect() };
        let incidence = Incidence::of(&part);
        let cross = cross.filter_map(|[a, b]| Some([numbers[a as usize]?, numbers[b as usize]?]));
        let mut report = WireframeReport {
            struts: part.struts.len(),
            components: part.components(&incidence, &within.joints, cross),
            ..WireframeReport::default()
        };
        for strut in &part.struts {
            let l = self.length(*strut);
            report.length = Some(report.length.map_or([l; 2], |[a, b]| [a.min(l), b.max(l)]));
            report.total_length += l;
        }
        let mut max_cosine = -1.0;
        let mut rays: Vec<Vec3> = Vec::new();
        for (n, slot) in self.nodes.iter().enumerate() {
            if !within.nodes[n] {
                continue;
            }
            let incident = incidence.at(n);
            *report.valence.entry(incident.len()).or_default() += 1;
            rays.clear();
            rays.extend(incident.iter().map(|s| {
                let [a, b] = part.struts[*s as usize];
                let other = if a as usize == n { b } else { a };
                unit(sub(self.nodes[other as usize], *slot))
            }));
            for (i, a) in rays.iter().enumerate() {
                for b in &rays[..i] {
                    let cosine = dot(*a, *b);
                    // Equal angles differ by rounding: the first position is reported.
                    if cosine > max_cosine + 1e-12 {
                        max_cosine = cosine;
                        // By the chord, since the cosine is flat at small angles.
                        let half = 0.5 * norm(sub(*a, *b)).min(2.0);
                        report.min_angle = Some((2.0 * half.asin().to_degrees(), *slot));
                    }
                }
            }
        }
        report
    }

    /// Number of connected components of struts, which are joined at these nodes and where they cross.
    fn components(&self, incidence: &Incidence, joints: &[bool], cross: impl Iterator<Item = [u32; 2]>) -> usize {
        let mut root = singles(self.struts.len());
        let mut components = self.struts.len();
        for [a, b] in cross {
            components -= usize::from(unite(&mut root, a, b));
        }
        for node in (0..self.nodes.len()).filter(|n| joints[*n]) {
            for pair in incidence.at(node).windows(2) {
                components -= usize::from(unite(&mut root, pair[0], pair[1]));
            }
        }
        components
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_of_a_square_with_a_tail() {
        let wireframe = Wireframe {
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
        let mut within = wireframe.whole();
        let apart = std::iter::empty;
        let report = wireframe.report(&within, apart());
        assert_eq!(report.valence, BTreeMap::from([(1, 3), (2, 3), (3, 1)]));
        assert_eq!((report.length, report.components), (Some([1.0, 3.0]), 2));
        assert!((report.total_length - 12.0).abs() < 1e-12);
        assert!(report.min_angle.is_some_and(|a| (a.0 - 90.0).abs() < 1e-9));
        // What crosses a region with both ends outside is counted, and joined to others at nodes there alone.
        within.nodes.fill(false);
        within.joints = vec![false, true, false, false, false, false, false];
        let report = wireframe.report(&within, apart());
        assert_eq!((report.struts, report.components, report.valence.len()), (6, 5, 0));
        // Struts that cross are one component too, unless one is left out.
        let cross = || [[0, 2], [2, 5], [5, 0]].into_iter();
        assert_eq!(wireframe.report(&within, cross()).components, 3);
        within.struts[2] = false;
        assert_eq!(wireframe.report(&within, cross()).components, 3);
        within.struts.fill(false);
        assert_eq!(wireframe.report(&within, apart()), WireframeReport::default());
    }
}
