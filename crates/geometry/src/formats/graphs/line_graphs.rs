//! Graphs as line cells: Wavefront OBJ, VTK.
//!
//! Sources: Wavefront Technologies, Advanced Visualizer, Appendix B1; Kitware, VTK File Formats.

use std::io::{self, Write};

use super::{BeamGraph, on_line, positive};
use crate::fault::{Fault, counted};
use crate::formats::text::{NumberedLines, at_line, parse, position, shown, words};
use crate::formats::vtk::{DataArray, DataSet, read_vtk};

/// VTK's numbers of lines and polylines.
const LINE: u8 = 3;
const POLYLINE: u8 = 4;
/// Names of radii of points or cells.
const RADII: [&str; 5] = ["radius", "radii", "r", "rad", "tuberadius"];

/// Writes vertices and lines; OBJ has no radii.
pub fn write_obj(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(b"# lengths in mm\n")?;
    for [x, y, z] in &graph.nodes {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [a, b] in &graph.beams {
        writeln!(out, "l {} {}", a + 1, b + 1)?;
    }
    Ok(())
}

/// Reads vertices and lines, which may have more than two points.
pub fn read_obj(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut graph, mut faces) = (BeamGraph::default(), 0);
    for (line, text) in NumberedLines::new(bytes) {
        let mut row = words(text);
        match row.next() {
            Some(b"v") => graph.nodes.push(position(line, row)?),
            Some(b"l") => {
                let count = graph.nodes.len() as i64;
                let node = |w: &[u8]| {
                    let number = w.split(|b| *b == b'/').next().and_then(parse::<i64>);
                    let found = number.map(|n| if n < 0 { count + n } else { n - 1 });
                    let found = found.filter(|n| (0..count).contains(n));
                    found.map(|n| n as u32).ok_or_else(|| {
                        at_line(line, format!("{} names no vertex: {count} stand above, numbered from 1", shown(w)))
                    })
                };
                let nodes = row.map(node).collect::<Result<Vec<u32>, Fault>>()?;
                if nodes.len() < 2 {
                    return Err(at_line(line, "a line has two or more vertices"));
                }
                for pair in nodes.windows(2) {
                    graph.join([pair[0], pair[1]], [f64::NAN; 2], on_line(line))?;
                }
            }
            Some(b"f") => faces += 1,
            _ => {}
        }
    }
    if faces > 0 {
        graph.remarks.push(format!("{} left out: only lines are read", counted(faces, "face")));
    }
    Ok(graph)
}

