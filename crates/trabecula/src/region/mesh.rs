//! Closed triangle meshes as regions: the exact signed distance.

use crate::fault::Fault;
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, add, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;
use crate::region::Shape;

mod bvh;
mod check;
#[cfg(test)]
mod shapes;

use bvh::{Bvh, Feature, angle, closest_on_triangle};

/// A triangle whose sine at the first corner is below this has too uncertain a normal to measure along.
const SLIVER: f64 = 1e-6;

/// A closed triangle mesh as a region: the exact signed distance to its surface (mm), negative inside.
///
/// The sign comes from the angle-weighted pseudo-normal of the closest face, edge or vertex.
///
/// Source: Bærentzen & Aanæs, Signed Distance Computation Using the Angle Weighted Pseudonormal (2005).
#[derive(Clone, Debug)]
pub struct MeshRegion {
    bvh: Bvh,
    /// Vertex numbers of the triangles, in the tree's order.
    vertices: Vec<[u32; 3]>,
    /// The triangle across each edge k to k + 1, in the tree's order.
    neighbours: Vec<[u32; 3]>,
    /// Angle-weighted sums of unit normals, one per vertex.
    vertex_normals: Vec<Vec3>,
    bounds: Aabb,
    volume: f64,
}

/// Signed distance at a point, its gradient, and the triangle it was measured to.
struct Sample {
    distance: f64,
    gradient: Vec3,
    triangle: Option<u32>,
}

impl MeshRegion {
    /// Checks the mesh and builds the search tree.
    ///
    /// # Errors
    /// When the mesh is not one clean, closed body oriented outwards (cavities may lie inside it): the fault
    /// lists the numbers of vertices that are not finite, degenerate and duplicate triangles, open, crowded
    /// and flipped edges, vertices where the surface touches itself and bodies out of place.
    pub fn new(mesh: Mesh) -> Result<Self, Fault> {
        let topology = check::check(&mesh)?;
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
        let (bvh, order) = Bvh::new(&corners);
        let mut place = vec![0u32; order.len()];
        for (i, &t) in (0u32..).zip(&order) {
            place[t as usize] = i;
        }
        let neighbours = order
            .iter()
            .map(|&t| topology.neighbours[t as usize].map(|n| place[n as usize]))
            .collect();
        let vertices: Vec<[u32; 3]> = order.iter().map(|&t| mesh.triangles[t as usize]).collect();
        let mut vertex_normals = vec![[0.0; 3]; mesh.vertices.len()];
        for (i, t) in (0u32..).zip(&vertices) {
            let n = unit(bvh.normal(i));
            let c = &bvh.corners[i as usize];
            for k in 0..3 {
                let weight = angle(c[k], c[(k + 1) % 3], c[(k + 2) % 3]);
                let sum = &mut vertex_normals[t[k] as usize];
                *sum = add(*sum, scale(n, weight));
            }
        }
        let (bounds, volume) = (mesh.bounds(), topology.volume);
        Ok(MeshRegion {
            bvh,
            vertices,
            neighbours,
            vertex_normals,
            bounds,
            volume,
        })
    }

    /// Everything about `p`; `hint` is a triangle likely to be near and never changes the answer.
    #[inline]
    fn sample(&self, p: Vec3, hint: Option<u32>) -> Sample {
        self.measure(p, self.bvh.nearest(p, hint))
    }

    /// Everything about `p` from the triangle nearest to it.
    fn measure(&self, p: Vec3, nearest: Option<u32>) -> Sample {
        let Some(t) = nearest else {
            // Too far for a squared distance, or not a number.
            let distance = if p.iter().any(|v| v.is_nan()) {
                f64::NAN
            } else {
                f64::INFINITY
            };
            return Sample {
                distance,
                gradient: [0.0; 3],
                triangle: None,
            };
        };
        let corners = &self.bvh.corners[t as usize];
        let (q, feature) = closest_on_triangle(p, corners);
        let away = sub(p, q);
        let length = norm(away);
        let pseudo = match feature {
            Feature::Face => {
                let [a, b, c] = *corners;
                let n = self.bvh.normal(t);
                let unit = unit(n);
                let height = dot(sub(p, a), unit);
                if norm(n) > SLIVER * norm(sub(b, a)) * norm(sub(c, a)) {
                    return Sample {
                        distance: height,
                        gradient: unit,
                        triangle: Some(t),
                    };
                }
                unit
            }
            Feature::Edge(k) => {
                let across = self.neighbours[t as usize][k];
                add(unit(self.bvh.normal(t)), unit(self.bvh.normal(across)))
            }
            Feature::Vertex(k) => self.vertex_normals[self.vertices[t as usize][k] as usize],
        };
        let sign = if dot(away, pseudo) < 0.0 { -1.0 } else { 1.0 };
        // Closer than rounding, the direction away is noise.
        let noise = 16.0 * f64::EPSILON * q.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let gradient = if length > noise {
            scale(away, sign / length)
        } else {
            unit(pseudo)
        };
        Sample {
            distance: sign * length,
            gradient,
            triangle: Some(t),
        }
    }

