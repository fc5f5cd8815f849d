//! A field without what is in a tube.

use std::sync::Arc;

use super::{OutsideTube, Tube};
use crate::field::Field;
use crate::implicit::{Implicit, Negated};
use geometry::math::{Aabb, Interval, Vec3};

/// What a field has outside a tube.
pub struct Hollowed {
    /// The field.
    pub of: Arc<dyn Implicit>,
    /// The tube.
    pub tube: Arc<Tube>,
}

impl Hollowed {
    fn outside(&self) -> OutsideTube<'_> {
        OutsideTube { region: Some(&*self.of), tube: &self.tube }
    }
}

impl Field for Hollowed {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.outside().values(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.outside().gradients(points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.outside().bound(b)
    }

    fn is_large(&self) -> bool {
        self.of.is_large()
    }
}

impl Implicit for Hollowed {
    fn lipschitz(&self) -> f64 {
        self.of.lipschitz().max(1.0)
    }

    fn has_creases(&self) -> bool {
        true
    }

    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        let mut parts = self.of.parts();
        if parts.is_empty() {
            parts.push(self.of.clone());
        }
        parts.push(Arc::new(Negated(self.tube.clone())));
        parts
    }
}
