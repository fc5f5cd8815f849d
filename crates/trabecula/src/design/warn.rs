//! Refusals and warnings of a lattice in a region.

use super::data::*;
use super::varied::Varied;
use super::{Warning, sample};
use crate::cell::Distance;
use crate::environment::Environment;
use crate::field::Field;
use crate::kind::DesignError;
use crate::lattice::Lattice;
use crate::map::Map;
use geometry::fault::{number, position};
use geometry::math::Vec3;

/// A turn within one cell (degrees) above which it is warned of: cells are torn out of shape.
const TURN: f64 = 45.0;
/// The fraction of nodes and axes with spacings outside 1/1.5 to 1.5 above which there is a warning.
const OUTSIDE: f64 = 0.05;
/// The density of cells over the one asked for below which there is a warning: they are drawn out twenty times.
const PRESSED: f64 = 0.05;
/// The relative deviation of the fraction from the one asked for together with a thickness, above which it is warned of.
const DRIFT: f64 = 0.05;
/// Number of cells above which the unit of a wavelength is doubted.
const MANY: f64 = 1e9;
/// The share of a cell in a file that may be left out before it is warned of.
const TRUNCATED: f64 = 0.25;

/// Index of a series beyond which the grids on which a cell is analysed have less than four nodes on a wave.
const FINEST: usize = 24;

/// Refuses a lattice that leaves the region empty or solid everywhere.
pub(super) fn check(lattice: &Lattice, environment: &Environment, spec: &LatticeSpec) -> Result<(), DesignError> {
    let values = sample::values(environment.points, |points, out| lattice.values(points, out));
    let path = format!("{}.level.{}", environment.path, spec.level.amount.key());
    if values.iter().any(|v| v.is_nan()) {
        return Err(DesignError::new(path, "the level is not a number somewhere in the region"));
    }
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    // Too few samples for a sparse lattice or a thin gap: sampled more finely before refusing.
    let (points, _) = sample::inside(environment.region, 50 * sample::COUNT);
    let mut values = sample::values(&points, |points, out| lattice.values(points, out));
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    let what = if solid == 0 { "empty: nothing is solid" } else { "solid everywhere: nothing is open" };
    let iso = Varied::of_iso(lattice, environment.points);
    let why = if lattice.distance().is_some() {
        lattice.cores(&points, &mut values);
        let (near, far) = values.iter().fold((f64::INFINITY, 0.0f64), |(a, b), d| (a.min(d.abs()), b.max(d.abs())));
        format!(
            "half the thickness is {iso} mm, the mid-surface is between {near:.4} and {far:.4} mm away in the region"
        )
    } else {
        let range = lattice.cell.range();
        format!("the level t is {iso}, the cell's values run from {:.4} to {:.4}", range.lo, range.hi)
    };
    let (size, wavelength) = (environment.region.bounds().size(), lattice.map.wavelength());
    let largest = size.into_iter().fold(0.0, f64::max);
    let unit = if largest < wavelength {
        format!(
            "; the region is {} mm across, less than a wavelength, {} mm: are the units right?",
            number(largest),
            number(wavelength)
        )
    } else {
        String::new()
    };
    let message = format!("the lattice leaves the region {what}; {why}{unit}");
    Err(DesignError::new(path, message))
}

/// The parts of [min, max] outside the ascending intervals `of`.
pub(super) fn gaps([min, max]: [f64; 2], of: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut left = Vec::new();
    let mut from = min;
    for &[lo, hi] in of {
        if lo > from {
            left.push([from, lo.min(max)]);
        }
        if hi >= max {
            return left;
        }
        from = from.max(hi);
    }
    left.push([from, max]);
    left
}

/// A length in a sentence.
fn figure(v: f64) -> String {
    match v.abs() {
        a if a < 1e-9 => "0".into(),
        a if (1e-2..1e6).contains(&a) => format!("{v:.4}"),
        _ => format!("{v:.2e}"),
    }
}

/// The edge of a wrapped cell, over the map's wavelength, below which it is warned of: less than four steps of the grid are left.
const PINCHED: f64 = 1.0 / 8.0;

