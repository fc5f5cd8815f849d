//! The lines of a line drawing, in space: contours, along which a smooth surface turns away from the eye; edges; the outline of a section.
//!
//! Contours are the zeros of n · (eye − p) for normals n that are interpolated over triangles: smooth curves, where the edges between
//! triangles that face the eye and others zigzag. A. Hertzmann and D. Zorin, Illustrating smooth surfaces, SIGGRAPH 2000.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::shading_normals::{ShadingNormals, area};
use super::{Camera, SectionPlane};
use crate::math::{Vec3, add, dot, norm, scale, sub, unit};
use crate::surface_mesh::SurfaceMesh;
use crate::union_find::{find, singles, unite};

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LineKind {
    Contour,
    Edge,
    Section,
}

/// A point of a line, and a step from it off the surface, out of the way of the triangles around it; none where the line is an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinePoint {
    pub at: Vec3,
    pub lift: Vec3,
}

/// A polyline; a closed one ends where it begins.
#[derive(Clone, Debug)]
pub(super) struct SpaceLine {
    pub kind: LineKind,
    pub points: Vec<LinePoint>,
}

/// Share of the longest side of a triangle by which a contour is lifted: the sagitta of the side over a radius of 1.25 sides.
const LIFT: f64 = 0.1;
/// Altitude over longest side below which a triangle is thin.
const THIN: f64 = 0.06;

/// The two vertices of an edge, ascending.
type EdgeKey = (u32, u32);

fn key(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

/// All lines of a surface as a camera sees it; of a section only what is kept. Edges that hang together without a loop and are shorter than
/// `least` (mm) in all are left out: a coarse mesh has such where the surface bends strongly.
pub(super) fn space_lines(
    surface: &SurfaceMesh,
    normals: Option<&[[f32; 3]]>,
    camera: &Camera,
    section: Option<&SectionPlane>,
    least: f64,
) -> Vec<SpaceLine> {
    let normals = ShadingNormals::of(surface, normals);
    let edges = without_crumbs(surface, sharp_edges(surface, &normals), least);
    let mut lines = contours(surface, &normals, camera, &edges.iter().copied().collect());
    lines.extend(edge_lines(surface, &edges));
    if let Some(section) = section {
        lines = lines.iter().flat_map(|line| kept(line, section)).collect();
        lines.extend(outlines(surface, section));
    }
    lines
}

/// Edges where faces meet at more than 35°, where the surface ends, and between the lattice and cuts; ascending. Where normals are given they
/// say how faces meet: a beam of few facets has no edges along itself. The normal of a thin
/// triangle says little: of edges that hang together, one has to lie between triangles that are not thin, and
/// others are left out where they lead nowhere.
fn sharp_edges(surface: &SurfaceMesh, normals: &ShadingNormals) -> Vec<EdgeKey> {
    let triangles = &surface.mesh.triangles;
    let mut all: Vec<(EdgeKey, u32)> = triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, t)| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| (key(a, b), i as u32)))
        .collect();
    all.par_sort_unstable();
    let cut = |i: u32| surface.cut.get(i as usize).copied().unwrap_or(false);
    let thin = |i: u32| norm(area(surface, i as usize)) < THIN * longest(surface, i as usize).powi(2);
    // Whether the edge is sharp, and whether that is certain.
    let sharp = |group: &[(EdgeKey, u32)]| match group {
        [(edge, s), (_, t)] if cut(*s) == cut(*t) => {
            if let (Some(m), Some(n)) = (along(surface, normals, *edge, *s), along(surface, normals, *edge, *t)) {
                return (dot(m, n) < ShadingNormals::EDGE * norm(m) * norm(n)).then_some(true);
            }
            let (m, n) = (area(surface, *s as usize), area(surface, *t as usize));
            let turned = dot(m, n) < ShadingNormals::EDGE * norm(m) * norm(n);
            turned.then(|| !thin(*s) && !thin(*t))
        }
        _ => Some(true),
    };
    let groups = all.chunk_by(|a, b| a.0 == b.0);
    let mut found: Vec<(EdgeKey, bool)> = groups.filter_map(|g| sharp(g).map(|certain| (g[0].0, certain))).collect();
    let mut joined = singles(surface.mesh.vertices.len());
    for ((a, b), _) in &found {
        unite(&mut joined, *a, *b);
    }
    let certain: HashSet<u32> = found.iter().filter(|e| e.1).map(|((a, _), _)| find(&mut joined, *a)).collect();
    found.retain(|((a, _), _)| certain.contains(&find(&mut joined, *a)));
    without_loose_ends(found, surface.mesh.vertices.len())
}

