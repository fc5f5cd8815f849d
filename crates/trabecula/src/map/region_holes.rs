//! Lines through the holes of a region, round which phases may grow by whole numbers of cells.
//!
//! They are where the closed cochains of the region, carried on outside, cannot be closed (`cohomology`): runs of faces of the grid,
//! each with what a turn round it counts. A basis in which each hole has a number of its own is taken from the longest runs.

use std::collections::BTreeMap;

use super::cohomology::{Cohomology, cohomology, holes, reduce};
use super::phase_grid::PhaseGrid;
use super::winding::{Filament, to_segment};
use crate::field::Field;
use geometry::math::{Vec3, add, cross, dot, eigen, norm, scale, sin_cos_turns, sub};

/// Nodes within this many steps of the region count as inside, so that what is thinner than the grid has no holes of its own.
const REACH: f64 = 0.5;
/// A run whose faces are within this many steps of a straight line is one.
const STRAIGHT: f64 = 1.5;
/// Rays to the sides of a hole from its middle, steps along each at most, and how often the middle is taken anew.
const RAYS: usize = 32;
const STEPS: usize = 200;
const CENTERINGS: usize = 8;
/// The most holes that phases close round: each takes one more solution.
pub(super) const MOST: usize = 16;

/// A hole of the region: lines that a turn round it goes round once.
pub(super) struct Hole {
    pub lines: Vec<Filament>,
}

/// Where holes are looked for: a region on a grid, with the distance from it at each node.
pub(super) struct HoleSearch<'a> {
    pub grid: &'a PhaseGrid,
    pub depth: &'a [f64],
    pub region: &'a dyn Field,
}

impl HoleSearch<'_> {
    fn step(&self) -> f64 {
        self.grid.step.into_iter().fold(0.0, f64::max)
    }

    fn inside(&self) -> Vec<bool> {
        let reach = REACH * self.step();
        self.depth.iter().map(|d| *d <= reach).collect()
    }

    /// The number of holes that the grid sees.
    pub fn count(&self) -> usize {
        holes(self.grid, &self.inside())
    }

    /// The holes that the grid sees.
    pub fn all(&self) -> Vec<Hole> {
        let mut found = cohomology(self.grid, &self.inside());
        rebase(self.grid, &mut found);
        let shape = SampledRegion { grid: self.grid, region: self.region, step: self.step() };
        let lines = |found: &Cohomology, k: usize| -> Vec<Filament> {
            runs(self.grid, found, k).iter().map(|run| shape.filament(run)).collect()
        };
        let mut all = Vec::new();
        for k in 0..found.holes {
            let mut hole = lines(&found, k);
            // In the sense of the axis that it is nearest to.
            let along = hole.first().map_or([0.0; 3], |line| line.place().1);
            if along.into_iter().fold(0.0, |m: f64, v| if v.abs() > m.abs() + 1e-6 { v } else { m }) < 0.0 {
                found.pierced.values_mut().for_each(|v| v[k] = -v[k]);
                hole = lines(&found, k);
            }
            all.push(Hole { lines: hole });
        }
        all.retain(|hole| !hole.lines.is_empty());
        all
    }
}

/// The cells below and above a face, by their first nodes; `None` beyond the grid.
fn sides(grid: &PhaseGrid, face: usize) -> [Option<usize>; 2] {
    grid.cells_of_face(face / 3, face % 3)
}

/// Changes the basis so that long runs of faces are round one hole each.
fn rebase(grid: &PhaseGrid, found: &mut Cohomology) {
    // Runs between cubes where others join, and how many faces they have.
    let mut cubes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for face in found.pierced.keys() {
        sides(grid, *face).into_iter().flatten().for_each(|cube| cubes.entry(cube).or_default().push(*face));
    }
    let faces: Vec<usize> = found.pierced.keys().copied().collect();
    let number: BTreeMap<usize, u32> = faces.iter().zip(0..).map(|(f, i)| (*f, i)).collect();
    let mut root = geometry::union_find::singles(faces.len());
    for pair in cubes.values().filter(|f| f.len() == 2) {
        geometry::union_find::unite(&mut root, number[&pair[0]], number[&pair[1]]);
    }
    let mut length: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for (i, face) in (0..).zip(&faces) {
        length.entry(geometry::union_find::find(&mut root, i)).or_insert((0, *face)).0 += 1;
    }
    let mut long: Vec<(usize, usize)> = length.into_values().collect();
    long.sort_by_key(|(n, face)| (core::cmp::Reverse(*n), *face));
    // Columns of the new basis: those that are settled, then those that may change.
    let unit = |i: usize| (0..found.holes).map(|j| i64::from(i == j)).collect::<Vec<i64>>();
    let mut columns: Vec<Vec<i64>> = (0..found.holes).map(unit).collect();
    let of = |v: &[i64], c: &Vec<i64>| v.iter().zip(c).map(|(v, c)| v * c).sum::<i64>();
    let mut settled = 0;
    for (_, face) in long {
        let v = &found.pierced[&face];
        let (mut tried, from) = (columns.clone(), settled);
        let mut values: Vec<i64> = tried[from..].iter().map(|c| of(v, c)).collect();
        let Some(pivot) = reduce(&mut tried[from..], &mut values).filter(|p| values[*p].abs() == 1) else { continue };
        let sign = values[pivot];
        tried[from + pivot].iter_mut().for_each(|c| *c *= sign);
        tried.swap(from, from + pivot);
        // The others are zero round this run.
        let own = tried[from].clone();
        for c in &mut tried[..from] {
            let times = of(v, c);
            c.iter_mut().zip(&own).for_each(|(c, o)| *c -= times * o);
        }
        (columns, settled) = (tried, settled + 1);
    }
    for v in found.pierced.values_mut() {
        *v = columns.iter().map(|c| of(v, c)).collect();
    }
}

