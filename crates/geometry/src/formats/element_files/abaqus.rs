//! Input files of Abaqus and CalculiX.
//!
//! Source: CalculiX CrunchiX User's Manual 2.20, sections *NODE, *ELEMENT, *NSET, *SURFACE, *EQUATION. At most sixteen numbers stand on a
//! line of a set. A mesh with loads has a step and is ready to run. So is a periodic cell: its faces are tied by equations to three
//! reference nodes, whose displacements are the columns of the mean strain times the periods, and six steps apply one strain each.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines, push, rows};
use crate::fe_mesh::{FeMesh, FeSet, Load, MIDDLES};
use crate::math::{Vec3, add};

/// The number of a face by the corner opposite to it.
const FACE: [u8; 4] = [3, 4, 2, 1];
/// The strains of the six steps, Voigt's order: entries of the symmetric tensor.
const STRAINS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
/// The strain of a step; engineering shear.
const STRAIN: f64 = 1e-3;

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    nodes(&text.title, &mesh.nodes, out)?;
    let kind = if mesh.middles.is_empty() { "C3D4" } else { "C3D10" };
    for (d, name) in mesh.domains.iter().enumerate() {
        let of: Vec<usize> = (0..mesh.tets.len()).filter(|i| mesh.domain[*i] as usize == d).collect();
        writeln!(out, "*ELEMENT, TYPE={kind}, ELSET={name}")?;
        lines(out, of.len(), |k, text| {
            let i = of[k];
            let middles = mesh.middles.get(i).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
            element(text, i, mesh.tets[i].into_iter().chain(middles));
        })?;
    }
    sets(&mesh.sets, &FACE, out)?;
    match (mesh.pairs.is_empty(), text.held.is_empty() && text.loads.is_empty()) {
        (false, _) => periodic(mesh, text, out),
        (true, false) => loaded(mesh, text, out),
        (true, true) if !mesh.fraction.is_empty() => materials(mesh, text, out),
        (true, true) => Ok(()),
    }
}

/// The heading and the nodes.
pub(super) fn nodes(title: &str, nodes: &[Vec3], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "*HEADING\n{title}\n** mm, N, MPa\n*NODE, NSET=NALL")?;
    lines(out, nodes.len(), |i, text| {
        push(text, i + 1);
        for x in nodes[i] {
            text.push_str(", ");
            decimal(text, x);
        }
        text.push('\n');
    })
}

/// The line of an element: its number and those of its nodes, from 1.
pub(super) fn element(text: &mut String, i: usize, nodes: impl Iterator<Item = u32>) {
    push(text, i + 1);
    for n in nodes {
        text.push_str(", ");
        push(text, n as usize + 1);
    }
    text.push('\n');
}

/// Sets of nodes, elements and faces; `numbers` are the solver's of an element's faces, none where it has no names for them.
pub(super) fn sets(sets: &[FeSet], numbers: &[u8], out: &mut dyn Write) -> io::Result<()> {
    for set in sets {
        writeln!(out, "*NSET, NSET={}", set.name)?;
        rows(out, &set.nodes, 16, ", ")?;
        writeln!(out, "*ELSET, ELSET={}", set.name)?;
        rows(out, &set.elements, 16, ", ")?;
        if !set.faces.is_empty() && !numbers.is_empty() {
            writeln!(out, "*SURFACE, NAME={}, TYPE=ELEMENT", set.name)?;
            lines(out, set.faces.len(), |i, text| {
                let (t, k) = set.faces[i];
                push(text, t as usize + 1);
                text.push_str(", S");
                push(text, numbers[k as usize] as usize);
                text.push('\n');
            })?;
        }
    }
    Ok(())
}

/// Appends a number in at most twenty characters: CalculiX leaves out what is beyond, an exponent too.
pub(super) fn decimal(text: &mut String, x: f64) {
    let start = text.len();
    // Writing to a string cannot fail.
    let _ = write!(text, "{x:?}");
    for digits in (1..=16).rev() {
        if text.len() - start <= 20 {
            return;
        }
        text.truncate(start);
        let _ = write!(text, "{x:.digits$e}");
    }
}

/// The materials of the domains: one of all, or where they are classes of the solid fraction one of each.
fn materials(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    if !text.cubic.is_empty() {
        return oriented(mesh, text, out);
    }
    let own = !mesh.fraction.is_empty();
    for (d, name) in mesh.domains.iter().enumerate() {
        let material = if own { name } else { "SOLID" };
        if own || d == 0 {
            let [e, nu] = text.elastic(d);
            writeln!(out, "*MATERIAL, NAME={material}\n*ELASTIC\n{e:?}, {nu:?}")?;
        }
        writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL={material}")?;
    }
    Ok(())
}

