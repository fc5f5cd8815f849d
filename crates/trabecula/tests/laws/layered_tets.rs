//! Layers of prisms along the surface of tetrahedral meshes.

use std::sync::Arc;

use geometry::math::Vec3;
use geometry::tetmesh::TetMesh;
use trabecula::grade::Grade;
use trabecula::mesher::{Background, PrismLayers, background};
use trabecula::region::{Cylinder, Difference, Region, Union};

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

/// A cylinder, a tube, a box or a plate with two holes, and how thick it is.
fn with_edges(kind: usize, some: &mut Random) -> (Region, f64) {
    let rod = |base: Vec3, axis: Vec3, radius: f64, height: f64| -> Region {
        Arc::new(Cylinder::new(base, axis, radius, height).expect("cylinder"))
    };
    let less = |parts: Vec<Region>| -> Region { Arc::new(Difference::new(parts).expect("difference")) };
    let z = [0.0, 0.0, 1.0];
    match kind {
        0 => {
            let axis = [some.between(-1.0, 1.0), some.between(-1.0, 1.0), 1.0];
            (rod([0.1, 0.2, 0.3], axis, some.between(6.0, 9.0), some.between(8.0, 12.0)), 8.0)
        }
        1 => {
            let (hole, wall) = (some.between(4.0, 6.0), some.between(4.0, 6.0));
            let around = rod([0.0; 3], z, hole + wall, 12.0);
            (less(vec![around, rod([0.0, 0.0, -1.0], z, hole, 14.0)]), wall)
        }
        2 => (cuboid([0.0; 3], [0; 3].map(|_| some.between(8.0, 14.0))), 8.0),
        _ => {
            let (thick, hole) = (some.between(5.0, 8.0), some.between(3.0, 4.0));
            let holes = [[8.0, 7.0, -1.0], [20.0, 13.0, -1.0]].map(|at| rod(at, z, hole, thick + 2.0));
            (less([cuboid([0.0; 3], [28.0, 20.0, thick])].into_iter().chain(holes).collect()), thick)
        }
    }
}

/// At sharp edges columns are tilted and shortened until their tetrahedra have fair angles: no less than 0.4 of those of right prisms as high
/// as layers are asked to be, or of 15 degrees if these are less, and none above 172 degrees.
fn fair_layers(what: &str, space: &Region, size: f64, some: &mut Random) {
    let count = 1 + (some.share() * 3.0) as u32;
    let asked = layers(count, size * some.between(0.2, 0.6) / f64::from(count), some.between(1.0, 1.2), None);
    let height = asked.ends[0];
    let what = format!("{what}, size {size}, {count} layers of {height}");
    let plain = made(space, size, None).mesh;
    let layered = made(space, size, Some(asked));
    sound(&what, &layered.mesh);
    assert!((layered.mesh.volume() / plain.volume() - 1.0).abs() < 1e-12, "{what}");
    let found = layered.layers.expect("layers");
    assert_eq!(found.prisms, count as usize * plain.boundary().triangles.len(), "{what}: {found:?}");
    assert!(found.mean > 0.6 && found.mean <= 1.0 && found.least <= found.mean, "{what}: {found:?}");
    let angles = layered.mesh.quality().expect("tetrahedra").dihedral;
    let right = (height / size).atan().to_degrees().min(15.0);
    assert!(angles.min > 0.4 * right && angles.max < 172.0, "{what}: {} to {}", angles.min, angles.max);
}

#[test]
fn layers_of_parts_with_edges_have_no_flat_tetrahedra() {
    let mut some = Random(31);
    for i in 0..cases(8) as usize {
        let (space, thick) = with_edges(i % 4, &mut some);
        let size = thick * some.between(0.35, 0.5);
        fair_layers(&format!("kind {}", i % 4), &space, size, &mut some);
    }
}

/// A bracket of two boxes that have planes in common, on which nodes move as on any other, its dimensions, and a size for it.
fn bracket(some: &mut Random) -> (String, Region, f64) {
    let [thick, other] = [0; 2].map(|_| some.between(4.0, 8.0));
    let [w, d, h] = [0; 3].map(|_| some.between(15.0, 40.0));
    let legs = vec![cuboid([0.0; 3], [w, d, thick]), cuboid([0.0; 3], [other, d, h])];
    let space = Arc::new(Union::new(legs).expect("union"));
    (format!("{w} x {d} x {h}, {thick} and {other} thick"), space, thick * some.between(0.6, 1.2))
}

