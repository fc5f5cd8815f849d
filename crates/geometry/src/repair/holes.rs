//! Holes: the loops that open edges leave, and the triangles that close them.
//!
//! A hole is what the oriented triangles lack to be closed: for each edge the difference of the triangles that run
//! along it in either direction. These differences always form loops, whatever the mesh, so that the capped mesh
//! winds a whole number of times about every point. A loop is capped by the triangulation whose worst fold, then whose
//! area, is least: G. Barequet and M. Sharir, Filling gaps in the boundary of a polyhedron, Comput. Aided Geom. Des. 12
//! (1995) 207; P. Liepa, Filling holes in meshes, Symp. Geometry Processing (2003) 200.

use std::collections::{HashMap, HashSet};

use super::fairing;
use crate::math::{Vec3, cross, dot, norm, sub, unit};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, ends, rises};
use crate::progress::checkpoint;

/// Loops of more vertices are divided by chords first: the search takes the cube of their number.
const LONG: usize = 160;
/// Folds (1 − cos) closer than this count as equal, so that the area decides between them.
const SAME_FOLD: f64 = 1e-6;

/// The caps of the holes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caps {
    /// Loops closed.
    pub holes: usize,
    /// Length of the loops, mm.
    pub length: f64,
    /// Area of the caps, mm².
    pub area: f64,
}

/// Closes every loop of open edges.
pub fn close(mesh: &mut Mesh) -> Caps {
    let mut caps = Caps::default();
    let loops = loops(mesh);
    if loops.is_empty() {
        return caps;
    }
    let surroundings = Surroundings::of(mesh, &loops);
    for boundary in &loops {
        checkpoint();
        let at = |i: usize| mesh.vertices[boundary[i % boundary.len()] as usize];
        caps.holes += 1;
        caps.length += (0..boundary.len()).map(|i| norm(sub(at(i + 1), at(i)))).sum::<f64>();
        let mut patch = Vec::new();
        part(mesh, &surroundings, boundary, &mut patch);
        let first = mesh.triangles.len();
        mesh.triangles.extend(fairing::smoothed(
            &mut mesh.vertices,
            boundary,
            patch,
            &surroundings.slopes(boundary),
            &surroundings.neighbours,
        ));
        caps.area += (first..mesh.triangles.len())
            .map(|i| {
                let [a, b, c] = mesh.corners(i);
                norm(cross(sub(b, a), sub(c, a))) / 2.0
            })
            .sum::<f64>();
    }
    caps
}

/// The boundary loops, each as the vertices that its cap must run along in this order, none twice.
pub fn loops(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut missing: Vec<(u32, u32)> = Vec::new();
    for edge in Edges::of(&mesh.triangles).each() {
        let [a, b] = ends(&mesh.triangles, edge[0]);
        let (low, high) = (a.min(b), a.max(b));
        let ups = edge.iter().filter(|h| rises(&mesh.triangles, **h)).count();
        let downs = edge.len() - ups;
        missing.extend((downs..ups).map(|_| (high, low)));
        missing.extend((ups..downs).map(|_| (low, high)));
    }
    missing.sort_unstable();
    let mut used = vec![false; missing.len()];
    // A vertex has as many missing edges in as out, so a walk ends where it began.
    let next = |v: u32, used: &mut [bool]| {
        let first = missing.partition_point(|e| e.0 < v);
        let i = (first..missing.len()).take_while(|i| missing[*i].0 == v).find(|i| !used[*i])?;
        used[i] = true;
        Some(missing[i].1)
    };
    let mut found = Vec::new();
    for start in missing.iter().map(|e| e.0) {
        let mut path = vec![start];
        let mut on_path: HashMap<u32, usize> = [(start, 0)].into();
        while let Some(v) = path.last().and_then(|v| next(*v, &mut used)) {
            match on_path.get(&v) {
                // A loop is complete: it is taken off, and the walk goes on from its vertex.
                Some(&i) => {
                    let boundary = path.split_off(i + 1);
                    boundary.iter().for_each(|w| {
                        on_path.remove(w);
                    });
                    let mut whole = vec![v];
                    whole.extend(boundary);
                    found.push(whole);
                }
                None => {
                    on_path.insert(v, path.len());
                    path.push(v);
                }
            }
        }
    }
    found
}

/// The mesh about the holes.
struct Surroundings {
    /// Edges between vertices of boundary loops, low to high.
    edges: HashSet<(u32, u32)>,
    /// For open edges, as the cap runs along them, the normal of the triangle beyond.
    beyond: HashMap<(u32, u32), Vec3>,
    /// The neighbours of their vertices.
    neighbours: fairing::VertexNeighbours,
}

impl Surroundings {
    fn of(mesh: &Mesh, loops: &[Vec<u32>]) -> Surroundings {
        let corners: HashSet<u32> = loops.iter().flatten().copied().collect();
        let mut surroundings = Surroundings {
            edges: HashSet::new(),
            beyond: HashMap::new(),
            neighbours: fairing::VertexNeighbours::default(),
        };
        for (i, t) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if corners.contains(&a) {
                    let joined = surroundings.neighbours.joined.entry(a).or_default();
                    joined.extend([b, t[(k + 2) % 3]]);
                }
                if corners.contains(&a) && corners.contains(&b) {
                    surroundings.edges.insert((a.min(b), a.max(b)));
                    surroundings.beyond.insert((b, a), crate::distance::triangle::normal(mesh.corners(i)));
                }
            }
        }
        surroundings
    }

    /// Normals beyond the edges of a loop.
    fn slopes(&self, boundary: &[u32]) -> Vec<Option<Vec3>> {
        (0..boundary.len())
            .map(|i| self.beyond.get(&(boundary[i], boundary[(i + 1) % boundary.len()])).copied())
            .collect()
    }
}

