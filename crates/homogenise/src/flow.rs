//! Creeping flow through the pore of a periodic cell: its permeability.
//!
//! Steps of `boltzmann.rs` lead to the steady flow, slowly where pressure evens out along narrow pores. So after a few of them the states
//! are combined such that their change is least (reduced rank extrapolation, which for a linear iteration is GMRES).

use geometry::fault::Fault;
use geometry::math::Mat3;
use geometry::progress::{Progress, Stage, Stopped};

use crate::boltzmann::Nodes;
use crate::cell::{Homogenised, fill_cyclic};
use crate::fields::{combine, dot};
use crate::pore::PoreGrid;
use geometry::dense::{factorise, substitute};

/// Steps between states that are combined.
const STRIDE: usize = 8;
/// States that are combined.
const DEPTH: usize = 8;
/// Steps after which a system is given up.
const MOST: usize = 40_000;

impl PoreGrid {
    /// The permeability k of the cell in steps of the grid squared, in the axes of the grid: mean flux = −k ∇p / viscosity.
    ///
    /// The `viscosity` (in steps of the grid and of time) changes the number of steps, and the result only within rounding and
    /// `tolerance`.
    /// Where nothing connects the pore with its translates there is no flow. `cyclic` says that a cyclic change of the axes changes nothing.
    ///
    /// # Errors
    /// No convergence to `tolerance`, the change by a step over that of the first; an interruption.
    pub fn permeability(
        &self,
        viscosity: f64,
        cyclic: bool,
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Homogenised<Mat3>, Stopped> {
        let made = self.fluxes(viscosity, cyclic, tolerance, progress)?;
        let k = made.tensor;
        let tensor = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (k[i][j] + k[j][i])));
        Ok(Homogenised { tensor, ..made })
    }

    /// The same before it is made symmetric: a column of mean fluxes for each force. They are symmetric to the order of the walls.
    ///
    /// # Errors
    /// As `permeability`.
    pub fn fluxes(
        &self,
        viscosity: f64,
        cyclic: bool,
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Homogenised<Mat3>, Stopped> {
        let Some(nodes) = Nodes::new(self) else {
            let message = "more nodes in the pore than can be numbered; take fewer";
            return Err(Stopped::Refused(Fault::new("n", message)));
        };
        // Walls divide by 1 - ω⁻, which is zero for a viscosity of 1/8.
        let viscosity = if (viscosity - 0.125).abs() < 1e-3 { 0.126 } else { viscosity };
        let cases = if cyclic { 1 } else { 3 };
        let mut k = [[0.0; 3]; 3];
        let mut made = Homogenised { tensor: k, residual: 0.0, iterations: 0, cases };
        if nodes.len() == 0 {
            return Ok(made);
        }
        let mut flow = Flow::new(&nodes, viscosity);
        for case in 0..cases {
            let share = |n: usize| n as f64 / cases as f64;
            let stage = Stage { whole: progress, from: share(case), to: share(case + 1) };
            let mut force = [0.0; 3];
            force[case] = 1.0;
            let (sum, residual, steps) = flow.solve(force, tolerance, &stage)?;
            for i in 0..3 {
                k[i][case] = viscosity * sum[i] / self.pore.len() as f64;
            }
            made.residual = made.residual.max(residual);
            made.iterations = made.iterations.max(steps);
        }
        if cyclic {
            fill_cyclic(&mut k);
        }
        Ok(Homogenised { tensor: k, ..made })
    }
}

/// A flow that becomes steady.
struct Flow<'a> {
    nodes: &'a Nodes,
    viscosity: f64,
    state: Vec<f64>,
    next: Vec<f64>,
    last: Vec<f64>,
    /// Changes of the state over strides.
    changes: Vec<Vec<f32>>,
    excess: Vec<f64>,
}

impl<'a> Flow<'a> {
    fn new(nodes: &'a Nodes, viscosity: f64) -> Self {
        let field = || vec![0.0; nodes.len()];
        Flow {
            nodes,
            viscosity,
            state: field(),
            next: field(),
            last: field(),
            changes: vec![vec![0.0; nodes.len()]; DEPTH],
            excess: vec![0.0; nodes.sizes.len()],
        }
    }

    /// One step; the flow through all channels.
    fn step(&mut self, force: [f64; 3]) -> [f64; 3] {
        let sums = self.nodes.step(self.viscosity, force, &self.excess, &self.state, &mut self.next);
        std::mem::swap(&mut self.state, &mut self.next);
        let mut flow = [0.0; 3];
        for ((sum, size), excess) in sums.iter().zip(&self.nodes.sizes).zip(&mut self.excess) {
            // Interpolated walls let a little mass through: it would grow, or shrink, for ever.
            *excess = sum[0] / *size as f64;
            for a in 0..3 {
                flow[a] += sum[a + 1];
            }
        }
        flow
    }

    /// The sum of the steady flow over all nodes, the last change over the first, and steps.
    fn solve(
        &mut self,
        force: [f64; 3],
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<([f64; 3], f64, usize), Stopped> {
        self.state.fill(0.0);
        self.excess.fill(0.0);
        let (mut steps, mut first, mut now) = (0, 0.0, 1.0);
        while steps < MOST {
            let mut flow = [0.0; 3];
            self.last.copy_from_slice(&self.state);
            for j in 0..DEPTH {
                for _ in 0..STRIDE {
                    let done = (f64::ln(now) / tolerance.ln()).clamp(0.0, 1.0);
                    if !progress.step((done * 1e6) as u64, 1_000_000) {
                        return Err(Stopped::Interrupted);
                    }
                    flow = self.step(force);
                }
                steps += STRIDE;
                combine(&mut self.last, &self.state, |last, state| state - last);
                combine(&mut self.changes[j], &self.last, |_, change| change as f32);
                let size = dot(&self.changes[j], &self.changes[j]).sqrt();
                if first == 0.0 {
                    first = size;
                }
                now = size / first;
                if now <= tolerance || first == 0.0 {
                    return Ok((flow, now, steps));
                }
                self.last.copy_from_slice(&self.state);
            }
            self.extrapolate();
        }
        let message = format!("the flow is not steady after {MOST} steps: its change is {now:.1e} of the first");
        Err(Stopped::Refused(Fault::new("n", message)))
    }

    /// Combines the last states, with coefficients whose sum is one, such that the change of the result is least.
    fn extrapolate(&mut self) {
        let scale: Vec<f64> = self.changes.iter().map(|u| dot(u, u).sqrt().max(f64::MIN_POSITIVE)).collect();
        let mut gram = vec![vec![0.0; DEPTH]; DEPTH];
        for i in 0..DEPTH {
            for j in 0..=i {
                gram[i][j] = dot(&self.changes[i], &self.changes[j]) / (scale[i] * scale[j]);
                gram[j][i] = gram[i][j];
            }
            gram[i][i] += 1e-14;
        }
        if factorise(&mut gram, |_, rest| (rest > 0.0).then(|| rest.sqrt())).is_none() {
            return;
        }
        let mut found: Vec<f64> = scale.iter().map(|s| 1.0 / s).collect();
        substitute(&gram, &mut found);
        let found: Vec<f64> = found.iter().zip(&scale).map(|(c, s)| c / s).collect();
        let total: f64 = found.iter().sum();
        if total.is_nan() || total <= 0.0 {
            return;
        }
        // The state after change m is the last one less all later changes.
        let mut before = 0.0;
        for (change, share) in self.changes.iter().zip(found) {
            let by = before;
            combine(&mut self.state, change, |x, u| x - by * f64::from(u));
            before += share / total;
        }
    }
}
