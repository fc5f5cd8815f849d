//! The fit of a tetrahedral mesh to a part, measured both ways, and the features of the part that it does not keep.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::TetMesh;
use super::tet_locator::TetLocator;
use crate::distance::triangle::Triangle;
use crate::distance::triangle_bvh::TriangleBvh;
use crate::math::{Vec3, add, dot, eigen, norm, scale, sub};
use crate::mesh::Mesh;
use crate::mesh::surface_samples::SurfaceSample;
use crate::random::low_discrepancy;
use crate::union_find;
use crate::weld::PointHash;

/// A feature is lost where the part's surface is farther from the boundary than this, in sizes of tetrahedra: the sag of their
/// edge on a sphere of radius one size.
const OFF: f64 = 1.0 / 8.0;
/// Samples in each tetrahedron for its volume outside the part.
const SAMPLES: usize = 16;
/// Above this length of the mean normal the samples of a feature face one way.
const ONE_WAY: f64 = 0.5;
/// Above this greatest moment of their normals they face along one axis.
const TWO_WAYS: f64 = 0.75;

/// Distances from one surface to another, by samples an eighth of a tetrahedron's size apart, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "DistanceReport")]
pub struct Distances {
    /// Mean.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
    /// Position of the maximum, mm.
    pub at: [f64; 3],
}

/// What kind of feature is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostKind {
    /// A hole, filled.
    Hole,
    /// A slot or gap between two faces, filled.
    Slot,
    /// A recess or concave edge, filled.
    Recess,
    /// A wall, left out.
    Wall,
    /// A pin or rib, left out.
    Pin,
    /// An edge, corner or block, left out.
    Block,
}

impl LostKind {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            LostKind::Hole => "hole",
            LostKind::Slot => "slot",
            LostKind::Recess => "recess",
            LostKind::Wall => "wall",
            LostKind::Pin => "pin",
            LostKind::Block => "block",
        }
    }
}

impl Serialize for LostKind {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.word())
    }
}

/// A feature of a region that a mesh does not keep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "LostFeatureReport")]
pub struct LostFeature {
    /// Filled: hole, slot, recess; left out: wall, pin, block.
    #[schemars(with = "String")]
    pub kind: LostKind,
    /// Where it is farthest from the boundary of the mesh, mm.
    pub at: [f64; 3],
    /// Its width, mm: of a hole or pin the diameter, of a slot or wall the distance between its faces, else the depth.
    pub size: f64,
    /// The greatest distance from the boundary of the mesh, mm.
    pub depth: f64,
}

/// Distances (mm) from samples to a surface, with percentiles by area.
pub fn distances(samples: &[SurfaceSample], off: &[f64]) -> Distances {
    let mut sorted: Vec<(f64, usize)> = off.iter().map(|d| d.abs()).zip(0..).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let Some(last) = sorted.last() else { return Distances::default() };
    let total: f64 = samples.iter().map(|s| s.area).sum();
    let percentile = |share: f64| {
        let mut sum = 0.0;
        let reached = |s: &&(f64, usize)| {
            sum += samples[s.1].area;
            sum >= share * total
        };
        sorted.iter().find(reached).map_or(last.0, |s| s.0)
    };
    let mean = sorted.iter().map(|(d, i)| d * samples[*i].area).sum::<f64>() / total;
    Distances { mean, p95: percentile(0.95), p99: percentile(0.99), max: last.0, at: samples[last.1].at }
}

/// Signed distances (mm) from samples to the boundary of a tetrahedral mesh, negative where `inside` says that it covers them.
pub fn to_boundary(samples: &[SurfaceSample], boundary: &Mesh, inside: &TetLocator) -> Vec<f64> {
    let faces: Vec<Triangle> = (0..boundary.triangles.len()).map(|i| Triangle::new(boundary.corners(i))).collect();
    let tree = TriangleBvh::new(&faces);
    let signed = |s: &SurfaceSample| {
        let off = tree.nearest(s.at, 0).square.sqrt();
        if inside.covers(s.at) { -off } else { off }
    };
    samples.par_iter().map(signed).collect()
}

