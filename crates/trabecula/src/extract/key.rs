//! Names of vertices.

/// The name of a vertex in a block: the lowest node of its simplex, the steps (sets of axes, each within the next) to
/// the others, and the faces that meet in it. In a side that is fitted to an edge, also the corners it lies between.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) struct Key(u64);

impl Key {
    const NODE: u32 = 18;
    const FACE: u32 = 7;
    const POINTS: u32 = Key::NODE + 9 + 3 * Key::FACE;
    /// The first two steps of the point inside a plain cell or its side: no simplex repeats a step.
    const CENTER: u64 = 0o11;

    pub fn new(node: usize, steps: &[usize], faces: &[usize]) -> Key {
        let steps = steps.iter().rev().fold(0, |w, s| w << 3 | *s as u64);
        let faces = faces.iter().rev().fold(0, |w, f| w << Key::FACE | (*f as u64 + 1));
        Key(node as u64 | (steps | faces << 9) << Key::NODE)
    }

    /// The point in the middle of the patch in a cell, or in a side of it, that spans some axes.
    pub fn center(node: usize, span: usize) -> Key {
        Key(node as u64 | (Key::CENTER * span as u64) << Key::NODE)
    }

    /// The first or second point of a grid edge that a face crosses twice: the face is named twice or thrice.
    pub fn crossing(node: usize, axis: usize, face: usize, which: usize) -> Key {
        Key::new(node, &[1 << axis], &[face; 3][..2 + which])
    }

    /// How many points of this kind there are in a side.
    pub const CORNERS: usize = 4;

    /// A point in a side, which spans two axes: one of several, those after the first of which name the face.
    pub fn corner(node: usize, span: usize, face: usize, which: usize) -> Key {
        let faces = Key::new(0, &[], &[face; 3][..which]);
        Key(Key::center(node, span).0 | faces.0)
    }

    /// A point in a side where faces meet, between points of the side by their numbers, which are below sixteen.
    pub fn between(node: usize, span: usize, points: &[usize], faces: &[usize]) -> Key {
        let points = points.iter().fold(0, |w, p| w << 5 | (*p as u64 + 1));
        Key(Key::center(node, span).0 | Key::new(0, &[], faces).0 | points << Key::POINTS)
    }

    /// Whether it is one of these.
    pub fn is_between(self) -> bool {
        self.0 >> Key::POINTS != 0
    }

    /// Of a point of a grid edge that a face crosses twice: one for the lower, two for the upper one; zero for others.
    pub fn index(self) -> usize {
        let mut faces = self.faces();
        let first = faces.next();
        faces.take_while(|f| Some(*f) == first).count()
    }

    pub fn node(self) -> usize {
        (self.0 & ((1 << Key::NODE) - 1)) as usize
    }

    pub fn steps(self) -> u64 {
        self.0 >> Key::NODE & 0o777
    }

    pub fn faces(self) -> impl Iterator<Item = usize> {
        (0..3).filter_map(move |i| {
            let f = self.0 >> (Key::NODE + 9 + i * Key::FACE) & ((1 << Key::FACE) - 1);
            (f > 0).then(|| f as usize - 1)
        })
    }

    /// The axes along which the simplex extends, as bits.
    pub fn spans(self) -> u64 {
        let s = self.steps();
        (s | s >> 3 | s >> 6) & 7
    }

    /// Whether this is a point of a grid edge along an axis.
    pub fn is_along(self, axis: usize) -> bool {
        self.steps() == 1 << axis
    }

    /// The name among all tiles.
    pub fn global(self, node: u128, face: impl Fn(usize) -> usize) -> u128 {
        let faces = self.faces().fold(0u128, |w, f| w << 16 | (face(f) as u128 + 1));
        // In a side at most two faces meet: the third one's room is free.
        let points = u128::from(self.0 >> Key::POINTS) << 32;
        node << 57 | u128::from(self.steps()) << 48 | faces | points
    }
}
