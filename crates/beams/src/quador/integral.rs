//! Volume, area, centroid and inertia by integration over faces and seams.
//!
//! By the divergence theorem ∫ dV = ⅓∮ x·n dA, ∫ x dV = ¼∮ x (x·n) dA and ∫ xxᵀ dV = ⅕∮ xxᵀ (x·n) dA over a closed
//! surface. ∫ x·n dA over a face is an integral of a rational function along its seams (`boundary_form`); area and
//! moments are integrated across the face too. Integrands are analytic, so Gauss quadrature converges exponentially.
//! Orders are raised and intervals halved until two rules agree, to 1e-10 of the whole; otherwise the result is
//! refused.

use core::f64::consts::{FRAC_PI_4, PI};

use rayon::prelude::*;

use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, add, dot, norm, scale, sub};

use super::Quadors;
use super::boundary_form::{BoundaryForm, SeamForm};
use super::complex::Complex;
use super::conic::{Conic, ConicPart};
use super::gauss::gauss;
use super::hub::{HalfBeam, Hub};
use super::hub_classes::HubClasses;

/// Integrals over a solid of unit density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MassProperties {
    /// Volume, mm³.
    pub volume: f64,
    /// Area of the surface, mm².
    pub area: f64,
    /// ∫ x dV, mm⁴.
    pub first: Vec3,
    /// ∫ x xᵀ dV, mm⁵.
    pub second: Mat3,
    /// Difference of the two finest rules where bisection ended, relative to the whole.
    residual: f64,
}

impl MassProperties {
    /// The centroid, mm.
    pub fn centroid(&self) -> Vec3 {
        scale(self.first, 1.0 / self.volume)
    }

    /// The inertia tensor about the centroid, ∫ (|y|² I − y yᵀ) dV, mm⁵.
    pub fn inertia(&self) -> Mat3 {
        let c = self.centroid();
        let about = |i: usize, j: usize| self.second[i][j] - self.volume * c[i] * c[j];
        let trace: f64 = (0..3).map(|i| about(i, i)).sum();
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { trace - about(i, i) } else { -about(i, j) }))
    }

    /// The same solid translated by `by` (mm).
    pub fn translated(&self, by: Vec3) -> MassProperties {
        let mut out = *self;
        for i in 0..3 {
            out.first[i] += self.volume * by[i];
            for j in 0..3 {
                out.second[i][j] += self.first[i] * by[j] + by[i] * self.first[j] + self.volume * by[i] * by[j];
            }
        }
        out
    }

    /// The sum over two disjoint solids.
    pub fn plus(mut self, o: &MassProperties) -> MassProperties {
        self.volume += o.volume;
        self.area += o.area;
        self.residual += o.residual;
        self.first = add(self.first, o.first);
        for i in 0..3 {
            self.second[i] = add(self.second[i], o.second[i]);
        }
        self
    }

    /// Adds the disc in the split plane of a half-beam: boundary of the hub's part, not of the lattice.
    fn add_disc<const ALL: bool>(&mut self, s: &HalfBeam, disc: f64) {
        let z = s.split;
        self.volume += z * disc / 3.0;
        if !ALL {
            return;
        }
        for i in 0..3 {
            self.first[i] += s.axis[i] * z * z * disc / 4.0;
            for j in 0..3 {
                let square = s.axis[i] * s.axis[j];
                let same = f64::from(i == j);
                self.second[i][j] += z / 5.0 * disc * (z * z * square + (same - square) * s.radius_squared(z) / 4.0);
            }
        }
    }

    /// Adds a surface element at x: `flux` is x·n dA, `area` is dA.
    #[inline]
    fn add_surface(&mut self, x: Vec3, flux: f64, area: f64) {
        self.volume += flux / 3.0;
        self.area += area;
        for i in 0..3 {
            self.first[i] += x[i] * flux / 4.0;
            for j in 0..3 {
                self.second[i][j] += x[i] * x[j] * flux / 5.0;
            }
        }
    }
}

/// Order of the quadrature.
#[derive(Clone, Copy, Debug)]
pub(super) struct QuadratureOrder {
    /// Numbers of nodes, tried in order until two rules agree.
    pub nodes: &'static [usize],
    /// Tolerance for the difference of two rules, relative to the hub's volume (and area, and second moment), summed
    /// over all seams.
    pub tolerance: f64,
}

/// For a relative error of 1e-10: of two rules that agree, the finer is closer to the limit than to the coarser.
pub(super) const DEFAULT_ORDER: QuadratureOrder = QuadratureOrder { nodes: &[7, 10, 14], tolerance: 1e-10 };

/// Maximum sum of residuals, relative to the hub's volume (and area, and second moment).
const MAX_RESIDUAL: f64 = 1e-10;

