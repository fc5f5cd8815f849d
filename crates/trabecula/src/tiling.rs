//! A lattice over a tetrahedral mesh: a tetrahedral cell in each of its tetrahedra, cut by a part at a level.
//!
//! The level is a number, or one for each node of the mesh and linear between them. Several cells make a transition: each
//! has a weight at every node, their weighted sum is cut, and since weights are linear in tetrahedra it is continuous too.
//!
//! Continuous, but with a crease at every face: no choice of cell removes it, since the faces of the tetrahedron are
//! mirrors of no group. With an overlap, tetrahedra reach a little beyond themselves and their functions are mixed there,
//! which leaves no crease; the surface then moves by some of the overlap, but not where it meets the faces themselves.

mod blended_share;
mod crease;
mod end_sizes;
mod face_grid;
mod mixture;
mod node_levels;
mod ports;
mod rounded;
mod space_filling;
mod surface;
mod walls;

use std::sync::{Arc, OnceLock};

use crate::cell::tet::{Bary, FractionTable, TetCell};
use crate::cell::{Cut, Part};
use crate::field::{Block, Field, fill_points};
use crate::implicit::Implicit;
use crate::map::CarrierMesh;
use crate::map::bent_tets::within;
use geometry::math::{Aabb, Interval, Mat3, Vec3, add, norm, scale, spectral_norm};

pub use crease::WallCreases;
pub use face_grid::FaceGrid;
pub use node_levels::Amount;
pub use ports::Ports;
pub use rounded::Rounded;
pub use space_filling::SpaceFilling;
use surface::Bending;
pub use surface::{Connectivity, TilingSurface, ZonePair, cell_surface, connectivity, steps_enough};
pub use walls::WallSpread;

/// A cell of a tiling, with its scale and weights.
#[derive(Clone)]
pub struct Share {
    /// The cell.
    pub cell: Arc<TetCell>,
    /// Divisor of its values, so that several cells have comparable values.
    pub scale: f64,
    /// Its weight at each node of the mesh; one everywhere if there is none.
    pub weights: Option<Arc<Vec<f64>>>,
}

/// The level t.
#[derive(Clone)]
pub enum NodalLevel {
    /// The same everywhere.
    Same(f64),
    /// At each node of the mesh, linear between them.
    Nodes(Arc<Vec<f64>>),
}

/// A lattice over a tetrahedral mesh as a field: sheet |f| − t, lower f − t, upper t − f.
#[derive(Clone)]
pub struct Tiling {
    /// The mesh.
    pub map: Arc<CarrierMesh>,
    /// The cells whose weighted sum f is.
    pub cells: Vec<Share>,
    /// The part.
    pub part: Part,
    /// The level of f.
    pub level: NodalLevel,
    /// For each tetrahedron, a Lipschitz bound of f (per mm).
    lipschitz: Arc<Vec<f64>>,
    /// The part, or one side of it alone.
    cut: Cut,
    /// Shares of the blended function in the whole mesh, where tetrahedra of one cell overlap.
    blended: Option<Arc<FractionTable>>,
    /// Factors of its values as a field, if they are lowered anywhere.
    eased: Option<Arc<GradientLimiter>>,
    /// What bending the mesh changes, once it is known; the same at all levels.
    bending: Arc<OnceLock<Option<Arc<Bending>>>>,
}

/// Factors of a field's values at the nodes, linear between them, so that it is hardly steeper in some tetrahedra than in most.
struct GradientLimiter {
    at_nodes: Vec<f64>,
    /// The steepness of the field at its zero set, per mm, at most.
    limit: f64,
}

/// f, the level t, and their gradients (per mm) at a point.
#[derive(Clone, Copy, Default)]
struct Known {
    f: f64,
    slope: Vec3,
    t: f64,
    slope_t: Vec3,
    /// The factor of the field's value, less one.
    eased: f64,
    slope_eased: Vec3,
}

/// Largest number of tetrahedra that are evaluated for a bound.
const MOST: usize = 256;
/// How far beyond a tetrahedron its function is followed, in barycentric coordinates, towards a surface that its mesh does not
/// reach: farther out the lattice goes on straight.
const BEYOND: f64 = 0.1;
/// How steep an eased field may be, in the median over the volume: beyond what sizes and shapes do in a good mesh.
const STEEP: f64 = 4.0;

