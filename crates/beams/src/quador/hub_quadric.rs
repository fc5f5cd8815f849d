//! Quadrics in a hub's frame.

use geometry::math::{Mat3, Vec3, add, apply, determinant, dot, inverse, scale};

use super::affine_function::AffineFunction;
use super::fillet_matrix::Factor;
use super::hub::Hub;

/// The quadratic function x ↦ xᵀMx + 2 b·x + c.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    /// M, symmetric.
    pub m: Mat3,
    /// b.
    pub b: Vec3,
    /// c.
    pub c: f64,
}

impl Quadric {
    /// The value at x.
    #[inline]
    pub fn at(&self, x: Vec3) -> f64 {
        dot(x, add(apply(&self.m, x), scale(self.b, 2.0))) + self.c
    }

    /// Half the gradient at x.
    #[inline]
    pub fn half_gradient(&self, x: Vec3) -> Vec3 {
        add(apply(&self.m, x), self.b)
    }

    /// uᵀMv.
    #[inline]
    pub fn form(&self, u: Vec3, v: Vec3) -> f64 {
        dot(u, apply(&self.m, v))
    }

    /// Adds w g².
    pub(crate) fn add_square(&mut self, w: f64, g: &AffineFunction) {
        for i in 0..3 {
            for j in 0..3 {
                self.m[i][j] += w * g.a[i] * g.a[j];
            }
            self.b[i] += w * g.a[i] * g.b;
        }
        self.c += w * g.b * g.b;
    }

    /// The factor t > 0 at which the ray t p from the hub's centre leaves the quadric; infinite if it does not.
    #[inline]
    pub fn ray_exit(&self, p: Vec3) -> f64 {
        let (one, two) = (dot(self.b, p), self.form(p, p));
        // c < 0 at the centre: the larger of the two roots 1/t is the first exit.
        -self.c / (one + (one * one - self.c * two).max(0.0).sqrt())
    }

    /// The centre, and the inverse of M; `None` for cylinders and paraboloids.
    fn center(&self) -> Option<(Vec3, Mat3)> {
        let size = self.m.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
        if determinant(&self.m).abs() < 1e-9 * size.powi(3) {
            return None;
        }
        let inverse = inverse(&self.m);
        Some((scale(apply(&inverse, self.b), -1.0), inverse))
    }

    /// The two points whose normals are parallel to n; `None` for cylinders and paraboloids, and where no point has
    /// that normal.
    pub(super) fn extremes(&self, n: Vec3) -> Option<[Vec3; 2]> {
        let (middle, inverse) = self.center()?;
        let along = apply(&inverse, n);
        let s = (-self.at(middle) / dot(n, along)).sqrt();
        s.is_finite().then(|| [s, -s].map(|s| add(middle, scale(along, s))))
    }

    /// The points whose normals are parallel to a coordinate axis, two each; `None` on cylinders and paraboloids, which
    /// may have none.
    pub(super) fn axis_extremes(&self) -> Option<[Vec3; 6]> {
        let (middle, inverse) = self.center()?;
        // Mx + b = s e with Q = 0; NaN where no point has that normal.
        let rest = -self.at(middle);
        Some(core::array::from_fn(|k| {
            let a = k / 2;
            let s = (rest / inverse[a][a]).sqrt() * if k % 2 == 0 { 1.0 } else { -1.0 };
            add(middle, scale(inverse[a], s))
        }))
    }

    /// Distance along n from p to the nearer intersection with the quadric; NaN if there is none.
    #[inline]
    pub fn intersection_along(&self, p: Vec3, n: Vec3) -> f64 {
        let (none, one, two) = (self.at(p), dot(self.half_gradient(p), n), self.form(n, n));
        -none / (one + (one * one - two * none).sqrt().copysign(one))
    }
}

/// The part of space in which exactly certain half-beams of a hub are active.
#[derive(Clone, Debug)]
pub(super) struct QuadricPiece {
    /// The quadric.
    pub quadric: Quadric,
    /// For each half-beam of a hub with fillets the function that vanishes where it becomes active, and is positive where it is.
    pub toggles: Vec<AffineFunction>,
}

/// The quadric of a hub where exactly the half-beams of `label` are active.
pub(super) fn piece_quadric(hub: &Hub, label: u64) -> Quadric {
    let (active, g) = (active(hub, label), |i: usize| hub.half_beams[i].g);
    if hub.sharp() {
        return quadric(hub, &active.iter().map(|i| g(*i)).collect::<Vec<_>>());
    }
    quadric(hub, &Factor::new(&active, |i, j| hub.tau(i, j)).squares(&g))
}

/// S less squares.
fn quadric(hub: &Hub, squares: &[AffineFunction]) -> Quadric {
    let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.0; 3], c: -hub.radius * hub.radius };
    squares.iter().for_each(|h| q.add_square(-1.0, h));
    q
}

/// As `piece_quadric`, with the planes around it for given G, which may be perturbed.
pub(super) fn piece(hub: &Hub, label: u64, g: &dyn Fn(usize) -> AffineFunction) -> QuadricPiece {
    if hub.sharp() {
        return QuadricPiece { quadric: piece_quadric(hub, label), toggles: Vec::new() };
    }
    if label.count_ones() < 2 {
        let mut toggles: Vec<AffineFunction> = (0..hub.half_beams.len()).map(g).collect();
        let first = label.trailing_zeros() as usize;
        let quadric = match hub.half_beams.get(first) {
            None => quadric(hub, &[]),
            Some(s) => {
                let own = toggles[first];
                for (m, toggle) in toggles.iter_mut().enumerate().filter(|t| t.0 != first) {
                    *toggle = toggle.plus(-hub.tau(m, first), &own);
                }
                quadric(hub, &[s.g])
            }
        };
        return QuadricPiece { quadric, toggles };
    }
    let active = active(hub, label);
    let factor = Factor::new(&active, |i, j| hub.tau(i, j));
    let quadric = quadric(hub, &factor.squares(&|i| hub.half_beams[i].g));
    let y = factor.solved(factor.squares(g));
    let mut toggles: Vec<AffineFunction> = (0..hub.half_beams.len())
        .map(|m| active.iter().zip(&y).fold(g(m), |sum, (i, y)| sum.plus(-hub.tau(m, *i), y)))
        .collect();
    for (k, i) in active.iter().enumerate() {
        // G above Ry of the others, as seen from the piece without it.
        toggles[*i] = AffineFunction::default().plus(1.0 / factor.inverse_diagonal(k), &y[k]);
    }
    QuadricPiece { quadric, toggles }
}

fn active(hub: &Hub, label: u64) -> Vec<usize> {
    let mut of = Vec::with_capacity(label.count_ones() as usize);
    of.extend((0..hub.half_beams.len().min(64)).filter(|i| label >> i & 1 == 1));
    of
}
