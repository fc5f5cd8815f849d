//! Plane slices: loops of conic arcs, and their area in closed form.
//!
//! A plane cuts each piece of a hub in a conic. The conics are followed hub by hub from end circle to end circle and
//! joined there: the two points in which the plane cuts an end circle are computed once from the beam, so that both
//! hubs agree. By Green's theorem the area is that of the polygon of arc ends plus, for each arc, the segment between
//! arc and chord, which has a closed form (`Bezier::segment_area_twice`).

use std::collections::HashMap;

use rayon::prelude::*;

use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};

use super::Quadors;
use super::bezier::Bezier;

mod section;

use section::{Chain, DiscSection, Section};

/// A plane with coordinates (u, v): right-handed, u × v is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlicePlane {
    /// The point of the plane nearest to the world origin, mm; the origin of (u, v).
    pub origin: Vec3,
    /// Unit vectors along u and v.
    pub axes: [Vec3; 2],
    /// Unit normal.
    pub normal: Vec3,
}

impl SlicePlane {
    /// The plane through a point (mm). u is the projection of the x axis, or of the y axis if the normal is close to x:
    /// for planes of constant z, (u, v) are (x, y).
    ///
    /// # Errors
    /// A zero normal, and numbers that are not finite.
    pub fn new(point: Vec3, normal: Vec3) -> Result<SlicePlane, Fault> {
        if !point.iter().all(|v| v.is_finite()) {
            return Err(Fault::new("point", format!("position must be three finite numbers (mm), found {point:?}")));
        }
        let length = norm(normal);
        if !(length > 0.0 && length.is_finite()) {
            return Err(Fault::new(
                "normal",
                format!("normal must be three finite numbers, not all zero, found {normal:?}"),
            ));
        }
        let normal = scale(normal, 1.0 / length);
        let pole = if normal[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let u = unit(sub(pole, scale(normal, dot(pole, normal))));
        Ok(SlicePlane { origin: scale(normal, dot(point, normal)), axes: [u, cross(normal, u)], normal })
    }

    /// The position in space of (u, v), mm.
    pub fn point_at(&self, [u, v]: [f64; 2]) -> Vec3 {
        add(self.origin, add(scale(self.axes[0], u), scale(self.axes[1], v)))
    }

    /// (u, v) of the projection of a point, mm.
    pub fn project(&self, x: Vec3) -> [f64; 2] {
        [dot(x, self.axes[0]), dot(x, self.axes[1])]
    }

    pub(super) fn moved(&self, by: f64) -> SlicePlane {
        SlicePlane { origin: add(self.origin, scale(self.normal, by)), ..*self }
    }
}

/// An arc of a slice: part of one conic.
#[derive(Clone, Debug, PartialEq)]
pub struct ConicArc {
    /// Index of the hub.
    pub hub: u32,
    /// The active half-beams of the hub, as a bit mask.
    pub half_beams: u64,
    /// a, b, c, d, e, f of a u² + 2 b u v + c v² + 2 d u + 2 e v + f = 0, negative in the solid, with u and v relative
    /// to `about`.
    pub conic: [f64; 6],
    /// The projection of the hub's centre, mm.
    pub about: [f64; 2],
    /// The arc as consecutive Bézier curves, each less than a third of an ellipse.
    pub curves: Vec<Bezier<2>>,
}

/// The intersection of a plane and a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The plane, after displacement.
    pub plane: SlicePlane,
    /// Displacement of the plane along its normal, mm: 0 unless the plane touches the surface without cutting it.
    pub moved: f64,
    /// Closed loops with the solid on their left; each arc starts where the one before it ends, to the last bit.
    pub loops: Vec<Vec<ConicArc>>,
    /// Area of the solid, mm².
    pub area: f64,
    /// Number of hubs examined.
    pub hubs: usize,
}

impl Slice {
    /// The loops as polygons within `chord` (mm) of them; the first point is not repeated.
    pub fn polygons(&self, chord: f64) -> Vec<Vec<[f64; 2]>> {
        let polygon = |arcs: &Vec<ConicArc>| {
            let mut out = Vec::new();
            for c in arcs.iter().flat_map(|a| &a.curves) {
                c.flatten(chord, &mut out);
            }
            out
        };
        self.loops.par_iter().map(polygon).collect()
    }
}

