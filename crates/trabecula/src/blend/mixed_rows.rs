//! A blend at the nodes of rows where several lattices may have a weight.
//!
//! Shares, upper ends and quantiles are evaluated only where they change: what varies along x alone once for a block, what does
//! not vary along x once for a row.

use super::ends::HIGH;
use super::grid_row::GridRow;
use super::row_cache::RowCache;
use super::share_grid::ShareSimplex;
use super::sum::{Blend, BlendBound};
use super::summand::Summand;
use geometry::math::Vec3;

/// What is evaluated on the rows of a block.
pub(super) struct MixedRows {
    /// Shares, and their simplex: the nodes (indices in the bits of floats), and the barycentric coordinates.
    shares: RowValues,
    /// For each summand its upper end, and the quantiles of both ends where levels vary.
    ends: Vec<RowValues>,
    /// Offsets, where the fraction is kept.
    offsets: Option<RowCache>,
}

impl MixedRows {
    /// For rows with nodes at these x.
    pub fn new(blend: &Blend, xs: &[f64]) -> MixedRows {
        let mut varies = [false; 3];
        for grade in blend.weights.grades() {
            let of = grade.varies();
            (0..3).for_each(|a| varies[a] |= of[a]);
        }
        let ends = |s: &Summand| {
            let varies = match s.lattice() {
                Some(l) if l.uniform().is_some() => [false; 3],
                Some(l) => l.level.grade().varies(),
                // Its quantiles differ from window to window.
                None => [s.uniform_upper_end().is_none() || blend.varied().is_some(); 3],
            };
            RowValues::new(3, varies, xs.len())
        };
        MixedRows {
            shares: RowValues::new(3 * blend.summands.len(), varies, xs.len()),
            ends: blend.summands.iter().map(ends).collect(),
            offsets: blend.levels.as_deref().map(|levels| RowCache::new(levels, xs)),
        }
    }

    /// Fills the values on sides at some nodes of a row.
    pub fn fill<const S: usize>(
        &mut self,
        of: (&Blend, [Option<BlendBound>; S]),
        nodes: &[usize],
        line: &GridRow,
        on: &mut [&mut [f32]; S],
    ) {
        // One function, compiled for the numbers of lattices that are frequent.
        match of.0.summands.len() {
            2 => self.fill_of::<2, S>(of, nodes, line, on),
            3 => self.fill_of::<3, S>(of, nodes, line, on),
            _ => self.fill_of::<0, S>(of, nodes, line, on),
        }
    }

    /// The same for N lattices, or for any number if N is 0.
    fn fill_of<const N: usize, const S: usize>(
        &mut self,
        (blend, sides): (&Blend, [Option<BlendBound>; S]),
        nodes: &[usize],
        line: &GridRow,
        on: &mut [&mut [f32]; S],
    ) {
        let MixedRows { shares, ends, offsets } = self;
        let n = if N > 0 { N } else { blend.summands.len() };
        let summands = &blend.summands[..n];
        shares.update(line, nodes, |points, out| blend.shares_at(points, out));
        for (s, of) in ends.iter_mut().enumerate() {
            if nodes.iter().any(|i| shares.at(*i)[s] > 0.0) {
                of.update(line, nodes, |points, out| blend.ends_at(s, points, out));
            }
        }
        if let (Some(levels), Some(offsets)) = (&blend.levels, &mut *offsets) {
            offsets.move_to(levels, line.at);
        }
        let ends = &ends[..n];
        for &i in nodes {
            let here = &shares.at(i)[..3 * n];
            let (w, simplex, coordinates) = (&here[..n], &here[n..2 * n], &here[2 * n..]);
            if let Some(s) = w.iter().position(|w| *w == 1.0) {
                for (row, side) in on.iter_mut().zip(sides) {
                    row[i] = blend.alone(side, s, line.value(s, i), ends[s].at(i)[0]) as f32;
                }
                continue;
            }
            let present = || w.iter().enumerate().filter(|(_, w)| **w > 0.0);
            let f: f64 = present().map(|(s, w)| w * line.value(s, i)).sum();
            let mut value = |end: &usize| {
                let end = *end;
                let of = |s: usize| summands[s].end(end, ends[s].at(i)[0], false);
                let mut level: f64 = present().map(|(s, w)| w * of(s)).sum();
                if let (Some(levels), Some(offsets)) = (&blend.levels, &mut *offsets) {
                    level += if levels.is_uniform() {
                        levels.offset_in_row(summands, i, (simplex, coordinates), offsets, end)
                    } else {
                        let q = |s: usize| [ends[s].at(i)[1], ends[s].at(i)[2]];
                        levels.offset_in_row_by_quantiles(summands, i, (w, simplex, coordinates, q), offsets, end)
                    };
                }
                if end == HIGH { f - level } else { level - f }
            };
            // Faster than `max`: neither is NaN.
            let greater = |a: f64, b: f64| if b > a { b } else { a };
            for (row, side) in on.iter_mut().zip(sides) {
                row[i] = blend.ends_on(side).iter().map(&mut value).reduce(greater).unwrap_or(-1.0) as f32;
            }
        }
    }
}

