//! Sections of beams without fillets against their closed form: bcc beams are the cylinders about the space diagonals of cubes, so a
//! section is a union of ellipses cut by the box, and its boundary is made of arcs and segments.

use core::f64::consts::TAU;

use geometry::layer::{Point, length, signed_area};
use geometry::random::random;
use trabecula::layers::Slicer;

use super::{plan, solid};

/// The section of the cylinder about one diagonal.
struct Ellipse {
    center: Point,
    /// Unit vector along the longer axis.
    along: Point,
    /// Half its axes, mm.
    half: [f64; 2],
}

impl Ellipse {
    fn at(&self, t: f64) -> Point {
        let ([x, y], [u, v], [a, b]) = (self.center, self.along, self.half);
        let (c, s) = (a * t.cos(), b * t.sin());
        [x + c * u - s * v, y + c * v + s * u]
    }

    /// Negative inside.
    fn value(&self, p: Point) -> f64 {
        let (d, [u, v], [a, b]) = ([p[0] - self.center[0], p[1] - self.center[1]], self.along, self.half);
        length([(d[0] * u + d[1] * v) / a, (d[1] * u - d[0] * v) / b]) - 1.0
    }

    /// The signed distance of a point near it, to first order.
    fn distance(&self, p: Point) -> f64 {
        let (d, [u, v], [a, b]) = ([p[0] - self.center[0], p[1] - self.center[1]], self.along, self.half);
        let q = [(d[0] * u + d[1] * v) / a, (d[1] * u - d[0] * v) / b];
        let (value, slope) = (length(q), length([q[0] / a, q[1] / b]));
        (value - 1.0) * value / slope
    }
}

/// A stretch of the boundary with the section on its left: its ends, and twice the area it sweeps about the origin, mm².
struct Stretch {
    ends: [Point; 2],
    swept: f64,
}

/// Bcc beams of a wavelength and a radius about nodes at the origin and its translates, in a box about the origin, mm.
struct Bcc {
    wavelength: f64,
    radius: f64,
    half: Point,
}

fn cross(p: Point, q: Point) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

impl Bcc {
    fn ellipses(&self, z: f64) -> Vec<Ellipse> {
        let (w, a) = (self.wavelength, self.radius * 3f64.sqrt());
        let mut out = Vec::new();
        for [sx, sy] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let count = [0, 1].map(|k| ((self.half[k] + a + z.abs()) / w).ceil() as i32);
            for (i, j) in (-count[0]..=count[0]).flat_map(|i| (-count[1]..=count[1]).map(move |j| (i, j))) {
                let center = [f64::from(i) * w + sx * z, f64::from(j) * w + sy * z];
                if (0..2).all(|k| center[k].abs() < self.half[k] + a) {
                    out.push(Ellipse { center, along: [sx, sy].map(|s| s / 2f64.sqrt()), half: [a, self.radius] });
                }
            }
        }
        out
    }

    fn inside(&self, p: Point) -> bool {
        (0..2).all(|k| p[k].abs() < self.half[k])
    }

    /// The signed distance of a point near the section's boundary from it, to first order.
    fn distance(&self, ellipses: &[Ellipse], p: Point) -> f64 {
        let beams = ellipses.iter().map(|e| e.distance(p)).fold(f64::INFINITY, f64::min);
        (0..2).map(|k| p[k].abs() - self.half[k]).fold(beams, f64::max)
    }

    /// The boundary of the section: stretches of ellipses in the box outside all others, and of the box's edges inside one.
    fn boundary(&self, z: f64) -> Vec<Stretch> {
        let ellipses = self.ellipses(z);
        let mut out = Vec::new();
        for (i, e) in ellipses.iter().enumerate() {
            let others = || ellipses.iter().enumerate().filter(move |(j, _)| *j != i).map(|(_, o)| o);
            let mut signs: Vec<Box<dyn Fn(f64) -> f64>> = Vec::new();
            for o in others().filter(|o| length([0, 1].map(|k| o.center[k] - e.center[k])) < 2.0 * e.half[0]) {
                signs.push(Box::new(move |t| o.value(e.at(t))));
            }
            for k in 0..2 {
                signs.push(Box::new(move |t| e.at(t)[k].abs() - self.half[k]));
            }
            let bare = |t: f64| self.inside(e.at(t)) && others().all(|o| o.value(e.at(t)) > 0.0);
            for [s, t] in stretches(&signs, [0.0, TAU], true, &bare) {
                let (p, q) = (e.at(s), e.at(t));
                let swept = e.half[0] * e.half[1] * (t - s) + cross(e.center, [q[0] - p[0], q[1] - p[1]]);
                out.push(Stretch { ends: [p, q], swept });
            }
        }
        let [x, y] = self.half;
        let corners = [[x, y], [-x, y], [-x, -y], [x, -y]];
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % 4];
            let at = move |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
            let signs: Vec<Box<dyn Fn(f64) -> f64>> =
                ellipses.iter().map(|o| Box::new(move |t| o.value(at(t))) as Box<dyn Fn(f64) -> f64>).collect();
            let covered = |t: f64| ellipses.iter().any(|o| o.value(at(t)) < 0.0);
            for [s, t] in stretches(&signs, [0.0, 1.0], false, &covered) {
                out.push(Stretch { ends: [at(s), at(t)], swept: cross(at(s), at(t)) });
            }
        }
        out
    }

    /// The areas of all contours, holes negative, mm².
    fn areas(&self, z: f64) -> Vec<f64> {
        let mut left = self.boundary(z);
        let mut areas = Vec::new();
        while let Some(first) = left.pop() {
            let (mut swept, mut at) = (first.swept, first.ends[1]);
            let off = |p: Point| length([p[0] - at[0], p[1] - at[1]]);
            let mut apart = off(first.ends[0]);
            loop {
                let off = |p: Point| length([p[0] - at[0], p[1] - at[1]]);
                let next = (0..left.len()).min_by(|i, j| off(left[*i].ends[0]).total_cmp(&off(left[*j].ends[0])));
                let Some(next) = next.filter(|n| off(left[*n].ends[0]) < apart) else { break };
                let next = left.swap_remove(next);
                (swept, at) = (swept + next.swept, next.ends[1]);
                apart = length([first.ends[0][0] - at[0], first.ends[0][1] - at[1]]);
            }
            assert!(apart < 1e-6, "a contour is open by {apart} mm");
            areas.push(0.5 * swept);
        }
        areas
    }
}

