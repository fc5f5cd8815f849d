//! Cells from files: numbers, pictures, meshes.
//!
//! A solid, whether a mesh or what lies above a threshold, becomes its signed periodic distance. That bends only at corners and
//! halfway between surfaces, where a step from 0 to 1 would jump at the surface itself: near a smooth surface the error of n
//! waves falls as n^(-2/3), that of a step as n^(-1/3), and it does not ring there.

use super::super::data::FileCellSpec;
use crate::cell::{Cell, Series, Term};
use crate::environment::{Loader, extension, names_pictures, picture_stack};
use crate::kind::{DesignError, OneOrThree};
use geometry::distance::MeshDistance;
use geometry::distance::periodic::PeriodicDistance;
use geometry::fault::Fault;
use geometry::formats;
use geometry::math::{Aabb, Vec3};
use geometry::mesh::Mesh;
use geometry::repair::Repair;
use geometry::voxel_distances::signed_distances;

/// Nodes along an axis of the grid on which a mesh of one cell is sampled.
const NODES: usize = 64;

/// Most numbers of a file, whose transform and distances take some 50 bytes each.
const MOST: usize = 1 << 27;

/// The cell that a file makes; `path` is that of its table.
pub(super) fn cell(spec: &FileCellSpec, path: &str, loader: &dyn Loader) -> Result<Cell, DesignError> {
    let at = format!("{path}.path");
    let wrong = |f: Fault| {
        let at = if f.at.is_empty() || f.at == "path" { at.clone() } else { format!("{path}.{}", f.at) };
        DesignError::new(at, format!("{}: {}", spec.path, f.message)).found(&spec.path)
    };
    let load = || loader.load(&spec.path).map_err(|m| DesignError::new(&at, m).found(&spec.path));
    let kind = extension(&spec.path);
    if formats::Format::of(&kind).is_some() {
        misplaced(spec, path, &["threshold", "step"], "is for numbers and pictures, not for a mesh")?;
        let mesh = formats::read_mesh(&load()?, &kind).map_err(wrong)?.mesh;
        let distances = distances(mesh, spec.period).map_err(wrong)?;
        let (series, share) = of_distances(&distances, spec.terms as usize).map_err(wrong)?;
        return Ok(Cell::new(series).truncated(share));
    }
    misplaced(spec, path, &["period"], "is for a mesh; the period of numbers is their count")?;
    let mut step = spec.step.map(OneOrThree::three);
    let (shape, mut values) = if names_pictures(&spec.path) {
        let found = picture_stack(&spec.path, &at, loader)?;
        step = step.or(found.placed.map(|[_, step]| step));
        (found.shape, found.values)
    } else if kind == "npy" {
        let (shape, values) = formats::read_npy(&load()?).map_err(wrong)?;
        let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
            let message = format!("the array has shape {shape:?}; a cell has three dimensions [x, y, z]");
            wrong(Fault::new("", message))
        })?;
        (shape, values)
    } else {
        let known = formats::Format::listed();
        let message = format!(
            "the name must end in npy, {known}, or in png, tif or dcm for pictures, or in / for a folder of them; found \"{}\"",
            spec.path
        );
        return Err(DesignError::new(at, message).found(&spec.path));
    };
    let [x, y, z] = shape;
    if values.len() > MOST {
        let message = format!(
            "{x} × {y} × {z} numbers; a cell takes {MOST} at most (512³): crop them, or average several to one"
        );
        return Err(wrong(Fault::new("", message)));
    }
    if let Some(threshold) = spec.threshold {
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            let at = [n % x, n / x % y, n / x / y];
            return Err(wrong(Fault::new("", format!("the number at {at:?} is {}; all must be finite", values[n]))));
        }
        values = above(&values, shape, threshold, step).map_err(wrong)?;
    } else {
        misplaced(spec, path, &["step"], "goes with threshold; without it no distance is measured")?;
    }
    let (series, share) = Series::sampled(&values, shape, spec.terms as usize).map_err(wrong)?;
    Ok(Cell::new(series).truncated(share))
}

