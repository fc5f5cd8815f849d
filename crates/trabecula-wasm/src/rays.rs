//! What a graphics card needs to march rays through a solid: one lattice in a region, with nothing else in it.
//!
//! The card evaluates what the core does: the cell's function, a sum of waves or a periodic texture of the torus; the map, linear in each voxel of a
//! grid, or as it is where it is affine; the level, linear there too; the region, by its surface and a texture of its function. Errors
//! are those of the pictures: of second order in the voxels, some thousandths of a period.

use std::sync::Arc;

use geometry::math::{Aabb, IDENTITY, Vec3};
use geometry::progress::{Silent, Stopped};
use serde_json::{Value as Json, json};
use trabecula::cell::Term;
use trabecula::design::Built;
use trabecula::extract;
use trabecula::field::Field;
use trabecula::implicit::Implicit;
use trabecula::lattice::Lattice;

use crate::corners::arrays;

/// Texels along each axis of the torus.
const CELL: usize = 64;
/// Most waves of a cell that is summed up as it is.
const WAVES: usize = 24;
/// Voxels of the map and the level along the longest axis, where they vary.
const VOXELS: f64 = 48.0;
/// Nodes of the region's function along the longest axis.
const NODES: f64 = 56.0;
/// Grid cells of the region's surface.
const SURFACE: f64 = 30_000.0;
/// Samples of the fraction between the least and the greatest level.
const FRACTIONS: usize = 33;

/// The lattice, where a card can march through the solid.
fn marched(built: &Built) -> Option<&Arc<Lattice>> {
    let [(_, lattice)] = &built.lattices[..] else { return None };
    let alone = built.tilings.is_empty() && built.beams.is_empty() && built.blend.is_none();
    let bare = lattice.map.solved().is_none_or(|map| map.cores().is_none());
    (alone && bare && built.solid.filled.is_empty()).then_some(lattice)
}

/// Textures and numbers for the card; `None` for a solid through which it cannot march. The cell's and the region's are left out
/// unless they are wanted.
pub fn rays(built: &Built, cell: bool, region: bool) -> Result<Option<(Json, Vec<u8>)>, Stopped> {
    let Some(lattice) = marched(built) else { return Ok(None) };
    let bounds = built.solid.region.bounds();
    let mut bytes = Vec::new();
    let mut head = json!({
        "bounds": [bounds.min, bounds.max],
        "part": lattice.part as usize,
        "lipschitz": lattice.lipschitz(),
        "wavelength": lattice.map.wavelength(),
        // Under a Jacobian that varies, distances in the texture are measured anew.
        "metric": lattice.distance().filter(|_| lattice.map.affine().is_none()).map(|_| lattice.map.typical()),
    });
    let terms = lattice.cell.series().terms();
    if lattice.distance().is_none() && terms.len() <= WAVES {
        // Faster than the texture, and exact.
        let wave = |t: &Term| [t.hkl.map(f64::from).as_slice(), &[t.amplitude, t.phase]].concat();
        head["waves"] = json!(terms.iter().map(wave).collect::<Vec<_>>());
    } else if cell {
        put(&mut bytes, &torus(lattice));
        head["cell"] = json!(CELL);
    }
    let (voxels, values) = voxels(lattice, &bounds);
    put(&mut bytes, &values);
    head["voxels"] = voxels.json();
    let levels = (0..values.len()).step_by(16).map(|i| values[i + 3]);
    let (low, high) = levels.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
    if high > low {
        let at = |i: usize| f64::from(low) + f64::from(high - low) * i as f64 / (FRACTIONS - 1) as f64;
        let fractions: Vec<f64> = (0..FRACTIONS).map(|i| lattice.fraction(at(i))).collect();
        head["fractions"] = json!({ "levels": [low, high], "values": fractions });
    }
    if region {
        let (nodes, values) = nodes(&*built.solid.region, &bounds);
        put(&mut bytes, &values);
        let [x, y, z] = bounds.size();
        let edge = (x * y * z / SURFACE).cbrt();
        let full = trabecula::Solid::new(built.solid.region.clone(), None, edge);
        let surface = extract::surface(&full, edge, &Silent)?;
        let drawn = arrays(&surface);
        bytes.extend(&drawn.bytes);
        head["region"] = nodes.json();
        head["vertices"] = json!(drawn.vertices.len());
        head["triangles"] = json!(surface.mesh.triangles.len());
    }
    Ok(Some((head, bytes)))
}

