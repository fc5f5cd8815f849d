//! Regions: data to signed distance.

use std::sync::Arc;

use super::data::*;
use super::error::DesignError;
use super::place::finite;
use super::{Loader, Warning};
use crate::region::{
    Cuboid, Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Offset, Region, Shape, Sphere, Tetrahedron,
    Union,
};
use geometry::fault::{Fault, number};
use geometry::formats;
use geometry::math::{add, scale, sub};
use geometry::repair::{Repair, Repaired};

/// A mesh without a unit that is smaller than this (mm) is asked about: no part with a lattice in it is.
const SMALL: f64 = 1.0;

/// Boxes looked at before two regions are taken to touch.
const BOXES: usize = 2000;

/// What building a region has to tell beside the region.
#[derive(Debug, Default)]
pub(super) struct Notes {
    /// What may not be meant.
    pub warnings: Vec<Warning>,
    /// What was repaired in each mesh, by the path of its table.
    pub repairs: Vec<(String, Repaired)>,
}

/// Mesh formats a region may come from.
const FORMATS: [&str; 5] = ["stl", "obj", "ply", "off", "3mf"];

pub(super) fn region(
    spec: &RegionSpec,
    path: &str,
    loader: &dyn Loader,
    notes: &mut Notes,
) -> Result<Region, DesignError> {
    match spec {
        RegionSpec::Box(b) => cuboid(b, &format!("{path}.box")),
        RegionSpec::Cylinder(c) => {
            let path = format!("{path}.cylinder");
            three(&path, "base", c.base)?;
            three(&path, "axis", c.axis)?;
            positive(&path, "radius", c.radius)?;
            positive(&path, "height", c.height)?;
            shared(&path, Cylinder::new(c.base, c.axis, c.radius, c.height))
        }
        RegionSpec::Sphere(s) => {
            let path = format!("{path}.sphere");
            three(&path, "center", s.center)?;
            positive(&path, "radius", s.radius)?;
            shared(&path, Sphere::new(s.center, s.radius))
        }
        RegionSpec::Tetrahedron(t) => {
            let path = format!("{path}.tetrahedron");
            shared(&path, Tetrahedron::new(t.corners, t.sharpness))
        }
        RegionSpec::HalfSpace(h) => {
            let path = format!("{path}.halfspace");
            Ok(Arc::new(halfspace(h, &path)?))
        }
        RegionSpec::Mesh(m) => mesh(m, &format!("{path}.mesh"), loader, notes),
        RegionSpec::Union(of) => {
            let whole = path == "region";
            let path = format!("{path}.union");
            let of = several(of, &path, loader, notes)?;
            let groups = if whole { groups(&of) } else { 1 };
            if groups > 1 {
                let message =
                    format!("these {} regions are {groups} bodies that do not touch: the part is in pieces", of.len());
                let path = path.clone();
                notes.warnings.push(Warning { path, message });
            }
            shared(&path, Union::new(of))
        }
        RegionSpec::Intersection(of) => {
            let path = format!("{path}.intersection");
            shared(&path, Intersection::new(several(of, &path, loader, notes)?))
        }
        RegionSpec::Difference(of) => {
            let path = format!("{path}.difference");
            shared(&path, Difference::new(several(of, &path, loader, notes)?))
        }
        RegionSpec::Offset(o) => {
            let path = format!("{path}.offset");
            finite(&format!("{path}.by"), o.by)?;
            shared(&path, Offset::new(region(&o.of, &format!("{path}.of"), loader, notes)?, o.by))
        }
    }
}

pub(super) fn halfspace(h: &HalfSpaceSpec, path: &str) -> Result<HalfSpace, DesignError> {
    three(path, "point", h.point)?;
    three(path, "normal", h.normal)?;
    HalfSpace::new(h.point, h.normal).map_err(|f| DesignError::fault(path, f))
}

fn shared<S: Shape + 'static>(path: &str, made: Result<S, Fault>) -> Result<Region, DesignError> {
    made.map(|s| Arc::new(s) as Region).map_err(|f| DesignError::fault(path, f))
}

/// How many bodies regions surely are when united, at least.
fn groups(of: &[Region]) -> usize {
    let mut left: Vec<usize> = (0..of.len()).collect();
    let mut count = 0;
    while let Some(first) = left.pop() {
        count += 1;
        let mut reached = vec![first];
        while let Some(i) = reached.pop() {
            let (met, rest) = left.iter().partition(|j| may_meet(&of[i], &of[**j]));
            left = rest;
            reached.extend::<Vec<usize>>(met);
        }
    }
    count
}

/// Whether two regions have a point in common. Only that they have none is proven, by boxes of which each is outside one of them.
fn may_meet(a: &Region, b: &Region) -> bool {
    let both = a.bounds().intersection(b.bounds());
    if !both.is_finite() {
        return !both.is_empty();
    }
    let mut boxes = if both.is_empty() { vec![] } else { vec![both] };
    for _ in 0..BOXES {
        let Some(part) = boxes.pop() else {
            return false;
        };
        if a.bound(&part).lo > 0.0 || b.bound(&part).lo > 0.0 {
            continue;
        }
        let (middle, size) = (part.center(), part.size());
        if a.value(middle) <= 0.0 && b.value(middle) <= 0.0 {
            return true;
        }
        let longest = (0..3).fold(0, |l, c| if size[c] > size[l] { c } else { l });
        let (mut below, mut above) = (part, part);
        (below.max[longest], above.min[longest]) = (middle[longest], middle[longest]);
        boxes.extend([below, above]);
    }
    true
}

