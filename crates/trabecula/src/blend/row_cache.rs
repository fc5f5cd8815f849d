//! Offsets of a blend's ends at the nodes of a grid row along x. What is interpolated between windows along y and z is kept for the
//! row, and that between windows along z for the rows of one layer.

use super::empirical::{QuantileSegment, add_times};
use super::ends::{HIGH, blended};
use super::levels::BlendLevels;
use super::node_table::NodeTable;
use super::summand::Summand;

/// Tables interpolated to a row along x, by columns: the windows of one index along x.
pub(super) struct RowCache {
    /// For each node along x: the columns between which it lies, and the weight of the second.
    along: Vec<([usize; 2], f64)>,
    adjacent: AdjacentWindows,
    /// For each column the offsets at each node of the shares' grid, NaN where they are not computed; or, where levels vary, the
    /// quantile functions.
    offsets: Vec<[f32; 2]>,
    quantiles: Vec<NodeTable>,
}

/// The windows adjacent to a row.
struct AdjacentWindows {
    /// Index of the first column along x.
    first: usize,
    /// The windows between which the row lies along y and z: index of the first, weight of the second. `None` before the first row.
    across: Option<[(usize, f64); 2]>,
    /// Tables interpolated to the row's z, for each column, of the windows of one index along y; and that index. Of even indices
    /// and of odd ones, since a row lies between one of each.
    sides: [(Option<usize>, Vec<NodeTable>); 2],
}

impl RowCache {
    /// Rows with nodes at these x.
    pub fn new(levels: &BlendLevels, xs: &[f64]) -> RowCache {
        let last = levels.windows.shape[0] - 1;
        let along = |x: &f64| {
            let (n, weight, _) = levels.windows.interval(0, *x);
            ([n, (n + 1).min(last)], weight)
        };
        let mut along: Vec<_> = xs.iter().map(along).collect();
        let first = along.first().map_or(0, |a| a.0[0]);
        let columns = along.last().map_or(0, |a| a.0[1] + 1 - first);
        along.iter_mut().for_each(|a| a.0 = a.0.map(|n| n - first));
        let (offsets, quantiles) = match levels.is_uniform() {
            true => (columns * levels.grid.len(), 0),
            false => (0, columns),
        };
        let tables = |n: usize| (0..n).map(|_| levels.empty_table()).collect::<Vec<_>>();
        RowCache {
            along,
            adjacent: AdjacentWindows { first, across: None, sides: [0, 1].map(|_| (None, tables(columns))) },
            offsets: vec![[f32::NAN; 2]; offsets],
            quantiles: tables(quantiles),
        }
    }

    /// Moves to the row at this y and z (mm).
    pub fn move_to(&mut self, levels: &BlendLevels, at: [f64; 2]) {
        let across = [0, 1].map(|a| {
            let (n, weight, _) = levels.windows.interval(a + 1, at[a]);
            (n, weight)
        });
        let adjacent = &mut self.adjacent;
        // Of one window that serves everywhere all rows are the same.
        if adjacent.across == Some(across) {
            return;
        }
        if adjacent.across.is_none_or(|a| a[1] != across[1]) {
            adjacent.sides.iter_mut().for_each(|side| side.0 = None);
        }
        adjacent.across = Some(across);
        self.offsets.fill([f32::NAN; 2]);
        self.quantiles.iter_mut().for_each(NodeTable::clear);
    }
}

impl AdjacentWindows {
    /// Adds a node's numbers of a column, interpolated along y and z.
    fn interpolate(
        &mut self,
        levels: &BlendLevels,
        summands: &[Summand],
        (column, node): (usize, usize),
        out: &mut [f32],
    ) {
        let [nx, ny, _] = levels.windows.shape;
        let Some(across) = self.across else { return };
        let [y, z] = across.map(|(n, t)| [(n, 1.0 - t), (n + 1, t)]);
        for (j, weight) in y.into_iter().filter(|y| y.1 > 0.0) {
            let (index, tables) = &mut self.sides[j % 2];
            if *index != Some(j) {
                *index = Some(j);
                tables.iter_mut().for_each(NodeTable::clear);
            }
            let of_side = tables[column].get_or_insert(node, |out| {
                for (k, weight) in z.into_iter().filter(|z| z.1 > 0.0) {
                    let i = (k * ny + j) * nx + self.first + column;
                    add_times(out, weight as f32, levels.node_values(i, summands, node));
                }
            });
            add_times(out, weight as f32, of_side);
        }
    }
}

