//! Point location in a tetrahedral mesh: a position is represented by a tetrahedron and barycentric coordinates, which
//! are affine in each tetrahedron and continuous across faces (equations 12 and 13 of Chen et al.). Those at the boundary may be bent
//! onto the surface of a region (`curved_tets`).

use std::collections::{HashMap, VecDeque};

use super::bent_tets::Curves;
use geometry::fault::{Fault, position};
use geometry::math::{Aabb, Mat3, Vec3, add, cross, dot, inverse, norm, scale, sub, transpose};
use geometry::tetmesh::{FACES, TetMesh};

/// No tetrahedron.
pub const NONE: u32 = u32::MAX;

/// Boxes of the index for each tetrahedron, and their maximum number.
const BOXES: f64 = 32.0;
const MOST: f64 = 4e6;

/// A tetrahedral mesh with point location.
pub struct CarrierMesh {
    nodes: Vec<Vec3>,
    /// Nodes ascending, so that tetrahedra with a common face have its corners in the same order.
    tets: Vec<[u32; 4]>,
    /// Whether ascending order is negative.
    flipped: Vec<bool>,
    zones: Vec<i64>,
    /// The tetrahedron across the face opposite each corner.
    across: Vec<[u32; 4]>,
    /// The gradients (per mm) of the first three barycentric coordinates.
    slopes: Vec<Mat3>,
    bounds: Aabb,
    boxes: Boxes,
    /// Overlap: the barycentric distance by which a tetrahedron extends beyond its faces.
    overlap: f64,
    /// How tetrahedra at the boundary are bent, if they are.
    curves: Option<Curves>,
}

/// A uniform grid of boxes, with the tetrahedra that each may intersect.
struct Boxes {
    min: Vec3,
    edge: f64,
    shape: [usize; 3],
    /// For each box the box whose list applies: its own, or the nearest non-empty one.
    owner: Vec<u32>,
    first: Vec<u32>,
    list: Vec<u32>,
}

impl Boxes {
    fn box_at(&self, p: Vec3) -> [usize; 3] {
        [0, 1, 2].map(|a| {
            let i = ((p[a] - self.min[a]) / self.edge).floor();
            (i.max(0.0) as usize).min(self.shape[a] - 1)
        })
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.shape[1] + j) * self.shape[0] + i
    }

    fn of(&self, index: usize) -> &[u32] {
        let o = self.owner[index] as usize;
        &self.list[self.first[o] as usize..self.first[o + 1] as usize]
    }
}

impl CarrierMesh {
    /// A conforming mesh of positively oriented tetrahedra. With an `overlap` (below 1/4) tetrahedra are also found
    /// slightly outside, where all coordinates are above −overlap.
    ///
    /// # Errors
    /// No tetrahedron, an inverted or flat one, a face of more than two tetrahedra.
    pub fn new(mesh: &TetMesh, overlap: f64) -> Result<CarrierMesh, Fault> {
        if mesh.tets.is_empty() {
            return Err(Fault::new("tets", "the mesh has no tetrahedron"));
        }
        let mut tets = mesh.tets.clone();
        let mut flipped = vec![false; tets.len()];
        let mut slopes = Vec::with_capacity(tets.len());
        let mut bounds = Aabb::EMPTY;
        for (n, (t, flip)) in tets.iter_mut().zip(&mut flipped).enumerate() {
            let at = |t: &[u32; 4]| t.map(|v| mesh.nodes[v as usize]);
            let positive = volume(at(t)) > 0.0;
            // Sorting four by adjacent swaps, each of which reverses the orientation.
            let mut swaps = 0;
            for _ in 0..3 {
                for i in 0..3 {
                    if t[i] > t[i + 1] {
                        t.swap(i, i + 1);
                        swaps += 1;
                    }
                }
            }
            let corners = at(t);
            let to = columns(&corners);
            let m = inverse(&to);
            if !positive || m.as_flattened().iter().any(|v| !v.is_finite()) {
                let message =
                    format!("tetrahedron {n}, at {}, is inverted or flat; mesh the part again", position(corners[0]));
                return Err(Fault::new("tets", message));
            }
            *flip = swaps % 2 == 1;
            slopes.push(m);
            bounds = corners.iter().fold(bounds, |b, p| b.with(*p));
        }
        let across = across(&tets)?;
        let mut out = CarrierMesh {
            nodes: mesh.nodes.clone(),
            zones: mesh.zones.clone(),
            across,
            flipped,
            slopes,
            bounds,
            boxes: Boxes {
                min: bounds.min,
                edge: 1.0,
                shape: [1; 3],
                owner: Vec::new(),
                first: Vec::new(),
                list: Vec::new(),
            },
            overlap,
            tets,
            curves: None,
        };
        out.index();
        Ok(out)
    }

