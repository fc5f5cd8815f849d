//! Maps from position (mm) to phase (turns).

mod affine;
mod affine_kind;
mod angle_weight;
mod axis;
pub(crate) mod bent_tets;
mod branch_cuts;
mod branched_solve;
mod cohomology;
mod comb;
mod conjugate_gradients;
mod core_branches;
mod core_solve;
mod cube_rotations;
pub(crate) mod curved_tets;
mod cut_cells;
mod distortion;
mod edge_squares;
mod fixed_faces;
mod fold_advice;
mod frame;
mod grade_values;
mod grid_cells;
mod grid_choice;
mod integral;
mod inverse;
mod load_cases;
mod multigrid;
mod periods;
mod phase;
mod phase_candidate;
mod phase_grid;
mod phase_kind;
mod phase_request;
mod phase_target;
mod pierced_faces;
mod poisson;
mod principal;
mod principal_lengths;
mod region_holes;
mod round;
mod round_kind;
mod singular_core;
mod singular_lines;
mod smooth_frames;
mod solution;
mod solution_quality;
mod spline;
mod stress_kind;
mod stretch;
pub(crate) mod surface_feet;
mod surface_frames;
mod sweep;
mod sweep_kind;
pub(crate) mod tet_map;
mod tets_kind;
mod two_axes;
mod winding;

pub use affine::{Affine, Skew};
pub use affine_kind::AffineKind;
pub use axis::Axis;
pub use core_solve::Cores;
pub use distortion::{Distortion, MapSpread, Misfit};
pub use frame::Orientation;
pub use load_cases::{CasesBy, Stress};
pub use periods::Period;
pub use phase::Phase;
pub use phase_request::{PhaseRequest, SolverOptions};
pub use round::Round;
pub use singular_core::{CoreFill, CoreOptions};
pub use singular_lines::SingularLine;
pub use stretch::Stretch;
pub use surface_frames::Aligned;
pub use sweep::{Path, Sweep};
pub use tet_map::CarrierMesh;
pub use tets_kind::{
    CellJoin, LayersSpec, MadeTetsKind, MesherKind, Method, NetSpec, SurfaceEnds, TetFileKind, TetsKind,
};
pub use two_axes::TwoAxes;

use std::sync::Arc;

use crate::environment::Environment;
use crate::field::Block;
use crate::grade::Grade;
use crate::kind::{DesignError, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Mat3, Vec3};

/// Position (mm) to phase (turns).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Map", noun = "map", family = BuildMap)]
#[allow(missing_docs)] // The comment of each type says what it is.
pub enum MapKind {
    #[kind(hints("cartesian", "rectangular", "uniform", "grid"))]
    Affine(AffineKind),
    Spartan(affine_kind::SpartanKind),
    Phase(Box<phase_kind::PhaseKind>),
    #[kind(hints("cylindrical", "polar", "tube"))]
    Cylinder(round_kind::CylinderMapKind),
    #[kind(hints("spherical", "radial", "ball"))]
    Sphere(round_kind::SphereMapKind),
    Sweep(sweep_kind::SweepKind),
    Tets(TetsKind),
}

/// A kind of map, as it is declared.
pub(crate) trait BuildMap {
    /// The map. `path` is that of the kind's table.
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError>;

    /// The Jacobian (turns per mm) of cells of 1 mm, or of the ratios of their edges, where their size is left out, as the level's
    /// fraction and `length` give it.
    fn unit(&self, length: &str, path: &str, _: &Environment) -> Result<Mat3, DesignError> {
        Err(not_sized(length, path))
    }

    /// The map with cells that are `edge` (mm) times as large as those of `unit`.
    fn sized(&self, _edge: &Grade, length: &str, path: &str, _: &Environment) -> Result<Map, DesignError> {
        Err(not_sized(length, path))
    }
}

/// Explains that cells of this map have a size of their own.
fn not_sized(length: &str, path: &str) -> DesignError {
    let message = format!(
        "fraction and {length} together give the wavelength of map.affine, map.spartan and map.phase; with this map give its \
         wavelength, and one of the two amounts"
    );
    DesignError::new(path, message)
}

/// Explains that a cell edge was given twice.
fn given_twice(length: &str, path: &str) -> DesignError {
    let message =
        format!("fraction and {length} give the wavelength; leave it out, or give one of the two amounts only");
    DesignError::new(format!("{path}.wavelength"), message)
}

/// Explains that a cell edge was left out.
const NO_WAVELENGTH: &str =
    "\"wavelength\" is missing: cell edge, mm; only a level with a fraction and a thickness or pore goes without";

impl MapKind {
    /// The map at `environment.path`.
    pub(crate) fn build(&self, environment: &Environment) -> Result<Map, DesignError> {
        self.family().build(&self.path(environment), environment)
    }

