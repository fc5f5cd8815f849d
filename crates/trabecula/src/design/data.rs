//! The data of a design, as it stands in a file. A kind is the name of a table, or a bare word without settings.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::schema;
pub use crate::kind::{OneOrThree, OneOrTwo, Unit};
pub use crate::region::{HalfSpaceKind, MeshFile, RegionKind};

mod beams;
mod blend;
mod grade;
mod map;

pub use beams::*;
pub use blend::*;
pub use grade::*;
pub use map::*;

/// A lattice: a cell seen through a map, cut by a part at a level.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeSpec {
    /// The function on the torus.
    pub cell: CellSpec,
    /// Which side of the level is solid.
    pub part: PartSpec,
    /// Position (mm) to phase (turns).
    pub map: MapSpec,
    /// How much is solid.
    pub level: LevelSpec,
}

/// A cell: the name of a ready one, or a series.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CellSpec {
    /// A named surface.
    Name(#[schemars(schema_with = "schema::cell_name")] String),
    /// Your own function.
    Kind(CellKind),
}

/// A cell with settings.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CellKind {
    /// A Fourier series.
    Series(SeriesSpec),
    /// Numbers or a mesh in a file: the largest waves of their Fourier transform.
    File(FileCellSpec),
    /// A tetrahedral cell, for a map over a tetrahedral mesh.
    Tet(TetCellSpec),
}

/// A tetrahedral cell: a ready one by its name, or what a regular tetrahedron cuts out of the series of a group.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TetCellSpec {
    /// A ready cell; all else is then left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::tet_cell_name")]
    pub name: Option<String>,
    /// A space group with a point of full tetrahedral symmetry: 215, 216, 217, 221, 224, 225, 227 or 229, named as for a series.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::group")]
    pub group: Option<String>,
    /// The terms, each summed over the group.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<TermSpec>,
    /// The tetrahedron's barycentre, in turns: a point of full tetrahedral symmetry; the group's first unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<[f64; 3]>,
    /// The dual tetrahedron, turned upside down.
    #[serde(default, skip_serializing_if = "is_default")]
    pub dual: bool,
    /// Edge of the tetrahedron, in edges of the cubic cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge: Option<f64>,
    /// Instead of all else: a ready cell for each zone of the mesh, by its number, such as `{ 1 = "diamond", 2 = "iwp" }`; in the
    /// tetrahedra between zones they pass into each other.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub zones: BTreeMap<String, String>,
}

/// A cell from a file: numbers at the nodes of one period, without the repeated end, or a mesh of the solid in one cell.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileCellSpec {
    /// Path of the file, relative to the design file: npy, or a closed mesh (stl, 3mf, ply, obj, off), whose bounds are the
    /// cell and whose inside has the value 1, the outside 0.
    pub path: String,
    /// How many waves are kept.
    #[serde(default = "waves", skip_serializing_if = "is_waves")]
    pub terms: f64,
}

fn waves() -> f64 {
    200.0
}

fn is_waves(v: &f64) -> bool {
    *v == waves()
}

/// A Fourier series: the sum of its terms.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeriesSpec {
    /// A space group: then each term stands for the sum of its wave over the group, divided by that sum's largest Fourier
    /// coefficient. By number (227), Hermann–Mauguin symbol ("Fd-3m"), either with a setting ("227:1"; origin choice 2 unless
    /// given), or Hall symbol.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::group")]
    pub group: Option<String>,
    /// The terms.
    pub terms: Vec<TermSpec>,
}

/// amplitude · cos 2π(h·u + phase), u in turns; or the sine. With a group: the same part of amplitude · e^{2πi phase} times
/// the sum of e^{2πi h·u} over the group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermSpec {
    /// Whole numbers (h, k, l).
    pub hkl: [i32; 3],
    /// Amplitude.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub amplitude: f64,
    /// Phase in turns.
    #[serde(default, skip_serializing_if = "is_default")]
    pub phase: f64,
    /// The real part of e^{2πi(h·u + phase)} (a cosine) or its imaginary part (a sine).
    #[serde(default, skip_serializing_if = "is_default")]
    pub component: Component,
}

