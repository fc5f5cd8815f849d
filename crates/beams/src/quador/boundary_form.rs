//! The boundary form of a face: a 1-form on its quadric whose integral along the boundary equals ∫ x·n dA over the
//! face.
//!
//! About a base point B of a quadric yᵀMy + 2 g·y = 0, with y = x − B, there is one direction d with Md = νg and g·d =
//! 1: towards the centre of the quadric, or along the axis of a paraboloid. With ζ = g·y a point is y = η + ζd, where η
//! is parallel to the tangent plane at B, ηᵀMη = −ζ(2 + νζ), and ∫ y·n dA = −∮ ζ/(2(2 + νζ)) d·(y × dy). This is smooth
//! except where 2 + νζ = 0, at the point opposite B. A face around an axis is projected along the axis: with ηᵀMη =
//! q(ζ), ∫ y·n dA = ∮ (P(end) − P(ζ))/q(ζ) d·(y × dy) with P' = q − ½ζq'. In both cases x = B + y adds ½ B·∮ y × dy.
//! The integrand needs products and one quotient of the position and its derivative.
//!
//! Areas and moments have no such form and are integrated across the face as well: from B over σ = η/(2 + νζ), the
//! central projection from the point opposite B, or along the axis.

use geometry::math::{Vec3, add, apply, cross, determinant, dot, eigen, scale, sub, unit};

use super::complex::{Complex, QuadricFace};
use super::conic::Conic;
use super::hub::{HalfBeam, Hub};
use super::hub_quadric::Quadric;

/// The boundary form of one face.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundaryForm {
    quadric: Quadric,
    /// B, relative to the hub's centre.
    base: Vec3,
    /// ζ = normal · y.
    normal: Vec3,
    /// d.
    along: Vec3,
    projection: Projection,
}

#[derive(Clone, Copy, Debug)]
enum Projection {
    /// Central projection from the point opposite B: ν.
    Central(f64),
    /// Projection along an axis: [A, B, C] of q = A ζ² + B ζ + C, and ζ at the end of the face.
    Axial([f64; 3], f64),
}

/// The boundary forms of the two faces at a seam, in coordinates of the conic's plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeamForm {
    /// Coefficients of ½ B·(y × dy) and d·(y × dy) in df and f × df, and of ζ in 1 and f, where f is the position in
    /// the plane.
    base: [[f64; 2]; 3],
    along: [[f64; 2]; 3],
    height: [[f64; 2]; 3],
    /// Numerator and denominator of the factor of d·(y × dy), as quadratics in ζ.
    over: [[f64; 2]; 3],
    under: [[f64; 2]; 3],
}

/// Preferred minimum of (2 + νζ)/2 on a face, which is 1 at B and 0 at the opposite point.
const PREFERRED_CLEARANCE: f64 = 0.2;
/// Required minimum of the same.
const MIN_CLEARANCE: f64 = 0.01;
/// Maximum length of d, relative to a sphere: longer vectors lose digits by cancellation.
const MAX_DIRECTION_LENGTH: f64 = 1e4;

impl Projection {
    /// The factor of d·(y × dy): numerator and denominator as quadratics in ζ, constant term first.
    fn quotient(self) -> [[f64; 3]; 2] {
        match self {
            Projection::Central(nu) => [[0.0, -0.5, 0.0], [2.0, nu, 0.0]],
            Projection::Axial([a, b, c], top) => [[(b / 4.0 * top + c) * top, -c, -b / 4.0], [c, b, a]],
        }
    }
}

/// The rows of the adjugate of M, M symmetric.
fn adjugate(q: &Quadric) -> [Vec3; 3] {
    let m = &q.m;
    [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])]
}

impl BoundaryForm {
    /// The boundary form of a face of a hub, given the midpoints of all arcs and the cotangents of the angles at their
    /// ends. `None` if no base point suits the whole face.
    pub(super) fn new(
        hub: &Hub,
        complex: &Complex,
        face: &QuadricFace,
        (middles, ends): (&[Vec3], &[f64]),
    ) -> Option<BoundaryForm> {
        let q = &face.quadric;
        let arcs = || face.loops.iter().flatten().map(|&(a, _)| a as usize);
        if let Some(half_beam) = face.end_circle {
            return Some(BoundaryForm::of_beam(q, &hub.half_beams[half_beam as usize]));
        }
        if face.label == 0 {
            // The opposite point is on the axis of a half-beam.
            let half_beam = arcs().flat_map(|a| complex.arcs[a].labels).max()?.trailing_zeros();
            return BoundaryForm::central(q, scale(hub.half_beams[half_beam as usize].axis, -hub.radius));
        }
        if face.loops.len() > 1 {
            let arc = &complex.arcs[arcs().next()?];
            return BoundaryForm::annulus(q, &arc.conic, arc.plane.a);
        }
        let middles = || arcs().map(|a| middles[a]);
        let (sum, count) = middles().fold(([0.0; 3], 0.0), |(s, n), m| (add(s, m), n + 1.0));
        let mean = scale(sum, 1.0 / count);
        let normal = unit(q.half_gradient(mean));
        let middle = add(mean, scale(normal, q.intersection_along(mean, normal)));
        let bases = || core::iter::once(middle).chain(middles());
        BoundaryForm::chosen(q, bases, |form, least| {
            arcs().all(|a| form.is_clear(&complex.arcs[a].conic, ends[a], least))
        })
    }

