//! Nastran bulk data: GRID* in large fields, CTETRA, PSOLID, node sets as SET1.
//!
//! Source: MSC Nastran Quick Reference Guide. The order of the edges' nodes is that of VTK.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines};
use crate::fe_mesh::{FeMesh, FeSet, MIDDLES};
use crate::math::Vec3;

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "$ {}\n$ mm, N, MPa\nBEGIN BULK", text.title)?;
    nodes(&mesh.nodes, out)?;
    lines(out, mesh.tets.len(), |i, text| {
        let middles = mesh.middles.get(i);
        let nodes = mesh.tets[i].into_iter().chain(middles.into_iter().flat_map(|m| MIDDLES.map(|k| m[k])));
        let _ = write!(text, "CTETRA  {:>8}{:>8}", i + 1, mesh.domain[i] + 1);
        for (k, n) in nodes.enumerate() {
            if k == 6 {
                text.push_str("+\n+       ");
            }
            let _ = write!(text, "{:>8}", n + 1);
        }
        text.push('\n');
    })?;
    material(text.elastic, out)?;
    for (d, name) in mesh.domains.iter().enumerate() {
        writeln!(out, "$ domain {name}\nPSOLID  {:>8}{:>8}", d + 1, 1)?;
    }
    sets(&mesh.sets, out)?;
    writeln!(out, "ENDDATA")
}

/// Nodes, in large fields.
pub(super) fn nodes(nodes: &[Vec3], out: &mut dyn Write) -> io::Result<()> {
    lines(out, nodes.len(), |i, text| {
        let [x, y, z] = nodes[i].map(field);
        let _ = writeln!(text, "GRID*   {:>16}{:>16}{x:>16}{y:>16}\n*       {z:>16}", i + 1, "");
    })
}

/// The material, by Young's modulus and Poisson's ratio.
pub(super) fn material([e, nu]: [f64; 2], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "MAT1*   {:>16}{:>16}{:>16}{:>16}\n*       ", 1, field(e), "", field(nu))
}

/// Sets of nodes.
pub(super) fn sets(sets: &[FeSet], out: &mut dyn Write) -> io::Result<()> {
    for (s, set) in sets.iter().enumerate() {
        writeln!(out, "$ nodes of {}", set.name)?;
        let count = (set.nodes.len() + 1).div_ceil(8);
        lines(out, count, |i, text| {
            // The first line has the number of the set and seven nodes, each later one eight.
            let first = if i == 0 { 0 } else { 8 * i - 1 };
            let last = (8 * (i + 1) - 1).min(set.nodes.len());
            let _ = if i == 0 { write!(text, "SET1    {:>8}", s + 1) } else { write!(text, "+       ") };
            for n in &set.nodes[first..last] {
                let _ = write!(text, "{:>8}", n + 1);
            }
            text.push_str(if i + 1 < count { "+\n" } else { "\n" });
        })?;
    }
    Ok(())
}

/// A number in at most sixteen characters, with a point.
fn field(x: f64) -> String {
    let plain = format!("{x:?}");
    if plain.len() <= 16 && !plain.contains('e') {
        return plain;
    }
    (0..=10).rev().map(|digits| format!("{x:.digits$E}")).find(|t| t.len() <= 16).unwrap_or_default()
}
