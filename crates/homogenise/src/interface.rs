//! Elements of voxels that an interface between two conductors cuts: immersed finite elements.
//!
//! In such a voxel a temperature is trilinear in the solid, and has a kink at the plane of the interface: what keeps the flux across it
//! equal on both sides (Li, Lin and Wu, Numer. Math. 96 (2003) 61; Kafafy and others, Int. J. Numer. Meth. Eng. 64 (2005) 940). It is
//! determined by the values at the corners, so that nothing is added to the unknowns. Of a layer, aligned or slanted, it is the exact field.
//! Where several interfaces meet in a voxel it is the laminate of both phases: their means along it, the harmonic mean across.

use geometry::math::{Mat3, Vec3, apply, dot};
use geometry::roots::{Bracket, Tolerance};

use crate::element::Element;

/// An interface through a voxel of two conductors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Index of the voxel, that along the first edge fastest.
    pub voxel: usize,
    /// Gradient, by coordinates along the edges of the voxel, of any function that is zero on it and grows towards the pore.
    pub slope: Vec3,
    /// Whether no other interface passes through the voxel.
    pub alone: bool,
}

/// The quadratic form of a voxel over its modes (times eight, as in `element.rs`), by the bits of their monomials: 1 ξ, 2 η, 4 ζ. The first
/// row and column, of the constant, are zero.
pub type Modal<T> = [[T; 8]; 8];

/// Shares of solid nearer to none or to all are that: rounding, not interfaces.
const WHOLE: f64 = 1e-6;
/// Points and weights of Gauss's rule on [−1, 1].
const GAUSS: [[f64; 2]; 4] = [
    [-0.861_136_311_594_052_6, 0.347_854_845_137_453_86],
    [-0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
    [0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
    [0.861_136_311_594_052_6, 0.347_854_845_137_453_86],
];
/// Columns along the steepest axis in which a voxel is integrated.
const COLUMNS: usize = GAUSS.len() * GAUSS.len();

/// The form of a voxel with this share of a solid that conducts 1, in a pore that conducts `pore`; `unit` is the element of a voxel
/// that is wholly solid. `None` where it is as good as one phase, or the interface has no direction.
pub fn cut_element(unit: &Element, share: f64, interface: &Interface, pore: f64) -> Option<Modal<f64>> {
    let metric: Mat3 = std::array::from_fn(|a| std::array::from_fn(|b| 64.0 * unit.linear[a][b]));
    let steep = dot(interface.slope, apply(&metric, interface.slope)).sqrt();
    if !(WHOLE..=1.0 - WHOLE).contains(&share) || !(steep.is_normal()) {
        return None;
    }
    // The gradient of the distance from the interface, and its direction in the same coordinates.
    let normal = interface.slope.map(|v| v / steep);
    let across = apply(&metric, normal);
    let form = match interface.alone {
        true => kinked(&metric, normal, across, share, pore),
        false => laminate(&metric, across, share, pore),
    };
    Some(form)
}

/// The form of the laminate's conductivity.
fn laminate(metric: &Mat3, across: Vec3, share: f64, pore: f64) -> Modal<f64> {
    let along = share + (1.0 - share) * pore;
    let harmonic = pore / (share * pore + 1.0 - share);
    let mut law = [[0.0; 9]; 9];
    for (a, b) in (0..9).map(|i| (i / 3, i % 3)) {
        law[a][b] = (along * metric[a][b] + (harmonic - along) * across[a] * across[b]) / 64.0;
    }
    Element::of_modes(law, 1).modal()
}

/// The form of fields that are trilinear in the solid and have a kink in their slope at the interface.
///
/// With m the modes of the field, v those of its continuation from the solid, d⁺ the distance into the pore, e the modes of the
/// trilinear function with d⁺ at the corners, and D the slope of v across at the middle of the interface: m = v + γ e, γ = (1 / pore − 1) D v.
fn kinked(metric: &Mat3, normal: Vec3, across: Vec3, share: f64, pore: f64) -> Modal<f64> {
    let cut = Columns::new(normal, share);
    let (solid, whole) = (cut.moments(), moments_of_cube());
    let empty: [f64; 27] = std::array::from_fn(|i| whole[i] - solid[i]);
    let both: [f64; 27] = std::array::from_fn(|i| solid[i] + pore * empty[i]);
    let distance: [f64; 8] = std::array::from_fn(|p| (dot(normal, corner(p)) - cut.offset).max(0.0));
    let mut form = [[0.0; 8]; 8];
    let (mut kink, mut slope, mut flux) = ([0.0; 8], [0.0; 8], [0.0; 8]);
    for i in 1..8 {
        kink[i] = (0..8).map(|p| sign(i, p) * distance[p]).sum::<f64>() / 8.0;
        for a in axes(i) {
            slope[i] += across[a] * monomial(i ^ 1 << a, cut.middle);
            flux[i] += pore * across[a] * empty[place(i ^ 1 << a)];
            for j in 1..=i {
                let terms = axes(j).map(|b| metric[a][b] * both[place(i ^ 1 << a) + place(j ^ 1 << b)]);
                form[i][j] += terms.sum::<f64>();
            }
        }
    }
    for (i, j) in (1..8).flat_map(|i| (1..i).map(move |j| (i, j))) {
        form[j][i] = form[i][j];
    }
    let product = |u: &[f64; 8], v: &[f64; 8]| u.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
    // Between 0 and 1 but for voxels that lean: the kink's own part in the slope.
    let own = product(&slope, &kink).clamp(0.0, 1.0);
    let bend = slope.map(|d| (1.0 - pore) * d / (pore + (1.0 - pore) * own));
    let load = form.map(|row| product(&row, &kink));
    let twist = product(&kink, &load) - 2.0 * product(&flux, &kink) + pore * empty[0];
    let pull: [f64; 8] = std::array::from_fn(|i| flux[i] - load[i]);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (form[i][j] + bend[i] * pull[j] + pull[i] * bend[j] + twist * bend[i] * bend[j]) / 64.0)
    })
}

