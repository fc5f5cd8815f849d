//! Signed distance to the mid-surface f = 0, in space: what a wall of a given thickness is measured by.
//!
//! Phases relate to space by u = M x. For one M the distance is itself a function on the torus. It is found at the
//! nodes of a grid as the length to the nearest point of the surface (feet of perpendiculars, handed on from node to
//! node and sharpened by Newton's method) and carried between them by a [spline](super::spline). Near the surface the
//! distance is smooth and the spline is good to a few 1e-5 of a period; where two feet are equally near it rounds the
//! crease off within about two nodes.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::Part;
use super::connect::{Connectivity, connectivity};
use super::curvature;
use super::quantile::Quantile;
use super::series::Series;
use super::spline::Spline;
use crate::math::{
    Interval, Mat3, Vec3, add, apply, dot, inverse, norm, product, scale, sub, transpose, unit,
};

/// Nodes on the least radius of curvature of the mid-surface.
const FINE: f64 = 8.0;
/// Fewest and most nodes along an axis.
const NODES: [f64; 2] = [36.0, 72.0];

/// The signed distance to f = 0 in mm, by phase: positive where f is.
pub struct Distance {
    spline: Spline,
    /// The metric it was measured in: phases are M x.
    to_phase: Mat3,
    /// A bound of |∂d/∂x|.
    steepness: f64,
    /// Least radius of curvature of the mid-surface, mm.
    radius: Option<f64>,
    table: OnceLock<Quantile>,
    connect: [OnceLock<Connectivity>; 3],
}

impl Distance {
    /// Measures the distances to f = 0 where phases are u = `to_phase` · x.
    pub fn new(series: &Series, to_phase: &Mat3) -> Distance {
        let radius = curvature::radius(series, to_phase);
        let edges = transpose(&inverse(to_phase)).map(norm);
        let finest = series.terms().iter().fold([1; 3], |top: [u32; 3], t| {
            core::array::from_fn(|a| top[a].max(t.hkl[a].unsigned_abs()))
        });
        let shape = core::array::from_fn(|a| {
            let fine = radius.map_or(0.0, |r| FINE * edges[a] / r);
            let fine = fine.max(16.0 * f64::from(finest[a]));
            fine.clamp(NODES[0], NODES[1]).ceil() as usize
        });
        let values = Search::new(series, to_phase, shape).distances();
        let spline = Spline::through(values, shape);
        Distance {
            steepness: spline.steepness(to_phase),
            spline,
            to_phase: *to_phase,
            radius,
            table: OnceLock::new(),
            connect: Default::default(),
        }
    }

    /// Distances (mm) at phases `u` (turns).
    pub fn values(&self, u: &[Vec3], out: &mut [f64]) {
        self.spline.values(u, out);
    }

    /// Distances (mm) and their gradients (mm per turn).
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.spline.gradients(u, values, gradients);
    }

    /// Distances at the phases `base + x · along`, one for each of `xs`, in single precision.
    pub fn fill_row(&self, base: Vec3, along: Vec3, xs: &[f64], out: &mut [f32]) {
        self.spline.fill_row(base, along, xs, out);
    }

    /// The distance under another Jacobian du/dx than the one it was measured with, from the value and gradient here.
    ///
    /// The foot's normal n is kept and the length along it measured anew: d / |∇ₓd| with ∇ₓd = Jᵀ∇ᵤd, which is one for
    /// the Jacobian of `new`. Exact for flat walls and for any J with the same J Jᵀ, whatever its rotation; for others
    /// the foot moves and the error is of second order in the change of J, times thickness over radius of curvature.
    pub fn under(&self, value: f64, gradient: Vec3, jacobian: &Mat3) -> f64 {
        let own = norm(apply(&transpose(&self.to_phase), gradient));
        let here = norm(apply(&transpose(jacobian), gradient));
        // On creases the gradient may vanish and has no direction: the ratio goes to one there, so that it is continuous.
        const FAINT: f64 = 1e-4;
        value * (own.powi(3) + FAINT) / (own.powi(2) * here + FAINT)
    }

    /// A bound of |∂d/∂x|; about one where the distance is smooth.
    pub fn steepness(&self) -> f64 {
        self.steepness
    }

    /// An interval that contains every distance.
    pub fn range(&self) -> Interval {
        self.spline.range()
    }

    /// The thickness (mm) beyond which the faces of a wall fold: twice the least radius of curvature of the mid-surface
    /// in space. `None` where there is no surface.
    pub fn folding(&self) -> Option<f64> {
        self.radius.map(|r| 2.0 * r)
    }

    /// Share of the torus in the part at this distance (mm): for a sheet within it of the mid-surface.
    pub fn fraction(&self, part: Part, distance: f64) -> f64 {
        self.table().fraction(part, distance)
    }

    /// The distance (mm) at which the part has this share of the torus, and its derivative.
    pub fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        self.table().iso(part, fraction)
    }

    fn table(&self) -> &Quantile {
        self.table.get_or_init(|| {
            let n = self.spline.shape().into_iter().fold(0, usize::max).max(96);
            let mean = self.spline.averaged(1.0 / n as f64);
            let range = self.spline.range().abs().hi;
            Quantile::of(&|u, v, g| mean.gradients(u, v, g), n, range)
        })
    }

    /// The intervals of solid fraction in which the periodic solid of this part is one piece in R³.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let found = self.connect[part as usize]
            .get_or_init(|| connectivity(&|u, v, g| self.gradients(u, v, g), part));
        let share = |t: f64| self.fraction(part, t).clamp(0.0, 1.0);
        found.intervals.iter().map(|i| i.map(share)).collect()
    }
}

