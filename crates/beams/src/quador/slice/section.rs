//! One hub in a plane: its conics, followed from label to label.
//!
//! Where a set of stubs is active is a convex polygon in the plane. The polygons are walked from neighbour to neighbour, and
//! where the conic of one crosses its sides are the places that loops begin at; from there on the next event along a conic is the
//! least root of a few quadratics. As in the surface's own walk each stub's G is shifted, for the seams alone, by its own few 1e-12
//! of the radius, so that the events of symmetric hubs fall apart; each arc lies on the quadric itself.

use geometry::math::{Vec3, add, dot, norm, scale, sub};

use super::super::bezier::{Bezier, Path, onward};
use super::super::complex::shift;
use super::super::hub::{Affine, Hub, Stub};
use super::super::quadric::{Quadric, piece};
use super::{Arc, Plane};

/// How a plane meets the disc that parts a stub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gate {
    /// Through its rim: where the section enters the hub's part, and where it leaves it.
    Open([Vec3; 2]),
    /// Not.
    Shut,
    /// It is parallel to it, and whether it lies before.
    Apart(bool),
}

/// A piece of the section of a hub.
#[derive(Clone, Debug)]
pub(super) struct Bit {
    label: u64,
    quadric: Quadric,
    height: f64,
    curves: Vec<Bezier<3>>,
}

impl Bit {
    /// The same in the plane's own frame.
    pub(super) fn laid(self, hub: u32, about: [f64; 2], plane: &Plane) -> Arc {
        let (q, [u, v]) = (&self.quadric, plane.axes);
        let o = scale(plane.normal, self.height);
        let slope = q.half_slope(o);
        let flat = |p: Vec3| {
            let [u, v] = plane.flat(p);
            [about[0] + u, about[1] + v]
        };
        Arc {
            hub,
            stubs: self.label,
            conic: [q.form(u, u), q.form(u, v), q.form(v, v), dot(slope, u), dot(slope, v), q.at(o)],
            about,
            curves: self.curves.iter().map(|c| Bezier { points: c.points.map(flat), weight: c.weight }).collect(),
        }
    }
}

/// Arcs one after the other.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// The stubs at whose rims it begins and ends; none if it is closed.
    pub rims: Option<[u32; 2]>,
    /// Its arcs.
    pub arcs: Vec<Bit>,
}

/// What ends an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// Another label.
    To(u64),
    /// The rim of the stub whose label it is.
    Rim,
}

/// Where a label holds.
#[derive(Clone, Debug)]
struct Cell {
    label: u64,
    quadric: Quadric,
    /// Labels beyond its sides, and what is negative on this one.
    guards: Vec<(u64, Affine)>,
}

/// Where a seam of the hub crosses the plane on the surface.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    from: u64,
    to: u64,
    at: Vec3,
    used: bool,
}

/// How far G is shifted, in radii of the hub.
const SHIFT: f64 = 2e-12;
/// How far S − N in the middle of an arc may be from zero, of the square of its distance: far above rounding.
const TRUE: f64 = 1e-10;

pub(super) struct Section<'a> {
    hub: &'a Hub<'a>,
    /// G of the stubs, shifted.
    g: Vec<Affine>,
    gates: &'a [Gate],
    plane: &'a Plane,
    height: f64,
    reach: f64,
    cells: Vec<Cell>,
    crossings: Vec<Crossing>,
}

