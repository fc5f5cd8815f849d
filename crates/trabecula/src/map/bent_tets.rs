//! Curved tetrahedra: the boundary edges of a mesh bent onto the surface of a region.
//!
//! In a tetrahedron with corners p and barycentric coordinates λ the position is x = Σ λ_i p_i + Σ 4 λ_i λ_j δ_ij, the second sum over
//! its edges. δ is the way from the middle of an edge to the surface, and zero of edges inside the mesh; on a common face
//! two tetrahedra have the same edges, hence the same positions.
//!
//! *One to one.* With π the nearest point of the tetrahedron in the metric of barycentric coordinates (that of a regular one), and
//! the second sum of π(λ) taken outside too, x ↦ λ is the fixed point of λ ← λ₀(x) − A(π(λ)), λ₀ and A being the two sums in
//! coordinates. The derivative of A is linear in λ, so its norm is greatest at a corner; it is kept below `MOST`, δ being
//! reduced where it is not. Since π does not expand, the iteration contracts everywhere: each tetrahedron's coordinates are defined in
//! all of space, with a Lipschitz constant at most 1/(1 − κ) times that of the flat one.

use super::surface_feet::EdgeFaces;
use crate::region::Region;
use geometry::math::{IDENTITY, Mat3, Vec3, add, apply, dot, inverse, scale, spectral_norm, transpose};
use geometry::tetmesh::EDGES;

/// The greatest norm κ of the derivative of A.
pub(super) const MOST: f64 = 0.85;
/// The distance of the bent boundary from the surface, in edges, up to which it follows it, and the share of the boundary
/// that may be farther off in a mesh of the region: where the part is finer than the tetrahedra, in places of every scan.
pub(super) const FIT: f64 = 0.1;
const MISFIT: f64 = 0.02;
/// Iterations of the inverse, and the change at which it has converged.
const ROUNDS: usize = 200;
const NEAR: f64 = 1e-13;

/// In the place of the number of a tetrahedron that is not bent.
pub(super) const FLAT: u32 = u32::MAX;

/// An edge of the mesh's boundary.
pub(crate) struct SurfaceEdge {
    /// Its nodes, ascending.
    pub nodes: [u32; 2],
    /// Its two faces.
    pub faces: EdgeFaces,
}

/// How the tetrahedra at the boundary are bent.
pub(crate) struct Curves {
    /// The region whose surface they meet.
    pub region: Region,
    /// The edges of the boundary, ascending.
    pub edges: Vec<SurfaceEdge>,
    /// Number of each tetrahedron in `bent`, or [`FLAT`].
    pub(super) index: Vec<u32>,
    pub(super) bent: Vec<Bent>,
    /// Greatest distance of the bent boundary from the region's surface at middles of faces and quarters of edges, in edges.
    pub off: f64,
    /// Where it is so far off.
    pub off_at: Vec3,
    /// The share of these places that are farther off than `FIT`.
    pub(super) misfit: f64,
}

/// A bent tetrahedron.
pub(super) struct Bent {
    /// δ of each edge, mm, and in barycentric coordinates.
    moved: [Vec3; 6],
    shift: [[f64; 4]; 6],
    /// The norm κ.
    pub(super) contraction: f64,
    /// How far it reaches beyond each of its flat faces, and how far any of its points is moved at most, in barycentric coordinates.
    reach: [f64; 4],
    sway: [f64; 4],
}

/// The nearest point to `l` of all whose coordinates are at least −`by` and whose sum is one.
pub(crate) fn within(l: [f64; 4], by: f64) -> [f64; 4] {
    if l.iter().all(|v| *v >= -by) {
        return l;
    }
    let sorted = descending(l.map(|v| v + by));
    let (mut sum, mut cut) = (-(1.0 + 4.0 * by), 0.0);
    for (k, v) in sorted.into_iter().enumerate() {
        sum += v;
        let here = sum / (k + 1) as f64;
        if v > here {
            cut = here;
        }
    }
    l.map(|v| (v + by - cut).max(0.0) - by)
}

