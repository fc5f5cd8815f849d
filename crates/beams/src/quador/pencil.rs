//! The pencil of quadrics of revolution that are tangent to two balls along circles, with one parameter λ.
//!
//! With z from the first centre to the second at distance L, both balls S₁ and S₂ give S₁ − λ(z − z₁)² = S₂ − λ(z −
//! z₂)², where the contact planes z₁, z₂ lie at L/2λ on either side of the radical plane of the balls. Hence every
//! member has the closed form ρ² = (λ − 1)z² − 2λd₁z + r₁² + λd₁². With increasing λ it is an ellipsoid, a paraboloid
//! or cylinder (λ = 1), a sheet of a two-sheeted hyperboloid, the common tangent cone, a one-sheeted hyperboloid, and
//! finally a double cone with its apex between the balls.

use crate::graph::Profile;
use geometry::fault::{Fault, number};

/// The quadric of a beam between two balls, in the frame of its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pencil {
    /// Distance between the centres, mm.
    pub length: f64,
    /// Radii of the balls, mm.
    pub radii: [f64; 2],
    /// λ.
    pub lambda: f64,
}

impl Pencil {
    /// The member of the pencil with the given profile.
    ///
    /// # Errors
    /// A ball inside the other, and profiles that no member has; the message gives the allowed range.
    pub fn new(length: f64, radii: [f64; 2], profile: Profile) -> Result<Pencil, Fault> {
        for r in radii {
            if !(r > 0.0 && r.is_finite()) {
                return Err(Fault::new(
                    "hub",
                    format!("hub radius must be positive and finite, found {} mm", number(r)),
                ));
            }
        }
        if !(length > 0.0 && length.is_finite()) {
            let message = match length {
                0.0 => "beam has zero length: its end nodes coincide".into(),
                _ => format!("beam length must be positive and finite, found {} mm", number(length)),
            };
            return Err(Fault::new("", message));
        }
        let [big, small] = [radii[0].max(radii[1]), radii[0].min(radii[1])];
        if length <= big - small {
            return Err(Fault::new(
                "hub",
                format!(
                    "a hub of radius {} mm contains the other hub, of radius {} mm, whose centre is {} mm away: no quadric is tangent \
                     to both; reduce the hub radii or remove the beam",
                    number(big),
                    number(small),
                    number(length)
                ),
            ));
        }
        let pencil = Pencil { length, radii, lambda: 1.0 };
        let (lo, hi) = pencil.lambda_range();
        let lambda = pencil.solve(profile)?;
        if lambda > lo && lambda < hi {
            return Ok(Pencil { lambda, ..pencil });
        }
        let (quantity, found, range) = match profile {
            Profile::Mid(r) => ("radius at mid length (mm)", r, pencil.mid_radius_range()),
            Profile::Waist(r) => ("waist (mm)", r, (0.0, pencil.max_waist())),
            _ => ("lambda", lambda, (lo, hi)),
        };
        Err(Fault::new(
            "profile",
            format!(
                "{quantity} must be between {} and {} for hubs of radius {} and {} mm that are {} mm apart, found {}",
                number(range.0),
                if range.1.is_finite() { number(range.1) } else { "infinity".into() },
                number(radii[0]),
                number(radii[1]),
                number(length),
                number(found)
            ),
        ))
    }

    /// The open interval of λ in which the quadric touches both balls along real circles and has no apex between them:
    /// L²/((L + r)² − R²) < λ < L²/(L² − (r + R)²); the upper end is infinite where the balls overlap.
    pub fn lambda_range(&self) -> (f64, f64) {
        let [big, small] = [self.radii[0].max(self.radii[1]), self.radii[0].min(self.radii[1])];
        let l2 = self.length * self.length;
        let open = l2 - (big + small) * (big + small);
        (
            l2 / ((self.length + small) * (self.length + small) - big * big),
            if open > 0.0 { l2 / open } else { f64::INFINITY },
        )
    }

    /// λ of the common tangent cone, L²/(L² − (r₁ − r₂)²).
    pub fn cone_lambda(&self) -> f64 {
        let taper = self.radii[0] - self.radii[1];
        1.0 / (1.0 - (taper / self.length) * (taper / self.length))
    }

    /// Position of the radical plane of the balls on the axis, from the first centre, mm.
    pub fn radical_plane(&self) -> f64 {
        let [r1, r2] = self.radii;
        (self.length + (r1 - r2) * (r1 + r2) / self.length) / 2.0
    }

    fn power(&self) -> f64 {
        let m = self.radical_plane();
        (m - self.radii[0]) * (m + self.radii[0])
    }

    fn skew(&self) -> f64 {
        let [r1, r2] = self.radii;
        (r2 - r1) * (r2 + r1) / self.length
    }

