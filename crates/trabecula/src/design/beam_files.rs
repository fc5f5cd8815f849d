//! Files of a design's beams, as a graph or as frusta rather than as a surface.

use std::io;

use super::{Built, build_beams};
use crate::report::BeamsFileReport;
use crate::truss::Beams;
use beams::{Frusta, Quadors};
use geometry::fault::Fault;
use geometry::formats::{Aside, Companions, Metadata, write_beam_lattice};
use geometry::progress::{Stopped, checkpoint};

/// Errors of radii in the radius of the thinnest beam, unless another one is asked for.
const PER_RADIUS: f64 = 50.0;

/// The only beams of a design, and whether its region cuts some.
pub(super) struct Written {
    /// Their name.
    pub name: String,
    /// Their solid.
    pub quadors: std::sync::Arc<Quadors>,
    /// Whether the region cuts some.
    pub cut: bool,
}

/// The beams of a design for a file.
///
/// # Errors
/// What else the design has: lattices, a blend, a skin or kept zones.
pub(super) fn written(built: &Built) -> Result<Written, Fault> {
    let refuse = |why: &str| {
        let message =
            format!("a file of beams has beams alone, and {why}; write a mesh (3mf, stl) without --beams instead");
        Fault::new("", message)
    };
    let (name, beams) = build_beams::only(built).map_err(refuse)?;
    let quadors = match beams {
        Beams::Truss(t) => t.quadors.clone(),
        Beams::Pattern(laid) => std::sync::Arc::new(laid.expand()?),
    };
    checkpoint();
    Ok(Written { name: name.clone(), quadors, cut: !build_beams::held(beams, built) })
}

impl Built {
    /// Whether the region cuts some of the beams of a design that is made of beams alone.
    ///
    /// # Errors
    /// What else the design has.
    pub fn cuts_beams(&self) -> Result<bool, Fault> {
        Ok(written(self)?.cut)
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
        meshes: Companions,
        meta: &Metadata,
        aside: &mut dyn Aside,
        out: &mut dyn io::Write,
    ) -> Result<BeamsFileReport, Stopped> {
        let Written { name, quadors, cut } = written(self).map_err(Stopped::Refused)?;
        let thin = (0..quadors.beams()).map(|b| quadors.pencil(b).waist()).fold(f64::INFINITY, f64::min);
        let mut made = quadors.frusta(tolerance.unwrap_or(thin / PER_RADIUS));
        checkpoint();
        self.add_sets(&name, cut, &mut made);
        write_beam_lattice(&made.lattice, meshes, meta, aside, out).map_err(Stopped::Io)?;
        Ok(BeamsFileReport {
            nodes: made.lattice.nodes.len(),
            beams: made.lattice.beams.len(),
            balls: made.lattice.balls.len(),
            split: made.split,
            error: Some(made.error),
            filleted: made.filleted,
            clipped: cut && meshes.clip.is_some(),
        })
    }

    /// All beams as a set of the design's name for them, and those that the region cuts as another.
    fn add_sets(&self, name: &str, cut: bool, made: &mut Frusta) {
        let lattice = &made.lattice;
        let mut sets = vec![(name.to_string(), (0..lattice.beams.len() as u32).collect())];
        if cut {
            let region = &*self.solid.region;
            let crosses = |b: &u32| {
                let beam = &lattice.beams[*b as usize];
                let inside = |k: usize| {
                    let (at, r) = (lattice.nodes[beam.ends[k] as usize], beam.radii[k]);
                    region.value(at) + r <= 0.0
                };
                !(inside(0) && inside(1))
            };
            sets.push((format!("{name} cut"), (0..lattice.beams.len() as u32).filter(crosses).collect()));
        }
        made.lattice.sets = sets;
    }
}
