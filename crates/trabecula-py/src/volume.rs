//! Volume meshes: arrays, sets, figures, files.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::fe_mesh::{FeMesh, MIDDLES};
use geometry::formats::{FE_FORMATS, FeText, POLY_FILES};
use geometry::surface_mesh::SurfaceMesh;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use trabecula::design::CarrierMaterial;
use trabecula::report::VolumeReport;
use trabecula::volume_mesh::{MeshedVolume, VolumeMeshOptions, VolumeTarget};

use crate::arrays::table;
use crate::error;
use crate::fe_arrays::{Field, Forces, LoadArgument, Members, forces, members, text, to_file};
use crate::file;
use crate::mesh::Mesh;
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// A volume mesh.
#[pyclass(frozen, module = "trabecula._core")]
pub struct VolumeMesh {
    made: MeshedVolume,
}

impl VolumeMesh {
    fn mesh(&self) -> &FeMesh {
        &self.made.mesh
    }
}

#[pymethods]
impl VolumeMesh {
    /// Of a solid: edge of the background's cubes (mm), what is meshed, order of the tetrahedra, whether it is periodic, whether the
    /// largest component alone is kept.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    #[pyo3(signature = (solid, edge, of="solid", order=1, periodic=false, largest=false, threads=None, progress=None))]
    fn make(
        py: Python<'_>,
        solid: &Solid,
        edge: f64,
        of: &str,
        order: u8,
        periodic: bool,
        largest: bool,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<VolumeMesh> {
        let Some((_, of)) = VolumeTarget::NAMES.into_iter().find(|(name, _)| *name == of) else {
            return Err(PyValueError::new_err(format!("of is \"{of}\"; it must be solid, pore, lower, upper or all")));
        };
        let options = VolumeMeshOptions { edge, of, order, periodic, largest };
        let made = run(py, threads, progress, |p| solid.built().volume_mesh(&options, p))?;
        Ok(VolumeMesh { made: made.map_err(error::stopped)? })
    }

    /// The carrier of a solid's lattice over tetrahedra, linear or quadratic.
    #[staticmethod]
    #[pyo3(signature = (solid, order=1, threads=None))]
    fn carrier(py: Python<'_>, solid: &Solid, order: u8, threads: Option<usize>) -> PyResult<VolumeMesh> {
        let made = run(py, threads, None, |_| solid.built().carrier(order))?;
        Ok(VolumeMesh { made: made.map_err(error::fault)? })
    }

    /// The material of each domain of the carrier: C11, C12 and C44; Young's modulus and Poisson's ratio of their mean over all directions;
    /// moduli over that of the solid, whose Poisson's ratio is `nu`; `n` voxels along cells.
    #[staticmethod]
    #[pyo3(signature = (solid, nu, n, threads=None, progress=None))]
    fn carrier_materials(
        py: Python<'_>,
        solid: &Solid,
        nu: f64,
        n: usize,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<CarrierMaterial>> {
        run(py, threads, progress, |p| solid.built().carrier_materials(nu, n, p))?.map_err(error::stopped)
    }

    /// The axes of each tetrahedron of a carrier (m, 9), one after the other.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let each = |m: &[[f64; 3]; 3]| core::array::from_fn::<f64, 9, _>(|i| m[i / 3][i % 3]);
        table(py, self.mesh().axes.iter().map(each).collect())
    }

    /// The solid fraction of each tetrahedron of a carrier; empty for others.
    #[getter]
    fn fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.mesh().fraction.clone().into_pyarray(py)
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.mesh().nodes.clone())
    }

    /// Nodes of each tetrahedron (m, 4) or (m, 10), in the order of VTK.
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let mesh = self.mesh();
        let m = mesh.tets.len();
        if mesh.middles.is_empty() {
            return table(py, mesh.tets.clone());
        }
        let each = mesh.tets.iter().zip(&mesh.middles);
        let flat: Vec<u32> = each.flat_map(|(t, e)| t.iter().copied().chain(MIDDLES.map(|k| e[k]))).collect();
        flat.into_pyarray(py).reshape([m, 10])
    }

    /// The domain of each tetrahedron, a number.
    #[getter]
    fn domain<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        self.mesh().domain.clone().into_pyarray(py)
    }

    /// The names of the domains.
    #[getter]
    fn domains(&self) -> Vec<String> {
        self.mesh().domains.clone()
    }

    /// The names of the sets.
    #[getter]
    fn sets(&self) -> Vec<String> {
        self.mesh().sets.iter().map(|s| s.name.clone()).collect()
    }

    /// Nodes, tetrahedra and faces of a set; None without it.
    fn set<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Members<'py>>> {
        self.mesh().set(name).map(|set| members(py, set)).transpose()
    }

    /// Periodic pairs (n, 5): node, its image, and by which periods they differ (0 or 1 along x, y, z).
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let pairs = &self.mesh().pairs;
        let flat: Vec<u32> =
            pairs.iter().flat_map(|p| [p.node, p.image].into_iter().chain(p.along.map(u32::from))).collect();
        flat.into_pyarray(py).reshape([pairs.len(), 5])
    }

    /// The figures, as `reports.VolumeReport`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let figures = run(py, None, None, |_| VolumeReport::from(&self.made))?;
        report(py, "VolumeReport", &figures)
    }

    /// The boundary of all domains together, between corners: a closed surface.
    fn boundary(&self, py: Python<'_>) -> PyResult<Mesh> {
        let mesh = run(py, None, None, |_| self.mesh().corners().boundary())?;
        let cut = vec![false; mesh.triangles.len()];
        Ok(Mesh::new(SurfaceMesh { mesh, cut }, String::new()))
    }

    /// Nodes of a set's faces and the forces (N) at them, (n, 3), of a load; None without the set.
    fn forces<'py>(&self, py: Python<'py>, name: &str, load: LoadArgument) -> PyResult<Option<Forces<'py>>> {
        self.mesh().set(name).map(|set| forces(py, self.mesh().nodal_forces(set, load.into()))).transpose()
    }

    /// Writes a file, given as path, suffix and title; Young's modulus (MPa) and Poisson's ratio, of all domains or of each, for formats
    /// with materials; sets that are held, sets with their loads, and fields; C11, C12 and C44 (MPa) of each domain along
    /// the axes of its elements, in place of isotropic materials.
    #[allow(clippy::too_many_arguments)] // The pieces of a file.
    fn write(
        &self,
        py: Python<'_>,
        file: (PathBuf, String, String),
        elastic: Vec<[f64; 2]>,
        held: Vec<String>,
        loads: Vec<(String, LoadArgument)>,
        fields: Vec<Field>,
        cubic: Vec<[f64; 3]>,
    ) -> PyResult<()> {
        let (path, suffix, title) = file;
        let format = FE_FORMATS.iter().find(|f| f.suffix == suffix);
        let format =
            format.ok_or_else(|| PyValueError::new_err(format!("no format of volume meshes is named {suffix}")))?;
        let text = FeText { title, cubic, ..text(elastic, held, loads, fields) };
        to_file(py, &path, |out| (format.write)(self.mesh(), &text, out))
    }

    /// Writes the files of OpenFOAM's polyMesh into a folder; gives the names of its patches and their numbers of faces.
    fn write_poly(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<(String, usize)>> {
        let done = run(py, None, None, |_| {
            let faces = self.mesh().poly_faces();
            for (name, write) in POLY_FILES {
                let mut out = BufWriter::with_capacity(1 << 20, file::anew(&folder.join(name))?);
                write(self.mesh(), &faces, &mut out)?;
                out.flush()?;
            }
            Ok::<_, std::io::Error>(faces.patches.into_iter().map(|p| (p.name, p.count)).collect())
        })?;
        Ok(done?)
    }
}

/// The formats of volume meshes: suffix and title.
pub fn formats() -> Vec<(&'static str, &'static str)> {
    FE_FORMATS.iter().map(|f| (f.suffix, f.title)).collect()
}
