//! Figures of a design, without meshing it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{BeamsReport, TilingReport, Varying};
use crate::kind::Warning;
use crate::map::{Distortion, Period};
use crate::mesher::FitReport;

/// The figures of a design, without meshing it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DesignReport {
    /// The lattices by name.
    pub lattices: BTreeMap<String, LatticeReport>,
    /// The graphs and patterns of beams by name.
    pub beams: BTreeMap<String, BeamsReport>,
    /// The region.
    pub region: RegionReport,
    /// Grid spacing of a mesh unless another is asked for, mm: the smallest wavelength / 32, or less for what is finer: 1/24 of
    /// a cell's finest wave (down to a wavelength / 128), half the thinnest wall or neck, a sixth of the thinnest beam, the skin
    /// (down to a wavelength / 64). More than 20 million triangles are made with a coarser one.
    pub spacing: f64,
    /// Chord error of a mesh of whole beams unless another resolution is asked for, mm: a fiftieth of the radius of the thinnest.
    /// None for what is meshed on a grid.
    pub chord: Option<f64>,
    /// Possible mistakes in the design.
    pub warnings: Vec<Warning>,
    /// The blend of its lattices, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blend: Option<BlendReport>,
}

/// A lattice: a number, or [least, greatest] over the region where it varies.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LatticeReport {
    /// sheet (|f| ≤ t), lower (f ≤ t) or upper (f ≥ t).
    pub part: &'static str,
    /// The smallest wavelength, mm.
    pub wavelength: f64,
    /// The least and the greatest wavelength over the region, mm, where a solved map is asked for one that varies; of unequal edges,
    /// the smallest. None elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wavelengths: Option<[f64; 2]>,
    /// The level t. Where the thickness is given: the constant level of equal fraction. None for cells by zones.
    pub iso: Option<Varying>,
    /// Solid fraction of the cell, 0 to 1.
    pub fraction: Varying,
    /// 1 − fraction.
    pub porosity: Varying,
    /// Minimum wall (sheet) or narrowest neck diameter (lower, upper), mm; None where there is none.
    pub thickness: Option<Varying>,
    /// Diameter of the largest ball that passes through the void from cell to cell, mm; of a sheet the lesser of its two sides. Zero
    /// where the void is closed.
    pub pore: Option<Varying>,
    /// Of a sheet: the same of the void f < 0 and of the void f > 0, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pore_sides: Option<[Varying; 2]>,
    /// The stiffness or permeability that the level was solved for. None for other levels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub property: Option<PropertyReport>,
    /// The thickness beyond which a wall of given thickness folds, mm; None for other levels.
    pub folding: Option<f64>,
    /// Intervals of the fraction in which the periodic solid is one connected component.
    pub connected_fraction: Vec<[f64; 2]>,
    /// Root mean square share of a cell from a file that the kept terms leave out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncation: Option<f64>,
    /// Deviation of a solved map from the orientation and wavelength asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    /// Lines round which the axes that a solved map is asked for do not come back to themselves, at least half a wavelength long, the
    /// longest first. None without a solved map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub singular: Option<Vec<SingularLineReport>>,
    /// Cells round the holes of the region, empty where the phases of a solved map have one value. None without a solved map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub periods: Option<Vec<Period>>,
    /// How the tetrahedra of a lattice fit the region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<FitReport>,
    /// The tetrahedral mesh of a lattice over tetrahedra, and the cells in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tets: Option<TilingReport>,
}

/// A property of the cell that a level was solved for.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct PropertyReport {
    /// stiffness: Young's modulus of the cell over that of the solid; permeability, mm².
    pub name: &'static str,
    /// What it is at the fraction found, extrapolated to infinitely many voxels; where it varies, what it was interpolated for.
    pub value: Varying,
    /// Estimated relative error of that: the change from n voxels to infinitely many; where it varies, the greatest.
    pub error: f64,
    /// Voxels along the edge of the cell, or of a cube of its volume.
    pub n: usize,
}