fn put(bytes: &mut Vec<u8>, values: &[f32]) {
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

/// Positions in rows along x, y and z.
struct Grid {
    shape: [usize; 3],
    first: Vec3,
    step: Vec3,
}

impl Grid {
    fn points(&self) -> Vec<Vec3> {
        let [nx, ny, nz] = self.shape;
        let at = |n: usize| [n % nx, n / nx % ny, n / nx / ny];
        (0..nx * ny * nz).map(|n| core::array::from_fn(|a| self.first[a] + self.step[a] * at(n)[a] as f64)).collect()
    }

    fn json(&self) -> Json {
        json!({ "shape": self.shape, "first": self.first, "step": self.step })
    }
}

/// The core of the lattice at the centres of texels of the torus.
fn torus(lattice: &Lattice) -> Vec<f32> {
    let middle = 0.5 / CELL as f64;
    let grid = Grid { shape: [CELL; 3], first: [middle; 3], step: [2.0 * middle; 3] };
    let points = grid.points();
    let mut values = vec![0.0; points.len()];
    match lattice.distance() {
        Some(distance) => distance.values(&points, &mut values),
        None => lattice.cell.gradients(&points, &mut values, &mut vec![[0.0; 3]; points.len()]),
    }
    values.into_iter().map(|v| v as f32).collect()
}

/// Sixteen numbers for each voxel, at its centre: the phases, the level; then of each phase its gradient, and one component of the
/// level's.
fn voxels(lattice: &Lattice, bounds: &Aabb) -> (Grid, Vec<f32>) {
    let size = bounds.size();
    let longest = size.into_iter().fold(0.0, f64::max);
    let straight = lattice.map.affine().is_some() && lattice.uniform().is_some();
    let shape = size.map(|s| if straight { 1 } else { (VOXELS * s / longest).ceil().max(1.0) as usize });
    let step: Vec3 = core::array::from_fn(|a| size[a] / shape[a] as f64);
    let grid = Grid { shape, first: core::array::from_fn(|a| bounds.min[a] + 0.5 * step[a]), step };
    let points = grid.points();
    let n = points.len();
    let (mut u, mut j) = (vec![[0.0; 3]; n], vec![IDENTITY; n]);
    lattice.map.phases_and_jacobians(&points, &mut u, &mut j);
    let (mut t, mut slope) = (vec![0.0; n], vec![[0.0; 3]; n]);
    lattice.iso_gradients(&points, &mut t, &mut slope);
    let mut out = Vec::with_capacity(16 * n);
    for i in 0..n {
        // The torus begins anew at each turn; single precision has no digits to spare.
        out.extend(u[i].map(|v| (v - v.floor()) as f32));
        out.push(t[i] as f32);
        for a in 0..3 {
            out.extend(j[i][a].map(|v| v as f32));
            out.push(slope[i][a] as f32);
        }
    }
    (grid, out)
}

/// The function of a region at nodes a step beyond its bounds.
fn nodes(region: &dyn Field, bounds: &Aabb) -> (Grid, Vec<f32>) {
    let size = bounds.size();
    let step = size.into_iter().fold(0.0, f64::max) / NODES;
    let shape = size.map(|s| (s / step).ceil() as usize + 3);
    let first = core::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a] - step * (shape[a] - 1) as f64));
    let grid = Grid { shape, first, step: [step; 3] };
    let points = grid.points();
    let mut values = vec![0.0; points.len()];
    region.values(&points, &mut values);
    (grid, values.into_iter().map(|v| v as f32).collect())
}
