//! The faces as fields, sampled all at once.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use super::super::NOTHING;
use super::super::tree::Hit;
use super::{Creased, MIXED, NEAR, Part, REACH, Values};
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, norm, sub};

/// A face of a mesh with creases.
pub(super) struct OfCrease {
    pub(super) of: Arc<Creased>,
    pub(super) part: Part,
}

impl OfCrease {
    /// The value of the face by those of all. Far outside, the first color stands for all.
    fn pick(&self, values: &Values) -> f64 {
        let (on, off) = (self.of.step, self.of.off(self.part));
        let switch = |word: u32, i: usize| if word >> i & 1 == 1 { on } else { off };
        match self.part {
            Part::Color(c) => f64::from(values.color(c, off as f32)),
            Part::Alone(c) => switch(values.alone, c),
            Part::Set(s) => switch(values.sets, s),
        }
    }

    /// The value at distance `d` from the surface, where that is far: no matter how far, for it may not be known.
    fn far(&self, d: f64) -> f64 {
        match self.part {
            Part::Color(0) => (NEAR * self.of.step).copysign(d),
            Part::Alone(0) if d > 0.0 => self.of.step,
            _ => self.of.off(self.part),
        }
    }

    fn at(&self, p: Vec3, seed: &mut u32, hits: &mut Vec<Hit>) -> (f64, Vec3) {
        let (of, region) = (&*self.of, &*self.of.region);
        let hit = region.tree.nearest(p, *seed);
        *seed = hit.triangle;
        let d = region.signed(&hit, p, NOTHING);
        if d.abs() > NEAR * of.step {
            return (self.far(d), region.gradient(&hit, d));
        }
        let color = usize::from(of.color[of.patch[hit.triangle as usize] as usize]);
        if matches!(self.part, Part::Color(c) if c == color) {
            let m = of.member(p, &hit);
            return (m.value, m.gradient);
        }
        of.around(p, REACH * of.step, hits);
        let (values, members) = of.values_at(p, d, hits);
        let gradient = members
            .iter()
            .find(|m| matches!(self.part, Part::Color(c) if usize::from(of.color[m.patch as usize]) == c))
            .map_or(region.gradient(&hit, d), |m| m.gradient);
        (self.pick(&values), gradient)
    }
}

impl Field for OfCrease {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut seed, mut hits) = (0, Vec::new());
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.at(*p, &mut seed, &mut hits).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut seed, mut hits) = (0, Vec::new());
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            (*v, *g) = self.at(*p, &mut seed, &mut hits);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let of = &*self.of;
        let found = of.boxes.get(key(b.min, b.max), || {
            let d = of.region.value(b.center());
            let reach = norm(b.size()) / 2.0 * (1.0 + 1e-9);
            let colors = if d.abs() - reach > NEAR * of.step {
                0
            } else {
                of.colors_near(b)
            };
            (d, colors)
        });
        let ((d, colors), off) = (*found, of.off(self.part));
        let far = colors == 0;
        let live = match self.part {
            Part::Color(c) | Part::Alone(c) => c == 0 || colors >> c & 1 == 1,
            Part::Set(s) => of.sets[s].colors & !colors == 0,
        };
        match self.part {
            Part::Color(0) if far => of.region.bound(b),
            Part::Alone(0) if far && d > 0.0 => Interval::new(of.step, of.step),
            _ if !far && live => Interval::new(f64::NEG_INFINITY, f64::INFINITY),
            _ => Interval::new(off, off),
        }
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        if block.is_empty() {
            return;
        }
        let b = block.bounds();
        let shape = block.shape();
        let mut key = key(b.min, b.max);
        key.extend(shape.map(|n| n as u64));
        let s = self.of.samples.get(key, || Samples::new(&self.of, block));
        for (o, (d, tag)) in out.iter_mut().zip(s.distance.iter().zip(&s.tag)) {
            let color = usize::from(*tag);
            *o = match self.part {
                _ if *tag == FAR => self.far(f64::from(*d)) as f32,
                Part::Color(c) if c == color => *d,
                Part::Alone(c) if c == color => self.of.step as f32,
                _ => self.of.off(self.part) as f32,
            };
        }
        for (i, values) in &s.several {
            out[*i as usize] = self.pick(values) as f32;
        }
    }
}

fn key(a: Vec3, b: Vec3) -> Vec<u64> {
    a.iter().chain(&b).map(|x| x.to_bits()).collect()
}

impl Creased {
    /// The colors of the patches that may be near to a node of a box.
    fn colors_near(&self, b: &Aabb) -> u32 {
        let b = b.grown(REACH * self.step * (1.0 + 1e-9));
        let all = (1u32 << self.colors) - 1;
        let (tree, mut found) = (&self.region.tree, 1u32);
        let mut stack = vec![0u32];
        while let Some(i) = stack.pop() {
            let node = &tree.nodes()[i as usize];
            let patch = self.nodes[i as usize];
            let known = patch != MIXED && found >> self.color[patch as usize] & 1 == 1;
            if known || found == all || node.bounds.intersection(b).is_empty() {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.at, i + 1]);
                continue;
            }
            for k in node.at..node.at + node.count {
                let corners = tree.faces()[k as usize].corners;
                let own = corners.iter().fold(Aabb::EMPTY, |a, p| a.with(*p));
                if !own.intersection(b).is_empty() {
                    found |= 1 << self.color[self.patch[k as usize] as usize];
                }
            }
        }
        found
    }
}

