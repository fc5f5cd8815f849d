//! Input files of Abaqus and CalculiX.
//!
//! Source: CalculiX CrunchiX User's Manual 2.20, sections *NODE, *ELEMENT, *NSET, *SURFACE, *EQUATION. At most sixteen numbers stand on a
//! line of a set. A periodic cell is ready to run: its faces are tied by equations to three reference nodes, whose displacements
//! are the columns of the mean strain times the periods, and six steps apply one strain each.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines, push, rows};
use crate::fe_mesh::{FeMesh, MIDDLES};

/// The number of a face by the corner opposite to it.
const FACE: [u8; 4] = [3, 4, 2, 1];
/// The strains of the six steps, Voigt's order: entries of the symmetric tensor.
const STRAINS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
/// The strain of a step; engineering shear.
const STRAIN: f64 = 1e-3;

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "*HEADING\n{}\n** mm, N, MPa\n*NODE, NSET=NALL", text.title)?;
    lines(out, mesh.nodes.len(), |i, text| {
        push(text, i + 1);
        for x in mesh.nodes[i] {
            // Writing to a string cannot fail.
            let _ = write!(text, ", {x:?}");
        }
        text.push('\n');
    })?;
    let kind = if mesh.middles.is_empty() { "C3D4" } else { "C3D10" };
    for (d, name) in mesh.domains.iter().enumerate() {
        let of: Vec<usize> = (0..mesh.tets.len()).filter(|i| mesh.domain[*i] as usize == d).collect();
        writeln!(out, "*ELEMENT, TYPE={kind}, ELSET={name}")?;
        lines(out, of.len(), |k, text| {
            let i = of[k];
            push(text, i + 1);
            let middles = mesh.middles.get(i);
            let nodes = mesh.tets[i].into_iter().chain(middles.into_iter().flat_map(|m| MIDDLES.map(|k| m[k])));
            for n in nodes {
                text.push_str(", ");
                push(text, n as usize + 1);
            }
            text.push('\n');
        })?;
    }
    for set in &mesh.sets {
        writeln!(out, "*NSET, NSET={}", set.name)?;
        rows(out, &set.nodes, 16, ", ")?;
        writeln!(out, "*ELSET, ELSET={}", set.name)?;
        rows(out, &set.elements, 16, ", ")?;
        if !set.faces.is_empty() {
            writeln!(out, "*SURFACE, NAME={}, TYPE=ELEMENT", set.name)?;
            lines(out, set.faces.len(), |i, text| {
                let (t, k) = set.faces[i];
                push(text, t as usize + 1);
                text.push_str(", S");
                push(text, FACE[k as usize] as usize);
                text.push('\n');
            })?;
        }
    }
    if mesh.pairs.is_empty() { Ok(()) } else { periodic(mesh, text, out) }
}

/// Equations, material and six steps of a periodic cell.
fn periodic(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let reference = mesh.nodes.len() + 1;
    writeln!(
        out,
        "** reference nodes: the displacement of REFX is the mean displacement gradient along x times the period"
    )?;
    writeln!(out, "*NODE, NSET=REF")?;
    for (axis, period) in mesh.period.iter().enumerate() {
        let mut at = [0.0; 3];
        at[axis] = *period;
        writeln!(out, "{}, {:?}, {:?}, {:?}", reference + axis, at[0], at[1], at[2])?;
    }
    for (axis, name) in ["REFX", "REFY", "REFZ"].iter().enumerate() {
        writeln!(out, "*NSET, NSET={name}\n{}", reference + axis)?;
    }
    lines(out, mesh.pairs.len(), |i, text| {
        let pair = &mesh.pairs[i];
        let refs: Vec<usize> = (0..3).filter(|a| pair.along[*a]).map(|a| reference + a).collect();
        for dof in 1..=3 {
            let _ = write!(
                text,
                "*EQUATION\n{}\n{}, {dof}, 1, {}, {dof}, -1",
                2 + refs.len(),
                pair.node + 1,
                pair.image + 1
            );
            for (k, r) in refs.iter().enumerate() {
                // Four terms a line.
                text.push_str(if k == 2 { ",\n" } else { ", " });
                let _ = write!(text, "{r}, {dof}, -1");
            }
            text.push('\n');
        }
    })?;
    let [e, nu] = text.elastic;
    writeln!(out, "*MATERIAL, NAME=SOLID\n*ELASTIC\n{e:?}, {nu:?}")?;
    for name in &mesh.domains {
        writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL=SOLID")?;
    }
    let dependent: std::collections::HashSet<u32> = mesh.pairs.iter().map(|p| p.node).collect();
    let held = mesh.tets.iter().flatten().copied().filter(|n| !dependent.contains(n)).min().unwrap_or(0);
    writeln!(out, "*BOUNDARY\n{}, 1, 3", held + 1)?;
    for [i, j] in STRAINS {
        writeln!(out, "*STEP\n*STATIC\n*BOUNDARY")?;
        for (axis, period) in mesh.period.iter().enumerate() {
            for dof in 0..3 {
                let shear = if i == j { 1.0 } else { 0.5 };
                let on = [axis, dof] == [i, j] || [axis, dof] == [j, i];
                let by = if on { shear * STRAIN * period } else { 0.0 };
                writeln!(out, "{}, {}, {}, {by:?}", reference + axis, dof + 1, dof + 1)?;
            }
        }
        // The totals over the dependent nodes of a face are the mean stress times its area.
        for face in ["X1", "Y1", "Z1"] {
            writeln!(out, "*NODE PRINT, NSET={face}, TOTALS=ONLY\nRF")?;
        }
        for name in &mesh.domains {
            writeln!(out, "*EL PRINT, ELSET={name}, TOTALS=ONLY\nEVOL, ELSE")?;
        }
        writeln!(out, "*END STEP")?;
    }
    Ok(())
}
