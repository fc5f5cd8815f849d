//! Whether a tetrahedral mesh is one: what a lattice that is carried by it has to rely on.

use std::collections::HashMap;

use super::{TetMesh, volume};
use crate::fault::{Fault, counted, number};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::{Mesh, near_pairs, self_intersections};

/// A volume below this share of the cube of the longest edge is none: coordinates in single precision leave no more.
const FLAT: f64 = 1e-9;
/// Nodes closer than this share of the mesh's extent are one place: ten roundings in single precision.
const SAME: f64 = 1e-6;
/// A node is on a face if it is closer than this share of the face's longest edge.
const ON: f64 = 1e-5;

/// What was found in a mesh that is one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Whether every tetrahedron was numbered the other way round, and was turned.
    pub turned: bool,
    /// Pieces that hold together by faces.
    pub pieces: usize,
    /// Nodes that no tetrahedron uses, left out.
    pub unused: usize,
    /// Edges of the boundary in which it meets itself.
    pub pinched: usize,
}

impl TetMesh {
    /// The mesh with every tetrahedron positive and every node used, if it is a conforming one.
    ///
    /// **Errors**: no tetrahedron; nodes that are not there or not finite; flat tetrahedra; some that are inverted (if
    /// all are they are turned); nodes in one place; faces of more than two tetrahedra, or with two on one side; nodes
    /// on the faces or edges of tetrahedra that do not have them; tetrahedra that reach into each other at the boundary.
    pub fn checked(mut self) -> Result<(TetMesh, Checked), Fault> {
        let fault = |message: String| Err(Fault::new("", message));
        if self.tets.is_empty() {
            return fault("the mesh has no tetrahedron".into());
        }
        if !self.zones.is_empty() && self.zones.len() != self.tets.len() {
            return fault(format!(
                "{} for {} tetrahedra; give one for each",
                counted(self.zones.len(), "zone"),
                self.tets.len()
            ));
        }
        let count = self.nodes.len();
        if let Some((i, n)) = first(&self.tets, |t| t.iter().copied().find(|n| *n as usize >= count)) {
            return fault(format!("tetrahedron {i} names node {n}, but there are {count} nodes (counted from 0)"));
        }
        if let Some((i, p)) = first(&self.nodes, |p| p.iter().any(|x| !x.is_finite()).then_some(*p)) {
            return fault(format!("node {i} is at {p:?}; coordinates must be finite"));
        }
        let before = self.nodes.len();
        let mut found = Checked::default();
        self = self.compact();
        found.unused = before - self.nodes.len();
        found.turned = self.orient()?;
        self.no_same_place()?;
        self.faces_fit()?;
        let boundary = self.boundary();
        hanging(&boundary)?;
        let crossings = self_intersections(&boundary, 1000);
        if crossings > 0 {
            return fault(format!(
                "the boundary meets itself {crossings}{} times: tetrahedra overlap, or neighbours do not share whole \
                 faces; mesh the part again with elements that fit face to face",
                if crossings == 1000 { " or more" } else { "" }
            ));
        }
        found.pieces = self.pieces().0;
        found.pinched = pinched(&boundary);
        Ok((self, found))
    }

    /// Turns the tetrahedra if all of them are inverted; refuses flat ones and a mixture.
    fn orient(&mut self) -> Result<bool, Fault> {
        let mut inverted = Vec::new();
        let mut flat = Vec::new();
        for i in 0..self.tets.len() {
            let v = volume(self.corners(i));
            if v.abs() <= FLAT * longest(self.corners(i)).powi(3) {
                flat.push(i);
            } else if v < 0.0 {
                inverted.push(i);
            }
        }
        let reported = |of: &[usize], what: &str, todo: &str| {
            Err(Fault::new(
                "",
                format!(
                    "{} of {} tetrahedra {what}, the first number {} at {}; {todo}",
                    of.len(),
                    self.tets.len(),
                    of[0],
                    place(middle(&self.corners(of[0])))
                ),
            ))
        };
        if !flat.is_empty() {
            return reported(&flat, "are flat (no volume)", "mesh again, or collapse them");
        }
        if inverted.is_empty() {
            return Ok(false);
        }
        if inverted.len() < self.tets.len() {
            return reported(
                &inverted,
                "are inverted (negative volume)",
                "nodes were moved through faces, or are numbered in two ways: mesh again or renumber them",
            );
        }
        self.tets.iter_mut().for_each(|t| t.swap(2, 3));
        Ok(true)
    }

