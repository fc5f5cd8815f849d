//! Edges of meshes: how near the surface comes to them, and that every guarantee holds whatever the mesh.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, apply, cross, dot, norm, rotation, scale, sub, unit};
use geometry::mesh::Mesh;
use geometry::progress::Silent;
use geometry::repair::Repair;
use geometry::similarity::Similarity;
use geometry::surface_mesh::SurfaceMesh;
use trabecula::cell::Part;
use trabecula::csg_tree::CsgTree;
use trabecula::extract::surface;
use trabecula::field::{Block, Field};
use trabecula::grade::Grade;
use trabecula::implicit::Surface;
use trabecula::region::{MeshRegion, Region, SignedDistance, Union};
use trabecula::skin::skin;
use trabecula::solid::Solid;

use super::common::{Random, campaign, cases, check, check_both, cuboid, lattice};

fn region(mesh: Mesh) -> Arc<MeshRegion> {
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean"))
}

pub fn moved(mut mesh: Mesh, degrees: Vec3, by: Vec3) -> Mesh {
    let turn = rotation(degrees);
    for v in &mut mesh.vertices {
        *v = add(apply(&turn, *v), by);
    }
    mesh
}

/// A prism over a polygon, which `fan` divides into triangles.
fn prism(polygon: &[[f64; 2]], fan: &[[usize; 3]], height: f64) -> Mesh {
    let n = polygon.len() as u32;
    let at = |z: f64| polygon.iter().map(move |p| [p[0], p[1], z]);
    let mut mesh = Mesh { vertices: at(0.0).chain(at(height)).collect(), triangles: Vec::new() };
    for t in fan {
        let [a, b, c] = t.map(|v| v as u32);
        mesh.triangles.extend([[a, c, b], [a + n, b + n, c + n]]);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    mesh
}

fn fan(n: usize) -> Vec<[usize; 3]> {
    (1..n - 1).map(|i| [0, i, i + 1]).collect()
}

pub fn block(x: f64, y: f64, z: f64) -> Mesh {
    prism(&[[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]], &fan(4), z)
}

/// An L; its inner edge is concave, and so is one of the three edges at that edge's ends.
pub fn angle() -> Mesh {
    let polygon = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.8], [0.7, 0.8], [0.7, 1.9], [0.0, 1.9]];
    prism(&polygon, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.9)
}

/// The boxes between planes along each axis of which `full` says that they are solid.
pub fn boxes(at: [&[f64]; 3], full: impl Fn([usize; 3]) -> bool) -> Mesh {
    let cells = at.map(|a| a.len() - 1);
    let holds = |c: [usize; 3]| (0..3).all(|a| c[a] < cells[a]) && full(c);
    let mut mesh = Mesh::default();
    let mut names = HashMap::new();
    for n in 0..cells.iter().product() {
        let c = [n % cells[0], n / cells[0] % cells[1], n / cells[0] / cells[1]];
        for (axis, up) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let mut beside = c;
            beside[axis] = c[axis].wrapping_add(if up { 1 } else { usize::MAX });
            if !holds(c) || holds(beside) {
                continue;
            }
            let mut corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                let mut p = c;
                p[axis] += usize::from(up);
                p[(axis + 1) % 3] += u;
                p[(axis + 2) % 3] += v;
                p
            });
            if !up {
                corners.reverse();
            }
            let [p, q, r, s] = corners.map(|p| {
                let next = names.len() as u32;
                *names.entry(p).or_insert_with(|| {
                    mesh.vertices.push([0, 1, 2].map(|a| at[a][p[a]]));
                    next
                })
            });
            mesh.triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    mesh
}

/// A block without one of its corners: where its edges end, convex and concave ones meet.
pub fn notched() -> Mesh {
    boxes([&[0.0, 0.7, 1.6]; 3], |c| c != [1; 3])
}

