//! Simplices of the grid, cut by the planes of surfaces.

use super::FeatureCells;
use crate::extract::sign_words::bits;
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, cross, scale, sub};

/// Corners of a simplex: nodes of the grid in ascending order; in fitted cells extra points as well.
#[derive(Clone, Copy)]
pub(in crate::extract) struct Simplex {
    pub nodes: [usize; 4],
    pub count: usize,
}

/// A vertex while a simplex is cut: the corners of the face in which it lies and the surfaces that meet there, as bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::extract) struct CutVertex {
    pub corners: u8,
    pub surfaces: u64,
}

/// A facet of a fragment, counter-clockwise seen from outside.
#[derive(Clone)]
pub(in crate::extract) struct FragmentFacet {
    /// The surface on which it lies; none if it is part of the simplex's own facet.
    pub surface: Option<usize>,
    pub ring: Vec<CutVertex>,
}

/// A convex fragment of a tetrahedron.
pub(in crate::extract) struct Fragment {
    /// The surfaces that are negative in it.
    pub negative: u64,
    pub facets: Vec<FragmentFacet>,
}

impl Fragment {
    /// The facets on surfaces that are negative in it: each facet between two fragments is one of these of just one of them.
    pub fn negative_facets(&self) -> impl Iterator<Item = (usize, &[CutVertex])> {
        let on = self.facets.iter().filter_map(|facet| Some((facet.surface?, &facet.ring[..])));
        on.filter(|(f, _)| self.negative >> f & 1 == 1)
    }
}

/// Amplitude of the perturbation at the nodes of a cell that self-intersects in single precision, in grid steps.
const SHIFT: f64 = 1.0 / 512.0;

/// A polygon cut in two.
pub(super) struct Halves {
    /// Where the surface is negative.
    pub(super) inside: Vec<CutVertex>,
    pub(super) outside: Vec<CutVertex>,
    /// The edge between them, directed as in the new facet of the inner part.
    edge: Option<(CutVertex, CutVertex)>,
}

/// The parts of a polygon on either side of a surface.
pub(super) enum Split {
    /// The surface is negative everywhere.
    Inside(Vec<CutVertex>),
    /// It is positive everywhere.
    Outside(Vec<CutVertex>),
    Both(Halves),
}

impl Simplex {
    /// The corners of a tetrahedron's facets, each opposite a corner, counter-clockwise seen from outside. `right` is whether
    /// the tetrahedron is right-handed.
    pub fn facets(right: bool) -> [[CutVertex; 3]; 4] {
        let facets = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        facets.map(|mut c: [u8; 3]| {
            if !right {
                c.swap(1, 2);
            }
            c.map(|c| CutVertex { corners: 1 << c, surfaces: 0 })
        })
    }
}

