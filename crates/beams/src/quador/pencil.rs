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
        Err(pencil.outside(profile, lambda))
    }

    /// What is wrong with a profile that no member has: the allowed range.
    fn outside(&self, profile: Profile, lambda: f64) -> Fault {
        let hubs = format!(
            "hubs of radius {} and {} mm that are {} mm apart",
            number(self.radii[0]),
            number(self.radii[1]),
            number(self.length)
        );
        let (at, quantity, found, (least, most), end) = match profile {
            Profile::Mid(r) => ("radius", "radius at mid length (mm)", r, self.mid_radius_range(), "less than"),
            Profile::Waist(w) => match self.waist_range() {
                Some(range) => ("profile", "waist (mm)", w, range, "at most"),
                None => {
                    let message = format!(
                        "no beam has a waist between {hubs}, found waist = {} mm: they overlap too far; reduce the larger one or leave the \
                         waist out",
                        number(w)
                    );
                    return Fault::new("profile", message);
                }
            },
            _ => ("profile", "lambda", lambda, self.lambda_range(), "less than"),
        };
        // Rounded inwards, so that what is said is allowed.
        let digits = if most - least < 1e-3 * most { 11 } else { 6 };
        let upper = match most.is_finite() {
            true => format!(" and {end} {}", within(most, -1.0, digits)),
            false => String::new(),
        };
        let least = within(least, 1.0, digits);
        Fault::new(at, format!("{quantity} must be more than {least}{upper} for {hubs}, found {}", number(found)))
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
                let root = (b * b - 4.0 * e * e * l2).max(0.0).sqrt();
                let least = 2.0 * l2 / (b + root);
                let (thin, thick) = self.mid_radius_range();
                if !(r > thin && r < thick && b > 0.0) {
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
                // Between equal hubs the waist of the cylinder is a double root, accurate to half the digits only.
                let cylinder = self.radii[0] == self.radii[1] && w == self.radii[0];
                match self.waist_range() {
                    _ if cylinder => 1.0,
                    Some((least, most)) if w > least && w <= most * (1.0 + 1e-12) && p > 0.0 => {
                        lambda.max(self.length / (self.length - e.abs()))
                    }
                    _ => f64::NAN,
                }
            }
        })
    }

    /// Radius of the circle in which the balls meet, mm; 0 if they do not.
    fn common_circle(&self) -> f64 {
        (-self.power()).max(0.0).sqrt()
    }

    /// The open interval of radii at mid length, mm.
    pub fn mid_radius_range(&self) -> (f64, f64) {
        let (lo, hi) = self.lambda_range();
        let e = self.skew();
        // ρ² at mid length decreases with λ up to L/|e| and then increases.
        let at = |lambda: f64| Pencil { lambda, ..*self }.radius_squared(self.length / 2.0).max(0.0).sqrt();
        let turn = self.length / e.abs();
        let end = if hi.is_finite() {
            at(hi)
        } else if e == 0.0 {
            self.common_circle()
        } else {
            f64::INFINITY
        };
        let least = if turn > lo && turn < hi { at(turn) } else { at(lo).min(end) };
        (least, at(lo).max(end))
    }

    /// Radii at a waist between the contact circles, mm: more than the first, at most the second. From λ = L/(L − |e|), where
    /// the waist is the equator of the smaller ball, it decreases with λ, to nothing at the double cone or, where the balls
    /// overlap, to the circle in which they meet. `None` where the small ball lies beyond that circle: no member has a waist.
    pub fn waist_range(&self) -> Option<(f64, f64)> {
        (self.skew().abs() < self.length).then(|| (self.common_circle(), self.radii[0].min(self.radii[1])))
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

/// A limit as text for a message, its first digits where it is long, rounded up (1) or down (−1).
fn within(limit: f64, toward: f64, digits: i32) -> String {
    let unit = 10f64.powf(limit.abs().log10().floor() - f64::from(digits - 1));
    let rounded = unit * (limit / unit).round();
    // What differs by rounding is the same.
    let off = (rounded - limit) * toward < -1e-12 * limit;
    let said = if off { rounded + toward * unit } else { rounded };
    if limit == 0.0 {
        number(limit)
    } else {
        number(format!("{said:.*e}", digits as usize - 1).parse().unwrap_or(said))
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
                if let Some((least, most)) = pencil.waist_range() {
                    let w = least + s * (most - least);
                    let p = Pencil::new(length, radii, Profile::Waist(w)).expect("in the range");
                    assert!((p.waist() - w).abs() < 1e-6 * w.max(1e-3), "{p:?} {w}");
                }
            }
            // A cone has a straight meridian: the discriminant of ρ² is zero.
            let [a, b, c] = Pencil::new(length, radii, Profile::Cone).expect("always").meridian(0);
            assert!((b * b - 4.0 * a * c).abs() < 1e-12 * (1.0 + b * b));
            assert!(Pencil::new(length, radii, Profile::Mid(thick * 1.01)).is_err());
            assert!(Pencil::new(length, radii, Profile::Waist(radii[0].min(radii[1]) * 1.01)).is_err());
        }
    }

    #[test]
    fn a_profile_is_allowed_if_and_only_if_it_is_within_the_interval_that_is_said() {
        let mut seed = 11;
        let (mut overlapping, mut allowed, mut refused) = (0, 0, 0);
        for (length, radii) in pairs() {
            overlapping += usize::from(length < radii[0] + radii[1]);
            for profile in [Profile::Mid, Profile::Waist, Profile::Lambda] {
                // Something below any interval, whose refusal says it.
                let said = Pencil::new(length, radii, profile(-1.0)).expect_err("below").message;
                let after = |word: &str| -> Option<f64> {
                    let rest = said.split_once(word)?.1;
                    Some(rest.split(' ').next()?.parse().expect("a number"))
                };
                let Some(least) = after("must be more than ") else {
                    assert!(said.starts_with("no beam has a waist"), "{said}");
                    let r = radii[0].min(radii[1]);
                    assert!((1..20).all(|k| Pencil::new(length, radii, profile(r * f64::from(k) / 10.0)).is_err()));
                    continue;
                };
                let most = after("and less than ").or(after("and at most ")).unwrap_or(f64::INFINITY);
                assert!(least < most, "{said}");
                let top = most.min(4.0 * (least + 1.0));
                for _ in 0..8 {
                    let v = 1.3 * top * random(&mut seed);
                    // Limits are said to six digits.
                    let near = |limit: f64| (v - limit).abs() < 2e-5 * limit;
                    if v > 0.0 && !near(least) && !near(most) {
                        let inside = v > least && v < most;
                        assert_eq!(Pencil::new(length, radii, profile(v)).is_ok(), inside, "{v}: {said}");
                        (allowed, refused) = (allowed + usize::from(inside), refused + usize::from(!inside));
                    }
                }
                let nearly = least + 1e-5 * (top - least);
                assert!(Pencil::new(length, radii, profile(nearly)).is_ok(), "{nearly}: {said}");
            }
        }
        assert!(overlapping > 500 && allowed > 10_000 && refused > 10_000, "{overlapping} {allowed} {refused}");
    }

    #[test]
    fn beams_between_overlapping_hubs_are_thicker_than_the_circle_in_which_they_meet() {
        let said = |profile| Pencil::new(0.784947, [0.8, 0.8], profile).expect_err("too thin");
        let message = "must be more than 0.697112 and at most 0.8 for hubs of radius 0.8 and 0.8 mm that are 0.784947 mm apart, found 0.4";
        let fault = said(Profile::Waist(0.4));
        assert_eq!((fault.at.as_str(), fault.message), ("profile", format!("waist (mm) {message}")));
        let fault = said(Profile::Mid(0.5));
        assert_eq!(fault.at, "radius");
        assert!(fault.message.starts_with("radius at mid length (mm) must be more than 0.697112 and less than 0.976"));
        for w in [0.7, 0.75, 0.79, 0.8] {
            let p = Pencil::new(0.784947, [0.8, 0.8], Profile::Waist(w)).expect("in the range");
            assert!((p.waist() - w).abs() < 1e-9);
        }
        // The smaller ball lies beyond the circle in which it meets the other one.
        let fault = Pencil::new(0.7, [1.0, 0.5], Profile::Waist(0.4)).expect_err("no waist");
        assert!(
            fault.message.starts_with("no beam has a waist between hubs of radius 1 and 0.5 mm that are 0.7 mm apart")
        );
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