/// Points on the edges of a mesh that turn by more than some angle, no farther from each other than a length.
pub fn creases(mesh: &Mesh, degrees: f64, apart: f64) -> Vec<Vec3> {
    let normal = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        unit(cross(sub(b, a), sub(c, a)))
    };
    let mut edges = HashMap::new();
    let mut points = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let Some(j) = edges.insert((a.min(b), a.max(b)), i) else {
                continue;
            };
            if dot(normal(i), normal(j)) < (degrees * PI / 180.0).cos() {
                let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
                let n = (norm(sub(p, q)) / apart).ceil();
                points.extend((0..=n as usize).map(|s| add(p, scale(sub(q, p), s as f64 / n))));
            }
        }
    }
    points
}

/// How far the edges of a region are from a mesh, and points of the mesh from the region.
fn apart(truth: &MeshRegion, mesh: &Mesh, edge: f64) -> [f64; 2] {
    let found = region(mesh.clone());
    let farthest = |r: &MeshRegion, points: &[Vec3]| points.iter().map(|p| r.value(*p).abs()).fold(0.0, f64::max);
    let middles: Vec<Vec3> = (0..mesh.triangles.len())
        .flat_map(|i| {
            let [a, b, c] = mesh.corners(i);
            let middle = |p, q| scale(add(p, q), 0.5);
            [a, middle(a, b), middle(b, c), middle(c, a)]
        })
        .collect();
    [farthest(&found, &creases(truth.mesh(), 30.0, edge / 4.0)), farthest(truth, &middles)]
}

/// A mesh whose edges nobody knows of: what comes of it has them rounded off.
struct Rounded(Arc<MeshRegion>);

impl Field for Rounded {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.0.bound(b)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.0.fill(block, out);
    }
}

impl SignedDistance for Rounded {
    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        self.0.level_planes(axis, level, out);
    }

    fn surfaces(self: Arc<Self>, _: f64, out: &mut Vec<Surface>) -> CsgTree {
        out.push(Surface::distance(self));
        CsgTree::Leaf(out.len() - 1)
    }

    fn moved(self: Arc<Self>, _: &Similarity) -> Result<Region, Fault> {
        Err(Fault::new("", "it stays where it is"))
    }

    fn volume(&self) -> Option<f64> {
        self.0.volume()
    }
}

/// The share of the edges of a region that are farther from a mesh than a hundredth of a step.
pub fn far(truth: &MeshRegion, mesh: &Mesh, edge: f64) -> f64 {
    let found = region(mesh.clone());
    let points = creases(truth.mesh(), 30.0, edge / 4.0);
    let far = points.iter().filter(|p| found.value(**p).abs() > edge / 100.0);
    far.count() as f64 / points.len() as f64
}

pub fn of(region: Region, edge: f64) -> SurfaceMesh {
    surface(&full(region), edge, &Silent).expect("surface")
}

fn full(region: Region) -> Solid {
    Solid::new(region, None, 1.0)
}

/// A cylinder about z as a mesh of many facets.
pub fn cylinder(n: u32, radius: f64, height: f64) -> Mesh {
    let polygon: Vec<[f64; 2]> = (0..n)
        .map(|i| (2.0 * PI * f64::from(i) / f64::from(n)).sin_cos())
        .map(|(s, c)| [radius * c, radius * s])
        .collect();
    prism(&polygon, &fan(n as usize), height)
}

/// A star of n points: every other edge is concave.
pub fn star(n: u32) -> Mesh {
    let corner = |i: u32| {
        let (s, c) = (PI * f64::from(i) / f64::from(n)).sin_cos();
        let r = if i.is_multiple_of(2) { 1.0 } else { 0.5 };
        [r * c, r * s]
    };
    let polygon: Vec<_> = (0..2 * n).map(corner).collect();
    let all = 2 * n as usize;
    let points = (0..n as usize).map(|i| [2 * i, (2 * i + 1) % all, (2 * i + all - 1) % all]);
    let middle = (1..n as usize - 1).map(|i| [1, 2 * i + 1, 2 * i + 3]);
    prism(&polygon, &points.chain(middle).collect::<Vec<_>>(), 0.8)
}

