//! Lattice design: exact implicit lattices in real parts, as closed, measured solids.
//!
//! A solid is a [`Region`] and a [`Field`]; a field is a weighted sum of lattices; a [`Lattice`] is a [`Cell`] (a function on the
//! torus) seen through a map (position to phase), cut by a [`Part`] (sheet, lower, upper) at a [`Level`]; any number in it may be a
//! [`Grade`], that is, vary in space.
//!
//! A [`Design`] is the text of all this. [`Design::build`] checks it and gives a [`Built`] with its [`Solid`]; [`Built::surface`] gives
//! the method that meshes it ([`SurfaceMaker`]); [`geometry`] measures, simplifies and writes the mesh.
//!
//! ```
//! use geometry::progress::Silent;
//! use trabecula::{Design, NoFiles, SurfaceOptions};
//!
//! let text = r#"
//!     schema = 1
//!     units = "mm"
//!     region.box.size = [8, 8, 8]
//!     [lattice.core]
//!     cell = "gyroid"
//!     part = "sheet"
//!     map.affine.wavelength = 4
//!     level.porosity = 0.7
//! "#;
//! let built = Design::from_toml(text).and_then(|d| d.build(&NoFiles)).expect("a design without mistakes");
//! let made = built.surface().mesh(&SurfaceOptions::new(0.125), &Silent).expect("a surface");
//! let size = geometry::measure::size(&made.surface.mesh);
//! assert!(size.closed);
//! assert!((size.volume / 8.0f64.powi(3) - 0.3).abs() < 1e-3); // 2³ whole cells, 30 % solid
//! ```
//!
//! Lengths are mm, angles degrees in designs, phases turns; negative is solid; triangles are counter-clockwise seen from
//! outside. Evaluating a field cannot fail: every mistake is found when a design is built. Results are the same bytes for any
//! number of threads.
//!
//! The layers of the modules, lowest first, stand in ARCHITECTURE.md and are kept by `tests/tidy/`.

pub mod analysis;
pub mod beam_mesh;
pub mod beam_surface;
pub mod blend;
pub mod cell;
mod coincident;
mod conforming_tets;
pub mod corner_normals;
pub mod csg_tree;
pub mod design;
pub mod effective;
mod environment;
pub mod extract;
pub mod field;
pub mod grade;
pub mod implicit;
mod kind;
pub mod lattice;
pub mod layers;
pub mod map;
pub mod mesher;
pub mod patches;
pub mod region;
pub mod report;
pub mod shell_mesh;
pub mod skin;
pub mod solid;
pub mod surface_maker;
pub mod tiling;
pub mod truss;
pub mod volume_mesh;
pub mod voxel_fractions;

pub use cell::{Cell, Part};
pub use design::{Built, Design, DesignError, Loader, NoFiles};
pub use field::Field;
pub use grade::Grade;
pub use lattice::{Lattice, Level};
pub use region::Region;
pub use solid::Solid;
pub use surface_maker::{SurfaceMaker, SurfaceOptions};
