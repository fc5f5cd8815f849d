//! CSG trees: how implicit surfaces make a solid by intersection and union.
//!
//! A box is the intersection of six half-spaces, a sheet that of its two sides.

use std::sync::Arc;

use crate::field::{Block, Field};
use crate::implicit::Surface;
use geometry::math::{Aabb, Interval, Mat3, Vec3, add, apply, spectral_norm, transpose};

/// A CSG tree over numbered implicit surfaces. Negation is at the leaves alone.
#[derive(Clone, Debug, PartialEq)]
pub enum CsgTree {
    /// Where the function of the surface with this number is negative.
    Leaf(usize),
    /// Where that function is not negative: in the spaces adjacent to a wall, which have the wall's surfaces. No `CsgSolid` has it.
    Outside(usize),
    /// Where all are solid; everywhere if the list is empty.
    Intersection(Vec<CsgTree>),
    /// Where any is solid; nowhere if the list is empty.
    Union(Vec<CsgTree>),
}

impl CsgTree {
    /// Solid everywhere.
    pub const FULL: CsgTree = CsgTree::Intersection(Vec::new());
    /// Solid nowhere.
    pub const EMPTY: CsgTree = CsgTree::Union(Vec::new());

    /// Evaluates 64 positions at once: `negative` gives one bit per position for a surface.
    #[inline]
    pub fn solid(&self, negative: &impl Fn(usize) -> u64) -> u64 {
        self.certain(negative, negative)
    }

    /// The positions that may be solid, if each surface is negative in `all` and may be in `some`.
    #[inline]
    pub fn possible(&self, some: &impl Fn(usize) -> u64, all: &impl Fn(usize) -> u64) -> u64 {
        self.certain(all, some)
    }

    /// The positions that are certainly solid, if each surface is negative in `all` and may be in `some`.
    #[inline]
    pub fn certain(&self, some: &impl Fn(usize) -> u64, all: &impl Fn(usize) -> u64) -> u64 {
        match self {
            CsgTree::Leaf(i) => all(*i),
            CsgTree::Outside(i) => !some(*i),
            CsgTree::Intersection(of) => of.iter().fold(u64::MAX, |w, t| w & t.certain(some, all)),
            CsgTree::Union(of) => of.iter().fold(0, |w, t| w | t.certain(some, all)),
        }
    }

    /// Calls `found` for each surface with the positions, of those in `here`, where its sign can decide the result. `some`
    /// and `all` give for a surface the positions where it may be negative and where it certainly is. Exact if no surface
    /// occurs twice in the tree.
    pub fn deciding(
        &self,
        here: u64,
        some: &impl Fn(usize) -> u64,
        all: &impl Fn(usize) -> u64,
        found: &mut impl FnMut(usize, u64),
    ) {
        let (of, join) = match self {
            CsgTree::Leaf(i) | CsgTree::Outside(i) => return found(*i, here & some(*i) & !all(*i)),
            CsgTree::Intersection(of) => (of, true),
            CsgTree::Union(of) => (of, false),
        };
        for (n, t) in of.iter().enumerate() {
            // This child decides only where its siblings can all be solid (intersection) or all be empty (union).
            let others = of.iter().enumerate().filter(|(m, _)| *m != n);
            let open =
                others.fold(here, |w, (_, o)| w & if join { o.possible(some, all) } else { !o.certain(some, all) });
            if open != 0 {
                t.deciding(open, some, all, found);
            }
        }
    }

    /// The simplified tree, given for each surface its known sign or its new number.
    pub fn simplified(&self, sign: &impl Fn(usize) -> Sign) -> CsgTree {
        let (of, all) = match self {
            CsgTree::Leaf(i) => match sign(*i) {
                Sign::Negative => return CsgTree::FULL,
                Sign::Positive => return CsgTree::EMPTY,
                Sign::Varies(n) => return CsgTree::Leaf(n),
            },
            CsgTree::Outside(i) => match sign(*i) {
                Sign::Negative => return CsgTree::EMPTY,
                Sign::Positive => return CsgTree::FULL,
                Sign::Varies(n) => return CsgTree::Outside(n),
            },
            CsgTree::Intersection(of) => (of, true),
            CsgTree::Union(of) => (of, false),
        };
        let (deciding, idle) = if all { (CsgTree::EMPTY, CsgTree::FULL) } else { (CsgTree::FULL, CsgTree::EMPTY) };
        let mut kept = Vec::new();
        for t in of.iter().map(|t| t.simplified(sign)) {
            if t == deciding {
                return deciding;
            }
            if t != idle {
                kept.push(t);
            }
        }
        match kept.len() {
            1 => kept.remove(0),
            _ if all => CsgTree::Intersection(kept),
            _ => CsgTree::Union(kept),
        }
    }

