//! The faces of a mesh with creases, each as smooth as the patches it consists of.
//!
//! Near a crease the solid is what the patches there make of it, each continued beyond its border by the planes of the
//! triangles at the border: all of them where the edge is convex, any where it is concave. Patches that are never near
//! each other share a face, a *color*, so there are few faces however many patches. Which patches join, and how, differs
//! from place to place; so the tree holds all the ways that occur, and faces that are constant but for their sign, the
//! *switches*, say which of them hold where:
//!
//!   All of (color, or off), for each color, and (any of some colors, or off), for each set that meets in concave edges.
//!
//! Every value is a function of position alone. What is off is so by a hair, what is on is so by a step: where a
//! condition ends between two nodes it holds nearly up to the farther one. At each node the faces together have the sign
//! of the distance, whatever the mesh is like; where they would not, the nearest patch decides alone.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex};

use super::patches::{self, Patches, TURN};
use super::tree::{self, Feature, Hit};
use super::{MeshRegion, NOTHING, check};
use crate::face::{Face, Tree};
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, add, cross, dot, norm, scale, sub, unit};

/// Nodes this near to the surface have values of the patches about them, in steps: more than a cell's diagonal.
const NEAR: f64 = 2.0;
/// Patches this near to a node are continued there, in steps: at a crease of `patches::TURN` a patch has left the grid
/// cells of the other one so far from it.
const REACH: f64 = 4.5;
/// Where they are farther than this as continued, more than a cell's diagonal, they may be left out.
const ACROSS: f64 = 1.75;
/// Most patches that are continued at one place.
const MOST: usize = 8;
/// Most colors, and most sets of them that meet in concave edges.
const COLORS: usize = 14;
const SETS: usize = 20;
/// Places that are looked at to find which patches meet.
const LOOKS: usize = 4_000;
/// How far colors that are off are so, in steps: the first this, the second twice as much, that no two change sign in one
/// plane. On is a step.
const OFF: f64 = 1.0 / 4096.0;
/// ... and switches, which often change between the same nodes.
const APART: f64 = 1.0 / 64.0;

/// The faces of a mesh for a grid of some step; `None` if there are no creases that it could show.
pub(super) fn faces(region: &Arc<MeshRegion>, step: f64, out: &mut Vec<Face>) -> Option<Tree> {
    if !step.is_finite() || region.winding.is_some() {
        return None;
    }
    let pairs = check::edges(&region.mesh).ok()?;
    let patches = patches::patches(&region.mesh, &pairs, step)?;
    let of = Arc::new(Creased::new(region.clone(), &patches, step));
    let mut face = |part: Part| {
        out.push(Face::distance(Arc::new(OfCrease {
            of: of.clone(),
            part,
        })));
        Tree::Face(out.len() - 1)
    };
    let colors: Vec<Tree> = (0..of.colors).map(|c| face(Part::Color(c))).collect();
    let mut all = Vec::new();
    for (c, color) in colors.iter().enumerate() {
        all.push(match of.switched[c] {
            true => Tree::Any(vec![color.clone(), face(Part::Alone(c))]),
            false => color.clone(),
        });
    }
    for (i, set) in of.sets.iter().enumerate() {
        let mut any: Vec<Tree> = bits(set.colors).map(|c| colors[c].clone()).collect();
        if set.switched {
            any.push(face(Part::Set(i)));
        }
        all.push(Tree::Any(any));
    }
    Some(Tree::All(all))
}

fn bits(mut word: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (word != 0).then(|| {
            let i = word.trailing_zeros() as usize;
            word &= word - 1;
            i
        })
    })
}

/// A node of the tree whose triangles are of several patches.
const MIXED: u32 = u32::MAX;
/// A triangle or corner that touches no border.
const INNER: u32 = u32::MAX;

/// How a triangle touches the border of its patch.
#[derive(Clone, Copy)]
struct Rim {
    /// For each edge on the border how far its continuation leans away, per mm; not a number for the others.
    lean: [f64; 3],
    /// For each corner on the border its fan.
    fan: [u32; 3],
}

