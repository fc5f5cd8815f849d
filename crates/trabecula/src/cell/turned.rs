//! Rotations of the torus after which a cell is the same.

use std::collections::HashMap;

use super::Series;
use geometry::math::{Complex, Mat3, Vec3, apply, sin_cos_turns, transpose};

/// Phases are tried in steps of this part of a turn: axes of rotation of cells with a space group are at multiples of an eighth.
const PARTS: usize = 24;
/// Amplitudes that differ by less than this share of the greatest are the same.
const SAME: f64 = 1e-9;

impl Series {
    /// The phase about which the series is the same after all these rotations, which take axes to axes; `None` if there is none. Of several
    /// the first, zero before all others.
    pub fn same_after(&self, turns: &[Mat3]) -> Option<Vec3> {
        let moves = |a: usize| turns.iter().any(|t| t[a][a] != 1.0);
        let tried = |a: usize| if moves(a) { PARTS } else { 1 };
        let phase = |i: usize| i as f64 / PARTS as f64;
        let all = (0..tried(2)).flat_map(|z| (0..tried(1)).flat_map(move |y| (0..tried(0)).map(move |x| [x, y, z])));
        all.map(|i| i.map(phase)).find(|at| turns.iter().all(|t| self.is_same(t, *at)))
    }

    /// Whether f(S u + p) = f(u + p).
    fn is_same(&self, turn: &Mat3, about: Vec3) -> bool {
        let largest = self.terms().iter().map(|t| t.amplitude.abs()).fold(0.0, f64::max);
        let wave = |hkl: [i32; 3], (re, im): Complex| {
            let first = hkl.iter().find(|h| **h != 0).map_or(1, |h| h.signum());
            (hkl.map(|h| h * first), (re, im * f64::from(first)))
        };
        let own: HashMap<[i32; 3], Complex> = (self.terms().iter())
            .map(|t| {
                let h = t.hkl.map(f64::from);
                let (s, c) = sin_cos_turns(t.phase + h[0] * about[0] + h[1] * about[1] + h[2] * about[2]);
                wave(t.hkl, (t.amplitude * c, t.amplitude * s))
            })
            .collect();
        let back = transpose(turn);
        own.iter().all(|(hkl, c)| {
            let turned = apply(&back, hkl.map(f64::from)).map(|h| h.round() as i32);
            let (to, c) = wave(turned, *c);
            own.get(&to).is_some_and(|d| (c.0 - d.0).hypot(c.1 - d.1) <= SAME * largest)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::named;
    use geometry::math::{add, dot};

    fn about(axis: usize, quarters: usize) -> Mat3 {
        let quarter: Mat3 = {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut m = [[0.0; 3]; 3];
            (m[axis][axis], m[c][b], m[b][c]) = (1.0, 1.0, -1.0);
            m
        };
        (1..quarters).fold(quarter, |m, _| geometry::math::product(&quarter, &m))
    }

    fn value(series: &Series, u: Vec3) -> f64 {
        let wave = |t: &crate::cell::Term| t.amplitude * sin_cos_turns(dot(t.hkl.map(f64::from), u) + t.phase).1;
        series.terms().iter().map(wave).sum()
    }

    /// Half-turns of all named cells about each axis, quarter turns of those that have such axes; values agree.
    #[test]
    fn named_cells_are_the_same_after_turns_about_their_axes() {
        let mut seed = 2;
        for name in ["gyroid", "diamond", "primitive", "iwp", "neovius", "frd", "lidinoid", "split_p", "fischer_koch_s"]
        {
            let series = Series::new(named(name).expect("named").terms()).expect("series");
            for axis in 0..3 {
                for quarters in [2, 1] {
                    let turn = about(axis, quarters);
                    let found = series.same_after(&[turn]);
                    println!("{name} {axis} {quarters}: {found:?}");
                    let Some(p) = found else { continue };
                    for _ in 0..50 {
                        let u = [0; 3].map(|_| geometry::random::random(&mut seed));
                        let [a, b] = [u, apply(&turn, u)].map(|u| value(&series, add(u, p)));
                        assert!((a - b).abs() < 1e-9, "{name} {axis} {quarters}");
                    }
                }
            }
        }
        let of = |name: &str, turn: Mat3| {
            Series::new(named(name).expect("named").terms()).expect("series").same_after(&[turn])
        };
        assert_eq!(of("primitive", about(2, 1)), Some([0.0; 3]));
        assert!(of("gyroid", about(2, 2)).is_some());
        // Screws alone.
        assert_eq!(of("gyroid", about(2, 1)), None);
    }
}
