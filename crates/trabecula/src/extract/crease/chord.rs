//! The lines in which a face meets the side of a cell.

use super::{Edges, Key, Seen, nearest};
use geometry::math::{self, Vec3, norm, scale, sub};
use geometry::mesh::exact::{drop_axis, orient2d};

/// Most corners of a chord: few corners of meshes have more than three edges that all run through one side.
const BENDS: usize = 3;

/// A line in a side, from where the side's boundary enters the solid to where it leaves it: the boundary counter-clockwise
/// about the side's axis; over some corners.
#[derive(Clone, Debug)]
pub(in crate::extract) struct Chord {
    pub from: Key,
    pub to: Key,
    pub via: Vec<(Key, Vec3)>,
}

/// A point on the boundary of a side.
#[derive(Clone, Copy)]
struct Point {
    key: Key,
    place: Vec3,
    /// Which of the four grid edges.
    edge: usize,
    /// Whether the boundary enters the solid.
    enters: bool,
}

/// A chord between two points of a side, and how far it is from the face in the middle of its straight pieces.
#[derive(Clone)]
struct Way {
    ends: [usize; 2],
    via: Vec<Vec3>,
    off: f64,
}

/// The chords of a side that are looked for: those nearest to the face, and to the points in which its edges pierce the side.
struct Choice<'a> {
    points: &'a [Point],
    pierced: &'a [Vec3],
    axis: usize,
    /// How near chords may come to each other.
    apart: f64,
    /// The best so far, and how far off they are.
    best: Option<(f64, Vec<&'a Way>)>,
}

impl Edges {
    /// The chords of a side that edges of the face pierce, or with grid edges that are crossed twice; none if they are no
    /// other than those of plain cells. `beside`: where they may have corners as well.
    pub(super) fn chords<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        side: (usize, usize),
        pierced: &[Vec3],
        beside: &[Vec3],
    ) -> Option<Vec<Chord>> {
        let points = self.boundary(seen, side)?;
        let all = [pierced, beside].concat();
        let corners = [&all[..], pierced];
        let few = corners.into_iter().find(|c| c.len() <= Key::CORNERS);
        let ways = self.ways(seen, side, &points, few.unwrap_or(&[]));
        let mut choice = Choice {
            points: &points,
            pierced,
            axis: side.1,
            apart: seen.grid.margin * seen.grid.step / 4.0,
            best: None,
        };
        let mut plain: Option<(f64, Vec<&Way>)> = None;
        matchings(&points, &mut |pairs| {
            let of = |pair| ways.iter().filter(|w| w.ends == pair).collect();
            let mut all: Vec<Vec<&Way>> = pairs.iter().map(|p| of(*p)).collect();
            // Without corners, chords of points that do not alternate keep apart.
            let last: Option<Vec<&Way>> = all.iter().map(|w| w.last().copied()).collect();
            let Some(last) = last else { return };
            let off = last.iter().fold(0.0f64, |m, w| m.max(w.off));
            if plain.as_ref().is_none_or(|p| off < p.0) {
                plain = Some((off, last));
            }
            for w in &mut all {
                w.sort_by(|a, b| a.off.total_cmp(&b.off));
            }
            choice.add(&all, &mut Vec::new());
        });
        let (_, ways) = choice.best.or(plain)?;
        let single = points.iter().all(|p| p.key.index() == 0);
        if single && points.len() < 4 && ways.iter().all(|w| w.via.is_empty()) {
            return None;
        }
        let (low, axis) = side;
        let mut named = 0;
        let mut name = |p: &Vec3| {
            named += 1;
            (Key::corner(low, 7 & !(1 << axis), seen.face, named - 1), *p)
        };
        let chord = |w: &Way| Chord {
            from: points[w.ends[0]].key,
            to: points[w.ends[1]].key,
            via: w.via.iter().map(&mut name).collect(),
        };
        Some(ways.into_iter().map(chord).collect())
    }

    /// The points of the boundary of a side, counter-clockwise about its axis; none if cells beside it cannot follow.
    fn boundary<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        (low, axis): (usize, usize),
    ) -> Option<Vec<Point>> {
        let (nodes, signs) = (seen.nodes, seen.signs);
        let at = nodes.at(low);
        if at[axis] == 0
            || (0..3).any(|a| at[a] + 2 > nodes.shape[a])
            || seen.grid.is_laid(axis, nodes.axes[axis][at[axis]])
        {
            return None;
        }
        let mut below = at;
        below[axis] -= 1;
        if !self.joins(seen, at) || !self.joins(seen, below) {
            return None;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (du, dv) = (nodes.stride[u], nodes.stride[v]);
        let edges = [(low, u, true), (low + du, v, true), (low + dv, u, false), (low, v, false)];
        let mut points: Vec<Point> = Vec::with_capacity(8);
        let mut solid = signs.is_negative(seen.face, low);
        for (edge, (node, along, forward)) in edges.into_iter().enumerate() {
            let ends = [node, node + nodes.stride[along]];
            let ends = ends.map(|n| signs.is_negative(seen.face, n));
            let mut add = |key: Key, place: Vec3| {
                solid = !solid;
                points.push(Point { key, place, edge, enters: solid });
            };
            if let Some(twice) = self.twice.get(&(seen.face, node, along)) {
                for i in if forward { [0, 1] } else { [1, 0] } {
                    add(Key::crossing(node, along, seen.face, i), twice[i]);
                }
            } else if ends[0] != ends[1] {
                add(Key::new(node, &[1 << along], &[seen.face]), (seen.place)(node, along)?);
            }
        }
        (!points.is_empty()).then_some(points)
    }

    /// All chords that there may be; the last one between two points is the one without a corner, or with the least.
    fn ways<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        side: (usize, usize),
        points: &[Point],
        corners: &[Vec3],
    ) -> Vec<Way> {
        let mut ways: Vec<Way> = Vec::new();
        let mut places = Vec::new();
        let mut counts = Vec::new();
        for (i, from) in points.iter().enumerate().filter(|p| p.1.enters) {
            for (j, to) in points.iter().enumerate().filter(|p| !p.1.enters) {
                let mut add = |via: Vec<Vec3>| {
                    let mut at = from.place;
                    for p in via.iter().chain([&to.place]) {
                        places.push(scale(math::add(at, *p), 0.5));
                        at = *p;
                    }
                    counts.push(via.len() + 1);
                    ways.push(Way { ends: [i, j], via, off: 0.0 });
                };
                orders(corners, &mut Vec::new(), &mut add);
                if from.edge == to.edge {
                    for by in [0.25, 0.0] {
                        add(vec![seen.beside(side, from, to, by)]);
                    }
                } else {
                    add(Vec::new());
                }
            }
        }
        let mut off = vec![0.0; places.len()];
        seen.field.values(&places, &mut off);
        let mut rest = &off[..];
        for (w, count) in ways.iter_mut().zip(counts) {
            let (own, others) = rest.split_at(count);
            w.off = own.iter().fold(0.0, |m, d| m.max(d.abs()));
            rest = others;
        }
        ways
    }
}

