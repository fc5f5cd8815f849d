//! Plane slices: loops of conic arcs, and their area in closed form.
//!
//! A plane cuts each piece of a hub along a conic. The conics are followed from where a beam is parted to where one is parted
//! again, hub by hub, and joined there: the two places in which a plane cuts a rim are computed once from the beam, so that both
//! its hubs agree. By Green's theorem the area is that of the polygon of the ends and, for each arc, that beside its chord, for
//! which there is a closed form (`Bezier::bulge`).

use std::collections::HashMap;

use rayon::prelude::*;

use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};

use super::Quadors;
use super::bezier::Bezier;

mod section;

use section::{Chain, Gate, Section};

/// A plane with axes of its own: right-handed, u × v is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Its place nearest to the origin of the world, which is the origin of (u, v), mm.
    pub origin: Vec3,
    /// The axes u and v.
    pub axes: [Vec3; 2],
    /// The normal.
    pub normal: Vec3,
}

impl Plane {
    /// The plane through a point. u is the world's x, or y where the normal is nearly x, laid into the plane: for planes of equal z
    /// (u, v) are (x, y).
    ///
    /// # Errors
    /// A normal without direction, and numbers that are not finite.
    pub fn new(point: Vec3, normal: Vec3) -> Result<Plane, Fault> {
        if !point.iter().all(|v| v.is_finite()) {
            return Err(Fault::new("point", "is not a position: give three finite numbers, mm"));
        }
        let length = norm(normal);
        if !(length > 0.0 && length.is_finite()) {
            return Err(Fault::new("normal", "has no direction: give three finite numbers, not all zero"));
        }
        let normal = scale(normal, 1.0 / length);
        let pole = if normal[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let u = unit(sub(pole, scale(normal, dot(pole, normal))));
        Ok(Plane { origin: scale(normal, dot(point, normal)), axes: [u, cross(normal, u)], normal })
    }

    /// The place in space.
    pub fn place(&self, [u, v]: [f64; 2]) -> Vec3 {
        add(self.origin, add(scale(self.axes[0], u), scale(self.axes[1], v)))
    }

    /// (u, v) of what lies beneath or above it.
    pub fn flat(&self, x: Vec3) -> [f64; 2] {
        [dot(x, self.axes[0]), dot(x, self.axes[1])]
    }

    fn moved(&self, by: f64) -> Plane {
        Plane { origin: add(self.origin, scale(self.normal, by)), ..*self }
    }
}

/// An arc of a slice: part of one conic.
#[derive(Clone, Debug, PartialEq)]
pub struct Arc {
    /// The hub it belongs to.
    pub hub: u32,
    /// The stubs of the hub that shape it, a bit for each.
    pub stubs: u64,
    /// a, b, c, d, e, f of a u² + 2 b u v + c v² + 2 d u + 2 e v + f = 0, negative in the solid, with u and v from `about`.
    pub conic: [f64; 6],
    /// The hub's centre, laid into the plane.
    pub about: [f64; 2],
    /// The arc, in curves of less than a third of an ellipse, one after the other.
    pub curves: Vec<Bezier<2>>,
}

/// Where a plane cuts a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The plane.
    pub plane: Plane,
    /// How far the plane was moved along its normal, mm: zero but where it touches the surface without cutting it.
    pub moved: f64,
    /// Closed loops, the solid to the left of each; an arc begins where the one before it ends, to the bit.
    pub loops: Vec<Vec<Arc>>,
    /// The solid's area, mm².
    pub area: f64,
    /// Hubs that were looked at.
    pub hubs: usize,
}

impl Slice {
    /// The loops as polygons that are no further than `chord` from them, mm; the last place is not the first again.
    pub fn polygons(&self, chord: f64) -> Vec<Vec<[f64; 2]>> {
        let polygon = |arcs: &Vec<Arc>| {
            let mut out = Vec::new();
            for c in arcs.iter().flat_map(|a| &a.curves) {
                c.draw(chord, &mut out);
            }
            out
        };
        self.loops.par_iter().map(polygon).collect()
    }
}

/// The signed area of a loop: about its first place, so that a loop far from the origin keeps its digits.
fn area(arcs: &[Arc]) -> f64 {
    let Some(o) = arcs.first().and_then(|a| a.curves.first()).map(|c| c.points[0]) else {
        return 0.0;
    };
    let twice = |c: &Bezier<2>| {
        let [p, _, r] = c.points;
        (p[0] - o[0]) * (r[1] - o[1]) - (p[1] - o[1]) * (r[0] - o[0]) + c.bulge()
    };
    arcs.iter().flat_map(|a| &a.curves).map(twice).sum::<f64>() / 2.0
}

/// How far a plane is moved that touches the surface, in typical radii: by as little as is told apart.
const MOVES: [f64; 5] = [0.0, 1e-9, -1e-9, 1e-8, -1e-8];

