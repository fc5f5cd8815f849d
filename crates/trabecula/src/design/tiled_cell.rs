//! The periodic cell of a lattice over tetrahedra: space filled with equal ones.
//!
//! A mesh of a part repeats nowhere. Of all tetrahedra that fill space by themselves those of the body-centred cubic lattice are nearest to
//! regular ones (dihedral angles of 60° and 90°), and the meshes made here have them wherever no surface is near. Their tiling is cubic, so
//! its figures hardly depend on the direction.

use super::Tiled;
use crate::cell::Part;
use crate::cell::tet::TetCell;
use crate::implicit::Implicit;
use crate::kind::DesignError;
use crate::map::CarrierMesh;
use crate::tiling::{NodalLevel, SpaceFilling, Tiling};
use geometry::fault::Fault;
use geometry::math::Mat3;
use geometry::tetmesh::TetMesh;
use std::sync::Arc;

/// Tetrahedra in a cube of the lattice.
const IN_CUBE: f64 = 12.0;

/// A tetrahedral cell in equal tetrahedra, as a field that repeats at each edge of a cube.
pub(super) struct TiledCell {
    pub field: Arc<dyn Implicit>,
    pub edges: Mat3,
    pub fraction: f64,
    /// The thinnest wall or neck, mm.
    pub wall: Option<f64>,
}

impl TiledCell {
    /// A part of a cell at a solid fraction, in tetrahedra of this volume (mm³) that overlap.
    pub fn new(cell: &Arc<TetCell>, part: Part, fraction: f64, volume: f64, overlap: f64) -> Result<TiledCell, Fault> {
        let edge = (IN_CUBE * volume).cbrt();
        let map = Arc::new(CarrierMesh::new(&body_centred(edge), overlap)?);
        let level = NodalLevel::Same(cell.iso(part, fraction));
        let made = Tiling::new(map, cell.clone(), part, level).with_fraction(Some(&[fraction]));
        let wall = match part {
            Part::Sheet => made.thickness().map(|w| w.min),
            // Without ports there is no neck.
            _ => Some(2.0 * made.port_radius()).filter(|w| *w > 0.0),
        };
        let edges = [0, 1, 2].map(|a| [0, 1, 2].map(|b| if a == b { edge } else { 0.0 }));
        let field: Arc<dyn Implicit> = match SpaceFilling::of(&made, edge) {
            Some(folded) => Arc::new(folded),
            None => Arc::new(made),
        };
        Ok(TiledCell { field, edges, fraction, wall })
    }

    /// Of a lattice, in tetrahedra of the mean volume of its own.
    pub fn of(tiled: &Tiled) -> Result<TiledCell, DesignError> {
        let path = format!("lattice.{}", tiled.name);
        let tiling = &tiled.tiling;
        let [share] = &tiling.cells[..] else {
            let message = "the zones have cells of their own, and no cell is periodic; take a design with one of them";
            return Err(DesignError::new(format!("{path}.cell.tet.zones"), message));
        };
        let Some(level) = tiling.uniform() else {
            let message = "the level varies from tetrahedron to tetrahedron, and no cell is periodic; take one fraction, and several \
                           designs (or `trabecula law --tet`) for the range";
            return Err(DesignError::new(format!("{path}.level"), message));
        };
        let map = &tiling.map;
        let mean = (0..map.len()).map(|t| map.volume(t)).sum::<f64>() / map.len() as f64;
        TiledCell::new(&share.cell, tiling.part, tiling.fraction(level), mean, map.overlap())
            .map_err(|f| DesignError::fault(&path, f))
    }
}

/// The body-centred tetrahedra about the cube from 0 to `edge` (mm) and half a cube farther on all sides.
fn body_centred(edge: f64) -> TetMesh {
    // Corners -1 to 2 of cubes, then their centres.
    let corner = |[x, y, z]: [usize; 3]| (x + 4 * (y + 4 * z)) as u32;
    let centre = |[x, y, z]: [usize; 3]| (64 + x + 3 * (y + 3 * z)) as u32;
    let grid = |n: usize| (0..n * n * n).map(move |i| [i % n, i / n % n, i / (n * n)]);
    let corners = grid(4).map(|at| at.map(|v| edge * (v as f64 - 1.0)));
    let centres = grid(3).map(|at| at.map(|v| edge * (v as f64 - 0.5)));
    let nodes = corners.chain(centres).collect();
    let mut tets = Vec::new();
    for at in grid(3) {
        for axis in (0..3).filter(|a| at[*a] < 2) {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut far = at;
            far[axis] += 1;
            // The corners of the common face, counter-clockwise seen from its upper side.
            let face = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                let mut at = far;
                (at[b], at[c]) = (at[b] + u, at[c] + v);
                corner(at)
            });
            tets.extend((0..4).map(|i| [centre(at), face[i], face[(i + 1) % 4], centre(far)]));
        }
    }
    TetMesh { nodes, tets, zones: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tet::named_tet_cell;
    use crate::field::Field;
    use geometry::math::{Aabb, Vec3, norm, sub};
    use geometry::random::random;

    /// Folding finds what the search in a mesh finds, values and gradients, and its bounds hold.
    #[test]
    fn folded_tetrahedra_are_those_of_the_mesh() {
        let cell = Arc::new(named_tet_cell("diamond").and_then(|c| c.cell().ok()).expect("a cell"));
        let edge = 3.0;
        let map = Arc::new(CarrierMesh::new(&body_centred(edge), 0.0).expect("a mesh"));
        let mut seed = 7;
        for part in [Part::Lower, Part::Sheet, Part::Upper] {
            let tiling = Tiling::new(map.clone(), cell.clone(), part, NodalLevel::Same(0.4));
            let folded = SpaceFilling::of(&tiling, edge).expect("equal tetrahedra");
            let points: Vec<Vec3> = (0..2000).map(|_| [0; 3].map(|_| edge * (0.5 + 0.7 * random(&mut seed)))).collect();
            let both = [&tiling as &dyn Field, &folded].map(|field| {
                let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
                field.gradients(&points, &mut v, &mut g);
                let mut plain = vec![0.0; points.len()];
                field.values(&points, &mut plain);
                assert_eq!(v, plain);
                (v, g)
            });
            let [(v, g), (w, h)] = &both;
            for i in 0..points.len() {
                assert!((v[i] - w[i]).abs() < 1e-9 && norm(sub(g[i], h[i])) < 1e-8, "{:?}", points[i]);
                let half = 0.3 * (1.0 + random(&mut seed));
                let b = Aabb { min: points[i].map(|x| x - half), max: points[i].map(|x| x + half) };
                let bound = folded.bound(&b);
                let inside =
                    points.iter().zip(w).filter(|(p, _)| (0..3).all(|a| (b.min[a]..=b.max[a]).contains(&p[a])));
                inside.for_each(|(p, w)| assert!(bound.lo <= *w && *w <= bound.hi, "{p:?}"));
            }
        }
    }
}
