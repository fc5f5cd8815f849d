//! Creases of meshes: how near the surface comes to them, and that every guarantee holds whatever the mesh.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::sync::Arc;

use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::{Silent, Surface, surface};
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Affine, Map};
use trabecula::math::{Vec3, add, apply, rotation, scale, sub};
use trabecula::measure::{non_manifold_vertices, self_intersections, size};
use trabecula::mesh::Mesh;
use trabecula::region::{MeshRegion, Repair};
use trabecula::solid::Solid;

/// Every guarantee, on the mesh as re-read from single precision.
fn check(what: &str, s: &Surface) {
    let mut m = s.mesh.clone();
    for x in m.vertices.iter_mut().flatten() {
        *x = f64::from(*x as f32) + 0.0;
    }
    let places: HashSet<[u64; 3]> = m.vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    assert_eq!(
        places.len(),
        m.vertices.len(),
        "{what}: vertices fall together"
    );
    assert!(size(&m).closed, "{what}: not closed");
    assert_eq!(
        non_manifold_vertices(&m),
        0,
        "{what}: a vertex with two fans"
    );
    assert_eq!(self_intersections(&m, 1), 0, "{what}: crosses itself");
}

fn region(mesh: Mesh) -> Arc<MeshRegion> {
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean"))
}

fn moved(mut mesh: Mesh, degrees: Vec3, by: Vec3) -> Mesh {
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
    let mut mesh = Mesh {
        vertices: at(0.0).chain(at(height)).collect(),
        triangles: Vec::new(),
    };
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

fn block(x: f64, y: f64, z: f64) -> Mesh {
    prism(&[[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]], &fan(4), z)
}

/// An L; its inner edge is concave, and so is one of the three edges at that edge's ends.
fn angle() -> Mesh {
    let polygon = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 0.8],
        [0.7, 0.8],
        [0.7, 1.9],
        [0.0, 1.9],
    ];
    prism(&polygon, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.9)
}

/// The boxes between planes along each axis of which `full` says that they are solid.
fn boxes(at: [&[f64]; 3], full: impl Fn([usize; 3]) -> bool) -> Mesh {
    let cells = at.map(|a| a.len() - 1);
    let holds = |c: [usize; 3]| (0..3).all(|a| c[a] < cells[a]) && full(c);
    let mut mesh = Mesh::default();
    let mut names = HashMap::new();
    for n in 0..cells.iter().product() {
        let c = [
            n % cells[0],
            n / cells[0] % cells[1],
            n / cells[0] / cells[1],
        ];
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
fn notched() -> Mesh {
    boxes([&[0.0, 0.7, 1.6]; 3], |c| c != [1; 3])
}

/// Points on the edges of a mesh that turn by more than some angle.
fn creases(mesh: &Mesh, degrees: f64) -> Vec<Vec3> {
    let normal = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        let (u, v) = (
            [0, 1, 2].map(|k| b[k] - a[k]),
            [0, 1, 2].map(|k| c[k] - a[k]),
        );
        let n = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let l = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        n.map(|x| x / l)
    };
    let mut edges = HashMap::new();
    let mut points = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if let Some(j) = edges.insert((a.min(b), a.max(b)), i) {
                let (n, m) = (normal(i), normal(j));
                if n.iter().zip(m).map(|(x, y)| x * y).sum::<f64>() < (degrees * PI / 180.0).cos() {
                    let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
                    points.extend((0..=20).map(|s| {
                        let t = f64::from(s) / 20.0;
                        add(scale(p, 1.0 - t), scale(q, t))
                    }));
                }
            }
        }
    }
    points
}

/// How far the creases of the region are from the mesh, and points of the mesh from the region.
fn apart(truth: &MeshRegion, mesh: &Mesh) -> [f64; 2] {
    let found = region(mesh.clone());
    let farthest = |r: &MeshRegion, points: &[Vec3]| {
        points.iter().map(|p| r.value(*p).abs()).fold(0.0, f64::max)
    };
    let middles: Vec<Vec3> = (0..mesh.triangles.len())
        .flat_map(|i| {
            let [a, b, c] = mesh.corners(i);
            [
                a,
                scale(add(a, b), 0.5),
                scale(add(b, c), 0.5),
                scale(add(c, a), 0.5),
            ]
        })
        .collect();
    [
        farthest(&found, &creases(truth.mesh(), 30.0)),
        farthest(truth, &middles),
    ]
}

