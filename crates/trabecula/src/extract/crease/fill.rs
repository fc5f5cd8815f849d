//! The surface in cells in which a face with edges meets others.

use std::rc::Rc;

use super::patch::{Patch, Patches, Rim};
use super::rim::{Step, rims};
use super::side::{Part, Side};
use crate::extract::key::Key;
use crate::extract::knot::{Knots, Simplex, Spot, middle};
use geometry::math::{Vec3, add, scale};

/// How often a cell is filled anew from another point inside, if single precision muddles it.
const TRIES: usize = 6;

/// A tetrahedron of a fitted cell.
pub(super) struct Tet<'b> {
    /// Nodes and points: last that inside the volume, the others in the same order in both tetrahedra that share them.
    simplex: Simplex,
    right: bool,
    /// Whether the face is negative in it.
    inside: bool,
    /// Which of its sides, each across from a corner, lie on the face.
    walls: [bool; 4],
    /// The triangle of a side that it is over, if it is.
    base: Option<&'b Base>,
}

/// A triangle of a side of a cell, seen from outside.
pub(super) struct Base {
    pub ids: [usize; 3],
    pub left: bool,
    pub inside: bool,
    walls: [bool; 3],
    side: (usize, usize),
    /// The side and the corners among its own, if it is divided.
    pub divided: Option<(Rc<Side>, [usize; 3])>,
}

impl<'b> Tet<'b> {
    /// From a point to a triangle of a side.
    pub fn over(b: &'b Base, apex: usize) -> Tet<'b> {
        Tet {
            simplex: Simplex { nodes: [b.ids[0], b.ids[1], b.ids[2], apex], count: 4 },
            right: !b.left,
            inside: b.inside,
            walls: [false; 4],
            base: Some(b),
        }
    }

    /// The same, where the patch is the cone from the point.
    fn of_cone(b: &'b Base, apex: usize) -> Tet<'b> {
        let [p, q, r] = b.walls;
        Tet { walls: [p, q, r, false].map(|w| w && b.inside), ..Tet::over(b, apex) }
    }

    /// From a point to a triangle inside the cell, counter-clockwise seen from beyond it; `wall`: whether it lies on the face.
    pub fn inner(ids: [usize; 3], inside: bool, apex: usize, wall: bool) -> Tet<'b> {
        // The same order on both sides of it.
        let mut sorted = ids;
        sorted.sort_unstable();
        let [a, b, c] = sorted;
        let left = [[a, b, c], [b, c, a], [c, a, b]].contains(&ids);
        Tet {
            simplex: Simplex { nodes: [a, b, c, apex], count: 4 },
            right: !left,
            inside,
            walls: [false, false, false, wall],
            base: None,
        }
    }
}

/// The name of a spot inside a cell: the nodes and points that it lies between, and the faces that meet there.
type Inner = ([usize; 4], u64);

impl Knots<'_> {
    /// Fills a cell in which a face with edges meets others.
    pub fn fitted(&mut self, cell: [usize; 3], face: usize) {
        let bases = self.bases(cell, face);
        let steps = self.steps(cell, face);
        let rims = rims(&steps.iter().map(Step::path).collect::<Vec<_>>());
        let rims: Vec<(Rim, Vec<usize>)> = rims.iter().map(|keys| self.bare_rim(cell, keys)).collect();
        let (edges, of) = (self.edges, self.cell_of(cell, face));
        let patches: Vec<Patches> = match &rims[..] {
            [(rim, _)] => vec![edges.patches(of, rim, None)],
            _ => rims.iter().map(|r| edges.patches_among(of, &r.0)).collect(),
        };
        // The only cone of a cell bounds tetrahedra of its own.
        let any = patches.iter().any(|p| p.divided.is_some());
        let ways = [(true, any), (false, rims.len() > 1)];
        for (divided, _) in ways.into_iter().filter(|w| w.1) {
            let patches = patches.iter().map(|p| p.best(divided));
            let ids = rims.iter().map(|r| &r.1[..]);
            let all: Vec<(&[usize], &Patch)> = ids.zip(patches).collect();
            let tets = self.volumes(cell, &bases, &all);
            if tets.is_some_and(|t| self.is_filled(cell, face, &bases, &t)) {
                return;
            }
        }
        let apexes = match (&rims[..], &patches[..]) {
            ([], _) => self.apexes(cell, None),
            ([rim], [patches]) => {
                let center = middle(&rim.0.places);
                self.apexes(cell, Some([patches.cone.inner[0], center]))
            }
            _ => Vec::new(),
        };
        for apex in apexes {
            let apex = self.inner_point(cell, apex);
            let tets: Vec<Tet> = bases.iter().map(|b| Tet::of_cone(b, apex)).collect();
            if self.is_filled(cell, face, &bases, &tets) {
                return;
            }
        }
        self.walled(cell);
    }

