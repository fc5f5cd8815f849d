//! The background of volume meshes: body-centred cubic tetrahedra that end exactly at the planes of a region's bounds.
//!
//! Nodes are the corners of cubes and their centres. A tetrahedron lies about the segment between the centres of adjacent
//! cubes and has one edge of their common face. At a bounding plane that segment ends at the centre of the face: half a
//! tetrahedron, with dihedral angles of 45°, 60° and 90°. The cubes are stretched a little along each axis, so that a whole
//! number of them lies between two planes.

use geometry::math::{Aabb, Vec3};
use geometry::progress::checkpoint;
use rayon::prelude::*;

/// Cubes along each edge of a block that is kept or skipped as a whole.
const BLOCK: usize = 4;
/// Distance of nodes that are at one place, as a fraction of half the edge of a cube.
const ROUNDING: f64 = 1e-9;
/// No node.
const NONE: u32 = u32::MAX;

/// Where the cubes are.
#[derive(Clone, Debug)]
pub(super) struct CubeGrid {
    /// Cubes along each axis.
    pub count: [usize; 3],
    /// The box that they fill; its faces that bound the region are exact.
    pub bounds: Aabb,
}

impl CubeGrid {
    /// Cubes of about `edge` (mm) in `bounds`, which grow by a margin on sides without a bounding plane; `planes[axis]` says which
    /// of the lower and upper side has one.
    pub fn new(bounds: &Aabb, planes: [[bool; 2]; 3], edge: f64) -> CubeGrid {
        let (mut count, mut grown) = ([0; 3], *bounds);
        for a in 0..3 {
            let length = bounds.max[a] - bounds.min[a];
            let whole = planes[a] == [true; 2];
            let inner = if whole { (length / edge).round().max(1.0) } else { (length / edge).ceil().max(1.0) };
            let step = if whole { length / inner } else { edge };
            let spare = inner * step - length;
            count[a] = inner as usize;
            match planes[a] {
                [true, true] => {}
                [true, false] => grown.max[a] += spare + step,
                [false, true] => grown.min[a] -= spare + step,
                [false, false] => {
                    grown.min[a] -= 0.5 * spare + step;
                    grown.max[a] += 0.5 * spare + step;
                }
            }
            count[a] += planes[a].iter().filter(|p| !**p).count();
        }
        CubeGrid { count, bounds: grown }
    }

    /// Coordinate of a plane of corners along an axis; the last one exactly at the upper bound.
    fn plane(&self, axis: usize, i: usize) -> f64 {
        let (lo, hi, n) = (self.bounds.min[axis], self.bounds.max[axis], self.count[axis]);
        if i == n { hi } else { lo + (hi - lo) * (i as f64 / n as f64) }
    }

    /// Coordinate of the centres of cubes along an axis.
    fn middle(&self, axis: usize, i: usize) -> f64 {
        let (lo, hi, n) = (self.bounds.min[axis], self.bounds.max[axis], self.count[axis]);
        lo + (hi - lo) * ((i as f64 + 0.5) / n as f64)
    }

    /// Cubes of which there is one more along each axis, in the same box.
    pub fn finer(&self) -> CubeGrid {
        CubeGrid { count: self.count.map(|n| n + 1), ..self.clone() }
    }

    /// Whether a node of a periodic cell may lack images: at an edge of the cell where a node of the background, or the middle between two,
    /// is. A surface that goes exactly through one, as those of symmetric cells do, leaves matter at some of its images alone.
    pub fn may_lack_image(&self, p: Vec3) -> bool {
        let step = self.step();
        let free: Vec<usize> =
            (0..3).filter(|a| p[*a] != self.bounds.min[*a] && p[*a] != self.bounds.max[*a]).collect();
        let between = |a: usize| 2.0 * (p[a] - self.bounds.min[a]) / step[a];
        match free[..] {
            [] => true,
            [a] => (between(a) - between(a).round()).abs() < ROUNDING,
            _ => false,
        }
    }

    /// Edges of a cube (mm).
    pub fn step(&self) -> Vec3 {
        core::array::from_fn(|a| (self.bounds.max[a] - self.bounds.min[a]) / self.count[a] as f64)
    }

    /// Which cubes may matter, x fastest: those of blocks for whose box `matters` is true.
    pub fn active(&self, matters: &(impl Fn(&Aabb) -> bool + Sync)) -> Vec<bool> {
        let blocks = self.count.map(|n| n.div_ceil(BLOCK));
        let range = |i: usize, a: usize| (i * BLOCK, ((i + 1) * BLOCK).min(self.count[a]));
        let keep: Vec<bool> = (0..blocks.iter().product::<usize>())
            .into_par_iter()
            .map(|i| {
                let at = [i % blocks[0], i / blocks[0] % blocks[1], i / blocks[0] / blocks[1]];
                let corner = |upper: bool| -> Vec3 {
                    core::array::from_fn(|a| {
                        let (lo, hi) = range(at[a], a);
                        self.plane(a, if upper { hi } else { lo })
                    })
                };
                matters(&Aabb { min: corner(false), max: corner(true) })
            })
            .collect();
        let [nx, ny, nz] = self.count;
        let mut out = Vec::with_capacity(nx * ny * nz);
        for z in 0..nz {
            for y in 0..ny {
                let row = (z / BLOCK * blocks[1] + y / BLOCK) * blocks[0];
                out.extend((0..nx).map(|x| keep[row + x / BLOCK]));
            }
        }
        out
    }