#[test]
fn polyhedra_are_met_exactly() {
    for (name, mesh) in [
        ("block", block(1.0, 1.3, 0.8)),
        ("angle", angle()),
        ("notched", notched()),
    ] {
        for turn in [[0.0; 3], [17.0, 31.0, 47.0], [-70.0, 12.0, 5.0]] {
            for edge in [0.2, 0.07] {
                let truth = region(moved(mesh.clone(), turn, [0.11, -0.07, 0.05]));
                let solid = Solid::new(truth.clone(), None, 1.0);
                let s = surface(&solid, edge, &Silent).expect("surface");
                check(name, &s);
                let off = apart(&truth, &s.mesh);
                println!("{name} {turn:?} {edge}: {:?} steps", off.map(|x| x / edge));
                // Faces keep 1/4096 of a step away from nodes; a corner sees three of them.
                assert!(
                    off.iter().all(|x| *x < edge * 3.0 / 4096.0),
                    "{name}: {off:?}"
                );
                let volume = s.mesh.volume() / truth.mesh().volume();
                assert!((volume - 1.0).abs() < 1e-4, "{name}: {volume}");
            }
        }
    }
}

/// A cylinder about z as a mesh of many facets.
fn cylinder(n: u32, radius: f64, height: f64) -> Mesh {
    let polygon: Vec<[f64; 2]> = (0..n)
        .map(|i| (2.0 * PI * f64::from(i) / f64::from(n)).sin_cos())
        .map(|(s, c)| [radius * c, radius * s])
        .collect();
    prism(&polygon, &fan(n as usize), height)
}

#[test]
fn rims_and_cut_lattices_come_to_second_order() {
    let turn = [17.0, 31.0, 47.0];
    let by = [0.11, -0.07, 0.05];
    let barrel = region(moved(cylinder(2000, 0.7, 1.1), turn, by));
    let errors = [10.0, 20.0, 40.0].map(|n| {
        let s = surface(&Solid::new(barrel.clone(), None, 1.0), 1.0 / n, &Silent).expect("surface");
        check("cylinder", &s);
        apart(&barrel, &s.mesh).into_iter().fold(0.0, f64::max)
    });
    println!("rims of a cylinder at 10, 20, 40 steps: {errors:?}");
    assert!(errors[2] < errors[0] / 9.0, "{errors:?}");

    // Where the edges of a block enter and leave a lattice.
    let cell = Cell::new(Series::new(named("gyroid").expect("gyroid").terms()).expect("series"));
    let map = Affine::rigid([1.1, 1.3, 0.9], [10.0, 20.0, 30.0], [0.0; 3], &[]).expect("map");
    let level = Level::Iso(Grade::Constant(0.1));
    let lattice: Arc<dyn Field> = Arc::new(Lattice::new(
        Arc::new(cell),
        Map::Affine(map),
        Part::Lower,
        level,
    ));
    let truth = region(moved(block(2.0, 2.3, 1.8), turn, by));
    let mut points = Vec::new();
    for w in creases(truth.mesh(), 30.0).windows(2) {
        let (mut a, mut b) = (w[0], w[1]);
        let far = sub(b, a).iter().map(|x| x * x).sum::<f64>() > 0.05;
        if far || (lattice.value(a) < 0.0) == (lattice.value(b) < 0.0) {
            continue;
        }
        for _ in 0..50 {
            let m = scale(add(a, b), 0.5);
            *(if (lattice.value(m) < 0.0) == (lattice.value(a) < 0.0) {
                &mut a
            } else {
                &mut b
            }) = m;
        }
        points.push(a);
    }
    assert!(points.len() > 10);
    let errors = [10.0, 20.0, 40.0].map(|n| {
        let s = surface(
            &Solid::new(truth.clone(), Some(lattice.clone()), 1.0),
            1.0 / n,
            &Silent,
        )
        .expect("surface");
        check("lattice in a block", &s);
        let found = region(s.mesh);
        points
            .iter()
            .map(|p| found.value(*p).abs())
            .fold(0.0, f64::max)
    });
    println!("lattice on the edges of a block at 10, 20, 40 steps: {errors:?}");
    assert!(errors[2] < errors[0] / 9.0, "{errors:?}");
}

