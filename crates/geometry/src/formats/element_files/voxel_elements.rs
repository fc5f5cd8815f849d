//! Files of voxels as finite elements: Abaqus and CalculiX, Gmsh 2.2, VTK.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{FeText, abaqus, lines, push};
use crate::fe_mesh::{HexMesh, fraction_classes};
use crate::formats::vtu::{ArrayValues, Cells};

/// A format of voxels: suffix, what it is, and what writes a mesh.
pub type HexFormat = (&'static str, &'static str, fn(&HexMesh, &FeText, &mut dyn Write) -> io::Result<()>);

/// The formats of voxels as finite elements.
pub const HEX_FORMATS: [HexFormat; 4] = [
    ("inp", "Abaqus, CalculiX", write_inp),
    ("msh", "Gmsh 2.2", write_msh),
    ("msh2", "Gmsh 2.2", write_msh),
    ("vtu", "VTK, ParaView", write_vtu),
];

/// C3D8 elements in sets by their solid fraction, in twentieths; Young's modulus is that of the solid times the mean fraction of the set.
fn write_inp(mesh: &HexMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    abaqus::nodes(&text.title, &mesh.nodes, out)?;
    let classes = fraction_classes(&mesh.fraction);
    for (name, of) in &classes {
        writeln!(out, "*ELEMENT, TYPE=C3D8, ELSET={name}")?;
        lines(out, of.len(), |k, text| abaqus::element(text, of[k], mesh.hexes[of[k]].into_iter()))?;
    }
    let names: Vec<&str> = classes.iter().map(|c| c.0.as_str()).collect();
    writeln!(out, "*ELSET, ELSET=SOLID")?;
    names.iter().try_for_each(|name| writeln!(out, "{name},"))?;
    abaqus::sets(&mesh.sets, &[1, 2, 3, 4, 5, 6], out)?;
    if text.held.is_empty() && text.loads.is_empty() {
        return Ok(());
    }
    let [e, nu] = text.elastic(0);
    for (name, of) in &classes {
        let mean = of.iter().map(|i| mesh.fraction[*i]).sum::<f64>() / of.len() as f64;
        writeln!(out, "*MATERIAL, NAME={name}\n*ELASTIC\n{:?}, {nu:?}", e * mean)?;
        writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL={name}")?;
    }
    let forces = |name: &str, load| mesh.set(name).map(|s| mesh.nodal_forces(s, load));
    abaqus::step(text, (&["SOLID"], 3), &forces, out)
}

fn write_msh(mesh: &HexMesh, _: &FeText, out: &mut dyn Write) -> io::Result<()> {
    // Each face has one group: its smallest set.
    let mut order: Vec<usize> = (0..mesh.sets.len()).collect();
    order.sort_by_key(|s| std::cmp::Reverse(mesh.sets[*s].faces.len()));
    let mut group = std::collections::BTreeMap::new();
    for s in order {
        mesh.sets[s].faces.iter().for_each(|f| _ = group.insert(*f, s));
    }
    let faces: Vec<((u32, u8), usize)> = group.into_iter().collect();
    let used: std::collections::BTreeSet<usize> = faces.iter().map(|f| f.1).collect();
    let solid = mesh.sets.len() + 1;
    writeln!(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}", used.len() + 1)?;
    used.iter().try_for_each(|s| writeln!(out, "2 {} \"{}\"", s + 1, mesh.sets[*s].name))?;
    writeln!(out, "3 {solid} \"SOLID\"\n$EndPhysicalNames\n$Nodes\n{}", mesh.nodes.len())?;
    lines(out, mesh.nodes.len(), |i, text| {
        let [x, y, z] = mesh.nodes[i];
        let _ = writeln!(text, "{} {x:?} {y:?} {z:?}", i + 1);
    })?;
    writeln!(out, "$EndNodes\n$Elements\n{}", faces.len() + mesh.hexes.len())?;
    let row = |text: &mut String, head: std::fmt::Arguments, nodes: &[u32]| {
        let _ = text.write_fmt(head);
        for n in nodes {
            text.push(' ');
            push(text, *n as usize + 1);
        }
        text.push('\n');
    };
    lines(out, faces.len(), |i, text| {
        let (f, s) = faces[i];
        row(text, format_args!("{} 3 2 {} {}", i + 1, s + 1, s + 1), &mesh.face(f));
    })?;
    lines(out, mesh.hexes.len(), |i, text| {
        row(text, format_args!("{} 5 2 {solid} {solid}", faces.len() + i + 1), &mesh.hexes[i]);
    })?;
    // Some readers take no data of a part of the elements: faces have the fraction of their hexahedron.
    let all = faces.len() + mesh.hexes.len();
    writeln!(out, "$EndElements\n$ElementData\n1\n\"fraction\"\n1\n0.0\n3\n0\n1\n{all}")?;
    lines(out, all, |i, text| {
        let hex = faces.get(i).map_or_else(|| i - faces.len(), |(f, _)| f.0 as usize);
        let _ = writeln!(text, "{} {:?}", i + 1, mesh.fraction[hex]);
    })?;
    writeln!(out, "$EndElementData")
}

fn write_vtu(mesh: &HexMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let cells = Cells {
        note: "voxels: fraction is the share that is solid",
        nodes: &mesh.nodes,
        sets: &mesh.sets,
        kind: 12,
        width: 8,
        count: mesh.hexes.len(),
        data: &[("fraction", ArrayValues::Numbers(&mesh.fraction))],
        fields: &text.fields,
    };
    cells.write(|| mesh.hexes.iter().flatten().copied(), out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fe_mesh::Load;
    use crate::math::Aabb;

    #[test]
    fn every_format_has_elements_sets_and_fractions() {
        // Three round an empty one, whose faces are the surface within the grid.
        let bounds = Aabb { min: [0.0; 3], max: [2.0, 2.0, 1.0] };
        let mesh = HexMesh::of(&bounds, [2, 2, 1], &[1.0, 0.5, 0.51, 0.0], 0.1);
        let loads = vec![("X1".to_string(), Load::Traction([1.0, 0.0, 0.0]))];
        let text = FeText {
            title: "three".into(),
            elastic: vec![[10.0, 0.3]],
            held: vec!["X0".into()],
            loads,
            ..FeText::default()
        };
        for (suffix, _, write) in HEX_FORMATS {
            let mut bytes = Vec::new();
            write(&mesh, &text, &mut bytes).unwrap();
            let made = String::from_utf8_lossy(&bytes);
            let word = if suffix == "inp" { "FRACTION_055" } else { "fraction" };
            assert!(["X0", "SURFACE", word].iter().all(|w| made.contains(w)), "{suffix}");
            // Classes are closed above.
            let modulus = "*MATERIAL, NAME=FRACTION_050\n*ELASTIC\n5.0, 0.3\n";
            assert!(suffix != "inp" || made.contains(modulus) && made.contains("C3D8, ELSET=FRACTION_100\n1, 1, 2,"));
        }
    }
}