/// Volume of the tetrahedra outside a part (mm³), by samples; `distance` fills the signed distances (mm) of points from its surface.
pub fn volume_outside(mesh: &TetMesh, distance: impl Fn(&[Vec3]) -> Vec<f64>) -> f64 {
    let middles: Vec<Vec3> = (0..mesh.tets.len()).map(|i| mesh.middle(i)).collect();
    let values = distance(&middles);
    let reaches = |i: usize| mesh.corners(i).iter().map(|p| norm(sub(*p, middles[i]))).fold(0.0, f64::max);
    let near: Vec<usize> = (0..mesh.tets.len()).filter(|&i| values[i] > -reaches(i)).collect();
    let points: Vec<Vec3> = near
        .iter()
        .enumerate()
        .flat_map(|(n, &i)| {
            let p = mesh.corners(i);
            // One sequence for all: the same few points in each would miss the same place in each. Point 0 is the middle of an edge,
            // which may lie on the surface.
            (1..=SAMPLES).map(move |k| within(p, low_discrepancy(n * SAMPLES + k)))
        })
        .collect();
    // Distances of points on the surface are known to rounding.
    let rounding = 1e-12 * mesh.nodes.iter().map(|p| norm(*p)).fold(0.0, f64::max);
    let share = |of: &[f64]| of.iter().filter(|v| **v > rounding).count() as f64 / SAMPLES as f64;
    let values = distance(&points);
    near.iter().zip(values.chunks(SAMPLES)).map(|(i, of)| share(of) * super::volume(mesh.corners(*i))).sum()
}

/// The point of a tetrahedron that has a place in the unit cube: coordinates in order are barycentric.
fn within(p: [Vec3; 4], mut at: Vec3) -> Vec3 {
    at.sort_by(f64::total_cmp);
    let weights = [at[0], at[1] - at[0], at[2] - at[1], 1.0 - at[2]];
    p.iter().zip(weights).fold([0.0; 3], |s, (p, w)| add(s, scale(*p, w)))
}

/// The features of a part that a mesh of tetrahedra of `size` (mm) does not keep, the deepest first: samples of its surface,
/// `spacing` (mm) apart, that are farther than an eighth of a size from the boundary of the mesh (`off`, signed, mm), in sets of those
/// near each other on one side.
pub fn lost_features(samples: &[SurfaceSample], off: &[f64], size: f64, spacing: f64) -> Vec<LostFeature> {
    let far: Vec<(Vec3, Vec3, f64)> =
        samples.iter().zip(off).filter(|(_, d)| d.abs() > OFF * size).map(|(s, d)| (s.at, s.normal, *d)).collect();
    let reach = 2.5 * spacing;
    let mut hash = PointHash::new(reach);
    let mut root = union_find::singles(far.len());
    for (i, (p, _, d)) in (0..).zip(&far) {
        hash.near(*p, |j| {
            let (q, _, e) = far[j as usize];
            if norm(sub(*p, q)) < reach && (*d < 0.0) == (e < 0.0) {
                union_find::unite(&mut root, i, j);
            }
        });
        hash.insert(*p, i);
    }
    let (labels, count) = union_find::labels(&mut root);
    let mut sets: Vec<Vec<(Vec3, Vec3, f64)>> = vec![Vec::new(); count];
    far.iter().zip(&labels).for_each(|(sample, l)| sets[*l as usize].push(*sample));
    let mut found: Vec<LostFeature> = sets.iter().map(|set| feature(set)).collect();
    found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    found
}

/// The feature that samples (position, normal, signed distance to the boundary of the tetrahedra) belong to. Normals of a hole or a
/// pin face all ways about an axis, those of a slot or a wall two ways, those of an edge one way in the main.
fn feature(of: &[(Vec3, Vec3, f64)]) -> LostFeature {
    let count = of.len() as f64;
    let deepest = of.iter().fold((0.0, [0.0; 3]), |m, (p, _, d)| if d.abs() > m.0 { (d.abs(), *p) } else { m });
    let mean = scale(of.iter().fold([0.0; 3], |s, (_, n, _)| add(s, *n)), 1.0 / count);
    let mut moment = [[0.0; 3]; 3];
    for (_, n, _) in of {
        for i in 0..3 {
            for j in 0..3 {
                moment[i][j] += n[i] * n[j] / count;
            }
        }
    }
    let (values, vectors) = eigen(&moment);
    let first = (0..3).fold(0, |m, k| if values[k] > values[m] { k } else { m });
    let heights = of.iter().map(|(p, _, _)| dot(*p, vectors[first]));
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)]);
    // Inside the tetrahedra: something was filled.
    let filled = of[0].2 < 0.0;
    let (kind, size) = match (norm(mean) > ONE_WAY, values[first] > TWO_WAYS, filled) {
        (true, _, true) => (LostKind::Recess, deepest.0),
        (true, _, false) => (LostKind::Block, deepest.0),
        (false, true, true) => (LostKind::Slot, high - low),
        (false, true, false) => (LostKind::Wall, high - low),
        (false, false, true) => (LostKind::Hole, high - low),
        (false, false, false) => (LostKind::Pin, high - low),
    };
    LostFeature { kind, at: deepest.1, size, depth: deepest.0 }
}