#[test]
fn polyhedra_keep_their_edges() {
    for (name, mesh) in [
        ("block", block(1.0, 1.3, 0.8)),
        ("angle", angle()),
        ("notched", notched()),
        ("hexagon", cylinder(6, 0.8, 0.9)),
        ("star", star(5)),
    ] {
        let turns = [[0.0; 3], [17.0, 31.0, 47.0], [-70.0, 12.0, 5.0]];
        for (turn, edges) in turns.into_iter().zip([&[0.1][..], &[0.04], &[0.1]]) {
            for &edge in if campaign() { &[0.1, 0.04] } else { edges } {
                let truth = region(moved(mesh.clone(), turn, [0.11, -0.07, 0.05]));
                let s = of(truth.clone(), edge);
                check_both(name, &full(truth.clone()), edge, &s);
                let round = of(Arc::new(Rounded(truth.clone())), edge);
                let [off, before] = [&s, &round].map(|s| apart(&truth, &s.mesh, edge));
                let volume = s.mesh.volume() / truth.mesh().volume() - 1.0;
                let [share, rounded] = [&s, &round].map(|s| far(&truth, &s.mesh, edge));
                println!(
                    "{name} {turn:?} {edge}: {:.5?} steps, {:.5?} rounded; {share:.3} of the edges are off, \
                     {rounded:.3} rounded; volume {volume:.1e}",
                    off.map(|x| x / edge),
                    before.map(|x| x / edge)
                );
                // Points keep 1/4096 of a step away from nodes, and a corner sees three of them.
                assert!(off.iter().all(|x| *x < edge * 3.0 / 4096.0), "{name}: {off:?}");
                assert!(off[0] <= before[0] && off[1] <= before[1] + 1e-9 * edge, "{name}");
                assert!(share < 0.01 && rounded > 0.7, "{name}: {share}, {rounded}");
            }
        }
    }
}

#[test]
fn rims_come_to_second_order() {
    let barrel = cylinder(2000, 0.7, 1.1);
    let barrel = region(moved(barrel, [17.0, 31.0, 47.0], [0.11, -0.07, 0.05]));
    let errors = [10.0, 20.0, 40.0].map(|n| {
        let s = of(barrel.clone(), 1.0 / n);
        check_both("cylinder", &full(barrel.clone()), 1.0 / n, &s);
        let found = region(s.mesh);
        let points = creases(barrel.mesh(), 30.0, 0.25 / n);
        let mut off: Vec<f64> = points.iter().map(|p| found.value(*p).abs()).collect();
        off.sort_by(f64::total_cmp);
        off[off.len() * 19 / 20]
    });
    // Where several rims share a cell some of an edge is still rounded.
    println!("19 of 20 points of the rims of a cylinder, at 10, 20, 40 steps: {errors:?}");
    assert!(errors[2] < errors[0] / 9.0, "{errors:?}");
}

/// Points on the edges of a region that lie in a lattice, and how far they are from a mesh.
fn in_lattice(truth: &MeshRegion, field: &dyn Field, mesh: &Mesh, edge: f64) -> Vec<f64> {
    let found = region(mesh.clone());
    let points = creases(truth.mesh(), 30.0, edge / 4.0).into_iter();
    let within = points.filter(|p| field.value(*p) <= 0.0);
    within.map(|p| found.value(p).abs()).collect()
}

#[test]
fn edges_are_kept_where_a_lattice_meets_them() {
    let cells = [("gyroid", Part::Sheet), ("diamond", Part::Lower)];
    for (i, (name, mesh)) in [("angle", angle()), ("notched", notched()), ("star", star(5))].into_iter().enumerate() {
        // One of the two each; both in `make campaign`.
        let (first, all) = if campaign() { (0, 2) } else { (i % 2, 1) };
        for &(cell, part) in &cells[first..first + all] {
            let truth = region(moved(mesh.clone(), [17.0, 31.0, 47.0], [0.11, -0.07, 0.05]));
            let field = lattice(cell, part, 0.4, [0.6; 3], [0.0; 3]);
            let edge = 0.045;
            let of = |region: Region| {
                let solid = Solid::new(region, Some(field.clone()), 0.6);
                surface(&solid, edge, &Silent).expect("surface")
            };
            let (s, round) = (of(truth.clone()), of(Arc::new(Rounded(truth.clone()))));
            let solid = Solid::new(truth.clone(), Some(field.clone()), 0.6);
            check_both(&format!("{name}, {cell}"), &solid, edge, &s);
            let share = |s: &SurfaceMesh| {
                let off = in_lattice(&truth, &*field, &s.mesh, edge);
                off.iter().filter(|d| **d > edge / 20.0).count() as f64 / off.len() as f64
            };
            let [kept, rounded] = [&s, &round].map(share);
            println!("{name}, {cell}: {kept:.3} of the edges are off, {rounded:.3} rounded");
            assert!(kept < 0.01 && rounded > 0.7, "{name}, {cell}: {kept}, {rounded}");
        }
    }
}

