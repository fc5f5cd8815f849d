//! Cuts across which phases have branches: from each covered singular line a strip runs to infinity.
//!
//! Round a singular line the axes of the cell come back turned by one of the rotations that take axes to axes, and so do the phases:
//! across the line's cut u becomes S u + t, S that rotation and t whole numbers. A cell that is the same after it has no seam there.
//! (Nieser, Reitebuch, Polthier, CubeCover, Comput. Graph. Forum 30, 2011.) Which cuts lie between two nodes follows from the angles
//! about the lines, which jump by a turn there.

use rayon::prelude::*;

use super::phase_grid::PhaseGrid;
use super::winding::{Filament, to_segment};
use geometry::math::{
    IDENTITY, Mat3, Vec3, add, apply, cross, dot, norm, product, scale, sin_cos_turns, sub, transpose, unit,
};

/// Half a turn of the angle about a line over six edges of a grid is more than this along one of them.
const STEEP: f64 = 0.08;
/// Directions of the cuts that are tried.
const DIRECTIONS: usize = 48;

/// A motion of phases: u becomes turn · u + by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PhaseMotion {
    pub turn: Mat3,
    pub by: Vec3,
}

impl PhaseMotion {
    pub const NONE: PhaseMotion = PhaseMotion { turn: IDENTITY, by: [0.0; 3] };

    pub fn of(&self, u: Vec3) -> Vec3 {
        add(apply(&self.turn, u), self.by)
    }

    /// This one, then another.
    pub fn then(&self, next: &PhaseMotion) -> PhaseMotion {
        PhaseMotion { turn: product(&next.turn, &self.turn), by: next.of(self.by) }
    }

    pub fn back(&self) -> PhaseMotion {
        let turn = transpose(&self.turn);
        PhaseMotion { turn, by: scale(apply(&turn, self.by), -1.0) }
    }
}

/// The cut of a line: the angle about it at the nodes, turns, and what phases become where the cut is crossed in the common sense.
#[derive(Clone)]
struct BranchCut {
    angle: Vec<f64>,
    step: PhaseMotion,
}

/// The cuts of all lines, in the order in which they are crossed.
#[derive(Clone)]
pub(super) struct BranchCuts {
    cuts: Vec<BranchCut>,
    /// Whether that order is the one of falling angles.
    sense: f64,
}

impl BranchCuts {
    /// The cuts of lines, which are sorted into their order.
    pub fn new(grid: &PhaseGrid, lines: &mut [Vec<Vec3>]) -> BranchCuts {
        let along = like_oriented(lines);
        let aside = aside(lines, along);
        let across = unit(cross(along, aside));
        let middle = |l: &Vec<Vec3>| l[l.len() / 2];
        lines.sort_by(|a, b| dot(middle(a), across).total_cmp(&dot(middle(b), across)));
        let filament = |points: &Vec<Vec3>| {
            let n = points.len();
            let ends = [unit(sub(points[0], points[1])), unit(sub(points[n - 1], points[n - 2]))];
            Filament::Bent { points: points.clone(), ends: Some(ends), aside }
        };
        let far = grid.step.into_iter().fold(0.0, f64::max);
        let sense = |f: &Filament| {
            let jump = |side: f64| {
                let at = add(f.place().0, scale(aside, side * far));
                let [a, b] = [-1e-3, 1e-3].map(|s| f.angle(add(at, scale(across, s * far))));
                (a - b).round()
            };
            jump(1.0) + jump(-1.0)
        };
        let filaments: Vec<Filament> = lines.iter().map(filament).collect();
        let angles = |f: &Filament| (0..grid.len()).into_par_iter().map(|n| f.angle(grid.node(n))).collect();
        let cut = |f: &Filament| BranchCut { angle: angles(f), step: PhaseMotion::NONE };
        BranchCuts { sense: filaments.first().map_or(1.0, sense), cuts: filaments.iter().map(cut).collect() }
    }

    /// The same cuts on a grid of some of the nodes.
    pub fn at(&self, nodes: &[usize]) -> BranchCuts {
        let cut = |c: &BranchCut| BranchCut { angle: nodes.iter().map(|n| c.angle[*n]).collect(), step: c.step };
        BranchCuts { cuts: self.cuts.iter().map(cut).collect(), sense: self.sense }
    }

    pub fn len(&self) -> usize {
        self.cuts.len()
    }

    pub fn step(&self, line: usize) -> PhaseMotion {
        self.cuts[line].step
    }

    pub fn set(&mut self, line: usize, step: PhaseMotion) {
        self.cuts[line].step = step;
    }

    /// The sense in which the cut of a line lies between two near nodes; zero where it does not.
    pub fn crossed(&self, line: usize, [a, b]: [usize; 2]) -> i32 {
        let angle = &self.cuts[line].angle;
        let fall = self.sense * (angle[a] - angle[b]);
        // So mostly, and sooner known than rounded.
        if fall.abs() < 0.5 { 0 } else { fall.round() as i32 }
    }

