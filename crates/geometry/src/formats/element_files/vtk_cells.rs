//! Finite element meshes as VTK unstructured grids: domains, sets. Cell types 10 (tetrahedron) and 24 (quadratic tetrahedron).

use std::io::{self, Write};

use super::FeText;
use crate::fe_mesh::{FeField, FeMesh, MIDDLES};
use crate::formats::vtu::{ArrayValues, Cells};

pub(super) fn write(mesh: &FeMesh, text: &FeText, out: &mut dyn Write) -> io::Result<()> {
    let width = if mesh.middles.is_empty() { 4 } else { 10 };
    let mut data = vec![("domain", ArrayValues::Labels(&mesh.domain))];
    if !mesh.fraction.is_empty() {
        data.push(("fraction", ArrayValues::Numbers(&mesh.fraction)));
    }
    let mut fields = text.fields.clone();
    if !mesh.axes.is_empty() {
        let values = mesh.axes.iter().flatten().flatten().copied().collect();
        fields.insert(0, FeField { name: "orientation".into(), components: 9, at_nodes: false, values });
    }
    let cells = Cells {
        note: &format!("domains, from 0: {}", mesh.domains.join(", ")),
        nodes: &mesh.nodes,
        sets: &mesh.sets,
        kind: if width == 4 { 10 } else { 24 },
        width,
        count: mesh.tets.len(),
        data: &data,
        fields: &fields,
    };
    let corners = |i: usize| mesh.tets[i].into_iter();
    let middles = |i: usize| mesh.middles.get(i).into_iter().flat_map(|m| MIDDLES.map(|k| m[k]));
    cells.write(|| (0..mesh.tets.len()).flat_map(move |i| corners(i).chain(middles(i))), out)
}
