//! The nodes of a row where several lattices may be.
//!
//! Shares, upper ends and quantiles are found again only where they change: what varies along x alone once for a block, what
//! does not vary along x once for a row.

use super::Blend;
use super::added::{HIGH, Row};
use super::fill::Line;
use super::simplex::Place;
use super::strand::Strand;
use geometry::math::Vec3;

/// What is found on the rows of a block where several lattices may be.
pub(super) struct Mixed {
    /// Shares, and where the levels are tabulated for them: the nodes of the table, bit by bit, and how often each counts.
    shares: Numbers,
    /// For each lattice: its upper end, and the quantiles of both where levels vary.
    ends: Vec<Numbers>,
    /// What is known of the levels, where the fraction is kept.
    row: Option<Row>,
}

impl Mixed {
    /// For rows with nodes at these x.
    pub fn new(blend: &Blend, xs: &[f64]) -> Mixed {
        let mut varies = [false; 3];
        for grade in blend.weights.grades() {
            let of = grade.varies();
            (0..3).for_each(|a| varies[a] |= of[a]);
        }
        let ends = |s: &Strand| {
            let varies = match s.lattice() {
                Some(l) if l.uniform().is_some() => [false; 3],
                Some(l) => l.level.grade().varies(),
                // Its quantiles are found by looking.
                None => [s.uniform().is_none() || blend.varied().is_some(); 3],
            };
            Numbers::new(3, varies, xs.len())
        };
        Mixed {
            shares: Numbers::new(3 * blend.strands.len(), varies, xs.len()),
            ends: blend.strands.iter().map(ends).collect(),
            row: blend.levels.as_deref().map(|levels| Row::new(levels, xs)),
        }
    }

    /// Fills the values at some nodes of a row.
    pub fn fill(&mut self, blend: &Blend, nodes: &[usize], line: &Line, row: &mut [f32]) {
        // The same each time; the compiler knows the number of few lattices.
        match blend.strands.len() {
            2 => self.fill_of::<2>(blend, nodes, line, row),
            3 => self.fill_of::<3>(blend, nodes, line, row),
            _ => self.fill_of::<0>(blend, nodes, line, row),
        }
    }

    /// The same for N lattices, or for any number if N is 0.
    fn fill_of<const N: usize>(&mut self, blend: &Blend, nodes: &[usize], line: &Line, row: &mut [f32]) {
        let Mixed { shares, ends, row: known } = self;
        let n = if N > 0 { N } else { blend.strands.len() };
        let strands = &blend.strands[..n];
        shares.renew(line, nodes, |points, out| blend.shares_at(points, out));
        for (s, of) in ends.iter_mut().enumerate() {
            if nodes.iter().any(|i| shares.at(*i)[s] > 0.0) {
                of.renew(line, nodes, |points, out| blend.ends_at(s, points, out));
            }
        }
        if let (Some(levels), Some(known)) = (&blend.levels, &mut *known) {
            known.enter(levels, line.at);
        }
        let (ends, wanted) = (&ends[..n], blend.ends());
        for &i in nodes {
            let here = &shares.at(i)[..3 * n];
            let (w, at, times) = (&here[..n], &here[n..2 * n], &here[2 * n..]);
            if let Some(s) = w.iter().position(|w| *w == 1.0) {
                row[i] = blend.alone(s, line.core(s, i), ends[s].at(i)[0]) as f32;
                continue;
            }
            let there = || w.iter().enumerate().filter(|(_, w)| **w > 0.0);
            let f: f64 = there().map(|(s, w)| w * line.core(s, i)).sum();
            let value = |end: &usize| {
                let end = *end;
                let of = |s: usize| strands[s].end(end, ends[s].at(i)[0], false);
                let mut level: f64 = there().map(|(s, w)| w * of(s)).sum();
                if let (Some(levels), Some(known)) = (&blend.levels, &mut *known) {
                    level += if levels.is_uniform() {
                        levels.added_in_row(strands, i, (at, times), known, end)
                    } else {
                        let q = |s: usize| [ends[s].at(i)[1], ends[s].at(i)[2]];
                        levels.added_by_curves(strands, i, (w, at, times, q), known, end)
                    };
                }
                if end == HIGH { f - level } else { level - f }
            };
            // Both are numbers, which `max` does not know.
            let greater = |a: f64, b: f64| if b > a { b } else { a };
            row[i] = wanted.iter().map(value).reduce(greater).unwrap_or(-1.0) as f32;
        }
    }
}

impl Blend {
    /// Fills shares at points (mm), and where they lie in the tables of levels.
    fn shares_at(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.strands.len();
        let mut w = vec![0.0; n * points.len()];
        self.weights.values(points, &mut w);
        let mut place = Place::default();
        for (out, w) in out.chunks_exact_mut(3 * n).zip(w.chunks_exact(n)) {
            out[..n].copy_from_slice(w);
            if let Some(levels) = &self.levels {
                levels.grid.place(w, &mut place);
                let nodes = place.nodes.iter().map(|node| f64::from_bits(*node as u64));
                let place = nodes.chain(place.shares.iter().copied());
                out[n..].iter_mut().zip(place).for_each(|(o, v)| *o = v);
            }
        }
    }

    /// Fills a lattice's upper end at points (mm), and the quantiles of both ends where levels vary.
    fn ends_at(&self, s: usize, points: &[Vec3], out: &mut [f64]) {
        let (mut high, mut q) = (vec![0.0; points.len()], vec![[0.0; 2]; points.len()]);
        self.ends_of(s, points, &mut high, &mut q);
        for (out, (high, [a, b])) in out.chunks_exact_mut(3).zip(high.into_iter().zip(q)) {
            out.copy_from_slice(&[high, a, b]);
        }
    }
}

/// Some numbers for each node of a row.
struct Numbers {
    width: usize,
    /// Along which axes they may change.
    varies: [bool; 3],
    of: Vec<f64>,
    /// The row that all of them belong to, where rows differ.
    known: Option<[usize; 2]>,
    points: Vec<Vec3>,
    found: Vec<f64>,
}

impl Numbers {
    fn new(width: usize, varies: [bool; 3], nodes: usize) -> Numbers {
        Numbers { width, varies, of: vec![0.0; width * nodes], known: None, points: Vec::new(), found: Vec::new() }
    }

    #[inline]
    fn at(&self, node: usize) -> &[f64] {
        &self.of[node * self.width..][..self.width]
    }

    /// Makes the numbers at some nodes those of a row; `find` fills them at points (mm).
    fn renew(&mut self, line: &Line, nodes: &[usize], find: impl Fn(&[Vec3], &mut [f64])) {
        let [x, y, z] = self.varies;
        // All nodes at once where another row asks for the same, or one is as good as all.
        let whole = !x || !(y || z);
        let row = [usize::from(y) * line.number[0], usize::from(z) * line.number[1]];
        if whole && self.known == Some(row) {
            return;
        }
        self.known = whole.then_some(row);
        self.points.clear();
        match (x, whole) {
            (false, _) => self.points.push(line.place(0)),
            (_, true) => self.points.extend((0..line.xs.len()).map(|i| line.place(i))),
            _ => self.points.extend(nodes.iter().map(|i| line.place(*i))),
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
