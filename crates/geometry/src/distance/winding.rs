//! How often an oriented set of triangles winds about a point.
//!
//! The generalised winding number is the solid angle of the triangles over 4π: a whole number where they close, and
//! smooth across what is missing. Far sets of triangles are replaced by their dipole, its first and its second moment:
//! G. Barill, N. G. Dickson, R. Schmidt, D. I. W. Levin and A. Jacobson, Fast winding numbers for soups and clouds,
//! ACM Trans. Graph. 37 (2018) 43. One triangle: A. van Oosterom and J. Strackee, The solid angle of a plane triangle,
//! IEEE Trans. Biomed. Eng. 30 (1983) 125.

use core::f64::consts::PI;

use rayon::prelude::*;

use super::triangle::Triangle;
use super::triangle_bvh::TriangleBvh;
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};

/// Solid angle of a triangle seen from `p`, over 4π: positive where the normal points away from `p`.
pub fn turn(corners: [Vec3; 3], p: Vec3) -> f64 {
    let [above, below] = sides(corners, p);
    // On the triangle itself the two sides cancel: the mean is taken.
    if above == 0.0 {
        return 0.0;
    }
    above.atan2(below) / (2.0 * PI)
}

/// Half the solid angle of a triangle is the angle of a complex number: its imaginary and its real part.
#[inline]
fn sides(corners: [Vec3; 3], p: Vec3) -> [f64; 2] {
    let [a, b, c] = corners.map(|q| sub(q, p));
    let (la, lb, lc) = (norm(a), norm(b), norm(c));
    let above = dot(a, cross(b, c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    [above, below]
}

/// A sum of angles below a half turn, as the angle of a product of complex numbers and the full turns it has made:
/// one arc tangent for all.
struct Angle {
    re: f64,
    im: f64,
    full: i32,
}

impl Angle {
    #[inline]
    fn add(&mut self, [above, below]: [f64; 2]) {
        if above == 0.0 {
            return; // on the triangle: the mean of both sides
        }
        let im = self.re * above + self.im * below;
        self.re = self.re * below - self.im * above;
        // The way round, by less than half a turn, went through the negative half-axis.
        if above > 0.0 && self.im >= 0.0 && im < 0.0 {
            self.full += 1;
        } else if above < 0.0 && self.im < 0.0 && im >= 0.0 {
            self.full -= 1;
        }
        self.im = im;
    }

    /// Keeps the product from overflowing.
    fn rescale(&mut self) {
        let size = self.re.abs() + self.im.abs();
        self.re /= size;
        self.im /= size;
    }

    /// In turns.
    fn turns(&self) -> f64 {
        f64::from(self.full) + (self.im + 0.0).atan2(self.re) / (2.0 * PI)
    }
}

/// Moments of a set of triangles about its middle: ∫ n, ∫ x n and ∫ x x n dA, folded to what the expansion needs.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    center: Vec3,
    /// Distance from the middle to the farthest corner.
    radius: f64,
    normal: Vec3,
    /// Σᵢ ∫ xᵢ nᵢ.
    trace: f64,
    /// ∫ xᵢ nⱼ + xⱼ nᵢ, halved: xx, yy, zz, xy, yz, zx.
    first: [f64; 6],
    /// Σᵢ ∫ 2 xₗ xᵢ nᵢ + xᵢ xᵢ nₗ.
    vector: Vec3,
    /// ∫ xᵢ xⱼ nₖ as a cubic form: xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz.
    cubic: [f64; 10],
}

impl Moments {
    fn of(faces: &[Triangle], bounds: &crate::math::Aabb) -> Moments {
        let mut area = 0.0;
        let mut middle = [0.0; 3];
        for f in faces {
            let [a, b, c] = f.corners;
            let n = norm(cross(sub(b, a), sub(c, a)));
            area += n;
            middle = add(middle, scale(add(a, add(b, c)), n / 3.0));
        }
        let center = if area > 0.0 { scale(middle, 1.0 / area) } else { bounds.center() };
        let square = |p: &Vec3| {
            let d = sub(*p, center);
            dot(d, d)
        };
        let corners = faces.iter().flat_map(|f| &f.corners);
        let mut m = Moments { center, radius: corners.map(square).fold(0.0, f64::max).sqrt(), ..Moments::default() };
        for f in faces {
            let [a, b, c] = f.corners.map(|p| sub(p, center));
            let n = scale(cross(sub(b, a), sub(c, a)), 0.5);
            let s = add(a, add(b, c));
            // The mean of x over the triangle, and that of x x.
            let x = scale(s, 1.0 / 3.0);
            let xx = |i: usize, j: usize| (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]) / 12.0;
            m.normal = add(m.normal, n);
            m.trace += dot(x, n);
            for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
                m.first[k] += 0.5 * (x[i] * n[j] + x[j] * n[i]);
            }
            let q = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]].map(|[i, j]| xx(i, j));
            let [qxx, qyy, qzz, qxy, qyz, qzx] = q;
            let along = [
                qxx * n[0] + qxy * n[1] + qzx * n[2],
                qxy * n[0] + qyy * n[1] + qyz * n[2],
                qzx * n[0] + qyz * n[1] + qzz * n[2],
            ];
            m.vector = add(m.vector, add(scale(along, 2.0), scale(n, qxx + qyy + qzz)));
            let cubic = [
                qxx * n[0],
                qyy * n[1],
                qzz * n[2],
                qxx * n[1] + 2.0 * qxy * n[0],
                qxx * n[2] + 2.0 * qzx * n[0],
                qyy * n[0] + 2.0 * qxy * n[1],
                qyy * n[2] + 2.0 * qyz * n[1],
                qzz * n[0] + 2.0 * qzx * n[2],
                qzz * n[1] + 2.0 * qyz * n[2],
                2.0 * (qxy * n[2] + qyz * n[0] + qzx * n[1]),
            ];
            for (into, v) in m.cubic.iter_mut().zip(cubic) {
                *into += v;
            }
        }
        m
    }

    /// The numbers of the expansion where lengths are counted in radii, with its factors, in its order.
    fn in_radii(&self) -> [f32; TERMS] {
        let per = 1.0 / self.radius;
        let mut out = [0.0; TERMS];
        let [squares, products] = [&self.first[..3], &self.first[3..]];
        let parts: [(&[f64], f64); 6] = [
            (&self.normal, per.powi(2)),
            (&[self.trace], per.powi(3)),
            (squares, -3.0 * per.powi(3)),
            (products, -6.0 * per.powi(3)),
            (&self.vector, -1.5 * per.powi(4)),
            (&self.cubic, 7.5 * per.powi(4)),
        ];
        let all = parts.iter().flat_map(|(v, by)| v.iter().map(move |x| x * by));
        for (o, v) in out.iter_mut().zip(all) {
            *o = v as f32;
        }
        out
    }
}