/// The triangles of a patch at a corner on its border.
#[derive(Clone, Copy)]
struct Fan {
    normal: Vec3,
    /// Along the patch, away from its border.
    inward: Vec3,
    lean: f64,
}

/// The common border of two patches.
struct Seam {
    bounds: Aabb,
    /// Middles of its edges, and how much the solid bends inwards there: turn times length.
    edges: Vec<(Vec3, f64)>,
    /// Whether it is concave; none if it is so in part only.
    concave: Option<bool>,
}

/// Colors that meet in concave edges somewhere.
struct Set {
    colors: u32,
    /// Whether they also meet where the solid is not all that any of them holds.
    switched: bool,
}

/// A mesh region divided into patches, for one step of the grid.
struct Creased {
    region: Arc<MeshRegion>,
    step: f64,
    /// The patch of each triangle, in the tree's order, and of each of the tree's nodes.
    patch: Vec<u32>,
    nodes: Vec<u32>,
    rims: Vec<Rim>,
    rim: Vec<u32>,
    fans: Vec<Fan>,
    /// By the patches' numbers, the lower one first.
    seams: HashMap<(u32, u32), Seam>,
    /// The color of each patch.
    color: Vec<u8>,
    colors: usize,
    /// The colors that need not hold by themselves everywhere.
    switched: Vec<bool>,
    sets: Vec<Set>,
    /// What was found last, as the faces are asked one by one.
    boxes: Recent<(f64, u32)>,
    samples: Recent<Samples>,
}

/// A patch near some place.
#[derive(Clone, Copy)]
struct Member {
    patch: u32,
    /// The distance to the patch as continued, negative inside; and its gradient.
    value: f64,
    gradient: Vec3,
    /// Its nearest point, its normal there, and the way into it if that is on the border.
    foot: Vec3,
    normal: Vec3,
    inward: Vec3,
    lean: f64,
}

impl Member {
    /// The patch as it goes on beyond its nearest point, at `p`.
    fn continued(&self, p: Vec3) -> f64 {
        let v = sub(p, self.foot);
        let height = dot(v, self.normal);
        height + self.lean * lateral(v, height)
    }
}

/// The length of a vector beside its part of some height along a normal.
fn lateral(v: Vec3, height: f64) -> f64 {
    (dot(v, v) - height * height).max(0.0).sqrt()
}

/// The values of all faces at some place.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
struct Values {
    /// Colors of patches that are near, and their values; the others are off.
    colors: [(u8, f32); MOST],
    count: usize,
    /// Colors that hold by themselves and sets that hold, as bits.
    alone: u32,
    sets: u32,
}

impl Values {
    fn color(&self, c: usize, off: f32) -> f32 {
        let here = self.colors[..self.count].iter();
        here.filter(|(d, _)| usize::from(*d) == c)
            .map(|(_, v)| *v)
            .next()
            .unwrap_or(off)
    }
}

impl Creased {
    fn new(region: Arc<MeshRegion>, patches: &Patches, step: f64) -> Creased {
        let (tree, order) = (&region.tree, &region.order);
        let patch: Vec<u32> = order.iter().map(|t| patches.of[*t as usize]).collect();
        let mut nodes = vec![MIXED; tree.nodes().len()];
        for (i, n) in tree.nodes().iter().enumerate().rev() {
            nodes[i] = if n.count > 0 {
                let all = &patch[n.at as usize..(n.at + n.count) as usize];
                if all.iter().all(|p| *p == all[0]) {
                    all[0]
                } else {
                    MIXED
                }
            } else if nodes[i + 1] == nodes[n.at as usize] {
                nodes[i + 1]
            } else {
                MIXED
            };
        }
        let (rims, rim, fans) = rims(&region, patches);
        let mut creased = Creased {
            step,
            patch,
            nodes,
            rims,
            rim,
            fans,
            seams: seams(&region, patches),
            color: vec![0; patches.count],
            colors: 1,
            switched: vec![false],
            sets: Vec::new(),
            boxes: Recent::default(),
            samples: Recent::default(),
            region,
        };
        let places = places(&creased.region, patches, step);
        creased.paint(&places, patches.count);
        creased.survey(&places);
        creased
    }

