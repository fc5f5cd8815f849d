//! Data to solid: values are checked, lattices and regions are combined, and likely mistakes are warned of.

use std::cell::RefCell;
use std::sync::Arc;

use super::build_cell::cell;
use super::data::*;
use super::finish_tiling::Finished;
use super::{
    Built, Design, Loader, Tiled, Warning, build_beams, build_blend, build_core, build_level, build_skin, build_tets,
    build_tiling, sample, warn,
};
use crate::blend::Constituent;
use crate::cell::Part;
use crate::csg_tree::CsgSolid;
use crate::environment::{self, Environment};
use crate::implicit::Implicit;
use crate::kind::{DesignError, Kind};
use crate::lattice::Lattice;
use crate::region::{FARTHEST, Notes, Region};
use crate::report::{NetReport, PropertyReport};
use crate::solid::Solid;
use crate::truss::Beams;
use geometry::fault::number;
use geometry::math::Vec3;

impl From<PartSpec> for Part {
    fn from(p: PartSpec) -> Part {
        match p {
            PartSpec::Sheet => Part::Sheet,
            PartSpec::Lower => Part::Lower,
            PartSpec::Upper => Part::Upper,
        }
    }
}

/// The region of a design's solid.
pub(super) fn region_of(d: &Design, loader: &dyn Loader) -> Result<Region, DesignError> {
    d.valid().map_err(|f| DesignError::fault("", f))?;
    let notes = RefCell::default();
    let (region, soup) = given(d, loader, &notes)?;
    let domain = build_tiling::domain(d, &region, soup, loader, &notes)?;
    Ok(domain.map_or(region, |d| d.region))
}

/// The region as given; with the tetrahedra that fill it, if it is only known by them.
fn given(
    d: &Design,
    loader: &dyn Loader,
    notes: &RefCell<Notes>,
) -> Result<(Region, Option<build_tets::BuiltTets>), DesignError> {
    match environment::region(&d.region, "region", loader, None, notes) {
        Ok(region) => Ok((region, None)),
        Err(why) => {
            let (made, region) = build_tiling::of_soup(d, loader, why)?;
            Ok((region, Some(made)))
        }
    }
}

