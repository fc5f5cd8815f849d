//! A quantity of a design: its path, limits and environment, from which its grade is built.

use super::complement::Complement;
use super::{Grade, Stops, VaryingNumber};
use crate::environment::Environment;
use crate::kind::{DesignError, Key, Table};
use geometry::fault::{Fault, position};

/// A number of a design: its path, environment and limits, and whether its complement, 1 − value, is meant.
pub(crate) struct Quantity<'a> {
    pub path: String,
    pub environment: &'a Environment<'a>,
    pub key: Key,
    pub complement: bool,
}

/// The declaration of a key of a table.
pub(crate) fn key_of<T: Table>(name: &str) -> Key {
    let found = T::keys().into_iter().find(|k| k.name == name);
    debug_assert!(found.is_some(), "{name} is a key");
    found.unwrap_or(Key::NONE)
}

impl<'a> Quantity<'a> {
    /// A number at `path`, under a key of these limits.
    pub fn new(path: impl Into<String>, environment: &'a Environment<'a>, key: Key) -> Self {
        Quantity { path: path.into(), environment, key, complement: false }
    }

    pub fn below(&self, key: &str) -> Self {
        Quantity { path: format!("{}.{key}", self.path), ..*self }
    }

    /// The value that is meant: v or 1 − v.
    pub fn own(&self, v: f64) -> f64 {
        if self.complement { 1.0 - v } else { v }
    }

    /// The stops of the values that are meant.
    pub fn stops(&self, stops: Stops) -> Stops {
        if self.complement { stops.complement() } else { stops }
    }

    /// A function whose values cannot be checked where they are declared: they are sampled in the region.
    pub fn checked(&self, of: impl VaryingNumber + 'static) -> Result<Grade, DesignError> {
        let grade = Grade::from(of);
        self.check(&grade, |v, position| self.key.admit_at(v, position))?;
        Ok(grade)
    }

    /// The same of a function that does not know of complements.
    pub fn function<V: VaryingNumber + 'static>(&self, of: Result<V, Fault>) -> Result<Grade, DesignError> {
        let of = of.map_err(|f| DesignError::fault(&self.path, f))?;
        if self.complement { self.checked(Complement(of)) } else { self.checked(of) }
    }

    /// Checks a number at the positions of the region where it is least and greatest.
    pub fn check(&self, grade: &Grade, admit: impl Fn(f64, &str) -> Result<(), Fault>) -> Result<(), DesignError> {
        let environment = self.environment;
        let region = environment.region;
        let bounds = region.bounds();
        let corner = |i: usize| core::array::from_fn(|a| if i >> a & 1 == 0 { bounds.min[a] } else { bounds.max[a] });
        let mut corners: Vec<[f64; 3]> = (0..8).map(corner).collect();
        corners.retain(|c| region.value(*c) <= 1e-9);
        let points = [grade.check_points(environment), corners.clone()].concat();
        let corners = corners.len();
        let mut values = vec![0.0; points.len()];
        grade.values(&points, &mut values);
        let order = |a: &usize, b: &usize| self.own(values[*a]).total_cmp(&self.own(values[*b]));
        // Not a number comes first or last in this order. Of positions that are as good those of the search are named last.
        let searched = points.len() - environment.points.len() - corners;
        let least = (searched..values.len()).chain(0..searched).min_by(order);
        let ends = [least, (0..values.len()).max_by(order)];
        for i in ends.into_iter().flatten() {
            admit(self.own(values[i]), &format!(" at {}", position(points[i])))
                .map_err(|f| DesignError::fault(&self.path, f))?;
        }
        Ok(())
    }
}

/// A kind of grade, as it is declared.
pub(crate) trait BuildGrade {
    /// The grade. `of.path` is that of the kind's table; declared ranges have been checked.
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError>;
}