impl Tiling {
    /// A single cell over a mesh.
    pub fn new(map: Arc<CarrierMesh>, cell: Arc<TetCell>, part: Part, level: NodalLevel) -> Tiling {
        let cell = Share { cell, scale: 1.0, weights: None };
        Tiling::of(map, vec![cell], part, level)
    }

    /// Several cells over a mesh.
    pub fn of(map: Arc<CarrierMesh>, cells: Vec<Share>, part: Part, level: NodalLevel) -> Tiling {
        let steepest = steepest(&cells);
        let corners = cells[0].cell.corners();
        let along = [0, 1, 2].map(|i| geometry::math::sub(corners[i], corners[3]));
        let edge = norm(along[0]);
        let of = |t: usize| {
            let slopes = map.slopes(t);
            // du/dx = Σ (p_i − p_4) ∇λ_iᵀ.
            let j =
                core::array::from_fn(|a| core::array::from_fn(|b| (0..3).map(|i| along[i][a] * slopes[i][b]).sum()));
            // ∇(Σ w f) = Σ w ∇f + f ∇w.
            let turn = |c: &Share| {
                let w = c.weights.as_ref()?;
                let most = c.cell.series().amplitude() / c.scale;
                Some(most * map.steeper(t) * norm(linear_slope(map.slopes(t), w, map.tet(t))))
            };
            steepest / edge * spectral_norm(&j) * map.steeper(t) + cells.iter().filter_map(turn).sum::<f64>()
        };
        let lipschitz: Vec<f64> = (0..map.len()).map(of).collect();
        Tiling {
            map,
            cells,
            part,
            level,
            lipschitz: Arc::new(lipschitz),
            cut: Cut::new(part),
            blended: None,
            eased: None,
            bending: Arc::default(),
        }
    }

    /// The same lattice as a field that is nowhere much steeper than in most of the mesh: where tetrahedra are small or flat its values are
    /// lowered, by factors that are linear in each tetrahedron. Its zero set is the same. Values of the order of one step of a grid then mean
    /// about the same everywhere, by which the extractor keeps surfaces apart.
    #[must_use]
    pub fn with_limited_gradient(&self) -> Tiling {
        let mut order: Vec<usize> = (0..self.map.len()).collect();
        order.sort_unstable_by(|a, b| self.lipschitz[*a].total_cmp(&self.lipschitz[*b]));
        let half = 0.5 * order.iter().map(|t| self.map.volume(*t)).sum::<f64>();
        let mut below = 0.0;
        let median = order.iter().find(|t| {
            below += self.map.volume(**t);
            below >= half
        });
        let limit = STEEP * median.map_or(f64::INFINITY, |t| self.lipschitz[*t]);
        let mut at_nodes = vec![1.0f64; self.map.nodes().len()];
        for t in order.into_iter().rev().take_while(|t| self.lipschitz[*t] > limit) {
            for n in self.map.tet(t) {
                at_nodes[n as usize] = at_nodes[n as usize].min(limit / self.lipschitz[t]);
            }
        }
        let eased = at_nodes.iter().any(|v| *v < 1.0).then(|| Arc::new(GradientLimiter { at_nodes, limit }));
        Tiling { eased, ..self.clone() }
    }

    /// The level where barycentric coordinates in a tetrahedron are these.
    fn level_at(&self, t: usize, l: Bary) -> f64 {
        match &self.level {
            NodalLevel::Same(v) => *v,
            NodalLevel::Nodes(of) => self.linear(of, t, l),
        }
    }

    fn linear(&self, of: &[f64], t: usize, l: Bary) -> f64 {
        let n = self.map.tet(t);
        (0..4).map(|i| l[i] * of[n[i] as usize]).sum()
    }

