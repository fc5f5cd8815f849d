//! Which way a cell is turned: orthonormal frames from angles, vectors or a stress tensor.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::grid::Grid;
use crate::fault::{Fault, number};
use crate::grade::Grade;
use crate::math::{
    IDENTITY, Mat3, Vec3, cross, determinant, dot, norm, product, rotation, scale, sub, transpose,
    unit,
};

/// Which way a cell is turned at each place. A frame's columns are the directions of the cell's axes in space.
#[derive(Clone)]
pub enum Orientation {
    /// R = Rx Ry Rz of three angles (degrees).
    Angles([Grade; 3]),
    /// The third axis along a vector, by the least turn from z. The vector's sign and length do not matter.
    Direction([Grade; 3]),
    /// The first and the third axis along two vectors: the third exactly, the first as nearly as it can.
    Frame {
        /// The first axis.
        x: [Grade; 3],
        /// The third axis.
        z: [Grade; 3],
    },
    /// The axes along the principal directions of a symmetric tensor, given as 11, 22, 33, 23, 13, 12.
    Stress([Grade; 6]),
}

impl Orientation {
    /// The frames at the nodes of a grid. Where signs and axes are not given, they are chosen so that neighbours agree.
    pub(super) fn frames(&self, grid: &Grid, nodes: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
        match self {
            Orientation::Angles(of) => {
                let angles = columns(of, nodes, "rotate")?;
                if of.iter().all(|g| g.constant().is_some()) {
                    return Ok(vec![rotation(angles[0]); nodes.len()]);
                }
                Ok(angles.into_iter().map(rotation).collect())
            }
            Orientation::Direction(of) => {
                let mut along = vectors(of, nodes, "direction")?;
                comb(
                    grid,
                    &mut along,
                    |_| 1.0,
                    |v, to| {
                        if dot(*v, *to) < 0.0 {
                            scale(*v, -1.0)
                        } else {
                            *v
                        }
                    },
                );
                Ok(along.into_iter().map(turned_from_z).collect())
            }
            Orientation::Frame { x, z } => {
                let (x, z) = (vectors(x, nodes, "frame.x")?, vectors(z, nodes, "frame.z")?);
                let both = x.into_iter().zip(z).enumerate();
                both.map(|(n, (x, z))| {
                    let x = sub(x, scale(z, dot(x, z)));
                    if norm(x) < 1e-6 {
                        let message = format!(
                            "the first and the third axis are parallel at {}; give two that differ",
                            place(nodes[n])
                        );
                        return Err(Fault::new("frame.x", message));
                    }
                    let x = unit(x);
                    Ok(transpose(&[x, cross(z, x), z]))
                })
                .collect()
            }
            Orientation::Stress(of) => {
                let values = columns(of, nodes, "stress")?;
                let found: Vec<(Mat3, f64)> = values.iter().map(principal).collect();
                if found.iter().all(|f| f.1 == 0.0) {
                    return Err(Fault::new(
                        "stress",
                        "the stress is the same in all directions, or zero, everywhere: it has no principal directions",
                    ));
                }
                let sure: Vec<f64> = found.iter().map(|f| f.1).collect();
                let mut frames: Vec<Mat3> = found.into_iter().map(|f| f.0).collect();
                let turns = cube();
                comb(
                    grid,
                    &mut frames,
                    |n| sure[n],
                    |f, to| nearest(f, to, &turns),
                );
                Ok(frames)
            }
        }
    }
}

/// Values of some grades at points, side by side.
fn columns<const N: usize>(
    of: &[Grade; N],
    points: &[Vec3],
    key: &str,
) -> Result<Vec<[f64; N]>, Fault> {
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
                        place(points[n])
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
            return Err(Fault::new(
                key,
                format!(
                    "the vector is zero at {}; it needs a direction all over the region's bounds",
                    place(*p)
                ),
            ));
        }
        *v = unit(*v);
    }
    Ok(found)
}

pub(super) fn place([x, y, z]: Vec3) -> String {
    format!("({x:.4}, {y:.4}, {z:.4}) mm")
}

