//! The place of the surface nearest to a point, exactly.
//!
//! Where the surface is smooth it is a foot of the point on one of the quadrics, inside the face or on its seam, where both faces
//! have one normal: so all feet on all quadrics are looked at, and those that are not on the surface are left out. Creases of
//! sharp hubs are looked at too, for points in the solid. Hubs, and faces, that a box or a proven bound of their distance
//! holds off are not looked at, and beyond the nearest foot on a quadric only where another could be nearer.

use std::sync::OnceLock;

use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub, unit};

use super::Quadors;
use super::complex::{Complex, Face};
use super::foot::{Axes, away, feet_on_arc};
use super::hub::Hub;
use super::quadric::{Conic, Quadric};

/// The nearest place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The place, mm.
    pub at: Vec3,
    /// The normal there, out of the solid; in a crease the direction from the point.
    pub normal: Vec3,
    /// How far it is, mm: negative in the solid.
    pub distance: f64,
    /// The hub that it belongs to.
    pub hub: u32,
    /// The stubs of the hub that shape the surface there, a bit for each.
    pub stubs: u64,
}

/// A quadric of a hub.
struct Patch {
    label: u64,
    quadric: Quadric,
    axes: Axes,
    /// The greatest |eigenvalue|: how fast its slope may change.
    bend: f64,
    /// What holds its faces.
    bounds: Aabb,
}

/// What holds a face: the points of its seams' curves, and where it is farthest along an axis in between.
fn bounds(hub: &Hub, complex: &Complex, face: &Face) -> Aabb {
    let arcs = face.loops.iter().flatten();
    let seams = arcs.flat_map(|&(a, _)| complex.arcs[a as usize].curves());
    let points = seams.flat_map(|c| c.points);
    if let Some(stub) = face.rim {
        let s = &hub.stubs[stub as usize];
        let low = points.map(|p| dot(p, s.axis)).fold(s.split, f64::min);
        let side = s.axis.map(|a| s.thickest() * (1.0 - a * a).max(0.0).sqrt());
        let ends = Aabb::EMPTY.with(scale(s.axis, low)).with(scale(s.axis, s.split));
        return Aabb { min: sub(ends.min, side), max: add(ends.max, side) };
    }
    let outline = points.fold(Aabb::EMPTY, Aabb::with);
    match face.quadric.extremes() {
        None => hub.bounds(),
        Some(tops) => (tops.into_iter())
            .filter(|x| hub.value(*x).abs() <= 1e-6 * (dot(*x, *x) + hub.radius * hub.radius))
            .fold(outline, Aabb::with),
    }
}

/// What the feet on one hub are found by.
struct Faces {
    patches: Vec<Patch>,
    /// Creases, and what holds them.
    creases: Vec<(Conic, Aabb)>,
}

/// Nearest places on a lattice; what is found out about a hub is kept.
pub struct Nearest<'a> {
    quadors: &'a Quadors,
    bounds: Aabb,
    hubs: Vec<OnceLock<Result<Faces, Fault>>>,
}

/// No nearer than this to a surface where a function with this value and slope vanishes, whose half second derivative is at
/// most `bend`.
fn clear(value: f64, slope: f64, bend: f64) -> f64 {
    let v = value.abs();
    2.0 * v / (slope + (slope * slope + 4.0 * bend.max(0.0) * v).sqrt())
}

