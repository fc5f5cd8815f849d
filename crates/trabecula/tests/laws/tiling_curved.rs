//! Lattices over tetrahedra that are bent onto the region's surface: they fill it, by both methods, and end on it.

use std::collections::HashMap;
use std::sync::Arc;

use crate::common::{Random, ball, cases, check, cuboid, meshed, rows, within};
use geometry::math::{Aabb, Vec3, cross, dot, norm, sub};
use geometry::mesh::Mesh;
use geometry::repair::Repair;
use geometry::surface_mesh::SurfaceMesh;
use geometry::tetmesh::TetMesh;
use trabecula::cell::Part;
use trabecula::cell::tet::named_tet_cell;
use trabecula::design::{Built, Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::map::CarrierMesh;
use trabecula::mesher::background;
use trabecula::region::{Cylinder, MeshRegion, Region};
use trabecula::solid::Solid;
use trabecula::surface_maker::Islands;
use trabecula::tiling::{NodalLevel, Tiling, TilingSurface};

fn mesh(region: &Region, size: f64) -> TetMesh {
    let inside = within(region, 5000, 4);
    background(region, &region.bounds(), &Grade::Constant(size), &inside, None).expect("mesh").mesh
}

fn bent(region: &Region, size: f64, overlap: f64) -> Arc<CarrierMesh> {
    Arc::new(CarrierMesh::of_region(&mesh(region, size), overlap, region).expect("mesh"))
}

fn tiling(map: Arc<CarrierMesh>, name: &str, fraction: f64) -> Tiling {
    let named = named_tet_cell(name).expect(name);
    let cell = named.cell().expect(name);
    let t = cell.iso(named.part, fraction);
    Tiling::new(map, Arc::new(cell), named.part, NodalLevel::Same(t))
}

/// All of the tetrahedra solid: what is made of them is their boundary.
fn full(map: Arc<CarrierMesh>) -> Tiling {
    let cell = named_tet_cell("diamond").expect("cell").cell().expect("cell");
    let above = NodalLevel::Same(cell.range().hi + 1.0);
    Tiling::new(map, Arc::new(cell), Part::Lower, above)
}

fn explicit(tiling: &Tiling, steps: f64) -> SurfaceMesh {
    meshed(&TilingSurface(tiling), tiling.map.mean_edge() / steps, Islands::Keep).expect("surface").0
}

/// A cylinder with a sharp circle at each end.
fn can() -> Region {
    Arc::new(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 10.0, 12.0).expect("cylinder"))
}

#[test]
fn bent_tetrahedra_are_one_to_one() {
    let region = ball([1.0, 0.0, 2.0], 12.0);
    let map = bent(&region, 5.0, 0.0);
    assert!(map.fits() && map.off_region() < Some(0.05), "{:?}", map.off_region());
    let mut some = Random(1);
    for _ in 0..3000 {
        let t = some.below(map.len());
        let mut l: [f64; 4] = core::array::from_fn(|_| some.share());
        let sum: f64 = l.iter().sum();
        l = l.map(|v| v / sum);
        let p = map.place(t, l);
        let found = map.bary(t, p);
        assert!((0..4).all(|i| (found[i] - l[i]).abs() < 1e-11), "{l:?} {found:?}");
        // Nobody else has the point, but for those on its faces.
        let (u, m) = map.locate(p);
        assert!(u == t || l.iter().any(|v| *v < 1e-9), "{t} {l:?} {u} {m:?}");
        let slopes = map.slopes_at(t, l);
        for a in 0..3 {
            let h = 1e-5;
            let moved = |by: f64| {
                let mut q = p;
                q[a] += by;
                map.bary(t, q)
            };
            let (up, down) = (moved(h), moved(-h));
            // Only inside: the continuation has other derivatives.
            if l.iter().all(|v| *v > 1e-3) {
                assert!((0..3).all(|i| ((up[i] - down[i]) / (2.0 * h) - slopes[i][a]).abs() < 1e-6));
            }
        }
    }
}

