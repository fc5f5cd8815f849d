//! Surfaces on a grid of lattices over tetrahedra, at a level by which they enclose what the finished part has.
//!
//! Creases at the faces of tetrahedra, and the lattice's ends at the part's surface, fall within cells of the grid, where chords cost volume of
//! second order in the step: about one per cent at twelve steps along the wavelength. Walls thinner than two steps gain several per cent,
//! which fall faster. What the part is to enclose is known, so the surface is measured first, and its level is moved by what is missing.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::{Built, Tiled};
use crate::extract::{GridSurface, region_volume};
use crate::map::SurfaceEnds;
use crate::solid::Solid;
use crate::surface_maker::{
    Estimate, Islands, Measured, Resolved, Store, Summary, SurfaceMaker, SurfaceOptions, SurfaceSink,
};
use crate::tiling::Rounded;
use geometry::fault::Fault;
use geometry::progress::{Progress, Stage, Stopped};

/// Steps along the wavelength of the coarsest grid that is measured, of finer ones first: what is missing there tells whether they are to be
/// measured too. A step that is nearly as long as one to be measured is measured in its place.
const STEPS: f64 = 12.0;
const NEARLY: f64 = 1.5;
/// The share of the solid's volume that may be missing unmeasured. It falls with the square of the step at least, and where walls are
/// thinner than two steps with its fourth power: from one grid to the next, the third is a fair guess.
const SLIGHT: f64 = 1e-3;
const GUESSED: i32 = 3;
/// The share of the solid's volume that is near enough, and that up to which the first move needs no second: how fast the volume grows with
/// the level is known within a tenth.
const NEAR: f64 = 2e-4;
const SURE: f64 = 4e-3;
/// The most measurements, and the farthest that the level is moved: a share of the range of the cell's function.
const ROUNDS: usize = 5;
const FARTHEST: f64 = 0.1;
/// The change of level, as a share of that range, from which its rate is taken.
const NUDGE: f64 = 0.005;
/// The share of the work that measuring takes.
const MEASURED: f64 = 0.5;

/// A move of the level, and the share of the solid's volume that it makes up for.
#[derive(Clone, Copy)]
pub(super) struct LevelShift {
    by: f64,
    share: f64,
}

/// Moves of the level that were found, by the bits of the step.
pub(super) type Moves = Mutex<HashMap<u64, LevelShift>>;

/// The surface of a lattice over tetrahedra on a grid.
pub(super) struct CompensatedGrid<'a>(pub &'a Built);

/// The lattice of a design whose surface is one, the solid fraction that the part is to have, and how far that may be off.
pub(super) fn aimed(built: &Built) -> Option<(&Tiled, [f64; 2])> {
    match &built.tilings[..] {
        [only] if !only.explicit && built.blend.is_none() => only.aim.map(|aim| (only, aim)),
        _ => None,
    }
}

/// By how much the level is moved for steps of `edge` (mm): as was found in these steps, or in longer ones where little was missing.
pub(super) fn move_at(built: &Built, edge: f64, progress: &dyn Progress) -> Result<f64, Stopped> {
    let Some((tiled, aim)) = aimed(built) else { return Ok(0.0) };
    let or_edge = |step: f64| if edge > step / NEARLY { edge } else { step };
    let mut step = or_edge(tiled.tiling.wavelength() / STEPS);
    let (mut guess, mut done) = (0.0, 0.0);
    loop {
        // Half of the steps' length takes many times the work.
        let to = if step <= edge { 1.0 } else { 0.75 * done + 0.25 };
        let known = built.moves.lock().ok().and_then(|moves| moves.get(&step.to_bits()).copied());
        let found = match known {
            Some(found) => found,
            None => {
                let found = found(built, (tiled, aim), (step, guess), &Stage { whole: progress, from: done, to })?;
                if let Ok(mut moves) = built.moves.lock() {
                    moves.insert(step.to_bits(), found);
                }
                found
            }
        };
        let ratio: f64 = edge / step;
        if step <= edge || found.share * ratio.powi(2) < SLIGHT {
            return Ok(found.by * ratio.powi(2));
        }
        let next = or_edge(0.5 * step);
        (guess, done, step) = (found.by * (next / step).powi(GUESSED), to, next);
    }
}

/// The solid to be meshed where the level is moved.
pub(super) fn moved(built: &Built, by: f64) -> Cow<'_, Solid> {
    match aimed(built) {
        Some((tiled, _)) if by != 0.0 => Cow::Owned(at(built, tiled, by)),
        _ => Cow::Borrowed(&built.solid),
    }
}

/// The design's solid with the level of its lattice moved.
fn at(built: &Built, tiled: &Tiled, by: f64) -> Solid {
    let moved = tiled.placed.as_ref().clone().with_level_shift(by);
    let field: Arc<dyn crate::implicit::Implicit> = match tiled.ends {
        SurfaceEnds::Rounded => Arc::new(Rounded::new(&Arc::new(moved), &built.solid.region)),
        _ => Arc::new(moved.with_limited_gradient()),
    };
    Solid { field: Some(field), ..built.solid.clone() }
}

