use std::collections::{HashMap, HashSet};

use super::super::tests::{Random, random_star, six, star};
use super::parameter_curves::ParameterCurve;
use super::*;
use crate::graph::{Beam, Graph, HubBall, Profile, catalogue, named};
use crate::quador::{Fillet, Pencil};
use geometry::math::{cross, dot, norm, scale, unit};

/// How far edges are off faces, relative to the distance from the hub's centre. The planes of seams are displaced by some 1e-12
/// radii so that events are apart; arcs of up to 1e-7 radii that nearly coinciding events leave are collapsed, which
/// moves the ends of others.
const OFF: f64 = 1e-11;
const COLLAPSED: f64 = 1e-7;

/// n³ unit cells of a catalogue cell with edges of 10 mm.
fn block(name: &str, n: i32, radius: impl Fn(usize) -> f64, profile: impl Fn(usize) -> Profile) -> Graph {
    let cell = named(name).expect("in the catalogue");
    let periodic = cell.graph().expect("a group");
    let mut known = HashMap::new();
    let mut graph = Graph::default();
    let cells = (0..n * n * n).map(|i| [i / (n * n), i / n % n, i % n]);
    for at in cells {
        for beam in &periodic.beams {
            let far = [0, 1, 2].map(|a| at[a] + beam.shift[a]);
            let ends = [(beam.ends[0], at), (beam.ends[1], far)].map(|(node, cell)| {
                *known.entry((node, cell)).or_insert_with(|| {
                    let p = periodic.nodes[node];
                    let center = [0, 1, 2].map(|a| 10.0 * (p[a] + f64::from(cell[a])));
                    graph.hubs.push(HubBall { center, radius: radius(graph.hubs.len()) });
                    graph.hubs.len() as u32 - 1
                })
            });
            graph.beams.push(Beam { ends, profile: profile(graph.beams.len()) });
        }
    }
    graph
}

/// What was found in a boundary.
struct Checked {
    /// Numbers of corners, edges and faces.
    counts: [usize; 3],
    /// Share of points of edges that are off their faces by more than `OFF`.
    coarse: f64,
}

/// Checks topology and geometry of a boundary.
fn check(q: &Quadors) -> Checked {
    let brep = q.brep(&[]).expect("a boundary");
    let (checked, euler) = check_brep(&brep);
    // A component of the graph with as many cycles as its genus.
    assert_eq!(euler, 2 * (q.len() as i64 - q.beams() as i64));
    let (volume, want) = (volume(&brep), q.volume().expect("a volume"));
    assert!((volume / want - 1.0).abs() < 1e-9, "{volume} {want}");
    checked
}

/// The volume within a boundary.
fn volume(brep: &Brep) -> f64 {
    brep.components().iter().map(|faces| brep.volume(faces).expect("boundary forms")).sum()
}

/// The same of any boundary, and its Euler number.
fn check_brep(brep: &Brep) -> (Checked, i64) {
    let mut uses: HashMap<u32, Vec<bool>> = HashMap::new();
    let (mut corners, mut rings, mut off) = (HashSet::new(), 0i64, [0; 2]);
    for face in &brep.faces {
        let loops = brep.loops(face);
        rings += loops.len() as i64 - 1;
        let mut area = 0.0;
        for l in &loops {
            for (k, &of) in l.iter().enumerate() {
                uses.entry(of.0).or_default().push(of.1);
                let next = l[(k + 1) % l.len()];
                let curve = brep.curve(of, &face.frame);
                let end = brep.start((of.0, !of.1));
                assert_eq!(end, brep.start(next), "loops are closed");
                corners.insert(end);
                check_edge(brep, face, of, &curve, &mut off);
                area += swept(brep, face, of);
            }
        }
        // Counter-clockwise in the parameter plane, whose normal points outwards.
        assert!(area > 0.0, "{face:?}");
        check_normal(face, &brep.curve(loops[0][0], &face.frame));
    }
    for (edge, of) in &uses {
        assert!(of.len() == 2 && of[0] != of[1], "edge {edge} is used {of:?}");
    }
    let euler = corners.len() as i64 - uses.len() as i64 + brep.faces.len() as i64 - rings;
    let shells = brep.components();
    assert_eq!(shells.iter().map(Vec::len).sum::<usize>(), brep.faces.len());
    let counts = [corners.len(), uses.len(), brep.faces.len()];
    (Checked { counts, coarse: off[1] as f64 / off[0] as f64 }, euler)
}

