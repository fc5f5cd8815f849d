//! The least thickness (mm) of the periodic solid: of walls of sheets, of necks of networks.
//!
//! Phases relate to space by u = M x; a direction d in space is M d in phase, and ∇ₓf = Mᵀ ∇ᵤf.

use rayon::prelude::*;

use super::Part;
use super::foot_point::LevelSurface;
use super::periodic_components::{Function, critical, sample};
use super::series::Series;
use geometry::math::{Mat3, Vec3, across, add, apply, cross, dot, norm, scale, spectral_norm, sub, transpose, unit};

/// Samples of the mid-surface along each axis of the torus.
const SAMPLES: usize = 24;
/// Rays from a point, the shortest of which bounds the distance to the surface.
const DIRECTIONS: usize = 32;
/// Steps of a grid about the point within that bound: the surface is met on its edges.
const STEPS_ABOUT: i32 = 8;

/// Minimum wall thickness (mm) of the sheet |f| ≤ `iso`, where u = `to_phase` · x.
///
/// At points of the mid-surface f = 0 the distances along both normals to |f| = iso are added; the least sum is
/// refined by ever smaller steps along the surface. `None` where there is no wall: no mid-surface, an empty sheet, or
/// one so thick that no normal leaves it.
pub fn wall(f: Function, iso: f64, to_phase: &Mat3) -> Option<f64> {
    if iso.is_nan() || iso <= 0.0 {
        return None;
    }
    let back = transpose(to_phase);
    // Along a unit vector of space the phase moves by at most this.
    let speed = spectral_norm(to_phase);
    least(f, &|at| thickness_at(f, at, iso, to_phase, &back, speed))
}

