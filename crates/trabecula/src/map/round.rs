//! Maps that wrap a lattice round an axis or a centre, with a whole number of cells around, so that it closes.

use multiversion::multiversion;

use super::Mapping;
use super::inverse::{corners, listed, whole};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Mat3, Vec3, add, angle_turns, cross, dot, norm, scale, sin_cos_turns, sub, unit};

/// A lattice wrapped round an axis or about a centre. Phases are (r/λ, n θ/2π, z/λ) on a cylinder and (r/λ, n φ/2π,
/// n θ/2π) on a sphere: φ round the axis, θ from it, n cells around and half as many from pole to pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    center: Vec3,
    /// Two directions across the axis, and the axis.
    frame: Mat3,
    /// Along the radius and along the axis, mm; the second does not count on a sphere.
    wavelength: [f64; 2],
    around: f64,
    /// Whether about a centre.
    sphere: bool,
    /// Least, mean and greatest distance from the axis in the region.
    radii: [f64; 3],
}

impl Round {
    /// Cells round the line through `center` along `axis`: `around` of them, with edges `wavelength` (mm) along the radius
    /// and along the axis. `radii` are the least, mean and greatest distance from the line where the lattice is wanted.
    ///
    /// # Errors
    /// Lengths that are not positive, no axis, a number of cells that is not whole and positive.
    pub fn cylinder(
        center: Vec3,
        axis: Vec3,
        wavelength: [f64; 2],
        around: f64,
        radii: [f64; 3],
    ) -> Result<Round, Fault> {
        Round::new(center, axis, wavelength, around, radii, false)
    }

    /// Shells of cells about `center`: `around` of them round the equator, half as many from pole to pole, with edges
    /// `wavelength` (mm) along the radius. Cells shrink towards the poles.
    ///
    /// # Errors
    /// As `cylinder`; an odd number of cells.
    pub fn sphere(center: Vec3, axis: Vec3, wavelength: f64, around: f64, radii: [f64; 3]) -> Result<Round, Fault> {
        if around % 2.0 != 0.0 && around.fract() == 0.0 {
            return Err(Fault::new(
                "around",
                format!("{} cells around; half as many lie between the poles, so give an even number", number(around)),
            ));
        }
        Round::new(center, axis, [wavelength; 2], around, radii, true)
    }

    fn new(
        center: Vec3,
        axis: Vec3,
        wavelength: [f64; 2],
        around: f64,
        radii: [f64; 3],
        sphere: bool,
    ) -> Result<Round, Fault> {
        for w in wavelength {
            if !(w > 0.0 && w.is_finite()) {
                return Err(Fault::new(
                    "wavelength",
                    format!("{} mm; a wavelength is a positive, finite length", number(w)),
                ));
            }
        }
        if !(around >= 1.0 && around.fract() == 0.0 && around <= 1e6) {
            return Err(Fault::new(
                "around",
                format!(
                    "{} cells around; it must be a whole number from 1 to 1e6, so that the lattice closes",
                    number(around)
                ),
            ));
        }
        if center.iter().chain(&axis).any(|v| !v.is_finite()) || norm(axis) == 0.0 {
            return Err(Fault::new(
                "axis",
                format!("found {axis:?} through {center:?}; give finite numbers, and a direction that is not zero"),
            ));
        }
        let n = unit(axis);
        // Along z the directions across are x and y.
        let least = (0..3).min_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
        let mut e = [0.0; 3];
        e[least] = 1.0;
        let x = unit(sub(e, scale(n, dot(e, n))));
        Ok(Round { center, frame: [x, cross(n, x), n], wavelength, around, sphere, radii })
    }

    /// The same cells turned about the axis by an angle (degrees), by the right-hand rule.
    pub fn started(self, degrees: f64) -> Round {
        let ([x, y, n], (s, c)) = (self.frame, sin_cos_turns(degrees / 360.0));
        let across = |a: f64, b: f64| add(scale(x, a), scale(y, b));
        Round { frame: [across(c, s), across(-s, c), n], ..self }
    }

