//! Light: a key light, a sky and a back light, and ambient occlusion.

use std::collections::HashMap;

use rayon::prelude::*;

use super::raster::{NONE, Raster, weights};
use super::{Camera, Tint, View};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::surface_mesh::SurfaceMesh;

/// Colours in linear light.
const LATTICE: [f32; 3] = [0.83, 0.72, 0.56];
const CUT: [f32; 3] = [0.27, 0.38, 0.52];
/// Samples of the sky about each point.
const SKY: usize = 20;

/// Background of the picture at a place from the left and from the top, 0 to 1.
pub(super) fn background(x: f32, y: f32) -> [f32; 3] {
    let d = ((x - 0.5).powi(2) + (y - 0.42).powi(2)).sqrt();
    let t = (d * 1.25).min(1.0).powi(2);
    [0.965 - 0.165 * t, 0.972 - 0.150 * t, 0.985 - 0.130 * t]
}

/// Premultiplied colour and cover of each sample.
pub(super) fn shade(surface: &SurfaceMesh, camera: &Camera, raster: &Raster, tint: Option<&Tint>) -> Vec<[f32; 4]> {
    let normals = Normals::of(surface);
    let [w, h] = raster.size;
    let open = occlusion(camera, raster);
    let key = towards(camera, -0.55, 0.75, 0.60);
    let shadows = Shadows::cast(surface, key);
    let mut picture = vec![[0.0f32; 4]; w * h];
    picture.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let at = y * w + x;
            let id = raster.triangle[at];
            if id == NONE {
                continue;
            }
            let p = camera.unproject(x as f64 + 0.5, y as f64 + 0.5, f64::from(raster.near[at]));
            let eye = camera.towards(p);
            let cut = surface.cut.get(id as usize).copied().unwrap_or(false);
            let flat = unit(area(surface, id as usize));
            let t = surface.mesh.triangles[id as usize].map(|v| v as usize);
            let k = weights(surface, id, p);
            let n = (0..3).fold([0.0; 3], |n, i| add(n, scale(normals.at(surface, t[i], flat), k[i])));
            let mut n = if norm(n) > 0.0 { unit(n) } else { flat };
            // An open mesh may show its inside.
            if dot(flat, eye) < 0.0 {
                n = scale(n, -1.0);
            }
            let colour = match tint {
                Some(tint) => {
                    let value = |i: usize| tint.values.get(t[i]).copied().unwrap_or(f64::NAN);
                    tint.colour((0..3).map(|i| k[i] * value(i)).sum())
                }
                None if cut => CUT,
                None => LATTICE,
            };
            let sun = shadows.light(p, flat);
            let light = lit([n, eye, key], sun, camera, colour, open[at], cut);
            *out = [light[0], light[1], light[2], 1.0];
        }
    });
    picture
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
    fn cast(surface: &SurfaceMesh, key: Vec3) -> Shadows {
        let size = [Self::SIZE; 2];
        let azimuth = key[1].atan2(key[0]).to_degrees();
        let elevation = key[2].clamp(-1.0, 1.0).asin().to_degrees();
        let eye = Camera::new(&surface.mesh.bounds(), &surface.mesh.vertices, &View { size, azimuth, elevation }, size);
        let raster = Raster::draw(surface, &eye, size);
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

/// Normals at vertices, weighted by area: one for each vertex, but where faces meet in an edge, one for each side.
struct Normals {
    smooth: Vec<[f32; 3]>,
    /// The triangles about a vertex on an edge.
    edges: HashMap<usize, Vec<u32>>,
}

impl Normals {
    /// Cosine of the angle from which on faces meet in an edge: 35°.
    const EDGE: f64 = 0.82;

    fn of(surface: &SurfaceMesh) -> Normals {
        let mesh = &surface.mesh;
        let mut sums = vec![[0.0f32; 3]; mesh.vertices.len()];
        for (i, t) in mesh.triangles.iter().enumerate() {
            let n = area(surface, i);
            for v in t {
                (0..3).for_each(|k| sums[*v as usize][k] += n[k] as f32);
            }
        }
        sums.par_iter_mut().for_each(|n| *n = unit(n.map(f64::from)).map(|c| c as f32));
        let apart = |i: usize, v: u32| dot(unit(area(surface, i)), sums[v as usize].map(f64::from)) < Self::EDGE;
        let mut edges = HashMap::new();
        for (i, t) in mesh.triangles.iter().enumerate() {
            for v in t.iter().filter(|v| apart(i, **v)) {
                edges.entry(*v as usize).or_insert_with(Vec::new);
            }
        }
        for (i, t) in mesh.triangles.iter().enumerate() {
            for v in t {
                if let Some(around) = edges.get_mut(&(*v as usize)) {
                    around.push(i as u32);
                }
            }
        }
        Normals { smooth: sums, edges }
    }

    /// The normal at a vertex of a face whose own is `flat`.
    fn at(&self, surface: &SurfaceMesh, vertex: usize, flat: Vec3) -> Vec3 {
        let Some(around) = self.edges.get(&vertex) else {
            return self.smooth[vertex].map(f64::from);
        };
        let near = around.iter().map(|i| area(surface, *i as usize));
        let sum = near.filter(|n| dot(*n, flat) > Self::EDGE * norm(*n)).fold([0.0; 3], add);
        if norm(sum) > 0.0 { unit(sum) } else { flat }
    }
}

/// Twice the area of a triangle, along its normal.
fn area(surface: &SurfaceMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = surface.mesh.corners(triangle);
    cross(sub(b, a), sub(c, a))
}

/// How much of the sky each sample sees (1 all, 0 nothing), from the depths about it.
///
/// Alchemy's estimator (McGuire et al. 2011): neighbours on a spiral count by how far they stand above the tangent
/// plane, and less the farther they are. It is worked out on every second sample and smoothed among equals.
fn occlusion(camera: &Camera, raster: &Raster) -> Vec<f32> {
    const STRIDE: usize = 2;
    let [w, h] = raster.size;
    let (cw, ch) = (w.div_ceil(STRIDE), h.div_ceil(STRIDE));
    let at = |x: usize, y: usize| (y * STRIDE).min(h - 1) * w + (x * STRIDE).min(w - 1);
    let point = |x: usize, y: usize| {
        let near = raster.near[at(x, y)];
        let p = camera.unproject((x * STRIDE) as f64 + 0.5, (y * STRIDE) as f64 + 0.5, f64::from(near));
        (near > 0.0).then_some(p)
    };
    let scene = camera.distance / 6.0;
    // Two reaches: the openings of a cell, and the part as a whole.
    let reaches = [0.05 * scene, 0.22 * scene];
    let mut raw = vec![1.0f32; cw * ch];
    raw.par_chunks_mut(cw).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let Some(p) = point(x, y) else { continue };
            let n = screen_normal(&point, p, x, y, [cw, ch], camera);
            let near = f64::from(raster.near[at(x, y)]);
            // A pattern of 4×4 turns, the same in every picture.
            let turn = ((x & 3) + 4 * (y & 3)) as f64 * 0.618_033_988_75 * core::f64::consts::TAU;
            let mut dark = 0.0;
            for (reach, weight) in reaches.into_iter().zip([0.62, 0.38]) {
                let radius = (camera.focal * near * reach / STRIDE as f64).max(2.0);
                let mut sum = 0.0;
                for k in 0..SKY {
                    let r = radius * ((k as f64 + 0.5) / SKY as f64);
                    let (s, c) = (turn + k as f64 * 2.399_963_229_73).sin_cos();
                    let (sx, sy) = (x as f64 + r * c, y as f64 + r * s);
                    if sx < 0.0 || sy < 0.0 || sx >= cw as f64 || sy >= ch as f64 {
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
    let smooth = smoothed(&raw, [cw, ch], |x, y| raster.near[at(x, y)]);
    let mut open = vec![1.0f32; w * h];
    open.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            // The nearest in depth of the four coarse samples about this one.
            let here = raster.near[y * w + x];
            let mut best = f32::INFINITY;
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (cx, cy) = ((x / STRIDE + i).min(cw - 1), (y / STRIDE + j).min(ch - 1));
                let gap = (raster.near[at(cx, cy)] - here).abs();
                if gap < best {
                    best = gap;
                    *out = smooth[cy * cw + cx];
                }
            }
        }
    });
    open
}

/// The normal of the surface seen about a sample, from the nearer of its neighbours in depth on each axis.
fn screen_normal(
    point: &impl Fn(usize, usize) -> Option<Vec3>,
    p: Vec3,
    x: usize,
    y: usize,
    [w, h]: [usize; 2],
    camera: &Camera,
) -> Vec3 {
    let pick = |before: Option<Vec3>, after: Option<Vec3>| {
        let (a, b) = (before.map(|q| sub(p, q)), after.map(|q| sub(q, p)));
        match (a, b) {
            (Some(a), Some(b)) => Some(if dot(a, a) < dot(b, b) { a } else { b }),
            (a, b) => a.or(b),
        }
    };
    let dx = pick(x.checked_sub(1).and_then(|x| point(x, y)), (x + 1 < w).then(|| point(x + 1, y)).flatten());
    let dy = pick(y.checked_sub(1).and_then(|y| point(x, y)), (y + 1 < h).then(|| point(x, y + 1)).flatten());
    match (dx, dy) {
        (Some(dx), Some(dy)) => unit(cross(dy, dx)),
        _ => camera.axes[2],
    }
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
