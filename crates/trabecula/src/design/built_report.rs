//! The report on a design, without meshing it.

use std::cell::LazyCell;
use std::collections::HashSet;
use std::sync::Arc;

use super::default_spacing::spacing;
use super::varied::Varied;
use super::{Blended, Built, Joins, Tiled, build_beams, sample};
use crate::analysis::{self, Transition};
use crate::blend::Phases;
use crate::cell::Part;
use crate::field::Field;
use crate::lattice::Lattice;
use crate::map::{CoreFill, Period, Phase, SingularLine};
use crate::region::{CadMesh, Region};
use crate::report::*;
use crate::truss::Beams;
use geometry::math::Mat3;

/// How many times as many points a zone's fraction is sampled at as others.
const ZONES: usize = 10;

/// The solid share of the region and the region's volume.
pub(super) fn expected(built: &Built) -> (f64, f64) {
    let region = &built.solid.region;
    let (points, share) = sample::inside(region, 2 * sample::COUNT);
    let sampled = || share * region.bounds().size().iter().product::<f64>();
    (solid_share(&points, &built.solid), region.volume().unwrap_or_else(sampled))
}

/// The solid share of the region; of beams in a blend, if they filled it alone. Within a few thousandths of it where a few hundredths are
/// solid.
fn filling(built: &Built, beams: &Beams) -> f64 {
    let (points, _) = sample::inside(&built.solid.region, 8 * sample::COUNT);
    match built.blend {
        Some(_) => solid_share(&points, &*beams.field()),
        None => solid_share(&points, &built.solid),
    }
}

/// The share of points at which a field is solid.
fn solid_share(points: &[[f64; 3]], field: &dyn Field) -> f64 {
    let values = sample::values(points, |points, out| field.values(points, out));
    values.iter().filter(|v| **v <= 0.0).count() as f64 / points.len().max(1) as f64
}

pub(super) fn report(built: &Built) -> DesignReport {
    let region = &built.solid.region;
    let bounds = region.bounds();
    let exact = region.volume();
    let count = if exact.is_some() { sample::COUNT } else { 25 * sample::COUNT };
    let (mut points, share) = sample::inside(region, count);
    points.extend(sample::nodes(region));
    points.extend(built.lattices.iter().flat_map(|(_, l)| l.level.grade().extremes(region)));
    let volume = exact.unwrap_or_else(|| share * bounds.size().iter().product::<f64>());
    let property = |name: &str| built.properties.iter().find(|p| p.0 == name).map(|p| p.1);
    let lattices = built.lattices.iter();
    let lattices =
        lattices.map(|(name, l)| (name.clone(), LatticeReport { property: property(name), ..lattice(l, &points) }));
    let tilings = built.tilings.iter().map(|it| (it.name.clone(), tiled(it, built)));
    let beams = built.beams.iter().map(|(name, made)| {
        let sampled = LazyCell::new(|| filling(built, made));
        (name.clone(), build_beams::report(made, built, &sampled))
    });
    let (lattices, beams) = (lattices.chain(tilings).collect(), beams.collect());
    let described = built.tilings.iter().find_map(|it| it.mesh.region_volume);
    let region = RegionReport {
        bounds: [bounds.min, bounds.max],
        volume,
        volume_exact: exact.is_some() && described.is_none_or(|own| (volume / own - 1.0).abs() < ROUNDING),
        described_volume: described,
        tessellated: tessellated(region),
    };
    DesignReport {
        spacing: spacing(built, &lattices, &beams),
        chord: built.default_chord(),
        lattices,
        beams,
        region,
        warnings: built.warnings.clone(),
        blend: built.blend.as_ref().map(blend),
    }
}

