//! Edges of a face that divide a patch.

use super::patch::{Cell, Patch, Rim};
use crate::extract::knot::middle;
use geometry::math::{Vec3, add, cross, dot, norm, sub, unit};

/// Ends of edges and points of rims are the same if they are this many times as near to each other as points come to nodes:
/// corners are moved into their sides by as much.
const SAME: f64 = 2.0;

/// A piece of an edge, by the numbers of its ends.
type Link = [usize; 2];

/// The point from which a polygon is filled.
enum Apex {
    /// One of its own, by its number.
    Own(usize),
    New(Vec3),
}

/// The edges that divide a patch: trees whose ends lie on its rim.
pub(super) struct Web {
    /// The points of the rim, and those inside.
    places: Vec<Vec3>,
    /// How many of them are of the rim.
    rim: usize,
    trees: Vec<Vec<Link>>,
}

impl Web {
    pub fn new(cell: Cell, rim: &Rim, pieces: &[[Vec3; 2]]) -> Web {
        let n = rim.places.len();
        let close = SAME * cell.grid.margin * cell.grid.step;
        let mut web = Web { places: rim.places.clone(), rim: n, trees: Vec::new() };
        let mut links: Vec<Link> = Vec::with_capacity(pieces.len());
        for piece in pieces {
            let [a, b] = piece.map(|p| web.number(p, close));
            // What lies in a side is no business of the patch.
            let in_side = a.max(b) < n && rim.sides[a] & rim.sides[b] != 0;
            if a != b && !in_side && !links.contains(&[a, b]) && !links.contains(&[b, a]) {
                links.push([a, b]);
            }
        }
        // Edges that end inside divide nothing.
        let mut count = vec![0; web.places.len()];
        links.iter().flatten().for_each(|i| count[*i] += 1);
        let is_loose = |l: &Link, count: &[usize]| l.iter().any(|i| *i >= n && count[*i] == 1);
        while let Some(i) = links.iter().position(|l| is_loose(l, &count)) {
            links.swap_remove(i).iter().for_each(|i| count[*i] -= 1);
        }
        for p in &mut web.places[n..] {
            *p = cell.within(*p);
        }
        for link in links {
            let meets = |t: &Vec<Link>| t.iter().flatten().any(|i| *i >= n && link.contains(i));
            let (joined, apart): (Vec<_>, Vec<_>) = web.trees.into_iter().partition(meets);
            web.trees = apart;
            web.trees.push(joined.into_iter().flatten().chain([link]).collect());
        }
        web
    }

    /// The number of a place; a new one if none is near.
    fn number(&mut self, p: Vec3, close: f64) -> usize {
        let far = |i: &usize| norm(sub(self.places[*i], p));
        let near = (0..self.places.len()).min_by(|i, j| far(i).total_cmp(&far(j)));
        near.filter(|i| far(i) < close).unwrap_or_else(|| {
            self.places.push(p);
            self.places.len() - 1
        })
    }

    pub fn pieces(&self) -> impl Iterator<Item = [Vec3; 2]> {
        let links = self.trees.iter().flatten();
        links.map(|l| l.map(|i| self.places[i]))
    }

    /// The patch that is divided, and the mean square of how far it is from the face; none if there is none to be had.
    pub fn patch(&self, cell: Cell) -> Option<(Patch, f64)> {
        if self.trees.is_empty() {
            return None;
        }
        let mut parts = Vec::new();
        self.divide((0..self.rim).collect(), self.trees.clone(), &mut parts)?;
        let mut inner = self.places[self.rim..].to_vec();
        let mut triangles = Vec::new();
        let (mut sum, mut count) = (0.0, 0);
        for part in &parts {
            let (apex, off) = self.fan(cell, part)?;
            let apex = match apex {
                Apex::Own(i) => i,
                Apex::New(place) => {
                    inner.push(place);
                    self.rim + inner.len() - 1
                }
            };
            let sides = part.iter().zip(part.iter().cycle().skip(1));
            let across = sides.filter(|(a, b)| **a != apex && **b != apex);
            triangles.extend(across.map(|(a, b)| [apex, *a, *b]));
            sum += off;
            count += part.len();
        }
        // Parts that share a bent line must not both be cut across it.
        let ways = |t: &[usize; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let mut edges: Vec<Link> = triangles.iter().flat_map(ways).collect();
        edges.sort_unstable();
        let once = edges.windows(2).all(|w| w[0] != w[1]);
        let patch = || Patch { inner, triangles, ways: self.ways() };
        once.then(|| (patch(), sum / f64::from(count as u32)))
    }

    /// The ways along trees between the ends that follow each other on the rim.
    fn ways(&self) -> Vec<Vec<usize>> {
        let of = |tree: &Vec<Link>| {
            let ends = self.ends(tree);
            let next = ends.iter().cycle().skip(1);
            let pairs = ends.iter().zip(next).take(if ends.len() == 2 { 1 } else { ends.len() });
            let ways = pairs.filter_map(|(a, b)| path(tree, *a, *b));
            ways.collect::<Vec<_>>()
        };
        self.trees.iter().flat_map(of).collect()
    }

    /// The points of the rim at which a tree ends.
    fn ends(&self, tree: &[Link]) -> Vec<usize> {
        let points = tree.iter().flatten().copied();
        let mut ends: Vec<usize> = points.filter(|i| *i < self.rim).collect();
        ends.sort_unstable();
        ends.dedup();
        ends
    }

    /// Divides a polygon by trees whose ends are among its points; none if they are no trees, or cross.
    fn divide(&self, ring: Vec<usize>, mut trees: Vec<Vec<Link>>, parts: &mut Vec<Vec<usize>>) -> Option<()> {
        let Some(tree) = trees.pop() else {
            parts.push(ring);
            return Some(());
        };
        let ends = self.ends(&tree);
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
            let holds = |t: &Vec<Link>| self.ends(t).iter().all(|e| part.contains(e));
            let (own, others): (Vec<_>, Vec<_>) = trees.into_iter().partition(holds);
            trees = others;
            let back = path(&tree, ring[to], ring[from])?;
            walked += back.len() - 1;
            part.extend(&back[1..back.len() - 1]);
            self.divide(part, own, parts)?;
        }
        // Around a tree every link is walked from both sides.
        (trees.is_empty() && walked == 2 * tree.len()).then_some(())
    }

