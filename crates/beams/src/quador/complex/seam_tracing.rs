//! Tracing of the seams of a hub.
//!
//! From a vertex the next event along a conic is the smallest root of a few quadratics, so the whole complex is found
//! by following seams. Symmetric hubs have several events at one point. The G of each half-beam is therefore perturbed,
//! for the planes alone, by its own multiple of 1e-12 of the radius, which separates events; arcs shorter than that are
//! collapsed afterwards. Pieces are tangent along a seam, so a seam displaced by δ is off the surface by O(δ²).

use std::rc::Rc;

use geometry::math::{Vec3, add, apply, cross, dot, inverse, norm, scale, sub, unit};

use super::super::affine_function::AffineFunction;
use super::super::conic::Conic;
use super::super::hub::{HalfBeam, Hub};
use super::super::hub_quadric::{Quadric, QuadricPiece, piece};
use super::{COLLAPSE_LENGTH, Complex, Key, NONE, QuadricFace, SeamArc, Vertex};

/// Size of the perturbation, in hub radii.
const PERTURBATION: f64 = 2e-12;

/// The perturbation of a half-beam, in hub radii: a pseudo-random number that increases with the seed, such that no small sum of them
/// vanishes in a symmetric hub.
pub(in crate::quador) fn perturbation(half_beam: usize, seed: u64) -> f64 {
    let hash = (half_beam as u64 + 1 + 97 * seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let hash = (hash ^ hash >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let hash = (hash ^ hash >> 32).wrapping_mul(0x94D0_49BB_1331_11EB);
    let unit = (hash >> 11) as f64 / (1u64 << 53) as f64;
    PERTURBATION * (8f64.powi(seed as i32) * (0.5 + unit))
}

pub(super) struct SeamTracer<'a> {
    hub: &'a Hub<'a>,
    /// Perturbed G of the half-beams.
    g: Vec<AffineFunction>,
    vertices: Vec<Vertex>,
    arcs: Vec<SeamArc>,
    /// Arcs incident to each vertex.
    at: Vec<[u32; 4]>,
    pieces: Vec<(u64, Rc<QuadricPiece>)>,
}

impl<'a> SeamTracer<'a> {
    pub(super) fn new(hub: &'a Hub<'a>, seed: u64) -> SeamTracer<'a> {
        let shifted =
            |(i, s): (usize, &HalfBeam)| AffineFunction { a: s.g.a, b: s.g.b + perturbation(i, seed) * hub.radius };
        SeamTracer {
            hub,
            g: hub.half_beams.iter().enumerate().map(shifted).collect(),
            vertices: Vec::new(),
            arcs: Vec::new(),
            at: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// The piece of a label, with the planes of the perturbed G.
    fn piece(&mut self, label: u64) -> Rc<QuadricPiece> {
        if let Some((_, known)) = self.pieces.iter().find(|p| p.0 == label) {
            return known.clone();
        }
        let made = Rc::new(piece(self.hub, label, &|i| self.g[i]));
        self.pieces.push((label, made.clone()));
        made
    }

    fn quadric(&mut self, label: u64) -> Quadric {
        self.piece(label).quadric
    }

    fn sharp_g(&self, label: u64) -> AffineFunction {
        if label == 0 { AffineFunction::default() } else { self.g[label.trailing_zeros() as usize] }
    }

    /// The plane between two labels, positive on the side of the larger.
    fn plane(&mut self, [a, b]: [u64; 2]) -> AffineFunction {
        if self.hub.sharp() {
            return self.sharp_g(b).plus(-1.0, &self.sharp_g(a));
        }
        self.piece(a).toggles[(a ^ b).trailing_zeros() as usize]
    }

    /// Calls `f` with every event that can end the seam between labels a < b, and the function that is negative before
    /// it.
    fn guards(&mut self, [a, b]: [u64; 2], f: &mut impl FnMut(u64, AffineFunction)) {
        let n = self.hub.half_beams.len();
        if self.hub.sharp() {
            let own = self.sharp_g(b);
            for m in (0..n).map(|i| 1 << i).chain([0]) {
                if m != a && m != b {
                    f(m, self.sharp_g(m).plus(-1.0, &own));
                }
            }
            return;
        }
        for (m, &toggle) in self.piece(a).toggles.iter().enumerate() {
            let bit = 1u64 << m;
            if a & bit != 0 {
                f(bit, AffineFunction::default().plus(-1.0, &toggle));
            } else if b & bit == 0 {
                f(bit, toggle);
            }
        }
    }

    /// The labels around the end of seam [a, b] at event m.
    fn labels_around(&self, [a, b]: [u64; 2], m: u64) -> [u64; 4] {
        if self.hub.sharp() {
            let mut l = [a, b, m];
            l.sort_unstable();
            return [l[0], l[1], l[2], u64::MAX];
        }
        let (j, low) = (a ^ b, a & !m);
        let (j, m) = (j.min(m), j.max(m));
        [low, low | j, low | j | m, low | m]
    }

    /// The seams that leave a vertex, as pairs of labels a < b, each with the event at this vertex.
    fn seams(&self, labels_around: [u64; 4]) -> impl Iterator<Item = ([u64; 2], u64)> + use<> {
        let [p, q, r, s] = labels_around;
        let order = |a: u64, b: u64| [a.min(b), a.max(b)];
        let all = if self.hub.sharp() {
            [(order(p, q), r), (order(q, r), p), (order(p, r), q), ([0, 0], 0)]
        } else {
            [(order(p, q), p ^ s), (order(q, r), p ^ q), (order(s, r), p ^ q), (order(p, s), p ^ q)]
        };
        // At a vertex with fillets, seams across which j changes end by m and conversely.
        let (j, m) = (p ^ q, p ^ s);
        let sharp = self.hub.sharp();
        all.into_iter()
            .filter(|(l, _)| l[0] != l[1])
            .map(move |(l, e)| if sharp { (l, e) } else { (l, if l[0] ^ l[1] == j { m } else { j }) })
    }

    /// Follows the seam between two labels from a point along a direction: the conic up to its end, and the event
    /// there.
    fn trace(
        &mut self,
        labels: [u64; 2],
        from: Vec3,
        tangent: Vec3,
        born: Option<u64>,
    ) -> Option<(Conic, Option<u64>)> {
        let quadric = self.quadric(labels[0]);
        let plane = self.plane(labels);
        let mut conic = Conic::new(&quadric, unit(plane.a), from, tangent)?;
        let mut event = None;
        let (probe, mut end) = (conic, f64::NEG_INFINITY);
        self.guards(labels, &mut |m, f| {
            let along = [f.at(from), dot(f.a, probe.e[0]), dot(f.a, probe.e[1])];
            let cot = probe.first_root_cotangent(along, born == Some(m));
            if cot > end {
                (end, event) = (cot, Some(m));
            }
        });
        let open = conic.asymptote_cotangent();
        if open >= end && open.is_finite() {
            return None;
        }
        if event.is_some() {
            conic.end = 1f64.atan2(end);
        }
        Some((conic, event))
    }

    /// The vertex with these labels nearest to a position; created if new.
    fn vertex(&mut self, labels_around: [u64; 4], near: Vec3) -> Option<u32> {
        let (j, m) =
            if self.hub.sharp() { (labels_around[1], labels_around[2]) } else { (labels_around[1], labels_around[3]) };
        let base = labels_around[0];
        let quadric = self.quadric(base);
        let order = |a: u64, b: u64| [a.min(b), a.max(b)];
        let planes = [self.plane(order(base, j)), self.plane(order(base, m))];
        let mut at = near;
        for _ in 0..3 {
            let slope = scale(quadric.half_gradient(at), 2.0);
            let rows = [planes[0].a, planes[1].a, slope];
            let step = apply(&inverse(&rows), [planes[0].at(at), planes[1].at(at), quadric.at(at)]);
            if !step.iter().all(|v| v.is_finite()) {
                return None;
            }
            at = sub(at, step);
            // Newton's method converges quadratically: the rest is below rounding.
            if dot(step, step) < 1e-20 * dot(at, at) {
                break;
            }
        }
        if norm(sub(at, near)) > 1e-5 * (norm(near) + self.hub.radius) {
            return None;
        }
        let far = dot(quadric.half_gradient(at), cross(planes[0].a, planes[1].a)) > 0.0;
        let key = Key { labels_around, far };
        if let Some(i) = self.vertices.iter().position(|v| v.key == key) {
            return Some(i as u32);
        }
        self.vertices.push(Vertex { at, key });
        self.at.push([NONE; 4]);
        Some(self.vertices.len() as u32 - 1)
    }

    fn push(&mut self, ends: [u32; 2], labels: [u64; 2], conic: Conic) {
        let plane = self.plane(labels);
        let outward = self.quadric(labels[0]).half_gradient(conic.v);
        let left = dot(plane.a, cross(outward, conic.e[0]));
        let labels = if left > 0.0 { [labels[1], labels[0]] } else { labels };
        let id = self.arcs.len() as u32;
        self.arcs.push(SeamArc { ends, labels, conic, plane });
        let distinct = if ends[0] == ends[1] { &ends[..1] } else { &ends };
        for &v in distinct {
            if let Some(slot) = self.at.get_mut(v as usize).and_then(|s| s.iter_mut().find(|s| **s == NONE)) {
                *slot = id;
            }
        }
    }

    /// A point on the seam that bounds the face of one half-beam alone, and the labels there: the last event before the
    /// split plane along a meridian.
    fn seed_point(&mut self, i: usize) -> Option<([u64; 2], Vec3)> {
        let s = self.hub.half_beams[i];
        let own = 1u64 << i;
        let piece = self.piece(own);
        let side = unit(cross(s.axis, if s.axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
        // An arbitrary azimuth that avoids the symmetry planes of symmetric hubs.
        let (sin, cos) = 0.737_f64.sin_cos();
        let side = add(scale(side, cos), scale(cross(s.axis, side), sin));
        let place = |z: f64| add(scale(s.axis, z), scale(side, s.radius_squared(z).max(0.0).sqrt()));
        let mut best = (s.contact, [0, own]);
        let (a, b, c) = (s.meridian[0], s.meridian[1], s.meridian[2]);
        for m in 0..self.hub.half_beams.len() {
            if m == i {
                continue;
            }
            let f = if self.hub.sharp() { self.g[m].plus(-1.0, &self.g[i]) } else { piece.toggles[m] };
            // p z + f₀ + r ρ(z) = 0.
            let (p, r) = (dot(f.a, s.axis), dot(f.a, side));
            let (two, one, none) = (p * p - r * r * a, 2.0 * p * f.b - r * r * b, f.b * f.b - r * r * c);
            let root = (one * one - 4.0 * two * none).max(0.0).sqrt();
            let q = -(one + root.copysign(one)) / 2.0;
            for z in [q / two, none / q] {
                let good = z > best.0 && z < s.split && f.at(place(z)).abs() < 1e-7 * self.hub.radius;
                if good {
                    let other = 1u64 << m;
                    best = (z, if self.hub.sharp() { [own.min(other), own.max(other)] } else { [own, own | other] });
                }
            }
        }
        let (z, labels) = best;
        // Onto the perturbed plane and the quadric.
        let (quadric, plane) = (self.quadric(labels[0]), self.plane(labels));
        let mut x = place(z);
        for _ in 0..3 {
            let slope = scale(quadric.half_gradient(x), 2.0);
            let rows = [plane.a, slope, cross(plane.a, slope)];
            x = sub(x, apply(&inverse(&rows), [plane.at(x), quadric.at(x), 0.0]));
        }
        x.iter().all(|v| v.is_finite()).then_some((labels, x))
    }

    /// Traces all seams; `None` if an event cannot be located.
    pub(super) fn trace_all(&mut self) -> Option<()> {
        for i in 0..self.hub.half_beams.len() {
            let own = 1u64 << i;
            if self.arcs.iter().any(|a| a.labels.contains(&own)) {
                continue;
            }
            let (labels, from) = self.seed_point(i)?;
            let quadric = self.quadric(labels[0]);
            let tangent = unit(cross(self.plane(labels).a, quadric.half_gradient(from)));
            let (conic, event) = self.trace(labels, from, tangent, None)?;
            match event {
                None => {
                    let v = self.vertices.len() as u32;
                    self.vertices.push(Vertex {
                        at: from,
                        key: Key { labels_around: [labels[0], labels[1], u64::MAX, i as u64], far: false },
                    });
                    self.at.push([NONE; 4]);
                    self.push([v, v], labels, conic);
                }
                Some(m) => {
                    let first = self.vertex(self.labels_around(labels, m), conic.at(conic.end))?;
                    let mut todo = first as usize;
                    while todo < self.vertices.len() {
                        self.trace_from(todo as u32)?;
                        todo += 1;
                    }
                }
            }
        }
        Some(())
    }

    /// Follows every seam at a vertex that has not been traced from its other end.
    fn trace_from(&mut self, v: u32) -> Option<()> {
        let Vertex { at, key } = self.vertices[v as usize];
        for (labels, event) in self.seams(key.labels_around) {
            let is = |a: &u32| {
                *a != NONE && {
                    let s = self.arcs[*a as usize].labels;
                    s == labels || s == [labels[1], labels[0]]
                }
            };
            if self.at[v as usize].iter().any(is) {
                continue;
            }
            let quadric = self.quadric(labels[0]);
            let mut tangent = unit(cross(self.plane(labels).a, quadric.half_gradient(at)));
            let mut rise = 0.0;
            self.guards(labels, &mut |m, f| {
                if m == event {
                    rise = dot(f.a, tangent);
                }
            });
            if rise > 0.0 {
                tangent = scale(tangent, -1.0);
            }
            let (conic, end) = self.trace(labels, at, tangent, Some(event))?;
            let to = self.vertex(self.labels_around(labels, end?), conic.at(conic.end))?;
            if self.vertices.len() > 4096 {
                return None;
            }
            self.push([v, to], labels, conic);
        }
        Some(())
    }

    /// Assembles the faces from the arcs and collapses short arcs; `None` if the result is not a topological sphere.
    pub(super) fn assemble(mut self) -> Option<Complex> {
        // The next arc of a face at a vertex is the other incident arc that bounds the face.
        let mut used = vec![[false; 2]; self.arcs.len()];
        let mut faces: Vec<QuadricFace> = Vec::new();
        for first in 0..self.arcs.len() {
            for side in 0..2 {
                if used[first][side] {
                    continue;
                }
                let label = self.arcs[first].labels[side];
                let (mut loops, mut arc, mut left) = (Vec::new(), first, side);
                loop {
                    if used[arc][left] {
                        return None;
                    }
                    used[arc][left] = true;
                    loops.push((arc as u32, left == 0));
                    let a = self.arcs[arc];
                    let to = a.ends[1 - left];
                    if a.ends[0] == a.ends[1] {
                        break;
                    }
                    let next = self.at[to as usize]
                        .iter()
                        .find(|&&n| n != NONE && n as usize != arc && self.arcs[n as usize].labels.contains(&label))?;
                    arc = *next as usize;
                    let b = &self.arcs[arc];
                    left = usize::from(b.ends[0] != to);
                    if b.labels[left] != label {
                        return None;
                    }
                    if (arc, left) == (first, side) {
                        break;
                    }
                }
                let closed = loops.len() == 1 && self.arcs[first].ends[0] == self.arcs[first].ends[1];
                // Closed arcs with the same label bound one annular face.
                let ring = |f: &&mut QuadricFace| f.label == label && (closed || f.loops.iter().any(|l| l.len() == 1));
                if let Some(f) = faces.iter_mut().find(ring) {
                    f.loops.push(loops);
                    continue;
                }
                let end_circle = (label.count_ones() == 1).then(|| label.trailing_zeros());
                let quadric = self.quadric(label);
                faces.push(QuadricFace { label, quadric, loops: vec![loops], end_circle });
            }
        }
        if self.hub.half_beams.is_empty() {
            let quadric = self.quadric(0);
            faces.push(QuadricFace { label: 0, quadric, loops: Vec::new(), end_circle: None });
        }
        // Each half-beam has exactly one face of its own.
        for i in 0..self.hub.half_beams.len() {
            if faces.iter().filter(|f| f.label == 1 << i).count() != 1 {
                return None;
            }
        }
        let complex = Complex { vertices: self.vertices, arcs: self.arcs, faces };
        if complex.euler() != 2 {
            return None;
        }
        let complex = complex.collapsed(COLLAPSE_LENGTH * self.hub.radius);
        (complex.euler() == 2).then_some(complex)
    }
}
