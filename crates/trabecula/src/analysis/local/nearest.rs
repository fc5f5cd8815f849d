//! For each voxel the nearest site: an exact distance transform to points that lie on the lines of the grid.
//!
//! Along its own line a site is wherever it is; across lines its distance grows by whole steps, and the least of such
//! parabolas is found axis by axis: P. F. Felzenszwalb and D. P. Huttenlocher, Distance transforms of sampled functions,
//! Theory Comput. 8 (2012) 415. Sites on x and y lines lie in the layers of z and are spread along z last; sites on z
//! lines lie in the layers of y and are spread along y last.

use rayon::prelude::*;

use super::Watch;
use super::lines::{Lines, NONE, Site};
use geometry::progress::Stopped;

/// Passes over the grid's layers, as they are counted by the watch.
pub(super) const PASSES: [usize; 3] = [0, 2, 2];

/// The place of the nearest site of each voxel, x fastest, then y.
pub(super) fn nearest(
    size: [usize; 3],
    sites: &[Site],
    lines: &[Lines; 3],
    watch: &Watch,
) -> Result<Vec<u32>, Stopped> {
    let [nx, ny, nz] = size;
    let all = nx * ny * nz;

    // In layers of z.
    let mut flat = vec![NONE; all];
    flat.par_chunks_mut(nx * ny).enumerate().for_each_init(Envelope::default, |envelope, (z, layer)| {
        if !watch.tick() {
            return;
        }
        for (y, row) in layer.chunks_mut(nx).enumerate() {
            along(&lines[0], z * ny + y, sites, 0, row);
        }
        for x in 0..nx {
            envelope.clear();
            envelope.add_column(ny, |y| layer[y * nx + x], |p| square(p[0] - x as f32), sites);
            envelope.each(ny, |y, id| layer[y * nx + x] = id);
        }
        // The y lines of this layer, spread along x, and the nearer of the two kept.
        let mut other = vec![NONE; nx * ny];
        let mut column = vec![NONE; ny];
        for x in 0..nx {
            along(&lines[1], z * nx + x, sites, 1, &mut column);
            for y in 0..ny {
                other[y * nx + x] = column[y];
            }
        }
        for y in 0..ny {
            let row = &mut layer[y * nx..(y + 1) * nx];
            envelope.clear();
            envelope.add_column(nx, |x| other[y * nx + x], |p| square(p[1] - y as f32), sites);
            envelope.each(nx, |x, id| {
                let here = [x as f32, y as f32, z as f32];
                row[x] = nearer(sites, here, row[x], id);
            });
        }
    });
    watch.check()?;

    // Spread along z, into layers of y.
    let mut spread = vec![NONE; all];
    spread.par_chunks_mut(nx * nz).enumerate().for_each_init(Envelope::default, |envelope, (y, layer)| {
        if !watch.tick() {
            return;
        }
        for x in 0..nx {
            let off = |p: [f32; 3]| square(p[0] - x as f32) + square(p[1] - y as f32);
            envelope.clear();
            envelope.add_column(nz, |z| flat[(z * ny + y) * nx + x], off, sites);
            envelope.each(nz, |z, id| layer[z * nx + x] = id);
        }
    });
    drop(flat);
    watch.check()?;

    // The z lines, in layers of y.
    let mut upright = vec![NONE; all];
    upright.par_chunks_mut(nx * nz).enumerate().for_each_init(Envelope::default, |envelope, (y, layer)| {
        if !watch.tick() {
            return;
        }
        let mut column = vec![NONE; nz];
        for x in 0..nx {
            along(&lines[2], y * nx + x, sites, 2, &mut column);
            for z in 0..nz {
                layer[z * nx + x] = column[z];
            }
        }
        let mut row = vec![NONE; nx];
        for (z, out) in layer.chunks_mut(nx).enumerate() {
            row.copy_from_slice(out);
            envelope.clear();
            envelope.add_column(nx, |x| row[x], |p| square(p[2] - z as f32), sites);
            envelope.each(nx, |x, id| out[x] = id);
        }
    });
    watch.check()?;

    // Spread along y, and the nearer of the two kept.
    let mut found = vec![NONE; all];
    found.par_chunks_mut(nx * ny).enumerate().for_each_init(Envelope::default, |envelope, (z, layer)| {
        if !watch.tick() {
            return;
        }
        for x in 0..nx {
            let off = |p: [f32; 3]| square(p[0] - x as f32) + square(p[2] - z as f32);
            envelope.clear();
            envelope.add_column(ny, |y| upright[(y * nz + z) * nx + x], off, sites);
            envelope.each(ny, |y, id| {
                let here = [x as f32, y as f32, z as f32];
                layer[y * nx + x] = nearer(sites, here, spread[(y * nz + z) * nx + x], id);
            });
        }
    });
    watch.check()?;
    Ok(found)
}

