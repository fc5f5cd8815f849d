//! What a solved map is asked for on its grid: wavelengths, frames, the gradients that they give, and what nodes count.

use rayon::prelude::*;

use super::frame::TargetFrames;
use super::phase_grid::PhaseGrid;
use super::phase_request::PhaseRequest;
use super::principal_lengths::along_axes;
use super::smooth_frames::Smoothing;
use super::surface_frames::SurfaceDistances;
use crate::field::Field;
use crate::grade::Grade;
use geometry::fault::{Fault, number, position};
use geometry::math::{Aabb, Mat3, Vec3, exp, norm, scale};
use geometry::progress::checkpoint;
use geometry::voxel_distances::distances;

/// Weights fall off outside the region by e² for each of this many steps.
const FALL: f64 = 3.0;
/// How far from a point on the surface the interior is looked for, in distances that count as on the surface.
const PROBE: f64 = 1e3;
/// Least root of a weight.
pub(super) const LEAST_ROOT: f64 = 1e-3;

/// A grid over a region, and the wavelengths at its nodes.
pub(super) struct SolveDomain {
    pub bounds: Aabb,
    pub grid: PhaseGrid,
    pub nodes: Vec<Vec3>,
    /// The points of the bounds nearest to nodes, where nodes are beyond them: what is asked for is known there.
    pub clamped: Option<Vec<Vec3>>,
    /// The signed distance of each node from the region, mm.
    pub depth: Vec<f64>,
    /// Whether nodes are in the region.
    pub inside: Vec<bool>,
    /// The surface that cells are aligned with, if they are.
    pub surface: Option<SurfaceDistances>,
    /// The wavelengths that are given, mm.
    pub given: Vec<Vec3>,
}

impl SolveDomain {
    pub fn over(
        bounds: &Aabb,
        grid: PhaseGrid,
        wanted: &PhaseRequest,
        region: Option<&dyn Field>,
    ) -> Result<SolveDomain, Fault> {
        let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
        let clamp = |p: &Vec3| core::array::from_fn(|a| p[a].clamp(bounds.min[a], bounds.max[a]));
        let beyond = grid.origin.iter().zip(bounds.min).any(|(o, b)| *o < b);
        let clamped: Option<Vec<Vec3>> = beyond.then(|| nodes.iter().map(clamp).collect());
        let given = wavelengths(&wanted.wavelength, clamped.as_ref().unwrap_or(&nodes))?;
        checkpoint();
        let mut depth = vec![f64::NEG_INFINITY; grid.len()];
        if let Some(region) = region {
            depth.par_chunks_mut(4096).zip(nodes.par_chunks(4096)).for_each(|(d, p)| region.values(p, d));
        }
        let surface = wanted.align.zip(region).map(|(within, region)| SurfaceDistances::of(region, &nodes, within));
        let reach = reach(bounds);
        let inside = |(p, d): (&Vec3, &f64)| {
            *d < -reach || *d <= reach && region.is_none_or(|region| touches(region, *p, reach))
        };
        let inside = nodes.iter().zip(&depth).map(inside).collect();
        Ok(SolveDomain { bounds: *bounds, grid, nodes, clamped, depth, inside, surface, given })
    }

    /// How far each node is outside the region, mm, 0 in it; `None` where none is outside. From the nearest node in it, as the field of a
    /// region may be far less than the distance where a cylinder that makes a hole ends. Nodes on the surface are outside if others are in it.
    fn outside(&self) -> Option<Vec<f64>> {
        if !self.inside.contains(&false) {
            return None;
        }
        let reach = reach(&self.bounds);
        let within: Vec<bool> = self.depth.iter().map(|d| *d < -reach).collect();
        let counted = [&within, &self.inside].into_iter().find(|nodes| nodes.contains(&true));
        Some(counted.map_or_else(|| self.depth.clone(), |nodes| distances(nodes, self.grid.shape, self.grid.step)))
    }

    /// Where nodes are asked what is wanted.
    fn asked_at(&self) -> &[Vec3] {
        self.clamped.as_ref().unwrap_or(&self.nodes)
    }

    /// The root of the weight of a node; it falls off by e outside the region over some steps of the grid.
    fn nearness(&self, steps: f64, node: usize) -> f64 {
        exp(-self.depth[node].max(0.0) / (steps * self.longest()))
    }

