//! Beams as frusta of cones, for formats that know nothing else.
//!
//! A beam ρ(z) between two balls is one frustum with the balls' radii at its ends if that is within the tolerance: always so for
//! cylinders, usually for cones. Otherwise it is a chain of frusta from one contact circle to the other, whose nodes lie on the
//! beam's meridian and which is bisected where it is farthest from it. Errors are differences of the radius at a point of the axis,
//! which bound the distance of the surfaces; their extremes have a closed form, since the meridian is a conic.

use rayon::prelude::*;

use crate::quador::{Pencil, Quadors};
use geometry::formats::{BeamGraph, BeamLattice, Cap, Frustum};
use geometry::math::{add, dot, norm, scale, sub};

/// Greatest depth of bisection: an error falls to a quarter with each.
const DEPTH: usize = 12;

/// A lattice of frusta, and how well it represents the beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frusta {
    /// The frusta.
    pub lattice: BeamLattice,
    /// Number of hubs; they are the first nodes.
    pub hubs: usize,
    /// The beam that each frustum belongs to.
    pub beam: Vec<u32>,
    /// Number of beams that are several frusta.
    pub split: usize,
    /// Greatest difference of radii of beams and frusta, mm.
    pub error: f64,
}

/// A frustum or a chain of frusta of one beam.
enum Shape {
    /// One, with the radii of the balls.
    Single,
    /// Positions on the axis from the first centre and radii there, mm; a centre is among them at both ends.
    Chain(Vec<[f64; 2]>),
}

impl Quadors {
    /// The beams as frusta, with radii no further than `tolerance` (mm) from those of the beams. Fillets are left out.
    pub fn frusta(&self, tolerance: f64) -> Frusta {
        let shapes: Vec<(Shape, f64)> =
            (0..self.beams()).into_par_iter().map(|b| approximate(self.pencil(b), tolerance)).collect();
        let mut out = Frusta { hubs: self.len(), ..Frusta::default() };
        let lattice = &mut out.lattice;
        lattice.nodes = (0..self.len()).map(|i| self.center(i)).collect();
        // The hubs whose ball no frustum has as its cap.
        let mut bare = vec![true; self.len()];
        for (b, (shape, error)) in shapes.into_iter().enumerate() {
            let (ends, pencil) = (self.ends(b), self.pencil(b));
            out.error = out.error.max(error);
            let Shape::Chain(chain) = shape else {
                lattice.beams.push(Frustum { ends, radii: pencil.radii, caps: [Cap::Sphere; 2] });
                out.beam.push(b as u32);
                ends.iter().for_each(|e| bare[*e as usize] = false);
                continue;
            };
            out.split += 1;
            let [from, to] = ends.map(|e| self.center(e as usize));
            let axis = scale(sub(to, from), 1.0 / norm(sub(to, from)));
            let nodes: Vec<u32> = (chain.iter())
                .map(|[z, _]| match *z {
                    0.0 => ends[0],
                    z if z == pencil.length => ends[1],
                    z => {
                        lattice.nodes.push(add(from, scale(axis, z)));
                        lattice.nodes.len() as u32 - 1
                    }
                })
                .collect();
            for (n, c) in nodes.windows(2).zip(chain.windows(2)) {
                lattice.beams.push(Frustum { ends: [n[0], n[1]], radii: [c[0][1], c[1][1]], caps: [Cap::Butt; 2] });
                out.beam.push(b as u32);
            }
        }
        let used = lattice.beams.iter().flat_map(|b| b.ends).filter(|n| (*n as usize) < self.len());
        let mut met = vec![false; self.len()];
        used.for_each(|n| met[n as usize] = true);
        let balls = (0..self.len()).filter(|i| bare[*i] && met[*i]);
        lattice.balls = balls.map(|i| (i as u32, self.hub(i).radius)).collect();
        out
    }
}

/// How far the nodes of a chain may be from the meridian of one quadric, as a share of its radius: files give some seven digits.
const SAME: f64 = 1e-4;

