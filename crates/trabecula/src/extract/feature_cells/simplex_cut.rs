//! Simplices of the grid, cut by the planes of surfaces.

use std::sync::LazyLock;

use super::FeatureCells;
use super::fragments::{CutVertex, Fragments};
use crate::extract::sign_words::bits;
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, cross, dot, scale, sub};

/// Corners of a simplex: nodes of the grid in ascending order; in fitted cells extra points as well.
#[derive(Clone, Copy)]
pub(in crate::extract) struct Simplex {
    pub nodes: [usize; 4],
    pub count: usize,
}

/// Amplitude of the perturbation at the nodes of a cell that self-intersects in single precision, as a multiple of the least distance
/// that rounding requires (1/4096 of a grid step near the origin).
const SHIFT: f64 = 8.0;
/// The greatest amplitude, in grid steps.
const MOST_SHIFT: f64 = 1.0 / 8.0;

impl Simplex {
    /// The corners of a tetrahedron's facets, each opposite a corner, counter-clockwise seen from outside. `right` is whether
    /// the tetrahedron is right-handed.
    pub fn facets(right: bool) -> [[u16; 3]; 4] {
        let facets = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        facets.map(|[a, b, c]| if right { [a, b, c] } else { [a, c, b] })
    }
}

impl FeatureCells<'_> {
    pub(in crate::extract) fn offset(&self, step: usize) -> usize {
        (0..3).filter(|a| step >> a & 1 == 1).map(|a| self.nodes.stride[a]).sum()
    }

    /// The axes along which a node lies beyond another one, by the difference of their indices.
    fn step(&self, offset: usize) -> usize {
        let mut left = offset;
        [2, 1, 0].into_iter().fold(0, |step, axis| {
            let beyond = left >= self.nodes.stride[axis];
            left -= if beyond { self.nodes.stride[axis] } else { 0 };
            step | usize::from(beyond) << axis
        })
    }

    /// The value of a surface at a node, kept away from zero: a plane through a node would leave needles.
    pub(in crate::extract) fn value(&self, surface: usize, node: usize) -> f64 {
        if let Some(point) = node.checked_sub(self.nodes.count()) {
            return self.divided_faces.value(point, surface);
        }
        let id = self.local.live[surface];
        let scale = self.grid.surfaces[id].lipschitz * self.grid.step;
        let (sample, least) = (self.samples[surface][node], self.grid.margin * scale);
        let v = f64::from(sample);
        let v = match self.perturbed_nodes.get(&node) {
            Some(attempt) => {
                v + (SHIFT * self.grid.margin).min(MOST_SHIFT) * scale * self.noise(id + 64 * attempt, node)
            }
            None => v,
        };
        if self.is_sample_negative(surface, sample) { v.min(-least) } else { v.max(least) }
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
        let mut corners = [0; 4];
        let count = listed(&mut corners, u64::from(vertex.corners));
        let first = simplex.nodes[corners[0]];
        let mut steps = [0; 3];
        for (step, c) in steps.iter_mut().zip(&corners[1..count]) {
            *step = self.step(simplex.nodes[*c] - first);
        }
        let mut surfaces = [0; 3];
        let met = listed(&mut surfaces, vertex.surfaces);
        VertexId::new(first, &steps[..count - 1], &surfaces[..met])
    }

    /// Barycentric coordinates of the point of a simplex where as many surfaces vanish as it has dimensions.
    pub(super) fn shares(&self, simplex: &Simplex, surfaces: &[usize]) -> [f64; 4] {
        let mut values = [[0.0; 4]; 3];
        for (v, f) in values.iter_mut().zip(surfaces) {
            *v = self.values(simplex, *f);
        }
        barycentric(&values, surfaces.len())
    }

    /// The values of a surface at the corners of a simplex.
    fn values(&self, simplex: &Simplex, surface: usize) -> [f64; 4] {
        [0, 1, 2, 3].map(|c| if c < simplex.count { self.value(surface, simplex.nodes[c]) } else { 0.0 })
    }

    /// The face of a simplex on which a cut vertex lies, and the surfaces that meet in it.
    fn part(&self, simplex: &Simplex, vertex: CutVertex) -> (Simplex, [usize; 3], usize) {
        let (mut corners, mut surfaces) = ([0; 4], [0; 3]);
        let count = listed(&mut corners, u64::from(vertex.corners));
        let met = listed(&mut surfaces, vertex.surfaces);
        let mut part = Simplex { nodes: [simplex.nodes[0]; 4], count };
        for (n, c) in part.nodes.iter_mut().zip(&corners[..count]) {
            *n = simplex.nodes[*c];
        }
        (part, surfaces, met)
    }

    /// Whether a surface is negative at a cut vertex, given the values of all surfaces at the corners.
    fn is_negative_at(&self, simplex: &Simplex, values: &[[f64; 4]], vertex: CutVertex, surface: usize) -> bool {
        if vertex.corners.is_power_of_two() {
            return values[surface][vertex.corners.trailing_zeros() as usize] <= 0.0;
        }
        let mut corners = [0; 4];
        let count = listed(&mut corners, u64::from(vertex.corners));
        if count == 2
            && let [a, b] = [corners[0], corners[1]].map(|c| simplex.nodes[c])
            && let Some(is) = self.sign_on_line([a, b], vertex.surfaces.trailing_zeros() as usize, surface)
        {
            return is;
        }
        let of = |f: usize| {
            let mut own = [0.0; 4];
            for (v, c) in own.iter_mut().zip(&corners[..count]) {
                *v = values[f][*c];
            }
            own
        };
        let mut met = [[0.0; 4]; 3];
        let mut dimensions = 0;
        for f in bits(vertex.surfaces).take(3) {
            met[dimensions] = of(f);
            dimensions += 1;
        }
        let (shares, values) = (barycentric(&met, dimensions), of(surface));
        (0..count).map(|c| shares[c] * values[c]).sum::<f64>() <= 0.0
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

    pub(in crate::extract) fn is_negative(&self, surface: usize, node: usize) -> bool {
        match node.checked_sub(self.nodes.count()) {
            Some(point) => self.divided_faces.value(point, surface) <= 0.0,
            None => self.is_sample_negative(surface, self.samples[surface][node]),
        }
    }

    /// Whether a sample counts as negative: what the words of signs say, without looking for the node's bit.
    fn is_sample_negative(&self, surface: usize, sample: f32) -> bool {
        sample < 0.0 || (sample == 0.0 && self.grid.surfaces[self.local.live[surface]].cut)
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

    /// Cuts a tetrahedron by the planes of the `mixed` surfaces. `lying_on` are surfaces on which its own facets lie, each
    /// opposite a corner.
    pub(in crate::extract) fn cut(
        &self,
        simplex: &Simplex,
        right: bool,
        (negative, mixed): (u64, u64),
        lying_on: [Option<usize>; 4],
        out: &mut Fragments,
    ) {
        out.start(negative, lying_on.into_iter().zip(Simplex::facets(right)));
        self.cut_by(simplex, mixed, out);
    }

    /// Cuts a triangle, whose corners run this way, by the lines of the `mixed` surfaces.
    pub(in crate::extract) fn cut_triangle(
        &self,
        simplex: &Simplex,
        corners: [u16; 3],
        (negative, mixed): (u64, u64),
        out: &mut Fragments,
    ) {
        out.start(negative, [(None, corners)]);
        self.cut_by(simplex, mixed, out);
    }

    fn cut_by(&self, simplex: &Simplex, mixed: u64, out: &mut Fragments) {
        out.values.resize(self.local.live.len(), [0.0; 4]);
        for f in bits(mixed) {
            out.values[f] = self.values(simplex, f);
        }
        for f in bits(mixed) {
            out.negative.clear();
            let (values, vertices) = (&out.values, &out.vertices);
            out.negative.extend(vertices.iter().map(|v| self.is_negative_at(simplex, values, *v, f)));
            out.cut(f);
        }
    }
}

/// The polygon in which the plane of one surface cuts a tetrahedron, right-handed or not, by the corners at which the surface is
/// negative: for each vertex the two corners between which it lies, as bits.
pub(in crate::extract) fn section(right: bool, negative: usize) -> &'static [u8] {
    static SECTIONS: LazyLock<[[Vec<u8>; 16]; 2]> = LazyLock::new(|| {
        let mut cut = Fragments::default();
        [false, true].map(|right| {
            core::array::from_fn(|negative| {
                cut.start(0, Simplex::facets(right).map(|ring| (None, ring)));
                cut.negative.clear();
                cut.negative.extend((0..4).map(|c| negative >> c & 1 == 1));
                cut.cut(0);
                let facets = cut.negative_facets().flat_map(|(_, _, ring)| ring);
                facets.map(|v| cut.vertices[usize::from(*v)].corners).collect()
            })
        })
    });
    &SECTIONS[usize::from(right)][negative]
}