/// Integrals over a hub's part about its centre; without `ALL` only the volume. `None` if a face has no boundary form
/// or the quadrature does not converge.
pub(super) fn hub_mass<const ALL: bool>(
    hub: &Hub,
    complex: &Complex,
    order: QuadratureOrder,
) -> Option<MassProperties> {
    let mut out = MassProperties::default();
    if complex.arcs.is_empty() {
        let r = hub.radius;
        out.volume = 4.0 / 3.0 * PI * r.powi(3);
        out.area = 4.0 * PI * r * r;
        for i in 0..3 {
            out.second[i][i] = 4.0 / 15.0 * PI * r.powi(5);
        }
        return Some(out);
    }
    // Rough size of the whole, as the scale of tolerances.
    let mut size = MassProperties { volume: hub.radius.powi(3), area: hub.radius.powi(2), ..MassProperties::default() };
    size.second[0][0] = hub.radius.powi(5);
    for s in hub.half_beams {
        let square = s.radius_squared(s.split);
        size.volume += PI * square * s.split;
        size.area += PI * square.sqrt() * s.split;
        size.second[0][0] += square * s.split.powi(3);
        out.add_disc::<ALL>(s, PI * square);
    }
    let middles: Vec<Vec3> = (complex.arcs.iter()).map(|a| a.conic.at(a.conic.end / 2.0)).collect();
    let ends: Vec<f64> = (complex.arcs.iter())
        .map(|a| if a.conic.end < PI { 1.0 / a.conic.end.tan() } else { f64::NEG_INFINITY })
        .collect();
    // The faces on the left and on the right of each arc.
    let mut faces = vec![[0; 2]; complex.arcs.len()];
    let mut forms = Vec::with_capacity(complex.faces.len());
    for face in &complex.faces {
        for &(arc, forward) in face.loops.iter().flatten() {
            faces[arc as usize][usize::from(!forward)] = forms.len();
        }
        forms.push(BoundaryForm::new(hub, complex, face, (&middles, &ends))?);
    }
    let tolerance = order.tolerance / complex.arcs.len() as f64;
    let quadrature = Quadrature { nodes: order.nodes, tolerance, size };
    for (arc, of) in complex.arcs.iter().zip(faces) {
        let of = of.map(|s| &forms[s]);
        let ends = arc.ends.map(|v| complex.vertices[v as usize].at);
        quadrature.seam::<ALL>(&arc.conic, ends, of, &mut out);
    }
    (out.residual <= MAX_RESIDUAL).then_some(out)
}

struct Quadrature {
    nodes: &'static [usize],
    /// Tolerance per seam.
    tolerance: f64,
    size: MassProperties,
}

impl Quadrature {
    /// Adds the contribution of a seam between two vertices to the faces on its left and right.
    fn seam<const ALL: bool>(&self, conic: &Conic, ends: [Vec3; 2], of: [&BoundaryForm; 2], out: &mut MassProperties) {
        // Where vertices were merged: the gap between them and the seam.
        let (first, last) = (conic.v, conic.at(conic.end));
        for (x, by) in [(ends[0], sub(first, ends[0])), (last, sub(ends[1], last))] {
            out.volume += (of[0].on_step(x, by) - of[1].on_step(x, by)) / 3.0;
        }
        let seam = SeamForm::new(of, conic);
        // At most an eighth of the full angle per interval.
        let parts = (conic.end / FRAC_PI_4).ceil().max(1.0);
        for p in 0..parts as usize {
            let at = |p: usize| conic.end / parts * p as f64;
            let conic_part = conic.part(at(p), at(p + 1));
            let part = |n, along: [f64; 2], across: [f64; 2]| {
                if ALL {
                    full_part(conic, &conic_part, of, n, along, across)
                } else {
                    volume_part(&conic_part, &seam, n, along)
                }
            };
            self.integrate::<ALL>(&part, [0.0, 1.0], [0.0, 1.0], 16, out);
        }
    }

    /// Adds `part(n, along, across)`, the integral by n nodes over parameter ranges along a seam and across the face.
    /// Raises n and then halves ranges until two rules agree. Volumes have closed forms across.
    fn integrate<const ALL: bool>(
        &self,
        part: &impl Fn(usize, [f64; 2], [f64; 2]) -> MassProperties,
        along: [f64; 2],
        across: [f64; 2],
        depth: u32,
        out: &mut MassProperties,
    ) {
        let trace = |m: &MassProperties| m.second[0][0] + m.second[1][1] + m.second[2][2];
        let apart = |a: &MassProperties, b: &MassProperties| {
            let volume = (a.volume - b.volume).abs() / self.size.volume;
            if !ALL {
                return volume;
            }
            let area = (a.area - b.area).abs() / self.size.area;
            volume.max(area).max((trace(a) - trace(b)).abs() / self.size.second[0][0])
        };
        let nodes = self.nodes;
        let (mut rough, mut fine) = (MassProperties::default(), part(nodes[0], along, across));
        for &n in &nodes[1..] {
            (rough, fine) = (fine, part(n, along, across));
            if apart(&rough, &fine) <= self.tolerance {
                *out = out.plus(&fine);
                return;
            }
        }
        if depth == 0 {
            fine.residual = apart(&rough, &fine);
            *out = out.plus(&fine);
            return;
        }
        // Halves the range that accounts for more of the difference.
        let (t, u) = ((along[0] + along[1]) / 2.0, (across[0] + across[1]) / 2.0);
        let n = nodes[nodes.len() - 2];
        let gained = || {
            let halves = part(n, [along[0], t], across).plus(&part(n, [t, along[1]], across));
            apart(&halves, &rough) > 0.5 * apart(&rough, &fine)
        };
        let halves = if !ALL || depth.is_multiple_of(4) || gained() {
            [([along[0], t], across), ([t, along[1]], across)]
        } else {
            [(along, [across[0], u]), (along, [u, across[1]])]
        };
        for (along, across) in halves {
            self.integrate::<ALL>(part, along, across, depth - 1, out);
        }
    }
}

