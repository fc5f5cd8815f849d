//! Tetrahedral meshes: made or read, checked, and assessed before a lattice is built on them.

mod source;

use std::cell::RefCell;

use super::data::*;
use super::{Design, Loader, Node, Warning, ZoneNames, sample};
use crate::environment::{self, Environment};
use crate::grade::{Quantity, key_of};
use crate::kind::{DesignError, Key, Kind, NodeCursor};
use crate::mesher::{self, Background, FitReport, MadeLayers, PrismLayers, background};
use crate::region::Notes;
use crate::report::TetMeshReport;
use geometry::fault::{Fault, counted, number, position};
use geometry::math::{Vec3, add, scale};
use geometry::tetmesh::surface_fit::{LostFeature, LostKind};
use geometry::tetmesh::{Checked, SLIVER, TetMesh};
use geometry::transform::Transform;
use source::{from_file, ftetwild, surface, triangles};

/// Depth above which a loss is deep, in sizes: a chord of two sizes over an arc of radius three leaves out a sixth of a size.
const DEEP: f64 = 0.17;
/// The share of the region that a mesh may leave out before it is warned of, if some of that is deep: curved faces are cut
/// short by flat ones, which takes much of a coarse mesh but nothing deep.
const MUCH: f64 = 0.1;
/// Distance above which the boundary is far off, in sizes; cells at cut edges are stretched to there.
const FAR: f64 = 0.5;
/// The least height of a layer, over that of all: thinner ones are lost in the rounding of positions.
const THINNEST: f64 = 1e-4;
/// The share of the area of layers from which on it is warned of those that are lower than asked for.
const NOTABLE: f64 = 0.05;
/// Tetrahedra along the longest side of a part that a warning of too few advises.
const ACROSS: f64 = 4.0;
/// Number of lost features that a warning names.
const NAMED: usize = 3;

/// A tetrahedral mesh of a region, and its report.
#[derive(Clone, Debug)]
pub struct BuiltTets {
    /// The mesh, checked.
    pub mesh: TetMesh,
    /// Its nodes with those of the boundary on the region's surface, where it was made for one: between them, its flat faces balance about that.
    pub on_surface: Option<Vec<Vec3>>,
    /// Numbers of zones with names, from its file.
    pub names: ZoneNames,
    /// Its figures.
    pub report: TetMeshReport,
    /// Warnings of likely mistakes.
    pub warnings: Vec<Warning>,
}

/// Features of the region that a mesh does not keep, but for those that are small against its tetrahedra.
pub(super) fn lost_features(report: &TetMeshReport) -> Vec<&LostFeature> {
    let matters = |f: &&LostFeature| {
        let one_way = matches!(f.kind, LostKind::Block | LostKind::Recess);
        f.depth > if one_way { FAR } else { DEEP } * report.quality.size.mean
    };
    report.fit.iter().flat_map(|f| &f.lost).filter(matters).collect()
}

impl BuiltTets {
    /// The tetrahedral mesh of a lattice (by name, or the first that has one) in a design; its other keys are left alone.
    pub fn in_design(node: &Node, lattice: Option<&str>, loader: &dyn Loader) -> Result<BuiltTets, DesignError> {
        let lines = node.lines();
        let make = || {
            let (path, spec) = declared(node, lattice)?;
            spec.check(&Key::NONE).map_err(|f| DesignError::fault(&path, f))?;
            let region_spec = region_of(node)?;
            let notes = RefCell::default();
            let region = match environment::region(&region_spec, "region", loader, None, &notes) {
                Ok(region) => region,
                Err(why) => return of_soup(&spec, &region_spec, &path, loader, why),
            };
            let bounds = region.bounds();
            if !bounds.is_empty() && !bounds.is_finite() {
                let message = "the region has no end; intersect it with a box or another bounded region";
                return Err(DesignError::new("region", message));
            }
            let (mut points, _) = sample::inside(&region, sample::COUNT);
            if bounds.is_empty() || points.is_empty() {
                return Err(DesignError::new("region", "the region is empty"));
            }
            points.extend(sample::nodes(&region));
            let environment =
                Environment { path, region: &region, points: &points, filled: &[], loader, notes: &notes };
            let mut made = tets(&spec, &region_spec, &environment)?;
            made.warnings.splice(0..0, notes.into_inner().warnings);
            Ok(made)
        };
        make().map_err(|mut e: DesignError| {
            e.line = e.line.or_else(|| lines.line(&e.path));
            e
        })
    }

