//! The point of the surface closest to a given point, exact up to rounding.
//!
//! Where the surface is smooth, the closest point is the foot of a perpendicular on one of the quadrics, inside a face
//! or on its seam (where both faces have one normal). So all feet on all quadrics are candidates; those that are not on
//! the surface are discarded. For points inside sharp hubs creases are candidates too. Hubs and faces are skipped by
//! their boxes or by a proven lower bound of their distance; feet other than the nearest on a quadric are computed only
//! where they could be closer.

use std::sync::OnceLock;

use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub, unit};

use super::Quadors;
use super::complex::{Complex, QuadricFace};
use super::conic::Conic;
use super::foot::{PrincipalAxes, feet_on_conic, outward};
use super::hub::Hub;
use super::hub_quadric::Quadric;

/// The closest point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Position, mm.
    pub at: Vec3,
    /// Outward unit normal; on a crease the direction from the query point.
    pub normal: Vec3,
    /// Signed distance, mm: negative in the solid.
    pub distance: f64,
    /// Index of the hub.
    pub hub: u32,
    /// The active half-beams of the hub, as a bit mask.
    pub half_beams: u64,
}

/// The faces of a hub on one quadric.
struct QuadricFaces {
    label: u64,
    quadric: Quadric,
    axes: PrincipalAxes,
    /// The largest |eigenvalue|: a Lipschitz bound of half its gradient.
    curvature: f64,
    /// Bounds of the faces, mm.
    bounds: Aabb,
}

/// Bounds of a face: the control points of its seams, and its axis-extreme points in between.
fn bounds(hub: &Hub, complex: &Complex, face: &QuadricFace) -> Aabb {
    let arcs = face.loops.iter().flatten();
    let seams = arcs.flat_map(|&(a, _)| complex.arcs[a as usize].curves());
    let points = seams.flat_map(|c| c.points);
    if let Some(half_beam) = face.end_circle {
        let s = &hub.half_beams[half_beam as usize];
        let low = points.map(|p| dot(p, s.axis)).fold(s.split, f64::min);
        let side = s.axis.map(|a| s.max_radius() * (1.0 - a * a).max(0.0).sqrt());
        let ends = Aabb::EMPTY.with(scale(s.axis, low)).with(scale(s.axis, s.split));
        return Aabb { min: sub(ends.min, side), max: add(ends.max, side) };
    }
    let outline = points.fold(Aabb::EMPTY, Aabb::with);
    match face.quadric.axis_extremes() {
        None => hub.bounds(),
        Some(tops) => (tops.into_iter())
            .filter(|x| hub.value(*x).abs() <= 1e-6 * (dot(*x, *x) + hub.radius * hub.radius))
            .fold(outline, Aabb::with),
    }
}

/// The candidates of one hub.
struct HubCandidates {
    quadrics: Vec<QuadricFaces>,
    /// Creases, and their bounds.
    creases: Vec<(Conic, Aabb)>,
}

/// Closest-point queries on a lattice; data of hubs are computed once.
pub struct ClosestPoints<'a> {
    quadors: &'a Quadors,
    bounds: Aabb,
    hubs: Vec<OnceLock<Result<HubCandidates, Fault>>>,
}

/// Lower bound of the distance to the zero set of a function with this value and gradient norm, half of whose second
/// derivative is at most `curvature`.
fn distance_bound(value: f64, slope: f64, curvature: f64) -> f64 {
    let v = value.abs();
    2.0 * v / (slope + (slope * slope + 4.0 * curvature.max(0.0) * v).sqrt())
}

impl Quadors {
    /// Prepares closest-point queries.
    pub fn closest_points(&self) -> ClosestPoints<'_> {
        ClosestPoints { quadors: self, bounds: self.bounds(), hubs: (0..self.len()).map(|_| OnceLock::new()).collect() }
    }

    /// Lower bound of the distance to the surface of a hub's part, by its bounds and by value and gradient of S − N.
    fn hub_distance_bound(&self, hub: usize, p: Vec3) -> f64 {
        let ball = &self.balls[hub];
        let (of, x) = (self.hub(hub), sub(p, ball.center));
        let box_ = ball.bounds.distance(p);
        let (q, g) = of.gradient(x);
        let near = if q < 0.0 {
            // N is convex: S − N lies below its tangent plus |δ|².
            distance_bound(q, norm(g), 1.0)
        } else if of.sharp() {
            let s = dot(x, x) - of.radius * of.radius;
            of.half_beams.iter().fold(distance_bound(s.max(0.0), 2.0 * norm(x), 0.0), |least, half_beam| {
                let v = half_beam.g.at(x);
                let slope = sub(scale(x, 2.0), scale(half_beam.g.a, 2.0 * v));
                let curvature = dot(half_beam.g.a, half_beam.g.a) - 1.0;
                least.min(distance_bound((s - v * v).max(0.0), norm(slope), curvature))
            })
        } else {
            distance_bound(q, norm(g), ball.curvature - 1.0)
        };
        box_.max(near * (1.0 - 1e-12))
    }
}

