//! Pieces found while a surface is streamed are those of the whole mesh, and what is dropped leaves the rest as it was.

use std::io::Cursor;
use std::sync::Arc;

use geometry::formats::read_mesh;
use geometry::measure::size;
use geometry::mesh::Mesh;
use geometry::progress::{Progress, Silent, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use proptest::prelude::*;
use trabecula::cell::{Part, catalogue};
use trabecula::extract::{GridSurface, surface};
use trabecula::region::{Cuboid, Cylinder, Difference, Intersection, Region, Union};
use trabecula::solid::Solid;
use trabecula::surface_maker::{CRUMB, Components, DUST, Islands, SMALL, SurfaceMaker, SurfaceOptions};

use crate::common::{ball, cases, check, lattice, meshed, solid, stl, stream};

const WAVELENGTH: [f64; 3] = [1.0, 1.1, 0.9];

fn shell(center: [f64; 3], outer: f64, inner: f64) -> Region {
    let parts = vec![ball(center, outer), ball(center, inner)];
    Arc::new(Difference::new(parts).expect("shell"))
}

fn union(parts: Vec<Region>) -> Region {
    Arc::new(Union::new(parts).expect("union"))
}

/// Solid angle of a mesh about a point, in turns: 1 inside, 0 outside.
pub fn winding(mesh: &Mesh, triangles: &[usize], p: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let sum: f64 = triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners(t).map(|v| [0, 1, 2].map(|i| v[i] - p[i]));
            let [x, y, z] = [a, b, c].map(|v| dot(v, v).sqrt());
            let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
            let below = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y;
            2.0 * dot(a, cross).atan2(below)
        })
        .sum();
    sum / (4.0 * std::f64::consts::PI)
}

/// The volume of the largest piece less its cavities, by looking for what each cavity lies in.
fn largest(mesh: &Mesh) -> f64 {
    let mut root: Vec<usize> = (0..mesh.vertices.len()).collect();
    fn find(root: &mut [usize], v: usize) -> usize {
        let mut v = v;
        while root[v] != v {
            root[v] = root[root[v]];
            v = root[v];
        }
        v
    }
    for t in &mesh.triangles {
        let a = find(&mut root, t[0] as usize);
        for v in &t[1..] {
            let b = find(&mut root, *v as usize);
            root[b] = a;
        }
    }
    let mut bodies: std::collections::BTreeMap<usize, Vec<usize>> = Default::default();
    for (i, t) in mesh.triangles.iter().enumerate() {
        bodies.entry(find(&mut root, t[0] as usize)).or_default().push(i);
    }
    let bodies: Vec<Vec<usize>> = bodies.into_values().collect();
    let volume = |body: &Vec<usize>| {
        let part =
            Mesh { vertices: mesh.vertices.clone(), triangles: body.iter().map(|t| mesh.triangles[*t]).collect() };
        part.volume()
    };
    let volumes: Vec<f64> = bodies.iter().map(volume).collect();
    let mut net = volumes.clone();
    for (i, body) in bodies.iter().enumerate().filter(|(i, _)| volumes[*i] < 0.0) {
        let p = mesh.corners(body[0])[0];
        let holders = (0..bodies.len()).filter(|o| *o != i && volumes[*o] > 0.0 && winding(mesh, &bodies[*o], p) > 0.5);
        let owner = holders.min_by(|a, b| volumes[*a].total_cmp(&volumes[*b]));
        net[owner.expect("a cavity lies in a piece")] += volumes[i];
    }
    net.into_iter().fold(0.0, f64::max)
}

/// What is dropped by default: components at the region's boundary with less than eight grid cells' volume and a thousandth of the
/// largest one's, and dust; and voids of less than a grid cell are filled.
fn small(what: &str, solid: &Solid, edge: f64, all: &SurfaceMesh, found: &Components) {
    let (most, reported) = meshed(&GridSurface(solid), edge, Islands::DropSmall).expect("surface");
    check(what, &most);
    let left = size(&most.mesh);
    assert_eq!(
        (reported.count as usize, reported.cavities as usize, reported.euler),
        (left.pieces, left.cavities, left.euler),
        "{what}"
    );
    assert_eq!((reported.others, reported.count), (found.others, found.count - reported.dropped), "{what}");
    let cell = edge.powi(3);
    let limit = SMALL * reported.dropped.min(found.border) as f64 + DUST * reported.dropped as f64;
    assert!(reported.dropped_volume <= limit * cell, "{what}");
    assert!(reported.filled_volume <= CRUMB * reported.filled as f64 * cell && found.filled == 0, "{what}");
    let change = left.volume - all.mesh.volume();
    let wanted = reported.filled_volume - reported.dropped_volume;
    assert!((change - wanted).abs() < 1e-9 * left.volume, "{what}: {change} of {wanted}");
    let (bytes, summary) = stream(solid, edge, Islands::DropSmall).expect("stl");
    assert_eq!((summary.components, bytes), (reported, stl(&most)), "{what}: the two methods differ");
}