    /// Fills the nodes from `lo` up to, not including, `hi`.
    ///
    /// When the surface is farther from the middle than every grid edge that touches these nodes, all have
    /// one sign and are given a lower bound of their distance; otherwise the longest side is halved.
    fn carve(
        &self,
        block: &Block,
        lo: [usize; 3],
        hi: [usize; 3],
        hint: &mut Option<u32>,
        level: f64,
        out: &mut [f32],
    ) {
        let first: Vec3 = std::array::from_fn(|a| block.axes[a][lo[a]]);
        let last: Vec3 = std::array::from_fn(|a| block.axes[a][hi[a] - 1]);
        let center: Vec3 = std::array::from_fn(|a| {
            if first[a] == last[a] {
                first[a]
            } else {
                (first[a] + last[a]) / 2.0
            }
        });
        let shape = block.shape();
        let index = |x: usize, y: usize, z: usize| (z * shape[1] + y) * shape[0] + x;
        if (0..3).all(|a| hi[a] - lo[a] == 1) {
            let here = self.sample(center, *hint);
            *hint = here.triangle;
            out[index(lo[0], lo[1], lo[2])] = round(here.distance - level);
            return;
        }
        let reach = norm(std::array::from_fn(|a| {
            reach(block.axes[a], lo[a], hi[a], center[a])
        })) * (1.0 + 1e-12);
        // At level zero one triangle within reach is enough to go on halving.
        let enough = if level == 0.0 { reach * reach } else { 0.0 };
        let found = self.bvh.search(center, *hint, enough);
        *hint = found.map(|(t, _)| t);
        let d = match found {
            Some((_, d2)) if level == 0.0 && d2 <= reach * reach => 0.0,
            _ => self.measure(center, *hint).distance - level,
        };
        if d.abs() > reach {
            for z in lo[2]..hi[2] {
                for y in lo[1]..hi[1] {
                    let (dy, dz) = (block.axes[1][y] - center[1], block.axes[2][z] - center[2]);
                    let side = dy * dy + dz * dz;
                    let row = &mut out[index(lo[0], y, z)..index(hi[0] - 1, y, z) + 1];
                    for (o, x) in row.iter_mut().zip(&block.axes[0][lo[0]..hi[0]]) {
                        let dx = x - center[0];
                        *o = round((d.abs() - (dx * dx + side).sqrt()).copysign(d));
                    }
                }
            }
            return;
        }
        let length = |a: usize| {
            if hi[a] - lo[a] > 1 {
                last[a] - first[a]
            } else {
                -1.0
            }
        };
        let a = (0..3).fold(0, |m, a| if length(a) > length(m) { a } else { m });
        let middle = (lo[a] + hi[a]) / 2;
        let (mut before, mut after) = (hi, lo);
        before[a] = middle;
        after[a] = middle;
        self.carve(block, lo, before, hint, level, out);
        self.carve(block, after, hi, hint, level, out);
    }
}

/// How far from `center` the grid edges at the nodes `lo..hi` reach along one axis. Beyond the ends of the
/// axis the last spacing is taken to go on.
fn reach(axis: &[f64], lo: usize, hi: usize, center: f64) -> f64 {
    let n = axis.len();
    if n < 2 {
        return 0.0;
    }
    let before = if lo > 0 {
        axis[lo - 1]
    } else {
        2.0 * axis[0] - axis[1]
    };
    let after = if hi < n {
        axis[hi]
    } else {
        2.0 * axis[n - 1] - axis[n - 2]
    };
    (center - before).max(after - center)
}

/// To single precision, except that nothing outside rounds onto the surface.
#[inline]
fn round(d: f64) -> f32 {
    let r = d as f32;
    if d > 0.0 && r == 0.0 {
        f32::MIN_POSITIVE
    } else {
        r
    }
}

