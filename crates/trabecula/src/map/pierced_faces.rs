//! Faces of a grid that lines pierce, joined to polylines.
//!
//! Through a cell a line goes from the middle of a face to the middle of another. Where a cell has more than two pierced faces, lines of the
//! same turn pass it two faces each, opposite ones first, by way of the mean of the middles; what is left over ends there.

use super::phase_grid::PhaseGrid;
use geometry::math::{Vec3, add, norm, scale, sub};

/// A face that a line pierces: its first node, the axis along which it is pierced, the turn once round it.
pub(super) struct Pierced {
    pub node: usize,
    pub axis: usize,
    pub turn: f64,
}

/// How a line goes on from a face, on one side of it.
#[derive(Clone, Copy)]
enum Next {
    /// Not at all.
    Open,
    /// It ends within the cell.
    To(Vec3),
    /// From a face's side, by way of a point or straight.
    On { face: usize, side: usize, by: Option<Vec3> },
}

/// The lines through faces, each from end to end with the numbers of its faces, all of one turn; a closed one repeats its first point.
pub(super) fn polylines(grid: &PhaseGrid, faces: &[Pierced]) -> Vec<(Vec<Vec3>, Vec<usize>)> {
    let middle = |i: usize| grid.face_middle(faces[i].node, faces[i].axis);
    let next = links(grid, faces);
    let mut seen = vec![false; faces.len()];
    let mut from = |start: usize, away: usize| {
        if core::mem::replace(&mut seen[start], true) {
            return None;
        }
        let (mut points, mut through) = (Vec::new(), vec![start]);
        if let Next::To(end) = next[start][1 - away] {
            points.push(end);
        }
        points.push(middle(start));
        let mut at = next[start][away];
        while let Next::On { face, side, by } = at {
            points.extend(by);
            points.push(middle(face));
            if core::mem::replace(&mut seen[face], true) {
                break;
            }
            through.push(face);
            at = next[face][1 - side];
        }
        if let Next::To(end) = at {
            points.push(end);
        }
        Some((points, through))
    };
    let is_end = |i: usize, side: usize| !matches!(next[i][side], Next::On { .. });
    let mut found = Vec::new();
    for i in 0..faces.len() {
        if let Some(side) = (0..2).find(|side| is_end(i, *side)) {
            found.extend(from(i, 1 - side));
        }
    }
    // What is left is closed.
    found.extend((0..faces.len()).filter_map(|i| from(i, 1)));
    found
}

/// How lines go on from each face, on both sides.
fn links(grid: &PhaseGrid, faces: &[Pierced]) -> Vec<[Next; 2]> {
    let sides = |(i, f): (usize, &Pierced)| {
        let cells = grid.cells_of_face(f.node, f.axis);
        [0, 1].into_iter().filter_map(move |side| cells[side].map(|c| (c, i, side)))
    };
    let mut of_cells: Vec<(usize, usize, usize)> = faces.iter().enumerate().flat_map(sides).collect();
    of_cells.sort_unstable();
    let mut next = vec![[Next::Open; 2]; faces.len()];
    for cell in of_cells.chunk_by(|a, b| a.0 == b.0).filter(|c| c.len() > 1) {
        let middle = |(_, i, _): &(usize, usize, usize)| grid.face_middle(faces[*i].node, faces[*i].axis);
        let centre = scale(cell.iter().map(middle).fold([0.0; 3], add), 1.0 / cell.len() as f64);
        let by = (cell.len() > 2).then_some(centre);
        cell.iter().for_each(|(_, i, side)| next[*i][*side] = Next::To(centre));
        let pairs = || (0..cell.len()).flat_map(|a| (a + 1..cell.len()).map(move |b| (cell[a], cell[b])));
        for opposite in [true, false] {
            for ((_, i, p), (_, j, q)) in pairs() {
                let free = [next[i][p], next[j][q]].iter().all(|n| matches!(n, Next::To(_)));
                if free && faces[i].turn == faces[j].turn && (faces[i].axis == faces[j].axis) == opposite {
                    next[i][p] = Next::On { face: j, side: q, by };
                    next[j][q] = Next::On { face: i, side: p, by };
                }
            }
        }
    }
    next
}

