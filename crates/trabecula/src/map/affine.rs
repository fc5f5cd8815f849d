//! Affine maps.

use super::Mapping;
use super::inverse::{corners, listed, whole};
use geometry::fault::Fault;
use geometry::math::{
    Aabb, IDENTITY, Mat3, Vec3, add, apply, determinant, inverse, norm, product, rotation, scale, spectral_norm, sub,
    transpose,
};

/// An affine map u = M x + b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// M, turns per mm.
    pub matrix: Mat3,
    /// b, turns.
    pub shift: Vec3,
    /// The wavelengths it was made from, mm.
    pub wavelength: Vec3,
}

/// A named shear `(of, by, degrees)`: coordinate `of` grows by tan(degrees) times coordinate `by`.
pub type Skew = (usize, usize, f64);

impl Affine {
    /// u = D Rᵀ S⁻¹ (x − offset), D = diag(1/λ), R = Rx Ry Rz: the lattice of wavelengths λ (mm) is turned rigidly by
    /// the angles (degrees), then sheared, then moved by +offset (mm).
    ///
    /// # Errors
    /// Wavelengths that are not positive and finite, angles that are not finite, shears that are singular.
    pub fn rigid(wavelength: Vec3, rotate: Vec3, offset: Vec3, skew: &[Skew]) -> Result<Affine, Fault> {
        let d = per_wavelength(wavelength)?;
        finite("rotate", &rotate)?;
        let mut shear = IDENTITY;
        for &(of, by, degrees) in skew {
            let name: String = [of, by].map(|a| ['x', 'y', 'z'][a]).iter().collect();
            if degrees.is_nan() || degrees.abs() >= 90.0 {
                return Err(Fault::new(
                    format!("skew.{name}"),
                    format!("{degrees} degrees; a shear angle lies between -90 and 90, exclusive"),
                ));
            }
            shear[of][by] += degrees.to_radians().tan();
        }
        if determinant(&shear).is_nan() || determinant(&shear) <= 1e-6 {
            return Err(Fault::new(
                "skew",
                format!(
                    "these shears together flatten or invert space (determinant {:.3}); use smaller angles",
                    determinant(&shear)
                ),
            ));
        }
        let matrix = product(&d, &product(&transpose(&rotation(rotate)), &inverse(&shear)));
        Self::about(matrix, offset, wavelength)
    }

    /// u = Rᵀ D (x − offset): scaled to phase first and rotated there, as the SPARTAN note writes it (equations 1.2
    /// and 1.6). With unequal wavelengths the lattice is sheared by the rotation, not turned rigidly.
    ///
    /// # Errors
    /// Wavelengths that are not positive and finite, angles that are not finite.
    pub fn spartan(wavelength: Vec3, rotate: Vec3, offset: Vec3) -> Result<Affine, Fault> {
        let d = per_wavelength(wavelength)?;
        finite("rotate", &rotate)?;
        Self::about(product(&transpose(&rotation(rotate)), &d), offset, wavelength)
    }

    fn about(matrix: Mat3, offset: Vec3, wavelength: Vec3) -> Result<Affine, Fault> {
        finite("offset", &offset)?;
        // Beyond it the phase has fewer than six digits left.
        let far = wavelength.iter().copied().fold(f64::INFINITY, f64::min) * 1e9;
        if let Some(o) = offset.iter().find(|o| o.abs() > far) {
            return Err(Fault::new(
                "offset",
                format!("{o:e} mm; an offset is at most 1e9 wavelengths, {far:e} mm here"),
            ));
        }
        Ok(Affine { matrix, shift: scale(apply(&matrix, offset), -1.0), wavelength })
    }
}

fn finite(key: &str, v: &Vec3) -> Result<(), Fault> {
    if key == "rotate" && v.iter().any(|d| d.abs() > 1e6) {
        return Err(Fault::new(key, format!("{v:?} degrees; an angle is at most 1e6 degrees either way")));
    }
    match v.iter().find(|c| !c.is_finite()) {
        Some(c) => Err(Fault::new(key, format!("{c} is not a finite number"))),
        None => Ok(()),
    }
}

