//! Rounded ends: a lattice and the region meet in a fillet instead of an edge.
//!
//! With a the lattice's function, divided by its steepness so that it is about a distance at its surface, and b the region's distance, the
//! intersection max(a, b) becomes min(max(a, b), −r) + |(max(a + r, 0), max(b + r, 0))|: within r of both surfaces the solid ends on a
//! quarter circle of radius r. A strut of that radius ends in a half ball, the edge of a wall 2r thick in a half circle.
//!
//! *Radii follow the lattice.* A strut is thinner in smaller and in flatter tetrahedra, where the lattice's function is steeper in proportion,
//! and at lower levels: its radius is that of a port of a regular tetrahedron that is as steep. So is that of a wall.
//!
//! *No surface is tangent to another.* Of a sheet both sides are rounded, and as half circles they would meet in their common tangent, which
//! is the region's face besides: what is cut there is decided by rounding. So r is a little more than half the wall at every place, the sides
//! meet in an obtuse ridge, and b is taken a little less deep than it is: what is rounded ends before the face.

use std::sync::Arc;

use super::{NodalLevel, Share, Tiling};
use crate::cell::Part;
use crate::field::{Block, Field, fill_points};
use crate::implicit::Implicit;
use crate::map::CarrierMesh;
use crate::map::bent_tets::within;
use crate::region::Region;
use geometry::math::{Aabb, Interval, Vec3, add, norm, scale};
use geometry::tetmesh::TetMesh;

/// Values within this share of the cell's range are near the surface.
const NEAR: f64 = 0.04;

/// Points at which steepness is looked for.
const SAMPLES: usize = 40_000;

/// By how much a tetrahedron may be steeper than the mean of those about a node: more it is where one is much smaller or flatter than the rest.
const SPREAD: f64 = 2.0;

/// The radius of a wall's end over half the wall, more than one, so that its sides meet at an angle of 2 acos(1 − 1/1.2), 160°.
const BLUNT: f64 = 1.2;

/// How far below the region's surface what is rounded ends, in radii.
const BELOW: f64 = 0.01;

/// A lattice with rounded ends.
pub struct Rounded {
    /// The lattice, or one side of its sheet.
    of: Arc<dyn Implicit>,
    region: Region,
    radius: Radius,
    /// The least and the greatest radius, mm.
    radii: Interval,
    /// The steepness (per mm) of the lattice at its surface.
    steepness: Steepness,
    parts: Vec<Arc<dyn Implicit>>,
}

/// The radius of ends.
#[derive(Clone)]
enum Radius {
    /// That of struts at the nodes of the mesh, mm.
    OfStruts(Arc<Vec<f64>>),
    /// That of walls.
    OfWalls,
}

/// |∇f| at the surface, as it varies with the size of tetrahedra.
#[derive(Clone)]
struct Steepness {
    tiling: Arc<Tiling>,
    at_nodes: Arc<Vec<f64>>,
}

impl Steepness {
    fn new(tiling: &Arc<Tiling>) -> Steepness {
        let range = tiling.cells[0].cell.range();
        let width = (range.hi - range.lo) / tiling.cells[0].scale;
        // The mean at points near the surface, in units of the bound of each tetrahedron.
        let step = tiling.map.len().div_ceil(200).max(1);
        let count = SAMPLES / tiling.map.len().clamp(1, 200);
        let mut ratios = Vec::new();
        for t in (0..tiling.map.len()).step_by(step) {
            let known = tiling.known(&tiling.points_in(t, count));
            let near = known.iter().filter(|k| tiling.cut.value(k.f, k.t).abs() < NEAR * width);
            ratios.extend(near.map(|k| norm(k.slope) / tiling.lipschitz[t]));
        }
        let ratio = if ratios.is_empty() { 0.5 } else { ratios.iter().sum::<f64>() / ratios.len() as f64 };
        let mut sums = vec![(0.0, 0.0, 0.0f64); tiling.map.nodes().len()];
        for t in 0..tiling.map.len() {
            for n in tiling.map.tet(t) {
                let (sum, count, most) = &mut sums[n as usize];
                *sum += ratio * tiling.lipschitz[t];
                *count += 1.0;
                *most = most.max(ratio * tiling.lipschitz[t]);
            }
        }
        let mean = |(s, n, most): (f64, f64, f64)| if n > 0.0 { (s / n).max(most / SPREAD) } else { 1.0 };
        Steepness { tiling: tiling.clone(), at_nodes: Arc::new(sums.into_iter().map(mean).collect()) }
    }

    /// The steepness and the level at a node.
    fn of_node(&self, n: usize) -> [f64; 2] {
        let level = match &self.tiling.level {
            NodalLevel::Same(t) => *t,
            NodalLevel::Nodes(of) => of[n],
        };
        [self.at_nodes[n], level]
    }

    /// The steepness in a regular tetrahedron with edge 1, of the first cell.
    fn of_regular(&self) -> f64 {
        let half = 0.5f64.sqrt();
        let nodes = vec![[0.0; 3], [0.0, half, half], [half, 0.0, half], [half, half, 0.0]];
        let regular = TetMesh { nodes, tets: vec![[0, 1, 2, 3]], zones: Vec::new() };
        // It is a mesh.
        let Ok(map) = CarrierMesh::new(&regular, 0.0) else { return 1.0 };
        let cell = Share { weights: None, ..self.tiling.cells[0].clone() };
        let level = NodalLevel::Same(self.tiling.mean_level());
        Steepness::new(&Arc::new(Tiling::of(Arc::new(map), vec![cell], self.tiling.part, level))).at_nodes[0]
    }

