//! Trabecula: lattice design. A solid is a region and a field; a lattice is a cell (a function on the torus)
//! seen through a map (position to phase), cut by a part at a level.
//!
//! Lengths are mm, angles degrees at the door, phases turns; negative is solid; triangles are counter-clockwise
//! seen from outside.

pub mod analysis;
pub mod beam_surface;
pub mod blend;
pub mod cell;
mod coincident;
pub mod csg_tree;
pub mod design;
pub mod extract;
pub mod field;
pub mod grade;
pub mod implicit;
pub mod lattice;
pub mod map;
pub mod mesher;
pub mod region;
pub mod skin;
pub mod solid;
pub mod surface_maker;
pub mod tiling;
pub mod truss;
