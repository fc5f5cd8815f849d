//! Columns of prisms between nodes of the boundary and where these are pushed to, and their shapes.
//!
//! Nodes are pushed where the mesh leaves room. Columns with badly shaped tetrahedra then are tilted and shortened, each as a whole, while
//! their shapes improve: at sharp edges, where columns lean and the prisms' inner ends are small, and where neighbours are
//! of very different lengths. The mesh beneath is improved in between.

use schemars::JsonSchema;
use serde::Serialize;

use super::node_surfaces::{SurfaceSet, onto};
use super::shaping::{POOR, Shaping};
use super::tet_shape::{shape, shapes};
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;

/// What layers are made of.
#[derive(Default)]
pub(crate) struct FilledLayers {
    /// The nodes of each column, from the boundary inwards.
    pub columns: Vec<Vec<u32>>,
    /// The number of the first tetrahedron; others follow.
    pub first: usize,
    /// The shape that each shall have.
    pub wanted: Vec<f64>,
}

/// Layers of prisms along the surface of a tetrahedral mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "LayersMade")]
pub struct MadeLayers {
    /// Number of prisms and wedges, each cut into tetrahedra.
    pub prisms: usize,
    /// Mean over their area of their heights in those asked for, where layers do not taper to their end.
    pub mean: f64,
    /// Share of that area where they are lower than nine tenths of these.
    pub lower: f64,
    /// The least of these heights.
    pub least: f64,
    /// Where it is, mm.
    pub at: [f64; 3],
}

/// Rounds of pushing and improvement, and the parts of the way that are tried in each.
const ROUNDS: usize = 24;
const STEPS: [f64; 3] = [0.25, 0.125, 0.0625];
/// What a height may be short of the whole, of rounding.
const WHOLE: f64 = 1e-9;
/// Rounds of changing columns, and the lengths of the changes that are tried, as fractions of the way asked for.
const SETTLED: usize = 12;
const CHANGES: [f64; 4] = [0.3, 0.15, 0.08, 0.04];
/// The least relative gain.
const GAIN: f64 = 1.02;
/// The shape that a tetrahedron of a column shall have, in those of the right prism as high as it is asked to be.
const ENOUGH: f64 = 0.7;
/// The greatest height of layers in the one asked for, where columns are tilted.
const HIGHEST: f64 = 1.1;
/// The least part of a way that is along the normal of a face, for its height to count.
const LEAST: f64 = 0.05;
/// Layers that are lower than this, in the height asked for, count as lower.
const NEARLY: f64 = 0.9;
/// Steps of the measure by which columns are ordered.
const LEANING: f64 = 8.0;

/// A node of the boundary that is pushed inwards.
pub(super) struct PushedNode {
    pub node: u32,
    /// Where it was, and where it is to go.
    pub from: Vec3,
    pub by: Vec3,
    /// The surfaces along which it moves.
    pub along: SurfaceSet,
    /// The way that it has gone.
    pub way: Vec3,
    /// How high layers are at its end, in the height asked for: less than 1 only where the way would be too long.
    pub reach: f64,
}

impl PushedNode {
    /// The position at a level of its column, 0 at the boundary and 1 at its end; `None` if that is on none of its surfaces.
    pub fn at(&self, shaping: &Shaping, way: Vec3, level: f64) -> Option<Vec3> {
        let p = add(self.from, scale(way, level));
        if self.along == 0 || level <= 0.0 { Some(p) } else { onto(shaping.surfaces, self.along, p, norm(self.by)) }
    }

    pub fn is_pushed(&self) -> bool {
        self.way != [0.0; 3]
    }
}

/// The numbers of a face's columns in ascending order, and whether these too are counter-clockwise seen from outside.
pub(super) fn ascending([a, b, c]: [usize; 3]) -> ([usize; 3], bool) {
    let mut sorted = [a, b, c];
    sorted.sort_unstable();
    (sorted, [[a, b, c], [b, c, a], [c, a, b]].contains(&sorted))
}

/// The three tetrahedra of a prism over a face, between two levels of its columns in ascending order; of negative volume where these are
/// counter-clockwise seen from outside.
pub(super) fn staircase<T: Copy>([a, b, c]: [[T; 2]; 3]) -> [[T; 4]; 3] {
    [[a[0], b[0], c[0], c[1]], [b[0], a[0], b[1], c[1]], [a[0], a[1], b[1], c[1]]]
}

