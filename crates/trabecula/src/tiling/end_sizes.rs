//! The sizes of struts and walls about each node of the mesh, which rods of a net and rounded ends follow.
//!
//! A strut crosses the faces of a tetrahedron in its ports, and is as thin as the least face makes it: in flat tetrahedra, such as those of
//! layers of prisms, that is far smaller than the face on the surface.

use super::{NodalLevel, Ports, Tiling};
use geometry::math::{cross, norm, sub};
use geometry::tetmesh::FACES;

/// Levels at which the share of a face that is solid is tabulated, if the level varies.
const LEVELS: usize = 9;
/// The least share of a face that is solid, over that at the mean level: a node about which a cell has no ports has rods nevertheless.
const LEAST: f64 = 0.05;
/// The share of the width of an opening that rods may take from it.
const OPEN: f64 = 0.5;

impl Tiling {
    /// For each node of the mesh, the mean over its tetrahedra of the least area of their faces (mm²).
    pub fn least_faces(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.map.nodes().len()];
        for t in 0..self.map.len() {
            let c = self.map.corners(t);
            let area = |f: &[usize; 3]| 0.5 * norm(cross(sub(c[f[1]], c[f[0]]), sub(c[f[2]], c[f[0]])));
            let least = FACES.iter().map(area).fold(f64::INFINITY, f64::min);
            for n in self.map.tet(t) {
                let (sum, count) = &mut sums[n as usize];
                (*sum, *count) = (*sum + least, *count + 1.0);
            }
        }
        sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 }).collect()
    }

    /// The mean level.
    pub(super) fn mean_level(&self) -> f64 {
        let levels = self.levels();
        0.5 * (levels.lo + levels.hi)
    }

    /// For each node of the mesh, the area of a port in faces: `mean` at the mean level, where cells are mixed everywhere.
    pub(super) fn port_areas(&self, mean: f64) -> Vec<f64> {
        let count = self.map.nodes().len();
        let (NodalLevel::Nodes(of), [cell]) = (&self.level, &self.cells[..]) else { return vec![mean; count] };
        let levels = self.levels();
        let width = levels.hi - levels.lo;
        let share = |t: f64| cell.cell.face_fraction(self.part, t * cell.scale);
        let at_mean = share(self.mean_level());
        if width <= 0.0 || at_mean <= 0.0 {
            return vec![mean; count];
        }
        let steps = (LEVELS - 1) as f64;
        let table: Vec<f64> = (0..LEVELS).map(|i| share(levels.lo + width * i as f64 / steps) / at_mean).collect();
        let area = |t: &f64| {
            let at = ((t - levels.lo) / width * steps).clamp(0.0, steps);
            let i = (at as usize).min(LEVELS - 2);
            mean * (table[i] + (at - i as f64) * (table[i + 1] - table[i])).max(LEAST)
        };
        of.iter().map(area).collect()
    }

    /// For each node of the mesh, the greatest radius (mm) of rods of a net that leave half the width of an opening open: of regular
    /// triangles with the area of the least faces.
    fn open_radii(&self, ports: &Ports) -> Vec<f64> {
        let open = OPEN * ports.opening();
        self.least_faces().into_iter().map(|area| open * (4.0 * area / 3f64.sqrt()).sqrt()).collect()
    }

    /// As `rod_radii`, for rods of a given radius (mm): thinner where they would close the openings of triangles that are smaller than the
    /// others, in proportion to their size.
    pub fn given_radii(&self, radius: f64) -> Vec<f64> {
        let open = self.open_radii(&self.ports());
        let faces = self.map.boundary_nodes();
        let mean = faces.iter().flatten().map(|n| open[*n as usize]).sum::<f64>() / (3 * faces.len()).max(1) as f64;
        open.into_iter().map(|most| radius * (most / mean.min(radius)).min(1.0)).collect()
    }

    /// For each node of the mesh, the radius (mm) of the rods of a net that tie its ports: half a rod has the area of a port on the least
    /// face of a tetrahedron there; for a sheet it is the thickness of its walls. At most what leaves openings open.
    pub fn rod_radii(&self) -> Vec<f64> {
        let ports = self.ports();
        let own = match self.thickness() {
            Some(wall) => self.walls_at_nodes(wall.mean),
            None => {
                let areas = self.port_areas(ports.area);
                let radius = |(area, share): (f64, f64)| (2.0 * area * share / core::f64::consts::PI).sqrt();
                self.least_faces().into_iter().zip(areas).map(radius).collect()
            }
        };
        own.into_iter().zip(self.open_radii(&ports)).map(|(own, most)| own.min(most)).collect()
    }

    /// For each node of the mesh, the thickness (mm) of the walls of a sheet there, the mean of all being `mean`.
    fn walls_at_nodes(&self, mean: f64) -> Vec<f64> {
        // Walls are as thick as the level says, in units of the size.
        let level = |n: usize| match &self.level {
            NodalLevel::Same(t) => *t,
            NodalLevel::Nodes(of) => of[n],
        };
        let faces = self.least_faces();
        let own: Vec<f64> = faces.iter().enumerate().map(|(n, area)| level(n) * area.sqrt()).collect();
        let at = |t: usize| self.map.tet(t).map(|n| own[n as usize]).iter().sum::<f64>() / 4.0;
        let volume = |t: usize| self.map.volume(t);
        let sums = (0..self.map.len()).fold((0.0, 0.0), |(s, v), t| (s + volume(t) * at(t), v + volume(t)));
        own.into_iter().map(|v| mean * v * sums.1 / sums.0).collect()
    }
}
