//! Nodes of the boundary shifted so that the volume between its flat faces and the surface balances.
//!
//! A chord cuts a corner: the volume between a triangle and the surface is a third of its area times the sum of the distances at
//! the midpoints of its edges, up to higher order (the rule is exact for quadratics). Each node moves along the normal by the mean
//! distance over the faces around it, which moves as much volume.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::boundary_node_hash::BoundaryNodeHash;
use super::node_surfaces::{HELD, SurfaceSet, balanced, members, only, tangent};
use super::partition::images;
use super::prism_columns::FilledLayers;
use super::shaping::{GONE, GOOD, POOR, Shaping};
use super::tet_shape::shape;
use crate::implicit::Surface;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use geometry::progress::checkpoint;
use geometry::tetmesh::FACES;

/// Largest distance of a chord's midpoint from the surface that is believed, as a fraction of the chord: that of half a circle. A value
/// over a gradient that nearly vanishes says nothing.
const DEEPEST: f64 = 0.5;
/// Shifts of more than this part of the root of the area around a node are refused where they leave the region.
const FAR: f64 = 0.05;
/// Passes: each is of higher order than the one before, and in narrow necks the first leaves a part in a thousand.
const PASSES: usize = 3;
/// Shifts of less than this part of the longest edge do not make sheets cross.
const NEAR: f64 = 0.02;
/// The part of its shape that a badly shaped tetrahedron of layers or right beneath them keeps: they are flat, and none could move
/// otherwise.
const KEPT: f64 = 0.9;
/// The least part of a shift of layers that is tried.
const LEAST: f64 = 0.125;

/// Faces of the boundary and between domains, each once: its nodes, four times its tetrahedron (of the first domain) and the opposite
/// corner, and whether no other tetrahedron has it. Only faces whose nodes all `may` be on one are searched.
pub(crate) fn interfaces(
    tets: &[[u32; 4]],
    domain: &[u8],
    may: &(impl Fn(u32) -> bool + Sync),
) -> Vec<([u32; 3], u32, bool)> {
    let mut faces: Vec<([u32; 3], u32)> = tets
        .par_iter()
        .enumerate()
        .filter(|(_, t)| **t != GONE)
        .flat_map_iter(|(i, t)| {
            let on = t.map(may);
            FACES.iter().enumerate().filter(move |(_, f)| f.iter().all(|c| on[*c])).map(move |(k, f)| {
                let mut key = f.map(|c| t[c]);
                key.sort_unstable();
                (key, (4 * i + k) as u32)
            })
        })
        .collect();
    faces.par_sort_unstable();
    let differs =
        |same: &[([u32; 3], u32)]| same.len() == 1 || domain[same[0].1 as usize / 4] != domain[same[1].1 as usize / 4];
    let first = |same: &[([u32; 3], u32)]| {
        let at = same.iter().map(|f| f.1).min_by_key(|f| (domain[*f as usize / 4], *f)).unwrap_or(0);
        (same[0].0, at, same.len() == 1)
    };
    faces.chunk_by(|a, b| a.0 == b.0).filter(|same| differs(same)).map(first).collect()
}

/// Signed distances of points from a surface, to first order.
pub(crate) fn distances(surface: &Surface, points: &[Vec3]) -> impl Iterator<Item = f64> + use<> {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    surface.field.gradients(points, &mut v, &mut g);
    v.into_iter().zip(g).map(|(v, g)| v / norm(g).max(f64::MIN_POSITIVE))
}

/// The flat faces of curved surfaces, with their edges.
struct Chords {
    /// Each face and its surface.
    faces: Vec<([u32; 3], usize)>,
    /// Each surface and edge on it, ascending.
    edges: Vec<(usize, [u32; 2])>,
    /// Whether nodes on the creases of a surface are shifted too, where faces are as coarse as its facets.
    coarse: bool,
}

/// Sums over the faces of one surface at a node.
#[derive(Default)]
struct FaceSums {
    area: f64,
    /// Area times mean distance.
    volume: f64,
    /// Area along the normal.
    outward: Vec3,
}

/// The nodes of layers by column: those of a column are shifted together.
struct ColumnNodes<'a> {
    filled: &'a FilledLayers,
    /// The column of each node, if any.
    of: Vec<Option<u32>>,
}

