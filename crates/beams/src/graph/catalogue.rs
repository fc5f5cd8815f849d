//! Catalogue of unit cells. Each is a space group and a few generating beams; the orbit under the group gives all
//! beams, so the symmetry holds by construction. Node counts, valences, lengths and Maxwell's count are computed.

use std::collections::BTreeSet;

use geometry::fault::Fault;
use geometry::math::{Vec3, norm, sub};
use geometry::symmetry::{Group, Operation};

/// A unit cell of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct UnitCell {
    /// Name in designs.
    pub name: &'static str,
    /// Common name or description.
    pub title: &'static str,
    /// Space group symbol.
    pub group: &'static str,
    /// Generating beams: two end points each, in cell edges.
    pub beams: &'static [[Vec3; 2]],
    /// Ratio of the cell edges at which the cell has its regular shape.
    pub aspect: Vec3,
}

/// A periodic graph: nodes in one unit cell, and beams that may end in adjacent cells.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicGraph {
    /// Node positions in the cell, in [0, 1).
    pub nodes: Vec<Vec3>,
    /// The beams, each once.
    pub beams: Vec<PeriodicBeam>,
}

/// A beam of a periodic graph, from a node in the cell to a node in the cell at offset `shift`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PeriodicBeam {
    /// Node indices.
    pub ends: [usize; 2],
    /// Cell offset of the second node.
    pub shift: [i32; 3],
}

const O: Vec3 = [0.0; 3];
const EVEN: Vec3 = [1.0; 3];
/// Edge ratio of a rectangle that holds two regular hexagons.
const HEXAGONAL: Vec3 = [1.0, 1.732_050_807_568_877_2, 1.0];
/// Half face diagonals, half body diagonal, cell edges.
const FACE: [Vec3; 2] = [O, [0.5, 0.5, 0.0]];
const SIDE: [Vec3; 2] = [O, [0.5, 0.0, 0.5]];
const BODY: [Vec3; 2] = [O, [0.5, 0.5, 0.5]];
const EDGE: [Vec3; 2] = [O, [1.0, 0.0, 0.0]];
const UP: [Vec3; 2] = [O, [0.0, 0.0, 1.0]];

const fn cubic(name: &'static str, title: &'static str, group: &'static str, beams: &'static [[Vec3; 2]]) -> UnitCell {
    UnitCell { name, title, group, beams, aspect: EVEN }
}

/// 1 / (2 + √2): edge fraction cut off a truncated cube.
const CUT: f64 = 0.292_893_218_813_452_5;
/// (½ − (1 + √2) s / 2, ½ − s / 2), s = 1 / (1 + 2√2): a truncated cuboctahedron of edge s.
const GREAT: [f64; 2] = [0.184_699_031_259_064_85, 0.369_398_062_518_129_7];
/// 108^(−1/3): Weaire–Phelan cells with plane faces and equal volumes.
const WP: f64 = 0.209_986_841_649_145_5;

