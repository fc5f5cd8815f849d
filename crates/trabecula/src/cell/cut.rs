//! The cut of a function f at a level t by a part: sheet |f| − t, lower f − t, upper t − f, negative in the solid.

use std::sync::Arc;

use super::Part;
use crate::implicit::Implicit;
use geometry::math::{Interval, Vec3, add, scale};

/// A part, or one side of a sheet alone: the sheet |f| − t is the greater of f − t and −f − t, each of which is smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cut {
    part: Part,
    /// For a sheet the part, lower or upper, whose inequality it is.
    side: Option<Part>,
}

impl Cut {
    pub fn new(part: Part) -> Cut {
        Cut { part, side: None }
    }

    /// The sign of f and that of t in the value, and whether f counts by its magnitude.
    pub fn signs(self) -> (f64, f64, bool) {
        match (self.part, self.side) {
            (Part::Sheet, None) => (1.0, -1.0, true),
            (Part::Sheet, Some(Part::Upper)) => (-1.0, -1.0, false),
            (Part::Upper, _) => (-1.0, 1.0, false),
            _ => (1.0, -1.0, false),
        }
    }

    /// The value of f at the level t.
    pub fn value(self, f: f64, t: f64) -> f64 {
        let (s, c, folded) = self.signs();
        s * if folded { f.abs() } else { f } + c * t
    }

    /// The value and its gradient.
    pub fn gradient(self, (f, df): (f64, Vec3), (t, dt): (f64, Vec3)) -> (f64, Vec3) {
        let (s, c, folded) = self.signs();
        let s = if folded && f < 0.0 { -s } else { s };
        (s * f + c * t, add(scale(df, s), scale(dt, c)))
    }

    /// An interval that contains the value where intervals contain f and t.
    pub fn bound(self, f: Interval, t: Interval) -> Interval {
        match (self.part, self.side) {
            (Part::Sheet, Some(Part::Upper)) => -f - t,
            (Part::Sheet, None) => f.abs() - t,
            (Part::Upper, _) => t - f,
            _ => f - t,
        }
    }

    /// Fills the values where f and t are these.
    pub fn fill(self, f: &[f32], t: &[f32], out: &mut [f32]) {
        let (s, c, folded) = self.signs();
        let (s, c) = (s as f32, c as f32);
        let all = out.iter_mut().zip(f.iter().zip(t));
        if folded {
            all.for_each(|(o, (f, t))| *o = s * f.abs() + c * t);
        } else {
            all.for_each(|(o, (f, t))| *o = s * f + c * t);
        }
    }

    /// The two sides of a whole sheet.
    pub fn halves(self) -> Option<[Cut; 2]> {
        let whole = self.part == Part::Sheet && self.side.is_none();
        whole.then(|| [Part::Lower, Part::Upper].map(|side| Cut { side: Some(side), ..self }))
    }

    /// The two sides of a sheet, each as the field that `of` makes of it; none of anything smooth.
    pub fn sides<F: Implicit + 'static>(self, of: impl Fn(Cut) -> F) -> Vec<Arc<dyn Implicit>> {
        self.halves().map_or(Vec::new(), |both| both.map(|cut| Arc::new(of(cut)) as Arc<dyn Implicit>).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_the_greater_of_its_sides() {
        let whole = Cut::new(Part::Sheet);
        let side = |part| Cut { side: Some(part), ..whole };
        for f in [-2.0, -0.3, 0.0, 0.4, 3.0] {
            let sides = [Part::Lower, Part::Upper].map(|p| side(p).value(f, 0.7));
            assert_eq!(whole.value(f, 0.7), sides[0].max(sides[1]));
            for cut in [whole, side(Part::Lower), side(Part::Upper), Cut::new(Part::Upper)] {
                let at = |v: f64| Interval::new(v - 0.1, v + 0.1);
                let b = cut.bound(at(f), at(0.7));
                let (value, slope) = cut.gradient((f, [1.0, 0.0, 2.0]), (0.7, [0.0, 3.0, 0.0]));
                assert!(b.lo < value && value < b.hi && value == cut.value(f, 0.7));
                let h = 1e-6;
                let next = cut.value(f + h * 5.0, 0.7 + h * 9.0);
                // Along (1, 3, 2): df = 5 h, dt = 9 h.
                let along = slope[0] + 3.0 * slope[1] + 2.0 * slope[2];
                assert!(f == 0.0 || ((next - value) / h - along).abs() < 1e-6);
            }
        }
    }
}
