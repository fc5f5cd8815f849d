//! Tetrahedra bent onto the surface of a region of which they are a mesh.

use std::collections::HashMap;

use super::bent_tets::{self, Bent, Curves, FIT, MOST, SurfaceEdge};
use super::surface_feet::{EdgeFaces, edge_feet, feet};
use super::tet_map::CarrierMesh;
use crate::field::Field;
use crate::region::Region;
use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, norm, scale, sub, unit};
use geometry::tetmesh::{EDGES, TetMesh};

/// The greatest |δ|, in lengths of the edge: a chord of 140° of a circle.
const FARTHEST: f64 = 0.35;
/// |δ| below this share of the edge is rounding.
const FLAT: f64 = 1e-9;
impl CarrierMesh {
    /// As `new`, the tetrahedra at the boundary bent onto the surface of a region of which it is a mesh.
    ///
    /// # Errors
    /// As `new`.
    pub fn of_region(mesh: &TetMesh, overlap: f64, region: &Region) -> Result<CarrierMesh, Fault> {
        let flat = CarrierMesh::new(mesh, overlap)?;
        let nodes = settled(&flat, &**region);
        let out =
            if nodes == flat.nodes() { flat } else { CarrierMesh::new(&TetMesh { nodes, ..mesh.clone() }, overlap)? };
        let curves = Curves::new(&out, region);
        Ok(out.with(curves))
    }
}

impl Curves {
    /// Bends the boundary edges of a mesh whose nodes on the boundary are on the surface of a region.
    pub fn new(map: &CarrierMesh, region: &Region) -> Curves {
        let edges = boundary_edges(map);
        let ends = |e: &SurfaceEdge| e.nodes.map(|n| map.nodes()[n as usize]);
        let middles: Vec<Vec3> = edges.iter().map(|e| middle(ends(e), 0.5)).collect();
        let faces: Vec<EdgeFaces> = edges.iter().map(|e| e.faces).collect();
        let targets = edge_feet(&**region, &middles, &faces);
        let mut moved: HashMap<[u32; 2], Vec3> = HashMap::with_capacity(edges.len());
        for ((e, p), q) in edges.iter().zip(&middles).zip(&targets) {
            let [a, b] = ends(e);
            let (length, by) = (norm(sub(a, b)), sub(*q, *p));
            let far = norm(by);
            if far > FLAT * length && far.is_finite() {
                moved.insert(e.nodes, scale(by, (FARTHEST * length / far).min(1.0)));
            }
        }
        let mut out = Curves {
            region: region.clone(),
            edges,
            index: vec![bent_tets::FLAT; map.len()],
            bent: Vec::new(),
            off: 0.0,
            off_at: [0.0; 3],
            misfit: 0.0,
        };
        out.bend(map, &mut moved);
        let (points, off) = out.distances(map, &moved);
        for (p, off) in points.into_iter().zip(&off).filter(|(_, off)| off.is_finite()) {
            if *off > out.off {
                (out.off, out.off_at) = (*off, p);
            }
        }
        out.misfit = off.iter().filter(|v| **v > FIT).count() as f64 / off.len().max(1) as f64;
        out
    }

    /// Makes the bent tetrahedra, and reduces the bends until all are one to one.
    fn bend(&mut self, map: &CarrierMesh, moved: &mut HashMap<[u32; 2], Vec3>) {
        let keys = |t: usize| {
            let n = map.tet(t);
            EDGES.map(|[i, j]| [n[i], n[j]])
        };
        let touched = (0..map.len()).filter(|t| keys(*t).iter().any(|k| moved.contains_key(k)));
        let touched: Vec<usize> = touched.collect();
        let made = |t: usize, moved: &HashMap<[u32; 2], Vec3>| {
            Bent::new(map.slopes(t), keys(t).map(|k| moved.get(&k).copied().unwrap_or_default()))
        };
        loop {
            // Bends are reduced together: the least factor of an edge's tetrahedra counts, in whatever order.
            let mut least: HashMap<[u32; 2], f64> = HashMap::new();
            for &t in &touched {
                let kappa = made(t, moved).contraction;
                if kappa > MOST {
                    for k in keys(t).into_iter().filter(|k| moved.contains_key(k)) {
                        let by = least.entry(k).or_insert(1.0);
                        *by = by.min(0.98 * MOST / kappa);
                    }
                }
            }
            if least.is_empty() {
                break;
            }
            for (k, by) in least {
                moved.entry(k).and_modify(|d| *d = scale(*d, by));
            }
        }
        for t in touched {
            self.index[t] = self.bent.len() as u32;
            self.bent.push(made(t, moved));
        }
    }