    /// The boundary form of a part of a quadric whose boundary runs through some points, about one of these or of other base points.
    pub(super) fn within(q: &Quadric, middle: Option<Vec3>, points: &[Vec3]) -> Option<BoundaryForm> {
        let bases = || middle.into_iter().chain(points.iter().copied());
        BoundaryForm::chosen(q, bases, |form, least| match form.projection {
            Projection::Central(nu) => {
                points.iter().all(|x| 1.0 + 0.5 * nu * dot(form.normal, sub(*x, form.base)) > least)
            }
            Projection::Axial(..) => false,
        })
    }

    /// Central projection about the first base point that is clear of the face, with the preferred clearance if there is one; or along
    /// the axis of a hyperboloid.
    fn chosen<B: Iterator<Item = Vec3>>(
        q: &Quadric,
        bases: impl Fn() -> B,
        is_clear: impl Fn(&BoundaryForm, f64) -> bool,
    ) -> Option<BoundaryForm> {
        let found = |least: f64| bases().filter_map(|b| BoundaryForm::central(q, b)).find(|form| is_clear(form, least));
        found(PREFERRED_CLEARANCE).or_else(|| BoundaryForm::around_hyperboloid_axis(q)).or_else(|| found(MIN_CLEARANCE))
    }

    /// The boundary form of a beam, given as one of its half-beams.
    pub(super) fn of_beam(q: &Quadric, s: &HalfBeam) -> BoundaryForm {
        let projection = Projection::Axial(s.meridian, s.split);
        BoundaryForm { quadric: *q, base: [0.0; 3], normal: s.axis, along: s.axis, projection }
    }