impl<'a> ColumnNodes<'a> {
    fn new(filled: &'a FilledLayers, nodes: usize) -> ColumnNodes<'a> {
        let mut of = vec![None; nodes];
        for (i, column) in (0..).zip(&filled.columns) {
            column.iter().for_each(|n| of[*n as usize] = Some(i));
        }
        ColumnNodes { filled, of }
    }
}

impl Shaping<'_> {
    /// Shifts nodes on curved surfaces so that the volume of each domain is right to higher order than its chords: the distances that are left
    /// are balanced again, and nothing is shifted to where sheets that nearly touch would cross. Faces as `coarse` as the facets of a mesh,
    /// a region's, lie across its creases and balance too. Layers keep their heights.
    pub fn balance(&mut self, coarse: bool, layers: &FilledLayers) {
        let (chords, before) = (self.chords(coarse), self.nodes.clone());
        let columns = ColumnNodes::new(layers, before.len());
        for _ in 0..PASSES {
            let (layered, by): (Vec<_>, Vec<_>) =
                self.shifts(&chords, &before).into_iter().partition(|(n, _)| columns.of[*n as usize].is_some());
            self.shift_columns(&layered.into_iter().collect(), &columns);
            self.shift(by, &columns);
        }
        self.keep_apart(&before, &columns);
        let nodes = &self.nodes;
        let shape_of = |t: &[u32; 4]| if *t == GONE { f64::INFINITY } else { shape(t.map(|n| nodes[n as usize])) };
        self.shapes = self.tets.par_iter().map(shape_of).collect();
    }

