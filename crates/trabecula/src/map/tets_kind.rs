//! The map over a tetrahedral mesh, as it is declared.

use std::collections::BTreeMap;

use super::{BuildMap, Map};
use crate::environment::Environment;
use crate::grade::GradeSpec;
use crate::kind::{DesignError, Kind, Unit};
use crate::region::RegionKind;

/// Piecewise affine over a tetrahedral mesh of the region, made or from a file: a cell in each tetrahedron.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Tets", noun = "a map over tetrahedra", alternatives)]
pub enum TetsKind {
    /// Made to a size.
    Made(MadeTetsKind),
    /// From a file.
    File(TetFileKind),
}

/// A tetrahedral mesh that is made.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct MadeTetsKind {
    /// Edge of a regular tetrahedron of the greatest volume that tetrahedra have, a number or a grade.
    #[kind(unit = "mm", above = 0.0)]
    pub size: GradeSpec,
    /// The program that makes it.
    #[kind(default)]
    pub mesher: MesherKind,
    /// Time that another mesher than the background one may take.
    #[kind(unit = "s", above = 0.0, default = 600.0)]
    pub limit: f64,
    /// Regions whose tetrahedra, by their middles, are of a zone of this number, such as `{ 1 = { sphere = { radius = 5 } } }`;
    /// the first of several counts, and all others are of zone 0.
    #[kind(default, keyword)]
    pub zones: BTreeMap<u32, RegionKind>,
    /// Layers of prisms along the part's surface, each prism cut into three tetrahedra.
    pub layers: Option<Box<LayersSpec>>,
    /// How cells are joined.
    #[kind(flatten)]
    pub joined: CellJoin,
}

/// Layers of prisms along a part's surface.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct LayersSpec {
    /// Number of layers.
    #[kind(min = 1.0, max = 100.0)]
    pub count: u32,
    /// Height of the outermost.
    #[kind(unit = "mm", above = 0.0)]
    pub height: f64,
    /// Height of each over that of the one outside it.
    #[kind(min = 0.2, max = 5.0, default = 1.0)]
    pub growth: f64,
    /// Where they are: on triangles of the boundary whose middles are in this region; everywhere unless given.
    pub on: Option<RegionKind>,
}

/// The program that makes a tetrahedral mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Mesher", noun = "mesher")]
pub enum MesherKind {
    /// A body-centred cubic lattice cut along the surfaces of the region, of meshes along the patches between feature edges. Takes any region.
    #[default]
    #[kind(hints("stuffing"))]
    Background,
    /// fTetWild (Hu et al. 2020), which takes soups of triangles; in the extra "tets" of the Python package.
    #[kind(hints("wildmeshing", "tetwild"))]
    FTetWild,
}

/// A tetrahedral mesh in a file.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct TetFileKind {
    /// Path of the file, relative to the design file: vtu, vtk; with the extra "fe" of the Python package also msh, inp, med,
    /// mesh and others.
    #[kind(keyword)]
    pub path: String,
    /// Unit of the file's coordinates (mm unless given).
    pub unit: Option<Unit>,
    /// Whether hexahedra, wedges and pyramids are cut into tetrahedra that fit face to face; refused otherwise.
    #[kind(default = false)]
    pub split: bool,
    /// How cells are joined.
    #[kind(flatten)]
    pub joined: CellJoin,
}

/// How the cells of tetrahedra are joined.
#[derive(Clone, Debug, Default, PartialEq, Kind)]
pub struct CellJoin {
    /// Smooths the creases at the faces of tetrahedra: by how much of their barycentric coordinates they reach beyond
    /// themselves and are mixed with their neighbours, from 0 (creases) to 0.2.
    #[kind(default = 0.0, min = 0.0, max = 0.2)]
    pub overlap: f64,
    /// How the surface is made.
    #[kind(default)]
    pub method: Method,
    /// How the lattice ends at the part's surface.
    #[kind(default)]
    pub surface: SurfaceEnds,
    /// The net of surface = "net".
    pub net: Option<Box<NetSpec>>,
}

/// How a lattice over tetrahedra ends at the part's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Ends", noun = "end at the surface")]
pub enum SurfaceEnds {
    /// Closed where the surface cuts it, by caps that lie on the surface.
    #[default]
    #[kind(hints("flat", "closed"))]
    Capped,
    /// As capped, but files of meshes have no caps: the lattice's surface alone, to be joined to others.
    Open,
    /// Tied by a net of rods on the surface, from port to port.
    #[kind(hints("tied", "web", "mesh"))]
    Net,
    /// Rounded: struts end in half balls, walls nearly in half circles.
    #[kind(hints("round", "balls"))]
    Rounded,
}

impl SurfaceEnds {
    /// Its word.
    pub fn word(self) -> &'static str {
        ["capped", "open", "net", "rounded"][self as usize]
    }
}

/// A net on the part's surface that ties the ports of a lattice.
#[derive(Clone, Debug, Default, PartialEq, Kind)]
pub struct NetSpec {
    /// Radius of its rods, whose middles are on the surface, so that half of each is in the part; less where tetrahedra are so small that
    /// it would close the openings. Of the area of the ports there, from place to place, unless given.
    #[kind(unit = "mm", above = 0.0)]
    pub radius: Option<f64>,
    /// The widest opening that it may have, of which a warning says if one is wider.
    #[kind(unit = "mm", above = 0.0)]
    pub opening: Option<f64>,
    /// Where it is: on triangles of the boundary whose middles are in this region; everywhere unless given.
    pub on: Option<RegionKind>,
}

/// How the surface of a tetrahedral lattice is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "method")]
pub enum Method {
    /// In each tetrahedron apart, without a grid, where nothing else is in the part: no skin, keep zones, net or rounded ends.
    #[default]
    Explicit,
    /// On a grid over the part, like other lattices.
    Implicit,
}

impl BuildMap for TetsKind {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        let message = "a map over tetrahedra goes with a tetrahedral cell ([lattice.NAME.cell.tet]); other cells do not fit \
                       face to face";
        Err(DesignError::new(path, message))
    }
}
