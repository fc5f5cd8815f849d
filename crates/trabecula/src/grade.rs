//! A number that may vary in space.

use std::sync::Arc;

use crate::field::Field;
use crate::kind::{DesignError, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, norm};

mod complement;
mod control_points;
mod csv;
mod depth;
mod extremes;
mod formula;
mod grid;
mod invariant;
mod linear;
mod polyline;
mod product;
mod quantity;
mod radial;
mod rbf;
mod region_step;
mod remapped;
mod result;
mod samples;
mod scattered;
mod sigmoid;
mod steps;
mod stops;

pub use control_points::ControlPoints;
pub use depth::Depth;
pub use formula::{Combined, Formula};
pub use invariant::{Invariant, TensorOrder};
pub use linear::Linear;
pub use polyline::Polyline;
pub use product::Product;
pub(crate) use quantity::{BuildGrade, Quantity, key_of};
pub use radial::Radial;
pub use rbf::Rbf;
pub use region_step::region_step;
pub use remapped::Remapped;
pub use result::FieldKind;
pub(crate) use result::{lines, pairs, several};
pub use samples::Samples;
pub(crate) use scattered::TableKind;
pub use sigmoid::{Sigmoid, SigmoidKind};
pub use steps::Steps;
pub use stops::Stops;

/// A number that may vary in space, as it is declared.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum GradeSpec {
    /// The same everywhere.
    Constant(f64),
    /// Varying.
    Kind(GradeKind),
}

/// How a number varies in space. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Grade", noun = "grade", family = BuildGrade, inherit)]
#[allow(missing_docs)] // The comment of each type says what it is.
pub enum GradeKind {
    Linear(Linear),
    Steps(Steps),
    Depth(depth::DepthKind),
    Radial(radial::RadialKind),
    Formula(formula::FormulaKind),
    Combined(formula::CombinedKind),
    Grid(grid::GridKind),
    Points(scattered::PointsKind),
    Field(FieldKind),
    Sigmoid(SigmoidKind),
    Region(region_step::WithinKind),
    Distance(polyline::DistanceKind),
    Rbf(rbf::RbfKind),
}

impl GradeSpec {
    /// The grade; its constants and stops have been checked.
    pub(crate) fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        match self {
            GradeSpec::Constant(v) => Ok(Grade::Constant(of.own(*v))),
            GradeSpec::Kind(kind) => kind.family().build(&of.below(kind.key())),
        }
    }
}

/// Refuses a direction of no length.
fn directed(key: &str, direction: Option<Vec3>) -> Result<(), Fault> {
    match direction.is_some_and(|d| norm(d) == 0.0) {
        true => Err(Fault::new(key, "the direction is zero; give one such as [0, 0, 1]")),
        false => Ok(()),
    }
}

/// A number that varies in space.
pub trait VaryingNumber: Field {
    /// The axes along which it may change: false, where moving along one leaves every bit as it is.
    fn varies(&self) -> [bool; 3] {
        [true; 3]
    }

    /// The position in a bounded box that is most likely to be an end of the numbers there: a node of a grid, otherwise the middle.
    fn likely_extreme(&self, b: &Aabb) -> Vec3 {
        b.center()
    }
}

/// A number that may vary in space. Its unit is that of its key.
#[derive(Clone)]
pub enum Grade {
    /// The same everywhere.
    Constant(f64),
    /// A function of position.
    Varying(Arc<dyn VaryingNumber>),
}

impl<V: VaryingNumber + 'static> From<V> for Grade {
    fn from(of: V) -> Grade {
        Grade::Varying(Arc::new(of))
    }
}

