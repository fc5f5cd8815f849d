//! The smooth patches of a mesh, as far as a grid of some step can tell them apart.
//!
//! Triangles are of one patch if they meet without a crease between them. A crease that fades out inside a patch divides
//! it all the same: what grows from its two sides never joins. Patches too narrow for the grid go to a neighbour.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};

use super::check::Pairs;
use super::edges::Sets;
use super::tree::normal;
use crate::math::{Vec3, cross, dot, norm, sub};
use crate::mesh::Mesh;

/// The least turn of the normal across a crease, radians (25°). Below it a rounded edge is off by a twentieth of a step.
pub const TURN: f64 = 0.436;
/// Patches narrower than this many steps do without faces of their own.
const NARROW: f64 = 3.0;
/// Creases within a patch divide it if they are at least this long and this far from each other on average, in steps:
/// others are noise.
const LONG: f64 = 4.0;

/// A border between patches is one if it turns enough over most of its length, or much more than that in part: others
/// are noise.
const MOSTLY: f64 = 0.6;
const MUCH: (f64, f64) = (0.785, 0.3);
/// Nor is it one if it zigzags: by more than this on average at its vertices, radians, if there are at least so many.
const ZIGZAG: (f64, usize) = (0.5, 9);
/// Many creases that are no farther from each other than so many steps are noise, too.
const MANY: usize = 40;
const DENSE: f64 = 5.0;

/// An edge between two triangles.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Its half-edges: 3 · triangle + corner where it begins.
    pub halves: [u32; 2],
    /// How far the normal turns across it, radians; positive where the solid is convex.
    pub turn: f64,
    length: f64,
}

impl Edge {
    fn triangles(&self) -> [u32; 2] {
        self.halves.map(|h| h / 3)
    }
}

/// The patches of a mesh.
pub struct Patches {
    /// The patch of each triangle.
    pub of: Vec<u32>,
    /// How many there are.
    pub count: usize,
    /// The edges between patches.
    pub borders: Vec<Edge>,
}

/// The patches of a closed mesh, whose half-edges `pairs` gives, for a grid of some step (mm); `None` if there is no
/// crease that it can see.
pub fn patches(mesh: &Mesh, pairs: &Pairs, step: f64) -> Option<Patches> {
    let normals: Vec<_> = (0..mesh.triangles.len())
        .map(|i| normal(mesh.corners(i)))
        .collect();
    let edge = |halves: &[u32; 2]| {
        let [a, b] = halves.map(|h| (h as usize / 3, h as usize % 3));
        let (n, m) = (normals[a.0], normals[b.0]);
        let (p, q) = (mesh.corners(a.0), mesh.corners(b.0));
        let turn = norm(cross(n, m)).atan2(dot(n, m));
        // The far corner of the other triangle lies below the plane of this one.
        let convex = dot(n, sub(q[(b.1 + 2) % 3], p[a.1])) <= 0.0;
        Edge {
            halves: *halves,
            turn: if convex { turn } else { -turn },
            length: norm(sub(p[(a.1 + 1) % 3], p[a.1])),
        }
    };
    let edges: Vec<Edge> = pairs.iter().map(edge).collect();
    let mut sets = Sets::new(mesh.triangles.len());
    for e in edges.iter().filter(|e| e.turn.abs() < TURN) {
        let [a, b] = e.triangles();
        sets.join(a, b);
    }
    let (mut of, count) = sets.numbers();
    if edges.iter().all(|e| e.turn.abs() < TURN) {
        return None;
    }
    let count = divide(mesh, &edges, &mut of, count, step);
    merge(mesh, &edges, &mut of, count, step);
    while let Some(joined) = faint(mesh, &edges, &of, step) {
        for p in &mut of {
            *p = joined[*p as usize];
        }
    }
    part(mesh, &edges, &mut of, step);
    let mut numbers = HashMap::new();
    for p in &mut of {
        let next = numbers.len() as u32;
        *p = *numbers.entry(*p).or_insert(next);
    }
    let between = |e: &&Edge| {
        let [a, b] = e.triangles();
        of[a as usize] != of[b as usize]
    };
    let borders: Vec<Edge> = edges.iter().filter(between).copied().collect();
    let length: f64 = borders.iter().map(|e| e.length).sum();
    if numbers.len() > MANY && length * DENSE * step > mesh.area() {
        return None;
    }
    (!borders.is_empty()).then_some(Patches {
        of,
        count: numbers.len(),
        borders,
    })
}

