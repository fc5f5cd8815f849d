//! The rectilinear sampling grid: equal steps between the grid-aligned planes of the region, with one step of padding; and what
//! bounds say of the solid in a block of it.

use std::collections::HashMap;

use crate::csg_tree::{CsgTree, Sign};
use crate::field::Block;
use crate::implicit::Surface;
use crate::solid::{Solid, Spaces};
use geometry::fault::{Fault, number};
use geometry::feature_edges::Creases;
use geometry::math::{Aabb, Vec3};

use super::block_nodes::PaddedNodes;

/// Cells along a tile's edge: with one cell of halo on each side, 64 nodes, so that a row of signs is one machine word.
pub const TILE: usize = 61;

/// Most steps along an axis.
pub const MOST_STEPS: f64 = 4e6;

/// Most grid cells: those of 9 million tiles. Bounds dismiss a tile in some hundredths of a millisecond to a millisecond, so what
/// is empty takes minutes to some hours.
pub const MOST_CELLS: f64 = 2e12;

/// Straight edges of at least this many grid steps are kept, whatever their angle.
const LONG: f64 = 3.0;
/// Edges of at least this angle are kept whatever their length, radians (25°). Without them the surface is off by up to a tenth
/// of a grid step.
const SHARP: f64 = 0.436;

/// The solid on its grid.
pub(super) struct SamplingGrid {
    /// Node planes along the three axes (mm, ascending). The outermost ones lie outside the region.
    pub axes: [Vec<f64>; 3],
    /// Least distance of points from the ends of their grid edges, as a share of the edge.
    pub margin: f64,
    /// The step asked for, mm.
    pub step: f64,
    /// The implicit surfaces of the solid.
    pub surfaces: Vec<Surface>,
    /// How they make the parts of the solid, which do not overlap; nearly always it is one.
    trees: Vec<CsgTree>,
    /// Both surfaces of a sheet, if its spaces are parts too.
    pub faces: Option<[usize; 2]>,
    /// For each surface, the index of the node plane that it is, if it is one: then it needs no samples.
    grid_plane: Vec<Option<usize>>,
    /// For each surface, its feature edges near each tile.
    creases: Vec<HashMap<usize, Vec<u32>>>,
    /// The surface with feature edges to which cells are fitted where it meets others.
    pub fitted: Option<usize>,
}

/// What bounds say of the solid in a block, without sampling.
pub(super) struct LocalSolid {
    /// The parts of the solid, by the indices of surfaces here: those in `live`, then those in `grid_planes`.
    pub trees: Vec<CsgTree>,
    /// Surfaces that may change sign at the block's nodes.
    pub live: Vec<usize>,
    /// Surfaces that are node planes within the block.
    pub grid_planes: Vec<GridPlane>,
}

/// A surface that is a node plane.
pub(super) struct GridPlane {
    pub axis: usize,
    /// The plane's number in the block.
    pub at: usize,
    /// Whether the solid lies below.
    pub below: bool,
}

impl SamplingGrid {
    /// A grid for a solid.
    pub(super) fn new(solid: &Solid, edge: f64) -> Result<SamplingGrid, Fault> {
        check(solid, edge)?;
        let (surfaces, tree) = solid.surfaces();
        SamplingGrid::of(solid, edge, surfaces, vec![tree], None)
    }

    /// A grid for the wall of a solid and the spaces adjacent to it.
    pub(super) fn of_spaces(solid: &Solid, edge: f64) -> Result<SamplingGrid, Fault> {
        check(solid, edge)?;
        let Spaces { surfaces, trees, faces } = solid.spaces()?;
        SamplingGrid::of(solid, edge, surfaces, trees.into(), Some(faces))
    }

