//! Tetrahedral cells over meshes: they fit for any numbering, are whole where their ports say so, and both methods agree.

use std::f64::consts::TAU;
use std::io::Cursor;
use std::sync::Arc;

use crate::common::{Random, ball, cases, check, fault, meshed};
use geometry::math::norm;
use geometry::measure::size;
use geometry::progress::{Silent, Stopped};
use geometry::repair::Repair;
use geometry::surface_mesh::SurfaceMesh;
use geometry::symmetry::{ComplexPart, Group};
use geometry::tetmesh::TetMesh;
use trabecula::cell::tet::{TetCell, named_tet_cell, tet_catalogue};
use trabecula::cell::{Part, Series, Term};
use trabecula::extract::GridSurface;
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::map::CarrierMesh;
use trabecula::mesher::background;
use trabecula::region::MeshRegion;
use trabecula::solid::Solid;
use trabecula::surface_maker::{Components, Islands, SurfaceMaker, SurfaceOptions};
use trabecula::tiling::{NodalLevel, Share, Tiling, TilingSurface, connectivity};

/// n³ cubes of six tetrahedra each, nodes moved about and numbered at random.
pub fn shaken(n: usize, by: f64, edge: f64, some: &mut Random) -> TetMesh {
    let m = n + 1;
    let place = |i: usize| [i % m, i / m % m, i / m / m];
    let nodes: Vec<[f64; 3]> =
        (0..m * m * m).map(|i| place(i).map(|v| edge * (v as f64 + some.between(-by, by)))).collect();
    let mut order: Vec<usize> = (0..nodes.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, some.below(i + 1));
    }
    let mut out = TetMesh { nodes: vec![[0.0; 3]; nodes.len()], ..TetMesh::default() };
    for (i, to) in order.iter().enumerate() {
        out.nodes[*to] = nodes[i];
    }
    let paths = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    for i in (0..m * m * m).filter(|i| place(*i).iter().all(|v| *v < n)) {
        for (k, path) in paths.iter().enumerate() {
            let mut at = place(i);
            let corner = |at: [usize; 3]| order[(at[2] * m + at[1]) * m + at[0]] as u32;
            let mut t = [corner(at); 4];
            for s in 0..3 {
                at[path[s]] += 1;
                t[s + 1] = corner(at);
            }
            if k > 2 {
                t.swap(2, 3);
            }
            out.tets.push(t);
        }
    }
    out
}

pub fn map(mesh: &TetMesh) -> Arc<CarrierMesh> {
    Arc::new(CarrierMesh::new(mesh, 0.0).expect("mesh"))
}

/// The surface of the whole mesh's lattice, by cutting tetrahedra or on a grid.
pub fn made(tiling: Tiling, steps: f64, explicit: bool) -> (SurfaceMesh, Components) {
    let edge = tiling.map.mean_edge() / steps;
    if explicit {
        return meshed(&TilingSurface(&tiling), edge, Islands::Keep).expect("surface");
    }
    let region = MeshRegion::new(tiling.map.boundary(), Repair::Refuse).expect("boundary");
    let wavelength = tiling.wavelength();
    let solid = Solid::new(Arc::new(region), Some(Arc::new(tiling)), wavelength);
    meshed(&GridSurface(&solid), edge, Islands::Keep).expect("surface")
}

pub fn cell(name: &str) -> (Arc<TetCell>, Part, f64) {
    let r = named_tet_cell(name).expect(name);
    let s = r.cell().expect(name);
    let t = s.iso(r.part, r.fraction);
    (Arc::new(s), r.part, t)
}

/// The cell of one real wave of a group.
fn plain(group: &str, hkl: [i32; 3], site: f64, edge: f64, dual: bool) -> Arc<TetCell> {
    let waves = Group::named(group).expect(group).orbit(hkl, ComplexPart::Re).expect(group);
    let terms = waves.into_iter().map(|(hkl, c, s)| Term { hkl, amplitude: c.hypot(s), phase: (-s).atan2(c) / TAU });
    let series = Series::new(terms.collect()).expect(group);
    let cell = TetCell::new(series, [site; 3], edge * 2f64.sqrt(), dual);
    Arc::new(cell.expect(group))
}

