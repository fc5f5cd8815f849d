//! A pattern as a field, without its beams being written out.

mod classes;
pub mod collide;
mod row;

use rayon::prelude::*;

use super::{MOST, Pattern, Similarity, Strut};
use crate::graph::Graph;
use crate::quador::{Fillet, Quadors};
use classes::Classes;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, apply, norm, scale, sub};
use row::Row;

/// A hub that stands for all of its class.
struct Kind {
    /// Its number in the quadors.
    hub: usize,
    /// How far it lies there from where it is at [0, 0, 0], so that no two kinds lie in one place.
    aside: Vec3,
}

/// A pattern laid out in space: membership and distance without visiting every beam.
pub struct Laid {
    pattern: Pattern,
    fillet: Fillet,
    classes: [Classes; 3],
    /// The different hubs, each with its neighbours.
    quadors: Quadors,
    /// By class of k, j, i, and node.
    kinds: Vec<Kind>,
    /// Powers of U, V, W, undone, where they do more than move.
    undone: [Vec<Similarity>; 3],
    /// For each class of j what holds the hubs of a row, pulled back by Wᵏ Vʲ, where U does more than move.
    rows: Vec<Row>,
    /// For each class of j what holds a whole row.
    lines: Vec<Aabb>,
    /// What holds any of the lines, and any hub at [0, 0, 0].
    widest: Aabb,
    home: Aabb,
    /// What holds a layer, pulled back by Wᵏ.
    layer: Aabb,
    bounds: Aabb,
    /// Values beyond this (mm, at scale 1) are not told apart.
    cap: f64,
    /// The least scale.
    least: f64,
}

impl Laid {
    /// Lays a pattern out.
    ///
    /// # Errors
    /// What makes no pattern; beams that cannot be; too many different hubs.
    pub fn new(pattern: Pattern, fillet: Fillet) -> Result<Laid, Fault> {
        pattern.check()?;
        let [u, v, w] = pattern.steps.map(|s| s.0);
        let size = pattern.nodes.iter().map(|h| norm(h.center)).fold(0.0, f64::max);
        let free = [u.commutes(&v, size) && u.commutes(&w, size), v.commutes(&w, size), true];
        let classes: [Classes; 3] = core::array::from_fn(|a| Classes {
            count: pattern.steps[a].1 as usize,
            ends: free[a].then(|| {
                let most = pattern.struts.iter().map(|s| s.by[a].unsigned_abs()).max();
                most.unwrap_or(0) as usize
            }),
        });
        let different = classes.iter().map(|c| c.len() as f64).product::<f64>() * pattern.nodes.len() as f64;
        if different > MOST {
            let message = format!(
                "{} hubs of this pattern differ from each other; at most {} are made: turn and scale about one axis, or \
                 repeat less often",
                number(different),
                number(MOST)
            );
            return Err(Fault::new("repeat", message));
        }
        let (mut graph, mut kinds, mut right) = (Graph::default(), Vec::new(), 0.0);
        for c in 0..classes[2].len() {
            for b in 0..classes[1].len() {
                for a in 0..classes[0].len() {
                    let at = [(0, a), (1, b), (2, c)].map(|(s, n)| classes[s].members(n).0 as u32);
                    for n in 0..pattern.nodes.len() {
                        let first = graph.hubs.len() as u32;
                        let mut star = pattern.star(n as u32, at);
                        let b = star.bounds();
                        let aside = [right - b.min[0], 0.0, 0.0];
                        right += b.size()[0];
                        star.hubs.iter_mut().for_each(|h| h.center = add(h.center, aside));
                        kinds.push(Kind { hub: first as usize, aside });
                        graph.hubs.extend(star.hubs);
                        graph.beams.extend(star.beams.into_iter().map(|mut b| {
                            b.ends = b.ends.map(|e| e + first);
                            b
                        }));
                    }
                }
            }
        }
        let quadors = Quadors::new(&graph, fillet)?;
        let undone: [Vec<Similarity>; 3] = core::array::from_fn(|a| match &pattern.steps[a] {
            (step, _) if step.moves() => Vec::new(),
            (step, count) => step.inverse().powers(*count as usize),
        });
        let smallest = |s: &(Similarity, u32)| s.0.scale.powi(s.1 as i32 - 1).min(1.0);
        let least = pattern.steps.iter().map(smallest).product();
        let thick = pattern.nodes.iter().map(|h| h.radius).sum::<f64>() / pattern.nodes.len() as f64;
        let mut laid = Laid {
            classes,
            kinds,
            undone,
            rows: Vec::new(),
            lines: Vec::new(),
            widest: Aabb::EMPTY,
            home: Aabb::EMPTY,
            layer: Aabb::EMPTY,
            bounds: Aabb::EMPTY,
            cap: 2.0 * thick,
            least,
            quadors,
            pattern,
            fillet,
        };
        laid.hold();
        Ok(laid)
    }