impl ClosestPoints<'_> {
    fn faces(&self, hub: usize) -> Result<&HubCandidates, Fault> {
        let made = self.hubs[hub].get_or_init(|| {
            let complex = self.quadors.complex(hub)?;
            let hub = self.quadors.hub(hub);
            let mut quadrics: Vec<QuadricFaces> = Vec::new();
            for f in &complex.faces {
                let bounds = bounds(&hub, &complex, f).grown(1e-9 * hub.radius);
                if let Some(p) = quadrics.iter_mut().find(|p| p.label == f.label) {
                    p.bounds = p.bounds.union(bounds);
                } else {
                    let (m, _) = geometry::math::eigen(&f.quadric.m);
                    quadrics.push(QuadricFaces {
                        label: f.label,
                        quadric: f.quadric,
                        axes: PrincipalAxes::new(&f.quadric),
                        curvature: m.iter().fold(0.0, |a: f64, v| a.max(v.abs())),
                        bounds,
                    });
                }
            }
            let creases = if hub.sharp() {
                complex
                    .arcs
                    .iter()
                    .map(|a| {
                        let points = a.curves().into_iter().flat_map(|c| c.points);
                        let bounds = points.fold(Aabb::EMPTY, Aabb::with);
                        (a.conic, bounds.grown(1e-9 * hub.radius))
                    })
                    .collect()
            } else {
                Vec::new()
            };
            Ok(HubCandidates { quadrics, creases })
        });
        made.as_ref().map_err(Clone::clone)
    }

    /// The point of the surface closest to `p` (mm).
    ///
    /// # Errors
    /// A point that is not finite, and nearby hubs without a closed form.
    pub fn closest(&self, p: Vec3) -> Result<Closest, Fault> {
        if !p.iter().all(|v| v.is_finite()) {
            return Err(Fault::new("point", format!("position must be three finite numbers (mm), found {p:?}")));
        }
        let q = self.quadors;
        // The field has the magnitude of the distance; where it is too small, the search is repeated with a larger
        // radius.
        let guess = (1.5 * q.value(p).abs()).clamp(0.1 * q.scale, q.cap);
        let mut reach = guess.max(self.bounds.distance(p) * (1.0 + 1e-12));
        let mut best: Option<Closest> = None;
        let mut examined: Vec<u32> = Vec::new();
        loop {
            let near = Aabb { min: p.map(|v| v - reach), max: p.map(|v| v + reach) };
            let found = q.index.touching(&near, usize::MAX / 64).unwrap_or_default();
            let mut hubs: Vec<(f64, u32)> = found
                .into_iter()
                .filter(|h| q.balls[*h as usize].bounds.distance(p) <= reach)
                .filter(|h| examined.binary_search(h).is_err())
                .map(|h| (q.hub_distance_bound(h as usize, p), h))
                .collect();
            examined.extend(hubs.iter().map(|h| h.1));
            examined.sort_unstable();
            hubs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // The nearest foot on each quadric first; other feet, which cost more, only where they could be closer.
            let mut later = Vec::new();
            for (distance, h) in hubs {
                if cannot_improve(distance, &best) {
                    break;
                }
                self.on_hub(h as usize, p, &mut best, &mut later)?;
            }
            for deferred in later {
                self.on_deferred(deferred, p, &mut best)?;
            }
            match best {
                Some(b) if b.distance.abs() <= reach => return Ok(b),
                Some(b) => reach = b.distance.abs(),
                None if examined.len() == q.len() => {
                    return Err(Fault::new("point", "no closest point found: a hub near it has no closed form"));
                }
                None => reach *= 2.0,
            }
        }
    }

    /// Considers the nearest feet on the quadrics of a hub, and its creases. Other feet are appended to `later`.
    fn on_hub(&self, h: usize, p: Vec3, best: &mut Option<Closest>, later: &mut Vec<Deferred>) -> Result<(), Fault> {
        let faces = self.faces(h)?;
        let (hub, center) = (self.quadors.hub(h), self.quadors.center(h));
        let x = sub(p, center);
        let mut order: Vec<(f64, usize)> = faces
            .quadrics
            .iter()
            .enumerate()
            .map(|(i, f)| {
                let slope = 2.0 * norm(f.quadric.half_gradient(x));
                let distance_bound = distance_bound(f.quadric.at(x), slope, f.curvature);
                (distance_bound.max(f.bounds.distance(x)), i)
            })
            .filter(|(bound, _)| !cannot_improve(*bound, best))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (bound, quadric_faces) in order {
            if cannot_improve(bound, best) {
                break;
            }
            let f = &faces.quadrics[quadric_faces];
            let mut deferred = Deferred { hub: h, quadric_faces, bound, nearest_known: false };
            if let Some(foot) = f.axes.nearest(x) {
                if cannot_improve(foot.distance, best) {
                    continue;
                }
                deferred.bound = bound.max(foot.distance);
                if let Some(at) = f.axes.refined(&foot) {
                    deferred.nearest_known = true;
                    self.accept(h, f, x, at, best);
                }
            }
            later.push(deferred);
        }
        // From outside a crease is never closest: it is convex from there.
        if hub.value(x) < 0.0 {
            let mut feet = Vec::new();
            for (c, bounds) in &faces.creases {
                if cannot_improve(bounds.distance(x), best) {
                    continue;
                }
                feet.clear();
                feet_on_conic(c, x, &mut feet);
                for &foot in &feet {
                    let found = Closest {
                        at: add(center, foot),
                        normal: outward(x, foot),
                        distance: -norm(sub(x, foot)),
                        hub: h as u32,
                        half_beams: hub.smooth_union(foot).active,
                    };
                    accept(&hub, foot, found, best);
                }
            }
        }
        Ok(())
    }

    /// Considers the other feet on a quadric.
    fn on_deferred(&self, deferred: Deferred, p: Vec3, best: &mut Option<Closest>) -> Result<(), Fault> {
        if cannot_improve(deferred.bound, best) {
            return Ok(());
        }
        let f = &self.faces(deferred.hub)?.quadrics[deferred.quadric_faces];
        let x = sub(p, self.quadors.center(deferred.hub));
        let within = best.map_or(f64::INFINITY, |b| b.distance.abs());
        let mut few = Vec::new();
        let nearest_known = deferred.nearest_known && f.axes.others(x, within, &mut few);
        let mut feet: Vec<Vec3> = few.iter().filter_map(|foot| f.axes.refined(foot)).collect();
        if !nearest_known || feet.len() < few.len() {
            feet.clear();
            f.axes.feet(x, &mut feet);
        }
        for foot in feet {
            self.accept(deferred.hub, f, x, foot, best);
        }
        Ok(())
    }

    /// Considers a foot of x on a face.
    fn accept(&self, h: usize, f: &QuadricFaces, x: Vec3, foot: Vec3, best: &mut Option<Closest>) {
        let normal = unit(f.quadric.half_gradient(foot));
        let distance = sub(x, foot);
        let side = if dot(distance, normal) < 0.0 { -1.0 } else { 1.0 };
        let found = Closest {
            at: add(self.quadors.center(h), foot),
            normal,
            distance: side * norm(distance),
            hub: h as u32,
            half_beams: f.label,
        };
        accept(&self.quadors.hub(h), foot, found, best);
    }
}

