//! Maps, as data.

use std::collections::BTreeMap;

use super::super::map::BuildMap;
use super::{ControlPoints, FieldKind, GradeSpec, RegionKind};
use crate::kind::{At, DesignError, Fault, Key, Kind, OneOrThree, OneOrTwo, Unit, Value};

/// Position (mm) to phase (turns).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Map", noun = "map", family = BuildMap)]
#[allow(missing_docs)] // The comment of each type says what it is.
pub enum MapSpec {
    Affine(AffineSpec),
    Spartan(SpartanSpec),
    Phase(Box<PhaseSpec>),
    Cylinder(CylinderMapSpec),
    Sphere(SphereMapSpec),
    Sweep(SweepSpec),
    Tets(TetsSpec),
}

/// A rigid rotation of the scaled lattice: u = D Rᵀ (x − offset), D = diag(1/wavelength).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Affine", noun = "an affine map", before = uniform)]
pub struct AffineSpec {
    /// Cell edge, one number or three.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: OneOrThree,
    /// Angles about x, y, z: z is turned first, then y, then x.
    #[kind(unit = "degrees", default = [0.0; 3])]
    pub rotate: [f64; 3],
    /// Moves the lattice.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub offset: [f64; 3],
    /// Shears.
    #[kind(default)]
    pub skew: SkewSpec,
}

/// Explains that numbers of this map are constant.
fn uniform(at: &At) -> Result<(), DesignError> {
    let message = "this map is the same everywhere; map.phase takes a wavelength and an orientation that vary";
    let keys = ["wavelength", "rotate", "offset"];
    at.entries("a map").iter().flatten().filter(|e| keys.contains(&e.0)).try_for_each(|(_, at)| constant(at, message))
}

/// Shears: `xz = 20` moves x by tan(20°) · z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Kind)]
#[kind(name = "Skew", noun = "shears in degrees")]
pub struct SkewSpec {
    /// x by tan · y.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub xy: f64,
    /// x by tan · z.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub xz: f64,
    /// y by tan · x.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub yx: f64,
    /// y by tan · z.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub yz: f64,
    /// z by tan · x.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub zx: f64,
    /// z by tan · y.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    pub zy: f64,
}

impl SkewSpec {
    /// The shears that are not zero: (of, by, degrees).
    pub fn shears(&self) -> Vec<(usize, usize, f64)> {
        let s = self;
        let all = [(0, 1, s.xy), (0, 2, s.xz), (1, 0, s.yx), (1, 2, s.yz), (2, 0, s.zx), (2, 1, s.zy)];
        all.into_iter().filter(|s| s.2 != 0.0).collect()
    }
}

/// The SPARTAN reading, scaled first and rotated in phase: u = Rᵀ D (x − offset).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Spartan", noun = "a spartan map", before = uniform)]
pub struct SpartanSpec {
    /// Wavelength, one number or three.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: OneOrThree,
    /// Angles about x, y, z.
    #[kind(unit = "degrees", default = [0.0; 3])]
    pub rotate: [f64; 3],
    /// Moves the lattice.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub offset: [f64; 3],
}

/// Solved so that cells turn and stretch as asked for without tearing: ∇Φᵢ = R eᵢ / λᵢ in least squares. At most one of
/// rotate (or rotate_x, rotate_y, rotate_z), direction, frame, stress; without, cells are not turned.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Phase", noun = "a phase map")]
pub struct PhaseSpec {
    /// Cell edge, one number or three; each may vary.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: GradeOrThree,
    /// How cells are turned.
    #[kind(flatten)]
    pub orientation: OrientationSpec,
    /// Weight of the cell's shape here, compared with other positions (0 or more): where no map can follow everything, the error
    /// goes where this is small.
    #[kind(keyword)]
    pub weight: Option<GradeSpec>,
    /// Weight of an error of angle against the same error of spacing: where no map can follow both, above 1 cells are nearer to
    /// their directions, below 1 to their sizes.
    #[kind(default = 1.0, min = 0.001, max = 1000.0)]
    pub angle_weight: f64,
    /// Moves the lattice.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub offset: [f64; 3],
    /// Spacing of the grid that the phases are solved on; a quarter of the least wavelength unless given.
    #[kind(unit = "mm", above = 0.0)]
    pub step: Option<f64>,
    /// What counts when the phases are solved.
    #[kind(default)]
    pub domain: Domain,
    /// Whether the map may fold, where cells turn inside out.
    #[kind(default = false)]
    pub folds: bool,
}