/// A number in [0, 1) from a linear congruential generator.
fn random(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// How many random solids of each kind.
fn cases() -> u64 {
    let asked = std::env::var("TRABECULA_CASES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(8)
}

/// Extracts a mesh and checks every guarantee; how far the volume is off, in steps over the surface. `None` if the mesh is
/// not clean.
fn off(what: &str, mesh: Mesh, edge: f64) -> Option<f64> {
    let truth = MeshRegion::new(mesh, Repair::Refuse).ok()?;
    let (volume, area) = (truth.mesh().volume(), truth.mesh().area());
    let s = surface(&Solid::new(Arc::new(truth), None, 1.0), edge, &Silent).expect(what);
    check(what, &s);
    Some((s.mesh.volume() - volume).abs() / (area * edge))
}

#[test]
fn random_boxes_with_thin_walls_and_gaps_keep_every_guarantee() {
    let mut seed = 1000;
    let mut done = 0;
    while done < cases() {
        let mut planes = |thin: f64| -> Vec<f64> {
            let mut at = vec![0.0];
            for _ in 0..3 {
                let gap = if random(&mut seed) < thin { 0.03 } else { 0.4 };
                at.push(at[at.len() - 1] + gap * (0.3 + random(&mut seed)));
            }
            at
        };
        let at = [planes(0.3), planes(0.3), planes(0.3)];
        let share = 0.5 + 0.4 * random(&mut seed);
        let full: Vec<bool> = (0..27).map(|_| random(&mut seed) < share).collect();
        let mesh = boxes(at.each_ref().map(|a| &a[..]), |[i, j, k]| {
            full[i + 3 * j + 9 * k]
        });
        let turn = [0; 3].map(|_| 180.0 * random(&mut seed));
        let turn = if done % 4 == 0 { [0.0; 3] } else { turn };
        let edge = 0.03 + 0.07 * random(&mut seed);
        let what = format!("boxes {done}");
        let Some(off) = off(&what, moved(mesh, turn, [0.1, 0.2, 0.3]), edge) else {
            continue;
        };
        println!("{what}: volume off by {off:.4} steps over the surface");
        // What is thinner than a step may be lost, or thickened by about as much.
        assert!(off < 0.5, "{what}: {off}");
        done += 1;
    }
}

/// A ball of 20·4ⁿ triangles.
fn ball(n: usize) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut mesh = Mesh::default();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        mesh.vertices
            .extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    // Corners are neighbours at the least distance, which is 2.
    let near = |v: &[Vec3], i: usize, j: usize| {
        let d = sub(v[i], v[j]);
        (d.iter().map(|x| x * x).sum::<f64>() - 4.0).abs() < 1e-9
    };
    for (i, j, k) in
        (0..12).flat_map(|i| (0..12).flat_map(move |j| (0..12).map(move |k| (i, j, k))))
    {
        let v = &mesh.vertices;
        let right = {
            let (p, q, r) = (v[i], v[j], v[k]);
            let n = [
                q[1] * r[2] - q[2] * r[1],
                q[2] * r[0] - q[0] * r[2],
                q[0] * r[1] - q[1] * r[0],
            ];
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
            mesh.triangles
                .extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
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

#[test]
fn dented_balls_and_fading_creases_keep_every_guarantee() {
    let mut seed = 7;
    for case in 0..cases() {
        // Every corner in or out: creases of all kinds, as far apart as the triangles are large.
        let mut rough = ball(1 + case as usize % 3);
        for v in &mut rough.vertices {
            *v = scale(*v, 1.0 + 0.25 * random(&mut seed));
        }
        let edge = 0.04 + 0.06 * random(&mut seed);
        let what = format!("dented ball {case}");
        let rough = off(&what, rough, edge).expect("a star");
        // A ridge, or a groove, about half of a ball that fades at both ends.
        let mut fading = ball(5);
        let deep = 0.3 * (2.0 * random(&mut seed) - 1.0);
        for v in &mut fading.vertices {
            let [x, y, z] = *v;
            *v = scale(
                *v,
                1.0 + deep * x.max(0.0) * (1.0 - (z + 0.2 * y).abs() * 3.0).max(0.0),
            );
        }
        let turn = [0; 3].map(|_| 180.0 * random(&mut seed));
        let what = format!("fading {case}");
        let fading = off(&what, moved(fading, turn, [0.0; 3]), edge).expect("a star");
        println!("{what}: volume off by {rough:.4} and {fading:.4} steps over the surface");
        assert!(rough < 0.1 && fading < 0.1, "{what}: {rough} {fading}");
    }
}
