//! Badly shaped tetrahedra at the boundary are left out.
//!
//! Where two surfaces meet at a sharp angle, tetrahedra between them are as sharp, wherever their nodes go. There, and where nothing else
//! helped, tetrahedra are shelled off: each removal leaves the boundary the manifold that it was. They are flat and few: of a hip stem's
//! million some ten, together of the volume of one.

use super::node_surfaces::{HELD, SurfaceSet};
use super::shaping::{GONE, Shaping};
use geometry::tetmesh::{EDGES, FACES, volume};

/// Shapes worse than this are left out where that is possible: dihedral angles below 14 or above 160 degrees.
const BAD: f64 = 1.73;
/// Others that may be left out to reach one.
const OTHERS: usize = 3;

impl Shaping<'_> {
    /// Leaves out badly shaped tetrahedra of a mesh of one domain, of those with all nodes on one surface if `flat`; gives their volume.
    pub fn shell(&mut self, flat: bool) -> f64 {
        let mut bad = self.bad();
        let on_one =
            |t: u32| self.tets[t as usize].iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]) & !HELD != 0;
        bad.retain(|t| self.shapes[*t as usize] < BAD && (!flat || on_one(*t)));
        let mut gone: Vec<u32> = Vec::new();
        let mut before = usize::MAX;
        while bad.len() < before {
            before = bad.len();
            for others in 0..=OTHERS {
                bad.retain(|t| !gone.contains(t) && !self.take_out(*t, others, &mut gone));
            }
        }
        let nodes: Vec<[u32; 4]> = gone.iter().map(|t| self.tets[*t as usize]).collect();
        let lost = gone.iter().map(|t| volume(self.corners(*t))).sum();
        for t in gone {
            self.tets[t as usize] = GONE;
            self.shapes[t as usize] = f64::INFINITY;
        }
        self.hold(&nodes);
        lost
    }

    /// Takes a tetrahedron from its nodes, with others first if that makes it possible, and adds all of them to `gone`; whether it was.
    fn take_out(&mut self, t: u32, others: usize, gone: &mut Vec<u32>) -> bool {
        let nodes = self.tets[t as usize];
        if self.is_shellable(t) {
            nodes.iter().for_each(|n| self.around[*n as usize].retain(|o| *o != t));
            gone.push(t);
            return true;
        }
        if others == 0 {
            return false;
        }
        let mut near: Vec<(f64, u32)> = EDGES
            .iter()
            .flat_map(|[a, b]| self.at_edge([nodes[*a], nodes[*b]]))
            .filter(|o| *o != t)
            .map(|o| (volume(self.corners(o)), o))
            .collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.dedup();
        for (_, o) in near {
            if self.is_shellable(o) {
                let corners = self.tets[o as usize];
                corners.iter().for_each(|n| self.around[*n as usize].retain(|t| *t != o));
                gone.push(o);
                if self.take_out(t, others - 1, gone) {
                    return true;
                }
                gone.pop();
                corners.iter().for_each(|n| self.around[*n as usize].push(o));
            }
        }
        false
    }

    /// Whether the boundary stays a manifold of the same kind without a tetrahedron: what of it was within is so in its boundary too.
    fn is_shellable(&self, t: u32) -> bool {
        let nodes = self.tets[t as usize];
        if nodes.iter().any(|n| self.next[*n as usize] != *n) {
            return false;
        }
        // The corners opposite to faces of the boundary, and the others.
        let outer = |k: &usize| self.is_outer(FACES[*k].map(|c| nodes[c]));
        let (opposite, rest): (Vec<usize>, Vec<usize>) = (0..4).partition(outer);
        match opposite[..] {
            [a] => self.is_inner(nodes[a]),
            [a, b] => !self.on_boundary([nodes[a], nodes[b]]),
            [_, _, _] => self.around[nodes[rest[0]] as usize].len() == 1,
            _ => false,
        }
    }

    /// Whether a node is on no face of the boundary.
    fn is_inner(&self, n: u32) -> bool {
        self.around[n as usize].iter().all(|t| {
            let t = self.tets[*t as usize];
            FACES.iter().map(|f| f.map(|c| t[c])).filter(|f| f.contains(&n)).all(|f| !self.is_outer(f))
        })
    }

    /// Whether a face has one tetrahedron only.
    fn is_outer(&self, [a, b, c]: [u32; 3]) -> bool {
        let has = |t: &&u32| [b, c].iter().all(|n| self.tets[**t as usize].contains(n));
        self.around[a as usize].iter().filter(has).count() == 1
    }

    /// Holds the nodes of faces on no surface, where tetrahedra with these nodes were left out.
    fn hold(&mut self, gone: &[[u32; 4]]) {
        for f in gone.iter().flat_map(|t| FACES.map(|f| f.map(|c| t[c]))) {
            if self.is_outer(f) && f.iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]) == 0 {
                f.iter().for_each(|n| self.on[*n as usize] |= HELD);
            }
        }
    }
}
