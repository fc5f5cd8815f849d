//! The surface in fitted cells: cones, subvolumes, or as a last resort the fallback fill.

use super::boundary_loops::{Step, boundary_loops};
use super::divided_faces::FaceTriangle;
use super::loop_patch::{BoundaryLoop, LoopPatch};
use super::surface_patch::PatchCandidates;
use crate::extract::feature_cells::{CutVertex, FeatureCells, Simplex, middle, section};
use crate::extract::sampling_grid::Sides;
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, scale};

/// Most points from which a cell is filled in turn, if it self-intersects in single precision.
const TRIES: usize = 6;

/// A tetrahedron of a fitted cell.
pub(super) struct FittedTet<'b> {
    /// Nodes and points; the apex inside the volume comes last, the others in the same order in both tetrahedra that share
    /// them.
    simplex: Simplex,
    right: bool,
    /// Whether the surface is negative in it.
    inside: bool,
    /// Which of its facets, each opposite a corner, lie on the surface.
    on_patch: [bool; 4],
    /// The triangle of a cell face on which it stands, if it does.
    base: Option<&'b Base>,
}

/// A triangle of a cell face, seen from outside.
pub(super) struct Base {
    pub ids: [usize; 3],
    pub left: bool,
    pub inside: bool,
    on_patch: [bool; 3],
    face: (usize, usize),
    /// The number of the divided face and the triangle's corners in it, if the face is divided.
    pub divided: Option<(usize, [usize; 3])>,
}

impl<'b> FittedTet<'b> {
    /// From an apex to a triangle of a cell face.
    pub fn over(b: &'b Base, apex: usize) -> FittedTet<'b> {
        FittedTet {
            simplex: Simplex { nodes: [b.ids[0], b.ids[1], b.ids[2], apex], count: 4 },
            right: !b.left,
            inside: b.inside,
            on_patch: [false; 4],
            base: Some(b),
        }
    }

    /// The same where the patch is the cone from the apex.
    fn of_cone(b: &'b Base, apex: usize) -> FittedTet<'b> {
        let [p, q, r] = b.on_patch;
        FittedTet { on_patch: [p, q, r, false].map(|w| w && b.inside), ..FittedTet::over(b, apex) }
    }

    /// From an apex to a triangle inside the cell, counter-clockwise seen from beyond it. `on_patch` is whether it lies on the
    /// surface.
    pub fn inner(ids: [usize; 3], inside: bool, apex: usize, on_patch: bool) -> FittedTet<'b> {
        // The same order on both sides of the triangle.
        let mut sorted = ids;
        sorted.sort_unstable();
        let [a, b, c] = sorted;
        let left = [[a, b, c], [b, c, a], [c, a, b]].contains(&ids);
        FittedTet {
            simplex: Simplex { nodes: [a, b, c, apex], count: 4 },
            right: !left,
            inside,
            on_patch: [false, false, false, on_patch],
            base: None,
        }
    }
}

/// The id of a cut vertex inside a cell: the points between which it lies, and the surfaces that meet there.
type InnerVertexId = ([usize; 4], u64);

impl FeatureCells<'_> {
    /// Fills a fitted cell.
    pub fn fitted(&mut self, cell: [usize; 3], surface: usize) {
        let bases = self.bases(cell, surface);
        let steps = self.steps(cell, surface);
        let boundary_loops = boundary_loops(&steps.iter().map(Step::path).collect::<Vec<_>>());
        let boundary_loops: Vec<(BoundaryLoop, Vec<usize>)> =
            boundary_loops.iter().map(|keys| self.bare_loop(cell, keys)).collect();
        let (edges, of) = (self.edges, self.cell_of(cell, surface));
        let patches: Vec<PatchCandidates> = match &boundary_loops[..] {
            [(boundary_loop, _)] => vec![edges.patches(of, boundary_loop, None)],
            _ => boundary_loops.iter().map(|r| edges.patches_among(of, &r.0)).collect(),
        };
        // The cone over the only loop bounds tetrahedra with the cell's faces.
        let any = patches.iter().any(|p| p.divided.is_some());
        let routes = [(true, any), (false, boundary_loops.len() > 1)];
        for (divided, _) in routes.into_iter().filter(|w| w.1) {
            let patches = patches.iter().map(|p| p.best(divided));
            let ids = boundary_loops.iter().map(|r| &r.1[..]);
            let all: Vec<(&[usize], &LoopPatch)> = ids.zip(patches).collect();
            let tets = self.volumes(cell, &bases, &all);
            if tets.is_some_and(|t| self.is_filled(cell, surface, &bases, &t)) {
                return;
            }
        }
        let apexes = match (&boundary_loops[..], &patches[..]) {
            ([], _) => self.apexes(cell, None),
            ([boundary_loop], [patches]) => {
                let center = middle(&boundary_loop.0.positions);
                self.apexes(cell, Some([patches.cone.inner[0], center]))
            }
            _ => Vec::new(),
        };
        for apex in apexes {
            let apex = self.inner_point(cell, apex);
            let tets: Vec<FittedTet> = bases.iter().map(|b| FittedTet::of_cone(b, apex)).collect();
            if self.is_filled(cell, surface, &bases, &tets) {
                return;
            }
        }
        self.fallback_fill(cell);
    }

