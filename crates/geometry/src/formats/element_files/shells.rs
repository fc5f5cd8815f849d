//! Files of shells: Abaqus and CalculiX (S3, S6), Nastran (CTRIA3, CTRIA6), VTK; each with a thickness at nodes.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, abaqus, lines, nastran, push};
use crate::fe_mesh::{FeField, ShellMesh};
use crate::formats::nastran_fields::{check_numbers, real};
use crate::formats::vtu::Cells;

/// A format of shells: suffix, what it is, and what writes a mesh.
pub type ShellFormat = (&'static str, &'static str, fn(&ShellMesh, &FeText, &mut dyn Write) -> io::Result<()>);

/// The formats of shells.
pub const SHELL_FORMATS: [ShellFormat; 3] =
    [("inp", "Abaqus, CalculiX", write_inp), ("bdf", "Nastran", write_bdf), ("vtu", "VTK, ParaView", write_vtu)];

fn write_inp(mesh: &ShellMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    abaqus::nodes(&text.title, &mesh.nodes, out)?;
    let kind = if mesh.middles.is_empty() { "S3" } else { "S6" };
    writeln!(out, "*ELEMENT, TYPE={kind}, ELSET=SHELL")?;
    lines(out, mesh.triangles.len(), |i, text| {
        abaqus::element(text, i, mesh.nodes_of(i));
    })?;
    // Edges of shells have other names in each program: sets of nodes serve all.
    abaqus::sets(&mesh.sets, &[], out)?;
    let [e, nu] = text.elastic(0);
    writeln!(out, "*MATERIAL, NAME=SOLID\n*ELASTIC\n{e:?}, {nu:?}")?;
    let mean = mesh.thickness.iter().sum::<f64>() / mesh.thickness.len().max(1) as f64;
    writeln!(out, "*SHELL SECTION, ELSET=SHELL, MATERIAL=SOLID, NODAL THICKNESS\n{mean:.6}\n*NODAL THICKNESS")?;
    lines(out, mesh.thickness.len(), |i, text| {
        push(text, i + 1);
        text.push_str(", ");
        abaqus::decimal(text, mesh.thickness[i]);
        text.push('\n');
    })?;
    let forces = |name: &str, load| mesh.set(name).map(|s| mesh.nodal_forces(s, load));
    abaqus::step(text, (&["SHELL"], 6), &forces, out)
}

fn write_bdf(mesh: &ShellMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    check_numbers([mesh.nodes.len(), mesh.triangles.len()])?;
    writeln!(out, "$ {}\n$ mm, N, MPa\nBEGIN BULK", text.title)?;
    nastran::nodes(&mesh.nodes, out)?;
    let quadratic = !mesh.middles.is_empty();
    lines(out, mesh.triangles.len(), |i, text| {
        let _ = write!(text, "{:<8}{:>8}{:>8}", if quadratic { "CTRIA6" } else { "CTRIA3" }, i + 1, 1);
        mesh.nodes_of(i).for_each(|n| _ = write!(text, "{:>8}", n + 1));
        // Thickness at the corners: from the fourth field of the second line on. A blank between two is for those who read words.
        let fill = if quadratic { 0 } else { 24 };
        let _ = write!(text, "{:fill$}+\n+{:23}", "", "");
        mesh.triangles[i].iter().for_each(|n| _ = write!(text, "{:>8}", real(mesh.thickness[*n as usize], 7)));
        text.push('\n');
    })?;
    let [e, nu] = text.elastic(0);
    nastran::material(1, [e, nu], out)?;
    writeln!(out, "PSHELL  {:>8}{:>8}{:>8}{:>8}{:>8}{:>8}", 1, 1, "1.0", 1, "", 1)?;
    nastran::sets(&mesh.sets, out)?;
    writeln!(out, "ENDDATA")
}

fn write_vtu(mesh: &ShellMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let width = if mesh.middles.is_empty() { 3 } else { 6 };
    let thickness = FeField { name: "thickness".into(), components: 1, at_nodes: true, values: mesh.thickness.clone() };
    let cells = Cells {
        note: "shells",
        nodes: &mesh.nodes,
        sets: &mesh.sets,
        // VTK_TRIANGLE, VTK_QUADRATIC_TRIANGLE.
        kind: if width == 3 { 5 } else { 22 },
        width,
        count: mesh.triangles.len(),
        data: &[],
        fields: &[vec![thickness], text.fields.clone()].concat(),
    };
    cells.write(|| (0..mesh.triangles.len()).flat_map(|i| mesh.nodes_of(i)), out)
}
