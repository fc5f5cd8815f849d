//! Laws of walls in blends that are no lattices: two sides, f − t and −f − t, such as those over tetrahedra have.

use std::sync::Arc;

use geometry::math::{Aabb, Vec3};
use geometry::progress::Silent;
use trabecula::blend::{Blend, BlendRule, Constituent, Weights};
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::design::{Design, NoFiles};
use trabecula::extract::surface;
use trabecula::field::{Block, Field};
use trabecula::grade::{Formula, Grade, Linear};
use trabecula::implicit::Implicit;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Affine, Map};

use crate::common::check;

const BOUNDS: Aabb = Aabb { min: [-16.0, -8.0, -8.0], max: [16.0, 8.0, 8.0] };

fn sheet(name: &str, fraction: &str, wavelength: f64) -> Arc<Lattice> {
    let cell = Cell::new(Series::new(named(name).expect(name).terms()).expect(name));
    let map = Affine::rigid([wavelength; 3], [0.0; 3], [0.0; 3], &[]).expect("map");
    let fraction = match fraction.parse() {
        Ok(p) => Grade::Constant(p),
        Err(_) => Grade::from(Formula::parse(fraction).expect(fraction)),
    };
    let level = Level::Fraction(fraction);
    let map: Map = Arc::new(map);
    Arc::new(Lattice::new(Arc::new(cell), map, Part::Sheet, level))
}

/// A lattice known by its two sides alone.
fn wall(of: &Arc<Lattice>) -> Constituent {
    Constituent::Wall {
        sides: <[_; 2]>::try_from(of.parts()).ok().expect("two sides"),
        half: of.uniform(),
        wavelength: of.map.longest(),
    }
}

fn blended(first: Constituent, second: &Arc<Lattice>, by: BlendRule) -> Blend {
    let stops = vec![[-8.0, 0.0], [8.0, 1.0]];
    let weights = Weights::between(Grade::from(Linear::new([1.0, 0.2, 0.0], stops).expect("ramp")));
    let of = vec![first, Constituent::Lattice(second.clone())];
    Blend::new(of, weights, by, &BOUNDS).expect("blend")
}

/// Places of an even sequence in the unit cube about the origin.
fn even(count: usize) -> impl Iterator<Item = Vec3> {
    let unit = [0.8191725134, 0.6710436067, 0.5497004779];
    (0..count).map(move |i| unit.map(|a| (0.5 + a * i as f64).fract() - 0.5))
}

fn points() -> Vec<Vec3> {
    even(6000).map(|u| [32.0 * u[0], 16.0 * u[1], 16.0 * u[2]]).collect()
}

/// Known by its sides a sheet is the same sheet: by value everywhere, by fraction as far as looking tells its quantiles.
#[test]
fn a_sheet_by_its_sides_is_itself() {
    let points = points();
    for fraction in ["0.25", "0.25 + 0.004*z"] {
        let (gyroid, other) = (sheet("gyroid", fraction, 4.0), sheet("primitive", "0.3", 4.3));
        for by in [BlendRule::Value, BlendRule::Fraction] {
            let whole = blended(Constituent::Lattice(gyroid.clone()), &other, by);
            let sides = blended(wall(&gyroid), &other, by);
            let (mut a, mut b) = (vec![0.0; points.len()], vec![0.0; points.len()]);
            whole.values(&points, &mut a);
            sides.values(&points, &mut b);
            let far = a.iter().zip(&b).fold(0f64, |m, (a, b)| m.max((a - b).abs()));
            match by {
                BlendRule::Value => assert!(far < 1e-12, "{fraction}: {far:e}"),
                BlendRule::Fraction => {
                    let solid = |v: &[f64]| v.iter().filter(|v| **v <= 0.0).count() as f64;
                    let off = (solid(&a) - solid(&b)).abs() / points.len() as f64;
                    // A thousand places tell a fraction to some thousandths.
                    assert!(off < 0.01, "{fraction}: {off:.4}");
                }
            }
        }
    }
}