    /// Central projection with base point `base`.
    fn central(q: &Quadric, base: Vec3) -> Option<BoundaryForm> {
        let g = q.half_gradient(base);
        let size = dot(g, g);
        let direction = |q: &Quadric| {
            let rows = adjugate(q);
            let direction = [0, 1, 2].map(|i| dot(rows[i], g));
            let by = 1.0 / dot(g, direction);
            (scale(direction, by), determinant(&q.m) * by)
        };
        let short = |d: Vec3| dot(d, d) * size < MAX_DIRECTION_LENGTH * MAX_DIRECTION_LENGTH;
        let (mut along, mut nu) = direction(q);
        if !short(along) {
            // The axis of a cylinder has no component in d.
            let rows = adjugate(q);
            let axis = rows.into_iter().max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))?;
            let mut filled = *q;
            let axis = unit(axis);
            filled.add_square(1.0, &super::affine_function::AffineFunction { a: axis, b: 0.0 });
            (along, nu) = direction(&filled);
            let left = sub(apply(&q.m, along), scale(g, nu));
            if !short(along) || dot(left, left) > 1e-24 * nu * nu * size {
                return None;
            }
        }
        Some(BoundaryForm { quadric: *q, base, normal: g, along, projection: Projection::Central(nu) })
    }

    /// Whether a seam, whose end has the given cotangent, stays at (2 + νζ)/2 of at least `least`.
    fn is_clear(&self, conic: &Conic, end: f64, least: f64) -> bool {
        let Projection::Central(nu) = self.projection else {
            return false;
        };
        let [v, e, f] = [sub(conic.v, self.base), conic.e[0], conic.e[1]].map(|v| 0.5 * nu * dot(self.normal, v));
        let start = 1.0 - least + v;
        start > 0.0 && conic.first_root_cotangent([start, e, f], false) < end
    }

    /// Projection along the axis of a one-sheeted hyperboloid; `None` for other quadrics.
    fn around_hyperboloid_axis(q: &Quadric) -> Option<BoundaryForm> {
        let (m, axes) = eigen(&q.m);
        let last = (0..3).min_by(|&i, &j| m[i].total_cmp(&m[j]))?;
        let negative = m.iter().filter(|v| **v < 0.0).count();
        let base = (0..3).fold([0.0; 3], |sum, i| sub(sum, scale(axes[i], dot(axes[i], q.b) / m[i])));
        (negative == 1 && q.at(base) < 0.0).then(|| BoundaryForm::axial(q, base, axes[last], axes[last])).flatten()
    }

    /// Projection of an annular face along the line through the centres of the sections parallel to one of its ends.
    fn annulus(q: &Quadric, end: &Conic, plane: Vec3) -> Option<BoundaryForm> {
        let [m11, m12, m22] = end.m;
        let half = 0.5 * end.q / (m11 * m22 - m12 * m12);
        let middle = add(scale(end.e[0], m12 * half), scale(end.e[1], -m11 * half));
        let base = add(end.v, middle);
        let rows = adjugate(q);
        let along = unit([0, 1, 2].map(|i| dot(rows[i], plane)));
        BoundaryForm::axial(q, base, along, plane)
    }

    /// Projection along the axis through `base`, on which sections normal to `normal` have their centres.
    fn axial(q: &Quadric, base: Vec3, along: Vec3, normal: Vec3) -> Option<BoundaryForm> {
        let meridian = [-q.form(along, along), -2.0 * dot(q.half_gradient(base), along), -q.at(base)];
        let normal = scale(normal, 1.0 / dot(normal, along));
        normal.iter().all(|v| v.is_finite()).then_some(BoundaryForm {
            quadric: *q,
            base,
            normal,
            along,
            projection: Projection::Axial(meridian, 0.0),
        })
    }

    /// The form on a short step `by` from x.
    pub(super) fn on_step(&self, x: Vec3, by: Vec3) -> f64 {
        let y = sub(x, self.base);
        let (turn, zeta) = (cross(y, by), dot(self.normal, y));
        let [over, under] = self.projection.quotient().map(|[a, b, c]| (c * zeta + b) * zeta + a);
        0.5 * dot(self.base, turn) + over / under * dot(self.along, turn)
    }

    /// The point at parameter u in [0, 1] between the seam point x (with derivative dx) and the projection's base, half
    /// the gradient there, and the factor that makes it the outward area element for du times the seam's parameter.
    #[inline]
    pub(super) fn area_element(&self, x: Vec3, dx: Vec3, u: f64) -> (Vec3, Vec3, f64) {
        let (y, d) = (sub(x, self.base), self.along);
        let zeta = dot(self.normal, y);
        let turn = dot(d, cross(y, dx));
        let (place, weight) = match self.projection {
            Projection::Central(nu) => {
                let s = 1.0 / (2.0 + nu * zeta);
                let sigma = scale(sub(y, scale(d, zeta)), s);
                let m = -zeta * s * u * u;
                let w = 1.0 / (1.0 + nu * m);
                let place = scale(sub(scale(sigma, u), scale(d, m)), 2.0 * w);
                (place, 4.0 * u * turn * s * s * w * w)
            }
            Projection::Axial([a, b, c], top) => {
                let q = |z: f64| (a * z + b) * z + c;
                let z = zeta + u * (top - zeta);
                let wide = (q(z) / q(zeta)).max(0.0).sqrt();
                let eta = sub(y, scale(d, zeta));
                (add(scale(eta, wide), scale(d, z)), (top - zeta) * turn / q(zeta))
            }
        };
        let place = add(self.base, place);
        (place, self.quadric.half_gradient(place), weight)
    }
}

impl SeamForm {
    /// Both boundary forms in the plane of a conic.
    pub(super) fn new(forms: [&BoundaryForm; 2], conic: &Conic) -> SeamForm {
        let [e, f] = conic.e;
        let each = forms.map(|s| {
            let y = sub(conic.v, s.base);
            let turns = [cross(y, e), cross(y, f), cross(e, f)];
            let [over, under] = s.projection.quotient();
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
        SeamForm { base, along, height, over, under }
    }

    /// The form of the first face minus that of the second at a position of the plane with its derivative.
    #[inline(always)]
    pub(super) fn at(&self, [x, y]: [f64; 2], [dx, dy]: [f64; 2]) -> f64 {
        let turn = x * dy - y * dx;
        let direction =
            |c: &[[f64; 2]; 3], [a, b, d]: [f64; 3]| [0, 1].map(|k| c[0][k] * a + c[1][k] * b + c[2][k] * d);
        let base = direction(&self.base, [dx, dy, turn]);
        let along = direction(&self.along, [dx, dy, turn]);
        let zeta = direction(&self.height, [1.0, x, y]);
        let quadratic = |c: &[[f64; 2]; 3]| [0, 1].map(|k| (c[2][k] * zeta[k] + c[1][k]) * zeta[k] + c[0][k]);
        let (over, under) = (quadratic(&self.over), quadratic(&self.under));
        let [a, b] = [0, 1].map(|k| base[k] + over[k] / under[k] * along[k]);
        a - b
    }
}