/// Triangles that close a loop, divided by its narrowest chord while it is long.
fn part(mesh: &Mesh, surroundings: &Surroundings, boundary: &[u32], out: &mut Vec<[u32; 3]>) {
    let mut work = vec![boundary.to_vec()];
    while let Some(boundary) = work.pop() {
        let n = boundary.len();
        if n <= LONG {
            triangulate(mesh, surroundings, &boundary, out);
            continue;
        }
        // The chord that is shortest relative to the length of boundary that it bridges; both parts keep a quarter.
        let at = |i: usize| mesh.vertices[boundary[i] as usize];
        let mut along = vec![0.0; n + 1];
        for i in 0..n {
            along[i + 1] = along[i] + norm(sub(at((i + 1) % n), at(i)));
        }
        let mut best = (f64::INFINITY, 0, n / 2);
        let step = n.div_ceil(2000);
        for i in (0..n).step_by(step) {
            for j in (i + n / 4..n.min(i + n - n / 4 + 1)).step_by(step) {
                let length = along[j] - along[i];
                let bridged = length.min(along[n] - length);
                let cost = norm(sub(at(j), at(i))) / bridged.max(f64::MIN_POSITIVE);
                let new = !surroundings.edges.contains(&(boundary[i].min(boundary[j]), boundary[i].max(boundary[j])));
                if new && cost < best.0 {
                    best = (cost, i, j);
                }
            }
        }
        let (_, i, j) = best;
        work.push(boundary[i..=j].to_vec());
        work.push(boundary[j..].iter().chain(&boundary[..=i]).copied().collect());
    }
}

/// The best triangulation of a loop of at most [`LONG`] vertices.
fn triangulate(mesh: &Mesh, surroundings: &Surroundings, boundary: &[u32], out: &mut Vec<[u32; 3]>) {
    let n = boundary.len();
    if n < 3 {
        return;
    }
    let at: Vec<Vec3> = boundary.iter().map(|v| mesh.vertices[*v as usize]).collect();
    // Of the part from vertex i to vertex k (i < k): edges that exist already, worst fold, area, and its middle vertex.
    #[derive(Clone, Copy)]
    struct Best {
        taken: u32,
        fold: f64,
        area: f64,
        middle: u32,
    }
    let nothing = Best { taken: 0, fold: 0.0, area: 0.0, middle: 0 };
    let mut table = vec![nothing; n * n];
    let slope = |i: usize, k: usize| surroundings.beyond.get(&(boundary[i], boundary[k])).copied();
    let sides: Vec<Option<Vec3>> = (0..n).map(|i| slope(i, (i + 1) % n)).collect();
    let mut normals = vec![[0.0; 3]; n * n];
    let fold = |a: Vec3, b: Option<Vec3>| b.map_or(0.0, |b| 1.0 - dot(a, b));
    for span in 2..n {
        for i in 0..n - span {
            let k = i + span;
            let exists = surroundings.edges.contains(&(boundary[i].min(boundary[k]), boundary[i].max(boundary[k])));
            let taken = u32::from(exists && span + 1 < n);
            let mut best: Option<(Best, Vec3)> = None;
            for m in i + 1..k {
                let area = cross(sub(at[m], at[i]), sub(at[k], at[i]));
                let size = norm(area);
                let facing = if size > 0.0 { unit(area) } else { [0.0; 3] };
                let (left, right) = (&table[i * n + m], &table[m * n + k]);
                let beyond = |a: usize, b: usize| {
                    if b == a + 1 { sides[a] } else { Some(normals[a * n + b]) }
                };
                let mut worst = fold(facing, beyond(i, m)).max(fold(facing, beyond(m, k)));
                if span + 1 == n {
                    worst = worst.max(fold(facing, sides[n - 1]));
                }
                let this = Best {
                    taken: left.taken + right.taken + taken,
                    fold: worst.max(left.fold).max(right.fold),
                    area: left.area + right.area + size / 2.0,
                    middle: m as u32,
                };
                let better = best.is_none_or(|(b, _)| {
                    if this.taken != b.taken {
                        this.taken < b.taken
                    } else if (this.fold - b.fold).abs() > SAME_FOLD {
                        this.fold < b.fold
                    } else {
                        this.area < b.area
                    }
                });
                if better {
                    best = Some((this, facing));
                }
            }
            if let Some((b, facing)) = best {
                table[i * n + k] = b;
                normals[i * n + k] = facing;
            }
        }
    }
    let mut work = vec![(0, n - 1)];
    while let Some((i, k)) = work.pop() {
        if k > i + 1 {
            let m = table[i * n + k].middle as usize;
            out.push([boundary[i], boundary[m], boundary[k]]);
            work.extend([(i, m), (m, k)]);
        }
    }
}
