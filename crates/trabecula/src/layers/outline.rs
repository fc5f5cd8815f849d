//! The topology of a section: where surfaces cross the sides of polygons, and how these points are joined inside.
//!
//! Along a side of a polygon every surface changes sign at most once. Its root on the side is a vertex of the contour if the
//! solid begins or ends there, which both polygons at the side see alike. Inside, the end of each stretch of solid is joined to a
//! beginning by chords that do not cross: so contours are closed and simple before anything is known of their shape.

use rustc_hash::FxHashMap;

use super::leaf_cells::{LeafCells, SignedNode};
use super::plane_grid::{PlaneGrid, PlaneNode};
use geometry::layer::{Point, length};

const NONE: u32 = u32::MAX;

/// A root of a surface on a side.
pub(super) struct SurfaceRoot {
    /// The ends of the side, in order.
    pub side: [PlaneNode; 2],
    pub surface: u32,
    /// Position from the first end (0) to the second (1).
    pub at: f64,
    /// Whether the surface is not positive at the first end.
    pub falls: bool,
    /// The gradient in the plane, per mm.
    pub gradient: Point,
    /// The next root on the same side.
    next: u32,
}

impl SurfaceRoot {
    /// Its position, mm.
    pub fn position(&self, grid: &PlaneGrid) -> Point {
        let [a, b] = self.side.map(|n| grid.position(n));
        [a[0] + self.at * (b[0] - a[0]), a[1] + self.at * (b[1] - a[1])]
    }
}

/// A side of a polygon on which a surface changes sign.
struct CrossedEdge {
    /// Its first root.
    head: u32,
    /// Whether the polygon has the solid on its left along the side as it is numbered.
    forward: bool,
    /// Signs of the block's live surfaces where the polygon's boundary enters and leaves it.
    signs: [u64; 2],
}

/// A polygon that surfaces cross.
struct CrossedPolygon {
    block: u32,
    /// One past its last side.
    end: u32,
    bounds: [Point; 2],
}

/// A chord of a polygon, solid on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    /// The roots that it joins.
    pub ends: [u32; 2],
    /// Least and greatest coordinates of the polygon.
    pub bounds: [Point; 2],
}

/// The roots on a side, from its first.
fn chain(roots: &[SurfaceRoot], head: u32) -> impl Iterator<Item = u32> {
    let some = |r: u32| (r != NONE).then_some(r);
    std::iter::successors(some(head), move |r| some(roots[*r as usize].next))
}

/// Roots and polygons of a layer.
#[derive(Default)]
pub(super) struct Outline {
    pub roots: Vec<SurfaceRoot>,
    heads: FxHashMap<[PlaneNode; 2], u32>,
    sides: Vec<CrossedEdge>,
    polygons: Vec<CrossedPolygon>,
}