#[test]
fn bounds_hold_at_the_bent_boundary() {
    let region = ball([0.0; 3], 12.0);
    let mut some = Random(7);
    for (overlap, name) in [(0.0, "diamond"), (0.1, "diamond_sheet")] {
        let tiling = tiling(bent(&region, 5.0, overlap), name, 0.3);
        for _ in 0..600 {
            let low = some.point(12.0);
            let h = 3.0 * some.share().powi(3);
            let b = Aabb { min: low, max: low.map(|v| v + h) };
            let r = tiling.bound(&b);
            for _ in 0..8 {
                let v = tiling.value(low.map(|v| v + h * some.share()));
                assert!(r.lo <= v + 1e-9 && v <= r.hi + 1e-9, "{name} {r:?} {v}");
            }
        }
    }
}

#[test]
fn the_boundary_of_what_is_cut_is_the_surface() {
    let ball = ball([0.0; 3], 12.0);
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * 12f64.powi(3);
    let map = bent(&ball, 5.0, 0.0);
    let flat = map.boundary().volume();
    assert!(flat / sphere < 0.97, "{}", flat / sphere);
    let mut off = Vec::new();
    for steps in [6.0, 12.0] {
        let made = explicit(&full(map.clone()), steps);
        check("ball", &made);
        let far = made.mesh.vertices.iter().map(|p| (norm(*p) - 12.0).abs()).fold(0.0, f64::max);
        assert!(far < 1e-8, "{far}");
        off.push(made.mesh.volume() / sphere - 1.0);
    }
    // Chords of an n-th of an edge: of second order.
    assert!(off[1].abs() < 1e-3 && off[1].abs() < 0.35 * off[0].abs(), "{off:?}");
    // Circles at both ends stay sharp: chords of a tenth of an edge cost (0.4 / 10)² / 6 of the volume, and a sharp edge that
    // is cut across would cost far more.
    let can = can();
    let volume = std::f64::consts::PI * 1200.0;
    let map = bent(&can, 4.0, 0.0);
    let made = explicit(&full(map.clone()), 12.0);
    check("can", &made);
    assert!(map.fits() && (made.mesh.volume() / volume - 1.0).abs() < 1e-3, "{}", made.mesh.volume() / volume);
    let mut values = vec![0.0; made.mesh.vertices.len()];
    can.values(&made.mesh.vertices, &mut values);
    let far = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    // Distances of points of a sharp edge by planes taken a hundredth of a face away.
    assert!(far < 1e-3, "{far}");
}

/// A ball of triangles, its surface in waves that are shorter than a tetrahedron.
fn rippled(some: &mut Random) -> Region {
    const N: usize = 40;
    let wave = |p: Vec3| p.map(|v| 1.6 * v / norm(p));
    let waves: Vec<(Vec3, f64)> = (0..3).map(|_| (wave(some.point(1.0)), some.between(0.0, 6.0))).collect();
    let place = |p: Vec3| {
        let unit = p.map(|v| v / norm(p));
        let by = waves.iter().map(|(k, shift)| (10.0 * dot(*k, unit) + shift).sin()).sum::<f64>();
        unit.map(|v| v * (10.0 + 0.12 * by))
    };
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let mut known = HashMap::new();
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|a| if octant >> a & 1 == 1 { -1i64 } else { 1 });
        let mut node = |i: usize, j: usize| {
            let at = [i, j, N - i - j].map(|v| v as i64);
            let at: [i64; 3] = core::array::from_fn(|a| at[a] * sign[a]);
            *known.entry(at).or_insert_with(|| {
                vertices.push(place(at.map(|v| v as f64)));
                vertices.len() as u32 - 1
            })
        };
        let odd = sign.iter().product::<i64>() < 0;
        for i in 0..N {
            for j in 0..N - i {
                let [a, b, c] = [node(i, j), node(i + 1, j), node(i, j + 1)];
                triangles.push(if odd { [a, c, b] } else { [a, b, c] });
                if i + j + 2 <= N {
                    let d = node(i + 1, j + 1);
                    triangles.push(if odd { [b, c, d] } else { [b, d, c] });
                }
            }
        }
    }
    Arc::new(MeshRegion::new(Mesh { vertices, triangles }, Repair::Refuse).expect("ball"))
}

