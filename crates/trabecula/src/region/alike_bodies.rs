//! Unions of many bounded bodies, as few surfaces.
//!
//! Bodies of the same make, such as the copies of one, have the same tree over surfaces of their own. In a box about each of them that
//! holds no other, these are the surfaces of the union: F = minᵢ max(fᵢ, bᵢ), with fᵢ the function of a surface of body i and bᵢ
//! the signed distance of its box. Outside the boxes F is positive, so there is no body; in box i it has the sign of fᵢ. So the tree
//! of one body, over such functions, is the union of all. Bodies whose boxes overlap are of different classes, each with surfaces of
//! its own.

use std::sync::Arc;

use super::Cuboid;
use super::narrowed::divided;
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use geometry::math::{Aabb, Interval, Vec3, norm};
use geometry::random::low_discrepancy;

/// Unions of no more surfaces are left as they are.
const MANY: usize = 32;
/// How far a box reaches beyond its body, in diagonals of the body's bounds: many grid steps, so that where it ends some surface of the
/// body is far outside, and the end is none of the solid.
const MARGIN: f64 = 0.2;
/// How much farther the last of the surfaces reaches than the first: ends that coincide would look like surfaces that do.
const SPREAD: f64 = 0.3;

/// Points at which functions are compared, and by what share of the farthest coordinate rounding tells equal ones apart.
const SAMPLES: usize = 16;
const ROUNDING: f64 = 1e-14;

/// A body: its bounds, its surfaces, and how they are combined.
pub(super) struct Body {
    pub bounds: Aabb,
    pub surfaces: Vec<Surface>,
    pub tree: CsgTree,
}

impl Body {
    fn is_packable(&self) -> bool {
        let plain = |s: &Surface| s.mesh.is_none() && s.creases.segments.is_empty();
        self.bounds.is_finite() && !self.bounds.is_empty() && self.surfaces.iter().all(plain)
    }

    /// Its bounds and all that its surfaces reach beyond.
    fn reach(&self, share: f64) -> Aabb {
        self.bounds.grown(MARGIN * (1.0 + SPREAD * share) * norm(self.bounds.size()))
    }
}

/// Adds the surfaces of the union of bodies and returns how they are combined.
pub(super) fn union(bodies: Vec<Body>, out: &mut Vec<Surface>) -> CsgTree {
    let count: usize = bodies.iter().map(|b| b.surfaces.len()).sum();
    let (alike, single): (Vec<Body>, Vec<Body>) = bodies.into_iter().partition(|b| count > MANY && b.is_packable());
    let mut classes: Vec<Vec<Body>> = single.into_iter().map(|b| vec![b]).collect();
    let first = classes.len();
    for body in alike {
        let reach = body.reach(1.0);
        let fits = |c: &&mut Vec<Body>| c[0].tree == body.tree && !c.iter().any(|b| b.reach(1.0).touches(&reach));
        match classes[first..].iter_mut().find(fits) {
            Some(class) => class.push(body),
            None => classes.push(vec![body]),
        }
    }
    let number = classes[first..].iter().map(|c| c[0].surfaces.len()).sum::<usize>();
    let mut shares = (0..number).map(|n| n as f64 / number as f64);
    let trees = classes.into_iter().enumerate().map(|(i, class)| {
        let own = out.len();
        for s in 0..class[0].surfaces.len() {
            let share = if i < first { 0.0 } else { shares.next().unwrap_or(0.0) };
            out.push(packed(&class, s, share));
        }
        class[0].tree.clone().renumbered(own)
    });
    CsgTree::Union(trees.collect())
}

/// Surface `s` of all bodies of a class.
fn packed(class: &[Body], s: usize, share: f64) -> Surface {
    let one = class[0].surfaces[s].clone();
    if is_one(class, s) {
        return one;
    }
    let boxed = |b: &Body| Cuboid { min: b.reach(share).min, max: b.reach(share).max };
    let of = class.iter().map(|b| (b.surfaces[s].field.clone(), boxed(b))).collect();
    let lipschitz = class.iter().map(|b| b.surfaces[s].lipschitz).fold(1.0, f64::max);
    Surface { field: Arc::new(Packed { of }), lipschitz, pair: None, plane: None, has_creases: true, ..one }
}

