//! The net of rods on the part's surface that ties the ports of a lattice over tetrahedra.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::csg_tree::{CsgSolid, CsgTree};
use crate::implicit::Surface;
use crate::map::Tets;
use crate::map::curved_tets::boundary_edges;
use crate::map::surface_feet::{EdgeFaces, edge_feet, feet, sharp_feet};
use crate::region::Region;
use crate::tiling::Ports;
use ::beams::graph::{Beam, Graph, Hub, Profile};
use ::beams::quador::{Fillet, Quadors};
use geometry::fault::Fault;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Straight pieces of a rod on a curved surface.
const PIECES: usize = 4;
/// A rod this near its chord, in lengths, is straight.
const STRAIGHT: f64 = 1e-4;
/// Rods shorter than this share of their radius are none.
const SHORTEST: f64 = 1e-6;

/// The middle lines of a net.
pub(super) struct Net {
    nodes: Vec<Vec3>,
    rods: Vec<[u32; 2]>,
}

/// The middles of the two faces of each edge of the boundary, by its nodes.
type Edges = HashMap<[u32; 2], EdgeFaces>;

impl Net {
    /// The net on the faces of a mesh's boundary that have their middles in `on`, and along the sharp edges of the region there; `None` if
    /// there is no such face.
    pub fn new(map: &Tets, region: &Region, ports: &Ports, on: Option<&Region>) -> Option<Net> {
        let at = |n: u32| map.nodes()[n as usize];
        let third = |f: &[u32; 3]| scale(f.iter().fold([0.0; 3], |s, n| add(s, at(*n))), 1.0 / 3.0);
        let all = map.boundary_nodes();
        let edges: Edges = boundary_edges(map).into_iter().map(|e| (e.nodes, e.faces)).collect();
        let faces: Vec<[u32; 3]> = all.into_iter().filter(|f| on.is_none_or(|on| on.value(third(f)) < 0.0)).collect();
        if faces.is_empty() {
            return None;
        }
        let (lines, along) = ports.lines();
        let mut out = Net { nodes: Vec::new(), rods: Vec::new() };
        // Ends by the nodes they are between, with a share to a millionth.
        let mut known: BTreeMap<(Vec<(u32, i64)>, bool), u32> = BTreeMap::new();
        let mut end = |out: &mut Net, f: &[u32; 3], l: &[f64; 3]| {
            let mut key: Vec<(u32, i64)> = f.iter().zip(l).map(|(n, v)| (*n, (v * 1e6).round() as i64)).collect();
            key.retain(|k| k.1 != 0);
            key.sort_unstable();
            let flat = (0..3).fold([0.0; 3], |s, i| add(s, scale(at(f[i]), l[i])));
            *known.entry((key.clone(), true)).or_insert_with(|| {
                let foot = match key[..] {
                    [(a, _), (b, _)] => on_edge(region, &[flat], edges.get(&[a, b]))[0],
                    [_] => flat,
                    _ => feet(&**region, &[flat])[0],
                };
                out.nodes.push(foot);
                out.nodes.len() as u32 - 1
            })
        };
        for f in &faces {
            for [p, q] in &lines {
                let [a, b] = [p, q].map(|l| end(&mut out, f, l));
                let inner = out.between(a, b);
                out.rod(a, b, feet(&**region, &inner));
            }
        }
        let mut drawn: Vec<[u32; 2]> = Vec::new();
        for f in &faces {
            for i in 0..3 {
                let (a, b) = (f[i], f[(i + 1) % 3]);
                drawn.push([a.min(b), a.max(b)]);
            }
        }
        drawn.sort_unstable();
        drawn.dedup();
        if !along {
            drawn = sharp(map, region, &edges, drawn);
        }
        for [a, b] in drawn {
            let [p, q] = [a, b].map(|n| end(&mut out, &[n, n, n], &[1.0, 0.0, 0.0]));
            let inner = on_edge(region, &out.between(p, q), edges.get(&[a, b]));
            out.rod(p, q, inner);
        }
        Some(out)
    }

    /// Points between two nodes.
    fn between(&self, a: u32, b: u32) -> Vec<Vec3> {
        let [p, q] = [a, b].map(|n| self.nodes[n as usize]);
        (1..PIECES).map(|k| add(p, scale(sub(q, p), k as f64 / PIECES as f64))).collect()
    }

    /// Adds a rod through these points; in one piece, if it is straight.
    fn rod(&mut self, a: u32, b: u32, through: Vec<Vec3>) {
        let [p, q] = [a, b].map(|n| self.nodes[n as usize]);
        let straight = self.between(a, b);
        let off = through.iter().zip(&straight).map(|(x, y)| norm(sub(*x, *y))).fold(0.0, f64::max);
        let mut last = a;
        if off > STRAIGHT * norm(sub(p, q)) {
            for point in through {
                self.nodes.push(point);
                let next = self.nodes.len() as u32 - 1;
                self.rods.push([last, next]);
                last = next;
            }
        }
        self.rods.push([last, b]);
    }

    /// The rods, of a radius (mm), as a solid.
    pub fn solid(&self, radius: f64) -> Result<CsgSolid, Fault> {
        let hubs = self.nodes.iter().map(|center| Hub { center: *center, radius }).collect();
        // Nodes may coincide, where the mesh is finer than what it follows.
        let long = |ends: &&[u32; 2]| {
            let [p, q] = ends.map(|n| self.nodes[n as usize]);
            norm(sub(p, q)) > SHORTEST * radius
        };
        let rods = self.rods.iter().filter(long);
        let beams = rods.map(|ends| Beam { ends: *ends, profile: Profile::Cylinder }).collect();
        let quadors = Arc::new(Quadors::new(&Graph { hubs, beams }, Fillet::None)?);
        Ok(CsgSolid { surfaces: vec![Surface::smooth(quadors)], tree: CsgTree::Leaf(0) })
    }
}

/// Those of some edges that lie on sharp edges of the region.
fn sharp(map: &Tets, region: &Region, edges: &Edges, of: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    let (mut some, mut middles, mut sides) = (Vec::new(), Vec::new(), Vec::new());
    for e in of {
        if let Some(of) = edges.get(&e) {
            let [p, q] = e.map(|n| map.nodes()[n as usize]);
            some.push(e);
            middles.push(scale(add(p, q), 0.5));
            sides.push(*of);
        }
    }
    sharp_feet(&**region, &middles, &sides).into_iter().map(|(i, _)| some[i]).collect()
}

/// Points of an edge of the boundary, on the region's surface or, where it has two faces, its sharp edge.
fn on_edge(region: &Region, points: &[Vec3], faces: Option<&EdgeFaces>) -> Vec<Vec3> {
    match faces {
        Some(faces) => edge_feet(&**region, points, &vec![*faces; points.len()]),
        None => feet(&**region, points),
    }
}
