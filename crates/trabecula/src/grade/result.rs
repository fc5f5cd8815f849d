//! Results on meshes from a file: an array of points or cells.

use super::invariant::{Invariant, TensorOrder};
use super::remapped::sampled;
use super::{BuildGrade, Grade, Quantity, Samples, Stops};
use crate::environment::{Environment, extension};
use crate::kind::{DesignError, Key, Kind, Unit, Warning};
use geometry::fault::{Fault, counted};
use geometry::formats::{self, DataSet};
use geometry::math::{Aabb, Vec3, norm, scale};

/// The share of the region that a result's mesh may leave uncovered: curved faces are cut short by flat elements.
const UNCOVERED: f64 = 0.01;
/// The size of a result over that of the region above which its unit is doubted.
const FARTHER: f64 = 100.0;

/// An array of a result on a mesh of volume elements, from a file.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Field", noun = "a field of a result", check = FieldKind::complete)]
pub struct FieldKind {
    /// Path of the file (vtu, vtk, vti; frd of CalculiX; in Python also med, e, exo, msh, xdmf, avs), relative to the design file.
    path: String,
    /// Name of the array, of points or cells. Where a file has several steps, "STRESS" is that of the last, "STRESS@2" that of the
    /// second.
    array: String,
    /// Unit of the file's coordinates (mm unless given).
    unit: Option<Unit>,
    /// Which of its components, from 0, where it has several.
    component: Option<u32>,
    /// A number made of all its components.
    invariant: Option<Invariant>,
    /// The order of the six components of a tensor, on which its principal values depend; `"vtk"` unless given.
    order: Option<TensorOrder>,
    /// Poisson's ratio, for the strain energy; 0.3 unless given.
    #[kind(above = -1.0, max = 0.5, hints("poisson", "poissons_ratio", "poisson_ratio"))]
    nu: Option<f64>,
    /// The values that the numbers map to: pairs [number, value], number rising, linear between.
    remap: Option<Stops>,
}

/// Poisson's ratio, where none is given.
const NU: f64 = 0.3;

impl FieldKind {
    fn complete(&self, _: &Key) -> Result<(), Fault> {
        match self.nu.is_some() && self.invariant != Some(Invariant::StrainEnergy) {
            true => Err(Fault::new("nu", "Poisson's ratio is for invariant = \"strain_energy\" alone; leave it out")),
            false => Ok(()),
        }
    }

    /// Refuses what makes one number of an array of which all components are taken.
    fn whole(&self, path: &str) -> Result<(), DesignError> {
        let wrong = |key: &str, message: &str| Err(DesignError::new(format!("{path}.{key}"), message));
        let taken = "all components of the array are taken here; leave it out";
        match self {
            FieldKind { component: Some(_), .. } => wrong("component", taken),
            FieldKind { invariant: Some(_), .. } => wrong("invariant", taken),
            FieldKind { remap: Some(_), .. } => wrong("remap", taken),
            FieldKind { order: Some(_), .. } => {
                wrong("order", "give the order of a tensor next to its field, not in it")
            }
            _ => Ok(()),
        }
    }
}

impl BuildGrade for FieldKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        sampled(read(self, &of.path, of.environment)?, &self.remap, of)
    }
}

/// The array of this name, or the only one.
pub(super) fn pick<'a>(arrays: &'a [formats::DataArray], name: Option<&str>) -> Result<&'a formats::DataArray, String> {
    let listed = || {
        let names: Vec<String> = arrays
            .iter()
            .map(|a| {
                format!(
                    "\"{}\" ({} each, of {})",
                    a.name,
                    counted(a.components, "number"),
                    if a.of_cells { "cells" } else { "points" }
                )
            })
            .collect();
        if names.is_empty() { "it has none".to_string() } else { format!("it has {}", names.join(", ")) }
    };
    match name {
        Some(name) => arrays
            .iter()
            .find(|a| a.name == name)
            .ok_or_else(|| format!("the file has no array \"{name}\"; {}", listed())),
        None => match arrays {
            [one] => Ok(one),
            _ => Err(format!("the file does not have exactly one array, so name one; {}", listed())),
        },
    }
}

