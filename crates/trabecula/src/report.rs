//! Reports: every figure of a design or a mesh, declared once. The fields are the keys of the JSON that the command
//! prints and the attributes of the Python classes, whose text is made from the comments here (`scripts/report_classes.py`).

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

pub use beams_report::{
    BeamsFileReport, BeamsReport, CleanedReport, FilletShortfall, GraphReport, PatternReport, StepReport, TrimmedReport,
};
pub use cell_report::{CellGrid, ConductivityReport, PermeabilityReport, StiffnessReport};
pub use design_report::{
    BlendReport, DesignReport, DistortionReport, FractionAlong, LatticeReport, LooseBodies, MapSpread, NarrowestNeck,
    PeriodReport, PropertyReport, RbfReport, RegionReport, SingularLineReport, TessellationReport, TransitionReport,
};
pub use layers_report::LayersReport;
pub use mesh_report::{
    DanglingReport, EstimateReport, Histogram, IslandsReport, LargestBit, LargestIsland, MeshReport, QualityReport,
    RepairReport, SimplifyReport, SmoothReport, SpecificSurface, SurfaceReport, ThicknessReport, ThicknessSpread,
    VoidReport,
};
pub use tets_report::{
    Creases, DihedralReport, FitReport, LayersMade, MinMeanMax, NetReport, TetMeshReport, TetQualityReport,
    TilingReport, WallSpread, ZoneJoin, ZoneReport,
};
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
    quality: QualityReport,
    surface: SurfaceReport,
    simplified: SimplifyReport,
    smoothed: SmoothReport,
    thickness: ThicknessReport,
    dangling: DanglingReport,
    repair: RepairReport,
    estimate: EstimateReport,
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
