use super::super::Fillet;
use super::super::tests::{Random, cubic, random_star, six, star};
use super::*;
use crate::graph::Profile;
use core::f64::consts::PI;

/// ∫ area over heights from a to b along a direction, by Lobatto's rule of 4 points and Kronrod's extension to 7,
/// bisected until they agree: areas are analytic between the heights at which the plane touches the solid, and both
/// ends are evaluated, so that a part that starts within an interval is not missed.
fn integrated(q: &Quadors, normal: Vec3, [a, b]: [f64; 2], slack: f64, depth: u32) -> f64 {
    let (m, h) = ((a + b) / 2.0, (b - a) / 2.0);
    let at = |s: f64| {
        let plane = SlicePlane::new(scale(normal, m + s * h), normal).expect("a plane");
        q.slice(&plane).expect("a slice").area
    };
    let ends = at(-1.0) + at(1.0);
    let (outer, inner) = ((2.0f64 / 3.0).sqrt(), 0.2f64.sqrt());
    let near = at(-inner) + at(inner);
    let rough = h / 6.0 * (ends + 5.0 * near);
    let wide = at(-outer) + at(outer);
    let fine = h / 1470.0 * (77.0 * ends + 432.0 * wide + 625.0 * near + 672.0 * at(0.0));
    if (rough - fine).abs() < slack || depth == 0 {
        return fine;
    }
    integrated(q, normal, [a, m], slack, depth - 1) + integrated(q, normal, [m, b], slack, depth - 1)
}

fn volume(q: &Quadors, normal: Vec3, slack: f64) -> f64 {
    let b = q.bounds();
    let half = scale(b.size(), 0.5);
    let reach = (0..3).map(|a| half[a] * normal[a].abs()).sum::<f64>();
    let middle = dot(b.center(), normal);
    // Rules may agree by chance, but not in sixteen intervals at once.
    let part = |k: i32| middle + reach * f64::from(k - 8) / 8.0;
    (0..16).map(|k| integrated(q, normal, [part(k), part(k + 1)], slack, 24)).sum()
}

#[test]
fn areas_add_up_to_the_volume() {
    let mut random = Random(41);
    let mut compared = 0;
    for n in [1, 2, 3, 4, 6, 9, 12] {
        for fillet in [Fillet::None, Fillet::Auto] {
            let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
            // About a hundred intervals, each to 1e-10 or better, of a volume of three or more.
            let [got, other] = [0; 2].map(|_| volume(&q, random.direction(), 1e-10));
            assert!((got - other).abs() < 4e-9 * got, "{n} {fillet:?}: {got} {other}");
            let Ok(want) = q.volume() else { continue };
            assert!((got - want).abs() < 4e-9 * want, "{n} {fillet:?}: {got} {want}");
            compared += 1;
        }
    }
    assert!(compared >= 8, "{compared}");
    // The corners of six beams have a known volume: 5π a beam, minus 8√2, plus the fillets of τ = 0.7.
    let ends: Vec<_> = six().into_iter().map(|u| (u, 10.0, 1.0)).collect();
    for (fillet, added) in [(Fillet::None, 0.0), (Fillet::Tau(0.7), 0.405_808_119_0)] {
        let q = Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), fillet).expect("a star");
        // Half of each beam and half a ball at each end.
        let want = 60.0 * PI - 8.0 * 2f64.sqrt() + 6.0 * 2.0 / 3.0 * PI + added;
        let got = volume(&q, [0.36, 0.48, 0.8], 1e-8);
        assert!((got - want).abs() < 1e-6, "{fillet:?}: {got} {want}");
    }
}

