//! A lattice in equal tetrahedra that fill space: those of the body-centred cubic lattice, found by folding and not by a search.
//!
//! A tetrahedron has the centres of two adjacent cubes and an edge of their common face as corners. About the centre of the cube in which a
//! position lies, with its offset in cubes sorted by size, α ≥ β ≥ |γ|, its coordinates are 1 − α − β for this centre, α − β for the other
//! one, and β + γ and β − γ for the ends of the edge.

use std::sync::Arc;

use super::{NodalLevel, Tiling};
use crate::cell::Cut;
use crate::cell::tet::{Bary, TetCell};
use crate::field::Field;
use crate::implicit::Implicit;
use geometry::math::{Aabb, Interval, Vec3, norm};

/// A lattice of one cell at one level in such tetrahedra.
#[derive(Clone)]
pub struct SpaceFilling {
    cell: Arc<TetCell>,
    cut: Cut,
    level: f64,
    /// Edge of the cubes, mm; a corner of one is at the origin.
    edge: f64,
    lipschitz: f64,
}

/// Where a position is: coordinates in its tetrahedron, the axes by the size of the offset along them, and the signs of the two greater ones.
struct TetPosition {
    bary: Bary,
    axes: [usize; 3],
    signs: [f64; 2],
}

impl SpaceFilling {
    /// That of a tiling of cubes of this edge (mm); `None` if its level varies, tetrahedra overlap or have several cells.
    pub fn of(tiling: &Tiling, edge: f64) -> Option<SpaceFilling> {
        let ([share], NodalLevel::Same(level)) = (&tiling.cells[..], &tiling.level) else { return None };
        (tiling.map.overlap() <= 0.0 && share.scale == 1.0 && share.weights.is_none()).then(|| SpaceFilling {
            cell: share.cell.clone(),
            cut: tiling.cut,
            level: *level,
            edge,
            lipschitz: tiling.lipschitz(),
        })
    }

    fn place(&self, p: Vec3) -> TetPosition {
        let q = p.map(|x| {
            let u = x / self.edge;
            u - u.floor() - 0.5
        });
        let mut axes = [0, 1, 2];
        axes.sort_by(|a, b| q[*b].abs().total_cmp(&q[*a].abs()));
        let [a, b, c] = axes.map(|axis| q[axis]);
        let (alpha, beta) = (a.abs(), b.abs());
        TetPosition {
            bary: [1.0 - alpha - beta, alpha - beta, beta + c, beta - c],
            axes,
            signs: [1f64.copysign(a), 1f64.copysign(b)],
        }
    }
}

impl Field for SpaceFilling {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let barys: Vec<Bary> = points.iter().map(|p| self.place(*p).bary).collect();
        let mut slopes = vec![[0.0; 4]; points.len()];
        self.cell.gradients(&barys, out, &mut slopes);
        out.iter_mut().for_each(|v| *v = self.cut.value(*v, self.level));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let places: Vec<TetPosition> = points.iter().map(|p| self.place(*p)).collect();
        let barys: Vec<Bary> = places.iter().map(|p| p.bary).collect();
        let mut slopes = vec![[0.0; 4]; points.len()];
        self.cell.gradients(&barys, values, &mut slopes);
        for (i, TetPosition { axes, signs, .. }) in places.iter().enumerate() {
            let [s0, s1, s2, s3] = slopes[i];
            let mut slope = [0.0; 3];
            slope[axes[0]] = signs[0] * (s1 - s0) / self.edge;
            slope[axes[1]] = signs[1] * (s2 + s3 - s0 - s1) / self.edge;
            slope[axes[2]] = (s2 - s3) / self.edge;
            (values[i], gradients[i]) = self.cut.gradient((values[i], slope), (self.level, [0.0; 3]));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let most = self.cell.series().amplitude();
        let (mut f, mut slope) = ([0.0], [[0.0; 4]]);
        self.cell.gradients(&[self.place(b.center()).bary], &mut f, &mut slope);
        let by = 0.5 * self.lipschitz * norm(b.size());
        let f = Interval::new((f[0] - by).max(-most), (f[0] + by).min(most));
        self.cut.bound(f, Interval::new(self.level, self.level))
    }
}

impl Implicit for SpaceFilling {
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        self.cut.sides(|cut| SpaceFilling { cut, ..self.clone() })
    }

    fn lipschitz(&self) -> f64 {
        self.lipschitz
    }
}
