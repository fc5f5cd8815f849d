//! Caps as smooth as the surface about them.
//!
//! A cap that continues a curved surface is refined to the spacing of its boundary and then bent so that the
//! squares of its Laplacians, those of the boundary with the surface beyond included, are least: P. Liepa, Filling holes in
//! meshes, Symp. Geometry Processing (2003) 200. A cap that meets the surface at an edge, as the end of a tube does,
//! stays as it was triangulated, and so does one that is flat with it.

use std::collections::HashMap;

use crate::math::{Vec3, add, cross, dot, norm, scale, sub};

/// Loops of fewer vertices are not refined.
const SMALL: usize = 7;
/// The mean cosine of the fold at the boundary of caps that are bent: from a degree to 60 degrees.
const BENT: core::ops::Range<f64> = 0.5..0.9998;
/// Rounds of refinement, each of which may halve the spacing.
const ROUNDS: usize = 12;
/// A cap of more triangles per corner of its boundary is not refined further.
const FINE: usize = 60;
/// A bent cap of more than this multiple of its area before has gone wrong.
const BLOWN: f64 = 2.0;

/// The neighbours of the corners of the holes.
#[derive(Debug, Default)]
pub struct VertexNeighbours {
    /// Corners joined to each corner by edges.
    pub joined: HashMap<u32, Vec<u32>>,
}

/// The cap `patch` of the loop `boundary`, refined and bent if the surface about it is; `slopes` are the normals beyond
/// the sides of the loop. New corners are appended to `vertices`.
pub fn smoothed(
    vertices: &mut Vec<Vec3>,
    boundary: &[u32],
    patch: Vec<[u32; 3]>,
    slopes: &[Option<Vec3>],
    neighbours: &VertexNeighbours,
) -> Vec<[u32; 3]> {
    if boundary.len() < SMALL {
        return patch;
    }
    let side: HashMap<(u32, u32), Vec3> = (0..boundary.len())
        .filter_map(|i| slopes[i].map(|n| ((boundary[i], boundary[(i + 1) % boundary.len()]), n)))
        .collect();
    let (mut fold, mut count) = (0.0, 0.0);
    for t in &patch {
        let normal = crate::distance::triangle::normal(t.map(|v| vertices[v as usize]));
        for k in 0..3 {
            if let Some(n) = side.get(&(t[k], t[(k + 1) % 3])) {
                fold += dot(normal, *n);
                count += 1.0;
            }
        }
    }
    // Written so that caps without area, whose normals are no numbers, are left alone.
    if !BENT.contains(&(fold / count)) {
        return patch;
    }
    let first = vertices.len();
    let fine = refined(vertices, boundary, &patch);
    bend(vertices, first, boundary, &fine, neighbours);
    let area = |v: &[Vec3], patch: &[[u32; 3]]| {
        let twice = patch.iter().map(|t| {
            let [a, b, c] = t.map(|i| v[i as usize]);
            norm(cross(sub(b, a), sub(c, a)))
        });
        twice.sum::<f64>()
    };
    if area(vertices, &fine) <= BLOWN * area(vertices, &patch) {
        fine
    } else {
        vertices.truncate(first);
        patch
    }
}

/// Splits triangles at their middles while those are farther from the corners than the spacing there, and turns edges
/// to be Delaunay after each round.
fn refined(vertices: &mut Vec<Vec3>, boundary: &[u32], patch: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let n = boundary.len();
    let gap = |i: usize| {
        let [a, b] = [i % n, (i + 1) % n].map(|k| vertices[boundary[k] as usize]);
        norm(sub(a, b))
    };
    let mut spacing: HashMap<u32, f64> = (0..n).map(|i| (boundary[i], (gap(i) + gap(i + n - 1)) / 2.0)).collect();
    let mut fine = patch.to_vec();
    for _ in 0..ROUNDS {
        let mut next = Vec::with_capacity(3 * fine.len());
        for t in &fine {
            let p = t.map(|v| vertices[v as usize]);
            let s = t.map(|v| spacing[&v]);
            let middle = scale(add(p[0], add(p[1], p[2])), 1.0 / 3.0);
            let mean = (s[0] + s[1] + s[2]) / 3.0;
            let wide = (0..3).all(|k| {
                let d = core::f64::consts::SQRT_2 * norm(sub(middle, p[k]));
                d > mean && d > s[k]
            });
            if wide {
                let m = vertices.len() as u32;
                vertices.push(middle);
                spacing.insert(m, mean);
                next.extend([[t[0], t[1], m], [t[1], t[2], m], [t[2], t[0], m]]);
            } else {
                next.push(*t);
            }
        }
        let done = next.len() == fine.len() || next.len() > FINE * n;
        fine = next;
        for _ in 0..10 {
            if relax(vertices, &mut fine) == 0 {
                break;
            }
        }
        if done {
            break;
        }
    }
    fine
}

