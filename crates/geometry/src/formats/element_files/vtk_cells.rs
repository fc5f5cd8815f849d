//! VTK unstructured grids (VTU) of finite element meshes, raw and appended: domains, sets as arrays of ones and zeros.
//!
//! Source: Kitware, VTK File Formats, XML formats. Cell types 10 (tetrahedron), 12 (hexahedron) and 24 (quadratic tetrahedron).

use std::io::{self, Write};

use super::{FeField, FeText};
use crate::fe_mesh::{FeMesh, FeSet, MIDDLES};
use crate::math::Vec3;

/// Cells of one kind.
pub(super) struct Cells<'a> {
    /// What they are.
    pub note: &'a str,
    /// Positions of nodes.
    pub nodes: &'a [Vec3],
    /// Sets, of which nodes are written.
    pub sets: &'a [FeSet],
    /// VTK's number of the kind.
    pub kind: u8,
    /// Nodes of a cell.
    pub width: usize,
    /// The number of cells.
    pub count: usize,
    /// Arrays of the cells by name.
    pub data: &'a [(&'a str, Array<'a>)],
    /// Further fields of nodes and cells.
    pub fields: &'a [FeField],
}

/// An array of numbers.
pub(super) enum Array<'a> {
    /// Labels.
    Labels(&'a [u8]),
    /// Real numbers.
    Numbers(&'a [f64]),
}

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let width = if mesh.middles.is_empty() { 4 } else { 10 };
    let cells = Cells {
        note: &format!("domains, from 0: {}", mesh.domains.join(", ")),
        nodes: &mesh.nodes,
        sets: &mesh.sets,
        kind: if width == 4 { 10 } else { 24 },
        width,
        count: mesh.tets.len(),
        data: &[("domain", Array::Labels(&mesh.domain))],
        fields: &text.fields,
    };
    let corners = |i: usize| mesh.tets[i].into_iter();
    let middles = |i: usize| mesh.middles.get(i).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
    cells.write(|| (0..mesh.tets.len()).flat_map(move |i| corners(i).chain(middles(i))), out)
}

impl Cells<'_> {
    /// Writes the file; `connectivity` gives the nodes of all cells in turn.
    pub fn write<I: Iterator<Item = u32>>(&self, connectivity: impl Fn() -> I, out: &mut dyn Write) -> io::Result<()> {
        let (nodes, count, width) = (self.nodes.len(), self.count, self.width);
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
             header_type=\"UInt64\">\n<!-- {} -->\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{nodes}\" \
             NumberOfCells=\"{count}\">\n<PointData>\n",
            self.note
        );
        for set in self.sets {
            head += &header("UInt8", &set.name, 1, nodes);
        }
        let of = |at_nodes: bool| self.fields.iter().filter(move |f| f.at_nodes == at_nodes);
        for f in of(true) {
            head += &header("Float64", &f.name, f.components, 8 * f.values.len());
        }
        head += "</PointData>\n<CellData>\n";
        for (name, array) in self.data {
            head += &match array {
                Array::Labels(_) => header("UInt8", name, 1, count),
                Array::Numbers(_) => header("Float64", name, 1, 8 * count),
            };
        }
        for f in of(false) {
            head += &header("Float64", &f.name, f.components, 8 * f.values.len());
        }
        head += "</CellData>\n<Points>\n";
        head += &header("Float64", "Points", 3, 24 * nodes);
        head += "</Points>\n<Cells>\n";
        head += &header("UInt32", "connectivity", 1, 4 * width * count);
        // Not the kinds last: they may be characters that some readers strip, as white space, from the end.
        head += &header("UInt8", "types", 1, count);
        head += &header("Int64", "offsets", 1, 8 * count);
        head += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
        out.write_all(head.as_bytes())?;
        let mut block = |bytes: Vec<u8>| -> io::Result<()> {
            out.write_all(&(bytes.len() as u64).to_le_bytes())?;
            out.write_all(&bytes)
        };
        for set in self.sets {
            let mut flags = vec![0; nodes];
            set.nodes.iter().for_each(|n| flags[*n as usize] = 1);
            block(flags)?;
        }
        let bytes = |of: &[f64]| -> Vec<u8> { of.iter().flat_map(|v| v.to_le_bytes()).collect() };
        of(true).try_for_each(|f| block(bytes(&f.values)))?;
        for (_, array) in self.data {
            block(match array {
                Array::Labels(of) => of.to_vec(),
                Array::Numbers(of) => bytes(of),
            })?;
        }
        of(false).try_for_each(|f| block(bytes(&f.values)))?;
        block(self.nodes.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
        block(connectivity().flat_map(u32::to_le_bytes).collect())?;
        block(vec![self.kind; count])?;
        block((1..=count as i64).flat_map(|i| (width as i64 * i).to_le_bytes()).collect())?;
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}
