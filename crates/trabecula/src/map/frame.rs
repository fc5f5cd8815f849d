//! Orientation of cells: orthonormal frames from angles, vectors or a stress tensor.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::cut_cells::CutCells;
use super::load_cases::Stress;
use super::phase_grid::Grid;
use super::principal::{Principal, range};
use super::singular_lines::Alike;
use super::smooth_frames::{LEAST_AVERAGE, Octahedral, Smoothing};
use super::surface_frames::Surface;
use super::two_axes::TwoAxes;
use crate::grade::Grade;
use geometry::fault::{Fault, number, position};
use geometry::math::{
    IDENTITY, Mat3, Vec3, cross, determinant, dot, norm, product, rotation, scale, sub, transpose, unit,
};
use geometry::progress::checkpoint;

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

/// The direction of an axis.
#[derive(Clone)]
pub enum Axis {
    /// Along a vector v.
    Vector([Grade; 3]),
    /// Along the principal direction of the greatest value of a tensor v vᵀ, given as 11, 22, 33, 23, 13, 12: for vectors whose signs
    /// are arbitrary, which vanish between two opposite ones.
    Line([Grade; 6]),
}

/// The least cosine of an axis that is given and one of a combed frame that it stands for.
const MEANT: f64 = 0.9;

impl Axis {
    /// What axes without signs are made to agree with first.
    const UP: Vec3 = [1e-6, 1e-3, 1.0];

    /// Unit vectors at points; those of lines have arbitrary signs.
    pub(super) fn vectors(&self, points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
        match self {
            Axis::Vector(of) => vectors(of, points, key),
            Axis::Line(of) => along(&columns(of, points, key)?, points, key),
        }
    }

    pub(super) fn is_constant(&self) -> bool {
        match self {
            Axis::Vector(of) => constant(of),
            Axis::Line(of) => constant(of),
        }
    }

    /// Whether a unit vector is what is given at one of the points.
    pub(super) fn meaning(&self, points: &[Vec3], key: &str) -> Result<Box<dyn Fn(usize, Vec3) -> bool + Sync>, Fault> {
        Ok(match self {
            Axis::Vector(_) => {
                let given = self.vectors(points, key)?;
                Box::new(move |n, v| dot(given[n], v) > MEANT)
            }
            Axis::Line(of) => {
                let given = columns(of, points, key)?;
                Box::new(move |n, v| {
                    let [xx, yy, zz, yz, xz, xy] = given[n];
                    let [x, y, z] = square(v).as_chunks::<3>().0[0];
                    let [p, q, r] = square(v).as_chunks::<3>().0[1];
                    let along = xx * x + yy * y + zz * z + 2.0 * (yz * p + xz * q + xy * r);
                    along > MEANT * MEANT * (xx + yy + zz)
                })
            }
        })
    }

    /// Unit vectors at the nodes of a grid, smoothed, of arbitrary signs.
    fn smoothed(&self, grid: &Grid, nodes: &[Vec3], key: &str, smoothing: &Smoothing) -> Result<Vec<Vec3>, Fault> {
        let tensors: Vec<[f64; 6]> = self.vectors(nodes, key)?.iter().map(|v| square(*v)).collect();
        let averages = smoothing.axes(grid, &tensors);
        let size = |t: &[f64; 6]| t[0] + t[1] + t[2];
        let least = LEAST_AVERAGE * averages.iter().map(size).fold(0.0, f64::max);
        // Far from the region nothing is left of the averages: a node there keeps its own direction.
        let kept = averages.into_iter().zip(tensors).map(|(mean, own)| if size(&mean) > least { mean } else { own });
        along(&kept.collect::<Vec<_>>(), nodes, key)
    }
}

/// v vᵀ as 11, 22, 33, 23, 13, 12.
fn square([x, y, z]: Vec3) -> [f64; 6] {
    [x * x, y * y, z * z, y * z, x * z, x * y]
}

/// The one of v and −v that is nearer to another vector.
fn toward(v: Vec3, to: Vec3) -> Vec3 {
    if dot(v, to) < 0.0 { scale(v, -1.0) } else { v }
}

fn constant(of: &[Grade]) -> bool {
    of.iter().all(|g| g.constant().is_some())
}

