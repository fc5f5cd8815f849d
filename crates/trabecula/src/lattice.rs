//! A lattice: cell, map, part, level. The only file where cell and map meet.

mod rows;
pub(crate) use rows::LatticeRows;

use std::sync::Arc;

use crate::cell::{Cell, Cut, Distance, Part};
use crate::field::{Block, Field};
use crate::grade::Grade;
use crate::implicit::{Implicit, SurfacePair};
use crate::map::Map;
use geometry::math::{
    Aabb, IDENTITY, Interval, Mat3, Vec3, add, apply, inverse, norm, product, scale, spectral_norm, sub, transpose,
};

/// How much of the cell is solid.
#[derive(Clone)]
pub enum Level {
    /// The field value t; for a sheet the half-level.
    Iso(Grade),
    /// Solid volume fraction of the cell on the torus.
    Fraction(Grade),
    /// Thickness w of the wall in mm: solid is what lies within w/2 of the mid-surface f = 0. For sheets.
    Thickness(Grade),
}

impl Level {
    /// The value as given.
    pub fn grade(&self) -> &Grade {
        match self {
            Level::Iso(g) | Level::Fraction(g) | Level::Thickness(g) => g,
        }
    }
}

/// Greatest ratio of a distance under a map that varies to the one in the table; a cell that is stretched more keeps
/// this ratio.
const STRETCHED: f64 = 8.0;

/// A lattice as a field: sheet |f| − t, lower f − t, upper t − f.
///
/// f is the core: cell ∘ map, or, where the level is a thickness w, the signed distance (mm) to the mid-surface
/// cell ∘ map = 0; t is the level of the core: the iso, the one of the fraction, or w/2.
#[derive(Clone)]
pub struct Lattice {
    /// The cell.
    pub cell: Arc<Cell>,
    /// The map.
    pub map: Map,
    /// The part.
    pub part: Part,
    /// The level.
    pub level: Level,
    /// The core, where it is a distance.
    distance: Option<Arc<Distance>>,
    /// A Lipschitz bound of the core: per mm if the map is affine, else per turn.
    core_lipschitz: f64,
    /// t, where it does not vary.
    uniform: Option<f64>,
    /// The part, or one side of it alone.
    cut: Cut,
}

impl Lattice {
    /// A lattice of its four parts; bounds and tables are computed here.
    pub fn new(cell: Arc<Cell>, map: Map, part: Part, level: Level) -> Lattice {
        let typical = map.typical();
        let distance = match &level {
            Level::Thickness(_) => Some(Arc::new(Distance::new(cell.series(), &typical))),
            _ => None,
        };
        let core_lipschitz = match (&distance, map.affine()) {
            (Some(d), Some(_)) => d.lipschitz(),
            // Per turn of the direction in which a turn is longest.
            (Some(d), None) => d.lipschitz() * spectral_norm(&inverse(&typical)),
            (None, Some(map)) => cell.lipschitz(&map.matrix),
            (None, None) => cell.lipschitz(&IDENTITY),
        };
        let uniform = match &level {
            Level::Iso(g) => g.constant(),
            Level::Fraction(g) => g.constant().map(|p| cell.level(part, p)),
            Level::Thickness(g) => g.constant().map(|w| 0.5 * w),
        };
        Lattice { cell, map, part, level, distance, core_lipschitz, uniform, cut: Cut::new(part) }
    }

    /// The signed distance to the mid-surface, where the level is a thickness.
    pub fn distance(&self) -> Option<&Distance> {
        self.distance.as_deref()
    }

    /// The thickness (mm) beyond which the faces of a wall fold, where the level is a thickness: that of the cell, where
    /// the map presses cells together most.
    pub fn folding(&self) -> Option<f64> {
        let d = self.distance.as_ref()?;
        let back = inverse(&self.map.typical());
        // From millimetres to those of the unturned typical cell.
        let pressed = |j: &Mat3| spectral_norm(&product(&back, j));
        let most = match self.map.affine() {
            Some(_) => 1.0,
            None => self.map.extremes().iter().map(pressed).fold(0.0, f64::max),
        };
        Some(d.folding()? / most)
    }