    /// The value of a face that is off.
    fn off(&self, part: Part) -> f64 {
        let share = match part {
            Part::Color(c) => OFF * (c + 1) as f64,
            Part::Alone(c) => APART * (c + 1) as f64,
            Part::Set(s) => APART * (self.colors + s + 1) as f64,
        };
        -share * self.step
    }

    /// The nearest point of each patch within `reach` of a place, the nearest patch first.
    fn around(&self, p: Vec3, reach: f64, out: &mut Vec<Hit>) {
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
    fn member(&self, p: Vec3, hit: &Hit) -> Member {
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
    fn seam(&self, p: Vec3, a: u32, b: u32) -> Option<&Seam> {
        let seam = self.seams.get(&(a.min(b), a.max(b)));
        seam.filter(|s| s.bounds.distance(p) <= REACH * self.step)
    }

    /// Whether two patches near a place meet in a concave edge; or would, if they meet in a corner at most.
    fn concave(&self, p: Vec3, a: &Member, b: &Member) -> bool {
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
    fn heights(&self, a: &Member, b: &Member) -> [f64; 2] {
        let within = |m: &Member| add(m.foot, scale(m.inward, 0.5 * self.step));
        [b.continued(within(a)), a.continued(within(b))]
    }

    /// Whether two patches are the sides of a wall or a gap that a grid cell may hold.
    fn opposite(&self, a: &Member, b: &Member) -> bool {
        let [x, y] = self.heights(a, b);
        dot(a.normal, b.normal) < -0.5 && (x < 0.0) == (y < 0.0)
    }

    /// The patches about a place that meet the nearest one, which is the first, or are opposite to it: of different
    /// colors. Others are continued only where they are nearest themselves.
    fn members(&self, p: Vec3, hits: &[Hit]) -> Vec<Member> {
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
    fn meeting(&self, p: Vec3, members: &[Member]) -> [u32; MOST] {
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
    fn cliques(&self, p: Vec3, members: &mut Vec<Member>) -> Vec<u32> {
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

    /// The colors of some members.
    fn colors_of(&self, members: &[Member], set: u32) -> u32 {
        bits(set).fold(0, |w, i| w | 1 << self.color[members[i].patch as usize])
    }

    /// The values where the patches `members` are near and the sign is `inside`; `None` if the faces that there are
    /// cannot say so.
    fn joined(&self, p: Vec3, members: &mut Vec<Member>, inside: bool) -> Option<Values> {
        let cliques = self.cliques(p, members);
        let mut values = Values {
            count: members.len(),
            ..Values::default()
        };
        let mut near = 0u32;
        for (to, m) in values.colors.iter_mut().zip(&*members) {
            let color = self.color[m.patch as usize];
            *to = (color, m.value as f32);
            near |= 1 << color;
        }
        for clique in cliques {
            let colors = self.colors_of(members, clique);
            if colors.is_power_of_two() {
                values.alone |= colors;
            } else {
                values.sets |= 1 << self.sets.iter().position(|s| s.colors == colors)?;
            }
        }
        let off = bits(near & !values.alone);
        if off.into_iter().any(|c| !self.switched[c]) {
            return None;
        }
        for (i, s) in self.sets.iter().enumerate() {
            if s.colors & near == s.colors && values.sets >> i & 1 == 0 && !s.switched {
                let weaker = |t: &Set| t.colors & s.colors == t.colors;
                let held = values.alone & s.colors != 0
                    || bits(values.sets).any(|t| weaker(&self.sets[t]));
                if !held {
                    return None;
                }
            }
        }
        (self.solid(&values, near) == inside).then_some(values)
    }

    /// Whether the faces together are solid.
    fn solid(&self, values: &Values, near: u32) -> bool {
        let mut negative = !near;
        for (c, v) in &values.colors[..values.count] {
            negative |= u32::from(*v <= 0.0) << c;
        }
        negative & values.alone == values.alone
            && bits(values.sets).all(|s| negative & self.sets[s].colors != 0)
    }

    /// The values at a place whose patches nearby are `hits`, the nearest first, and whose signed distance is `d`.
    fn values_at(&self, p: Vec3, d: f64, hits: &[Hit]) -> (Values, Vec<Member>) {
        let mut members = self.members(p, hits);
        while members.len() > 1 {
            if let Some(v) = self.joined(p, &mut members, d <= 0.0) {
                return (v, members);
            }
            members.pop();
        }
        let mut values = Values {
            count: 1,
            ..Values::default()
        };
        if let Some(m) = members.first() {
            let color = self.color[m.patch as usize];
            values.colors[0] = (color, d as f32);
            values.alone = 1 << color;
        }
        (values, members)
    }

    /// Gives patches that are near each other different colors, as far as there are enough.
    fn paint(&mut self, places: &[Vec3], count: usize) {
        if count <= COLORS {
            self.color = (0..count as u8).collect();
            self.colors = count;
        } else {
            let mut beside: Vec<HashMap<u32, u32>> = vec![HashMap::new(); count];
            let mut hits = Vec::new();
            for p in places {
                self.around(*p, (REACH + NEAR) * self.step, &mut hits);
                for (i, a) in hits.iter().enumerate() {
                    for b in &hits[..i] {
                        let [a, b] = [a, b].map(|h| self.patch[h.triangle as usize]);
                        // The nearest ones matter most.
                        let weight = if i == 1 { 1000 } else { 1 };
                        *beside[a as usize].entry(b).or_default() += weight;
                        *beside[b as usize].entry(a).or_default() += weight;
                    }
                }
            }
            let mut order: Vec<usize> = (0..count).collect();
            order.sort_by_key(|i| std::cmp::Reverse(beside[*i].len()));
            let mut color = vec![u8::MAX; count];
            let mut used = [0usize; COLORS];
            for i in order {
                let mut cost = [0u64; COLORS];
                for (n, weight) in &beside[i] {
                    if let Some(c) = cost.get_mut(usize::from(color[*n as usize])) {
                        *c += u64::from(*weight);
                    }
                }
                let best = (0..COLORS)
                    .min_by_key(|c| (cost[*c], used[*c]))
                    .unwrap_or(0);
                color[i] = best as u8;
                used[best] += 1;
            }
            self.color = color;
            self.colors = COLORS;
        }
        self.switched = vec![false; self.colors];
    }

    /// Finds the ways in which patches meet.
    fn survey(&mut self, places: &[Vec3]) {
        let mut hits = Vec::new();
        let mut found: HashMap<u32, usize> = HashMap::new();
        let mut ways: HashMap<(u32, Vec<u32>), usize> = HashMap::new();
        for p in places {
            self.around(*p, REACH * self.step, &mut hits);
            let mut members = self.members(*p, &hits);
            let cliques = self.cliques(*p, &mut members);
            let near = self.colors_of(&members, (1 << members.len()) - 1);
            let held: Vec<u32> = cliques
                .iter()
                .map(|c| self.colors_of(&members, *c))
                .collect();
            for c in held.iter().filter(|c| !c.is_power_of_two()) {
                *found.entry(*c).or_default() += 1;
            }
            *ways.entry((near, held)).or_default() += 1;
        }
        let mut sets: Vec<(usize, u32)> = found.into_iter().map(|(s, n)| (n, s)).collect();
        sets.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        sets.truncate(SETS);
        self.sets = sets
            .into_iter()
            .map(|(_, colors)| Set {
                colors,
                switched: false,
            })
            .collect();
        for (near, held) in ways.keys() {
            let alone = held
                .iter()
                .filter(|c| c.is_power_of_two())
                .fold(0, |w, c| w | c);
            for c in bits(near & !alone) {
                self.switched[c] = true;
            }
            for s in &mut self.sets {
                let inside = s.colors & near == s.colors;
                s.switched |= inside && !held.iter().any(|h| h & s.colors == *h);
            }
        }
    }
}

/// Places at which patches may meet: at borders, some elsewhere on the surface, and beside all these.
fn places(region: &MeshRegion, patches: &Patches, step: f64) -> Vec<Vec3> {
    const BESIDE: [Vec3; 4] = [
        [0.0; 3],
        [1.3, 0.4, -0.7],
        [-0.8, 1.1, 0.5],
        [-0.5, -1.2, 0.9],
    ];
    let mesh = &region.mesh;
    let mut places = Vec::new();
    for e in patches
        .borders
        .iter()
        .step_by(patches.borders.len().div_ceil(LOOKS))
    {
        let (corners, k) = (
            mesh.corners(e.halves[0] as usize / 3),
            e.halves[0] as usize % 3,
        );
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        places.extend([a, scale(add(a, b), 0.5)]);
    }
    for i in (0..mesh.triangles.len()).step_by(mesh.triangles.len().div_ceil(LOOKS / 2)) {
        let [a, b, c] = mesh.corners(i);
        places.push(scale(add(a, add(b, c)), 1.0 / 3.0));
    }
    let beside = |p: Vec3| BESIDE.map(|b| add(p, scale(b, step)));
    places.into_iter().flat_map(beside).collect()
}

/// The borders that patches have in common.
fn seams(region: &MeshRegion, patches: &Patches) -> HashMap<(u32, u32), Seam> {
    /// The share of a border that may bend the other way.
    const STRAY: f64 = 0.02;
    let mut seams: HashMap<(u32, u32), Seam> = HashMap::new();
    for e in &patches.borders {
        let [a, b] = e.halves.map(|h| patches.of[h as usize / 3]);
        let (corners, k) = (
            region.mesh.corners(e.halves[0] as usize / 3),
            e.halves[0] as usize % 3,
        );
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let seam = seams.entry((a.min(b), a.max(b))).or_insert(Seam {
            bounds: Aabb::EMPTY,
            edges: Vec::new(),
            concave: None,
        });
        seam.bounds = seam.bounds.with(p).with(q);
        seam.edges
            .push((scale(add(p, q), 0.5), -e.turn * norm(sub(p, q))));
    }
    // Patches that have a corner in common only.
    let mut about: HashMap<u32, Vec<u32>> = HashMap::new();
    for e in &patches.borders {
        for h in e.halves {
            let (t, k) = (region.mesh.triangles[h as usize / 3], h as usize % 3);
            for v in [t[k], t[(k + 1) % 3]] {
                about.entry(v).or_default().push(patches.of[h as usize / 3]);
            }
        }
    }
    for (v, list) in &mut about {
        list.sort_unstable();
        list.dedup();
        for (i, a) in list.iter().enumerate() {
            for b in &list[..i] {
                let seam = seams.entry((*b, *a)).or_insert(Seam {
                    bounds: Aabb::EMPTY,
                    edges: Vec::new(),
                    concave: None,
                });
                seam.bounds = seam.bounds.with(region.mesh.vertices[*v as usize]);
            }
        }
    }
    for s in seams.values_mut().filter(|s| !s.edges.is_empty()) {
        let sum = |sign: f64| s.edges.iter().map(|e| (sign * e.1).max(0.0)).sum::<f64>();
        let (inwards, outwards) = (sum(1.0), sum(-1.0));
        if inwards.min(outwards) <= STRAY * (inwards + outwards) {
            s.concave = Some(inwards > outwards);
            s.edges = Vec::new();
        }
    }
    seams
}

/// The triangles that touch borders, in the tree's order; which one each triangle is; and the fans at the corners.
fn rims(region: &MeshRegion, patches: &Patches) -> (Vec<Rim>, Vec<u32>, Vec<Fan>) {
    let (mesh, tree) = (&region.mesh, &region.tree);
    let mut leans: HashMap<u32, f64> = HashMap::new();
    let mut on_border = vec![false; mesh.vertices.len()];
    for e in &patches.borders {
        // What turns less than it takes to be a crease is made to, so that the other patch leaves the surface.
        let more = (TURN.tan() - e.turn.abs().min(TURN).tan()).max(0.0);
        let lean = if e.turn >= 0.0 { -more } else { more };
        for h in e.halves {
            leans.insert(h, lean);
            let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
            on_border[t[k] as usize] = true;
            on_border[t[(k + 1) % 3] as usize] = true;
        }
    }
    let mut fans: Vec<Fan> = Vec::new();
    let mut counts: Vec<f64> = Vec::new();
    let mut names: HashMap<(u32, u32), u32> = HashMap::new();
    let (mut rims, mut rim) = (Vec::new(), vec![INNER; mesh.triangles.len()]);
    for (i, &t) in region.order.iter().enumerate() {
        let corners = mesh.triangles[t as usize];
        if !corners.iter().any(|v| on_border[*v as usize]) {
            continue;
        }
        let face = &tree.faces()[i];
        let lean = [0, 1, 2].map(|k| leans.get(&(3 * t + k)).copied().unwrap_or(f64::NAN));
        let mut fan = [INNER; 3];
        for k in 0..3 {
            if !on_border[corners[k] as usize] {
                continue;
            }
            let name = names
                .entry((corners[k], patches.of[t as usize]))
                .or_insert(fans.len() as u32);
            fan[k] = *name;
            if *name as usize == fans.len() {
                fans.push(Fan {
                    normal: [0.0; 3],
                    inward: [0.0; 3],
                    lean: 0.0,
                });
                counts.push(0.0);
            }
            let f = &mut fans[*name as usize];
            let [a, b, c] = [0, 1, 2].map(|j| face.corners[(k + j) % 3]);
            let (u, v) = (sub(b, a), sub(c, a));
            let angle = norm(cross(u, v)).atan2(dot(u, v));
            f.normal = add(f.normal, scale(face.normal, angle));
            f.inward = add(f.inward, scale(add(unit(u), unit(v)), angle));
            for l in [lean[k], lean[(k + 2) % 3]]
                .into_iter()
                .filter(|l| !l.is_nan())
            {
                f.lean += l;
                counts[*name as usize] += 1.0;
            }
        }
        rim[i] = rims.len() as u32;
        rims.push(Rim { lean, fan });
    }
    for (f, count) in fans.iter_mut().zip(counts) {
        f.normal = unit(f.normal);
        f.inward = unit(sub(f.inward, scale(f.normal, dot(f.inward, f.normal))));
        f.lean = if count > 0.0 { f.lean / count } else { 0.0 };
    }
    (rims, rim, fans)
}

/// Which of the faces.
#[derive(Clone, Copy)]
enum Part {
    /// The patches of a color.
    Color(usize),
    /// Where a color need not hold by itself, negative.
    Alone(usize),
    /// Where a set need not hold, negative.
    Set(usize),
}

/// A face of a mesh with creases.
struct OfCrease {
    of: Arc<Creased>,
    part: Part,
}

impl OfCrease {
    /// The value of the face by those of all. Far outside, the first color stands for all.
    fn pick(&self, values: &Values) -> f64 {
        let (on, off) = (self.of.step, self.of.off(self.part));
        let switch = |word: u32, i: usize| if word >> i & 1 == 1 { on } else { off };
        match self.part {
            Part::Color(c) => f64::from(values.color(c, off as f32)),
            Part::Alone(c) => switch(values.alone, c),
            Part::Set(s) => switch(values.sets, s),
        }
    }

    /// The value at distance `d` from the surface, where that is far: no matter how far, for it may not be known.
    fn far(&self, d: f64) -> f64 {
        match self.part {
            Part::Color(0) => (NEAR * self.of.step).copysign(d),
            Part::Alone(0) if d > 0.0 => self.of.step,
            _ => self.of.off(self.part),
        }
    }

    fn at(&self, p: Vec3, seed: &mut u32, hits: &mut Vec<Hit>) -> (f64, Vec3) {
        let (of, region) = (&*self.of, &*self.of.region);
        let hit = region.tree.nearest(p, *seed);
        *seed = hit.triangle;
        let d = region.signed(&hit, p, NOTHING);
        if d.abs() > NEAR * of.step {
            return (self.far(d), region.gradient(&hit, d));
        }
        if let Part::Color(c) = self.part {
            if usize::from(of.color[of.patch[hit.triangle as usize] as usize]) == c {
                let m = of.member(p, &hit);
                return (m.value, m.gradient);
            }
        }
        of.around(p, REACH * of.step, hits);
        let (values, members) = of.values_at(p, d, hits);
        let gradient = members
            .iter()
            .find(|m| matches!(self.part, Part::Color(c) if usize::from(of.color[m.patch as usize]) == c))
            .map_or(region.gradient(&hit, d), |m| m.gradient);
        (self.pick(&values), gradient)
    }
}

impl Field for OfCrease {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut seed, mut hits) = (0, Vec::new());
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.at(*p, &mut seed, &mut hits).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut seed, mut hits) = (0, Vec::new());
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            (*v, *g) = self.at(*p, &mut seed, &mut hits);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let of = &*self.of;
        let found = of.boxes.get(key(b.min, b.max), || {
            let d = of.region.value(b.center());
            let reach = norm(b.size()) / 2.0 * (1.0 + 1e-9);
            let colors = if d.abs() - reach > NEAR * of.step {
                0
            } else {
                of.colors_near(b)
            };
            (d, colors)
        });
        let ((d, colors), off) = (*found, of.off(self.part));
        let far = colors == 0;
        let live = match self.part {
            Part::Color(c) | Part::Alone(c) => c == 0 || colors >> c & 1 == 1,
            Part::Set(s) => of.sets[s].colors & !colors == 0,
        };
        match self.part {
            Part::Color(0) if far => of.region.bound(b),
            Part::Alone(0) if far && d > 0.0 => Interval::new(of.step, of.step),
            _ if !far && live => Interval::new(f64::NEG_INFINITY, f64::INFINITY),
            _ => Interval::new(off, off),
        }
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        if block.is_empty() {
            return;
        }
        let b = block.bounds();
        let shape = block.shape();
        let mut key = key(b.min, b.max);
        key.extend(shape.map(|n| n as u64));
        let s = self.of.samples.get(key, || Samples::new(&self.of, block));
        for (o, (d, tag)) in out.iter_mut().zip(s.distance.iter().zip(&s.tag)) {
            let color = usize::from(*tag);
            *o = match self.part {
                _ if *tag == FAR => self.far(f64::from(*d)) as f32,
                Part::Color(c) if c == color => *d,
                Part::Alone(c) if c == color => self.of.step as f32,
                _ => self.of.off(self.part) as f32,
            };
        }
        for (i, values) in &s.several {
            out[*i as usize] = self.pick(values) as f32;
        }
    }
}

fn key(a: Vec3, b: Vec3) -> Vec<u64> {
    a.iter().chain(&b).map(|x| x.to_bits()).collect()
}

impl Creased {
    /// The colors of the patches that may be near to a node of a box.
    fn colors_near(&self, b: &Aabb) -> u32 {
        let b = b.grown(REACH * self.step * (1.0 + 1e-9));
        let all = (1u32 << self.colors) - 1;
        let (tree, mut found) = (&self.region.tree, 1u32);
        let mut stack = vec![0u32];
        while let Some(i) = stack.pop() {
            let node = &tree.nodes()[i as usize];
            let patch = self.nodes[i as usize];
            let known = patch != MIXED && found >> self.color[patch as usize] & 1 == 1;
            if known || found == all || node.bounds.intersection(b).is_empty() {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.at, i + 1]);
                continue;
            }
            for k in node.at..node.at + node.count {
                let corners = tree.faces()[k as usize].corners;
                let own = corners.iter().fold(Aabb::EMPTY, |a, p| a.with(*p));
                if !own.intersection(b).is_empty() {
                    found |= 1 << self.color[self.patch[k as usize] as usize];
                }
            }
        }
        found
    }
}

/// Nodes with the values of no patch, and of several.
const FAR: u8 = u8::MAX;
const SEVERAL: u8 = u8::MAX - 1;

/// The values of all faces at the nodes of a block.
struct Samples {
    /// Signed distances; where they are large, numbers of their sign that are smaller but not too small.
    distance: Vec<f32>,
    /// The color of the only patch near to the node, or `FAR`, or `SEVERAL`.
    tag: Vec<u8>,
    several: Vec<(u32, Values)>,
}

impl Samples {
    fn new(of: &Creased, block: &Block) -> Samples {
        let mut fill = Fill {
            of,
            block,
            out: Samples {
                distance: vec![0.0; block.len()],
                tag: vec![FAR; block.len()],
                several: Vec::new(),
            },
            hits: Vec::new(),
        };
        fill.part([0; 3], block.shape(), 0);
        fill.out
    }
}

struct Fill<'a> {
    of: &'a Creased,
    block: &'a Block<'a>,
    out: Samples,
    hits: Vec<Hit>,
}