/// The frame of the least turn that takes z to `d`.
fn turned_from_z(d: Vec3) -> Mat3 {
    let [x, y, z] = d;
    if z < -1.0 + 1e-12 {
        return [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    }
    let s = 1.0 / (1.0 + z);
    transpose(&[
        [1.0 - x * x * s, -x * y * s, -x],
        [-x * y * s, 1.0 - y * y * s, -y],
        [x, y, z],
    ])
}

/// The principal directions of a symmetric tensor, as a right-handed frame, and how well they are told apart: the least
/// gap between principal values, over the greatest value.
fn principal(t: &[f64; 6]) -> (Mat3, f64) {
    let [xx, yy, zz, yz, xz, xy] = *t;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut v = IDENTITY;
    let size = a.as_flattened().iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if size == 0.0 {
        return (v, 0.0);
    }
    // Jacobi's rotations: a few rounds leave nothing off the diagonal.
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= 1e-300 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let mut r = IDENTITY;
            (r[p][p], r[q][q], r[p][q], r[q][p]) = (c, c, t * c, -t * c);
            a = product(&transpose(&r), &product(&a, &r));
            v = product(&v, &r);
        }
    }
    let mut values = [a[0][0], a[1][1], a[2][2]];
    values.sort_by(f64::total_cmp);
    let gap = (values[1] - values[0]).min(values[2] - values[1]);
    if determinant(&v) < 0.0 {
        v = v.map(|row| row.map(|c| -c));
    }
    (v, gap / size)
}

