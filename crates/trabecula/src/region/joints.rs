//! Joints: faces that parts of a union only touch at, where distances are zero although the solid goes on.

use super::Region;
use geometry::fault::{number, position};
use geometry::math::{Vec3, add, norm, scale};

/// How far beyond a joint the region has to go on, and how close to it the distance has to be 0, as shares of the region's size.
const BEYOND: f64 = 1e-3;
const ON: f64 = 1e-7;
/// Points whose way out is a joint, beyond which it is one.
const FEW: usize = 2;

/// Where parts of a region only touch, and what mends it, in words; `asked` is the depth below the surface that is asked for (mm). Found is
/// a position inside the region at which its distance is zero, with the region on both sides: the way out of one of the `points` less deep
/// than `within` (mm). `None` if there is none, as of one mesh.
pub fn joint(region: &Region, points: &[Vec3], within: f64, asked: f64) -> Option<String> {
    let p = joint_at(region, points, within)?;
    Some(format!(
        "at {}, inside the region, where parts of a union only touch: faces that two have in common count as surface; let the parts overlap by \
         {} mm, or make them one mesh",
        position(p),
        number(2.0 * asked)
    ))
}

fn joint_at(region: &Region, points: &[Vec3], within: f64) -> Option<Vec3> {
    if region.as_mesh().is_some() {
        return None;
    }
    let size = norm(region.bounds().size());
    let (mut values, mut out) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    region.gradients(points, &mut values, &mut out);
    let near = points.iter().zip(values).zip(out).filter(|((_, v), _)| -within < *v && *v < 0.0);
    let mut found = near.filter_map(|((p, v), out)| {
        let [at, beyond] = [-v, BEYOND * size - v].map(|far| add(*p, scale(out, far)));
        let joint = region.value(at).abs() <= ON * size && region.value(beyond) < -0.5 * BEYOND * size;
        joint.then_some(at)
    });
    found.nth(FEW)
}