/// Four numbers, the greatest first.
fn descending(mut v: [f64; 4]) -> [f64; 4] {
    for (i, j) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
        (v[i], v[j]) = (v[i].max(v[j]), v[i].min(v[j]));
    }
    v
}

impl Bent {
    /// Of the gradients of the first three coordinates, and δ of each edge.
    pub(super) fn new(m: &Mat3, moved: [Vec3; 6]) -> Bent {
        let shift = moved.map(|d| {
            let l = [dot(m[0], d), dot(m[1], d), dot(m[2], d)];
            [l[0], l[1], l[2], -l[0] - l[1] - l[2]]
        });
        // An orthonormal basis of the directions of barycentric coordinates, whose sum is zero.
        const B: [[f64; 4]; 3] = [[0.5, 0.5, -0.5, -0.5], [0.5, -0.5, 0.5, -0.5], [0.5, -0.5, -0.5, 0.5]];
        let at_corner = |v: usize| {
            let out: Mat3 = core::array::from_fn(|r| {
                core::array::from_fn(|c| {
                    let of = EDGES.iter().zip(&shift).filter(|(pair, _)| pair.contains(&v));
                    let one = |(pair, s): (&[usize; 2], &[f64; 4])| {
                        let other = if pair[0] == v { pair[1] } else { pair[0] };
                        4.0 * (0..4).map(|i| B[r][i] * s[i]).sum::<f64>() * B[c][other]
                    };
                    of.map(one).sum()
                })
            });
            spectral_norm(&out)
        };
        let contraction = (0..4).map(at_corner).fold(0.0, f64::max);
        // The hull of the corners and the control points: middles of edges plus 2δ.
        let (mut reach, mut sway) = ([0.0f64; 4], [0.0f64; 4]);
        for (pair, s) in EDGES.iter().zip(&shift) {
            for k in 0..4 {
                let control = 2.0 * s[k] + if pair.contains(&k) { 0.5 } else { 0.0 };
                reach[k] = reach[k].max(-control);
                // 2 λ_i λ_j are shares, together below one.
                sway[k] = sway[k].max(2.0 * s[k].abs());
            }
        }
        Bent { moved, shift, contraction, reach, sway }
    }

    /// The iteration at coordinates `l`, for the flat coordinates `flat`. Its result is large, so a call would cost as much as it does.
    #[inline(always)]
    fn iterate(&self, flat: &[f64; 4], l: [f64; 4]) -> Iterate {
        let nearest = within(l, 0.0);
        let mut columns = [[0.0; 4]; 4];
        for ([i, j], s) in EDGES.iter().zip(&self.shift) {
            for k in 0..4 {
                columns[*i][k] += 4.0 * nearest[*j] * s[k];
                columns[*j][k] += 4.0 * nearest[*i] * s[k];
            }
        }
        // A is of the second degree, so it is half of A′ times the coordinates.
        let by = |k: usize| 0.5 * (0..4).map(|i| nearest[i] * columns[i][k]).sum::<f64>();
        let change = core::array::from_fn(|k| flat[k] - by(k) - l[k]);
        let left = change.iter().map(|x| x * x).sum::<f64>().sqrt();
        Iterate { l, nearest, columns, change, left }
    }
}

/// Coordinates, π of them, the columns of A′ there, by how much the next coordinates differ, and the norm of that.
struct Iterate {
    l: [f64; 4],
    nearest: [f64; 4],
    columns: [[f64; 4]; 4],
    change: [f64; 4],
    left: f64,
}

