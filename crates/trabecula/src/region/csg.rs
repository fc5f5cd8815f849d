//! Union, intersection and difference of regions.

use std::sync::Arc;

use super::alike_bodies::{self, Body};
use super::halfspace::polyhedron_bounds;
use super::meshes::List;
use super::narrowed::{self, MANY};
use super::{
    BuildRegion, CadMesh, Context, HalfSpace, MeshRegion, OpenSurface, Region, RegionKind, SignedDistance, bodies,
};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3};
use geometry::similarity::Similarity;

/// Points in any of the regions.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Union")]
pub struct UnionKind(#[kind(least = 1)] Vec<RegionKind>);

/// Points in all of the regions.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Intersection")]
pub struct IntersectionKind(#[kind(least = 1)] Vec<RegionKind>);

/// Points in the first region and in none of the others.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Difference")]
pub struct DifferenceKind(#[kind(least = 2)] Vec<RegionKind>);

fn each(of: &[RegionKind], context: &mut Context) -> Result<Vec<Region>, Fault> {
    of.iter().enumerate().map(|(i, r)| context.below(&format!("[{i}]"), |context| r.build(context))).collect()
}

impl BuildRegion for UnionKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        let of = each(&self.0, context)?;
        bodies::warn(&of, "regions", context);
        Ok(Arc::new(Union::new(of)?))
    }
}

impl BuildRegion for IntersectionKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(Intersection::new(each(&self.0, context)?)?))
    }
}

impl BuildRegion for DifferenceKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(Difference::new(each(&self.0, context)?)?))
    }
}

/// What lies in any of the regions: the least of their distances.
pub struct Union(List);

/// What lies in all of the regions: the greatest of their distances.
pub struct Intersection(List);

/// What lies in the first region and in none of the others: max(d₀, −d₁, −d₂ …).
pub struct Difference(List);

/// The list of what joins regions. Errors if it is empty.
fn list<J: Join>(what: &str, of: Vec<Region>) -> Result<List, Fault> {
    match of.is_empty() {
        true => Err(Fault::new("", format!("{what} of no regions: list at least one"))),
        false => Ok(List::new(of, !J::ALL, J::negated)),
    }
}

impl Union {
    /// The union. Errors if the list is empty.
    pub fn new(of: Vec<Region>) -> Result<Self, Fault> {
        list::<Self>("a union", of).map(Union)
    }
}

impl Intersection {
    /// The intersection. Errors if the list is empty.
    pub fn new(of: Vec<Region>) -> Result<Self, Fault> {
        list::<Self>("an intersection", of).map(Intersection)
    }
}

impl Difference {
    /// The first region without the others. Errors if the list is empty.
    pub fn new(of: Vec<Region>) -> Result<Self, Fault> {
        list::<Self>("a difference", of).map(Difference)
    }
}

/// How the regions of a list join: the signs they enter with and whether the greatest or the least counts.
trait Join: Send + Sync {
    fn list(&self) -> &List;
    /// The regions as they were given.
    fn regions(&self) -> &[Region] {
        &self.list().of
    }
    /// The regions with all meshes as one, and whether each enters by its complement; the first does not.
    fn operands(&self) -> &[(Region, bool)] {
        &self.list().operands
    }
    /// Whether region `i` enters by its complement.
    fn negated(i: usize) -> bool;
    /// Whether a later value replaces the one held.
    fn takes(new: f64, held: f64) -> bool;
    /// Whether all must be solid, rather than any.
    const ALL: bool;
    fn range(a: Interval, b: Interval) -> Interval;
    fn extent(&self) -> Aabb;
}

impl Join for Union {
    fn list(&self) -> &List {
        &self.0
    }
    fn negated(_: usize) -> bool {
        false
    }
    fn takes(new: f64, held: f64) -> bool {
        new < held
    }
    const ALL: bool = false;
    fn range(a: Interval, b: Interval) -> Interval {
        a.min(b)
    }
    fn extent(&self) -> Aabb {
        let full = self.regions().iter().map(|r| r.bounds()).filter(|b| !b.is_empty());
        full.reduce(Aabb::union).unwrap_or(Aabb::EMPTY)
    }
}