fn area(mesh: &Mesh, i: usize) -> f64 {
    let [a, b, c] = mesh.corners(i);
    norm(cross(sub(b, a), sub(c, a))) / 2.0
}

/// Divides patches along the creases within them; gives the new number of patches.
fn divide(mesh: &Mesh, edges: &[Edge], of: &mut [u32], count: usize, step: f64) -> usize {
    let same = |e: &Edge| {
        let [a, b] = e.triangles().map(|t| of[t as usize]);
        (a == b).then_some(a as usize)
    };
    let mut lengths = vec![0.0; count];
    for e in edges.iter().filter(|e| e.turn.abs() >= TURN) {
        if let Some(p) = same(e) {
            lengths[p] += e.length;
        }
    }
    let mut areas = vec![0.0; count];
    for i in 0..of.len() {
        areas[of[i] as usize] += area(mesh, i);
    }
    let divided: Vec<bool> = lengths
        .iter()
        .zip(&areas)
        .map(|(l, a)| *l >= LONG * step && l * LONG * step <= *a)
        .collect();
    if !divided.contains(&true) {
        return count;
    }
    let inside: Vec<&Edge> = edges
        .iter()
        .filter(|e| same(e).is_some_and(|p| divided[p]))
        .collect();
    let strong = inside.iter().filter(|e| e.turn.abs() >= TURN);
    let apart: Vec<[u32; 2]> = strong.clone().map(|e| e.triangles()).collect();
    let from: Vec<u32> = strong.flat_map(|e| ends(mesh, e)).collect();
    let mut sets = Sets::new(of.len());
    grow(mesh, &inside, &from, &apart, &mut sets);
    renumber(&mut sets, of, &divided)
}

/// The patches joined across borders that are no creases for most of their length; `None` if all are.
fn faint(mesh: &Mesh, edges: &[Edge], of: &[u32], step: f64) -> Option<Vec<u32>> {
    let mut corners: HashMap<(u32, u32, u32), Vec<Vec3>> = HashMap::new();
    let mut borders: HashMap<(u32, u32), [f64; 3]> = HashMap::new();
    for e in edges {
        let [a, b] = e.triangles().map(|t| of[t as usize]);
        if a != b {
            let lengths = borders.entry((a.min(b), a.max(b))).or_default();
            for (l, least) in lengths.iter_mut().zip([0.0, TURN, MUCH.0]) {
                *l += if e.turn.abs() >= least { e.length } else { 0.0 };
            }
            if e.turn.abs() >= TURN {
                let [v, w] = ends(mesh, e);
                let along = sub(mesh.vertices[w as usize], mesh.vertices[v as usize]);
                let pair = (a.min(b), a.max(b));
                corners.entry((pair.0, pair.1, v)).or_default().push(along);
                let back = along.map(|x| -x);
                corners.entry((pair.0, pair.1, w)).or_default().push(back);
            }
        }
    }
    let mut bends: HashMap<(u32, u32), (f64, f64, usize)> = HashMap::new();
    for ((a, b, _), ways) in &corners {
        if let [u, v] = ways[..] {
            let bend = norm(cross(u, v)).atan2(-dot(u, v));
            let weight = norm(u) + norm(v);
            let sum = bends.entry((*a, *b)).or_default();
            sum.0 += weight * bend;
            sum.1 += weight;
            sum.2 += 1;
        }
    }
    let faint = |pair: &(u32, u32), l: &[f64; 3]| {
        l[1] < MOSTLY * l[0] && (l[2] < MUCH.1 * l[0] || l[2] < LONG * step)
            || bends
                .get(pair)
                .is_some_and(|s| s.0 > ZIGZAG.0 * s.1 && s.2 >= ZIGZAG.1)
    };
    let mut sets = Sets::new(of.iter().max().map_or(0, |m| *m as usize + 1));
    let mut any = false;
    for ((a, b), _) in borders.iter().filter(|b| faint(b.0, b.1)) {
        sets.join(*a, *b);
        any = true;
    }
    any.then(|| sets.numbers().0)
}

