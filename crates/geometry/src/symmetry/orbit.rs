//! The sum of a plane wave over a space group, as a real series.

use std::collections::BTreeMap;

use super::{Group, WHOLE};
use crate::fault::Fault;
use crate::math::sin_cos_turns;

/// Which part of a complex sum is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComplexPart {
    /// The real part.
    Re,
    /// The imaginary part.
    Im,
}

/// A sum of 24th roots of one: how often each occurs.
type Roots = [i32; WHOLE as usize];

/// A wave of a sum: (h, k, l), and its cosine's and sine's coefficient.
type Wave = ([i32; 3], f64, f64);

/// Whether a sum of 24th roots of one vanishes. The roots are powers of ζ with ζ¹² = −1 and ζ⁸ = ζ⁴ − 1, and the first
/// eight are independent over the whole numbers.
fn vanishes(roots: &Roots) -> bool {
    let mut sum: [i32; 12] = core::array::from_fn(|n| roots[n] - roots[n + 12]);
    for n in (8..12).rev() {
        sum[n - 4] += sum[n];
        sum[n - 8] -= sum[n];
    }
    sum[..8].iter().all(|c| *c == 0)
}

impl Group {
    /// The part of Σ e^{2πi hkl·(R u + t)}, over all operations of the group, divided by the largest modulus among its
    /// Fourier coefficients (a cosine and a sine of one wave vector being one coefficient): wave vectors, cosines' and
    /// sines' coefficients. One of each pair ±k stands for both. Empty if that part vanishes.
    ///
    /// # Errors
    /// The whole sum vanishes, as the group's centring, screws and glides demand; indices too large to turn.
    pub fn orbit(&self, hkl: [i32; 3], part: ComplexPart) -> Result<Vec<Wave>, Fault> {
        if hkl.iter().any(|h| h.abs() > 1000) {
            let message = format!("{hkl:?}: indices are at most 1000 either way");
            return Err(Fault::new("hkl", message));
        }
        let mut sums: BTreeMap<[i32; 3], Roots> = BTreeMap::new();
        for o in &self.operations {
            // h·(R u + t) = (Rᵀ h)·u + h·t.
            let turned = [0, 1, 2].map(|j| (0..3).map(|i| hkl[i] * o.rotation[i][j]).sum());
            let phase: i32 = (0..3).map(|i| hkl[i] * o.translation[i]).sum();
            let roots = sums.entry(turned).or_insert([0; WHOLE as usize]);
            roots[phase.rem_euclid(WHOLE) as usize] += 1;
        }
        sums.retain(|_, roots| !vanishes(roots));
        if sums.is_empty() {
            let message =
                format!("{hkl:?} is absent in {}: its sum over the group vanishes; choose other indices", self.name);
            return Err(Fault::new("hkl", message));
        }
        // Re and Im of c e^{ia} and of the opposite wave's c′ e^{−ia}, as a cosine and a sine of a.
        let value = |roots: &Roots| {
            let counted = roots.iter().enumerate().filter(|(_, c)| **c != 0);
            counted.fold((0.0, 0.0), |(re, im), (n, &c)| {
                let (sine, cosine) = sin_cos_turns(n as f64 / f64::from(WHOLE));
                (re + f64::from(c) * cosine, im + f64::from(c) * sine)
            })
        };
        let mut waves: BTreeMap<[i32; 3], (f64, f64)> = BTreeMap::new();
        for (k, roots) in &sums {
            let sign = k.iter().find(|v| **v != 0).map_or(1, |v| v.signum());
            let (re, im) = value(roots);
            let (cosine, sine) = match part {
                ComplexPart::Re => (re, -im),
                ComplexPart::Im => (im, re),
            };
            let wave = waves.entry(k.map(|v| v * sign)).or_default();
            *wave = (wave.0 + cosine, wave.1 + f64::from(sign) * sine);
        }
        let largest = waves.values().fold(0.0f64, |m, w| m.max(w.0.hypot(w.1)));
        // Each coefficient is a sum of as many roots of one as there are operations: rounding is 1e-14 of their number.
        if largest < 1e-12 * self.operations.len() as f64 {
            return Ok(Vec::new());
        }
        let scaled = |(k, (c, s)): ([i32; 3], (f64, f64))| (k, c / largest, s / largest);
        let waves = waves.into_iter().map(scaled);
        Ok(waves.filter(|w| w.1.hypot(w.2) > 1e-12).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use proptest::prelude::*;

    fn at(waves: &[Wave], u: Vec3) -> f64 {
        let one = |&(k, cosine, sine): &Wave| {
            let (s, c) = sin_cos_turns((0..3).map(|i| f64::from(k[i]) * u[i]).sum());
            cosine * c + sine * s
        };
        waves.iter().map(one).sum()
    }

    /// Which parts of a sum there are: R, I, both or none.
    fn parts(group: &str, hkl: [i32; 3]) -> String {
        let group = Group::named(group).expect(group);
        let is = |part| group.orbit(hkl, part).is_ok_and(|w| !w.is_empty());
        [(ComplexPart::Re, "R"), (ComplexPart::Im, "I")]
            .iter()
            .map(|(part, word)| if is(*part) { *word } else { "" })
            .collect()
    }

    #[test]
    fn absences_are_those_of_the_tables() {
        let groups = ["215", "216", "217", "221", "224", "225", "227", "229"];
        // International Tables A, reflection conditions; which part remains follows from the centres of inversion.
        let known = [
            ([1, 0, 0], "R,,,R,,,,"),
            ([1, 1, 0], "R,,R,R,R,,,R"),
            ([1, 1, 1], "RI,RI,,R,R,R,R,"),
            ([2, 0, 0], "R,R,R,R,R,R,,R"),
            ([2, 1, 1], "RI,,RI,R,R,,,R"),
            ([2, 2, 0], "R,R,R,R,R,R,R,R"),
            ([2, 2, 1], "RI,,,R,R,,,"),
            ([2, 2, 2], "RI,RI,RI,R,R,R,R,R"),
        ];
        for (hkl, want) in known {
            let found: Vec<String> = groups.iter().map(|g| parts(g, hkl)).collect();
            assert_eq!(found.join(","), want, "{hkl:?}");
        }
        for (hkl, want) in [([1, 1, 1], "I"), ([2, 2, 1], "I"), ([3, 1, 1], "I")] {
            assert_eq!(parts("224:1", hkl), want);
        }
        assert_eq!(parts("227:1", [1, 1, 1]), "RI");
        assert_eq!(parts("227:1", [2, 2, 2]), "I");
        let refused = Group::named("229").expect("group").orbit([1, 0, 0], ComplexPart::Re);
        assert!(refused.expect_err("absent").message.contains("absent in Im-3m"));
    }

    #[test]
    fn named_surfaces_are_orbit_sums() {
        let u = [0.137, 0.291, 0.843];
        let cosines = |v: Vec3| v.map(|x| sin_cos_turns(x).1);
        let [x, y, z] = cosines(u);
        let p = Group::named("221").expect("group").orbit([1, 0, 0], ComplexPart::Re);
        assert!((at(&p.expect("present"), u) - (x + y + z)).abs() < 1e-14);
        let fcc = Group::named("225").expect("group").orbit([1, 1, 1], ComplexPart::Re);
        assert!((at(&fcc.expect("present"), u) - 4.0 * x * y * z).abs() < 1e-14);
        let s = u.map(|v| sin_cos_turns(v).0);
        let sines = Group::named("215").expect("group").orbit([1, 1, 1], ComplexPart::Im);
        // sin a sin b sin c is minus a quarter of the four sines of the sums; the sign is the sum's own.
        let found = at(&sines.expect("present"), u);
        assert!((found.abs() - (4.0 * s[0] * s[1] * s[2]).abs()).abs() < 1e-14);
    }

    proptest! {
        /// A sum over a group is invariant under every one of its operations, in every setting.
        #[test]
        fn sums_have_the_symmetry_of_their_group(
            row in 0usize..530,
            hkl in prop::array::uniform3(-4i32..5),
            u in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (_, name, hall) = Group::all().nth(row).expect("in range");
            let group = Group::named(&format!("hall:{hall}")).expect("a group");
            for part in [ComplexPart::Re, ComplexPart::Im] {
                let Ok(waves) = group.orbit(hkl, part) else { continue };
                let here = at(&waves, u);
                let top: f64 = waves.iter().map(|w| w.1.hypot(w.2)).sum();
                for o in &group.operations {
                    let turn = |i: usize| -> f64 { (0..3).map(|j| f64::from(o.rotation[i][j]) * u[j]).sum() };
                    let there = [0, 1, 2].map(|i| turn(i) + f64::from(o.translation[i]) / f64::from(WHOLE));
                    // Phases of up to some tens of turns lose a few units of 1e-16 each.
                    prop_assert!((at(&waves, there) - here).abs() < 1e-12 * (1.0 + top), "{name} {hkl:?}");
                }
            }
        }
    }
}
