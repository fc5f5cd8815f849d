//! The closed boundary that patches on surfaces and planar faces in the planes of a box make together.

use std::collections::HashMap;

use geometry::math::{Aabb, Vec3, add, scale, sub};

use super::bezier::{BicubicPatch, Curve, basis, reversed, sector_area, sum};
use super::quad_net::{DirectedEdge, QuadNet, VertexConstraint};

/// An edge of the boundary.
#[derive(Clone, Copy, Debug)]
pub struct BoundaryEdge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// Its curve, from the first to the second; a line if none.
    pub curve: Option<Curve>,
}

/// What a face lies on.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// A patch; the loop runs around its parameters from (0, 0) by way of (1, 0).
    Patch(Box<BicubicPatch>),
    /// A plane of the box: 2 · axis + side.
    Plane(u8),
}

/// A face.
#[derive(Clone, Debug)]
pub struct BoundaryFace {
    /// What it lies on, with its normal out of the solid.
    pub carrier: Carrier,
    /// Its loops, counter-clockwise seen from outside: the outer one first, then those around holes.
    pub loops: Vec<Vec<DirectedEdge>>,
}

/// The boundary of a solid in a box.
#[derive(Clone, Debug)]
pub struct Boundary {
    /// The box (mm).
    pub bounds: Aabb,
    /// Vertices (mm).
    pub vertices: Vec<Vec3>,
    /// Edges; each is a side of two faces, once in each direction.
    pub edges: Vec<BoundaryEdge>,
    /// Faces.
    pub faces: Vec<BoundaryFace>,
}

/// The outward normal of a plane of the box.
pub fn outward(plane: u8) -> Vec3 {
    let mut n = [0.0; 3];
    n[usize::from(plane / 2)] = if plane % 2 == 1 { 1.0 } else { -1.0 };
    n
}

/// A corner of a box: bit a of its number says on which side of axis a.
pub fn corner(bounds: &Aabb, c: usize) -> Vec3 {
    [0, 1, 2].map(|a| if c >> a & 1 == 1 { bounds.max[a] } else { bounds.min[a] })
}

impl Boundary {
    /// The boundary of the part of a box in which all surfaces are negative, from a net with its curves and patches. `corners`
    /// says for each surface in which corners of the box it is negative.
    pub fn new(
        bounds: Aabb,
        net: &QuadNet,
        curves: &[Curve],
        patches: Vec<BicubicPatch>,
        corners: &[[bool; 8]],
    ) -> Boundary {
        let with =
            |(edge, curve): (&super::quad_net::Edge, &Curve)| BoundaryEdge { ends: edge.ends, curve: Some(*curve) };
        let mut made = Boundary {
            bounds,
            vertices: net.vertices.iter().map(|v| v.at).collect(),
            edges: net.edges.iter().zip(curves).map(with).collect(),
            faces: Vec::with_capacity(net.faces.len() + 6),
        };
        // For each plane the sides of its faces, by the vertex where they begin.
        let mut sides: [HashMap<u32, DirectedEdge>; 6] = Default::default();
        for face in &net.faces {
            for (k, (edge, forward)) in face.sides.into_iter().enumerate() {
                if let Some(plane) = net.edges[edge as usize].plane {
                    sides[usize::from(plane)].insert(face.corners[(k + 1) % 4], (edge, !forward));
                }
            }
        }
        made.add_lines(net, corners, &mut sides);
        for (face, patch) in net.faces.iter().zip(patches) {
            made.faces
                .push(BoundaryFace { carrier: Carrier::Patch(Box::new(patch)), loops: vec![face.sides.to_vec()] });
        }
        for (plane, sides) in sides.into_iter().enumerate() {
            made.add_planar_faces(plane as u8, sides);
        }
        made
    }

    /// The parts of the box's edges that are in the solid, as lines between its corners and where surfaces cross the edges.
    fn add_lines(&mut self, net: &QuadNet, corners: &[[bool; 8]], sides: &mut [HashMap<u32, DirectedEdge>; 6]) {
        let mut at_corner = [None; 8];
        for axis in 0..3 {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            for first in (0..8).filter(|c| c >> axis & 1 == 0) {
                let last = first | 1 << axis;
                let here = corner(&self.bounds, first);
                let on = |v: &super::quad_net::NetVertex| {
                    v.constraint == VertexConstraint::Edge(axis as u8) && others.iter().all(|o| v.at[*o] == here[*o])
                };
                let mut stops: Vec<u32> =
                    (0..net.vertices.len() as u32).filter(|v| on(&net.vertices[*v as usize])).collect();
                stops.sort_by(|a, b| self.vertices[*a as usize][axis].total_cmp(&self.vertices[*b as usize][axis]));
                let mut negative: Vec<bool> = corners.iter().map(|c| c[first]).collect();
                let solid = |negative: &[bool]| negative.iter().all(|n| *n);
                let mut from = solid(&negative).then(|| self.at_corner(first, &mut at_corner));
                for stop in stops {
                    let surface = usize::from(net.vertices[stop as usize].surface);
                    negative[surface] = !negative[surface];
                    if let Some(from) = from {
                        self.add_line(from, stop, axis, first, sides);
                    }
                    from = solid(&negative).then_some(stop);
                }
                if let Some(from) = from {
                    let to = self.at_corner(last, &mut at_corner);
                    self.add_line(from, to, axis, first, sides);
                }
            }
        }
    }

