//! The region inside a mesh from a file.

use std::sync::Arc;

use super::{BuildRegion, CAD, CadMesh, Context, MeshRegion, Region, SignedDistance, Tessellation};
use crate::kind::{Kind, Unit};
use geometry::fault::Fault;
use geometry::formats;
use geometry::math::scale;
use geometry::mesh::Mesh;
use geometry::repair::{CAPPED, Repair};

/// A mesh without a unit that is smaller than this (mm) is warned of: no part with a lattice in it is.
const SMALL: f64 = 1.0;

/// A triangle mesh from a file (stl, 3mf, ply, obj, off), or the solids of a part from a CAD system (step, iges).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Mesh", noun = "a mesh")]
pub struct MeshFile {
    /// Path of the file, relative to the design file.
    pub path: String,
    /// Unit of the file's coordinates (mm unless given); 3MF, STEP and IGES files name their own.
    pub unit: Option<Unit>,
    /// Factor on all coordinates, after the unit.
    #[kind(above = 0.0, default = 1.0)]
    pub scale: f64,
    /// Whether a mesh with holes, flipped faces or crossings is repaired (auto) or refused with counts (refuse).
    #[kind(default = RepairKind::Auto)]
    pub repair: RepairKind,
    /// Greatest share of the surface that caps of holes may make up, 0 to 1: a cap is a guess, flat over a flat hole.
    #[kind(min = 0.0, max = 1.0, default = CAPPED)]
    pub caps: f64,
    /// Of a STEP or IGES file: greatest distance of its faces from their triangles (a five-thousandth of the diagonal of its bounds
    /// unless given).
    #[kind(unit = "mm", above = 0.0)]
    pub chord: Option<f64>,
    /// Of a STEP or IGES file: greatest angle, degrees, between the normals of a face within a triangle (15 unless given).
    #[kind(above = 0.0, max = 90.0)]
    pub angle: Option<f64>,
    /// Of a STEP or IGES file: name of the solid that is read (all of them unless given).
    pub solid: Option<String>,
}

/// What to do with a mesh that does not bound a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(name = "Repair", noun = "repair")]
pub enum RepairKind {
    /// Repair it, and warn of what was done.
    Auto,
    /// Refuse it, with what is wrong in numbers.
    Refuse,
}

/// What a file held, mm.
struct Read {
    mesh: Mesh,
    /// Whether the file names its unit.
    in_mm: bool,
    cad: Option<CadMesh>,
}

impl MeshFile {
    /// The mesh of the file, in mm but for the key `scale`.
    fn read(&self, context: &Context) -> Result<Read, Fault> {
        let extension = self.path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase();
        let of_path = |m: String| Fault::new("path", m).found(&self.path);
        if CAD.contains(&extension.as_str()) {
            let Tessellation { chord, angle, solid } = self.tessellation();
            let cad =
                context.files.cad(&self.path, &Tessellation { chord: chord.map(|c| c / self.scale), angle, solid });
            let cad = cad.map_err(of_path)?;
            return Ok(Read { mesh: cad.mesh.clone(), in_mm: true, cad: Some(cad) });
        }
        if formats::Format::of(&extension).is_none() {
            let known = format!("{}, {}", formats::Format::listed(), CAD.join(", "));
            return Err(of_path(format!("the name must end in one of {known}; found \"{}\"", self.path)));
        }
        let given = [("chord", self.chord.is_some()), ("angle", self.angle.is_some()), ("solid", self.solid.is_some())];
        if let Some((key, _)) = given.iter().find(|g| g.1) {
            let message = format!("{key} is for STEP and IGES files; a .{extension} holds triangles: leave {key} out");
            return Err(Fault::new(*key, message));
        }
        let bytes = context.load(&self.path).map_err(of_path)?;
        let loaded = formats::read_mesh(&bytes, &extension).map_err(|f| of_path(format!("{}: {f}", self.path)))?;
        Ok(Read { mesh: loaded.mesh, in_mm: loaded.in_mm, cad: None })
    }

    fn tessellation(&self) -> Tessellation {
        Tessellation { chord: self.chord, angle: self.angle, solid: self.solid.clone() }
    }
}

/// A part from a CAD system grown by a factor.
fn scaled(cad: CadMesh, mesh: &Mesh, factor: f64) -> CadMesh {
    CadMesh { mesh: mesh.clone(), chord: cad.chord * factor, volume: cad.volume.map(|v| v * factor.powi(3)), ..cad }
}

impl BuildRegion for MeshFile {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        self.valid()?;
        let mut loaded = self.read(context)?;
        if let (true, Some(unit)) = (loaded.in_mm, self.unit)
            && unit != Unit::Mm
        {
            return Err(Fault::new("unit", "this file names its own unit and was read in mm; leave unit out"));
        }
        let factor = self.scale * if loaded.in_mm { 1.0 } else { self.unit.unwrap_or(Unit::Mm).in_mm() };
        if factor != 1.0 {
            for v in &mut loaded.mesh.vertices {
                *v = scale(*v, factor);
            }
        }
        let repair = match self.repair {
            RepairKind::Auto => Repair::Caps(self.caps),
            RepairKind::Refuse => Repair::Refuse,
        };
        let cad = loaded.cad.map(|cad| scaled(cad, &loaded.mesh, self.scale));
        let of_file = |f: Fault| Fault::new("path", format!("{}: {f}", self.path)).found(&self.path);
        let mut made = MeshRegion::new(loaded.mesh, repair).map_err(of_file)?;
        if let Some(cad) = cad {
            made = made.of_cad(cad);
        }
        let largest = made.bounds().size().into_iter().fold(0.0, f64::max);
        if self.unit.is_none() && !loaded.in_mm && self.scale == 1.0 && largest < SMALL {
            context.warn(format!(
                "the mesh is {largest:.4} mm across: probably its unit is the metre or the inch; say unit = \"m\" or unit = \
                 \"inch\", or unit = \"mm\" if it is that small"
            ));
        }
        if let Some(done) = made.repaired().sentence() {
            context.warn(done);
        }
        context.repaired(made.repaired().clone());
        Ok(Arc::new(made))
    }
}