/// Numbers of an expansion.
const TERMS: usize = 23;
/// Children of a node. Their expansions are taken side by side.
const WIDE: usize = 8;

/// One number for each child. Arithmetic goes through all of them before the next operation begins, which is the form
/// that compilers make vector instructions of.
#[derive(Clone, Copy, Debug)]
struct Lanes([f32; WIDE]);

impl core::ops::Add for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn add(self, o: Lanes) -> Lanes {
        Lanes(core::array::from_fn(|k| self.0[k] + o.0[k]))
    }
}

impl core::ops::Mul for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn mul(self, o: Lanes) -> Lanes {
        Lanes(core::array::from_fn(|k| self.0[k] * o.0[k]))
    }
}

impl Lanes {
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Lanes {
        Lanes(self.0.map(f))
    }
}

/// Sets of triangles side by side.
#[derive(Clone, Debug)]
struct MultipoleNode {
    /// Their middles.
    center: [[f64; WIDE]; 3],
    /// One over their radii.
    per: [f64; WIDE],
    terms: [Lanes; TERMS],
    /// The node that a set is parted into, or its first triangle if it is a leaf.
    at: [u32; WIDE],
    /// Triangles of a leaf; zero for a set that is parted, and where there is no set.
    count: [u32; WIDE],
    /// How many sets there are.
    used: usize,
}