    /// Its boundary bent.
    pub(super) fn with(mut self, curves: Curves) -> CarrierMesh {
        self.curves = Some(curves);
        self.index();
        self
    }

    /// How tetrahedra at the boundary are bent onto a region, if they are.
    pub(crate) fn curves(&self) -> Option<&Curves> {
        self.curves.as_ref()
    }

    /// Whether any tetrahedron is bent.
    pub fn is_bent(&self) -> bool {
        self.curves.as_ref().is_some_and(|c| (0..self.len()).any(|t| c.bends(t)))
    }

    /// The distance of the bent boundary from the surface of the region, in edges of its triangles, at most; `None` if the mesh
    /// is not bent onto one.
    pub fn off_region(&self) -> Option<f64> {
        self.curves.as_ref().map(|c| c.off)
    }

    /// The place where that distance is greatest, with it.
    pub fn farthest_off(&self) -> Option<(f64, Vec3)> {
        self.curves.as_ref().map(|c| (c.off, c.off_at))
    }

    /// Whether its bent boundary is the surface of a region within a tenth of its edges, in all but few places.
    pub fn fits(&self) -> bool {
        self.curves.as_ref().is_some_and(Curves::fits)
    }

    /// Sorts tetrahedra into boxes; empty boxes refer to a nearest non-empty one.
    fn index(&mut self) {
        let size = self.bounds.size();
        let wanted = (BOXES * self.tets.len() as f64).min(MOST);
        let edge = (size.iter().product::<f64>() / wanted).cbrt();
        let longest = size.iter().fold(0.0f64, |m, s| m.max(*s));
        let edge = edge.max(longest / 1000.0);
        let shape = size.map(|s| ((s / edge).ceil() as usize).max(1));
        self.boxes.edge = edge;
        self.boxes.shape = shape;
        let total = shape.iter().product::<usize>();
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for t in 0..self.tets.len() {
            let corners = self.grown(t);
            let b = corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
            let (lo, hi) = (self.boxes.box_at(b.min), self.boxes.box_at(b.max));
            let planes = planes(&corners);
            for k in lo[2]..=hi[2] {
                for j in lo[1]..=hi[1] {
                    for i in lo[0]..=hi[0] {
                        let at = [i, j, k];
                        let middle: Vec3 = core::array::from_fn(|a| self.boxes.min[a] + (at[a] as f64 + 0.5) * edge);
                        // The box is outside a face if its nearest vertex is; with a margin for rounding.
                        let out = planes.iter().any(|(n, d)| {
                            let reach = 0.500001 * edge * n.iter().map(|v| v.abs()).sum::<f64>();
                            dot(*n, middle) - d > reach
                        });
                        if !out {
                            pairs.push((self.boxes.index(at) as u32, t as u32));
                        }
                    }
                }
            }
        }
        pairs.sort_unstable();
        let mut first = vec![0u32; total + 1];
        for (b, _) in &pairs {
            first[*b as usize + 1] += 1;
        }
        for i in 0..total {
            first[i + 1] += first[i];
        }
        let mut owner = vec![NONE; total];
        let mut queue = VecDeque::new();
        for b in 0..total {
            if first[b + 1] > first[b] {
                owner[b] = b as u32;
                queue.push_back(b);
            }
        }
        while let Some(b) = queue.pop_front() {
            let at = [b % shape[0], b / shape[0] % shape[1], b / shape[0] / shape[1]];
            for a in 0..3 {
                for up in [false, true] {
                    if (up && at[a] + 1 == shape[a]) || (!up && at[a] == 0) {
                        continue;
                    }
                    let mut n = at;
                    n[a] = if up { at[a] + 1 } else { at[a] - 1 };
                    let n = self.boxes.index(n);
                    if owner[n] == NONE {
                        owner[n] = owner[b];
                        queue.push_back(n);
                    }
                }
            }
        }
        self.boxes.owner = owner;
        self.boxes.first = first;
        self.boxes.list = pairs.into_iter().map(|p| p.1).collect();
    }

