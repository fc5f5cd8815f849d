//! Regions: where the part may be. Signed distance in mm, negative inside.

use std::sync::Arc;

use crate::csg_tree::CsgTree;
use crate::field::{Block, Field, fill_points};
use crate::implicit::Surface;
use crate::kind::{Kind, Warning};
use geometry::fault::Fault;
use geometry::math::Aabb;
use geometry::repair::Repaired;
use geometry::similarity::Similarity;

mod alike_bodies;
mod bodies;
mod cad;
mod capsule;
mod csg;
mod cuboid;
mod cylinder;
mod distance_table;
mod faces;
mod file;
mod halfspace;
mod halving;
mod hollowed;
mod joints;
mod mesh;
mod meshes;
mod moved;
mod narrowed;
mod offset;
mod primitive;
mod repeated;
mod sphere;
mod tetrahedron;
mod tube;

pub use cad::{CAD, CadMesh, FaceLabel, Tessellation};
pub use csg::{Difference, Intersection, Union};
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use distance_table::DistanceTable;
pub use faces::{FaceSet, FacesKind};
pub use file::MeshFile;
pub use halfspace::{HalfSpace, HalfSpaceKind};
pub use hollowed::Hollowed;
pub use joints::joint;
pub use mesh::MeshRegion;
pub use offset::Offset;
pub use sphere::Sphere;
pub use tetrahedron::Tetrahedron;
pub use tube::{OutsideTube, Tube, smoothed};

/// Where the part may be. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Region", noun = "region", family = BuildRegion)]
#[allow(missing_docs)] // The comment of each type says what it is.
pub enum RegionKind {
    Box(cuboid::BoxKind),
    Cylinder(cylinder::CylinderKind),
    Sphere(Sphere),
    Capsule(capsule::Capsule),
    Tetrahedron(tetrahedron::TetrahedronKind),
    HalfSpace(HalfSpaceKind),
    Mesh(MeshFile),
    Faces(FacesKind),
    Union(csg::UnionKind),
    Intersection(csg::IntersectionKind),
    Difference(csg::DifferenceKind),
    Offset(offset::OffsetKind),
    Moved(moved::MovedKind),
    Repeated(repeated::RepeatedKind),
}

/// How far from the origin a region may reach, mm: a thousand kilometres.
pub(crate) const FARTHEST: f64 = 1e9;

/// A kind of region, as it is declared.
pub(crate) trait BuildRegion {
    /// The region. Errors name the key; ranges are checked here.
    fn build(&self, context: &mut Context) -> Result<Region, Fault>;
}

impl RegionKind {
    /// The region. Errors name the key below this kind's path.
    pub(crate) fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        context.below(self.key(), |context| self.family().build(context))
    }
}

/// Warnings and notes that come with a region.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    /// Possible mistakes.
    pub warnings: Vec<Warning>,
    /// What was repaired in each mesh, by the path of its table.
    pub repairs: Vec<(String, Repaired)>,
}

/// Where regions get files from.
pub(crate) trait Files {
    /// The bytes of a file, or a sentence that says why there are none.
    fn load(&self, path: &str) -> Result<Vec<u8>, String>;

    /// The triangles of a file of a CAD system, or a sentence that says why there are none.
    fn cad(&self, path: &str, how: &Tessellation) -> Result<CadMesh, String>;
}

/// Where a region is built: its path in the design, where files come from, and the part whose faces may be named.
pub(crate) struct Context<'a> {
    path: String,
    files: &'a dyn Files,
    part: Option<&'a Region>,
    notes: &'a mut Notes,
}

impl<'a> Context<'a> {
    pub fn new(path: &str, files: &'a dyn Files, part: Option<&'a Region>, notes: &'a mut Notes) -> Self {
        Context { path: path.into(), files, part, notes }
    }