impl Quadors {
    /// Prepares to find nearest places.
    pub fn nearest(&self) -> Nearest<'_> {
        Nearest { quadors: self, bounds: self.bounds(), hubs: (0..self.len()).map(|_| OnceLock::new()).collect() }
    }

    /// No nearer than this to the surface of a hub's part: to its box, and by the value and slope of S − N.
    fn clearance(&self, hub: usize, p: Vec3) -> f64 {
        let ball = &self.balls[hub];
        let (of, x) = (self.hub(hub), sub(p, ball.center));
        let box_ = ball.bounds.distance(p);
        let (q, g) = of.gradient(x);
        let near = if q < 0.0 {
            // N is convex: S − N is under its tangent plus |δ|².
            clear(q, norm(g), 1.0)
        } else if of.sharp {
            let s = dot(x, x) - of.radius * of.radius;
            of.stubs.iter().fold(clear(s.max(0.0), 2.0 * norm(x), 0.0), |least, stub| {
                let v = stub.g.at(x);
                let slope = sub(scale(x, 2.0), scale(stub.g.a, 2.0 * v));
                let bend = dot(stub.g.a, stub.g.a) - 1.0;
                least.min(clear((s - v * v).max(0.0), norm(slope), bend))
            })
        } else {
            clear(q, norm(g), ball.bend - 1.0)
        };
        box_.max(near * (1.0 - 1e-12))
    }
}

