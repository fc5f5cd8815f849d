//! Frames by two of their axes, of which neither signs nor order need be those of their neighbours.
//!
//! What a mesher or an eigenvalue solver writes has arbitrary signs and any order of axes. Frames are combed as those of a stress are:
//! each node takes, of the 24 frames that a cube cannot tell apart, the one nearest to its neighbour's. Which axis of the combed frames is
//! the cell's first and which its third is what most nodes say, if more than half of them agree. Vectors whose signs and order already
//! agree from node to node stay what they are, bit for bit.

use rayon::prelude::*;

use super::axis::Axis;
use super::comb::{comb, first_in};
use super::cube_rotations::{cube, nearest};
use super::grade_values::grade_values;
use super::phase_grid::PhaseGrid;
use super::smooth_frames::{GIVEN, Octahedral};
use crate::grade::Grade;
use geometry::fault::{Fault, position};
use geometry::math::{IDENTITY, Mat3, Vec3, cross, dot, norm, product, scale, sub, transpose, unit};

/// The first and the third axis of frames: the third exactly, the first as nearly as it can.
#[derive(Clone)]
pub struct TwoAxes {
    x: Axis,
    z: Axis,
    /// The frames as polynomials that have neither signs nor order, where both axes are arrays of one result.
    unordered: Option<Box<[Grade; 9]>>,
}

impl TwoAxes {
    /// Of a first and a third axis.
    pub fn new(x: Axis, z: Axis) -> TwoAxes {
        TwoAxes { x, z, unordered: None }
    }

    /// The same, of two arrays whose axes may change places between the points of a result: `unordered` are the coefficients
    /// that [`TwoAxes::coefficients`] makes at these points.
    pub fn unordered(self, unordered: [Grade; 9]) -> TwoAxes {
        TwoAxes { unordered: Some(Box::new(unordered)), ..self }
    }

    /// The coefficients of the polynomial X⁴ + Y⁴ + Z⁴ − ⅗ r⁴ of the frame of two vectors of any length, which is not zero; none if they are
    /// parallel.
    pub fn coefficients(x: Vec3, z: Vec3) -> Option<[f64; 9]> {
        let frame = squared(vec![unit(x)], vec![unit(z)], &[[0.0; 3]]).ok()?;
        Some(Octahedral::of(&frame[0], &GIVEN).coefficients())
    }

    pub(super) fn is_constant(&self) -> bool {
        self.x.is_constant() && self.z.is_constant()
    }

    /// The frames at points, with the signs and the order that they have there.
    fn given(&self, points: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
        squared(self.x.vectors(points, "frame.x")?, self.z.vectors(points, "frame.z")?, points)
    }

    /// The frames at points without signs and order.
    pub(super) fn polynomials(&self, points: &[Vec3]) -> Result<Vec<Octahedral>, Fault> {
        match &self.unordered {
            Some(of) => Ok(grade_values(of, points, "frame")?.into_iter().map(Octahedral::sure).collect()),
            None => Ok(self.given(points)?.iter().map(|f| Octahedral::of(f, &GIVEN)).collect()),
        }
    }

    /// The frames at the nodes of a grid, combed where those that are given do not agree as well.
    pub(super) fn at_nodes(
        &self,
        grid: &PhaseGrid,
        nodes: &[Vec3],
        outside: Option<&[f64]>,
    ) -> Result<Vec<Mat3>, Fault> {
        let (sure, turns) = (first_in(outside, |_| 1.0), cube());
        if self.unordered.is_some() {
            let all = self.polynomials(nodes)?;
            let mut frames = vec![IDENTITY; nodes.len()];
            let start = comb(grid, &mut frames, sure, |n, _| all[n].best(), |n, _, to| all[n].nearest(to));
            return self.labelled(frames, nodes, start);
        }
        let given = self.given(nodes)?;
        let signed = [&self.x, &self.z].iter().all(|a| matches!(a, Axis::Vector(_)));
        let breaks = |frames: &[Mat3]| breaks(grid, frames, &turns);
        let before = if signed { breaks(&given) } else { usize::MAX };
        if before == 0 {
            return Ok(given);
        }
        let mut frames = given.clone();
        let agree = |f: &Mat3, to: &Mat3| nearest(f, to, &turns);
        let start = comb(grid, &mut frames, sure, |_, f| agree(f, &IDENTITY), |_, f, to| agree(f, to));
        if breaks(&frames) < before { self.labelled(frames, nodes, start) } else { Ok(given) }
    }

