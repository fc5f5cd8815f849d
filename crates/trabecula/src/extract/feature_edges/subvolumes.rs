//! Cells that patches divide into volumes: each volume is divided into tetrahedra from a point in its kernel. A volume that is
//! not star-shaped is first divided by partitions along feature edges.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use super::fill_fitted::{Base, FittedTet};
use super::loop_patch::LoopPatch;
use crate::extract::feature_cells::{FeatureCells, middle};
use geometry::math::{Vec3, cross, dot, scale, sub, unit};

/// A point at least this deep behind all facets, in grid steps, is taken at once if that satisfies the required depth.
const DEEP: f64 = 0.1;
/// Most moves of a point to a greater depth.
const MOVES: u32 = 200;
/// With more routes along feature edges than this, volumes are not partitioned.
const MOST: usize = 8;

/// A triangle that bounds a volume, counter-clockwise seen from outside.
#[derive(Clone, Copy)]
struct Facet<'b> {
    ids: [usize; 3],
    of: FacetOrigin<'b>,
}

#[derive(Clone, Copy)]
enum FacetOrigin<'b> {
    CellFace(&'b Base),
    Patch,
    /// A partition of a volume that is not star-shaped.
    Partition,
}

/// A volume, and whether the surface is negative in it.
struct Volume<'b> {
    facets: Vec<Facet<'b>>,
    inside: bool,
}

/// An undirected edge between two points.
type UndirectedEdge = [usize; 2];

fn line(a: usize, b: usize) -> UndirectedEdge {
    [a.min(b), a.max(b)]
}

fn lines_of([a, b, c]: [usize; 3]) -> [UndirectedEdge; 3] {
    [line(a, b), line(b, c), line(c, a)]
}

/// The edges of a closed polyline.
fn around(ring: &[usize]) -> Vec<UndirectedEdge> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| line(*a, *b)).collect()
}

/// A triangle, reversed unless it is to stay.
fn turned([a, b, c]: [usize; 3], stays: bool) -> [usize; 3] {
    if stays { [a, b, c] } else { [a, c, b] }
}

impl FeatureCells<'_> {
    /// The tetrahedra of all volumes between patches; none if a volume cannot be divided into star-shaped ones. `patches` come
    /// with the numbers of their loops' points.
    pub(super) fn volumes<'b>(
        &mut self,
        cell: [usize; 3],
        bases: &'b [Base],
        patches: &[(&[usize], &LoopPatch)],
    ) -> Option<Vec<FittedTet<'b>>> {
        // Points of faces that were divided again have other values in that face.
        let is_perturbed = |b: &Base| b.divided.is_some_and(|(n, _)| self.divided_faces.numbered(n).tries > 0);
        if bases.iter().any(is_perturbed) {
            return None;
        }
        let face = |b: &'b Base| Facet { ids: turned(b.ids, b.left), of: FacetOrigin::CellFace(b) };
        let faces: Vec<Facet> = bases.iter().map(face).collect();
        let boundary_loops: Vec<UndirectedEdge> = patches.iter().flat_map(|p| around(p.0)).collect();
        let mut volumes: Vec<Volume> = Vec::with_capacity(patches.len() + 1);
        for facets in parts(&faces, &boundary_loops) {
            let inside = matches!(facets[0].of, FacetOrigin::CellFace(b) if b.inside);
            volumes.push(Volume { facets, inside });
        }
        // A closed polyline divides the boundary of the cell in two.
        if volumes.len() != patches.len() + 1 {
            return None;
        }
        let mut routes: Vec<Vec<usize>> = Vec::new();
        for (boundary_loop, patch) in patches {
            let mut ids = boundary_loop.to_vec();
            ids.extend(patch.inner.iter().map(|p| self.inner_point(cell, *p)));
            let ids_of = |route: &Vec<usize>| route.iter().map(|i| ids[*i]).collect();
            routes.extend(patch.routes.iter().map(ids_of));
            let start = line(boundary_loop[0], boundary_loop[1]);
            let meets = |v: &&mut Volume| v.facets.iter().any(|f| lines_of(f.ids).contains(&start));
            for volume in volumes.iter_mut().filter(meets) {
                let stays = volume.inside;
                let facet = |t: &[usize; 3]| Facet { ids: turned(t.map(|i| ids[i]), stays), of: FacetOrigin::Patch };
                volume.facets.extend(patch.triangles.iter().map(facet));
            }
        }
        if routes.len() > MOST {
            routes.clear();
        }
        let mut tets = Vec::with_capacity(2 * bases.len());
        for volume in volumes {
            self.divide(cell, volume, routes.clone(), &mut tets)?;
        }
        Some(tets)
    }

    /// Adds the tetrahedra of a volume, or of its parts where it is not star-shaped. `routes` are the polylines along which it
    /// may be partitioned.
    fn divide<'b>(
        &mut self,
        cell: [usize; 3],
        mut volume: Volume<'b>,
        mut routes: Vec<Vec<usize>>,
        tets: &mut Vec<FittedTet<'b>>,
    ) -> Option<()> {
        // One part after the other is cut off.
        while !self.fill_star_shaped(cell, &volume, tets) {
            let (rest, taken) = routes.iter().enumerate().find_map(|(n, route)| {
                let [one, other] = self.partitioned(cell, &volume, route)?;
                if self.fill_star_shaped(cell, &one, tets) {
                    return Some((other, n));
                }
                self.fill_star_shaped(cell, &other, tets).then_some((one, n))
            })?;
            volume = rest;
            routes.swap_remove(taken);
        }
        Some(())
    }

    /// Adds the tetrahedra of a volume; false if no point is found in its kernel.
    fn fill_star_shaped<'b>(&mut self, cell: [usize; 3], volume: &Volume<'b>, tets: &mut Vec<FittedTet<'b>>) -> bool {
        let facets = volume.facets.iter();
        let positions: Vec<[Vec3; 3]> = facets.map(|f| f.ids.map(|i| self.position_of(i))).collect();
        let step = self.grid.step;
        let Some(apex) = behind(&positions, step, self.grid.margin * step) else {
            return false;
        };
        let apex = self.inner_point(cell, apex);
        tets.extend(volume.facets.iter().map(|f| match f.of {
            FacetOrigin::CellFace(b) => FittedTet::over(b, apex),
            FacetOrigin::Patch => FittedTet::inner(f.ids, volume.inside, apex, volume.inside),
            FacetOrigin::Partition => FittedTet::inner(f.ids, volume.inside, apex, false),
        }));
        true
    }

    /// Both halves of a volume that is partitioned between a route along its patches and one along its cell faces.
    fn partitioned<'b>(&mut self, cell: [usize; 3], volume: &Volume<'b>, route: &[usize]) -> Option<[Volume<'b>; 2]> {
        let mut ring = route.to_vec();
        ring.extend(back(&volume.facets, route)?);
        let lines = around(&ring);
        let [one, other] = <[_; 2]>::try_from(parts(&volume.facets, &lines)).ok()?;
        let partition: Vec<[usize; 3]> = match ring[..] {
            [a, b, c] => vec![[a, b, c]],
            _ => {
                let positions: Vec<Vec3> = ring.iter().map(|i| self.position_of(*i)).collect();
                let apex = self.inner_point(cell, middle(&positions));
                let next = ring.iter().cycle().skip(1);
                let faces = ring.iter().zip(next);
                faces.map(|(a, b)| [apex, *a, *b]).collect()
            }
        };
        Some(
            [one, other]
                .map(|half| Volume { facets: closed(half, &partition, [ring[0], ring[1]]), inside: volume.inside }),
        )
    }
}