fn square(v: f32) -> f64 {
    f64::from(v) * f64::from(v)
}

/// Square of the distance from a voxel to a site.
pub(super) fn apart(here: [f32; 3], site: &Site) -> f64 {
    (0..3).map(|k| square(here[k] - site.point[k])).sum()
}

/// The nearer of two sites; the first of equals, so that nothing depends on who came first.
fn nearer(sites: &[Site], here: [f32; 3], a: u32, b: u32) -> u32 {
    if a == NONE || b == NONE {
        return a.min(b);
    }
    let [da, db] = [a, b].map(|id| apart(here, &sites[id as usize]));
    if da < db || (da == db && a < b) { a } else { b }
}

/// The nearest site on a line, for each of its voxels.
fn along(lines: &Lines, line: usize, sites: &[Site], axis: usize, out: &mut [u32]) {
    let mut rest = lines.of(line);
    let Some(mut here) = rest.next() else {
        out.fill(NONE);
        return;
    };
    let mut next = rest.next();
    for (i, o) in out.iter_mut().enumerate() {
        while let Some(n) = next {
            let [a, b] = [here, n].map(|s| (sites[s].point[axis] - i as f32).abs());
            if b >= a {
                break;
            }
            here = n;
            next = rest.next();
        }
        *o = here as u32;
    }
}

/// The lower envelope of parabolas of equal width.
#[derive(Default)]
struct Envelope {
    /// Where each begins, its middle, its least value plus its middle's square, its site.
    kept: Vec<(f64, f64, f64, u32)>,
}

impl Envelope {
    fn clear(&mut self) {
        self.kept.clear();
    }

    /// One parabola for every voxel of a column that knows a site, `off` being the square of its distance across.
    fn add_column(
        &mut self,
        length: usize,
        site: impl Fn(usize) -> u32,
        off: impl Fn([f32; 3]) -> f64,
        sites: &[Site],
    ) {
        for i in 0..length {
            let id = site(i);
            if id == NONE {
                continue;
            }
            let middle = i as f64;
            let value = off(sites[id as usize].point) + middle * middle;
            let mut begin = f64::NEG_INFINITY;
            while let Some(&(from, m, v, _)) = self.kept.last() {
                begin = (value - v) / (2.0 * (middle - m));
                if begin > from {
                    break;
                }
                self.kept.pop();
                begin = f64::NEG_INFINITY;
            }
            self.kept.push((begin, middle, value, id));
        }
    }

    /// Calls `take` with each voxel and the site of the lowest parabola there.
    fn each(&self, length: usize, mut take: impl FnMut(usize, u32)) {
        let mut k = 0;
        for i in 0..length {
            while k + 1 < self.kept.len() && self.kept[k + 1].0 < i as f64 {
                k += 1;
            }
            take(i, self.kept.get(k).map_or(NONE, |p| p.3));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::local::lines::Shape;
    use geometry::mesh::samples::torus;
    use geometry::progress::Silent;

    #[test]
    fn every_voxel_finds_the_nearest_of_all_sites() {
        let mut ring = torus(24, 16);
        for v in ring.vertices.iter_mut().flatten() {
            *v = 3.1 * *v + 10.3;
        }
        let size = [22, 19, 17];
        let shape = Shape::new(&ring, [0.0; 3], 1.0);
        let mut lines = [0, 1, 2].map(|a| Lines::new(&shape, size, a));
        let mut sites = Vec::new();
        lines.iter_mut().for_each(|l| l.file(&mut sites));
        let found = nearest(size, &sites, &lines, &Watch::new(&Silent, 1)).expect("found");
        for (i, id) in found.iter().enumerate() {
            let here = [i % 22, i / 22 % 19, i / (22 * 19)].map(|c| c as f32);
            let least = sites.iter().map(|s| apart(here, s)).fold(f64::INFINITY, f64::min);
            let is = apart(here, &sites[*id as usize]);
            assert!((is - least).abs() < 1e-5 * (1.0 + least), "{here:?}: {is} {least}");
        }
    }
}
