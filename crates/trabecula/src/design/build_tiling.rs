//! Lattices over tetrahedral meshes: data to [`Tiling`], with checks and warnings.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::build_cell::orbit_terms;
use super::build_level::{check_mid, within_wavelength};
use super::build_tets::{self, lost_features, rounded};
use super::data::*;
use super::finish_tiling::{Finish, Finished};
use super::joins::{Joins, Zoned, joins};
use super::varied::Varied;
use super::warn::gaps;
use super::{CellZone, Design, Loader, Warning, ZoneNames, cell_zones, sample};
use crate::cell::tet::{TetCell, named_tet_cell};
use crate::cell::{Part, Series, named};
use crate::environment::Environment;
use crate::grade::Grade;
use crate::grade::Quantity;
use crate::kind::DesignError;
use crate::map::{CarrierMesh, SurfaceEnds};
use crate::region::{Intersection, MeshRegion, Notes, Region};
use crate::report::TetMeshReport;
use crate::tiling::{Amount, NodalLevel, Share, Tiling};
use geometry::fault::{Fault, position};
use geometry::mesh::Mesh;
use geometry::repair::Repair;
use geometry::symmetry::Group;

/// By how much a solid fraction that is found by samples may be off.
const SAMPLED: f64 = 1e-3;
/// How thick the solid may be along normals of walls, in their mean thickness, before it is warned of.
const THICKER: f64 = 1.1;

/// A tetrahedral mesh that the part is made of, and the lattice in it.
pub(super) struct TilingDomain<'a> {
    pub name: &'a str,
    pub spec: &'a LatticeSpec,
    cell: &'a TetCellSpec,
    joined: CellJoin,
    map: Arc<CarrierMesh>,
    /// Numbers of zones with names.
    names: ZoneNames,
    /// The report on the mesh.
    pub report: TetMeshReport,
    /// What the lattice fills.
    pub region: Region,
    /// Whether that is the mesh, bent onto the region's surface.
    fit: MeshFit,
}

impl TilingDomain<'_> {
    /// How the lattice ends at the part's surface.
    pub fn ends(&self) -> SurfaceEnds {
        self.joined.surface
    }

    /// The widest opening (mm) that its net may have.
    pub fn opening(&self) -> Option<f64> {
        self.joined.net.as_ref().and_then(|net| net.opening)
    }
}

/// How a mesh fits the region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeshFit {
    /// It is a mesh of the region: bent, it fills it.
    Whole,
    /// It is one but for features that it does not keep.
    Nearly,
    /// The region cuts it.
    Cut,
}

/// The lattice over tetrahedra of a design, by name, and their mesh.
fn over_tets(d: &Design) -> Option<(&String, &LatticeSpec, &TetsKind)> {
    d.lattice.iter().find_map(|(name, spec)| match &spec.map {
        MapKind::Tets(t) => Some((name, spec, t)),
        _ => None,
    })
}

/// The tetrahedra of a design whose region is none, for the reason `why`, if they can be made without one, and the region
/// that they fill.
pub(super) fn of_soup(
    d: &Design,
    loader: &dyn Loader,
    why: DesignError,
) -> Result<(build_tets::BuiltTets, Region), DesignError> {
    let Some((name, _, spec)) = over_tets(d) else {
        return Err(why);
    };
    let path = format!("lattice.{name}.map.tets");
    let made = build_tets::of_soup(spec, &d.region, &path, loader, why)?;
    let region = enclosed(made.mesh.boundary(), &path)?;
    Ok((made, region))
}

/// The region within the boundary of a tetrahedral mesh.
fn enclosed(boundary: Mesh, path: &str) -> Result<Region, DesignError> {
    let region = MeshRegion::new(boundary, Repair::Auto);
    let wrong = |f: Fault| format!("the boundary of the mesh: {}", f.message);
    Ok(Arc::new(region.map_err(|f| DesignError::new(path, wrong(f)))?))
}

