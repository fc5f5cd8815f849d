//! Where lattices of a blend pass into each other, and how well they hold together there.
//!
//! The part is sampled on a grid of points. A *transition* of two lattices is where both count and no other counts
//! more. Solid points of it, and of the two lattices where they are alone, are neighbours along the axes. Taken in the
//! order of their depth below the surface, the deepest first, they grow together to bodies; when those of the two sides
//! meet, the depth reached is that of the widest way across: half the thickness of its narrowest neck.

use rayon::prelude::*;

use super::depth::depths;
use crate::blend::Blend;
use crate::field::Field;
use crate::solid::Solid;
use geometry::math::Vec3;

/// Largest number of sample points, and steps on the shortest wavelength where they suffice.
const MOST: f64 = 6e5;
const FINE: f64 = 16.0;
/// Shares of the second lattice at which the fraction is reported.
const BINS: usize = 10;
/// Where a lattice is alone nowhere, its side of a transition is where it counts most: a tenth of the way between the least and
/// the greatest share, if these are so far apart that there is a way.
const END: f32 = 0.1;
const WAY: f32 = 0.05;
/// What hangs by a neck thinner than this share of the widest way's neck is dangling.
const THIN: f64 = 0.5;

/// How two lattices pass into each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// Which two, by their places in the blend.
    pub between: [usize; 2],
    /// Volume in which both count, mm³.
    pub volume: f64,
    /// Bodies of solid, with what is theirs on either side, that come into it: one where it holds together.
    pub pieces: usize,
    /// Bodies of solid that touch neither side, and their volume, mm³. A side is where a lattice is alone, or else where it
    /// counts most.
    pub loose: (usize, f64),
    /// Bodies that hang by necks thinner than half the narrowest of the widest way, and their volume, mm³.
    pub dangling: (usize, f64),
    /// The narrowest neck of the widest way from one lattice to the other: its diameter (mm, to within a step) and place;
    /// `None` where no way leads across.
    pub neck: Option<(f64, Vec3)>,
    /// For tenths of the second's share from 0 to 1: the share in the middle, the solid fraction asked for and found, both
    /// in windows of two of the largest cells about the points (raised cosines, at half their height), and the number of
    /// points.
    pub fractions: Vec<[f64; 4]>,
    /// Distance between points, mm.
    pub step: f64,
}

/// The points of a grid over a region.
struct Points {
    shape: [usize; 3],
    /// For each point the lattices that count most and second, the share of the second among both, the fraction asked
    /// for, and whether it is solid; `None` outside.
    of: Vec<Option<Point>>,
}

#[derive(Clone, Copy)]
struct Point {
    first: u8,
    second: u8,
    share: f32,
    asked: f32,
    solid: bool,
}

/// Looks at every transition of the blend in the region; lattices alone, without skin and kept zones.
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
    let points = look(solid, blend, shape, &at);
    // The region's surface is a cut and no surface of the lattice: what lies outside is as good as solid.
    let open = |p: &Option<Point>| p.is_some_and(|p| !p.solid);
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
    let found = windows(&points, 2.0 * blend.longest() / step);
    pairs.into_iter().map(|pair| transition(&points, &depth, &found, pair, step, &at)).collect()
}