    /// What undoes n of a step.
    fn undo(&self, step: usize, n: usize) -> Similarity {
        match self.undone[step].get(n) {
            Some(done) => *done,
            None => Similarity { shift: scale(self.pattern.steps[step].0.shift, -(n as f64)), ..Similarity::STILL },
        }
    }

    /// The boxes in which what is near is looked for.
    fn hold(&mut self) {
        let [lu, lv, lw] = self.classes.map(|c| c.len());
        let nodes = self.pattern.nodes.len();
        let kinds_at = |a: usize, b: usize| {
            (0..lw).flat_map(move |c| (0..nodes).map(move |n| ((c * lv + b) * lu + a) * nodes + n))
        };
        // What is solid lies within, and values count up to the cap.
        let own = |a: usize, b: usize| {
            kinds_at(a, b).fold(Aabb::EMPTY, |all, m| {
                let kind = &self.kinds[m];
                let b = self.quadors.hold(kind.hub).grown(self.cap);
                all.union(Aabb { min: sub(b.min, kind.aside), max: sub(b.max, kind.aside) })
            })
        };
        let steps = self.pattern.steps;
        // The first and the last of a class hold all of it where a step only moves.
        let spread = |step: usize, class: usize, b: Aabb| {
            let ((by, _), (first, n)) = (&steps[step], self.classes[step].members(class));
            let power = |n: usize| self.undo(step, n).inverse();
            let last = first + n - 1;
            let between = if by.moves() { first..first } else { first..last };
            let ends = carried(&power(first), &b).union(carried(&power(last), &b));
            between.fold(ends, |all, n| all.union(carried(&power(n), &b)))
        };
        let (mut rows, mut lines, mut home) = (Vec::new(), Vec::new(), Aabb::EMPTY);
        for b in 0..lv {
            let at: Vec<Aabb> = (0..lu).map(|a| own(a, b)).collect();
            home = at.iter().fold(home, |all, b| all.union(*b));
            if steps[0].0.moves() {
                let line = (0..lu).map(|a| spread(0, a, at[a]));
                lines.push(line.fold(Aabb::EMPTY, Aabb::union));
            } else {
                let of = |i: usize| carried(&self.undo(0, i).inverse(), &at[self.classes[0].of(i)]);
                let row = Row::of((0..self.classes[0].count).map(of).collect());
                lines.push(row.all());
                rows.push(row);
            }
        }
        let layer = (0..lv).map(|b| spread(1, b, lines[b]));
        let layer = layer.fold(Aabb::EMPTY, Aabb::union);
        let all = (0..lw).map(|c| spread(2, c, layer));
        let bounds = all.fold(Aabb::EMPTY, Aabb::union);
        let widest = lines.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        (self.bounds, self.widest) = (bounds, widest);
        (self.rows, self.lines, self.layer, self.home) = (rows, lines, layer, home);
    }

    /// Calls `found` with each kind of hub that may lie near a box, the box as that kind sees it, and how much larger the
    /// hub is; until it says that it has enough.
    fn near(&self, p: &Aabb, found: &mut impl FnMut(&Kind, Aabb, f64) -> bool) {
        let nodes = self.pattern.nodes.len();
        self.places(p, &mut |_, first, home, s| {
            self.kinds[first..first + nodes].iter().all(|kind| {
                let seen = Aabb { min: add(home.min, kind.aside), max: add(home.max, kind.aside) };
                found(kind, seen, s)
            })
        });
    }

    /// Calls `found` with each [i, j, k] whose hubs may lie near a box, the first of their kinds, the box pulled back, and how much
    /// larger they are; until it says that it has enough.
    fn places(&self, p: &Aabb, found: &mut impl FnMut([usize; 3], usize, Aabb, f64) -> bool) {
        let nodes = self.pattern.nodes.len();
        let [lu, lv, _] = self.classes.map(|c| c.len());
        let [u, v, w] = &self.pattern.steps;
        let meets = |b: &Aabb, held: &Aabb| !b.intersection(*held).is_empty();
        for k in span(w, p, &self.layer) {
            let undone_w = self.undo(2, k);
            let in_layer = carried(&undone_w, p);
            if !meets(&in_layer, &self.layer) {
                continue;
            }
            let c = self.classes[2].of(k);
            for j in span(v, &in_layer, &self.widest) {
                let b = self.classes[1].of(j);
                let undone_v = self.undo(1, j);
                let in_line = carried(&undone_v, &in_layer);
                if !meets(&in_line, &self.lines[b]) {
                    continue;
                }
                let mut one = |i: usize| {
                    let undone_u = self.undo(0, i);
                    let home = carried(&undone_u, &in_line);
                    let s = 1.0 / (undone_u.scale * undone_v.scale * undone_w.scale);
                    let first = ((c * lv + b) * lu + self.classes[0].of(i)) * nodes;
                    found([i, j, k], first, home, s)
                };
                let more = match self.rows.get(b) {
                    Some(row) => row.near(&in_line, &mut one),
                    None => span(u, &in_line, &self.home).all(one),
                };
                if !more {
                    return;
                }
            }
        }
    }

