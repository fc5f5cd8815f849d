//! A skin: the part of a region within some depth of its surface, and where that surface stays open.
//!
//! It is what the region has beyond the same region shrunk by the thickness, so its faces are those of the shrunk region
//! with the solid on their other side. An open face has no shrunk one: the hollow runs out through it, and the skin of
//! the walls beside it with full thickness.

use std::sync::Arc;

use crate::face::{Body, Face, Sign, Tree};
use crate::field::Field;
use crate::flush;
use crate::grade::Grade;
use crate::region::{HalfSpace, Region};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, cross, norm, scale, sub, unit};

/// The least thickness (mm) that faces are moved by at once; the rest of a thickness that varies is added point by point.
const LEAST: f64 = 1e-6;
/// How far faces are moved from where they might lie badly in a grid, as a share of the region's size.
const HAIR: f64 = 1e-6;
/// A face is on a plane if it keeps to it this closely, as a share of the region's size.
const ON: f64 = 1e-9;

/// The skin of a region: all of it that is at most `thickness` (mm, positive in the region) below its surface.
///
/// Nothing grows from the flat faces that lie on the planes of `open` and face as they do.
///
/// # Errors
/// An opening on which the region has no flat face; openings that leave no surface. `Fault::at` is `open[i]` or `open`.
pub fn skin(region: &Region, thickness: &Grade, open: &[HalfSpace]) -> Result<Body, Fault> {
    let bounds = region.bounds();
    let least = thickness.bound(&bounds).lo.max(LEAST);
    let mut found = vec![false; open.len()];
    let walls = region.clone().opened(open, &mut found);
    let walls = walls.unwrap_or_else(|| region.clone());
    let mut faces = Vec::new();
    let tree = walls.faces(-least, &mut faces);
    let mut kept = Vec::new();
    let signs: Vec<Sign> = faces
        .into_iter()
        .map(|face| {
            let mut gone = false;
            for (cut, found) in open.iter().zip(&mut found) {
                let here = lies_on(&*face.field, cut, least, &bounds);
                *found |= here;
                gone |= here;
            }
            if gone {
                return Sign::Negative;
            }
            kept.push(match thickness.constant() {
                Some(_) => face.turned(),
                // Each by its own hair's breadth: the hollow's edges could lie in the diagonal planes of the grid.
                None => {
                    let hair = HAIR * norm(bounds.size()) * (kept.len() + 1) as f64;
                    let face = thickened(face.turned(), thickness, least, &bounds);
                    flush::outwards(face, hair)
                }
            });
            Sign::Varies(kept.len() - 1)
        })
        .collect();
    if let Some(i) = found.iter().position(|f| !f) {
        return Err(no_face(i, &open[i]));
    }
    let hollow = tree.given(&|f| signs[f]);
    if hollow == Tree::FULL {
        let message = "all of the region's surface is open, so there is no skin; leave a face closed, or the skin out";
        return Err(Fault::new("open", message));
    }
    Ok(Body { faces: kept, tree: hollow.complement() })
}

/// Whether a face of the region shrunk by `depth` is the plane of `cut` shrunk by as much.
fn lies_on(face: &dyn Field, cut: &HalfSpace, depth: f64, bounds: &Aabb) -> bool {
    let (n, size) = (cut.normal(), norm(bounds.size()));
    let axis = (0..3).fold(0, |m, a| if n[a].abs() < n[m].abs() { a } else { m });
    let mut least = [0.0; 3];
    least[axis] = 1.0;
    let u = unit(cross(n, least));
    let v = cross(n, u);
    // Farther out than the region, where a surface that is flat in part has ended.
    let middle = sub(bounds.center(), scale(n, cut.value(bounds.center())));
    let spread = [[0.0, 0.0], [2.0, 0.3], [-1.7, 1.9], [0.4, -2.3]];
    let points = spread.map(|[a, b]| add(middle, add(scale(u, a * size), scale(v, b * size))));
    let (mut values, mut gradients) = ([0.0; 4], [[0.0; 3]; 4]);
    face.gradients(&points, &mut values, &mut gradients);
    let farthest = points.iter().flatten().fold(depth, |m, x| m.max(x.abs()));
    let level = values.iter().all(|d| (d - depth).abs() <= ON * farthest);
    level && gradients.iter().all(|g| norm(sub(*g, n)) <= ON)
}

fn no_face(i: usize, cut: &HalfSpace) -> Fault {
    let [p, n] = [cut.point(), cut.normal()].map(|v| v.map(number).join(", "));
    let message = format!(
        "the region has no flat face on the plane through ({p}) mm that faces ({n}); open names flat faces of the region, \
         so cut it there with a half-space"
    );
    Fault::new(format!("open[{i}]"), message)
}

/// A face moved inwards by what the thickness has above `least`.
fn thickened(face: Face, thickness: &Grade, least: f64, bounds: &Aabb) -> Face {
    Face {
        slope: face.slope + steepness(thickness, bounds),
        plane: None,
        field: Arc::new(Thickened { face: face.field, thickness: thickness.clone(), least }),
        ..face
    }
}

/// How fast a thickness changes, per mm: by its gradient at some points of the bounds.
fn steepness(thickness: &Grade, b: &Aabb) -> f64 {
    const N: usize = 5;
    let at = |i: usize, a: usize| b.min[a] + b.size()[a] * (i as f64 + 0.5) / N as f64;
    let points: Vec<Vec3> = (0..N * N * N).map(|i| [at(i % N, 0), at(i / N % N, 1), at(i / (N * N), 2)]).collect();
    let mut values = vec![0.0; points.len()];
    let mut gradients = vec![[0.0; 3]; points.len()];
    thickness.gradients(&points, &mut values, &mut gradients);
    gradients.into_iter().map(norm).fold(0.0, f64::max)
}

/// A turned face less what the thickness has above the least.
struct Thickened {
    face: Arc<dyn Field>,
    thickness: Grade,
    least: f64,
}

impl Field for Thickened {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.face.values(points, out);
        let mut w = vec![0.0; points.len()];
        self.thickness.values(points, &mut w);
        out.iter_mut().zip(w).for_each(|(v, w)| *v -= w - self.least);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.face.gradients(points, values, gradients);
        let (mut w, mut dw) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        self.thickness.gradients(points, &mut w, &mut dw);
        for i in 0..points.len() {
            values[i] -= w[i] - self.least;
            gradients[i] = sub(gradients[i], dw[i]);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let more = self.thickness.bound(b) - Interval::new(self.least, self.least);
        let r = self.face.bound(b) - more;
        // The sums above are rounded at each point in another order.
        let slack = 1e-14 * (r.lo.abs() + r.hi.abs());
        if slack.is_finite() { Interval::new(r.lo - slack, r.hi + slack) } else { r }
    }
}
