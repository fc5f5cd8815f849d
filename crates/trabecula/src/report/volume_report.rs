//! Figures of volume meshes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::beam_mesh;
use crate::shell_mesh;
use crate::volume_mesh::MeshedVolume;
use geometry::fe_mesh::{FeSet, HexMesh};
use geometry::measure::quality;
use geometry::mesh::Mesh;

/// The figures of a volume mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VolumeReport {
    /// Number of tetrahedra.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// 1 for linear tetrahedra, 2 for quadratic ones.
    pub order: usize,
    /// Edges of the background's cubes along x, y, z, mm: the longest edges of most tetrahedra.
    pub edge: [f64; 3],
    /// Volume, mm³.
    pub volume: f64,
    /// Smallest dihedral angle, degrees; of quadratic tetrahedra between the planes of their corners.
    pub min_angle: f64,
    /// Greatest dihedral angle, degrees.
    pub max_angle: f64,
    /// 1st percentile of each tetrahedron's smallest dihedral angle, degrees.
    pub min_angle_p01: f64,
    /// Median of each tetrahedron's smallest dihedral angle, degrees.
    pub min_angle_p50: f64,
    /// Median of each tetrahedron's greatest dihedral angle, degrees.
    pub max_angle_p50: f64,
    /// 99th percentile of each tetrahedron's greatest dihedral angle, degrees.
    pub max_angle_p99: f64,
    /// The middle of the tetrahedron with the angle nearest to 0 or 180, mm.
    pub worst_angle_at: [f64; 3],
    /// Number of components connected by faces.
    pub pieces: usize,
    /// Greatest distance of boundary faces from the surface, mm, at their corners, edges and centroids; faces on flat cuts have none.
    pub deviation: f64,
    /// Number of edges of quadratic tetrahedra that stayed straight, because a tetrahedron would be distorted.
    pub straight: usize,
    /// Volume left out, mm³: small loose components, flat tetrahedra, and those where the boundary would touch itself.
    pub dropped: f64,
    /// Volume of the components other than the largest that were left out on request, mm³.
    pub loose: f64,
    /// Number of nodes on upper bounding planes that are tied to their periodic images.
    pub pairs: usize,
    /// The domains by name.
    pub domains: BTreeMap<String, DomainReport>,
    /// The named sets.
    pub sets: BTreeMap<String, SetReport>,
}

/// A domain of a volume mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DomainReport {
    /// Number of tetrahedra.
    pub elements: usize,
    /// Volume, mm³; of quadratic tetrahedra that between their corners.
    pub volume: f64,
    /// A point inside: the centroid of its largest tetrahedron, mm.
    pub inside: [f64; 3],
}

/// A named set of a volume mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SetReport {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Number of faces.
    pub faces: usize,
}

/// The figures of voxels as finite elements.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VoxelElementsReport {
    /// Number of hexahedra.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Edges of a hexahedron along x, y, z, mm.
    pub step: [f64; 3],
    /// Solid volume, mm³: of each hexahedron its solid share.
    pub volume: f64,
    /// Smallest solid fraction of a hexahedron.
    pub least: f64,
    /// Solid volume left out, mm³: voxels of a smaller fraction, and pieces other than the largest.
    pub dropped: f64,
    /// The named sets.
    pub sets: BTreeMap<String, SetReport>,
}

/// The figures of a mesh of shells.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ShellReport {
    /// Number of triangles.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// 1 for linear triangles, 2 for quadratic ones.
    pub order: usize,
    /// Grid spacing, mm: edges are about as long.
    pub edge: f64,
    /// Area of the mid-surface, mm², between the corners of triangles.
    pub area: f64,
    /// Volume, mm³: the thickness integrated over the area.
    pub volume: f64,
    /// Smallest thickness at a node, mm.
    pub thinnest: f64,
    /// Greatest thickness at a node, mm.
    pub thickest: f64,
    /// Smallest angle of a triangle between its corners, degrees.
    pub min_angle: f64,
    /// Number of edges of quadratic triangles that stayed straight: on the border where it is no bounding plane.
    pub straight: usize,
    /// The named sets; faces are edges on the border.
    pub sets: BTreeMap<String, SetReport>,
}

/// The figures of beams as finite elements.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BeamMeshReport {
    /// Number of elements.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// 1 for linear elements, 2 for quadratic ones.
    pub order: usize,
    /// Number of beams of which some length is in the region.
    pub beams: usize,
    /// Number of those that the region cuts.
    pub cut: usize,
    /// Number of connected components.
    pub pieces: usize,
    /// Length of all axes, mm.
    pub length: f64,
    /// Length of components that were left out, mm.
    pub loose: f64,
    /// Area times length of all elements, mm³: more than the solid's volume, since beams overlap in hubs.
    pub volume: f64,
    /// Smallest radius of an element, mm.
    pub thinnest: f64,
    /// Greatest radius of an element, mm.
    pub thickest: f64,
    /// Number of sections: radii to five digits, each with one or two directions of its first axis.
    pub sections: usize,
    /// The named sets; faces are ends of elements.
    pub sets: BTreeMap<String, SetReport>,
}

