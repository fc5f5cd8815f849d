//! Where lattices of a blend pass into each other, and how well they hold together there.
//!
//! The part is sampled on a grid of points. A *transition* of two lattices is where both have a weight and no other has a
//! larger one; its two *sides* are where either lattice is alone. Solid points of the transition and its sides make a graph,
//! adjacent along the axes. Added in descending order of their depth below the surface, they form connected components
//! (union-find, as in Kruskal's algorithm). When a component first touches both sides, the depth reached is that of the widest
//! path from side to side: half the thickness of its narrowest neck.

use rayon::prelude::*;

use super::grid_depth::depths;
use crate::blend::Blend;
use crate::field::{Block, Field};
use crate::solid::Solid;
use geometry::math::Vec3;
use geometry::union_find::{find, singles, unite};

/// Largest number of sample points, and steps on the shortest wavelength where they suffice.
const MOST: f64 = 6e5;
const FINE: f64 = 16.0;
/// Shares of the second lattice at which the fraction is reported.
const BINS: usize = 10;
/// Where a lattice is alone nowhere, its side of a transition is where its share is greatest: within this part of the range of
/// shares, if that range is not narrower than `LEAST_RANGE`.
const END: f32 = 0.1;
const LEAST_RANGE: f32 = 0.05;
/// A side counts as whole where its greatest component has this part of its solid, and at least so much of a cubic wavelength.
const WHOLE: [f64; 2] = [0.25, 0.1];
/// Components attached by a neck thinner than this multiple of the widest path's neck are dangling.
const THIN: f64 = 0.5;

/// How two lattices pass into each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// The two lattices, by their indices in the blend.
    pub between: [usize; 2],
    /// Volume in which both have a weight, mm³.
    pub volume: f64,
    /// Connected components of solid, their parts on either side included, that reach into it: one where it holds together.
    pub pieces: usize,
    /// Number of components that touch neither side, and their volume, mm³. A side is where a lattice is alone, or else where
    /// its share is greatest.
    pub loose: (usize, f64),
    /// Number of components attached by necks thinner than half the narrowest neck of the widest path, and their volume, mm³.
    pub dangling: (usize, f64),
    /// The narrowest neck of the widest path from one lattice to the other: its diameter (mm, to within a step) and position;
    /// `None` where no path leads across.
    pub neck: Option<(f64, Vec3)>,
    /// Where the first lattice's solid ends, if no path leads from it to the second's, be it outside the transition; `None`
    /// where one does, and where the grid is too coarse to tell.
    pub gap: Option<Vec3>,
    /// For tenths of the second lattice's share from 0 to 1: the middle of the tenth, the solid fraction asked for and found, both
    /// means over windows of two of the largest cells about the points (raised cosines, at half their height), and the number
    /// of points.
    pub fractions: Vec<[f64; 4]>,
    /// Distance between points, mm.
    pub step: f64,
}

/// The points of a grid over a region.
struct Points {
    shape: [usize; 3],
    /// `None` outside the region.
    of: Vec<Option<BlendSample>>,
}

#[derive(Clone, Copy)]
struct BlendSample {
    /// The lattices of greatest and second greatest weight.
    first: u8,
    second: u8,
    /// The share of the second among both.
    share: f32,
    /// The solid fraction asked for.
    asked: f32,
    solid: bool,
}

/// Every transition of the blend in the region, of the lattices alone, without skin and keep zones.
pub fn transitions(solid: &Solid, blend: &Blend) -> Vec<Transition> {
    let b = solid.region.bounds();
    let size = b.size();
    let volume: f64 = size.iter().product();
    let step = (solid.wavelength / FINE).max((volume / MOST).cbrt());
    let shape = size.map(|s| (s / step).ceil().max(1.0) as usize);
    let at = |i: usize| -> Vec3 {
        let n = [i % shape[0], i / shape[0] % shape[1], i / shape[0] / shape[1]];
        core::array::from_fn(|a| b.min[a] + (n[a] as f64 + 0.5) * size[a] / shape[a] as f64)
    };
    let points = sample(solid, blend, shape, &at);
    // The region's surface is a cut and no surface of the lattice: points outside count as solid.
    let open = |p: &Option<BlendSample>| p.is_some_and(|p| !p.solid);
    let open: Vec<bool> = points.of.iter().map(open).collect();
    let depth = depths(&open, shape, step);
    let mut pairs: Vec<[u8; 2]> = Vec::new();
    for p in points.of.iter().flatten().filter(|p| p.share > 0.0) {
        let pair = [p.first.min(p.second), p.first.max(p.second)];
        if !pairs.contains(&pair) {
            pairs.push(pair);
        }
    }
    pairs.sort_unstable();
    let means = windows(&points, 2.0 * blend.longest() / step);
    let least = (WHOLE[1] * (solid.wavelength / step).powi(3)).ceil() as usize;
    let grid = SampledPart { points: &points, depth: &depth, step, at: &at, least };
    pairs.into_iter().map(|pair| grid.transition(&LatticePair::new(&points, pair), &means)).collect()
}

