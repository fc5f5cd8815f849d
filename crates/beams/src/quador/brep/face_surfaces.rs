//! Surfaces of faces: cylinders, cones and spheres where the quadric is one, rational patches elsewhere.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::super::hub::HalfBeam;
use super::super::integral::unresolved_face;
use super::super::perpendicular::perpendicular;
use super::super::stereographic::{Stereographic, opposite_poles};
use super::cuts::CutPlane;
use super::{Bezier, Brep, BrepFace, Frame, Kind, Surface};

/// Minimum ratio of the weights of a patch, and that from which no better one is searched.
const WEIGHT_RATIO: [f64; 2] = [0.01, 0.2];
/// Minimum weight of a curve in the plane of (s, t), relative to its ends.
const CURVE_WEIGHT: f64 = 0.05;
/// Orientations of (s, t) that are tried in a quarter turn.
const ORIENTATIONS: usize = 8;
/// How often a face without a suitable patch is halved.
const HALVINGS: u32 = 5;
/// Deviation of a meridian from a segment, in radii, below which it is one: below that of curves in parameter planes.
const STRAIGHT: f64 = 1e-11;
/// Margin of a patch around its face, in sizes of its range.
const MARGIN: f64 = 1e-3;

impl Brep<'_> {
    /// Chooses the surfaces, and cuts the faces that need it.
    ///
    /// # Errors
    /// A face that has no rational form.
    pub(super) fn set_surfaces(&mut self) -> Result<(), Fault> {
        let mut known: HashMap<[u32; 2], Surface> = HashMap::new();
        for face in 0..self.faces.len() as u32 {
            let BrepFace { frame: Frame { hub, .. }, class, kind, .. } = self.faces[face as usize];
            if let Some(surface) = known.get(&class) {
                self.faces[face as usize].surface = *surface;
                continue;
            }
            let before = self.faces.len();
            self.set_surface(face).ok_or_else(|| unresolved_face(hub as usize))?;
            // Sectors of beams depend on more than their hub's class; faces that were cut are cut again.
            if !matches!(kind, Kind::Beam(_)) && self.faces.len() == before {
                known.insert(class, self.faces[face as usize].surface);
            }
        }
        Ok(())
    }

    fn set_surface(&mut self, face: u32) -> Option<()> {
        let (kind, several) = (self.faces[face as usize].kind, self.faces[face as usize].loops.len() > 1);
        let axis = match kind {
            Kind::Ball(axis) => {
                if let Some(surface) = self.sphere(face, axis) {
                    self.faces[face as usize].surface = surface;
                    return Some(());
                }
                axis
            }
            Kind::Beam(half_beam) => {
                let hub = self.quadors.hub(self.faces[face as usize].frame.hub as usize);
                let surface = self.around_beam(&hub.half_beams[half_beam as usize], &self.boundary(face))?;
                self.faces[face as usize].surface = surface;
                return Some(());
            }
            Kind::Cap => return Some(()),
            Kind::Fillet(axis) if several => axis,
            Kind::Fillet(_) => return self.set_halved(face, HALVINGS),
        };
        let side = perpendicular(axis);
        let other = cross(axis, side);
        // Away from the symmetry planes of symmetric hubs.
        let (sin, cos) = 0.2_f64.sin_cos();
        let [one, two] = [add(scale(side, cos), scale(other, sin)), sub(scale(other, cos), scale(side, sin))];
        for half in self.cut(face, &CutPlane::through([0.0; 3], one))? {
            for quarter in self.cut(half, &CutPlane::through([0.0; 3], two))? {
                if let Kind::Ball(_) = kind {
                    self.faces[quarter as usize].surface = self.sphere(quarter, axis)?;
                } else {
                    self.set_halved(quarter, HALVINGS)?;
                }
            }
        }
        Some(())
    }

    /// The curves around a face.
    fn boundary(&self, face: u32) -> Vec<Bezier<3>> {
        let face = &self.faces[face as usize];
        self.loops(face).into_iter().flatten().map(|u| self.curve(u, &face.frame)).collect()
    }

    /// The ball with its poles and the meridian opposite the face away from the face; `None` if the face is too large.
    fn sphere(&self, face: u32, axis: Vec3) -> Option<Surface> {
        let boundary = self.boundary(face);
        let radius = (-self.faces[face as usize].quadric.c).sqrt();
        let middle = unit(
            boundary.iter().fold([0.0; 3], |sum, b| add(sum, scale(b.at(0.5), norm(sub(b.points[0], b.points[2]))))),
        );
        let poles = [cross(axis, middle), perpendicular(middle), cross(middle, perpendicular(middle))];
        poles.into_iter().map(unit).find_map(|pole| {
            let side = cross(middle, pole);
            let mut area = 0.0;
            for b in &boundary {
                let mut before: Option<[f64; 2]> = None;
                for k in 0..=8 {
                    let x = scale(b.at(f64::from(k) / 8.0), 1.0 / radius);
                    let at = [dot(x, side).atan2(dot(x, middle)), dot(x, pole)];
                    if at[0].abs() > 2.0 || at[1].abs() > 0.8 {
                        return None;
                    }
                    // The projection onto a cylinder preserves area; seen from outside, side points to the left.
                    if let Some([u, v]) = before {
                        area += u * at[1] - v * at[0];
                    }
                    before = Some(at);
                }
            }
            (area < 0.0).then_some(Surface::Sphere { axis: pole, side: scale(middle, -1.0), radius })
        })
    }

    /// The surface of a beam, with its first meridian opposite a sector with this boundary; `None` if it has no finite numbers.
    fn around_beam(&self, s: &HalfBeam, boundary: &[Bezier<3>]) -> Option<Surface> {
        let (mut low, mut high, mut out) = (f64::INFINITY, f64::NEG_INFINITY, [0.0; 3]);
        for b in boundary {
            let along = b.points.map(|p| dot(p, s.axis));
            (low, high) = along.iter().fold((low, high), |(low, high), z| (low.min(*z), high.max(*z)));
            let away = sub(b.at(0.5), scale(s.axis, dot(b.at(0.5), s.axis)));
            out = add(out, scale(unit(away), norm(cross(sub(b.points[0], b.points[2]), s.axis))));
        }
        let side = scale(unit(out), -1.0);
        let pencil = self.quadors.pencil(s.beam as usize);
        if pencil.lambda == pencil.cone_lambda() {
            if pencil.radii[0] == pencil.radii[1] {
                return Some(Surface::Cylinder { axis: s.axis, side, radius: pencil.radii[0] });
            }
            let (axis, radius) = (scale(s.axis, s.meridian[1].signum()), s.meridian[2].sqrt());
            return Some(Surface::Cone { axis, side, radius, half_angle: s.meridian[0].sqrt().atan() });
        }
        // Radii that are equal but for rounding make a cylinder, or a cone: as a conic, its meridian would be undefined.
        let [first, middle, last] = [low, 0.5 * (low + high), high].map(|z| s.radius_squared(z).max(0.0).sqrt());
        let near = STRAIGHT * middle;
        if (middle - 0.5 * (first + last)).abs() > near {
            let margin = MARGIN * (high - low);
            let meridian = meridian(s, side, [low - margin, high + margin]);
            let finite = meridian.points.iter().flatten().all(|v| v.is_finite()) && meridian.weight.is_finite();
            return finite.then_some(Surface::Revolution { axis: s.axis, side, meridian });
        }
        if (last - first).abs() <= near {
            return Some(Surface::Cylinder { axis: s.axis, side, radius: middle });
        }
        let slope = (last - first) / (high - low);
        let (axis, radius) = (scale(s.axis, slope.signum()), middle - 0.5 * (low + high) * slope);
        Some(Surface::Cone { axis, side, radius, half_angle: slope.abs().atan() })
    }

    /// Chooses the patch of a face of a fillet; halves the face where no patch suits all of it.
    fn set_halved(&mut self, face: u32, halvings: u32) -> Option<()> {
        let boundary = self.boundary(face);
        let quadric = self.faces[face as usize].quadric;
        let middle = boundary
            .iter()
            .fold([0.0; 3], |sum, b| add(sum, scale(unit(b.at(0.5)), norm(sub(b.points[0], b.points[2])))));
        let middle = unit(middle);
        let origin = scale(middle, quadric.ray_exit(middle));
        let mut best: Option<(f64, Stereographic, [[f64; 2]; 2])> = None;
        for pole in opposite_poles(&quadric, origin) {
            let chart = oriented(Stereographic::new(quadric, pole, origin));
            for k in 0..ORIENTATIONS {
                let chart = turned(chart, FRAC_PI_2 * k as f64 / ORIENTATIONS as f64);
                let Some(range) = range(&chart, &boundary) else { break };
                let ratio = weight_ratio(&chart, range);
                if best.as_ref().is_none_or(|b| ratio > b.0 + 1e-6) {
                    best = Some((ratio, chart, range));
                }
            }
            if best.as_ref().is_some_and(|b| b.0 > WEIGHT_RATIO[1]) {
                break;
            }
        }
        if let Some((ratio, chart, range)) = best
            && ratio > WEIGHT_RATIO[0]
        {
            self.faces[face as usize].surface = Surface::Rational { chart, range };
            return Some(());
        }
        let halvings = halvings.checked_sub(1)?;
        let normal = longest(unit(quadric.half_gradient(origin)), &boundary);
        let parts = self.cut(face, &CutPlane::through(origin, normal))?;
        parts.into_iter().try_for_each(|part| self.set_halved(part, halvings))
    }
}

