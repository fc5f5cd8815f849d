//! Light: a key light, a sky and a back light.

use rayon::prelude::*;

use super::lines::Tubes;
use super::occlusion::Occlusion;
use super::raster::{INSIDE, NONE, Projected, Raster, weights};
use super::shading_normals::{ShadingNormals, area, is_cut};
use super::{Camera, Colours, Projection, SectionColours, SectionPlane, View};
use crate::math::{Vec3, add, dot, scale, unit};
use crate::surface_mesh::SurfaceMesh;

/// Colours in linear light.
const LATTICE: [f32; 3] = [0.83, 0.72, 0.56];
const CUT: [f32; 3] = [0.27, 0.38, 0.52];
/// Of lattice and of cuts where there are lines.
const PALE: [[f32; 3]; 2] = [[0.80, 0.79, 0.77], [0.66, 0.68, 0.70]];

/// Of a section, and its hatching.
const SECTION: [[f32; 3]; 2] = [[0.66, 0.16, 0.09], [0.40, 0.08, 0.05]];
/// Samples from one line of the hatching to the next, along a row, and the share of a line; its light where a section has colours.
const HATCH: (usize, usize) = (21, 5);
const DARKER: f32 = 0.62;

/// What a surface is made of.
#[derive(Clone, Copy)]
pub(super) enum Finish<'a> {
    /// The lattice warm, cuts cool.
    Plain,
    /// Both nearly white.
    Pale,
    /// In given colours; and those of a section.
    Coloured(&'a Colours, Option<&'a SectionColours>),
    /// Lines, which throw no shadows.
    Lines(&'a Tubes),
}

/// Background of the picture at a place from the left and from the top, 0 to 1.
pub(super) fn background(x: f32, y: f32) -> [f32; 3] {
    let d = ((x - 0.5).powi(2) + (y - 0.42).powi(2)).sqrt();
    let t = (d * 1.25).min(1.0).powi(2);
    [0.965 - 0.165 * t, 0.972 - 0.150 * t, 0.985 - 0.130 * t]
}

/// What the colours of a picture come from.
pub(super) struct Shader<'a> {
    surface: &'a SurfaceMesh,
    camera: &'a Camera,
    finish: Finish<'a>,
    normals: ShadingNormals<'a>,
    /// The direction to the key light.
    key: Vec3,
    shade: Option<(Shadows, Occlusion)>,
    section: Option<&'a SectionPlane>,
    /// Whether the section is hatched.
    pub hatched: bool,
}

impl<'a> Shader<'a> {
    /// Prepares a picture of `size` samples across and down, of a finish and normals at corners.
    pub(super) fn new(
        surface: &'a SurfaceMesh,
        camera: &'a Camera,
        size: [usize; 2],
        (finish, normals): (Finish<'a>, Option<&'a [[f32; 3]]>),
        section: Option<&'a SectionPlane>,
    ) -> Shader<'a> {
        let key = towards(camera, -0.55, 0.75, 0.60);
        let normals = ShadingNormals::of(surface, normals);
        let shade = match finish {
            Finish::Lines(_) => None,
            _ => Some((Shadows::cast(surface, key, section), Occlusion::of(surface, &normals, camera, size, section))),
        };
        Shader { surface, camera, finish, normals, key, shade, section, hatched: true }
    }

    /// Premultiplied colour and cover of each sample.
    pub(super) fn shade(&self, raster: &Raster) -> Vec<[f32; 4]> {
        let width = raster.width;
        let mut picture = vec![[0.0f32; 4]; raster.near.len()];
        picture.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let at = y * width + x;
                if raster.triangle[at] != NONE {
                    let [r, g, b] = self.colour(x, raster.first + y, raster.near[at], raster.triangle[at]);
                    *out = [r, g, b, 1.0];
                }
            }
        });
        picture
    }

    /// The light from a triangle at a sample.
    fn colour(&self, x: usize, y: usize, near: f32, triangle: u32) -> [f32; 3] {
        let (surface, camera) = (self.surface, self.camera);
        let p = camera.unproject(x as f64 + 0.5, y as f64 + 0.5, f64::from(near));
        let eye = camera.towards(p);
        if triangle & INSIDE != 0
            && let Some(section) = self.section
        {
            return self.cut_through(section, [x, y], near, p, eye);
        }
        let cut = is_cut(surface, triangle as usize);
        let t = surface.mesh.triangles[triangle as usize].map(|v| v as usize);
        let k = weights(surface, triangle, p);
        let outward = self.normals.within(surface, triangle, k);
        let colour = match self.finish {
            Finish::Coloured(colours, _) => colours.at(t, k, outward),
            Finish::Lines(tubes) => tubes.colour(t[0]),
            Finish::Pale => PALE[usize::from(cut)],
            Finish::Plain if cut => CUT,
            Finish::Plain => LATTICE,
        };
        // An open mesh may show its inside.
        let inside = dot(area(surface, triangle as usize), eye) < 0.0;
        let n = if inside { scale(outward, -1.0) } else { outward };
        let (sun, open) = self.light([x, y], near, p, n);
        lit([n, eye, self.key], sun, camera, colour, open, cut)
    }

    /// The light from the solid that a section cuts.
    fn cut_through(&self, section: &SectionPlane, [x, y]: [usize; 2], near: f32, p: Vec3, eye: Vec3) -> [f32; 3] {
        let line = self.hatched && (x + y) % HATCH.0 < HATCH.1;
        let colour = match self.finish {
            Finish::Lines(_) => SECTION[1],
            Finish::Coloured(colours, Some(of)) => colours.inside(of, p).map(|c| if line { DARKER * c } else { c }),
            _ => SECTION[usize::from(line)],
        };
        let (sun, open) = self.light([x, y], near, p, section.normal);
        lit([section.normal, eye, self.key], sun, self.camera, colour, open, true)
    }

    /// The shares of the key light and of the sky that reach a point of a surface of normal `n`: the one that is shaded by, so that no facets
    /// show where the key light grazes.
    fn light(&self, [x, y]: [usize; 2], near: f32, p: Vec3, n: Vec3) -> (f32, f32) {
        match &self.shade {
            Some((shadows, occlusion)) => (shadows.light(p, n), occlusion.open(x, y, near)),
            None => (1.0, 1.0),
        }
    }
}

