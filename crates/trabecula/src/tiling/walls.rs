//! How thick the walls of a sheet over a tetrahedral mesh are, and levels at which they are as thick as asked.
//!
//! The mean thickness is the volume of walls over the area of their mid-surface f = 0. To first order a wall is 2t/|∇f| thick, which
//! is known all over the mid-surface: its mean, times the ratio of both means in some hundred tetrahedra, which varies little.
//! How walls spread is measured in these along normals of the mid-surface, both ways to the faces |f| = t: past creases, and where
//! tetrahedra overlap.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::mixture::{Mixture, weights};
use super::node_levels::{MidSurfacePiece, middle, steepness};
use super::{NodalLevel, Tiling};
use crate::cell::Part;
use geometry::math::{Vec3, add, dot, norm, scale};
use geometry::progress::checkpoint;

/// The most tetrahedra whose walls are measured, and the most normals in each.
const TETS: usize = 128;
const NORMALS: usize = 32;
/// Steps along a normal for half the wall to first order, of which a wall is followed for four times as many.
const STEPS: usize = 24;
/// Points in each where tetrahedra overlap, and how near the mid-surface they count as on it, in levels.
const POINTS: usize = 2000;
const ON: f64 = 0.3;
/// The most pieces of the mid-surface: some hundred thousand are enough for a mean.
const PIECES: usize = 2_000_000;
/// The most times that levels are scaled, and the share of the thickness that is close enough.
const ROUNDS: usize = 8;
const NEAR: f64 = 1e-3;

/// Wall thickness over a tetrahedral mesh, along normals of the mid-surface and weighted by its area, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct WallSpread {
    /// Minimum of some thousand.
    pub min: f64,
    /// 5th percentile.
    pub low: f64,
    /// Mean: volume of walls over area of their mid-surface.
    pub mean: f64,
    /// 95th percentile.
    pub high: f64,
    /// Maximum of some thousand.
    pub max: f64,
    /// Share of the mid-surface from which a wall runs into the next one before it ends.
    pub merged: f64,
    /// Mean length of the solid along normals, to where it ends: more than the mean wall where walls run into each other.
    pub through: f64,
}

/// A wall along a normal of the mid-surface.
struct Wall {
    /// How thick it is, mm; one that runs into the next one ends half way.
    thickness: f64,
    /// The area (mm²) of mid-surface that it stands for.
    area: f64,
    /// How far the solid goes, mm, and whether that is into the next wall.
    through: f64,
    merged: bool,
}

/// Something weighted by area (mm²), and that area.
fn sums(of: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    of.fold([0.0; 2], |[sum, area], [v, a]| [sum + v * a, area + a])
}

/// The mean of something, weighted by area, over the pieces of the mid-surface in some tetrahedra; summed in their order.
fn mean(tets: &[usize], pieces: &[MidSurfacePiece], of: impl Fn(usize, &MidSurfacePiece) -> [f64; 2] + Sync) -> f64 {
    let found: Vec<[f64; 2]> = tets.par_iter().map(|t| sums(pieces.iter().map(|p| of(*t, p)))).collect();
    let [sum, area] = found.into_iter().fold([0.0; 2], |[s, a], [v, w]| [s + v, a + w]);
    sum / area
}

impl Tiling {
    /// How thick the walls of a sheet are over the mid-surface in all tetrahedra, by its area. `None` for other parts, for
    /// transitions, and where there is no mid-surface.
    pub fn thickness(&self) -> Option<WallSpread> {
        let [cell] = &self.cells[..] else { return None };
        if self.part != Part::Sheet {
            return None;
        }
        let pieces = middle(&cell.cell);
        let tet = |(i, t): (usize, usize)| {
            // Other ones in every tetrahedron.
            let every = pieces.len().div_ceil(NORMALS).max(1);
            let some: Vec<&MidSurfacePiece> = pieces.iter().skip(i % every).step_by(every).collect();
            self.along_normals(t, &some)
        };
        let all: Vec<Vec<Wall>> = self.sample_tets().into_par_iter().enumerate().map(tet).collect();
        let mut all: Vec<Wall> = all.into_iter().flatten().collect();
        all.sort_unstable_by(|a, b| a.thickness.total_cmp(&b.thickness).then(a.area.total_cmp(&b.area)));
        let area: f64 = all.iter().map(|w| w.area).sum();
        let share = |s: f64| {
            let mut below = 0.0;
            let at = all.iter().find(|w| {
                below += w.area;
                below >= s * area
            });
            at.map(|w| w.thickness)
        };
        Some(WallSpread {
            min: all.first()?.thickness,
            low: share(0.05)?,
            mean: self.mean_wall(&pieces),
            high: share(0.95)?,
            max: all.last()?.thickness,
            merged: all.iter().filter(|w| w.merged).map(|w| w.area).sum::<f64>() / area,
            through: all.iter().map(|w| w.through * w.area).sum::<f64>() / area,
        })
    }

