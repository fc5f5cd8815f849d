//! Signed distance (mm) to the mid-surface f = 0, which defines a wall of a given thickness.
//!
//! Phases relate to space by u = M x. For one M the distance is itself a function on the torus. It is found at the
//! nodes of a grid as the length to the nearest point of the surface and carried between them by a spline. Near the
//! surface the distance is smooth and the spline is good to a few 1e-6 of a period; where two points of the surface are
//! equally near it rounds the crease off within about two nodes.

use std::sync::OnceLock;

use super::Part;
use super::curvature;
use super::nearest::NearestSearch;
use super::periodic_components::connected;
use super::periodic_spline::PeriodicSpline;
use super::quantile::Quantile;
use super::series::Series;
use super::thickness::least;
use geometry::math::{Interval, Mat3, Vec3, add, apply, determinant, inverse, norm, scale, transpose};
use geometry::once::computed;

/// On creases the gradient may vanish and has no direction: with this the ratio of distances goes to one there, so that it is
/// continuous.
const SMALL: f64 = 1e-4;
/// Nodes on the least radius of curvature of the mid-surface.
const FINE: f64 = 8.0;
/// Nodes on the finest wave along an axis.
const WAVE: f64 = 16.0;
/// Points along an axis at which normals of walls are taken, and how near the mid-surface these are, of the greatest distance.
const SIDE: usize = 12;
const NEAR: f64 = 0.3;
/// Fewest and most nodes along an axis; the second most only for the sake of fine waves.
const NODES: [f64; 3] = [36.0, 72.0, 96.0];

/// The signed distance to f = 0 in mm, by phase: positive where f is.
pub struct Distance {
    spline: PeriodicSpline,
    /// The metric it was measured in: phases are M x.
    to_phase: Mat3,
    /// A bound of |∂d/∂x|.
    lipschitz: f64,
    /// Least radius of curvature of the mid-surface, mm.
    radius: Option<f64>,
    /// Largest distance found on the mid-surface itself, mm.
    error: f64,
    table: OnceLock<Quantile>,
    normals: OnceLock<Vec<Vec3>>,
    connected: [OnceLock<Vec<[f64; 2]>>; 3],
}

impl Distance {
    /// Measures the distances to f = 0 where phases are u = `to_phase` · x.
    pub fn new(series: &Series, to_phase: &Mat3) -> Distance {
        // The surface is the same, and what counts as steep does not depend on the unit of f.
        let series = &series.scaled(1.0 / series.amplitude());
        let radius = curvature::radius(series, to_phase);
        let edges = transpose(&inverse(to_phase)).map(norm);
        let finest = series
            .terms()
            .iter()
            .fold([1; 3], |top: [u32; 3], t| core::array::from_fn(|a| top[a].max(t.hkl[a].unsigned_abs())));
        let shape = core::array::from_fn(|a| {
            let bends = radius.map_or(0.0, |r| FINE * edges[a] / r);
            let waves = WAVE * f64::from(finest[a]);
            let most = (0.5 * waves).clamp(NODES[1], NODES[2]);
            bends.max(waves).clamp(NODES[0], most).ceil() as usize
        });
        let values = NearestSearch::new(series, to_phase, shape).distances();
        let spline = PeriodicSpline::through(values, shape);
        let error = |u: Vec3| {
            let mut d = [0.0];
            spline.values(&[u], &mut d);
            Some(-d[0].abs())
        };
        let error = least(&|u, v, g| series.gradients(u, v, g), &error).map_or(0.0, f64::abs);
        Distance {
            lipschitz: spline.lipschitz(to_phase),
            spline,
            to_phase: *to_phase,
            radius,
            error,
            table: OnceLock::new(),
            normals: OnceLock::new(),
            connected: Default::default(),
        }
    }

    /// Distances (mm) at phases `u` (turns).
    pub fn values(&self, u: &[Vec3], out: &mut [f64]) {
        self.spline.values(u, out);
    }