/// A quadric whose other feet are still to be computed.
struct Deferred {
    hub: usize,
    quadric_faces: usize,
    /// Lower bound of their distance, mm.
    bound: f64,
    /// Whether the nearest foot on the whole quadric is known.
    nearest_known: bool,
}

/// Whether a candidate with this lower bound cannot improve the result.
fn cannot_improve(bound: f64, best: &Option<Closest>) -> bool {
    best.is_some_and(|b| bound * (1.0 - 1e-12) >= b.distance.abs())
}

/// Accepts a candidate if it is on the surface of the hub's part, within rounding, and closer.
fn accept(hub: &Hub, foot: Vec3, found: Closest, best: &mut Option<Closest>) {
    let size = dot(foot, foot) + hub.radius * hub.radius;
    let nearer = best.is_none_or(|b| found.distance.abs() < b.distance.abs());
    if nearer && hub.value(foot).abs() <= 1e-10 * size && before(hub, foot) {
        *best = Some(found);
    }
}

/// Whether a point lies before the split plane of the half-beam with the largest G, within rounding.
fn before(hub: &Hub, x: Vec3) -> bool {
    hub.is_before_split(scale(x, 1.0 - 1e-10))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, cubic, random_star};
    use super::super::{Fillet, Quadors};
    use super::*;

    /// Points on the surface, by bisection along rays from hub centres.
    fn samples(q: &Quadors, random: &mut Random, n: usize) -> Vec<Vec3> {
        let mut out = Vec::new();
        while out.len() < n {
            let i = ((q.len() as f64 * random.next()) as usize).min(q.len() - 1);
            let (hub, direction) = (q.hub(i), random.direction());
            let (mut lo, mut hi) = (0.0, norm(q.bounds().size()));
            if hub.value(scale(direction, hi)) < 0.0 {
                continue;
            }
            for _ in 0..60 {
                let m = (lo + hi) / 2.0;
                if hub.value(scale(direction, m)) < 0.0 { lo = m } else { hi = m }
            }
            let x = scale(direction, lo);
            if hub.value(x).abs() < 1e-9 && hub.is_before_split(x) {
                out.push(add(q.center(i), x));
            }
        }
        out
    }

    #[test]
    fn nothing_is_nearer_and_the_foot_is_stationary() {
        let mut random = Random(61);
        let mut lattices = vec![
            Quadors::new(&cubic(1, 1.5), Fillet::Auto).expect("a lattice"),
            Quadors::new(&cubic(1, 1.5), Fillet::None).expect("a lattice"),
        ];
        for n in [1, 2, 3, 5, 8, 12] {
            for fillet in [Fillet::Auto, Fillet::None] {
                let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
                lattices.extend(q.overlaps().is_empty().then_some(q));
            }
        }
        for q in &lattices {
            let (near, cloud) = (q.closest_points(), samples(q, &mut random, 4000));
            let b = q.bounds().grown(1.0);
            for k in 0..300 {
                // Anywhere, near the surface, and in the solid.
                let p = if k % 3 == 0 {
                    [0, 1, 2].map(|a| b.min[a] + random.next() * (b.max[a] - b.min[a]))
                } else {
                    add(cloud[k], scale(random.direction(), 0.4 * random.next()))
                };
                let c = near.closest(p).expect("a foot");
                let d = c.distance.abs();
                let least = cloud.iter().map(|x| norm(sub(*x, p))).fold(f64::INFINITY, f64::min);
                assert!(d <= least + 1e-9, "{p:?}: {c:?} {least}");
                assert_eq!(c.distance < 0.0, q.contains(p), "{p:?} {c:?}");
                assert!(q.value(c.at).abs() < 1e-8, "{c:?} {}", q.value(c.at));
                let across = sub(sub(p, c.at), scale(c.normal, c.distance));
                assert!(norm(across) < 1e-6 * (1.0 + d), "{p:?} {c:?} {across:?}");
                // No point of the open ball about p is across the surface.
                let inner = scale(sub(c.at, p), 0.98 * random.next());
                assert_eq!(q.contains(add(p, inner)), q.contains(p));
            }
        }
    }

    #[test]
    fn points_on_axes_and_centres_have_a_foot() {
        let q = Quadors::new(&cubic(1, 0.0), Fillet::None).expect("a lattice");
        let near = q.closest_points();
        // Cylinders of radius 1: on an axis every azimuth is equally close.
        let c = near.closest([5.0, 0.0, 0.0]).expect("a foot");
        assert!((c.distance + 1.0).abs() < 1e-12, "{c:?}");
        let c = near.closest([5.0, 1e-9, 0.0]).expect("a foot");
        assert!((c.distance + 1.0 - 1e-9).abs() < 1e-12, "{c:?}");
        // At the centre of the corner ball three cylinders and the ball are one radius away.
        let c = near.closest([0.0; 3]).expect("a foot");
        assert!((c.distance + 1.0).abs() < 1e-12, "{c:?}");
        // At the centre of the cell twelve beams are 5√2 minus a radius away.
        let c = near.closest([5.0; 3]).expect("a foot");
        assert!((c.distance - 50f64.sqrt() + 1.0).abs() < 1e-12, "{c:?}");
        // From far away.
        let c = near.closest([-1e4, 0.0, 0.0]).expect("a foot");
        assert!((c.distance - 1e4 + 1.0).abs() < 1e-8, "{c:?}");
        assert!(near.closest([f64::NAN, 0.0, 0.0]).is_err());
    }
}