/// The axes in a monomial.
fn axes(monomial: usize) -> impl Iterator<Item = usize> {
    (0..3).filter(move |a| monomial >> a & 1 == 1)
}

/// The value of a monomial.
fn monomial(of: usize, at: Vec3) -> f64 {
    axes(of).map(|a| at[a]).product()
}

/// Where the moment with the exponents of a monomial is; places of factors add up.
const fn place(monomial: usize) -> usize {
    (monomial & 1) + 3 * (monomial >> 1 & 1) + 9 * (monomial >> 2 & 1)
}

/// The value of a monomial at a corner of the cube.
pub fn sign(monomial: usize, corner: usize) -> f64 {
    if (monomial & !corner).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
}

fn corner(p: usize) -> Vec3 {
    [0, 1, 2].map(|a| if p >> a & 1 == 1 { 1.0 } else { -1.0 })
}

/// Means over the cube of ξᵃ ηᵇ ζᶜ with exponents up to 2, at a + 3 b + 9 c.
fn moments_of_cube() -> [f64; 27] {
    const ONE: [f64; 3] = [1.0, 0.0, 1.0 / 3.0];
    std::array::from_fn(|i| ONE[i % 3] * ONE[i / 3 % 3] * ONE[i / 9])
}

/// The part of the cube [−1, 1]³ on the lower side of a plane, by columns along the axis to which it is steepest.
struct Columns {
    /// That axis and the other two.
    axes: [usize; 3],
    /// Whether the lower side is at the lower ends.
    up: bool,
    /// Of each column: its place on the other two axes, its weight (all together 1), and where the plane ends it, −1 to 1.
    each: [([f64; 2], f64, f64); COLUMNS],
    /// The plane: normal · ξ = offset.
    offset: f64,
    /// The middle of the plane within the cube.
    middle: Vec3,
}

