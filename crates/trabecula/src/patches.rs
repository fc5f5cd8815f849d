//! Smooth faces for CAD systems: lattices in a box as bicubic patches and planar faces, within a tolerance.
//!
//! Each smooth implicit surface of the solid meets the cells of a grid that ends at the box's planes in polygons
//! (`contour_polygons.rs`); the dual of these is a net of four-sided faces (`quad_net.rs`), whose vertices are spread evenly over
//! the surface (`relaxed_net.rs`). Edges become cubic curves, those in the box's planes within them, and faces bicubic patches
//! (`fitted_patches.rs`): the distance to the surface falls with the fourth power of the grid spacing, the angle between
//! patches with the third. Planar faces close the boundary (`boundary.rs`), whose connected parts are solids (`shells.rs`).
//! The grid is refined until the distance is within the tolerance and the surface has the topology of a finer grid's.

use std::io;

use geometry::fault::{Fault, number};
use geometry::formats::part21::{StepReport, Title};
use geometry::math::{Aabb, Vec3, cross, dot, norm, sub};
use geometry::progress::{Progress, Stage, Stopped};
use rayon::prelude::*;

use crate::csg_tree::CsgTree;
use crate::field::Field;
use crate::implicit::Surface;
use crate::solid::Solid;

mod bezier;
mod boundary;
mod contour_polygons;
mod fitted_patches;
mod patch_step;
mod quad_net;
mod relaxed_net;
mod shells;

use bezier::{BicubicPatch, Curve, basis, frame, on_side, reversed, sum};
use boundary::Boundary;
use contour_polygons::{ContourPolygons, GridPlanes, crossings, euler};
use fitted_patches::{ON_SIDE, curve, distances, patch};
use quad_net::{QuadNet, TooCoarse};
use relaxed_net::gradients;
use shells::Shells;

/// Tolerance unless another is asked for, in parts of the smallest wavelength.
pub const TOLERANCE: f64 = 1e-3;
/// Most faces of a file.
pub const MOST_FACES: f64 = 4e5;
/// Most nodes of a grid: the next finer one, which is held too, has eight times as many.
const MOST_NODES: f64 = 4e6;
/// Grid cells a wavelength to begin with, and at most.
const CELLS: [f64; 2] = [4.0, 40.0];
/// Where patches of the fourth order would take this many times the most cells, no finer grid is tried.
const BEYOND: f64 = 3.0;
/// Cells a wavelength of the grid whose topology counts, where its nodes are not too many.
const FINE: f64 = 32.0;
/// How much finer the next grid is after one that is too coarse.
const COARSER: f64 = 1.25;
/// Shifts of the level that are tried, in tolerances: where a surface touches itself, the box or one of its edges, one that is
/// moved does not.
const SHIFTS: [f64; 3] = [0.0, 0.3, -0.3];
/// How often faces are divided where patches are not near enough.
const DIVISIONS: u64 = 4;
/// Rounds in which vertices are spread after a division.
const AGAIN: usize = 2;
/// Share of the faces divided that may be left for the next division.
const FEWER: f64 = 0.8;
/// Share of the faces beyond which the grid is refined instead.
const MANY: f64 = 0.25;
/// A face is divided across its longer sides, and across the others too where they are longer than this share of them.
const LONG: f64 = 0.6;
/// Greatest angle between the normals of adjacent patches, degrees.
const ANGLE: f64 = 1.0;
/// Rounds in which vertices are spread.
const ROUNDS: usize = 12;
/// Least cosine of the angle between a patch's normal and the surface's.
const TURNED: f64 = 0.5;

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
        let mut cells = CELLS[0];
        let mut why = "patches are not near enough on the finest grid";
        let mut round = 0;
        while cells <= CELLS[1] {
            let grid = grid(&bounds, solid.wavelength / cells).ok_or_else(|| too_many(tolerance))?;
            let mut factor = COARSER;
            for shift in SHIFTS {
                let from = 1.0 - 0.8f64.powi(round);
                let stage = Stage { whole: progress, from, to: from + 0.2 * (1.0 - from) };
                round += 1;
                match attempt(&bounds, &grid, &surfaces, (tolerance, shift, solid.wavelength / FINE), &stage)? {
                    Attempt::Made(made) => return Ok(*made),
                    Attempt::Off(deviation) if cells * (deviation / tolerance).powf(0.25) > BEYOND * CELLS[1] => {
                        return Err(too_many(tolerance));
                    }
                    Attempt::Off(deviation) => {
                        factor = (deviation / (0.7 * tolerance)).powf(0.25).clamp(1.1, 1.7);
                        break;
                    }
                    Attempt::Coarse(found) => why = found,
                }
            }
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
    pub fn summary(&self) -> StepReport {
        let Boundary { vertices, edges, faces, .. } = &self.boundary;
        let shells = self.solids.iter().flat_map(|s| &s.shells);
        StepReport {
            solids: self.solids.len(),
            parts: None,
            faces: faces.len(),
            edges: edges.len(),
            vertices: vertices.len(),
            volume: shells.map(|s| self.boundary.volume(s)).sum(),
            deviation: self.deviation,
            angle: Some(self.angle),
        }
    }

    /// Writes them as a STEP file (mm). The same patches give the same bytes.
    ///
    /// # Errors
    /// Failures of the output; an interruption.
    pub fn write_step(&self, title: Title, out: &mut dyn io::Write, progress: &dyn Progress) -> Result<(), Stopped> {
        patch_step::write(&self.boundary, &self.solids, title, out, progress)
    }
}