#[test]
fn named_cells_are_one_piece_on_any_mesh_and_keep_every_guarantee() {
    let mut some = Random(1);
    let mesh = shaken(2, 0.15, 10.0, &mut some);
    for r in tet_catalogue() {
        let (s, part, t) = cell(r.name);
        let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Same(t));
        let (surface, reported) = made(tiling, 16.0, true);
        let found = size(&surface.mesh);
        assert!(found.closed, "{}", r.name);
        // By ports and union-find, and by the surface itself.
        let reported = (reported.count as usize, reported.cavities as usize, reported.euler);
        assert_eq!(reported, (found.pieces, found.cavities, found.euler), "{}", r.name);
        assert_eq!(found.pieces, 1, "{}", r.name);
    }
}

#[test]
fn cells_that_fall_apart_do_so_on_the_mesh() {
    let mut some = Random(2);
    let mesh = shaken(2, 0.15, 10.0, &mut some);
    // Pieces counted elsewhere on 48 tetrahedra: of the P sheet too thin, of loose fragments, of nodes that reach no face, of a
    // cage whose bars have parted.
    for (s, part, t, pieces) in [
        (plain("221", [1, 0, 0], 0.5, 1.0, false), Part::Sheet, 0.6, 27),
        (plain("221", [1, 0, 0], 0.5, 1.0, false), Part::Lower, -1.8, 48),
        (plain("227:2", [1, 1, 1], 0.125, 0.75, true), Part::Lower, -2.2, 75),
    ] {
        assert!(!s.connected(part).iter().any(|i| i[0] < t && t < i[1]));
        let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Same(t));
        let predicted = connectivity(&tiling).expect("few tetrahedra");
        assert_eq!((predicted.components, predicted.pairs.len()), (pieces, 0));
        let (maker, edge) = (TilingSurface(&tiling), 0.75);
        let (all, reported) = meshed(&maker, edge, Islands::Keep).expect("surface");
        assert_eq!(size(&all.mesh).pieces, pieces);
        assert_eq!((reported.count as usize, reported.others as usize), (pieces, pieces - 1));
        let (one, reported) = meshed(&maker, edge, Islands::Drop).expect("surface");
        assert_eq!((size(&one.mesh).pieces, reported.count), (1, 1));
        let refused = meshed(&maker, edge, Islands::Error);
        assert!(matches!(refused, Err(Stopped::Refused(_))));
    }
}

#[test]
fn surfaces_are_embedded_after_rounding_whatever_varies() {
    let mut some = Random(3);
    for (i, name) in
        ["diamond", "iwp", "primitive_sheet", "pn3m_sheet", "fm3m_sheet", "diamond_cage"].into_iter().enumerate()
    {
        let mesh = shaken(1 + i % 2, 0.2, 7.0, &mut some);
        let (s, part, t) = cell(name);
        let spread = 0.3 * t.abs();
        let each = (0..mesh.nodes.len()).map(|_| t + some.between(-spread, spread));
        for level in [NodalLevel::Same(t), NodalLevel::Nodes(Arc::new(each.collect()))] {
            let tiling = Tiling::new(map(&mesh), s.clone(), part, level);
            let (surface, reported) = made(tiling, 5.0, true);
            check(name, &surface);
            let found = size(&surface.mesh);
            assert_eq!(reported.count as usize, found.pieces, "{name}");
            assert_eq!(reported.euler, found.euler, "{name}");
        }
    }
    // Walls a hundredth of a step thick keep both their sides.
    let mesh = shaken(1, 0.2, 7.0, &mut some);
    let (s, part, _) = cell("diamond_sheet");
    let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Same(1e-3));
    check("thin", &made(tiling, 6.0, true).0);
}

/// The solid share of a tetrahedron is kept by affine maps, and a surface encloses it in any steps: the volume is Σ fraction · |T|. Chords
/// would cost up to a tenth of it at twelve steps. Fractions are known within 1e-4.
#[test]
fn surfaces_enclose_the_fraction_of_the_cell_in_any_steps() {
    let mut some = Random(4);
    let mesh = shaken(1, 0.2, 10.0, &mut some);
    for r in tet_catalogue() {
        let (s, part, t) = cell(r.name);
        let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Same(t));
        let (all, exact) = tiling.volumes();
        let errors = [12.0, 16.0, 32.0].map(|steps| (made(tiling.clone(), steps, true).0.mesh.volume() - exact) / all);
        println!("{}: {}", r.name, errors.map(|e| format!("{e:+.1e}")).join(" "));
        assert!(errors.iter().all(|e| e.abs() < 2e-4), "{}: {errors:?}", r.name);
    }
}