/// An edge begins and ends in its corners, and lies on the face, in space and by its curve in the parameter plane.
fn check_edge(brep: &Brep, face: &BrepFace, of: EdgeUse, curve: &Bezier<3>, counts: &mut [usize; 2]) {
    let radius = brep.quadors.hub(face.frame.hub as usize).radius;
    for (end, corner) in [(0, of), (2, (of.0, !of.1))] {
        let at = brep.corner(brep.start(corner), &face.frame);
        assert!(norm(sub(curve.points[end], at)) < 1e-13 * (radius + norm(at)));
    }
    let forward = brep.curve((of.0, true), &face.frame);
    let flat = brep.parameter_curve(face, of.0);
    for k in 0..=6 {
        let t = f64::from(k) / 6.0;
        let x = forward.at(t);
        let off = face.quadric.at(x).abs() / (2.0 * norm(face.quadric.half_gradient(x)));

        let off = off / (radius + norm(x));
        assert!(off < COLLAPSED, "{off:e} at {x:?} of {face:?}");
        *counts = [counts[0] + 1, counts[1] + usize::from(off > OFF)];
        let apart = norm(sub(face.surface.at(flat.in_units(face, t)), x));
        // Polynomials of limited degree: far below the tolerance of 1e-7 mm that the file declares.
        assert!(apart < (1e-9 + 10.0 * off) * (radius + norm(x)), "{apart:e} of {:?}", face.surface);
    }
}

/// Twice the area that the use of an edge sweeps about the origin of the parameter plane, by chords.
fn swept(brep: &Brep, face: &BrepFace, (edge, forward): EdgeUse) -> f64 {
    let flat = brep.parameter_curve(face, edge);
    let points: Vec<[f64; 2]> = (0..=16).map(|k| flat.at(f64::from(k) / 16.0)).collect();
    let turn: f64 = points.windows(2).map(|w| w[0][0] * w[1][1] - w[0][1] * w[1][0]).sum();
    if forward { turn } else { -turn }
}

/// The normal of the surface, by central differences, points out of the solid.
fn check_normal(face: &BrepFace, curve: &Bezier<3>) {
    let x = curve.at(0.5);
    let [u, v] = face.surface.parameters(x);
    let h = 1e-5;
    let along = |du: f64, dv: f64| sub(face.surface.at([u + du, v + dv]), face.surface.at([u - du, v - dv]));
    let normal = unit(cross(along(h, 0.0), along(0.0, h)));
    assert!(dot(normal, unit(face.quadric.half_gradient(x))) > 0.99, "{:?}", face.surface);
}

impl ParameterCurve {
    /// As `at`, in the units of the face's surface.
    fn in_units(&self, face: &BrepFace, t: f64) -> [f64; 2] {
        let at = self.at(t);
        match face.surface {
            Surface::Rational { range, .. } => [0, 1].map(|a| range[a][0] + at[a] * (range[a][1] - range[a][0])),
            _ => at,
        }
    }
}

#[test]
fn the_boundary_of_a_rod_is_closed() {
    let graph = star(1.0, &[([1.0, 0.0, 0.0], 10.0, 1.0)], |_| Profile::Cylinder);
    let q = Quadors::new(&graph, Fillet::Auto).expect("a rod");
    // Two half cylinders, and two half balls in quarters; the circles are cut where the planes meet them.
    assert_eq!(check(&q).counts[2], 10);
    let ball = Quadors::new(&star(1.0, &[], |_| Profile::Cone), Fillet::None).expect("a ball");
    assert_eq!(check(&ball).counts, [6, 8, 4]);
}

#[test]
fn a_simple_cubic_hub_has_its_known_faces() {
    let ends: Vec<_> = six().into_iter().map(|u| (u, 10.0, 1.0)).collect();
    let q = Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), Fillet::Tau(0.7)).expect("a star");
    let of_hub = |kind: fn(&Kind) -> bool| {
        let brep = q.brep(&[]).expect("a boundary");
        brep.faces.iter().filter(|f| f.frame.hub == 0 && kind(&f.kind)).count()
    };
    check(&q);
    // Six beams in halves, twelve fillets of two beams and eight of three.
    assert_eq!(of_hub(|k| matches!(k, Kind::Beam(_))), 12);
    assert_eq!(of_hub(|k| matches!(k, Kind::Fillet(_))), 20);
    assert_eq!(of_hub(|k| matches!(k, Kind::Ball(_))), 0);
}

#[test]
fn every_cell_of_the_catalogue_has_a_closed_boundary() {
    for cell in catalogue() {
        for fillet in [Fillet::Auto, Fillet::None] {
            for (radius, profile) in [(0.0, Profile::Cone), (0.1, Profile::Cone), (0.0, Profile::Waist(0.2))] {
                let graph = block(cell.name, 1, |k| 0.3 + radius * (k % 3) as f64, |_| profile);
                let q = Quadors::new(&graph, fillet).expect("a cell");
                assert_eq!(check(&q).coarse, 0.0, "{}", cell.name);
            }
        }
    }
}