/// The least of a measure on the mid-surface f = 0: samples, the least few refined by ever smaller steps along the
/// surface. `None` where there is no surface, or nothing to measure on it.
pub(super) fn least(f: Function, measure: &(dyn Fn(Vec3) -> Option<f64> + Sync)) -> Option<f64> {
    let n = SAMPLES;
    let mut found: Vec<(f64, Vec3)> = (0..n * n * n)
        .into_par_iter()
        .filter_map(|i| {
            let u = [i % n, i / n % n, i / (n * n)].map(|c| (c as f64 + 0.5) / n as f64);
            let at = onto_surface(f, u, 1.0 / n as f64)?;
            Some((measure(at)?, at))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The least few, by a search on the surface round each.
    let refined = found.iter().take(8).map(|&(mut least, mut at)| {
        let mut step = 0.5 / n as f64;
        while step > 1e-5 {
            let (_, g) = sample(f, at);
            let n = unit(g);
            let a = across(n);
            let b = cross(n, a);
            let next = [a, b, scale(a, -1.0), scale(b, -1.0)].into_iter().find_map(|d| {
                let p = onto_surface(f, add(at, scale(d, step)), step)?;
                let t = measure(p)?;
                (t < least).then_some((t, p))
            });
            match next {
                Some((t, p)) => (least, at) = (t, p),
                None => step *= 0.5,
            }
        }
        least
    });
    refined.reduce(f64::min)
}

/// The point of f = 0 within `reach` of u, by Newton's method along the gradient.
fn onto_surface(f: Function, mut u: Vec3, reach: f64) -> Option<Vec3> {
    let start = u;
    for _ in 0..12 {
        let (v, g) = sample(f, u);
        let steep = dot(g, g);
        if steep <= 1e-12 {
            return None;
        }
        let step = scale(g, -v / steep);
        u = add(u, step);
        if norm(sub(u, start)) > 1.5 * reach {
            return None;
        }
        if norm(step) < 1e-10 {
            return Some(u);
        }
    }
    None
}

/// The wall at a point of the mid-surface: distance along one normal to |f| = iso plus that along the other.
fn thickness_at(f: Function, u: Vec3, iso: f64, to_phase: &Mat3, back: &Mat3, speed: f64) -> Option<f64> {
    let normal = unit(apply(back, sample(f, u).1));
    let d = apply(to_phase, normal);
    let one = first_beyond(f, u, d, speed, |v| v.abs() - iso)?;
    let other = first_beyond(f, u, scale(d, -1.0), speed, |v| v.abs() - iso)?;
    Some(one + other)
}

/// The least s > 0 (mm) at which `outside`(f(u + s d)) is positive, up to two periods; to about 1e-12 of a period.
/// The function is evaluated at eight points at once, which is one batch of a series.
fn first_beyond(f: Function, u: Vec3, d: Vec3, speed: f64, outside: impl Fn(f64) -> f64) -> Option<f64> {
    const STEPS: usize = 192;
    const AT_ONCE: usize = 8;
    // The index of the first of from + step, from + 2 step … that is outside.
    let first = |from: f64, step: f64| {
        let at = |k: usize| from + (k + 1) as f64 * step;
        let points: [Vec3; AT_ONCE] = core::array::from_fn(|k| add(u, scale(d, at(k))));
        let (mut v, mut g) = ([0.0; AT_ONCE], [[0.0; 3]; AT_ONCE]);
        f(&points, &mut v, &mut g);
        (0..AT_ONCE).find(|k| outside(v[*k]) > 0.0)
    };
    let mut step = 2.0 / (STEPS as f64 * speed);
    let mut lo = (0..STEPS).step_by(AT_ONCE).find_map(|k| {
        let from = k as f64 * step;
        first(from, step).map(|i| from + i as f64 * step)
    })?;
    // Each round cuts the interval [lo, lo + step] in nine.
    for _ in 0..13 {
        step /= (AT_ONCE + 1) as f64;
        lo += first(lo, step).unwrap_or(AT_ONCE) as f64 * step;
    }
    Some(lo + step)
}

/// Least diameter (mm) of the necks of the lower (f ≤ iso) or upper (f ≥ iso) part at their saddles, where u = `to_phase` · x: twice
/// the least distance from a saddle of f to the surface f = iso.
///
/// `necks` are those of [`necks`](super::necks): phases and levels. Where every neck is
/// closed and the components are disconnected it is zero. `None` where the part is empty or full, and for sheets.
pub fn neck(series: &Series, part: Part, iso: f64, necks: &[(Vec3, f64)], to_phase: &Mat3) -> Option<f64> {
    let sign = match part {
        Part::Lower => 1.0,
        Part::Upper => -1.0,
        Part::Sheet => return None,
    };
    let deep: Vec<Vec3> = necks.iter().filter(|(_, level)| sign * (iso - level) > 0.0).map(|(at, _)| *at).collect();
    if deep.is_empty() {
        // Every neck is closed: disconnected components, if any.
        return (!extremes(&|u, v, g| series.gradients(u, v, g), sign, iso).is_empty()).then_some(0.0);
    }
    let radii: Vec<f64> = deep.par_iter().filter_map(|u| distance(series, *u, iso, sign, to_phase)).collect();
    radii.into_iter().reduce(f64::min).map(|r| 2.0 * r)
}

/// The local minima of sign · f that a grid resolves and that are solid at `iso`.
fn extremes(f: Function, sign: f64, iso: f64) -> Vec<Vec3> {
    let n = 32;
    let points: Vec<Vec3> =
        (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)].map(|c| c as f64 / n as f64)).collect();
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    f(&points, &mut v, &mut g);
    let low = |i: usize| sign * v[i];
    let near = |i: usize, d: [usize; 3]| {
        let at = [i % n + d[0], i / n % n + d[1], i / (n * n) + d[2]].map(|c| c % n);
        (at[2] * n + at[1]) * n + at[0]
    };
    let hollow = |i: &usize| {
        (0..3).all(|a| {
            [1, n - 1]
                .into_iter()
                .all(|s| low(*i) <= low(near(*i, core::array::from_fn(|b| if a == b { s } else { 0 }))))
        })
    };
    let mut found: Vec<Vec3> = Vec::new();
    for i in (0..points.len()).filter(hollow) {
        let at = critical(f, points[i], 2.0 / n as f64).map_or(points[i], |c| c.at);
        let known = |p: &Vec3| sub(*p, at).iter().all(|d| (d - d.round()).abs() < 0.5 / n as f64);
        if sign * (iso - sample(f, at).0) > 0.0 && !found.iter().any(known) {
            found.push(at);
        }
    }
    found
}