/// The solid of a design.
pub(super) fn design(d: &Design, loader: &dyn Loader) -> Result<Built, DesignError> {
    d.valid().map_err(|f| DesignError::fault("", f))?;
    let notes = RefCell::default();
    let (region, soup) = given(d, loader, &notes)?;
    check_bounds(&region)?;
    let domain = build_tiling::domain(d, &region, soup, loader, &notes)?;
    let region = domain.as_ref().map_or(region, |d| d.region.clone());
    let points = sampled(&region, &mut notes.borrow_mut().warnings)?;
    let (filled, skin) = build_skin::filled(d, &region, &points, loader, &notes)?;
    let sets = super::sets_kind::sets(d, &region, loader, &notes)?;
    let at =
        |path: String| Environment { path, region: &region, points: &points, filled: &filled, loader, notes: &notes };

    let mut warnings = Vec::new();
    let (mut lattices, mut tilings, mut graphs) = (Vec::new(), Vec::new(), Vec::new());
    let mut properties = Vec::new();
    let mut nets = Vec::new();
    if let Some(domain) = domain {
        let environment = at(format!("lattice.{}", domain.name));
        let (made, net) = tiled(domain, &environment, &mut warnings)?;
        tilings.push(made);
        nets.extend(net);
    }
    for (name, spec) in d.lattice.iter().filter(|(_, s)| !matches!(s.map, MapKind::Tets(_))) {
        let environment = at(format!("lattice.{name}"));
        let (made, property) = checked_lattice(spec, d, &environment, &mut warnings)?;
        lattices.push((name.clone(), Arc::new(made)));
        properties.extend(property.map(|p| (name.clone(), p)));
    }
    for (name, spec) in &d.beams.0 {
        graphs.push((name.clone(), build_beams::beams(spec, &at(format!("beams.{name}")), &mut warnings)?));
    }

    let wavelengths = lattices.iter().map(|l| l.1.map.wavelength());
    let wavelengths = wavelengths.chain(graphs.iter().map(|g| g.1.wavelength()));
    let wavelengths = wavelengths.chain(tilings.iter().map(|t| t.tiling.wavelength()));
    let wavelength = wavelengths.fold(f64::INFINITY, f64::min);
    let blend = d.blend.as_ref().map(|spec| {
        let members = members(&lattices, &tilings, &graphs);
        build_blend::blend(spec, &members, &at("blend".into()), &mut warnings)
    });
    let blend = blend.transpose()?;
    let field = match &blend {
        Some(made) => made.blend.clone(),
        None => only(&lattices, &tilings, &graphs)?,
    };
    let field = build_core::hollowed(field, &lattices);
    let (core_names, cores) = build_core::solid(&lattices);
    let mut solid = Solid::new(region.clone(), Some(field), wavelength);
    solid.transition = blend.as_ref().and_then(|b| b.width);
    let skins = d.skin.iter().map(|_| "SKIN".to_string());
    let keeps = d.keep.0.keys().map(|name| format!("KEEP_{name}"));
    let bodies = skins.chain(keeps).chain(nets.iter().map(|_| "NET".to_string())).chain(core_names).collect();
    let solid = filled.into_iter().chain(nets).chain(cores).fold(solid, Solid::with);
    let (figures, moves) = Default::default();
    let Notes { warnings: of_regions, repairs } = notes.into_inner();
    // A region may be made more than once.
    let mut all: Vec<Warning> = Vec::new();
    for warning in of_regions.into_iter().chain(warnings) {
        if !all.contains(&warning) {
            all.push(warning);
        }
    }
    let warnings = all;
    let beams = graphs;
    Ok(Built {
        solid,
        bodies,
        sets,
        lattices,
        properties,
        tilings,
        beams,
        blend,
        skin,
        warnings,
        repairs,
        figures,
        moves,
    })
}

/// Refuses a region that is empty, unbounded or too far away.
fn check_bounds(region: &Region) -> Result<(), DesignError> {
    let bounds = region.bounds();
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
    Ok(())
}

/// Points inside the region, at which numbers that vary are checked. Warns of an implausible size of a part.
fn sampled(region: &Region, warnings: &mut Vec<Warning>) -> Result<Vec<Vec3>, DesignError> {
    let size = region.bounds().size();
    let (mut points, _) = sample::inside(region, sample::COUNT);
    if points.is_empty() {
        let [x, y, z] = size.map(number);
        let message = format!("the region is empty: no point inside was found within its bounds, {x} × {y} × {z} mm");
        return Err(DesignError::new("region", message));
    }
    points.extend(sample::nodes(region));
    let largest = size.into_iter().fold(0.0, f64::max);
    if !(0.1..=2000.0).contains(&largest) {
        let message = format!("the region is {} mm across; is its unit right?", number(largest));
        warnings.push(Warning { path: "region".into(), message });
    }
    Ok(points)
}

