//! The graph of feature edges in a cell, which divides a patch.

use super::loop_patch::{BoundaryLoop, LoopPatch, SurfaceCell};
use crate::extract::feature_cells::middle;
use geometry::math::{Vec3, add, cross, dot, norm, sub, unit};

/// Ends of feature edges and points of the loop are identified if they are this many times as near as points may be to nodes:
/// corners are moved into their faces by as much.
const SAME: f64 = 2.0;

/// A segment of a feature edge, by the indices of its ends.
type EdgeSegment = [usize; 2];

/// The point from which a polygon is filled.
enum Apex {
    /// One of its own points.
    Own(usize),
    New(Vec3),
}

/// Connected components of the graph of feature edges; each must be a tree whose leaves lie on the boundary loop.
pub(super) struct EdgeGraph {
    /// Points of the loop, then those inside.
    positions: Vec<Vec3>,
    /// How many of them belong to the loop.
    boundary_loop: usize,
    components: Vec<Vec<EdgeSegment>>,
}

impl EdgeGraph {
    pub fn new(cell: SurfaceCell, boundary_loop: &BoundaryLoop, segments: &[[Vec3; 2]]) -> EdgeGraph {
        let n = boundary_loop.positions.len();
        let close = SAME * cell.grid.margin * cell.grid.step;
        let mut graph =
            EdgeGraph { positions: boundary_loop.positions.clone(), boundary_loop: n, components: Vec::new() };
        let mut links: Vec<EdgeSegment> = Vec::with_capacity(segments.len());
        for segment in segments {
            let [a, b] = segment.map(|p| graph.number(p, close));
            // A segment within a cell face does not divide the patch.
            let in_face = a.max(b) < n && boundary_loop.faces[a] & boundary_loop.faces[b] != 0;
            if a != b && !in_face && !links.contains(&[a, b]) && !links.contains(&[b, a]) {
                links.push([a, b]);
            }
        }
        // Edges that end inside the cell divide nothing.
        let mut count = vec![0; graph.positions.len()];
        links.iter().flatten().for_each(|i| count[*i] += 1);
        let is_loose = |l: &EdgeSegment, count: &[usize]| l.iter().any(|i| *i >= n && count[*i] == 1);
        while let Some(i) = links.iter().position(|l| is_loose(l, &count)) {
            links.swap_remove(i).iter().for_each(|i| count[*i] -= 1);
        }
        for p in &mut graph.positions[n..] {
            *p = cell.within(*p);
        }
        for link in links {
            let meets = |t: &Vec<EdgeSegment>| t.iter().flatten().any(|i| *i >= n && link.contains(i));
            let (joined, apart): (Vec<_>, Vec<_>) = graph.components.into_iter().partition(meets);
            graph.components = apart;
            graph.components.push(joined.into_iter().flatten().chain([link]).collect());
        }
        graph
    }

    /// The index of the point near a position, or of a new one.
    fn number(&mut self, p: Vec3, close: f64) -> usize {
        let far = |i: &usize| norm(sub(self.positions[*i], p));
        let near = (0..self.positions.len()).min_by(|i, j| far(i).total_cmp(&far(j)));
        near.filter(|i| far(i) < close).unwrap_or_else(|| {
            self.positions.push(p);
            self.positions.len() - 1
        })
    }

    pub fn segments(&self) -> impl Iterator<Item = [Vec3; 2]> {
        let links = self.components.iter().flatten();
        links.map(|l| l.map(|i| self.positions[i]))
    }