    /// f and t at points in tetrahedra, and their gradients if they are `sloped`.
    fn known_in(&self, at: &[(usize, Bary)], sloped: bool) -> Vec<Known> {
        let mut out = vec![Known::default(); at.len()];
        let far = self.map.overlap().max(BEYOND);
        let barys: Vec<Bary> = at.iter().map(|a| within(a.1, far)).collect();
        let slope = |(t, l): &(usize, Bary)| if sloped { self.map.slopes_at(*t, *l) } else { Mat3::default() };
        let slopes: Vec<Mat3> = at.iter().map(slope).collect();
        let (mut v, mut g) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
        for c in &self.cells {
            c.cell.gradients(&barys, &mut v, &mut g);
            for (i, (t, l)) in at.iter().enumerate() {
                let m = &slopes[i];
                let slope = (0..3).fold([0.0; 3], |s, k| add(s, scale(m[k], g[i][k])));
                let k = &mut out[i];
                let (f, slope) = (v[i] / c.scale, scale(slope, 1.0 / c.scale));
                match &c.weights {
                    None => (k.f, k.slope) = (k.f + f, add(k.slope, slope)),
                    Some(w) => {
                        let weight = self.linear(w, *t, within(*l, self.map.overlap()));
                        let turn = scale(linear_slope(m, w, self.map.tet(*t)), f);
                        k.f += weight * f;
                        k.slope = add(k.slope, add(scale(slope, weight), turn));
                    }
                }
            }
        }
        for ((k, m), (t, l)) in out.iter_mut().zip(&slopes).zip(at) {
            // Moved back to the overlap from outside, which bounds the linear extrapolation.
            k.t = self.level_at(*t, within(*l, self.map.overlap()));
            if let NodalLevel::Nodes(of) = &self.level {
                k.slope_t = linear_slope(m, of, self.map.tet(*t));
            }
            if let Some(eased) = &self.eased {
                k.eased = self.linear(&eased.at_nodes, *t, within(*l, 0.0)) - 1.0;
                k.slope_eased = linear_slope(m, &eased.at_nodes, self.map.tet(*t));
            }
        }
        out
    }

    fn known(&self, points: &[Vec3]) -> Vec<Known> {
        self.found(points, true)
    }

    fn found(&self, points: &[Vec3], sloped: bool) -> Vec<Known> {
        let overlap = self.map.overlap();
        if overlap <= 0.0 {
            let at: Vec<(usize, Bary)> = points.iter().map(|p| self.map.locate(*p)).collect();
            return self.known_in(&at, sloped);
        }
        let (mut at, mut ends) = (Vec::new(), Vec::with_capacity(points.len()));
        for p in points {
            self.map.each_near(*p, |t, l| at.push((t, l)));
            ends.push(at.len());
        }
        let each = self.known_in(&at, sloped);
        let mut first = 0;
        let mean = |end: &usize| {
            let here = first..*end;
            first = *end;
            if here.len() == 1 {
                return each[here.start];
            }
            // Σ w k / Σ w with w = Π b(λ_i), b rising smoothly from 0 at −overlap to 1 at overlap.
            let (mut sum, mut weight, mut slope) = (Known::default(), 0.0, [0.0; 3]);
            let mut crossed = [0.0; 3].map(|_: f64| [0.0; 3]);
            for i in here {
                let (t, l) = at[i];
                let (w, dw) = self.bump(t, l);
                let k = &each[i];
                sum.f += w * k.f;
                sum.t += w * k.t;
                sum.slope = add(sum.slope, scale(k.slope, w));
                sum.slope_t = add(sum.slope_t, scale(k.slope_t, w));
                crossed[0] = add(crossed[0], scale(dw, k.f));
                crossed[1] = add(crossed[1], scale(dw, k.t));
                sum.eased += w * k.eased;
                sum.slope_eased = add(sum.slope_eased, scale(k.slope_eased, w));
                crossed[2] = add(crossed[2], scale(dw, k.eased));
                weight += w;
                slope = add(slope, dw);
            }
            let mean = |v: f64, s: Vec3, cross: Vec3| {
                let v = v / weight;
                (v, scale(add(add(s, cross), scale(slope, -v)), 1.0 / weight))
            };
            let (f, slope) = mean(sum.f, sum.slope, crossed[0]);
            let (t, slope_t) = mean(sum.t, sum.slope_t, crossed[1]);
            let (eased, slope_eased) = mean(sum.eased, sum.slope_eased, crossed[2]);
            Known { f, slope, t, slope_t, eased, slope_eased }
        };
        ends.iter().map(mean).collect()
    }