    fn solve(&self, profile: Profile) -> Result<f64, Fault> {
        let (l2, e) = (self.length * self.length, self.skew());
        Ok(match profile {
            Profile::Cone => self.cone_lambda(),
            Profile::Lambda(v) => v,
            Profile::Cylinder => {
                if self.radii[0] != self.radii[1] {
                    return Err(Fault::new(
                        "profile",
                        format!(
                            "a cylinder needs hubs of equal radius, found {} and {} mm: make them equal or use a cone",
                            number(self.radii[0]),
                            number(self.radii[1])
                        ),
                    ));
                }
                1.0
            }
            // e²λ² − bλ + L² = 0: the root that stays finite as the radii become equal, if it is in the interval.
            Profile::Mid(r) => {
                let b = 4.0 * (self.power() + r * r) - e * e;
                let root = (b * b - 4.0 * e * e * l2).sqrt();
                let least = 2.0 * l2 / (b + root);
                if !(r > 0.0 && b > 0.0) {
                    f64::NAN
                } else if least > self.lambda_range().0 || e == 0.0 {
                    least
                } else {
                    (b + root) / (2.0 * e * e)
                }
            }
            // 4pλ² − (L² + 4p − e²)λ + L² = 0 with p = P + w², the larger root.
            Profile::Waist(w) => {
                let p = 4.0 * (self.power() + w * w);
                let b = l2 + p - e * e;
                let lambda = (b + (b * b - 4.0 * p * l2).max(0.0).sqrt()) / (2.0 * p);
                let least = self.length / (self.length - e.abs());
                // Between equal hubs the waist of the cylinder is a double root, accurate to half the digits only.
                let cylinder = self.radii[0] == self.radii[1] && w == self.radii[0];
                if cylinder {
                    1.0
                } else if w > 0.0 && w <= self.max_waist() * (1.0 + 1e-12) && p > 0.0 {
                    lambda.max(least)
                } else {
                    f64::NAN
                }
            }
        })
    }

    /// Range of radii at mid length, mm.
    pub fn mid_radius_range(&self) -> (f64, f64) {
        let (lo, hi) = self.lambda_range();
        let e = self.skew();
        // ρ² at mid length decreases with λ up to L/|e| and then increases.
        let at = |lambda: f64| Pencil { lambda, ..*self }.radius_squared(self.length / 2.0).max(0.0).sqrt();
        let turn = self.length / e.abs();
        let end = if hi.is_finite() {
            at(hi)
        } else if e == 0.0 {
            0.0
        } else {
            f64::INFINITY
        };
        let least = if turn > lo && turn < hi { at(turn) } else { at(lo).min(end) };
        (least, at(lo).max(end))
    }

    /// Maximum waist radius between the contact circles, mm.
    pub fn max_waist(&self) -> f64 {
        let e = self.skew();
        if e == 0.0 {
            return self.radii[0];
        }
        let lambda = self.length / (self.length - e.abs());
        let w2 = self.length * self.length / (4.0 * lambda) - self.power() - e * e / (4.0 * (lambda - 1.0));
        w2.max(0.0).sqrt()
    }

    /// Position of the contact plane of an end on the axis, from that end's centre towards the other, mm.
    pub fn contact(&self, end: usize) -> f64 {
        let m = self.radical_plane();
        (if end == 0 { m } else { self.length - m }) - self.length / (2.0 * self.lambda)
    }

    /// Coefficients [A, B, C] of the meridian ρ² = A z² + B z + C, z from the centre of an end towards the other.
    pub fn meridian(&self, end: usize) -> [f64; 3] {
        let (d, r) = (self.contact(end), self.radii[end]);
        [self.lambda - 1.0, -2.0 * self.lambda * d, r * r + self.lambda * d * d]
    }

    /// ρ² at z from the first centre, mm².
    pub fn radius_squared(&self, z: f64) -> f64 {
        let [a, b, c] = self.meridian(0);
        (a * z + b) * z + c
    }

    /// Position of the split plane, from the first centre, mm: the radical plane, moved just enough that each half is
    /// star-shaped about its hub centre.
    pub fn split(&self) -> f64 {
        let polar = |end: usize| {
            let (d, r) = (self.contact(end), self.radii[end]);
            if d > 0.0 { d + r * r / (self.lambda * d) } else { f64::INFINITY }
        };
        self.radical_plane().max(self.length - polar(1)).min(polar(0))
    }

    /// Minimum radius between the contact circles, mm.
    pub fn waist(&self) -> f64 {
        let [a, b, _] = self.meridian(0);
        let (z1, z2) = (self.contact(0), self.length - self.contact(1));
        let ends = self.radius_squared(z1).min(self.radius_squared(z2));
        let vertex = -b / (2.0 * a);
        if a > 0.0 && vertex > z1 && vertex < z2 { ends.min(self.radius_squared(vertex)) } else { ends }.max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: &mut u64) -> f64 {
        (geometry::random::random(seed) + 1.0) / 2.0
    }

    /// Random pairs of balls, neither inside the other.
    fn pairs() -> Vec<(f64, [f64; 2])> {
        let mut seed = 7;
        (0..4000)
            .map(|_| {
                let r = [0.05 + random(&mut seed), 0.05 + random(&mut seed)];
                let gap = f64::abs(r[0] - r[1]);
                (gap + 0.02 + 4.0 * random(&mut seed) * random(&mut seed), r)
            })
            .collect()
    }

