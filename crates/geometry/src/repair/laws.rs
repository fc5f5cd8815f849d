//! Laws of repair: damaged meshes against the solids that they were.

use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;
use crate::distance::MeshDistance;
use crate::math::{Mat3, Vec3, apply, rotation};
use crate::mesh::samples::{icosphere, with};
use crate::random::random;

fn auto(mesh: Mesh) -> MeshDistance {
    MeshDistance::new(mesh, Repair::Auto).unwrap()
}

fn refused(mesh: Mesh, repair: Repair) -> String {
    MeshDistance::new(mesh, repair).unwrap_err().message
}

/// The signed distance of the unit ball.
fn ball(p: Vec3) -> f64 {
    norm(p) - 1.0
}

/// The signed distance of a box.
fn cuboid(lo: Vec3, hi: Vec3, p: Vec3) -> f64 {
    let beyond = [0, 1, 2].map(|a| (lo[a] - p[a]).max(p[a] - hi[a]));
    let deepest = beyond.into_iter().fold(f64::NEG_INFINITY, f64::max);
    norm(beyond.map(|d| d.max(0.0))) + deepest.min(0.0)
}

/// The signed distance of the cylinder of radius 1 about z from 0 to `height`.
fn cylinder(height: f64, p: Vec3) -> f64 {
    let (across, along) = (p[0].hypot(p[1]) - 1.0, (-p[2]).max(p[2] - height));
    across.max(0.0).hypot(along.max(0.0)) + across.max(along).min(0.0)
}

fn moved(mut mesh: Mesh, m: &Mat3, by: Vec3) -> Mesh {
    for v in &mut mesh.vertices {
        *v = add(apply(m, *v), by);
    }
    mesh
}

/// Every triangle with its own corners.
fn apart(mesh: &Mesh) -> Mesh {
    let corners = (0..mesh.triangles.len()).flat_map(|i| mesh.corners(i));
    Mesh {
        vertices: corners.collect(),
        triangles: (0..mesh.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    }
}

/// A torus about z of 2·n·m triangles.
fn torus(n: u32, m: u32, big: f64, small: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let [u, v] = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)].map(|t| t * 2.0 * PI);
            let r = big + small * v.cos();
            mesh.vertices.push([r * u.cos(), r * u.sin(), small * v.sin()]);
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Signs agree at random places farther than `margin` from the surface of `truth`, and the distance is 1-Lipschitz.
fn agrees(name: &str, region: &MeshDistance, truth: impl Fn(Vec3) -> f64, margin: f64, reach: f64) {
    let mut seed = 17;
    let mut last = ([0.0; 3], region.value([0.0; 3]));
    for _ in 0..4000 {
        let p = [0; 3].map(|_| random(&mut seed) * reach);
        let (d, t) = (region.value(p), truth(p));
        if t.abs() > margin {
            assert_eq!(d < 0.0, t < 0.0, "{name}: {d} for {t} at {p:?}");
        }
        assert!(
            (d - last.1).abs() <= norm(sub(p, last.0)) * (1.0 + 1e-9) + 1e-12,
            "{name}: {d} at {p:?} after {last:?}"
        );
        last = (p, d);
    }
}

/// The distance is continuous about `center`: 1-Lipschitz between near places.
fn continuous(name: &str, region: &MeshDistance, center: Vec3, reach: f64) {
    let mut seed = 23;
    for _ in 0..4000 {
        let p = add(center, [0; 3].map(|_| random(&mut seed) * reach));
        let q = add(p, [0; 3].map(|_| random(&mut seed) * reach * 0.05));
        let (a, b) = (region.value(p), region.value(q));
        assert!((a - b).abs() <= norm(sub(p, q)) * (1.0 + 1e-9) + 1e-12 * reach, "{name}: {a} at {p:?}, {b} at {q:?}");
    }
}

#[test]
fn holes_are_closed_and_nothing_jumps_across() {
    let whole = icosphere(3, 1.0, 0.0);
    let volume = whole.volume();
    let mut mesh = whole.clone();
    // Everything about the x axis within 15 degrees, and two lone triangles that touch in a corner.
    mesh.triangles.retain(|t| t.iter().any(|v| whole.vertices[*v as usize][0] < 0.96));
    let corner = mesh.triangles[0][0];
    let fan: Vec<usize> = (0..mesh.triangles.len()).filter(|i| mesh.triangles[*i].contains(&corner)).collect();
    mesh.triangles.remove(fan[3]);
    mesh.triangles.remove(fan[0]);
    let region = auto(mesh.clone());
    let done = region.repaired();
    assert!(done.holes == 3 && done.hole_share < 0.05, "{done:?}");
    let got = region.mesh().volume();
    // Flat caps would lose 5 ‰.
    assert!((got / volume - 1.0).abs() < 3e-4, "{got} for {volume}");
    agrees("hole", &region, ball, 0.05, 1.3);
    continuous("hole", &region, [0.97, 0.0, 0.0], 0.4);
    let said = refused(mesh, Repair::Refuse);
    assert!(said.contains("open edges"), "{said}");
}

