//! Measures of a mesh.
use crate::math::Aabb;
use crate::mesh::Mesh;

/// What a closed mesh is.
#[derive(Clone, Debug, PartialEq)]
pub struct Size {
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Area, mm².
    pub area: f64,
    /// V − E + F.
    pub euler: i64,
    /// Solids.
    pub pieces: usize,
    /// Closed voids inside solids.
    pub cavities: usize,
    /// Whether every edge has exactly two triangles of opposite direction.
    pub closed: bool,
    /// Bounds.
    pub bounds: Aabb,
}

/// Measures a mesh (vertices already joined by index).
pub fn size(mesh: &Mesh) -> Size {
    let _ = mesh;
    todo!()
}

/// What is wrong with a mesh as the boundary of one solid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub crowded_edges: usize,
    /// Edges with two triangles that run the same way (a flipped neighbour).
    pub flipped_edges: usize,
    /// Triangles that repeat another one's vertices.
    pub duplicate_triangles: usize,
    /// Triangles with two equal vertices or zero area.
    pub degenerate_triangles: usize,
    /// Connected bodies.
    pub bodies: usize,
}

/// Counts the defects of a mesh.
pub fn defects(mesh: &Mesh) -> Defects {
    let _ = mesh;
    todo!()
}