impl Join for Intersection {
    fn list(&self) -> &List {
        &self.0
    }
    fn negated(_: usize) -> bool {
        false
    }
    fn takes(new: f64, held: f64) -> bool {
        new > held
    }
    const ALL: bool = true;
    fn range(a: Interval, b: Interval) -> Interval {
        a.max(b)
    }
    fn extent(&self) -> Aabb {
        let bounds = self.regions().iter().map(|r| r.bounds()).fold(Aabb::ALL, Aabb::intersection);
        match self.half_spaces() {
            // Slanted ones may end it together.
            Some(sides) if !bounds.is_finite() => bounds.intersection(polyhedron_bounds(&sides)),
            _ => bounds,
        }
    }
}

impl Join for Difference {
    fn list(&self) -> &List {
        &self.0
    }
    fn negated(i: usize) -> bool {
        i > 0
    }
    fn takes(new: f64, held: f64) -> bool {
        new > held
    }
    const ALL: bool = true;
    fn range(a: Interval, b: Interval) -> Interval {
        a.max(b)
    }
    fn extent(&self) -> Aabb {
        self.regions()[0].bounds()
    }
}

/// What `Join` has by itself.
trait JoinExt: Join {
    /// The bound of operand `i`, by its complement if it enters so and negated if the greatest counts: the least decides.
    fn rank(&self, i: usize, b: &Aabb) -> Interval {
        let (r, negated) = &self.operands()[i];
        let own = r.bound(b);
        if *negated == Self::ALL { own } else { -own }
    }

    /// Values and, if `gradients` is not empty, gradients at points by some of the operands.
    fn join(&self, of: &[usize], points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let sloped = !gradients.is_empty();
        let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; gradients.len()]);
        for (n, (r, negated)) in of.iter().map(|i| &self.operands()[*i]).enumerate() {
            match sloped {
                true => r.gradients(points, &mut v, &mut g),
                false => r.values(points, &mut v),
            }
            let sign = if *negated { -1.0 } else { 1.0 };
            for k in 0..points.len() {
                if n == 0 || Self::takes(sign * v[k], values[k]) {
                    values[k] = sign * v[k];
                    if sloped {
                        gradients[k] = g[k].map(|x| sign * x);
                    }
                }
            }
        }
    }

    /// The same by all of them, of which most are ruled out where there are many.
    fn join_all(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let count = self.operands().len();
        if count <= MANY {
            return self.join(&Vec::from_iter(0..count), points, values, gradients);
        }
        narrowed::divided(points, count, &|of, b| narrowed::least(of, |i| self.rank(i, b)), &mut |at, of| {
            let points: Vec<Vec3> = at.iter().map(|i| points[*i]).collect();
            let mut v = vec![0.0; points.len()];
            let mut g = vec![[0.0; 3]; if gradients.is_empty() { 0 } else { points.len() }];
            self.join(of, &points, &mut v, &mut g);
            at.iter().zip(v).for_each(|(i, v)| values[*i] = v);
            at.iter().zip(g).for_each(|(i, g)| gradients[*i] = g);
        });
    }
}
impl<J: Join> JoinExt for J {}

/// Adds the complements of surfaces that `add` adds, and returns how they are combined.
fn complement(out: &mut Vec<Surface>, add: impl FnOnce(&mut Vec<Surface>) -> CsgTree) -> CsgTree {
    let first = out.len();
    let tree = add(out).complement();
    let turned = out.split_off(first);
    out.extend(turned.into_iter().map(Surface::complement));
    tree
}

/// A region grown by `by` mm, as a body of a union.
fn body(of: &Region, by: f64) -> Body {
    let mut surfaces = Vec::new();
    let tree = of.clone().surfaces(by, &mut surfaces);
    Body { bounds: of.bounds().grown(by.max(0.0)), surfaces, tree }
}

