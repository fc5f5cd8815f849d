//! The region inside a mesh from a file.

use std::sync::Arc;

use super::{BuildRegion, Context, MeshRegion, Region, Shape};
use crate::kind::{Kind, Unit};
use geometry::fault::Fault;
use geometry::formats;
use geometry::math::scale;
use geometry::repair::{CAPPED, Repair};

/// A mesh without a unit that is smaller than this (mm) is warned of: no part with a lattice in it is.
const SMALL: f64 = 1.0;

/// A triangle mesh from a file (stl, 3mf, ply, obj, off).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Mesh", noun = "a mesh")]
pub struct MeshFile {
    /// Path of the file, relative to the design file.
    pub path: String,
    /// Unit of the file's coordinates (mm unless given); a 3MF file names its own.
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

impl BuildRegion for MeshFile {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        let extension = self.path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase();
        if formats::Format::of(&extension).is_none() {
            let known = formats::Format::listed();
            let message = format!("the name must end in one of {known}; found \"{}\"", self.path);
            return Err(Fault::new("path", message).found(&self.path));
        }
        self.valid()?;
        let bytes = context.load(&self.path).map_err(|m| Fault::new("path", m).found(&self.path))?;
        let of_file = |f: Fault| Fault::new("path", format!("{}: {f}", self.path)).found(&self.path);
        let mut loaded = formats::read_mesh(&bytes, &extension).map_err(of_file)?;
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
        let made = MeshRegion::new(loaded.mesh, repair).map_err(of_file)?;
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
