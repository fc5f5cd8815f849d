//! The edges of a mesh that may be broken: the half-edges along each, and counts of them.
//!
//! Half-edge 3t + k runs from corner k of triangle t to the next one. Both directions of an edge are filed under its lower vertex, so that
//! the work is linear in the mesh.

use rayon::prelude::*;

use super::Mesh;
use crate::union_find;

/// Vertices per unit of parallel work.
const CHUNK: usize = 1 << 16;

/// Numbers by the vertex that each belongs to.
struct ByVertex {
    /// Where those of a vertex start; one more at the end.
    start: Vec<usize>,
    values: Vec<u32>,
}

impl ByVertex {
    /// Files pairs (vertex below `n`, number); those of a vertex keep their order.
    fn new<I: Iterator<Item = (u32, u32)>>(n: usize, pairs: impl Fn() -> I) -> ByVertex {
        let mut start = vec![0; n + 1];
        pairs().for_each(|(v, _)| start[v as usize + 1] += 1);
        for v in 0..n {
            start[v + 1] += start[v];
        }
        let mut values = vec![0; start[n]];
        for (v, value) in pairs() {
            values[start[v as usize]] = value;
            start[v as usize] += 1;
        }
        // Each start has become the next one.
        start.copy_within(..n, 1);
        start[0] = 0;
        ByVertex { start, values }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.values[self.start[v]..self.start[v + 1]]
    }

    /// Sorts the numbers of each vertex.
    fn sorted<K: Ord>(mut self, key: impl Fn(&u32) -> K + Sync) -> ByVertex {
        let (n, start, mut rest) = (self.start.len() - 1, &self.start, self.values.as_mut_slice());
        let mut blocks = Vec::new();
        for first in (0..n).step_by(CHUNK) {
            let last = (first + CHUNK).min(n);
            let (block, tail) = rest.split_at_mut(start[last] - start[first]);
            blocks.push((first..last, block));
            rest = tail;
        }
        blocks.into_par_iter().for_each(|(vertices, block)| {
            let from = start[vertices.start];
            vertices.for_each(|v| block[start[v] - from..start[v + 1] - from].sort_by_key(&key));
        });
        self
    }
}

/// The half-edges of triangles, edge by edge.
pub struct Edges<'a> {
    triangles: &'a [[u32; 3]],
    /// Half-edges by the lower vertex of their edge, those of a vertex by the upper one.
    halves: ByVertex,
}

impl<'a> Edges<'a> {
    /// The edges of fewer than 2³²/3 triangles, whatever their order and orientation.
    pub fn of(triangles: &'a [[u32; 3]]) -> Edges<'a> {
        let n = triangles.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        let lower = |h: u32| ends(triangles, h).into_iter().fold(u32::MAX, u32::min);
        let halves = ByVertex::new(n, || (0..3 * triangles.len() as u32).map(|h| (lower(h), h)));
        Edges { triangles, halves: halves.sorted(|h| upper(triangles, *h)) }
    }

    /// The half-edges of each edge, the least first: of the edges in the order of their lower, then of their upper vertices.
    pub fn each(&self) -> impl Iterator<Item = &[u32]> {
        let same = |a: &u32, b: &u32| upper(self.triangles, *a) == upper(self.triangles, *b);
        (0..self.halves.start.len() - 1).flat_map(move |v| self.halves.of(v).chunk_by(same))
    }

    /// The number of half-edges between two vertices, the lower one first.
    pub fn between(&self, a: u32, b: u32) -> usize {
        if a as usize + 1 >= self.halves.start.len() {
            return 0;
        }
        self.halves.of(a as usize).iter().filter(|h| upper(self.triangles, **h) == b).count()
    }
}

/// The ends of half-edge `h`, in its direction.
#[inline]
pub fn ends(triangles: &[[u32; 3]], h: u32) -> [u32; 2] {
    let (t, k) = (triangles[h as usize / 3], h as usize % 3);
    [t[k], t[(k + 1) % 3]]
}

/// Whether half-edge `h` runs from its lower to its higher vertex.
pub fn rises(triangles: &[[u32; 3]], h: u32) -> bool {
    let [a, b] = ends(triangles, h);
    a < b
}

fn upper(triangles: &[[u32; 3]], h: u32) -> u32 {
    let [a, b] = ends(triangles, h);
    a.max(b)
}

/// Half-edges whose edge has one triangle, in order.
pub fn open(mesh: &Mesh) -> Vec<u32> {
    let edges = Edges::of(&mesh.triangles);
    let mut open: Vec<u32> = edges.each().filter(|e| e.len() == 1).map(|e| e[0]).collect();
    open.sort_unstable();
    open
}

/// Components: for each triangle the number of the set that edges (of however many triangles) join, and how many
/// sets there are. Sets are numbered by their first triangles.
pub fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut root = union_find::singles(mesh.triangles.len());
    for pair in Edges::of(&mesh.triangles).each().flat_map(|e| e.windows(2)) {
        union_find::unite(&mut root, pair[0] / 3, pair[1] / 3);
    }
    union_find::labels(&mut root)
}