    /// Refuses nodes in one place, which would leave a slit between tetrahedra.
    fn no_same_place(&self) -> Result<(), Fault> {
        let bounds = self.nodes.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let within = SAME * norm(bounds.size());
        let cell = |p: &Vec3| p.map(|x| (x / (2.0 * within)).floor() as i64);
        let mut at: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(self.nodes.len());
        let (mut pairs, mut one) = (0, None);
        for (i, p) in self.nodes.iter().enumerate() {
            let (low, high) = (cell(&p.map(|x| x - within)), cell(&p.map(|x| x + within)));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        for &j in at.get(&[x, y, z]).into_iter().flatten() {
                            if norm(sub(self.nodes[j as usize], *p)) <= within {
                                pairs += 1;
                                one = one.or(Some((j, i, *p)));
                            }
                        }
                    }
                }
            }
            at.entry(cell(p)).or_default().push(i as u32);
        }
        let Some((a, b, p)) = one else { return Ok(()) };
        Err(Fault::new(
            "",
            format!(
                "{} of nodes in one place, such as {a} and {b} at {}: the tetrahedra there do not hold together; merge \
                 the nodes in the program that made the mesh",
                counted(pairs, "pair"),
                place(p)
            ),
        ))
    }

    /// Refuses faces of more than two tetrahedra, and two tetrahedra on one side of a face.
    fn faces_fit(&self) -> Result<(), Fault> {
        let mut faces = self.faces();
        faces.sort_unstable();
        for same in faces.chunk_by(|a, b| a.0 == b.0) {
            let reported = |what: String| {
                let [a, b, c] = same[0].0;
                let at = [a, b, c].map(|n| self.nodes[n as usize]);
                Err(Fault::new(
                    "",
                    format!(
                        "the face of nodes {a}, {b}, {c} at {} {what}; a mesh in which tetrahedra fit face to face is \
                         needed",
                        place(middle(&at))
                    ),
                ))
            };
            match same {
                [_] => {}
                [(_, f), (_, g)] => {
                    let (f, g) = (self.face(*f), self.face(*g));
                    let turn = (0..3).any(|k| [g[k], g[(k + 2) % 3], g[(k + 1) % 3]] == f);
                    if !turn {
                        return reported("has two tetrahedra on one side: they overlap".into());
                    }
                }
                more => return reported(format!("is shared by {} tetrahedra", more.len())),
            }
        }
        Ok(())
    }
}

/// Refuses nodes of the boundary that lie on boundary faces or edges which do not have them.
fn hanging(boundary: &Mesh) -> Result<(), Fault> {
    let longest = longest_edge(boundary);
    let found = near_pairs(boundary, ON * longest, |i, j| hung(boundary, i, j));
    let mut nodes: Vec<u32> = found;
    nodes.sort_unstable();
    nodes.dedup();
    let Some(first) = nodes.first() else {
        return Ok(());
    };
    Err(Fault::new(
        "",
        format!(
            "{} on a face or an edge of tetrahedra that do not have it (hanging), such as the one at {}; refine the \
             neighbours too, so that tetrahedra share whole faces",
            match nodes.len() {
                1 => "1 node lies".to_string(),
                n => format!("{n} nodes lie"),
            },
            place(boundary.vertices[*first as usize])
        ),
    ))
}

/// A node of one of two triangles that lies on the other, which does not have it.
fn hung(boundary: &Mesh, i: usize, j: usize) -> Option<u32> {
    let on = |i: usize, j: usize| {
        let (t, corners) = (boundary.triangles[i], boundary.corners(i));
        let mut others = boundary.triangles[j].into_iter();
        others.find(|v| !t.contains(v) && lies_on(boundary.vertices[*v as usize], corners))
    };
    on(i, j).or_else(|| on(j, i))
}

fn longest_edge(boundary: &Mesh) -> f64 {
    let sides = (0..boundary.triangles.len()).map(|i| {
        let [a, b, c] = boundary.corners(i);
        norm(sub(a, b)).max(norm(sub(b, c))).max(norm(sub(c, a)))
    });
    sides.fold(0.0, f64::max)
}

/// Whether a place is on a triangle, its edges included, to within a small share of its longest edge.
fn lies_on(p: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
    let n = cross(sub(b, a), sub(c, a));
    let reach = ON * norm(sub(a, b)).max(norm(sub(b, c))).max(norm(sub(c, a)));
    if dot(sub(p, a), n).abs() > reach * norm(n) {
        return false;
    }
    [(a, b), (b, c), (c, a)].into_iter().all(|(a, b)| {
        let inwards = cross(n, sub(b, a));
        dot(sub(p, a), inwards) >= -reach * norm(inwards)
    })
}

/// Edges of a closed boundary that more than two triangles have.
fn pinched(boundary: &Mesh) -> usize {
    let mut edges: Vec<[u32; 2]> = boundary
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(|[x, y]| [x.min(y), x.max(y)]))
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() > 2).count()
}

fn first<T, R>(of: &[T], f: impl Fn(&T) -> Option<R>) -> Option<(usize, R)> {
    of.iter().enumerate().find_map(|(i, t)| Some((i, f(t)?)))
}

