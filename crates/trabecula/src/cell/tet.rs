//! Tetrahedral cells: a cubic cell restricted to a regular tetrahedron about a site of full tetrahedral symmetry.
//!
//! Source: Chen, Kabaria, Nelaturi, Lew, Piecewise hierarchical implicit surface structures constructed using
//! tetrahedron-based unit cells. In barycentric coordinates f is symmetric under all permutations, since T_d permutes
//! the vertices. So its traces on the four faces are one function with the full symmetry of the face, and f is
//! continuous across the faces of any conforming mesh, for any vertex order, tetrahedron edge and element shape.

mod component_counts;
mod fraction;
mod subdivision;
mod tet_catalogue;

pub(crate) use fraction::{FractionTable, share_below};
pub use subdivision::{Subdivision, SubdivisionNodes};
pub use tet_catalogue::{NamedTetCell, named_tet_cell, tet_catalogue};

use std::sync::OnceLock;

use super::{Part, Series};
use geometry::fault::{Fault, number};
use geometry::math::{Interval, Vec3, add, dot, scale, sub};
use geometry::once::computed;

/// Barycentric coordinates; their sum is one.
pub type Bary = [f64; 4];

/// Largest edge of the tetrahedron, in edges of the cubic cell: beyond it a cell has hundreds of periods.
const LARGEST: f64 = 8.0;

/// A tetrahedral cell: f in barycentric coordinates, with phase Σ λ_i p_i.
pub struct TetCell {
    series: Series,
    /// Phases p_1 … p_4 of the vertices, turns.
    corners: [Vec3; 4],
    volume: OnceLock<fraction::FractionTable>,
    connect: [OnceLock<component_counts::ComponentCounts>; 3],
}

/// Numbers of connected components of a tetrahedral cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// Connected components of the solid.
    pub components: usize,
    /// Connected components of its trace on one face (ports).
    pub ports: usize,
}

impl TetCell {
    /// The regular tetrahedron of edge `edge` (in edges of the cubic cell) about `site` (turns) in a cubic cell: equation
    /// 10 of the paper, or its dual, equation 11, with m = edge √2/4.
    ///
    /// # Errors
    /// An edge that is not positive or above 8; a series that has not the symmetry of the tetrahedron about the site.
    pub fn new(series: Series, site: Vec3, edge: f64, dual: bool) -> Result<TetCell, Fault> {
        if !(edge > 0.0 && edge <= LARGEST) {
            let message = format!(
                "the edge of the tetrahedron is {} cells; it must be above 0 and at most {LARGEST}",
                number(edge)
            );
            return Err(Fault::new("edge", message));
        }
        if let Some(c) = site.iter().find(|c| !c.is_finite()) {
            return Err(Fault::new("site", format!("{c} is not a finite number")));
        }
        let m = if dual { -1.0 } else { 1.0 } * edge * 2f64.sqrt() / 4.0;
        let ends = [[1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0], [1.0, 1.0, 1.0]];
        let cell = TetCell {
            series,
            corners: ends.map(|e| add(site, scale(e, m))),
            volume: OnceLock::new(),
            connect: Default::default(),
        };
        let defect = cell.asymmetry();
        // Phases of some turns are accurate to 1e-15 of their size, and f has the Lipschitz bound Σ amplitude · 2π|h|.
        if defect > 1e-9 * cell.series.amplitude() {
            let [x, y, z] = site.map(number);
            let message = format!(
                "the function has not the full symmetry of a tetrahedron about ({x}, {y}, {z}): values at equivalent points \
                 differ by {defect:.2e}, so neighbouring tetrahedra would not fit; give a group and one of its sites"
            );
            return Err(Fault::new("site", message));
        }
        Ok(cell)
    }

    /// The same cell shifted by a constant: its surface f = 0 is the surface f = `level` of this one.
    ///
    /// # Errors
    /// As [`Series::about`].
    pub fn about(&self, level: f64) -> Result<TetCell, Fault> {
        Ok(TetCell {
            series: self.series.about(level)?,
            corners: self.corners,
            volume: OnceLock::new(),
            connect: Default::default(),
        })
    }

