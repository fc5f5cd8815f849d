//! The ports of a cell: the connected parts of its solid's trace on a face, and the lines that tie them to those of neighbouring faces.
//!
//! The trace is the same on all faces of a tetrahedron and symmetric in its three coordinates, so a port and the one across an edge of
//! the face are mirror images, and a line from a port to the edge goes on to the other's.

use super::{FaceGrid, NodalLevel, Tiling};
use crate::cell::Part;
use crate::cell::tet::{Bary, TetCell};
use geometry::math::{cross, norm, sub};
use geometry::union_find::{find, unite};

/// Steps along an edge of a face on which its trace is found.
const STEPS: usize = 48;
/// Coordinates of a port's middle within this of ⅓ are the face's middle.
const MIDDLE: f64 = 0.05;

/// The ports on a face in the coordinates of its corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Ports {
    /// Whether some reach the edges of the face: the edges of the boundary's triangles tie them.
    pub at_edges: bool,
    /// The middles of those that do not, each with its area as a share of the face.
    pub inside: Vec<[f64; 3]>,
    /// Mean area of a port, in faces, with what it has on the other faces about an edge or a node.
    pub area: f64,
}

impl Ports {
    /// The ports of a part of a cell at level `iso`.
    pub fn new(cell: &TetCell, part: Part, iso: f64) -> Ports {
        let grid = FaceGrid::new(STEPS);
        let at = &grid.points;
        let share = |k: &[usize; 3]| k.map(|v| v as f64 / STEPS as f64);
        let barys: Vec<Bary> = at.iter().map(share).map(|[a, b, c]| [a, b, c, 0.0]).collect();
        let (mut f, mut slopes) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
        cell.gradients(&barys, &mut f, &mut slopes);
        let solid: Vec<bool> = f
            .iter()
            .map(|f| match part {
                Part::Sheet => f.abs() <= iso,
                Part::Lower => *f <= iso,
                Part::Upper => *f >= iso,
            })
            .collect();
        let mut root: Vec<u32> = (0..at.len() as u32).collect();
        for [a, b] in grid.edges().filter(|e| e.iter().all(|n| solid[*n])) {
            unite(&mut root, a as u32, b as u32);
        }
        // For each port: sum of weights and of places, and the greatest number of coordinates that are zero.
        let mut found: Vec<(u32, f64, [f64; 3], usize)> = Vec::new();
        for (n, k) in at.iter().enumerate().filter(|n| solid[n.0]) {
            let r = find(&mut root, n as u32);
            let zeros = k.iter().filter(|v| **v == 0).count();
            // A node counts by the share of its surroundings that is in the face.
            let weight = [1.0, 0.5, 1.0 / 6.0][zeros];
            let i = found.iter().position(|f| f.0 == r).unwrap_or_else(|| {
                found.push((r, 0.0, [0.0; 3], 0));
                found.len() - 1
            });
            let port = &mut found[i];
            port.1 += weight;
            share(k).iter().zip(&mut port.2).for_each(|(v, s)| *s += weight * v);
            port.3 = port.3.max(zeros);
        }
        let whole = (STEPS * STEPS) as f64 / 2.0;
        // Their ratios from the steps, their sum exactly, so that it is continuous in the level.
        let exact = cell.face_fraction(part, iso) / (found.iter().map(|p| p.1).sum::<f64>() / whole).max(1e-12);
        let areas: Vec<f64> = found.iter().map(|p| exact * p.1 / whole * [1.0, 2.0, 6.0][p.3]).collect();
        let inside = found.iter().filter(|p| p.3 == 0).map(|p| p.2.map(|v| v / p.1)).collect();
        Ports {
            at_edges: found.iter().any(|p| p.3 > 0),
            inside,
            area: areas.iter().sum::<f64>() / areas.len().max(1) as f64,
        }
    }

    /// The lines of a face that tie its ports to the edges, as pairs of coordinates, and whether the edges themselves are needed
    /// too. Ends on an edge are the same on both sides of it.
    pub fn lines(&self) -> (Vec<[[f64; 3]; 2]>, bool) {
        let mut out = Vec::new();
        let mut edges = self.at_edges;
        for p in &self.inside {
            if p.iter().all(|v| (v - 1.0 / 3.0).abs() < MIDDLE) {
                for i in 0..3 {
                    let middle = core::array::from_fn(|k| if k == i { 0.0 } else { 0.5 });
                    out.push([[1.0 / 3.0; 3], middle]);
                }
                continue;
            }
            // Ports off the middle are several, and joined by the edges.
            edges = true;
            let near = (0..3).min_by(|a, b| p[*a].total_cmp(&p[*b])).unwrap_or(0);
            let rest = 1.0 - p[near];
            out.push([*p, core::array::from_fn(|k| if k == near { 0.0 } else { p[k] / rest })]);
        }
        (out, edges)
    }
}

