//! The legend at the foot of a picture: rows of a scale, of names with their colours, of words.

use super::marks::SeenMarks;
use super::palette::{LINES, colour};
use super::paper::{Colour, INK, Paper};
use super::{RenderOptions, Tint, View};

/// A row of a legend.
pub(super) enum LegendRow<'a> {
    /// A scale with the numbers at its ends.
    Scale(&'a Tint),
    /// Names, each with a patch of its colour before it.
    Names(Vec<(&'a str, Colour)>),
    /// Words.
    Words(&'a str),
    /// A scale bar and axes.
    Marks(SeenMarks),
}

/// A row of a letter's height and the gap below it, in half letters.
const ROW: usize = 3;

/// The rows for a picture, from the top; none where it is too small for them.
pub(super) fn rows<'a>(options: &'a RenderOptions, view: &View, paper: &Paper) -> Vec<LegendRow<'a>> {
    let mut found = Vec::new();
    if paper.size[0] < 180 || paper.size[1] < 8 * paper.letter() {
        return found;
    }
    let wide = paper.size[0] as f64 / paper.letter() as f64;
    found.extend(SeenMarks::new(options.marks, view, wide).map(LegendRow::Marks));
    if let Some(colours) = &options.colours {
        colours.legend(paper, &mut found);
    }
    if let Some(lines) = &options.lines {
        found.extend(names(lines.names.iter().map(String::as_str), &LINES, paper));
        found.extend(words(&lines.caption));
    }
    if height(&found, paper) > paper.size[1] / 2 {
        found.clear();
    }
    found
}

/// Words, if there are some.
pub(super) fn words(text: &str) -> Option<LegendRow<'_>> {
    (!text.is_empty()).then_some(LegendRow::Words(text))
}

/// Names in as many rows as they need.
pub(super) fn names<'a>(names: impl Iterator<Item = &'a str>, palette: &[Colour], paper: &Paper) -> Vec<LegendRow<'a>> {
    let mut made: Vec<Vec<(&str, Colour)>> = Vec::new();
    for (i, name) in names.enumerate() {
        let entry = (name, colour(palette, i));
        match made.last_mut() {
            Some(row) if wide(row, paper) + entry_wide(name, paper) < paper.size[0] * 9 / 10 => row.push(entry),
            _ => made.push(vec![entry]),
        }
    }
    made.into_iter().map(LegendRow::Names).collect()
}

/// Pixels across of a name with its patch and the gap behind it.
fn entry_wide(name: &str, paper: &Paper) -> usize {
    paper.wide(name) + 5 * paper.letter() / 2
}

fn wide(row: &[(&str, Colour)], paper: &Paper) -> usize {
    row.iter().map(|(name, _)| entry_wide(name, paper)).sum()
}

/// Pixels of the foot of a picture that the rows take.
pub(super) fn height(rows: &[LegendRow], paper: &Paper) -> usize {
    if rows.is_empty() { 0 } else { (rows.iter().map(row_height).sum::<usize>() + 2) * paper.letter() / 2 }
}

/// Half letters of a row and the gap below it.
fn row_height(row: &LegendRow) -> usize {
    match row {
        LegendRow::Marks(marks) => (2.0 * marks.height()).ceil() as usize + ROW - 2,
        _ => ROW,
    }
}

/// Draws the rows; `per_mm` is how many pixels a mm is, where that is one number.
pub(super) fn draw(rows: &[LegendRow], paper: &mut Paper, per_mm: Option<f64>) {
    let letter = paper.letter();
    for (row, y) in places(rows, paper) {
        match row {
            LegendRow::Words(text) => paper.write(text, paper.size[0] / 2, y, 0.5, INK),
            LegendRow::Scale(tint) => tint.scale(paper, y),
            LegendRow::Marks(marks) => draw_marks(marks, paper, y, per_mm),
            LegendRow::Names(entries) => {
                for (name, colour, x) in along(entries, paper) {
                    paper.fill([x, y], [x + letter, y + letter], colour);
                    paper.write(name, x + 3 * letter / 2, y, 0.0, INK);
                }
            }
        }
    }
}

/// The rows, and where each begins: pixels from the top.
pub(super) fn places<'a, 'b>(rows: &'b [LegendRow<'a>], paper: &Paper) -> Vec<(&'b LegendRow<'a>, usize)> {
    let letter = paper.letter();
    let mut y = paper.size[1].saturating_sub(height(rows, paper)) + letter / 2;
    let mut place = |row: &LegendRow| {
        let at = y;
        y += row_height(row) * letter / 2;
        at
    };
    rows.iter().map(|row| (row, place(row))).collect()
}

/// The names of a row with their colours, and where each begins: pixels from the left.
pub(super) fn along<'a>(entries: &[(&'a str, Colour)], paper: &Paper) -> Vec<(&'a str, Colour, usize)> {
    let mut x = (paper.size[0] + paper.letter()).saturating_sub(wide(entries, paper)) / 2;
    let mut place = |name: &str| {
        let at = x;
        x += entry_wide(name, paper);
        at
    };
    entries.iter().map(|(name, colour)| (*name, *colour, place(name))).collect()
}

fn draw_marks(marks: &SeenMarks, paper: &mut Paper, top: usize, per_mm: Option<f64>) {
    let letter = paper.letter() as f64;
    let place = |[x, y]: [f64; 2]| [x * letter, top as f64 + y * letter];
    let drawn = marks.drawn(paper.size[0] as f64 / letter, per_mm.map(|p| p / letter));
    for (from, to, colour) in &drawn.arms {
        paper.stroke(place(*from), place(*to), drawn.thin * letter, *colour);
    }
    if let Some([low, high]) = drawn.bar {
        paper.rectangle(place(low), place(high), INK);
    }
    for (words, at, anchor, colour) in &drawn.words {
        let [x, y] = place(*at).map(|c| c.round().max(0.0) as usize);
        paper.write(words, x, y, *anchor, *colour);
    }
}

#[cfg(test)]
mod tests {
    use super::super::palette::AREAS;
    use super::*;

    #[test]
    fn colours_differ_however_many_there_are() {
        for of in [AREAS, LINES] {
            let all: Vec<Colour> = (0..4 * of.len()).map(|i| colour(&of, i)).collect();
            assert_eq!(all[..of.len()], of);
            let same = all.iter().enumerate().find(|(i, c)| all[..*i].contains(c));
            assert!(same.is_none(), "{same:?}");
        }
    }

    /// Names wrap within the paper, each with its patch.
    #[test]
    fn names_stay_on_the_paper() {
        let mut paper = Paper::blank([400, 300]);
        let many: Vec<String> = (0..9).map(|i| format!("lattice number {i}")).collect();
        let rows = names(many.iter().map(String::as_str), &AREAS, &paper);
        assert!(rows.len() > 2);
        draw(&rows, &mut paper, None);
        for i in 0..many.len() {
            let patch = paper.bytes.chunks(3).filter(|p| *p == colour(&AREAS, i)).count();
            assert_eq!(patch, paper.letter().pow(2), "{i}");
        }
        let border = (0..300).flat_map(|y| [3 * 400 * y, 3 * (400 * y + 399)]);
        assert!(border.into_iter().all(|at| paper.bytes[at..at + 3] == [255; 3]));
    }
}
