//! The grid spacing at which a mesh is made unless another is asked for: what the design's walls need, or less if that is too
//! much for one mesh.

use std::collections::BTreeMap;

use super::Built;
use super::coarse_steps::LEAST;
use crate::map::SurfaceEnds;
use crate::report::{BeamsReport, LatticeReport};
use crate::tiling::steps_enough;
use crate::truss::Beams;

/// Grid steps on the smallest wavelength, at least, but for struts listed one by one.
const PER_CELL: f64 = 32.0;
/// Grid steps on a cell's finest wave, at least.
const PER_WAVE: f64 = 24.0;
/// Grid steps across the thinnest wall or neck, at least.
const PER_WALL: f64 = 2.0;
/// Grid steps on the thinnest beam's diameter, at least.
const PER_BEAM: f64 = 6.0;
/// Grid steps on the smallest wavelength, at most: for waves, and for walls, necks, beams and the skin.
const AT_MOST: [f64; 2] = [128.0, 64.0];

/// Grid steps on the smallest wavelength, of struts listed one by one as well: a grid of fewer is refused.
const FEWEST: f64 = 2.0;

/// Most triangles of a mesh for which no spacing is asked: 1 GB of binary STL.
const TRIANGLES: f64 = 20e6;
/// Grid steps that are left for it on the smallest wavelength, and across the thinnest wall, neck or beam: fewer break up.
const COARSE_PER_CELL: f64 = 12.0;
const COARSE_PER_WALL: f64 = 1.5;
/// An estimate is made on a grid of at most this many steps on the smallest wavelength, and scaled from there.
const COUNTED: f64 = 16.0;

/// A spacing (mm) that is coarser than the walls need, for the sake of the number of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coarser {
    /// What is used.
    pub spacing: f64,
    /// What the walls need.
    pub wanted: f64,
    /// About how many triangles that would make.
    pub triangles: f64,
}

impl Built {
    /// The spacing of a mesh without a request where that of the report makes more than 20 million triangles: coarser by the
    /// root of the excess, but with 12 steps on the smallest wavelength and 1.5 across the thinnest wall, neck and beam, and no
    /// wider than the skin or a transition. Over tetrahedra, whose walls have no step in common, the lattice stays in one piece
    /// instead. `None` where the report's will do, or nothing coarser resolves the walls.
    pub fn coarser_spacing(&self) -> Option<Coarser> {
        let report = self.report();
        let (wanted, wavelength) = (report.spacing, self.solid.wavelength);
        let repeat = smallest_repeat(self);
        let counted = wanted.max((wavelength / COUNTED).min(self.solid.transition.unwrap_or(f64::INFINITY)));
        // What cannot be estimated cannot be meshed: the mesh says why.
        let times = (counted / wanted).powi(2);
        let triangles = self.surface().exceeding(counted, TRIANGLES / times).ok()??.triangles * times;
        let walls = gridded(self, &report.lattices).filter_map(|l| l.thickness).map(|t| t.least());
        // One that is lost at the wanted spacing already, as at the poles of a sphere map, is no reason to keep to it.
        let is_resolved = |t: &f64| *t > COARSE_PER_WALL * wanted;
        let necks = walls.chain(report.beams.values().map(|b| b.thickness)).filter(is_resolved);
        let limits = necks.map(|t| t / COARSE_PER_WALL).chain([repeat / COARSE_PER_CELL, wavelength / FEWEST]);
        let limits = limits.chain(self.skin).chain(self.solid.transition).chain(self.whole_steps());
        let most = limits.fold(f64::INFINITY, f64::min);
        let spacing = rounded_down((wanted * (triangles / TRIANGLES).sqrt()).min(most));
        (spacing > wanted).then_some(Coarser { spacing, wanted, triangles })
    }

    /// The largest step along tetrahedra in which the lattice has the pieces that it is predicted to have.
    fn whole_steps(&self) -> Option<f64> {
        let [only] = &self.tilings[..] else { return None };
        let steps = steps_enough(&only.tiling, LEAST as usize).filter(|_| only.explicit)?;
        Some(only.tiling.map.mean_edge() / steps as f64)
    }
}

/// The smallest wavelength, mm, but for struts listed one by one, which may be as short as they are numerous along one line;
/// infinite if there is no other.
fn smallest_repeat(built: &Built) -> f64 {
    let lattices = built.lattices.iter().map(|(_, l)| l.map.wavelength());
    let tilings = built.tilings.iter().map(|t| t.tiling.wavelength());
    let repeats = |b: &&Beams| match b {
        Beams::Truss(truss) => truss.repeats,
        Beams::Pattern(_) => true,
    };
    let beams = built.beams.iter().map(|(_, b)| b).filter(repeats).map(Beams::wavelength);
    lattices.chain(tilings).chain(beams).fold(f64::INFINITY, f64::min)
}

/// The lattices that are meshed on a grid: others over tetrahedra are meshed one by one, with steps of their own.
fn gridded<'a>(
    built: &Built,
    lattices: &'a BTreeMap<String, LatticeReport>,
) -> impl Iterator<Item = &'a LatticeReport> {
    let explicit = built.blend.is_none() && built.tilings.iter().all(|t| t.explicit);
    lattices.values().filter(move |l| !explicit || l.tets.is_none())
}

/// v, rounded down to three digits.
fn rounded_down(v: f64) -> f64 {
    let unit = 10f64.powi(v.log10().floor() as i32 - 2);
    let rounded = (v / unit).floor() * unit;
    format!("{rounded:.12}").parse().unwrap_or(rounded)
}

/// The grid spacing (mm) at which a mesh of few triangles is made unless another is asked for. The volume of sheets of named
/// cells at it: `tests/laws/spacing.rs`.
pub(super) fn spacing(
    built: &Built,
    lattices: &BTreeMap<String, LatticeReport>,
    beams: &BTreeMap<String, BeamsReport>,
) -> f64 {
    let wavelength = built.solid.wavelength;
    let waves = built.lattices.iter().map(|(_, l)| l.map.wavelength() / (PER_WAVE * l.cell.series().frequency()));
    let walls = gridded(built, lattices).filter_map(|l| l.thickness).map(|t| t.least() / PER_WALL);
    let beams = beams.values().map(|b| b.thickness / PER_BEAM);
    let waves = waves.fold(f64::INFINITY, f64::min).max(wavelength / AT_MOST[0]);
    let rods = built.tilings.iter().filter(|t| t.ends == SurfaceEnds::Net).filter_map(|t| t.radii);
    let beams = beams.chain(rods.flat_map(|[least, most]| [2.0 * least / PER_WALL, 2.0 * most / PER_BEAM]));
    let walls = walls.chain(beams).chain(built.skin).fold(f64::INFINITY, f64::min).max(wavelength / AT_MOST[1]);
    (smallest_repeat(built) / PER_CELL).min(waves).min(walls).min(wavelength / FEWEST)
}