/// Turns edges whose opposite angles make more than half a turn; gives their number.
fn relax(vertices: &[Vec3], fine: &mut [[u32; 3]]) -> usize {
    let mut sides: HashMap<(u32, u32), usize> = HashMap::new();
    for (i, t) in fine.iter().enumerate() {
        for k in 0..3 {
            sides.insert((t[k], t[(k + 1) % 3]), i);
        }
    }
    let mut touched = vec![false; fine.len()];
    let mut turned = 0;
    for i in 0..fine.len() {
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|m| fine[i][(k + m) % 3]);
            let Some(&j) = sides.get(&(b, a)) else {
                continue;
            };
            if touched[i] || touched[j] {
                continue;
            }
            let Some(d) = fine[j].into_iter().find(|v| *v != a && *v != b) else {
                continue;
            };
            let angle = |at: u32| {
                let [p, q, r] = [at, a, b].map(|v| vertices[v as usize]);
                let (u, v) = (sub(q, p), sub(r, p));
                norm(cross(u, v)).atan2(dot(u, v))
            };
            let known = sides.contains_key(&(c, d)) || sides.contains_key(&(d, c));
            if !known && angle(c) + angle(d) > core::f64::consts::PI + 1e-9 {
                fine[i] = [a, d, c];
                fine[j] = [d, b, c];
                (touched[i], touched[j]) = (true, true);
                sides.insert((c, d), i); // only so that no other edge is turned onto it
                turned += 1;
                break;
            }
        }
    }
    turned
}

/// Moves the corners from `first` on so that Σ|v − mean of neighbours|² over the cap and its boundary is least, by conjugate
/// gradients on the normal equations.
fn bend(vertices: &mut [Vec3], first: usize, boundary: &[u32], fine: &[[u32; 3]], neighbours: &VertexNeighbours) {
    let free = vertices.len() - first;
    if free == 0 {
        return;
    }
    let mut joined: HashMap<u32, Vec<u32>> = HashMap::new();
    for t in fine {
        for k in 0..3 {
            let others = [t[(k + 1) % 3], t[(k + 2) % 3]];
            joined.entry(t[k]).or_default().extend(others);
        }
    }
    // In a fixed order, so that sums come out the same in every run.
    let mut rows: Vec<(u32, Vec<u32>)> = joined.into_iter().collect();
    rows.sort_unstable_by_key(|r| r.0);
    for (v, near) in &mut rows {
        if boundary.contains(v) {
            near.extend(neighbours.joined.get(v).into_iter().flatten());
        }
        near.sort_unstable();
        near.dedup();
    }
    let at = |v: u32| (v as usize).checked_sub(first);
    for axis in 0..3 {
        // The map A of moves of the free corners to the rows' Laplacians, and its transpose.
        let forward = |x: &[f64], fixed: bool| -> Vec<f64> {
            let value = |v: u32| match at(v) {
                Some(i) => x[i],
                None if fixed => vertices[v as usize][axis],
                None => 0.0,
            };
            let row = |(v, near): &(u32, Vec<u32>)| {
                value(*v) - near.iter().map(|w| value(*w)).sum::<f64>() / near.len() as f64
            };
            rows.iter().map(row).collect()
        };
        let back = |y: &[f64]| {
            let mut x = vec![0.0; free];
            for ((v, near), y) in rows.iter().zip(y) {
                if let Some(i) = at(*v) {
                    x[i] += y;
                }
                for i in near.iter().filter_map(|w| at(*w)) {
                    x[i] -= y / near.len() as f64;
                }
            }
            x
        };
        let square = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>();
        let mut x: Vec<f64> = vertices[first..].iter().map(|v| v[axis]).collect();
        let mut r = back(&forward(&x, true));
        r.iter_mut().for_each(|v| *v = -*v);
        let mut p = r.clone();
        let (start, mut now) = (square(&r), square(&r));
        for _ in 0..4 * free.min(500) {
            if now <= 1e-20 * start {
                break;
            }
            let q = forward(&p, false);
            let step = now / square(&q);
            if !step.is_finite() {
                break;
            }
            let image = back(&q);
            for i in 0..free {
                x[i] += step * p[i];
                r[i] -= step * image[i];
            }
            let next = square(&r);
            for i in 0..free {
                p[i] = r[i] + next / now * p[i];
            }
            now = next;
        }
        for (v, x) in vertices[first..].iter_mut().zip(&x) {
            v[axis] = *x;
        }
    }
}
