//! Necks of networks, and the largest ball that passes through the void.

use core::f64::consts::{FRAC_PI_4, PI, TAU};

use geometry::math::{Mat3, Vec3, add, dot, norm, product, rotation, scale, sub, unit};
use geometry::random::random;
use proptest::prelude::*;
use trabecula::cell::{Cell, Part, Series, Term, catalogue, named};
use trabecula::design::{Built, Design, DesignError, NoFiles};
use trabecula::report::Varying;

use crate::common::{cases, rows};

fn cell(name: &str) -> Cell {
    Cell::new(Series::new(named(name).expect(name).terms()).expect(name))
}

fn cosines(of: &[[i32; 3]]) -> Cell {
    let terms = of.iter().map(|&hkl| Term { hkl, amplitude: 1.0, phase: 0.0 });
    Cell::new(Series::new(terms.collect()).expect("series"))
}

fn cubic(wavelength: f64) -> Mat3 {
    geometry::math::IDENTITY.map(|r| scale(r, 1.0 / wavelength))
}

/// Unequal wavelengths and a shear.
fn map(ratios: [f64; 2], shear: f64) -> Mat3 {
    [[1.0, shear, 0.0], [0.0, 1.0 / ratios[0], 0.0], [0.0, 0.0, 1.0 / ratios[1]]]
}

fn names() -> Vec<&'static str> {
    catalogue().iter().map(|c| c.name).collect()
}

proptest! {
    // 5 in `make test`.
    #![proptest_config(ProptestConfig { cases: cases(3) as u32, ..ProptestConfig::default() })]

    /// Space may be turned and scaled: necks turn and scale with it, to rounding. The distance from a neck to the surface is
    /// searched on a grid that does not turn; one of several nearly nearest points in place of the nearest costs some 1e-4.
    #[test]
    fn necks_turn_and_scale_with_space(
        name in proptest::sample::select(names()),
        upper in any::<bool>(),
        fraction in 0.25..0.6f64,
        ratios in prop::array::uniform2(0.8..1.25f64),
        shear in -0.2..0.2f64,
        turn in prop::array::uniform3(0.0..360.0f64),
        size in 0.1..10.0f64,
    ) {
        let part = if upper { Part::Upper } else { Part::Lower };
        let (cell, map) = (cell(name), map(ratios, shear));
        let iso = cell.level(part, fraction);
        let moved = product(&map, &rotation(turn)).map(|r| scale(r, 1.0 / size));
        let (a, b) = (cell.thickness(part, iso, &map), cell.thickness(part, iso, &moved));
        prop_assert_eq!(a.is_some(), b.is_some());
        if let (Some(a), Some(b)) = (a, b) {
            prop_assert!((b - size * a).abs() <= 1e-8 * size * a, "{a} {}", b / size);
        }
    }

    /// Moved in the cell, a function has the same pore, though the nodes about its bottleneck are others: to rounding where the
    /// saddle of the distance is found. Where several passes are nearly as wide the radius is that of a node, which stands for a
    /// ball within a quarter of a grid step: of two grids of 24 nodes on an edge, whose diagonal is the step.
    #[test]
    fn pores_do_not_depend_on_the_grid(
        name in proptest::sample::select(names()),
        fraction in 0.2..0.5f64,
        ratios in prop::array::uniform2(0.8..1.25f64),
        shear in -0.2..0.2f64,
        by in prop::array::uniform3(0.0..1.0f64),
    ) {
        let (cell, map) = (cell(name), map(ratios, shear));
        let iso = cell.level(Part::Lower, fraction);
        let moved = cell.series().terms().iter().map(|t| {
            let phase = t.phase + (0..3).map(|a| f64::from(t.hkl[a]) * by[a]).sum::<f64>();
            Term { phase, ..*t }
        });
        let moved = Cell::new(Series::new(moved.collect()).expect("series"));
        let (a, b) = (cell.pore(Part::Upper, iso, &map), moved.pore(Part::Upper, iso, &map));
        let step = norm([1.0, ratios[0], ratios[1]]) / 24.0;
        prop_assert!((a - b).abs() <= 2.0 * 0.25 * step, "{name}: {a} {b}");
    }
}

