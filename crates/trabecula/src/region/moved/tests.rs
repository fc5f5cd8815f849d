use super::*;
use crate::region::tests::check_shape;
use crate::region::{Cuboid, Cylinder, Difference, MeshRegion, Offset, Sphere, Tetrahedron, Union};
use geometry::math::norm;
use geometry::mesh::Mesh;
use geometry::random::random;
use geometry::repair::Repair;
use geometry::similarity::Similarity;

fn shapes() -> Vec<(&'static str, Region, f64)> {
    let cuboid = || Arc::new(Cuboid::new([-1.0, -0.7, 0.1], [1.3, 0.7, 1.1]).unwrap()) as Region;
    let cylinder = |axis| Arc::new(Cylinder::new([0.1, 0.2, -0.3], axis, 0.6, 1.2).unwrap()) as Region;
    let corners = [[-1.0, -0.8, -1.0], [1.2, -0.9, -1.0], [0.1, 1.4, -1.0], [0.2, 0.1, 0.9]];
    let mesh = |lo: Vec3, hi: Vec3| Arc::new(MeshRegion::new(Mesh::cuboid(lo, hi), Repair::Auto).unwrap()) as Region;
    let ball = || Arc::new(Sphere::new([0.1, 0.2, -0.3], 0.8).unwrap()) as Region;
    let pair = || vec![mesh([-1.0; 3], [0.5; 3]), mesh([0.0, -0.2, -0.4], [1.1, 0.6, 0.3])];
    vec![
        ("box", cuboid(), 1.0),
        ("upright cylinder", cylinder([0.0, 0.0, 1.0]), 1.0),
        ("cylinder", cylinder([1.0, 2.0, -1.5]), 1.0),
        ("ball", ball(), 1.0),
        ("half-space", Arc::new(HalfSpace::new([0.1, 0.2, -0.3], [0.0, -7.0, 0.0]).unwrap()), 1.0),
        ("tetrahedron", Arc::new(Tetrahedron::new(corners, None).unwrap()), 0.0),
        ("smooth tetrahedron", Arc::new(Tetrahedron::new(corners, Some(6.0)).unwrap()), 0.0),
        ("mesh", mesh([-1.0, -0.7, -0.6], [0.9, 0.8, 0.8]), 1.0),
        ("two meshes", Arc::new(Union::new(pair()).unwrap()), 0.0),
        ("difference", Arc::new(Difference::new(vec![cuboid(), ball()]).unwrap()), 0.0),
        ("offset", Arc::new(Offset::new(cuboid(), 0.3).unwrap()), 0.0),
    ]
}

fn by(scale: f64, rotate: Vec3, mirror: Vec3) -> Similarity {
    let turn = rotation(rotate);
    let turn = if mirror == [0.0; 3] { turn } else { product(&turn, &mirrored("mirror", mirror).unwrap()) };
    Similarity::new(scale, turn, [0.2, -0.1, 0.3], [0.1, 0.3, -0.2])
}

fn transforms() -> [Similarity; 4] {
    let none = [0.0; 3];
    [
        by(1.3, [31.0, -22.0, 75.0], none),
        by(0.8, [10.0, 20.0, 30.0], [1.0, 2.0, 3.0]),
        by(1.1, [90.0, 0.0, -90.0], none),
        by(1.0, none, [0.0, 0.0, 1.0]),
    ]
}

#[test]
fn images_keep_the_laws_of_a_shape() {
    for (name, of, exact) in shapes() {
        for by in transforms() {
            check_shape(name, &*moved(&of, &by).unwrap(), 3.0, exact);
        }
    }
}