/// The sum of the normals that are given for a triangle at the two ends of an edge; None without either.
fn along(surface: &SurfaceMesh, normals: &ShadingNormals, (a, b): EdgeKey, i: u32) -> Option<Vec3> {
    let t = surface.mesh.triangles[i as usize];
    let at = |v: u32| t.iter().position(|w| *w == v).and_then(|k| normals.given(i, k));
    Some(add(at(a)?, at(b)?))
}

/// The edges, but for those that are not certain and lead nowhere.
fn without_loose_ends(mut found: Vec<(EdgeKey, bool)>, vertices: usize) -> Vec<EdgeKey> {
    loop {
        let mut count = vec![0u32; vertices];
        found.iter().for_each(|((a, b), _)| [a, b].iter().for_each(|v| count[**v as usize] += 1));
        let before = found.len();
        found.retain(|((a, b), certain)| *certain || (count[*a as usize] > 1 && count[*b as usize] > 1));
        if found.len() == before {
            return found.into_iter().map(|e| e.0).collect();
        }
    }
}

/// The edges, but for those that hang together without a loop and are shorter than `least` (mm) in all.
fn without_crumbs(surface: &SurfaceMesh, edges: Vec<EdgeKey>, least: f64) -> Vec<EdgeKey> {
    let at = |v: u32| surface.mesh.vertices[v as usize];
    let mut joined = singles(surface.mesh.vertices.len());
    // Of what hangs together, by its lowest vertex: the length, and whether it has a loop.
    let loops: Vec<EdgeKey> = edges.iter().copied().filter(|(a, b)| !unite(&mut joined, *a, *b)).collect();
    let mut lengths: HashMap<u32, f64> = HashMap::new();
    for (a, b) in &edges {
        *lengths.entry(find(&mut joined, *a)).or_default() += norm(sub(at(*a), at(*b)));
    }
    for (a, _) in loops {
        lengths.insert(find(&mut joined, a), f64::INFINITY);
    }
    edges.into_iter().filter(|(a, _)| lengths[&find(&mut joined, *a)] >= least).collect()
}

/// The longest side of a triangle.
fn longest(surface: &SurfaceMesh, i: usize) -> f64 {
    let corners = surface.mesh.corners(i);
    (0..3).map(|k| norm(sub(corners[k], corners[(k + 1) % 3]))).fold(0.0, f64::max)
}

fn edge_lines(surface: &SurfaceMesh, edges: &[EdgeKey]) -> Vec<SpaceLine> {
    let segments: Vec<[usize; 2]> = edges.iter().map(|(a, b)| [*a as usize, *b as usize]).collect();
    let at = |v: usize| LinePoint { at: surface.mesh.vertices[v], lift: [0.0; 3] };
    let to_line = |chain: Vec<usize>| SpaceLine { kind: LineKind::Edge, points: chain.into_iter().map(at).collect() };
    chains(&segments, surface.mesh.vertices.len()).into_iter().map(to_line).collect()
}

/// Where triangles cross a level: a point on each crossed edge, shared by the triangles of the edge unless it is sharp.
#[derive(Default)]
struct Crossings {
    ids: HashMap<(EdgeKey, u32), usize>,
    points: Vec<LinePoint>,
    segments: Vec<[usize; 2]>,
}

impl Crossings {
    /// Adds the crossing of a triangle, if its corners' values differ in sign; `own` tells the edges that it shares with no other.
    fn add(
        &mut self,
        t: [u32; 3],
        g: [f64; 3],
        i: u32,
        own: impl Fn(EdgeKey) -> bool,
        point: impl Fn(usize, usize, f64) -> LinePoint,
    ) {
        let mut ends = [0, 1, 2].into_iter().filter_map(|k| {
            let (mut a, mut b) = (k, (k + 1) % 3);
            if (g[a] > 0.0) == (g[b] > 0.0) {
                return None;
            }
            // The same arithmetic from both sides of an edge.
            if t[a] > t[b] {
                std::mem::swap(&mut a, &mut b);
            }
            let edge = key(t[a], t[b]);
            let name = (edge, if own(edge) { i } else { u32::MAX });
            let points = &mut self.points;
            Some(*self.ids.entry(name).or_insert_with(|| {
                points.push(point(a, b, g[a] / (g[a] - g[b])));
                points.len() - 1
            }))
        });
        if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
            self.segments.push([a, b]);
        }
    }

    fn lines(self, kind: LineKind) -> impl Iterator<Item = SpaceLine> {
        let points = self.points;
        chains(&self.segments, points.len())
            .into_iter()
            .map(move |chain| SpaceLine { kind, points: chain.into_iter().map(|i| points[i]).collect() })
    }
}