/// Distance (mm) from a solid point to the surface f = iso: the least of the feet on it from all crossings of the surface with
/// the edges of a grid about the point, within the shortest of some rays. `None` where no ray meets the surface.
pub(super) fn distance(series: &Series, u: Vec3, iso: f64, sign: f64, to_phase: &Mat3) -> Option<f64> {
    let f = |u: &[Vec3], v: &mut [f64], g: &mut [Vec3]| series.gradients(u, v, g);
    let speed = spectral_norm(to_phase);
    // Points of a sphere on a Fibonacci spiral.
    let golden = core::f64::consts::PI * (3.0 - 5f64.sqrt());
    let rays = (0..DIRECTIONS).filter_map(|k| {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (s, c) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        first_beyond(&f, u, apply(to_phase, [r * c, r * s, z]), speed, |v| sign * (v - iso))
    });
    let bound = rays.reduce(f64::min)?;
    let (half, step) = (STEPS_ABOUT + 1, bound / f64::from(STEPS_ABOUT));
    let n = 2 * half + 1;
    let at = |i: i32| [i % n, i / n % n, i / (n * n)].map(|c| step * f64::from(c - half));
    let points: Vec<Vec3> = (0..n * n * n).map(|i| add(u, apply(to_phase, at(i)))).collect();
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    series.gradients(&points, &mut v, &mut g);
    let mut met: Vec<(f64, Vec3)> = Vec::new();
    for (axis, stride) in [1, n, n * n].into_iter().enumerate() {
        for i in (0..n * n * n).filter(|i| i / stride % n + 1 < n) {
            let [a, b] = [i, i + stride].map(|i| v[i as usize] - iso);
            if (a < 0.0) != (b < 0.0) {
                let mut p = at(i);
                p[axis] += step * a / (a - b);
                met.push((norm(p), p));
            }
        }
    }
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let surface = LevelSurface::new(series, iso, to_phase, 3.0 * step);
    // The foot of a patch of the surface is less than a step nearer than where the grid meets it.
    let nearest = met.iter().try_fold(bound, |least, (d, p)| {
        let foot = || surface.onto(u, *p).map_or(least, |p| norm(surface.nearest(u, p)));
        if *d > least + step { Err(least) } else { Ok(least.min(foot())) }
    });
    Some(nearest.unwrap_or_else(|least| least))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{PI, TAU};

    fn cosines(of: &[[i32; 3]]) -> Series {
        let terms = of.iter().map(|&hkl| super::super::Term { hkl, amplitude: 1.0, phase: 0.0 });
        Series::new(terms.collect()).expect("a series")
    }

    /// cos x + cos y + cos z.
    fn primitive() -> Series {
        cosines(&[[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    }

    fn of(series: &Series) -> impl Fn(&[Vec3], &mut [f64], &mut [Vec3]) + Sync {
        |u, v, g| series.gradients(u, v, g)
    }

    /// cos x.
    fn slabs() -> Series {
        cosines(&[[1, 0, 0]])
    }

    fn cubic(wavelength: f64) -> Mat3 {
        geometry::math::IDENTITY.map(|r| r.map(|v| v / wavelength))
    }

    fn about(found: Option<f64>, want: f64, tolerance: f64) {
        assert!(found.is_some_and(|v| (v - want).abs() <= tolerance * want), "{found:?} is not {want}");
    }

    #[test]
    fn flat_walls_have_their_closed_form() {
        // |cos 2πx| ≤ t about x = 1/4: half width asin(t)/2π.
        for t in [0.01, 0.3, 0.9f64] {
            about(wall(&of(&slabs()), t, &cubic(5.0)), 5.0 * t.asin() / PI, 1e-8);
        }
        // Stretched and turned: only the length along the phase's gradient counts.
        let r = geometry::math::rotation([20.0, 35.0, 50.0]);
        let map = geometry::math::product(&[[0.25, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1]], &transpose(&r));
        about(wall(&of(&slabs()), 0.3, &map), 4.0 * 0.3f64.asin() / PI, 1e-8);
    }

    #[test]
    fn thin_walls_are_their_first_order() {
        // The gradient of the primitive on f = 0 is greatest where sin² sums most: cos = 0 on all axes, |∇f| = 2π√3.
        let t = 1e-3;
        about(wall(&of(&primitive()), t, &cubic(4.0)), 4.0 * 2.0 * t / (TAU * 3f64.sqrt()), 1e-5);
    }

    #[test]
    fn no_wall_where_nothing_or_all_is_solid() {
        assert_eq!(wall(&of(&primitive()), 0.0, &cubic(4.0)), None);
        assert_eq!(wall(&of(&primitive()), -1.0, &cubic(4.0)), None);
        assert_eq!(wall(&of(&primitive()), f64::NAN, &cubic(4.0)), None);
        assert_eq!(wall(&of(&primitive()), 3.5, &cubic(4.0)), None);
    }

    /// Radius about the saddle (1/2, 1/2, 0) of the primitive's lower neck, in periods: it is round to no order, so the
    /// nearest point of cos x + cos y = t − 1 in the plane z = 0 across it is found by scanning.
    fn neck_radius(t: f64) -> f64 {
        // About x = y = 1/2, z = 0: f = −cos a − cos b + cos c. Nearest within all directions by brute force.
        let mut least = f64::INFINITY;
        let n = 400;
        for i in 0..=n {
            for j in 0..=n {
                let (th, ph) = (PI / 2.0 * f64::from(i) / f64::from(n), PI / 2.0 * f64::from(j) / f64::from(n));
                let d = [th.sin() * ph.cos(), th.sin() * ph.sin(), th.cos()];
                let f = |r: f64| -(TAU * r * d[0]).cos() - (TAU * r * d[1]).cos() + (TAU * r * d[2]).cos() - t;
                if f(least.min(0.5)) <= 0.0 {
                    continue;
                }
                let (mut lo, mut hi) = (0.0, least.min(0.5));
                for _ in 0..40 {
                    let mid = 0.5 * (lo + hi);
                    if f(mid) > 0.0 { hi = mid } else { lo = mid }
                }
                least = hi;
            }
        }
        least
    }

    #[test]
    fn necks_of_the_primitive() {
        let necks = super::super::necks(&of(&primitive()), Part::Lower);
        assert_eq!(necks.len(), 3);
        for t in [-0.9, -0.5, 0.0] {
            let want = 2.0 * neck_radius(t);
            about(neck(&primitive(), Part::Lower, t, &necks, &cubic(1.0)), want, 1e-4);
            // Lengths scale with the wavelength.
            about(neck(&primitive(), Part::Lower, t, &necks, &cubic(7.0)), 7.0 * want, 1e-4);
        }
        // The upper part is the lower one moved by half a period.
        let upper = super::super::necks(&of(&primitive()), Part::Upper);
        about(neck(&primitive(), Part::Upper, 0.5, &upper, &cubic(1.0)), 2.0 * neck_radius(-0.5), 1e-4);
    }

    #[test]
    fn a_stretched_neck_is_as_thin_as_its_short_side() {
        let necks = super::super::necks(&of(&primitive()), Part::Lower);
        let map = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1]];
        let long = neck(&primitive(), Part::Lower, -0.9, &necks, &map);
        // Necks along z keep their sections; the nearest point lies across, at cos a = 1 − (1 + t)…: solved on one axis.
        let section = 2.0 * ((0.9f64).acos() / TAU).min(f64::INFINITY);
        assert!(long.is_some_and(|v| v <= section * 1.001 && v > 0.5 * section), "{long:?} {section}");
    }

    #[test]
    fn loose_pieces_have_no_neck() {
        let necks = super::super::necks(&of(&primitive()), Part::Lower);
        for t in [-3.0 + 1e-4, -1.001] {
            let found = neck(&primitive(), Part::Lower, t, &necks, &cubic(2.0));
            assert_eq!(found, Some(0.0), "{t}");
        }
        assert_eq!(neck(&primitive(), Part::Lower, -3.5, &necks, &cubic(2.0)), None);
        assert_eq!(neck(&primitive(), Part::Lower, 3.5, &necks, &cubic(2.0)), None);
        assert_eq!(neck(&primitive(), Part::Sheet, 0.5, &necks, &cubic(2.0)), None);
    }
}
