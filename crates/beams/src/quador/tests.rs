mod fillets;
mod integrals;
mod meshes;

use super::*;
use crate::graph::{self, Beam, Profile};
use geometry::math::{add, dot, norm, scale, unit};

/// A fixed pseudo-random sequence in [0, 1).
pub(super) struct Random(pub u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        (geometry::random::random(&mut self.0) + 1.0) / 2.0
    }

    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = [0; 3].map(|_| 2.0 * self.next() - 1.0);
            if dot(v, v) < 1.0 && dot(v, v) > 0.01 {
                return unit(v);
            }
        }
    }
}

/// A hub at the origin and one hub at the end of each beam.
pub(super) fn star(radius: f64, ends: &[(Vec3, f64, f64)], profile: impl Fn(usize) -> Profile) -> Graph {
    let mut hubs = vec![graph::HubBall { center: [0.0; 3], radius }];
    let mut beams = Vec::new();
    for (i, &(along, length, r)) in ends.iter().enumerate() {
        hubs.push(graph::HubBall { center: scale(along, length), radius: r });
        beams.push(Beam { ends: [0, i as u32 + 1], profile: profile(i) });
    }
    Graph { hubs, beams }
}

/// A hub of `n` beams, at least about 40 degrees apart for few beams, less for many.
pub(super) fn random_star(random: &mut Random, n: usize) -> Graph {
    let least = (0.9f64).min((2.4 / n as f64).sqrt());
    let mut axes: Vec<Vec3> = Vec::new();
    while axes.len() < n {
        let u = random.direction();
        if axes.iter().all(|v| dot(*v, u) < least.cos()) {
            axes.push(u);
        }
    }
    let ends: Vec<_> = axes.into_iter().map(|u| (u, 4.0 + 3.0 * random.next(), 0.3 + 0.3 * random.next())).collect();
    let mid: Vec<f64> = ends.iter().map(|_| 0.25 + 0.2 * random.next()).collect();
    star(0.4 + 0.2 * random.next(), &ends, |i| Profile::Mid(mid[i]))
}

/// The unit vectors ±x, ±y, ±z.
pub(super) fn six() -> Vec<Vec3> {
    (0..6)
        .map(|i| {
            let mut v = [0.0; 3];
            v[i % 3] = if i < 3 { 1.0 } else { -1.0 };
            v
        })
        .collect()
}

/// N by enumeration of all sets of half-beams.
fn brute(hub: &Hub, x: Vec3) -> f64 {
    let n = hub.half_beams.len();
    let g: Vec<f64> = hub.half_beams.iter().map(|s| s.g.at(x)).collect();
    let tau = |i: usize, j: usize| {
        if i == j { 1.0 } else { hub.tau(i, j) }
    };
    let mut best: f64 = 0.0;
    for set in 1u32..1 << n {
        let of: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
        // R y = g on the set, by elimination.
        let m = of.len();
        let mut a: Vec<Vec<f64>> = of.iter().map(|&i| of.iter().map(|&j| tau(i, j)).chain([g[i]]).collect()).collect();
        for c in 0..m {
            for r in c + 1..m {
                let f = a[r][c] / a[c][c];
                for k in c..=m {
                    a[r][k] -= f * a[c][k];
                }
            }
        }
        let mut y = vec![0.0; m];
        for r in (0..m).rev() {
            y[r] = (a[r][m] - (r + 1..m).map(|k| a[r][k] * y[k]).sum::<f64>()) / a[r][r];
        }
        if y.iter().all(|v| *v >= 0.0) {
            best = best.max(of.iter().zip(&y).map(|(&i, y)| y * g[i]).sum());
        }
    }
    best
}

