//! Levels by what the cell does: the fraction at which it is as stiff, or as permeable, as asked.
//!
//! A property is a monotone function of the fraction. Its root is bracketed on coarse voxels; the error of these is then measured at the
//! root on fine ones and allowed for, until the fine ones say what was asked for. Where the amount varies, the function is taken at a few
//! fractions and interpolated by monotone cubics (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238).

use super::built_report::Varied;
use super::data::AmountSpec;
use super::unit_cell;
use crate::cell::{Cell, Part};
use crate::effective::{Resolution, UnitCell};
use crate::environment::Environment;
use crate::grade::{Grade, Remapped, Stops};
use crate::kind::DesignError;
use crate::lattice::{Lattice, Level};
use crate::map::{Affine, Map};
use geometry::fault::number;
use geometry::math::{Vec3, apply, dot, norm, scale, transpose};
use geometry::progress::{Silent, checkpoint};
use homogenise::{Material, Moduli, turned, upper_edges};
use std::sync::Arc;

/// Solid fractions between which a level is sought.
const FRACTIONS: [f64; 2] = [0.03, 0.97];
/// Voxels along a coarse cell, and the least and most along a fine one.
const COARSE: usize = 16;
const FINE: [usize; 2] = [32, 64];
/// Relative difference between what is found and what was asked for that is left.
const MET: f64 = 5e-4;
/// Rounds in which the coarse function is corrected.
const ROUNDS: usize = 4;
/// Fractions at which a property that varies is found, and stops of the function between them.
const NODES: usize = 9;
const STOPS: usize = 65;

/// A property of a cell by its fraction.
struct Property<'a> {
    cell: &'a Arc<Cell>,
    part: Part,
    map: Affine,
    amount: &'a AmountSpec,
    along: Vec3,
    path: String,
}

/// The level at which the cell has the property asked for.
pub(super) fn level(
    spec: &AmountSpec,
    amount: &Grade,
    part: Part,
    cell: &Arc<Cell>,
    map: &Map,
    environment: &Environment,
) -> Result<Level, DesignError> {
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
    if let Some(value) = amount.constant() {
        return Ok(Level::Fraction(Grade::Constant(property.fraction(value)?)));
    }
    let mut asked = vec![0.0; environment.points.len()];
    amount.values(environment.points, &mut asked);
    let Varied { min, max } = Varied::of(&asked);
    let ends = [property.fraction(min)?, property.fraction(max)?];
    Ok(Level::Fraction(Grade::from(Remapped::new(amount.clone(), property.between([min, max], ends)?))))
}

