//! Meshes united with other shapes and cut by them: every guarantee, and edges kept wherever the mesh makes the surface.

use std::collections::{BTreeMap, HashSet};
use std::f64::consts::PI;
use std::sync::Arc;

use geometry::math::{Vec3, add, apply, cross, dot, norm, rotation, scale, sub, unit};
use geometry::progress::Silent;
use geometry::repair::Repair;
use trabecula::cell::Part;
use trabecula::csg_tree::CsgSolid;
use trabecula::extract::surface;
use trabecula::field::Field;
use trabecula::grade::{Depth, Grade};
use trabecula::implicit::Implicit;
use trabecula::region::{Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Offset, Region, Sphere, Union};
use trabecula::skin::skin;
use trabecula::solid::Solid;
use trabecula::surface_maker::Islands;

use super::common::{Random, cases, check, cuboid, fault_of, lattice, stl, stream};
use super::crease::{angle, ball, block, boxes, creases, cylinder, far, moved, notched, of, star};

/// A random polyhedron about the origin.
fn polyhedron(some: &mut Random) -> Arc<MeshRegion> {
    let mut mesh = match some.below(7) {
        0 => block(some.between(0.6, 1.4), some.between(0.6, 1.4), some.between(0.4, 1.2)),
        1 => angle(),
        2 => notched(),
        3 => star(3 + some.below(4) as u32),
        4 => cylinder(3 + some.below(10) as u32, some.between(0.5, 0.9), some.between(0.5, 1.2)),
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
    let turn = if some.share() < 0.2 { [0.0; 3] } else { some.point(180.0) };
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
            let axis = if some.share() < 0.3 { [0.0, 0.0, 1.0] } else { some.point(1.0) };
            let hole = Cylinder::new(add(p, axis.map(|x| -2.0 * x)), axis, some.between(0.08, 0.4), 4.0);
            ("cylinder", Arc::new(hole.expect("cylinder")))
        }
        3 => ("ball", Arc::new(Sphere::new(p, some.between(0.3, 0.8)).expect("ball"))),
        4 => {
            let normal = if some.share() < 0.3 { [0.0, 0.0, 1.0] } else { some.point(1.0) };
            ("half", Arc::new(HalfSpace::new(p.map(|x| 0.5 * x), normal).expect("half-space")))
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

/// A polyhedron with another shape, and what is in it.
struct Design {
    mesh: Arc<MeshRegion>,
    beside: Region,
    kind: &'static str,
    way: usize,
    region: Region,
    field: Option<Arc<dyn Implicit>>,
    skinned: bool,
    solid: Solid,
    edge: f64,
}

/// None where the skin is refused.
fn design(case: u64) -> Option<Design> {
    let some = &mut Random(31 * case + 5);
    let mesh = polyhedron(some);
    let (mut kind, mut beside) = other(some);
    let way = some.below(5);
    if way == 0 && kind == "half" {
        (kind, beside) = ("box", cuboid([0.0; 3], [0.7, 0.9, 0.6]));
    }
    let way = if way > 2 && kind == "half" { 1 } else { way };
    let own = mesh.clone() as Region;
    let (first, second) = if way == 3 { (beside.clone(), own.clone()) } else { (own.clone(), beside.clone()) };
    let pair = vec![first, second];
    let region: Region = match way {
        0 => Arc::new(Union::new(pair).expect("union")),
        1 | 3 => Arc::new(Difference::new(pair).expect("cut")),
        2 => Arc::new(Intersection::new(pair).expect("cut")),
        _ => own,
    };
    let edge = some.between(0.03, 0.07);
    let inside = some.below(4);
    let gyroid = lattice("gyroid", Part::Sheet, 0.4, [0.5; 3], some.point(90.0));
    let diamond = lattice("diamond", Part::Lower, 0.4, [0.5; 3], some.point(90.0));
    let field = [None, Some(gyroid.clone()), Some(diamond), Some(gyroid)][inside].clone();
    let mut solid = Solid::new(region.clone(), field.clone(), 0.5);
    if inside == 3 {
        let thickness = Grade::Constant(edge * some.between(0.6, 3.0));
        let skin = skin(&solid.region, &thickness, &[]).ok()?;
        solid = solid.with(skin);
    }
    if way == 4 {
        let mut surfaces = Vec::new();
        let tree = beside.clone().surfaces(0.0, &mut surfaces);
        solid = solid.with(CsgSolid { surfaces, tree });
    }
    Some(Design { mesh, beside, kind, way, region, field, skinned: inside == 3, solid, edge })
}

impl Design {
    fn name(&self) -> String {
        let verbs = ["union", "difference", "intersection", "taken from", "kept in it"];
        format!("{} {}", verbs[self.way], self.kind)
    }

    /// Whether the mesh makes the surface at a place, farther from the other shape than a distance.
    fn shows(&self, p: Vec3, by: f64) -> bool {
        match self.way {
            0 | 1 => self.beside.value(p) > by,
            4 => true,
            _ => self.beside.value(p) < -by,
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

/// 400 cases in `make campaign`.
#[test]
fn combined_meshes_keep_every_guarantee_and_their_edges() {
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut wrong = Vec::new();
    for case in 0..cases(6) {
        let Some(d) = design(case) else {
            continue;
        };
        let Ok(s) = surface(&d.solid, d.edge, &Silent) else {
            continue;
        };
        let tally = tallies.entry(d.name()).or_default();
        tally.parts += 1;
        if let Some(why) = fault_of(&d.solid, d.edge, &s) {
            println!("case {case}: {}, {:.4}: {why}", d.name(), d.edge);
            wrong.push(case);
            tally.faults += 1;
            continue;
        }
        let found = MeshRegion::new(s.mesh, Repair::Auto).expect("a surface");
        // Meshes alone make one, with the curves in which they meet.
        let truth = d.region.as_mesh().unwrap_or(&d.mesh);
        let whole = d.region.as_mesh().is_some();
        for p in creases(truth.mesh(), 30.0, d.edge / 4.0) {
            let field = d.field.as_ref();
            let within = field.is_none_or(|f| f.value(p) <= -1e-9) || d.skinned;
            if within && (whole || d.shows(p, d.edge / 2.0)) {
                let off = found.value(p).abs() / d.edge;
                tally.samples += 1;
                tally.off[0] += usize::from(off > 0.05);
                tally.off[1] += usize::from(off > 0.5);
                tally.worst = tally.worst.max(off);
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
    let share = all.off[0] as f64 / all.samples as f64;
    println!("all: {:.2} %", 100.0 * share);
    assert!(wrong.is_empty(), "{wrong:?}");
    // Rounded, 40 % of them would be.
    assert!(share < 0.004, "{share} of the edges are off");
}

/// A finer grid, over several tiles along each axis: what they have in common they must find alike. 400 cases in
/// `make campaign`.
#[test]
fn tiles_agree_on_combined_meshes() {
    let mut all = 0;
    for case in 0..cases(3) {
        let Some(d) = design(case) else {
            continue;
        };
        let edge = d.edge / 4.0;
        let Ok(s) = surface(&d.solid, edge, &Silent) else {
            continue;
        };
        let (streamed, _) = stream(&d.solid, edge, Islands::Keep).expect("stl");
        assert!(streamed == stl(&s), "case {case}: {}, {edge}", d.name());
        all += 1;
    }
    assert!(all > 0);
    println!("{all} parts, streamed as they are held in memory");
}

/// Boxes of a grid, those of one and of another body: all that is made of both is known exactly.
#[test]
fn meshes_made_one_have_the_edges_of_the_exact_boundary() {
    let at: [&[f64]; 3] = [&[0.0, 0.5, 1.0, 1.6], &[0.0, 0.3, 0.75, 1.0], &[0.0, 0.35, 0.8, 1.3]];
    let in_one = |c: [usize; 3]| c[0] < 2 && c[2] < 2;
    let in_other = |c: [usize; 3]| c[0] > 0 && c[1] == 1 && c[2] > 0;
    for turn in [[0.0; 3], [17.0, 31.0, 47.0]] {
        let placed = |mesh| moved(mesh, turn, [0.11, -0.07, 0.05]);
        let region = |mesh, repair| Arc::new(MeshRegion::new(placed(mesh), repair).expect("mesh"));
        let one = boxes(at, in_one);
        let other = boxes(at, in_other);
        let mut both = one.clone();
        let first = both.vertices.len() as u32;
        both.vertices.extend(&other.vertices);
        both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
        let pair = || -> Vec<Region> {
            let all = [one.clone(), other.clone()];
            all.map(|m| region(m, Repair::Refuse) as Region).to_vec()
        };
        let united = Arc::new(Union::new(pair()).expect("union")) as Region;
        let cut = Arc::new(Difference::new(pair()).expect("difference"));
        let common = Arc::new(Intersection::new(pair()).expect("intersection"));
        let in_any = |c| in_one(c) || in_other(c);
        for (name, made, exact) in [
            ("united", united, boxes(at, in_any)),
            ("in one file", region(both, Repair::Auto), boxes(at, in_any)),
            ("cut", cut, boxes(at, |c| in_one(c) && !in_other(c))),
            ("common", common, boxes(at, |c| in_one(c) && in_other(c))),
        ] {
            let truth = region(exact, Repair::Refuse);
            let mesh = made.as_mesh().expect("one mesh");
            // Cut exactly but for the rounding of places, of 1e-16 each.
            let volume = mesh.mesh().volume() / truth.mesh().volume() - 1.0;
            assert!(volume.abs() < 1e-12, "{name}: {volume:e}");
            let edge = 0.04;
            let [found, direct] = [made.clone(), truth.clone()].map(|r| of(r, edge));
            check(name, &found);
            let [share, least] = [&found, &direct].map(|s| far(&truth, &s.mesh, edge));
            println!("{name} {turn:?}: {share:.4} of the edges are off, {least:.4} of the exact boundary's");
            // The triangles differ, and with them what rounding does to a few cells.
            assert!(share < least + 0.01, "{name}: {share}, {least}");
        }
    }
}

/// Depth in two meshes that touch, or overlap, is that below the surface of both: their joint is none. So it is in what they are a
/// part of.
#[test]
fn depth_is_below_the_surface_of_joined_meshes() {
    let bar = |from: f64| {
        let mesh = moved(block(2.0, 1.0, 1.0), [0.0; 3], [from, 0.0, 0.0]);
        Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean")) as Region
    };
    let some = &mut Random(3);
    for from in [2.0, 1.7] {
        let both: Region = Arc::new(Union::new(vec![bar(0.0), bar(from)]).expect("union"));
        let cut = HalfSpace::new([0.5, 0.0, 0.0], [-1.0, 0.0, 0.0]).expect("half-space");
        let rest: Region = Arc::new(Intersection::new(vec![both.clone(), Arc::new(cut)]).expect("intersection"));
        let less: Region = Arc::new(Offset::new(both.clone(), -0.1).expect("offset"));
        let truth = |low: f64, by: f64| cuboid([low + by, by, by], [2.0 + from - by, 1.0 - by, 1.0 - by]);
        for (region, truth) in [(both, truth(0.0, 0.0)), (rest, truth(0.5, 0.0)), (less, truth(0.0, 0.1))] {
            let depth = Depth::new(region, vec![[0.0, 0.0], [1.0, 1.0]]).expect("depth");
            for _ in 0..500 {
                let p = [1.9 + some.between(-0.4, 0.4), some.between(0.1, 0.9), some.between(0.1, 0.9)];
                let (found, want) = (depth.value(p), -truth.value(p));
                assert!((found - want).abs() < 1e-3, "{from}: {found} for {want} at {p:?}");
            }
        }
    }
}

#[test]
fn a_hole_leaves_the_edges_of_a_mesh_sharp() {
    let (turn, by) = ([17.0, 31.0, 47.0], [0.11, -0.07, 0.05]);
    let place = |p: Vec3| add(apply(&rotation(turn), p), by);
    let plate = moved(block(1.6, 1.6, 0.5), turn, by);
    let plate = Arc::new(MeshRegion::new(plate, Repair::Refuse).expect("clean"));
    let (middle, way) = ([0.8, 0.8, 0.0], unit([0.3, 0.2, 1.0]));
    let ends = [-1.0, 2.0].map(|s| place(add(middle, scale(way, s))));
    let bolt = Cylinder::new(ends[0], sub(ends[1], ends[0]), 0.4, 3.0).expect("cylinder");
    let pair = vec![plate.clone() as Region, Arc::new(bolt)];
    let hole = Arc::new(Difference::new(pair).expect("difference")) as Region;
    for n in [10.0, 20.0, 40.0] {
        let s = of(hole.clone(), 1.0 / n);
        check("plate with a hole", &s);
        let share = far(&plate, &s.mesh, 1.0 / n);
        println!("{n} steps: {share:.4} of the plate's own edges are off");
        assert!(share < 0.001, "{share} of the plate's own edges are off");
    }
}

#[test]
fn rims_of_holes_come_to_second_order() {
    // A tilted hole through a turned block: where its barrel meets the block's faces is known.
    let (half, radius, way) = ([0.8, 0.7, 0.45], 0.35, unit([0.2, 0.1, 1.0]));
    let (turn, center) = (rotation([17.0, 31.0, 47.0]), [0.11, -0.07, 0.05]);
    let mut mesh = block(2.0 * half[0], 2.0 * half[1], 2.0 * half[2]);
    for v in &mut mesh.vertices {
        *v = add(apply(&turn, sub(*v, half)), center);
    }
    let mesh: Region = Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean"));
    let axis = apply(&turn, way);
    let hole = Cylinder::new(sub(center, scale(axis, 1.5)), axis, radius, 3.0).expect("cylinder");
    let pair = vec![mesh, Arc::new(hole)];
    let drilled: Region = Arc::new(Difference::new(pair).expect("difference"));
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| apply(&turn, e));
    let errors = [10.0, 20.0, 40.0].map(|n| {
        let s = of(drilled.clone(), 1.0 / n);
        check("a drilled block", &s);
        // Rims are where triangles that lie in one of the two faces of the block meet others: as far as points keep away
        // from nodes of the grid, and not at the block's own edges.
        let places: Vec<Vec3> = (s.mesh.vertices.iter()).map(|p| axes.map(|a| dot(a, sub(*p, center)))).collect();
        let flat = |v: &u32| (places[*v as usize][2].abs() - half[2]).abs() < 1e-3 / n;
        let mut rims = HashSet::new();
        for t in s.mesh.triangles.iter().filter(|t| t.iter().all(flat)) {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                if !rims.remove(&(b, a)) {
                    rims.insert((a, b));
                }
            }
        }
        let points = rims.into_iter().flat_map(|(a, b)| {
            let [p, q] = [a, b].map(|v| places[v as usize]);
            (0..8).map(move |k| add(p, scale(sub(q, p), f64::from(k) / 8.0)))
        });
        let off = points
            .filter(|p| p[0].abs() < 0.65 && p[1].abs() < 0.55)
            .map(|p| (norm(cross(p, way)) - radius).hypot(p[2].abs() - half[2]));
        let mut off: Vec<f64> = off.collect();
        off.sort_by(f64::total_cmp);
        // Two circles at least, in pieces no longer than a cell is wide.
        let least = 4.0 * PI * radius * n / 3f64.sqrt() * 8.0;
        assert!(off.len() as f64 > least, "{}", off.len());
        [off[off.len() * 19 / 20], off[off.len() - 1]]
    });
    println!("rims of a hole, 19 of 20 points and all, at 10, 20, 40 steps: {errors:?}");
    // Twice halved: a sixteenth, where a chamfer would leave a quarter.
    assert!(errors[2][0] < errors[0][0] / 9.0, "{errors:?}");
}
