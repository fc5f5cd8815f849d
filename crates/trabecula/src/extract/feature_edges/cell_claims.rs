//! Claims: which cells are filled from their boundary loops instead of by marching cubes or cutting, and for which surface.

use std::borrow::Cow;
use std::ops::Range;

use rustc_hash::FxHashMap;

use super::TracedEdges;
use crate::csg_tree::CsgTree;
use crate::extract::block_nodes::BlockNodes;
use crate::extract::sampling_grid::LocalSolid;
use crate::extract::sign_words::{Signs, bits};

/// The claimed cells of a block.
#[derive(Default)]
pub(in crate::extract) struct CellClaims {
    /// For each row of cells: those that are filled from their boundary loops.
    pub cells: Vec<u64>,
    /// Those of them where the surface meets others, and which surface that is.
    pub(super) fitted: Vec<u64>,
    fitted_to: Option<usize>,
    /// The surface with feature edges, by the lowest node of the cell.
    pub(super) surface: FxHashMap<usize, usize>,
}

impl CellClaims {
    /// Forgets all claims, for a block of this shape.
    pub(super) fn clear(&mut self, shape: [usize; 3]) {
        self.cells.clear();
        self.cells.resize(shape[1] * shape[2], 0);
        self.fitted_to = None;
        self.fitted.clear();
        self.fitted.resize(shape[1] * shape[2], 0);
        self.surface.clear();
    }

    /// Whether any cell is claimed.
    pub fn any(&self) -> bool {
        !self.surface.is_empty()
    }

    pub(super) fn add(&mut self, nodes: &BlockNodes, cell: [usize; 3], surface: usize) {
        self.cells[cell[2] * nodes.shape[1] + cell[1]] |= 1 << cell[0];
        self.surface.insert(nodes.index(cell), surface);
    }

    /// Claims the feature cells in which a surface with feature edges is the only one: the sampled values near feature edges
    /// say little of the position of the surface, so such cells are filled from their boundary loops.
    pub fn claim_sole(&mut self, local: &LocalSolid, signs: &mut Signs, nodes: &BlockNodes, surface: usize) {
        let featured: Vec<[usize; 3]> = signs.feature_cells().collect();
        for cell in featured {
            let [i, j, k] = cell;
            let row = k * nodes.shape[1] + j;
            let crossed = !matches!(signs.corners(surface, i, j, k), 0 | 0xff);
            if crossed && decides(local, signs, surface, cell) {
                signs.featured[row] &= !(1 << i);
                signs.plain[surface][row] |= 1 << i;
                self.add(nodes, cell, surface);
            }
        }
    }

    /// Claims the feature cells in which a surface with feature edges meets others.
    pub fn claim_fitted(
        &mut self,
        local: &LocalSolid,
        signs: &mut Signs,
        nodes: &BlockNodes,
        traced: &TracedEdges,
        surface: usize,
    ) {
        self.fitted_to = Some(surface);
        let mixed = |signs: &Signs, [i, j, k]: [usize; 3]| !matches!(signs.corners(surface, i, j, k), 0 | 0xff);
        let mut found: Vec<[usize; 3]> = signs.feature_cells().collect();
        found.retain(|c| mixed(signs, *c));
        for &(_, node) in traced.segments.keys().filter(|p| p.0 == surface) {
            let cell = nodes.at(node);
            let others = OtherSurfaces::of(local, signs, surface, cell);
            if !mixed(signs, cell) && others.varies != 0 && !others.always_decides() && !others.never_decides() {
                found.push(cell);
            }
        }
        for cell in found {
            let [i, j, k] = cell;
            let row = k * nodes.shape[1] + j;
            for plain in &mut signs.plain {
                plain[row] &= !(1 << i);
            }
            signs.plain[surface][row] |= 1 << i;
            signs.featured[row] |= 1 << i;
            self.fitted[row] |= 1 << i;
            self.add(nodes, cell, surface);
        }
    }

    /// Whether a cell is fitted.
    pub fn is_fitted(&self, nodes: &BlockNodes, [i, j, k]: [usize; 3]) -> bool {
        self.fitted[k * nodes.shape[1] + j] >> i & 1 == 1
    }