    /// The weight of a tetrahedron at a point, and its gradient.
    fn bump(&self, t: usize, l: Bary) -> (f64, Vec3) {
        let d = self.map.overlap();
        let rise = |v: f64| {
            let z = ((v + d) / (2.0 * d)).clamp(0.0, 1.0);
            let up = z * z * z * (10.0 + z * (6.0 * z - 15.0));
            (up, 30.0 * z * z * (1.0 - z) * (1.0 - z) / (2.0 * d))
        };
        let b = l.map(rise);
        let w = b.iter().map(|v| v.0).product();
        let m = self.map.slopes_at(t, l);
        let last = scale(add(add(m[0], m[1]), m[2]), -1.0);
        let slopes = [m[0], m[1], m[2], last];
        let one = |i: usize| {
            let others: f64 = (0..4).filter(|k| *k != i).map(|k| b[k].0).product();
            scale(slopes[i], b[i].1 * others)
        };
        (w, (0..4).fold([0.0; 3], |s, i| add(s, one(i))))
    }

    /// Fills f and t at points (mm).
    pub fn cores(&self, points: &[Vec3], f: &mut [f64], t: &mut [f64]) {
        for ((f, t), k) in f.iter_mut().zip(t).zip(self.found(points, false)) {
            (*f, *t) = (k.f, k.t);
        }
    }

    /// The solid fraction of the only cell at a level; of the blended function in the whole mesh where tetrahedra overlap.
    pub fn fraction(&self, t: f64) -> f64 {
        match &self.blended {
            Some(table) => table.fraction(self.part, t),
            None => self.cells[0].cell.fraction(self.part, t * self.cells[0].scale),
        }
    }

    /// Whether the level or the weights vary.
    pub fn varies(&self) -> bool {
        matches!(self.level, NodalLevel::Nodes(_)) || self.cells.iter().any(|c| c.weights.is_some())
    }

    /// The level, where it does not vary.
    pub fn uniform(&self) -> Option<f64> {
        match self.level {
            NodalLevel::Same(t) => Some(t),
            NodalLevel::Nodes(_) => None,
        }
    }

    /// The least and greatest level.
    pub fn levels(&self) -> Interval {
        match &self.level {
            NodalLevel::Same(t) => Interval::new(*t, *t),
            NodalLevel::Nodes(of) => self.used(of),
        }
    }

    /// The range over the nodes that tetrahedra use.
    fn used(&self, of: &[f64]) -> Interval {
        let all = (0..self.map.len()).flat_map(|t| self.map.tet(t));
        let (lo, hi) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), n| {
            let v = of[n as usize];
            (l.min(v), h.max(v))
        });
        Interval::new(lo, hi)
    }

    /// The volume of the mesh (mm³), and the solid's, by [`Tiling::shares`].
    pub fn volumes(&self) -> (f64, f64) {
        let shares = self.shares().into_iter().enumerate();
        shares.fold((0.0, 0.0), |(all, solid), (t, share)| {
            let v = self.map.volume(t);
            (all + v, solid + share * v)
        })
    }

    /// The length of a cell's period in tetrahedra of mean edge, mm.
    pub fn wavelength(&self) -> f64 {
        let s = &self.cells[0].cell;
        let edge = norm(geometry::math::sub(s.corners()[0], s.corners()[1]));
        self.map.mean_edge() / edge
    }
}

/// The bound of |∇f| in a regular tetrahedron, times its edge. |∇f| ≤ Σ amplitude 2π|h| in phase, times |du/dx|; all tetrahedra of cells
/// are regular, and with edges of another length the Jacobian is that much larger.
fn steepest(cells: &[Share]) -> f64 {
    let own = cells.iter().map(|c| {
        let waves = c.cell.series().terms().iter();
        let sum: f64 = waves.map(|t| t.amplitude.abs() * norm(t.hkl.map(f64::from))).sum();
        core::f64::consts::TAU * sum / c.scale
    });
    let edge = |c: &Share| norm(geometry::math::sub(c.cell.corners()[0], c.cell.corners()[3]));
    own.fold(0.0, f64::max) * cells.iter().map(edge).fold(0.0, f64::max)
}

