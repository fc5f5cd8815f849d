//! A region mirrored, scaled, turned and moved.

use std::sync::Arc;

use super::primitive::{coordinate_axis, direction};
use super::{BuildRegion, Context, HalfSpace, Region, RegionKind, SignedDistance};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::{Key, Kind};
use geometry::fault::{Fault, number};
use geometry::math::{self, Aabb, IDENTITY, Interval, Mat3, Vec3, product, rotation, sin_cos_turns, transpose};
use geometry::similarity::Similarity;

/// Most degrees of an angle: beyond, whole turns cost digits.
const MOST_DEGREES: f64 = 1e6;
/// The share of a region's size that the rounding of its coordinates may be.
const ROUNDING: f64 = 1e-9;

/// A region that is mirrored, scaled and turned about a point and then moved, in this order.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Moved", noun = "a moved region", check = MovedKind::one_rotation)]
pub struct MovedKind {
    /// The region.
    of: Box<RegionKind>,
    /// Displacement, after all else.
    #[kind(unit = "mm", default = [0.0; 3], hints("translate", "translation", "offset", "shift", "move"))]
    by: Vec3,
    /// Angles about x, y, z: z is turned first, then y, then x.
    #[kind(unit = "degrees", default = [0.0; 3], min = -MOST_DEGREES, max = MOST_DEGREES, hints("rotation", "turn"))]
    rotate: Vec3,
    /// Direction about which it is turned by `angle`, in place of `rotate`; its length does not matter.
    axis: Option<Vec3>,
    /// Angle about `axis`, by the right-hand rule.
    #[kind(unit = "degrees", min = -MOST_DEGREES, max = MOST_DEGREES)]
    angle: Option<f64>,
    /// The point that stays where it is when the region is mirrored, scaled and turned.
    #[kind(unit = "mm", default = [0.0; 3], hints("center", "origin", "pivot"))]
    about: Vec3,
    /// Normal of the plane through `about` in which it is mirrored: "x", "y", "z" or a direction.
    #[kind(hints("reflect", "flip"))]
    mirror: Option<NormalKind>,
    /// Factor on all lengths.
    #[kind(above = 0.0, default = 1.0, hints("factor", "size"))]
    scale: f64,
}

/// The normal of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Normal", untagged, noun = "\"x\", \"y\", \"z\" or a direction as three numbers")]
pub enum NormalKind {
    /// A coordinate axis.
    Axis(AxisName),
    /// A direction of any length.
    Direction(Vec3),
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(name = "Axis", noun = "axis")]
pub enum AxisName {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

impl NormalKind {
    fn direction(self) -> Vec3 {
        match self {
            NormalKind::Axis(axis) => IDENTITY[axis as usize],
            NormalKind::Direction(d) => d,
        }
    }
}

impl MovedKind {
    fn one_rotation(&self, _: &Key) -> Result<(), Fault> {
        match (self.axis, self.angle) {
            (None, None) => Ok(()),
            (Some(_), None) => Err(Fault::new("angle", "axis is given without an angle; give angle, in degrees")),
            (None, Some(_)) => Err(Fault::new("axis", "angle is given without an axis; give axis, such as [0, 0, 1]")),
            _ if self.rotate != [0.0; 3] => {
                Err(Fault::new("rotate", "rotate and axis with angle are two rotations; give one of them"))
            }
            _ => Ok(()),
        }
    }

    /// The transform. Errors name the key.
    fn similarity(&self) -> Result<Similarity, Fault> {
        let turn: Mat3 = match (self.axis, self.angle) {
            (Some(axis), Some(angle)) => turned("axis", axis, angle)?,
            _ => rotation(self.rotate),
        };
        let turn = match self.mirror {
            Some(normal) => product(&turn, &mirrored("mirror", normal.direction())?),
            None => turn,
        };
        Ok(Similarity::new(self.scale, turn, self.about, self.by))
    }
}

impl BuildRegion for MovedKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        self.valid()?;
        let by = self.similarity()?;
        let of = context.below("of", |context| self.of.build(context))?;
        moved(&of, &by)
    }
}

