//! For each voxel the nearest site: an exact Euclidean distance transform to points that lie on the lines of the grid.
//!
//! A site lies anywhere along its own line. Across lines the square of its distance is a parabola in whole steps, and the
//! lower envelope of these parabolas is found axis by axis: P. F. Felzenszwalb and D. P. Huttenlocher, Distance transforms of sampled functions,
//! Theory Comput. 8 (2012) 415. Sites on x and y lines lie in the layers of z and are spread along z last; sites on z
//! lines lie in the layers of y and are spread along y last.

use rayon::prelude::*;

use super::Watch;
use super::lines::{LineCrossings, NONE, Site};
use geometry::progress::Stopped;

/// Passes over the grid's layers along each axis, as they are counted by the watch.
pub(super) const PASSES: [usize; 3] = [0, 2, 2];

/// The index of the nearest site of each voxel, x fastest, then y.
pub(super) fn nearest_sites(
    size: [usize; 3],
    sites: &[Site],
    lines: &[LineCrossings; 3],
    watch: &Watch,
) -> Result<Vec<u32>, Stopped> {
    let transform = Transform { size, sites, lines, watch };
    let in_layers = transform.nearest_in_layers()?;
    let on_x_and_y_lines = transform.spread_along_z(&in_layers)?;
    drop(in_layers);
    let on_z_lines = transform.nearest_on_z_lines()?;
    transform.spread_along_y(&on_x_and_y_lines, &on_z_lines)
}

/// The passes of the distance transform. A pass works in parallel on layers of z (x fastest, then y) or of y (x fastest, then z).
struct Transform<'a> {
    size: [usize; 3],
    sites: &'a [Site],
    lines: &'a [LineCrossings; 3],
    watch: &'a Watch<'a>,
}

impl Transform<'_> {
    /// Fills layers of `length` voxels: `fill` gets the layer's number and the site of each of its voxels, none to begin with.
    fn in_layers(
        &self,
        length: usize,
        fill: impl Fn(&mut Envelope, usize, &mut [u32]) + Sync,
    ) -> Result<Vec<u32>, Stopped> {
        let mut out = vec![NONE; self.size.iter().product()];
        out.par_chunks_mut(length).enumerate().for_each_init(Envelope::default, |envelope, (number, layer)| {
            if self.watch.tick() {
                fill(envelope, number, layer);
            }
        });
        self.watch.check()?;
        Ok(out)
    }

    /// Layers of z: the nearest of the sites on the x and y lines of the voxel's own layer.
    fn nearest_in_layers(&self) -> Result<Vec<u32>, Stopped> {
        let [nx, ny, _] = self.size;
        self.in_layers(nx * ny, |envelope, z, layer| {
            self.nearest_on_x_lines(envelope, z, layer);
            self.keep_nearer_on_y_lines(envelope, z, layer);
        })
    }

    /// One layer of z: along the x lines, then spread along y.
    fn nearest_on_x_lines(&self, envelope: &mut Envelope, z: usize, layer: &mut [u32]) {
        let [nx, ny, _] = self.size;
        for (y, row) in layer.chunks_mut(nx).enumerate() {
            nearest_on_line(&self.lines[0], z * ny + y, self.sites, 0, row);
        }
        for x in 0..nx {
            envelope.clear();
            envelope.add_column(ny, |y| layer[y * nx + x], |p| square(p[0] - x as f32), self.sites);
            envelope.each(ny, |y, id| layer[y * nx + x] = id);
        }
    }

    /// One layer of z: along the y lines, spread along x, and the nearer of each and the site there is.
    fn keep_nearer_on_y_lines(&self, envelope: &mut Envelope, z: usize, layer: &mut [u32]) {
        let ([nx, ny, _], sites) = (self.size, self.sites);
        let mut on_lines = vec![NONE; nx * ny];
        let mut column = vec![NONE; ny];
        for x in 0..nx {
            nearest_on_line(&self.lines[1], z * nx + x, sites, 1, &mut column);
            for y in 0..ny {
                on_lines[y * nx + x] = column[y];
            }
        }
        for y in 0..ny {
            let row = &mut layer[y * nx..(y + 1) * nx];
            envelope.clear();
            envelope.add_column(nx, |x| on_lines[y * nx + x], |p| square(p[1] - y as f32), sites);
            envelope.each(nx, |x, id| {
                let here = [x as f32, y as f32, z as f32];
                row[x] = nearer(sites, here, row[x], id);
            });
        }
    }

    /// Layers of y: the sites of layers of z, spread along z.
    fn spread_along_z(&self, in_layers: &[u32]) -> Result<Vec<u32>, Stopped> {
        let [nx, ny, nz] = self.size;
        self.in_layers(nx * nz, |envelope, y, layer| {
            for x in 0..nx {
                let off = |p: [f32; 3]| square(p[0] - x as f32) + square(p[1] - y as f32);
                envelope.clear();
                envelope.add_column(nz, |z| in_layers[(z * ny + y) * nx + x], off, self.sites);
                envelope.each(nz, |z, id| layer[z * nx + x] = id);
            }
        })
    }

    /// Layers of y: the nearest of the sites on the z lines of the voxel's own layer.
    fn nearest_on_z_lines(&self) -> Result<Vec<u32>, Stopped> {
        let [nx, _, nz] = self.size;
        self.in_layers(nx * nz, |envelope, y, layer| {
            let mut column = vec![NONE; nz];
            for x in 0..nx {
                nearest_on_line(&self.lines[2], y * nx + x, self.sites, 2, &mut column);
                for z in 0..nz {
                    layer[z * nx + x] = column[z];
                }
            }
            let mut row = vec![NONE; nx];
            for (z, out) in layer.chunks_mut(nx).enumerate() {
                row.copy_from_slice(out);
                envelope.clear();
                envelope.add_column(nx, |x| row[x], |p| square(p[2] - z as f32), self.sites);
                envelope.each(nx, |x, id| out[x] = id);
            }
        })
    }

    /// Layers of z: the sites on z lines in layers of y, spread along y, or the nearer of those on x and y lines.
    fn spread_along_y(&self, on_x_and_y_lines: &[u32], on_z_lines: &[u32]) -> Result<Vec<u32>, Stopped> {
        let [nx, ny, nz] = self.size;
        self.in_layers(nx * ny, |envelope, z, layer| {
            for x in 0..nx {
                let off = |p: [f32; 3]| square(p[0] - x as f32) + square(p[2] - z as f32);
                envelope.clear();
                envelope.add_column(ny, |y| on_z_lines[(y * nz + z) * nx + x], off, self.sites);
                envelope.each(ny, |y, id| {
                    let here = [x as f32, y as f32, z as f32];
                    layer[y * nx + x] = nearer(self.sites, here, on_x_and_y_lines[(y * nz + z) * nx + x], id);
                });
            }
        })
    }
}