impl Columns {
    /// The plane with this normal that has this share of the cube on its lower side.
    fn new(normal: Vec3, share: f64) -> Columns {
        let steepest = (0..3).max_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs())).unwrap_or(0);
        let axes = [steepest, (steepest + 1) % 3, (steepest + 2) % 3];
        let rate = normal[steepest];
        let mut each = [([0.0; 2], 0.0, 0.0); COLUMNS];
        for (i, column) in each.iter_mut().enumerate() {
            let ([x, a], [y, b]) = (GAUSS[i / GAUSS.len()], GAUSS[i % GAUSS.len()]);
            *column = ([x, y], 0.25 * a * b, normal[axes[1]] * x + normal[axes[2]] * y);
        }
        let offset = offset_of(&each, rate.abs(), share);
        let (mut middle, mut total) = ([0.0; 3], 0.0);
        for ([x, y], weight, end) in &mut each {
            let at = (offset - *end) / rate;
            *end = at.clamp(-1.0, 1.0);
            if at == *end {
                total += *weight;
                for (axis, v) in axes.into_iter().zip([at, *x, *y]) {
                    middle[axis] += *weight * v;
                }
            }
        }
        Columns { axes, up: rate > 0.0, each, offset, middle: middle.map(|v| v / total.max(f64::MIN_POSITIVE)) }
    }

    /// Means over the cube of monomials on the lower side, zero on the upper one; as `moments_of_cube`.
    fn moments(&self) -> [f64; 27] {
        let steps = self.axes.map(|a| [1, 3, 9][a]);
        let mut out = [0.0; 27];
        for ([x, y], weight, end) in self.each {
            let to = if self.up { [-1.0, end] } else { [end, 1.0] };
            let power = |n: i32| (to[1].powi(n) - to[0].powi(n)) / (2 * n) as f64;
            let along = [power(1), power(2), power(3)];
            for (i, p) in [1.0, x, x * x].into_iter().enumerate() {
                for (j, q) in [1.0, y, y * y].into_iter().enumerate() {
                    for (k, v) in along.into_iter().enumerate() {
                        out[k * steps[0] + i * steps[1] + j * steps[2]] += weight * p * q * v;
                    }
                }
            }
        }
        out
    }
}

/// The offset of the plane, from the values in the middle of the columns and their rise to an end: Newton's steps on the share, which grows
/// with the offset in straight pieces, between bounds.
fn offset_of(each: &[([f64; 2], f64, f64); COLUMNS], rise: f64, share: f64) -> f64 {
    let most = each.iter().fold(0.0f64, |m, c| m.max(c.2.abs())) + rise;
    let off = |at: f64| {
        let (mut found, mut rate) = (0.0, 0.0);
        for (_, weight, value) in each {
            let end = (at - value) / rise;
            found += weight * (0.5 + 0.5 * end.clamp(-1.0, 1.0));
            rate += if end.abs() < 1.0 { 0.5 * weight / rise } else { 0.0 };
        }
        [if (found - share).abs() <= 1e-14 { 0.0 } else { found - share }, rate]
    };
    Bracket::of_signs(-most, most).newton(most * (2.0 * share - 1.0), Tolerance::absolute(0.0), off)
}

/// An upper bound of the eigenvalues of D⁻¹A, with D the diagonal, of a form over the values at the corners; `known` if it is no more than
/// that. A norm of the sixteenth power is at most the eighth root of seven over the square of the largest.
pub fn largest_eigenvalue(form: &Modal<f64>, known: f64) -> f64 {
    let nodal = nodal(form);
    let root: [f64; 8] = std::array::from_fn(|p| nodal[p][p].max(f64::MIN_POSITIVE).sqrt());
    let mut power: Modal<f64> = std::array::from_fn(|p| std::array::from_fn(|q| nodal[p][q] / (root[p] * root[q])));
    let mut exponent = 1.0f64;
    loop {
        let norm = power.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
        let bound = norm.powf(1.0 / exponent);
        if bound <= known || exponent >= 8.0 {
            return bound.max(known);
        }
        power = times(&power, &power);
        exponent *= 2.0;
    }
}

/// The form over the values at the corners, x fastest.
pub fn nodal(form: &Modal<f64>) -> Modal<f64> {
    let signs: Modal<f64> = std::array::from_fn(|p| std::array::from_fn(|i| sign(i, p)));
    let half = times(&signs, form);
    std::array::from_fn(|p| std::array::from_fn(|q| (0..8).map(|i| half[p][i] * signs[q][i]).sum()))
}

