//! Laws of blends: fractions through transitions, the field, the surface.

use std::sync::Arc;

use geometry::math::{Aabb, Interval, Vec3};
use geometry::progress::Silent;
use trabecula::blend::{Blend, BlendRule, Constituent, Phases, Weights};
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::design::{Design, NoFiles};
use trabecula::extract::surface;
use trabecula::field::{Block, Field};
use trabecula::grade::{Formula, Grade, Linear, Sigmoid};
use trabecula::implicit::Implicit;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::Affine;
use trabecula::solid::Solid;

use crate::common::{check, cuboid};

fn made(name: &str, part: Part, level: Level, wavelength: f64, rotate: Vec3) -> Arc<Lattice> {
    let cell = Cell::new(Series::new(named(name).expect(name).terms()).expect(name));
    let map = Affine::rigid([wavelength; 3], rotate, [0.0; 3], &[]).expect("map");
    Arc::new(Lattice::new(Arc::new(cell), Arc::new(map), part, level))
}

fn share(name: &str, part: Part, fraction: f64, wavelength: f64) -> Arc<Lattice> {
    let level = Level::Fraction(Grade::Constant(fraction));
    made(name, part, level, wavelength, [0.0; 3])
}

fn formula(text: &str) -> Grade {
    Grade::from(Formula::parse(text).expect(text))
}

/// From the first to the second over `width` mm about x = 0.
fn step(width: f64) -> Weights {
    Weights::between(Grade::from(
        Linear::new([1.0, 0.0, 0.0], vec![[-width / 2.0, 0.0], [width / 2.0, 1.0]]).expect("ramp"),
    ))
}

const BOUNDS: Aabb = Aabb { min: [-24.0, -14.0, -14.0], max: [24.0, 14.0, 14.0] };

fn blend(of: &[Arc<Lattice>], weights: Weights, by: BlendRule) -> Blend {
    let of = of.iter().map(|l| Constituent::Lattice(l.clone())).collect();
    Blend::new(of, weights, by, &BOUNDS).expect("blend")
}

/// Points of a window about a place: densest in its middle and none `reach` away from it along any axis (a raised
/// cosine, which is half as high at half of that). Whole waves up to that length leave no trace in it, wherever it is.
fn window(middle: Vec3, reach: f64, count: usize) -> Vec<Vec3> {
    let warp = |share: f64| {
        let (mut lo, mut hi) = (-1.0, 1.0);
        for _ in 0..40 {
            let s: f64 = 0.5 * (lo + hi);
            let below = 0.5 * (1.0 + s + (std::f64::consts::PI * s).sin() / std::f64::consts::PI);
            if below < share { lo = s } else { hi = s }
        }
        0.5 * (lo + hi)
    };
    let table: Vec<f64> = (0..=1000).map(|i| warp(f64::from(i) / 1000.0)).collect();
    let at = |u: f64| table[(u * 1000.0) as usize];
    let each = (0..count).map(|i| {
        let u = [0.8191725134, 0.6710436067, 0.5497004779].map(|a| (0.5 + a * i as f64).fract());
        core::array::from_fn(|a| middle[a] + reach * at(u[a]))
    });
    each.collect()
}

/// Solid fraction found and asked for in the window.
fn fractions(blend: &Blend, points: &[Vec3]) -> [f64; 2] {
    let mut v = vec![0.0; points.len()];
    blend.values(points, &mut v);
    let solid = v.iter().filter(|v| **v <= 0.0).count() as f64 / v.len() as f64;
    blend.fractions(points, &mut v);
    [solid, v.iter().sum::<f64>() / v.len() as f64]
}

