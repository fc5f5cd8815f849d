//! Numbers of a vector or a tensor that do not depend on the axes in which it is given.

use crate::kind::Kind;
use geometry::math::eigen;

/// A number that does not depend on the axes in which a vector or a tensor is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(noun = "invariant")]
pub enum Invariant {
    /// The length of a vector; of a tensor the root of the sum of the squares of its nine components.
    Magnitude,
    /// The equivalent stress of von Mises, never negative.
    #[kind(rename = "von_mises", hints("mises", "equivalent"))]
    VonMises,
    /// The mean of the three normal components: positive in tension, negative in compression.
    #[kind(hints("hydrostatic"))]
    Mean,
    /// The greatest principal value: the greatest tension, or where it is negative the least compression.
    #[kind(rename = "max_principal", hints("first_principal", "s1"))]
    MaxPrincipal,
    /// The least principal value: the greatest compression, or where it is positive the least tension.
    #[kind(rename = "min_principal", hints("third_principal", "s3"))]
    MinPrincipal,
    /// Of a stress σ the density of strain energy times Young's modulus, ½ ((1 + ν) σ:σ − ν (tr σ)²), in an isotropic material of
    /// Poisson's ratio `nu`.
    #[kind(rename = "strain_energy", hints("energy", "energy_density"))]
    StrainEnergy,
}

/// The order of the six components of a symmetric tensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "order")]
pub enum TensorOrder {
    /// 11, 22, 33, 12, 23, 13, as in VTK.
    #[default]
    Vtk,
    /// 11, 22, 33, 23, 13, 12, as in Voigt's notation.
    Voigt,
    /// 11, 22, 33, 12, 13, 23, as in Abaqus.
    Abaqus,
}

impl TensorOrder {
    /// The places of 11, 22, 33, 23, 13, 12 among the components of a tensor, if it has six or nine.
    pub(crate) fn of(self, components: usize) -> Option<[usize; 6]> {
        match (components, self) {
            (9, _) => Some([0, 4, 8, 5, 2, 1]),
            (6, TensorOrder::Vtk) => Some([0, 1, 2, 4, 5, 3]),
            (6, TensorOrder::Voigt) => Some([0, 1, 2, 3, 4, 5]),
            (6, TensorOrder::Abaqus) => Some([0, 1, 2, 5, 4, 3]),
            _ => None,
        }
    }
}

impl Invariant {
    /// Of the components of a vector (three) or a tensor (six in this order, or nine, row by row), and Poisson's ratio.
    pub(super) fn of(self, t: &[f64], order: TensorOrder, nu: f64) -> f64 {
        let (normal, shear) = match t {
            [xx, xy, xz, yx, yy, yz, zx, zy, zz] => {
                ([*xx, *yy, *zz], [xy, xz, yx, yz, zx, zy].map(|s| s * s).iter().sum::<f64>())
            }
            [xx, yy, zz, rest @ ..] => ([*xx, *yy, *zz], 2.0 * rest.iter().map(|s| s * s).sum::<f64>()),
            _ => return f64::NAN,
        };
        let [x, y, z] = normal;
        let square = x * x + y * y + z * z + shear;
        match self {
            Invariant::Magnitude => square.sqrt(),
            Invariant::VonMises => {
                let differences = (x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2);
                (0.5 * differences + 1.5 * shear).sqrt()
            }
            Invariant::Mean => (x + y + z) / 3.0,
            Invariant::MaxPrincipal => principal(t, order).into_iter().fold(f64::NEG_INFINITY, f64::max),
            Invariant::MinPrincipal => principal(t, order).into_iter().fold(f64::INFINITY, f64::min),
            Invariant::StrainEnergy => 0.5 * ((1.0 + nu) * square - nu * (x + y + z).powi(2)),
        }
    }

    /// Whether it is defined for this number of components.
    pub(super) fn takes(self, components: usize) -> bool {
        matches!(components, 6 | 9) || components == 3 && self == Invariant::Magnitude
    }
}

/// The principal values of a tensor of six or nine components.
fn principal(t: &[f64], order: TensorOrder) -> [f64; 3] {
    let Some(places) = order.of(t.len()) else { return [f64::NAN; 3] };
    let [xx, yy, zz, yz, xz, xy] = places.map(|i| t[i]);
    eigen(&[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Mat3, Vec3, product, rotation, transpose};
    use geometry::random::random;

    /// A tensor of given principal values in turned axes, in each form in which a file may have it.
    fn forms(values: Vec3, angles: Vec3) -> Vec<(Vec<f64>, TensorOrder)> {
        let r = rotation(angles);
        let d: Mat3 = core::array::from_fn(|i| core::array::from_fn(|j| if i == j { values[i] } else { 0.0 }));
        let m = product(&r, &product(&d, &transpose(&r)));
        let six = |pairs: [[usize; 2]; 3]| {
            let shear = pairs.map(|[i, j]| m[i][j]);
            [&[m[0][0], m[1][1], m[2][2]][..], &shear].concat()
        };
        vec![
            (six([[0, 1], [1, 2], [0, 2]]), TensorOrder::Vtk),
            (six([[1, 2], [0, 2], [0, 1]]), TensorOrder::Voigt),
            (six([[0, 1], [0, 2], [1, 2]]), TensorOrder::Abaqus),
            (m.as_flattened().to_vec(), TensorOrder::Voigt),
        ]
    }

    /// In any axes and any order of components the invariants are those of the principal values; rounding grows with the largest.
    #[test]
    fn invariants_are_those_of_the_principal_values() {
        let mut seed = 7;
        let mut next = || random(&mut seed);
        for _ in 0..200 {
            let values = [0; 3].map(|_| 10.0 * next());
            let nu = 0.5 * next();
            let [a, b, c] = values;
            let (square, trace) = (a * a + b * b + c * c, a + b + c);
            let mises = (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt();
            for (t, order) in forms(values, [0; 3].map(|_| 180.0 * next())) {
                for (invariant, want) in [
                    (Invariant::Magnitude, square.sqrt()),
                    (Invariant::VonMises, mises),
                    (Invariant::Mean, trace / 3.0),
                    (Invariant::MaxPrincipal, a.max(b).max(c)),
                    (Invariant::MinPrincipal, a.min(b).min(c)),
                    (Invariant::StrainEnergy, 0.5 * ((1.0 + nu) * square - nu * trace * trace)),
                ] {
                    let found = invariant.of(&t, order, nu);
                    assert!((found - want).abs() < 1e-12 * 300.0, "{invariant:?} {order:?}: {found} for {want}");
                }
                // What cannot be compressed has the energy of its equivalent stress.
                let energy = Invariant::StrainEnergy.of(&t, order, 0.5);
                assert!((energy - 0.5 * mises * mises).abs() < 1e-12 * 300.0);
            }
        }
        // A bar of stress s stores s²/2E, whatever its Poisson's ratio.
        let bar = Invariant::StrainEnergy.of(&[3.0, 0.0, 0.0, 0.0, 0.0, 0.0], TensorOrder::Vtk, 0.3);
        assert!((bar - 4.5).abs() < 1e-14, "{bar}");
    }
}
