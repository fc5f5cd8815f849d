//! VTK unstructured grids (VTU) of cells of one kind, raw and appended: numbers of nodes and cells, sets as arrays of ones and zeros.
//!
//! Source: Kitware, VTK File Formats, XML formats.

use std::io::{self, Write};

use crate::fe_mesh::{FeField, FeSet};
use crate::math::Vec3;
use crate::tetmesh::TetMesh;

/// Cells of one kind.
pub(crate) struct Cells<'a> {
    /// What they are.
    pub note: &'a str,
    /// Positions of nodes.
    pub nodes: &'a [Vec3],
    /// Sets: nodes of all, cells of those that are parts of the solid.
    pub sets: &'a [FeSet],
    /// VTK's number of the kind.
    pub kind: u8,
    /// Nodes of a cell.
    pub width: usize,
    /// The number of cells.
    pub count: usize,
    /// Arrays of the cells by name.
    pub data: &'a [(&'a str, ArrayValues<'a>)],
    /// Further fields of nodes and cells.
    pub fields: &'a [FeField],
}

/// An array of numbers.
pub(crate) enum ArrayValues<'a> {
    /// Labels.
    Labels(&'a [u8]),
    /// Whole numbers.
    Integers(&'a [i64]),
    /// Real numbers.
    Numbers(&'a [f64]),
}

/// Writes a tetrahedral mesh as an unstructured grid with numbers for each tetrahedron by name; the zones, where there are
/// any, as `zone`.
///
/// **Errors**: what `out` reports; `InvalidInput` if an array does not have a number for each tetrahedron.
pub fn write_vtu<W: Write>(mesh: &TetMesh, arrays: &[(&str, Vec<f64>)], out: &mut W) -> io::Result<()> {
    let count = mesh.tets.len();
    if let Some((name, of)) = arrays.iter().find(|(_, of)| of.len() != count) {
        return Err(super::invalid(format!("array \"{name}\" has {} numbers for {count} tetrahedra", of.len())));
    }
    let mut data: Vec<(&str, ArrayValues)> =
        arrays.iter().map(|(name, of)| (*name, ArrayValues::Numbers(of))).collect();
    if !mesh.zones.is_empty() {
        data.push(("zone", ArrayValues::Integers(&mesh.zones)));
    }
    // 10 is VTK_TETRA.
    let cells = Cells {
        note: "tetrahedra",
        nodes: &mesh.nodes,
        sets: &[],
        kind: 10,
        width: 4,
        count,
        data: &data,
        fields: &[],
    };
    cells.write(|| mesh.tets.iter().flatten().copied(), out)
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
        let bulk = || self.sets.iter().filter(|s| s.bulk);
        for set in bulk() {
            head += &header("UInt8", &set.name, 1, count);
        }
        for (name, array) in self.data {
            head += &match array {
                ArrayValues::Labels(_) => header("UInt8", name, 1, count),
                ArrayValues::Integers(_) => header("Int64", name, 1, 8 * count),
                ArrayValues::Numbers(_) => header("Float64", name, 1, 8 * count),
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
        let flags = |of: &[u32], count: usize| {
            let mut flags = vec![0; count];
            of.iter().for_each(|i| flags[*i as usize] = 1);
            flags
        };
        self.sets.iter().try_for_each(|set| block(flags(&set.nodes, nodes)))?;
        let bytes = |of: &[f64]| -> Vec<u8> { of.iter().flat_map(|v| v.to_le_bytes()).collect() };
        of(true).try_for_each(|f| block(bytes(&f.values)))?;
        bulk().try_for_each(|set| block(flags(&set.elements, count)))?;
        for (_, array) in self.data {
            block(match array {
                ArrayValues::Labels(of) => of.to_vec(),
                ArrayValues::Integers(of) => of.iter().flat_map(|v| v.to_le_bytes()).collect(),
                ArrayValues::Numbers(of) => bytes(of),
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::formats::{DataSet, read_vtk};

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
        let DataSet::Mesh(elements) = &data.shape else { panic!("mesh") };
        let (read, of) = elements.tet_mesh(false).unwrap();
        assert_eq!((read.nodes, read.tets, of), (mesh.nodes.clone(), mesh.tets.clone(), vec![0, 1]));
        assert_eq!(data.arrays[0].values, [0.3, 1e-9]);
        assert_eq!((data.arrays[1].name.as_str(), &data.arrays[1].values), ("zone", &vec![7.0, 3.0]));
        assert!(write_vtu(&mesh, &[("angle", vec![0.3])], &mut bytes).is_err());
    }
}
