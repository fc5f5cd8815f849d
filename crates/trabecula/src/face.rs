//! How smooth functions make a solid.
//!
//! A solid with edges is no smooth function of position, but it is a combination of some: a box is where all of six
//! planes say inside, a union where any of its parts does. Extraction asks for these *faces* one by one, so that an
//! edge is the place where two of them meet and not a bend that a grid cannot see.

use std::sync::Arc;

use crate::field::{Block, Field};
use geometry::math::{Aabb, Interval, Vec3};

/// A smooth function, negative towards the solid.
#[derive(Clone)]
pub struct Face {
    /// The function.
    pub field: Arc<dyn Field>,
    /// A bound of its steepness, per mm.
    pub slope: f64,
    /// Set if its zero set is a plane normal to a coordinate axis.
    pub plane: Option<Plane>,
    /// Whether it is the region's: what lies on it is a cut, all else counts as the lattice's own surface.
    pub cut: bool,
    /// Whether its zero set may have edges, as those of distances have; they are no curvature.
    pub edged: bool,
    /// Where it has edges, as far as that is known.
    pub creases: Arc<Creases>,
    /// Whether it runs along another face of the solid, from which it is kept apart by a hair.
    pub flush: bool,
}

/// A straight piece of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its ends, mm.
    pub ends: [Vec3; 2],
    /// How much the normal turns across it, radians.
    pub turn: f64,
    /// How long the straight line is that it and its neighbours make, mm.
    pub run: f64,
}

/// The edges of a face's zero set.
#[derive(Debug, Default)]
pub struct Creases {
    /// Straight pieces of them.
    pub segments: Vec<Segment>,
    /// Where they end, meet or bend, mm; and how many are there.
    pub corners: Vec<(Vec3, usize)>,
}

/// A plane normal to a coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The axis: 0, 1, 2.
    pub axis: usize,
    /// Its coordinate, mm.
    pub at: f64,
    /// Whether the solid lies below.
    pub below: bool,
}

/// Which signs of the faces are solid. Never falls when a face becomes negative: there is no negation, so a solid's
/// surface passes from the negative to the positive side of each face.
#[derive(Clone, Debug, PartialEq)]
pub enum Tree {
    /// Where the face of this number is negative.
    Face(usize),
    /// Where all are solid; everywhere, if there are none.
    All(Vec<Tree>),
    /// Where any is solid; nowhere, if there are none.
    Any(Vec<Tree>),
}

impl Tree {
    /// Solid everywhere.
    pub const FULL: Tree = Tree::All(Vec::new());
    /// Solid nowhere.
    pub const EMPTY: Tree = Tree::Any(Vec::new());

    /// Evaluates 64 places at once: `negative` gives, for a face, a bit for each place.
    #[inline]
    pub fn solid(&self, negative: &impl Fn(usize) -> u64) -> u64 {
        match self {
            Tree::Face(i) => negative(*i),
            Tree::All(of) => of.iter().fold(u64::MAX, |w, t| w & t.solid(negative)),
            Tree::Any(of) => of.iter().fold(0, |w, t| w | t.solid(negative)),
        }
    }

    /// Calls `found` for each face with the places, of those in `here`, where its sign can matter: `some` and `all` give
    /// for a face the places where it may be and surely is negative. Exact if no face is named twice.
    pub fn deciding(
        &self,
        here: u64,
        some: &impl Fn(usize) -> u64,
        all: &impl Fn(usize) -> u64,
        found: &mut impl FnMut(usize, u64),
    ) {
        let (of, join) = match self {
            Tree::Face(i) => return found(*i, here & some(*i) & !all(*i)),
            Tree::All(of) => (of, true),
            Tree::Any(of) => (of, false),
        };
        for (n, t) in of.iter().enumerate() {
            // The others must be able to leave it to this one: all solid, or none.
            let others = of.iter().enumerate().filter(|(m, _)| *m != n);
            let open = others.fold(here, |w, (_, o)| w & if join { o.solid(some) } else { !o.solid(all) });
            if open != 0 {
                t.deciding(open, some, all, found);
            }
        }
    }

    /// The same tree where some faces are known to be negative or positive, and the others have new numbers.
    pub fn given(&self, face: &impl Fn(usize) -> Sign) -> Tree {
        let (of, all) = match self {
            Tree::Face(i) => match face(*i) {
                Sign::Negative => return Tree::FULL,
                Sign::Positive => return Tree::EMPTY,
                Sign::Varies(n) => return Tree::Face(n),
            },
            Tree::All(of) => (of, true),
            Tree::Any(of) => (of, false),
        };
        let (deciding, idle) = if all { (Tree::EMPTY, Tree::FULL) } else { (Tree::FULL, Tree::EMPTY) };
        let mut kept = Vec::new();
        for t in of.iter().map(|t| t.given(face)) {
            if t == deciding {
                return deciding;
            }
            if t != idle {
                kept.push(t);
            }
        }
        match kept.len() {
            1 => kept.remove(0),
            _ if all => Tree::All(kept),
            _ => Tree::Any(kept),
        }
    }

    /// What is solid where this is not, once the faces change sign.
    pub fn complement(self) -> Tree {
        let each = |of: Vec<Tree>| of.into_iter().map(Tree::complement).collect();
        match self {
            Tree::Face(i) => Tree::Face(i),
            Tree::All(of) => Tree::Any(each(of)),
            Tree::Any(of) => Tree::All(each(of)),
        }
    }