    fn at(&self, p: Vec3) -> f64 {
        let mut least = self.cap * self.least;
        self.near(&Aabb { min: p, max: p }, &mut |kind, q, s| {
            // No hub gives less than the distance from what holds it.
            let away = self.quadors.hold(kind.hub).distance(q.min) * s;
            if away == 0.0 || away < least {
                least = least.min(self.quadors.share(kind.hub, q.min) * s);
            }
            true
        });
        least
    }

    /// Whether a point is in the solid.
    pub fn contains(&self, p: Vec3) -> bool {
        let mut inside = false;
        self.near(&Aabb { min: p, max: p }, &mut |kind, q, _| {
            inside = self.quadors.hub(kind.hub).holds(sub(q.min, self.quadors.center(kind.hub)));
            !inside
        });
        inside
    }

    /// The whole written out hub by hub, for what is asked of hubs.
    ///
    /// # Errors
    /// More beams than are written out.
    pub fn written(&self) -> Result<Quadors, Fault> {
        let (_, beams) = self.pattern.counts();
        if beams > WRITTEN {
            let message = format!(
                "this pattern stands for {} beams; for slices, nearest places and its own patches it is written out hub by hub, \
                 up to {} beams (about {} GB): repeat less often, or ask for its field",
                number(beams),
                number(WRITTEN),
                number(WRITTEN * EACH / 1e9)
            );
            return Err(Fault::new("", message));
        }
        Quadors::new(&self.pattern.expanded()?, self.fillet)
    }

    /// The pattern.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// The different hubs, each with its neighbours, and which hubs count, each with the sum of s³ over its class, s being
    /// how much larger a member is than at [0, 0, 0].
    pub fn kinds(&self) -> (&Quadors, Vec<(usize, f64)>) {
        let nodes = self.pattern.nodes.len();
        let [lu, lv, _] = self.classes.map(|c| c.len());
        let sum = |step: usize, class: usize| {
            let s = self.pattern.steps[step].0.scale.powi(3);
            let (first, n) = self.classes[step].members(class);
            let all = if s == 1.0 { n as f64 } else { (s.powi(n as i32) - 1.0) / (s - 1.0) };
            s.powi(first as i32) * all
        };
        let each = self.kinds.iter().enumerate().map(|(m, kind)| {
            let class = m / nodes;
            let (a, b, c) = (class % lu, class / lu % lv, class / (lu * lv));
            (kind.hub, sum(0, a) * sum(1, b) * sum(2, c))
        });
        (&self.quadors, each.collect())
    }

    /// The volume of the whole pattern (mm³), to 1e-10: of one hub of each kind, and the sum of the cubes of scales. Beams must
    /// not meet but in hubs (`collisions`).
    ///
    /// # Errors
    /// Beams that overlap too far for closed forms.
    pub fn volume(&self) -> Result<f64, Fault> {
        if let Some(o) = self.quadors.overlaps().first() {
            let message = format!(
                "two beams of the hub at {} (as it lies at [0, 0, 0]) still overlap halfway along: there is no closed form for that",
                crate::graph::place(self.aside_of(o.hub))
            );
            return Err(Fault::new("", message));
        }
        let each = self.kinds().1;
        let parts = each.par_iter().map(|(hub, n)| Ok(n * self.quadors.hub_volume(*hub)?));
        let parts = parts.collect::<Result<Vec<f64>, Fault>>()?;
        Ok(parts.iter().sum())
    }

    /// Where a hub of a kind lies at [0, 0, 0].
    fn aside_of(&self, hub: usize) -> Vec3 {
        let kind = self.kinds.iter().rfind(|k| k.hub <= hub);
        sub(self.quadors.center(hub), kind.map_or([0.0; 3], |k| k.aside))
    }

