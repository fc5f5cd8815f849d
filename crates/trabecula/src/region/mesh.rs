/// A closed triangle mesh.
pub struct MeshRegion;
