//! The sharp union of hubs and beams as a field: the distance to the nearest of them.

use super::{Graph, Profile};
use crate::field::Field;
use crate::math::{Aabb, Interval, Vec3, add, dot, norm, scale, sub, unit};

/// Pieces in a leaf of the tree.
const LEAF: usize = 4;

/// A piece: two balls and the cone tangent to both.
#[derive(Clone, Copy, Debug)]
struct Piece {
    ends: [Vec3; 2],
    radii: [f64; 2],
}

impl Piece {
    fn bounds(&self) -> Aabb {
        let ball = |i: usize| {
            Aabb {
                min: self.ends[i],
                max: self.ends[i],
            }
            .grown(self.radii[i])
        };
        ball(0).union(ball(1))
    }

    /// Signed distance and its gradient.
    fn distance(&self, p: Vec3) -> (f64, Vec3) {
        let ([a, b], [ra, rb]) = (self.ends, self.radii);
        let along = sub(b, a);
        let length = norm(along);
        let ball = |c: Vec3, r: f64| {
            let d = sub(p, c);
            (norm(d) - r, unit(d))
        };
        let slant = (ra - rb) / length;
        if length == 0.0 || slant.abs() >= 1.0 {
            return if ra >= rb { ball(a, ra) } else { ball(b, rb) };
        }
        let n = scale(along, 1.0 / length);
        let d = sub(p, a);
        let z = dot(d, n);
        let across = sub(d, scale(n, z));
        let rho = norm(across);
        // The cone's normal is (c, s) in (across, along); feet outside the two contact circles belong to a ball.
        let (s, c) = (slant, (1.0 - slant * slant).sqrt());
        let foot = z * c - rho * s;
        if foot <= 0.0 {
            ball(a, ra)
        } else if foot >= length * c {
            ball(b, rb)
        } else {
            let out = if rho > 0.0 {
                scale(across, 1.0 / rho)
            } else {
                [0.0; 3]
            };
            (rho * c + z * s - ra, add(scale(out, c), scale(n, s)))
        }
    }
}

struct Node {
    bounds: Aabb,
    /// The pieces, or the nodes below.
    range: [u32; 2],
    leaf: bool,
    /// The largest radius below, mm.
    thickest: f64,
}

/// The union of all hubs and beams of a graph.
pub struct Union {
    pieces: Vec<Piece>,
    nodes: Vec<Node>,
}

impl Union {
    /// The field of a graph; none without beams.
    pub fn new(graph: &Graph) -> Option<Union> {
        let mut pieces = Vec::with_capacity(graph.beams.len());
        for beam in &graph.beams {
            let [a, b] = beam.ends.map(|n| graph.hubs[n as usize]);
            let middle = match beam.profile {
                Profile::Mid(r) | Profile::Waist(r) => Some(r),
                _ => None,
            };
            match middle {
                Some(r) => {
                    let m = scale(add(a.center, b.center), 0.5);
                    pieces.push(Piece {
                        ends: [a.center, m],
                        radii: [a.radius, r],
                    });
                    pieces.push(Piece {
                        ends: [m, b.center],
                        radii: [r, b.radius],
                    });
                }
                None => pieces.push(Piece {
                    ends: [a.center, b.center],
                    radii: [a.radius, b.radius],
                }),
            }
        }
        let mut nodes = Vec::new();
        if pieces.is_empty() {
            return None;
        }
        grow(&mut pieces, 0, &mut nodes);
        Some(Union { pieces, nodes })
    }

    /// The nearest piece's distance and gradient.
    fn nearest(&self, p: Vec3) -> (f64, Vec3) {
        let mut best = (f64::INFINITY, [0.0; 3]);
        let mut open = [(0u32, f64::NEG_INFINITY); 96];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (n, least) = open[count];
            if least >= best.0 {
                continue;
            }
            let node = &self.nodes[n as usize];
            if node.leaf {
                for piece in &self.pieces[node.range[0] as usize..node.range[1] as usize] {
                    let found = piece.distance(p);
                    if found.0 < best.0 {
                        best = found;
                    }
                }
                continue;
            }
            let below = node.range.map(|n| (n, self.nodes[n as usize].least(p)));
            let [near, far] = if below[0].1 <= below[1].1 {
                below
            } else {
                [below[1], below[0]]
            };
            open[count] = far;
            open[count + 1] = near;
            count += 2;
        }
        best
    }
}

impl Node {
    /// A lower bound of the distance to what is below.
    fn least(&self, p: Vec3) -> f64 {
        match self.bounds.distance(p) {
            d if d > 0.0 => d,
            _ => -self.thickest,
        }
    }
}

/// Adds the tree of some pieces, the first of which is number `from`; its root comes first.
fn grow(pieces: &mut [Piece], from: u32, nodes: &mut Vec<Node>) -> u32 {
    let at = nodes.len();
    let bounds = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds()));
    let thickest = pieces.iter().flat_map(|p| p.radii).fold(0.0, f64::max);
    let leaf = pieces.len() <= LEAF;
    nodes.push(Node {
        bounds,
        range: [from, from + pieces.len() as u32],
        leaf,
        thickest,
    });
    if !leaf {
        let size = bounds.size();
        let axis = (0..3)
            .max_by(|a, b| size[*a].total_cmp(&size[*b]))
            .unwrap_or(0);
        let half = pieces.len() / 2;
        let middle = |p: &Piece| p.ends[0][axis] + p.ends[1][axis];
        pieces.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        let (low, high) = pieces.split_at_mut(half);
        let below = [
            grow(low, from, nodes),
            grow(high, from + half as u32, nodes),
        ];
        nodes[at].range = below;
    }
    at as u32
}

impl Field for Union {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.nearest(*p).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for (i, p) in points.iter().enumerate() {
            (values[i], gradients[i]) = self.nearest(*p);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let (middle, reach) = (
            self.nearest(b.center()).0,
            0.5 * norm(b.size()) * (1.0 + 1e-12),
        );
        Interval::new(middle - reach, middle + reach)
    }

    fn edged(&self) -> bool {
        true
    }
}