    /// As many tetrahedra as are enough for a mean over their pieces of the mid-surface.
    fn tets_for_mean(&self, pieces: &[MidSurfacePiece]) -> Vec<usize> {
        let step = (self.map.len() * pieces.len()).div_ceil(PIECES).max(1);
        (0..self.map.len()).step_by(step).collect()
    }

    /// The volume of walls over the area of their mid-surface, mm: of bent tetrahedra where the mesh is bent.
    fn mean_wall(&self, pieces: &[MidSurfacePiece]) -> f64 {
        let first_order = |tets: &[usize]| mean(tets, pieces, |t, p| self.first_order(t, p));
        let many = self.tets_for_mean(pieces);
        let flat = self.realised(pieces) * first_order(&many) / first_order(&self.sample_tets());
        let Some(bending) = self.bending() else { return flat };
        let areas: Vec<f64> =
            many.par_iter().map(|t| pieces.iter().map(|p| self.first_order(*t, p)[1]).sum()).collect();
        let area = areas.iter().sum::<f64>() * self.map.len() as f64 / many.len() as f64;
        bending.thickness(self, flat * area, area)
    }

    /// The sheet whose walls are on average as thick as asked (mm; one number, or one for each node, of which the mean over the
    /// mid-surface counts): all its levels are scaled alike.
    #[must_use]
    pub fn with_mean_thickness(mut self, asked: &[f64]) -> Tiling {
        let pieces = middle(&self.cells[0].cell);
        let at = |t: usize, p: &MidSurfacePiece| {
            let n = self.map.tet(t).map(|n| asked[(n as usize).min(asked.len() - 1)]);
            [(0..4).map(|i| p.at[i] * n[i]).sum::<f64>(), self.first_order(t, p)[1]]
        };
        let wanted = if let [one] = asked { *one } else { mean(&self.tets_for_mean(&pieces), &pieces, at) };
        for _ in 0..ROUNDS {
            checkpoint();
            let by = wanted / self.mean_wall(&pieces);
            if !by.is_finite() {
                break;
            }
            self.level = match &self.level {
                NodalLevel::Same(t) => NodalLevel::Same(by * t),
                NodalLevel::Nodes(of) => NodalLevel::Nodes(of.iter().map(|t| by * t).collect::<Vec<f64>>().into()),
            };
            if (by - 1.0).abs() < NEAR {
                break;
            }
        }
        self
    }

    /// The thickness 2t/|∇f| (mm) of a piece in a tetrahedron, and its area (mm²).
    fn first_order(&self, t: usize, p: &MidSurfacePiece) -> [f64; 2] {
        let steep = steepness(&self.map, t, &p.slope);
        let thickness = 2.0 * self.level_at(t, p.at) * self.cells[0].scale / steep;
        // Six times the volume is the determinant of the map from barycentric coordinates.
        [thickness, 6.0 * self.map.volume(t) * p.weight * steep]
    }

    /// Some tetrahedra, evenly spread over the mesh.
    fn sample_tets(&self) -> Vec<usize> {
        let count = self.map.len().min(TETS);
        (0..count).map(|i| i * self.map.len() / count).collect()
    }

