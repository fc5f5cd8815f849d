//! Branches of frames at covered lines: labels of axes that agree all over the part outside the cores but across cuts, and the rotation
//! at each cut.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::branch_cuts::{BranchCuts, PhaseMotion};
use super::cube_rotations::nearest_turn;
use super::phase_request::PhaseRequest;
use super::phase_target::{SolveDomain, Target};
use super::singular_lines::FrameEquivalence;
use geometry::fault::{Fault, position};
use geometry::math::{IDENTITY, Mat3, Vec3, add, product, scale, transpose};

/// The rotations of the axes at the nodes after which they agree from node to node where no cut is, first of all at the nodes that
/// `count`.
pub(super) fn labels(
    domain: &SolveDomain,
    target: &Target,
    count: &[bool],
    cuts: &BranchCuts,
    alike: &FrameEquivalence,
) -> Vec<Mat3> {
    let (grid, frames, turns) = (&domain.grid, &target.frames, alike.turns());
    let mut labels: Vec<Option<Mat3>> = vec![None; grid.len()];
    for inner in [true, false] {
        let mut queue: VecDeque<usize> = (0..grid.len()).filter(|n| labels[*n].is_some()).collect();
        // A part may be in pieces: each starts as it is.
        for start in (0..grid.len()).filter(|n| !inner || count[*n]) {
            if queue.is_empty() && labels[start].is_none() {
                labels[start] = Some(IDENTITY);
                queue.push_back(start);
            }
            while let Some(n) = queue.pop_front() {
                let own = product(&frames[n], &labels[n].unwrap_or(IDENTITY));
                for m in grid.neighbours(n) {
                    if labels[m].is_none() && (count[m] || !inner) && !cuts.any([n, m]) {
                        labels[m] = Some(nearest_turn(&frames[m], &own, &turns));
                        queue.push_back(m);
                    }
                }
            }
        }
    }
    labels.into_iter().map(|l| l.unwrap_or(IDENTITY)).collect()
}

/// An edge of the grid along which axes change, or across cuts: its lower node, the rotation, and the cuts with the sense of each.
struct TurnedEdge {
    node: usize,
    turn: Mat3,
    cuts: Vec<(usize, i32)>,
}

/// Finds the rotation at each cut.
///
/// # Errors
/// Axes that do not agree where no cut is, or differ along a cut; rotations about several axes of the cell, or by a third of a turn.
pub(super) fn rotations(
    domain: &SolveDomain,
    target: &Target,
    count: &[bool],
    cuts: &mut BranchCuts,
    wanted: &PhaseRequest,
) -> Result<(), Fault> {
    let (grid, frames, turns) = (&domain.grid, &target.frames, wanted.alike().turns());
    let edges = (0..grid.len()).into_par_iter().filter(|n| count[*n]).flat_map_iter(|n| {
        let above = grid.neighbours(n).filter(move |m| *m > n && count[*m]);
        let turns = &turns;
        above.map(move |m| (n, m, nearest_turn(&frames[m], &frames[n], turns)))
    });
    let crossed = |n: usize, m: usize| -> Vec<(usize, i32)> {
        (0..cuts.len()).map(|line| (line, cuts.crossed(line, [n, m]))).filter(|(_, sense)| *sense != 0).collect()
    };
    let some: Vec<TurnedEdge> = edges
        .map(|(node, m, turn)| TurnedEdge { node, turn, cuts: crossed(node, m) })
        .filter(|e| e.turn != IDENTITY || !e.cuts.is_empty())
        .collect();
    let mut found: Vec<Option<Mat3>> = vec![None; cuts.len()];
    for TurnedEdge { node, turn, cuts } in &some {
        let at = grid.node(*node);
        match cuts[..] {
            [] => return Err(unlike(at, wanted)),
            [(line, sense)] => {
                let turn = if sense > 0 { *turn } else { transpose(turn) };
                if *found[line].get_or_insert(turn) != turn {
                    return Err(unlike(at, wanted));
                }
            }
            _ => {}
        }
    }
    let all: Vec<Mat3> = found.into_iter().map(|t| t.unwrap_or(IDENTITY)).collect();
    if common_axis(&all).is_none() {
        let message = "axes come back turned about different axes of the cell round the singular lines, and no cell is whole between such \
                       lines: core covers lines round which one axis comes back to itself, as in a part that is loaded in its plane. Leave \
                       core out, and keep the lines out of the part";
        return Err(Fault::new("core", message));
    }
    check_lengths(domain, target, &all)?;
    all.into_iter().enumerate().for_each(|(line, turn)| cuts.set(line, PhaseMotion { turn, by: [0.0; 3] }));
    Ok(())
}

/// Rotations about one axis: that axis, if all have it.
fn common_axis(turns: &[Mat3]) -> Option<usize> {
    (0..3).find(|a| turns.iter().all(|t| t[*a][*a] == 1.0))
}

/// Refuses cells of unequal edges where axes change places.
fn check_lengths(domain: &SolveDomain, target: &Target, turns: &[Mat3]) -> Result<(), Fault> {
    let swapped = |t: &Mat3| {
        (0..3).find(|a| t[*a][*a] == 0.0).map(|a| (a, (0..3).fold(a, |m, b| if t[a][b] != 0.0 { b } else { m })))
    };
    let Some((a, b)) = turns.iter().find_map(swapped) else { return Ok(()) };
    let unequal = domain.given.iter().any(|w| (w[a] / w[b] - 1.0).abs() > 1e-9);
    if target.lengths.is_some() || unequal {
        let message = "axes come back turned by a quarter round a singular line, and cells have different edges along them: give one \
                       wavelength, or leave core out";
        return Err(Fault::new("wavelength", message));
    }
    Ok(())
}

/// Explains that axes do not agree at a place without a cut.
fn unlike(at: Vec3, wanted: &PhaseRequest) -> Fault {
    let message = format!(
        "axes do not come back to themselves round a hole of the part, or round a place that is too short for a line, near {}: core covers \
         lines alone; {}, or leave core out",
        position(at),
        wanted.smoother()
    );
    Fault::new("core", message)
}

impl Target {
    /// Gives the axes at the nodes other labels: each frame is followed by a rotation that takes axes to axes.
    pub fn relabel(&mut self, labels: &[Mat3], given: &[Vec3]) {
        let lengths = self.lengths.as_mut();
        if let Some(lengths) = lengths {
            lengths
                .iter_mut()
                .zip(labels)
                .for_each(|(w, q)| *w = [0, 1, 2].map(|i| (0..3).map(|j| w[j] * q[j][i].abs()).sum()));
        }
        self.frames.iter_mut().zip(labels).for_each(|(f, q)| *f = product(f, q));
        let lengths = self.lengths.as_deref().unwrap_or(given);
        self.k = core::array::from_fn(|i| {
            let of = self.frames.iter().zip(lengths);
            of.map(|(f, w)| scale([f[0][i], f[1][i], f[2][i]], 1.0 / w[i])).collect()
        });
    }

    /// The mean of the gradients that are asked for, by the roots of the weights of nodes.
    pub fn mean(&self, roots: &[f64]) -> Mat3 {
        let share = 1.0 / roots.iter().map(|r| r * r).sum::<f64>();
        let sum = |k: &Vec<Vec3>| k.iter().zip(roots).fold([0.0; 3], |m, (k, r)| add(m, scale(*k, r * r * share)));
        self.k.each_ref().map(sum)
    }
}
