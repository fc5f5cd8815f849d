//! One hub: a ball and the half-beams that meet in it, joined by quadric fillets.
//!
//! With S = x·x − r² and G affine, increasing along its half-beam, a half-beam is S ≤ G². The hub is S ≤ N(G), where
//! N(g) = max over y ≥ 0 of 2 y·g − yᵀRy and R is 1 on its diagonal and τ off it. N is convex, once differentiable and
//! a quadratic form on each of finitely many cones, so every piece of the hub is a quadric, every boundary between
//! pieces lies in a plane, every seam is a conic and every joint is tangent. τ = 1 is the sharp union, where N is the
//! square of the largest G. Two half-beams give the fillet S − (a² − 2τab + b²)/(1 − τ²) of the note with τ = (β −
//! α)/(β + α).
//!
//! Each pair has its own τ; R must be positive definite.

use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

use super::affine_function::{AffineFunction, largest};
use super::fillet_matrix::Factor;

/// Maximum τ of fillets: a fillet above it cannot be distinguished from a crease.
pub(super) const MAX_TAU: f64 = 0.999;

/// The half of a beam that belongs to one hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfBeam {
    /// Index of the beam.
    pub beam: u32,
    /// Which of its ends is at this hub: 0 or 1.
    pub end: usize,
    /// Unit vector from the hub's centre to the other hub's centre.
    pub axis: Vec3,
    /// G = √λ (axis · x − contact).
    pub(crate) g: AffineFunction,
    /// Position of the contact plane along the axis, mm.
    pub contact: f64,
    /// Coefficients [A, B, C] of the meridian ρ² = A z² + B z + C.
    pub meridian: [f64; 3],
    /// Position of the split plane along the axis, mm.
    pub split: f64,
    /// Position of the cut plane along the axis, mm; at least `split`.
    pub cut: f64,
}

impl HalfBeam {
    /// ρ² at z along the axis, mm².
    #[inline]
    pub fn radius_squared(&self, z: f64) -> f64 {
        let [a, b, c] = self.meridian;
        (a * z + b) * z + c
    }

    /// Maximum radius between the centre and the cut plane, mm.
    pub fn max_radius(&self) -> f64 {
        let [a, b, _] = self.meridian;
        let ends = self.radius_squared(0.0).max(self.radius_squared(self.cut));
        let top = -b / (2.0 * a);
        if a < 0.0 && top > 0.0 && top < self.cut { ends.max(self.radius_squared(top)) } else { ends }.max(0.0).sqrt()
    }
}

/// A hub with its half-beams. Positions are relative to its centre.
#[derive(Clone, Copy, Debug)]
pub struct Hub<'a> {
    /// Radius of the ball, mm.
    pub radius: f64,
    /// Its half-beams.
    pub half_beams: &'a [HalfBeam],
    /// G of each that may be active, close together in memory.
    pub(crate) g: &'a [AffineFunction],
    /// R: τ of each pair of these and 1 on the diagonal, row by row; empty if they meet in creases.
    pub(crate) taus: &'a [f64],
    /// Upper bound of N where no G is more than 1.
    pub(crate) most: f64,
}

