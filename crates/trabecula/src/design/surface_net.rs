//! The net of rods on the part's surface that ties the ports of a lattice over tetrahedra.
//!
//! Rods taper from node to node: each node of the mesh has a radius, of the size of the tetrahedra about it, linear in the triangles between.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::csg_tree::{CsgSolid, CsgTree};
use crate::implicit::Surface;
use crate::map::CarrierMesh;
use crate::map::curved_tets::boundary_edges;
use crate::map::surface_feet::{EdgeFaces, edge_feet, feet, sharp_feet};
use crate::region::Region;
use crate::tiling::Ports;
use ::beams::graph::{Beam, Graph, HubBall, Profile};
use ::beams::quador::{Fillet, Quadors};
use geometry::fault::Fault;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Straight pieces of a rod on a curved surface.
const PIECES: usize = 4;
/// A rod this near its chord, in lengths, is straight.
const STRAIGHT: f64 = 1e-4;
/// Rods shorter than this share of their radius are none.
const SHORTEST: f64 = 1e-6;

/// Change of the radius along a rod, over its length, at most.
const TAPER: f64 = 0.25;

/// The middle lines of a net.
pub(super) struct RodNet {
    pub nodes: Vec<Vec3>,
    /// Where each node is on the mesh.
    places: Vec<NodePosition>,
    pub rods: Vec<[u32; 2]>,
    /// The nodes of the triangle or the edge of the mesh that each rod is on.
    pub owners: Vec<[u32; 3]>,
    /// The faces of the boundary that it is on, by number.
    pub faces: Vec<usize>,
    /// The lines of a face with rods, in the coordinates of its corners.
    pub lines: Vec<[[f64; 3]; 2]>,
    /// The edges of triangles with rods, ascending.
    pub drawn: Vec<[u32; 2]>,
}

/// The rods of a net.
pub(super) struct Rods {
    pub net: Arc<RodNet>,
    /// The radii of its nodes, mm.
    pub radii: Vec<f64>,
    pub solid: CsgSolid,
}

impl Rods {
    /// The least and the greatest radius, mm.
    pub fn range(&self) -> [f64; 2] {
        self.radii.iter().fold([f64::INFINITY, 0.0], |[lo, hi], r| [lo.min(*r), hi.max(*r)])
    }
}

/// Where a node of a net is.
enum NodePosition {
    /// On a triangle of these nodes of the mesh, by the coordinates of its corners.
    On([u32; 3], [f64; 3]),
    /// Between two nodes of the net, by the share of the second.
    Between([u32; 2], f64),
}

/// The middles of the two faces of each edge of the boundary, by its nodes.
type Edges = HashMap<[u32; 2], EdgeFaces>;

