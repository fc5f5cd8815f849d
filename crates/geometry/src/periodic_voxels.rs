//! Signed distances of voxels that repeat in space: an exact Euclidean distance transform, axis by axis, by lower envelopes of
//! parabolas (P. F. Felzenszwalb and D. P. Huttenlocher, Theory Comput. 8 (2012) 415), on lines that close.

/// Signed distance of each voxel (x fastest) to the boundary of those that are `solid`, positive inside, in the unit of `step`, the
/// distance between voxels along each axis: that to the middle of the nearest voxel of the other kind, in any copy, less half of
/// the least step. `None` if all are of one kind.
pub fn signed_distances(solid: &[bool], shape: [usize; 3], step: [f64; 3]) -> Option<Vec<f64>> {
    if solid.iter().all(|s| *s) || !solid.iter().any(|s| *s) {
        return None;
    }
    let half = 0.5 * step.into_iter().fold(f64::INFINITY, f64::min);
    let [out, inside] = [true, false].map(|of| squares(solid.iter().map(|s| *s == of).collect(), shape, step));
    let signed = |(s, (out, inside)): (&bool, (&f64, &f64))| if *s { inside.sqrt() - half } else { half - out.sqrt() };
    Some(solid.iter().zip(out.iter().zip(&inside)).map(signed).collect())
}

/// The square of the distance to the nearest of the voxels that are `sites`.
fn squares(sites: Vec<bool>, shape: [usize; 3], step: [f64; 3]) -> Vec<f64> {
    let mut out: Vec<f64> = sites.into_iter().map(|s| if s { 0.0 } else { f64::INFINITY }).collect();
    let mut envelope = Vec::new();
    for axis in 0..3 {
        let (n, stride) = (shape[axis], shape[..axis].iter().product::<usize>());
        let mut line = vec![0.0; n];
        for first in (0..out.len()).filter(|i| i / stride % n == 0) {
            (0..n).for_each(|k| line[k] = out[first + k * stride]);
            lower_envelope(&mut line, step[axis], &mut envelope);
            (0..n).for_each(|k| out[first + k * stride] = line[k]);
        }
    }
    out
}

/// Replaces g(i) by the least g(j) + (step (i − j))² of a line that closes. `envelope` holds of each parabola of the lower envelope
/// where it begins, its place and its least value.
fn lower_envelope(line: &mut [f64], step: f64, envelope: &mut Vec<[f64; 3]>) {
    let n = line.len() as isize;
    envelope.clear();
    // No copy more than half a period away is nearest.
    for j in -(n / 2)..n + n / 2 + 1 {
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
