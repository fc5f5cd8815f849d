use super::*;
use crate::region::tests::check_shape;
use crate::region::{CadMesh, FaceLabel, HalfSpace, MeshRegion, OpenSurface};
use geometry::math::{add, sub};
use geometry::mesh::Mesh;
use geometry::random::random;
use geometry::repair::Repair;
use geometry::similarity::Similarity;

/// A box of which each side is a face, the bottom named and the top red.
fn part(lo: Vec3, hi: Vec3) -> Region {
    let mesh = Mesh::cuboid(lo, hi);
    let side = |i: usize| {
        let corners = mesh.corners(i);
        let axis = (0..3).find(|a| corners.iter().all(|p| p[*a] == corners[0][*a])).unwrap();
        2 * axis as u32 + u32::from(corners[0][axis] == hi[axis])
    };
    let face = (0..mesh.triangles.len()).map(side).collect();
    let mut labels = vec![FaceLabel::default(); 6];
    labels[4].name = "INLET".into();
    labels[5].color = "#ff0000".into();
    let file = "part.step".into();
    let cad = CadMesh { file, mesh: mesh.clone(), face, labels, chord: 0.1, angle: 15.0, volume: None };
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).unwrap().of_cad(cad))
}

fn set(part: &Region, names: &[&str]) -> Result<FaceSet, Fault> {
    FaceSet::new(Some(part), &names.iter().map(|n| n.to_string()).collect::<Vec<_>>())
}

#[test]
fn near_a_face_is_a_rounded_plate() {
    let (lo, hi) = ([-0.9, -0.7, -0.4], [0.8, 1.0, 0.9]);
    let part = part(lo, hi);
    let near = NearFaces { set: set(&part, &["INLET"]).unwrap(), within: 0.3 };
    check_shape("faces", &near, 2.0, 1.0);
    // The nearest point of the rectangle.
    for p in [[0.1_f64, 0.2, 0.5], [1.5, 0.0, -1.0], [-2.0, 2.0, -0.4], [0.0, 0.0, -0.4]] {
        let foot = [p[0].clamp(lo[0], hi[0]), p[1].clamp(lo[1], hi[1]), lo[2]];
        assert!((near.value(p) - (norm(sub(p, foot)) - 0.3)).abs() < 1e-14, "{p:?}");
    }
}

#[test]
fn faces_go_by_name_colour_and_number() {
    let part = part([-1.0; 3], [1.0; 3]);
    let at = |names: &[&str]| set(&part, names).unwrap().bounds;
    let plane = |z: f64| Aabb { min: [-1.0, -1.0, z], max: [1.0, 1.0, z] };
    assert_eq!(at(&["INLET"]), plane(-1.0));
    assert_eq!(at(&["5"]), plane(-1.0));
    assert_eq!(at(&["#FF0000"]), plane(1.0));
    assert_eq!(at(&["INLET", "6"]), Aabb { min: [-1.0; 3], max: [1.0; 3] });
    // Through unions and offsets too.
    let both: Region = Arc::new(crate::region::Union::new(vec![part.clone(), part.clone()]).unwrap());
    let grown: Region = Arc::new(crate::region::Offset::new(both, 0.1).unwrap());
    assert_eq!(set(&grown, &["INLET"]).unwrap().bounds, plane(-1.0));
}

#[test]
fn names_of_no_face_are_refused_with_the_nearest() {
    let part = part([-1.0; 3], [1.0; 3]);
    let fault = set(&part, &["INLET", "INLT"]).unwrap_err();
    assert_eq!(fault.at, "[1]");
    assert!(fault.message.contains("did you mean \"INLET\"?") && fault.message.contains("1 to 6"), "{}", fault.message);
    assert_eq!(set(&part, &["7"]).unwrap_err().at, "[0]");
    let plain: Region = Arc::new(crate::region::Cuboid::new([-1.0; 3], [1.0; 3]).unwrap());
    assert!(set(&plain, &["INLET"]).unwrap_err().message.contains("STEP"));
}

#[test]
fn a_part_without_a_face_is_one_without_its_plane() {
    let (lo, hi) = ([-0.9, -0.7, -0.4], [0.8, 1.0, 0.9]);
    let part = part(lo, hi);
    let plane = HalfSpace::new(lo, [0.0, 0.0, -1.0]).unwrap();
    let by_plane = part.clone().opened(&[plane.into()], &mut [false]).unwrap();
    let mut found = [false; 2];
    // The second name is another's, so that both are missing.
    let cuts = [OpenSurface::Faces(set(&part, &["INLET"]).unwrap()), OpenSurface::Faces(set(&part, &["5"]).unwrap())];
    let by_name = part.clone().opened(&cuts, &mut found).unwrap();
    assert_eq!(found, [true, false]);
    let mut seed = 3;
    for _ in 0..4000 {
        let p = [0; 3].map(|_| 1.5 * random(&mut seed));
        let beyond = p[2] < lo[2] && (0..2).any(|a| p[a] < lo[a] || p[a] > hi[a]);
        // They part outside, beyond the edges of the face, where no solid is.
        if !beyond {
            assert_eq!(by_name.value(p), by_plane.value(p), "{p:?}");
        }
        let b = Aabb { min: p, max: add(p, [0.2, 0.1, 0.3]) };
        let range = by_name.bound(&b);
        let q = add(p, [0.05, 0.09, 0.2]);
        assert!(range.lo <= by_name.value(q) && by_name.value(q) <= range.hi, "{p:?}");
    }
}

/// Faces of a part that is turned, mirrored and scaled lie where it does: what is near them is the image of what was, and they open.
#[test]
fn faces_move_along_with_their_part() {
    let mut turn = geometry::math::rotation([30.0, 40.0, 50.0]);
    turn[1] = scale(turn[1], -1.0);
    let by = Similarity::new(2.0, turn, [0.1, 0.2, 0.3], [1.0, 0.0, -1.0]);
    let own = part([-0.9, -0.7, -0.4], [0.8, 1.0, 0.9]);
    let moved = own.clone().moved(&by).unwrap();
    let near = |part: &Region, within: f64| Arc::new(NearFaces { set: set(part, &["INLET"]).unwrap(), within });
    let (image, again) = (near(&own, 0.3).moved(&by).unwrap(), near(&moved, 0.6));
    let mut seed = 8;
    for _ in 0..500 {
        let p = [0; 3].map(|_| 4.0 * random(&mut seed));
        assert!((image.value(p) - again.value(p)).abs() < 1e-13);
    }
    let mut found = [false];
    let open = OpenSurface::Faces(set(&moved, &["INLET"]).unwrap());
    let opened = moved.clone().opened(&[open], &mut found).unwrap();
    assert!(found[0]);
    // On the face the rest of the surface is the nearest.
    let middle = by.point([0.0, 0.1, -0.4]);
    assert!(moved.value(middle).abs() < 1e-13 && (opened.value(middle) + 2.0 * 0.8).abs() < 1e-13);
}