#[test]
fn the_fillet_is_the_greatest_over_all_sets_of_stubs() {
    let mut random = Random(1);
    for n in 1..=8 {
        for fillet in [Fillet::Auto, Fillet::Tau(0.6), Fillet::Alpha(0.1), Fillet::None] {
            let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
            let hub = q.hub(0);
            for _ in 0..200 {
                let x = scale(random.direction(), 3.0 * random.next());
                let want = if hub.sharp() {
                    hub.half_beams.iter().map(|s| s.g.at(x).max(0.0).powi(2)).fold(0.0, f64::max)
                } else {
                    brute(&hub, x)
                };
                let got = hub.smooth_union(x);
                assert!((got.value - want).abs() < 1e-12 * (1.0 + want), "{n} {fillet:?}: {got:?} {want}");
                assert!((hub.smooth_union_value(x) - want).abs() < 1e-12 * (1.0 + want));
            }
        }
    }
}

#[test]
fn two_stubs_give_the_quadric_of_the_note() {
    // Unit cylinders along x and y, alpha = 1/4: Q = z² − 1 − 0.5625 (x² + y²) + 1.875 xy between its planes.
    let ends = [([1.0, 0.0, 0.0], 20.0, 1.0), ([0.0, 1.0, 0.0], 20.0, 1.0)];
    let graph = star(1.0, &ends, |_| Profile::Cylinder);
    let q = Quadors::new(&graph, Fillet::Alpha(0.25)).expect("a star");
    assert!(q.shortfalls().is_empty());
    let hub = q.hub(0);
    for (x, n) in [
        ([1.154_700_538_379_251_7, 1.154_700_538_379_251_7, 0.0], [0.5f64.sqrt(), 0.5f64.sqrt(), 0.0]),
        ([5.0 / 3.0, 1.0, 0.0], [0.0, 1.0, 0.0]),
        ([1.0, 0.6, 0.8], [0.0, 0.6, 0.8]),
    ] {
        let (v, g) = hub.gradient(x);
        assert!(v.abs() < 1e-14 && norm(sub(unit(g), n)) < 1e-14, "{x:?}: {v} {g:?}");
    }
    let (x, radius) = hub.crotch(0, 1, 0.6).expect("they meet");
    assert!((x[0] - 1.154_700_538_379_251_7).abs() < 1e-14 && (radius - 0.408_248_290_463_863_1).abs() < 1e-14);
    // Asking for that radius gives that fillet.
    let again = Quadors::new(&graph, Fillet::Radius(radius)).expect("a star");
    assert!((again.hub(0).tau(0, 1) - 0.6).abs() < 1e-12 && again.shortfalls().is_empty());
    // The third cylinder closes the corner at 0.7817 on the diagonal.
    let ends: Vec<_> = six()[..3].iter().map(|&u| (u, 20.0, 1.0)).collect();
    let q = Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), Fillet::Tau(0.6)).expect("a star");
    assert!(q.hub(0).value([0.781_735_959_970_571_5; 3]).abs() < 1e-14);
}

#[test]
fn the_hub_is_once_differentiable() {
    let mut random = Random(5);
    for n in 2..=14 {
        let q = Quadors::new(&random_star(&mut random, n), Fillet::Auto).expect("a star");
        let hub = q.hub(0);
        for _ in 0..50 {
            // Along a segment the gradient does not jump where the label changes.
            let (mut a, mut b) =
                (scale(random.direction(), 2.0 * random.next()), scale(random.direction(), 2.0 * random.next()));
            if hub.smooth_union(a).active == hub.smooth_union(b).active {
                continue;
            }
            for _ in 0..50 {
                let m = scale(add(a, b), 0.5);
                if hub.smooth_union(m).active == hub.smooth_union(a).active { a = m } else { b = m }
            }
            let (u, v) = (hub.gradient(a).1, hub.gradient(b).1);
            assert!(norm(sub(u, v)) < 1e-10 * (1.0 + norm(u)), "valence {n}: {u:?} {v:?}");
        }
    }
}

