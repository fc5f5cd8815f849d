//! Cell faces divided along contours, and the extra points on them.

use rustc_hash::FxHashMap;

use crate::extract::vertex_id::VertexId;
use geometry::math::Vec3;
use geometry::mesh::exact::{drop_axis, orient2d};

const AXES: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A cell face, cut along its contours and into triangles. Its buffers serve for one block after the other.
#[derive(Default)]
pub(in crate::extract) struct CellFace {
    /// Its nodes and the points in it.
    pub(super) corners: Vec<PolygonCorner>,
    pub(super) parts: Vec<FaceTriangle>,
    /// The triangles cut by all other surfaces, as the faces of feature cells are: the ids of all corners of the fragments, and
    /// for each fragment the surfaces that are negative in it and where its ids end.
    pub(super) names: Vec<VertexId>,
    pub(super) ends: Vec<(u64, usize)>,
    /// The contours, with the points where other surfaces cross them, and where each ends.
    pub(super) along: Vec<VertexId>,
    pub(super) along_ends: Vec<usize>,
    /// How many times it was divided again.
    pub(super) tries: usize,
}

#[derive(Clone, Copy)]
pub(super) struct PolygonCorner {
    pub id: usize,
    /// Nodes from 0, points of the four grid edges from 4 in pairs, corners of contours from 12.
    pub code: usize,
    pub key: VertexId,
}

/// A triangle of a cell face.
#[derive(Clone, Copy)]
pub(super) struct FaceTriangle {
    /// Indices of its corners, by ascending code.
    pub corners: [usize; 3],
    /// Whether they run counter-clockwise about the face's axis.
    pub left: bool,
    /// Whether the surface is negative in it.
    pub inside: bool,
    /// Whether the edge opposite each corner is part of a contour.
    pub on_contour: [bool; 3],
}

impl CellFace {
    /// The fragments between all other surfaces: those that are negative, and the corners counter-clockwise about the face's
    /// axis.
    pub fn fragments(&self) -> impl Iterator<Item = (u64, &[VertexId])> {
        let starts = [0].into_iter().chain(self.ends.iter().map(|e| e.1));
        let each = starts.zip(&self.ends);
        each.map(|(start, (negative, end))| (*negative, &self.names[start..*end]))
    }

    /// The contours, with the points where other surfaces cross them.
    pub fn contours(&self) -> impl Iterator<Item = &[VertexId]> {
        let starts = [0].into_iter().chain(self.along_ends.iter().copied());
        starts.zip(&self.along_ends).map(|(start, end)| &self.along[start..*end])
    }
}

/// Polygons one after the other: the ids and positions of their corners; for each the surfaces that are negative in it and where
/// its corners end.
#[derive(Default)]
pub(super) struct PolygonList {
    pub(super) corners: Vec<(VertexId, Vec3)>,
    pub(super) ends: Vec<(u64, usize)>,
}

impl PolygonList {
    /// Whether all polygons of a face keep their orientation in single precision. Together they fill the face, so then they do
    /// not overlap.
    pub(super) fn are_sound(&self, axis: usize) -> bool {
        let way = orient2d([0.0, 0.0], drop_axis(AXES[(axis + 1) % 3], axis), drop_axis(AXES[(axis + 2) % 3], axis));
        let starts = [0].into_iter().chain(self.ends.iter().map(|e| e.1));
        starts.zip(&self.ends).all(|(start, (_, end))| {
            let ring = &self.corners[start..*end];
            let at = |i: usize| drop_axis(ring[i].1.map(|x| f64::from(x as f32)), axis);
            (2..ring.len()).all(|i| orient2d(at(0), at(i - 1), at(i)) == way)
        })
    }
}

/// Buffers for the division of one face after the other.
#[derive(Default)]
pub(super) struct FaceScratch {
    pub(super) flat: Vec<[f64; 2]>,
    pub(super) polygon: Vec<usize>,
    pub(super) positions: Vec<[f64; 2]>,
    pub(super) parts: Vec<FaceTriangle>,
    pub(super) fragments: PolygonList,
}

/// The extra points of a block and the cell faces that they divide.
#[derive(Default)]
pub(in crate::extract) struct DividedFaces {
    /// Number of live surfaces.
    pub(super) live: usize,
    /// Positions of the points.
    pub(super) positions: Vec<Vec3>,
    /// Values of all live surfaces at the points, point by point.
    pub(super) values: Vec<f64>,
    /// For each point, the first one at the same position; the others have other values.
    pub(super) first: Vec<usize>,
    /// The grid edge on which each point lies, if it does: lower node and axis.
    pub(super) lines: Vec<Option<(usize, usize)>>,
    pub(super) numbers: FxHashMap<VertexId, usize>,
    /// The numbers of divided faces, by their lowest node and the axis normal to them.
    pub(super) faces: FxHashMap<(usize, usize), usize>,
    /// The divided faces, and others whose buffers are free.
    pub(super) list: Vec<CellFace>,
    pub(super) scratch: FaceScratch,
}

impl DividedFaces {
    /// Forgets all points and faces, for this number of live surfaces.
    pub fn clear(&mut self, live: usize) {
        self.live = live;
        self.positions.clear();
        self.values.clear();
        self.first.clear();
        self.lines.clear();
        self.numbers.clear();
        self.faces.clear();
    }

    /// The number of a divided face, by its lowest node and the axis normal to it.
    pub(super) fn number(&self, face: (usize, usize)) -> Option<usize> {
        self.faces.get(&face).copied()
    }

    pub(super) fn numbered(&self, number: usize) -> &CellFace {
        &self.list[number]
    }

    /// A divided face, by its lowest node and the axis normal to it.
    pub fn face(&self, face: (usize, usize)) -> Option<&CellFace> {
        Some(self.numbered(self.number(face)?))
    }

    /// The face whose buffers are for the next one that is divided.
    pub(super) fn take_next(&mut self) -> CellFace {
        let next = self.faces.len();
        self.list.get_mut(next).map(std::mem::take).unwrap_or_default()
    }

    /// Puts it back; it counts if it has a name.
    pub(super) fn put_next(&mut self, face: CellFace, name: Option<(usize, usize)>) {
        let next = self.faces.len();
        match self.list.get_mut(next) {
            Some(place) => *place = face,
            None => self.list.push(face),
        }
        self.faces.extend(name.map(|name| (name, next)));
    }

    pub fn position(&self, point: usize) -> Vec3 {
        self.positions[point]
    }

    pub fn value(&self, point: usize, surface: usize) -> f64 {
        self.values[point * self.live + surface]
    }

    pub fn line(&self, point: usize) -> Option<(usize, usize)> {
        self.lines[point]
    }
}