impl Property<'_> {
    /// The cell at a fraction.
    fn at(&self, fraction: f64) -> Result<UnitCell, DesignError> {
        checkpoint();
        let level = Level::Fraction(Grade::Constant(fraction));
        let lattice = Lattice::new(self.cell.clone(), Arc::new(self.map), self.part, level);
        unit_cell::of_lattice("", &Arc::new(lattice))
    }

    /// The property at a fraction, 0 where the cell has none; on fine voxels, three across the thinnest wall where that is within reach.
    fn value(&self, fraction: f64, fine: bool) -> Result<f64, DesignError> {
        let cell = self.at(fraction)?;
        let longest = cell.edges.map(norm).into_iter().fold(0.0, f64::max);
        let across = 3.0 * longest / cell.wall.unwrap_or(longest).max(1e-9 * longest);
        let need = (8 * (across / 8.0).ceil() as usize).clamp(FINE[0], FINE[1]);
        let n = if fine { need } else { COARSE };
        let (axes, _) = upper_edges(&transpose(&cell.edges));
        let found = match self.amount {
            AmountSpec::Stiffness(of) => {
                let material = Material::isotropic(1.0, of.nu).map_err(|f| DesignError::fault(&self.path, f))?;
                let made = cell.stiffness(&material, Resolution { n, plain: false }, &Silent);
                let own = made.ok().and_then(|made| {
                    // An axis of the frame along the direction.
                    let other = if self.along[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
                    let third = geometry::math::cross(self.along, other);
                    let (to, _) = upper_edges(&transpose(&[self.along, other, third]));
                    let frame = geometry::math::product(&axes, &to);
                    Moduli::of(&turned(&made.C, &transpose(&frame)))
                });
                own.map_or(0.0, |m| m.young[0])
            }
            _ => {
                let made = cell.permeability(n, None, &Silent);
                let along = apply(&axes, self.along);
                made.map_or(0.0, |made| dot(along, apply(&made.k, along)))
            }
        };
        Ok(found.max(0.0))
    }

    /// Whether the property grows with the fraction.
    fn grows(&self) -> bool {
        matches!(self.amount, AmountSpec::Stiffness(_))
    }

    /// The fractions between which the cell has the property: of a stiffness those at which it holds together.
    fn range(&self) -> [f64; 2] {
        let [mut low, mut high] = FRACTIONS;
        if self.grows()
            && let Some([from, to]) = self.cell.connected_fraction(self.part).last()
        {
            (low, high) = (low.max(from + 1e-3), high.min(*to));
        }
        [low, high]
    }

    /// The fraction at which the property has this value.
    fn fraction(&self, asked: f64) -> Result<f64, DesignError> {
        let [low, high] = self.range();
        let ends = [self.value(low, false)?, self.value(high, false)?];
        let (mut wanted, mut found) = (asked, low);
        for round in 0..ROUNDS {
            found = self.coarse_root(wanted, [low, high], ends, asked)?;
            let fine = self.value(found, true)?;
            if fine <= 0.0 || (fine / asked - 1.0).abs() <= MET || round + 1 == ROUNDS {
                break;
            }
            // The same relative error of the coarse voxels is expected at the next root.
            wanted *= asked / fine;
        }
        Ok(found)
    }

    /// Where the coarse function is `wanted`, by false position (Illinois) in its logarithm; refuses what it does not reach.
    fn coarse_root(&self, wanted: f64, range: [f64; 2], ends: [f64; 2], asked: f64) -> Result<f64, DesignError> {
        let [least, most] = if self.grows() { ends } else { [ends[1], ends[0]] };
        if wanted < least || wanted > most {
            let (limit, word, at) = if wanted < least {
                (least, "least", if self.grows() { range[0] } else { range[1] })
            } else {
                (most, "most", if self.grows() { range[1] } else { range[0] })
            };
            let (key, unit) = if self.grows() { ("stiffness", "") } else { ("permeability", " mm²") };
            let message = format!(
                "{key} is {}{unit}; that of this cell is at {word} about {limit:.3}{unit}, at a solid fraction of {at:.3}",
                number(asked)
            );
            return Err(DesignError::new(&self.path, message));
        }
        let sign = if self.grows() { 1.0 } else { -1.0 };
        let far = |v: f64| sign * (v.max(1e-12 * most) / wanted).ln();
        let ([mut a, mut b], [mut fa, mut fb]) = (range, ends.map(far));
        let mut last = 0;
        for _ in 0..24 {
            if b - a < 1e-7 || fa == 0.0 {
                break;
            }
            let at = (a - fa * (b - a) / (fb - fa)).clamp(a, b);
            let f = far(self.value(at, false)?);
            if f.abs() < 0.1 * MET {
                return Ok(at);
            }
            if f < 0.0 {
                (a, fa) = (at, f);
                fb *= if last == -1 { 0.5 } else { 1.0 };
                last = -1;
            } else {
                (b, fb) = (at, f);
                fa *= if last == 1 { 0.5 } else { 1.0 };
                last = 1;
            }
        }
        Ok(0.5 * (a + b))
    }

    /// The fraction by the property between two ends.
    fn between(&self, values: [f64; 2], fractions: [f64; 2]) -> Result<Stops, DesignError> {
        let [first, last] = fractions;
        let mut nodes = vec![[values[0].ln(), first]];
        for i in 1..NODES - 1 {
            let p = first + (last - first) * i as f64 / (NODES - 1) as f64;
            let v = self.value(p, true)?.ln();
            if nodes.last().is_some_and(|n| n[0] < v) && v < values[1].ln() {
                nodes.push([v, p]);
            }
        }
        nodes.push([values[1].ln(), last]);
        let at = |i: usize| values[0] + (values[1] - values[0]) * i as f64 / (STOPS - 1) as f64;
        let mut stops: Vec<[f64; 2]> = (0..STOPS).map(|i| [at(i), monotone(&nodes, at(i).ln())]).collect();
        stops.dedup_by(|a, b| a[0] == b[0]);
        Ok(Stops(stops))
    }
}

/// The monotone piecewise cubic through points of ascending x.
fn monotone(points: &[[f64; 2]], x: f64) -> f64 {
    let n = points.len();
    if n < 2 {
        return points[0][1];
    }
    let secant = |i: usize| (points[i + 1][1] - points[i][1]) / (points[i + 1][0] - points[i][0]);
    let slope = |i: usize| {
        if i == 0 || i + 1 == n {
            return secant(if i == 0 { 0 } else { n - 2 });
        }
        let (a, b) = (secant(i - 1), secant(i));
        if a * b <= 0.0 {
            return 0.0;
        }
        let (h, g) = (points[i][0] - points[i - 1][0], points[i + 1][0] - points[i][0]);
        3.0 * (h + g) / ((h + 2.0 * g) / a + (2.0 * h + g) / b)
    };
    let i = points.partition_point(|p| p[0] <= x).clamp(1, n - 1) - 1;
    let ([x0, y0], [x1, y1]) = (points[i], points[i + 1]);
    let h = x1 - x0;
    let t = ((x - x0) / h).clamp(0.0, 1.0);
    let (s, u) = (t * t * (3.0 - 2.0 * t), t * (1.0 - t));
    y0 + (y1 - y0) * s + h * u * ((1.0 - t) * slope(i) - t * slope(i + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotone_cubic_meets_its_points_and_goes_no_further() {
        let points = [[0.0, 0.0], [1.0, 0.1], [2.0, 0.1], [4.0, 3.0], [5.0, 3.2]];
        for [x, y] in points {
            assert!((monotone(&points, x) - y).abs() < 1e-12);
        }
        let all: Vec<f64> = (0..=500).map(|i| monotone(&points, f64::from(i) / 100.0)).collect();
        assert!(all.windows(2).all(|w| w[0] <= w[1] + 1e-15));
        // A straight line is one.
        let line = [[0.0, 1.0], [1.0, 3.0], [3.0, 7.0]];
        assert!((monotone(&line, 2.2) - 5.4).abs() < 1e-12);
    }
}
