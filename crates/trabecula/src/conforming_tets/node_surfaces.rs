//! Sets of implicit surfaces, and the positions that lie on all surfaces of a set.

use crate::implicit::Surface;
use geometry::math::{Vec3, add, cross, dot, inverse, norm, scale, sub};

/// Most surfaces of a solid.
pub(crate) const MOST: usize = 127;
/// The set of nodes that stay where they are: where tetrahedra were removed, the boundary follows no surface.
pub(crate) const HELD: SurfaceSet = 1 << MOST;
/// Newton steps.
const STEPS: usize = 12;
/// Greatest distance from a surface left out for its dependent gradient, as a fraction of the reach.
const OFF: f64 = 2e-3;

/// A set of surfaces, one bit for each number.
pub(crate) type SurfaceSet = u128;

/// The set of one surface.
pub(crate) fn only(surface: usize) -> SurfaceSet {
    1 << surface
}

/// The numbers of a set, ascending.
pub(crate) fn members(mut set: SurfaceSet) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let next = set.trailing_zeros() as usize;
        set &= set.wrapping_sub(1);
        (next < MOST).then_some(next)
    })
}

/// A set without planes that are the same as an earlier one: those of boxes that touch or overlap.
pub(crate) fn distinct(surfaces: &[Surface], set: SurfaceSet) -> SurfaceSet {
    let plane = |i: usize| surfaces[i].plane.map(|p| (p.axis, p.at));
    let again = |i: usize, kept| plane(i).is_some_and(|p| members(kept).any(|j| plane(j) == Some(p)));
    members(set).fold(set & HELD, |kept, i| if again(i, kept) { kept } else { kept | only(i) })
}

/// Values and gradients of the surfaces of a set, at most three, at a point. Of a plane normal to an axis they are exact.
fn sampled(surfaces: &[Surface], set: SurfaceSet, p: Vec3) -> ([(f64, Vec3); 3], usize) {
    let (mut out, mut count) = ([(0.0, [0.0; 3]); 3], 0);
    for i in members(set).take(3) {
        out[count] = match surfaces[i].plane {
            Some(plane) => {
                let mut g = [0.0; 3];
                g[plane.axis] = if plane.below { 1.0 } else { -1.0 };
                (g[plane.axis] * (p[plane.axis] - plane.at), g)
            }
            None => {
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                surfaces[i].field.gradients(&[p], &mut v, &mut g);
                (v[0], g[0])
            }
        };
        count += 1;
    }
    (out, count)
}

/// The shortest displacement with g · d = wanted for each of up to three gradients; those nearly dependent on earlier ones are
/// left out, as of surfaces that coincide.
fn shortest(of: &[(f64, Vec3)]) -> Option<Vec3> {
    /// Least sine squared, or volume, of unit gradients.
    const LEAST: f64 = 0.05;
    let mut kept: Vec<(f64, Vec3)> = Vec::with_capacity(3);
    for (wanted, g) in of {
        let length = norm(*g);
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let (w, n) = (wanted / length, scale(*g, 1.0 / length));
        let independent = match kept[..] {
            [] => true,
            [(_, m)] => 1.0 - dot(m, n).powi(2) > LEAST,
            [(_, l), (_, m)] => dot(cross(l, m), n).abs() > LEAST,
            _ => false,
        };
        if independent {
            kept.push((w, n));
        }
    }
    Some(match kept[..] {
        [(w, n)] => scale(n, w),
        [(a, m), (b, n)] => {
            let c = dot(m, n);
            let s = 1.0 - c * c;
            add(scale(m, (a - c * b) / s), scale(n, (b - c * a) / s))
        }
        [(a, l), (b, m), (c, n)] => geometry::math::apply(&inverse(&[l, m, n]), [a, b, c]),
        _ => [0.0; 3],
    })
}

/// Coordinates at planes normal to an axis made exact.
fn exact(surfaces: &[Surface], set: SurfaceSet, mut p: Vec3) -> Vec3 {
    for plane in members(set).filter_map(|i| surfaces[i].plane) {
        p[plane.axis] = plane.at;
    }
    p
}

/// The position on all surfaces of a set near `p`, by Newton's method with shortest steps; `None` if it is farther than
/// `reach` (mm) from `p`, or there are more than three surfaces.
pub(crate) fn onto(surfaces: &[Surface], set: SurfaceSet, p: Vec3, reach: f64) -> Option<Vec3> {
    let set = distinct(surfaces, set);
    if set.count_ones() > 3 || set & HELD != 0 {
        return None;
    }
    let mut q = exact(surfaces, set, p);
    for _ in 0..STEPS {
        let (mut of, n) = sampled(surfaces, set, q);
        of[..n].iter_mut().for_each(|v| v.0 = -v.0);
        let step = shortest(&of[..n])?;
        q = exact(surfaces, set, add(q, step));
        let moved = norm(sub(q, p));
        if moved.is_nan() || moved > reach {
            return None;
        }
        if norm(step) <= 1e-11 * reach {
            let (of, n) = sampled(surfaces, set, q);
            return of[..n].iter().all(|(v, g)| v.abs() <= OFF * reach * norm(*g)).then_some(q);
        }
    }
    None
}

/// The part of a displacement that is tangent to all surfaces of a set at `p`.
pub(crate) fn tangent(surfaces: &[Surface], set: SurfaceSet, p: Vec3) -> Tangent {
    if set & HELD != 0 {
        return Tangent::Fixed;
    }
    let (of, n) = sampled(surfaces, set, p);
    let unit = |g: Vec3| {
        let l = norm(g);
        if l > 0.0 { scale(g, 1.0 / l) } else { g }
    };
    match n {
        0 => Tangent::Free,
        1 => Tangent::Plane(unit(of[0].1)),
        2 => Tangent::Line(unit(cross(of[0].1, of[1].1))),
        _ => Tangent::Fixed,
    }
}

/// The directions in which a node may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Tangent {
    /// All.
    Free,
    /// Those normal to this.
    Plane(Vec3),
    /// Along this.
    Line(Vec3),
    /// None.
    Fixed,
}

impl Tangent {
    /// The tangent part of a displacement.
    pub fn part(self, d: Vec3) -> Vec3 {
        match self {
            Tangent::Free => d,
            Tangent::Plane(n) => sub(d, scale(n, dot(d, n))),
            Tangent::Line(t) => scale(t, dot(d, t)),
            Tangent::Fixed => [0.0; 3],
        }
    }
}

/// The displacement of a node on a set of surfaces by given distances (mm) along their gradients; nothing along those without.
pub(crate) fn balanced(surfaces: &[Surface], set: SurfaceSet, p: Vec3, wanted: &[(usize, f64)]) -> Option<Vec3> {
    if set & HELD != 0 || set.count_ones() > 3 {
        return None;
    }
    let (mut of, n) = sampled(surfaces, set, p);
    for (i, s) in members(set).take(3).enumerate() {
        let by = wanted.iter().find(|w| w.0 == s).map_or(0.0, |w| w.1);
        of[i].0 = by * norm(of[i].1);
    }
    let planes = members(set).filter_map(|i| surfaces[i].plane);
    let mut by = shortest(&of[..n])?;
    planes.for_each(|plane| by[plane.axis] = 0.0);
    Some(by)
}