    /// The vertices of a tetrahedron enlarged by the overlap, and so that it holds its bends.
    fn grown(&self, t: usize) -> [Vec3; 4] {
        let corners = self.corners(t);
        let by = self.curves.as_ref().map_or([0.0; 4], |c| c.reach(t)).map(|r| r + self.overlap);
        let all: f64 = by.iter().sum();
        core::array::from_fn(|i| {
            let weight = |k: usize| if k == i { 1.0 + all - by[k] } else { -by[k] };
            (0..4).fold([0.0; 3], |s, k| add(s, scale(corners[k], weight(k))))
        })
    }

    /// Number of tetrahedra.
    pub fn len(&self) -> usize {
        self.tets.len()
    }

    /// Whether there are none; never.
    pub fn is_empty(&self) -> bool {
        self.tets.is_empty()
    }

    /// The nodes (mm).
    pub fn nodes(&self) -> &[Vec3] {
        &self.nodes
    }

    /// The nodes of a tetrahedron, ascending.
    pub fn tet(&self, t: usize) -> [u32; 4] {
        self.tets[t]
    }

    /// Whether its nodes in ascending order are in negative order.
    pub fn flipped(&self, t: usize) -> bool {
        self.flipped[t]
    }

    /// The zone of a tetrahedron; 0 where there are none.
    pub fn zone(&self, t: usize) -> i64 {
        self.zones.get(t).copied().unwrap_or(0)
    }