pub(super) fn percent(share: f64) -> String {
    if share >= 0.01 { format!("{:.0} %", 100.0 * share) } else { format!("{:.2} %", 100.0 * share) }
}

/// What is wrong with numbers that leave a share of the region without one.
pub(super) fn not_covered(file: &str, what: &str, share: f64, reach: &Aabb) -> String {
    let [from, to] = [reach.min, reach.max];
    let covers = match share {
        1.0.. => "covers none of the region".into(),
        _ => format!("does not cover {} of the region", percent(share)),
    };
    format!("{file}: the {what} {covers}; it reaches from {from:?} to {to:?} mm")
}

fn read(spec: &FieldKind, path: &str, environment: &Environment) -> Result<Samples, DesignError> {
    let made = columns(spec, path, environment, |array| {
        let invariant = invariant(spec, path, array)?;
        let chosen = if invariant.is_none() { component(spec, path, array)? } else { 0 };
        let (order, nu) = (spec.order.unwrap_or_default(), spec.nu.unwrap_or(NU));
        Ok((1, move |t: &[f64], _| invariant.map_or_else(|| t[chosen], |i| i.of(t, order, nu))))
    })?;
    let one = made.into_iter().next();
    one.ok_or_else(|| DesignError::new(path, "the array has no numbers"))
}

/// The invariant that is meant, if one is.
fn invariant(spec: &FieldKind, path: &str, array: &formats::DataArray) -> Result<Option<Invariant>, DesignError> {
    let Some(invariant) = spec.invariant else { return Ok(None) };
    let at = format!("{path}.invariant");
    if spec.component.is_some() {
        return Err(DesignError::new(at, "component and invariant each make one number; give one of the two"));
    }
    if !invariant.takes(array.components) {
        let needed = if invariant == Invariant::Magnitude { "three, six or nine" } else { "six or nine" };
        let message = format!("the array \"{}\" has {} components; it needs {needed}", array.name, array.components);
        return Err(DesignError::new(at, message));
    }
    Ok(Some(invariant))
}

/// The component that is meant.
fn component(spec: &FieldKind, path: &str, array: &formats::DataArray) -> Result<usize, DesignError> {
    let at = format!("{path}.component");
    match (spec.component, array.components) {
        (_, 0) => Err(DesignError::new(path, format!("the array \"{}\" has no components", array.name))),
        (None, 1) => Ok(0),
        (None, n) => Err(DesignError::new(
            &at,
            format!(
                "the array \"{}\" has {n} components; give component, from 0 to {}, or an invariant",
                array.name,
                n - 1
            ),
        )),
        (Some(c), n) if (c as usize) < n => Ok(c as usize),
        (Some(c), n) => Err(DesignError::new(
            &at,
            format!("component is {}; the array \"{}\" has components 0 to {}", c, array.name, n - 1),
        )),
    }
}

/// The components of a vector (three) or a symmetric tensor (six, in the order 11, 22, 33, 23, 13, 12).
pub(crate) fn several<const N: usize>(
    spec: &FieldKind,
    path: &str,
    environment: &Environment,
    order: impl Fn(usize) -> Option<[usize; N]>,
) -> Result<[Grade; N], DesignError> {
    spec.whole(path)?;
    let made = columns(spec, path, environment, |array| {
        let order = order(array.components).ok_or_else(|| wrong_components(path, array, "a tensor has six or nine"))?;
        Ok((N, move |t: &[f64], c: usize| t[order[c]]))
    })?;
    Ok(grades(made))
}