/// The mesh of a design that has one; `soup` is what was made of triangles that are no region.
pub(super) fn domain<'a>(
    d: &'a Design,
    region: &Region,
    soup: Option<build_tets::BuiltTets>,
    loader: &dyn Loader,
    notes: &RefCell<Notes>,
) -> Result<Option<TilingDomain<'a>>, DesignError> {
    let Some((name, spec, spec_of_mesh)) = over_tets(d) else {
        return Ok(None);
    };
    let path = format!("lattice.{name}");
    let CellSpec::Kind(CellKind::Tet(cell)) = &spec.cell else {
        let why = match &spec.cell {
            CellSpec::Name(name) => named(&name.0).and_then(|n| Group::named(n.number()).ok()),
            CellSpec::Kind(_) => None,
        };
        let why = why.and_then(|g| g.tetrahedral_sites().err());
        let why = why.map_or(String::new(), |f| format!(": {}", f.message));
        let message = format!(
            "a map over tetrahedra needs a cell that fits face to face, a tetrahedral one such as cell.tet.name = \"primitive\"{why}"
        );
        return Err(DesignError::new(format!("{path}.cell"), message));
    };
    let others = d.lattice.iter().filter(|(n, _)| *n != name);
    if let Some((other, _)) = others.clone().find(|o| matches!(o.1.map, MapKind::Tets(_))) {
        let message = "two lattices over tetrahedra; keep one, with zones where cells differ";
        return Err(DesignError::new(format!("lattice.{other}"), message));
    }
    let tables = others.map(|(n, _)| format!("lattice.{n}"));
    let tables = tables.chain(d.beams.0.keys().map(|n| format!("beams.{n}")));
    if let (None, Some(other)) = (&d.blend, tables.into_iter().next()) {
        let message = "a lattice over tetrahedra stands alone without a blend; keep one, or say where each is";
        return Err(DesignError::new(other, message));
    }
    let path = format!("{path}.map.tets");
    let joined = match spec_of_mesh {
        TetsKind::Made(m) => m.joined.clone(),
        TetsKind::File(f) => f.joined.clone(),
    };
    let (mut made, filled) = match soup {
        Some(made) => (made, Some(region.clone())),
        None => {
            let (mut points, _) = sample::inside(region, sample::COUNT);
            points.extend(sample::nodes(region));
            let environment = Environment { path: path.clone(), region, points: &points, filled: &[], loader, notes };
            (build_tets::tets(spec_of_mesh, &d.region, &environment)?, None)
        }
    };
    notes.borrow_mut().warnings.extend(made.warnings);
    // A lattice ends on the surface itself.
    if let Some(nodes) = made.on_surface {
        made.mesh.nodes = nodes;
    }
    let wrong = |f| DesignError::fault(&path, f);
    let (map, region, fit) = match filled {
        Some(region) => (CarrierMesh::new(&made.mesh, joined.overlap).map_err(wrong)?, region, MeshFit::Whole),
        None => {
            let bent = CarrierMesh::of_region(&made.mesh, joined.overlap, region).map_err(wrong)?;
            match spec_of_mesh {
                _ if bent.fits() && lost_features(&made.report).is_empty() => (bent, region.clone(), MeshFit::Whole),
                TetsKind::Made(_) => (bent, region.clone(), MeshFit::Nearly),
                TetsKind::File(file) => {
                    let flat = CarrierMesh::new(&made.mesh, joined.overlap).map_err(wrong)?;
                    let message = cut(&made.report, &file.path);
                    notes.borrow_mut().warnings.push(Warning { path: path.clone(), message });
                    let common = common(region, &flat, &made.report, &path)?;
                    (flat, common, MeshFit::Cut)
                }
            }
        }
    };
    let (names, report) = (made.names, made.report);
    Ok(Some(TilingDomain { name, spec, cell, joined, map: Arc::new(map), names, report, region, fit }))
}

/// What a region and a mesh of something else have in common: the region, if the mesh holds it.
fn common(region: &Region, mesh: &CarrierMesh, report: &TetMeshReport, path: &str) -> Result<Region, DesignError> {
    if report.fit.as_ref().is_some_and(|f| f.uncovered == 0.0) {
        return Ok(region.clone());
    }
    let both = Intersection::new(vec![region.clone(), enclosed(mesh.boundary(), path)?]);
    let both: Region = Arc::new(both.map_err(|f| DesignError::fault(path, f))?);
    if both.bounds().is_empty() || sample::inside(&both, sample::COUNT).0.is_empty() {
        let message = "the tetrahedra of the file and the region have nothing in common; is it a mesh of this region, in the right \
                       place and unit?";
        return Err(DesignError::new(path, message));
    }
    Ok(both)
}

