//! The wall of a sheet and the spaces adjacent to it: closed, with common triangles, filling the region, each on its own side.

use std::collections::HashMap;
use std::sync::Arc;

use geometry::distance::MeshDistance;
use geometry::math::Vec3;
use geometry::measure::size;
use geometry::progress::{Silent, Stopped};
use geometry::repair::Repair;
use geometry::surface_mesh::SurfaceMesh;
use trabecula::cell::{Part, catalogue};
use trabecula::csg_tree::CsgSolid;
use trabecula::extract::{SpaceMade, spaces};
use trabecula::field::Field;
use trabecula::grade::{Formula, Grade};
use trabecula::lattice::Level;
use trabecula::region::{HalfSpace, MeshRegion, Region};
use trabecula::skin::skin;
use trabecula::solid::{Solid, Space};

use super::common::{Random, ball, cases, cuboid, fault, lattice_at, region};
use super::crease::{angle, moved};

fn made(solid: &Solid, edge: f64) -> Vec<SurfaceMesh> {
    let all = spaces(solid, &Space::ALL, edge, false, &Silent).expect("spaces");
    all.into_iter().map(|SpaceMade { made, .. }| made.surface).collect()
}

type Triangle = [[u64; 3]; 3];

/// The triangles of a mesh by the bits of their corners, the least first, in their cyclic order; and whether each is a cut.
fn triangles(s: &SurfaceMesh) -> Vec<(Triangle, bool)> {
    let bits = |v: u32| s.mesh.vertices[v as usize].map(f64::to_bits);
    let all = s.mesh.triangles.iter().zip(&s.cut);
    all.map(|(t, cut)| {
        let mut t = t.map(bits);
        let least = (0..3).fold(0, |m, i| if t[i] < t[m] { i } else { m });
        t.rotate_left(least);
        (t, *cut)
    })
    .collect()
}

fn turned([a, b, c]: Triangle) -> Triangle {
    [a, c, b]
}

/// Each triangle on the lattice, the skin or a kept zone is in just two of the meshes, turned round; those on the region are in
/// one each.
fn check_common(what: &str, all: &[SurfaceMesh]) {
    let mut found: HashMap<Triangle, u32> = HashMap::new();
    let lists: Vec<_> = all.iter().map(triangles).collect();
    for (t, _) in lists.iter().flatten() {
        *found.entry(*t).or_default() += 1;
    }
    for (t, cut) in lists.iter().flatten() {
        assert_eq!(found[t], 1, "{what}: a triangle occurs twice");
        assert_eq!(found.contains_key(&turned(*t)), !cut, "{what}: a triangle between two parts is in both");
    }
}

/// Every guarantee, of each of the meshes and of all together.
fn check_all(what: &str, all: &[SurfaceMesh]) {
    for (space, s) in Space::ALL.iter().zip(all) {
        if let Some(why) = fault(&s.mesh) {
            panic!("{what}, {}: {why}", space.name());
        }
    }
    check_common(what, all);
}

fn volume(all: &[SurfaceMesh]) -> f64 {
    all.iter().map(|s| size(&s.mesh).volume).sum()
}

/// Which of the meshes contain a point; `None` within `near` of any of their surfaces.
fn within(distances: &[MeshDistance], p: Vec3, near: f64) -> Option<Vec<usize>> {
    let values: Vec<f64> = distances.iter().map(|d| d.value(p)).collect();
    let clear = values.iter().all(|v| v.abs() > near);
    clear.then(|| (0..values.len()).filter(|i| values[*i] < 0.0).collect())
}