impl Fill<'_> {
    /// Fills the nodes from `lo` up to `hi`, `seed` being a triangle that may be near: halves them until they are far
    /// from the surface or few.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], seed: u32) {
        let (of, axes) = (self.of, self.block.axes);
        let ends = [0, 1, 2].map(|a| [axes[a][lo[a]], axes[a][hi[a] - 1]]);
        let center = ends.map(|[a, b]| a + (b - a) / 2.0);
        let size = ends.map(|[a, b]| b - a);
        let half = norm(size) / 2.0 * (1.0 + 1e-9);
        let hit = of.region.tree.nearest(center, seed);
        let d = of.region.signed(&hit, center, NOTHING);
        if d.abs() > half + NEAR * of.step {
            self.each(lo, hi, |fill, i, p| {
                fill.out.distance[i] = (d.abs() - norm(sub(p, center))).copysign(d) as f32;
            });
            return;
        }
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        if (0..3).map(|a| hi[a] - lo[a]).product::<usize>() > 8 && hi[longest] - lo[longest] > 1 {
            let middle = (lo[longest] + hi[longest]) / 2;
            let (mut end, mut begin) = (hi, lo);
            end[longest] = middle;
            begin[longest] = middle;
            self.part(lo, end, hit.triangle);
            self.part(begin, hi, hit.triangle);
            return;
        }
        let reach = REACH * of.step;
        let mut hits = std::mem::take(&mut self.hits);
        of.around(center, reach + half, &mut hits);
        let single = hits.len() < 2;
        let mut seed = hit.triangle;
        self.each(lo, hi, |fill, i, p| {
            let hit = of.region.tree.nearest(p, seed);
            seed = hit.triangle;
            let d = of.region.signed(&hit, p, NOTHING);
            fill.out.distance[i] = d as f32;
            if d.abs() > NEAR * of.step {
                return;
            }
            if !single {
                of.around(p, reach, &mut hits);
            }
            if single || hits.len() < 2 {
                fill.out.tag[i] = of.color[of.patch[hit.triangle as usize] as usize];
                return;
            }
            fill.out.tag[i] = SEVERAL;
            let values = of.values_at(p, d, &hits).0;
            fill.out.several.push((i as u32, values));
        });
        self.hits = hits;
    }

    fn each(&mut self, lo: [usize; 3], hi: [usize; 3], mut at: impl FnMut(&mut Self, usize, Vec3)) {
        let [nx, ny, _] = self.block.shape();
        let [xs, ys, zs] = self.block.axes;
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    at(self, (k * ny + j) * nx + i, [xs[i], ys[j], zs[k]]);
                }
            }
        }
    }
}

/// The last few things that were computed.
struct Recent<T>(Mutex<VecDeque<(Vec<u64>, Arc<T>)>>);

impl<T> Default for Recent<T> {
    fn default() -> Recent<T> {
        Recent(Mutex::new(VecDeque::new()))
    }
}

impl<T> Recent<T> {
    /// What belongs to a key, made if it is not at hand.
    fn get(&self, key: Vec<u64>, make: impl FnOnce() -> T) -> Arc<T> {
        let held =
            |q: &VecDeque<(Vec<u64>, Arc<T>)>| q.iter().find(|e| e.0 == key).map(|e| e.1.clone());
        if let Some(known) = self.0.lock().ok().and_then(|q| held(&q)) {
            return known;
        }
        let new = Arc::new(make());
        if let Ok(mut q) = self.0.lock() {
            while q.len() > rayon::current_num_threads() {
                q.pop_front();
            }
            q.push_back((key, new.clone()));
        }
        new
    }
}
