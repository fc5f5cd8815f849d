//! What the net on a part's surface leaves: ports that no rod reaches, and the largest opening between its rods.

use std::collections::{BTreeSet, HashMap};

use ::beams::graph::position_text;
use geometry::math::{Vec3, add, dot, norm, scale, sub};
use geometry::union_find::{find, unite};
use rayon::prelude::*;

use super::Warning;
use super::surface_net::Rods;
use crate::report::NetReport;
use crate::tiling::{FaceGrid, Tiling};

/// Steps along an edge of a triangle on which ports are found, and at which openings are looked for.
const STEPS: usize = 24;
const WIDE: usize = 12;

/// The coordinates in a tetrahedron of a point of one of its faces.
fn bary(face: [usize; 3], steps: [usize; 3]) -> [f64; 4] {
    let n = steps.iter().sum::<usize>() as f64;
    let mut out = [0.0; 4];
    face.iter().zip(steps).for_each(|(i, k)| out[*i] = k as f64 / n);
    out
}

impl NetReport {
    /// What the rods of a net cover.
    pub(super) fn new(tiling: &Tiling, rods: &Rods) -> NetReport {
        let (ports, untied, untied_at) = ports(tiling, rods);
        let (opening, opening_at) = opening(tiling, rods);
        NetReport { ports, untied, untied_at, opening, opening_at }
    }

    /// Warns of ports that no rod reaches, and of openings wider than `most` (mm).
    pub(super) fn warn(&self, most: Option<f64>, path: &str, warnings: &mut Vec<Warning>) {
        let mut say = |key: &str, message: String| warnings.push(Warning { path: format!("{path}.{key}"), message });
        if self.ports == 0 {
            say("surface", "the lattice has no ports on the surface, so the net ties nothing: take a higher fraction or another cell".into());
        }
        if let Some(at) = self.untied_at {
            say(
                "surface",
                format!(
                    "no rod of the net reaches {} of {} ports, such as that at {}: its rods follow the ports of the first cell at the mean \
                 level; let the fraction vary less, or take cells with ports in the same places",
                    self.untied,
                    self.ports,
                    position_text(at)
                ),
            );
        }
        if let Some(most) = most.filter(|most| self.opening > *most) {
            say(
                "net.opening",
                format!(
                    "the net has openings of up to {:.3} mm, at {}, wider than {most} mm: take smaller tetrahedra or thicker rods",
                    self.opening,
                    position_text(self.opening_at)
                ),
            );
        }
    }
}

