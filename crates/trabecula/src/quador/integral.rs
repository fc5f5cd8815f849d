//! Volume, area, centroid and inertia, from the faces.
//!
//! By the divergence theorem ∫ dV = ⅓∮ x·n dA, ∫ x dV = ¼∮ x (x·n) dA and ∫ xxᵀ dV = ⅕∮ xxᵀ (x·n) dA over a closed surface.
//! On a stub, x·n dA = (Bz/2 + C) dz dψ. Fillets and corners are swept band by band by half planes; on the ball a fan of arcs
//! runs from the middle of a face to its seams. What is integrated is analytic in each piece, so Gauss's rule gains digits in
//! proportion to its nodes; it is given enough that the whole comes out to 1e-10, and what does not settle is refused.

use core::f64::consts::{FRAC_PI_4, PI};
use std::sync::OnceLock;

use rayon::prelude::*;

use crate::fault::Fault;
use crate::math::{Mat3, Vec3, add, apply, cross, dot, norm, scale, sub, unit};

use super::Quadors;
use super::band::{Band, Frame, Section, bands, girdle, middle};
use super::classes::Classes;
use super::complex::{Complex, Face};
use super::hub::Hub;
use super::quadric::Conic;

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
        [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| {
                if i == j {
                    trace - about(i, i)
                } else {
                    -about(i, j)
                }
            })
        })
    }

    /// The same solid moved by `by`.
    pub fn moved(&self, by: Vec3) -> Mass {
        let mut out = *self;
        for i in 0..3 {
            out.first[i] += self.volume * by[i];
            for j in 0..3 {
                out.second[i][j] +=
                    self.first[i] * by[j] + by[i] * self.first[j] + self.volume * by[i] * by[j];
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

/// Nodes and weights of Gauss's rule on [0, 1].
pub(super) fn gauss(n: usize) -> &'static [(f64, f64)] {
    static RULES: OnceLock<Vec<Vec<(f64, f64)>>> = OnceLock::new();
    let rules = RULES.get_or_init(|| (0..=64).map(rule).collect());
    &rules[n]
}

/// Newton's method on the Legendre polynomial, from Tricomi's estimates of its roots.
fn rule(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut p, mut before) = (1.0, 0.0);
                for j in 1..=n {
                    let j = j as f64;
                    (p, before) = (((2.0 * j - 1.0) * x * p - (j - 1.0) * before) / j, p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            ((1.0 + x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// How fine the quadrature is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    /// Nodes of the rules that are tried one after the other, until two agree.
    pub nodes: &'static [usize],
    /// How far they may differ, of the hub's volume (and area, and second moment), in each part.
    pub differ: f64,
}

/// Enough for 1e-10: the better of two rules that agree is right to half as many digits again.
pub(super) const USUAL: Order = Order {
    nodes: &[7, 10, 14, 20],
    differ: 1e-10,
};

/// What parts that no number of halvings brings to agree may come to, of the hub's volume (and area, and second moment).
const DOUBT: f64 = 1e-10;

/// Integrals over a hub's part about its centre, with `ALL` unset only the volume; `None` if a face cannot be cut into bands,
/// or its parts do not come to agree.
pub(super) fn hub_mass<const ALL: bool>(
    hub: &Hub,
    complex: &Complex,
    order: Order,
) -> Option<Mass> {
    let mut out = Mass::default();
    // A guess of the whole, for what is small beside it.
    let mut size = Mass {
        volume: hub.radius.powi(3),
        area: hub.radius.powi(2),
        ..Mass::default()
    };
    for s in hub.stubs {
        size.volume += PI * s.squared(s.split) * s.split;
        size.area += PI * s.squared(s.split).sqrt() * s.split;
        size.second[0][0] += s.squared(s.split) * s.split.powi(3);
    }
    size.second[0][0] += hub.radius.powi(5);
    let work = Work {
        hub,
        complex,
        order,
        size,
    };
    for face in &complex.faces {
        match face.rim {
            Some(stub) => work.stub::<ALL>(face, stub as usize, &mut out),
            None if face.label == 0 => work.ball::<ALL>(face, &mut out),
            None => {
                let (frame, bands) = bands(hub, complex, face)?;
                for band in &bands {
                    let part = |n, a, b| stripe::<ALL>(complex, &frame, band, n, a, b);
                    work.settle::<ALL>(
                        &part,
                        [0.0, 1.0],
                        [0.0, 1.0],
                        16,
                        !ALL && frame.fillet,
                        &mut out,
                    );
                }
            }
        }
    }
    (out.doubt <= DOUBT).then_some(out)
}

struct Work<'a> {
    hub: &'a Hub<'a>,
    complex: &'a Complex,
    order: Order,
    size: Mass,
}

impl Work<'_> {
    /// Adds what `part` gives, for a number of nodes and ranges along a seam and across the face, with more nodes and then
    /// halving ranges until two rules agree. `line` tells that it is in closed form across.
    fn settle<const ALL: bool>(
        &self,
        part: &impl Fn(usize, [f64; 2], [f64; 2]) -> Mass,
        along: [f64; 2],
        across: [f64; 2],
        depth: u32,
        line: bool,
        out: &mut Mass,
    ) {
        let trace = |m: &Mass| m.second[0][0] + m.second[1][1] + m.second[2][2];
        let apart = |a: &Mass, b: &Mass| {
            let volume = (a.volume - b.volume).abs() / self.size.volume;
            if !ALL {
                return volume;
            }
            let area = (a.area - b.area).abs() / self.size.area;
            volume
                .max(area)
                .max((trace(a) - trace(b)).abs() / self.size.second[0][0])
        };
        let nodes = self.order.nodes;
        let (mut rough, mut fine) = (Mass::default(), part(nodes[0], along, across));
        for &n in &nodes[1..] {
            (rough, fine) = (fine, part(n, along, across));
            if apart(&rough, &fine) <= self.order.differ {
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
        if line || depth.is_multiple_of(4) || gained() {
            self.settle::<ALL>(part, [along[0], t], across, depth - 1, line, out);
            self.settle::<ALL>(part, [t, along[1]], across, depth - 1, line, out);
        } else {
            self.settle::<ALL>(part, along, [across[0], u], depth - 1, line, out);
            self.settle::<ALL>(part, along, [u, across[1]], depth - 1, line, out);
        }
    }

    /// Calls `part` for each seam of a face, as it is walked.
    fn seams<const ALL: bool>(
        &self,
        face: &Face,
        part: &impl Fn(&Conic, f64, usize, [f64; 2], [f64; 2]) -> Mass,
        out: &mut Mass,
    ) {
        for &(arc, forward) in face.loops.iter().flatten() {
            let conic = &self.complex.arcs[arc as usize].conic;
            let turn = if forward { 1.0 } else { -1.0 };
            // At most a quarter of a circle at a time.
            let parts = (conic.end / FRAC_PI_4).ceil().max(1.0);
            for p in 0..parts as usize {
                let along = [
                    conic.end / parts * p as f64,
                    conic.end / parts * (p + 1) as f64,
                ];
                self.settle::<ALL>(
                    &|n, a, b| part(conic, turn, n, a, b),
                    along,
                    [0.0, 1.0],
                    16,
                    false,
                    out,
                );
            }
        }
    }

    fn stub<const ALL: bool>(&self, face: &Face, stub: usize, out: &mut Mass) {
        let s = &self.hub.stubs[stub];
        let [a, b, c] = s.section;
        let primitive = |z: f64| (b / 4.0 * z + c) * z;
        let top = primitive(s.split);
        let (frame, bands) = girdle(self.complex, face, s.axis);
        for (band, seam, sign) in bands {
            let part = |n: usize, along: [f64; 2], across: [f64; 2]| {
                let mut out = Mass::default();
                for &(t, w) in gauss(n) {
                    let (phi, slope) = band.longitude(along[0] + t * (along[1] - along[0]));
                    let side = frame.meridian(phi);
                    let z = dot(s.axis, frame.meet(self.complex, &seam, side).0);
                    let turn = w * slope * (along[1] - along[0]) * sign;
                    if !ALL {
                        out.volume += turn * (top - primitive(z)) / 3.0;
                        continue;
                    }
                    let (from, height) = (
                        z + across[0] * (s.split - z),
                        (across[1] - across[0]) * (s.split - z),
                    );
                    for &(t, w) in gauss(n) {
                        let at = from + t * height;
                        let rho = s.squared(at).max(0.0).sqrt();
                        let half = a * at + b / 2.0;
                        let weight = w * height * turn;
                        let place = add(scale(s.axis, at), scale(side, rho));
                        out.surface(
                            place,
                            weight * (b / 2.0 * at + c),
                            weight * (rho * rho + half * half).sqrt(),
                        );
                    }
                }
                out
            };
            self.settle::<ALL>(&part, [0.0, 1.0], [0.0, 1.0], 16, !ALL, out);
        }
        // The disc in the split plane: no surface of the lattice, but of the hub's part.
        let (z, disc) = (s.split, PI * s.squared(s.split));
        out.volume += z * disc / 3.0;
        if ALL {
            for i in 0..3 {
                out.first[i] += s.axis[i] * z * z * disc / 4.0;
                for j in 0..3 {
                    let square = s.axis[i] * s.axis[j];
                    let same = f64::from(i == j);
                    out.second[i][j] += z / 5.0
                        * (z * z * square * disc + (same - square) * disc * s.squared(z) / 4.0);
                }
            }
        }
    }

    /// A face on the ball: a fan from its middle.
    fn ball<const ALL: bool>(&self, face: &Face, out: &mut Mass) {
        if face.loops.is_empty() {
            let r = self.hub.radius;
            out.volume += 4.0 / 3.0 * PI * r.powi(3);
            out.area += 4.0 * PI * r * r;
            for i in 0..3 {
                out.second[i][i] += 4.0 / 15.0 * PI * r.powi(5);
            }
            return;
        }
        let apex = middle(self.complex, face);
        let part = |conic: &Conic, sign: f64, n, [a, b]: [f64; 2], across: [f64; 2]| {
            let curve = |t: f64| {
                let (x, dx) = conic.with_slope(a + t * (b - a));
                (x, scale(dx, sign * (b - a)))
            };
            fan::<ALL>(self.hub.radius, apex, &curve, n, across)
        };
        self.seams::<ALL>(face, &part, out);
    }
}

/// The share of the surface over part of a band.
fn stripe<const ALL: bool>(
    complex: &Complex,
    frame: &Frame,
    band: &Band,
    n: usize,
    along: [f64; 2],
    across: [f64; 2],
) -> Mass {
    let mut out = Mass::default();
    let q = &frame.quadric;
    // x·½∇Q is linear where Q vanishes: α + β g along the meridian.
    let alpha = dot(q.b, frame.origin) - q.c;
    let linear = sub(apply(&q.m, frame.origin), q.b);
    for &(u, w) in gauss(n) {
        let (phi, slope) = band.longitude(along[0] + u * (along[1] - along[0]));
        let meridian = frame.meridian(phi);
        let weight = w * slope * (along[1] - along[0]);
        let section = Section::new(frame, meridian);
        let [low, high] = band.borders.map(|b| {
            if frame.fillet {
                section.border(frame, complex, &b, meridian)
            } else {
                frame.latitude(complex, &b, meridian)
            }
        });
        let (from, height) = (
            low + across[0] * (high - low),
            (across[1] - across[0]) * (high - low),
        );
        if !ALL && frame.fillet {
            let beta = dot(linear, meridian);
            out.volume += weight * section.swept(from, from + height, alpha, beta) / 3.0;
            continue;
        }
        for &(v, w) in gauss(n) {
            let at = from + v * height;
            // The place from the origin, and dA = steep |½∇Q| along and across.
            let (away, steep) = if frame.fillet {
                let (g, h) = section.at(at);
                (add(scale(meridian, g), scale(frame.axes[2], h)), g)
            } else {
                let (sin, cos) = at.sin_cos();
                let p = add(scale(meridian, cos), scale(frame.axes[2], sin));
                let (one, two) = (dot(q.b, p), q.form(p, p));
                let root = (one * one - q.c * two).max(0.0).sqrt();
                let s = -q.c / (one + root);
                (scale(p, s), cos * s * s / root)
            };
            let half = q.half_slope(away);
            let (place, steep) = (add(frame.origin, away), w * weight * height * steep);
            if ALL {
                out.surface(place, steep * dot(place, half), steep * norm(half));
            } else {
                out.volume += steep * dot(place, half) / 3.0;
            }
        }
    }
    out
}

/// The share of the part of a ball that a fan from `apex` to a curve (place and derivative over [0, 1]) fills, as far across as
/// told. What runs round the far side is counted with its sign, so the fan need not stay in the face.
fn fan<const ALL: bool>(
    r: f64,
    apex: Vec3,
    curve: &dyn Fn(f64) -> (Vec3, Vec3),
    n: usize,
    across: [f64; 2],
) -> Mass {
    let mut out = Mass::default();
    let o = unit(apex);
    for &(t, w) in gauss(n) {
        let (x, dx) = curve(t);
        let (length, e) = (norm(x), unit(x));
        let turn = w * (across[1] - across[0]) * dot(o, cross(e, dx)) / length;
        let cos = dot(o, e);
        for &(t, w) in gauss(n) {
            let t = across[0] + t * (across[1] - across[0]);
            let (p, angle) = if cos > 0.3 {
                // Straight segments p = (1 − t) o + t e: the solid angle is t det(o, e, de) dt/|p|³.
                let p = add(scale(o, 1.0 - t), scale(e, t));
                let size = norm(p);
                (scale(p, 1.0 / size), t / (size * size * size))
            } else {
                // Great circles, as a segment would pass near the centre: β sin(tβ) det/sin²β.
                let beta = cos.clamp(-1.0, 1.0).acos();
                let sin = beta.sin();
                let p = add(
                    scale(o, ((1.0 - t) * beta).sin() / sin),
                    scale(e, (t * beta).sin() / sin),
                );
                (p, beta * (t * beta).sin() / (sin * sin))
            };
            let area = turn * w * angle * r * r;
            if ALL {
                out.surface(scale(p, r), r * area, area);
            } else {
                out.volume += r * area / 3.0;
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
        let all =
            (classes.of.iter().enumerate()).map(|(i, &c)| each[c as usize].moved(self.center(i)));
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
        let of = |&i: &usize| {
            hub_mass::<ALL>(&self.hub(i), &self.complex(i)?, USUAL).ok_or_else(|| tangled(i))
        };
        let each = classes
            .sample
            .par_iter()
            .map(of)
            .collect::<Result<_, _>>()?;
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
