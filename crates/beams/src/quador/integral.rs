//! Volume, area, centroid and inertia, from the faces.
//!
//! By the divergence theorem ∫ dV = ⅓∮ x·n dA, ∫ x dV = ¼∮ x (x·n) dA and ∫ xxᵀ dV = ⅕∮ xxᵀ (x·n) dA over a closed surface.
//! The volume of x·n dA over a face is an integral along its seams (`sheet`), of a quotient of polynomials; area and moments go
//! across the face too. What is integrated is analytic, so Gauss's rule gains digits in proportion to its nodes; it is given
//! enough that the whole comes out to 1e-10, and what does not settle is refused.

use core::f64::consts::{FRAC_PI_4, PI};

use rayon::prelude::*;

use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, add, dot, norm, scale, sub};

use super::Quadors;
use super::classes::Classes;
use super::complex::Complex;
use super::hub::{Hub, Stub};
use super::quadric::{Conic, Run};
use super::rule::gauss;
use super::sheet::{Seam, Sheet};

/// Integrals over a solid of density one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mass {
    /// Volume, mm³.
    pub volume: f64,
    /// Area of the surface, mm².
    pub area: f64,
    /// ∫ x dV, mm⁴.
    pub first: Vec3,
    /// ∫ x xᵀ dV, mm⁵.
    pub second: Mat3,
    /// By how much rules differ where halving came to its end, as a share of the whole.
    doubt: f64,
}

impl Mass {
    /// The centroid, mm.
    pub fn centroid(&self) -> Vec3 {
        scale(self.first, 1.0 / self.volume)
    }

    /// The inertia about the centroid, ∫ (|y|² I − y yᵀ) dV, mm⁵.
    pub fn inertia(&self) -> Mat3 {
        let c = self.centroid();
        let about = |i: usize, j: usize| self.second[i][j] - self.volume * c[i] * c[j];
        let trace: f64 = (0..3).map(|i| about(i, i)).sum();
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { trace - about(i, i) } else { -about(i, j) }))
    }

    /// The same solid moved by `by`.
    pub fn moved(&self, by: Vec3) -> Mass {
        let mut out = *self;
        for i in 0..3 {
            out.first[i] += self.volume * by[i];
            for j in 0..3 {
                out.second[i][j] += self.first[i] * by[j] + by[i] * self.first[j] + self.volume * by[i] * by[j];
            }
        }
        out
    }

    /// Both solids.
    pub fn plus(mut self, o: &Mass) -> Mass {
        self.volume += o.volume;
        self.area += o.area;
        self.doubt += o.doubt;
        self.first = add(self.first, o.first);
        for i in 0..3 {
            self.second[i] = add(self.second[i], o.second[i]);
        }
        self
    }

    /// The disc in which a stub is parted: no surface of the lattice, but of the hub's part.
    fn rim<const ALL: bool>(&mut self, s: &Stub, disc: f64) {
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
                self.second[i][j] += z / 5.0 * disc * (z * z * square + (same - square) * s.squared(z) / 4.0);
            }
        }
    }

    /// The share of the surface at x: `flux` is x·n dA, `area` dA.
    #[inline]
    fn surface(&mut self, x: Vec3, flux: f64, area: f64) {
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

/// How fine the quadrature is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    /// Nodes of the rules that are tried one after the other, until two agree.
    pub nodes: &'static [usize],
    /// How far they may differ, of the hub's volume (and area, and second moment), along all seams together.
    pub differ: f64,
}

/// Enough for 1e-10: of two rules that agree the better is nearer to what is right than to the other.
pub(super) const USUAL: Order = Order { nodes: &[7, 10, 14], differ: 1e-10 };

/// What parts that no number of halvings brings to agree may come to, of the hub's volume (and area, and second moment).
const DOUBT: f64 = 1e-10;

