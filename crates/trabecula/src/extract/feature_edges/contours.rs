//! Contours: the polylines in which a surface meets a cell face.
//!
//! All ways to connect the crossings of the face's grid edges by paths over at most three corners are candidates. The set with
//! the least distance from the surface and from the points where feature edges pierce the face is taken, provided its paths
//! keep apart.

use super::{EdgeStore, SurfaceContext, VertexId, nearest};
use geometry::math::{self, Vec3, norm, scale, sub};
use geometry::mesh::exact::{drop_axis, orient2d};

/// Greatest number of corners of a contour. Few corners of meshes have more than three edges that all pass one face.
const BENDS: usize = 3;

/// A polyline in a face, from where the face's boundary enters the solid to where it leaves it, the boundary being oriented
/// counter-clockwise about the face's axis.
#[derive(Clone, Debug)]
pub(in crate::extract) struct Contour {
    pub from: VertexId,
    pub to: VertexId,
    pub via: Vec<(VertexId, Vec3)>,
}

/// A crossing on the boundary of a face.
#[derive(Clone, Copy)]
struct FaceCrossing {
    key: VertexId,
    position: Vec3,
    /// Which of the four grid edges.
    edge: usize,
    /// Whether the boundary enters the solid.
    enters: bool,
}

/// A candidate path between two crossings, and the greatest distance of the surface from the midpoints of its segments.
#[derive(Clone)]
struct CandidatePath {
    ends: [usize; 2],
    via: Vec<Vec3>,
    off: f64,
}

/// The search for the set of candidate paths nearest to the surface and to the points where its feature edges pierce the face.
struct ContourSearch<'a> {
    points: &'a [FaceCrossing],
    pierced: &'a [Vec3],
    axis: usize,
    /// Least distance between paths, mm.
    apart: f64,
    /// The best set so far, and its distance.
    best: Option<(f64, Vec<&'a CandidatePath>)>,
}

