//! Tetrahedral meshes: the domain of a lattice that follows the part's own shape.

use crate::math::Vec3;

/// A tetrahedral mesh of a domain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Nodes (mm).
    pub nodes: Vec<Vec3>,
    /// The four nodes of each tetrahedron; (b − a) × (c − a) · (d − a) > 0 in a checked mesh.
    pub tets: Vec<[u32; 4]>,
    /// The zone of each tetrahedron, a number of the mesher's own; empty where there are none.
    pub zones: Vec<u32>,
}