/// Where the level varies, the volume is met in the mean of tetrahedra, at second order in the steps.
#[test]
fn surfaces_of_graded_levels_enclose_their_fraction() {
    let mut some = Random(4);
    let mesh = shaken(2, 0.15, 10.0, &mut some);
    for name in ["primitive", "diamond_sheet", "p43m", "frd"] {
        let (s, part, t) = cell(name);
        let each = mesh.nodes.iter().map(|p| t + 0.2 * t.abs() * (p[0] / 10.0 - 1.0));
        let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Nodes(Arc::new(each.collect())));
        let (_, exact) = tiling.volumes();
        let [coarse, fine] = [10.0, 30.0].map(|n| made(tiling.clone(), n, true).0.mesh.volume() / exact - 1.0);
        println!("{name}: {coarse:+.1e} {fine:+.1e}");
        assert!(coarse.abs() < 0.01 && fine.abs() < 2e-3, "{name}: {coarse} {fine}");
    }
}

#[test]
fn both_methods_make_one_surface() {
    let mut some = Random(6);
    let mesh = shaken(1, 0.15, 8.0, &mut some);
    for name in ["diamond", "diamond_sheet"] {
        let (s, part, t) = cell(name);
        let each = (0..mesh.nodes.len()).map(|_| t * some.between(0.9, 1.1));
        let level = NodalLevel::Nodes(Arc::new(each.collect()));
        let tiling = Tiling::new(map(&mesh), s, part, level);
        // Distance of the surface's triangles from the zero set, to first order (the median: at saddles that is far off), and
        // the volume.
        let figures = |n: f64, explicit: bool| {
            let surface = made(tiling.clone(), n, explicit).0;
            if !explicit {
                check(name, &surface);
            }
            let middles: Vec<[f64; 3]> = (0..surface.mesh.triangles.len())
                .filter(|i| !surface.cut[*i])
                .map(|i| {
                    let [a, b, c] = surface.mesh.corners(i);
                    [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
                })
                .collect();
            let (mut v, mut g) = (vec![0.0; middles.len()], vec![[0.0; 3]; middles.len()]);
            tiling.gradients(&middles, &mut v, &mut g);
            let mut off: Vec<f64> = v.iter().zip(&g).map(|(v, g)| v.abs() / norm(*g)).collect();
            off.sort_unstable_by(f64::total_cmp);
            (off[off.len() / 2], surface.mesh.volume())
        };
        // A grid does not see the tetrahedra, and is the dearer of the two.
        let [a, b] = [10.0, 20.0].map(|n| (figures(1.6 * n, true), figures(n, false)));
        println!("{name}: {a:?} {b:?}");
        // Halving the steps quarters the distances, less what creases cost a grid.
        assert!(b.0.0 < 0.32 * a.0.0, "{name}: explicit {a:?} {b:?}");
        assert!(b.1.0 < 0.45 * a.1.0, "{name}: implicit {a:?} {b:?}");
        let apart = |x: ((f64, f64), (f64, f64))| (x.0.1 - x.1.1).abs() / x.1.1;
        assert!(apart(b) < 0.4 * apart(a) || apart(b) < 2e-3, "{name}: {a:?} {b:?}");
    }
}

#[test]
fn parts_of_real_shape_stream_the_same_bytes_for_any_number_of_threads() {
    let region = ball([1.0, 2.0, 3.0], 6.0);
    let mut some = Random(9);
    let inside: Vec<[f64; 3]> = (0..4000)
        .map(|_| some.point(6.0))
        .filter(|p| norm(*p) < 5.9)
        .map(|p| [p[0] + 1.0, p[1] + 2.0, p[2] + 3.0])
        .collect();
    let size_mm = Grade::Constant(3.0);
    let mesh = background(&region, &region.bounds(), &size_mm, &inside, None).expect("mesh").mesh;
    let (s, part, t) = cell("diamond");
    let tiling = Tiling::new(map(&mesh), s, part, NodalLevel::Same(t));
    let maker = TilingSurface(&tiling);
    let (surface, pieces) = meshed(&maker, 0.5, Islands::Keep).expect("surface");
    assert_eq!(fault(&surface.mesh), None);
    assert_eq!(pieces.count, 1);
    let streams = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| {
            let mut out = Cursor::new(Vec::new());
            let reported = maker.stream_stl(&SurfaceOptions::new(0.5), &mut out, &Silent);
            (reported.expect("stream"), out.into_inner())
        })
    });
    assert!(streams[0].1 == streams[1].1, "bytes differ");
    let (reported, bytes) = &streams[0];
    assert_eq!(reported.components, pieces);
    assert!((reported.volume / surface.mesh.volume() - 1.0).abs() < 1e-12);
    let back = geometry::formats::read_mesh(bytes, "stl").expect("STL").mesh;
    assert_eq!(back.triangles.len(), surface.mesh.triangles.len());
    assert_eq!(fault(&back), None);
}