    /// The longest step of the grid, mm.
    pub fn longest(&self) -> f64 {
        self.grid.step.into_iter().fold(0.0, f64::max)
    }

    /// The roots of the weights of nodes: closeness to the region, which falls off by e over some `steps` of the grid, times the target's
    /// weight and how sure its frames are. `None` if all are one.
    pub fn roots(&self, weight: Option<&Grade>, trust: Option<&[f64]>, steps: f64) -> Result<Option<Vec<f64>>, Fault> {
        let mut close = self.closeness(weight, steps)?;
        if let Some(trust) = trust {
            let roots = close.get_or_insert_with(|| vec![1.0; self.grid.len()]);
            roots.iter_mut().zip(trust).for_each(|(root, t)| *root = (*root * t.sqrt()).max(LEAST_ROOT));
        }
        Ok(close)
    }

    fn closeness(&self, weight: Option<&Grade>, steps: f64) -> Result<Option<Vec<f64>>, Fault> {
        let mut roots = vec![1.0; self.grid.len()];
        let even = weight.and_then(Grade::constant);
        if let Some(wrong) = even.filter(|w| !(*w >= 0.0 && w.is_finite())) {
            let message = format!("{}; a weight is a finite number from 0 up", number(wrong));
            return Err(Fault::new("weight", message));
        }
        if even == Some(0.0) {
            return Err(no_weight());
        }
        if let Some(weight) = weight.filter(|w| w.constant().is_none()) {
            weight.values(self.asked_at(), &mut roots);
            let most = roots.iter().copied().fold(0.0, f64::max);
            let wrong = (roots.iter().zip(&self.nodes)).find(|(w, _)| !(**w >= 0.0 && w.is_finite()));
            if let Some((w, p)) = wrong {
                let message = format!(
                    "{} at {}; a weight is a finite number from 0 up, all over the region's bounds",
                    number(*w),
                    position(*p)
                );
                return Err(Fault::new("weight", message));
            }
            if most == 0.0 {
                return Err(no_weight());
            }
            roots.iter_mut().for_each(|w| *w = (*w / most).sqrt());
        } else if self.depth.iter().all(|d| *d <= 1e-6 * self.longest()) {
            return Ok(None);
        }
        let roots = roots.iter().enumerate().map(|(n, w)| (w * self.nearness(steps, n)).max(LEAST_ROOT));
        Ok(Some(roots.collect()))
    }
}

/// How far from the surface of a region a point counts as on it, mm.
fn reach(bounds: &Aabb) -> f64 {
    1e-9 * norm(bounds.size())
}

/// Whether a point on the surface of a region is next to its interior: a hole that ends in a face leaves a film of no thickness over it,
/// where the field of a difference is 0.
fn touches(region: &dyn Field, p: Vec3, reach: f64) -> bool {
    let off = PROBE * reach;
    let octants: Vec<Vec3> =
        (0..8).map(|n| [0, 1, 2].map(|a| p[a] + if n >> a & 1 == 0 { -off } else { off })).collect();
    let mut values = vec![0.0; octants.len()];
    region.values(&octants, &mut values);
    values.iter().any(|v| *v < -reach)
}

/// Explains that a weight is zero everywhere.
fn no_weight() -> Fault {
    let message = "the weight is 0 everywhere, and no direction or wavelength is followed anywhere: give one above 0 where cells \
                   matter, or leave weight out";
    Fault::new("weight", message)
}

/// The frames at the nodes, and the gradients of the three phases that they and the wavelengths ask for.
#[derive(Clone)]
pub(super) struct Target {
    pub frames: Vec<Mat3>,
    /// How far each node is outside the region, mm, 0 in it, if that decided on frames.
    pub outside: Option<Vec<f64>>,
    /// How sure frames are, from 0 to 1, where that differs.
    pub trust: Option<Vec<f64>>,
    /// The range of a stress, against which directions are more or less sure; 0 for other orientations.
    pub range: f64,
    /// The wavelengths along the axes of the frames, where they are given along others.
    pub lengths: Option<Vec<Vec3>>,
    pub k: [Vec<Vec3>; 3],
}

