//! A face of a hub by its seams alone: a form on its quadric whose integral along them is that of x·n dA over it.
//!
//! About a place B of a quadric yᵀMy + 2 g·y = 0 there is, up to its length, one direction d with Md = νg and g·d = 1: to the
//! middle of the quadric, along the axis of a paraboloid. With ζ = g·y a place is y = η + ζd with η parallel to the tangents at B,
//! ηᵀMη = −ζ(2 + νζ), and ∫ y·n dA = −∮ ζ/(2(2 + νζ)) d·(y × dy). That is smooth but where 2 + νζ = 0: what is opposite to B.
//! A face that goes all round an axis is taken about the axis: with ηᵀMη = q(ζ) along it ∫ y·n dA = ∮ (P(top) − P(ζ))/q(ζ) d·(y × dy)
//! with P' = q − ½ζq'. In both, x = B + y adds ½ B·∮ y × dy. Nothing but products, and one quotient, of the place and its derivative.
//!
//! What has no such form, areas and moments, is integrated across too: from B, over σ = η/(2 + νζ), which is central projection from
//! the place opposite, or along the axis.

use geometry::math::{Vec3, add, apply, cross, determinant, dot, eigen, scale, sub, unit};

use super::complex::{Complex, Face};
use super::hub::Hub;
use super::quadric::{Conic, Quadric};

/// A face as its seams bound it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    quadric: Quadric,
    /// B, from the hub's centre.
    base: Vec3,
    /// ζ = normal · y.
    normal: Vec3,
    /// d.
    along: Vec3,
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    /// Seen from opposite B: ν.
    Cap(f64),
    /// About an axis: [A, B, C] of q = A ζ² + B ζ + C, and ζ where the face ends.
    Sleeve([f64; 3], f64),
}

/// The two sheets that meet along a conic, by the numbers of its plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seam {
    /// ½ B·(y × dy) and d·(y × dy) by df and f × df, and ζ by 1 and f, where f is the place in the plane.
    base: [[f64; 2]; 3],
    along: [[f64; 2]; 3],
    height: [[f64; 2]; 3],
    /// Both quadratics in ζ that d·(y × dy) is multiplied by the quotient of.
    over: [[f64; 2]; 3],
    under: [[f64; 2]; 3],
}

/// How far what is opposite to B is wanted from a face: (2 + νζ)/2, which is 1 at B and 0 there.
const GOOD: f64 = 0.2;
/// How far at least.
const CLEAR: f64 = 0.01;
/// How long d may be, in lengths of what it is for a sphere: what is added to cancel takes digits along.
const SLANT: f64 = 1e4;

impl Form {
    /// What d·(y × dy) is multiplied by: the quotient of two quadratics in ζ, from the constant on.
    fn quotient(self) -> [[f64; 3]; 2] {
        match self {
            Form::Cap(nu) => [[0.0, -0.5, 0.0], [2.0, nu, 0.0]],
            Form::Sleeve([a, b, c], top) => [[(b / 4.0 * top + c) * top, -c, -b / 4.0], [c, b, a]],
        }
    }
}

/// The rows of M's adjugate, M symmetric.
fn adjugate(q: &Quadric) -> [Vec3; 3] {
    let m = &q.m;
    [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])]
}

