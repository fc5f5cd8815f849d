//! Figures of a surface: of one that is held, or taken while it is made.

use geometry::math::{cross, norm, sub};
use geometry::measure::{self, Cavity, Size, TriangleQuality};
use geometry::surface_mesh::SurfaceMesh;

use super::{Components, MeshedSurface};

/// Size and topology of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// Volume, area, Euler number, pieces, closedness, bounds.
    pub size: Size,
    /// Area on the region's boundary, mm².
    pub area_cut: f64,
    /// The closed voids, the largest first.
    pub voids: Vec<Cavity>,
}

/// What is measured of a surface that a solid has.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Size and topology.
    pub figures: Figures,
    /// The shapes of its triangles.
    pub quality: Option<TriangleQuality>,
    /// Connected components of the solid.
    pub components: Components,
}

impl Figures {
    /// The figures of a surface that is held.
    pub fn of(surface: &SurfaceMesh) -> Figures {
        let size = measure::size(&surface.mesh);
        let area = |i: usize| {
            let [a, b, c] = surface.mesh.corners(i);
            norm(cross(sub(b, a), sub(c, a))) / 2.0
        };
        let cut: f64 = (0..surface.cut.len()).filter(|i| surface.cut[*i]).map(area).sum();
        let voids = if size.cavities > 0 { measure::cavities(&surface.mesh) } else { Vec::new() };
        // Of nothing the sum is −0.
        Figures { size, area_cut: cut + 0.0, voids }
    }
}

impl Measured {
    /// What is measured of a surface that is held.
    pub fn of(made: &MeshedSurface) -> Measured {
        let quality = measure::quality(&made.surface.mesh);
        Measured { figures: Figures::of(&made.surface), quality, components: made.components }
    }
}
