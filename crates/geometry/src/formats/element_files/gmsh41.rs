//! Gmsh's MSH 4.1, ASCII, with physical names.
//!
//! Source: Gmsh reference manual, section MSH file format. Elements make up entities, one for each combination of groups that they belong
//! to: volumes of a domain and the skins and keep zones that they are part of, surfaces of the sets of faces.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write};

use super::gmsh_entities::{Surface, surfaces, write_periodic};
use super::{FeText, lines, push};
use crate::fe_mesh::{FeField, FeMesh};
use crate::math::Aabb;
use crate::tetmesh::EDGES;

/// The order of the edges' nodes, by indices of `EDGES`: the last two are swapped.
pub(super) const MIDDLES: [usize; 6] = [0, 3, 1, 2, 5, 4];

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    debug_assert_eq!(EDGES[5], [2, 3]);
    let domains = mesh.domains.len();
    let mut of_faces: BTreeMap<(u32, u8), Vec<usize>> = BTreeMap::new();
    for (s, set) in mesh.sets.iter().enumerate() {
        set.faces.iter().for_each(|f| of_faces.entry(*f).or_default().push(s));
    }
    let surfaces = surfaces(mesh, &of_faces);
    let volumes = volumes(mesh);
    let named: Vec<usize> = (0..mesh.sets.len()).filter(|s| !mesh.sets[*s].faces.is_empty()).collect();
    let bulk: Vec<usize> = (0..mesh.sets.len()).filter(|s| mesh.sets[*s].bulk).collect();
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{}", domains + named.len() + bulk.len())?;
    for s in &named {
        writeln!(out, "2 {} \"{}\"", s + 1, mesh.sets[*s].name)?;
    }
    for (d, name) in mesh.domains.iter().enumerate() {
        writeln!(out, "3 {} \"{name}\"", d + 1)?;
    }
    for s in &bulk {
        writeln!(out, "3 {} \"{}\"", domains + s + 1, mesh.sets[*s].name)?;
    }
    writeln!(out, "$EndPhysicalNames\n$Entities\n0 0 {} {}", surfaces.len(), volumes.len())?;
    let mut entity = |number: usize, groups: &[usize], nodes: &mut dyn Iterator<Item = u32>| {
        let Aabb { min: a, max: b } = nodes.fold(Aabb::EMPTY, |b, n| b.with(mesh.nodes[n as usize]));
        let groups: String = groups.iter().map(|g| format!(" {}", g + 1)).collect();
        let count = groups.split_whitespace().count();
        writeln!(out, "{number} {:?} {:?} {:?} {:?} {:?} {:?} {count}{groups} 0", a[0], a[1], a[2], b[0], b[1], b[2])
    };
    for (i, s) in (1..).zip(&surfaces) {
        entity(i, &s.sets, &mut s.faces.iter().flat_map(|f| mesh.face(*f)))?;
    }
    for (i, (groups, tets)) in (1..).zip(&volumes) {
        entity(i, groups, &mut tets.iter().flat_map(|t| mesh.tets[*t as usize]))?;
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
    elements(mesh, &surfaces, &volumes, out)?;
    write_periodic(mesh, &surfaces, "16", out)?;
    let order = order(mesh, &surfaces, &volumes);
    if !mesh.fraction.is_empty() {
        of_elements("fraction", (1, &mesh.fraction), &order, out)?;
    }
    if !mesh.axes.is_empty() {
        let axes: Vec<f64> = mesh.axes.iter().flatten().flatten().copied().collect();
        of_elements("orientation", (9, &axes), &order, out)?;
    }
    let mut own = text.fields.iter().filter(|f| !f.at_nodes);
    own.try_for_each(|f| of_elements(&f.name, (f.components, &f.values), &order, out))?;
    text.fields.iter().filter(|f| f.at_nodes).try_for_each(|f| at_nodes(f, out))
}

/// Groups, and the tetrahedra that have them all: the domain's number, and after those of domains those of sets.
type Volume = (Vec<usize>, Vec<u32>);