    /// For each row of cells: those that place the vertices of a surface on their grid edges by linear interpolation.
    pub fn features<'a>(&self, signs: &'a Signs, surface: usize) -> Cow<'a, [u64]> {
        if self.fitted_to != Some(surface) {
            return Cow::Borrowed(&signs.featured);
        }
        let rows = signs.featured.iter().zip(&self.fitted);
        Cow::Owned(rows.map(|(k, f)| k & !f).collect())
    }

    /// The claimed cells among a tile's own, with their surfaces.
    pub fn own(&self, nodes: &BlockNodes, own: &[Range<usize>; 3]) -> Vec<([usize; 3], usize)> {
        let ny = nodes.shape[1];
        let mut found = Vec::new();
        for (row, w) in self.cells.iter().enumerate() {
            for i in bits(*w) {
                let cell = [i, row % ny, row / ny];
                if (0..3).all(|a| own[a].contains(&cell[a])) {
                    found.push((cell, self.surface[&nodes.index(cell)]));
                }
            }
        }
        found
    }
}

/// Signs of all other surfaces at the corners of a cell.
pub(super) struct OtherSurfaces<'a> {
    local: &'a LocalSolid,
    cell: [usize; 3],
    own: u64,
    negative: u64,
    pub varies: u64,
}

impl<'a> OtherSurfaces<'a> {
    pub fn of(local: &'a LocalSolid, signs: &Signs, surface: usize, [i, j, k]: [usize; 3]) -> OtherSurfaces<'a> {
        let (mut varies, mut negative) = (0u64, 0u64);
        for f in (0..local.live.len()).filter(|f| *f != surface) {
            match signs.corners(f, i, j, k) {
                0 => {}
                0xff => negative |= 1 << f,
                _ => varies |= 1 << f,
            }
        }
        OtherSurfaces { local, cell: [i, j, k], own: 1 << surface, negative, varies }
    }

    /// For each part of the solid, whether it is certain and whether it is possible, if some surfaces are negative and others
    /// may be.
    fn parts(&self, negative: u64, varies: u64) -> impl Iterator<Item = (bool, bool)> {
        let [i, j, k] = self.cell;
        let live = self.local.live.len();
        let sign = move |f: usize, mask: u64| match f.checked_sub(live) {
            Some(flat) => Signs::adjacent(self.local, flat, j, k) >> i,
            None => mask >> f,
        };
        let (some, all) = (move |f: usize| sign(f, negative | varies), move |f: usize| sign(f, negative));
        let both = move |t: &CsgTree| (t.certain(&some, &all) & 1 == 1, t.possible(&some, &all) & 1 == 1);
        self.local.trees.iter().map(both)
    }

    /// The part on one side of this surface, if it does not depend on the others: 0 is void, the parts count from 1.
    fn part(&self, own: u64) -> Option<usize> {
        let (mut certain, mut any) = (None, false);
        for (p, (is_certain, is_possible)) in self.parts(self.negative | own, self.varies).enumerate() {
            certain = certain.or(is_certain.then_some(p + 1));
            any |= is_possible;
        }
        certain.or((!any).then_some(0))
    }

    /// Whether this surface lies between the same two parts, or part and void, whatever the others do.
    pub fn always_decides(&self) -> bool {
        matches!((self.part(self.own), self.part(0)), (Some(a), Some(b)) if a != b)
    }

    /// Whether it decides in neither of the two extreme cases.
    pub fn never_decides(&self) -> bool {
        self.parts(self.negative | self.own, self.varies).eq(self.parts(self.negative, self.varies))
    }

    /// Whether the cell contains no surface at all.
    pub fn is_dead(&self) -> bool {
        self.parts(self.negative, self.varies | self.own).all(|(certain, possible)| certain == possible)
    }
}

/// Whether a surface would be the only one in a cell if it crossed the cell, whatever the other surfaces do there.
pub(super) fn decides(local: &LocalSolid, signs: &Signs, surface: usize, cell: [usize; 3]) -> bool {
    OtherSurfaces::of(local, signs, surface, cell).always_decides()
}