impl<'a> Section<'a> {
    /// A hub before it is cut, by a plane at a height above its centre; `reach` is further than any of its part.
    pub(super) fn new(
        hub: &'a Hub,
        plane: &'a Plane,
        height: f64,
        reach: f64,
        gates: &'a [Gate],
        seed: u64,
    ) -> Section<'a> {
        let shifted = |(i, s): (usize, &Stub)| Affine { a: s.g.a, b: s.g.b + SHIFT * shift(i, seed) * hub.radius };
        Section {
            hub,
            g: hub.stubs.iter().enumerate().map(shifted).collect(),
            gates,
            plane,
            height,
            reach,
            cells: Vec::new(),
            crossings: Vec::new(),
        }
    }

    /// The section: chains from rim to rim and closed loops.
    pub(super) fn run(mut self) -> Option<Vec<Chain>> {
        self.spread();
        let mut out = Vec::new();
        for i in 0..self.hub.stubs.len() {
            if let Gate::Open([start, _]) = self.gates[i] {
                let (arcs, exit) = self.follow(1 << i, start, Event::Rim, None)?;
                let rims = Some([i as u32, exit?]);
                out.push(Chain { rims, arcs });
            }
        }
        while let Some(c) = self.crossings.iter_mut().find(|c| !c.used) {
            c.used = true;
            let c = *c;
            let (arcs, exit) = self.follow(c.to, c.at, Event::To(c.from), Some([c.from, c.to]))?;
            if exit.is_some() {
                return None;
            }
            out.push(Chain { rims: None, arcs });
        }
        for i in 0..self.cells.len() {
            if let Some(bit) = self.whole(i)? {
                out.push(Chain { rims: None, arcs: vec![bit] });
            }
        }
        // A section that is there has an outline.
        let o = self.middle();
        let lost = out.is_empty() && self.hub.value(o) < 0.0 && self.held(o);
        (!lost).then_some(out)
    }

    /// The plane's place nearest to the centre.
    fn middle(&self) -> Vec3 {
        scale(self.plane.normal, self.height)
    }

    fn active(&self, label: u64) -> impl Iterator<Item = (&Stub, &Affine)> {
        let all = self.hub.stubs.iter().zip(&self.g).enumerate();
        all.filter(move |(i, _)| label >> i & 1 == 1).map(|(_, both)| both)
    }

    /// The cell of a label.
    fn cell(&mut self, label: u64) -> usize {
        if let Some(i) = self.cells.iter().position(|c| c.label == label) {
            return i;
        }
        let (quadric, mut sigma) = piece(self.hub, label);
        let none = Affine::default();
        let mut guards = Vec::with_capacity(self.g.len() + 1);
        if self.hub.sharp {
            let own = match label {
                0 => none,
                _ => self.g[label.trailing_zeros() as usize],
            };
            for (m, g) in self.g.iter().enumerate() {
                if label != 1 << m {
                    guards.push((1 << m, g.plus(-1.0, &own)));
                }
            }
            if label != 0 {
                guards.push((0, none.plus(-1.0, &own)));
            }
        } else {
            // σ is linear in G, and so is its shift.
            let (mut shift, mut t) = (0.0, 1.0);
            for (s, g) in self.active(label) {
                shift += s.share * s.weight * (g.b - s.g.b);
                t += s.share * s.share * s.weight;
            }
            sigma.b += shift / t;
            for (m, (s, g)) in self.hub.stubs.iter().zip(&self.g).enumerate() {
                let joins = g.plus(-s.share, &sigma);
                let stays = label >> m & 1 == 1;
                guards.push((label ^ 1 << m, if stays { none.plus(-1.0, &joins) } else { joins }));
            }
        }
        self.cells.push(Cell { label, quadric, guards });
        self.cells.len() - 1
    }

    /// Walks the cells within reach, and finds where conics cross their sides.
    fn spread(&mut self) {
        let [u, v] = self.plane.axes;
        // From an odd place, away from what symmetric hubs have in common.
        let (sin, cos) = 0.737_f64.sin_cos();
        let way = scale(add(scale(u, cos), scale(v, sin)), 0.137 * self.hub.radius);
        let mut stubs = self.hub.stubs.to_vec();
        stubs.iter_mut().zip(&self.g).for_each(|(s, g)| s.g = *g);
        let shifted = Hub { stubs: &stubs, ..*self.hub };
        let first = shifted.grown(add(self.middle(), way)).active;
        self.cell(first);
        let mut done = 0;
        while done < self.cells.len() {
            let (beyond, crossings) = self.sides(&self.cells[done]);
            self.crossings.extend(crossings);
            for to in beyond {
                self.cell(to);
            }
            done += 1;
        }
    }

    /// The labels beyond the sides of a cell, and where the surface leaves it.
    fn sides(&self, cell: &Cell) -> (Vec<u64>, Vec<Crossing>) {
        let ([u, v], n) = (self.plane.axes, self.plane.normal);
        let (o, q, r) = (self.middle(), &cell.quadric, self.reach);
        let place = |p: [f64; 2]| add(o, add(scale(u, p[0]), scale(v, p[1])));
        // The square within reach, cut by the sides; with each corner the side that begins there.
        let mut polygon: Vec<Corner> = [[-r, -r], [r, -r], [r, r], [-r, r]].map(|p| (p, None)).into();
        for (k, (_, f)) in cell.guards.iter().enumerate() {
            clip(&mut polygon, [f.at(o), dot(f.a, u), dot(f.a, v)], k);
        }
        let (mut beyond, mut crossings) = (Vec::new(), Vec::new());
        for k in 0..polygon.len() {
            let Some(side) = polygon[k].1 else { continue };
            let (to, guard) = cell.guards[side];
            beyond.push(to);
            let a = place(polygon[k].0);
            let way = sub(place(polygon[(k + 1) % polygon.len()].0), a);
            let (none, one, two) = (q.at(a), dot(q.half_slope(a), way), q.form(way, way));
            let w = -(one + (one * one - two * none).sqrt().copysign(one));
            for t in [w / two, none / w] {
                let at = add(a, scale(way, t));
                if (0.0..=1.0).contains(&t) && dot(guard.a, onward(q, n, at)) > 0.0 && self.held(at) {
                    crossings.push(Crossing { from: cell.label, to, at, used: false });
                }
            }
        }
        (beyond, crossings)
    }

    /// Follows the surface from a place where a label begins, until a rim or the crossing `until`; the stub of the rim.
    fn follow(
        &mut self,
        label: u64,
        from: Vec3,
        born: Event,
        until: Option<[u64; 2]>,
    ) -> Option<(Vec<Bit>, Option<u32>)> {
        let (mut label, mut from, mut born) = (label, from, born);
        let mut arcs = Vec::new();
        for _ in 0..16 * self.hub.stubs.len() + 16 {
            let cell = self.cell(label);
            let (path, event) = self.trace(cell, from, Some(born))?;
            let mut bit = self.bit(label, &path);
            match event? {
                Event::Rim => {
                    let stub = label.trailing_zeros();
                    let Gate::Open([_, exit]) = self.gates[stub as usize] else {
                        return None;
                    };
                    let last = bit.curves.last_mut()?;
                    if norm(sub(last.points[2], exit)) > 1e-8 * self.hub.radius {
                        return None;
                    }
                    last.points[2] = exit;
                    arcs.push(bit);
                    return Some((arcs, Some(stub)));
                }
                Event::To(next) => {
                    arcs.push(bit);
                    let key = [label, next];
                    let on = |c: &&mut Crossing| [c.from, c.to] == key;
                    if let Some(c) = self.crossings.iter_mut().find(on) {
                        if Some(key) == until {
                            return Some((arcs, None));
                        }
                        if c.used {
                            return None;
                        }
                        c.used = true;
                    }
                    (from, born, label) = (path.at(1.0), Event::To(label), next);
                }
            }
        }
        None
    }

    /// The path of a cell's conic from a place on it to its end, and the event there.
    fn trace(&self, cell: usize, from: Vec3, born: Option<Event>) -> Option<(Path, Option<Event>)> {
        let (cell, n) = (&self.cells[cell], self.plane.normal);
        // The piece before met this one in a seam that is shifted: back onto its own quadric.
        let mut from = from;
        for _ in 0..2 {
            let slope = cell.quadric.half_slope(from);
            let slope = sub(slope, scale(n, dot(slope, n)));
            let by = cell.quadric.at(from) / (2.0 * dot(slope, slope));
            from = sub(from, scale(slope, by));
        }
        let path = Path::new(&cell.quadric, n, from, onward(&cell.quadric, n, from))?;
        let mut end: Option<(f64, Event)> = None;
        let mut look = |event: Event, f: &Affine| {
            if let Some(t) = path.first(f.at(from), f.a, born == Some(event))
                && end.is_none_or(|e| t < e.0)
            {
                end = Some((t, event));
            }
        };
        for (to, f) in &cell.guards {
            look(Event::To(*to), f);
        }
        if cell.label.count_ones() == 1 {
            let i = cell.label.trailing_zeros() as usize;
            let s = &self.hub.stubs[i];
            if !matches!(self.gates[i], Gate::Apart(_)) {
                let rim = Affine { a: s.axis, b: -s.split };
                look(Event::Rim, &rim);
            }
        }
        let path = path.until(end.map(|e| e.0))?;
        let x = path.at(0.5);
        let size = dot(x, x) + self.hub.radius * self.hub.radius;
        let good = self.hub.value(x).abs() <= TRUE * size && self.held(x);
        good.then_some((path, end.map(|e| e.1)))
    }

    /// Whether a place on the surface belongs to the hub's part; what lies in the disc of a beam belongs to one of its hubs.
    fn held(&self, x: Vec3) -> bool {
        let mut first = (0.0, None);
        for (i, s) in self.hub.stubs.iter().enumerate() {
            let g = s.g.at(x);
            if g > first.0 {
                first = (g, Some(i));
            }
        }
        let Some(i) = first.1 else { return true };
        match self.gates[i] {
            Gate::Apart(before) => before,
            _ => dot(self.hub.stubs[i].axis, x) <= self.hub.stubs[i].split + 1e-8 * self.hub.radius,
        }
    }

    fn bit(&self, label: u64, path: &Path) -> Bit {
        Bit { label, quadric: piece(self.hub, label).0, height: self.height, curves: path.curves() }
    }

    /// The whole ellipse of a cell, if it lies in it.
    fn whole(&self, i: usize) -> Option<Option<Bit>> {
        let (cell, [u, v]) = (&self.cells[i], self.plane.axes);
        let (q, o) = (&cell.quadric, self.middle());
        let slope = q.half_slope(o);
        let (a, b, c) = (q.form(u, u), q.form(u, v), q.form(v, v));
        let (d, e) = (dot(slope, u), dot(slope, v));
        let det = a * c - b * b;
        // Its middle, and the place on it along u from there.
        let m = [(b * e - c * d) / det, (b * d - a * e) / det];
        let square = -(q.at(o) + d * m[0] + e * m[1]) / a;
        if det <= 0.0 || square.is_nan() || square <= 0.0 {
            return Some(None);
        }
        let x = add(o, add(scale(u, m[0] + square.sqrt()), scale(v, m[1])));
        if cell.guards.iter().any(|(_, f)| f.at(x) > 0.0) || !self.held(x) {
            return Some(None);
        }
        let (path, event) = self.trace(i, x, None)?;
        Some(event.is_none().then(|| self.bit(cell.label, &path)))
    }
}

/// A corner of a polygon, and the name of the side that begins there.
type Corner = ([f64; 2], Option<usize>);

/// Cuts a convex polygon by f₀ + f₁ u + f₂ v ≤ 0; the new side gets a name.
fn clip(polygon: &mut Vec<Corner>, f: [f64; 3], name: usize) {
    let at = |p: [f64; 2]| f[0] + f[1] * p[0] + f[2] * p[1];
    let n = polygon.len();
    if polygon.iter().all(|(p, _)| at(*p) <= 0.0) {
        return;
    }
    let mut out = Vec::with_capacity(n + 1);
    for k in 0..n {
        let ((p, side), (q, _)) = (polygon[k], polygon[(k + 1) % n]);
        let (a, b) = (at(p), at(q));
        let crossing = || {
            let t = a / (a - b);
            [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]
        };
        match (a <= 0.0, b <= 0.0) {
            (true, true) => out.push((p, side)),
            (true, false) => {
                out.push((p, side));
                out.push((crossing(), Some(name)));
            }
            (false, true) => out.push((crossing(), side)),
            (false, false) => {}
        }
    }
    *polygon = out;
}