/// Says that a region cuts the tetrahedra of a file.
fn cut(report: &TetMeshReport, file: &str) -> String {
    let [tets, region] = [Some(report.quality.volume), report.region_volume].map(|v| rounded(v.unwrap_or(f64::NAN), 5));
    format!(
        "{file} is not a mesh of this region (its tetrahedra fill {tets} mm³, the region {region} mm³): the lattice fills what they have \
         in common, and its cells are cut at the region's surface; give the region that they are a mesh of to have them end there"
    )
}

/// A ready cell.
fn ready_cell(name: &TetCellName, path: &str) -> Result<TetCell, DesignError> {
    let cell = named_tet_cell(&name.0).ok_or_else(|| DesignError::new(path, "no such cell"))?;
    cell.cell().map_err(|f| DesignError::fault(path, f))
}

/// The cell that a series describes; `path` is that of its table.
fn series_cell(spec: &TetSeriesSpec, path: &str) -> Result<TetCell, DesignError> {
    let wrong = |key: &str, f| DesignError::fault(&format!("{path}{key}"), f);
    let group = Group::named(&spec.group.0).map_err(|f| wrong(".group", f))?;
    let sites = group.tetrahedral_sites().map_err(|f| wrong("", f))?;
    let mut all = Vec::new();
    for (i, t) in spec.terms.iter().enumerate() {
        let orbit = orbit_terms(&group, t);
        all.extend(orbit.map_err(|f| wrong(&format!(".terms[{i}]"), f))?);
    }
    let series = Series::new(all).map_err(|f| wrong("", f))?;
    let turns = |c: &[i32; 3]| c.map(|v| f64::from(v) / 24.0);
    let site = match spec.site {
        None => turns(&sites[0]),
        Some(site) => {
            let near = |c: &[i32; 3]| {
                let c = turns(c);
                (0..3).all(|a| {
                    let d = site[a] - c[a];
                    (d - d.round()).abs() < 1e-9
                })
            };
            if !sites.iter().any(near) {
                let name = |c: &[i32; 3]| format!("{:?}", turns(c));
                let listed: Vec<String> = sites.iter().take(8).map(name).collect();
                let more = if sites.len() > 8 { ", …" } else { "" };
                let message = format!(
                    "{site:?} is no point of full tetrahedral symmetry of {}; these are: {}{more}",
                    group.name,
                    listed.join(", ")
                );
                return Err(DesignError::new(format!("{path}.site"), message));
            }
            site
        }
    };
    TetCell::new(series, site, spec.edge, spec.dual).map_err(|f| wrong("", f))
}

/// A lattice over a mesh.
pub(super) struct BuiltTiling {
    /// The lattice with its ends.
    pub done: Finished,
    /// Whether nothing else is in the part: no skin, no kept zone.
    pub alone: bool,
    /// Why its surface is made on a grid, if it is.
    pub on_grid: Option<String>,
    /// The solid fraction of the finished part, where it is to have one or has one by samples, and how far that may be off.
    pub aim: Option<[f64; 2]>,
    /// The zones, if they have cells of their own.
    pub zones: Vec<CellZone>,
    /// Which zones join, if there are any and it can be predicted.
    pub joins: Option<Joins>,
}

