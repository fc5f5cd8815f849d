//! One step of a lattice Boltzmann scheme for creeping flow: D3Q19, two relaxation times, interpolated bounce-back.
//!
//! **Collision.** Each node has nineteen populations f_q, deviations from those at rest, stored eight nodes at a time. A step collides them,
//!
//! f̃_q = f_q − ω⁺(f⁺ − e⁺) − ω⁻(f⁻ − e⁻) + (1 − ω⁻/2) t_q c_q·F, with e⁺ = t_q ρ / 3, e⁻ = t_q c_q·j, j = Σ f_q c_q + F/2,
//!
//! which is linear, hence Stokes flow, and streams them: `from` says where each comes from, at a wall from the node's own opposite one. The rates are tied by
//! (1/ω⁺ − ½)(1/ω⁻ − ½) = Λ; steady velocities times the viscosity then depend on Λ alone. Λ = 3/16 puts half-way walls of plane channels
//! exactly where they are (Ginzburg, d'Humières, Phys. Rev. E 68 (2003) 066614).
//!
//! **Walls** cut a link at the distance δ from a node, in units of the link. What comes back is the multireflection of the same paper,
//!
//! f_q̄ = f̃_q + κ₀(f_q − f̃_q̄) + κ₁(f̃_q − f̃_q̄ a node further back) + F, with F = SΛ⁻(p − t_q c_q·F), p = f̃⁻ − f⁻, Λ⁻ = 1/ω⁻ − ½:
//!
//! | nodes behind | κ₀ | κ₁ | S | velocity that is zero at the wall |
//! |---|---|---|---|---|
//! | two | (1 − 2δ − 2δ²)/(1 + δ)² | δ²/(1 + δ)² | 4/(1 + δ)² | of the parabola along the link: plane channels are exact |
//! | one | (1 − 2δ)/(1 + 2δ) | 0 | 4/(1 + 2δ) | of the line, with e'' as if the wall were across the link: p − t_q c_q·F = −⅔Λ⁺e'' |
//!
//! **Why these weights.** With e = e⁻ + Λ⁻t_q c_q·F, in a steady flow f_q − f̃_q̄ = 2e − e' − 2Λ⁻p along a link, the same a node further back,
//! and f̃_q − f_q̄ = 2e + e' − 2Λ⁻p at the node. The κ make the sum S(e + δe' + ½δ²e'' − Λ⁻p), and F takes −SΛ⁻p away: what is left is
//! the velocity at the wall.

use multiversion::multiversion;
use rayon::prelude::*;

use crate::lanes::LANES;
use crate::pore::{PoreGrid, VELOCITIES, WallLink, opposite};
use geometry::math::dot;

/// Velocities.
pub const Q: usize = 19;
/// Populations of a block of nodes.
const BLOCK: usize = Q * LANES;
/// Blocks done by a thread at a time.
const PIECE: usize = 64;
/// The product Λ of the relaxation times less a half.
const MAGIC: f64 = 3.0 / 16.0;

/// The weight t_q of a velocity: Σ t c c = 1.
const fn weight(q: usize) -> f64 {
    match q {
        0 => 1.0,
        1..=6 => 1.0 / 6.0,
        _ => 1.0 / 12.0,
    }
}

/// A correction of a population next to a wall.
#[derive(Clone, Copy)]
struct Correction {
    lane: u8,
    /// The velocity towards the wall.
    velocity: u8,
    /// κ₀ and κ₁.
    kappa: [f64; 2],
    /// The places of the populations a node further back.
    behind: [u32; 2],
    /// S.
    sum: f64,
    /// What stands in for ½δ² e'', in units of Λ⁺.
    curved: f64,
}

impl Correction {
    /// The correction of a wall at a distance, with one node or two behind; those are `behind`.
    fn new(lane: usize, wall: &WallLink, behind: Option<[u32; 2]>) -> Correction {
        let (d, velocity) = (wall.distance, wall.velocity as u8);
        let lane = lane as u8;
        match behind {
            Some(behind) => {
                let s = (1.0 + d) * (1.0 + d);
                let kappa = [(1.0 - 2.0 * d - 2.0 * d * d) / s, d * d / s];
                Correction { lane, velocity, kappa, behind, sum: 4.0 / s, curved: 0.0 }
            }
            None => {
                let s = 1.0 + 2.0 * d;
                let kappa = [(1.0 - 2.0 * d) / s, 0.0];
                Correction { lane, velocity, kappa, behind: [0; 2], sum: 4.0 / s, curved: 0.75 * d * d }
            }
        }
    }
}

/// A run of blocks of one connected component.
#[derive(Clone, Copy)]
struct Run {
    first: usize,
    blocks: usize,
    channel: usize,
}