    /// The volume of walls in some tetrahedra over the area of the mid-surface there, mm.
    fn realised(&self, pieces: &[MidSurfacePiece]) -> f64 {
        let some = self.sample_tets();
        let mixture = Mixture::new(&self.cells, self.part);
        let one = |t: &usize| {
            let volume = self.map.volume(*t);
            if self.map.overlap() > 0.0 {
                let [share, area] = self.sampled_walls(*t);
                return [volume * share, volume * area];
            }
            let corner = |i: usize| core::array::from_fn(|k| f64::from(u8::from(k == i)));
            let levels = core::array::from_fn(|i| self.level_at(*t, corner(i)));
            let share = mixture.share(&weights(&self.map, &self.cells, *t), levels);
            [volume * share, pieces.iter().map(|p| self.first_order(*t, p)[1]).sum()]
        };
        let found: Vec<[f64; 2]> = some.par_iter().map(one).collect();
        let [volume, area] = found.into_iter().fold([0.0; 2], |[v, a], [w, b]| [v + w, a + b]);
        volume / area
    }

    /// The share of a tetrahedron in walls, and the area of the mid-surface in it over its volume, ∫ |∇f| δ(f) dV / V.
    fn sampled_walls(&self, t: usize) -> [f64; 2] {
        let known = self.known(&self.points_in(t, POINTS));
        let mut found = [0.0; 2];
        for k in &known {
            let near = ON * k.t;
            found[0] += f64::from(u8::from(k.f.abs() < k.t));
            found[1] += if k.f.abs() < near { norm(k.slope) / (2.0 * near) } else { 0.0 };
        }
        found.map(|v| v / known.len() as f64)
    }

    /// The walls of a tetrahedron along the normals of these pieces of the mid-surface.
    fn along_normals(&self, t: usize, pieces: &[&MidSurfacePiece]) -> Vec<Wall> {
        let mut places: Vec<Vec3> = pieces.iter().map(|p| self.map.place(t, p.at)).collect();
        // On to the mid-surface, where overlap has moved it too.
        let mut known = self.known(&places);
        for _ in 0..3 {
            for (p, k) in places.iter_mut().zip(&known) {
                *p = add(*p, scale(k.slope, -k.f / dot(k.slope, k.slope)));
            }
            known = self.known(&places);
        }
        let on = |i: &usize| known[*i].t > 0.0 && known[*i].f.abs() < 0.01 * known[*i].t;
        let found: Vec<usize> = (0..places.len()).filter(on).collect();
        let nothing = |p: &&MidSurfacePiece| Wall {
            thickness: 0.0,
            area: self.first_order(t, p)[1],
            through: 0.0,
            merged: false,
        };
        let mut walls: Vec<Wall> = pieces.iter().map(nothing).collect();
        for side in [1.0, -1.0] {
            let mut open = found.clone();
            // f and t − |f| at the last step; f is infinite in the next wall.
            let mut last: Vec<[f64; 2]> = known.iter().map(|k| [0.0, k.t]).collect();
            for step in 1..=4 * STEPS {
                let h = |i: usize| known[i].t / norm(known[i].slope) / STEPS as f64;
                let at = |i: &usize| {
                    let normal = scale(known[*i].slope, side / norm(known[*i].slope));
                    add(places[*i], scale(normal, h(*i) * step as f64))
                };
                let beyond = self.known(&open.iter().map(at).collect::<Vec<Vec3>>());
                let mut left = Vec::with_capacity(open.len());
                for (i, k) in open.into_iter().zip(beyond) {
                    let (f, short) = (side * k.f, k.t - k.f.abs());
                    let [f_before, before] = last[i];
                    let (wall, done) = (&mut walls[i], h(i) * (step - 1) as f64);
                    let own = f_before.is_finite();
                    if short <= 0.0 {
                        let length = done + h(i) * before / (before - short);
                        wall.through += length;
                        wall.thickness += if own { length } else { 0.0 };
                        continue;
                    }
                    // A wall that runs into the next one ends half way.
                    let turns = own && (f < f_before || step == 4 * STEPS);
                    wall.thickness += if turns { done } else { 0.0 };
                    wall.merged |= turns;
                    if step == 4 * STEPS {
                        wall.through += done;
                    } else {
                        last[i] = [if turns || !own { f64::INFINITY } else { f }, short];
                        left.push(i);
                    }
                }
                open = left;
            }
        }
        let mut on = vec![false; walls.len()];
        found.iter().for_each(|i| on[*i] = true);
        walls.into_iter().zip(on).filter(|(_, on)| *on).map(|(w, _)| w).collect()
    }
}
