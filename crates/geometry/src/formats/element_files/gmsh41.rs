//! Gmsh's MSH 4.1, ASCII, with physical names.
//!
//! Source: Gmsh reference manual, section MSH file format. Each domain is a volume; the faces of sets make up surfaces, one for
//! each combination of sets that faces belong to, with the physical tags of all of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, lines, push};
use crate::fe_mesh::FeMesh;
use crate::math::Aabb;
use crate::tetmesh::EDGES;

/// The order of the edges' nodes, by indices of `EDGES`: the last two are swapped.
pub(super) const MIDDLES: [usize; 6] = [0, 3, 1, 2, 5, 4];

pub(super) fn write(mesh: &FeMesh, _: &FeText, out: &mut dyn Write) -> io::Result<()> {
    debug_assert_eq!(EDGES[5], [2, 3]);
    let domains = mesh.domains.len();
    let mut memberships: BTreeMap<(u32, u8), Vec<usize>> = BTreeMap::new();
    for (s, set) in mesh.sets.iter().enumerate() {
        set.faces.iter().for_each(|f| memberships.entry(*f).or_default().push(s));
    }
    let mut surfaces: BTreeMap<Vec<usize>, Vec<(u32, u8)>> = BTreeMap::new();
    memberships.into_iter().for_each(|(f, of)| surfaces.entry(of).or_default().push(f));
    let named: Vec<usize> = (0..mesh.sets.len()).filter(|s| !mesh.sets[*s].faces.is_empty()).collect();
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{}", domains + named.len())?;
    for s in &named {
        writeln!(out, "2 {} \"{}\"", s + 1, mesh.sets[*s].name)?;
    }
    for (d, name) in mesh.domains.iter().enumerate() {
        writeln!(out, "3 {} \"{name}\"", d + 1)?;
    }
    writeln!(out, "$EndPhysicalNames\n$Entities\n0 0 {} {domains}", surfaces.len())?;
    let all = mesh.nodes.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let extent = |b: &Aabb| {
        let [a, c] = [b.min, b.max];
        format!("{:?} {:?} {:?} {:?} {:?} {:?}", a[0], a[1], a[2], c[0], c[1], c[2])
    };
    for (i, (of, faces)) in surfaces.iter().enumerate() {
        let nodes = faces.iter().flat_map(|f| mesh.face(*f));
        let bounds = nodes.fold(Aabb::EMPTY, |b, n| b.with(mesh.nodes[n as usize]));
        let tags: String = of.iter().map(|s| format!(" {}", s + 1)).collect();
        writeln!(out, "{} {} {}{tags} 0", i + 1, extent(&bounds), of.len())?;
    }
    for d in 1..=domains {
        writeln!(out, "{d} {} 1 {d} 0", extent(&all))?;
    }
    let count = mesh.nodes.len();
    writeln!(out, "$EndEntities\n$Nodes\n1 {count} 1 {count}\n3 1 0 {count}")?;
    lines(out, count, |i, text| {
        push(text, i + 1);
        text.push('\n');
    })?;
    lines(out, count, |i, text| {
        let [x, y, z] = mesh.nodes[i];
        let _ = writeln!(text, "{x:?} {y:?} {z:?}");
    })?;
    let faces: usize = surfaces.values().map(Vec::len).sum();
    let total = faces + mesh.tets.len();
    writeln!(out, "$EndNodes\n$Elements\n{} {total} 1 {total}", surfaces.len() + domains)?;
    let quadratic = !mesh.middles.is_empty();
    let mut next = mesh.tets.len() + 1;
    for (i, of) in surfaces.values().enumerate() {
        writeln!(out, "2 {} {} {}", i + 1, if quadratic { 9 } else { 2 }, of.len())?;
        lines(out, of.len(), |k, text| {
            push(text, next + k);
            for n in mesh.face(of[k]).into_iter().chain(mesh.face_middles(of[k]).into_iter().flatten()) {
                text.push(' ');
                push(text, n as usize + 1);
            }
            text.push('\n');
        })?;
        next += of.len();
    }
    for d in 0..domains {
        let of: Vec<usize> = (0..mesh.tets.len()).filter(|i| mesh.domain[*i] as usize == d).collect();
        writeln!(out, "3 {} {} {}", d + 1, if quadratic { 11 } else { 4 }, of.len())?;
        lines(out, of.len(), |k, text| {
            let i = of[k];
            push(text, i + 1);
            let middles = mesh.middles.get(i);
            for n in mesh.tets[i].into_iter().chain(middles.into_iter().flat_map(|m| MIDDLES.map(|k| m[k]))) {
                text.push(' ');
                push(text, n as usize + 1);
            }
            text.push('\n');
        })?;
    }
    writeln!(out, "$EndElements")?;
    if mesh.fraction.is_empty() {
        return Ok(());
    }
    // In the order of the elements above, by which some readers go. Some take no data of a part of the elements: faces have the fraction
    // of their tetrahedron.
    writeln!(out, "$ElementData\n1\n\"fraction\"\n1\n0.0\n3\n0\n1\n{total}")?;
    let of_faces: Vec<u32> = surfaces.values().flatten().map(|f| f.0).collect();
    lines(out, total, |i, text| {
        let (number, tet) = match of_faces.get(i) {
            Some(tet) => (mesh.tets.len() + i, *tet as usize),
            None => (i - of_faces.len(), i - of_faces.len()),
        };
        let _ = writeln!(text, "{} {:?}", number + 1, mesh.fraction[tet]);
    })?;
    writeln!(out, "$EndElementData")
}