    /// The tetrahedral mesh in a file, of no region.
    pub fn in_file(file: &TetFileKind, loader: &dyn Loader) -> Result<BuiltTets, DesignError> {
        let (mesh, checked, names) = from_file(file, "", loader)?;
        Ok(BuiltTets { names, ..checked_mesh(mesh, &checked, file.path.clone(), None, "", false)? })
    }

    /// The image of the mesh, of no region.
    pub fn transformed(&self, by: &Transform) -> Result<BuiltTets, DesignError> {
        let mesh = self.mesh.transformed(by).map_err(|f| DesignError::fault("", f))?;
        let made = checked_mesh(mesh, &Checked::default(), self.report.mesher.clone(), None, "", false)?;
        Ok(BuiltTets { names: self.names.clone(), ..made })
    }

    /// The figures and the warnings.
    pub fn report(&self) -> TetMeshReport {
        TetMeshReport { warnings: Some(self.warnings.clone()), ..self.report.clone() }
    }
}

/// The region in a design whose other keys are left alone.
fn region_of(node: &Node) -> Result<RegionKind, DesignError> {
    match entry(&NodeCursor::root(node), "region")? {
        Some(at) => RegionKind::read(&at),
        None => {
            Err(DesignError::new("region", format!("\"region\" is missing: {}", key_of::<Design>("region").meaning())))
        }
    }
}

/// The entry of a table with other keys, which are left alone.
fn entry<'a>(at: &NodeCursor<'a>, key: &str) -> Result<Option<NodeCursor<'a>>, DesignError> {
    let entries = at.entries(&format!("a table with {key}"))?;
    Ok(entries.into_iter().find(|(k, _)| *k == key).map(|e| e.1))
}

/// The tetrahedral mesh in a design, whose other keys are left alone, and the path of its table; the name of its lattice if
/// it is to be that of one.
fn declared(node: &Node, lattice: Option<&str>) -> Result<(String, TetsKind), DesignError> {
    let lattices = match entry(&NodeCursor::root(node), "lattice")? {
        Some(of) => of.entries("lattices by name, such as [lattice.core]")?,
        None => Vec::new(),
    };
    for (_, at) in lattices.iter().filter(|(name, _)| lattice.is_none_or(|wanted| wanted == *name)) {
        if let Some(map) = entry(at, "map")?
            && let Some(tets) = entry(&map, "tets")?
        {
            return Ok((tets.path.clone(), TetsKind::read(&tets)?));
        }
    }
    let message =
        "no lattice of the design has a tetrahedral mesh; give one, such as [lattice.core.map.tets] with size = 5";
    Err(DesignError::new("lattice", message))
}

