//! Effective figures of a periodic cell.

use schemars::JsonSchema;
use serde::Serialize;

use crate::kind::Warning;

/// The tensor on one of the grids from which a limit was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CellGrid {
    /// Voxels along each edge of the cell.
    pub shape: [usize; 3],
    /// Mean of the solid fractions of the voxels.
    pub fraction: f64,
    /// The tensor on this grid.
    pub tensor: Vec<Vec<f64>>,
}

/// Effective stiffness of a periodic cell, in world axes; moduli in the unit of E. Voigt's order 11 22 33 23 13 12, engineering shears.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[allow(non_snake_case)]
pub struct StiffnessReport {
    /// Stiffness, extrapolated to infinitely many voxels: stress = C strain, 6 × 6.
    pub C: [[f64; 6]; 6],
    /// Stiffness at n voxels.
    pub C_n: [[f64; 6]; 6],
    /// Voxels along the edge of the cell, or of a cube of its volume.
    pub n: usize,
    /// Estimated relative error of C: its distance from C_n over its size (Frobenius's norm). Each eigenvalue of C is extrapolated by an
    /// order of its own, and changed by half at most; soft ones are less sure than C is as a whole: see E_error and G_error.
    pub error: f64,
    /// Exponent of the voxel's edge with which the error was taken to fall, of the eigenvalue that changes most.
    pub order: f64,
    /// Greatest relative residual of the load cases.
    pub residual: f64,
    /// Most iterations of a load case.
    pub iterations: usize,
    /// Young's moduli along the axes; None where the cell resists some strain not at all.
    pub E: Option<[f64; 3]>,
    /// Estimated relative errors of E.
    pub E_error: Option<[f64; 3]>,
    /// Shear moduli of the planes 23, 13, 12.
    pub G: Option<[f64; 3]>,
    /// Estimated relative errors of G.
    pub G_error: Option<[f64; 3]>,
    /// Poisson's ratios 23, 13, 12: contraction along the second axis under tension along the first.
    pub nu: Option<[f64; 3]>,
    /// Zener's ratio 2 C44 / (C11 - C12) of means over the axes; 1 is isotropic.
    pub zener: Option<f64>,
    /// Universal anisotropy 5 G_V / G_R + K_V / K_R - 6; 0 is isotropic.
    pub anisotropy: Option<f64>,
    /// Bulk modulus: pressure over relative change of volume.
    pub bulk: Option<f64>,
    /// Hashin's and Shtrikman's bounds of the bulk modulus; None unless the solid is isotropic.
    pub bulk_bounds: Option<[f64; 2]>,
    /// Mean of Voigt's and Reuss's shear moduli over all orientations.
    pub shear: Option<f64>,
    /// Hashin's and Shtrikman's bounds of the shear modulus of an isotropic cell; None unless the solid is isotropic.
    pub shear_bounds: Option<[f64; 2]>,
    /// Solid fraction of the cell.
    pub fraction: f64,
    /// Edges of the cell, mm, one row each.
    pub edges: [[f64; 3]; 3],
    /// Voxels across the thinnest wall or neck; None if not known.
    pub wall_voxels: Option<f64>,
    /// The grids.
    pub grids: Vec<CellGrid>,
    /// Possible mistakes.
    pub warnings: Vec<Warning>,
}

/// Effective conductivity of a periodic cell, in world axes, relative to the solid's.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ConductivityReport {
    /// Conductivity, extrapolated to infinitely many voxels: 3 × 3.
    pub k: [[f64; 3]; 3],
    /// Conductivity at n voxels.
    pub k_n: [[f64; 3]; 3],
    /// Voxels along the edge of the cell, or of a cube of its volume.
    pub n: usize,
    /// Estimated relative error of k: its distance from k_n over its size (Frobenius's norm). Each eigenvalue of k is extrapolated by an
    /// order of its own, and changed by half at most.
    pub error: f64,
    /// Estimated relative errors of k along the axes.
    pub axis_errors: [f64; 3],
    /// Exponent of the voxel's edge with which the error was taken to fall, of the eigenvalue that changes most.
    pub order: f64,
    /// Greatest relative residual of the load cases.
    pub residual: f64,
    /// Most iterations of a load case.
    pub iterations: usize,
    /// Hashin's and Shtrikman's bounds of the mean conductivity.
    pub bounds: [f64; 2],
    /// Conductivity of the pore relative to the solid's.
    pub pore: f64,
    /// Solid fraction of the cell.
    pub fraction: f64,
    /// Edges of the cell, mm, one row each.
    pub edges: [[f64; 3]; 3],
    /// Voxels across the thinnest wall or neck; None if not known.
    pub wall_voxels: Option<f64>,
    /// The grids.
    pub grids: Vec<CellGrid>,
    /// Possible mistakes.
    pub warnings: Vec<Warning>,
}

/// Permeability of the pore of a periodic cell to creeping flow, in world axes: mean flux over the whole cell = -k grad p / viscosity.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PermeabilityReport {
    /// Permeability, extrapolated to infinitely many nodes: 3 x 3, mm².
    pub k: [[f64; 3]; 3],
    /// Permeability at n nodes, mm².
    pub k_n: [[f64; 3]; 3],
    /// Permeability in units of the wavelength squared; None unless the cell is a cube.
    pub k_cell: Option<[[f64; 3]; 3]>,
    /// Nodes along the edge of the cell, or of a cube of its volume.
    pub n: usize,
    /// Estimated relative error of k: its distance from k_n over its size (Frobenius's norm), and what a cell that is not whole numbers
    /// of steps adds. Each eigenvalue of k is extrapolated by an order of its own, and changed by half at most.
    pub error: f64,
    /// Estimated relative errors of k along the axes; 0 where nothing flows.
    pub axis_errors: [f64; 3],
    /// Exponent of the grid's step with which the error was taken to fall, of the eigenvalue that changes most.
    pub order: f64,
    /// Greatest change by a step of the iteration, over that of the first.
    pub residual: f64,
    /// Most steps of a force.
    pub iterations: usize,
    /// Which pore: both sides of a sheet together if None.
    pub side: Option<String>,
    /// Volume of the pore over that of the cell.
    pub porosity: f64,
    /// Area of the wall of the pore over the volume of the cell, 1/mm.
    pub area_per_volume: f64,
    /// Hydraulic diameter, 4 volume of the pore / area of its wall, mm; None without a wall.
    pub hydraulic_diameter: Option<f64>,
    /// Kozeny's constant porosity³ / (k S²), with the mean k over the axes and the area S of the wall over the volume of the cell; None
    /// where nothing flows.
    pub kozeny: Option<f64>,
    /// Conductivity of the pore, 1 where it is open: 3 x 3.
    pub conductivity: [[f64; 3]; 3],
    /// Tortuosity porosity / conductivity, with the mean conductivity over the axes; None where the pore does not conduct.
    pub tortuosity: Option<f64>,
    /// Solid fraction of the cell.
    pub fraction: f64,
    /// Edges of the cell, mm, one row each.
    pub edges: [[f64; 3]; 3],
    /// Steps of the grid across the hydraulic diameter; None without a wall.
    pub pore_nodes: Option<f64>,
    /// The grids, with the share of nodes that are not in the pore and the tensor in mm².
    pub grids: Vec<CellGrid>,
    /// Possible mistakes.
    pub warnings: Vec<Warning>,
}