macro_rules! joined {
    ($($shape:ty),*) => {$(
        impl Field for $shape {
            fn values(&self, points: &[Vec3], out: &mut [f64]) {
                self.join_all(points, out, &mut []);
            }

            fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
                self.join_all(points, values, gradients);
            }

            fn bound(&self, b: &Aabb) -> Interval {
                let mut range = self.operands()[0].0.bound(b);
                for (r, negated) in &self.operands()[1..] {
                    let other = r.bound(b);
                    range = Self::range(range, if *negated { -other } else { other });
                }
                range
            }

            fn fill(&self, block: &Block, out: &mut [f32]) {
                self.fill_level(block, 0.0, out);
            }
        }

        impl SignedDistance for $shape {
            fn bounds(&self) -> Aabb {
                self.extent()
            }

            fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
                for (r, negated) in self.operands() {
                    r.level_planes(axis, if *negated { -level } else { level }, out);
                }
            }

            // Rounding keeps order, so joining rounded values gives the rounded join.
            fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
                if block.is_empty() {
                    return;
                }
                let all = Vec::from_iter(0..self.operands().len());
                let few = all.len() <= MANY;
                let of = if few { all } else { narrowed::least(&all, |i| self.rank(i, &block.bounds())) };
                let mut other = vec![0.0f32; out.len()];
                for (n, (r, negated)) in of.iter().map(|i| &self.operands()[*i]).enumerate() {
                    let sign = if *negated { -1.0f32 } else { 1.0 };
                    r.fill_level(block, level * f64::from(sign), &mut other);
                    for (o, v) in out.iter_mut().zip(&other) {
                        if n == 0 || Self::takes(f64::from(sign * v), f64::from(*o)) {
                            *o = sign * v;
                        }
                    }
                }
            }

            fn is_searched(&self) -> bool {
                self.operands().iter().any(|(r, _)| r.is_searched())
            }

            fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
                let parts = self.operands().iter();
                if self.operands().len() <= MANY {
                    let each = parts.map(|(r, negated)| match negated {
                        false => r.clone().surfaces(by, out),
                        true => complement(out, |out| r.clone().surfaces(-by, out)),
                    });
                    let each = each.collect();
                    return if Self::ALL { CsgTree::Intersection(each) } else { CsgTree::Union(each) };
                }
                let of = |wanted: bool| parts.clone().filter(move |(_, negated)| *negated == wanted).map(|(r, _)| r);
                if !Self::ALL {
                    return alike_bodies::union(of(false).map(|r| body(r, by)).collect(), out);
                }
                let mut each: Vec<CsgTree> = of(false).map(|r| r.clone().surfaces(by, out)).collect();
                each.push(complement(out, |out| alike_bodies::union(of(true).map(|r| body(r, -by)).collect(), out)));
                CsgTree::Intersection(each)
            }

            fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
                Ok(Arc::new(Self(self.list().moved(by)?)))
            }

            fn as_mesh(&self) -> Option<&MeshRegion> {
                match self.operands() {
                    [(only, _)] => only.as_mesh(),
                    _ => None,
                }
            }

            fn cad(&self, out: &mut Vec<Arc<CadMesh>>) {
                self.regions().iter().for_each(|r| r.cad(out));
            }

            // What is taken away keeps its surface: grown, it has no flat faces of its own.
            fn opened(self: Arc<Self>, cuts: &[OpenSurface], found: &mut [bool]) -> Option<Region> {
                let mut any = false;
                let mut open = |(i, r): (usize, &Region)| {
                    let opened = if Self::negated(i) { None } else { r.clone().opened(cuts, found) };
                    any |= opened.is_some();
                    opened.unwrap_or_else(|| r.clone())
                };
                let regions = self.regions().iter().enumerate().map(&mut open).collect();
                any.then(|| Arc::new(Self(List::new(regions, !Self::ALL, Self::negated))) as Region)
            }

            fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
                let mut out = Vec::new();
                for (r, negated) in self.operands() {
                    let own = r.half_spaces().filter(|_| Self::ALL || self.operands().len() == 1)?;
                    match &own[..] {
                        [one] if *negated => out.push(one.complement()),
                        _ if *negated => return None,
                        all => out.extend(all),
                    }
                }
                Some(out)
            }

            fn volume(&self) -> Option<f64> {
                match self.operands() {
                    [(only, _)] => only.volume(),
                    _ if Self::ALL => None,
                    all => bodies::volume(all.iter().map(|(r, _)| r)),
                }
            }
        }
    )*};
}
joined!(Union, Intersection, Difference);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::tests::check_shape;
    use crate::region::{Cuboid, Cylinder, Offset, Sphere};
    use geometry::mesh::Mesh;
    use geometry::repair::Repair;
    use std::sync::Arc;

    fn parts() -> [Region; 3] {
        [
            Arc::new(Cuboid::new([-1.1, -0.9, -1.3], [1.2, 0.8, 1.0]).unwrap()),
            Arc::new(Sphere::new([1.0, 0.2, 0.3], 0.9).unwrap()),
            Arc::new(Cylinder::new([0.0, 0.0, -2.0], [0.0, 0.0, 1.0], 0.4, 4.0).unwrap()),
        ]
    }

    #[test]
    fn slanted_half_spaces_end_where_they_meet() {
        let side = |n: Vec3| -> Region { Arc::new(HalfSpace::new(n.map(|v| 4.0 * v), n).unwrap()) };
        let normals = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let tetrahedron = Intersection::new(normals.map(side).to_vec()).unwrap().bounds();
        assert!((0..3).all(|a| (tetrahedron.min[a] + 12.0).abs() < 1e-9 && (tetrahedron.max[a] - 12.0).abs() < 1e-9));
        let far = |n: Vec3| -> Region { Arc::new(HalfSpace::new(n.map(|v| 8e6 + v), n).unwrap()) };
        let tetrahedron = Intersection::new(normals.map(far).to_vec()).unwrap().bounds();
        assert!(tetrahedron.is_finite() && tetrahedron.min[0] > 7.9e6, "{tetrahedron:?}");
        let open = Intersection::new(normals[..3].iter().map(|n| side(*n)).collect()).unwrap().bounds();
        assert!(!open.is_finite() && !open.is_empty());
        let apart = [side([1.0, 1.0, 0.0]), Arc::new(HalfSpace::new([9.0; 3], [-1.0, -1.0, 0.0]).unwrap())];
        assert!(Intersection::new(apart.to_vec()).unwrap().bounds().is_empty());
    }

    #[test]
    fn combinations_keep_the_laws_of_a_shape() {
        let list = || parts().to_vec();
        check_shape("union", &Union::new(list()).unwrap(), 2.5, 0.0);
        check_shape("intersection", &Intersection::new(list()).unwrap(), 2.5, 0.0);
        let difference: Region = Arc::new(Difference::new(list()).unwrap());
        check_shape("difference", difference.as_ref(), 2.5, 0.0);
        for by in [0.3, -0.3] {
            check_shape("offset", &Offset::new(difference.clone(), by).unwrap(), 2.5, 0.0);
        }
    }

    #[test]
    fn values_at_known_points() {
        let [b, s, c] = parts();
        let p = [1.0, 0.2, 0.3];
        assert_eq!(Union::new(vec![b.clone(), s.clone()]).unwrap().value(p), -0.9);
        assert!((Difference::new(vec![b.clone(), s.clone()]).unwrap().value(p) - 0.9).abs() < 1e-15);
        assert!((Intersection::new(vec![b.clone(), c]).unwrap().value([1.0, 0.0, 0.0]) - 0.6).abs() < 1e-15);
        assert!((Offset::new(s, 0.5).unwrap().value(p) + 1.4).abs() < 1e-15);
        assert_eq!(Union::new(vec![b.clone()]).unwrap().volume(), b.volume());
    }

    /// Meshes that touch, overlap or are cut from each other have the distance of what they are together, moved or not: a box of two halves
    /// is the box.
    #[test]
    fn meshes_have_one_distance() {
        let mesh =
            |lo: Vec3, hi: Vec3| -> Region { Arc::new(MeshRegion::new(Mesh::cuboid(lo, hi), Repair::Refuse).unwrap()) };
        let whole = Cuboid::new([0.0; 3], [2.0, 1.0, 1.0]).unwrap();
        let [low, high] = [mesh([0.0; 3], [1.0; 3]), mesh([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])];
        let long = mesh([0.0; 3], [3.0, 1.0, 1.0]);
        let [over, past] = [mesh([0.8, 0.0, 0.0], [2.0, 1.0, 1.0]), mesh([2.0, -1.0, -1.0], [4.0, 2.0, 2.0])];
        let made: [Region; 4] = [
            Arc::new(Union::new(vec![low.clone(), high.clone()]).unwrap()),
            Arc::new(Union::new(vec![low, over]).unwrap()),
            Arc::new(Difference::new(vec![long.clone(), past]).unwrap()),
            Arc::new(Intersection::new(vec![long, mesh([-1.0, 0.0, 0.0], [2.0, 1.0, 1.0])]).unwrap()),
        ];
        let mut seed = 11;
        let points: Vec<Vec3> = (0..500).map(|_| [0; 3].map(|_| 3.0 * geometry::random::random(&mut seed))).collect();
        for (i, region) in made.iter().enumerate() {
            assert!((region.volume().unwrap() - 2.0).abs() < 1e-12);
            for by in [0.0, -0.3, 0.2] {
                let moved = Offset::new(region.clone(), by).unwrap();
                for p in &points {
                    assert!((moved.value(*p) - whole.value(*p) + by).abs() < 1e-12, "{i}, {by}: {p:?}");
                }
            }
        }
    }

    #[test]
    fn faces_stay_exactly_zero_through_combinations_and_offsets() {
        let b = Arc::new(Cuboid::new([0.1, 0.2, 0.3], [10.0, 12.3, 7.7]).unwrap());
        let hole = Arc::new(Cuboid::new([3.0, 3.0, 5.0], [5.0, 5.0, 9.0]).unwrap());
        let cut: Region = Arc::new(Difference::new(vec![b, hole]).unwrap());
        for by in [0.0, -0.8, -0.1, 0.7, 1.0 / 3.0] {
            let grown = Offset::new(cut.clone(), by).unwrap();
            let (mut z, mut x) = (Vec::new(), Vec::new());
            grown.planes(2, &mut z);
            grown.planes(0, &mut x);
            assert!((z[1] - 7.7 - by).abs() < 1e-14 && (z[2] - 5.0 - by).abs() < 1e-14, "{z:?}");
            assert_eq!(grown.value([8.0, 8.0, z[1]]), 0.0, "top moved by {by}");
            assert_eq!(grown.value([8.0, 8.0, z[0]]), 0.0, "bottom moved by {by}");
            assert_eq!(grown.value([4.0, 4.0, z[2]]), 0.0, "floor of the hole moved by {by}");
            assert_eq!(grown.value([x[1], 8.0, 2.0]), 0.0, "side moved by {by}");
        }
    }

    #[test]
    fn bounds_follow_the_parts() {
        let [b, s, _] = parts();
        let open: Region = Arc::new(crate::region::HalfSpace::new([0.0; 3], [0.0, 0.0, 1.0]).unwrap());
        let i = Intersection::new(vec![b.clone(), open.clone()]).unwrap();
        assert_eq!(i.bounds().max, [1.2, 0.8, 0.0]);
        assert!(!Union::new(vec![b.clone(), open]).unwrap().bounds().is_finite());
        assert_eq!(Difference::new(vec![b.clone(), s]).unwrap().bounds(), b.bounds());
        assert_eq!(Offset::new(b.clone(), 0.5).unwrap().bounds(), b.bounds().grown(0.5));
    }

    #[test]
    fn empty_lists_and_wild_offsets_are_refused() {
        assert!(Union::new(vec![]).is_err());
        assert!(Intersection::new(vec![]).is_err());
        assert!(Difference::new(vec![]).is_err());
        assert_eq!(Offset::new(parts()[0].clone(), f64::NAN).err().unwrap().at, "by");
    }
}