    fn of(
        solid: &Solid,
        edge: f64,
        surfaces: Vec<Surface>,
        trees: Vec<CsgTree>,
        faces: Option<[usize; 2]>,
    ) -> Result<SamplingGrid, Fault> {
        // Planes that bound the whole solid become node planes and so are exact. (Others may meet each other in ways that a
        // node plane cannot represent, such as two boxes that touch along an edge.)
        let mut required = Vec::new();
        trees[0].for_each_bounding(&mut |f| required.push(f));
        let mut planes: Vec<_> = required.iter().filter_map(|&f| Some((f, surfaces[f].plane?))).collect();
        // Perturbed surfaces are too near to others for fitted cells.
        let fits = surfaces.iter().any(|f| !f.creases.segments.is_empty()) && !surfaces.iter().any(|f| f.perturbed);
        // Caps on node planes know feature cells only, not fitted ones.
        if fits {
            planes.clear();
        }
        let mut axes: [Vec<f64>; 3] = Default::default();
        for (a, nodes) in axes.iter_mut().enumerate() {
            let fixed = planes.iter().filter(|p| p.1.axis == a).map(|p| p.1.at).collect();
            *nodes = node_planes(solid, &surfaces, fixed, edge, a)?;
        }
        let margin = margin(&axes)?;
        count(&axes, edge)?;
        let mut grid_plane = vec![None; surfaces.len()];
        for (f, p) in planes {
            grid_plane[f] = axes[p.axis].iter().position(|&x| x == p.at);
        }
        let mut grid = SamplingGrid {
            axes,
            margin,
            step: edge,
            surfaces,
            trees,
            faces,
            grid_plane,
            creases: Vec::new(),
            fitted: None,
        };
        grid.creases = (grid.surfaces.iter()).map(|f| by_tile(&grid, &f.creases)).collect();
        // The region's come first.
        let mut creased = (0..grid.creases.len()).filter(|f| !grid.creases[*f].is_empty());
        grid.fitted = creased.next().filter(|_| fits);
        grid.few_enough().map(|()| grid)
    }

    /// What is said of a surface that crosses itself at a position when it is rounded to single precision.
    pub(super) fn too_far(&self, at: Vec3) -> Fault {
        let finest = at.iter().fold(0.0f64, |m, x| m.max(x.abs())) * f64::from(f32::EPSILON);
        Fault::new(
            "edge",
            format!(
                "near ({}) mm a surface made in steps of {} mm crosses itself in the files' single precision, {} mm there: walls \
                 may not be thinner; keep a grade from letting them shrink to nothing, move the part nearer to the origin, or \
                 use another edge",
                at.map(number).join(", "),
                number(self.step),
                format_args!("{finest:.1e}"),
            ),
        )
    }

    /// Refuses a solid with more surfaces in some tile than a word has bits.
    fn few_enough(&self) -> Result<(), Fault> {
        const MOST_SURFACES: usize = 64;
        if self.surfaces.len() <= MOST_SURFACES {
            return Ok(());
        }
        let count = |i: usize| {
            let tile = self.tile(i);
            let local = self.local(&self.nodes(tile), &self.block(tile).bounds());
            local.map_or(0, |l| l.live.len())
        };
        let most = self.all().map(count).max();
        match most {
            Some(n) if n > MOST_SURFACES => Err(Fault::new(
                "edge",
                format!(
                    "{n} smooth faces meet in a block of {TILE} grid steps, and {MOST_SURFACES} are possible; \
                     use a smaller edge, or a mesh for the region"
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Whether a part of the solid lies where a surface is positive.
    pub(super) fn is_outside(&self, part: usize, surface: usize) -> bool {
        self.trees[part].is_outside(surface)
    }

    /// Number of cells along each axis.
    pub(super) fn cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].len() - 1)
    }

    /// Number of tiles along each axis.
    pub(super) fn tiles(&self) -> [usize; 3] {
        self.cells().map(|n| n.div_ceil(TILE))
    }

    /// The numbers of all tiles, in the order x fastest.
    pub(super) fn all(&self) -> std::ops::Range<usize> {
        0..self.tiles().iter().product()
    }

    /// The number of a tile in that order.
    pub(super) fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        let n = self.tiles();
        i + n[0] * (j + n[1] * k)
    }

    /// Whether a plane normal to an axis is both a node plane and a surface of the solid.
    pub(super) fn is_grid_plane(&self, axis: usize, at: f64) -> bool {
        let planes = self.surfaces.iter().zip(&self.grid_plane);
        let mut grid_plane = planes.filter_map(|(f, grid_plane)| grid_plane.and(f.plane));
        grid_plane.any(|p| p.axis == axis && p.at == at)
    }

    /// The feature edges of a surface near a tile; none if it has no feature edges at all.
    pub(super) fn creases(&self, surface: usize, [i, j, k]: [usize; 3]) -> Option<&[u32]> {
        let n = self.tiles();
        let found = self.creases[surface].get(&(i + n[0] * (j + n[1] * k)));
        (!self.creases[surface].is_empty()).then(|| found.map_or(&[][..], |f| f))
    }

    /// Whether a surface has feature edges.
    pub(super) fn has_creases(&self, surface: usize) -> bool {
        !self.creases[surface].is_empty()
    }

    /// The tile at a position in the order x fastest.
    pub(super) fn tile(&self, index: usize) -> [usize; 3] {
        let n = self.tiles();
        [index % n[0], index / n[0] % n[1], index / n[0] / n[1]]
    }

    /// First and one-past-last node of a tile with its halo.
    pub(super) fn nodes(&self, tile: [usize; 3]) -> [std::ops::Range<usize>; 3] {
        [0, 1, 2].map(|a| (tile[a] * TILE).saturating_sub(1)..((tile[a] + 1) * TILE + 2).min(self.axes[a].len()))
    }

    /// The cells of a tile itself, in the block of its nodes.
    pub(super) fn own(&self, tile: [usize; 3]) -> [std::ops::Range<usize>; 3] {
        let nodes = self.nodes(tile);
        [0, 1, 2].map(|a| {
            let (first, cells) = (tile[a] * TILE - nodes[a].start, nodes[a].len() - 1);
            first..(first + TILE).min(cells)
        })
    }

    /// The nodes of a tile with its halo.
    pub(super) fn block(&self, tile: [usize; 3]) -> Block<'_> {
        let n = self.nodes(tile);
        Block { axes: [0, 1, 2].map(|a| &self.axes[a][n[a].clone()]) }
    }