/// d(T p) = s d(p), the volume is s³ of it, and both hold for images of images.
#[test]
fn distances_scale_and_volumes_with_the_cube() {
    let mut seed = 9;
    for (name, of, _) in shapes() {
        for first in transforms() {
            for second in [Similarity::new(1.0, IDENTITY, [0.0; 3], [0.0; 3]), transforms()[0]] {
                let image = moved(&moved(&of, &first).unwrap(), &second).unwrap();
                let (all, s) = (second.after(&first), first.scale() * second.scale());
                for _ in 0..200 {
                    let p = [0; 3].map(|_| 3.0 * random(&mut seed));
                    let off = image.value(all.point(p)) - s * of.value(p);
                    // A few roundings of coordinates below ten.
                    assert!(off.abs() < 1e-13, "{name}: {off:e}");
                }
                let (a, b) = (of.volume(), image.volume());
                assert_eq!(a.is_some(), b.is_some(), "{name}");
                assert!(a.zip(b).is_none_or(|(a, b)| (b / a / s.powi(3) - 1.0).abs() < 1e-12), "{name}");
                assert_eq!(of.as_mesh().is_some(), image.as_mesh().is_some(), "{name}");
                let sides = [&of, &image].map(|r| r.half_spaces().map(|h| h.len()));
                assert_eq!(sides[0], sides[1], "{name}");
            }
        }
    }
}

/// Bounds are those of the image itself: in each direction the shape reaches them.
#[test]
fn bounds_are_tight() {
    for (name, of, exact) in shapes() {
        // Of what is not convex only the bounds of its parts are known; of half-spaces none.
        if exact == 0.0 || !of.bounds().is_finite() {
            continue;
        }
        for by in transforms() {
            let image = moved(&of, &by).unwrap();
            let b = image.bounds();
            for face in 0..6 {
                let (axis, upper) = (face / 2, face % 2 == 1);
                let mut plane = b;
                let at = if upper { b.max[axis] } else { b.min[axis] };
                (plane.min[axis], plane.max[axis]) = (at, at);
                // By halving the face until the part that may touch it is small.
                let mut parts = vec![plane];
                let mut least = f64::INFINITY;
                while let Some(part) = parts.pop() {
                    let found = image.value(part.center());
                    least = least.min(found);
                    let half = 0.5 * norm(part.size());
                    if found - half <= 1e-9 && half > 1e-9 && least > 1e-9 {
                        parts.extend(part.halves());
                    }
                }
                assert!(least.abs() <= 1e-9, "{name}: {least:e} off the bounds at {face}");
            }
        }
    }
}

#[test]
fn faces_stay_exactly_on_planes_under_quarter_turns_and_reflections() {
    let mut seed = 21;
    for _ in 0..300 {
        let v = |seed: &mut u64| [0; 3].map(|_| 3.0 * random(seed));
        let quarter = |seed: &mut u64| [0; 3].map(|_| 90.0 * (2.0 * random(seed)).round());
        let turn = rotation(quarter(&mut seed));
        let turn = if random(&mut seed) > 0.0 { product(&turn, &mirrored("", [0.0, 1.0, 0.0]).unwrap()) } else { turn };
        let by = Similarity::new(1.7f64.powf(random(&mut seed)), turn, v(&mut seed), v(&mut seed));
        let (a, b) = (v(&mut seed), v(&mut seed));
        let cuboid = Cuboid::new([0, 1, 2].map(|i| a[i].min(b[i])), [0, 1, 2].map(|i| a[i].max(b[i]))).unwrap();
        let mesh = MeshRegion::new(Mesh::cuboid(cuboid.bounds().min, cuboid.bounds().max), Repair::Refuse).unwrap();
        let cylinder = Cylinder::new(a, [0.0, -1.0, 0.0], 0.7, 0.1 + b[0].abs()).unwrap();
        let all: [(Region, usize); 4] = [
            (Arc::new(cuboid), 6),
            (Arc::new(mesh), 6),
            (Arc::new(cylinder), 2),
            (Arc::new(HalfSpace::new(a, [0.0, 0.0, -1.0]).unwrap()), 1),
        ];
        for (of, faces) in all {
            let image = moved(&of, &by).unwrap();
            let (mut found, mut own) = (0, Vec::new());
            (0..3).for_each(|axis| of.planes(axis, &mut own));
            // Of a mesh those of small faces are left out.
            assert!(own.len() == faces || of.as_mesh().is_some());
            for axis in 0..3 {
                let mut planes = Vec::new();
                image.planes(axis, &mut planes);
                found += planes.len();
                for at in planes {
                    let b = image.bounds();
                    let mut p = by.point(a);
                    if b.is_finite() {
                        p = [0, 1, 2].map(|k| b.center()[k] + 0.03 * b.size()[k]);
                    }
                    p[axis] = at;
                    assert_eq!(image.value(p), 0.0);
                    // It is the image of a plane of the shape itself.
                    let back = by.back(p);
                    assert!(own.iter().any(|g| back.iter().any(|x| (x - g).abs() < 1e-12)));
                }
            }
            assert_eq!(found, own.len());
        }
    }
}

