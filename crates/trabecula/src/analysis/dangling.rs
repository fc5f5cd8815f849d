//! Bits that hang on a part by a thread: where a region cuts a lattice, what is left of a wall or a strut may be held by
//! less than the lattice itself ever is.
//!
//! Near the region's surface the part is sampled on a grid. Solid points that lie at least a quarter of the lattice's
//! narrowest neck below the surface, cuts included, are joined along the axes to bodies. The lattice holds together as one
//! of them, as its own necks are twice as thick. A small one that is thicker than that somewhere hangs by a neck thinner than
//! half the lattice's, or by nothing.
//!
//! Blocks of the grid are processed one by one, each with a margin, so that memory does not grow with the part. A bit is the
//! block's in which its first point is.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::grid_depth::depths;
use crate::field::{Block, Field};
use crate::solid::Solid;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3};
use geometry::progress::{Progress, Stopped};

/// What hangs by a neck thinner than this share of the lattice's own is dangling.
const THIN: f64 = 0.5;
/// Steps of the grid on that neck. The lattice's own is twice as thick, six steps: its middle is at most √3/2 steps from a point,
/// which so lies 2.1 steps or more from any open one, above the two that are asked for.
const STEPS: f64 = 3.0;
/// How far a bit may reach, in such necks; at most half a wavelength. What lies deeper is taken as solid.
const FAR: f64 = 5.0;
/// Points of a block along each axis without its margins, and of the cubes that are passed over where nothing of the layer is.
const CORE: i64 = 96;
const CUBE: usize = 8;
/// Most points in all: beyond it a look would take days.
const MOST: f64 = 1e12;

/// Weakly attached fragments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "DanglingReport")]
pub struct Dangling {
    /// Their number.
    pub count: usize,
    /// Their volume in all, mm³.
    pub volume: f64,
    /// The largest of them.
    pub largest: Option<LargestFragment>,
    /// The neck below which a fragment counts, mm.
    pub neck: f64,
    /// Distance between sample points, mm.
    pub step: f64,
}

/// The largest weakly attached fragment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LargestFragment {
    /// Volume, mm³.
    pub volume: f64,
    /// A point in it, mm.
    pub place: [f64; 3],
}

/// Looks for fragments of a solid that hang by necks thinner than half of `neck` (mm), the narrowest of its lattice.
///
/// Volumes are those of the points nearest to each fragment, to within some hundredths; a neck is known to within a step. What is
/// held by several such necks counts as well; what is thinner than one all over is seen where it is apart.
///
/// # Errors
/// A neck that is not above zero, or so thin that the grid would have more than 10¹² points; interruption.
pub fn dangling(solid: &Solid, neck: f64, progress: &dyn Progress) -> Result<Dangling, Stopped> {
    if !(neck > 0.0 && neck.is_finite()) {
        let message = format!("neck is {} mm; it must be above 0", number(neck));
        return Err(Stopped::Refused(Fault::new("neck", message)));
    }
    let thin = THIN * neck;
    let step = thin / STEPS;
    let bounds = solid.region.bounds();
    let points: f64 = bounds.size().iter().map(|s| s / step + 1.0).product();
    if points > MOST {
        let message = format!(
            "a neck of {} mm in a part of {} × {} × {} mm takes {points:.1e} points; look at a smaller part",
            number(neck),
            number(bounds.size()[0]),
            number(bounds.size()[1]),
            number(bounds.size()[2])
        );
        return Err(Stopped::Refused(Fault::new("neck", message)));
    }
    let reach = (FAR * thin).min(solid.wavelength / 2.0);
    // In halves of cubes, so that a block is whole cubes.
    let half = CUBE as i64 / 2;
    let margin = (reach / step / half as f64).ceil() as i64 * half;
    let counts = bounds.size().map(|s| (s / step / CORE as f64).ceil().max(1.0) as i64);
    let corners: Vec<[i64; 3]> = (0..counts[2])
        .flat_map(|z| (0..counts[1]).flat_map(move |y| (0..counts[0]).map(move |x| [x, y, z].map(|n| n * CORE))))
        .collect();
    let search = BlockSearch { solid, thin, step, margin, from: bounds.min };
    let done = std::sync::atomic::AtomicU64::new(0);
    let found: Option<Vec<Vec<(f64, Vec3)>>> = corners
        .par_iter()
        .map(|corner| {
            let bits = search.block(*corner);
            let n = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            progress.step(n, corners.len() as u64).then_some(bits)
        })
        .collect();
    let bits: Vec<(f64, Vec3)> = found.ok_or(Stopped::Interrupted)?.concat();
    Ok(Dangling {
        count: bits.len(),
        volume: bits.iter().fold(0.0, |sum, b| sum + b.0),
        largest: bits
            .iter()
            .copied()
            .reduce(|a, b| if b.0 > a.0 { b } else { a })
            .map(|(volume, place)| LargestFragment { volume, place }),
        neck: thin,
        step,
    })
}