    /// The same with one node more on each side, where there is one.
    pub(super) fn padded(&self, tile: [usize; 3]) -> PaddedNodes<'_> {
        let n = self.nodes(tile);
        let from = n.each_ref().map(|n| n.start.saturating_sub(1));
        PaddedNodes {
            axes: [0, 1, 2].map(|a| {
                let axis = &self.axes[a];
                &axis[from[a]..(n[a].end + 1).min(axis.len())]
            }),
            before: [0, 1, 2].map(|a| (n[a].start - from[a]) as isize),
        }
    }

    /// The solid in a block by bounds alone; `None` if no surface crosses it.
    pub(super) fn local(&self, nodes: &[std::ops::Range<usize>; 3], b: &Aabb) -> Option<LocalSolid> {
        let (mut live, mut flat) = (Vec::new(), Vec::new());
        let mut signs = Vec::with_capacity(self.surfaces.len());
        for (f, surface) in self.surfaces.iter().enumerate() {
            signs.push(match (surface.plane, self.grid_plane[f]) {
                (Some(p), Some(at)) => {
                    let range = &nodes[p.axis];
                    if at > range.start && at + 1 < range.end {
                        flat.push((f, GridPlane { axis: p.axis, at: at - range.start, below: p.below }));
                        None
                    } else if (at <= range.start) == p.below {
                        Some(Sign::Positive)
                    } else {
                        Some(Sign::Negative)
                    }
                }
                _ => {
                    let r = surface.field.bound(b);
                    if r.hi <= 0.0 {
                        Some(Sign::Negative)
                    } else if r.lo > 0.0 {
                        Some(Sign::Positive)
                    } else {
                        None
                    }
                }
            });
        }
        // A surface may still not matter here; but it may matter to an adjacent tile in a cell that both have.
        let trees = self.trees.iter().map(|t| t.simplified(&|f| signs[f].unwrap_or(Sign::Varies(f))));
        let trees: Vec<CsgTree> = trees.collect();
        if trees.iter().all(|t| matches!(t, CsgTree::Intersection(of) | CsgTree::Union(of) if of.is_empty())) {
            return None;
        }
        live.extend((0..self.surfaces.len()).filter(|&f| signs[f].is_none() && !flat.iter().any(|(g, _)| *g == f)));
        let position = |f: usize| {
            let at = live.iter().position(|&g| g == f);
            at.or_else(|| Some(live.len() + flat.iter().position(|(g, _)| *g == f)?))
        };
        let trees = trees.iter().map(|t| t.simplified(&|f| position(f).map_or(Sign::Negative, Sign::Varies)));
        Some(LocalSolid { trees: trees.collect(), live, grid_planes: flat.into_iter().map(|(_, p)| p).collect() })
    }
}

impl LocalSolid {
    /// The part at a position, given in the lowest bit whether each surface is negative there: 0 is void, the parts count from 1.
    #[inline]
    pub(super) fn part(&self, negative: &impl Fn(usize) -> u64) -> u8 {
        let found = self.trees.iter().position(|t| t.solid(negative) & 1 == 1);
        found.map_or(0, |p| p as u8 + 1)
    }
}

