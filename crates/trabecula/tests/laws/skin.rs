//! Skin, openings and keep zones: volumes in closed form, membership by logic of its own, the mesh's guarantees.

use std::f64::consts::PI;
use std::sync::Arc;

use geometry::math::{Aabb, Interval, Vec3, norm, sub};
use geometry::mesh::Mesh;
use geometry::progress::Silent;
use geometry::repair::Repair;
use proptest::prelude::*;
use trabecula::cell::Part;
use trabecula::csg_tree::CsgSolid;
use trabecula::extract::{surface, voxels};
use trabecula::field::Field;
use trabecula::grade::{Formula, Grade, Linear};
use trabecula::implicit::Implicit;
use trabecula::region::{
    Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Offset, OpenSurface, Region, Union,
};
use trabecula::skin::{outside, skin};
use trabecula::solid::Solid;

use crate::common::{ball, cases, check, check_both, cuboid, drawn, lattice};

/// A lattice with nothing solid.
struct Nothing;

impl Implicit for Nothing {
    fn lipschitz(&self) -> f64 {
        1.0
    }
}

impl Field for Nothing {
    fn values(&self, _: &[Vec3], out: &mut [f64]) {
        out.fill(1.0);
    }
    fn gradients(&self, _: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        values.fill(1.0);
        gradients.fill([0.0; 3]);
    }
    fn bound(&self, _: &Aabb) -> Interval {
        Interval::new(1.0, 1.0)
    }
}

fn gyroid(fraction: f64, wavelength: f64) -> Arc<dyn Implicit> {
    lattice("gyroid", Part::Sheet, fraction, [wavelength; 3], [0.0; 3])
}

fn cylinder(base: Vec3, radius: f64, height: f64) -> Region {
    Arc::new(Cylinder::new(base, [0.0, 0.0, 1.0], radius, height).expect("cylinder"))
}

fn difference(a: Region, b: Region) -> Region {
    Arc::new(Difference::new(vec![a, b]).expect("difference"))
}

fn half(point: Vec3, normal: Vec3) -> HalfSpace {
    HalfSpace::new(point, normal).expect("half-space")
}

fn cuts(planes: &[HalfSpace]) -> Vec<OpenSurface> {
    planes.iter().map(|p| OpenSurface::Plane(*p)).collect()
}

fn zone(region: &Region) -> CsgSolid {
    let mut surfaces = Vec::new();
    let tree = region.clone().surfaces(0.0, &mut surfaces);
    CsgSolid { surfaces, tree }
}

fn filled(region: &Region, field: Arc<dyn Implicit>, filled: Vec<CsgSolid>) -> Solid {
    let solid = Solid::new(region.clone(), Some(field), 1.0);
    filled.into_iter().fold(solid, Solid::with)
}

/// The skin alone.
fn shell(region: &Region, thickness: &Grade, open: &[HalfSpace]) -> Solid {
    let skin = skin(region, thickness, &cuts(open)).expect("skin");
    filled(region, Arc::new(Nothing), vec![skin])
}

fn volume(solid: &Solid, edge: f64, what: &str) -> f64 {
    let s = surface(solid, edge, &Silent).expect("surface");
    check_both(what, solid, edge, &s);
    s.mesh.volume()
}

fn close(found: f64, want: f64, tolerance: f64, what: &str) {
    let error = found / want - 1.0;
    println!("{what}: {found} for {want}, error {error:.1e}");
    assert!(error.abs() < tolerance, "{what}: {found} for {want}");
}

/// Samples are single precision, which is what planes that are no planes of the grid feel.
const SINGLE: f64 = 2e-6;

#[test]
fn the_skin_of_a_box_is_the_box_less_the_inner_box() {
    let region = cuboid([0.0; 3], [10.0, 8.0, 6.0]);
    for (w, edge) in [(1.0, 0.25), (0.7, 0.31), (0.2, 0.5), (0.05, 0.3), (1.3, 0.4)] {
        let v = volume(&shell(&region, &Grade::Constant(w), &[]), edge, "box");
        let inner = (10.0 - 2.0 * w) * (8.0 - 2.0 * w) * (6.0 - 2.0 * w);
        close(v, 480.0 - inner, SINGLE * 480.0 / (480.0 - inner), "box");
    }
}

