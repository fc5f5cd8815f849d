//! Pictures of meshes, drawn on the processor.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::surface_mesh::SurfaceMesh;

mod font;
mod hatching;
mod legend;
mod line_drawing;
mod lines;
mod occlusion;
mod paper;
mod png;
mod raster;
mod section;
mod shade;
mod shares;
mod space_lines;
mod tint;
mod visible_parts;

pub use line_drawing::line_drawing;
pub use lines::Lines;
use lines::Tubes;
use paper::Paper;
pub use png::png;
use raster::{BAND, Projected, Raster};
pub use section::Section;
use section::SeenSection;
use shade::{Finish, Shader};
pub use shares::{Colours, Shares};
pub use tint::Tint;

/// How to draw.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Direction from which the camera looks: azimuth about +Z (degrees from +X towards +Y).
    pub azimuth: f64,
    /// Elevation above the XY plane, degrees.
    pub elevation: f64,
}

/// What lies behind a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// A light grey that darkens towards the corners.
    #[default]
    Shaded,
    /// White.
    White,
    /// Nothing: pixels have alpha.
    Transparent,
}

impl Background {
    /// Bytes of a pixel: RGB or RGBA.
    pub fn channels(self) -> usize {
        if self == Background::Transparent { 4 } else { 3 }
    }
}

/// What a picture shows besides the form of a surface; a legend says what is what.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// The colours of the surface.
    pub colours: Option<Colours>,
    /// Lines, seen through the surface too. A surface without colours is pale then.
    pub lines: Option<Lines>,
    /// What is left out, of a closed surface; what the plane cuts is hatched.
    pub section: Option<Section>,
    /// What lies behind the surface.
    pub background: Background,
}

/// The largest picture, in pixels.
const LARGEST: usize = 1 << 26;
/// Samples along each side of a pixel.
const OVER: usize = 3;
/// Samples drawn at once, more or less: larger pictures are drawn in bands of rows.
const SAMPLES: usize = 6_000_000;

/// Where the eye is and how it sees: right, up, and from the scene to the eye.
struct Camera {
    center: Vec3,
    axes: [Vec3; 3],
    /// Distance from the centre (mm).
    distance: f64,
    /// Samples per unit of slope.
    focal: f64,
    middle: [f64; 2],
}

