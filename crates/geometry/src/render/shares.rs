//! Shares of named parts on a surface, as mixtures of their colours.

use super::legend::{self, LegendRow};
use super::palette::{self, AREAS};
use super::paper::Paper;
use super::section::PlaneGrid;
use super::tint::{Tint, decode};
use crate::math::Vec3;

/// The colours of a surface.
#[derive(Clone, Debug)]
pub enum Colours {
    /// A number.
    Scale(Tint),
    /// Shares at each vertex.
    Shares(Shares),
}

/// The colours of a section: at the points of a grid in its plane a number, or shares, those of a point one after another.
#[derive(Clone, Debug)]
pub struct SectionColours {
    /// The points.
    pub grid: PlaneGrid,
    /// The numbers or shares.
    pub values: Vec<f64>,
}

/// Shares of named parts at each vertex.
#[derive(Clone, Debug)]
pub struct Shares {
    /// What they are, in words; nothing is written if it is empty.
    pub title: String,
    /// The parts.
    pub names: Vec<String>,
    /// The shares at each vertex, those of a vertex one after another, 0 to 1; none counts where one is not finite.
    pub values: Vec<f64>,
}

impl Colours {
    /// The colour at a point of a triangle with these corners and weights of them, and this outward normal; in linear light.
    pub(super) fn at(&self, corners: [usize; 3], weights: [f64; 3], normal: Vec3) -> [f32; 3] {
        match self {
            Colours::Scale(tint) => tint.colour(tint.number(corners, weights, normal)),
            Colours::Shares(shares) => shares.mixed(&shares.values, corners.into_iter().zip(weights)),
        }
    }

    /// The colour at a point of a section, in linear light.
    pub(super) fn inside(&self, section: &SectionColours, p: Vec3) -> [f32; 3] {
        let near = section.grid.weights(p);
        match self {
            Colours::Scale(tint) => {
                let value = |i: usize| section.values.get(i).copied().unwrap_or(f64::NAN);
                tint.colour(near.into_iter().map(|(i, weight)| weight * value(i)).sum())
            }
            Colours::Shares(shares) => shares.mixed(&section.values, near),
        }
    }

    /// Its rows in a legend.
    pub(super) fn legend<'a>(&'a self, paper: &Paper, rows: &mut Vec<LegendRow<'a>>) {
        match self {
            Colours::Scale(tint) => {
                rows.push(LegendRow::Scale(tint));
                rows.extend(legend::words(&tint.title));
            }
            Colours::Shares(shares) => {
                rows.extend(legend::names(shares.names.iter().map(String::as_str), &AREAS, paper));
                rows.extend(legend::words(&shares.title));
            }
        }
    }
}

impl Shares {
    /// The mixture of the shares `values` of some points, by their numbers and weights.
    fn mixed(&self, values: &[f64], of: impl IntoIterator<Item = (usize, f64)>) -> [f32; 3] {
        let n = self.names.len();
        let mut sum = [0.0; 3];
        for (at, weight) in of {
            let some = values.get(n * at..n * (at + 1)).unwrap_or_default();
            for (i, share) in some.iter().enumerate().filter(|(_, share)| share.is_finite()) {
                let light = palette::colour(&AREAS, i).map(decode);
                (0..3).for_each(|k| sum[k] += (weight * share) as f32 * light[k]);
            }
        }
        sum
    }
}
