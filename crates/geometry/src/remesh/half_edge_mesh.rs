//! The half-edge structure of a manifold mesh, and the collapse of an edge in it.
//!
//! Half-edge 3t + k runs from corner k of triangle t to the next one.

use crate::mesh::edges::{Edges, ends, rises};

/// No half-edge, no vertex.
pub const NONE: u32 = u32::MAX;

/// The half-edge that follows in its triangle.
#[inline]
pub fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge that precedes in its triangle.
#[inline]
pub fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// Triangles of an oriented, manifold mesh, linked across their edges. A collapsed triangle has the corners [`NONE`].
pub struct HalfEdgeMesh {
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The other half-edge of each edge, or [`NONE`] at the boundary of an open mesh.
    twin: Vec<u32>,
    /// A half-edge that leaves each vertex, or [`NONE`].
    out: Vec<u32>,
}

impl HalfEdgeMesh {
    /// Links the triangles of `n` vertices; `None` if an edge has not exactly two triangles of opposite direction.
    pub fn new(triangles: Vec<[u32; 3]>, n: usize) -> Option<HalfEdgeMesh> {
        HalfEdgeMesh::open(triangles, n).filter(|mesh| !mesh.twin.contains(&NONE))
    }

    /// Links the triangles of `n` vertices, of a mesh that may have boundaries; `None` if an edge has more than two triangles,
    /// or two of the same direction.
    pub fn open(triangles: Vec<[u32; 3]>, n: usize) -> Option<HalfEdgeMesh> {
        let mut twin = vec![NONE; 3 * triangles.len()];
        for edge in Edges::of(&triangles).each() {
            let way = |h: u32| ends(&triangles, h);
            match *edge {
                [h] if way(h)[0] != way(h)[1] => {}
                [g, h] if rises(&triangles, g) != rises(&triangles, h) => {
                    (twin[g as usize], twin[h as usize]) = (h, g);
                }
                _ => return None,
            }
        }
        let mut out = vec![NONE; n];
        for h in (0..twin.len()).rev() {
            out[triangles[h / 3][h % 3] as usize] = h as u32;
        }
        Some(HalfEdgeMesh { triangles, twin, out })
    }

    /// The vertex that `h` leaves.
    #[inline]
    pub fn from(&self, h: u32) -> u32 {
        self.triangles[(h / 3) as usize][(h % 3) as usize]
    }

    /// The vertex that `h` leads to.
    #[inline]
    pub fn to(&self, h: u32) -> u32 {
        self.from(next(h))
    }

    /// The half-edge of the same edge in the adjacent triangle; [`NONE`] at a boundary.
    #[inline]
    pub fn twin(&self, h: u32) -> u32 {
        self.twin[h as usize]
    }

    /// Whether the triangle of `h` is still there.
    #[inline]
    pub fn is_live(&self, h: u32) -> bool {
        self.from(h) != NONE
    }

    /// The next half-edge counter-clockwise that leaves the same vertex; [`NONE`] at a boundary.
    #[inline]
    pub fn turned(&self, h: u32) -> u32 {
        self.twin(prev(h))
    }

    /// The half-edges that leave `v`, counter-clockwise; up to a boundary.
    pub fn leaving(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let first = self.out[v as usize];
        let mut now = first;
        core::iter::from_fn(move || {
            let h = now;
            if h == NONE {
                return None;
            }
            now = self.turned(h);
            if now == first {
                now = NONE;
            }
            Some(h)
        })
    }

    /// Whether the triangles about `v` go all round it.
    pub fn is_inner(&self, v: u32) -> bool {
        self.leaving(v).last().is_some_and(|h| self.turned(h) != NONE)
    }

    /// Removes the edge `h` and its two triangles: its ends become the vertex that `h` leaves.
    ///
    /// The caller has checked that the ends have no common neighbours but the two opposite corners, and that neither
    /// of these has three triangles.
    pub fn collapse(&mut self, h: u32) {
        let g = self.twin(h);
        let (u, v) = (self.from(h), self.from(g));
        let (x, y) = (self.from(prev(h)), self.from(prev(g)));
        let around: [u32; 4] = [next(h), prev(h), next(g), prev(g)].map(|e| self.twin(e));
        let mut e = self.turned(g);
        while e != g {
            self.triangles[(e / 3) as usize][(e % 3) as usize] = u;
            e = self.turned(e);
        }
        self.join(around[0], around[1]);
        self.join(around[2], around[3]);
        self.out[u as usize] = around[1];
        self.out[x as usize] = around[0];
        self.out[y as usize] = around[2];
        self.out[v as usize] = NONE;
        for t in [h / 3, g / 3] {
            self.triangles[t as usize] = [NONE; 3];
        }
    }