    /// Nodes and positively oriented tetrahedra about the faces of the active cubes.
    pub fn tetrahedra(&self, active: &[bool]) -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let [nx, ny, nz] = self.count;
        let mut made = Maker {
            cubes: self,
            corners: [vec![NONE; (nx + 1) * (ny + 1)], vec![NONE; (nx + 1) * (ny + 1)]],
            centres: [vec![NONE; nx * ny], vec![NONE; nx * ny]],
            nodes: Vec::new(),
            tets: Vec::new(),
        };
        let on = |c: [usize; 3]| active[(c[2] * ny + c[1]) * nx + c[0]];
        for z in 0..nz {
            checkpoint();
            if z > 0 {
                made.corners.swap(0, 1);
                made.centres.swap(0, 1);
            }
            made.corners[1].fill(NONE);
            made.centres[1].fill(NONE);
            for y in 0..ny {
                for x in 0..nx {
                    let c = [x, y, z];
                    for axis in 0..3 {
                        if c[axis] == 0 && on(c) {
                            made.face(c, z, axis, false);
                        }
                        let mut next = c;
                        next[axis] += 1;
                        if on(c) || next[axis] < self.count[axis] && on(next) {
                            made.face(c, z, axis, true);
                        }
                    }
                }
            }
        }
        (made.nodes, made.tets)
    }
}

/// Makes the tetrahedra layer by layer: the numbers of two planes of corners and two layers of centres are at hand.
struct Maker<'a> {
    cubes: &'a CubeGrid,
    corners: [Vec<u32>; 2],
    centres: [Vec<u32>; 2],
    nodes: Vec<Vec3>,
    tets: Vec<[u32; 4]>,
}

impl Maker<'_> {
    fn corner(&mut self, c: [usize; 3], layer: usize) -> u32 {
        let at = &mut self.corners[c[2] - layer][c[1] * (self.cubes.count[0] + 1) + c[0]];
        if *at == NONE {
            *at = self.nodes.len() as u32;
            self.nodes.push(core::array::from_fn(|a| self.cubes.plane(a, c[a])));
        }
        *at
    }

    fn centre(&mut self, c: [usize; 3], layer: usize) -> u32 {
        let at = &mut self.centres[c[2] - layer][c[1] * self.cubes.count[0] + c[0]];
        if *at == NONE {
            *at = self.nodes.len() as u32;
            self.nodes.push(core::array::from_fn(|a| self.cubes.middle(a, c[a])));
        }
        *at
    }

    /// The tetrahedra about the lower or upper face of cube `c` of a layer along an axis.
    fn face(&mut self, c: [usize; 3], layer: usize, axis: usize, upper: bool) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |du: usize, dv: usize| {
            let mut k = c;
            k[axis] += usize::from(upper);
            k[u] += du;
            k[v] += dv;
            k
        };
        let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)].map(|k| self.corner(k, layer));
        let here = self.centre(c, layer);
        let mut next = c;
        next[axis] += 1;
        let beyond = if upper && next[axis] < self.cubes.count[axis] {
            self.centre(next, layer)
        } else {
            let at = core::array::from_fn(|a| {
                if a == axis { self.cubes.plane(a, c[a] + usize::from(upper)) } else { self.cubes.middle(a, c[a]) }
            });
            self.nodes.push(at);
            self.nodes.len() as u32 - 1
        };
        let [low, high] = if upper { [here, beyond] } else { [beyond, here] };
        for i in 0..4 {
            self.tets.push([ring[i], ring[(i + 1) % 4], low, high]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::tetmesh::TetMesh;

    #[test]
    fn the_background_fills_its_box_face_to_face() {
        let bounds = Aabb { min: [0.0, -1.0, 2.0], max: [3.0, 1.5, 4.0] };
        let cubes = CubeGrid::new(&bounds, [[true; 2]; 3], 0.5);
        assert_eq!(cubes.count, [6, 5, 4]);
        let active = cubes.active(&|_| true);
        let (nodes, tets) = cubes.tetrahedra(&active);
        let mesh = TetMesh { nodes, tets, zones: Vec::new() };
        // Sums of a thousand products of numbers near one.
        assert!((mesh.volume() - 15.0).abs() < 1e-12);
        let (mesh, checked) = mesh.checked().expect("conforming");
        assert_eq!((checked.pieces, checked.pinched, checked.turned), (1, 0, false));
        let q = mesh.quality().expect("tetrahedra");
        assert!(q.dihedral.min > 44.9 && q.dihedral.max < 90.1);
        assert_eq!(q.bounds, [bounds.min, bounds.max]);
    }

    #[test]
    fn sides_without_a_plane_have_a_margin() {
        let bounds = Aabb { min: [0.0; 3], max: [1.0; 3] };
        let cubes = CubeGrid::new(&bounds, [[true, false], [false, false], [true, true]], 0.3);
        assert_eq!(cubes.bounds.min[0], 0.0);
        assert!(cubes.bounds.max[0] >= 1.3 && cubes.bounds.min[1] <= -0.3 && cubes.bounds.max[1] >= 1.3);
        assert_eq!((cubes.bounds.min[2], cubes.bounds.max[2]), (0.0, 1.0));
    }
}
