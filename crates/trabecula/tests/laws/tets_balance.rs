//! Flat faces of tetrahedral meshes of regions balance about curved surfaces: the mesh has the part's volume.

use std::sync::Arc;

use crate::common::{Random, ball, cases, cuboid, rows, within};
use crate::tets::{angles, fit_of, inside, sound};
use geometry::math::{Vec3, dot, norm, scale};
use geometry::mesh::Mesh;
use geometry::repair::Repair;
use geometry::tetmesh::TetMesh;
use trabecula::grade::Grade;
use trabecula::mesher::background;
use trabecula::region::{Cylinder, Difference, MeshRegion, Region};

/// Parts with round holes and curved walls, and their volumes.
fn round_parts() -> Vec<(&'static str, Region, f64)> {
    let rod = |base: Vec3, axis: Vec3, radius: f64, height: f64| -> Region {
        Arc::new(Cylinder::new(base, axis, radius, height).expect("cylinder"))
    };
    let less = |parts: Vec<Region>| -> Region { Arc::new(Difference::new(parts).expect("difference")) };
    let z = [0.0, 0.0, 1.0];
    let plate = |at: &[[f64; 2]], radius: f64| {
        let holes = at.iter().map(|[x, y]| rod([*x, *y, -1.0], z, radius, 10.0));
        less([cuboid([0.0; 3], [60.0, 40.0, 8.0])].into_iter().chain(holes).collect())
    };
    let pi = std::f64::consts::PI;
    vec![
        ("plate with wide holes", plate(&[[18.0, 20.0], [44.0, 20.0]], 9.0), 19200.0 - 1296.0 * pi),
        ("slanted rod", rod([0.0; 3], [0.3, 0.2, 1.0], 6.0, 60.0), 2160.0 * pi),
        ("tube", less(vec![rod([0.0; 3], z, 15.0, 60.0), rod([0.0, 0.0, -1.0], z, 10.0, 62.0)]), 7500.0 * pi),
        ("ball", ball([0.1, 0.2, 0.3], 20.0), 32000.0 / 3.0 * pi),
        (
            "plate with bolt holes",
            plate(&[[8.0, 8.0], [52.0, 8.0], [8.0, 32.0], [52.0, 32.0]], 4.0),
            19200.0 - 512.0 * pi,
        ),
        ("cup", less(vec![rod([0.0; 3], z, 15.0, 40.0), rod([0.0, 0.0, 4.0], z, 11.0, 40.0)]), 4644.0 * pi),
    ]
}

/// Nodes shifted so that flat faces balance about the surface: the part's volume to a part in two thousand at a fifteenth of its longest
/// side, where that of chords is up to a twentieth off, and the part nearer to the mesh.
#[test]
fn flat_faces_balance_about_curved_surfaces() {
    for (what, space, volume) in rows(4, round_parts()) {
        let bounds = space.bounds();
        let size = bounds.size().into_iter().fold(0.0, f64::max) / 15.0;
        let made = background(&space, &bounds, &Grade::Constant(size), &inside(&*space, &bounds), None).expect("mesh");
        let balanced = TetMesh { nodes: made.balanced, ..made.mesh.clone() };
        sound(what, &balanced);
        angles(what, &balanced);
        let off = |mesh: &TetMesh| (mesh.volume() / volume - 1.0).abs();
        let [by_chords, by_faces] = [&made.mesh, &balanced].map(off);
        assert!(by_faces < 5e-4 && by_faces < by_chords, "{what}: {by_faces} of {by_chords}");
        let [chords, faces] = [&made.mesh, &balanced].map(|m| fit_of(m, &space, made.left_out).from_part);
        assert!(faces.p99 < size / 15.0, "{what}: {faces:?}");
        assert!(faces.p99 < 0.7 * chords.p99 && faces.max < 0.85 * chords.max, "{what}: {faces:?} of {chords:?}");
        println!("{what}: volume off {by_faces:.1e} of {by_chords:.1e}, p99 {:.3} of {:.3}", faces.p99, chords.p99);
    }
}

/// A ball of facets half a size wide with waves of two sizes: it turns by 10 to 40 degrees from facet to facet.
fn wavy_ball(some: &mut Random) -> Mesh {
    let (around, along) = (80u32, 40u32);
    let height = some.between(0.008, 0.014);
    let waves: [(Vec3, f64); 4] = core::array::from_fn(|_| {
        let k = some.point(1.0);
        (scale(k, some.between(14.0, 20.0) / norm(k)), some.between(0.0, 6.3))
    });
    let vertex = |j: u32, k: u32| {
        let share = |i: u32, of: u32| std::f64::consts::PI * f64::from(i) / f64::from(of);
        let (t, f) = (share(j, along), 2.0 * share(k, around));
        let p = [t.sin() * f.cos(), t.sin() * f.sin(), -t.cos()];
        scale(p, 1.0 + height * waves.iter().map(|(k, phase)| (dot(*k, p) + phase).sin()).sum::<f64>())
    };
    let between = (1..along).flat_map(|j| (0..around).map(move |k| (j, k)));
    let vertices: Vec<Vec3> =
        [(0, 0)].into_iter().chain(between).chain([(along, 0)]).map(|(j, k)| vertex(j, k)).collect();
    let last = vertices.len() as u32 - 1;
    let at = |j: u32, k: u32| 1 + (j - 1) * around + k % around;
    let ends = (0..around).flat_map(|k| [[0, at(1, k + 1), at(1, k)], [last, at(along - 1, k), at(along - 1, k + 1)]]);
    let middle = (1..along - 1)
        .flat_map(|j| (0..around).map(move |k| (j, k)))
        .flat_map(|(j, k)| [[at(j, k), at(j, k + 1), at(j + 1, k + 1)], [at(j, k), at(j + 1, k + 1), at(j + 1, k)]]);
    Mesh { vertices, triangles: ends.chain(middle).collect() }
}

/// Nodes on creases of a mesh that turns from facet to facet balance too: half of its nodes are on some.
#[test]
fn flat_faces_balance_about_details_finer_than_them() {
    let mut some = Random(53);
    for i in 0..cases(3) {
        let triangles = wavy_ball(&mut some);
        let volume = triangles.volume();
        let space: Region = Arc::new(MeshRegion::new(triangles, Repair::Refuse).expect("region"));
        let made = background(&space, &space.bounds(), &Grade::Constant(2.0 / 15.0), &within(&space, 3000, 4), None);
        let made = made.expect("mesh");
        let what = format!("wavy ball {i}");
        let balanced = TetMesh { nodes: made.balanced, ..made.mesh.clone() };
        sound(&what, &balanced);
        angles(&what, &balanced);
        let [by_chords, by_faces] = [&made.mesh, &balanced].map(|m| (m.volume() / volume - 1.0).abs());
        println!("{what}: volume off {by_faces:.1e} of {by_chords:.1e}");
        assert!(by_faces < 5e-4 && by_faces < 0.3 * by_chords, "{what}: {by_faces} of {by_chords}");
    }
}