/// The box that the region is, and the smooth surfaces of the lattice in it.
fn smooth_in_box(solid: &Solid) -> Result<(Aabb, Vec<Surface>), Fault> {
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
    let sides: usize = planes
        .clone()
        .filter(|s| s.plane.is_some_and(|p| p.at == [bounds.min, bounds.max][usize::from(p.below)][p.axis]))
        .count();
    if leaves != surfaces.len() || matches!(tree, CsgTree::Union(_)) || sides != 6 || planes.count() != 6 {
        let what = "a STEP file has patches of lattices in a box, and this region is no box";
        return Err(refused("region", what));
    }
    let own: Vec<_> = surfaces.iter().filter(|s| !s.cut).collect();
    if own.is_empty() || own.iter().any(|s| s.has_creases) {
        let what = "a STEP file has patches of smooth surfaces, and that of this design has creases";
        return Err(refused("lattice", what));
    }
    Ok((bounds, own.into_iter().cloned().collect()))
}

/// The refusal of a file that would have too many faces.
fn too_many(tolerance: f64) -> Stopped {
    let message = format!(
        "a STEP file has at most {MOST_FACES:.0} faces, and this one would have more within {} mm; take a smaller region or a \
         greater tolerance, or write a mesh, such as .3mf or .stl",
        number(tolerance)
    );
    Stopped::Refused(Fault::new("tolerance", message))
}

