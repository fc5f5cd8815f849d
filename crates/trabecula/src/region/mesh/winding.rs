//! How often an oriented set of triangles winds about a point.
//!
//! The generalised winding number is the solid angle of the triangles over 4π: a whole number where they close, and
//! smooth across what is missing. Far sets of triangles are replaced by their dipole, its first and its second moment:
//! G. Barill, N. G. Dickson, R. Schmidt, D. I. W. Levin and A. Jacobson, Fast winding numbers for soups and clouds,
//! ACM Trans. Graph. 37 (2018) 43. One triangle: A. van Oosterom and J. Strackee, The solid angle of a plane triangle,
//! IEEE Trans. Biomed. Eng. 30 (1983) 125.

use core::f64::consts::PI;

use rayon::prelude::*;

use super::tree::{Face, Tree};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};

/// Solid angle of a triangle seen from `p`, over 4π: positive where the normal points away from `p`.
pub fn turn(corners: [Vec3; 3], p: Vec3) -> f64 {
    let [a, b, c] = corners.map(|q| sub(q, p));
    let (la, lb, lc) = (norm(a), norm(b), norm(c));
    let above = dot(a, cross(b, c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    // On the triangle itself the two sides cancel: the mean is taken.
    if above == 0.0 {
        return 0.0;
    }
    above.atan2(below) / (2.0 * PI)
}

/// Moments of a set of triangles about its middle: ∫ n, ∫ x n and ∫ x x n dA, folded to what the expansion needs.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    center: Vec3,
    /// Square of the distance from the middle to the farthest corner of the box.
    square: f64,
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
    fn of(faces: &[Face], bounds: &crate::math::Aabb) -> Moments {
        let mut area = 0.0;
        let mut middle = [0.0; 3];
        for f in faces {
            let [a, b, c] = f.corners;
            let n = norm(cross(sub(b, a), sub(c, a)));
            area += n;
            middle = add(middle, scale(add(a, add(b, c)), n / 3.0));
        }
        let center = if area > 0.0 {
            scale(middle, 1.0 / area)
        } else {
            bounds.center()
        };
        let far = [0, 1, 2].map(|k| (bounds.max[k] - center[k]).max(center[k] - bounds.min[k]));
        let mut m = Moments {
            center,
            square: dot(far, far),
            ..Moments::default()
        };
        for f in faces {
            let [a, b, c] = f.corners.map(|p| sub(p, center));
            let n = scale(cross(sub(b, a), sub(c, a)), 0.5);
            let s = add(a, add(b, c));
            // The mean of x over the triangle, and that of x x.
            let x = scale(s, 1.0 / 3.0);
            let xx =
                |i: usize, j: usize| (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]) / 12.0;
            m.normal = add(m.normal, n);
            m.trace += dot(x, n);
            for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
                .into_iter()
                .enumerate()
            {
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

    /// The expansion at r = middle − point, |r|² = `square`: K·∫n + ∂K:∫xn + ½ ∂∂K:∫xxn with K = r/(4π|r|³).
    fn far(&self, r: Vec3, square: f64) -> f64 {
        let [x, y, z] = r;
        let inverse = 1.0 / square;
        let cube = inverse * inverse.sqrt();
        let f = &self.first;
        let quadric = f[0] * x * x
            + f[1] * y * y
            + f[2] * z * z
            + 2.0 * (f[3] * x * y + f[4] * y * z + f[5] * z * x);
        let c = &self.cubic;
        let cubic = x * x * (c[0] * x + c[3] * y + c[4] * z)
            + y * y * (c[1] * y + c[5] * x + c[6] * z)
            + z * z * (c[2] * z + c[7] * x + c[8] * y)
            + c[9] * x * y * z;
        let sum = dot(self.normal, r) + self.trace - 3.0 * quadric * inverse
            + 0.5 * (-3.0 * dot(self.vector, r) + 15.0 * cubic * inverse) * inverse;
        sum * cube / (4.0 * PI)
    }
}

/// The moments of every node of a tree over oriented triangles.
#[derive(Debug)]
pub struct Winding {
    moments: Vec<Moments>,
}

impl Winding {
    /// Takes the moments of the nodes of `tree`.
    pub fn new(tree: &Tree) -> Winding {
        let nodes = tree.nodes();
        let mut range = vec![(0u32, 0u32); nodes.len()];
        for i in (0..nodes.len()).rev() {
            let n = &nodes[i];
            range[i] = if n.count > 0 {
                (n.at, n.at + n.count)
            } else {
                (range[i + 1].0, range[n.at as usize].1)
            };
        }
        let moments = nodes
            .par_iter()
            .zip(&range)
            .map(|(n, r)| Moments::of(&tree.faces()[r.0 as usize..r.1 as usize], &n.bounds))
            .collect();
        Winding { moments }
    }

    /// The winding number about `p` of the triangles that `skip` (positions in the tree's order) leaves in.
    ///
    /// A node is replaced by its expansion where it is farther than `reach` times its radius. What is skipped must be
    /// within rounding of `p`, so that no replaced node holds it.
    pub fn at(&self, tree: &Tree, p: Vec3, reach: f64, skip: impl Fn(u32) -> bool) -> f64 {
        let nodes = tree.nodes();
        let mut stack = [0u32; 128];
        let mut top = 1;
        let mut sum = 0.0;
        while top > 0 {
            top -= 1;
            let mut i = stack[top] as usize;
            loop {
                let m = &self.moments[i];
                let r = sub(m.center, p);
                let square = dot(r, r);
                if square > reach * reach * m.square {
                    sum += m.far(r, square);
                    break;
                }
                let node = &nodes[i];
                if node.count > 0 {
                    for k in node.at..node.at + node.count {
                        if !skip(k) {
                            sum += turn(tree.faces()[k as usize].corners, p);
                        }
                    }
                    break;
                }
                if top < stack.len() {
                    stack[top] = node.at;
                    top += 1;
                }
                i += 1;
            }
        }
        sum
    }
}