    /// The points from which a cell is filled with a single cone, one after the other, as long as single precision muddles it.
    /// `rim`: the best point and the middle of the only rim.
    fn apexes(&self, cell: [usize; 3], rim: Option<[Vec3; 2]>) -> Vec<Vec3> {
        let node = self.nodes.index(cell);
        let [low, high] = [node, node + self.offset(7)].map(|n| self.nodes.place(n));
        let center = self.center_of(cell);
        let first = match rim {
            Some([best, middle]) => vec![best, scale(add(middle, center), 0.5)],
            None => vec![center],
        };
        let by_chance = (2..TRIES).map(|n| {
            let by = |a: usize| 0.3 * self.chance(3 * n + a, node) * (high[a] - low[a]);
            [0, 1, 2].map(|a| center[a] + by(a))
        });
        first.into_iter().chain(by_chance).collect()
    }

    /// Adds the surface in some tetrahedra of a cell, unless single precision muddles it.
    fn is_filled(&mut self, cell: [usize; 3], face: usize, bases: &[Base], tets: &[Tet]) -> bool {
        let first = self.extra.triangles.len();
        self.fill(cell, face, bases, tets);
        let is_muddled = self.muddled(first);
        if is_muddled {
            self.extra.triangles.truncate(first);
        }
        !is_muddled
    }

    /// The rim of a patch without the points where other faces cross it, and the numbers of its points.
    fn bare_rim(&mut self, cell: [usize; 3], rim: &[Key]) -> (Rim, Vec<usize>) {
        let number = |key: &Key| Some((*key, *self.fits.numbers.get(key)?));
        let (keys, ids): (Vec<Key>, Vec<usize>) = rim.iter().filter_map(number).unzip();
        (self.rim(cell, &keys), ids)
    }