/// The beams that chains of frusta were joined to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JoinedChains {
    /// The beams that were chains: the last ones.
    pub beams: core::ops::Range<u32>,
    /// Number of frusta that were parts of them.
    pub frusta: usize,
}

/// Makes one beam of each chain of frusta that represents one quadric as [`Quadors::frusta`] does: the radius of its two ends is then
/// that of the quadric at mid length. Its hubs have balls, of their own or as other beams' ends. What goes on from a hub to a contact
/// circle behind its centre is dropped, as its ball holds it. Other chains stay.
pub fn join_chains(graph: &mut BeamGraph) -> JoinedChains {
    let mut joined = JoinedChains { beams: graph.beams.len() as u32..graph.beams.len() as u32, frusta: 0 };
    if graph.flat.is_empty() {
        return joined;
    }
    let count = graph.nodes.len();
    let mut balls = graph.radii.clone();
    balls.resize(count, f64::NAN);
    let mut chains = Chains { graph, links: vec![Vec::new(); count], balls, is_joint: vec![true; count] };
    for (i, (ends, radii)) in graph.beams.iter().zip(&graph.beam_radii).enumerate() {
        for ((n, r), is_flat) in ends.iter().zip(radii).zip(graph.flat[i]) {
            let n = *n as usize;
            chains.links[n].push(i as u32);
            if !is_flat {
                chains.balls[n] = chains.balls[n].max(*r);
            }
        }
    }
    for (n, is_joint) in chains.is_joint.iter_mut().enumerate() {
        *is_joint = chains.balls[n].is_nan() && matches!(chains.links[n].len(), 1 | 2);
    }
    let mut used = vec![false; graph.beams.len()];
    let mut made = Vec::new();
    for first in 0..graph.beams.len() {
        let hub = graph.beams[first].iter().position(|n| !chains.is_joint[*n as usize]);
        let Some(at) = hub.filter(|_| !used[first]) else { continue };
        let chain = chains.follow(first, at);
        if chains.lead_to_contact(&chain) {
            chain.iter().for_each(|(i, _)| used[*i] = true);
            joined.frusta += chain.len();
        } else if let Some(radius) = chains.quadric_of(&chain) {
            chain.iter().for_each(|(i, _)| used[*i] = true);
            joined.frusta += chain.len();
            let (last, end) = chain[chain.len() - 1];
            made.push(([graph.beams[first][at], graph.beams[last][1 - end]], [radius; 2]));
        }
    }
    let kept = used.iter().filter(|u| !**u).count() as u32;
    joined.beams = kept..kept + made.len() as u32;
    if joined.frusta > 0 {
        // What was the ball of another beam's end holds those that are joined.
        graph.radii = core::mem::take(&mut chains.balls);
        let keep = |n: usize| !used[n];
        graph.beams =
            (0..used.len()).filter(|i| keep(*i)).map(|i| graph.beams[i]).chain(made.iter().map(|m| m.0)).collect();
        let radii = (0..used.len()).filter(|i| keep(*i)).map(|i| graph.beam_radii[i]);
        graph.beam_radii = radii.chain(made.iter().map(|m| m.1)).collect();
        let flat = (0..used.len()).filter(|i| keep(*i)).map(|i| graph.flat[i]);
        graph.flat = flat.chain(made.iter().map(|_| [false; 2])).collect();
        graph.drop_unused();
    }
    joined
}

/// Frusta by their nodes.
struct Chains<'a> {
    graph: &'a BeamGraph,
    /// The frusta that end at each node.
    links: Vec<Vec<u32>>,
    /// The radius of the ball at each node, NaN where there is none.
    balls: Vec<f64>,
    /// Whether one or two frusta end at a node, and no ball is there.
    is_joint: Vec<bool>,
}