/// Refuses keys that say nothing of such a file.
fn misplaced(spec: &FileCellSpec, path: &str, keys: &[&str], why: &str) -> Result<(), DesignError> {
    let given =
        [("threshold", spec.threshold.is_some()), ("step", spec.step.is_some()), ("period", spec.period.is_some())];
    match given.iter().find(|(key, given)| *given && keys.contains(key)) {
        Some((key, _)) => Err(DesignError::new(format!("{path}.{key}"), format!("{key} {why}; leave it out"))),
        None => Ok(()),
    }
}

/// The edge of a cube of the same volume.
fn edge(size: [f64; 3]) -> f64 {
    size.iter().product::<f64>().cbrt()
}

/// The signed periodic distance of the numbers above a threshold, in edges of the cell.
fn above(values: &[f64], shape: [usize; 3], threshold: f64, step: Option<Vec3>) -> Result<Vec<f64>, Fault> {
    let step = step.unwrap_or([1.0; 3]);
    let solid: Vec<bool> = values.iter().map(|v| *v > threshold).collect();
    let mut signed = signed_distances(&solid, shape, step).ok_or_else(|| {
        Fault::new("threshold", format!("all numbers are on one side of {threshold}, so there is no surface"))
    })?;
    let edge = edge(std::array::from_fn(|a| shape[a] as f64 * step[a]));
    signed.iter_mut().for_each(|d| *d /= edge);
    Ok(signed)
}

/// The signed periodic distances of a solid at the middles of `NODES`³ boxes of its period, in edges of the cell.
fn distances(mesh: Mesh, period: Option<OneOrThree>) -> Result<Vec<f64>, Fault> {
    let solid = MeshDistance::new(mesh, Repair::Auto)?;
    let bounds = solid.mesh().vertices.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let cell = match period.map(OneOrThree::three) {
        None => bounds,
        Some(size) => {
            let (middle, found) = (bounds.center(), bounds.size());
            if (0..3).any(|a| found[a] > size[a] * (1.0 + 1e-9)) {
                let message =
                    format!("a period of {size:?} mm; the mesh measures {found:?} mm and does not fit into it");
                return Err(Fault::new("period", message));
            }
            let corner = |side: f64| std::array::from_fn(|a| middle[a] + side * 0.5 * size[a]);
            Aabb { min: corner(-1.0), max: corner(1.0) }
        }
    };
    let size = cell.size();
    let points: Vec<Vec3> = (0..NODES.pow(3))
        .map(|n| [n % NODES, n / NODES % NODES, n / NODES / NODES])
        .map(|i| std::array::from_fn(|a| cell.min[a] + size[a] * (i[a] as f64 + 0.5) / NODES as f64))
        .collect();
    let mut values = vec![0.0; points.len()];
    PeriodicDistance::new(solid, cell)?.values(&points, &mut values);
    values.iter_mut().for_each(|d| *d /= edge(size));
    Ok(values)
}