/// The signed area of a loop, relative to its first point, which preserves digits far from the origin.
fn area(arcs: &[ConicArc]) -> f64 {
    let Some(o) = arcs.first().and_then(|a| a.curves.first()).map(|c| c.points[0]) else {
        return 0.0;
    };
    arcs.iter().flat_map(|a| &a.curves).map(|c| c.swept_area_twice(o)).sum::<f64>() / 2.0
}

/// Displacements tried for a plane that touches the surface, in typical radii: as small as can be resolved.
pub(super) const DISPLACEMENTS: [f64; 5] = [0.0, 1e-9, -1e-9, 1e-8, -1e-8];

impl Quadors {
    /// The slice by a plane, fillets included; exact up to rounding. Hubs that the plane does not reach are not
    /// examined.
    ///
    /// Where a plane touches the surface without cutting it, inside and outside are undefined on the plane. The plane
    /// is then displaced by about 1e-9 typical radii, as `moved` reports. Valid only if beams meet in hubs alone.
    ///
    /// # Errors
    /// Beams of these hubs that overlap too far for closed forms, and hubs of more than 64 beams.
    pub fn slice(&self, plane: &SlicePlane) -> Result<Slice, Fault> {
        let mut failed = 0;
        for fraction in DISPLACEMENTS {
            let by = fraction * self.scale;
            let at = plane.moved(by);
            let level = dot(at.origin, at.normal);
            let hubs = self.hubs_at(&at, level);
            if let Some(o) = hubs.iter().find_map(|h| self.overlap(*h as usize)) {
                return Err(o);
            }
            let cut: Result<Vec<Vec<Chain>>, usize> =
                hubs.par_iter().map(|&h| self.section(h as usize, &at, level).ok_or(h as usize)).collect();
            let joined = cut.and_then(|cut| join(&at, self, &hubs, cut));
            match joined {
                Ok(loops) => {
                    let area = loops.par_iter().map(|l| area(l)).collect::<Vec<_>>();
                    return Ok(Slice {
                        plane: at,
                        moved: by,
                        // The empty sum is −0.
                        area: area.iter().sum::<f64>() + 0.0,
                        loops,
                        hubs: hubs.len(),
                    });
                }
                Err(hub) => failed = hub,
            }
        }
        Err(Fault::new(
            format!("hubs[{failed}]"),
            format!(
                "the plane is tangent to the surface of this hub, also displaced by {} mm, so that inside and outside are \
                 undefined: move the plane",
                number(1e-8 * self.scale)
            ),
        ))
    }

    /// The hubs whose bounds the plane reaches, sorted.
    fn hubs_at(&self, plane: &SlicePlane, level: f64) -> Vec<u32> {
        let reached = |b: &Aabb| {
            let half = scale(b.size(), 0.5);
            let reach = (0..3).map(|a| half[a] * plane.normal[a].abs()).sum::<f64>();
            (dot(b.center(), plane.normal) - level).abs() <= reach
        };
        let mut near = self.index.across(plane.normal, level);
        near.retain(|i| reached(&self.balls[*i as usize].bounds));
        near
    }

    /// Why a hub has no closed form, if it has none.
    fn overlap(&self, hub: usize) -> Option<Fault> {
        let first = self.overlaps.partition_point(|o| o.hub < hub);
        let o = self.overlaps.get(first).filter(|o| o.hub == hub);
        if let Some(o) = o {
            return Some(Fault::new(
                format!("hubs[{hub}]"),
                format!(
                    "beams {} and {} overlap at mid length, so there is no closed form: make them thinner, merge them, or use \
                     the field",
                    o.beams[0], o.beams[1]
                ),
            ));
        }
        let n = self.hub(hub).half_beams.len();
        (n > 64).then(|| {
            Fault::new(
                format!("hubs[{hub}]"),
                format!("the hub has {}; closed forms support at most 64", counted(n, "beam")),
            )
        })
    }

