//! Changes of tetrahedra that can be taken back.

use super::node_surfaces::SurfaceSet;
use geometry::math::Vec3;

/// A change that can be taken back.
pub(super) enum Change {
    /// A node that was elsewhere.
    Moved(u32, Vec3),
    /// A node that was on more surfaces.
    Freed(u32, SurfaceSet),
    /// A new node.
    Added,
    /// Tetrahedra, with their nodes and domains, in place of which there are others; how many numbers there were.
    Replaced { gone: Vec<(u32, [u32; 4], u8)>, made: Vec<u32>, count: usize },
}