    /// The divided patch and its mean squared distance from the surface; none if the graph does not divide the loop or a part
    /// cannot be filled.
    pub fn patch(&self, cell: SurfaceCell) -> Option<(LoopPatch, f64)> {
        if self.components.is_empty() {
            return None;
        }
        let mut parts = Vec::new();
        self.divide((0..self.boundary_loop).collect(), self.components.clone(), &mut parts)?;
        let mut inner = self.positions[self.boundary_loop..].to_vec();
        let mut triangles = Vec::new();
        let (mut sum, mut count) = (0.0, 0);
        for part in &parts {
            let (apex, off) = self.fan(cell, part)?;
            let apex = match apex {
                Apex::Own(i) => i,
                Apex::New(position) => {
                    inner.push(position);
                    self.boundary_loop + inner.len() - 1
                }
            };
            let faces = part.iter().zip(part.iter().cycle().skip(1));
            let across = faces.filter(|(a, b)| **a != apex && **b != apex);
            triangles.extend(across.map(|(a, b)| [apex, *a, *b]));
            sum += off;
            count += part.len();
        }
        // Two parts that share a bent polyline must not both be cut across it.
        let routes = |t: &[usize; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let mut edges: Vec<EdgeSegment> = triangles.iter().flat_map(routes).collect();
        edges.sort_unstable();
        let once = edges.windows(2).all(|w| w[0] != w[1]);
        let patch = || LoopPatch { inner, triangles, routes: self.routes() };
        once.then(|| (patch(), sum / f64::from(count as u32)))
    }

    /// Polylines along each tree between leaves that follow each other on the loop.
    fn routes(&self) -> Vec<Vec<usize>> {
        let of = |component: &Vec<EdgeSegment>| {
            let ends = self.ends(component);
            let next = ends.iter().cycle().skip(1);
            let pairs = ends.iter().zip(next).take(if ends.len() == 2 { 1 } else { ends.len() });
            let routes = pairs.filter_map(|(a, b)| path(component, *a, *b));
            routes.collect::<Vec<_>>()
        };
        self.components.iter().flat_map(of).collect()
    }

    /// The leaves of a tree, which lie on the loop.
    fn ends(&self, component: &[EdgeSegment]) -> Vec<usize> {
        let points = component.iter().flatten().copied();
        let mut ends: Vec<usize> = points.filter(|i| *i < self.boundary_loop).collect();
        ends.sort_unstable();
        ends.dedup();
        ends
    }

    /// Divides a polygon by trees whose leaves are among its points; none if they are not trees, or cross.
    fn divide(
        &self,
        ring: Vec<usize>,
        mut components: Vec<Vec<EdgeSegment>>,
        parts: &mut Vec<Vec<usize>>,
    ) -> Option<()> {
        let Some(component) = components.pop() else {
            parts.push(ring);
            return Some(());
        };
        let ends = self.ends(&component);
        let at: Vec<usize> = (0..ring.len()).filter(|i| ends.contains(&ring[*i])).collect();
        if at.len() < 2 || at.len() < ends.len() {
            return None;
        }
        let mut walked = 0;
        for (i, &from) in at.iter().enumerate() {
            let to = at[(i + 1) % at.len()];
            let count = (to + ring.len() - from) % ring.len();
            let arc = (0..=count).map(|k| ring[(from + k) % ring.len()]);
            let mut part: Vec<usize> = arc.collect();
            let is_solid = |t: &Vec<EdgeSegment>| self.ends(t).iter().all(|e| part.contains(e));
            let (own, others): (Vec<_>, Vec<_>) = components.into_iter().partition(is_solid);
            components = others;
            let back = path(&component, ring[to], ring[from])?;
            walked += back.len() - 1;
            part.extend(&back[1..back.len() - 1]);
            self.divide(part, own, parts)?;
        }
        // Every link of a tree is walked once in each direction.
        (components.is_empty() && walked == 2 * component.len()).then_some(())
    }

    /// The point from which a polygon is best filled and the sum of squared distances from the surface; none if the polygon is
    /// star-shaped from none of the candidates.
    fn fan(&self, cell: SurfaceCell, part: &[usize]) -> Option<(Apex, f64)> {
        let positions: Vec<Vec3> = part.iter().map(|i| self.positions[*i]).collect();
        let center = middle(&positions);
        let faces = || positions.iter().zip(positions.iter().cycle().skip(1));
        let area = |apex: Vec3, a: Vec3, b: Vec3| cross(sub(a, apex), sub(b, apex));
        let route = unit(faces().fold([0.0; 3], |s, (a, b)| add(s, area(center, *a, *b))));
        // All triangles face the void, and none is so flat that rounding could invert it.
        let least = cell.grid.margin * cell.grid.step / 4.0;
        let is_visible = |apex: Vec3| {
            let mut across = faces().filter(|(a, b)| **a != apex && **b != apex);
            across.all(|(a, b)| {
                let lengths = [sub(*a, apex), sub(*b, apex), sub(*b, *a)].map(norm);
                dot(area(apex, *a, *b), route) > least * lengths.into_iter().fold(0.0, f64::max)
            })
        };
        if let [a, b, c] = positions[..] {
            let off = cell.off(a, &[b, c]) + cell.off(b, &[c]);
            return is_visible(a).then_some((Apex::Own(part[0]), off));
        }
        let inside = part.iter().filter(|i| **i >= self.boundary_loop);
        let own = inside.map(|i| (Apex::Own(*i), self.positions[*i]));
        let new = cell.within(center);
        let visible = own.chain([(Apex::New(new), new)]).filter(|t| is_visible(t.1));
        let all = visible.map(|(name, apex)| (name, cell.off(apex, &positions)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The path through a tree from one point to another; none if it is not a tree.
fn path(component: &[EdgeSegment], from: usize, to: usize) -> Option<Vec<usize>> {
    let mut routes = vec![vec![from]];
    for _ in 0..=component.len() {
        let route = routes.pop()?;
        let last = route[route.len() - 1];
        if last == to {
            return Some(route);
        }
        let links = component.iter().filter(|l| l.contains(&last));
        let next = links.map(|l| l[usize::from(l[0] == last)]);
        let new = next.filter(|n| !route.contains(n));
        routes.extend(new.map(|n| route.iter().copied().chain([n]).collect::<Vec<_>>()));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts into which trees divide a loop of `boundary_loop` points.
    fn parts(boundary_loop: usize, components: &[&[EdgeSegment]]) -> Option<Vec<Vec<usize>>> {
        let graph = EdgeGraph {
            positions: Vec::new(),
            boundary_loop,
            components: components.iter().map(|t| t.to_vec()).collect(),
        };
        let mut parts = Vec::new();
        let whole = (0..boundary_loop).collect();
        graph.divide(whole, graph.components.clone(), &mut parts)?;
        Some(parts)
    }

    #[test]
    fn parts_meet_in_the_trees_and_leave_the_rim_as_it_is() {
        let through: &[EdgeSegment] = &[[1, 5]];
        let bent: &[EdgeSegment] = &[[8, 3], [2, 8]];
        let corner: &[EdgeSegment] = &[[9, 6], [9, 0], [7, 9]];
        let branched: &[EdgeSegment] = &[[10, 0], [10, 2], [10, 11], [11, 4], [6, 11]];
        for (components, count) in [
            (vec![], 1),
            (vec![through], 2),
            (vec![through, bent], 3),
            (vec![corner, bent, through], 5),
            (vec![branched], 4),
        ] {
            let parts = parts(8, &components).expect("divided");
            assert_eq!(parts.len(), count);
            let faces = |p: &Vec<usize>| -> Vec<EdgeSegment> {
                let next = p.iter().cycle().skip(1);
                p.iter().zip(next).map(|(a, b)| [*a, *b]).collect()
            };
            let mut faces: Vec<EdgeSegment> = parts.iter().flat_map(faces).collect();
            for link in components.iter().flat_map(|t| t.iter()) {
                for route in [*link, [link[1], link[0]]] {
                    let at = faces.iter().position(|s| *s == route).expect("both ways");
                    faces.swap_remove(at);
                }
            }
            faces.sort_unstable();
            let boundary_loop: Vec<EdgeSegment> = (0..8).map(|i| [i, (i + 1) % 8]).collect();
            assert_eq!(faces, boundary_loop);
        }
    }

    #[test]
    fn what_crosses_or_closes_divides_nothing() {
        assert_eq!(parts(8, &[&[[0, 4]], &[[2, 6]]]), None);
        let ring: &[EdgeSegment] = &[[0, 8], [8, 9], [9, 10], [10, 8]];
        assert_eq!(parts(8, &[ring]), None);
        let loop_between: &[EdgeSegment] = &[[0, 8], [8, 9], [9, 10], [10, 8], [9, 4]];
        assert_eq!(parts(8, &[loop_between]), None);
        let floating: &[EdgeSegment] = &[[8, 9], [9, 10], [10, 8]];
        assert_eq!(parts(8, &[floating]), None);
    }
}