impl Nearest<'_> {
    fn faces(&self, hub: usize) -> Result<&Faces, Fault> {
        let made = self.hubs[hub].get_or_init(|| {
            let complex = self.quadors.complex(hub)?;
            let hub = self.quadors.hub(hub);
            let mut patches: Vec<Patch> = Vec::new();
            for f in &complex.faces {
                let bounds = bounds(&hub, &complex, f).grown(1e-9 * hub.radius);
                if let Some(p) = patches.iter_mut().find(|p| p.label == f.label) {
                    p.bounds = p.bounds.union(bounds);
                } else {
                    let (m, _) = geometry::math::eigen(&f.quadric.m);
                    patches.push(Patch {
                        label: f.label,
                        quadric: f.quadric,
                        axes: Axes::new(&f.quadric),
                        bend: m.iter().fold(0.0, |a: f64, v| a.max(v.abs())),
                        bounds,
                    });
                }
            }
            let creases = if hub.sharp {
                complex
                    .arcs
                    .iter()
                    .map(|a| {
                        let points = a.curves().into_iter().flat_map(|c| c.points);
                        let held = points.fold(Aabb::EMPTY, Aabb::with);
                        (a.conic, held.grown(1e-9 * hub.radius))
                    })
                    .collect()
            } else {
                Vec::new()
            };
            Ok(Faces { patches, creases })
        });
        made.as_ref().map_err(Clone::clone)
    }

    /// The nearest place of the surface.
    ///
    /// # Errors
    /// A point that is none, and hubs near it that have no closed form.
    pub fn closest(&self, p: Vec3) -> Result<Closest, Fault> {
        if !p.iter().all(|v| v.is_finite()) {
            return Err(Fault::new("point", "is not a position: give three finite numbers, mm"));
        }
        let q = self.quadors;
        // The field is of the size of the distance; where it is not, all is looked at once more, farther out.
        let guess = (1.5 * q.value(p).abs()).clamp(0.1 * q.scale, q.cap);
        let mut reach = guess.max(self.bounds.distance(p) * (1.0 + 1e-12));
        let mut best: Option<Closest> = None;
        let mut seen: Vec<u32> = Vec::new();
        loop {
            let near = Aabb { min: p.map(|v| v - reach), max: p.map(|v| v + reach) };
            let found = q.index.touching(&near, usize::MAX / 64).unwrap_or_default();
            let mut hubs: Vec<(f64, u32)> = found
                .into_iter()
                .filter(|h| q.balls[*h as usize].bounds.distance(p) <= reach)
                .filter(|h| seen.binary_search(h).is_err())
                .map(|h| (q.clearance(h as usize, p), h))
                .collect();
            seen.extend(hubs.iter().map(|h| h.1));
            seen.sort_unstable();
            hubs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // The nearest foot on each quadric first; others, which are costlier, where they could be nearer still.
            let mut later = Vec::new();
            for (away, h) in hubs {
                if beaten(away, &best) {
                    break;
                }
                self.on_hub(h as usize, p, &mut best, &mut later)?;
            }
            for rest in later {
                self.on_rest(rest, p, &mut best)?;
            }
            match best {
                Some(b) if b.distance.abs() <= reach => return Ok(b),
                Some(b) => reach = b.distance.abs(),
                None if seen.len() == q.len() => {
                    return Err(Fault::new(
                        "point",
                        "no place of the surface was found for it: a hub of this lattice has no closed form",
                    ));
                }
                None => reach *= 2.0,
            }
        }
    }

    /// Takes what is nearer on a hub: feet that are nearest to their quadrics, and on creases. What else there may be is for later.
    fn on_hub(&self, h: usize, p: Vec3, best: &mut Option<Closest>, later: &mut Vec<Rest>) -> Result<(), Fault> {
        let faces = self.faces(h)?;
        let (hub, center) = (self.quadors.hub(h), self.quadors.center(h));
        let x = sub(p, center);
        let mut order: Vec<(f64, usize)> = faces
            .patches
            .iter()
            .enumerate()
            .map(|(i, f)| {
                let slope = 2.0 * norm(f.quadric.half_slope(x));
                let clear = clear(f.quadric.at(x), slope, f.bend);
                (clear.max(f.bounds.distance(x)), i)
            })
            .filter(|(bound, _)| !beaten(*bound, best))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (bound, patch) in order {
            if beaten(bound, best) {
                break;
            }
            let f = &faces.patches[patch];
            let mut rest = Rest { hub: h, patch, bound, told: false };
            if let Some(foot) = f.axes.nearest(x) {
                if beaten(foot.away, best) {
                    continue;
                }
                rest.bound = bound.max(foot.away);
                if let Some(at) = f.axes.place(&foot) {
                    rest.told = true;
                    self.take(h, f, x, at, best);
                }
            }
            later.push(rest);
        }
        // From outside a crease is never nearest: the solid's angle there is more than half a turn.
        if hub.value(x) < 0.0 {
            let mut feet = Vec::new();
            for (c, held) in &faces.creases {
                if beaten(held.distance(x), best) {
                    continue;
                }
                feet.clear();
                feet_on_arc(c, x, &mut feet);
                for &foot in &feet {
                    let found = Closest {
                        at: add(center, foot),
                        normal: away(x, foot),
                        distance: -norm(sub(x, foot)),
                        hub: h as u32,
                        stubs: hub.grown(foot).active,
                    };
                    take(&hub, foot, found, best);
                }
            }
        }
        Ok(())
    }

    /// Takes what is nearer among the other feet on a quadric.
    fn on_rest(&self, rest: Rest, p: Vec3, best: &mut Option<Closest>) -> Result<(), Fault> {
        if beaten(rest.bound, best) {
            return Ok(());
        }
        let f = &self.faces(rest.hub)?.patches[rest.patch];
        let x = sub(p, self.quadors.center(rest.hub));
        let within = best.map_or(f64::INFINITY, |b| b.distance.abs());
        let mut few = Vec::new();
        let told = rest.told && f.axes.others(x, within, &mut few);
        let mut feet: Vec<Vec3> = few.iter().filter_map(|foot| f.axes.place(foot)).collect();
        if !told || feet.len() < few.len() {
            feet.clear();
            f.axes.feet(x, &mut feet);
        }
        for foot in feet {
            self.take(rest.hub, f, x, foot, best);
        }
        Ok(())
    }

    /// Takes a foot of x on a face if it is nearer.
    fn take(&self, h: usize, f: &Patch, x: Vec3, foot: Vec3, best: &mut Option<Closest>) {
        let normal = unit(f.quadric.half_slope(foot));
        let away = sub(x, foot);
        let side = if dot(away, normal) < 0.0 { -1.0 } else { 1.0 };
        let found = Closest {
            at: add(self.quadors.center(h), foot),
            normal,
            distance: side * norm(away),
            hub: h as u32,
            stubs: f.label,
        };
        take(&self.quadors.hub(h), foot, found, best);
    }
}

