//! Volumes, areas and moments.

use super::*;

/// The volume of a hub's part, for cylinders of radius 1 and length 10.
fn hub_volume(axes: &[Vec3], fillet: Fillet) -> f64 {
    let q = equal(axes, 10.0, fillet);
    assert!(q.shortfalls().is_empty() && q.overlaps().is_empty());
    integral::hub_mass::<false>(&q.hub(0), &q.complex(0).expect("a hub"), integral::DEFAULT_ORDER)
        .expect("whole")
        .volume
}

#[test]
fn equal_cylinders_have_the_volume_of_their_formula() {
    use core::f64::consts::PI;
    let both = |v: Vec3| [unit(v), scale(unit(v), -1.0)];
    let z = both([0.0, 0.0, 1.0]);
    let bcc = orbit([1.0, 1.0, 1.0]);
    let root2 = 2f64.sqrt();
    for (axes, lost) in [
        (six(), 8.0 * root2),
        (bcc.clone(), 8.0 * 6f64.sqrt()),
        (orbit([1.0, 1.0, 0.0]), 16.0 + 16.0 * root2),
        ([bcc.clone(), z.to_vec()].concat(), 29.587_018_422_1),
        ([bcc, six()].concat(), 49.569_219_381_7),
    ] {
        let v = hub_volume(&axes, Fillet::None);
        let want = 5.0 * PI * axes.len() as f64 - lost;
        println!("{} {v} {want} {:e}", axes.len(), v - want);
        assert!((v - want).abs() < 2e-10 * want, "{} beams: {v} {want}", axes.len());
    }
}

#[test]
fn golden_volumes_of_filleted_hubs() {
    for (tau, added) in [
        (0.3, 9.853_826_763_5),
        (0.5, 2.056_540_004_7),
        (0.7, 0.405_808_119_0),
        (0.8, 0.141_665_897_5),
        (0.9, 0.028_583_083_9),
    ] {
        let got = hub_volume(&six(), Fillet::Tau(tau)) - hub_volume(&six(), Fillet::None);
        assert!((got - added).abs() < 2e-9, "{tau}: {got} {added}");
    }
    // A cell of edge 1, balls 0.15, beams 0.10 at mid length.
    let ends: Vec<_> = six().into_iter().map(|u| (u, 1.0, 0.15)).collect();
    let graph = star(0.15, &ends, |_| Profile::Mid(0.10));
    for (fillet, want, digits) in [
        (Fillet::None, 0.103_214_009_124, 2e-12),
        (Fillet::Tau(0.8), 0.103_358_8, 1e-7),
        (Fillet::Tau(0.5), 0.105_062_5, 1e-7),
    ] {
        let q = Quadors::new(&graph, fillet).expect("a star");
        let got = integral::hub_mass::<false>(&q.hub(0), &q.complex(0).expect("a hub"), integral::DEFAULT_ORDER)
            .expect("whole")
            .volume;
        assert!((got - want).abs() < digits, "{fillet:?}: {got} {want}");
    }
    // Two balls and a beam.
    for (profile, volume, area) in
        [(Profile::Lambda(1.0), 0.106_340_314_3, 1.374_492_862_6), (Profile::Cone, 0.103_000_005_4, 1.353_548_911_6)]
    {
        let q = Quadors::new(&star(0.2, &[([0.0, 0.6, 0.8], 1.0, 0.12)], |_| profile), Fillet::None).expect("a star");
        let m = q.mass().expect("exact");
        assert!((m.volume - volume).abs() < 1e-10 && (m.area - area).abs() < 1e-9, "{m:?} {volume} {area}");
    }
}

/// Two beams, thicker in the middle than their hub, one of them along x.
fn bulging(other: Vec3) -> Graph {
    let ends = [([1.0, 0.0, 0.0], 4.0, 0.5), (other, 4.0, 0.5)];
    star(0.5, &ends, |_| Profile::Mid(0.8))
}

/// Opposite beams make a body of revolution, ρ² = r² − z² + N, whose volume is an integral along its axis.
#[test]
fn a_neck_between_opposite_beams_is_a_body_of_revolution() {
    for tau in [0.2, 0.5, 0.9] {
        let q = Quadors::new(&bulging([-1.0, 0.0, 0.0]), Fillet::Tau(tau)).expect("a star");
        let (hub, c) = (q.hub(0), q.complex(0).expect("a hub"));
        // One annular face, bounded by both seams.
        assert!(c.faces.iter().any(|f| f.label == 3 && f.loops.len() == 2));
        let split = hub.half_beams[0].split;
        let square = |z: f64| hub.radius * hub.radius - z * z + hub.smooth_union_value([z, 0.0, 0.0]);
        // N has a kink in its second derivative at two points: the error of steps h is O(h³).
        let n = 100_000;
        let h = 2.0 * split / f64::from(n);
        let middles = (0..n).map(|k| square(-split + h * (f64::from(k) + 0.5)));
        let corners = (0..=n).map(|k| {
            let w = if k == 0 || k == n { 0.5 } else { 1.0 };
            w * square(-split + h * f64::from(k))
        });
        let sum = (2.0 * middles.sum::<f64>() + corners.sum::<f64>()) / 3.0;
        let want = core::f64::consts::PI * h * sum;
        let got = q.hub_volume(0).expect("a volume");
        assert!((got / want - 1.0).abs() < 1e-12, "{tau}: {got} {want}");
    }
}