    /// The tree of the complement, for the same surfaces.
    pub fn inverse(self) -> CsgTree {
        let each = |of: Vec<CsgTree>| of.into_iter().map(CsgTree::inverse).collect();
        match self {
            CsgTree::Leaf(i) => CsgTree::Outside(i),
            CsgTree::Outside(i) => CsgTree::Leaf(i),
            CsgTree::Intersection(of) => CsgTree::Union(each(of)),
            CsgTree::Union(of) => CsgTree::Intersection(each(of)),
        }
    }

    /// The tree of the complement, for surfaces whose functions have been negated.
    pub fn complement(self) -> CsgTree {
        let each = |of: Vec<CsgTree>| of.into_iter().map(CsgTree::complement).collect();
        match self {
            CsgTree::Leaf(_) | CsgTree::Outside(_) => self,
            CsgTree::Intersection(of) => CsgTree::Union(each(of)),
            CsgTree::Union(of) => CsgTree::Intersection(each(of)),
        }
    }

    /// The value of the solid as a function (maximum over intersections, minimum over unions) and the surface that
    /// attains it, given the value of each surface.
    pub fn value(&self, value: &impl Fn(usize) -> f64) -> (f64, Option<usize>) {
        let nothing = |v| (v, None);
        match self {
            CsgTree::Leaf(i) => (value(*i), Some(*i)),
            CsgTree::Outside(i) => (-value(*i), Some(*i)),
            CsgTree::Intersection(of) => {
                of.iter().map(|t| t.value(value)).fold(nothing(f64::NEG_INFINITY), |a, b| if b.0 > a.0 { b } else { a })
            }
            CsgTree::Union(of) => {
                of.iter().map(|t| t.value(value)).fold(nothing(f64::INFINITY), |a, b| if b.0 < a.0 { b } else { a })
            }
        }
    }

    /// An interval that contains `value`, given one for each surface.
    pub fn bound(&self, bound: &impl Fn(usize) -> Interval) -> Interval {
        match self {
            CsgTree::Leaf(i) => bound(*i),
            CsgTree::Outside(i) => -bound(*i),
            CsgTree::Intersection(of) => of
                .iter()
                .map(|t| t.bound(bound))
                .fold(Interval::new(f64::NEG_INFINITY, f64::NEG_INFINITY), Interval::max),
            CsgTree::Union(of) => {
                of.iter().map(|t| t.bound(bound)).fold(Interval::new(f64::INFINITY, f64::INFINITY), Interval::min)
            }
        }
    }

    /// The same tree with `first` added to each surface number.
    pub fn renumbered(self, first: usize) -> CsgTree {
        let each = |of: Vec<CsgTree>| of.into_iter().map(|t| t.renumbered(first)).collect();
        match self {
            CsgTree::Leaf(i) => CsgTree::Leaf(first + i),
            CsgTree::Outside(i) => CsgTree::Outside(first + i),
            CsgTree::Intersection(of) => CsgTree::Intersection(each(of)),
            CsgTree::Union(of) => CsgTree::Union(each(of)),
        }
    }

    /// Whether the lowest common ancestor of two surfaces, each named once, is an intersection.
    pub fn intersects(&self, pair: [usize; 2]) -> bool {
        let (of, all) = match self {
            CsgTree::Leaf(_) | CsgTree::Outside(_) => return false,
            CsgTree::Intersection(of) => (of, true),
            CsgTree::Union(of) => (of, false),
        };
        let names = |t: &CsgTree, surface: usize| {
            let mut found = false;
            t.for_each(&mut |f| found |= f == surface);
            found
        };
        let both = of.iter().find(|t| pair.iter().all(|f| names(t, *f)));
        both.map_or(all, |t| t.intersects(pair))
    }

    /// Calls `f` for every surface of the tree.
    pub fn for_each(&self, f: &mut impl FnMut(usize)) {
        match self {
            CsgTree::Leaf(i) | CsgTree::Outside(i) => f(*i),
            CsgTree::Intersection(of) | CsgTree::Union(of) => of.iter().for_each(|t| t.for_each(f)),
        }
    }

