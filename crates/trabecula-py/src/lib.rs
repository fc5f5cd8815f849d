//! The Python door: thin. Data in, arrays out; long calls let other threads run, report progress and stop on Ctrl-C.

use pyo3::prelude::*;

mod arrays;
mod beam_files;
mod beam_mesh;
mod cells;
mod design;
mod effective;
mod error;
mod fe_arrays;
mod file;
mod folder;
mod lattice_terms;
mod layer_ranges;
mod layers;
mod machine;
mod mesh;
mod node;
mod quadors;
mod ranges;
mod region;
mod report;
mod run;
mod shells;
mod solid;
mod tets;
mod volume;
mod voxel_elements;
mod voxels;

/// Rotations and translations.
type Operations = Vec<([[i32; 3]; 3], [i32; 3])>;
/// For each part, intervals of the fraction.
type Connected = Vec<(&'static str, Vec<[f64; 2]>)>;
/// The compiled core of `trabecula`.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    use crate::{Connected, Operations};

    /// Cells of a grid along a tile's edge, and the most steps and cells of a grid.
    #[pymodule_export]
    const TILE: usize = trabecula::extract::TILE;
    #[pymodule_export]
    const MOST_STEPS: f64 = trabecula::extract::MOST_STEPS;
    #[pymodule_export]
    const MOST_CELLS: f64 = trabecula::extract::MOST_CELLS;
    /// Bytes of the header and of a triangle of a binary STL.
    #[pymodule_export]
    const STL_HEADER: usize = geometry::formats::stl::HEADER;
    #[pymodule_export]
    const STL_RECORD: usize = geometry::formats::stl::RECORD;

    #[pymodule_export]
    use crate::beam_files::{BeamCell, graph_formats, read_graph, write_beam_lattice, write_graph};
    #[pymodule_export]
    use crate::beam_mesh::BeamElements;
    #[pymodule_export]
    use crate::cells::NamedCell;
    #[pymodule_export]
    use crate::design::Design;
    #[pymodule_export]
    use crate::effective::Cell;
    #[pymodule_export]
    use crate::lattice_terms::{LatticeTerms, formula_terms, lattice_terms};
    #[pymodule_export]
    use crate::layer_ranges::LayerRanges;
    #[pymodule_export]
    use crate::layers::Layers;
    #[pymodule_export]
    use crate::mesh::{Mesh, MeshFormat};
    #[pymodule_export]
    use crate::quadors::{Quadors, Slice};
    #[pymodule_export]
    use crate::ranges::{Joined, TileRanges, VoxelRanges};
    #[pymodule_export]
    use crate::region::Region;
    #[pymodule_export]
    use crate::shells::Shells;
    #[pymodule_export]
    use crate::solid::Solid;
    #[pymodule_export]
    use crate::tets::TetMesh;
    #[pymodule_export]
    use crate::volume::VolumeMesh;
    #[pymodule_export]
    use crate::voxel_elements::VoxelElements;
    #[pymodule_export]
    use crate::voxels::Voxels;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::error::watch();
        crate::run::watch_forks(module.py())
    }

    /// Version of the core.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// The bytes of a file; what is no regular file, or more than memory can hold, is refused.
    #[pyfunction]
    fn read_file(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Bound<'_, pyo3::types::PyBytes>> {
        let bytes = py.detach(|| crate::file::read(&path))?;
        Ok(pyo3::types::PyBytes::new(py, &bytes))
    }

    /// The first bytes of a binary STL, given the number of its triangles.
    #[pyfunction]
    fn stl_header(py: Python<'_>, triangles: u32) -> Bound<'_, pyo3::types::PyBytes> {
        pyo3::types::PyBytes::new(py, &crate::ranges::stl_header(triangles))
    }

    /// Bytes of memory that may yet be taken, or None where the system does not tell; `root` is that of its files.
    #[pyfunction]
    #[pyo3(signature = (root=std::path::PathBuf::from("/")))]
    fn free_memory(root: std::path::PathBuf) -> Option<f64> {
        crate::machine::free_memory(&root)
    }

    /// The mesh formats, in the order in which texts name them.
    #[pyfunction]
    fn mesh_formats() -> Vec<MeshFormat> {
        geometry::formats::FORMATS.iter().map(MeshFormat::of).collect()
    }

    /// The formats of layers, in the order in which texts name them: suffix and title, whether it holds pictures, whether all
    /// layers have one thickness.
    #[pyfunction]
    fn layer_formats() -> Vec<(&'static str, &'static str, bool, bool)> {
        crate::layers::formats()
    }

    /// The formats of volume meshes, in the order in which texts name them: suffix and title.
    #[pyfunction]
    fn volume_formats() -> Vec<(&'static str, &'static str)> {
        crate::volume::formats()
    }

    /// The formats of shells: suffix and title.
    #[pyfunction]
    fn shell_formats() -> Vec<(&'static str, &'static str)> {
        crate::shells::formats()
    }

    /// The formats of beams as finite elements: suffix and title.
    #[pyfunction]
    fn beam_element_formats() -> Vec<(&'static str, &'static str)> {
        crate::beam_mesh::formats()
    }

    /// The formats of voxels as finite elements: suffix and title.
    #[pyfunction]
    fn voxel_element_formats() -> Vec<(&'static str, &'static str)> {
        crate::voxel_elements::formats()
    }

    /// Values at positions of the monotone cubic through points of ascending x.
    #[pyfunction]
    fn monotone(points: Vec<[f64; 2]>, at: Vec<f64>) -> PyResult<Vec<f64>> {
        if points.is_empty() {
            return Err(pyo3::exceptions::PyValueError::new_err("a curve needs one point at least"));
        }
        Ok(at.into_iter().map(|x| geometry::monotone_cubic::monotone(&points, x)).collect())
    }

    /// The JSON Schema of a design, as JSON text.
    #[pyfunction]
    fn schema() -> String {
        trabecula::design::schema()
    }

    /// The JSON Schema of all reports, as JSON text.
    #[pyfunction]
    fn report_schema() -> String {
        trabecula::report::schema().to_string()
    }

    /// A space group: its number, its name, and its operations as rotations and translations (in parts of 24).
    #[pyfunction]
    fn group(symbol: &str) -> PyResult<(Option<u16>, String, Operations)> {
        let group = geometry::symmetry::Group::named(symbol).map_err(crate::error::fault)?;
        let operations = group.operations.iter();
        let operations = operations.map(|o| (o.rotation, o.translation)).collect();
        Ok((group.number, group.name, operations))
    }

    /// The named cells.
    #[pyfunction]
    fn cells() -> Vec<NamedCell> {
        trabecula::cell::catalogue().iter().map(NamedCell::of).collect()
    }

    /// The cells of beams.
    #[pyfunction]
    fn beam_cells() -> PyResult<Vec<BeamCell>> {
        beams::graph::catalogue().iter().map(BeamCell::of).collect()
    }

    /// What a named cell can tell: its range, and for each part the fractions in which it is one piece in space.
    #[pyfunction]
    fn cell_facts(py: Python<'_>, name: &str) -> PyResult<((f64, f64), Connected)> {
        use trabecula::cell::{Cell, Part, Series};
        let known = trabecula::cell::named(name)
            .ok_or_else(|| pyo3::exceptions::PyKeyError::new_err(format!("no cell is named {name}")))?;
        let series = Series::new(known.terms())
            .map_err(|f| pyo3::exceptions::PyRuntimeError::new_err(format!("cell {name}: {f}")))?;
        crate::run::run(py, None, None, |_| {
            let cell = Cell::new(series);
            let range = cell.range();
            let parts = [("sheet", Part::Sheet), ("lower", Part::Lower), ("upper", Part::Upper)];
            ((range.lo, range.hi), parts.map(|(n, p)| (n, cell.connected_fraction(p))).to_vec())
        })
    }

    /// The ready tetrahedral cells.
    #[pyfunction]
    fn tet_cells() -> Vec<&'static str> {
        let all = trabecula::cell::tet::tet_catalogue();
        all.iter().map(|r| r.name).collect()
    }

    /// What a ready tetrahedral cell is, as JSON text: terms, place, part, fraction, ports, and for each part the fractions in
    /// which it is one piece that reaches all faces.
    #[pyfunction]
    fn tet_cell_facts(py: Python<'_>, name: &str) -> PyResult<String> {
        let named = trabecula::cell::tet::named_tet_cell(name)
            .ok_or_else(|| pyo3::exceptions::PyKeyError::new_err(format!("no tetrahedral cell is named {name}")))?;
        let facts = crate::run::run(py, None, None, |_| named.facts())?;
        facts.map(|json| json.to_string()).map_err(crate::error::fault)
    }

    /// The surface of a ready tetrahedral cell in the regular tetrahedron of edge 1 mm, in `steps` steps.
    #[pyfunction]
    fn tet_cell_mesh(py: Python<'_>, name: &str, steps: usize) -> PyResult<Mesh> {
        let named = trabecula::cell::tet::named_tet_cell(name)
            .ok_or_else(|| pyo3::exceptions::PyKeyError::new_err(format!("no tetrahedral cell is named {name}")))?;
        let made = crate::run::run(py, None, None, |p| trabecula::tiling::cell_surface(named, steps, p))?;
        let surface = made.map_err(crate::error::stopped)?;
        Ok(Mesh::new(surface, String::new()))
    }

    /// The levels (`to_iso`) of the solid fractions `values`, or the fractions of the levels, of a part of a cell.
    #[pyfunction]
    fn levels(
        py: Python<'_>,
        cell: &Bound<'_, PyAny>,
        part: &str,
        values: Vec<f64>,
        to_iso: bool,
    ) -> PyResult<Vec<f64>> {
        use trabecula::cell::Part;
        let part = match part {
            "sheet" => Part::Sheet,
            "lower" => Part::Lower,
            "upper" => Part::Upper,
            _ => {
                let message = format!("part is \"{part}\"; it must be sheet, lower or upper");
                return Err(pyo3::exceptions::PyValueError::new_err(message));
            }
        };
        let bad = |v: &&f64| {
            if to_iso { !(**v > 0.0 && **v < 1.0) } else { !v.is_finite() }
        };
        if let Some(v) = values.iter().find(bad) {
            let name = if to_iso { "fraction" } else { "iso" };
            let allowed = if to_iso { "greater than 0 and less than 1" } else { "a finite number" };
            return Err(pyo3::exceptions::PyValueError::new_err(format!("{name} is {v}; it must be {allowed}")));
        }
        let node = crate::node::node(cell, 0)?;
        let done = crate::run::run(py, None, None, |_| {
            let cell = trabecula::design::cell(&node)?;
            let one = |v: &f64| {
                if to_iso { cell.iso(part, *v).0 } else { cell.fraction(part, *v) }
            };
            Ok(values.iter().map(one).collect())
        })?;
        done.map_err(|e| crate::error::design(py, &e))
    }
}