    /// For each node, the fraction of the volume of its tetrahedra that belongs to some zones.
    pub fn shares(&self, wanted: impl Fn(i64) -> bool) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.nodes.len()];
        for t in 0..self.len() {
            let v = self.volume(t);
            let part = if wanted(self.zone(t)) { v } else { 0.0 };
            for n in self.tets[t] {
                let s = &mut sums[n as usize];
                *s = (s.0 + part, s.1 + v);
            }
        }
        let share = |(part, all): (f64, f64)| if all > 0.0 { part / all } else { 0.0 };
        sums.into_iter().map(share).collect()
    }

    /// The tetrahedron across the face opposite each corner, or [`NONE`].
    pub fn across(&self, t: usize) -> [u32; 4] {
        self.across[t]
    }

    /// The vertices (mm) of a tetrahedron.
    pub fn corners(&self, t: usize) -> [Vec3; 4] {
        self.tets[t].map(|v| self.nodes[v as usize])
    }

    /// The gradients (per mm) of the first three barycentric coordinates of the flat tetrahedron; the fourth's is minus their sum.
    pub fn slopes(&self, t: usize) -> &Mat3 {
        &self.slopes[t]
    }

    /// These gradients of the tetrahedron as it is bent, where its coordinates are `l`.
    pub fn slopes_at(&self, t: usize, l: [f64; 4]) -> Mat3 {
        let bent = self.curves.as_ref().and_then(|c| c.slopes(t, l, &columns(&self.corners(t))));
        bent.unwrap_or(self.slopes[t])
    }

    /// The factor by which functions of the coordinates may be steeper than in the flat tetrahedron.
    pub fn steeper(&self, t: usize) -> f64 {
        self.curves.as_ref().map_or(1.0, |c| c.steeper(t))
    }

    /// The point (mm) whose barycentric coordinates in a tetrahedron as it is bent are `l`.
    pub fn place(&self, t: usize, l: [f64; 4]) -> Vec3 {
        let flat = self.corners(t).iter().zip(l).fold([0.0; 3], |s, (p, v)| add(s, scale(*p, v)));
        self.curves.as_ref().map_or(flat, |c| add(flat, c.moved(t, l)))
    }

    /// Volume (mm³) of a flat tetrahedron.
    pub fn volume(&self, t: usize) -> f64 {
        volume(self.corners(t)).abs()
    }

    /// Bounds of the mesh.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The overlap, in barycentric coordinates.
    pub fn overlap(&self) -> f64 {
        self.overlap
    }

    /// The mean length of the edges of tetrahedra, mm.
    pub fn mean_edge(&self) -> f64 {
        let pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        let edges = (0..self.len()).flat_map(|t| {
            let c = self.corners(t);
            pairs.map(|[a, b]| norm(sub(c[a], c[b])))
        });
        edges.sum::<f64>() / (6 * self.len()) as f64
    }

    /// The flat boundary, counter-clockwise seen from outside.
    pub fn boundary(&self) -> geometry::mesh::Mesh {
        let mut out = geometry::mesh::Mesh::default();
        let mut names: HashMap<u32, u32> = HashMap::new();
        for f in self.boundary_nodes() {
            let named = f.map(|v| {
                *names.entry(v).or_insert_with(|| {
                    out.vertices.push(self.nodes[v as usize]);
                    out.vertices.len() as u32 - 1
                })
            });
            out.triangles.push(named);
        }
        out
    }

    /// The faces on the boundary, counter-clockwise seen from outside: of which tetrahedron, and which of its corners.
    pub(crate) fn boundary_faces(&self) -> Vec<(usize, [usize; 3])> {
        let mut out = Vec::new();
        for t in 0..self.len() {
            for (_, f) in FACES.iter().enumerate().filter(|f| self.across[t][f.0] == NONE) {
                out.push((t, if self.flipped[t] { [f[0], f[2], f[1]] } else { *f }));
            }
        }
        out
    }

    /// The nodes of the faces on the boundary, in their order.
    pub(crate) fn boundary_nodes(&self) -> Vec<[u32; 3]> {
        self.boundary_faces().into_iter().map(|(t, f)| f.map(|i| self.tets[t][i])).collect()
    }

    /// Barycentric coordinates of a point with respect to a tetrahedron as it is bent.
    #[inline]
    pub fn bary(&self, t: usize, p: Vec3) -> [f64; 4] {
        let flat = self.flat_bary(t, p);
        self.curves.as_ref().map_or(flat, |c| c.bary(t, flat, f64::NEG_INFINITY))
    }

    /// Barycentric coordinates of a point with respect to a flat tetrahedron.
    #[inline]
    fn flat_bary(&self, t: usize, p: Vec3) -> [f64; 4] {
        let d = sub(p, self.nodes[self.tets[t][3] as usize]);
        let m = &self.slopes[t];
        let l = [dot(m[0], d), dot(m[1], d), dot(m[2], d)];
        [l[0], l[1], l[2], 1.0 - l[0] - l[1] - l[2]]
    }

    /// The tetrahedron that contains a point, and the barycentric coordinates; outside the mesh, a nearby tetrahedron,
    /// with some coordinates negative.
    pub fn locate(&self, p: Vec3) -> (usize, [f64; 4]) {
        let lowest = |l: &[f64; 4]| l.iter().copied().fold(f64::INFINITY, f64::min);
        let near = self.boxes.of(self.boxes.index(self.boxes.box_at(p)));
        let mut best = (f64::NEG_INFINITY, 0, [0.25; 4]);
        for &t in near {
            let l = self.flat_bary(t as usize, p);
            if lowest(&l) > best.0 {
                best = (lowest(&l), t as usize, l);
                if best.0 >= 0.0 {
                    break;
                }
            }
        }
        let Some(curves) = &self.curves else { return (best.1, best.2) };
        // That of the flat mesh is mostly that of the bent one too, so others are soon ruled out.
        let first = best.1 as u32;
        best = (f64::NEG_INFINITY, 0, best.2);
        for &t in std::iter::once(&first).chain(near.iter().filter(|t| **t != first)) {
            let flat = self.flat_bary(t as usize, p);
            let sway = curves.sway(t as usize);
            if (0..4).any(|k| flat[k] + sway[k] < best.0) {
                continue;
            }
            let l = curves.bary(t as usize, flat, best.0);
            if lowest(&l) > best.0 {
                best = (lowest(&l), t as usize, l);
                if best.0 >= 0.0 {
                    break;
                }
            }
        }
        (best.1, best.2)
    }

    /// Calls `f` with every tetrahedron in whose overlap a point lies; with that of `locate` if there is none.
    pub fn each_near(&self, p: Vec3, mut f: impl FnMut(usize, [f64; 4])) {
        let mut none = true;
        for &t in self.boxes.of(self.boxes.index(self.boxes.box_at(p))) {
            let l = self.bary(t as usize, p);
            if l.iter().all(|v| *v > -self.overlap) {
                none = false;
                f(t as usize, l);
            }
        }
        if none {
            let (t, l) = self.locate(p);
            f(t, l);
        }
    }

    /// Calls `f` with all tetrahedra, possibly repeated, in which points of a box may be located; `false` if there are
    /// more than `most`.
    pub fn each_in(&self, b: &Aabb, most: usize, mut f: impl FnMut(usize)) -> bool {
        let (lo, hi) = (self.boxes.box_at(b.min), self.boxes.box_at(b.max));
        let boxes: usize = (0..3).map(|a| hi[a] - lo[a] + 1).product();
        if boxes > most {
            return false;
        }
        let mut left = most;
        for k in lo[2]..=hi[2] {
            for j in lo[1]..=hi[1] {
                for i in lo[0]..=hi[0] {
                    let of = self.boxes.of(self.boxes.index([i, j, k]));
                    if of.len() > left {
                        return false;
                    }
                    left -= of.len();
                    of.iter().for_each(|t| f(*t as usize));
                }
            }
        }
        true
    }
}