impl MultipoleNode {
    /// Squared distances of the middles in radii, and the expansions' values there:
    /// K·∫n + ∂K:∫xn + ½ ∂∂K:∫xxn with K = r/(4π|r|³), r = middle − point.
    ///
    /// In single precision, for it is off by its fourth term anyhow.
    #[inline]
    fn far(&self, p: Vec3) -> (Lanes, Lanes) {
        let [x, y, z] = [0, 1, 2].map(|a| {
            let c = &self.center[a];
            Lanes(core::array::from_fn(|k| ((c[k] - p[a]) * self.per[k]) as f32))
        });
        let t = &self.terms;
        let square = x * x + y * y + z * z;
        let inverse = square.map(|s| 1.0 / s);
        let cube = inverse * inverse.map(f32::sqrt);
        let quadric = (t[4] * x + t[7] * y + t[9] * z) * x + (t[5] * y + t[8] * z) * y + t[6] * z * z;
        let cubic = x * x * (t[13] * x + t[16] * y + t[17] * z)
            + y * y * (t[14] * y + t[18] * x + t[19] * z)
            + z * z * (t[15] * z + t[20] * x + t[21] * y)
            + t[22] * x * y * z;
        let vector = t[10] * x + t[11] * y + t[12] * z;
        let sum = t[0] * x + t[1] * y + t[2] * z + t[3] + (quadric + vector + cubic * inverse) * inverse;
        (square, sum * cube)
    }
}

/// The moments of sets of oriented triangles, in a tree with eight children a node.
#[derive(Debug)]
pub struct Winding {
    nodes: Vec<MultipoleNode>,
}

impl Winding {
    /// Takes the moments of the nodes of `tree`, and puts those side by side that a query asks for together.
    pub fn new(tree: &TriangleBvh) -> Winding {
        let nodes = tree.nodes();
        let mut range = vec![0..0; nodes.len()];
        for i in (0..nodes.len()).rev() {
            let n = &nodes[i];
            range[i] = n.items().unwrap_or_else(|| {
                let [first, second] = n.children(i);
                range[first].start..range[second].end
            });
        }
        let moments: Vec<Moments> =
            nodes.par_iter().zip(&range).map(|(n, r)| Moments::of(&tree.triangles()[r.clone()], &n.bounds)).collect();
        // The sets of each node, by their numbers in the tree; those that are parted have a node of their own.
        let mut sets: Vec<Vec<usize>> = vec![vec![0]];
        let mut out: Vec<MultipoleNode> = Vec::new();
        while let Some(all) = sets.get(out.len()) {
            let mut all = all.clone();
            // The largest is parted first, so that sets side by side are about as large.
            while all.len() < WIDE {
                let size = |k: &usize| moments[all[*k]].radius;
                let parted = (0..all.len()).filter(|k| nodes[all[*k]].items().is_none());
                let Some(k) = parted.max_by(|a, b| size(a).total_cmp(&size(b))) else {
                    break;
                };
                let i = all[k];
                let [first, second] = nodes[i].children(i);
                all[k] = first;
                all.push(second);
            }
            let mut node = MultipoleNode {
                center: [[0.0; WIDE]; 3],
                per: [0.0; WIDE],
                terms: [Lanes([0.0; WIDE]); TERMS],
                at: [0; WIDE],
                count: [0; WIDE],
                used: all.len(),
            };
            for (k, i) in all.into_iter().enumerate() {
                let m = &moments[i];
                (0..3).for_each(|a| node.center[a][k] = m.center[a]);
                node.per[k] = 1.0 / m.radius;
                for (t, v) in node.terms.iter_mut().zip(m.in_radii()) {
                    t.0[k] = v;
                }
                if let Some(items) = nodes[i].items() {
                    node.at[k] = items.start as u32;
                    node.count[k] = items.len() as u32;
                } else {
                    node.at[k] = sets.len() as u32;
                    sets.push(nodes[i].children(i).to_vec());
                }
            }
            out.push(node);
        }
        Winding { nodes: out }
    }