    /// Coordinates across and along the axis, and the distance from it.
    #[inline(always)]
    fn local(&self, p: Vec3) -> (Vec3, f64) {
        let d = sub(p, self.center);
        let l = self.frame.map(|e| dot(e, d));
        (l, long(l[0], l[1]))
    }

    /// Phases (turns) where these are the coordinates and the distance from the axis.
    #[inline(always)]
    fn phase(&self, (l, r): (Vec3, f64)) -> Vec3 {
        let round = self.around * angle_turns(l[1], l[0]);
        if self.sphere {
            [long(r, l[2]) / self.wavelength[0], round, self.around * angle_turns(r, l[2])]
        } else {
            [r / self.wavelength[0], round, l[2] / self.wavelength[1]]
        }
    }

    /// du/dx there, turns per mm. Within a billionth of a wavelength of the axis, that at this distance.
    #[inline(always)]
    fn slopes(&self, (l, r): (Vec3, f64)) -> Mat3 {
        let r = r.max(1e-9 * self.wavelength[0]);
        let per = 1.0 / r;
        let [x, y, n] = self.frame;
        let out = add(scale(x, l[0] * per), scale(y, l[1] * per));
        let around = sub(scale(y, l[0] * per), scale(x, l[1] * per));
        let turn = self.around / core::f64::consts::TAU;
        let round = scale(around, turn * per);
        if !self.sphere {
            return [scale(out, 1.0 / self.wavelength[0]), round, scale(n, 1.0 / self.wavelength[1])];
        }
        let per = 1.0 / long(r, l[2]);
        let (c, s) = (l[2] * per, r * per);
        let away = add(scale(out, s), scale(n, c));
        let down = sub(scale(out, c), scale(n, s));
        [scale(away, 1.0 / self.wavelength[0]), round, scale(down, turn * per)]
    }

    /// How many cells there are round the axis.
    fn around(&self) -> i32 {
        self.around as i32
    }

    /// The spectral norm of du/dx at a distance (mm) from the axis, turns per mm.
    fn lipschitz_at(&self, radius: f64) -> f64 {
        let lengths = if self.sphere { &self.wavelength[..1] } else { &self.wavelength[..] };
        let along = lengths.iter().map(|w| 1.0 / w).fold(0.0, f64::max);
        along.max(self.around / (core::f64::consts::TAU * radius))
    }

    /// Where cells shrink to nothing: the word for it, and positions on it within the box (mm).
    pub fn core(&self, b: &Aabb) -> (&'static str, Vec<Vec3>) {
        match self.sphere {
            true => ("centre", vec![self.center]),
            false => ("axis", self.axis(b)),
        }
    }

    /// Where cells of a sphere shrink to nothing towards its poles; nowhere of a cylinder.
    pub fn poles(&self, b: &Aabb) -> Vec<Vec3> {
        if self.sphere { self.axis(b) } else { Vec::new() }
    }

    /// Positions on the axis within a box.
    fn axis(&self, b: &Aabb) -> Vec<Vec3> {
        const STEPS: i32 = 500;
        let n = self.frame[2];
        let middle = add(self.center, scale(n, dot(n, sub(b.center(), self.center))));
        let step = norm(b.size()) / f64::from(STEPS);
        (-STEPS..=STEPS).map(|i| add(middle, scale(n, 0.5 * step * f64::from(i)))).collect()
    }

    /// The edge of a cell round the axis at a position (mm), of a sphere that on the equator as far from the centre, mm.
    pub fn edge_at(&self, p: Vec3) -> f64 {
        let (l, r) = self.local(p);
        self.arc(if self.sphere { long(r, l[2]) } else { r })
    }

    /// The edge of a cell round the axis at a distance from it, mm.
    fn arc(&self, radius: f64) -> f64 {
        core::f64::consts::TAU * radius / self.around
    }
}

impl Mapping for Round {
    fn wavelengths(&self) -> [f64; 2] {
        let [a, b] = self.wavelength;
        [a.min(b).min(self.arc(self.radii[1])), a.max(b).max(self.arc(self.radii[2]))]
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        phases(self, points, out);
    }

