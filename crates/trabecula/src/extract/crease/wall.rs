//! Fitted cells that nothing else fills: walls between what is solid and what is void of their sides.
//!
//! Where single precision muddles a cell from whatever points inside it is filled, or no point sees one of its volumes whole,
//! nothing is asked of the faces any more but what they say of the cell's sides, which neighbours share: the lines there
//! between solid and void run inwards as walls, up to a smaller cell that is all solid or all void. Between the two cells there is a copy of the sides for every
//! depth, so walls meet no more than lines of the sides do.

use std::collections::{HashMap, HashSet};

use crate::extract::key::Key;
use crate::extract::knot::Knots;
use geometry::math::{Vec3, add, scale, sub};

/// How much smaller than the cell the one is in which walls end.
const INNER: [f64; 6] = [0.9, 0.75, 0.6, 0.5, 0.4, 0.25];

/// A polygon of a side, counter-clockwise seen from outside; the side's axis, and whether the polygon is solid.
struct Polygon {
    ring: Vec<Key>,
    axis: usize,
    solid: bool,
}

impl Knots<'_> {
    /// Fills a cell with walls, as long as single precision muddles them for one smaller cell after the other.
    pub(super) fn walled(&mut self, cell: [usize; 3]) {
        let polygons = self.polygons(cell);
        let solid = self.is_solid_at(cell, self.center_of(cell));
        let first = self.extra.triangles.len();
        for share in INNER {
            self.extra.triangles.truncate(first);
            self.walls(cell, &polygons, solid, share);
            if !self.muddled(first) {
                return;
            }
        }
    }

    pub(super) fn center_of(&self, cell: [usize; 3]) -> Vec3 {
        let node = self.nodes.index(cell);
        let ends = [node, node + self.offset(7)].map(|n| self.nodes.place(n));
        scale(add(ends[0], ends[1]), 0.5)
    }

    /// Whether a place in a cell is solid.
    fn is_solid_at(&self, cell: [usize; 3], place: Vec3) -> bool {
        let negative = self.local.live.iter().enumerate().fold(0, |w, (f, id)| {
            let is = self.grid.faces[*id].field.value(place) <= 0.0;
            w | u64::from(is) << f
        });
        self.holds(cell, negative)
    }

    /// The sides of a cell, divided by all faces.
    fn polygons(&self, cell: [usize; 3]) -> Vec<Polygon> {
        let node = self.nodes.index(cell);
        let mut all = Vec::new();
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            let fitted = self.fits.sides.get(&(low, axis));
            let pieces = match fitted {
                Some(side) => side.pieces().map(|(n, ring)| (n, ring.to_vec())).collect(),
                None => self.side_pieces(cell, axis, upper),
            };
            for (negative, mut ring) in pieces {
                if fitted.is_some() && !upper {
                    ring.reverse();
                }
                let solid = self.holds(cell, negative);
                all.push(Polygon { ring, axis, solid });
            }
        }
        all
    }

    fn walls(&mut self, cell: [usize; 3], polygons: &[Polygon], solid: bool, share: f64) {
        let node = self.nodes.index(cell);
        let center = self.center_of(cell);
        let mut inner: HashMap<Key, u32> = HashMap::new();
        let mut within = |knots: &mut Self, key: Key| {
            *inner.entry(key).or_insert_with(|| {
                let v = knots.vertex(key);
                let out = sub(knots.places[v as usize], center);
                knots.push(Key::center(node, 7), add(center, scale(out, share)))
            })
        };
        let around = |ring: &[Key]| -> Vec<(Key, Key)> {
            (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()])).collect()
        };
        let of_solid = polygons.iter().filter(|p| p.solid);
        let lines: Vec<(Key, Key)> = of_solid.flat_map(|p| around(&p.ring)).collect();
        let known: HashSet<(Key, Key)> = lines.iter().copied().collect();
        for (p, q) in lines.into_iter().filter(|(p, q)| !known.contains(&(*q, *p))) {
            let cut = self.is_cut(p, q);
            let [a, b] = [p, q].map(|k| self.vertex(k));
            let [c, d] = [p, q].map(|k| within(self, k));
            self.extra.triangles.push(([d, b, a], cut));
            self.extra.triangles.push(([d, a, c], cut));
        }
        for p in polygons.iter().filter(|p| p.solid != solid) {
            let cut = self.is_cut(p.ring[0], p.ring[1]);
            let mut names: Vec<u32> = p.ring.iter().map(|k| within(self, *k)).collect();
            if !solid {
                names.reverse();
            }
            self.flat(&names, p.axis, cut);
        }
    }

    /// Whether a line between two points lies on the region's surface: not if it is on a face that is not.
    fn is_cut(&self, p: Key, q: Key) -> bool {
        let mut both = p.faces().filter(|f| q.faces().any(|g| g == *f));
        both.all(|f| self.grid.faces[self.local.live[f]].cut)
    }
}