impl Camera {
    /// A camera with a narrow lens, such that the points fill the picture but for a margin.
    fn new(bounds: &Aabb, points: &[Vec3], view: &View, size: [usize; 2]) -> Camera {
        let (az, el) = (view.azimuth.to_radians(), view.elevation.clamp(-90.0, 90.0).to_radians());
        let out = [az.cos() * el.cos(), az.sin() * el.cos(), el.sin()];
        let right = [-az.sin(), az.cos(), 0.0];
        let axes = [right, cross(out, right), out];
        let radius = (norm(bounds.size()) / 2.0).max(1e-9);
        let distance = radius * 6.0;
        let mut camera =
            Camera { center: bounds.center(), axes, distance, focal: 1.0, middle: size.map(|n| n as f64 / 2.0) };
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
    fn scaled(&self, factor: f64) -> Camera {
        Camera { focal: factor * self.focal, middle: self.middle.map(|m| factor * m), ..*self }
    }

    /// Column, row (samples) and depth: the inverse distance along the view, greater when nearer.
    fn project(&self, p: Vec3) -> [f64; 3] {
        let d = sub(p, self.center);
        let near = 1.0 / (self.distance - dot(d, self.axes[2]));
        let k = self.focal * near;
        [self.middle[0] + k * dot(d, self.axes[0]), self.middle[1] - k * dot(d, self.axes[1]), near]
    }

    /// The point of the scene behind a sample.
    fn unproject(&self, x: f64, y: f64, near: f64) -> Vec3 {
        let k = 1.0 / (self.focal * near);
        let right = (x - self.middle[0]) * k;
        let up = (self.middle[1] - y) * k;
        let out = self.distance - 1.0 / near;
        let axes = self.axes;
        add(self.center, add(scale(axes[0], right), add(scale(axes[1], up), scale(axes[2], out))))
    }

    /// The direction from a point to the eye.
    fn towards(&self, p: Vec3) -> Vec3 {
        unit(sub(add(self.center, scale(self.axes[2], self.distance)), p))
    }
}

/// Draws the surface; returns rows from the top, RGB, or RGBA (not premultiplied) on a transparent background.
///
/// Perspective with a narrow lens, fitted to the bounds, +Z up, nine samples a pixel. The lattice is smooth and warm, cuts by the region's
/// boundary are flat and cool, unless the look has colours of its own. The picture is the same for any number of threads. A side of 0 pixels
/// gives no rows; sizes beyond 2²⁶ pixels are answered by an empty picture as well.
pub fn render(surface: &SurfaceMesh, view: &View, look: &Look) -> Vec<u8> {
    render_in_bands(surface, view, look, SAMPLES)
}

/// Draws about `samples` samples at once.
fn render_in_bands(surface: &SurfaceMesh, view: &View, look: &Look, samples: usize) -> Vec<u8> {
    let [w, h] = view.size;
    let pixels = w.saturating_mul(h);
    if pixels == 0 || pixels > LARGEST || w > 1 << 15 || h > 1 << 15 {
        return Vec::new();
    }
    let bounds = surface.mesh.bounds();
    let drawn = !bounds.is_empty() && bounds.is_finite() && view.azimuth.is_finite() && view.elevation.is_finite();
    let channels = look.background.channels();
    let mut paper = Paper { size: [w, h], channels, bytes: vec![0u8; channels * pixels] };
    let legend = legend::rows(look, &paper);
    if drawn {
        let size = [w * OVER, h * OVER];
        let room = [size[0], size[1] - legend::height(&legend, &paper) * OVER];
        let section = look.section.as_ref();
        let shown = section.map_or_else(|| Cow::from(&surface.mesh.vertices), |s| Cow::from(s.kept(&surface.mesh)));
        let camera = Camera::new(&bounds, &shown, view, room);
        let finish = match (&look.colours, &look.lines) {
            (Some(colours), _) => Finish::Coloured(colours),
            (None, Some(_)) => Finish::Pale,
            (None, None) => Finish::Plain,
        };
        let body = Layer::new(surface, &camera, size, finish, section);
        let tubes = look.lines.as_ref().map(Tubes::of);
        let lines = tubes.as_ref().map(|t| Layer::new(&t.surface, &camera, size, Finish::Lines(t), section));
        // Whole bands of the projection and whole rows of pixels.
        let rows = (samples / (size[0] * BAND)).max(1) * BAND;
        for (i, part) in paper.bytes.chunks_mut(rows / OVER * w * channels).enumerate() {
            let (first, count) = (i * rows / BAND, part.len() / (channels * w) * OVER);
            let (raster, mut picture) = body.draw(first, count);
            if let Some((over, drawn)) = lines.as_ref().map(|l| l.draw(first, count)) {
                lines::overlay(&mut picture, &raster, &drawn, &over);
            }
            resolve(&picture, view.size, i * rows / OVER, look.background, part);
        }
    } else {
        resolve(&vec![[0.0; 4]; pixels * OVER * OVER], view.size, 0, look.background, &mut paper.bytes);
    }
    if !legend.is_empty() {
        legend::draw(&legend, &mut paper);
    }
    paper.bytes
}

/// A surface in a picture.
struct Layer<'a> {
    surface: &'a SurfaceMesh,
    projected: Projected,
    shader: Shader<'a>,
}

impl<'a> Layer<'a> {
    fn new(
        surface: &'a SurfaceMesh,
        camera: &'a Camera,
        size: [usize; 2],
        finish: Finish<'a>,
        section: Option<&'a Section>,
    ) -> Layer<'a> {
        let projected = Projected::of(surface, camera, size, section);
        Layer { surface, projected, shader: Shader::new(surface, camera, size, finish, section) }
    }

    /// What samples see, and their colours, for `rows` rows from a band on.
    fn draw(&self, band: usize, rows: usize) -> (Raster, Vec<[f32; 4]>) {
        let raster = self.projected.draw(self.surface, band, rows);
        let picture = self.shader.shade(&raster);
        (raster, picture)
    }
}

/// Averages the samples of each pixel over the background and encodes them as sRGB, for the rows from `first` on. On a transparent one the
/// colour is that of what covers the pixel alone: programs that mix it with theirs by alpha then show no seam.
fn resolve(picture: &[[f32; 4]], [w, h]: [usize; 2], first: usize, background: Background, bytes: &mut [u8]) {
    let channels = background.channels();
    bytes.par_chunks_mut(w * channels).enumerate().for_each(|(y, row)| {
        for x in 0..w {
            let mut sum = [0.0f32; 4];
            for j in 0..OVER {
                let start = (y * OVER + j) * w * OVER + x * OVER;
                for s in &picture[start..start + OVER] {
                    (0..4).for_each(|k| sum[k] += s[k]);
                }
            }
            let n = (OVER * OVER) as f32;
            let back = match background {
                Background::Shaded => {
                    shade::background((x as f32 + 0.5) / w as f32, ((first + y) as f32 + 0.5) / h as f32)
                }
                Background::White => [1.0; 3],
                Background::Transparent => [0.0; 3],
            };
            let whole = if background == Background::Transparent { sum[3].max(1e-6) } else { n };
            for k in 0..3 {
                row[channels * x + k] = encode((sum[k] + (n - sum[3]) * back[k]) / whole);
            }
            if channels == 4 {
                row[4 * x + 3] = (sum[3] / n * 255.0 + 0.5) as u8;
            }
        }
    });
}

/// Linear light to an sRGB byte.
fn encode(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests;
