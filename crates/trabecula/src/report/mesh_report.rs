//! Figures of a mesh, and of what was done to it.

use geometry::measure;
use geometry::repair::Repaired;
use geometry::simplify;
use geometry::smooth;
use schemars::JsonSchema;
use serde::Serialize;

use crate::analysis::{Dangling, Spread};
use crate::surface_maker::{Component, Components, Estimate, Figures, Summary};

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
    pub voids: Vec<VoidReport>,
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

/// A closed void, from which powder and resin cannot drain.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct VoidReport {
    /// Volume, mm³.
    pub volume: f64,
    /// A point inside, mm.
    pub point: [f64; 3],
    /// Lower and upper corner of the bounds, mm.
    pub bounds: [[f64; 3]; 2],
}

impl MeshReport {
    /// The figures of a surface; `split` says whether it is known which triangles are cut, `region` the region's volume (mm³).
    pub fn of(found: &Figures, split: bool, region: Option<f64>) -> MeshReport {
        let size = &found.size;
        let lattice = split.then_some(size.area - found.area_cut);
        let share = region.map(|v| size.volume / v);
        let over = |area: f64, volume: f64| (volume != 0.0).then(|| area / volume);
        let void =
            |c: &measure::Cavity| VoidReport { volume: c.volume, point: c.point, bounds: [c.bounds.min, c.bounds.max] };
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
            voids: found.voids.iter().map(void).collect(),
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

/// How well shaped the triangles of a mesh are.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct QualityReport {
    /// Smallest angle, degrees; 60 at best.
    pub smallest_angle: f64,
    /// Its 5th percentile, degrees.
    pub smallest_angle_p05: f64,
    /// Longest edge over 2√3 times the inscribed circle's radius, 1 at best; None for a triangle without area.
    pub largest_aspect: Option<f64>,
}

impl From<measure::Quality> for QualityReport {
    fn from(q: measure::Quality) -> Self {
        QualityReport {
            smallest_angle: q.smallest_angle,
            smallest_angle_p05: q.smallest_angle_p05,
            largest_aspect: q.largest_aspect.is_finite().then_some(q.largest_aspect),
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

/// What simplification did.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct SimplifyReport {
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles: usize,
    /// Proven bound of the distance between the two surfaces, in both directions, mm.
    pub deviation: f64,
    /// Volume before, mm³.
    pub volume_before: f64,
    /// Volume after, mm³.
    pub volume: f64,
    /// Area before, mm².
    pub area_before: f64,
    /// Area after, mm².
    pub area: f64,
}

impl From<simplify::Report> for SimplifyReport {
    fn from(r: simplify::Report) -> Self {
        SimplifyReport {
            triangles_before: r.triangles[0],
            triangles: r.triangles[1],
            deviation: r.deviation,
            volume_before: r.volume[0],
            volume: r.volume[1],
            area_before: r.area[0],
            area: r.area[1],
        }
    }
}

/// What smoothing did to the triangles of a mesh. Angles are the smallest of each triangle.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct SmoothReport {
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles: usize,
    /// Smallest angle before, degrees.
    pub smallest_angle_before: f64,
    /// Smallest angle after, degrees.
    pub smallest_angle: f64,
    /// 5th percentile of the smallest angles before, degrees.
    pub smallest_angle_p05_before: f64,
    /// 5th percentile of the smallest angles after, degrees.
    pub smallest_angle_p05: f64,
    /// Volume before, mm³.
    pub volume_before: f64,
    /// Volume after, mm³.
    pub volume: f64,
    /// Number of edges flipped.
    pub flipped: usize,
    /// Number of edges whose ends were merged.
    pub merged: usize,
    /// Number of moves of vertices.
    pub moved: usize,
}

impl From<smooth::Report> for SmoothReport {
    fn from(r: smooth::Report) -> Self {
        let [before, after] = r.quality;
        let [flipped, merged, moved] = r.changes;
        SmoothReport {
            triangles_before: r.triangles[0],
            triangles: r.triangles[1],
            smallest_angle_before: before.smallest_angle,
            smallest_angle: after.smallest_angle,
            smallest_angle_p05_before: before.smallest_angle_p05,
            smallest_angle_p05: after.smallest_angle_p05,
            volume_before: r.volume[0],
            volume: r.volume[1],
            flipped,
            merged,
            moved,
        }
    }
}

/// Local thickness: at each point the diameter of the largest ball that fits in and covers the point.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ThicknessReport {
    /// Of the solid, mm.
    pub wall_thickness: ThicknessSpread,
    /// Of the pores, mm; None without a region.
    pub pore_size: Option<ThicknessSpread>,
}

/// The distribution of local thickness over a volume.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ThicknessSpread {
    /// Minimum between opposite sides, mm; sharp edges, where local thickness ends at 0, are left out.
    pub min: f64,
    /// 5th percentile, mm.
    pub p05: f64,
    /// Mean, mm.
    pub mean: f64,
    /// Standard deviation, mm.
    pub sd: f64,
    /// Maximum, mm.
    pub max: f64,
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Accuracy of these figures, mm.
    pub accuracy: f64,
    /// Shares of the volume by thickness.
    pub histogram: Histogram,
}

