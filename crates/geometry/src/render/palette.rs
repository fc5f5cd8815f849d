//! Colours of areas and lines by number.

use super::paper::Colour;

/// Colours of areas and of lines by number, in sRGB: those of Okabe and Ito (2008), which all eyes tell apart. Complementary ones come first
/// for areas, whose mixtures then are grey; red, green and blue for lines.
pub(super) const AREAS: [Colour; 7] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66]];
pub(super) const LINES: [Colour; 7] =
    [[213, 40, 0], [0, 158, 115], [0, 90, 190], [230, 159, 0], [170, 60, 150], [86, 180, 233], [90, 60, 40]];

/// The colour of a number; those beyond the last come again, lighter each time.
pub(super) fn colour(of: &[Colour], i: usize) -> Colour {
    let fade = 1.0 - 0.6f64.powi((i / of.len()) as i32);
    of[i % of.len()].map(|c| (f64::from(c) + fade * (255.0 - f64::from(c))) as u8)
}
