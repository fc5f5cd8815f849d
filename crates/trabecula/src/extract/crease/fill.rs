//! The surface in cells in which a face with edges meets others.

use std::rc::Rc;

use super::rim::{Step, rims};
use super::side::{Part, Side};
use crate::extract::by::By;
use crate::extract::key::Key;
use crate::extract::knot::{Knots, Simplex, Spot, middle};
use crate::field::Field;
use crate::math::{Vec3, add, scale, sub};

/// What is between patches that are kept apart is smaller than the cell by one of these.
const INNER: [f64; 6] = [0.9, 0.75, 0.6, 0.5, 0.4, 0.25];
/// How often a cell is filled anew from another point inside, if single precision muddles it.
const TRIES: usize = INNER.len();

/// A tetrahedron of a fitted cell.
struct Tet {
    /// Nodes and points: those of a side of the cell first.
    simplex: Simplex,
    right: bool,
    /// Whether the face is negative in it.
    inside: bool,
    /// Which of its sides, each across from a corner, lie on the face.
    walls: [bool; 4],
    /// The corners that lie in the side, as bits.
    outer: u8,
    /// The side, and its corners among the side's if it is divided.
    side: (usize, usize),
    divided: Option<(Rc<Side>, [usize; 3])>,
}

/// A triangle of a side of a cell, seen from outside.
struct Base {
    ids: [usize; 3],
    left: bool,
    inside: bool,
    walls: [bool; 3],
    side: (usize, usize),
    divided: Option<(Rc<Side>, [usize; 3])>,
}

/// The name of a spot inside a cell: the nodes and points that it lies between, and the faces that meet there.
type Inner = ([usize; 4], u64);