/// The 24 turns of a cube.
fn cube() -> Vec<Mat3> {
    let mut all = Vec::new();
    for p in [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ] {
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
fn nearest(f: &Mat3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    let agree = |m: &Mat3| -> f64 {
        m.as_flattened()
            .iter()
            .zip(to.as_flattened())
            .map(|(a, b)| a * b)
            .sum()
    };
    let all = turns.iter().map(|t| product(f, t));
    all.max_by(|a, b| agree(a).total_cmp(&agree(b)))
        .unwrap_or(*f)
}

/// A node that may be reached next.
struct Step {
    sure: f64,
    node: usize,
    from: usize,
}

impl PartialEq for Step {
    fn eq(&self, o: &Step) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}
impl Eq for Step {}
impl PartialOrd for Step {
    fn partial_cmp(&self, o: &Step) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Step {
    fn cmp(&self, o: &Step) -> Ordering {
        self.sure
            .total_cmp(&o.sure)
            .then(o.node.cmp(&self.node))
            .then(o.from.cmp(&self.from))
    }
}

/// Goes from node to node, the surest first, and makes each agree with the one that it was reached from: doubtful
/// places come last, where they can do no harm. The first is made to agree with the axes of space.
fn comb<T: Copy + FirstOf>(
    grid: &Grid,
    values: &mut [T],
    sure: impl Fn(usize) -> f64,
    agree: impl Fn(&T, &T) -> T,
) {
    let strides = grid.strides();
    let mut seen = vec![false; values.len()];
    let mut heap = BinaryHeap::new();
    let start = (0..values.len())
        .max_by(|&a, &b| sure(a).total_cmp(&sure(b)).then(b.cmp(&a)))
        .unwrap_or(0);
    values[start] = agree(&values[start], &T::FIRST);
    heap.push(Step {
        sure: sure(start),
        node: start,
        from: start,
    });
    while let Some(Step { node, from, .. }) = heap.pop() {
        if core::mem::replace(&mut seen[node], true) {
            continue;
        }
        values[node] = agree(&values[node], &values[from]);
        let at = grid.index(node);
        for a in 0..3 {
            let below = (at[a] > 0).then(|| node - strides[a]);
            let above = (at[a] + 1 < grid.shape[a]).then(|| node + strides[a]);
            for next in below.into_iter().chain(above).filter(|&n| !seen[n]) {
                heap.push(Step {
                    sure: sure(next),
                    node: next,
                    from: node,
                });
            }
        }
    }
}

/// What the first node is made to agree with.
trait FirstOf {
    const FIRST: Self;
}
impl FirstOf for Vec3 {
    const FIRST: Vec3 = [1e-6, 1e-3, 1.0];
}
impl FirstOf for Mat3 {
    const FIRST: Mat3 = IDENTITY;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grade::Formula;
    use crate::math::{Aabb, apply};

    fn formula(text: &str) -> Grade {
        Grade::Formula(Formula::parse(text).expect("formula"))
    }

    fn grid() -> (Grid, Vec<Vec3>) {
        let b = Aabb {
            min: [1.0, 2.0, 3.0],
            max: [5.0, 5.0, 6.0],
        };
        let g = Grid::over(&b, [12, 9, 8]);
        let nodes = (0..g.len()).map(|n| g.node(n)).collect();
        (g, nodes)
    }

    fn angle(a: &Mat3, b: &Mat3) -> f64 {
        let trace: f64 = a
            .as_flattened()
            .iter()
            .zip(b.as_flattened())
            .map(|(a, b)| a * b)
            .sum();
        ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// A stress made from a smoothly turning frame, its principal values changing order half way: the frames found are
    /// that frame everywhere, up to one turn of the cube.
    #[test]
    fn combed_frames_are_smooth_through_a_crossing_of_principal_values() {
        let (g, nodes) = grid();
        let frame = |p: Vec3| rotation([10.0 * p[0], 5.0 * p[1] * p[2], 20.0 * p[0] - 7.0 * p[2]]);
        let tensor = |p: Vec3| {
            let (f, d) = (frame(p), [p[0] - 3.05, 10.0, -8.0]);
            let m = product(
                &f,
                &product(
                    &[
                        [d[0], 0.0, 0.0],
                        [0.0, 6.1 - p[0] - 3.05, 0.0],
                        [0.0, 0.0, d[2]],
                    ],
                    &transpose(&f),
                ),
            );
            [m[0][0], m[1][1], m[2][2], m[1][2], m[0][2], m[0][1]]
        };
        let turns = cube();
        assert_eq!(turns.len(), 24);
        let found: Vec<(Mat3, f64)> = nodes.iter().map(|p| principal(&tensor(*p))).collect();
        let mut frames: Vec<Mat3> = found.iter().map(|f| f.0).collect();
        comb(
            &g,
            &mut frames,
            |n| found[n].1,
            |f, to| nearest(f, to, &turns),
        );
        let by = product(&transpose(&frame(nodes[0])), &frames[0]);
        for (f, p) in frames.iter().zip(&nodes) {
            // The eigenvectors' rounding, over the gap.
            assert!(angle(f, &product(&frame(*p), &by)) < 1e-3);
            assert!((determinant(f) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn directions_are_lines_and_frames_are_orthonormal() {
        let (g, nodes) = grid();
        // The sign flips in the middle; lines do not care.
        let of = [
            formula("sin(x)*(y-3.3)"),
            formula("0.5*(y-3.3)"),
            formula("cos(x)*(y-3.3)"),
        ];
        let frames = Orientation::Direction(of)
            .frames(&g, &nodes)
            .expect("frames");
        for (n, f) in frames.iter().enumerate() {
            let want = unit([nodes[n][0].sin(), 0.5, nodes[n][0].cos()]);
            let z = apply(f, [0.0, 0.0, 1.0]);
            assert!((dot(z, want).abs() - 1.0).abs() < 1e-12);
            assert!(
                dot(
                    z,
                    apply(&frames[n - usize::from(n % 12 > 0)], [0.0, 0.0, 1.0])
                ) > 0.5
            );
            let ff = product(f, &transpose(f));
            assert!(angle(&ff, &IDENTITY) < 1e-5);
        }
        let zero = Orientation::Direction([formula("x-1"), formula("y-2"), formula("z-3")]);
        assert!(
            zero.frames(&g, &nodes)
                .expect_err("zero")
                .message
                .contains("(1.0000, 2.0000, 3.0000)")
        );
    }
}