/// The volume, by the boundary forms on both sides of a seam.
fn volume_part(conic_part: &ConicPart, seam: &SeamForm, n: usize, [from, to]: [f64; 2]) -> MassProperties {
    let mut sum = 0.0;
    for &(t, w) in gauss(n) {
        let (x, dx) = conic_part.at(from + t * (to - from));
        sum += w * seam.at(x, dx);
    }
    MassProperties { volume: sum * (to - from) / 3.0, ..MassProperties::default() }
}

/// All integrals between a seam and the bases of the projections of its faces.
fn full_part(
    conic: &Conic,
    conic_part: &ConicPart,
    of: [&BoundaryForm; 2],
    n: usize,
    along: [f64; 2],
    across: [f64; 2],
) -> MassProperties {
    let mut out = MassProperties::default();
    let size = (along[1] - along[0]) * (across[1] - across[0]);
    for &(t, w) in gauss(n) {
        let (f, df) = conic_part.at(along[0] + t * (along[1] - along[0]));
        let (x, dx) = (add(conic.v, conic.in_space(f)), conic.in_space(df));
        for (sheet, turn) in of.into_iter().zip([w * size, -w * size]) {
            for &(u, w) in gauss(n) {
                let u = across[0] + u * (across[1] - across[0]);
                let (position, slope, weight) = sheet.area_element(x, dx, u);
                let weight = turn * w * weight;
                out.add_surface(position, weight * dot(position, slope), weight * norm(slope));
            }
        }
    }
    out
}

/// A hub with a face that cannot be resolved.
pub(super) fn unresolved_face(hub: usize) -> Fault {
    Fault::new(
        format!("hubs[{hub}]"),
        "a face is too thin to be resolved: move the beams of the hub apart, or use the field",
    )
}

impl Quadors {
    /// Volume, area, centroid and inertia of the whole, to a relative error of 1e-10: the sum over all hubs, equal hubs
    /// integrated once. Valid only if beams meet in hubs alone.
    ///
    /// # Errors
    /// Beams that overlap too far for closed forms.
    pub fn mass(&self) -> Result<MassProperties, Fault> {
        let (classes, each) = self.per_class::<true>()?;
        let all = (classes.of.iter().enumerate()).map(|(i, &c)| each[c as usize].translated(self.center(i)));
        Ok(all.fold(MassProperties::default(), |sum, m| sum.plus(&m)))
    }

    /// The volume of the whole, mm³.
    ///
    /// # Errors
    /// As for `mass`.
    pub fn volume(&self) -> Result<f64, Fault> {
        let (classes, each) = self.per_class::<false>()?;
        let all = each.iter().zip(&classes.count);
        Ok(all.map(|(m, &n)| m.volume * n as f64).sum())
    }

    /// Integrals over one hub of each class about its centre.
    fn per_class<const ALL: bool>(&self) -> Result<(HubClasses, Vec<MassProperties>), Fault> {
        self.require_closed_forms()?;
        let classes = self.classes();
        let of = |&i: &usize| {
            hub_mass::<ALL>(&self.hub(i), &self.complex(i)?, DEFAULT_ORDER).ok_or_else(|| unresolved_face(i))
        };
        let each: Vec<Result<_, Fault>> = classes.sample.par_iter().map(of).collect();
        let each = each.into_iter().collect::<Result<_, _>>()?;
        Ok((classes, each))
    }

    /// The volume of one hub's part, mm³.
    ///
    /// # Errors
    /// Hubs whose seams do not close.
    pub fn hub_volume(&self, hub: usize) -> Result<f64, Fault> {
        let mass = hub_mass::<false>(&self.hub(hub), &self.complex(hub)?, DEFAULT_ORDER);
        Ok(mass.ok_or_else(|| unresolved_face(hub))?.volume)
    }

    /// The boundary complex of a hub.
    ///
    /// # Errors
    /// Hubs whose seams do not close.
    pub fn complex(&self, hub: usize) -> Result<Complex, Fault> {
        Complex::new(&self.hub(hub)).map_err(|f| f.under(&format!("hubs[{hub}]")))
    }
}
