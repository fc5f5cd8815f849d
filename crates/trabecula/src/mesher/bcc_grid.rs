//! The background lattice: body-centred cubic tetrahedra around a region, bisected where a smaller size is required.
//!
//! Two cubic lattices, the nodes of each at the cube centres of the other. A tetrahedron has one edge of each as
//! opposite edges (long, the cube edge) and four between them (short, √3/2 of it); its dihedral angles are 60° and 90°.
//! Source: Labelle & Shewchuk, Isosurface Stuffing, ACM Transactions on Graphics 26(3), 2007.
//!
//! Bisection at the longest edge passes through three more shapes and returns to the first at half the size (Maubach's
//! bisection of the orthoscheme), so angles do not degrade: all are between 45° and 120°.

use std::collections::HashMap;

use crate::field::Field;
use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3};
use geometry::progress::checkpoint;

/// Integer coordinate units per cube edge; the number of possible bisections is its logarithm.
const UNIT: i32 = 1 << 12;
/// Cubes per edge of a block that is kept or skipped as a whole.
const BLOCK: i32 = 4;

/// Tetrahedra with nodes of integer coordinates.
#[derive(Clone)]
pub(super) struct BccGrid {
    /// Node coordinates, in units.
    pub keys: Vec<[i32; 3]>,
    /// Tetrahedra, positively oriented; in those that are not bisected nodes 0, 1 belong to one lattice and 2, 3 to the
    /// other.
    pub tets: Vec<[u32; 4]>,
    origin: Vec3,
    unit: Vec3,
}

impl BccGrid {
    /// The tetrahedra of the lattice with cubes of edges `cube` (mm) that may intersect the region.
    ///
    /// **Errors**: more than `most` tetrahedra.
    pub fn new(region: &dyn Field, bounds: &Aabb, cube: Vec3, most: usize) -> Result<BccGrid, Fault> {
        let size = bounds.size();
        // The lattice is centred on the region, with planes on both sides of its bounds where they fit.
        let steps: Vec3 = core::array::from_fn(|a| (2.0 * size[a] / cube[a]).round());
        let origin = core::array::from_fn(|a| bounds.min[a] + (size[a] - steps[a] * cube[a] / 2.0) / 2.0);
        let mut grid = BccGrid { keys: Vec::new(), tets: Vec::new(), origin, unit: cube.map(|c| c / f64::from(UNIT)) };
        let many = || too_many(most);
        if (0..3).any(|a| size[a] / cube[a] > 1e5) {
            return Err(many());
        }
        let end: [i32; 3] = core::array::from_fn(|a| (size[a] / cube[a]).ceil() as i32 + 1);
        let margin = 0.5 * cube.into_iter().fold(0.0, f64::max);
        if grid.surely_more(region, end, most) {
            return Err(many());
        }
        let mut names = HashMap::new();
        let mut todo = vec![([-1; 3], end)];
        while let Some((low, high)) = todo.pop() {
            checkpoint();
            let block = grid.block(low, high);
            if region.bound(&block.grown(margin)).lo > 0.0 {
                continue;
            }
            if (0..3).any(|a| high[a] - low[a] > BLOCK) {
                todo.extend(halves(low, high));
                continue;
            }
            for z in low[2]..high[2] {
                for y in low[1]..high[1] {
                    for x in low[0]..high[0] {
                        grid.cube([x, y, z], &mut names);
                    }
                }
            }
            if grid.tets.len() > most {
                return Err(many());
            }
        }
        Ok(grid)
    }

    /// Whether the blocks inside the region hold more than `most` tetrahedra, counted without making them.
    fn surely_more(&self, region: &dyn Field, end: [i32; 3], most: usize) -> bool {
        let mut count = 0.0;
        let mut todo = vec![([-1; 3], end)];
        while let Some((low, high)) = todo.pop() {
            let range = region.bound(&self.block(low, high));
            let extent: [i32; 3] = core::array::from_fn(|a| high[a] - low[a]);
            if range.hi < 0.0 {
                count += 12.0 * extent.iter().map(|e| f64::from(*e)).product::<f64>();
                if count > most as f64 {
                    return true;
                }
            } else if range.lo <= 0.0 && extent.iter().any(|e| *e > 8 * BLOCK) {
                todo.extend(halves(low, high));
            }
        }
        false
    }

    /// The box of a block of cubes.
    fn block(&self, low: [i32; 3], high: [i32; 3]) -> Aabb {
        let reach = |c: [i32; 3]| self.position(c.map(|c| c * UNIT));
        Aabb { min: reach(low), max: reach(high) }
    }

