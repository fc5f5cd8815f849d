//! Nodes of the small tetrahedra where the mesh is bent onto the surface of its region.
//!
//! Nodes on the boundary are on the surface itself. How far those of an edge were moved fades out in its tetrahedra, d((λ_j)/(λ_i + λ_j))
//! (λ_i + λ_j)²; what those of a face were moved besides, r(λ/(1 − λ_k)) (1 − λ_k)²: transfinite interpolation (Gordon and Hall
//! 1973), linear between nodes. On a face inside the mesh both tetrahedra have the same edges, hence the same nodes in all bits.
//!
//! The surface is linear in small tetrahedra, so it stays embedded as long as none of them is turned over. Where one would be, the face's
//! nodes are left where its edges put them, and if that is not enough edges are moved less.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::small_simplices::{Small, Template};
use crate::cell::tet::{Subdivision, SubdivisionNodes};
use crate::map::CarrierMesh;
use crate::map::bent_tets::{Curves, SurfaceEdge};
use crate::map::surface_feet::{edge_feet, feet_facing};
use crate::map::tet_map::NONE;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;
use geometry::tetmesh::EDGES;

/// Moves below this share of an edge are rounding, and the most that are made.
const FLAT: f64 = 1e-9;
const FARTHEST: f64 = 0.45;
/// The least volume of a small tetrahedron, as a share of what it was.
const LEAST: f64 = 0.02;
/// How often edges are moved half as far before they stay straight.
const HALVINGS: usize = 4;
/// Edges that a thread takes at once.
const BATCH: usize = 64;

/// How the nodes of edges and faces of the boundary are moved.
pub(super) struct BentNodes {
    n: usize,
    /// The moves (mm) of all nodes of an edge of the boundary from its lower end, of those that are moved.
    edges: HashMap<[u32; 2], Vec<Vec3>>,
    /// Tetrahedra whose faces have only the nodes that their edges give them.
    stiff: HashSet<u32>,
}

/// The nodes of a bent tetrahedron.
pub(super) struct Places {
    pub nodes: Vec<Vec3>,
    /// The edges, and the faces on the boundary, that are moved, a bit for each.
    edges: u8,
    faces: u8,
}

impl Places {
    /// Whether the simplex on which these coordinates are zero is moved.
    pub fn moved(&self, zero: u8) -> bool {
        let on = |c: usize| zero >> c & 1 == 0;
        let edge = EDGES.iter().enumerate().any(|(e, [a, b])| self.edges >> e & 1 == 1 && on(*a) && on(*b));
        edge || zero == 0 && self.faces != 0 || zero.count_ones() == 1 && self.faces & zero != 0
    }
}

/// What is known at whole numbers from 0 to n, between them.
fn along(of: &[Vec3], x: f64) -> Vec3 {
    let i = (x as usize).min(of.len() - 2);
    let s = x - i as f64;
    add(scale(of[i], 1.0 - s), scale(of[i + 1], s))
}

impl BentNodes {
    /// The moves for small tetrahedra of a template; `None` if the mesh is not bent.
    pub fn new(map: &CarrierMesh, nodes: &SubdivisionNodes, template: &Template) -> Option<BentNodes> {
        let curves = map.curves()?;
        let n = nodes.grid.n;
        let found: Vec<Vec<([u32; 2], Vec<Vec3>)>> =
            curves.edges.par_chunks(BATCH).map(|some| edge_moves(map, curves, some, n)).collect();
        let edges: HashMap<[u32; 2], Vec<Vec3>> = found.into_iter().flatten().collect();
        let mut out = BentNodes { n, edges, stiff: HashSet::new() };
        out.make_sound(map, nodes, template);
        Some(out)
    }

