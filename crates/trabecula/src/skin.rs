//! A skin: the part of a region within some depth of its surface, and where that surface stays open.
//!
//! It is the region minus the same region shrunk by the thickness, so its surfaces are the complements of those of the
//! shrunk region. An open face has no shrunk counterpart: the hollow runs out through it, and the skin of the adjacent
//! walls reaches it with full thickness.

use std::sync::Arc;

use crate::coincident;
use crate::csg_tree::{CsgSolid, CsgTree, Sign};
use crate::field::Field;
use crate::grade::Grade;
use crate::implicit::Surface;
use crate::region::{HalfSpace, OpenSurface, Region};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, cross, norm, scale, sub, unit};

/// The least thickness (mm) that surfaces are moved by at once; the rest of a thickness that varies is added point by point.
const LEAST: f64 = 1e-6;
/// How far surfaces are moved from where they might lie badly in a grid, as a share of the region's size.
const HAIR: f64 = 1e-6;
/// A surface is on a plane if it keeps to it this closely, as a share of the region's size.
const ON: f64 = 1e-9;

/// The skin of a region: all of it that is at most `thickness` (mm, positive in the region) below its surface.
///
/// Nothing grows from the faces of `open`: flat ones on its planes that face as they do, and those that a CAD system names.
///
/// # Errors
/// An opening on which the region has no face; openings that leave no surface. `Fault::at` is `open[i]` or `open`.
pub fn skin(region: &Region, thickness: &Grade, open: &[OpenSurface]) -> Result<CsgSolid, Fault> {
    let bounds = region.bounds();
    let least = thickness.bound(&bounds).lo.max(LEAST);
    let mut found = vec![false; open.len()];
    let walls = region.clone().opened(open, &mut found);
    let walls = walls.unwrap_or_else(|| region.clone());
    let mut surfaces = Vec::new();
    let tree = walls.surfaces(-least, &mut surfaces);
    let mut kept = Vec::new();
    let signs: Vec<Sign> = surfaces
        .into_iter()
        .map(|surface| {
            let mut gone = false;
            for (cut, found) in open.iter().zip(&mut found) {
                let here = matches!(cut, OpenSurface::Plane(cut) if lies_on(&*surface.field, cut, least, &bounds));
                *found |= here;
                gone |= here;
            }
            if gone {
                return Sign::Negative;
            }
            kept.push(match thickness.constant() {
                Some(_) => surface.complement(),
                // Offsets differ, as the hollow's edges could otherwise lie in diagonal planes of the grid.
                None => {
                    let hair = HAIR * norm(bounds.size()) * (kept.len() + 1) as f64;
                    thickened(surface.complement(), thickness, least, &bounds).offset(hair)
                }
            });
            Sign::Varies(kept.len() - 1)
        })
        .collect();
    if let Some(i) = found.iter().position(|f| !f) {
        return Err(no_face(i, &open[i]));
    }
    let hollow = tree.simplified(&|f| signs[f]);
    if hollow == CsgTree::FULL {
        let message = "all of the region's surface is open, so there is no skin; leave a face closed, or the skin out";
        return Err(Fault::new("open", message));
    }
    Ok(CsgSolid { surfaces: kept, tree: hollow.complement() })
}

/// The part of a skin that is outside an opening.
pub fn outside(skin: CsgSolid, opening: &Region) -> CsgSolid {
    let CsgSolid { mut surfaces, tree } = skin;
    let first = surfaces.len();
    let mut cut = Vec::new();
    let of = opening.clone().surfaces(0.0, &mut cut).complement();
    surfaces.extend(cut.into_iter().map(|s| s.complement()));
    let tree = CsgTree::Intersection(vec![tree, of.simplified(&|f| Sign::Varies(first + f))]);
    let mut body = CsgSolid { surfaces, tree };
    coincident::separate(&mut body, &opening.bounds(), &mut 0);
    body
}

