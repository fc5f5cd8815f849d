//! Maps, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{ControlSpec, FieldSpec, GradeSpec, OneOrThree, OneOrTwo, RegionKind, Unit, is_default};

/// Position (mm) to phase (turns).
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MapSpec {
    /// A rigid rotation of the scaled lattice: u = D Rᵀ (x − offset), D = diag(1/wavelength).
    Affine(AffineSpec),
    /// The SPARTAN reading, scaled first and rotated in phase: u = Rᵀ D (x − offset).
    Spartan(SpartanSpec),
    /// Solved so that cells turn and stretch as asked for without tearing: ∇Φᵢ = R eᵢ / λᵢ in least squares.
    Phase(Box<PhaseSpec>),
    /// Wrapped round an axis: cells along the radius, round the axis, along the axis.
    Cylinder(CylinderMapSpec),
    /// Wrapped about a centre: cells along the radius, round the axis, from pole to pole.
    Sphere(SphereMapSpec),
    /// Along a line through control points: cells across it and along it, in a frame that does not rotate about it.
    Sweep(SweepSpec),
    /// Piecewise affine over a tetrahedral mesh of the region: a cell in each tetrahedron.
    Tets(TetsSpec),
}

/// A tetrahedral mesh of the region: made, or from a file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TetsSpec {
    /// Made to a size.
    Made(MadeTetsSpec),
    /// From a file.
    File(TetFileSpec),
}

/// A tetrahedral mesh that is made.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MadeTetsSpec {
    /// Edge of a regular tetrahedron (mm) of the volume that tetrahedra are to have.
    pub size: GradeSpec,
    /// What makes it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mesher: MesherSpec,
    /// How long another mesher than the background one may take (s).
    #[serde(default = "limit", skip_serializing_if = "is_limit")]
    pub limit: f64,
    /// Regions whose tetrahedra, by their middles, are of a zone of this number, such as `{ 1 = { sphere = { radius = 5 } } }`;
    /// the first of several counts, and all others are of zone 0.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub zones: BTreeMap<String, RegionKind>,
    /// How cells are joined.
    #[serde(flatten)]
    pub joined: Joined,
}

/// What makes a tetrahedral mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MesherSpec {
    /// A body-centred cubic lattice fitted to the region: nodes moved onto its surface, the rest cut. Takes any region.
    #[default]
    Background,
    /// fTetWild (Hu et al. 2020), which takes soups of triangles; in the extra "tets" of the Python package.
    FTetWild,
}

/// A tetrahedral mesh in a file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TetFileSpec {
    /// Path of the file, relative to the design file: vtu, vtk; with the extra "fe" of the Python package also msh, inp, med,
    /// mesh and others.
    pub path: String,
    /// Unit of the file's coordinates (mm unless given).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Whether hexahedra, wedges and pyramids are cut into tetrahedra that fit face to face; refused otherwise.
    #[serde(default, skip_serializing_if = "is_default")]
    pub split: bool,
    /// How cells are joined.
    #[serde(flatten)]
    pub joined: Joined,
}

/// How the cells of tetrahedra are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Joined {
    /// Smooths the creases at the faces of tetrahedra: by how much of their barycentric coordinates they reach beyond
    /// themselves and are mixed with their neighbours, from 0 (creases) to 0.2.
    #[serde(default, skip_serializing_if = "is_default")]
    pub overlap: f64,
    /// How the surface is made.
    #[serde(default, skip_serializing_if = "is_default")]
    pub method: Method,
}

/// How the surface of a tetrahedral lattice is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// In each tetrahedron apart, without a grid, where nothing else is in the part: no skin, keep zones or overlap.
    #[default]
    Explicit,
    /// On a grid over the part, like other lattices.
    Implicit,
}

fn one() -> f64 {
    1.0
}

fn is_one(v: &f64) -> bool {
    *v == 1.0
}

fn limit() -> f64 {
    600.0
}

fn is_limit(v: &f64) -> bool {
    *v == limit()
}

/// A rigid rotation of the scaled lattice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AffineSpec {
    /// Cell edge (mm), one or three.
    pub wavelength: OneOrThree,
    /// Angles about x, y, z (degrees): z is turned first, then y, then x.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotate: [f64; 3],
    /// Moves the lattice (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset: [f64; 3],
    /// Shears.
    #[serde(default, skip_serializing_if = "is_default")]
    pub skew: SkewSpec,
}

/// Shears in degrees: `xz = 20` moves x by tan(20°) · z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkewSpec {
    /// x by tan · y.
    #[serde(default, skip_serializing_if = "is_default")]
    pub xy: f64,
    /// x by tan · z.
    #[serde(default, skip_serializing_if = "is_default")]
    pub xz: f64,
    /// y by tan · x.
    #[serde(default, skip_serializing_if = "is_default")]
    pub yx: f64,
    /// y by tan · z.
    #[serde(default, skip_serializing_if = "is_default")]
    pub yz: f64,
    /// z by tan · x.
    #[serde(default, skip_serializing_if = "is_default")]
    pub zx: f64,
    /// z by tan · y.
    #[serde(default, skip_serializing_if = "is_default")]
    pub zy: f64,
}

