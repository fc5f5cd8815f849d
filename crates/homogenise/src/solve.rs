//! Conjugate gradients in f64, preconditioned by multigrid in f32.

use geometry::fault::Fault;
use geometry::progress::{Progress, Stopped};
use multiversion::multiversion;
use rayon::prelude::*;

use crate::cut_voxels::CutVoxels;
use crate::element::Element;
use crate::fields::{PIECE, combine, dot, dots, piece};
use crate::multigrid::Multigrid;
use crate::operator::Operator;

/// Iterations after which a system is given up.
const MOST: usize = 600;

/// A grid of voxels with its preconditioner, and the fields of the iteration.
pub struct System<const NC: usize> {
    /// The operator.
    pub operator: Operator<f64, NC>,
    multigrid: Multigrid<NC>,
    residual: Vec<f64>,
    /// In single precision, as its parts are; products with it are not.
    direction: Vec<f32>,
    product: Vec<f64>,
}

/// How a solution was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// Iterations.
    pub iterations: usize,
    /// Length of the residual over that of the right-hand side.
    pub residual: f64,
}

impl<const NC: usize> System<NC> {
    /// The system of a grid of weights, in which some voxels have elements of their own.
    pub fn new(shape: [usize; 3], weights: &[f64], element: &Element, cut: CutVoxels<f64>) -> Self {
        let multigrid = Multigrid::new(shape, weights, element, &cut);
        let operator = Operator::new(shape, weights.to_vec(), element, cut);
        let field = || vec![0.0; operator.len()];
        System { multigrid, residual: field(), direction: vec![0.0; operator.len()], product: field(), operator }
    }

    /// Solves A x = −A m for a periodic x, where m has the uniform gradient `modes` (times eight, by ξ).
    ///
    /// # Errors
    /// An interruption; no convergence.
    pub fn solve(
        &mut self,
        modes: &[f64; 9],
        solution: &mut [f64],
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Solved, Stopped> {
        let System { operator, multigrid, residual, direction, product } = self;
        solution.fill(0.0);
        operator.uniform(modes, residual);
        residual.iter_mut().for_each(|r| *r = -*r);
        let start = dot(residual, residual).sqrt();
        // Forces that are nothing but rounding: the uniform field is the solution.
        let scale = operator.weights.iter().fold(0.0f64, |m, w| m.max(w.abs()))
            * operator.stiffest()
            * modes.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if start <= 1e-14 * scale * (operator.len() as f64).sqrt() {
            return Ok(Solved { iterations: 0, residual: 0.0 });
        }
        let mut size = 0.0;
        let mut now = 1.0f64;
        for iteration in 0..MOST {
            let done = (now.ln() / tolerance.ln()).clamp(0.0, 1.0);
            if !progress.step((done * 1e6) as u64, 1_000_000) {
                return Err(Stopped::Interrupted);
            }
            let found = multigrid.precondition(residual);
            // Polak and Ribière's, which allows for a preconditioner that is linear to single precision only.
            let [along, before] = dots(found, [residual, product]);
            let turn = if iteration == 0 { 0.0 } else { (-before * size).max(0.0) as f32 };
            combine(direction, found, |p, z| turn * p + z);
            let plane = operator.plane();
            let planes = product.chunks_mut(plane).zip(residual.chunks(plane)).zip(direction.chunks(plane));
            let mut planes: Vec<_> = planes.map(|((q, r), p)| (q, r, p, [0.0; 2])).collect();
            operator.sweep(direction, &mut planes, &|product, (q, r, p, sums)| {
                q.copy_from_slice(product);
                *sums = [piece(q, p), piece(r, p)];
            });
            let [curvature, slope] = planes.iter().fold([0.0; 2], |s, p| [s[0] + p.3[0], s[1] + p.3[1]]);
            if !(along > 0.0 && curvature > 0.0) {
                return Err(Stopped::Refused(stalled(iteration, now)));
            }
            let length = slope / curvature;
            size = length / along;
            now = advance([solution, residual], direction, product, length).sqrt() / start;
            if now <= tolerance {
                return Ok(Solved { iterations: iteration + 1, residual: now });
            }
        }
        Err(Stopped::Refused(stalled(MOST, now)))
    }
}

/// Goes a length along a direction, whose product with the operator is known: the solution, the residual, and the square of its length.
fn advance([x, r]: [&mut [f64]; 2], p: &[f32], q: &[f64], length: f64) -> f64 {
    let planes = x.par_chunks_mut(PIECE).zip(r.par_chunks_mut(PIECE)).zip(p.par_chunks(PIECE)).zip(q.par_chunks(PIECE));
    let each: Vec<f64> = planes.map(|(((x, r), p), q)| advance_piece(x, r, p, q, length)).collect();
    each.into_iter().sum()
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn advance_piece(x: &mut [f64], r: &mut [f64], p: &[f32], q: &[f64], length: f64) -> f64 {
    let n = r.len();
    let (x, p, q) = (&mut x[..n], &p[..n], &q[..n]);
    for i in 0..n {
        x[i] += length * f64::from(p[i]);
        r[i] -= length * q[i];
    }
    piece(r, r)
}

fn stalled(iterations: usize, residual: f64) -> Fault {
    let message = format!(
        "the solver stands at a relative residual of {residual:.1e} after {iterations} iterations; the solid hardly holds together \
         at this resolution: take more voxels (n) or a greater fraction"
    );
    Fault::new("n", message)
}