impl Field for MeshRegion {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut hint = None;
        for (p, o) in points.iter().zip(out) {
            let s = self.sample(*p, hint);
            *o = s.distance;
            hint = s.triangle;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut hint = None;
        for ((p, v), g) in points.iter().zip(values).zip(gradients) {
            let s = self.sample(*p, hint);
            (*v, *g) = (s.distance, s.gradient);
            hint = s.triangle;
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            // No inside point is deeper than half the thinnest side of the bounds.
            let [x, y, z] = self.bounds.size();
            return Interval::new(-x.min(y).min(z) / 2.0, f64::INFINITY);
        }
        let (c, half) = (b.center(), norm(b.size()) / 2.0);
        let d = self.value(c);
        let rounding = 16.0 * f64::EPSILON * (norm(c) + half + d.abs());
        Interval::new(d - half - rounding, d + half + rounding)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl Shape for MeshRegion {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// None: a flat part of a mesh is many triangles, any of which may be out of plane by rounding.
    fn level_planes(&self, _axis: usize, _level: f64, _out: &mut Vec<f64>) {}

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        if !block.is_empty() {
            self.carve(block, [0; 3], block.shape(), &mut None, level, out);
        }
    }

    fn volume(&self) -> Option<f64> {
        Some(self.volume)
    }
}

#[cfg(test)]
mod tests {
    use super::shapes::*;
    use super::*;
    use crate::math::cross;

    fn region(mesh: Mesh) -> MeshRegion {
        match MeshRegion::new(mesh) {
            Ok(r) => r,
            Err(fault) => panic!("{fault}"),
        }
    }

    /// Signed distance to a box.
    fn box_distance(p: Vec3, min: Vec3, max: Vec3) -> f64 {
        let q: Vec3 = std::array::from_fn(|a| (min[a] - p[a]).max(p[a] - max[a]));
        norm(q.map(|v| v.max(0.0))) + q[0].max(q[1]).max(q[2]).min(0.0)
    }

    #[test]
    fn a_cube_has_the_distance_of_a_box() {
        let (min, max) = ([-1.0, -2.0, 0.5], [2.0, 1.5, 3.0]);
        let r = region(cuboid(min, max));
        assert!((r.volume - 3.0 * 3.5 * 2.5).abs() < 1e-12);
        assert_eq!(Shape::bounds(&r), Aabb { min, max });
        let check = |p: Vec3| {
            let (got, want) = (r.value(p), box_distance(p, min, max));
            assert!((got - want).abs() < 1e-12, "{p:?}: {got} instead of {want}");
        };
        let mut random = Random(1);
        for _ in 0..20_000 {
            check(random.point(6.0));
        }
        // Faces, edges, corners, and the same continued inwards and outwards, diagonals of the faces included.
        let steps = |a: usize| {
            let (l, h) = (min[a], max[a]);
            [
                l - 1.0,
                l,
                l + 1e-9,
                0.75 * l + 0.25 * h,
                0.5 * (l + h),
                h - 1e-9,
                h,
                h + 1e-9,
                h + 2.0,
            ]
        };
        for x in steps(0) {
            for y in steps(1) {
                for z in steps(2) {
                    check([x, y, z]);
                }
            }
        }
        // On the plane of a face, exactly zero.
        for _ in 0..1000 {
            let p = random.point(1.0);
            assert_eq!(r.value([max[0], p[1], 1.0 + 0.4 * p[2]]), 0.0);
            assert_eq!(r.value([p[0], min[1], 1.0 + 0.4 * p[2]]), 0.0);
        }
    }

    #[test]
    fn a_sphere_is_within_its_chord_error() {
        let mesh = moved(icosphere(4), 5.0, [10.0, -20.0, 3.0]);
        // Deepest point of a triangle below the sphere.
        let error = (0..mesh.triangles.len())
            .map(|i| {
                let [a, b, c] = mesh.corners(i).map(|p| sub(p, [10.0, -20.0, 3.0]));
                5.0 - dot(a, unit(cross(sub(b, a), sub(c, a))))
            })
            .fold(0.0, f64::max);
        assert!(error < 0.02);
        let volume = mesh.volume();
        let r = region(mesh);
        assert!((r.volume - volume).abs() < 1e-9);
        let mut random = Random(2);
        for _ in 0..5000 {
            let p = random.point(9.0);
            let excess = r.value(add(p, [10.0, -20.0, 3.0])) - (norm(p) - 5.0);
            assert!(
                (-1e-12..=error + 1e-12).contains(&excess),
                "{p:?}: {excess}, {error}"
            );
        }
    }

