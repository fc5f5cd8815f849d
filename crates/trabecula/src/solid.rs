//! A solid: a field and a region.

use std::sync::Arc;

use crate::face::{Face, Tree};
use crate::field::Field;
use crate::math::{Aabb, Interval, Vec3};
use crate::region::Region;

/// What a design means: the part of the region in which the field is negative.
#[derive(Clone)]
pub struct Solid {
    /// Where the part may be.
    pub region: Region,
    /// The lattice; `None` leaves the region full.
    pub field: Option<Arc<dyn Field>>,
    /// The smallest wavelength (mm); grid spacings are given by it.
    pub wavelength: f64,
}

impl Solid {
    /// The smooth faces of the solid and how they make it.
    pub fn faces(&self) -> (Vec<Face>, Tree) {
        let mut faces = Vec::new();
        let mut all = vec![self.region.clone().faces(0.0, &mut faces)];
        if let Some(field) = &self.field {
            let mut parts = field.parts();
            if parts.is_empty() {
                parts.push(field.clone());
            }
            for part in parts {
                all.push(Tree::Face(faces.len()));
                faces.push(Face {
                    slope: part.slope(),
                    field: part,
                    plane: None,
                    cut: false,
                });
            }
        }
        (faces, Tree::All(all))
    }
}

/// As a field, the greater of the lattice's value and the region's signed distance: negative in the finished part,
/// positive outside, continuous, and not a distance. Extraction keeps the two apart.
impl Field for Solid {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.region.values(points, out);
        if let Some(field) = &self.field {
            let mut f = vec![0.0; points.len()];
            field.values(points, &mut f);
            for (o, f) in out.iter_mut().zip(f) {
                *o = o.max(f);
            }
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.region.gradients(points, values, gradients);
        if let Some(field) = &self.field {
            let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
            field.gradients(points, &mut f, &mut g);
            for i in 0..points.len() {
                if f[i] > values[i] {
                    (values[i], gradients[i]) = (f[i], g[i]);
                }
            }
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let r = self.region.bound(b);
        self.field.as_ref().map_or(r, |f| r.max(f.bound(b)))
    }
}
