//! What tells size and direction: a scale bar and the axes, side by side at the foot of a picture.

use super::palette::LINES;
use super::paper::{Colour, INK};
use super::{Projection, View};

/// Which marks a picture has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    /// A bar of a round length, which it says; of parallel rays only, where it is true in any depth.
    pub scale_bar: bool,
    /// The directions of x, y and z.
    pub axes: bool,
}

/// The length of an arm that lies across the view, and the room about it for its letter; lengths here are in heights of a letter.
const ARM: f64 = 2.2;
const ROOM: f64 = 1.25;
/// From one mark to the next, and from the bar to its words.
const GAP: f64 = 1.5;
const NEAR: f64 = 0.6;
/// The longest bar, of the width of the picture; the least width for marks.
const LONGEST: f64 = 0.3;
const NARROW: f64 = 20.0;
/// Half the width of arms and of the bar.
const THIN: f64 = 0.09;
const THICK: f64 = 0.17;

/// Marks as lines and words: places to the right and down from the top left of their row, lengths in heights of a letter.
#[derive(Debug, Default)]
pub(super) struct MarkShapes {
    /// From, to, colour.
    pub arms: Vec<([f64; 2], [f64; 2], Colour)>,
    /// Half the width of arms.
    pub thin: f64,
    /// The corners of the bar.
    pub bar: Option<[[f64; 2]; 2]>,
    /// Words, the place of their top, the share of their width that lies left of it, their colour.
    pub words: Vec<(String, [f64; 2], f64, Colour)>,
}

/// Marks of a view.
pub(super) struct SeenMarks {
    bar: bool,
    /// The ends of the arms: right and up.
    arms: Option<[[f64; 2]; 3]>,
}

impl SeenMarks {
    /// None where there are none to draw, or no room for them in a picture of this width.
    pub fn new(marks: Marks, view: &View, width: f64) -> Option<SeenMarks> {
        let [right, up, _] = view.axes();
        let bar = marks.scale_bar && view.projection == Projection::Orthographic;
        let arms = marks.axes.then(|| [0, 1, 2].map(|k| [ARM * right[k], ARM * up[k]]));
        (width >= NARROW && (bar || marks.axes)).then_some(SeenMarks { bar, arms })
    }

    /// How far arms and their letters reach: along `axis`, the least and the greatest.
    fn reach(&self, axis: usize) -> [f64; 2] {
        let ends = self.arms.iter().flatten().map(|end| end[axis]);
        ends.fold([0.0; 2], |[low, high], v| [f64::min(low, v - ROOM), f64::max(high, v + ROOM)])
    }

    /// The height of the row.
    pub fn height(&self) -> f64 {
        let [low, high] = self.reach(1);
        (high - low).max(1.0)
    }

    /// In a row of this width, with a bar if it is known how long a mm is.
    pub fn drawn(&self, width: f64, per_mm: Option<f64>) -> MarkShapes {
        let (height, [left, right]) = (self.height(), self.reach(0));
        let mut made = MarkShapes { thin: THIN, ..MarkShapes::default() };
        let origin = [GAP - left, self.reach(1)[1]];
        for (k, end) in self.arms.iter().flatten().enumerate() {
            let to = [origin[0] + end[0], origin[1] - end[1]];
            made.arms.push((origin, to, LINES[k]));
            // The letter stands off the end of its arm, or to its left where the arm is seen from its end.
            let long = end[0].hypot(end[1]);
            let off = if long > 0.2 * ARM { end.map(|c| c / long * 0.75) } else { [-0.65, -0.65] };
            let at = [to[0] + off[0], to[1] - off[1] - 0.5];
            made.words.push((["x", "y", "z"][k].into(), at, 0.5, LINES[k]));
        }
        if let Some(per_mm) = per_mm.filter(|p| self.bar && p.is_finite() && *p > 0.0) {
            let length = round_length(LONGEST * width / per_mm);
            let (long, text) = (length * per_mm, format!("{length} mm"));
            // Letters are about as wide as high.
            let centred = (width - long - NEAR - text.len() as f64) / 2.0;
            let from = if self.arms.is_some() { centred.max(2.0 * GAP + right - left) } else { centred };
            made.bar = Some([[from, height / 2.0 - THICK], [from + long, height / 2.0 + THICK]]);
            made.words.push((text, [from + long + NEAR, height / 2.0 - 0.5], 0.0, INK));
        }
        made
    }
}