impl ThicknessSpread {
    /// The distribution on voxels of edge `step`, to within `accuracy` (mm).
    pub fn of(s: &Spread, step: f64, accuracy: f64) -> Self {
        let histogram = Histogram { edges: s.edges.clone(), share: s.share.clone() };
        ThicknessSpread { min: s.min, p05: s.p05, mean: s.mean, sd: s.sd, max: s.max, step, accuracy, histogram }
    }
}

/// A histogram.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Histogram {
    /// Ends of the bars, ascending from 0, mm.
    pub edges: Vec<f64>,
    /// Share of the volume in each bar.
    pub share: Vec<f64>,
}

/// Weakly attached fragments.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct DanglingReport {
    /// Their number.
    pub count: usize,
    /// Their volume in all, mm³.
    pub volume: f64,
    /// The largest of them.
    pub largest: Option<LargestBit>,
    /// The neck below which a fragment counts, mm.
    pub neck: f64,
    /// Distance between sample points, mm.
    pub step: f64,
}

/// The largest weakly attached fragment.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct LargestBit {
    /// Volume, mm³.
    pub volume: f64,
    /// A point in it, mm.
    pub place: [f64; 3],
}

impl From<Dangling> for DanglingReport {
    fn from(d: Dangling) -> Self {
        let largest = d.largest.map(|(volume, place)| LargestBit { volume, place });
        DanglingReport { count: d.count, volume: d.volume, largest, neck: d.neck, step: d.step }
    }
}

/// What was repaired in a mesh; all zero for a clean one.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct RepairReport {
    /// Corners of open edges joined with others.
    pub joined: usize,
    /// Open edges split at corners that lay on them.
    pub split: usize,
    /// Triangles without area left out.
    pub degenerate: usize,
    /// Triangles given more than once left out.
    pub duplicates: usize,
    /// Triangles turned to face as their neighbours do.
    pub turned: usize,
    /// Bodies that were inside out and were turned.
    pub bodies_turned: usize,
    /// Holes capped.
    pub holes: usize,
    /// Pairs of triangles that crossed or covered each other.
    pub crossings: usize,
    /// Triangles left out because solid, or none, is on both sides.
    pub inner: usize,
    /// Length of the boundary loops of the holes, mm.
    pub hole_length: f64,
    /// Area of the caps, mm².
    pub hole_area: f64,
    /// Area of the caps over that of the surface with them.
    pub hole_share: f64,
}

impl From<&Repaired> for RepairReport {
    fn from(r: &Repaired) -> Self {
        RepairReport {
            joined: r.joined,
            split: r.split,
            degenerate: r.degenerate,
            duplicates: r.duplicates,
            turned: r.turned,
            bodies_turned: r.bodies_turned,
            holes: r.holes,
            crossings: r.crossings,
            inner: r.inner,
            hole_length: r.hole_length,
            hole_area: r.hole_area,
            hole_share: r.hole_share,
        }
    }
}

/// What a surface will take, estimated on a coarse grid.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct EstimateReport {
    /// Grid cells along x, y, z.
    pub cells: [u64; 3],
    /// Number of triangles.
    pub triangles: f64,
    /// Bytes of memory of the mesh.
    pub memory: f64,
    /// Bytes of a binary STL.
    pub stl: f64,
}

impl From<Estimate> for EstimateReport {
    fn from(e: Estimate) -> Self {
        EstimateReport { cells: e.cells, triangles: e.triangles, memory: e.memory, stl: e.stl }
    }
}