#[test]
fn loops_close_on_the_surface_with_the_solid_to_their_left() {
    let mut random = Random(43);
    for fillet in [Fillet::None, Fillet::Auto, Fillet::Radius(1.0)] {
        let q = Quadors::new(&cubic(2, 1.5), fillet).expect("a lattice");
        for _ in 0..60 {
            let p = [0; 3].map(|_| 20.0 * random.next());
            let plane = SlicePlane::new(p, random.direction()).expect("a plane");
            let s = q.slice(&plane).expect("a slice");
            assert_eq!(s.moved, 0.0);
            assert!(s.hubs <= q.len());
            for arcs in &s.loops {
                let curves: Vec<_> = arcs.iter().flat_map(|a| &a.curves).collect();
                for k in 0..curves.len() {
                    assert_eq!(curves[k].points[2], curves[(k + 1) % curves.len()].points[0]);
                }
                for a in arcs {
                    for c in &a.curves {
                        let at = c.at(0.37);
                        let x = plane.point_at(at);
                        let local = sub(x, q.center(a.hub as usize));
                        assert!(q.hub(a.hub as usize).value(local).abs() < 1e-9, "{x:?}");
                        let [u, v] = [at[0] - a.about[0], at[1] - a.about[1]];
                        let m = a.conic;
                        let q2 = m[0] * u * u + 2.0 * m[1] * u * v + m[2] * v * v;
                        assert!((q2 + 2.0 * (m[3] * u + m[4] * v) + m[5]).abs() < 1e-9);
                        let ahead = c.at(0.371);
                        let direction = [ahead[0] - at[0], ahead[1] - at[1]];
                        let far = 1e-5 / direction[0].hypot(direction[1]);
                        if c.points[0] == c.points[2] || far > 1e4 {
                            continue;
                        }
                        let left = plane.point_at([at[0] - direction[1] * far, at[1] + direction[0] * far]);
                        let right = plane.point_at([at[0] + direction[1] * far, at[1] - direction[0] * far]);
                        // Where the plane is nearly tangent to the surface, both sides are close to it.
                        assert!(q.value_at(left) < q.value_at(right), "{fillet:?} {x:?}");
                    }
                }
            }
        }
    }
}

impl Quadors {
    fn value_at(&self, p: Vec3) -> f64 {
        Quadors::value(self, p)
    }
}

#[test]
fn areas_are_what_points_say() {
    // Stratified Monte Carlo, one point in each of n² squares: a square on the boundary contributes an error of at most
    // half its area, and about 2 × length/side of them are on the boundary.
    let mut random = Random(47);
    for fillet in [Fillet::None, Fillet::Auto] {
        let q = Quadors::new(&cubic(2, 1.5), fillet).expect("a lattice");
        for _ in 0..4 {
            let plane = SlicePlane::new([0; 3].map(|_| 20.0 * random.next()), random.direction()).expect("a plane");
            let s = q.slice(&plane).expect("a slice");
            let polygons = s.polygons(1e-3);
            let (mut low, mut high, mut length) = ([f64::MAX; 2], [f64::MIN; 2], 0.0);
            for polygon in &polygons {
                for k in 0..polygon.len() {
                    let (p, r) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                    length += (r[0] - p[0]).hypot(r[1] - p[1]);
                    for a in 0..2 {
                        low[a] = low[a].min(p[a] - 0.01);
                        high[a] = high[a].max(p[a] + 0.01);
                    }
                }
            }
            let n = 500;
            let side = [0, 1].map(|a| (high[a] - low[a]) / f64::from(n));
            let mut inside = 0;
            for i in 0..n {
                for j in 0..n {
                    let u = low[0] + side[0] * (f64::from(i) + random.next());
                    let v = low[1] + side[1] * (f64::from(j) + random.next());
                    inside += u32::from(q.contains(s.plane.point_at([u, v])));
                }
            }
            let square = side[0] * side[1];
            let crossed = 2.0 * length / side[0].min(side[1]) + 4.0;
            let slack = 4.0 * 0.5 * square * crossed.sqrt();
            let got = f64::from(inside) * square;
            assert!((got - s.area).abs() < slack, "{got} {} {slack}", s.area);
        }
    }
}

