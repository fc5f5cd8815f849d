//! The net of four-sided faces that is dual to the polygons of implicit surfaces: a vertex for each polygon, a face for each
//! crossed grid edge (Nielson, Dual marching cubes, IEEE Visualization 2004), and what closes it in the planes of a box.
//!
//! In a plane of the box each segment of a polygon has a vertex too, so that the face of a crossed grid edge in the plane has
//! four sides: two of them lead into the surface, one joins their two polygons, one lies in the plane. Where the surface crosses
//! an edge of the box there is a vertex, with two sides in the two planes. All faces have four sides; no vertex but those on
//! edges of the box is bound to the grid.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::math::{Vec3, add, scale};
use geometry::union_find::{labels, singles, unite};

use super::contour_polygons::{ContourPolygons, GridPlanes};

/// Where a vertex may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexConstraint {
    /// On its surface.
    Surface,
    /// On its surface in a plane of the box: 2 · axis + side.
    Plane(u8),
    /// Nowhere: on an edge of the box, along this axis.
    Edge(u8),
}

/// A vertex of the net.
#[derive(Clone, Copy, Debug)]
pub struct NetVertex {
    /// Position (mm).
    pub at: Vec3,
    /// Where it may move.
    pub constraint: VertexConstraint,
    /// The number of its surface.
    pub surface: u8,
}

/// An edge of the net.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// A place between them (mm), near its surface: what tells two edges between the same vertices apart.
    pub middle: Vec3,
    /// The plane of the box in which it lies.
    pub plane: Option<u8>,
    /// The number of its surface.
    pub surface: u8,
}

/// A side of a face: an edge, and whether it is walked forwards.
pub type DirectedEdge = (u32, bool);

/// A four-sided face, counter-clockwise seen from the positive side of its surface.
#[derive(Clone, Copy, Debug)]
pub struct QuadFace {
    /// Its sides in order; the first begins at the first corner.
    pub sides: [DirectedEdge; 4],
    /// Its corners.
    pub corners: [u32; 4],
    /// The number of its surface.
    pub surface: u8,
}

/// A net of faces.
#[derive(Clone, Debug, Default)]
pub struct QuadNet {
    /// Vertices.
    pub vertices: Vec<NetVertex>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Faces.
    pub faces: Vec<QuadFace>,
}

impl QuadNet {
    /// Adds the faces of a surface. `crossing` gives the position (mm) where a grid edge crosses it.
    ///
    /// # Errors
    /// Polygons that do not fit together.
    pub fn add(
        &mut self,
        grid: &GridPlanes,
        of: &ContourPolygons,
        surface: u8,
        crossing: &dyn Fn(u64) -> Vec3,
    ) -> Result<(), TooCoarse> {
        let points: Vec<Vec3> = of.edges.iter().map(|e| crossing(*e)).collect();
        let first = self.edges.len();
        let mut own =
            DualNet { net: self, surface, polygons: Vec::new(), segments: vec![(0, None); of.segments.len()] };
        for polygon in &of.polygons {
            let corners = polygon.corners.iter().map(|c| points[c[0] as usize]);
            let at = scale(corners.fold([0.0; 3], add), 1.0 / polygon.corners.len() as f64);
            let vertex = own.vertex(at, VertexConstraint::Surface);
            own.polygons.push(vertex);
        }
        for (segment, found) in of.segments.iter().enumerate() {
            let [a, b] = found.ends.map(|e| points[e as usize]);
            let middle = scale(add(a, b), 0.5);
            own.segments[segment] = match (found.plane, &found.polygons[..]) {
                (None, &[p, q]) => (own.edge([p, q].map(|p| own.polygons[p as usize]), middle, None), None),
                (Some(plane), &[p]) => {
                    let on = own.vertex(middle, VertexConstraint::Plane(plane));
                    (
                        own.edge([on, own.polygons[p as usize]], own.between([on, own.polygons[p as usize]]), None),
                        Some(on),
                    )
                }
                _ => return Err(TooCoarse),
            };
        }
        // Around each crossed grid edge: polygon, the segment that leads to it, the one that leads on.
        let mut around: Vec<Vec<[u32; 3]>> = vec![Vec::with_capacity(4); of.edges.len()];
        for (p, polygon) in of.polygons.iter().enumerate() {
            let n = polygon.corners.len();
            for (i, [edge, leaving]) in polygon.corners.iter().enumerate() {
                around[*edge as usize].push([p as u32, polygon.corners[(i + n - 1) % n][1], *leaving]);
            }
        }
        for (e, mut found) in around.into_iter().enumerate() {
            ordered(of, &mut found);
            let planes: Vec<u8> = grid.planes(of.edges[e]).collect();
            own.face(of, &found, &planes, (points[e], (of.edges[e] % 3) as u8))?;
        }
        self.separate(first);
        Ok(())
    }

