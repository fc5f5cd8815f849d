//! Tessellations.

use super::*;

#[test]
fn equal_hubs_are_found_wherever_they_are() {
    let one = Quadors::new(&cubic(3, 0.0), Fillet::Auto).expect("a lattice");
    let classes = one.classes();
    // Corners, edges, faces and interior of a cube, by missing neighbours.
    assert_eq!((classes.sample.len(), one.len()), (27, 64));
    let each: f64 = (0..one.len()).map(|i| one.hub_volume(i).expect("exact")).sum();
    assert!((one.volume().expect("exact") / each - 1.0).abs() < 1e-12);
}

#[test]
fn meshes_are_closed_and_have_the_exact_volume_at_any_chord_error() {
    let mut random = Random(3);
    let mut graphs: Vec<(Graph, Fillet)> = vec![
        (cubic(1, 1.0), Fillet::Auto),
        (cubic(1, 1.0), Fillet::None),
        (star(1.0, &[], |_| Profile::Cone), Fillet::Auto),
    ];
    for (n, fillet) in [
        (1, Fillet::Auto),
        (2, Fillet::Auto),
        (3, Fillet::Tau(0.7)),
        (6, Fillet::Auto),
        (6, Fillet::None),
        (9, Fillet::Tau(0.7)),
        (14, Fillet::Auto),
    ] {
        graphs.push((random_star(&mut random, n), fillet));
    }
    let chords = [0.03, 0.0075];
    let mut counts = [0.0; 2];
    for (graph, fillet) in graphs {
        let q = Quadors::new(&graph, fillet).expect("a lattice");
        if !q.overlaps().is_empty() {
            continue;
        }
        let exact = q.mass().expect("exact");
        for (chord, sum) in chords.iter().zip(&mut counts) {
            let (mesh, error) = q.mesh(*chord).expect("meshed");
            let m = geometry::measure::size(&mesh);
            let name = format!("{} beams {fillet:?} at {chord}", graph.beams.len());
            assert!(m.closed && m.pieces == 1 && m.cavities == 0, "{name}: {m:?}");
            // Also after rounding to single precision.
            let mut low = mesh.clone();
            let round = |c: &mut f64| *c = f64::from(*c as f32);
            low.vertices.iter_mut().flatten().for_each(round);
            for mesh in [&mesh, &low] {
                assert_eq!(geometry::mesh::self_intersections(mesh, 1), 0, "{name}");
                let flat = (0..mesh.triangles.len()).any(|i| geometry::mesh::degenerate(mesh, i));
                assert!(!flat, "{name}");
            }
            assert!(error <= *chord, "{name}: {error}");
            // The exact volume is known to 1e-10, and the factor of the moves to rounding.
            let off = mesh.volume() / exact.volume - 1.0;
            assert!(off.abs() < 2e-10, "{name}: {off}");
            // Areas are not balanced: at most the distance times twice the mean curvature, 1 / radius for a cylinder, off.
            let thin = (0..q.beams()).map(|b| q.pencil(b).waist()).fold(1.0, f64::min);
            let off = geometry::measure::size(&mesh).area / exact.area - 1.0;
            assert!(off.abs() < 2.0 * chord / thin, "{name}: {off}");
            *sum += mesh.triangles.len() as f64;
        }
    }
    // Halving edges divides the chord error by four.
    let [a, b] = counts;
    assert!(b < 4.4 * a, "{a} {b}");
}

/// Symmetric hubs, complete and partial as at the boundary of a block: vertices of valence four, seams in planes
/// through the centre.
#[test]
fn symmetric_hubs_are_meshed() {
    let octet = orbit([1.0, 1.0, 0.0]);
    let part = |axes: &[usize]| {
        let kept = |v: &&Vec3| axes.iter().all(|&a| v[a] >= -1e-9);
        octet.iter().filter(kept).copied().collect::<Vec<Vec3>>()
    };
    let of = |some: &[usize]| some.iter().map(|&i| six()[i]).collect::<Vec<Vec3>>();
    for axes in [
        six(),
        orbit([1.0, 1.0, 1.0]),
        part(&[]),
        part(&[2]),
        part(&[0, 2]),
        part(&[0, 1, 2]),
        // Collinear beams along one or two axes, and others on one side: fillets between equal cylinders have zero
        // width there.
        of(&[0, 3]),
        of(&[0, 3, 2]),
        of(&[0, 3, 2, 1]),
        of(&[0, 3, 2, 5]),
        of(&[0, 3, 2, 5, 1]),
    ] {
        for fillet in [Fillet::Auto, Fillet::None] {
            let q = equal(&axes, 14.0, fillet);
            let (mut mesh, _) = q
                .mesh(0.03)
                .unwrap_or_else(|e| panic!("{axes:?} {fillet:?}: {e} {:#?}", complex::Complex::new(&q.hub(0))));
            let m = geometry::measure::size(&mesh);
            assert!(m.closed && m.euler == 2 && m.pieces == 1, "{fillet:?} {m:?}");
            let round = |c: &mut f64| *c = f64::from(*c as f32);
            mesh.vertices.iter_mut().flatten().for_each(round);
            assert_eq!(geometry::mesh::self_intersections(&mesh, 1), 0, "{fillet:?} {}", axes.len());
        }
    }
}

