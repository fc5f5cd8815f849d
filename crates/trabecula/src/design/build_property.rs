//! Levels by what the cell does: the fraction at which it is as stiff, or as permeable, as asked.
//!
//! A property is a monotone function of the fraction, nearly a power of it. Its root is found on coarse voxels, and from there on fine ones by the
//! secant in logarithms. Where the amount varies, the function is found at a few fractions and interpolated in logarithms by monotone cubics
//! (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238).

use super::data::AmountSpec;
use super::unit_cell;
use super::varied::Varied;
use crate::cell::{Cell, Part};
use crate::effective::{NoTensor, Resolution, UnitCell};
use crate::environment::Environment;
use crate::grade::{Grade, Remapped, Stops};
use crate::kind::DesignError;
use crate::lattice::{Lattice, Level};
use crate::map::{Affine, Map};
use crate::report::{PropertyReport, Varying};
use geometry::fault::number;
use geometry::math::{Vec3, apply, dot, norm, scale, transpose};
use geometry::monotone_cubic::monotone;
use geometry::progress::{Silent, Stopped, checkpoint};
use geometry::roots::{Bracket, FalsePosition};
use homogenise::{Material, Moduli, turned, upper_edges};
use std::sync::Arc;

/// Solid fractions between which a level is sought.
const FRACTIONS: [f64; 2] = [0.03, 0.97];
/// Those between which most are found.
const LIKELY: [f64; 2] = [0.15, 0.6];
/// Logarithms of ratios beyond this say no more than the direction.
const FAR: f64 = 7.0;
/// Voxels along a coarse cell.
const COARSE: usize = 16;
/// Relative difference to what was asked for at which the search ends, on coarse and on fine voxels.
const MET: [f64; 2] = [5e-3, 1e-3];
/// The logarithm by which the properties found may miss the ends of what is asked for.
const MISSED: f64 = 0.01;
/// Steps on coarse voxels, and on fine ones.
const STEPS: [usize; 2] = [24, 8];
/// Fractions at which a property that varies is found, and stops of the function between them.
const NODES: usize = 6;
const STOPS: usize = 65;
/// Part of a fraction by which the first and the last of these are further out than the ends of what is asked for.
const BEYOND: f64 = 0.01;

/// A property at a fraction, and the estimated relative error of it.
#[derive(Clone, Copy)]
struct PropertyEstimate {
    value: f64,
    error: f64,
}

/// A property of a cell by its fraction.
struct Property<'a> {
    cell: &'a Arc<Cell>,
    part: Part,
    map: Affine,
    amount: &'a AmountSpec,
    along: Vec3,
    path: String,
}

/// The level at which the cell has the property asked for, and that property.
pub(super) fn level(
    spec: &AmountSpec,
    amount: &Grade,
    part: Part,
    cell: &Arc<Cell>,
    map: &Map,
    environment: &Environment,
) -> Result<(Level, PropertyReport), DesignError> {
    let key = spec.key();
    let path = format!("{}.{key}", environment.path);
    let Some(affine) = map.affine() else {
        let message =
            format!("{key} goes with map.affine and map.spartan, whose cells are alike; with this map give a fraction");
        return Err(DesignError::new(path, message));
    };
    let along = spec.along();
    if norm(along) == 0.0 {
        let message = "along is [0, 0, 0]; give a direction in the axes of the cell, such as [1, 0, 0]";
        return Err(DesignError::new(format!("{}.along", environment.path), message));
    }
    let along = scale(along, 1.0 / norm(along));
    let property = Property { cell, part, map: *affine, amount: spec, along, path };
    let n = property.fine();
    if let Some(value) = amount.constant() {
        let (fraction, PropertyEstimate { value, error }) = property.fraction(value)?;
        let report = PropertyReport { name: key, value: Varying::Number(value), error, n };
        return Ok((Level::Fraction(Grade::Constant(fraction)), report));
    }
    let asked = Varied::of_grade(amount, environment);
    let (stops, error) = property.between(asked)?;
    let report = PropertyReport { name: key, value: asked.varying(), error, n };
    Ok((Level::Fraction(Grade::from(Remapped::new(amount.clone(), stops))), report))
}

