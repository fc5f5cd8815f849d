//! Tetrahedra that conform to implicit surfaces: a background is cut along each surface in turn (`surface_cuts.rs`), then shapes are
//! improved.
//!
//! Nodes know the surfaces they lie on, so that faces, feature edges and corners of a solid are faces, edges and nodes of the mesh, at
//! any wall thickness. A surface that is a mesh is cut patch by patch between its feature edges (`patch_cuts.rs`). Shapes are improved by
//! moving nodes along their surfaces, by flips and by collapses.
//!
//! The first cut of a background is that of isosurface stuffing: F. Labelle, J. R. Shewchuk, ACM Transactions on Graphics 26(3), 2007.

mod boundary_node_hash;
mod boundary_repair;
mod chord_balance;
mod crease_nodes;
mod flips;
mod mending;
mod node_surfaces;
mod node_tets;
mod partition;
mod patch_cuts;
mod patched_surface;
mod plane_sections;
mod prepared;
mod prism_columns;
mod prism_layers;
mod shaping;
mod slivers;
mod surface_cuts;
mod tet_change;
mod tet_shape;

pub(crate) use chord_balance::{distances, interfaces};
pub(crate) use node_surfaces::{HELD, MOST, SurfaceSet, members, only, onto};
pub(crate) use partition::{Partition, Tet, edge_images, images};
pub(crate) use patched_surface::Patched;
pub(crate) use prepared::{components, prepared};
pub(crate) use prism_columns::FilledLayers;
pub use prism_columns::MadeLayers;
pub use prism_layers::PrismLayers;
pub(crate) use shaping::{GONE, Shaping};
pub(crate) use surface_cuts::evaluated;
pub use tet_shape::ANGLES;
