//! Shares of named parts on a surface, as mixtures of their colours.

use super::legend::{self, AREAS, Row};
use super::paper::Paper;
use super::tint::{Tint, decode};

/// The colours of a surface.
#[derive(Clone, Debug)]
pub enum Colours {
    /// A number at each vertex.
    Scale(Tint),
    /// Shares at each vertex.
    Shares(Shares),
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
    /// The colour at a point of a triangle with these corners and weights of them, in linear light.
    pub(super) fn at(&self, corners: [usize; 3], weights: [f64; 3]) -> [f32; 3] {
        match self {
            Colours::Scale(tint) => {
                let value = |i: usize| tint.values.get(i).copied().unwrap_or(f64::NAN);
                tint.colour((0..3).map(|i| weights[i] * value(corners[i])).sum())
            }
            Colours::Shares(shares) => {
                let n = shares.names.len();
                let mut sum = [0.0; 3];
                for (corner, weight) in corners.into_iter().zip(weights) {
                    let of = shares.values.get(n * corner..n * (corner + 1)).unwrap_or_default();
                    for (i, share) in of.iter().enumerate().filter(|(_, share)| share.is_finite()) {
                        let light = legend::colour(&AREAS, i).map(decode);
                        (0..3).for_each(|k| sum[k] += (weight * share) as f32 * light[k]);
                    }
                }
                sum
            }
        }
    }

    /// Its rows in a legend.
    pub(super) fn legend<'a>(&'a self, paper: &Paper, rows: &mut Vec<Row<'a>>) {
        match self {
            Colours::Scale(tint) => {
                rows.push(Row::Scale(tint));
                rows.extend(legend::words(&tint.title));
            }
            Colours::Shares(shares) => {
                rows.extend(legend::names(shares.names.iter().map(String::as_str), &AREAS, paper));
                rows.extend(legend::words(&shares.title));
            }
        }
    }
}