#[test]
fn meshes_that_are_none_are_refused() {
    let mut some = Random(11);
    let good = shaken(1, 0.1, 5.0, &mut some);
    let refused = |mesh: &TetMesh| CarrierMesh::new(mesh, 0.0).err().expect("refused").message;
    assert!(refused(&TetMesh::default()).contains("no tetrahedron"));
    let mut inverted = good.clone();
    inverted.tets[2].swap(0, 1);
    assert!(refused(&inverted).contains("inverted"));
    let mut crowded = good.clone();
    crowded.tets.extend([good.tets[0], good.tets[0]]);
    assert!(refused(&crowded).contains("belongs to"));
    // Two tetrahedra of the six about a diagonal share nothing but it.
    let mut pinched = good.clone();
    pinched.tets = vec![good.tets[0], good.tets[5]];
    let shared = |a: [u32; 4], b: [u32; 4]| a.iter().filter(|n| b.contains(n)).count();
    let apart = good.tets.iter().find(|t| shared(**t, good.tets[0]) == 2);
    pinched.tets[1] = *apart.expect("one on the other side");
    let (s, part, t) = cell("diamond");
    let map = map(&pinched);
    let tiling = Tiling::new(map, s, part, NodalLevel::Same(t));
    match TilingSurface(&tiling).mesh(&SurfaceOptions::new(0.5), &Silent) {
        Err(Stopped::Refused(f)) => assert!(f.message.contains("an edge alone"), "{}", f.message),
        other => panic!("{:?}", other.map(|m| m.surface.mesh.triangles.len())),
    }
}

/// Two zones along x with a cell each at one fraction.
fn zoned(mesh: &TetMesh, names: [&str; 2], part: Part, fraction: f64) -> Tiling {
    let mut mesh = mesh.clone();
    let sides = mesh.tets.iter().map(|t| {
        let middle = t.iter().map(|n| mesh.nodes[*n as usize][0]).sum::<f64>() / 4.0;
        i64::from(middle > 9.0)
    });
    mesh.zones = sides.collect();
    let map = map(&mesh);
    let of = |zone: i64| {
        let s = cell(names[zone as usize]).0;
        let range = s.range();
        Share { cell: s, scale: 0.5 * (range.hi - range.lo), weights: Some(Arc::new(map.shares(|z| z == zone))) }
    };
    let cells = vec![of(0), of(1)];
    let level = NodalLevel::mixed(&map, &cells, part, &[fraction]);
    Tiling::of(map, cells, part, level)
}