    /// As `BuildMap::unit`.
    pub(crate) fn unit(&self, length: &str, environment: &Environment) -> Result<Mat3, DesignError> {
        self.family().unit(length, &self.path(environment), environment)
    }

    /// As `BuildMap::sized`.
    pub(crate) fn sized(&self, edge: &Grade, length: &str, environment: &Environment) -> Result<Map, DesignError> {
        self.family().sized(edge, length, &self.path(environment), environment)
    }

    fn path(&self, environment: &Environment) -> String {
        format!("{}.{}", environment.path, self.key())
    }
}

fn shared(made: Result<impl Mapping + 'static, Fault>, path: &str) -> Result<Map, DesignError> {
    made.map(|m| Arc::new(m) as Map).map_err(|f| DesignError::fault(path, f))
}

/// A function u(x) from position (mm) to phase (turns). Cells are where the phases have the same whole parts.
pub trait Mapping: Send + Sync {
    /// The least and the greatest wavelength where the lattice is wanted, mm.
    fn wavelengths(&self) -> [f64; 2];

    /// The least wavelength (mm): what `--per-cell` divides.
    fn wavelength(&self) -> f64 {
        self.wavelengths()[0]
    }

    /// The greatest wavelength, mm.
    fn longest(&self) -> f64 {
        self.wavelengths()[1]
    }

    /// Fills phases (turns) of points (mm).
    fn phases(&self, points: &[Vec3], out: &mut [Vec3]);

    /// du/dx at a point, turns per mm.
    fn jacobian(&self, at: Vec3) -> Mat3;

    /// Fills phases (turns) and Jacobians (turns per mm) of points (mm).
    fn phases_and_jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        self.phases(points, u);
        for (j, p) in j.iter_mut().zip(points) {
            *j = self.jacobian(*p);
        }
    }

    /// The affine map that this is, if it is one: its Jacobian is the same everywhere.
    fn affine(&self) -> Option<&Affine> {
        None
    }

    /// The solved map that this is, if it is one: it is defined in a box, and may deviate from the target.
    fn solved(&self) -> Option<&Phase> {
        None
    }

    /// Moves phases (turns) of a solved map, in which one place is as good as another.
    fn move_phases(&mut self, _by: Vec3) {}

    /// The wrapped map that this is, if it is one: cells shrink towards its axis or centre.
    fn round(&self) -> Option<&Round> {
        None
    }

    /// A Jacobian typical of the map, but for its rotation, turns per mm: what distances on the torus are measured with.
    fn typical(&self) -> Mat3;

    /// The Jacobians where cells are largest and smallest, turns per mm.
    fn extremes(&self) -> Vec<Mat3>;

    /// A Lipschitz bound in a box: an upper bound of the spectral norm of du/dx, turns per mm. Infinite where there is none.
    fn lipschitz(&self, b: &Aabb) -> f64;

    /// A Lipschitz bound where the lattice is wanted, turns per mm.
    fn max_lipschitz(&self) -> f64;

    /// The position (mm) that has the phase u, if there is one. A solved map has it searched for from `near` (mm) on.
    fn position(&self, u: Vec3, near: Vec3) -> Option<Vec3>;

    /// The cells that may have a part in the box, or a neighbour that has, each with a position (mm) near it.
    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)>;

    /// One index for the cells that are one and the same: round an axis they close.
    fn canonical(&self, cell: [i32; 3]) -> [i32; 3] {
        cell
    }

    /// The phases along the rows of a block.
    fn rows<'a>(&'a self, block: &Block<'a>) -> Box<dyn PhaseRows + 'a> {
        Box::new(PointRows { map: self, block: *block, layer: 0, points: Vec::new(), phases: Vec::new() })
    }
}

/// A shared map.
pub type Map = Arc<dyn Mapping>;

/// The phases along the rows of a block.
pub trait PhaseRows {
    /// Prepares for the rows of layer k.
    fn enter_layer(&mut self, k: usize);

    /// Fills the three phases (turns) along row j of the layer entered last.
    fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]);
}

/// Rows evaluated point by point.
struct PointRows<'a, M: ?Sized> {
    map: &'a M,
    block: Block<'a>,
    layer: usize,
    points: Vec<Vec3>,
    phases: Vec<Vec3>,
}

impl<M: Mapping + ?Sized> PhaseRows for PointRows<'_, M> {
    fn enter_layer(&mut self, k: usize) {
        self.layer = k;
    }

    fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]) {
        let [xs, ys, zs] = self.block.axes;
        self.points.clear();
        self.points.extend(xs.iter().map(|&x| [x, ys[j], zs[self.layer]]));
        self.phases.resize(xs.len(), [0.0; 3]);
        self.map.phases(&self.points, &mut self.phases);
        for (i, u) in self.phases.iter().enumerate() {
            for (out, u) in out.iter_mut().zip(u) {
                out[i] = *u;
            }
        }
    }
}
