use super::*;
use crate::grade::{Formula, Samples};
use geometry::math::{Aabb, apply};

fn formula(text: &str) -> Grade {
    Grade::from(Formula::parse(text).expect("formula"))
}

fn grid() -> (PhaseGrid, Vec<Vec3>) {
    let b = Aabb { min: [1.0, 2.0, 3.0], max: [5.0, 5.0, 6.0] };
    let g = PhaseGrid::over(&b, [12, 9, 8]);
    let nodes = (0..g.len()).map(|n| g.node(n)).collect();
    (g, nodes)
}

fn angle(a: &Mat3, b: &Mat3) -> f64 {
    let trace: f64 = a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum();
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

/// A stress made from a smoothly turning frame, its principal values changing order in the middle: the frames found are
/// that frame everywhere, up to one turn of the cube.
#[test]
fn combed_frames_are_smooth_through_a_crossing_of_principal_values() {
    let (g, nodes) = grid();
    let frame = |p: Vec3| rotation([10.0 * p[0], 5.0 * p[1] * p[2], 20.0 * p[0] - 7.0 * p[2]]);
    let tensor = |p: Vec3| {
        let (f, d) = (frame(p), [p[0] - 3.05, 10.0, -8.0]);
        let m =
            product(&f, &product(&[[d[0], 0.0, 0.0], [0.0, 6.1 - p[0] - 3.05, 0.0], [0.0, 0.0, d[2]]], &transpose(&f)));
        [m[0][0], m[1][1], m[2][2], m[1][2], m[0][2], m[0][1]]
    };
    let turns = cube();
    assert_eq!(turns.len(), 24);
    let values: Vec<[f64; 6]> = nodes.iter().map(|p| tensor(*p)).collect();
    let found: Vec<Principal> = values.iter().map(Principal::of).collect();
    let range = found.iter().map(Principal::difference).fold(0.0, f64::max);
    let mut frames: Vec<Mat3> = found.iter().map(|p| p.frame).collect();
    let gaps: Vec<Vec3> = found.iter().map(|p| p.own_gaps(range)).collect();
    let agree = |n: usize, f: &Mat3, to: &Mat3| settled(f, &gaps[n], to, &turns);
    let sure = |n: usize| gaps[n].into_iter().fold(f64::INFINITY, f64::min);
    comb(&g, &mut frames, sure, |n, f| agree(n, f, &IDENTITY), agree);
    let by = product(&transpose(&frame(nodes[0])), &frames[0]);
    for ((f, p), gaps) in frames.iter().zip(&nodes).zip(&gaps) {
        // The eigenvectors' rounding over the gap; where values agree, the two steps to the next node that is sure, on each of
        // which the frame turns by at most 11 degrees.
        let within = if gaps.iter().all(|g| *g > DOUBT) { 1e-3 } else { 22.0 };
        assert!(angle(f, &product(&frame(*p), &by)) < within, "{} {within}", angle(f, &product(&frame(*p), &by)));
        assert!((determinant(f) - 1.0).abs() < 1e-12);
    }
}

/// Two values agree in half of the box, all three in a part of it: the sure direction is kept to, and nothing jumps.
#[test]
fn where_values_agree_the_neighbours_decide() {
    let (g, nodes) = grid();
    let axis = |p: Vec3| unit([1.0, 0.2 * p[1], 0.1 * p[2]]);
    let tensor = |p: Vec3| {
        let n = axis(p);
        // Without a tilt in the half where x is small only n is known; where it is largest, nothing is.
        let tilt = if p[0] < 3.0 { 0.0 } else { 3.0 };
        let size = if p[0] > 4.6 { 0.0 } else { 10.0 };
        let e = unit(cross(n, [0.0, 0.0, 1.0]));
        let m = |i: usize, j: usize| size * n[i] * n[j] + (if size > 0.0 { tilt } else { 0.0 }) * e[i] * e[j];
        [m(0, 0), m(1, 1), m(2, 2), m(1, 2), m(0, 2), m(0, 1)]
    };
    let component = |c: usize| {
        let values = nodes.iter().map(|p| tensor(*p)[c]).collect();
        Grade::from(Samples::new(g.origin, g.step, g.shape, values).expect("samples"))
    };
    let stress: [Grade; 6] = core::array::from_fn(component);
    let frames = Orientation::Stress(stress.into()).frames(&g, &nodes, None, None, None).expect("frames").at_nodes;
    for (n, f) in frames.iter().enumerate() {
        assert!((determinant(f) - 1.0).abs() < 1e-9);
        if nodes[n][0] < 4.6 {
            let most = (0..3).map(|i| dot([f[0][i], f[1][i], f[2][i]], axis(nodes[n])).abs()).fold(0.0, f64::max);
            assert!(most > 1.0 - 1e-9, "{most}");
        }
        for s in g.strides() {
            if n >= s && g.index(n - s).iter().zip(g.index(n)).filter(|(a, b)| **a != *b).count() == 1 {
                // The axis turns from node to node, and so does the rest of the frame along each path; another of the 24
                // frames would be 45 degrees away or more.
                assert!(angle(f, &frames[n - s]) < 30.0, "{} {:?}", angle(f, &frames[n - s]), nodes[n]);
            }
        }
    }
}

#[test]
fn directions_are_lines_and_frames_are_orthonormal() {
    let (g, nodes) = grid();
    // The sign flips in the middle; lines do not care.
    let of = [formula("sin(x)*(y-3.3)"), formula("0.5*(y-3.3)"), formula("cos(x)*(y-3.3)")];
    let frames =
        Orientation::Direction(Axis::Vector(of)).frames(&g, &nodes, None, None, None).expect("frames").at_nodes;
    for (n, f) in frames.iter().enumerate() {
        let want = unit([nodes[n][0].sin(), 0.5, nodes[n][0].cos()]);
        let z = apply(f, [0.0, 0.0, 1.0]);
        assert!((dot(z, want).abs() - 1.0).abs() < 1e-12);
        assert!(dot(z, apply(&frames[n - usize::from(n % 12 > 0)], [0.0, 0.0, 1.0])) > 0.5);
        let ff = product(f, &transpose(f));
        assert!(angle(&ff, &IDENTITY) < 1e-5);
    }
    let zero = Orientation::Direction(Axis::Vector([formula("x-1"), formula("y-2"), formula("z-3")]));
    assert!(zero.frames(&g, &nodes, None, None, None).err().expect("zero").message.contains("(1, 2, 3) mm"));
}
