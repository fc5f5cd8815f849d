//! Predicted connectivity of a lattice over a tetrahedral mesh, from its traces on faces alone, without making the surface.
//!
//! The solid in a tetrahedron follows from the values at its nodes, and so does its trace on each face, which is the same from
//! both sides. Solid components of adjacent tetrahedra are joined where they share a part of a trace, which requires neither
//! positions nor triangles. Tetrahedra with equal values at their nodes are evaluated once.

use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;

use super::component_links::ComponentLinks;
use super::tet_surface::{TetBuffers, TetSurface};
use super::{MeshingContext, TetSurfaceRef};
use crate::map::tet_map::NONE;
use crate::surface_maker::Totals;
use crate::tiling::{NodalLevel, Tiling};

/// Steps along the edge of a tetrahedron, and finer ones at which pieces are counted again: necks thinner than a step part.
const STEPS: usize = 16;
const FINER: [usize; 2] = [32, 48];
/// Greatest number of small tetrahedra in those with different values at their nodes: 20 000 of 16 steps.
const MOST: usize = 20_000 * STEPS.pow(3);
/// The same where tetrahedra overlap, and values are dearer.
const MOST_BLENDED: usize = MOST / 5;

/// Predicted connected components.
#[derive(Clone, Debug, PartialEq)]
pub struct Connectivity {
    /// Steps along the edge of a tetrahedron that show it.
    pub steps: usize,
    /// Number of connected components of the solid.
    pub components: usize,
    /// All pairs of zones that have faces in common, by their numbers.
    pub pairs: Vec<ZonePair>,
}

/// Two zones that have faces in common.
#[derive(Clone, Debug, PartialEq)]
pub struct ZonePair {
    /// The zones, the lower first.
    pub zones: [i64; 2],
    /// Faces between a tetrahedron of one and a tetrahedron of the other.
    pub faces: usize,
    /// How many of them the solid passes through.
    pub open: usize,
    /// Whether the component present in most tetrahedra of one zone is also that of the other.
    pub joined: bool,
}

/// The connectivity of a lattice on a subdivision of 16 steps; of several pieces on finer ones, until two of them have as many.
/// `None` if more than 20 000 tetrahedra differ in their levels or cells, 4 000 where they overlap, or the mesh is one that no
/// surface is made for.
pub fn connectivity(tiling: &Tiling) -> Option<Connectivity> {
    let mut found = in_steps(tiling, STEPS)?;
    for n in FINER {
        if found.components == 1 {
            break;
        }
        let Some(finer) = in_steps(tiling, n) else { break };
        let settled = finer.components == found.components;
        found = finer;
        if settled {
            break;
        }
    }
    Some(found)
}

/// The fewest steps along the edge of a tetrahedron, from `least` on, such that the surface has as many components as
/// [`connectivity`] predicts in them and in all finer ones up to those that show it; `None` where that predicts nothing.
pub fn steps_enough(tiling: &Tiling, least: usize) -> Option<usize> {
    let Connectivity { steps, components, .. } = connectivity(tiling)?;
    let mut finer = (least..steps).rev();
    let broken = finer.find(|n| in_steps(tiling, *n).is_none_or(|c| c.components != components));
    Some(broken.map_or(least.min(steps), |n| n + 1))
}

/// The connectivity on a subdivision of `n` steps.
fn in_steps(tiling: &Tiling, n: usize) -> Option<Connectivity> {
    let most = if tiling.map.overlap() > 0.0 { MOST_BLENDED } else { MOST } / n.pow(3);
    let work = MeshingContext::in_steps(tiling, n).ok()?;
    let map = &tiling.map;
    if map.overlap() > 0.0 {
        // Overlapping tetrahedra need positions, which are found in parallel themselves.
        work.bent_nodes();
    }
    // The first tetrahedron of each kind, and the kind of each.
    let (mut firsts, mut kinds, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    for t in 0..map.len() {
        let kind = *known.entry((numbers(tiling, t), work.mask(t))).or_insert_with(|| {
            firsts.push(t);
            firsts.len() - 1
        });
        kinds.push(kind);
        if firsts.len() > most {
            return None;
        }
    }
    let surface = |scratch: &mut TetBuffers, t: &usize| {
        let made = match work.tet_surface(*t, scratch) {
            TetSurfaceRef::Own(surface) => *surface,
            TetSurfaceRef::Shared(surface) => surface.clone(),
        };
        // Without positions.
        TetSurface { vertices: Vec::new(), triangles: Vec::new(), ..made }
    };
    let surfaces: Vec<TetSurface> = firsts.par_iter().map_init(TetBuffers::default, surface).collect();
    let mut links = ComponentLinks::default();
    // For each component of the solid in a tetrahedron, the tetrahedron and the number in `links`.
    let (mut of, mut solids) = (Vec::new(), Vec::new());
    for (t, kind) in kinds.iter().enumerate() {
        let surface = &surfaces[*kind];
        let first = links.next(surface.solid_of.len());
        let totals = vec![Totals::ZERO; surface.solid_of.len()];
        links.add(map, t, work.mask(t), surface, &totals).ok()?;
        for s in 0..surface.solids {
            of.push(t);
            solids.push(first + s);
        }
    }
    let roots = links.roots(&solids);
    let mut names = roots.clone();
    names.sort_unstable();
    names.dedup();
    // For each zone, the number of its tetrahedra in which each component is.
    let mut about: BTreeMap<i64, HashMap<u32, usize>> = BTreeMap::new();
    for (t, root) in of.iter().zip(&roots) {
        *about.entry(map.zone(*t)).or_default().entry(*root).or_default() += 1;
    }
    let main = |zone: i64| {
        let of = about.get(&zone)?;
        of.iter().max_by_key(|(name, count)| (**count, u32::MAX - **name)).map(|(name, _)| *name)
    };
    let mut pairs: BTreeMap<[i64; 2], ZonePair> = BTreeMap::new();
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
            let pair = pairs.entry(zones).or_insert_with(|| ZonePair {
                zones,
                faces: 0,
                open: 0,
                joined: main(a).is_some() && main(a) == main(b),
            });
            pair.faces += 1;
            pair.open += usize::from(!surfaces[kinds[t]].faces[face].is_empty());
        }
    }
    Some(Connectivity { steps: n, components: names.len(), pairs: pairs.into_values().collect() })
}

/// The values that determine the surface in a tetrahedron: levels and weights at its nodes.
fn numbers(tiling: &Tiling, t: usize) -> Vec<u64> {
    let ids = tiling.map.tet(t);
    let at = |of: &[f64]| ids.map(|n| of[n as usize].to_bits());
    let mut out = Vec::new();
    if tiling.map.overlap() > 0.0 {
        // Of the neighbours too.
        out.push(t as u64);
        return out;
    }
    if let NodalLevel::Nodes(of) = &tiling.level {
        out.extend(at(of));
    }
    for c in &tiling.cells {
        out.extend(c.weights.iter().flat_map(|w| at(w)));
    }
    out
}