/// The files of CAD systems of a region, if any.
fn tessellated(region: &Region) -> Option<Vec<TessellationReport>> {
    let mut files: Vec<Arc<CadMesh>> = Vec::new();
    region.cad(&mut files);
    // Copies of a part are of one file.
    let key = |f: &CadMesh| (f.file.clone(), f.chord.to_bits(), f.angle.to_bits());
    let mut seen = HashSet::new();
    files.retain(|f| seen.insert(key(f)));
    let reported = |f: Arc<CadMesh>| TessellationReport {
        path: f.file.clone(),
        chord: f.chord,
        angle: f.angle,
        triangles: f.mesh.triangles.len(),
        faces: f.labels.len(),
        volume: f.volume,
        volume_error: f.volume.map(|exact| f.mesh.volume() / exact - 1.0),
    };
    (!files.is_empty()).then(|| files.into_iter().map(reported).collect())
}

/// Share of a volume by which sums over tetrahedra and over triangles may differ.
const ROUNDING: f64 = 1e-9;
fn lattice(lattice: &Lattice, points: &[[f64; 3]]) -> LatticeReport {
    let iso = Varied::of_iso(lattice, points);
    let fraction = Varied::of_fraction(lattice, points);
    let (narrower, sides) = pores(lattice, iso);
    LatticeReport {
        part: word(lattice.part),
        wavelength: lattice.map.wavelength(),
        wavelengths: lattice.map.solved().map(Phase::edges).filter(|[a, b]| a < b),
        // A wall of even thickness is not bounded by a level of f: the one that would leave as much solid.
        iso: Some(match lattice.distance() {
            Some(_) => fraction.map(|f| lattice.cell.iso(lattice.part, f).0).varying(),
            None => iso.varying(),
        }),
        fraction: fraction.varying(),
        porosity: fraction.map(|f| 1.0 - f).varying(),
        thickness: thickness(lattice, iso),
        pore: narrower,
        pore_sides: sides,
        property: None,
        folding: lattice.folding(),
        connected_fraction: lattice.connected_fraction(),
        truncation: lattice.cell.truncation(),
        distortion: lattice.map.solved().map(|map| map.distortion().clone()),
        singular: lattice.map.solved().map(singular),
        periods: lattice.map.solved().map(|map| periods(map.periods())),
        fit: None,
        tets: None,
    }
}

/// The relation of the phases of a blend, in a word.
fn phases(phases: Phases) -> &'static str {
    match phases {
        Phases::Locked => "locked",
        Phases::Independent => "independent",
        Phases::Drifting => "drifting",
    }
}

/// The blend without its transitions.
fn blend(b: &Blended) -> BlendReport {
    BlendReport {
        lattices: b.names.clone(),
        by: if b.blend.phases().is_some() { "fraction" } else { "value" },
        phases: b.blend.phases().map(phases),
        width: b.width,
        rbf: b.functions.clone(),
    }
}

/// The solid fraction of the finished part in each of these zones, by samples.
fn finished_zones(it: &Tiled, built: &Built) -> Vec<Option<f64>> {
    let (points, _) = sample::inside(&built.solid.region, ZONES * sample::COUNT);
    let values = sample::values(&points, |p, out| built.solid.values(p, out));
    let mut counts = vec![[0.0; 2]; it.zones.len()];
    for (p, v) in points.iter().zip(values) {
        let number = it.tiling.map.zone(it.tiling.map.locate(*p).0);
        if let Some(zone) = it.zones.iter().position(|z| z.numbers.contains(&number)) {
            counts[zone][0] += 1.0;
            counts[zone][1] += f64::from(u8::from(v <= 0.0));
        }
    }
    counts.into_iter().map(|[all, solid]| (all > 0.0).then(|| solid / all)).collect()
}