impl Chains<'_> {
    /// The frusta from an end on, through joints, each with the end at which it is entered.
    fn follow(&self, first: usize, entered: usize) -> Vec<(usize, usize)> {
        let beams = &self.graph.beams;
        let mut chain = vec![(first, entered)];
        loop {
            let (i, end) = chain[chain.len() - 1];
            let node = beams[i][1 - end];
            // A chain ends where it comes back to its start, too.
            let next = self.links[node as usize].iter().map(|l| *l as usize).find(|l| *l != i);
            let Some(next) = next.filter(|_| self.is_joint[node as usize]) else {
                return chain;
            };
            chain.push((next, usize::from(beams[next][1] == node)));
        }
    }

    /// The nodes at the ends of a chain.
    fn ends(&self, chain: &[(usize, usize)]) -> Option<[usize; 2]> {
        let ((first, entered), (last, left)) = (chain.first()?, chain.last()?);
        let beams = &self.graph.beams;
        Some([beams[*first][*entered] as usize, beams[*last][1 - left] as usize])
    }

    /// Whether a chain ends at a circle on the ball of the hub where it begins, and nothing goes on from there.
    fn lead_to_contact(&self, chain: &[(usize, usize)]) -> bool {
        let (Some([hub, tip]), Some((last, left))) = (self.ends(chain), chain.last()) else { return false };
        let length = norm(sub(self.graph.nodes[tip], self.graph.nodes[hub]));
        let radius = self.graph.beam_radii[*last][1 - left];
        self.is_joint[tip] && (length.hypot(radius) / self.balls[hub] - 1.0).abs() <= SAME
    }

    /// The radius at mid length of the quadric that a chain of frusta represents, mm; `None` if it is none.
    fn quadric_of(&self, chain: &[(usize, usize)]) -> Option<f64> {
        let BeamGraph { nodes, beams, beam_radii, .. } = self.graph;
        let ends = self.ends(chain)?;
        let ((first, entered), (last, left)) = (*chain.first()?, *chain.last()?);
        let [from, to] = ends.map(|n| nodes[n]);
        let (length, radii) = (norm(sub(to, from)), ends.map(|n| self.balls[n]));
        let least = (radii[0] - radii[1]).abs();
        if least.is_nan() || length <= least {
            return None;
        }
        let axis = scale(sub(to, from), 1.0 / length);
        // Positions on the axis and radii, of both frusta that meet there.
        let mut joints = Vec::new();
        for pair in chain.windows(2) {
            let [(i, end), (j, start)] = [pair[0], pair[1]];
            let way = sub(nodes[beams[i][1 - end] as usize], from);
            let z = dot(way, axis);
            let radii = [beam_radii[i][1 - end], beam_radii[j][start]];
            if norm(sub(way, scale(axis, z))) > SAME * radii[0] {
                return None;
            }
            joints.push((z, radii));
        }
        let (z1, z2) = (joints.first()?.0, joints.last()?.0);
        // Contact circles are L/2λ from the radical plane. A straight neck leads to one; where both lie behind the centres, λ is a
        // root of u²λ² − qλ + L²/4 at any position u from that plane.
        let necks = [first, last].map(|i| beam_radii[i][0] == beam_radii[i][1]);
        let pencil = Pencil { length, radii, lambda: 1.0 };
        let radical = pencil.radical_plane();
        let lambdas = match necks {
            [true, _] => [0.5 * length / (radical - z1); 2],
            [_, true] => [0.5 * length / (z2 - radical); 2],
            _ => {
                let (z, [r, _]) = joints[joints.len() / 2];
                let u = z - radical;
                let q = r * r - radii[0] * radii[0] + z * z - length * u;
                let root = (q * q - (u * length).powi(2)).max(0.0).sqrt();
                [q + root, q - root].map(|of| 0.5 * length * length / of)
            }
        };
        // Without a neck a chain begins in the plane of the centre.
        let at_hubs = [(0.0, beam_radii[first][entered]), (length, beam_radii[last][1 - left])];
        let bare = at_hubs.into_iter().zip(necks).filter(|(_, neck)| !neck).map(|((z, r), _)| (z, [r; 2]));
        joints.extend(bare);
        let (low, high) = pencil.lambda_range();
        let is_on = |of: &Pencil| {
            let near = |z: f64, r: f64| (r - of.radius_squared(z).max(0.0).sqrt()).abs() <= SAME * r;
            joints.iter().all(|(z, radii)| radii.iter().all(|r| near(*z, *r)))
        };
        let found = lambdas.into_iter().filter(|l| *l > low && *l < high).map(|lambda| Pencil { lambda, ..pencil });
        found.into_iter().find(is_on).map(|p| p.radius_squared(0.5 * length).max(0.0).sqrt())
    }
}