    fn jacobian(&self, p: Vec3) -> Mat3 {
        self.slopes(self.local(p))
    }

    fn phases_and_jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        phases_and_jacobians(self, points, u, j);
    }

    fn round(&self) -> Option<&Round> {
        Some(self)
    }

    fn typical(&self) -> Mat3 {
        let arc = self.arc(self.radii[1]);
        let last = if self.sphere { arc } else { self.wavelength[1] };
        [[1.0 / self.wavelength[0], 0.0, 0.0], [0.0, 1.0 / arc, 0.0], [0.0, 0.0, 1.0 / last]]
    }

    /// Nearest to the axis and farthest from it in the region.
    fn extremes(&self) -> Vec<Mat3> {
        let at = |r: f64| self.jacobian(add(self.center, scale(self.frame[0], r)));
        vec![at(self.radii[2]), at(self.radii[0])]
    }

    /// Infinite where the axis may meet the box.
    fn lipschitz(&self, b: &Aabb) -> f64 {
        let least = self.local(b.center()).1 - 0.5 * norm(b.size());
        self.lipschitz_at(least.max(0.0)) * (1.0 + 1e-12)
    }

    /// At the mean distance from the axis.
    fn max_lipschitz(&self) -> f64 {
        self.lipschitz_at(self.radii[1])
    }

    /// Radii are not negative, and end at the poles.
    fn position(&self, u: Vec3, _: Vec3) -> Option<Vec3> {
        let r = u[0] * self.wavelength[0];
        let angle = |u: f64| u * core::f64::consts::TAU / self.around;
        let (s, c) = angle(u[1]).sin_cos();
        let slack = 1e-9 * self.wavelength[0];
        let local = if self.sphere {
            let down = angle(u[2]);
            if !(-1e-9..=core::f64::consts::PI + 1e-9).contains(&down) {
                return None;
            }
            [r * down.sin() * c, r * down.sin() * s, r * down.cos()]
        } else {
            [r * c, r * s, u[2] * self.wavelength[1]]
        };
        let along = |a: usize| scale(self.frame[a], local[a]);
        (r >= -slack).then(|| add(self.center, add(along(0), add(along(1), along(2)))))
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        let positions = corners(b).map(|p| self.local(p));
        let most = |v: &dyn Fn(&(Vec3, f64)) -> f64| positions.iter().map(v).fold(f64::NEG_INFINITY, f64::max);
        let away = |l: &(Vec3, f64)| if self.sphere { long(l.1, l.0[2]) } else { l.1 };
        let far = most(&away);
        let near = away(&self.local(b.center())) - 0.5 * norm(b.size());
        let radial = [whole(near / self.wavelength[0]).max(1) - 1, whole(far / self.wavelength[0]) + 1];
        let last = if self.sphere {
            [0, self.around() / 2 - 1]
        } else {
            let (low, high) = (-most(&|l| -l.0[2]), most(&|l| l.0[2]));
            [low, high].map(|z| whole(z / self.wavelength[1]))
        };
        let last = if self.sphere { last } else { [last[0] - 1, last[1] + 1] };
        listed(self, [radial, [0, self.around() - 1], last], b, None)
    }

    fn canonical(&self, cell: [i32; 3]) -> [i32; 3] {
        [cell[0], cell[1].rem_euclid(self.around()), cell[2]]
    }
}

