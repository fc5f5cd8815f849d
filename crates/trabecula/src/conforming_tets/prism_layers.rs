//! Layers of prisms along the boundary, each prism cut into three tetrahedra.
//!
//! The boundary stays as it is. Its nodes on the chosen faces are pushed into the mesh, whose shapes are improved on the way, and the
//! space behind them is filled: a column of prisms over each face. At edges and corners of the part, columns meet in the bisecting
//! plane; where other faces begin, their nodes move along these; where the choice ends within a smooth face, layers taper to wedges.
//! Where the mesh leaves no room for a node it goes less far, and its layers are thinner in proportion.
//!
//! Each quadrilateral between two prisms is cut from the lesser node outside to the greater inside, so that adjacent prisms agree
//! (Dompierre, Labbé, Vallet, Camarero 1999).

use super::chord_balance::interfaces;
use super::node_surfaces::{HELD, SurfaceSet};
use super::prism_columns::{Columns, FilledLayers, MadeLayers, PushedNode, ascending, has_twice, staircase};
use super::shaping::Shaping;
use super::tet_shape::shape;
use crate::region::Region;
use geometry::fault::Fault;
use geometry::math::{IDENTITY, Mat3, Vec3, add, apply, cross, inverse, norm, scale, sub};
use geometry::tetmesh::FACES;

/// Longest way of a node, in heights of all layers: that of a corner of 60 degrees.
const LONGEST: f64 = 2.0;
/// Damping of the equations of a node over their trace, and the number of times they are solved for what is left: ways across planes are
/// exact to rounding, and none are long along the planes of a curved face, which are nearly the same (iterated Tikhonov regularisation).
const DAMPING: f64 = 1e-3;
const SOLUTIONS: usize = 6;

/// The layers that are asked for.
#[derive(Clone)]
pub struct PrismLayers {
    /// The depth of the end of each layer below the surface, ascending, mm.
    pub ends: Vec<f64>,
    /// Where they are: on faces of the boundary that have their middles in this region; everywhere without.
    pub on: Option<Region>,
}

impl PrismLayers {
    /// The ends of `count` layers, of which the outermost is `height` high and each other `growth` times the one outside it, mm.
    pub fn ends(count: u32, height: f64, growth: f64) -> Vec<f64> {
        let heights = (0..count).map(|i| height * growth.powi(i as i32));
        let sum = |depth: &mut f64, height: f64| {
            *depth += height;
            Some(*depth)
        };
        heights.scan(0.0, sum).collect()
    }
}

/// The shortest solution of the normal equations of a node, but for directions in which they say little.
fn shortest(matrix: &Mat3, right: Vec3) -> Vec3 {
    let trace: f64 = (0..3).map(|i| matrix[i][i]).sum();
    let damped = inverse(&core::array::from_fn(|i| add(matrix[i], scale(IDENTITY[i], DAMPING * trace))));
    let solved = (0..SOLUTIONS).fold([0.0; 3], |x, _| add(x, apply(&damped, sub(right, apply(matrix, x)))));
    if solved.iter().all(|v| v.is_finite()) { solved } else { [0.0; 3] }
}

