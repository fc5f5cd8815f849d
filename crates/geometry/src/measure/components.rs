//! Connected components of a mesh, and fans of triangles about its vertices.

use rayon::prelude::*;

use crate::math::{cross, dot, sub};
use crate::mesh::Mesh;
use crate::union_find::{find, unite};

/// Connected components: sets of triangles joined through shared vertices.
pub(super) struct Components {
    /// Number of components.
    pub count: usize,
    /// Number of vertices that triangles use.
    pub vertices: usize,
    /// For each vertex the lowest vertex of its component.
    root: Vec<u32>,
}

impl Components {
    /// Finds the components of a mesh.
    pub(super) fn of(mesh: &Mesh) -> Components {
        let mut root: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let mut used = vec![false; root.len()];
        for &[a, b, c] in &mesh.triangles {
            unite(&mut root, a, b);
            unite(&mut root, b, c);
            for v in [a, b, c] {
                used[v as usize] = true;
            }
        }
        // A root is never above its members, so one pass upwards flattens every path.
        for v in 0..root.len() {
            root[v] = root[root[v] as usize];
        }
        let vertices = used.iter().filter(|u| **u).count();
        let count = (0..root.len()).filter(|&v| used[v] && root[v] as usize == v).count();
        Components { count, vertices, root }
    }

    /// For each triangle the number of its component, in the order of `volumes`.
    pub(super) fn labels(&self, mesh: &Mesh) -> Vec<usize> {
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

    /// Signed volume of each component (mm³), taken about a vertex of its own so that small ones keep their digits.
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

/// The number of vertices whose triangles form more than one fan (components or surfaces that touch in a point or edge).
pub fn non_manifold_vertices(mesh: &Mesh) -> usize {
    pinched(mesh).len()
}

/// The mesh with a vertex of its own for every fan, so that components which touch in a point or an edge are apart; `None`
/// where none do.
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
            corners.iter_mut().filter(|c| **c == v).for_each(|c| *c = *name);
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
fn fans(mesh: &Mesh, v: u32, triangles: &[u32], (sides, root): &mut (Vec<(u32, u32)>, Vec<u32>)) -> usize {
    sides.clear();
    root.clear();
    root.extend(0..triangles.len() as u32);
    for (i, &t) in triangles.iter().enumerate() {
        sides.extend(mesh.triangles[t as usize].iter().filter(|w| **w != v).map(|&w| (w, i as u32)));
    }
    sides.sort_unstable();
    let mut count = triangles.len();
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let &[(_, a), (_, b)] = edge else { continue };
        count -= usize::from(unite(root, a, b));
    }
    for i in 0..root.len() as u32 {
        root[i as usize] = find(root, i);
    }
    count
}
