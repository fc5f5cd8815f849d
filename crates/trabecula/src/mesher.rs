//! The background mesher: a body-centred cubic lattice fitted to a region by moving nodes onto its surface and cutting.
//!
//! Needs nothing of the region but its signed distance, and its angles are bounded: cutting a lattice that is not bisected
//! leaves none below 10.7° or above 164.8°, whatever the region, and what comes after makes none worse than that.
//!
//! Source: Labelle & Shewchuk, Isosurface Stuffing, ACM Transactions on Graphics 26(3), 2007. The grading (by bisection), the
//! edges and corners, and the improvement of shapes are not from there.

use serde::Serialize;

use crate::field::Field;
use crate::grade::Grade;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3};
use geometry::tetmesh::{TetMesh, conformity};

mod cover;
mod creases;
mod features;
mod grid;
mod mend;
mod shape;
mod smooth;
mod stuff;
mod work;

pub use cover::fit;
pub use shape::ANGLES;
use work::{Around, Work};

/// More tetrahedra than this are refused.
const MOST: usize = 20_000_000;
/// Shapes that fitting may leave (1 where the worst angle is one of `ANGLES`).
const LEAST: f64 = 1.0;
/// How often edges and corners are looked for: better shapes make room for more of them.
const ROUNDS: usize = 3;
/// How often a round is done again where the boundary met itself.
const TRIES: usize = 4;
/// The lattice is stretched by at most this share to fit the bounds.
const FIT: f64 = 0.08;

/// How a mesh fits its region.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Mean distance between the boundary's triangles, at their middles and the middles of their edges, and the region's
    /// surface (mm); at edges and corners of the region, no more than that.
    pub deviation_mean: f64,
    /// 5 % of these distances are greater (mm).
    pub deviation_p95: f64,
    /// The greatest (mm).
    pub deviation: f64,
    /// Where it is (mm).
    pub deviation_at: Vec3,
    /// Share of the region that no tetrahedron covers, by looks at points in it: cut edges and thin walls.
    pub lost: f64,
    /// How deep below the region's surface the deepest such point is (mm).
    pub lost_depth: f64,
    /// Where it is (mm).
    pub lost_at: Vec3,
    /// Volume taken away where the boundary would have met itself, and of crumbs beside the main pieces (mm³).
    pub mended: f64,
}

/// The tetrahedral mesh of a region, by its signed distance (1-Lipschitz, negative inside) and its bounds: tetrahedra of
/// the volume of a regular one of edge `size` (mm), boundary nodes on the surface. `inside` are points in the region,
/// spread evenly, by which the size is looked at and what is lost is found.
///
/// The same for any number of threads.
///
/// **Errors**: a size that is not positive, so great that nothing is left of the region, or so small that there are more than
/// twenty million tetrahedra.
pub fn background(region: &dyn Field, bounds: &Aabb, size: &Grade, inside: &[Vec3]) -> Result<(TetMesh, Fit), Fault> {
    let mut sizes = vec![0.0; inside.len()];
    size.values(inside, &mut sizes);
    let wrong = |v: &&f64| !(v.is_finite() && **v > 0.0);
    if let Some(v) = sizes.iter().find(wrong) {
        let message = format!("size is {} mm; it must be a finite number greater than 0", number(*v));
        return Err(Fault::new("size", message));
    }
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let extent = bounds.size().into_iter().fold(0.0, f64::max);
    // A cube holds twelve tetrahedra: ∛√2 of the edge of the regular one of a twelfth of it.
    let cube = fitted(bounds, 2f64.powf(1.0 / 6.0) * largest.min(extent));
    let mut grid = grid::Grid::new(region, bounds, cube, MOST)?;
    if size.constant().is_none() {
        grid.refine(region, size, MOST)?;
    }
    let (mut mesh, on) = stuff::stuff(&grid, region);
    let mended = mend::mend(&mut mesh);
    if mesh.tets.is_empty() {
        let message = format!(
            "no tetrahedron of size {} mm fits into the region; use a smaller one, at most half its thickness",
            number(largest)
        );
        return Err(Fault::new("size", message));
    }
    let mesh = shaped(Work::new(region, mesh, on)).compact();
    let fit = Fit { mended, ..fit(&mesh, region, inside) };
    Ok((mesh, fit))
}

/// Puts nodes onto edges and corners of the region and betters the shapes, in rounds: better shapes make room for more of
/// them. Where the boundary would then meet itself, as at thin walls, things are left as they were.
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

/// The edge of the lattice's cubes, near the one asked for, for which most bounds are planes of the lattice.
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
    // What fits one side exactly, and what is between.
    let exact = bounds.size().into_iter().flat_map(|l| {
        let n = (2.0 * l / cube).round();
        (-3..=3).map(move |d| 2.0 * l / (n + f64::from(d)).max(1.0))
    });
    let even = (-STEPS..=STEPS).map(|i| cube * (1.0 + FIT * f64::from(i) / f64::from(STEPS)));
    exact.chain(even).filter(|c| (c / cube - 1.0).abs() <= FIT).fold(cube, |m, c| if cost(c) < cost(m) { c } else { m })
}
