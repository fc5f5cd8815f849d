//! Orientation of cells: orthonormal frames from angles, vectors or a stress tensor.

use rayon::prelude::*;

use super::axis::{Axis, constant, toward};
use super::comb::{comb, first_in};
use super::cube_rotations::{cube, nearest};
use super::cut_cells::CutCells;
use super::grade_values::grade_values;
use super::load_cases::Stress;
use super::phase_grid::PhaseGrid;
use super::principal::{Principal, range};
use super::singular_lines::FrameEquivalence;
use super::smooth_frames::{GIVEN, Octahedral, Smoothing};
use super::surface_frames::SurfaceDistances;
use super::two_axes::TwoAxes;
use crate::grade::Grade;
use geometry::fault::Fault;
use geometry::math::{IDENTITY, Mat3, Vec3, cross, determinant, dot, product, rotation, scale, sub, transpose, unit};

/// Orientation of the cell at each position. A frame's columns are the directions of the cell's axes in space.
#[derive(Clone)]
pub enum Orientation {
    /// R = Rx Ry Rz of three angles (degrees).
    Angles([Grade; 3]),
    /// The third axis along a vector, by the least turn from z. The vector's sign and length do not matter.
    Direction(Axis),
    /// The first and the third axis along two vectors.
    Frame(TwoAxes),
    /// The axes along the principal directions of a stress.
    Stress(Stress),
}

impl Orientation {
    /// The frames at the nodes of a grid. Where signs and axes are not given, they are chosen so that neighbours agree, the nearest
    /// to the part first, if it is known how far each is `outside` (0 in it), and how sure those of a stress are depends on what is in it.
    pub(super) fn frames(
        &self,
        grid: &PhaseGrid,
        nodes: &[Vec3],
        smoothing: Option<&Smoothing>,
        surface: Option<&SurfaceDistances>,
        outside: Option<&[f64]>,
    ) -> Result<TargetFrames, Fault> {
        let octahedral = surface.is_some() || matches!(self, Orientation::Stress(_) | Orientation::Frame(_));
        if let (Some(smoothing), true) = (smoothing, octahedral) {
            let (own, range) = self.asked(grid, nodes, smoothing, outside)?;
            let averages = smoothing.frames(grid, |n| match surface {
                Some(surface) => surface.mixed(n, own(n)),
                None => own(n),
            });
            let mut found = vec![IDENTITY; nodes.len()];
            let confidence = first_in(outside, |n| averages.confidence(n));
            let start =
                comb(grid, &mut found, confidence, |n, _| averages.first(n), |n, _, to| averages.settled(n, to));
            if let Some(surface) = surface {
                let pin = |(n, f): (usize, &mut Mat3)| *f = surface.pinned(n, f);
                found.par_iter_mut().enumerate().for_each(pin);
            }
            if let Orientation::Frame(of) = self {
                found = of.labelled(found, nodes, start)?;
            }
            return Ok(TargetFrames { at_nodes: found, trust: Some(averages.trust()), range });
        }
        let sure = |at_nodes| Ok(TargetFrames { at_nodes, trust: None, range: 0.0 });
        match self {
            Orientation::Angles(of) => {
                let angles = grade_values(of, nodes, "rotate")?;
                if constant(of) {
                    return sure(vec![rotation(angles[0]); nodes.len()]);
                }
                sure(angles.into_iter().map(rotation).collect())
            }
            Orientation::Direction(of) => {
                let mut along = match smoothing {
                    Some(smoothing) => of.smoothed(grid, nodes, "direction", smoothing)?,
                    None => of.vectors(nodes, "direction")?,
                };
                let up = |_: usize, v: &Vec3| toward(*v, Axis::UP);
                comb(grid, &mut along, first_in(outside, |_| 1.0), up, |_, v, to| toward(*v, *to));
                sure(along.into_iter().map(turned_from_z).collect())
            }
            Orientation::Frame(of) => sure(of.at_nodes(grid, nodes, outside)?),
            Orientation::Stress(_) => {
                let (found, range) = self.ranged(grid, nodes, None, outside)?;
                let mut frames: Vec<Mat3> = found.iter().map(|p| p.frame).collect();
                let least = |n: usize| found[n].gaps().into_iter().map(|g| g / range).fold(f64::INFINITY, f64::min);
                let turns = cube();
                let agree = |n: usize, f: &Mat3, to: &Mat3| settled(f, &found[n].own_gaps(range), to, &turns);
                comb(grid, &mut frames, first_in(outside, least), |n, f| agree(n, f, &IDENTITY), agree);
                Ok(TargetFrames { at_nodes: frames, trust: None, range })
            }
        }
    }