/// What lies on the two sides of a triangle: 0 is void, the parts of the solid count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sides {
    /// The part that sees the triangle counter-clockwise from outside.
    pub behind: u8,
    /// The part on the other side.
    pub ahead: u8,
    /// Whether the triangle is a cut.
    pub cut: bool,
}

impl Sides {
    /// A triangle of the boundary of a part, towards void or another region.
    pub(super) fn cut(part: u8) -> Sides {
        Sides { behind: part, ahead: 0, cut: true }
    }

    /// A triangle as the boundary of a part; `None` if it is not of that.
    #[inline]
    pub(super) fn seen(&self, [a, b, c]: [u32; 3], part: u8) -> Option<[u32; 3]> {
        if self.behind == part {
            Some([a, b, c])
        } else if self.ahead == part {
            Some([a, c, b])
        } else {
            None
        }
    }
}

/// Refuses spacings and regions for which there is no grid.
fn check(solid: &Solid, edge: f64) -> Result<(), Fault> {
    if !(edge > 0.0 && edge.is_finite()) {
        return Err(Fault::new("edge", format!("{edge} mm; the grid spacing is a positive, finite length")));
    }
    let bounds = solid.region.bounds();
    if bounds.is_empty() {
        return Err(Fault::new("region", "the region is empty; there is nothing to fill"));
    }
    if !bounds.is_finite() {
        return Err(Fault::new(
            "region",
            "the region is not bounded; intersect it with a box, cylinder, sphere or mesh",
        ));
    }
    if let Some(width) = solid.transition.filter(|w| *w < edge) {
        let message = format!(
            "{edge} mm; a transition between lattices is only {width:.3} mm wide, less than a grid step. Widen it, or use \
             a finer edge"
        );
        return Err(Fault::new("edge", message));
    }
    Ok(())
}

/// Refuses grids that no machine runs through, whether there is a surface in them or not.
fn count(axes: &[Vec<f64>; 3], edge: f64) -> Result<(), Fault> {
    let cells: f64 = axes.iter().map(|n| (n.len() - 1) as f64).product();
    if cells <= MOST_CELLS {
        return Ok(());
    }
    let [x, y, z] = axes.each_ref().map(|n| n.len() - 1);
    let better = edge * (cells / MOST_CELLS).cbrt();
    Err(Fault::new(
        "edge",
        format!(
            "steps of {} mm make a grid of {x} × {y} × {z} cells, {cells:.1e}, and at most {MOST_CELLS:.0e} are possible; use an \
             edge of {} mm or more, or a smaller part",
            number(edge),
            number(rounded_up(1.001 * better))
        ),
    ))
}

/// The segments of a surface's feature edges that are kept, by the tiles near which they pass.
fn by_tile(grid: &SamplingGrid, creases: &Creases) -> HashMap<usize, Vec<u32>> {
    let mut found: HashMap<usize, Vec<u32>> = HashMap::new();
    let tiles = grid.tiles();
    for (i, s) in (0..).zip(&creases.segments) {
        let [p, q] = s.ends;
        if s.turn < SHARP && s.run < LONG * grid.step {
            continue;
        }
        let range = [0, 1, 2].map(|a| {
            let axis = &grid.axes[a];
            // The cells it passes, and two more on either side: as far beyond its border does a tile need edges.
            let cell = |x: f64| axis.partition_point(|n| *n <= x).saturating_sub(1);
            let (low, high) = (cell(p[a].min(q[a])), cell(p[a].max(q[a])));
            let tile = |c: usize| (c / TILE).min(tiles[a] - 1);
            tile(low.saturating_sub(2))..tile(high + 2) + 1
        });
        for k in range[2].clone() {
            for j in range[1].clone() {
                for t in range[0].clone() {
                    let tile = t + tiles[0] * (j + tiles[1] * k);
                    found.entry(tile).or_default().push(i);
                }
            }
        }
    }
    found
}

/// At least v, with two significant digits.
fn rounded_up(v: f64) -> f64 {
    let unit = 10f64.powf(v.log10().floor() - 1.0);
    ((v / unit).ceil() * unit * 1e12).round() / 1e12
}

