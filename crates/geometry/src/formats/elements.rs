//! Finite elements: what unstructured grids hold, and tetrahedra made of them.

use std::collections::BTreeMap;

use crate::fault::{Fault, counted};
use crate::math::{Vec3, add, scale};
use crate::tetmesh::{CUBE, TetMesh, volume};

/// Points and cells; kinds are VTK's numbers of cell types.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    /// The points.
    pub points: Vec<Vec3>,
    /// The points of each cell, one cell after the other; corners first.
    pub connectivity: Vec<u32>,
    /// Where each cell ends in `connectivity`.
    pub ends: Vec<usize>,
    /// The kind of each cell.
    pub kinds: Vec<u8>,
}

/// A kind of cell that is a volume: its name, its corners, and its faces by corners (seen from outside counter-clockwise).
struct Solid {
    name: &'static str,
    corners: usize,
    faces: &'static [&'static [usize]],
}

/// What VTK's number of a cell type is, if it is a volume; quadratic ones are taken by their corners.
fn solid(kind: u8) -> Option<Solid> {
    let (name, corners, faces): (_, _, &[&[usize]]) = match kind {
        10 | 24 => ("tetrahedron", 4, &[]),
        11 => ("voxel", 8, &[&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]]),
        12 | 25 | 29 => (
            "hexahedron",
            8,
            &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 4, 7, 3], &[1, 2, 6, 5]],
        ),
        // VTK's wedge begins with the triangle whose normal points out of it.
        13 | 26 => ("wedge", 6, &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[0, 2, 5, 3]]),
        14 | 27 => ("pyramid", 5, &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]]),
        _ => return None,
    };
    Some(Solid { name, corners, faces })
}

impl Elements {
    /// From the numbers of a file.
    ///
    /// **Errors**: points that are not finite; volumes with corners that are not there.
    pub(super) fn of_numbers(
        place: &[f64],
        connectivity: &[f64],
        ends: &[f64],
        kinds: &[f64],
    ) -> Result<Elements, Fault> {
        let elements = Elements {
            points: place.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
            // What is no index becomes one that is not there.
            connectivity: connectivity
                .iter()
                .map(|v| if *v >= 0.0 && *v < f64::from(u32::MAX) { *v as u32 } else { u32::MAX })
                .collect(),
            ends: ends.iter().map(|v| *v as usize).collect(),
            kinds: kinds.iter().map(|v| *v as u8).collect(),
        };
        elements.check()?;
        Ok(elements)
    }

    /// Refuses points that are not finite, cells beyond the connectivity, and volumes with corners that are not there.
    pub fn check(&self) -> Result<(), Fault> {
        let fault = |message: String| Err(Fault::new("", message));
        if let Some(p) = self.points.iter().find(|p| p.iter().any(|c| !c.is_finite())) {
            return fault(format!("a point is at {p:?}; coordinates must be finite"));
        }
        if self.ends.len() != self.kinds.len() {
            return fault(format!("{} ends for {} kinds of cells", self.ends.len(), self.kinds.len()));
        }
        let mut from = 0;
        for (cell, (end, kind)) in self.ends.iter().zip(&self.kinds).enumerate() {
            let Some(points) = self.connectivity.get(from..*end) else {
                return fault(format!("cell {cell} reaches beyond the connectivity"));
            };
            let corners = solid(*kind).map_or(0, |s| s.corners);
            let there = |p: &u32| (*p as usize) < self.points.len();
            if points.len() < corners || !points[..corners].iter().all(there) {
                return fault(format!("cell {cell} names a point that is not there"));
            }
            from = *end;
        }
        Ok(())
    }

    /// The cells that are volumes: number, kind, corners.
    fn solids(&self) -> impl Iterator<Item = (usize, Solid, &[u32])> {
        self.kinds.iter().enumerate().filter_map(|(i, k)| {
            let from = if i == 0 { 0 } else { self.ends[i - 1] };
            let s = solid(*k)?;
            let corners = &self.connectivity[from..from + s.corners];
            Some((i, s, corners))
        })
    }

