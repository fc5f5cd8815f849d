//! Holes of a region on a grid, and the lines through them: integer cohomology by a spanning tree.
//!
//! A cochain gives each edge between adjacent nodes a whole number. Closed ones, whose sum round each face is zero, are what a phase
//! may grow by; those that are differences of a function at the nodes say nothing. With zero on a spanning tree a face with one edge
//! that is not known gives it; where there is no such face an edge is a new unknown, and a face whose edges are all known an equation
//! (Dłotko and Specogna, Physics inspired algorithms for (co)homology computations of three-dimensional combinatorial manifolds with
//! boundary, Comput. Phys. Commun. 184, 2013). Carried on through the region's surroundings, the nearest first, a closed cochain is not
//! zero round faces on lines that lie in the middle of holes: the fronts meet there.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::phase_grid::PhaseGrid;
use geometry::progress::checkpoint;
use geometry::union_find::{singles, unite};
use geometry::voxel_distances::distances;

/// Parts of a step that the distances of faces are rounded to, by which they are put in order.
const SHELLS: f64 = 8.0;
/// An edge that is not known.
const UNKNOWN: u32 = u32::MAX;

/// The number of holes, as rings have, of the nodes that are inside, with the edges, faces and cubes between them: by Euler's
/// characteristic, the number of components and that of cavities.
pub(super) fn holes(grid: &PhaseGrid, inside: &[bool]) -> usize {
    if inside.iter().all(|i| *i) || !inside.iter().any(|i| *i) {
        return 0;
    }
    let (shape, strides) = (grid.shape, grid.strides());
    let (mut euler, mut root) = (0i64, singles(grid.len() + 1));
    // All that is outside of the box is one.
    let (beyond, mut separate) = (grid.len() as u32, grid.len() as i64 + 1);
    let mut join = |a: u32, b: u32| separate -= i64::from(unite(&mut root, a, b));
    for n in 0..grid.len() {
        let at = grid.index(n);
        // The corners of the cube above the node, those that there are.
        let fits = |c: usize| (0..3).all(|a| c >> a & 1 == 0 || at[a] + 1 < shape[a]);
        let corner = |c: usize| n + (0..3).map(|a| (c >> a & 1) * strides[a]).sum::<usize>();
        let full = |span: usize| (0..8).filter(|c| c & !span == 0).all(|c| inside[corner(c)]);
        for span in (0..8usize).filter(|s| fits(*s)) {
            if inside[n] && full(span) {
                euler += if span.count_ones() % 2 == 0 { 1 } else { -1 };
            }
        }
        if inside[n] {
            for a in (0..3).filter(|a| at[*a] + 1 < shape[*a] && inside[n + strides[*a]]) {
                join(n as u32, (n + strides[a]) as u32);
            }
        } else if (0..3).any(|a| at[a] == 0 || at[a] + 1 == shape[a]) {
            join(n as u32, beyond);
        }
        // Surroundings hold together across the corners of a cube.
        let mut outside = (0..8).filter(|c| fits(*c)).map(corner).filter(|m| !inside[*m]);
        if let Some(first) = outside.next() {
            outside.for_each(|m| join(first as u32, m as u32));
        }
    }
    // Components of both: b₀ of the region, and of its surroundings one more than there are cavities.
    usize::try_from(separate - 1 - euler).unwrap_or(0)
}

/// A sum of unknowns, each with its factor.
type Form = Vec<(u32, i64)>;

/// Sums of unknowns, each kept once.
struct Forms {
    all: Vec<Form>,
    number: HashMap<Form, u32>,
}

impl Forms {
    fn new() -> Forms {
        Forms { all: vec![Form::new()], number: HashMap::from([(Form::new(), 0)]) }
    }

    fn keep(&mut self, form: Form) -> u32 {
        if let Some(n) = self.number.get(&form) {
            return *n;
        }
        self.all.push(form.clone());
        self.number.insert(form, self.all.len() as u32 - 1);
        self.all.len() as u32 - 1
    }

    /// The number of a sum of forms with signs.
    fn sum(&mut self, of: &[(u32, i64)]) -> u32 {
        if of.iter().all(|(f, _)| *f == 0) {
            return 0;
        }
        let mut sum = BTreeMap::new();
        for (f, sign) in of {
            for (unknown, factor) in &self.all[*f as usize] {
                *sum.entry(*unknown).or_insert(0) += sign * factor;
            }
        }
        self.keep(sum.into_iter().filter(|(_, factor)| *factor != 0).collect())
    }
}