/// Numbers of edges by the number and direction of their triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgeCounts {
    /// Distinct edges between different vertices.
    pub all: usize,
    /// Edges with two triangles of opposite direction.
    pub manifold: usize,
    /// Edges with one triangle.
    pub open: usize,
    /// Edges with more than two.
    pub crowded: usize,
    /// Edges with two of the same direction.
    pub flipped: usize,
    /// Half-edges from a vertex to itself.
    pub loops: usize,
}

impl EdgeCounts {
    /// Counts the edges of a mesh of any size: of a half-edge only its far end is kept, those that rise apart from those that fall.
    pub fn count(mesh: &Mesh) -> EdgeCounts {
        let n = mesh.vertices.len();
        let half_edges = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let up = ByVertex::new(n, || half_edges().filter(|(a, b)| a < b)).sorted(|b| *b);
        let down = ByVertex::new(n, || half_edges().filter(|(a, b)| b < a).map(|(a, b)| (b, a))).sorted(|b| *b);
        let each = (0..n).into_par_iter().with_min_len(CHUNK).map(|v| EdgeCounts::at(up.of(v), down.of(v)));
        let loops = half_edges().filter(|(a, b)| a == b).count();
        // Sums of whole numbers are the same in any order.
        EdgeCounts { loops, ..each.reduce(EdgeCounts::default, EdgeCounts::plus) }
    }

    /// Counts the edges of one vertex from the far ends of its rising and falling half-edges, both in order.
    fn at<'a>(mut up: &'a [u32], mut down: &'a [u32]) -> EdgeCounts {
        let mut counts = EdgeCounts::default();
        while let Some(end) = up.first().into_iter().chain(down.first()).min().copied() {
            let [ups, downs] = [&mut up, &mut down].map(|list| {
                let count = list.iter().take_while(|e| **e == end).count();
                *list = &list[count..];
                count
            });
            counts.all += 1;
            match (ups, downs) {
                (1, 1) => counts.manifold += 1,
                (1, 0) | (0, 1) => counts.open += 1,
                (2, 0) | (0, 2) => counts.flipped += 1,
                _ => counts.crowded += 1,
            }
        }
        counts
    }

    fn plus(self, o: EdgeCounts) -> EdgeCounts {
        EdgeCounts {
            all: self.all + o.all,
            manifold: self.manifold + o.manifold,
            open: self.open + o.open,
            crowded: self.crowded + o.crowded,
            flipped: self.flipped + o.flipped,
            loops: self.loops + o.loops,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;
    use std::collections::BTreeMap;

    /// Of triangles with any corners, each edge comes once, in order, with all its half-edges; counts agree with them.
    #[test]
    fn every_half_edge_is_at_its_edge() {
        let mut seed = 5;
        for (triangles, vertices) in [(0, 0), (1, 3), (40, 6), (300, 40), (2000, 9000)] {
            let mut corner = || ((0.5 + 0.5 * random(&mut seed)) * f64::from(vertices)) as u32 % vertices.max(1);
            let of: Vec<[u32; 3]> = (0..triangles).map(|_| [corner(), corner(), corner()]).collect();
            let mut expected: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
            for h in 0..3 * of.len() as u32 {
                let mut ends = ends(&of, h);
                ends.sort_unstable();
                expected.entry(ends).or_default().push(h);
            }
            let edges = Edges::of(&of);
            let found: Vec<Vec<u32>> = edges.each().map(<[u32]>::to_vec).collect();
            assert_eq!(found, expected.values().cloned().collect::<Vec<_>>());
            assert!(expected.iter().all(|([a, b], halves)| edges.between(*a, *b) == halves.len()));
            assert_eq!(edges.between(vertices + 1, vertices + 2), 0);

            let mut counts = EdgeCounts::default();
            for ([a, b], halves) in &expected {
                let up = halves.iter().filter(|h| rises(&of, **h)).count();
                match (a == b, halves.len(), up) {
                    (true, n, _) => counts.loops += n,
                    (_, 2, 1) => counts.manifold += 1,
                    (_, 1, _) => counts.open += 1,
                    (_, 2, _) => counts.flipped += 1,
                    _ => counts.crowded += 1,
                }
                counts.all += usize::from(a != b);
            }
            let mesh = Mesh { vertices: vec![[0.0; 3]; vertices as usize], triangles: of };
            assert_eq!(EdgeCounts::count(&mesh), counts);
        }
    }
}