/// The catalogue.
static CATALOGUE: [UnitCell; 23] = [
    cubic("sc", "simple cubic", "Pm-3m", &[EDGE]),
    cubic("bcc", "body-centred cubic", "Im-3m", &[BODY]),
    cubic("bccz", "body-centred cubic with beams along z through every node", "I4/mmm", &[BODY, UP]),
    cubic("sc_bcc", "simple and body-centred cubic together", "Pm-3m", &[EDGE, BODY]),
    cubic("fcc", "face-centred cubic: the diagonals of all faces", "Pm-3m", &[FACE]),
    cubic("fccz", "face-centred cubic with the edges along z", "P4/mmm", &[FACE, SIDE, UP]),
    cubic("fbcc", "face- and body-centred cubic together", "Pm-3m", &[FACE, BODY]),
    cubic("fbccz", "face- and body-centred cubic with the edges along z", "P4/mmm", &[FACE, SIDE, BODY, UP]),
    cubic("octet", "octet truss", "Fm-3m", &[FACE]),
    cubic(
        "octahedra",
        "octahedra and cuboctahedra: corners on the middles of edges",
        "Pm-3m",
        &[[[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]],
    ),
    cubic("diamond", "diamond", "Fd-3m:1", &[[O, [0.25, 0.25, 0.25]]]),
    cubic("kelvin", "truncated octahedra", "Im-3m", &[[[0.5, 0.25, 0.0], [0.5, 0.0, 0.25]]]),
    cubic("rhombic_dodecahedron", "rhombic dodecahedra: the graph of fluorite", "Fm-3m", &[[O, [0.25, 0.25, 0.25]]]),
    cubic(
        "weaire_phelan",
        "Weaire–Phelan, plane faces, equal volumes: the graph of clathrate I",
        "Pm-3n",
        &[
            [[WP; 3], [0.5 - WP, 0.5 - WP, 0.5 - WP]],
            [[WP; 3], [0.0, 1.5 * WP, 0.75 * WP]],
            [[0.0, 1.5 * WP, 0.75 * WP], [0.0, 1.5 * WP, -0.75 * WP]],
            [[0.0, 1.5 * WP, 0.75 * WP], [0.0, 0.5, 0.25]],
        ],
    ),
    cubic(
        "truncated_cube",
        "truncated cubes and octahedra",
        "Pm-3m",
        &[[[CUT, 0.0, 0.0], [1.0 - CUT, 0.0, 0.0]], [[CUT, 0.0, 0.0], [0.0, CUT, 0.0]]],
    ),
    cubic(
        "rhombicuboctahedron",
        "rhombicuboctahedra, cuboctahedra and cubes",
        "Pm-3m",
        &[[[0.0, CUT, CUT], [0.0, 1.0 - CUT, CUT]], [[0.0, CUT, CUT], [CUT, 0.0, CUT]]],
    ),
    cubic(
        "truncated_cuboctahedron",
        "truncated cuboctahedra, truncated octahedra and cubes",
        "Pm-3m",
        &[
            [[0.0, GREAT[0], GREAT[1]], [0.0, GREAT[0], 1.0 - GREAT[1]]],
            [[0.0, GREAT[0], GREAT[1]], [0.0, GREAT[1], GREAT[0]]],
            [[0.0, GREAT[0], GREAT[1]], [GREAT[0], 0.0, GREAT[1]]],
        ],
    ),
    cubic("pyrochlore", "tetrahedra joined at corners: kagome in space", "Fd-3m:2", &[[O, [0.25, 0.25, 0.0]]]),
    cubic(
        "gyroid_graph",
        "the graph of the gyroid: three beams at each node (srs, K4 crystal)",
        "I4_132",
        &[[[0.125; 3], [-0.125, 0.375, 0.125]]],
    ),
    cubic(
        "tesseract",
        "a cube in a cube, joined at the corners",
        "Pm-3m",
        &[EDGE, [O, [0.25; 3]], [[0.25; 3], [0.75, 0.25, 0.25]]],
    ),
    cubic(
        "re_entrant",
        "re-entrant: widens when stretched along z",
        "I4/mmm",
        &[[[0.0, 0.0, -0.35], [0.0, 0.0, 0.35]], [[0.0, 0.0, 0.35], [0.5, 0.5, 0.15]]],
    ),
    UnitCell {
        aspect: HEXAGONAL,
        ..cubic(
            "hexagonal_prism",
            "hexagonal prisms: a honeycomb in layers",
            "Cmmm",
            &[
                [[0.0, -1.0 / 6.0, 0.0], [0.0, 1.0 / 6.0, 0.0]],
                [[0.0, 1.0 / 6.0, 0.0], [0.5, 1.0 / 3.0, 0.0]],
                [[0.0, 1.0 / 6.0, 0.0], [0.0, 1.0 / 6.0, 1.0]],
            ],
        )
    },
    UnitCell {
        aspect: HEXAGONAL,
        ..cubic("triangular_prism", "triangular prisms in layers", "Cmmm", &[EDGE, FACE, UP])
    },
];

/// All unit cells.
pub fn catalogue() -> &'static [UnitCell] {
    &CATALOGUE
}

/// The unit cell of this name.
pub fn named(name: &str) -> Option<&'static UnitCell> {
    CATALOGUE.iter().find(|u| u.name == name)
}

/// Distance below which two positions are equal, in cell edges: above the rounding of the table, far below any beam.
const POSITION_TOLERANCE: f64 = 1e-9;

impl UnitCell {
    /// The periodic graph of the cell.
    ///
    /// # Errors
    /// None for the cells of the catalogue: only an unknown group symbol fails.
    pub fn graph(&self) -> Result<PeriodicGraph, Fault> {
        Ok(PeriodicGraph::orbit(&Group::named(self.group)?.operations, self.beams))
    }
}

