//! Blends: data to [`Blend`], lattices with a weight each.

use std::sync::Arc;

use super::Warning;
use super::data::{BlendKind, BlendSpec, GradeKind, GradeSpec};
use super::sample;
use crate::blend::{Blend, BlendRule, Constituent, Weights};
use crate::environment::Environment;
use crate::grade::Quantity;
use crate::kind::{DesignError, Key};
use crate::report::RbfReport;
use geometry::fault::number;
use geometry::math::{Vec3, add, norm, scale, sub};
use geometry::roots::bisect;

impl BlendSpec {
    /// The names of its lattices, in the order of their weights.
    pub fn names(&self) -> Vec<&str> {
        match &self.lattices {
            BlendKind::Between(b) => b.between.iter().map(String::as_str).collect(),
            BlendKind::Of(of) => of.of.keys().map(String::as_str).collect(),
        }
    }

    /// The paths at which lattices are named, and their names.
    pub(super) fn named(&self) -> Vec<(String, &str)> {
        match &self.lattices {
            BlendKind::Between(b) => {
                b.between.iter().enumerate().map(|(i, n)| (format!("blend.between[{i}]"), n.as_str())).collect()
            }
            BlendKind::Of(of) => of.of.keys().map(|n| (format!("blend.of.{n}"), n.as_str())).collect(),
        }
    }

    /// Its weights, by their paths in the design.
    fn weights(&self) -> Vec<(String, &GradeSpec)> {
        match &self.lattices {
            BlendKind::Between(b) => vec![("blend.weight".into(), &b.weight)],
            BlendKind::Of(of) => of.of.iter().map(|(n, g)| (format!("blend.of.{n}"), g)).collect(),
        }
    }
}

/// A lattice or beams that a blend may name.
pub(super) struct Member {
    /// Its table in the design: `lattice` or `beams`.
    pub table: &'static str,
    /// Its name there.
    pub name: String,
    /// What it is.
    pub of: Constituent,
}

/// A blend and the lattices in it, in the order of their weights.
pub struct Blended {
    /// The field.
    pub blend: Arc<Blend>,
    /// The names of its lattices.
    pub names: Vec<String>,
    /// The radial basis functions among its weights.
    pub functions: Vec<RbfReport>,
    /// Width of the narrowest transition, mm: the inverse of the steepest weight where two lattices have the same weight.
    pub width: Option<f64>,
}