/// All that is promised of pieces, for one solid.
fn law(what: &str, solid: &Solid, edge: f64) -> Components {
    let (all, found) = meshed(&GridSurface(solid), edge, Islands::Keep).expect("surface");
    let measured = size(&all.mesh);
    let figures = |p: &Components| (p.count as usize, p.cavities as usize, p.euler);
    let of = |m: &geometry::measure::Size| (m.pieces, m.cavities, m.euler);
    assert_eq!(figures(&found), of(&measured), "{what}");
    assert_eq!((found.others + 1, found.dropped), (found.count, 0), "{what}");
    let best = largest(&all.mesh);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * measured.volume;
    assert!(near(found.largest, best), "{what}: {} for {best}", found.largest);
    assert!(near(found.largest + found.volume, measured.volume), "{what}");
    let (_, reported) = stream(solid, edge, Islands::Keep).expect("stl");
    assert_eq!(reported.components, found, "{what}");

    let (one, kept) = meshed(&GridSurface(solid), edge, Islands::Drop).expect("surface");
    check(what, &one);
    let left = size(&one.mesh);
    assert_eq!(figures(&kept), of(&left), "{what}");
    assert_eq!((left.pieces, kept.dropped), (1, found.others), "{what}");
    assert!(near(left.volume, best + kept.filled_volume), "{what}: {} for {best}", left.volume);
    assert_eq!(one.cut.len(), one.mesh.triangles.len());
    let (bytes, summary) = stream(solid, edge, Islands::Drop).expect("stl");
    assert_eq!(summary.components, kept, "{what}");
    assert_eq!(summary.triangles as usize, one.mesh.triangles.len());
    assert_eq!(bytes, stl(&one), "{what}: the two methods differ");
    assert!(near(summary.volume, left.volume), "{what}");

    small(what, solid, edge, &all, &found);
    match stream(solid, edge, Islands::Error) {
        Ok(_) => assert_eq!(found.count, 1, "{what}"),
        Err(Stopped::Refused(f)) => assert!(found.count > 1 && f.at == "islands", "{what}: {f}"),
        Err(e) => panic!("{what}: {e:?}"),
    }
    found
}

#[test]
fn a_cavity_stays_with_its_piece_and_a_ball_in_it_is_another() {
    // A hollow ball, a ball in its hollow that is hollow itself, and a ball beside them.
    let big = shell([0.0; 3], 1.0, 0.7);
    let small = shell([0.05, 0.0, 0.02], 0.5, 0.2);
    let beside = ball([2.0, 0.1, 0.0], 0.6);
    let ball_volume = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
    for (what, parts, want, volume) in [
        ("hollow", vec![big.clone()], (1, 1), ball_volume(1.0) - ball_volume(0.7)),
        ("nested", vec![big.clone(), small.clone()], (2, 2), ball_volume(1.0) - ball_volume(0.7)),
        ("beside", vec![beside.clone(), big, small], (3, 2), ball_volume(1.0) - ball_volume(0.7)),
        ("full is more", vec![shell([-1.0, 0.0, 0.0], 0.61, 0.3), beside], (2, 1), ball_volume(0.6)),
    ] {
        for edge in [0.1, 0.013] {
            if what != "nested" && edge < 0.1 {
                continue; // many tiles once are enough
            }
            let found = law(what, &solid(union(parts.clone()), None), edge);
            assert_eq!((found.count, found.cavities), want, "{what}");
            // A ball's volume at ten steps a radius.
            assert!((found.largest / volume - 1.0).abs() < 0.02, "{what}: {} for {volume}", found.largest);
        }
    }
}

#[test]
fn many_tiles_and_any_number_of_threads() {
    // 124 and 68 steps along each axis, three tiles and two: networks and the crumbs that the ball cuts off.
    let field = lattice("gyroid", Part::Upper, 0.25, WAVELENGTH, [5.0, 15.0, 25.0]);
    let sheet = lattice("diamond", Part::Sheet, 0.4, WAVELENGTH, [5.0, 15.0, 25.0]);
    for (field, edge) in [(field, 0.0275), (sheet, 0.05)] {
        let solid = solid(ball([0.0; 3], 1.7), Some(field));
        let found = law("ball over tiles", &solid, edge);
        assert!(found.border == found.others);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("pool").install(|| {
                let streamed = stream(&solid, edge, Islands::Drop).expect("stl");
                (streamed, meshed(&GridSurface(&solid), edge, Islands::Drop).expect("surface"))
            })
        };
        assert!(run(1) == run(3));
    }
}

