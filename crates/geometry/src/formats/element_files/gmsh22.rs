//! Gmsh's MSH 2.2, ASCII, with physical names, for programs that read no later version (gmshToFoam, ElmerGrid).
//!
//! Source: Gmsh reference manual, section MSH file format version 2. An element has one physical group: each face that of its smallest set.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::gmsh_entities::{surfaces, write_periodic};
use super::gmsh41::MIDDLES;
use super::{FeText, lines, push};
use crate::fe_mesh::FeMesh;

pub(super) fn write(mesh: &FeMesh, _: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let groups = mesh.smallest_sets().into_iter().map(|(f, s)| (f, vec![s])).collect();
    let surfaces = surfaces(mesh, &groups);
    let mut used: Vec<usize> = surfaces.iter().flat_map(|s| &s.sets).copied().collect();
    used.sort_unstable();
    used.dedup();
    let sets = mesh.sets.len();
    writeln!(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}", used.len() + mesh.domains.len())?;
    used.iter().try_for_each(|s| writeln!(out, "2 {} \"{}\"", s + 1, mesh.sets[*s].name))?;
    for (d, name) in mesh.domains.iter().enumerate() {
        writeln!(out, "3 {} \"{name}\"", sets + d + 1)?;
    }
    writeln!(out, "$EndPhysicalNames\n$Nodes\n{}", mesh.nodes.len())?;
    lines(out, mesh.nodes.len(), |i, text| {
        let [x, y, z] = mesh.nodes[i];
        let _ = writeln!(text, "{} {x:?} {y:?} {z:?}", i + 1);
    })?;
    let (triangle, tetrahedron) = if mesh.middles.is_empty() { (2, 4) } else { (9, 11) };
    let faces: Vec<(usize, usize, (u32, u8))> =
        (1..).zip(&surfaces).flat_map(|(i, s)| s.faces.iter().map(move |f| (s.sets[0] + 1, i, *f))).collect();
    writeln!(out, "$EndNodes\n$Elements\n{}", faces.len() + mesh.tets.len())?;
    // Number and kind, two tags: the physical group and the entity.
    let element = |text: &mut String, head: [usize; 4], nodes: &mut dyn Iterator<Item = u32>| {
        let [number, kind, group, entity] = head;
        let _ = write!(text, "{number} {kind} 2 {group} {entity}");
        for n in nodes {
            text.push(' ');
            push(text, n as usize + 1);
        }
        text.push('\n');
    };
    lines(out, faces.len(), |i, text| {
        let (group, entity, f) = faces[i];
        let mut nodes = mesh.face(f).into_iter().chain(mesh.face_middles(f).into_iter().flatten());
        element(text, [i + 1, triangle, group, entity], &mut nodes);
    })?;
    lines(out, mesh.tets.len(), |i, text| {
        let middles = mesh.middles.get(i).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
        let group = sets + mesh.domain[i] as usize + 1;
        let mut nodes = mesh.tets[i].into_iter().chain(middles);
        element(text, [faces.len() + i + 1, tetrahedron, group, group], &mut nodes);
    })?;
    writeln!(out, "$EndElements")?;
    write_periodic(mesh, &surfaces, "Affine", out)
}
