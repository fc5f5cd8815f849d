//! What touches what in a mesh: edges, fans about vertices, bodies.

use rayon::prelude::*;

use crate::math::{cross, dot, sub};
use crate::mesh::Mesh;

/// Edges by the number and direction of their triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Edges {
    /// Distinct edges between different vertices.
    pub all: usize,
    /// Edges with two triangles of opposite direction.
    pub sound: usize,
    /// Edges with one triangle.
    pub open: usize,
    /// Edges with more than two.
    pub crowded: usize,
    /// Edges with two of the same direction.
    pub flipped: usize,
    /// Sides of triangles from a vertex to itself.
    pub loops: usize,
}

impl Edges {
    /// Counts the edges of a mesh.
    ///
    /// Every side is filed under its lower vertex: sides that run up from the left of that vertex's span, sides that
    /// run down from its right, so that a direction costs no memory. Each span is then sorted on its own.
    pub(super) fn count(mesh: &Mesh) -> Edges {
        let n = mesh.vertices.len();
        let sides = || {
            mesh.triangles
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        };
        let mut start = vec![0usize; n + 1];
        let mut loops = 0;
        for (a, b) in sides() {
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
        for (a, b) in sides() {
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
        for first in (0..n).step_by(super::CHUNK) {
            let last = (first + super::CHUNK).min(n);
            let (block, tail) = rest.split_at_mut(start[last] - start[first]);
            spans.push((first, last, block));
            rest = tail;
        }
        let counted = spans.into_par_iter().map(|(first, last, block)| {
            let mut e = Edges::default();
            for v in first..last {
                let span = &mut block[start[v] - start[first]..start[v + 1] - start[first]];
                let (up, down) = span.split_at_mut(ups[v] as usize);
                e.merge(up, down);
            }
            e
        });
        let mut all = counted.reduce(Edges::default, Edges::plus);
        all.loops = loops;
        all
    }

    /// Counts the edges of one vertex from the far ends of its rising and falling sides.
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
                (1, 1) => self.sound += 1,
                (1, 0) | (0, 1) => self.open += 1,
                (2, 0) | (0, 2) => self.flipped += 1,
                _ => self.crowded += 1,
            }
        }
    }

    fn plus(self, o: Edges) -> Edges {
        Edges {
            all: self.all + o.all,
            sound: self.sound + o.sound,
            open: self.open + o.open,
            crowded: self.crowded + o.crowded,
            flipped: self.flipped + o.flipped,
            loops: self.loops + o.loops,
        }
    }
}

/// Bodies: sets of triangles joined through shared vertices.
pub(super) struct Bodies {
    /// Number of bodies.
    pub count: usize,
    /// Number of vertices that triangles use.
    pub vertices: usize,
    /// For each vertex the lowest vertex of its body.
    root: Vec<u32>,
}

impl Bodies {
    /// Finds the bodies of a mesh.
    pub(super) fn of(mesh: &Mesh) -> Bodies {
        let mut root: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let mut used = vec![false; root.len()];
        for &[a, b, c] in &mesh.triangles {
            let r = [a, b, c].map(|v| find(&mut root, v));
            let low = r[0].min(r[1]).min(r[2]);
            for v in r {
                root[v as usize] = low;
            }
            for v in [a, b, c] {
                used[v as usize] = true;
            }
        }
        // A root is never above its members, so one pass upwards flattens every path.
        for v in 0..root.len() {
            root[v] = root[root[v] as usize];
        }
        let vertices = used.iter().filter(|u| **u).count();
        let count = (0..root.len())
            .filter(|&v| used[v] && root[v] as usize == v)
            .count();
        Bodies {
            count,
            vertices,
            root,
        }
    }

    /// For each triangle the number of its body, in the order of `volumes`.
    pub(super) fn names(&self, mesh: &Mesh) -> Vec<usize> {
        let mut slot = vec![usize::MAX; self.root.len()];
        let mut count = 0;
        let name = |t: &[u32; 3]| {
            let s = &mut slot[self.root[t[0] as usize] as usize];
            if *s == usize::MAX {
                (*s, count) = (count, count + 1);
            }
            *s
        };
        mesh.triangles.iter().map(name).collect()
    }