/// Every kind of pair: which lattices, and how their phases go together.
fn pairs() -> Vec<(&'static str, [Arc<Lattice>; 2], Phases)> {
    use Part::{Lower, Sheet, Upper};
    let graded = |text: &str| Level::Fraction(formula(text));
    let turned = made("gyroid", Upper, Level::Fraction(Grade::Constant(0.3)), 1.2, [20.0, 30.0, 40.0]);
    let wall = Level::Thickness(Grade::Constant(0.4));
    vec![
        ("networks", [share("primitive", Upper, 0.3, 4.0), share("gyroid", Upper, 0.3, 4.0)], Phases::Locked),
        ("halves", [share("primitive", Upper, 0.3, 4.0), share("iwp", Lower, 0.3, 2.0)], Phases::Locked),
        ("turned", [turned, share("diamond", Upper, 0.3, 5.0)], Phases::Independent),
        ("beats", [share("primitive", Upper, 0.3, 4.0), share("gyroid", Upper, 0.4, 4.1)], Phases::Drifting),
        ("sheets", [share("primitive", Sheet, 0.3, 4.0), share("neovius", Sheet, 0.3, 5.0)], Phases::Drifting),
        ("sheet and network", [share("gyroid", Sheet, 0.3, 4.0), share("gyroid", Lower, 0.4, 4.0)], Phases::Locked),
        (
            "wall and sheet",
            [made("gyroid", Sheet, wall, 4.0, [0.0; 3]), share("diamond", Sheet, 0.3, 5.0)],
            Phases::Drifting,
        ),
        (
            "graded",
            [
                made("gyroid", Sheet, graded("0.3 + 0.01*y"), 4.0, [0.0; 3]),
                made("iwp", Lower, graded("0.35 + 0.005*x"), 5.0, [0.0; 3]),
            ],
            Phases::Drifting,
        ),
    ]
}

/// The promise: within 0.01 in windows of two of the larger cells (at half their height), whatever is blended. In a
/// transition of two cells each share is met in one plane of one cell, whose own fraction is not the cell's: what that
/// leaves is of first order in cells over transition, and up to 0.002 more.
#[test]
fn the_fraction_is_held_through_every_transition() {
    for (what, of, phases) in pairs() {
        let cell = of.iter().map(|l| l.map.longest()).fold(0.0, f64::max);
        for wide in [2.0, 4.0] {
            let blend = blend(&of, step(wide * cell), BlendRule::Fraction);
            assert_eq!(blend.phases(), Some(phases), "{what}");
            for i in -3..=3 {
                // No multiple of any cell.
                let at = [0.29 * wide * cell * f64::from(i), 0.37, -0.21];
                let [found, asked] = fractions(&blend, &window(at, 2.0 * cell, 12_000));
                // Twelve thousand even points tell a fraction to about 0.001.
                assert!((found - asked).abs() < 0.01, "{what}, {wide} cells, {i}: {found:.4} for {asked:.4}");
            }
        }
    }
}

/// Equation 16 as printed: two lattices of 0.30 give about 0.197 half-way (the seed's sum, by other means).
#[test]
fn by_value_material_is_lost_half_way() {
    let of = [share("primitive", Part::Upper, 0.3, 4.0), share("gyroid", Part::Upper, 0.3, 4.0)];
    let half = blend(&of, Weights::between(Grade::Constant(0.5)), BlendRule::Value);
    let [found, asked] = fractions(&half, &window([0.0; 3], 8.0, 40_000));
    assert!((asked - 0.3).abs() < 1e-9);
    assert!((found - 0.197).abs() < 0.002, "{found}");
    let kept = blend(&of, Weights::between(Grade::Constant(0.5)), BlendRule::Fraction);
    let [found, _] = fractions(&kept, &window([0.0; 3], 8.0, 40_000));
    assert!((found - 0.3).abs() < 0.002, "{found}");
}