/// The number of ports on the triangles of a net, of those that no rod reaches, and where one of these is.
fn ports(tiling: &Tiling, rods: &Rods) -> (usize, usize, Option<Vec3>) {
    let (net, map) = (&rods.net, &tiling.map);
    let (grid, faces) = (FaceGrid::new(STEPS), map.boundary_faces());
    let drawn: BTreeSet<[u32; 2]> = net.drawn.iter().copied().collect();
    let on_lines: BTreeSet<usize> = net.lines.iter().flat_map(along).collect();
    let solid = |i: &usize| {
        let (t, f) = faces[*i];
        tiling.solid_in(t, &grid.points.iter().map(|k| bary(f, *k)).collect::<Vec<_>>())
    };
    let solid: Vec<Vec<bool>> = net.faces.par_iter().map(solid).collect();
    // Numbers of the points that are solid; those on edges are the same for both triangles.
    let mut shared: HashMap<[(u32, usize); 2], u32> = HashMap::new();
    let (mut reached, mut places, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for (i, solid) in net.faces.iter().zip(&solid) {
        let (t, f) = faces[*i];
        let nodes = f.map(|i| map.tet(t)[i]);
        let mut number = |n: usize| {
            let k = grid.points[n];
            let mut corners: Vec<(u32, usize)> = nodes.into_iter().zip(k).filter(|c| c.1 > 0).collect();
            corners.sort_unstable();
            let rod = on_lines.contains(&n);
            let new = |reached: &mut Vec<bool>, places: &mut Vec<(usize, [f64; 4])>| {
                reached.push(false);
                places.push((t, bary(f, k)));
                places.len() as u32 - 1
            };
            let at = match corners[..] {
                [a] => *shared.entry([a, a]).or_insert_with(|| new(&mut reached, &mut places)),
                [a, b] => *shared.entry([a, b]).or_insert_with(|| new(&mut reached, &mut places)),
                _ => new(&mut reached, &mut places),
            };
            // Corners are at the ends of rods along any of their edges.
            let edge = match corners[..] {
                [a] => nodes.iter().any(|n| drawn.contains(&[a.0.min(*n), a.0.max(*n)])),
                [a, b] => drawn.contains(&[a.0, b.0]),
                _ => false,
            };
            reached[at as usize] |= rod || edge;
            at
        };
        let numbers: Vec<Option<u32>> = (0..grid.points.len()).map(|n| solid[n].then(|| number(n))).collect();
        pairs.extend(grid.edges().filter_map(|[n, m]| Some([numbers[n]?, numbers[m]?])));
    }
    let mut root: Vec<u32> = (0..places.len() as u32).collect();
    for [p, q] in pairs {
        unite(&mut root, p, q);
    }
    let mut tied = vec![false; places.len()];
    for n in 0..places.len() {
        let r = find(&mut root, n as u32) as usize;
        tied[r] |= reached[n];
    }
    let all: Vec<usize> = (0..places.len()).filter(|n| find(&mut root, *n as u32) as usize == *n).collect();
    let untied: Vec<usize> = all.iter().copied().filter(|n| !tied[*n]).collect();
    (all.len(), untied.len(), untied.first().map(|n| map.place(places[*n].0, places[*n].1)))
}

/// The points of the grid nearest to a line of a triangle.
fn along([p, q]: &[[f64; 3]; 2]) -> Vec<usize> {
    let n = STEPS as f64;
    let point = |k: usize| {
        let s = k as f64 / (2.0 * n);
        let l = [0, 1, 2].map(|i| n * (p[i] + s * (q[i] - p[i])));
        let [j, k] = [l[1].round() as usize, l[2].round() as usize];
        let j = j.min(STEPS - k.min(STEPS));
        FaceGrid::index([STEPS - j - k.min(STEPS), j, k.min(STEPS)])
    };
    (0..=2 * STEPS).map(point).collect()
}

/// The diameter of the largest disc on the triangles of a net that is free of rods, and its middle.
fn opening(tiling: &Tiling, rods: &Rods) -> (f64, Vec3) {
    let (net, map) = (&rods.net, &tiling.map);
    let (grid, faces) = (FaceGrid::new(WIDE), map.boundary_faces());
    let mut near: HashMap<u32, Vec<usize>> = HashMap::new();
    for (i, owner) in net.owners.iter().enumerate() {
        BTreeSet::from(*owner).into_iter().for_each(|n| near.entry(n).or_default().push(i));
    }
    let widest = |i: &usize| {
        let (t, f) = faces[*i];
        let mut around: BTreeSet<usize> =
            f.iter().filter_map(|c| near.get(&map.tet(t)[*c])).flatten().copied().collect();
        if around.is_empty() {
            around.extend(0..net.rods.len());
        }
        let points = grid.points.iter().map(|k| map.place(t, bary(f, *k)));
        let free = |p: Vec3| (around.iter().map(|i| rods.distance(*i, p)).fold(f64::INFINITY, f64::min), p);
        points.map(free).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, [0.0; 3]))
    };
    let all: Vec<(f64, Vec3)> = net.faces.par_iter().map(widest).collect();
    let (free, at) = all.into_iter().fold((0.0, [0.0; 3]), |a, b| if b.0 > a.0 { b } else { a });
    (2.0 * free, at)
}

impl Rods {
    /// The distance (mm) of a point from the surface of a rod, to first order in its taper; negative inside.
    fn distance(&self, rod: usize, p: Vec3) -> f64 {
        let ends = self.net.rods[rod].map(|n| n as usize);
        let [a, b] = ends.map(|n| self.net.nodes[n]);
        let axis = sub(b, a);
        let s = (dot(sub(p, a), axis) / dot(axis, axis).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let radius = self.radii[ends[0]] + s * (self.radii[ends[1]] - self.radii[ends[0]]);
        norm(sub(p, add(a, scale(axis, s)))) - radius
    }
}