/// Warns of a wrapped map whose cells shrink to little or nothing in the region, but for shells, which do not vary round it.
pub(super) fn wrapped_map(lattice: &Lattice, spec: &MapKind, environment: &Environment, warnings: &mut Vec<Warning>) {
    let map = &lattice.map;
    let Some(round) = map.round() else { return };
    let path = format!("{}.map.{}.around", environment.path, spec.key());
    let varies_round = lattice.cell.series().terms().iter().any(|t| t.hkl[1] != 0);
    let in_region = |p: &Vec3| environment.region.value(*p) < 0.0;
    if varies_round && let Some(pole) = round.poles(&environment.region.bounds()).into_iter().rev().find(in_region) {
        let message = format!(
            "a pole of the sphere lies in the region: cells shrink to nothing on the axis, at ({}) mm for one, where no grid resolves their \
             walls; cut the poles out of the region with `difference`, or make them solid by a keep zone",
            pole.map(figure).join(", ")
        );
        warnings.push(Warning { path: path.clone(), message });
    }
    let shrinking = if matches!(spec, MapKind::Sphere(_)) { 1..3 } else { 1..2 };
    if lattice.cell.series().terms().iter().all(|t| t.hkl[shrinking.clone()].iter().all(|h| *h == 0)) {
        return;
    }
    let (core, on_it) = round.core(&environment.region.bounds());
    let within: Vec<_> = on_it.into_iter().filter(in_region).collect();
    let nearest = environment.points.iter().min_by(|a, b| round.edge_at(**a).total_cmp(&round.edge_at(**b)));
    let Some(at) = within.get(within.len() / 2).or(nearest) else { return };
    let edge = round.edge_at(*at);
    if edge >= PINCHED * map.wavelength() {
        return;
    }
    let place = at.map(figure).join(", ");
    let message = if within.is_empty() {
        format!(
            "cells are only {} mm wide at ({place}) mm, near the {core}, where no grid resolves their walls; cut more round the \
             {core} out of the region with `difference`, or give fewer cells `around`",
            figure(edge)
        )
    } else {
        format!(
            "the {core} lies in the region: cells shrink to nothing at ({place}) mm, where no grid resolves their walls; cut a \
             core round it out of the region with `difference`"
        )
    };
    warnings.push(Warning { path, message });
}

/// A fraction up to which a solid is found in one piece, and beyond which it is in one piece with its voids closed.
const FULL: f64 = 0.999;

/// Warns of likely mistakes.
pub(super) fn warn(lattice: &Lattice, environment: &Environment, spec: &LatticeSpec, warnings: &mut Vec<Warning>) {
    let path = &environment.path;
    let fraction = Varied::of_fraction(lattice, environment.points);
    let mut whole = lattice.connected_fraction();
    if let Some([_, top]) = whole.last_mut()
        && *top > FULL
    {
        *top = 1.0;
    }
    let broken = gaps([fraction.min, fraction.max], &whole);
    if !broken.is_empty() {
        let ranges = |of: &[[f64; 2]]| {
            let texts = of.iter().map(|&[min, max]| Varied { min, max }.to_string());
            texts.collect::<Vec<String>>().join(" and ")
        };
        let limit = match whole.as_slice() {
            [] => "it is in one piece at no fraction".to_string(),
            some => format!("it is in one piece at fractions {}", ranges(some)),
        };
        let subject = if broken == [[fraction.min, fraction.max]] {
            format!("at solid fraction {fraction}")
        } else {
            format!("the solid fraction is {fraction} over the region, and at {}", ranges(&broken))
        };
        let message = format!("{subject} the periodic solid is not one piece in space; {limit}");
        warnings.push(Warning { path: format!("{}.level.{}", path, spec.level.amount.key()), message });
    }
    if let Some(share) = lattice.cell.truncation().filter(|s| *s > TRUNCATED) {
        let message = format!(
            "the waves that are kept leave out {:.1} % (root mean square) of the cell in the file; keep more terms",
            100.0 * share
        );
        warnings.push(Warning { path: format!("{}.cell.file.terms", environment.path), message });
    }
    let top = lattice.cell.plain().top();
    if top > FINEST {
        let message = format!(
            "indices reach {top}: beyond {FINEST} waves are finer than the grids on which the fraction, the walls and \
             the connectivity of a cell are found, and these figures are rough"
        );
        warnings.push(Warning { path: format!("{}.cell.series.terms", environment.path), message });
    }
    if let Some(error) = lattice.distance().map(Distance::error) {
        let half = Varied::of_iso(lattice, environment.points);
        if error > 0.025 * half.min {
            let message = format!(
                "the mid-surface bends too sharply for its table of distances: a thickness of {} mm is met only within {} mm; \
                 give a fraction, or a cell of fewer waves or less stretch",
                figure(2.0 * half.min),
                figure(2.0 * error)
            );
            warnings.push(Warning { path: format!("{}.level.{}", environment.path, spec.level.amount.key()), message });
        }
    }
    if let Some(limit) = lattice.folding() {
        let thickness = Varied::of_iso(lattice, environment.points).map(|t| 2.0 * t);
        if thickness.max > limit {
            let most = figure(thickness.max);
            let message = format!(
                "a thickness of {most} mm is above the folding limit, {} mm, twice the least radius of curvature of the \
                 mid-surface: the wall's faces meet in creases there, and it is less than {most} mm thick",
                figure(limit)
            );
            warnings.push(Warning { path: format!("{}.level.{}", environment.path, spec.level.amount.key()), message });
        }
    }
    let wavelength = lattice.map.wavelength();
    let cells = environment.region.bounds().size().iter().product::<f64>() / wavelength.powi(3);
    if cells > MANY {
        let message = format!(
            "a wavelength of {} mm makes up to {cells:.1e} cells in the region's bounds: is the unit of both right?",
            number(wavelength)
        );
        warnings.push(Warning { path: format!("{}.map.{}.wavelength", environment.path, spec.map.key()), message });
    }
    let least = environment.region.bounds().size().into_iter().fold(f64::INFINITY, f64::min);
    if wavelength > least {
        let message = format!(
            "the wavelength, {} mm, is more than the region's least extent, {} mm: the part is less than one cell thick and \
             its fraction is not the cell's. Is the unit of both right?",
            number(wavelength),
            number(least)
        );
        let kind = spec.map.key();
        warnings.push(Warning { path: format!("{}.map.{kind}.wavelength", environment.path), message });
    }
}

