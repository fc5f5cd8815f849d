//! The field of tetrahedral cells over a mesh: continuous, bounded as it says, and as smooth as its overlap.

use std::sync::Arc;

use super::common::{Random, ball, check};
use super::tiling::{cell, made, map, shaken};
use geometry::math::{Aabb, dot, norm, sub};
use trabecula::cell::tet::{Subdivision, SubdivisionNodes, tet_catalogue};
use trabecula::field::{Block, Field};
use trabecula::implicit::Implicit;
use trabecula::map::CarrierMesh;
use trabecula::region::Region;
use trabecula::tiling::{NodalLevel, Rounded, Tiling};

#[test]
fn fields_are_continuous_for_any_numbering() {
    let mut some = Random(5);
    let mesh = shaken(2, 0.15, 3.0, &mut some);
    let map = map(&mesh);
    for r in tet_catalogue() {
        let s = r.cell().expect(r.name);
        for t in 0..map.len() {
            for (face, other) in map.across(t).into_iter().enumerate() {
                if (other as usize) >= map.len() {
                    continue;
                }
                // A point of the face by its nodes, seen from both sides.
                let w = [some.share() + 0.1, some.share() + 0.1, some.share() + 0.1];
                let sum: f64 = w.iter().sum();
                let on: Vec<u32> = (0..4).filter(|i| *i != face).map(|i| map.tet(t)[i]).collect();
                let seen = |t: usize| {
                    let of = map.tet(t);
                    let weight = |n: u32| on.iter().position(|o| *o == n).map_or(0.0, |k| w[k] / sum);
                    s.values(&[of.map(weight)])[0]
                };
                let (a, b) = (seen(t), seen(other as usize));
                assert!((a - b).abs() < 1e-12 * s.series().amplitude(), "{}", r.name);
            }
        }
        // The trace on a face has the face's symmetry, and all four are one: to the last bit.
        let nodes = SubdivisionNodes::new(&s, Subdivision { n: 6 });
        let value = |k: [u16; 4]| {
            let i = nodes.whole.iter().position(|w| *w == k).expect("a node");
            nodes.values[i]
        };
        let traces = [[3, 2, 1, 0], [0, 3, 2, 1], [1, 0, 3, 2], [2, 3, 0, 1]].map(value);
        assert!(traces.iter().all(|v| *v == traces[0]), "{}", r.name);
    }
}

#[test]
fn bounds_hold_and_gradients_are_those_of_the_values() {
    let mut some = Random(7);
    let mesh = shaken(2, 0.15, 4.0, &mut some);
    for (overlap, name) in [(0.0, "diamond_sheet"), (0.1, "primitive_sheet"), (0.1, "iwp")] {
        let map = Arc::new(CarrierMesh::new(&mesh, overlap).expect("mesh"));
        let (s, part, t) = cell(name);
        let each = (0..mesh.nodes.len()).map(|_| t * some.between(0.8, 1.2));
        let tiling = Tiling::new(map, s, part, NodalLevel::Nodes(Arc::new(each.collect())));
        let mut fields: Vec<Arc<dyn Implicit>> = tiling.parts();
        fields.push(Arc::new(tiling.clone()));
        for _ in 0..600 {
            let (low, h) = (some.point(5.0).map(|v| v + 4.0), some.share().powi(3));
            let b = Aabb { min: low, max: low.map(|v| v + h) };
            for f in &fields {
                let r = f.bound(&b);
                for _ in 0..8 {
                    let p = low.map(|v| v + h * some.share());
                    let v = f.value(p);
                    assert!(r.lo <= v + 1e-12 && v <= r.hi + 1e-12, "{name} {r:?} {v}");
                }
            }
        }
        let mut wrong = 0;
        for _ in 0..500 {
            let p = some.point(3.0).map(|v| v + 4.0);
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            tiling.gradients(&[p], &mut v, &mut g);
            let difference = core::array::from_fn(|a| {
                let (mut q, mut r) = (p, p);
                q[a] += 1e-6;
                r[a] -= 1e-6;
                (tiling.value(q) - tiling.value(r)) / 2e-6
            });
            // Second derivatives of some (2π / period)² in a millionth, and rounding of values in it.
            wrong += usize::from(norm(sub(difference, g[0])) > 1e-4);
        }
        // A difference may straddle a crease: a face, or the fold of |f|.
        assert!(wrong <= 2, "{name}: {wrong}");
    }
}