#[test]
fn an_open_face_has_no_skin_and_its_walls_are_full() {
    let region = cuboid([0.0; 3], [10.0, 8.0, 6.0]);
    let up = half([0.0, 0.0, 6.0], [0.0, 0.0, 1.0]);
    let down = half([3.0, 9.0, 0.0], [0.0, 0.0, -2.0]);
    for (open, depth) in [(vec![up], 5.0), (vec![up, down], 6.0)] {
        let solid = shell(&region, &Grade::Constant(1.0), &open);
        let s = surface(&solid, 0.3, &Silent).expect("surface");
        check("open box", &s);
        close(s.mesh.volume(), 480.0 - 8.0 * 6.0 * depth, SINGLE, "open box");
        // The rim is all there is of the open face: full thickness up to the end.
        let on_top = |i: &usize| s.mesh.corners(*i).iter().all(|p| p[2] == 6.0);
        let rim: f64 = (0..s.mesh.triangles.len()).filter(on_top).map(|i| area(&s.mesh, i)).sum();
        close(rim, 80.0 - 48.0, SINGLE, "rim");
    }
}

/// An opening in a curved part: a ball's skin without what a cylinder along an axis takes of it.
#[test]
fn an_opening_is_a_region_without_skin() {
    let hole = |r| cylinder([0.0, 0.0, -3.0], r, 6.0);
    // What the cylinder shares with a ball of radius a: 4/3 π (a³ − (a² − r²)^3/2).
    let shared = |a: f64, r: f64| 4.0 / 3.0 * PI * (a.powi(3) - (a * a - r * r).powf(1.5));
    for r in [0.35, 0.61] {
        let want = 4.0 / 3.0 * PI * (1.0 - 0.8f64.powi(3)) - (shared(1.0, r) - shared(0.8, r));
        let body = skin(&ball([0.0; 3], 1.0), &Grade::Constant(0.2), &[]).expect("skin");
        let solid = filled(&ball([0.0; 3], 1.0), Arc::new(Nothing), vec![outside(body, &hole(r))]);
        let errors = [16.0, 64.0].map(|n| (volume(&solid, 1.0 / n, "open ball") / want - 1.0).abs());
        println!("open ball: {errors:?}");
        // Second order or better: cylinders keep chords.
        assert!(errors[1] < 2e-4 && errors[0] / errors[1] > 4f64.powf(1.6), "{errors:?}");
    }
}

/// Openings whose sides lie in planes of the skin and of the region.
#[test]
fn openings_may_share_planes_with_the_skin() {
    let region = cuboid([0.0; 3], [10.0, 8.0, 6.0]);
    for depth in [1.0, 1.5] {
        let body = skin(&region, &Grade::Constant(1.0), &[]).expect("skin");
        let window = cuboid([3.0, 1.0, 6.0 - depth], [7.0, 8.0, 6.0]);
        let v = volume(&filled(&region, Arc::new(Nothing), vec![outside(body, &window)]), 0.25, "window");
        // Of the roof 4 by 7, and of the wall above the hollow's floor.
        let want = 480.0 - 8.0 * 6.0 * 4.0 - (4.0 * 6.0 + 4.0 * depth);
        // The window's edges, some 50 mm, keep chamfers within half a cell's section.
        close(v, want, 0.5 * 0.25f64.powi(2) * 50.0 / want, "window");
    }
}

fn area(mesh: &Mesh, i: usize) -> f64 {
    let [a, b, c] = mesh.corners(i);
    norm(geometry::math::cross(sub(b, a), sub(c, a))) / 2.0
}