/// The meridian of a beam between two positions along its axis, in the half-plane of a unit vector.
fn meridian(s: &HalfBeam, side: Vec3, range: [f64; 2]) -> Bezier<3> {
    let [a, b, c] = s.meridian;
    // The middle control point is the pole of the chord for the form ρ ρ' − A z z' − B (z + z')/2 − C.
    let [p, r] = range.map(|z| [z, s.radius_squared(z).max(0.0).sqrt()]);
    let form = |[z, rho]: [f64; 2], [y, tau]: [f64; 2]| rho * tau - a * z * y - b * (z + y) / 2.0 - c;
    let rows = [p, r].map(|[z, rho]| [-a * z - b / 2.0, rho, b * z / 2.0 + c]);
    let minor = |i: usize, j: usize| rows[0][i] * rows[1][j] - rows[0][j] * rows[1][i];
    let q = [minor(2, 1) / minor(0, 1), minor(0, 2) / minor(0, 1)];
    let weight = (-form(p, r) / (2.0 * form(q, q))).sqrt();
    Bezier { points: [p, q, r].map(|[z, rho]| add(scale(s.axis, z), scale(side, rho))), weight }
}

/// The projection with its axes in the order that makes the patch's normal point outwards.
fn oriented(mut chart: Stereographic) -> Stereographic {
    let along = sub(chart.origin, chart.pole);
    let [u, v] = chart.axes;
    if dot(cross(u, v), along) * dot(chart.quadric.half_gradient(chart.origin), along) < 0.0 {
        chart.axes = [v, u];
    }
    chart
}

