//! Ray casting: the first intersection of a ray with the lattice, in closed form.
//!
//! Along a line S is quadratic and each G is linear, so N is quadratic between the parameters at which a half-beam
//! becomes active or inactive, which are roots of linear functions. Each interval is one quadratic equation.

use geometry::math::{Aabb, Vec3, add, dot, scale, sub, unit};

use super::Quadors;
use super::affine_function::largest;
use super::fillet_matrix::solve;
use super::hub::Hub;
use super::smooth_union::EXACT;

/// Intersection of a ray with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction.
    pub distance: f64,
    /// Position, mm.
    pub at: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Index of the hub.
    pub hub: usize,
}

/// A line through a hub.
#[derive(Default)]
struct Line {
    /// G of each half-beam at the origin, and its slope.
    g: Vec<[f64; 2]>,
    /// G of each half-beam at one place.
    at: Vec<f64>,
    /// The active half-beams there.
    active: Vec<usize>,
    /// Their y, as G.
    y: Vec<[f64; 2]>,
    /// Cholesky's factor of R of these.
    l: Vec<f64>,
}

impl Line {
    /// Sets the line from o along v.
    fn set(&mut self, hub: &Hub, o: Vec3, v: Vec3) {
        self.g.clear();
        self.g.extend(hub.g.iter().map(|g| [g.at(o), dot(g.a, v)]));
    }

    /// Finds the active half-beams at t, and y = R⁻¹g of these.
    fn activate(&mut self, hub: &Hub, t: f64) {
        self.at.clear();
        self.at.extend(self.g.iter().map(|[none, one]| none + one * t));
        self.active.clear();
        let active = &mut self.active;
        hub.each_active(&self.at, largest(&self.at), EXACT, &mut |i, _| active.push(i));
        self.y.clear();
        self.y.extend(self.active.iter().map(|i| self.g[*i]));
        solve(self.active.len(), |i, j| hub.tau(self.active[i], self.active[j]), &mut self.y, &mut self.l);
    }

    /// The first parameter after t and before `end` at which a half-beam becomes active or inactive; else `end`.
    fn next_change(&self, hub: &Hub, t: f64, end: f64) -> f64 {
        let mut next = end;
        let mut look = |[none, one]: [f64; 2]| {
            let root = -none / one;
            if root > t && root < next {
                next = root;
            }
        };
        self.y.iter().for_each(|y| look(*y));
        for (i, g) in self.g.iter().enumerate() {
            if !self.active.contains(&i) {
                let less = |sum: [f64; 2], (k, y): (&usize, &[f64; 2])| {
                    let tau = hub.tau(i, *k);
                    [sum[0] - tau * y[0], sum[1] - tau * y[1]]
                };
                look(self.active.iter().zip(&self.y).fold(*g, less));
            }
        }
        next
    }
}

/// The first parameter in [0, size] at which a line enters a hub's part, and the outward normal.
fn first_entry(hub: &Hub, o: Vec3, v: Vec3, size: f64, line: &mut Line) -> Option<(f64, Vec3)> {
    line.set(hub, o, v);
    let square = [dot(o, o) - hub.radius * hub.radius, dot(o, v), dot(v, v)];
    let mut t = 0.0;
    // Each half-beam becomes active or inactive at most twice along a line.
    for _ in 0..4 * hub.half_beams.len() + 4 {
        if t >= size {
            return None;
        }
        // Slightly ahead, for the half-beams of the interval that begins here.
        let ahead = t + 1e-9 * size;
        line.activate(hub, ahead);
        let end = line.next_change(hub, ahead, size);
        let [mut none, mut one, mut two] = square;
        for (i, y) in line.active.iter().zip(&line.y) {
            let g = line.g[*i];
            (none, one, two) = (none - y[0] * g[0], one - y[0] * g[1], two - y[1] * g[1]);
        }
        let root = one * one - two * none;
        if root >= 0.0 {
            let w = -(one + root.sqrt().copysign(one));
            let mut roots = [w / two, none / w];
            roots.sort_by(f64::total_cmp);
            for r in roots {
                let x = add(o, scale(v, r));
                if r >= t && r <= end && one + two * r < 0.0 && hub.is_before_split(x) {
                    let inner = |sum, (i, y): (&usize, &[f64; 2])| add(sum, scale(hub.g[*i].a, -y[0] - y[1] * r));
                    return Some((r, unit(line.active.iter().zip(&line.y).fold(x, inner))));
                }
            }
        }
        t = end;
    }
    None
}

/// The parameters at which a line enters and leaves a box.
pub(super) fn clip_line(b: &Aabb, o: Vec3, v: Vec3) -> Option<(f64, f64)> {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for a in 0..3 {
        if v[a] == 0.0 {
            if o[a] < b.min[a] || o[a] > b.max[a] {
                return None;
            }
            continue;
        }
        let (p, q) = ((b.min[a] - o[a]) / v[a], (b.max[a] - o[a]) / v[a]);
        from = from.max(p.min(q));
        to = to.min(p.max(q));
    }
    (from <= to && to > 0.0).then_some((from, to))
}

impl Quadors {
    /// The first intersection beyond `origin` (mm) at which a ray along `direction` enters the solid; `None` if there
    /// is none. A ray that starts inside has to leave first.
    pub fn ray(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let (mut seen, mut line) = (Vec::new(), Line::default());
        self.parts.along(origin, direction, &mut |items, until| {
            for &i in items {
                if seen.contains(&i) {
                    continue;
                }
                seen.push(i);
                let ball = &self.balls[i as usize];
                let Some((from, to)) = clip_line(&ball.part, origin, direction) else {
                    continue;
                };
                let hub = self.hub(i as usize);
                let from = from.max(0.0);
                if best.is_some_and(|b| b.distance <= from) {
                    continue;
                }
                let start = add(sub(origin, ball.center), scale(direction, from));
                if let Some((t, normal)) = first_entry(&hub, start, direction, to - from, &mut line)
                    && best.is_none_or(|b| from + t < b.distance)
                {
                    let t = from + t;
                    best = Some(Hit { distance: t, at: add(origin, scale(direction, t)), normal, hub: i as usize });
                }
            }
            best.is_none_or(|b| b.distance > until)
        });
        best
    }
}
