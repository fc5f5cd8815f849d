//! The environment in which a kind is built: its path in the design, the region, points inside it, and the design's files.

mod picture_stack;

use std::cell::RefCell;

pub use picture_stack::Scan;
pub(crate) use picture_stack::{names_pictures, picture_stack};

use crate::csg_tree::CsgSolid;
use crate::kind::DesignError;
use crate::region::{CadMesh, Context, Files, HalfSpace, HalfSpaceKind, Notes, Region, RegionKind, Tessellation};
use geometry::formats::{Data, Elements, RESULTS};
use geometry::math::Vec3;
use geometry::mesh::Mesh;
use geometry::tetmesh::TetMesh;

/// Hands over the files that a design refers to.
pub trait Loader {
    /// The bytes of the file at `path`, or one sentence why not.
    fn load(&self, path: &str) -> Result<Vec<u8>, String>;

    /// The names of the files that match `pattern`, in which one * of the last part matches any text; or one sentence
    /// why there are none.
    fn list(&self, pattern: &str) -> Result<Vec<String>, String> {
        Err(format!("{pattern}: folders are not looked into here"))
    }

    /// The grey values of the DICOM file or series at `path`: a file, a folder with a slash at its end, or a pattern as in
    /// `list`; or one sentence why not.
    fn scan(&self, path: &str) -> Result<Scan, String> {
        Err(format!("{path}: no pictures (png, tif); DICOM is read by the Python package alone"))
    }

    /// The finite elements of the file at `path`, which is of none of the formats read here; or one sentence why not.
    fn elements(&self, path: &str) -> Result<ZonedElements, String> {
        Err(format!("{path}: only vtu and vtk files are read here"))
    }

    /// The finite elements and the array `array` of the result at `path`, which is of none of the formats read here; of the other arrays
    /// the names alone. Or one sentence why not.
    fn result(&self, path: &str, array: &str) -> Result<Data, String> {
        let _ = array;
        Err(format!("{path}: the name must end in {}", RESULTS.join(", ")))
    }

    /// The solids of the STEP or IGES file at `path` as triangles, in mm, each closed; or one sentence why not.
    fn cad(&self, path: &str, how: &Tessellation) -> Result<CadMesh, String> {
        let _ = how;
        Err(format!("{path}: STEP and IGES are read by the Python package alone; export the part as stl or 3mf"))
    }

    /// The tetrahedra that the mesher `name` makes of a surface (soups of triangles too), of this edge (mm) and within this
    /// time (s); or one sentence why not.
    fn tetrahedra(&self, name: &str, surface: &Mesh, size: f64, limit: f64) -> Result<TetMesh, String> {
        let _ = (surface, size, limit);
        Err(format!("the mesher {name} is not available here"))
    }
}

/// Numbers of zones with their names. A zone may have several names, and a name several zones.
pub type ZoneNames = Vec<(i64, String)>;

/// Finite elements with their zones.
#[derive(Clone, Debug)]
pub struct ZonedElements {
    /// The elements.
    pub elements: Elements,
    /// The number of a zone for each, or for none.
    pub zones: Vec<i64>,
    /// Names of zones: groups, sets, families.
    pub names: ZoneNames,
}

/// A loader for designs that refer to no files.
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        Err(format!("{path}: no folder is known to read it from; use a design file"))
    }
}

/// The environment of a kind of a lattice.
pub(crate) struct Environment<'a> {
    /// The path of its table.
    pub path: String,
    /// The region that the lattice is to fill.
    pub region: &'a Region,
    /// Points inside the region, mm.
    pub points: &'a [Vec3],
    /// Skin and keep zones: solid in the region for any lattice.
    pub filled: &'a [CsgSolid],
    /// The files.
    pub loader: &'a dyn Loader,
    /// Warnings and repairs of the regions that are made of them.
    pub notes: &'a RefCell<Notes>,
}

impl Environment<'_> {
    /// The bytes of a file that is named at the path `at` of the design.
    pub fn load(&self, file: &str, at: &str) -> Result<Vec<u8>, DesignError> {
        self.loader.load(file).map_err(|m| DesignError::new(at, m).found(file))
    }

    /// The region at the path `at` of the design, which may name faces of the one that the lattice is to fill.
    pub fn region(&self, kind: &RegionKind, at: &str) -> Result<Region, DesignError> {
        region(kind, at, self.loader, Some(self.region), self.notes)
    }
}

/// The files of a loader that regions are made of.
struct RegionFiles<'a>(&'a dyn Loader);

impl Files for RegionFiles<'_> {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        self.0.load(path)
    }

    fn cad(&self, path: &str, how: &Tessellation) -> Result<CadMesh, String> {
        self.0.cad(path, how)
    }
}

/// The region at `path`, which may name faces of `part`; its warnings and repairs are added to `notes`.
pub(crate) fn region(
    kind: &RegionKind,
    path: &str,
    loader: &dyn Loader,
    part: Option<&Region>,
    notes: &RefCell<Notes>,
) -> Result<Region, DesignError> {
    let notes = &mut notes.borrow_mut();
    kind.build(&mut Context::new(path, &RegionFiles(loader), part, notes)).map_err(|f| DesignError::fault(path, f))
}

/// The half-space at `path`.
pub(crate) fn half_space(kind: &HalfSpaceKind, path: &str) -> Result<HalfSpace, DesignError> {
    kind.made().map_err(|f| DesignError::fault(path, f))
}

/// The extension of a file's name, in lower case.
pub(crate) fn extension(path: &str) -> String {
    path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase()
}
