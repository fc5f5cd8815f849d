//! Figures of a surface taken tile by tile, while it is made: what [`Measured`] has, without the mesh.
//!
//! Volumes, areas, bounds and topology are those of the components of tiles. Two figures are taken here:
//! - *Closedness.* Each edge of a triangle is a pseudo-random number of its two vertices, negative in the one direction, and the
//!   numbers are summed modulo 2⁶⁴. The sum of a closed, oriented surface is 0; that of any other is so with a chance of 2⁻⁶⁴.
//!   That no edge has four triangles is by construction.
//! - *A point in each void*, the middle of the longest interval of void on a grid line that ends at its wall.

use geometry::fault::Fault;
use geometry::math::{Vec3, add, scale};
use geometry::measure::{Cavity, ShapeCounts, Shapes, Size};

use super::packed::{Packer, Unpacker, damaged};
use super::tile::View;
use super::tile_components::{Gap, TileComponents};
use crate::surface_maker::{Figures, Measured, Resolved, Totals};

/// Most triangles of a tile's component whose shapes wait until it is known whether the component stays: those of larger ones are
/// counted at once, for what is small enough to be dropped unasked has fewer.
const KEPT: usize = 1000;

/// What is measured in one tile.
pub(super) struct TileFigures {
    pub components: TileComponents,
    /// For each component.
    shapes: Vec<Shapes>,
    /// The sum of the edges' numbers.
    balance: u64,
}

impl TileFigures {
    /// Measures the surface in a tile. `middle` is the apex of the cones by which volumes are summed.
    pub fn of(view: &View, middle: Vec3) -> TileFigures {
        let numbers = vertex_numbers(view);
        let positions = view.positions();
        let (mut corners, mut balance) = (Vec::new(), 0u64);
        let components = TileComponents::each_triangle(view, 0, middle, |t, _| {
            corners.push(t);
            let [a, b, c] = t.map(|v| numbers[v as usize]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                balance = balance.wrapping_add(edge_number(from, to));
            }
        });
        let mut rest = &corners[..];
        let shapes = components.totals.iter().map(|t| {
            let (own, others) = rest.split_at(t.triangles as usize);
            rest = others;
            let mut shapes = Shapes::default();
            own.iter().for_each(|t| shapes.push(t.map(|v| positions[v as usize])));
            shapes
        });
        TileFigures { shapes: shapes.collect(), components, balance }
    }
}

/// A number for each vertex of a tile's surface: that of its name where other tiles may use it.
fn vertex_numbers(view: &View) -> Vec<u64> {
    let tile = view.tile().iter().fold(0, |n, i| mixed(n ^ *i as u64));
    let mut numbers: Vec<u64> = (0..view.positions().len()).map(|v| mixed(tile.wrapping_add(v as u64))).collect();
    view.each_shared(&mut |v| {
        let name = view.name(v as usize);
        numbers[v as usize] = mixed(mixed(name as u64) ^ (name >> 64) as u64);
    });
    numbers
}

/// The number of an edge, negative in the other direction.
fn edge_number(from: u64, to: u64) -> u64 {
    let of = |low: u64, high: u64| mixed(low ^ high.rotate_left(32));
    if from < to { of(from, to) } else { of(to, from).wrapping_neg() }
}

/// A bijection of words that leaves no pattern: the output function of SplitMix64 (G. Steele, D. Lea and C. Flood, Fast
/// splittable pseudorandom number generators, 2014).
fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}

/// What is measured of the tiles so far.
#[derive(Clone, Debug, Default)]
pub(super) struct FigureSums {
    balance: u64,
    counts: ShapeCounts,
    /// Components of tiles whose shapes are not counted yet, by number.
    open: Vec<(u32, Shapes)>,
    gaps: Vec<Gap>,
}

impl FigureSums {
    /// Adds the figures of the next tile, and gives its components back.
    pub fn add(&mut self, tile: TileFigures) -> TileComponents {
        self.balance = self.balance.wrapping_add(tile.balance);
        for (n, (shapes, totals)) in
            (self.gaps.len() as u32..).zip(tile.shapes.into_iter().zip(&tile.components.totals))
        {
            if totals.triangles > KEPT as u64 {
                self.counts.add(&shapes);
            } else {
                self.open.push((n, shapes));
            }
        }
        self.gaps.extend(&tile.components.gaps);
        tile.components
    }