/// The rotation by an angle (degrees) about an axis of any length; exact about coordinate axes at quarter turns. `at` names the
/// axis in a fault.
pub(super) fn turned(at: &str, axis: Vec3, degrees: f64) -> Result<Mat3, Fault> {
    let n = direction(at, axis)?;
    if let Some(a) = coordinate_axis(n) {
        let mut angles = [0.0; 3];
        angles[a] = n[a] * degrees;
        return Ok(rotation(angles));
    }
    let by = sin_cos_turns(degrees / 360.0);
    Ok(transpose(&IDENTITY.map(|e| math::turned(e, n, by))))
}

/// The reflection in a plane through the origin of this normal, of any length. `at` names it in a fault.
pub(super) fn mirrored(at: &str, normal: Vec3) -> Result<Mat3, Fault> {
    let n = direction(at, normal)?;
    Ok([0, 1, 2].map(|i| [0, 1, 2].map(|j| IDENTITY[i][j] - 2.0 * n[i] * n[j])))
}

/// The image of a region. Errors if rounding would be seen in its shape.
pub(super) fn moved(of: &Region, by: &Similarity) -> Result<Region, Fault> {
    if by.is_identity() {
        return Ok(of.clone());
    }
    let bounds = by.bounds(&of.bounds());
    if bounds.is_finite() && !bounds.is_empty() {
        let reach = bounds.min.iter().chain(&bounds.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let size = bounds.size().into_iter().fold(0.0, f64::max);
        if f64::EPSILON * reach > ROUNDING * size {
            return Err(lost(reach, size));
        }
    }
    of.clone().moved(by)
}

/// The refusal of a shape that would be lost to rounding.
pub(super) fn lost(reach: f64, size: f64) -> Fault {
    let [reach, size] = [reach, size].map(number);
    let message = format!(
        "the result would reach coordinates of {reach} mm at a size of {size} mm, where f64 rounds its shape; move it less, or scale \
         it less"
    );
    Fault::new("", message)
}

/// The image of any shape: s d(T⁻¹ x).
///
/// Most kinds are their own image, with other numbers. What is left are those whose faces are normal to the axes and no longer are,
/// such as a box.
pub(super) struct Moved {
    of: Region,
    field: MovedField,
}

impl Moved {
    pub fn new(of: Region, by: &Similarity) -> Moved {
        Moved { field: MovedField { of: of.clone(), by: *by }, of }
    }
}

impl Field for Moved {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.field.values(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.field.gradients(points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.field.bound(b)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl SignedDistance for Moved {
    fn bounds(&self) -> Aabb {
        self.field.by.bounds(&self.of.bounds())
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        let (first, mut own) = (out.len(), Vec::new());
        let tree = self.of.clone().surfaces(by / self.field.by.scale(), &mut own);
        for surface in own {
            push_image(surface, &self.field.by, out);
        }
        tree.renumbered(first)
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        self.of.clone().moved(&by.after(&self.field.by))
    }

    fn is_searched(&self) -> bool {
        self.of.is_searched()
    }

    fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
        let sides = self.of.half_spaces()?;
        Some(sides.iter().map(|side| side.image(&self.field.by)).collect())
    }

    fn volume(&self) -> Option<f64> {
        self.of.volume().map(|v| v * self.field.by.scale().powi(3))
    }
}

/// The image of a field that is a distance.
struct MovedField {
    of: Arc<dyn Field>,
    by: Similarity,
}

impl MovedField {
    fn back(&self, points: &[Vec3]) -> Vec<Vec3> {
        points.iter().map(|p| self.by.back(*p)).collect()
    }
}

impl Field for MovedField {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.of.values(&self.back(points), out);
        out.iter_mut().for_each(|v| *v *= self.by.scale());
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.of.gradients(&self.back(points), values, gradients);
        values.iter_mut().for_each(|v| *v *= self.by.scale());
        gradients.iter_mut().for_each(|g| *g = self.by.direction(*g));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let r = self.of.bound(&self.by.back_bounds(b));
        Interval::new(r.lo * self.by.scale(), r.hi * self.by.scale())
    }
}

/// Adds the image of a surface that is a distance.
fn push_image(of: Surface, by: &Similarity, out: &mut Vec<Surface>) {
    match of.plane {
        Some(plane) => drop(Arc::new(HalfSpace::of_plane(plane).image(by)).surfaces(0.0, out)),
        None => {
            let field = Arc::new(MovedField { of: of.field, by: *by });
            out.push(Surface { field, pair: None, creases: Arc::default(), mesh: None, ..of });
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