/// Half of a boundary, closed by a partition. `line` is one of the edges that they share, directed as in the partition.
fn closed<'b>(mut half: Vec<Facet<'b>>, partition: &[[usize; 3]], line: [usize; 2]) -> Vec<Facet<'b>> {
    let runs = |ids: [usize; 3]| (0..3).any(|k| [ids[k], ids[(k + 1) % 3]] == line);
    let stays = !half.iter().any(|f| runs(f.ids));
    half.extend(partition.iter().map(|t| Facet { ids: turned(*t, stays), of: FacetOrigin::Partition }));
    half
}

/// The parts into which some edges divide a boundary.
fn parts<'b>(facets: &[Facet<'b>], lines: &[UndirectedEdge]) -> Vec<Vec<Facet<'b>>> {
    let mut adjacent: FxHashMap<UndirectedEdge, Vec<usize>> = FxHashMap::default();
    for (i, f) in facets.iter().enumerate() {
        for l in lines_of(f.ids) {
            adjacent.entry(l).or_default().push(i);
        }
    }
    let mut all = Vec::new();
    let mut visited = vec![false; facets.len()];
    for first in 0..facets.len() {
        let (mut open, mut part) = (vec![first], Vec::new());
        while let Some(i) = open.pop() {
            if std::mem::replace(&mut visited[i], true) {
                continue;
            }
            part.push(facets[i]);
            let inner = lines_of(facets[i].ids).into_iter().filter(|l| !lines.contains(l));
            open.extend(inner.flat_map(|l| adjacent[&l].iter().copied()));
        }
        if !part.is_empty() {
            all.push(part);
        }
    }
    all
}