/// The tensors v vᵀ (11, 22, 33, 23, 13, 12) of vectors made unit vectors at the file's own points, so that their signs and lengths do
/// not count between them.
pub(crate) fn lines(spec: &FieldKind, path: &str, environment: &Environment) -> Result<[Grade; 6], DesignError> {
    const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
    spec.whole(path)?;
    let made = columns(spec, path, environment, |array| {
        if array.components != 3 {
            return Err(wrong_components(path, array, "a vector has three"));
        }
        let square = |t: &[f64]| t.iter().map(|v| v * v).sum::<f64>();
        if let Some(n) = array.values.chunks_exact(3).position(|t| square(t) == 0.0) {
            let what = if array.of_cells { "cell" } else { "point" };
            let message =
                format!("the array \"{}\" is zero at {what} {n}; it needs a direction everywhere", array.name);
            return Err(DesignError::new(format!("{path}.array"), message));
        }
        Ok((6, move |t: &[f64], c: usize| t[PAIRS[c][0]] * t[PAIRS[c][1]] / square(t)))
    })?;
    Ok(grades(made))
}

fn wrong_components(path: &str, array: &formats::DataArray, needed: &str) -> DesignError {
    let message = format!("the array \"{}\" has {} components; {needed}", array.name, array.components);
    DesignError::new(format!("{path}.array"), message)
}

fn grades<const N: usize>(made: Vec<Samples>) -> [Grade; N] {
    let mut made = made.into_iter().map(Grade::from);
    core::array::from_fn(|_| made.next().unwrap_or(Grade::Constant(0.0)))
}

/// Coefficients made of the directions of two arrays of vectors together, at the file's own points; `None` where they are not arrays of
/// the same points or cells of one file, or two directions are parallel.
pub(crate) fn pairs<const N: usize>(
    [first, second]: [&FieldKind; 2],
    path: &str,
    environment: &Environment,
    make: impl Fn(Vec3, Vec3) -> Option<[f64; N]>,
) -> Result<Option<[Grade; N]>, DesignError> {
    if first.path != second.path || first.unit != second.unit {
        return Ok(None);
    }
    let ((shape, a), (_, b)) = (loaded(first, path, environment)?, loaded(second, path, environment)?);
    if [a.components, b.components] != [3, 3] || a.of_cells != b.of_cells || a.values.len() != b.values.len() {
        return Ok(None);
    }
    let vector = |t: &[f64]| [t[0], t[1], t[2]];
    let both = a.values.chunks_exact(3).zip(b.values.chunks_exact(3));
    let Some(made) = both.map(|(a, b)| make(vector(a), vector(b))).collect::<Option<Vec<[f64; N]>>>() else {
        return Ok(None);
    };
    let values = (0..N).map(|c| made.iter().map(|m| m[c]).collect()).collect();
    on_grids(first, path, environment, shape, a.of_cells, values).map(|made| Some(grades(made)))
}

/// The shape of a file's data, and the array that is meant.
fn loaded(
    spec: &FieldKind,
    path: &str,
    environment: &Environment,
) -> Result<(DataSet, formats::DataArray), DesignError> {
    let at = format!("{path}.path");
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let kind = extension(&spec.path);
    let data = if formats::RESULTS.contains(&kind.as_str()) {
        formats::read_result(&environment.load(&spec.path, &at)?, &kind, &spec.array).map_err(wrong)?
    } else {
        let read = environment.loader.result(&spec.path, &spec.array);
        read.map_err(|m| DesignError::new(&at, m).found(&spec.path))?
    };
    let array = pick(&data.arrays, Some(&spec.array))
        .map_err(|m| DesignError::new(format!("{path}.array"), m).found(&spec.array))?;
    if let Some(n) = array.values.iter().position(|v| !v.is_finite()) {
        let bad = array.values.iter().filter(|v| !v.is_finite()).count();
        let what = if array.of_cells { "cell" } else { "point" };
        let message = format!(
            "{}: {bad} of {} of the array \"{}\" are not finite, the first at {what} {}; fill them before use",
            spec.path,
            counted(array.values.len(), "number"),
            array.name,
            n / array.components
        );
        return Err(DesignError::new(format!("{path}.array"), message));
    }
    Ok((data.shape, array.clone()))
}