/// Integrals over a hub's part about its centre, with `ALL` unset only the volume; `None` if a face cannot be seen whole, or parts
/// do not come to agree.
pub(super) fn hub_mass<const ALL: bool>(hub: &Hub, complex: &Complex, order: Order) -> Option<Mass> {
    let mut out = Mass::default();
    if complex.arcs.is_empty() {
        let r = hub.radius;
        out.volume = 4.0 / 3.0 * PI * r.powi(3);
        out.area = 4.0 * PI * r * r;
        for i in 0..3 {
            out.second[i][i] = 4.0 / 15.0 * PI * r.powi(5);
        }
        return Some(out);
    }
    // A guess of the whole, for what is small beside it.
    let mut size = Mass { volume: hub.radius.powi(3), area: hub.radius.powi(2), ..Mass::default() };
    size.second[0][0] = hub.radius.powi(5);
    for s in hub.stubs {
        let square = s.squared(s.split);
        size.volume += PI * square * s.split;
        size.area += PI * square.sqrt() * s.split;
        size.second[0][0] += square * s.split.powi(3);
        out.rim::<ALL>(s, PI * square);
    }
    let middles: Vec<Vec3> = (complex.arcs.iter()).map(|a| a.conic.at(a.conic.end / 2.0)).collect();
    let ends: Vec<f64> = (complex.arcs.iter())
        .map(|a| if a.conic.end < PI { 1.0 / a.conic.end.tan() } else { f64::NEG_INFINITY })
        .collect();
    // What lies to the left and to the right of each arc.
    let mut sides = vec![[0; 2]; complex.arcs.len()];
    let mut sheets = Vec::with_capacity(complex.faces.len());
    for face in &complex.faces {
        for &(arc, forward) in face.loops.iter().flatten() {
            sides[arc as usize][usize::from(!forward)] = sheets.len();
        }
        sheets.push(Sheet::new(hub, complex, face, (&middles, &ends))?);
    }
    let differ = order.differ / complex.arcs.len() as f64;
    let work = Work { nodes: order.nodes, differ, size };
    for (arc, of) in complex.arcs.iter().zip(sides) {
        let of = of.map(|s| &sheets[s]);
        let ends = arc.ends.map(|v| complex.vertices[v as usize].at);
        work.seam::<ALL>(&arc.conic, ends, of, &mut out);
    }
    (out.doubt <= DOUBT).then_some(out)
}

struct Work {
    nodes: &'static [usize],
    /// Of each seam.
    differ: f64,
    size: Mass,
}

impl Work {
    /// What the faces to the left and the right of a seam between two vertices have of it.
    fn seam<const ALL: bool>(&self, conic: &Conic, ends: [Vec3; 2], of: [&Sheet; 2], out: &mut Mass) {
        // Where vertices were made one, what is left between them and the seam.
        let (first, last) = (conic.v, conic.at(conic.end));
        for (x, by) in [(ends[0], sub(first, ends[0])), (last, sub(ends[1], last))] {
            out.volume += (of[0].short(x, by) - of[1].short(x, by)) / 3.0;
        }
        let seam = Seam::new(of, conic);
        // At most a quarter of a circle at a time.
        let parts = (conic.end / FRAC_PI_4).ceil().max(1.0);
        for p in 0..parts as usize {
            let at = |p: usize| conic.end / parts * p as f64;
            let run = conic.run(at(p), at(p + 1));
            let part = |n, along: [f64; 2], across: [f64; 2]| {
                if ALL { swept(conic, &run, of, n, along, across) } else { closed(&run, &seam, n, along) }
            };
            self.settle::<ALL>(&part, [0.0, 1.0], [0.0, 1.0], 16, out);
        }
    }

    /// Adds what `part` gives, for a number of nodes and ranges along a seam and across the face, with more nodes and then
    /// halving ranges until two rules agree. Volumes are in closed form across.
    fn settle<const ALL: bool>(
        &self,
        part: &impl Fn(usize, [f64; 2], [f64; 2]) -> Mass,
        along: [f64; 2],
        across: [f64; 2],
        depth: u32,
        out: &mut Mass,
    ) {
        let trace = |m: &Mass| m.second[0][0] + m.second[1][1] + m.second[2][2];
        let apart = |a: &Mass, b: &Mass| {
            let volume = (a.volume - b.volume).abs() / self.size.volume;
            if !ALL {
                return volume;
            }
            let area = (a.area - b.area).abs() / self.size.area;
            volume.max(area).max((trace(a) - trace(b)).abs() / self.size.second[0][0])
        };
        let nodes = self.nodes;
        let (mut rough, mut fine) = (Mass::default(), part(nodes[0], along, across));
        for &n in &nodes[1..] {
            (rough, fine) = (fine, part(n, along, across));
            if apart(&rough, &fine) <= self.differ {
                *out = out.plus(&fine);
                return;
            }
        }
        if depth == 0 {
            fine.doubt = apart(&rough, &fine);
            *out = out.plus(&fine);
            return;
        }
        // The side that says more about the difference.
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
            self.settle::<ALL>(part, along, across, depth - 1, out);
        }
    }
}