/// The points of the shortest route, by number of edges, from the end of a route along patches back to its start along cell
/// faces, meeting no patch or partition.
fn back(facets: &[Facet], route: &[usize]) -> Option<Vec<usize>> {
    let (start, end) = (route[route.len() - 1], route[0]);
    let is_cell_face = |f: &&Facet| matches!(f.of, FacetOrigin::CellFace(_));
    let others = facets.iter().filter(|f| !is_cell_face(f));
    let taken: Vec<usize> = others.flat_map(|f| f.ids).collect();
    let lines: Vec<UndirectedEdge> = (facets.iter().filter(is_cell_face)).flat_map(|f| lines_of(f.ids)).collect();
    let mut from: FxHashMap<usize, usize> = FxHashMap::default();
    let mut open = VecDeque::from([start]);
    while let Some(at) = open.pop_front() {
        for l in lines.iter().filter(|l| l.contains(&at)) {
            let next = l[usize::from(l[0] == at)];
            if next == end && at != start {
                let mut ring = vec![at];
                while let Some(before) = from.get(&ring[ring.len() - 1]).filter(|b| **b != start) {
                    ring.push(*before);
                }
                ring.reverse();
                return Some(ring);
            }
            if !taken.contains(&next) && !from.contains_key(&next) {
                from.insert(next, at);
                open.push_back(next);
            }
        }
    }
    None
}

/// A point deeper than `least` behind all of some triangles, counter-clockwise seen from the front.
fn behind(triangles: &[[Vec3; 3]], step: f64, least: f64) -> Option<Vec3> {
    let plane = |t: &[Vec3; 3]| (unit(cross(sub(t[1], t[0]), sub(t[2], t[0]))), t[0]);
    let planes: Vec<(Vec3, Vec3)> = triangles.iter().map(plane).collect();
    let corners: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let mut at = middle(&corners);
    let mut best = (at, f64::NEG_INFINITY);
    // Away from the nearest plane by decreasing steps: the depth below the nearest plane is a concave function.
    for moves in 1..=MOVES {
        let depths = planes.iter().map(|p| (dot(p.0, sub(p.1, at)), p.0));
        let (depth, normal) = depths.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if best.1 < depth {
            best = (at, depth);
        }
        if depth > least.max(DEEP * step) {
            break;
        }
        at = sub(at, scale(normal, 0.5 * step / f64::from(moves)));
    }
    (best.1 > least).then_some(best.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The facets of a prism over a polygon in the unit square, whose ends are triangles of its corners.
    fn prism(polygon: &[[f64; 2]], ends: &[[usize; 3]]) -> (Vec<Facet<'static>>, Vec<Vec3>) {
        let n = polygon.len();
        let mut ids: Vec<[usize; 3]> = Vec::new();
        for t in ends {
            ids.push(turned(*t, false));
            ids.push(t.map(|i| i + n));
        }
        for i in 0..n {
            let next = (i + 1) % n;
            ids.push([i, next, next + n]);
            ids.push([i, next + n, i + n]);
        }
        let facets = ids.iter().map(|ids| Facet { ids: *ids, of: FacetOrigin::Patch });
        let at = |z: f64| polygon.iter().map(move |p| [p[0], p[1], z]);
        (facets.collect(), at(0.0).chain(at(1.0)).collect())
    }

    fn positions(facets: &[Facet], positions: &[Vec3]) -> Vec<[Vec3; 3]> {
        facets.iter().map(|f| f.ids.map(|i| positions[i])).collect()
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// A square with a slot that ends before its far side.
    const SLOT: [[f64; 2]; 8] =
        [[0.0, 0.0], [0.4, 0.0], [0.4, 0.8], [0.6, 0.8], [0.6, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    const SLOT_ENDS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 7], [2, 3, 7], [3, 6, 7], [3, 5, 6], [3, 4, 5]];

    #[test]
    fn a_point_behind_all_sides_is_found_where_there_is_one() {
        let (facets, at) = prism(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
        let p = behind(&positions(&facets, &at), 1.0, 1e-3).expect("a cube");
        assert!(p.iter().all(|x| (0.05..0.95).contains(x)), "{p:?}");
        let (facets, at) = prism(&SLOT, &SLOT_ENDS);
        assert_eq!(behind(&positions(&facets, &at), 1.0, 1e-3), None);
    }

    #[test]
    fn a_closed_line_divides_a_surface_in_two() {
        let (facets, at) = prism(&SLOT, &SLOT_ENDS);
        // Along the foot of the slot's left flank, through to the far side.
        let ring = [2, 10, 15, 7];
        let halves = parts(&facets, &around(&ring));
        assert_eq!(halves.len(), 2);
        assert_eq!(halves[0].len() + halves[1].len(), facets.len());
        for half in halves {
            let half = closed(half, &[[2, 10, 15], [2, 15, 7]], [2, 10]);
            let routes = |f: &Facet| [0, 1, 2].map(|k| (f.ids[k], f.ids[(k + 1) % 3]));
            let routes: Vec<(usize, usize)> = half.iter().flat_map(routes).collect();
            assert!(routes.iter().all(|(a, b)| routes.contains(&(*b, *a))));
            // The left leg is convex; the kernel of the rest is at the far right.
            assert!(behind(&positions(&half, &at), 1.0, 1e-3).is_some());
        }
        assert_eq!(parts(&facets, &[line(2, 10)]).len(), 1);
    }
}