/// The length of a polyline.
pub(super) fn length(points: &[Vec3]) -> f64 {
    points.windows(2).map(|p| norm(sub(p[1], p[0]))).sum()
}

/// The points of another line that are as far along it as those of the first, in the direction in which they are nearer; a closed line begins
/// where it is nearest.
pub(super) fn matched(line: &[Vec3], other: &[Vec3]) -> Vec<Vec3> {
    let is_closed = |l: &[Vec3]| l.len() > 2 && l.first() == l.last();
    let mut forth = other.to_vec();
    if is_closed(line) && is_closed(other) {
        forth.pop();
        let far = |p: &Vec3| norm(sub(*p, line[0]));
        let first = (0..forth.len()).min_by(|a, b| far(&forth[*a]).total_cmp(&far(&forth[*b])));
        forth.rotate_left(first.unwrap_or(0));
        forth.push(forth[0]);
    }
    let back: Vec<Vec3> = forth.iter().rev().copied().collect();
    let [forth, back] = [forth, back].map(|o| resampled(line, &o));
    let apart = |o: &[Vec3]| line.iter().zip(o).map(|(a, b)| norm(sub(*a, *b))).sum::<f64>();
    if apart(&back) < apart(&forth) { back } else { forth }
}

/// The points of `other` at the shares of its length at which the points of `line` are.
fn resampled(line: &[Vec3], other: &[Vec3]) -> Vec<Vec3> {
    let ratio = length(other) / length(line).max(f64::MIN_POSITIVE);
    let (mut along, mut passed, mut i) = (0.0, 0.0, 0);
    let mut at = |k: usize| {
        along += if k > 0 { ratio * norm(sub(line[k], line[k - 1])) } else { 0.0 };
        if k + 1 == line.len() {
            return other[other.len() - 1];
        }
        while i + 2 < other.len() && passed + norm(sub(other[i + 1], other[i])) < along {
            passed += norm(sub(other[i + 1], other[i]));
            i += 1;
        }
        let edge = sub(other[i + 1], other[i]);
        add(other[i], scale(edge, (along - passed) / norm(edge).max(f64::MIN_POSITIVE)))
    };
    (0..line.len()).map(&mut at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::Aabb;

    fn grid() -> PhaseGrid {
        PhaseGrid::over(&Aabb { min: [0.0; 3], max: [6.0; 3] }, [7; 3])
    }

    /// The faces whose middles are these, in any order.
    fn pierced(middles: &[(Vec3, f64)]) -> Vec<Pierced> {
        let g = grid();
        let face = |(m, turn): &(Vec3, f64)| {
            let mut all = (0..g.len()).flat_map(|n| (0..3).map(move |axis| (n, axis)));
            let (node, axis) = all.find(|(n, a)| g.face_middle(*n, *a) == *m).expect("a face");
            Pierced { node, axis, turn: *turn }
        };
        middles.iter().map(face).collect()
    }

    /// A straight line along an axis, at 180 degrees.
    fn straight(axis: usize, from: Vec3, count: usize) -> Vec<(Vec3, f64)> {
        let at = |k: usize| {
            let mut p = from;
            p[axis] += k as f64;
            (p, 180.0)
        };
        (0..count).map(at).collect()
    }

    #[test]
    fn faces_in_any_order_are_one_line() {
        let mut middles = straight(2, [2.5, 3.5, 1.0], 4);
        middles.swap(0, 2);
        let found = polylines(&grid(), &pierced(&middles));
        assert_eq!(found.len(), 1);
        let (points, faces) = &found[0];
        assert_eq!((points.len(), faces.len(), length(points)), (4, 4, 3.0));
        assert!(points.windows(2).all(|p| norm(sub(p[1], p[0])) == 1.0), "{points:?}");
    }

    /// Round an edge of the grid four cells are passed, and the first point comes again.
    #[test]
    fn closed_lines_repeat_their_first_point() {
        let round = [[2.0, 2.5, 2.5], [2.5, 3.0, 2.5], [3.0, 2.5, 2.5], [2.5, 2.0, 2.5]];
        let (middles, centre) = (round.map(|m| (m, 90.0)), [2.5, 2.5, 2.5]);
        // All four faces are those of one cell: two pairs of opposite ones cross in its middle.
        let cross = polylines(&grid(), &pierced(&middles));
        assert!(cross.len() == 2 && cross.iter().all(|(p, _)| p.len() == 3 && p[1] == centre), "{cross:?}");
        // The faces at an edge are of four cells.
        let edge = [[3.0, 2.5, 2.5], [3.5, 3.0, 2.5], [3.0, 3.5, 2.5], [2.5, 3.0, 2.5]];
        let ring = polylines(&grid(), &pierced(&edge.map(|m| (m, 90.0))));
        assert_eq!(ring.len(), 1);
        let points = &ring[0].0;
        assert!(
            points.len() == 5 && points[0] == points[4] && (length(points) - 8f64.sqrt()).abs() < 1e-12,
            "{ring:?}"
        );
    }

    /// Two lines cross in a cell and stay two; a third that ends on one is a line of its own, with a turn of its own.
    #[test]
    fn branches_are_lines() {
        let crossing = [straight(0, [1.0, 2.5, 2.5], 4), straight(1, [2.5, 1.0, 2.5], 4)].concat();
        let found = polylines(&grid(), &pierced(&crossing));
        assert_eq!(found.len(), 2);
        for (points, _) in &found {
            assert!((length(points) - 3.0).abs() < 1e-12 && points.contains(&[2.5; 3]), "{points:?}");
        }
        let mut branch = straight(0, [1.0, 2.5, 2.5], 4);
        branch.extend([([2.5, 3.0, 2.5], 90.0), ([2.5, 4.0, 2.5], 90.0)]);
        let faces = pierced(&branch);
        let found = polylines(&grid(), &faces);
        let turns: Vec<Vec<f64>> = found.iter().map(|l| l.1.iter().map(|f| faces[*f].turn).collect()).collect();
        assert_eq!(turns, [vec![180.0; 4], vec![90.0; 2]]);
        // Both are at the mean of the three middles of that cell.
        let mean = [2.5, 2.5 + 0.5 / 3.0, 2.5];
        let is_there = |p: &Vec3| norm(sub(*p, mean)) < 1e-12;
        assert!(found[0].0.iter().any(is_there) && is_there(&found[1].0[0]), "{found:?}");
    }

    #[test]
    fn a_line_beside_another_is_matched_in_either_direction() {
        let line: Vec<Vec3> = (0..9).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let beside: Vec<Vec3> = (0..=4).rev().map(|i| [2.0 * f64::from(i), 1.0, 0.0]).collect();
        for (p, q) in line.iter().zip(matched(&line, &beside)) {
            assert!(norm(sub(add(*p, [0.0, 1.0, 0.0]), q)) < 1e-12, "{q:?}");
        }
        let ring = |r: f64, first: f64| -> Vec<Vec3> {
            let at = |i: i32| (first + f64::from(i % 40) / 40.0) * core::f64::consts::TAU;
            (0..=40).map(|i| [r * at(i).cos(), r * at(i).sin(), 0.0]).collect()
        };
        let inner = ring(1.0, 0.0);
        let mut outer = ring(1.2, 0.3);
        outer.reverse();
        for (p, q) in inner.iter().zip(matched(&inner, &outer)) {
            assert!((norm(sub(*p, q)) - 0.2).abs() < 0.01, "{p:?} {q:?}");
        }
    }
}