    /// The intersection of a plane and the end circle of a half-beam, relative to its hub; computed from the beam
    /// alone, so that both hubs agree.
    fn disc_section(&self, hub: usize, half_beam: usize, plane: &SlicePlane, level: f64) -> DiscSection {
        let s = &self.hub(hub).half_beams[half_beam];
        let (p, ends) = (&self.pencils[s.beam as usize], self.ends[s.beam as usize]);
        let along = sub(self.balls[ends[1] as usize].center, self.balls[ends[0] as usize].center);
        let axis = scale(along, 1.0 / p.length);
        let n = plane.normal;
        let away = dot(n, self.balls[ends[0] as usize].center) + p.split() * dot(n, axis) - level;
        let side = cross(n, axis);
        let sine = norm(side);
        let toward = if s.end == 0 { 1.0 } else { -1.0 };
        if sine < 1e-9 {
            // The whole plane lies before the split plane or past it; the disc itself belongs to the first hub.
            let before = (-away * dot(n, axis)).total_cmp(&0.0).is_le();
            return DiscSection::Parallel(before == (s.end == 0));
        }
        let side = scale(side, 1.0 / sine);
        let half = p.radius_squared(p.split()) - (away / sine) * (away / sine);
        let center = add(scale(s.axis, s.split), scale(cross(axis, side), -away / sine));
        if half > 0.0 {
            let half = scale(side, half.sqrt() * toward);
            DiscSection::Crossed([add(center, half), sub(center, half)])
        } else {
            DiscSection::Missed
        }
    }

    /// The intersection of a plane and a hub's part; `None` if it cannot be resolved.
    fn section(&self, hub: usize, plane: &SlicePlane, level: f64) -> Option<Vec<Chain>> {
        let of = self.hub(hub);
        let disc_sections: Vec<DiscSection> =
            (0..of.half_beams.len()).map(|i| self.disc_section(hub, i, plane, level)).collect();
        let b = self.balls[hub].bounds;
        let reach = norm(b.size());
        let height = level - dot(plane.normal, self.center(hub));
        // A different, larger perturbation may separate events that coincided within rounding.
        (0..4).find_map(|seed| Section::new(&of, plane, height, reach, &disc_sections, seed).run())
    }
}

/// Joins the sections of hubs at their end circles; the error is the hub at which it fails.
fn join(
    plane: &SlicePlane,
    quadors: &Quadors,
    hubs: &[u32],
    cut: Vec<Vec<Chain>>,
) -> Result<Vec<Vec<ConicArc>>, usize> {
    let half_beam = |h: usize, i: u32| {
        let s = &quadors.hub(hubs[h] as usize).half_beams[i as usize];
        (s.beam, s.end)
    };
    // Chains by the end circle at which they start.
    let mut from: HashMap<(u32, usize), (usize, usize)> = HashMap::new();
    for (h, chains) in cut.iter().enumerate() {
        for (c, chain) in chains.iter().enumerate() {
            if let Some([start, _]) = chain.ends {
                from.insert(half_beam(h, start), (h, c));
            }
        }
    }
    let mut cut: Vec<Vec<Option<Chain>>> = cut.into_iter().map(|c| c.into_iter().map(Some).collect()).collect();
    let mut out = Vec::new();
    for h in 0..cut.len() {
        for c in 0..cut[h].len() {
            let Some(mut chain) = cut[h][c].take() else {
                continue;
            };
            let mut arcs = Vec::new();
            let (mut at, first) = (h, chain.ends.map(|r| half_beam(h, r[0])));
            loop {
                let about = plane.project(quadors.center(hubs[at] as usize));
                for a in chain.arcs {
                    arcs.push(a.in_plane(hubs[at], about, plane));
                }
                let Some([_, exit]) = chain.ends else { break };
                let (beam, end) = half_beam(at, exit);
                let next = (beam, 1 - end);
                if Some(next) == first {
                    break;
                }
                let &(to, c) = from.get(&next).ok_or(hubs[at] as usize)?;
                chain = cut[to][c].take().ok_or(hubs[to] as usize)?;
                at = to;
            }
            close(&mut arcs, 1e-8 * quadors.scale).ok_or(hubs[h] as usize)?;
            out.push(arcs);
        }
    }
    Ok(out)
}

/// Snaps the start of each curve to the end of the one before it; `None` if they differ by more than rounding.
fn close(arcs: &mut [ConicArc], slack: f64) -> Option<()> {
    let mut before = arcs.last()?.curves.last()?.points[2];
    for c in arcs.iter_mut().flat_map(|a| &mut a.curves) {
        let gap = (c.points[0][0] - before[0]).hypot(c.points[0][1] - before[1]);
        if gap.is_nan() || gap > slack {
            return None;
        }
        c.points[0] = before;
        before = c.points[2];
    }
    Some(())
}

#[cfg(test)]
mod tests;
