//! Regions of bodies that touch or coincide: closed meshes that do not cross themselves, of the right volume.

use std::sync::Arc;

use crate::common::{Random, cases, fault_of, lattice};
use geometry::math::{Mat3, Vec3, add, apply, rotation, scale};
use geometry::mesh::Mesh;
use geometry::progress::Silent;
use geometry::repair::Repair;
use rayon::prelude::*;
use trabecula::cell::Part;
use trabecula::extract::surface;
use trabecula::region::{Cuboid, Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Region, Sphere, Union};
use trabecula::solid::Solid;

/// Where bodies with corners on whole numbers are put.
struct Frame {
    unit: f64,
    turn: Mat3,
    turned: bool,
    by: Vec3,
}

impl Frame {
    fn place(&self, p: Vec3) -> Vec3 {
        add(apply(&self.turn, scale(p, self.unit)), self.by)
    }
}

fn number(some: &mut Random, from: usize, below: usize) -> f64 {
    (from + some.below(below - from)) as f64
}

/// A box as a mesh.
fn mesh_box(lo: Vec3, hi: Vec3, frame: &Frame) -> Region {
    let mut mesh = Mesh::cuboid(lo, hi);
    mesh.vertices.iter_mut().for_each(|v| *v = frame.place(*v));
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("mesh"))
}

/// A body on whole numbers between 0 and 4: a box (by its planes, or as a mesh), a cylinder, a ball.
fn body(some: &mut Random, frame: &Frame, kinds: usize) -> Region {
    let lo = [0; 3].map(|_| number(some, 0, 3));
    let hi = lo.map(|x| number(some, x as usize + 1, 5));
    match some.below(kinds) {
        0 | 2 if frame.turned => {
            let sides = (0..6).map(|i| {
                let (axis, up) = (i / 2, i % 2 == 1);
                let (mut normal, mut point) = ([0.0; 3], lo);
                normal[axis] = if up { 1.0 } else { -1.0 };
                if up {
                    point = hi;
                }
                let half = HalfSpace::new(frame.place(point), apply(&frame.turn, normal));
                Arc::new(half.expect("half-space")) as Region
            });
            let sides = Intersection::new(sides.collect()).expect("sides");
            // What half-spaces bound has no bounds of its own.
            let (a, b) = ([0, 1, 2].map(|k| lo[k]), hi);
            let middle = frame.place(scale(add(a, b), 0.5));
            let about = Sphere::new(middle, 8.0 * frame.unit).expect("ball");
            Arc::new(Intersection::new(vec![Arc::new(sides), Arc::new(about)]).expect("block"))
        }
        0 | 2 => Arc::new(Cuboid::new(frame.place(lo), frame.place(hi)).expect("box")),
        1 => mesh_box(lo, hi, frame),
        3 => {
            let axis = some.below(3);
            let mut way = [0.0; 3];
            way[axis] = 1.0;
            let mut base = lo.map(|x| x + 1.0);
            base[axis] = lo[axis];
            let radius = [0.5, 1.0, 2.0][some.below(3)] * frame.unit;
            let height = (hi[axis] - lo[axis]) * frame.unit;
            let way = apply(&frame.turn, way);
            Arc::new(Cylinder::new(frame.place(base), way, radius, height).expect("cylinder"))
        }
        _ => {
            let radius = [1.0, 1.5][some.below(2)] * frame.unit;
            Arc::new(Sphere::new(frame.place(lo.map(|x| x + 1.0)), radius).expect("ball"))
        }
    }
}

fn region(some: &mut Random, frame: &Frame, kinds: usize) -> Region {
    let mut all = body(some, frame, kinds);
    for _ in 0..1 + some.below(3) {
        let other = body(some, frame, kinds);
        let pair = vec![all, other];
        all = match some.below(5) {
            0 | 1 => Arc::new(Union::new(pair).expect("union")),
            2 | 3 => Arc::new(Difference::new(pair).expect("difference")),
            _ => Arc::new(Intersection::new(pair).expect("intersection")),
        };
    }
    all
}