/// A lattice over a tetrahedral mesh.
fn tiled(it: &Tiled, built: &Built) -> LatticeReport {
    let (tiling, part) = (&it.tiling, it.tiling.part);
    let shares = tiling.shares();
    let sums = |zones: Option<&[i64]>| {
        let of = (0..tiling.map.len()).filter(|t| zones.is_none_or(|z| z.contains(&tiling.map.zone(*t))));
        of.fold((0, 0.0, 0.0), |(n, all, solid), t| {
            let v = tiling.map.volume(t);
            (n + 1, all + v, solid + shares[t] * v)
        })
    };
    let (_, volume, solid) = sums(None);
    let mesh = TilingReport {
        method: if it.explicit && built.blend.is_none() { "explicit" } else { "implicit" },
        method_reason: it.on_grid.clone().or(built.blend.as_ref().map(|_| "a blend".into())),
        count: tiling.map.len(),
        mesh: TetMeshReport { fit: None, ..it.mesh.clone() },
        edge: tiling.map.mean_edge(),
        volume,
        solid_fraction: solid / volume,
        finished_fraction: it.finished,
        zones: None,
        pieces: None,
        joins: None,
        overlap: tiling.map.overlap(),
        surface: it.ends.word(),
        end_radius: it.radii.map(|[min, max]| Varied { min, max }.varying()),
        net: it.coverage,
        thickness: None,
        ports: None,
        face_fraction: None,
        creases: None,
    };
    let lattice = LatticeReport {
        part: word(part),
        wavelength: tiling.wavelength(),
        wavelengths: None,
        iso: None,
        fraction: Varying::Number(it.finished.unwrap_or(solid / volume)),
        porosity: Varying::Number(1.0 - it.finished.unwrap_or(solid / volume)),
        thickness: None,
        pore: None,
        pore_sides: None,
        property: None,
        folding: None,
        connected_fraction: Vec::new(),
        truncation: None,
        distortion: None,
        singular: None,
        periods: None,
        fit: it.mesh.fit.clone(),
        tets: None,
    };
    if !it.zones.is_empty() {
        // Cells of zones have no level in common, and transitions between them no target fraction.
        let finished = it.finished.map(|_| finished_zones(it, built));
        let zones = it.zones.iter().enumerate().map(|(i, zone)| {
            let (count, volume, solid) = sums(Some(&zone.numbers));
            let (cell, numbers) = (zone.cell.clone(), zone.numbers.clone());
            let (solid_fraction, finished_fraction) = (solid / volume, finished.as_ref().and_then(|of| of[i]));
            (zone.name.clone(), ZoneReport { cell, numbers, count, volume, solid_fraction, finished_fraction })
        });
        let tets = TilingReport {
            zones: Some(zones.collect()),
            pieces: it.joins.as_ref().map(Joins::components),
            joins: it.joins.as_ref().map(Joins::report),
            ..mesh
        };
        return LatticeReport { tets: Some(tets), ..lattice };
    }
    let cell = &tiling.cells[0].cell;
    let levels = tiling.levels();
    let iso = Varied { min: levels.lo, max: levels.hi };
    let share = match it.finished {
        Some(of_part) if !tiling.varies() => Varied { min: of_part, max: of_part },
        _ => iso.map(|t| tiling.fraction(t)),
    };
    let tets = TilingReport {
        pieces: it.alone.then(|| crate::tiling::connectivity(tiling)).flatten().map(|c| c.components),
        thickness: tiling.thickness(),
        ports: Some(cell.count(part, 0.5 * (levels.lo + levels.hi)).ports),
        face_fraction: Some(iso.map(|t| cell.face_fraction(part, t)).varying()),
        creases: tiling.creases(),
        ..mesh
    };
    LatticeReport {
        iso: Some(iso.varying()),
        fraction: share.varying(),
        porosity: share.map(|f| 1.0 - f).varying(),
        thickness: tets.thickness.map(|s| Varying::Range([s.min, s.max])),
        connected_fraction: cell.connected_fraction(part),
        tets: Some(tets),
        ..lattice
    }
}

fn word(part: Part) -> &'static str {
    match part {
        Part::Sheet => "sheet",
        Part::Lower => "lower",
        Part::Upper => "upper",
    }
}

/// The transitions of a blend, by sampling the solid.
pub(super) fn transitions(built: &Built) -> Vec<TransitionReport> {
    let Some(b) = &built.blend else {
        return Vec::new();
    };
    let bodies = |(bodies, volume): (usize, f64)| LooseBodies { bodies, volume };
    let figures = built.report();
    let walls = figures.lattices.values().filter_map(|l| l.thickness).map(Varying::least);
    let thinnest = walls.chain(figures.beams.values().map(|b| b.thickness)).fold(f64::INFINITY, f64::min);
    let one = |t: Transition| TransitionReport {
        between: t.between.map(|i| b.names[i].clone()),
        volume: t.volume,
        pieces: t.pieces,
        resolved: 2.0 * t.step <= thinnest,
        loose: bodies(t.loose),
        dangling: bodies(t.dangling),
        neck: t.neck.map(|(diameter, place)| NarrowestNeck { diameter, place }),
        gap: t.gap,
        fractions: t.fractions.iter().map(along).collect(),
        step: t.step,
    };
    analysis::transitions(&built.solid, &b.blend).into_iter().map(one).collect()
}

