//! Data to solid: values are checked, pieces are joined, and what may not be meant is warned of.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::data::*;
use super::error::DesignError;
use super::report::Varied;
use super::{
    Built, Design, Loader, Tiled, Warning, beams, blend, level, map, region, sample, samples, skin,
    tiling,
};
use crate::blend::Constituent;
use crate::cell::{Cell, Distance, Part, Series, Term, named};
use crate::face::Body;
use crate::fault::{Fault, number};
use crate::field::Field;
use crate::lattice::Lattice;
use crate::math::sin_cos_turns;
use crate::region::Region;
use crate::solid::Solid;
use crate::symmetry::{Group, Side};
use crate::truss::Beams;

/// Points at which a design is looked at.
pub(super) const LOOKS: usize = 8_000;

/// How far from the origin a region may reach, mm: a thousand kilometres.
const FARTHEST: f64 = 1e9;

/// Index of a series beyond which the grids on which a cell is analysed have less than four nodes on a wave.
const FINEST: usize = 24;

/// The share of a cell in a file that may be left out before it is warned of.
const TRUNCATED: f64 = 0.25;

/// Where a part of a lattice stands, and the region it is to fill.
pub(super) struct Place<'a> {
    pub path: String,
    pub region: &'a Region,
    /// Points inside the region.
    pub points: &'a [[f64; 3]],
    /// What is solid in the region whatever the lattice says.
    pub filled: &'a [Body],
    /// Hands over files.
    pub loader: &'a dyn Loader,
}

impl From<PartSpec> for Part {
    fn from(p: PartSpec) -> Part {
        match p {
            PartSpec::Sheet => Part::Sheet,
            PartSpec::Lower => Part::Lower,
            PartSpec::Upper => Part::Upper,
        }
    }
}

/// `v`, or an error that says it is not a finite number.
pub(super) fn finite(path: &str, v: f64) -> Result<f64, DesignError> {
    if v.is_finite() {
        Ok(v)
    } else {
        Err(DesignError::new(
            path,
            format!("expected a finite number, found {}", number(v)),
        )
        .found(number(v)))
    }
}

