//! VTK unstructured grids (VTU) of finite element meshes, raw and appended: domains, sets as arrays of ones and zeros.
//!
//! Source: Kitware, VTK File Formats, XML formats. Cell types 10 (tetrahedron) and 24 (quadratic tetrahedron).

use std::io::{self, Write};

use super::FeText;
use crate::fe_mesh::{FeMesh, MIDDLES};

pub(super) fn write(mesh: &FeMesh, _: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let (nodes, tets) = (mesh.nodes.len(), mesh.tets.len());
    let width = if mesh.middles.is_empty() { 4 } else { 10 };
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
         header_type=\"UInt64\">\n<!-- domains, from 0: {} -->\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{nodes}\" \
         NumberOfCells=\"{tets}\">\n<PointData>\n",
        mesh.domains.join(", ")
    );
    for set in &mesh.sets {
        head += &header("UInt8", &set.name, 1, nodes);
    }
    head += "</PointData>\n<CellData>\n";
    head += &header("UInt8", "domain", 1, tets);
    head += "</CellData>\n<Points>\n";
    head += &header("Float64", "Points", 3, 24 * nodes);
    head += "</Points>\n<Cells>\n";
    head += &header("UInt32", "connectivity", 1, 4 * width * tets);
    head += &header("Int64", "offsets", 1, 8 * tets);
    head += &header("UInt8", "types", 1, tets);
    head += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    out.write_all(head.as_bytes())?;
    let mut block = |bytes: Vec<u8>| -> io::Result<()> {
        out.write_all(&(bytes.len() as u64).to_le_bytes())?;
        out.write_all(&bytes)
    };
    for set in &mesh.sets {
        let mut flags = vec![0; nodes];
        set.nodes.iter().for_each(|n| flags[*n as usize] = 1);
        block(flags)?;
    }
    block(mesh.domain.clone())?;
    block(mesh.nodes.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
    let corners = |i: usize| mesh.tets[i].into_iter();
    let middles = |i: usize| mesh.middles.get(i).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
    block((0..tets).flat_map(|i| corners(i).chain(middles(i))).flat_map(u32::to_le_bytes).collect())?;
    block((1..=tets as i64).flat_map(|i| (width as i64 * i).to_le_bytes()).collect())?;
    block(vec![if width == 4 { 10 } else { 24 }; tets])?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}