/// The series of the `count` largest waves of such distances, and the share that is left out.
fn of_distances(values: &[f64], count: usize) -> Result<(Series, f64), Fault> {
    let (series, share) = Series::sampled(values, [NODES; 3], count)?;
    // The first node is half a step from the corner, where phases are zero.
    let moved = series.terms().iter().map(|t| {
        let h: i32 = t.hkl.iter().sum();
        Term { phase: t.phase - 0.5 * f64::from(h) / NODES as f64, ..*t }
    });
    Ok((Series::new(moved.collect())?, share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::norm;
    use geometry::mesh::samples::icosphere;

    /// The root mean square distance of the surface f = 0 of a series from points on it, in edges of the cell: f over its slope.
    fn error(series: &Series, points: &[Vec3]) -> f64 {
        let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        series.gradients(points, &mut values, &mut gradients);
        let square: f64 = values.iter().zip(&gradients).map(|(v, g)| (v / norm(*g)).powi(2)).sum();
        (square / points.len() as f64).sqrt()
    }

    /// Near a smooth surface, far from where the distance bends, the sum over the waves beyond index H falls as H⁻² and the number
    /// of waves rises as H³: the error falls as n^(-2/3), by 6.3 from 25 waves to 400. (With more the grid's own error shows.)
    #[test]
    fn the_surface_of_a_sphere_is_met_at_the_order_of_its_waves() {
        let mesh = icosphere(4, 0.3, 0.0);
        let corner = |t: &[u32; 3], k: usize| mesh.vertices[t[k] as usize];
        let middle = |t: &[u32; 3]| std::array::from_fn(|a| 0.5 + (0..3).map(|k| corner(t, k)[a]).sum::<f64>() / 3.0);
        let points: Vec<Vec3> = mesh.triangles.iter().map(middle).collect();
        let found = distances(mesh, Some(OneOrThree::One(1.0))).expect("a sphere");
        let at = |count: usize| error(&of_distances(&found, count).expect("waves").0, &points);
        let (few, many) = (at(25), at(400));
        assert!(few / many > 16f64.powf(2.0 / 3.0), "{few} and {many}");
        // A step from 0 to 1 of 200 waves is off by 0.7 % of an edge, and here it is a tenth of that.
        assert!(at(200) < 7e-4, "{}", at(200));
    }

    /// The faces on the period's bounds at which a rod goes on into the next cell are none of its boundary: a square rod along z
    /// has the distance of the square, in the middle 0.2 and in the corner of the cell -0.3 √2, whatever z is.
    #[test]
    fn a_rod_that_goes_on_has_no_ends() {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 0 { -1.0 } else { 1.0 });
        let vertices = (0..8).map(corner).map(|c: Vec3| [0.2 * c[0], 0.2 * c[1], 0.5 * c[2]]).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        let solid = MeshDistance::new(Mesh { vertices, triangles }, Repair::Auto).expect("a rod");
        let cell = Aabb { min: [-0.5; 3], max: [0.5; 3] };
        let periodic = PeriodicDistance::new(solid, cell).expect("sides");
        let points = [[0.0, 0.0, 0.49], [0.0, 0.0, -0.3], [0.5, 0.5, 0.49], [0.5, 0.0, 0.0]];
        let mut values = [0.0; 4];
        periodic.values(&points, &mut values);
        for (found, wanted) in values.into_iter().zip([0.2, 0.2, -0.3 * 2f64.sqrt(), -0.3]) {
            assert!((found - wanted).abs() < 1e-12, "{found}, {wanted}");
        }
    }

    /// Distances of voxels are those to the nearest of all copies, less half a step; anisotropic steps count.
    #[test]
    fn voxels_have_the_distance_to_the_nearest_copy() {
        let (shape, step) = ([6, 5, 4], [1.0, 2.0, 0.5]);
        let at = |n: usize| [n % 6, n / 6 % 5, n / 30];
        let solid: Vec<bool> = (0..120).map(|n| at(n) == [0, 0, 0] || n * 7 % 11 == 0).collect();
        let found = signed_distances(&solid, shape, step).expect("both");
        for n in 0..120 {
            let off = |m: usize| {
                let d = [0, 1, 2].map(|a| {
                    let d = at(n)[a].abs_diff(at(m)[a]);
                    d.min(shape[a] - d) as f64 * step[a]
                });
                norm(d)
            };
            let nearest = (0..120).filter(|m| solid[*m] != solid[n]).map(off).fold(f64::INFINITY, f64::min) - 0.25;
            let wanted = if solid[n] { nearest } else { -nearest };
            assert!((found[n] - wanted).abs() < 1e-12, "{n}: {} and {wanted}", found[n]);
        }
        assert!(signed_distances(&[true; 120], shape, step).is_none());
    }
}