impl Outline {
    /// Adds a polygon, counter-clockwise.
    pub fn add(&mut self, cells: &LeafCells, grid: &PlaneGrid, block: u32, corners: &[SignedNode]) {
        let of = &cells.blocks[block as usize];
        let first = self.sides.len();
        for (i, &(a, from)) in corners.iter().enumerate() {
            let (b, to) = corners[(i + 1) % corners.len()];
            let changed = from ^ to;
            if changed == 0 || (changed.is_power_of_two() && of.solid(from) == of.solid(to)) {
                continue;
            }
            let forward = a < b;
            let side = if forward { [a, b] } else { [b, a] };
            let signs = if forward { from } else { to };
            let mut head = self.heads.get(&side).copied().unwrap_or(NONE);
            let mut left = changed;
            while left != 0 {
                let f = left.trailing_zeros() as usize;
                left &= left - 1;
                let surface = of.live[f] as u32;
                if chain(&self.roots, head).any(|r| self.roots[r as usize].surface == surface) {
                    continue;
                }
                let [low, high] = side.map(|n| cells.value(block, n, f));
                let at = low / (low - high);
                let at = if at.is_finite() { at.clamp(0.01, 0.99) } else { 0.5 };
                let falls = signs >> f & 1 == 1;
                self.roots.push(SurfaceRoot { side, surface, at, falls, gradient: [0.0; 2], next: head });
                head = (self.roots.len() - 1) as u32;
            }
            self.heads.insert(side, head);
            self.sides.push(CrossedEdge { head, forward, signs: [from, to] });
        }
        if self.sides.len() > first {
            let ends = corners.iter().map(|c| grid.position(c.0));
            let bounds = ends.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
                [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
            });
            self.polygons.push(CrossedPolygon { block, end: self.sides.len() as u32, bounds });
        }
    }

    /// Separates the roots of each side by at least `gap` (mm) from each other and from its ends, in an order that ties do not
    /// change.
    pub fn separate(&mut self, grid: &PlaneGrid, gap: f64) {
        let share = |root: &SurfaceRoot, count: usize| {
            let [a, b] = root.side.map(|n| grid.position(n));
            (gap / length([b[0] - a[0], b[1] - a[1]])).min(0.4 / (count + 1) as f64)
        };
        for &head in self.heads.values().filter(|h| **h != NONE) {
            let root = &mut self.roots[head as usize];
            if root.next == NONE {
                let share = share(root, 1);
                root.at = root.at.clamp(share, 1.0 - share);
                continue;
            }
            let mut chain: Vec<u32> = chain(&self.roots, head).collect();
            chain.sort_by(|a, b| {
                let [a, b] = [a, b].map(|r| &self.roots[*r as usize]);
                a.at.total_cmp(&b.at).then(a.surface.cmp(&b.surface))
            });
            let share = share(&self.roots[head as usize], chain.len());
            let mut least = share;
            for r in &chain {
                let at = &mut self.roots[*r as usize].at;
                *at = at.max(least);
                least = *at + share;
            }
            let mut most = 1.0 - share;
            for r in chain.iter().rev() {
                let at = &mut self.roots[*r as usize].at;
                *at = at.min(most);
                most = *at - share;
            }
        }
    }

    /// The chords in all polygons. Every root that bounds the solid begins one and ends one.
    pub fn chords(&self, cells: &LeafCells) -> Vec<Chord> {
        let mut chords = Vec::new();
        let (mut first, mut passed) = (0, Vec::new());
        for polygon in &self.polygons {
            passed.clear();
            for side in &self.sides[first..polygon.end as usize] {
                self.pass(cells, polygon.block, side, &mut passed);
            }
            first = polygon.end as usize;
            self.pair(&passed, polygon.bounds, &mut chords);
        }
        chords
    }

    /// Lists the roots at which the solid begins (true) or ends along a side.
    fn pass(&self, cells: &LeafCells, block: u32, side: &CrossedEdge, out: &mut Vec<(u32, bool)>) {
        let of = &cells.blocks[block as usize];
        let [from, to] = side.signs;
        if (from ^ to).is_power_of_two() {
            let f = (from ^ to).trailing_zeros() as usize;
            let own = |r: &u32| self.roots[*r as usize].surface as usize == of.live[f];
            out.extend(chain(&self.roots, side.head).find(own).map(|root| (root, of.solid(to))));
            return;
        }
        let mut roots: Vec<(f64, u32, u64)> = Vec::new();
        for r in chain(&self.roots, side.head) {
            let root = &self.roots[r as usize];
            if let Ok(f) = of.live.binary_search(&(root.surface as usize))
                && (from ^ to) >> f & 1 == 1
            {
                roots.push((root.at, r, 1 << f));
            }
        }
        roots.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !side.forward {
            roots.reverse();
        }
        let mut signs = from;
        for (_, root, bit) in roots {
            let before = of.solid(signs);
            signs ^= bit;
            if of.solid(signs) != before {
                out.push((root, !before));
            }
        }
    }

    /// Joins ends of solid to beginnings: those of the same surface, if such chords do not cross; else each stretch of solid is cut
    /// off by itself.
    fn pair(&self, passed: &[(u32, bool)], bounds: [Point; 2], chords: &mut Vec<Chord>) {
        let n = passed.len();
        if let [a, b] = passed {
            let ends = if a.1 { [b.0, a.0] } else { [a.0, b.0] };
            return chords.push(Chord { ends, bounds });
        }
        let surface = |i: usize| self.roots[passed[i].0 as usize].surface;
        let twin = |i: usize| {
            let mut others = (0..n).filter(|j| *j != i && surface(*j) == surface(i));
            others.next().filter(|j| passed[*j].1 != passed[i].1 && others.next().is_none())
        };
        let twins: Vec<Option<usize>> = (0..n).map(twin).collect();
        let crosses = |i: usize, j: usize| {
            let [a, b] = if i < j { [i, j] } else { [j, i] };
            (a + 1..b).any(|k| twins[k].is_some_and(|t| t < a || t > b))
        };
        let same = (0..n).all(|i| twins[i].is_some_and(|j| !crosses(i, j)));
        for i in (0..n).filter(|i| !passed[*i].1) {
            // The solid that ends at i began at the root before it.
            let other = if same { twins[i] } else { None };
            let j = other.unwrap_or((i + n - 1) % n);
            chords.push(Chord { ends: [passed[i].0, passed[j].0], bounds });
        }
    }
}