impl Blend {
    /// Fills shares at points (mm), and their simplex.
    fn shares_at(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.summands.len();
        let mut w = vec![0.0; n * points.len()];
        self.weights.values(points, &mut w);
        let mut simplex = ShareSimplex::default();
        for (out, w) in out.chunks_exact_mut(3 * n).zip(w.chunks_exact(n)) {
            out[..n].copy_from_slice(w);
            if let Some(levels) = &self.levels {
                levels.grid.locate(w, &mut simplex);
                let nodes = simplex.nodes.iter().map(|node| f64::from_bits(*node as u64));
                let numbers = nodes.chain(simplex.coordinates.iter().copied());
                out[n..].iter_mut().zip(numbers).for_each(|(o, v)| *o = v);
            }
        }
    }

    /// Fills the upper end of summand `s` at points (mm), and the quantiles of both ends where levels vary.
    fn ends_at(&self, s: usize, points: &[Vec3], out: &mut [f64]) {
        let (mut high, mut q) = (vec![0.0; points.len()], vec![[0.0; 2]; points.len()]);
        self.ends_of(s, points, &mut high, &mut q);
        for (out, (high, [a, b])) in out.chunks_exact_mut(3).zip(high.into_iter().zip(q)) {
            out.copy_from_slice(&[high, a, b]);
        }
    }
}

/// `width` numbers for each node of a row.
struct RowValues {
    width: usize,
    /// Along which axes they may change.
    varies: [bool; 3],
    of: Vec<f64>,
    /// The row for which all of them are evaluated, where rows differ.
    known: Option<[usize; 2]>,
    points: Vec<Vec3>,
    found: Vec<f64>,
}

impl RowValues {
    fn new(width: usize, varies: [bool; 3], nodes: usize) -> RowValues {
        RowValues { width, varies, of: vec![0.0; width * nodes], known: None, points: Vec::new(), found: Vec::new() }
    }

    #[inline]
    fn at(&self, node: usize) -> &[f64] {
        &self.of[node * self.width..][..self.width]
    }

    /// Evaluates the numbers at some nodes of a row where they have changed; `find` fills them at points (mm).
    fn update(&mut self, line: &GridRow, nodes: &[usize], find: impl Fn(&[Vec3], &mut [f64])) {
        let [x, y, z] = self.varies;
        // All nodes at once where other rows have the same numbers, or where all nodes of a row have.
        let whole = !x || !(y || z);
        let row = [usize::from(y) * line.index[0], usize::from(z) * line.index[1]];
        if whole && self.known == Some(row) {
            return;
        }
        self.known = whole.then_some(row);
        self.points.clear();
        match (x, whole) {
            (false, _) => self.points.push(line.position(0)),
            (_, true) => self.points.extend((0..line.xs.len()).map(|i| line.position(i))),
            _ => self.points.extend(nodes.iter().map(|i| line.position(*i))),
        }
        self.found.resize(self.points.len() * self.width, 0.0);
        find(&self.points, &mut self.found);
        match (x, whole) {
            (false, _) => (self.of.chunks_exact_mut(self.width)).for_each(|n| n.copy_from_slice(&self.found)),
            (_, true) => self.of.copy_from_slice(&self.found),
            _ => {
                for (i, found) in nodes.iter().zip(self.found.chunks_exact(self.width)) {
                    self.of[i * self.width..][..self.width].copy_from_slice(found);
                }
            }
        }
    }
}
