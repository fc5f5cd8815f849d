//! Paper to draw and write on.

use super::font;

/// A colour as sRGB.
pub(super) type Colour = [u8; 3];
/// The colour of writing.
pub(super) const INK: Colour = [40, 40, 44];
/// Pixels of a dot of a letter.
const DOT: usize = 2;
/// Pixels of a letter's height, and from one letter to the next.
pub(super) const LETTER: usize = font::HIGH * DOT;
pub(super) const PITCH: usize = (font::WIDE + 1) * DOT;

/// RGB rows from the top.
pub(super) struct Paper {
    pub size: [usize; 2],
    pub rgb: Vec<u8>,
}

impl Paper {
    /// Fills a rectangle from one corner to another, clipped to the paper.
    pub fn fill(&mut self, [x0, y0]: [usize; 2], [x1, y1]: [usize; 2], colour: Colour) {
        let [w, h] = self.size;
        for y in y0..y1.min(h) {
            for x in x0..x1.min(w) {
                self.rgb[3 * (y * w + x)..][..3].copy_from_slice(&colour);
            }
        }
    }

    /// Writes a line; `anchor` is the share of its width that lies left of x.
    pub fn write(&mut self, text: &str, x: usize, y: usize, anchor: f64, colour: Colour) {
        let back = (text.chars().count() * PITCH) as f64 * anchor;
        let mut x = x.saturating_sub(back as usize);
        for letter in text.chars() {
            for (j, row) in font::rows(letter).into_iter().enumerate() {
                for i in (0..font::WIDE).filter(|i| row >> (font::WIDE - 1 - i) & 1 == 1) {
                    let from = [x + i * DOT, y + j * DOT];
                    self.fill(from, from.map(|c| c + DOT), colour);
                }
            }
            x += PITCH;
        }
    }
}

/// A number in few digits.
pub(super) fn short(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let digits = (2 - v.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