impl Orientation {
    /// The frames at the nodes of a grid. Where signs and axes are not given, they are chosen so that neighbours agree, the nearest
    /// to the part first, if it is known how far each is `outside` (0 in it), and how sure those of a stress are depends on what is in it.
    pub(super) fn frames(
        &self,
        grid: &Grid,
        nodes: &[Vec3],
        smoothing: Option<&Smoothing>,
        surface: Option<&Surface>,
        outside: Option<&[f64]>,
    ) -> Result<Frames, Fault> {
        let octahedral = surface.is_some() || matches!(self, Orientation::Stress(_) | Orientation::Frame(_));
        if let (Some(smoothing), true) = (smoothing, octahedral) {
            let (own, range) = self.asked(grid, nodes, outside)?;
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
            return Ok(Frames { at_nodes: found, trust: Some(averages.trust()), range });
        }
        let sure = |at_nodes| Ok(Frames { at_nodes, trust: None, range: 0.0 });
        match self {
            Orientation::Angles(of) => {
                let angles = columns(of, nodes, "rotate")?;
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
                let (found, range) = self.ranged(nodes, outside)?;
                let mut frames: Vec<Mat3> = found.iter().map(|p| p.frame).collect();
                let least = |n: usize| found[n].gaps().into_iter().map(|g| g / range).fold(f64::INFINITY, f64::min);
                let turns = cube();
                let agree = |n: usize, f: &Mat3, to: &Mat3| settled(f, &found[n].own_gaps(range), to, &turns);
                comb(grid, &mut frames, first_in(outside, least), |n, f| agree(n, f, &IDENTITY), agree);
                Ok(Frames { at_nodes: frames, trust: None, range })
            }
        }
    }