#[test]
fn fillets_end_before_the_beams_are_parted() {
    let mut random = Random(9);
    for n in 2..=12 {
        for fillet in [Fillet::Auto, Fillet::Tau(0.5), Fillet::Radius(0.6)] {
            let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
            if !q.overlaps().is_empty() {
                continue;
            }
            let hub = q.hub(0);
            for (i, s) in hub.half_beams.iter().enumerate() {
                let side = unit(geometry::math::cross(s.axis, [0.3, 0.5, 0.81]));
                let other = geometry::math::cross(s.axis, side);
                for k in 0..64 {
                    let z = s.split * (1.0 + 1e-9);
                    let (sin, cos) = (f64::from(k) / 64.0 * core::f64::consts::TAU).sin_cos();
                    let rho = s.radius_squared(z).sqrt();
                    let x = add(scale(s.axis, z), add(scale(side, rho * cos), scale(other, rho * sin)));
                    assert_eq!(hub.smooth_union(x).active, 1 << i, "{n} {fillet:?}");
                    assert!(hub.value(x).abs() < 1e-12 * z * z);
                }
            }
        }
    }
}

/// A small lattice: `n`³ cubic cells of edge 10 with hubs at slightly random positions with slightly random radii.
pub(super) fn cubic(n: usize, jitter: f64) -> Graph {
    let mut random = Random(11);
    let m = n + 1;
    let id = |x: usize, y: usize, z: usize| ((z * m + y) * m + x) as u32;
    let (mut hubs, mut beams) = (Vec::new(), Vec::new());
    for z in 0..m {
        for y in 0..m {
            for x in 0..m {
                let center = [x, y, z].map(|v| 10.0 * v as f64 + jitter * (random.next() - 0.5));
                hubs.push(graph::HubBall { center, radius: 1.0 + 0.2 * jitter * random.next() });
                for (e, to) in [(x, [x + 1, y, z]), (y, [x, y + 1, z]), (z, [x, y, z + 1])] {
                    if e < n {
                        beams.push(Beam { ends: [id(x, y, z), id(to[0], to[1], to[2])], profile: Profile::Cone });
                    }
                }
            }
        }
    }
    Graph { hubs, beams }
}

#[test]
fn the_field_is_negative_in_the_solid_alone_and_continuous() {
    for fillet in [Fillet::None, Fillet::Auto, Fillet::Radius(1.0)] {
        let q = Quadors::new(&cubic(2, 1.5), fillet).expect("a lattice");
        assert!(q.overlaps().is_empty());
        let mut random = Random(2);
        let mut inside = 0;
        for _ in 0..20_000 {
            let p = [0; 3].map(|_| 24.0 * random.next() - 2.0);
            let v = q.value(p);
            inside += usize::from(v < 0.0);
            assert_eq!(v < 0.0, q.contains(p), "{fillet:?} {p:?}: {v}");
            let step = scale(random.direction(), 1e-7);
            let w = q.value(add(p, step));
            assert!((v - w).abs() < 1e-7 * 8.0, "{fillet:?} {p:?}: {v} {w}");
            let (mut a, mut g) = ([0.0], [[0.0; 3]]);
            q.gradients(&[p], &mut a, &mut g);
            assert_eq!(a[0], v);
            let ahead = q.value(add(p, scale(g[0], 1e-7)));
            let rise = (ahead - v) / 1e-7;
            assert!(
                (rise - dot(g[0], g[0])).abs() < 2e-5 || v > 0.9 * q.cap || g[0] == [0.0; 3] || near_kink(&q, p),
                "{fillet:?} {p:?}: {rise} {g:?}"
            );
        }
        assert!(inside > 500, "{inside}");
    }
}

/// Whether the hub or the label changes near p.
fn near_kink(q: &Quadors, p: Vec3) -> bool {
    let slope = |p| {
        let (mut a, mut g) = ([0.0], [[0.0; 3]]);
        q.gradients(&[p], &mut a, &mut g);
        g[0]
    };
    let g = slope(p);
    six().into_iter().any(|u| norm(sub(slope(add(p, scale(u, 3e-6))), g)) > 1e-4)
}