/// Surfaces finer than the tetrahedra, as every scan has some: where the bent boundary is off the part in places, the steps
/// along it follow the surface nevertheless, and the mesh remains one of the region.
#[test]
fn a_surface_finer_than_tetrahedra_is_followed_by_steps() {
    let mut some = Random(24);
    for _ in 0..cases(2) {
        let region = rippled(&mut some);
        let volume = region.volume().expect("volume");
        let map = bent(&region, 4.0, 0.0);
        assert!(map.off_region() > Some(0.1) && map.fits(), "{:?}", map.off_region());
        let made = explicit(&full(map.clone()), 12.0);
        check("rippled", &made);
        let mut off = vec![0.0; made.mesh.vertices.len()];
        region.values(&made.mesh.vertices, &mut off);
        let far = off.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let off = made.mesh.volume() / volume - 1.0;
        println!("off {:?} edges, by steps {far:.4} mm, volume {off:+.5}", map.off_region());
        assert!(off.abs() < 1e-3, "{off}");
    }
}

#[test]
fn both_methods_fill_the_region_with_the_fraction_asked_for() {
    for (region, size, names) in
        [(ball([0.0; 3], 12.0), 5.0, ["diamond", "diamond_sheet"]), (can(), 4.0, ["diamond_sheet", "diamond"])]
    {
        let map = bent(&region, size, 0.0);
        for name in rows(1, names) {
            let tiling = tiling(map.clone(), name, 0.3);
            let made = explicit(&tiling, 12.0);
            check(name, &made);
            let volume = region.volume().expect(name);
            let edge = map.mean_edge() / 16.0;
            let solid = Solid::new(region.clone(), Some(Arc::new(tiling.clone())), tiling.wavelength());
            let grid = meshed(&GridSurface(&solid), edge, Islands::Keep).expect("surface").0;
            check(name, &grid);
            let [a, b] = [&made, &grid].map(|m| m.mesh.volume() / volume);
            println!("{name} {a} {b}");
            // Bending changes the share of a cell by the square of an edge over the radius, at these levels; on a grid walls of three
            // steps are too heavy by their chords besides.
            assert!((a / 0.3 - 1.0).abs() < 0.01 && (b / 0.3 - 1.0).abs() < 0.03, "{name} {a} {b}");
        }
    }
}

#[test]
fn what_is_flat_stays_as_it_was() {
    let region = cuboid([0.0; 3], [12.0, 8.0, 8.0]);
    let mesh = mesh(&region, 4.0);
    let (flat, bent) =
        (CarrierMesh::new(&mesh, 0.0).expect("mesh"), CarrierMesh::of_region(&mesh, 0.0, &region).expect("mesh"));
    assert!(bent.off_region().is_some_and(|o| o < 1e-9), "{:?}", bent.off_region());
    let [a, b] = [flat, bent].map(|m| explicit(&tiling(Arc::new(m), "diamond", 0.3), 6.0));
    assert_eq!(a.mesh.triangles, b.mesh.triangles);
    let far = a.mesh.vertices.iter().zip(&b.mesh.vertices).map(|(p, q): (&Vec3, &Vec3)| norm(sub(*p, *q)));
    assert!(far.fold(0.0, f64::max) < 1e-9);
}

const BALL: &str = "sphere.radius = 9";
const SHELL: &str = "difference = [{ sphere.radius = 10 }, { sphere.radius = 9 }]";

fn built(region: &str, lattice: &str, size: f64) -> Built {
    let text = format!("schema = 1\nregion.{region}\n[lattice.a]\n{lattice}\nmap.tets.size = {size}\n");
    Design::from_toml(&text).expect(lattice).build(&NoFiles).expect(lattice)
}

