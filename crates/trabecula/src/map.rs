//! Maps from position (mm) to phase (turns).

mod distortion;
mod frame;
mod grid;
mod inverse;
mod phase;
mod poisson;
mod round;
mod spline;
mod sweep;
pub(crate) mod tets;
mod tilt;

pub use distortion::{Distortion, Misfit, Spread};
pub use frame::Orientation;
pub use phase::{Phase, Settings, Wanted};
pub use round::Round;
pub use sweep::{Path, Sweep};
pub use tets::Tets;

use std::sync::Arc;

use crate::field::Block;
use geometry::fault::Fault;
use geometry::math::{
    Aabb, IDENTITY, Mat3, Vec3, add, apply, determinant, inverse, product, rotation, scale, spectral_norm, transpose,
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
    /// Wavelengths that are not positive and finite, angles that are not finite, shears that flatten space.
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

/// A map from position to phase.
#[derive(Clone)]
pub enum Map {
    /// u = M x + b.
    Affine(Affine),
    /// Solved for varying orientation and wavelength.
    Phase(Arc<Phase>),
    /// Wrapped round an axis or a centre.
    Round(Round),
    /// Along a line.
    Sweep(Arc<Sweep>),
}

impl Map {
    /// The smallest wavelength (mm): what `--per-cell` divides.
    pub fn wavelength(&self) -> f64 {
        match self {
            Map::Affine(a) => a.wavelength.iter().copied().fold(f64::INFINITY, f64::min),
            Map::Phase(p) => p.wavelength()[0],
            Map::Round(r) => r.wavelengths()[0],
            Map::Sweep(s) => s.wavelengths()[0],
        }
    }

    /// The greatest wavelength, mm.
    pub fn longest(&self) -> f64 {
        match self {
            Map::Affine(a) => a.wavelength.iter().copied().fold(0.0, f64::max),
            Map::Phase(p) => p.wavelength()[1],
            Map::Round(r) => r.wavelengths()[1],
            Map::Sweep(s) => s.wavelengths()[1],
        }
    }

    /// Fills phases (turns) of points (mm).
    pub fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        match self {
            Map::Affine(a) => {
                for (o, &p) in out.iter_mut().zip(points) {
                    *o = add(apply(&a.matrix, p), a.shift);
                }
            }
            Map::Phase(map) => map.phases(points, out),
            Map::Round(map) => {
                for (o, &p) in out.iter_mut().zip(points) {
                    *o = map.phase(p);
                }
            }
            Map::Sweep(map) => {
                for (o, &p) in out.iter_mut().zip(points) {
                    *o = map.phase(p);
                }
            }
        }
    }

    /// du/dx at a point, turns per mm.
    pub fn jacobian(&self, at: Vec3) -> Mat3 {
        match self {
            Map::Affine(a) => a.matrix,
            Map::Phase(map) => map.jacobian(at),
            Map::Round(map) => map.jacobian(at),
            Map::Sweep(map) => map.jacobian(at),
        }
    }

    /// The affine map that this is, if it is one.
    pub fn affine(&self) -> Option<&Affine> {
        match self {
            Map::Affine(a) => Some(a),
            Map::Phase(_) | Map::Round(_) | Map::Sweep(_) => None,
        }
    }

    /// A Jacobian typical of the map, but for its rotation: what distances on the torus are measured with.
    pub fn typical(&self) -> Mat3 {
        match self {
            Map::Affine(a) => a.matrix,
            Map::Phase(map) => {
                let w = map.mean_wavelength();
                core::array::from_fn(|a| scale(IDENTITY[a], 1.0 / w[a]))
            }
            Map::Round(map) => map.typical(),
            Map::Sweep(map) => map.typical(),
        }
    }

    /// The Jacobians where cells are largest and smallest.
    pub fn extremes(&self) -> Vec<Mat3> {
        match self {
            Map::Affine(a) => vec![a.matrix],
            Map::Phase(map) => map.extremes().to_vec(),
            Map::Round(map) => map.extremes().to_vec(),
            Map::Sweep(map) => map.extremes().to_vec(),
        }
    }

    /// A bound of the spectral norm of du/dx in a box, turns per mm.
    pub fn stretch(&self, b: &Aabb) -> f64 {
        match self {
            Map::Affine(a) => spectral_norm(&a.matrix),
            Map::Phase(map) => map.stretch(b),
            Map::Round(map) => map.stretch(b),
            Map::Sweep(map) => map.stretch(b),
        }
    }

    /// A bound of the spectral norm of du/dx where the map is made for, turns per mm.
    pub fn steepest(&self) -> f64 {
        match self {
            Map::Affine(a) => spectral_norm(&a.matrix),
            Map::Phase(map) => map.steepest(),
            Map::Round(map) => map.steepest(),
            Map::Sweep(map) => map.steepest(),
        }
    }

    /// The map on the rows of a block.
    pub(crate) fn rows<'a>(&'a self, block: &Block<'a>) -> Rows<'a> {
        Rows {
            map: self,
            block: *block,
            spline: match self {
                Map::Affine(_) | Map::Round(_) | Map::Sweep(_) => None,
                Map::Phase(map) => Some(map.rows(block)),
            },
            layer: 0,
        }
    }
}

