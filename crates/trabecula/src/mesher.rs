//! Tetrahedral mesh of a region: a body-centred cubic lattice, finer where surfaces are curved, cut along each surface of the region.
//!
//! Cutting and the improvement of shapes are those of `conforming_tets`, shared with volume meshes.

use crate::conforming_tets::{GONE, MOST as SURFACES, Partition, Patched, Shaping, Tet, prepared};
use crate::csg_tree::CsgTree;
use crate::grade::Grade;
use crate::implicit::Surface;
use crate::region::Region;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3};
use geometry::progress::checkpoint;
use geometry::tetmesh::TetMesh;
use geometry::tetmesh::tet_locator::TetLocator;
use rayon::prelude::*;
use refinement_criterion::RefinementCriterion;

mod bcc_grid;
mod refinement_criterion;
mod region_fit;

pub use crate::conforming_tets::{ANGLES, MadeLayers, PrismLayers};
pub use region_fit::{FitReport, fit};

/// Maximum number of tetrahedra.
const MOST: usize = 20_000_000;
/// Sample points of the least sizes whose tetrahedra are not counted in advance: they may stand for less than their share of the volume.
const RARE: usize = 20;
/// Where more than this fraction of the volume is left out, the region is cut in less exact ways too, and the mesh that covers most of it
/// is kept.
const LOSS: f64 = 1e-3;
/// The width of the narrowest patches in the first of these, as a fraction of the size.
const WIDE: f64 = 0.5;
/// Least and greatest stretch of the lattice along an axis, so that both bounding planes are planes of it.
const STRETCH: [f64; 2] = [0.67, 1.5];

/// A mesh that was made.
#[derive(Clone, Debug, Default)]
pub struct Background {
    /// The tetrahedra, with the nodes of the boundary on the region's surface.
    pub mesh: TetMesh,
    /// The nodes of the same tetrahedra shifted so that the volume between their flat faces and the surface balances, layers as they are.
    pub balanced: Vec<Vec3>,
    /// The volume (mm³) left out where the boundary would be non-manifold, of flat tetrahedra at it, and of small detached fragments.
    pub left_out: f64,
    /// The layers of prisms, if any.
    pub layers: Option<MadeLayers>,
}

/// The tetrahedral mesh of a region in `bounds`: tetrahedra of at most the volume of a regular one of edge `size` (mm), smaller where
/// the surface is curved, whose faces, edges and corners are on those of the region. `inside` are uniformly spread points in the region,
/// used to sample the size.
///
/// The result does not depend on the number of threads.
///
/// **Errors**: a size that is not positive, a size so large that no tetrahedron fits, or so small that there are more
/// than twenty million tetrahedra.
pub fn background(
    region: &Region,
    bounds: &Aabb,
    size: &Grade,
    inside: &[Vec3],
    layers: Option<&PrismLayers>,
) -> Result<Background, Fault> {
    let mut sizes = vec![0.0; inside.len()];
    size.values(inside, &mut sizes);
    let wrong = |v: &&f64| !(v.is_finite() && **v > 0.0);
    if let Some(v) = sizes.iter().find(wrong) {
        let message = format!("size is {} mm; it must be a finite number greater than 0", number(*v));
        return Err(Fault::new("size", message));
    }
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    if region.volume().is_some_and(|volume| surely_more(sizes, volume)) {
        return Err(bcc_grid::too_many(MOST));
    }
    let extent = bounds.size().into_iter().fold(0.0, f64::max);
    // A cube holds twelve tetrahedra: ∛√2 times the edge of the regular tetrahedron of a twelfth of its volume.
    let cube = 2f64.powf(1.0 / 6.0) * largest.min(extent);
    let grid = bcc_grid::BccGrid::new(&**region, bounds, fitted(region, bounds, cube), MOST)?;
    // Less exact ways are for too many surfaces, and for features too fine for their edges to be followed.
    let ways: [&dyn Fn() -> Option<Cuts>; 4] = [
        &|| Cuts::by_surfaces(region, cube, Patched::NARROW),
        &|| Cuts::by_surfaces(region, cube, WIDE).filter(|c| !c.patched.is_empty()),
        &|| Some(Cuts::as_one(region, true)),
        &|| Some(Cuts::as_one(region, false)),
    ];
    let mut best = Background::default();
    let mut least = usize::MAX;
    for cuts in ways.iter().filter_map(|way| way()) {
        let made = cuts.mesh(region, grid.clone(), size, cube, layers)?;
        if made.left_out <= LOSS * made.mesh.volume() && !made.mesh.tets.is_empty() {
            return Ok(made);
        }
        let locator = TetLocator::new(&made.mesh);
        let missed = inside.par_iter().filter(|p| !locator.covers(**p)).count();
        if missed < least {
            (best, least) = (made, missed);
        }
    }
    if best.mesh.tets.is_empty() {
        let message = format!(
            "no tetrahedron of size {} mm fits into the region; use a smaller one, at most half its thickness",
            number(largest)
        );
        return Err(Fault::new("size", message));
    }
    Ok(best)
}