/// Least barycentric coordinate of a point that stands for one beyond the simplex.
const INNER: f64 = 1e-3;
/// By how much barycentric coordinates of a point of the simplex may leave 0 to 1.
const ROUNDING: f64 = 1e-9;

/// Barycentric coordinates of the point of a simplex where as many functions vanish as it has dimensions, given their values at
/// the corners.
fn barycentric(values: &[[f64; 4]; 3], dimensions: usize) -> [f64; 4] {
    let w = match dimensions {
        0 => [1.0, 0.0, 0.0, 0.0],
        1 => {
            let [a, b, ..] = values[0];
            [b, -a, 0.0, 0.0]
        }
        2 => {
            let ([a0, a1, a2, _], [b0, b1, b2, _]) = (values[0], values[1]);
            let [x, y, z] = cross([a0, a1, a2], [b0, b1, b2]);
            [x, y, z, 0.0]
        }
        _ => {
            let others = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
            [0, 1, 2, 3].map(|skip| {
                let row = |r: usize| others[skip].map(|c| values[r][c]);
                let d = dot(row(0), cross(row(1), row(2)));
                if skip % 2 == 0 { d } else { -d }
            })
        }
    };
    let sum: f64 = w.iter().sum();
    let w = w.map(|x| x / sum);
    if w.iter().all(|x| (-ROUNDING..=1.0 + ROUNDING).contains(x)) {
        return w.map(|x| x.clamp(0.0, 1.0));
    }
    // Signs along a grid edge follow the order of its crossings, which values at its ends may contradict: the functions then vanish
    // beyond the simplex, and the nearest point within stands for that.
    // Functions that are multiples of each other vanish at no single point.
    let mut inner = [0.0; 4];
    for c in 0..=dimensions.min(3) {
        inner[c] = if w[c].is_nan() { 1.0 } else { w[c].clamp(INNER, 1.0) };
    }
    let sum: f64 = inner.iter().sum();
    inner.map(|x| x / sum)
}

/// Lists the first bits of a word; returns how many there are.
fn listed<const N: usize>(list: &mut [usize; N], word: u64) -> usize {
    bits(word).zip(list).map(|(bit, at)| *at = bit).count()
}