impl Grade {
    /// The value everywhere, if it does not vary.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Grade::Constant(v) => Some(*v),
            Grade::Varying(_) => None,
        }
    }

    /// The axes along which it may change: false, where moving along one leaves every bit as it is.
    pub fn varies(&self) -> [bool; 3] {
        match self {
            Grade::Constant(_) => [false; 3],
            Grade::Varying(of) => of.varies(),
        }
    }

    /// The position in a bounded box that is most likely to be an end of the numbers there.
    fn likely_extreme(&self, b: &Aabb) -> Vec3 {
        match self {
            Grade::Constant(_) => b.center(),
            Grade::Varying(of) => of.likely_extreme(b),
        }
    }

    /// Fills `out[i]` with the value at `points[i]` (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        match self {
            Grade::Constant(v) => out.fill(*v),
            Grade::Varying(of) => of.values(points, out),
        }
    }

    /// Fills values and gradients (per mm). At a stop, the gradient of the segment that begins there.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match self {
            Grade::Constant(v) => {
                values.fill(*v);
                gradients.fill([0.0; 3]);
            }
            Grade::Varying(of) => of.gradients(points, values, gradients),
        }
    }

    /// An interval that contains every value in the box (may be loose, never too small).
    pub fn bound(&self, b: &Aabb) -> Interval {
        match self {
            Grade::Constant(v) => Interval::new(*v, *v),
            Grade::Varying(of) => of.bound(b),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::region::{Region, Sphere};
    use geometry::fault::Fault;

    /// Distance to the unit sphere.
    fn ball() -> Region {
        Arc::new(Sphere::new([0.0; 3], 1.0).unwrap())
    }

    fn grid() -> Samples {
        let values = (0..48).map(|i| f64::from(i * 7 % 13)).collect();
        Samples::new([-1.0; 3], [0.7, 0.5, 1.0], [4, 4, 3], values).unwrap()
    }

    fn all() -> Vec<Grade> {
        let stops = || vec![[0.3, 0.1], [1.0, 0.6], [1.4, 0.2]];
        let chain = || vec![[-1.2, -0.4, 0.1], [0.3, 0.5, -0.8], [1.1, -0.7, 0.6], [-0.2, 1.0, 1.0]];
        let formula = |text: &str| Grade::from(Formula::parse(text).unwrap());
        let values = [0.4, -0.1, 0.9, 0.3];
        vec![
            Grade::Constant(0.3),
            Linear::new([0.5, -1.0, 2.0], vec![[-1.0, 0.2], [0.5, 0.9], [2.0, -0.4]]).unwrap().into(),
            Steps::new([0.5, -1.0, 2.0], vec![[-1.0, 0.2], [0.5, 0.9], [2.0, -0.4]]).unwrap().into(),
            Depth::new(ball(), vec![[0.0, 0.6], [0.4, 0.2], [0.8, 0.3]]).unwrap().into(),
            formula("0.3 + 0.1*sin(x/0.3) * y^2 - max(z, x)"),
            Radial::new([0.2, 0.1, 0.0], None, stops()).unwrap().into(),
            Radial::new([0.2, 0.1, 0.0], Some([0.6, 0.0, 0.8]), stops()).unwrap().into(),
            grid().into(),
            Remapped::new(grid(), Stops(vec![[2.0, 0.1], [7.0, 0.9], [10.0, 0.4]])).into(),
            Sigmoid::new(formula("x + y*z"), 0.2, 1.5).unwrap().into(),
            region_step(ball(), 0.7).unwrap().into(),
            Polyline::new(chain(), false, None, None).unwrap().into(),
            Polyline::new(chain(), true, Some([0.1, -0.2, 1.0]), None).unwrap().into(),
            Rbf::new(chain(), &values, Some(1.1), None).unwrap().into(),
            Product::of(formula("x + y*z - 0.1"), grid().into()),
            Combined::new(
                "max(a, 0.4*z) * (1 + sin(b)) - a^2/(2 + x^2)",
                vec![
                    ("a".into(), Depth::new(ball(), vec![[-0.6, 0.6], [0.4, 0.2], [0.8, 0.3]]).unwrap().into()),
                    ("b".into(), grid().into()),
                ],
            )
            .unwrap()
            .into(),
        ]
    }

    #[test]
    fn linear_is_exact_at_stops_between_and_beyond() {
        let g = Linear::new([0.0, 0.0, 2.0], vec![[0.0, 1.0], [4.0, 3.0]]).unwrap();
        let mut v = [0.0; 5];
        g.values(&[[9.0, 9.0, -1.0], [0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 7.0]], &mut v);
        assert_eq!(v, [1.0, 1.0, 2.0, 3.0, 3.0]);
    }

    #[test]
    fn depth_counts_from_the_surface_inwards() {
        let g = Depth::new(ball(), vec![[0.0, 0.6], [0.5, 0.2]]).unwrap();
        let mut v = [0.0; 4];
        g.values(&[[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.75, 0.0], [0.0, 0.0, 0.1]], &mut v);
        for (v, want) in v.iter().zip([0.6, 0.6, 0.4, 0.2]) {
            assert!((v - want).abs() < 1e-15);
        }
    }

    #[test]
    fn gradients_agree_with_differences_and_bounds_hold() {
        let mut seed = 12345;
        let mut next = || (geometry::random::random(&mut seed) + 1.0) / 2.0;
        for (k, g) in all().iter().enumerate() {
            for _ in 0..200 {
                let p = [next() * 3.0 - 1.5, next() * 3.0 - 1.5, next() * 3.0 - 1.5];
                let (mut v, mut d) = ([0.0], [[0.0; 3]]);
                g.gradients(&[p], &mut v, &mut d);
                let mut plain = [0.0];
                g.values(&[p], &mut plain);
                assert_eq!(plain, v);
                let size = next() * 0.5;
                let b = Aabb { min: p, max: p.map(|c| c + size) };
                let bound = g.bound(&b);
                for _ in 0..5 {
                    let q = [p[0] + size * next(), p[1] + size * next(), p[2] + size * next()];
                    g.values(&[q], &mut plain);
                    assert!(
                        bound.lo <= plain[0] && plain[0] <= bound.hi,
                        "grade {k} at {q:?}: {plain:?} not in {bound:?}"
                    );
                }
                for a in 0..3 {
                    let h = 1e-6;
                    let (mut lo, mut hi) = (p, p);
                    lo[a] -= h;
                    hi[a] += h;
                    let (mut w, mut e) = ([0.0; 2], [[0.0; 3]; 2]);
                    g.gradients(&[lo, hi], &mut w, &mut e);
                    // Across a crease the one-sided slopes differ: skip it.
                    if (e[0][a] - e[1][a]).abs() < 1e-2 {
                        assert!((d[0][a] - (w[1] - w[0]) / (2.0 * h)).abs() < 1e-4, "grade {k} at {p:?}, axis {a}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_unbounded_box_gives_the_whole_range() {
        let g = Linear::new([0.0, 0.0, 1.0], vec![[0.0, 0.2], [1.0, 0.7], [2.0, 0.1]]).unwrap();
        let b = g.bound(&Aabb::ALL);
        assert!((b.lo - 0.1).abs() < 1e-14 && (b.hi - 0.7).abs() < 1e-14, "{b:?}");
    }

    #[test]
    fn what_is_no_function_is_refused_by_its_key() {
        fn at<G>(made: Result<G, Fault>) -> Option<String> {
            made.err().map(|f| f.at)
        }
        let one = || vec![[0.0, 1.0]];
        assert_eq!(at(Linear::new([0.0; 3], one())).as_deref(), Some("along"));
        assert_eq!(at(Linear::new([f64::NAN, 0.0, 1.0], one())).as_deref(), Some("along[0]"));
        let z = [0.0, 0.0, 1.0];
        assert_eq!(at(Linear::new(z, vec![])).as_deref(), Some("stops"));
        assert_eq!(at(Linear::new(z, vec![[0.0, 1.0], [0.0, 2.0]])).as_deref(), Some("stops[1]"));
        assert_eq!(at(Linear::new(z, vec![[0.0, f64::NAN]])).as_deref(), Some("stops[0]"));
        let late = vec![[0.0, 1.0], [f64::INFINITY, 2.0]];
        assert_eq!(at(Depth::new(ball(), late)).as_deref(), Some("stops[1]"));
        assert_eq!(at(Radial::new([0.0; 3], Some([0.0; 3]), one())).as_deref(), Some("axis"));
        assert_eq!(at(Radial::new([f64::INFINITY; 3], None, one())).as_deref(), Some("center[0]"));
        assert_eq!(at(Sigmoid::new(Grade::Constant(0.0), 0.0, 0.0)).as_deref(), Some("width"));
        assert_eq!(at(region_step(ball(), -1.0)).as_deref(), Some("width"));
    }
}