pub(super) fn has_twice<T: PartialEq>(corners: &[T; 4]) -> bool {
    (0..4).any(|i| (0..i).any(|j| corners[i] == corners[j]))
}

/// The columns over faces of the boundary.
pub(super) struct Columns {
    /// In the order by which quadrilaterals between prisms are cut: those that lean towards their faces most, as at sharp edges, come last,
    /// so that the obtuse angle there is the one that is cut.
    pub pushed: Vec<PushedNode>,
    /// The faces by the numbers of their columns, counter-clockwise seen from outside.
    pub faces: Vec<[usize; 3]>,
    /// Levels of the ends of layers, from 0 to 1.
    pub levels: Vec<f64>,
    /// The faces at each column.
    around: Vec<Vec<u32>>,
    /// The shapes that the tetrahedra over each face shall have, by their least and by their greatest angle.
    pub wanted: Vec<[f64; 2]>,
    /// The normal of each face at each column over the part of the way asked for that is along it.
    across: Vec<Vec<Vec3>>,
}

impl Columns {
    pub fn new(mut pushed: Vec<PushedNode>, chosen: &[[u32; 3]], ends: &[f64], shaping: &Shaping) -> Columns {
        let depth = ends.last().copied().unwrap_or(1.0);
        let levels: Vec<f64> = core::iter::once(0.0).chain(ends.iter().map(|e| e / depth)).collect();
        let mut number = vec![usize::MAX; shaping.nodes.len()];
        let mut numbered = |pushed: &[PushedNode]| {
            pushed.iter().enumerate().for_each(|(i, p)| number[p.node as usize] = i);
            chosen.iter().map(|f| f.map(|n| number[n as usize])).collect::<Vec<_>>()
        };
        // The mean of the ways along the faces, over the depth.
        let mut leaning = vec![(0.0, 0.0); pushed.len()];
        for f in numbered(&pushed) {
            let middle = scale(f.iter().fold([0.0; 3], |s, i| add(s, pushed[*i].from)), 1.0 / 3.0);
            for i in f {
                let p = &pushed[i];
                leaning[i].0 += dot(p.by, unit(sub(middle, p.from))) / depth;
                leaning[i].1 += 1.0;
            }
        }
        let by_node: Vec<(i64, u32)> =
            leaning.iter().zip(&pushed).map(|((sum, n), p)| ((LEANING * sum / n).round() as i64, p.node)).collect();
        let mut key = vec![0; shaping.nodes.len()];
        by_node.iter().for_each(|(k, n)| key[*n as usize] = *k);
        pushed.sort_by_key(|p| (key[p.node as usize], p.node));
        let faces = numbered(&pushed);
        let mut around = vec![Vec::new(); pushed.len()];
        for (f, face) in (0..).zip(&faces) {
            face.iter().for_each(|i| around[*i].push(f));
        }
        let corners = |f: &[usize; 3]| f.map(|i| pushed[i].from);
        let wanted = faces.iter().map(|f| wanted(corners(f), ends)).collect();
        let across = |(p, around): (&PushedNode, &Vec<u32>)| {
            let normals = around.iter().map(|f| inwards(corners(&faces[*f as usize])));
            let along = normals.map(|n| (n, dot(n, p.by))).filter(|(_, along)| *along > LEAST * norm(p.by));
            along.map(|(n, along)| scale(n, 1.0 / along)).collect()
        };
        let across = pushed.iter().zip(&around).map(across).collect();
        Columns { pushed, faces, levels, around, wanted, across }
    }

    /// How high the layers at a column are, in the height asked for: where they are lowest; and highest.
    pub fn heights(&self, column: usize, way: Vec3) -> [f64; 2] {
        if way == self.pushed[column].by {
            return [1.0; 2];
        }
        let each = self.across[column].iter().map(|n| dot(*n, way));
        each.fold([f64::INFINITY, 0.0], |[lo, hi], h| [h.min(lo), h.max(hi)])
    }