/// Random sheets in random regions with levels of all kinds, bare, in a skin or with a kept ball. More designs
/// in `make campaign`.
#[test]
fn wall_and_spaces_fill_the_region() {
    for seed in 0..cases(3) {
        let mut some = Random(0x9a27 + seed);
        let cell = catalogue()[some.below(catalogue().len())].name;
        let share = some.between(0.1, 0.6);
        let level = match some.below(3) {
            0 => Level::Fraction(Grade::Constant(share)),
            1 => {
                let text = format!("{share} * (1 + 0.5 * sin(3 * x))");
                Level::Fraction(Grade::from(Formula::parse(&text).expect("formula")))
            }
            _ => Level::Iso(Grade::Constant(share)),
        };
        let wavelength = [0; 3].map(|_| some.between(0.6, 1.5));
        let turn = some.point(180.0);
        let field = lattice_at(cell, Part::Sheet, level.clone(), wavelength, turn);
        let kind = some.below(8);
        let region: Region = match kind {
            7 => Arc::new(
                MeshRegion::new(moved(angle(), some.point(180.0), some.point(0.2)), Repair::Refuse).expect("clean"),
            ),
            _ => region(kind, some.between(0.6, 1.1), some.between(-0.2, 0.2), some.between(0.3, 0.9)),
        };
        let bare = Solid::new(region.clone(), Some(field.clone()), 1.0);
        let with = some.below(3);
        let solid = match with {
            1 => bare.with(skin(&region, &Grade::Constant(some.between(0.05, 0.15)), &[]).expect("skin")),
            2 => {
                let mut surfaces = Vec::new();
                let tree = ball(some.point(0.5), some.between(0.2, 0.5)).surfaces(0.0, &mut surfaces);
                bare.with(CsgSolid { surfaces, tree })
            }
            _ => bare,
        };
        let what = format!("seed {seed}: {cell} {share:.3} region {kind}, filled {with}");
        let all = match spaces(&solid, &Space::ALL, some.between(0.04, 0.09), false, &Silent) {
            Ok(all) => all.into_iter().map(|s| s.made.surface).collect::<Vec<_>>(),
            // A level beyond the range of the cell leaves one of the spaces empty.
            Err(Stopped::Refused(fault)) if fault.message.contains("no surface") => continue,
            Err(other) => panic!("{what}: {other:?}"),
        };
        check_all(&what, &all);
        if let (0, Some(exact)) = (kind, region.volume()) {
            // Sums of some ten thousand terms of the size of the whole.
            assert!((volume(&all) / exact - 1.0).abs() < 1e-9, "{what}: {} of {exact}", volume(&all));
        }
        // By points: which solid each is in, by the functions of the design alone.
        let core = lattice_at(cell, Part::Lower, Level::Iso(Grade::Constant(0.0)), wavelength, turn);
        let distances: Vec<MeshDistance> =
            all.iter().map(|s| MeshDistance::new(s.mesh.clone(), Repair::Refuse).expect("closed")).collect();
        let bounds = region.bounds();
        for _ in 0..200 {
            let p = [0, 1, 2].map(|a| some.between(bounds.min[a], bounds.max[a]));
            // Chords of curved surfaces are less than a step away from them, thin walls at most so.
            let Some(found) = within(&distances, p, 0.09) else { continue };
            if region.value(p) > 0.0 {
                assert!(found.is_empty(), "{what}: {p:?} is outside");
                continue;
            }
            let expected = if solid.value(p) < 0.0 {
                0
            } else if core.value(p) < 0.0 {
                1
            } else {
                2
            };
            assert_eq!(found, [expected], "{what}: {p:?}");
        }
    }
}

/// An open face of a skin is open for both spaces; they meet nothing but the wall.
#[test]
fn open_faces_belong_to_the_spaces() {
    let level = Level::Fraction(Grade::Constant(0.25));
    let field = lattice_at("gyroid", Part::Sheet, level, [1.0; 3], [0.0; 3]);
    let region = cuboid([0.0; 3], [2.0, 2.0, 1.5]);
    let top = HalfSpace::new([0.0, 0.0, 1.5], [0.0, 0.0, 1.0]).expect("half-space");
    let body = skin(&region, &Grade::Constant(0.1), &[top.into()]).expect("skin");
    let all = made(&Solid::new(region, Some(field), 1.0).with(body), 0.05);
    check_all("open face", &all);
    assert!((volume(&all) / 6.0 - 1.0).abs() < 1e-9);
    for s in &all[1..] {
        let cut = s.mesh.triangles.iter().zip(&s.cut).filter(|t| *t.1);
        let mut heights = cut.flat_map(|(t, _)| t.map(|v| s.mesh.vertices[v as usize][2]));
        assert!(heights.all(|z| z == 1.5), "the region is met at the open face alone");
        assert!(s.cut.contains(&true));
    }
}

/// The same meshes in the order asked for, and no others.
#[test]
fn a_selection_is_the_same_meshes() {
    let level = Level::Iso(Grade::Constant(0.3));
    let field = lattice_at("diamond", Part::Sheet, level, [1.0; 3], [10.0, 20.0, 30.0]);
    let solid = Solid::new(ball([0.0; 3], 0.9), Some(field), 1.0);
    let all = made(&solid, 0.06);
    let two = spaces(&solid, &[Space::Upper, Space::Wall], 0.06, false, &Silent).expect("spaces");
    assert_eq!(two.iter().map(|s| s.space).collect::<Vec<_>>(), [Space::Upper, Space::Wall]);
    assert!(two[0].made.surface == all[2] && two[1].made.surface == all[0]);
}

/// Networks have no mid-surface; a wall that vanishes somewhere separates nothing there.
#[test]
fn what_separates_nothing_is_refused() {
    let refused = |part, level| {
        let field = lattice_at("gyroid", part, level, [1.0; 3], [0.0; 3]);
        let solid = Solid::new(cuboid([0.0; 3], [1.0; 3]), Some(field), 1.0);
        match spaces(&solid, &Space::ALL, 0.05, false, &Silent) {
            Err(Stopped::Refused(fault)) => fault.to_string(),
            other => panic!("{:?}", other.map(|all| all.len())),
        }
    };
    assert!(refused(Part::Lower, Level::Iso(Grade::Constant(0.1))).contains("no lower and upper side"));
    let fading = Grade::from(Formula::parse("0.3 - 0.5 * x").expect("formula"));
    assert!(refused(Part::Sheet, Level::Iso(fading)).contains("no thickness"));
}