/// A direction by its parts to the right, up and towards the eye.
fn towards(camera: &Camera, right: f64, up: f64, out: f64) -> Vec3 {
    let [r, u, o] = camera.axes;
    unit(add(scale(r, right), add(scale(u, up), scale(o, out))))
}

/// What the key light sees.
struct Shadows {
    eye: Camera,
    raster: Raster,
    /// Length of one of its samples, mm.
    texel: f64,
}

impl Shadows {
    /// Samples across and down.
    const SIZE: usize = 2048;

    /// Draws the surface as seen along the light.
    fn cast(surface: &SurfaceMesh, key: Vec3, section: Option<&SectionPlane>) -> Shadows {
        let size = [Self::SIZE; 2];
        let azimuth = key[1].atan2(key[0]).to_degrees();
        let elevation = key[2].clamp(-1.0, 1.0).asin().to_degrees();
        let view = View { size, azimuth, elevation, projection: Projection::Perspective };
        let eye = Camera::new(&surface.mesh.bounds(), &surface.mesh.vertices, &view, size);
        let raster = Projected::of(surface, &eye, size, section).draw(surface, 0, Self::SIZE);
        let texel = eye.distance / eye.focal;
        Shadows { eye, raster, texel }
    }

    /// The share of the light that reaches a point of a face with this normal, softened over 5×5 samples.
    fn light(&self, p: Vec3, flat: Vec3) -> f32 {
        let side = if dot(flat, self.eye.axes[2]) < 0.0 { -1.0 } else { 1.0 };
        // A step off the face and towards the light keeps the face from shading itself.
        let lift = add(scale(flat, side * 2.0 * self.texel), scale(self.eye.axes[2], 2.5 * self.texel));
        let [x, y, near] = self.eye.project(add(p, lift));
        let (mut seen, mut all) = (0.0, 0.0);
        for j in -2i64..=2 {
            for i in -2i64..=2 {
                let (x, y) = (x.floor() as i64 + 2 * i, y.floor() as i64 + 2 * j);
                let inside = (0..Self::SIZE as i64).contains(&x) && (0..Self::SIZE as i64).contains(&y);
                let hidden = inside && f64::from(self.raster.near[y as usize * Self::SIZE + x as usize]) > near;
                let weight = 1.0 / (1.0 + (i * i + j * j) as f32);
                seen += if hidden { 0.0 } else { weight };
                all += weight;
            }
        }
        seen / all
    }
}

/// The light that leaves a surface towards the eye; `sun` is the share of the key light that reaches it.
fn lit([n, eye, key]: [Vec3; 3], sun: f32, camera: &Camera, colour: [f32; 3], open: f32, cut: bool) -> [f32; 3] {
    let fill = towards(camera, 0.85, 0.10, 0.55);
    let rim = towards(camera, 0.35, 0.45, -0.85);
    let diffuse = |l: Vec3| dot(n, l).max(0.0) as f32;
    // A little wrap keeps the key's shadow line soft.
    let key_light = ((dot(n, key) as f32 + 0.15) / 1.15).max(0.0);
    let sky = 0.5 + 0.5 * n[2] as f32;
    let half = unit(add(key, eye));
    let gloss = dot(n, half).max(0.0).powi(if cut { 24 } else { 48 }) as f32;
    let edge = (1.0 - dot(n, eye).clamp(0.0, 1.0)).powi(3) as f32;
    let shadow = 0.35 + 0.65 * open;
    let tint_key = [1.00, 0.965, 0.91];
    let tint_sky = [0.86, 0.93, 1.00];
    let tint_ground = [0.82, 0.76, 0.70];
    core::array::from_fn(|k| {
        let ambient = open * open.sqrt() * 0.46 * (sky * tint_sky[k] + (1.0 - sky) * 0.75 * tint_ground[k]);
        let direct = shadow * (0.86 * sun * key_light * tint_key[k] + 0.16 * diffuse(fill) * tint_sky[k]);
        let shine = open * (0.13 * sun * gloss * tint_key[k] + (0.25 * diffuse(rim) + 0.08) * edge * tint_sky[k]);
        let v = colour[k] * (ambient + direct) + shine;
        // Highlights roll off instead of clipping.
        if v > 0.75 { 0.75 + 0.25 * ((v - 0.75) / 0.25).tanh() } else { v }
    })
}
