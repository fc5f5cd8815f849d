//! Background tetrahedral mesher: isosurface stuffing of a body-centred cubic lattice in a region.
//!
//! The only input from the region is its signed distance. Dihedral angles are bounded: stuffing a uniform lattice
//! leaves angles between 10.7° and 164.8° for any region, and later steps keep these bounds.
//!
//! Source: F. Labelle, J. R. Shewchuk, Isosurface stuffing, ACM Transactions on Graphics 26(3), 2007. Grading (by
//! bisection), feature edges and corners, and shape improvement are additions.

use crate::field::Field;
use crate::grade::Grade;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3};
use geometry::tetmesh::{TetMesh, conformity};

mod bcc_grid;
mod boundary_repair;
mod creases;
mod features;
mod isosurface_stuffing;
mod region_fit;
mod smooth;
mod tet_shape;
mod work;

pub(crate) use boundary_repair::repair;
pub use region_fit::{Fit, Uncovered, fit};
pub use tet_shape::ANGLES;
pub(crate) use tet_shape::shape;
use work::{Around, Work};

/// Maximum number of tetrahedra.
const MOST: usize = 20_000_000;
/// Minimum shape after fitting (1 if the worst angle is one of `ANGLES`).
const LEAST: f64 = 1.0;
/// Number of rounds of feature fitting: better shapes allow more features to be fitted.
const ROUNDS: usize = 3;
/// Number of repetitions of a round whose boundary is non-manifold.
const TRIES: usize = 4;
/// Maximum relative stretch of the lattice to fit the bounds.
const FIT: f64 = 0.08;

/// The tetrahedral mesh of a region, given by its signed distance (1-Lipschitz, negative inside) and bounds: tetrahedra
/// of the volume of a regular one of edge `size` (mm), boundary nodes on the surface. `inside` are uniformly spread
/// points in the region, used to sample the size. Also the volume (mm³) removed where the boundary was non-manifold, and of small
/// detached fragments.
///
/// The result does not depend on the number of threads.
///
/// **Errors**: a size that is not positive, a size so large that no tetrahedron fits, or so small that there are more
/// than twenty million tetrahedra.
pub fn background(region: &dyn Field, bounds: &Aabb, size: &Grade, inside: &[Vec3]) -> Result<(TetMesh, f64), Fault> {
    let mut sizes = vec![0.0; inside.len()];
    size.values(inside, &mut sizes);
    let wrong = |v: &&f64| !(v.is_finite() && **v > 0.0);
    if let Some(v) = sizes.iter().find(wrong) {
        let message = format!("size is {} mm; it must be a finite number greater than 0", number(*v));
        return Err(Fault::new("size", message));
    }
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let extent = bounds.size().into_iter().fold(0.0, f64::max);
    // A cube holds twelve tetrahedra: ∛√2 times the edge of the regular tetrahedron of a twelfth of its volume.
    let cube = fitted(bounds, 2f64.powf(1.0 / 6.0) * largest.min(extent));
    let mut grid = bcc_grid::Grid::new(region, bounds, cube, MOST)?;
    if size.constant().is_none() {
        grid.refine(region, size, MOST)?;
    }
    let (mut mesh, on) = isosurface_stuffing::stuff(&grid, region);
    let mended = repair(&mut mesh);
    if mesh.tets.is_empty() {
        let message = format!(
            "no tetrahedron of size {} mm fits into the region; use a smaller one, at most half its thickness",
            number(largest)
        );
        return Err(Fault::new("size", message));
    }
    Ok((shaped(Work::new(region, mesh, on)).compact(), mended))
}

/// Moves nodes onto edges and corners of the region and improves shapes, in rounds: better shapes allow more features
/// to be fitted. Where the boundary would become non-manifold, as at thin walls, nodes stay where they are.
fn shaped(mut work: Work) -> TetMesh {
    for round in 1..=ROUNDS {
        let before = (work.mesh.clone(), work.on.clone(), work.held.clone());
        let mut tries = 0..TRIES;
        loop {
            features::features(&mut work, LEAST);
            creases::creases(&mut work, LEAST, round > 1);
            smooth::smooth(&mut work);
            let clashes = conformity::clashes(&work.mesh.boundary());
            if clashes.is_empty() {
                break;
            }
            let (mesh, on, held) = before.clone();
            if tries.next().is_none() {
                return mesh;
            }
            work.barred.extend(clashes);
            work.around = Around::new(&mesh);
            (work.mesh, work.on, work.held) = (mesh, on, held);
        }
    }
    work.mesh
}

/// The cube edge of the lattice, near the requested one, for which most bounds are planes of the lattice.
fn fitted(bounds: &Aabb, cube: f64) -> f64 {
    const STEPS: i32 = 160;
    let misfit = |cube: f64| {
        let off = bounds.size().map(|l| {
            let n = 2.0 * l / cube;
            (n - n.round()).abs()
        });
        off.into_iter().sum::<f64>()
    };
    let cost = |c: f64| misfit(c) + 0.5 * (c / cube - 1.0).abs() / FIT;
    // Candidates that fit one extent exactly, and uniform candidates between.
    let exact = bounds.size().into_iter().flat_map(|l| {
        let n = (2.0 * l / cube).round();
        (-3..=3).map(move |d| 2.0 * l / (n + f64::from(d)).max(1.0))
    });
    let even = (-STEPS..=STEPS).map(|i| cube * (1.0 + FIT * f64::from(i) / f64::from(STEPS)));
    exact.chain(even).filter(|c| (c / cube - 1.0).abs() <= FIT).fold(cube, |m, c| if cost(c) < cost(m) { c } else { m })
}
