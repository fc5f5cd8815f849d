//! Which triangle each sample sees.

use rayon::prelude::*;

use super::{Camera, SectionPlane, SeenSection};
use crate::math::sub;
use crate::surface_mesh::SurfaceMesh;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;
/// Rows drawn by one thread at a time: whole rows of pixels.
pub(super) const BAND: usize = 16 * super::OVER;

/// Of the number of a triangle whose inside is seen: a section cuts the solid there.
pub(super) const INSIDE: u32 = 1 << 31;

/// Depth and triangle of each sample of some rows.
pub(super) struct Raster {
    /// The first row.
    pub first: usize,
    /// Samples across.
    pub width: usize,
    /// Depth as of `Camera::project`, 0 where nothing is seen.
    pub near: Vec<f32>,
    /// The triangle seen; with `INSIDE` the one behind the section there, in whose plane the depth is.
    pub triangle: Vec<u32>,
}

/// Where the vertices lie in the picture, and the triangles of each band of rows.
pub(super) struct Projected {
    points: Vec<[f32; 3]>,
    width: usize,
    section: Option<SeenSection>,
    /// By chunks of triangles, then by bands: a band's triangles are in their own order.
    binned: Vec<Vec<Vec<u32>>>,
}

impl Projected {
    /// Projects into a picture of `size` samples across and down.
    pub(super) fn of(
        surface: &SurfaceMesh,
        camera: &Camera,
        size: [usize; 2],
        section: Option<&SectionPlane>,
    ) -> Projected {
        const CHUNK: usize = 1 << 16;
        let mesh = &surface.mesh;
        let points: Vec<[f32; 3]> = mesh.vertices.par_iter().map(|p| camera.project(*p).map(|v| v as f32)).collect();
        let rows = size[1].div_ceil(BAND);
        let chunks = mesh.triangles.par_chunks(CHUNK).enumerate().map(|(c, part)| {
            let mut bins = vec![Vec::new(); rows];
            for (i, t) in part.iter().enumerate() {
                let y = t.map(|v| points[v as usize][1]);
                let (low, high) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
                if !(high >= 0.0 && low < size[1] as f32) {
                    continue;
                }
                let first = (low.max(0.0) as usize / BAND).min(rows - 1);
                let last = (high as usize / BAND).min(rows - 1);
                for bin in &mut bins[first..=last] {
                    bin.push((c * CHUNK + i) as u32);
                }
            }
            bins
        });
        let binned = chunks.collect();
        let section = section.map(|s| SeenSection::new(s, camera));
        Projected { points, width: size[0], section, binned }
    }

    /// Draws `rows` rows from a band on. Bands are independent, and within one the triangles come in their own order, so
    /// the result does not depend on the number of threads.
    pub(super) fn draw(&self, surface: &SurfaceMesh, band: usize, rows: usize) -> Raster {
        let (width, first) = (self.width, band * BAND);
        let mut near = vec![0.0f32; width * rows];
        let mut triangle = vec![NONE; width * rows];
        near.par_chunks_mut(BAND * width).zip(triangle.par_chunks_mut(BAND * width)).enumerate().for_each(
            |(i, (near, triangle))| {
                for t in self.binned.iter().flat_map(|bins| &bins[band + i]) {
                    let corners = surface.mesh.triangles[*t as usize].map(|v| self.points[v as usize]);
                    fill(corners, *t, self.section.as_ref(), width, first + i * BAND, near, triangle);
                }
                if let Some(section) = &self.section {
                    close(section, width, first + i * BAND, near, triangle);
                }
            },
        );
        Raster { first, width, near, triangle }
    }
}

/// Draws one triangle into rows that begin at `first`.
fn fill(
    p: [[f32; 3]; 3],
    id: u32,
    section: Option<&SeenSection>,
    width: usize,
    first: usize,
    near: &mut [f32],
    triangle: &mut [u32],
) {
    let p = p.map(|c| [c[0], c[1] - first as f32, c[2]]);
    let [a, b, c] = p;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 || !area.is_finite() {
        return;
    }
    let rows = near.len() / width;
    let span = |k: usize, end: usize| {
        let low = a[k].min(b[k]).min(c[k]) - 0.5;
        let high = a[k].max(b[k]).max(c[k]) - 0.5;
        (low.ceil().max(0.0) as usize, ((high.floor() + 1.0).max(0.0) as usize).min(end))
    };
    let (x0, x1) = span(0, width);
    let (y0, y1) = span(1, rows);
    let inverse = 1.0 / area;
    for y in y0..y1 {
        let fy = y as f32 + 0.5;
        for x in x0..x1 {
            let fx = x as f32 + 0.5;
            let u = ((b[0] - fx) * (c[1] - fy) - (b[1] - fy) * (c[0] - fx)) * inverse;
            let v = ((c[0] - fx) * (a[1] - fy) - (c[1] - fy) * (a[0] - fx)) * inverse;
            let w = 1.0 - u - v;
            if u < 0.0 || v < 0.0 || w < 0.0 {
                continue;
            }
            // Depth is affine over the screen.
            let z = u * a[2] + v * b[2] + w * c[2];
            let at = y * width + x;
            if z > near[at] && !section.is_some_and(|s| s.removes(f64::from(fx), f64::from(fy) + first as f64, z)) {
                near[at] = z;
                // Rows go down, so triangles that face the eye are clockwise.
                triangle[at] = if section.is_some() && area > 0.0 { id | INSIDE } else { id };
            }
        }
    }
}

/// Brings samples that see the inside of the solid to the section, where the solid is cut.
fn close(section: &SeenSection, width: usize, first: usize, near: &mut [f32], triangle: &mut [u32]) {
    for (at, (near, triangle)) in near.iter_mut().zip(triangle).enumerate() {
        if *triangle == NONE || *triangle & INSIDE == 0 {
            continue;
        }
        match section.near((at % width) as f64 + 0.5, (first + at / width) as f64 + 0.5) {
            Some(plane) => *near = plane,
            None => *triangle &= !INSIDE,
        }
    }
}

/// Barycentric coordinates in space of the point `p` of triangle `i`.
pub(super) fn weights(surface: &SurfaceMesh, i: u32, p: crate::math::Vec3) -> [f64; 3] {
    use crate::math::{cross, dot};
    let [a, b, c] = surface.mesh.corners(i as usize);
    let n = cross(sub(b, a), sub(c, a));
    let whole = dot(n, n);
    if whole == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let u = dot(n, cross(sub(b, p), sub(c, p))) / whole;
    let v = dot(n, cross(sub(c, p), sub(a, p))) / whole;
    [u, v, 1.0 - u - v].map(|w| w.clamp(0.0, 1.0))
}