/// The nearest points of the surface to the nodes of a grid.
struct Search<'a> {
    series: &'a Series,
    shape: [usize; 3],
    to_phase: Mat3,
    back: Mat3,
    /// From a node to its 26 neighbours: steps in the grid and in space.
    around: Vec<([i32; 3], Vec3)>,
    /// Longest edge of the cell and longest diagonal of a grid cell, mm.
    sizes: [f64; 2],
}

/// Nothing found yet.
const NONE: Vec3 = [f64::INFINITY; 3];

impl<'a> Search<'a> {
    fn new(series: &'a Series, to_phase: &Mat3, shape: [usize; 3]) -> Search<'a> {
        let to_space = inverse(to_phase);
        let around: Vec<([i32; 3], Vec3)> = (0..27)
            .map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])
            .filter(|d| *d != [0; 3])
            .map(|d| {
                let turns = core::array::from_fn(|a| f64::from(d[a]) / shape[a] as f64);
                (d, apply(&to_space, turns))
            })
            .collect();
        let edge = transpose(&to_space)
            .map(norm)
            .into_iter()
            .fold(0.0, f64::max);
        let diagonal = around.iter().map(|a| norm(a.1)).fold(0.0, f64::max);
        Search {
            series,
            shape,
            to_phase: *to_phase,
            back: transpose(to_phase),
            around,
            sizes: [edge, diagonal],
        }
    }

    fn count(&self) -> usize {
        self.shape.iter().product()
    }

    fn index(&self, node: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        [node % nx, node / nx % ny, node / nx / ny]
    }

    /// The phase of a node.
    fn place(&self, node: usize) -> Vec3 {
        let i = self.index(node);
        core::array::from_fn(|a| i[a] as f64 / self.shape[a] as f64)
    }

    fn neighbour(&self, [i, j, k]: [usize; 3], d: [i32; 3]) -> usize {
        let [nx, ny, nz] = self.shape;
        let go = |at: usize, step: i32, n: usize| match step {
            1 if at + 1 == n => 0,
            -1 if at == 0 => n - 1,
            1 => at + 1,
            -1 => at - 1,
            _ => at,
        };
        (go(k, d[2], nz) * ny + go(j, d[1], ny)) * nx + go(i, d[0], nx)
    }

    /// Signed distances at the nodes.
    fn distances(&self) -> Vec<f64> {
        let u: Vec<Vec3> = (0..self.count()).map(|i| self.place(i)).collect();
        let (mut f, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
        f.par_chunks_mut(4096)
            .zip(g.par_chunks_mut(4096))
            .zip(u.par_chunks(4096))
            .for_each(|((f, g), u)| self.series.gradients(u, f, g));
        drop(g);
        let mut feet = self.beside(&f);
        let mut changed: Vec<usize> = (0..feet.len())
            .filter(|i| feet[*i][0].is_finite())
            .collect();
        self.hand_on(&mut feet, changed);
        // Handed on, a foot belongs to a neighbour; sharpened feet may serve their neighbours better than their own.
        changed = (0..feet.len()).collect();
        for _ in 0..6 {
            let sharp: Vec<Vec3> = changed
                .par_iter()
                .map(|&i| self.nearest(u[i], feet[i]))
                .collect();
            for (i, foot) in changed.iter().zip(sharp) {
                feet[*i] = foot;
            }
            changed = self.hand_on(&mut feet, changed);
            if changed.is_empty() {
                break;
            }
        }
        f.iter()
            .zip(&feet)
            .map(|(f, foot)| norm(*foot).min(self.sizes[0]).copysign(*f))
            .collect()
    }

    /// Feet (from the node, mm) of nodes beside the surface, found from where the grid's edges cross it.
    fn beside(&self, f: &[f64]) -> Vec<Vec3> {
        (0..f.len())
            .into_par_iter()
            .map(|node| {
                let (at, u) = (self.index(node), self.place(node));
                let mut best = NONE;
                for (d, step) in &self.around {
                    let other = f[self.neighbour(at, *d)];
                    let faces = d.iter().filter(|c| **c != 0).count() == 1;
                    if !faces || (f[node] < 0.0) == (other < 0.0) {
                        continue;
                    }
                    let share = f[node] / (f[node] - other);
                    let Some(on) = self.onto(u, scale(*step, share)) else {
                        continue;
                    };
                    let foot = self.nearest(u, on);
                    if dot(foot, foot) < dot(best, best) {
                        best = foot;
                    }
                }
                best
            })
            .collect()
    }

    /// Hands feet on from the nodes `from` to neighbours they serve better, as far as that goes. The nodes served.
    fn hand_on(&self, feet: &mut [Vec3], from: Vec<usize>) -> Vec<usize> {
        let mut served = vec![false; feet.len()];
        let mut asked = vec![0u32; feet.len()];
        let mut from = from;
        for round in 1.. {
            let mut nodes = Vec::new();
            for &node in &from {
                let at = self.index(node);
                for (d, _) in &self.around {
                    let n = self.neighbour(at, *d);
                    if asked[n] != round {
                        asked[n] = round;
                        nodes.push(n);
                    }
                }
            }
            // All look at the feet as they were: the result does not depend on the order of the work.
            let better: Vec<(usize, Vec3)> = nodes
                .par_iter()
                .filter_map(|&node| {
                    let at = self.index(node);
                    let own = dot(feet[node], feet[node]) * (1.0 - 1e-9);
                    let mut best = (own, NONE);
                    for (d, step) in &self.around {
                        let foot = add(feet[self.neighbour(at, *d)], *step);
                        let length = dot(foot, foot);
                        if length < best.0 {
                            best = (length, foot);
                        }
                    }
                    best.1[0].is_finite().then_some((node, best.1))
                })
                .collect();
            if better.is_empty() {
                break;
            }
            from = better.iter().map(|b| b.0).collect();
            for (node, foot) in better {
                feet[node] = foot;
                served[node] = true;
            }
        }
        (0..feet.len()).filter(|i| served[*i]).collect()
    }

    /// f, ∇ₓf and second derivatives in space at `from` (mm) from the phase u.
    fn second(&self, u: Vec3, from: Vec3) -> (f64, Vec3, Mat3) {
        let (f, g, h) = self.series.second(add(u, apply(&self.to_phase, from)));
        let h = product(&self.back, &product(&h, &self.to_phase));
        (f, apply(&self.back, g), h)
    }

    /// The point of the surface near `from`, by Newton's method along the gradient.
    fn onto(&self, u: Vec3, from: Vec3) -> Option<Vec3> {
        let mut at = from;
        for _ in 0..12 {
            let (f, g, _) = self.second(u, at);
            let step = scale(g, -f / dot(g, g));
            at = add(at, step);
            let moved = norm(sub(at, from));
            if moved.is_nan() || moved > 3.0 * self.sizes[1] {
                return None;
            }
            if norm(step) <= 1e-12 * self.sizes[0] {
                return Some(at);
            }
        }
        None
    }

    /// The nearest point of the surface to the phase u, from a point of the surface near it; never farther than that.
    fn nearest(&self, u: Vec3, from: Vec3) -> Vec3 {
        if !from[0].is_finite() {
            return from;
        }
        match self.lagrange(u, from) {
            Some(foot) if dot(foot, foot) <= dot(from, from) * (1.0 + 1e-12) => foot,
            _ => self.descend(u, from),
        }
    }

    /// Newton's method on p + λ∇f = 0, f(p) = 0: where p, from u, stands upright on the surface.
    fn lagrange(&self, u: Vec3, from: Vec3) -> Option<Vec3> {
        let mut p = from;
        let mut multiplier = None;
        for _ in 0..10 {
            let (f, g, h) = self.second(u, p);
            let l = multiplier.unwrap_or(-dot(p, g) / dot(g, g));
            let mut a = h.map(|r| scale(r, l));
            (0..3).for_each(|i| a[i][i] += 1.0);
            let solve = inverse(&a);
            let (along, rest) = (apply(&solve, g), apply(&solve, add(p, scale(g, l))));
            let dl = (f - dot(g, rest)) / dot(g, along);
            let step = sub(scale(rest, -1.0), scale(along, dl));
            p = add(p, step);
            multiplier = Some(l + dl);
            let length = norm(step);
            if length.is_nan() || length > self.sizes[0] {
                return None;
            }
            // The next step would be its square, and the distance is stationary at the foot.
            if length <= 1e-5 * self.sizes[0] {
                return Some(p);
            }
        }
        None
    }

    /// Towards the nearest point by going to the foot on the tangent plane and back to the surface, as far as that
    /// shortens the way.
    fn descend(&self, u: Vec3, from: Vec3) -> Vec3 {
        let (mut p, mut pace) = (from, 1.0);
        for _ in 0..40 {
            let n = unit(self.second(u, p).1);
            let step = sub(scale(n, dot(n, p)), p);
            if norm(step) <= 1e-7 * self.sizes[0] || pace < 1e-3 {
                break;
            }
            match self.onto(u, add(p, scale(step, pace))) {
                Some(q) if dot(q, q) < dot(p, p) => p = q,
                _ => pace *= 0.5,
            }
        }
        p
    }
}