/// A cochain on the edges of a grid that is not known yet everywhere. Edge 3 n + a goes from node n along axis a; face 3 n + c is at
/// right angles to axis c above node n.
struct Cochain<'a> {
    grid: &'a PhaseGrid,
    /// For each node its distance from the region in parts of a step; 0 is the region.
    shell: &'a [u32],
    edges: Vec<u32>,
    forms: Forms,
    /// Faces by shell that may have one unknown edge.
    waiting: Vec<Vec<u32>>,
    /// The first shell that may have any.
    low: usize,
}

impl Cochain<'_> {
    /// The four edges of a face with their signs round it.
    fn round(&self, face: usize) -> [(usize, i64); 4] {
        let (n, c) = (face / 3, face % 3);
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        let s = self.grid.strides();
        [(3 * n + a, 1), (3 * (n + s[a]) + b, 1), (3 * (n + s[b]) + a, -1), (3 * n + b, -1)]
    }

    /// The shell of a face: the sum of those of its nodes. `None` where the grid has no such face.
    fn shell_of(&self, face: usize) -> Option<u32> {
        let (n, c) = (face / 3, face % 3);
        let (at, s) = (self.grid.index(n), self.grid.strides());
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        let there = at[a] + 1 < self.grid.shape[a] && at[b] + 1 < self.grid.shape[b];
        there.then(|| {
            let of = |m: usize| self.shell[m];
            of(n) + of(n + s[a]) + of(n + s[b]) + of(n + s[a] + s[b])
        })
    }

    /// The shell of an edge; `None` where the grid has no such edge.
    fn shell_of_edge(&self, edge: usize) -> Option<u32> {
        let (n, a) = (edge / 3, edge % 3);
        let there = self.grid.index(n)[a] + 1 < self.grid.shape[a];
        there.then(|| self.shell[n] + self.shell[n + self.grid.strides()[a]])
    }

    /// Gives an edge its form, and lets the faces about it wait.
    fn set(&mut self, edge: usize, form: u32) {
        self.edges[edge] = form;
        let (n, a) = (edge / 3, edge % 3);
        let (at, s) = (self.grid.index(n), self.grid.strides());
        for b in [(a + 1) % 3, (a + 2) % 3] {
            let c = 3 - a - b;
            let below = (at[b] > 0).then(|| n - s[b]);
            for m in below.into_iter().chain([n]) {
                if let Some(shell) = self.shell_of(3 * m + c) {
                    self.waiting[shell as usize].push((3 * m + c) as u32);
                    self.low = self.low.min(shell as usize);
                }
            }
        }
    }

    /// Finds edges of faces that have one unknown edge, the nearest first, up to a shell.
    fn fill(&mut self, last: usize) {
        for steps in 1u32.. {
            while self.low <= last && self.waiting[self.low].is_empty() {
                self.low += 1;
            }
            let Some(face) = (self.low <= last).then(|| self.waiting[self.low].pop()).flatten() else { break };
            if steps % 65_536 == 0 {
                checkpoint();
            }
            let round = self.round(face as usize);
            let mut unknown = round.iter().filter(|(e, _)| self.edges[*e] == UNKNOWN);
            let (Some(&(edge, sign)), None) = (unknown.next(), unknown.next()) else { continue };
            let rest = round.map(|(e, s)| (if e == edge { 0 } else { self.edges[e] }, -s * sign));
            let form = self.forms.sum(&rest);
            self.set(edge, form);
        }
    }

    /// The sum round a face.
    fn circulation(&mut self, face: usize) -> u32 {
        let each = self.round(face).map(|(e, s)| (self.edges[e], s));
        self.forms.sum(&each)
    }
}

/// The closed cochains of a region, carried on through all of the grid.
pub(super) struct Cohomology {
    /// How many there are that are no combination of others.
    pub holes: usize,
    /// Faces, 3 n + c at right angles to axis c above node n, round which cochains are not zero: what each is round them, in the sense
    /// of the axis.
    pub pierced: BTreeMap<usize, Vec<i64>>,
}

