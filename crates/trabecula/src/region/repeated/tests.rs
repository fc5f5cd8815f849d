use super::*;
use crate::csg_tree::CsgSolid;
use crate::field::{Block, Field};
use crate::region::tests::check_shape;
use crate::region::{Cuboid, Cylinder, Difference, MeshRegion, SignedDistance, Sphere};
use geometry::math::{Aabb, norm};
use geometry::mesh::Mesh;
use geometry::random::random;
use geometry::repair::Repair;
use geometry::similarity::Similarity;

fn row(by: Vec3, count: u32) -> RowKind {
    RowKind { by, count }
}

fn ring(count: u32, axis: Vec3, about: Vec3, angle: Option<f64>) -> RingKind {
    RingKind { count, axis, about, angle }
}

fn places(along: &[RowKind], around: Option<RingKind>) -> Vec<Similarity> {
    let of = Box::new(RegionKind::Sphere(Sphere::new([0.0; 3], 1.0).unwrap()));
    let kind = RepeatedKind { of, along: along.to_vec(), around };
    kind.valid().unwrap();
    kind.places().unwrap()
}

fn copies(of: &Region, places: &[Similarity]) -> Vec<Region> {
    places.iter().map(|by| moved(of, by).unwrap()).collect()
}

fn bodies() -> [(&'static str, Region); 3] {
    let block: Region = Arc::new(Cuboid::new([1.0, -0.2, -0.4], [1.6, 0.3, 0.5]).unwrap());
    let hole: Region = Arc::new(Cylinder::new([1.4, 0.0, -0.6], [0.0, 0.0, 1.0], 0.2, 1.2).unwrap());
    [
        ("boxes", block.clone()),
        ("cylinders", hole.clone()),
        ("differences", Arc::new(Difference::new(vec![block, hole]).unwrap())),
    ]
}

fn patterns() -> [Vec<Similarity>; 4] {
    let grid = [row([0.7, 0.0, 0.0], 5), row([0.0, 0.8, 0.1], 4)];
    [
        places(&[row([0.4, 0.1, 0.0], 3)], None),
        places(&grid, None),
        places(&[], Some(ring(24, [0.0, 0.0, 1.0], [0.0; 3], None))),
        places(&[row([0.1, 0.0, 0.9], 2)], Some(ring(7, [0.2, 0.1, 1.0], [0.1, 0.0, 0.2], Some(33.0)))),
    ]
}

#[test]
fn copies_keep_the_laws_of_a_shape() {
    for (name, of) in bodies() {
        for places in patterns() {
            check_shape(name, &Union::new(copies(&of, &places)).unwrap(), 3.0, 0.0);
        }
    }
}

/// A union of many is the least of all, to the last bit, however few of them are asked.
#[test]
fn the_value_is_the_least_of_all_copies() {
    let mut seed = 17;
    let points: Vec<Vec3> = (0..3000).map(|_| [0; 3].map(|_| 4.0 * random(&mut seed))).collect();
    for (name, of) in bodies() {
        for places in patterns() {
            let each = copies(&of, &places);
            let union = Union::new(each.clone()).unwrap();
            let (mut values, mut slopes) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
            union.values(&points, &mut values);
            let mut again = values.clone();
            union.gradients(&points, &mut again, &mut slopes);
            assert_eq!(values, again);
            for (p, v) in points.iter().zip(&values) {
                let least = each.iter().map(|r| r.value(*p)).fold(f64::INFINITY, f64::min);
                assert_eq!(*v, least, "{name}");
            }
        }
    }
}

/// As surfaces many copies are few, and these have the sign of the region, grown or shrunk; their bounds and grids hold.
#[test]
fn many_copies_are_few_surfaces() {
    let mut seed = 5;
    let mut most = 0;
    for (name, of) in bodies() {
        for places in patterns() {
            for grown in [0.0, -0.05, 0.1] {
                let region: Region = Arc::new(Union::new(copies(&of, &places)).unwrap());
                let mut surfaces = Vec::new();
                let tree = region.clone().surfaces(grown, &mut surfaces);
                let mut one = Vec::new();
                of.clone().surfaces(grown, &mut one);
                if places.len() * one.len() > 32 {
                    most = most.max(surfaces.len() / one.len());
                }
                let solid = CsgSolid { surfaces, tree };
                for _ in 0..300 {
                    let p = [0; 3].map(|_| 3.5 * random(&mut seed));
                    let (value, found) = (region.value(p) - grown, solid.value(p));
                    assert!((found < 0.0) == (value < 0.0) || value.abs() < 1e-12, "{name}: {value} {found} at {p:?}");
                }
                solid.surfaces.iter().for_each(|s| check_field(&*s.field, &mut seed));
            }
        }
    }
    // Of 24 copies that nearly touch.
    assert!(most <= 12, "{most} classes");
    let apart = places(&[row([4.0, 0.0, 0.0], 10), row([0.0, 4.0, 0.0], 10)], None);
    let mut surfaces = Vec::new();
    let region = Union::new(copies(&bodies()[1].1, &apart)).unwrap();
    Arc::new(region).surfaces(0.0, &mut surfaces);
    assert_eq!(surfaces.len(), 3);
}

/// Values are 1-Lipschitz, gradients those of differences, bounds hold, and grids have the right signs near zero.
fn check_field(of: &dyn Field, seed: &mut u64) {
    let mut smooth = 0;
    for _ in 0..60 {
        let (p, q) = ([0; 3].map(|_| 3.0 * random(seed)), [0; 3].map(|_| 3.0 * random(seed)));
        let (vp, vq) = (of.value(p), of.value(q));
        assert!((vp - vq).abs() <= norm(geometry::math::sub(p, q)) * (1.0 + 1e-12) + 1e-12);
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        of.gradients(&[p], &mut v, &mut g);
        assert_eq!(v[0], vp);
        let h = 1e-6;
        let differs = |a: usize| {
            let (mut l, mut u) = (p, p);
            (l[a], u[a]) = (p[a] - h, p[a] + h);
            ((of.value(u) - of.value(l)) / (2.0 * h) - g[0][a]).abs() > 1e-4
        };
        smooth += usize::from(!(0..3).any(differs));
        let b = Aabb { min: p, max: p }.grown(0.3);
        let range = of.bound(&b);
        let inside = [0, 1, 2].map(|a| p[a] + 0.3 * random(seed));
        let v = of.value(inside);
        assert!(range.lo <= v && v <= range.hi, "{v} outside {range:?}");
    }
    assert!(smooth > 50, "{smooth} of 60 gradients");
    let axis: Vec<f64> = (0..24).map(|i| -3.0 + 0.25 * f64::from(i)).collect();
    let block = Block { axes: [&axis, &axis[3..20], &axis[..17]] };
    let mut out = vec![f32::NAN; block.len()];
    of.fill(&block, &mut out);
    let cell = 0.25 * 3f64.sqrt();
    let mut i = 0;
    for z in block.axes[2] {
        for y in block.axes[1] {
            for x in block.axes[0] {
                let (v, o) = (of.value([*x, *y, *z]), f64::from(out[i]));
                let near = (v - o).abs() < 1e-6 * (1.0 + v.abs());
                let far = v.abs() > cell * 0.999 && o.abs() >= cell * 0.999 && o.abs() <= v.abs() + 1e-6;
                assert!(near || (far && (v < 0.0) == (o < 0.0)), "filled {o} for {v}");
                i += 1;
            }
        }
    }
}

#[test]
fn copies_that_are_apart_have_the_volume_of_all() {
    for (name, of) in &bodies()[..2] {
        let apart = places(&[row([2.0, 0.0, 0.0], 3), row([0.0, 2.0, 0.0], 3), row([0.0, 0.0, 2.0], 3)], None);
        let union = Union::new(copies(of, &apart)).unwrap();
        assert!((union.volume().unwrap() / of.volume().unwrap() - 27.0).abs() < 1e-12, "{name}");
        // Oblique boxes about an axis have bounds that meet, but do not meet themselves.
        let about = places(&[], Some(ring(10, [0.0, 0.0, 1.0], [0.0; 3], None)));
        let union = Union::new(copies(of, &about)).unwrap();
        assert!((union.volume().unwrap() / of.volume().unwrap() - 10.0).abs() < 1e-12, "{name}");
        let meeting = places(&[row([0.1, 0.0, 0.0], 2)], None);
        assert_eq!(Union::new(copies(of, &meeting)).unwrap().volume(), None, "{name}");
    }
}

#[test]
fn copies_of_a_mesh_are_one_mesh() {
    let cube: Region = Arc::new(MeshRegion::new(Mesh::cuboid([0.0; 3], [1.0; 3]), Repair::Refuse).unwrap());
    // Each shares half of itself with the next.
    let union = Union::new(copies(&cube, &places(&[row([0.5, 0.0, 0.0], 5)], None))).unwrap();
    assert!((union.as_mesh().unwrap().mesh().volume() - 3.0).abs() < 1e-12);
}

#[test]
fn a_full_circle_is_divided_evenly_and_quarters_are_exact() {
    let of: Region = Arc::new(Cuboid::new([3.0, -1.0, 0.0], [5.0, 1.0, 0.7]).unwrap());
    let eight = copies(&of, &places(&[], Some(ring(8, [0.0, 0.0, -2.0], [0.0; 3], None))));
    let b = eight[2].bounds();
    assert_eq!((b.min, b.max), ([-1.0, -5.0, 0.0], [1.0, -3.0, 0.7]));
    let mut planes = Vec::new();
    eight.iter().for_each(|r| r.planes(2, &mut planes));
    // The oblique ones have no planes of their own kind, but their caps are at the same height.
    assert_eq!(planes, [0.0, 0.7].repeat(4));
    assert!(eight.iter().all(|r| r.bounds().max[2] == 0.7));
    let mut surfaces = Vec::new();
    let oblique = eight[1].clone().surfaces(0.0, &mut surfaces);
    assert!(matches!(oblique, crate::csg_tree::CsgTree::Intersection(of) if of.len() == 6));
    assert_eq!(surfaces.iter().filter(|s| s.plane.is_some_and(|p| p.axis == 2)).count(), 2);
}

#[test]
fn what_cannot_be_repeated_is_refused() {
    let of = Box::new(RegionKind::Sphere(Sphere::new([0.0; 3], 1.0).unwrap()));
    let fault = |along: &[RowKind], around: Option<RingKind>| {
        let kind = RepeatedKind { of: of.clone(), along: along.to_vec(), around };
        kind.valid().and_then(|()| kind.places().map(drop)).unwrap_err()
    };
    assert!(fault(&[], None).message.contains("along"));
    assert_eq!(fault(&[row([1.0, 0.0, 0.0], 0)], None).at, "along[0].count");
    assert_eq!(fault(&[row([0.0; 3], 2)], None).at, "along[0].by");
    assert_eq!(fault(&[row([f64::NAN, 0.0, 0.0], 2)], None).at, "along[0].by[0]");
    assert_eq!(fault(&[row([1.0, 0.0, 0.0], 2); 4], None).at, "along");
    assert!(fault(&[row([1.0, 0.0, 0.0], 200); 2], None).message.starts_with("40000 copies; at most 10000"));
    assert_eq!(fault(&[], Some(ring(0, [0.0, 0.0, 1.0], [0.0; 3], None))).at, "around.count");
    assert_eq!(fault(&[], Some(ring(3, [0.0; 3], [0.0; 3], None))).at, "around.axis");
    assert_eq!(fault(&[], Some(ring(3, [0.0, 0.0, 1.0], [0.0; 3], Some(0.0)))).at, "around.angle");
}
