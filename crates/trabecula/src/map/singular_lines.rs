//! Singular lines of a field of frames: lines round which the axes do not come back to themselves.
//!
//! From node to node the axes are followed to the nearest ones. Once round a face of the grid they come back turned by one of the
//! rotations that take axes to axes (the holonomy), or by a whole turn; unless they come back as they were, a line pierces the face. No
//! phases have these gradients about such a line. Where axes turn fast a line may pierce several faces next to each other, by a quarter
//! forth, say, and a quarter back: its turn is that once round them all. (Nieser, Reitebuch, Polthier, CubeCover, Comput. Graph. Forum 30, 2011.)

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::cube_rotations::{is_near, nearest};
use super::phase_grid::PhaseGrid;
use super::pierced_faces::{Pierced, length, matched, polylines};
use geometry::math::{IDENTITY, Mat3, Vec3, add, dot, norm, product, scale, sub, transpose};

/// What counts as the same axes.
pub(super) enum FrameEquivalence {
    /// The third axis and its opposite; the others follow it.
    Line,
    /// Frames that differ by one of these rotations, with which any two have their product.
    Turned(Vec<Mat3>),
}

/// A line round which the axes do not come back to themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularLine {
    /// Points along it from end to end, mm: the middles of the grid's faces that it pierces. A closed line repeats its first point.
    pub points: Vec<Vec3>,
    /// Its length within the region, mm, to about a tenth: that of the polyline.
    pub length: f64,
    /// By what the axes are turned once round it, degrees.
    pub turn: f64,
}

impl SingularLine {
    /// Its ends, mm; the same point where it is closed.
    pub fn ends(&self) -> [Vec3; 2] {
        [self.points.first(), self.points.last()].map(|p| p.copied().unwrap_or_default())
    }

    /// Whether it comes back to where it begins.
    pub(super) fn is_closed(&self) -> bool {
        let [a, b] = self.ends();
        a == b
    }

    /// Where it is, as the longest of `count` lines.
    pub(crate) fn description(&self, count: usize) -> String {
        let at = |[x, y, z]: Vec3| format!("({x:.1}, {y:.1}, {z:.1})");
        let [a, b] = self.ends();
        let place = if self.is_closed() {
            format!("a ring through {} mm", at(a))
        } else {
            format!("a line from {} to {} mm", at(a), at(b))
        };
        match count {
            1 => place,
            _ => format!("{count} lines, of which the longest is {place}"),
        }
    }
}

/// The singular lines in the region that are at least `least` mm long, the longest first. They are known to a step of the grid; those that
/// run within `near` mm of each other, or two steps, are one, whose turn is that once round both: zero for two that undo each other.
pub(super) fn singular_lines(
    grid: &PhaseGrid,
    frames: &[Mat3],
    inside: &[bool],
    alike: &FrameEquivalence,
    least: f64,
    near: f64,
) -> Vec<SingularLine> {
    let strides = grid.strides();
    let last = |n: usize, a: usize| grid.index(n)[a] + 1 == grid.shape[a];
    // Edges along which axes turn by less than an eighth: round a face of such they come back.
    let quick: Vec<[bool; 3]> = (0..grid.len())
        .into_par_iter()
        .map(|n| [0, 1, 2].map(|a| last(n, a) || !inside[n] || alike.is_near(&frames[n], &frames[n + strides[a]])))
        .collect();
    let faces = (0..grid.len()).into_par_iter().flat_map_iter(|n| {
        let quick = &quick;
        (0..3).filter_map(move |axis| {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            if last(n, a) || last(n, b) {
                return None;
            }
            let [p, q] = [n + strides[a], n + strides[b]];
            let round = [n, p, p + strides[b], q];
            if (quick[n][a] && quick[n][b] && quick[p][b] && quick[q][a]) || !round.iter().all(|m| inside[*m]) {
                return None;
            }
            let turn = alike.round(&round.map(|m| &frames[m]));
            (turn > 0.0).then_some(Pierced { node: n, axis, turn })
        })
    });
    let faces: Vec<Pierced> = faces.collect();
    let near = near.max(2.0 * norm(grid.step));
    let line = |(points, through): (Vec<Vec3>, Vec<usize>)| {
        let turn = faces[through[0]].turn;
        Found { line: SingularLine { length: length(&points), points: points.clone(), turn }, points, through }
    };
    let mut found: Vec<Found> = polylines(grid, &faces).into_iter().map(line).collect();
    found.retain(|l| l.points.len() > 1 && l.line.length >= least);
    found.sort_by(|a, b| b.line.length.total_cmp(&a.line.length));
    let round = Surroundings { grid, frames, inside, alike, faces: &faces, levels: levels(grid, &faces), near };
    let turned = |l: Found| SingularLine { turn: round.turn(&l.through).unwrap_or(l.line.turn), ..l.line };
    let mut made: Vec<SingularLine> = apart(found, near).into_iter().map(turned).collect();
    made.sort_by(|a, b| b.length.total_cmp(&a.length));
    made
}

