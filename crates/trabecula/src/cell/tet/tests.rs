use super::*;
use geometry::symmetry::{ComplexPart, Group};

use ComplexPart::{Im, Re};
use Part::{Lower, Sheet};

type Known = (
    &'static str,
    &'static str,
    &'static [([i32; 3], ComplexPart, f64)],
    (f64, f64, bool),
    Part,
    f64,
    (usize, usize, f64, f64),
    Option<[f64; 2]>,
);

/// Worked cells, computed apart from this program on other subdivisions: group, waves, site, edge/√2, dual, level, components and
/// ports, fractions of volume (2e-5) and face, and the range of the level in which it is connected (in steps of 0.05).
pub(crate) const KNOWN: [Known; 17] = [
    (
        "T1",
        "221",
        &[([1, 0, 0], Re, 1.0)],
        (0.5, 1.0, false),
        Lower,
        -1.2,
        (1, 1, 0.48290, 0.12498),
        Some([-1.45, 1.8]),
    ),
    (
        "T2",
        "227:2",
        &[([1, 1, 1], Re, 1.0)],
        (0.125, 0.75, false),
        Lower,
        -1.0,
        (1, 1, 0.26155, 0.08953),
        Some([-1.95, 2.0]),
    ),
    (
        "T3",
        "227:2",
        &[([1, 1, 1], Re, 1.0)],
        (0.125, 0.75, false),
        Sheet,
        0.6,
        (1, 1, 0.21870, 0.15473),
        Some([0.2, 1.95]),
    ),
    (
        "T4",
        "227:2",
        &[([1, 1, 1], Re, 1.0)],
        (0.125, 0.75, true),
        Lower,
        -1.5,
        (1, 3, 0.43626, 0.29605),
        Some([-1.95, 1.5]),
    ),
    (
        "T5",
        "229",
        &[([1, 1, 0], Re, -1.0), ([2, 0, 0], Re, 1.0)],
        (0.0, 1.0, false),
        Lower,
        -2.3,
        (1, 4, 0.32597, 0.15798),
        Some([-2.95, 0.7]),
    ),
    (
        "T6",
        "217",
        &[([1, 1, 0], Re, -1.0), ([2, 1, 1], Im, 0.5)],
        (0.0, 0.5, true),
        Lower,
        -4.5,
        (1, 1, 0.29006, 0.11429),
        Some([-5.7, -1.45]),
    ),
    (
        "T7",
        "215",
        &[([1, 0, 0], Re, 1.0), ([1, 1, 1], Im, 1.0)],
        (0.5, 1.0, false),
        Lower,
        -2.0,
        (1, 1, 0.22449, 0.12415),
        Some([-2.95, 1.0]),
    ),
    (
        "T8",
        "216",
        &[([1, 1, 1], Re, 1.0), ([1, 1, 1], Im, 0.5)],
        (0.25, 0.75, true),
        Lower,
        -1.0,
        (1, 1, 0.20102, 0.09564),
        Some([-1.75, 2.0]),
    ),
    (
        "T9",
        "224:2",
        &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)],
        (0.25, 1.0, false),
        Lower,
        -3.0,
        (1, 3, 0.30352, 0.12583),
        Some([-3.95, 0.05]),
    ),
    (
        "T10",
        "224:2",
        &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)],
        (0.25, 0.5, true),
        Lower,
        -4.3,
        (1, 1, 0.34385, 0.09734),
        Some([-4.95, -1.25]),
    ),
    (
        "T11",
        "225",
        &[([1, 1, 1], Re, -4.0), ([2, 2, 0], Re, 1.0)],
        (0.25, 0.5, false),
        Lower,
        0.3,
        (1, 1, 0.17034, 0.43135),
        Some([-0.5, 3.35]),
    ),
    (
        "T12",
        "221",
        &[([1, 0, 0], Re, 1.0)],
        (0.5, 1.0, false),
        Sheet,
        1.2,
        (1, 1, 0.44085, 0.67667),
        Some([1.05, 4.25]),
    ),
    (
        "T13",
        "225",
        &[([1, 1, 1], Re, 1.0)],
        (0.25, 0.5, false),
        Sheet,
        0.3,
        (1, 1, 0.52089, 0.32979),
        Some([0.05, 3.35]),
    ),
    ("X1", "221", &[([1, 0, 0], Re, 1.0)], (0.5, 1.0, false), Sheet, 0.6, (4, 3, 0.18401, 0.26837), None),
    ("X2", "224:2", &[([1, 1, 0], Re, 1.0)], (0.25, 0.75, false), Lower, -2.5, (5, 4, 0.37753, 0.05899), None),
    ("X3", "221", &[([1, 0, 0], Re, 1.0)], (0.5, 1.0, false), Lower, -1.8, (1, 0, 0.23371, 0.0), None),
    ("X4", "227:2", &[([1, 1, 1], Re, 1.0)], (0.125, 0.75, true), Lower, -2.2, (5, 3, 0.16016, 0.11780), None),
];