/// Whether tetrahedra of these sizes, at points that are uniformly spread in a volume, are more than `MOST`, curvature left out.
fn surely_more(mut sizes: Vec<f64>, volume: f64) -> bool {
    sizes.sort_by(f64::total_cmp);
    let count = |size: &f64| 72f64.sqrt() / (refinement_criterion::SPREAD * size).powi(3);
    let share = volume / sizes.len().max(1) as f64;
    share * sizes.iter().skip(RARE).map(count).sum::<f64>() > MOST as f64
}

/// What the lattice is cut along.
struct Cuts {
    /// The region's own surfaces, then the groups of patches of those that are meshes.
    surfaces: Vec<Surface>,
    own: usize,
    patched: Vec<Patched>,
    trees: [CsgTree; 1],
    /// Whether tetrahedra are smaller where a surface is curved.
    finer: bool,
}

impl Cuts {
    /// Each surface of a region, of meshes each patch at least as wide as this fraction of the size; `None` if there are more than a node can know.
    fn by_surfaces(region: &Region, cube: f64, narrow: f64) -> Option<Cuts> {
        let mut surfaces = Vec::new();
        let trees = [region.clone().surfaces(0.0, &mut surfaces)];
        let own = surfaces.len();
        (own <= SURFACES).then(|| {
            let patched = Patched::of(&mut surfaces, cube, narrow);
            Cuts { surfaces, own, patched, trees, finer: true }
        })
    }

    /// The distance of the region as one surface, whose edges are not followed.
    fn as_one(region: &Region, finer: bool) -> Cuts {
        let surfaces = vec![Surface::distance(region.clone())];
        Cuts { surfaces, own: 1, patched: Vec::new(), trees: [CsgTree::Leaf(0)], finer }
    }

    /// The lattice cut and improved, with layers.
    fn mesh(
        &self,
        region: &Region,
        mut grid: bcc_grid::BccGrid,
        size: &Grade,
        cube: f64,
        layers: Option<&PrismLayers>,
    ) -> Result<Background, Fault> {
        let Cuts { surfaces, patched, trees, .. } = self;
        let criterion =
            RefinementCriterion { region, surfaces: if self.finer { surfaces } else { &[] }, patched, size };
        grid.refine(MOST, |p| criterion.coarse(p))?;
        let tets = grid.tets.iter().map(|t| Tet { nodes: *t, negative: 0, positive: 0 }).collect();
        let nodes = grid.positions();
        let (on, next) = (vec![0; nodes.len()], (0..nodes.len() as u32).collect());
        let mut partition = Partition { surfaces, patched, trees, nodes, on, next, tets };
        partition.hold_nodes(self.own, cube);
        for s in 0..self.own {
            checkpoint();
            partition.cut(s, cube);
        }
        partition.join_planes();
        let (shaping, dropped) = prepared(partition, true);
        shaped(shaping, cube, dropped, layers)
    }
}

/// The mesh with its shapes improved and its layers made.
fn shaped(mut shaping: Shaping, cube: f64, dropped: f64, layers: Option<&PrismLayers>) -> Result<Background, Fault> {
    let goes_on = || {
        checkpoint();
        true
    };
    shaping.improve(&goes_on);
    if shaping.follow_creases(cube) {
        shaping.improve(&goes_on);
    }
    let shelled = shaping.shell(true);
    // What leaves nothing has no triangle to choose: other ways may.
    let layers = layers.filter(|_| shaping.tets.iter().any(|t| *t != GONE));
    let made = layers.map(|layers| shaping.layered(layers, MOST)).transpose()?;
    let tets: Vec<[u32; 4]> = shaping.tets.iter().filter(|t| **t != GONE).copied().collect();
    let of = |nodes: &[Vec3]| TetMesh { nodes: nodes.to_vec(), tets: tets.clone(), zones: Vec::new() }.compact();
    let mesh = of(&shaping.nodes);
    let (made, filled) = made.unzip();
    shaping.balance(true, &filled.unwrap_or_default());
    Ok(Background { mesh, balanced: of(&shaping.nodes).nodes, left_out: dropped + shelled, layers: made })
}

/// The edges of the lattice's cubes, near the requested one, for which the region's bounding planes are planes of the lattice: of corners
/// or of centres.
fn fitted(region: &Region, bounds: &Aabb, cube: f64) -> Vec3 {
    core::array::from_fn(|a| {
        let mut planes = Vec::new();
        region.planes(a, &mut planes);
        let length = bounds.max[a] - bounds.min[a];
        let edge = 2.0 * length / (2.0 * length / cube).round().max(1.0);
        let fits = planes.contains(&bounds.min[a]) && planes.contains(&bounds.max[a]);
        if fits && (STRETCH[0]..=STRETCH[1]).contains(&(edge / cube)) { edge } else { cube }
    })
}