    /// The frames that are asked for at nodes, without signs and order, and the range of a stress in the part. Where cells are not turned
    /// at all, nothing is asked for.
    fn asked(
        &self,
        grid: &PhaseGrid,
        nodes: &[Vec3],
        smoothing: &Smoothing,
        outside: Option<&[f64]>,
    ) -> Result<(Asked, f64), Fault> {
        match self {
            Orientation::Stress(_) => {
                let (found, range) = self.ranged(grid, nodes, Some(smoothing), outside)?;
                let own = move |n: usize| Octahedral::of(&found[n].frame, &scale(found[n].gaps(), 1.0 / range));
                Ok((Box::new(own), range))
            }
            Orientation::Frame(of) => {
                let all = of.polynomials(nodes)?;
                Ok((Box::new(move |n| all[n].clone()), 0.0))
            }
            Orientation::Angles(_) | Orientation::Direction(_) => {
                let gaps = match self {
                    Orientation::Angles(of) if of.iter().all(|a| a.constant() == Some(0.0)) => [0.0; 3],
                    Orientation::Direction(_) => [0.0, 0.0, GIVEN[2]],
                    _ => GIVEN,
                };
                let frames = self.frames(grid, nodes, None, None, outside)?.at_nodes;
                Ok((Box::new(move |n| Octahedral::of(&frames[n], &gaps)), 0.0))
            }
        }
    }

    /// The principal directions of a stress at nodes, averaged if it is smoothed, and the range of its values in the part; none of other
    /// orientations.
    pub(super) fn ranged(
        &self,
        grid: &PhaseGrid,
        nodes: &[Vec3],
        smoothing: Option<&Smoothing>,
        outside: Option<&[f64]>,
    ) -> Result<(Vec<Principal>, f64), Fault> {
        let Orientation::Stress(of) = self else { return Ok((Vec::new(), 0.0)) };
        let tensors = of.tensors(nodes)?;
        let found = of.directions(&tensors);
        let range = range(&found, outside);
        if range == 0.0 {
            return Err(no_principal());
        }
        let Some(smoothing) = smoothing.and_then(Smoothing::of_stresses) else { return Ok((found, range)) };
        let means: Vec<_> = tensors.iter().map(|case| smoothing.tensors(grid, case)).collect();
        Ok((of.directions(&means), range))
    }

    /// Whether it is the same everywhere.
    pub(super) fn is_constant(&self) -> bool {
        match self {
            Orientation::Angles(of) => constant(of),
            Orientation::Direction(of) => of.is_constant(),
            Orientation::Frame(of) => of.is_constant(),
            Orientation::Stress(of) => of.is_constant(),
        }
    }

    /// What counts as the same axes.
    pub(super) fn alike(&self) -> FrameEquivalence {
        match self {
            Orientation::Direction(_) => FrameEquivalence::Line,
            Orientation::Frame(_) | Orientation::Stress(_) => FrameEquivalence::Turned(cube()),
            Orientation::Angles(_) => FrameEquivalence::Turned(vec![IDENTITY]),
        }
    }

    /// Whether signs or axes are chosen so that neighbours agree.
    pub(super) fn is_combed(&self) -> bool {
        !matches!(self, Orientation::Angles(_))
    }

    /// The key that it is given by.
    pub(super) fn key(&self) -> &'static str {
        match self {
            Orientation::Angles(_) => "rotate",
            Orientation::Direction(_) => "direction",
            Orientation::Frame(_) => "frame",
            Orientation::Stress(_) => "stress",
        }
    }

    /// The range of a stress at points, against which directions are more or less sure; 0 for other orientations.
    pub(super) fn stress_range(&self, points: &[Vec3]) -> Result<f64, Fault> {
        let Orientation::Stress(of) = self else { return Ok(0.0) };
        of.principal(points).map(|found| range(&found, None))
    }

    /// The frames at points; where signs and axes are not given, those nearest to `like`. `range` is that of a stress
    /// in the part.
    pub(super) fn frames_near(&self, points: &[Vec3], like: &[Mat3], range: f64) -> Result<Vec<Mat3>, Fault> {
        match self {
            Orientation::Angles(of) => {
                let angles = grade_values(of, points, "rotate")?;
                Ok(angles.into_iter().map(rotation).collect())
            }
            Orientation::Direction(of) => {
                let along = of.vectors(points, "direction")?.into_iter().zip(like);
                Ok(along.map(|(v, l)| turned_from_z(toward(v, [l[0][2], l[1][2], l[2][2]]))).collect())
            }
            Orientation::Frame(of) => of.near(points, like),
            Orientation::Stress(of) => {
                let (found, turns) = (of.principal(points)?, cube());
                if range == 0.0 {
                    return Err(no_principal());
                }
                let one = |(p, like): (&Principal, &Mat3)| settled(&p.frame, &p.own_gaps(range), like, &turns);
                Ok(found.par_iter().zip(like).map(one).collect())
            }
        }
    }
}