/// Three lattices, each with its own weight, and one of them a plain field whose fraction nobody gave.
#[test]
fn any_number_of_fields_takes_part() {
    struct Balls;
    impl Implicit for Balls {
        fn lipschitz(&self) -> f64 {
            1.0
        }
    }
    impl Field for Balls {
        fn values(&self, points: &[Vec3], out: &mut [f64]) {
            for (o, p) in out.iter_mut().zip(points) {
                let r = p.map(|x| x - 3.0 * (x / 3.0).round());
                *o = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt() - 1.4;
            }
        }
        fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
            self.values(points, values);
            for ((g, p), v) in gradients.iter_mut().zip(points).zip(values) {
                *g = p.map(|x| (x - 3.0 * (x / 3.0).round()) / (*v + 1.4));
            }
        }
        fn bound(&self, _: &Aabb) -> Interval {
            Interval::new(-1.4, 1.3)
        }
    }
    let of = vec![
        Constituent::Lattice(share("gyroid", Part::Upper, 0.3, 4.0)),
        Constituent::Lattice(share("primitive", Part::Upper, 0.3, 4.0)),
        Constituent::Field { field: Arc::new(Balls), wavelength: 3.0 },
    ];
    let weights = Weights::shares(vec![formula("exp(-x/8)"), formula("exp(-(y/12)^2)"), formula("exp(x/8)")]);
    let blend = Blend::new(of, weights, BlendRule::Fraction, &BOUNDS).expect("blend");
    // Balls of radius 1.4 in cubes of 3.
    let balls = 4.0 / 3.0 * std::f64::consts::PI * 1.4f64.powi(3) / 27.0;
    for i in -2..=2 {
        let points = window([1.7 * f64::from(i), 0.5, 0.3], 8.0, 20_000);
        let mut w = vec![0.0; 3 * points.len()];
        blend.weights().values(&points, &mut w);
        let asked = w.chunks_exact(3).map(|w| 0.3 * (w[0] + w[1]) + balls * w[2]).sum::<f64>() / points.len() as f64;
        let mut v = vec![0.0; points.len()];
        blend.values(&points, &mut v);
        let found = v.iter().filter(|v| **v <= 0.0).count() as f64 / v.len() as f64;
        assert!((found - asked).abs() < 0.01, "{i}: {found:.4} for {asked:.4}");
    }
}

/// A sheet or a network that passes into beams, whose fraction nobody gave: the share of an octet's cell that is solid is
/// counted on one cell.
#[test]
fn lattices_pass_into_beams_with_their_fractions() {
    let text = "schema = 1\n[region.box]\nsize = [64, 36, 36]\n[beams.a]\ncell = \"octet\"\nradius = 0.45\nmap.affine.wavelength = 5";
    let built = Design::from_toml(text).expect("text").build(&NoFiles).expect("built");
    let beams = built.beams[0].1.field();
    let mut cell = window([0.0; 3], 0.0, 40_000);
    for (i, p) in cell.iter_mut().enumerate() {
        *p = [0.8191725134, 0.6710436067, 0.5497004779].map(|a| 5.0 * (a * i as f64).fract());
    }
    let mut v = vec![0.0; cell.len()];
    beams.values(&cell, &mut v);
    let own = v.iter().filter(|v| **v <= 0.0).count() as f64 / v.len() as f64;
    for (part, fraction) in [(Part::Sheet, 0.3), (Part::Sheet, 0.15), (Part::Upper, 0.3)] {
        let lattice = share("gyroid", part, fraction, 4.0);
        let of = vec![Constituent::Lattice(lattice), Constituent::Field { field: beams.clone(), wavelength: 5.0 }];
        let blend = Blend::new(of, step(15.0), BlendRule::Fraction, &BOUNDS).expect("blend");
        for i in -4..=4 {
            let points = window([1.7 * f64::from(i), 0.37, -0.21], 10.0, 20_000);
            let mut w = vec![0.0; 2 * points.len()];
            blend.weights().values(&points, &mut w);
            let asked = w.chunks_exact(2).map(|w| fraction * w[0] + own * w[1]);
            let asked = asked.sum::<f64>() / points.len() as f64;
            let mut v = vec![0.0; points.len()];
            blend.values(&points, &mut v);
            let found = v.iter().filter(|v| **v <= 0.0).count() as f64 / v.len() as f64;
            println!("{part:?} {fraction} {i}: {found:.4} for {asked:.4}");
            assert!((found - asked).abs() < 0.01, "{part:?} {fraction}, {i}: {found:.4} for {asked:.4}");
        }
    }
}

