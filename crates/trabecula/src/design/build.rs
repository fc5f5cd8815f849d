//! Data to solid: values are checked, pieces are joined, and what may not be meant is warned of.

use std::sync::Arc;

use super::cell::cell;
use super::data::*;
use super::{Built, Design, Loader, Tiled, Warning, beams, blend, level, sample, skin, tets, tiling, warn};
use crate::blend::Constituent;
use crate::cell::Part;
use crate::environment::{self, Environment};
use crate::implicit::Implicit;
use crate::kind::{DesignError, Kind};
use crate::lattice::Lattice;
use crate::region::Region;
use crate::solid::Solid;
use crate::truss::Beams;
use geometry::fault::number;

/// How far from the origin a region may reach, mm: a thousand kilometres.
const FARTHEST: f64 = 1e9;

impl From<PartSpec> for Part {
    fn from(p: PartSpec) -> Part {
        match p {
            PartSpec::Sheet => Part::Sheet,
            PartSpec::Lower => Part::Lower,
            PartSpec::Upper => Part::Upper,
        }
    }
}

/// The region that a design's solid is in.
pub(super) fn space(d: &Design, loader: &dyn Loader) -> Result<Region, DesignError> {
    d.valid().map_err(|f| DesignError::fault("", f))?;
    let mut notes = crate::region::Notes::default();
    let (space, soup) = given(d, loader, &mut notes)?;
    let domain = tiling::domain(d, &space, soup, loader, &mut notes.warnings)?;
    Ok(domain.map_or(space, |d| d.region))
}

/// The region as given; with the tetrahedra that fill it, if it is only known by them.
fn given(
    d: &Design,
    loader: &dyn Loader,
    notes: &mut crate::region::Notes,
) -> Result<(Region, Option<tets::Tets>), DesignError> {
    match environment::region(&d.region, "region", loader, notes) {
        Ok(space) => Ok((space, None)),
        Err(why) => {
            let (made, space) = tiling::of_soup(d, loader, why)?;
            Ok((space, Some(made)))
        }
    }
}

pub(super) fn design(d: &Design, loader: &dyn Loader) -> Result<Built, DesignError> {
    d.valid().map_err(|f| DesignError::fault("", f))?;
    let mut notes = crate::region::Notes::default();
    let (space, soup) = given(d, loader, &mut notes)?;
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
    let (mut points, _) = sample::inside(&space, sample::COUNT);
    if points.is_empty() {
        let [x, y, z] = bounds.size().map(number);
        let message = format!("the region is empty: no point inside was found within its bounds, {x} × {y} × {z} mm");
        return Err(DesignError::new("region", message));
    }
    points.extend(sample::nodes(&space));
    let largest = bounds.size().into_iter().fold(0.0, f64::max);
    if !(0.1..=2000.0).contains(&largest) && !notes.warnings.iter().any(|w| w.message.contains("unit")) {
        let message = format!("the region is {} mm across; is its unit right?", number(largest));
        notes.warnings.push(Warning { path: "region".into(), message });
    }
    let (filled, thinnest) = skin::filled(d, &space, &points, loader, &mut notes)?;
    let crate::region::Notes { mut warnings, repairs } = notes;
    let (mut lattices, mut tilings) = (Vec::new(), Vec::new());
    if let Some(domain) = domain {
        let environment = Environment {
            path: format!("lattice.{}", domain.name),
            region: &space,
            points: &points,
            filled: &filled,
            loader,
        };
        let tiling::Made { tiling, explicit, joins } = tiling::lattice(&domain, &environment, &mut warnings)?;
        tilings.push(Tiled {
            name: domain.name.to_string(),
            tiling: tiling.clone(),
            zones: domain.zones(),
            mesh: domain.report,
            explicit,
            joins,
        });
        if d.blend.is_none() {
            let solid = Solid::new(space.clone(), Some(tiling.clone()), tiling.wavelength());
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
    for (name, spec) in others.filter(|(_, s)| !matches!(s.map, MapKind::Tets(_))) {
        let path = format!("lattice.{name}");
        let environment = Environment { path: path.clone(), region: &space, points: &points, filled: &filled, loader };
        if spec.level.of == Of::Part && d.blend.is_some() {
            let message = "of = \"part\" speaks of the part, of which a lattice in a blend is not alone; leave it out";
            return Err(DesignError::new(format!("{path}.level.of"), message));
        }
        let built = Arc::new(lattice(spec, &environment)?);
        warn::check(&built, &environment, spec)?;
        warn::warn(&built, &environment, spec, &mut warnings);
        warn::solved_map(&built.map, &spec.map, &path, &mut warnings);
        lattices.push((name.clone(), built));
    }
    let mut graphs = Vec::new();
    for (name, spec) in &d.beams.0 {
        let environment =
            Environment { path: format!("beams.{name}"), region: &space, points: &points, filled: &filled, loader };
        let made = beams::beams(spec, &environment, &mut warnings)?;
        graphs.push((name.clone(), made));
    }
    let wavelengths = lattices.iter().map(|l| l.1.map.wavelength());
    let wavelengths = wavelengths.chain(graphs.iter().map(|g| g.1.wavelength()));
    let wavelengths = wavelengths.chain(tilings.iter().map(|t| t.tiling.wavelength()));
    let wavelength = wavelengths.fold(f64::INFINITY, f64::min);
    let mut blended = None;
    let field: Arc<dyn Implicit> = match (&d.blend, lattices.as_slice(), graphs.as_slice()) {
        (Some(spec), ..) => {
            let environment =
                Environment { path: "blend".into(), region: &space, points: &points, filled: &filled, loader };
            let made = blend::blend(spec, &members(&lattices, &tilings, &graphs), &environment, &mut warnings)?;
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
    Ok(Built { solid, lattices, tilings, beams: graphs, blend: blended, skin: thinnest, warnings, repairs })
}

/// What may be named in a blend.
fn members(lattices: &[(String, Arc<Lattice>)], tilings: &[Tiled], graphs: &[(String, Beams)]) -> Vec<blend::Member> {
    let lattices = lattices.iter().map(|(name, l)| blend::Member {
        table: "lattice",
        name: name.clone(),
        of: Constituent::Lattice(l.clone()),
    });
    let tilings = tilings.iter().map(|t| blend::Member {
        table: "lattice",
        name: t.name.clone(),
        of: match <[_; 2]>::try_from(t.tiling.parts()) {
            Ok(sides) => Constituent::Wall { sides, half: t.tiling.uniform(), wavelength: t.tiling.wavelength() },
            Err(_) => Constituent::Field { field: t.tiling.clone(), wavelength: t.tiling.wavelength() },
        },
    });
    let graphs = graphs.iter().map(|(name, b)| blend::Member {
        table: "beams",
        name: name.clone(),
        of: Constituent::Field { field: b.field(), wavelength: b.wavelength() },
    });
    lattices.chain(tilings).chain(graphs).collect()
}

fn lattice(spec: &LatticeSpec, environment: &Environment) -> Result<Lattice, DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let (name, cell) = cell(&spec.cell, &below("cell"), environment.loader)?;
    let left_out = cell.truncation();
    let mut cell = level::about_mid(cell, &spec.level, spec.part, &below("level"))?;
    if let Some(share) = left_out {
        cell = cell.truncated(share);
    }
    let cell = Arc::new(cell);
    let here = Environment { path: below("map"), ..*environment };
    let map = spec.map.build(&here)?;
    let here = Environment { path: below("level"), ..*environment };
    let level = level::level(&spec.level, spec.part, name, &cell, &map, &here)?;
    Ok(Lattice::new(cell, map, spec.part.into(), level))
}