/// Two quarter turns about different points of one face leave it where it is: coordinates at the fixed point are exact.
#[test]
fn what_lies_at_the_fixed_point_stays() {
    let of: Region = Arc::new(Cuboid::new([0.1, 0.2, 0.3], [5.7, 6.1, 7.3]).unwrap());
    let half = Similarity::new(1.3, rotation([0.0, 0.0, 180.0]), [5.7, 0.2, 7.3], [0.0; 3]);
    let b = moved(&of, &half).unwrap().bounds();
    assert_eq!([b.min[0], b.max[1], b.max[2]], [5.7, 0.2, 7.3]);
}

#[test]
fn meshes_that_are_mirrored_stay_oriented_outwards() {
    let of = shapes().remove(7).1;
    for by in transforms() {
        let image = moved(&of, &by).unwrap();
        let mesh = image.as_mesh().unwrap().mesh();
        // A box turned is a box: volume and area are those of one.
        assert!((mesh.volume() / of.volume().unwrap() / by.scale().powi(3) - 1.0).abs() < 1e-13);
        assert!(mesh.volume() > 0.0);
    }
}

/// The surfaces of an image are those of the shape: they have its sign, grown and shrunk.
#[test]
fn surfaces_move_along() {
    let mut seed = 4;
    for (name, of, _) in shapes() {
        for by in transforms() {
            let image = moved(&of, &by).unwrap();
            for grown in [0.0, -0.1, 0.2] {
                let mut surfaces = Vec::new();
                let tree = image.clone().surfaces(grown, &mut surfaces);
                for _ in 0..100 {
                    let p = [0; 3].map(|_| 2.5 * random(&mut seed));
                    let value = image.value(p) - grown;
                    let solid = tree.value(&|s| surfaces[s].field.value(p)).0 < 0.0;
                    assert!(solid == (value < 0.0) || value.abs() < 1e-9, "{name}, {grown}: {value} at {p:?}");
                }
            }
        }
    }
}

#[test]
fn a_shape_that_rounding_would_change_is_refused() {
    for (name, of, _) in shapes() {
        if of.bounds().is_finite() {
            let far = moved(&of, &Similarity::new(1.0, IDENTITY, [0.0; 3], [1e17, 0.0, 0.0]));
            assert!(far.err().is_some_and(|f| f.message.contains("f64 rounds its shape")), "{name}");
        }
        assert!(moved(&of, &Similarity::new(1.0, IDENTITY, [0.0; 3], [1e5, 0.0, 0.0])).is_ok());
    }
}

#[test]
fn rotations_about_axes_are_those_of_angles() {
    let third = turned("axis", [1.0; 3], 120.0).unwrap();
    assert_eq!(Similarity::new(1.0, third, [0.0; 3], [0.0; 3]).point([1.1, 2.2, 3.3]), [3.3, 1.1, 2.2]);
    for (axis, rotate) in [([0.0, 0.0, 2.0], [0.0, 0.0, 33.0]), ([-0.5, 0.0, 0.0], [-33.0, 0.0, 0.0])] {
        assert_eq!(turned("axis", axis, 33.0).unwrap(), rotation(rotate));
    }
    // An axis a hair off z turns nearly as z does.
    let near = turned("axis", [1e-9, 0.0, 1.0], 33.0).unwrap();
    let z = rotation([0.0, 0.0, 33.0]);
    assert!((0..9).all(|n| (near[n / 3][n % 3] - z[n / 3][n % 3]).abs() < 1e-8));
    assert_eq!(turned("axis", [0.0; 3], 1.0).unwrap_err().at, "axis");
    assert_eq!(mirrored("mirror", [0.0; 3]).unwrap_err().at, "mirror");
}
