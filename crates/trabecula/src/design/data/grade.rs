//! Numbers that may vary, as data.

use super::super::grade::BuildGrade;
use crate::kind::{At, Defs, DesignError, Fault, Key, Kind, Node, OneOrThree, Value};
use crate::region::RegionKind;
use geometry::fault::{counted, number};

/// A number that may vary in space.
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
    Linear(LinearSpec),
    Depth(DepthSpec),
    Radial(RadialSpec),
    Formula(FormulaSpec),
    Grid(GridSpec),
    Points(PointsSpec),
    Field(FieldSpec),
    Sigmoid(SigmoidSpec),
    Region(WithinSpec),
    Distance(DistanceSpec),
    Rbf(RbfSpec),
}

/// Positions and the values taken there, positions rising; linear between, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Stops(pub Vec<[f64; 2]>);

impl Kind for Stops {
    const DOC: &'static str = "Positions and the values taken there.";

    fn expected() -> String {
        "a list of [position, value]".into()
    }

    fn fits(node: &Node) -> u8 {
        Vec::<[f64; 2]>::fits(node)
    }

    fn read(at: &At) -> Result<Self, DesignError> {
        let stops = at.list(&Self::expected())?;
        let stops = stops.iter().map(|s| s.numbers("[position, value]")).collect::<Result<Vec<_>, _>>()?;
        if stops.is_empty() {
            return Err(at.error("no stops given; give at least one [position, value]"));
        }
        Ok(Stops(stops))
    }

    fn write(&self) -> Node {
        self.0.write()
    }

    /// The limits of `key` are those of the values.
    fn check(&self, key: &Key) -> Result<(), Fault> {
        let mut last = f64::NEG_INFINITY;
        for (i, &[at, value]) in self.0.iter().enumerate() {
            let here = |f: Fault| f.under(&format!("[{i}]"));
            Key::NONE.admit(at).map_err(here)?;
            if at <= last {
                let message =
                    format!("positions must rise from stop to stop, found {} after {}", number(at), number(last));
                return Err(here(Fault::new("", message).found(number(at))));
            }
            last = at;
            key.admit_at(value, &format!(" at position {}", number(at))).map_err(here)?;
        }
        Ok(())
    }

    fn schema(_: &Key, defs: &mut Defs) -> Node {
        let pairs = Vec::<[f64; 2]>::schema(&Key { least: 1, ..Key::NONE }, defs);
        pairs.with("x-type", "Stops".into())
    }
}

/// Along a direction: piecewise linear in s = along · x, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Linear", noun = "a linear grade", check = LinearSpec::directed)]
pub struct LinearSpec {
    /// The direction [x, y, z]; s is measured in multiples of its length.
    pub along: [f64; 3],
    /// Pairs [s, value], s rising.
    #[kind(inherit)]
    pub stops: Stops,
}

impl LinearSpec {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        nonzero("along", self.along)
    }
}

/// Refuses a direction that is none.
fn nonzero(key: &str, direction: [f64; 3]) -> Result<(), Fault> {
    match geometry::math::norm(direction) == 0.0 {
        true => Err(Fault::new(key, "the direction is zero; give one such as [0, 0, 1]")),
        false => Ok(()),
    }
}

fn maybe_nonzero(key: &str, direction: Option<[f64; 3]>) -> Result<(), Fault> {
    direction.map_or(Ok(()), |d| nonzero(key, d))
}

/// By depth below the region's surface: piecewise linear, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Depth", noun = "a grade by depth")]
pub struct DepthSpec {
    /// Pairs [depth in mm, value], depth rising.
    #[kind(inherit)]
    pub stops: Stops,
}

/// By the distance from a point or a line: piecewise linear, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Radial", noun = "a radial grade", check = RadialSpec::directed)]
pub struct RadialSpec {
    /// Pairs [distance in mm, value], distance rising.
    #[kind(inherit)]
    pub stops: Stops,
    /// The point, or a point on the line.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub center: [f64; 3],
    /// Direction of the line; without it, distances are from the point.
    pub axis: Option<[f64; 3]>,
}

impl RadialSpec {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        maybe_nonzero("axis", self.axis)
    }
}

/// A formula in x, y, z (mm), such as "0.3 + 0.1*sin(x/5)"; parsed, never run as code.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Formula")]
pub struct FormulaSpec(pub String);

/// Numbers on a grid, from a file; linear between them.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Grid", noun = "a grade on a grid")]
pub struct GridSpec {
    /// Path of the file (npy, vti, vtk), relative to the design file; or of grey pictures one above the other (png, tif), where
    /// a * in the last part stands for anything: "scan/*.png". Columns run along x, rows along y, pictures along z.
    pub path: String,
    /// Position of the first number, of pictures the middle of the first pixel. VTI and VTK files contain it.
    #[kind(unit = "mm")]
    pub origin: Option<[f64; 3]>,
    /// Distance between numbers, one or three. VTI and VTK files contain it.
    #[kind(unit = "mm")]
    pub step: Option<OneOrThree>,
    /// Name of the array, where a file has several.
    pub array: Option<String>,
    /// What the numbers stand for: pairs [number, value], number rising, linear between.
    pub remap: Option<Stops>,
}