/// Divides patches that meet another one both in convex and in concave edges: near them each side is a patch of its own.
fn part(mesh: &Mesh, edges: &[Edge], of: &mut [u32], step: f64) {
    // For each patch and neighbour the triangles at their convex and at their concave edges, and the lengths of these.
    type Side = (Vec<u32>, f64);
    let mut sides: HashMap<(u32, u32), [Side; 2]> = HashMap::new();
    let count = of.iter().max().map_or(0, |m| *m as usize + 1);
    let mut areas = vec![0.0; count];
    for i in 0..of.len() {
        areas[of[i] as usize] += area(mesh, i);
    }
    for e in edges.iter().filter(|e| e.turn.abs() >= TURN) {
        let [s, t] = e.triangles();
        let (a, b) = (of[s as usize], of[t as usize]);
        if a != b {
            let larger = areas[a as usize] > areas[b as usize]
                || (areas[a as usize] == areas[b as usize] && a < b);
            let (name, triangle) = if larger { ((a, b), s) } else { ((b, a), t) };
            let side = &mut sides.entry(name).or_default()[usize::from(e.turn < 0.0)];
            side.0.push(triangle);
            side.1 += e.length;
        }
    }
    sides.retain(|_, s| s.iter().all(|side| side.1 >= LONG * step));
    if sides.is_empty() {
        return;
    }
    let mut sides: Vec<_> = sides.into_iter().collect();
    sides.sort_by_key(|s| s.0);
    let mut parted = vec![false; count];
    let mut sets = Sets::new(of.len());
    let (mut apart, mut from) = (Vec::new(), Vec::new());
    for ((patch, _), both) in &sides {
        parted[*patch as usize] = true;
        for (side, _) in both {
            side.iter().for_each(|t| sets.join(side[0], *t));
            from.extend(side.iter().flat_map(|t| mesh.triangles[*t as usize]));
        }
        apart.push([both[0].0[0], both[1].0[0]]);
    }
    let inside: Vec<&Edge> = edges
        .iter()
        .filter(|e| {
            let [a, b] = e.triangles().map(|t| of[t as usize]);
            a == b && parted[a as usize]
        })
        .collect();
    grow(mesh, &inside, &from, &apart, &mut sets);
    renumber(&mut sets, of, &parted);
}

/// Gives the sets that some patches fall into numbers of their own; how many there are then.
fn renumber(sets: &mut Sets, of: &mut [u32], divided: &[bool]) -> usize {
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    for i in 0..of.len() {
        if divided[of[i] as usize] {
            let next = (divided.len() + numbers.len()) as u32;
            of[i] = *numbers.entry(sets.root(i as u32)).or_insert(next);
        }
    }
    divided.len() + numbers.len()
}

/// The ends of an edge.
fn ends(mesh: &Mesh, e: &Edge) -> [u32; 2] {
    let (t, k) = (
        mesh.triangles[e.halves[0] as usize / 3],
        e.halves[0] as usize % 3,
    );
    [t[k], t[(k + 1) % 3]]
}

