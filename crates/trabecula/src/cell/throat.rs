//! The narrowest place of a passage: a saddle of the distance to a level surface.
//!
//! The distance is the least of the distances to patches of the surface, each given by a foot point and its principal
//! curvatures. Their soft minimum −τ ln Σ exp(−d/τ) is smooth, and Newton's method follows its saddle as τ goes to zero;
//! then the feet are found anew. Where three feet or more hold a ball they fix it; where two do, it is centred where their
//! distance is stationary; along directions in which nothing changes it stays where it is.

use super::foot_point::LevelSurface;
use geometry::math::{Mat3, Vec3, add, cross, dot, eigen, norm, scale, sub, unit};

/// The surface about a foot point, to second order: distances to it are exact for planes, spheres, cylinders, and for any
/// surface to the third order in the distance along it.
struct OsculatingSurface {
    foot: Vec3,
    /// Unit normal, towards the passage.
    normal: Vec3,
    /// Principal directions, and curvatures (1/mm): positive where the surface bends away from the passage.
    axes: [Vec3; 2],
    curvatures: [f64; 2],
}

impl OsculatingSurface {
    /// The patch at the foot of x; `None` where x is beyond the centre of a curvature, so that this is no nearest point.
    fn new(surface: &LevelSurface, u: Vec3, x: Vec3, foot: Vec3) -> Option<OsculatingSurface> {
        let (_, g, h) = surface.second(u, foot);
        let (to, steep) = (sub(x, foot), norm(g));
        let sign = dot(to, g).signum() / steep;
        let normal = scale(g, sign);
        let k = (0..3).fold(0, |k, a| if normal[a].abs() < normal[k].abs() { a } else { k });
        let mut e = [0.0; 3];
        e[k] = 1.0;
        let a = unit(cross(normal, e));
        let b = cross(normal, a);
        let bend = |v: Vec3, w: Vec3| sign * dot(v, h.map(|r| dot(r, w)));
        let (aa, ab, bb) = (bend(a, a), bend(a, b), bend(b, b));
        let angle = 0.5 * (2.0 * ab).atan2(aa - bb);
        let (s, c) = angle.sin_cos();
        let axes = [add(scale(a, c), scale(b, s)), sub(scale(b, c), scale(a, s))];
        let curvatures = axes.map(|v| bend(v, v));
        let away = dot(to, normal);
        let nearest = curvatures.iter().all(|k| 1.0 + k * away > -1e-4);
        (nearest && normal[0].is_finite()).then_some(OsculatingSurface { foot, normal, axes, curvatures })
    }

    /// Distance, its gradient and second derivatives at x. Centres of curvature are rounded off within about `soft` mm.
    fn distance(&self, x: Vec3, soft: f64) -> (f64, Vec3, Mat3) {
        let to = sub(x, self.foot);
        let away = dot(to, self.normal);
        let (mut d, mut g, mut h) = (away, self.normal, [[0.0; 3]; 3]);
        for (axis, k) in self.axes.iter().zip(self.curvatures) {
            // Of a circle of radius 1/k: (√((1 + k a)² + k² v²) − 1 − k a) / k is what v adds to the distance a.
            let (v, c) = (dot(to, *axis), 1.0 + k * away);
            let wide = v * v + soft * soft;
            let s = (c * c + k * k * wide).sqrt();
            d += if c > 0.0 { k * wide / (s + c) } else { (s - c) / k };
            g = add(g, add(scale(self.normal, c / s - 1.0), scale(*axis, k * v / s)));
            let cube = s * s * s;
            let second = [k * k * k * wide / cube, -c * k * k * v / cube, k * (c * c + k * k * soft * soft) / cube];
            for i in 0..3 {
                for j in 0..3 {
                    let (n, t) = (self.normal, axis);
                    h[i][j] +=
                        second[0] * n[i] * n[j] + second[1] * (n[i] * t[j] + t[i] * n[j]) + second[2] * t[i] * t[j];
                }
            }
        }
        (d, g, h)
    }
}

