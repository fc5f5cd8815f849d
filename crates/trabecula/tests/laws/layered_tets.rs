//! Layers of prisms along the surface of tetrahedral meshes.

use geometry::math::Vec3;
use geometry::tetmesh::TetMesh;
use trabecula::grade::Grade;
use trabecula::mesher::{Background, PrismLayers, background};
use trabecula::region::Region;

use crate::common::{Random, cases, cuboid, fault, region, within};

fn made(space: &Region, size: f64, layers: Option<PrismLayers>) -> Background {
    let inside = within(space, 5000, 4);
    background(space, &space.bounds(), &Grade::Constant(size), &inside, layers.as_ref()).expect("mesh")
}

fn layers(count: u32, height: f64, growth: f64, on: Option<Region>) -> PrismLayers {
    PrismLayers { ends: PrismLayers::ends(count, height, growth), on }
}

/// The triangles of the boundary by their corners, from the least on.
fn boundary(mesh: &TetMesh) -> Vec<[[u64; 3]; 3]> {
    let faces = mesh.boundary();
    let key = |p: Vec3| p.map(|v| (v + 0.0).to_bits());
    let mut all: Vec<[[u64; 3]; 3]> = (0..faces.triangles.len())
        .map(|i| {
            let mut corners = faces.corners(i).map(key);
            let first = (0..3).min_by_key(|k| corners[*k]).unwrap_or(0);
            corners.rotate_left(first);
            corners
        })
        .collect();
    all.sort_unstable();
    all
}

/// Conforming and positive, with one closed sheet around.
fn sound(what: &str, mesh: &TetMesh) {
    let (same, found) = mesh.clone().checked().unwrap_or_else(|f| panic!("{what}: {f}"));
    assert_eq!(&same, mesh, "{what}");
    assert_eq!((found.turned, found.pinched, found.unused), (false, 0, 0), "{what}");
    assert_eq!(fault(&mesh.boundary()), None, "{what}");
}

/// Layers all over a part leave its boundary as it is, to the bit, and fill what is behind it: one column of prisms over each triangle,
/// none of which is empty.
#[test]
fn layers_all_over_a_part_keep_its_boundary() {
    let mut some = Random(23);
    for i in 0..cases(7) as usize {
        let [r, s, t] = [0; 3].map(|_| some.between(0.8, 1.2));
        let space = region(i % 7, r, s, t);
        let size = some.between(0.15, 0.25);
        let count = 1 + (some.share() * 3.0) as u32;
        let height = some.between(0.1, 0.4) * size / f64::from(count);
        let what = format!("kind {} {r} {s} {t}, size {size}, {count} layers of {height}", i % 7);
        let plain = made(&space, size, None).mesh;
        let growth = some.between(0.5, 2.0);
        let layered = made(&space, size, Some(layers(count, height / growth.max(1.0), growth, None)));
        let mesh = &layered.mesh;
        sound(&what, mesh);
        assert!(boundary(&plain) == boundary(mesh), "{what}: another boundary");
        assert!((mesh.volume() / plain.volume() - 1.0).abs() < 1e-12, "{what}");
        let found = layered.layers.expect("layers");
        assert_eq!(found.prisms, count as usize * plain.boundary().triangles.len(), "{what}: {found:?}");
        assert!(found.least > 0.0 && found.mean <= 1.0, "{what}: {found:?}");
    }
}

/// On the face of a box layers are as high as asked for, and every tetrahedron down there lies between two of their ends: also at the
/// edges, where their nodes move along the adjacent faces.
#[test]
fn layers_on_a_face_of_a_box_are_of_their_heights() {
    let space = cuboid([0.0; 3], [4.0, 3.0, 2.0]);
    let top = cuboid([-1.0, -1.0, 1.9], [5.0, 4.0, 2.1]);
    let asked = layers(3, 0.15, 1.2, Some(top));
    let layered = made(&space, 0.7, Some(asked.clone()));
    let mesh = &layered.mesh;
    sound("box", mesh);
    let found = layered.layers.expect("layers");
    assert!((found.least, found.mean) == (1.0, 1.0), "{found:?}");
    assert!((mesh.volume() - 24.0).abs() < 1e-11, "{}", mesh.volume());
    let ends: Vec<f64> = core::iter::once(0.0).chain(asked.ends).map(|d| 2.0 - d).collect();
    let mut counts = vec![0; ends.len() - 1];
    for t in 0..mesh.tets.len() {
        let z = mesh.corners(t).map(|p| p[2]);
        let (lo, hi) = (z.into_iter().fold(f64::INFINITY, f64::min), z.into_iter().fold(f64::NEG_INFINITY, f64::max));
        // Nodes of a layer are off by the rounding of their equations and of the projection onto the adjacent faces.
        if hi > ends[ends.len() - 1] + 1e-9 {
            let k = (0..counts.len()).find(|k| hi < ends[*k] + 1e-9 && lo > ends[*k + 1] - 1e-9);
            counts[k.unwrap_or_else(|| panic!("{lo} to {hi} crosses {ends:?}"))] += 1;
        }
    }
    let faces = mesh.boundary();
    let on_top = (0..faces.triangles.len()).filter(|i| faces.corners(*i).iter().all(|p| p[2] == 2.0)).count();
    assert_eq!(counts, [3 * on_top; 3]);
    assert_eq!(found.prisms, 3 * on_top);
}

/// Where the choice ends within a face, layers taper to wedges: the mesh conforms, and its boundary is what it was. A choice of nothing
/// is refused, and layers that have no room are thinner.
#[test]
fn layers_taper_where_they_end_and_are_thinner_where_there_is_no_room() {
    let space = cuboid([0.0; 3], [4.0, 3.0, 2.0]);
    let part_of_top = cuboid([0.9, 0.9, 1.9], [3.1, 2.1, 2.1]);
    let plain = made(&space, 0.5, None).mesh;
    let layered = made(&space, 0.5, Some(layers(2, 0.1, 1.0, Some(part_of_top))));
    sound("taper", &layered.mesh);
    assert!(boundary(&plain) == boundary(&layered.mesh));
    let found = layered.layers.expect("layers");
    assert!(found.prisms > 0 && found.least == 1.0, "{found:?}");
    // Both faces of a plate that is thinner than the layers of both.
    let plate = cuboid([0.0; 3], [4.0, 3.0, 0.4]);
    let thin = made(&plate, 0.5, Some(layers(2, 0.15, 1.0, None)));
    sound("thin", &thin.mesh);
    let found = thin.layers.expect("layers");
    assert!(found.least < 0.7, "{found:?}");
    assert!((thin.mesh.volume() - 4.8).abs() < 1e-11);
    // Nothing is chosen, or a few triangles all of whose nodes are at the edge of the choice.
    let inside = within(&space, 500, 4);
    for (on, words) in
        [(cuboid([8.0; 3], [9.0; 3]), "no triangle"), (cuboid([1.8, 1.3, 1.9], [2.2, 1.7, 2.1]), "lie at its edge")]
    {
        let few = layers(1, 0.1, 1.0, Some(on));
        let refused =
            background(&space, &space.bounds(), &Grade::Constant(0.7), &inside, Some(&few)).expect_err("refused");
        assert!(refused.at == "layers.on" && refused.message.contains(words), "{refused}");
    }
}
