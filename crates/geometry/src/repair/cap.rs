//! Holes: the loops that open edges leave, and the triangles that close them.
//!
//! A hole is what the oriented triangles lack to be closed: for each edge the difference of the triangles that run
//! along it one way and the other. These differences always form loops, whatever the mesh, so that the capped mesh
//! winds a whole number of times about every point. A loop is capped by the triangulation whose worst fold, then whose
//! area, is least: G. Barequet and M. Sharir, Filling gaps in the boundary of a polyhedron, Comput. Aided Geom. Des. 12
//! (1995) 207; P. Liepa, Filling holes in meshes, Symp. Geometry Processing (2003) 200.

use std::collections::{HashMap, HashSet};

use super::fair;
use super::half_edges::{halves, rises};
use crate::math::{Vec3, cross, dot, norm, sub, unit};
use crate::mesh::Mesh;

/// Loops of more corners are parted by chords first: the search takes the cube of their number.
const LONG: usize = 160;
/// Folds (1 − cos) closer than this count as equal, so that the area decides between them.
const SAME_FOLD: f64 = 1e-6;

/// What closed the holes.
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
    let rims = Rims::of(mesh, &loops);
    for rim in &loops {
        let at = |i: usize| mesh.vertices[rim[i % rim.len()] as usize];
        caps.holes += 1;
        caps.length += (0..rim.len()).map(|i| norm(sub(at(i + 1), at(i)))).sum::<f64>();
        let mut patch = Vec::new();
        part(mesh, &rims, rim, &mut patch);
        let first = mesh.triangles.len();
        mesh.triangles.extend(fair::smoothed(&mut mesh.vertices, rim, patch, &rims.slopes(rim), &rims.about));
        caps.area += (first..mesh.triangles.len())
            .map(|i| {
                let [a, b, c] = mesh.corners(i);
                norm(cross(sub(b, a), sub(c, a))) / 2.0
            })
            .sum::<f64>();
    }
    caps
}

/// The loops, each as the corners that its cap must run along in this order, none twice.
pub fn loops(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut missing: Vec<(u32, u32)> = Vec::new();
    for edge in halves(mesh).chunk_by(|a, b| a.0 == b.0) {
        let (low, high) = ((edge[0].0 >> 32) as u32, edge[0].0 as u32);
        let ups = edge.iter().filter(|h| rises(mesh, h.1)).count();
        let downs = edge.len() - ups;
        missing.extend((downs..ups).map(|_| (high, low)));
        missing.extend((ups..downs).map(|_| (low, high)));
    }
    missing.sort_unstable();
    let mut used = vec![false; missing.len()];
    // A vertex has as many ways in as out, so a walk ends where it began.
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
                // Here a loop is whole: it is taken off, and the walk goes on from its corner.
                Some(&i) => {
                    let rim = path.split_off(i + 1);
                    rim.iter().for_each(|w| {
                        on_path.remove(w);
                    });
                    let mut whole = vec![v];
                    whole.extend(rim);
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

/// What the triangulation must know of the mesh about the holes.
struct Rims {
    /// Edges between corners of rims, low to high.
    edges: HashSet<(u32, u32)>,
    /// For open edges, as the cap runs along them, the normal of the triangle beyond.
    beyond: HashMap<(u32, u32), Vec3>,
    /// What the corners are joined to.
    about: fair::About,
}

impl Rims {
    fn of(mesh: &Mesh, loops: &[Vec<u32>]) -> Rims {
        let corners: HashSet<u32> = loops.iter().flatten().copied().collect();
        let mut rims = Rims { edges: HashSet::new(), beyond: HashMap::new(), about: fair::About::default() };
        for (i, t) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if corners.contains(&a) {
                    let joined = rims.about.joined.entry(a).or_default();
                    joined.extend([b, t[(k + 2) % 3]]);
                }
                if corners.contains(&a) && corners.contains(&b) {
                    rims.edges.insert((a.min(b), a.max(b)));
                    rims.beyond.insert((b, a), crate::distance::triangle::normal(mesh.corners(i)));
                }
            }
        }
        rims
    }

    /// Normals beyond the sides of a loop.
    fn slopes(&self, rim: &[u32]) -> Vec<Option<Vec3>> {
        (0..rim.len()).map(|i| self.beyond.get(&(rim[i], rim[(i + 1) % rim.len()])).copied()).collect()
    }
}