fn contours(
    surface: &SurfaceMesh,
    normals: &ShadingNormals,
    camera: &Camera,
    sharp: &HashSet<EdgeKey>,
) -> Vec<SpaceLine> {
    let mesh = &surface.mesh;
    let on_edge: HashSet<u32> = sharp.iter().flat_map(|(a, b)| [*a, *b]).collect();
    let mut found = Crossings::default();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let flat = area(surface, i);
        if norm(flat) == 0.0 {
            continue;
        }
        let flat = unit(flat);
        let corners = mesh.corners(i);
        let n: [Vec3; 3] = core::array::from_fn(|k| match t[k] {
            v if on_edge.contains(&v) => normals.at_corner(surface, i as u32, k, flat),
            _ => normals.at_vertex(surface, i as u32, k),
        });
        let g: [f64; 3] = core::array::from_fn(|k| dot(n[k], camera.to_eye(corners[k])));
        let long = longest(surface, i);
        let between = |a: Vec3, b: Vec3, s: f64| add(a, scale(sub(b, a), s));
        found.add(
            *t,
            g,
            i as u32,
            |edge| sharp.contains(&edge),
            |a, b, s| LinePoint {
                at: between(corners[a], corners[b], s),
                lift: scale(unit(between(n[a], n[b], s)), LIFT * long),
            },
        );
    }
    found.lines(LineKind::Contour).collect()
}

fn outlines(surface: &SurfaceMesh, section: &SectionPlane) -> Vec<SpaceLine> {
    let mesh = &surface.mesh;
    let mut found = Crossings::default();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(i);
        let heights = corners.map(|p| section.height(p));
        found.add(
            *t,
            heights,
            i as u32,
            |_| false,
            |a, b, s| LinePoint { at: add(corners[a], scale(sub(corners[b], corners[a]), s)), lift: [0.0; 3] },
        );
    }
    found.lines(LineKind::Section).collect()
}

/// The parts of a line that a section keeps.
fn kept(line: &SpaceLine, section: &SectionPlane) -> Vec<SpaceLine> {
    let mut parts = vec![Vec::new()];
    for (i, q) in line.points.iter().enumerate() {
        let to = section.height(q.at);
        if let Some(p) = i.checked_sub(1).map(|i| line.points[i]) {
            let from = section.height(p.at);
            if (from > 0.0) != (to > 0.0) {
                let at = add(p.at, scale(sub(q.at, p.at), from / (from - to)));
                if to > 0.0 {
                    parts[0].push(LinePoint { at, ..p });
                    parts.insert(0, Vec::new());
                } else {
                    parts[0].push(LinePoint { at, ..*q });
                }
            }
        }
        if to <= 0.0 {
            parts[0].push(*q);
        }
    }
    let whole = parts.into_iter().rev().filter(|points| points.len() > 1);
    whole.map(|points| SpaceLine { kind: line.kind, points }).collect()
}

/// Segments between numbered points, joined to polylines that end where not just two segments meet.
fn chains(segments: &[[usize; 2]], count: usize) -> Vec<Vec<usize>> {
    let mut first = vec![0usize; count + 1];
    segments.iter().flatten().for_each(|v| first[v + 1] += 1);
    (0..count).for_each(|v| first[v + 1] += first[v]);
    let mut next = first.clone();
    let mut around = vec![0usize; 2 * segments.len()];
    for (i, ends) in segments.iter().enumerate() {
        for v in ends {
            around[next[*v]] = i;
            next[*v] += 1;
        }
    }
    let of = |v: usize| &around[first[v]..first[v + 1]];
    let mut used = vec![false; segments.len()];
    let mut made = Vec::new();
    let mut walk = |start: usize, used: &mut Vec<bool>| {
        let Some(mut along) = of(start).iter().copied().find(|s| !used[*s]) else {
            return false;
        };
        let mut chain = vec![start];
        let mut at = start;
        loop {
            used[along] = true;
            let [a, b] = segments[along];
            at = if a == at { b } else { a };
            chain.push(at);
            match of(at) {
                [s, t] if at != start && !(used[*s] && used[*t]) => along = if used[*s] { *t } else { *s },
                _ => break,
            }
        }
        made.push(chain);
        true
    };
    for v in (0..count).filter(|v| of(*v).len() != 2) {
        while walk(v, &mut used) {}
    }
    for v in 0..count {
        while walk(v, &mut used) {}
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_joined_up_to_their_ends() {
        // A loop of three, a path of two that starts at it, and a path of its own.
        let segments = [[0, 1], [1, 2], [2, 0], [2, 3], [3, 4], [6, 5]];
        let mut found = chains(&segments, 7);
        found.sort();
        assert_eq!(found, [vec![2, 1, 0, 2], vec![2, 3, 4], vec![5, 6]]);
        assert!(chains(&[], 0).is_empty());
    }
}