impl Property<'_> {
    /// The cell at a fraction.
    fn at(&self, fraction: f64) -> Result<UnitCell, DesignError> {
        checkpoint();
        let level = Level::Fraction(Grade::Constant(fraction));
        let lattice = Lattice::new(self.cell.clone(), Arc::new(self.map), self.part, level);
        unit_cell::of_lattice("", &Arc::new(lattice))
    }

    /// The property at a fraction: 0 where a cell falls apart or lets nothing through.
    fn found(&self, fraction: f64, n: usize) -> Result<PropertyEstimate, DesignError> {
        let cell = self.at(fraction)?;
        let (axes, _) = upper_edges(&transpose(&cell.edges));
        let (value, error) = match self.amount {
            AmountSpec::Stiffness(of) => {
                let material = Material::isotropic(1.0, of.nu).map_err(|f| DesignError::fault(&self.path, f))?;
                let made = cell.stiffness(&material, Resolution { n, plain: false }, &Silent);
                let Some(made) = self.unless_degenerate(made)? else {
                    return Ok(PropertyEstimate { value: 0.0, error: 0.0 });
                };
                // An axis of the frame along the direction.
                let other = if self.along[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
                let third = geometry::math::cross(self.along, other);
                let (to, _) = upper_edges(&transpose(&[self.along, other, third]));
                let frame = geometry::math::product(&axes, &to);
                let [limit, on_voxels] =
                    [made.C, made.C_n].map(|c| Moduli::of(&turned(&c, &transpose(&frame))).map_or(0.0, |m| m.young[0]));
                (limit, (on_voxels / limit - 1.0).abs())
            }
            _ => {
                let made = cell.permeability(n, None, &Silent);
                let along = apply(&axes, self.along);
                // On voxels that no wall is seen by, nothing holds the flow.
                let Some(made) = self.unless_degenerate(made)? else {
                    return Ok(PropertyEstimate { value: f64::INFINITY, error: 0.0 });
                };
                (dot(along, apply(&made.k, along)), made.error)
            }
        };
        Ok(PropertyEstimate { value: value.max(0.0), error })
    }

    /// The property at a fraction.
    fn value(&self, fraction: f64, n: usize) -> Result<f64, DesignError> {
        Ok(self.found(fraction, n)?.value)
    }

    /// A report, or `None` where the property is at its limit.
    fn unless_degenerate<T>(&self, made: Result<T, NoTensor>) -> Result<Option<T>, DesignError> {
        match made {
            Ok(made) => Ok(Some(made)),
            Err(NoTensor::Degenerate(_)) => Ok(None),
            Err(NoTensor::Stopped(Stopped::Refused(fault))) => Err(DesignError::fault(&self.path, fault)),
            Err(NoTensor::Stopped(_)) => Err(DesignError::new(&self.path, "interrupted")),
        }
    }

    /// The property as a guide of the search: at its limit where it cannot be solved for. Fine voxels decide.
    fn guess(&self, fraction: f64, n: usize) -> f64 {
        self.value(fraction, n).unwrap_or(if self.grows() { 0.0 } else { f64::INFINITY })
    }

    /// Whether the property grows with the fraction.
    fn grows(&self) -> bool {
        matches!(self.amount, AmountSpec::Stiffness(_))
    }

    /// The fractions between which the cell has the property: of a stiffness those at which it holds together.
    fn range(&self) -> Result<[f64; 2], DesignError> {
        let [mut low, mut high] = FRACTIONS;
        if self.grows()
            && let Some([from, to]) = self.cell.connected_fraction(self.part).last()
        {
            (low, high) = (low.max(from + 1e-3), high.min(*to));
            if low >= high {
                let message = format!(
                    "{} is sought at solid fractions from {} to {}, and the cell is in one piece from {from:.4} to {to:.4} only; give a \
                     fraction",
                    self.amount.key(),
                    FRACTIONS[0],
                    FRACTIONS[1]
                );
                return Err(DesignError::new(&self.path, message));
            }
        }
        Ok([low, high])
    }

    /// The fraction at which the property has this value, and the property there on fine voxels.
    fn fraction(&self, asked: f64) -> Result<(f64, PropertyEstimate), DesignError> {
        let (mut at, mut slope) = self.coarse_root(asked)?;
        let [low, high] = self.range()?;
        let mut last: Option<[f64; 2]> = None;
        // Values on few voxels are noisy, and steps may not come nearer: the nearest counts.
        let mut nearest = (f64::INFINITY, at, PropertyEstimate { value: f64::NAN, error: f64::NAN });
        for _ in 0..STEPS[1] {
            let found = self.found(at, self.fine())?;
            let off = (found.value / asked).ln();
            // The first one in any case.
            if off.abs() <= nearest.0 {
                nearest = (off.abs(), at, found);
            }
            if !off.is_finite() || off.abs() <= MET[1] {
                break;
            }
            if let Some([x, y]) = last
                && (off - y) / (at.ln() - x) * slope > 0.0
            {
                slope = (off - y) / (at.ln() - x);
            }
            last = Some([at.ln(), off]);
            at = (at.ln() - off / slope).exp().clamp(low, high);
        }
        Ok((nearest.1, nearest.2))
    }

    /// Voxels along a fine cell.
    fn fine(&self) -> usize {
        match self.amount {
            AmountSpec::Stiffness(s) => s.n as usize,
            AmountSpec::Permeability(s) => s.n as usize,
            _ => COARSE,
        }
    }

    /// Two fractions and the properties there, between which `asked` lies if it does between any.
    fn bracket(&self, asked: f64, n: usize) -> Result<([f64; 2], [f64; 2]), DesignError> {
        let [low, high] = self.range()?;
        let [mut a, mut b] = [LIKELY[0].clamp(low, high), LIKELY[1].clamp(low, high)];
        let [mut at_a, mut at_b] = [self.guess(a, n), self.guess(b, n)];
        let grows = self.grows();
        while a > low && (asked < at_a) == grows && asked != at_a {
            (b, at_b) = (a, at_a);
            a = (0.6 * a).max(low);
            at_a = self.guess(a, n);
        }
        while b < high && (asked > at_b) == grows && asked != at_b {
            (a, at_a) = (b, at_b);
            b = (1.25 * b).min(high);
            at_b = self.guess(b, n);
        }
        Ok(([a, b], [at_a, at_b]))
    }

    /// Where the property is `asked` on coarse voxels, and the slope there, in logarithms: by false position (Illinois). Refuses what it does not
    /// reach.
    fn coarse_root(&self, asked: f64) -> Result<(f64, f64), DesignError> {
        let n = COARSE.min(self.fine());
        let (range, ends) = self.bracket(asked, n)?;
        let (grows, most) = (self.grows(), ends[0].max(ends[1]));
        if !(ends[0].min(ends[1]) <= asked && asked <= most) {
            let above = asked > most;
            let (limit, at) = if above == grows { (ends[1], range[1]) } else { (ends[0], range[0]) };
            // What could not be solved there says so itself.
            self.value(at, n)?;
            let (word, unit) = (if above { "most" } else { "least" }, if grows { "" } else { " mm²" });
            let message = format!(
                "{} is {}{unit}; that of this cell is at {word} about {limit:.3}{unit}, at a solid fraction of {at:.3}",
                self.amount.key(),
                number(asked)
            );
            return Err(DesignError::new(&self.path, message));
        }
        let far = |v: f64| (v / asked).ln().clamp(-FAR, FAR);
        let sign = if grows { 1.0 } else { -1.0 };
        let ([a, b], [fa, fb]) = (range.map(f64::ln), ends.map(far));
        let mut slope = (fb - fa) / (b - a);
        let mut last = [a, fa];
        let Some(mut search) = Bracket::new([a, fa], [b, fb]).map(FalsePosition::new) else {
            return Ok((a.exp(), slope));
        };
        for _ in 0..STEPS[0] {
            let at = search.guess();
            let f = far(self.guess(at.exp(), n));
            if at != last[0] && (f - last[1]) / (at - last[0]) * sign > 0.0 {
                slope = (f - last[1]) / (at - last[0]);
            }
            if f.abs() < MET[0] || search.bracket().width() < 1e-7 {
                return Ok((at.exp(), slope));
            }
            last = [at, f];
            search.narrow(at, f);
        }
        Ok((last[0].exp(), slope))
    }

    /// The fraction by the property, over the range of what is asked for, and the greatest error of the property there.
    fn between(&self, asked: Varied) -> Result<(Stops, f64), DesignError> {
        // On fine voxels: the coarse ones may be off by more than the range.
        let ends = [self.fraction(asked.min)?.0, self.fraction(asked.max)?.0];
        let ([low, high], [least, most]) = (self.range()?, [ends[0].min(ends[1]), ends[0].max(ends[1])]);
        let (first, last) = ((least * (1.0 - BEYOND)).max(low).ln(), (most * (1.0 + BEYOND)).min(high).ln());
        let (mut nodes, mut error) = (Vec::<[f64; 2]>::new(), 0f64);
        for i in 0..NODES {
            let share = i as f64 / (NODES - 1) as f64;
            let at = if self.grows() { first + (last - first) * share } else { last + (first - last) * share };
            let found = self.found(at.exp(), self.fine())?;
            error = error.max(found.error);
            let value = found.value.ln();
            if value.is_finite() && nodes.last().is_none_or(|n| n[0] < value) {
                nodes.push([value, at]);
            }
        }
        let covers = |v: f64| (nodes[0][0] - MISSED..=nodes[nodes.len() - 1][0] + MISSED).contains(&v.ln());
        if nodes.len() < 2 || !covers(asked.min) || !covers(asked.max) {
            let message = format!(
                "{} could not be found between fractions of {:.3} and {:.3}; take more voxels (n)",
                self.amount.key(),
                first.exp(),
                last.exp()
            );
            return Err(DesignError::new(&self.path, message));
        }
        let ends = [nodes.first(), nodes.last()].map(|n| n.map_or(0.0, |n| n[0].exp()));
        let (from, to) = (asked.min.clamp(ends[0], ends[1]), asked.max.clamp(ends[0], ends[1]));
        let at = |i: usize| from + (to - from) * i as f64 / (STOPS - 1) as f64;
        let mut stops: Vec<[f64; 2]> = (0..STOPS).map(|i| [at(i), monotone(&nodes, at(i).ln()).exp()]).collect();
        stops.dedup_by(|a, b| a[0] == b[0]);
        Ok((Stops(stops), error))
    }
}