    /// The tetrahedra around the three upper faces of a cube.
    fn cube(&mut self, c: [i32; 3], names: &mut HashMap<[i32; 3], u32>) {
        let mut name = |key: [i32; 3]| {
            *names.entry(key).or_insert_with(|| {
                self.keys.push(key);
                self.keys.len() as u32 - 1
            })
        };
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let here = c.map(|x| x * UNIT + UNIT / 2);
            let mut beyond = here;
            beyond[axis] += UNIT;
            let corner = |du: i32, dv: i32| {
                let mut k = c.map(|x| x * UNIT);
                k[axis] += UNIT;
                k[u] += du * UNIT;
                k[v] += dv * UNIT;
                k
            };
            let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for i in 0..4 {
                let t = [ring[i], ring[(i + 1) % 4], here, beyond].map(&mut name);
                self.tets.push(t);
            }
        }
    }

    /// The position of a node (mm).
    pub fn position(&self, key: [i32; 3]) -> Vec3 {
        core::array::from_fn(|a| self.origin[a] + self.unit[a] * f64::from(key[a]))
    }

    /// The positions of all nodes (mm).
    pub fn positions(&self) -> Vec<Vec3> {
        self.keys.iter().map(|k| self.position(*k)).collect()
    }

    /// The squared length of an edge, in units.
    pub fn length2(&self, a: u32, b: u32) -> i64 {
        let (a, b) = (self.keys[a as usize], self.keys[b as usize]);
        (0..3).map(|k| i64::from(a[k] - b[k]).pow(2)).sum()
    }

    /// Bisects tetrahedra until none is `coarse`, and the mesh is conforming.
    ///
    /// **Errors**: those of `coarse`; more than `most` tetrahedra.
    pub fn refine(
        &mut self,
        most: usize,
        mut coarse: impl FnMut([Vec3; 4]) -> Result<bool, Fault>,
    ) -> Result<(), Fault> {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut fine = vec![false; self.tets.len()];
        loop {
            let mut changed = false;
            let mut i = 0;
            while i < self.tets.len() {
                if i % 4096 == 0 {
                    checkpoint();
                }
                let t = self.tets[i];
                let torn = geometry::tetmesh::EDGES.iter().any(|[a, b]| middles.contains_key(&named(t[*a], t[*b])));
                if !torn && (fine[i] || !coarse(t.map(|n| self.position(self.keys[n as usize])))?) {
                    fine[i] = true;
                    i += 1;
                    continue;
                }
                let [a, b] = self.longest(t);
                let m = match middles.get(&named(t[a], t[b])) {
                    Some(m) => *m,
                    None => {
                        let (p, q) = (self.keys[t[a] as usize], self.keys[t[b] as usize]);
                        if (0..3).any(|k| (p[k] + q[k]) % 2 != 0) {
                            let message = format!(
                                "the least size is less than a thousandth of the greatest; the background is bisected \
                                 at most {} times",
                                3 * UNIT.ilog2()
                            );
                            return Err(Fault::new("size", message));
                        }
                        self.keys.push(core::array::from_fn(|k| (p[k] + q[k]) / 2));
                        let m = self.keys.len() as u32 - 1;
                        middles.insert(named(t[a], t[b]), m);
                        m
                    }
                };
                self.tets[i][b] = m;
                let mut other = t;
                other[a] = m;
                self.tets.push(other);
                fine[i] = false;
                fine.push(false);
                changed = true;
                if self.tets.len() > most {
                    return Err(too_many(most));
                }
            }
            if !changed {
                return Ok(());
            }
        }
    }

    /// The end points of the longest edge; of two, that of the first lattice.
    fn longest(&self, t: [u32; 4]) -> [usize; 2] {
        let rank = |[a, b]: [usize; 2]| {
            let first = self.keys[t[a] as usize].iter().all(|k| k % UNIT == 0);
            (self.length2(t[a], t[b]), first)
        };
        geometry::tetmesh::EDGES.into_iter().fold([0, 1], |m, e| if rank(e) > rank(m) { e } else { m })
    }
}

/// The halves of a block along its longest extent, the upper one first.
fn halves(low: [i32; 3], high: [i32; 3]) -> [([i32; 3], [i32; 3]); 2] {
    let extent = |a: usize| high[a] - low[a];
    let axis = (0..3).fold(0, |m, a| if extent(a) > extent(m) { a } else { m });
    let (mut left, mut right) = (high, low);
    left[axis] = low[axis] + extent(axis) / 2;
    right[axis] = left[axis];
    [(right, high), (low, left)]
}

fn named(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The refusal of a mesh of more tetrahedra than `most`.
pub(super) fn too_many(most: usize) -> Fault {
    let message = format!("a mesh of this size would have more than {most} tetrahedra; use a greater one");
    Fault::new("size", message)
}
