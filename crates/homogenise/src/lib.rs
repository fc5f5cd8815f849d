//! Effective properties of a periodic cell of voxels: stiffness and conductivity; and of its pore: permeability.
//!
//! A [`VoxelCell`] is a parallelepiped of voxels, each with the share of it that is solid. Trilinear finite elements, their stiffness
//! weighted by that share, give the periodic field of each unit load; its energy is the effective tensor. The element is applied in
//! modal coordinates ([`element`](mod@element)) without a stored matrix (`operator.rs`), and the systems are solved by conjugate gradients
//! with geometric multigrid (`solve.rs`, `multigrid.rs`), so that the number of iterations does not grow with that of the voxels.
//!
//! A [`PoreGrid`] is a pore filled by nodes of a cubic grid, with the distances of walls. Creeping flow through it is found by a lattice
//! Boltzmann scheme with two relaxation times (`boltzmann.rs`) that is led to its steady state (`flow.rs`).
//!
//! ```
//! use geometry::progress::Silent;
//! use homogenise::{Material, VoxelCell};
//!
//! // Layers across z, half of them solid: stiff in the plane, nothing across.
//! let fractions = (0..8 * 8 * 8).map(|i| if i / 64 < 4 { 1.0 } else { 0.0 }).collect();
//! let edges = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let cell = VoxelCell::new([8, 8, 8], edges, fractions).expect("fits");
//! let material = Material::isotropic(1.0, 0.3).expect("valid");
//! let c = cell.stiffness(&material, 1e-10, &Silent).expect("solved").tensor;
//! assert!((c[0][0] - 0.5 / (1.0 - 0.09)).abs() < 1e-9);
//! assert!(c[2][2].abs() < 1e-9);
//! ```

mod boltzmann;
mod cell;
mod cut_voxels;
pub mod element;
mod fields;
mod flow;
mod interface;
mod lanes;
mod material;
mod moduli;
mod multigrid;
mod operator;
mod percolation;
mod pore;
mod slab;
mod solve;

pub use cell::{Homogenised, VoxelCell, upper_edges};
pub use interface::Interface;
pub use material::{AXES, Material, Voigt, turned, voigt};
pub use moduli::{Moduli, bounds, conductivity_bounds};
pub use pore::{PoreGrid, VELOCITIES, WallLink, opposite};