fn per_wavelength(wavelength: Vec3) -> Result<Mat3, Fault> {
    for w in wavelength {
        if !(w > 0.0 && w.is_finite() && (1.0 / w).is_finite()) {
            return Err(Fault::new("wavelength", format!("{w} mm; a wavelength is a positive, finite length")));
        }
    }
    let mut d = IDENTITY;
    for a in 0..3 {
        d[a][a] = 1.0 / wavelength[a];
    }
    Ok(d)
}

impl Mapping for Affine {
    fn wavelengths(&self) -> [f64; 2] {
        let w = self.wavelength.iter().copied();
        [w.clone().fold(f64::INFINITY, f64::min), w.fold(0.0, f64::max)]
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        for (o, &p) in out.iter_mut().zip(points) {
            *o = add(apply(&self.matrix, p), self.shift);
        }
    }

    fn jacobian(&self, _: Vec3) -> Mat3 {
        self.matrix
    }

    fn affine(&self) -> Option<&Affine> {
        Some(self)
    }

    fn typical(&self) -> Mat3 {
        self.matrix
    }

    fn extremes(&self) -> Vec<Mat3> {
        vec![self.matrix]
    }

    fn lipschitz(&self, _: &Aabb) -> f64 {
        self.max_lipschitz()
    }

    fn max_lipschitz(&self) -> f64 {
        spectral_norm(&self.matrix)
    }

    fn position(&self, u: Vec3, _: Vec3) -> Option<Vec3> {
        let x = apply(&inverse(&self.matrix), sub(u, self.shift));
        x.iter().all(|v| v.is_finite()).then_some(x)
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        let mut u = [[0.0; 3]; 8];
        self.phases(&corners(b), &mut u);
        let box_ = u.iter().fold(Aabb::EMPTY, |b, u| b.with(*u));
        let ranges = core::array::from_fn(|a| [whole(box_.min[a]) - 1, whole(box_.max[a]) + 1]);
        // A cell and its neighbours lie within this many of the longest diagonals.
        let edges = inverse(&self.matrix);
        let edge = |i: usize| norm([edges[0][i], edges[1][i], edges[2][i]]);
        listed(self, ranges, b, Some(1.5 * (edge(0) + edge(1) + edge(2))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::norm;

    #[test]
    fn lattice_vectors_are_those_of_the_conventions() {
        let (w, r) = ([1.0, 1.0, 2.0], [20.0, 35.0, 50.0]);
        let rigid = Affine::rigid(w, r, [0.0; 3], &[]).expect("valid");
        let v = transpose(&inverse(&rigid.matrix)).map(norm);
        for (got, want) in v.iter().zip([1.0, 1.0, 2.0]) {
            assert!((got - want).abs() < 1e-14);
        }
        // Expected values, rotated after scaling: columns of diag(λ) R.
        let spartan = Affine::spartan(w, r, [0.0; 3]).expect("valid");
        let v = transpose(&inverse(&spartan.matrix)).map(norm);
        for (got, want) in v.iter().zip([1.011, 1.484, 1.667]) {
            assert!((got - want).abs() < 5e-4, "{v:?}");
        }
    }

    #[test]
    fn offset_moves_the_lattice_and_skew_shears_it() {
        let plain = Affine::rigid([2.0; 3], [10.0, 20.0, 30.0], [0.0; 3], &[]).expect("valid");
        let moved = Affine::rigid([2.0; 3], [10.0, 20.0, 30.0], [0.3, -0.2, 5.0], &[]).expect("valid");
        let (mut u, mut v) = ([[0.0; 3]], [[0.0; 3]]);
        plain.phases(&[[1.0, 2.0, 3.0]], &mut u);
        moved.phases(&[[1.3, 1.8, 8.0]], &mut v);
        assert!(norm(sub(u[0], v[0])) < 1e-14);
        let skewed = Affine::rigid([1.0; 3], [0.0; 3], [0.0; 3], &[(0, 2, 45.0)]).expect("valid");
        skewed.phases(&[[3.0, 0.0, 3.0]], &mut u);
        assert!(norm(sub(u[0], [0.0, 0.0, 3.0])) < 1e-14);
    }

    #[test]
    fn refuses_what_is_no_length() {
        for w in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let fault = Affine::rigid([1.0, w, 1.0], [0.0; 3], [0.0; 3], &[]).expect_err("refused");
            assert_eq!(fault.at, "wavelength");
        }
        assert!(Affine::rigid([1.0; 3], [0.0; 3], [0.0; 3], &[(0, 1, 90.0)]).is_err());
    }
}