/// The lattice.
pub(super) fn lattice(
    domain: &TilingDomain,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<BuiltTiling, DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let at = below("cell.tet");
    let mut cell = match domain.cell {
        TetCellSpec::Zones(zones) => return zoned(domain, &zones.zones, environment, warnings),
        TetCellSpec::Ready(of) => ready_cell(&of.name, &at)?,
        TetCellSpec::Series(of) => series_cell(of, &at)?,
    };
    let part: Part = domain.spec.part.into();
    let spec = &domain.spec.level;
    let path = below("level");
    if spec.fit != LevelFit::Table {
        let message = "the fraction of a tetrahedral cell is exact; leave this out";
        return Err(DesignError::new(format!("{path}.fit"), message));
    }
    let mid = spec.mid;
    if mid != 0.0 {
        let at = format!("{path}.mid");
        check_mid(mid, cell.range(), domain.spec.part, &at)?;
        cell = cell.about(mid).map_err(|f| DesignError::fault(&at, f))?;
    }
    if let Some((length, _)) = spec.amount.length() {
        let message = format!(
            "fraction and {length} together give the wavelength of map.affine and map.spartan; give one of the two"
        );
        return Err(DesignError::new(format!("{path}.{length}"), message));
    }
    let key = spec.amount.key();
    let path = format!("{path}.{key}");
    let amount = match spec.amount {
        AmountSpec::Iso(_) => Amount::Iso,
        AmountSpec::Fraction(_) | AmountSpec::Porosity(_) => Amount::Fraction,
        AmountSpec::Thickness(_) if part != Part::Sheet => {
            let message = "thickness goes with part = \"sheet\": a network has no wall; give its fraction";
            return Err(DesignError::new(path, message));
        }
        AmountSpec::Thickness(_) => Amount::Thickness,
        AmountSpec::Pore(_) | AmountSpec::Stiffness(_) | AmountSpec::Permeability(_) => {
            let message = format!("{key} goes with map.affine and map.spartan, whose cells are alike; give a fraction");
            return Err(DesignError::new(path, message));
        }
    };
    let mut quantity = spec.amount.quantity(path.clone(), environment);
    let grade = spec.amount.grade().build(&quantity)?;
    if amount == Amount::Thickness {
        let most = domain.map.mean_edge();
        within_wavelength(spec.amount.grade(), &grade, &quantity, most)?;
        quantity.key.max = most;
    }
    let values = at_nodes(&grade, &quantity, &domain.map)?;
    if amount == Amount::Thickness && cell.iso(Part::Sheet, 0.5) <= 0.0 {
        return Err(DesignError::new(path, "the cell has no mid-surface f = 0"));
    }
    let level = NodalLevel::of(&domain.map, &cell, part, amount, values.clone());
    let tiling = Tiling::new(domain.map.clone(), Arc::new(cell), part, level);
    let tiling = match amount {
        Amount::Iso => tiling.with_fraction(None),
        Amount::Fraction => tiling.with_fraction(Some(&values)),
        Amount::Thickness => tiling.with_mean_thickness(&values).with_fraction(None),
    };
    check(&tiling, &path)?;
    let made = made(tiling, &values, domain, environment, &path)?;
    check(&made.done.tiling, &path)?;
    warn(&made.done.tiling, &path, warnings);
    Ok(made)
}

/// A lattice with its ends, at the level at which the finished part has the mean of the fractions asked for, if that is another than that
/// of its cells or `of = "part"`; `path` is that of the amount.
fn made(
    tiling: Tiling,
    values: &[f64],
    domain: &TilingDomain,
    environment: &Environment,
    path: &str,
) -> Result<BuiltTiling, DesignError> {
    let spec = &domain.spec.level;
    let fraction = matches!(spec.amount, AmountSpec::Fraction(_) | AmountSpec::Porosity(_));
    let whole = spec.of == FractionOf::Part;
    if whole && !fraction {
        let message = "of = \"part\" goes with a fraction or a porosity";
        return Err(DesignError::new(format!("{}.level.of", environment.path), message));
    }
    let finish = Finish::new(&domain.joined, environment, path)?;
    let map = &domain.map;
    let bent = map.is_bent() && domain.fit != MeshFit::Cut;
    let asked = (fraction && (whole || bent || finish.changes())).then(|| {
        let at = |n: u32| values[(n as usize).min(values.len() - 1)];
        let mean = |t: usize| map.tet(t).map(at).iter().sum::<f64>() / 4.0;
        let sums = (0..map.len()).fold((0.0, 0.0), |(s, v), t| (s + map.volume(t) * mean(t), v + map.volume(t)));
        sums.0 / sums.1
    });
    let alone = environment.filled.is_empty() && domain.fit != MeshFit::Cut && !finish.changes();
    let on_grid = on_grid(domain, environment, finish.changes());
    let done = match asked {
        // Blended functions are evaluated by position by both methods.
        _ if on_grid.is_none() && bent && map.overlap() <= 0.0 => {
            let volume = domain.report.region_volume.unwrap_or_else(|| map.boundary().volume());
            finish.bent(tiling, asked, volume)?
        }
        None if bent || finish.changes() => finish.at_own_level(tiling)?,
        _ => finish.made(tiling, asked, whole)?,
    };
    // Skins and keep zones are counted in a fraction of the whole part alone.
    let aim = asked.map(|share| [share, 0.0]).or(done.fraction.map(|share| [share, SAMPLED]));
    let aim = aim.filter(|_| environment.filled.is_empty() || asked.is_some() && whole);
    Ok(BuiltTiling { done, alone, on_grid, aim, zones: Vec::new(), joins: None })
}

