//! Meshes united with other shapes and cut by them: every guarantee, and edges kept wherever the mesh makes the surface.

use std::collections::BTreeMap;
use std::sync::Arc;

use trabecula::cell::Part;
use trabecula::extract::{Silent, surface};
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::math::{Vec3, add, norm, sub};
use trabecula::region::{
    Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Region, Repair, Sphere, Union,
};
use trabecula::skin::skin;
use trabecula::solid::Solid;

use super::common::{Random, cases, cuboid, fault, lattice};
use super::crease::{angle, ball, block, creases, cylinder, moved, notched, star};

/// A random polyhedron about the origin.
fn polyhedron(some: &mut Random) -> Arc<MeshRegion> {
    let mut mesh = match some.below(7) {
        0 => block(
            some.between(0.6, 1.4),
            some.between(0.6, 1.4),
            some.between(0.4, 1.2),
        ),
        1 => angle(),
        2 => notched(),
        3 => star(3 + some.below(4) as u32),
        4 => cylinder(
            3 + some.below(10) as u32,
            some.between(0.5, 0.9),
            some.between(0.5, 1.2),
        ),
        5 => cylinder(200, some.between(0.5, 0.9), some.between(0.5, 1.2)),
        _ => {
            let mut rough = ball(1);
            for v in &mut rough.vertices {
                let by = 0.9 + 0.2 * some.share();
                *v = v.map(|x| 0.8 * by * x);
            }
            rough
        }
    };
    let center = mesh.bounds().center();
    for v in &mut mesh.vertices {
        *v = [0, 1, 2].map(|a| v[a] - center[a]);
    }
    let turn = if some.share() < 0.2 {
        [0.0; 3]
    } else {
        some.point(180.0)
    };
    let mesh = moved(mesh, turn, some.point(0.2));
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean"))
}

/// A shape of another kind that reaches into such a polyhedron.
fn other(some: &mut Random) -> (&'static str, Region) {
    let p = some.point(0.5);
    match some.below(6) {
        0 => {
            let size = [0; 3].map(|_| some.between(0.4, 1.3));
            ("box", cuboid(p, add(p, size)))
        }
        1 | 2 => {
            let axis = if some.share() < 0.3 {
                [0.0, 0.0, 1.0]
            } else {
                some.point(1.0)
            };
            let hole = Cylinder::new(
                add(p, axis.map(|x| -2.0 * x)),
                axis,
                some.between(0.08, 0.4),
                4.0,
            );
            ("cylinder", Arc::new(hole.expect("cylinder")))
        }
        3 => (
            "ball",
            Arc::new(Sphere::new(p, some.between(0.3, 0.8)).expect("ball")),
        ),
        4 => {
            let normal = if some.share() < 0.3 {
                [0.0, 0.0, 1.0]
            } else {
                some.point(1.0)
            };
            (
                "half",
                Arc::new(HalfSpace::new(p.map(|x| 0.5 * x), normal).expect("half-space")),
            )
        }
        _ => {
            let mut mesh = polyhedron(some);
            if some.share() < 0.5 {
                let turned = moved(mesh.mesh().clone(), some.point(30.0), p);
                mesh = Arc::new(MeshRegion::new(turned, Repair::Refuse).expect("clean"));
            }
            ("mesh", mesh)
        }
    }
}

/// The shares of samples of edges that are farther from the surface than a twentieth and a half of a step.
#[derive(Default)]
struct Tally {
    parts: usize,
    faults: usize,
    samples: usize,
    off: [usize; 2],
    worst: f64,
}