/// Nodes with the values of no patch, and of several.
const FAR: u8 = u8::MAX;
const SEVERAL: u8 = u8::MAX - 1;

/// The values of all faces at the nodes of a block.
pub(super) struct Samples {
    /// Signed distances; where they are large, numbers of their sign that are smaller but not too small.
    distance: Vec<f32>,
    /// The color of the only patch near to the node, or `FAR`, or `SEVERAL`.
    tag: Vec<u8>,
    several: Vec<(u32, Values)>,
}

impl Samples {
    fn new(of: &Creased, block: &Block) -> Samples {
        let mut fill = Fill {
            of,
            block,
            out: Samples {
                distance: vec![0.0; block.len()],
                tag: vec![FAR; block.len()],
                several: Vec::new(),
            },
            hits: Vec::new(),
        };
        fill.part([0; 3], block.shape(), 0);
        fill.out
    }
}

struct Fill<'a> {
    of: &'a Creased,
    block: &'a Block<'a>,
    out: Samples,
    hits: Vec<Hit>,
}

impl Fill<'_> {
    /// Fills the nodes from `lo` up to `hi`, `seed` being a triangle that may be near: halves them until they are far
    /// from the surface or few.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], seed: u32) {
        let (of, axes) = (self.of, self.block.axes);
        let ends = [0, 1, 2].map(|a| [axes[a][lo[a]], axes[a][hi[a] - 1]]);
        let center = ends.map(|[a, b]| a + (b - a) / 2.0);
        let size = ends.map(|[a, b]| b - a);
        let half = norm(size) / 2.0 * (1.0 + 1e-9);
        let hit = of.region.tree.nearest(center, seed);
        let d = of.region.signed(&hit, center, NOTHING);
        if d.abs() > half + NEAR * of.step {
            self.each(lo, hi, |fill, i, p| {
                fill.out.distance[i] = (d.abs() - norm(sub(p, center))).copysign(d) as f32;
            });
            return;
        }
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        if (0..3).map(|a| hi[a] - lo[a]).product::<usize>() > 8 && hi[longest] - lo[longest] > 1 {
            let middle = (lo[longest] + hi[longest]) / 2;
            let (mut end, mut begin) = (hi, lo);
            end[longest] = middle;
            begin[longest] = middle;
            self.part(lo, end, hit.triangle);
            self.part(begin, hi, hit.triangle);
            return;
        }
        let reach = REACH * of.step;
        let mut hits = std::mem::take(&mut self.hits);
        of.around(center, reach + half, &mut hits);
        let single = hits.len() < 2;
        let mut seed = hit.triangle;
        self.each(lo, hi, |fill, i, p| {
            let hit = of.region.tree.nearest(p, seed);
            seed = hit.triangle;
            let d = of.region.signed(&hit, p, NOTHING);
            fill.out.distance[i] = d as f32;
            if d.abs() > NEAR * of.step {
                return;
            }
            if !single {
                of.around(p, reach, &mut hits);
            }
            if single || hits.len() < 2 {
                fill.out.tag[i] = of.color[of.patch[hit.triangle as usize] as usize];
                return;
            }
            fill.out.tag[i] = SEVERAL;
            let values = of.values_at(p, d, &hits).0;
            fill.out.several.push((i as u32, values));
        });
        self.hits = hits;
    }

    fn each(&mut self, lo: [usize; 3], hi: [usize; 3], mut at: impl FnMut(&mut Self, usize, Vec3)) {
        let [nx, ny, _] = self.block.shape();
        let [xs, ys, zs] = self.block.axes;
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    at(self, (k * ny + j) * nx + i, [xs[i], ys[j], zs[k]]);
                }
            }
        }
    }
}

/// The last few things that were computed.
pub(super) struct Recent<T>(Mutex<VecDeque<(Vec<u64>, Arc<T>)>>);

impl<T> Default for Recent<T> {
    fn default() -> Recent<T> {
        Recent(Mutex::new(VecDeque::new()))
    }
}

impl<T> Recent<T> {
    /// What belongs to a key, made if it is not at hand.
    fn get(&self, key: Vec<u64>, make: impl FnOnce() -> T) -> Arc<T> {
        let held =
            |q: &VecDeque<(Vec<u64>, Arc<T>)>| q.iter().find(|e| e.0 == key).map(|e| e.1.clone());
        if let Some(known) = self.0.lock().ok().and_then(|q| held(&q)) {
            return known;
        }
        let new = Arc::new(make());
        if let Ok(mut q) = self.0.lock() {
            while q.len() > rayon::current_num_threads() {
                q.pop_front();
            }
            q.push_back((key, new.clone()));
        }
        new
    }
}
