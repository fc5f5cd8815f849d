//! Checks of a graph: bounds, thinnest beams, beams inside other beams.

use super::wireframe::{Incidence, Wireframe};
use super::{Graph, Profile};
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

impl Graph {
    /// The wireframe of the graph.
    pub fn wireframe(&self) -> Wireframe {
        Wireframe {
            nodes: self.hubs.iter().map(|h| h.center).collect(),
            struts: self.beams.iter().map(|b| b.ends).collect(),
        }
    }

    /// Bounding box of all hubs, mm.
    pub fn bounds(&self) -> Aabb {
        let ball = |b: Aabb, h: &super::HubBall| b.union(Aabb { min: h.center, max: h.center }.grown(h.radius));
        self.hubs.iter().fold(Aabb::EMPTY, ball)
    }

    /// Lower estimate of a beam's radius: the minimum of its end radii and its mid-length or waist radius, mm.
    pub fn min_radius(&self, beam: usize) -> f64 {
        let b = &self.beams[beam];
        let ends = b.ends.map(|n| self.hubs[n as usize].radius);
        let middle = match b.profile {
            Profile::Mid(r) | Profile::Waist(r) => r,
            Profile::Cone | Profile::Cylinder | Profile::Lambda(_) => f64::INFINITY,
        };
        ends[0].min(ends[1]).min(middle)
    }

    /// Beams that lie inside another beam of the same hub: their number, and the midpoint of the first, mm.
    pub fn contained_beams(&self) -> Option<(usize, Vec3)> {
        let wireframe = self.wireframe();
        let incidence = Incidence::of(&wireframe);
        let mut first = None;
        let mut gone = vec![false; self.beams.len()];
        for (n, hub) in self.hubs.iter().enumerate() {
            let star = incidence.at(n);
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
                    // Of two beams of equal length the later one counts.
                    let longer = t < 1.0 - 1e-12 || (t <= 1.0 + 1e-12 && o < s);
                    let off = norm(sub(along, scale(other, t)));
                    let room = hub.radius + t * (far - hub.radius);
                    let thin = self.min_radius(*o as usize).min(room);
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
    use crate::graph::{Beam, HubBall};

    fn line(stations: &[[f64; 2]], beams: &[[u32; 2]], profile: Profile) -> Graph {
        Graph {
            hubs: (stations.iter()).map(|[x, radius]| HubBall { center: [*x, 0.0, 0.0], radius: *radius }).collect(),
            beams: beams.iter().map(|e| Beam { ends: *e, profile }).collect(),
        }
    }

    #[test]
    fn a_beam_in_a_longer_one_is_swallowed() {
        let graph = line(&[[0.0, 0.5], [2.0, 0.5], [5.0, 0.5]], &[[0, 1], [0, 2]], Profile::Cone);
        assert_eq!(graph.contained_beams(), Some((1, [1.0, 0.0, 0.0])));
        let apart = line(&[[0.0, 0.5], [2.0, 0.5], [-5.0, 0.5]], &[[0, 1], [0, 2]], Profile::Cone);
        assert_eq!(apart.contained_beams(), None);
    }
}