#[test]
fn planes_of_symmetry_are_sliced() {
    // Cylinders of radius 1 along the edges of cubes of 10.
    let q = Quadors::new(&cubic(2, 0.0), Fillet::None).expect("a lattice");
    let at = |normal: Vec3, h: f64| {
        let plane = SlicePlane::new(scale(normal, h), normal).expect("a plane");
        q.slice(&plane).expect("a slice")
    };
    for normal in [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]] {
        let turn = normal.iter().sum::<f64>();
        // At mid length, where beams are split.
        let s = at(normal, 5.0 * turn);
        assert!((s.area - 9.0 * PI).abs() < 1e-10, "{}", s.area);
        assert_eq!(s.loops.len(), 9);
        // Through the axes: strips, whose crossings count once, and a quarter disc beyond each corner.
        let s = at(normal, 0.0);
        assert!((s.area - 224.0 - PI).abs() < 1e-10, "{}", s.area);
        assert_eq!(s.loops.len(), 5);
        // Along the tops: a line of contact has no area, up to the width √(2 r δ) of a strip at depth δ = 1e-8.
        let s = at(normal, turn);
        assert!((s.area - 9.0 * PI).abs() < 240.0 * 3e-4, "{} {}", s.area, s.moved);
        assert_eq!(at(normal, -5.0 * turn).loops.len(), 0);
    }
    // Octet and filleted hubs in their symmetry planes, through the centre and in the planes of seams.
    for (axes, fillet) in [
        (six(), Fillet::Tau(0.7)),
        (super::super::tests::orbit([1.0, 1.0, 0.0]), Fillet::Tau(0.8)),
        (super::super::tests::orbit([1.0, 1.0, 0.0]), Fillet::None),
        (super::super::tests::orbit([1.0, 1.0, 1.0]), Fillet::Auto),
    ] {
        let ends: Vec<_> = axes.iter().map(|&u| (u, 10.0, 1.0)).collect();
        let q = Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), fillet).expect("a star");
        for normal in [[0.0, 0.0, 1.0], unit([1.0, 1.0, 0.0]), unit([1.0, -1.0, 0.0]), unit([1.0, 1.0, 1.0])] {
            for h in [0.0, 0.5, 1.0, 1.2, 1.5, 5.0] {
                let area = |h: f64| {
                    let plane = SlicePlane::new(scale(normal, h), normal).expect("a plane");
                    q.slice(&plane).expect("a slice").area
                };
                // Areas are continuous in height (up to a square root, where the plane touches a cylinder along its
                // length).
                let (a, b, c) = (area(h - 1e-7), area(h), area(h + 1e-7));
                assert!(b > a.min(c) - 2e-2 && b < a.max(c) + 2e-2, "{fillet:?} {normal:?} {h}: {a} {b} {c}");
            }
        }
    }
}

#[test]
fn a_slice_far_from_the_origin_keeps_its_digits() {
    let mut graph = cubic(1, 1.0);
    let near = Quadors::new(&graph, Fillet::Auto).expect("a lattice");
    let by = [1024.0, -4096.0, 2048.0];
    for h in &mut graph.hubs {
        h.center = add(h.center, by);
    }
    let far = Quadors::new(&graph, Fillet::Auto).expect("a lattice");
    for (p, n) in [([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]), ([5.0, 5.0, 0.3], [0.6, 0.0, 0.8])] {
        let a = near.slice(&SlicePlane::new(p, n).expect("a plane")).expect("a slice");
        let b = far.slice(&SlicePlane::new(add(p, by), n).expect("a plane")).expect("a slice");
        // Positions are accurate to 1e-12 there.
        assert!((a.area - b.area).abs() < 1e-9 * a.area, "{} {}", a.area, b.area);
    }
}

#[test]
fn faults_of_planes_say_what_is_wrong() {
    let says = |r: Result<SlicePlane, Fault>, at: &str| assert_eq!(r.expect_err("refused").at, at);
    says(SlicePlane::new([0.0; 3], [0.0; 3]), "normal");
    says(SlicePlane::new([0.0; 3], [f64::NAN, 0.0, 1.0]), "normal");
    says(SlicePlane::new([f64::INFINITY, 0.0, 0.0], [0.0, 0.0, 1.0]), "point");
    let close = star(1.0, &[([1.0, 0.0, 0.0], 5.0, 1.0), (unit([1.0, 0.1, 0.0]), 5.0, 1.0)], |_| Profile::Cone);
    let q = Quadors::new(&close, Fillet::Auto).expect("built");
    let at = |x: f64| q.slice(&SlicePlane::new([x, 0.0, 0.0], [1.0, 0.0, 0.0]).expect("a plane"));
    assert!(at(1.0).expect_err("refused").message.contains("overlap"));
    assert!(at(-3.0).expect("nothing there").loops.is_empty());
}