    /// The value of the solid as a function, and the face that has it, the faces' values being `value`: the greatest
    /// where all must be solid, the least where any may.
    pub fn value(&self, value: &impl Fn(usize) -> f64) -> (f64, Option<usize>) {
        let nothing = |v| (v, None);
        match self {
            Tree::Face(i) => (value(*i), Some(*i)),
            Tree::All(of) => {
                of.iter().map(|t| t.value(value)).fold(nothing(f64::NEG_INFINITY), |a, b| if b.0 > a.0 { b } else { a })
            }
            Tree::Any(of) => {
                of.iter().map(|t| t.value(value)).fold(nothing(f64::INFINITY), |a, b| if b.0 < a.0 { b } else { a })
            }
        }
    }

    /// An interval that holds `value`, given one for each face.
    pub fn bound(&self, bound: &impl Fn(usize) -> Interval) -> Interval {
        match self {
            Tree::Face(i) => bound(*i),
            Tree::All(of) => of
                .iter()
                .map(|t| t.bound(bound))
                .fold(Interval::new(f64::NEG_INFINITY, f64::NEG_INFINITY), Interval::max),
            Tree::Any(of) => {
                of.iter().map(|t| t.bound(bound)).fold(Interval::new(f64::INFINITY, f64::INFINITY), Interval::min)
            }
        }
    }

    /// The same tree of faces that are numbered from `first` on.
    pub fn from(self, first: usize) -> Tree {
        let each = |of: Vec<Tree>| of.into_iter().map(|t| t.from(first)).collect();
        match self {
            Tree::Face(i) => Tree::Face(first + i),
            Tree::All(of) => Tree::All(each(of)),
            Tree::Any(of) => Tree::Any(each(of)),
        }
    }

    /// Whether two faces that are named once are joined where all must be solid, rather than any.
    pub fn both_must(&self, pair: [usize; 2]) -> bool {
        let (of, all) = match self {
            Tree::Face(_) => return false,
            Tree::All(of) => (of, true),
            Tree::Any(of) => (of, false),
        };
        let names = |t: &Tree, face: usize| {
            let mut found = false;
            t.each(&mut |f| found |= f == face);
            found
        };
        let both = of.iter().find(|t| pair.iter().all(|f| names(t, *f)));
        both.map_or(all, |t| t.both_must(pair))
    }

    /// Calls `f` for every face named.
    pub fn each(&self, f: &mut impl FnMut(usize)) {
        match self {
            Tree::Face(i) => f(*i),
            Tree::All(of) | Tree::Any(of) => of.iter().for_each(|t| t.each(f)),
        }
    }

    /// Calls `f` for the faces that everything solid lies behind.
    pub fn each_required(&self, f: &mut impl FnMut(usize)) {
        match self {
            Tree::Face(i) => f(*i),
            Tree::All(of) => of.iter().for_each(|t| t.each_required(f)),
            Tree::Any(_) => {}
        }
    }
}

/// What is known of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sign {
    /// Negative everywhere.
    Negative,
    /// Positive everywhere.
    Positive,
    /// Not known; its new number.
    Varies(usize),
}

impl Face {
    /// A curved or slanted face of a region, by its signed distance.
    pub fn distance(field: Arc<dyn Field>) -> Face {
        Face { field, slope: 1.0, plane: None, cut: true, edged: true, creases: Arc::default(), flush: false }
    }

    /// The same face with the solid on its other side.
    pub fn turned(self) -> Face {
        Face { field: Arc::new(Turned(self.field)), plane: self.plane.map(|p| Plane { below: !p.below, ..p }), ..self }
    }
}

/// Minus a field.
struct Turned(Arc<dyn Field>);

impl Field for Turned {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
        out.iter_mut().for_each(|v| *v = -*v);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v = -*v);
        gradients.iter_mut().flatten().for_each(|x| *x = -*x);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        -self.0.bound(b)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.0.fill(block, out);
        out.iter_mut().for_each(|v| *v = -*v);
    }

    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.0.fill_where(block, wanted, out);
        out.iter_mut().for_each(|v| *v = -*v);
    }
}

/// A solid by its faces. As a field it is negative inside, positive outside, continuous and not a distance.
#[derive(Clone)]
pub struct Body {
    /// The faces.
    pub faces: Vec<Face>,
    /// How they make it.
    pub tree: Tree,
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 1024;

impl Field for Body {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut each = vec![vec![0.0; points.len().min(BATCH)]; self.faces.len()];
        for (points, out) in points.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            for (face, values) in self.faces.iter().zip(&mut each) {
                face.field.values(points, &mut values[..points.len()]);
            }
            for (i, o) in out.iter_mut().enumerate() {
                *o = self.tree.value(&|f| each[f][i]).0;
            }
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let n = points.len();
        let mut each = vec![(vec![0.0; n], vec![[0.0; 3]; n]); self.faces.len()];
        for (face, (v, g)) in self.faces.iter().zip(&mut each) {
            face.field.gradients(points, v, g);
        }
        for i in 0..n {
            let (value, face) = self.tree.value(&|f| each[f].0[i]);
            values[i] = value;
            gradients[i] = face.map_or([0.0; 3], |f| each[f].1[i]);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.tree.bound(&|f| self.faces[f].field.bound(b))
    }

    // Rounding keeps order, so joining rounded values gives the rounded value.
    fn fill(&self, block: &Block, out: &mut [f32]) {
        let mut each = vec![vec![0f32; out.len()]; self.faces.len()];
        for (face, values) in self.faces.iter().zip(&mut each) {
            face.field.fill(block, values);
        }
        for (i, o) in out.iter_mut().enumerate() {
            *o = self.tree.value(&|f| f64::from(each[f][i])).0 as f32;
        }
    }
}