/// Feet that were left for later.
struct Rest {
    hub: usize,
    patch: usize,
    /// No nearer than this.
    bound: f64,
    /// Whether the nearest foot on the whole quadric is known.
    told: bool,
}

/// Whether what is no nearer than a bound cannot be nearest.
fn beaten(bound: f64, best: &Option<Closest>) -> bool {
    best.is_some_and(|b| bound * (1.0 - 1e-12) >= b.distance.abs())
}

/// Takes a foot if it is on the surface of the hub's part, but for rounding, and nearer.
fn take(hub: &Hub, foot: Vec3, found: Closest, best: &mut Option<Closest>) {
    let size = dot(foot, foot) + hub.radius * hub.radius;
    let nearer = best.is_none_or(|b| found.distance.abs() < b.distance.abs());
    if nearer && hub.value(foot).abs() <= 1e-10 * size && before(hub, foot) {
        *best = Some(found);
    }
}

/// Whether a place lies before the split of the stub that leads there, or on it but for rounding.
fn before(hub: &Hub, x: Vec3) -> bool {
    hub.before_split(scale(x, 1.0 - 1e-10))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, cubic, random_star};
    use super::super::{Fillet, Quadors};
    use super::*;

    /// Places on the surface: rays from hubs' centres go out once.
    fn samples(q: &Quadors, random: &mut Random, n: usize) -> Vec<Vec3> {
        let mut out = Vec::new();
        while out.len() < n {
            let i = ((q.len() as f64 * random.next()) as usize).min(q.len() - 1);
            let (hub, way) = (q.hub(i), random.direction());
            let (mut lo, mut hi) = (0.0, norm(q.bounds().size()));
            if hub.value(scale(way, hi)) < 0.0 {
                continue;
            }
            for _ in 0..60 {
                let m = (lo + hi) / 2.0;
                if hub.value(scale(way, m)) < 0.0 { lo = m } else { hi = m }
            }
            let x = scale(way, lo);
            if hub.value(x).abs() < 1e-9 && hub.before_split(x) {
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
            let (near, cloud) = (q.nearest(), samples(q, &mut random, 4000));
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
                // No ball about p is cut before: the bound of the field agrees.
                let inner = scale(sub(c.at, p), 0.98 * random.next());
                assert_eq!(q.contains(add(p, inner)), q.contains(p));
            }
        }
    }

    #[test]
    fn points_on_axes_and_centres_have_a_foot() {
        let q = Quadors::new(&cubic(1, 0.0), Fillet::None).expect("a lattice");
        let near = q.nearest();
        // Cylinders of radius 1: on an axis halfway along every azimuth is as near.
        let c = near.closest([5.0, 0.0, 0.0]).expect("a foot");
        assert!((c.distance + 1.0).abs() < 1e-12, "{c:?}");
        let c = near.closest([5.0, 1e-9, 0.0]).expect("a foot");
        assert!((c.distance + 1.0 - 1e-9).abs() < 1e-12, "{c:?}");
        // In the middle of the corner ball the three faces of the cylinders and the ball are a radius away.
        let c = near.closest([0.0; 3]).expect("a foot");
        assert!((c.distance + 1.0).abs() < 1e-12, "{c:?}");
        // In the middle of the cell twelve beams are 5√2 less a radius away.
        let c = near.closest([5.0; 3]).expect("a foot");
        assert!((c.distance - 50f64.sqrt() + 1.0).abs() < 1e-12, "{c:?}");
        // From far away.
        let c = near.closest([-1e4, 0.0, 0.0]).expect("a foot");
        assert!((c.distance - 1e4 + 1.0).abs() < 1e-8, "{c:?}");
        assert!(near.closest([f64::NAN, 0.0, 0.0]).is_err());
    }
}
