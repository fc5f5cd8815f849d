//! A solid: a region, and what is solid in it.

use std::sync::Arc;

use crate::coincident;
use crate::csg_tree::{CsgSolid, CsgTree};
use crate::field::{Block, Field};
use crate::implicit::{Implicit, Surface};
use crate::region::Region;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3};

/// What a design means: the part of the region in which the field is negative, or that is filled anyway.
#[derive(Clone)]
pub struct Solid {
    /// Where the part may be.
    pub region: Region,
    /// The lattice; `None` leaves the region full.
    pub field: Option<Arc<dyn Implicit>>,
    /// What is solid whatever the lattice says, within the region: skin and keep zones.
    pub filled: Vec<CsgSolid>,
    /// The smallest wavelength (mm); grid spacings are given by it.
    pub wavelength: f64,
    /// The width of the narrowest transition between lattices (mm), if there is one: no grid may be coarser.
    pub transition: Option<f64>,
}

/// One of the solids into which a sheet divides its region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// What the design makes: the sheet, with skin and keep zones.
    Wall,
    /// What is left of the region on the lower side of the mid-surface, where the cell's function is below its level there.
    Lower,
    /// What is left on the upper side.
    Upper,
}

impl Space {
    /// All, in the order of `Spaces::trees`.
    pub const ALL: [Space; 3] = [Space::Wall, Space::Lower, Space::Upper];

    /// The word for it: `wall`, `lower`, `upper`.
    pub fn name(self) -> &'static str {
        ["wall", "lower", "upper"][self as usize]
    }
}

/// The solids into which a sheet divides its region, over the same surfaces: no two overlap, and together they are the region.
pub struct Spaces {
    /// The surfaces. The region's come first.
    pub surfaces: Vec<Surface>,
    /// Wall, lower and upper space.
    pub trees: [CsgTree; 3],
    /// The surfaces of the wall towards the upper and the lower space.
    pub faces: [usize; 2],
}

impl Solid {
    /// A region and the lattice in it.
    pub fn new(region: Region, field: Option<Arc<dyn Implicit>>, wavelength: f64) -> Solid {
        Solid { region, field, filled: Vec::new(), wavelength, transition: None }
    }

    /// The same solid with one more body that is solid whatever the lattice says.
    pub fn with(mut self, mut body: CsgSolid) -> Solid {
        let mut others = self.boundary().surfaces;
        others.extend(self.filled.iter().flat_map(|b| b.surfaces.iter().cloned()));
        let mut moved = others.len();
        coincident::separate_from(&mut body, &others, &self.region.bounds(), &mut moved);
        self.filled.push(body);
        self
    }

    /// The region as a CSG solid, none of whose surfaces coincide.
    fn boundary(&self) -> CsgSolid {
        let mut surfaces = Vec::new();
        let tree = self.region.clone().surfaces(0.0, &mut surfaces);
        let mut body = CsgSolid { surfaces, tree };
        coincident::separate(&mut body, &self.region.bounds(), &mut 0);
        body
    }

    /// The wall and the two spaces adjacent to it, which fill the region together; and the surfaces that the mid-surface runs
    /// between, upper and lower.
    ///
    /// # Errors
    /// A field that is not a sheet, at `parts`.
    pub fn spaces(&self) -> Result<Spaces, Fault> {
        let Some(faces) = self.field.as_ref().and_then(|f| f.faces()) else {
            let message = "this design has no lower and upper side: only sheets have, whether of one lattice or of a blend of \
                           sheets. Give the lattices part = \"sheet\" (and core = \"solid\" where it is \"void\", which cuts both faces), or leave \
                           the parts out";
            return Err(Fault::new("parts", message));
        };
        let pair = self.field.as_ref().and_then(|f| f.pair());
        let CsgSolid { mut surfaces, tree: region } = self.boundary();
        let mut filled = self.filled_trees(&mut surfaces);
        let [upper, lower] = [surfaces.len(), surfaces.len() + 1];
        surfaces.extend(faces.map(|f| Surface { pair: pair.clone(), ..Surface::smooth(f) }));
        let sheet = CsgTree::Intersection(vec![CsgTree::Leaf(upper), CsgTree::Leaf(lower)]);
        let free = CsgTree::Union(filled.clone()).inverse();
        filled.push(sheet);
        let within = |of: Vec<CsgTree>| CsgTree::Intersection([vec![region.clone()], of].concat());
        let wall = within(vec![CsgTree::Union(filled)]);
        let beside = |face| within(vec![free.clone(), CsgTree::Outside(face)]);
        Ok(Spaces { trees: [wall, beside(lower), beside(upper)], surfaces, faces: [upper, lower] })
    }

