//! A map that sweeps a lattice along a curve: cells across it and along it, in a rotation-minimizing frame.
//!
//! A cubic spline c goes through the control points. A position belongs to the nearest point of it, s is the arc length up to there (mm), and
//! its coordinates across are those in a frame N₁, N₂ that does not rotate about the line (double reflection: Wang, Jüttler,
//! Zheng, Liu, Computation of rotation minimizing frames, ACM Trans. Graph. 27, 2008). With the curvature vector κ and
//! d = x − c then ∇s = T/(1 − κ·d), ∇(d·N₁) = N₁. Cells fold where κ·d ≥ 1, at the centre of curvature, and tear where two points
//! of the line are nearest. A line that closes has a whole number of cells, and what its frame has turned by after one round is
//! spread over its length.

mod feet;
mod line;
mod room;
#[cfg(test)]
mod tests;

use multiversion::multiversion;

use super::Mapping;
use super::inverse::{listed, whole};
use crate::field::Field;
use feet::{LANES, Starts};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Mat3, Vec3, add, dot, norm, scale, sub};
use line::{CurveParameter, FramedCurve};

/// A line along which a lattice is swept, and the cells requested.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Control points, mm.
    pub points: Vec<Vec3>,
    /// Whether the last is followed by the first.
    pub closed: bool,
    /// Cell edges (mm): two across the line and one along it.
    pub wavelength: Vec3,
    /// Direction of the cell's first edge at the start, projected across the line; chosen if not given.
    pub normal: Option<Vec3>,
}

/// A lattice swept along a line. Phases are (a/λ₁, b/λ₂, s/λ₃).
#[derive(Clone, Debug)]
pub struct Sweep {
    line: FramedCurve,
    /// Where searches for feet start, in the region and about it.
    starts: Starts,
    wavelength: Vec3,
    /// Its inverses, turns per mm.
    per_mm: Vec3,
    /// The reach of the line (Federer), mm: within this distance the nearest point is unique.
    reach: f64,
    /// Least and greatest length of a cell along the line in the region, mm.
    along: [f64; 2],
    /// The Jacobians where cells are shortest and longest.
    extremes: [Mat3; 2],
}

/// Coordinates of a position relative to the line.
struct CurveCoordinates {
    s: f64,
    /// Coordinates along N₁ and N₂.
    across: [f64; 2],
    tangent: Vec3,
    normals: [Vec3; 2],
    /// 1 − κ·d.
    stretch: f64,
}

impl Sweep {
    /// Solves for the line; `samples` are positions in the region, at which the map must neither fold nor tear.
    ///
    /// # Errors
    /// Too few points, neighbours that coincide, lengths that are not positive, a normal along the line; a fold or a tear in
    /// the region, with the position.
    pub fn new(path: &Path, region: &dyn Field, samples: &[Vec3]) -> Result<Sweep, Fault> {
        let Path { points, closed, .. } = path;
        let least = if *closed { 3 } else { 2 };
        if points.len() < least || points.iter().flatten().any(|v| !v.is_finite()) {
            let message =
                format!("{} points; a line to sweep along needs at least {least}, of finite numbers", points.len());
            return Err(Fault::new("points", message));
        }
        if let Some(w) = path.wavelength.iter().find(|w| !(**w > 0.0 && w.is_finite())) {
            let message = format!("{} mm; a wavelength is a positive, finite length", number(*w));
            return Err(Fault::new("wavelength", message));
        }
        let line = FramedCurve::new(points, *closed, path.normal)?;
        let mut wavelength = path.wavelength;
        if *closed {
            wavelength[2] = line.length / (line.length / wavelength[2]).round().max(1.0);
        }
        let around = samples.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let reach = line.reach(norm(around.size()));
        let mut made = Sweep {
            line,
            starts: Starts::default(),
            wavelength,
            per_mm: wavelength.map(|w| 1.0 / w),
            reach,
            along: [wavelength[2]; 2],
            extremes: [[[0.0; 3]; 3]; 2],
        };
        made.refuse_folds(region, samples)?;
        if !around.is_empty() {
            let halo = 0.25 * wavelength.into_iter().fold(f64::INFINITY, f64::min);
            made.starts = Starts::new(&made.line, reach, &around.grown(halo));
        }
        Ok(made)
    }

    #[inline(always)]
    fn local(&self, p: Vec3) -> CurveCoordinates {
        self.local_at(p, self.line.foot(p, self.starts.at(&self.line, p)))
    }

    /// Coordinates relative to the line of a position whose foot is known.
    #[inline(always)]
    fn local_at(&self, p: Vec3, (span, x): CurveParameter) -> CurveCoordinates {
        let (c, first, second) = self.line.spans[span].at(x);
        let d = sub(p, c);
        let [a0, a1, a2, b0, b1, b2, s, _] = self.line.row((span, x));
        let normals = [[a0, a1, a2], [b0, b1, b2]];
        let squared = dot(first, first);
        CurveCoordinates {
            s,
            across: normals.map(|n| dot(d, n)),
            tangent: scale(first, 1.0 / squared.sqrt()),
            normals,
            stretch: 1.0 - dot(second, d) / squared,
        }
    }