    /// Whether the tree is solid where a surface is positive.
    pub fn is_outside(&self, surface: usize) -> bool {
        match self {
            CsgTree::Leaf(_) => false,
            CsgTree::Outside(i) => *i == surface,
            CsgTree::Intersection(of) | CsgTree::Union(of) => of.iter().any(|t| t.is_outside(surface)),
        }
    }

    /// Calls `f` for the surfaces whose negative side contains the whole solid.
    pub fn for_each_bounding(&self, f: &mut impl FnMut(usize)) {
        match self {
            CsgTree::Leaf(i) => f(*i),
            CsgTree::Intersection(of) => of.iter().for_each(|t| t.for_each_bounding(f)),
            CsgTree::Union(_) | CsgTree::Outside(_) => {}
        }
    }
}

/// What is known about the sign of a surface's function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sign {
    /// Negative everywhere.
    Negative,
    /// Positive everywhere.
    Positive,
    /// Both occur; its new number.
    Varies(usize),
}

/// A CSG solid. As a field it is negative inside, positive outside and continuous, but not a distance.
#[derive(Clone)]
pub struct CsgSolid {
    /// The surfaces, numbered by their index.
    pub surfaces: Vec<Surface>,
    /// How they are combined.
    pub tree: CsgTree,
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 1024;

impl Field for CsgSolid {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut each = vec![vec![0.0; points.len().min(BATCH)]; self.surfaces.len()];
        for (points, out) in points.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            for (surface, values) in self.surfaces.iter().zip(&mut each) {
                surface.field.values(points, &mut values[..points.len()]);
            }
            for (i, o) in out.iter_mut().enumerate() {
                *o = self.tree.value(&|f| each[f][i]).0;
            }
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let n = points.len();
        let mut each = vec![(vec![0.0; n], vec![[0.0; 3]; n]); self.surfaces.len()];
        for (surface, (v, g)) in self.surfaces.iter().zip(&mut each) {
            surface.field.gradients(points, v, g);
        }
        for i in 0..n {
            let (value, surface) = self.tree.value(&|f| each[f].0[i]);
            values[i] = value;
            gradients[i] = surface.map_or([0.0; 3], |f| each[f].1[i]);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.tree.bound(&|f| self.surfaces[f].field.bound(b))
    }

    // Rounding is monotone, so combining rounded values gives the rounded value.
    fn fill(&self, block: &Block, out: &mut [f32]) {
        let mut each = vec![vec![0f32; out.len()]; self.surfaces.len()];
        for (surface, values) in self.surfaces.iter().zip(&mut each) {
            surface.field.fill(block, values);
        }
        for (i, o) in out.iter_mut().enumerate() {
            *o = self.tree.value(&|f| f64::from(each[f][i])).0 as f32;
        }
    }
}

impl CsgSolid {
    /// The same solid in other coordinates: position = `corner` + `edges` u (mm), the edges as columns.
    pub fn in_frame(mut self, corner: Vec3, edges: Mat3) -> CsgSolid {
        for surface in &mut self.surfaces {
            surface.field = Arc::new(InCellCoordinates { field: surface.field.clone(), corner, edges });
            (surface.pair, surface.plane) = (None, None);
            surface.lipschitz *= spectral_norm(&edges);
        }
        self
    }
}

/// A field in other coordinates.
struct InCellCoordinates {
    field: Arc<dyn Field>,
    corner: Vec3,
    edges: Mat3,
}

impl InCellCoordinates {
    fn place(&self, u: Vec3) -> Vec3 {
        add(self.corner, apply(&self.edges, u))
    }
}

impl Field for InCellCoordinates {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let points: Vec<Vec3> = points.iter().map(|u| self.place(*u)).collect();
        self.field.values(&points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let points: Vec<Vec3> = points.iter().map(|u| self.place(*u)).collect();
        self.field.gradients(&points, values, gradients);
        let back = transpose(&self.edges);
        gradients.iter_mut().for_each(|g| *g = apply(&back, *g));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let corner = |i: usize| self.place([0, 1, 2].map(|a| if i >> a & 1 == 1 { b.max[a] } else { b.min[a] }));
        self.field.bound(&(0..8).fold(Aabb::EMPTY, |all, i| all.with(corner(i))))
    }
}