/// A line, its points as they were found, since means wander, and the faces that it pierces.
struct Found {
    line: SingularLine,
    points: Vec<Vec3>,
    through: Vec<usize>,
}

/// Lines with those that run within a distance of them made one, at their mean place: a whole turn of axes that are alike after a
/// quarter is four quarters, some steps of the grid apart.
fn apart(lines: Vec<Found>, near: f64) -> Vec<Found> {
    let close = |a: &[Vec3], b: &[Vec3]| {
        let chord = sub(a[a.len() - 1], a[0]);
        // One after the other they are pieces of one line, between which the part is not.
        let abreast = |d: Vec3| dot(d, chord).abs() <= 0.5 * dot(chord, chord) || chord == [0.0; 3];
        [0, a.len() - 1].map(|i| sub(b[i], a[i])).into_iter().all(|d| norm(d) < near && abreast(d))
    };
    // With the sum of the turns of those that each is the mean of.
    let mut kept: Vec<(Found, f64)> = Vec::new();
    for line in lines {
        let adjacent = |(i, (k, _)): (usize, &(Found, f64))| {
            let other = matched(&k.points, &line.points);
            close(&k.points, &other).then_some((i, other))
        };
        let turn = line.line.turn;
        let Some((i, other)) = kept.iter().enumerate().find_map(adjacent) else {
            kept.push((line, turn));
            continue;
        };
        let (Found { line: k, .. }, sum) = &mut kept[i];
        let share = turn / (*sum + turn);
        k.points.iter_mut().zip(&other).for_each(|(p, q)| *p = add(*p, scale(sub(*q, *p), share)));
        k.length = length(&k.points);
        *sum += turn;
    }
    kept.into_iter().map(|k| k.0).collect()
}

/// What lies about the faces that a line pierces.
struct Surroundings<'a> {
    grid: &'a PhaseGrid,
    frames: &'a [Mat3],
    inside: &'a [bool],
    alike: &'a FrameEquivalence,
    faces: &'a [Pierced],
    /// The faces of each axis and layer of the grid.
    levels: BTreeMap<(usize, usize), Vec<usize>>,
    /// How far apart faces are that are one line's, mm.
    near: f64,
}

fn levels(grid: &PhaseGrid, faces: &[Pierced]) -> BTreeMap<(usize, usize), Vec<usize>> {
    let mut levels: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (i, f) in faces.iter().enumerate() {
        levels.entry((f.axis, grid.index(f.node)[f.axis])).or_default().push(i);
    }
    levels
}

impl Surroundings<'_> {
    /// By what the axes are turned once round all faces near those of a line, degrees: in most layers of the grid in which that way lies in
    /// the region.
    fn turn(&self, through: &[usize]) -> Option<f64> {
        let mut found: Vec<f64> = through.iter().filter_map(|f| self.turn_near(&self.faces[*f])).collect();
        found.sort_by(f64::total_cmp);
        let runs = found.chunk_by(|a, b| a == b);
        runs.max_by_key(|run| run.len()).map(|run| run[0])
    }

    /// The same of the least rectangle round the faces near one.
    fn turn_near(&self, face: &Pierced) -> Option<f64> {
        let (at, middle) = (self.grid.index(face.node), self.grid.face_middle(face.node, face.axis));
        let [a, b] = [(face.axis + 1) % 3, (face.axis + 2) % 3];
        let ([mut low, mut high], strides) = ([at; 2], self.grid.strides());
        for f in self.levels.get(&(face.axis, at[face.axis]))?.iter().map(|f| &self.faces[*f]) {
            if norm(sub(self.grid.face_middle(f.node, f.axis), middle)) <= self.near {
                let at = self.grid.index(f.node);
                [a, b].into_iter().for_each(|c| (low[c], high[c]) = (low[c].min(at[c]), high[c].max(at[c])));
            }
        }
        let node = |i: usize, j: usize| {
            face.node + i * strides[a] + j * strides[b] - (at[a] * strides[a] + at[b] * strides[b])
        };
        let (right, top) = (high[a] + 1, high[b] + 1);
        let up = (low[a]..right).map(|i| node(i, low[b])).chain((low[b]..top).map(|j| node(right, j)));
        let down =
            (low[a] + 1..=right).rev().map(|i| node(i, top)).chain((low[b] + 1..=top).rev().map(|j| node(low[a], j)));
        let way: Vec<usize> = up.chain(down).collect();
        let inside = way.iter().all(|n| self.inside[*n]);
        inside.then(|| self.alike.round(&way.iter().map(|n| &self.frames[*n]).collect::<Vec<_>>()))
    }
}

