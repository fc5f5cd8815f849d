//! The trilinear element of a voxel, in modal coordinates.
//!
//! On a parallelepiped x = J ξ, ξ in [−1, 1]³, a trilinear function is a sum of eight monomials; its coefficients times eight are
//! sums and differences of the values at the corners. The monomials 1, ξ, η, ζ … in the gradient are orthogonal, so the element's
//! quadratic form falls into three blocks: the gradient's mean (∂ξ, ∂η, ∂ζ of each component), the bilinear modes (ηζ, ζξ, ξη) and
//! the trilinear one. The blocks are exact integrals; nothing is under-integrated.

use geometry::math::{Mat3, inverse};

use geometry::dense::eigenvalues;

/// Of a linear law ∇u → flux, per unit volume of the voxel: the law's 3 NC × 3 NC matrix, `c * 3 + d` for ∂u_c/∂x_d.
pub type Law = [[f64; 9]; 9];

/// The quadratic form of a voxel that is wholly solid, divided by its volume. Dofs `c * 3 + a`: in `linear` the mode ξ_a of component
/// c, in `bilinear` the mode without ξ_a. A scalar has components 0 alone.
#[derive(Clone, Debug)]
pub struct Element {
    /// Block of the linear modes.
    pub linear: [[f64; 9]; 9],
    /// Block of the bilinear modes.
    pub bilinear: [[f64; 9]; 9],
    /// Block of the trilinear mode.
    pub trilinear: [[f64; 3]; 3],
    /// Number of components: 3 for a displacement, 1 for a temperature.
    pub components: usize,
    /// Whether the box is a cuboid along the axes and the law has no terms that mix stretch and shear: most entries are zero then.
    pub orthotropic: bool,
}

/// Whether an entry of `linear` or `bilinear` can differ from zero in an orthotropic element: stretches with each other, and the two
/// gradients of a shear.
const fn orthotropic_entry(i: usize, j: usize) -> bool {
    let ((c, a), (d, b)) = ((i / 3, i % 3), (j / 3, j % 3));
    i == j || (c == a && d == b) || (c == b && d == a)
}

impl Element {
    /// The element of a law in a voxel whose edges are the columns of `edges`.
    pub fn new(law: &Law, components: usize, edges: &Mat3) -> Element {
        let back = inverse(&edges.map(|row| row.map(|v| 0.5 * v)));
        let size = 3 * components;
        // The law for the gradient by ξ: ∂/∂x_d = Σ_a back[a][d] ∂/∂ξ_a.
        let mut inner = [[0.0; 9]; 9];
        for (i, j) in pairs(size) {
            let ((c, a), (d, b)) = ((i / 3, i % 3), (j / 3, j % 3));
            let mut sum = 0.0;
            for (p, q) in pairs(3) {
                sum += back[a][p] * law[3 * c + p][3 * d + q] * back[b][q];
            }
            inner[i][j] = sum / 64.0;
        }
        Element::of_modes(inner, components)
    }

    /// The element of a law for the gradient by ξ, over 64.
    pub fn of_modes(inner: Law, components: usize) -> Element {
        let size = 3 * components;
        let mut made =
            Element { linear: inner, bilinear: [[0.0; 9]; 9], trilinear: [[0.0; 3]; 3], components, orthotropic: true };
        for (i, j) in pairs(size) {
            let ((c, m), (d, n)) = ((i / 3, i % 3), (j / 3, j % 3));
            let shared = (0..3).filter(|b| *b != m && *b != n);
            made.bilinear[i][j] = shared.map(|b| inner[3 * c + 3 - m - b][3 * d + 3 - n - b] / 3.0).sum();
        }
        for (c, d) in pairs(components) {
            made.trilinear[c][d] = (0..3).map(|a| inner[3 * c + a][3 * d + a] / 9.0).sum();
        }
        let largest = inner.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let zero = |v: f64| v.abs() <= 1e-15 * largest;
        made.orthotropic = pairs(size).all(|(i, j)| {
            (orthotropic_entry(i, j) || zero(made.linear[i][j]) && zero(made.bilinear[i][j]))
                && (i >= components || j >= components || i == j || zero(made.trilinear[i][j]))
        });
        made
    }

    /// The element of a voxel with edges twice as long, in units of the smaller one's volume.
    pub fn doubled(&self) -> Element {
        let twice = |m: &[[f64; 9]; 9]| m.map(|row| row.map(|v| 2.0 * v));
        Element {
            linear: twice(&self.linear),
            bilinear: twice(&self.bilinear),
            trilinear: self.trilinear.map(|row| row.map(|v| 2.0 * v)),
            ..*self
        }
    }