/// Faces in the order of a line through them, each with the sense in which it is passed.
type FaceSequence = Vec<(usize, bool)>;

/// The lines of a hole: through the grid from beyond it to beyond it, or closed.
fn runs(grid: &PhaseGrid, found: &Cohomology, k: usize) -> Vec<FaceSequence> {
    let mut left: BTreeMap<usize, i64> =
        found.pierced.iter().map(|(f, v)| (*f, v[k])).filter(|(_, v)| *v != 0).collect();
    let mut runs = Vec::new();
    let enters = |face: usize, flow: i64| {
        let [below, above] = sides(grid, face);
        if flow > 0 { (below, above) } else { (above, below) }
    };
    loop {
        let start = left.iter().find(|(f, v)| enters(**f, **v).0.is_none()).or(left.iter().next());
        let Some((mut face, mut flow)) = start.map(|(f, v)| (*f, *v)) else { return runs };
        let first = enters(face, flow).0;
        let mut run = FaceSequence::new();
        loop {
            run.push((face, flow > 0));
            let rest = flow - flow.signum();
            if rest == 0 {
                left.remove(&face);
            } else {
                left.insert(face, rest);
            }
            let Some(cube) = enters(face, flow).1.filter(|c| Some(*c) != first) else { break };
            // Straight on where that is possible.
            let s = grid.strides();
            let out = (0..3).flat_map(|c| [(3 * (cube + s[c]) + c, 1), (3 * cube + c, -1)]);
            let out = out.filter_map(|(f, sign)| left.get(&f).filter(|v| *v * sign > 0).map(|v| (f, *v)));
            let next = out.min_by_key(|(f, v)| (f % 3 != face % 3 || v.signum() != flow.signum(), *f));
            let Some(next) = next else { break };
            (face, flow) = next;
        }
        runs.push(run);
    }
}

/// What lines are measured against.
struct SampledRegion<'a> {
    grid: &'a PhaseGrid,
    region: &'a dyn Field,
    step: f64,
}