pub(super) fn design(d: &Design, loader: &dyn Loader) -> Result<Built, DesignError> {
    let mut notes = region::Notes::default();
    let (space, soup) = match region::region(&d.region, "region", loader, &mut notes) {
        Ok(space) => (space, None),
        Err(why) => {
            let (made, space) = tiling::of_soup(d, loader, why)?;
            (space, Some(made))
        }
    };
    let bounds = space.bounds();
    if bounds.is_empty() {
        return Err(DesignError::new("region", "the region is empty"));
    }
    if !bounds.is_finite() {
        let message = "the region has no end; intersect it with a box or another bounded region";
        return Err(DesignError::new("region", message));
    }
    let farthest = bounds.min.iter().chain(&bounds.max);
    let farthest = farthest.fold(0.0f64, |m, v| m.max(v.abs()));
    if farthest > FARTHEST {
        let message = format!(
            "the region reaches to {} mm; at most {} mm from the origin is possible",
            number(farthest),
            number(FARTHEST)
        );
        return Err(DesignError::new("region", message));
    }
    let domain = tiling::domain(d, &space, soup, loader, &mut notes.warnings)?;
    let space = domain.as_ref().map_or(space, |d| d.region.clone());
    let bounds = space.bounds();
    let (mut points, _) = sample::inside(&space, LOOKS);
    if points.is_empty() {
        let [x, y, z] = bounds.size().map(number);
        let message = format!(
            "the region is empty: no point inside was found within its bounds, {x} × {y} × {z} mm"
        );
        return Err(DesignError::new("region", message));
    }
    points.extend(sample::nodes(&space));
    let largest = bounds.size().into_iter().fold(0.0, f64::max);
    if !(0.1..=2000.0).contains(&largest)
        && !notes.warnings.iter().any(|w| w.message.contains("unit"))
    {
        let message = format!(
            "the region is {} mm across; is its unit right?",
            number(largest)
        );
        notes.warnings.push(Warning {
            path: "region".into(),
            message,
        });
    }
    let (filled, thinnest) = skin::filled(d, &space, &points, loader, &mut notes)?;
    let region::Notes {
        mut warnings,
        repairs,
    } = notes;
    let (mut lattices, mut tilings) = (Vec::new(), Vec::new());
    if let Some(domain) = domain {
        let place = Place {
            path: format!("lattice.{}", domain.name),
            region: &space,
            points: &points,
            filled: &filled,
            loader,
        };
        let tiling::Made {
            tiling,
            explicit,
            joins,
        } = tiling::lattice(&domain, &place, &mut warnings)?;
        tilings.push(Tiled {
            name: domain.name.to_string(),
            tiling: tiling.clone(),
            zones: domain.zones(),
            mesh: domain.report,
            explicit,
            joins,
        });
        if d.blend.is_none() {
            let mut solid = Solid::new(space.clone(), Some(tiling.clone()), tiling.wavelength());
            solid.tiling = explicit.then_some(tiling);
            return Ok(Built {
                solid: filled.into_iter().fold(solid, Solid::with),
                lattices,
                tilings,
                beams: Vec::new(),
                blend: None,
                skin: thinnest,
                warnings,
                repairs,
            });
        }
    }
    let others = d.lattice.iter();
    for (name, spec) in others.filter(|(_, s)| !matches!(s.map, MapSpec::Tets(_))) {
        let path = format!("lattice.{name}");
        let place = Place {
            path: path.clone(),
            region: &space,
            points: &points,
            filled: &filled,
            loader,
        };
        if spec.level.of == Of::Part && d.blend.is_some() {
            let message = "of = \"part\" speaks of the part, of which a lattice in a blend is not alone; leave it out";
            return Err(DesignError::new(format!("{path}.level.of"), message));
        }
        let built = Arc::new(lattice(spec, &place)?);
        check_solid(&built, &place, spec)?;
        warn(&built, &place, spec, &mut warnings);
        map::warn(&built.map, &spec.map, &path, &mut warnings);
        lattices.push((name.clone(), built));
    }
    let mut graphs = Vec::new();
    for (name, spec) in &d.beams {
        let place = Place {
            path: format!("beams.{name}"),
            region: &space,
            points: &points,
            filled: &filled,
            loader,
        };
        let made = beams::beams(spec, &place, &mut warnings)?;
        graphs.push((name.clone(), made));
    }
    let wavelengths = lattices.iter().map(|l| l.1.map.wavelength());
    let wavelengths = wavelengths.chain(graphs.iter().map(|g| g.1.wavelength()));
    let wavelengths = wavelengths.chain(tilings.iter().map(|t| t.tiling.wavelength()));
    let wavelength = wavelengths.fold(f64::INFINITY, f64::min);
    let mut blended = None;
    let field: Arc<dyn Field> = match (&d.blend, lattices.as_slice(), graphs.as_slice()) {
        (Some(spec), ..) => {
            let place = Place {
                path: "blend".into(),
                region: &space,
                points: &points,
                filled: &filled,
                loader,
            };
            let made = blend::blend(
                spec,
                &members(&lattices, &tilings, &graphs),
                &place,
                &mut warnings,
            )?;
            let field = made.blend.clone();
            blended = Some(made);
            field
        }
        (None, [(_, one)], []) => one.clone(),
        (None, [], [(_, one)]) => one.field(),
        (None, [_, (name, _), ..], _) => {
            let message = "several lattices need a blend to say where each is";
            return Err(DesignError::new(format!("lattice.{name}"), message));
        }
        (None, _, [.., (name, _)]) => {
            let message = "several blocks of beams, or beams and a lattice, need a blend to say where each is";
            return Err(DesignError::new(format!("beams.{name}"), message));
        }
        (None, [], []) => return Err(DesignError::new("lattice", "no lattice given; give one")),
    };
    let mut solid = Solid::new(space.clone(), Some(field), wavelength);
    solid.transition = blended.as_ref().and_then(|b| b.width);
    let solid = filled.into_iter().fold(solid, Solid::with);
    Ok(Built {
        solid,
        lattices,
        tilings,
        beams: graphs,
        blend: blended,
        skin: thinnest,
        warnings,
        repairs,
    })
}

/// What may be named in a blend.
fn members(
    lattices: &[(String, Arc<Lattice>)],
    tilings: &[Tiled],
    graphs: &[(String, Beams)],
) -> Vec<blend::Member> {
    let lattices = lattices.iter().map(|(name, l)| blend::Member {
        table: "lattice",
        name: name.clone(),
        of: Constituent::Lattice(l.clone()),
    });
    let tilings = tilings.iter().map(|t| blend::Member {
        table: "lattice",
        name: t.name.clone(),
        of: Constituent::Field {
            field: t.tiling.clone(),
            wavelength: t.tiling.wavelength(),
        },
    });
    let graphs = graphs.iter().map(|(name, b)| blend::Member {
        table: "beams",
        name: name.clone(),
        of: Constituent::Field {
            field: b.field(),
            wavelength: b.wavelength(),
        },
    });
    lattices.chain(tilings).chain(graphs).collect()
}