/// Warns of a fraction that a wall of given thickness does not keep, where the map's cells have another size or shape than follows
/// from both.
pub(super) fn fraction_with_thickness(
    lattice: &Lattice,
    spec: &LatticeSpec,
    at_level: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<(), DesignError> {
    let amount = &spec.level.amount;
    let (Some(_), true, None) = (amount.length(), lattice.distance().is_some(), lattice.map.affine()) else {
        return Ok(());
    };
    let asked = amount.grade().build(&amount.quantity(format!("{}.{}", at_level.path, amount.key()), at_level))?;
    let points = at_level.points;
    let asked = sample::values(points, |points, out| asked.values(points, out));
    let found = sample::values(points, |points, out| lattice.fractions(points, out));
    let off = |i: &usize| (found[*i] / asked[*i] - 1.0).abs();
    let Some(worst) = (0..points.len()).max_by(|i, j| off(i).total_cmp(&off(j)).then(j.cmp(i))) else { return Ok(()) };
    if off(&worst) <= DRIFT {
        return Ok(());
    }
    let message = format!(
        "walls have the thickness that is asked for, but the solid fraction is {} at ({}) mm, where {} is asked for: no map has \
         cells of the size that both need everywhere; let the thickness vary more slowly, or give the fraction and a \
         wavelength, which hold the fraction",
        figure(found[worst]),
        points[worst].map(figure).join(", "),
        figure(asked[worst])
    );
    warnings.push(Warning { path: format!("{}.{}", at_level.path, amount.key()), message });
    Ok(())
}

/// Warns of a map that deviates far from its target.
pub(super) fn solved_map(map: &Map, spec: &MapKind, lattice: &str, warnings: &mut Vec<Warning>) {
    let Some(phase) = map.solved() else { return };
    let d = phase.distortion();
    let mut say = |message: String| {
        warnings.push(Warning { path: format!("{lattice}.map.{}", spec.key()), message });
    };
    if let Some(undersampled) = phase.undersampled() {
        say(undersampled.to_string());
    }
    if d.turn > TURN {
        let remedy = if phase.cores().is_some() { "give a larger core_radius there" } else { phase.smoother() };
        say(format!(
            "the orientation turns by {:.0} degrees a cell at {}: above {TURN} neighbouring cells no longer fit \
             together without being torn out of shape; {remedy}, or use smaller cells",
            d.turn,
            position(d.turn_at)
        ));
    }
    if let (Some(longest), None) = (d.singular.first(), phase.cores()) {
        let all: f64 = d.singular.iter().map(|l| l.length).sum();
        say(format!(
            "axes do not come back to themselves round {}, {all:.1} mm in all: no lattice is without a flaw there",
            longest.description(d.singular.len())
        ));
    }
    if d.outside > OUTSIDE {
        let worst = d.spacing.iter().fold(0.0, |m: f64, s| m.max(s.max));
        say(format!(
            "no map follows this orientation and wavelength closely: {:.0} % of the spacings are outside 1/1.5 to 1.5 of \
             what is asked for, the worst by a factor of {worst:.2}",
            100.0 * d.outside
        ));
    }
    if let Some(exceeded) = phase.overstretched() {
        say(exceeded);
    }
    if d.density[0] <= 0.0 {
        say(format!("the map folds (det J ≤ 0): cells turn inside out at {}", position(d.least_at)));
    } else if d.density[0] < PRESSED {
        say(format!(
            "the map nearly folds: cells are {:.1} % as many in a volume as asked for at {}, where axes may not fit together; let \
             orientation and wavelength vary more slowly, or keep that place out of the part",
            100.0 * d.density[0],
            position(d.least_at)
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::gaps;

    #[test]
    fn what_intervals_leave() {
        let whole = [[0.2, 0.5], [0.7, 1.0]];
        assert_eq!(gaps([0.3, 0.3], &whole), [[0.0; 2]; 0]);
        assert_eq!(gaps([0.1, 0.1], &whole), [[0.1, 0.1]]);
        assert_eq!(gaps([0.1, 0.4], &whole), [[0.1, 0.2]]);
        assert_eq!(gaps([0.1, 0.8], &whole), [[0.1, 0.2], [0.5, 0.7]]);
        assert_eq!(gaps([0.55, 0.6], &whole), [[0.55, 0.6]]);
        assert_eq!(gaps([0.6, 0.6], &whole), [[0.6, 0.6]]);
        assert_eq!(gaps([0.6, 0.6], &[]), [[0.6, 0.6]]);
        assert_eq!(gaps([0.3, 0.9], &[[0.2, 0.6]]), [[0.6, 0.9]]);
        assert_eq!(gaps([0.8, 0.8], &[[0.2, 0.6]]), [[0.8, 0.8]]);
    }
}
