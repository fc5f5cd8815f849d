//! Smooth faces for CAD systems: lattices in a box as bicubic patches and planar faces, within a tolerance.
//!
//! Each smooth implicit surface of the solid meets the cells of a grid that ends at the box's planes in polygons
//! (`contour_polygons.rs`); the dual of these is a net of four-sided faces (`quad_net.rs`), whose vertices are spread evenly over
//! the surface (`relaxed_net.rs`). Edges become cubic curves, those in the box's planes within them, and faces bicubic patches
//! (`fitted_patches.rs`): the distance to the surface falls with the fourth power of the grid spacing, the angle between
//! patches with the third. Planar faces close the boundary (`boundary.rs`), whose connected parts are solids (`shells.rs`).
//! The grid is refined until the distance is within the tolerance and the surface has the topology of a finer grid's.

use std::io;
use std::sync::Arc;

use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, cross, dot, norm, sub};
use geometry::progress::{Progress, Stage, Stopped};
use rayon::prelude::*;

use crate::csg_tree::CsgTree;
use crate::field::Field;
use crate::solid::Solid;

mod bezier;
mod boundary;
mod contour_polygons;
mod fitted_patches;
mod patch_step;
mod quad_net;
mod relaxed_net;
mod shells;

use bezier::{Curve, Patch, basis, frame, on_side, reversed, sum};
use boundary::Boundary;
use contour_polygons::{Grid, Polygons, euler};
use fitted_patches::{ON_SIDE, curve, distances, patch};
use quad_net::{Net, TooCoarse};
use shells::Shells;

/// Tolerance unless another is asked for, in parts of the smallest wavelength.
pub const TOLERANCE: f64 = 1e-3;
/// Most faces of a file.
pub const MOST_FACES: f64 = 4e5;
/// Grid cells a wavelength to begin with, and at most.
const CELLS: [f64; 2] = [4.0, 64.0];
/// Rounds in which vertices are spread.
const ROUNDS: usize = 12;
/// Least cosine of the angle between a patch's normal and the surface's.
const TURNED: f64 = 0.5;

/// What a file of patches contains, and how near it is to the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSummary {
    /// Number of solids: connected components.
    pub solids: usize,
    /// Number of faces.
    pub faces: usize,
    /// Number of edges.
    pub edges: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Greatest distance of the patches from the surface, mm, at 49 points of each.
    pub deviation: f64,
    /// Greatest angle between the normals of adjacent patches along their common edge, degrees.
    pub angle: f64,
}

/// Patches of a solid.
pub struct Patches {
    boundary: Boundary,
    solids: Vec<Shells>,
    deviation: f64,
    angle: f64,
}

impl Patches {
    /// Patches of a lattice in a box, no farther than `tolerance` (mm) from its surface. The same for any number of threads.
    ///
    /// # Errors
    /// A region that is no box, skins, keep zones, surfaces with creases; more than `MOST_FACES` faces; surfaces that nearly touch
    /// themselves or the box; an interruption.
    pub fn new(solid: &Solid, tolerance: f64, progress: &dyn Progress) -> Result<Patches, Stopped> {
        let (bounds, surfaces) = smooth_in_box(solid).map_err(Stopped::Refused)?;
        let fields: Vec<&dyn Field> = surfaces.iter().map(|f| &**f).collect();
        let mut cells = CELLS[0];
        let mut why = "";
        for round in 0..24 {
            let from = 1.0 - 0.75f64.powi(round);
            let stage = Stage { whole: progress, from, to: from + 0.25 * (1.0 - from) };
            if cells > CELLS[1] {
                break;
            }
            let grid = grid(&bounds, solid.wavelength / cells);
            let factor = match attempt(&bounds, &grid, &fields, tolerance, &stage)? {
                Attempt::Made(made) => return Ok(*made),
                Attempt::Off(deviation) => (deviation / (0.7 * tolerance)).powf(0.25).clamp(1.1, 1.7),
                Attempt::Coarse(found) => {
                    why = found;
                    1.25
                }
            };
            cells *= factor;
        }
        let message = format!(
            "no net of patches within {} mm was found: {why}. Change the region, the level or the offset of the lattice a \
             little, or give a greater tolerance",
            number(tolerance)
        );
        Err(Stopped::Refused(Fault::new("tolerance", message)))
    }