/// The projection with its axes turned.
fn turned(chart: Stereographic, by: f64) -> Stereographic {
    let ((sin, cos), [u, v]) = (by.sin_cos(), chart.axes);
    Stereographic { axes: [add(scale(u, cos), scale(v, sin)), sub(scale(v, cos), scale(u, sin))], ..chart }
}

/// The ranges of s and t over the boundary of a face, with a margin; `None` if a curve comes near the pole's tangent
/// plane.
fn range(chart: &Stereographic, boundary: &[Bezier<3>]) -> Option<[[f64; 2]; 2]> {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for b in boundary {
        let projected = b.points.map(|p| chart.project(p));
        let weights = [projected[0].1, b.weight * projected[1].1, projected[2].1];
        let [k, l, m] = weights;
        // Negated so that NaN fails.
        if !(k > 0.0 && m > 0.0 && l > CURVE_WEIGHT * (k * m).sqrt()) {
            return None;
        }
        for (a, range) in range.iter_mut().enumerate() {
            let [low, high] = extent(projected.map(|p| p.0[a]), weights);
            *range = [range[0].min(low), range[1].max(high)];
        }
    }
    Some(range.map(|[low, high]| [low - MARGIN * (high - low), high + MARGIN * (high - low)]))
}

/// The least and greatest value of Σ wᵢ cᵢ Bᵢ / Σ wᵢ Bᵢ, with Bᵢ the quadratic Bernstein polynomials.
fn extent(c: [f64; 3], w: [f64; 3]) -> [f64; 2] {
    // The derivative vanishes with e₀ (1 − t)² + 2 e₁ t (1 − t) + e₂ t².
    let e = [w[0] * w[1] * (c[1] - c[0]), w[0] * w[2] * (c[2] - c[0]) / 2.0, w[1] * w[2] * (c[2] - c[1])];
    let root = (e[1] * e[1] - e[0] * e[2]).max(0.0).sqrt();
    let s = -(e[1] + root.copysign(e[1]));
    let mut out = [c[0].min(c[2]), c[0].max(c[2])];
    for t in [s / (s + e[2]), e[0] / (e[0] + s)] {
        if t > 0.0 && t < 1.0 {
            let b = [w[0] * (1.0 - t) * (1.0 - t), 2.0 * w[1] * t * (1.0 - t), w[2] * t * t];
            let at = (b[0] * c[0] + b[1] * c[1] + b[2] * c[2]) / (b[0] + b[1] + b[2]);
            out = [out[0].min(at), out[1].max(at)];
        }
    }
    out
}

/// The least weight of a patch, relative to the greatest; negative if signs differ.
fn weight_ratio(chart: &Stereographic, range: [[f64; 2]; 2]) -> f64 {
    let (_, weights) = chart.net(range);
    let all = || weights.iter().flatten();
    let (low, high) = (all().copied().fold(f64::INFINITY, f64::min), all().copied().fold(f64::NEG_INFINITY, f64::max));
    if high > -low { low / high } else { high / low }
}

/// The tangent direction in which a face extends farthest, given its normal in the middle.
fn longest(normal: Vec3, boundary: &[Bezier<3>]) -> Vec3 {
    let u = perpendicular(normal);
    let v = cross(normal, u);
    let directions = (0..4).map(|k| {
        let (sin, cos) = (FRAC_PI_4 * f64::from(k)).sin_cos();
        add(scale(u, cos), scale(v, sin))
    });
    let extent = |d: &Vec3| {
        let along = |b: &Bezier<3>| dot(b.points[0], *d);
        let low = boundary.iter().map(along).fold(f64::INFINITY, f64::min);
        boundary.iter().map(along).fold(f64::NEG_INFINITY, f64::max) - low
    };
    directions.max_by(|a, b| extent(a).total_cmp(&extent(b))).unwrap_or(u)
}