/// A grid that ends at the planes of a box, no coarser than `spacing` (mm); none if it has more than `MOST_NODES` nodes.
fn grid(bounds: &Aabb, spacing: f64) -> Option<GridPlanes> {
    let nodes: f64 = bounds.size().iter().map(|s| (s / spacing).ceil() + 1.0).product();
    if nodes > MOST_NODES {
        return None;
    }
    let axis = |a: usize| {
        let n = (bounds.size()[a] / spacing).ceil().max(1.0);
        let at = |i: usize| bounds.min[a] + bounds.size()[a] * i as f64 / n;
        let mut all: Vec<f64> = (0..n as usize).map(at).collect();
        all.push(bounds.max[a]);
        all
    };
    Some(GridPlanes { axes: [0, 1, 2].map(axis) })
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
    grid: &GridPlanes,
    surfaces: &[Surface],
    (tolerance, shift, finest): (f64, f64, f64),
    progress: &dyn Progress,
) -> Result<Attempt, Stopped> {
    let by = |of: &Surface| shift * tolerance * mean_slope(&*of.field, grid);
    let shifted: Vec<Surface> =
        surfaces.iter().map(|s| if shift == 0.0 { s.clone() } else { s.clone().offset(by(s)) }).collect();
    let fields: &[&dyn Field] = &shifted.iter().map(|s| &*s.field).collect::<Vec<_>>();
    let asked: &[&dyn Field] = &surfaces.iter().map(|s| &*s.field).collect::<Vec<_>>();
    let mut fine = refined(grid);
    while widest(&fine, bounds) > finest && fine.len() as f64 <= MOST_NODES {
        fine = refined(&fine);
    }
    let mut net = QuadNet::default();
    let mut corners = Vec::new();
    for (surface, field) in fields.iter().enumerate() {
        let values = node_values(*field, grid);
        if crossings(grid, &values) as f64 > MOST_FACES {
            return Err(too_many(tolerance));
        }
        let polygons = ContourPolygons::new(grid, &values);
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
    let spacing = widest(grid, bounds);
    let fitted = match fit(&mut net, bounds, [fields, asked], (tolerance, spacing), progress)? {
        Ok(fitted) => fitted,
        Err(attempt) => return Ok(attempt),
    };
    let Fitted { curves, patches, near } = fitted;
    let (deviation, angle) = (near.deviation(), near.angle());
    let boundary = Boundary::new(*bounds, &net, &curves, patches, &corners);
    let solids = boundary.solids();
    if solids.is_empty() {
        return Err(Stopped::Refused(Fault::new("region", "nothing of the lattice lies in the region")));
    }
    Ok(Attempt::Made(Box::new(Patches { boundary, solids, deviation, angle })))
}

/// Curves and patches of a net.
struct Fitted {
    curves: Vec<Curve>,
    patches: Vec<BicubicPatch>,
    near: Nearness,
}

/// Spreads the vertices of a net over the surfaces and fits its patches; where they are not near enough to the surfaces asked
/// for, faces are divided. `fields` are the surfaces fitted to, and those asked for.
fn fit(
    net: &mut QuadNet,
    bounds: &Aabb,
    [fields, asked]: [&[&dyn Field]; 2],
    (tolerance, spacing): (f64, f64),
    progress: &dyn Progress,
) -> Result<Result<Fitted, Attempt>, Stopped> {
    let (mut divisions, mut last) = (0, usize::MAX);
    loop {
        let normals = net.relax(fields, bounds, if divisions == 0 { ROUNDS } else { AGAIN }, spacing);
        let curves = curves(net, fields, &normals);
        let patches = patches(net, fields, &curves);
        if !progress.step(2 + divisions, 3 + DIVISIONS) {
            return Err(Stopped::Interrupted);
        }
        let near = Nearness::new(net, asked, &patches);
        let bad: Vec<usize> = (0..patches.len()).filter(|f| !near.within(*f, tolerance)).collect();
        if bad.is_empty() {
            return Ok(Ok(Fitted { curves, patches, near }));
        }
        let more = core::mem::replace(&mut last, bad.len()) as f64;
        if divisions == DIVISIONS || bad.len() as f64 > (FEWER * more).min(MANY * patches.len() as f64) {
            let deviation = near.deviation();
            let off = deviation.is_finite() && deviation > tolerance;
            return Ok(Err(if off { Attempt::Off(deviation) } else { Attempt::Coarse("patches would fold") }));
        }
        divisions += 1;
        net.divide(across(net, &bad));
    }
}

/// The edges across which faces are divided: their longer sides, and the others where these are nearly as long.
fn across(net: &QuadNet, faces: &[usize]) -> Vec<bool> {
    let mut divided = vec![false; net.edges.len()];
    for f in faces {
        let sides = net.faces[*f].sides;
        let length = sides.map(|(e, _)| {
            let [a, b] = net.edges[e as usize].ends.map(|v| net.vertices[v as usize].at);
            norm(sub(a, b))
        });
        let pairs = [length[0] + length[2], length[1] + length[3]];
        for k in (0..2).filter(|k| pairs[*k] >= LONG * pairs[1 - *k]) {
            divided[sides[k].0 as usize] = true;
        }
    }
    divided
}

/// The longest edge of a grid's cells (mm).
fn widest(grid: &GridPlanes, bounds: &Aabb) -> f64 {
    (0..3).map(|a| bounds.size()[a] / (grid.shape()[a] - 1) as f64).fold(0.0, f64::max)
}

/// The grid with twice as many cells along each axis.
fn refined(grid: &GridPlanes) -> GridPlanes {
    let halved = |axis: &Vec<f64>| {
        let mut all: Vec<f64> = axis.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).collect();
        all.extend(axis.last());
        all
    };
    GridPlanes { axes: [0, 1, 2].map(|a| halved(&grid.axes[a])) }
}

/// The mean length of a field's gradient at places of a grid that are near its zero set.
fn mean_slope(field: &dyn Field, grid: &GridPlanes) -> f64 {
    let values = node_values(field, grid);
    let polygons = ContourPolygons::new(grid, &values);
    let points: Vec<Vec3> = polygons.edges.iter().map(|e| crossing(field, grid, &values, *e)).collect();
    let (_, slopes) = gradients(field, &points);
    slopes.iter().map(|g| norm(*g)).sum::<f64>() / slopes.len().max(1) as f64
}

/// The values of a field at the nodes of a grid.
fn node_values(field: &dyn Field, grid: &GridPlanes) -> Vec<f64> {
    let [nx, _, _] = grid.shape();
    let mut values = vec![0.0; grid.len()];
    values.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let points: Vec<Vec3> = (0..nx).map(|i| grid.position(row * nx + i)).collect();
        field.values(&points, out);
    });
    values
}

