//! Paper to draw and write on.

use super::font;

/// A colour as sRGB.
pub(super) type Colour = [u8; 3];
/// The colour of writing.
pub(super) const INK: Colour = [40, 40, 44];

/// Dots between letters.
const GAP: usize = 1;

/// Rows from the top, of RGB or RGBA.
pub(super) struct Paper {
    pub size: [usize; 2],
    /// Bytes of a pixel, 3 or 4.
    pub channels: usize,
    pub bytes: Vec<u8>,
}

impl Paper {
    /// Pixels of a dot of a letter: writing grows with the paper.
    fn dot(&self) -> usize {
        (self.size[0].min(self.size[1]) / 300).max(2)
    }

    /// Pixels of a letter's height, above the line that it stands on.
    pub fn letter(&self) -> usize {
        font::HIGH * self.dot()
    }

    /// Pixels across of a line of writing.
    pub fn wide(&self, text: &str) -> usize {
        text.chars().map(font::columns).map(|[first, end]| end - first + GAP).sum::<usize>() * self.dot()
    }

    /// Fills a rectangle from one corner to another, clipped to the paper.
    pub fn fill(&mut self, [x0, y0]: [usize; 2], [x1, y1]: [usize; 2], colour: Colour) {
        for y in y0..y1 {
            for x in x0..x1 {
                self.blend([x, y], colour, 1.0);
            }
        }
    }

    /// Writes a line; `anchor` is the share of its width that lies left of x.
    pub fn write(&mut self, text: &str, x: usize, y: usize, anchor: f64, colour: Colour) {
        let dot = self.dot();
        let mut x = x.saturating_sub((self.wide(text) as f64 * anchor) as usize);
        for letter in text.chars() {
            let (strokes, [first, end]) = (font::strokes(letter), font::columns(letter));
            for j in (0..font::DEEP * dot).filter(|_| !strokes.is_empty()) {
                for i in 0..(end - first) * dot {
                    let at = [first * dot + i, j].map(|c| (c as f32 + 0.5) / dot as f32);
                    let off = strokes.iter().fold(f32::INFINITY, |m, s| m.min(font::distance(at, s)));
                    // Strokes are a dot wide, with edges of a pixel.
                    self.blend([x + i, y + j], colour, (0.5 - off) * dot as f32 + 0.5);
                }
            }
            x += (end - first + GAP) * dot;
        }
    }

    /// Fills a rectangle with corners between pixels, each pixel by the share of it that is covered.
    pub fn rectangle(&mut self, low: [f64; 2], high: [f64; 2], colour: Colour) {
        let share = |k: usize, at: usize| (high[k].min(at as f64 + 1.0) - low[k].max(at as f64)).clamp(0.0, 1.0);
        for y in low[1].max(0.0) as usize..high[1].max(0.0).ceil() as usize {
            for x in low[0].max(0.0) as usize..high[0].max(0.0).ceil() as usize {
                self.blend([x, y], colour, (share(0, x) * share(1, y)) as f32);
            }
        }
    }

    /// Draws a straight line with round ends, `half` its width.
    pub fn stroke(&mut self, from: [f64; 2], to: [f64; 2], half: f64, colour: Colour) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let span = |k: usize| {
            let (low, high) = (from[k].min(to[k]) - half - 1.0, from[k].max(to[k]) + half + 1.0);
            low.max(0.0) as usize..high.max(0.0).ceil() as usize
        };
        for y in span(1) {
            for x in span(0) {
                let d = [x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]];
                let s = if square > 0.0 { ((d[0] * along[0] + d[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                let off = (d[0] - s * along[0]).hypot(d[1] - s * along[1]);
                self.blend([x, y], colour, (half - off + 0.5) as f32);
            }
        }
    }

    /// Mixes a colour into a pixel, by the share of it that is covered.
    fn blend(&mut self, [x, y]: [usize; 2], colour: Colour, cover: f32) {
        let [w, h] = self.size;
        if x < w && y < h && cover > 0.0 {
            let n = self.channels;
            let pixel = &mut self.bytes[n * (y * w + x)..][..n];
            let cover = cover.min(1.0);
            // The share of what there was in what is seen then.
            let under = pixel.get(3).map_or(1.0, |a| f32::from(*a) / 255.0);
            let all = cover + (1.0 - cover) * under;
            for (p, c) in pixel.iter_mut().zip(colour) {
                *p = (f32::from(*p) + cover / all * (f32::from(c) - f32::from(*p))).round() as u8;
            }
            if let Some(alpha) = pixel.get_mut(3) {
                *alpha = (255.0 * all).round() as u8;
            }
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

#[cfg(test)]
impl Paper {
    pub fn blank(size: [usize; 2]) -> Paper {
        Paper { size, channels: 3, bytes: vec![255; 3 * size[0] * size[1]] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Letters keep to their width, differ from each other, and grow with the paper.
    #[test]
    fn letters_are_seen_and_differ() {
        let letters: Vec<char> = ('0'..='9').chain('a'..='z').chain('A'..='Z').chain("._-%,:()/+=°'".chars()).collect();
        for size in [[60, 60], [900, 1200]] {
            let drawn = |letter: char| {
                let mut paper = Paper::blank(size);
                paper.write(&letter.to_string(), 20, 20, 0.0, INK);
                let dark = |i: usize| paper.bytes[3 * i] < 250;
                let [right, below] = [20 + paper.wide(&letter.to_string()), 20 + font::DEEP * paper.dot()];
                assert!(
                    (0..size[0] * size[1])
                        .filter(|i| dark(*i))
                        .all(|i| { (20..right).contains(&(i % size[0])) && (20..below).contains(&(i / size[0])) })
                );
                assert!((0..size[0] * size[1]).any(|i| paper.bytes[3 * i] == INK[0]), "{letter}");
                paper.bytes
            };
            let all: Vec<Vec<u8>> = letters.iter().map(|l| drawn(*l)).collect();
            for (i, one) in all.iter().enumerate() {
                assert!(!all[..i].contains(one), "{}", letters[i]);
            }
        }
    }
}