    /// The apexes from which a cell is filled with a single cone, in turn while the result self-intersects in single precision.
    /// `boundary_loop` holds the best apex and the centre of the only loop.
    fn apexes(&self, cell: [usize; 3], boundary_loop: Option<[Vec3; 2]>) -> Vec<Vec3> {
        let node = self.nodes.index(cell);
        let [low, high] = [node, node + self.offset(7)].map(|n| self.nodes.position(n));
        let center = self.center_of(cell);
        let first = match boundary_loop {
            Some([best, middle]) => vec![best, scale(add(middle, center), 0.5)],
            None => vec![center],
        };
        let by_chance = (2..TRIES).map(|n| {
            let by = |a: usize| 0.3 * self.noise(3 * n + a, node) * (high[a] - low[a]);
            [0, 1, 2].map(|a| center[a] + by(a))
        });
        first.into_iter().chain(by_chance).collect()
    }

    /// Adds the surface in some tetrahedra of a cell, unless it self-intersects in single precision.
    fn is_filled(&mut self, cell: [usize; 3], surface: usize, bases: &[Base], tets: &[FittedTet]) -> bool {
        let first = self.extra.triangles.len();
        self.fill(cell, surface, bases, tets);
        let failed = self.self_intersects_rounded(first);
        if failed {
            self.extra.triangles.truncate(first);
        }
        !failed
    }

    /// The boundary loop of a patch without the points where other surfaces cross it, and the numbers of its points.
    fn bare_loop(&mut self, cell: [usize; 3], boundary_loop: &[VertexId]) -> (BoundaryLoop, Vec<usize>) {
        let number = |key: &VertexId| Some((*key, *self.divided_faces.numbers.get(key)?));
        let (keys, ids): (Vec<VertexId>, Vec<usize>) = boundary_loop.iter().filter_map(number).unzip();
        (self.boundary_loop(cell, &keys), ids)
    }