    /// Maximum difference of f between points whose coordinates are permutations of each other.
    fn asymmetry(&self) -> f64 {
        let swaps = [[1, 0, 2, 3], [0, 2, 1, 3], [0, 1, 3, 2]];
        let mut worst = 0.0f64;
        for i in 1..40 {
            let raw = [0.618, 0.414, 0.732, 0.236].map(|g: f64| (g * f64::from(i)).fract() + 0.01);
            let sum: f64 = raw.iter().sum();
            let l = raw.map(|v| v / sum);
            let turned = swaps.map(|s| s.map(|j| l[j]));
            let all = [l, turned[0], turned[1], turned[2]];
            let (mut v, mut g) = ([0.0; 4], [[0.0; 4]; 4]);
            self.gradients(&all, &mut v, &mut g);
            worst = v.iter().fold(worst, |w, x| w.max((x - v[0]).abs()));
        }
        worst
    }

    /// The series.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The corners p_1 … p_4, turns.
    pub fn corners(&self) -> &[Vec3; 4] {
        &self.corners
    }

    /// The phase (turns) of a point.
    #[inline]
    pub fn phase(&self, l: Bary) -> Vec3 {
        let p = &self.corners;
        let ab = add(scale(p[0], l[0]), scale(p[1], l[1]));
        add(add(ab, scale(p[2], l[2])), scale(p[3], l[3]))
    }

    /// Fills f and ∂f/∂λ_i = ∇f·(p_i − p_4) at points; the fourth is then zero.
    pub fn gradients(&self, at: &[Bary], values: &mut [f64], gradients: &mut [Bary]) {
        let u: Vec<Vec3> = at.iter().map(|l| self.phase(*l)).collect();
        let mut g = vec![[0.0; 3]; u.len()];
        self.series.gradients(&u, values, &mut g);
        let along = [0, 1, 2].map(|i| sub(self.corners[i], self.corners[3]));
        for (out, g) in gradients.iter_mut().zip(g) {
            *out = [dot(g, along[0]), dot(g, along[1]), dot(g, along[2]), 0.0];
        }
    }

    /// f at points.
    pub fn values(&self, at: &[Bary]) -> Vec<f64> {
        let (mut v, mut g) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
        self.gradients(at, &mut v, &mut g);
        v
    }

    fn table(&self) -> &fraction::FractionTable {
        computed(&self.volume, || fraction::FractionTable::new(self))
    }

    /// Range of f in the tetrahedron, to fourth order in 1/96 of its edge.
    pub fn range(&self) -> Interval {
        self.table().range()
    }

    /// Solid fraction of the tetrahedron at level `iso`, within 1e-4; invariant under affine maps.
    pub fn fraction(&self, part: Part, iso: f64) -> f64 {
        self.table().fraction(part, iso)
    }

    /// The level at which the part has this solid fraction (0 < fraction < 1).
    pub fn iso(&self, part: Part, fraction: f64) -> f64 {
        self.table().iso(part, fraction)
    }

    /// Solid fraction of a face at level `iso`, within 1e-4.
    pub fn face_fraction(&self, part: Part, iso: f64) -> f64 {
        fraction::of_face(self, part, iso)
    }

    fn component_counts(&self, part: Part) -> &component_counts::ComponentCounts {
        computed(&self.connect[part as usize], || component_counts::ComponentCounts::new(self, part))
    }

    /// The intervals of the level in which the solid is connected and reaches all four faces: there the lattice is
    /// connected on any mesh whose tetrahedra are connected by faces. Found on a subdivision of 48 steps per edge.
    pub fn connected(&self, part: Part) -> &[[f64; 2]] {
        self.component_counts(part).whole()
    }

    /// The same by solid fraction.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let share = |t: f64| self.fraction(part, t).clamp(0.0, 1.0);
        let ends = self.connected(part).iter();
        let sorted = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
        ends.map(|i| sorted(i.map(share))).collect()
    }

    /// Connected components of the solid and of its trace on a face at level `iso`.
    pub fn count(&self, part: Part, iso: f64) -> Count {
        self.component_counts(part).count(iso)
    }
}

#[cfg(test)]
pub(crate) mod tests;