    /// What they are.
    pub fn summary(&self) -> PatchSummary {
        let Boundary { vertices, edges, faces, .. } = &self.boundary;
        let shells = self.solids.iter().flat_map(|s| &s.shells);
        PatchSummary {
            solids: self.solids.len(),
            faces: faces.len(),
            edges: edges.len(),
            vertices: vertices.len(),
            volume: shells.map(|s| self.boundary.volume(s)).sum(),
            deviation: self.deviation,
            angle: self.angle,
        }
    }

    /// Writes them as a STEP file (AP214, mm) under the name of a product. The same patches give the same bytes.
    ///
    /// # Errors
    /// Failures of the output; an interruption.
    pub fn write_step(&self, name: &str, out: &mut dyn io::Write, progress: &dyn Progress) -> Result<(), Stopped> {
        patch_step::write(&self.boundary, &self.solids, name, out, progress)
    }
}

/// The box that the region is, and the smooth surfaces of the lattice in it.
fn smooth_in_box(solid: &Solid) -> Result<(Aabb, Vec<Arc<dyn Field>>), Fault> {
    let other = "; write a mesh instead, such as .3mf or .stl";
    let refused = |at: &str, what: &str| Fault::new(at, format!("{what}{other}"));
    let (surfaces, tree) = solid.surfaces();
    let bounds = solid.region.bounds();
    if solid.field.is_none() {
        return Err(refused("region", "a STEP file of patches needs a lattice, and this solid has none"));
    }
    if !solid.filled.is_empty() {
        let what = "a STEP file has patches of lattices alone, and this design has a skin or keep zones";
        return Err(refused("skin", what));
    }
    let mut leaves = 0;
    tree.for_each_bounding(&mut |_| leaves += 1);
    let planes = surfaces.iter().filter(|s| s.cut);
    let sides: usize = planes.clone().filter(|s| s.plane.is_some_and(|p| {
        p.at == [bounds.min, bounds.max][usize::from(p.below)][p.axis]
    })).count();
    if leaves != surfaces.len() || matches!(tree, CsgTree::Union(_)) || sides != 6 || planes.count() != 6 {
        let what = "a STEP file has patches of lattices in a box, and this region is no box";
        return Err(refused("region", what));
    }
    let own: Vec<_> = surfaces.iter().filter(|s| !s.cut).collect();
    if own.is_empty() || own.iter().any(|s| s.has_creases) {
        let what = "a STEP file has patches of smooth surfaces, and that of this design has creases";
        return Err(refused("lattice", what));
    }
    Ok((bounds, own.into_iter().map(|s| s.field.clone()).collect()))
}

/// A grid that ends at the planes of a box, no coarser than `spacing` (mm).
fn grid(bounds: &Aabb, spacing: f64) -> Grid {
    let axis = |a: usize| {
        let n = (bounds.size()[a] / spacing).ceil().max(1.0);
        let at = |i: usize| bounds.min[a] + bounds.size()[a] * i as f64 / n;
        let mut all: Vec<f64> = (0..n as usize).map(at).collect();
        all.push(bounds.max[a]);
        all
    };
    Grid { axes: [0, 1, 2].map(axis) }
}

