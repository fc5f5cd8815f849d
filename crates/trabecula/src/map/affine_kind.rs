//! Affine maps, as they are declared.

use super::{Affine, BuildMap, Map, NO_WAVELENGTH, given_twice, shared};
use crate::environment::Environment;
use crate::grade::Grade;
use crate::kind::{DesignError, Kind, NodeCursor, OneOrThree, Value};
use geometry::math::Mat3;

/// A rigid rotation of the scaled lattice: u = D Rᵀ (x − offset), D = diag(1/wavelength).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Affine", noun = "an affine map", before = uniform)]
pub struct AffineKind {
    /// Edges, angles and offset.
    #[kind(flatten)]
    cells: Cells,
    /// Shears by name, in degrees: xz = 20 moves x by tan(20°) · z.
    #[kind(default)]
    skew: SkewKind,
}

/// Edges, angles and offset of the cells.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
pub struct Cells {
    /// Cell edge, one number or three. Left out where the level has a fraction and a thickness or a pore, from which it follows; three
    /// numbers are ratios then.
    #[kind(unit = "mm", above = 0.0, hints("cell_size", "unit_cell", "unit_cell_size", "cell_edge", "period", "size"))]
    wavelength: Option<OneOrThree>,
    /// Angles about x, y, z: z is turned first, then y, then x.
    #[kind(unit = "degrees", default = [0.0; 3])]
    rotate: [f64; 3],
    /// Moves the lattice.
    #[kind(unit = "mm", default = [0.0; 3])]
    offset: [f64; 3],
}

impl Cells {
    fn wavelengths(&self, path: &str) -> Result<[f64; 3], DesignError> {
        self.wavelength.map(OneOrThree::three).ok_or_else(|| DesignError::new(path, NO_WAVELENGTH))
    }

    /// Cells of `scale` mm, or of `scale` times the ratios.
    fn scaled(&self, scale: f64, length: &str, path: &str) -> Result<Cells, DesignError> {
        let wavelength = match self.wavelength {
            None => OneOrThree::One(scale),
            Some(OneOrThree::Three(ratios)) => OneOrThree::Three(ratios.map(|r| r * scale)),
            Some(OneOrThree::One(found)) => return Err(given_twice(length, path).found(found.to_string())),
        };
        Ok(Cells { wavelength: Some(wavelength), ..*self })
    }

    /// As `scaled`, by a scale that has to be the same everywhere.
    fn sized(&self, edge: &Grade, length: &str, path: &str) -> Result<Cells, DesignError> {
        let message = format!("fraction and {length} vary, and the cells of this map have one size; use map.phase");
        let edge = edge.constant().ok_or_else(|| DesignError::new(path, message))?;
        self.scaled(edge, length, path)
    }
}

/// Explains that numbers of this map are constant.
fn uniform(at: &NodeCursor) -> Result<(), DesignError> {
    let message = "this map takes constants; use map.phase for a wavelength or an orientation that varies";
    for (key, at) in at.entries("a map").unwrap_or_default() {
        match key {
            "wavelength" | "rotate" | "offset" => constant(&at, message)?,
            "skew" => at.entries("shears").iter().flatten().try_for_each(|(_, at)| constant(at, message))?,
            _ => {}
        }
    }
    Ok(())
}

/// Shears: `xz = 20` moves x by tan(20°) · z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Kind)]
#[kind(name = "Skew", noun = "shears in degrees")]
pub struct SkewKind {
    /// x by tan · y.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    xy: f64,
    /// x by tan · z.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    xz: f64,
    /// y by tan · x.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    yx: f64,
    /// y by tan · z.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    yz: f64,
    /// z by tan · x.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    zx: f64,
    /// z by tan · y.
    #[kind(unit = "degrees", above = -89.0, below = 89.0, default)]
    zy: f64,
}

impl SkewKind {
    /// The shears that are not zero: (of, by, degrees).
    pub fn shears(&self) -> Vec<(usize, usize, f64)> {
        let s = self;
        let all = [(0, 1, s.xy), (0, 2, s.xz), (1, 0, s.yx), (1, 2, s.yz), (2, 0, s.zx), (2, 1, s.zy)];
        all.into_iter().filter(|s| s.2 != 0.0).collect()
    }
}

/// The SPARTAN reading, scaled first and rotated in phase: u = Rᵀ D (x − offset).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Spartan", noun = "a spartan map", before = uniform)]
pub struct SpartanKind {
    /// Edges, angles and offset.
    #[kind(flatten)]
    cells: Cells,
}

impl BuildMap for AffineKind {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        let wavelength = self.cells.wavelengths(path)?;
        shared(Affine::rigid(wavelength, self.cells.rotate, self.cells.offset, &self.skew.shears()), path)
    }

    fn unit(&self, length: &str, path: &str, environment: &Environment) -> Result<Mat3, DesignError> {
        let unit = AffineKind { cells: self.cells.scaled(1.0, length, path)?, ..*self };
        Ok(unit.build(path, environment)?.typical())
    }

    fn sized(&self, edge: &Grade, length: &str, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        AffineKind { cells: self.cells.sized(edge, length, path)?, ..*self }.build(path, environment)
    }
}

impl BuildMap for SpartanKind {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        shared(Affine::spartan(self.cells.wavelengths(path)?, self.cells.rotate, self.cells.offset), path)
    }

    fn unit(&self, length: &str, path: &str, environment: &Environment) -> Result<Mat3, DesignError> {
        let unit = SpartanKind { cells: self.cells.scaled(1.0, length, path)? };
        Ok(unit.build(path, environment)?.typical())
    }

    fn sized(&self, edge: &Grade, length: &str, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        SpartanKind { cells: self.cells.sized(edge, length, path)? }.build(path, environment)
    }
}

/// A value that is one number: what may not vary says so.
fn constant(at: &NodeCursor, message: &str) -> Result<(), DesignError> {
    let varies = |at: &NodeCursor| matches!(at.node.value, Value::Table(_));
    match at.is_list() {
        true => at.list("")?.iter().find(|i| varies(i)).map_or(Ok(()), |i| Err(i.error(message))),
        false if varies(at) => Err(at.error(message)),
        false => Ok(()),
    }
}
