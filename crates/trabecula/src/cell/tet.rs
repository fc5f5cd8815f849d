//! Tetrahedral cells: what a regular tetrahedron about a point of full tetrahedral symmetry cuts out of a cell.
//!
//! Source: Chen, Kabaria, Nelaturi, Lew, Piecewise hierarchical implicit surface structures constructed using
//! tetrahedron-based unit cells. In barycentric coordinates f is symmetric in all four: T_d permutes the corners in every
//! way. So its four traces are one function with the face's full symmetry, and f fits across the faces of any conforming
//! mesh, whatever the order of its corners, the edge of the tetrahedron and the shape of the mesh's.

mod connect;
mod fraction;
mod nodes;
mod ready;

pub(crate) use fraction::share_below;
pub use nodes::{Grid, Nodes};
pub use ready::{Ready, ready, ready_cells};

use std::sync::OnceLock;

use super::{Part, Series};
use geometry::fault::{Fault, number};
use geometry::math::{Interval, Vec3, add, dot, scale, sub};

/// Barycentric coordinates; their sum is one.
pub type Bary = [f64; 4];

/// Largest edge of the tetrahedron, in edges of the cubic cell: beyond it a cell has hundreds of periods.
const LARGEST: f64 = 8.0;

/// A tetrahedral cell: f in barycentric coordinates, Σ λ_i p_i being the phase.
pub struct Stencil {
    series: Series,
    /// p_1 … p_4, turns.
    corners: [Vec3; 4],
    volume: OnceLock<fraction::Table>,
    connect: [OnceLock<connect::Pieces>; 3],
}

/// In how many pieces the solid of a tetrahedral cell is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// Pieces of the solid.
    pub pieces: usize,
    /// Pieces of its trace on one face, which are its ports.
    pub ports: usize,
}

impl Stencil {
    /// The regular tetrahedron of edge `edge` (in edges of the cubic cell) about `site` (turns) in a cubic cell: equation
    /// 10 of the paper, or its dual, equation 11, with m = edge √2/4.
    ///
    /// # Errors
    /// An edge that is not positive or above 8; a series that has not the symmetry of the tetrahedron about the site.
    pub fn new(series: Series, site: Vec3, edge: f64, dual: bool) -> Result<Stencil, Fault> {
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
        let stencil = Stencil {
            series,
            corners: ends.map(|e| add(site, scale(e, m))),
            volume: OnceLock::new(),
            connect: Default::default(),
        };
        let defect = stencil.asymmetry();
        // Phases of some turns are good to 1e-15 of them, and f is as steep as Σ amplitude · 2π|h|.
        if defect > 1e-9 * stencil.series.amplitude() {
            let [x, y, z] = site.map(number);
            let message = format!(
                "the function has not the full symmetry of a tetrahedron about ({x}, {y}, {z}): values at equivalent points \
                 differ by {defect:.2e}, so neighbouring tetrahedra would not fit; give a group and one of its sites"
            );
            return Err(Fault::new("site", message));
        }
        Ok(stencil)
    }

    /// The same cell less a constant: its surface f = 0 is this one's f = `level`.
    ///
    /// # Errors
    /// As [`Series::about`].
    pub fn about(&self, level: f64) -> Result<Stencil, Fault> {
        Ok(Stencil {
            series: self.series.about(level)?,
            corners: self.corners,
            volume: OnceLock::new(),
            connect: Default::default(),
        })
    }

    /// The greatest difference of f between points that differ in the order of their coordinates.
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

    fn table(&self) -> &fraction::Table {
        self.volume.get_or_init(|| fraction::Table::new(self))
    }

    /// Least and greatest value of f in the tetrahedron, to the fourth power of 1/96 of its edge.
    pub fn range(&self) -> Interval {
        self.table().range()
    }

    /// The solid share of the tetrahedron's volume at level `iso`, within 1e-4. An affine map keeps it.
    pub fn fraction(&self, part: Part, iso: f64) -> f64 {
        self.table().fraction(part, iso)
    }

    /// The level at which the part fills this share of the tetrahedron (0 < fraction < 1).
    pub fn iso(&self, part: Part, fraction: f64) -> f64 {
        self.table().iso(part, fraction)
    }

    /// The solid share of a face's area at level `iso`, within 1e-4.
    pub fn face_fraction(&self, part: Part, iso: f64) -> f64 {
        fraction::of_face(self, part, iso)
    }

    fn pieces(&self, part: Part) -> &connect::Pieces {
        self.connect[part as usize].get_or_init(|| connect::Pieces::new(self, part))
    }

    /// The intervals of the level in which the solid is one piece that reaches all four faces: there the lattice on a mesh
    /// whose tetrahedra hang together by faces is one piece. Found on a subdivision of 48 steps to the edge.
    pub fn connected(&self, part: Part) -> &[[f64; 2]] {
        self.pieces(part).whole()
    }

    /// The same by solid fraction.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let share = |t: f64| self.fraction(part, t).clamp(0.0, 1.0);
        let ends = self.connected(part).iter();
        let sorted = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
        ends.map(|i| sorted(i.map(share))).collect()
    }

    /// Pieces of the solid and of its trace on a face at level `iso`.
    pub fn count(&self, part: Part, iso: f64) -> Count {
        self.pieces(part).count(iso)
    }
}

#[cfg(test)]
pub(crate) mod tests;