/// By how much the level is to be moved in steps of this length (mm), from a guess on; not at all where nothing can be measured.
fn found(
    built: &Built,
    (tiled, [aim, off]): (&Tiled, [f64; 2]),
    (step, guess): (f64, f64),
    progress: &dyn Progress,
) -> Result<LevelShift, Stopped> {
    let share = |k: usize| k as f64 / (ROUNDS + 1) as f64;
    let stage = |k: usize| Stage { whole: progress, from: share(k), to: share(k + 1) };
    let all = region_volume(&built.solid.region, 0.0, &stage(0))?;
    let range = tiled.tiling.cells[0].cell.range();
    let width = (range.hi - range.lo) / tiled.tiling.cells[0].scale;
    let share_at = |by: f64| {
        let (flat, solid) = tiled.placed.as_ref().clone().with_level_shift(by).volumes();
        solid / flat
    };
    let nudge = NUDGE * width;
    let rate = all * (share_at(nudge) - share_at(-nudge)) / (2.0 * nudge);
    let search = LevelSearch { aim: aim * all, near: (NEAR * aim).max(off) * all, rate, farthest: FARTHEST * width };
    let mut rounds = 1..;
    let (by, rate) = search.solve(guess, |by| {
        let solid = at(built, tiled, by);
        let options = SurfaceOptions { resolution: step, islands: Islands::Keep };
        match GridSurface(&solid).measure(&options, &stage(rounds.next().unwrap_or(ROUNDS))) {
            Ok(made) => Ok(Some(made.figures.size.volume)),
            Err(Stopped::Refused(_)) => Ok(None),
            Err(stopped) => Err(stopped),
        }
    })?;
    Ok(LevelShift { by, share: (by * rate / (aim * all)).abs() })
}

/// What a move of the level is sought for.
struct LevelSearch {
    /// The volume to be enclosed, and how far from it is near enough, mm³.
    aim: f64,
    near: f64,
    /// How fast the volume grows with the level.
    rate: f64,
    /// The farthest move.
    farthest: f64,
}

impl LevelSearch {
    /// The move, from a guess on, and the rate of the volume there; `measure` has the volume at a move, if a surface can be made there.
    fn solve(
        &self,
        guess: f64,
        mut measure: impl FnMut(f64) -> Result<Option<f64>, Stopped>,
    ) -> Result<(f64, f64), Stopped> {
        let (mut by, mut rate, mut last): (f64, f64, Option<[f64; 2]>) = (guess, self.rate, None);
        let mut best = (f64::INFINITY, 0.0);
        for _ in 0..ROUNDS {
            let Some(made) = measure(by)? else {
                // Half as far: there may be a surface.
                let Some([from, _]) = last else { break };
                by = 0.5 * (by + from);
                continue;
            };
            let missing = self.aim - made;
            if missing.abs() < best.0 {
                best = (missing.abs(), by);
            }
            if missing.abs() < self.near || rate <= 0.0 {
                break;
            }
            if let Some([b, v]) = last {
                let secant = (made - v) / (by - b);
                rate = if secant > 0.2 * rate && secant < 5.0 * rate { secant } else { rate };
            }
            last = Some([by, made]);
            by = (by + missing / rate).clamp(-self.farthest, self.farthest);
            if missing.abs() < SURE * self.aim {
                return Ok((by, rate));
            }
        }
        Ok((best.1, rate))
    }
}

impl CompensatedGrid<'_> {
    /// The solid to be meshed, and the progress of meshing it.
    fn solid<'p>(&self, edge: f64, whole: &'p dyn Progress) -> Result<(Cow<'_, Solid>, Stage<'p>), Stopped> {
        let first = Stage { whole, from: 0.0, to: MEASURED };
        Ok((moved(self.0, move_at(self.0, edge, &first)?), Stage { whole, from: MEASURED, to: 1.0 }))
    }
}

impl SurfaceMaker for CompensatedGrid<'_> {
    fn make(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn SurfaceSink,
        progress: &dyn Progress,
    ) -> Result<Resolved, Stopped> {
        let (solid, rest) = self.solid(options.resolution, progress)?;
        GridSurface(&solid).make(options, out, &rest)
    }

    fn stream_stl(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn Store,
        progress: &dyn Progress,
    ) -> Result<Summary, Stopped> {
        let (solid, rest) = self.solid(options.resolution, progress)?;
        GridSurface(&solid).stream_stl(options, out, &rest)
    }

    fn measure(&self, options: &SurfaceOptions, progress: &dyn Progress) -> Result<Measured, Stopped> {
        let (solid, rest) = self.solid(options.resolution, progress)?;
        GridSurface(&solid).measure(options, &rest)
    }

    fn estimate(&self, resolution: f64) -> Result<Estimate, Fault> {
        GridSurface(&self.0.solid).estimate(resolution)
    }

    fn exceeding(&self, resolution: f64, triangles: f64) -> Result<Option<Estimate>, Fault> {
        GridSurface(&self.0.solid).exceeding(resolution, triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A volume that grows by 23.4 mm³ a unit of the level, of which 20 are expected.
    fn volume(by: f64) -> f64 {
        27.2 + 23.4 * by + 4.0 * by * by
    }

    #[test]
    fn a_level_at_which_there_is_no_surface_is_stepped_back_from() {
        let search = LevelSearch { aim: 20.2, near: 0.004, rate: 20.0, farthest: 0.8 };
        for refused in [-1.0, -0.35] {
            let (by, rate) = search.solve(0.0, |by| Ok((by > refused).then(|| volume(by)))).expect("not stopped");
            assert!((volume(by) - search.aim).abs() < SURE * search.aim, "{by}");
            assert!((rate - 22.0).abs() < 2.0, "{rate}");
        }
        // Nowhere a surface: no move.
        assert_eq!(search.solve(0.1, |_| Ok(None)).expect("not stopped").0, 0.0);
    }
}