/// A map on the rows of a block.
pub(crate) struct Rows<'a> {
    map: &'a Map,
    block: Block<'a>,
    spline: Option<(spline::Rows<'a>, Vec3)>,
    layer: usize,
}

impl Rows<'_> {
    /// Makes ready for the rows of layer k.
    pub fn enter_layer(&mut self, k: usize) {
        self.layer = k;
        if let Some((rows, _)) = &mut self.spline {
            rows.enter_layer(k);
        }
    }

    /// Fills the three phases along row j of the layer entered last.
    pub fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]) {
        if let Some((rows, shift)) = &mut self.spline {
            rows.fill(j, out);
            for (out, shift) in out.iter_mut().zip(shift) {
                if *shift != 0.0 {
                    out.iter_mut().for_each(|u| *u += *shift);
                }
            }
            return;
        }
        let [xs, ys, zs] = self.block.axes;
        let points: Vec<Vec3> = xs.iter().map(|&x| [x, ys[j], zs[self.layer]]).collect();
        let mut u = vec![[0.0; 3]; points.len()];
        self.map.phases(&points, &mut u);
        for (i, u) in u.iter().enumerate() {
            for (out, u) in out.iter_mut().zip(u) {
                out[i] = *u;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{norm, sub};

    #[test]
    fn lattice_vectors_are_those_of_the_conventions() {
        let (w, r) = ([1.0, 1.0, 2.0], [20.0, 35.0, 50.0]);
        let rigid = Affine::rigid(w, r, [0.0; 3], &[]).expect("valid");
        let v = transpose(&inverse(&rigid.matrix)).map(norm);
        for (got, want) in v.iter().zip([1.0, 1.0, 2.0]) {
            assert!((got - want).abs() < 1e-14);
        }
        // Figures for the phase-space reading: columns of diag(λ) R.
        let spartan = Affine::spartan(w, r, [0.0; 3]).expect("valid");
        let v = transpose(&inverse(&spartan.matrix)).map(norm);
        for (got, want) in v.iter().zip([1.011, 1.484, 1.667]) {
            assert!((got - want).abs() < 5e-4, "{v:?}");
        }
    }

    #[test]
    fn offset_moves_the_lattice_and_skew_shears_it() {
        let plain = Map::Affine(Affine::rigid([2.0; 3], [10.0, 20.0, 30.0], [0.0; 3], &[]).expect("valid"));
        let moved = Map::Affine(Affine::rigid([2.0; 3], [10.0, 20.0, 30.0], [0.3, -0.2, 5.0], &[]).expect("valid"));
        let (mut u, mut v) = ([[0.0; 3]], [[0.0; 3]]);
        plain.phases(&[[1.0, 2.0, 3.0]], &mut u);
        moved.phases(&[[1.3, 1.8, 8.0]], &mut v);
        assert!(norm(sub(u[0], v[0])) < 1e-14);
        let skewed = Map::Affine(Affine::rigid([1.0; 3], [0.0; 3], [0.0; 3], &[(0, 2, 45.0)]).expect("valid"));
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