    /// Signed volume of each body (mm³), taken about a vertex of its own so that small bodies keep their digits.
    pub(super) fn volumes(&self, mesh: &Mesh) -> Vec<f64> {
        let mut slot = vec![u32::MAX; self.root.len()];
        let mut sums: Vec<f64> = Vec::with_capacity(self.count);
        for &[a, b, c] in &mesh.triangles {
            let r = self.root[a as usize] as usize;
            if slot[r] == u32::MAX {
                slot[r] = sums.len() as u32;
                sums.push(0.0);
            }
            let o = mesh.vertices[r];
            let [p, q, s] = [a, b, c].map(|v| sub(mesh.vertices[v as usize], o));
            sums[slot[r] as usize] += dot(p, cross(q, s));
        }
        sums.iter_mut().for_each(|v| *v /= 6.0);
        sums
    }
}

/// The root of `v`, halving the path on the way.
fn find(root: &mut [u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        root[v as usize] = root[root[v as usize] as usize];
        v = root[v as usize];
    }
    v
}

/// The number of vertices whose triangles form more than one fan (bodies or surfaces that touch in a point or edge).
pub fn non_manifold_vertices(mesh: &Mesh) -> usize {
    pinched(mesh).len()
}

/// The mesh with a vertex of its own for every fan, so that bodies which touch in a point or an edge are apart; `None`
/// where nothing does.
pub(super) fn apart(mesh: &Mesh) -> Option<Mesh> {
    let pinched = pinched(mesh);
    if pinched.is_empty() {
        return None;
    }
    let mut apart = mesh.clone();
    let mut scratch = Default::default();
    for (v, triangles) in pinched {
        fans(mesh, v, &triangles, &mut scratch);
        let root = &scratch.1;
        // The first fan keeps the vertex.
        let mut names = vec![u32::MAX; root.len()];
        names[root[0] as usize] = v;
        for (&t, &fan) in triangles.iter().zip(root) {
            let name = &mut names[fan as usize];
            if *name == u32::MAX {
                *name = apart.vertices.len() as u32;
                apart.vertices.push(mesh.vertices[v as usize]);
            }
            let corners = &mut apart.triangles[t as usize];
            corners
                .iter_mut()
                .filter(|c| **c == v)
                .for_each(|c| *c = *name);
        }
    }
    Some(apart)
}

/// The vertices whose triangles form more than one fan, with their triangles.
fn pinched(mesh: &Mesh) -> Vec<(u32, Vec<u32>)> {
    let n = mesh.vertices.len();
    let mut start = vec![0usize; n + 1];
    for &v in mesh.triangles.iter().flatten() {
        start[v as usize + 1] += 1;
    }
    for v in 0..n {
        start[v + 1] += start[v];
    }
    let mut next = start.clone();
    let mut around = vec![0u32; start[n]];
    for (i, t) in mesh.triangles.iter().enumerate() {
        for &v in t {
            around[next[v as usize]] = i as u32;
            next[v as usize] += 1;
        }
    }
    drop(next);
    (0..n)
        .into_par_iter()
        .map_init(Default::default, |scratch, v| {
            let triangles = &around[start[v]..start[v + 1]];
            (fans(mesh, v as u32, triangles, scratch) > 1).then(|| (v as u32, triangles.to_vec()))
        })
        .flatten_iter()
        .collect()
}

/// The number of fans that `triangles` form about vertex `v`: classes joined across edges at `v` that two of them share.
/// Leaves the fan of each triangle, as the first of its class, in the second scratch.
fn fans(
    mesh: &Mesh,
    v: u32,
    triangles: &[u32],
    (sides, root): &mut (Vec<(u32, u32)>, Vec<u32>),
) -> usize {
    sides.clear();
    root.clear();
    root.extend(0..triangles.len() as u32);
    for (i, &t) in triangles.iter().enumerate() {
        sides.extend(
            mesh.triangles[t as usize]
                .iter()
                .filter(|w| **w != v)
                .map(|&w| (w, i as u32)),
        );
    }
    sides.sort_unstable();
    let mut count = triangles.len();
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let &[(_, a), (_, b)] = edge else { continue };
        let (a, b) = (find(root, a), find(root, b));
        if a != b {
            root[a.max(b) as usize] = a.min(b);
            count -= 1;
        }
    }
    for i in 0..root.len() as u32 {
        root[i as usize] = find(root, i);
    }
    count
}