#[test]
fn layers_of_brackets_have_no_flat_tetrahedra() {
    let mut some = Random(37);
    for _ in 0..cases(6) {
        let (what, space, size) = bracket(&mut some);
        fair_layers(&what, &space, size, &mut some);
    }
}

/// Layers that are low against the size have angles as small as right prisms of their height have, or three quarters, and no obtuse ones
/// for that.
#[test]
fn low_layers_of_brackets_have_no_obtuse_angles() {
    let mut some = Random(59);
    for _ in 0..cases(8) {
        let (what, space, size) = bracket(&mut some);
        let height = size * some.between(0.1, 0.14);
        let layered = made(&space, size, Some(layers(2, height, 1.2, None)));
        let angles = layered.mesh.quality().expect("tetrahedra").dihedral;
        let right = (height / size).atan().to_degrees();
        println!("{what}: {:.1} to {:.1}, right prisms {right:.1}", angles.min, angles.max);
        assert!(angles.min > 0.7 * right && angles.max < 160.0, "{what}, size {size}, {height}: {angles:?}");
    }
}

/// A slanted rod, a tube or a plate with two holes, and its volume.
fn round_part(kind: usize, some: &mut Random) -> (Region, f64) {
    let rod = |base: Vec3, axis: Vec3, radius: f64, height: f64| -> Region {
        Arc::new(Cylinder::new(base, axis, radius, height).expect("cylinder"))
    };
    let less = |parts: Vec<Region>| -> Region { Arc::new(Difference::new(parts).expect("difference")) };
    let (z, pi) = ([0.0, 0.0, 1.0], std::f64::consts::PI);
    match kind {
        0 => {
            let axis = [some.between(-1.0, 1.0), some.between(-1.0, 1.0), 1.0];
            let (radius, height) = (some.between(5.0, 7.0), some.between(20.0, 30.0));
            (rod([0.1, 0.2, 0.3], axis, radius, height), pi * radius * radius * height)
        }
        1 => {
            let (hole, wall) = (some.between(5.0, 8.0), some.between(4.0, 6.0));
            let around = rod([0.0; 3], z, hole + wall, 12.0);
            let volume = 12.0 * pi * ((hole + wall).powi(2) - hole * hole);
            (less(vec![around, rod([0.0, 0.0, -1.0], z, hole, 14.0)]), volume)
        }
        _ => {
            let (thick, hole) = (some.between(5.0, 8.0), some.between(3.0, 4.0));
            let holes = [[9.0, 8.0, -1.0], [30.0, 16.0, -1.0]].map(|at| rod(at, z, hole, thick + 2.0));
            let volume = thick * (40.0 * 24.0 - 2.0 * pi * hole * hole);
            (less([cuboid([0.0; 3], [40.0, 24.0, thick])].into_iter().chain(holes).collect()), volume)
        }
    }
}

/// Layers move with the nodes of the boundary that balance its flat faces: the part's volume to 0.3 % at a fifteenth of its longest side,
/// and angles that are hardly worse.
#[test]
fn layers_of_curved_parts_have_their_volume() {
    let mut some = Random(43);
    for i in 0..cases(9) as usize {
        let (space, volume) = round_part(i % 3, &mut some);
        let size = space.bounds().size().into_iter().fold(0.0, f64::max) / 15.0;
        let count = 1 + (some.share() * 2.0) as u32;
        let height = size * some.between(0.2, 0.35) / f64::from(count);
        let what = format!("kind {}, size {size}, {count} layers of {height}", i % 3);
        let layered = made(&space, size, Some(layers(count, height, 1.0, None)));
        let balanced = TetMesh { nodes: layered.balanced, ..layered.mesh.clone() };
        sound(&what, &balanced);
        let [by_chords, by_faces] = [&layered.mesh, &balanced].map(|m| (m.volume() / volume - 1.0).abs());
        let [before, after] = [&layered.mesh, &balanced].map(|m| m.quality().expect("tetrahedra").dihedral);
        println!(
            "{what}: volume off {by_faces:.1e} of {by_chords:.1e}, least angle {:.1} of {:.1}",
            after.min, before.min
        );
        assert!(by_faces < 3e-3 && by_faces < 0.5 * by_chords, "{what}: {by_faces} of {by_chords}");
        assert!(after.min > 0.9 * before.min, "{what}: {} of {}", after.min, before.min);
    }
}