fn square(v: f32) -> f64 {
    f64::from(v) * f64::from(v)
}

/// Square of the distance from a voxel to a site, steps².
pub(super) fn distance_squared(here: [f32; 3], site: &Site) -> f64 {
    (0..3).map(|k| square(here[k] - site.point[k])).sum()
}

/// The nearer of two sites; of equally near ones that of lower index, so that the order of the passes does not matter.
fn nearer(sites: &[Site], here: [f32; 3], a: u32, b: u32) -> u32 {
    if a == NONE || b == NONE {
        return a.min(b);
    }
    let [da, db] = [a, b].map(|id| distance_squared(here, &sites[id as usize]));
    if da < db || (da == db && a < b) { a } else { b }
}

/// The nearest site on a line, for each of its voxels.
fn nearest_on_line(lines: &LineCrossings, line: usize, sites: &[Site], axis: usize, out: &mut [u32]) {
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
    /// Where each becomes the lowest, its apex, its least value plus its apex's square, its site.
    kept: Vec<(f64, f64, f64, u32)>,
}

impl Envelope {
    fn clear(&mut self) {
        self.kept.clear();
    }

    /// Adds a parabola for every voxel of a column that has a site, `off` being the square of that site's distance across.
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
            let apex = i as f64;
            let value = off(sites[id as usize].point) + apex * apex;
            let mut begin = f64::NEG_INFINITY;
            while let Some(&(from, a, v, _)) = self.kept.last() {
                begin = (value - v) / (2.0 * (apex - a));
                if begin > from {
                    break;
                }
                self.kept.pop();
                begin = f64::NEG_INFINITY;
            }
            self.kept.push((begin, apex, value, id));
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
    use crate::analysis::local_thickness::lines::MeshInSteps;
    use geometry::mesh::samples::torus;
    use geometry::progress::Silent;

    #[test]
    fn every_voxel_finds_the_nearest_of_all_sites() {
        let mut ring = torus(24, 16);
        for v in ring.vertices.iter_mut().flatten() {
            *v = 3.1 * *v + 10.3;
        }
        let size = [22, 19, 17];
        let shape = MeshInSteps::new(&ring, [0.0; 3], 1.0);
        let mut lines = [0, 1, 2].map(|a| LineCrossings::new(&shape, size, a));
        let mut sites = Vec::new();
        lines.iter_mut().for_each(|l| l.file(&mut sites));
        let found = nearest_sites(size, &sites, &lines, &Watch::new(&Silent, 1)).expect("found");
        for (i, id) in found.iter().enumerate() {
            let here = [i % 22, i / 22 % 19, i / (22 * 19)].map(|c| c as f32);
            let least = sites.iter().map(|s| distance_squared(here, s)).fold(f64::INFINITY, f64::min);
            let is = distance_squared(here, &sites[*id as usize]);
            assert!((is - least).abs() < 1e-5 * (1.0 + least), "{here:?}: {is} {least}");
        }
    }
}