impl EdgeStore {
    /// The contours of a face that feature edges pierce or that has double crossings; none if they are those of plain cells.
    /// `adjacent` are further points where they may have corners.
    pub(super) fn contours<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        context: &SurfaceContext<P>,
        face: (usize, usize),
        pierced: &[Vec3],
        adjacent: &[Vec3],
    ) -> Option<Vec<Contour>> {
        let points = self.boundary(context, face)?;
        let all = [pierced, adjacent].concat();
        let few = [&all[..], pierced].into_iter().find(|c| c.len() <= VertexId::CORNERS);
        let corners = few.unwrap_or(&[]);
        let single = points.iter().all(|p| p.key.index() == 0) && points.len() < 4;
        if single && corners.is_empty() {
            return None;
        }
        let candidates = self.candidates(context, face, &points, corners);
        let mut search = ContourSearch {
            points: &points,
            pierced,
            axis: face.1,
            apart: context.grid.margin * context.grid.step / 4.0,
            best: None,
        };
        let mut plain: Option<(f64, Vec<&CandidatePath>)> = None;
        matchings(&points, &mut |pairs| {
            let of = |pair| candidates.iter().filter(|w| w.ends == pair).collect();
            let mut all: Vec<Vec<&CandidatePath>> = pairs.iter().map(|p| of(*p)).collect();
            // Without corners, paths between crossings that do not alternate keep apart.
            let last: Option<Vec<&CandidatePath>> = all.iter().map(|w| w.last().copied()).collect();
            let Some(last) = last else { return };
            let off = last.iter().fold(0.0f64, |m, w| m.max(w.off));
            if plain.as_ref().is_none_or(|p| off < p.0) {
                plain = Some((off, last));
            }
            for w in &mut all {
                w.sort_by(|a, b| a.off.total_cmp(&b.off));
            }
            search.add(&all, &mut Vec::new());
        });
        let (_, candidates) = search.best.or(plain)?;
        if single && candidates.iter().all(|w| w.via.is_empty()) {
            return None;
        }
        let (low, axis) = face;
        let mut vertex_at = 0;
        let mut name = |p: &Vec3| {
            vertex_at += 1;
            (VertexId::corner(low, 7 & !(1 << axis), context.surface, vertex_at - 1), *p)
        };
        let contour = |w: &CandidatePath| Contour {
            from: points[w.ends[0]].key,
            to: points[w.ends[1]].key,
            via: w.via.iter().map(&mut name).collect(),
        };
        Some(candidates.into_iter().map(contour).collect())
    }

    /// The crossings on the boundary of a face, counter-clockwise about its axis; none if an adjacent cell cannot use extra
    /// points.
    fn boundary<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        context: &SurfaceContext<P>,
        (low, axis): (usize, usize),
    ) -> Option<Vec<FaceCrossing>> {
        let (nodes, signs) = (context.nodes, context.signs);
        let at = nodes.at(low);
        if at[axis] == 0
            || (0..3).any(|a| at[a] + 2 > nodes.shape[a])
            || context.grid.is_grid_plane(axis, nodes.axes[axis][at[axis]])
        {
            return None;
        }
        let mut below = at;
        below[axis] -= 1;
        if !self.takes_extra_points(context, at) || !self.takes_extra_points(context, below) {
            return None;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (du, dv) = (nodes.stride[u], nodes.stride[v]);
        let edges = [(low, u, true), (low + du, v, true), (low + dv, u, false), (low, v, false)];
        let mut points: Vec<FaceCrossing> = Vec::with_capacity(8);
        let mut solid = signs.is_negative(context.surface, low);
        for (edge, (node, along, forward)) in edges.into_iter().enumerate() {
            let ends = [node, node + nodes.stride[along]];
            let ends = ends.map(|n| signs.is_negative(context.surface, n));
            let mut add = |key: VertexId, position: Vec3| {
                solid = !solid;
                points.push(FaceCrossing { key, position, edge, enters: solid });
            };
            if let Some(double_crossings) = self.double_crossings.get(&(context.surface, node, along)) {
                for i in if forward { [0, 1] } else { [1, 0] } {
                    add(VertexId::crossing(node, along, context.surface, i), double_crossings[i]);
                }
            } else if ends[0] != ends[1] {
                add(VertexId::new(node, &[1 << along], &[context.surface]), (context.position)(node, along)?);
            }
        }
        (!points.is_empty()).then_some(points)
    }

    /// All candidate paths. The last one between two crossings has no corner, or the least detour.
    fn candidates<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        context: &SurfaceContext<P>,
        face: (usize, usize),
        points: &[FaceCrossing],
        corners: &[Vec3],
    ) -> Vec<CandidatePath> {
        let mut candidates: Vec<CandidatePath> = Vec::new();
        let mut positions = Vec::new();
        let mut counts = Vec::new();
        for (i, from) in points.iter().enumerate().filter(|p| p.1.enters) {
            for (j, to) in points.iter().enumerate().filter(|p| !p.1.enters) {
                let mut add = |via: Vec<Vec3>| {
                    let mut at = from.position;
                    for p in via.iter().chain([&to.position]) {
                        positions.push(scale(math::add(at, *p), 0.5));
                        at = *p;
                    }
                    counts.push(via.len() + 1);
                    candidates.push(CandidatePath { ends: [i, j], via, off: 0.0 });
                };
                orders(corners, &mut Vec::new(), &mut add);
                if from.edge == to.edge {
                    for by in [0.25, 0.0] {
                        add(vec![context.adjacent(face, from, to, by)]);
                    }
                } else {
                    add(Vec::new());
                }
            }
        }
        let mut off = vec![0.0; positions.len()];
        context.field.values(&positions, &mut off);
        let mut rest = &off[..];
        for (w, count) in candidates.iter_mut().zip(counts) {
            let (own, others) = rest.split_at(count);
            w.off = own.iter().fold(0.0, |m, d| m.max(d.abs()));
            rest = others;
        }
        candidates
    }
}

impl<P: Fn(usize, usize) -> Option<Vec3>> SurfaceContext<'_, P> {
    /// A point in a face at the middle of two crossings of one grid edge, at a distance of `share` of theirs from it.
    fn adjacent(&self, face: (usize, usize), from: &FaceCrossing, to: &FaceCrossing, share: f64) -> Vec3 {
        let along = sub(to.position, from.position);
        let distance = along.iter().map(|x| x.abs()).fold(0.0, f64::max);
        let mut p = scale(math::add(from.position, to.position), 0.5);
        let (u, v) = ((face.1 + 1) % 3, (face.1 + 2) % 3);
        let (across, sign) = [(v, 1.0), (u, -1.0), (v, -1.0), (u, 1.0)][from.edge];
        p[across] += sign * share * distance;
        self.inside(face, p)
    }
}

/// Calls `found` with every ordered selection of at most `BENDS` corners.
fn orders(corners: &[Vec3], taken: &mut Vec<Vec3>, found: &mut impl FnMut(Vec<Vec3>)) {
    if taken.len() == BENDS {
        return;
    }
    for p in corners {
        if !taken.contains(p) {
            taken.push(*p);
            found(taken.clone());
            orders(corners, taken, found);
            taken.pop();
        }
    }
}