#[test]
fn integrals_are_converged_for_every_hub() {
    let mut random = Random(31);
    let fine = integral::QuadratureOrder { nodes: &[16, 24], tolerance: 1e-11 };
    let (mut worst, mut done): ([f64; 3], usize) = ([0.0; 3], 0);
    for n in 1..=14 {
        for fillet in [Fillet::Auto, Fillet::Tau(0.7), Fillet::None] {
            for _ in 0..3 {
                let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
                if q.overlaps().iter().any(|o| o.hub == 0) {
                    continue;
                }
                let (hub, c) = (q.hub(0), q.complex(0).expect("a hub"));
                let of = |order| integral::hub_mass::<true>(&hub, &c, order).expect("integrals");
                let (usual, want) = (of(integral::DEFAULT_ORDER), of(fine));
                let volume = q.hub_volume(0).expect("a volume");
                let trace: f64 = (0..3).map(|a| want.second[a][a]).sum();
                done += 1;
                let e = [
                    (volume / want.volume - 1.0).abs(),
                    (usual.area / want.area - 1.0).abs(),
                    (usual.second[0][0] - want.second[0][0]).abs() / trace,
                ];
                for k in 0..3 {
                    assert!(e[k] < 1e-10, "{n} {fillet:?} {e:?}");
                    worst[k] = worst[k].max(e[k]);
                }
            }
        }
    }
    println!("{worst:?} {done}");
    assert!(done > 120, "{done}");
}

/// Monte Carlo: of n points in a box a fraction p falls into the solid, within four standard deviations.
#[test]
fn integrals_are_those_of_points_thrown_at_random() {
    let mut random = Random(41);
    let mut incidence = Vec::new();
    for (n, fillet) in
        [(2, Fillet::Auto), (3, Fillet::Auto), (5, Fillet::Tau(0.5)), (8, Fillet::Auto), (13, Fillet::Auto)]
    {
        incidence.push((n, random_star(&mut random, n), fillet));
    }
    // Fillets that surround the neck between two beams, completely and almost.
    for bent in [-0.99f64, -0.8, -0.6] {
        let axis = [bent, (1.0 - bent * bent).sqrt(), 0.0];
        incidence.push((2, bulging(axis), Fillet::Tau(0.2)));
    }
    for (n, graph, fillet) in incidence {
        let q = Quadors::new(&graph, fillet).expect("a star");
        let mass = q.mass().expect("exact");
        let (b, thrown) = (q.bounds(), 400_000);
        let (mut inside, mut sum, mut squares) = (0usize, [0.0; 3], [0.0; 3]);
        for _ in 0..thrown {
            let p = [0, 1, 2].map(|a| b.min[a] + random.next() * (b.max[a] - b.min[a]));
            if q.contains(p) {
                inside += 1;
                for a in 0..3 {
                    sum[a] += p[a];
                    squares[a] += p[a] * p[a];
                }
            }
        }
        let boxed: f64 = b.size().iter().product();
        let fraction = mass.volume / boxed;
        let deviation = (fraction * (1.0 - fraction) / f64::from(thrown)).sqrt();
        let found = inside as f64 / f64::from(thrown);
        assert!((found - fraction).abs() < 4.0 * deviation, "{n} {fillet:?}: {found} {fraction}");
        for a in 0..3 {
            let (mean, square) = (sum[a] / inside as f64, squares[a] / inside as f64);
            let spread = (square - mean * mean).sqrt();
            let off = (mean - mass.centroid()[a]).abs();
            assert!(off < 4.0 * spread / (inside as f64).sqrt(), "{n} {fillet:?} {a}: {off}");
            // The second moments follow from the inertia tensor's diagonal.
            let inertia = mass.inertia();
            let others = (0..3).map(|k| inertia[k][k]).sum::<f64>() / 2.0 - inertia[a][a];
            let want = (others / mass.volume).sqrt();
            // The standard error of a sample's spread is of order 1/√n, more with heavy tails.
            assert!((spread / want - 1.0).abs() < 8.0 / (inside as f64).sqrt(), "{n} {a}: {spread} {want}");
        }
    }
}