impl Ports {
    /// The radius of the circle in an opening between its lines and edges, in edges of a regular triangle.
    pub(super) fn opening(&self) -> f64 {
        let (lines, edges) = self.lines();
        match (lines.is_empty(), edges) {
            // Triangles.
            (true, _) => 3f64.sqrt() / 6.0,
            // Hexagons about nodes.
            (false, false) => 0.5,
            // Kites from a node to the middle of a triangle.
            (false, true) => 0.25 * (3f64.sqrt() - 1.0),
        }
    }
}

impl Tiling {
    /// The ports at the mean level; where cells are mixed those of the first at the fraction of the whole, tied along edges too.
    pub fn ports(&self) -> Ports {
        let cell = &self.cells[0];
        if self.cells.len() == 1 {
            return Ports::new(&cell.cell, self.part, self.mean_level() * cell.scale);
        }
        let (volume, solid) = self.volumes();
        Ports { at_edges: true, ..Ports::new(&cell.cell, self.part, cell.cell.iso(self.part, solid / volume)) }
    }

    /// The radius (mm) of a disc of a port's area on a mean face of the boundary.
    pub fn port_radius(&self) -> f64 {
        let faces = self.map.boundary_nodes();
        let area = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|n| self.map.nodes()[n as usize]);
            0.5 * norm(cross(sub(b, a), sub(c, a)))
        };
        let mean = faces.iter().map(area).sum::<f64>() / faces.len().max(1) as f64;
        (self.ports().area * mean / core::f64::consts::PI).sqrt()
    }

    /// Whether points of a tetrahedron are solid, by its own coordinates.
    pub fn solid_in(&self, t: usize, at: &[Bary]) -> Vec<bool> {
        let at: Vec<(usize, Bary)> = at.iter().map(|l| (t, *l)).collect();
        self.known_in(&at, false).into_iter().map(|k| self.cut.value(k.f, k.t) <= 0.0).collect()
    }

    /// The tiling with its surface moved: solid where its field was at most `by`. The half-level of a sheet stays positive.
    #[must_use]
    pub fn with_level_shift(mut self, by: f64) -> Tiling {
        let by = if self.part == Part::Upper { -by } else { by };
        let least = if self.part == Part::Sheet { 1e-6 } else { f64::NEG_INFINITY };
        self.level = match &self.level {
            NodalLevel::Same(t) => NodalLevel::Same((t + by).max(least)),
            NodalLevel::Nodes(of) => {
                NodalLevel::Nodes(of.iter().map(|t| (t + by).max(least)).collect::<Vec<f64>>().into())
            }
        };
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tet::named_tet_cell;

    #[test]
    fn ports_are_found_where_they_are() {
        let of = |name: &str, fraction: f64| {
            let named = named_tet_cell(name).unwrap_or_else(|| panic!("{name}"));
            let cell = named.cell().unwrap_or_else(|f| panic!("{f}"));
            let iso = cell.iso(named.part, fraction);
            (Ports::new(&cell, named.part, iso), cell.face_fraction(named.part, iso), cell.count(named.part, iso).ports)
        };
        for (name, fraction) in [("diamond", 0.25), ("primitive", 0.4), ("iwp", 0.3), ("diamond_sheet", 0.3)] {
            let (ports, share, count) = of(name, fraction);
            assert!(ports.at_edges || !ports.inside.is_empty(), "{name}");
            if !ports.at_edges {
                // Within the face: as many as are counted there, and their areas are the face's.
                assert_eq!(ports.inside.len(), count, "{name}");
                assert!((ports.area * count as f64 - share).abs() < 1e-9, "{name}: {ports:?} {share}");
            }
            let (lines, edges) = ports.lines();
            assert!(edges || lines.len() == 3 * ports.inside.len(), "{name}: {lines:?}");
            for [from, to] in lines {
                // From a port to the face's edge, within the face.
                assert!(ports.inside.contains(&from) || from == [1.0 / 3.0; 3], "{name}");
                assert!(to.contains(&0.0) && (to.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{name}: {to:?}");
            }
        }
    }
}