    /// Reduces moves until no small tetrahedron is turned over: of the nodes of faces first, then of edges, after which the
    /// tetrahedra around these are checked again.
    fn make_sound(&mut self, map: &CarrierMesh, nodes: &SubdivisionNodes, template: &Template) {
        let mut halvings: HashMap<[u32; 2], usize> = HashMap::new();
        let mut left = self.touched(map);
        loop {
            checkpoint();
            let sound = |t: &usize| {
                let places = self.places(map, *t, nodes);
                places.is_none_or(|p| upright(&p.nodes, map.flipped(*t), template))
            };
            left = left.into_par_iter().filter(|t| !sound(t)).collect();
            let (stiff, soft): (Vec<usize>, Vec<usize>) = left.iter().partition(|t| self.stiff.contains(&(**t as u32)));
            let wrong: HashSet<[u32; 2]> =
                stiff.iter().flat_map(|t| keys(map, *t)).filter(|key| self.edges.contains_key(key)).collect();
            if soft.is_empty() && wrong.is_empty() {
                return;
            }
            self.stiff.extend(soft.iter().map(|t| *t as u32));
            for key in &wrong {
                let count = halvings.entry(*key).or_default();
                *count += 1;
                if *count > HALVINGS {
                    self.edges.remove(key);
                } else if let Some(moves) = self.edges.get_mut(key) {
                    moves.iter_mut().for_each(|m| *m = scale(*m, 0.5));
                }
            }
            // Those around an edge may be spoilt by its shorter moves, stiff ones too.
            let changed = (0..map.len()).filter(|t| keys(map, *t).iter().any(|key| wrong.contains(key)));
            left = changed.chain(soft).collect();
            left.sort_unstable();
            left.dedup();
        }
    }

    /// The tetrahedra in which nodes may be moved.
    pub fn touched(&self, map: &CarrierMesh) -> Vec<usize> {
        let touched = |t: &usize| map.across(*t).contains(&NONE) || self.edges_of(map, *t) != 0;
        (0..map.len()).filter(touched).collect()
    }

    /// The edges of a tetrahedron that are moved, a bit for each.
    fn edges_of(&self, map: &CarrierMesh, t: usize) -> u8 {
        let keys = keys(map, t);
        (0..6).fold(0, |m, e| m | u8::from(self.edges.contains_key(&keys[e])) << e)
    }

    /// The nodes of the small tetrahedra; `None` where nothing is moved.
    pub fn places(&self, map: &CarrierMesh, t: usize, nodes: &SubdivisionNodes) -> Option<Places> {
        let (keys, corners, n) = (keys(map, t), map.corners(t), self.n as f64);
        let moves: [Option<&Vec<Vec3>>; 6] = core::array::from_fn(|e| self.edges.get(&keys[e]));
        let edges = self.edges_of(map, t);
        let place = |k: &[u16; 4]| {
            let sum = (0..4).fold([0.0; 3], |s, i| add(s, scale(corners[i], f64::from(k[i]))));
            let mut at = sum.map(|v| v / n);
            for ([i, j], moves) in EDGES.iter().zip(moves) {
                let (a, b) = (f64::from(k[*i]), f64::from(k[*j]));
                if let (Some(moves), true) = (moves, a > 0.0 && b > 0.0) {
                    let w = (a + b) / n;
                    at = add(at, scale(along(moves, n * b / (a + b)), w * w));
                }
            }
            at
        };
        let mut out: Vec<Vec3> = nodes.whole.iter().map(place).collect();
        let mut faces = 0;
        let across = map.across(t);
        for face in (0..4).filter(|f| across[*f] == NONE && !self.stiff.contains(&(t as u32))) {
            if let Some(moves) = self.face_moves(map, face, nodes, &out) {
                faces |= 1 << face;
                self.fade(face, nodes, &moves, &mut out);
            }
        }
        (edges != 0 || faces != 0).then_some(Places { nodes: out, edges, faces })
    }

    /// The moves of the inner nodes of a face on to the surface, by node; `None` if they are on it.
    fn face_moves(
        &self,
        map: &CarrierMesh,
        face: usize,
        nodes: &SubdivisionNodes,
        at: &[Vec3],
    ) -> Option<HashMap<usize, Vec3>> {
        let inner = |k: &[u16; 4]| (0..4).all(|i| (k[i] == 0) == (i == face));
        let on: Vec<usize> = (0..at.len()).filter(|i| inner(&nodes.whole[*i])).collect();
        let points: Vec<Vec3> = on.iter().map(|i| at[*i]).collect();
        let region = &*map.curves()?.region;
        let corner = |i: usize| at[nodes.whole.iter().position(|k| usize::from(k[i]) == self.n).unwrap_or(0)];
        let [a, b, c] = [1, 2, 3].map(|i| corner((face + i) % 4));
        let length = norm(sub(a, b));
        let normal = unit(cross(sub(b, a), sub(c, a)));
        let outward = if dot(normal, sub(corner(face), a)) > 0.0 { scale(normal, -1.0) } else { normal };
        let by: Vec<Vec3> = feet_facing(region, &points, &vec![outward; points.len()])
            .iter()
            .zip(&points)
            .map(|(q, p)| sub(*q, *p))
            .collect();
        if by.iter().all(|d| norm(*d) < FLAT * length) {
            return None;
        }
        let reduced = |d: Vec3| {
            let far = norm(d);
            if far.is_finite() { scale(d, (FARTHEST * length / far.max(1e-300)).min(1.0)) } else { [0.0; 3] }
        };
        Some(on.into_iter().zip(by).map(|(i, d)| (i, reduced(d))).collect())
    }