/// The region of a design.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RegionReport {
    /// Lower and upper corner of its bounds, mm.
    pub bounds: [[f64; 3]; 2],
    /// Volume of what the lattice fills, mm³: the region's, or of what it has in common with tetrahedra that are no mesh of it.
    pub volume: f64,
    /// Whether that is the region's exact volume: not where it is estimated at points, or tetrahedra have only a part of it.
    pub volume_exact: bool,
    /// Volume of the region as described, mm³, of a lattice over tetrahedra; else None.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub described_volume: Option<f64>,
    /// Files of CAD systems that the region is made of, as triangles; None if it is made of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tessellated: Option<Vec<TessellationReport>>,
}

/// A file of a CAD system as triangles.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TessellationReport {
    /// The file.
    pub path: String,
    /// Greatest distance between faces and triangles that was asked for, mm.
    pub chord: f64,
    /// Greatest angle between the normals of a face within a triangle, degrees.
    pub angle: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of faces.
    pub faces: usize,
    /// Volume within the exact faces, mm³; None where the file holds faces alone, which were sewn.
    pub volume: Option<f64>,
    /// Relative error of the triangles' volume: of first order in the chord error on curved faces.
    pub volume_error: Option<f64>,
}

/// A blend of lattices.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BlendReport {
    /// Names of its lattices, in the order of their weights.
    pub lattices: Vec<String>,
    /// fraction or value: what is interpolated.
    pub by: &'static str,
    /// locked, independent or drifting: how the phases of its lattices go together. None for by = value.
    pub phases: Option<&'static str>,
    /// Width of the narrowest transition, mm.
    pub width: Option<f64>,
    /// The radial basis functions among its weights.
    pub rbf: Vec<RbfReport>,
}

/// Radial basis functions.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RbfReport {
    /// Path of their key in the design.
    pub path: String,
    /// Number of control points.
    pub points: usize,
    /// Width δ of the functions, mm.
    pub delta: f64,
    /// Condition number of their equations.
    pub condition: f64,
}

/// A line round which the wanted axes of a solved map do not come back to themselves: no lattice is without a flaw there, and a core covers
/// it if the map has one.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SingularLineReport {
    /// Points along it from end to end, mm, to a step of the map's grid; the first comes again at the end where it is closed. Lines
    /// that meet are lines of their own.
    pub points: Vec<[f64; 3]>,
    /// Its length within the region, mm, to about a tenth.
    pub length: f64,
    /// By what the axes are turned once round it, degrees.
    pub turn: f64,
    /// What covers it, "solid" or "void"; null where nothing does.
    pub core: Option<&'static str>,
    /// How far that reaches from the line, mm; null where nothing does.
    pub core_radius: Option<f64>,
}

/// The transition between two lattices of a blend: the lattices alone, without skin and keep zones.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TransitionReport {
    /// Names of the two lattices.
    pub between: [String; 2],
    /// Volume in which both have a weight, mm³.
    pub volume: f64,
    /// Connected components of the solid that reach into it; 1 where it holds together.
    pub pieces: usize,
    /// Whether the thinnest wall, neck or beam of the lattices is two steps thick: else it may seem broken, and components more.
    pub resolved: bool,
    /// Components that touch neither side.
    pub loose: LooseBodies,
    /// Components attached by necks under half the narrowest neck of the widest path across.
    pub dangling: LooseBodies,
    /// The narrowest neck of the widest path from one lattice to the other; None where they are not connected.
    pub neck: Option<NarrowestNeck>,
    /// Where the first lattice's solid ends if no path leads to the second's, mm; None where one does, or the grid cannot tell.
    pub gap: Option<[f64; 3]>,
    /// Solid fraction along the transition, by tenths of the second lattice's share.
    pub fractions: Vec<FractionAlong>,
    /// Distance between sample points, mm.
    pub step: f64,
}

/// Connected components that hold to little or nothing.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct LooseBodies {
    /// Their number.
    pub bodies: usize,
    /// Their volume, mm³.
    pub volume: f64,
}

/// The narrowest place of the widest path across a transition.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct NarrowestNeck {
    /// Diameter, mm, to within one step.
    pub diameter: f64,
    /// Position, mm.
    pub place: [f64; 3],
}

/// Solid fraction in windows of two cells, at one share of the second lattice.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct FractionAlong {
    /// Share of the second lattice, 0 to 1.
    pub share: f64,
    /// Fraction asked for; None where it is not known.
    pub asked: Option<f64>,
    /// Fraction found.
    pub found: f64,
}