impl RodNet {
    /// The net on these faces of a mesh's boundary, and along the sharp edges of the region there.
    pub fn new(map: &CarrierMesh, region: &Region, ports: &Ports, on: Vec<usize>) -> RodNet {
        let at = |n: u32| map.nodes()[n as usize];
        let edges: Edges = boundary_edges(map).into_iter().map(|e| (e.nodes, e.faces)).collect();
        let all = map.boundary_nodes();
        let faces: Vec<[u32; 3]> = on.iter().map(|i| all[*i]).collect();
        let (lines, along) = ports.lines();
        let mut drawn: Vec<[u32; 2]> = Vec::new();
        for f in &faces {
            drawn.extend((0..3).map(|i| [f[i].min(f[(i + 1) % 3]), f[i].max(f[(i + 1) % 3])]));
        }
        drawn.sort_unstable();
        drawn.dedup();
        if !along {
            drawn = sharp(map, region, &edges, drawn);
        }
        let (nodes, places, rods, owners) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut out = RodNet { nodes, places, rods, owners, faces: on, lines: lines.clone(), drawn: drawn.clone() };
        // Ends by the nodes they are between, with a share to a millionth.
        let mut known: BTreeMap<(Vec<(u32, i64)>, bool), u32> = BTreeMap::new();
        let mut end = |out: &mut RodNet, f: &[u32; 3], l: &[f64; 3]| {
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
                out.node(foot, NodePosition::On(*f, *l))
            })
        };
        for f in &faces {
            for [p, q] in &lines {
                let [a, b] = [p, q].map(|l| end(&mut out, f, l));
                let inner = out.between(a, b);
                out.rod([a, b], feet(&**region, &inner), *f);
            }
        }
        for [a, b] in drawn {
            let [p, q] = [a, b].map(|n| end(&mut out, &[n, n, n], &[1.0, 0.0, 0.0]));
            let inner = on_edge(region, &out.between(p, q), edges.get(&[a, b]));
            out.rod([p, q], inner, [a, b, b]);
        }
        out
    }

    /// Adds a node.
    fn node(&mut self, at: Vec3, place: NodePosition) -> u32 {
        self.nodes.push(at);
        self.places.push(place);
        self.nodes.len() as u32 - 1
    }

    /// Points between two nodes.
    fn between(&self, a: u32, b: u32) -> Vec<Vec3> {
        let [p, q] = [a, b].map(|n| self.nodes[n as usize]);
        (1..PIECES).map(|k| add(p, scale(sub(q, p), k as f64 / PIECES as f64))).collect()
    }

    /// Adds a rod through these points; in one piece, if it is straight.
    fn rod(&mut self, ends: [u32; 2], through: Vec<Vec3>, owner: [u32; 3]) {
        let [p, q] = ends.map(|n| self.nodes[n as usize]);
        let straight = self.between(ends[0], ends[1]);
        let off = through.iter().zip(&straight).map(|(x, y)| norm(sub(*x, *y))).fold(0.0, f64::max);
        let mut last = ends[0];
        if off > STRAIGHT * norm(sub(p, q)) {
            for (k, point) in through.into_iter().enumerate() {
                let next = self.node(point, NodePosition::Between(ends, (k + 1) as f64 / PIECES as f64));
                self.rods.push([last, next]);
                last = next;
            }
        }
        self.rods.push([last, ends[1]]);
        self.owners.resize(self.rods.len(), owner);
    }

    /// The radii of its nodes (mm) from those of the mesh's, where rods would taper faster than they may those of their thinner ends.
    pub fn radii(&self, of: &[f64]) -> Vec<f64> {
        let mut radii: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for place in &self.places {
            radii.push(match place {
                NodePosition::On(f, l) => f.iter().zip(l).map(|(n, l)| l * of[*n as usize]).sum(),
                NodePosition::Between([a, b], share) => {
                    let [r, s] = [a, b].map(|n| radii[*n as usize]);
                    r + share * (s - r)
                }
            });
        }
        let mut open = true;
        while core::mem::take(&mut open) {
            for ends in &self.rods {
                let [a, b] = ends.map(|n| n as usize);
                let by = TAPER * self.length(*ends);
                for (a, b) in [(a, b), (b, a)] {
                    if radii[a] > radii[b] + by {
                        radii[a] = radii[b] + by;
                        open = true;
                    }
                }
            }
        }
        radii
    }

    fn length(&self, ends: [u32; 2]) -> f64 {
        let [p, q] = ends.map(|n| self.nodes[n as usize]);
        norm(sub(p, q))
    }

    /// Its rods, of the radii (mm) that the nodes of the mesh have.
    pub fn rods(self: &Arc<RodNet>, of: &[f64]) -> Result<Rods, Fault> {
        let radii = self.radii(of);
        Ok(Rods { solid: self.solid(&radii)?, net: self.clone(), radii })
    }

    /// The rods between nodes of these radii (mm), as a solid.
    fn solid(&self, radii: &[f64]) -> Result<CsgSolid, Fault> {
        let hubs = self.nodes.iter().zip(radii).map(|(center, radius)| HubBall { center: *center, radius: *radius });
        // Nodes may coincide, where the mesh is finer than what it follows.
        let long = |ends: &&[u32; 2]| self.length(**ends) > SHORTEST * radii[ends[0] as usize];
        let rods = self.rods.iter().filter(long);
        // Between equal hubs that are small the cone's parameter rounds to the cylinder's, which is none of a cone.
        let profile = |ends: &[u32; 2]| match ends.map(|n| radii[n as usize]) {
            [a, b] if a == b => Profile::Cylinder,
            _ => Profile::Cone,
        };
        let beams = rods.map(|ends| Beam { ends: *ends, profile: profile(ends) }).collect();
        let quadors = Arc::new(Quadors::new(&Graph { hubs: hubs.collect(), beams }, Fillet::None)?);
        Ok(CsgSolid { surfaces: vec![Surface::smooth(quadors)], tree: CsgTree::Leaf(0) })
    }
}