impl SampledRegion<'_> {
    /// The line through the middles of faces: straight where it nearly is, or else with as few points as follow it within a step.
    fn filament(&self, run: &FaceSequence) -> Filament {
        let points: Vec<Vec3> = run.iter().map(|(f, _)| self.grid.face_middle(f / 3, f % 3)).collect();
        let along = |(face, up): (usize, bool), out: f64| {
            let mut d = [0.0; 3];
            d[face % 3] = if up { out } else { -out };
            d
        };
        let beyond =
            |(face, up): (usize, bool), side: usize| sides(self.grid, face)[if up { side } else { 1 - side }].is_none();
        let (first, last) = (run[0], run[run.len() - 1]);
        if !(beyond(first, 0) && beyond(last, 1)) {
            return Filament::bent(self.simplified(&points, true), None);
        }
        // Along an axis of the grid where that is one, so that few faces in a thin plate do not turn it.
        let tried = [along(first, 1.0), fitted(&points, sub(points[points.len() - 1], points[0]))];
        if let Some(line) = tried.into_iter().find_map(|d| self.straight(&points, d)) {
            return line;
        }
        Filament::bent(self.simplified(&points, false), Some([along(first, -1.0), along(last, 1.0)]))
    }

    /// The straight line in a direction through the middle of the hole along points. `None` where they are not near one, or it meets the
    /// region.
    fn straight(&self, points: &[Vec3], along: Vec3) -> Option<Filament> {
        let off = |p: &Vec3, c: Vec3, d: Vec3| norm(cross(sub(*p, c), d));
        let center = mean(points);
        if points.iter().any(|p| off(p, center, along) > STRAIGHT * self.step) {
            return None;
        }
        let inner: Vec<Vec3> = points.iter().filter_map(|p| self.centered(*p, along)).collect();
        let center = if inner.is_empty() { center } else { mean(&inner) };
        // Sections of a round hole have their middles on its axis, whichever way they are cut.
        let spans = |from: &Vec3| inner.iter().map(|p| norm(sub(*p, *from))).fold(0.0, f64::max);
        let long = inner.first().is_some_and(|from| spans(from) >= 2.0 * self.step);
        let along = if long { fitted(&inner, along) } else { along };
        let reach = |p: &Vec3| dot(sub(*p, center), along).abs();
        let far = points.iter().map(reach).fold(self.step, f64::max);
        let steps = (4.0 * far / self.step).ceil();
        let on = (0..=steps as usize).map(|i| add(center, scale(along, far * (2.0 * i as f64 / steps - 1.0))));
        let clear = on.into_iter().all(|p| self.region.value(p) > 0.0);
        let near = points.iter().all(|p| off(p, center, along) <= 2.0 * STRAIGHT * self.step);
        (clear && near).then(|| Filament::straight(center, along))
    }

    /// The middle of the hole round `p` in the plane across `along`; `None` where the region does not surround `p` there.
    fn centered(&self, p: Vec3, along: Vec3) -> Option<Vec3> {
        let Filament::Straight { frame: [x, y, _], .. } = Filament::straight(p, along) else { return None };
        let mut at = p;
        for _ in 0..CENTERINGS {
            let mut sum = [0.0; 3];
            for i in 0..RAYS {
                let (s, c) = sin_cos_turns(i as f64 / RAYS as f64);
                let d = add(scale(x, c), scale(y, s));
                sum = add(sum, scale(d, self.way(at, d)?));
            }
            // Of a circle of radius R round c the way from p is R + (c − p) · d, to first order.
            at = add(at, scale(sum, 2.0 / RAYS as f64));
        }
        (norm(sub(at, p)) <= 2.0 * STRAIGHT * self.step).then_some(at)
    }

    /// The way from a point to the region in a direction, by steps that nothing is nearer than.
    fn way(&self, p: Vec3, d: Vec3) -> Option<f64> {
        let longest = norm(self.grid.step.map(|h| h * self.grid.shape.into_iter().max().unwrap_or(0) as f64));
        let (mut t, least) = (0.0, 1e-9 * self.step);
        for _ in 0..STEPS {
            let value = self.region.value(add(p, scale(d, t)));
            if value <= least {
                return Some(t);
            }
            t += value;
            if t > longest {
                return None;
            }
        }
        Some(t)
    }

    /// Points of a line that follow all within a step and stay as far from the region as a step allows (Ramer, Douglas and Peucker).
    fn simplified(&self, points: &[Vec3], closed: bool) -> Vec<Vec3> {
        let mut all = points.to_vec();
        if closed {
            // From one point and the farthest from it.
            let from = |i: usize| norm(sub(points[i], points[0]));
            let far = (0..points.len()).fold(0, |m, i| if from(i) > from(m) { i } else { m });
            all.push(points[0]);
            let mut kept = self.kept(&all[..=far]);
            kept.pop();
            kept.extend(self.kept(&all[far..]));
            kept.pop();
            return if kept.len() < 3 { points.to_vec() } else { kept };
        }
        self.kept(&all)
    }

    fn kept(&self, points: &[Vec3]) -> Vec<Vec3> {
        let n = points.len();
        if n < 3 {
            return points.to_vec();
        }
        let (a, b) = (points[0], points[n - 1]);
        let off = |i: usize| to_segment(points[i], a, b);
        let far = (1..n - 1).fold(1, |m, i| if off(i) > off(m) { i } else { m });
        if off(far) <= self.step && self.is_clear(a, b, points) {
            return vec![a, b];
        }
        let mut kept = self.kept(&points[..=far]);
        kept.pop();
        kept.extend(self.kept(&points[far..]));
        kept
    }

    /// Whether a segment stays at least half as far from the region as points are.
    fn is_clear(&self, a: Vec3, b: Vec3, points: &[Vec3]) -> bool {
        let least = points.iter().map(|p| self.region.value(*p)).fold(f64::INFINITY, f64::min);
        let steps = (norm(sub(b, a)) / (0.5 * self.step)).ceil().max(1.0);
        let on = (0..=steps as usize).map(|i| add(a, scale(sub(b, a), i as f64 / steps)));
        on.into_iter().all(|p| self.region.value(p) >= 0.5 * least)
    }
}

fn mean(points: &[Vec3]) -> Vec3 {
    scale(points.iter().fold([0.0; 3], |s, p| add(s, *p)), 1.0 / points.len() as f64)
}

/// The direction of the straight line nearest to points, in the sense of `like`.
fn fitted(points: &[Vec3], like: Vec3) -> Vec3 {
    let center = mean(points);
    let mut spread = [[0.0; 3]; 3];
    for p in points {
        let d = sub(*p, center);
        spread = core::array::from_fn(|i| add(spread[i], scale(d, d[i])));
    }
    let (values, axes) = eigen(&spread);
    match values[2] > 0.0 {
        true if dot(axes[2], like) < 0.0 => scale(axes[2], -1.0),
        true => axes[2],
        false => like,
    }
}
