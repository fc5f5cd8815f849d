//! Triangle and tetrahedral meshes, their files, and everything about them that knows no implicit function.
//!
//! Lengths are in mm. Triangles are counter-clockwise seen from outside, so a solid has positive volume. The same input gives
//! the same bytes, whatever the number of threads. What a user gave wrong is a [`Fault`] with the place and the remedy.
//!
//! - **Read and write**: [`read_mesh`], [`write_mesh`] and [`formats`] (STL, 3MF, PLY, OBJ, OFF; VTK; pictures and arrays).
//! - **Meshes**: [`Mesh`] is positions and triangles, [`SurfaceMesh`] marks triangles that lie on a cut, [`TetMesh`] is
//!   made of tetrahedra. [`measure`] gives volume, area, topology, defects, triangle quality and closed voids.
//! - **Transforms**: [`Transform`] moves, scales and rotates meshes; orientation is kept where it mirrors.
//! - **Repair**: [`repair`] merges seams, removes degenerate and duplicate triangles, caps holes, orients connected
//!   components and cuts along self-intersections, by exact predicates.
//! - **Signed distance**: [`MeshDistance`] repairs a mesh and gives its exact signed distance, negative inside; the sign is
//!   that of angle-weighted normals or of winding numbers. [`feature_edges`] finds where the surface turns sharply.
//! - **Simplification**: [`simplify()`] removes triangles within a proven distance, without self-intersections.
//! - **Smoothing**: [`smooth()`] makes better triangles of slivers, the volume and sharp edges kept.
//! - **Search**: [`Bvh`] is a bounding-volume hierarchy over anything with a box ([`Aabb`]); [`weld`] finds points
//!   near each other, [`spatial_order`] lets them follow each other; [`union_find`] joins sets.
//! - **Symmetry**: [`symmetry`] has the 230 space groups by Hall symbol; [`math`] has vectors, matrices and intervals,
//!   [`cubic_spline`] tricubic interpolation on grids.
//! - **Pictures**: [`render`] draws meshes.
//!
//! A part with a hole, from its file to a lighter one:
//!
//! ```
//! use geometry::mesh::samples::icosphere;
//! use geometry::progress::Silent;
//! use geometry::{Goal, MeshDistance, Repair, SurfaceMesh, read_mesh, simplify, write_mesh};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // The bytes of an STL file: a ball of radius 10 mm that lacks a triangle.
//! let mut ball = icosphere(4, 10.0, 0.0);
//! ball.triangles.pop();
//! let mut bytes = Vec::new();
//! write_mesh(&ball, "stl", &Default::default(), &mut bytes)?;
//!
//! let part = MeshDistance::new(read_mesh(&bytes, "stl")?.mesh, Repair::Auto)?;
//! assert_eq!(part.repaired().holes, 1);
//!
//! let size = geometry::measure::size(part.mesh());
//! assert!(size.closed && size.euler == 2 && size.pieces == 1);
//! assert!((size.volume / 4188.79 - 1.0).abs() < 0.01); // mm³
//! assert!((part.value([0.0, 0.0, 12.0]) - 2.0).abs() < 0.01); // mm outside
//!
//! let surface = SurfaceMesh { cut: vec![false; part.mesh().triangles.len()], mesh: part.mesh().clone() };
//! let goal = Goal { tolerance: Some(0.2), triangles: None };
//! let Ok((lighter, report)) = simplify(&surface, &goal, &Silent) else { panic!("no simplification") };
//! assert!(lighter.mesh.triangles.len() < 5120 / 2 && report.deviation <= 0.2);
//! # Ok(())
//! # }
//! ```

pub mod bvh;
pub mod cubic_spline;
pub mod dense;
pub mod distance;
pub mod fault;
pub mod fe_mesh;
pub mod feature_edges;
pub mod formats;
pub mod layer;
pub mod math;
pub mod measure;
pub mod mesh;
pub mod monotone_cubic;
pub mod nearest_points;
pub mod once;
pub mod progress;
pub mod random;
mod remesh;
pub mod render;
pub mod repair;
pub mod roots;
pub mod similarity;
pub mod simplify;
pub mod smooth;
pub mod spatial_order;
pub mod surface_mesh;
pub mod surface_patches;
pub mod symmetry;
pub mod tetmesh;
pub mod transform;
pub mod union_find;
pub mod voxel_distances;
pub mod voxels;
pub mod weld;

pub use bvh::Bvh;
pub use distance::MeshDistance;
pub use fault::Fault;
pub use formats::{read_mesh, write_mesh};
pub use math::{Aabb, Vec3};
pub use mesh::Mesh;
pub use progress::{Progress, Stopped};
pub use repair::{Repair, Repaired};
pub use simplify::{Goal, simplify};
pub use smooth::smooth;
pub use surface_mesh::SurfaceMesh;
pub use tetmesh::TetMesh;
pub use transform::Transform;
