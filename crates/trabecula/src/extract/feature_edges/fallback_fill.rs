//! Fallback fill of fitted cells: closed and embedded, but not accurate.
//!
//! It is used where a cell self-intersects in single precision whichever point it is filled from, or one of its volumes is not
//! star-shaped. It uses nothing but the division of the cell's faces, which adjacent cells share: from the edges there between
//! parts of the solid and void, strips run inwards to a smaller cell that is all of one part or all void. At every depth between the two cells is
//! a scaled copy of the faces, so strips meet only where edges of the faces do.

use std::collections::HashMap;

use crate::extract::feature_cells::FeatureCells;
use crate::extract::sampling_grid::Sides;
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, scale, sub};

/// Sizes of the smaller cell as a share of the cell, tried in turn.
const INNER: [f64; 6] = [0.9, 0.75, 0.6, 0.5, 0.4, 0.25];

/// A polygon of a cell face, counter-clockwise seen from outside; the face's axis, and the part of the solid behind the
/// polygon.
struct FacePolygon {
    ring: Vec<VertexId>,
    axis: usize,
    part: u8,
}

impl FeatureCells<'_> {
    /// Fills a cell, with one smaller cell after the other while the result self-intersects in single precision.
    pub(super) fn fallback_fill(&mut self, cell: [usize; 3]) {
        let polygons = self.polygons(cell);
        let part = self.part_at(cell, self.center_of(cell));
        let first = self.extra.triangles.len();
        for share in INNER {
            self.extra.triangles.truncate(first);
            self.fallback_walls(cell, &polygons, part, share);
            if !self.self_intersects_rounded(first) {
                return;
            }
        }
        self.extra.self_intersection = Some(self.center_of(cell));
    }

    pub(in crate::extract) fn center_of(&self, cell: [usize; 3]) -> Vec3 {
        let node = self.nodes.index(cell);
        let ends = [node, node + self.offset(7)].map(|n| self.nodes.position(n));
        scale(add(ends[0], ends[1]), 0.5)
    }

    /// The part of the solid at a position in a cell.
    fn part_at(&self, cell: [usize; 3], position: Vec3) -> u8 {
        let negative = self.local.live.iter().enumerate().fold(0, |w, (f, id)| {
            let is = self.grid.surfaces[*id].field.value(position) <= 0.0;
            w | u64::from(is) << f
        });
        self.part_in(cell, negative)
    }

    /// The faces of a cell, divided by all surfaces.
    fn polygons(&self, cell: [usize; 3]) -> Vec<FacePolygon> {
        let node = self.nodes.index(cell);
        let mut all = Vec::new();
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            let fitted = self.divided_faces.face((low, axis));
            let fragments = match fitted {
                Some(face) => face.fragments().map(|(n, ring)| (n, ring.to_vec())).collect(),
                None => self.face_fragments(cell, axis, upper),
            };
            for (negative, mut ring) in fragments {
                if fitted.is_some() && !upper {
                    ring.reverse();
                }
                let part = self.part_in(cell, negative);
                all.push(FacePolygon { ring, axis, part });
            }
        }
        all
    }

    fn fallback_walls(&mut self, cell: [usize; 3], polygons: &[FacePolygon], center_part: u8, share: f64) {
        let node = self.nodes.index(cell);
        let center = self.center_of(cell);
        let mut inner: HashMap<VertexId, u32> = HashMap::new();
        let mut within = |features: &mut Self, key: VertexId| {
            *inner.entry(key).or_insert_with(|| {
                let v = features.vertex(key);
                let out = sub(features.positions[v as usize], center);
                features.push(VertexId::center(node, 7), add(center, scale(out, share)))
            })
        };
        let around = |ring: &[VertexId]| -> Vec<(VertexId, VertexId)> {
            (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()])).collect()
        };
        // Each edge between two parts once: from the one with the higher number.
        let lines = || polygons.iter().flat_map(|p| around(&p.ring).into_iter().map(|line| (line, p.part)));
        let known: HashMap<(VertexId, VertexId), u8> = lines().collect();
        for ((p, q), part) in lines() {
            let ahead = known.get(&(q, p)).copied().unwrap_or(0);
            if part <= ahead {
                continue;
            }
            let sides = self.fallback_sides([part, ahead], [p, q]);
            let [a, b] = [p, q].map(|k| self.vertex(k));
            let [c, d] = [p, q].map(|k| within(self, k));
            self.extra.triangles.push(([d, b, a], sides));
            self.extra.triangles.push(([d, a, c], sides));
        }
        for p in polygons.iter().filter(|p| p.part != center_part) {
            let names: Vec<u32> = p.ring.iter().map(|k| within(self, *k)).collect();
            // A ring runs counter-clockwise seen from outside the cell, where the polygon's part is: it faces that part.
            let sides = self.fallback_sides([center_part, p.part], [p.ring[0], p.ring[1]]);
            self.flat(&names, p.axis, sides);
        }
    }

    /// What lies on the sides of a triangle that ends at an edge between two points. Of several parts, which fill the region together, the
    /// region's boundary is where one ends at void.
    fn fallback_sides(&self, [behind, ahead]: [u8; 2], [p, q]: [VertexId; 2]) -> Sides {
        let cut = match self.local.trees.len() {
            1 => self.is_cut(p, q),
            _ => behind == 0 || ahead == 0,
        };
        Sides { behind, ahead, cut }
    }

    /// Whether an edge between two points lies on the region's boundary: not if it lies on a surface of something else.
    fn is_cut(&self, p: VertexId, q: VertexId) -> bool {
        let mut both = p.surfaces().filter(|f| q.surfaces().any(|g| g == *f));
        both.all(|f| self.grid.surfaces[self.local.live[f]].cut)
    }
}
