//! Implicit surfaces: smooth functions that are negative towards the solid.
//!
//! A solid with edges is not the zero set of one smooth function, but a CSG combination of several (`csg_tree.rs`). The
//! extractor evaluates these functions one by one, so that an edge is where two of them intersect rather than a bend that
//! a grid cannot resolve.

use std::sync::Arc;

use crate::field::{Block, Field};
use geometry::feature_edges::Creases;
use geometry::math::{Aabb, Interval, Vec3};
use geometry::mesh::Mesh;

/// A field that states what meshing it by its zero set requires.
pub trait Implicit: Field {
    /// A Lipschitz bound: an upper bound of the length of the gradient, per mm.
    fn lipschitz(&self) -> f64;

    /// Whether the zero set may have creases, as unions and distances have. A crease is not curvature.
    fn has_creases(&self) -> bool {
        false
    }

    /// The creases of the zero set, in pieces about as long as `step` (mm), where they are known.
    fn creases(&self, _step: f64) -> Creases {
        Creases::default()
    }

    /// The smooth fields whose maximum this is (their intersection); empty if it is smooth itself.
    fn parts(&self) -> Vec<Arc<dyn Implicit>> {
        Vec::new()
    }

    /// The two parts, where they are evaluated faster together.
    fn pair(&self) -> Option<Arc<dyn SurfacePair>> {
        None
    }

    /// Of a sheet, the functions of its two faces: negative in the wall, the first positive on the upper side of the
    /// mid-surface, the second on the lower one. `None` if there is no mid-surface.
    fn faces(&self) -> Option<[Arc<dyn Implicit>; 2]> {
        None
    }
}

/// The two parts of a field that have all but their last steps in common.
pub trait SurfacePair: Send + Sync {
    /// Fills each of `out` (x fastest) as `fill_where` of that part does.
    fn fill_both(&self, block: &Block, wanted: &[u64], out: [&mut [f32]; 2]);
}

/// An implicit surface: the zero set of a smooth function that is negative towards the solid.
#[derive(Clone)]
pub struct Surface {
    /// The function.
    pub field: Arc<dyn Field>,
    /// Set if it is one of a pair, both of which have it.
    pub pair: Option<Arc<dyn SurfacePair>>,
    /// A Lipschitz bound of the function, per mm.
    pub lipschitz: f64,
    /// Set if the zero set is a plane normal to a coordinate axis.
    pub plane: Option<AxisPlane>,
    /// Whether it belongs to the region: triangles on it are cuts, all others are surface of the lattice.
    pub cut: bool,
    /// Whether its zero set may have creases, as those of distances have. A crease is not curvature.
    pub has_creases: bool,
    /// Its creases, where they are known.
    pub creases: Arc<Creases>,
    /// The mesh, if it is one.
    pub mesh: Option<Arc<dyn AsRef<Mesh> + Send + Sync>>,
    /// Whether it was offset because it coincided with another surface of the solid (`coincident.rs`).
    pub perturbed: bool,
}

/// A plane normal to a coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPlane {
    /// The axis: 0, 1, 2.
    pub axis: usize,
    /// Its coordinate, mm.
    pub at: f64,
    /// Whether the solid lies below.
    pub below: bool,
}

impl AxisPlane {
    /// Whether a move from `p` to `to` leaves the solid half-space.
    pub fn is_left(&self, p: Vec3, to: Vec3) -> bool {
        let sign = if self.below { 1.0 } else { -1.0 };
        let beyond = |x: Vec3| sign * (x[self.axis] - self.at) > 0.0;
        !beyond(p) && beyond(to)
    }
}

impl Surface {
    /// The plane that bounds the region here, if it is one.
    pub fn bounding_plane(&self) -> Option<AxisPlane> {
        self.plane.filter(|_| self.cut)
    }

    /// A smooth implicit surface of a lattice.
    pub fn smooth(field: Arc<dyn Implicit>) -> Surface {
        Surface {
            lipschitz: field.lipschitz(),
            has_creases: field.has_creases(),
            field,
            pair: None,
            plane: None,
            cut: false,
            creases: Arc::default(),
            mesh: None,
            perturbed: false,
        }
    }

    /// A curved or slanted surface of a region, by its signed distance.
    pub fn distance(field: Arc<dyn Field>) -> Surface {
        Surface {
            field,
            pair: None,
            lipschitz: 1.0,
            plane: None,
            cut: true,
            has_creases: true,
            creases: Arc::default(),
            mesh: None,
            perturbed: false,
        }
    }

    /// The same surface with the solid on its other side.
    pub fn complement(self) -> Surface {
        let plane = self.plane.map(|p| AxisPlane { below: !p.below, ..p });
        Surface { field: Arc::new(Negated(self.field)), pair: None, plane, ..self }
    }

    /// The surface where the function is `by`: the solid grows by that distance (mm) if the function is a distance.
    pub fn offset(self, by: f64) -> Surface {
        let plane = self.plane.map(|p| AxisPlane { at: p.at + if p.below { by } else { -by }, ..p });
        Surface { field: Arc::new(Shifted(self.field, by)), pair: None, plane, mesh: None, ..self }
    }
}

/// The negative of a field.
pub(crate) struct Negated<F: ?Sized>(pub Arc<F>);

impl<F: Implicit + ?Sized> Implicit for Negated<F> {
    fn lipschitz(&self) -> f64 {
        self.0.lipschitz()
    }

    fn has_creases(&self) -> bool {
        self.0.has_creases()
    }
}

impl<F: Field + ?Sized> Field for Negated<F> {
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

    fn fill_near(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.0.fill_near(block, wanted, out);
        out.iter_mut().for_each(|v| *v = -*v);
    }
}

/// A field minus a constant.
struct Shifted(Arc<dyn Field>, f64);

impl Field for Shifted {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
        out.iter_mut().for_each(|v| *v -= self.1);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v -= self.1);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.0.bound(b) - Interval::new(self.1, self.1)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.0.fill(block, out);
        out.iter_mut().for_each(|v| *v -= self.1 as f32);
    }
}
