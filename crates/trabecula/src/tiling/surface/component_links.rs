//! Connected components across tetrahedra: those of the surface by the vertices on common faces, those of the solid by its
//! traces there, both matched by order alone. A few numbers for each tetrahedron are held, and the runs on faces whose other
//! tetrahedron is still to come.

use std::collections::{HashMap, HashSet};

use super::tet_surface::{ComponentRun, NONE as NOBODY, TetSurface};
use crate::map::CarrierMesh;
use crate::map::tet_map::NONE;
use crate::surface_maker::{ComponentGraph, Totals};
use geometry::fault::{Fault, position};
use geometry::tetmesh::EDGES;
use geometry::union_find::{find, unite};

/// Components of the tetrahedra so far. Each tetrahedron adds its surface components, then those of its solid.
#[derive(Default)]
pub(super) struct ComponentLinks {
    graph: ComponentGraph,
    /// Runs on faces, by the tetrahedron and the corner on their other side.
    faces: HashMap<(u32, u8), Vec<ComponentRun>>,
    /// Runs of caps on edges of the boundary, by their nodes.
    boundary_edges: HashMap<[u32; 2], Vec<ComponentRun>>,
    /// Edges and nodes whose vertices are counted.
    edges: HashSet<[u32; 2]>,
    nodes: HashSet<u32>,
}

impl ComponentLinks {
    /// Adds the next tetrahedron with the totals of its surface components.
    pub fn add(
        &mut self,
        map: &CarrierMesh,
        t: usize,
        mask: u8,
        tet_surface: &TetSurface,
        totals: &[Totals],
    ) -> Result<(), Fault> {
        let components = tet_surface.solid_of.len();
        let base = self.graph.add(totals, tet_surface.solids as usize)? as usize;
        let surface = |s: u32| if s == NOBODY { s } else { base as u32 + s };
        let inner = |s: u32| (base + components) as u32 + s;
        for (b, solid) in tet_surface.solid_of.iter().enumerate() {
            unite(&mut self.graph.solid, (base + b) as u32, inner(*solid));
        }
        let named = |runs: &[ComponentRun]| -> Vec<ComponentRun> {
            let one = |r: &ComponentRun| ComponentRun { surface: surface(r.surface), solid: inner(r.solid), ..*r };
            runs.iter().map(one).collect()
        };
        let across = map.across(t);
        for (face, other) in across.into_iter().enumerate() {
            if other == NONE {
                continue;
            }
            let runs = named(&tet_surface.faces[face]);
            match self.faces.remove(&(t as u32, face as u8)) {
                Some(theirs) => self.join(&runs, &theirs),
                None => {
                    let back = map.across(other as usize).iter().position(|b| *b as usize == t);
                    self.faces.insert((other, back.unwrap_or(0) as u8), runs);
                }
            }
        }
        let ids = map.tet(t);
        // Whether vertices of caps on an edge of the boundary are ours to count.
        let mut caps = [false; 6];
        for (e, [a, b]) in EDGES.iter().enumerate() {
            let off = 15 ^ (1u8 << a | 1 << b);
            match (mask & off).count_ones() {
                0 => {}
                // The edge's other face on the boundary is another tetrahedron's.
                1 => {
                    let runs = named(&tet_surface.boundary_edges[e]);
                    let key = [ids[*a], ids[*b]];
                    match self.boundary_edges.remove(&key) {
                        Some(theirs) => self.join(&runs, &theirs),
                        None => {
                            caps[e] = true;
                            self.boundary_edges.insert(key, runs);
                        }
                    }
                }
                _ => caps[e] = true,
            }
        }
        // Each vertex is counted in one tetrahedron.
        let mut counts = [None; 16];
        for (v, zero) in tet_surface.zero.iter().enumerate() {
            let corner = v < tet_surface.crossings;
            let on = |i: &usize| zero >> i & 1 == 0;
            let mine = match zero.count_ones() {
                0 => true,
                1 => {
                    let other = across[zero.trailing_zeros() as usize];
                    other == NONE || other as usize > t
                }
                2 => {
                    let mut of = (0..4).filter(on);
                    let (a, b) = (of.next().unwrap_or(0), of.next().unwrap_or(0));
                    if corner {
                        *counts[usize::from(*zero)].get_or_insert_with(|| self.edges.insert([ids[a], ids[b]]))
                    } else {
                        caps[super::small_simplices::pair(a, b)]
                    }
                }
                _ => (0..4).find(on).is_some_and(|i| self.nodes.insert(ids[i])),
            };
            if mine {
                self.graph.totals[base + tet_surface.component[v] as usize].vertices += 1;
            }
        }
        Ok(())
    }

