//! The net of four-sided faces that is dual to the polygons of implicit surfaces: a vertex for each polygon, a face for each
//! crossed grid edge (Nielson, Dual marching cubes, IEEE Visualization 2004), and what closes it in the planes of a box.
//!
//! In a plane of the box each segment of a polygon has a vertex too, so that the face of a crossed grid edge in the plane has
//! four sides: two of them lead into the surface, one joins their two polygons, one lies in the plane. Where the surface crosses
//! an edge of the box there is a vertex, with two sides in the two planes. All faces have four sides; no vertex but those on
//! edges of the box is bound to the grid.

use std::collections::HashMap;

use geometry::math::{Vec3, add, scale};

use super::contour_polygons::{Grid, Polygons};

/// Where a vertex may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On its surface.
    Surface,
    /// On its surface in a plane of the box: 2 · axis + side.
    Plane(u8),
    /// Nowhere: on an edge of the box, along this axis.
    Edge(u8),
}

/// A vertex of the net.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position (mm).
    pub at: Vec3,
    /// Where it may move.
    pub place: Place,
    /// The number of its surface.
    pub surface: u8,
}

/// An edge of the net.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// The plane of the box in which it lies.
    pub plane: Option<u8>,
    /// The number of its surface.
    pub surface: u8,
}

/// A side of a face: an edge, and whether it is walked forwards.
pub type Side = (u32, bool);

/// A four-sided face, counter-clockwise seen from the positive side of its surface.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Its sides in order; the first begins at the first corner.
    pub sides: [Side; 4],
    /// Its corners.
    pub corners: [u32; 4],
    /// The number of its surface.
    pub surface: u8,
}

/// A net of faces.
#[derive(Clone, Debug, Default)]
pub struct Net {
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Faces.
    pub faces: Vec<Face>,
}

impl Net {
    /// Adds the faces of a surface. `crossing` gives the position (mm) where a grid edge crosses it.
    ///
    /// # Errors
    /// A grid on which two polygons have two segments in common, whose edges would coincide.
    pub fn add(
        &mut self,
        grid: &Grid,
        of: &Polygons,
        surface: u8,
        crossing: &dyn Fn(u64) -> Vec3,
    ) -> Result<(), TooCoarse> {
        let points: Vec<Vec3> = of.edges.iter().map(|e| crossing(*e)).collect();
        let mut own = Dual { net: self, surface, polygons: Vec::new(), segments: vec![(0, None); of.segments.len()] };
        for polygon in &of.polygons {
            let corners = polygon.corners.iter().map(|c| points[c[0] as usize]);
            let at = scale(corners.fold([0.0; 3], add), 1.0 / polygon.corners.len() as f64);
            let vertex = own.vertex(at, Place::Surface);
            own.polygons.push(vertex);
        }
        for (segment, found) in of.segments.iter().enumerate() {
            let [a, b] = found.ends.map(|e| points[e as usize]);
            let middle = scale(add(a, b), 0.5);
            own.segments[segment] = match (found.plane, &found.polygons[..]) {
                (None, &[p, q]) => (own.edge([p, q].map(|p| own.polygons[p as usize]), None), None),
                (Some(plane), &[p]) => {
                    let on = own.vertex(middle, Place::Plane(plane));
                    (own.edge([on, own.polygons[p as usize]], None), Some(on))
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
        self.check_distinct()
    }

    fn check_distinct(&self) -> Result<(), TooCoarse> {
        let mut seen: HashMap<[u32; 2], ()> = HashMap::with_capacity(self.edges.len());
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let distinct = |e: &Edge| e.ends[0] != e.ends[1] && seen.insert(ordered(e.ends), ()).is_none();
        if self.edges.iter().all(distinct) { Ok(()) } else { Err(TooCoarse) }
    }
}

/// The grid is too coarse for the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooCoarse;

/// Sorts the polygons around a grid edge counter-clockwise, seen from the positive side: across the segment that leads to it
/// each has the next one. The first of an open fan is the one whose leaving segment lies in a plane of the box.
fn ordered(of: &Polygons, found: &mut Vec<[u32; 3]>) {
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
struct Dual<'a> {
    net: &'a mut Net,
    surface: u8,
    /// The vertex of each polygon.
    polygons: Vec<u32>,
    /// The edge of each segment, and its vertex in a plane of the box.
    segments: Vec<(u32, Option<u32>)>,
}

impl Dual<'_> {
    fn vertex(&mut self, at: Vec3, place: Place) -> u32 {
        self.net.vertices.push(Vertex { at, place, surface: self.surface });
        self.net.vertices.len() as u32 - 1
    }

    fn edge(&mut self, ends: [u32; 2], plane: Option<u8>) -> u32 {
        self.net.edges.push(Edge { ends, plane, surface: self.surface });
        self.net.edges.len() as u32 - 1
    }

    /// The face of a crossed grid edge: `found` as `ordered` leaves it, `crossing` the place and the axis of the edge.
    fn face(
        &mut self,
        of: &Polygons,
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
                let closing = self.edge([last, first], Some(*plane));
                corners.push(last);
                corners.push(first);
                edges.extend([closing, self.segments[ends[0] as usize].0]);
            }
            (1, [_, _], [Some(first), Some(last)]) => {
                let corner = self.vertex(crossing.0, Place::Edge(crossing.1));
                let plane = |s: u32| of.segments[s as usize].plane;
                let [to, from] = [self.edge([last, corner], plane(ends[1])), self.edge([corner, first], plane(ends[0]))];
                corners.extend([last, corner, first]);
                edges.extend([to, from, self.segments[ends[0] as usize].0]);
            }
            _ => return Err(TooCoarse),
        }
        let (Ok(corners), Ok(edges)) = (<[u32; 4]>::try_from(corners), <[u32; 4]>::try_from(edges)) else {
            return Err(TooCoarse);
        };
        let sides: [Side; 4] = core::array::from_fn(|i| {
            let edge = edges[i];
            (edge, self.net.edges[edge as usize].ends[0] == corners[i])
        });
        self.net.faces.push(Face { sides, corners, surface: self.surface });
        Ok(())
    }
}