/// Calls `found` with every matching of entering to leaving crossings whose straight paths do not intersect.
fn matchings(points: &[FaceCrossing], found: &mut impl FnMut(&[[usize; 2]])) {
    fn rest(
        points: &[FaceCrossing],
        free: &[usize],
        pairs: &mut Vec<[usize; 2]>,
        found: &mut impl FnMut(&[[usize; 2]]),
        later: &mut Vec<Vec<usize>>,
    ) {
        let Some((&first, others)) = free.split_first() else {
            match later.pop() {
                Some(next) => {
                    rest(points, &next, pairs, found, later);
                    later.push(next);
                }
                None => found(pairs),
            }
            return;
        };
        for (n, &other) in others.iter().enumerate().step_by(2) {
            pairs.push(if points[first].enters { [first, other] } else { [other, first] });
            later.push(others[n + 1..].to_vec());
            rest(points, &others[..n], pairs, found, later);
            later.pop();
            pairs.pop();
        }
    }
    let all: Vec<usize> = (0..points.len()).collect();
    rest(points, &all, &mut Vec::new(), found, &mut Vec::new());
}

impl<'a> ContourSearch<'a> {
    /// Adds one candidate for each remaining pair to those taken, nearest first, while the result can still be the best.
    fn add(&mut self, rest: &[Vec<&'a CandidatePath>], taken: &mut Vec<&'a CandidatePath>) {
        let Some((first, rest)) = rest.split_first() else {
            let off = taken.iter().fold(self.missed(taken), |m, w| m.max(w.off));
            let better = self.best.as_ref().is_none_or(|b| off < b.0);
            if better && !self.is_crossing(taken) {
                self.best = Some((off, taken.clone()));
            }
            return;
        };
        for w in first {
            if self.best.as_ref().is_some_and(|b| w.off >= b.0) {
                break;
            }
            let corners: usize = taken.iter().map(|t| t.via.len()).sum();
            let used = |v: &Vec3| taken.iter().any(|t| t.via.contains(v));
            if corners + w.via.len() <= VertexId::CORNERS && !w.via.iter().any(used) {
                taken.push(w);
                self.add(rest, taken);
                taken.pop();
            }
        }
    }

    fn path(&self, w: &CandidatePath) -> Vec<Vec3> {
        let [from, to] = w.ends.map(|e| self.points[e].position);
        let mut path = vec![from];
        path.extend(&w.via);
        path.push(to);
        path
    }

    /// Greatest distance from a set of paths of the points where feature edges pierce the face.
    fn missed(&self, candidates: &[&CandidatePath]) -> f64 {
        let paths: Vec<Vec<Vec3>> = candidates.iter().map(|w| self.path(w)).collect();
        let from = |p: &Vec3| {
            let straights = paths.iter().flat_map(|path| path.windows(2));
            let away = straights.map(|s| norm(sub(*p, nearest([s[0], s[1]], *p))));
            away.fold(f64::INFINITY, f64::min)
        };
        self.pierced.iter().map(from).fold(0.0, f64::max)
    }

    /// Whether paths come too near to each other, or one to itself.
    fn is_crossing(&self, candidates: &[&CandidatePath]) -> bool {
        let flat = |p: Vec3| drop_axis(p, self.axis);
        let near = |p: [f64; 2], s: &[[f64; 2]]| {
            let [p, q, r] = [p, s[0], s[1]].map(|p| [p[0], p[1], 0.0]);
            norm(sub(p, nearest([q, r], p))) < self.apart
        };
        let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            let face = |p: &[[f64; 2]], q: [f64; 2]| orient2d(p[0], p[1], q);
            let cross = face(a, b[0]) * face(a, b[1]) <= 0 && face(b, a[0]) * face(b, a[1]) <= 0;
            cross || a.iter().any(|p| near(*p, b)) || b.iter().any(|p| near(*p, a))
        };
        let paths: Vec<Vec<[f64; 2]>> =
            candidates.iter().map(|w| self.path(w).into_iter().map(flat).collect()).collect();
        // A path may intersect itself, or turn back.
        let bent = |p: &Vec<[f64; 2]>| {
            let turns = p.windows(3).any(|w| near(w[0], &w[1..]) || near(w[2], &w[..2]));
            let of = |i: usize| &p[i..i + 2];
            turns || (3..p.len()).any(|j| (0..j - 2).any(|i| meet(of(i), of(j - 1))))
        };
        paths.iter().any(bent)
            || paths.iter().enumerate().any(|(i, a)| {
                let meets = |s: &[[f64; 2]]| {
                    let others = paths[..i].iter().flat_map(|b| b.windows(2));
                    others.into_iter().any(|t| meet(s, t))
                };
                a.windows(2).any(meets)
            })
    }
}
