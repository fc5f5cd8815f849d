//! STEP files of designs: beams alone exactly, lattices in a box as patches.

use std::io;

use super::{Built, build_beams};
use crate::patches::{Patches, TOLERANCE};
use ::beams::write_step;
use geometry::fault::Fault;
use geometry::formats::part21::{StepReport, Title};
use geometry::progress::{Progress, Stage, Stopped};

/// Writes the STEP file of a design, as `Built::write_step` says.
pub(super) fn write(
    built: &Built,
    title: Title,
    tolerance: Option<f64>,
    assembly: Option<bool>,
    out: &mut dyn io::Write,
    progress: &dyn Progress,
) -> Result<StepReport, Stopped> {
    let refuse = |at: &str, message: &str| Err(Stopped::Refused(Fault::new(at, message)));
    if built.lattices.is_empty() && built.tilings.is_empty() {
        if tolerance.is_some() {
            let message = "tolerance is of patches on lattices; a STEP file of beams is exact: leave it out";
            return refuse("tolerance", message);
        }
        let (quadors, planes) = build_beams::exact(built).map_err(Stopped::Refused)?;
        return write_step(&quadors, &planes, title, assembly, out);
    }
    if !built.beams.is_empty() {
        let message = "a STEP file has beams alone, with their exact surface, or a lattice in a box, as patches; this design has \
                       both; write a mesh instead, such as .3mf or .stl";
        return refuse("beams", message);
    }
    if !built.tilings.is_empty() {
        let message = "a STEP file has patches of smooth surfaces, and a lattice over tetrahedra has creases between them; \
                       write a mesh instead, such as .3mf or .stl";
        return refuse("lattice", message);
    }
    if assembly == Some(true) {
        let message = "the parts of an assembly are hubs with their beams; a lattice of smooth surfaces is one solid: leave it out";
        return refuse("assembly", message);
    }
    let tolerance = tolerance.unwrap_or(TOLERANCE * built.solid.wavelength);
    let made = Patches::new(&built.solid, tolerance, &Stage { whole: progress, from: 0.0, to: 0.8 })?;
    made.write_step(title, out, &Stage { whole: progress, from: 0.8, to: 1.0 })?;
    Ok(made.summary())
}