/// The tetrahedral mesh of `spec`; `environment.path` is that of its table.
pub(super) fn tets(spec: &TetsKind, region: &RegionKind, environment: &Environment) -> Result<BuiltTets, DesignError> {
    let wrong = |f: Fault| DesignError::fault(&environment.path, f);
    // Points on the surface are no evidence of lost volume.
    let inside: Vec<Vec3> = {
        let mut values = vec![0.0; environment.points.len()];
        environment.region.values(environment.points, &mut values);
        let deep = environment.points.iter().zip(&values).filter(|(_, v)| **v < 0.0);
        deep.map(|(p, _)| *p).collect()
    };
    let bounds = environment.region.bounds();
    let mut names = Vec::new();
    let (mut layers, mut balanced) = (None, None);
    let (mut mesh, mended, checked, mesher) = match spec {
        TetsKind::Made(made) => {
            let below = |key: &str| format!("{}.{key}", environment.path);
            let size = made.size.build(&Quantity::new(below("size"), environment, key_of::<MadeTetsKind>("size")))?;
            if made.mesher == MesherKind::Background {
                let wanted = made.layers.as_ref().map(|l| prism_layers(l, environment)).transpose()?;
                let made = background(environment.region, &bounds, &size, &inside, wanted.as_ref()).map_err(wrong)?;
                layers = made.layers;
                let Background { mesh, left_out, .. } = made;
                balanced = Some(made.balanced);
                (mesh, left_out, Checked::default(), "background".to_string())
            } else {
                if made.layers.is_some() {
                    let message = "layers go with mesher = \"background\"; leave out one of the two";
                    return Err(DesignError::new(below("layers"), message));
                }
                let Some(size) = size.constant() else {
                    let message =
                        "ftetwild takes one size for the whole part; give a number, or mesher = \"background\"";
                    return Err(DesignError::new(below("size"), message));
                };
                let surface = surface(region, environment, size)?;
                let (mesh, checked) = ftetwild(made, &surface, size, &environment.path, environment.loader)?;
                (mesh, 0.0, checked, "ftetwild".to_string())
            }
        }
        TetsKind::File(file) => {
            let (mesh, checked, named) = from_file(file, &environment.path, environment.loader)?;
            names = named;
            (mesh, 0.0, checked, file.path.clone())
        }
    };
    if let TetsKind::Made(made) = spec {
        mesh.zones =
            zones(&mesh, made, &environment.path, environment.loader, Some(environment.region), environment.notes)?;
    }
    let on_surface = balanced.map(|nodes| core::mem::replace(&mut mesh.nodes, nodes));
    let own = environment.region.volume().unwrap_or_else(|| {
        let (_, share) = sample::inside(environment.region, 25 * sample::COUNT);
        share * bounds.size().iter().product::<f64>()
    });
    let size = mean_size(&mesh);
    let surface = surface(region, environment, size)?;
    let fit = mesher::fit(&mesh, size, &surface, (&**environment.region, own), &inside, mended);
    let is_made = matches!(spec, TetsKind::Made(_));
    let mut made = checked_mesh(mesh, &checked, mesher, Some(fit), &environment.path, is_made)?;
    made.warnings.extend(oversized(spec, bounds.size(), &made.report, &environment.path));
    made.report.region_volume = Some(own);
    made.report.layers = layers;
    made.warnings.extend(layers.and_then(|l| lowered(&l, &environment.path)));
    (made.names, made.on_surface) = (names, on_surface);
    Ok(made)
}

/// The layers that are asked for.
fn prism_layers(spec: &LayersSpec, environment: &Environment) -> Result<PrismLayers, DesignError> {
    let path = |key: &str| format!("{}.layers.{key}", environment.path);
    let ends = PrismLayers::ends(spec.count, spec.height, spec.growth);
    let depth = ends.last().copied().unwrap_or(0.0);
    let most = environment.region.bounds().size().into_iter().fold(0.0, f64::max);
    if depth > most {
        let message =
            format!("the layers are {} mm high together, more than the part, {} mm", number(depth), number(most));
        return Err(DesignError::new(path("height"), message));
    }
    let thinnest = spec.height * spec.growth.powi(spec.count as i32 - 1).min(1.0);
    if thinnest < THINNEST * depth {
        let message =
            format!("the thinnest of the layers is {} mm high; give fewer, or a growth nearer to 1", number(thinnest));
        return Err(DesignError::new(path("count"), message));
    }
    let on = path("on");
    Ok(PrismLayers { ends, on: spec.on.as_ref().map(|of| environment.region(of, &on)).transpose()? })
}