    /// Combed frames with the axes that are meant: the order, and of vectors the signs, that more than half of the nodes have. `start` is the
    /// node where combing started.
    pub(super) fn labelled(&self, mut frames: Vec<Mat3>, nodes: &[Vec3], start: usize) -> Result<Vec<Mat3>, Fault> {
        let is_x = self.x.meaning(nodes, "frame.x")?;
        let is_z = self.z.meaning(nodes, "frame.z")?;
        let turned = |n: usize, t: &Mat3| {
            let [x, _, z] = transpose(&product(&frames[n], t));
            (x, z)
        };
        // Of the turns that give the same lines, the one to the frame nearest to the coordinate axes.
        let mut turns = cube();
        let near = |t: &Mat3| {
            let frame = product(&frames[start], t);
            frame[0][0] + frame[1][1] + frame[2][2]
        };
        turns.sort_by(|a, b| near(b).total_cmp(&near(a)));
        let meant = |n: usize| {
            turns.iter().position(|t| {
                let (x, z) = turned(n, t);
                is_x(n, x) && is_z(n, z)
            })
        };
        let votes: Vec<Option<usize>> = (0..nodes.len()).into_par_iter().map(meant).collect();
        let count = |t: usize| votes.iter().filter(|v| **v == Some(t)).count();
        if let Some(most) = (0..turns.len()).find(|t| 2 * count(*t) > nodes.len()) {
            frames.par_iter_mut().for_each(|f| *f = product(f, &turns[most]));
        }
        Ok(frames)
    }

    /// The frames at points that are nearest to others.
    pub(super) fn near(&self, points: &[Vec3], like: &[Mat3]) -> Result<Vec<Mat3>, Fault> {
        if self.unordered.is_some() {
            let all = self.polynomials(points)?;
            return Ok(all.par_iter().zip(like).map(|(q, like)| q.settled(like)).collect());
        }
        let turns = cube();
        Ok(self.given(points)?.par_iter().zip(like).map(|(f, like)| nearest(f, like, &turns)).collect())
    }
}

/// The frames of first and third axes: the third exactly, the first as nearly as it can.
fn squared(x: Vec<Vec3>, z: Vec<Vec3>, points: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
    let both = x.into_iter().zip(z).enumerate();
    both.map(|(n, (x, z))| {
        let x = sub(x, scale(z, dot(x, z)));
        if norm(x) < 1e-6 {
            let message =
                format!("the first and the third axis are parallel at {}; give two that differ", position(points[n]));
            return Err(Fault::new("frame.x", message));
        }
        let x = unit(x);
        Ok(transpose(&[x, cross(z, x), z]))
    })
    .collect()
}

/// The number of pairs of neighbouring nodes of which one has another frame, of those that are alike, nearer to the other's.
fn breaks(grid: &PhaseGrid, frames: &[Mat3], turns: &[Mat3]) -> usize {
    let (strides, shape) = (grid.strides(), grid.shape);
    let of = |n: usize| {
        let at = grid.index(n);
        (0..3)
            .filter(|&a| at[a] + 1 < shape[a])
            .filter(|&a| {
                let next = &frames[n + strides[a]];
                nearest(next, &frames[n], turns) != *next
            })
            .count()
    };
    (0..frames.len()).into_par_iter().map(of).sum()
}