fn along(f: &[f64; 4]) -> FractionAlong {
    FractionAlong { share: f[0], asked: f[1].is_finite().then_some(f[1]), found: f[2] }
}

/// The thinnest wall or narrowest neck (mm), at five levels where the level varies; `None` where there is none.
fn thickness(lattice: &Lattice, iso: Varied) -> Option<Varying> {
    if lattice.distance().is_some() {
        return Some(iso.map(|t| 2.0 * t).varying());
    }
    let to_phase = lattice.map.extremes();
    let steps = if iso.min == iso.max { 1 } else { 5 };
    let level = |i: usize| iso.min + (iso.max - iso.min) * i as f64 / (steps - 1).max(1) as f64;
    let found: Vec<f64> = to_phase
        .iter()
        .flat_map(|m| (0..steps).map(move |i| (i, m)))
        .filter_map(|(i, m)| lattice.cell.thickness(lattice.part, level(i), m))
        .collect();
    (!found.is_empty()).then(|| Varied::of(&found).varying())
}

/// The pore (mm) of the narrower void, and of a sheet those of both sides, where the level and the cells are least and greatest;
/// `None` where nothing is solid, and of cells whose waves are too fine for it to be found.
fn pores(lattice: &Lattice, iso: Varied) -> (Option<Varying>, Option<[Varying; 2]>) {
    if !lattice.cell.resolves_pores() {
        return (None, None);
    }
    let levels = if iso.min == iso.max { vec![iso.min] } else { vec![iso.min, iso.max] };
    let maps = lattice.map.extremes();
    let at = |(m, t): (&Mat3, f64)| match lattice.distance() {
        // What lies d from the mid-surface lies d less half the thickness from the wall.
        Some(_) => {
            let bare = lattice.cell.pores(lattice.part, 0.0, m);
            bare.into_iter().map(|d| (d - 2.0 * t).max(0.0)).collect()
        }
        None => lattice.cell.pores(lattice.part, t, m),
    };
    let found: Vec<Vec<f64>> = maps.iter().flat_map(|m| levels.iter().map(move |t| (m, *t))).map(at).collect();
    if found.iter().flatten().any(|d| !d.is_finite()) {
        return (None, None);
    }
    let of = |pick: &dyn Fn(&[f64]) -> f64| Varied::of(&found.iter().map(|v| pick(v)).collect::<Vec<_>>()).varying();
    let narrower = of(&|v| v.iter().copied().fold(f64::INFINITY, f64::min));
    let sides = (lattice.part == Part::Sheet).then(|| [of(&|v| v[0]), of(&|v| v[1])]);
    (Some(narrower), sides)
}

/// Singular lines; positions to a millionth of a millimetre.
fn singular(map: &Phase) -> Vec<SingularLineReport> {
    let one = |l: &SingularLine| SingularLineReport {
        points: l.points.iter().map(|p| rounded(*p)).collect(),
        length: l.length,
        turn: l.turn,
        core: map.cores().map(|c| match c.fill {
            CoreFill::Solid => "solid",
            CoreFill::Void => "void",
        }),
        core_radius: map.cores().map(|c| c.tube.radius),
    };
    map.distortion().singular.iter().map(one).collect()
}

/// The cells round holes; positions to a millionth of a millimetre.
fn periods(of: &[Period]) -> Vec<Period> {
    let one =
        |p: &Period| Period { at: rounded(p.at), along: rounded(p.along), asked: rounded(p.asked), cells: p.cells };
    of.iter().map(one).collect()
}

fn rounded(v: [f64; 3]) -> [f64; 3] {
    v.map(|v| (v * 1e6).round() / 1e6 + 0.0)
}