/// Those of some edges that lie on sharp edges of the region.
fn sharp(map: &CarrierMesh, region: &Region, edges: &Edges, of: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tet::named_tet_cell;
    use crate::field::Field;
    use crate::grade::{Grade, Linear};
    use crate::mesher::background;
    use crate::region::{Cuboid, Sphere};
    use crate::tiling::{NodalLevel, Tiling};

    /// A tapered rod is a frustum of the common tangent cone between two balls: its volume by sums over a grid of a fortieth of its
    /// radius, on the surface of which a share of 1e-3 of the volume is in doubt.
    #[test]
    fn a_rod_has_the_volume_of_its_cone_and_balls() {
        let (length, radii) = (3.0, [0.5, 0.3]);
        let net = RodNet {
            nodes: vec![[0.0; 3], [length, 0.0, 0.0]],
            places: vec![NodePosition::On([0; 3], [1.0, 0.0, 0.0]), NodePosition::On([1; 3], [1.0, 0.0, 0.0])],
            rods: vec![[0, 1]],
            owners: vec![[0, 1, 1]],
            faces: Vec::new(),
            lines: Vec::new(),
            drawn: Vec::new(),
        };
        let made = net.radii(&radii);
        assert_eq!(made, radii);
        let solid = net.solid(&made).expect("rod");
        // The cone touches the balls where its normal leans back by the taper over the length.
        let lean = (radii[0] - radii[1]) / length;
        let [from, to] = radii.map(|r| [r * lean, r * (1.0 - lean * lean).sqrt()]);
        let cap = |r: f64, h: f64| core::f64::consts::PI * h * h * (r - h / 3.0);
        let along = length + to[0] - from[0];
        let frustum = core::f64::consts::PI / 3.0 * along * (from[1].powi(2) + from[1] * to[1] + to[1].powi(2));
        let exact = frustum + cap(radii[0], radii[0] + from[0]) + cap(radii[1], radii[1] - to[0]);
        let h: f64 = 0.5 / 40.0;
        let mut count = 0.0;
        for i in 0..(4.0 / h) as usize {
            for j in 0..(1.1 / h) as usize {
                let points: Vec<Vec3> = (0..(1.1 / h) as usize)
                    .map(|k| [i as f64, j as f64, k as f64].map(|v| (v + 0.37) * h))
                    .map(|[x, y, z]| [x - 0.55, y - 0.55, z - 0.55])
                    .collect();
                let mut v = vec![0.0; points.len()];
                solid.values(&points, &mut v);
                count += v.iter().filter(|v| **v <= 0.0).count() as f64;
            }
        }
        let found = count * h * h * h;
        assert!((found / exact - 1.0).abs() < 1e-3, "{found} of {exact}");
    }

    /// On boxes and balls whose tetrahedra are graded to thrice their size: every rod is as thick as its own triangles are large, within
    /// what the shapes of tetrahedra in a mesh differ by, and tapers no faster than it may.
    #[test]
    fn rods_are_as_thick_as_their_triangles_are_large() {
        for (i, fine) in [1.1, 1.6, 1.3, 1.9].into_iter().enumerate() {
            let reach = 6.0 + 0.4 * i as f64;
            let region: Region = match i % 2 {
                0 => Arc::new(Cuboid::new([-reach, -3.0, -3.0], [reach, 3.0, 2.0]).expect("box")),
                _ => Arc::new(Sphere::new([0.0; 3], reach).expect("ball")),
            };
            let size =
                Grade::from(Linear::new([1.0, 0.0, 0.0], vec![[-reach, fine], [reach, 3.0 * fine]]).expect("size"));
            let (inside, _) = crate::design::sample::inside(&region, 4000);
            let mesh = background(&region, &region.bounds(), &size, &inside, None).expect("mesh").mesh;
            let map = Arc::new(CarrierMesh::of_region(&mesh, 0.0, &region).expect("map"));
            let named = named_tet_cell(["diamond", "pn3m"][i / 2]).expect("cell");
            let cell = named.cell().expect("cell");
            let iso = cell.iso(named.part, 0.3);
            let tiling = Tiling::new(map.clone(), Arc::new(cell), named.part, NodalLevel::Same(iso));
            let all = map.boundary_nodes();
            let net = RodNet::new(&map, &region, &tiling.ports(), (0..all.len()).collect());
            let radii = net.radii(&tiling.rod_radii());
            let mut edges: HashMap<u32, Vec<f64>> = HashMap::new();
            for f in &all {
                for k in 0..3 {
                    let long = norm(sub(map.nodes()[f[k] as usize], map.nodes()[f[(k + 1) % 3] as usize]));
                    f.iter().for_each(|n| edges.entry(*n).or_default().push(long));
                }
            }
            let (mut least, mut most): (f64, f64) = (f64::INFINITY, 0.0);
            for (ends, owner) in net.rods.iter().zip(&net.owners) {
                let near: Vec<f64> = owner.iter().flat_map(|n| edges[n].iter().copied()).collect();
                let edge = near.iter().sum::<f64>() / near.len() as f64;
                for n in ends {
                    let ratio = radii[*n as usize] / edge;
                    (least, most) = (least.min(ratio), most.max(ratio));
                }
                let [r, s] = ends.map(|n| radii[n as usize]);
                assert!((r - s).abs() <= TAPER * net.length(*ends) + 1e-12, "{i}: {r} {s}");
            }
            let all = radii.iter().fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(*r), h.max(*r)));
            println!("{i}: rods are {least} to {most} of their edges, {all:?} mm");
            assert!(most < 4.0 * least, "{i}: {least} to {most} of the edges");
        }
    }
}