#[test]
fn flat_holes_are_closed_flat() {
    // A long tube without its ends: caps make it the cylinder of its polygon.
    let n = 48;
    let mut mesh = Mesh::default();
    for i in 0..n {
        let u = 2.0 * PI * f64::from(i) / f64::from(n);
        mesh.vertices.extend([[u.cos(), u.sin(), 0.0], [u.cos(), u.sin(), 24.0]]);
        let (a, b, c, d) = (2 * i as u32, 2 * ((i + 1) % n) as u32, 2 * ((i + 1) % n) as u32 + 1, 2 * i as u32 + 1);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let region = auto(mesh);
    let polygon = 0.5 * f64::from(n) * (2.0 * PI / f64::from(n)).sin();
    assert!((region.mesh().volume() - 24.0 * polygon).abs() < 1e-10);
    assert_eq!(region.repaired().holes, 2);
    let used = region.mesh().triangles.iter().flatten();
    assert!(used.map(|v| region.mesh().vertices[*v as usize][2]).all(|z| z == 0.0 || z == 24.0));
    agrees("tube", &region, |p| cylinder(24.0, p), 0.01, 2.0);
}

#[test]
fn too_many_holes_are_refused_in_numbers() {
    let mut seed = 8;
    let soup = Mesh {
        vertices: (0..300).map(|_| [0; 3].map(|_| random(&mut seed))).collect(),
        triangles: (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    };
    // More caps are offered only where they make a solid.
    let said = refused(soup.clone(), Repair::Caps(0.2));
    assert!(said.contains("at most 20 %") && !said.contains("caps ="), "{said}");
    let said = refused(soup.clone(), Repair::Caps(1.0));
    assert!(said.contains("flat and bounds no solid") && !said.contains("0e0"), "{said}");
    let said = refused(soup, Repair::Auto);
    assert!(said.contains("100 holes") && said.contains("50.0 %") && said.contains("300 open edges"), "{said}");
    let mut lid = Mesh::cuboid([0.0; 3], [1.0; 3]);
    lid.triangles.truncate(10);
    assert!(refused(lid.clone(), Repair::Auto).contains("16.7 %"));
    assert!(refused(lid, Repair::Caps(0.1)).contains("allow more with caps = 0.2;"));
}

#[test]
fn turned_and_doubled_triangles_leave_the_mesh_as_it_was() {
    let whole = torus(40, 30, 2.0, 0.7);
    let mut mesh = whole.clone();
    for i in (0..mesh.triangles.len()).step_by(7) {
        mesh.triangles[i].swap(1, 2);
    }
    let region = auto(mesh.clone());
    assert_eq!(region.repaired().turned, mesh.triangles.len().div_ceil(7));
    let near = |v: f64| (v - whole.volume()).abs() < 1e-12;
    assert!(near(region.mesh().volume()));
    // All turned: one body inside out.
    let mut mesh = whole.clone();
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let region = auto(mesh);
    assert_eq!(region.repaired().bodies_turned, 1);
    assert_eq!(region.mesh(), &whole);
    // Some twice, some from both sides.
    let mut mesh = whole.clone();
    for i in 0..20 {
        let [a, b, c] = whole.triangles[11 * i];
        mesh.triangles.push(if i % 2 == 0 { [b, c, a] } else { [a, c, b] });
    }
    let region = auto(mesh);
    assert_eq!(region.repaired().duplicates, 20);
    assert!(near(region.mesh().volume()));
    // Everything from both sides.
    let mut mesh = whole.clone();
    mesh.triangles.extend(whole.triangles.iter().map(|[a, b, c]| [*a, *c, *b]));
    assert!(near(auto(mesh).mesh().volume()));
}

#[test]
fn cavities_are_kept_and_bodies_within_bodies_are_not() {
    let (big, small) = (|| icosphere(2, 2.0, 0.0), || icosphere(2, 1.0, 0.1));
    let hollow = with(big(), small(), true);
    let region = auto(hollow.clone());
    assert!(region.repaired().is_clean());
    assert_eq!(region.mesh(), &hollow);
    // The same inside out.
    let mut mesh = hollow.clone();
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let region = auto(mesh);
    assert_eq!((region.mesh(), region.repaired().bodies_turned), (&hollow, 2));
    let nested = auto(with(big(), small(), false));
    assert_eq!(nested.mesh().volume(), big().volume());
    assert_eq!(nested.repaired().inner, 320);
    // A ball in the cavity, turned as it likes.
    for out in [false, true] {
        let three = with(hollow.clone(), icosphere(1, 0.5, 0.0), out);
        let volume = hollow.volume() + icosphere(1, 0.5, 0.0).volume();
        let region = auto(three);
        assert!((region.mesh().volume() - volume).abs() < 1e-12);
        assert!(region.value([0.0; 3]) < 0.0 && region.value([0.7, 0.0, 0.0]) > 0.0);
    }
}

#[test]
fn overlapping_balls_are_united() {
    for n in [2, 4] {
        let turn = rotation([12.0, 34.0, 56.0]);
        let a = icosphere(n, 1.0, 0.0);
        let b = moved(icosphere(n, 1.0, 0.0), &turn, [1.1, 0.13, -0.2]);
        let (one, two) = (auto(a.clone()), auto(b.clone()));
        let region = auto(with(a, b, false));
        assert!(region.repaired().crossings > 20);
        // Outside, the distance is that to the nearer ball; signs are those of the union everywhere.
        let mut seed = 4;
        for _ in 0..4000 {
            let p = [0; 3].map(|_| random(&mut seed) * 1.8);
            let (d, u) = (region.value(p), one.value(p).min(two.value(p)));
            assert_eq!(d < 0.0, u < 0.0, "{p:?}: {d}, {u}");
            assert!(u < 0.0 || (d - u).abs() < 1e-9, "{p:?}: {d}, {u}");
            assert!(u > 0.0 || d <= u + 1e-9, "{p:?}: {d}, {u}");
        }
        continuous("balls", &region, [0.55, 0.0, 0.0], 1.5);
        // Two balls of radius 1 at distance d have the lens π(4 + d)(2 − d)²/12 in common; the polyhedra lack a
        // share of order h² of that.
        let d = norm([1.1, 0.13, -0.2]);
        let lens = PI * (4.0 + d) * (2.0 - d).powi(2) / 12.0;
        let ideal = 8.0 / 3.0 * PI - lens;
        let lacking = icosphere(n, 1.0, 0.0).volume() / (4.0 / 3.0 * PI);
        let got = region.mesh().volume() / (ideal * lacking);
        assert!((got - 1.0).abs() < 0.12 / 4f64.powi(n as i32), "{got}");
    }
}

/// The volume of a union of boxes, on the grid of their planes.
fn union_volume(boxes: &[(Vec3, Vec3)]) -> f64 {
    let cuts = [0, 1, 2].map(|a| {
        let mut v: Vec<f64> = boxes.iter().flat_map(|b| [b.0[a], b.1[a]]).collect();
        v.sort_by(f64::total_cmp);
        v
    });
    let mut volume = 0.0;
    for x in cuts[0].windows(2) {
        for y in cuts[1].windows(2) {
            for z in cuts[2].windows(2) {
                let c = [x, y, z].map(|w| (w[0] + w[1]) / 2.0);
                if boxes.iter().any(|b| (0..3).all(|a| b.0[a] < c[a] && c[a] < b.1[a])) {
                    volume += (x[1] - x[0]) * (y[1] - y[0]) * (z[1] - z[0]);
                }
            }
        }
    }
    volume
}

/// Boxes, perhaps flush, equal or touching, all turned alike so that flush faces are so but for rounding.
fn boxes_agree(boxes: &[(Vec3, Vec3)], turn: &Mat3) {
    let mut mesh = Mesh::default();
    for (lo, hi) in boxes {
        mesh = with(mesh, Mesh::cuboid(*lo, *hi), false);
    }
    let by = [0.3, -0.2, 0.1];
    let region = auto(moved(mesh, turn, by));
    let want = union_volume(boxes);
    let got = region.mesh().volume();
    assert!((got - want).abs() < 1e-8 * want, "{got} for {want}: {boxes:?}");
    let truth = |p| boxes.iter().map(|(lo, hi)| cuboid(*lo, *hi, p)).fold(f64::INFINITY, f64::min);
    let mut seed = 77;
    for _ in 0..1500 {
        let p = [0; 3].map(|_| random(&mut seed) * 3.0);
        let (t, d) = (truth(p), region.value(add(apply(turn, p), by)));
        if t > 1e-9 {
            assert!((d - t).abs() < 1e-8, "{d} for {t} at {p:?}: {boxes:?}");
        } else if t < -1e-9 {
            assert!(d <= t + 1e-8, "{d} for {t} at {p:?}: {boxes:?}");
        }
    }
    continuous("boxes", &region, by, 2.0);
}

#[test]
fn flush_equal_and_touching_boxes_are_united() {
    let unit = ([0.0; 3], [1.0; 3]);
    let turns = [[0.0; 3], [90.0, 0.0, 0.0], [11.0, 23.0, 37.0], [0.0, 45.0, 0.0]];
    for turn in turns.map(rotation) {
        for other in [
            ([0.0; 3], [1.0; 3]),
            ([0.5, 0.0, 0.0], [1.5, 1.0, 1.0]),
            ([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
            ([1.0, 0.25, 0.25], [2.0, 0.75, 0.75]),
            ([0.5, 0.5, 0.0], [1.5, 1.5, 1.0]),
            ([0.5; 3], [1.5; 3]),
            ([0.25, 0.25, 0.0], [0.75, 0.75, 0.5]),
            ([0.25, 0.25, -1.0], [0.75, 0.75, 2.0]),
            ([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]),
            ([1.0; 3], [2.0; 3]),
            ([0.0, 0.0, 1.0], [0.5, 0.5, 1.5]),
            ([0.0, 0.0, 0.5], [1.0, 1.0, 0.75]),
        ] {
            boxes_agree(&[unit, other], &turn);
        }
        boxes_agree(&[unit, unit, unit, ([0.0; 3], [2.0, 1.0, 1.0])], &turn);
    }
}

#[test]
fn seams_corners_on_sides_and_slivers_are_closed() {
    // Six faces of a cube, each with its own corners, off by a few ten-thousandths.
    let cube = Mesh::cuboid([0.0; 3], [1.0; 3]);
    let mut mesh = Mesh::default();
    let mut seed = 12;
    for pair in cube.triangles.chunks(2) {
        let by = [0; 3].map(|_| 1e-4 * random(&mut seed));
        let face = Mesh { vertices: cube.vertices.iter().map(|v| add(*v, by)).collect(), triangles: pair.to_vec() };
        mesh = with(mesh, face, seed % 3 == 0);
    }
    let region = auto(mesh);
    assert!((region.mesh().volume() - 1.0).abs() < 1e-3);
    assert_eq!(region.repaired().holes, 0, "{:?}", region.repaired());
    agrees("six faces", &region, |p| cuboid([0.0; 3], [1.0; 3], p), 1e-3, 1.5);

    // A corner on a side that its neighbour does not have.
    let mut mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
    mesh.vertices.push([0.5, 0.5, 0.0]); // on the diagonal of the lower face
    let [a, b, c] = mesh.triangles[0];
    assert_eq!([a, b, c], [0, 2, 3]);
    mesh.triangles[0] = [0, 2, 8];
    mesh.triangles.push([8, 2, 3]);
    let region = auto(mesh);
    assert_eq!((region.mesh().volume(), region.repaired().split), (1.0, 1));
    assert!(region.signed_by_normals());

    // The same a hair off: a hole as thin as the hair.
    let mut mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
    mesh.vertices.push([0.5, 0.5, 1e-5]);
    mesh.triangles[0] = [0, 2, 8];
    mesh.triangles.push([8, 2, 3]);
    let region = auto(mesh);
    assert_eq!(region.repaired().holes, 1);
    assert!((region.mesh().volume() - 1.0).abs() < 1e-5);
    agrees("hair", &region, |p| cuboid([0.0; 3], [1.0; 3], p), 1e-4, 1.5);
}

#[test]
fn noise_that_folds_the_surface_is_cut_out() {
    let mut mesh = icosphere(4, 1.0, 0.0);
    let mut seed = 31;
    // The edges are about 0.07 long.
    for v in &mut mesh.vertices {
        *v = add(*v, [0; 3].map(|_| 0.04 * random(&mut seed)));
    }
    let region = auto(mesh.clone());
    assert!(region.repaired().crossings > 50, "{:?}", region.repaired());
    assert!((region.mesh().volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 0.02);
    agrees("noise", &region, ball, 0.08, 1.3);
    continuous("noise", &region, [0.9, 0.0, 0.0], 0.2);
    // Torn apart as well.
    let torn = auto(apart(&mesh));
    assert!((torn.mesh().volume() - region.mesh().volume()).abs() < 1e-9);
}

#[test]
fn neither_order_nor_place_matters() {
    let damaged = || {
        let mut m = with(
            icosphere(3, 1.0, 0.0),
            moved(icosphere(3, 0.8, 0.1), &rotation([5.0, 8.0, 3.0]), [0.9, 0.2, 0.1]),
            false,
        );
        for i in 0..30 {
            m.triangles[40 * i].swap(0, 1);
        }
        for i in [700, 400, 15] {
            m.triangles.remove(i);
        }
        m
    };
    let one = auto(damaged());
    let mut other = damaged();
    other.triangles.reverse();
    let mid = other.triangles.len() / 3;
    other.triangles.rotate_left(mid);
    let other = auto(other);
    let turn = rotation([31.0, -17.0, 80.0]);
    let by = [3.0, -1.0, 2.0];
    let turned = auto(moved(damaged(), &turn, by));
    for r in [&other, &turned] {
        assert!((r.mesh().volume() - one.mesh().volume()).abs() < 1e-9);
        assert_eq!(r.repaired().holes, one.repaired().holes);
        assert_eq!(r.repaired().crossings, one.repaired().crossings);
    }
    let mut seed = 9;
    for _ in 0..2000 {
        let p = [0; 3].map(|_| random(&mut seed) * 1.8);
        let d = one.value(p);
        assert!((other.value(p) - d).abs() < 1e-9, "{p:?}");
        assert!((turned.value(add(apply(&turn, p), by)) - d).abs() < 1e-9, "{p:?}");
    }
}

#[test]
fn degenerate_and_stray_triangles_go() {
    let mut mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
    mesh.vertices.push([0.5, 0.0, 0.0]);
    mesh.triangles.extend([[0, 1, 8], [3, 3, 5]]);
    let region = auto(mesh);
    assert_eq!((region.mesh().volume(), region.repaired().degenerate), (1.0, 2));
    // A flat fin on a side of the box encloses nothing.
    let mut mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
    mesh.vertices.push([2.0, 0.5, 2.0]);
    mesh.triangles.extend([[7, 5, 8], [5, 7, 8]]);
    assert!((auto(mesh).mesh().volume() - 1.0).abs() < 1e-12);
    for bad in [f64::NAN, f64::INFINITY] {
        let mut mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
        mesh.vertices[3][1] = bad;
        assert!(refused(mesh, Repair::Auto).contains("vertex 3"));
    }
    let flat = Mesh::cuboid([0.0; 3], [1.0, 1.0, 1e-13]);
    assert!(refused(flat, Repair::Auto).contains("flat"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// Boxes on a coarse grid are often flush or equal; turned, they are so but for rounding.
    #[test]
    fn boxes_on_a_grid(
        corners in prop::collection::vec((prop::array::uniform3(0u8..5), prop::array::uniform3(1u8..4)), 2..6),
        angles in prop::array::uniform3(-90.0..90.0f64),
    ) {
        let boxes: Vec<(Vec3, Vec3)> = corners
            .iter()
            .map(|(lo, size)| {
                let lo = lo.map(|v| f64::from(v) * 0.3 - 1.0);
                (lo, [0, 1, 2].map(|a| lo[a] + f64::from(size[a]) * 0.3))
            })
            .collect();
        boxes_agree(&boxes, &rotation(angles));
        boxes_agree(&boxes, &rotation([0.0; 3]));
    }

    /// Whatever the triangles, there is a region or an error, and the region's distance does not jump.
    #[test]
    fn anything(
        vertices in prop::collection::vec(prop::array::uniform3(-3i8..4), 5..30),
        triangles in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 4..80),
        closed in any::<bool>(),
        angles in prop::array::uniform3(-90.0..90.0f64),
        turned in any::<bool>(),
    ) {
        let n = vertices.len();
        let mut mesh = Mesh {
            vertices: vertices.iter().map(|v| v.map(f64::from)).collect(),
            triangles: triangles.iter().map(|t| t.map(|i| i.index(n) as u32)).collect(),
        };
        if closed {
            // Tetrahedra on the triangles: bodies that cross at will.
            let faces = mesh.triangles.clone();
            mesh.triangles.clear();
            for (i, [a, b, c]) in faces.into_iter().enumerate().take(12) {
                let d = (i % n) as u32;
                mesh.triangles.extend([[a, b, c], [a, d, b], [b, d, c], [c, d, a]]);
            }
        }
        if turned {
            mesh = moved(mesh, &rotation(angles), [0.1, 0.2, 0.3]);
        }
        // What cannot be repaired is refused with its reason.
        if let Ok(region) = MeshDistance::new(mesh.clone(), Repair::Auto) {
            continuous("anything", &region, [0.0; 3], 3.5);
        }
        let _ = MeshDistance::new(mesh, Repair::Refuse);
    }
}