/// Samples the blend at the points of the grid, in parallel by rows along x.
fn sample(solid: &Solid, blend: &Blend, shape: [usize; 3], at: &(dyn Fn(usize) -> Vec3 + Sync)) -> Points {
    let n = blend.weights().len();
    let row = shape[0];
    let axes = [[0, 1], [1, row], [2, row * shape[1]]]
        .map(|[a, stride]| -> Vec<f64> { (0..shape[a]).map(|i| at(i * stride)[a]).collect() });
    // Signs alone count: a region fills them faster than distances.
    let layers = axes[2].par_iter().map(|z| {
        let mut region = vec![0f32; row * shape[1]];
        let layer = Block { axes: [&axes[0], &axes[1], std::slice::from_ref(z)] };
        solid.region.fill_level(&layer, 0.0, &mut region);
        region
    });
    let region: Vec<f32> = layers.collect::<Vec<_>>().concat();
    let rows: Vec<Vec<Option<BlendSample>>> = (0..shape[1] * shape[2])
        .into_par_iter()
        .map(|r| {
            let places: Vec<Vec3> = (r * row..(r + 1) * row).map(at).collect();
            let region = &region[r * row..(r + 1) * row];
            let inside: Vec<usize> = (0..row).filter(|i| region[*i] <= 0.0).collect();
            let places: Vec<Vec3> = inside.iter().map(|i| places[*i]).collect();
            let zeros = || vec![0.0; places.len()];
            let (mut w, mut value, mut asked) = (vec![0.0; n * places.len()], zeros(), zeros());
            blend.weights().values(&places, &mut w);
            blend.values(&places, &mut value);
            blend.fractions(&places, &mut asked);
            let mut found = vec![None; row];
            for (k, i) in inside.into_iter().enumerate() {
                let w = &w[k * n..][..n];
                let first = (0..n).fold(0, |m, k| if w[k] > w[m] { k } else { m });
                let rest = (0..n).filter(|k| *k != first);
                let Some(second) = rest.reduce(|m, k| if w[k] > w[m] { k } else { m }) else {
                    continue;
                };
                found[i] = Some(BlendSample {
                    first: first as u8,
                    second: second as u8,
                    share: (w[second] / (w[first] + w[second])) as f32,
                    asked: asked[k] as f32,
                    solid: value[k] <= 0.0,
                });
            }
            found
        })
        .collect();
    Points { shape, of: rows.into_iter().flatten().collect() }
}

/// The fractions asked for and found about each point: means over the points of the region in a window that is a raised cosine
/// along each axis and ends `reach` points away.
fn windows(points: &Points, reach: f64) -> Vec<[f32; 2]> {
    let [nx, ny, nz] = points.shape;
    let most = reach.floor() as usize;
    let share = |d: usize| (1.0 + (std::f64::consts::PI * d as f64 / reach).cos()) as f32;
    let window: Vec<f32> = (0..=most).map(share).collect();
    let of = |p: &Option<BlendSample>| p.map_or([0.0; 3], |p| [1.0, p.asked, f32::from(u8::from(p.solid))]);
    let mut sums: Vec<[f32; 3]> = points.of.iter().map(of).collect();
    for (length, stride) in [(nx, 1), (ny, nx), (nz, nx * ny)] {
        let old = sums;
        sums = (0..old.len())
            .into_par_iter()
            .map(|n| {
                let i = n / stride % length;
                let mut sum = [0f32; 3];
                for j in i.saturating_sub(most)..(i + most + 1).min(length) {
                    let (w, v) = (window[i.abs_diff(j)], old[n + j * stride - i * stride]);
                    (0..3).for_each(|c| sum[c] += w * v[c]);
                }
                sum
            })
            .collect();
    }
    sums.into_iter().map(|s| [s[1] / s[0].max(1e-30), s[2] / s[0].max(1e-30)]).collect()
}

/// Marks of points and components: in the first lattice's side, in the second's, in the transition itself.
const FIRST: u8 = 1;
const SECOND: u8 = 2;
const SIDES: u8 = FIRST | SECOND;
const WITHIN: u8 = 4;

/// Two lattices, and where the sides of their transition are.
struct LatticePair {
    of: [u8; 2],
    /// The least and greatest share of the second in the transition.
    range: [f32; 2],
    /// How far from the least and the greatest share the sides extend; negative where a lattice is alone somewhere, or where the
    /// range is too narrow.
    ends: [f32; 2],
}