/// Between slabs cos 2πx ≤ t the pore is the gap, acos(t)/π of the wavelength.
#[test]
fn gaps_between_slabs() {
    let cell = cosines(&[[1, 0, 0]]);
    for t in [-0.9, -0.3, 0.0, 0.5, 0.99f64] {
        let found = cell.pore(Part::Upper, t, &cubic(5.0));
        assert!((found - 5.0 * t.acos() / PI).abs() < 1e-6, "{t}: {found}");
    }
    let level = cell.level_of_pore(Part::Lower, 1.5, &cubic(5.0)).expect("a level");
    assert!((level - (0.3 * PI).cos()).abs() < 1e-5, "{level}");
}

/// Channels cos 2πx + cos 2πy ≥ t ≥ 0 along z: the nearest points lie on the diagonals, where both cosines are t/2.
#[test]
fn channels() {
    let cell = cosines(&[[1, 0, 0], [0, 1, 0]]);
    for t in [0.0, 0.5, 1.0, 1.5f64] {
        let want = 2.0 * 2f64.sqrt() * (t / 2.0).acos() / TAU;
        let found = cell.pore(Part::Upper, t, &cubic(1.0));
        assert!((found - want).abs() < 1e-6, "{t}: {found} {want}");
    }
}

/// In the primitive's symmetric neck the ball about the saddle touches where cos a + cos b = 1 + t with a = b, in the plane across.
#[test]
fn the_primitives_pore_is_its_neck() {
    let cell = cell("primitive");
    for t in [-0.5, 0.0, 0.5, 0.9, 0.99, 0.999, 0.9999, 0.999_999f64] {
        let found = cell.pore(Part::Upper, t, &cubic(1.0));
        let diagonal = 2.0 * 2f64.sqrt() * ((1.0 + t) / 2.0).acos() / TAU;
        let neck = cell.thickness(Part::Upper, t, &cubic(1.0)).expect("a neck");
        assert!(
            (found - neck).abs() < 1e-8 * neck.max(diagonal) && found <= diagonal + 1e-9 && found > 0.98 * diagonal,
            "{t}: {found} {neck}"
        );
    }
}