/// Numbers made from each tuple of an array, on grids over the region: `choose` gives how many, and each from the tuple and its index.
fn columns<F: Fn(&[f64], usize) -> f64>(
    spec: &FieldKind,
    path: &str,
    environment: &Environment,
    choose: impl Fn(&formats::DataArray) -> Result<(usize, F), DesignError>,
) -> Result<Vec<Samples>, DesignError> {
    let (shape, array) = loaded(spec, path, environment)?;
    let (count, number) = choose(&array)?;
    let column = |c: usize| array.values.chunks_exact(array.components).map(|t| number(t, c)).collect::<Vec<f64>>();
    on_grids(spec, path, environment, shape, array.of_cells, (0..count).map(column).collect())
}

/// Numbers at the points or cells of a file, a list for each grid over the region.
fn on_grids(
    spec: &FieldKind,
    path: &str,
    environment: &Environment,
    shape: DataSet,
    of_cells: bool,
    columns: Vec<Vec<f64>>,
) -> Result<Vec<Samples>, DesignError> {
    let at = format!("{path}.path");
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let uncovered = |what: &str, share: f64, reach: Aabb| {
        let ask = if spec.unit.is_none() { "; is that its unit? give another as unit, such as \"m\"" } else { "" };
        let message = format!("{}{ask}", not_covered(&spec.path, what, share, &reach));
        DesignError::new(&at, message).found(&spec.path)
    };
    let unit = spec.unit.map_or(1.0, Unit::in_mm);
    let (points, tets, of): (Vec<Vec3>, _, _) = match shape {
        DataSet::Mesh(elements) => {
            let (tets, of) = elements.tets();
            (elements.points.into_iter().map(|p| scale(p, unit)).collect(), tets, of)
        }
        DataSet::Image { origin, step, nodes } => {
            let (origin, step) = (scale(origin, unit), scale(step, unit));
            let (origin, shape) = if of_cells {
                (core::array::from_fn(|a| origin[a] + 0.5 * step[a]), nodes.map(|n| n.saturating_sub(1).max(1)))
            } else {
                (origin, nodes)
            };
            let made = columns.into_iter().map(|own| Samples::new(origin, step, shape, own));
            let made = made.collect::<Result<Vec<Samples>, Fault>>().map_err(wrong)?;
            return match made.iter().map(|of| (of.uncovered(environment.points), of.bounds())).next() {
                Some((share, reach)) if share > 0.0 => Err(uncovered("grid", share, reach)),
                _ => Ok(made),
            };
        }
    };
    // Values of cells go to their corners, weighted by volume.
    let values: Vec<Vec<f64>> = (columns.into_iter())
        .map(|own| {
            if !of_cells {
                return own;
            }
            let (mut sum, mut weight) = (vec![0.0; points.len()], vec![0.0; points.len()]);
            for (t, cell) in tets.iter().zip(&of) {
                let p = t.map(|i| points[i as usize]);
                let edges = [1, 2, 3].map(|i| geometry::math::sub(p[i], p[0]));
                let volume = geometry::math::determinant(&edges).abs();
                for i in t.map(|i| i as usize) {
                    sum[i] += volume * own[*cell as usize];
                    weight[i] += volume;
                }
            }
            sum.iter().zip(&weight).map(|(s, w)| if *w > 0.0 { s / w } else { 0.0 }).collect()
        })
        .collect();
    let (made, share) =
        Samples::meshed(&points, &tets, &values, &environment.region.bounds(), environment.points).map_err(wrong)?;
    let reach = points.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    if share > UNCOVERED {
        return Err(uncovered("mesh", share, reach));
    }
    let times = norm(reach.size()) / norm(environment.region.bounds().size());
    if times > FARTHER {
        let message = format!("{}: the mesh is {times:.0} times the size of the region; is that its unit?", spec.path);
        environment.notes.borrow_mut().warnings.push(Warning { path: at, message });
    }
    Ok(made)
}
