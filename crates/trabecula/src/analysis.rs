//! Measures that need the field, the region or the design: cut triangles, local thickness, transitions of blends, dangling
//! fragments. Those of a mesh alone are in [`geometry::measure`].

mod cut_triangles;
mod dangling;
mod grid_depth;
mod local_thickness;
mod transition;

pub use cut_triangles::cut_triangles;
pub use dangling::{Dangling, LargestFragment, dangling};
pub use local_thickness::{
    BYTES_PER_VOXEL, Histogram, Thickness, ThicknessSpread, thickness, thickness_at_vertices, usual_step, voxels_for,
};
pub use transition::{Transition, transitions};