/// The gradient (per mm) of what is linear in the coordinates of a tetrahedron of these nodes, whose slopes are `m`.
fn linear_slope(m: &Mat3, of: &[f64], nodes: [u32; 4]) -> Vec3 {
    let v = nodes.map(|n| of[n as usize]);
    (0..3).fold([0.0; 3], |s, i| add(s, scale(m[i], v[i] - v[3])))
}

impl Field for Tiling {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, k) in out.iter_mut().zip(self.found(points, false)) {
            *o = self.cut.value(k.f, k.t) * (1.0 + k.eased);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let both = values.iter_mut().zip(gradients);
        for ((v, g), k) in both.zip(self.known(points)) {
            (*v, *g) = self.cut.gradient((k.f, k.slope), (k.t, k.slope_t));
            if self.eased.is_some() {
                *g = add(scale(*g, 1.0 + k.eased), scale(k.slope_eased, *v));
                *v *= 1.0 + k.eased;
            }
        }
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        fill_points(self, block, 0.0, Some(wanted), out);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let most: f64 = self.cells.iter().map(|c| c.cell.series().amplitude() / c.scale).fold(0.0, f64::max);
        // Linear functions exceed the nodes' values within the overlap.
        let beyond = 8.0 * self.map.overlap();
        let spread = |i: Interval| {
            let by = beyond * (i.hi - i.lo);
            Interval::new(i.lo - by, i.hi + by)
        };
        let weighted = self.cells.iter().any(|c| c.weights.is_some());
        let most = most * if weighted { 1.0 + 2.0 * beyond } else { 1.0 };
        let all = Interval::new(-most, most);
        let nothing = Interval::new(f64::INFINITY, f64::NEG_INFINITY);
        let (mut f, mut t) = (nothing, nothing);
        let (middle, reach) = (b.center(), norm(b.size()) / 2.0);
        let mut near: Vec<usize> = Vec::new();
        if b.is_finite() && self.map.each_in(b, MOST, |t| near.push(t)) {
            near.sort_unstable();
            near.dedup();
            let at: Vec<(usize, Bary)> = near.iter().map(|t| (*t, self.map.bary(*t, middle))).collect();
            let here = if weighted { Vec::new() } else { self.known_in(&at, false) };
            for (i, n) in near.iter().enumerate() {
                f = f.union(match here.get(i) {
                    None => all,
                    Some(k) => {
                        let by = self.lipschitz[*n] * reach;
                        Interval::new((k.f - by).max(-most), (k.f + by).min(most))
                    }
                });
                if let NodalLevel::Nodes(of) = &self.level {
                    let v = self.map.tet(*n).map(|n| of[n as usize]);
                    let (lo, hi) = v.iter().fold((v[0], v[0]), |(l, h), x| (l.min(*x), h.max(*x)));
                    t = t.union(spread(Interval::new(lo, hi)));
                }
            }
        } else {
            near.clear();
            f = all;
        }
        let t = match &self.level {
            NodalLevel::Same(v) => Interval::new(*v, *v),
            NodalLevel::Nodes(_) if t.lo <= t.hi => t,
            NodalLevel::Nodes(_) => spread(self.levels()),
        };
        let all = self.cut.bound(f, t);
        let Some(eased) = &self.eased else { return all };
        // Factors are at most one.
        let nodes = near.iter().flat_map(|t| self.map.tet(*t));
        let least = match near[..] {
            [] => eased.at_nodes.iter().copied().fold(1.0, f64::min),
            _ => nodes.map(|n| eased.at_nodes[n as usize]).fold(1.0, f64::min),
        };
        Interval::new(all.lo.min(all.lo * least), all.hi.max(all.hi * least))
    }
}

impl Implicit for Tiling {
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        self.cut.sides(|cut| Tiling { cut, ..self.clone() })
    }

    fn lipschitz(&self) -> f64 {
        let most = self.lipschitz.iter().copied().fold(0.0, f64::max);
        self.eased.as_ref().map_or(most, |eased| eased.limit)
    }
}