/// What became of a grid.
enum Attempt {
    /// Patches within the tolerance.
    Made(Box<Patches>),
    /// Patches that are farther from the surface (mm).
    Off(f64),
    /// None.
    Coarse(&'static str),
}

fn attempt(
    bounds: &Aabb,
    grid: &Grid,
    fields: &[&dyn Field],
    tolerance: f64,
    progress: &dyn Progress,
) -> Result<Attempt, Stopped> {
    let fine = refined(grid);
    let mut net = Net::default();
    let mut corners = Vec::new();
    for (surface, field) in fields.iter().enumerate() {
        let values = node_values(*field, grid);
        let polygons = Polygons::new(grid, &values);
        if polygons.edges.len() as f64 > MOST_FACES {
            let message = format!(
                "a STEP file has at most {MOST_FACES:.0e} faces, and this one would have more within {} mm; take a smaller \
                 region or a greater tolerance",
                number(tolerance)
            );
            return Err(Stopped::Refused(Fault::new("tolerance", message)));
        }
        if !progress.step(surface as u64, 8) {
            return Err(Stopped::Interrupted);
        }
        if polygons.euler() != euler(&fine, &node_values(*field, &fine)) {
            return Ok(Attempt::Coarse("the surface has features that a finer grid changes"));
        }
        let crossing = |edge: u64| crossing(*field, grid, &values, edge);
        if net.add(grid, &polygons, surface as u8, &crossing) == Err(TooCoarse) {
            return Ok(Attempt::Coarse("faces would share two edges"));
        }
        corners.push(core::array::from_fn(|c: usize| {
            let last = grid.shape().map(|n| n - 1);
            values[grid.node([0, 1, 2].map(|a| if c >> a & 1 == 1 { last[a] } else { 0 }))] < 0.0
        }));
    }
    let spacing = (0..3).map(|a| bounds.size()[a] / (grid.shape()[a] - 1) as f64).fold(0.0, f64::max);
    let normals = net.relax(fields, ROUNDS, 0.25 * spacing);
    if !progress.step(3, 8) {
        return Err(Stopped::Interrupted);
    }
    let curves = curves(&net, fields, &normals);
    let patches = patches(&net, fields, &curves);
    if !progress.step(6, 8) {
        return Err(Stopped::Interrupted);
    }
    let Some(deviation) = deviation(&net, fields, &patches) else {
        return Ok(Attempt::Coarse("patches would fold"));
    };
    if deviation > tolerance {
        return Ok(Attempt::Off(deviation));
    }
    let angle = angle(&net, &patches);
    let boundary = Boundary::new(*bounds, &net, &curves, patches, &corners);
    let solids = boundary.solids();
    if solids.is_empty() {
        return Err(Stopped::Refused(Fault::new("region", "nothing of the lattice lies in the region")));
    }
    Ok(Attempt::Made(Box::new(Patches { boundary, solids, deviation, angle })))
}

/// The grid with twice as many cells along each axis.
fn refined(grid: &Grid) -> Grid {
    let halved = |axis: &Vec<f64>| {
        let mut all: Vec<f64> = axis.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).collect();
        all.extend(axis.last());
        all
    };
    Grid { axes: [0, 1, 2].map(|a| halved(&grid.axes[a])) }
}

/// The values of a field at the nodes of a grid.
fn node_values(field: &dyn Field, grid: &Grid) -> Vec<f64> {
    let [nx, _, _] = grid.shape();
    let mut values = vec![0.0; grid.len()];
    values.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let points: Vec<Vec3> = (0..nx).map(|i| grid.position(row * nx + i)).collect();
        field.values(&points, out);
    });
    values
}

/// Where a grid edge crosses a surface: by linear interpolation, on edges of the box to rounding.
fn crossing(field: &dyn Field, grid: &Grid, values: &[f64], edge: u64) -> Vec3 {
    let ends = grid.ends(edge);
    let [a, b] = ends.map(|n| grid.position(n));
    let [va, vb] = ends.map(|n| values[n]);
    let at = |t: f64| [0, 1, 2].map(|k| if a[k] == b[k] { a[k] } else { a[k] + t * (b[k] - a[k]) });
    let mut t = va / (va - vb);
    if grid.planes(edge).count() == 2 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let v = field.value(at(t));
            if (v < 0.0) == (va < 0.0) { low = t } else { high = t }
            t = 0.5 * (low + high);
        }
    }
    at(t)
}

