//! Reports: every figure of a design or a mesh, declared once, here or where it is computed. The fields are the
//! keys of the JSON that the command prints and the attributes of the Python classes, whose text is made from their comments
//! (`scripts/report_classes.py`).

mod beams_report;
mod cell_report;
mod design_report;
mod layers_report;
mod mesh_report;
mod tets_report;
mod volume_report;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value as Json;

pub use crate::analysis::{Dangling, Thickness};
pub use crate::surface_maker::Estimate;
pub use beams_report::{BeamsFileReport, BeamsReport, FilletShortfall, GraphReport, PatternReport};
pub use cell_report::{CellGrid, ConductivityReport, PermeabilityReport, StiffnessReport};
pub use design_report::{
    BlendReport, DesignReport, FractionAlong, LatticeReport, LooseBodies, NarrowestNeck, PropertyReport, RbfReport,
    RegionReport, SingularLineReport, TessellationReport, TransitionReport,
};
pub use geometry::formats::part21::StepReport;
pub use geometry::measure::TriangleQuality;
pub use geometry::repair::Repaired;
pub use geometry::simplify::SimplifyReport;
pub use geometry::smooth::SmoothReport;
pub use layers_report::LayersReport;
pub use mesh_report::{IslandsReport, LargestIsland, MeshReport, SpecificSurface, SurfaceReport};
pub use tets_report::{NetReport, TetMeshReport, TilingReport, ZoneJoin, ZoneReport};
pub use volume_report::{BeamMeshReport, DomainReport, SetReport, ShellReport, VolumeReport, VoxelElementsReport};

/// A number, or its least and greatest value over the region where it varies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Varying {
    /// It is the same everywhere.
    Number(f64),
    /// Least and greatest.
    Range([f64; 2]),
}

impl Varying {
    /// Its least value.
    pub fn least(self) -> f64 {
        match self {
            Varying::Number(v) | Varying::Range([v, _]) => v,
        }
    }
}

/// All reports, so that their schemas are found in one place.
#[derive(JsonSchema)]
#[allow(dead_code)]
struct Reports {
    design: DesignReport,
    transition: TransitionReport,
    mesh: MeshReport,
    quality: TriangleQuality,
    surface: SurfaceReport,
    simplified: SimplifyReport,
    smoothed: SmoothReport,
    thickness: Thickness,
    dangling: Dangling,
    repair: Repaired,
    estimate: Estimate,
    tets: TetMeshReport,
    step: StepReport,
    beams_file: BeamsFileReport,
    layers: LayersReport,
    stiffness: StiffnessReport,
    conductivity: ConductivityReport,
    permeability: PermeabilityReport,
    volume: VolumeReport,
    voxel_elements: VoxelElementsReport,
    shells: ShellReport,
    beam_elements: BeamMeshReport,
}

/// The JSON Schema of all reports, by the names of their types under `$defs`.
pub fn schema() -> Json {
    schemars::schema_for!(Reports).to_value()
}
