//! Vertices of a net moved: onto their surfaces, and towards the mean of their neighbours along them.

use rayon::prelude::*;

use super::quad_net::{Net, Place};
use crate::field::Field;
use geometry::math::{Vec3, add, dot, norm, scale, sub};

/// Points evaluated at once.
const BATCH: usize = 256;

/// Values and gradients (per mm) at points.
pub fn gradients(field: &dyn Field, points: &[Vec3]) -> (Vec<f64>, Vec<Vec3>) {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    let each = points.par_chunks(BATCH).zip(v.par_chunks_mut(BATCH)).zip(g.par_chunks_mut(BATCH));
    each.for_each(|((p, v), g)| field.gradients(p, v, g));
    (v, g)
}

/// Newton's step to the zero of a function in the directions in which a vertex may move, no longer than `most` (mm).
fn step(place: Place, value: f64, gradient: Vec3, most: f64) -> Vec3 {
    let mut along = gradient;
    match place {
        Place::Surface => {}
        Place::Plane(plane) => along[usize::from(plane / 2)] = 0.0,
        Place::Edge(axis) => (0..3).filter(|a| *a != usize::from(axis)).for_each(|a| along[a] = 0.0),
    }
    let square = dot(along, along);
    if square == 0.0 {
        return [0.0; 3];
    }
    let length = value.abs() / square.sqrt();
    scale(along, -value.signum() * length.min(most) / square.sqrt())
}

impl Net {
    /// The vertices of a surface.
    fn of_surface(&self, surface: u8) -> Vec<usize> {
        (0..self.vertices.len()).filter(|v| self.vertices[*v].surface == surface).collect()
    }

    /// Moves the vertices of each surface onto it by Newton's method, and gives the unit normals there.
    pub fn project(&mut self, surfaces: &[&dyn Field], steps: usize, most: f64) -> Vec<Vec3> {
        let mut normals = vec![[0.0; 3]; self.vertices.len()];
        for (surface, field) in surfaces.iter().enumerate() {
            let own = self.of_surface(surface as u8);
            for last in (0..=steps).map(|s| s == steps) {
                let points: Vec<Vec3> = own.iter().map(|v| self.vertices[*v].at).collect();
                let (values, slopes) = gradients(*field, &points);
                for ((v, value), slope) in own.iter().zip(values).zip(slopes) {
                    let vertex = &mut self.vertices[*v];
                    if last {
                        normals[*v] = scale(slope, 1.0 / norm(slope).max(f64::MIN_POSITIVE));
                    } else {
                        vertex.at = add(vertex.at, step(vertex.place, value, slope, most));
                    }
                }
            }
        }
        normals
    }

    /// Moves vertices towards the mean of their neighbours, along the surfaces; those in a plane of the box towards the mean of
    /// their neighbours in it. Unit normals at the end. `most` is the longest step of Newton's method (mm).
    pub fn relax(&mut self, surfaces: &[&dyn Field], rounds: usize, most: f64) -> Vec<Vec3> {
        let mut normals = self.project(surfaces, 3, most);
        for _ in 0..rounds {
            let mut sum = vec![([0.0; 3], 0.0); self.vertices.len()];
            for edge in &self.edges {
                for (v, other) in [(edge.ends[0], edge.ends[1]), (edge.ends[1], edge.ends[0])] {
                    let weight = match self.vertices[v as usize].place {
                        Place::Plane(_) if edge.plane.is_none() => continue,
                        Place::Edge(_) => continue,
                        _ => 1.0,
                    };
                    let (at, count) = &mut sum[v as usize];
                    (*at, *count) = (add(*at, scale(self.vertices[other as usize].at, weight)), *count + weight);
                }
            }
            for ((vertex, (total, count)), normal) in self.vertices.iter_mut().zip(sum).zip(&normals) {
                if count == 0.0 {
                    continue;
                }
                let to = sub(scale(total, 1.0 / count), vertex.at);
                let mut along = sub(to, scale(*normal, dot(to, *normal)));
                if let Place::Plane(plane) = vertex.place {
                    along[usize::from(plane / 2)] = 0.0;
                }
                vertex.at = add(vertex.at, scale(along, 0.5));
            }
            normals = self.project(surfaces, 1, most);
        }
        self.project(surfaces, 4, most)
    }
}
