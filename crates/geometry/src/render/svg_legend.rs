//! The legend of a line drawing, as elements of its SVG file: what `legend` draws on paper.

use std::fmt::Write;

use super::encode;
use super::legend::{self, LegendRow};
use super::marks::SeenMarks;
use super::paper::{Colour, INK, Paper, short};
use super::svg_path::path;
use super::tint::Tint;

/// The height of a capital, of the size of its font.
const CAPITAL: f64 = 0.72;
/// Stops of a scale: colours between two are even to a step of a byte.
const STOPS: usize = 33;

/// Where elements are put: places on the paper of a legend times `part`.
struct Place<'a> {
    paper: &'a Paper,
    part: f64,
    digits: usize,
    out: String,
}

/// The elements of rows at the foot of a sheet of paper, `part` units of the drawing for each of its pixels; `per_mm` of these are a mm.
pub(super) fn text(rows: &[LegendRow], paper: &Paper, part: f64, per_mm: Option<f64>) -> String {
    let letter = paper.letter();
    let digits = (2.0 - (letter as f64 * part).log10()).ceil().clamp(0.0, 9.0) as usize;
    let mut at = Place { paper, part, digits, out: String::new() };
    for (row, y) in legend::places(rows, paper) {
        let y = y as f64;
        match row {
            LegendRow::Words(words) => at.words(words, [paper.size[0] as f64 / 2.0, y], "middle", INK),
            LegendRow::Scale(tint) => at.scale(tint, y),
            LegendRow::Marks(marks) => at.marks(marks, y, per_mm),
            LegendRow::Names(entries) => {
                for (name, colour, x) in legend::along(entries, paper) {
                    let (x, side) = (x as f64, letter as f64);
                    at.rectangle([x, y], [x + side, y + side], &hex(colour), "");
                    at.words(name, [x + 1.5 * side, y], "start", INK);
                }
            }
        }
    }
    at.out
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl Place<'_> {
    /// A line of writing, the top of whose capitals is at y.
    fn words(&mut self, words: &str, [x, y]: [f64; 2], anchor: &str, colour: Colour) {
        let (digits, letter) = (self.digits, self.paper.letter() as f64 * self.part);
        let words = words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        let _ = writeln!(
            self.out,
            "<text x=\"{:.digits$}\" y=\"{:.digits$}\" font-family=\"sans-serif\" font-size=\"{:.digits$}\" text-anchor=\"{anchor}\" \
             fill=\"{}\" stroke=\"none\">{words}</text>",
            x * self.part,
            y * self.part + letter,
            letter / CAPITAL,
            hex(colour)
        );
    }

    fn rectangle(&mut self, low: [f64; 2], high: [f64; 2], fill: &str, name: &str) {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]], low].map(|p| p.map(|c| c * self.part));
        let line = path(&[corners.to_vec()], self.digits);
        let _ = writeln!(self.out, "<path{name} fill=\"{fill}\" stroke=\"none\" d=\"{line}\"/>");
    }

    fn scale(&mut self, tint: &Tint, y: f64) {
        let letter = self.paper.letter() as f64;
        let [left, right] = Tint::ends(self.paper).map(|x| x as f64);
        self.out.push_str("<linearGradient id=\"colours\">\n");
        for i in 0..STOPS {
            let share = i as f64 / (STOPS - 1) as f64;
            let colour = tint.colour(tint.span[0] + share * (tint.span[1] - tint.span[0])).map(encode);
            let _ = writeln!(self.out, "<stop offset=\"{share}\" stop-color=\"{}\"/>", hex(colour));
        }
        self.out.push_str("</linearGradient>\n");
        self.rectangle([left, y], [right, y + letter], "url(#colours)", " id=\"scale\"");
        self.words(&short(tint.span[0]), [left - letter / 2.0, y], "end", INK);
        self.words(&short(tint.span[1]), [right + letter / 2.0, y], "start", INK);
    }

    fn marks(&mut self, marks: &SeenMarks, top: f64, per_mm: Option<f64>) {
        let letter = self.paper.letter() as f64;
        let drawn = marks.drawn(self.paper.size[0] as f64 / letter, per_mm.map(|p| p / letter));
        let place = |[x, y]: [f64; 2]| [x * letter, top + y * letter];
        let (digits, width) = (self.digits, 2.0 * drawn.thin * letter * self.part);
        for (from, to, colour) in &drawn.arms {
            let ends = [*from, *to].map(|p| place(p).map(|c| c * self.part));
            let (line, colour) = (path(&[ends.to_vec()], digits), hex(*colour));
            let _ = writeln!(
                self.out,
                "<path class=\"axis\" stroke=\"{colour}\" stroke-width=\"{width:.digits$}\" d=\"{line}\"/>"
            );
        }
        if let Some([low, high]) = drawn.bar {
            self.rectangle(place(low), place(high), "#000", " id=\"scale_bar\"");
        }
        for (words, at, anchor, colour) in &drawn.words {
            self.words(words, place(*at), if *anchor > 0.0 { "middle" } else { "start" }, *colour);
        }
    }
}
