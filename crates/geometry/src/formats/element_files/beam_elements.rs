//! Files of beams as finite elements: Abaqus and CalculiX (B31, B32), Nastran (CBAR), VTK; each with circular sections.
//!
//! Source: CalculiX CrunchiX User's Manual 2.20 and Abaqus Keywords Reference, *BEAM SECTION; MSC Nastran Quick Reference Guide, CBAR,
//! PBARL. Of SECTION=CIRC Abaqus takes the radius, CalculiX the diameter.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, abaqus, lines, nastran, rows};
use crate::fe_mesh::BeamMesh;
use crate::formats::nastran_fields::{check_numbers, real};
use crate::formats::vtu::{ArrayValues, Cells};

/// A format of beams: suffix, what it is, and what writes a mesh.
pub type BeamFormat = (&'static str, &'static str, fn(&BeamMesh, &FeText, &mut dyn Write) -> io::Result<()>);

/// The formats of beams as finite elements.
pub const BEAM_FORMATS: [BeamFormat; 3] =
    [("inp", "Abaqus, CalculiX", write_inp), ("bdf", "Nastran", write_bdf), ("vtu", "VTK, ParaView", write_vtu)];

fn write_inp(mesh: &BeamMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    abaqus::nodes(&text.title, &mesh.nodes, out)?;
    let kind = match (mesh.middles.is_empty(), text.abaqus) {
        (true, _) => "B31",
        (false, true) => "B32",
        // Each is a solid of twenty nodes; fully integrated ones are stiffer in bending.
        (false, false) => "B32R",
    };
    writeln!(out, "*ELEMENT, TYPE={kind}, ELSET=BEAMS")?;
    lines(out, mesh.elements.len(), |i, text| {
        let [a, b] = mesh.elements[i];
        abaqus::element(text, i, [Some(a), mesh.middles.get(i).copied(), Some(b)].into_iter().flatten());
    })?;
    abaqus::sets(&mesh.sets, &[], out)?;
    let [e, nu] = text.elastic(0);
    writeln!(out, "*MATERIAL, NAME=SOLID\n*ELASTIC\n{e:?}, {nu:?}")?;
    let (what, times) = if text.abaqus { ("Abaqus: radii", 1.0) } else { ("CalculiX: diameters", 2.0) };
    writeln!(out, "** sections of {what} (mm), and the direction of their first axis")?;
    for (s, section) in mesh.sections().iter().enumerate() {
        let ([x, y, z], size) = (section.across, times * section.radius);
        writeln!(out, "*ELSET, ELSET=SECTION_{}", s + 1)?;
        rows(out, &section.elements, 16, ", ")?;
        writeln!(out, "*BEAM SECTION, ELSET=SECTION_{}, MATERIAL=SOLID, SECTION=CIRC", s + 1)?;
        writeln!(out, "{size:?}\n{x:?}, {y:?}, {z:?}")?;
    }
    let forces = |name: &str, load| mesh.set(name).map(|s| mesh.nodal_forces(s, load));
    abaqus::step(text, (&["BEAMS"], 6), &forces, out)
}

fn write_bdf(mesh: &BeamMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    check_numbers([mesh.nodes.len(), mesh.elements.len()])?;
    writeln!(out, "$ {}\n$ mm, N, MPa\nBEGIN BULK", text.title)?;
    nastran::nodes(&mesh.nodes, out)?;
    nastran::material(1, text.elastic(0), out)?;
    for (s, section) in mesh.sections().iter().enumerate() {
        let radius = real(section.radius, 16);
        writeln!(out, "PBARL*  {:>16}{:>16}{:>16}{:>16}\n*\n*       {radius:>16}", s + 1, 1, "", "ROD")?;
        let [x, y, z] = section.across.map(|v| format!("{v:.1}"));
        lines(out, section.elements.len(), |i, text| {
            let e = section.elements[i] as usize;
            let [a, b] = mesh.elements[e].map(|n| n + 1);
            let _ = writeln!(text, "CBAR    {:>8}{:>8}{a:>8}{b:>8}{x:>8}{y:>8}{z:>8}", e + 1, s + 1);
        })?;
    }
    nastran::sets(&mesh.sets, out)?;
    writeln!(out, "ENDDATA")
}

fn write_vtu(mesh: &BeamMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let width = if mesh.middles.is_empty() { 2 } else { 3 };
    let cells = Cells {
        note: "beams",
        nodes: &mesh.nodes,
        sets: &mesh.sets,
        // VTK_LINE, VTK_QUADRATIC_EDGE.
        kind: if width == 2 { 3 } else { 21 },
        width,
        count: mesh.elements.len(),
        data: &[("radius", ArrayValues::Numbers(&mesh.radii))],
        fields: &text.fields,
    };
    cells.write(|| (0..mesh.elements.len()).flat_map(|i| mesh.nodes_of(i)), out)
}