#[test]
fn rims_with_a_lattice_come_to_second_order() {
    let barrel = cylinder(2000, 0.7, 1.1);
    let barrel = region(moved(barrel, [17.0, 31.0, 47.0], [0.11, -0.07, 0.05]));
    let field = lattice("gyroid", Part::Sheet, 0.5, [0.6; 3], [0.0; 3]);
    let errors = [10.0, 20.0, 40.0].map(|n| {
        let solid = Solid::new(barrel.clone(), Some(field.clone()), 0.6);
        let s = surface(&solid, 1.0 / n, &Silent).expect("surface");
        check_both("cylinder, gyroid", &solid, 1.0 / n, &s);
        let mut off = in_lattice(&barrel, &*field, &s.mesh, 1.0 / n);
        off.sort_by(f64::total_cmp);
        off[off.len() * 19 / 20]
    });
    println!("19 of 20 points of the rims of a cylinder with a gyroid, at 10, 20, 40 steps: {errors:?}");
    assert!(errors[2] < errors[0] / 9.0, "{errors:?}");
}

/// 40 cases in `make campaign`.
#[test]
fn random_boxes_with_thin_walls_and_gaps_keep_every_guarantee() {
    let some = &mut Random(1000);
    let (mut done, mut worst) = (0, 0.0f64);
    while done < cases(4) {
        let mut planes = || -> Vec<f64> {
            let mut at = vec![0.0];
            for _ in 0..3 {
                let gap = if some.share() < 0.3 { 0.03 } else { 0.4 };
                at.push(at[at.len() - 1] + gap * some.between(0.3, 1.3));
            }
            at
        };
        let at = [planes(), planes(), planes()];
        let share = some.between(0.5, 0.9);
        let full: Vec<bool> = (0..27).map(|_| some.share() < share).collect();
        let mesh = boxes(at.each_ref().map(|a| &a[..]), |[i, j, k]| full[i + 3 * j + 9 * k]);
        let turn = if done % 4 == 0 { [0.0; 3] } else { some.point(180.0) };
        let edge = some.between(0.03, 0.1);
        let Ok(truth) = MeshRegion::new(moved(mesh, turn, [0.1, 0.2, 0.3]), Repair::Refuse) else {
            continue;
        };
        worst = worst.max(both(&format!("boxes {done}"), Arc::new(truth), edge, some));
        done += 1;
    }
    println!("at most {worst:.3} steps farther than rounded");
    // Rims of one cell that must be kept apart are walled off half-way to its middle.
    assert!(worst < 0.5, "{worst}");
}