#[test]
fn bounds_of_boxes_hold_every_value() {
    for fillet in [Fillet::None, Fillet::Auto] {
        let q = Quadors::new(&cubic(2, 1.5), fillet).expect("a lattice");
        let mut random = Random(4);
        let mut decided = 0;
        for _ in 0..3000 {
            let size = 0.05 * 100f64.powf(random.next());
            let min = [0; 3].map(|_| 26.0 * random.next() - 3.0);
            let b = Aabb { min, max: min.map(|v| v + size * (0.2 + random.next())) };
            let bound = q.bound(&b);
            decided += usize::from(bound.lo > 0.0 || bound.hi < 0.0);
            for _ in 0..40 {
                let p = [0, 1, 2].map(|a| b.min[a] + random.next() * (b.max[a] - b.min[a]));
                let v = q.value(p);
                assert!(v >= bound.lo && v <= bound.hi, "{fillet:?} {b:?}: {v} {bound:?}");
            }
        }
        // Most small boxes are proven empty or full.
        assert!(decided > 1200, "{decided}");
    }
}

#[test]
fn faults_say_what_is_wrong() {
    let two = |profile| star(1.0, &[([1.0, 0.0, 0.0], 5.0, 0.5)], |_| profile);
    let says = |r: Result<Quadors, Fault>, at: &str, words: &str| {
        let f = r.expect_err("refused");
        assert!(f.at == at && f.message.contains(words), "{f}");
    };
    says(Quadors::new(&two(Profile::Lambda(9.0)), Fillet::Auto), "beams[0].profile", "more than");
    says(Quadors::new(&two(Profile::Cylinder), Fillet::Auto), "beams[0].profile", "equal radius");
    says(Quadors::new(&two(Profile::Cone), Fillet::Tau(1.0)), "fillet", "tau");
    says(Quadors::new(&two(Profile::Cone), Fillet::Radius(f64::NAN)), "fillet", "radius");
    let mut lost = two(Profile::Cone);
    lost.beams[0].ends[1] = 7;
    says(Quadors::new(&lost, Fillet::None), "beams[0]", "unknown hub 7");
    let mut same = two(Profile::Cone);
    same.hubs[1].center = [0.0; 3];
    says(Quadors::new(&same, Fillet::None), "beams[0]", "zero length");
    let mut odd = two(Profile::Cone);
    odd.hubs[0].center[1] = f64::NAN;
    says(Quadors::new(&odd, Fillet::None), "hubs[0]", "three finite numbers");
    // Nearly parallel beams can be built, but exact results are refused.
    let close = star(1.0, &[([1.0, 0.0, 0.0], 5.0, 1.0), (unit([1.0, 0.1, 0.0]), 5.0, 1.0)], |_| Profile::Cone);
    let q = Quadors::new(&close, Fillet::Auto).expect("built");
    assert!(q.require_closed_forms().is_err() && !q.overlaps().is_empty());
}

/// Number of faces by number of active half-beams.
fn faces_by_label_size(c: &complex::Complex) -> Vec<usize> {
    let mut n = vec![0; 8];
    c.faces.iter().for_each(|f| n[f.label.count_ones() as usize] += 1);
    while n.last() == Some(&0) {
        n.pop();
    }
    n
}

fn equal(axes: &[Vec3], length: f64, fillet: Fillet) -> Quadors {
    let ends: Vec<_> = axes.iter().map(|&u| (u, length, 1.0)).collect();
    Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), fillet).expect("a star")
}

/// All vectors with the given coordinates, in any order and with any signs.
pub(super) fn orbit(v: Vec3) -> Vec<Vec3> {
    let mut out: Vec<Vec3> = Vec::new();
    for p in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for s in 0..8 {
            let w = unit([0, 1, 2].map(|a| v[p[a]] * if s >> a & 1 == 1 { -1.0 } else { 1.0 }));
            if out.iter().all(|u| norm(sub(*u, w)) > 1e-9) {
                out.push(w);
            }
        }
    }
    out
}

