//! Numbers on a grid from a file: arrays, images, stacks of pictures.

use super::remapped::sampled;
use super::result::{not_covered, pick};
use super::{BuildGrade, Grade, Quantity, Samples, Stops};
use crate::environment::{Environment, extension, names_pictures, picture_stack};
use crate::kind::{DesignError, Kind, OneOrThree};
use geometry::fault::Fault;
use geometry::formats::{self, DataSet};

/// Numbers on a grid, from a file; linear between them.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Grid", noun = "a grade on a grid")]
pub struct GridKind {
    /// Path of the file (npy, vti, vtk), relative to the design file; or of grey pictures one above the other (png, tif,
    /// DICOM): one file, "scan/*.png" with a * in the last part for any text, or their folder, "scan/". Columns run along x, rows
    /// along y, pictures along z; DICOM as its axes say.
    path: String,
    /// Position of the first number, of pictures the middle of the first pixel. VTI, VTK and DICOM files contain it.
    #[kind(unit = "mm")]
    origin: Option<[f64; 3]>,
    /// Distance between numbers, one or three. VTI, VTK and DICOM files contain it.
    #[kind(unit = "mm")]
    step: Option<OneOrThree>,
    /// Name of the array, where a file has several.
    array: Option<String>,
    /// The values that the numbers map to: pairs [number, value], number rising, linear between.
    remap: Option<Stops>,
}

impl BuildGrade for GridKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        sampled(read(self, &of.path, of.environment)?, &self.remap, of)
    }
}

fn read(spec: &GridKind, path: &str, environment: &Environment) -> Result<Samples, DesignError> {
    let at = format!("{path}.path");
    let kind = extension(&spec.path);
    let pictures = names_pictures(&spec.path);
    let file = if pictures { Vec::new() } else { environment.load(&spec.path, &at)? };
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let (origin, step, shape, values) = match if pictures { "pictures" } else { kind.as_str() } {
        "npy" => {
            let (shape, values) = formats::read_npy(&file).map_err(wrong)?;
            let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
                wrong(Fault::new("", format!("the array has shape {shape:?}; a grid has three dimensions [x, y, z]")))
            })?;
            let need = |key: &str, what: &str| {
                DesignError::new(
                    format!("{path}.{key}"),
                    format!("an NPY file does not say where it lies; give {key}, {what}"),
                )
            };
            let origin = spec.origin.ok_or_else(|| need("origin", "the place of the first number, [x, y, z] in mm"))?;
            let step = spec.step.ok_or_else(|| need("step", "the distance between numbers in mm, one or three"))?;
            (origin, step.three(), shape, values)
        }
        "vti" | "vtk" => {
            let data = formats::read_vtk(&file).map_err(wrong)?;
            let DataSet::Image { origin, step, nodes } = data.shape else {
                return Err(wrong(Fault::new("", "the file holds a mesh; use the grade field for it")));
            };
            let array =
                pick(&data.arrays, spec.array.as_deref()).map_err(|m| DesignError::new(format!("{path}.array"), m))?;
            if array.components != 1 {
                let message = format!(
                    "the array \"{}\" has {} components; a number needs an array with one",
                    array.name, array.components
                );
                return Err(DesignError::new(format!("{path}.array"), message));
            }
            let (origin, shape) = if array.of_cells {
                let at = core::array::from_fn(|a| origin[a] + if nodes[a] > 1 { 0.5 * step[a] } else { 0.0 });
                (at, nodes.map(|n| n.saturating_sub(1).max(1)))
            } else {
                (origin, nodes)
            };
            (spec.origin.unwrap_or(origin), spec.step.map_or(step, OneOrThree::three), shape, array.values.clone())
        }
        "pictures" => {
            let need = |key: &str, what: &str| {
                DesignError::new(
                    format!("{path}.{key}"),
                    format!("pictures do not say where they lie; give {key}, {what}"),
                )
            };
            let found = picture_stack(&spec.path, &at, environment.loader)?;
            let placed = |n: usize| found.placed.map(|p| p[n]);
            let origin = (spec.origin.or(placed(0)))
                .ok_or_else(|| need("origin", "the middle of the first pixel, [x, y, z] in mm"))?;
            let step = (spec.step.map(OneOrThree::three).or(placed(1)))
                .ok_or_else(|| need("step", "the distance between pixels and pictures in mm, one or three"))?;
            (origin, step, found.shape, found.values)
        }
        _ => {
            let message = format!(
                "the name must end in npy, vti or vtk, or in png, tif or dcm for pictures, or in / for a folder of them; \
                 found \"{}\"",
                spec.path
            );
            return Err(DesignError::new(at, message).found(&spec.path));
        }
    };
    let samples = Samples::new(origin, step, shape, values).map_err(|f| match f.at.as_str() {
        "path" => wrong(f),
        _ => DesignError::fault(path, f),
    })?;
    let share = samples.uncovered(environment.points);
    if share > 0.0 {
        let message = not_covered(&spec.path, "grid", share, &samples.bounds());
        return Err(DesignError::new(at, message).found(&spec.path));
    }
    Ok(samples)
}