/// Cubic materials of the domains along the axes of each element. CalculiX takes the distribution without the table that Abaqus wants
/// before it, of which it says that it cannot be interpreted.
fn oriented(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "*DISTRIBUTION TABLE, NAME=TWO_AXES\nCOORD3D, COORD3D")?;
    writeln!(out, "*DISTRIBUTION, NAME=AXES, LOCATION=ELEMENT, TABLE=TWO_AXES\n, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0")?;
    lines(out, mesh.axes.len(), |i, text| {
        push(text, i + 1);
        for x in mesh.axes[i][..2].iter().flatten() {
            text.push_str(", ");
            decimal(text, *x);
        }
        text.push('\n');
    })?;
    writeln!(out, "*ORIENTATION, NAME=CELL, SYSTEM=RECTANGULAR\nAXES")?;
    for (name, [c11, c12, c44]) in mesh.domains.iter().zip(&text.cubic) {
        // D1111, D1122, D2222, D1133, D2233, D3333, D1212, D1313, and D2323 on a line of its own.
        writeln!(out, "*MATERIAL, NAME={name}\n*ELASTIC, TYPE=ORTHO")?;
        writeln!(out, "{c11:?}, {c12:?}, {c11:?}, {c12:?}, {c12:?}, {c11:?}, {c44:?}, {c44:?},\n{c44:?}")?;
        writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL={name}, ORIENTATION=CELL")?;
    }
    Ok(())
}

/// Materials and a step.
fn loaded(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    materials(mesh, text, out)?;
    let names: Vec<&str> = mesh.domains.iter().map(String::as_str).collect();
    let forces = |name: &str, load| mesh.set(name).map(|s| mesh.nodal_forces(s, load));
    step(text, (&names, 3), &forces, out)
}

/// The forces at nodes of a load on a set.
pub(super) type Forces<'a> = dyn Fn(&str, Load) -> Option<Vec<(u32, Vec3)>> + 'a;

/// What is held, and one step with the loads, if there are any; results are displacements, stresses, reactions, and energies of the domains, with
/// the number of degrees of freedom of their nodes.
pub(super) fn step(
    text: &FeText,
    (domains, freedoms): (&[&str], usize),
    of: &Forces,
    out: &mut dyn Write,
) -> io::Result<()> {
    if text.held.is_empty() && text.loads.is_empty() {
        return Ok(());
    }
    text.held.iter().try_for_each(|name| writeln!(out, "*BOUNDARY\n{name}, 1, {freedoms}"))?;
    writeln!(out, "*STEP\n*STATIC")?;
    // A node of several sets has one line for each direction: what a second one means differs between programs.
    let mut forces = std::collections::BTreeMap::<u32, Vec3>::new();
    for (name, load) in &text.loads {
        match load {
            Load::Traction([x, y, z]) => {
                writeln!(out, "** on {name}: {x:?}, {y:?}, {z:?} N in all, a uniform traction")
            }
            Load::Pressure(p) => writeln!(out, "** on {name}: a pressure of {p:?} MPa"),
        }?;
        for (node, force) in of(name, *load).into_iter().flatten() {
            let sum = forces.entry(node).or_insert([0.0; 3]);
            *sum = add(*sum, force);
        }
    }
    let forces: Vec<(u32, Vec3)> = forces.into_iter().collect();
    writeln!(out, "*CLOAD")?;
    lines(out, forces.len(), |i, text| {
        let (node, force) = forces[i];
        for (k, f) in force.iter().enumerate().filter(|(_, f)| **f != 0.0) {
            let _ = write!(text, "{}, {}, ", node + 1, k + 1);
            decimal(text, *f);
            text.push('\n');
        }
    })?;
    writeln!(out, "*NODE FILE\nU\n*EL FILE\nS")?;
    text.held.iter().try_for_each(|name| writeln!(out, "*NODE PRINT, NSET={name}, TOTALS=ONLY\nRF"))?;
    // The internal energy is half the work of the loads.
    domains.iter().try_for_each(|name| writeln!(out, "*EL PRINT, ELSET={name}, TOTALS=ONLY\nEVOL, ELSE"))?;
    writeln!(out, "*END STEP")
}

/// Equations, materials and six steps of a periodic cell.
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
    materials(mesh, text, out)?;
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

#[cfg(test)]
mod tests {
    use super::decimal;

    #[test]
    fn numbers_keep_their_value_in_twenty_characters() {
        for x in
            [0.0, 4.0, -1.0 / 3.0, 1.701414312254252e-17, -1.2345678901234567e-105, 45.367132785054515, -1e300 / 3.0]
        {
            let mut text = String::new();
            decimal(&mut text, x);
            let back: f64 = text.parse().unwrap_or(f64::NAN);
            // Eleven digits after the first remain with a sign and an exponent of three digits.
            assert!(text.len() <= 20 && (back - x).abs() <= 1e-11 * x.abs(), "{x:?}: {text}");
        }
    }
}
