//! The patches about a place, each continued beyond its border.

use super::super::NOTHING;
use super::super::tree::{self, Feature, Hit};
use super::border::{INNER, Seam};
use super::{ACROSS, Creased, MIXED, MOST, REACH, bits};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

/// A patch near some place.
#[derive(Clone, Copy)]
pub(super) struct Member {
    pub(super) patch: u32,
    /// The distance to the patch as continued, negative inside; and its gradient.
    pub(super) value: f64,
    pub(super) gradient: Vec3,
    /// Its nearest point, its normal there, and the way into it if that is on the border.
    pub(super) foot: Vec3,
    pub(super) normal: Vec3,
    pub(super) inward: Vec3,
    pub(super) lean: f64,
}

impl Member {
    /// The patch as it goes on beyond its nearest point, at `p`.
    pub(super) fn continued(&self, p: Vec3) -> f64 {
        let v = sub(p, self.foot);
        let height = dot(v, self.normal);
        height + self.lean * lateral(v, height)
    }
}

/// The length of a vector beside its part of some height along a normal.
pub(super) fn lateral(v: Vec3, height: f64) -> f64 {
    (dot(v, v) - height * height).max(0.0).sqrt()
}

impl Creased {
    /// The nearest point of each patch within `reach` of a place, the nearest patch first.
    pub(super) fn around(&self, p: Vec3, reach: f64, out: &mut Vec<Hit>) {
        out.clear();
        let tree = &self.region.tree;
        let limit = reach * reach;
        let mut best: Vec<(u32, Hit)> = Vec::with_capacity(8);
        let within = |best: &[(u32, Hit)], node: u32, square: f64| {
            if square > limit {
                return false;
            }
            let patch = self.nodes[node as usize];
            let known = (patch != MIXED)
                .then(|| best.iter().find(|b| b.0 == patch))
                .flatten();
            known.is_none_or(|(_, hit)| square <= hit.square)
        };
        let mut stack = [(0u32, 0.0f64); 128];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (mut i, mut square) = stack[top];
            while within(&best, i, square) {
                let node = &tree.nodes()[i as usize];
                if node.count > 0 {
                    for k in node.at..node.at + node.count {
                        let (square, away, feature) = tree.faces()[k as usize].nearest(p);
                        let hit = Hit {
                            square,
                            away,
                            triangle: k,
                            feature,
                        };
                        let patch = self.patch[k as usize];
                        match best.iter_mut().find(|b| b.0 == patch) {
                            _ if square > limit => {}
                            Some((_, old)) => {
                                if square < old.square || (square == old.square && k < old.triangle)
                                {
                                    *old = hit;
                                }
                            }
                            None => best.push((patch, hit)),
                        }
                    }
                    break;
                }
                let child = |c: u32| {
                    (
                        c,
                        tree::square_distance(&tree.nodes()[c as usize].bounds, p),
                    )
                };
                let (mut near, mut far) = (child(i + 1), child(node.at));
                if far.1 < near.1 {
                    (near, far) = (far, near);
                }
                if top < stack.len() {
                    stack[top] = far;
                    top += 1;
                }
                (i, square) = near;
            }
        }
        best.sort_by(|a, b| a.1.square.total_cmp(&b.1.square).then(a.0.cmp(&b.0)));
        out.extend(best.into_iter().map(|b| b.1));
    }

    /// A patch by its nearest point to `p`.
    pub(super) fn member(&self, p: Vec3, hit: &Hit) -> Member {
        let region = &*self.region;
        let t = hit.triangle as usize;
        let face = &region.tree.faces()[t];
        let mut m = Member {
            patch: self.patch[t],
            value: 0.0,
            gradient: face.normal,
            foot: sub(p, hit.away),
            normal: face.normal,
            inward: [0.0; 3],
            lean: 0.0,
        };
        let rim = self.rims.get(self.rim[t] as usize);
        let border = match (hit.feature, rim) {
            (Feature::Edge(k), Some(rim)) if !rim.lean[usize::from(k)].is_nan() => {
                let k = usize::from(k);
                let along = sub(face.corners[(k + 1) % 3], face.corners[k]);
                m.inward = unit(cross(face.normal, along));
                m.lean = rim.lean[k];
                true
            }
            (Feature::Corner(k), Some(rim)) if rim.fan[usize::from(k)] != INNER => {
                let fan = &self.fans[rim.fan[usize::from(k)] as usize];
                m.normal = fan.normal;
                m.inward = fan.inward;
                m.lean = fan.lean;
                m.gradient = fan.normal;
                true
            }
            (Feature::Face, _) => true,
            _ => false,
        };
        if border {
            let height = dot(hit.away, m.normal);
            m.value = height;
            if m.lean != 0.0 {
                m.value += m.lean * lateral(hit.away, height);
            }
        } else {
            m.value = region.signed(hit, p, NOTHING);
            m.normal = unit(region.normals.outward(&region.tree, hit));
            m.gradient = region.gradient(hit, m.value);
        }
        if m.value.abs() <= region.tree.rounding() {
            m.value = 0.0;
        }
        m
    }

    /// The common border of two patches if it is near to a place.
    pub(super) fn seam(&self, p: Vec3, a: u32, b: u32) -> Option<&Seam> {
        let seam = self.seams.get(&(a.min(b), a.max(b)));
        seam.filter(|s| s.bounds.distance(p) <= REACH * self.step)
    }

    /// Whether two patches near a place meet in a concave edge; or would, if they meet in a corner at most.
    pub(super) fn concave(&self, p: Vec3, a: &Member, b: &Member) -> bool {
        if let Some(seam) = self
            .seam(p, a.patch, b.patch)
            .filter(|s| !s.edges.is_empty() || s.concave.is_some())
        {
            return seam.concave.unwrap_or_else(|| {
                let far = |e: &(Vec3, f64)| norm(sub(e.0, p));
                let near = seam.edges.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
                near.is_some_and(|e| e.1 > 0.0)
            });
        }
        let [x, y] = self.heights(a, b);
        x + y > 0.0
    }

    /// How high either of two patches is above the other one.
    pub(super) fn heights(&self, a: &Member, b: &Member) -> [f64; 2] {
        let within = |m: &Member| add(m.foot, scale(m.inward, 0.5 * self.step));
        [b.continued(within(a)), a.continued(within(b))]
    }

    /// Whether two patches are the sides of a wall or a gap that a grid cell may hold.
    pub(super) fn opposite(&self, a: &Member, b: &Member) -> bool {
        let [x, y] = self.heights(a, b);
        dot(a.normal, b.normal) < -0.5 && (x < 0.0) == (y < 0.0)
    }

    /// The patches about a place that meet the nearest one, which is the first, or are opposite to it: of different
    /// colors. Others are continued only where they are nearest themselves.
    pub(super) fn members(&self, p: Vec3, hits: &[Hit]) -> Vec<Member> {
        let mut members: Vec<Member> = Vec::with_capacity(MOST);
        let mut used = 0u32;
        let across = ACROSS * self.step;
        for hit in hits {
            let color = 1u32 << self.color[self.patch[hit.triangle as usize] as usize];
            if used & color != 0 || members.len() == MOST {
                continue;
            }
            let m = self.member(p, hit);
            let known = members.first().is_none_or(|first| {
                // What ends at a concave edge does not stand for the wall alone.
                let ends = || {
                    hits.iter().any(|h| {
                        let other = self.patch[h.triangle as usize];
                        let seam = self.seam(p, other, m.patch);
                        other != m.patch && seam.is_some_and(|s| s.concave != Some(false))
                    })
                };
                self.seam(p, first.patch, m.patch).is_some()
                    || (hit.square <= across * across && self.opposite(first, &m) && !ends())
            });
            if known {
                used |= color;
                members.push(m);
            }
        }
        members
    }

    /// Which of some patches meet in concave edges, as bits.
    pub(super) fn meeting(&self, p: Vec3, members: &[Member]) -> [u32; MOST] {
        let mut beside = [0u32; MOST];
        for i in 0..members.len() {
            for j in 0..i {
                if self.concave(p, &members[i], &members[j]) {
                    beside[i] |= 1 << j;
                    beside[j] |= 1 << i;
                }
            }
        }
        beside
    }

    /// The greatest sets of patches that are concave to each other, as bits; without patches that are in no grid cell
    /// about the place and would not matter there, which leave `members`.
    pub(super) fn cliques(&self, p: Vec3, members: &mut Vec<Member>) -> Vec<u32> {
        let beside = self.meeting(p, members);
        let across = ACROSS * self.step;
        let mut i = 0;
        // Below all the others, or above one of any that it joins.
        let idle: Vec<bool> = members
            .iter()
            .zip(beside)
            .map(|(m, b)| (m.value < -across && b == 0) || (m.value > across && b != 0))
            .collect();
        members.retain(|_| {
            i += 1;
            i == 1 || !idle[i - 1]
        });
        let beside = self.meeting(p, members);
        let full = (1u32 << members.len()) - 1;
        let common = |set: u32| bits(set).fold(full, |w, i| w & beside[i]);
        (1..=full)
            .filter(|set| bits(*set).all(|i| set & !(1 << i) & !beside[i] == 0))
            .filter(|set| common(*set) & !set == 0)
            .collect()
    }
}