/// Gradient and second derivatives of the soft minimum of the distances to patches.
fn soft_minimum(patches: &[OsculatingSurface], x: Vec3, soft: f64) -> (Vec3, Mat3) {
    let each: Vec<_> = patches.iter().map(|p| p.distance(x, soft)).collect();
    let least = each.iter().fold(f64::INFINITY, |m, e| m.min(e.0));
    let weights: Vec<f64> = each.iter().map(|e| ((least - e.0) / soft).exp()).collect();
    let all: f64 = weights.iter().sum();
    let (mut g, mut h) = ([0.0; 3], [[0.0; 3]; 3]);
    for (w, (_, slope, _)) in weights.iter().zip(&each) {
        g = add(g, scale(*slope, w / all));
    }
    for (w, (_, slope, second)) in weights.iter().zip(&each) {
        let off = sub(*slope, g);
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] += w / all * (second[i][j] - off[i] * off[j] / soft);
            }
        }
    }
    (g, h)
}

/// The saddle of the least of the distances to patches, within `reach` of `start`.
fn saddle(patches: &[OsculatingSurface], start: Vec3, reach: f64, radius: f64) -> Option<Vec3> {
    if patches.is_empty() {
        return None;
    }
    let (mut x, mut soft) = (start, 0.25 * reach);
    while soft > 1e-8 * radius {
        for _ in 0..6 {
            let (g, h) = soft_minimum(patches, x, soft);
            let (values, vectors) = eigen(&h);
            let mut step = [0.0; 3];
            for (value, vector) in values.iter().zip(vectors) {
                if value.abs() > 1e-4 / radius {
                    step = sub(step, scale(vector, dot(vector, g) / value));
                }
            }
            let length = norm(step);
            if length.is_nan() {
                return None;
            }
            x = add(x, scale(step, (2.0 * soft / length).min(1.0)));
            if length < 0.02 * soft {
                break;
            }
        }
        if norm(sub(x, start)) > reach {
            return None;
        }
        soft *= 0.3;
    }
    Some(x)
}

/// Radius (mm) of the largest ball that passes a narrow place near `start`: the distance to the surface at its saddle.
/// Positions are mm from the phase u; `cloud` are points of the surface all about; `step` is the distance that `start` may be off.
/// `None` where no saddle is found.
pub(super) fn throat(surface: &LevelSurface, u: Vec3, start: Vec3, cloud: &[Vec3], step: f64) -> Option<f64> {
    let (mut x, mut reach, mut last) = (start, 2.0 * step, None::<Vec3>);
    for _ in 0..12 {
        let feet = feet(surface, u, x, cloud, reach);
        let radius = norm(sub(x, *feet.first()?));
        // The next move would be its square, and the distance is stationary at the saddle. By symmetry it can be none at all.
        if last.is_some_and(|last| norm(last) < 1e-5 * radius) {
            return Some(radius);
        }
        let patches: Vec<OsculatingSurface> =
            feet.iter().filter_map(|p| OsculatingSurface::new(surface, u, x, *p)).collect();
        let mut to = sub(saddle(&patches, x, reach, radius)?, x);
        if last.is_some_and(|last| dot(to, last) < -0.25 * dot(last, last)) {
            to = scale(to, 0.5);
        }
        x = add(x, to);
        if norm(sub(x, start)) > 3.0 * step {
            return None;
        }
        reach = (4.0 * norm(to)).clamp(0.04 * step, reach);
        last = Some(to);
    }
    None
}

/// The feet of x, nearest first, that are no more than `slack` farther than the nearest.
fn feet(surface: &LevelSurface, u: Vec3, x: Vec3, cloud: &[Vec3], slack: f64) -> Vec<Vec3> {
    let at = surface.moved(u, x);
    let away = |p: &Vec3| norm(sub(x, *p));
    let least = cloud.iter().map(away).fold(f64::INFINITY, f64::min);
    let mut found: Vec<(f64, Vec3)> = Vec::new();
    for p in cloud.iter().filter(|p| away(p) <= least + slack) {
        let foot = add(x, surface.nearest(at, sub(*p, x)));
        if !found.iter().any(|(_, q)| norm(sub(foot, *q)) < 1e-5 * least) {
            found.push((away(&foot), foot));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let limit = found.first().map_or(0.0, |f| f.0) + slack;
    found.into_iter().take_while(|f| f.0 <= limit).map(|f| f.1).collect()
}
