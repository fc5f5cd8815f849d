//! Cutting of faces by planes.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::super::bezier::{Bezier, Path, section_tangent};
use super::super::hub_quadric::Quadric;
use super::{Brep, BrepFace, EdgeUse};

/// A plane in a hub's frame: normal · x + value = 0, with a unit normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutPlane {
    pub normal: Vec3,
    pub value: f64,
    /// Distance from the plane within which a point is on it in any case, mm.
    pub near: f64,
}

/// Distance from a plane within which a corner is on it, in lengths of the adjacent curve.
const ON_PLANE: f64 = 1e-9;

impl CutPlane {
    /// Signed distance of a point.
    pub(super) fn at(&self, x: Vec3) -> f64 {
        dot(self.normal, x) + self.value
    }

    /// The plane through a point.
    pub(super) fn through(point: Vec3, normal: Vec3) -> CutPlane {
        CutPlane { normal, value: -dot(normal, point), near: 0.0 }
    }

    /// Distance within which points of a curve are on the plane.
    fn tolerance(&self, curve: &Bezier<3>) -> f64 {
        let [p, q, r] = curve.points;
        self.near.max(ON_PLANE * (norm(sub(p, q)) + norm(sub(q, r))))
    }

    /// Whether a curve lies in the plane.
    pub(super) fn has(&self, curve: &Bezier<3>) -> bool {
        let near = self.tolerance(curve);
        curve.points.iter().all(|p| self.at(*p).abs() <= near)
    }

    /// Whether a face is on the positive side of the plane where it meets a curve of its boundary, which has the face on its
    /// left: next to the curve, if that lies in the plane.
    pub(super) fn is_face_above(&self, quadric: &Quadric, curve: &Bezier<3>) -> bool {
        let middle = curve.at(0.5);
        if self.has(curve) {
            let along = sub(curve.points[2], curve.points[0]);
            return dot(self.normal, cross(quadric.half_gradient(middle), along)) > 0.0;
        }
        self.at(middle) > 0.0
    }

    /// The parameters strictly inside a curve at which it meets the plane: those of its ends do not count.
    pub(super) fn roots(&self, curve: &Bezier<3>) -> [Option<f64>; 2] {
        let [p, q, r] = curve.points;
        let near = self.tolerance(curve);
        let [mut a, b, mut c] = [self.at(p), curve.weight * self.at(q), self.at(r)];
        for end in [&mut a, &mut c] {
            if end.abs() <= near {
                *end = 0.0;
            }
        }
        // a (1 − t)² + 2 b t (1 − t) + c t².
        let square = b * b - a * c;
        if square < 0.0 || (a == 0.0 && c == 0.0) {
            return [None; 2];
        }
        let s = -(b + square.sqrt().copysign(b));
        let inside = |t: f64| (t > ON_PLANE && t < 1.0 - ON_PLANE).then_some(t);
        let [t, u] = [inside(s / (s + c)), inside(a / (a + s))];
        if t > u { [u, t] } else { [t, u] }
    }
}

/// Where a boundary loop passes from one side of a plane to the other: at the start of a use of an edge.
#[derive(Clone, Copy)]
struct LoopCrossing {
    boundary: usize,
    index: usize,
    corner: u32,
    /// Whether the loop passes to the negative side: a section with the positive side on its left enters the face here.
    enters: bool,
}

