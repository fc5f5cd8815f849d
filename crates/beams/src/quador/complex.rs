//! The surface of a hub as faces on quadrics, arcs of conics in the planes that part them, and the vertices between.
//!
//! A face is told by its *label*, the stubs that shape it. Crossing a seam one stub joins or leaves (in a sharp hub one takes
//! over), where an affine function vanishes; `walk` finds the whole by following seams from event to event.

use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, norm, scale, sub, unit};
use geometry::union_find::{find, unite};

use super::bezier::{Bezier, curves};
use super::hub::{Affine, Hub};
use super::quadric::{Conic, Quadric};
use super::rule::gauss;

mod walk;

use walk::Walk;
pub(super) use walk::shift;

/// Where seams meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// The place, from the hub's centre.
    pub at: Vec3,
    key: Key,
}

/// Which event it is: the labels around it, and which of the two places where a line meets a quadric.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    around: [u64; 4],
    far: bool,
}

/// A seam between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Its vertices; one and the same if it closes on itself.
    pub ends: [u32; 2],
    /// The labels to its left and right, seen from outside.
    pub sides: [u64; 2],
    /// The conic, from the first end to the second.
    pub conic: Conic,
    /// The plane that it lies in.
    pub plane: Affine,
}

impl Arc {
    /// The conic as rational quadratic curves, from the first end to the second.
    pub fn curves(&self) -> Vec<Bezier<3>> {
        curves(&self.conic, 0.0, self.conic.end)
    }
}

/// A piece of one quadric.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The stubs that shape it, a bit for each: none on the ball, one on a stub, two on a fillet, more in a corner.
    pub label: u64,
    /// The quadric, about the hub's centre.
    pub quadric: Quadric,
    /// Its seams, to the left of each loop: arcs, and whether they are walked from their first end.
    pub loops: Vec<Vec<(u32, bool)>>,
    /// The stub whose rim, the circle in its split plane, bounds it too.
    pub rim: Option<u32>,
}

/// The surface of a hub.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Complex {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The arcs.
    pub arcs: Vec<Arc>,
    /// The faces.
    pub faces: Vec<Face>,
}

/// What is shorter is one place, in radii of the hub: far above the shift, far below what anything is made of.
pub(super) const MERGE: f64 = 1e-7;

const NONE: u32 = u32::MAX;

impl Complex {
    /// The surface of a hub.
    ///
    /// # Errors
    /// More than 64 beams, and hubs whose seams do not close (beams that swallow each other).
    pub fn new(hub: &Hub) -> Result<Complex, Fault> {
        if hub.stubs.len() > 64 {
            return Err(Fault::new(
                "",
                format!("{} beams meet in it: closed forms are made for up to 64", hub.stubs.len()),
            ));
        }
        let unresolved = || {
            Fault::new(
                "",
                "its beams swallow each other, so that their seams do not close: make them thinner, or use the field",
            )
        };
        // Another, larger shift is another chance where two events fell within rounding.
        for seed in 0..4 {
            let mut walk = Walk::new(hub, seed);
            if walk.run().is_none() {
                continue;
            }
            if let Some(complex) = walk.finish() {
                return Ok(complex);
            }
        }
        Err(unresolved())
    }

    /// V − E + F where a face counts one less for each loop beyond its first and rims are filled: two, as on a sphere.
    pub fn euler(&self) -> i64 {
        let faces: i64 = self.faces.iter().map(|f| 2 - f.loops.len() as i64).sum();
        self.vertices.len() as i64 - self.arcs.len() as i64 + faces
    }
}

impl Complex {
    /// The middle of a face on the ball that its seams go round once: of a cap, or of all but one.
    pub(super) fn pole(&self, face: &Face) -> Vec3 {
        let (mut sum, mut arrow) = ([0.0; 3], [0.0; 3]);
        for &(arc, forward) in face.loops.iter().flatten() {
            let conic = &self.arcs[arc as usize].conic;
            for &(t, w) in gauss(4) {
                let (x, dx) = conic.with_slope(t * conic.end);
                let turn = w * conic.end * if forward { 1.0 } else { -1.0 };
                sum = add(sum, scale(unit(x), w * conic.end * norm(dx)));
                arrow = add(arrow, scale(cross(x, dx), turn));
            }
        }
        // Seams may go round half the sphere or more: their area as a vector points to the face all the same.
        let flat = norm(arrow) <= 1e-3 * norm(sum);
        let p = unit(if flat { sum } else { arrow });
        scale(p, face.quadric.exit(p))
    }

    /// The same with arcs shorter than `least` made one place.
    fn merged(self, least: f64) -> Complex {
        let mut to: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut gone = vec![false; self.arcs.len()];
        for (i, a) in self.arcs.iter().enumerate() {
            let [p, q] = a.ends;
            let chord = |v: Vec3| norm(sub(v, self.vertices[p as usize].at));
            if p != q && chord(self.vertices[q as usize].at) < least && chord(a.conic.at(a.conic.end / 2.0)) < least {
                gone[i] = true;
                unite(&mut to, p, q);
            }
        }
        if !gone.contains(&true) {
            return self;
        }
        let mut name = vec![NONE; to.len()];
        let mut vertices = Vec::new();
        for (v, n) in name.iter_mut().enumerate() {
            if to[v] == v as u32 {
                *n = vertices.len() as u32;
                vertices.push(self.vertices[v]);
            }
        }
        let mut arc_name = vec![NONE; gone.len()];
        let mut arcs = Vec::new();
        for (i, a) in self.arcs.iter().enumerate() {
            if !gone[i] {
                arc_name[i] = arcs.len() as u32;
                arcs.push(Arc { ends: a.ends.map(|v| name[find(&mut to, v) as usize]), ..*a });
            }
        }
        let mut faces = self.faces;
        for l in faces.iter_mut().flat_map(|f| &mut f.loops) {
            l.retain(|(a, _)| !gone[*a as usize]);
            l.iter_mut().for_each(|(a, _)| *a = arc_name[*a as usize]);
        }
        faces.retain(|f| f.loops.is_empty() || f.loops.iter().any(|l| !l.is_empty()));
        Complex { vertices, arcs, faces }
    }
}