/// The frame that is asked for at each node, without signs and order.
type Asked = Box<dyn Fn(usize) -> Octahedral>;

/// Frames at the nodes of a grid.
pub(super) struct TargetFrames {
    pub at_nodes: Vec<Mat3>,
    /// How sure they are, from 0 to 1, where that differs.
    pub trust: Option<Vec<f64>>,
    /// The range of a stress, against which directions are more or less sure; 0 for other orientations.
    pub range: f64,
}

/// A gap between principal values, over the greatest value, below which they count as equal.
pub(super) const DOUBT: f64 = 0.05;

fn no_principal() -> Fault {
    let message = "the stress is the same in all directions, or zero, everywhere: it has no principal directions";
    Fault::new("stress", message)
}

/// The frame between those at the nodes about a point, in the branch of the first of them: their mean, made orthonormal; of the nearest
/// node where they are too far apart for a mean.
pub(super) fn interpolated(grid: &PhaseGrid, frames: &[Mat3], cuts: Option<&CutCells>, p: Vec3) -> Mat3 {
    let (mut mean, mut nearest) = ([[0.0; 3]; 3], (0.0, IDENTITY));
    let around = grid.around(p);
    for (n, weight) in around {
        // What phases become on the way from the first node to this, its axes undergo from here to there.
        let frame = cuts.map_or(frames[n], |c| product(&frames[n], &c.between([around[0].0, n]).turn));
        if weight > nearest.0 {
            nearest = (weight, frame);
        }
        mean = core::array::from_fn(|i| core::array::from_fn(|j| mean[i][j] + weight * frame[i][j]));
    }
    if determinant(&mean) < 0.25 {
        return nearest.1;
    }
    let [x, _, z] = transpose(&mean);
    let z = unit(z);
    let x = unit(sub(x, scale(z, dot(x, z))));
    transpose(&[x, cross(z, x), z])
}

/// The frame of the least turn that takes z to `d`.
fn turned_from_z(d: Vec3) -> Mat3 {
    let [x, y, z] = d;
    if z < -1.0 + 1e-12 {
        return [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    }
    let s = 1.0 / (1.0 + z);
    transpose(&[[1.0 - x * x * s, -x * y * s, -x], [-x * y * s, 1.0 - y * y * s, -y], [x, y, z]])
}

/// The frame at a node whose neighbour has the frame `to`: the principal one nearest to it, where there is one. Where
/// two values agree only the third direction is kept to, and where all do, the neighbour's frame is.
fn settled(f: &Mat3, gaps: &Vec3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    let sure = gaps.map(|g| g > DOUBT);
    match sure.iter().filter(|s| **s).count() {
        3 => nearest(f, to, turns),
        1 => {
            let i = sure.iter().position(|s| *s).unwrap_or(0);
            let axis = [f[0][i], f[1][i], f[2][i]];
            let columns = transpose(to);
            let near = columns.iter().max_by(|a, b| dot(**a, axis).abs().total_cmp(&dot(**b, axis).abs()));
            let from = *near.unwrap_or(&columns[0]);
            let axis = if dot(from, axis) < 0.0 { scale(axis, -1.0) } else { axis };
            product(&least_turn(from, axis), to)
        }
        _ => *to,
    }
}

/// The least turn that takes one unit vector to another, which is not its opposite.
fn least_turn(from: Vec3, to: Vec3) -> Mat3 {
    let v = cross(from, to);
    let k = [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]];
    let kk = product(&k, &k);
    let s = 1.0 / (1.0 + dot(from, to));
    core::array::from_fn(|i| core::array::from_fn(|j| IDENTITY[i][j] + k[i][j] + s * kk[i][j]))
}

#[cfg(test)]
mod tests;