pub(crate) fn known(k: &Known) -> TetCell {
    let group = Group::named(k.1).expect(k.0);
    let series = tet_catalogue::series(&group, k.2).expect(k.0);
    let (site, edge, dual) = k.3;
    TetCell::new(series, [site; 3], edge * 2f64.sqrt(), dual).expect(k.0)
}

#[test]
fn worked_cells_are_met() {
    for k in &KNOWN {
        let s = known(k);
        let (id, part, t) = (k.0, k.4, k.5);
        let (components, ports, volume, face) = k.6;
        let (v, f) = (s.fraction(part, t), s.face_fraction(part, t));
        println!("{id} {v:.5} {volume} {f:.5} {face} {:?} {:?}", s.count(part, t), s.connected(part));
        // What is promised of a fraction, and what is known of the figures.
        assert!((v - volume).abs() < 1e-4 + 2e-5, "{id}: volume {v}");
        assert!((f - face).abs() < 1e-4 + 2e-5, "{id}: face {f}");
        assert_eq!(s.count(part, t), Count { components, ports }, "{id}");
        let holds = s.connected(part).iter().find(|i| i[0] < t && t <= i[1]);
        match k.7 {
            None => assert!(holds.is_none(), "{id}: {holds:?}"),
            Some([lo, hi]) => {
                let found = holds.expect(id);
                // The known ends are of steps of 0.05 on a coarser subdivision, where thin walls break up.
                let low = if part == Sheet { f64::NEG_INFINITY } else { lo - 0.1 };
                assert!(found[0] > low && found[0] < lo + 0.05, "{id}: {found:?}");
                // The scan went up by 3 at most, or to a level that f has all along the edges, where rounding stopped it.
                let end = hi.min(s.range().abs().hi);
                assert!(found[1] > end - 0.1, "{id}: {found:?}");
            }
        }
    }
}

#[test]
fn levels_invert_fractions() {
    for k in &KNOWN {
        let s = known(k);
        for part in [Part::Sheet, Part::Lower, Part::Upper] {
            for p in [0.05, 0.2, 0.5, 0.8, 0.95] {
                let t = s.iso(part, p);
                assert!((s.fraction(part, t) - p).abs() < 1e-9, "{} {part:?} {p}", k.0);
            }
        }
    }
}

#[test]
fn values_are_the_same_in_all_bits_for_any_order_of_corners() {
    let s = known(&KNOWN[5]);
    let nodes = SubdivisionNodes::new(&s, Subdivision { n: 7 });
    let find = |k: subdivision::Whole| nodes.whole.iter().position(|w| *w == k).expect("a node");
    let scale = s.series().amplitude();
    for (a, ka) in nodes.whole.iter().enumerate() {
        for p in [[1, 0, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
            let turned = |k: &subdivision::Whole| find(p.map(|i| k[i]));
            assert_eq!(nodes.values[a], nodes.values[turned(ka)]);
            for kb in nodes.whole.iter().step_by(5) {
                let (b, found) = (find(*kb), nodes.slope(a, find(*kb)));
                assert_eq!(found, nodes.slope(turned(ka), turned(kb)));
                // The slope by differences; the third derivative is below scale · (2π·4)³.
                let mix = |e: f64| -> Bary {
                    let (x, y) = (nodes.grid.bary(*ka), nodes.grid.bary(*kb));
                    core::array::from_fn(|i| x[i] + e * (y[i] - x[i]))
                };
                let v = s.values(&[mix(1e-4), mix(-1e-4)]);
                assert!((found - (v[0] - v[1]) / 2e-4).abs() < 1e-4 * scale, "{a} {b}");
            }
        }
    }
}

#[test]
fn what_has_not_the_symmetry_is_refused() {
    let p = named_tet_cell("primitive").expect("listed").cell().expect("valid");
    let wrong = |site, edge| TetCell::new(p.series().clone(), site, edge, false).err().map(|f| f.at);
    // 221 (100) about (1/4, 1/4, 1/4): the known counterexample.
    assert_eq!(wrong([0.25; 3], 1.0).as_deref(), Some("site"));
    assert_eq!(wrong([0.5; 3], 1.3), None, "any edge will do");
    assert_eq!(wrong([0.5; 3], 0.0).as_deref(), Some("edge"));
    assert_eq!(wrong([f64::NAN; 3], 1.0).as_deref(), Some("site"));
}