impl Sheet {
    /// The sheet of a face of a hub, given the places in the middle of all arcs and the cotangents of the angles at which they end.
    /// `None` if there is none from which all of the face is seen.
    pub fn new(hub: &Hub, complex: &Complex, face: &Face, (middles, ends): (&[Vec3], &[f64])) -> Option<Sheet> {
        let q = &face.quadric;
        let arcs = || face.loops.iter().flatten().map(|&(a, _)| a as usize);
        if let Some(stub) = face.rim {
            let s = &hub.stubs[stub as usize];
            return Some(Sheet {
                quadric: *q,
                base: [0.0; 3],
                normal: s.axis,
                along: s.axis,
                form: Form::Sleeve(s.section, s.split),
            });
        }
        if face.label == 0 {
            // Opposite is the middle of a stub.
            let stub = arcs().flat_map(|a| complex.arcs[a].sides).max()?.trailing_zeros();
            return Sheet::cap(q, scale(hub.stubs[stub as usize].axis, -hub.radius));
        }
        if face.loops.len() > 1 {
            let arc = &complex.arcs[arcs().next()?];
            return Sheet::ring(q, &arc.conic, arc.plane.a);
        }
        let middles = || arcs().map(|a| middles[a]);
        let (sum, count) = middles().fold(([0.0; 3], 0.0), |(s, n), m| (add(s, m), n + 1.0));
        let mean = scale(sum, 1.0 / count);
        let normal = unit(q.half_slope(mean));
        let middle = add(mean, scale(normal, q.along(mean, normal)));
        let seen = |least: f64| {
            let bases = core::iter::once(middle).chain(middles());
            bases
                .filter_map(|base| Sheet::cap(q, base))
                .find(|sheet| arcs().all(|a| sheet.clear(&complex.arcs[a].conic, ends[a], least)))
        };
        seen(GOOD).or_else(|| Sheet::waist(q)).or_else(|| seen(CLEAR))
    }

    /// What is seen from opposite a place of a quadric.
    fn cap(q: &Quadric, base: Vec3) -> Option<Sheet> {
        let g = q.half_slope(base);
        let size = dot(g, g);
        let direction = |q: &Quadric| {
            let rows = adjugate(q);
            let way = [0, 1, 2].map(|i| dot(rows[i], g));
            let by = 1.0 / dot(g, way);
            (scale(way, by), determinant(&q.m) * by)
        };
        let short = |d: Vec3| dot(d, d) * size < SLANT * SLANT;
        let (mut along, mut nu) = direction(q);
        if !short(along) {
            // A cylinder's axis has no part in it.
            let rows = adjugate(q);
            let axis = rows.into_iter().max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))?;
            let mut filled = *q;
            let axis = unit(axis);
            filled.square(1.0, &super::hub::Affine { a: axis, b: 0.0 });
            (along, nu) = direction(&filled);
            let left = sub(apply(&q.m, along), scale(g, nu));
            if !short(along) || dot(left, left) > 1e-24 * nu * nu * size {
                return None;
            }
        }
        Some(Sheet { quadric: *q, base, normal: g, along, form: Form::Cap(nu) })
    }

    /// Whether all of a seam, which ends at the angle of this cotangent, is farther from what is opposite to B than a share of all
    /// there is.
    fn clear(&self, conic: &Conic, end: f64, least: f64) -> bool {
        let Form::Cap(nu) = self.form else {
            return false;
        };
        let [v, e, f] = [sub(conic.v, self.base), conic.e[0], conic.e[1]].map(|v| 0.5 * nu * dot(self.normal, v));
        let start = 1.0 - least + v;
        start > 0.0 && conic.first([start, e, f], false) < end
    }

    /// A hyperboloid of one sheet, which all lies around its axis; `None` if it is none.
    fn waist(q: &Quadric) -> Option<Sheet> {
        let (m, axes) = eigen(&q.m);
        let last = (0..3).min_by(|&i, &j| m[i].total_cmp(&m[j]))?;
        let negative = m.iter().filter(|v| **v < 0.0).count();
        let base = (0..3).fold([0.0; 3], |sum, i| sub(sum, scale(axes[i], dot(axes[i], q.b) / m[i])));
        (negative == 1 && q.at(base) < 0.0).then(|| Sheet::sleeve(q, base, axes[last], axes[last])).flatten()
    }

    /// A ring about the axis through the middles of its sections parallel to one of its ends.
    fn ring(q: &Quadric, end: &Conic, plane: Vec3) -> Option<Sheet> {
        let [m11, m12, m22] = end.m;
        let half = 0.5 * end.q / (m11 * m22 - m12 * m12);
        let middle = add(scale(end.e[0], m12 * half), scale(end.e[1], -m11 * half));
        let base = add(end.v, middle);
        let rows = adjugate(q);
        let along = unit([0, 1, 2].map(|i| dot(rows[i], plane)));
        Sheet::sleeve(q, base, along, plane)
    }

    /// About the axis through a place, where sections normal to `normal` have their middles.
    fn sleeve(q: &Quadric, base: Vec3, along: Vec3, normal: Vec3) -> Option<Sheet> {
        let section = [-q.form(along, along), -2.0 * dot(q.half_slope(base), along), -q.at(base)];
        let normal = scale(normal, 1.0 / dot(normal, along));
        normal.iter().all(|v| v.is_finite()).then_some(Sheet {
            quadric: *q,
            base,
            normal,
            along,
            form: Form::Sleeve(section, 0.0),
        })
    }

    /// The form on a short way by from x.
    pub fn short(&self, x: Vec3, by: Vec3) -> f64 {
        let y = sub(x, self.base);
        let (turn, zeta) = (cross(y, by), dot(self.normal, y));
        let [over, under] = self.form.quotient().map(|[a, b, c]| (c * zeta + b) * zeta + a);
        0.5 * dot(self.base, turn) + over / under * dot(self.along, turn)
    }

    /// The place a share u of 0 to 1 across the face from the seam's place x with derivative dx on, half the slope there, and what
    /// that times du and the seam's parameter is multiplied by to be the surface's outward normal times its area.
    #[inline]
    pub fn across(&self, x: Vec3, dx: Vec3, u: f64) -> (Vec3, Vec3, f64) {
        let (y, d) = (sub(x, self.base), self.along);
        let zeta = dot(self.normal, y);
        let turn = dot(d, cross(y, dx));
        let (place, weight) = match self.form {
            Form::Cap(nu) => {
                let s = 1.0 / (2.0 + nu * zeta);
                let sigma = scale(sub(y, scale(d, zeta)), s);
                let m = -zeta * s * u * u;
                let w = 1.0 / (1.0 + nu * m);
                let place = scale(sub(scale(sigma, u), scale(d, m)), 2.0 * w);
                (place, 4.0 * u * turn * s * s * w * w)
            }
            Form::Sleeve([a, b, c], top) => {
                let q = |z: f64| (a * z + b) * z + c;
                let z = zeta + u * (top - zeta);
                let wide = (q(z) / q(zeta)).max(0.0).sqrt();
                let eta = sub(y, scale(d, zeta));
                (add(scale(eta, wide), scale(d, z)), (top - zeta) * turn / q(zeta))
            }
        };
        let place = add(self.base, place);
        (place, self.quadric.half_slope(place), weight)
    }
}

