//! Isosurface stuffing: nodes are moved onto the surface and tetrahedra that still cross it are cut.
//!
//! Source: Labelle & Shewchuk, Isosurface Stuffing, ACM Transactions on Graphics 26(3), 2007. Diagonals follow from an
//! order of the edges instead of the parity rule; the result is the same, and it also serves bisected tetrahedra.

use std::cmp::Reverse;
use std::collections::HashMap;

use rayon::prelude::*;

use super::bcc_grid::Grid;
use crate::field::Field;
use geometry::math::Vec3;
use geometry::tetmesh::{EDGES, TetMesh};

/// A node is moved to the crossing of an edge with the surface if it is closer than this fraction of the edge: along an
/// axis, a face diagonal, a body diagonal. The first and the last are those of the paper, for its angle bounds.
const SHARES: [f64; 3] = [0.24999, 0.33, 0.41189];
/// The same at nodes of bisected tetrahedra, as a fraction of the node's shortest edge: tetrahedra could be inverted
/// otherwise.
const LEAST: f64 = 0.35;
/// Edges per parallel task.
const BATCH: usize = 256;

/// A node's side of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Inside,
    On,
    Outside,
}

/// The tetrahedra of the grid inside the region, cut along its surface, and which nodes lie on it.
pub(super) fn stuff(grid: &Grid, region: &dyn Field) -> (TetMesh, Vec<bool>) {
    let mut nodes = grid.positions();
    let values = values(region, &nodes);
    let mut sides: Vec<Side> = values.iter().map(|v| if *v < 0.0 { Side::Inside } else { Side::Outside }).collect();
    let tets: Vec<[u32; 4]> =
        grid.tets.iter().copied().filter(|t| t.iter().any(|n| sides[*n as usize] == Side::Inside)).collect();
    let crossing = crossings(&tets, &sides);
    let cuts = roots(region, &nodes, &values, &crossing);

    let reach = reach(grid, &tets);
    // Each node moves to the nearest of the cuts that are too close to it.
    let mut nearest: HashMap<u32, (f64, usize)> = HashMap::new();
    for (i, ([inside, outside], cut)) in crossing.iter().zip(&cuts).enumerate() {
        let share = SHARES[grid.along(*inside, *outside) as usize];
        let length = (grid.length2(*inside, *outside) as f64).sqrt();
        for (node, fraction) in [(inside, cut.1), (outside, 1.0 - cut.1)] {
            if fraction < share && fraction * length < reach[*node as usize] {
                let here = (fraction * length, i);
                let best = nearest.entry(*node).or_insert(here);
                if here < *best {
                    *best = here;
                }
            }
        }
    }
    for (node, (_, i)) in nearest {
        nodes[node as usize] = cuts[i].0;
        sides[node as usize] = Side::On;
    }
    let mut on: Vec<bool> = sides.iter().map(|s| *s == Side::On).collect();
    let mut names: HashMap<[u32; 2], u32> = HashMap::new();
    for ([inside, outside], cut) in crossing.iter().zip(&cuts) {
        if sides[*inside as usize] == Side::Inside && sides[*outside as usize] == Side::Outside {
            names.insert([*inside, *outside], nodes.len() as u32);
            nodes.push(cut.0);
            on.push(true);
        }
    }
    let mut filler = Filler { grid, sides: &sides, names: &names, out: Vec::with_capacity(tets.len()) };
    for t in &tets {
        filler.fill(*t);
    }
    let mesh = TetMesh { nodes, tets: filler.out, zones: Vec::new() };
    (mesh, on)
}

/// Values at points, on all threads.
pub(super) fn values(field: &dyn Field, points: &[Vec3]) -> Vec<f64> {
    let mut out = vec![0.0; points.len()];
    out.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(o, p)| field.values(p, o));
    out
}

