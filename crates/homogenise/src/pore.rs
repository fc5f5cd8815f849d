//! The pore space of a periodic cell as the nodes of a cubic grid, and its walls as distances along the links between nodes.

use geometry::fault::Fault;

use crate::percolation::{Component, components};

/// The velocities of a node: none, then nine pairs of opposite ones.
pub const VELOCITIES: [[i32; 3]; 19] = [
    [0, 0, 0],
    [1, 0, 0],
    [-1, 0, 0],
    [0, 1, 0],
    [0, -1, 0],
    [0, 0, 1],
    [0, 0, -1],
    [1, 1, 0],
    [-1, -1, 0],
    [1, -1, 0],
    [-1, 1, 0],
    [1, 0, 1],
    [-1, 0, -1],
    [1, 0, -1],
    [-1, 0, 1],
    [0, 1, 1],
    [0, -1, -1],
    [0, 1, -1],
    [0, -1, 1],
];

/// The number of the opposite velocity.
pub const fn opposite(q: usize) -> usize {
    if q == 0 { 0 } else { ((q - 1) ^ 1) + 1 }
}

/// A link from a node of the pore that a wall crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallLink {
    /// The node.
    pub node: usize,
    /// The number of the velocity along the link.
    pub velocity: usize,
    /// Where the wall is: 0 at the node, 1 at the other end.
    pub distance: f64,
}

/// A periodic cell whose pore is filled by the nodes of a cubic grid.
///
/// The edges of the cell are (nx, 0, 0), (s, ny, 0) and (t, u, nz) in steps of the grid: shape [nx, ny, nz], lean [s, t, u].
#[derive(Clone, Debug)]
pub struct PoreGrid {
    /// Nodes along each axis.
    pub shape: [usize; 3],
    /// By how much the second edge leans along x, and the third along x and y.
    pub lean: [i64; 3],
    /// Whether a node is in the pore, x fastest.
    pub pore: Vec<bool>,
    /// Links that a wall crosses, in the order of nodes and velocities. A link from the pore to a node outside it that is missing here
    /// counts as crossed half-way.
    pub walls: Vec<WallLink>,
}

impl PoreGrid {
    /// A grid that has been checked.
    ///
    /// # Errors
    /// Numbers that do not fit together; walls out of order or outside their links.
    pub fn new(shape: [usize; 3], lean: [i64; 3], pore: Vec<bool>, walls: Vec<WallLink>) -> Result<PoreGrid, Fault> {
        let count: usize = shape.iter().product();
        if count == 0 || count != pore.len() {
            let message = format!("{} values for {shape:?} nodes; give one for each", pore.len());
            return Err(Fault::new("pore", message));
        }
        if walls.windows(2).any(|w| (w[0].node, w[0].velocity) >= (w[1].node, w[1].velocity)) {
            return Err(Fault::new("walls", "links must be in the order of nodes and velocities, each once"));
        }
        let sound = |w: &WallLink| {
            w.node < count && pore[w.node] && (1..19).contains(&w.velocity) && w.distance > 0.0 && w.distance <= 1.0
        };
        if let Some(w) = walls.iter().find(|w| !sound(w)) {
            return Err(Fault::new(
                "walls",
                format!("{w:?}; a wall crosses a link from a node of the pore, above 0 up to 1"),
            ));
        }
        Ok(PoreGrid { shape, lean, pore, walls })
    }

    /// The share of the nodes that are in the pore.
    pub fn porosity(&self) -> f64 {
        self.pore.iter().filter(|p| **p).count() as f64 / self.pore.len() as f64
    }

    /// The node at the end of a link, and the cell it is in.
    pub fn neighbour(&self, node: usize, velocity: usize) -> (usize, [i32; 3]) {
        let [nx, ny, nz] = self.shape.map(|n| n as i64);
        let node = node as i64;
        let [dx, dy, dz] = VELOCITIES[velocity].map(i64::from);
        let (mut x, mut y, mut z) = (node % nx + dx, node / nx % ny + dy, node / nx / ny + dz);
        let k = z.div_euclid(nz);
        z -= k * nz;
        x -= k * self.lean[1];
        y -= k * self.lean[2];
        let j = y.div_euclid(ny);
        y -= j * ny;
        x -= j * self.lean[0];
        let i = x.div_euclid(nx);
        x -= i * nx;
        (((z * ny + y) * nx + x) as usize, [i as i32, j as i32, k as i32])
    }

    /// For each node, a bit for each velocity along which no other node of the pore is reached.
    pub(crate) fn blocked(&self) -> Vec<u32> {
        let mut blocked = vec![0u32; self.pore.len()];
        for (node, bits) in blocked.iter_mut().enumerate() {
            if self.pore[node] {
                for q in 1..19 {
                    *bits |= u32::from(!self.pore[self.neighbour(node, q).0]) << q;
                }
            }
        }
        // A wall between two nodes of the pore is one from both sides.
        for w in &self.walls {
            blocked[w.node] |= 1 << w.velocity;
            blocked[self.neighbour(w.node, w.velocity).0] |= 1 << opposite(w.velocity);
        }
        blocked
    }

    /// The connected components of the pore in which something can flow: those that are connected with their own translates.
    pub(crate) fn channels(&self, blocked: &[u32]) -> Vec<Component> {
        let near = |node: usize, out: &mut Vec<(usize, [i32; 3])>| {
            out.extend((1..19).filter(|q| blocked[node] >> q & 1 == 0).map(|q| self.neighbour(node, q)));
        };
        let mut all = components(self.pore.len(), |i| self.pore[i], near);
        all.retain(|c| !c.windings.is_empty());
        all
    }
}
