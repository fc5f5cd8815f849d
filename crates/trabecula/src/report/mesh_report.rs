//! Figures of a mesh, and of what was done to it.

use geometry::measure::Cavity;
use schemars::JsonSchema;
use serde::Serialize;

use crate::surface_maker::{Component, Components, Figures, Summary};

/// The figures of a triangle mesh. Those that need a region are None for a mesh without one.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MeshReport {
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Surface area, mm².
    pub area: f64,
    /// Area on the lattice, mm².
    pub area_lattice: Option<f64>,
    /// Area of cut faces, on the region's boundary, mm².
    pub area_cut: Option<f64>,
    /// Volume of the solid over volume of the region.
    pub solid_fraction: Option<f64>,
    /// 1 − solid_fraction.
    pub porosity: Option<f64>,
    /// Euler number V − E + F of the surface mesh, twice that of the solid.
    pub euler: i64,
    /// Number of solids; a cavity is not a piece.
    pub pieces: usize,
    /// Number of closed voids.
    pub cavities: usize,
    /// The closed voids, the largest first.
    pub voids: Vec<Cavity>,
    /// Whether every edge has exactly two triangles, of opposite direction.
    pub closed: bool,
    /// Lower and upper corner of the bounds, mm.
    pub bounds: [[f64; 3]; 2],
    /// Area over volume, 1/mm.
    pub specific_surface: SpecificSurface,
    /// 4 · pore volume / area_lattice, mm. Cut faces are not counted as wetted area.
    pub hydraulic_diameter: Option<f64>,
}

/// Area over volume, 1/mm; None where there is no such volume.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct SpecificSurface {
    /// All area over the solid's volume.
    pub area_of_solid: Option<f64>,
    /// All area over the region's volume.
    pub area_of_region: Option<f64>,
    /// The lattice's area, without cut faces, over the region's volume.
    pub lattice_of_region: Option<f64>,
}

impl MeshReport {
    /// The figures of a surface; `split` says whether it is known which triangles are cut, `region` the region's volume (mm³).
    pub fn of(found: &Figures, split: bool, region: Option<f64>) -> MeshReport {
        let size = &found.size;
        let lattice = split.then_some(size.area - found.area_cut);
        let share = region.map(|v| size.volume / v);
        let over = |area: f64, volume: f64| (volume != 0.0).then(|| area / volume);
        MeshReport {
            volume: size.volume,
            area: size.area,
            area_lattice: lattice,
            area_cut: split.then_some(found.area_cut),
            solid_fraction: share,
            porosity: share.map(|s| 1.0 - s),
            euler: size.euler,
            pieces: size.pieces,
            cavities: size.cavities,
            voids: found.voids.clone(),
            closed: size.closed,
            bounds: [size.bounds.min, size.bounds.max],
            specific_surface: SpecificSurface {
                area_of_solid: over(size.area, size.volume),
                area_of_region: region.and_then(|v| over(size.area, v)),
                lattice_of_region: region.zip(lattice).and_then(|(v, a)| over(a, v)),
            },
            hydraulic_diameter: match (region, lattice) {
                (Some(v), Some(a)) if a != 0.0 => Some(4.0 * (v - size.volume) / a),
                _ => None,
            },
        }
    }
}

/// The figures of a surface that was made, streamed or held in memory.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SurfaceReport {
    /// Number of triangles.
    pub triangles: u64,
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Surface area, mm².
    pub area: f64,
    /// Area on the lattice, mm².
    pub area_lattice: Option<f64>,
    /// Area of cut faces, on the region's boundary, mm².
    pub area_cut: Option<f64>,
    /// Euler number V − E + F.
    pub euler: i64,
    /// Number of solids.
    pub pieces: u64,
    /// Number of closed voids.
    pub cavities: u64,
    /// The connected components other than the largest; None where they are not looked for.
    pub islands: Option<IslandsReport>,
    /// Greatest distance between a mesh without a grid and the surface, to first order, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chord_error: Option<f64>,
}

/// The connected components of a solid other than the largest.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct IslandsReport {
    /// Their number.
    pub found: u64,
    /// Number of those that were left out.
    pub dropped: u64,
    /// The volume of these in all, mm³.
    pub dropped_volume: f64,
    /// Number of closed voids smaller than a grid cell that were filled.
    pub filled: u64,
    /// The volume of these in all, mm³.
    pub filled_volume: f64,
    /// Number of those with surface on the region's boundary: mostly fragments that it cuts off.
    pub border: u64,
    /// Their volume in all, mm³.
    pub volume: f64,
    /// The largest component's share of all volume, 0 to 1.
    pub share: f64,
    /// The largest of them.
    pub largest: Option<LargestIsland>,
}

/// The largest connected component but one.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct LargestIsland {
    /// Volume, mm³.
    pub volume: f64,
    /// Centre of its bounds, mm.
    pub place: [f64; 3],
    /// Lower and upper corner of its bounds, mm.
    pub bounds: [[f64; 3]; 2],
}

impl From<&Summary> for SurfaceReport {
    fn from(s: &Summary) -> Self {
        let found = &s.components;
        SurfaceReport {
            triangles: s.triangles,
            volume: s.volume,
            area: s.area_lattice + s.area_cut,
            area_lattice: Some(s.area_lattice),
            area_cut: Some(s.area_cut),
            euler: found.euler,
            pieces: found.count,
            cavities: found.cavities,
            // Beams without a grid are not looked through for components.
            islands: s.error.is_none().then(|| found.into()),
            chord_error: s.error,
        }
    }
}

impl From<&Components> for IslandsReport {
    fn from(p: &Components) -> Self {
        let largest = |c: Component| LargestIsland { volume: c.volume, place: c.center(), bounds: c.bounds };
        IslandsReport {
            found: p.others,
            dropped: p.dropped,
            dropped_volume: p.dropped_volume,
            filled: p.filled,
            filled_volume: p.filled_volume,
            border: p.border,
            volume: p.volume,
            share: p.share(),
            largest: p.second.map(largest),
        }
    }
}
