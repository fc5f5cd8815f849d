//! Figures of an effective stiffness: engineering constants, anisotropy, bounds.

use crate::material::Voigt;
use geometry::dense::inverse;

/// Figures of a stiffness, in Voigt's order 11 22 33 23 13 12.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// Young's moduli along the axes, 1 / S_ii.
    pub young: [f64; 3],
    /// Shear moduli of the planes 23, 13, 12.
    pub shear: [f64; 3],
    /// Poisson's ratios ν₂₃, ν₁₃, ν₁₂: contraction along the second axis under tension along the first, −S_ij / S_ii.
    pub poisson: [f64; 3],
    /// Bulk modulus: pressure over relative change of volume (Reuss's mean).
    pub bulk: f64,
    /// Mean of Voigt's and Reuss's shear moduli of an aggregate of all orientations (Hill).
    pub hill_shear: f64,
    /// Zener's ratio of the nearest cubic stiffness, 2 C44 / (C11 − C12) of the means over the axes; 1 is isotropic.
    pub zener: f64,
    /// Universal anisotropy 5 G_V / G_R + K_V / K_R − 6; 0 is isotropic (Ranganathan and Ostoja-Starzewski, PRL 101 (2008) 055504).
    pub universal: f64,
}

impl Moduli {
    /// The figures of a stiffness; `None` if it is singular: some strain meets no resistance.
    pub fn of(c: &Voigt) -> Option<Moduli> {
        let s = inverse(c)?;
        let sum = |m: &Voigt, of: [(usize, usize); 3]| of.iter().map(|(i, j)| m[*i][*j]).sum::<f64>();
        const NORMAL: [(usize, usize); 3] = [(0, 0), (1, 1), (2, 2)];
        const CROSS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];
        const SHEAR: [(usize, usize); 3] = [(3, 3), (4, 4), (5, 5)];
        let [(a, b, d), (p, q, r)] = [c, &s].map(|m| (sum(m, NORMAL), sum(m, CROSS), sum(m, SHEAR)));
        let (bulk_voigt, bulk) = ((a + 2.0 * b) / 9.0, 1.0 / (p + 2.0 * q));
        let (voigt, reuss) = ((a - b + 3.0 * d) / 15.0, 15.0 / (4.0 * (p - q) + 3.0 * r));
        Some(Moduli {
            young: [0, 1, 2].map(|i| 1.0 / s[i][i]),
            shear: [3, 4, 5].map(|i| 1.0 / s[i][i]),
            poisson: [(1, 2), (0, 2), (0, 1)].map(|(i, j): (usize, usize)| -s[i][j] / s[i][i]),
            bulk,
            hill_shear: 0.5 * (voigt + reuss),
            zener: 2.0 * d / (a - b),
            universal: 5.0 * voigt / reuss + bulk_voigt / bulk - 6.0,
        })
    }
}

/// Hashin's and Shtrikman's upper bounds of bulk and shear modulus of an isotropic solid of moduli (K, G) that fills this fraction; the
/// lower ones are 0, since the rest is empty (J. Mech. Phys. Solids 11 (1963) 127).
pub fn bounds(bulk: f64, shear: f64, fraction: f64) -> [f64; 2] {
    let (k, g, f) = (bulk, shear, fraction);
    let h = g * (9.0 * k + 8.0 * g) / (6.0 * (k + 2.0 * g));
    // 1 / (M + h) is the mean of 1 / (m + h) over the phases.
    [4.0 * g * k * f / (4.0 * g + 3.0 * k * (1.0 - f)), f * g * h / (h + (1.0 - f) * g)]
}

/// Hashin's and Shtrikman's bounds of the conductivity of a solid that conducts 1 and fills this fraction, where the rest conducts
/// `pore` (J. Appl. Phys. 33 (1962) 3125): the lesser first.
pub fn conductivity_bounds(fraction: f64, pore: f64) -> [f64; 2] {
    let one = |k: f64, other: f64, share: f64| {
        // Of a matrix k with the rest in inclusions.
        if share <= 0.0 { other } else { k + (1.0 - share) / (1.0 / (other - k) + share / (3.0 * k)) }
    };
    let bound = |k: f64, other: f64, share: f64| if k == other || k == 0.0 { k } else { one(k, other, share) };
    let (a, b) = (bound(1.0, pore, fraction), bound(pore, 1.0, 1.0 - fraction));
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;

    #[test]
    fn figures_of_an_isotropic_solid_are_its_own() {
        let m = Moduli::of(&Material::isotropic(2.0, 0.25).expect("valid").stiffness).expect("stiff");
        for i in 0..3 {
            assert!((m.young[i] - 2.0).abs() < 1e-13 && (m.shear[i] - 0.8).abs() < 1e-13);
            assert!((m.poisson[i] - 0.25).abs() < 1e-13);
        }
        assert!((m.zener - 1.0).abs() < 1e-13 && m.universal.abs() < 1e-12);
        assert!((m.bulk - 2.0 / 1.5).abs() < 1e-13 && (m.hill_shear - 0.8).abs() < 1e-13);
    }

    #[test]
    fn bounds_have_their_known_limits() {
        // 2 r / (3 - r) of a solid about voids.
        let [low, high] = conductivity_bounds(0.3, 0.0);
        assert!(low == 0.0 && (high - 0.6 / 2.7).abs() < 1e-14);
        assert!(conductivity_bounds(0.3, 1.0) == [1.0, 1.0]);
        let [low, high] = conductivity_bounds(0.3, 10.0);
        assert!(1.0 < low && low < high && high < 7.3);
        // Thin walls, 2 E r / (9 (1 - nu)) and E r (7 - 5 nu) / (30 (1 - nu²)).
        let (e, nu) = (1.0, 0.3);
        let (k, g) = (e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
        let r = 1e-7;
        let [bulk, shear] = bounds(k, g, r);
        assert!((bulk / r - 2.0 * e / (9.0 * (1.0 - nu))).abs() < 1e-6);
        assert!((shear / r - e * (7.0 - 5.0 * nu) / (30.0 * (1.0 - nu * nu))).abs() < 1e-6);
        assert!((bounds(k, g, 1.0)[0] - k).abs() < 1e-14 && (bounds(k, g, 1.0)[1] - g).abs() < 1e-14);
    }
}