/// The volume by the middles of cells of side 1/n.
fn count(region: &Region, frame: &Frame, n: usize) -> f64 {
    let (lo, side) = (-2.0, 1.0 / n as f64);
    let steps = 8 * n;
    let mut inside = 0;
    let mut out = vec![0.0; steps];
    for i in 0..steps {
        for j in 0..steps {
            let at = |i: usize| lo + (i as f64 + 0.5) * side;
            let row: Vec<Vec3> = (0..steps).map(|k| frame.place([at(k), at(j), at(i)])).collect();
            region.values(&row, &mut out);
            inside += out.iter().filter(|v| **v < 0.0).count();
        }
    }
    inside as f64 * (side * frame.unit).powi(3)
}

fn run(seed: u64) -> Result<bool, String> {
    let mut some = Random(seed);
    let turned = some.share() < 0.4;
    let frame = Frame {
        unit: some.between(0.3, 3.0),
        turn: rotation(if turned { some.point(180.0) } else { [0.0; 3] }),
        turned,
        by: some.point(3.0),
    };
    let kinds = [1, 2, 5][some.below(3)];
    let region = region(&mut some, &frame, kinds);
    let want = count(&region, &frame, if kinds < 5 { 1 } else { 6 });
    if want == 0.0 {
        return Ok(false);
    }
    let edge = frame.unit / some.between(2.2, 9.0);
    let wavelength = 1.7 * frame.unit;
    let filling =
        [None, Some(lattice("gyroid", Part::Sheet, some.between(0.2, 0.6), [wavelength; 3], [11.0, 22.0, 33.0]))];
    for field in filling {
        let full = field.is_none();
        let solid = Solid::new(region.clone(), field, wavelength);
        let s = surface(&solid, edge, &Silent).map_err(|e| format!("edge {edge}: {e:?}"))?;
        if let Some(fault) = fault_of(&solid, edge, &s) {
            return Err(format!("full {full}, edge {edge}: {fault}"));
        }
        if !full {
            continue;
        }
        let (volume, area) = (s.mesh.volume(), s.mesh.area());
        // The bounds of the balls that bound turned boxes.
        let size = 16.0 * 3f64.sqrt() * frame.unit;
        let slack = match kinds {
            // Flat faces keep a few 1/4096 of a step away from nodes; at most twenty are moved, each farther.
            1 => area * (1e-3 * edge + 20.0 * 1e-5 * size),
            // Faces of a mesh meet in edges that the grid rounds off, over a step.
            2 => 6.0 * 0.2 * edge * edge * area.sqrt(),
            // Cells are counted that the surface passes through.
            _ => 0.06 * area * frame.unit + 6.0 * 0.2 * edge * edge * area.sqrt(),
        };
        if (volume - want).abs() > slack {
            return Err(format!("edge {edge}: volume {volume}, not {want} within {slack}"));
        }
    }
    Ok(true)
}

/// 2000 cases in `make campaign`.
#[test]
fn random_bodies_that_touch_or_coincide() {
    let all: Vec<_> = (0..cases(16)).into_par_iter().map(run).collect();
    let solids = all.iter().filter(|r| matches!(r, Ok(true))).count();
    let faults: Vec<String> =
        all.iter().enumerate().filter_map(|(seed, r)| Some(format!("{seed}: {}", r.as_ref().err()?))).collect();
    println!("{} regions, {solids} of them with volume, {} wrong", all.len(), faults.len());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(solids > all.len() / 2);
}

/// Faces of meshes that have little in common: one looked at in a hundred places was not seen to.
#[test]
fn meshes_with_small_common_faces() {
    let frame = Frame {
        unit: 1.3857687042485702,
        turn: rotation([0.0; 3]),
        turned: false,
        by: [0.16338187015910233, -1.4701313338543425, 0.9611694878340291],
    };
    let long = mesh_box([0.0; 3], [4.0, 2.0, 2.0], &frame);
    let notch = mesh_box([0.0, 1.0, 1.0], [2.0, 3.0, 3.0], &frame);
    let left = Arc::new(Difference::new(vec![long, notch]).expect("difference"));
    let [lo, hi] = [[2.0, 1.0, 2.0], [4.0, 2.0, 4.0]].map(|p| frame.place(p));
    let post = Arc::new(Cuboid::new(lo, hi).expect("box"));
    let region: Region = Arc::new(Union::new(vec![left, post]).expect("union"));
    let solid = Solid::new(region, None, 1.0);
    for edge in [0.18595632115820984, 0.31, 0.11] {
        let s = surface(&solid, edge, &Silent).expect("surface");
        assert_eq!(fault_of(&solid, edge, &s), None, "edge {edge}");
    }
}