/// A lattice over tetrahedra ends with the region, and nothing beyond counts: what is asked for beside the surface is the
/// fraction that its tetrahedra have, all the same one.
#[test]
fn what_lies_beyond_the_region_is_not_counted() {
    let text = "schema = 1\n[region.box]\nsize = [24, 12, 12]\n\
        [lattice.a]\ncell.tet.name = \"diamond\"\npart = \"lower\"\nmap.tets.size = 3\nlevel.fraction = 0.3\n\
        [lattice.b]\ncell = \"gyroid\"\npart = \"upper\"\nmap.affine.wavelength = 4\nlevel.fraction = 0.3\n\
        [blend]\nbetween = [\"a\", \"b\"]\nweight.linear = { along = [1, 0, 0], stops = [[-12, 0.0], [12, 1]] }";
    let built = Design::from_toml(text).expect("text").build(&NoFiles).expect("built");
    let blend = built.blend.expect("blend").blend;
    for y in [-5.9, 0.0, 5.9] {
        let points: Vec<Vec3> =
            (0..400).map(|i| [-11.9 + 0.5 * f64::from(i % 20), y, -5.7 + 0.6 * f64::from(i / 20)]).collect();
        let mut asked = vec![0.0; points.len()];
        blend.fractions(&points, &mut asked);
        let mean = asked.iter().sum::<f64>() / points.len() as f64;
        println!("{y}: {mean:.4}");
        // Windows over a handful of tetrahedra that they cut, at some neighbourhoods in a layer.
        assert!((mean - 0.3).abs() < 0.01, "{y}: {mean:.4}");
    }
}

/// Where one lattice counts alone its surface is there, to the last bit; and a lattice blended with itself is itself.
#[test]
fn alone_and_with_itself_a_lattice_is_itself() {
    for (what, of, _) in pairs() {
        let cell = of.iter().map(|l| l.map.longest()).fold(0.0, f64::max);
        let blend = blend(&of, step(cell), BlendRule::Fraction);
        for (points, own) in [([-6.0 - cell, 0.0, 0.0], &of[0]), ([6.0 + cell, 0.0, 0.0], &of[1])] {
            let points = window(points, 6.0, 500);
            let (mut a, mut b) = (vec![0.0; 500], vec![0.0; 500]);
            blend.values(&points, &mut a);
            own.values(&points, &mut b);
            for (a, b) in a.iter().zip(&b) {
                // In other units.
                assert!(a * b > 0.0 || b.abs() < 1e-12, "{what}: {a} {b}");
            }
        }
        let same = [of[0].clone(), of[0].clone()];
        let points = window([0.0; 3], 6.0, 4000);
        let (mut a, mut b) = (vec![0.0; 4000], vec![0.0; 4000]);
        self::blend(&same, step(6.0), BlendRule::Value).values(&points, &mut a);
        of[0].values(&points, &mut b);
        assert!(a.iter().zip(&b).all(|(a, b)| a * b > 0.0 || (a - b).abs() < 1e-9), "{what}");
    }
}

