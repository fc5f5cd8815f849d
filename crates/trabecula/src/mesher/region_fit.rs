//! Fit of a mesh to its region: distances both ways, features that are not kept, and the uncovered part of the region.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::conforming_tets::evaluated as values;
use crate::field::Field;
use crate::map::surface_feet::feet;
use geometry::math::{Vec3, norm, sub};
use geometry::mesh::Mesh;
use geometry::mesh::surface_samples::SurfaceSample;
use geometry::tetmesh::TetMesh;
use geometry::tetmesh::surface_fit::{Distances, LostFeature, distances, lost_features, to_boundary, volume_outside};
use geometry::tetmesh::tet_locator::TetLocator;

/// Spacing of the samples of a surface, in sizes of tetrahedra.
const STEP: f64 = 1.0 / 8.0;
/// About the maximum number of samples of a surface.
const MOST: f64 = 400_000.0;

/// How a tetrahedral mesh fits its region.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitReport {
    /// Distances from the boundary of the mesh to the region's surface.
    pub to_part: Distances,
    /// Distances from the region's surface to the boundary of the mesh.
    pub from_part: Distances,
    /// Volume of tetrahedra outside the region, mm³.
    pub gained: f64,
    /// Volume of the region outside the tetrahedra, mm³.
    pub missed: f64,
    /// Features of the region that the mesh does not keep, the deepest first: where its surface is farther than an eighth of a
    /// tetrahedron's size from the boundary.
    pub lost: Vec<LostFeature>,
    /// Share of the region that no tetrahedron covers.
    pub uncovered: f64,
    /// Greatest depth of such a point below the region's surface, mm.
    pub uncovered_depth: f64,
    /// Position of that point, mm.
    pub uncovered_at: [f64; 3],
    /// Volume left out where the boundary would meet itself, and of fragments, mm³.
    pub mended: f64,
}

/// The fit of a mesh of tetrahedra of `size` (mm) to a region of some volume (mm³), given its surface, its signed distance (mm) and
/// points inside it; `mended` (mm³) is what the mesher left out.
pub fn fit(
    mesh: &TetMesh,
    size: f64,
    surface: &Mesh,
    (region, volume): (&dyn Field, f64),
    inside: &[Vec3],
    mended: f64,
) -> FitReport {
    let spacing = |of: &Mesh| (STEP * size).max((of.area() / MOST).sqrt());
    let boundary = mesh.boundary();
    let own = boundary.samples(spacing(&boundary));
    let locator = TetLocator::new(mesh);
    let step = spacing(surface);
    let samples = on_surface(region, surface.samples(step), step);
    let off = to_boundary(&samples, &boundary, &locator);
    let (uncovered, uncovered_depth, uncovered_at) = uncovered(&locator, region, inside);
    FitReport {
        to_part: distances(&own, &values(region, &own.iter().map(|s| s.at).collect::<Vec<_>>())),
        from_part: distances(&samples, &off),
        gained: volume_outside(mesh, |p| values(region, p)),
        missed: uncovered * volume,
        lost: lost_features(&samples, &off, size, step),
        uncovered,
        uncovered_depth,
        uncovered_at,
        mended,
    }
}

/// Samples of a surface that is near the region's, moved onto it; those that do not come nearer to it stay. Those that are farther off
/// than `reach` (mm) are left out: triangles within the solid, as of bodies that overlap, are no part of the region's surface.
fn on_surface(region: &dyn Field, mut samples: Vec<SurfaceSample>, reach: f64) -> Vec<SurfaceSample> {
    let start: Vec<Vec3> = samples.iter().map(|s| s.at).collect();
    let moved = feet(region, &start);
    let [before, after] = [&start, &moved].map(|points| values(region, points));
    let near = |i: usize| norm(sub(moved[i], start[i])) < reach;
    for (i, s) in samples.iter_mut().enumerate() {
        if after[i].abs() < before[i].abs() && near(i) {
            s.at = moved[i];
        }
    }
    let mut kept = (0..start.len()).map(|i| before[i].abs() <= reach || near(i));
    samples.retain(|_| kept.next().unwrap_or(true));
    samples
}

/// The share of a region that no tetrahedron covers, by points inside it, and the greatest depth (mm) of such a point and its position.
fn uncovered(mesh: &TetLocator, region: &dyn Field, inside: &[Vec3]) -> (f64, f64, Vec3) {
    let left: Vec<Vec3> = inside.par_iter().filter(|p| !mesh.covers(**p)).copied().collect();
    let depths = values(region, &left);
    let deep = (0..left.len()).fold(0, |m, i| if depths[i] < depths[m] { i } else { m });
    (
        left.len() as f64 / inside.len().max(1) as f64,
        depths.get(deep).map_or(0.0, |v| -v),
        left.get(deep).copied().unwrap_or_default(),
    )
}