    /// The triangles of the faces of a cell.
    fn bases(&self, cell: [usize; 3], surface: usize) -> Vec<Base> {
        let node = self.nodes.index(cell);
        let mut bases = Vec::with_capacity(24);
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            let face = (low, axis);
            if let Some(number) = self.divided_faces.number(face) {
                let fit = self.divided_faces.numbered(number);
                bases.extend(fit.parts.iter().map(|p: &FaceTriangle| Base {
                    ids: p.corners.map(|c| fit.corners[c].id),
                    left: p.left == upper,
                    inside: p.inside,
                    on_patch: p.on_contour,
                    face,
                    divided: Some((number, p.corners)),
                }));
                continue;
            }
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for (step, right) in [(u, true), (v, false)] {
                bases.push(Base {
                    ids: [low, low + self.offset(step), low + self.offset(u | v)],
                    left: right == upper,
                    inside: self.signs.is_negative(surface, low),
                    on_patch: [false; 3],
                    face,
                    divided: None,
                });
            }
        }
        bases
    }

    /// A new point inside a cell.
    pub(super) fn inner_point(&mut self, cell: [usize; 3], position: Vec3) -> usize {
        let node = self.nodes.index(cell);
        let around = [0, 1, 2, 3, 4, 5, 6, 7].map(|c| node + self.offset(c));
        self.add_point(position, None, |k, f| k.value_between(f, position, &around))
    }

    /// Adds the surface in some tetrahedra of a cell.
    fn fill(&mut self, cell: [usize; 3], surface: usize, bases: &[Base], tets: &[FittedTet]) {
        let node = self.nodes.index(cell);
        let mut names: Vec<(InnerVertexId, u32)> = Vec::with_capacity(16);
        let mut fragments = self.fragments.take();
        let mut ring: Vec<u32> = Vec::with_capacity(8);
        for tet in tets {
            let (negative, mixed) = self.others_of(&tet.simplex, surface, tet.inside);
            let on_surface = tet.on_patch.map(|w| w.then_some(surface));
            if !tet.on_patch.contains(&true) && self.is_uniform(cell, (negative, mixed)) {
                continue;
            }
            if mixed == 0 {
                let sides = self.sides(cell, negative, surface);
                if tet.inside && sides.behind != sides.ahead {
                    self.fill_patch(node, sides, bases, tet, &mut names);
                }
                continue;
            }
            if mixed.is_power_of_two() && !tet.on_patch.contains(&true) {
                let f = mixed.trailing_zeros() as usize;
                let sides = self.sides(cell, negative, f);
                if sides.behind == sides.ahead {
                    continue;
                }
                let pattern = (0..4).fold(0, |w, c| w | usize::from(self.is_negative(f, tet.simplex.nodes[c])) << c);
                let corners = section(tet.right, pattern).iter();
                let vertices = corners.map(|corners| CutVertex { corners: *corners, surfaces: mixed });
                ring.clear();
                ring.extend(vertices.map(|vertex| self.vertex_name(node, bases, tet, vertex, &mut names)));
                self.fan(&ring, sides);
                continue;
            }
            self.cut(&tet.simplex, tet.right, (negative, mixed), on_surface, &mut fragments);
            for (negative, f, facet) in fragments.negative_facets() {
                let sides = self.sides(cell, negative, f);
                if sides.behind == sides.ahead {
                    continue;
                }
                ring.clear();
                for v in facet {
                    let vertex = fragments.vertices[usize::from(*v)];
                    ring.push(self.vertex_name(node, bases, tet, vertex, &mut names));
                }
                self.fan(&ring, sides);
            }
        }
        self.fragments.set(fragments);
    }

    /// Adds the facets of a tetrahedron that lie on the surface, where no other surface crosses it.
    fn fill_patch(
        &mut self,
        node: usize,
        sides: Sides,
        bases: &[Base],
        tet: &FittedTet,
        names: &mut Vec<(InnerVertexId, u32)>,
    ) {
        let facets = Simplex::facets(tet.right);
        for (ring, _) in facets.iter().zip(tet.on_patch).filter(|s| s.1) {
            let ring = ring.map(|c| {
                let vertex = CutVertex { corners: 1 << c, surfaces: 0 };
                self.vertex_name(node, bases, tet, vertex, names)
            });
            self.fan(&ring, sides);
        }
    }

    /// The vertex at a cut vertex of a tetrahedron; `inner` are those inside the cell.
    fn vertex_name(
        &mut self,
        node: usize,
        bases: &[Base],
        tet: &FittedTet,
        vertex: CutVertex,
        inner: &mut Vec<(InnerVertexId, u32)>,
    ) -> u32 {
        let corners = (0..4).filter(|c| vertex.corners >> c & 1 == 1);
        if vertex.corners & 8 == 0 {
            let is_solid = |b: &&Base| corners.clone().all(|c| b.ids.contains(&tet.simplex.nodes[c]));
            if let Some(base) = tet.base.or_else(|| bases.iter().find(is_solid)) {
                let key = self.base_key(base, &tet.simplex, vertex);
                return self.vertex(key);
            }
        }
        let mut ids = [usize::MAX; 4];
        for c in corners {
            ids[c] = self.first_of(tet.simplex.nodes[c]);
        }
        ids.sort_unstable();
        let name = (ids, vertex.surfaces);
        if let Some((_, v)) = inner.iter().find(|(n, _)| *n == name) {
            return *v;
        }
        let position = self.vertex_position(&tet.simplex, vertex, 1.0);
        let v = self.push(VertexId::center(node, 7), position);
        inner.push((name, v));
        v
    }

    /// The id of a cut vertex of a triangle in a face.
    fn base_key(&self, base: &Base, simplex: &Simplex, vertex: CutVertex) -> VertexId {
        let Some((number, corners)) = &base.divided else {
            return self.key(simplex, vertex);
        };
        let face = self.divided_faces.numbered(*number);
        let is_of = |c: &usize| {
            let mut of = (0..4).filter(|i| vertex.corners >> i & 1 == 1);
            of.any(|i| simplex.nodes[i] == base.ids[*c])
        };
        let corners_of = (0..3).filter(is_of).fold(0, |w, c| w | 1 << c);
        let vertex = CutVertex { corners: corners_of, ..vertex };
        self.face_vertex_id(base.face, face, corners, vertex)
    }
}
