//! The volume within the boundary, by integrals along its edges.

use geometry::math::{Vec3, add, cross, dot, scale, sub};
use rayon::prelude::*;

use super::super::bezier::Bezier;
use super::super::boundary_form::BoundaryForm;
use super::super::gauss::gauss;
use super::{Brep, BrepFace, Kind, Surface};

/// Numbers of nodes of the rules that are compared.
const NODES: [usize; 2] = [12, 18];
/// How often a curve is halved where they disagree.
const HALVINGS: u32 = 12;
/// Difference of the rules that is accepted, relative to the cube of the curve's extent from the hub's centre.
const TOLERANCE: f64 = 1e-13;

impl Brep<'_> {
    /// The volume within some faces, mm³: ⅓ ∫ x·n dA. `None` if a face has no boundary form.
    pub(crate) fn volume(&self, faces: &[u32]) -> Option<f64> {
        // Relative to a hub of them, which preserves digits far from the origin.
        let about = self.center(self.faces[*faces.first()? as usize].frame.hub);
        let all: Vec<f64> =
            faces.par_iter().map(|f| self.flux(&self.faces[*f as usize], about)).collect::<Option<_>>()?;
        Some(all.iter().sum::<f64>() / 3.0)
    }

    /// ∫ (x − about)·n dA over a face.
    fn flux(&self, face: &BrepFace, about: Vec3) -> Option<f64> {
        let curves: Vec<Bezier<3>> =
            self.loops(face).into_iter().flatten().map(|u| self.curve(u, &face.frame)).collect();
        let by = sub(self.center(face.frame.hub), about);
        if let Surface::Plane { origin, axes: [u, v] } = face.surface {
            let area: f64 = curves.iter().map(|c| face.surface.flattened(c).swept_area_twice([0.0; 2])).sum();
            return Some(0.5 * area * dot(add(origin, by), cross(u, v)));
        }
        let form = match (face.kind, face.surface) {
            (Kind::Beam(half_beam), _) => {
                let hub = self.quadors.hub(face.frame.hub as usize);
                BoundaryForm::of_beam(&face.quadric, &hub.half_beams[half_beam as usize])
            }
            (_, surface) => {
                let points: Vec<Vec3> = curves.iter().flat_map(|c| [c.points[0], c.at(0.5)]).collect();
                let middle = match surface {
                    Surface::Sphere { side, radius, .. } => Some(scale(side, -radius)),
                    Surface::Rational { chart, .. } => Some(chart.origin),
                    _ => None,
                };
                BoundaryForm::within(&face.quadric, middle, &points)?
            }
        };
        // With ∫ n dA = ½ ∮ x × dx.
        let integrand = |x: Vec3, dx: Vec3| form.on_step(x, dx) + 0.5 * dot(by, cross(x, dx));
        Some(curves.iter().map(|c| along(c, &integrand, HALVINGS)).sum())
    }
}

/// ∮ of a 1-form along a curve, by Gauss rules on halves.
fn along(curve: &Bezier<3>, form: &impl Fn(Vec3, Vec3) -> f64, halvings: u32) -> f64 {
    let [rough, fine] = NODES.map(|n| {
        let parts = gauss(n).iter().map(|&(t, w)| {
            let (x, dx) = with_derivative(curve, t);
            w * form(x, dx)
        });
        parts.sum::<f64>()
    });
    let extent = curve.points.iter().map(|p| dot(*p, *p)).fold(0.0, f64::max);
    if halvings == 0 || (rough - fine).abs() <= TOLERANCE * extent.powf(1.5) {
        return fine;
    }
    curve.halves().iter().map(|half| along(half, form, halvings - 1)).sum()
}

/// The point of a curve at t, and its derivative.
fn with_derivative(curve: &Bezier<3>, t: f64) -> (Vec3, Vec3) {
    let ([p, q, r], w) = (curve.points, curve.weight);
    let x = curve.at(t);
    let weights = [(1.0 - t) * (1.0 - t), 2.0 * w * t * (1.0 - t), t * t];
    let slopes = [-2.0 * (1.0 - t), 2.0 * w * (1.0 - 2.0 * t), 2.0 * t];
    let under: f64 = weights.iter().sum();
    // Of Σ sᵢ (pᵢ − x): less is cancelled.
    let over = add(add(scale(sub(p, x), slopes[0]), scale(sub(q, x), slopes[1])), scale(sub(r, x), slopes[2]));
    (x, scale(over, 1.0 / under))
}