/// The signed volume of a tetrahedron, mm³.
pub(super) fn volume([a, b, c, d]: [Vec3; 4]) -> f64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0
}

/// The edges from the fourth vertex as columns: the matrix from the first three coordinates to the position.
fn columns(c: &[Vec3; 4]) -> Mat3 {
    transpose(&[sub(c[0], c[3]), sub(c[1], c[3]), sub(c[2], c[3])])
}

/// Outward normals and offsets of the faces.
fn planes(c: &[Vec3; 4]) -> [(Vec3, f64); 4] {
    core::array::from_fn(|i| {
        let [p, q, r] = FACES[i].map(|k| c[k]);
        let n = cross(sub(q, p), sub(r, p));
        // The opposite vertex lies inside, for either orientation.
        let n = if dot(n, sub(c[i], p)) > 0.0 { scale(n, -1.0) } else { n };
        (n, dot(n, p))
    })
}

/// The tetrahedron across each face.
fn across(tets: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, Fault> {
    let mut faces: Vec<([u32; 3], u32)> = Vec::with_capacity(4 * tets.len());
    for (n, t) in tets.iter().enumerate() {
        for i in 0..4 {
            let f: [u32; 3] = core::array::from_fn(|k| t[k + usize::from(k >= i)]);
            faces.push((f, (4 * n + i) as u32));
        }
    }
    faces.sort_unstable();
    let mut out = vec![[NONE; 4]; tets.len()];
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        match same {
            [_] => {}
            [(_, a), (_, b)] => {
                out[*a as usize / 4][*a as usize % 4] = b / 4;
                out[*b as usize / 4][*b as usize % 4] = a / 4;
            }
            more => {
                let message = format!(
                    "the face of nodes {:?} belongs to {} tetrahedra; a face has one or two",
                    more[0].0,
                    more.len()
                );
                return Err(Fault::new("tets", message));
            }
        }
    }
    Ok(out)
}