/// The closed cochains of the nodes that are inside, with the edges, faces and cubes between them.
pub(super) fn cohomology(grid: &PhaseGrid, inside: &[bool]) -> Cohomology {
    let distance = distances(inside, grid.shape, grid.step);
    let width = grid.step.into_iter().fold(f64::INFINITY, f64::min) / SHELLS;
    let shells: Vec<u32> = distance.iter().map(|d| (d / width).ceil().min(1e5) as u32).collect();
    let last = 4 * shells.iter().copied().max().unwrap_or(0) as usize;
    let mut c = Cochain {
        grid,
        shell: &shells,
        edges: vec![UNKNOWN; 3 * grid.len()],
        forms: Forms::new(),
        waiting: vec![Vec::new(); last + 1],
        low: 0,
    };
    plant(&mut c, &distance);
    // The region: where it stops an edge is a new unknown.
    c.fill(0);
    let mut unknowns = 0;
    for edge in 0..c.edges.len() {
        if c.edges[edge] == UNKNOWN && c.shell_of_edge(edge) == Some(0) {
            let form = c.forms.keep(vec![(unknowns, 1)]);
            unknowns += 1;
            c.set(edge, form);
            c.fill(0);
        }
    }
    let mut equations = BTreeSet::new();
    for face in 0..c.edges.len() {
        if c.shell_of(face) == Some(0) {
            equations.insert(c.circulation(face));
        }
    }
    equations.remove(&0);
    let free = kernel(unknowns as usize, equations.iter().map(|e| &c.forms.all[*e as usize]));
    // Its surroundings: where it stops an edge is zero.
    c.fill(last);
    let mut left: Vec<usize> =
        (0..c.edges.len()).filter(|e| c.edges[*e] == UNKNOWN && c.shell_of_edge(*e).is_some()).collect();
    left.sort_by_key(|e| c.shell_of_edge(*e));
    for edge in left {
        if c.edges[edge] == UNKNOWN {
            c.set(edge, 0);
            c.fill(last);
        }
    }
    let mut pierced = BTreeMap::new();
    for face in (0..c.edges.len()).filter(|f| f / 3 < grid.len()) {
        if c.shell_of(face).is_none_or(|s| s == 0) {
            continue;
        }
        let form = c.circulation(face) as usize;
        let of = |column: &Vec<i64>| c.forms.all[form].iter().map(|(u, f)| f * column[*u as usize]).sum();
        let each: Vec<i64> = free.iter().map(of).collect();
        if each.iter().any(|v| *v != 0) {
            pierced.insert(face, each);
        }
    }
    Cohomology { holes: free.len(), pierced }
}

/// A spanning forest with zero on its edges: in the region breadth first, outside each node with its neighbour nearest to the region.
fn plant(c: &mut Cochain, distance: &[f64]) {
    let (grid, s) = (c.grid, c.grid.strides());
    let mut planted = vec![false; grid.len()];
    let near = |n: usize| {
        let at = grid.index(n);
        (0..3).flat_map(move |a| {
            let below = (at[a] > 0).then(|| (n - s[a], 3 * (n - s[a]) + a));
            let above = (at[a] + 1 < grid.shape[a]).then(|| (n + s[a], 3 * n + a));
            below.into_iter().chain(above)
        })
    };
    for start in 0..grid.len() {
        if c.shell[start] != 0 || core::mem::replace(&mut planted[start], true) {
            continue;
        }
        let mut queue = std::collections::VecDeque::from([start]);
        while let Some(n) = queue.pop_front() {
            for (m, edge) in near(n) {
                if c.shell[m] == 0 && !core::mem::replace(&mut planted[m], true) {
                    c.set(edge, 0);
                    queue.push_back(m);
                }
            }
        }
    }
    let mut outside: Vec<usize> = (0..grid.len()).filter(|n| c.shell[*n] != 0).collect();
    outside.sort_by(|a, b| distance[*a].total_cmp(&distance[*b]).then(a.cmp(b)));
    for n in outside {
        let best = near(n).filter(|(m, _)| planted[*m]).min_by(|a, b| distance[a.0].total_cmp(&distance[b.0]));
        if let Some((_, edge)) = best {
            c.set(edge, 0);
        }
        planted[n] = true;
    }
}

/// A basis of the whole numbers for which all equations hold: columns of a unimodular matrix, by Euclid's algorithm.
fn kernel<'a>(unknowns: usize, equations: impl Iterator<Item = &'a Form>) -> Vec<Vec<i64>> {
    let unit = |i: usize| (0..unknowns).map(|j| i64::from(i == j)).collect();
    let mut free: Vec<Vec<i64>> = (0..unknowns).map(unit).collect();
    for equation in equations {
        let value = |c: &Vec<i64>| equation.iter().map(|(u, f)| f * c[*u as usize]).sum::<i64>();
        let mut values: Vec<i64> = free.iter().map(value).collect();
        if let Some(pivot) = reduce(&mut free, &mut values) {
            free.remove(pivot);
        }
    }
    free
}