impl Quadors {
    /// The slice by a plane: exact up to rounding, fillets included. Hubs that the plane does not reach are not looked at.
    ///
    /// A plane that touches the surface without cutting it there (or along a line in which it lies) has no clear inside: it is moved by
    /// a billionth of the typical radius of a beam, and `moved` tells. Beams must not meet but in hubs.
    ///
    /// # Errors
    /// Beams of these hubs that overlap too far for closed forms, and hubs of more than 64 beams.
    pub fn slice(&self, plane: &Plane) -> Result<Slice, Fault> {
        let mut worst = 0;
        for share in MOVES {
            let by = share * self.scale;
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
                        // Of nothing the sum is −0.
                        area: area.iter().sum::<f64>() + 0.0,
                        loops,
                        hubs: hubs.len(),
                    });
                }
                Err(hub) => worst = hub,
            }
        }
        Err(Fault::new(
            format!("hubs[{worst}]"),
            format!(
                "the plane touches its surface so closely that in and out cannot be told, and neither do planes {} mm beside it: move \
             the plane",
                number(1e-8 * self.scale)
            ),
        ))
    }

    /// The hubs whose boxes a plane reaches, in order.
    fn hubs_at(&self, plane: &Plane, level: f64) -> Vec<u32> {
        let reached = |b: &Aabb| {
            let half = scale(b.size(), 0.5);
            let reach = (0..3).map(|a| half[a] * plane.normal[a].abs()).sum::<f64>();
            (dot(b.center(), plane.normal) - level).abs() <= reach
        };
        let mut near = self.index.across(plane.normal, level);
        near.retain(|i| reached(&self.balls[*i as usize].bounds));
        near
    }

    /// What forbids a closed form at a hub.
    fn overlap(&self, hub: usize) -> Option<Fault> {
        let first = self.overlaps.partition_point(|o| o.hub < hub);
        let o = self.overlaps.get(first).filter(|o| o.hub == hub);
        if let Some(o) = o {
            return Some(Fault::new(
                format!("hubs[{hub}]"),
                format!(
                    "beams {} and {} leave it so close together that they still overlap halfway along: there is no closed form for \
                     that; make them thinner, merge them, or use the field",
                    o.beams[0], o.beams[1]
                ),
            ));
        }
        let n = self.hub(hub).stubs.len();
        (n > 64).then(|| {
            Fault::new(
                format!("hubs[{hub}]"),
                format!("{} meet in it: closed forms are made for up to 64", counted(n, "beam")),
            )
        })
    }

    /// Where a plane cuts the rim of a stub, about the stub's hub: from what is known of the beam alone, so that both hubs agree.
    fn gate(&self, hub: usize, stub: usize, plane: &Plane, level: f64) -> Gate {
        let s = &self.hub(hub).stubs[stub];
        let (p, ends) = (&self.pencils[s.beam as usize], self.ends[s.beam as usize]);
        let along = sub(self.balls[ends[1] as usize].center, self.balls[ends[0] as usize].center);
        let axis = scale(along, 1.0 / p.length);
        let n = plane.normal;
        let away = dot(n, self.balls[ends[0] as usize].center) + p.split() * dot(n, axis) - level;
        let side = cross(n, axis);
        let sine = norm(side);
        let toward = if s.end == 0 { 1.0 } else { -1.0 };
        if sine < 1e-9 {
            // All of the plane is before the split or beyond it; the first hub has what lies in it.
            let before = (-away * dot(n, axis)).total_cmp(&0.0).is_le();
            return Gate::Apart(before == (s.end == 0));
        }
        let side = scale(side, 1.0 / sine);
        let half = p.squared(p.split()) - (away / sine) * (away / sine);
        let center = add(scale(s.axis, s.split), scale(cross(axis, side), -away / sine));
        if half > 0.0 {
            let half = scale(side, half.sqrt() * toward);
            Gate::Open([add(center, half), sub(center, half)])
        } else {
            Gate::Shut
        }
    }

    /// What a plane cuts out of a hub; `None` where that cannot be told.
    fn section(&self, hub: usize, plane: &Plane, level: f64) -> Option<Vec<Chain>> {
        let of = self.hub(hub);
        let gates: Vec<Gate> = (0..of.stubs.len()).map(|i| self.gate(hub, i, plane, level)).collect();
        let b = self.balls[hub].bounds;
        let reach = norm(b.size());
        let height = level - dot(plane.normal, self.center(hub));
        // Another, larger shift is another chance where two events fell within rounding.
        (0..4).find_map(|seed| Section::new(&of, plane, height, reach, &gates, seed).run())
    }
}

/// Joins what was cut out of hubs where their beams are parted; the hub where it fails.
fn join(plane: &Plane, quadors: &Quadors, hubs: &[u32], cut: Vec<Vec<Chain>>) -> Result<Vec<Vec<Arc>>, usize> {
    let stub = |h: usize, i: u32| {
        let s = &quadors.hub(hubs[h] as usize).stubs[i as usize];
        (s.beam, s.end)
    };
    // Chains by the rim that they come from.
    let mut from: HashMap<(u32, usize), (usize, usize)> = HashMap::new();
    for (h, chains) in cut.iter().enumerate() {
        for (c, chain) in chains.iter().enumerate() {
            if let Some([start, _]) = chain.rims {
                from.insert(stub(h, start), (h, c));
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
            let (mut at, first) = (h, chain.rims.map(|r| stub(h, r[0])));
            loop {
                let about = plane.flat(quadors.center(hubs[at] as usize));
                for a in chain.arcs {
                    arcs.push(a.laid(hubs[at], about, plane));
                }
                let Some([_, exit]) = chain.rims else { break };
                let (beam, end) = stub(at, exit);
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

/// Makes each curve begin where the one before it ended; `None` if that is not there but for rounding.
fn close(arcs: &mut [Arc], slack: f64) -> Option<()> {
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