/// Writes lines as an unstructured grid (VTU) in text, with `radius` at points and of cells at their two ends.
pub fn write_vtu_lines(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    let (points, cells) = (graph.nodes.len(), graph.beams.len());
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">"
    )?;
    let open = |out: &mut dyn Write, kind: &str, name: &str, components: usize| {
        writeln!(
            out,
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
        )
    };
    let close = "</DataArray>\n";
    if !graph.radii.is_empty() {
        out.write_all(b"<PointData>\n")?;
        open(out, "Float64", "radius", 1)?;
        graph.radii.iter().try_for_each(|r| writeln!(out, "{r}"))?;
        writeln!(out, "{close}</PointData>")?;
    }
    if !graph.beam_radii.is_empty() {
        out.write_all(b"<CellData>\n")?;
        open(out, "Float64", "radius", 2)?;
        graph.beam_radii.iter().try_for_each(|[r, s]| writeln!(out, "{r} {s}"))?;
        writeln!(out, "{close}</CellData>")?;
    }
    out.write_all(b"<Points>\n")?;
    open(out, "Float64", "Points", 3)?;
    graph.nodes.iter().try_for_each(|[x, y, z]| writeln!(out, "{x} {y} {z}"))?;
    writeln!(out, "{close}</Points>\n<Cells>")?;
    open(out, "UInt32", "connectivity", 1)?;
    graph.beams.iter().try_for_each(|[a, b]| writeln!(out, "{a} {b}"))?;
    out.write_all(close.as_bytes())?;
    open(out, "Int64", "offsets", 1)?;
    (1..=cells).try_for_each(|i| writeln!(out, "{}", 2 * i))?;
    out.write_all(close.as_bytes())?;
    open(out, "UInt8", "types", 1)?;
    (0..cells).try_for_each(|_| writeln!(out, "{LINE}"))?;
    writeln!(out, "{close}</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// Reads line cells of an unstructured grid or of poly data; arrays named `radius` of points or cells are radii.
pub fn read_vtk_lines(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let data = read_vtk(bytes)?;
    let DataSet::Mesh(elements) = &data.shape else {
        return Err(Fault::new("", "this is a grid of voxels; lines are expected"));
    };
    data.check()?;
    let named = |of_cells: bool, most: usize| {
        let fits = |a: &&DataArray| {
            let name = a.name.to_lowercase();
            a.of_cells == of_cells && (1..=most).contains(&a.components) && RADII.contains(&name.as_str())
        };
        data.arrays.iter().find(fits)
    };
    let wrong = |message: String| Fault::new("", message);
    let mut graph = BeamGraph { nodes: elements.points.clone(), ..BeamGraph::default() };
    if let Some(array) = named(false, 1) {
        let given = |(i, r): (usize, &f64)| match r.is_nan() {
            true => Ok(*r),
            false => positive(*r, &format!("{} of point {i}", array.name)),
        };
        graph.radii = array.values.iter().enumerate().map(given).collect::<Result<_, _>>().map_err(wrong)?;
    }
    let cell_radii = named(true, 2);
    let (mut from, mut others) = (0, 0);
    for (cell, (end, kind)) in elements.ends.iter().zip(&elements.kinds).enumerate() {
        let nodes = &elements.connectivity[from..*end];
        from = *end;
        if *kind != LINE && *kind != POLYLINE {
            others += 1;
            continue;
        }
        if let Some(node) = nodes.iter().find(|n| **n as usize >= graph.nodes.len()) {
            return Err(wrong(format!("cell {cell} names point {node}; there are {}", graph.nodes.len())));
        }
        let mut radii = [f64::NAN; 2];
        if let Some(array) = cell_radii {
            let row = &array.values[cell * array.components..][..array.components];
            let name = format!("{} of cell {cell}", array.name);
            radii = [row[0], row[array.components - 1]];
            for r in radii.iter().filter(|r| !r.is_nan()) {
                positive(*r, &name).map_err(wrong)?;
            }
        }
        for pair in nodes.windows(2) {
            graph.join([pair[0], pair[1]], radii, |m| wrong(format!("cell {cell}: {m}")))?;
        }
    }
    if others > 0 {
        graph.remarks.push(format!("{} left out: only lines are read", counted(others, "other cell")));
    }
    Ok(graph)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polylines_and_indices_from_the_end() {
        let made = read_obj(b"v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\nl -1 -3\nf 1 2 3\n").unwrap();
        assert_eq!(made.beams, [[0, 1], [1, 2], [2, 0]]);
        assert_eq!(made.remarks, ["1 face left out: only lines are read"]);
        for (text, expected) in [
            ("v 0 0 0\nl 1 2\n", "line 2: \"2\" names no vertex: 1 stand above"),
            ("v 0 0 0\nl 1\n", "line 2: a line has two"),
            ("v 0 0 0\nl 1 1\n", "line 2: both ends"),
            ("v 0 0\n", "line 1: a coordinate is missing"),
        ] {
            let fault = read_obj(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }

    #[test]
    fn legacy_poly_data() {
        let text = "# vtk DataFile Version 3.0\nlines\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 1 1 0\nLINES 1 4\n3 0 1 2\n\
                    POINT_DATA 3\nSCALARS radius float 1\nLOOKUP_TABLE default\n0.5 0.25 0.5\n";
        let made = read_vtk_lines(text.as_bytes()).unwrap();
        assert_eq!((made.beams, made.radii), (vec![[0, 1], [1, 2]], vec![0.5, 0.25, 0.5]));
    }
}
