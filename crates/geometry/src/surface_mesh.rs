//! A surface mesh whose triangles are marked as cut or lattice surface.

use std::ops::Range;

use crate::mesh::Mesh;

/// A surface mesh and which of its triangles lie on the region's boundary rather than on the lattice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// For each triangle, whether it is a cut (on the region's boundary).
    pub cut: Vec<bool>,
}

impl SurfaceMesh {
    /// The lattice alone, without its cuts: open where the region ends.
    pub fn uncapped(&self) -> SurfaceMesh {
        let mut runs: Vec<Range<u64>> = Vec::new();
        for i in (0u64..).zip(&self.cut).filter(|(_, cut)| !**cut).map(|(i, _)| i) {
            match runs.last_mut() {
                Some(r) if r.end == i => r.end += 1,
                _ => runs.push(i..i + 1),
            }
        }
        self.select(&runs)
    }

    /// The part made of these ranges of triangles; vertices keep their order.
    pub fn select(&self, ranges: &[Range<u64>]) -> SurfaceMesh {
        let ranges = || ranges.iter().map(|r| r.start as usize..r.end as usize);
        let mut names = vec![u32::MAX; self.mesh.vertices.len()];
        for v in ranges().flat_map(|r| self.mesh.triangles[r].as_flattened()) {
            names[*v as usize] = 0;
        }
        let mut out = SurfaceMesh::default();
        for (name, place) in names.iter_mut().zip(&self.mesh.vertices) {
            if *name == 0 {
                *name = out.mesh.vertices.len() as u32;
                out.mesh.vertices.push(*place);
            }
        }
        for run in ranges() {
            let triangles = self.mesh.triangles[run.clone()].iter();
            out.mesh.triangles.extend(triangles.map(|t| t.map(|v| names[v as usize])));
            out.cut.extend_from_slice(&self.cut[run]);
        }
        out
    }
}
