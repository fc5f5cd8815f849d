//! A graph as a frame, and what in it cannot be meant.

use super::wire::{Stars, Wire};
use super::{Graph, Profile};
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

impl Graph {
    /// The frame of the graph.
    pub fn wire(&self) -> Wire {
        Wire {
            nodes: self.hubs.iter().map(|h| h.center).collect(),
            struts: self.beams.iter().map(|b| b.ends).collect(),
        }
    }

    /// The box about all hubs.
    pub fn bounds(&self) -> Aabb {
        let ball = |b: Aabb, h: &super::Hub| b.union(Aabb { min: h.center, max: h.center }.grown(h.radius));
        self.hubs.iter().fold(Aabb::EMPTY, ball)
    }

    /// Radius of a beam at its thinnest place, but for what a waist takes away: the least of its ends and its middle.
    pub fn thinnest(&self, beam: usize) -> f64 {
        let b = &self.beams[beam];
        let ends = b.ends.map(|n| self.hubs[n as usize].radius);
        let middle = match b.profile {
            Profile::Mid(r) | Profile::Waist(r) => r,
            Profile::Cone | Profile::Cylinder | Profile::Lambda(_) => f64::INFINITY,
        };
        ends[0].min(ends[1]).min(middle)
    }

    /// Beams that lie within another one of the same hub: how many, and where the first is.
    pub fn swallowed(&self) -> Option<(usize, Vec3)> {
        let wire = self.wire();
        let stars = Stars::of(&wire);
        let mut first = None;
        let mut gone = vec![false; self.beams.len()];
        for (n, hub) in self.hubs.iter().enumerate() {
            let star = stars.at(n);
            let ray = |s: u32| {
                let [a, b] = self.beams[s as usize].ends;
                let other = self.hubs[if a as usize == n { b } else { a } as usize];
                (sub(other.center, hub.center), other.radius)
            };
            for s in star {
                let (along, end) = ray(*s);
                let within = star.iter().filter(|o| *o != s).any(|o| {
                    let (other, far) = ray(*o);
                    let length = dot(other, other);
                    let t = dot(along, other) / length;
                    // Of two of one length the later one is told.
                    let longer = t < 1.0 - 1e-12 || (t <= 1.0 + 1e-12 && o < s);
                    let off = norm(sub(along, scale(other, t)));
                    let room = hub.radius + t * (far - hub.radius);
                    let thin = self.thinnest(*o as usize).min(room);
                    t > 0.0 && longer && off + end <= thin + 1e-9 * norm(other)
                });
                if within && !std::mem::replace(&mut gone[*s as usize], true) {
                    first.get_or_insert(add(hub.center, scale(along, 0.5)));
                }
            }
        }
        let count = gone.iter().filter(|g| **g).count();
        first.map(|p| (count, p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Beam, Hub};

    fn line(places: &[[f64; 2]], beams: &[[u32; 2]], profile: Profile) -> Graph {
        Graph {
            hubs: (places.iter()).map(|[x, radius]| Hub { center: [*x, 0.0, 0.0], radius: *radius }).collect(),
            beams: beams.iter().map(|e| Beam { ends: *e, profile }).collect(),
        }
    }

    #[test]
    fn a_beam_in_a_longer_one_is_swallowed() {
        let graph = line(&[[0.0, 0.5], [2.0, 0.5], [5.0, 0.5]], &[[0, 1], [0, 2]], Profile::Cone);
        assert_eq!(graph.swallowed(), Some((1, [1.0, 0.0, 0.0])));
        let apart = line(&[[0.0, 0.5], [2.0, 0.5], [-5.0, 0.5]], &[[0, 1], [0, 2]], Profile::Cone);
        assert_eq!(apart.swallowed(), None);
    }
}