#[test]
fn crumbs_and_islands_are_distinguished() {
    // Balls of |f| beyond the network's limit: those inside are islands, those that the box cuts are crumbs.
    let field = lattice("primitive", Part::Lower, 0.1, WAVELENGTH, [0.0; 3]);
    let region = Arc::new(Cuboid::new([0.3, 0.3, 0.3], [3.7, 3.7, 3.2]).expect("box"));
    let found = law("balls", &solid(region.clone(), Some(field.clone())), 0.05);
    let s = surface(&solid(region, Some(field)), 0.05, &Silent).expect("surface");
    assert_eq!(found.count as usize, size(&s.mesh).pieces);
    assert!(found.border > 0 && found.border < found.others, "{found:?}");
    let island = found.second.expect("several");
    assert!(island.volume > 0.0 && island.volume <= found.largest);
    assert!((0..3).all(|a| island.bounds[0][a] < island.bounds[1][a]));
}

#[test]
fn figures_are_those_of_the_file() {
    let field = lattice("gyroid", Part::Sheet, 0.2, WAVELENGTH, [10.0, 20.0, 30.0]);
    let solid = solid(ball([0.0; 3], 1.5), Some(field));
    for islands in [Islands::Keep, Islands::Drop] {
        let (bytes, summary) = stream(&solid, 0.04, islands).expect("stl");
        let read = size(&read_mesh(&bytes, "stl").expect("file").mesh);
        let reported = summary.components;
        assert_eq!(
            (reported.count as usize, reported.cavities as usize, reported.euler),
            (read.pieces, read.cavities, read.euler)
        );
        // Single precision.
        assert!((summary.volume / read.volume - 1.0).abs() < 1e-6);
        assert!(((summary.area_cut + summary.area_lattice) / read.area - 1.0).abs() < 1e-6);
    }
}

/// Stops at a share of the way; remembers how far the work was.
pub struct Until(pub f64, pub std::sync::Mutex<f64>);

impl Progress for Until {
    fn step(&self, done: u64, total: u64) -> bool {
        let share = done as f64 / total as f64;
        let mut last = self.1.lock().expect("no other");
        assert!(share >= *last && share <= 1.0, "{share} after {last}");
        *last = share;
        share <= self.0
    }
}

#[test]
fn progress_rises_to_the_end_and_stops_at_any_time() {
    let field = lattice("gyroid", Part::Upper, 0.15, WAVELENGTH, [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(field));
    for islands in [Islands::Keep, Islands::Drop] {
        // Within the tiles, while records move up, never.
        for stop in [0.3, 0.97, 2.0] {
            let until = Until(stop, Default::default());
            let mut out = Cursor::new(Vec::new());
            let done = GridSurface(&solid).stream_stl(&SurfaceOptions { resolution: 0.05, islands }, &mut out, &until);
            let last = *until.1.lock().expect("no other");
            match done {
                Ok(_) => assert!(last == 1.0 && stop > 1.0),
                Err(Stopped::Interrupted) => assert!(last > stop),
                Err(e) => panic!("{e:?}"),
            }
        }
    }
}

/// A region of one of five kinds, shaped by three numbers.
fn region(kind: usize, r: f64, s: f64, t: f64) -> Region {
    let block = || Arc::new(Cuboid::new([-r, -1.0, -t], [t, r, 1.0]).expect("box")) as Region;
    match kind {
        0 => block(),
        1 => ball([s, 0.1, 0.0], r),
        2 => Arc::new(Cylinder::new([s, -s, -t], [0.3, 0.2 + s, 1.0], r * 0.7, 1.0 + t).expect("it")),
        3 => union(vec![shell([s, 0.0, 0.0], r, 0.6 * r), ball([s, 0.1, 0.0], 0.3 * r)]),
        _ => Arc::new(Intersection::new(vec![block(), shell([0.0; 3], 1.2 * r, 0.5)]).expect("it")),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(14) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any cell, part, fraction, orientation and region, however coarse the grid. 200 cases in `make campaign`.
    #[test]
    fn random_solids_fall_into_their_pieces(
        kind in 0..5usize,
        shape in (0.5..1.5f64, -0.4..0.4f64, 0.2..1.0f64),
        cell in 0..10usize,
        part in prop::sample::select(vec![Part::Sheet, Part::Lower, Part::Upper]),
        fraction in prop::sample::select(vec![0.03, 0.08, 0.15, 0.4, 0.85, 0.92, 0.97]),
        rotate in prop::array::uniform3(-180.0..180.0f64),
        edge in 0.04..0.3f64,
    ) {
        let name = catalogue()[cell].name;
        let what = format!("{name} {part:?} {fraction} region {kind} {shape:?} edge {edge}");
        let field = lattice(name, part, fraction, WAVELENGTH, rotate);
        let solid = solid(region(kind, shape.0, shape.1, shape.2), Some(field));
        if !surface(&solid, edge, &Silent).is_ok_and(|s| s.mesh.volume() > 0.0) {
            return Ok(()); // thinner than the grid
        }
        law(&what, &solid, edge);
    }
}