    /// Divides the edges between vertices that others join too, so that every edge has its own two.
    fn separate(&mut self, first: usize) {
        let mut seen: HashMap<[u32; 2], usize> = HashMap::with_capacity(self.edges.len() - first);
        let mut divided = vec![false; self.edges.len()];
        for (e, edge) in self.edges.iter().enumerate().skip(first) {
            let [a, b] = edge.ends;
            match seen.entry([a.min(b), a.max(b)]) {
                Entry::Vacant(free) => drop(free.insert(e)),
                Entry::Occupied(known) => {
                    divided[e] = true;
                    divided[*known.get()] = true;
                }
            }
        }
        if divided.contains(&true) {
            self.divide(divided);
        }
    }

    /// Divides faces into two or four: all edges of the strips of faces, each across opposite sides, to which the given edges
    /// belong.
    pub fn divide(&mut self, mut divided: Vec<bool>) {
        let mut strips = singles(self.edges.len());
        for face in &self.faces {
            for k in 0..2 {
                unite(&mut strips, face.sides[k].0, face.sides[k + 2].0);
            }
        }
        let (strip, count) = labels(&mut strips);
        let mut wanted = vec![false; count];
        (0..divided.len()).filter(|e| divided[*e]).for_each(|e| wanted[strip[e] as usize] = true);
        divided.iter_mut().zip(&strip).for_each(|(d, s)| *d = wanted[*s as usize]);
        // Each divided edge keeps its number for its first half.
        let mut halves: Vec<Option<(u32, u32)>> = vec![None; divided.len()];
        for e in (0..divided.len()).filter(|e| divided[*e]) {
            let edge = self.edges[e];
            let constraint = edge.plane.map_or(VertexConstraint::Surface, VertexConstraint::Plane);
            let middle = self.vertices.len() as u32;
            self.vertices.push(NetVertex { at: edge.middle, constraint, surface: edge.surface });
            let [a, b] = edge.ends;
            self.edges[e] = self.straight([a, middle], edge.plane, edge.surface);
            halves[e] = Some((middle, self.edges.len() as u32));
            let second = self.straight([middle, b], edge.plane, edge.surface);
            self.edges.push(second);
        }
        for face in core::mem::take(&mut self.faces) {
            self.divide_face(&face, &halves);
        }
    }

    fn straight(&self, ends: [u32; 2], plane: Option<u8>, surface: u8) -> Edge {
        let [a, b] = ends.map(|v| self.vertices[v as usize].at);
        Edge { ends, middle: scale(add(a, b), 0.5), plane, surface }
    }

    /// Adds the parts of a face whose sides are divided at these vertices, each with the number of its second half.
    fn divide_face(&mut self, face: &QuadFace, halves: &[Option<(u32, u32)>]) {
        let surface = face.surface;
        let middle = face.sides.map(|(e, _)| halves[e as usize]);
        // The halves of a side in its direction.
        let half = |k: usize, last: bool| match (face.sides[k], middle[k]) {
            ((first, forward), Some((_, second))) => (if forward == last { second } else { first }, forward),
            (side, None) => side,
        };
        let joined = |net: &mut QuadNet, ends: [u32; 2]| {
            let edge = net.straight(ends, None, surface);
            net.edges.push(edge);
            net.edges.len() as u32 - 1
        };
        let [c0, c1, c2, c3] = face.corners;
        match middle {
            [None, None, ..] => self.faces.push(*face),
            [Some((m0, _)), None, Some((m2, _)), None] | [None, Some((m0, _)), None, Some((m2, _))] => {
                let k = usize::from(middle[0].is_none());
                let across = joined(self, [m0, m2]);
                let c = |i: usize| face.corners[(k + i) % 4];
                let h = |i: usize, last: bool| half((k + i) % 4, last);
                self.faces.push(QuadFace {
                    sides: [h(0, false), (across, true), h(2, true), face.sides[(k + 3) % 4]],
                    corners: [c(0), m0, m2, c(3)],
                    surface,
                });
                self.faces.push(QuadFace {
                    sides: [h(0, true), face.sides[(k + 1) % 4], h(2, false), (across, false)],
                    corners: [m0, c(1), c(2), m2],
                    surface,
                });
            }
            [Some((m0, _)), Some((m1, _)), Some((m2, _)), Some((m3, _))] => {
                let corners = [c0, c1, c2, c3].map(|c| self.vertices[c as usize].at);
                let at = scale(corners.into_iter().fold([0.0; 3], add), 0.25);
                let center = self.vertices.len() as u32;
                self.vertices.push(NetVertex { at, constraint: VertexConstraint::Surface, surface });
                let m = [m0, m1, m2, m3];
                let spokes = m.map(|m| joined(self, [m, center]));
                for k in 0..4 {
                    let before = (k + 3) % 4;
                    self.faces.push(QuadFace {
                        sides: [half(k, false), (spokes[k], true), (spokes[before], false), half(before, true)],
                        corners: [face.corners[k], m[k], center, m[before]],
                        surface,
                    });
                }
            }
            // Opposite sides are divided together.
            _ => self.faces.push(*face),
        }
    }
}