impl LatticePair {
    fn new(points: &Points, of: [u8; 2]) -> LatticePair {
        let mut pair = LatticePair { of, range: [1.0, 0.0], ends: [-1.0; 2] };
        let all = || points.of.iter().flatten();
        let shares = all().filter(|p| pair.contains(p)).map(|p| pair.share_of_second(p));
        let (least, most) = shares.fold((1f32, 0f32), |(l, m), s| (l.min(s), m.max(s)));
        pair.range = [least, most];
        let end = if most - least > LEAST_RANGE { END * (most - least) } else { -1.0 };
        let alone = |i: usize| all().any(|p| p.share == 0.0 && p.first == of[i]);
        pair.ends = [0, 1].map(|i| if alone(i) { -1.0 } else { end });
        pair
    }

    /// Whether a point lies in the transition.
    fn contains(&self, p: &BlendSample) -> bool {
        p.share > 0.0 && [p.first.min(p.second), p.first.max(p.second)] == self.of
    }

    /// The share of the second of the pair at a point of the transition.
    fn share_of_second(&self, p: &BlendSample) -> f32 {
        if p.first == self.of[0] { p.share } else { 1.0 - p.share }
    }

    /// The marks of a point; none where other lattices are.
    fn marks(&self, p: &BlendSample) -> u8 {
        match p.share {
            0.0 if p.first == self.of[0] => FIRST,
            0.0 if p.first == self.of[1] => SECOND,
            _ if self.contains(p) => {
                let [least, most] = self.range;
                let first = self.share_of_second(p) - least <= self.ends[0];
                let second = most - self.share_of_second(p) <= self.ends[1];
                let mark = |in_side, mark| if in_side { mark } else { 0 };
                WITHIN | mark(first, FIRST) | mark(second, SECOND)
            }
            _ => 0,
        }
    }

    /// Fills `Transition::fractions`, and the number of points in the transition; `means` are the fractions asked for and found
    /// about each point.
    fn fractions(&self, points: &Points, means: &[[f32; 2]]) -> (Vec<[f64; 4]>, usize) {
        let mut sums = vec![[0.0; 3]; BINS];
        let mut count = 0;
        for (p, [asked, found]) in points.of.iter().zip(means) {
            let Some(p) = p.as_ref().filter(|p| self.contains(p)) else { continue };
            let share = f64::from(self.share_of_second(p));
            let s = &mut sums[((share * BINS as f64) as usize).min(BINS - 1)];
            *s = [s[0] + 1.0, s[1] + f64::from(*asked), s[2] + f64::from(*found)];
            count += 1;
        }
        let filled = sums.iter().enumerate().filter(|(_, s)| s[0] > 0.0);
        let each = filled.map(|(i, s)| [(i as f64 + 0.5) / BINS as f64, s[1] / s[0], s[2] / s[0], s[0]]);
        (each.collect(), count)
    }
}

/// Connected components of the points added so far.
struct PointComponents {
    shape: [usize; 3],
    root: Vec<u32>,
    added: Vec<bool>,
    /// Of each root: the marks of its component's points, and their number.
    marks: Vec<u8>,
    size: Vec<u32>,
}

impl PointComponents {
    fn new(points: &Points, pair: &LatticePair) -> PointComponents {
        let count = points.of.len();
        PointComponents {
            shape: points.shape,
            root: singles(count),
            added: vec![false; count],
            marks: points.of.iter().map(|p| p.as_ref().map_or(0, |p| pair.marks(p))).collect(),
            size: vec![1; count],
        }
    }

    /// Adds a point and joins it to its neighbours along the axes; the marks of its component.
    fn add(&mut self, i: u32) -> u8 {
        let n = i as usize;
        self.added[n] = true;
        let [nx, ny, nz] = self.shape;
        let (x, y, z) = (n % nx, n / nx % ny, n / nx / ny);
        for (exists, other) in [
            (x > 0, n.wrapping_sub(1)),
            (x + 1 < nx, n + 1),
            (y > 0, n.wrapping_sub(nx)),
            (y + 1 < ny, n + nx),
            (z > 0, n.wrapping_sub(nx * ny)),
            (z + 1 < nz, n + nx * ny),
        ] {
            if exists && self.added[other] {
                self.join(i, other as u32);
            }
        }
        self.marks[find(&mut self.root, i) as usize]
    }

    fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [a, b].map(|i| find(&mut self.root, i));
        if unite(&mut self.root, a, b) {
            let (root, other) = (a.min(b) as usize, a.max(b) as usize);
            self.size[root] += self.size[other];
            self.marks[root] |= self.marks[other];
        }
    }

    fn roots(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.root.len()).filter(|i| self.added[*i] && self.root[*i] as usize == *i)
    }

    /// Number of components that touch neither side, and of their points. Where there are no sides the largest component takes
    /// their place.
    fn loose(&self) -> (usize, u64) {
        let (mut count, mut all, mut most, mut sides) = (0usize, 0, 0, 0);
        for i in self.roots() {
            sides |= self.marks[i] & SIDES;
            if self.marks[i] & SIDES == 0 {
                let size = u64::from(self.size[i]);
                (count, all, most) = (count + 1, all + size, most.max(size));
            }
        }
        match sides {
            0 => (count.saturating_sub(1), all - most),
            _ => (count, all),
        }
    }

    /// Number of components that reach into the transition.
    fn pieces(&self) -> usize {
        self.roots().filter(|i| self.marks[*i] & WITHIN > 0).count()
    }
}

/// The sampled part.
struct SampledPart<'a> {
    points: &'a Points,
    /// Depth of each point below the surface, mm.
    depth: &'a [f32],
    /// Distance between points, mm.
    step: f64,
    /// Position of a point, mm.
    at: &'a dyn Fn(usize) -> Vec3,
    /// Number of solid points from which a side may count as whole.
    least: usize,
}

impl SampledPart<'_> {
    /// The solid points of a transition and its sides, the deepest first.
    fn deepest_first(&self, pair: &LatticePair) -> Vec<u32> {
        let wanted = |p: &Option<BlendSample>| p.is_some_and(|p| p.solid && pair.marks(&p) > 0);
        let mut order: Vec<u32> =
            (0..self.points.of.len() as u32).filter(|i| wanted(&self.points.of[*i as usize])).collect();
        order.sort_unstable_by(|a, b| self.depth[*b as usize].total_cmp(&self.depth[*a as usize]).then(a.cmp(b)));
        order
    }

    /// Thickness of the solid at a point. (A point's half step stands for its extent.)
    fn thickness(&self, i: u32) -> f64 {
        2.0 * f64::from(self.depth[i as usize])
    }

    /// `Transition::gap` of a pair no component of which touches both sides.
    fn gap(&self, pair: &LatticePair) -> Option<Vec3> {
        let all = || self.points.of.iter().enumerate().filter_map(|(i, p)| Some((i, p.as_ref().filter(|p| p.solid)?)));
        let mut components = PointComponents::new(self.points, pair);
        all().for_each(|(i, _)| _ = components.add(i as u32));
        // Another lattice may lead across.
        if components.roots().any(|i| components.marks[i] & SIDES == SIDES) {
            return None;
        }
        // Walls thinner than a step fall apart on either side too, and tell nothing.
        let main = [FIRST, SECOND].map(|side| {
            let mut counts = vec![0usize; self.points.of.len()];
            let mut sum = 0u32;
            for (i, _) in all().filter(|(_, p)| pair.marks(p) & side > 0) {
                counts[find(&mut components.root, i as u32) as usize] += 1;
                sum += 1;
            }
            let (root, most) = (0..counts.len()).map(|i| (i, counts[i])).max_by_key(|c| (c.1, usize::MAX - c.0))?;
            (most >= self.least && most as f64 >= WHOLE[0] * f64::from(sum)).then_some(root)
        });
        let [Some(first), Some(_)] = main else { return None };
        let ends = all().filter(|(i, p)| pair.marks(p) > 0 && find(&mut components.root, *i as u32) as usize == first);
        let last = ends.max_by(|(i, p), (j, q)| {
            let [a, b] = [p, q].map(|p| pair.share_of_second(p));
            a.total_cmp(&b).then(j.cmp(i))
        });
        last.map(|(i, _)| (self.at)(i))
    }

    fn transition(&self, pair: &LatticePair, means: &[[f32; 2]]) -> Transition {
        let order = self.deepest_first(pair);
        let mut components = PointComponents::new(self.points, pair);
        let mut neck = None;
        for i in &order {
            if components.add(*i) & SIDES == SIDES && neck.is_none() {
                neck = Some((self.thickness(*i), (self.at)(*i as usize)));
            }
        }
        let (loose, loose_points) = components.loose();
        let mut dangling = (0, 0);
        if let Some((wide, _)) = neck {
            let mut thick = PointComponents::new(self.points, pair);
            for i in order.iter().filter(|i| self.thickness(**i) >= THIN * wide) {
                thick.add(*i);
            }
            let (apart, points) = thick.loose();
            // Loose components are not attached at all.
            dangling = (apart.saturating_sub(loose), points.saturating_sub(loose_points));
        }
        let (fractions, count) = pair.fractions(self.points, means);
        let volume = self.step.powi(3);
        Transition {
            between: pair.of.map(usize::from),
            volume: count as f64 * volume,
            pieces: components.pieces(),
            loose: (loose, loose_points as f64 * volume),
            dangling: (dangling.0, dangling.1 as f64 * volume),
            neck,
            gap: if neck.is_none() { self.gap(pair) } else { None },
            fractions,
            step: self.step,
        }
    }
}