impl Iterate {
    /// Newton's next coordinates, l + n with n + A′(π(l)) π′(l) n = change. π′ subtracts from the coordinates that π leaves above zero
    /// their mean, and has the others at zero.
    fn newton(&self) -> [f64; 4] {
        let Iterate { l, nearest, columns, change: d, .. } = self;
        let inside = nearest == l;
        let free = nearest.map(|v| f64::from(u8::from(inside || v > 0.0)));
        let mean = 1.0 / free.iter().sum::<f64>();
        // By three of the coordinates; the fourth of a step is minus their sum.
        let mut m: Mat3 = IDENTITY;
        for c in 0..3 {
            let by = (free[c] - free[3]) * mean;
            for k in 0..4 {
                let along = f64::from(u8::from(k == c)) - f64::from(u8::from(k == 3));
                let moved = free[k] * (along - by);
                for (r, row) in m.iter_mut().enumerate() {
                    row[c] += moved * columns[k][r];
                }
            }
        }
        let n = apply(&inverse(&m), [d[0], d[1], d[2]]);
        [l[0] + n[0], l[1] + n[1], l[2] + n[2], l[3] - n[0] - n[1] - n[2]]
    }
}

impl Curves {
    /// Whether the bent boundary is the region's surface within a small share of its edges, in all but few places.
    pub fn fits(&self) -> bool {
        self.misfit <= MISFIT
    }

    fn of(&self, t: usize) -> Option<&Bent> {
        self.bent.get(self.index[t] as usize)
    }

    /// How far (mm) bending moves the point of a tetrahedron whose coordinates are `l`.
    pub fn moved(&self, t: usize, l: [f64; 4]) -> Vec3 {
        let Some(bent) = self.of(t) else { return [0.0; 3] };
        let edges = EDGES.iter().zip(&bent.moved);
        edges.fold([0.0; 3], |s, ([i, j], d)| add(s, scale(*d, 4.0 * l[*i] * l[*j])))
    }

    /// How far a tetrahedron reaches beyond each of its flat faces, in barycentric coordinates.
    pub fn reach(&self, t: usize) -> [f64; 4] {
        self.of(t).map_or([0.0; 4], |b| b.reach)
    }

    /// By how much bending changes each coordinate at most.
    pub fn sway(&self, t: usize) -> [f64; 4] {
        self.of(t).map_or([0.0; 4], |b| b.sway)
    }

    /// Whether a tetrahedron is bent.
    pub fn bends(&self, t: usize) -> bool {
        self.of(t).is_some()
    }

    /// The factor of Lipschitz constants of what is a function of the coordinates.
    pub fn steeper(&self, t: usize) -> f64 {
        self.of(t).map_or(1.0, |b| 1.0 / (1.0 - b.contraction))
    }

    /// The coordinates where those of the flat tetrahedron are `flat`; coordinates with one below `least`, if the right ones have one.
    pub fn bary(&self, t: usize, flat: [f64; 4], least: f64) -> [f64; 4] {
        let Some(bent) = self.of(t) else { return flat };
        let mut at = bent.iterate(&flat, flat);
        for _ in 0..ROUNDS {
            // The fixed point of a contraction is this near.
            let off = at.left / (1.0 - bent.contraction);
            if at.left < NEAR || at.l.iter().any(|v| v + off < least) {
                break;
            }
            // Newton's step, where it contracts more than the iteration is sure to.
            let newton = bent.iterate(&flat, at.newton());
            at = if newton.left < bent.contraction * at.left {
                newton
            } else {
                bent.iterate(&flat, core::array::from_fn(|i| at.l[i] + at.change[i]))
            };
        }
        at.l
    }

    /// The gradients (per mm) of the first three coordinates at coordinates `l`, where the tetrahedron is bent; `to` has the edges from
    /// the fourth corner as columns.
    pub fn slopes(&self, t: usize, l: [f64; 4], to: &Mat3) -> Option<Mat3> {
        let bent = self.of(t)?;
        let l = within(l, 0.0);
        // Rows: ∂x/∂λ_k with λ_3 = 1 − λ_0 − λ_1 − λ_2.
        let mut rows = transpose(to);
        for ([i, j], d) in EDGES.iter().zip(&bent.moved) {
            let partial = |k: usize| {
                if k == *i {
                    l[*j]
                } else if k == *j {
                    l[*i]
                } else {
                    0.0
                }
            };
            for (k, row) in rows.iter_mut().enumerate() {
                *row = add(*row, scale(*d, 4.0 * (partial(k) - partial(3))));
            }
        }
        Some(inverse(&transpose(&rows)))
    }
}