/// The coordinates of the node planes normal to an axis: planes that are to be exact (`stops` at first), steps of about
/// `edge` between them, and one step of padding.
fn node_planes(
    solid: &Solid,
    surfaces: &[Surface],
    mut stops: Vec<f64>,
    edge: f64,
    axis: usize,
) -> Result<Vec<f64>, Fault> {
    let bounds = solid.region.bounds();
    let (lo, hi) = (bounds.min[axis], bounds.max[axis]);
    if (hi - lo) / edge > MOST_STEPS {
        return Err(Fault::new(
            "edge",
            format!(
                "{edge} mm cuts the region's {:.6} mm into {:.3e} steps; at most {MOST_STEPS:.0e} are possible",
                hi - lo,
                (hi - lo) / edge
            ),
        ));
    }
    if hi - lo < 0.05 * edge {
        let message = format!(
            "the region is only {:e} mm thick along {}, less than a twentieth of the grid step of {edge} mm; use an edge of {:e} mm or less",
            hi - lo,
            ["x", "y", "z"][axis],
            20.0 * (hi - lo)
        );
        return Err(Fault::new("edge", message));
    }
    stops.retain(|s| (lo..=hi).contains(s));
    stops.sort_by(f64::total_cmp);
    // Planes closer than a hundredth of a step would make needles; the others are treated like any surface.
    stops.dedup_by(|b, a| *b - *a < 0.01 * edge);
    // Other flat surfaces, and the points where a curved one touches its bounds, are best placed near the middle of a
    // step.
    let mut flats = vec![lo, hi];
    solid.region.planes(axis, &mut flats);
    let others = surfaces.iter().filter(|f| !f.cut);
    flats.extend(others.filter_map(|f| f.plane.filter(|p| p.axis == axis).map(|p| p.at)));
    flats.retain(|s| (lo..=hi).contains(s));
    for at in flats {
        // Not quite: an edge of a box that ran through the middles of cells would lie in their diagonal planes. No
        // two shares are the same, nor make one together.
        let share = [0.4, 0.5, 0.3][axis];
        if stops.iter().all(|s| (s - at).abs() > 0.75 * edge) {
            stops.extend([at - share * edge, at + (1.0 - share) * edge]);
        }
    }
    stops.sort_by(f64::total_cmp);
    if stops.is_empty() {
        stops.push(lo);
    }
    let mut nodes = Vec::new();
    let below = ((stops[0] - lo) / edge).max(0.0).ceil() + 1.0;
    nodes.extend((0..below as usize).map(|i| stops[0] - edge * (below - i as f64)));
    for w in stops.windows(2) {
        let steps = ((w[1] - w[0]) / edge - 1e-9).ceil().max(1.0);
        nodes.extend((0..steps as usize).map(|i| w[0] + (w[1] - w[0]) * (i as f64 / steps)));
    }
    let last = stops[stops.len() - 1];
    nodes.push(last);
    while nodes[nodes.len() - 1] <= hi {
        nodes.push(nodes[nodes.len() - 1] + edge);
    }
    nodes.push(nodes[nodes.len() - 1] + edge);
    Ok(nodes)
}

/// Share of the part's extent above which an edge is no advice.
const FEW: f64 = 0.02;

/// The least distance of points from the ends of their grid edges, as a share of the edge, that rounding to single precision
/// requires.
fn margin(axes: &[Vec<f64>; 3]) -> Result<f64, Fault> {
    let finest = axes.iter().flat_map(|n| n.windows(2).map(|w| w[1] - w[0])).fold(f64::INFINITY, f64::min);
    let farthest = axes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    // Eight units in the last position of the farthest f32 coordinate between any two points of an edge: rounding
    // keeps their order, hence every guarantee.
    let resolution = farthest * f64::from(f32::EPSILON);
    let needed = 8.0 * resolution / finest;
    if needed > 0.125 {
        let enough = 64.0 * farthest * f64::from(f32::EPSILON);
        let extent = axes.iter().filter_map(|n| Some(n.last()? - n.first()?)).fold(0.0, f64::max);
        let coarser =
            if enough < FEW * extent { format!(", or use an edge above {} mm", number(enough)) } else { String::new() };
        return Err(Fault::new(
            "edge",
            format!(
                "steps of {} mm at {} mm from the origin vanish in the files' single precision; move the part nearer to the \
                 origin{coarser}",
                number(finest),
                number(farthest),
            ),
        ));
    }
    Ok(needed.max(1.0 / 4096.0))
}
