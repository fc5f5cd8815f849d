//! Counts of the edges of a mesh.

use rayon::prelude::*;

use super::Mesh;

/// Vertices per unit of parallel work.
const CHUNK: usize = 1 << 16;

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
    /// Counts the edges of a mesh.
    ///
    /// Every half-edge is filed under its lower vertex: rising ones from the left of that vertex's span, falling ones from its
    /// right, so that a direction costs no memory. Each span is then sorted on its own.
    pub fn count(mesh: &Mesh) -> EdgeCounts {
        let n = mesh.vertices.len();
        let half_edges = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let mut start = vec![0usize; n + 1];
        let mut loops = 0;
        for (a, b) in half_edges() {
            if a == b {
                loops += 1;
            } else {
                start[a.min(b) as usize + 1] += 1;
            }
        }
        for v in 0..n {
            start[v + 1] += start[v];
        }
        let mut other = vec![0u32; start[n]];
        let (mut ups, mut downs) = (vec![0u32; n], vec![0u32; n]);
        for (a, b) in half_edges() {
            if a < b {
                let v = a as usize;
                other[start[v] + ups[v] as usize] = b;
                ups[v] += 1;
            } else if b < a {
                let v = b as usize;
                downs[v] += 1;
                other[start[v + 1] - downs[v] as usize] = a;
            }
        }
        drop(downs);
        // Spans are handed out in blocks of vertices; counts of whole numbers add up in any order.
        let mut spans = Vec::new();
        let mut rest = other.as_mut_slice();
        for first in (0..n).step_by(CHUNK) {
            let last = (first + CHUNK).min(n);
            let (block, tail) = rest.split_at_mut(start[last] - start[first]);
            spans.push((first, last, block));
            rest = tail;
        }
        let counted = spans.into_par_iter().map(|(first, last, block)| {
            let mut e = EdgeCounts::default();
            for v in first..last {
                let span = &mut block[start[v] - start[first]..start[v + 1] - start[first]];
                let (up, down) = span.split_at_mut(ups[v] as usize);
                e.merge(up, down);
            }
            e
        });
        let mut all = counted.reduce(EdgeCounts::default, EdgeCounts::plus);
        all.loops = loops;
        all
    }

    /// Counts the edges of one vertex from the far ends of its rising and falling half-edges.
    fn merge(&mut self, up: &mut [u32], down: &mut [u32]) {
        up.sort_unstable();
        down.sort_unstable();
        let (mut i, mut j) = (0, 0);
        loop {
            let end = match (up.get(i), down.get(j)) {
                (None, None) => return,
                (Some(a), Some(b)) => *a.min(b),
                (Some(a), None) | (None, Some(a)) => *a,
            };
            let (i0, j0) = (i, j);
            while up.get(i) == Some(&end) {
                i += 1;
            }
            while down.get(j) == Some(&end) {
                j += 1;
            }
            self.all += 1;
            match (i - i0, j - j0) {
                (1, 1) => self.manifold += 1,
                (1, 0) | (0, 1) => self.open += 1,
                (2, 0) | (0, 2) => self.flipped += 1,
                _ => self.crowded += 1,
            }
        }
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