    /// Hands the coordinates of each point over, with its index.
    #[inline(always)]
    fn each(&self, points: &[Vec3], mut take: impl FnMut(usize, CurveCoordinates)) {
        let whole = points.chunks_exact(LANES);
        let rest = points.len() - whole.remainder().len();
        for (n, chunk) in whole.enumerate() {
            let p: &[Vec3; LANES] = chunk.try_into().unwrap_or(&[[0.0; 3]; LANES]);
            let feet = self.line.feet(p, &p.map(|p| self.starts.at(&self.line, p)));
            for l in 0..LANES {
                take(n * LANES + l, self.local_at(p[l], feet[l]));
            }
        }
        for (n, p) in points.iter().enumerate().skip(rest) {
            take(n, self.local(*p));
        }
    }

    /// The distance from the line, mm.
    fn away(&self, p: Vec3) -> f64 {
        let l = self.local(p);
        l.across[0].hypot(l.across[1])
    }

    /// Cell edges as they come out (mm): a line that closes has a whole number of cells.
    pub fn edges(&self) -> Vec3 {
        self.wavelength
    }

    /// The length of the line, mm.
    pub fn length(&self) -> f64 {
        self.line.length
    }

    /// The phase (turns) at a point (mm).
    #[inline(always)]
    fn phase(&self, l: &CurveCoordinates) -> Vec3 {
        let w = self.per_mm;
        [l.across[0] * w[0], l.across[1] * w[1], l.s * w[2]]
    }

    /// du/dx.
    #[inline(always)]
    fn slopes(&self, l: &CurveCoordinates) -> Mat3 {
        let along = scale(l.tangent, 1.0 / l.stretch.max(1e-6));
        let ([a, b], w, twist) = (l.across, self.per_mm, self.line.twist);
        [
            scale(add(l.normals[0], scale(along, twist * b)), w[0]),
            scale(sub(l.normals[1], scale(along, twist * a)), w[1]),
            scale(along, w[2]),
        ]
    }

    /// A Lipschitz bound (turns per mm) where 1 − κ·d is at least `stretch` and the distance from the line at most `away`.
    fn lipschitz_within(&self, stretch: f64, away: f64) -> f64 {
        let [a, b, c] = self.wavelength;
        // The rows are orthogonal but for the twist, whose norm is added.
        (1.0 / a.min(b)).max(1.0 / (stretch * c)) + self.line.twist.abs() * away / (stretch * a.min(b))
    }

    /// How many cells a line that closes has along it.
    pub fn around(&self) -> Option<i32> {
        self.line.closed.then(|| (self.line.length / self.wavelength[2]).round() as i32)
    }
}

impl Mapping for Sweep {
    fn wavelengths(&self) -> [f64; 2] {
        let [a, b, _] = self.wavelength;
        [a.min(b).min(self.along[0]), a.max(b).max(self.along[1])]
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        phases(self, points, out);
    }

    fn jacobian(&self, p: Vec3) -> Mat3 {
        self.slopes(&self.local(p))
    }

    fn phases_and_jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        phases_and_jacobians(self, points, u, j);
    }

    fn typical(&self) -> Mat3 {
        core::array::from_fn(|i| core::array::from_fn(|j| if i == j { 1.0 / self.wavelength[i] } else { 0.0 }))
    }

    fn extremes(&self) -> Vec<Mat3> {
        self.extremes.to_vec()
    }

    /// Infinite where a position may have more than one nearest point of the line.
    fn lipschitz(&self, b: &Aabb) -> f64 {
        let reach = norm(b.size()) / 2.0;
        let away = self.away(b.center()) + reach;
        if away >= self.reach {
            return f64::INFINITY;
        }
        self.lipschitz_within(1.0 - away / self.reach, away)
    }

    fn max_lipschitz(&self) -> f64 {
        let stretch = self.along[0] / self.wavelength[2];
        self.lipschitz_within(stretch.max(1e-3), self.reach)
    }

    fn position(&self, u: Vec3, _: Vec3) -> Option<Vec3> {
        let w = self.wavelength;
        let s = u[2] * w[2];
        let place = self.line.at_length(if self.line.closed { s.rem_euclid(self.line.length) } else { s });
        let (c, ..) = self.line.spans[place.0].at(place.1);
        let [a0, a1, a2, b0, b1, b2, ..] = self.line.row(place);
        Some(add(c, add(scale([a0, a1, a2], u[0] * w[0]), scale([b0, b1, b2], u[1] * w[1]))))
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        let away = self.away(b.center()) + norm(b.size());
        let w = self.wavelength;
        let across = |a: usize| [whole(-away / w[a]) - 1, whole(away / w[a]) + 1];
        let along = match self.around() {
            Some(n) => [0, n - 1],
            None => [whole(-away / w[2]) - 1, whole((self.line.length + away) / w[2]) + 1],
        };
        listed(self, [across(0), across(1), along], b, None)
    }

    fn canonical(&self, cell: [i32; 3]) -> [i32; 3] {
        match self.around() {
            Some(n) => [cell[0], cell[1], cell[2].rem_euclid(n)],
            None => cell,
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn phases(map: &Sweep, points: &[Vec3], u: &mut [Vec3]) {
    map.each(points, |i, l| u[i] = map.phase(&l));
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn phases_and_jacobians(map: &Sweep, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
    map.each(points, |i, l| (u[i], j[i]) = (map.phase(&l), map.slopes(&l)));
}
