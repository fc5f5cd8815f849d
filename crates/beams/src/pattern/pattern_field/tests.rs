use super::*;
use crate::graph::{HubBall, Profile};
use geometry::math::rotation;

fn samples_in_unit_cube() -> impl Iterator<Item = Vec3> {
    (1..4000).map(|i| [0.8191725, 0.6710436, 0.5497005].map(|s| (s * f64::from(i)).fract()))
}

fn pattern(steps: [(Similarity, u32); 3], center: Vec3) -> Pattern {
    let strut = |offset| Strut { ends: [0, 0], offset, profile: Profile::Mid(0.2) };
    Pattern {
        nodes: vec![HubBall { center, radius: 0.25 }],
        struts: vec![strut([1, 0, 0]), strut([0, 1, 0]), strut([0, 0, 1]), strut([1, -1, 0])],
        steps,
    }
}

/// Translations; rotation with rings along the axis; a shrinking spiral; and steps none of which commute.
fn samples() -> [Pattern; 4] {
    let by = Similarity::translation;
    let turn = |z| Similarity::new(1.0, rotation([0.0, 0.0, z]), [0.0; 3], [0.0; 3]);
    let shrink = Similarity::new(0.9, rotation([0.0, 0.0, 20.0]), [0.0; 3], [0.0; 3]);
    [
        pattern([(by([1.5, 0.0, 0.0]), 6), (by([0.3, 1.4, 0.0]), 5), (by([0.0, 0.2, 1.6]), 4)], [0.0; 3]),
        pattern([(by([1.5, 0.0, 0.0]), 4), (turn(24.0), 12), (by([0.0, 0.0, 1.6]), 5)], [4.0, 0.0, 0.0]),
        pattern([(turn(20.0), 9), (shrink, 6), (by([0.0, 0.0, 1.6]), 3)], [6.0, 0.0, 0.0]),
        pattern(
            [
                (by([1.5, 0.0, 0.0]), 4),
                (Similarity::new(0.95, rotation([10.0, 0.0, 15.0]), [1.0; 3], [0.0, 1.4, 0.0]), 5),
                (Similarity::new(1.0, rotation([0.0, 9.0, 0.0]), [0.0; 3], [0.0, 0.2, 1.6]), 4),
            ],
            [3.0, 0.0, 0.0],
        ),
    ]
}

#[test]
fn a_pattern_is_what_it_is_written_out() {
    for (n, pattern) in samples().into_iter().enumerate() {
        for fillet in [Fillet::None, Fillet::Tau(0.8)] {
            let graph = pattern.expanded().expect("small");
            let (hubs, beams) = pattern.counts();
            assert_eq!((graph.hubs.len() as f64, graph.beams.len() as f64), (hubs, beams));
            let whole = Quadors::new(&graph, fillet).expect("quadors");
            let field = PatternField::new(pattern.clone(), fillet).expect("a pattern");
            let b = whole.bounds();
            let (mut inside, mut out) = (0, 0);
            for t in samples_in_unit_cube() {
                let p = core::array::from_fn(|a| b.min[a] + t[a] * b.size()[a]);
                let is = whole.contains(p);
                assert_eq!(field.contains(p), is, "{n} {p:?}");
                let (v, own) = (field.value(p), whole.value(p));
                // Both fields have the sign of the solid, except for rounding on the surface.
                if own.abs() > 1e-9 {
                    assert_eq!(v < 0.0, own < 0.0, "{n} {p:?} {v} {own}");
                }
                inside += usize::from(is);
                out += usize::from(!is);
            }
            assert!(inside > 20 && out > 200, "{n}: {inside} {out}");
        }
    }
}

#[test]
fn bounds_hold_the_values() {
    for pattern in samples() {
        let field = PatternField::new(pattern, Fillet::Tau(0.8)).expect("a pattern");
        let all = field.bounds();
        for (i, t) in samples_in_unit_cube().take(300).enumerate() {
            let p: Vec3 = core::array::from_fn(|a| all.min[a] + t[a] * all.size()[a]);
            let b = Aabb { min: p, max: p }.grown(0.05 * (1 + i % 7) as f64);
            let range = field.bound(&b);
            for t in samples_in_unit_cube().take(30) {
                let q: Vec3 = core::array::from_fn(|a| b.min[a] + t[a] * b.size()[a]);
                let v = field.value(q);
                assert!(range.lo - 1e-12 <= v && v <= range.hi + 1e-12, "{v} {range:?}");
            }
        }
    }
}

