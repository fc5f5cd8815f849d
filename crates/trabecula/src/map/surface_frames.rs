//! Frames of which one axis is along the region's normal near its surface.
//!
//! Near the surface a frame is a normal and any turn about it; farther in it is what is asked for there, or nothing. Both are harmonic
//! polynomials (`smooth_frames`), and so is their average over a length, which has no signs and no order: normals at right angles, as on
//! both sides of an edge, are axes of one frame.

use rayon::prelude::*;

use super::smooth_frames::{GIVEN, Octahedral};
use crate::field::Field;
use geometry::fault::{Fault, number};
use geometry::math::{Mat3, Vec3, cross, dot, norm, scale, transpose, turned};

/// The part of the depth over which frames are averaged.
const AVERAGED: f64 = 0.5;
/// The angle (degrees) between a normal and the nearest axis up to which that is turned to it, and from which it is not turned at all: as
/// far from two axes neighbours would turn different ones.
const CLEAR: [f64; 2] = [25.0, 40.0];

/// Alignment with the surface, within a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aligned {
    depth: f64,
}

impl Aligned {
    /// Within a depth, mm.
    ///
    /// # Errors
    /// A depth that is not positive or not finite.
    pub fn new(depth: f64) -> Result<Aligned, Fault> {
        if !(depth > 0.0 && depth.is_finite()) {
            let message = format!("{} mm; the depth of alignment is a positive, finite length", number(depth));
            return Err(Fault::new("align_depth", message));
        }
        Ok(Aligned { depth })
    }

    /// The length over which frames are averaged, mm, if they are also smoothed over one.
    pub(super) fn length(self, smooth: Option<f64>) -> f64 {
        smooth.unwrap_or(0.0).max(AVERAGED * self.depth)
    }

    /// How much the normal counts at a signed distance from the surface, mm: all of it on the surface and outside, nothing deeper than
    /// the depth.
    fn share(self, distance: f64) -> f64 {
        smooth_step(1.0 + distance / self.depth)
    }
}

/// The surface of a region as the nodes of a grid see it.
pub(super) struct SurfaceDistances {
    within: Aligned,
    /// Signed distances from it, mm.
    distance: Vec<f64>,
    /// Gradients of the distance.
    normals: Vec<Vec3>,
}

impl SurfaceDistances {
    pub fn of(region: &dyn Field, nodes: &[Vec3], within: Aligned) -> SurfaceDistances {
        let (mut distance, mut normals) = (vec![0.0; nodes.len()], vec![[0.0; 3]; nodes.len()]);
        let chunks = distance.par_chunks_mut(4096).zip(normals.par_chunks_mut(4096)).zip(nodes.par_chunks(4096));
        chunks.for_each(|((d, n), p)| region.gradients(p, d, n));
        SurfaceDistances { within, distance, normals }
    }

    /// The frame asked for at a node, and the normal where the node is near to the surface.
    pub fn mixed(&self, node: usize, asked: Octahedral) -> Octahedral {
        match about(self.normals[node]) {
            Some(normal) => {
                let share = self.within.share(self.distance[node]);
                asked.times(1.0 - share).plus(Octahedral::of(&normal, &[0.0, 0.0, GIVEN[2]]).times(share))
            }
            None => asked,
        }
    }

    /// An averaged frame at a node with an axis along the normal at the surface: the average there is between that and what is asked
    /// for farther in.
    pub fn pinned(&self, node: usize, frame: &Mat3) -> Mat3 {
        let (normal, share) = (self.normals[node], self.within.share(self.distance[node]));
        let size = norm(normal);
        if size.is_nan() || size < 1e-6 {
            return *frame;
        }
        turned_to(frame, scale(normal, 1.0 / size), share)
    }
}

/// The steps from 0 to 1 as a smooth function.
fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A frame whose axis nearest to a unit normal is turned towards it by a `share` of the angle between them, by the least turn.
fn turned_to(frame: &Mat3, normal: Vec3, share: f64) -> Mat3 {
    let axes = transpose(frame);
    let k = (0..3).fold(0, |m, i| if dot(axes[i], normal).abs() > dot(axes[m], normal).abs() { i } else { m });
    let to = if dot(axes[k], normal) < 0.0 { scale(normal, -1.0) } else { normal };
    let about = cross(axes[k], to);
    let (sine, cosine) = (norm(about), dot(axes[k], to));
    if sine < 1e-12 {
        return *frame;
    }
    let (about, angle) = (scale(about, 1.0 / sine), sine.atan2(cosine));
    let clear = smooth_step((CLEAR[1] - angle.to_degrees()) / (CLEAR[1] - CLEAR[0]));
    let (s, c) = (share * clear * angle).sin_cos();
    transpose(&axes.map(|v| turned(v, about, (s, c))))
}

/// A frame whose third axis is along a normal.
fn about(normal: Vec3) -> Option<Mat3> {
    let size = norm(normal);
    if size.is_nan() || size < 1e-6 {
        return None;
    }
    let z = scale(normal, 1.0 / size);
    let least = (0..3).fold(0, |m, i| if z[i].abs() < z[m].abs() { i } else { m });
    let mut e = [0.0; 3];
    e[least] = 1.0;
    let x = cross(e, z);
    let x = scale(x, 1.0 / norm(x));
    Some(transpose(&[x, cross(z, x), z]))
}
