//! What is meshed: domains over common surfaces, and whose each surface is.

use std::sync::Arc;

use crate::conforming_tets::{MOST, Patched};
use crate::csg_tree::{CsgSolid, CsgTree};
use crate::implicit::Surface;
use crate::solid::{Solid, Space};
use geometry::fault::Fault;

/// The length of pieces of creases, as a fraction of the edge of the background's cubes.
const PIECE: f64 = 0.125;

/// What is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeTarget {
    /// The solid.
    Solid,
    /// What is left of the region.
    Pore,
    /// The space on the lower side of a sheet.
    Lower,
    /// The space on the upper side of a sheet.
    Upper,
    /// All of the region: the wall and both spaces of a sheet, else solid and pore, with common nodes.
    All,
}

impl VolumeTarget {
    /// All, by their names.
    pub const NAMES: [(&'static str, VolumeTarget); 5] = [
        ("solid", VolumeTarget::Solid),
        ("pore", VolumeTarget::Pore),
        ("lower", VolumeTarget::Lower),
        ("upper", VolumeTarget::Upper),
        ("all", VolumeTarget::All),
    ];
}

/// Domains over common surfaces; no two overlap.
pub(super) struct Domains {
    pub names: Vec<&'static str>,
    /// The surfaces, then the groups of patches of those that are meshes.
    pub surfaces: Vec<Surface>,
    /// The number of surfaces without those groups.
    pub own: usize,
    /// Those that are meshes with feature edges.
    pub patched: Vec<Patched>,
    pub trees: Vec<CsgTree>,
    /// The number of surfaces of the region, which come first.
    pub region: usize,
    /// The number of the first surface of the lattice, which come last of these.
    pub lattice: usize,
    /// What is solid whatever the lattice says.
    pub filled: Vec<CsgSolid>,
}

impl Domains {
    /// The domains of a solid; meshes are cut patch by patch for tetrahedra of `edge` (mm) if that is given.
    ///
    /// # Errors
    /// A side of what is no sheet.
    pub fn new(solid: &Solid, of: VolumeTarget, edge: Option<f64>) -> Result<Domains, Fault> {
        let sheet = solid.field.as_ref().is_some_and(|f| f.faces().is_some());
        let (names, mut surfaces, trees) = match of {
            VolumeTarget::Lower | VolumeTarget::Upper | VolumeTarget::All if sheet || of != VolumeTarget::All => {
                let spaces = solid.spaces().map_err(|f| Fault { at: "of".into(), ..f })?;
                let chosen: &[Space] = match of {
                    VolumeTarget::Lower => &[Space::Lower],
                    VolumeTarget::Upper => &[Space::Upper],
                    _ => &Space::ALL,
                };
                let names = chosen.iter().map(|s| ["WALL", "LOWER", "UPPER"][*s as usize]).collect();
                let trees = chosen.iter().map(|s| spaces.trees[*s as usize].clone()).collect();
                (names, spaces.surfaces, trees)
            }
            _ => {
                let (surfaces, tree) = solid.surfaces();
                let region = surfaces.iter().take_while(|s| s.cut).count();
                let pore = CsgTree::Intersection(vec![region_of(&tree, region), tree.clone().inverse()]);
                match of {
                    VolumeTarget::Solid => (vec!["SOLID"], surfaces, vec![tree]),
                    VolumeTarget::Pore => (vec!["PORE"], surfaces, vec![pore]),
                    _ => (vec!["SOLID", "PORE"], surfaces, vec![tree, pore]),
                }
            }
        };
        let region = surfaces.iter().take_while(|s| s.cut).count();
        let filled: Vec<CsgSolid> = if solid.field.is_some() { solid.filled.clone() } else { Vec::new() };
        let lattice = region + filled.iter().map(|b| b.surfaces.len()).sum::<usize>();
        let own = surfaces.len();
        if own > MOST {
            let m = format!(
                "the design has {own} surfaces; a volume mesh takes at most {MOST}: unite keep zones, or mesh a part of it"
            );
            return Err(Fault::new("design", m));
        }
        if let (Some(edge), Some(field), [only]) = (edge, &solid.field, &mut surfaces[lattice..]) {
            only.creases = Arc::new(field.creases(PIECE * edge));
        }
        let patched = edge.map(|edge| Patched::of(&mut surfaces, edge, Patched::NARROW)).unwrap_or_default();
        Ok(Domains { names, surfaces, own, patched, trees, region, lattice, filled })
    }
}

/// The part of a solid's tree that is the region: its first member, which names the first `count` surfaces.
fn region_of(tree: &CsgTree, count: usize) -> CsgTree {
    match tree {
        CsgTree::Intersection(of) if count > 0 => of.first().cloned().unwrap_or(CsgTree::FULL),
        _ => CsgTree::FULL,
    }
}