/// The nodes of the channels of a pore and their links.
pub struct Nodes {
    /// Of each population, the place of the one that streams into it.
    from: Vec<u32>,
    corrections: Vec<Correction>,
    /// Where the corrections of a block begin; one more at the end.
    starts: Vec<u32>,
    /// Lanes of each block that are nodes.
    used: Vec<u8>,
    runs: Vec<Run>,
    /// Nodes of each channel.
    pub sizes: Vec<usize>,
    /// The node of the grid in each lane.
    places: Vec<u32>,
}

/// What a step gives of each channel: the mass and the sum of j.
pub type Sums = Vec<[f64; 4]>;

impl Nodes {
    /// The nodes of all channels; `None` if there are too many.
    pub fn new(grid: &PoreGrid) -> Option<Nodes> {
        let blocked = grid.blocked();
        let channels = grid.channels(&blocked);
        let blocks: usize = channels.iter().map(|c| c.members.len().div_ceil(LANES)).sum();
        u32::try_from(blocks * BLOCK).ok()?;
        let mut lane_of = vec![u32::MAX; grid.pore.len()];
        let mut made = Nodes {
            from: vec![0; blocks * BLOCK],
            corrections: Vec::new(),
            starts: vec![0],
            used: Vec::new(),
            runs: Vec::new(),
            sizes: channels.iter().map(|c| c.members.len()).collect(),
            places: Vec::new(),
        };
        for (channel, it) in channels.iter().enumerate() {
            let first = made.used.len();
            for nodes in it.members.chunks(LANES) {
                for lane in 0..LANES {
                    // What is left of the last block repeats its first node, and is never read.
                    let node = nodes.get(lane).copied().unwrap_or(nodes[0]);
                    if lane < nodes.len() {
                        lane_of[node] = made.places.len() as u32;
                    }
                    made.places.push(node as u32);
                }
                made.used.push(nodes.len() as u8);
            }
            let last = made.used.len();
            let runs = (first..last).step_by(PIECE);
            made.runs.extend(runs.map(|first| Run { first, blocks: PIECE.min(last - first), channel }));
        }
        let place = |lane: usize, q: usize| (lane / LANES * BLOCK + q * LANES + lane % LANES) as u32;
        for block in 0..blocks {
            for lane in block * LANES..(block + 1) * LANES {
                let node = made.places[lane] as usize;
                let own = lane_of[node] as usize;
                made.from[place(lane, 0) as usize] = place(own, 0);
                for q in 1..Q {
                    let back = opposite(q);
                    made.from[place(lane, q) as usize] = match blocked[node] >> back & 1 {
                        1 => place(own, back),
                        _ => place(lane_of[grid.neighbour(node, back).0] as usize, q),
                    };
                }
                let at = grid.walls.partition_point(|w| w.node < node);
                for w in grid.walls[at..].iter().take_while(|w| w.node == node) {
                    // A gap of one node has no other to interpolate with: half-way bounce-back.
                    let (q, back) = (w.velocity, opposite(w.velocity));
                    if lane - block * LANES < made.used[block] as usize && blocked[node] >> back & 1 == 0 {
                        let (first, _) = grid.neighbour(node, back);
                        let behind = (blocked[first] >> back & 1 == 0).then(|| {
                            let (second, _) = grid.neighbour(first, back);
                            [place(lane_of[second] as usize, q), place(lane_of[first] as usize, back)]
                        });
                        made.corrections.push(Correction::new(lane % LANES, w, behind));
                    }
                }
            }
            made.starts.push(made.corrections.len() as u32);
        }
        Some(made)
    }

    /// Numbers in a state.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// One step under a force, from `state` to `next`. `excess` is taken off the density of each channel.
    pub fn step(&self, viscosity: f64, force: [f64; 3], excess: &[f64], state: &[f64], next: &mut [f64]) -> Sums {
        let even = 1.0 / (3.0 * viscosity + 0.5);
        let slack = MAGIC / (3.0 * viscosity);
        let odd = 1.0 / (slack + 0.5);
        let mut pieces = Vec::with_capacity(self.runs.len());
        let mut rest = next;
        for run in &self.runs {
            let (piece, after) = rest.split_at_mut(run.blocks * BLOCK);
            pieces.push((run, piece));
            rest = after;
        }
        let each: Vec<[f64; 4]> = pieces
            .into_par_iter()
            .map(|(run, out)| {
                collide(self, run, &Step { even, odd, slack, force, excess: excess[run.channel] }, state, out)
            })
            .collect();
        let mut sums = vec![[0.0; 4]; self.sizes.len()];
        for (run, of) in self.runs.iter().zip(each) {
            for (s, v) in sums[run.channel].iter_mut().zip(of) {
                *s += v;
            }
        }
        sums
    }
}

