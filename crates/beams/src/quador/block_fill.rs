//! The field at all nodes of a structured block: the hubs that can matter are found for parts of it instead of for each node.

use super::Quadors;
use super::active_in_box::PackedHalfBeams;
use super::hub_in_box::{HubInBox, MOST_POINTS};
use geometry::math::{Aabb, Interval, norm};

/// Which nodes of a block are to be filled, and with which values.
#[derive(Clone, Copy, Debug)]
pub struct FillRequest<'a> {
    /// The nodes that need a value: one word for each row along x, of at most 64 nodes; all if there is none.
    pub nodes: Option<&'a [u64]>,
    /// Whether a node may have any value of its sign, at least the diagonal of a grid cell in magnitude, if all nodes of the cells
    /// around it have that sign.
    pub near: bool,
}

struct Fill<'a> {
    quadors: &'a Quadors,
    axes: [&'a [f64]; 3],
    request: FillRequest<'a>,
    /// How far around a part its bounds hold, mm: by a grid cell if only nodes near the surface need their values.
    around: f64,
    /// Diagonal of the largest grid cell, mm.
    diagonal: f64,
    /// The hubs of the parts from the whole block to the present one.
    hubs: Vec<HubInBox>,
    /// Of the hub at hand those that can be active.
    few: PackedHalfBeams,
    out: &'a mut [f32],
}

impl Quadors {
    /// Fills `out` (x fastest) with the field at the nodes of a block, given by ascending coordinates along each axis (mm). The
    /// values are those of `value`, rounded; nodes that are not wanted may have any.
    pub fn fill(&self, axes: [&[f64]; 3], request: FillRequest, out: &mut [f32]) {
        if axes.iter().any(|axis| axis.is_empty()) {
            return;
        }
        let widest = axes.map(|axis| axis.windows(2).fold(0.0f64, |most, w| most.max(w[1] - w[0])));
        let around = if request.near { widest.into_iter().fold(0.0, f64::max) * (1.0 + 1e-9) } else { 0.0 };
        let mut fill = Fill {
            quadors: self,
            axes,
            request,
            around,
            diagonal: norm(widest),
            hubs: Vec::new(),
            few: PackedHalfBeams::default(),
            out,
        };
        let shape = axes.map(<[f64]>::len);
        let bounds = fill.bounds([0; 3], shape);
        let mut hubs = Vec::new();
        self.index.about(&bounds, &mut |near| hubs.extend_from_slice(near));
        hubs.sort_unstable();
        hubs.dedup();
        fill.hubs.extend(hubs.into_iter().map(HubInBox::anywhere));
        fill.part([0; 3], shape, 0);
    }
}

