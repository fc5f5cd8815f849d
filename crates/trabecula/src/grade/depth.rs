//! A grade by depth below a surface.

use std::sync::Arc;

use super::{BuildGrade, Grade, Quantity, Stops, VaryingNumber};
use crate::field::Field;
use crate::kind::{DesignError, Kind, Warning};
use crate::region::{DistanceTable, Region, RegionKind, joint};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, scale};

/// By depth below a surface: piecewise linear, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Depth", noun = "a grade by depth")]
pub struct DepthKind {
    /// Another region whose surface is meant, such as that of a bore or a bearing face; depth is negative outside it. The design's own
    /// unless given.
    of: Option<Box<RegionKind>>,
    /// Pairs [depth in mm, value], depth rising.
    #[kind(inherit)]
    stops: Stops,
}

impl BuildGrade for DepthKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let region = match &self.of {
            Some(kind) => of.environment.region(kind, &format!("{}.of", of.path))?,
            None => of.environment.region.clone(),
        };
        let depth = Depth::of(region.clone(), of.stops(self.stops.clone()));
        let last = depth.stops.ends().hi;
        if let Some(place) = joint(&region, of.environment.points, last, last) {
            let message = format!("depth falls to 0 {place}");
            of.environment.notes.borrow_mut().warnings.push(Warning { path: of.path.clone(), message });
        }
        Ok(depth.into())
    }
}

/// Piecewise linear in the depth (mm) below the surface of a region, constant beyond the first and last stop.
///
/// Depth below the surface of a mesh is interpolated in a [`DistanceTable`].
#[derive(Clone)]
pub struct Depth {
    /// Signed distance, mm.
    distance: Arc<dyn Field>,
    stops: Stops,
}

impl Depth {
    /// Below the surface of `region`; stops `[depth, value]`.
    ///
    /// # Errors
    /// Stops that are none, not finite or not rising in depth.
    pub fn new(region: Region, stops: Vec<[f64; 2]>) -> Result<Depth, Fault> {
        let kind = DepthKind { of: None, stops: Stops(stops) };
        kind.valid()?;
        Ok(Depth::of(region, kind.stops))
    }

    /// The same of checked stops.
    fn of(region: Region, stops: Stops) -> Depth {
        let distance: Arc<dyn Field> = match region.is_searched() && region.bounds().is_finite() {
            true => Arc::new(DistanceTable::new(region, -stops.ends())),
            false => region,
        };
        Depth { distance, stops }
    }
}

impl Field for Depth {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.distance.values(points, out);
        for o in out.iter_mut() {
            *o = self.stops.at(-*o).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.distance.gradients(points, values, gradients);
        for (v, g) in values.iter_mut().zip(gradients) {
            let (value, slope) = self.stops.at(-*v);
            (*v, *g) = (value, scale(*g, -slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.stops.range(-self.distance.bound(b))
    }
}

impl VaryingNumber for Depth {}
