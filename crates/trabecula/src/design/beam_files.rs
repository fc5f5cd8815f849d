//! Files of a design's beams, as a graph or as frusta rather than as a surface.

use std::borrow::Cow;
use std::io;
use std::sync::Arc;

use rayon::prelude::*;

use super::beams_in_region;
use super::{Built, build_beams};
use crate::report::BeamsFileReport;
use crate::truss::{Beams, beams_in};
use beams::{Fillet, Frusta, Graph, Profile, Quadors};
use geometry::fault::{Fault, counted};
use geometry::formats::{
    BeamGraph, ByteSpool, CompanionMeshes, GraphFormat, GraphLoss, Metadata, write_beam_lattice, write_graph,
};
use geometry::progress::{Stopped, checkpoint};

/// The only beams of a design of which something is in its region, and whether this cuts some.
pub(super) struct Written<'a> {
    name: &'a str,
    graph: Cow<'a, Graph>,
    /// Fillets aside.
    pub(super) quadors: Arc<Quadors>,
    has_fillets: bool,
    cut: bool,
}

/// The beams of a design for a file.
///
/// # Errors
/// What else the design has: lattices, a blend, a skin or kept zones.
pub(super) fn written(built: &Built) -> Result<Written<'_>, Fault> {
    let refuse = |why: &str| {
        let message = format!(
            "beams as such are written of a design that has nothing else, and {why}; mesh its surface or its solid instead"
        );
        Fault::new("", message)
    };
    let (name, beams) = build_beams::only(built).map_err(refuse)?;
    let cut = !beams_in_region::held(beams, built);
    let (mut graph, mut quadors) = match beams {
        Beams::Truss(t) => (Cow::Borrowed(&t.graph), t.quadors.clone()),
        Beams::Pattern(laid) => (Cow::Owned(laid.pattern().expanded()?), laid.expand()?),
    };
    checkpoint();
    let has_fillets = quadors.fillet() != Fillet::None;
    let kept = match beams {
        Beams::Truss(t) => t.within.struts.clone(),
        Beams::Pattern(_) if cut => beams_in(&quadors, &*built.solid.region),
        Beams::Pattern(_) => Vec::new(),
    };
    if kept.contains(&false) {
        graph = Cow::Owned(graph.part(&kept));
        if graph.beams.is_empty() {
            return Err(Fault::new(
                "",
                "no beam lies in the region, only fillets of beams do: a file of beams would be empty",
            ));
        }
        quadors = Arc::new(Quadors::new(&graph, Fillet::None)?);
        checkpoint();
    }
    Ok(Written { name, graph, quadors, has_fillets, cut })
}

impl Written<'_> {
    /// The graph for a file: a beam that is no cone between its hubs has its radius at mid length at both ends.
    fn graph(&self) -> BeamGraph {
        let radii = |b: usize| {
            let pencil = self.quadors.pencil(b);
            match self.graph.beams[b].profile {
                Profile::Cone | Profile::Cylinder => pencil.radii,
                Profile::Mid(r) => [r; 2],
                _ => [pencil.radius_squared(0.5 * pencil.length).max(0.0).sqrt(); 2],
            }
        };
        BeamGraph {
            nodes: self.graph.hubs.iter().map(|h| h.center).collect(),
            radii: self.graph.hubs.iter().map(|h| h.radius).collect(),
            beams: self.graph.beams.iter().map(|b| b.ends).collect(),
            beam_radii: (0..self.graph.beams.len()).into_par_iter().map(radii).collect(),
            in_mm: true,
            ..BeamGraph::default()
        }
    }

    /// What any file of beams loses, unless it has the region's mesh and fillets.
    fn lost(&self, clipped: bool) -> Vec<String> {
        let hubs = if self.has_fillets { self.quadors.len() } else { 0 };
        let filleted = (0..hubs).filter(|i| self.quadors.hub(*i).half_beams.len() > 1).count();
        let mut lost = Vec::new();
        if filleted > 0 {
            lost.push(format!(
                "{} with fillets, which a file of beams cannot hold: they are left out; STEP files and meshes have them",
                counted(filleted, "hub")
            ));
        }
        if self.cut && !clipped {
            lost.push("the region cuts some beams: the file has them whole; a 3mf has the region too".into());
        }
        lost
    }
}

