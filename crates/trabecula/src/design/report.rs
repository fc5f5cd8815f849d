//! What a design is, in numbers, without meshing it.

use std::cell::LazyCell;

use serde_json::{Value as Json, json};

use super::{Blended, Built, Joins, Tiled, beams, place::LOOKS, sample};
use crate::analysis;
use crate::blend::Phases;
use crate::cell::Part;
use crate::field::Field;
use crate::lattice::{Lattice, Level};
use crate::map::{Distortion, Map, Spread};
use crate::truss::Beams;

/// The least and the greatest of a number over a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Varied {
    pub min: f64,
    pub max: f64,
}

impl Varied {
    pub fn of(values: &[f64]) -> Varied {
        let (min, max) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        Varied { min, max }
    }

    pub fn map(self, f: impl Fn(f64) -> f64) -> Varied {
        if self.min == self.max { Varied::of(&[f(self.min)]) } else { Varied::of(&[f(self.min), f(self.max)]) }
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
            Level::Iso(_) | Level::Thickness(_) => Varied::of_iso(lattice, points).map(|t| lattice.fraction(t)),
        }
    }

    fn json(self) -> Json {
        if self.min == self.max { json!(self.min) } else { json!([self.min, self.max]) }
    }
}

impl core::fmt::Display for Varied {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        // Adding zero takes the sign off a negative one.
        let [min, max] = [self.min, self.max].map(|v| format!("{:.4}", (v * 1e4).round() / 1e4 + 0.0));
        if min == max { write!(f, "{min}") } else { write!(f, "{min} to {max}") }
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

/// The solid share of the region; of beams in a blend, if they filled it alone.
fn filling(built: &Built, beams: &Beams) -> f64 {
    if built.blend.is_none() {
        return expected(built).0;
    }
    let (points, _) = sample::inside(&built.solid.region, 2 * LOOKS);
    let mut values = vec![0.0; points.len()];
    beams.field().values(&points, &mut values);
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    solid as f64 / points.len().max(1) as f64
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
            "part": word(lattice.part),
            "wavelength": lattice.map.wavelength(),
            // A wall of even thickness is not bounded by a level of f: the one that would leave as much solid.
            "iso": match lattice.distance() {
                Some(_) => fraction.map(|f| lattice.cell.iso(lattice.part, f).0).json(),
                None => iso.json(),
            },
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
    for it in &built.tilings {
        lattices.insert(it.name.clone(), tiled(it));
    }
    let told = |(name, made): &(String, Beams)| {
        let sampled = LazyCell::new(|| filling(built, made));
        (name.clone(), beams::report(made, built, &sampled))
    };
    let beams: serde_json::Map<String, Json> = (built.beams.iter()).map(told).collect();
    let mut report = json!({
        "lattices": lattices,
        "beams": beams,
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
fn phases(phases: Phases) -> &'static str {
    match phases {
        Phases::Locked => "locked",
        Phases::Independent => "independent",
        Phases::Drifting => "drifting",
    }
}

/// The blend without its transitions.
fn blend(b: &Blended) -> Json {
    let functions = b
        .functions
        .iter()
        .map(|f| json!({ "path": f.path, "points": f.points, "delta": f.delta, "condition": f.condition }));
    json!({
        "lattices": b.names,
        "by": if b.blend.phases().is_some() { "fraction" } else { "value" },
        "phases": b.blend.phases().map(phases),
        "width": b.width,
        "rbf": functions.collect::<Vec<Json>>(),
    })
}

/// A lattice over a tetrahedral mesh.
fn tiled(it: &Tiled) -> Json {
    let tiling = &it.tiling;
    let stencil = &tiling.cells[0].stencil;
    let part = tiling.part;
    let levels = tiling.levels();
    let iso = Varied { min: levels.lo, max: levels.hi };
    let share = iso.map(|t| stencil.fraction(part, t));
    let shares = tiling.shares();
    let sums = |zone: Option<u32>| {
        let of = (0..tiling.map.len()).filter(|t| zone.is_none_or(|z| tiling.map.zone(*t) == z));
        of.fold((0, 0.0, 0.0), |(n, all, solid), t| {
            let v = tiling.map.volume(t);
            (n + 1, all + v, solid + shares[t] * v)
        })
    };
    let (_, volume, solid) = sums(None);
    if !it.zones.is_empty() {
        // Cells of zones have no level in common, and between them no fraction that they were asked for.
        let zones = it.zones.iter().map(|(zone, cell)| {
            let (count, volume, solid) = sums(zone.parse().ok());
            let told = json!({ "cell": cell, "count": count, "volume": volume, "solid_fraction": solid / volume });
            (zone.clone(), told)
        });
        return json!({
            "part": word(part),
            "wavelength": tiling.wavelength(),
            "iso": Json::Null, "fraction": solid / volume, "porosity": 1.0 - solid / volume, "thickness": Json::Null,
            "folding": Json::Null,
            "connected_fraction": [],
            "tets": {
                "count": tiling.map.len(),
                "mesh": it.mesh,
                "edge": tiling.map.mean_edge(),
                "volume": volume,
                "solid_fraction": solid / volume,
                "zones": zones.collect::<serde_json::Map<String, Json>>(),
                "pieces": it.joins.as_ref().map(Joins::pieces),
                "joins": it.joins.as_ref().map(Joins::json),
                "overlap": tiling.map.overlap(),
                "thickness": Json::Null,
                "ports": Json::Null,
                "face_fraction": Json::Null,
                "creases": Json::Null,
            },
        });
    }
    let spread = tiling.thickness();
    json!({
        "part": word(part),
        "wavelength": tiling.wavelength(),
        "iso": iso.json(),
        "fraction": share.json(),
        "porosity": share.map(|f| 1.0 - f).json(),
        "thickness": spread.map(|s| json!([s.min, s.max])),
        "folding": Json::Null,
        "connected_fraction": stencil.connected_fraction(part),
        "tets": {
            "count": tiling.map.len(),
            "mesh": it.mesh,
            "edge": tiling.map.mean_edge(),
            "volume": volume,
            "solid_fraction": solid / volume,
            "zones": Json::Null,
            "pieces": it.explicit.then(|| crate::tiling::connectivity(tiling)).flatten().map(|c| c.components),
            "joins": Json::Null,
            "overlap": tiling.map.overlap(),
            "thickness": spread.map(|s| json!({ "min": s.min, "low": s.low, "mean": s.mean, "high": s.high, "max": s.max })),
            "ports": stencil.count(part, 0.5 * (levels.lo + levels.hi)).ports,
            "face_fraction": iso.map(|t| stencil.face_fraction(part, t)).json(),
            "creases": tiling.creases().map(|c| json!({ "mean": c.mean, "max": c.max })),
        },
    })
}

fn word(part: Part) -> &'static str {
    match part {
        Part::Sheet => "sheet",
        Part::Lower => "lower",
        Part::Upper => "upper",
    }
}

/// The transitions of a blend, by sampling the solid.
pub(super) fn transitions(built: &Built) -> Json {
    let Some(b) = &built.blend else {
        return json!([]);
    };
    let found = analysis::transitions(&built.solid, &b.blend);
    let each = found.iter().map(|t| {
        json!({
            "between": t.between.map(|i| &b.names[i]),
            "volume": t.volume,
            "pieces": t.pieces,
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
    if found.is_empty() { Json::Null } else { Varied::of(&found).json() }
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