fn times(a: &Modal<f64>, b: &Modal<f64>) -> Modal<f64> {
    let mut out = [[0.0; 8]; 8];
    for (row, out) in a.iter().zip(&mut out) {
        for (v, other) in row.iter().zip(b) {
            (0..8).for_each(|q| out[q] += v * other[q]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::scalar_law;
    use geometry::dense::eigenvalues;
    use geometry::random::random;

    const CUBOID: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.3, 0.0], [0.0, 0.0, 0.8]];

    /// Random interfaces through a cuboid: shares from a thousandth on, contrasts of six decades.
    fn cases() -> Vec<(f64, Interface, f64)> {
        let mut seed = 7;
        let mut next = || random(&mut seed);
        let mut case = || {
            let share = 0.5 + 0.499 * next();
            let slope = [next(), next(), next()];
            (share, Interface { voxel: 0, slope, alone: true }, 10f64.powf(3.0 * next()))
        };
        (0..200).map(|_| case()).collect()
    }

    /// The field of a layer, with a gradient in the solid and another in the pore, has the sum of both energies, and no other force than
    /// the fluxes of both through the sides: its form is exact, whatever the plane.
    #[test]
    fn the_field_of_a_layer_has_its_own_energy() {
        let unit = Element::new(&scalar_law(1.0), 1, &CUBOID);
        let metric: Mat3 = std::array::from_fn(|a| std::array::from_fn(|b| 64.0 * unit.linear[a][b]));
        for (share, interface, pore) in cases() {
            let form = cut_element(&unit, share, &interface, pore).expect("cut");
            let normal = interface.slope.map(|v| v / dot(interface.slope, apply(&metric, interface.slope)).sqrt());
            let offset = Columns::new(normal, share).offset;
            let solid = [0.3, -0.7, 0.5];
            let across = dot(solid, apply(&metric, normal));
            let kink = (1.0 / pore - 1.0) * across;
            let value = |p: usize| dot(solid, corner(p)) + kink * (dot(normal, corner(p)) - offset).max(0.0);
            let modes: [f64; 8] = std::array::from_fn(|i| (0..8).map(|p| sign(i, p) * value(p)).sum());
            let found: f64 = (0..8).map(|i| (0..8).map(|j| modes[i] * form[i][j] * modes[j]).sum::<f64>()).sum();
            let along = dot(solid, apply(&metric, solid)) - across * across;
            let exact = share * (along + across * across) + (1.0 - share) * pore * (along + (across / pore).powi(2));
            assert!((found / exact - 1.0).abs() < 1e-9, "{share} {interface:?} {pore}: {found} {exact}");
        }
    }

    #[test]
    fn forms_are_positive_and_that_of_equal_phases_is_the_common_one() {
        let unit = Element::new(&scalar_law(1.0), 1, &CUBOID);
        for (share, interface, pore) in cases() {
            for alone in [true, false] {
                let interface = Interface { alone, ..interface };
                let form = cut_element(&unit, share, &interface, pore).expect("cut");
                let values = eigenvalues(form.iter().map(|row| row.to_vec()).collect());
                let largest = values.iter().fold(0.0f64, |m, v| m.max(*v));
                assert!(values.iter().all(|v| *v >= -1e-12 * largest), "{values:?}");
                let bound = largest_eigenvalue(&form, 0.0);
                let nodal = nodal(&form);
                let scaled = |p: usize, q: usize| nodal[p][q] / (nodal[p][p] * nodal[q][q]).sqrt();
                let values = eigenvalues((0..8).map(|p| (0..8).map(|q| scaled(p, q)).collect()).collect());
                let largest = values.into_iter().fold(0.0, f64::max);
                assert!(largest <= bound && bound <= 1.14 * largest, "{largest} {bound}");
                let same = cut_element(&unit, share, &interface, 1.0).expect("cut");
                for (a, b) in same.iter().flatten().zip(unit.modal().iter().flatten()) {
                    assert!((a - b).abs() < 1e-14);
                }
            }
        }
    }
}