/// A warning of layers that are lower than asked for.
fn lowered(made: &MadeLayers, path: &str) -> Option<Warning> {
    (made.lower >= NOTABLE).then(|| Warning {
        path: format!("{path}.layers"),
        message: format!(
            "on {:.0} % of their area, layers are lower than nine tenths of the height asked for: they have {:.0} % of it on average, and \
             {:.0} % at ({}) mm, where the tetrahedra leave no more room; give fewer or lower ones, or a smaller size",
            100.0 * made.lower,
            100.0 * made.mean,
            100.0 * made.least,
            made.at.map(|v| rounded(v, 3).to_string()).join(", ")
        ),
    })
}

/// Says that tetrahedra were asked for that are larger than the part, which has none of that size.
fn oversized(spec: &TetsKind, part: Vec3, report: &TetMeshReport, path: &str) -> Option<Warning> {
    let TetsKind::Made(MadeTetsKind { size: GradeSpec::Constant(size), .. }) = spec else { return None };
    let longest = part.into_iter().fold(0.0, f64::max);
    if *size <= longest {
        return None;
    }
    let [x, y, z] = part.map(|v| rounded(v, 4));
    let uncovered = report.fit.as_ref().map_or(0.0, |f| f.uncovered);
    let left = if uncovered < 1e-3 {
        String::new()
    } else {
        format!(" and leave {:.1} % of the region out", 100.0 * uncovered)
    };
    let message = format!(
        "{} mm is more than the region, {x} × {y} × {z} mm: its {} tetrahedra, of {} mm on average, are as large as they can be{left}; use \
         a size of {} mm or less",
        number(*size),
        report.quality.tets,
        rounded(report.quality.size.mean, 3),
        rounded(longest / ACROSS, 2)
    );
    Some(Warning { path: format!("{path}.size"), message })
}

/// The edge of a regular tetrahedron of the mean volume (mm).
fn mean_size(mesh: &TetMesh) -> f64 {
    (72f64.sqrt() * mesh.volume() / mesh.tets.len().max(1) as f64).cbrt()
}

/// A number to a few digits, for a message.
pub(super) fn rounded(v: f64, digits: usize) -> String {
    number(format!("{v:.*e}", digits - 1).parse().unwrap_or(v))
}

/// The zone of each tetrahedron, if there are any: that of the first region that has its middle, else 0.
fn zones(
    mesh: &TetMesh,
    made: &MadeTetsKind,
    path: &str,
    loader: &dyn Loader,
    part: Option<&crate::region::Region>,
    notes: &RefCell<Notes>,
) -> Result<Vec<i64>, DesignError> {
    if made.zones.is_empty() {
        return Ok(Vec::new());
    }
    let middle = |t: &[u32; 4]| {
        let sum = t.iter().fold([0.0; 3], |s, n| add(s, mesh.nodes[*n as usize]));
        scale(sum, 0.25)
    };
    let middles: Vec<Vec3> = mesh.tets.iter().map(middle).collect();
    let mut of: Vec<Option<i64>> = vec![None; middles.len()];
    for (&zone, spec) in &made.zones {
        let path = format!("{path}.zones.{zone}");
        let region = environment::region(spec, &path, loader, part, notes)?;
        let mut values = vec![0.0; middles.len()];
        region.values(&middles, &mut values);
        let mut count = 0;
        for (of, _) in of.iter_mut().zip(&values).filter(|(of, v)| of.is_none() && **v < 0.0) {
            *of = Some(i64::from(zone));
            count += 1;
        }
        if count == 0 {
            let message =
                "no tetrahedron's middle is in this region, or all are in zones before it; move it or leave it out";
            return Err(DesignError::new(path, message));
        }
    }
    Ok(of.into_iter().map(|z| z.unwrap_or(0)).collect())
}