    /// Moves all nodes by the moves of a face, fading out towards the corner opposite.
    fn fade(&self, face: usize, nodes: &SubdivisionNodes, moves: &HashMap<usize, Vec3>, at: &mut [Vec3]) {
        let n = self.n as f64;
        let others: Vec<usize> = (0..4).filter(|i| *i != face).collect();
        let index = |a: usize, b: usize| {
            let mut k = [0usize; 4];
            (k[others[0]], k[others[1]], k[others[2]]) = (a, b, self.n - a - b);
            Subdivision::index(self.n - k[0], k[2] + k[3], k[3])
        };
        for (p, k) in at.iter_mut().zip(&nodes.whole) {
            if others.iter().any(|i| k[*i] == 0) {
                continue;
            }
            let rest = n - f64::from(k[face]);
            let [x, y] = [0, 1].map(|i| f64::from(k[others[i]]) * n / rest);
            let (a, b) = (x as usize, y as usize);
            let (s, t) = (x - a as f64, y - b as f64);
            let weights = if s + t <= 1.0 {
                [(a, b, 1.0 - s - t), (a + 1, b, s), (a, b + 1, t)]
            } else {
                [(a + 1, b + 1, s + t - 1.0), (a, b + 1, 1.0 - s), (a + 1, b, 1.0 - t)]
            };
            let moved = weights
                .iter()
                .filter(|w| w.2 > 0.0 && w.0 + w.1 <= self.n)
                .fold([0.0; 3], |m, (a, b, w)| moves.get(&index(*a, *b)).map_or(m, |d| add(m, scale(*d, *w))));
            *p = add(*p, scale(moved, (rest / n) * (rest / n)));
        }
    }
}

/// The edges of a tetrahedron by their nodes.
fn keys(map: &CarrierMesh, t: usize) -> [[u32; 2]; 6] {
    let ids = map.tet(t);
    EDGES.map(|[i, j]| [ids[i], ids[j]])
}

/// The moves of the nodes of some edges, of those that are moved.
fn edge_moves(map: &CarrierMesh, curves: &Curves, some: &[SurfaceEdge], n: usize) -> Vec<([u32; 2], Vec<Vec3>)> {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for e in some {
        let [a, b] = e.nodes.map(|v| map.nodes()[v as usize]);
        for k in 1..n {
            points.push(add(a, scale(sub(b, a), k as f64 / n as f64)));
            faces.push(e.faces);
        }
    }
    let feet = edge_feet(&*curves.region, &points, &faces);
    let by: Vec<Vec3> = feet.iter().zip(&points).map(|(q, p)| sub(*q, *p)).collect();
    let each = some.iter().zip(by.chunks(n - 1)).filter_map(|(e, by)| {
        let [a, b] = e.nodes.map(|v| map.nodes()[v as usize]);
        let length = norm(sub(a, b));
        let far = by.iter().fold(0.0f64, |m, d| m.max(norm(*d)));
        // A foot on another face of the part moves nothing.
        if !(FLAT * length..=FARTHEST * length).contains(&far) {
            return None;
        }
        let mut all = vec![[0.0; 3]];
        all.extend(by);
        all.push([0.0; 3]);
        Some((e.nodes, all))
    });
    each.collect()
}

/// Whether no small tetrahedron is turned over, or nearly flat.
fn upright(at: &[Vec3], flipped: bool, template: &Template) -> bool {
    let volume = |n: &[u32; 4]| {
        let [a, b, c, d] = n.map(|i| at[i as usize]);
        dot(cross(sub(b, a), sub(c, a)), sub(d, a))
    };
    let signed = |s: &Small| if s.even == flipped { -volume(&s.nodes) } else { volume(&s.nodes) };
    let all: Vec<f64> = template.tets.iter().map(signed).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    mean > 0.0 && all.iter().all(|v| *v > LEAST * mean)
}