#[test]
fn the_lattice_shows_on_the_open_face_alone() {
    let region = cuboid([0.0; 3], [8.0; 3]);
    let open = [half([0.0, 0.0, 8.0], [0.0, 0.0, 1.0])];
    let body = skin(&region, &Grade::Constant(0.5), &cuts(&open)).expect("skin");
    let s = surface(&filled(&region, gyroid(0.3, 4.0), vec![body]), 0.125, &Silent).expect("surface");
    check("open lattice", &s);
    let on = |axis: usize, at: f64| -> f64 {
        let flat = |i: &usize| s.mesh.corners(*i).iter().all(|p| p[axis] == at);
        let cut = (0..s.mesh.triangles.len()).filter(|i| s.cut[*i]);
        cut.filter(flat).map(|i| area(&s.mesh, i)).sum()
    };
    for (axis, at) in [(0, 0.0), (0, 8.0), (1, 0.0), (1, 8.0), (2, 0.0)] {
        close(on(axis, at), 64.0, SINGLE, "closed face");
    }
    // On the open one: the rim, and the gyroid's section, some 30 % of the rest.
    let top = on(2, 8.0) - (64.0 - 49.0);
    assert!((0.2 * 49.0..0.45 * 49.0).contains(&top), "{top}");
    // All that is cut lies on the region's surface.
    let cut = (0..s.mesh.triangles.len()).filter(|i| s.cut[*i]);
    let all: f64 = cut.map(|i| area(&s.mesh, i)).sum();
    close(all, 5.0 * 64.0 + 15.0 + top, SINGLE, "area cut");
}

#[test]
fn the_skin_of_a_ball_converges() {
    let want = 4.0 / 3.0 * PI * (1.0 - 0.8f64.powi(3));
    let errors = [8.0, 16.0, 32.0, 64.0].map(|n| {
        let v = volume(&shell(&ball([0.0; 3], 1.0), &Grade::Constant(0.2), &[]), 1.0 / n, "ball");
        (v / want - 1.0).abs()
    });
    println!("ball: {errors:?}");
    // As for the ball itself: third order or better.
    assert!(errors[0] / errors[3] > 2f64.powf(3.0 * 2.8), "{errors:?}");
}

#[test]
fn a_thickness_that_varies_is_met() {
    // Wedges: the inner planes of a box lean where the thickness is linear along x.
    let region = cuboid([0.0; 3], [10.0, 8.0, 6.0]);
    let stops = vec![[0.0, 0.5], [10.0, 1.5]];
    let w = Grade::from(Linear::new([1.0, 0.0, 0.0], stops).expect("grade"));
    // From x = w(x) to 10 - w(x): x0 = 0.5 / 0.9, x1 = 9.5 / 1.1; the section is (8 - 2w)(6 - 2w).
    let (x0, x1) = (0.5 / 0.9, 9.5 / 1.1);
    let whole = |x: f64| 35.0 * x - 1.2 * x * x + 0.04 / 3.0 * x * x * x;
    let inner = whole(x1) - whole(x0);
    let v = volume(&shell(&region, &w, &[]), 0.25, "graded box");
    close(v, 480.0 - inner, 1e-4, "graded box");
    let open = [half([10.0, 0.0, 0.0], [1.0, 0.0, 0.0])];
    let v = volume(&shell(&region, &w, &open), 0.25, "graded open box");
    close(v, 480.0 - (whole(10.0) - whole(x0)), 1e-4, "graded open box");
    // (The faces are moved by hairs of 1e-6 of the size.) A constant, said as a formula.
    let constant = Grade::from(Formula::parse("0.2 + 0*x").expect("formula"));
    let ball = |w: &Grade| volume(&shell(&ball([0.0; 3], 1.0), w, &[]), 0.05, "ball");
    close(ball(&constant), ball(&Grade::Constant(0.2)), 1e-4, "formula");
}

#[test]
fn a_hole_gets_a_wall_of_its_own() {
    let region = difference(cuboid([0.0; 3], [12.0, 12.0, 6.0]), cylinder([6.0, 6.0, -1.0], 2.0, 8.0));
    let hollow = |w: f64, depth: f64| {
        let side = 12.0 - 2.0 * w;
        (side * side - PI * (2.0 + w) * (2.0 + w)) * depth
    };
    let full = 144.0 * 6.0 - PI * 4.0 * 6.0;
    for (open, depth) in [(vec![], 4.0), (vec![half([0.0, 0.0, 6.0], [0.0, 0.0, 1.0])], 5.0)] {
        let v = volume(&shell(&region, &Grade::Constant(1.0), &open), 0.2, "hole");
        // Round faces: rims are polygons, short by (h/r)²/6 of their circle.
        close(v, full - hollow(1.0, depth), 2e-3, "hole");
    }
}