    /// The radius of a port at each node, mm.
    fn of_struts(&self) -> Vec<f64> {
        let tiling = &self.tiling;
        let ports = tiling.port_areas(tiling.ports().area);
        // Of a regular tetrahedron with edge 1: its steepness, and the area of its faces over π.
        let (steep, face) = (self.of_regular(), 3f64.sqrt() / (4.0 * core::f64::consts::PI));
        ports.iter().zip(self.at_nodes.iter()).map(|(share, own)| (share * face).sqrt() * steep / own).collect()
    }
}

impl Rounded {
    /// A lattice in a region with its ends rounded, to the radii of its struts or walls.
    pub fn new(tiling: &Arc<Tiling>, region: &Region) -> Rounded {
        let steepness = Steepness::new(tiling);
        let (radius, at_nodes) = match tiling.part {
            Part::Sheet => {
                let of = |n: usize| steepness.of_node(n);
                (Radius::OfWalls, (0..tiling.map.nodes().len()).map(of).map(|[s, t]| BLUNT * t / s).collect())
            }
            _ => {
                let of = Arc::new(steepness.of_struts());
                (Radius::OfStruts(of.clone()), of.to_vec())
            }
        };
        // Between nodes they are means of theirs.
        let radii = tiling.used(&at_nodes);
        let one = |of: Arc<dyn Implicit>, parts| Rounded {
            of,
            region: region.clone(),
            radius: radius.clone(),
            radii,
            steepness: steepness.clone(),
            parts,
        };
        let parts = tiling.parts().into_iter().map(|p| Arc::new(one(p, Vec::new())) as Arc<dyn Implicit>);
        let parts = parts.collect();
        one(tiling.clone(), parts)
    }

    /// The least and the greatest radius at the surface, mm.
    pub fn end_radii(&self) -> [f64; 2] {
        let Steepness { tiling, .. } = &self.steepness;
        let radius = |n: u32| match &self.radius {
            Radius::OfStruts(of) => of[n as usize],
            Radius::OfWalls => {
                let [steep, level] = self.steepness.of_node(n as usize);
                BLUNT * level / steep
            }
        };
        let nodes = tiling.map.boundary_nodes().into_iter().flatten();
        nodes.map(radius).fold([f64::INFINITY, 0.0], |[lo, hi], r| [lo.min(r), hi.max(r)])
    }

    /// The steepness and the radius at a point.
    fn at(&self, p: Vec3) -> [f64; 2] {
        let Steepness { tiling, at_nodes, .. } = &self.steepness;
        let (t, l) = tiling.map.locate(p);
        let l = within(l, 0.0);
        let steep = tiling.linear(at_nodes, t, l);
        match &self.radius {
            Radius::OfStruts(of) => [steep, tiling.linear(of, t, l)],
            Radius::OfWalls => [steep, BLUNT * tiling.level_at(t, l) / steep],
        }
    }
}

/// The value where the lattice's is `a` and the region's `b`, and its derivatives by both.
fn joined(r: f64, a: f64, b: f64) -> (f64, f64, f64) {
    let b = b + BELOW * r;
    let (x, y) = ((a + r).max(0.0), (b + r).max(0.0));
    let round = x.hypot(y);
    if round > 0.0 { (round - r, x / round, y / round) } else { (a.max(b), f64::from(a >= b), f64::from(a < b)) }
}

impl Field for Rounded {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut b = vec![0.0; points.len()];
        self.of.values(points, out);
        self.region.values(points, &mut b);
        for ((p, o), b) in points.iter().zip(out).zip(b) {
            let [steep, r] = self.at(*p);
            *o = joined(r, *o / steep, b).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut b, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        self.of.gradients(points, values, gradients);
        self.region.gradients(points, &mut b, &mut g);
        for (i, p) in points.iter().enumerate() {
            let [steep, r] = self.at(*p);
            let (v, da, db) = joined(r, values[i] / steep, b[i]);
            values[i] = v;
            gradients[i] = add(scale(gradients[i], da / steep), scale(g[i], db));
        }
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        fill_points(self, block, 0.0, Some(wanted), out);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let (of, region) = (self.of.bound(b), self.region.bound(b));
        let steep = self.steepness.at_nodes.iter().fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
        // The function rises with both, and with the radius.
        let r = self.radii;
        let low = if of.lo < 0.0 { of.lo / steep.0 } else { of.lo / steep.1 };
        let high = if of.hi < 0.0 { of.hi / steep.1 } else { of.hi / steep.0 };
        Interval::new(joined(r.lo, low, region.lo).0, joined(r.hi, high, region.hi).0)
    }
}

impl Implicit for Rounded {
    fn lipschitz(&self) -> f64 {
        let Steepness { tiling, at_nodes, .. } = &self.steepness;
        let least =
            |t: usize| tiling.map.tet(t).map(|n| at_nodes[n as usize]).into_iter().fold(f64::INFINITY, f64::min);
        (0..tiling.map.len()).map(|t| tiling.lipschitz[t] / least(t)).fold(1.0, f64::max)
    }

    fn has_creases(&self) -> bool {
        true
    }

    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        self.parts.clone()
    }
}