    /// Fills the core f at points (mm).
    pub fn cores(&self, points: &[Vec3], out: &mut [f64]) {
        let n = points.len();
        let (mut u, mut g) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        match &self.distance {
            Some(d) if self.map.affine().is_none() => {
                let mut j = vec![[[0.0; 3]; 3]; n];
                self.map.phases_and_jacobians(points, &mut u, &mut j);
                d.gradients(&u, out, &mut g);
                for ((f, g), j) in out.iter_mut().zip(g).zip(&j) {
                    *f *= d.under(1.0, g, j).min(STRETCHED);
                }
            }
            distance => {
                self.map.phases(points, &mut u);
                match distance {
                    Some(d) => d.values(&u, out),
                    None => self.cell.gradients(&u, out, &mut g),
                }
            }
        }
    }

    /// Fills the core f and ∇f (per mm) at points (mm).
    pub fn core_gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let Some(map) = self.map.affine() else {
            return self.curved_gradients(points, values, gradients);
        };
        let mut u = vec![[0.0; 3]; points.len()];
        self.map.phases(points, &mut u);
        match &self.distance {
            Some(d) => d.gradients(&u, values, gradients),
            None => self.cell.gradients(&u, values, gradients),
        }
        let back = transpose(&map.matrix);
        for g in gradients.iter_mut() {
            *g = apply(&back, *g);
        }
    }

    /// As `core_gradients`, under a map whose Jacobian varies.
    fn curved_gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let n = points.len();
        let (mut u, mut j) = (vec![[0.0; 3]; n], vec![[[0.0; 3]; 3]; n]);
        self.map.phases_and_jacobians(points, &mut u, &mut j);
        let Some(d) = &self.distance else {
            self.cell.gradients(&u, values, gradients);
            for (g, j) in gradients.iter_mut().zip(&j) {
                *g = apply(&transpose(j), *g);
            }
            return;
        };
        let mut second = vec![[[0.0; 3]; 3]; n];
        d.second(&u, values, gradients, &mut second);
        // Maps give no second derivatives; central differences along the gradient are as accurate.
        let step = 1e-5 * self.map.wavelength();
        let mut ends = Vec::with_capacity(2 * n);
        for ((p, g), j) in points.iter().zip(&*gradients).zip(&j) {
            let w = apply(&transpose(j), *g);
            let to = scale(w, step / norm(w).max(f64::MIN_POSITIVE));
            ends.extend([sub(*p, to), add(*p, to)]);
        }
        let mut j_ends = vec![[[0.0; 3]; 3]; 2 * n];
        self.map.phases_and_jacobians(&ends, &mut vec![[0.0; 3]; 2 * n], &mut j_ends);
        let each = values.iter_mut().zip(gradients).zip(j.iter().zip(&second)).zip(j_ends.as_chunks::<2>().0);
        for (((f, g), (j, second)), j_ends) in each {
            let (back, (ratio, a, b)) = (transpose(j), d.ratio_slopes(*g, j));
            let w = apply(&back, *g);
            let long = norm(w);
            let mut slope = scale(w, ratio.min(STRETCHED));
            if ratio < STRETCHED && long > 0.0 {
                let [lo, hi] = [0, 1].map(|e: usize| apply(&transpose(&j_ends[e]), *g));
                let turned = scale(sub(hi, lo), b * long / (2.0 * step));
                slope = add(slope, scale(add(apply(&back, apply(second, a)), turned), *f));
            }
            (*f, *g) = (*f * ratio.min(STRETCHED), slope);
        }
    }

    /// An interval that contains the core's values in the box.
    pub fn core_bound(&self, b: &Aabb) -> Interval {
        let reach = norm(b.size()) / 2.0;
        let around =
            |v: f64, reach: f64, all: Interval| Interval::new((v - reach).max(all.lo), (v + reach).min(all.hi));
        let most = self.cell.series().amplitude();
        let waves = Interval::new(-most, most);
        let mut v = [0.0];
        if self.map.affine().is_some() {
            self.cores(&[b.center()], &mut v);
            let all = self.distance.as_ref().map_or(waves, |d| d.range());
            return around(v[0], self.core_lipschitz * reach, all);
        }
        let turns = self.map.lipschitz(b) * reach;
        let Some(d) = &self.distance else {
            self.cores(&[b.center()], &mut v);
            return around(v[0], self.core_lipschitz * turns, waves);
        };
        let mut u = [[0.0; 3]];
        self.map.phases(&[b.center()], &mut u);
        d.values(&u, &mut v);
        let r = around(v[0], self.core_lipschitz * turns, d.range());
        // No gradient is lengthened by more than this, so no distance is multiplied by less than its inverse.
        let longest = self.map.lipschitz(b) * spectral_norm(&inverse(&self.map.typical()));
        let least = (1.0 / longest).min(1.0);
        let lo = if r.lo > 0.0 { r.lo * least } else { r.lo * STRETCHED };
        let hi = if r.hi < 0.0 { r.hi * least } else { r.hi * STRETCHED };
        Interval::new(lo, hi)
    }

    /// The level t of the core where the level's number is `v`, and its slope.
    pub fn iso(&self, v: f64) -> (f64, f64) {
        match self.level {
            Level::Iso(_) => (v, 1.0),
            Level::Fraction(_) => self.cell.iso(self.part, v),
            Level::Thickness(_) => (0.5 * v, 0.5),
        }
    }

    /// Fills the core's level t at points (mm).
    pub fn isos(&self, points: &[Vec3], out: &mut [f64]) {
        if let Some(t) = self.uniform {
            return out.fill(t);
        }
        self.level.grade().values(points, out);
        for t in out.iter_mut() {
            *t = self.iso(*t).0;
        }
    }

    /// Fills the core's level t and its gradient (per mm) at points (mm).
    pub fn iso_gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        if let Some(t) = self.uniform {
            values.fill(t);
            return gradients.fill([0.0; 3]);
        }
        self.level.grade().gradients(points, values, gradients);
        for (t, dt) in values.iter_mut().zip(gradients) {
            let (iso, slope) = self.iso(*t);
            (*t, *dt) = (iso, scale(*dt, slope));
        }
    }

    /// An interval that contains the core's levels in the box.
    pub fn iso_bound(&self, b: &Aabb) -> Interval {
        if let Some(t) = self.uniform {
            return Interval::new(t, t);
        }
        let mut v = self.level.grade().bound(b);
        if let Level::Fraction(_) = self.level {
            v = Interval::new(v.lo.clamp(0.0, 1.0), v.hi.clamp(0.0, 1.0));
        }
        let ends = [v.lo, v.hi].map(|v| self.iso(v).0);
        Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1]))
    }

    /// Fills the solid fraction of the cell at points (mm). A wall of given thickness is more of a cell where the map makes cells smaller.
    pub fn fractions(&self, points: &[Vec3], out: &mut [f64]) {
        if let Level::Fraction(g) = &self.level {
            return g.values(points, out);
        }
        self.isos(points, out);
        match &self.distance {
            Some(d) if self.map.affine().is_none() => {
                let n = points.len();
                let (mut u, mut j) = (vec![[0.0; 3]; n], vec![[[0.0; 3]; 3]; n]);
                self.map.phases_and_jacobians(points, &mut u, &mut j);
                for (t, j) in out.iter_mut().zip(&j) {
                    *t = d.fraction(self.part, *t * d.pace(j));
                }
            }
            _ => out.iter_mut().for_each(|t| *t = self.fraction(*t)),
        }
    }

    /// The solid fraction of the cell where the core's level is t; of a wall of given thickness, in cells of the map's mean size.
    pub fn fraction(&self, t: f64) -> f64 {
        match &self.distance {
            Some(d) => d.fraction(self.part, t),
            None => self.cell.fraction(self.part, t),
        }
    }

    /// The share of the cell in which the core is less than v.
    pub fn below(&self, v: f64) -> f64 {
        match &self.distance {
            Some(d) => d.fraction(Part::Lower, v),
            None => self.cell.fraction(Part::Lower, v),
        }
    }

    /// The level of the core, where it does not vary.
    pub fn uniform(&self) -> Option<f64> {
        self.uniform
    }

    /// The intervals of solid fraction in which the periodic solid is connected in R³.
    pub fn connected_fraction(&self) -> Vec<[f64; 2]> {
        match &self.distance {
            Some(d) => d.connected_fraction(self.part),
            None => self.cell.connected_fraction(self.part),
        }
    }
}