impl Brep<'_> {
    /// Divides an edge at a parameter.
    pub(super) fn divide(&mut self, edge: u32, t: f64) {
        let of = *self.edge(edge);
        let ([p, q, r], w) = (of.curve.points, of.curve.weight);
        let between = |(p, v): (Vec3, f64), (q, w): (Vec3, f64)| {
            let weight = (1.0 - t) * v + t * w;
            (add(scale(p, (1.0 - t) * v / weight), scale(q, t * w / weight)), weight)
        };
        let (first, second) = (between((p, 1.0), (q, w)), between((q, w), (r, 1.0)));
        let (at, weight) = between(first, second);
        let corner = self.push_corner(of.hub, at);
        let [a, b] = of.ends;
        let root = weight.sqrt();
        let one = self.push_edge(of.hub, [a, corner], Bezier { points: [p, first.0, at], weight: first.1 / root });
        let two = self.push_edge(of.hub, [corner, b], Bezier { points: [at, second.0, r], weight: second.1 / root });
        self.edges[edge as usize].parts = [one, two];
    }

    /// Cuts a face by a plane in its frame, and gives the numbers of its parts; `None` if its loops cannot be followed.
    pub(super) fn cut(&mut self, face: u32, plane: &CutPlane) -> Option<Vec<u32>> {
        let BrepFace { frame, quadric, .. } = self.faces[face as usize];
        for &(edge, _) in self.loops(&self.faces[face as usize]).iter().flatten() {
            let roots = plane.roots(&self.curve((edge, true), &frame));
            match roots {
                [Some(t), Some(_)] => {
                    self.divide(edge, t);
                    let [_, rest] = self.edge(edge).parts;
                    let curve = self.curve((rest, true), &frame);
                    let u = plane.roots(&curve).into_iter().flatten().next();
                    self.divide(rest, u?);
                }
                [Some(t), None] | [None, Some(t)] => self.divide(edge, t),
                [None, None] => {}
            }
        }
        let loops = self.loops(&self.faces[face as usize]);
        let side = |of: &EdgeUse| plane.is_face_above(&quadric, &self.curve(*of, &frame));
        let sides: Vec<Vec<bool>> = loops.iter().map(|l| l.iter().map(side).collect()).collect();
        let mut crossings: Vec<LoopCrossing> = Vec::new();
        for (boundary, l) in sides.iter().enumerate() {
            for (index, above) in l.iter().enumerate() {
                if l[(index + l.len() - 1) % l.len()] != *above {
                    let corner = self.start(loops[boundary][index]);
                    crossings.push(LoopCrossing { boundary, index, corner, enters: !above });
                }
            }
        }
        if crossings.is_empty() {
            return Some(vec![face]);
        }
        // The section from each entry to its exit, as edges.
        let mut sections: Vec<Option<(usize, Vec<u32>)>> = vec![None; crossings.len()];
        for (k, from) in crossings.iter().enumerate().filter(|c| c.1.enters) {
            let at = self.corner(from.corner, &frame);
            let direction = section_tangent(&quadric, plane.normal, at);
            let path = Path::new(&quadric, plane.normal, at, direction)?;
            let others = crossings.iter().enumerate().filter(|(n, c)| *n != k && c.corner != from.corner);
            let along = others.filter_map(|(n, c)| Some((path.parameter(self.corner(c.corner, &frame))?, n)));
            let (end, to) = along.min_by(|a, b| a.0.total_cmp(&b.0))?;
            if crossings[to].enters || sections.iter().flatten().any(|s| s.0 == to) {
                return None;
            }
            // Through both corners exactly, where they are on the plane within a tolerance only.
            let by = sub(self.corner(crossings[to].corner, &frame), at);
            let normal = unit(sub(plane.normal, scale(by, dot(plane.normal, by) / dot(by, by))));
            let path = Path::new(&quadric, normal, at, section_tangent(&quadric, normal, at))?;
            let end = path.parameter(add(at, by)).unwrap_or(end);
            let curves = path.ended_at(Some(end))?.curves();
            let chain = self.push_chain(&frame, [from.corner, crossings[to].corner], &curves);
            sections[k] = Some((to, chain));
        }
        let made = parts(&loops, &crossings, &sections)?;
        self.place_parts(face, made, (&loops, &sides))
    }

    /// Replaces a face by its parts, each given with its side; loops that the plane does not cross go to the part on their
    /// side.
    fn place_parts(
        &mut self,
        face: u32,
        made: Vec<(Vec<EdgeUse>, bool)>,
        (loops, sides): (&[Vec<EdgeUse>], &[Vec<bool>]),
    ) -> Option<Vec<u32>> {
        let mut faces: Vec<(Vec<Vec<EdgeUse>>, bool)> = made.into_iter().map(|(l, above)| (vec![l], above)).collect();
        for (l, side) in loops.iter().zip(sides) {
            let above = side[0];
            if side.iter().all(|s| *s == above) {
                let mut on_side = faces.iter_mut().filter(|f| f.1 == above);
                let only = on_side.next()?;
                if on_side.next().is_some() {
                    return None;
                }
                only.0.push(l.clone());
            }
        }
        let mut numbers = Vec::with_capacity(faces.len());
        let like = self.faces[face as usize].clone();
        for (k, (loops, _)) in faces.into_iter().enumerate() {
            let part = BrepFace { loops, ..like.clone() };
            if k == 0 {
                self.faces[face as usize] = part;
                numbers.push(face);
            } else {
                numbers.push(self.faces.len() as u32);
                self.faces.push(part);
            }
        }
        Some(numbers)
    }
}

/// The loops of the parts of a face, each with its side: pieces of the old loops between crossings, joined by sections, which
/// have the positive side on their left.
fn parts(
    loops: &[Vec<EdgeUse>],
    crossings: &[LoopCrossing],
    sections: &[Option<(usize, Vec<u32>)>],
) -> Option<Vec<(Vec<EdgeUse>, bool)>> {
    let mut out = Vec::new();
    let mut used = vec![false; crossings.len()];
    for first in 0..crossings.len() {
        if used[first] {
            continue;
        }
        let above = !crossings[first].enters;
        let (mut traced, mut at) = (Vec::new(), first);
        loop {
            if std::mem::replace(&mut used[at], true) {
                return None;
            }
            let LoopCrossing { boundary, index, .. } = crossings[at];
            let l = &loops[boundary];
            // To the next crossing of this loop.
            let ahead = |c: &LoopCrossing| (c.index + l.len() - index - 1) % l.len() + 1;
            let mut on_loop = crossings.iter().enumerate().filter(|(n, c)| *n != at && c.boundary == boundary);
            let (next, _) = on_loop.by_ref().min_by_key(|(_, c)| ahead(c))?;
            traced.extend((0..ahead(&crossings[next])).map(|k| l[(index + k) % l.len()]));
            if above {
                let (to, chain) = sections[next].as_ref()?;
                traced.extend(chain.iter().map(|e| (*e, true)));
                at = *to;
            } else {
                let (from, section) =
                    sections.iter().enumerate().find(|(_, s)| s.as_ref().is_some_and(|s| s.0 == next))?;
                traced.extend(section.iter().flat_map(|s| s.1.iter().rev()).map(|e| (*e, false)));
                at = from;
            }
            if at == first {
                break;
            }
        }
        out.push((traced, above));
    }
    Some(out)
}