/// Checks a part alone, with a lattice in it, and united with a box; how much farther in steps it is from the truth than
/// with its edges rounded.
fn both(what: &str, truth: Arc<MeshRegion>, edge: f64, some: &mut Random) -> f64 {
    let s = of(truth.clone(), edge);
    check_both(what, &full(truth.clone()), edge, &s);
    let round = of(Arc::new(Rounded(truth.clone())), edge);
    let [off, before] = [&s, &round].map(|s| {
        let [a, b] = apart(&truth, &s.mesh, edge);
        a.max(b) / edge
    });
    println!("{what}: {off:.3} steps, {before:.3} rounded");
    // One lattice bare, the other with a skin; all four in a campaign.
    let all = campaign();
    for (cell, part, skinned) in [("gyroid", Part::Sheet, false), ("diamond", Part::Lower, true)] {
        let field = lattice(cell, part, 0.3, [0.5; 3], some.point(90.0));
        let filled = Solid::new(truth.clone(), Some(field), 0.5);
        if all || !skinned {
            let s = surface(&filled, edge.min(0.05), &Silent).expect("surface");
            check_both(&format!("{what}, {cell}"), &filled, edge.min(0.05), &s);
        }
        // A skin thinner than a step: its inner side crosses the same cells.
        let thickness = Grade::Constant(edge * some.between(0.4, 3.0));
        if all || skinned {
            let skin = skin(&filled.region, &thickness, &[]).expect("skin");
            let (filled, edge) = (filled.with(skin), edge.min(0.05));
            let s = surface(&filled, edge, &Silent).expect("surface");
            check_both(&format!("{what}, {cell} and skin"), &filled, edge, &s);
        }
    }
    let center = truth.bounds().center();
    let beside = cuboid(center, add(center, [0.7, 0.6, 0.5]));
    let joined = Union::new(vec![truth as Region, beside]).expect("union");
    check(&format!("{what}, with a box"), &of(Arc::new(joined), edge));
    off - before
}

/// A ball of 20·4ⁿ triangles.
pub fn ball(n: usize) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut mesh = Mesh::default();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        mesh.vertices.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    // Corners are neighbours at the least distance, which is 2.
    let near = |v: &[Vec3], i: usize, j: usize| {
        let d = sub(v[i], v[j]);
        (d.iter().map(|x| x * x).sum::<f64>() - 4.0).abs() < 1e-9
    };
    for (i, j, k) in (0..12).flat_map(|i| (0..12).flat_map(move |j| (0..12).map(move |k| (i, j, k)))) {
        let v = &mesh.vertices;
        let right = {
            let (p, q, r) = (v[i], v[j], v[k]);
            let n = [q[1] * r[2] - q[2] * r[1], q[2] * r[0] - q[0] * r[2], q[0] * r[1] - q[1] * r[0]];
            n.iter().zip(p).map(|(a, b)| a * b).sum::<f64>() > 0.0
        };
        if i < j && i < k && right && near(v, i, j) && near(v, j, k) && near(v, i, k) {
            mesh.triangles.push([i as u32, j as u32, k as u32]);
        }
    }
    for _ in 0..n {
        let mut names = HashMap::new();
        let old = std::mem::take(&mut mesh.triangles);
        for [a, b, c] in old {
            let [x, y, z] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                *names.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    let m = add(mesh.vertices[p as usize], mesh.vertices[q as usize]);
                    mesh.vertices.push(m);
                    mesh.vertices.len() as u32 - 1
                })
            });
            mesh.triangles.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
        }
        for v in &mut mesh.vertices {
            let l = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            *v = v.map(|x| x / l);
        }
    }
    for v in &mut mesh.vertices {
        let l = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        *v = v.map(|x| x / l);
    }
    mesh
}

/// Three sizes of triangles in turn; 40 cases in `make campaign`.
#[test]
fn dented_balls_keep_every_guarantee() {
    let some = &mut Random(7);
    for case in 0..cases(3) {
        // Every corner in or out: edges of all kinds, as far apart as the triangles are large.
        let mut rough = ball(1 + case as usize % 3);
        for v in &mut rough.vertices {
            *v = scale(*v, 1.0 + 0.25 * some.share());
        }
        let edge = some.between(0.06, 0.1);
        both(&format!("dented ball {case}"), region(rough), edge, some);
        // A ridge, or a groove, about half of a ball that fades at both ends.
        let mut fading = ball(5);
        let deep = some.between(-0.3, 0.3);
        for v in &mut fading.vertices {
            let [x, y, z] = *v;
            let ridge = x.max(0.0) * (1.0 - (z + 0.2 * y).abs() * 3.0).max(0.0);
            *v = scale(*v, 1.0 + deep * ridge);
        }
        let fading = region(moved(fading, some.point(180.0), [0.0; 3]));
        both(&format!("fading {case}"), fading, edge, some);
    }
}