    /// Replaces the edge `h`, the diagonal of two triangles, by the other diagonal: `h` then runs between the two corners that
    /// were opposite it, from the one right of it to the one left of it.
    ///
    /// The caller has checked that these two have no edge yet, and that the ends of `h` keep at least three triangles.
    pub fn flip(&mut self, h: u32) {
        let g = self.twin(h);
        let (a, b) = (self.from(h), self.from(g));
        let (c, d) = (self.from(prev(h)), self.from(prev(g)));
        let around = [prev(h), next(g), prev(g), next(h)].map(|e| self.twin(e));
        for (e, corners) in [(h, [d, c, a]), (g, [c, d, b])] {
            for (e, v) in [e, next(e), prev(e)].into_iter().zip(corners) {
                self.triangles[(e / 3) as usize][(e % 3) as usize] = v;
            }
        }
        for (e, twin) in [next(h), prev(h), next(g), prev(g)].into_iter().zip(around) {
            self.join(e, twin);
        }
        for (v, e) in [(a, prev(h)), (b, prev(g)), (c, next(h)), (d, next(g))] {
            self.out[v as usize] = e;
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        self.twin[a as usize] = b;
        self.twin[b as usize] = a;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron: 0 and 5 are the poles.
    fn octahedron() -> Vec<[u32; 3]> {
        let ring = [1, 2, 3, 4];
        (0..4)
            .flat_map(|i| {
                let (a, b) = (ring[i], ring[(i + 1) % 4]);
                [[0, a, b], [5, b, a]]
            })
            .collect()
    }

    #[test]
    fn fans_go_round() {
        let half_edges = HalfEdgeMesh::new(octahedron(), 6).expect("closed");
        for v in 0..6 {
            let ends: Vec<u32> = half_edges.leaving(v).map(|h| half_edges.to(h)).collect();
            assert_eq!(ends.len(), 4);
            for (i, h) in half_edges.leaving(v).enumerate() {
                assert_eq!((half_edges.from(h), half_edges.twin(half_edges.twin(h))), (v, h));
                assert_eq!(half_edges.from(prev(h)), ends[(i + 1) % 4]);
            }
        }
    }

    #[test]
    fn a_collapse_leaves_a_closed_mesh() {
        for h in 0..24 {
            let mut half_edges = HalfEdgeMesh::new(octahedron(), 6).expect("closed");
            half_edges.collapse(h);
            let left: Vec<[u32; 3]> = half_edges.triangles.iter().copied().filter(|t| t[0] != NONE).collect();
            assert_eq!(left.len(), 6);
            let fresh = HalfEdgeMesh::new(left, 6).expect("closed");
            for v in (0..6).filter(|v| half_edges.out[*v as usize] != NONE) {
                let count = |l: &HalfEdgeMesh| {
                    let mut ends: Vec<u32> = l.leaving(v).map(|h| l.to(h)).collect();
                    ends.sort_unstable();
                    ends
                };
                assert_eq!(count(&half_edges), count(&fresh));
            }
        }
    }

    #[test]
    fn a_flip_turns_a_diagonal_and_four_give_the_first_mesh() {
        let first = HalfEdgeMesh::new(octahedron(), 6).expect("closed");
        for h in 0..24 {
            let mut half_edges = HalfEdgeMesh::new(octahedron(), 6).expect("closed");
            let corners = [h, half_edges.twin(h)].map(|e| half_edges.from(prev(e)));
            half_edges.flip(h);
            assert_eq!([half_edges.to(h), half_edges.from(h)], corners);
            let fresh = HalfEdgeMesh::new(half_edges.triangles.clone(), 6);
            // The octahedron's opposite corners had no edge, so the result is closed, too.
            let fresh = fresh.expect("closed");
            for e in 0..24 {
                assert_eq!(half_edges.twin(e), fresh.twin(e));
            }
            for v in 0..6 {
                assert!(half_edges.leaving(v).count() >= 3 && half_edges.leaving(v).all(|e| half_edges.from(e) == v));
            }
            (0..3).for_each(|_| half_edges.flip(h));
            let sorted = |l: &HalfEdgeMesh| {
                let mut all: Vec<[u32; 3]> = l.triangles.clone();
                all.iter_mut().for_each(|t| {
                    let least = (0..3).min_by_key(|k| t[*k]).expect("three");
                    t.rotate_left(least);
                });
                all.sort_unstable();
                all
            };
            assert_eq!(sorted(&half_edges), sorted(&first));
        }
    }

    #[test]
    fn open_crowded_and_flipped_meshes_are_refused() {
        let mut open = octahedron();
        open.pop();
        let mut flipped = octahedron();
        flipped[0].swap(0, 1);
        let mut twice = octahedron();
        twice.push([0, 1, 2]);
        for t in [open, flipped, twice] {
            assert!(HalfEdgeMesh::new(t, 6).is_none());
        }
    }
}
