//! Beams of a pattern that run into each other without a hub between them: looked for about one hub of each kind.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::Laid;
use crate::graph::{Beam, Graph, Hub};
use crate::pattern::Pattern;
use crate::quador::{Fillet, Quadors};
use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, sub};

/// Most kinds of hubs that are looked at.
const LOOKED: usize = 4096;

/// What runs into each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collisions {
    /// Pairs of beams, those about one hub of each kind.
    pub count: usize,
    /// Where a first one is, mm.
    pub at: Option<Vec3>,
}

impl Laid {
    /// Beams that meet without a common hub: those of a hub of each kind, halfway through its repeats, and all beams near it. What
    /// only a few hubs at an end of the repeats have near them is not seen. `None` if more kinds differ than are looked at.
    ///
    /// # Errors
    /// Beams that cannot be, which `new` has refused.
    pub fn collisions(&self) -> Result<Option<Collisions>, Fault> {
        if self.kinds.len() > LOOKED {
            return Ok(None);
        }
        let each = (0..self.kinds.len()).into_par_iter().map(|m| self.about(m)).collect::<Result<Vec<_>, Fault>>()?;
        Ok(Some(Collisions { count: each.iter().map(|e| e.count).sum(), at: each.iter().find_map(|e| e.at) }))
    }

    /// Those of a hub of one kind.
    fn about(&self, kind: usize) -> Result<Collisions, Fault> {
        let nodes = self.pattern.nodes.len();
        let [lu, lv, _] = self.classes.map(|c| c.len());
        let (class, node) = (kind / nodes, (kind % nodes) as u32);
        let of = [class % lu, class / lu % lv, class / (lu * lv)];
        let index = [0, 1, 2].map(|a| {
            let (first, n) = self.classes[a].members(of[a]);
            (first + n / 2) as u32
        });
        let (there, aside) = (self.pattern.at(index), self.kinds[kind].aside);
        let held = self.quadors.hold(self.kinds[kind].hub);
        let held = Aabb { min: sub(held.min, aside), max: sub(held.max, aside) };
        let mut near = vec![(node, index)];
        self.places(&super::carried(&there, &held), &mut |at, _, _, _| {
            let at = at.map(|v| v as u32);
            let others = (0..nodes as u32).map(|n| (n, at));
            near.extend(others.filter(|o| *o != (node, index)));
            true
        });
        // As seen from the first place, which is where digits are best.
        let home = there.inverse();
        let mut cluster = Cluster::new(&self.pattern);
        for (n, at) in near {
            cluster.add(n, at, |n, at| {
                let (seen, h) = (home.after(&self.pattern.at(at)), self.pattern.nodes[n as usize]);
                Hub { center: seen.apply(h.center), radius: seen.scale * h.radius }
            });
        }
        let graph = cluster.graph;
        let found = Quadors::new(&graph, Fillet::None)?.collisions();
        // The hub itself came first.
        let own = |b: u32| graph.beams[b as usize].ends.contains(&0);
        let mut own = found.iter().filter(|c| c.beams.iter().any(|b| own(*b)));
        let first = own.next();
        Ok(Collisions { count: own.count() + usize::from(first.is_some()), at: first.map(|c| there.apply(c.at)) })
    }
}

/// Some hubs of a pattern with all their beams.
struct Cluster<'a> {
    pattern: &'a Pattern,
    graph: Graph,
    names: HashMap<(u32, [u32; 3]), u32>,
    /// Beams by their strut and where it starts.
    beams: HashSet<(usize, [u32; 3])>,
}

impl<'a> Cluster<'a> {
    fn new(pattern: &'a Pattern) -> Self {
        Cluster { pattern, graph: Graph::default(), names: HashMap::new(), beams: HashSet::new() }
    }

    fn name(&mut self, n: u32, at: [u32; 3], ball: &impl Fn(u32, [u32; 3]) -> Hub) -> u32 {
        *self.names.entry((n, at)).or_insert_with(|| {
            self.graph.hubs.push(ball(n, at));
            self.graph.hubs.len() as u32 - 1
        })
    }

    /// Adds a hub with its beams.
    fn add(&mut self, n: u32, at: [u32; 3], ball: impl Fn(u32, [u32; 3]) -> Hub) {
        let own = self.name(n, at, &ball);
        for (number, s) in self.pattern.struts.iter().enumerate() {
            for end in [0, 1] {
                if s.ends[end] != n {
                    continue;
                }
                let sign = if end == 0 { 1 } else { -1 };
                let other: [i64; 3] = core::array::from_fn(|a| i64::from(at[a]) + i64::from(sign * s.by[a]));
                if (0..3).any(|a| !(0..i64::from(self.pattern.steps[a].1)).contains(&other[a])) {
                    continue;
                }
                let other = other.map(|v| v as u32);
                let from = if end == 0 { at } else { other };
                if !self.beams.insert((number, from)) {
                    continue;
                }
                let far = self.name(s.ends[1 - end], other, &ball);
                let ends = if end == 0 { [own, far] } else { [far, own] };
                // A beam is as large as its first end is.
                let node = self.pattern.nodes[s.ends[0] as usize].radius;
                let grown = self.graph.hubs[ends[0] as usize].radius / node;
                self.graph.beams.push(Beam { ends, profile: Pattern::grown(s.profile, grown) });
            }
        }
    }
}