/// Why the surface of a lattice is made on a grid, with the place if there is one; `None` where each tetrahedron has its own.
fn on_grid(domain: &TilingDomain, environment: &Environment, ends: bool) -> Option<String> {
    if domain.joined.method == Method::Implicit {
        return Some("method = \"implicit\"".into());
    }
    if ends {
        return Some(format!("surface = \"{}\"", domain.joined.surface.word()));
    }
    if !environment.filled.is_empty() {
        return Some("a skin or keep zones".into());
    }
    match domain.fit {
        MeshFit::Whole => None,
        MeshFit::Cut => Some("the region cuts the tetrahedra of the file".into()),
        MeshFit::Nearly => Some(match (lost_features(&domain.report).first(), domain.map.farthest_off()) {
            (Some(lost), _) => {
                let size = rounded(lost.size, 3);
                format!("the tetrahedra do not follow a {} of {size} mm at {}", lost.kind.word(), position(lost.at))
            }
            (None, Some((off, place))) => {
                let off = rounded(off * domain.map.mean_edge(), 3);
                format!(
                    "the surface is finer than the tetrahedra: bent onto it they are {off} mm off at {}",
                    position(place)
                )
            }
            (None, None) => "the tetrahedra are not bent onto the region".into(),
        }),
    }
}

