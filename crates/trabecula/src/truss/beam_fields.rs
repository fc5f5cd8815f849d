//! Beams as implicit functions for surface extraction.

use beams::pattern::PatternField;
use beams::quador::{FillRequest, Quadors};
use geometry::feature_edges::Creases;
use geometry::math::{Aabb, Interval, Vec3};

use crate::field::{Block, Field};
use crate::implicit::Implicit;

macro_rules! field_of {
    ($($beams:ty { $($fill:item)* } { $($known:item)* })*) => {$(
        impl Field for $beams {
            fn values(&self, points: &[Vec3], out: &mut [f64]) {
                <$beams>::values(self, points, out);
            }

            fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
                <$beams>::gradients(self, points, values, gradients);
            }

            fn bound(&self, b: &Aabb) -> Interval {
                <$beams>::bound(self, b)
            }

            $($fill)*
        }

        impl Implicit for $beams {
            fn lipschitz(&self) -> f64 {
                <$beams>::lipschitz(self)
            }

            fn has_creases(&self) -> bool {
                <$beams>::has_creases(self)
            }

            $($known)*
        }
    )*};
}

field_of!(
    Quadors {
        fn fill(&self, block: &Block, out: &mut [f32]) {
            Quadors::fill(self, block.axes, FillRequest { nodes: None, near: false }, out);
        }

        fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
            Quadors::fill(self, block.axes, FillRequest { nodes: Some(wanted), near: false }, out);
        }

        fn fill_near(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
            Quadors::fill(self, block.axes, FillRequest { nodes: Some(wanted), near: true }, out);
        }

        fn is_large(&self) -> bool {
            Quadors::is_large(self)
        }
    } {
        fn creases(&self, step: f64) -> Creases {
            Quadors::creases(self, step)
        }
    }
    PatternField {} {}
);