#[test]
fn gradients_blocks_and_bounds_agree_with_values() {
    for (what, of, _) in pairs() {
        for by in [BlendRule::Fraction, BlendRule::Value] {
            let whole = blend(&of, step(7.0), by);
            let mut sides: Vec<Arc<dyn Implicit>> = whole.parts();
            sides.push(Arc::new(whole));
            for field in sides {
                let axis: Vec<f64> = (0..25).map(|i| 0.37 * f64::from(i) - 4.1).collect();
                let block = Block { axes: [&axis, &axis[..9], &axis[3..12]] };
                let mut out = vec![0f32; block.len()];
                field.fill(&block, &mut out);
                for (i, v) in out.iter().enumerate() {
                    let p = [axis[i % 25], axis[i / 25 % 9], axis[3 + i / 225]];
                    // Cores in single precision, of up to some ten units.
                    assert!((f64::from(*v) - field.value(p)).abs() < 2e-5, "{what} {by:?}: {v} {}", field.value(p));
                }
                for (i, p) in window([0.0; 3], 6.0, 300).into_iter().enumerate() {
                    let size = 0.01 * (i % 90) as f64;
                    let b = Aabb { min: p, max: p.map(|x| x + size) };
                    let (bound, v) = (field.bound(&b), field.value(p.map(|x| x + 0.6 * size)));
                    assert!(bound.lo <= v && v <= bound.hi, "{what} {by:?}");
                    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                    field.gradients(&[p], &mut v, &mut g);
                    assert!((v[0] - field.value(p)).abs() < 1e-12);
                    for a in 0..3 {
                        let h = 1e-5;
                        let (mut lo, mut hi) = (p, p);
                        lo[a] -= h;
                        hi[a] += h;
                        let (l, r) = (field.value(lo), field.value(hi));
                        // Tables are linear from knot to knot: not across a crease.
                        if ((r - v[0]) - (v[0] - l)).abs() < 1e-7 {
                            let slope = (r - l) / (2.0 * h);
                            assert!((g[0][a] - slope).abs() < 2e-2, "{what} {by:?} at {p:?}: {} {slope}", g[0][a]);
                        }
                    }
                }
            }
        }
    }
}

/// Inside transitions, too, small boxes are proven empty or full, and those that are proven so are.
#[test]
fn bounds_tell_empty_places_within_transitions() {
    for (what, of, _) in pairs() {
        for by in [BlendRule::Fraction, BlendRule::Value] {
            let field = blend(&of, step(30.0), by);
            let (mut proven, mut clear) = (0, 0);
            for p in window([0.0; 3], 9.0, 400) {
                let b = Aabb { min: p, max: p.map(|x| x + 0.1) };
                let v = field.value(p.map(|x| x + 0.03));
                let r = field.bound(&b);
                assert!(r.lo <= v && v <= r.hi, "{what} {by:?}: {r:?} {v}");
                proven += usize::from(r.lo > 0.0 || r.hi < 0.0);
                // No face of any kind within some steps of the box.
                let lipschitz = field.lipschitz();
                clear += usize::from(v.abs() > 0.35 * lipschitz);
            }
            assert!(proven > 20 && 4 * proven > clear, "{what} {by:?}: {proven} of {clear}");
        }
    }
}

/// What is meshed is closed, manifold and free of crossings, in thin walls and where one part turns into another.
#[test]
fn surfaces_of_blends_are_whole() {
    let region = cuboid([-7.0, -3.0, -3.0], [7.0, 3.0, 3.0]);
    for (what, of, _) in pairs() {
        let of = of.map(Constituent::Lattice).to_vec();
        let weight = Sigmoid::new(formula("x + 0.2*y"), 0.0, 9.0).expect("step");
        let weights = Weights::between(Grade::from(weight));
        let blend = Blend::new(of, weights, BlendRule::Fraction, &BOUNDS).expect("blend");
        let solid = Solid::new(region.clone(), Some(Arc::new(blend)), 4.0);
        let made = surface(&solid, 0.31, &Silent).expect(what);
        check(what, &made);
    }
}

#[test]
fn a_transition_finer_than_the_grid_is_refused() {
    let of = [share("primitive", Part::Upper, 0.3, 4.0), share("gyroid", Part::Upper, 0.3, 4.0)];
    let mut solid =
        Solid::new(cuboid([-4.0; 3], [4.0; 3]), Some(Arc::new(blend(&of, step(0.2), BlendRule::Fraction))), 4.0);
    solid.transition = Some(0.2);
    let fault = surface(&solid, 0.25, &Silent).expect_err("too coarse");
    assert!(format!("{fault:?}").contains("transition"), "{fault:?}");
    assert!(surface(&solid, 0.19, &Silent).is_ok());
}
