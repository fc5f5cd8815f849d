//! File formats of graphs: nodes and the straight beams between them, with radii where a format has them.

use std::io;

use rustc_hash::FxHashMap;

use super::text::{at_line, shown};
use super::threemf::{self, BeamLattice};
use super::without_mark;
use crate::fault::{Fault, number};
use crate::math::{Vec3, scale};

mod abaqus_beams;
mod json_graph;
mod line_graphs;
mod ltcx;
mod nastran_beams;
mod text_graphs;

/// Nodes and beams. Radii are NaN where none is given, and their list is empty where none at all is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BeamGraph {
    /// Positions of the nodes, mm, or in the file's unit.
    pub nodes: Vec<Vec3>,
    /// Radii of balls at the nodes.
    pub radii: Vec<f64>,
    /// The two nodes of each beam.
    pub beams: Vec<[u32; 2]>,
    /// Radii of each beam at its two ends.
    pub beam_radii: Vec<[f64; 2]>,
    /// Which ends of each beam are flat or half balls; empty where all are balls.
    pub flat: Vec<[bool; 2]>,
    /// Whether lengths are in mm once read, because the file names its unit.
    pub in_mm: bool,
    /// What the file has and the graph has not.
    pub remarks: Vec<String>,
}

/// Reads a graph from the bytes of a file.
type Read = fn(&[u8]) -> Result<BeamGraph, Fault>;
/// Writes a graph to a file.
type WriteGraph = fn(&BeamGraph, &mut dyn io::Write) -> io::Result<()>;

/// A format of graphs. A new one is a file in this folder and a row in [`GRAPH_FORMATS`].
pub struct GraphFormat {
    /// End of the file's name, in small letters, without the dot.
    pub suffix: &'static str,
    /// What it is.
    pub title: &'static str,
    read: Option<Read>,
    write: Option<WriteGraph>,
    /// What of a graph is lost in it.
    pub lost: GraphLoss,
}

/// What of a graph is lost in a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphLoss {
    /// Nothing.
    Nothing,
    /// All radii.
    Radii,
    /// The radii of balls at nodes.
    Balls,
    /// The radii of beams: there are those of nodes.
    Beams,
}

/// The formats of graphs, in the order in which texts name them. The 3MF is written by [`threemf::write_beam_lattice`].
pub const GRAPH_FORMATS: &[GraphFormat] = &[
    GraphFormat {
        suffix: "3mf",
        title: "3MF beam lattice",
        read: Some(threemf::read_beam_lattice),
        write: None,
        lost: GraphLoss::Nothing,
    },
    GraphFormat {
        suffix: "ltcx",
        title: "lattice graph of nTopology",
        read: Some(ltcx::read),
        write: Some(ltcx::write),
        lost: GraphLoss::Beams,
    },
    GraphFormat {
        suffix: "csv",
        title: "table of end points and radii",
        read: Some(text_graphs::read_table),
        write: Some(text_graphs::write_table),
        lost: GraphLoss::Balls,
    },
    GraphFormat {
        suffix: "json",
        title: "nodes and beams",
        read: Some(json_graph::read),
        write: Some(json_graph::write),
        lost: GraphLoss::Nothing,
    },
    GraphFormat {
        suffix: "obj",
        title: "lines of Wavefront OBJ",
        read: Some(line_graphs::read_obj),
        write: Some(line_graphs::write_obj),
        lost: GraphLoss::Radii,
    },
    GraphFormat {
        suffix: "vtu",
        title: "lines of VTK",
        read: Some(line_graphs::read_vtk_lines),
        write: Some(line_graphs::write_vtu_lines),
        lost: GraphLoss::Nothing,
    },
    GraphFormat {
        suffix: "vtk",
        title: "lines of VTK, legacy",
        read: Some(line_graphs::read_vtk_lines),
        write: None,
        lost: GraphLoss::Nothing,
    },
    GraphFormat {
        suffix: "inp",
        title: "Abaqus B31 with circular sections",
        read: Some(abaqus_beams::read),
        write: Some(abaqus_beams::write),
        lost: GraphLoss::Balls,
    },
    GraphFormat {
        suffix: "bdf",
        title: "Nastran CBAR with rods as sections",
        read: Some(nastran_beams::read),
        write: Some(nastran_beams::write),
        lost: GraphLoss::Balls,
    },
    GraphFormat {
        suffix: "nas",
        title: "Nastran CBAR",
        read: Some(nastran_beams::read),
        write: None,
        lost: GraphLoss::Balls,
    },
    GraphFormat {
        suffix: "txt",
        title: "GRID and STRUT rows",
        read: Some(text_graphs::read_grid),
        write: None,
        lost: GraphLoss::Balls,
    },
];

impl GraphFormat {
    /// The format with a suffix, in any letter case.
    pub fn of(suffix: &str) -> Option<&'static GraphFormat> {
        GRAPH_FORMATS.iter().find(|f| f.suffix.eq_ignore_ascii_case(suffix))
    }

    /// Whether files of it are written here.
    pub fn writes(&self) -> bool {
        self.write.is_some()
    }
}