    /// The triangles of the sides of a cell.
    fn bases(&self, cell: [usize; 3], face: usize) -> Vec<Base> {
        let node = self.nodes.index(cell);
        let mut bases = Vec::with_capacity(24);
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            let side = (low, axis);
            if let Some(fit) = self.fits.sides.get(&side) {
                bases.extend(fit.parts.iter().map(|p: &Part| Base {
                    ids: p.corners.map(|c| fit.corners[c].id),
                    left: p.left == upper,
                    inside: p.inside,
                    walls: p.walls,
                    side,
                    divided: Some((fit.clone(), p.corners)),
                }));
                continue;
            }
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for (step, right) in [(u, true), (v, false)] {
                bases.push(Base {
                    ids: [low, low + self.offset(step), low + self.offset(u | v)],
                    left: right == upper,
                    inside: self.signs.is_negative(face, low),
                    walls: [false; 3],
                    side,
                    divided: None,
                });
            }
        }
        bases
    }

    /// A new point inside a cell.
    pub(super) fn inner_point(&mut self, cell: [usize; 3], place: Vec3) -> usize {
        let node = self.nodes.index(cell);
        let around = [0, 1, 2, 3, 4, 5, 6, 7].map(|c| node + self.offset(c));
        let values = self.values_between(place, &around);
        self.add_point(place, None, values)
    }

    /// Adds the surface in some tetrahedra of a cell.
    fn fill(&mut self, cell: [usize; 3], face: usize, bases: &[Base], tets: &[Tet]) {
        let node = self.nodes.index(cell);
        let mut names: Vec<(Inner, u32)> = Vec::with_capacity(16);
        for tet in tets {
            let (negative, mixed) = self.others_of(&tet.simplex, face, tet.inside);
            let walls = tet.walls.map(|w| w.then_some(face));
            let wall = tet.walls.contains(&true) && self.holds(cell, negative | mixed);
            if !wall && self.holds(cell, negative) == self.holds(cell, negative | mixed) {
                continue;
            }
            if mixed == 0 {
                if !self.holds(cell, negative & !(1 << face)) {
                    self.fill_walls(node, face, bases, tet, &mut names);
                }
                continue;
            }
            for piece in self.cut(&tet.simplex, tet.right, (negative, mixed), walls) {
                if !self.holds(cell, piece.negative) {
                    continue;
                }
                for side in &piece.sides {
                    let Some(f) = side.face else { continue };
                    if self.holds(cell, piece.negative & !(1 << f)) {
                        continue;
                    }
                    let ring: Vec<u32> =
                        side.ring.iter().map(|s| self.spot_name(node, bases, tet, *s, &mut names)).collect();
                    let cut = self.grid.faces[self.local.live[f]].cut;
                    self.fan(&ring, cut);
                }
            }
        }
    }

    /// Adds the sides of a tetrahedron that lie on the face, where no other crosses it.
    fn fill_walls(&mut self, node: usize, face: usize, bases: &[Base], tet: &Tet, names: &mut Vec<(Inner, u32)>) {
        let cut = self.grid.faces[self.local.live[face]].cut;
        let sides = Simplex::sides(tet.right);
        for (ring, _) in sides.iter().zip(tet.walls).filter(|s| s.1) {
            let ring = ring.map(|s| self.spot_name(node, bases, tet, s, names));
            self.fan(&ring, cut);
        }
    }

    /// The vertex at a spot of a tetrahedron; `inner` are those inside the cell.
    fn spot_name(&mut self, node: usize, bases: &[Base], tet: &Tet, spot: Spot, inner: &mut Vec<(Inner, u32)>) -> u32 {
        let corners = (0..4).filter(|c| spot.corners >> c & 1 == 1);
        if spot.corners & 8 == 0 {
            let holds = |b: &&Base| corners.clone().all(|c| b.ids.contains(&tet.simplex.nodes[c]));
            if let Some(base) = tet.base.or_else(|| bases.iter().find(holds)) {
                let key = self.base_key(base, &tet.simplex, spot);
                return self.vertex(key);
            }
        }
        let mut ids = [usize::MAX; 4];
        for c in corners {
            ids[c] = self.first_of(tet.simplex.nodes[c]);
        }
        ids.sort_unstable();
        let name = (ids, spot.faces);
        if let Some((_, v)) = inner.iter().find(|(n, _)| *n == name) {
            return *v;
        }
        let place = self.spot_place(&tet.simplex, spot, 1.0);
        let v = self.push(Key::center(node, 7), place);
        inner.push((name, v));
        v
    }

    /// The name of a spot of a triangle in a side.
    fn base_key(&self, base: &Base, simplex: &Simplex, spot: Spot) -> Key {
        let Some((side, corners)) = &base.divided else {
            return self.key(simplex, spot);
        };
        let is_of = |c: &usize| {
            let mut of = (0..4).filter(|i| spot.corners >> i & 1 == 1);
            of.any(|i| simplex.nodes[i] == base.ids[*c])
        };
        let corners_of = (0..3).filter(is_of).fold(0, |w, c| w | 1 << c);
        let spot = Spot { corners: corners_of, ..spot };
        self.side_key(base.side, side, corners, spot)
    }
}
