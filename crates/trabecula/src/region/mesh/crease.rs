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

use std::collections::HashMap;
use std::sync::Arc;

use super::patches::{self, Patches};
use super::tree::Hit;
use super::{MeshRegion, check};
use crate::face::{Face, Tree};
use crate::math::Vec3;

mod border;
mod near;
mod sample;
mod survey;

use border::{Fan, Rim, Seam, rims, seams};
use near::Member;
use sample::{OfCrease, Recent, Samples};
use survey::places;

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