/// What is the same for all blocks.
struct BlockSearch<'a> {
    solid: &'a Solid,
    thin: f64,
    step: f64,
    margin: i64,
    from: Vec3,
}

impl BlockSearch<'_> {
    /// The bits whose first point is in the block at this corner.
    fn block(&self, corner: [i64; 3]) -> Vec<(f64, Vec3)> {
        let side = (CORE + 2 * self.margin) as usize;
        // Half a step inwards, so that no point lies on a face of the bounds.
        let place = |a: usize, n: usize| self.from[a] + ((corner[a] - self.margin + n as i64) as f64 + 0.5) * self.step;
        let axes: [Vec<f64>; 3] = [0, 1, 2].map(|a| (0..side).map(|n| place(a, n)).collect());
        let reach = self.margin as f64 * self.step;
        let core =
            Aabb { min: [0, 1, 2].map(|a| axes[a][0] + reach), max: [0, 1, 2].map(|a| axes[a][side - 1] - reach) };
        let region = self.solid.region.bound(&core);
        // Nothing of the region is here, or nothing of its surface near.
        if region.lo > 0.0 || region.hi < -reach {
            return Vec::new();
        }
        let open = self.open(&axes);
        let depth = depths(&open, [side; 3], self.step);
        let mut owner = vec![0u32; open.len()];
        // The first stands for no body.
        let mut bodies = vec![BlockComponent::at(0)];
        let mut stack = Vec::new();
        for i in 0..open.len() {
            if owner[i] != 0 || open[i] || 2.0 * f64::from(depth[i]) < self.thin {
                continue;
            }
            let name = bodies.len() as u32;
            let mut body = BlockComponent::at(i);
            let mut deepest = 0f32;
            owner[i] = name;
            stack.push(i);
            while let Some(i) = stack.pop() {
                body.reach(i, side);
                deepest = deepest.max(depth[i]);
                for j in around(i, side).into_iter().flatten() {
                    if owner[j] == 0 && !open[j] && 2.0 * f64::from(depth[j]) >= self.thin {
                        owner[j] = name;
                        stack.push(j);
                    }
                }
            }
            // Less than a step more than a neck is no body that hangs by one.
            body.bulges = 2.0 * f64::from(deepest) >= self.thin + self.step;
            bodies.push(body);
        }
        self.spread(&open, &mut owner, &mut bodies, side);
        let within = |i: usize| {
            let n = [i % side, i / side % side, i / side / side];
            n.iter().all(|n| (self.margin..self.margin + CORE).contains(&(*n as i64)))
        };
        let own = bodies.iter().skip(1).filter(|b| b.bulges && b.is_within(self.margin as usize) && within(b.first));
        own.map(|b| {
            let n = [b.first % side, b.first / side % side, b.first / side / side];
            let at = core::array::from_fn(|a| axes[a][n[a]]);
            (b.size as f64 * self.step.powi(3), at)
        })
        .collect()
    }

    /// Whether nothing is solid at the points of a cube of them.
    fn open(&self, axes: &[Vec<f64>; 3]) -> Vec<bool> {
        let side = axes[0].len();
        let cubes = side / CUBE;
        let middle = |n: usize, a: usize| 0.5 * (axes[a][n * CUBE] + axes[a][n * CUBE + CUBE - 1]);
        let number = |i: usize| [i % cubes, i / cubes % cubes, i / cubes / cubes];
        let middles: Vec<Vec3> = (0..cubes.pow(3)).map(|i| core::array::from_fn(|a| middle(number(i)[a], a))).collect();
        let mut distance = vec![0.0; middles.len()];
        self.solid.region.values(&middles, &mut distance);
        let around = 0.5 * (CUBE - 1) as f64 * 3f64.sqrt() * self.step;
        let deep = self.margin as f64 * self.step + around;
        let mut open = vec![false; side.pow(3)];
        let mut values = vec![0f32; CUBE.pow(3)];
        for (i, d) in distance.into_iter().enumerate() {
            if d < -deep {
                continue;
            }
            let from = number(i).map(|n| n * CUBE);
            if d <= around {
                let span = |a: usize| &axes[a][from[a]..from[a] + CUBE];
                let axes = [span(0), span(1), span(2)];
                self.solid.fill(&Block { axes }, &mut values);
            } else {
                values.fill(1.0);
            }
            for (row, values) in values.chunks_exact(CUBE).enumerate() {
                let (y, z) = (from[1] + row % CUBE, from[2] + row / CUBE);
                let at = (z * side + y) * side + from[0];
                let to = open[at..at + CUBE].iter_mut();
                to.zip(values).for_each(|(o, v)| *o = *v > 0.0);
            }
        }
        open
    }

    /// Solid points that are in no body go to the nearest along the solid.
    fn spread(&self, open: &[bool], owner: &mut [u32], bodies: &mut [BlockComponent], side: usize) {
        let mut front: Vec<usize> = (0..open.len()).filter(|i| owner[*i] != 0).collect();
        while !front.is_empty() {
            let mut next = Vec::new();
            for i in front {
                let name = owner[i];
                bodies[name as usize].size += 1;
                for j in around(i, side).into_iter().flatten() {
                    if owner[j] == 0 && !open[j] {
                        owner[j] = name;
                        next.push(j);
                    }
                }
            }
            front = next;
        }
    }
}