#[test]
fn different_hubs_are_few_where_steps_commute() {
    let by = Similarity::translation;
    let steps = [(by([1.5, 0.0, 0.0]), 1000), (by([0.0, 1.5, 0.0]), 1000), (by([0.0, 0.0, 1.5]), 1000)];
    let field = PatternField::new(pattern(steps, [0.0; 3]), Fillet::None).expect("a pattern");
    let (_, representatives) = field.representatives();
    assert_eq!(representatives.len(), 27);
    assert_eq!(representatives.iter().map(|k| k.1).sum::<f64>(), 1e9);
    assert!(field.contains([750.0, 751.5, 750.7]) && !field.contains([750.7, 750.7, 750.7]));
    assert_eq!(field.pattern().counts().0, 1e9);
}

/// A strut that narrowly misses its neighbours or intersects them: the same answer as for the expanded pattern.
#[test]
fn beams_that_run_into_each_other_are_found() {
    let by = Similarity::translation;
    let crossing = |apart: f64, r: f64| {
        let strut = |ends, offset| Strut { ends, offset, profile: Profile::Mid(r) };
        let node = |z| HubBall { center: [0.0, 0.0, z], radius: r };
        // Both diagonals of a square, one above the other.
        Pattern {
            nodes: vec![node(0.0), node(apart)],
            struts: vec![strut([0, 0], [1, 1, 0]), strut([1, 1], [1, -1, 0])],
            steps: [(by([3.0, 0.0, 0.0]), 40), (by([0.0, 3.0, 0.0]), 30), (by([0.0, 0.0, 4.0]), 1)],
        }
    };
    let field = |p: Pattern| PatternField::new(p, Fillet::None).expect("a pattern");
    for (r, some) in [(0.24, false), (0.26, true)] {
        let found = field(crossing(0.5, r)).collisions().expect("beams");
        let found = found.expect("few classes");
        assert_eq!(found.count > 0, some, "{r}: {found:?}");
        if let Some(p) = found.at {
            // In the middle of a square, halfway up.
            assert!((p[2] - 0.25).abs() < 1e-9, "{p:?}");
            let off = |a: usize| ((p[a] / 3.0).fract() - 0.5).abs();
            assert!(off(0) < 1e-9 && off(1) < 1e-9, "{p:?}");
        }
    }
    for (n, pattern) in samples().into_iter().enumerate() {
        let field = field(pattern);
        let found = field.collisions().expect("beams").expect("few classes");
        let all = field.expand().expect("small").collisions();
        assert_eq!(found.count > 0, !all.is_empty(), "sample {n}: {found:?}");
    }
}

#[test]
fn repeats_that_coincide_are_refused() {
    let still = (Similarity::IDENTITY, 1);
    let ring = |step, count| {
        let strut = Strut { ends: [0, 0], offset: [1, 0, 0], profile: Profile::Mid(0.2) };
        let nodes = vec![HubBall { center: [18.0, 0.0, 0.0], radius: 0.25 }];
        Pattern { nodes, struts: vec![strut], steps: [(step, count), still, still] }
    };
    let turn = |s, degrees, up| Similarity::new(s, rotation([0.0, 0.0, degrees]), [3.0, 1.0, 0.0], [0.0, 0.0, up]);
    for (degrees, period) in [(22.5, 16), (135.0, 8), (-7.2, 50), (0.01, 36_000), (180.0, 2)] {
        let step = turn(1.0, degrees, 0.0);
        assert_eq!(ring(step, period).check(), Ok(()), "{degrees}");
        for count in [period + 1, 2_000_000] {
            let fault = ring(step, count).check().expect_err("coincide");
            assert_eq!(fault.at, "repeat[0].count");
            let angle = number(f64::abs(degrees));
            let said = format!(
                "steps of {angle} degrees coincide after {period}: count must be at most {period}, found {count}"
            );
            assert_eq!(fault.message, said);
        }
    }
    let fault = ring(turn(1.0, 0.0, 0.0), 2).check().expect_err("coincide");
    assert_eq!(fault.message, "steps that move nothing coincide: count must be at most 1, found 2");
    // A step that shrinks, shifts along its axis, or has no whole number of steps in a turn.
    for step in [turn(0.999, 22.5, 0.0), turn(1.0, 22.5, 0.01), turn(1.0, 137.507_764_050_037_85, 0.0)] {
        assert_eq!(ring(step, 2000).check(), Ok(()));
    }
}