/// Which part of e^{2πi(h·u + phase)} a term is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Component {
    /// The real part: a cosine.
    #[default]
    Re,
    /// The imaginary part: a sine.
    Im,
}

/// Which side of the level is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PartSpec {
    /// |f| ≤ t.
    Sheet,
    /// f ≤ t.
    Lower,
    /// f ≥ t.
    Upper,
}

/// How much is solid: exactly one amount.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelSpec {
    /// The amount.
    #[serde(flatten)]
    pub amount: AmountSpec,
    /// What a fraction or porosity is of.
    #[serde(default, skip_serializing_if = "is_default")]
    pub of: Of,
    /// How a fraction or porosity becomes a level.
    #[serde(default, skip_serializing_if = "is_default")]
    pub fit: Fit,
    /// The sheet's mid-surface is f = mid: an off-centre sheet, |f − mid| ≤ t or the wall about it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mid: f64,
}

/// An amount of solid.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AmountSpec {
    /// The field value t; for a sheet the half-level.
    Iso(GradeSpec),
    /// Solid volume fraction, between 0 and 1.
    Fraction(GradeSpec),
    /// One minus the solid volume fraction, between 0 and 1.
    Porosity(GradeSpec),
    /// Thickness of a sheet's wall (mm): solid is what lies within half of it of the mid-surface.
    Thickness(GradeSpec),
}

/// What a fraction is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Of {
    /// Of the periodic cell.
    #[default]
    Cell,
    /// Of the finished part, cut cells included (solved for).
    Part,
}

/// How a fraction becomes a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// By the cell's own exact distribution.
    #[default]
    Table,
    /// By the SPARTAN polynomial (diamond as published; gyroid fitted in the same form). Part `lower` only.
    Spartan,
}

/// Named lattices.
pub type Lattices = BTreeMap<String, LatticeSpec>;

/// Named regions that are kept fully solid.
pub type Keeps = BTreeMap<String, RegionKind>;

/// A skin: the part of the region that is at most so far below its surface.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkinSpec {
    /// How far (mm).
    pub thickness: GradeSpec,
    /// Flat faces of the region that it leaves open.
    #[serde(default, skip_serializing_if = "is_default")]
    pub open: Vec<OpenSpec>,
}

/// A flat face of the region that stays open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OpenSpec {
    /// The one on a side of the region's bounds.
    Side(SideSpec),
    /// The one on the plane of a half-space, facing as its normal does.
    Plane(HalfSpaceKind),
}

/// A side of the region's bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub enum SideSpec {
    /// Least x.
    #[serde(rename = "-x")]
    LowX,
    /// Greatest x.
    #[serde(rename = "+x")]
    HighX,
    /// Least y.
    #[serde(rename = "-y")]
    LowY,
    /// Greatest y.
    #[serde(rename = "+y")]
    HighY,
    /// Least z: the bottom.
    #[serde(rename = "-z")]
    LowZ,
    /// Greatest z: the top.
    #[serde(rename = "+z")]
    HighZ,
}

impl SideSpec {
    /// The words and what they mean.
    pub const ALL: [(&'static str, SideSpec); 6] = [
        ("-x", SideSpec::LowX),
        ("+x", SideSpec::HighX),
        ("-y", SideSpec::LowY),
        ("+y", SideSpec::HighY),
        ("-z", SideSpec::LowZ),
        ("+z", SideSpec::HighZ),
    ];

    /// Its axis, and whether it is the upper one.
    pub fn axis(self) -> (usize, bool) {
        let i = Self::ALL.iter().position(|s| s.1 == self).unwrap_or(0);
        (i / 2, i % 2 == 1)
    }
}

fn is_default<T: Default + PartialEq>(v: &T) -> bool {
    *v == T::default()
}

fn one() -> f64 {
    1.0
}

fn is_one(v: &f64) -> bool {
    *v == 1.0
}

fn build_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn is_build_axis(v: &[f64; 3]) -> bool {
    *v == build_axis()
}