    /// The layers that were made, of this number of prisms.
    pub fn made(&self, prisms: usize) -> MadeLayers {
        let mut made = MadeLayers { prisms, mean: 0.0, lower: 0.0, least: f64::INFINITY, at: [0.0; 3] };
        let (mut area, mut first) = (0.0, u32::MAX);
        for (i, p) in self.pushed.iter().enumerate().filter(|(_, p)| norm(p.by) > 0.0) {
            let height = if p.is_pushed() { p.reach * self.heights(i, p.way)[0].min(1.0) } else { 0.0 };
            let each = self.around[i].iter().map(|f| self.faces[*f as usize].map(|i| self.pushed[i].from));
            let about = each.map(|[a, b, c]| norm(cross(sub(b, a), sub(c, a))) / 6.0).sum::<f64>();
            area += about;
            made.mean += about * height;
            made.lower += if height < NEARLY { about } else { 0.0 };
            if height < made.least || height == made.least && p.node < first {
                (made.least, made.at, first) = (height, p.from, p.node);
            }
        }
        made.mean /= area;
        made.lower /= area;
        made
    }

    /// Whether layers may be as high as they are where a column goes this way.
    fn may_be(&self, column: usize, way: Vec3) -> bool {
        let [lowest, highest] = self.heights(column, way);
        lowest > 0.0 && lowest <= 1.0 && highest <= HIGHEST
    }

    /// How far tetrahedra over the faces at a column are from the shapes that they shall have; infinite if it is more than `most`.
    fn cost(&self, column: usize, shaping: &Shaping, most: f64) -> f64 {
        let mut sum = 0.0;
        for f in &self.around[column] {
            sum += self.cost_over(*f as usize, shaping, most - sum);
            if sum > most {
                return f64::INFINITY;
            }
        }
        sum
    }

    /// How far tetrahedra over a face are from the shapes that they shall have, but for those of which two corners are one; infinite if it
    /// is more than `most`.
    fn cost_over(&self, face: usize, shaping: &Shaping, most: f64) -> f64 {
        let (sorted, outward) = ascending(self.faces[face]);
        let columns = sorted.map(|i| &self.pushed[i]);
        let mut sum = 0.0;
        let mut lower = columns.map(|p| p.from);
        for (k, level) in self.levels.iter().enumerate().skip(1) {
            let mut upper = lower;
            for (p, at) in columns.iter().zip(&mut upper) {
                let Some(p) = p.at(shaping, p.way, *level) else { return f64::INFINITY };
                *at = p;
            }
            // Each position with a number: both ends of a node that was not pushed are one.
            let ends = core::array::from_fn(|c| {
                let end = if columns[c].is_pushed() { k } else { 0 };
                [(3 * end.saturating_sub(1) + c, lower[c]), (3 * end + c, upper[c])]
            });
            for mut corners in staircase(ends) {
                if outward {
                    corners.swap(0, 1);
                }
                if !has_twice(&corners.map(|c| c.0)) {
                    let found = shapes(corners.map(|c| c.1));
                    sum += found.iter().zip(self.wanted[face]).map(|(s, wanted)| short_of(*s, wanted)).sum::<f64>();
                }
            }
            if sum > most {
                return f64::INFINITY;
            }
            lower = upper;
        }
        sum
    }
}

/// What a shape is short of the one wanted: nothing to infinite, where there is no volume.
fn short_of(shape: f64, wanted: f64) -> f64 {
    if shape <= 0.0 { f64::INFINITY } else { (wanted / shape - 1.0).max(0.0).powi(2) }
}

/// The shapes that tetrahedra over a face shall have: those of the worst of right prisms, less a part, but no better than is fair. Low prisms
/// have small angles, which is no reason for obtuse ones.
fn wanted(face: [Vec3; 3], ends: &[f64]) -> [f64; 2] {
    let inwards = inwards(face);
    let mut worst = [f64::INFINITY; 2];
    let mut before = 0.0;
    for end in ends {
        let prism = face.map(|p| [p, add(p, scale(inwards, end - before))]);
        for mut corners in staircase(prism) {
            corners.swap(0, 1);
            let found = shapes(corners);
            worst = [worst[0].min(found[0]), worst[1].min(found[1])];
        }
        before = *end;
    }
    worst.map(|w| (ENOUGH * w).clamp(f64::MIN_POSITIVE, POOR))
}

/// The unit normal of a face.
fn inwards([a, b, c]: [Vec3; 3]) -> Vec3 {
    unit(cross(sub(c, a), sub(b, a)))
}

