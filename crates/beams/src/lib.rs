//! Beam lattices with quadric fillets, in exact form.
//!
//! A [`Graph`] has hubs (balls) and beams between them. Each beam is a quadric of revolution tangent to both its hubs,
//! selected by a [`Profile`]: a cone, a cylinder, or a quadric with a given radius at mid length or at its waist. Where
//! beams meet, fillets that are quadrics too join them tangentially ([`Fillet`]). [`Quadors`] is the resulting solid. It
//! consists of pieces of quadrics that meet in planes, so most queries have closed forms:
//!
//! - an implicit function with gradient, a Lipschitz bound and proven interval bounds over boxes;
//! - point membership, ray intersection, the closest point of the surface;
//! - plane slices as loops of conic arcs with their area ([`Slice`]);
//! - volume, area, centroid and inertia to a relative error of 1e-10 ([`MassProperties`]);
//! - the boundary of every hub as faces, conic arcs and vertices, and as exact rational Bézier patches;
//! - watertight triangle meshes to a chord error, without a grid ([`Tessellation`]);
//! - STEP files of the exact boundary ([`write_step`]);
//! - frusta of cones within a tolerance ([`Frusta`]), for formats such as the 3MF beam lattice.
//!
//! Graphs come from a catalogue of unit cells ([`graph::catalogue`]) repeated in space, from tables
//! ([`graph::nodes`], [`graph::struts`]), or from a [`Wireframe`] with radii assigned by [`graph::with_radii`]; wireframes
//! can be cleaned up and trimmed to a region. A [`Pattern`] repeats a small graph by up to three similarity transforms
//! and is never expanded: a [`PatternField`] evaluates lattices of 10⁹ hubs from a few distinct ones.
//!
//! Lengths are in mm. Implicit functions are negative inside the solid. The symbols of the mathematics are listed in
//! [`quador`]. Invalid input is reported as a [`geometry::fault::Fault`] with its path in the graph.
//!
//! ```
//! use beams::{Beam, Fillet, Graph, HubBall, Profile, Quadors, SlicePlane};
//!
//! let hub = |x: f64| HubBall { center: [x, 0.0, 0.0], radius: 1.0 };
//! let graph = Graph {
//!     hubs: vec![hub(0.0), hub(10.0)],
//!     beams: vec![Beam { ends: [0, 1], profile: Profile::Cylinder }],
//! };
//! let quadors = Quadors::new(&graph, Fillet::Auto)?;
//!
//! // The axis is inside; the surface of the cylinder has radius 1 mm.
//! assert!(quadors.value([5.0, 0.0, 0.0]) < 0.0);
//! assert!(quadors.value([5.0, 1.0, 0.0]).abs() < 1e-12);
//! // A cylinder of length 10 mm and two half balls.
//! let pi = std::f64::consts::PI;
//! assert!((quadors.volume()? - (10.0 + 4.0 / 3.0) * pi).abs() < 1e-8);
//! // The slice at x = 3 mm is a disc.
//! let slice = quadors.slice(&SlicePlane::new([3.0, 0.0, 0.0], [1.0, 0.0, 0.0])?)?;
//! assert!((slice.area - pi).abs() < 1e-12);
//! # Ok::<(), geometry::fault::Fault>(())
//! ```

#![warn(unreachable_pub)]

mod frusta;
pub mod graph;
pub mod pattern;
pub mod quador;
mod step;

pub use frusta::{Frusta, JoinedChains, join_chains};
pub use graph::{Beam, Graph, HubBall, Profile, Wireframe};
pub use pattern::{Pattern, PatternField};
pub use quador::slice::{Slice, SlicePlane};
pub use quador::{Fillet, MassProperties, Pencil, Quadors, Tessellation};
pub use step::write_step;

use geometry::math::Vec3;

/// A scalar function of the position: fills the second slice with its values at the points (mm) of the first.
pub type Values<'a> = &'a (dyn Fn(&[Vec3], &mut [f64]) + Sync);