impl SkewSpec {
    /// The six shears by name.
    pub fn named(&self) -> [(&'static str, f64); 6] {
        let s = self;
        [("xy", s.xy), ("xz", s.xz), ("yx", s.yx), ("yz", s.yz), ("zx", s.zx), ("zy", s.zy)]
    }
}

/// The SPARTAN reading: scaled first, rotated in phase.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpartanSpec {
    /// Wavelength (mm), one or three.
    pub wavelength: OneOrThree,
    /// Angles about x, y, z (degrees).
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotate: [f64; 3],
    /// Moves the lattice (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset: [f64; 3],
}

/// A solved map. At most one of rotate (or rotate_x, rotate_y, rotate_z), direction, frame, stress; without, cells are not
/// turned.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseSpec {
    /// Cell edge (mm), one or three; each may vary.
    pub wavelength: GradeOrThree,
    /// Angles about x, y, z (degrees): z is turned first, then y, then x. Each may vary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<[GradeSpec; 3]>,
    /// The angle about x alone (degrees), in addition to or in place of `rotate_y` and `rotate_z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_x: Option<GradeSpec>,
    /// The angle about y alone (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_y: Option<GradeSpec>,
    /// The angle about z alone (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_z: Option<GradeSpec>,
    /// The cell's z axis lies along this vector; its sign and length do not matter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<VectorSpec>,
    /// The directions of the cell's x and z axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<FrameSpec>,
    /// The cell's axes lie along the principal directions of a stress tensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<TensorSpec>,
    /// How much it matters that cells are as they are asked for, compared with other places (0 or more): where no map can
    /// follow everything, the error goes where this is small.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<GradeSpec>,
    /// What an error of angle counts, for the same error of spacing: where no map can follow both, above 1 cells are nearer to
    /// their directions, below 1 to their sizes. From 0.001 to 1000.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub angle_weight: f64,
    /// Moves the lattice (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset: [f64; 3],
    /// Spacing (mm) of the grid that the phases are solved on; a quarter of the least wavelength unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// What counts when the phases are solved.
    #[serde(default, skip_serializing_if = "is_default")]
    pub domain: Domain,
    /// Whether the map may fold, where cells turn inside out.
    #[serde(default, skip_serializing_if = "is_default")]
    pub folds: bool,
}

/// Cells round an axis, a whole number of them, so that the lattice closes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderMapSpec {
    /// Cell edge (mm) along the radius and along the axis, one or two.
    pub wavelength: OneOrTwo,
    /// Cells around.
    pub around: f64,
    /// A point on the axis (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub center: [f64; 3],
    /// Direction of the axis.
    #[serde(default = "super::build_axis", skip_serializing_if = "super::is_build_axis")]
    pub axis: [f64; 3],
}

/// Shells of cells about a centre, a whole number of them round the equator and half as many from pole to pole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereMapSpec {
    /// Cell edge (mm) along the radius.
    pub wavelength: f64,
    /// Cells round the equator; an even number.
    pub around: f64,
    /// The centre (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub center: [f64; 3],
    /// Direction from pole to pole.
    #[serde(default = "super::build_axis", skip_serializing_if = "super::is_build_axis")]
    pub axis: [f64; 3],
}

/// Cells along a line: a cubic spline through control points, straight on beyond the ends of an open one.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepSpec {
    /// Cell edge (mm), one or three: two across the line and one along it. Along a closed line it is made to fit.
    pub wavelength: OneOrThree,
    /// The control points (mm).
    #[serde(flatten)]
    pub points: ControlSpec,
    /// Whether the last point is followed by the first.
    #[serde(default, skip_serializing_if = "is_default")]
    pub closed: bool,
    /// Which way the first edge points at the start, but for what it has along the line; chosen if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
}

/// A number that may vary, or three of them.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum GradeOrThree {
    /// The same along all three axes.
    One(GradeSpec),
    /// Along the cell's x, y, z.
    Three(Box<[GradeSpec; 3]>),
}

/// A vector that may vary.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum VectorSpec {
    /// By its components along x, y, z.
    Components(Box<[GradeSpec; 3]>),
    /// An array of three numbers of a result.
    Field(VectorField),
}

/// An array of three numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VectorField {
    /// The array.
    pub field: FieldSpec,
}

/// Two of the cell's axes; the third is at right angles to both.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameSpec {
    /// Direction of the cell's x axis; what it has along z is left out.
    pub x: VectorSpec,
    /// Direction of the cell's z axis.
    pub z: VectorSpec,
}

/// A symmetric tensor that may vary.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TensorSpec {
    /// By its components 11, 22, 33, 23, 13, 12.
    Components(Box<[GradeSpec; 6]>),
    /// An array of six or nine numbers of a result.
    Field(TensorField),
}

/// An array of six or nine numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TensorField {
    /// The array.
    pub field: FieldSpec,
    /// In which order six numbers come.
    #[serde(default, skip_serializing_if = "is_default")]
    pub order: TensorOrder,
}

/// In which order the six numbers of a symmetric tensor come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TensorOrder {
    /// 11, 22, 33, 12, 23, 13, as VTK has them.
    #[default]
    Vtk,
    /// 11, 22, 33, 23, 13, 12, as Voigt has them.
    Voigt,
}

/// What counts when phases are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Domain {
    /// The region; its surroundings within its bounds as little as possible.
    #[default]
    Region,
    /// All of the region's bounds alike.
    Box,
}