    fn chords(&self, coarse: bool) -> Chords {
        let faces = interfaces(&self.tets, &self.domain, &|n| self.on[n as usize] != 0);
        // (surface, edge) of each face on a curved surface.
        let of = |f: &[u32; 3]| {
            let set = f.iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]);
            // Between the creases of a mesh, a region's, it is flat, and a single chord across them tells nothing.
            let flat = |s: &Surface| s.plane.is_some() || !coarse && s.cut && !s.creases.segments.is_empty();
            let smooth = |s: usize| !flat(&self.surfaces[s]);
            members(set).next().filter(|_| members(set).all(smooth))
        };
        let faces: Vec<([u32; 3], usize)> = faces.par_iter().filter_map(|(f, ..)| of(f).map(|s| (*f, s))).collect();
        let mut edges: Vec<(usize, [u32; 2])> =
            faces.par_iter().flat_map_iter(|([a, b, c], s)| [[*a, *b], [*a, *c], [*b, *c]].map(|e| (*s, e))).collect();
        edges.par_sort_unstable();
        edges.dedup();
        Chords { faces, edges, coarse }
    }

    /// Displacements of nodes, the first of their images, that balance the distances of chords; `before` is where they were before any.
    fn shifts(&self, Chords { faces, edges, coarse }: &Chords, before: &[Vec3]) -> Vec<(u32, Vec3)> {
        let found: Vec<f64> = edges
            .par_chunks(256)
            .flat_map_iter(|chunk| {
                let mut out = Vec::with_capacity(chunk.len());
                for same in chunk.chunk_by(|a, b| a.0 == b.0) {
                    let at = |n: u32| self.nodes[n as usize];
                    let points: Vec<Vec3> = same.iter().map(|(_, [a, b])| scale(add(at(*a), at(*b)), 0.5)).collect();
                    let lengths = same.iter().map(|(_, [a, b])| norm(sub(at(*a), at(*b))));
                    let off = distances(&self.surfaces[same[0].0], &points);
                    out.extend(off.zip(lengths).map(|(d, l)| d.clamp(-DEEPEST * l, DEEPEST * l)));
                }
                out
            })
            .collect();
        let distance = |s: usize, e: [u32; 2]| edges.binary_search(&(s, e)).map_or(0.0, |i| found[i]);
        let outward: Vec<Vec3> = faces.par_iter().map(|(f, s)| self.outward(*f, *s)).collect();
        // At each node on each surface, added in the order of the faces.
        let mut sums: FxHashMap<(u32, usize), FaceSums> = FxHashMap::default();
        for (([a, b, c], s), outward) in faces.iter().zip(outward) {
            let area = norm(outward);
            let mean = (distance(*s, [*a, *b]) + distance(*s, [*a, *c]) + distance(*s, [*b, *c])) / 3.0;
            for n in [a, b, c] {
                let first = images(&self.next, *n).min().unwrap_or(*n);
                let sum = sums.entry((first, *s)).or_default();
                *sum = FaceSums {
                    area: sum.area + area,
                    volume: sum.volume + area * mean,
                    outward: add(sum.outward, outward),
                };
            }
        }
        let mut at: Vec<((u32, usize), FaceSums)> = sums.into_iter().collect();
        at.sort_unstable_by_key(|a| a.0);
        let by_node: Vec<_> = at.chunk_by(|a, b| a.0.0 == b.0.0).collect();
        by_node
            .par_iter()
            .filter_map(|of| {
                let n = of[0].0.0;
                let p = self.nodes[n as usize];
                let wanted: Vec<(usize, f64)> = of.iter().map(|((_, s), sum)| (*s, -sum.volume / sum.area)).collect();
                // A node on a crease of one surface, which has no gradient there.
                let ((_, s), FaceSums { volume, outward, .. }) = of[0];
                let on_crease = *coarse && self.on[n as usize] == only(s) | HELD;
                let on_crease = on_crease && !self.surfaces[s].creases.segments.is_empty();
                let by = if on_crease {
                    scale(outward, -volume / dot(outward, outward))
                } else {
                    balanced(self.surfaces, self.on[n as usize], p, &wanted)?
                };
                let area: f64 = of.iter().map(|(_, sum)| sum.area).sum();
                let far = norm(sub(add(p, by), before[n as usize])) > FAR * area.sqrt();
                (!self.leaves_region(n, before[n as usize], add(p, by), far)).then_some((n, by))
            })
            .collect()
    }

    /// Twice the area of a face on a surface, along its normal: that outwards, where the surface has creases.
    fn outward(&self, face: [u32; 3], surface: usize) -> Vec3 {
        let [a, b, c] = face.map(|n| self.nodes[n as usize]);
        let area = cross(sub(b, a), sub(c, a));
        let surface = &self.surfaces[surface];
        if surface.creases.segments.is_empty() {
            return area;
        }
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        surface.field.gradients(&[scale(add(add(a, b), c), 1.0 / 3.0)], &mut v, &mut g);
        if dot(area, g[0]) < 0.0 { scale(area, -1.0) } else { area }
    }

    /// The least shape that a shift may leave a tetrahedron: in layers and right beneath them what these ask for.
    fn least(&self, t: u32, columns: &ColumnNodes) -> f64 {
        let before = self.shapes[t as usize];
        let FilledLayers { first, wanted, .. } = columns.filled;
        if let Some(wanted) = (t as usize).checked_sub(*first).and_then(|i| wanted.get(i)) {
            KEPT * before.min(*wanted)
        } else if self.tets[t as usize].iter().any(|n| columns.of[*n as usize].is_some()) {
            KEPT * before.min(POOR)
        } else {
            before.min(GOOD)
        }
    }

    /// Displaces the nodes of columns together, those further in along their surfaces and by their own shifts across these; less far at
    /// tetrahedra that would become too bad.
    fn shift_columns(&mut self, by: &FxHashMap<u32, Vec3>, columns: &ColumnNodes) {
        // The places of the nodes of each column, and their displacements.
        let mut moved: Vec<Vec<(Vec3, Vec3)>> = Vec::with_capacity(columns.filled.columns.len());
        for column in &columns.filled.columns {
            let whole = by.get(&column[0]).copied().unwrap_or_default();
            let places = column.iter().map(|n| {
                let p = self.nodes[*n as usize];
                let own = by.get(n).copied().unwrap_or_default();
                let along = tangent(self.surfaces, self.on[*n as usize], p).part(whole);
                (p, if *n == column[0] { whole } else { add(own, along) })
            });
            moved.push(places.collect());
        }
        let mut part = vec![1.0; moved.len()];
        let mut changed: Vec<u32> = (0..moved.len() as u32).collect();
        while !changed.is_empty() {
            checkpoint();
            for i in &changed {
                let nodes = columns.filled.columns[*i as usize].iter().zip(&moved[*i as usize]);
                nodes.for_each(|(n, (p, by))| self.nodes[*n as usize] = add(*p, scale(*by, part[*i as usize])));
            }
            let of = |i: &u32| columns.filled.columns[*i as usize].iter().flat_map(|n| &self.around[*n as usize]);
            let bad = |t: &&u32| shape(self.corners(**t)) < self.least(**t, columns);
            let bad: Vec<u32> = changed.par_iter().flat_map_iter(|i| of(i).filter(bad)).copied().collect();
            let nodes = bad.into_iter().flat_map(|t| self.tets[t as usize]);
            changed = nodes.filter_map(|n| columns.of[n as usize]).collect();
            changed.sort_unstable();
            changed.dedup();
            changed.retain(|i| part[*i as usize] > 0.0);
            let shorter = |part: f64| if part > LEAST { 0.5 * part } else { 0.0 };
            changed.iter().for_each(|i| part[*i as usize] = shorter(part[*i as usize]));
        }
    }

    /// Displaces nodes with their images where no shape below `GOOD` gets worse.
    fn shift(&mut self, shifts: Vec<(u32, Vec3)>, columns: &ColumnNodes) {
        for (n, by) in shifts {
            let all: Vec<u32> = images(&self.next, n).collect();
            let shifted = |s: &Self| {
                let of = all.iter().flat_map(|n| s.around[*n as usize].iter());
                of.map(|t| shape(s.corners(*t)) / s.least(*t, columns)).fold(f64::INFINITY, f64::min)
            };
            let old: Vec<Vec3> = all.iter().map(|n| self.nodes[*n as usize]).collect();
            all.iter().for_each(|n| self.nodes[*n as usize] = add(self.nodes[*n as usize], by));
            if shifted(self) < 1.0 {
                all.iter().zip(old).for_each(|(n, p)| self.nodes[*n as usize] = p);
            }
        }
    }

    /// Puts nodes back where sheets of the boundary cross that were shifted farther than they may nearly touch.
    fn keep_apart(&mut self, before: &[Vec3], columns: &ColumnNodes) {
        let shift = |n: usize| norm(sub(self.nodes[n], before[n]));
        let most = (0..before.len()).into_par_iter().map(shift).reduce(|| 0.0, f64::max);
        if most == 0.0 {
            return;
        }
        let node_hash = BoundaryNodeHash::new(self);
        let mut moved: Vec<u32> =
            (0..before.len() as u32).filter(|n| shift(*n as usize) > NEAR * node_hash.edge).collect();
        while !moved.is_empty() {
            checkpoint();
            let crossing = self.crossing_nodes(&node_hash.near_to(&moved, self));
            moved = self.put_back(crossing, before, columns);
        }
    }

    /// Puts nodes back, and those about them where shapes become worse; which there were.
    fn put_back(&mut self, mut nodes: Vec<u32>, before: &[Vec3], columns: &ColumnNodes) -> Vec<u32> {
        let mut back = Vec::new();
        while let Some(n) = nodes.pop() {
            let column = columns.of[n as usize].map_or(&[][..], |i| &columns.filled.columns[i as usize]);
            for n in images(&self.next, n).chain(column.iter().copied()) {
                let old = core::mem::replace(&mut self.nodes[n as usize], before[n as usize]);
                if old != before[n as usize] {
                    back.push(n);
                    let worse = |t: &&u32| shape(self.corners(**t)) < self.least(**t, columns);
                    let worse = self.around[n as usize].iter().filter(worse);
                    nodes.extend(worse.flat_map(|t| self.tets[*t as usize]));
                }
            }
        }
        back
    }

    /// Whether a displacement takes a node through a plane of the region, however little, or `far` through another of its surfaces.
    fn leaves_region(&self, n: u32, p: Vec3, to: Vec3, far: bool) -> bool {
        let on = self.on[n as usize];
        let through = |s: &Surface| match s.plane {
            Some(plane) => plane.is_left(p, to),
            None => far && s.field.value(p) <= 0.0 && s.field.value(to) > 0.0,
        };
        (0..).zip(self.surfaces).any(|(i, s)| s.cut && on & only(i) == 0 && through(s))
    }
}