/// The greatest of 1, 2 and 5 times a power of ten that is not above a length (mm).
fn round_length(most: f64) -> f64 {
    let power = most.log10().floor() as i32;
    // Read from its digits, so that it prints as few.
    let lengths = [(1, power), (2, power), (5, power), (1, power + 1)].map(|(digit, power)| {
        let digits = format!("{digit}e{power}");
        digits.parse().unwrap_or(f64::NAN)
    });
    lengths.into_iter().filter(|v| *v <= most).fold(lengths[0], f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The bar is as long as it says, at most as long as there is room for, and at least two fifths of that; marks stay in their row.
        #[test]
        fn a_bar_is_as_long_as_it_says(
            width in NARROW..200.0f64, power in -6.0..6.0f64, azimuth in -180.0..180.0f64, elevation in -90.0..90.0f64,
        ) {
            let per_mm = 10f64.powf(power);
            let view = View { size: [1, 1], azimuth, elevation, projection: Projection::Orthographic };
            let seen = SeenMarks::new(Marks { scale_bar: true, axes: true }, &view, width).expect("room");
            let drawn = seen.drawn(width, Some(per_mm));
            let [from, to] = drawn.bar.expect("a bar");
            let text = &drawn.words.last().expect("words").0;
            let said: f64 = text.trim_end_matches(" mm").parse().expect("mm");
            prop_assert!(((to[0] - from[0]) / per_mm / said - 1.0).abs() < 1e-9, "{text}");
            prop_assert!((0.4..1.0 + 1e-9).contains(&((to[0] - from[0]) / (LONGEST * width))), "{text}");
            let digits = text.trim_end_matches(" mm").trim_matches(|c| c == '0' || c == '.');
            prop_assert!(["1", "2", "5"].contains(&digits), "{text}");
            for (_, [x, y], _, _) in &drawn.words {
                prop_assert!(*x > 0.0 && *y >= -1e-9 && y + 1.0 <= seen.height() + 1e-9, "{y} {}", seen.height());
            }
            // The arms clear the bar.
            let clear = drawn.arms.iter().map(|(a, b, _)| a[0].max(b[0])).fold(0.0, f64::max);
            prop_assert!(clear < from[0]);
            for k in 0..3 {
                let (a, b, _) = drawn.arms[k];
                let (long, sine) = ((b[0] - a[0]).hypot(b[1] - a[1]) / ARM, view.axes()[2][k]);
                prop_assert!((long * long + sine * sine - 1.0).abs() < 1e-9, "an arm is a unit vector that is seen from the eye");
            }
        }
    }

    #[test]
    fn there_is_no_bar_by_a_lens_and_nothing_without_room() {
        let view = View { size: [1, 1], azimuth: 30.0, elevation: 20.0, projection: Projection::Perspective };
        let all = Marks { scale_bar: true, axes: true };
        assert!(SeenMarks::new(Marks { axes: false, ..all }, &view, 50.0).is_none());
        assert!(SeenMarks::new(all, &view, 50.0).is_some_and(|m| m.drawn(50.0, Some(1.0)).bar.is_none()));
        assert!(SeenMarks::new(all, &view, NARROW - 1.0).is_none());
        assert_eq!([0.99, 1.0, 4.9, 5e-4, 23.0, 7e3].map(round_length), [0.5, 1.0, 2.0, 5e-4, 20.0, 5e3]);
    }
}