    /// Whether a cut may lie between each node and another that is up to one step below it and up to two above it along each axis.
    pub fn near(&self, grid: &PhaseGrid) -> Vec<bool> {
        let strides = grid.strides();
        let steep = |n: &usize| {
            let at = grid.index(*n);
            let rise = |c: &BranchCut, m: usize| (c.angle[m] - c.angle[*n]).abs();
            let above = (0..3).filter(|a| at[*a] + 1 < grid.shape[*a]).map(|a| n + strides[a]);
            above.into_iter().any(|m| self.cuts.iter().any(|c| rise(c, m) > STEEP))
        };
        let mut near = vec![false; grid.len()];
        for n in (0..grid.len()).into_par_iter().filter(steep).collect::<Vec<usize>>() {
            let at = grid.index(n);
            let [x, y, z] = [0, 1, 2].map(|a| at[a].saturating_sub(2)..=(at[a] + 1).min(grid.shape[a] - 1));
            for k in z {
                for j in y.clone() {
                    let row = j * strides[1] + k * strides[2];
                    near[row + x.start()..=row + x.end()].fill(true);
                }
            }
        }
        near
    }

    /// Whether any cut lies between two near nodes.
    pub fn any(&self, ends: [usize; 2]) -> bool {
        (0..self.len()).any(|line| self.crossed(line, ends) != 0)
    }

    /// What phases become on the way from one node to a near one.
    pub fn between(&self, ends: [usize; 2]) -> PhaseMotion {
        let mut all = PhaseMotion::NONE;
        for line in 0..self.len() {
            if self.crossed(line, ends) > 0 {
                all = all.then(&self.step(line));
            }
        }
        for line in (0..self.len()).rev() {
            if self.crossed(line, ends) < 0 {
                all = all.then(&self.step(line).back());
            }
        }
        all
    }
}

/// Turns lines so that all run in one sense, and gives their mean direction.
fn like_oriented(lines: &mut [Vec<Vec3>]) -> Vec3 {
    let mut sum = [0.0; 3];
    for line in lines {
        let chord = sub(line[line.len() - 1], line[0]);
        if dot(chord, sum) < 0.0 {
            line.reverse();
            sum = sub(sum, chord);
        } else {
            sum = add(sum, chord);
        }
    }
    unit(sum)
}

/// The direction across the lines in which the cut of none comes near to another.
fn aside(lines: &[Vec<Vec3>], along: Vec3) -> Vec3 {
    let Filament::Straight { frame: [x, y, _], .. } = Filament::straight([0.0; 3], along) else { return along };
    let tried = (0..DIRECTIONS).map(|i| {
        // At right angles to no edge of the grid.
        let (s, c) = sin_cos_turns((i as f64 + 0.381_966) / DIRECTIONS as f64);
        unit(add(add(scale(x, c), scale(y, s)), scale(along, 0.013)))
    });
    let clear = |d: &Vec3| {
        let mut least = f64::INFINITY;
        for (i, from) in lines.iter().enumerate() {
            for (_, other) in lines.iter().enumerate().filter(|(j, _)| *j != i) {
                let reach = 2.0 * norm(sub(from[0], other[0])) + 1.0;
                let near = |p: &Vec3| {
                    from.iter().map(|q| to_segment(*p, *q, add(*q, scale(*d, reach)))).fold(f64::INFINITY, f64::min)
                };
                least = other.iter().map(near).fold(least, f64::min);
            }
        }
        least
    };
    let found = tried.map(|d| (clear(&d), d)).fold((-1.0, along), |m, t| if t.0 > m.0 { t } else { m });
    found.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::Aabb;

    /// Once round a line its cut is crossed once, round two lines both, and back is back.
    #[test]
    fn round_lines_their_cuts_are_crossed_once() {
        let grid = PhaseGrid::over(&Aabb { min: [-5.0, -5.0, 0.0], max: [5.0, 5.0, 2.0] }, [41, 41, 5]);
        let line = |x: f64, y: f64| vec![[x, y, -1.0], [x, y, 1.0], [x, y, 3.0]];
        let mut lines = vec![line(1.6, 0.4), line(-2.1, 0.3)];
        lines[1].reverse();
        let mut cuts = BranchCuts::new(&grid, &mut lines);
        let half = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        cuts.set(0, PhaseMotion { turn: half, by: [0.0; 3] });
        cuts.set(1, PhaseMotion { turn: half, by: [3.0, 5.0, 0.0] });
        let node = |i: usize, j: usize| (2 * 41 + j) * 41 + i;
        let ring = |from: [usize; 2], to: [usize; 2]| {
            let ([a, b], [c, d]) = (from, to);
            let mut all: Vec<usize> = (a..c).map(|i| node(i, b)).collect();
            all.extend((b..d).map(|j| node(c, j)));
            all.extend((a + 1..=c).rev().map(|i| node(i, d)));
            all.extend((b + 1..=d).rev().map(|j| node(a, j)));
            all
        };
        let round = |all: &[usize]| {
            (0..all.len()).fold(PhaseMotion::NONE, |m, i| m.then(&cuts.between([all[i], all[(i + 1) % all.len()]])))
        };
        let one: Vec<PhaseMotion> = (0..2).map(|i| cuts.step(i)).collect();
        let rings = [ring([24, 14], [38, 30]), ring([2, 14], [16, 30])];
        for (all, x) in rings.iter().zip([1.6, -2.1]) {
            let line = (0..2).find(|i| (lines[*i][0][0] - x).abs() < 1e-9).expect("a line");
            let found = round(all);
            assert!(found == one[line] || found == one[line].back(), "{found:?}");
        }
        let both = round(&ring([1, 1], [39, 39]));
        assert_eq!(both.turn, IDENTITY);
        assert_eq!([both.by[0].abs(), both.by[1].abs()], [3.0, 5.0]);
        assert_eq!(round(&ring([17, 5], [22, 12])), PhaseMotion::NONE);
        let m = one[1].then(&one[0]);
        assert_eq!(m.then(&m.back()), PhaseMotion::NONE);
    }
}