/// Joins triangles across the edges `inside` that are no creases, from the vertices `from` outwards; but never the sets of
/// two triangles that are to stay `apart`.
fn grow(mesh: &Mesh, inside: &[&Edge], from: &[u32], apart: &[[u32; 2]], sets: &mut Sets) {
    // How far the vertices are from the creases, along edges.
    let mut around: HashMap<u32, Vec<(u32, f64)>> = HashMap::new();
    let mut far: HashMap<u32, f64> = HashMap::new();
    let mut queue = BinaryHeap::new();
    for v in from {
        far.insert(*v, 0.0);
        queue.push((Reverse(0u64), *v));
    }
    for e in inside {
        let [a, b] = ends(mesh, e);
        around.entry(a).or_default().push((b, e.length));
        around.entry(b).or_default().push((a, e.length));
    }
    while let Some((Reverse(bits), v)) = queue.pop() {
        // Bits of positive numbers are ordered as they are.
        let d = f64::from_bits(bits);
        if far[&v] < d {
            continue;
        }
        for &(w, length) in around.get(&v).into_iter().flatten() {
            let new = d + length;
            if far.get(&w).is_none_or(|old| new < *old) {
                far.insert(w, new);
                queue.push((Reverse(new.to_bits()), w));
            }
        }
    }
    // Edges at the creases first, the flattest first, so that a border goes on where the crease ends; then outwards.
    let key = |e: &Edge| {
        let [a, b] = ends(mesh, e).map(|v| far.get(&v).copied().unwrap_or(f64::INFINITY));
        if a.min(b) == 0.0 {
            (0, e.turn.abs())
        } else {
            (1, (a + b) * (1.0 + e.turn.abs() / TURN))
        }
    };
    let mut order: Vec<((u8, f64), &Edge)> = inside
        .iter()
        .filter(|e| e.turn.abs() < TURN)
        .map(|e| (key(e), *e))
        .collect();
    order.sort_by(|a, b| a.0.0.cmp(&b.0.0).then(a.0.1.total_cmp(&b.0.1)));
    let mut enemies: HashMap<u32, HashSet<u32>> = HashMap::new();
    for pair in apart {
        let [a, b] = pair.map(|t| sets.root(t));
        enemies.entry(a).or_default().insert(b);
        enemies.entry(b).or_default().insert(a);
    }
    for (_, e) in order {
        let [a, b] = e.triangles().map(|t| sets.root(t));
        if a == b || enemies.get(&a).is_some_and(|s| s.contains(&b)) {
            continue;
        }
        let others: Vec<u32> = [a, b]
            .iter()
            .filter_map(|r| enemies.remove(r))
            .flatten()
            .collect();
        sets.join(a, b);
        let root = sets.root(a);
        for o in &others {
            if let Some(s) = enemies.get_mut(o) {
                s.remove(&a);
                s.remove(&b);
                s.insert(root);
            }
        }
        if !others.is_empty() {
            enemies.insert(root, others.into_iter().collect());
        }
    }
}

/// A patch while narrow ones are given to their neighbours.
#[derive(Default)]
struct Piece {
    area: f64,
    border: f64,
    /// For each neighbour the length of the common border, and how much of it is flat.
    beside: HashMap<u32, (f64, f64)>,
}

impl Piece {
    /// The width of a rectangle with this area and border.
    fn width(&self) -> f64 {
        let half = self.border / 2.0;
        (half - (half * half - 4.0 * self.area).max(0.0).sqrt()) / 2.0
    }
}

/// Gives patches that are too narrow to the neighbour with the longest and flattest border.
fn merge(mesh: &Mesh, edges: &[Edge], of: &mut [u32], count: usize, step: f64) {
    let mut pieces: Vec<Piece> = Vec::new();
    pieces.resize_with(count, Piece::default);
    for i in 0..of.len() {
        pieces[of[i] as usize].area += area(mesh, i);
    }
    for e in edges {
        let [a, b] = e.triangles().map(|t| of[t as usize]);
        if a == b {
            continue;
        }
        for (p, q) in [(a, b), (b, a)] {
            let piece = &mut pieces[p as usize];
            piece.border += e.length;
            let shared = piece.beside.entry(q).or_default();
            shared.0 += e.length;
            shared.1 += e.length * (1.0 + e.turn.cos()) / 2.0;
        }
    }
    let mut to = Sets::new(count);
    let mut queue: BinaryHeap<(Reverse<u64>, u32)> = BinaryHeap::new();
    let rank = |p: &Piece| Reverse(p.width().to_bits());
    let narrow = |p: &Piece| p.border > 0.0 && p.width() < NARROW * step;
    queue.extend(
        (0..)
            .zip(&pieces)
            .filter(|(_, p)| narrow(p))
            .map(|(i, p)| (rank(p), i)),
    );
    while let Some((order, i)) = queue.pop() {
        let piece = &pieces[i as usize];
        if to.root(i) != i || !narrow(piece) || rank(piece) != order {
            continue;
        }
        let best = piece
            .beside
            .iter()
            .max_by(|a, b| a.1.1.total_cmp(&b.1.1).then(b.0.cmp(a.0)));
        let Some((&other, _)) = best else { continue };
        // The lower number stays, as in the sets.
        let (kept, gone) = (i.min(other), i.max(other));
        to.join(kept, gone);
        let gone_piece = std::mem::take(&mut pieces[gone as usize]);
        let shared = pieces[kept as usize]
            .beside
            .remove(&gone)
            .unwrap_or_default();
        let piece = &mut pieces[kept as usize];
        piece.area += gone_piece.area;
        piece.border += gone_piece.border - 2.0 * shared.0;
        for (n, s) in gone_piece.beside {
            if n == kept {
                continue;
            }
            for (p, q) in [(kept, n), (n, kept)] {
                let at = pieces[p as usize].beside.entry(q).or_default();
                at.0 += s.0;
                at.1 += s.1;
            }
            pieces[n as usize].beside.remove(&gone);
        }
        let piece = &pieces[kept as usize];
        if narrow(piece) {
            queue.push((rank(piece), kept));
        }
    }
    for p in of.iter_mut() {
        *p = to.root(*p);
    }
}