    /// The least and the greatest scale.
    pub fn scales(&self) -> [f64; 2] {
        let last = |s: &(Similarity, u32)| s.0.scale.powi(s.1 as i32 - 1);
        let each = self.pattern.steps.iter().map(last);
        [self.least, each.map(|s| s.max(1.0)).product()]
    }

    /// The mean length of beams where they are smallest, mm.
    pub fn wavelength(&self) -> f64 {
        let pattern = &self.pattern;
        let length = |s: &Strut| {
            // Back where it would lie before the first repeat.
            let back = s.by.map(|n| n.max(0).unsigned_abs());
            let from = s.by.map(|n| (-n).max(0).unsigned_abs());
            let [a, b] = s.ends.map(|n| pattern.nodes[n as usize].center);
            let (p, q) = (pattern.at(from), pattern.at(back));
            norm(sub(q.apply(b), p.apply(a))) / p.scale.max(q.scale)
        };
        let mean = pattern.struts.iter().map(length).sum::<f64>() / pattern.struts.len() as f64;
        mean * self.least
    }

    /// The radius of the thinnest beam, mm.
    pub fn thinnest(&self) -> f64 {
        let thin = (0..self.quadors.beams()).map(|b| self.quadors.pencil(b).waist());
        thin.fold(f64::INFINITY, f64::min) * self.least
    }

    /// What holds the solid, mm.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// The box that holds a box carried by a similarity.
fn carried(by: &Similarity, b: &Aabb) -> Aabb {
    if b.is_empty() {
        return *b;
    }
    if by.moves() {
        return Aabb { min: add(b.min, by.shift), max: add(b.max, by.shift) };
    }
    let (middle, half) = (by.apply(b.center()), scale(b.size(), 0.5 * by.scale));
    let reach = apply(&by.turn.map(|row| row.map(f64::abs)), half);
    Aabb { min: sub(middle, reach), max: add(middle, reach) }
}

/// The repeats n for which a part of p, n steps undone, may lie in b: by division where a step only moves, else all.
fn span((step, count): &(Similarity, u32), p: &Aabb, b: &Aabb) -> std::ops::Range<usize> {
    let count = *count as usize;
    if !step.moves() {
        return 0..count;
    }
    let (mut low, mut high) = (0.0f64, count as f64 - 1.0);
    for a in 0..3 {
        let t = step.shift[a];
        if t == 0.0 {
            if p.max[a] < b.min[a] || p.min[a] > b.max[a] {
                return 0..0;
            }
            continue;
        }
        let (from, to) = ((p.min[a] - b.max[a]) / t, (p.max[a] - b.min[a]) / t);
        // One more on either side, for rounding.
        low = low.max(from.min(to).floor());
        high = high.min(from.max(to).ceil());
    }
    if low > high {
        return 0..0;
    }
    low as usize..high as usize + 1
}

/// Most beams of a pattern that is written out, and bytes of each: two stubs and a share of a hub and of the index.
const WRITTEN: f64 = 1e6;
const EACH: f64 = 1000.0;

/// Hubs that the bound of a box looks at one by one.
const LOOKED: usize = 96;

impl Laid {
    /// Fills the field at points (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.at(*p);
        }
    }

    /// Fills the field and its gradient (per mm) at points, the gradient by differences: hubs are met under many
    /// similarities, and it only guides.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let step = 1e-4 * self.cap * self.least;
        for (i, p) in points.iter().enumerate() {
            values[i] = self.at(*p);
            for a in 0..3 {
                let (mut low, mut high) = (*p, *p);
                low[a] -= step;
                high[a] += step;
                gradients[i][a] = (self.at(high) - self.at(low)) / (2.0 * step);
            }
        }
    }

    /// An interval that contains the field over the box. Proven.
    pub fn bound(&self, b: &Aabb) -> Interval {
        let cap = self.cap * self.least;
        let mut range = Interval::new(cap, cap);
        let mut looked = 0;
        self.near(b, &mut |kind, q, s| {
            let own = self.quadors.hub_bound(kind.hub, &q);
            range = range.min(Interval::new(own.lo * s, own.hi * s));
            looked += 1;
            looked < LOOKED
        });
        if looked == LOOKED {
            range.lo = f64::NEG_INFINITY;
        }
        range
    }

    /// The field at one point (mm).
    pub fn value(&self, p: Vec3) -> f64 {
        self.at(p)
    }

    /// A Lipschitz bound of the field, per mm.
    pub fn lipschitz(&self) -> f64 {
        self.quadors.lipschitz()
    }

    /// Whether its zero set may have creases: hubs without fillets have.
    pub fn has_creases(&self) -> bool {
        self.quadors.has_creases()
    }
}

#[cfg(test)]
mod tests;
