//! OFF: the Object File Format of Geomview, ASCII. Read only.
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Reads.
pub fn read(_bytes: &[u8]) -> Result<Mesh, Fault> {
    todo!()
}
