//! Sections of fillets by half planes.

use std::sync::OnceLock;

use super::{Border, Frame};
use crate::math::{Vec3, dot, sub};
use crate::quador::complex::Complex;

/// The section of a fillet by a half plane through the line where both of its stubs' G vanish: h² = A g² + B g + C.
///
/// By p with dg/dp = −h it is g = g₀ − d (cosh √A p − 1)/A and h = d sinh(√A p)/√A, where d = √(B² − 4AC)/2 and g₀ is the
/// crotch: entire in p, and in A through zero. The outward area times x is g (x·½∇Q) dp dφ.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Section {
    a: f64,
    d: f64,
    crotch: f64,
    /// √C.
    tip: f64,
}

/// The terms of `Section::powers`.
fn series() -> &'static [[f64; 2]; 12] {
    static TERMS: OnceLock<[[f64; 2]; 12]> = OnceLock::new();
    TERMS.get_or_init(|| {
        core::array::from_fn(|m| {
            let factorial = |n: usize| (2..=n).map(|k| k as f64).product::<f64>();
            let power = 2f64.powi(2 * m as i32 + 3);
            [
                1.0 / factorial(2 * m + 3),
                (power - 2.0) / (factorial(2 * m + 4) * (2 * m + 5) as f64),
            ]
        })
    })
}

impl Section {
    /// The section by the half plane of a longitude.
    #[inline]
    pub fn new(frame: &Frame, meridian: Vec3) -> Section {
        let q = &frame.quadric;
        let (one, two) = (dot(q.b, meridian), q.form(meridian, meridian));
        let d = (one * one - two * q.c).max(0.0).sqrt();
        Section {
            a: -two,
            d,
            crotch: -q.c / (one + d),
            tip: (-q.c).sqrt(),
        }
    }

    /// p of a place on it: of its height over the plane of both axes, and its distance from the line.
    #[inline]
    fn parameter(&self, h: f64, g: f64) -> f64 {
        // d cosh √A p = d + A (g₀ − g).
        let even = self.d + self.a * (self.crotch - g);
        let root = self.a.abs().sqrt();
        if root * h.abs() < 1e-4 * self.d && even > 0.0 {
            let r = h / self.d;
            let z = self.a * r * r;
            r * (1.0 - z / 6.0 * (1.0 - 0.45 * z))
        } else if self.a < 0.0 {
            (root * h).atan2(even) / root
        } else {
            (root * h / self.d).asinh() / root
        }
    }

    /// g and h at p.
    #[inline]
    pub fn at(&self, p: f64) -> (f64, f64) {
        let z = self.a * p * p;
        let (even, odd) = if z.abs() < 1e-3 {
            // (cosh √z − 1)/z and sinh √z/√z.
            (
                0.5 + z / 24.0 * (1.0 + z / 30.0 * (1.0 + z / 56.0)),
                1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0)),
            )
        } else if z < 0.0 {
            let r = (-z).sqrt();
            let (s, c) = (r / 2.0).sin_cos();
            (2.0 * s * s / (-z), 2.0 * s * c / r)
        } else {
            let r = z.sqrt();
            let e = (r / 2.0).exp();
            let (s, c) = ((e - 1.0 / e) / 2.0, (e + 1.0 / e) / 2.0);
            (2.0 * s * s / z, 2.0 * s * c / r)
        };
        (self.crotch - self.d * even * p * p, self.d * odd * p)
    }

    /// ∫ (α + βg) g dp between two p, in closed form.
    pub fn swept(&self, from: f64, to: f64, alpha: f64, beta: f64) -> f64 {
        let [one, two] = self.powers(to);
        let [before, squared] = self.powers(from);
        alpha * (one - before) + beta * (two - squared)
    }

    /// ∫ g dp and ∫ g² dp from the crotch, by those of (cosh √A p − 1)/A and its square.
    fn powers(&self, p: f64) -> [f64; 2] {
        let z = self.a * p * p;
        let (one, two) = if z.abs() < 1.0 {
            // Σ zᵐ/(2m + 3)! and Σ (2²ᵐ⁺³ − 2) zᵐ/((2m + 4)! (2m + 5)), twelve terms for sixteen digits.
            let (mut one, mut two) = (0.0, 0.0);
            for [a, b] in series().iter().rev() {
                (one, two) = (a + z * one, b + z * two);
            }
            (one, two)
        } else {
            let r = z.abs().sqrt();
            let (odd, even) = if z < 0.0 {
                (r.sin() / r, r.cos())
            } else {
                (r.sinh() / r, r.cosh())
            };
            ((odd - 1.0) / z, (odd * (even - 4.0) / 2.0 + 1.5) / (z * z))
        };
        let (p3, d, g) = (p * p * p, self.d, self.crotch);
        let first = d * one * p3;
        [
            g * p - first,
            g * g * p - 2.0 * g * first + d * d * two * p3 * p * p,
        ]
    }

    /// p at which a border is met.
    #[inline]
    pub fn border(&self, frame: &Frame, complex: &Complex, border: &Border, meridian: Vec3) -> f64 {
        match border {
            Border::Pole(psi) => self.parameter(self.tip, 0.0).copysign(*psi),
            Border::Seam(part) => {
                let x = sub(frame.meet(complex, part, meridian).0, frame.origin);
                self.parameter(dot(x, frame.axes[2]), dot(x, meridian))
            }
        }
    }
}