impl Shaping<'_> {
    /// Pushes nodes inwards, those at sharp edges first, while shapes beneath stay fair, and those of columns too if that is asked, else
    /// while these have volume; improves shapes in between.
    pub(super) fn push(&mut self, columns: &mut Columns, fair: bool) {
        for _ in 0..ROUNDS {
            checkpoint();
            let (mut moved, mut left) = (false, false);
            for i in (0..columns.pushed.len()).rev() {
                let (before, by) = (columns.pushed[i].way, columns.pushed[i].by);
                if before == by {
                    continue;
                }
                let beneath = self.cost_beneath(columns.pushed[i].node, [0.0; 3]);
                let over = if fair { columns.cost(i, self, f64::INFINITY) } else { f64::MAX };
                let mut may = |step: f64| {
                    let way = add(before, scale(by, step));
                    let whole = columns.heights(i, way)[0] >= 1.0 - WHOLE;
                    let way = if whole { by } else { way };
                    if !columns.may_be(i, way) {
                        return None;
                    }
                    columns.pushed[i].way = way;
                    let p = &columns.pushed[i];
                    let to = p.at(self, way, 1.0)?;
                    let fits = self.cost_beneath(p.node, sub(to, self.nodes[p.node as usize])) <= beneath;
                    (fits && columns.cost(i, self, over) <= over).then_some(to)
                };
                match STEPS.iter().find_map(|s| may(*s)) {
                    Some(to) => {
                        self.put(columns.pushed[i].node, to);
                        moved = true;
                    }
                    None => columns.pushed[i].way = before,
                }
                left |= columns.pushed[i].way != by;
            }
            if !moved {
                break;
            }
            self.improve(&|| true);
            if !left {
                break;
            }
        }
    }

    /// Changes columns with badly shaped tetrahedra while that improves them, and the shapes beneath in between.
    pub(super) fn settle(&mut self, columns: &mut Columns) {
        for _ in 0..SETTLED {
            checkpoint();
            let mut moved = false;
            for i in 0..columns.pushed.len() {
                if norm(columns.pushed[i].by) > 0.0 {
                    moved |= self.change_column(columns, i);
                }
            }
            if !moved {
                break;
            }
            self.improve(&|| true);
        }
    }

    /// Changes a column so that the tetrahedra at it and beneath are nearer to the shapes that they shall have; whether it did.
    fn change_column(&mut self, columns: &mut Columns, i: usize) -> bool {
        let (node, by, start) = (columns.pushed[i].node, columns.pushed[i].by, columns.pushed[i].way);
        let here = self.nodes[node as usize];
        let before = columns.cost(i, self, f64::INFINITY) + self.cost_beneath(node, [0.0; 3]);
        if before <= 0.0 {
            return false;
        }
        let around = (0..27).filter(|i| *i != 13).map(|i: i32| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1].map(f64::from));
        let directions: Vec<Vec3> = around.chain([by, scale(by, -1.0)]).map(unit).collect();
        let (mut best, mut found) = (before / GAIN, None);
        for step in CHANGES {
            for d in &directions {
                let way = add(start, scale(*d, step * norm(by)));
                if !columns.may_be(i, way) {
                    continue;
                }
                columns.pushed[i].way = way;
                let p = &columns.pushed[i];
                let Some(to) = p.at(self, way, 1.0) else { continue };
                let beneath = self.cost_beneath(node, sub(to, here));
                let cost = if beneath < best { beneath + columns.cost(i, self, best - beneath) } else { f64::INFINITY };
                if cost < best {
                    (best, found) = (cost, Some((way, to)));
                }
            }
        }
        columns.pushed[i].way = found.map_or(start, |f| f.0);
        if let Some((_, to)) = found {
            self.put(node, to);
        }
        found.is_some()
    }

    /// How far the tetrahedra at a node are from fair shapes if it is displaced.
    fn cost_beneath(&self, node: u32, by: Vec3) -> f64 {
        let moved = |m: u32| if m == node { add(self.nodes[m as usize], by) } else { self.nodes[m as usize] };
        let shapes = self.around[node as usize].iter().map(|t| shape(self.tets[*t as usize].map(moved)));
        shapes.map(|s| short_of(s, POOR)).sum()
    }

    /// Puts a node elsewhere.
    fn put(&mut self, node: u32, to: Vec3) {
        self.nodes[node as usize] = to;
        for t in &self.around[node as usize] {
            self.shapes[*t as usize] = shape(self.tets[*t as usize].map(|n| self.nodes[n as usize]));
        }
    }
}
