//! The volume error to expect of a mesh on a grid.
//!
//! One period of each lattice, cut by planes, is meshed by itself. Its true volume is known: the fraction that the cell has on the
//! torus. So the error is found by the very method that meshes the part, whatever its order is at this spacing: the fourth where
//! every cell of the grid has one smooth patch, the second where walls are thinner than two steps. Of beams it is some of their hubs.
//!
//! Surfaces of the region that are no planes of the grid cut lattices along lines, in cells in which surfaces are planes. These miss a
//! lattice's curved surface to the same side all along a line: by about h² / λ, over h times the length of all lines, which is V / λ² L for
//! each surface in a region of the volume V = L³. So the error is of the third power of the step h.

mod of_beams;

use std::sync::Arc;

use geometry::math::Vec3;
use geometry::progress::Silent;
use rayon::prelude::*;

use super::varied::Varied;
use super::{Built, sample};
use crate::cell::Part;
use crate::extract;
use crate::grade::Grade;
use crate::lattice::{Lattice, Level};
use crate::map::Affine;
use crate::region::Cuboid;
use crate::solid::Solid;

/// Most steps on a wavelength that are meshed; at finer spacings the error is taken to fall with the second power.
const MOST: f64 = 64.0;

/// Longest wavelength that is meshed, in shortest ones: a cell that is more stretched is smoother along it.
const STRETCH: f64 = 4.0;

/// Corners of the periods that are meshed, in wavelengths: one in step with the grid, one not.
const CORNERS: [Vec3; 2] = [[0.0; 3], [0.382, 0.618, 0.236]];

/// The relative error that the cuts of a region cost for each surface of a lattice, by (h / λ)³ λ / (L φ): about that of named cells in balls,
/// cylinders and bores (`tests/laws/measured.rs`).
const CUT: f64 = 3.0;

/// The relative error to expect of the volume that lattices and beams have in a mesh at grid spacing `edge` (mm), the greatest of all;
/// `None` where none is meshed on a grid, where lattices over tetrahedra are too, and where beams overlap halfway along. The realised one
/// is at most three times as much (`tests/laws/measured.rs`).
pub(super) fn volume_error(built: &Built, edge: f64) -> Option<f64> {
    if !built.tilings.is_empty() {
        return None;
    }
    let region = &built.solid.region;
    let (points, share) = match built.lattices.is_empty() {
        true => (Vec::new(), 0.0),
        false => sample::inside(region, sample::COUNT),
    };
    let width = curved(&built.solid).then(|| (share * region.bounds().size().iter().product::<f64>()).cbrt());
    let lattices = built.lattices.iter().map(|(_, lattice)| Some(of_lattice(lattice, &points, width, edge)));
    let beams = built.beams.iter().map(|(_, beams)| of_beams::of_beams(beams, built, edge));
    let errors: Option<Vec<f64>> = lattices.chain(beams).collect();
    errors?.into_iter().reduce(f64::max)
}

/// Whether the lattices of a solid are cut by a surface that is no plane of the grid.
fn curved(solid: &Solid) -> bool {
    let mut cuts = Vec::new();
    solid.region.clone().surfaces(0.0, &mut cuts);
    let filled = solid.filled.iter().flat_map(|body| &body.surfaces);
    cuts.iter().chain(filled).any(|surface| surface.plane.is_none())
}

/// The relative error of a lattice; `width` is that of a region (mm) that cuts it otherwise than along planes of the grid.
fn of_lattice(lattice: &Lattice, points: &[Vec3], width: Option<f64>, edge: f64) -> f64 {
    let Varied { min, max } = Varied::of_fraction(lattice, points);
    let wavelengths = match lattice.map.affine() {
        Some(map) => map.wavelength,
        None => [lattice.map.wavelength(); 3],
    };
    let shortest = wavelengths.into_iter().fold(f64::INFINITY, f64::min);
    let wavelengths = wavelengths.map(|w| w.min(STRETCH * shortest));
    let meshed = edge.max(shortest / MOST);
    let cases = [min, max].into_iter().take(if min == max { 1 } else { 2 });
    let cases: Vec<(f64, Vec3)> = cases.flat_map(|f| CORNERS.map(|c| (f, c))).collect();
    let off = |(fraction, corner): &(f64, Vec3)| {
        let made = period(lattice, *fraction, wavelengths, *corner, meshed);
        (made / wavelengths.iter().product::<f64>() - fraction).abs()
    };
    let worst = cases.par_iter().map(off).reduce(|| 0.0, f64::max);
    let mean = match min == max {
        true => min,
        false => {
            let all = sample::values(points, |points, out| lattice.fractions(points, out));
            all.iter().sum::<f64>() / all.len() as f64
        }
    };
    let surfaces = if lattice.part == Part::Sheet { 2.0 } else { 1.0 };
    let cut = width.map_or(0.0, |width| CUT * surfaces * (edge / shortest).powi(3) * shortest / width);
    (worst * (edge / meshed).powi(2) + cut) / mean
}

/// The volume (mm³) that a mesh of one period has; 0 where the grid finds no surface.
fn period(lattice: &Lattice, fraction: f64, wavelengths: Vec3, corner: Vec3, edge: f64) -> f64 {
    let level = Level::Iso(Grade::Constant(lattice.cell.level(lattice.part, fraction)));
    let low = [0, 1, 2].map(|a| corner[a] * wavelengths[a]);
    let high = [0, 1, 2].map(|a| low[a] + wavelengths[a]);
    let (Ok(map), Ok(region)) = (Affine::rigid(wavelengths, [0.0; 3], [0.0; 3], &[]), Cuboid::new(low, high)) else {
        return 0.0;
    };
    let field = Lattice::new(lattice.cell.clone(), Arc::new(map), lattice.part, level);
    let solid = Solid::new(Arc::new(region), Some(Arc::new(field)), edge);
    extract::surface(&solid, edge, &Silent).map_or(0.0, |made| made.mesh.volume())
}