/// A figure of surfaces in these steps along the edge of a tetrahedron: the finer one, and that of steps without end.
fn in_steps(tiling: &Tiling, figure: impl Fn(&SurfaceMesh) -> f64) -> [f64; 2] {
    let [coarse, fine] = [16.0, 32.0].map(|steps| figure(&explicit(tiling, steps)));
    [fine, fine + (fine - coarse) / 3.0]
}

/// The volume of the finished part is that of the reported fraction, and of that asked for if one is: of tetrahedra that are bent far
/// onto balls and shells, over the region's volume. No step is asked for that would not help. A shell of tetrahedra as flat as they are
/// bent is off the spheres by some of its own volume, the more the finer its steps.
#[test]
fn bent_lattices_have_the_fraction_that_is_reported() {
    let diamond = "part = \"lower\"\ncell.tet.name = \"diamond\"\nlevel.fraction = 0.3";
    let iso = "part = \"lower\"\ncell.tet.name = \"diamond_sheet\"\nlevel.iso = 0.0";
    let sheet = "part = \"sheet\"\ncell.tet.name = \"primitive_sheet\"\nlevel.fraction = 0.2";
    let cubes = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
    let designs = [
        (BALL, cubes(9.0), diamond, 9.0, Some(0.3), 0.004),
        (BALL, cubes(9.0), sheet, 6.0, Some(0.2), 0.004),
        (SHELL, cubes(10.0) - cubes(9.0), diamond, 4.0, Some(0.3), 0.01),
        (BALL, cubes(9.0), iso, 5.0, None, 0.004),
    ];
    for (region, volume, lattice, size, asked, near) in rows(3, designs) {
        let design = built(region, lattice, size);
        let tiling = &design.tilings[0].tiling;
        let reported = design.tilings[0].finished.expect(lattice);
        let [fine, limit] = in_steps(tiling, |s| s.mesh.volume());
        let found = limit / volume;
        println!(
            "{region} {size}: {found:.5}, reported {reported:.5}, {:.5} of flat ones",
            tiling.volumes().1 / tiling.volumes().0
        );
        assert!((found / reported - 1.0).abs() < near, "{region}: {found}, reported {reported}");
        assert!(asked.is_none_or(|a| (reported / a - 1.0).abs() < 1e-3), "{region}: reported {reported}");
        let warned = design.coarse_steps(tiling.map.mean_edge() / 32.0, fine, 1);
        assert!(warned.is_none(), "{region}: {warned:?}");
    }
}

/// Walls of bent tetrahedra are as thick on average as asked: their volume over the area of the surface f = 0, both of the part as it
/// is made.
#[test]
fn bent_walls_are_as_thick_as_asked_on_average() {
    let sheet = "part = \"sheet\"\ncell.tet.name = \"diamond_sheet\"\nlevel.thickness = 0.5";
    let thick = "difference = [{ sphere.radius = 10 }, { sphere.radius = 8 }]";
    for (region, size) in rows(2, [(BALL, 8.0), (thick, 4.0), (BALL, 5.0)]) {
        let design = built(region, sheet, size);
        let tiling = &design.tilings[0].tiling;
        let cell = tiling.cells[0].cell.clone();
        let middle = Tiling::new(tiling.map.clone(), cell, Part::Lower, NodalLevel::Same(0.0));
        let area = |s: &SurfaceMesh| {
            let of = |i: usize| {
                let [a, b, c] = s.mesh.corners(i);
                norm(cross(sub(b, a), sub(c, a))) / 2.0
            };
            (0..s.cut.len()).filter(|i| !s.cut[*i]).map(of).sum::<f64>()
        };
        let found = in_steps(tiling, |s| s.mesh.volume())[1] / in_steps(&middle, area)[1];
        let reported = tiling.thickness().expect("walls").mean;
        println!("{region} {size}: {found:.5} mm, reported {reported:.5}");
        assert!(
            (reported / 0.5 - 1.0).abs() < 2e-3 && (found / 0.5 - 1.0).abs() < 0.01,
            "{region} {size}: {found}, {reported}"
        );
    }
}