/// The mesh with its figures, and warnings at `path`; whether it was made for its region.
fn checked_mesh(
    mesh: TetMesh,
    checked: &Checked,
    mesher: String,
    fit: Option<FitReport>,
    path: &str,
    is_made: bool,
) -> Result<BuiltTets, DesignError> {
    let Some(quality) = mesh.quality() else {
        return Err(DesignError::new(path, "the mesh has no tetrahedron"));
    };
    let report = TetMeshReport { mesher, quality, fit, region_volume: None, layers: None, warnings: None };
    let warnings = warnings(&report, checked, path, is_made);
    Ok(BuiltTets { mesh, on_surface: None, names: Vec::new(), report, warnings })
}

/// The mesh of triangles that are no region, for the reason `why`, if the mesher can do without one: its boundary is the
/// region then.
pub(super) fn of_soup(
    spec: &TetsKind,
    region: &RegionKind,
    path: &str,
    loader: &dyn Loader,
    why: DesignError,
) -> Result<BuiltTets, DesignError> {
    let (TetsKind::Made(made), RegionKind::Mesh(file)) = (spec, region) else {
        return Err(why);
    };
    let Ok(surface) = triangles(file, loader) else {
        return Err(why);
    };
    if made.mesher == MesherKind::Background {
        let message = format!(
            "{}; {path}.mesher = \"ftetwild\" takes such triangles too, and the boundary of its mesh is the region then",
            why.message
        );
        return Err(DesignError { message, ..why });
    }
    let GradeSpec::Constant(size) = made.size else {
        return Err(why);
    };
    let (mut mesh, checked) = ftetwild(made, &surface, size, path, loader)?;
    let notes = RefCell::default();
    mesh.zones = zones(&mesh, made, path, loader, None, &notes)?;
    let mut made = checked_mesh(mesh, &checked, "ftetwild".into(), None, path, true)?;
    made.warnings.extend(notes.into_inner().warnings);
    let message = format!("no region, so the boundary of the tetrahedra is taken for one: {}", why.message);
    let path = "region.mesh".into();
    made.warnings.push(Warning { path, message });
    Ok(made)
}

