//! Dihedral angles, edge lengths and volumes of tetrahedra.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::{EDGES, FACES, TetMesh, volume};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};

/// A tetrahedron with a smaller dihedral angle than this, or a larger one than 180 less it, is called a sliver (degrees).
pub const SLIVER: f64 = 10.0;
/// Degrees in a step of the histogram.
const STEP: usize = 10;

/// Minimum, mean and maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MinMeanMax {
    /// Minimum.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Maximum.
    pub max: f64,
}

impl MinMeanMax {
    fn of(values: impl Iterator<Item = f64>) -> MinMeanMax {
        let (mut s, mut n) = (MinMeanMax { min: f64::INFINITY, mean: 0.0, max: f64::NEG_INFINITY }, 0usize);
        for v in values {
            (s.min, s.mean, s.max, n) = (s.min.min(v), s.mean + v, s.max.max(v), n + 1);
        }
        s.mean /= n.max(1) as f64;
        s
    }
}

/// Dihedral angles, degrees: 70.53 in a regular tetrahedron.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "DihedralReport")]
pub struct DihedralAngles {
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// 5th percentile of each tetrahedron's least angle.
    pub min_p05: f64,
    /// Median of each tetrahedron's least angle.
    pub min_p50: f64,
    /// Median of each tetrahedron's greatest angle.
    pub max_p50: f64,
    /// 95th percentile of each tetrahedron's greatest angle.
    pub max_p95: f64,
    /// Number of angles (six for each tetrahedron) in steps of ten degrees from 0 to 180.
    pub histogram: Vec<usize>,
}

/// Shapes and sizes of a mesh's tetrahedra.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "TetQualityReport")]
pub struct TetQuality {
    /// Number of tetrahedra.
    pub tets: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of triangles of the boundary.
    pub boundary_triangles: usize,
    /// Number of components connected by faces.
    pub pieces: usize,
    /// Lower and upper corner of the bounds, mm.
    pub bounds: [[f64; 3]; 2],
    /// Volume, mm³.
    pub volume: f64,
    /// Lengths of edges, mm, each counted once for each tetrahedron that has it.
    pub edge: MinMeanMax,
    /// Sizes, mm: the edge of a regular tetrahedron of the same volume.
    pub size: MinMeanMax,
    /// Dihedral angles, degrees.
    pub dihedral: DihedralAngles,
    /// Longest edge over √24 times the radius of the inscribed ball; 1 for a regular tetrahedron.
    pub aspect: MinMeanMax,
    /// Number of tetrahedra with a dihedral angle below 10° or above 170°.
    pub slivers: usize,
    /// Number of tetrahedra of negative volume.
    pub inverted: usize,
}

/// The edge of a regular tetrahedron of this volume (mm): ∛(6√2 V).
pub fn size_of(volume: f64) -> f64 {
    (72f64.sqrt() * volume).cbrt()
}

/// The cosines of the six dihedral angles, at the edges in the order of `EDGES`; NaN where a face has no area.
pub fn dihedral_cosines(p: [Vec3; 4]) -> [f64; 6] {
    let normal = FACES.map(|[a, b, c]| {
        let n = cross(sub(p[b], p[a]), sub(p[c], p[a]));
        scale(n, 1.0 / norm(n))
    });
    // The faces at an edge are those opposite to its other two nodes.
    core::array::from_fn(|e| {
        let [i, j] = EDGES[5 - e];
        -dot(normal[i], normal[j])
    })
}

/// Aspect: longest edge over √24 times the radius of the inscribed ball; infinite without volume.
pub fn aspect(p: [Vec3; 4]) -> f64 {
    let longest = EDGES.iter().map(|[a, b]| norm(sub(p[*a], p[*b]))).fold(0.0, f64::max);
    let area: f64 = FACES.iter().map(|[a, b, c]| norm(cross(sub(p[*b], p[*a]), sub(p[*c], p[*a]))) / 2.0).sum();
    longest * area / (24f64.sqrt() * 3.0 * volume(p).abs())
}