fn volumes(mesh: &FeMesh) -> Vec<Volume> {
    let mut groups: Vec<Vec<usize>> = mesh.domain.iter().map(|d| vec![*d as usize]).collect();
    for (s, set) in mesh.sets.iter().enumerate().filter(|(_, set)| set.bulk) {
        set.elements.iter().for_each(|t| groups[*t as usize].push(mesh.domains.len() + s));
    }
    let mut volumes: BTreeMap<Vec<usize>, Vec<u32>> = BTreeMap::new();
    (0..).zip(groups).for_each(|(t, of)| volumes.entry(of).or_default().push(t));
    volumes.into_iter().collect()
}

fn elements(mesh: &FeMesh, surfaces: &[Surface], volumes: &[Volume], out: &mut dyn Write) -> io::Result<()> {
    let total = surfaces.iter().map(|s| s.faces.len()).sum::<usize>() + mesh.tets.len();
    writeln!(out, "$EndNodes\n$Elements\n{} {total} 1 {total}", surfaces.len() + volumes.len())?;
    let element = |text: &mut String, number: usize, nodes: &mut dyn Iterator<Item = u32>| {
        push(text, number);
        for n in nodes {
            text.push(' ');
            push(text, n as usize + 1);
        }
        text.push('\n');
    };
    let (triangle, tetrahedron) = if mesh.middles.is_empty() { (2, 4) } else { (9, 11) };
    let mut next = mesh.tets.len() + 1;
    for (i, Surface { faces, .. }) in (1..).zip(surfaces) {
        writeln!(out, "2 {i} {triangle} {}", faces.len())?;
        lines(out, faces.len(), |k, text| {
            let middles = mesh.face_middles(faces[k]).into_iter().flatten();
            element(text, next + k, &mut mesh.face(faces[k]).into_iter().chain(middles));
        })?;
        next += faces.len();
    }
    for (i, (_, tets)) in (1..).zip(volumes) {
        writeln!(out, "3 {i} {tetrahedron} {}", tets.len())?;
        lines(out, tets.len(), |k, text| {
            let t = tets[k] as usize;
            let middles = mesh.middles.get(t).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
            element(text, t + 1, &mut mesh.tets[t].into_iter().chain(middles));
        })?;
    }
    writeln!(out, "$EndElements")
}

/// Numbers and tetrahedra of the elements, in their order, by which some readers go. Some take no data of a part of the elements: faces have
/// those of their tetrahedron.
fn order(mesh: &FeMesh, surfaces: &[Surface], volumes: &[Volume]) -> Vec<(usize, u32)> {
    let faces = surfaces.iter().flat_map(|s| &s.faces).map(|f| f.0);
    let faces = (mesh.tets.len()..).zip(faces);
    let tets = volumes.iter().flat_map(|v| &v.1).map(|t| (*t as usize, *t));
    faces.chain(tets).collect()
}

/// The head of data: a name, the time, the step, components and their number.
fn head(kind: &str, name: &str, components: usize, count: usize, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "${kind}\n1\n\"{name}\"\n1\n0.0\n3\n0\n{components}\n{count}")
}

fn row(text: &mut String, number: usize, values: &[f64]) {
    push(text, number);
    values.iter().for_each(|v| _ = write!(text, " {v:?}"));
    text.push('\n');
}

/// Numbers of each tetrahedron.
fn of_elements(
    name: &str,
    (components, values): (usize, &[f64]),
    order: &[(usize, u32)],
    out: &mut dyn Write,
) -> io::Result<()> {
    head("ElementData", name, components, order.len(), out)?;
    lines(out, order.len(), |i, text| {
        let (number, tet) = order[i];
        row(text, number + 1, &values[tet as usize * components..][..components]);
    })?;
    writeln!(out, "$EndElementData")
}

/// Numbers at nodes.
fn at_nodes(field: &FeField, out: &mut dyn Write) -> io::Result<()> {
    let rows: Vec<&[f64]> = field.values.chunks(field.components).collect();
    head("NodeData", &field.name, field.components, rows.len(), out)?;
    lines(out, rows.len(), |i, text| row(text, i + 1, rows[i]))?;
    writeln!(out, "$EndNodeData")
}
