//! The implicit function of a pattern, evaluated without expanding it.

mod box_tree;
mod index_classes;
mod pattern_collisions;

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::{MAX_DISTINCT_HUBS, Pattern, Strut};
use crate::graph::Graph;
use crate::quador::{Fillet, Quadors};
use box_tree::BoxTree;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, norm, scale, sub};
use geometry::similarity::Similarity;
use index_classes::IndexClasses;

/// The hub that represents its class.
struct Representative {
    /// Its index in the quadors.
    hub: usize,
    /// Its offset there from its position at index [0, 0, 0]; offsets keep the representatives apart.
    offset: Vec3,
}

/// A pattern prepared for evaluation: membership, field, bounds and volume without visiting every beam.
pub struct PatternField {
    pattern: Pattern,
    fillet: Fillet,
    classes: [IndexClasses; 3],
    /// The representative hubs, each with its neighbours.
    quadors: Quadors,
    /// By class of k, j, i, and node.
    representatives: Vec<Representative>,
    /// Inverse powers of U, V, W; empty for translations.
    inverses: [Vec<Similarity>; 3],
    /// For each class of j the boxes of the hubs of a row, in the frame of Wᵏ Vʲ; only if U is not a translation.
    row_trees: Vec<BoxTree>,
    /// For each class of j the bounding box of a whole row.
    row_bounds: Vec<Aabb>,
    /// Union of the row boxes; and the bounds of any hub at index [0, 0, 0].
    widest_row: Aabb,
    home: Aabb,
    /// Bounds of a layer, in the frame of Wᵏ.
    layer_bounds: Aabb,
    bounds: Aabb,
    /// Upper limit of field values, mm at scale 1.
    cap: f64,
    /// The minimum scale.
    min_scale: f64,
    /// Every hub, once it was asked for.
    expanded: OnceLock<Result<Arc<Quadors>, Fault>>,
}