/// The stretches of a range between changes of sign in which something is so.
fn stretches(
    signs: &[Box<dyn Fn(f64) -> f64 + '_>],
    [from, to]: [f64; 2],
    closed: bool,
    holds: &dyn Fn(f64) -> bool,
) -> Vec<[f64; 2]> {
    const PARTS: usize = 1000;
    let at = |n: usize| from + (to - from) * n as f64 / PARTS as f64;
    let mut ends = Vec::new();
    for f in signs {
        for n in 0..PARTS {
            let (mut a, mut b) = (at(n), at(n + 1));
            let negative = f(a) < 0.0;
            if negative != (f(b) < 0.0) {
                for _ in 0..60 {
                    let middle = 0.5 * (a + b);
                    if (f(middle) < 0.0) == negative { a = middle } else { b = middle }
                }
                ends.push(b);
            }
        }
    }
    ends.sort_by(f64::total_cmp);
    if ends.is_empty() && closed {
        ends.push(from);
    }
    let mut pairs: Vec<[f64; 2]> = ends.windows(2).map(|e| [e[0], e[1]]).collect();
    match (closed, ends.first(), ends.last()) {
        (true, Some(first), Some(last)) => pairs.push([*last, first + (to - from)]),
        (false, Some(first), Some(last)) => pairs.extend([[from, *first], [*last, to]]),
        _ => pairs.push([from, to]),
    }
    pairs.retain(|[a, b]| b > a && holds(0.5 * (a + b)));
    pairs
}

/// At a step of a third of the radius, as by default: the area is that of the section within the tolerance along its boundary;
/// contours are within the tolerance of it, or cross a gap between beams that the smallest cells, a 32nd of the step, do not show: it
/// is less than two of them wide; and there are as many as the section has wherever an eighth of the step makes no difference.
#[test]
fn sections_of_sharp_beams_are_their_ellipses() {
    let mut seed = 29;
    let mut uniform = |a: f64, b: f64| a + (b - a) * (0.5 + 0.5 * random(&mut seed));
    let mut counted = 0;
    for trial in 0..24 {
        let wavelength = uniform(3.0, 10.0);
        let radius = wavelength * uniform(0.03, 0.15);
        // Half of the boxes end where beams mirror each other.
        let half = [0, 1].map(|_| wavelength * if trial % 2 == 0 { 0.5 } else { uniform(0.4, 1.2) });
        let bcc = Bcc { wavelength, radius, half };
        let [x, y] = half.map(|h| 2.0 * h);
        let solid = solid(&format!(
            "region.box.size = [{x}, {y}, {wavelength}]\n[beams.t]\ncell = \"bcc\"\nradius = {radius}\n\
             map.affine.wavelength = {wavelength}\n"
        ));
        let step = radius / 3.0;
        let slicer = Slicer::new(&solid, &plan(0.1 * wavelength, step)).expect("a slicer");
        for k in 0..12 {
            let z = if k % 3 == 0 { uniform(-2.0, 2.0) * radius } else { uniform(-0.5, 0.5) * wavelength };
            let (layer, want) = (slicer.at(z), bcc.areas(z));
            let about = format!("trial {trial}: {wavelength}, {radius}, {half:?}, {z}");
            let sides = || layer.loops.iter().flat_map(|l| l.iter().zip(l.iter().cycle().skip(1)));
            let boundary: f64 = sides().map(|(p, q)| length([q[0] - p[0], q[1] - p[1]])).sum();
            let off = layer.area() - want.iter().sum::<f64>();
            assert!(off.abs() < 1e-3 * boundary, "{about}: {} mm² too much along {boundary} mm", off);
            let ellipses = bcc.ellipses(z);
            for (p, q) in sides() {
                for t in [0.0, 0.25, 0.5, 0.75] {
                    let x = [0, 1].map(|a| p[a] + t * (q[a] - p[a]));
                    let off = bcc.distance(&ellipses, x);
                    assert!(off.abs() < 1e-3 + step / 16.0, "{about}: {x:?} is {off} mm off");
                }
            }
            let large = |areas: &[f64]| areas.iter().filter(|a| a.abs() > (step / 8.0).powi(2)).count();
            let other = |by: f64| large(&Bcc { radius: radius + by * step / 8.0, ..bcc }.areas(z));
            let number = large(&want);
            if [-1.0, -0.5, 0.5, 1.0].into_iter().all(|by| other(by) == number) {
                counted += 1;
                let found: Vec<f64> = layer.loops.iter().map(|l| signed_area(l)).collect();
                assert_eq!(large(&found), number, "{about}");
            }
        }
    }
    assert!(counted > 150, "{counted}");
}