/// Where a grid edge crosses a surface: by linear interpolation, on edges of the box to rounding.
fn crossing(field: &dyn Field, grid: &GridPlanes, values: &[f64], edge: u64) -> Vec3 {
    let ends = grid.ends(edge);
    let [a, b] = ends.map(|n| grid.position(n));
    let [va, vb] = ends.map(|n| values[n]);
    let at = |t: f64| [0, 1, 2].map(|k| if a[k] == b[k] { a[k] } else { a[k] + t * (b[k] - a[k]) });
    let mut t = va / (va - vb);
    if grid.planes(edge).count() == 2 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let v = field.value(at(t));
            if (v < 0.0) == (va < 0.0) {
                low = t
            } else {
                high = t
            }
            t = 0.5 * (low + high);
        }
    }
    at(t)
}

fn curves(net: &QuadNet, fields: &[&dyn Field], normals: &[Vec3]) -> Vec<Curve> {
    let each = net.edges.par_iter().with_min_len(64);
    let of = |e: &quad_net::Edge| {
        let ends = e.ends.map(|v| net.vertices[v as usize].at);
        let plane = e.plane.map(|p| usize::from(p / 2));
        curve(fields[usize::from(e.surface)], ends, e.ends.map(|v| normals[v as usize]), plane)
    };
    each.map(of).collect()
}

fn patches(net: &QuadNet, fields: &[&dyn Field], curves: &[Curve]) -> Vec<BicubicPatch> {
    let on_edges = net.edges.par_iter().zip(curves).with_min_len(64);
    let normals: Vec<Option<[Vec3; 4]>> = on_edges
        .map(|(edge, curve)| {
            let field = fields[usize::from(edge.surface)];
            edge.plane.is_none().then(|| distances(field, &ON_SIDE.map(|t| sum(curve, basis(t)))).1)
        })
        .collect();
    let of = |face: &quad_net::QuadFace| {
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

/// How near patches come to their surfaces and to each other.
struct Nearness {
    /// Of each patch the greatest distance from its surface (mm); infinite if it is turned away from it.
    deviations: Vec<f64>,
    /// Of each patch the greatest angle to an adjacent one (radians).
    angles: Vec<f64>,
}

impl Nearness {
    fn new(net: &QuadNet, fields: &[&dyn Field], patches: &[BicubicPatch]) -> Nearness {
        let each = net.faces.par_iter().zip(patches).with_min_len(16);
        let deviations = each.map(|(face, patch)| deviation(fields[usize::from(face.surface)], patch)).collect();
        Nearness { deviations, angles: angles(net, patches) }
    }

    fn within(&self, f: usize, tolerance: f64) -> bool {
        self.deviations[f] <= tolerance && self.angles[f] <= ANGLE.to_radians()
    }

    fn deviation(&self) -> f64 {
        self.deviations.iter().copied().fold(0.0, f64::max)
    }

    /// In degrees.
    fn angle(&self) -> f64 {
        self.angles.iter().copied().fold(0.0, f64::max).to_degrees()
    }
}

/// The greatest distance (mm) of a patch from its surface, at 49 points; infinite if it is turned away from it.
fn deviation(field: &dyn Field, patch: &BicubicPatch) -> f64 {
    let parameters: [[f64; 2]; 49] = core::array::from_fn(|k| [k % 7, k / 7].map(|i| i as f64 / 6.0));
    let frames = parameters.map(|[u, v]| frame(patch, u, v));
    let (off, normals) = distances(field, &frames.map(|f| f[0]));
    let upright = frames.iter().zip(normals).all(|([_, du, dv], n)| {
        let across = cross(*du, *dv);
        dot(across, n) > TURNED * norm(across)
    });
    if upright { off.into_iter().fold(0.0, |a: f64, b| a.max(b.abs())) } else { f64::INFINITY }
}

/// Of each patch the greatest angle (radians) between its normals and those of adjacent ones along their common edges.
fn angles(net: &QuadNet, patches: &[BicubicPatch]) -> Vec<f64> {
    const AT: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
    let mut first: Vec<Option<(usize, [Vec3; 5])>> = vec![None; net.edges.len()];
    let mut most = vec![0.0f64; patches.len()];
    for (f, (face, patch)) in net.faces.iter().zip(patches).enumerate() {
        for (side, (edge, forward)) in face.sides.into_iter().enumerate() {
            let normals = AT.map(|t| {
                let [u, v] = on_side(side, if forward { t } else { 1.0 - t });
                bezier::normal(patch, u, v)
            });
            match &first[edge as usize] {
                None => first[edge as usize] = Some((f, normals)),
                Some((other, known)) => {
                    // The chord between unit vectors is 2 sin of half the angle, exact for small ones.
                    let chords = known.iter().zip(&normals).map(|(a, b)| 0.5 * norm(sub(*a, *b)));
                    let angle = 2.0 * chords.fold(0.0, f64::max).min(1.0).asin();
                    most[f] = most[f].max(angle);
                    most[*other] = most[*other].max(angle);
                }
            }
        }
    }
    most
}