/// How the cells of a phase map are turned.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "an orientation", alternatives)]
pub enum OrientationSpec {
    /// By one angle or several.
    Axes(AxesSpec),
    /// By three angles.
    Rotate(RotateSpec),
    /// By a vector.
    Direction(DirectionSpec),
    /// By two vectors.
    Frame(FrameAlone),
    /// By a tensor.
    Stress(StressSpec),
}

impl Default for OrientationSpec {
    fn default() -> Self {
        OrientationSpec::Axes(AxesSpec { rotate_x: None, rotate_y: None, rotate_z: None })
    }
}

/// Turned about each axis.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct AxesSpec {
    /// The angle about x alone, in addition to or in place of `rotate_y` and `rotate_z`.
    #[kind(unit = "degrees", keyword)]
    pub rotate_x: Option<GradeSpec>,
    /// The angle about y alone.
    #[kind(unit = "degrees")]
    pub rotate_y: Option<GradeSpec>,
    /// The angle about z alone.
    #[kind(unit = "degrees")]
    pub rotate_z: Option<GradeSpec>,
}

/// Turned by three angles.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct RotateSpec {
    /// Angles about x, y, z: z is turned first, then y, then x. Each may vary.
    #[kind(unit = "degrees")]
    pub rotate: [GradeSpec; 3],
}

/// Turned to a direction.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct DirectionSpec {
    /// Direction of the cell's z axis; its sign and length do not matter.
    #[kind(keyword)]
    pub direction: VectorSpec,
}

/// Turned to two directions.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct FrameAlone {
    /// The directions of the cell's x and z axes.
    #[kind(keyword)]
    pub frame: FrameSpec,
}

/// Turned to the principal directions of a tensor.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct StressSpec {
    /// A stress tensor whose principal directions the cell's axes take.
    #[kind(keyword)]
    pub stress: TensorSpec,
}

/// A number that may vary, or three of them.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum GradeOrThree {
    /// The same along all three axes.
    One(GradeSpec),
    /// Along the cell's x, y, z.
    Three(Box<[GradeSpec; 3]>),
}

/// A vector that may vary.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "three numbers [x, y, z], each of which may vary, or the field of a result")]
pub enum VectorSpec {
    /// By its components along x, y, z.
    Components(Box<[GradeSpec; 3]>),
    /// An array of three numbers of a result.
    Field(VectorField),
}

/// An array of three numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a vector")]
pub struct VectorField {
    /// An array of three components of a result.
    pub field: FieldKind,
}

/// Two of the cell's axes; the third is at right angles to both.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Frame", noun = "a frame")]
pub struct FrameSpec {
    /// Direction of the cell's x axis; its component along z is left out.
    pub x: VectorSpec,
    /// Direction of the cell's z axis.
    pub z: VectorSpec,
}

/// A symmetric tensor that may vary.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "six numbers [11, 22, 33, 23, 13, 12], each of which may vary, or the field of a result")]
pub enum TensorSpec {
    /// By its components 11, 22, 33, 23, 13, 12.
    Components(Box<[GradeSpec; 6]>),
    /// An array of six or nine numbers of a result.
    Field(TensorField),
}

/// An array of six or nine numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a tensor")]
pub struct TensorField {
    /// An array of six or nine components of a result.
    pub field: FieldKind,
    /// The order of six components.
    #[kind(default)]
    pub order: TensorOrder,
}

/// The order of the six components of a symmetric tensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "order")]
pub enum TensorOrder {
    /// 11, 22, 33, 12, 23, 13, as in VTK.
    #[default]
    Vtk,
    /// 11, 22, 33, 23, 13, 12, as in Voigt's notation.
    Voigt,
}

/// What counts when phases are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "domain")]
pub enum Domain {
    /// The region; its surroundings within its bounds as little as possible.
    #[default]
    Region,
    /// All of the region's bounds alike.
    Box,
}

/// Wrapped round an axis, a whole number of cells, so that the lattice closes: u = (r/λ, around · θ/2π, z/λ).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "CylinderMap", noun = "a map round an axis")]
pub struct CylinderMapSpec {
    /// Cell edge along the radius and along the axis, one number or two.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: OneOrTwo,
    /// Number of cells around.
    #[kind(min = 1.0, max = 1e6)]
    pub around: u32,
    /// A point on the axis.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub center: [f64; 3],
    /// Direction of the axis.
    #[kind(default = [0.0, 0.0, 1.0])]
    pub axis: [f64; 3],
}