impl TetMesh {
    /// The shapes of the tetrahedra; `None` without any.
    pub fn quality(&self) -> Option<TetQuality> {
        if self.tets.is_empty() {
            return None;
        }
        let degrees = |c: f64| c.clamp(-1.0, 1.0).acos().to_degrees();
        let each: Vec<[f64; 6]> =
            (0..self.tets.len()).into_par_iter().map(|i| dihedral_cosines(self.corners(i)).map(degrees)).collect();
        let mut histogram = vec![0; 180 / STEP];
        for a in each.iter().flatten().filter(|a| !a.is_nan()) {
            histogram[(*a as usize / STEP).min(180 / STEP - 1)] += 1;
        }
        let mut least: Vec<f64> = each.iter().map(|a| a.iter().copied().fold(180.0, f64::min)).collect();
        let mut most: Vec<f64> = each.iter().map(|a| a.iter().copied().fold(0.0, f64::max)).collect();
        let slivers = least.iter().zip(&most);
        let slivers = slivers.filter(|(a, b)| **a < SLIVER || **b > 180.0 - SLIVER).count();
        least.sort_unstable_by(f64::total_cmp);
        most.sort_unstable_by(f64::total_cmp);
        let at = |of: &[f64], share: f64| of[((of.len() - 1) as f64 * share).round() as usize];
        let volumes: Vec<f64> = (0..self.tets.len()).map(|i| volume(self.corners(i))).collect();
        let lengths = (0..self.tets.len()).flat_map(|i| {
            let p = self.corners(i);
            EDGES.map(|[a, b]| norm(sub(p[a], p[b])))
        });
        let used = self.tets.iter().flatten();
        let bounds = used.fold(Aabb::EMPTY, |b, n| b.with(self.nodes[*n as usize]));
        Some(TetQuality {
            tets: self.tets.len(),
            nodes: self.nodes.len(),
            boundary_triangles: self.boundary_faces().len(),
            pieces: self.pieces().0,
            bounds: [bounds.min, bounds.max],
            volume: volumes.iter().sum(),
            edge: MinMeanMax::of(lengths),
            size: MinMeanMax::of(volumes.iter().map(|v| size_of(v.abs()))),
            dihedral: DihedralAngles {
                min: least[0],
                max: most[most.len() - 1],
                min_p05: at(&least, 0.05),
                min_p50: at(&least, 0.5),
                max_p50: at(&most, 0.5),
                max_p95: at(&most, 0.95),
                histogram,
            },
            aspect: MinMeanMax::of((0..self.tets.len()).map(|i| aspect(self.corners(i)))),
            slivers,
            inverted: volumes.iter().filter(|v| **v < 0.0).count(),
        })
    }

    /// The least dihedral angle (degrees) and the size (mm) of each tetrahedron.
    pub fn shapes(&self) -> (Vec<f64>, Vec<f64>) {
        let each = (0..self.tets.len()).into_par_iter().map(|i| {
            let p = self.corners(i);
            let most = dihedral_cosines(p).into_iter().fold(-1.0, f64::max);
            (most.clamp(-1.0, 1.0).acos().to_degrees(), size_of(volume(p).abs()))
        });
        each.unzip()
    }

    /// The middle of tetrahedron `i`: the mean of its corners.
    pub fn middle(&self, i: usize) -> Vec3 {
        scale(self.corners(i).into_iter().fold([0.0; 3], add), 0.25)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::tests::cube;
    use super::*;

    #[test]
    fn regular_and_right_tetrahedra() {
        let regular = TetMesh {
            nodes: vec![[1.0; 3], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
            tets: vec![[0, 1, 3, 2]],
            zones: Vec::new(),
        };
        let q = regular.quality().unwrap();
        let angle = (1.0f64 / 3.0).acos().to_degrees();
        // Sums of a few products, each rounded once.
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs().max(1.0);
        assert!(near(q.dihedral.min, angle) && near(q.dihedral.max, angle));
        assert!(near(q.aspect.max, 1.0) && near(q.size.mean, 8f64.sqrt()) && near(q.edge.min, 8f64.sqrt()));
        assert_eq!((q.slivers, q.inverted, q.dihedral.histogram[7]), (0, 0, 6));
        // Six orthoschemes: 45, 60 and 90 degrees.
        let q = cube().quality().unwrap();
        assert!(near(q.dihedral.min, 45.0) && near(q.dihedral.max, 90.0) && near(q.volume, 1.0));
        assert_eq!(q.dihedral.histogram.iter().sum::<usize>(), 36);
        assert_eq!((q.boundary_triangles, q.pieces, q.nodes), (12, 1, 8));
        let mut flat = cube();
        flat.nodes[7] = [0.5, 0.5, -0.01];
        let q = flat.quality().unwrap();
        assert!(q.slivers > 0 && q.inverted > 0);
    }
}
