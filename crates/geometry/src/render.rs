//! Pictures of meshes, drawn on the processor.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::surface_mesh::SurfaceMesh;

mod camera;
mod font;
mod hatching;
mod legend;
mod line_drawing;
mod lines;
mod marks;
mod occlusion;
mod palette;
mod paper;
mod png;
mod raster;
mod section;
mod shade;
mod shading_normals;
mod shares;
mod space_lines;
mod svg_legend;
mod svg_path;
mod tint;
mod visible_parts;

use camera::Camera;
pub use camera::{Projection, View};
pub use line_drawing::{Page, line_drawing, line_drawing_fits};
pub use lines::Lines;
use lines::Tubes;
pub use marks::Marks;
use paper::Paper;
pub use png::png;
use raster::{BAND, Projected, Raster};
use section::SeenSection;
pub use section::{PlaneGrid, SectionPlane};
use shade::{Finish, Shader};
pub use shares::{Colours, SectionColours, Shares};
pub use tint::{Amount, Tint};

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
pub struct RenderOptions {
    /// The colours of the surface.
    pub colours: Option<Colours>,
    /// Lines, seen through the surface too. A surface without colours is pale then.
    pub lines: Option<Lines>,
    /// What is left out, of a closed surface; what the plane cuts is hatched.
    pub section: Option<SectionPlane>,
    /// The colours of what the plane cuts, where the surface has some.
    pub section_colours: Option<SectionColours>,
    /// Unit normals at the corners of the surface's triangles, three for each, by which it is shaded and its contours are found; those of
    /// the mesh where they are zero or none is given.
    pub normals: Option<Vec<[f32; 3]>>,
    /// What lies behind the surface.
    pub background: Background,
    /// What tells size and direction.
    pub marks: Marks,
}

impl RenderOptions {
    /// Whether a picture has room for the legend and the marks: there is none for them in a small one.
    pub fn fits(&self, view: &View) -> bool {
        let paper = Paper { size: view.size, channels: 3, bytes: Vec::new() };
        let marked = self.marks != Marks::default();
        (self.colours.is_none() && self.lines.is_none() && !marked) || !legend::rows(self, view, &paper).is_empty()
    }
}

/// The largest picture, in pixels.
const LARGEST: usize = 1 << 26;
/// Samples along each side of a pixel.
const OVER: usize = 3;
/// Samples drawn at once, more or less: larger pictures are drawn in bands of rows.
const SAMPLES: usize = 6_000_000;

/// Draws the surface; returns rows from the top, RGB, or RGBA (not premultiplied) on a transparent background.
///
/// Fitted to the bounds but for a margin of 4 % on each side, above legend and marks, +Z up, nine samples a pixel. The lattice is smooth
/// and warm, cuts by the region's boundary are flat and cool, unless the options have colours. The picture is the same for any number of threads. A side of 0 pixels
/// gives no rows; sizes beyond 2²⁶ pixels are answered by an empty picture as well.
pub fn render(surface: &SurfaceMesh, view: &View, options: &RenderOptions) -> Vec<u8> {
    render_in_bands(surface, view, options, SAMPLES)
}

/// Draws about `samples` samples at once.
fn render_in_bands(surface: &SurfaceMesh, view: &View, options: &RenderOptions, samples: usize) -> Vec<u8> {
    let channels = options.background.channels();
    let mut paper = Paper { size: view.size, channels, bytes: Vec::new() };
    let legend = legend::rows(options, view, &paper);
    let foot = legend::height(&legend, &paper) * OVER;
    let Some((bytes, per_mm)) = picture(surface, view, options, (foot, true), samples) else {
        return Vec::new();
    };
    paper.bytes = bytes;
    if !legend.is_empty() {
        legend::draw(&legend, &mut paper, per_mm);
    }
    paper.bytes
}

/// The rows of a picture that leaves `foot` samples free below the part, with a section hatched or not, and how many pixels a mm is, where
/// that is one number; None for sizes that are none.
fn picture(
    surface: &SurfaceMesh,
    view: &View,
    options: &RenderOptions,
    (foot, hatched): (usize, bool),
    samples: usize,
) -> Option<(Vec<u8>, Option<f64>)> {
    let [w, h] = view.size;
    let pixels = w.saturating_mul(h);
    if pixels == 0 || pixels > LARGEST || w > 1 << 15 || h > 1 << 15 {
        return None;
    }
    let bounds = surface.mesh.bounds();
    let drawn = !bounds.is_empty() && bounds.is_finite() && view.azimuth.is_finite() && view.elevation.is_finite();
    let channels = options.background.channels();
    let mut bytes = vec![0u8; channels * pixels];
    let mut per_mm = None;
    if drawn {
        let size = [w * OVER, h * OVER];
        let room = [size[0], size[1].saturating_sub(foot).max(1)];
        let section = options.section.map(|s| s.before_faces(&bounds));
        let section = section.as_ref();
        let shown = section.map_or_else(|| Cow::from(&surface.mesh.vertices), |s| Cow::from(s.kept(&surface.mesh)));
        let camera = Camera::new(&bounds, &shown, view, room);
        per_mm = Some(camera.samples_per_mm(1.0 / camera.distance) / OVER as f64);
        let finish = match (&options.colours, &options.lines) {
            (Some(colours), _) => Finish::Coloured(colours, options.section_colours.as_ref()),
            (None, Some(_)) => Finish::Pale,
            (None, None) => Finish::Plain,
        };
        let mut body = DrawnSurface::new(surface, &camera, size, (finish, options.normals.as_deref()), section);
        body.shader.hatched = hatched;
        let tubes = options.lines.as_ref().map(Tubes::of);
        let lines =
            tubes.as_ref().map(|t| DrawnSurface::new(&t.surface, &camera, size, (Finish::Lines(t), None), section));
        // Whole bands of the projection and whole rows of pixels.
        let rows = (samples / (size[0] * BAND)).max(1) * BAND;
        for (i, part) in bytes.chunks_mut(rows / OVER * w * channels).enumerate() {
            let (first, count) = (i * rows / BAND, part.len() / (channels * w) * OVER);
            let (raster, mut picture) = body.draw(first, count);
            if let Some((over, drawn)) = lines.as_ref().map(|l| l.draw(first, count)) {
                lines::overlay(&mut picture, &raster, &drawn, &over);
            }
            resolve(&picture, view.size, i * rows / OVER, options.background, part);
        }
    } else {
        resolve(&vec![[0.0; 4]; pixels * OVER * OVER], view.size, 0, options.background, &mut bytes);
    }
    Some((bytes, per_mm))
}

/// A surface in a picture.
struct DrawnSurface<'a> {
    surface: &'a SurfaceMesh,
    projected: Projected,
    shader: Shader<'a>,
}

impl<'a> DrawnSurface<'a> {
    fn new(
        surface: &'a SurfaceMesh,
        camera: &'a Camera,
        size: [usize; 2],
        finish: (Finish<'a>, Option<&'a [[f32; 3]]>),
        section: Option<&'a SectionPlane>,
    ) -> DrawnSurface<'a> {
        let projected = Projected::of(surface, camera, size, section);
        DrawnSurface { surface, projected, shader: Shader::new(surface, camera, size, finish, section) }
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