/// Whatever a block held before, its nodes have their values where they are wanted, as they have with gradients, and are void elsewhere.
#[test]
fn a_block_is_evaluated_where_it_is_wanted() {
    let mut some = Random(9);
    let region: Region = ball([4.0; 3], 3.5);
    let mesh = shaken(2, 0.15, 4.0, &mut some);
    let flat = |overlap: f64| CarrierMesh::new(&mesh, overlap).expect("mesh");
    let bent = CarrierMesh::of_region(&mesh, 0.0, &region).expect("mesh");
    for (map, name) in [(flat(0.0), "diamond_sheet"), (flat(0.1), "iwp"), (bent, "primitive_sheet")] {
        let (s, part, t) = cell(name);
        let tiling = Arc::new(Tiling::new(Arc::new(map), s, part, NodalLevel::Same(t)));
        let mut fields: Vec<Arc<dyn Implicit>> = tiling.parts();
        fields.extend([tiling.clone() as Arc<dyn Implicit>, Arc::new(tiling.with_limited_gradient())]);
        fields.push(Arc::new(Rounded::new(&tiling, &region)));
        for f in fields {
            let axes = [7, 64, 5].map(|n| {
                let (from, step) = (some.between(-0.5, 4.0), some.between(0.02, 0.2));
                (0..n).map(|i| from + step * f64::from(i)).collect::<Vec<f64>>()
            });
            let axes = [&axes[1][..], &axes[0], &axes[2]];
            let words: Vec<u64> =
                (0..35).map(|row| if row % 5 == 0 { 0 } else { some.share().to_bits() << 12 }).collect();
            let mut out = vec![f32::NAN; 64 * 35];
            f.fill_where(&Block { axes }, &words, &mut out);
            for (n, found) in out.into_iter().enumerate() {
                let (i, row) = (n % 64, n / 64);
                let p = [axes[0][i], axes[1][row % 7], axes[2][row / 7]];
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                f.gradients(&[p], &mut v, &mut g);
                assert_eq!(v[0], f.value(p), "{name} {p:?}");
                assert_eq!(found, if words[row] >> i & 1 == 1 { v[0] as f32 } else { 1.0 }, "{name} {p:?}");
            }
        }
    }
}

/// Overlap leaves no crease: gradients on both sides of a face are the same.
#[test]
fn overlap_smooths_the_creases() {
    let mut some = Random(8);
    let mesh = shaken(2, 0.1, 4.0, &mut some);
    let (s, part, t) = cell("primitive");
    let turn = |overlap: f64| {
        let map = Arc::new(CarrierMesh::new(&mesh, overlap).expect("mesh"));
        let tiling = Tiling::new(map.clone(), s.clone(), part, NodalLevel::Same(t));
        let mut worst = 0.0f64;
        for i in 0..map.len() {
            for (face, other) in map.across(i).into_iter().enumerate() {
                if other as usize >= map.len() {
                    continue;
                }
                let c = map.corners(i);
                let on: Vec<[f64; 3]> = (0..4).filter(|k| *k != face).map(|k| c[k]).collect();
                let middle = [0, 1, 2].map(|a| 0.5 * on[0][a] + 0.3 * on[1][a] + 0.2 * on[2][a]);
                let away = sub(c[face], middle);
                let sides = [1e-7, -1e-7].map(|e| [0, 1, 2].map(|a| middle[a] + e * away[a]));
                let (mut v, mut g) = ([0.0; 2], [[0.0; 3]; 2]);
                tiling.gradients(&sides, &mut v, &mut g);
                let cosine = dot(g[0], g[1]) / (norm(g[0]) * norm(g[1]));
                worst = worst.max(cosine.clamp(-1.0, 1.0).acos().to_degrees());
            }
        }
        (worst, tiling)
    };
    let (sharp, tiling) = turn(0.0);
    let reported = tiling.creases().expect("creases");
    assert!(sharp > 20.0 && reported.max > 20.0 && reported.mean > 5.0, "{sharp} {reported:?}");
    let (smooth, tiling) = turn(0.1);
    let left = tiling.creases().and_then(|c| c.smoothed).expect("creases");
    assert!(smooth < 0.01 && left < 0.01, "{smooth} {left}");
    // What moves is of the order of the overlap; what is closed stays closed.
    let (_, exact) = tiling.volumes();
    let surface = made(tiling, 10.0, false).0;
    check("smooth", &surface);
    assert!((surface.mesh.volume() / exact - 1.0).abs() < 0.1);
}
