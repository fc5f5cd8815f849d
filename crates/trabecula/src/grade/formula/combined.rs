//! Several numbers combined by a formula.

use std::collections::BTreeMap;

use super::parse::{AXES, reserved};
use super::{DualNumber, Formula, LANES};
use crate::field::Field;
use crate::grade::{BuildGrade, Grade, GradeSpec, Quantity, VaryingNumber};
use crate::kind::{DesignError, Key, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3};

/// Other numbers combined by a formula, such as "load * (1 - 0.5*skin)", "min(a, b)" or "0.2 + 0.1*exp(-depth/2)".
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Combined", noun = "numbers combined by a formula", check = CombinedKind::complete)]
pub struct CombinedKind {
    /// The formula in x, y, z (mm) and the names of the numbers; parsed, never run as code.
    formula: String,
    /// The numbers by their names, in which letters, digits and _ stand.
    #[kind(least = 1)]
    of: BTreeMap<String, GradeSpec>,
}

impl CombinedKind {
    fn names(&self) -> Vec<&str> {
        self.of.keys().map(String::as_str).collect()
    }

    /// Names that a formula can hold, all of them in it.
    fn complete(&self, _: &Key) -> Result<(), Fault> {
        let is_word = |name: &str| {
            name.starts_with(|c: char| c.is_alphabetic() || c == '_')
                && name.chars().all(|c| c.is_alphanumeric() || c == '_')
        };
        for name in self.names() {
            let at = format!("of.{name}");
            if !is_word(name) {
                let message = "no name for a formula: a letter comes first, then letters, digits and _";
                return Err(Fault::new(at, message).found(name));
            }
            if reserved().any(|word| word == name) {
                return Err(Fault::new(at, format!("{name} means something else in every formula; take another name")));
            }
        }
        let formula = Formula::with_names(&self.formula, &self.names())
            .map_err(|f| Fault::new("formula", f.message).found(&self.formula))?;
        match self.names().into_iter().enumerate().find(|(i, _)| !formula.has_variable(AXES.len() + i)) {
            Some((_, name)) => {
                Err(Fault::new(format!("of.{name}"), format!("the formula has no {name}; leave it out")))
            }
            None => Ok(()),
        }
    }
}

impl BuildGrade for CombinedKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let number = |(name, spec): (&String, &GradeSpec)| {
            let number = spec.build(&Quantity::new(format!("{}.of.{name}", of.path), of.environment, Key::NONE))?;
            Ok((name.clone(), number))
        };
        let numbers: Result<Vec<(String, Grade)>, DesignError> = self.of.iter().map(number).collect();
        of.function(Combined::new(&self.formula, numbers?))
    }
}

/// A formula in x, y, z (mm) and other numbers.
pub struct Combined {
    formula: Formula,
    numbers: Vec<Grade>,
}

impl Combined {
    /// The formula `text` in x, y, z and numbers by their names.
    ///
    /// # Errors
    /// As of [`Formula::parse`].
    pub fn new(text: &str, numbers: Vec<(String, Grade)>) -> Result<Combined, Fault> {
        let names: Vec<&str> = numbers.iter().map(|n| n.0.as_str()).collect();
        let formula = Formula::with_names(text, &names)?;
        Ok(Combined { formula, numbers: numbers.into_iter().map(|n| n.1).collect() })
    }
}

impl Field for Combined {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut numbers = vec![[0.0; LANES]; self.numbers.len()];
        let mut stack = Vec::new();
        for (points, out) in points.chunks(LANES).zip(out.chunks_mut(LANES)) {
            for (number, values) in self.numbers.iter().zip(&mut numbers) {
                number.values(points, &mut values[..points.len()]);
            }
            let variable = |lane: usize, n: usize| match n.checked_sub(AXES.len()) {
                Some(number) => numbers[number][lane],
                None => points.get(lane).map_or(0.0, |p| p[n]),
            };
            let values = self.formula.run_lanes(variable, &mut stack);
            out.copy_from_slice(&values[..out.len()]);
        }
    }

    /// By the chain rule.
    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut numbers = vec![([0.0; LANES], [[0.0; 3]; LANES]); self.numbers.len()];
        let mut stack = Vec::new();
        let out = values.chunks_mut(LANES).zip(gradients.chunks_mut(LANES));
        for (points, (values, gradients)) in points.chunks(LANES).zip(out) {
            for (number, (v, g)) in self.numbers.iter().zip(&mut numbers) {
                number.gradients(points, &mut v[..points.len()], &mut g[..points.len()]);
            }
            let variable = |lane: usize, n: usize| match n.checked_sub(AXES.len()) {
                Some(number) => DualNumber(numbers[number].0[lane], numbers[number].1[lane]),
                None => {
                    DualNumber(points.get(lane).map_or(0.0, |p| p[n]), [0, 1, 2].map(|a| f64::from(u8::from(a == n))))
                }
            };
            let found = self.formula.run_lanes(variable, &mut stack);
            for ((v, g), d) in values.iter_mut().zip(gradients).zip(found) {
                (*v, *g) = (d.0, d.1);
            }
        }
    }

    /// By interval arithmetic; everything where the formula may be undefined.
    fn bound(&self, b: &Aabb) -> Interval {
        let axes = [0, 1, 2].map(|a| Interval::new(b.min[a], b.max[a]));
        let variables: Vec<Interval> = axes.into_iter().chain(self.numbers.iter().map(|n| n.bound(b))).collect();
        self.formula.run(&variables, &mut Vec::new())
    }
}

impl VaryingNumber for Combined {
    /// The axes that the formula names or along which one of its numbers may change.
    fn varies(&self) -> [bool; 3] {
        let varies = self.numbers.iter().map(Grade::varies);
        varies.fold(self.formula.varies(), |all, one| [0, 1, 2].map(|a| all[a] || one[a]))
    }
}
