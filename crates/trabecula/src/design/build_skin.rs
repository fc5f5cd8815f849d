//! Skin and keep zones, which are solid for any lattice: data to solids.

use std::cell::RefCell;
use std::sync::Arc;

use super::skin_kind::{OpenPlace, OpenSpec, SkinSpec};
use super::varied::Varied;
use super::{Design, Loader, sample};
use crate::csg_tree::CsgSolid;
use crate::environment::{self, Environment};
use crate::field::Field;
use crate::grade::{Quantity, key_of};
use crate::kind::{DesignError, Warning};
use crate::region::{FaceSet, HalfSpace, Intersection, Notes, OpenSurface, Region, joint};
use crate::skin::{outside, skin};
use geometry::fault::number;
use geometry::math::Vec3;

/// The skin and the keep zones, and the least thickness of the skin. `points` are inside the region `region`.
pub(super) fn filled(
    d: &Design,
    region: &Region,
    points: &[Vec3],
    loader: &dyn Loader,
    notes: &RefCell<Notes>,
) -> Result<(Vec<CsgSolid>, Option<f64>), DesignError> {
    let mut filled = Vec::new();
    let mut thinnest = None;
    if let Some(spec) = &d.skin {
        let environment = Environment { path: "skin".into(), region, points, filled: &[], loader, notes };
        let (body, least) = grown(spec, &environment)?;
        filled.push(body);
        thinnest = Some(least);
    }
    for (name, spec) in &d.keep.0 {
        let path = format!("keep.{name}");
        let zone = environment::region(spec, &path, loader, Some(region), notes)?;
        check_zone(&zone, region, points, &path, "the part would be solid")?;
        let mut surfaces = Vec::new();
        let tree = zone.surfaces(0.0, &mut surfaces);
        filled.push(CsgSolid { surfaces, tree });
    }
    let fields: Vec<&dyn Field> = filled.iter().map(|body| body as &dyn Field).collect();
    if fields.len() > 1 && !is_open(&fields, region, points) {
        let (path, what) = if d.skin.is_some() {
            ("skin", "the skin and the keep zones")
        } else {
            ("keep", "the keep zones together")
        };
        let message = format!("{what} fill the whole region: the part would be solid");
        return Err(DesignError::new(path, message));
    }
    Ok((filled, thinnest))
}

/// Whether any sample point of the region is outside all of these.
fn is_open(filled: &[&dyn Field], region: &Region, points: &[Vec3]) -> bool {
    let open = |points: &[Vec3]| {
        let (mut least, mut v) = (vec![f64::INFINITY; points.len()], vec![0.0; points.len()]);
        for body in filled {
            body.values(points, &mut v);
            least.iter_mut().zip(&v).for_each(|(l, v)| *l = l.min(*v));
        }
        least.iter().any(|v| *v > 0.0)
    };
    // Too few samples for a small cavity: sampled more finely before a refusal.
    open(points) || open(&sample::inside(region, 50 * sample::COUNT).0)
}

/// The skin and its least thickness.
fn grown(spec: &SkinSpec, environment: &Environment) -> Result<(CsgSolid, f64), DesignError> {
    let Environment { region, points, .. } = *environment;
    let path = "skin.thickness";
    let thickness = spec.thickness.build(&Quantity::new(path, environment, key_of::<SkinSpec>("thickness")))?;
    let bounds = region.bounds();
    let (mut faces, mut places, mut openings) = (Vec::new(), Vec::new(), Vec::new());
    for (i, open) in spec.open.iter().enumerate() {
        let path = format!("skin.open[{i}]");
        let face: OpenSurface = match open {
            OpenSpec::Place(OpenPlace::Faces(of)) => {
                let named = FaceSet::new(Some(region), &of.faces);
                OpenSurface::Faces(named.map_err(|f| DesignError::fault(&format!("{path}.faces"), f))?)
            }
            OpenSpec::Place(OpenPlace::Region(r)) => {
                let path = format!("{path}.region");
                let opening = environment.region(&r.region, &path)?;
                check_zone(&opening, region, points, &path, "there would be no skin")?;
                openings.push(opening);
                continue;
            }
            OpenSpec::Place(OpenPlace::Plane(h)) => environment::half_space(h, &path)?.into(),
            OpenSpec::Side(side) => {
                let (axis, upper) = side.axis();
                let mut normal = [0.0; 3];
                normal[axis] = if upper { 1.0 } else { -1.0 };
                let point = if upper { bounds.max } else { bounds.min };
                HalfSpace::new(point, normal).map_err(|f| DesignError::fault("skin.open", f))?.into()
            }
        };
        faces.push(face);
        places.push(path);
    }
    let width = Varied::of_grade(&thickness, environment);
    if let Some(place) = joint(region, points, width.max, width.max) {
        let message = format!("the skin is a wall {place}");
        environment.notes.borrow_mut().warnings.push(Warning { path: path.into(), message });
    }
    let deepest = || {
        let mut depth = vec![0.0; points.len()];
        region.values(points, &mut depth);
        depth.iter().fold(0.0f64, |m, d| m.max(-d))
    };
    let too_thick = || {
        let message = format!(
            "a skin of {width} mm is thicker than the region: the part would be solid. Its deepest point is {:.4} mm below its surface; \
             give less than that",
            deepest()
        );
        DesignError::new(path, message)
    };
    let body = skin(region, &thickness, &faces).map_err(|f| match f.at.strip_prefix("open[") {
        // So deep the region has no faces.
        Some(_) if width.min >= deepest() => too_thick(),
        // Faces are numbered among themselves.
        Some(n) => {
            DesignError::new(n.trim_end_matches(']').parse().map_or("skin.open", |n: usize| &places[n]), f.message)
        }
        None => DesignError::fault("skin", f),
    })?;
    let body = openings.iter().fold(body, outside);
    if !is_open(&[&body], region, points) {
        return Err(too_thick());
    }
    Ok((body, width.min))
}

/// Refuses a zone that is disjoint from the region or contains all of it.
fn check_zone(zone: &Region, region: &Region, points: &[Vec3], path: &str, then: &str) -> Result<(), DesignError> {
    if !is_open(&[&**zone], region, points) {
        let message = format!("it holds the whole region: {then}");
        return Err(DesignError::new(path, message));
    }
    let mut distance = vec![0.0; points.len()];
    zone.values(points, &mut distance);
    if distance.iter().any(|d| *d < 0.0) {
        return Ok(());
    }
    let both = Intersection::new(vec![region.clone(), zone.clone()]);
    let both: Region = Arc::new(both.map_err(|f| DesignError::fault(path, f))?);
    let (b, r) = (zone.bounds(), region.bounds());
    if b.is_empty() {
        return Err(DesignError::new(path, "it is empty"));
    }
    if !both.bounds().is_empty() && !sample::inside(&both, sample::COUNT).0.is_empty() {
        return Ok(());
    }
    let corner = |v: Vec3| v.map(number).join(", ");
    let apart = distance.iter().fold(f64::INFINITY, |m, d| m.min(*d));
    let message = format!(
        "it lies outside the region, about {apart:.3} mm away: it reaches from ({}) to ({}) mm, the region from ({}) \
         to ({}) mm",
        corner(b.min),
        corner(b.max),
        corner(r.min),
        corner(r.max)
    );
    Err(DesignError::new(path, message))
}