impl Seam {
    /// Both sheets in the plane of a conic.
    pub fn new(of: [&Sheet; 2], conic: &Conic) -> Seam {
        let [e, f] = conic.e;
        let each = of.map(|s| {
            let y = sub(conic.v, s.base);
            let turns = [cross(y, e), cross(y, f), cross(e, f)];
            let [over, under] = s.form.quotient();
            [
                turns.map(|t| 0.5 * dot(s.base, t)),
                turns.map(|t| dot(s.along, t)),
                [y, e, f].map(|v| dot(s.normal, v)),
                over,
                under,
            ]
        });
        let [base, along, height, over, under] =
            [0, 1, 2, 3, 4].map(|n| [0, 1, 2].map(|k| [each[0][n][k], each[1][n][k]]));
        Seam { base, along, height, over, under }
    }

    /// The form of the first sheet less that of the second at a place of the plane with its derivative.
    #[inline(always)]
    pub fn at(&self, [x, y]: [f64; 2], [dx, dy]: [f64; 2]) -> f64 {
        let turn = x * dy - y * dx;
        let way = |c: &[[f64; 2]; 3], [a, b, d]: [f64; 3]| [0, 1].map(|k| c[0][k] * a + c[1][k] * b + c[2][k] * d);
        let base = way(&self.base, [dx, dy, turn]);
        let along = way(&self.along, [dx, dy, turn]);
        let zeta = way(&self.height, [1.0, x, y]);
        let quadratic = |c: &[[f64; 2]; 3]| [0, 1].map(|k| (c[2][k] * zeta[k] + c[1][k]) * zeta[k] + c[0][k]);
        let (over, under) = (quadratic(&self.over), quadratic(&self.under));
        let [a, b] = [0, 1].map(|k| base[k] + over[k] / under[k] * along[k]);
        a - b
    }
}
