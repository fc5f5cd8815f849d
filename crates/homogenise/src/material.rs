//! Linear elastic materials as 6 × 6 matrices, in Voigt's order 11 22 33 23 13 12 with engineering shears.

use geometry::fault::{Fault, number};
use geometry::math::Mat3;

use crate::element::Law;
use geometry::dense::{eigenvalues, inverse};

/// A symmetric 6 × 6 matrix: a stiffness (stress = C strain, shears are engineering shears 2ε) or a compliance.
pub type Voigt = [[f64; 6]; 6];

/// The two axes of each index of Voigt's order.
pub const AXES: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// The index in Voigt's order of two axes.
pub const fn voigt(a: usize, b: usize) -> usize {
    if a == b { a } else { 6 - a - b }
}

/// A linear elastic solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Stiffness.
    pub stiffness: Voigt,
    /// Bulk and shear modulus, if it is isotropic.
    pub isotropic: Option<[f64; 2]>,
}

impl Material {
    /// The isotropic solid of Young's modulus E and Poisson's ratio ν.
    ///
    /// # Errors
    /// E that is not positive; ν outside (−1, ½).
    pub fn isotropic(modulus: f64, poisson: f64) -> Result<Material, Fault> {
        if !(modulus > 0.0 && modulus.is_finite()) {
            let message = format!("E is {}; Young's modulus must be greater than 0 and finite", number(modulus));
            return Err(Fault::new("E", message));
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            let message = format!(
                "nu is {}; Poisson's ratio must be greater than -1 and less than 0.5 (of an incompressible solid take 0.49)",
                number(poisson)
            );
            return Err(Fault::new("nu", message));
        }
        let shear = modulus / (2.0 * (1.0 + poisson));
        let lambda = modulus * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                c[i][j] = lambda;
            }
            c[i][i] += 2.0 * shear;
            c[i + 3][i + 3] = shear;
        }
        Ok(Material { stiffness: c, isotropic: Some([lambda + 2.0 * shear / 3.0, shear]) })
    }

    /// The solid of any stiffness.
    ///
    /// # Errors
    /// A matrix with numbers that are not finite, that is not symmetric, or not positive definite.
    pub fn general(stiffness: Voigt) -> Result<Material, Fault> {
        let largest = stiffness.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        if !stiffness.iter().flatten().all(|v| v.is_finite()) {
            return Err(Fault::new("C", "an entry is not a finite number; give 6 x 6 numbers"));
        }
        for i in 0..6 {
            for j in 0..i {
                if (stiffness[i][j] - stiffness[j][i]).abs() > 1e-9 * largest {
                    let message = format!(
                        "entries {}{} and {}{} are {} and {}; a stiffness is symmetric",
                        i + 1,
                        j + 1,
                        j + 1,
                        i + 1,
                        number(stiffness[i][j]),
                        number(stiffness[j][i])
                    );
                    return Err(Fault::new("C", message));
                }
            }
        }
        let c: Voigt = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (stiffness[i][j] + stiffness[j][i])));
        let least = eigenvalues(c.iter().map(|r| r.to_vec()).collect()).into_iter().fold(f64::INFINITY, f64::min);
        if least.is_nan() || least <= 0.0 || inverse(&c).is_none() {
            let message = format!(
                "its least eigenvalue is {}; a stiffness is positive definite (order 11 22 33 23 13 12, engineering shears)",
                number(least)
            );
            return Err(Fault::new("C", message));
        }
        Ok(Material { stiffness: c, isotropic: None })
    }

    /// The law over the nine entries of a displacement's gradient.
    pub fn law(&self) -> Law {
        let index = |i: usize| voigt(i / 3, i % 3);
        std::array::from_fn(|i| std::array::from_fn(|j| self.stiffness[index(i)][index(j)]))
    }

    /// The same material in axes that are turned: `frame`'s columns are the new axes.
    pub fn seen_from(&self, frame: &Mat3) -> Material {
        if self.isotropic.is_some() {
            return *self;
        }
        Material { stiffness: turned(&self.stiffness, &geometry::math::transpose(frame)), isotropic: None }
    }
}

/// The law of a scalar with conductivity `k`.
pub fn scalar_law(k: f64) -> Law {
    let mut law = [[0.0; 9]; 9];
    for (a, row) in law.iter_mut().enumerate().take(3) {
        row[a] = k;
    }
    law
}

/// The stiffness of a body that was turned by the rotation `r`: C'_ijkl = r_ip r_jq r_kr r_ls C_pqrs.
pub fn turned(c: &Voigt, r: &Mat3) -> Voigt {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let ([a, b], [d, e]) = (AXES[i], AXES[j]);
            let mut sum = 0.0;
            for p in 0..3 {
                for q in 0..3 {
                    for s in 0..3 {
                        for t in 0..3 {
                            sum += r[a][p] * r[b][q] * r[d][s] * r[e][t] * c[voigt(p, q)][voigt(s, t)];
                        }
                    }
                }
            }
            sum
        })
    })
}