/// The volume by the forms of both sides of a seam.
fn closed(run: &Run, seam: &Seam, n: usize, [from, to]: [f64; 2]) -> Mass {
    let mut sum = 0.0;
    for &(t, w) in gauss(n) {
        let (x, dx) = run.at(from + t * (to - from));
        sum += w * seam.at(x, dx);
    }
    Mass { volume: sum * (to - from) / 3.0, ..Mass::default() }
}

/// All of the surface between a seam and where its faces are seen from.
fn swept(conic: &Conic, run: &Run, of: [&Sheet; 2], n: usize, along: [f64; 2], across: [f64; 2]) -> Mass {
    let mut out = Mass::default();
    let size = (along[1] - along[0]) * (across[1] - across[0]);
    for &(t, w) in gauss(n) {
        let (f, df) = run.at(along[0] + t * (along[1] - along[0]));
        let (x, dx) = (add(conic.v, conic.plane(f)), conic.plane(df));
        for (sheet, turn) in of.into_iter().zip([w * size, -w * size]) {
            for &(u, w) in gauss(n) {
                let u = across[0] + u * (across[1] - across[0]);
                let (place, slope, weight) = sheet.across(x, dx, u);
                let weight = turn * w * weight;
                out.surface(place, weight * dot(place, slope), weight * norm(slope));
            }
        }
    }
    out
}

/// A hub one of whose faces could not be cut up.
pub(super) fn tangled(hub: usize) -> Fault {
    Fault::new(
        format!("hubs[{hub}]"),
        "a face of it is so thin that its seams cannot be told apart: move its beams apart, or use the field",
    )
}

impl Quadors {
    /// Volume, area, centroid and inertia of the whole, to 1e-10: of the parts of all hubs, equal ones found once. Beams must not
    /// meet but in hubs.
    ///
    /// # Errors
    /// Beams that overlap too far for closed forms.
    pub fn mass(&self) -> Result<Mass, Fault> {
        let (classes, each) = self.each::<true>()?;
        let all = (classes.of.iter().enumerate()).map(|(i, &c)| each[c as usize].moved(self.center(i)));
        Ok(all.fold(Mass::default(), |sum, m| sum.plus(&m)))
    }

    /// The volume alone, mm³.
    ///
    /// # Errors
    /// As for `mass`.
    pub fn volume(&self) -> Result<f64, Fault> {
        let (classes, each) = self.each::<false>()?;
        let all = each.iter().zip(&classes.count);
        Ok(all.map(|(m, &n)| m.volume * n as f64).sum())
    }

    /// Integrals over a hub of each class about its centre.
    fn each<const ALL: bool>(&self) -> Result<(Classes, Vec<Mass>), Fault> {
        self.exact()?;
        let classes = self.classes();
        let of = |&i: &usize| hub_mass::<ALL>(&self.hub(i), &self.complex(i)?, USUAL).ok_or_else(|| tangled(i));
        let each = classes.sample.par_iter().map(of).collect::<Result<_, _>>()?;
        Ok((classes, each))
    }

    /// The volume of the part of one hub, mm³.
    ///
    /// # Errors
    /// Hubs whose seams do not close.
    pub fn hub_volume(&self, hub: usize) -> Result<f64, Fault> {
        let mass = hub_mass::<false>(&self.hub(hub), &self.complex(hub)?, USUAL);
        Ok(mass.ok_or_else(|| tangled(hub))?.volume)
    }

    /// The surface of a hub as faces, arcs and vertices.
    ///
    /// # Errors
    /// Hubs whose seams do not close.
    pub fn complex(&self, hub: usize) -> Result<Complex, Fault> {
        Complex::new(&self.hub(hub)).map_err(|f| f.under(&format!("hubs[{hub}]")))
    }
}