    /// Distances (mm) and their gradients (mm per turn).
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.spline.gradients(u, values, gradients);
    }

    /// As `gradients`, with second derivatives.
    pub fn second(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3], second: &mut [Mat3]) {
        self.spline.second(u, values, gradients, second);
    }

    /// Distances at the phases `base + x · along`, one for each of `xs`, in single precision.
    pub fn fill_row(&self, base: Vec3, along: Vec3, xs: &[f64], out: &mut [f32]) {
        self.spline.fill_row(base, along, xs, out);
    }

    /// The distance under another Jacobian du/dx than the one it was measured with, from the value and gradient here.
    ///
    /// The foot's normal n is kept and the length along it measured anew: d / |∇ₓd| with ∇ₓd = Jᵀ∇ᵤd, which is one for
    /// the Jacobian of `new`. Exact for flat walls and for any J with the same J Jᵀ, whatever its rotation; for others
    /// the foot moves and the error is of second order in the change of J, times thickness over radius of curvature.
    pub fn under(&self, value: f64, gradient: Vec3, jacobian: &Mat3) -> f64 {
        let own = norm(apply(&transpose(&self.to_phase), gradient));
        let here = norm(apply(&transpose(jacobian), gradient));
        value * (own * own * own + SMALL) / (own * own * here + SMALL)
    }

    /// The ratio of `under`, and what makes its gradient in space: ∇ratio = Jᵀ H a + b K w, where H are the second derivatives
    /// here by phase, w = Jᵀ∇ᵤd, and K w is the derivative of Jᵀ∇ᵤd along w as J alone varies. Gives (ratio, a, b).
    pub fn ratio_slopes(&self, gradient: Vec3, jacobian: &Mat3) -> (f64, Vec3, f64) {
        let (flat, w) = (apply(&transpose(&self.to_phase), gradient), apply(&transpose(jacobian), gradient));
        let (own, here) = (norm(flat), norm(w));
        let below = own * own * here + SMALL;
        let ratio = (own * own * own + SMALL) / below;
        // ∂ratio/∂own over own, and ∂ratio/∂here over here.
        let (a, b) =
            ((3.0 * own - 2.0 * ratio * here) / below, -ratio * own * own / (here.max(f64::MIN_POSITIVE) * below));
        (ratio, add(scale(apply(&self.to_phase, flat), a), scale(apply(jacobian, w), b)), b)
    }

    /// The factor that turns lengths across walls under another Jacobian du/dx into those that leave as much of the cell solid where
    /// it was measured: the mean of |∇ₓd| over normals of walls. Exact where cells are scaled and turned, for others of first order in
    /// the thickness.
    pub fn pace(&self, jacobian: &Mat3) -> f64 {
        let (normals, back) = (self.normals(), transpose(jacobian));
        if normals.is_empty() {
            return (determinant(jacobian) / determinant(&self.to_phase)).abs().cbrt();
        }
        normals.iter().map(|g| norm(apply(&back, *g))).sum::<f64>() / normals.len() as f64
    }

    /// Unit normals of the mid-surface and of what is near it, per turn.
    fn normals(&self) -> &[Vec3] {
        computed::<Vec<_>>(&self.normals, || {
            let at = |i: usize| (i as f64 + 0.5) / SIDE as f64;
            let u: Vec<Vec3> =
                (0..SIDE * SIDE * SIDE).map(|i| [at(i % SIDE), at(i / SIDE % SIDE), at(i / (SIDE * SIDE))]).collect();
            let (mut d, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
            self.gradients(&u, &mut d, &mut g);
            let (near, back) = (NEAR * self.range().abs().hi, transpose(&self.to_phase));
            let long = |g: Vec3| norm(apply(&back, g));
            let some = d.iter().zip(g).filter(|(d, g)| d.abs() <= near && long(*g) > 0.5);
            some.map(|(_, g)| scale(g, 1.0 / long(g))).collect()
        })
    }

    /// A Lipschitz bound: an upper bound of |∂d/∂x| (mm per mm). A distance's own is one; the spline oscillates near
    /// creases, and what is proven of it is two to three.
    pub fn lipschitz(&self) -> f64 {
        self.lipschitz
    }

    /// An interval that contains every distance.
    pub fn range(&self) -> Interval {
        self.spline.range()
    }

    /// The thickness (mm) beyond which the faces of a wall fold: twice the least radius of curvature of the mid-surface
    /// in space. `None` where there is no surface.
    pub fn folding(&self) -> Option<f64> {
        self.radius.map(|r| 2.0 * r)
    }

    /// The largest distance (mm) found on the mid-surface, where it should be zero: how well the table resolves the cell.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Share of the torus in the part at this distance (mm): for a sheet within it of the mid-surface.
    pub fn fraction(&self, part: Part, distance: f64) -> f64 {
        self.table().fraction(part, distance)
    }

    /// The distance (mm) at which the part has this share of the torus, and its derivative.
    pub fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        self.table().iso(part, fraction)
    }

    fn table(&self) -> &Quantile {
        computed(&self.table, || {
            let n = self.spline.shape().into_iter().fold(0, usize::max).max(96);
            let mean = self.spline.averaged(1.0 / n as f64);
            let range = self.spline.range().abs().hi;
            let rows = |x: &[f64], [y, z]: [f64; 2], v: &mut [f64], g: &mut [Vec3]| {
                let u: Vec<Vec3> = x.iter().map(|&x| [x, y, z]).collect();
                mean.gradients(&u, v, g);
            };
            Quantile::of(&rows, n, range)
        })
    }

    /// The intervals of solid fraction in which the periodic solid of this part is connected in R³.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let found = computed(&self.connected[part as usize], || connected(&|u, v, g| self.gradients(u, v, g), part));
        let share = |t: f64| self.fraction(part, t).clamp(0.0, 1.0);
        found.iter().map(|i| i.map(share)).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::named;
    use super::*;
    use geometry::math::{dot, rotation, sub, unit};

    pub(in crate::cell) fn series(name: &str) -> Series {
        Series::new(named(name).expect(name).terms()).expect(name)
    }

    pub(in crate::cell) fn stretched(wavelength: Vec3, degrees: Vec3) -> Mat3 {
        let turn = transpose(&rotation(degrees));
        core::array::from_fn(|a| scale(turn[a], 1.0 / wavelength[a]))
    }

    /// Points of f = 0 (phases) and their unit normals in space.
    pub(in crate::cell) fn surface(series: &Series, to_phase: &Mat3, count: usize) -> Vec<(Vec3, Vec3)> {
        let back = transpose(to_phase);
        (1..)
            .filter_map(|i| {
                let mut u = [0.7549, 0.5698, 0.4302].map(|s| (s * f64::from(i)).fract());
                for _ in 0..20 {
                    let (f, g, _) = series.second(u);
                    u = sub(u, scale(g, f / dot(g, g)));
                }
                let (f, g, _) = series.second(u);
                (f.abs() < 1e-12).then(|| (u, unit(apply(&back, g))))
            })
            .take(count)
            .collect()
    }

    /// A point s along the normal is s from the surface as long as s is less than the reach.
    #[test]
    fn points_along_the_normal_are_as_far_as_they_went() {
        for name in ["gyroid", "diamond", "primitive", "iwp"] {
            for (wavelength, degrees) in [([1.0; 3], [0.0; 3]), ([3.0, 4.0, 6.0], [20.0, 35.0, 50.0])] {
                let (s, m) = (series(name), stretched(wavelength, degrees));
                let d = Distance::new(&s, &m);
                let reach = d.folding().expect("a surface") / 2.0;
                let points = surface(&s, &m, 2000);
                let error = |side: f64| {
                    let mut worst = 0.0f64;
                    for (u, n) in &points {
                        for side in [side, -side] {
                            let mut v = [0.0];
                            d.values(&[add(*u, apply(&m, scale(*n, side)))], &mut v);
                            worst = worst.max((v[0] - side).abs());
                        }
                    }
                    worst / side
                };
                let thin = error(0.01 * wavelength[0]);
                let shares = [0.1, 0.3, 0.5, 0.7, 0.8, 0.9].map(|s| error(s * reach));
                println!("{name} {wavelength:?}: thin {thin:.1e}, of the reach {shares:.5?}");
                // Of half the thickness, from 0.02 of the wavelength to nine tenths of the folding limit, near which the
                // distance begins to bend within a few nodes.
                assert!(thin < 1e-3, "{name} {thin}");
                assert!(shares[..4].iter().all(|e| *e < 2e-3), "{name} {shares:?}");
                assert!(shares.iter().all(|e| *e < 1e-2), "{name} {shares:?}");
                // One where the distance is smooth; near creases the spline oscillates.
                assert!((1.0..3.5).contains(&d.lipschitz()), "{name} {}", d.lipschitz());
            }
        }
    }

    /// A Jacobian that is turned and scaled: exact. One that is stretched as well: of second order.
    #[test]
    fn other_jacobians_are_corrected() {
        let (s, m) = (series("gyroid"), stretched([1.0; 3], [0.0; 3]));
        let d = Distance::new(&s, &m);
        for (wavelength, degrees, tolerance) in [
            ([1.3; 3], [20.0, 35.0, 50.0], 1e-4),
            ([1.0, 1.05, 1.1], [20.0, 35.0, 50.0], 5e-3),
            ([1.0, 1.1, 1.2], [0.0; 3], 2e-2),
        ] {
            let j = stretched(wavelength, degrees);
            let mut worst = 0.0f64;
            for (u, n) in surface(&s, &j, 1000) {
                for side in [0.02, 0.1, -0.05] {
                    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                    d.gradients(&[add(u, apply(&j, scale(n, side)))], &mut v, &mut g);
                    worst = worst.max((d.under(v[0], g[0], &j) / side - 1.0).abs());
                }
            }
            println!("{wavelength:?}: {worst:.1e}");
            assert!(worst < tolerance, "{wavelength:?} {worst}");
        }
    }

    /// The factor of lengths is that of the scale, whatever the rotation; of stretched cells, that of the distances themselves: by it
    /// the fraction of a wall is the one that its own table has.
    #[test]
    fn fractions_under_other_jacobians_are_those_of_their_own_tables() {
        for name in ["gyroid", "diamond", "primitive"] {
            let s = series(name);
            let d = Distance::new(&s, &stretched([1.0; 3], [0.0; 3]));
            assert!((d.pace(&stretched([2.5; 3], [20.0, 35.0, 50.0])) - 0.4).abs() < 1e-12, "{name}");
            let j = stretched([1.0, 1.15, 1.3], [20.0, 35.0, 50.0]);
            let own = Distance::new(&s, &j);
            for half in [0.02, 0.05] {
                let (found, exact) = (d.fraction(Part::Sheet, half * d.pace(&j)), own.fraction(Part::Sheet, half));
                assert!((found / exact - 1.0).abs() < 0.02, "{name} {half} {found} {exact}");
            }
        }
    }

    /// Offsets of one connected surface are connected, at any thickness.
    #[test]
    fn walls_are_one_piece() {
        for name in ["gyroid", "diamond", "primitive", "iwp"] {
            let d = Distance::new(&series(name), &stretched([1.0, 1.2, 1.5], [0.0; 3]));
            let found = d.connected_fraction(Part::Sheet);
            assert_eq!(found.len(), 1, "{name} {found:?}");
            assert!(found[0][0] < 1e-3 && found[0][1] > 0.999, "{name} {found:?}");
        }
    }

    /// Waves too fine for the table are detected by the error on the mid-surface.
    #[test]
    fn the_error_is_known() {
        let wave = |hkl| super::super::Term { hkl, amplitude: 1.0, phase: 0.1 };
        let error = |n: i32| {
            let terms = vec![wave([n, 0, 0]), wave([0, n, 1]), wave([0, 1, n])];
            let s = Series::new(terms).expect("series");
            Distance::new(&s, &stretched([1.0; 3], [0.0; 3])).error() * f64::from(n)
        };
        let found = [1, 4, 40].map(error);
        println!("{found:?}");
        assert!(found[0] < 1e-5 && found[1] < 1e-3 && found[2] > 1e-2, "{found:?}");
    }

    /// A cell without a mid-surface is far from it everywhere.
    #[test]
    fn no_surface_is_nowhere_near() {
        let s = series("gyroid").about(2.0).expect("series");
        let d = Distance::new(&s, &stretched([4.0; 3], [0.0; 3]));
        let mut v = [0.0];
        d.values(&[[0.1, 0.2, 0.3]], &mut v);
        assert!((v[0] + 4.0).abs() < 1e-6 && d.folding().is_none());
    }
}
