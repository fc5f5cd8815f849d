//! The rectilinear grid: even steps between the planes of the region, and one step of padding around it.

use crate::fault::Fault;
use crate::field::Block;
use crate::math::Aabb;
use crate::solid::Solid;

/// Cells along a tile's edge: with one cell of halo on each side, 64 nodes, so that a row of signs is one machine word.
pub(super) const TILE: usize = 61;

/// Most node planes along an axis.
const MOST: f64 = 4e6;

/// Node planes along the three axes (mm, ascending). The outermost ones lie outside the region.
pub(super) struct Grid {
    pub axes: [Vec<f64>; 3],
    /// Points stay this far from the ends of their grid edges, as a share of the edge.
    pub margin: f64,
}

impl Grid {
    pub(super) fn new(solid: &Solid, edge: f64) -> Result<Grid, Fault> {
        if !(edge > 0.0 && edge.is_finite()) {
            return Err(Fault::new(
                "edge",
                format!("{edge} mm; the grid spacing is a positive, finite length"),
            ));
        }
        let bounds = solid.region.bounds();
        if bounds.is_empty() {
            return Err(Fault::new(
                "region",
                "the region is empty; there is nothing to fill",
            ));
        }
        if !bounds.is_finite() {
            return Err(Fault::new(
                "region",
                "the region is not bounded; intersect it with a box, cylinder, sphere or mesh",
            ));
        }
        let mut axes: [Vec<f64>; 3] = Default::default();
        for (a, nodes) in axes.iter_mut().enumerate() {
            let (lo, hi) = (bounds.min[a], bounds.max[a]);
            if (hi - lo) / edge > MOST {
                return Err(Fault::new(
                    "edge",
                    format!(
                        "{edge} mm cuts the region's {:.6} mm into {:.3e} steps; at most {MOST:.0e} are possible",
                        hi - lo,
                        (hi - lo) / edge
                    ),
                ));
            }
            if hi - lo < 0.05 * edge {
                let message = format!(
                    "the region is only {:e} mm thick along {}, less than a twentieth of the grid step of {edge} mm; use an edge of {:e} mm or less",
                    hi - lo,
                    ["x", "y", "z"][a],
                    20.0 * (hi - lo)
                );
                return Err(Fault::new("edge", message));
            }
            let mut stops = Vec::new();
            solid.region.planes(a, &mut stops);
            stops.retain(|s| (lo..=hi).contains(s));
            // A curved surface touches its bounds in a point; keep nodes off it, where it would leave a needle.
            for (end, beyond) in [(lo, lo - 0.5 * edge), (hi, hi + 0.5 * edge)] {
                if !stops.contains(&end) {
                    stops.push(beyond);
                }
            }
            stops.sort_by(f64::total_cmp);
            // Planes closer than a hundredth of a step would make needles; the first of them stands for all.
            stops.dedup_by(|b, a| *b - *a < 0.01 * edge);
            nodes.push(stops[0] - edge);
            for w in stops.windows(2) {
                let steps = ((w[1] - w[0]) / edge - 1e-9).ceil().max(1.0);
                nodes
                    .extend((0..steps as usize).map(|i| w[0] + (w[1] - w[0]) * (i as f64 / steps)));
            }
            let last = stops[stops.len() - 1];
            nodes.extend([last, hi.max(last) + edge]);
        }
        let finest = axes
            .iter()
            .flat_map(|n| n.windows(2).map(|w| w[1] - w[0]))
            .fold(f64::INFINITY, f64::min);
        let farthest = axes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        // Eight units in the last place of the farthest f32 coordinate between any two points of an edge: rounding
        // keeps their order, hence every guarantee.
        let needed = 8.0 * farthest * f64::from(f32::EPSILON) / finest;
        if needed > 0.125 {
            return Err(Fault::new(
                "edge",
                format!(
                    "steps of {finest:.3e} mm at {farthest:.6} mm from the origin vanish in the files' single precision; \
                     use an edge above {:.3e} mm or move the part nearer to the origin",
                    64.0 * farthest * f64::from(f32::EPSILON)
                ),
            ));
        }
        Ok(Grid {
            axes,
            margin: needed.max(1.0 / 4096.0),
        })
    }

    /// Number of cells along each axis.
    pub(super) fn cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].len() - 1)
    }

    /// Number of tiles along each axis.
    pub(super) fn tiles(&self) -> [usize; 3] {
        self.cells().map(|n| n.div_ceil(TILE))
    }

    /// The tile at a position in the order x fastest.
    pub(super) fn tile(&self, index: usize) -> [usize; 3] {
        let n = self.tiles();
        [index % n[0], index / n[0] % n[1], index / n[0] / n[1]]
    }

    /// First and one-past-last node of a tile with its halo.
    pub(super) fn nodes(&self, tile: [usize; 3]) -> [std::ops::Range<usize>; 3] {
        [0, 1, 2].map(|a| {
            (tile[a] * TILE).saturating_sub(1)..((tile[a] + 1) * TILE + 2).min(self.axes[a].len())
        })
    }

    /// The nodes of a tile with its halo.
    pub(super) fn block(&self, tile: [usize; 3]) -> Block<'_> {
        let n = self.nodes(tile);
        Block {
            axes: [0, 1, 2].map(|a| &self.axes[a][n[a].clone()]),
        }
    }
}

/// What proven bounds say of a block.
pub(super) enum Content {
    /// No surface crosses it.
    None,
    /// Which of lattice and region must be sampled.
    Surface { field: bool, region: bool },
}

/// Looks at a block through bounds alone.
pub(super) fn content(solid: &Solid, b: &Aabb) -> Content {
    let r = solid.region.bound(b);
    if r.lo > 0.0 {
        return Content::None;
    }
    let region = r.hi >= 0.0;
    let field = match &solid.field {
        None => false,
        Some(f) => {
            let f = f.bound(b);
            if f.lo > 0.0 {
                return Content::None;
            }
            f.hi >= 0.0
        }
    };
    if region || field {
        Content::Surface { field, region }
    } else {
        Content::None
    }
}