    /// The trees of what is filled, whose surfaces are added to `surfaces`.
    fn filled_trees(&self, surfaces: &mut Vec<Surface>) -> Vec<CsgTree> {
        let tree = |body: &CsgSolid| {
            let tree = body.tree.clone().renumbered(surfaces.len());
            surfaces.extend(body.surfaces.iter().cloned().map(|f| Surface { cut: false, ..f }));
            tree
        };
        self.filled.iter().map(tree).collect()
    }

    /// The solid as a combination of smooth implicit surfaces. The region's come first.
    pub fn surfaces(&self) -> (Vec<Surface>, CsgTree) {
        let CsgSolid { mut surfaces, tree } = self.boundary();
        let mut all = vec![tree];
        if let Some(field) = &self.field {
            let mut any = self.filled_trees(&mut surfaces);
            let mut parts = field.parts();
            if parts.is_empty() {
                parts.push(field.clone());
            }
            let (pair, mut lattice) = (field.pair(), Vec::new());
            for part in parts {
                lattice.push(CsgTree::Leaf(surfaces.len()));
                surfaces.push(Surface { pair: pair.clone(), ..Surface::smooth(part) });
            }
            if any.is_empty() {
                all.extend(lattice);
            } else {
                any.push(CsgTree::Intersection(lattice));
                all.push(CsgTree::Union(any));
            }
        }
        (surfaces, CsgTree::Intersection(all))
    }

    /// All that may be solid in the region: the lattice first.
    fn inner(&self) -> Option<(&dyn Field, impl Iterator<Item = &dyn Field>)> {
        let filled = self.filled.iter().map(|b| b as &dyn Field);
        self.field.as_deref().map(|f| (f as &dyn Field, filled))
    }
}

/// As a field, the greater of the region's signed distance and the least of the lattice, the skin and the keep zones:
/// negative in the finished part, positive outside, continuous, and not a distance. Extraction keeps them apart.
impl Field for Solid {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.region.values(points, out);
        let Some((lattice, filled)) = self.inner() else {
            return;
        };
        let (mut least, mut v) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        lattice.values(points, &mut least);
        for body in filled {
            body.values(points, &mut v);
            least.iter_mut().zip(&v).for_each(|(l, v)| *l = l.min(*v));
        }
        out.iter_mut().zip(least).for_each(|(o, l)| *o = o.max(l));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.region.gradients(points, values, gradients);
        let Some((lattice, filled)) = self.inner() else {
            return;
        };
        let zeros = || (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        let ((mut least, mut slope), (mut v, mut g)) = (zeros(), zeros());
        lattice.gradients(points, &mut least, &mut slope);
        for body in filled {
            body.gradients(points, &mut v, &mut g);
            for i in 0..points.len() {
                if v[i] < least[i] {
                    (least[i], slope[i]) = (v[i], g[i]);
                }
            }
        }
        for i in 0..points.len() {
            if least[i] > values[i] {
                (values[i], gradients[i]) = (least[i], slope[i]);
            }
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let region = self.region.bound(b);
        let Some((lattice, filled)) = self.inner() else {
            return region;
        };
        region.max(filled.fold(lattice.bound(b), |least, f| least.min(f.bound(b))))
    }

    fn is_large(&self) -> bool {
        self.field.as_ref().is_some_and(|f| f.is_large())
    }

    // Rounding keeps order, so joining rounded values gives the rounded value.
    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.region.fill(block, out);
        let Some((lattice, filled)) = self.inner() else {
            return;
        };
        let (mut least, mut v) = (vec![0f32; out.len()], vec![0f32; out.len()]);
        lattice.fill(block, &mut least);
        for body in filled {
            body.fill(block, &mut v);
            least.iter_mut().zip(&v).for_each(|(l, v)| *l = l.min(*v));
        }
        out.iter_mut().zip(least).for_each(|(o, l)| *o = o.max(l));
    }
}