fn longest(p: [Vec3; 4]) -> f64 {
    let lengths = super::EDGES.map(|[a, b]| norm(sub(p[a], p[b])));
    lengths.into_iter().fold(0.0, f64::max)
}

fn middle(of: &[Vec3]) -> Vec3 {
    let sum = of.iter().fold([0.0; 3], |s, p| add(s, *p));
    scale(sum, 1.0 / of.len() as f64)
}

/// A place in a sentence.
pub fn place([x, y, z]: Vec3) -> String {
    let short = |v: f64| number((v * 1e4).round() / 1e4 + 0.0);
    format!("({}, {}, {}) mm", short(x), short(y), short(z))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::tests::cube;
    use super::*;

    fn refused(mesh: TetMesh, words: &str) {
        let message = mesh.checked().unwrap_err().message;
        assert!(message.contains(words), "{message}");
    }

    #[test]
    fn a_sound_mesh_is_taken_as_it_is() {
        let (mesh, found) = cube().checked().unwrap();
        assert_eq!(mesh, cube());
        let plain = Checked { pieces: 1, ..Checked::default() };
        assert_eq!(found, plain);
        let mut more = cube();
        more.nodes.insert(0, [9.0; 3]);
        more.tets.iter_mut().flatten().for_each(|n| *n += 1);
        more.tets.iter_mut().for_each(|t| t.swap(0, 1));
        let (mesh, found) = more.checked().unwrap();
        assert!((mesh.volume() - 1.0).abs() < 1e-15);
        assert_eq!((found.turned, found.unused), (true, 1));
        // Two pieces that share an edge.
        let mut two = cube();
        two.tets.remove(5);
        two.tets.remove(2);
        let (_, found) = two.checked().unwrap();
        assert_eq!((found.pieces, found.pinched), (2, 1));
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_the_place() {
        refused(TetMesh::default(), "no tetrahedron");
        let mut m = cube();
        m.tets[3][1] = 12;
        refused(m, "tetrahedron 3 names node 12, but there are 8 nodes");
        let mut m = cube();
        m.nodes[5][2] = f64::NAN;
        refused(m, "node 5 is at [1.0, 0.0, NaN]");
        let mut m = cube();
        m.tets[2].swap(0, 1);
        refused(m, "1 of 6 tetrahedra are inverted (negative volume), the first number 2 at");
        let mut m = cube();
        m.tets.push([0, 1, 3, 2]);
        refused(m, "1 of 7 tetrahedra are flat");
        let mut m = cube();
        m.tets.push(m.tets[1]);
        refused(m, "overlap");
        let mut m = cube();
        m.nodes.push([0.7, 0.9, 0.5]);
        m.nodes.push([0.6, 0.9, 0.6]);
        m.tets.push([0, 3, 8, 7]);
        refused(m.clone(), "is shared by 3 tetrahedra");
        // A slit along the face of two tetrahedra.
        let mut m = cube();
        m.nodes.push(m.nodes[3]);
        m.tets[1] = [0, 8, 2, 7];
        refused(m, "1 pair of nodes in one place, such as 3 and 8 at (1, 1, 0) mm");
        let mut m = cube();
        m.zones = vec![1, 2];
        refused(m, "2 zones for 6 tetrahedra");
    }

    #[test]
    fn neighbours_that_do_not_share_faces_are_refused() {
        // The edge 0–7 has its midpoint in one tetrahedron alone.
        let mut m = cube();
        m.nodes.push([0.5; 3]);
        m.tets[0] = [0, 1, 3, 8];
        m.tets.push([8, 1, 3, 7]);
        refused(m, "1 node lies on a face or an edge of tetrahedra that do not have it (hanging)");
        // Two cubes side by side, the square between them cut along its other diagonal.
        let mut m = cube();
        let second = cube();
        let new: Vec<u32> = (0..8).map(|i| if i & 1 == 0 { i + 1 } else { 8 + i / 2 }).collect();
        m.nodes.extend((0..4).map(|i| [2.0, f64::from(i & 1), f64::from(i >> 1)]));
        // Mirrored in y, so that the diagonals on both sides cross.
        let mirror = |i: u32| i ^ 2;
        m.tets.extend(second.tets.iter().map(|t| {
            let [a, b, c, d] = t.map(|i| new[mirror(i) as usize]);
            [a, b, d, c]
        }));
        refused(m, "the boundary meets itself");
        // A corner of one pushed into another.
        let mut m = cube();
        m.nodes.extend([[0.5, 0.5, 0.9], [0.4, 0.4, 2.0], [0.6, 0.3, 2.0], [0.6, 0.6, 2.0]]);
        m.tets.push([8, 9, 10, 11]);
        let v = volume(m.corners(6));
        if v < 0.0 {
            m.tets[6].swap(0, 1);
        }
        refused(m, "the boundary meets itself");
    }
}