/// The strut of the gyroid's network from (−1, −1, −1)/8 to (1, −3, −1)/8 is widest half-way, at the saddle of f, and its neck is the least
/// over its cross-sections of the largest ball in one: by points of the surface, which leave a ball at most a thousandth too large.
#[test]
fn struts_are_measured_where_they_are_narrowest() {
    let gyroid = cell("gyroid");
    for fraction in [0.35, 0.484] {
        let iso = gyroid.level(Part::Lower, fraction);
        let (from, along) = ([-0.125; 3], [0.25, -0.25, 0.0]);
        let [e1, e2] = [unit([1.0, 1.0, 0.0]), [0.0, 0.0, 1.0]];
        let mut state = 7;
        let mut u: Vec<Vec3> =
            (0..150_000).map(|_| add(from, [0, 1, 2].map(|k| 0.5 * along[k] + 0.3 * random(&mut state)))).collect();
        let (mut v, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
        for _ in 0..6 {
            gyroid.gradients(&u, &mut v, &mut g);
            for ((u, v), g) in u.iter_mut().zip(&v).zip(&g) {
                *u = add(*u, scale(*g, (iso - v) / dot(*g, *g).max(0.1)));
            }
        }
        gyroid.gradients(&u, &mut v, &mut g);
        u = u.into_iter().zip(v).filter(|(_, v)| (v - iso).abs() < 1e-9).map(|(u, _)| u).collect();
        // The largest ball about a point of the cross-section, by ever smaller moves.
        let ball = |share: f64| {
            let centre = add(from, scale(along, share));
            let near: Vec<Vec3> = u.iter().copied().filter(|p| norm(sub(*p, centre)) < 0.35).collect();
            let radius = |a: f64, b: f64| {
                let x = add(centre, add(scale(e1, a), scale(e2, b)));
                near.iter().map(|p| norm(sub(*p, x))).fold(f64::INFINITY, f64::min)
            };
            let (mut at, mut step) = ([0.0; 2], 0.02);
            while step > 1e-4 {
                let moves = [
                    [1.0, 0.0],
                    [-1.0, 0.0],
                    [0.0, 1.0],
                    [0.0, -1.0],
                    [1.0, 1.0],
                    [-1.0, -1.0],
                    [1.0, -1.0],
                    [-1.0, 1.0],
                ];
                let next = moves.map(|d| [at[0] + step * d[0], at[1] + step * d[1]]);
                match next.into_iter().find(|n| radius(n[0], n[1]) > radius(at[0], at[1])) {
                    Some(better) => at = better,
                    None => step *= 0.5,
                }
            }
            2.0 * radius(at[0], at[1])
        };
        let least = (0..=10).map(|i| ball(0.05 * f64::from(i))).fold(f64::INFINITY, f64::min);
        let middle = ball(0.5);
        let found = gyroid.thickness(Part::Lower, iso, &cubic(1.0)).expect("a neck");
        println!("{fraction}: {found} {least} half-way {middle}");
        assert!(middle > 1.03 * least && (found / least - 1.0).abs() < 3e-3, "{fraction}: {found} {least} {middle}");
        let (turned, other) = (gyroid.pore(Part::Lower, iso, &cubic(1.0)), cell("gyroid_mirrored"));
        assert!(
            (found - turned).abs() < 1e-9
                && (other.thickness(Part::Lower, iso, &cubic(1.0)).expect("a neck") - found).abs() < 1e-6
        );
    }
}

/// Both voids of a sheet have the pore that each has alone, whether a translation or an inversion takes f to −f or none does.
#[test]
fn pores_of_a_sheet_are_those_of_its_sides() {
    for (name, alike) in [("gyroid", true), ("diamond", true), ("primitive", true), ("iwp", false), ("frd", false)] {
        let (cell, map) = (cell(name), cubic(1.0));
        let iso = cell.level(Part::Sheet, 0.35);
        let both = cell.pores(Part::Sheet, iso, &map);
        let apart = [cell.pore(Part::Lower, -iso, &map), cell.pore(Part::Upper, iso, &map)];
        assert!(both.iter().zip(apart).all(|(a, b)| (a - b).abs() < 1e-6), "{name} {both:?} {apart:?}");
        assert_eq!(alike, both[0] == both[1], "{name} {both:?}");
    }
}

/// Pores of sheets fall smoothly as these get thicker. The diamond's, whose necks are symmetric, were off by up to a hundredth
/// where their saddle was not found.
#[test]
fn pores_fall_smoothly() {
    for (name, first) in rows(1, [("diamond", 27), ("gyroid", 15)]) {
        let cell = cell(name);
        let pore = |k: i32| cell.pores(Part::Sheet, cell.level(Part::Sheet, 0.01 * f64::from(k)), &cubic(1.0))[0];
        let found: Vec<f64> = (first..41).map(pore).collect();
        for three in found.windows(3) {
            let bend = three[0] - 2.0 * three[1] + three[2];
            assert!(bend.abs() < 1e-4, "{name} {bend} {found:?}");
        }
    }
}

/// Less solid, wider pores; none where the void falls apart; a repeated cell has those of the one that it repeats.
#[test]
fn pores_narrow_as_solid_grows() {
    let gyroid = cell("gyroid");
    let found: Vec<f64> =
        [0.1, 0.3, 0.5, 0.7, 0.9].map(|p| gyroid.pore(Part::Upper, gyroid.level(Part::Lower, p), &cubic(1.0))).to_vec();
    assert!(found.is_sorted_by(|a, b| a > b) && found[4] > 0.0, "{found:?}");
    // From distances at the nodes of a fine grid (1e-3, from below) by an independent program.
    assert!((found[2] - 0.4330).abs() < 1e-3, "{found:?}");
    assert_eq!(gyroid.pore(Part::Upper, 1.45, &cubic(1.0)), 0.0);
    let twice = cosines(&[[2, 0, 0], [0, 2, 0], [0, 0, 2]]);
    let [a, b] = [(&twice, 2.0), (&cell("primitive"), 1.0)].map(|(c, size)| c.pore(Part::Upper, 0.2, &cubic(size)));
    assert!((a - b).abs() < 1e-9 && FRAC_PI_4 > a, "{a} {b}");
}

fn built(lattice: &str) -> Result<Built, DesignError> {
    let text = format!("schema = 1\n[region.box]\nsize = [9, 9, 9]\n[lattice.core]\n{lattice}");
    Design::from_toml(&text)?.build(&NoFiles)
}

fn number(v: Option<Varying>) -> f64 {
    match v {
        Some(Varying::Number(v)) => v,
        other => panic!("a number, found {other:?}"),
    }
}

/// Designs have the pore that they ask for: alone, graded, and with a fraction, which together give the wavelength.
#[test]
fn designs_have_the_pore_asked_for() {
    for part in ["sheet", "lower", "upper"] {
        let of = |map: &str, level: &str| {
            let made = built(&format!(
                "cell = \"gyroid\"\npart = \"{part}\"\nmap.affine = {{ {map} }}\nlevel = {{ {level} }}"
            ));
            made.map(|m| m.report().lattices["core"].clone())
        };
        let alone = of("wavelength = 4", "pore = 1.2").expect("built");
        assert!((number(alone.pore) - 1.2).abs() < 1e-4, "{part} {:?}", alone.pore);
        let both = of("", "porosity = 0.7, pore = 0.8").expect("built");
        assert!((number(both.pore) - 0.8).abs() < 1e-4 && (number(Some(both.porosity)) - 0.7).abs() < 5e-4);
        if part != "lower" {
            continue;
        }
        let graded =
            of("wavelength = 4", "pore.linear = { along = [0, 0, 1], stops = [[-4, 1.0], [4, 1.4]] }").expect("built");
        match graded.pore {
            Some(Varying::Range([a, b])) => assert!((a - 1.0).abs() < 2e-3 && (b - 1.4).abs() < 2e-3, "{part} {a} {b}"),
            other => panic!("a range, found {other:?}"),
        }
        let refused = of("wavelength = 4", "pore = 4").expect_err("refused").to_string();
        assert!(refused.contains("at most") && refused.contains("larger wavelength"), "{refused}");
    }
    // Between slabs the gap shrinks to that of a solid fraction of 0.995; it is met down to there.
    let slabs = |pore: f64| {
        built(&format!(
            "cell.series.terms = [{{ hkl = [1, 0, 0], amplitude = 1 }}]\npart = \"lower\"\nmap.affine.wavelength = 10\nlevel.pore = {pore}"
        ))
    };
    assert!((number(slabs(0.06).expect("built").report().lattices["core"].pore) - 0.06).abs() < 1e-4);
    let refused = slabs(0.001).err().expect("refused").to_string();
    assert!(refused.contains("at least") && refused.contains("smaller wavelength"), "{refused}");
    // A step of the pore, where the pass is found on the grid alone, is no end of what the cell has.
    let stepped =
        built("cell = \"diamond\"\npart = \"sheet\"\nmap.affine.wavelength = 3\nlevel.pore = 0.6").expect("built");
    assert!((number(stepped.report().lattices["core"].pore) - 0.6).abs() < 0.006);
    // An even wall of thickness w takes w from the pore of its bare mid-surface.
    let pore = |w: f64| {
        let made =
            built(&format!("cell = \"diamond\"\npart = \"sheet\"\nmap.affine.wavelength = 5\nlevel.thickness = {w}"));
        number(made.expect("built").report().lattices["core"].pore)
    };
    assert!((pore(0.2) - pore(0.6) - 0.4).abs() < 1e-9);
}