    /// The point from which a polygon is best filled, and the sum of squares of how far the face is from it; none if it is seen
    /// whole from none of those inside the cell.
    fn fan(&self, cell: Cell, part: &[usize]) -> Option<(Apex, f64)> {
        let places: Vec<Vec3> = part.iter().map(|i| self.places[*i]).collect();
        let center = middle(&places);
        let sides = || places.iter().zip(places.iter().cycle().skip(1));
        let area = |apex: Vec3, a: Vec3, b: Vec3| cross(sub(a, apex), sub(b, apex));
        let way = unit(sides().fold([0.0; 3], |s, (a, b)| add(s, area(center, *a, *b))));
        // From the void, and no triangle so flat that rounding could turn it.
        let least = cell.grid.margin * cell.grid.step / 4.0;
        let is_seen = |apex: Vec3| {
            let mut across = sides().filter(|(a, b)| **a != apex && **b != apex);
            across.all(|(a, b)| {
                let lengths = [sub(*a, apex), sub(*b, apex), sub(*b, *a)].map(norm);
                dot(area(apex, *a, *b), way) > least * lengths.into_iter().fold(0.0, f64::max)
            })
        };
        if let [a, b, c] = places[..] {
            let off = cell.off(a, &[b, c]) + cell.off(b, &[c]);
            return is_seen(a).then_some((Apex::Own(part[0]), off));
        }
        let inside = part.iter().filter(|i| **i >= self.rim);
        let own = inside.map(|i| (Apex::Own(*i), self.places[*i]));
        let new = cell.within(center);
        let seen = own.chain([(Apex::New(new), new)]).filter(|t| is_seen(t.1));
        let all = seen.map(|(name, apex)| (name, cell.off(apex, &places)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The way through a tree from one point to another; none if it is no tree.
fn path(tree: &[Link], from: usize, to: usize) -> Option<Vec<usize>> {
    let mut ways = vec![vec![from]];
    for _ in 0..=tree.len() {
        let way = ways.pop()?;
        let last = way[way.len() - 1];
        if last == to {
            return Some(way);
        }
        let links = tree.iter().filter(|l| l.contains(&last));
        let next = links.map(|l| l[usize::from(l[0] == last)]);
        let new = next.filter(|n| !way.contains(n));
        ways.extend(new.map(|n| way.iter().copied().chain([n]).collect::<Vec<_>>()));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts of a rim of so many points that some trees divide.
    fn parts(rim: usize, trees: &[&[Link]]) -> Option<Vec<Vec<usize>>> {
        let web = Web { places: Vec::new(), rim, trees: trees.iter().map(|t| t.to_vec()).collect() };
        let mut parts = Vec::new();
        let whole = (0..rim).collect();
        web.divide(whole, web.trees.clone(), &mut parts)?;
        Some(parts)
    }

    #[test]
    fn parts_meet_in_the_trees_and_leave_the_rim_as_it_is() {
        let through: &[Link] = &[[1, 5]];
        let bent: &[Link] = &[[8, 3], [2, 8]];
        let corner: &[Link] = &[[9, 6], [9, 0], [7, 9]];
        let branched: &[Link] = &[[10, 0], [10, 2], [10, 11], [11, 4], [6, 11]];
        for (trees, count) in [
            (vec![], 1),
            (vec![through], 2),
            (vec![through, bent], 3),
            (vec![corner, bent, through], 5),
            (vec![branched], 4),
        ] {
            let parts = parts(8, &trees).expect("divided");
            assert_eq!(parts.len(), count);
            let sides = |p: &Vec<usize>| -> Vec<Link> {
                let next = p.iter().cycle().skip(1);
                p.iter().zip(next).map(|(a, b)| [*a, *b]).collect()
            };
            let mut sides: Vec<Link> = parts.iter().flat_map(sides).collect();
            for link in trees.iter().flat_map(|t| t.iter()) {
                for way in [*link, [link[1], link[0]]] {
                    let at = sides.iter().position(|s| *s == way).expect("both ways");
                    sides.swap_remove(at);
                }
            }
            sides.sort_unstable();
            let rim: Vec<Link> = (0..8).map(|i| [i, (i + 1) % 8]).collect();
            assert_eq!(sides, rim);
        }
    }

    #[test]
    fn what_crosses_or_closes_divides_nothing() {
        assert_eq!(parts(8, &[&[[0, 4]], &[[2, 6]]]), None);
        let ring: &[Link] = &[[0, 8], [8, 9], [9, 10], [10, 8]];
        assert_eq!(parts(8, &[ring]), None);
        let loop_between: &[Link] = &[[0, 8], [8, 9], [9, 10], [10, 8], [9, 4]];
        assert_eq!(parts(8, &[loop_between]), None);
        let floating: &[Link] = &[[8, 9], [9, 10], [10, 8]];
        assert_eq!(parts(8, &[floating]), None);
    }
}