#[test]
fn gradients_blocks_and_bounds_agree_with_values() {
    for fraction in ["0.25", "0.25 + 0.004*z"] {
        let (gyroid, other) = (sheet("gyroid", fraction, 4.0), sheet("primitive", "0.3", 4.3));
        let whole = blended(wall(&gyroid), &other, BlendRule::Fraction);
        let mut fields = whole.parts();
        assert_eq!(fields.len(), 2);
        fields.push(Arc::new(whole));
        let axis: Vec<f64> = (0..21).map(|i| 0.37 * f64::from(i) - 4.1).collect();
        for field in fields {
            let block = Block { axes: [&axis, &axis[..9], &axis[3..12]] };
            let mut out = vec![0f32; block.len()];
            field.fill(&block, &mut out);
            for (i, v) in out.iter().enumerate() {
                let p = [axis[i % 21], axis[i / 21 % 9], axis[3 + i / 189]];
                // Cores in single precision, of up to some ten units.
                assert!((f64::from(*v) - field.value(p)).abs() < 2e-5, "{p:?}");
            }
            for (i, p) in points().into_iter().take(200).enumerate() {
                let size = 0.01 * (i % 90) as f64;
                let b = Aabb { min: p, max: p.map(|x| x + size) };
                let (r, v) = (field.bound(&b), field.value(p.map(|x| x + 0.6 * size)));
                assert!(r.lo <= v && v <= r.hi, "{r:?} {v}");
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                field.gradients(&[p], &mut v, &mut g);
                assert!((v[0] - field.value(p)).abs() < 1e-12);
                for a in 0..3 {
                    let (h, mut near) = (1e-5, [p, p]);
                    near[0][a] -= h;
                    near[1][a] += h;
                    let [l, r] = near.map(|p| field.value(p));
                    // Tables are linear from knot to knot: not across a crease.
                    if ((r - v[0]) - (v[0] - l)).abs() < 1e-7 {
                        let slope = (r - l) / (2.0 * h);
                        assert!((g[0][a] - slope).abs() < 2e-2, "{} {slope}", g[0][a]);
                    }
                }
            }
        }
    }
}

/// Walls over tetrahedra that are thinner than two steps of the grid keep both their faces and so their volume, in a blend too.
#[test]
fn thin_walls_over_tetrahedra_are_kept() {
    let text = "schema = 1\n[region.box]\nsize = [9, 4, 4]\n\
        [lattice.a]\ncell.tet.name = \"diamond\"\npart = \"sheet\"\nmap.tets.size = 3\nlevel.fraction = 0.15\n\
        [lattice.b]\ncell = \"gyroid\"\npart = \"sheet\"\nmap.affine.wavelength = 4\nlevel.fraction = 0.15\n\
        [blend]\nbetween = [\"a\", \"b\"]\nweight.linear = { along = [1, 0, 0], stops = [[0, 0], [4, 1]] }";
    let design = Design::from_toml(text).expect("text");
    let built = design.build(&NoFiles).expect("built");
    let points: Vec<Vec3> = even(300_000).map(|u| [9.0 * u[0], 4.0 * u[1], 4.0 * u[2]]).collect();
    let mut v = vec![0.0; points.len()];
    // In the tetrahedra, which leave out a little of the box.
    built.solid.values(&points, &mut v);
    let share = v.iter().filter(|v| **v <= 0.0).count() as f64 / v.len() as f64;
    // A wall of 15 % in cells of about four millimetres is some 0.25 mm thick. What is meshed is off by the square of a step: a
    // quarter at half of it, less what counting leaves open.
    let off = [0.2, 0.1].map(|edge| {
        let made = surface(&built.solid, edge, &Silent).expect("surface");
        check("thin walls", &made);
        (made.mesh.volume() / (9.0 * 4.0 * 4.0) - share).abs()
    });
    println!("{off:?} of {share:.4}");
    assert!(off[0] < 0.1 * share && off[1] < 0.4 * off[0], "{off:?} of {share:.4}");
}
