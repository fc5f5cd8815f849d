//! Nastran bulk data: GRID* in large fields, CTETRA, PSOLID, node sets as SET1.
//!
//! Source: MSC Nastran Quick Reference Guide. The order of the edges' nodes is that of VTK.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines};
use crate::fe_mesh::{FeMesh, FeSet, MIDDLES};
use crate::formats::nastran_fields::{check_numbers, grid, real};
use crate::math::Vec3;

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    check_numbers([mesh.nodes.len(), mesh.tets.len()])?;
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
    let own = !mesh.fraction.is_empty();
    for (d, name) in mesh.domains.iter().enumerate() {
        let number = if own { d + 1 } else { 1 };
        if own || d == 0 {
            material(number, text.elastic(d), out)?;
        }
        writeln!(out, "$ domain {name}\nPSOLID  {:>8}{number:>8}", d + 1)?;
    }
    sets(&mesh.sets, out)?;
    writeln!(out, "ENDDATA")
}

/// Nodes, in large fields.
pub(super) fn nodes(nodes: &[Vec3], out: &mut dyn Write) -> io::Result<()> {
    lines(out, nodes.len(), |i, text| {
        text.push_str(&grid(i + 1, nodes[i]));
    })
}

/// A material by its number, Young's modulus and Poisson's ratio.
pub(super) fn material(number: usize, [e, nu]: [f64; 2], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "MAT1*   {number:>16}{:>16}{:>16}{:>16}\n*       ", real(e, 16), "", real(nu, 16))
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
