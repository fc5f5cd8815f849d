//! Which tetrahedra of the background are too large: for the size asked for, or for the curvature of the surfaces that cross them.

use crate::conforming_tets::Patched;
use crate::grade::Grade;
use crate::implicit::Surface;
use crate::region::Region;
use geometry::fault::{Fault, number};
use geometry::math::{Vec3, add, norm, scale, sub};
use geometry::tetmesh::{EDGES, conformity, tet_quality::size_of, volume};

/// Tetrahedra are this much larger than asked for at most: bisections halve the volume.
pub(super) const SPREAD: f64 = 1.122_462_048_309_373;
/// Greatest distance between chord and surface, as a fraction of the chord: of a circle, chords shorter than its radius.
const SAGITTA: f64 = 0.12;
/// Tetrahedra are not made smaller for curvature than this fraction of the size asked for.
const LEAST: f64 = 0.25;

/// What decides whether a tetrahedron is divided.
pub(super) struct RefinementCriterion<'a> {
    pub region: &'a Region,
    /// The region's own surfaces, then the groups of patches of those that are meshes.
    pub surfaces: &'a [Surface],
    pub patched: &'a [Patched],
    pub size: &'a Grade,
}

impl RefinementCriterion<'_> {
    /// Whether a tetrahedron that may intersect the region is larger than requested.
    ///
    /// **Errors**: a size that is not positive.
    pub fn coarse(&self, p: [Vec3; 4]) -> Result<bool, Fault> {
        let middle: Vec3 = core::array::from_fn(|k| (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4.0);
        let reach = p.iter().map(|p| norm(sub(*p, middle))).fold(0.0, f64::max);
        let mine = size_of(volume(p));
        let mut wanted = [0.0; 5];
        self.size.values(&[middle, p[0], p[1], p[2], p[3]], &mut wanted);
        let least = wanted.into_iter().fold(f64::INFINITY, f64::min);
        let small = mine <= wanted[0] * SPREAD && mine <= 2.0 * least;
        if small && mine <= LEAST * wanted[0] * SPREAD {
            return Ok(false);
        }
        let off = self.region.value(middle);
        if off > reach {
            return Ok(false);
        }
        if !(wanted[0] > 0.0 && least > 0.0) {
            let message = format!(
                "size is {} mm at {}; it must be greater than 0 in the region and near it",
                number(wanted[0].min(least)),
                conformity::place(middle)
            );
            return Err(Fault::new("size", message));
        }
        Ok(!small || off > -reach && self.is_curved(&p, middle, reach))
    }

    /// Whether chords of a surface that crosses a tetrahedron are far from it.
    fn is_curved(&self, p: &[Vec3; 4], middle: Vec3, reach: f64) -> bool {
        let by_patches = |s: usize| self.patched.iter().any(|m| m.mesh == s);
        let crossed = |s: usize| match self.patched.iter().find(|m| m.groups().contains(&s)) {
            Some(m) => m.meets(s, p),
            None => {
                let of = &self.surfaces[s];
                of.plane.is_none() && !by_patches(s) && of.field.value(middle).abs() <= of.lipschitz * reach
            }
        };
        (0..self.surfaces.len()).filter(|s| crossed(*s)).any(|s| {
            let points: Vec<Vec3> = EDGES.iter().map(|[a, b]| scale(add(p[*a], p[*b]), 0.5)).chain(*p).collect();
            let mut v = vec![0.0; points.len()];
            self.surfaces[s].field.values(&points, &mut v);
            EDGES.iter().enumerate().any(|(i, [a, b])| {
                let sagitta = v[i] - 0.5 * (v[6 + a] + v[6 + b]);
                sagitta.abs() > SAGITTA * self.surfaces[s].lipschitz * norm(sub(p[*a], p[*b]))
            })
        })
    }
}