    /// Tetrahedra that the cells are cut into, and the cell that each is of: enough to look numbers up in them. Cells
    /// that are no volumes are left out.
    pub fn tets(&self) -> (Vec<[u32; 4]>, Vec<u32>) {
        let (mut tets, mut of) = (Vec::new(), Vec::new());
        for (cell, s, corners) in self.solids() {
            let cuts: &[[usize; 4]] = match s.name {
                "tetrahedron" => &[[0, 1, 2, 3]],
                "voxel" => &CUBE,
                "hexahedron" => &[[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
                "wedge" => &[[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]],
                _ => &[[0, 1, 2, 4], [0, 2, 3, 4]],
            };
            for cut in cuts {
                tets.push(cut.map(|c| corners[c]));
                of.push(cell as u32);
            }
        }
        (tets, of)
    }

    /// The tetrahedra as a mesh, and the cell that each is of. With `split`, other volumes are cut up face to face: from a
    /// node in their middle, their quadrilaterals along the diagonal at the corner of the least number, which neighbours
    /// agree on.
    ///
    /// **Errors**: no volumes; without `split`, volumes that are no tetrahedra, with their numbers.
    pub fn tet_mesh(&self, split: bool) -> Result<(TetMesh, Vec<u32>), Fault> {
        let mut others: BTreeMap<&str, usize> = BTreeMap::new();
        let mut mesh = TetMesh { nodes: self.points.clone(), ..TetMesh::default() };
        let mut of = Vec::new();
        for (cell, s, corners) in self.solids() {
            if let (4, &[a, b, c, d]) = (s.corners, corners) {
                mesh.tets.push([a, b, c, d]);
                of.push(cell as u32);
                continue;
            }
            *others.entry(s.name).or_default() += 1;
            if !split {
                continue;
            }
            let at = |n: &u32| self.points[*n as usize];
            let sum = corners.iter().fold([0.0; 3], |sum, n| add(sum, at(n)));
            let middle = mesh.nodes.len() as u32;
            mesh.nodes.push(scale(sum, 1.0 / s.corners as f64));
            let first = mesh.tets.len();
            for face in s.faces {
                let rank = |i: usize| corners[face[i]];
                let least = (0..face.len()).fold(0, |m, i| if rank(i) < rank(m) { i } else { m });
                let around = |i: usize| corners[face[(least + i) % face.len()]];
                for i in 1..face.len() - 1 {
                    // Seen from outside the face turns left, seen from the middle right.
                    mesh.tets.push([around(0), around(i + 1), around(i), middle]);
                    of.push(cell as u32);
                }
            }
            // Programs do not agree on which way round a wedge is.
            let whole: f64 = (first..mesh.tets.len()).map(|i| volume(mesh.corners(i))).sum();
            if whole < 0.0 {
                mesh.tets[first..].iter_mut().for_each(|t| t.swap(0, 1));
            }
        }
        if !split && !others.is_empty() {
            let found: Vec<String> = others
                .iter()
                .map(|(name, n)| match *name {
                    "hexahedron" => {
                        format!("{n} {}", if *n == 1 { "hexahedron" } else { "hexahedra" })
                    }
                    name => counted(*n, name),
                })
                .collect();
            return Err(Fault::new(
                "split",
                format!(
                    "the mesh has {} and {} tetrahedra; give split = true to have them cut into tetrahedra that fit face \
                     to face, or mesh with tetrahedra alone",
                    found.join(", "),
                    mesh.tets.len()
                ),
            ));
        }
        if mesh.tets.is_empty() {
            return Err(Fault::new(
                "",
                "the file holds no volume: tetrahedra are needed, a surface alone is not enough",
            ));
        }
        Ok((mesh, of))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Two hexahedra, a wedge on them, and a pyramid adjacent to them.
    fn mixed() -> Elements {
        let mut points = Vec::new();
        for z in 0..2 {
            for y in 0..2 {
                for x in 0..3 {
                    points.push([f64::from(x), f64::from(y), f64::from(z)]);
                }
            }
        }
        points.extend([[0.0, 0.5, 1.8], [1.0, 0.5, 1.8], [2.7, 0.5, 0.5]]);
        let hex = |x: u32| [x, x + 1, x + 4, x + 3, x + 6, x + 7, x + 10, x + 9];
        Elements {
            points,
            // The wedge's first triangle, 7 10 13, is seen counter-clockwise from outside.
            connectivity: [&hex(0)[..], &hex(1), &[7, 10, 13, 6, 9, 12], &[2, 5, 11, 8, 14]].concat(),
            ends: vec![8, 16, 22, 27],
            kinds: vec![12, 12, 13, 14],
        }
    }

    #[test]
    fn volumes_of_all_kinds_are_cut_face_to_face() {
        let mixed = mixed();
        mixed.check().unwrap();
        let message = mixed.tet_mesh(false).unwrap_err().message;
        assert!(message.contains("2 hexahedra, 1 pyramid, 1 wedge"), "{message}");
        let (mesh, of) = mixed.tet_mesh(true).unwrap();
        assert_eq!(mesh.tets.len(), 12 + 12 + 8 + 6);
        assert_eq!(of.len(), mesh.tets.len());
        let (mesh, found) = mesh.checked().unwrap();
        assert!(!found.turned && found.pieces == 1);
        // Two cubes, half of 1 × 1 × 0.8, a third of 0.7.
        assert!((mesh.volume() - (2.0 + 0.4 + 0.7 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn surfaces_and_missing_points_are_refused() {
        let mut surface = mixed();
        surface.kinds = vec![9; 4];
        assert!(surface.tet_mesh(false).unwrap_err().message.contains("no volume"));
        let mut wrong = mixed();
        wrong.connectivity[3] = 99;
        assert!(wrong.check().unwrap_err().message.contains("cell 0 names a point"));
        let mut short = mixed();
        short.ends[3] = 99;
        assert!(short.check().is_err());
    }
}