/// The flow j at a node by its populations after a collision.
#[inline(always)]
fn flow_after(own: &[f64], lane: usize, force: [f64; 3]) -> [f64; 3] {
    let mut flow = force.map(|f| -0.5 * f);
    for (q, c) in VELOCITIES.iter().enumerate().skip(1) {
        for a in 0..3 {
            flow[a] += f64::from(c[a]) * own[q * LANES + lane];
        }
    }
    flow
}

/// The numbers of a step.
struct Step {
    even: f64,
    odd: f64,
    /// 1 / odd - 1/2.
    slack: f64,
    force: [f64; 3],
    excess: f64,
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn collide(nodes: &Nodes, run: &Run, step: &Step, state: &[f64], out: &mut [f64]) -> [f64; 4] {
    let mut sums = [[0.0; LANES]; 4];
    for (n, out) in out.chunks_exact_mut(BLOCK).enumerate() {
        let block = run.first + n;
        let from = &nodes.from[block * BLOCK..(block + 1) * BLOCK];
        let mut f = [[0.0f64; LANES]; Q];
        for q in 0..Q {
            for i in 0..LANES {
                f[q][i] = state[from[q * LANES + i] as usize];
            }
        }
        let own = &state[block * BLOCK..(block + 1) * BLOCK];
        let range = nodes.starts[block] as usize..nodes.starts[block + 1] as usize;
        let mut lane = usize::MAX;
        let mut moved = [0.0; 3];
        for c in &nodes.corrections[range] {
            let q = c.velocity as usize;
            let back = opposite(q);
            if lane != c.lane as usize {
                lane = c.lane as usize;
                moved = flow_after(own, lane, step.force);
            }
            let [ahead, opposed] = [q, back].map(|q| own[q * LANES + lane]);
            let [along, push] = [moved, step.force].map(|v| weight(q) * dot(VELOCITIES[q].map(f64::from), v));
            // p of the last collision, from what it left: p (1 - ω⁻) = ω⁻ (e - f̃⁻).
            let change = step.odd / (1.0 - step.odd) * (along + step.slack * push - 0.5 * (ahead - opposed));
            let [far, near] = c.behind.map(|i| state[i as usize]);
            f[back][lane] += c.kappa[0] * (f[q][lane] - opposed)
                + if c.kappa[1] == 0.0 { 0.0 } else { c.kappa[1] * (far - near) }
                + c.sum * (step.slack - c.curved * step.slack / MAGIC) * (change - push);
        }
        let (mut density, mut flow) = ([0.0; LANES], [[0.0; LANES]; 3]);
        for q in 0..Q {
            for i in 0..LANES {
                density[i] += f[q][i];
                for a in 0..3 {
                    match VELOCITIES[q][a] {
                        1 => flow[a][i] += f[q][i],
                        -1 => flow[a][i] -= f[q][i],
                        _ => {}
                    }
                }
            }
        }
        for i in 0..LANES {
            density[i] -= step.excess;
            for a in 0..3 {
                flow[a][i] += 0.5 * step.force[a];
            }
        }
        let shift = step.excess / 3.0;
        for i in 0..LANES {
            // At rest: the share that Σ t/3 of the others leaves.
            f[0][i] -= shift;
            f[0][i] -= step.even * (f[0][i] - density[i] / 3.0);
        }
        out[..LANES].copy_from_slice(&f[0]);
        for q in (1..Q).step_by(2) {
            let (w, c) = (weight(q), VELOCITIES[q]);
            let (mut ahead, mut behind) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let mut along = 0.0;
                let mut push = 0.0;
                for a in 0..3 {
                    match c[a] {
                        1 => (along, push) = (along + flow[a][i], push + step.force[a]),
                        -1 => (along, push) = (along - flow[a][i], push - step.force[a]),
                        _ => {}
                    }
                }
                let mean = 0.5 * (f[q][i] + f[q + 1][i]) - w * shift;
                let half = 0.5 * (f[q][i] - f[q + 1][i]);
                let even = mean - step.even * (mean - w * density[i] / 3.0);
                let odd = half - step.odd * (half - w * along) + (1.0 - 0.5 * step.odd) * w * push;
                ahead[i] = even + odd;
                behind[i] = even - odd;
            }
            out[q * LANES..(q + 1) * LANES].copy_from_slice(&ahead);
            out[(q + 1) * LANES..(q + 2) * LANES].copy_from_slice(&behind);
        }
        for i in 0..nodes.used[block] as usize {
            sums[0][i] += density[i];
            for a in 0..3 {
                sums[a + 1][i] += flow[a][i];
            }
        }
    }
    sums.map(|s| s.into_iter().sum())
}
