//! Beams of a pattern that intersect without a common hub, found around one hub of each class.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::PatternField;
use crate::graph::{Beam, Graph, HubBall};
use crate::pattern::Pattern;
use crate::quador::{Fillet, Quadors};
use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, sub};

/// Maximum number of classes examined.
const MAX_CLASSES: usize = 4096;

/// Intersecting beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collisions {
    /// Number of pairs around one hub of each class.
    pub count: usize,
    /// Position of the first pair, mm.
    pub at: Option<Vec3>,
}

impl PatternField {
    /// Pairs of beams that intersect without a common hub: those of one hub of each class, in the middle of its
    /// repeats, with all beams near it. Intersections that only other hubs at the ends of a class have are missed.
    /// `None` if there are too many classes.
    ///
    /// # Errors
    /// Beams that cannot be built, which `new` has refused already.
    pub fn collisions(&self) -> Result<Option<Collisions>, Fault> {
        if self.representatives.len() > MAX_CLASSES {
            return Ok(None);
        }
        let each = (0..self.representatives.len())
            .into_par_iter()
            .map(|m| self.around(m))
            .collect::<Result<Vec<_>, Fault>>()?;
        Ok(Some(Collisions { count: each.iter().map(|e| e.count).sum(), at: each.iter().find_map(|e| e.at) }))
    }

    /// Pairs around the representative of one class.
    fn around(&self, class: usize) -> Result<Collisions, Fault> {
        let nodes = self.pattern.nodes.len();
        let [classes_u, classes_v, _] = self.classes.map(|c| c.len());
        let (class, node) = (class / nodes, (class % nodes) as u32);
        let of = [class % classes_u, class / classes_u % classes_v, class / (classes_u * classes_v)];
        let index = [0, 1, 2].map(|a| {
            let (first, n) = self.classes[a].members(of[a]);
            (first + n / 2) as u32
        });
        let (there, offset) = (self.pattern.at(index), self.representatives[class].offset);
        let bounds = self.quadors.hub_bounds(self.representatives[class].hub);
        let bounds = Aabb { min: sub(bounds.min, offset), max: sub(bounds.max, offset) };
        let mut near = vec![(node, index)];
        self.indices_near(&there.bounds(&bounds), &mut |at, _, _, _| {
            let at = at.map(|v| v as u32);
            let others = (0..nodes as u32).map(|n| (n, at));
            near.extend(others.filter(|o| *o != (node, index)));
            true
        });
        // In the frame of the representative, where rounding is least.
        let inverse = there.inverse();
        let mut cluster = Cluster::new(&self.pattern);
        for (n, at) in near {
            cluster.add(n, at, |n, at| {
                let (local, h) = (inverse.after(&self.pattern.at(at)), self.pattern.nodes[n as usize]);
                HubBall { center: local.point(h.center), radius: local.scale() * h.radius }
            });
        }
        let graph = cluster.graph;
        let found = Quadors::new(&graph, Fillet::None)?.collisions();
        // The hub itself is the first.
        let own = |b: u32| graph.beams[b as usize].ends.contains(&0);
        let mut own = found.iter().filter(|c| c.beams.iter().any(|b| own(*b)));
        let first = own.next();
        Ok(Collisions { count: own.count() + usize::from(first.is_some()), at: first.map(|c| there.point(c.at)) })
    }
}

/// Some hubs of a pattern with all their beams.
struct Cluster<'a> {
    pattern: &'a Pattern,
    graph: Graph,
    indices: HashMap<(u32, [u32; 3]), u32>,
    /// Beams by strut and start index.
    beams: HashSet<(usize, [u32; 3])>,
}

impl<'a> Cluster<'a> {
    fn new(pattern: &'a Pattern) -> Self {
        Cluster { pattern, graph: Graph::default(), indices: HashMap::new(), beams: HashSet::new() }
    }

    fn index_of(&mut self, n: u32, at: [u32; 3], ball: &impl Fn(u32, [u32; 3]) -> HubBall) -> u32 {
        *self.indices.entry((n, at)).or_insert_with(|| {
            self.graph.hubs.push(ball(n, at));
            self.graph.hubs.len() as u32 - 1
        })
    }

    /// Adds a hub with its beams.
    fn add(&mut self, n: u32, at: [u32; 3], ball: impl Fn(u32, [u32; 3]) -> HubBall) {
        let own = self.index_of(n, at, &ball);
        for (number, s) in self.pattern.struts.iter().enumerate() {
            for end in [0, 1] {
                if s.ends[end] != n {
                    continue;
                }
                let sign = if end == 0 { 1 } else { -1 };
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(at[a]) + i64::from(sign * s.offset[a]));
                if (0..3).any(|a| !(0..i64::from(self.pattern.steps[a].1)).contains(&other[a])) {
                    continue;
                }
                let other = other.map(|v| v as u32);
                let from = if end == 0 { at } else { other };
                if !self.beams.insert((number, from)) {
                    continue;
                }
                let far = self.index_of(s.ends[1 - end], other, &ball);
                let ends = if end == 0 { [own, far] } else { [far, own] };
                // A beam has the scale of its first end.
                let node = self.pattern.nodes[s.ends[0] as usize].radius;
                let scale = self.graph.hubs[ends[0] as usize].radius / node;
                self.graph.beams.push(Beam { ends, profile: Pattern::scaled_profile(s.profile, scale) });
            }
        }
    }
}