/// Whether surface `s` is the same function for all bodies of a class, such as the plane on which they stand.
fn is_one(class: &[Body], s: usize) -> bool {
    let bounds = class.iter().fold(Aabb::EMPTY, |all, b| all.union(b.bounds));
    let far = norm(bounds.min).max(norm(bounds.max));
    let points: Vec<Vec3> = (0..SAMPLES).map(|i| bounds.at(low_discrepancy(i + 1))).collect();
    let values = |b: &Body| {
        let mut out = vec![0.0; SAMPLES];
        b.surfaces[s].field.values(&points, &mut out);
        out
    };
    let first = values(&class[0]);
    let alike = |b: &Body| values(b).iter().zip(&first).all(|(v, w)| (v - w).abs() <= ROUNDING * far);
    class[1..].iter().all(alike)
}

/// minᵢ max(fᵢ, bᵢ).
struct Packed {
    of: Vec<(Arc<dyn Field>, Cuboid)>,
}

impl Packed {
    /// Those of a list that decide in a box: none is less than its box's distance.
    fn narrowed(&self, of: &[usize], b: &Aabb) -> Vec<usize> {
        let ranges: Vec<Interval> = of.iter().map(|i| self.of[*i].1.range(b)).collect();
        let nearest = (0..of.len()).min_by(|i, j| ranges[*i].lo.total_cmp(&ranges[*j].lo)).unwrap_or(0);
        let most = self.of[of[nearest]].0.bound(b).hi.max(ranges[nearest].hi);
        (0..of.len()).filter(|i| ranges[*i].lo <= most).map(|i| of[i]).collect()
    }

    /// Calls `each` with the number of a point, its value by one of those that may decide there, and which.
    fn each(&self, points: &[Vec3], each: &mut dyn FnMut(usize, f64, usize)) {
        divided(points, self.of.len(), &|of, b| self.narrowed(of, b), &mut |at, of| {
            let here: Vec<Vec3> = at.iter().map(|k| points[*k]).collect();
            let mut values = vec![0.0; here.len()];
            for i in of {
                let (field, about) = &self.of[*i];
                field.values(&here, &mut values);
                (0..here.len()).for_each(|k| each(at[k], values[k].max(about.distance(here[k])), *i));
            }
        });
    }
}

impl Field for Packed {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        out.fill(f64::INFINITY);
        self.each(points, &mut |k, v, _| out[k] = out[k].min(v));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        values.fill(f64::INFINITY);
        let mut deciding = vec![0; points.len()];
        self.each(points, &mut |k, v, i| {
            if v < values[k] {
                (values[k], deciding[k]) = (v, i);
            }
        });
        for (k, p) in points.iter().enumerate() {
            let (field, about) = &self.of[deciding[k]];
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            field.gradients(&[*p], &mut v, &mut g);
            gradients[k] = if about.distance(*p) > v[0] { about.gradient(*p) } else { g[0] };
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let near = self.narrowed(&Vec::from_iter(0..self.of.len()), b);
        let each = near.iter().map(|i| self.of[*i].0.bound(b).max(self.of[*i].1.range(b)));
        each.fold(Interval::new(f64::INFINITY, f64::INFINITY), Interval::min)
    }

    /// Nodes more than a cell outside all boxes have the least value that they may.
    fn fill(&self, block: &Block, out: &mut [f32]) {
        let widest = |axis: &[f64]| axis.windows(2).fold(0.0f64, |m, w| m.max(w[1] - w[0]));
        let cell = norm(block.axes.map(widest));
        if block.len() < 2 {
            return out
                .iter_mut()
                .zip(block.axes[0])
                .for_each(|(o, x)| *o = self.value([*x, block.axes[1][0], block.axes[2][0]]) as f32);
        }
        out.fill(cell as f32);
        let [nx, ny, _] = block.shape();
        for (field, about) in &self.of {
            let near = Aabb { min: about.min, max: about.max }.grown(cell);
            let from = [0, 1, 2].map(|a| block.axes[a].partition_point(|x| *x < near.min[a]));
            let to = [0, 1, 2].map(|a| block.axes[a].partition_point(|x| *x <= near.max[a]));
            if (0..3).any(|a| from[a] >= to[a]) {
                continue;
            }
            let part = Block { axes: [0, 1, 2].map(|a| &block.axes[a][from[a]..to[a]]) };
            let mut own = vec![0.0; part.len()];
            field.fill(&part, &mut own);
            let mut own = own.into_iter();
            for (k, z) in (from[2]..to[2]).zip(part.axes[2]) {
                for (j, y) in (from[1]..to[1]).zip(part.axes[1]) {
                    let row = (k * ny + j) * nx;
                    for ((o, x), v) in out[row + from[0]..row + to[0]].iter_mut().zip(part.axes[0]).zip(&mut own) {
                        *o = o.min(v.max(about.distance([*x, *y, *z]) as f32));
                    }
                }
            }
        }
    }
}