/// The frusta of a beam, and the greatest error of its radii, mm.
fn approximate(pencil: &Pencil, tolerance: f64) -> (Shape, f64) {
    let [r1, r2] = pencil.radii;
    let (z1, z2) = (pencil.contact(0), pencil.length - pencil.contact(1));
    let single = error(pencil, [[0.0, r1], [pencil.length, r2]], [z1.max(0.0), z2.min(pencil.length)]);
    if single <= tolerance || r1 == r2 && pencil.lambda == 1.0 {
        return (Shape::Single, single);
    }
    let on = |z: f64| [z, pencil.radius_squared(z).max(0.0).sqrt()];
    let mut chain = Vec::new();
    // Within a ball a straight neck ends at the centre; where the contact circle lies behind the centre the beam goes on to it.
    if z1 > 0.0 {
        chain.push([0.0, on(z1)[1]]);
    }
    let mut stops = vec![z1, z2];
    stops.extend([0.0, pencil.length].into_iter().filter(|z| *z > z1 && *z < z2));
    stops.sort_by(f64::total_cmp);
    let mut worst = 0.0_f64;
    for piece in stops.windows(2) {
        chain.push(on(piece[0]));
        worst = worst.max(bisect(pencil, [on(piece[0]), on(piece[1])], tolerance, 0, &mut chain));
    }
    chain.push(on(z2));
    if z2 < pencil.length {
        chain.push([pencil.length, on(z2)[1]]);
    }
    (Shape::Chain(chain), worst)
}

/// Adds what is needed between two points of the meridian; gives the error that is left.
fn bisect(pencil: &Pencil, ends: [[f64; 2]; 2], tolerance: f64, depth: usize, chain: &mut Vec<[f64; 2]>) -> f64 {
    let left = error(pencil, ends, [ends[0][0], ends[1][0]]);
    if left <= tolerance || depth == DEPTH {
        return left;
    }
    let slope = (ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0]);
    let at = match extreme(pencil, slope) {
        z if z > ends[0][0] && z < ends[1][0] => z,
        _ => 0.5 * (ends[0][0] + ends[1][0]),
    };
    let middle = [at, pencil.radius_squared(at).max(0.0).sqrt()];
    let first = bisect(pencil, [ends[0], middle], tolerance, depth + 1, chain);
    chain.push(middle);
    first.max(bisect(pencil, [middle, ends[1]], tolerance, depth + 1, chain))
}

/// Greatest difference between a beam's radius and that of a frustum, given by two points of its meridian, over a range of the axis.
fn error(pencil: &Pencil, [a, b]: [[f64; 2]; 2], range: [f64; 2]) -> f64 {
    let slope = (b[1] - a[1]) / (b[0] - a[0]);
    let at = |z: f64| (pencil.radius_squared(z).max(0.0).sqrt() - (a[1] + slope * (z - a[0]))).abs();
    let z = extreme(pencil, slope);
    let inside = (z > range[0] && z < range[1]).then_some(z);
    inside.into_iter().chain(range).map(at).fold(0.0, f64::max)
}