    #[test]
    fn both_balls_give_the_same_quadric_and_it_touches_them() {
        let mut seed = 3;
        for (length, radii) in pairs() {
            let pencil = Pencil { length, radii, lambda: 1.0 };
            let (lo, hi) = pencil.lambda_range();
            let s = 0.001 + 0.998 * random(&mut seed);
            let lambda = 1.0 / ((1.0 - s) / lo + s / hi);
            let p = Pencil::new(length, radii, Profile::Lambda(lambda)).expect("inside the interval");
            let ([a1, b1, c1], [a2, b2, c2]) = (p.meridian(0), p.meridian(1));
            for k in 0..5 {
                let z = length * f64::from(k) / 4.0;
                let (u, v) = (z, length - z);
                let (one, two) = ((a1 * u + b1) * u + c1, (a2 * v + b2) * v + c2);
                assert!((one - two).abs() <= 1e-13 * (1.0 + lambda) * (1.0 + length * length), "{p:?}");
            }
            for end in 0..2 {
                let (d, r) = (p.contact(end), radii[end]);
                assert!(d.abs() < r, "{p:?}");
                let [a, b, c] = p.meridian(end);
                // On the ball and tangent to it: ρ² = r² − d², (ρ²)' = −2d.
                assert!(((a * d + b) * d + c - (r * r - d * d)).abs() < 1e-12 * (1.0 + lambda));
                assert!((2.0 * a * d + b + 2.0 * d).abs() < 1e-12 * (1.0 + lambda));
            }
            assert!(p.waist() > 0.0, "{p:?}");
        }
    }

    #[test]
    fn outside_the_interval_there_is_none() {
        for (length, radii) in pairs() {
            let pencil = Pencil { length, radii, lambda: 1.0 };
            let (lo, hi) = pencil.lambda_range();
            let real = |lambda: f64| {
                let p = Pencil { lambda, ..pencil };
                let steps = 400;
                let (z1, z2) = (p.contact(0), length - p.contact(1));
                p.contact(0).abs() < radii[0]
                    && p.contact(1).abs() < radii[1]
                    && (0..=steps).all(|i| p.radius_squared(z1 + (z2 - z1) * f64::from(i) / f64::from(steps)) > 0.0)
            };
            assert!(real(lo * 1.001 + 1e-9) || lo * 1.001 > hi);
            assert!(!real(lo * 0.999));
            if hi.is_finite() && hi < 1e3 {
                assert!(!real(hi * 1.01), "{pencil:?}");
                assert!(Pencil::new(length, radii, Profile::Lambda(hi)).is_err());
            }
            assert!(Pencil::new(length, radii, Profile::Lambda(lo)).is_err());
        }
    }

    #[test]
    fn a_profile_is_what_it_says() {
        for (length, radii) in pairs() {
            let pencil = Pencil { length, radii, lambda: 1.0 };
            let (thin, thick) = pencil.mid_radius_range();
            for s in [0.2, 0.5, 0.9] {
                let r = thin + s * (thick.min(3.0) - thin);
                let p = Pencil::new(length, radii, Profile::Mid(r)).expect("in the range");
                assert!((p.radius_squared(length / 2.0).sqrt() - r).abs() < 1e-9 * r, "{p:?} {r}");
                let w = s * pencil.max_waist();
                if length > (radii[0] + radii[1]) * 1.001 && w > 1e-6 {
                    let p = Pencil::new(length, radii, Profile::Waist(w)).expect("in the range");
                    assert!((p.waist() - w).abs() < 1e-6 * w.max(1e-3), "{p:?} {w}");
                }
            }
            // A cone has a straight meridian: the discriminant of ρ² is zero.
            let [a, b, c] = Pencil::new(length, radii, Profile::Cone).expect("always").meridian(0);
            assert!((b * b - 4.0 * a * c).abs() < 1e-12 * (1.0 + b * b));
            assert!(Pencil::new(length, radii, Profile::Mid(thick * 1.01)).is_err());
            assert!(Pencil::new(length, radii, Profile::Waist(pencil.max_waist() * 1.01)).is_err());
        }
    }

    #[test]
    fn worked_numbers() {
        let p = Pencil::new(4.0, [1.0, 1.0], Profile::Mid(0.6)).expect("valid");
        assert!((p.lambda - 1.190_476_190_476).abs() < 1e-12);
        assert!((p.contact(0) - 0.32).abs() < 1e-14 && (p.radius_squared(0.32).sqrt() - 0.947_417_542_6).abs() < 1e-10);
        let p = Pencil::new(3.0, [1.0, 0.5], Profile::Cone).expect("valid");
        assert!((p.contact(0) - 1.0 / 6.0).abs() < 1e-14 && (p.contact(1) + 1.0 / 12.0).abs() < 1e-14);
        assert!((p.radius_squared(1.5).sqrt() - 0.760_638_829_3).abs() < 1e-10);
        assert_eq!(p.lambda, p.cone_lambda());
        assert!(Pencil::new(3.0, [1.0, 0.5], Profile::Cylinder).is_err());
        assert!(Pencil::new(0.4, [1.0, 0.5], Profile::Cone).is_err());
    }
}
