//! Geometry that knows no field: vectors, exact predicates, triangle and tetrahedral meshes, their measures, space groups.
//!
//! Lengths are mm; triangles are counter-clockwise seen from outside.

pub mod fault;
pub mod math;
pub mod measure;
pub mod mesh;
pub mod symmetry;
pub mod tetmesh;
pub mod union_find;