    /// Joins what two tetrahedra have at the same points in the same order.
    fn join(&mut self, a: &[ComponentRun], b: &[ComponentRun]) {
        let (mut a, mut b) = (a.iter().copied(), b.iter().copied());
        let (mut x, mut y) = (a.next(), b.next());
        while let (Some(r), Some(s)) = (&mut x, &mut y) {
            if r.surface != NOBODY && s.surface != NOBODY {
                unite(&mut self.graph.surface, r.surface, s.surface);
            }
            unite(&mut self.graph.solid, r.solid, s.solid);
            let n = r.count.min(s.count);
            (r.count, s.count) = (r.count - n, s.count - n);
            let (next_x, next_y) = (r.count == 0, s.count == 0);
            if next_x {
                x = a.next();
            }
            if next_y {
                y = b.next();
            }
        }
        debug_assert!(x.is_none() && y.is_none(), "faces have the same points");
    }

    /// For each of these solid components of tetrahedra, the number of the component of the whole solid that contains it.
    pub fn roots(&mut self, first: &[u32]) -> Vec<u32> {
        first.iter().map(|i| find(&mut self.graph.solid, *i)).collect()
    }

    /// Number of the first solid component of the next tetrahedron, if it has `components` surface components.
    pub fn next(&self, components: usize) -> u32 {
        (self.graph.totals.len() + components) as u32
    }

    /// All components, joined.
    pub fn graph(self) -> ComponentGraph {
        self.graph
    }
}

/// Refuses a mesh whose boundary is no manifold: where tetrahedra meet in an edge or a node alone, solids would touch there.
pub(super) fn manifold(map: &CarrierMesh) -> Result<(), Fault> {
    let boundary = map.boundary();
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    for t in &boundary.triangles {
        for i in 0..3 {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let at = |v: u32| position(boundary.vertices[v as usize]);
    let touching = |what: &str, v: u32| {
        let message = format!(
            "tetrahedra meet in {what} alone, at {}: solids would touch there without being joined; mesh the part again, or \
             leave out the tetrahedra on one side",
            at(v)
        );
        Err(Fault::new("tets", message))
    };
    // The least of those found, so that the message does not depend on the order of a hash.
    if let Some(e) = edges.iter().filter(|e| *e.1 != 2).map(|e| e.0).min() {
        return touching("an edge", e[0]);
    }
    // The triangles about a vertex are one fan if joining them over their edges leaves one.
    let mut root: Vec<u32> = (0..3 * boundary.triangles.len() as u32).collect();
    let mut known: HashMap<(u32, u32), u32> = HashMap::new();
    let mut fans = vec![0i64; boundary.vertices.len()];
    for (n, t) in boundary.triangles.iter().enumerate() {
        for i in 0..3 {
            fans[t[i] as usize] += 1;
            let me = (3 * n + i) as u32;
            for other in [t[(i + 1) % 3], t[(i + 2) % 3]] {
                match known.remove(&(t[i], other)) {
                    None => {
                        known.insert((t[i], other), me);
                    }
                    Some(them) => {
                        if find(&mut root, me) != find(&mut root, them) {
                            unite(&mut root, me, them);
                            fans[t[i] as usize] -= 1;
                        }
                    }
                }
            }
        }
    }
    match fans.iter().position(|f| *f > 1) {
        Some(v) => touching("a node", v as u32),
        None => Ok(()),
    }
}
