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

use std::collections::HashMap;

use super::surface_feet::{EdgeFaces, edge_feet, feet};
use super::tet_map::{NONE, Tets};
use crate::field::Field;
use crate::region::Region;
use geometry::math::{
    IDENTITY, Mat3, Vec3, add, apply, cross, dot, inverse, norm, scale, spectral_norm, sub, transpose, unit,
};
use geometry::tetmesh::EDGES;

/// The greatest norm κ of the derivative of A.
const MOST: f64 = 0.85;
/// The greatest |δ|, in lengths of the edge: a chord of 140° of a circle.
const FARTHEST: f64 = 0.35;
/// |δ| below this share of the edge is rounding.
const FLAT: f64 = 1e-9;
/// The distance of the bent boundary from the surface, in edges, up to which it follows it, and the share of the boundary
/// that may be farther off in a mesh of the region: where the part is finer than the tetrahedra, in places of every scan.
const FIT: f64 = 0.1;
const MISFIT: f64 = 0.02;
/// Iterations of the inverse, and the change at which it has converged.
const ROUNDS: usize = 200;
const NEAR: f64 = 1e-13;

/// An edge of the mesh's boundary.
pub(crate) struct BoundaryEdge {
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
    pub edges: Vec<BoundaryEdge>,
    /// Number of each tetrahedron in `bent`, or [`NONE`].
    index: Vec<u32>,
    bent: Vec<Bent>,
    /// Greatest distance of the bent boundary from the region's surface at middles of faces and quarters of edges, in edges.
    pub off: f64,
    /// Where it is so far off.
    pub off_at: Vec3,
    /// The share of these places that are farther off than `FIT`.
    misfit: f64,
}