impl Knots<'_> {
    /// Fills a cell in which a face with edges meets others.
    pub fn fitted(&mut self, cell: [usize; 3], face: usize) {
        let node = self.nodes.index(cell);
        let bases = self.bases(cell, face);
        let steps = self.steps(cell, face);
        let rims = rims(&steps.iter().map(Step::path).collect::<Vec<_>>());
        let ends = [node, node + self.offset(7)].map(|n| self.nodes.place(n));
        let center = self.center_of(cell);
        let field = self.grid.faces[self.local.live[face]].field.clone();
        let rim = match &rims[..] {
            [keys] => Some(self.rim(cell, keys)),
            _ => None,
        };
        let (edges, of) = (self.edges, self.cell_of(cell, face));
        let (mut solid, mut shares) = (false, INNER);
        if rims.len() > 1 {
            solid = field.value(center) <= 0.0;
            shares = self.shares_by_fit(&bases, center, solid, &*field);
        }
        let first = self.extra.triangles.len();
        for attempt in 0..TRIES {
            let tets = if rims.len() > 1 {
                self.apart(cell, &bases, center, solid, shares[attempt])
            } else {
                let apex = match (attempt, &rim) {
                    (0, None) => center,
                    (0, Some(rim)) => edges.apex(of, rim, None).0,
                    (1, Some(rim)) => scale(add(middle(&rim.places), center), 0.5),
                    _ => {
                        let by = [0, 1, 2].map(|a| self.chance(3 * attempt + a, node));
                        let size = sub(ends[1], ends[0]);
                        [0, 1, 2].map(|a| center[a] + 0.3 * by[a] * size[a])
                    }
                };
                self.cone_of(cell, &bases, apex)
            };
            self.extra.triangles.truncate(first);
            self.fill(cell, face, &tets);
            if !self.muddled(first) {
                return;
            }
        }
        self.extra.triangles.truncate(first);
        self.walled(cell, &INNER);
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
    fn inner_point(&mut self, cell: [usize; 3], place: Vec3) -> usize {
        let node = self.nodes.index(cell);
        let around = [0, 1, 2, 3, 4, 5, 6, 7].map(|c| node + self.offset(c));
        let values = self.values_between(place, &around);
        self.add_point(place, None, values)
    }

    /// The tetrahedra from a point to all sides of a cell.
    fn cone_of(&mut self, cell: [usize; 3], bases: &[Base], apex: Vec3) -> Vec<Tet> {
        let apex = self.inner_point(cell, apex);
        let tet = |b: &Base| Tet {
            simplex: Simplex {
                nodes: [b.ids[0], b.ids[1], b.ids[2], apex],
                count: 4,
            },
            right: !b.left,
            inside: b.inside,
            walls: [b.walls[0], b.walls[1], b.walls[2], false].map(|w| w && b.inside),
            outer: 7,
            side: b.side,
            divided: b.divided.clone(),
        };
        bases.iter().map(tet).collect()
    }

    /// How much smaller than the cell the one between its patches may be, those first with which these are nearest to the
    /// face.
    fn shares_by_fit(
        &self,
        bases: &[Base],
        center: Vec3,
        solid: bool,
        field: &dyn Field,
    ) -> [f64; TRIES] {
        let other = bases.iter().filter(|b| b.inside != solid);
        let rays: Vec<Vec3> = other
            .flat_map(|b| b.ids.map(|id| sub(self.place_of(id), center)))
            .collect();
        let mut off = vec![0.0; rays.len()];
        let mut all = INNER.map(|share| {
            let places: Vec<Vec3> = rays.iter().map(|r| add(center, scale(*r, share))).collect();
            field.values(&places, &mut off);
            (share, off.iter().fold(0.0f64, |m, d| m.max(d.abs())))
        });
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        all.map(|a| a.0)
    }

    /// The tetrahedra of a cell in which several patches keep apart: between its sides and those of a smaller cell in it,
    /// all of which is `solid` or not.
    fn apart(
        &mut self,
        cell: [usize; 3],
        bases: &[Base],
        center: Vec3,
        solid: bool,
        share: f64,
    ) -> Vec<Tet> {
        let mut inner: By<usize, usize> = By::default();
        let middle = self.inner_point(cell, center);
        let mut tets = Vec::with_capacity(4 * bases.len());
        for b in bases {
            let mut order = [0, 1, 2];
            let ids = b.ids.map(|id| self.first_of(id));
            order.sort_by_key(|i| ids[*i]);
            let even = (0..3).any(|k| order == [k, (k + 1) % 3, (k + 2) % 3]);
            let left = b.left == even;
            let out = order.map(|i| b.ids[i]);
            let within = out.map(|id| {
                let first = self.first_of(id);
                if let Some(at) = inner.get(&first) {
                    return *at;
                }
                let place = add(center, scale(sub(self.place_of(id), center), share));
                let at = self.inner_point(cell, place);
                inner.insert(first, at);
                at
            });
            // Corners of the three tetrahedra: how many are outer ones, and from where on the others run.
            for (n, odd) in [(3, false), (2, true), (1, false)] {
                // Outer corners 0..n, inner ones n-1..3.
                let mut corners: Vec<(usize, bool)> = (0..n).map(|i| (i, true)).collect();
                corners.extend((n - 1..3).map(|i| (i, false)));
                let wall = |across: usize| {
                    let rest: Vec<(usize, bool)> = (0..4)
                        .filter(|c| *c != across)
                        .map(|c| corners[c])
                        .collect();
                    if rest.iter().all(|c| !c.1) {
                        return !solid;
                    }
                    let mut of: Vec<usize> = rest.iter().map(|c| c.0).collect();
                    of.sort_unstable();
                    of.dedup();
                    match of[..] {
                        [i, j] => b.walls[order[3 - i - j]],
                        _ => false,
                    }
                };
                let nodes = [0, 1, 2, 3].map(|c| match corners[c] {
                    (i, true) => out[i],
                    (i, false) => within[i],
                });
                tets.push(Tet {
                    simplex: Simplex { nodes, count: 4 },
                    right: left == odd,
                    inside: b.inside,
                    walls: [0, 1, 2, 3].map(|c| b.inside && wall(c)),
                    outer: (1 << n) - 1,
                    side: b.side,
                    divided: (b.divided.as_ref()).map(|(s, c)| (s.clone(), order.map(|i| c[i]))),
                });
            }
            tets.push(Tet {
                simplex: Simplex {
                    nodes: [within[0], within[1], within[2], middle],
                    count: 4,
                },
                right: !left,
                inside: solid,
                walls: [false, false, false, solid && !b.inside],
                outer: 0,
                side: b.side,
                divided: None,
            });
        }
        tets
    }

    /// Adds the surface in some tetrahedra of a cell.
    fn fill(&mut self, cell: [usize; 3], face: usize, tets: &[Tet]) {
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
                    self.fill_walls(node, face, tet, &mut names);
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
                    let ring: Vec<u32> = side
                        .ring
                        .iter()
                        .map(|s| self.spot_name(node, tet, *s, &mut names))
                        .collect();
                    let cut = self.grid.faces[self.local.live[f]].cut;
                    self.fan(&ring, cut);
                }
            }
        }
    }

    /// Adds the sides of a tetrahedron that lie on the face, where no other crosses it.
    fn fill_walls(&mut self, node: usize, face: usize, tet: &Tet, names: &mut Vec<(Inner, u32)>) {
        let cut = self.grid.faces[self.local.live[face]].cut;
        let sides = Simplex::sides(tet.right);
        for (ring, _) in sides.iter().zip(tet.walls).filter(|s| s.1) {
            let ring = ring.map(|s| self.spot_name(node, tet, s, names));
            self.fan(&ring, cut);
        }
    }

    /// The vertex at a spot of a tetrahedron; `inner` are those inside the cell.
    fn spot_name(
        &mut self,
        node: usize,
        tet: &Tet,
        spot: Spot,
        inner: &mut Vec<(Inner, u32)>,
    ) -> u32 {
        if spot.corners & !tet.outer == 0 {
            let key = match &tet.divided {
                Some((side, corners)) => self.side_key(tet.side, side, corners, spot),
                None => self.key(&tet.simplex, spot),
            };
            return self.vertex(key);
        }
        let mut ids = [usize::MAX; 4];
        for c in (0..4).filter(|c| spot.corners >> c & 1 == 1) {
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
}
