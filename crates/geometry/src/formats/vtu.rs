//! Tetrahedral meshes as VTK unstructured grids (VTU).
//!
//! Source: Kitware, VTK File Formats, XML formats.

use std::io::{self, Write};

use crate::tetmesh::TetMesh;

/// Writes a tetrahedral mesh as an unstructured grid, raw and appended, with numbers for each tetrahedron by name; the
/// zones, where there are any, as `zone`.
///
/// **Errors**: what `out` reports; `InvalidInput` if an array does not have a number for each tetrahedron.
pub fn write_vtu<W: Write>(mesh: &TetMesh, arrays: &[(&str, Vec<f64>)], out: &mut W) -> io::Result<()> {
    let (nodes, tets) = (mesh.nodes.len(), mesh.tets.len());
    if let Some((name, of)) = arrays.iter().find(|(_, of)| of.len() != tets) {
        return Err(super::invalid(format!("array \"{name}\" has {} numbers for {tets} tetrahedra", of.len())));
    }
    let zones = (!mesh.zones.is_empty()).then_some(&mesh.zones);
    let mut at = 0;
    let mut header = |kind: &str, name: &str, components: usize, bytes: usize| {
        let line = format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{at}\"/>\n"
        );
        at += 8 + bytes;
        line
    };
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{nodes}\" NumberOfCells=\"{tets}\">\n<CellData>\n"
    );
    for (name, _) in arrays {
        head += &header("Float64", name, 1, 8 * tets);
    }
    if zones.is_some() {
        head += &header("Int64", "zone", 1, 8 * tets);
    }
    head += "</CellData>\n<Points>\n";
    head += &header("Float64", "Points", 3, 24 * nodes);
    head += "</Points>\n<Cells>\n";
    head += &header("UInt32", "connectivity", 1, 16 * tets);
    head += &header("Int64", "offsets", 1, 8 * tets);
    head += &header("UInt8", "types", 1, tets);
    head += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    out.write_all(head.as_bytes())?;
    let mut block = |bytes: Vec<u8>| -> io::Result<()> {
        out.write_all(&(bytes.len() as u64).to_le_bytes())?;
        out.write_all(&bytes)
    };
    for (_, of) in arrays {
        block(of.iter().flat_map(|v| v.to_le_bytes()).collect())?;
    }
    if let Some(zones) = zones {
        block(zones.iter().flat_map(|v| v.to_le_bytes()).collect())?;
    }
    block(mesh.nodes.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
    block(mesh.tets.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
    block((1..=tets as i64).flat_map(|i| (4 * i).to_le_bytes()).collect())?;
    // 10 is VTK_TETRA.
    block(vec![10; tets])?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::formats::{Shape, read_vtk};

    #[test]
    fn what_is_written_is_read_back() {
        let mesh = TetMesh {
            nodes: vec![[0.1, 0.0, -3.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]],
            tets: vec![[0, 1, 2, 3], [1, 4, 2, 3]],
            zones: vec![7, 3],
        };
        let mut bytes = Vec::new();
        write_vtu(&mesh, &[("angle", vec![0.3, 1e-9])], &mut bytes).unwrap();
        let data = read_vtk(&bytes).unwrap();
        let Shape::Mesh(elements) = &data.shape else { panic!("mesh") };
        let (read, of) = elements.tet_mesh(false).unwrap();
        assert_eq!((read.nodes, read.tets, of), (mesh.nodes.clone(), mesh.tets.clone(), vec![0, 1]));
        assert_eq!(data.arrays[0].values, [0.3, 1e-9]);
        assert_eq!((data.arrays[1].name.as_str(), &data.arrays[1].values), ("zone", &vec![7.0, 3.0]));
        assert!(write_vtu(&mesh, &[("angle", vec![0.3])], &mut bytes).is_err());
    }
}