    #[test]
    fn a_torus_and_a_cavity_have_their_signs() {
        let r = region(torus(3.0, 1.0, 96, 48));
        let hollow = region(joined(
            cuboid([-4.0; 3], [4.0; 3]),
            flipped(moved(icosphere(3), 2.0, [0.5, 0.0, 0.0])),
        ));
        assert!((hollow.volume - 512.0 + 4.0 / 3.0 * core::f64::consts::PI * 8.0).abs() < 0.5);
        let mut random = Random(3);
        for _ in 0..5000 {
            let p = random.point(5.0);
            let want = (p[0].hypot(p[1]) - 3.0).hypot(p[2]) - 1.0;
            assert!((r.value(p) - want).abs() < 0.01, "torus {p:?}");
            let inner = 2.0 - norm(sub(p, [0.5, 0.0, 0.0]));
            let want = box_distance(p, [-4.0; 3], [4.0; 3]).max(inner);
            let got = hollow.value(p);
            assert!((got - want).abs() < 0.02, "cavity {p:?}: {got}, {want}");
        }
    }

    #[test]
    fn the_search_is_that_of_every_triangle_whatever_the_hint() {
        let r = region(wavy(3, 10.0));
        let n = r.bvh.corners.len() as u32;
        let mut random = Random(4);
        for i in 0..2000 {
            let p = random.point(14.0);
            let d2 = |t: u32| {
                let away = sub(p, closest_on_triangle(p, &r.bvh.corners[t as usize]).0);
                dot(away, away)
            };
            let best = (0..n).min_by(|&s, &t| d2(s).total_cmp(&d2(t)));
            assert_eq!(r.bvh.nearest(p, None), best, "{p:?}");
            assert_eq!(r.bvh.nearest(p, Some((i * 37) % n)), best, "{p:?}");
        }
        for i in 0..n {
            // At a vertex several triangles are equally near: the first in order, always.
            let p = r.bvh.corners[i as usize][0];
            assert_eq!(r.bvh.nearest(p, None), r.bvh.nearest(p, Some(i)));
            assert_eq!(r.value(p), 0.0);
        }
    }

    #[test]
    fn the_gradient_is_the_slope() {
        let r = region(wavy(3, 10.0));
        let mut random = Random(5);
        let points: Vec<Vec3> = (0..2000).map(|_| random.point(13.0)).collect();
        let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        r.gradients(&points, &mut v, &mut g);
        let mut kinks = 0;
        for ((p, v), g) in points.iter().zip(&v).zip(&g) {
            assert_eq!(*v, r.value(*p));
            assert!((norm(*g) - 1.0).abs() < 1e-12);
            let h = 1e-6;
            let slope: Vec3 = std::array::from_fn(|a| {
                let (mut q, mut s) = (*p, *p);
                q[a] += h;
                s[a] -= h;
                (r.value(q) - r.value(s)) / (2.0 * h)
            });
            // Only where another part of the surface is as near may the slope be another.
            kinks += usize::from(norm(sub(slope, *g)) > 1e-4);
        }
        assert!(kinks < 5, "{kinks}");
        // On the surface the gradient points out.
        for c in r.bvh.corners.iter().take(200) {
            let middle = scale(add(c[0], add(c[1], c[2])), 1.0 / 3.0);
            for p in [c[0], scale(add(c[0], c[1]), 0.5), middle] {
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                r.gradients(&[p], &mut v, &mut g);
                assert!(v[0].abs() < 1e-14 && (norm(g[0]) - 1.0).abs() < 1e-12);
                assert!(dot(g[0], unit(p)) > 0.5, "{p:?} {:?}", g[0]);
            }
        }
    }

    #[test]
    fn the_bound_holds() {
        let r = region(wavy(2, 10.0));
        let mut random = Random(6);
        for _ in 0..300 {
            let c = random.point(12.0);
            let half = random.point(3.0).map(f64::abs);
            let b = Aabb {
                min: sub(c, half),
                max: add(c, half),
            };
            let range = r.bound(&b);
            for _ in 0..20 {
                let t = random.point(1.0);
                let v = r.value(std::array::from_fn(|a| c[a] + t[a] * half[a]));
                assert!(range.lo <= v && v <= range.hi);
            }
        }
        assert!(r.bound(&Aabb::ALL).lo <= r.value([0.0; 3]));
    }

    /// Node coordinates with uneven spacing.
    fn axis(random: &mut Random, n: usize, start: f64, step: f64) -> Vec<f64> {
        let mut x = start;
        (0..n)
            .map(|_| {
                x += step * (1.0 + 0.8 * random.number());
                x
            })
            .collect()
    }