impl PeriodicGraph {
    /// The orbit of some beams under the operations of a group.
    fn orbit(operations: &[Operation], beams: &[[Vec3; 2]]) -> PeriodicGraph {
        let mut nodes: Vec<Vec3> = Vec::new();
        let mut beams_found = BTreeSet::new();
        for beam in beams {
            for op in operations {
                let [a, b] = beam.map(|p| op.apply(p)).map(|p| {
                    let cell = p.map(|v| (v + POSITION_TOLERANCE).floor());
                    let position = sub(p, cell);
                    let known = nodes.iter().position(|n| norm(sub(*n, position)) < 2.0 * POSITION_TOLERANCE);
                    let node = known.unwrap_or_else(|| {
                        nodes.push(position.map(|v| v.max(0.0)));
                        nodes.len() - 1
                    });
                    (node, cell.map(|v| v as i32))
                });
                let shift: [i32; 3] = core::array::from_fn(|i| b.1[i] - a.1[i]);
                let forward = PeriodicBeam { ends: [a.0, b.0], shift };
                let backward = PeriodicBeam { ends: [b.0, a.0], shift: shift.map(|s| -s) };
                beams_found.insert(forward.max(backward));
            }
        }
        PeriodicGraph { nodes, beams: beams_found.into_iter().collect() }
    }

    /// Vector from the first to the second node of a beam, in cell edges.
    pub fn vector(&self, beam: &PeriodicBeam) -> Vec3 {
        let [a, b] = beam.ends.map(|n| self.nodes[n]);
        core::array::from_fn(|i| b[i] - a[i] + f64::from(beam.shift[i]))
    }

    /// Number of beams at each node.
    pub fn valences(&self) -> Vec<usize> {
        let mut count = vec![0; self.nodes.len()];
        for end in self.beams.iter().flat_map(|b| b.ends) {
            count[end] += 1;
        }
        count
    }

    /// Lengths of the beams in a cell with these edges, in their unit.
    pub fn lengths(&self, edges: Vec3) -> Vec<f64> {
        let length = |l: &PeriodicBeam| {
            let v = self.vector(l);
            norm(core::array::from_fn(|i| v[i] * edges[i]))
        };
        self.beams.iter().map(length).collect()
    }

    /// Maxwell's count of one cell: beams − 3 nodes. Negative: the pin-jointed frame has mechanisms, so the lattice is
    /// bending dominated; zero or above, it may be stretching dominated.
    pub fn maxwell(&self) -> i64 {
        self.beams.len() as i64 - 3 * self.nodes.len() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes, beams, distinct valences, and total beam length in cell edges (aspect applied).
    const KNOWN: [(&str, usize, usize, &[usize], f64); 23] = [
        ("sc", 1, 3, &[6], 3.0),
        ("bcc", 2, 8, &[8], 6.928_203_230),
        ("bccz", 2, 10, &[10], 8.928_203_230),
        ("sc_bcc", 2, 11, &[8, 14], 9.928_203_230),
        ("fcc", 4, 12, &[4, 12], 8.485_281_374),
        ("fccz", 4, 13, &[4, 14], 9.485_281_374),
        ("fbcc", 5, 20, &[4, 8, 20], 15.413_484_604),
        ("fbccz", 5, 21, &[4, 8, 22], 16.413_484_604),
        ("octet", 4, 24, &[12], 16.970_562_748),
        ("octahedra", 3, 12, &[8], 8.485_281_374),
        ("diamond", 8, 16, &[4], 6.928_203_230),
        ("kelvin", 12, 24, &[4], 8.485_281_374),
        ("rhombic_dodecahedron", 12, 32, &[4, 8], 13.856_406_461),
        ("weaire_phelan", 46, 92, &[4], f64::NAN),
        ("truncated_cube", 6, 15, &[5], 6.213_203_436),
        ("rhombicuboctahedron", 12, 36, &[6], 14.911_688_245),
        ("truncated_cuboctahedron", 24, 48, &[4], 12.537_785_998),
        ("pyrochlore", 16, 48, &[6], 16.970_562_748),
        ("gyroid_graph", 8, 12, &[3], 4.242_640_687),
        ("tesseract", 9, 23, &[4, 14], f64::NAN),
        ("re_entrant", 4, 10, &[5], f64::NAN),
        ("hexagonal_prism", 4, 10, &[5], f64::NAN),
        ("triangular_prism", 2, 8, &[8], 8.0),
    ];

    #[test]
    fn cells_are_what_they_are_known_as() {
        for unit in catalogue() {
            let graph = unit.graph().expect("a group");
            let mut present = graph.valences();
            present.sort_unstable();
            present.dedup();
            let total: f64 = graph.lengths(unit.aspect).iter().sum();
            assert!(graph.beams.iter().flat_map(|b| b.shift).all(|s| s.abs() <= 1));
            let known = KNOWN.iter().find(|k| k.0 == unit.name).expect("known");
            assert_eq!(
                (graph.nodes.len(), graph.beams.len(), present.as_slice()),
                (known.1, known.2, known.3),
                "{} {total}",
                unit.name
            );
            assert!(known.4.is_nan() || (total - known.4).abs() < 1e-6, "{}: {total}", unit.name);
        }
    }
}
