//! Distances of voxels, which may repeat in space: an exact Euclidean distance transform, axis by axis, by lower envelopes of
//! parabolas (P. F. Felzenszwalb and D. P. Huttenlocher, Theory Comput. 8 (2012) 415).

/// The distance of each voxel (x fastest) from the nearest of those that are `sites`, in the unit of `step`, the distance between
/// voxels along each axis; infinite where there is none.
pub fn distances(sites: &[bool], shape: [usize; 3], step: [f64; 3]) -> Vec<f64> {
    squares(sites.to_vec(), shape, step, false).into_iter().map(f64::sqrt).collect()
}

/// Signed distance of each voxel (x fastest), which repeat in space, to the boundary of those that are `solid`, positive inside, in the unit of `step`, the
/// distance between voxels along each axis: that to the middle of the nearest voxel of the other kind, in any copy, less half of
/// the least step. `None` if all are of one kind.
pub fn signed_distances(solid: &[bool], shape: [usize; 3], step: [f64; 3]) -> Option<Vec<f64>> {
    if solid.iter().all(|s| *s) || !solid.iter().any(|s| *s) {
        return None;
    }
    let half = 0.5 * step.into_iter().fold(f64::INFINITY, f64::min);
    let [out, inside] = [true, false].map(|of| squares(solid.iter().map(|s| *s == of).collect(), shape, step, true));
    let signed = |(s, (out, inside)): (&bool, (&f64, &f64))| if *s { inside.sqrt() - half } else { half - out.sqrt() };
    Some(solid.iter().zip(out.iter().zip(&inside)).map(signed).collect())
}

/// The square of the distance to the nearest of the voxels that are `sites`, in any copy if they repeat.
fn squares(sites: Vec<bool>, shape: [usize; 3], step: [f64; 3], repeats: bool) -> Vec<f64> {
    let mut out: Vec<f64> = sites.into_iter().map(|s| if s { 0.0 } else { f64::INFINITY }).collect();
    let mut envelope = Vec::new();
    for axis in 0..3 {
        let (n, stride) = (shape[axis], shape[..axis].iter().product::<usize>());
        let mut line = vec![0.0; n];
        for first in (0..out.len()).filter(|i| i / stride % n == 0) {
            (0..n).for_each(|k| line[k] = out[first + k * stride]);
            lower_envelope(&mut line, step[axis], repeats, &mut envelope);
            (0..n).for_each(|k| out[first + k * stride] = line[k]);
        }
    }
    out
}

/// Replaces g(i) by the least g(j) + (step (i − j))² of a line, which closes if it repeats. `envelope` holds of each parabola of the lower envelope
/// where it begins, its place and its least value.
fn lower_envelope(line: &mut [f64], step: f64, repeats: bool, envelope: &mut Vec<[f64; 3]>) {
    let n = line.len() as isize;
    envelope.clear();
    // No copy more than half a period away is nearest.
    for j in if repeats { -(n / 2)..n + n / 2 + 1 } else { 0..n } {
        let (p, g) = (step * j as f64, line[j.rem_euclid(n) as usize]);
        if g.is_infinite() {
            continue;
        }
        let mut from = f64::NEG_INFINITY;
        while let Some(&[begins, q, least]) = envelope.last() {
            from = 0.5 * ((g - least) / (p - q) + p + q);
            if from > begins {
                break;
            }
            envelope.pop();
            from = f64::NEG_INFINITY;
        }
        envelope.push([from, p, g]);
    }
    if envelope.is_empty() {
        return;
    }
    let mut k = 0;
    for (i, v) in line.iter_mut().enumerate() {
        let x = step * i as f64;
        while envelope.get(k + 1).is_some_and(|next| next[0] <= x) {
            k += 1;
        }
        *v = envelope[k][2] + (x - envelope[k][1]).powi(2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    /// By comparison with all sites; in periodic space with all of their copies next to it.
    #[test]
    fn distances_are_those_of_the_nearest_site() {
        let (shape, step) = ([11, 13, 9], [0.3, 0.17, 0.6]);
        let place = |n: usize| [n % 11, n / 11 % 13, n / 143].map(|i| i as isize);
        let apart = |a: usize, b: usize, shift: [isize; 3]| {
            let (a, b) = (place(a), place(b));
            (0..3).map(|i| step[i] * (a[i] - b[i] - shift[i] * shape[i] as isize) as f64).map(|d| d * d).sum::<f64>()
        };
        let mut seed = 2;
        for share in [0.9, 0.99, 1.0] {
            let mut sites: Vec<bool> = (0..shape.iter().product()).map(|_| random(&mut seed) > share).collect();
            sites[77] = true;
            let all: Vec<usize> = (0..sites.len()).filter(|n| sites[*n]).collect();
            let least = |n: usize, shifts: &[[isize; 3]]| {
                let each = all.iter().flat_map(|m| shifts.iter().map(move |s| (*m, *s)));
                each.map(|(m, s)| apart(n, m, s)).fold(f64::INFINITY, f64::min).sqrt()
            };
            for (n, d) in distances(&sites, shape, step).into_iter().enumerate() {
                assert!((d - least(n, &[[0; 3]])).abs() < 1e-12, "{d}");
            }
            let copies: Vec<[isize; 3]> = (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]).collect();
            for (n, s) in squares(sites.clone(), shape, step, true).into_iter().enumerate().step_by(7) {
                assert!((s.sqrt() - least(n, &copies)).abs() < 1e-12, "{s}");
            }
        }
        assert!(distances(&[false; 8], [2; 3], [1.0; 3]).iter().all(|d| d.is_infinite()));
    }
}