/// How far each node may be moved, in units of the grid; no limit of its own where nothing is bisected.
fn reach(grid: &Grid, tets: &[[u32; 4]]) -> Vec<f64> {
    if !grid.bisected {
        return vec![f64::INFINITY; grid.keys.len()];
    }
    let mut shortest = vec![i64::MAX; grid.keys.len()];
    for t in tets {
        for [a, b] in EDGES {
            let length = grid.length2(t[a], t[b]);
            for n in [t[a], t[b]] {
                shortest[n as usize] = shortest[n as usize].min(length);
            }
        }
    }
    shortest.iter().map(|l| LEAST * (*l as f64).sqrt()).collect()
}

/// The edges with one node inside and one outside, in that order; sorted.
fn crossings(tets: &[[u32; 4]], sides: &[Side]) -> Vec<[u32; 2]> {
    let mut found: Vec<[u32; 2]> = tets
        .iter()
        .flat_map(|t| EDGES.map(|[a, b]| [t[a], t[b]]))
        .filter_map(|[a, b]| match (sides[a as usize], sides[b as usize]) {
            (Side::Inside, Side::Outside) => Some([a, b]),
            (Side::Outside, Side::Inside) => Some([b, a]),
            _ => None,
        })
        .collect();
    found.par_sort_unstable();
    found.dedup();
    found
}

/// The position at which each edge crosses the surface, and its fraction of the edge from the inner node: by false position
/// with halved weights (the Illinois method), which brackets the root.
fn roots(region: &dyn Field, nodes: &[Vec3], values: &[f64], edges: &[[u32; 2]]) -> Vec<(Vec3, f64)> {
    const ROUNDS: usize = 40;
    let mut found = vec![([0.0; 3], 0.0); edges.len()];
    found.par_chunks_mut(BATCH).zip(edges.par_chunks(BATCH)).for_each(|(found, edges)| {
        let at = |e: &[u32; 2], t: f64| -> Vec3 {
            let (p, q) = (nodes[e[0] as usize], nodes[e[1] as usize]);
            core::array::from_fn(|k| p[k] + t * (q[k] - p[k]))
        };
        // For each edge the bracket, and the values at its ends.
        let mut state: Vec<[f64; 4]> =
            edges.iter().map(|[a, b]| [0.0, 1.0, values[*a as usize], values[*b as usize]]).collect();
        let mut last = vec![0i8; edges.len()];
        let mut open: Vec<usize> = (0..edges.len()).collect();
        let (mut points, mut new) = (Vec::new(), Vec::new());
        for round in 0..ROUNDS {
            points.clear();
            let guesses: Vec<f64> = open
                .iter()
                .map(|i| {
                    let [lo, hi, vlo, vhi] = state[*i];
                    // Every eighth round bisects, for fields with discontinuous gradients.
                    let t = if round % 8 == 7 { 0.5 * (lo + hi) } else { lo + (hi - lo) * vlo / (vlo - vhi) };
                    t.clamp(lo, hi)
                })
                .collect();
            points.extend(open.iter().zip(&guesses).map(|(i, t)| at(&edges[*i], *t)));
            new.resize(points.len(), 0.0);
            region.values(&points, &mut new);
            let mut left = Vec::new();
            for ((i, t), v) in open.iter().zip(&guesses).zip(&new) {
                let s = &mut state[*i];
                if *v < 0.0 {
                    (s[0], s[2]) = (*t, *v);
                    if last[*i] == -1 {
                        s[3] *= 0.5;
                    }
                    last[*i] = -1;
                } else {
                    (s[1], s[3]) = (*t, *v);
                    if last[*i] == 1 {
                        s[2] *= 0.5;
                    }
                    last[*i] = 1;
                }
                found[*i] = (at(&edges[*i], *t), *t);
                let scale = values[edges[*i][0] as usize].abs() + values[edges[*i][1] as usize].abs();
                if v.abs() > 1e-12 * scale && s[1] - s[0] > 1e-14 {
                    left.push(*i);
                }
            }
            open = left;
            if open.is_empty() {
                break;
            }
        }
    });
    found
}

/// Cuts tetrahedra.
struct Filler<'a> {
    grid: &'a Grid,
    sides: &'a [Side],
    names: &'a HashMap<[u32; 2], u32>,
    out: Vec<[u32; 4]>,
}

/// A corner of a cut tetrahedron: a node of the uncut one (twice the same), or the cut between an inner and an outer one.
type Corner = [usize; 2];