    fn at_corner(&mut self, c: usize, at_corner: &mut [Option<u32>; 8]) -> u32 {
        *at_corner[c].get_or_insert_with(|| {
            self.vertices.push(corner(&self.bounds, c));
            self.vertices.len() as u32 - 1
        })
    }

    /// A line along an edge of the box, as a side of the faces in both planes.
    fn add_line(&mut self, from: u32, to: u32, axis: usize, first: usize, sides: &mut [HashMap<u32, DirectedEdge>; 6]) {
        let edge = self.edges.len() as u32;
        self.edges.push(BoundaryEdge { ends: [from, to], curve: None });
        for (a, inwards) in [((axis + 1) % 3, (axis + 2) % 3), ((axis + 2) % 3, (axis + 1) % 3)] {
            // In the plane normal to a, counter-clockwise is along q × m: q into the face, m out of the box.
            let (side_a, side_q) = (first >> a & 1, first >> inwards & 1);
            let even = (inwards + 1) % 3 == a; // whether e_q × e_a = e_axis
            let forward = even == ((side_a == 1) == (side_q == 0));
            sides[2 * a + side_a].insert(if forward { from } else { to }, (edge, forward));
        }
    }

    /// The faces in a plane, from their sides by the vertices where these begin.
    fn add_planar_faces(&mut self, plane: u8, mut sides: HashMap<u32, DirectedEdge>) {
        let mut starts: Vec<u32> = sides.keys().copied().collect();
        starts.sort_unstable();
        let mut outer = Vec::new();
        let mut holes = Vec::new();
        for start in starts {
            let mut walked = Vec::new();
            let mut here = start;
            while let Some(side) = sides.remove(&here) {
                walked.push(side);
                here = self.edges[side.0 as usize].ends[usize::from(side.1)];
            }
            if walked.is_empty() {
                continue;
            }
            let area = self.area(&walked, plane);
            if area > 0.0 { outer.push((walked, area)) } else { holes.push(walked) }
        }
        let mut faces: Vec<Vec<Vec<DirectedEdge>>> = outer.iter().map(|o| vec![o.0.clone()]).collect();
        let outlines: Vec<Vec<[f64; 2]>> = outer.iter().map(|o| self.outline(&o.0, plane)).collect();
        for hole in holes {
            let at = flat(self.vertices[self.start(hole[0]) as usize], plane);
            let around = (0..outer.len()).filter(|o| contains(&outlines[*o], at));
            // Of several the smallest is the nearest.
            if let Some(found) = around.min_by(|a, b| outer[*a].1.total_cmp(&outer[*b].1)) {
                faces[found].push(hole);
            }
        }
        let face = |loops| BoundaryFace { carrier: Carrier::Plane(plane), loops };
        self.faces.extend(faces.into_iter().map(face));
    }

    /// The vertex at which a side begins.
    pub fn start(&self, (edge, forward): DirectedEdge) -> u32 {
        self.edges[edge as usize].ends[usize::from(!forward)]
    }

    /// The curve of a side, in its direction; lines as cubic curves.
    pub fn curve(&self, (edge, forward): DirectedEdge) -> Curve {
        let edge = &self.edges[edge as usize];
        let [a, b] = edge.ends.map(|v| self.vertices[v as usize]);
        let curve = edge.curve.unwrap_or_else(|| core::array::from_fn(|k| add(a, scale(sub(b, a), k as f64 / 3.0))));
        if forward { curve } else { reversed(&curve) }
    }

    /// The area (mm²) within a loop in a plane; negative around a hole.
    pub fn area(&self, walked: &[DirectedEdge], plane: u8) -> f64 {
        let from = self.vertices[self.start(walked[0]) as usize];
        walked.iter().map(|s| sector_area(&self.curve(*s), from, outward(plane))).sum()
    }

    /// A polygon of a loop, in the two coordinates of a plane.
    pub fn outline(&self, walked: &[DirectedEdge], plane: u8) -> Vec<[f64; 2]> {
        const PARTS: usize = 12;
        let mut points = Vec::with_capacity(walked.len() * PARTS);
        for side in walked {
            let (curve, parts) =
                (self.curve(*side), if self.edges[side.0 as usize].curve.is_some() { PARTS } else { 1 });
            points.extend((0..parts).map(|k| flat(sum(&curve, basis(k as f64 / parts as f64)), plane)));
        }
        points
    }
}

/// The coordinates of a position along a plane of the box.
pub fn flat(p: Vec3, plane: u8) -> [f64; 2] {
    let axis = usize::from(plane / 2);
    [p[(axis + 1) % 3], p[(axis + 2) % 3]]
}

/// Whether a polygon contains a point: by the number of its sides above it.
pub fn contains(polygon: &[[f64; 2]], at: [f64; 2]) -> bool {
    let mut inside = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a[0] > at[0]) != (b[0] > at[0]) {
            let height = a[1] + (b[1] - a[1]) * (at[0] - a[0]) / (b[0] - a[0]);
            inside ^= height > at[1];
        }
    }
    inside
}