    /// Adds what is measured of the tiles that come next.
    pub fn join(&mut self, next: FigureSums) {
        let base = self.gaps.len() as u32;
        self.balance = self.balance.wrapping_add(next.balance);
        let (all, counts) = next.counts.parts();
        self.counts.add_parts(all, (0..=u16::MAX).zip(counts.iter().copied()));
        self.open.extend(next.open.into_iter().map(|(n, shapes)| (base + n, shapes)));
        self.gaps.extend(next.gaps);
    }

    /// As bytes.
    pub fn pack(&self, out: &mut Packer) {
        out.whole(self.balance.into());
        let (all, counts) = self.counts.parts();
        all.iter().for_each(|v| out.real(*v));
        let some = || counts.iter().enumerate().filter(|(_, n)| **n > 0);
        out.count(some().count());
        let mut before = 0;
        for (interval, n) in some() {
            out.count(interval - before);
            out.whole((*n).into());
            before = interval;
        }
        out.count(self.open.len());
        for (n, shapes) in &self.open {
            let (all, intervals) = shapes.parts();
            out.whole((*n).into());
            all.iter().for_each(|v| out.real(*v));
            out.count(intervals.len());
            intervals.iter().for_each(|i| out.whole((*i).into()));
        }
        // Few components have a gap.
        let gaps = || self.gaps.iter().enumerate().filter(|(_, gap)| gap.0 > 0.0);
        out.count(gaps().count());
        for (n, (length, middle)) in gaps() {
            out.count(n);
            [*length].iter().chain(middle).for_each(|v| out.real(*v));
        }
    }

    /// From bytes, given the number of components.
    pub fn unpack(from: &mut Unpacker, components: usize) -> Result<FigureSums, Fault> {
        let mut sums = FigureSums { balance: from.word()?, ..FigureSums::default() };
        let all = from.reals()?;
        let mut counts = Vec::new();
        let mut interval = 0u32;
        for _ in 0..from.count()? {
            interval += from.below(1 << 16)?;
            counts.push((u16::try_from(interval).map_err(|_| damaged())?, from.word()?));
        }
        sums.counts.add_parts(all, counts.into_iter());
        for _ in 0..from.count()? {
            let (n, all, count) = (from.below(components as u128)?, from.reals()?, from.count()?);
            let intervals = (0..count).map(|_| from.below(1 << 16).map(|i| i as u16)).collect::<Result<_, Fault>>()?;
            sums.open.push((n, Shapes::of_parts(all, intervals)));
        }
        sums.gaps = vec![(0.0, [0.0; 3]); components];
        for _ in 0..from.count()? {
            let n = from.below(components as u128)?;
            sums.gaps[n as usize] = (from.real()?, from.reals()?);
        }
        Ok(sums)
    }

    /// What is measured of the whole surface, once its components are known.
    pub fn finish(mut self, found: Resolved) -> Measured {
        let staying = self.open.iter().filter(|(n, _)| found.parts[*n as usize].1);
        staying.for_each(|(_, shapes)| self.counts.add(shapes));
        let mut longest = vec![(0.0, [0.0; 3]); self.gaps.len()];
        for (gap, first) in self.gaps.iter().zip(&found.first) {
            let known: &mut Gap = &mut longest[*first as usize];
            if gap.0 > known.0 {
                *known = *gap;
            }
        }
        let void = |(first, wall): &(u32, Totals)| {
            let (length, place) = longest[*first as usize];
            // Between the lines of the grid there is no better guess.
            let middle = scale(add(wall.bounds.min, wall.bounds.max), 0.5);
            Cavity { volume: -wall.volume, point: if length > 0.0 { place } else { middle }, bounds: wall.bounds }
        };
        let mut voids: Vec<Cavity> = found.walls.iter().map(void).collect();
        voids.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        let (totals, components) = (found.totals, found.components);
        let size = Size {
            volume: totals.volume,
            area: totals.area[0] + totals.area[1],
            euler: components.euler,
            pieces: components.count as usize,
            cavities: voids.len(),
            closed: self.balance == 0,
            bounds: totals.bounds,
        };
        let figures = Figures { size, area_cut: totals.area[1], voids };
        Measured { figures, quality: self.counts.quality(), components }
    }
}