fn several(of: &[RegionSpec], path: &str, loader: &dyn Loader, notes: &mut Notes) -> Result<Vec<Region>, DesignError> {
    of.iter().enumerate().map(|(i, r)| region(r, &format!("{path}[{i}]"), loader, notes)).collect()
}

fn three(path: &str, key: &str, v: [f64; 3]) -> Result<(), DesignError> {
    v.iter().try_for_each(|v| finite(&format!("{path}.{key}"), *v).map(|_| ()))
}

fn positive(path: &str, key: &str, v: f64) -> Result<(), DesignError> {
    if v.is_finite() && v > 0.0 {
        return Ok(());
    }
    let message = format!("{key} is {}; it must be a finite number of mm greater than 0", number(v));
    Err(DesignError::new(format!("{path}.{key}"), message).found(number(v)))
}

fn cuboid(spec: &BoxSpec, path: &str) -> Result<Region, DesignError> {
    let (min, max) = match spec {
        BoxSpec::Size(s) => {
            three(path, "center", s.center)?;
            s.size.iter().try_for_each(|v| positive(path, "size", *v))?;
            let half = scale(s.size, 0.5);
            (sub(s.center, half), add(s.center, half))
        }
        BoxSpec::Corners(c) => {
            three(path, "min", c.min)?;
            three(path, "max", c.max)?;
            for (a, axis) in ["x", "y", "z"].into_iter().enumerate() {
                if c.min[a] >= c.max[a] {
                    let message = format!(
                        "along {axis}, max is {} and min is {}; max must be the greater",
                        number(c.max[a]),
                        number(c.min[a])
                    );
                    return Err(DesignError::new(format!("{path}.max"), message).found(number(c.max[a])));
                }
            }
            (c.min, c.max)
        }
    };
    shared(path, Cuboid::new(min, max))
}

fn mesh(spec: &MeshSpec, path: &str, loader: &dyn Loader, notes: &mut Notes) -> Result<Region, DesignError> {
    let at = format!("{path}.path");
    let extension = spec.path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase();
    if !FORMATS.contains(&extension.as_str()) {
        let message = format!("the name must end in one of {}; found \"{}\"", FORMATS.join(", "), spec.path);
        return Err(DesignError::new(at, message).found(&spec.path));
    }
    if !(spec.scale.is_finite() && spec.scale > 0.0) {
        let scale = number(spec.scale);
        let message = format!("scale is {scale}; it must be a finite number greater than 0");
        return Err(DesignError::new(format!("{path}.scale"), message).found(scale));
    }
    let bytes = loader.load(&spec.path).map_err(|m| DesignError::new(&at, m).found(&spec.path))?;
    let of_file = |f: Fault| DesignError::new(&at, format!("{}: {f}", spec.path)).found(&spec.path);
    let mut loaded = formats::read_mesh(&bytes, &extension).map_err(of_file)?;
    if let (true, Some(unit)) = (loaded.in_mm, spec.unit)
        && unit != Unit::Mm
    {
        let message = "this file names its own unit and was read in mm; leave unit out";
        return Err(DesignError::new(format!("{path}.unit"), message));
    }
    let factor = spec.scale * if loaded.in_mm { 1.0 } else { spec.unit.unwrap_or(Unit::Mm).in_mm() };
    if factor != 1.0 {
        for v in &mut loaded.mesh.vertices {
            *v = scale(*v, factor);
        }
    }
    let repair = match spec.repair {
        RepairSpec::Auto => Repair::Auto,
        RepairSpec::Refuse => Repair::Refuse,
    };
    let made = MeshRegion::new(loaded.mesh, repair).map_err(of_file)?;
    let largest = made.bounds().size().into_iter().fold(0.0, f64::max);
    let mut warn = |message: String| {
        notes.warnings.push(Warning { path: path.into(), message });
    };
    if spec.unit.is_none() && !loaded.in_mm && spec.scale == 1.0 && largest < SMALL {
        warn(format!(
            "the mesh is {largest:.4} mm across: probably its unit is the metre or the inch; say unit = \"m\" or unit = \"inch\", or unit = \"mm\" if it is that small"
        ));
    }
    if let Some(done) = made.repaired().sentence() {
        warn(done);
    }
    notes.repairs.push((path.into(), made.repaired().clone()));
    Ok(Arc::new(made))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_a_union() {
        let ball = |x: f64, radius| Arc::new(Sphere::new([x, 0.0, 0.0], radius).unwrap()) as Region;
        let post = |x: f64| Arc::new(Cylinder::new([x, x, -5.0], [0.0, 0.0, 1.0], 1.0, 10.0).unwrap()) as Region;
        assert_eq!(groups(&[ball(0.0, 1.0), ball(3.0, 1.0), ball(1.5, 1.0)]), 1);
        assert_eq!(groups(&[ball(0.0, 1.0), ball(3.0, 1.0), ball(9.0, 1.0)]), 3);
        // Their bounds overlap, they do not: the diagonal is √2 · 1.5 mm, the radii 2 mm together; or 1.3 mm.
        assert_eq!(groups(&[post(0.0), post(1.5)]), 2);
        assert_eq!(groups(&[post(0.0), post(1.3)]), 1);
        // Faces in common touch.
        let cube = |x: f64| Arc::new(Cuboid::new([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]).unwrap()) as Region;
        assert_eq!(groups(&[cube(0.0), cube(1.0)]), 1);
        assert_eq!(groups(&[cube(0.0), cube(1.001)]), 2);
    }
}