    #[test]
    fn a_filled_block_has_every_sign_and_the_values_at_the_surface() {
        let r = region(wavy(3, 10.0));
        let mut random = Random(7);
        let mut crossings = 0;
        for run in 0..30 {
            let step = [0.15, 0.4, 1.2][run % 3];
            let start = random.point(11.0);
            let n: [usize; 3] =
                std::array::from_fn(|_| 1 + (20.0 * random.number().abs()) as usize);
            let axes: [Vec<f64>; 3] =
                std::array::from_fn(|a| axis(&mut random, n[a], start[a], step));
            let block = Block {
                axes: [&axes[0], &axes[1], &axes[2]],
            };
            let mut out = vec![f32::NAN; block.len()];
            r.fill(&block, &mut out);
            let node = |i: usize| -> [usize; 3] { [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])] };
            let exact: Vec<f64> = (0..out.len())
                .map(|i| {
                    let k = node(i);
                    r.value(std::array::from_fn(|a| axes[a][k[a]]))
                })
                .collect();
            for i in 0..out.len() {
                let (v, w) = (f64::from(out[i]), exact[i]);
                assert!((v > 0.0) == (w > 0.0), "node {i}: {v} instead of {w}");
                assert!(
                    v.abs() <= w.abs() * (1.0 + 1e-6) + 1e-12,
                    "node {i}: {v} beyond {w}"
                );
                let k = node(i);
                for (a, stride) in [1, n[0], n[0] * n[1]].into_iter().enumerate() {
                    if k[a] + 1 < n[a] && (w > 0.0) != (exact[i + stride] > 0.0) {
                        crossings += 1;
                        assert_eq!(out[i], round(w));
                        assert_eq!(out[i + stride], round(exact[i + stride]));
                    }
                }
            }
        }
        assert!(crossings > 1000, "{crossings}");
    }

    #[test]
    fn outside_never_rounds_onto_the_surface() {
        assert_eq!(round(1e-60), f32::MIN_POSITIVE);
        assert_eq!(round(0.0), 0.0);
        assert!(round(-1e-60) <= 0.0);
    }

    #[test]
    fn points_that_are_no_place_are_answered() {
        let r = region(cuboid([0.0; 3], [1.0; 3]));
        assert!(r.value([f64::NAN, 0.0, 0.0]).is_nan());
        assert_eq!(r.value([f64::INFINITY, 0.0, 0.0]), f64::INFINITY);
        assert!(r.value([1e30, 0.0, 0.0]) > 9e29);
    }

    #[test]
    fn needles_and_sharp_edges_keep_their_sign() {
        let mut flat = wavy(3, 10.0);
        for p in &mut flat.vertices {
            p[2] *= 0.002;
        }
        let mut random = Random(9);
        for r in [
            region(flat),
            region(torus(3.0, 0.5, 3, 400)),
            region(torus(3.0, 1.0, 300, 3)),
        ] {
            let size = r.bounds.size();
            for _ in 0..1000 {
                let p: Vec3 = std::array::from_fn(|a| 0.6 * size[a] * random.number());
                // How often the surface goes around p, by solid angles.
                let half: f64 = r
                    .bvh
                    .corners
                    .iter()
                    .map(|t| {
                        let [a, b, c] = t.map(|q| sub(q, p));
                        let (la, lb, lc) = (norm(a), norm(b), norm(c));
                        let x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
                        dot(a, cross(b, c)).atan2(x)
                    })
                    .sum();
                let around = half / core::f64::consts::TAU;
                assert!((around - around.round()).abs() < 1e-6);
                assert_eq!(
                    r.value(p) < 0.0,
                    around > 0.5,
                    "{p:?}: {}, {around}",
                    r.value(p)
                );
            }
        }
    }

    #[test]
    fn blocks_that_share_nodes_agree() {
        let r = region(wavy(3, 10.0));
        let axis: Vec<f64> = (0..33).map(|i| -12.8 + 0.8 * f64::from(i)).collect();
        let whole = |axes: [&[f64]; 3]| {
            let block = Block { axes };
            let mut out = vec![0f32; block.len()];
            r.fill(&block, &mut out);
            out
        };
        let all = whole([&axis; 3]);
        let reach = 0.8;
        for k in 0..8 {
            let from = [0, 1, 2].map(|a| 16 * (k >> a & 1));
            let out = whole(from.map(|f| &axis[f..f + 17]));
            for (i, v) in out.iter().enumerate() {
                let n = [i % 17 + from[0], i / 17 % 17 + from[1], i / 289 + from[2]];
                let w = all[(n[2] * 33 + n[1]) * 33 + n[0]];
                assert_eq!(*v > 0.0, w > 0.0);
                if r.value(n.map(|j| axis[j])).abs() <= reach {
                    assert_eq!(*v, w);
                }
            }
        }
    }
}
