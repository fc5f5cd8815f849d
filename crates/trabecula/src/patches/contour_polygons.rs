//! Polygons of an implicit surface in the cells of a grid: what meets each cell, as loops over the grid edges that it crosses.
//!
//! As marching cubes does, but without its triangles: loops follow from the signs at nodes and, on cell faces whose corners
//! alternate, from the sign at the saddle of the bilinear interpolant (Nielson and Hamann, IEEE Visualization 1991). A face's
//! segments depend on that face alone, so those of adjacent cells agree.

use std::collections::HashMap;

use geometry::math::Vec3;
use rayon::prelude::*;

/// The node planes of a grid along each axis (mm), ascending; the outermost are the planes of a box.
pub struct GridPlanes {
    /// Coordinates.
    pub axes: [Vec<f64>; 3],
}

impl GridPlanes {
    /// Number of nodes along each axis.
    pub fn shape(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].len())
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.shape().iter().product()
    }

    /// The number of a node; x runs fastest.
    pub fn node(&self, at: [usize; 3]) -> usize {
        let [nx, ny, _] = self.shape();
        at[0] + nx * (at[1] + ny * at[2])
    }

    /// The indices of a node.
    pub fn indices(&self, node: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape();
        [node % nx, node / nx % ny, node / (nx * ny)]
    }

    /// The position of a node (mm).
    pub fn position(&self, node: usize) -> Vec3 {
        let at = self.indices(node);
        [0, 1, 2].map(|a| self.axes[a][at[a]])
    }

    /// The two nodes of a grid edge.
    pub fn ends(&self, edge: u64) -> [usize; 2] {
        let (node, axis) = ((edge / 3) as usize, (edge % 3) as usize);
        let [nx, ny, _] = self.shape();
        [node, node + [1, nx, nx * ny][axis]]
    }

    /// The planes of the box in which a grid edge lies, each as 2 · axis + side.
    pub fn planes(&self, edge: u64) -> impl Iterator<Item = u8> + '_ {
        let (at, along) = (self.indices((edge / 3) as usize), (edge % 3) as usize);
        (0..3).filter(move |a| *a != along).filter_map(move |a| self.outer(a, at[a]))
    }

    /// The plane of the box that this node plane is.
    fn outer(&self, axis: usize, index: usize) -> Option<u8> {
        match index {
            0 => Some(2 * axis as u8),
            i if i + 1 == self.axes[axis].len() => Some(2 * axis as u8 + 1),
            _ => None,
        }
    }
}

/// A polygon: the crossed grid edges in order, counter-clockwise seen from the positive side.
pub struct ContourPolygon {
    /// For each corner its grid edge and the segment that leads from it to the next, by their numbers.
    pub corners: Vec<[u32; 2]>,
}

/// What two adjacent cells, or a cell and the box, have in common: a line across a cell face.
pub struct FaceSegment {
    /// The crossed grid edges that it joins.
    pub ends: [u32; 2],
    /// The polygons on its two sides; one on the box.
    pub polygons: Vec<u32>,
    /// The plane of the box in which it lies.
    pub plane: Option<u8>,
}

/// The polygons of a surface.
#[derive(Default)]
pub struct ContourPolygons {
    /// The crossed grid edges: 3 · node + axis.
    pub edges: Vec<u64>,
    /// The polygons.
    pub polygons: Vec<ContourPolygon>,
    /// The segments.
    pub segments: Vec<FaceSegment>,
    edge_numbers: HashMap<u64, u32>,
    segment_numbers: HashMap<(u64, u32), u32>,
}

/// Corners of a cell's faces, counter-clockwise seen from outside; bit a of a corner is its offset along axis a. Faces in the
/// order −x, +x, −y, +y, −z, +z.
const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