/// Reads a graph from the bytes of a file whose name ends in `suffix` (any letter case, no dot): one of [`GRAPH_FORMATS`].
///
/// **Errors**: an unknown suffix; an empty or malformed file, with its line or element; a beam without length between one node and
/// itself; coordinates that are not finite, radii that are not positive; a file without beams.
pub fn read_graph(bytes: &[u8], suffix: &str) -> Result<BeamGraph, Fault> {
    let Some(read) = GraphFormat::of(suffix).and_then(|f| f.read) else {
        let known: Vec<&str> = GRAPH_FORMATS.iter().filter(|f| f.read.is_some()).map(|f| f.suffix).collect();
        return Err(Fault::new(
            "",
            format!("extension \"{suffix}\": known formats of graphs are {}", known.join(", ")),
        ));
    };
    if bytes.is_empty() {
        return Err(Fault::new("", "the file is empty (0 bytes)"));
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(Fault::new("", "the file is text in UTF-16; save it as UTF-8"));
    }
    let mut graph = read(without_mark(bytes))?;
    if graph.beams.is_empty() {
        return Err(Fault::new("", "the file holds no beam"));
    }
    if graph.radii.iter().all(|r| r.is_nan()) {
        graph.radii.clear();
    }
    if graph.beam_radii.iter().flatten().all(|r| r.is_nan()) {
        graph.beam_radii.clear();
    }
    Ok(graph)
}

/// Writes a graph in the format of `suffix`; numbers are the shortest decimals that read back to the same double.
///
/// **Errors**: whatever `out` reports; `InvalidInput` for a suffix that is not written.
pub fn write_graph(graph: &BeamGraph, suffix: &str, out: &mut dyn io::Write) -> io::Result<()> {
    let write = GraphFormat::of(suffix).and_then(|f| f.write);
    let write = write.ok_or_else(|| super::invalid(format!("graphs are not written as \"{suffix}\"")))?;
    write(graph, out)
}

impl BeamGraph {
    /// Multiplies all lengths.
    pub fn scale(&mut self, factor: f64) {
        self.nodes.iter_mut().for_each(|p| *p = scale(*p, factor));
        self.radii.iter_mut().chain(self.beam_radii.iter_mut().flatten()).for_each(|r| *r *= factor);
    }

    /// Leaves out nodes at which no beam ends, as those of a mesh.
    pub fn drop_unused(&mut self) {
        let mut used = vec![false; self.nodes.len()];
        self.beams.iter().flatten().for_each(|n| used[*n as usize] = true);
        let kept: Vec<usize> = (0..used.len()).filter(|i| used[*i]).collect();
        let mut numbers = vec![0; used.len()];
        kept.iter().enumerate().for_each(|(new, old)| numbers[*old] = new as u32);
        self.nodes = kept.iter().map(|i| self.nodes[*i]).collect();
        self.radii = kept.iter().filter_map(|i| self.radii.get(*i).copied()).collect();
        self.beams.iter_mut().flatten().for_each(|n| *n = numbers[*n as usize]);
    }

    /// Number of ends of beams that are no balls, and lie in none.
    pub fn bare_ends(&self) -> usize {
        let ends = self.beams.iter().flatten().zip(self.beam_radii.iter().flatten()).zip(self.flat.iter().flatten());
        let is_bare = |n: u32, r: f64| self.radii.get(n as usize).is_none_or(|ball| ball.is_nan() || *ball < r);
        ends.filter(|((n, r), is_flat)| **is_flat && is_bare(**n, **r)).count()
    }

    /// The radii of a beam at its ends; NaN where there are none.
    fn radii_of(&self, beam: usize) -> [f64; 2] {
        self.beam_radii.get(beam).copied().unwrap_or([f64::NAN; 2])
    }

    /// The number of the node at a position that was met before, or a new one.
    fn node_at(&mut self, seen: &mut FxHashMap<[u64; 3], u32>, at: Vec3) -> u32 {
        // -0 and 0 are one place.
        let key = at.map(|v| (v + 0.0).to_bits());
        let next = self.nodes.len() as u32;
        *seen.entry(key).or_insert_with(|| {
            self.nodes.push(at);
            next
        })
    }

    /// Adds a beam between nodes of these numbers, with its radii.
    fn join(&mut self, ends: [u32; 2], radii: [f64; 2], fault: impl Fn(String) -> Fault) -> Result<(), Fault> {
        if ends[0] == ends[1] {
            return Err(fault("both ends of the beam are the same node".into()));
        }
        self.beams.push(ends);
        self.beam_radii.push(radii);
        Ok(())
    }
}

impl From<&BeamLattice> for BeamGraph {
    fn from(lattice: &BeamLattice) -> BeamGraph {
        let mut radii = vec![f64::NAN; lattice.nodes.len()];
        lattice.balls.iter().for_each(|(node, r)| radii[*node as usize] = *r);
        BeamGraph {
            nodes: lattice.nodes.clone(),
            radii,
            beams: lattice.beams.iter().map(|b| b.ends).collect(),
            beam_radii: lattice.beams.iter().map(|b| b.radii).collect(),
            in_mm: true,
            ..BeamGraph::default()
        }
    }
}