/// Wrapped about a centre in shells, a whole number of cells round the equator and half as many from pole to pole.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "SphereMap", noun = "a map about a centre", check = SphereMapSpec::even)]
pub struct SphereMapSpec {
    /// Cell edge along the radius.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: f64,
    /// Number of cells round the equator, even.
    #[kind(min = 2.0, max = 1e6)]
    pub around: u32,
    /// The centre.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub center: [f64; 3],
    /// Direction from pole to pole.
    #[kind(default = [0.0, 0.0, 1.0])]
    pub axis: [f64; 3],
}

impl SphereMapSpec {
    fn even(&self, _: &Key) -> Result<(), Fault> {
        match self.around % 2 {
            0 => Ok(()),
            _ => Err(Fault::new("around", format!("around is {}; it must be an even number", self.around))
                .found(self.around.to_string())),
        }
    }
}

/// Along a line, in a frame that does not rotate about it: a cubic spline through control points, straight on beyond the ends
/// of an open one; u = (a/λ₁, b/λ₂, s/λ₃), a and b across it, s along it.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Sweep", noun = "a map along a line")]
pub struct SweepSpec {
    /// Cell edge, one number or three: two across the line and one along it. Along a closed line it is made to fit.
    #[kind(unit = "mm", above = 0.0)]
    pub wavelength: OneOrThree,
    /// The control points.
    #[kind(flatten)]
    pub points: ControlPoints,
    /// Whether the last point is followed by the first.
    #[kind(default = false)]
    pub closed: bool,
    /// Direction of the cell's x axis at the start, up to its component along the line; chosen if not given.
    pub normal: Option<[f64; 3]>,
}

/// Piecewise affine over a tetrahedral mesh of the region, made or from a file: a cell in each tetrahedron.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Tets", noun = "a map over tetrahedra", alternatives)]
pub enum TetsSpec {
    /// Made to a size.
    Made(MadeTetsSpec),
    /// From a file.
    File(TetFileSpec),
}

/// A tetrahedral mesh that is made.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct MadeTetsSpec {
    /// Edge of a regular tetrahedron of the volume that tetrahedra are to have, a number or a grade.
    #[kind(unit = "mm", above = 0.0)]
    pub size: GradeSpec,
    /// The program that makes it.
    #[kind(default)]
    pub mesher: MesherSpec,
    /// Time that another mesher than the background one may take.
    #[kind(unit = "s", above = 0.0, default = 600.0)]
    pub limit: f64,
    /// Regions whose tetrahedra, by their middles, are of a zone of this number, such as `{ 1 = { sphere = { radius = 5 } } }`;
    /// the first of several counts, and all others are of zone 0.
    #[kind(default, keyword)]
    pub zones: BTreeMap<u32, RegionKind>,
    /// How cells are joined.
    #[kind(flatten)]
    pub joined: Joined,
}

/// The program that makes a tetrahedral mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Mesher", noun = "mesher")]
pub enum MesherSpec {
    /// A body-centred cubic lattice fitted to the region: nodes moved onto its surface, the rest cut. Takes any region.
    #[default]
    #[kind(hints("stuffing"))]
    Background,
    /// fTetWild (Hu et al. 2020), which takes soups of triangles; in the extra "tets" of the Python package.
    #[kind(hints("wildmeshing", "tetwild"))]
    FTetWild,
}

/// A tetrahedral mesh in a file.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct TetFileSpec {
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
    pub joined: Joined,
}

/// How the cells of tetrahedra are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Kind)]
pub struct Joined {
    /// Smooths the creases at the faces of tetrahedra: by how much of their barycentric coordinates they reach beyond
    /// themselves and are mixed with their neighbours, from 0 (creases) to 0.2.
    #[kind(default = 0.0, min = 0.0, max = 0.2)]
    pub overlap: f64,
    /// How the surface is made.
    #[kind(default)]
    pub method: Method,
}

/// How the surface of a tetrahedral lattice is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "method")]
pub enum Method {
    /// In each tetrahedron apart, without a grid, where nothing else is in the part: no skin, keep zones or overlap.
    #[default]
    Explicit,
    /// On a grid over the part, like other lattices.
    Implicit,
}

/// A value that is one number: what may not vary says so.
fn constant(at: &At, message: &str) -> Result<(), DesignError> {
    let varies = |at: &At| matches!(at.node.value, Value::Table(_));
    match at.is_list() {
        true => at.list("")?.iter().find(|i| varies(i)).map_or(Ok(()), |i| Err(i.error(message))),
        false if varies(at) => Err(at.error(message)),
        false => Ok(()),
    }
}