impl Field for Lattice {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.cores(points, out);
        let mut t = vec![0.0; points.len()];
        self.isos(points, &mut t);
        for (f, t) in out.iter_mut().zip(t) {
            *f = self.cut.value(*f, t);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.core_gradients(points, values, gradients);
        let cut = |f: &mut f64, g: &mut Vec3, t: f64, dt: Vec3| {
            (*f, *g) = self.cut.gradient((*f, *g), (t, dt));
        };
        let both = values.iter_mut().zip(gradients);
        if let Some(t) = self.uniform {
            return both.for_each(|(f, g)| cut(f, g, t, [0.0; 3]));
        }
        let n = points.len();
        let (mut t, mut dt) = (vec![0.0; n], vec![[0.0; 3]; n]);
        self.iso_gradients(points, &mut t, &mut dt);
        for ((f, g), (t, dt)) in both.zip(t.into_iter().zip(dt)) {
            cut(f, g, t, dt);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.cut.bound(self.core_bound(b), self.iso_bound(b))
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_cuts(block, None, [(self.cut, out)]);
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.fill_cuts(block, Some(wanted), [(self.cut, out)]);
    }
}

impl Implicit for Lattice {
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        self.cut.sides(|cut| Lattice { cut, ..self.clone() })
    }

    fn pair(&self) -> Option<Arc<dyn SurfacePair>> {
        (self.cut.halves().is_some()).then(|| Arc::new(self.clone()) as Arc<dyn SurfacePair>)
    }