#[test]
fn connectivity_is_predicted_without_a_surface() {
    let mut some = Random(13);
    let mesh = shaken(3, 0.1, 6.0, &mut some);
    let lower: Vec<&str> = tet_catalogue().iter().filter(|r| r.part == Part::Lower).map(|r| r.name).collect();
    let drawn = (0..cases(1)).map(|_| {
        let mut any = || lower[some.below(lower.len())];
        ([any(), any()], some.between(0.15, 0.5), None)
    });
    let known = [(["p43m", "f43m"], 0.3, Some(true)), (["pn3m", "diamond"], 0.3, Some(false))];
    for (names, fraction, joined) in known.into_iter().chain(drawn.collect::<Vec<_>>()) {
        let tiling = zoned(&mesh, names, Part::Lower, fraction);
        let reported = connectivity(&tiling).expect("few tetrahedra");
        let [join] = &reported.pairs[..] else { panic!("{names:?}: {reported:?}") };
        let map = &tiling.map;
        let others = |t: usize| {
            let across = map.across(t).into_iter().filter(|o| (*o as usize) < map.len());
            across.filter(|o| map.zone(*o as usize) != map.zone(t)).count()
        };
        let faces = (0..map.len()).map(others).sum::<usize>() / 2;
        assert_eq!((join.zones, join.faces), ([0, 1], faces), "{names:?}");
        // The same small steps: the surface's own pieces, by its bodies and by a look at the mesh.
        let (surface, found) = made(tiling.clone(), reported.steps as f64, true);
        let pieces = size(&surface.mesh).pieces;
        println!("{names:?} {fraction:.2}: {pieces} pieces, {join:?}");
        assert_eq!((reported.components, found.count as usize), (pieces, pieces), "{names:?} {fraction}");
        assert!(pieces > 1 || join.joined, "{names:?}");
        if let Some(joined) = joined {
            assert_eq!(join.joined, joined, "{names:?}");
        }
    }
}

/// The fraction that each zone realises, and that of the tetrahedra about each node between zones, against what is asked.
#[test]
fn zones_hold_their_fraction_and_fit() {
    let mut some = Random(8);
    let mut mesh = shaken(3, 0.1, 6.0, &mut some);
    let middle = |t: &[u32; 4]| t.iter().map(|n| mesh.nodes[*n as usize][0]).sum::<f64>() / 4.0;
    mesh.zones = mesh.tets.iter().map(|t| i64::from(middle(t) > 9.0)).collect();
    let map = map(&mesh);
    let of = |name: &str, zone: i64| {
        let s = cell(name).0;
        let range = s.range();
        Share { cell: s, scale: 0.5 * (range.hi - range.lo), weights: Some(Arc::new(map.shares(|z| z == zone))) }
    };
    for (a, b, part) in
        [("diamond", "primitive", Part::Lower), ("iwp", "diamond", Part::Upper), ("frd", "iwp", Part::Sheet)]
    {
        let asked = 0.3;
        let cells = vec![of(a, 0), of(b, 1)];
        let level = NodalLevel::mixed(&map, &cells, part, &[asked]);
        let tiling = Tiling::of(map.clone(), cells, part, level);
        let shares = tiling.shares();
        // Levels settle to 0.001 about the nodes between zones, each of which has an equal part of its tetrahedra.
        let zones = [0, 1].map(|zone| map.shares(|z| z == zone));
        let between = |n: &u32| zones.iter().all(|z| z[*n as usize] > 0.0);
        let mut about = vec![(0.0, 0.0); map.nodes().len()];
        for (t, share) in shares.iter().enumerate() {
            let nodes: Vec<u32> = map.tet(t).into_iter().filter(between).collect();
            for n in &nodes {
                let (a, v) = (&mut about[*n as usize], map.volume(t) / nodes.len() as f64);
                *a = (a.0 + share * v, a.1 + v);
            }
        }
        let settled = about.iter().filter(|a| a.1 > 0.0);
        let worst = settled.map(|(s, v)| (s / v - asked).abs()).fold(0.0f64, f64::max);
        let (all, exact) = tiling.volumes();
        let mean = (exact / all - asked).abs();
        println!("{a} and {b}: fractions about nodes within {worst:.4}, of all {mean:.5}");
        assert!(worst < 2e-3 && mean < 1e-3, "{a} {b}: {worst} {mean}");
        // The sum over small tetrahedra, whose error is of fourth order in a sixteenth of an edge, is what the surface
        // encloses, whose error is of second order in its steps: that much of it is taken out.
        let [coarse, fine] = [12.0, 24.0].map(|steps| {
            let (surface, _) = made(tiling.clone(), steps, true);
            let found = size(&surface.mesh);
            assert!(found.closed, "{a} {b}");
            found.volume
        });
        let off = (fine + (fine - coarse) / 3.0) / exact - 1.0;
        println!("  volume off by {:.1e}, and by {off:.1e} extrapolated", fine / exact - 1.0);
        assert!(off.abs() < 2e-3, "{a} {b}: {off}");
    }
}