/// A lattice of other cells in other zones. A node has each of the cells by the share of the volume about it that is of its
/// zone, so that one passes into the other in the tetrahedra between.
fn zoned(
    domain: &TilingDomain,
    names_of_cells: &BTreeMap<String, TetCellName>,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<BuiltTiling, DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let at = below("cell.tet.zones");
    let map = &domain.map;
    let part: Part = domain.spec.part.into();
    let amount = &domain.spec.level.amount;
    let path = below(&format!("level.{}", amount.key()));
    let (AmountSpec::Fraction(_) | AmountSpec::Porosity(_)) = amount else {
        let message = "cells of different zones have no level in common; give their fraction";
        return Err(DesignError::new(path, message));
    };
    if domain.spec.level.mid != 0.0 {
        return Err(DesignError::new(below("level.mid"), "cells of zones are taken about f = 0"));
    }
    let given = cell_zones::resolved(names_of_cells, map, &domain.names, &at)?;
    let cell_of = |zone: i64| given.iter().find(|g| g.numbers.contains(&zone)).map(|g| g.cell.as_str());
    let quantity = amount.quantity(path.clone(), environment);
    let values = at_nodes(&amount.grade().build(&quantity)?, &quantity, map)?;
    let names: BTreeSet<&TetCellName> = names_of_cells.values().collect();
    let (lo, hi) = values.iter().fold((1.0f64, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
    let (mut cells, mut zoned) = (Vec::new(), Zoned::new());
    for name in names {
        let cell = Arc::new(ready_cell(name, &at)?);
        let range = cell.range();
        let of = given.iter().filter(|g| g.cell == name.0);
        zoned.extend(of.flat_map(|g| g.numbers.iter().map(|z| (*z, cell.clone()))));
        apart(&cell, part, [lo, hi], &path, warnings);
        let weights = map.shares(|zone| cell_of(zone) == Some(&name.0));
        cells.push(Share { cell, scale: 0.5 * (range.hi - range.lo), weights: Some(Arc::new(weights)) });
    }
    let level = NodalLevel::mixed(map, &cells, part, &values);
    let tiling = Tiling::of(map.clone(), cells, part, level).with_fraction(Some(&values));
    let made = made(tiling, &values, domain, environment, &path)?;
    let joins = made.alone.then(|| joins(&made.done.tiling, &zoned, 0.5 * (lo + hi)));
    let joins = joins.flatten();
    if let Some(joins) = &joins {
        joins.warn(&given, &at, warnings);
    }
    Ok(BuiltTiling { zones: given, joins, ..made })
}

/// A number at the nodes of the mesh; one number, if it does not vary.
fn at_nodes(grade: &Grade, quantity: &Quantity, map: &CarrierMesh) -> Result<Vec<f64>, DesignError> {
    if let Some(v) = grade.constant() {
        return Ok(vec![v]);
    }
    let mut values = vec![0.0; map.nodes().len()];
    grade.values(map.nodes(), &mut values);
    for (v, p) in values.iter().zip(map.nodes()) {
        let own = if quantity.complement { 1.0 - v } else { *v };
        let admitted = quantity.key.admit_at(own, &format!(" at {}", position(*p)));
        admitted.map_err(|f| DesignError::fault(&quantity.path, f))?;
    }
    Ok(values)
}

/// Refuses a level at which nothing, or everything, is solid.
fn check(tiling: &Tiling, path: &str) -> Result<(), DesignError> {
    let levels = tiling.levels();
    if !(levels.lo.is_finite() && levels.hi.is_finite()) {
        return Err(DesignError::new(path, "the level is not a number somewhere in the mesh"));
    }
    if tiling.part == Part::Sheet && levels.lo <= 0.0 {
        let message =
            format!("the half-level of a sheet, |f| ≤ t, goes down to {:.4}; it must be above 0 everywhere", levels.lo);
        return Err(DesignError::new(path, message));
    }
    let cell = &tiling.cells[0].cell;
    let shares = [levels.lo, levels.hi].map(|t| cell.fraction(tiling.part, t));
    let what = if shares.iter().all(|s| *s <= 0.0) {
        "empty: nothing is solid"
    } else if shares.iter().all(|s| *s >= 1.0) {
        "solid everywhere: nothing is open"
    } else {
        return Ok(());
    };
    let range = cell.range();
    let message = format!(
        "the lattice leaves the part {what}; the level t is {}, the cell's values run from {:.4} to {:.4} in the tetrahedron",
        Varied { min: levels.lo, max: levels.hi },
        range.lo,
        range.hi
    );
    Err(DesignError::new(path, message))
}

/// Warns of levels at which the cell is disconnected, and of the range of wall thicknesses.
fn warn(tiling: &Tiling, path: &str, warnings: &mut Vec<Warning>) {
    let cell = &tiling.cells[0].cell;
    let part = tiling.part;
    let levels = tiling.levels();
    let share = |t: f64| cell.fraction(part, t);
    let fraction = Varied::of(&[share(levels.lo), share(levels.hi)]);
    apart(cell, part, [fraction.min, fraction.max], path, warnings);
    if path.ends_with("thickness")
        && let Some(s) = tiling.thickness()
    {
        let message = format!(
            "walls follow the tetrahedra: they are {:.4} mm thick on average, 90 % of them between {:.4} and {:.4} mm, all \
                 between {:.4} and {:.4} mm",
            s.mean, s.low, s.high, s.min, s.max
        );
        warnings.push(Warning { path: path.to_string(), message });
        if s.through > THICKER * s.mean {
            let message = format!(
                "on {:.0} % of the mid-surface walls run into each other: where {:.4} mm are asked for, the solid is {:.4} mm thick along its \
                 normals; give a smaller thickness, larger tetrahedra, or a cell whose walls are farther apart",
                100.0 * s.merged,
                s.mean,
                s.through
            );
            warnings.push(Warning { path: path.to_string(), message });
        }
    }
}

/// Warns of fractions at which a cell is disconnected.
fn apart(cell: &TetCell, part: Part, [min, max]: [f64; 2], path: &str, warnings: &mut Vec<Warning>) {
    let fraction = Varied { min, max };
    let whole = cell.connected_fraction(part);
    if !gaps([min, max], &whole).is_empty() {
        let count = cell.count(part, cell.iso(part, 0.5 * (min + max)));
        let texts: Vec<String> = whole.iter().map(|&[min, max]| Varied { min, max }.to_string()).collect();
        let limit = match texts.len() {
            0 => "at no fraction is it one piece that reaches all faces".to_string(),
            _ => format!("it is one piece that reaches all faces at fractions {}", texts.join(" and ")),
        };
        let message = format!(
            "at solid fraction {fraction} the tetrahedral cell is in {} with {} on each face, so the lattice may fall apart; {limit}",
            geometry::fault::counted(count.components, "piece"),
            geometry::fault::counted(count.ports, "port"),
        );
        warnings.push(Warning { path: path.to_string(), message });
    }
}