fn look(solid: &Solid, blend: &Blend, shape: [usize; 3], at: &(dyn Fn(usize) -> Vec3 + Sync)) -> Points {
    let n = blend.weights().len();
    let row = shape[0];
    let rows: Vec<Vec<Option<Point>>> = (0..shape[1] * shape[2])
        .into_par_iter()
        .map(|r| {
            let places: Vec<Vec3> = (r * row..(r + 1) * row).map(at).collect();
            let mut region = vec![0.0; row];
            solid.region.values(&places, &mut region);
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
                found[i] = Some(Point {
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

/// The fractions asked for and found about each point: means over a window that is a raised cosine along each axis and ends
/// `reach` points away, of what lies in the region.
fn windows(points: &Points, reach: f64) -> Vec<[f32; 2]> {
    let [nx, ny, nz] = points.shape;
    let most = reach.floor() as usize;
    let share = |d: usize| (1.0 + (std::f64::consts::PI * d as f64 / reach).cos()) as f32;
    let window: Vec<f32> = (0..=most).map(share).collect();
    let of = |p: &Option<Point>| p.map_or([0.0; 3], |p| [1.0, p.asked, f32::from(u8::from(p.solid))]);
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

/// A component with points in the transition itself, in addition to the two bits of the sides.
const WITHIN: u8 = 4;
/// The bits of the sides.
const SIDES: u8 = 3;

/// A body that grows: its points, whether it reaches either side.
struct Bodies {
    parent: Vec<u32>,
    sides: Vec<u8>,
    size: Vec<u32>,
}

impl Bodies {
    fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let up = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = up;
            i = up;
        }
        i
    }

    /// Joins two; which sides the whole reaches.
    fn join(&mut self, a: u32, b: u32) -> u8 {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            let (big, small) = if self.size[a as usize] >= self.size[b as usize] { (a, b) } else { (b, a) };
            self.parent[small as usize] = big;
            self.size[big as usize] += self.size[small as usize];
            self.sides[big as usize] |= self.sides[small as usize];
            return self.sides[big as usize];
        }
        self.sides[a as usize]
    }

    /// Bodies that reach neither side and the points in them, of the points that are in. Where there are no sides the
    /// greatest body stands for them.
    fn apart(&mut self, inside: &[bool]) -> (usize, u64) {
        let (mut count, mut all, mut most, mut sides) = (0usize, 0, 0, 0);
        for i in (0..self.parent.len()).filter(|i| inside[*i] && self.parent[*i] as usize == *i) {
            sides |= self.sides[i] & SIDES;
            if self.sides[i] & SIDES == 0 {
                let size = u64::from(self.size[i]);
                (count, all, most) = (count + 1, all + size, most.max(size));
            }
        }
        match sides {
            0 => (count.saturating_sub(1), all - most),
            _ => (count, all),
        }
    }

    /// Bodies that come into the transition, of the points that are in.
    fn pieces(&self, inside: &[bool]) -> usize {
        let own = |i: &usize| inside[*i] && self.parent[*i] as usize == *i;
        (0..inside.len()).filter(|i| own(i) && self.sides[*i] & WITHIN > 0).count()
    }
}

fn transition(
    points: &Points,
    depth: &[f32],
    found: &[[f32; 2]],
    pair: [u8; 2],
    step: f64,
    at: &(dyn Fn(usize) -> Vec3 + Sync),
) -> Transition {
    let [nx, ny, nz] = points.shape;
    let of_pair = |p: &Point| p.share > 0.0 && [p.first.min(p.second), p.first.max(p.second)] == pair;
    // The share of the second of the pair.
    let second = |p: &Point| match p.first == pair[0] {
        true => p.share,
        false => 1.0 - p.share,
    };
    let all = || points.of.iter().flatten();
    let (least, most) = all().filter(|p| of_pair(p)).map(second).fold((1f32, 0f32), |(l, m), s| (l.min(s), m.max(s)));
    let alone = |i: usize| all().any(|p| p.share == 0.0 && p.first == pair[i]);
    let reach = match most - least > WAY {
        true => END * (most - least),
        false => -1.0,
    };
    let ends = [0, 1].map(|i| if alone(i) { -1.0 } else { reach });
    let side = |p: &Point| match p.share {
        0.0 if p.first == pair[0] => 1u8,
        0.0 if p.first == pair[1] => 2,
        _ if of_pair(p) => {
            let first = second(p) - least <= ends[0];
            let last = most - second(p) <= ends[1];
            WITHIN | u8::from(first) | u8::from(last) << 1
        }
        _ => 0,
    };
    let cell = step.powi(3);
    let mut sums = vec![[0.0; 3]; BINS];
    let mut count = 0usize;
    let each = points.of.iter().zip(found);
    for (p, f) in each.filter_map(|(p, f)| p.as_ref().filter(|p| of_pair(p)).map(|p| (p, f))) {
        let share = f64::from(second(p));
        let s = &mut sums[((share * BINS as f64) as usize).min(BINS - 1)];
        *s = [s[0] + 1.0, s[1] + f64::from(f[0]), s[2] + f64::from(f[1])];
        count += 1;
    }
    let wanted = |p: &Option<Point>| p.is_some_and(|p| p.solid && (of_pair(&p) || side(&p) > 0));
    let mut order: Vec<u32> = (0..points.of.len() as u32).filter(|i| wanted(&points.of[*i as usize])).collect();
    order.sort_unstable_by(|a, b| depth[*b as usize].total_cmp(&depth[*a as usize]).then(a.cmp(b)));
    let anew = || Bodies {
        parent: (0..points.of.len() as u32).collect(),
        sides: points.of.iter().map(|p| p.as_ref().map_or(0, &side)).collect(),
        size: vec![1; points.of.len()],
    };
    let grow = |bodies: &mut Bodies, inside: &mut [bool], i: u32| {
        inside[i as usize] = true;
        let n = i as usize;
        let (x, y, z) = (n % nx, n / nx % ny, n / nx / ny);
        let own = bodies.find(i) as usize;
        let mut sides = bodies.sides[own];
        for (there, other) in [
            (x > 0, n.wrapping_sub(1)),
            (x + 1 < nx, n + 1),
            (y > 0, n.wrapping_sub(nx)),
            (y + 1 < ny, n + nx),
            (z > 0, n.wrapping_sub(nx * ny)),
            (z + 1 < nz, n + nx * ny),
        ] {
            if there && inside[other] {
                sides = bodies.join(i, other as u32);
            }
        }
        sides
    };
    let (mut bodies, mut inside) = (anew(), vec![false; points.of.len()]);
    let mut neck = None;
    for i in &order {
        if grow(&mut bodies, &mut inside, *i) & SIDES == SIDES && neck.is_none() {
            // Its own half step stands for the point's extent.
            neck = Some((2.0 * f64::from(depth[*i as usize]), at(*i as usize)));
        }
    }
    let (loose, lost) = bodies.apart(&inside);
    let pieces = bodies.pieces(&inside);
    let mut dangling = (0, 0.0);
    if let Some((wide, _)) = neck {
        let (mut bodies, mut inside) = (anew(), vec![false; points.of.len()]);
        for i in order.iter().filter(|i| 2.0 * f64::from(depth[**i as usize]) >= THIN * wide) {
            grow(&mut bodies, &mut inside, *i);
        }
        let (many, all) = bodies.apart(&inside);
        // Those that are loose hang by nothing.
        dangling = (many.saturating_sub(loose), (all.saturating_sub(lost)) as f64 * cell);
    }
    Transition {
        between: pair.map(usize::from),
        volume: count as f64 * cell,
        pieces,
        loose: (loose, lost as f64 * cell),
        dangling,
        neck,
        fractions: sums
            .iter()
            .enumerate()
            .filter(|(_, s)| s[0] > 0.0)
            .map(|(i, s)| [(i as f64 + 0.5) / BINS as f64, s[1] / s[0], s[2] / s[0], s[0]])
            .collect(),
        step,
    }
}
