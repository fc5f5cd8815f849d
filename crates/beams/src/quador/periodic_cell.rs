//! Beams of one radius in a periodic cell: the volume of the cell's part of the infinite lattice.

use std::collections::HashMap;

use rayon::prelude::*;

use super::{Fillet, Quadors};
use crate::graph::{Beam, Graph, HubBall, PeriodicBeam, PeriodicGraph, Profile};
use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, add, determinant, scale};

/// Cells about one cell, on each side along each edge, whose beams may touch its own: a beam reaches no further than one.
const NEAR: i32 = 2;

/// A periodic graph whose cell has given edges.
#[derive(Clone, Copy, Debug)]
pub struct PeriodicCell<'a> {
    /// The graph.
    pub graph: &'a PeriodicGraph,
    /// The three edges of the cell, mm.
    pub edges: Mat3,
    /// Profile of the beams; `None` for cylinders.
    pub profile: Option<Profile>,
    /// Fillets.
    pub fillet: Fillet,
}

impl PeriodicCell<'_> {
    /// Volume of the cell, mm³.
    pub fn size(&self) -> f64 {
        determinant(&self.edges).abs()
    }

    /// Lengths of the beams, mm.
    pub fn lengths(&self) -> impl Iterator<Item = f64> {
        self.graph.beams.iter().map(|b| geometry::math::norm(self.place(self.graph.vector(b))))
    }

    /// The position at a phase, mm.
    fn place(&self, phase: Vec3) -> Vec3 {
        (0..3).fold([0.0; 3], |sum, a| add(sum, scale(self.edges[a], phase[a])))
    }

    fn hub(&self, node: usize, cell: [i32; 3], radius: f64) -> HubBall {
        HubBall { center: self.place(add(self.graph.nodes[node], cell.map(f64::from))), radius }
    }

    fn profile(&self, radius: f64) -> Profile {
        self.profile.unwrap_or(Profile::Mid(radius))
    }

    /// The nodes of one cell with all their beams. A beam to another cell is there twice, from either of its ends to a hub of its own.
    fn stars(&self, radius: f64) -> Graph {
        let mut out = Graph::default();
        out.hubs.extend((0..self.graph.nodes.len()).map(|n| self.hub(n, [0; 3], radius)));
        let profile = self.profile(radius);
        for PeriodicBeam { ends: [a, b], shift } in &self.graph.beams {
            let ([a, b], next) = ([*a as u32, *b as u32], out.hubs.len() as u32);
            if *shift == [0; 3] {
                out.beams.push(Beam { ends: [a, b], profile });
                continue;
            }
            out.hubs.push(self.hub(b as usize, *shift, radius));
            out.hubs.push(self.hub(a as usize, shift.map(|s| -s), radius));
            out.beams.push(Beam { ends: [a, next], profile });
            out.beams.push(Beam { ends: [next + 1, b], profile });
        }
        out
    }

    /// The beams of the cells from `from` to `to` along each edge, those of cell [0, 0, 0] first.
    fn block(&self, from: i32, to: i32, radius: f64) -> Graph {
        let mut out = Graph::default();
        let mut numbers: HashMap<([i32; 3], usize), u32> = HashMap::new();
        let line = || from..=to;
        let mut cells: Vec<[i32; 3]> =
            line().flat_map(|x| line().flat_map(move |y| line().map(move |z| [x, y, z]))).collect();
        cells.sort_by_key(|cell| *cell != [0; 3]);
        let profile = self.profile(radius);
        for cell in cells {
            for beam in &self.graph.beams {
                let there = [0, 1, 2].map(|a| cell[a] + beam.shift[a]);
                let ends = [(cell, beam.ends[0]), (there, beam.ends[1])].map(|(cell, node)| {
                    *numbers.entry((cell, node)).or_insert_with(|| {
                        out.hubs.push(self.hub(node, cell, radius));
                        out.hubs.len() as u32 - 1
                    })
                });
                out.beams.push(Beam { ends, profile });
            }
        }
        out
    }

    /// Volume of the solid in the cell (mm³), to 1e-10; `None` if beams of a hub overlap at mid length.
    ///
    /// # Errors
    /// Beams that have no quadric; faces that cannot be resolved.
    pub fn volume(&self, radius: f64) -> Result<Option<f64>, Fault> {
        let quadors = Quadors::new(&self.stars(radius), self.fillet)?;
        let own = self.graph.nodes.len();
        if quadors.overlaps().iter().any(|o| o.hub < own) {
            return Ok(None);
        }
        let classes = quadors.classes();
        let mut count = vec![0; classes.sample.len()];
        (0..own).for_each(|hub| count[classes.of[hub] as usize] += 1);
        let each = classes.sample.par_iter().zip(&count).filter(|(_, n)| **n > 0);
        let volumes: Vec<f64> =
            each.map(|(hub, n)| Ok(f64::from(*n) * quadors.hub_volume(*hub)?)).collect::<Result<_, Fault>>()?;
        Ok(Some(volumes.iter().sum()))
    }

    /// Whether beams of the lattice run into or touch each other without a common node.
    ///
    /// # Errors
    /// Beams that have no quadric.
    pub fn collides(&self, radius: f64) -> Result<bool, Fault> {
        let quadors = Quadors::new(&self.block(-NEAR, NEAR, radius), Fillet::None)?;
        // Collisions are sorted by the first beam, and those of this cell come first.
        Ok(quadors.collisions().first().is_some_and(|c| (c.beams[0] as usize) < self.graph.beams.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;
    use crate::graph::named;

    /// The volume of a block of n³ cells is a polynomial in n, and its third difference six times the volume of a cell.
    #[test]
    fn the_volume_of_a_cell_is_what_a_block_gains_by_it() {
        let mut random = Random(5);
        let mut done = 0;
        for name in ["sc", "bcc", "fcc", "octet", "diamond", "kelvin", "re_entrant", "octahedra"] {
            let graph = named(name).and_then(|u| u.graph().ok()).expect("a cell");
            for (k, fillet) in [Fillet::None, Fillet::Auto, Fillet::Tau(0.7)].into_iter().enumerate() {
                // Edges of random lengths and directions, up to some 20 degrees from a right angle.
                let edges = [0, 1, 2].map(|a| {
                    let mut edge = scale(random.direction(), random.next());
                    edge[a] += 5.0 + 2.0 * random.next();
                    edge
                });
                let cell = PeriodicCell { graph: &graph, edges, profile: None, fillet };
                let radius = (0.04 + 0.02 * random.next()) * cell.lengths().fold(f64::INFINITY, f64::min);
                let Some(one) = cell.volume(radius).expect("cylinders") else { continue };
                assert!(!cell.collides(radius).expect("cylinders"), "{name} {k}");
                let block = |n: i32| {
                    let quadors = Quadors::new(&cell.block(0, n - 1, radius), fillet).expect("a block");
                    quadors.volume()
                };
                let [Ok(a), Ok(b), Ok(c), Ok(d)] = [2, 3, 4, 5].map(block) else { continue };
                let gained = (d - 3.0 * c + 3.0 * b - a) / 6.0;
                // Blocks are known to 1e-10 and their differences are eight times theirs.
                assert!((gained - one).abs() < 8e-10 * d, "{name} {fillet:?}: {gained} {one}");
                assert!(one < cell.size());
                done += 1;
            }
        }
        assert!(done > 12, "{done}");
    }

    #[test]
    fn beams_that_meet_without_a_node_are_found_across_cells() {
        // The edges of cells that are flat along z: layers of a square net, and beams along z between them.
        let graph = named("sc").and_then(|u| u.graph().ok()).expect("a cell");
        let cell = |z: f64| PeriodicCell {
            graph: &graph,
            edges: [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, z]],
            profile: None,
            fillet: Fillet::None,
        };
        assert!(!cell(1.01).collides(0.5).expect("cylinders"));
        assert!(cell(0.99).collides(0.5).expect("cylinders"));
    }
}
