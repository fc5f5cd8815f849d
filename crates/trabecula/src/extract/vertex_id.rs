//! Names of vertices.

/// The id of a vertex in a block: the lowest node of its simplex, the steps (sets of axes, each within the next) to the others,
/// and the surfaces that meet in it. In a divided cell face, also the points between which it lies.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) struct VertexId(u64);

impl VertexId {
    const NODE: u32 = 18;
    const SURFACE: u32 = 7;
    const POINTS: u32 = VertexId::NODE + 9 + 3 * VertexId::SURFACE;
    /// The first two steps of a point inside a plain cell or its face: no simplex repeats a step.
    const CENTER: u64 = 0o11;

    pub fn new(node: usize, steps: &[usize], surfaces: &[usize]) -> VertexId {
        let steps = steps.iter().rev().fold(0, |w, s| w << 3 | *s as u64);
        let surfaces = surfaces.iter().rev().fold(0, |w, f| w << VertexId::SURFACE | (*f as u64 + 1));
        VertexId(node as u64 | (steps | surfaces << 9) << VertexId::NODE)
    }

    /// The apex of the patch in a cell, or of the polygon in a face of it, that spans these axes.
    pub fn center(node: usize, span: usize) -> VertexId {
        VertexId(node as u64 | (VertexId::CENTER * span as u64) << VertexId::NODE)
    }

    /// The first or second point of a double crossing: the surface is named twice or three times.
    pub fn crossing(node: usize, axis: usize, surface: usize, which: usize) -> VertexId {
        VertexId::new(node, &[1 << axis], &[surface; 3][..2 + which])
    }

    /// Greatest number of contour corners in a face.
    pub const CORNERS: usize = 4;

    /// A contour corner in a face, which spans two axes; those after the first name the surface.
    pub fn corner(node: usize, span: usize, surface: usize, which: usize) -> VertexId {
        let surfaces = VertexId::new(0, &[], &[surface; 3][..which]);
        VertexId(VertexId::center(node, span).0 | surfaces.0)
    }

    /// A point in a face where surfaces meet, between points of the face by their numbers, which are below sixteen.
    pub fn between(node: usize, span: usize, points: &[usize], surfaces: &[usize]) -> VertexId {
        let points = points.iter().fold(0, |w, p| w << 5 | (*p as u64 + 1));
        VertexId(VertexId::center(node, span).0 | VertexId::new(0, &[], surfaces).0 | points << VertexId::POINTS)
    }

    /// Whether it is one of these.
    pub fn is_between(self) -> bool {
        self.0 >> VertexId::POINTS != 0
    }

    /// For a double crossing, 1 at the lower and 2 at the upper point; 0 for other vertices.
    pub fn index(self) -> usize {
        let mut surfaces = self.surfaces();
        let first = surfaces.next();
        surfaces.take_while(|f| Some(*f) == first).count()
    }

    pub fn node(self) -> usize {
        (self.0 & ((1 << VertexId::NODE) - 1)) as usize
    }

    pub fn steps(self) -> u64 {
        self.0 >> VertexId::NODE & 0o777
    }

    pub fn surfaces(self) -> impl Iterator<Item = usize> {
        (0..3).filter_map(move |i| {
            let f = self.0 >> (VertexId::NODE + 9 + i * VertexId::SURFACE) & ((1 << VertexId::SURFACE) - 1);
            (f > 0).then(|| f as usize - 1)
        })
    }

    /// The axes along which the simplex extends, as bits.
    pub fn spans(self) -> u64 {
        let s = self.steps();
        (s | s >> 3 | s >> 6) & 7
    }

    /// Whether it lies on a grid edge along an axis.
    pub fn is_along(self, axis: usize) -> bool {
        self.steps() == 1 << axis
    }

    /// The id among all tiles.
    pub fn global(self, node: u128, surface: impl Fn(usize) -> usize) -> u128 {
        let surfaces = self.surfaces().fold(0u128, |w, f| w << 16 | (surface(f) as u128 + 1));
        // In a face at most two surfaces meet: the bits of the third are free.
        let points = u128::from(self.0 >> VertexId::POINTS) << 32;
        node << 57 | u128::from(self.steps()) << 48 | surfaces | points
    }
}