/// Subtracts columns from each other until one value at most is not zero: its index.
pub(super) fn reduce(columns: &mut [Vec<i64>], values: &mut [i64]) -> Option<usize> {
    loop {
        let least = (0..values.len()).filter(|i| values[*i] != 0).min_by_key(|i| (values[*i].abs(), *i))?;
        let mut done = true;
        for i in (0..values.len()).filter(|i| *i != least) {
            let times = values[i].div_euclid(values[least]);
            if times != 0 {
                values[i] -= times * values[least];
                let by: Vec<i64> = columns[least].clone();
                columns[i].iter_mut().zip(by).for_each(|(c, b)| *c -= times * b);
            }
            done &= values[i] == 0;
        }
        if done {
            return Some(least);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Aabb, Vec3, norm};

    fn grid(n: [usize; 3]) -> PhaseGrid {
        PhaseGrid::over(&Aabb { min: [-1.0; 3], max: [1.0; 3] }, n)
    }

    fn nodes_in(g: &PhaseGrid, f: impl Fn(Vec3) -> f64) -> Vec<bool> {
        (0..g.len()).map(|n| f(g.node(n)) <= 0.0).collect()
    }

    fn ring([x, y, z]: Vec3) -> f64 {
        (x.hypot(y) - 0.6).hypot(z) - 0.2
    }

    /// Rings, plates with holes, frames, cavities: as many holes by Euler's characteristic as closed cochains.
    #[test]
    fn holes_are_counted() {
        let g = grid([25, 27, 23]);
        let slab = |p: Vec3| p[2].abs() - 0.3;
        let drill = |p: Vec3, x: f64| 0.3 - (p[0] - x).hypot(p[1]);
        let edges = |p: Vec3| {
            let mut a = p.map(f64::abs);
            a.sort_by(f64::total_cmp);
            0.6 - a[1]
        };
        type Shape<'a> = (&'a str, usize, Box<dyn Fn(Vec3) -> f64 + 'a>);
        let shapes: [Shape; 7] = [
            ("ball", 0, Box::new(|p| norm(p) - 0.7)),
            ("hollow ball", 0, Box::new(|p| (norm(p) - 0.6).abs() - 0.2)),
            ("ring", 1, Box::new(ring)),
            ("plate with a hole", 1, Box::new(|p| slab(p).max(drill(p, 0.0)))),
            ("plate with two", 2, Box::new(|p| slab(p).max(drill(p, 0.5)).max(drill(p, -0.5)))),
            ("edges of a cube", 5, Box::new(edges)),
            ("hollow ring", 2, Box::new(|p| (((p[0].hypot(p[1]) - 0.6).hypot(p[2])) - 0.25).abs() - 0.09)),
        ];
        for (name, count, f) in shapes {
            let inside = nodes_in(&g, f);
            assert_eq!(holes(&g, &inside), count, "{name}");
            let found = cohomology(&g, &inside);
            assert_eq!(found.holes, count, "{name}");
            assert_eq!(found.pierced.is_empty(), count == 0, "{name}");
            // Lines do not end: what enters a cube leaves it.
            let s = g.strides();
            for n in (0..g.len()).filter(|n| (0..3).all(|a| g.index(*n)[a] + 1 < g.shape[a])) {
                for k in 0..count {
                    let at = |f: usize| found.pierced.get(&f).map_or(0, |v| v[k]);
                    let flow: i64 = (0..3).map(|c| at(3 * (n + s[c]) + c) - at(3 * n + c)).sum();
                    assert_eq!(flow, 0, "{name}");
                }
            }
        }
    }

    #[test]
    fn the_line_through_a_ring_is_its_axis() {
        let g = grid([25, 27, 23]);
        let found = cohomology(&g, &nodes_in(&g, ring));
        let mut through = [0; 23];
        for (face, v) in &found.pierced {
            let p = g.node(face / 3);
            // Within two steps, the ties between nodes as far from the ring left open.
            assert!(p[0].abs() < 0.17 && p[1].abs() < 0.17, "{p:?}");
            if face % 3 == 2 {
                through[g.index(face / 3)[2]] += v[0];
            }
        }
        assert!(through == [1; 23] || through == [-1; 23], "{through:?}");
    }
}