    fn faces(&self) -> Option<[Arc<dyn Implicit>; 2]> {
        self.parts().try_into().ok()
    }

    fn lipschitz(&self) -> f64 {
        match self.map.affine() {
            Some(_) => self.core_lipschitz,
            None => self.core_lipschitz * self.map.max_lipschitz(),
        }
    }
}

impl SurfacePair for Lattice {
    fn fill_both(&self, block: &Block, wanted: &[u64], [a, b]: [&mut [f32]; 2]) {
        let [lower, upper] = self.cut.halves().unwrap_or([self.cut; 2]);
        self.fill_cuts(block, Some(wanted), [(lower, a), (upper, b)]);
    }
}

impl Lattice {
    /// Fills the values of cuts. Only a level that varies is evaluated node by node, and only at the nodes in `wanted`.
    fn fill_cuts<const N: usize>(&self, block: &Block, wanted: Option<&[u64]>, mut out: [(Cut, &mut [f32]); N]) {
        let mut rows = LatticeRows::new(self, block);
        let [xs, ys, zs] = block.axes;
        let mut core = vec![0f32; xs.len()];
        let mut isos = vec![self.uniform.unwrap_or(0.0) as f32; xs.len()];
        let mut points: Vec<Vec3> = Vec::new();
        let mut found: Vec<f64> = Vec::new();
        for n in 0..ys.len() * zs.len() {
            let (j, k) = (n % ys.len(), n / ys.len());
            let word = wanted.map_or(u64::MAX, |w| w[n]);
            let here = |i: usize| wanted.is_none() || word >> i & 1 == 1;
            let row = n * xs.len()..(n + 1) * xs.len();
            if j == 0 {
                rows.enter_layer(k);
            }
            if word == 0 {
                out.iter_mut().for_each(|(_, out)| out[row.clone()].fill(1.0));
                continue;
            }
            rows.fill(j, k, word, &mut core);
            if self.uniform.is_none() {
                points.clear();
                points.extend((0..xs.len()).filter(|&i| here(i)).map(|i| [xs[i], ys[j], zs[k]]));
                found.resize(points.len(), 0.0);
                self.isos(&points, &mut found);
                for (i, t) in (0..xs.len()).filter(|&i| here(i)).zip(&found) {
                    isos[i] = *t as f32;
                }
            }
            out.iter_mut().for_each(|(cut, out)| cut.fill(&core, &isos, &mut out[row.clone()]));
        }
    }
}

