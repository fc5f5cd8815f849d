//! Stresses, as they are declared.

use super::load_cases::{CasesBy, Stress};
use crate::environment::Environment;
use crate::grade::{FieldKind, Grade, GradeSpec, Quantity, TableKind, TensorOrder, several};
use crate::kind::{DesignError, Fault, Key, Kind};
use geometry::fault::counted;

/// A stress that may vary, of one load case or several.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(
    untagged,
    noun = "six numbers [11, 22, 33, 23, 13, 12], each of which may vary, the field of a result, a table, or load cases"
)]
pub enum StressKind {
    /// By its components 11, 22, 33, 23, 13, 12.
    Components(Box<[GradeSpec; 6]>),
    /// From a file, or of several load cases.
    Table(Box<StressTable>),
}

/// A stress from a file, or of several load cases.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Stress", noun = "a stress", alternatives)]
pub enum StressTable {
    /// An array of six or nine numbers of a result.
    Field(TensorField),
    /// Six numbers at points.
    Points(TensorPoints),
    /// Several tensors.
    Cases(LoadCasesKind),
}

/// A symmetric tensor that may vary.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(
    untagged,
    noun = "six numbers [11, 22, 33, 23, 13, 12], each of which may vary, the field of a result, or a table"
)]
pub enum TensorKind {
    /// By its components 11, 22, 33, 23, 13, 12.
    Components(Box<[GradeSpec; 6]>),
    /// From a file.
    Table(Box<TensorTable>),
}

/// A symmetric tensor from a file.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Tensor", noun = "a tensor", alternatives)]
pub enum TensorTable {
    /// An array of six or nine numbers of a result.
    Field(TensorField),
    /// Six numbers at points.
    Points(TensorPoints),
}

/// An array of six or nine numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a tensor")]
pub struct TensorField {
    /// An array of six or nine components of a result.
    field: FieldKind,
    /// The order of six components.
    #[kind(default)]
    order: TensorOrder,
}

/// Six numbers at points.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a tensor")]
pub struct TensorPoints {
    /// A table of points and the six components there, as any program can export it.
    table: TableKind,
}

/// Several load cases.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "LoadCases", noun = "load cases", check = LoadCasesKind::complete)]
pub struct LoadCasesKind {
    /// The stress tensor of each load case.
    #[kind(least = 1)]
    cases: Vec<TensorKind>,
    /// Which of them count.
    #[kind(default)]
    by: CasesBy,
    /// What each case counts, 0 or more: its share of the mean; of the worst a factor of its stress. All 1 unless given.
    #[kind(min = 0.0)]
    weights: Option<Vec<f64>>,
}

impl LoadCasesKind {
    fn complete(&self, _: &Key) -> Result<(), Fault> {
        match &self.weights {
            Some(of) if of.len() != self.cases.len() => {
                let (weights, cases) = (counted(of.len(), "weight"), counted(self.cases.len(), "case"));
                Err(Fault::new("weights", format!("{weights} for {cases}; give one for each")))
            }
            _ => Ok(()),
        }
    }

    fn build(&self, path: &str, environment: &Environment) -> Result<Stress, DesignError> {
        let weight = |i: usize| self.weights.as_ref().map_or(1.0, |of| of[i]);
        let case = |(i, of): (usize, &TensorKind)| {
            let at = format!("{path}.cases[{i}]");
            let made = match of {
                TensorKind::Components(of) => components(of, &at, environment),
                TensorKind::Table(of) => match &**of {
                    TensorTable::Field(of) => of.build(&at, environment),
                    TensorTable::Points(of) => of.build(&at, environment),
                },
            };
            Ok((made?, weight(i)))
        };
        let cases = self.cases.iter().enumerate().map(case).collect::<Result<Vec<_>, DesignError>>()?;
        Stress::new(cases, self.by).map_err(|f| DesignError::fault(path, f))
    }
}

impl StressKind {
    pub(super) fn build(&self, path: &str, environment: &Environment) -> Result<Stress, DesignError> {
        match self {
            StressKind::Components(of) => components(of, path, environment).map(Stress::from),
            StressKind::Table(of) => match &**of {
                StressTable::Field(of) => of.build(path, environment).map(Stress::from),
                StressTable::Points(of) => of.build(path, environment).map(Stress::from),
                StressTable::Cases(of) => of.build(path, environment),
            },
        }
    }
}

impl TensorField {
    fn build(&self, path: &str, environment: &Environment) -> Result<[Grade; 6], DesignError> {
        several(&self.field, &format!("{path}.field"), environment, |n| self.order.of(n))
    }
}

impl TensorPoints {
    fn build(&self, path: &str, environment: &Environment) -> Result<[Grade; 6], DesignError> {
        self.table.grades(&format!("{path}.table"), environment)
    }
}

fn components(of: &[GradeSpec; 6], path: &str, environment: &Environment) -> Result<[Grade; 6], DesignError> {
    each(of, path, &|of, path| of.build(&Quantity::new(path, environment, Key::NONE)))
}

/// The same for each, with its index in the path.
pub(super) fn each<const N: usize>(
    of: &[GradeSpec; N],
    path: &str,
    one: &impl Fn(&GradeSpec, String) -> Result<Grade, DesignError>,
) -> Result<[Grade; N], DesignError> {
    let made = of.iter().enumerate().map(|(i, g)| one(g, format!("{path}[{i}]")));
    let mut made = made.collect::<Result<Vec<Grade>, DesignError>>()?.into_iter();
    Ok(core::array::from_fn(|_| made.next().unwrap_or(Grade::Constant(0.0))))
}
