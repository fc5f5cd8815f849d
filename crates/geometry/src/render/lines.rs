//! Lines in a picture: tubes with round ends, seen through the surface.

use super::palette::{self, LINES};
use super::raster::Raster;
use super::tint::decode;
use crate::math::{Vec3, add, cross, norm, scale, sub, unit};
use crate::surface_mesh::SurfaceMesh;

/// Lines with names, each name with a colour.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// What they are, in words.
    pub caption: String,
    /// The kinds of lines.
    pub names: Vec<String>,
    /// The kind of each line, and its points (mm).
    pub lines: Vec<(usize, Vec<Vec3>)>,
    /// Half their width, mm.
    pub radius: f64,
}

/// Corners round a tube; rings of a ball from pole to pole.
const SIDES: usize = 12;
const RINGS: usize = 6;
/// What is seen of a line behind the surface.
const THROUGH: f32 = 0.78;

/// The surface of lines, and the kind of each vertex.
#[derive(Default)]
pub(super) struct Tubes {
    pub surface: SurfaceMesh,
    kinds: Vec<usize>,
}

impl Tubes {
    /// Lines of points that are not finite are left out.
    pub fn of(lines: &Lines) -> Tubes {
        let mut made = Tubes::default();
        if !(lines.radius > 0.0 && lines.radius.is_finite()) {
            return made;
        }
        for (kind, points) in &lines.lines {
            if points.iter().flatten().any(|v| !v.is_finite()) {
                continue;
            }
            points.iter().for_each(|p| made.ball(*p, lines.radius));
            points.windows(2).for_each(|p| made.tube(p[0], p[1], lines.radius));
            made.kinds.resize(made.surface.mesh.vertices.len(), *kind);
        }
        made.surface.cut = vec![false; made.surface.mesh.triangles.len()];
        made
    }

    /// The colour of a vertex, in linear light.
    pub fn colour(&self, vertex: usize) -> [f32; 3] {
        palette::colour(&LINES, self.kinds.get(vertex).copied().unwrap_or(0)).map(decode)
    }

    fn ball(&mut self, center: Vec3, radius: f64) {
        let ring = |k: usize| {
            let (s, c) = (core::f64::consts::PI * k as f64 / RINGS as f64).sin_cos();
            (add(center, [0.0, 0.0, -radius * c]), radius * s)
        };
        for k in 0..RINGS {
            let [(p, r), (q, s)] = [ring(k), ring(k + 1)];
            self.band([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], (p, r), (q, s));
        }
    }

    fn tube(&mut self, a: Vec3, b: Vec3, radius: f64) {
        let along = sub(b, a);
        if norm(along) == 0.0 {
            return;
        }
        let least = (0..3).fold(0, |k, i| if along[i].abs() < along[k].abs() { i } else { k });
        let mut off = [0.0; 3];
        off[least] = 1.0;
        let across = unit(cross(along, off));
        self.band([across, unit(cross(along, across))], (a, radius), (b, radius));
    }

    /// The strip between two circles in the plane of `axes`; their product points from the first to the second.
    fn band(&mut self, axes: [Vec3; 2], (p, r): (Vec3, f64), (q, s): (Vec3, f64)) {
        let mesh = &mut self.surface.mesh;
        let first = mesh.vertices.len() as u32;
        for i in 0..SIDES {
            let (sine, cosine) = (core::f64::consts::TAU * i as f64 / SIDES as f64).sin_cos();
            let out = add(scale(axes[0], cosine), scale(axes[1], sine));
            mesh.vertices.extend([add(p, scale(out, r)), add(q, scale(out, s))]);
        }
        for i in 0..SIDES as u32 {
            let [a, b] = [2 * i, 2 * i + 1].map(|v| first + v);
            let [c, d] = [2 * (i + 1), 2 * (i + 1) + 1].map(|v| first + v % (2 * SIDES as u32));
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
}

/// Draws lines into a picture: over what is behind them, and through what is before them.
pub(super) fn overlay(picture: &mut [[f32; 4]], surface: &Raster, drawn: &[[f32; 4]], lines: &Raster) {
    for (i, (out, line)) in picture.iter_mut().zip(drawn).enumerate().filter(|(_, (_, line))| line[3] > 0.0) {
        let share = if lines.near[i] >= surface.near[i] { 1.0 } else { THROUGH };
        (0..4).for_each(|k| out[k] += share * (line[k] - out[k]));
    }
}
