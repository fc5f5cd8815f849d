//! About how many triangles a tile has, by the signs at its nodes alone.

use super::{BlockNodes, TileBuffers, sample};
use crate::extract::cube_table::CASES;
use crate::extract::planar_caps;
use crate::extract::sampling_grid::SamplingGrid;
use crate::extract::sign_words::{bits, within};

/// Triangles of a feature cell on average, with those that it adds to adjacent cells.
const FEATURE_CELL: usize = 14;

/// About as many triangles as the tile's own cells get; `None` if bounds show that no surface crosses it.
pub(in crate::extract) fn count(grid: &SamplingGrid, tile: [usize; 3], s: &mut TileBuffers) -> Option<usize> {
    let block = grid.block(tile);
    let local = grid.local(&grid.nodes(tile), &block.bounds())?;
    let nodes = BlockNodes::new(&block);
    let own = grid.own(tile);
    // Without feature edges: they add few triangles.
    s.edges.clear(nodes.shape);
    sample(s, grid, &local, &block, &nodes);
    s.signs.sort(&local);
    let signs = &s.signs;
    let mut found = 0;
    for (k, j) in own[2].clone().flat_map(|k| own[1].clone().map(move |j| (k, j))) {
        let (row, mine) = (k * nodes.shape[1] + j, within(&own[0]));
        found += FEATURE_CELL * (signs.featured[row] & mine).count_ones() as usize;
        for (surface, plain) in signs.plain[..local.live.len()].iter().enumerate() {
            let cells = bits(plain[row] & mine);
            found += cells.map(|i| CASES[signs.corners(surface, i, j, k)].count).sum::<usize>();
        }
    }
    let caps = local.grid_planes.iter().map(|plane| planar_caps::count(signs, &local, plane, &own));
    Some(found + caps.sum::<usize>())
}