#[test]
fn hubs_of_the_usual_cells_have_their_faces() {
    let sc = equal(&six(), 10.0, Fillet::Tau(0.7));
    let c = complex::Complex::new(&sc.hub(0)).expect("a hub");
    assert_eq!((c.vertices.len(), c.arcs.len(), faces_by_label_size(&c)), (24, 48, vec![0, 6, 12, 8]));
    let octet = equal(&orbit([1.0, 1.0, 0.0]), 10.0, Fillet::Tau(0.8));
    assert_eq!(faces_by_label_size(&complex::Complex::new(&octet.hub(0)).expect("a hub")), [0, 12, 24, 32, 6]);
    let sharp = equal(&orbit([1.0, 1.0, 0.0]), 10.0, Fillet::None);
    let c = complex::Complex::new(&sharp.hub(0)).expect("a hub");
    // The edges of a rhombic dodecahedron, six of its vertices of valence four.
    assert_eq!((c.vertices.len(), c.arcs.len(), faces_by_label_size(&c)), (14, 24, vec![0, 12]));
    let bcc = equal(&orbit([1.0, 1.0, 1.0]), 10.0, Fillet::Tau(0.8));
    println!("bcc {:?}", faces_by_label_size(&complex::Complex::new(&bcc.hub(0)).expect("a hub")));
}

#[test]
fn seams_are_tangent_and_close_over_random_hubs() {
    let mut random = Random(21);
    let (mut worst, mut hubs, mut skipped): (f64, usize, usize) = (0.0, 0, 0);
    for n in 2..=14 {
        for fillet in [Fillet::Auto, Fillet::Tau(0.7), Fillet::None] {
            for _ in 0..12 {
                let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
                if q.overlaps().iter().any(|o| o.hub == 0) {
                    skipped += 1;
                    continue;
                }
                let hub = q.hub(0);
                let c = complex::Complex::new(&hub).unwrap_or_else(|f| panic!("{n} {fillet:?}: {f}"));
                assert_eq!(c.euler(), 2);
                hubs += 1;
                for a in &c.arcs {
                    let [l, r] = a.labels.map(|s| hub_quadric::piece_quadric(&hub, s));
                    for k in 0..=6 {
                        let x = a.conic.at(a.conic.end * f64::from(k) / 6.0);
                        let size = 1.0 + dot(x, x);
                        assert!(
                            l.at(x).abs() < 1e-11 * size && r.at(x).abs() < 1e-11 * size || hub.sharp(),
                            "{n} {fillet:?}"
                        );
                        assert!(hub.value(x).abs() < 1e-9 * size, "{n} {fillet:?} {k}: {}", hub.value(x));
                        if !hub.sharp() {
                            let bend = norm(sub(unit(l.half_gradient(x)), unit(r.half_gradient(x))));
                            worst = worst.max(bend);
                        }
                    }
                }
            }
        }
    }
    println!("{hubs} hubs, {skipped} skipped, worst {worst:e}");
    assert!(worst < 1e-10, "{worst:e}");
    assert!(hubs > 10 * skipped, "{hubs} {skipped}");
}

#[test]
fn rays_hit_the_surface_first_where_it_is() {
    for fillet in [Fillet::None, Fillet::Auto] {
        let q = Quadors::new(&cubic(2, 1.5), fillet).expect("a lattice");
        let mut random = Random(17);
        let mut hits = 0;
        for _ in 0..3000 {
            let o = [0; 3].map(|_| 30.0 * random.next() - 5.0);
            if q.contains(o) {
                continue;
            }
            let direction = random.direction();
            let hit = q.ray(o, direction);
            let reach = hit.map_or(40.0, |h| h.distance);
            // Nothing solid before the hit.
            for k in 0..200 {
                let t = (f64::from(k) + 0.5) / 200.0 * reach;
                let x = add(o, scale(direction, t));
                assert!(
                    q.value(x) > -1e-6 || reach - t < 1e-6,
                    "{fillet:?} {o:?} {direction:?} at {t} of {reach}: {}",
                    q.value(x)
                );
            }
            let Some(h) = hit else { continue };
            hits += 1;
            assert!(q.value(h.at).abs() < 1e-9);
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            q.gradients(&[add(h.at, scale(h.normal, 1e-9))], &mut v, &mut g);
            assert!(
                dot(h.normal, direction) < 0.0 && (norm(sub(unit(g[0]), h.normal)) < 1e-5 || fillet == Fillet::None)
            );
        }
        assert!(hits > 800, "{hits}");
    }
}
