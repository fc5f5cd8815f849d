//! How deep points of a grid lie below a surface.

/// How deep each point of a grid (x fastest) that is not `open` lies below the surface, in the unit of `step`: half a step less
/// than the way to the nearest open point. Squares of distances along one axis after the other, each the lower envelope of
/// parabolas (Felzenszwalb and Huttenlocher, Theory of Computing 8, 2012).
pub(super) fn depths(open: &[bool], shape: [usize; 3], step: f64) -> Vec<f32> {
    let [nx, ny, nz] = shape;
    let far = 1e12f32;
    let mut d: Vec<f32> = open.iter().map(|o| if *o { 0.0 } else { far }).collect();
    let longest = nx.max(ny).max(nz);
    let mut line = ParabolaEnvelope { f: vec![0.0; longest], v: vec![0; longest], z: vec![0.0; longest + 1] };
    for l in 0..ny * nz {
        line.pass(&mut d[l * nx..(l + 1) * nx], nx, 1);
    }
    for l in 0..nx * nz {
        line.pass(&mut d[l / nx * nx * ny + l % nx..], ny, nx);
    }
    for l in 0..nx * ny {
        line.pass(&mut d[l..], nz, nx * ny);
    }
    d.into_iter().map(|d| ((d.sqrt() - 0.5).max(0.0) as f64 * step) as f32).collect()
}

/// Room for one line of the grid: its values, the parabolas of the envelope, and where they take over.
struct ParabolaEnvelope {
    f: Vec<f32>,
    v: Vec<usize>,
    z: Vec<f32>,
}

impl ParabolaEnvelope {
    /// Takes the values at a stride from the front of `d` to the least of their parabolas.
    fn pass(&mut self, d: &mut [f32], length: usize, stride: usize) {
        let ParabolaEnvelope { f, v, z } = self;
        (0..length).for_each(|i| f[i] = d[i * stride]);
        let meet = |p: usize, q: usize, f: &[f32]| {
            let (a, b) = (p as f32, q as f32);
            ((f[q] + b * b) - (f[p] + a * a)) / (2.0 * (b - a))
        };
        let mut k = 0;
        (v[0], z[0], z[1]) = (0, f32::NEG_INFINITY, f32::INFINITY);
        for q in 1..length {
            let mut s = meet(v[k], q, f);
            while s <= z[k] {
                k -= 1;
                s = meet(v[k], q, f);
            }
            k += 1;
            (v[k], z[k], z[k + 1]) = (q, s, f32::INFINITY);
        }
        let mut k = 0;
        for q in 0..length {
            while z[k + 1] < q as f32 {
                k += 1;
            }
            let way = q as f32 - v[k] as f32;
            d[q * stride] = way * way + f[v[k]];
        }
    }
}
