//! How smooth functions make a solid.
//!
//! A solid with edges is no smooth function of position, but it is a combination of some: a box is where all of six
//! planes say inside, a union where any of its parts does. Extraction asks for these *faces* one by one, so that an
//! edge is the place where two of them meet and not a bend that a grid cannot see.

use std::sync::Arc;

use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3};

/// A smooth function, negative towards the solid.
#[derive(Clone)]
pub struct Face {
    /// The function.
    pub field: Arc<dyn Field>,
    /// A bound of its steepness, per mm.
    pub slope: f64,
    /// Set if its zero set is a plane normal to a coordinate axis.
    pub plane: Option<Plane>,
    /// Whether it belongs to the region rather than to the lattice.
    pub cut: bool,
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
            let open = others.fold(here, |w, (_, o)| {
                w & if join { o.solid(some) } else { !o.solid(all) }
            });
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
        let (deciding, idle) = if all {
            (Tree::EMPTY, Tree::FULL)
        } else {
            (Tree::FULL, Tree::EMPTY)
        };
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
        Face {
            field,
            slope: 1.0,
            plane: None,
            cut: true,
        }
    }

    /// The same face with the solid on its other side.
    pub fn turned(self) -> Face {
        Face {
            field: Arc::new(Turned(self.field)),
            plane: self.plane.map(|p| Plane {
                below: !p.below,
                ..p
            }),
            ..self
        }
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
