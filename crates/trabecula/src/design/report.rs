//! What a design is, in numbers, without meshing it.

use serde_json::{Value as Json, json};

use super::{Blended, Built, build::LOOKS, sample};
use crate::blend::Phases;
use crate::cell::Part;
use crate::field::Field;
use crate::lattice::{Lattice, Level};
use crate::map::{Distortion, Map, Spread};
use crate::measure;

/// The least and the greatest of a number over a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Varied {
    pub min: f64,
    pub max: f64,
}

impl Varied {
    pub fn of(values: &[f64]) -> Varied {
        let (min, max) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        Varied { min, max }
    }

    pub fn map(self, f: impl Fn(f64) -> f64) -> Varied {
        if self.min == self.max {
            Varied::of(&[f(self.min)])
        } else {
            Varied::of(&[f(self.min), f(self.max)])
        }
    }

    /// The level t of the core at the points; half the thickness, where that is the level.
    pub fn of_iso(lattice: &Lattice, points: &[[f64; 3]]) -> Varied {
        if lattice.level.grade().constant().is_some() {
            let mut t = [0.0];
            lattice.isos(&points[..1], &mut t);
            return Varied::of(&t);
        }
        let mut values = vec![0.0; points.len()];
        lattice.isos(points, &mut values);
        Varied::of(&values)
    }

    /// The solid fraction of the cell at the points.
    pub fn of_fraction(lattice: &Lattice, points: &[[f64; 3]]) -> Varied {
        match &lattice.level {
            Level::Fraction(g) => match g.constant() {
                Some(v) => Varied { min: v, max: v },
                None => {
                    let mut values = vec![0.0; points.len()];
                    g.values(points, &mut values);
                    Varied::of(&values)
                }
            },
            // The fraction rises (sheet, lower) or falls (upper) with the level, so its ends are at the level's ends.
            Level::Iso(_) | Level::Thickness(_) => {
                Varied::of_iso(lattice, points).map(|t| lattice.fraction(t))
            }
        }
    }

    fn json(self) -> Json {
        if self.min == self.max {
            json!(self.min)
        } else {
            json!([self.min, self.max])
        }
    }
}

impl core::fmt::Display for Varied {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.min == self.max {
            write!(f, "{:.4}", self.min)
        } else {
            write!(f, "{:.4} to {:.4}", self.min, self.max)
        }
    }
}

/// The solid share of the region and the region's volume.
pub(super) fn expected(built: &Built) -> (f64, f64) {
    let region = &built.solid.region;
    let (points, share) = sample::inside(region, 2 * LOOKS);
    let mut values = vec![0.0; points.len()];
    built.solid.values(&points, &mut values);
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    let sampled = || share * region.bounds().size().iter().product::<f64>();
    let volume = region.volume().unwrap_or_else(sampled);
    (solid as f64 / points.len().max(1) as f64, volume)
}

pub(super) fn report(built: &Built) -> Json {
    let region = &built.solid.region;
    let bounds = region.bounds();
    let exact = region.volume();
    let count = if exact.is_some() { LOOKS } else { 25 * LOOKS };
    let (mut points, share) = sample::inside(region, count);
    points.extend(sample::nodes(region));
    let volume = exact.unwrap_or_else(|| share * bounds.size().iter().product::<f64>());
    let mut lattices = serde_json::Map::new();
    for (name, lattice) in &built.lattices {
        let iso = Varied::of_iso(lattice, &points);
        let fraction = Varied::of_fraction(lattice, &points);
        let mut entry = json!({
            "part": match lattice.part { Part::Sheet => "sheet", Part::Lower => "lower", Part::Upper => "upper" },
            "wavelength": lattice.map.wavelength(),
            // A wall of even thickness is not bounded by levels of f.
            "iso": if lattice.distance().is_some() { Json::Null } else { iso.json() },
            "fraction": fraction.json(),
            "porosity": fraction.map(|f| 1.0 - f).json(),
            "thickness": thickness(lattice, iso),
            "folding": lattice.folding(),
            "connected_fraction": lattice.connected_fraction(),
        });
        if let Some(share) = lattice.cell.truncation() {
            entry["truncation"] = json!(share);
        }
        if let Map::Phase(map) = &lattice.map {
            entry["distortion"] = distortion(map.distortion());
        }
        lattices.insert(name.clone(), entry);
    }
    let mut report = json!({
        "lattices": lattices,
        "region": {
            "bounds": [bounds.min, bounds.max],
            "volume": volume,
            "volume_exact": exact.is_some(),
        },
        "warnings": built.warnings,
    });
    if let Some(b) = &built.blend {
        report["blend"] = blend(b);
    }
    report
}

/// How the phases of a blend go together, in a word.
fn word(phases: Phases) -> &'static str {
    match phases {
        Phases::Locked => "locked",
        Phases::Independent => "independent",
        Phases::Drifting => "drifting",
    }
}

/// The blend without its transitions.
fn blend(b: &Blended) -> Json {
    let functions = b.functions.iter().map(|f| {
        json!({ "path": f.path, "points": f.points, "delta": f.delta, "condition": f.condition })
    });
    json!({
        "lattices": b.names,
        "by": if b.blend.phases().is_some() { "fraction" } else { "value" },
        "phases": b.blend.phases().map(word),
        "width": b.width,
        "rbf": functions.collect::<Vec<Json>>(),
    })
}

pub(super) fn transitions(built: &Built) -> Json {
    let Some(b) = &built.blend else {
        return json!([]);
    };
    let found = measure::transitions(&built.solid, &b.blend);
    let each = found.iter().map(|t| {
        json!({
            "between": t.between.map(|i| &b.names[i]),
            "volume": t.volume,
            "loose": { "bodies": t.loose.0, "volume": t.loose.1 },
            "dangling": { "bodies": t.dangling.0, "volume": t.dangling.1 },
            "neck": t.neck.map(|(diameter, place)| json!({ "diameter": diameter, "place": place })),
            "fractions": t.fractions.iter().map(|f| json!({ "share": f[0], "asked": f[1], "found": f[2] })).collect::<Vec<Json>>(),
            "step": t.step,
        })
    });
    each.collect()
}

/// The thinnest wall or narrowest neck (mm), at five levels where the level varies; null where there is none.
fn thickness(lattice: &Lattice, iso: Varied) -> Json {
    if lattice.distance().is_some() {
        return iso.map(|t| 2.0 * t).json();
    }
    let to_phase = lattice.map.extremes();
    let steps = if iso.min == iso.max { 1 } else { 5 };
    let level = |i: usize| iso.min + (iso.max - iso.min) * i as f64 / (steps - 1).max(1) as f64;
    let found: Vec<f64> = to_phase
        .iter()
        .flat_map(|m| (0..steps).map(move |i| (i, m)))
        .filter_map(|(i, m)| lattice.cell.thickness(lattice.part, level(i), m))
        .collect();
    if found.is_empty() {
        Json::Null
    } else {
        Varied::of(&found).json()
    }
}

/// How far a solved map is from what was asked for.
fn distortion(d: &Distortion) -> Json {
    let spread = |s: &Spread| json!({ "mean": s.mean, "p95": s.p95, "max": s.max });
    json!({
        "angle": d.angle.iter().map(spread).collect::<Vec<Json>>(),
        "spacing": d.spacing.iter().map(spread).collect::<Vec<Json>>(),
        "outside": d.outside,
        "shear": spread(&d.shear),
        "anisotropy": spread(&d.anisotropy),
        "density": d.density,
        "curl": spread(&d.curl),
        "turn": d.turn,
    })
}
