//! Geometry that knows no field: vectors, exact predicates, triangle and tetrahedral meshes, their measures, space groups.
//!
//! Lengths are mm; triangles are counter-clockwise seen from outside.

pub mod bvh;
pub mod distance;
pub mod fault;
pub mod feature_edges;
pub mod formats;
pub mod math;
pub mod measure;
pub mod mesh;
pub mod progress;
pub mod random;
pub mod render;
pub mod repair;
pub mod simplify;
pub mod surface_mesh;
pub mod symmetry;
pub mod tetmesh;
pub mod union_find;
pub mod voxels;