impl FeatureCells<'_> {
    pub(in crate::extract) fn offset(&self, step: usize) -> usize {
        (0..3).filter(|a| step >> a & 1 == 1).map(|a| self.nodes.stride[a]).sum()
    }

    /// The value of a surface at a node, kept away from zero: a plane through a node would leave needles.
    pub(in crate::extract) fn value(&self, surface: usize, node: usize) -> f64 {
        if let Some(point) = node.checked_sub(self.nodes.count()) {
            return self.divided_faces.value(point, surface);
        }
        let id = self.local.live[surface];
        let scale = self.grid.surfaces[id].lipschitz * self.grid.step;
        let (v, least) = (f64::from(self.samples[surface][node]), self.grid.margin * scale);
        let v = if self.perturbed_nodes.contains(&node) { v + SHIFT * scale * self.noise(id, node) } else { v };
        if self.signs.is_negative(surface, node) { v.min(-least) } else { v.max(least) }
    }

    /// A pseudo-random number between −1 and 1 that depends on the surface and the node alone.
    pub(in crate::extract) fn noise(&self, id: usize, node: usize) -> f64 {
        let mix = |h: u64, x: u64| (h ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        let bits = self.nodes.position(node).map(f64::to_bits);
        let h = mix(bits.into_iter().fold(id as u64 + 1, mix), 0x5851_f42d);
        (h >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(in crate::extract) fn simplex(&self, node: usize, steps: &[usize]) -> Simplex {
        let mut nodes = [node; 4];
        for (n, s) in nodes[1..].iter_mut().zip(steps) {
            *n = node + self.offset(*s);
        }
        Simplex { nodes, count: 1 + steps.len() }
    }

    pub(super) fn key_simplex(&self, key: VertexId) -> Simplex {
        let all = [0, 3, 6].map(|shift| (key.steps() >> shift & 7) as usize);
        let count = all.iter().take_while(|s| **s != 0).count();
        self.simplex(key.node(), &all[..count])
    }

    /// The id of a cut vertex of a simplex.
    pub(in crate::extract) fn key(&self, simplex: &Simplex, vertex: CutVertex) -> VertexId {
        let mut nodes = (0..4).filter(|c| vertex.corners >> c & 1 == 1).map(|c| simplex.nodes[c]);
        let Some(first) = nodes.next() else {
            return VertexId::new(0, &[], &[]);
        };
        let (mut steps, mut count) = ([0; 3], 0);
        let at = self.nodes.at(first);
        for n in nodes {
            let to = self.nodes.at(n);
            steps[count] = (0..3).filter(|a| to[*a] > at[*a]).map(|a| 1 << a).sum();
            count += 1;
        }
        let (mut surfaces, mut met) = ([0; 3], 0);
        for f in bits(vertex.surfaces).take(3) {
            surfaces[met] = f;
            met += 1;
        }
        VertexId::new(first, &steps[..count], &surfaces[..met])
    }

    /// Barycentric coordinates of the point of a simplex where as many surfaces vanish as it has dimensions.
    pub(super) fn shares(&self, simplex: &Simplex, surfaces: &[usize]) -> [f64; 4] {
        let v = |f: usize| {
            [0, 1, 2, 3].map(|c| if c < simplex.count { self.value(surfaces[f], simplex.nodes[c]) } else { 0.0 })
        };
        let w = match surfaces.len() {
            0 => [1.0, 0.0, 0.0, 0.0],
            1 => {
                let [a, b, ..] = v(0);
                [b, -a, 0.0, 0.0]
            }
            2 => {
                let ([a0, a1, a2, _], [b0, b1, b2, _]) = (v(0), v(1));
                let [x, y, z] = cross([a0, a1, a2], [b0, b1, b2]);
                [x, y, z, 0.0]
            }
            _ => {
                let m = [v(0), v(1), v(2)];
                [0, 1, 2, 3].map(|skip| {
                    let c: Vec<usize> = (0..4).filter(|c| *c != skip).collect();
                    let row = |r: usize| [m[r][c[0]], m[r][c[1]], m[r][c[2]]];
                    let d = geometry::math::dot(row(0), cross(row(1), row(2)));
                    if skip % 2 == 0 { d } else { -d }
                })
            }
        };
        let sum: f64 = w.iter().sum();
        w.map(|x| (x / sum).clamp(0.0, 1.0))
    }

    /// The face of a simplex on which a cut vertex lies, and the surfaces that meet in it.
    fn part(&self, simplex: &Simplex, vertex: CutVertex) -> (Simplex, [usize; 3], usize) {
        let mut part = Simplex { nodes: [simplex.nodes[0]; 4], count: 0 };
        for c in (0..4).filter(|c| vertex.corners >> c & 1 == 1) {
            part.nodes[part.count] = simplex.nodes[c];
            part.count += 1;
        }
        let mut surfaces = [0; 3];
        let mut met = 0;
        for f in bits(vertex.surfaces).take(3) {
            surfaces[met] = f;
            met += 1;
        }
        (part, surfaces, met)
    }

    /// Whether a surface is negative at a cut vertex.
    fn is_negative_at(&self, simplex: &Simplex, vertex: CutVertex, surface: usize) -> bool {
        let (part, surfaces, met) = self.part(simplex, vertex);
        if part.count == 2
            && let Some(is) = self.sign_on_line([part.nodes[0], part.nodes[1]], surfaces[0], surface)
        {
            return is;
        }
        let shares = self.shares(&part, &surfaces[..met]);
        let value = (0..part.count).map(|c| shares[c] * self.value(surface, part.nodes[c]));
        value.sum::<f64>() <= 0.0
    }

    /// The position of a node or an extra point.
    pub fn position_of(&self, node: usize) -> Vec3 {
        match node.checked_sub(self.nodes.count()) {
            Some(point) => self.divided_faces.position(point),
            None => self.nodes.position(node),
        }
    }

    /// The position of a cut vertex of a simplex. Points may be near to each other: a cut vertex between two keeps `apart`
    /// times the least distance of crossings from nodes from both.
    pub fn vertex_position(&self, simplex: &Simplex, vertex: CutVertex, apart: f64) -> Vec3 {
        let (part, surfaces, met) = self.part(simplex, vertex);
        let first = self.position_of(part.nodes[0]);
        if part.count == 1 {
            return first;
        }
        let mut shares = self.shares(&part, &surfaces[..met]);
        let mut positions = [first; 4];
        for c in 1..part.count {
            positions[c] = self.position_of(part.nodes[c]);
        }
        if part.count == 2 {
            let length = sub(positions[1], positions[0]).map(f64::abs).into_iter().fold(0.0, f64::max);
            let least = (apart * self.grid.margin * self.grid.step / length).min(1.0 / 3.0);
            shares[1] = shares[1].clamp(least, 1.0 - least);
        }
        (1..part.count).fold(positions[0], |p, c| add(p, scale(sub(positions[c], positions[0]), shares[c])))
    }

    /// The position of a vertex, a function of its id and the samples at its nodes alone.
    pub fn position(&self, key: VertexId) -> Vec3 {
        if let Some(position) = self.position_along_edge(key) {
            return position;
        }
        let simplex = self.key_simplex(key);
        let (mut surfaces, mut met) = ([0; 3], 0);
        for f in key.surfaces() {
            surfaces[met] = f;
            met += 1;
        }
        let shares = self.shares(&simplex, &surfaces[..met]);
        // Offsets from the first corner: coordinates that all corners share are exact.
        let first = self.nodes.position(simplex.nodes[0]);
        (1..simplex.count)
            .fold(first, |p, c| add(p, scale(sub(self.nodes.position(simplex.nodes[c]), first), shares[c])))
    }

    /// The crossings of surfaces with the edge between two nodes in order, as shares of it.
    pub(in crate::extract) fn crossings(&self, edge: &Simplex) -> Vec<(f64, usize)> {
        let mut found: Vec<(f64, usize)> = Vec::with_capacity(4);
        for f in 0..self.local.live.len() {
            let (a, b) = (self.value(f, edge.nodes[0]), self.value(f, edge.nodes[1]));
            if (a <= 0.0) != (b <= 0.0) {
                found.push((a / (a - b), f));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }

    /// The ids of the crossings of surfaces with the grid edge along `axis` from a node, in order.
    pub fn edge_points(&self, node: usize, axis: usize) -> Vec<(usize, VertexId)> {
        let edge = self.simplex(node, &[1 << axis]);
        let name = |(_, f)| (f, VertexId::new(node, &[1 << axis], &[f]));
        self.crossings(&edge).into_iter().map(name).collect()
    }

    fn is_negative(&self, surface: usize, node: usize) -> bool {
        match node.checked_sub(self.nodes.count()) {
            Some(point) => self.divided_faces.value(point, surface) <= 0.0,
            None => self.signs.is_negative(surface, node),
        }
    }

    /// The surfaces that are negative at all corners, and those that change sign between them.
    pub(in crate::extract) fn signs_of(&self, simplex: &Simplex) -> (u64, u64) {
        let (mut all, mut some) = (0, 0);
        for f in 0..self.local.live.len() {
            let count = simplex.nodes[..simplex.count].iter().filter(|n| self.is_negative(f, **n)).count();
            all |= u64::from(count == simplex.count) << f;
            some |= u64::from(count > 0) << f;
        }
        (all, some & !all)
    }

    /// The fragments of a tetrahedron between the planes of the `mixed` surfaces. `lying_on` are surfaces on which its own
    /// facets lie, each opposite a corner.
    pub(in crate::extract) fn cut(
        &self,
        simplex: &Simplex,
        right: bool,
        (negative, mixed): (u64, u64),
        lying_on: [Option<usize>; 4],
    ) -> Vec<Fragment> {
        let facets = Simplex::facets(right).into_iter().zip(lying_on);
        let facets = facets.map(|(ring, surface)| FragmentFacet { surface, ring: ring.to_vec() });
        let mut fragments = vec![Fragment { negative, facets: facets.collect() }];
        for f in bits(mixed) {
            let mut next = Vec::with_capacity(2 * fragments.len());
            for fragment in fragments {
                let room = fragment.facets.len() + 1;
                let (mut inside, mut outside) = (Vec::with_capacity(room), Vec::with_capacity(room));
                // The new edges, directed as in the new facet of the inner part.
                let mut edges: Vec<(CutVertex, CutVertex)> = Vec::new();
                for facet in fragment.facets {
                    let halves = match self.split(simplex, facet.ring, f) {
                        Split::Inside(ring) => {
                            inside.push(FragmentFacet { ring, ..facet });
                            continue;
                        }
                        Split::Outside(ring) => {
                            outside.push(FragmentFacet { ring, ..facet });
                            continue;
                        }
                        Split::Both(halves) => halves,
                    };
                    for (part, to) in [(halves.inside, &mut inside), (halves.outside, &mut outside)] {
                        if part.len() > 2 {
                            to.push(FragmentFacet { surface: facet.surface, ring: part });
                        }
                    }
                    edges.extend(halves.edge);
                }
                let mut ring = Vec::with_capacity(edges.len());
                if let Some(&(start, mut at)) = edges.first() {
                    ring.push(start);
                    while at != start && ring.len() <= edges.len() {
                        ring.push(at);
                        at = edges.iter().find(|e| e.0 == at).map_or(start, |e| e.1);
                    }
                }
                if !inside.is_empty() {
                    if ring.len() > 2 {
                        inside.push(FragmentFacet { surface: Some(f), ring: ring.clone() });
                    }
                    next.push(Fragment { negative: fragment.negative | 1 << f, facets: inside });
                }
                if !outside.is_empty() {
                    if ring.len() > 2 {
                        ring.reverse();
                        outside.push(FragmentFacet { surface: Some(f), ring });
                    }
                    next.push(Fragment { negative: fragment.negative, facets: outside });
                }
            }
            fragments = next;
        }
        fragments
    }

    /// The parts of a polygon between surfaces, with those that are negative there.
    pub(in crate::extract) fn split_by(
        &self,
        simplex: &Simplex,
        negative: u64,
        mixed: u64,
        ring: Vec<CutVertex>,
    ) -> Vec<(u64, Vec<CutVertex>)> {
        let mut fragments = vec![(negative, ring)];
        for f in bits(mixed) {
            let mut next = Vec::with_capacity(2 * fragments.len());
            for (negative, ring) in fragments {
                match self.split(simplex, ring, f) {
                    Split::Inside(ring) => next.push((negative | 1 << f, ring)),
                    Split::Outside(ring) => next.push((negative, ring)),
                    Split::Both(halves) => {
                        if halves.inside.len() > 2 {
                            next.push((negative | 1 << f, halves.inside));
                        }
                        if halves.outside.len() > 2 {
                            next.push((negative, halves.outside));
                        }
                    }
                }
            }
            fragments = next;
        }
        fragments
    }

    /// The parts of a polygon where a surface is negative and positive, and the edge between them, directed as in the new facet
    /// of the negative part.
    pub(super) fn split(&self, simplex: &Simplex, ring: Vec<CutVertex>, f: usize) -> Split {
        // A triangle has three corners, and one more for each of at most 64 surfaces.
        let signs = (0..).zip(&ring).fold(0u128, |w, (i, s)| w | u128::from(self.is_negative_at(simplex, *s, f)) << i);
        if signs == 0 {
            return Split::Outside(ring);
        }
        if signs.count_ones() as usize == ring.len() {
            return Split::Inside(ring);
        }
        let is_inside = |i: usize| signs >> i & 1 == 1;
        let room = ring.len() + 1;
        let (mut inside, mut outside) = (Vec::with_capacity(room), Vec::with_capacity(room));
        let (mut leave, mut enter) = (None, None);
        for i in 0..ring.len() {
            let next = (i + 1) % ring.len();
            (if is_inside(i) { &mut inside } else { &mut outside }).push(ring[i]);
            if is_inside(i) != is_inside(next) {
                let new = CutVertex {
                    corners: ring[i].corners | ring[next].corners,
                    surfaces: (ring[i].surfaces & ring[next].surfaces) | 1 << f,
                };
                inside.push(new);
                outside.push(new);
                *(if is_inside(i) { &mut leave } else { &mut enter }) = Some(new);
            }
        }
        Split::Both(Halves { inside, outside, edge: enter.zip(leave) })
    }
}