/// Sample positions of a report on a lattice: nodes of a grid over a box.
pub fn sample_points(b: &Aabb, n: usize) -> Vec<Vec3> {
    let step = scale(b.size(), 1.0 / n as f64);
    let node = |i: usize, a: usize| (i as f64 + 0.5) * step[a];
    (0..n * n * n).map(|i| add(b.min, [node(i % n, 0), node(i / n % n, 1), node(i / n / n, 2)])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Series, named};
    use crate::map::{Affine, Mapping, Round};

    fn lattice(part: Part, level: Level, map: impl Mapping + 'static) -> Lattice {
        let cell = Cell::new(Series::new(named("gyroid").expect("named").terms()).expect("series"));
        Lattice::new(Arc::new(cell), Arc::new(map), part, level)
    }

    #[test]
    fn block_equals_points_and_bounds_hold() {
        let map = Affine::rigid([4.0, 5.0, 6.0], [10.0, 20.0, 30.0], [0.1, 0.2, 0.3], &[]).expect("valid");
        for part in [Part::Sheet, Part::Lower, Part::Upper] {
            let l = lattice(part, Level::Fraction(Grade::Constant(0.3)), map);
            let axis: Vec<f64> = (0..17).map(|i| 0.21 * f64::from(i) - 1.3).collect();
            let block = Block { axes: [&axis, &axis, &axis] };
            let mut out = vec![0f32; block.len()];
            l.fill(&block, &mut out);
            let b = l.bound(&block.bounds());
            for (i, v) in out.iter().enumerate() {
                let p = [axis[i % 17], axis[i / 17 % 17], axis[i / 289]];
                // Rounding to f32 of tables, products and six sums of size one.
                assert!((f64::from(*v) - l.value(p)).abs() < 2e-6);
                assert!(b.lo <= l.value(p) && l.value(p) <= b.hi);
            }
        }
    }

    #[test]
    fn gradients_agree_with_differences() {
        let map = Affine::spartan([4.0, 5.0, 6.0], [10.0, 20.0, 30.0], [0.0; 3]).expect("valid");
        let wrapped = Round::cylinder([-12.0, 2.0, 0.0], [0.2, 0.1, 1.0], [3.0, 4.0], 20.0, [8.0, 20.0, 30.0]);
        let wrapped = wrapped.expect("valid");
        let iso = || Level::Iso(Grade::Constant(0.2));
        let all = [Part::Sheet, Part::Lower, Part::Upper].map(|part| lattice(part, iso(), map));
        let wall = Level::Thickness(Grade::Constant(0.4));
        for l in all.into_iter().chain([lattice(Part::Sheet, iso(), wrapped), lattice(Part::Sheet, wall, wrapped)]) {
            for i in 0..50 {
                let p = [0.3 * f64::from(i), 1.0 - 0.2 * f64::from(i), 0.7];
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                l.gradients(&[p], &mut v, &mut g);
                assert!((v[0] - l.value(p)).abs() < 1e-14);
                // The third derivative of a table of distances jumps, and reaches some thousands near creases.
                let tolerance = if l.distance().is_some() { 1e-6 } else { 1e-8 };
                for a in 0..3 {
                    let mut q = [p, p];
                    q[0][a] -= 1e-5;
                    q[1][a] += 1e-5;
                    let difference = (l.value(q[1]) - l.value(q[0])) / 2e-5;
                    assert!((difference - g[0][a]).abs() < tolerance, "{p:?} {difference} {g:?}");
                }
            }
        }
    }
}