impl FrameEquivalence {
    /// The rotations that change nothing; of a line alone none but none at all.
    pub fn turns(&self) -> Vec<Mat3> {
        match self {
            FrameEquivalence::Line => vec![IDENTITY],
            FrameEquivalence::Turned(all) => all.clone(),
        }
    }

    /// Whether the axes of two frames differ by so little that once round a face of four such edges they come back.
    fn is_near(&self, a: &Mat3, b: &Mat3) -> bool {
        match self {
            FrameEquivalence::Line => dot(third(a), third(b)) > 0.0,
            FrameEquivalence::Turned(_) => is_near(a, b),
        }
    }

    /// By what the axes are turned once round the nodes of a rectangle with these frames, from the lowest one on, degrees; zero where they come
    /// back as they were.
    fn round(&self, frames: &[&Mat3]) -> f64 {
        let count = frames.len();
        let pairs = || (0..count).map(|i| (frames[i], frames[(i + 1) % count]));
        match self {
            FrameEquivalence::Line => {
                let turned = pairs().filter(|(a, b)| dot(third(a), third(b)) < 0.0).count();
                if turned % 2 == 1 { 180.0 } else { 0.0 }
            }
            FrameEquivalence::Turned(all) => {
                // The rotations in space, one after the other, as quaternions: a whole turn is −1.
                let step = |(a, b): (&Mat3, &Mat3)| quaternion(&product(&nearest(b, a, all), &transpose(a)));
                // Each edge is followed upwards, so that both faces at it see the same: half of the way goes up, the other half down.
                let steps = pairs()
                    .enumerate()
                    .map(|(i, (a, b))| if 2 * i < count { step((a, b)) } else { conjugate(step((b, a))) });
                let [w, ..] = steps.fold([1.0, 0.0, 0.0, 0.0], |q, s| times(s, q));
                let turn = 2.0 * w.clamp(-1.0, 1.0).acos().to_degrees();
                // Rotations that take axes to axes turn by 90 degrees or more.
                if turn < 45.0 { 0.0 } else { turn.round() }
            }
        }
    }
}

fn third(m: &Mat3) -> Vec3 {
    [m[0][2], m[1][2], m[2][2]]
}

/// The unit quaternion of a rotation by at most half a turn, w ≥ 0.
fn quaternion(m: &Mat3) -> [f64; 4] {
    // The column of the largest entry of 4 q qᵀ, which is free of cancellation.
    let t = m[0][0] + m[1][1] + m[2][2];
    let squares = [1.0 + t, 1.0 + 2.0 * m[0][0] - t, 1.0 + 2.0 * m[1][1] - t, 1.0 + 2.0 * m[2][2] - t];
    let [x, y, z] = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
    let sums = [m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]];
    let largest = (0..4).fold(0, |k, i| if squares[i] > squares[k] { i } else { k });
    let q = match largest {
        0 => [squares[0], x, y, z],
        1 => [x, squares[1], sums[0], sums[1]],
        2 => [y, sums[0], squares[2], sums[2]],
        _ => [z, sums[1], sums[2], squares[3]],
    };
    let size = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    q.map(|v| sign * v / size)
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

