//! Ambient occlusion, from the depths that a picture shows.

use rayon::prelude::*;

use super::raster::{INSIDE, Projected, Raster, weights};
use super::shading_normals::{ShadingNormals, area};
use super::{Camera, SAMPLES, SectionPlane};
use crate::math::{Vec3, dot, scale, sub};
use crate::surface_mesh::SurfaceMesh;

/// Samples of the sky about each point.
const SKY: usize = 20;
/// Samples of the picture to one of the occlusion, across and down, unless the picture is large.
const STRIDE: f64 = 2.0;

/// How much of the sky is seen, on a raster coarser than the picture's.
///
/// Alchemy's estimator (McGuire et al. 2011): neighbours on a spiral count by how far they stand above the tangent
/// plane, and less the farther they are; then smoothed among equals.
pub(super) struct Occlusion {
    size: [usize; 2],
    /// Its samples to one of the picture.
    factor: f64,
    near: Vec<f32>,
    /// 1 all, 0 nothing.
    open: Vec<f32>,
}

impl Occlusion {
    /// Of a picture of `size` samples across and down.
    pub(super) fn of(
        surface: &SurfaceMesh,
        normals: &ShadingNormals,
        camera: &Camera,
        size: [usize; 2],
        section: Option<&SectionPlane>,
    ) -> Occlusion {
        let samples = (size[0] * size[1]) as f64;
        let most = SAMPLES as f64 / (STRIDE * STRIDE);
        let factor = (1.0 / STRIDE).min((most / samples).sqrt());
        let camera = camera.scaled(factor);
        let size = size.map(|n| ((n as f64 * factor).ceil() as usize).max(1));
        let raster = Projected::of(surface, &camera, size, section).draw(surface, 0, size[1]);
        let seen = |p: Vec3, triangle: u32| match section {
            Some(section) if triangle & INSIDE != 0 => section.normal,
            _ => facing(surface, normals, &camera, triangle & !INSIDE, p),
        };
        let raw = estimated(&camera, &raster, size, seen);
        let open = smoothed(&raw, size, |x, y| raster.near[y * size[0] + x]);
        Occlusion { size, factor, near: raster.near, open }
    }

    /// At a sample of the picture: that of the nearest in depth of the four about it.
    pub(super) fn open(&self, x: usize, y: usize, near: f32) -> f32 {
        let first = [x, y].map(|c| ((c as f64 + 0.5) * self.factor - 0.5).max(0.0) as usize);
        let about = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let (x, y) = ((first[0] + i).min(self.size[0] - 1), (first[1] + j).min(self.size[1] - 1));
            y * self.size[0] + x
        });
        let gap = |at: &usize| (self.near[*at] - near).abs();
        about.into_iter().min_by(|a, b| gap(a).total_cmp(&gap(b))).map_or(1.0, |at| self.open[at])
    }
}

/// The normal that a point of a triangle is shaded by, on the side of the eye. By those of its facets a curved surface would have scales.
fn facing(surface: &SurfaceMesh, normals: &ShadingNormals, camera: &Camera, triangle: u32, p: Vec3) -> Vec3 {
    let n = normals.within(surface, triangle, weights(surface, triangle, p));
    if dot(area(surface, triangle as usize), camera.to_eye(p)) < 0.0 { scale(n, -1.0) } else { n }
}

/// The estimate at each sample, by the normal of what is seen there: at a point, of a triangle.
fn estimated(
    camera: &Camera,
    raster: &Raster,
    [w, h]: [usize; 2],
    normal: impl Fn(Vec3, u32) -> Vec3 + Sync,
) -> Vec<f32> {
    let near = &raster.near;
    let point = |x: usize, y: usize| {
        let near = near[y * w + x];
        (near > 0.0).then(|| camera.unproject(x as f64 + 0.5, y as f64 + 0.5, f64::from(near)))
    };
    let scene = camera.distance / 6.0;
    // Two reaches: the openings of a cell, and the part as a whole.
    let reaches = [0.05 * scene, 0.22 * scene];
    let mut raw = vec![1.0f32; w * h];
    raw.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let Some(p) = point(x, y) else { continue };
            let n = normal(p, raster.triangle[y * w + x]);
            // A pattern of 4×4 turns, the same in every picture.
            let turn = ((x & 3) + 4 * (y & 3)) as f64 * 0.618_033_988_75 * core::f64::consts::TAU;
            let mut dark = 0.0;
            for (reach, weight) in reaches.into_iter().zip([0.62, 0.38]) {
                let radius = (camera.samples_per_mm(f64::from(near[y * w + x])) * reach).max(2.0);
                let mut sum = 0.0;
                for k in 0..SKY {
                    let r = radius * ((k as f64 + 0.5) / SKY as f64);
                    let (s, c) = (turn + k as f64 * 2.399_963_229_73).sin_cos();
                    let (sx, sy) = (x as f64 + r * c, y as f64 + r * s);
                    if sx < 0.0 || sy < 0.0 || sx >= w as f64 || sy >= h as f64 {
                        continue;
                    }
                    let Some(q) = point(sx as usize, sy as usize) else {
                        continue;
                    };
                    let v = sub(q, p);
                    let d2 = dot(v, v);
                    let fall = (1.0 - d2 / (reach * reach * 2.0)).max(0.0);
                    let above = dot(v, n) - 0.02 * reach;
                    sum += fall * above.max(0.0) / (d2.sqrt() + 1e-3 * reach);
                }
                dark += weight * sum / SKY as f64;
            }
            *out = (1.0 - 3.3 * dark).clamp(0.0, 1.0) as f32;
        }
    });
    raw
}

/// Averages 4×4 samples of like depth, which takes out the pattern of the spiral.
fn smoothed(raw: &[f32], [w, h]: [usize; 2], near: impl Fn(usize, usize) -> f32 + Sync) -> Vec<f32> {
    let mut out = raw.to_vec();
    out.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let here = near(x, y);
            if here == 0.0 {
                continue;
            }
            let (mut sum, mut count) = (0.0, 0.0);
            for j in y.saturating_sub(2)..(y + 3).min(h) {
                for i in x.saturating_sub(2)..(x + 3).min(w) {
                    let weight = (1.0 - (near(i, j) / here - 1.0).abs() * 150.0).max(0.0);
                    sum += weight * raw[j * w + i];
                    count += weight;
                }
            }
            *out = sum / count;
        }
    });
    out
}
