//! Where pictures are seen from.

use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};

/// How to draw.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Direction from which the camera looks: azimuth about +Z (degrees from +X towards +Y).
    pub azimuth: f64,
    /// Elevation above the XY plane, degrees.
    pub elevation: f64,
    /// How space becomes a plane.
    pub projection: Projection,
}

impl View {
    /// The directions to the right, up, and from the scene to the eye.
    pub(super) fn axes(&self) -> [Vec3; 3] {
        let (az, el) = (self.azimuth.to_radians(), self.elevation.clamp(-90.0, 90.0).to_radians());
        let out = [az.cos() * el.cos(), az.sin() * el.cos(), el.sin()];
        let right = [-az.sin(), az.cos(), 0.0];
        [right, cross(out, right), out]
    }
}

/// How space becomes a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// By a narrow lens: what is nearer is larger.
    #[default]
    Perspective,
    /// By parallel rays: a length across the view is the same at any depth.
    Orthographic,
}

/// Where the eye is and how it sees: right, up, and from the scene to the eye.
pub(super) struct Camera {
    pub center: Vec3,
    pub axes: [Vec3; 3],
    /// Distance from the centre (mm); of parallel rays, that of the plane from which depths are measured.
    pub distance: f64,
    /// Samples per unit of slope: in the depth of the centre, `distance` mm are as many samples.
    pub focal: f64,
    pub middle: [f64; 2],
    pub projection: Projection,
}

impl Camera {
    /// A camera such that the points fill the picture but for a margin.
    pub fn new(bounds: &Aabb, points: &[Vec3], view: &View, size: [usize; 2]) -> Camera {
        let radius = (norm(bounds.size()) / 2.0).max(1e-9);
        let mut camera = Camera {
            center: bounds.center(),
            axes: view.axes(),
            distance: radius * 6.0,
            focal: 1.0,
            middle: size.map(|n| n as f64 / 2.0),
            projection: view.projection,
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points {
            let [x, y, _] = camera.project(*p);
            for (a, v) in [x, y].into_iter().enumerate() {
                low[a] = low[a].min(v - camera.middle[a]);
                high[a] = high[a].max(v - camera.middle[a]);
            }
        }
        let room = [0, 1].map(|a| 0.92 * size[a] as f64 / (high[a] - low[a]).max(1e-12));
        camera.focal = room[0].min(room[1]);
        for a in 0..2 {
            camera.middle[a] -= camera.focal * (low[a] + high[a]) / 2.0;
        }
        camera
    }

    /// The same view in a picture of `factor` times as many samples across and down.
    pub fn scaled(&self, factor: f64) -> Camera {
        Camera { focal: factor * self.focal, middle: self.middle.map(|m| factor * m), ..*self }
    }

    /// Column, row (samples) and depth: affine along the picture over any plane, greater when nearer, positive. By a lens that is the
    /// inverse distance along the view; of parallel rays, its tangent in the depth of the centre.
    pub fn project(&self, p: Vec3) -> [f64; 3] {
        let d = sub(p, self.center);
        let out = dot(d, self.axes[2]);
        let near = match self.projection {
            Projection::Perspective => 1.0 / (self.distance - out),
            Projection::Orthographic => (1.0 + out / self.distance) / self.distance,
        };
        let k = self.samples_per_mm(near);
        [self.middle[0] + k * dot(d, self.axes[0]), self.middle[1] - k * dot(d, self.axes[1]), near]
    }

    /// Samples per mm across the view, in a depth.
    pub fn samples_per_mm(&self, near: f64) -> f64 {
        match self.projection {
            Projection::Perspective => self.focal * near,
            Projection::Orthographic => self.focal / self.distance,
        }
    }

    /// The distance along the view (mm) of a depth; infinite where nothing is seen.
    pub fn distance_of(&self, near: f64) -> f64 {
        match self.projection {
            _ if near <= 0.0 => f64::INFINITY,
            Projection::Perspective => 1.0 / near,
            Projection::Orthographic => self.distance * (2.0 - near * self.distance),
        }
    }

    /// The point of the scene behind a sample.
    pub fn unproject(&self, x: f64, y: f64, near: f64) -> Vec3 {
        let k = 1.0 / self.samples_per_mm(near);
        let right = (x - self.middle[0]) * k;
        let up = (self.middle[1] - y) * k;
        let out = self.distance - self.distance_of(near);
        let axes = self.axes;
        add(self.center, add(scale(axes[0], right), add(scale(axes[1], up), scale(axes[2], out))))
    }

    /// A vector from a point to the eye; of parallel rays, along them.
    pub fn to_eye(&self, p: Vec3) -> Vec3 {
        let out = scale(self.axes[2], self.distance);
        match self.projection {
            Projection::Perspective => sub(add(self.center, out), p),
            Projection::Orthographic => out,
        }
    }

    /// The direction from a point to the eye.
    pub fn towards(&self, p: Vec3) -> Vec3 {
        unit(self.to_eye(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Samples lead back to their points; depth is affine over planes, so that triangles can be filled by it; and what is nearer to the
        /// eye has the greater depth.
        #[test]
        fn what_is_projected_comes_back(
            azimuth in -180.0..180.0f64, elevation in -90.0..90.0f64, lens in any::<bool>(),
            p in prop::array::uniform3(-3.0..5.0f64), q in prop::array::uniform3(-3.0..5.0f64), share in 0.0..1.0f64,
        ) {
            let projection = if lens { Projection::Perspective } else { Projection::Orthographic };
            let view = View { size: [400, 300], azimuth, elevation, projection };
            let bounds = Aabb { min: [-3.0; 3], max: [5.0; 3] };
            let corners: Vec<Vec3> = (0..8).map(|i| [0, 1, 2].map(|k| [-3.0, 5.0][i >> k & 1])).collect();
            let camera = Camera::new(&bounds, &corners, &view, view.size);
            let [a, b] = [p, q].map(|p| camera.project(p));
            let back = camera.unproject(a[0], a[1], a[2]);
            prop_assert!(norm(sub(back, p)) < 1e-9, "{p:?} {back:?}");
            let far = |p: Vec3| camera.distance - dot(sub(p, camera.center), camera.axes[2]);
            prop_assert!((camera.distance_of(a[2]) - far(p)).abs() < 1e-9);
            prop_assert!((far(p) - far(q)).abs() < 1e-9 || (far(p) < far(q)) == (a[2] > b[2]));
            let mid: Vec3 = core::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
            let on = camera.unproject(mid[0], mid[1], mid[2]);
            prop_assert!(norm(cross(sub(on, p), sub(q, p))) < 1e-7, "a line stays a line");
        }
    }
}