    /// The winding number about `p` of the triangles that `skip` (positions in the tree's order) leaves in.
    ///
    /// A set is replaced by its expansion where it is farther than `reach` times its radius, which leaves an error of
    /// the order of `reach`⁻³ times its share of the sphere. What is skipped must be within rounding of `p`, so that no
    /// replaced set holds it.
    pub fn at(&self, tree: &TriangleBvh, p: Vec3, reach: f64, skip: impl Fn(u32) -> bool) -> f64 {
        let limit = (reach * reach) as f32;
        let mut angle = Angle { re: 1.0, im: 0.0, full: 0 };
        let mut sum = 0f64;
        let mut work = Vec::with_capacity(64);
        work.push(0u32);
        while let Some(i) = work.pop() {
            let node = &self.nodes[i as usize];
            let (squares, values) = node.far(p);
            let mut far = 0f32;
            for k in 0..node.used {
                if squares.0[k] > limit {
                    far += values.0[k];
                    continue;
                }
                if node.count[k] == 0 {
                    work.push(node.at[k]);
                    continue;
                }
                for t in node.at[k]..node.at[k] + node.count[k] {
                    if !skip(t) {
                        angle.add(sides(tree.triangles()[t as usize].corners, p));
                    }
                }
                angle.rescale();
            }
            sum += f64::from(far);
        }
        angle.turns() + sum / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    fn plain(faces: &[Triangle], p: Vec3) -> f64 {
        faces.iter().map(|f| turn(f.corners, p)).sum()
    }

    fn some(count: usize, seed: &mut u64) -> Vec<Triangle> {
        let mut point = || [0; 3].map(|_| random(seed));
        (0..count).map(|_| Triangle::new([point(), point(), point()])).collect()
    }

    /// The m-th term of 1/|r − x| has a gradient in x of at most m |x|^(m−1) / |r|^(m+1), so what three terms of the
    /// gradient leave of a set of radius ρ and area A at r = βρ is at most A / 4πr² · Σ (m + 1) β^−m, m from 3 on.
    #[test]
    fn an_expansion_is_off_by_the_rest_of_its_series_at_most() {
        let (mut seed, mut closest) = (3, 0.0f64);
        for _ in 0..300 {
            let scale_by = 10f64.powf(4.0 * random(&mut seed));
            let mut faces = some(5, &mut seed);
            for f in &mut faces {
                *f = Triangle::new(f.corners.map(|p| scale(p, scale_by)));
            }
            let tree = TriangleBvh::new(&faces);
            let winding = Winding::new(&tree);
            let node = &winding.nodes[0];
            let center = node.center.map(|c| c[0]);
            let area: f64 = faces
                .iter()
                .map(|f| {
                    let [a, b, c] = f.corners;
                    norm(cross(sub(b, a), sub(c, a))) / 2.0
                })
                .sum();
            for _ in 0..20 {
                let way = crate::math::unit([0; 3].map(|_| random(&mut seed)));
                let beta = 1.05 + 6.0 * random(&mut seed).powi(4);
                let r = beta / node.per[0];
                let p = add(center, scale(way, r));
                let off = (winding.at(&tree, p, 1.0, |_| false) - plain(&faces, p)).abs();
                let q: f64 = 1.0 / beta;
                let rest = (4.0 * q.powi(3) - 3.0 * q.powi(4)) / (1.0 - q).powi(2);
                let seen = area / (4.0 * PI * r * r);
                // Single precision: some thirty roundings of terms up to fifteen times the result.
                assert!(off <= seen * (rest + 3e-5), "{off} at {beta}, rest {rest}");
                closest = closest.max(off / (seen * rest));
            }
        }
        // The bound is no more than tens of times too large.
        assert!(closest > 0.02, "{closest}");
    }

    #[test]
    fn near_triangles_are_added_to_the_last_bit_whatever_the_turns() {
        let mut seed = 8;
        for _ in 0..200 {
            // Nothing is far, so all goes through the product of complex numbers.
            let faces = some(60, &mut seed);
            let tree = TriangleBvh::new(&faces);
            let winding = Winding::new(&tree);
            for p in [[0.0; 3], faces[7].corners[0], [0; 3].map(|_| random(&mut seed))] {
                let all = winding.at(&tree, p, 1e9, |_| false);
                assert!((all - plain(&faces, p)).abs() < 1e-12, "{all}");
                let without = winding.at(&tree, p, 1e9, |k| k == 3);
                let one = turn(tree.triangles()[3].corners, p);
                assert!((without + one - all).abs() < 1e-12);
            }
        }
        // Twelve times about: whole turns are counted.
        let ball = crate::mesh::samples::icosphere(1, 1.0, 0.0);
        let faces: Vec<Triangle> =
            (0..12 * ball.triangles.len()).map(|i| Triangle::new(ball.corners(i % ball.triangles.len()))).collect();
        let tree = TriangleBvh::new(&faces);
        let all = Winding::new(&tree).at(&tree, [0.1, 0.2, 0.3], 1e9, |_| false);
        assert!((all - 12.0).abs() < 1e-12, "{all}");
    }
}
