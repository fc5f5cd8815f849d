//! Levels, which set how much is solid: data to [`Level`].

use super::build_property;
use super::data::{AmountSpec, FractionOf, GradeSpec, LatticeSpec, LevelFit, LevelSpec, PartSpec};
use super::sample;
use super::varied::Varied;
use crate::cell::{Cell, Distance, NoPore, Part};
use crate::environment::Environment;
use crate::field::Field;
use crate::grade::{Grade, Product, Quantity, Remapped, Stops, key_of};
use crate::kind::{DesignError, Key, Kind};
use crate::lattice::{Lattice, Level};
use crate::map::{CoreFill, Cores, Map};
use crate::report::PropertyReport;
use geometry::fault::{Fault, number};
use geometry::math::{Interval, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Coefficients of p⁹ … p⁰ for the level of the diamond (f ≤ t) at porosity p, as published in the SPARTAN note (its
/// text says eighth order; the ten numbers are those of a ninth-order polynomial). Porosity within 0.0031.
const DIAMOND: [f64; 10] = [
    -1.40181203e03,
    6.31442849e03,
    -1.20734024e04,
    1.27714436e04,
    -8.16588099e03,
    3.23757850e03,
    -7.84778926e02,
    1.09747587e02,
    -1.01136257e01,
    1.39501223,
];
/// The same for the gyroid, fitted by us on [0.02, 0.98], where it is within 0.0001 of the porosity.
const GYROID: [f64; 10] = [
    6.74056878,
    -30.3325595,
    59.2693991,
    -65.8909524,
    46.3314037,
    -21.8771005,
    7.86858261,
    -2.64954320,
    -2.36866364,
    1.45443255,
];

/// The level of the SPARTAN polynomial for this cell at porosity `p`, if there is one.
pub fn spartan(cell: &str, p: f64) -> Option<f64> {
    let c = match cell {
        "diamond" => &DIAMOND,
        "gyroid" | "gyroid_mirrored" => &GYROID,
        _ => return None,
    };
    Some(c.iter().fold(0.0, |t, a| t * p + a))
}

/// Builds the level of a lattice, and says what is found of a property that it is solved for. `name` is the cell's, if it has one.
pub(super) fn level(
    spec: &LevelSpec,
    part: PartSpec,
    name: Option<&str>,
    cell: &Arc<Cell>,
    map: &Map,
    environment: &Environment,
) -> Result<(Level, Option<PropertyReport>), DesignError> {
    let path = |key: &str| format!("{}.{key}", environment.path);
    let (key, value) = (spec.amount.key(), spec.amount.grade());
    if let AmountSpec::Thickness(_) = spec.amount {
        check_sheet(part, key, &path(key))?;
    }
    let quantity = spec.amount.quantity(path(key), environment);
    let amount = value.build(&quantity)?;
    let length = spec.amount.length();
    if !matches!(spec.amount, AmountSpec::Fraction(_) | AmountSpec::Porosity(_)) || length.is_some() {
        let found = length.map_or(key.to_string(), |(length, _)| format!("a {length}, too"));
        for (option, set) in [("of", spec.of != FractionOf::Cell), ("fit", spec.fit != LevelFit::Table)] {
            if set {
                let message = format!("\"{option}\" goes with fraction or porosity, found {found}; leave it out");
                return Err(DesignError::new(path(option), message));
            }
        }
    }
    if let (Some(length @ ("thickness", _)), PartSpec::Sheet) = (length, part) {
        return Ok((Level::Thickness(length_grade(length, environment)?), None));
    }
    let level = match &spec.amount {
        AmountSpec::Thickness(_) => {
            within_wavelength(value, &amount, &quantity, map.longest())?;
            mid_surface(cell, path(key))?;
            Level::Thickness(amount)
        }
        AmountSpec::Pore(_) => pore(&amount, part.into(), cell, map, environment)?,
        AmountSpec::Iso(_) => Level::Iso(amount),
        AmountSpec::Stiffness(_) | AmountSpec::Permeability(_) => {
            let made = build_property::level(&spec.amount, &amount, part.into(), cell, map, environment);
            return made.map(|(level, property)| (level, Some(property)));
        }
        AmountSpec::Fraction(_) | AmountSpec::Porosity(_) => {
            of_fraction(spec, amount, (part, name), cell, map, environment)?
        }
    };
    Ok((level, None))
}

/// The level of a fraction (or a porosity) of the cell or of the part.
fn of_fraction(
    spec: &LevelSpec,
    amount: Grade,
    (part, name): (PartSpec, Option<&str>),
    cell: &Arc<Cell>,
    map: &Map,
    environment: &Environment,
) -> Result<Level, DesignError> {
    let path = |key: &str| format!("{}.{key}", environment.path);
    let key = spec.amount.key();
    match (spec.of, spec.fit) {
        (FractionOf::Cell, LevelFit::Table) => Ok(Level::Fraction(amount)),
        (FractionOf::Part, LevelFit::Table) => {
            let Some(target) = amount.constant() else {
                let message =
                    format!("of = \"part\" solves for one level and takes a constant {key}; found one that varies");
                return Err(DesignError::new(path("of"), message));
            };
            let solved = solve(target, part.into(), cell, map, environment);
            let iso = solved.map_err(|m| DesignError::new(path(key), m))?;
            Ok(Level::Iso(Grade::Constant(iso)))
        }
        (FractionOf::Cell, LevelFit::Spartan) => {
            let fits = "diamond, gyroid, gyroid_mirrored";
            if part != PartSpec::Lower {
                let message = "fit = \"spartan\" is for part lower (f ≤ t); use fit = \"table\" for sheet and upper";
                return Err(DesignError::new(path("fit"), message));
            }
            let Some(fraction) = amount.constant() else {
                let message = format!("fit = \"spartan\" takes a constant {key}; found one that varies");
                return Err(DesignError::new(path("fit"), message));
            };
            match name.and_then(|n| spartan(n, 1.0 - fraction)) {
                Some(iso) => Ok(Level::Iso(Grade::Constant(iso))),
                None => {
                    let found = name.unwrap_or("a series");
                    let message =
                        format!("fit = \"spartan\" is known for {fits}; found {found}, so use fit = \"table\"");
                    Err(DesignError::new(path("fit"), message))
                }
            }
        }
        (FractionOf::Part, LevelFit::Spartan) => {
            let message = "fit = \"spartan\" speaks of the cell, of = \"part\" of the part; give one of the two";
            Err(DesignError::new(path("fit"), message))
        }
    }
}

/// Levels at which the pore is found where it varies; between them the level is linear in it.
const PORES: usize = 17;

/// The level at which the pore is as wide as asked. Where it varies, within about a thousandth.
fn pore(amount: &Grade, part: Part, cell: &Cell, map: &Map, environment: &Environment) -> Result<Level, DesignError> {
    let path = format!("{}.pore", environment.path);
    let Some(affine) = map.affine() else {
        let message = "pore goes with map.affine and map.spartan, whose cells are alike; with this map give a fraction";
        return Err(DesignError::new(path, message));
    };
    let to_phase = &affine.matrix;
    let level = |pore: f64| {
        let found = cell.level_of_pore(part, pore, to_phase);
        found.map_err(|why| {
            let (asked, size) = (number(pore), number(map.longest()));
            let message = match why {
                NoPore::AtMost(0.0) => "the void of this cell is closed at every level; give a fraction".to_string(),
                NoPore::AtMost(most) => format!(
                    "pore is {asked} mm; in these cells of {size} mm it is at most {most:.4} mm, so give a larger wavelength"
                ),
                NoPore::AtLeast(least) => format!(
                    "pore is {asked} mm; in these cells of {size} mm it is at least {least:.4} mm, so give a smaller wavelength"
                ),
            };
            DesignError::new(&path, message)
        })
    };
    if let Some(pore) = amount.constant() {
        return Ok(Level::Iso(Grade::Constant(level(pore)?)));
    }
    let (sampled, bound) = (Varied::of_grade(amount, environment), amount.bound(&environment.region.bounds()));
    // Between the points the grade may go up to its bounds; cells follow it where they can.
    let end = |loose: f64, sampled: f64| match cell.level_of_pore(part, loose, to_phase) {
        Ok(t) if loose > 0.0 => Ok((loose, t)),
        _ => level(sampled).map(|t| (sampled, t)),
    };
    let [(least, from), (most, to)] = [end(bound.lo, sampled.min)?, end(bound.hi, sampled.max)?];
    let narrower = |t: f64| cell.pores(part, t, to_phase).into_iter().fold(f64::INFINITY, f64::min);
    let share = |i: usize| i as f64 / (PORES - 1) as f64;
    let mut stops: Vec<[f64; 2]> = (1..PORES - 1)
        .into_par_iter()
        .map(|i| from + (to - from) * share(i))
        .map(|t| [narrower(t), t])
        .filter(|[d, _]| least < *d && *d < most)
        .collect();
    stops.extend([[least, from], [most, to]]);
    stops.sort_by(|a, b| a[0].total_cmp(&b[0]));
    stops.dedup_by(|a, b| a[0] == b[0]);
    Ok(Level::Iso(Grade::from(Remapped::new(amount.clone(), Stops(stops)))))
}

/// The thickness or pore (mm) that is given together with a fraction.
fn length_grade((key, spec): (&str, &GradeSpec), environment: &Environment) -> Result<Grade, DesignError> {
    let path = format!("{}.{key}", environment.path);
    spec.build(&Quantity::new(path, environment, key_of::<AmountSpec>(key)))
}

/// Fractions at which the length of cells of 1 mm is found where the fraction varies; between them the wavelength of a given length
/// is linear in the fraction.
const FRACTIONS: usize = 65;

/// The map of a lattice whose level is a fraction and a thickness or pore: lengths scale with the wavelength, so it is the asked
/// length over the one that cells of 1 mm have at this fraction.
pub(super) fn solved_map(
    spec: &LatticeSpec,
    length: (&'static str, &GradeSpec),
    cell: &Arc<Cell>,
    at_map: &Environment,
    at_level: &Environment,
) -> Result<Map, DesignError> {
    let path = |key: &str| format!("{}.{key}", at_level.path);
    let amount = &spec.level.amount;
    if amount.lengths().len() > 1 {
        let message = "thickness and pore each give the wavelength of a fraction; give one of the two";
        return Err(DesignError::new(path("pore"), message));
    }
    let key = length.0;
    let fraction = amount.grade().build(&amount.quantity(path(amount.key()), at_level))?;
    let asked = length_grade(length, at_level)?;
    let to_phase = spec.map.unit(key, at_map)?;
    let part = Part::from(spec.part);
    let wall = match (key, part) {
        ("thickness", Part::Sheet) => {
            mid_surface(cell, path(key))?;
            Some(Distance::new(cell.series(), &to_phase))
        }
        _ => None,
    };
    // Wavelength over length, at a fraction.
    let ratio = |fraction: f64| {
        let found = match (&wall, key) {
            (Some(wall), _) => Some(2.0 * wall.iso(part, fraction).0),
            (None, "pore") => cell.pores(part, cell.level(part, fraction), &to_phase).into_iter().reduce(f64::min),
            (None, _) => cell.thickness(part, cell.level(part, fraction), &to_phase),
        };
        found.filter(|w| *w > 0.0 && w.is_finite()).map(|w| 1.0 / w).ok_or(fraction)
    };
    let none = |fraction| DesignError::new(path(key), no_length(key, part, cell, fraction));
    let ratio = match fraction.constant() {
        Some(fraction) => Grade::Constant(ratio(fraction).map_err(none)?),
        None => {
            let Varied { min, max } = Varied::of_grade(&fraction, at_level);
            let at = |i: usize| min + (max - min) * i as f64 / (FRACTIONS - 1) as f64;
            let stops = (0..FRACTIONS).into_par_iter().map(|i| Ok([at(i), ratio(at(i))?]));
            let mut stops = stops.collect::<Result<Vec<_>, f64>>().map_err(none)?;
            stops.dedup_by(|a, b| a[0] == b[0]);
            Grade::from(Remapped::new(fraction, Stops(stops)))
        }
    };
    spec.map.sized(&Product::of(asked, ratio), key, at_map)
}

/// Explains that a part has no such length at a fraction.
fn no_length(key: &str, part: Part, cell: &Cell, fraction: f64) -> String {
    let fraction = number(fraction);
    if key == "pore" {
        return format!("at solid fraction {fraction} no ball passes through the void; give a smaller fraction");
    }
    let whole = cell.connected_fraction(part);
    let ranges = whole.iter().map(|[a, b]| format!("{a:.4} to {b:.4}")).collect::<Vec<_>>().join(" and ");
    format!(
        "at solid fraction {fraction} the network is not connected and has no neck; it is in one piece at fractions {ranges}"
    )
}

/// Refuses a cell without a mid-surface.
fn mid_surface(cell: &Cell, path: String) -> Result<(), DesignError> {
    let range = cell.range();
    if range.lo < 0.0 && range.hi > 0.0 {
        return Ok(());
    }
    let message = format!(
        "the cell has no mid-surface f = 0: its values run from {:.4} to {:.4}; give mid between them",
        range.lo, range.hi
    );
    Err(DesignError::new(path, message))
}

impl AmountSpec {
    /// Its key.
    pub(super) fn key(&self) -> &'static str {
        match self {
            AmountSpec::Thickness(_) => "thickness",
            AmountSpec::Fraction(_) => "fraction",
            AmountSpec::Porosity(_) => "porosity",
            AmountSpec::Iso(_) => "iso",
            AmountSpec::Pore(_) => "pore",
            AmountSpec::Stiffness(_) => "stiffness",
            AmountSpec::Permeability(_) => "permeability",
        }
    }

    /// The number.
    pub(super) fn grade(&self) -> &GradeSpec {
        match self {
            AmountSpec::Thickness(s) => &s.thickness,
            AmountSpec::Fraction(s) => &s.fraction,
            AmountSpec::Porosity(s) => &s.porosity,
            AmountSpec::Iso(s) => &s.iso,
            AmountSpec::Pore(s) => &s.pore,
            AmountSpec::Stiffness(s) => &s.stiffness,
            AmountSpec::Permeability(s) => &s.permeability,
        }
    }

    /// The direction of a property, in the axes of the cell.
    pub(super) fn along(&self) -> Vec3 {
        match self {
            AmountSpec::Stiffness(s) => s.along,
            AmountSpec::Permeability(s) => s.along,
            _ => [1.0, 0.0, 0.0],
        }
    }

    /// The lengths besides a fraction, by their keys.
    fn lengths(&self) -> Vec<(&'static str, &GradeSpec)> {
        let (thickness, pore) = match self {
            AmountSpec::Fraction(s) => (&s.thickness, &s.pore),
            AmountSpec::Porosity(s) => (&s.thickness, &s.pore),
            _ => return Vec::new(),
        };
        [("thickness", thickness), ("pore", pore)].into_iter().filter_map(|(key, s)| Some((key, s.as_ref()?))).collect()
    }

    /// The thickness or pore besides a fraction, by its key: the wavelength is solved for.
    pub(super) fn length(&self) -> Option<(&'static str, &GradeSpec)> {
        self.lengths().first().copied()
    }

    /// The quantity of the amount under its own key; of a porosity the complement is meant.
    pub(super) fn quantity<'a>(&self, path: String, environment: &'a Environment<'a>) -> Quantity<'a> {
        Quantity {
            complement: self.key() == "porosity",
            ..Quantity::new(path, environment, key_of::<AmountSpec>(self.key()))
        }
    }
}

/// Refuses a wall thicker than the greatest wavelength, `most` mm: declared numbers, and all that are sampled in the region.
pub(super) fn within_wavelength(
    spec: &GradeSpec,
    thickness: &Grade,
    quantity: &Quantity,
    most: f64,
) -> Result<(), DesignError> {
    let limit = Key { max: most, ..quantity.key };
    let wrong = |f: Fault| Fault { message: format!("{} mm, the wavelength", f.message), ..f };
    spec.check(&limit).map_err(|f| DesignError::fault(&quantity.path, wrong(f)))?;
    quantity.check(thickness, |v, position| limit.admit_at(v, position).map_err(wrong))
}

/// Refuses a part that has no mid-surface.
fn check_sheet(part: PartSpec, key: &str, path: &str) -> Result<(), DesignError> {
    let found = match part {
        PartSpec::Sheet => return Ok(()),
        PartSpec::Lower => "lower",
        PartSpec::Upper => "upper",
    };
    let message =
        format!("{key} goes with part = \"sheet\", found part = \"{found}\": a network has no wall; give its fraction");
    Err(DesignError::new(path, message))
}

/// The cell of a lattice whose mid-surface is f = mid: the same series less a constant.
pub(super) fn about_mid(
    cell: Arc<Cell>,
    spec: &LevelSpec,
    part: PartSpec,
    path: &str,
) -> Result<Arc<Cell>, DesignError> {
    let path = format!("{path}.mid");
    let mid = spec.mid;
    if mid == 0.0 {
        return Ok(cell);
    }
    check_mid(mid, cell.range(), part, &path)?;
    let about = Cell::new(cell.series().about(mid).map_err(|f| DesignError::fault(&path, f))?);
    Ok(Arc::new(match cell.truncation() {
        Some(share) => about.truncated(share),
        None => about,
    }))
}

/// Refuses a mid-surface f = mid of a part that has none, or outside the values that the cell takes.
pub(super) fn check_mid(mid: f64, range: Interval, part: PartSpec, path: &str) -> Result<(), DesignError> {
    check_sheet(part, "mid", path)?;
    if range.lo < mid && mid < range.hi {
        return Ok(());
    }
    let message = format!(
        "mid is {mid}; the cell's values run from {:.4} to {:.4}, and the mid-surface f = mid is there only between",
        range.lo, range.hi
    );
    Err(DesignError::new(path, message).found(mid.to_string()))
}

/// The constant level at which the lattice fills the share `target` of the region: the quantile of the lattice's
/// values at a million points inside, those that are filled anyway coming first. Error about 1e-4 in the fraction.
/// Refuses, in a sentence, less than what is filled.
fn solve(target: f64, part: Part, cell: &Arc<Cell>, map: &Map, environment: &Environment) -> Result<f64, String> {
    let (points, _) = sample::inside(environment.region, 1_000_000);
    // At level zero the field is |f|, f or −f; the part at level t is where that is at most t, t or −t.
    let at_zero = Lattice::new(cell.clone(), map.clone(), part, Level::Iso(Grade::Constant(0.0)));
    let mut values = vec![0.0; points.len()];
    at_zero.values(&points, &mut values);
    let mut filled = vec![0.0; points.len()];
    let mut count = 0;
    for body in environment.filled {
        body.values(&points, &mut filled);
        for (v, _) in values.iter_mut().zip(&filled).filter(|(_, f)| **f <= 0.0) {
            count += usize::from(*v != f64::NEG_INFINITY);
            *v = f64::NEG_INFINITY;
        }
    }
    let mut open = 0;
    if let Some(Cores { fill, tube }) = map.solved().and_then(|m| m.cores()) {
        tube.values(&points, &mut filled);
        for (v, _) in values.iter_mut().zip(&filled).filter(|(v, f)| **f <= 0.0 && **v != f64::NEG_INFINITY) {
            let solid = *fill == CoreFill::Solid;
            *v = if solid { f64::NEG_INFINITY } else { f64::INFINITY };
            *(if solid { &mut count } else { &mut open }) += 1;
        }
    }
    let Some(last) = values.len().checked_sub(1) else {
        let message = "no position within the region was found, which is a tiny share of its bounds; give a level by iso or thickness";
        return Err(message.into());
    };
    let k = ((target * values.len() as f64) as usize).min(last);
    if k + open >= values.len() {
        return Err(format!(
            "the void cores of singular lines leave {:.4} of the part; ask for less than that, {} is too much",
            1.0 - open as f64 / values.len() as f64,
            number(target)
        ));
    }
    if k <= count && count > 0 {
        return Err(format!(
            "the skin and what is kept solid make up {:.4} of the part already; ask for more than that, {} is too little",
            count as f64 / values.len() as f64,
            number(target)
        ));
    }
    let (_, v, _) = values.select_nth_unstable_by(k, f64::total_cmp);
    Ok(if part == Part::Upper { -*v } else { *v })
}

#[cfg(test)]
mod tests {
    use super::spartan;

    #[test]
    fn the_published_polynomial_is_of_ninth_order_and_nearly_odd() {
        for i in 1..20 {
            let p = f64::from(i) / 20.0;
            for (cell, odd) in [("diamond", 2e-3), ("gyroid", 1e-3)] {
                let (a, b) = (spartan(cell, p).unwrap_or(9.0), spartan(cell, 1.0 - p).unwrap_or(9.0));
                assert!((a + b).abs() < odd, "{cell} {p}: {a} {b}");
            }
        }
        // Exact levels: diamond 0.486154728 and gyroid 0.616271908 at porosity 0.3.
        assert!((spartan("diamond", 0.3).unwrap_or(9.0) - 0.486_154_728).abs() < 2e-3);
        assert!((spartan("gyroid_mirrored", 0.3).unwrap_or(9.0) - 0.616_271_908).abs() < 1e-4);
        assert_eq!(spartan("primitive", 0.3), None);
    }
}