impl ContourPolygons {
    /// The polygons of the surface where a function is zero, from its values at the nodes of a grid. A value of zero counts as
    /// positive.
    pub fn new(grid: &GridPlanes, values: &[f64]) -> ContourPolygons {
        let mut made = ContourPolygons::default();
        let [nx, ny, nz] = grid.shape();
        let step = [1, nx, nx * ny];
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                for i in 0..nx - 1 {
                    let first = grid.node([i, j, k]);
                    let nodes: [usize; 8] =
                        core::array::from_fn(|c| first + (0..3).map(|a| (c >> a & 1) * step[a]).sum::<usize>());
                    let count = nodes.iter().filter(|n| values[**n] < 0.0).count();
                    if count > 0 && count < 8 {
                        made.cell(grid, values, [i, j, k], &nodes);
                    }
                }
            }
        }
        made
    }

    fn cell(&mut self, grid: &GridPlanes, values: &[f64], at: [usize; 3], nodes: &[usize; 8]) {
        // From each crossed edge the next one, and the segment between them.
        let mut next: Vec<(u32, u32, u32)> = Vec::with_capacity(12);
        for (f, corners) in FACES.iter().enumerate() {
            let (axis, side) = (f / 2, f % 2);
            let face = 3 * nodes[if side == 1 { 1 << axis } else { 0 }] as u64 + axis as u64;
            let plane = grid.outer(axis, at[axis] + side).filter(|p| usize::from(p % 2) == side);
            let v = corners.map(|c| values[nodes[c]]);
            for (from, to) in pairs(&v) {
                let edge = |i: usize| {
                    let [a, b] = [corners[i], corners[(i + 1) % 4]];
                    3 * nodes[a.min(b)] as u64 + u64::from((a ^ b).trailing_zeros())
                };
                let ends = [from, to].map(|i| self.edge(edge(i)));
                let segment = self.segment(face, ends, plane);
                next.push((ends[0], ends[1], segment));
            }
        }
        let mut used = vec![false; next.len()];
        for first in 0..next.len() {
            let mut corners = Vec::new();
            let mut here = first;
            while !used[here] {
                used[here] = true;
                let (edge, to, segment) = next[here];
                corners.push([edge, segment]);
                self.segments[segment as usize].polygons.push(self.polygons.len() as u32);
                here = next.iter().position(|n| n.0 == to).unwrap_or(first);
            }
            if !corners.is_empty() {
                self.polygons.push(ContourPolygon { corners });
            }
        }
    }

    fn edge(&mut self, edge: u64) -> u32 {
        *self.edge_numbers.entry(edge).or_insert_with(|| {
            self.edges.push(edge);
            self.edges.len() as u32 - 1
        })
    }

    fn segment(&mut self, face: u64, ends: [u32; 2], plane: Option<u8>) -> u32 {
        *self.segment_numbers.entry((face, ends[0].min(ends[1]))).or_insert_with(|| {
            self.segments.push(FaceSegment { ends, polygons: Vec::with_capacity(2), plane });
            self.segments.len() as u32 - 1
        })
    }

    /// The Euler characteristic of the surface.
    pub fn euler(&self) -> i64 {
        self.edges.len() as i64 - self.segments.len() as i64 + self.polygons.len() as i64
    }
}

/// How many grid edges a surface crosses: the number of faces of its net.
pub fn crossings(grid: &GridPlanes, values: &[f64]) -> usize {
    let [nx, ny, _] = grid.shape();
    let step = [1, nx, nx * ny];
    let of = |node: usize| {
        let at = grid.indices(node);
        let crossed =
            |a: &usize| at[*a] + 1 < grid.shape()[*a] && (values[node] < 0.0) != (values[node + step[*a]] < 0.0);
        (0..3).filter(crossed).count()
    };
    (0..grid.len()).into_par_iter().with_min_len(4096).map(of).sum()
}

/// The Euler characteristic of the surface where a function is zero, from its values at the nodes of a grid: that of its
/// `ContourPolygons`, without making them.
pub fn euler(grid: &GridPlanes, values: &[f64]) -> i64 {
    let [nx, ny, nz] = grid.shape();
    let step = [1, nx, nx * ny];
    let layer = |k: usize| {
        let mut sum = 0;
        for first in k * step[2]..(k + 1) * step[2] {
            let at = grid.indices(first);
            let inner = [0, 1, 2].map(|a| at[a] + 1 < grid.shape()[a]);
            let differs = |a: usize| inner[a] && (values[first] < 0.0) != (values[first + step[a]] < 0.0);
            sum += (0..3).filter(|a| differs(*a)).count() as i64;
            let node = |c: usize| first + (0..3).map(|a| (c >> a & 1) * step[a]).sum::<usize>();
            for f in [0, 2, 4] {
                let axis = f / 2;
                if (0..3).all(|a| a == axis || inner[a]) {
                    sum -= pairs(&FACES[f].map(|c| values[node(c)])).count() as i64;
                }
            }
            if inner == [true; 3] {
                let nodes: [usize; 8] = core::array::from_fn(node);
                let count = nodes.iter().filter(|n| values[**n] < 0.0).count();
                sum += if count > 0 && count < 8 { loops(values, &nodes) } else { 0 };
            }
        }
        sum
    };
    (0..nz).into_par_iter().map(layer).sum()
}