#[cfg(test)]
mod tests {
    use super::super::named;
    use super::*;
    use crate::math::rotation;

    fn series(name: &str) -> Series {
        Series::new(named(name).expect(name).terms()).expect(name)
    }

    fn stretched(wavelength: Vec3, degrees: Vec3) -> Mat3 {
        let turn = transpose(&rotation(degrees));
        core::array::from_fn(|a| scale(turn[a], 1.0 / wavelength[a]))
    }

    /// Points of f = 0 (phases) and their unit normals in space.
    fn surface(series: &Series, to_phase: &Mat3, count: usize) -> Vec<(Vec3, Vec3)> {
        let back = transpose(to_phase);
        (1..)
            .filter_map(|i| {
                let mut u = [0.7549, 0.5698, 0.4302].map(|s| (s * f64::from(i)).fract());
                for _ in 0..20 {
                    let (f, g, _) = series.second(u);
                    u = sub(u, scale(g, f / dot(g, g)));
                }
                let (f, g, _) = series.second(u);
                (f.abs() < 1e-12).then(|| (u, unit(apply(&back, g))))
            })
            .take(count)
            .collect()
    }

    /// A point s along the normal is s from the surface as long as s is less than the reach.
    #[test]
    fn points_along_the_normal_are_as_far_as_they_went() {
        for name in [
            "gyroid",
            "diamond",
            "primitive",
            "iwp",
            "neovius",
            "frd",
            "fischer_koch_s",
            "lidinoid",
            "split_p",
        ] {
            for (wavelength, degrees) in
                [([1.0; 3], [0.0; 3]), ([3.0, 4.0, 6.0], [20.0, 35.0, 50.0])]
            {
                let (s, m) = (series(name), stretched(wavelength, degrees));
                let t = std::time::Instant::now();
                let d = Distance::new(&s, &m);
                let took = t.elapsed();
                let reach = d.folding().expect("a surface") / 2.0;
                let points = surface(&s, &m, 2000);
                let least = wavelength[0];
                print!(
                    "{name} {wavelength:?} {:?} steep {:.3} folding {:.4} range {:?} {took:.2?} errors/λ:",
                    d.spline.shape(),
                    d.steepness,
                    2.0 * reach / least,
                    d.range()
                );
                for share in [0.05, 0.3, 0.5, 0.8, 0.95] {
                    let mut worst = (0.0f64, 0.0f64);
                    for (u, n) in &points {
                        for side in [share * reach, -share * reach] {
                            let mut v = [0.0];
                            d.values(&[add(*u, apply(&m, scale(*n, side)))], &mut v);
                            let e = (v[0] - side).abs() / least;
                            worst = (worst.0.max(e), worst.1 + e * e);
                        }
                    }
                    print!(" {:.1e} (rms {:.1e})", worst.0, (worst.1 / 4000.0).sqrt());
                }
                println!();
            }
        }
    }
}