impl PatternField {
    /// Prepares a pattern.
    ///
    /// # Errors
    /// An invalid pattern, beams that cannot be built, too many distinct hubs.
    pub fn new(pattern: Pattern, fillet: Fillet) -> Result<PatternField, Fault> {
        pattern.check()?;
        let [u, v, w] = pattern.steps.map(|s| s.0);
        let size = pattern.nodes.iter().map(|h| norm(h.center)).fold(0.0, f64::max);
        let free = [u.commutes(&v, size) && u.commutes(&w, size), v.commutes(&w, size), true];
        let classes: [IndexClasses; 3] = core::array::from_fn(|a| IndexClasses {
            count: pattern.steps[a].1 as usize,
            ends: free[a].then(|| {
                let most = pattern.struts.iter().map(|s| s.offset[a].unsigned_abs()).max();
                most.unwrap_or(0) as usize
            }),
        });
        let distinct = classes.iter().map(|c| c.len() as f64).product::<f64>() * pattern.nodes.len() as f64;
        if distinct > MAX_DISTINCT_HUBS {
            let message = format!(
                "the pattern has {} distinct hubs; the maximum is {}: rotate and scale about one axis, or use fewer repeats",
                number(distinct),
                number(MAX_DISTINCT_HUBS)
            );
            return Err(Fault::new("repeat", message));
        }
        let (mut graph, mut representatives, mut right) = (Graph::default(), Vec::new(), 0.0);
        for c in 0..classes[2].len() {
            for b in 0..classes[1].len() {
                for a in 0..classes[0].len() {
                    let at = [(0, a), (1, b), (2, c)].map(|(s, n)| classes[s].members(n).0 as u32);
                    for n in 0..pattern.nodes.len() {
                        let first = graph.hubs.len() as u32;
                        let mut star = pattern.star(n as u32, at);
                        let b = star.bounds();
                        let offset = [right - b.min[0], 0.0, 0.0];
                        right += b.size()[0];
                        star.hubs.iter_mut().for_each(|h| h.center = add(h.center, offset));
                        representatives.push(Representative { hub: first as usize, offset });
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
        let inverses: [Vec<Similarity>; 3] = core::array::from_fn(|a| match &pattern.steps[a] {
            (step, _) if step.shift().is_some() => Vec::new(),
            (step, count) => step.inverse().powers(*count as usize),
        });
        let last_scale = |s: &(Similarity, u32)| s.0.scale().powi(s.1 as i32 - 1).min(1.0);
        let min_scale = pattern.steps.iter().map(last_scale).product();
        let thick = pattern.nodes.iter().map(|h| h.radius).sum::<f64>() / pattern.nodes.len() as f64;
        let mut field = PatternField {
            classes,
            representatives,
            inverses,
            row_trees: Vec::new(),
            row_bounds: Vec::new(),
            widest_row: Aabb::EMPTY,
            home: Aabb::EMPTY,
            layer_bounds: Aabb::EMPTY,
            bounds: Aabb::EMPTY,
            cap: 2.0 * thick,
            min_scale,
            quadors,
            pattern,
            fillet,
            expanded: OnceLock::new(),
        };
        field.compute_boxes();
        Ok(field)
    }

    /// The inverse of n repeats of a step.
    fn inverse_power(&self, step: usize, n: usize) -> Similarity {
        match self.inverses[step].get(n) {
            Some(done) => *done,
            None => {
                let by = self.pattern.steps[step].0.shift().unwrap_or_default();
                Similarity::translation(scale(by, -(n as f64)))
            }
        }
    }

    /// Computes the boxes by which hubs near a point are found.
    fn compute_boxes(&mut self) {
        let [classes_u, classes_v, classes_w] = self.classes.map(|c| c.len());
        let nodes = self.pattern.nodes.len();
        let representatives_at = |a: usize, b: usize| {
            (0..classes_w).flat_map(move |c| (0..nodes).map(move |n| ((c * classes_v + b) * classes_u + a) * nodes + n))
        };
        // The solid lies within, and field values matter up to the cap.
        let own = |a: usize, b: usize| {
            representatives_at(a, b).fold(Aabb::EMPTY, |all, m| {
                let representative = &self.representatives[m];
                let b = self.quadors.hub_bounds(representative.hub).grown(self.cap);
                all.union(Aabb { min: sub(b.min, representative.offset), max: sub(b.max, representative.offset) })
            })
        };
        let steps = self.pattern.steps;
        // For translations the first and the last member bound the whole class.
        let spread = |step: usize, class: usize, b: Aabb| {
            let ((by, _), (first, n)) = (&steps[step], self.classes[step].members(class));
            let power = |n: usize| self.inverse_power(step, n).inverse();
            let last = first + n - 1;
            let between = if by.shift().is_some() { first..first } else { first..last };
            let ends = power(first).bounds(&b).union(power(last).bounds(&b));
            between.fold(ends, |all, n| all.union(power(n).bounds(&b)))
        };
        let (mut row_trees, mut row_bounds, mut home) = (Vec::new(), Vec::new(), Aabb::EMPTY);
        for b in 0..classes_v {
            let at: Vec<Aabb> = (0..classes_u).map(|a| own(a, b)).collect();
            home = at.iter().fold(home, |all, b| all.union(*b));
            if steps[0].0.shift().is_some() {
                let line = (0..classes_u).map(|a| spread(0, a, at[a]));
                row_bounds.push(line.fold(Aabb::EMPTY, Aabb::union));
            } else {
                let of = |i: usize| self.inverse_power(0, i).inverse().bounds(&at[self.classes[0].of(i)]);
                let row = BoxTree::of((0..self.classes[0].count).map(of).collect());
                row_bounds.push(row.all());
                row_trees.push(row);
            }
        }
        let layer_bounds = (0..classes_v).map(|b| spread(1, b, row_bounds[b]));
        let layer_bounds = layer_bounds.fold(Aabb::EMPTY, Aabb::union);
        let all = (0..classes_w).map(|c| spread(2, c, layer_bounds));
        let bounds = all.fold(Aabb::EMPTY, Aabb::union);
        let widest_row = row_bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        (self.bounds, self.widest_row) = (bounds, widest_row);
        (self.row_trees, self.row_bounds, self.layer_bounds, self.home) = (row_trees, row_bounds, layer_bounds, home);
    }

    /// Calls `found` with each representative hub that may lie near a box, the box in its frame, and its scale; stops
    /// when `found` returns false.
    fn hubs_near(&self, p: &Aabb, found: &mut impl FnMut(&Representative, Aabb, f64) -> bool) {
        let nodes = self.pattern.nodes.len();
        self.indices_near(p, &mut |_, first, home, s| {
            self.representatives[first..first + nodes].iter().all(|representative| {
                let local =
                    Aabb { min: add(home.min, representative.offset), max: add(home.max, representative.offset) };
                found(representative, local, s)
            })
        });
    }

    /// Calls `found` with each index [i, j, k] whose hubs may lie near a box, its first representative, the box in the
    /// frame of index [0, 0, 0], and the scale there; stops when `found` returns false.
    fn indices_near(&self, p: &Aabb, found: &mut impl FnMut([usize; 3], usize, Aabb, f64) -> bool) {
        let nodes = self.pattern.nodes.len();
        let [classes_u, classes_v, _] = self.classes.map(|c| c.len());
        let [u, v, w] = &self.pattern.steps;
        let meets = |b: &Aabb, held: &Aabb| !b.intersection(*held).is_empty();
        for k in candidate_repeats(w, p, &self.layer_bounds) {
            let inverse_w = self.inverse_power(2, k);
            let in_layer = inverse_w.bounds(p);
            if !meets(&in_layer, &self.layer_bounds) {
                continue;
            }
            let c = self.classes[2].of(k);
            for j in candidate_repeats(v, &in_layer, &self.widest_row) {
                let b = self.classes[1].of(j);
                let inverse_v = self.inverse_power(1, j);
                let in_line = inverse_v.bounds(&in_layer);
                if !meets(&in_line, &self.row_bounds[b]) {
                    continue;
                }
                let mut one = |i: usize| {
                    let inverse_u = self.inverse_power(0, i);
                    let home = inverse_u.bounds(&in_line);
                    let s = 1.0 / (inverse_u.scale() * inverse_v.scale() * inverse_w.scale());
                    let first = ((c * classes_v + b) * classes_u + self.classes[0].of(i)) * nodes;
                    found([i, j, k], first, home, s)
                };
                let more = match self.row_trees.get(b) {
                    Some(row) => row.find_meeting(&in_line, &mut one),
                    None => candidate_repeats(u, &in_line, &self.home).all(one),
                };
                if !more {
                    return;
                }
            }
        }
    }

    fn at(&self, p: Vec3) -> f64 {
        let mut min_scale = self.cap * self.min_scale;
        self.hubs_near(&Aabb { min: p, max: p }, &mut |representative, q, s| {
            // A hub's value is at least the distance to its box.
            let away = self.quadors.hub_bounds(representative.hub).distance(q.min) * s;
            if away == 0.0 || away < min_scale {
                min_scale = min_scale.min(self.quadors.hub_value(representative.hub, q.min) * s);
            }
            true
        });
        min_scale
    }

    /// Whether a point (mm) is in the solid.
    pub fn contains(&self, p: Vec3) -> bool {
        let mut inside = false;
        self.hubs_near(&Aabb { min: p, max: p }, &mut |representative, q, _| {
            inside = self.quadors.hub(representative.hub).contains(sub(q.min, self.quadors.center(representative.hub)));
            !inside
        });
        inside
    }

    /// The pattern expanded to quadors, for queries by hub; kept from the first call on.
    ///
    /// # Errors
    /// More beams than the maximum that is expanded.
    pub fn expand(&self) -> Result<Arc<Quadors>, Fault> {
        self.expanded.get_or_init(|| self.expansion().map(Arc::new)).clone()
    }

    /// The pattern expanded to quadors where it has at most 100 000 beams, about 100 MB.
    pub fn expanded_if_small(&self) -> Option<Arc<Quadors>> {
        (self.pattern.counts().1 <= SMALL).then(|| self.expand().ok()).flatten()
    }

    fn expansion(&self) -> Result<Quadors, Fault> {
        let (_, beams) = self.pattern.counts();
        if beams > MAX_EXPANDED_BEAMS {
            let message = format!(
                "the pattern has {} beams; slices, closest points and meshes by chord error expand it hub by hub, up to {} beams \
                 (about {} GB): use fewer repeats, or its field",
                number(beams),
                number(MAX_EXPANDED_BEAMS),
                number(MAX_EXPANDED_BEAMS * BYTES_PER_BEAM / 1e9)
            );
            return Err(Fault::new("", message));
        }
        Quadors::new(&self.pattern.expanded()?, self.fillet)
    }

    /// The pattern.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// The representative hubs with their neighbours; and the index of each representative with the sum of s³ over its
    /// class, where s is the scale of a member relative to index [0, 0, 0].
    pub fn representatives(&self) -> (&Quadors, Vec<(usize, f64)>) {
        let nodes = self.pattern.nodes.len();
        let [classes_u, classes_v, _] = self.classes.map(|c| c.len());
        let sum = |step: usize, class: usize| {
            let s = self.pattern.steps[step].0.scale().powi(3);
            let (first, n) = self.classes[step].members(class);
            let all = if s == 1.0 { n as f64 } else { (s.powi(n as i32) - 1.0) / (s - 1.0) };
            s.powi(first as i32) * all
        };
        let each = self.representatives.iter().enumerate().map(|(m, representative)| {
            let class = m / nodes;
            let (a, b, c) = (class % classes_u, class / classes_u % classes_v, class / (classes_u * classes_v));
            (representative.hub, sum(0, a) * sum(1, b) * sum(2, c))
        });
        (&self.quadors, each.collect())
    }

    /// Volume of the whole pattern (mm³), relative error 1e-10: the volume of each representative times the sum of s³.
    /// Valid only if beams meet in hubs alone (see `collisions`).
    ///
    /// # Errors
    /// Beams that overlap too far for closed forms.
    pub fn volume(&self) -> Result<f64, Fault> {
        if let Some(o) = self.quadors.overlaps().first() {
            let message = format!(
                "two beams of the hub at {} (position at index [0, 0, 0]) overlap at mid length: no closed form for the volume",
                crate::graph::position_text(self.home_position(o.hub))
            );
            return Err(Fault::new("", message));
        }
        let each = self.representatives().1;
        let parts = each.par_iter().map(|(hub, n)| Ok(n * self.quadors.hub_volume(*hub)?));
        let parts = parts.collect::<Result<Vec<f64>, Fault>>()?;
        Ok(parts.iter().sum())
    }

    /// Position of a representative hub at index [0, 0, 0], mm.
    fn home_position(&self, hub: usize) -> Vec3 {
        let representative = self.representatives.iter().rfind(|k| k.hub <= hub);
        sub(self.quadors.center(hub), representative.map_or([0.0; 3], |k| k.offset))
    }

    /// The minimum and maximum scale.
    pub fn scales(&self) -> [f64; 2] {
        let last = |s: &(Similarity, u32)| s.0.scale().powi(s.1 as i32 - 1);
        let each = self.pattern.steps.iter().map(last);
        [self.min_scale, each.map(|s| s.max(1.0)).product()]
    }

    /// Mean beam length at the minimum scale, mm.
    pub fn wavelength(&self) -> f64 {
        let pattern = &self.pattern;
        let length = |s: &Strut| {
            // Both ends at the smallest non-negative indices.
            let back = s.offset.map(|n| n.max(0).unsigned_abs());
            let from = s.offset.map(|n| (-n).max(0).unsigned_abs());
            let [a, b] = s.ends.map(|n| pattern.nodes[n as usize].center);
            let (p, q) = (pattern.at(from), pattern.at(back));
            norm(sub(q.point(b), p.point(a))) / p.scale().max(q.scale())
        };
        let mean = pattern.struts.iter().map(length).sum::<f64>() / pattern.struts.len() as f64;
        mean * self.min_scale
    }

    /// Radius of the thinnest beam, mm.
    pub fn min_radius(&self) -> f64 {
        let thin = (0..self.quadors.beams()).map(|b| self.quadors.pencil(b).waist());
        thin.fold(f64::INFINITY, f64::min) * self.min_scale
    }

    /// Bounds of the solid, mm.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// The repeats n for which the inverse image of p under n steps may meet b: by division for translations, otherwise
/// all.
fn candidate_repeats((step, count): &(Similarity, u32), p: &Aabb, b: &Aabb) -> std::ops::Range<usize> {
    let count = *count as usize;
    let Some(by) = step.shift() else { return 0..count };
    let (mut low, mut high) = (0.0f64, count as f64 - 1.0);
    for a in 0..3 {
        let t = by[a];
        if t == 0.0 {
            if p.max[a] < b.min[a] || p.min[a] > b.max[a] {
                return 0..0;
            }
            continue;
        }
        let (from, to) = ((p.min[a] - b.max[a]) / t, (p.max[a] - b.min[a]) / t);
        // One more on either end, for rounding.
        low = low.max(from.min(to).floor());
        high = high.min(from.max(to).ceil());
    }
    if low > high {
        return 0..0;
    }
    low as usize..high as usize + 1
}

/// Number of beams of a pattern that is small.
const SMALL: f64 = 1e5;

/// Maximum number of beams of a pattern that is expanded, and bytes of each: two half-beams and its part of a hub and
/// of the index.
const MAX_EXPANDED_BEAMS: f64 = 1e6;
const BYTES_PER_BEAM: f64 = 1000.0;

/// Maximum number of hubs examined for the bound over a box.
const MAX_HUBS_PER_BOX: usize = 96;

impl PatternField {
    /// Fills the field (mm) at points (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.at(*p);
        }
    }

    /// Fills the field (mm) and its gradient at points; the gradient by central differences, since one point has hubs
    /// under many similarities.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let step = 1e-4 * self.cap * self.min_scale;
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

    /// An interval that contains the field over the box; a proven bound.
    pub fn bound(&self, b: &Aabb) -> Interval {
        let cap = self.cap * self.min_scale;
        let mut range = Interval::new(cap, cap);
        let mut examined = 0;
        self.hubs_near(b, &mut |representative, q, s| {
            let own = self.quadors.hub_bound(representative.hub, &q);
            range = range.min(Interval::new(own.lo * s, own.hi * s));
            examined += 1;
            examined < MAX_HUBS_PER_BOX
        });
        if examined == MAX_HUBS_PER_BOX {
            range.lo = f64::NEG_INFINITY;
        }
        range
    }

    /// The field at one point, mm.
    pub fn value(&self, p: Vec3) -> f64 {
        self.at(p)
    }

    /// A Lipschitz bound of the field.
    pub fn lipschitz(&self) -> f64 {
        self.quadors.lipschitz()
    }

    /// Whether the zero set may have creases: only without fillets.
    pub fn has_creases(&self) -> bool {
        self.quadors.has_creases()
    }
}

#[cfg(test)]
mod tests;
