//! What meshes for finite elements give and take: sets, forces and fields as arrays, files.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use geometry::fe_mesh::{FeField, FeSet, Load};
use geometry::formats::FeText;
use geometry::math::Vec3;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::table;
use crate::file;
use crate::run::run;

/// Nodes, elements, and faces (element, number of the face in it) of a set.
pub type Members<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<u32>>, Bound<'py, PyArray2<u32>>);

/// Nodes, and the forces at them.
pub type Forces<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray2<f64>>);

/// A field of a file: its name, numbers for each node or element, whether it is at nodes, the numbers.
pub type Field = (String, usize, bool, Vec<f64>);

/// A load on a set as Python gives it.
#[derive(FromPyObject)]
pub enum LoadArgument {
    /// The resultant of a uniform traction, N.
    Traction([f64; 3]),
    /// A pressure, MPa.
    Pressure(f64),
}

impl From<LoadArgument> for Load {
    fn from(of: LoadArgument) -> Load {
        match of {
            LoadArgument::Traction(force) => Load::Traction(force),
            LoadArgument::Pressure(p) => Load::Pressure(p),
        }
    }
}

/// What is written besides a mesh: materials, what is held and loaded, fields.
pub fn text(
    elastic: Vec<[f64; 2]>,
    held: Vec<String>,
    loads: Vec<(String, LoadArgument)>,
    fields: Vec<Field>,
) -> FeText {
    let loads = loads.into_iter().map(|(name, load)| (name, load.into())).collect();
    FeText { elastic, held, loads, fields: fields.into_iter().map(field).collect(), ..FeText::default() }
}

/// A set as arrays.
pub fn members<'py>(py: Python<'py>, set: &FeSet) -> PyResult<Members<'py>> {
    let faces = table(py, set.faces.iter().map(|(t, k)| [*t, u32::from(*k)]).collect())?;
    Ok((set.nodes.clone().into_pyarray(py), set.elements.clone().into_pyarray(py), faces))
}

/// Forces at nodes as arrays.
pub fn forces(py: Python<'_>, of: Vec<(u32, Vec3)>) -> PyResult<Forces<'_>> {
    let (nodes, forces): (Vec<u32>, Vec<Vec3>) = of.into_iter().unzip();
    Ok((nodes.into_pyarray(py), table(py, forces)?))
}

/// A field as the core takes it.
fn field((name, components, at_nodes, values): Field) -> FeField {
    FeField { name, components, at_nodes, values }
}

/// What writes a mesh of one kind.
type Writer<M> = fn(&M, &FeText, &mut dyn Write) -> io::Result<()>;

/// Writes a mesh as a file, given as path, suffix and title, in one of its formats.
pub fn write_as<M: Sync>(
    py: Python<'_>,
    mesh: &M,
    formats: &[(&str, &str, Writer<M>)],
    (path, suffix, title): (PathBuf, String, String),
    text: FeText,
) -> PyResult<()> {
    let Some((.., write)) = formats.iter().find(|f| f.0 == suffix) else {
        return Err(PyValueError::new_err(format!("no format of this mesh is named {suffix}")));
    };
    to_file(py, &path, |out| write(mesh, &FeText { title, ..text }, out))
}

/// Writes a file that is made anew.
pub fn to_file(
    py: Python<'_>,
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()> + Send,
) -> PyResult<()> {
    let done = run(py, None, None, |_| {
        let mut out = BufWriter::with_capacity(1 << 20, file::anew(path)?);
        write(&mut out)?;
        out.flush()
    })?;
    Ok(done?)
}