/// Hub by hub, as streamed: the same triangles, and the measures of the whole from those of the classes.
#[test]
fn what_is_drawn_hub_by_hub_is_the_mesh() {
    for fillet in [Fillet::Auto, Fillet::None] {
        let q = Quadors::new(&cubic(2, 1.0), fillet).expect("a lattice");
        let tessellation = q.tessellation(0.02).expect("drawn");
        let mesh = tessellation.mesh().expect("joined");
        let streamed: Vec<[Vec3; 3]> = (0..q.len()).flat_map(|i| tessellation.hub(i)).collect();
        let placed = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
        assert!(streamed.iter().eq(&mesh.triangles.iter().map(placed).collect::<Vec<_>>()));
        let (want, got) = (geometry::measure::size(&mesh), tessellation.measures());
        assert_eq!(got.triangles, mesh.triangles.len());
        assert_eq!((got.euler, got.components), (want.euler, want.pieces));
        // Sums of thousands of terms in different order.
        assert!((got.volume / want.volume - 1.0).abs() < 1e-11);
        assert!((got.area / want.area - 1.0).abs() < 1e-11);
    }
}

/// A cylinder's triangles run along it: their number is about that of the vertices of its seam and end circle.
#[test]
fn cylinders_take_few_triangles() {
    let q = equal(&six(), 14.0, Fillet::None);
    for chord in [0.03, 0.003, 0.0003] {
        let tessellation = q.tessellation(chord).expect("drawn");
        let n: usize = (0..q.beams()).map(|b| q.circle_size(b, chord)).sum();
        let got = tessellation.hub_mesh(0).triangles.len();
        assert!(got < 3 * n, "{chord}: {got} for {n} points of end circles");
    }
}

/// Second order: a fourth of the chord error needs four times the triangles, and the allowed error is used.
#[test]
fn fillets_take_triangles_as_the_chord_error_says() {
    for axes in [six(), orbit([1.0, 1.0, 0.0]), orbit([1.0, 1.0, 1.0])] {
        let q = equal(&axes, 14.0, Fillet::Auto);
        let [some, more] = [0.02, 0.005].map(|c| q.tessellation(c).expect("drawn").triangles() as f64);
        assert!(more < 4.4 * some, "{}: {some} {more}", axes.len());
        let (mesh, _) = q.mesh(0.005).expect("meshed");
        let middles: Vec<Vec3> = (mesh.triangles.iter())
            .map(|t| {
                let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
                scale(add(a, add(b, c)), 1.0 / 3.0)
            })
            .collect();
        let near = q.closest_points();
        let off = |p: &Vec3| near.closest(*p).expect("a place").distance.abs();
        let mean = middles.iter().map(off).sum::<f64>() / middles.len() as f64;
        // Bisection leaves edges at a quarter to all of the chord error, and the moves of vertices centroids at a third of that.
        assert!(mean > 0.25 / 3.0 * 0.005, "{}: {mean}", axes.len());
    }
}

#[test]
fn beams_that_nearly_touch_without_a_common_hub_do_not_cross() {
    let hub = |center: Vec3| crate::graph::HubBall { center, radius: 0.5 };
    let beam = |ends| Beam { ends, profile: Profile::Cylinder };
    for apart in [1e-3, 3e-3, 1e-2, 0.1] {
        let h = 1.0 + apart;
        let crossed = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, -10.0, h], [0.0, 10.0, h]];
        let parallel = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [-8.0, 0.0, h], [11.0, 0.0, h]];
        for centers in [crossed, parallel] {
            let graph = Graph { hubs: centers.map(hub).to_vec(), beams: vec![beam([0, 1]), beam([2, 3])] };
            let q = Quadors::new(&graph, Fillet::None).expect("two rods");
            let (mesh, _) = q.mesh(0.01).expect("a mesh");
            assert_eq!(geometry::mesh::self_intersections(&mesh, 1), 0, "{apart}");
        }
    }
}

#[test]
fn shares_of_the_chord_error_ask_nothing_of_end_circles() {
    // End circles are divided by the chord error itself: hubs that are refined to a share of it, since their vertices could not be moved,
    // took more and more triangles there, without end.
    let hub = |center, radius| crate::graph::HubBall { center, radius };
    let hubs = vec![
        hub([0.0; 3], 0.5),
        hub([10.0, 0.0, 0.0], 0.5),
        hub([10.0, 10.0, 0.0], 0.6),
        hub([0.0, 10.0, 0.0], 0.5),
        hub([5.0, 5.0, 8.0], 0.8),
    ];
    let ends = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];
    let beams = ends.map(|ends| Beam { ends, profile: Profile::Mid(0.4) }).to_vec();
    let lattice = Quadors::new(&Graph { hubs, beams }, Fillet::Auto).expect("a lattice");
    for chord in [0.142, 0.071, 0.036, 0.0355, 0.034, 0.02] {
        let (mesh, error) = lattice.mesh(chord).expect("a mesh");
        assert!(error <= chord && mesh.triangles.len() < 6000, "{chord}: {}", mesh.triangles.len());
    }
}