impl Shaping<'_> {
    /// Makes the layers, of a mesh of one domain that is not periodic.
    ///
    /// # Errors
    /// No face of the boundary is chosen, or none that has a node within the choice; there would be more than `most` tetrahedra.
    pub fn layered(&mut self, layers: &PrismLayers, most: usize) -> Result<(MadeLayers, FilledLayers), Fault> {
        let (chosen, others) = self.chosen_faces(layers.on.as_ref());
        if chosen.is_empty() {
            let message = "no triangle of the boundary has its middle in this region; move it, or leave it out";
            return Err(Fault::new("layers.on", message));
        }
        let more = 3 * chosen.len() * layers.ends.len();
        if self.tets.len() + more > most {
            let message = format!(
                "{} triangles in {} layers make {more} tetrahedra, of at most {most} in all; give fewer",
                chosen.len(),
                layers.ends.len()
            );
            return Err(Fault::new("layers.count", message));
        }
        let depth = layers.ends.last().copied().unwrap_or(0.0);
        let mut columns = Columns::new(self.pushed(&chosen, &others, depth), &chosen, &layers.ends, self);
        if columns.pushed.iter().all(|p| norm(p.by) <= 0.0) {
            let message = format!(
                "all nodes of the {} triangles of the boundary in this region lie at its edge, where layers end; enlarge it, or give a \
                 smaller size",
                chosen.len()
            );
            return Err(Fault::new("layers.on", message));
        }
        let boundary: Vec<SurfaceSet> = columns.pushed.iter().map(|p| self.on[p.node as usize]).collect();
        columns.pushed.iter().for_each(|p| self.on[p.node as usize] = HELD);
        for fair in [false, true] {
            self.push(&mut columns, fair);
            self.settle(&mut columns);
        }
        for (p, on) in columns.pushed.iter().zip(&boundary) {
            self.on[p.node as usize] = if p.is_pushed() { p.along } else { *on };
        }
        let (prisms, filled) = self.fill(&columns, &boundary);
        Ok((columns.made(prisms), filled))
    }

    /// The faces of the boundary that have their middles in a region, counter-clockwise seen from outside, and the others.
    fn chosen_faces(&self, on: Option<&Region>) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
        let faces = interfaces(&self.tets, &self.domain, &|_| true);
        let outward = faces.into_iter().map(|(_, at, _)| FACES[at as usize % 4].map(|c| self.tets[at as usize / 4][c]));
        let third = |f: &[u32; 3]| scale(f.iter().fold([0.0; 3], |s, n| add(s, self.nodes[*n as usize])), 1.0 / 3.0);
        outward.partition(|f| on.is_none_or(|on| on.value(third(f)) < 0.0))
    }

    /// The nodes of the chosen faces with their ways: to `depth` (mm) below all chosen faces about them, along the others.
    fn pushed(&self, chosen: &[[u32; 3]], others: &[[u32; 3]], depth: f64) -> Vec<PushedNode> {
        let set = |f: &[u32; 3]| f.iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]);
        let area = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|n| self.nodes[n as usize]);
            cross(sub(b, a), sub(c, a))
        };
        let mut leave = vec![0; self.nodes.len()];
        let mut along = vec![0; self.nodes.len()];
        // Σ n nᵀ and Σ w n over the faces of a node.
        let mut sums = vec![([[0.0; 3]; 3], [0.0; 3]); self.nodes.len()];
        let mut plane = |f: &[u32; 3], wanted: f64| {
            let normal = area(f);
            let size = norm(normal);
            if size <= 0.0 {
                return;
            }
            let n = scale(normal, 1.0 / size);
            for node in f {
                let (matrix, right) = &mut sums[*node as usize];
                (0..3).for_each(|i| matrix[i] = add(matrix[i], scale(n, n[i])));
                *right = add(*right, scale(n, wanted));
            }
        };
        for f in chosen {
            plane(f, -depth);
            f.iter().for_each(|n| leave[*n as usize] |= set(f) | HELD);
        }
        for f in others {
            plane(f, 0.0);
            f.iter().for_each(|n| along[*n as usize] |= if set(f) == 0 { HELD } else { set(f) });
        }
        let nodes = (0..self.nodes.len() as u32).filter(|n| leave[*n as usize] != 0);
        let way = |node: u32| {
            let (leave, along) = (leave[node as usize], along[node as usize]);
            let from = self.nodes[node as usize];
            let ends_here = along & leave != 0;
            let (matrix, right) = sums[node as usize];
            let by = if ends_here { [0.0; 3] } else { shortest(&matrix, right) };
            let reach = (LONGEST * depth / norm(by).max(f64::MIN_POSITIVE)).min(1.0);
            PushedNode { node, from, by: scale(by, reach), along: along & !HELD, way: [0.0; 3], reach }
        };
        nodes.map(way).collect()
    }

    /// Fills the space behind the pushed nodes with a column of prisms over each face; their number too. `boundary` has the surfaces on
    /// which each node was.
    fn fill(&mut self, columns: &Columns, boundary: &[SurfaceSet]) -> (usize, FilledLayers) {
        let last = columns.levels.len() - 1;
        // The nodes of each pushed one from the surface inwards.
        let mut nodes: Vec<Vec<u32>> = Vec::with_capacity(columns.pushed.len());
        for (p, on) in columns.pushed.iter().zip(boundary) {
            let mut column = Vec::with_capacity(last + 1);
            for (k, level) in columns.levels.iter().enumerate() {
                match p.at(self, p.way, *level) {
                    Some(at) if p.is_pushed() && k < last => {
                        column.push(self.nodes.len() as u32);
                        self.nodes.push(at);
                        self.on.push(if k == 0 { *on } else { p.along });
                        self.next.push(self.nodes.len() as u32 - 1);
                        self.around.push(Vec::new());
                    }
                    _ => column.push(p.node),
                }
            }
            nodes.push(column);
        }
        let (first, mut wanted) = (self.tets.len(), Vec::new());
        let mut prisms = 0;
        for (face, [small, large]) in columns.faces.iter().zip(&columns.wanted) {
            let (sorted, outward) = ascending(*face);
            let [a, b, c] = sorted.map(|i| &nodes[i]);
            for level in 0..last {
                let before = self.tets.len();
                let made = staircase([a, b, c].map(|column| [column[level], column[level + 1]]));
                made.into_iter().for_each(|t| self.add_tet(t, outward));
                prisms += usize::from(self.tets.len() > before);
                wanted.resize(self.tets.len() - first, small.min(*large));
            }
        }
        nodes.iter_mut().for_each(Vec::dedup);
        (prisms, FilledLayers { columns: nodes, first, wanted })
    }

    /// Adds a tetrahedron, of a prism over a face that `outward` says to be counter-clockwise, unless two of its nodes are one.
    fn add_tet(&mut self, mut t: [u32; 4], outward: bool) {
        if has_twice(&t) {
            return;
        }
        if outward {
            t.swap(0, 1);
        }
        let number = self.tets.len() as u32;
        t.iter().for_each(|n| self.around[*n as usize].push(number));
        self.shapes.push(shape(t.map(|n| self.nodes[n as usize])));
        self.domain.push(0);
        self.tets.push(t);
    }
}
