//! What hangs together in a lattice over a tetrahedral mesh, told from ports alone: before, and without, its surface.
//!
//! The solid in a tetrahedron follows from the values at its nodes; so does its trace on each face, which is the same from both
//! sides. Pieces of tetrahedra are joined where they share some of a trace: that is all there is to it, and it needs neither
//! places nor triangles. Tetrahedra with equal numbers at their nodes are looked at once.

use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;

use super::census::Links;
use super::piece::{Piece, Scratch};
use super::{Of, Work};
use crate::extract::bodies::Sum;
use crate::map::tets::NONE;
use crate::tiling::{Level, Tiling};

/// Steps along the edge of a tetrahedron.
const STEPS: usize = 16;
/// More tetrahedra than this with numbers of their own are not looked at.
const MOST: usize = 20_000;

/// What hangs together.
#[derive(Clone, Debug, PartialEq)]
pub struct Foretold {
    /// Pieces of the solid.
    pub pieces: usize,
    /// Every two zones that have faces in common, by their numbers.
    pub joins: Vec<Join>,
}

/// Two zones that have faces in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Join {
    /// The zones, the lower first.
    pub zones: [u32; 2],
    /// Faces that have a tetrahedron of each on their sides.
    pub faces: usize,
    /// Those of them that solid passes through.
    pub open: usize,
    /// Whether the piece that is in most tetrahedra of one zone is also that of the other.
    pub joined: bool,
}

/// What hangs together in a lattice, on a subdivision of 16 steps; `None` if more than 20 000 tetrahedra differ in their
/// levels or cells, or the mesh is one that no surface is made for.
pub fn foretold(tiling: &Tiling) -> Option<Foretold> {
    let work = Work::in_steps(tiling, STEPS).ok()?;
    let map = &tiling.map;
    // The first tetrahedron of each kind, and the kind of each.
    let (mut firsts, mut kinds, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    for t in 0..map.len() {
        let kind = *known.entry((numbers(tiling, t), work.mask(t))).or_insert_with(|| {
            firsts.push(t);
            firsts.len() - 1
        });
        kinds.push(kind);
        if firsts.len() > MOST {
            return None;
        }
    }
    let piece = |scratch: &mut Scratch, t: &usize| {
        let made = match work.piece(*t, scratch) {
            Of::Own(piece) => *piece,
            Of::Same(piece) => piece.clone(),
        };
        // All but what is placed.
        Piece { places: Vec::new(), triangles: Vec::new(), ..made }
    };
    let pieces: Vec<Piece> = firsts.par_iter().map_init(Scratch::default, piece).collect();
    let mut links = Links::default();
    // For each piece of solid in a tetrahedron, the tetrahedron and the number in `links`.
    let (mut of, mut solids) = (Vec::new(), Vec::new());
    for (t, kind) in kinds.iter().enumerate() {
        let piece = &pieces[*kind];
        let first = links.next(piece.bounds.len());
        let sums = vec![Sum::NONE; piece.bounds.len()];
        links.add(map, t, work.mask(t), piece, &sums).ok()?;
        for s in 0..piece.solids {
            of.push(t);
            solids.push(first + s);
        }
    }
    let wholes = links.wholes(&solids);
    let mut names = wholes.clone();
    names.sort_unstable();
    names.dedup();
    // For each zone, in how many of its tetrahedra each piece is.
    let mut about: BTreeMap<u32, HashMap<u32, usize>> = BTreeMap::new();
    for (t, whole) in of.iter().zip(&wholes) {
        *about.entry(map.zone(*t)).or_default().entry(*whole).or_default() += 1;
    }
    let main = |zone: u32| {
        let of = about.get(&zone)?;
        of.iter().max_by_key(|(name, count)| (**count, u32::MAX - **name)).map(|(name, _)| *name)
    };
    let mut joins: BTreeMap<[u32; 2], Join> = BTreeMap::new();
    for t in 0..map.len() {
        for (face, other) in map.across(t).into_iter().enumerate() {
            if other == NONE || other as usize <= t {
                continue;
            }
            let (a, b) = (map.zone(t), map.zone(other as usize));
            if a == b {
                continue;
            }
            let zones = [a.min(b), a.max(b)];
            let join = joins.entry(zones).or_insert_with(|| Join {
                zones,
                faces: 0,
                open: 0,
                joined: main(a).is_some() && main(a) == main(b),
            });
            join.faces += 1;
            join.open += usize::from(!pieces[kinds[t]].faces[face].is_empty());
        }
    }
    Some(Foretold { pieces: names.len(), joins: joins.into_values().collect() })
}

/// All that a tetrahedron's piece follows from: levels and weights at its nodes.
fn numbers(tiling: &Tiling, t: usize) -> Vec<u64> {
    let ids = tiling.map.tet(t);
    let at = |of: &[f64]| ids.map(|n| of[n as usize].to_bits());
    let mut out = Vec::new();
    if let Level::Nodes(of) = &tiling.level {
        out.extend(at(of));
    }
    for c in &tiling.cells {
        out.extend(c.weights.iter().flat_map(|w| at(w)));
    }
    out
}