/// The grid is too coarse for the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooCoarse;

/// Sorts the polygons around a grid edge counter-clockwise, seen from the positive side: across the segment that leads to it
/// each has the next one. The first of an open fan is the one whose leaving segment lies in a plane of the box.
fn ordered(of: &ContourPolygons, found: &mut [[u32; 3]]) {
    if let Some(first) = found.iter().position(|f| of.segments[f[2] as usize].plane.is_some()) {
        found.swap(0, first);
    }
    for i in 1..found.len() {
        let across = found[i - 1][1];
        if let Some(next) = (i..found.len()).find(|k| found[*k][2] == across) {
            found.swap(i, next);
        }
    }
}

/// The part of a net that belongs to one surface, while it is made.
struct DualNet<'a> {
    net: &'a mut QuadNet,
    surface: u8,
    /// The vertex of each polygon.
    polygons: Vec<u32>,
    /// The edge of each segment, and its vertex in a plane of the box.
    segments: Vec<(u32, Option<u32>)>,
}

impl DualNet<'_> {
    fn vertex(&mut self, at: Vec3, constraint: VertexConstraint) -> u32 {
        self.net.vertices.push(NetVertex { at, constraint, surface: self.surface });
        self.net.vertices.len() as u32 - 1
    }

    fn edge(&mut self, ends: [u32; 2], middle: Vec3, plane: Option<u8>) -> u32 {
        self.net.edges.push(Edge { ends, middle, plane, surface: self.surface });
        self.net.edges.len() as u32 - 1
    }

    fn between(&self, ends: [u32; 2]) -> Vec3 {
        let [a, b] = ends.map(|v| self.net.vertices[v as usize].at);
        scale(add(a, b), 0.5)
    }

    /// The face of a crossed grid edge: `found` as `ordered` leaves it, `crossing` the place and the axis of the edge.
    fn face(
        &mut self,
        of: &ContourPolygons,
        found: &[[u32; 3]],
        planes: &[u8],
        crossing: (Vec3, u8),
    ) -> Result<(), TooCoarse> {
        // The vertices in the planes of the box, where the fan is open: at its first and its last segment.
        let ends = (found.first().zip(found.last())).map(|(first, last)| [first[2], last[1]]).ok_or(TooCoarse)?;
        let on = ends.map(|s| self.segments[s as usize].1);
        let polygon = |f: &[u32; 3]| self.polygons[f[0] as usize];
        let mut corners: Vec<u32> = found.iter().map(polygon).collect();
        let mut edges: Vec<u32> = found.iter().map(|f| self.segments[f[1] as usize].0).collect();
        match (found.len(), planes, on) {
            (4, [], [None, None]) => {}
            (2, [plane], [Some(first), Some(last)]) => {
                let closing = self.edge([last, first], crossing.0, Some(*plane));
                corners.push(last);
                corners.push(first);
                edges.extend([closing, self.segments[ends[0] as usize].0]);
            }
            (1, [_, _], [Some(first), Some(last)]) => {
                let corner = self.vertex(crossing.0, VertexConstraint::Edge(crossing.1));
                let plane = |s: u32| of.segments[s as usize].plane;
                let [to, from] = [[last, corner], [corner, first]].map(|e| (e, self.between(e)));
                let to = self.edge(to.0, to.1, plane(ends[1]));
                let from = self.edge(from.0, from.1, plane(ends[0]));
                corners.extend([last, corner, first]);
                edges.extend([to, from, self.segments[ends[0] as usize].0]);
            }
            _ => return Err(TooCoarse),
        }
        let (Ok(corners), Ok(edges)) = (<[u32; 4]>::try_from(corners), <[u32; 4]>::try_from(edges)) else {
            return Err(TooCoarse);
        };
        let sides: [DirectedEdge; 4] = core::array::from_fn(|i| {
            let edge = edges[i];
            (edge, self.net.edges[edge as usize].ends[0] == corners[i])
        });
        self.net.faces.push(QuadFace { sides, corners, surface: self.surface });
        Ok(())
    }
}