fn lattice(spec: &LatticeSpec, place: &Place) -> Result<Lattice, DesignError> {
    let below = |key: &str| format!("{}.{key}", place.path);
    let (name, cell) = cell(&spec.cell, &below("cell"), place.loader)?;
    let left_out = cell.truncation();
    let mut cell = level::about_mid(cell, &spec.level, spec.part, &below("level"))?;
    if let Some(share) = left_out {
        cell = cell.truncated(share);
    }
    let cell = Arc::new(cell);
    let here = Place {
        path: below("map"),
        ..*place
    };
    let map = map::map(&spec.map, &here)?;
    let here = Place {
        path: below("level"),
        ..*place
    };
    let level = level::level(&spec.level, spec.part, name, &cell, &map, &here)?;
    Ok(Lattice::new(cell, map, spec.part.into(), level))
}

/// The cell, and its name if it has one.
pub(super) fn cell<'a>(
    spec: &'a CellSpec,
    path: &str,
    loader: &dyn Loader,
) -> Result<(Option<&'a str>, Cell), DesignError> {
    let (name, terms, at) = match spec {
        CellSpec::Name(name) => {
            let known = named(name).ok_or_else(|| {
                let names: Vec<&str> = crate::cell::catalogue().iter().map(|n| n.name).collect();
                DesignError::unknown(path, "cell", name, &names)
            })?;
            (Some(name.as_str()), known.terms(), path.to_string())
        }
        CellSpec::Kind(CellKind::File(f)) => {
            return Ok((None, samples::cell(f, &format!("{path}.file"), loader)?));
        }
        CellSpec::Kind(CellKind::Tet(_)) => {
            let message = "a tetrahedral cell goes with a map over a tetrahedral mesh ([lattice.NAME.map.tets])";
            return Err(DesignError::new(format!("{path}.tet"), message));
        }
        CellSpec::Kind(CellKind::Series(s)) => {
            let at = format!("{path}.series");
            for (i, t) in s.terms.iter().enumerate() {
                finite(&format!("{at}.terms[{i}].amplitude"), t.amplitude)?;
                finite(&format!("{at}.terms[{i}].phase"), t.phase)?;
            }
            let terms = match &s.group {
                None => s.terms.iter().map(plain_term).collect(),
                Some(symbol) => {
                    let wrong = |place: &str, f| DesignError::fault(&format!("{at}.{place}"), f);
                    let group = Group::named(symbol).map_err(|f| wrong("group", f))?;
                    let mut all = Vec::new();
                    for (i, t) in s.terms.iter().enumerate() {
                        let orbit = orbit_terms(&group, t);
                        all.extend(orbit.map_err(|f| wrong(&format!("terms[{i}]"), f))?);
                    }
                    all
                }
            };
            (None, terms, at)
        }
    };
    let series = Series::new(terms).map_err(|f| DesignError::fault(&at, f))?;
    Ok((name, Cell::new(series)))
}

fn plain_term(t: &TermSpec) -> Term {
    // sin a = cos(a − a quarter turn).
    let behind = match t.component {
        Component::Re => 0.0,
        Component::Im => 0.25,
    };
    Term {
        hkl: t.hkl,
        amplitude: t.amplitude,
        phase: t.phase - behind,
    }
}

/// The sum of a term over a space group. A phase mixes its two parts, each of them normalised.
pub(super) fn orbit_terms(group: &Group, t: &TermSpec) -> Result<Vec<Term>, Fault> {
    let (s, c) = sin_cos_turns(t.phase);
    let (parts, word, other) = match t.component {
        Component::Re => ([(Side::Re, c), (Side::Im, -s)], "real", "im"),
        Component::Im => ([(Side::Re, s), (Side::Im, c)], "imaginary", "re"),
    };
    let mut terms = Vec::new();
    for (side, factor) in parts.into_iter().filter(|p| p.1 != 0.0) {
        let waves = group.orbit(t.hkl, side)?;
        terms.extend(waves.into_iter().map(|(hkl, cosine, sine)| Term {
            hkl,
            amplitude: t.amplitude * factor * cosine.hypot(sine),
            phase: (-sine).atan2(cosine) / TAU,
        }));
    }
    if terms.is_empty() {
        let message = format!(
            "the {word} part of the sum of {:?} over {} vanishes; use component = \"{other}\", or another origin choice",
            t.hkl, group.name
        );
        return Err(Fault::new("hkl", message));
    }
    Ok(terms)
}

/// The key under which the amount stands.
pub(super) fn amount_key(spec: &LatticeSpec) -> &'static str {
    match spec.level.amount {
        AmountSpec::Iso(_) => "iso",
        AmountSpec::Fraction(_) => "fraction",
        AmountSpec::Porosity(_) => "porosity",
        AmountSpec::Thickness(_) => "thickness",
    }
}

