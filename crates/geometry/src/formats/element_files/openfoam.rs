//! OpenFOAM's polyMesh, ASCII, in metres: points, faces, owner, neighbour, boundary, and cellZones of several domains.
//!
//! Source: OpenFOAM User Guide, section Mesh description.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{lines, push};
use crate::fe_mesh::{FeMesh, PolyFaces};

/// Metres in a millimetre.
const METRE: f64 = 1e-3;

/// A file of the folder `polyMesh`: its name, and what writes it.
pub type PolyFile = (&'static str, fn(&FeMesh, &PolyFaces, &mut dyn Write) -> io::Result<()>);

/// The files of the folder `polyMesh`.
pub const POLY_FILES: [PolyFile; 6] = [
    ("points", points),
    ("faces", faces),
    ("owner", |mesh, f, out| labels(mesh, f, &f.owner, "owner", out)),
    ("neighbour", |mesh, f, out| labels(mesh, f, &f.neighbour, "neighbour", out)),
    ("boundary", boundary),
    ("cellZones", cell_zones),
];

fn header(out: &mut dyn Write, class: &str, name: &str, note: &str) -> io::Result<()> {
    writeln!(
        out,
        "FoamFile\n{{\n    version     2.0;\n    format      ascii;\n    class       {class};\n{note}    location    \
         \"constant/polyMesh\";\n    object      {name};\n}}\n"
    )
}

fn points(mesh: &FeMesh, _: &PolyFaces, out: &mut dyn Write) -> io::Result<()> {
    header(out, "vectorField", "points", "")?;
    writeln!(out, "{}\n(", mesh.nodes.len())?;
    lines(out, mesh.nodes.len(), |i, text| {
        let [x, y, z] = mesh.nodes[i].map(|v| METRE * v);
        let _ = writeln!(text, "({x:?} {y:?} {z:?})");
    })?;
    writeln!(out, ")")
}

fn faces(_: &FeMesh, of: &PolyFaces, out: &mut dyn Write) -> io::Result<()> {
    header(out, "faceList", "faces", "")?;
    writeln!(out, "{}\n(", of.faces.len())?;
    lines(out, of.faces.len(), |i, text| {
        text.push_str("3(");
        for (k, n) in of.faces[i].into_iter().enumerate() {
            if k > 0 {
                text.push(' ');
            }
            push(text, n as usize);
        }
        text.push_str(")\n");
    })?;
    writeln!(out, ")")
}

fn labels(mesh: &FeMesh, of: &PolyFaces, of_faces: &[u32], name: &str, out: &mut dyn Write) -> io::Result<()> {
    let note = format!(
        "    note        \"nPoints:{} nCells:{} nFaces:{} nInternalFaces:{}\";\n",
        mesh.nodes.len(),
        mesh.tets.len(),
        of.faces.len(),
        of.neighbour.len()
    );
    header(out, "labelList", name, &note)?;
    list(of_faces, out)
}

/// A list of numbers from 0.
fn list(numbers: &[u32], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{}\n(", numbers.len())?;
    lines(out, numbers.len(), |i, text| {
        push(text, numbers[i] as usize);
        text.push('\n');
    })?;
    writeln!(out, ")")
}

fn boundary(mesh: &FeMesh, of: &PolyFaces, out: &mut dyn Write) -> io::Result<()> {
    header(out, "polyBoundaryMesh", "boundary", "")?;
    writeln!(out, "{}\n(", of.patches.len())?;
    for patch in &of.patches {
        let name = patch.name.as_str();
        let solid = matches!(name, "LATTICE" | "CUT" | "SKIN" | "NET" | "REST")
            || name.starts_with("KEEP_")
            || name.starts_with("CORE_");
        let kind = match (&patch.cyclic, solid) {
            (Some(_), _) => "cyclic",
            (None, true) => "wall",
            (None, false) => "patch",
        };
        writeln!(out, "    {}\n    {{\n        type            {kind};", patch.name)?;
        writeln!(out, "        nFaces          {};\n        startFace       {};", patch.count, patch.start)?;
        if let Some((other, axis)) = &patch.cyclic {
            let period =
                if patch.name.ends_with('0') { METRE * mesh.period[*axis] } else { -METRE * mesh.period[*axis] };
            let by: Vec<String> = (0..3).map(|a| format!("{:?}", if a == *axis { period } else { 0.0 })).collect();
            writeln!(out, "        neighbourPatch  {other};\n        transform       translational;")?;
            writeln!(out, "        separationVector ({});\n        matchTolerance  1e-6;", by.join(" "))?;
        }
        writeln!(out, "    }}")?;
    }
    writeln!(out, ")")
}

fn cell_zones(mesh: &FeMesh, _: &PolyFaces, out: &mut dyn Write) -> io::Result<()> {
    header(out, "regIOobject", "cellZones", "")?;
    writeln!(out, "{}\n(", mesh.domains.len())?;
    for (d, name) in mesh.domains.iter().enumerate() {
        let cells: Vec<u32> = (0..mesh.tets.len() as u32).filter(|t| mesh.domain[*t as usize] as usize == d).collect();
        writeln!(out, "{name}\n{{\n    type cellZone;\n    cellLabels List<label>")?;
        list(&cells, out)?;
        writeln!(out, ";\n}}")?;
    }
    writeln!(out, ")")
}