    /// The whole form of a scalar, by the bits of its monomials (`interface.rs`).
    pub fn modal(&self) -> [[f64; 8]; 8] {
        let mut out = [[0.0; 8]; 8];
        for (a, b) in pairs(3) {
            out[1 << a][1 << b] = self.linear[a][b];
            out[7 ^ 1 << a][7 ^ 1 << b] = self.bilinear[a][b];
        }
        out[7][7] = self.trilinear[0][0];
        out
    }

    /// The matrix over the values at the corners: dof `corner * components + c`, corners with x fastest.
    pub fn nodal(&self) -> Vec<Vec<f64>> {
        let size = 8 * self.components;
        let mut out = vec![vec![0.0; size]; size];
        for (i, j) in pairs(size) {
            let ((p, c), (q, d)) =
                ((i / self.components, i % self.components), (j / self.components, j % self.components));
            let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            let pair = |corner: usize, m: usize| sign(corner, (m + 1) % 3) * sign(corner, (m + 2) % 3);
            let all = |corner: usize| sign(corner, 0) * pair(corner, 0);
            let mut sum = self.trilinear[c][d] * all(p) * all(q);
            for (a, b) in pairs(3) {
                sum += self.linear[3 * c + a][3 * d + b] * sign(p, a) * sign(q, b);
                sum += self.bilinear[3 * c + a][3 * d + b] * pair(p, a) * pair(q, b);
            }
            out[i][j] = sum;
        }
        out
    }

    /// The diagonal of `nodal`.
    pub fn diagonal(&self) -> Vec<f64> {
        self.nodal().iter().enumerate().map(|(i, row)| row[i]).collect()
    }

    /// An upper bound of the eigenvalues of D⁻¹A, with D the diagonal of A, of any sum A of weighted elements: the largest one of the
    /// element itself (a sum of quadratic forms is at most as many times the sum of their diagonals as each is).
    pub fn largest_eigenvalue(&self) -> f64 {
        let mut matrix = self.nodal();
        let root: Vec<f64> = self.diagonal().iter().map(|d| d.sqrt()).collect();
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, v) in row.iter_mut().enumerate() {
                *v /= root[i] * root[j];
            }
        }
        eigenvalues(matrix).into_iter().fold(0.0, f64::max)
    }
}

fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n * n).map(move |i| (i / n, i % n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;

    /// Against the element integrated by 2 × 2 × 2 Gauss points, which is exact for it; skewed.
    #[test]
    fn blocks_are_the_exact_integral() {
        let edges = [[0.9, 0.2, -0.1], [0.0, 1.1, 0.3], [0.05, 0.0, 0.7]];
        let material = Material::isotropic(2.0, 0.31).expect("valid");
        let law = material.law();
        let element = Element::new(&law, 3, &edges);
        assert!(!element.orthotropic);
        let back = inverse(&edges.map(|r| r.map(|v| 0.5 * v)));
        let mut exact = vec![vec![0.0; 24]; 24];
        let g = 1.0 / 3f64.sqrt();
        for point in 0..8usize {
            let xi = [0, 1, 2].map(|a| if point >> a & 1 == 1 { g } else { -g });
            let slope = |corner: usize| {
                let s = [0, 1, 2].map(|a| if corner >> a & 1 == 1 { 1.0 } else { -1.0 });
                let f = [0, 1, 2].map(|a| 1.0 + s[a] * xi[a]);
                let by = [s[0] * f[1] * f[2] / 8.0, s[1] * f[0] * f[2] / 8.0, s[2] * f[0] * f[1] / 8.0];
                [0, 1, 2].map(|d| (0..3).map(|a| back[a][d] * by[a]).sum::<f64>())
            };
            for (i, j) in pairs(24) {
                let (p, q) = (slope(i / 3), slope(j / 3));
                for (a, b) in pairs(3) {
                    exact[i][j] += p[a] * law[3 * (i % 3) + a][3 * (j % 3) + b] * q[b] / 8.0;
                }
            }
        }
        let found = element.nodal();
        for (i, j) in pairs(24) {
            assert!((found[i][j] - exact[i][j]).abs() < 1e-14, "{i} {j}: {} {}", found[i][j], exact[i][j]);
        }
    }

    #[test]
    fn a_cuboid_of_an_isotropic_solid_is_orthotropic() {
        let edges = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.5]];
        let law = Material::isotropic(1.0, 0.3).expect("valid").law();
        assert!(Element::new(&law, 3, &edges).orthotropic);
        assert!(Element::new(&crate::material::scalar_law(1.0), 1, &edges).orthotropic);
    }
}