/// The lattice over a tetrahedral mesh, and the net that ties its ports.
fn tiled(
    domain: build_tiling::TilingDomain,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<(Tiled, Option<CsgSolid>), DesignError> {
    let opening = domain.opening();
    let build_tiling::BuiltTiling { done, alone, on_grid, aim, zones, joins } =
        build_tiling::lattice(&domain, environment, warnings)?;
    let Finished { tiling, placed, field, net, radii, fraction: finished } = done;
    let coverage = net.as_ref().map(|rods| NetReport::new(&tiling, rods));
    if let Some(of) = &coverage {
        of.warn(opening, &format!("{}.map.tets", environment.path), warnings);
    }
    let (name, ends) = (domain.name.to_string(), domain.ends());
    let mesh = domain.report;
    let explicit = on_grid.is_none();
    let tiled = Tiled {
        name,
        tiling,
        placed,
        zones,
        mesh,
        alone,
        explicit,
        on_grid,
        aim,
        joins,
        ends,
        radii,
        coverage,
        finished,
        field,
    };
    Ok((tiled, net.map(|rods| rods.solid)))
}

/// A lattice, with warnings of likely mistakes, and the property that its level was solved for.
fn checked_lattice(
    spec: &LatticeSpec,
    d: &Design,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<(Lattice, Option<PropertyReport>), DesignError> {
    let path = &environment.path;
    if spec.level.of == FractionOf::Part && d.blend.is_some() {
        let message = "of = \"part\" speaks of the part, of which a lattice in a blend is not alone; leave it out";
        return Err(DesignError::new(format!("{path}.level.of"), message));
    }
    let (built, property) = lattice(spec, environment)?;
    let points = built.level.grade().check_points(environment);
    let environment = &Environment { path: path.clone(), points: &points, ..*environment };
    warn::check(&built, environment, spec)?;
    warn::warn(&built, environment, spec, warnings);
    warn::solved_map(&built.map, &spec.map, path, warnings);
    warn::wrapped_map(&built, &spec.map, environment, warnings);
    let level = Environment { path: format!("{path}.level"), ..*environment };
    warn::fraction_with_thickness(&built, spec, &level, warnings)?;
    Ok((built, property))
}

/// The field of a design without a blend.
fn only(
    lattices: &[(String, Arc<Lattice>)],
    tilings: &[Tiled],
    graphs: &[(String, Beams)],
) -> Result<Arc<dyn Implicit>, DesignError> {
    match (lattices, tilings, graphs) {
        ([(_, one)], [], []) => Ok(one.clone()),
        ([], [one], []) => Ok(one.alone_field()),
        ([], [], [(_, one)]) => Ok(one.field()),
        ([], [], []) => Err(DesignError::new("lattice", "no lattice given; give one")),
        _ => Err(DesignError::new("blend", "several lattices need a blend to say where each is")),
    }
}

/// The lattices and beams that a blend may name.
fn members(
    lattices: &[(String, Arc<Lattice>)],
    tilings: &[Tiled],
    graphs: &[(String, Beams)],
) -> Vec<build_blend::Member> {
    let lattices = lattices.iter().map(|(name, l)| build_blend::Member {
        table: "lattice",
        name: name.clone(),
        of: Constituent::Lattice(l.clone()),
    });
    let tilings = tilings.iter().map(|t| build_blend::Member {
        table: "lattice",
        name: t.name.clone(),
        of: match <[_; 2]>::try_from(t.field.parts()) {
            Ok(sides) => Constituent::Wall { sides, half: t.tiling.uniform(), wavelength: t.tiling.wavelength() },
            Err(_) => Constituent::Field { field: t.field.clone(), wavelength: t.tiling.wavelength() },
        },
    });
    let graphs = graphs.iter().map(|(name, b)| build_blend::Member {
        table: "beams",
        name: name.clone(),
        of: Constituent::Field { field: b.field(), wavelength: b.wavelength() },
    });
    lattices.chain(tilings).chain(graphs).collect()
}

/// A lattice, and the property that its level was solved for.
fn lattice(spec: &LatticeSpec, environment: &Environment) -> Result<(Lattice, Option<PropertyReport>), DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let (name, cell) = cell(&spec.cell, &below("cell"), environment.loader)?;
    let cell = build_level::about_mid(cell, &spec.level, spec.part, &below("level"))?;
    let here = Environment { path: below("map"), ..*environment };
    let level = Environment { path: below("level"), ..*environment };
    let map = match spec.level.amount.length() {
        None => spec.map.build(&here)?,
        Some(length) => build_level::solved_map(spec, length, &cell, &here, &level)?,
    };
    let map = build_core::centred(map, &cell, &below("cell"))?;
    let here = level;
    let (level, property) = build_level::level(&spec.level, spec.part, name, &cell, &map, &here)?;
    Ok((Lattice::new(cell, map, spec.part.into(), level), property))
}