    /// The region of the design, where it is known already.
    fn part(&self) -> Option<&'a Region> {
        self.part
    }

    /// Builds the value of `key`, or of an index such as "[0]"; a fault has the key before its path.
    fn below<T>(&mut self, key: &str, build: impl FnOnce(&mut Self) -> Result<T, Fault>) -> Result<T, Fault> {
        let outer = self.path.len();
        self.path.push_str(if key.starts_with('[') { "" } else { "." });
        self.path.push_str(key);
        let built = build(self);
        self.path.truncate(outer);
        built.map_err(|f| f.under(key))
    }

    /// Whether the kind that is being built is the whole region of the design.
    fn is_part(&self) -> bool {
        self.path.strip_prefix("region.").is_some_and(|kind| !kind.contains(['.', '[']))
    }

    /// The bytes of a file, or a sentence that says why there are none.
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        self.files.load(path)
    }

    /// Warns of the kind that is being built.
    fn warn(&mut self, message: String) {
        self.notes.warnings.push(Warning { path: self.path.clone(), message });
    }

    /// Keeps what was repaired in a mesh.
    fn repaired(&mut self, done: Repaired) {
        self.notes.repairs.push((self.path.clone(), done));
    }
}

/// A part of a region's surface that is left open.
#[derive(Clone, Debug)]
pub enum OpenSurface {
    /// Flat faces on the plane of a half-space that face as its normal does.
    Plane(HalfSpace),
    /// Faces of a CAD system.
    Faces(FaceSet),
}

impl From<HalfSpace> for OpenSurface {
    fn from(plane: HalfSpace) -> OpenSurface {
        OpenSurface::Plane(plane)
    }
}

/// A signed distance function (1-Lipschitz; exact for primitives and meshes, a lower bound of the
/// absolute distance for combinations), with what a mesher and a report need in addition.
pub trait SignedDistance: Field {
    /// Bounds of the solid; infinite along unbounded directions.
    fn bounds(&self) -> Aabb;

    /// Adds to `out` the coordinates of faces of the shape that are planes normal to `axis` (0, 1, 2).
    ///
    /// On such a plane, within the face, the signed distance computes to exactly 0.0 for a point whose
    /// coordinate equals the number given here, so that a grid plane laid on it reproduces the face exactly.
    fn planes(&self, axis: usize, out: &mut Vec<f64>) {
        self.level_planes(axis, 0.0, out);
    }

    /// Adds the coordinates of planes normal to `axis` on which the distance is `level` (mm) over a part of the
    /// plane: what `planes` is to the surface, for the surface moved outwards by `level`. At level zero the
    /// distance there is exactly 0.0; at other levels it is `level` to within rounding of the coordinate.
    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>);

    /// Fills `out` (x fastest) with the distance less `level` (mm) at the block's nodes.
    ///
    /// Signs are right at every node. Values are right within one grid cell of the level; farther away a
    /// shape may give a smaller magnitude, but never one below a cell's diagonal.
    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_points(self, block, level, None, out);
    }

    /// Adds to `out` the implicit surfaces of the shape offset outwards by `by` (mm; inwards if negative) and returns how
    /// they are combined. Surfaces are numbered by their index in `out`.
    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree;

    /// The image of the shape under a similarity transform. Errors if rounding leaves nothing of it.
    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault>;

    /// Whether distances are searched for, rather than computed in closed form, so that a table of them pays.
    fn is_searched(&self) -> bool {
        false
    }

    /// The mesh that the shape is, if it is one: meshes that are combined make one.
    fn as_mesh(&self) -> Option<&MeshRegion> {
        None
    }

    /// Adds the files of CAD systems that the shape is made of.
    fn cad(&self, out: &mut Vec<Arc<CadMesh>>) {
        let _ = out;
    }

    /// The same region without the parts of its surface that lie on `cuts` and face as they do, where it can
    /// leave them out only as a whole: distances are then to the rest. Sets `found` for the cuts at which it did;
    /// `None` if at none. (Faces that are planes by themselves stay: a caller of `surfaces` can drop them.)
    fn opened(self: Arc<Self>, cuts: &[OpenSurface], found: &mut [bool]) -> Option<Region> {
        let _ = (cuts, found);
        None
    }

    /// The half-spaces of which the shape is the intersection, if it is one.
    fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
        None
    }

    /// Exact volume (mm³) where it is known in closed form.
    fn volume(&self) -> Option<f64>;
}

/// A solid bounded by one implicit surface, its own signed distance.
fn one_surface(field: Arc<dyn Field>, out: &mut Vec<Surface>) -> CsgTree {
    out.push(Surface::distance(field));
    CsgTree::Leaf(out.len() - 1)
}

