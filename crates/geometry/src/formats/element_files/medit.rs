//! Medit's .mesh, ASCII, as Mmg, FreeFem and GHS3D read it: domains and sets are reference numbers, explained in comments.
//!
//! Source: P. Frey, MEDIT: an interactive mesh visualization software, INRIA RT-0253, 2001; libMeshb for elements of degree two. The
//! order of the edges' nodes is that of `EDGES`. A face has one reference: that of its smallest set.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines, push};
use crate::fe_mesh::FeMesh;

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let faces: Vec<((u32, u8), usize)> = mesh.smallest_sets().into_iter().collect();
    writeln!(out, "MeshVersionFormatted 2\n# {}", text.title)?;
    for (d, name) in mesh.domains.iter().enumerate() {
        writeln!(out, "# tetrahedra with reference {}: {name}", d + 1)?;
    }
    for (s, set) in mesh.sets.iter().enumerate().filter(|(s, _)| faces.iter().any(|f| f.1 == *s)) {
        writeln!(out, "# triangles with reference {}: {}", s + 1, set.name)?;
    }
    writeln!(out, "Dimension 3\nVertices\n{}", mesh.nodes.len())?;
    lines(out, mesh.nodes.len(), |i, text| {
        let [x, y, z] = mesh.nodes[i];
        let _ = writeln!(text, "{x:?} {y:?} {z:?} 0");
    })?;
    let kind = if mesh.middles.is_empty() { "" } else { "P2" };
    let row = |text: &mut String, nodes: &mut dyn Iterator<Item = u32>, reference: usize| {
        for n in nodes {
            push(text, n as usize + 1);
            text.push(' ');
        }
        push(text, reference);
        text.push('\n');
    };
    writeln!(out, "Triangles{kind}\n{}", faces.len())?;
    lines(out, faces.len(), |i, text| {
        let (f, s) = faces[i];
        row(text, &mut mesh.face(f).into_iter().chain(mesh.face_middles(f).into_iter().flatten()), s + 1);
    })?;
    writeln!(out, "Tetrahedra{kind}\n{}", mesh.tets.len())?;
    lines(out, mesh.tets.len(), |i, text| {
        let middles = mesh.middles.get(i).into_iter().flatten().copied();
        row(text, &mut mesh.tets[i].into_iter().chain(middles), mesh.domain[i] as usize + 1);
    })?;
    writeln!(out, "End")
}