    /// Places on the bent boundary, at the middles of faces and the quarters of edges, and their distances from the surface, in edges.
    fn distances(&self, map: &CarrierMesh, moved: &HashMap<[u32; 2], Vec3>) -> (Vec<Vec3>, Vec<f64>) {
        let at = |n: u32| map.nodes()[n as usize];
        let bend = |a: u32, b: u32| moved.get(&[a.min(b), a.max(b)]).copied().unwrap_or_default();
        let boundary = map.boundary_nodes();
        let (mut points, mut lengths) = (Vec::new(), Vec::new());
        for f in &boundary {
            let length = (0..3).map(|i| norm(sub(at(f[i]), at(f[(i + 1) % 3])))).sum::<f64>() / 3.0;
            let flat = scale(f.iter().fold([0.0; 3], |s, n| add(s, at(*n))), 1.0 / 3.0);
            let bent = (0..3).fold(flat, |p, i| add(p, scale(bend(f[i], f[(i + 1) % 3]), 4.0 / 9.0)));
            points.push(bent);
            lengths.push(length);
        }
        for SurfaceEdge { nodes: [a, b], .. } in &self.edges {
            for s in [0.25, 0.5, 0.75] {
                let flat = middle([at(*a), at(*b)], s);
                points.push(add(flat, scale(bend(*a, *b), 4.0 * s * (1.0 - s))));
                lengths.push(norm(sub(at(*a), at(*b))));
            }
        }
        let mut off = vec![0.0; points.len()];
        self.region.values(&points, &mut off);
        let off = off.iter().zip(lengths).map(|(v, l)| v.abs() / l).collect();
        (points, off)
    }
}

fn middle([a, b]: [Vec3; 2], s: f64) -> Vec3 {
    add(scale(a, 1.0 - s), scale(b, s))
}

/// The edges of the boundary that have two faces, ascending.
pub(crate) fn boundary_edges(map: &CarrierMesh) -> Vec<SurfaceEdge> {
    let mut halves: Vec<([u32; 2], [u32; 3])> = Vec::new();
    for f in map.boundary_nodes() {
        for i in 0..3 {
            let (a, b) = (f[i], f[(i + 1) % 3]);
            halves.push(([a.min(b), a.max(b)], f));
        }
    }
    halves.sort_unstable();
    let third = |f: [u32; 3]| scale(f.iter().fold([0.0; 3], |s, n| add(s, map.nodes()[*n as usize])), 1.0 / 3.0);
    let normal = |f: [u32; 3]| {
        let [a, b, c] = f.map(|n| map.nodes()[n as usize]);
        unit(cross(sub(b, a), sub(c, a)))
    };
    let edge = |pair: &[([u32; 2], [u32; 3])]| match pair {
        [(nodes, f), (_, g)] => {
            let outward = unit(add(normal(*f), normal(*g)));
            Some(SurfaceEdge { nodes: *nodes, faces: EdgeFaces { middles: [third(*f), third(*g)], outward } })
        }
        _ => None,
    };
    halves.chunk_by(|a, b| a.0 == b.0).filter_map(edge).collect()
}

/// The nodes of a mesh, those on the boundary that are a little off the surface of a region moved onto it, where all
/// tetrahedra keep at least half their volume.
pub(crate) fn settled(map: &CarrierMesh, region: &dyn Field) -> Vec<Vec3> {
    let boundary = map.boundary_nodes();
    let old = map.nodes();
    let mut shortest: HashMap<u32, f64> = HashMap::new();
    for f in &boundary {
        for i in 0..3 {
            let length = norm(sub(old[f[i] as usize], old[f[(i + 1) % 3] as usize]));
            for n in [f[i], f[(i + 1) % 3]] {
                let s = shortest.entry(n).or_insert(length);
                *s = s.min(length);
            }
        }
    }
    let mut on: Vec<(u32, f64)> = shortest.into_iter().collect();
    on.sort_unstable_by_key(|n| n.0);
    let points: Vec<Vec3> = on.iter().map(|n| old[n.0 as usize]).collect();
    let mut new = old.to_vec();
    for ((n, length), (p, q)) in on.iter().zip(points.iter().zip(feet(region, &points))) {
        let far = norm(sub(q, *p));
        if far > FLAT * length && far < 0.25 * length {
            new[*n as usize] = q;
        }
    }
    loop {
        let spoilt = |t: &usize| {
            let n = map.tet(*t);
            let volume = |of: &[Vec3]| super::tet_map::volume(n.map(|v| of[v as usize]));
            let (was, is) = (volume(old), volume(&new));
            was * is < 0.5 * was * was
        };
        let bad: Vec<usize> = (0..map.len()).filter(spoilt).collect();
        if bad.is_empty() {
            return new;
        }
        for n in bad.into_iter().flat_map(|t| map.tet(t)) {
            new[n as usize] = old[n as usize];
        }
    }
}