/// Whether a surface of the region shrunk by `depth` is the plane of `cut` shrunk by as much.
fn lies_on(surface: &dyn Field, cut: &HalfSpace, depth: f64, bounds: &Aabb) -> bool {
    let (n, size) = (cut.normal(), norm(bounds.size()));
    let axis = (0..3).fold(0, |m, a| if n[a].abs() < n[m].abs() { a } else { m });
    let mut least = [0.0; 3];
    least[axis] = 1.0;
    let u = unit(cross(n, least));
    let v = cross(n, u);
    // Positions on the plane outside the region, beyond the end of a surface that is flat in part.
    let middle = sub(bounds.center(), scale(n, cut.value(bounds.center())));
    let spread = [[0.0, 0.0], [2.0, 0.3], [-1.7, 1.9], [0.4, -2.3]];
    let points = spread.map(|[a, b]| add(middle, add(scale(u, a * size), scale(v, b * size))));
    let (mut values, mut gradients) = ([0.0; 4], [[0.0; 3]; 4]);
    surface.gradients(&points, &mut values, &mut gradients);
    let farthest = points.iter().flatten().fold(depth, |m, x| m.max(x.abs()));
    let level = values.iter().all(|d| (d - depth).abs() <= ON * farthest);
    level && gradients.iter().all(|g| norm(sub(*g, n)) <= ON)
}

fn no_face(i: usize, cut: &OpenSurface) -> Fault {
    let cut = match cut {
        OpenSurface::Plane(cut) => cut,
        OpenSurface::Faces(set) => {
            let message = format!("no part of the region's surface is left of the faces {}", set.names().join(", "));
            return Fault::new(format!("open[{i}]"), message);
        }
    };
    let [p, n] = [cut.point(), cut.normal()].map(|v| v.map(number).join(", "));
    let message = format!(
        "the region has no flat face on the plane through ({p}) mm that faces ({n}); open names flat faces of the region, \
         so cut it there with a half-space, or name where the skin ends: open = [{{ region = … }}]"
    );
    Fault::new(format!("open[{i}]"), message)
}

/// A surface moved inwards by the excess of the thickness over `least`.
fn thickened(surface: Surface, thickness: &Grade, least: f64, bounds: &Aabb) -> Surface {
    Surface {
        lipschitz: surface.lipschitz + lipschitz(thickness, bounds),
        plane: None,
        pair: None,
        field: Arc::new(Thickened { surface: surface.field, thickness: thickness.clone(), least }),
        ..surface
    }
}

/// The greatest gradient of a thickness at 125 points of the bounds, per mm.
fn lipschitz(thickness: &Grade, b: &Aabb) -> f64 {
    const N: usize = 5;
    let at = |i: usize, a: usize| b.min[a] + b.size()[a] * (i as f64 + 0.5) / N as f64;
    let points: Vec<Vec3> = (0..N * N * N).map(|i| [at(i % N, 0), at(i / N % N, 1), at(i / (N * N), 2)]).collect();
    let mut values = vec![0.0; points.len()];
    let mut gradients = vec![[0.0; 3]; points.len()];
    thickness.gradients(&points, &mut values, &mut gradients);
    gradients.into_iter().map(norm).fold(0.0, f64::max)
}

/// The complement of a surface minus the excess of the thickness over the least.
struct Thickened {
    surface: Arc<dyn Field>,
    thickness: Grade,
    least: f64,
}

impl Field for Thickened {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.surface.values(points, out);
        let mut w = vec![0.0; points.len()];
        self.thickness.values(points, &mut w);
        out.iter_mut().zip(w).for_each(|(v, w)| *v -= w - self.least);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.surface.gradients(points, values, gradients);
        let (mut w, mut dw) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        self.thickness.gradients(points, &mut w, &mut dw);
        for i in 0..points.len() {
            values[i] -= w[i] - self.least;
            gradients[i] = sub(gradients[i], dw[i]);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let more = self.thickness.bound(b) - Interval::new(self.least, self.least);
        let r = self.surface.bound(b) - more;
        // The sums above are rounded at each point in another order.
        let slack = 1e-14 * (r.lo.abs() + r.hi.abs());
        if slack.is_finite() { Interval::new(r.lo - slack, r.hi + slack) } else { r }
    }
}
