//! What the values of an amount run from and to.

use super::sample;
use crate::environment::Environment;
use crate::grade::Grade;
use crate::lattice::{Lattice, Level};
use crate::report::Varying;

/// Fractions that differ by less are one; all else by this share.
const SAME: f64 = 1e-6;

/// The least and the greatest of a number over a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Varied {
    pub min: f64,
    pub max: f64,
}

impl Varied {
    pub fn of(values: &[f64]) -> Varied {
        let (min, max) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        Varied { min, max }
    }

    /// A grade in the region, between the ends that a search finds and samples.
    pub fn of_grade(grade: &Grade, environment: &Environment) -> Varied {
        Varied::of(&sample::values(&grade.check_points(environment), |points, out| grade.values(points, out)))
    }

    pub fn map(self, f: impl Fn(f64) -> f64) -> Varied {
        if self.min == self.max { Varied::of(&[f(self.min)]) } else { Varied::of(&[f(self.min), f(self.max)]) }
    }

    /// The level t of the core at the points; half the thickness, where that is the level.
    pub fn of_iso(lattice: &Lattice, points: &[[f64; 3]]) -> Varied {
        if lattice.level.grade().constant().is_some() {
            let mut t = [0.0];
            lattice.isos(&points[..1], &mut t);
            return Varied::of(&t);
        }
        Varied::of(&sample::values(points, |points, out| lattice.isos(points, out)))
    }

    /// The solid fraction of the cell at the points.
    pub fn of_fraction(lattice: &Lattice, points: &[[f64; 3]]) -> Varied {
        match &lattice.level {
            Level::Fraction(g) => match g.constant() {
                Some(v) => Varied { min: v, max: v },
                None => Varied::of(&sample::values(points, |points, out| g.values(points, out))),
            },
            // The fraction rises (sheet, lower) or falls (upper) with the level, so its ends are at the level's ends.
            Level::Thickness(_) if lattice.map.affine().is_none() => {
                let found = Varied::of(&sample::values(points, |points, out| lattice.fractions(points, out)));
                // Cells of a map that was solved are alike but for rounding.
                if found.max - found.min < SAME { Varied { max: found.min, ..found } } else { found }
            }
            Level::Iso(_) | Level::Thickness(_) => Varied::of_iso(lattice, points).map(|t| lattice.fraction(t)),
        }
    }

    pub fn varying(self) -> Varying {
        if self.max - self.min <= SAME * self.max.abs() {
            Varying::Number(self.min)
        } else {
            Varying::Range([self.min, self.max])
        }
    }
}

impl core::fmt::Display for Varied {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        // Adding zero takes the sign off a negative one.
        let [min, max] = [self.min, self.max].map(|v| format!("{:.4}", (v * 1e4).round() / 1e4 + 0.0));
        if min == max { write!(f, "{min}") } else { write!(f, "{min} to {max}") }
    }
}