impl BlendLevels {
    /// The offset of an end at the i-th node of the current row, where no level varies; the shares have barycentric coordinates at
    /// `nodes` of their grid (indices in the bits of floats).
    #[inline(always)]
    pub fn offset_in_row(
        &self,
        summands: &[Summand],
        i: usize,
        (nodes, coordinates): (&[f64], &[f64]),
        row: &mut RowCache,
        end: usize,
    ) -> f64 {
        let (columns, weight) = row.along[i];
        let size = self.grid.len();
        let [first, second] = columns.map(|c| &row.offsets[c * size..][..size]);
        let each = nodes.iter().zip(coordinates).map(|(node, coordinate)| {
            let node = node.to_bits() as usize;
            let [a, b] = [first, second].map(|of| f64::from(of[node][end]));
            coordinate * ((1.0 - weight) * a + weight * b)
        });
        let sum: f64 = each.sum();
        match sum.is_nan() {
            true => self.new_offset_in_row(summands, i, (nodes, coordinates), row, end),
            false => sum,
        }
    }

    /// The same where some offsets are not computed yet.
    #[cold]
    fn new_offset_in_row(
        &self,
        summands: &[Summand],
        i: usize,
        (nodes, coordinates): (&[f64], &[f64]),
        row: &mut RowCache,
        end: usize,
    ) -> f64 {
        let (columns, weight) = row.along[i];
        let weights = [1.0 - weight, weight];
        // Terms of weight 0 need no offset; else the same sum to the last bit.
        let each = nodes.iter().zip(coordinates).filter(|n| *n.1 != 0.0).map(|(node, coordinate)| {
            let node = node.to_bits() as usize;
            let [a, b] = [0, 1].map(|c| {
                let known = &mut row.offsets[columns[c] * self.grid.len() + node];
                if weights[c] > 0.0 && known[end].is_nan() {
                    *known = [0.0; 2];
                    row.adjacent.interpolate(self, summands, (columns[c], node), known);
                }
                if weights[c] > 0.0 { f64::from(known[end]) } else { 0.0 }
            });
            coordinate * (weights[0] * a + weights[1] * b)
        });
        each.sum()
    }

    /// The same where levels vary; `w` are the shares and `q` the lattices' quantiles.
    #[inline(always)]
    pub fn offset_in_row_by_quantiles(
        &self,
        summands: &[Summand],
        i: usize,
        (w, nodes, coordinates, q): (&[f64], &[f64], &[f64], impl Fn(usize) -> [f64; 2]),
        row: &mut RowCache,
        end: usize,
    ) -> f64 {
        let (columns, weight) = row.along[i];
        let columns = || (columns.into_iter().zip([1.0 - weight, weight])).filter(|c| c.1 > 0.0);
        let RowCache { adjacent, quantiles, .. } = row;
        // A node's quantile function, interpolated between the columns.
        let mut quantile = |node: usize, segment: QuantileSegment| -> f64 {
            let each = columns().map(|(column, weight)| {
                let table = quantiles[column].get_or_insert(node, |out| {
                    adjacent.interpolate(self, summands, (column, node), out);
                });
                weight * segment.value_and_slope(table).0
            });
            each.sum()
        };
        let mut sum = 0.0;
        let own = QuantileSegment::at(blended(w, (0..w.len()).map(&q))[end]);
        for (node, coordinate) in nodes.iter().zip(coordinates).filter(|n| *n.1 != 0.0) {
            sum += coordinate * quantile(node.to_bits() as usize, own);
        }
        for (s, summand) in summands.iter().enumerate().filter(|(s, _)| w[*s] > 0.0) {
            let base = match end == HIGH || summand.is_sheet() {
                true => quantile(self.alone[s], QuantileSegment::at(q(s)[end])),
                false => summand.lower_end(0.0),
            };
            sum -= w[s] * base;
        }
        sum
    }
}