/// The length of (a, b).
#[inline(always)]
fn long(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn phases(map: &Round, points: &[Vec3], u: &mut [Vec3]) {
    for (u, &p) in u.iter_mut().zip(points) {
        *u = map.phase(map.local(p));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn phases_and_jacobians(map: &Round, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
    for ((u, j), &p) in u.iter_mut().zip(j).zip(points) {
        let local = map.local(p);
        (*u, *j) = (map.phase(local), map.slopes(local));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::spectral_norm;

    fn positions() -> impl Iterator<Item = Vec3> {
        (1..400).map(|i| [0.8191725, 0.6710436, 0.5497005].map(|s| 20.0 * (s * f64::from(i)).fract() - 10.0))
    }

    #[test]
    fn seams_close_and_jacobians_agree_with_differences() {
        let axis = [0.3, -0.2, 0.9];
        for map in [
            Round::cylinder([1.0, 2.0, 3.0], axis, [2.0, 3.0], 12.0, [1.0, 5.0, 9.0]).expect("cylinder"),
            Round::sphere([1.0, 2.0, 3.0], axis, 2.0, 12.0, [1.0, 5.0, 9.0]).expect("sphere"),
        ] {
            for p in positions() {
                let (j, r) = (map.jacobian(p), map.local(p).1);
                if r < 0.5 {
                    continue;
                }
                for a in 0..3 {
                    let mut q = [p, p];
                    q[0][a] -= 1e-6;
                    q[1][a] += 1e-6;
                    let d = sub(map.phase(map.local(q[1])), map.phase(map.local(q[0])));
                    for i in 0..3 {
                        // Over the seam the phase jumps by the whole number of cells.
                        let d = d[i] - 12.0 * (d[i] / 12.0).round();
                        assert!((d / 2e-6 - j[i][a]).abs() < 1e-7, "{p:?}");
                    }
                }
                let b = Aabb { min: p, max: p }.grown(0.1);
                for q in positions().take(20) {
                    let q = core::array::from_fn(|a| p[a] + 0.01 * q[a]);
                    assert!(spectral_norm(&map.jacobian(q)) <= map.lipschitz(&b));
                }
            }
        }
        let plain = Round::cylinder([0.0; 3], [0.0, 0.0, 1.0], [2.0, 3.0], 12.0, [1.0, 5.0, 9.0]).expect("cylinder");
        let u = plain.phase(plain.local([0.0, 4.0, 6.0]));
        assert!(norm(sub(u, [2.0, 3.0, 2.0])) < 1e-14, "{u:?}");
        assert_eq!(plain.lipschitz(&Aabb { min: [-1.0; 3], max: [1.0; 3] }), f64::INFINITY);
    }

    /// The phase at a point turned about the axis is that of the unturned map at the point itself, as for its slopes.
    #[test]
    fn cells_that_start_at_an_angle_are_turned_by_it() {
        let axis = [0.3, -0.2, 0.9];
        let map = Round::cylinder([1.0, 2.0, 3.0], axis, [2.0, 3.0], 12.0, [1.0, 5.0, 9.0]).expect("cylinder");
        for degrees in [0.0, 90.0, 17.0, -200.0] {
            let turned = map.started(degrees);
            let (s, c) = sin_cos_turns(degrees / 360.0);
            let n = unit(axis);
            let about = |d: Vec3| {
                let along = scale(n, dot(n, d));
                add(along, add(scale(sub(d, along), c), scale(cross(n, d), s)))
            };
            for p in positions() {
                let q = add(map.center, about(sub(p, map.center)));
                let (u, v) = (map.phase(map.local(p)), turned.phase(turned.local(q)));
                let round = v[1] - u[1];
                let off = [v[0] - u[0], round - 12.0 * (round / 12.0).round(), v[2] - u[2]];
                assert!(norm(off) < 1e-11, "{degrees}: {off:?}");
                let back = turned.position(v, q).expect("a position");
                assert!(norm(sub(back, q)) < 1e-11);
            }
            assert_eq!(degrees == 0.0, turned == map);
        }
    }

    #[test]
    fn what_does_not_close_is_refused() {
        let make = |around| Round::cylinder([0.0; 3], [0.0, 0.0, 1.0], [2.0; 2], around, [1.0; 3]).err().map(|f| f.at);
        for n in [0.0, 2.5, f64::NAN, -3.0] {
            assert_eq!(make(n).as_deref(), Some("around"));
        }
        assert_eq!(make(3.0), None);
        let odd = Round::sphere([0.0; 3], [0.0, 0.0, 1.0], 2.0, 7.0, [1.0; 3]);
        assert!(odd.err().is_some_and(|f| f.message.contains("even")));
    }
}