#[test]
fn combined_meshes_keep_every_guarantee_and_their_edges() {
    let first = std::env::var("TRABECULA_FIRST").ok();
    let first = first.and_then(|n| n.parse::<u64>().ok()).unwrap_or(0);
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut wrong = Vec::new();
    for case in first..first + cases(6) {
        let some = &mut Random(31 * case + 5);
        let mesh = polyhedron(some);
        let (mut kind, mut beside) = other(some);
        let way = some.below(4);
        if way == 0 && kind == "half" {
            (kind, beside) = ("box", cuboid([0.0; 3], [0.7, 0.9, 0.6]));
        }
        let way = if way == 3 && kind == "half" { 1 } else { way };
        let pair = |a: &Region, b: &Region| vec![a.clone(), b.clone()];
        let own = mesh.clone() as Region;
        let (verb, region): (_, Region) = match way {
            0 => (
                "union",
                Arc::new(Union::new(pair(&own, &beside)).expect("union")),
            ),
            1 => (
                "difference",
                Arc::new(Difference::new(pair(&own, &beside)).expect("cut")),
            ),
            2 => (
                "intersection",
                Arc::new(Intersection::new(pair(&own, &beside)).expect("cut")),
            ),
            _ => (
                "taken from",
                Arc::new(Difference::new(pair(&beside, &own)).expect("cut")),
            ),
        };
        // Where the mesh makes the surface.
        let shows = |p: Vec3, by: f64| match way {
            0 => beside.value(p) > by,
            1 => beside.value(p) > by,
            _ => beside.value(p) < -by,
        };
        let edge = some.between(0.03, 0.07);
        let inside = some.below(4);
        let gyroid = lattice("gyroid", Part::Sheet, 0.4, [0.5; 3], some.point(90.0));
        let diamond = lattice("diamond", Part::Lower, 0.4, [0.5; 3], some.point(90.0));
        let field = [None, Some(gyroid.clone()), Some(diamond), Some(gyroid)][inside].clone();
        let mut solid = Solid::new(region.clone(), field.clone(), 0.5);
        if inside == 3 {
            let thickness = Grade::Constant(edge * some.between(0.6, 3.0));
            let Ok(skin) = skin(&solid.region, &thickness, &[]) else {
                continue;
            };
            solid = solid.with(skin);
        }
        let Ok(s) = surface(&solid, edge, &Silent) else {
            continue;
        };
        let name = ["full", "gyroid", "diamond", "gyroid, skin"][inside];
        let tally = tallies.entry(format!("{verb} {kind}")).or_default();
        tally.parts += 1;
        if let Some(why) = fault(&s.mesh) {
            println!("case {case}: {verb} {kind}, {name}, {edge:.4}: {why}");
            wrong.push(case);
            tally.faults += 1;
            continue;
        }
        let found = MeshRegion::new(s.mesh, Repair::Auto).expect("a surface");
        for p in creases(mesh.mesh(), 30.0, edge / 4.0) {
            let within = field.as_ref().is_none_or(|f| f.value(p) <= -1e-9) || inside == 3;
            if within && shows(p, edge / 2.0) {
                let off = found.value(p).abs() / edge;
                tally.samples += 1;
                tally.off[0] += usize::from(off > 0.05);
                tally.off[1] += usize::from(off > 0.5);
                tally.worst = tally.worst.max(off);
                if off > 0.05 && std::env::var("TW").is_ok() {
                    let m = mesh.mesh();
                    let corner = m.vertices.iter().map(|v| norm(sub(*v, p))).fold(9.0, f64::min);
                    let lo = found.mesh();
                    let _ = lo;
                    println!("W {name} {verb} {kind} off {off:.3} corner {:.2} rel {:?}", corner / edge, p.map(|x| x / edge));
                }
            }
        }
    }
    let mut all = Tally::default();
    for (name, t) in &tallies {
        let share = |n: usize| 100.0 * n as f64 / t.samples.max(1) as f64;
        println!(
            "{name:22} {:4} parts, {} faults, {:7} samples, {:6.2} % off by 0.05, {:5.2} % by 0.5, worst {:.2}",
            t.parts,
            t.faults,
            t.samples,
            share(t.off[0]),
            share(t.off[1]),
            t.worst
        );
        all.samples += t.samples;
        all.off[0] += t.off[0];
    }
    println!(
        "all: {:.2} %",
        100.0 * all.off[0] as f64 / all.samples as f64
    );
    assert!(wrong.is_empty(), "{wrong:?}");
}