fn curves(net: &Net, fields: &[&dyn Field], normals: &[Vec3]) -> Vec<Curve> {
    let each = net.edges.par_iter().with_min_len(64);
    let of = |e: &quad_net::Edge| {
        let ends = e.ends.map(|v| net.vertices[v as usize].at);
        let plane = e.plane.map(|p| usize::from(p / 2));
        curve(fields[usize::from(e.surface)], ends, e.ends.map(|v| normals[v as usize]), plane)
    };
    each.map(of).collect()
}

fn patches(net: &Net, fields: &[&dyn Field], curves: &[Curve]) -> Vec<Patch> {
    let on_edges = net.edges.par_iter().zip(curves).with_min_len(64);
    let normals: Vec<Option<[Vec3; 4]>> = on_edges
        .map(|(edge, curve)| {
            let field = fields[usize::from(edge.surface)];
            edge.plane.is_none().then(|| distances(field, &ON_SIDE.map(|t| sum(curve, basis(t)))).1)
        })
        .collect();
    let of = |face: &quad_net::Face| {
        let sides = face.sides.map(|(e, forward)| {
            let curve = curves[e as usize];
            if forward { curve } else { reversed(&curve) }
        });
        let across = face.sides.map(|(e, forward)| {
            let mut found = normals[e as usize];
            if let (Some(n), false) = (&mut found, forward) {
                n.reverse();
            }
            found
        });
        patch(fields[usize::from(face.surface)], &sides, &across)
    };
    net.faces.par_iter().with_min_len(16).map(of).collect()
}

/// The greatest distance (mm) of patches from their surfaces; none if one is turned away from its surface.
fn deviation(net: &Net, fields: &[&dyn Field], patches: &[Patch]) -> Option<f64> {
    const PARTS: usize = 6;
    let of = |(face, patch): (&quad_net::Face, &Patch)| {
        let parameters: [[f64; 2]; 49] =
            core::array::from_fn(|k| [k % 7, k / 7].map(|i| i as f64 / PARTS as f64));
        let frames = parameters.map(|[u, v]| frame(patch, u, v));
        let (off, normals) = distances(fields[usize::from(face.surface)], &frames.map(|f| f[0]));
        let upright = frames.iter().zip(normals).all(|([_, du, dv], n)| {
            let across = cross(*du, *dv);
            dot(across, n) > TURNED * norm(across)
        });
        upright.then(|| off.into_iter().fold(0.0, |a: f64, b| a.max(b.abs())))
    };
    net.faces.par_iter().zip(patches).with_min_len(16).map(of).try_reduce(|| 0.0, |a, b| Some(a.max(b)))
}

/// The greatest angle (degrees) between the normals of adjacent patches along their common edges.
fn angle(net: &Net, patches: &[Patch]) -> f64 {
    const AT: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
    let mut first: Vec<Option<[Vec3; 5]>> = vec![None; net.edges.len()];
    let mut most = 0.0f64;
    for (face, patch) in net.faces.iter().zip(patches) {
        for (side, (edge, forward)) in face.sides.into_iter().enumerate() {
            let normals = AT.map(|t| {
                let [u, v] = on_side(side, if forward { t } else { 1.0 - t });
                bezier::normal(patch, u, v)
            });
            match &first[edge as usize] {
                None => first[edge as usize] = Some(normals),
                Some(known) => {
                    for (a, b) in known.iter().zip(&normals) {
                        // The chord between unit vectors is 2 sin of half the angle, exact for small ones.
                        most = most.max(2.0 * (0.5 * norm(sub(*a, *b))).min(1.0).asin());
                    }
                }
            }
        }
    }
    most.to_degrees()
}