#[test]
fn slanted_faces_open_too() {
    // The lower half of a ball, its flat face slanted.
    let n = [0.3, -0.2, 1.0];
    let flat = Arc::new(half([0.0; 3], n));
    let region: Region = Arc::new(Intersection::new(vec![ball([0.0; 3], 3.0), flat]).expect("half ball"));
    let solid = shell(&region, &Grade::Constant(0.5), &[half([0.0; 3], n)]);
    let v = volume(&solid, 0.1, "half ball");
    let want = 2.0 / 3.0 * PI * (27.0 - 2.5f64.powi(3));
    close(v, want, 2e-3, "half ball");
    // A cylinder along a slanted axis, its end open.
    let axis = [1.0, 2.0, 2.0];
    let leaning: Region = Arc::new(Cylinder::new([0.0; 3], axis, 2.0, 6.0).expect("cylinder"));
    let solid = shell(&leaning, &Grade::Constant(0.5), &[half([2.0, 4.0, 4.0], axis)]);
    let want = PI * (4.0 * 6.0 - 1.5 * 1.5 * 5.5);
    close(volume(&solid, 0.1, "cup"), want, 2e-3, "cup");
}

#[test]
fn openings_without_a_flat_face_are_refused() {
    let w = Grade::Constant(0.2);
    let at = |region: &Region, open: &[HalfSpace]| skin(region, &w, &cuts(open)).err().map(|f| f.at);
    let top = half([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    assert_eq!(at(&ball([0.0; 3], 1.0), &[top]).as_deref(), Some("open[0]"));
    let block = cuboid([-1.0; 3], [1.0; 3]);
    let inwards = half([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    assert_eq!(at(&block, &[top, inwards]).as_deref(), Some("open[1]"));
    let above = half([0.0, 0.0, 1.001], [0.0, 0.0, 1.0]);
    assert_eq!(at(&block, &[above]).as_deref(), Some("open[0]"));
    let rounded: Region = Arc::new(Offset::new(block.clone(), 0.5).expect("offset"));
    let top = half([0.0, 0.0, 1.5], [0.0, 0.0, 1.0]);
    assert_eq!(at(&rounded, &[top]).as_deref(), Some("open[0]"));
    let all: Vec<HalfSpace> = (0..6)
        .map(|i| {
            let mut n = [0.0; 3];
            n[i / 2] = [1.0, -1.0][i % 2];
            half(n, n)
        })
        .collect();
    assert_eq!(at(&block, &all).as_deref(), Some("open"));
}

#[test]
fn a_keep_zone_is_solid_and_nothing_else_is() {
    let region = cuboid([0.0; 3], [10.0; 3]);
    // A boss half outside: clipped. A second, inside the first's skin.
    let boss = cylinder([0.0, 5.0, 0.0], 2.0, 10.0);
    let alone = filled(&region, Arc::new(Nothing), vec![zone(&boss)]);
    close(volume(&alone, 0.2, "boss"), 20.0 * PI, 2e-3, "boss");
    let block = cuboid([3.0, 3.0, -5.0], [7.0, 7.0, 4.0]);
    let skin = skin(&region, &Grade::Constant(1.0), &[]).expect("skin");
    let both = filled(&region, Arc::new(Nothing), vec![skin, zone(&block)]);
    // The skin, and of the block what is above it.
    let want = 1000.0 - 512.0 + 16.0 * 3.0;
    close(volume(&both, 0.3, "skin and block"), want, SINGLE, "skin and block");
    // The sum is that of a union.
    let union: Region = Arc::new(Union::new(vec![block.clone(), cuboid([1.0; 3], [5.0; 3])]).expect("union"));
    let alone = filled(&region, Arc::new(Nothing), vec![zone(&union)]);
    let want = 16.0 * 4.0 + 64.0 - 2.0 * 2.0 * 3.0;
    close(volume(&alone, 0.3, "union"), want, SINGLE, "union");
}

#[test]
fn faces_that_coincide_do_no_harm() {
    let region: Region = cylinder([0.0; 3], 4.0, 6.0);
    let w = Grade::Constant(1.0);
    for (i, zone_) in [
        // Flush with the inside of the skin, with the region, with both, with a plane of the grid.
        cylinder([0.0, 0.0, 1.0], 3.0, 2.0),
        cylinder([0.0, 0.0, 0.0], 4.0, 3.0),
        cylinder([0.0, 0.0, 0.0], 3.0, 5.0),
        cuboid([-4.0, -4.0, 0.0], [0.0, 4.0, 5.0]),
        cuboid([-1.0, -1.0, 1.0], [1.0, 1.0, 5.0]),
        cuboid([-3.0, -0.5, 1.0], [3.0, 0.5, 5.0]),
    ]
    .iter()
    .enumerate()
    {
        for edge in [0.5, 1.0 / 3.0, 0.37] {
            let skin = skin(&region, &w, &[]).expect("skin");
            let solid = filled(&region, gyroid(0.2, 2.0), vec![skin, zone(zone_)]);
            let s = surface(&solid, edge, &Silent).expect("surface");
            check_both(&format!("flush zone {i}, edge {edge}"), &solid, edge, &s);
        }
    }
}

#[test]
fn a_mesh_region_has_the_skin_of_the_shape_it_is_of() {
    let region = cuboid([0.0; 3], [10.0, 8.0, 6.0]);
    let mesh = |r: &Region, edge| {
        let s = surface(&Solid::new(r.clone(), None, 1.0), edge, &Silent).expect("surface");
        Arc::new(MeshRegion::new(s.mesh, Repair::Refuse).expect("mesh")) as Region
    };
    let block = mesh(&region, 2.0);
    let w = Grade::Constant(1.0);
    let top = half([0.0, 0.0, 6.0], [0.0, 0.0, 1.0]);
    for (open, depth) in [(vec![], 4.0), (vec![top], 5.0)] {
        let solid = shell(&block, &w, &open);
        // A mesh has one face, so its edges and those of the hollow are blunt within a grid cell.
        let want = 480.0 - 8.0 * 6.0 * depth;
        close(volume(&solid, 0.15, "mesh box"), want, 3e-3, "mesh box");
        // Nothing as thick as the skin is left at the open face, and its neighbours are whole.
        let p = [[5.0, 4.0, 5.99], [0.5, 4.0, 5.99], [1.05, 4.0, 5.99], [5.0, 4.0, 0.5]];
        let solid = p.map(|p| solid.value(p) <= 0.0);
        assert_eq!(solid, [open.is_empty(), true, open.is_empty(), true]);
    }
    let round = mesh(&ball([0.0; 3], 2.0), 0.1);
    let want = 4.0 / 3.0 * PI * (8.0 - 1.5f64.powi(3));
    let v = volume(&shell(&round, &Grade::Constant(0.5), &[]), 0.1, "mesh ball");
    close(v, want, 5e-3, "mesh ball");
    // In combinations: the mesh's own face and the cut of another.
    let cut = Arc::new(half([5.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
    let region: Region = Arc::new(Intersection::new(vec![block, cut.clone()]).expect("intersection"));
    let solid = shell(&region, &w, &[top, *cut]);
    let want = 240.0 - 4.0 * 6.0 * 5.0;
    close(volume(&solid, 0.15, "cut mesh"), want, 3e-3, "cut mesh");
}

#[test]
fn open_meshes_keep_their_bounds_and_blocks() {
    let region = cuboid([0.0; 3], [4.0, 3.0, 2.0]);
    let s = surface(&Solid::new(region, None, 1.0), 0.9, &Silent).expect("surface");
    let region: Region = Arc::new(MeshRegion::new(s.mesh, Repair::Refuse).expect("mesh"));
    let cuts = [half([0.0, 0.0, 2.0], [0.0, 0.0, 1.0])];
    let open = region.opened(&cuts.map(OpenSurface::Plane), &mut [false]).expect("a flat face");
    let axes: Vec<f64> = (0..40).map(|i| -1.0 + 0.153 * f64::from(i)).collect();
    let block = trabecula::field::Block { axes: [&axes, &axes[..30], &axes[3..35]] };
    let mut filled = vec![0f32; block.len()];
    open.fill_level(&block, -0.5, &mut filled);
    let mut i = 0;
    for &z in block.axes[2] {
        for &y in block.axes[1] {
            for &x in block.axes[0] {
                let v = open.value([x, y, z]) + 0.5;
                let near = (f64::from(filled[i]) - v).abs() < 1e-6;
                assert!(near || (v.abs() > 0.265 && f64::from(filled[i]) * v > 0.0));
                let b = Aabb { min: [x, y, z], max: [x + 0.3, y + 0.2, z + 0.4] };
                let r = open.bound(&b);
                for q in [b.min, b.max, b.center(), [b.max[0], b.min[1], b.max[2]]] {
                    let v = open.value(q);
                    assert!(r.lo <= v && v <= r.hi, "{v} at {q:?} outside {r:?}");
                }
                i += 1;
            }
        }
    }
}

/// A region, what is inside of it by logic of its own, and its depth by formula: kinds shaped by three numbers.
type Depth = Box<dyn Fn(Vec3) -> f64>;

fn shape(kind: usize, r: f64, s: f64, t: f64) -> (Region, Depth) {
    let to_box =
        |a: Vec3, b: Vec3| move |p: Vec3| (0..3).fold(f64::INFINITY, |m, i| m.min(p[i] - a[i]).min(b[i] - p[i]));
    let (a, b) = ([-r, -1.0, -t], [t, r, 1.0]);
    match kind {
        0 => (cuboid(a, b), Box::new(to_box(a, b))),
        1 => (ball([0.0; 3], r), Box::new(move |p| r - norm(p))),
        2 => {
            let depth = move |p: Vec3| {
                let side = r * 0.7 - (p[0] - s).hypot(p[1] + s);
                side.min(p[2] + t).min(1.0 - p[2])
            };
            (cylinder([s, -s, -t], r * 0.7, 1.0 + t), Box::new(depth))
        }
        3 => {
            let hole = cylinder([s, s, -5.0], 0.2, 10.0);
            let outer = to_box(a, b);
            let depth = move |p: Vec3| outer(p).min((p[0] - s).hypot(p[1] - s) - 0.2);
            (difference(cuboid(a, b), hole), Box::new(depth))
        }
        _ => {
            let h = half([s, 0.0, 0.1], [s, 1.0, 0.5]);
            let depth = move |p: Vec3| (r - norm(p)).min(-h.value(p));
            let both = Intersection::new(vec![ball([0.0; 3], r), Arc::new(h)]).expect("intersection");
            (Arc::new(both), Box::new(depth))
        }
    }
}

/// 200 designs in `make campaign`.
#[test]
fn the_field_is_membership_by_set_logic() {
    let mut seed = 7u64;
    let mut random = || geometry::random::random(&mut seed);
    for n in 0..cases(40) as usize {
        let (r, s, t) = (1.0 + 0.5 * random(), 0.4 * random(), 0.6 + 0.4 * random());
        let (region, depth) = shape(n % 5, r, s, t);
        let (w, slope) = (0.2 + 0.1 * random(), 0.05 * random());
        let grade = match n % 2 {
            0 => Grade::Constant(w),
            _ => Grade::from(
                Linear::new([0.0, 1.0, 0.0], vec![[-9.0, w - 9.0 * slope], [9.0, w + 9.0 * slope]]).expect("grade"),
            ),
        };
        let slope = if n % 2 == 0 { 0.0 } else { slope };
        if n % 2 == 1 && w - 2.0 * slope.abs() < 0.05 {
            continue;
        }
        let Ok(skin) = skin(&region, &grade, &[]) else { panic!("skin {n}") };
        let keep = cylinder([0.2, 0.1, -0.5], 0.3, 0.6);
        let field = gyroid(0.3, 0.9);
        let solid = filled(&region, field.clone(), vec![skin, zone(&keep)]);
        let points: Vec<Vec3> = (0..400).map(|_| [0; 3].map(|_| 1.6 * random())).collect();
        let (mut v, mut again) = (vec![0.0; 400], vec![0.0; 400]);
        let mut g = vec![[0.0; 3]; 400];
        solid.values(&points, &mut v);
        solid.gradients(&points, &mut again, &mut g);
        assert_eq!(v, again);
        let mut smooth = 0;
        for ((p, v), g) in points.iter().zip(&v).zip(&g) {
            let (d, w) = (depth(*p), w + slope * p[1]);
            let in_keep = (p[0] - 0.2).hypot(p[1] - 0.1) <= 0.3 && (-0.5..=0.1).contains(&p[2]);
            let want = d >= 0.0 && (d <= w || in_keep || field.value(*p) <= 0.0);
            if d.abs() > 1e-9 && (d - w).abs() > 1e-9 {
                assert_eq!(*v <= 0.0, want, "{n} at {p:?}: {v}, depth {d}, skin {w}");
            }
            let h = 1e-5;
            let near = |a: usize, h: f64| {
                let mut q = *p;
                q[a] += h;
                solid.value(q)
            };
            let slope = [0, 1, 2].map(|a| (near(a, h) - near(a, -h)) / (2.0 * h));
            smooth += usize::from(norm(sub(slope, *g)) < 1e-2 * (1.0 + norm(*g)));
            let b = Aabb { min: *p, max: p.map(|x| x + 0.1) };
            let range = solid.bound(&b);
            let q = [0; 3].map(|_| 0.05 + 0.05 * random());
            let inside = solid.value([0, 1, 2].map(|a| p[a] + q[a]));
            assert!(range.lo <= inside && inside <= range.hi, "{n}");
        }
        assert!(smooth > 390, "{n}: gradients agree at {smooth} of 400");
        // Voxels see the same solid.
        if n < 10 {
            let grid = voxels(&solid, 0.11, &Silent).expect("voxels");
            for (i, full) in grid.solid.iter().enumerate() {
                let [nx, ny, _] = grid.shape;
                let at = [i % nx, i / nx % ny, i / nx / ny];
                let p = [0, 1, 2].map(|a| grid.origin[a] + (at[a] as f64 + 0.5) * grid.step);
                let v = solid.value(p);
                assert!(v.abs() < 1e-5 || (v <= 0.0) == (*full == 1), "{n}: {v}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(16) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any region, skin, opening, zone and lattice, however coarse the grid. 200 cases in `make campaign`.
    #[test]
    fn random_solids_keep_every_guarantee(
        kind in 0..5usize,
        numbers in (0.5..1.5f64, -0.4..0.4f64, 0.2..1.0f64),
        drawn in drawn(),
        edge in 0.04..0.3f64,
        thickness in (0.02..0.3f64, -0.1..0.1f64, any::<bool>()),
        open in any::<bool>(),
        boss in (0..5usize, 0.3..0.8f64, -0.3..0.3f64, 0.2..0.6f64, any::<bool>()),
    ) {
        let (region, _) = shape(kind, numbers.0, numbers.1, numbers.2);
        let what = format!("{kind} {numbers:?} {drawn:?} {edge} {thickness:?} {open} {boss:?}");
        let (w, slope, graded) = thickness;
        let grade = if graded {
            let stops = vec![[-1.6, (w - 1.6 * slope).max(0.01)], [1.6, (w + 1.6 * slope).max(0.01)]];
            Grade::from(Linear::new([0.3, 1.0, -0.2], stops).expect("grade"))
        } else {
            Grade::Constant(w)
        };
        let top = half([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
        let open: &[HalfSpace] = if open && [0, 2, 3].contains(&kind) { &[top] } else { &[] };
        let mut bodies = vec![skin(&region, &grade, &cuts(open)).expect("skin")];
        if boss.4 {
            bodies.push(zone(&shape(boss.0, boss.1, boss.2, boss.3).0));
        }
        let field = drawn.lattice();
        let solid = filled(&region, field, bodies);
        let s = surface(&solid, edge, &Silent).expect("surface");
        check_both(&what, &solid, edge, &s);
    }
}