impl Fill<'_> {
    fn bounds(&self, lo: [usize; 3], hi: [usize; 3]) -> Aabb {
        let end = |a: usize, i: usize| self.axes[a][i];
        Aabb { min: [0, 1, 2].map(|a| end(a, lo[a])), max: [0, 1, 2].map(|a| end(a, hi[a] - 1)) }.grown(self.around)
    }

    /// Fills the nodes from `lo` up to `hi`. The hubs from number `first` on are all that can matter there.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], first: usize) {
        if !self.is_wanted(lo, hi) {
            return self.constant(lo, hi, self.quadors.cap);
        }
        let bounds = self.bounds(lo, hi);
        let own = self.hubs.len();
        let range = self.cull(&bounds, first);
        let sign = if range.lo > 0.0 { 1.0 } else { -1.0 };
        if own == self.hubs.len() {
            self.constant(lo, hi, self.quadors.cap);
        } else if self.request.near && (range.lo > 0.0 || range.hi < 0.0) {
            let far = sign * range.lo.abs().min(range.hi.abs()).max(self.diagonal);
            self.constant(lo, hi, far);
        } else {
            let size = [0, 1, 2].map(|a| hi[a] - lo[a]);
            if size.iter().product::<usize>() <= MOST_POINTS {
                self.values(lo, hi, own);
            } else {
                let length = |a: usize| self.axes[a][hi[a] - 1] - self.axes[a][lo[a]];
                let longest =
                    (0..3).filter(|a| size[*a] > 1).max_by(|a, b| length(*a).total_cmp(&length(*b))).unwrap_or(0);
                let (mut end, mut begin) = (hi, lo);
                end[longest] = (lo[longest] + hi[longest]) / 2;
                begin[longest] = end[longest];
                self.part(lo, end, own);
                self.part(begin, hi, own);
            }
        }
        self.hubs.truncate(own);
    }

    /// Adds those of the hubs from number `first` on, the least first, that can be nearest in a box, by proven bounds; and
    /// bounds the field there. Where only its sign is wanted, it ends with the first hub that contains the box.
    fn cull(&mut self, bounds: &Aabb, first: usize) -> Interval {
        let own = self.hubs.len();
        let mut range = Interval::new(self.quadors.cap, self.quadors.cap);
        for n in first..own {
            let outer = self.hubs[n];
            if outer.least > range.hi || self.request.near && range.hi < 0.0 {
                break;
            }
            let apart = self.quadors.apart(outer.hub, bounds);
            if apart == 0.0 || apart < range.hi {
                let (hub, of) = self.quadors.hub_in_box(&outer, bounds, &mut self.few);
                range = range.min(of);
                self.hubs.push(hub);
            }
        }
        let mut kept = own;
        for n in own..self.hubs.len() {
            if self.hubs[n].least <= range.hi {
                self.hubs[kept] = self.hubs[n];
                kept += 1;
            }
        }
        self.hubs.truncate(kept);
        self.hubs[own..].sort_unstable_by(|a, b| a.least.total_cmp(&b.least));
        range
    }

    fn is_wanted(&self, lo: [usize; 3], hi: [usize; 3]) -> bool {
        let Some(words) = self.request.nodes else {
            return true;
        };
        let mask = (u64::MAX >> (64 - (hi[0] - lo[0]))) << lo[0];
        (lo[2]..hi[2]).any(|k| (lo[1]..hi[1]).any(|j| words[k * self.axes[1].len() + j] & mask != 0))
    }

    fn row(&mut self, lo: [usize; 3], hi: [usize; 3], j: usize, k: usize) -> &mut [f32] {
        let row = (k * self.axes[1].len() + j) * self.axes[0].len();
        &mut self.out[row + lo[0]..row + hi[0]]
    }

    fn constant(&mut self, lo: [usize; 3], hi: [usize; 3], value: f64) {
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                self.row(lo, hi, j, k).fill(value as f32);
            }
        }
    }

    /// Fills few nodes with the least values of the hubs from number `first` on.
    fn values(&mut self, lo: [usize; 3], hi: [usize; 3], first: usize) {
        let mut points = [[0.0; MOST_POINTS]; 3];
        let mut n = 0;
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    (points[0][n], points[1][n], points[2][n]) = (self.axes[0][i], self.axes[1][j], self.axes[2][k]);
                    n += 1;
                }
            }
        }
        let mut least = [self.quadors.cap; MOST_POINTS];
        for hub in &self.hubs[first..] {
            if hub.least >= least[..n].iter().copied().fold(f64::NEG_INFINITY, f64::max) {
                break;
            }
            self.quadors.lower(hub, points.each_ref().map(|p| &p[..n]), &mut least[..n], &mut self.few);
        }
        let mut rows = least.chunks(hi[0] - lo[0]);
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                let values = rows.next().unwrap_or_default();
                self.row(lo, hi, j, k).iter_mut().zip(values).for_each(|(out, v)| *out = *v as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fillet, tests};
    use super::*;

    #[test]
    fn a_block_has_the_values_of_its_nodes_and_their_signs() {
        let mut random = tests::Random(6);
        for fillet in [Fillet::None, Fillet::Auto] {
            let q = Quadors::new(&tests::cubic(2, 1.5), fillet).expect("a lattice");
            for step in [0.05, 0.2, 0.9] {
                let [xs, ys, zs] = [23, 17, 20].map(|n| {
                    let from = 15.0 * random.next() - 3.0;
                    (0..n).map(|i| from + step * (f64::from(i) + 0.3 * random.next())).collect::<Vec<f64>>()
                });
                let (axes, rows) = ([&xs[..], &ys, &zs], ys.len() * zs.len());
                let words: Vec<u64> = (0..rows).map(|row| if row % 3 == 0 { 0 } else { 0x6f_fff0 }).collect();
                let fill = |nodes, near| {
                    let mut out = vec![f32::NAN; xs.len() * rows];
                    q.fill(axes, FillRequest { nodes, near }, &mut out);
                    out
                };
                let (all, some, near) = (fill(None, false), fill(Some(&words), false), fill(None, true));
                let at = |i: usize, j: usize, k: usize| (k * ys.len() + j) * xs.len() + i;
                for (k, z) in zs.iter().enumerate() {
                    for (j, y) in ys.iter().enumerate() {
                        for (i, x) in xs.iter().enumerate() {
                            let (n, v) = (at(i, j, k), q.value([*x, *y, *z]) as f32);
                            assert_eq!(all[n], v);
                            assert!(words[k * ys.len() + j] >> i & 1 == 0 || some[n] == v);
                            let around = |n: usize, end: usize| n.saturating_sub(1)..(n + 2).min(end);
                            let crossed = around(k, zs.len()).any(|k| {
                                around(j, ys.len())
                                    .any(|j| around(i, xs.len()).any(|i| (all[at(i, j, k)] < 0.0) != (v < 0.0)))
                            });
                            let far = near[n].abs() >= step as f32 && (near[n] < 0.0) == (v < 0.0);
                            assert!(near[n] == v || far && !crossed, "{fillet:?} {step}: {} {v}", near[n]);
                        }
                    }
                }
            }
        }
    }

    /// Stars of few and of many half-beams, where one, two or more are active in a part.
    #[test]
    fn a_block_has_the_values_of_its_nodes_to_the_last_bit_about_random_hubs() {
        let mut random = tests::Random(11);
        for n in [1, 2, 3, 5, 8, 14, 70] {
            for fillet in [Fillet::None, Fillet::Auto, Fillet::Tau(0.9), Fillet::Radius(0.2)] {
                let q = Quadors::new(&tests::random_star(&mut random, n), fillet).expect("a star");
                let step = 0.03 + 0.2 * random.next();
                let axes = [(); 3].map(|()| {
                    let from = 6.0 * random.next() - 5.0;
                    (0..24).map(|i| from + step * f64::from(i)).collect::<Vec<f64>>()
                });
                let mut out = vec![f32::NAN; 24 * 24 * 24];
                q.fill(axes.each_ref().map(Vec::as_slice), FillRequest { nodes: None, near: false }, &mut out);
                for (at, v) in out.iter().enumerate() {
                    let p = [at % 24, at / 24 % 24, at / 576];
                    let p = [0, 1, 2].map(|a| axes[a][p[a]]);
                    assert_eq!(v.to_bits(), (q.value(p) as f32).to_bits(), "{n} {fillet:?} {step}: {p:?}");
                }
            }
        }
    }
}