/// Refuses a lattice that leaves the region empty or solid everywhere.
fn check_solid(lattice: &Lattice, place: &Place, spec: &LatticeSpec) -> Result<(), DesignError> {
    let mut values = vec![0.0; place.points.len()];
    lattice.values(place.points, &mut values);
    let path = format!("{}.level.{}", place.path, amount_key(spec));
    if values.iter().any(|v| v.is_nan()) {
        return Err(DesignError::new(
            path,
            "the level is not a number somewhere in the region",
        ));
    }
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    // Too few looks for a sparse lattice or a thin gap: look closer before refusing.
    let (points, _) = sample::inside(place.region, 50 * LOOKS);
    let mut values = vec![0.0; points.len()];
    lattice.values(&points, &mut values);
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    let what = if solid == 0 {
        "empty: nothing is solid"
    } else {
        "solid everywhere: nothing is open"
    };
    let iso = Varied::of_iso(lattice, place.points);
    let why = if lattice.distance().is_some() {
        lattice.cores(&points, &mut values);
        let (near, far) = values.iter().fold((f64::INFINITY, 0.0f64), |(a, b), d| {
            (a.min(d.abs()), b.max(d.abs()))
        });
        format!(
            "half the thickness is {iso} mm, the mid-surface is between {near:.4} and {far:.4} mm away in the region"
        )
    } else {
        let range = lattice.cell.range();
        format!(
            "the level t is {iso}, the cell's values run from {:.4} to {:.4}",
            range.lo, range.hi
        )
    };
    let (size, wavelength) = (place.region.bounds().size(), lattice.map.wavelength());
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

/// What the ascending intervals `of` leave of [min, max].
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
    if (1e-2..1e6).contains(&v) {
        format!("{v:.4}")
    } else {
        format!("{v:.2e}")
    }
}

fn warn(lattice: &Lattice, place: &Place, spec: &LatticeSpec, warnings: &mut Vec<Warning>) {
    let path = &place.path;
    let fraction = Varied::of_fraction(lattice, place.points);
    let whole = lattice.connected_fraction();
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
        let place = if broken == [[fraction.min, fraction.max]] {
            format!("at solid fraction {fraction}")
        } else {
            format!(
                "the solid fraction is {fraction} over the region, and at {}",
                ranges(&broken)
            )
        };
        let message = format!("{place} the periodic solid is not one piece in space; {limit}");
        warnings.push(Warning {
            path: format!("{}.level.{}", path, amount_key(spec)),
            message,
        });
    }
    if let Some(share) = lattice.cell.truncation().filter(|s| *s > TRUNCATED) {
        let message = format!(
            "the waves that are kept leave out {:.1} % (root mean square) of the cell in the file; keep more terms",
            100.0 * share
        );
        warnings.push(Warning {
            path: format!("{}.cell.file.terms", place.path),
            message,
        });
    }
    let top = lattice.cell.plain().top();
    if top > FINEST {
        let message = format!(
            "indices reach {top}: beyond {FINEST} waves are finer than the grids on which the fraction, the walls and \
             the connectivity of a cell are found, and these figures are rough"
        );
        warnings.push(Warning {
            path: format!("{}.cell.series.terms", place.path),
            message,
        });
    }
    if let Some(error) = lattice.distance().map(Distance::error) {
        let half = Varied::of_iso(lattice, place.points);
        if error > 0.025 * half.min {
            let message = format!(
                "the mid-surface bends too sharply for its table of distances: a thickness of {} mm is met only within {} mm; \
                 give a fraction, or a cell of fewer waves or less stretch",
                figure(2.0 * half.min),
                figure(2.0 * error)
            );
            warnings.push(Warning {
                path: format!("{}.level.{}", place.path, amount_key(spec)),
                message,
            });
        }
    }
    if let Some(limit) = lattice.folding() {
        let thickness = Varied::of_iso(lattice, place.points).map(|t| 2.0 * t);
        if thickness.max > limit {
            let most = figure(thickness.max);
            let message = format!(
                "a thickness of {most} mm is above the folding limit, {} mm, twice the least radius of curvature of the \
                 mid-surface: the wall's faces meet in creases there, and it is less than {most} mm thick",
                figure(limit)
            );
            warnings.push(Warning {
                path: format!("{}.level.{}", place.path, amount_key(spec)),
                message,
            });
        }
    }
    let wavelength = lattice.map.wavelength();
    let least = place
        .region
        .bounds()
        .size()
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    if wavelength > least {
        let message = format!(
            "the wavelength, {} mm, is more than the region's least extent, {} mm: the part is less than one cell thick and \
             its fraction is not the cell's",
            number(wavelength),
            number(least)
        );
        let kind = map::kind(&spec.map);
        warnings.push(Warning {
            path: format!("{}.map.{kind}.wavelength", place.path),
            message,
        });
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
