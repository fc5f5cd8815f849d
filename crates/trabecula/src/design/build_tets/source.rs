//! External sources of tetrahedral meshes: files, and the mesher fTetWild.

use crate::design::data::*;
use crate::design::{Loader, ZoneNames, ZonedElements};
use crate::environment::Environment;
use crate::extract;
use crate::kind::DesignError;
use crate::solid::Solid;
use geometry::fault::Fault;
use geometry::formats::{self, DataSet};
use geometry::math::scale;
use geometry::mesh::Mesh;
use geometry::progress::{Silent, Stopped};
use geometry::tetmesh::{Checked, TetMesh};

/// Names under which programs write the zones of cells.
const ZONES: [&str; 7] = ["zone", "gmsh:physical", "medit:ref", "cell_tags", "MaterialIds", "material", "zones"];

/// The surface for a mesher that works from triangles: the file's own where the region is one, which may be a soup; that of a region
/// that is a mesh otherwise, such as a moved one; else one that is made of the region.
pub(super) fn surface(region: &RegionKind, environment: &Environment, size: f64) -> Result<Mesh, DesignError> {
    let own = environment.region.as_mesh().map(|m| m.mesh());
    if let RegionKind::Mesh(file) = region {
        // A part from a CAD system has no triangles of its own.
        return triangles(file, environment.loader).or_else(|why| own.cloned().ok_or(why));
    }
    if let Some(own) = own {
        return Ok(own.clone());
    }
    let solid = Solid::new(environment.region.clone(), None, size);
    match extract::surface(&solid, size / 4.0, &Silent) {
        Ok(made) => Ok(made.mesh),
        Err(Stopped::Refused(f)) => Err(DesignError::fault(&environment.path, f)),
        Err(_) => Err(DesignError::new(&environment.path, "the region's surface could not be made")),
    }
}

/// The triangles of a file as they are, mm.
pub(super) fn triangles(file: &MeshFile, loader: &dyn Loader) -> Result<Mesh, DesignError> {
    let path = "region.mesh.path";
    let bytes = loader.load(&file.path).map_err(|e| DesignError::new(path, e).found(&file.path))?;
    let kind = file.path.rsplit_once('.').map_or("", |(_, e)| e);
    let loaded = formats::read_mesh(&bytes, kind).map_err(|f| DesignError::fault(path, f))?;
    let unit = file.unit.map_or(1.0, Unit::in_mm) * file.scale;
    let mut mesh = loaded.mesh;
    mesh.vertices.iter_mut().for_each(|p| *p = scale(*p, unit));
    Ok(mesh)
}

/// The tetrahedral mesh that fTetWild makes of a surface.
pub(super) fn ftetwild(
    made: &MadeTetsKind,
    surface: &Mesh,
    size: f64,
    path: &str,
    loader: &dyn Loader,
) -> Result<(TetMesh, Checked), DesignError> {
    loader
        .tetrahedra("ftetwild", surface, size, made.limit)
        .map_err(|m| DesignError::new(format!("{path}.mesher"), m).found("ftetwild"))?
        .checked()
        .map_err(|f| DesignError::fault(path, f))
}

/// The tetrahedra of a file, and numbers of zones with their names.
pub(super) fn from_file(
    file: &TetFileKind,
    path: &str,
    loader: &dyn Loader,
) -> Result<(TetMesh, Checked, ZoneNames), DesignError> {
    let at = if path.is_empty() { String::new() } else { format!("{path}.path") };
    let wrong = |f: Fault| {
        let message = format!("{}: {}", file.path, f.message);
        // A file alone has no key to point at.
        if f.at == "split" && !path.is_empty() {
            return DesignError::new(format!("{path}.split"), message);
        }
        DesignError::new(&at, message).found(&file.path)
    };
    let kind = file.path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase();
    let ZonedElements { elements, zones, names } = if formats::RESULTS.contains(&kind.as_str()) {
        let bytes = loader.load(&file.path).map_err(|m| DesignError::new(&at, m).found(&file.path))?;
        let data = formats::read_result(&bytes, &kind, "").map_err(wrong)?;
        let DataSet::Mesh(elements) = data.shape else {
            let message = format!("{}: an image; a mesh of tetrahedra is needed", file.path);
            return Err(DesignError::new(at, message).found(&file.path));
        };
        let named = |name: &&str| data.arrays.iter().find(|a| a.of_cells && a.components == 1 && a.name == **name);
        let zones = ZONES.iter().find_map(named).map(|a| a.values.iter().map(|v| *v as i64).collect());
        ZonedElements { elements, zones: zones.unwrap_or_default(), names: Vec::new() }
    } else {
        loader.elements(&file.path).map_err(|m| DesignError::new(&at, m).found(&file.path))?
    };
    elements.check().map_err(wrong)?;
    let (mut mesh, of) = elements.tet_mesh(file.split).map_err(wrong)?;
    if zones.len() == elements.kinds.len() {
        mesh.zones = of.iter().map(|c| zones[*c as usize]).collect();
    }
    let unit = file.unit.map_or(1.0, Unit::in_mm);
    if unit != 1.0 {
        mesh.nodes.iter_mut().for_each(|p| *p = scale(*p, unit));
    }
    let (mesh, checked) = mesh.checked().map_err(wrong)?;
    Ok((mesh, checked, names))
}