/// What a format cannot hold of the radii of a graph.
fn lost_radii(graph: &BeamGraph, format: &GraphFormat) -> Option<String> {
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a;
    let pairs = || graph.beams.iter().zip(&graph.beam_radii);
    let node = |n: u32| graph.radii[n as usize];
    let suffix = format.suffix;
    match format.lost {
        GraphLoss::Radii => Some(format!("a .{suffix} has no radii: they are left out")),
        GraphLoss::Beams => {
            let odd = pairs().filter(|(e, r)| !(same(r[0], node(e[0])) && same(r[1], node(e[1])))).count();
            let beams = counted(odd, "beam");
            (odd > 0)
                .then(|| format!("{beams} unlike the hubs: a .{suffix} has the radii of hubs alone, json has both"))
        }
        GraphLoss::Balls => {
            let mut most = vec![0.0_f64; graph.nodes.len()];
            for (n, r) in pairs().flat_map(|(e, r)| e.iter().zip(r)) {
                most[*n as usize] = most[*n as usize].max(*r);
            }
            let odd = most.iter().zip(&graph.radii).filter(|(m, r)| **m > 0.0 && !same(**r, **m)).count();
            let tapered = if suffix == "csv" { 0 } else { pairs().filter(|(_, r)| !same(r[0], r[1])).count() };
            let hubs = (odd > 0).then(|| format!("the balls of {}", counted(odd, "hub")));
            let taper = (tapered > 0).then(|| format!("the taper of {}", counted(tapered, "beam")));
            let all: Vec<String> = hubs.into_iter().chain(taper).collect();
            (!all.is_empty()).then(|| format!("a .{suffix} cannot hold {}; 3mf, json and vtu do", all.join(" and ")))
        }
        GraphLoss::Nothing => None,
    }
}

impl Built {
    /// Whether the region cuts some of the beams of a design that is made of beams alone.
    ///
    /// # Errors
    /// What else the design has.
    pub fn cuts_beams(&self) -> Result<bool, Fault> {
        Ok(written(self)?.cut)
    }

    /// Writes the beams as a graph in the format of a suffix, one of [`geometry::formats::GRAPH_FORMATS`] that is written.
    ///
    /// # Errors
    /// What else the design has; failures of the output.
    pub fn write_graph(&self, suffix: &str, out: &mut dyn io::Write) -> Result<BeamsFileReport, Stopped> {
        let written = written(self).map_err(Stopped::Refused)?;
        let graph = written.graph();
        checkpoint();
        write_graph(&graph, suffix, out).map_err(Stopped::Io)?;
        let mut lost = written.lost(false);
        lost.extend(GraphFormat::of(suffix).and_then(|f| lost_radii(&graph, f)));
        let (nodes, beams) = (graph.nodes.len(), graph.beams.len());
        Ok(BeamsFileReport { nodes, beams, balls: 0, split: 0, error: None, clipped: false, lost })
    }

    /// Writes the beams as 3MF with the beam lattice extension: frusta whose radii are within `tolerance` (mm; `None` for a fiftieth
    /// of the thinnest beam's radius) of those of the beams. The mesh of the region, by which readers cut, comes from the caller, and
    /// so does the one that they show.
    ///
    /// # Errors
    /// What else the design has; failures of the output.
    pub fn write_beam_lattice(
        &self,
        tolerance: Option<f64>,
        meshes: CompanionMeshes,
        meta: &Metadata,
        aside: &mut dyn ByteSpool,
        out: &mut dyn io::Write,
    ) -> Result<BeamsFileReport, Stopped> {
        let written = written(self).map_err(Stopped::Refused)?;
        let quadors = &written.quadors;
        let mut made = quadors.frusta(tolerance.unwrap_or_else(|| build_beams::fine_error(quadors)));
        checkpoint();
        self.add_sets(&written, &mut made);
        write_beam_lattice(&made.lattice, meshes, meta, aside, out).map_err(Stopped::Io)?;
        let clipped = written.cut && meshes.clip.is_some();
        Ok(BeamsFileReport {
            nodes: made.lattice.nodes.len(),
            beams: made.lattice.beams.len(),
            balls: made.lattice.balls.len(),
            split: made.split,
            error: Some(made.error),
            clipped,
            lost: written.lost(clipped),
        })
    }

    /// All beams as a set of the design's name for them, and those that reach out of the region as another.
    fn add_sets(&self, written: &Written, made: &mut Frusta) {
        let lattice = &made.lattice;
        let all = 0..lattice.beams.len() as u32;
        let mut sets = vec![(written.name.to_string(), all.clone().collect())];
        if written.cut {
            let region = &*self.solid.region;
            let inside = |at: u32, r: f64| region.value(lattice.nodes[at as usize]) + r <= 0.0;
            let crosses = |b: &u32| {
                let beam = &lattice.beams[*b as usize];
                !(inside(beam.ends[0], beam.radii[0]) && inside(beam.ends[1], beam.radii[1]))
            };
            sets.push((format!("{} cut", written.name), all.into_par_iter().filter(crosses).collect()));
        }
        made.lattice.sets = sets;
    }
}
