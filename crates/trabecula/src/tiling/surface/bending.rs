//! What bending tetrahedra onto the surface of a region changes: their volume, what is solid of it, and the area of the mid-surface of walls.
//!
//! The lattice follows the coordinates in a tetrahedron, so bending leaves the share of no cell as it was: it adds volume where the
//! boundary is convex and takes it where it is concave, in some parts of a cell more than in others. Summed over small tetrahedra as the
//! surface has them, on which f − t is taken as linear, flat and bent alike: the difference of both is free of most of what that costs. Two
//! sizes of them together are of fourth order (Richardson).

use std::sync::Arc;

use rayon::prelude::*;

use super::MeshingContext;
use crate::cell::Part;
use crate::tiling::Tiling;
use crate::tiling::mixture::{Size, weights};
use geometry::math::{Vec3, add, scale};
use geometry::tetmesh::{cut_area, volume};

/// Steps along the edge of a tetrahedron, coarse and fine.
const STEPS: [usize; 2] = [8, 16];
/// The most tetrahedra in which it is found, evenly spread over those that are bent.
const TETS: usize = 1000;

/// What bending changes, in some tetrahedra.
pub struct Bending([InSteps; 2]);

/// The same by small tetrahedra of one size.
struct InSteps {
    size: Size,
    tets: Vec<BentTet>,
    /// For how many each stands.
    each: f64,
}

/// A bent tetrahedron.
struct BentTet {
    t: usize,
    /// What each small tetrahedron gains, mm³.
    gains: Vec<f32>,
    /// What the surface f = 0 of the first cell gains, mm².
    area: f64,
}

impl Bending {
    /// That of the mesh of a tiling; `None` if it is flat, if tetrahedra overlap, and for a surface that cannot be cut.
    fn new(tiling: &Tiling) -> Option<Bending> {
        if !tiling.map.is_bent() || tiling.map.overlap() > 0.0 {
            return None;
        }
        let [coarse, fine] = STEPS.map(|n| InSteps::new(tiling, n));
        Some(Bending([coarse?, fine?]))
    }

    /// A sum in small tetrahedra without end.
    fn of(&self, sum: impl Fn(&InSteps) -> f64) -> f64 {
        let [coarse, fine] = self.0.each_ref().map(sum);
        fine + (fine - coarse) / 3.0
    }

    /// Walls of this volume (mm³) over a mid-surface of this area (mm²) in flat tetrahedra: how thick they are in bent ones, mm.
    pub(in crate::tiling) fn thickness(&self, tiling: &Tiling, volume: f64, area: f64) -> f64 {
        (volume + self.of(|s| s.solid(tiling))) / (area + self.of(InSteps::area))
    }
}

impl InSteps {
    fn new(tiling: &Tiling, n: usize) -> Option<InSteps> {
        let work = MeshingContext::in_steps(tiling, n).ok()?;
        let touched = work.bent_nodes()?.touched(&tiling.map);
        let count = touched.len().min(TETS);
        let size = Size::new(&tiling.cells, n);
        let tets = (0..count).into_par_iter().map(|i| {
            let t = touched[i * touched.len() / count];
            bent_tet(&work, &size, t)
        });
        let tets = tets.collect();
        Some(InSteps { size, tets, each: touched.len() as f64 / count.max(1) as f64 })
    }

    /// What is gained of the solid in the whole mesh at the level of a tiling, mm³.
    fn solid(&self, tiling: &Tiling) -> f64 {
        let one = |bent: &BentTet| {
            let corner = |i: usize| core::array::from_fn(|k| f64::from(u8::from(k == i)));
            let levels = core::array::from_fn(|i| tiling.level_at(bent.t, corner(i)));
            let weights = weights(&tiling.map, &tiling.cells, bent.t);
            self.size.solid(tiling.part, &weights, levels, &bent.gains)
        };
        // Summed in their order.
        let found: Vec<f64> = self.tets.par_iter().map(one).collect();
        self.each * found.iter().sum::<f64>()
    }

    /// What is gained of the mid-surface, mm².
    fn area(&self) -> f64 {
        self.each * self.tets.iter().map(|t| t.area).sum::<f64>()
    }
}

fn bent_tet(work: &MeshingContext, size: &Size, t: usize) -> BentTet {
    let (map, nodes) = (&work.tiling.map, &work.cells[0].0);
    let corners = map.corners(t);
    let place = |k: &[u16; 4]| -> Vec3 {
        let sum = (0..4).fold([0.0; 3], |s, i| add(s, scale(corners[i], f64::from(k[i]))));
        scale(sum, 1.0 / nodes.grid.n as f64)
    };
    let flat: Vec<Vec3> = nodes.whole.iter().map(place).collect();
    let Some(places) = work.places(t) else {
        return BentTet { t, gains: vec![0.0; size.tets.len()], area: 0.0 };
    };
    let corners = |at: &[Vec3], small: &[u32; 4]| small.map(|n| at[n as usize]);
    let change =
        |small: &[u32; 4], of: &dyn Fn([Vec3; 4]) -> f64| of(corners(&places.nodes, small)) - of(corners(&flat, small));
    let gain = |small: &[u32; 4]| change(small, &|corners| volume(corners).abs()) as f32;
    let area = match work.tiling.part {
        Part::Sheet => {
            let values = |small: &[u32; 4]| small.map(|n| size.cells[0][n as usize]);
            size.tets.iter().map(|small| change(small, &|corners| cut_area(corners, values(small)))).sum()
        }
        _ => 0.0,
    };
    BentTet { t, gains: size.tets.iter().map(gain).collect(), area }
}

impl Tiling {
    /// What bending its mesh changes; `None` if that is flat, if tetrahedra overlap, and for a surface that cannot be cut.
    pub(in crate::tiling) fn bending(&self) -> Option<Arc<Bending>> {
        // Not found under a lock: it is parallel itself, and would wait for others that wait for it.
        if let Some(known) = self.bending.get() {
            return known.clone();
        }
        let found = Bending::new(self).map(Arc::new);
        self.bending.set(found.clone()).ok();
        found
    }

    /// The volume of the solid (mm³) where the mesh is bent onto the surface of a region; `None` where tetrahedra are flat or overlap.
    pub fn bent_volume(&self) -> Option<f64> {
        let bending = self.bending()?;
        Some(self.volumes().1 + bending.of(|s| s.solid(self)))
    }
}
