//! The lines in which a face meets the side of a cell.

use super::{Edges, Key, Seen, nearest};
use crate::math::{self, Vec3, norm, scale, sub};
use crate::mesh::exact::{drop_axis, orient2d};

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

impl Edges {
    /// The chords of a side that edges of the face pierce, or with grid edges that are crossed twice; none if they are no
    /// other than those of plain cells.
    pub(super) fn chords<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        side: (usize, usize),
        pierced: &[Vec3],
    ) -> Option<Vec<Chord>> {
        let points = self.boundary(seen, side)?;
        let ways = self.ways(seen, side, &points, pierced);
        let mut best: Option<(f64, Vec<Way>)> = None;
        matchings(&points, &mut |pairs| {
            let mut taken: Vec<Vec3> = Vec::new();
            let mut found: Vec<Way> = Vec::new();
            for pair in pairs {
                let of = ways.iter().filter(|w| w.ends == *pair);
                let free = of.filter(|w| !w.via.iter().any(|v| taken.contains(v)));
                let Some(way) = free.min_by(|a, b| a.off.total_cmp(&b.off)) else {
                    return;
                };
                taken.extend(&way.via);
                found.push(way.clone());
            }
            let apart = seen.grid.margin * seen.grid.step / 4.0;
            let corners: usize = found.iter().map(|w| w.via.len()).sum();
            if corners > Key::CORNERS || crossing(&points, &found, side.1, apart) {
                // Without corners, chords of points that do not alternate keep apart.
                for w in &mut found {
                    let plain = ways.iter().rfind(|v| v.ends == w.ends);
                    *w = plain.unwrap_or(w).clone();
                }
            }
            let off = found.iter().fold(0.0f64, |m, w| m.max(w.off));
            if best.as_ref().is_none_or(|b| off < b.0) {
                best = Some((off, found));
            }
        });
        let (_, ways) = best?;
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
        Some(ways.iter().map(chord).collect())
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
        let edges = [
            (low, u, true),
            (low + du, v, true),
            (low + dv, u, false),
            (low, v, false),
        ];
        let mut points: Vec<Point> = Vec::with_capacity(8);
        let mut solid = signs.is_negative(seen.face, low);
        for (edge, (node, along, forward)) in edges.into_iter().enumerate() {
            let ends = [node, node + nodes.stride[along]];
            let ends = ends.map(|n| signs.is_negative(seen.face, n));
            let mut add = |key: Key, place: Vec3| {
                solid = !solid;
                points.push(Point {
                    key,
                    place,
                    edge,
                    enters: solid,
                });
            };
            if let Some(twice) = self.twice.get(&(seen.face, node, along)) {
                for i in if forward { [0, 1] } else { [1, 0] } {
                    add(Key::crossing(node, along, seen.face, i), twice[i]);
                }
            } else if ends[0] != ends[1] {
                add(
                    Key::new(node, &[1 << along], &[seen.face]),
                    (seen.place)(node, along)?,
                );
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
        pierced: &[Vec3],
    ) -> Vec<Way> {
        let mut ways: Vec<Way> = Vec::new();
        let mut places = Vec::new();
        let mut counts = Vec::new();
        let pierced = if pierced.len() > Key::CORNERS {
            &[]
        } else {
            pierced
        };
        for (i, from) in points.iter().enumerate().filter(|p| p.1.enters) {
            for (j, to) in points.iter().enumerate().filter(|p| !p.1.enters) {
                let mut add = |via: Vec<Vec3>| {
                    let mut at = from.place;
                    for p in via.iter().chain([&to.place]) {
                        places.push(scale(math::add(at, *p), 0.5));
                        at = *p;
                    }
                    counts.push(via.len() + 1);
                    ways.push(Way {
                        ends: [i, j],
                        via,
                        off: 0.0,
                    });
                };
                for (n, p) in pierced.iter().enumerate() {
                    add(vec![*p]);
                    for q in &pierced[..n] {
                        add(vec![*p, *q]);
                        add(vec![*q, *p]);
                    }
                }
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
            pairs.push(if points[first].enters {
                [first, other]
            } else {
                [other, first]
            });
            later.push(others[n + 1..].to_vec());
            rest(points, &others[..n], pairs, found, later);
            later.pop();
            pairs.pop();
        }
    }
    let all: Vec<usize> = (0..points.len()).collect();
    rest(points, &all, &mut Vec::new(), found, &mut Vec::new());
}

/// Whether chords of a side come as near to each other as points come to nodes, or one turns back.
fn crossing(points: &[Point], ways: &[Way], axis: usize, apart: f64) -> bool {
    let flat = |p: Vec3| drop_axis(p, axis);
    let pieces = |w: &Way| {
        let mut path = vec![flat(points[w.ends[0]].place)];
        path.extend(w.via.iter().map(|p| flat(*p)));
        path.push(flat(points[w.ends[1]].place));
        path
    };
    let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| {
        let side = |p: &[[f64; 2]], q: [f64; 2]| orient2d(p[0], p[1], q);
        let cross = side(a, b[0]) * side(a, b[1]) <= 0 && side(b, a[0]) * side(b, a[1]) <= 0;
        let near = |p: [f64; 2], s: &[[f64; 2]]| {
            let [p, q, r] = [p, s[0], s[1]].map(|p| [p[0], p[1], 0.0]);
            norm(sub(p, nearest([q, r], p))) < apart
        };
        cross || a.iter().any(|p| near(*p, b)) || b.iter().any(|p| near(*p, a))
    };
    let paths: Vec<_> = ways.iter().map(pieces).collect();
    // A path with two corners may cross itself, and any may turn back.
    let bent = |p: &Vec<[f64; 2]>| {
        (p.len() == 4 && meet(&p[..2], &p[2..]))
            || p.windows(3).any(|w| {
                let [u, v] = [[w[1], w[0]], [w[2], w[1]]].map(|[a, b]| [a[0] - b[0], a[1] - b[1]]);
                let (cross, dot) = (u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
                dot < 0.0 && cross.abs() < -1e-3 * dot
            })
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