impl Target {
    /// Signs and axes that are not given are chosen so that neighbours agree, those in the part first: what is asked for in a hole, or is
    /// carried on into it from the part, may wind round a line there, and so cross the part with a seam that belongs in the hole.
    pub fn new(domain: &SolveDomain, wanted: &PhaseRequest) -> Result<Target, Fault> {
        let weight: Vec<f64> = (0..domain.grid.len()).map(|n| domain.nearness(FALL, n).powi(2)).collect();
        let combed = wanted.orientation.is_combed() || domain.surface.is_some();
        let outside = if combed { domain.outside() } else { None };
        let smoothing = wanted.averaged().map(|length| Smoothing { length, asked: wanted.smooth, weight: &weight });
        let TargetFrames { at_nodes: frames, trust, range } = wanted.orientation.frames(
            &domain.grid,
            domain.asked_at(),
            smoothing.as_ref(),
            domain.surface.as_ref(),
            outside.as_deref(),
        )?;
        checkpoint();
        let lengths = match wanted.by_principal {
            true => {
                let (nodes, outside) = (domain.asked_at(), outside.as_deref());
                let (of, _) = wanted.orientation.ranged(&domain.grid, nodes, smoothing.as_ref(), outside)?;
                Some(along_axes(&domain.grid, &of, range, &domain.given, &frames, smoothing.as_ref()))
            }
            false => None,
        };
        checkpoint();
        let k = core::array::from_fn(|i| {
            let of = frames.iter().zip(lengths.as_ref().unwrap_or(&domain.given));
            of.map(|(f, w)| scale([f[0][i], f[1][i], f[2][i]], 1.0 / w[i])).collect()
        });
        Ok(Target { frames, outside, trust, range, lengths, k })
    }

    /// The wavelengths at the nodes along the cell's axes, mm.
    pub fn wavelength<'a>(&'a self, domain: &'a SolveDomain) -> &'a [Vec3] {
        self.lengths.as_ref().unwrap_or(&domain.given)
    }

    /// The roots of the weights of nodes, as surroundings count where phases have one value everywhere.
    pub fn roots(&self, domain: &SolveDomain, wanted: &PhaseRequest) -> Result<Option<Vec<f64>>, Fault> {
        domain.roots(wanted.weight.as_ref(), self.trust.as_deref(), FALL)
    }
}

/// The three wavelengths at points.
pub(super) fn wavelengths(of: &[Grade; 3], points: &[Vec3]) -> Result<Vec<Vec3>, Fault> {
    let mut out = vec![[0.0; 3]; points.len()];
    let mut values = vec![0.0; points.len()];
    for (i, grade) in of.iter().enumerate() {
        grade.values(points, &mut values);
        for ((o, v), p) in out.iter_mut().zip(&values).zip(points) {
            if !(*v > 0.0 && v.is_finite()) {
                return Err(Fault::new(
                    "wavelength",
                    format!(
                        "{} mm at {}; a wavelength is a positive, finite length all over the region's bounds",
                        number(*v),
                        position(*p)
                    ),
                ));
            }
            o[i] = *v;
        }
    }
    Ok(out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::map::frame::Orientation;
    use crate::region::{Cuboid, Cylinder, Difference, Region};

    /// A hole is a hole whether the cylinder that makes it ends in the faces of the block or beyond them, though the field of the difference
    /// is 0 all over its ends in the first case.
    #[test]
    fn films_over_holes_are_not_inside() {
        let block: Region = Arc::new(Cuboid::new([-4.0, -4.0, 0.0], [4.0, 4.0, 3.0]).unwrap());
        let plate = |beyond: f64| {
            let hole = Cylinder::new([0.5, 0.25, -beyond], [0.0, 0.0, 1.0], 2.1, 3.0 + 2.0 * beyond).unwrap();
            Difference::new(vec![block.clone(), Arc::new(hole)]).unwrap()
        };
        let of = |v: f64| [0; 3].map(|_| Grade::Constant(v));
        let wanted = PhaseRequest::new(of(2.0), Orientation::Angles(of(0.0)));
        let bounds = block.bounds();
        let inside = |region: Difference| {
            let domain =
                SolveDomain::over(&bounds, PhaseGrid::over(&bounds, [33, 33, 13]), &wanted, Some(&region)).unwrap();
            domain.inside
        };
        let (ends, through) = (inside(plate(0.0)), inside(plate(1.0)));
        assert_eq!(ends, through);
        // Every layer of nodes has the hole, and the nodes of the block's faces, edges and corners are in it.
        assert!(through.chunks(33 * 33).all(|layer| layer == &through[..33 * 33]));
        assert_eq!(through[..33 * 33].iter().filter(|inside| !**inside).count(), 221);
    }
}