/// A body of a block: its first point, its points, and how far it reaches.
struct BlockComponent {
    first: usize,
    size: u64,
    min: [usize; 3],
    max: [usize; 3],
    /// Whether it is thicker somewhere than the neck that bits hang by.
    bulges: bool,
}

impl BlockComponent {
    fn at(first: usize) -> BlockComponent {
        BlockComponent { first, size: 0, min: [usize::MAX; 3], max: [0; 3], bulges: false }
    }

    fn reach(&mut self, i: usize, side: usize) {
        for (a, n) in [i % side, i / side % side, i / side / side].into_iter().enumerate() {
            self.min[a] = self.min[a].min(n);
            self.max[a] = self.max[a].max(n);
        }
    }

    /// Whether it spans at most this number of points along every axis.
    fn is_within(&self, most: usize) -> bool {
        (0..3).all(|a| self.max[a] - self.min[a] < most)
    }
}

/// The neighbours along the axes.
fn around(i: usize, side: usize) -> [Option<usize>; 6] {
    let [x, y, z] = [i % side, i / side % side, i / side / side];
    [
        (x > 0).then(|| i - 1),
        (x + 1 < side).then(|| i + 1),
        (y > 0).then(|| i - side),
        (y + 1 < side).then(|| i + side),
        (z > 0).then(|| i - side * side),
        (z + 1 < side).then(|| i + side * side),
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::region::{Cuboid, Cylinder, Region, Sphere, Union};
    use geometry::progress::Silent;
    use std::sync::Arc;

    #[test]
    fn balls_that_hang_by_threads() {
        // A block with five balls on posts: three posts are thinner than half a millimetre.
        let mut of: Vec<Region> = vec![Arc::new(Cuboid::new([-10.0; 3], [10.0, 10.0, 0.0]).unwrap())];
        for (i, thick) in [0.3, 0.35, 0.4, 0.8, 1.2].into_iter().enumerate() {
            let x = 3.5 * i as f64 - 7.0;
            let post = Cylinder::new([x, 0.0, -1.0], [0.0, 0.0, 1.0], thick / 2.0, 2.0).unwrap();
            of.push(Arc::new(post));
            of.push(Arc::new(Sphere::new([x, 0.0, 1.5], 1.0).unwrap()));
        }
        let solid = Solid::new(Arc::new(Union::new(of).unwrap()), None, 8.0);
        let found = dangling(&solid, 1.0, &Silent).unwrap();
        assert_eq!((found.count, found.neck, found.step), (3, 0.5, 0.5 / 3.0));
        // Balls of 4π/3 mm³ and half of their posts, 0.25 mm long at most: within the points on the surface,
        // whose number is off by less than a sixth of a step all over it.
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        let off = 4.0 * std::f64::consts::PI * found.step / 6.0;
        assert!((found.volume / 3.0 - ball).abs() < off + 0.03, "{}", found.volume);
        let LargestFragment { volume: largest, place: at } = found.largest.unwrap();
        assert!(largest < 1.2 * ball && (at[2] - 1.5).abs() < 1.0, "{at:?}");
    }
}
