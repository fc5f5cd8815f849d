//! Histograms as pictures.

use super::paper::{Colour, INK, LETTER, PITCH, Paper, short};

/// One histogram.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is on the axis, in small letters.
    pub title: String,
    /// Ends of the bars, ascending.
    pub edges: Vec<f64>,
    /// The share of the whole in each bar.
    pub share: Vec<f64>,
    /// What each share is held against, drawn as a line across its bar; nothing if there is none.
    pub wanted: Vec<f64>,
    /// Places on the axis that are marked, with their names.
    pub marks: Vec<(String, f64)>,
}

const PAPER: Colour = [255, 255, 255];
const FAINT: Colour = [222, 224, 228];
const BAR: Colour = [196, 129, 74];
const MARK: Colour = [36, 84, 140];
const MARGIN: [usize; 2] = [90, 70];
/// Pixels of the room for the names of marks above a chart.
const HEAD: usize = 70;

/// Draws histograms one above the other; RGB rows from the top. Nothing that is not finite is drawn.
pub fn charts(charts: &[Chart], size: [usize; 2]) -> Vec<u8> {
    let [w, h] = size;
    if w == 0 || h == 0 || w.saturating_mul(h) > super::LARGEST {
        return Vec::new();
    }
    let mut paper = Paper { size, rgb: PAPER.repeat(w * h) };
    let each = h / charts.len().max(1);
    for (i, chart) in charts.iter().enumerate() {
        paper.chart(chart, i * each, each);
    }
    paper.rgb
}

impl Paper {
    fn chart(&mut self, chart: &Chart, top: usize, height: usize) {
        let [left, below] = MARGIN;
        let width = self.size[0].saturating_sub(left + 40);
        let room = height.saturating_sub(HEAD + below);
        let end = chart.edges.last().copied().unwrap_or(0.0);
        let most = chart.share.iter().chain(&chart.wanted).copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        if width < 50 || room < 50 || !(end.is_finite() && end > 0.0 && most > 0.0) {
            return;
        }
        let base = top + HEAD + room;
        let across = |v: f64| left + (width as f64 * (v / end).clamp(0.0, 1.0)).round() as usize;
        let step = nice(100.0 * most / 4.0);
        let full = (100.0 * most / step).ceil() * step;
        let up = |percent: f64| base - (room as f64 * (percent / full).clamp(0.0, 1.0)).round() as usize;
        let mut percent = 0.0;
        while percent <= full * (1.0 + 1e-9) {
            let y = up(percent);
            self.fill([left, y], [left + width, y + 1], FAINT);
            let label = format!("{} %", short(percent));
            self.write(&label, left - 8, y.saturating_sub(LETTER / 2), 1.0, INK);
            percent += step;
        }
        for (ends, share) in chart.edges.windows(2).zip(&chart.share) {
            let (x0, x1) = (across(ends[0]) + 1, across(ends[1]));
            self.fill([x0, up(100.0 * share)], [x1.max(x0 + 1), base], BAR);
        }
        let wanted = chart.edges.windows(2).zip(&chart.wanted);
        for (ends, share) in wanted.filter(|(_, s)| s.is_finite() && **s > 0.0) {
            let (x0, x1, y) = (across(ends[0]) + 1, across(ends[1]), up(100.0 * share));
            self.fill([x0, y.saturating_sub(2)], [x1.max(x0 + 1), y + 2], MARK);
        }
        self.fill([left, base], [left + width, base + 2], INK);
        let step = nice(end / 8.0);
        let mut tick = 0.0;
        while tick <= end * (1.0 + 1e-9) {
            let x = across(tick);
            self.fill([x, base], [x + 2, base + 8], INK);
            self.write(&short(tick), x, base + 12, 0.5, INK);
            tick += step;
        }
        self.write(&chart.title, left + width / 2, base + 12 + 2 * LETTER, 0.5, INK);
        // Names on lines of their own, so that neighbours do not meet.
        let mut names = Vec::new();
        let marks = chart.marks.iter().filter(|m| m.1.is_finite());
        for (k, (name, at)) in marks.enumerate() {
            let (x, y) = (across(*at), top + 8 + k * (LETTER + 4));
            self.fill([x, y + LETTER / 2], [x + 2, base], MARK);
            let text = format!("{name} {}", short(*at));
            let wide = text.chars().count() * PITCH;
            let from = if x + 8 + wide < self.size[0] { x + 8 } else { x.saturating_sub(wide + 4) };
            names.push((text, from, y, wide));
        }
        for (text, x, y, wide) in names {
            self.fill([x, y], [x + wide, y + LETTER], PAPER);
            self.write(&text, x, y, 0.0, MARK);
        }
    }
}

/// The next of 1, 2, 5, 10 … with any power of ten.
fn nice(v: f64) -> f64 {
    let unit = 10f64.powf(v.log10().floor());
    let of = [1.0, 2.0, 5.0].into_iter().find(|k| k * unit >= v * (1.0 - 1e-9));
    of.unwrap_or(10.0) * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(share: Vec<f64>) -> Chart {
        Chart {
            title: "wall thickness, mm".into(),
            edges: (0..=share.len()).map(|i| i as f64 * 0.1).collect(),
            share,
            wanted: Vec::new(),
            marks: vec![("mean".into(), 0.15)],
        }
    }

    fn count(rgb: &[u8], colour: Colour) -> usize {
        rgb.chunks_exact(3).filter(|p| **p == colour).count()
    }

    #[test]
    fn bars_are_as_high_as_their_shares() {
        let size = [640, 400];
        let one = charts(&[chart(vec![0.0, 0.5, 0.5, 0.0])], size);
        let two = charts(&[chart(vec![0.0, 0.5, 0.25, 0.25])], size);
        assert_eq!(one.len(), 3 * 640 * 400);
        // Equal areas but for the rounding of a bar's height and the line of the mark.
        let (a, b) = (count(&one, BAR) as f64, count(&two, BAR) as f64);
        assert!(a > 10_000.0 && (a / b - 1.0).abs() < 0.01, "{a} {b}");
        assert!(count(&one, INK) > 200 && count(&one, MARK) > 200);
        let mut held = chart(vec![0.0, 0.5, 0.5, 0.0]);
        held.wanted = vec![0.0, 0.25, 0.25, f64::NAN];
        // Two lines of four pixels across bars that are hundreds wide.
        assert!(count(&charts(&[held], size), MARK) > count(&one, MARK) + 800);
    }

    #[test]
    fn odd_input_is_no_panic() {
        assert!(charts(&[], [0, 0]).is_empty());
        for share in [vec![], vec![0.0], vec![f64::NAN, f64::INFINITY], vec![1e-30]] {
            let mut odd = chart(share);
            odd.marks.push(("far".into(), f64::INFINITY));
            odd.marks.push(("far".into(), 1e300));
            for size in [[1, 1], [100, 5], [300, 300]] {
                assert_eq!(charts(std::slice::from_ref(&odd), size).len(), 3 * size[0] * size[1]);
            }
        }
    }

    #[test]
    fn numbers_are_short() {
        for (v, text) in [(0.0, "0"), (0.1, "0.1"), (12.5, "12.5"), (1234.0, "1234"), (0.30000000000000004, "0.3")] {
            assert_eq!(short(v), text);
        }
        assert_eq!([0.9, 1.0, 1.3, 2.2, 6.0].map(nice), [1.0, 1.0, 2.0, 5.0, 10.0]);
    }
}
