//! A number on the surface as its colour, and the scale that tells which is which.

use super::encode;
use super::paper::{INK, Paper, short};

/// A number at each vertex, to be seen as a colour.
#[derive(Clone, Debug)]
pub struct Tint {
    /// What it is.
    pub title: String,
    /// The number at each vertex; grey where it is not finite.
    pub values: Vec<f64>,
    /// The numbers at the ends of the scale; those beyond have the colour of the end.
    pub span: [f64; 2],
}

/// Stops of the scale in sRGB, evenly spaced: dark blue over green to yellow, of even steps in lightness.
const STOPS: [[u8; 3]; 6] =
    [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];

impl Tint {
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

    /// Draws the scale at a height, the numbers to either side.
    pub(super) fn scale(&self, paper: &mut Paper, y: usize) {
        let (w, letter) = (paper.size[0], paper.letter());
        let (wide, left) = (2 * w / 5, 3 * w / 10);
        for x in 0..wide {
            let share = (x as f64 + 0.5) / wide as f64;
            let value = self.span[0] + share * (self.span[1] - self.span[0]);
            let colour = self.colour(value).map(encode);
            paper.fill([left + x, y], [left + x + 1, y + letter], colour);
        }
        paper.write(&short(self.span[0]), left - letter / 2, y, 1.0, INK);
        paper.write(&short(self.span[1]), left + wide + letter / 2, y, 0.0, INK);
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
        let tint = Tint { title: String::new(), values: Vec::new(), span: [-1.0, 3.0] };
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