/// Triangles that close a loop, parted by its narrowest chord while it is long.
fn part(mesh: &Mesh, rims: &Rims, rim: &[u32], out: &mut Vec<[u32; 3]>) {
    let mut work = vec![rim.to_vec()];
    while let Some(rim) = work.pop() {
        let n = rim.len();
        if n <= LONG {
            triangulate(mesh, rims, &rim, out);
            continue;
        }
        // The chord that is shortest for the way along the rim that it saves; both parts keep a quarter.
        let at = |i: usize| mesh.vertices[rim[i] as usize];
        let mut along = vec![0.0; n + 1];
        for i in 0..n {
            along[i + 1] = along[i] + norm(sub(at((i + 1) % n), at(i)));
        }
        let mut best = (f64::INFINITY, 0, n / 2);
        let step = n.div_ceil(2000);
        for i in (0..n).step_by(step) {
            for j in (i + n / 4..n.min(i + n - n / 4 + 1)).step_by(step) {
                let way = along[j] - along[i];
                let saved = way.min(along[n] - way);
                let cost = norm(sub(at(j), at(i))) / saved.max(f64::MIN_POSITIVE);
                let new = !rims.edges.contains(&(rim[i].min(rim[j]), rim[i].max(rim[j])));
                if new && cost < best.0 {
                    best = (cost, i, j);
                }
            }
        }
        let (_, i, j) = best;
        work.push(rim[i..=j].to_vec());
        work.push(rim[j..].iter().chain(&rim[..=i]).copied().collect());
    }
}

/// The best triangulation of a loop of not too many corners.
fn triangulate(mesh: &Mesh, rims: &Rims, rim: &[u32], out: &mut Vec<[u32; 3]>) {
    let n = rim.len();
    if n < 3 {
        return;
    }
    let at: Vec<Vec3> = rim.iter().map(|v| mesh.vertices[*v as usize]).collect();
    // Of the part from corner i to corner k (i < k): edges already taken, worst fold, area, and its middle corner.
    #[derive(Clone, Copy)]
    struct Best {
        taken: u32,
        fold: f64,
        area: f64,
        middle: u32,
    }
    let nothing = Best { taken: 0, fold: 0.0, area: 0.0, middle: 0 };
    let mut table = vec![nothing; n * n];
    let slope = |i: usize, k: usize| rims.beyond.get(&(rim[i], rim[k])).copied();
    let sides: Vec<Option<Vec3>> = (0..n).map(|i| slope(i, (i + 1) % n)).collect();
    let mut normals = vec![[0.0; 3]; n * n];
    let fold = |a: Vec3, b: Option<Vec3>| b.map_or(0.0, |b| 1.0 - dot(a, b));
    for span in 2..n {
        for i in 0..n - span {
            let k = i + span;
            let exists = rims.edges.contains(&(rim[i].min(rim[k]), rim[i].max(rim[k])));
            let taken = u32::from(exists && span + 1 < n);
            let mut best: Option<(Best, Vec3)> = None;
            for m in i + 1..k {
                let area = cross(sub(at[m], at[i]), sub(at[k], at[i]));
                let size = norm(area);
                let facing = if size > 0.0 { unit(area) } else { [0.0; 3] };
                let (left, right) = (&table[i * n + m], &table[m * n + k]);
                let beside = |a: usize, b: usize| {
                    if b == a + 1 { sides[a] } else { Some(normals[a * n + b]) }
                };
                let mut worst = fold(facing, beside(i, m)).max(fold(facing, beside(m, k)));
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
            out.push([rim[i], rim[m], rim[k]]);
            work.extend([(i, m), (m, k)]);
        }
    }
}
