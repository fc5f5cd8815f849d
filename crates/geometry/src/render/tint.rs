//! A number on the surface as its colour, and the scale that tells which is which.

use super::encode;
use super::paper::{INK, Paper, short};
use crate::math::{Vec3, dot};

/// A number on the surface, to be seen as a colour.
#[derive(Clone, Debug)]
pub struct Tint {
    /// What it is, with its unit.
    pub title: String,
    /// The number; grey where it is not finite.
    pub amount: Amount,
    /// The numbers at the ends of the scale; those beyond have the colour of the end.
    pub span: [f64; 2],
}

/// A number on the surface.
#[derive(Clone, Debug)]
pub enum Amount {
    /// One at each vertex.
    AtVertices(Vec<f64>),
    /// The overhang for layers that are stacked along this unit vector: the angle between layer and surface (degrees) where the surface
    /// faces down, none elsewhere, nor beyond the end of the scale.
    Overhang(Vec3),
}

/// Stops of the scale in sRGB, evenly spaced: dark blue over green to yellow, of even steps in lightness.
const STOPS: [[u8; 3]; 6] =
    [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];

impl Tint {
    /// The number at a point of a surface: by numbers of vertices and their weights, and the outward unit normal.
    pub(super) fn number(&self, corners: [usize; 3], weights: [f64; 3], normal: Vec3) -> f64 {
        match &self.amount {
            Amount::AtVertices(values) => {
                let value = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
                (0..3).map(|i| weights[i] * value(corners[i])).sum()
            }
            Amount::Overhang(up) => {
                let angle = (-dot(normal, *up)).clamp(-1.0, 1.0).acos().to_degrees();
                // A wall that is upright to rounding is none.
                if angle < self.span[1].min(90.0) - 1e-3 { angle } else { f64::NAN }
            }
        }
    }

    /// The colour of a number, in linear light.
    pub(super) fn colour(&self, value: f64) -> [f32; 3] {
        let [low, high] = self.span;
        let t = (value - low) / (high - low);
        if !t.is_finite() {
            return [0.4; 3];
        }
        let x = t.clamp(0.0, 1.0) as f32 * (STOPS.len() - 1) as f32;
        let i = (x as usize).min(STOPS.len() - 2);
        let part = x - i as f32;
        core::array::from_fn(|k| {
            let light = |stop: [u8; 3]| decode(stop[k]);
            light(STOPS[i]) * (1.0 - part) + light(STOPS[i + 1]) * part
        })
    }

    /// From where to where a scale runs on paper.
    pub(super) fn ends(paper: &Paper) -> [usize; 2] {
        let (wide, left) = (2 * paper.size[0] / 5, 3 * paper.size[0] / 10);
        [left, left + wide]
    }

    /// Draws the scale at a height, the numbers to either side.
    pub(super) fn scale(&self, paper: &mut Paper, y: usize) {
        let (letter, [left, right]) = (paper.letter(), Tint::ends(paper));
        for x in left..right {
            let share = ((x - left) as f64 + 0.5) / (right - left) as f64;
            let value = self.span[0] + share * (self.span[1] - self.span[0]);
            let colour = self.colour(value).map(encode);
            paper.fill([x, y], [x + 1, y + letter], colour);
        }
        paper.write(&short(self.span[0]), left - letter / 2, y, 1.0, INK);
        paper.write(&short(self.span[1]), right + letter / 2, y, 0.0, INK);
    }
}

/// An sRGB byte as linear light.
pub(super) fn decode(v: u8) -> f32 {
    let s = f32::from(v) / 255.0;
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_scale_are_its_stops() {
        let tint = Tint { title: String::new(), amount: Amount::AtVertices(Vec::new()), span: [-1.0, 3.0] };
        let bytes = |v: f64| tint.colour(v).map(encode);
        assert_eq!(bytes(-1.0), STOPS[0]);
        assert_eq!(bytes(-1e9), STOPS[0]);
        assert_eq!(bytes(3.0), STOPS[5]);
        assert_eq!(bytes(f64::NAN), [170; 3]);
        // Lighter all the way, so that it reads without colour.
        let light = |v: f64| tint.colour(v).into_iter().zip([0.2126, 0.7152, 0.0722]);
        let light = |v: f64| light(v).map(|(c, w)| c * w).sum::<f32>();
        for i in 0..40 {
            let v = -1.0 + f64::from(i) * 0.1;
            assert!(light(v + 0.1) > light(v), "{v}");
        }
    }
}