/// A bent tetrahedron.
struct Bent {
    /// δ of each edge, mm, and in barycentric coordinates.
    moved: [Vec3; 6],
    shift: [[f64; 4]; 6],
    /// The norm κ.
    contraction: f64,
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
    fn new(map: &Tets, t: usize, moved: [Vec3; 6]) -> Bent {
        let m = map.slopes(t);
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
    /// Bends the boundary edges of a mesh whose nodes on the boundary are on the surface of a region.
    pub fn new(map: &Tets, region: &Region) -> Curves {
        let edges = boundary_edges(map);
        let ends = |e: &BoundaryEdge| e.nodes.map(|n| map.nodes()[n as usize]);
        let middles: Vec<Vec3> = edges.iter().map(|e| middle(ends(e), 0.5)).collect();
        let faces: Vec<EdgeFaces> = edges.iter().map(|e| e.faces).collect();
        let targets = edge_feet(&**region, &middles, &faces);
        let mut moved: HashMap<[u32; 2], Vec3> = HashMap::with_capacity(edges.len());
        for ((e, p), q) in edges.iter().zip(&middles).zip(&targets) {
            let [a, b] = ends(e);
            let (length, by) = (norm(sub(a, b)), sub(*q, *p));
            let far = norm(by);
            if far > FLAT * length && far.is_finite() {
                moved.insert(e.nodes, scale(by, (FARTHEST * length / far).min(1.0)));
            }
        }
        let mut out = Curves {
            region: region.clone(),
            edges,
            index: vec![NONE; map.len()],
            bent: Vec::new(),
            off: 0.0,
            off_at: [0.0; 3],
            misfit: 0.0,
        };
        out.bend(map, &mut moved);
        let (points, off) = out.distances(map, &moved);
        for (p, off) in points.into_iter().zip(&off).filter(|(_, off)| off.is_finite()) {
            if *off > out.off {
                (out.off, out.off_at) = (*off, p);
            }
        }
        out.misfit = off.iter().filter(|v| **v > FIT).count() as f64 / off.len().max(1) as f64;
        out
    }

    /// Makes the bent tetrahedra, and reduces the bends until all are one to one.
    fn bend(&mut self, map: &Tets, moved: &mut HashMap<[u32; 2], Vec3>) {
        let keys = |t: usize| {
            let n = map.tet(t);
            EDGES.map(|[i, j]| [n[i], n[j]])
        };
        let touched = (0..map.len()).filter(|t| keys(*t).iter().any(|k| moved.contains_key(k)));
        let touched: Vec<usize> = touched.collect();
        let made = |t: usize, moved: &HashMap<[u32; 2], Vec3>| {
            Bent::new(map, t, keys(t).map(|k| moved.get(&k).copied().unwrap_or_default()))
        };
        loop {
            // Bends are reduced together: the least factor of an edge's tetrahedra counts, in whatever order.
            let mut least: HashMap<[u32; 2], f64> = HashMap::new();
            for &t in &touched {
                let kappa = made(t, moved).contraction;
                if kappa > MOST {
                    for k in keys(t).into_iter().filter(|k| moved.contains_key(k)) {
                        let by = least.entry(k).or_insert(1.0);
                        *by = by.min(0.98 * MOST / kappa);
                    }
                }
            }
            if least.is_empty() {
                break;
            }
            for (k, by) in least {
                moved.entry(k).and_modify(|d| *d = scale(*d, by));
            }
        }
        for t in touched {
            self.index[t] = self.bent.len() as u32;
            self.bent.push(made(t, moved));
        }
    }

    /// Places on the bent boundary, at the middles of faces and the quarters of edges, and their distances from the surface, in edges.
    fn distances(&self, map: &Tets, moved: &HashMap<[u32; 2], Vec3>) -> (Vec<Vec3>, Vec<f64>) {
        let at = |n: u32| map.nodes()[n as usize];
        let bend = |a: u32, b: u32| moved.get(&[a.min(b), a.max(b)]).copied().unwrap_or_default();
        let boundary = map.boundary_nodes();
        let (mut points, mut lengths) = (Vec::new(), Vec::new());
        for f in &boundary {
            let length = (0..3).map(|i| norm(sub(at(f[i]), at(f[(i + 1) % 3])))).sum::<f64>() / 3.0;
            let flat = scale(f.iter().fold([0.0; 3], |s, n| add(s, at(*n))), 1.0 / 3.0);
            let bent = (0..3).fold(flat, |p, i| add(p, scale(bend(f[i], f[(i + 1) % 3]), 4.0 / 9.0)));
            points.push(bent);
            lengths.push(length);
        }
        for BoundaryEdge { nodes: [a, b], .. } in &self.edges {
            for s in [0.25, 0.5, 0.75] {
                let flat = middle([at(*a), at(*b)], s);
                points.push(add(flat, scale(bend(*a, *b), 4.0 * s * (1.0 - s))));
                lengths.push(norm(sub(at(*a), at(*b))));
            }
        }
        let mut off = vec![0.0; points.len()];
        self.region.values(&points, &mut off);
        let off = off.iter().zip(lengths).map(|(v, l)| v.abs() / l).collect();
        (points, off)
    }

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

fn middle([a, b]: [Vec3; 2], s: f64) -> Vec3 {
    add(scale(a, 1.0 - s), scale(b, s))
}

/// The edges of the boundary that have two faces, ascending.
pub(crate) fn boundary_edges(map: &Tets) -> Vec<BoundaryEdge> {
    let mut halves: Vec<([u32; 2], [u32; 3])> = Vec::new();
    for f in map.boundary_nodes() {
        for i in 0..3 {
            let (a, b) = (f[i], f[(i + 1) % 3]);
            halves.push(([a.min(b), a.max(b)], f));
        }
    }
    halves.sort_unstable();
    let third = |f: [u32; 3]| scale(f.iter().fold([0.0; 3], |s, n| add(s, map.nodes()[*n as usize])), 1.0 / 3.0);
    let normal = |f: [u32; 3]| {
        let [a, b, c] = f.map(|n| map.nodes()[n as usize]);
        unit(cross(sub(b, a), sub(c, a)))
    };
    let edge = |pair: &[([u32; 2], [u32; 3])]| match pair {
        [(nodes, f), (_, g)] => {
            let outward = unit(add(normal(*f), normal(*g)));
            Some(BoundaryEdge { nodes: *nodes, faces: EdgeFaces { middles: [third(*f), third(*g)], outward } })
        }
        _ => None,
    };
    halves.chunk_by(|a, b| a.0 == b.0).filter_map(edge).collect()
}

/// The nodes of a mesh, those on the boundary that are a little off the surface of a region moved onto it, where all
/// tetrahedra keep at least half their volume.
pub(crate) fn settled(map: &Tets, region: &dyn Field) -> Vec<Vec3> {
    let boundary = map.boundary_nodes();
    let old = map.nodes();
    let mut shortest: HashMap<u32, f64> = HashMap::new();
    for f in &boundary {
        for i in 0..3 {
            let length = norm(sub(old[f[i] as usize], old[f[(i + 1) % 3] as usize]));
            for n in [f[i], f[(i + 1) % 3]] {
                let s = shortest.entry(n).or_insert(length);
                *s = s.min(length);
            }
        }
    }
    let mut on: Vec<(u32, f64)> = shortest.into_iter().collect();
    on.sort_unstable_by_key(|n| n.0);
    let points: Vec<Vec3> = on.iter().map(|n| old[n.0 as usize]).collect();
    let mut new = old.to_vec();
    for ((n, length), (p, q)) in on.iter().zip(points.iter().zip(feet(region, &points))) {
        let far = norm(sub(q, *p));
        if far > FLAT * length && far < 0.25 * length {
            new[*n as usize] = q;
        }
    }
    loop {
        let spoilt = |t: &usize| {
            let n = map.tet(*t);
            let volume = |of: &[Vec3]| super::tet_map::volume(n.map(|v| of[v as usize]));
            let (was, is) = (volume(old), volume(&new));
            was * is < 0.5 * was * was
        };
        let bad: Vec<usize> = (0..map.len()).filter(spoilt).collect();
        if bad.is_empty() {
            return new;
        }
        for n in bad.into_iter().flat_map(|t| map.tet(t)) {
            new[n as usize] = old[n as usize];
        }
    }
}