/// A shared region.
pub type Region = Arc<dyn SignedDistance>;

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use geometry::math::{Vec3, add, norm, scale, sub};
    use geometry::random::random;

    fn point(seed: &mut u64, reach: f64) -> Vec3 {
        [0; 3].map(|_| random(seed) * reach)
    }

    /// The laws of a shape near the origin: 1-Lipschitz, gradient against differences, bounds that hold, solid
    /// within its bounds, volume by sampling, and a fill with the right signs. `exact`: |gradient| there is 1.
    pub fn check_shape(name: &str, s: &dyn SignedDistance, reach: f64, exact: f64) {
        let mut seed = 42;
        let mut smooth = 0;
        for _ in 0..4000 {
            let (p, q) = (point(&mut seed, reach), point(&mut seed, reach));
            let (vp, vq) = (s.value(p), s.value(q));
            assert!((vp - vq).abs() <= norm(sub(p, q)) * (1.0 + 1e-12) + 1e-12, "{name}: Lipschitz");
            assert!(vp > 0.0 || s.bounds().distance(p) == 0.0, "{name}: solid outside its bounds at {p:?}");
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            s.gradients(&[p], &mut v, &mut g);
            assert_eq!(v[0], vp);
            assert!((norm(g[0]) - 1.0).abs() < 1e-9 || exact == 0.0, "{name}: |gradient| {g:?} at {p:?}");
            // Central differences agree away from creases, which are rare.
            let h = 1e-5;
            let diff = [0, 1, 2].map(|a| {
                let mut e = [0.0; 3];
                e[a] = h;
                (s.value(add(p, e)) - s.value(sub(p, e))) / (2.0 * h)
            });
            smooth += usize::from(norm(sub(diff, g[0])) < 1e-3);

            let half = scale([random(&mut seed), random(&mut seed), random(&mut seed)].map(f64::abs), 0.4);
            let b = Aabb { min: sub(p, half), max: add(p, half) };
            let range = s.bound(&b);
            for _ in 0..8 {
                let w = add(p, [0, 1, 2].map(|a| random(&mut seed) * half[a]));
                let v = s.value(w);
                assert!(range.lo <= v && v <= range.hi, "{name}: {v} outside {range:?}");
            }
            assert!(range.hi - range.lo <= 2.0 * norm(b.size()) * (1.0 + 1e-9), "{name}: loose bound");
        }
        assert!(smooth > 3900, "{name}: the gradient agrees with differences at {smooth} of 4000 points");

        for level in [0.0, 0.17, -0.23] {
            let axis: Vec<f64> = (0..23).map(|i| -reach + 2.0 * reach * f64::from(i) / 22.0).collect();
            let block = Block { axes: [&axis, &axis[2..20], &axis[..17]] };
            let mut out = vec![f32::NAN; block.len()];
            s.fill_level(&block, level, &mut out);
            let cell = 3f64.sqrt() * 2.0 * reach / 22.0;
            let mut i = 0;
            for z in block.axes[2] {
                for y in block.axes[1] {
                    for x in block.axes[0] {
                        let (v, o) = (s.value([*x, *y, *z]) - level, f64::from(out[i]));
                        let near = (v - o).abs() < 1e-6 * (1.0 + v.abs());
                        let far = v.abs() > cell && o.abs() >= cell * 0.999 && o.abs() <= v.abs() + 1e-6;
                        assert!(near || (far && (v < 0.0) == (o < 0.0)), "{name}: filled {o} for {v}");
                        i += 1;
                    }
                }
            }
        }

        if let Some(volume) = s.volume() {
            let b = s.bounds();
            let n = 60_000;
            let inside = (0..n)
                .filter(|_| {
                    let p = point(&mut seed, 0.5);
                    s.value([0, 1, 2].map(|a| b.center()[a] + p[a] * b.size()[a])) < 0.0
                })
                .count();
            let [x, y, z] = b.size();
            let sampled = x * y * z * inside as f64 / n as f64;
            // Five standard deviations of a binomial at its widest.
            let tolerance = 5.0 * x * y * z * 0.5 / f64::from(n).sqrt();
            assert!((sampled - volume).abs() < tolerance, "{name}: volume {volume}, sampled {sampled}");
        }
    }
}