impl Filler<'_> {
    fn fill(&mut self, t: [u32; 4]) {
        let sides = t.map(|n| self.sides[n as usize]);
        let of = |side: Side| -> Vec<usize> { (0..4).filter(|k| sides[*k] == side).collect() };
        let (inside, on, outside) = (of(Side::Inside), of(Side::On), of(Side::Outside));
        let node = |k: usize| [k, k];
        match (inside.as_slice(), on.as_slice(), outside.as_slice()) {
            ([], _, _) => {}
            (_, _, []) => self.out.push(t),
            ([a], _, _) => {
                let cut = core::array::from_fn(|k| if outside.contains(&k) { [*a, k] } else { node(k) });
                self.emit(t, cut);
            }
            (&[a, b], &[z], &[d]) => {
                let [a, b] = self.ordered(t, [[a, d], [b, d]]);
                self.emit(t, [node(a), node(b), node(z), [a, d]]);
                self.emit(t, [node(b), node(z), [a, d], [b, d]]);
            }
            (&[a, b, c], _, &[d]) => {
                let mut order = [a, b, c];
                order.sort_by_key(|x| Reverse(self.rank(t, [*x, d])));
                let [a, b, c] = order;
                self.emit(t, [node(a), node(b), node(c), [a, d]]);
                self.emit(t, [node(b), node(c), [a, d], [b, d]]);
                self.emit(t, [node(c), [a, d], [b, d], [c, d]]);
            }
            (&[a, b], _, &[c, d]) => {
                // The diagonals in the faces a b c and a b d begin at the cut of the longer edge.
                let [p, q] = [self.ordered(t, [[a, c], [b, c]]), self.ordered(t, [[a, d], [b, d]])];
                let [a, b] = p;
                if p == q {
                    self.emit(t, [node(a), [a, c], [a, d], node(b)]);
                    self.emit(t, [node(b), [a, c], [a, d], [b, d]]);
                    self.emit(t, [node(b), [a, c], [b, d], [b, c]]);
                } else {
                    self.emit(t, [node(a), node(b), [a, c], [b, d]]);
                    self.emit(t, [node(a), [a, c], [a, d], [b, d]]);
                    self.emit(t, [node(b), [a, c], [b, c], [b, d]]);
                }
            }
            _ => {}
        }
    }

    /// The rank of a crossed edge: length, then the index of the inner node. It is the same in every
    /// tetrahedron that has the edges, and so are the diagonals that follow from it.
    fn rank(&self, t: [u32; 4], [inside, outside]: [usize; 2]) -> (i64, u32) {
        (self.grid.length2(t[inside], t[outside]), t[inside])
    }

    /// The inner nodes of two crossed edges, that of the greater rank first.
    fn ordered(&self, t: [u32; 4], [e, f]: [[usize; 2]; 2]) -> [usize; 2] {
        if self.rank(t, e) > self.rank(t, f) { [e[0], f[0]] } else { [f[0], e[0]] }
    }

    /// Adds a cut tetrahedron, oriented as the uncut one is.
    fn emit(&mut self, t: [u32; 4], cut: [Corner; 4]) {
        let name = |[i, o]: Corner| {
            if i == o { t[i] } else { self.names[&[t[i], t[o]]] }
        };
        let mut nodes = cut.map(name);
        if turned(cut) {
            nodes.swap(2, 3);
        }
        self.out.push(nodes);
    }
}

/// Whether a cut tetrahedron is oriented against the uncut one: the sign of the determinant of its corners' barycentric
/// coordinates, which does not depend on the positions of the cuts on their edges.
fn turned(cut: [Corner; 4]) -> bool {
    let row = |[i, o]: Corner| {
        let mut r = [0.0; 4];
        r[i] += 1.0;
        r[o] += 1.0;
        r
    };
    let r = cut.map(row);
    let d = |k: usize| -> Vec3 { core::array::from_fn(|c| r[k][c + 1] - r[0][c + 1]) };
    geometry::math::determinant(&[d(1), d(2), d(3)]) < 0.0
}