    /// The frames that are asked for at nodes, without signs and order, and the range of a stress in the part. Where cells are not turned
    /// at all, nothing is asked for.
    fn asked(&self, grid: &Grid, nodes: &[Vec3], outside: Option<&[f64]>) -> Result<(Asked, f64), Fault> {
        match self {
            Orientation::Stress(_) => {
                let (found, range) = self.ranged(nodes, outside)?;
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
                    Orientation::Direction(_) => [0.0, 0.0, 1.0],
                    _ => [1.0; 3],
                };
                let frames = self.frames(grid, nodes, None, None, outside)?.at_nodes;
                Ok((Box::new(move |n| Octahedral::of(&frames[n], &gaps)), 0.0))
            }
        }
    }

    /// The principal directions of a stress, and the range of its values in the part.
    fn ranged(&self, nodes: &[Vec3], outside: Option<&[f64]>) -> Result<(Vec<Principal>, f64), Fault> {
        let found = self.principal(nodes)?;
        let range = range(&found, outside);
        if range == 0.0 { Err(no_principal()) } else { Ok((found, range)) }
    }

    /// The principal directions of a stress at points; none of other orientations.
    pub(super) fn principal(&self, points: &[Vec3]) -> Result<Vec<Principal>, Fault> {
        let Orientation::Stress(of) = self else { return Ok(Vec::new()) };
        of.principal(points)
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
    pub(super) fn alike(&self) -> Alike {
        match self {
            Orientation::Direction(_) => Alike::Line,
            Orientation::Frame(_) | Orientation::Stress(_) => Alike::Turned(cube()),
            Orientation::Angles(_) => Alike::Turned(vec![IDENTITY]),
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
                let angles = columns(of, points, "rotate")?;
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
pub(super) struct Frames {
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

/// The principal directions of the greatest values of tensors v vᵀ or sums of such.
fn along(tensors: &[[f64; 6]], points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
    let one = |(t, p): (&[f64; 6], &Vec3)| {
        let Principal { frame, values, .. } = Principal::of(t);
        let i = (0..3).fold(0, |m, i| if values[i] > values[m] { i } else { m });
        if values[i] < 1e-12 * (t[0] + t[1] + t[2]).max(f64::MIN_POSITIVE) {
            return Err(no_direction(key, *p));
        }
        Ok([frame[0][i], frame[1][i], frame[2][i]])
    };
    tensors.par_iter().zip(points).map(one).collect()
}

fn no_direction(key: &str, p: Vec3) -> Fault {
    Fault::new(key, format!("the vector is zero at {}; it needs a direction all over the region's bounds", position(p)))
}

/// The frame between those at the nodes about a point, in the branch of the first of them: their mean, made orthonormal; of the nearest
/// node where they are too far apart for a mean.
pub(super) fn interpolated(grid: &Grid, frames: &[Mat3], cuts: Option<&CutCells>, p: Vec3) -> Mat3 {
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

/// The frames of first and third axes: the third exactly, the first as nearly as it can.
pub(super) fn squared(x: Vec<Vec3>, z: Vec<Vec3>, points: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
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

/// Values of several grades at points: one tuple for each point.
pub(super) fn columns<const N: usize>(of: &[Grade; N], points: &[Vec3], key: &str) -> Result<Vec<[f64; N]>, Fault> {
    let mut out = vec![[0.0; N]; points.len()];
    let mut values = vec![0.0; points.len()];
    for (c, grade) in of.iter().enumerate() {
        grade.values(points, &mut values);
        for (n, (o, v)) in out.iter_mut().zip(&values).enumerate() {
            if !v.is_finite() {
                return Err(Fault::new(
                    key,
                    format!(
                        "found {} at {}; it must be a finite number all over the region's bounds",
                        number(*v),
                        position(points[n])
                    ),
                ));
            }
            o[c] = *v;
        }
    }
    Ok(out)
}

/// Unit vectors.
fn vectors(of: &[Grade; 3], points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
    let mut found = columns(of, points, key)?;
    for (v, p) in found.iter_mut().zip(points) {
        if norm(*v) < 1e-12 {
            return Err(no_direction(key, *p));
        }
        *v = unit(*v);
    }
    Ok(found)
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

/// The 24 rotations of a cube.
pub(super) fn cube() -> Vec<Mat3> {
    let mut all = Vec::new();
    for p in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let mut m = [[0.0; 3]; 3];
            for a in 0..3 {
                m[p[a]][a] = if signs >> a & 1 == 0 { 1.0 } else { -1.0 };
            }
            if determinant(&m) > 0.0 {
                all.push(m);
            }
        }
    }
    all
}

/// Of the frames that differ from `f` by a turn of the cube, the one that is turned least from `to`.
pub(super) fn nearest(f: &Mat3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    let agree = |m: &Mat3| -> f64 { m.as_flattened().iter().zip(to.as_flattened()).map(|(a, b)| a * b).sum() };
    // Turns of the cube are a quarter or more: within an eighth, whose cosine this is, there is no nearer one.
    if agree(f) > 1.0 + core::f64::consts::SQRT_2 {
        return *f;
    }
    let all = turns.iter().map(|t| product(f, t));
    all.max_by(|a, b| agree(a).total_cmp(&agree(b))).unwrap_or(*f)
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

/// Goes from node to node, the surest first, and makes each agree with the one that it was reached from: doubtful
/// nodes come last, so that none depends on them. Returns the first, which has the value that `first` gives it.
pub(super) fn comb<T: Copy>(
    grid: &Grid,
    values: &mut [T],
    sure: impl Fn(usize) -> f64,
    first: impl Fn(usize, &T) -> T,
    agree: impl Fn(usize, &T, &T) -> T,
) -> usize {
    let strides = grid.strides();
    let sure: Vec<f64> = (0..values.len()).map(sure).collect();
    // The surest first, of equals the first node: the number of a node in this order says when it is its turn, and of the nodes that
    // it may be reached from the least is the one.
    let mut order: Vec<u32> = (0..values.len() as u32).collect();
    order.par_sort_unstable_by(|&a, &b| sure[b as usize].total_cmp(&sure[a as usize]).then(a.cmp(&b)));
    let mut rank = vec![0u32; order.len()];
    order.iter().zip(0..).for_each(|(n, r)| rank[*n as usize] = r);
    let mut reached = vec![false; values.len()];
    let mut from_rank = vec![u32::MAX; values.len()];
    let mut heap = BinaryHeap::from([Reverse(0u64)]);
    let start = order.first().map_or(0, |n| *n as usize);
    values[start] = first(start, &values[start]);
    while let Some(Reverse(step)) = heap.pop() {
        checkpoint();
        let [node, from] = [step >> 32, step & 0xffff_ffff].map(|r| order[r as usize] as usize);
        if core::mem::replace(&mut reached[node], true) {
            continue;
        }
        values[node] = agree(node, &values[node], &values[from]);
        let at = grid.index(node);
        for a in 0..3 {
            let below = (at[a] > 0).then(|| node - strides[a]);
            let above = (at[a] + 1 < grid.shape[a]).then(|| node + strides[a]);
            for next in below.into_iter().chain(above).filter(|&n| !reached[n]) {
                if rank[node] < from_rank[next] {
                    from_rank[next] = rank[node];
                    heap.push(Reverse(u64::from(rank[next]) << 32 | u64::from(rank[node])));
                }
            }
        }
    }
    start
}

/// How sure nodes are, those in the part before all others, and of these the nearest to it first.
pub(super) fn first_in<'a>(outside: Option<&'a [f64]>, sure: impl Fn(usize) -> f64 + 'a) -> impl Fn(usize) -> f64 + 'a {
    move |n| match outside.map(|d| d[n]) {
        Some(distance) if distance > 0.0 => -distance,
        _ => sure(n),
    }
}

#[cfg(test)]
mod tests;