impl Hub<'_> {
    /// Whether half-beams meet in creases (τ = 1).
    pub fn sharp(&self) -> bool {
        self.taus.is_empty()
    }

    /// τ of two half-beams.
    pub fn tau(&self, i: usize, j: usize) -> f64 {
        if self.sharp() { 1.0 } else { self.taus[i * self.g.len() + j] }
    }

    /// How far x lies outside the range of the hub's formula (mm; positive outside), and the gradient, if that is more than
    /// `least`: the distance past the cut plane of the half-beam with the largest G, limited by the difference of G to the
    /// second largest.
    #[inline]
    pub(super) fn past_cut(&self, x: Vec3, least: f64) -> (f64, Vec3) {
        self.with_g(x, |g| self.past_cut_of(x, g, least))
    }

    /// As `past_cut`, for given G at x.
    #[inline]
    pub(super) fn past_cut_of(&self, x: Vec3, g: &[f64], least: f64) -> (f64, Vec3) {
        let (mut first, mut second) = (0.0, 0.0);
        for &g in g {
            if g > first {
                (second, first) = (first, g);
            } else if g > second {
                second = g;
            }
        }
        let mut most = (least, [0.0; 3]);
        for (i, &g) in g.iter().enumerate() {
            let lead = g - if g == first { second } else { first };
            if lead > most.0 {
                let s = &self.half_beams[i];
                let along = dot(s.axis, x) - s.cut;
                if along.min(lead) > most.0 {
                    most = if along < lead { (along, s.axis) } else { (lead, s.g.a) };
                }
            }
        }
        most
    }

    /// Whether x is in the hub's part of the solid: inside, and before the split plane of the half-beam with the
    /// largest G.
    pub fn contains(&self, x: Vec3) -> bool {
        let square = dot(x, x) - self.radius * self.radius;
        self.with_g(x, |g| {
            let leader = largest(g);
            self.is_before_split_of(x, leader) && square < self.union_of(g, leader, [square; 2])
        })
    }

    /// Whether x lies before the split plane of the half-beam with the largest G.
    pub fn is_before_split(&self, x: Vec3) -> bool {
        self.with_g(x, |g| self.is_before_split_of(x, largest(g)))
    }

    /// As `is_before_split`, where the largest G is known.
    #[inline]
    fn is_before_split_of(&self, x: Vec3, (first, most): (usize, f64)) -> bool {
        most <= 0.0 || dot(self.half_beams[first].axis, x) <= self.half_beams[first].split
    }

    /// Bounds of the hub's part with half-beams up to their cut planes: fillets lie in the convex hull of the ball and
    /// these.
    pub fn bounds(&self) -> Aabb {
        self.bounds_to(|i| self.half_beams[i].cut)
    }

    /// Bounds of the hub's part of the solid, up to the split planes. Fillets that may not end before have the maximum τ; there
    /// half-beams count up to their cut planes.
    pub(super) fn part_bounds(&self) -> Aabb {
        self.bounds_to(|i| {
            let s = &self.half_beams[i];
            let ends = self.sharp() || (0..self.half_beams.len()).all(|j| j == i || self.tau(i, j) < MAX_TAU);
            if ends { s.split } else { s.cut }
        })
    }

    /// Bounds of the ball and of half-beams up to these positions along them.
    fn bounds_to(&self, end: impl Fn(usize) -> f64) -> Aabb {
        let r = self.radius;
        let mut b = Aabb { min: [-r; 3], max: [r; 3] };
        for (i, s) in self.half_beams.iter().enumerate() {
            let (thick, end) = (s.max_radius(), end(i));
            for a in 0..3 {
                let side = thick * (1.0 - s.axis[a] * s.axis[a]).max(0.0).sqrt();
                let end = s.axis[a] * end;
                b.min[a] = b.min[a].min(end.min(0.0) - side);
                b.max[a] = b.max[a].max(end.max(0.0) + side);
            }
        }
        b
    }

    /// Upper bound of half the second derivative of N along any unit vector.
    pub fn curvature_bound(&self) -> f64 {
        if self.sharp() {
            return self.half_beams.iter().map(|s| dot(s.g.a, s.g.a)).fold(0.0, f64::max);
        }
        let mut m = [[0.0; 3]; 3];
        for h in self.squares(&|i| self.half_beams[i].g) {
            for i in 0..3 {
                for j in 0..3 {
                    m[i][j] += h.a[i] * h.a[j];
                }
            }
        }
        geometry::math::spectral_norm(&m)
    }

    /// Upper bound of N where no G is more than 1. N increases with every G, and as their square if they increase together.
    pub(super) fn union_bound(&self) -> f64 {
        if self.sharp() {
            return 1.0;
        }
        self.squares(&|_| AffineFunction { a: [0.0; 3], b: 1.0 }).iter().map(|h| h.b * h.b).sum::<f64>() * (1.0 + 1e-9)
    }

    /// N of these functions over all half-beams, which is at least N over any of them, as a sum of squares.
    fn squares(&self, g: &dyn Fn(usize) -> AffineFunction) -> Vec<AffineFunction> {
        let all: Vec<usize> = (0..self.half_beams.len()).collect();
        Factor::new(&all, |i, j| self.tau(i, j)).squares(g)
    }

    /// The middle of the crotch of two half-beams, where the crease between them would be, and the fillet's radius of
    /// curvature there (mm; infinite if not concave); `None` if they do not meet.
    pub fn crotch(&self, i: usize, j: usize, tau: f64) -> Option<(Vec3, f64)> {
        let (p, q) = (&self.half_beams[i], &self.half_beams[j]);
        let (kp, kq) = (norm(p.g.a), norm(q.g.a));
        let cos = dot(p.axis, q.axis);
        let across = sub(q.axis, scale(p.axis, cos));
        let sin = norm(across);
        if sin < 1e-9 {
            return None;
        }
        let across = scale(across, 1.0 / sin);
        // Points where both G equal g: (u, v) = o + g e, along the first axis and perpendicular to it.
        let (o, e) = ([p.contact, (q.contact - cos * p.contact) / sin], [1.0 / kp, (1.0 / kq - cos / kp) / sin]);
        let two = e[0] * e[0] + e[1] * e[1] - 2.0 / (1.0 + tau);
        let (one, none) = (o[0] * e[0] + o[1] * e[1], o[0] * o[0] + o[1] * o[1] - self.radius * self.radius);
        if none >= 0.0 {
            return None;
        }
        let root = one * one - two * none;
        if root < 0.0 {
            return None;
        }
        // The first sign change outwards: −none / (one + √root) is positive since none < 0.
        let g = -none / (one + root.sqrt());
        if !(g > 0.0 && g.is_finite()) {
            return None;
        }
        let x = [o[0] + g * e[0], o[1] + g * e[1]];
        let (a, b) = ([kp, 0.0], [kq * cos, kq * sin]);
        let y = g / (1.0 + tau);
        let slope = [2.0 * (x[0] - y * (a[0] + b[0])), 2.0 * (x[1] - y * (a[1] + b[1]))];
        let steep = slope[0].hypot(slope[1]);
        let along = [-slope[1] / steep, slope[0] / steep];
        let (ta, tb) = (a[0] * along[0] + a[1] * along[1], b[0] * along[0] + b[1] * along[1]);
        let second = 2.0 - 2.0 * (ta * ta - 2.0 * tau * ta * tb + tb * tb) / (1.0 - tau * tau);
        let radius = if second < 0.0 { -steep / second } else { f64::INFINITY };
        Some((add(scale(p.axis, x[0]), scale(across, x[1])), radius))
    }

    /// Pairs of half-beams that meet in a crease or in the fillet that replaces it.
    pub fn adjacent_pairs(&self) -> Vec<(usize, usize)> {
        let mut out = Vec::new();
        for i in 0..self.half_beams.len() {
            for j in 0..i {
                let Some((x, _)) = self.crotch(i, j, 1.0 - 1e-12) else {
                    continue;
                };
                let g = self.half_beams[i].g.at(x);
                let led = |(k, s): (usize, &HalfBeam)| k != i && k != j && s.g.at(x) > g * (1.0 + 1e-9);
                if !self.half_beams.iter().enumerate().any(led) {
                    out.push((j, i));
                }
            }
        }
        out
    }

    /// The minimum τ at which the fillet of half-beams i and j ends before `z` along i and up to its split plane: the
    /// maximum of G_j/G_i there on the meridian that faces j.
    pub fn min_tau(&self, i: usize, j: usize, z: f64) -> f64 {
        let (p, q) = (&self.half_beams[i], &self.half_beams[j]);
        let cos = dot(p.axis, q.axis);
        let sin = norm(sub(q.axis, scale(p.axis, cos)));
        let ratio = |z: f64| {
            let rho = p.radius_squared(z).max(0.0).sqrt();
            let g = norm(q.g.a) * (z * cos + rho * sin - q.contact);
            g / (norm(p.g.a) * (z - p.contact))
        };
        let mut most = ratio(z).max(ratio(p.split));
        // Stationary points of the ratio: sin (m z + n) = (d_i cos − d_j) ρ, since (ρ²)'/2 (z − d) − ρ² is linear in z.
        let ([a, b, c], d) = (p.meridian, p.contact);
        let (m, n) = (sin * (-a * d - b / 2.0), sin * (-b * d / 2.0 - c));
        let w = d * cos - q.contact;
        let (two, one, none) = (m * m - w * w * a, 2.0 * m * n - w * w * b, n * n - w * w * c);
        let root = (one * one - 4.0 * two * none).max(0.0).sqrt();
        let s = -(one + root.copysign(one)) / 2.0;
        for at in [s / two, none / s] {
            if at > z && at < p.split {
                most = most.max(ratio(at));
            }
        }
        most
    }
}