#[test]
fn equal_hubs_have_equal_curves() {
    let of_cells = |n: i32| {
        let graph = block("octet", n, |_| 0.4, |_| Profile::Cone);
        let q = Quadors::new(&graph, Fillet::Auto).expect("a block");
        check(&q);
        let brep = q.brep(&[]).expect("a boundary");
        let used = |face: &BrepFace| {
            brep.loops(face).concat().into_iter().map(|u| brep.curve_key(face, u.0)).collect::<Vec<_>>()
        };
        brep.faces.iter().flat_map(used).collect::<HashSet<CurveKey>>().len()
    };
    // From three cells on, hubs of every kind are there: inner ones, and those of faces, edges and corners of the block.
    assert_eq!(of_cells(3), of_cells(4));
}

/// Eight cells of beams between shaken hubs of different radii, with radii at mid length up to `widest` (mm).
fn random_frame(random: &mut Random, fillet: Fillet, widest: f64) -> Quadors {
    let mut graph = block("sc", 2, |_| 0.0, |_| Profile::Cone);
    for hub in &mut graph.hubs {
        hub.center = hub.center.map(|v| v + 3.0 * random.next());
        hub.radius = 0.5 + 0.5 * random.next();
    }
    for beam in &mut graph.beams {
        let mid = Profile::Mid(0.3 + (widest - 0.3) * random.next());
        beam.profile = if random.next() < 0.5 { Profile::Cone } else { mid };
    }
    Quadors::new(&graph, fillet).expect("a frame")
}

#[test]
fn random_frames_have_closed_boundaries() {
    let mut random = Random(5);
    for fillet in [Fillet::Auto, Fillet::Tau(0.8), Fillet::None] {
        check(&random_frame(&mut random, fillet, 0.7));
    }
}

#[test]
fn random_hubs_have_closed_boundaries() {
    let mut random = Random(17);
    let mut made = 0;
    for n in 1..=12 {
        for fillet in [Fillet::Auto, Fillet::Tau(0.7), Fillet::None] {
            let q = Quadors::new(&random_star(&mut random, n), fillet).expect("a star");
            if q.overlaps().is_empty() && q.collisions().is_empty() {
                assert!(check(&q).coarse < 1e-2);
                made += 1;
            }
        }
    }
    assert!(made > 24, "{made}");
}

#[test]
fn components_are_shells_and_collisions_are_refused() {
    let hub = |x: f64, y: f64, z: f64| HubBall { center: [x, y, z], radius: 1.0 };
    let crossed = |z: f64| Graph {
        hubs: vec![hub(0.0, 0.0, 0.0), hub(10.0, 0.0, 0.0), hub(5.0, -5.0, z), hub(5.0, 5.0, z), hub(30.0, 0.0, 0.0)],
        beams: vec![
            Beam { ends: [0, 1], profile: Profile::Cylinder },
            Beam { ends: [2, 3], profile: Profile::Cylinder },
        ],
    };
    let apart = Quadors::new(&crossed(3.0), Fillet::Auto).expect("two rods and a ball");
    check(&apart);
    assert_eq!(apart.brep(&[]).expect("a boundary").components().len(), 3);
    let crossing = Quadors::new(&crossed(1.0), Fillet::Auto).expect("two rods and a ball");
    assert!(crossing.brep(&[]).is_err_and(|fault| fault.message.contains("intersect without a common hub")));
}

/// What is behind a plane and what is in front of it are closed, and together the whole.
fn check_halves(q: &Quadors, point: Vec3, normal: Vec3, name: &str) {
    let of = |normal: Vec3| SlicePlane::new(point, normal).expect("a plane");
    let [behind, front] = [of(normal), of(scale(normal, -1.0))].map(|plane| {
        let brep = q.brep(&[plane]).unwrap_or_else(|fault| panic!("{name}: {}", fault.message));
        check_brep(&brep);
        volume(&brep)
    });
    let want = q.volume().expect("a volume");
    assert!(((behind + front) / want - 1.0).abs() < 1e-8, "{name}: {behind} + {front} = {want}");
}

#[test]
fn halves_of_cells_are_closed_and_make_the_whole() {
    let directions = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.3, -0.5, 0.8]];
    for cell in catalogue() {
        for fillet in [Fillet::Auto, Fillet::None] {
            let graph = block(cell.name, 1, |_| 0.4, |_| Profile::Cylinder);
            let q = Quadors::new(&graph, fillet).expect("a cell");
            // Through nodes, axes and the symmetry planes of hubs, and through none of them.
            for point in [[0.0; 3], [5.0; 3], [3.1, 4.3, 5.7]] {
                for normal in directions {
                    check_halves(&q, point, normal, &format!("{} {fillet:?} {point:?} {normal:?}", cell.name));
                }
            }
        }
    }
}