#[cfg(test)]
mod tests {
    use super::super::check;
    use super::super::tests::{ball, cuboid};
    use super::*;

    fn found(mesh: &Mesh, step: f64) -> Option<(usize, usize)> {
        let pairs = check::edges(mesh).unwrap();
        let p = patches(mesh, &pairs, step)?;
        Some((p.count, p.borders.len()))
    }

    #[test]
    fn patches_are_the_sides_that_a_grid_can_see() {
        let plate = cuboid([0.0; 3], [2.0, 1.0, 0.1]);
        assert_eq!(found(&plate, 0.02), Some((6, 12)));
        // Its rim is narrower than three steps: each side goes to a neighbour, in the end to one of the two that are left.
        assert_eq!(found(&plate, 0.07).unwrap().0, 2);
        // Nothing is left of it at all.
        assert_eq!(found(&plate, 2.0), None);
        assert_eq!(found(&ball(4, 1.0, 0.0), 0.01), None);
    }

    #[test]
    fn a_crease_that_fades_has_a_patch_on_either_side() {
        // A roof whose ridge fades before its end.
        let n = 40;
        let mut mesh = Mesh::default();
        for k in 0..2 * (n + 1) * (n + 1) {
            let [i, j] = [k % (n + 1), k / (n + 1) % (n + 1)].map(|i| f64::from(i) / f64::from(n));
            let top = 1.0 - 0.8 * (1.2 - i) * (j - 0.5).abs();
            let z = if k < (n + 1) * (n + 1) { 0.0 } else { top };
            mesh.vertices.push([i, j, z]);
        }
        let at = |i: u32, j: u32, up: u32| i + (n + 1) * (j + (n + 1) * up);
        let mut quad = |a, b, c, d| mesh.triangles.extend([[a, b, c], [a, c, d]]);
        for i in 0..n {
            quad(at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, 0, 1), at(i, 0, 1));
            quad(at(i, n, 1), at(i + 1, n, 1), at(i + 1, n, 0), at(i, n, 0));
            quad(at(0, i, 1), at(0, i + 1, 1), at(0, i + 1, 0), at(0, i, 0));
            quad(at(n, i, 0), at(n, i + 1, 0), at(n, i + 1, 1), at(n, i, 1));
            for j in 0..n {
                quad(
                    at(i, j, 1),
                    at(i + 1, j, 1),
                    at(i + 1, j + 1, 1),
                    at(i, j + 1, 1),
                );
                quad(
                    at(i, j + 1, 0),
                    at(i + 1, j + 1, 0),
                    at(i + 1, j, 0),
                    at(i, j, 0),
                );
            }
        }
        let p = patches(&mesh, &check::edges(&mesh).unwrap(), 0.02).unwrap();
        assert_eq!(p.count, 7);
        let ridge = p.borders.iter().filter(|e| {
            let ends = ends(&mesh, e).map(|v| mesh.vertices[v as usize]);
            ends.iter().all(|v| v[1] == 0.5 && v[2] > 0.0)
        });
        // It turns by 25 degrees where the slope is 0.22: at 0.92 of the length, which has 40 edges.
        let strong = ridge.clone().filter(|e| e.turn >= TURN).count();
        assert!(
            (35..39).contains(&strong) && ridge.count() == 40,
            "{strong}"
        );
    }
}