impl From<&beam_mesh::MeshedBeams> for BeamMeshReport {
    fn from(made: &beam_mesh::MeshedBeams) -> BeamMeshReport {
        let mesh = &made.mesh;
        let (length, volume) = mesh.size();
        let range = |least: fn(f64, f64) -> f64| mesh.radii.iter().copied().reduce(least).unwrap_or(0.0);
        BeamMeshReport {
            elements: mesh.elements.len(),
            nodes: mesh.nodes.len(),
            order: if mesh.middles.is_empty() { 1 } else { 2 },
            beams: made.beams[0],
            cut: made.beams[1],
            pieces: made.pieces,
            length,
            loose: made.loose,
            volume,
            thinnest: range(f64::min),
            thickest: range(f64::max),
            sections: mesh.sections().len(),
            sets: mesh.sets.iter().map(|s| (s.name.clone(), SetReport::from(s))).collect(),
        }
    }
}

impl ShellReport {
    /// Of a mesh made at a grid spacing `edge` (mm).
    pub fn new(made: &shell_mesh::MeshedShell, edge: f64) -> ShellReport {
        let mesh = &made.mesh;
        let (area, volume) = mesh.size();
        let range = |least: fn(f64, f64) -> f64| mesh.thickness.iter().copied().reduce(least).unwrap_or(0.0);
        let corners = Mesh { vertices: mesh.nodes.clone(), triangles: mesh.triangles.clone() };
        ShellReport {
            elements: mesh.triangles.len(),
            nodes: mesh.nodes.len(),
            order: if mesh.middles.is_empty() { 1 } else { 2 },
            edge,
            area,
            volume,
            thinnest: range(f64::min),
            thickest: range(f64::max),
            min_angle: quality(&corners).map_or(0.0, |q| q.smallest_angle),
            straight: made.straight,
            sets: mesh.sets.iter().map(|s| (s.name.clone(), SetReport::from(s))).collect(),
        }
    }
}

impl From<&HexMesh> for VoxelElementsReport {
    fn from(mesh: &HexMesh) -> VoxelElementsReport {
        VoxelElementsReport {
            elements: mesh.hexes.len(),
            nodes: mesh.nodes.len(),
            step: mesh.step,
            volume: mesh.volume(),
            least: mesh.fraction.iter().fold(1.0, |m, f| f64::min(m, *f)),
            dropped: mesh.dropped,
            sets: mesh.sets.iter().map(|s| (s.name.clone(), SetReport::from(s))).collect(),
        }
    }
}

impl From<&FeSet> for SetReport {
    fn from(set: &FeSet) -> SetReport {
        SetReport { nodes: set.nodes.len(), elements: set.elements.len(), faces: set.faces.len() }
    }
}

impl From<&MeshedVolume> for VolumeReport {
    fn from(made: &MeshedVolume) -> VolumeReport {
        let mesh = &made.mesh;
        let angles = mesh.angles().unwrap_or_default();
        let domains = mesh.domains.iter().enumerate().map(|(d, name)| {
            let of: Vec<u32> = (0..mesh.tets.len() as u32).filter(|t| mesh.domain[*t as usize] as usize == d).collect();
            let corners = |t: u32| mesh.tets[t as usize].map(|n| mesh.nodes[n as usize]);
            let volume = |t: u32| mesh.element_volume(t as usize);
            let largest = of.iter().copied().max_by(|a, b| volume(*a).total_cmp(&volume(*b)));
            let inside = largest.map_or([f64::NAN; 3], |t| {
                let p = corners(t);
                core::array::from_fn(|k| (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4.0)
            });
            let report = DomainReport { elements: of.len(), volume: of.iter().map(|t| volume(*t)).sum(), inside };
            (name.clone(), report)
        });
        let sets = mesh.sets.iter().map(|s| (s.name.clone(), SetReport::from(s)));
        VolumeReport {
            elements: mesh.tets.len(),
            nodes: mesh.nodes.len(),
            order: if mesh.middles.is_empty() { 1 } else { 2 },
            edge: made.step,
            volume: mesh.volume(),
            min_angle: angles.min,
            max_angle: angles.max,
            min_angle_p01: angles.min_p01,
            min_angle_p50: angles.min_p50,
            max_angle_p50: angles.max_p50,
            max_angle_p99: angles.max_p99,
            worst_angle_at: angles.worst_at,
            pieces: made.pieces,
            deviation: made.deviation,
            straight: made.straight,
            dropped: made.dropped,
            loose: made.loose,
            pairs: mesh.pairs.len(),
            domains: domains.collect(),
            sets: sets.collect(),
        }
    }
}
