//! A region repeated in rows and about an axis.

use std::sync::Arc;

use super::moved::{moved, turned};
use super::{BuildRegion, Context, Region, RegionKind, Union, bodies};
use crate::kind::{Key, Kind};
use geometry::fault::{Fault, counted};
use geometry::math::{IDENTITY, Vec3, scale};
use geometry::similarity::Similarity;

/// Most copies of a region.
const MOST: u32 = 10_000;
/// Most triangles of all copies of a mesh: they are made one mesh.
const MOST_TRIANGLES: usize = 5_000_000;

/// Copies of a region, in up to three rows or about an axis, or both: each copy about the axis is then repeated in rows.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Repeated", noun = "a repeated region", check = RepeatedKind::some)]
pub struct RepeatedKind {
    /// The region that is repeated: the first copy.
    of: Box<RegionKind>,
    /// Rows, up to three, such as [{ by = [10, 0, 0], count = 5 }]: two make a grid.
    #[kind(default)]
    along: Vec<RowKind>,
    /// About an axis, such as { count = 6 }.
    around: Option<RingKind>,
}

/// A row of copies.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Row", noun = "a row", check = RowKind::long)]
pub struct RowKind {
    /// Displacement of each copy from the last.
    #[kind(unit = "mm", hints("step", "spacing", "pitch"))]
    by: Vec3,
    /// Number of copies, the first counted.
    #[kind(min = 1.0, max = 1e4)]
    count: u32,
}

/// Copies about an axis.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Ring", noun = "copies about an axis", check = RingKind::turning)]
pub struct RingKind {
    /// Number of copies, the first counted.
    #[kind(min = 1.0, max = 1e4)]
    count: u32,
    /// Direction of the axis; its length does not matter.
    #[kind(default = [0.0, 0.0, 1.0])]
    axis: Vec3,
    /// A point on the axis.
    #[kind(unit = "mm", default = [0.0; 3], hints("center", "origin"))]
    about: Vec3,
    /// Angle from each copy to the next about the axis, by the right-hand rule; 360 over the count unless given.
    #[kind(unit = "degrees", min = -360.0, max = 360.0)]
    angle: Option<f64>,
}

impl RowKind {
    fn long(&self, _: &Key) -> Result<(), Fault> {
        match self.by == [0.0; 3] && self.count > 1 {
            true => Err(Fault::new("by", "[0, 0, 0] mm leaves all copies in one position; give their displacement")),
            false => Ok(()),
        }
    }
}

impl RingKind {
    fn turning(&self, _: &Key) -> Result<(), Fault> {
        match self.angle == Some(0.0) && self.count > 1 {
            true => Err(Fault::new("angle", "0 degrees leave all copies in one position; give the angle between them")),
            false => Ok(()),
        }
    }
}

impl RepeatedKind {
    fn some(&self, _: &Key) -> Result<(), Fault> {
        if self.along.is_empty() && self.around.is_none() {
            let message = "give along, such as [{ by = [10, 0, 0], count = 5 }], or around, such as { count = 6 }";
            return Err(Fault::new("", message));
        }
        if self.along.len() > 3 {
            let found = self.along.len();
            return Err(Fault::new("along", format!("{found} rows; at most 3")).found(found.to_string()));
        }
        let rows = self.along.iter().map(|r| f64::from(r.count)).product::<f64>();
        let count = rows * self.around.map_or(1.0, |r| f64::from(r.count));
        match count > f64::from(MOST) {
            true => Err(Fault::new("", format!("{count:.0} copies; at most {MOST}")).found(format!("{count:.0}"))),
            false => Ok(()),
        }
    }

    /// Where the copies are. Errors name the key.
    fn places(&self) -> Result<Vec<Similarity>, Fault> {
        let mut places = vec![Similarity::new(1.0, IDENTITY, [0.0; 3], [0.0; 3])];
        if let Some(RingKind { count, axis, about, angle }) = self.around {
            let each = |k: u32| {
                // Multiples of a quarter turn are exact.
                let degrees = angle.map_or(360.0 * f64::from(k) / f64::from(count), |a| a * f64::from(k));
                let turn = turned("around.axis", axis, degrees)?;
                Ok(Similarity::new(1.0, turn, about, [0.0; 3]))
            };
            places = (0..count).map(each).collect::<Result<_, Fault>>()?;
        }
        for row in &self.along {
            let next = |k: u32| Similarity::new(1.0, IDENTITY, [0.0; 3], scale(row.by, f64::from(k)));
            places = (0..row.count).flat_map(|k| places.iter().map(move |p| next(k).after(p))).collect();
        }
        Ok(places)
    }
}

impl BuildRegion for RepeatedKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        self.valid()?;
        let places = self.places()?;
        let of = context.below("of", |context| self.of.build(context))?;
        let triangles = of.as_mesh().map_or(0, |m| m.mesh().triangles.len()).saturating_mul(places.len());
        if triangles > MOST_TRIANGLES {
            let [triangles, most] = [triangles, MOST_TRIANGLES].map(|n| counted(n, "triangle"));
            let message = format!("{} copies of this mesh have {triangles}; at most {most}", places.len());
            return Err(Fault::new("", message));
        }
        let copies = places.iter().map(|by| moved(&of, by)).collect::<Result<Vec<Region>, Fault>>()?;
        bodies::warn(&copies, "copies", context);
        Ok(Arc::new(Union::new(copies)?))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