/// Where the meridian ρ² = A z² + 2 H z + C has a slope m, if it has. With u = A z + H, u² = m² (A C − H²) / (A − m²), and u has the
/// sign of m.
fn extreme(pencil: &Pencil, m: f64) -> f64 {
    let [a, b, c] = pencil.meridian(0);
    let (h, m2) = (0.5 * b, m * m);
    if a.abs() < 1e-12 {
        return (h * h - m2 * c) / (2.0 * m2 * h);
    }
    let u = (m2 * (a * c - h * h) / (a - m2)).sqrt().copysign(m);
    if m == 0.0 { -h / a } else { (u - h) / a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Beam, Fillet, Graph, HubBall, Profile};
    use geometry::math::Vec3;

    /// Beams of all kinds: length, radii of the balls (mm), profile.
    const CASES: [(f64, [f64; 2], Profile); 6] = [
        (10.0, [1.0, 1.0], Profile::Mid(0.4)),
        (10.0, [1.0, 2.0], Profile::Mid(0.7)),
        (10.0, [2.0, 0.5], Profile::Cone),
        (6.0, [1.0, 1.0], Profile::Mid(1.4)),
        (4.0, [1.0, 1.3], Profile::Waist(0.3)),
        (5.0, [1.5, 0.5], Profile::Lambda(0.9)),
    ];

    fn pair(length: f64, radii: [f64; 2], profile: Profile) -> Quadors {
        let direction: Vec3 = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
        let hubs = vec![
            HubBall { center: [0.5, -1.0, 2.0], radius: radii[0] },
            HubBall { center: add([0.5, -1.0, 2.0], scale(direction, length)), radius: radii[1] },
        ];
        Quadors::new(&Graph { hubs, beams: vec![Beam { ends: [0, 1], profile }] }, Fillet::None).expect("valid")
    }

    /// Radius of the union of frusta and balls at a position on the axis of a pair.
    fn radius(of: &Frusta, z: f64) -> f64 {
        let nodes = &of.lattice.nodes;
        let axis: Vec3 = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
        let place = |n: u32| geometry::math::dot(sub(nodes[n as usize], nodes[0]), axis);
        let ball = |n: u32, r: f64| (r * r - (z - place(n)).powi(2)).max(0.0).sqrt();
        let mut most = of.lattice.balls.iter().map(|(n, r)| ball(*n, *r)).fold(0.0, f64::max);
        for b in &of.lattice.beams {
            let [p, q] = b.ends.map(place);
            let t = (z - p) / (q - p);
            if (0.0..=1.0).contains(&t) {
                most = most.max(b.radii[0] + t * (b.radii[1] - b.radii[0]));
            }
            for k in 0..2 {
                if b.caps[k] == Cap::Sphere {
                    most = most.max(ball(b.ends[k], b.radii[k]));
                }
            }
        }
        most
    }

    /// Radius of the solid at a position on the axis, by bisection of its own function.
    fn solid(of: &Quadors, z: f64) -> f64 {
        let axis: Vec3 = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
        let across: Vec3 = [3.0 / 13f64.sqrt(), -2.0 / 13f64.sqrt(), 0.0];
        let at = |r: f64| add(add(of.center(0), scale(axis, z)), scale(across, r));
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if of.value(at(middle)) < 0.0 { low = middle } else { high = middle }
        }
        low
    }

    #[test]
    fn cylinders_are_exact_and_others_are_within_the_stated_error() {
        let cylinder = pair(10.0, [1.0; 2], Profile::Cylinder).frusta(0.0);
        assert_eq!((cylinder.lattice.beams.len(), cylinder.split, cylinder.error), (1, 0, 0.0));
        assert!(cylinder.lattice.balls.is_empty());
        for (length, radii, profile) in CASES {
            let beams = pair(length, radii, profile);
            for tolerance in [0.3, 0.03, 0.003] {
                let made = beams.frusta(tolerance);
                assert!(made.error <= tolerance, "{profile:?} {}", made.error);
                let (mut worst, steps) = (0.0_f64, 2000);
                for i in 0..=steps {
                    let z = -radii[0] + (length + radii[0] + radii[1]) * f64::from(i) / f64::from(steps);
                    worst = worst.max((radius(&made, z) - solid(&beams, z)).abs());
                }
                // By sampling the greatest difference is found from below.
                assert!(worst <= made.error + 1e-9, "{profile:?} {tolerance}: {worst} > {}", made.error);
                assert!(worst >= 0.9 * made.error - 1e-9, "{profile:?} {tolerance}: {worst} < {}", made.error);
            }
        }
    }

    fn flat_ends(of: &BeamLattice) -> Vec<[bool; 2]> {
        of.beams.iter().map(|b| b.caps.map(|c| c == Cap::Butt)).collect()
    }

    #[test]
    fn chains_of_other_programs_stay() {
        let line = |radii: &[[f64; 2]], flat: bool| BeamGraph {
            nodes: (0..=radii.len()).map(|i| [5.0 * i as f64, 0.0, 0.0]).collect(),
            radii: vec![f64::NAN; radii.len() + 1],
            beams: (0..radii.len() as u32).map(|i| [i, i + 1]).collect(),
            beam_radii: radii.to_vec(),
            flat: (0..radii.len()).map(|i| [flat || i > 0, flat || i + 1 < radii.len()]).collect(),
            ..BeamGraph::default()
        };
        let chains: [&[[f64; 2]]; 4] =
            [&[[1.0, 0.4], [0.4, 1.0]], &[[1.0, 0.7], [0.7, 0.4]], &[[0.5; 2]; 3], &[[1.0, 0.4], [0.4; 2], [0.4, 1.0]]];
        for radii in chains {
            for flat in [false, true] {
                let mut graph = line(radii, flat);
                let before = graph.clone();
                assert_eq!(join_chains(&mut graph).frusta, 0, "{radii:?} {flat}");
                assert_eq!((graph.beams, graph.beam_radii), (before.beams, before.beam_radii));
            }
        }
    }

    #[test]
    fn chains_become_the_quadrics_that_they_were() {
        for (length, radii, profile) in CASES {
            let beams = pair(length, radii, profile);
            let made = beams.frusta(0.003);
            let mut graph = BeamGraph::from(&made.lattice);
            graph.flat = flat_ends(&made.lattice);
            let joined = join_chains(&mut graph);
            assert_eq!(
                (graph.nodes.len(), joined.frusta),
                (2, if made.split == 1 { made.lattice.beams.len() } else { 0 })
            );
            if made.split == 1 {
                let [r, _] = graph.beam_radii[0];
                let want = beams.pencil(0).radius_squared(0.5 * length).sqrt();
                assert!((r - want).abs() < 1e-9 && joined.beams == (0..1), "{profile:?}: {r} {want}");
            }
            // A joint that is moved is on no quadric.
            let mut moved = BeamGraph::from(&made.lattice);
            moved.flat = flat_ends(&made.lattice);
            let middle = moved.beams.len() / 2;
            if let Some(r) = moved.beam_radii.get_mut(middle).filter(|_| made.split == 1) {
                r[0] *= 1.001;
                assert!(join_chains(&mut moved).beams.is_empty());
            }
        }
    }

    #[test]
    fn hubs_larger_than_their_beams_are_balls() {
        let made = pair(10.0, [1.0; 2], Profile::Mid(0.4)).frusta(0.01);
        assert_eq!(made.lattice.balls, [(0, 1.0), (1, 1.0)]);
        assert!(made.split == 1 && made.lattice.beams.iter().all(|b| b.caps == [Cap::Butt; 2]));
        // Fourth order in the radius, second in the number: a hundredth of the error takes ten times the frusta.
        let finer = pair(10.0, [1.0; 2], Profile::Mid(0.4)).frusta(0.0001);
        let ratio = finer.lattice.beams.len() as f64 / made.lattice.beams.len() as f64;
        assert!((3.0..12.0).contains(&ratio), "{ratio}");
    }
}