/// Warnings of likely mistakes.
fn warnings(report: &TetMeshReport, checked: &Checked, path: &str, is_made: bool) -> Vec<Warning> {
    let mut out = Vec::new();
    let mut say = |message: String| {
        out.push(Warning { path: path.to_string(), message });
    };
    let q = &report.quality;
    if checked.turned {
        say("every tetrahedron was numbered the other way round (negative volume), and was turned".into());
    }
    if q.pieces > 1 {
        say(format!("the tetrahedra are {} pieces that share no faces: the lattice will fall apart there", q.pieces));
    }
    if checked.pinched > 0 {
        say(format!("the boundary meets itself in {}", counted(checked.pinched, "edge")));
    }
    if q.slivers > 0 {
        say(format!(
            "{} of {} tetrahedra have a dihedral angle below {SLIVER}° or above {}° (slivers): cells are squashed there",
            q.slivers,
            q.tets,
            180.0 - SLIVER
        ));
    }
    let Some(fit) = &report.fit else { return out };
    if fit.mended > 1e-6 * q.volume {
        say(format!(
            "{} mm³ were left out where the region is too thin for tetrahedra of this size: the boundary would meet itself, or \
             crumbs come loose; use a smaller one",
            number(fit.mended)
        ));
    }
    let todo =
        if is_made { "take a smaller size" } else { "is it a mesh of this region, in the right place and unit?" };
    // A mesh of something else has no features of the region to keep.
    let strange = !is_made && fit.to_part.max > FAR * q.size.mean;
    let lost = lost_features(report);
    if !lost.is_empty() && !strange {
        let name = |f: &&LostFeature| format!("a {} of {} mm at {}", f.kind.word(), rounded(f.size, 3), position(f.at));
        let mut named: Vec<String> = lost.iter().take(NAMED).map(name).collect();
        if lost.len() > NAMED {
            named.push(format!("{} more", lost.len() - NAMED));
        }
        say(format!(
            "the tetrahedra do not follow {} of the region: {}; cells are cut or stretched there; {todo}",
            counted(lost.len(), "feature"),
            named.join(", ")
        ));
    }
    if fit.uncovered > MUCH && fit.uncovered_depth > DEEP * q.size.mean {
        say(format!(
            "{:.1} % of the region is in no tetrahedron, up to {:.3} mm below the surface, at {}; {todo}",
            100.0 * fit.uncovered,
            fit.uncovered_depth,
            position(fit.uncovered_at)
        ));
    }
    if fit.to_part.max > FAR * q.size.mean {
        say(format!(
            "the mesh's boundary is {:.3} mm off the region's surface at {}, more than half a tetrahedron",
            fit.to_part.max,
            position(fit.to_part.at)
        ));
    }
    out
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A unit cube of one hexahedron, or of six tetrahedra, the first as given.
    struct Files;

    const HEAD: &str = "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n\
                        0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n";

    impl Loader for Files {
        fn load(&self, path: &str) -> Result<Vec<u8>, String> {
            let tets = |first: &str| {
                format!(
                    "{HEAD}CELLS 6 30\n4 {first}\n4 0 3 2 7\n4 0 2 6 7\n4 0 6 4 7\n4 0 4 5 7\n4 0 5 1 7\n\
                     CELL_TYPES 6\n10 10 10 10 10 10\nCELL_DATA 6\nSCALARS zone int 1\nLOOKUP_TABLE default\n1 1 1 2 2 2\n"
                )
            };
            match path {
                "hex.vtk" => Ok(format!("{HEAD}CELLS 1 9\n8 0 1 3 2 4 5 7 6\nCELL_TYPES 1\n12\n").into()),
                "tets.vtk" => Ok(tets("0 1 3 7").into()),
                "turned.vtk" => Ok(tets("1 0 3 7").into()),
                _ => Err(format!("{path} does not exist")),
            }
        }
    }

    fn made(table: &str) -> Result<BuiltTets, DesignError> {
        let text = format!(
            "[region.box]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n[lattice.core]\ncell.tet.name = \"any\"\n\
             [lattice.core.map.tets]\n{table}\n"
        );
        BuiltTets::in_design(&Node::from_toml(&text).unwrap(), None, &Files)
    }

    #[test]
    fn meshes_are_made_and_read() {
        let it = made("size = 0.3").unwrap();
        assert!((it.report.quality.volume - 1.0).abs() < 1e-12 && it.warnings.is_empty());
        assert!(it.report.fit.unwrap().uncovered == 0.0);
        let it = made("path = \"tets.vtk\"").unwrap();
        assert_eq!((it.mesh.tets.len(), it.mesh.zones.as_slice()), (6, &[1, 1, 1, 2, 2, 2][..]));
        let it = made("path = \"hex.vtk\"\nsplit = true").unwrap();
        assert!((it.mesh.volume() - 1.0).abs() < 1e-12 && it.mesh.tets.len() == 12);
        let it = made("path = \"tets.vtk\"\nunit = \"cm\"").unwrap();
        assert!(it.warnings.iter().any(|w| w.message.contains("off the region")), "{:?}", it.warnings);
        // The cube has none of that size.
        let it = made("size = 1e9").unwrap();
        let said = it.warnings.iter().find(|w| w.path.ends_with("map.tets.size")).unwrap();
        assert!(said.message.contains("more than the region, 1 × 1 × 1 mm"), "{said:?}");
        assert!(said.message.ends_with("use a size of 0.25 mm or less"), "{said:?}");
        let graded = "size = { linear = { along = [1, 0, 0], stops = [[0, 0.1], [1, 0.3]] } }";
        assert!(made(graded).unwrap().report.quality.tets > 500);
    }

    /// A ball of radius 1 has 4π/3 mm³. Flat tetrahedra leave out some per cent; bent onto it they fill it. A mesh of something else is cut.
    #[test]
    fn lattices_fill_the_region_whatever_its_tetrahedra_have() {
        let ball = |map: &str| {
            let text = format!(
                "schema = 1\n[region.sphere]\nradius = 1\n[lattice.core]\ncell.tet.name = \"primitive\"\npart = \"lower\"\n\
                 level.fraction = 0.5\n[lattice.core.map.tets]\n{map}\n"
            );
            Design::from_toml(&text).unwrap().build(&Files).unwrap()
        };
        let own = 4.0 / 3.0 * core::f64::consts::PI;
        let built = ball("size = 0.5");
        let report = built.report();
        let (region, tets) = (&report.region, report.lattices["core"].tets.as_ref().unwrap());
        assert!(region.volume_exact && (region.volume / own - 1.0).abs() < 1e-12, "{region:?}");
        assert!(tets.volume < 0.99 * own && built.tilings[0].explicit, "{}", tets.volume);
        let cube = ball("path = \"tets.vtk\"");
        let report = cube.report();
        let warned = report.warnings.iter().any(|w| w.message.contains("tets.vtk is not a mesh of this region"));
        assert!(warned && !cube.tilings[0].explicit, "{:?}", report.warnings);
        // An eighth of the ball, by sampling.
        assert!((report.region.volume / (own / 8.0) - 1.0).abs() < 0.01, "{:?}", report.region);
        assert!(!report.region.volume_exact && (report.region.described_volume.unwrap() / own - 1.0).abs() < 1e-12);
        let of_box = made("size = 0.3").unwrap();
        assert!((of_box.report.region_volume.unwrap() - of_box.mesh.volume()).abs() < 1e-9);
        let file = TetFileKind { path: "hex.vtk".into(), unit: None, split: false, joined: CellJoin::default() };
        let wrong = BuiltTets::in_file(&file, &Files).unwrap_err();
        assert!(wrong.to_string().starts_with("hex.vtk: the mesh has 1 hexahedron"), "{wrong}");
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let wrong = |table: &str, path: &str, line: Option<usize>, words: &str| {
            let e = made(table).unwrap_err();
            let below = format!("lattice.core.map.tets{path}");
            assert_eq!((e.path.as_str(), e.line), (below.as_str(), line), "{e}");
            assert!(e.message.contains(words), "{e}");
        };
        wrong("", "", Some(6), "give exactly one of size, path");
        wrong("size = -1", ".size", Some(7), "size is -1 mm");
        wrong("size = 1\npath = \"tets.vtk\"", ".path", Some(8), "found size and path");
        wrong("size = 1\nsplit = true", ".split", Some(8), "found size and split");
        wrong("size = 1\nmesher = \"ftetwlid\"", ".mesher", Some(8), "did you mean \"ftetwild\"?");
        wrong("size = 1\nmesher = \"ftetwild\"", ".mesher", Some(8), "not available here");
        wrong("size = 1\nmesh = 3", ".mesh", Some(8), "did you mean");
        wrong("size = 1e-4", ".size", Some(7), "use a greater one");
        wrong("path = \"none.vtk\"", ".path", Some(7), "none.vtk does not exist");
        wrong("path = \"cube.inp\"", ".path", Some(7), "only vtu and vtk");
        wrong("path = \"hex.vtk\"", ".split", Some(6), "1 hexahedron and 0 tetrahedra; give split = true");
        wrong("path = \"turned.vtk\"", ".path", Some(7), "1 of 6 tetrahedra are inverted");
        let none = "[region.sphere]\nradius = 1\n[lattice.core.map.affine]\nwavelength = 1";
        let e = BuiltTets::in_design(&Node::from_toml(none).unwrap(), None, &Files).unwrap_err();
        assert!(e.message.contains("no lattice of the design has a tetrahedral mesh"), "{e}");
    }
}