/// The hubs of a lattice, each closed, have together the volume of the whole, also of what is behind some planes.
fn check_groups(q: &Quadors, planes: &[SlicePlane], name: &str) {
    let mut sum = 0.0;
    for group in q.hub_groups(planes) {
        let brep = q.group_brep(&group).unwrap_or_else(|fault| panic!("{name}: {}", fault.message));
        if !brep.faces.is_empty() {
            check_brep(&brep);
            sum += volume(&brep) * group.hubs.len() as f64;
        }
    }
    let want = volume(&q.brep(planes).expect("a boundary"));
    assert!((sum / want - 1.0).abs() < 1e-6, "{name}: {sum} = {want}");
}

#[test]
fn groups_are_closed_and_make_the_whole() {
    let plane = |point, normal| SlicePlane::new(point, normal).expect("a plane");
    for cell in catalogue() {
        for fillet in [Fillet::Auto, Fillet::None] {
            let graph = block(cell.name, 1, |_| 0.4, |_| Profile::Cylinder);
            let q = Quadors::new(&graph, fillet).expect("a cell");
            let name = format!("{} {fillet:?}", cell.name);
            check_groups(&q, &[], &name);
            // Through nodes, through the middles of beams, and slanted.
            check_groups(&q, &[plane([5.0; 3], [1.0, 0.0, 0.0]), plane([3.0; 3], [0.0, -1.0, 0.0])], &name);
            check_groups(&q, &[plane([2.5; 3], [0.0, 0.0, 1.0])], &name);
            check_groups(&q, &[plane([4.1, 5.3, 4.7], [0.3, -0.5, 0.8])], &name);
        }
    }
    let mut random = Random(29);
    for fillet in [Fillet::Auto, Fillet::Tau(0.8), Fillet::None] {
        let q = random_frame(&mut random, fillet, 1.2);
        check_groups(&q, &[], &format!("{fillet:?}"));
    }
}

#[test]
fn equal_hubs_are_one_group() {
    let q = Quadors::new(&block("sc", 4, |_| 1.0, |_| Profile::Cylinder), Fillet::Auto).expect("a block");
    let groups = q.hub_groups(&[]);
    // Beams begin at 4³ hubs, of which 8 kinds lack those from below; 3 kinds are ends.
    assert_eq!((groups.len(), groups.iter().map(|g| g.hubs.len()).sum::<usize>()), (8 + 3, 64 + 3 * 16));
}

#[test]
fn random_frames_are_cut_by_random_planes() {
    let mut random = Random(23);
    for fillet in [Fillet::Auto, Fillet::Tau(0.8), Fillet::None] {
        let q = random_frame(&mut random, fillet, 1.2);
        for _ in 0..16 {
            let point = [0; 3].map(|_| 20.0 * random.next());
            let normal = [0; 3].map(|_| 2.0 * random.next() - 1.0);
            check_halves(&q, point, normal, &format!("{fillet:?} {point:?} {normal:?}"));
        }
    }
}

/// As graded radii are: equal, or on a cone, but for rounding.
#[test]
fn beams_that_are_nearly_straight_are_cylinders_and_cones() {
    let cone = Pencil::new(10.0, [0.5, 0.3], Profile::Cone).expect("a cone").lambda;
    for (radii, profile) in [
        ([0.3, 0.3], Profile::Mid(0.1 + 0.2)),
        ([0.3, 0.3], Profile::Mid(0.3 * (1.0 - 1e-14))),
        ([0.5, 0.3], Profile::Lambda(cone * (1.0 + 1e-15))),
        ([0.5, 0.3], Profile::Lambda(cone * (1.0 - 1e-13))),
    ] {
        let hub = |x: f64, radius: f64| HubBall { center: [x, 0.0, 0.0], radius };
        let hubs = vec![hub(0.0, radii[0]), hub(10.0, radii[1])];
        let q =
            Quadors::new(&Graph { hubs, beams: vec![Beam { ends: [0, 1], profile }] }, Fillet::None).expect("a rod");
        check(&q);
        let brep = q.brep(&[]).expect("a boundary");
        let beams = brep.faces.iter().filter(|f| matches!(f.kind, Kind::Beam(_))).map(|f| f.surface);
        for surface in beams {
            match surface {
                Surface::Cylinder { .. } => assert!(radii[0] == radii[1]),
                Surface::Cone { .. } => assert!(radii[0] != radii[1]),
                other => panic!("{other:?}"),
            }
        }
    }
}