impl<P: Fn(usize, usize) -> Option<Vec3>> Seen<'_, P> {
    /// A point within a side, beside the middle of two points of one of its edges: as far from it as a share of their
    /// distance.
    fn beside(&self, side: (usize, usize), from: &Point, to: &Point, share: f64) -> Vec3 {
        let along = sub(to.place, from.place);
        let distance = along.iter().map(|x| x.abs()).fold(0.0, f64::max);
        let mut p = scale(math::add(from.place, to.place), 0.5);
        let (u, v) = ((side.1 + 1) % 3, (side.1 + 2) % 3);
        let (across, way) = [(v, 1.0), (u, -1.0), (v, -1.0), (u, 1.0)][from.edge];
        p[across] += way * share * distance;
        self.inside(side, p)
    }
}

/// Calls `found` with some of the corners of a side in every order.
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

/// Calls `found` with every way to join the points that enter to those that leave so that straight chords do not cross.
fn matchings(points: &[Point], found: &mut impl FnMut(&[[usize; 2]])) {
    fn rest(
        points: &[Point],
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

impl<'a> Choice<'a> {
    /// Adds a way of each of the rest to those taken, nearest first, while they may be better than the best.
    fn add(&mut self, rest: &[Vec<&'a Way>], taken: &mut Vec<&'a Way>) {
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
            if corners + w.via.len() <= Key::CORNERS && !w.via.iter().any(used) {
                taken.push(w);
                self.add(rest, taken);
                taken.pop();
            }
        }
    }

    fn path(&self, w: &Way) -> Vec<Vec3> {
        let [from, to] = w.ends.map(|e| self.points[e].place);
        let mut path = vec![from];
        path.extend(&w.via);
        path.push(to);
        path
    }

    /// How far the farthest point in which an edge pierces the side is from some chords.
    fn missed(&self, ways: &[&Way]) -> f64 {
        let paths: Vec<Vec<Vec3>> = ways.iter().map(|w| self.path(w)).collect();
        let from = |p: &Vec3| {
            let pieces = paths.iter().flat_map(|path| path.windows(2));
            let away = pieces.map(|s| norm(sub(*p, nearest([s[0], s[1]], *p))));
            away.fold(f64::INFINITY, f64::min)
        };
        self.pierced.iter().map(from).fold(0.0, f64::max)
    }

    /// Whether chords come too near to each other, or one to itself.
    fn is_crossing(&self, ways: &[&Way]) -> bool {
        let flat = |p: Vec3| drop_axis(p, self.axis);
        let near = |p: [f64; 2], s: &[[f64; 2]]| {
            let [p, q, r] = [p, s[0], s[1]].map(|p| [p[0], p[1], 0.0]);
            norm(sub(p, nearest([q, r], p))) < self.apart
        };
        let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            let side = |p: &[[f64; 2]], q: [f64; 2]| orient2d(p[0], p[1], q);
            let cross = side(a, b[0]) * side(a, b[1]) <= 0 && side(b, a[0]) * side(b, a[1]) <= 0;
            cross || a.iter().any(|p| near(*p, b)) || b.iter().any(|p| near(*p, a))
        };
        let paths: Vec<Vec<[f64; 2]>> = ways.iter().map(|w| self.path(w).into_iter().map(flat).collect()).collect();
        // A path may cross itself, or turn back.
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