/// The number of polygons in a cell.
fn loops(values: &[f64], nodes: &[usize; 8]) -> i64 {
    let mut next = [[0usize; 2]; 12];
    let mut n = 0;
    for corners in FACES {
        for (from, to) in pairs(&corners.map(|c| values[nodes[c]])) {
            let edge = |i: usize| {
                let [a, b] = [corners[i], corners[(i + 1) % 4]];
                3 * a.min(b) + (a ^ b).trailing_zeros() as usize
            };
            next[n] = [edge(from), edge(to)];
            n += 1;
        }
    }
    let (mut used, mut count) = ([false; 12], 0);
    for first in 0..n {
        let mut here = first;
        count += i64::from(!used[here]);
        while !used[here] {
            used[here] = true;
            here = (0..n).find(|k| next[*k][0] == next[here][1]).unwrap_or(first);
        }
    }
    count
}

/// The segments of a cell face with these values at its corners, counter-clockwise seen from outside the cell: each from the
/// side (corner i to i + 1) where the boundary enters the negative region to one where it leaves it.
fn pairs(v: &[f64; 4]) -> impl Iterator<Item = (usize, usize)> {
    let negative = v.map(|v| v < 0.0);
    let enters = move |i: usize| !negative[i] && negative[(i + 1) % 4];
    let leaves = move |i: usize| negative[i] && !negative[(i + 1) % 4];
    let alternate = negative[0] == negative[2] && negative[1] == negative[3] && negative[0] != negative[1];
    // At the saddle of the bilinear interpolant: (v0 v2 − v1 v3) / (v0 + v2 − v1 − v3).
    let saddle = v[0] * v[2] - v[1] * v[3];
    let joined = if negative[0] { saddle > 0.0 } else { saddle < 0.0 };
    (0..4).filter(move |i| enters(*i)).filter_map(move |i| {
        let turn = if !alternate {
            (1..4).find(|d| leaves((i + d) % 4))?
        } else if joined {
            // Negative corners are joined: the segment cuts off the positive one before this side.
            3
        } else {
            1
        };
        Some((i, (i + turn) % 4))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize) -> GridPlanes {
        let axis: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        GridPlanes { axes: [axis.clone(), axis.clone(), axis] }
    }

    #[test]
    fn random_signs_make_closed_surfaces_with_boundary_on_the_box() {
        let g = grid(6);
        let mut seed = 5;
        for _ in 0..20 {
            let values: Vec<f64> = (0..g.len()).map(|_| geometry::random::random(&mut seed)).collect();
            let made = ContourPolygons::new(&g, &values);
            assert_eq!(euler(&g, &values), made.euler());
            for s in &made.segments {
                assert_eq!(s.polygons.len(), if s.plane.is_some() { 1 } else { 2 });
            }
            // Every corner of a polygon is on a crossed edge, and as many polygons meet there as cells.
            let mut around = vec![0; made.edges.len()];
            made.polygons.iter().flat_map(|p| &p.corners).for_each(|c| around[c[0] as usize] += 1);
            for (edge, count) in made.edges.iter().zip(around) {
                assert_eq!(count, 4 >> g.planes(*edge).count());
            }
        }
    }

    #[test]
    fn a_ball_is_a_sphere_and_a_torus_a_torus() {
        let g = grid(16);
        let at = |f: &dyn Fn(Vec3) -> f64| {
            let values: Vec<f64> = (0..g.len()).map(|n| f(g.position(n).map(|x| x - 0.5))).collect();
            let found = ContourPolygons::new(&g, &values).euler();
            assert_eq!(euler(&g, &values), found);
            found
        };
        assert_eq!(at(&|p| p.iter().map(|x| x * x).sum::<f64>() - 0.1), 2);
        assert_eq!(at(&|[x, y, z]| (x.hypot(y) - 0.3).hypot(z) - 0.13), 0);
    }
}