/// The product of two quaternions.
fn times([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Aabb, rotation};

    fn equal() -> FrameEquivalence {
        FrameEquivalence::Turned(vec![IDENTITY])
    }

    fn grid() -> PhaseGrid {
        PhaseGrid::over(&Aabb { min: [-5.0, -4.0, 0.0], max: [6.0, 5.0, 8.0] }, [24, 22, 18])
    }

    fn found(
        alike: &FrameEquivalence,
        frame: impl Fn(Vec3) -> Mat3,
        solid: impl Fn(Vec3) -> bool,
    ) -> Vec<SingularLine> {
        let g = grid();
        let nodes: Vec<Vec3> = (0..g.len()).map(|n| g.node(n)).collect();
        let frames: Vec<Mat3> = nodes.iter().map(|p| frame(*p)).collect();
        let inside: Vec<bool> = nodes.iter().map(|p| solid(*p)).collect();
        singular_lines(&g, &frames, &inside, alike, 0.0, 0.0)
    }

    /// Frames turned about y, so that their third axes lie in the plane of x and z, by `index` turns once round a line along y, and
    /// with it by a rotation of all, in which nothing may depend on the axes of the grid.
    fn about(index: f64) -> impl Fn(Vec3) -> Mat3 {
        move |[x, _, z]| rotation([0.0, -index * (z - 3.3).atan2(x - 0.7).to_degrees(), 0.0])
    }

    /// A line along y that ends where the part does, one step about.
    fn is_at(line: &SingularLine, turn: f64) {
        let [a, b] = line.ends();
        for p in [a, b] {
            assert!((p[0] - 0.7).abs() <= 0.5 && (p[2] - 3.3).abs() <= 0.5, "{line:?}");
        }
        // From the first row of nodes to the last.
        assert!((line.length - 9.0).abs() < 0.5 && ((b[1] - a[1]).abs() - line.length).abs() < 1e-9, "{line:?}");
        assert_eq!(line.turn, turn);
    }

    #[test]
    fn disclinations_are_at_their_place() {
        let quarter = FrameEquivalence::Turned(crate::map::cube_rotations::cube());
        for (alike, index, turn) in [
            (&FrameEquivalence::Line, 0.5, 180.0),
            (&quarter, 0.5, 180.0),
            (&quarter, -0.25, 90.0),
            (&equal(), 1.0, 360.0),
        ] {
            let lines = found(alike, about(index), |_| true);
            assert_eq!(lines.len(), 1, "{index}: {lines:?}");
            is_at(&lines[0], turn);
        }
    }

    /// Where the line lies in a hole of the part there is none, nor in a field that turns by less.
    #[test]
    fn there_is_none_in_a_hole() {
        let quarter = FrameEquivalence::Turned(crate::map::cube_rotations::cube());
        let hole = |[x, _, z]: Vec3| (x - 0.7).hypot(z - 3.3) > 1.0;
        assert_eq!(found(&quarter, about(0.25), hole), []);
        let slow = |p: Vec3| rotation([20.0 * p[0], 5.0 * p[1] * p[2], -8.0 * p[0]]);
        for alike in [&FrameEquivalence::Line, &quarter, &equal()] {
            assert_eq!(found(alike, slow, |_| true), []);
        }
    }

    /// Signs and axes of the frames do not count, whatever each node has.
    #[test]
    fn arbitrary_axes_change_nothing() {
        let turns = crate::map::cube_rotations::cube();
        let quarter = FrameEquivalence::Turned(turns.clone());
        let mut s = 3u64;
        let mut any: Vec<usize> =
            (0..grid().len()).map(|_| (24.0 * geometry::random::random(&mut s).abs()) as usize % 24).collect();
        let plain = found(&quarter, about(0.25), |_| true);
        let next = std::cell::RefCell::new(&mut any);
        let mixed =
            found(&quarter, |p| product(&about(0.25)(p), &turns[next.borrow_mut().pop().unwrap_or(0)]), |_| true);
        assert_eq!(plain, mixed);
        is_at(&mixed[0], 90.0);
    }

    /// A closed line has no ends: half a turn once round a ring.
    #[test]
    fn rings_are_closed() {
        let frame = |p: Vec3| {
            let [x, y, z] = sub(p, [0.52, 0.47, 4.03]);
            let (r, around) = (x.hypot(y), y.atan2(x).to_degrees());
            let turn = 0.5 * z.atan2(r - 2.6).to_degrees();
            // About the ring's tangent.
            let about = rotation([0.0, 0.0, around]);
            product(&product(&about, &rotation([0.0, turn, 0.0])), &transpose(&about))
        };
        let ring = |p: Vec3| (p[0] - 0.52).hypot(p[1] - 0.47) > 0.9;
        let lines = found(&FrameEquivalence::Line, frame, ring);
        assert_eq!(lines.len(), 1, "{lines:?}");
        let [a, b] = lines[0].ends();
        assert_eq!(a, b);
        // A chain of the middles of faces is up to a tenth longer than a circle.
        let round = core::f64::consts::TAU * 2.6;
        assert!(lines[0].length > 0.95 * round && lines[0].length < 1.12 * round, "{lines:?} of {round}");
    }
}