/// Numbers at scattered points, from a file: the mean of the nearest, weighted by one over the square of the distance.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Points", noun = "a grade at points")]
pub struct PointsSpec {
    /// Path of a table (csv) of x, y, z (mm), value, relative to the design file.
    pub path: String,
    /// Number of nearest points that count.
    #[kind(default = 8, min = 1.0, max = 64.0)]
    pub neighbours: u32,
    /// What the numbers stand for: pairs [number, value], number rising, linear between.
    pub remap: Option<Stops>,
}

/// An array of a result on a mesh of volume elements, from a file.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Field", noun = "a field of a result")]
pub struct FieldSpec {
    /// Path of the file (vtu, vtk, vti), relative to the design file. Coordinates are mm.
    pub path: String,
    /// Name of the array, of points or cells.
    pub array: String,
    /// Which of its components, from 0, where it has several.
    pub component: Option<u32>,
    /// What the numbers stand for: pairs [number, value], number rising, linear between.
    pub remap: Option<Stops>,
}

/// A smooth step from 0 to 1 of another number: the logistic function, with ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Sigmoid", noun = "a smooth step", check = SigmoidSpec::wide)]
pub struct SigmoidSpec {
    /// The number that it is a step of.
    pub of: Box<GradeSpec>,
    /// From where it is 0 to where it is 1, in the unit of the number; a negative width falls.
    pub width: f64,
    /// Where it is one half.
    #[kind(default = 0.0)]
    pub at: f64,
}

impl SigmoidSpec {
    fn wide(&self, _: &Key) -> Result<(), Fault> {
        wide(self.width)
    }
}

fn wide(width: f64) -> Result<(), Fault> {
    match width == 0.0 || width.is_subnormal() {
        true => Err(Fault::new("width", "the width is 0; a step needs room to rise in").found(number(width))),
        false => Ok(()),
    }
}

/// 1 inside a region and 0 outside, with a smooth step at its surface.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Within", noun = "a region as a number", check = WithinSpec::wide)]
pub struct WithinSpec {
    /// The region.
    pub of: Box<RegionKind>,
    /// Width of the step, half of it on either side of the surface.
    #[kind(unit = "mm", above = 0.0)]
    pub width: f64,
}

impl WithinSpec {
    fn wide(&self, _: &Key) -> Result<(), Fault> {
        wide(self.width)
    }
}

/// Distance to a chain of straight segments through control points.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Distance", noun = "a distance to a line", check = DistanceSpec::directed)]
pub struct DistanceSpec {
    /// The corners of the line, in order.
    #[kind(flatten)]
    pub points: ControlSpec,
    /// Whether the last is joined to the first.
    #[kind(default = false)]
    pub closed: bool,
    /// Direction of projection: the distance is that from a wall through the line along it. Inside a closed line it is negative.
    pub axis: Option<[f64; 3]>,
    /// The smooth form instead of the exact distance: off by at most 0.2785/sharpness of the longest segment, without a sign.
    #[kind(min = 10.0)]
    pub sharpness: Option<f64>,
}

impl DistanceSpec {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        maybe_nonzero("axis", self.axis)
    }
}

/// Gaussian radial basis functions through control points: the sum of β exp(−r²/δ²).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Rbf", noun = "radial basis functions", check = RbfSpec::complete)]
pub struct RbfSpec {
    /// The control points.
    #[kind(flatten)]
    pub points: ControlSpec,
    /// The values taken at the points: 1 at all unless given here or as a fourth column of the file.
    pub values: Option<Vec<f64>>,
    /// δ; one and a half times the mean distance of a point from its nearest neighbour unless given.
    #[kind(unit = "mm", above = 0.0)]
    pub delta: Option<f64>,
    /// Direction of projection, so that a point stands for a line.
    pub axis: Option<[f64; 3]>,
}

impl RbfSpec {
    fn complete(&self, _: &Key) -> Result<(), Fault> {
        if let (Some(values), ControlSpec::Points(points)) = (&self.values, &self.points)
            && values.len() != points.len()
        {
            let message =
                format!("{} for {}; give one for each", counted(values.len(), "value"), counted(points.len(), "point"));
            return Err(Fault::new("values", message));
        }
        maybe_nonzero("axis", self.axis)
    }
}

/// Control points: here, or in a file.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "list of control points")]
pub enum ControlSpec {
    /// The points [x, y, z], mm.
    #[kind(unit = "mm")]
    Points(Vec<[f64; 3]>),
    /// Path of a table (csv) of x, y, z (mm), relative to the design file.
    Path(String),
}

/// A value that is one number: what may not vary says so.
pub(in crate::design) fn constant(at: &At, message: &str) -> Result<(), DesignError> {
    let varies = |at: &At| matches!(at.node.value, Value::Table(_));
    match at.is_list() {
        true => at.list("")?.iter().find(|i| varies(i)).map_or(Ok(()), |i| Err(i.error(message))),
        false if varies(at) => Err(at.error(message)),
        false => Ok(()),
    }
}