/// A unit of length by its name in a graph, in mm. Errors name what there is.
fn unit(name: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 6] =
        [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4), ("inch", 25.4), ("ft", 304.8)];
    let known = UNITS.iter().find(|u| u.0.eq_ignore_ascii_case(name));
    known.map(|u| u.1).ok_or_else(|| {
        format!("units is {}; it must be one of {}", shown(name.as_bytes()), UNITS.map(|u| u.0).join(", "))
    })
}

/// Numbers by which a file names nodes.
#[derive(Default)]
struct Ids(FxHashMap<i64, u32>);

impl Ids {
    /// Names the next node.
    fn add(&mut self, id: i64, node: usize) -> Result<(), String> {
        match self.0.insert(id, node as u32) {
            None => Ok(()),
            Some(_) => Err(format!("there are two nodes with id {id}")),
        }
    }

    fn get(&self, id: i64) -> Result<u32, String> {
        self.0.get(&id).copied().ok_or_else(|| format!("there is no node with id {id}"))
    }
}

/// A radius that is given, checked.
fn positive(radius: f64, name: &str) -> Result<f64, String> {
    match radius > 0.0 && radius.is_finite() {
        true => Ok(radius),
        false => Err(format!("{name} is {}; a radius is a finite number greater than 0", number(radius))),
    }
}

/// A fault at a line, for `map_err`.
fn on_line(line: usize) -> impl Fn(String) -> Fault {
    move |message| at_line(line, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> BeamGraph {
        BeamGraph {
            nodes: vec![[0.1, -1e-7, 123.456], [1.0 / 3.0, 2e10, -0.5], [7.0, 8.0, 9.0]],
            radii: vec![0.3, 0.4, 1.0 / 7.0],
            beams: vec![[0, 1], [2, 1]],
            beam_radii: vec![[0.3, 0.4], [1.0 / 7.0, 0.4]],
            in_mm: true,
            ..BeamGraph::default()
        }
    }

    #[test]
    fn what_is_written_comes_back_to_the_last_bit() {
        let graph = frame();
        for format in GRAPH_FORMATS.iter().filter(|f| f.write.is_some()) {
            let mut bytes = Vec::new();
            write_graph(&graph, format.suffix, &mut bytes).unwrap();
            let back = read_graph(&bytes, format.suffix).unwrap();
            // Fields of a Nastran file have sixteen characters.
            let exact = if format.suffix == "bdf" { 1e-13 } else { 0.0 };
            for (a, b) in back.nodes.iter().flatten().zip(graph.nodes.iter().flatten()) {
                assert!((a - b).abs() <= exact * b.abs(), "{}: {a} {b}", format.suffix);
            }
            assert_eq!((&back.beams, back.nodes.len()), (&graph.beams, 3), "{}", format.suffix);
            let constant = matches!(format.suffix, "inp" | "bdf");
            match format.lost {
                GraphLoss::Nothing => assert_eq!((&back.radii, &back.beam_radii), (&graph.radii, &graph.beam_radii)),
                GraphLoss::Radii => assert!(back.radii.is_empty() && back.beam_radii.is_empty()),
                GraphLoss::Beams => assert!(back.radii == graph.radii && back.beam_radii.is_empty()),
                GraphLoss::Balls if constant => {
                    let mean = graph.beam_radii.iter().map(|[a, b]| [0.5 * (a + b); 2]).collect::<Vec<_>>();
                    for (a, b) in back.beam_radii.iter().flatten().zip(mean.iter().flatten()) {
                        assert!((a - b).abs() <= exact * b, "{}: {a} {b}", format.suffix);
                    }
                }
                GraphLoss::Balls => assert!(back.beam_radii == graph.beam_radii && back.radii.is_empty()),
            }
        }
    }

    #[test]
    fn damage_is_refused_or_gives_a_valid_graph() {
        let mut seed = 5u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize
        };
        for format in GRAPH_FORMATS.iter().filter(|f| f.write.is_some()) {
            let mut bytes = Vec::new();
            write_graph(&frame(), format.suffix, &mut bytes).unwrap();
            for n in 0..2000 {
                let mut bad = bytes.clone();
                if n % 2 == 0 {
                    bad.truncate(next() % bytes.len());
                }
                for _ in 0..next() % 4 {
                    let i = next() % bad.len().max(1);
                    if let Some(b) = bad.get_mut(i) {
                        *b = next() as u8;
                    }
                }
                if let Ok(graph) = read_graph(&bad, format.suffix) {
                    assert!(graph.nodes.iter().flatten().all(|v| v.is_finite()));
                    let count = graph.nodes.len() as u32;
                    assert!(graph.beams.iter().all(|b| b[0] != b[1] && b.iter().all(|n| *n < count)));
                    assert!(graph.radii.is_empty() || graph.radii.len() == graph.nodes.len());
                    assert!(graph.beam_radii.is_empty() || graph.beam_radii.len() == graph.beams.len());
                    let radii = graph.radii.iter().chain(graph.beam_radii.iter().flatten());
                    assert!(radii.clone().all(|r| r.is_nan() || *r > 0.0));
                }
            }
        }
    }
}