/// The radial basis functions in a weight, itself or under a step. Warns of lines there that cross themselves.
fn functions(
    spec: &GradeSpec,
    path: &str,
    environment: &Environment,
    out: &mut Vec<RbfReport>,
    warnings: &mut Vec<Warning>,
) -> Result<(), DesignError> {
    match spec {
        GradeSpec::Kind(GradeKind::Sigmoid(s)) => {
            functions(&s.of, &format!("{path}.sigmoid.of"), environment, out, warnings)
        }
        GradeSpec::Kind(GradeKind::Distance(d)) => {
            let path = format!("{path}.distance");
            if let Some(([i, j], p)) = d.line(&path, environment)?.crossing() {
                let message = format!(
                    "the line crosses itself at ({}) mm, where its segments {i} and {j} meet, counted from 0: inside and outside \
                     change places there; put its points in order",
                    p.map(figure).join(", ")
                );
                warnings.push(Warning { path, message });
            }
            Ok(())
        }
        GradeSpec::Kind(GradeKind::Rbf(r)) => {
            let path = format!("{path}.rbf");
            let made = r.functions(&path, environment)?;
            let (points, delta, condition) = (made.len(), made.delta(), made.condition());
            out.push(RbfReport { path, points, delta, condition });
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Builds the blend.
pub(super) fn blend(
    spec: &BlendSpec,
    members: &[Member],
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<Blended, DesignError> {
    let names = spec.names();
    if let Some(idle) = members.iter().find(|m| !names.contains(&m.name.as_str())) {
        let message = format!("the blend does not use this; it is of {}", names.join(", "));
        return Err(DesignError::new(format!("{}.{}", idle.table, idle.name), message));
    }
    let mut of = Vec::new();
    for name in &names {
        let message = || DesignError::new("blend", format!("there is no lattice \"{name}\""));
        let member = members.iter().find(|m| m.name == *name).ok_or_else(message)?;
        of.push(member.of.clone());
    }
    let (mut grades, mut rbf) = (Vec::new(), Vec::new());
    for (path, spec) in spec.weights() {
        functions(spec, &path, environment, &mut rbf, warnings)?;
        let here = Environment { path: path.clone(), ..*environment };
        grades.push(spec.build(&Quantity::new(path, &here, Key::NONE))?);
    }
    let weights = match (&spec.lattices, grades.pop()) {
        (BlendKind::Between(_), Some(weight)) => Weights::between(weight),
        (_, last) => Weights::shares(grades.into_iter().chain(last).collect()),
    };
    check_weights(&weights, spec, environment, warnings)?;
    let bounds = environment.region.bounds();
    let equal = equal(&weights, environment.points);
    let cells: Vec<f64> = of.iter().map(|m| m.longest()).collect();
    let narrow = narrow(&weights, &equal, &cells);
    let blend = Blend::new(of, weights, spec.by, &bounds).map_err(|f| DesignError::fault("blend", f))?;
    unused(&blend, &names, members, environment, warnings);
    cancelling(&blend, &names, &equal, environment, warnings);
    // The width is that at samples: exactly two cells are wide enough.
    let steep = narrow.filter(|t| spec.by == BlendRule::Fraction && t.cells() < 2.0 * (1.0 - WIDTH_ERROR));
    if let Some(TransitionSample { width, between: [a, b], cell }) = steep {
        let message = format!(
            "the transition between \"{}\" and \"{}\" is {} mm wide where it is steepest, less than two cells of {} mm: lattices meet \
             there without growing into each other, and the fraction is not held",
            names[a],
            names[b],
            figure(width),
            number(cell)
        );
        let paths = spec.weights();
        warnings.push(Warning { path: paths[a.min(paths.len() - 1)].0.clone(), message });
    }
    let width = narrow.map(|t| t.width);
    Ok(Blended { blend: Arc::new(blend), names: names.into_iter().map(String::from).collect(), functions: rbf, width })
}

/// Relative error of the width of a transition, from differences at samples.
const WIDTH_ERROR: f64 = 1e-3;

/// How far a weight may leave 0 to 1 unwarned: functions through control points overshoot between them.
const BEYOND: f64 = 0.1;

/// Refuses weights that are not finite, or none of which is positive, at any sample position; warns of a share that is none.
fn check_weights(
    weights: &Weights,
    spec: &BlendSpec,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<(), DesignError> {
    let paths = spec.weights();
    let (points, _) = sample::inside(environment.region, 60_000);
    let points: Vec<Vec3> = points.into_iter().chain(environment.points.iter().copied()).collect();
    let mut most = vec![f64::NEG_INFINITY; points.len()];
    let mut values = vec![0.0; points.len()];
    let at = |i: usize| points[i].map(|v| format!("{v:.4}")).join(", ");
    for (grade, (path, _)) in weights.grades().iter().zip(&paths) {
        grade.values(&points, &mut values);
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let message = format!("the weight is {} at ({}) mm; it must be a finite number", number(values[i]), at(i));
            return Err(DesignError::new(path, message).found(number(values[i])));
        }
        most.iter_mut().zip(&values).for_each(|(m, v)| *m = m.max(*v));
        let beyond = |i: usize| (values[i] - 1.0).max(-values[i]);
        let farthest = (0..points.len()).max_by(|i, j| beyond(*i).total_cmp(&beyond(*j)).then(j.cmp(i)));
        if let (BlendKind::Between(_), Some(i)) = (&spec.lattices, farthest.filter(|i| beyond(*i) > BEYOND)) {
            let (least, greatest) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(*v), r.1.max(*v)));
            let message = format!(
                "the weight is {} to {}, {} at ({}) mm; it is cut off at 0 and 1: give a share from 0 to 1",
                figure(least),
                figure(greatest),
                figure(values[i]),
                at(i)
            );
            warnings.push(Warning { path: path.clone(), message });
        }
    }
    if let (BlendKind::Of(_), Some(i)) = (&spec.lattices, most.iter().position(|m| *m <= 0.0)) {
        let message = format!(
            "all weights are 0 at ({}) mm, so that none of the lattices is there; let one of them count everywhere",
            at(i)
        );
        return Err(DesignError::new("blend.of", message));
    }
    Ok(())
}

/// Warns of lattices whose weight is zero everywhere.
fn unused(blend: &Blend, names: &[&str], members: &[Member], environment: &Environment, warnings: &mut Vec<Warning>) {
    let n = names.len();
    let mut w = vec![0.0; n * environment.points.len()];
    blend.weights().values(environment.points, &mut w);
    for (i, name) in names.iter().enumerate() {
        if w.chunks_exact(n).all(|w| w[i] == 0.0) {
            let message = "the weight of this lattice is 0 at every sample position in the region".to_string();
            let table = members.iter().find(|m| m.name == *name).map_or("lattice", |m| m.table);
            warnings.push(Warning { path: format!("{table}.{name}"), message });
        }
    }
}

/// Warns of lattices whose functions cancel where they are mixed: of the place where least is left of them.
fn cancelling(
    blend: &Blend,
    names: &[&str],
    equal: &[[Vec3; 2]],
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) {
    /// A mixture of a tenth of the size is one of shares within 0.036 of equal ones, where two functions are opposite.
    const LEFT: f64 = 0.1;
    let n = names.len();
    let points: Vec<Vec3> = equal.as_flattened().iter().chain(environment.points).copied().collect();
    let mut w = vec![0.0; n * points.len()];
    blend.weights().values(&points, &mut w);
    let each = w.chunks_exact(n).zip(&points).filter_map(|(w, p)| Some((blend.kept(w)?, w, p)));
    let Some((left, w, p)) = each.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|m| m.0 < LEFT) else {
        return;
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| w[*b].total_cmp(&w[*a]));
    let [a, b] = [order[0].min(order[1]), order[0].max(order[1])];
    let remedy = match blend.offset_in_step(a, b) {
        None => "give one of them another `offset` in its map".to_string(),
        Some(offset) => format!(
            "give \"{}\" `offset = [{}]` in its map, with which it is in step with \"{}\"",
            names[b],
            offset.map(figure).join(", "),
            names[a]
        ),
    };
    let message = format!(
        "the functions of \"{}\" and \"{}\" cancel at ({}) mm, where the shares are {:.2} and {:.2}: only {left:.3} is left of \
         their root mean square, so that the solid is torn there, by a gap that a mesh may be too coarse to show; {remedy}",
        names[a],
        names[b],
        p.map(figure).join(", "),
        w[a],
        w[b]
    );
    warnings.push(Warning { path: "blend".into(), message });
}

/// Positions at which two lattices have the same weight, one to either side, found by bisection between points at which
/// different ones have the greatest.
fn equal(weights: &Weights, points: &[Vec3]) -> Vec<[Vec3; 2]> {
    const PAIRS: usize = 400;
    let n = weights.len();
    let mut w = vec![0.0; n * points.len()];
    weights.values(points, &mut w);
    let first = |w: &[f64]| (0..n).fold(0, |m, i| if w[i] > w[m] { i } else { m });
    let owner: Vec<usize> = w.chunks_exact(n).map(first).collect();
    let stride = (points.len() / PAIRS).max(1);
    let mut own = vec![0.0; n];
    let each = (0..points.len()).step_by(stride).filter_map(|i| {
        // The nearest of some points at which another has the greatest weight.
        let near = (1..200).map(|k| (i + k * 7) % points.len()).filter(|j| owner[*j] != owner[i]);
        let distance = |j: &usize| norm(sub(points[*j], points[i]));
        let j = near.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let at = |t: f64| add(scale(points[i], 1.0 - t), scale(points[j], t));
        let ends = bisect([0.0, 1.0], 50, |t| {
            weights.values(&[at(t)], &mut own);
            first(&own) == owner[i]
        });
        Some(ends.map(at))
    });
    each.collect()
}

/// A place of a transition.
#[derive(Clone, Copy)]
struct TransitionSample {
    /// Its width, mm.
    width: f64,
    /// The lattices that have the greatest weights there.
    between: [usize; 2],
    /// The longer of their wavelengths, mm.
    cell: f64,
}

impl TransitionSample {
    fn cells(&self) -> f64 {
        self.width / self.cell
    }
}

/// Where a transition is narrowest for the cells that meet in it, `cells` long (mm): its width is 1/|∇w| where two lattices have the same
/// weight, to either side of it.
fn narrow(weights: &Weights, equal: &[[Vec3; 2]], cells: &[f64]) -> Option<TransitionSample> {
    let n = weights.len();
    let each = equal.iter().map(|[a, b]| {
        let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
        weights.gradients(&[*a], &mut v, &mut g);
        let (mut u, mut h) = (vec![0.0; n], vec![[0.0; 3]; n]);
        weights.gradients(&[*b], &mut u, &mut h);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|i, j| (v[*j] + u[*j]).total_cmp(&(v[*i] + u[*i])));
        let between = [order[0].min(order[1]), order[0].max(order[1])];
        let steep = between.iter().flat_map(|i| [norm(g[*i]), norm(h[*i])]).fold(0.0, f64::max);
        // A jump has no slope on either side of it.
        let jump = v.iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 0.1;
        let width = if jump { 0.0 } else { 1.0 / steep };
        TransitionSample { width, between, cell: between.iter().map(|i| cells[*i]).fold(0.0, f64::max) }
    });
    each.min_by(|a, b| a.cells().total_cmp(&b.cells()))
}

fn figure(v: f64) -> String {
    // Adding zero takes the sign off a negative one.
    number((v * 1000.0).round() / 1000.0 + 0.0)
}
