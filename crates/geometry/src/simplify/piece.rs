//! The part of a surface in one block: taken out of it, checked, simplified, given back.

use std::borrow::Cow;
use std::collections::HashSet;

use super::blocks::Blocks;
use super::collapse::{Motion, Simplification};
use super::deviation::Displacements;
use crate::math::{Aabb, Vec3, add, scale, sub};
use crate::mesh::{Mesh, degenerate, self_intersections};
use crate::remesh::edited_mesh::{EditedMesh, single};
use crate::remesh::half_edge_mesh::{HalfEdgeMesh, NONE};
use crate::remesh::{curve_order, kept_edges};
use crate::surface_mesh::SurfaceMesh;

/// A surface between two passes.
pub struct PassState<'a> {
    /// The surface as it is now: positions are in single precision from the second pass on.
    pub surface: Cow<'a, SurfaceMesh>,
    /// What is known of it; nothing before the first pass.
    pub known: Option<Tracked>,
}

/// What a pass hands to the next one.
#[derive(Default)]
pub struct Tracked {
    /// For each triangle, which of its edges are kept: bits 0, 1, 2.
    pub kept: Vec<u8>,
    /// How far the surface has moved, by triangle.
    pub displacements: Vec<Displacements>,
    /// How far kept edges have moved, by vertex, mm.
    pub kept_moved: Vec<f32>,
}

/// A block's triangles after a pass.
#[derive(Default)]
pub struct BlockResult {
    /// Their corners, vertices of the surface before the pass.
    pub triangles: Vec<[u32; 3]>,
    /// For each, whether it is a cut.
    pub cut: Vec<bool>,
    /// See [`Tracked`].
    pub kept: Vec<u8>,
    /// See [`Tracked`].
    pub displacements: Vec<Displacements>,
    /// Vertices that the block alone has: where they are now, and how far their kept edges have moved.
    pub moved: Vec<(u32, Vec3, f32)>,
}

/// The part of a surface in one block.
pub struct Piece {
    bounds: Aabb,
    mesh: Mesh,
    cut: Vec<bool>,
    /// Triangles and vertices of the surface that these were.
    triangles: Vec<u32>,
    vertices: Vec<u32>,
}

impl Piece {
    /// Takes a block's members out of a surface, in the order of a space-filling curve. `names`, of the number of vertices
    /// and all [`NONE`], is left so.
    pub fn new(surface: &SurfaceMesh, blocks: &Blocks, b: usize, names: &mut [u32]) -> Piece {
        let source = &surface.mesh;
        let order = curve_order(source, blocks.members(b).iter().copied());
        let mut piece = Piece {
            bounds: blocks.inside(b),
            mesh: Mesh::default(),
            cut: order.iter().map(|t| surface.cut[*t as usize]).collect(),
            triangles: order,
            vertices: Vec::new(),
        };
        for t in &piece.triangles {
            let triangle = source.triangles[*t as usize].map(|v| {
                let name = &mut names[v as usize];
                if *name == NONE {
                    *name = piece.vertices.len() as u32;
                    piece.vertices.push(v);
                    piece.mesh.vertices.push(single(source.vertices[v as usize]));
                }
                *name
            });
            piece.mesh.triangles.push(triangle);
        }
        for v in &piece.vertices {
            names[*v as usize] = NONE;
        }
        piece
    }

    /// Links the triangles; `None` if the surface is not closed, manifold and free of self-intersection in the block,
    /// `around` its faces too.
    pub fn sound(&self, around: &Aabb) -> Option<HalfEdgeMesh> {
        let half_edges = HalfEdgeMesh::open(self.mesh.triangles.clone(), self.mesh.vertices.len())?;
        // What touches the block has all its neighbours among the members.
        let touches = |positions: &[Vec3]| {
            let b = positions.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
            (0..3).all(|a| b.min[a] <= around.max[a] && around.min[a] <= b.max[a])
        };
        let position = |v: u32| self.mesh.vertices[v as usize];
        let open =
            |h: u32| half_edges.twin(h) == NONE && touches(&[position(half_edges.from(h)), position(half_edges.to(h))]);
        if (0..3 * self.mesh.triangles.len() as u32).any(open) {
            return None;
        }
        let mut fans = vec![0u32; self.mesh.vertices.len()];
        self.mesh.triangles.as_flattened().iter().for_each(|v| fans[*v as usize] += 1);
        let pinched = |v: u32| touches(&[position(v)]) && half_edges.leaving(v).count() != fans[v as usize] as usize;
        if (0..fans.len() as u32).any(pinched) {
            return None;
        }
        let distinct: HashSet<[u64; 3]> = self.mesh.vertices.iter().map(|p| p.map(f64::to_bits)).collect();
        let sound = distinct.len() == self.mesh.vertices.len()
            && !(0..self.mesh.triangles.len()).any(|t| degenerate(&self.mesh, t))
            && self_intersections(&self.mesh, 1) == 0;
        sound.then_some(half_edges)
    }

    /// Links the triangles of a surface that is known to be sound.
    pub fn linked(&self) -> Option<HalfEdgeMesh> {
        HalfEdgeMesh::open(self.mesh.triangles.clone(), self.mesh.vertices.len())
    }

    /// What to start from.
    pub fn start(&self, from: &PassState, half_edges: HalfEdgeMesh) -> (EditedMesh, Motion) {
        let positions = self.mesh.vertices.clone();
        let (kept, displacements, kept_moved) = match &from.known {
            None => {
                let kept = kept_edges::kept(&half_edges, &positions, &self.cut);
                let exact = &from.surface.mesh.vertices;
                let off = |v: &u32| sub(positions[*v as usize], exact[self.vertices[*v as usize] as usize]);
                let rounded = |t: &[u32; 3]| t.iter().fold(Displacements::NONE, |d, v| d.with(off(v)));
                (kept, self.mesh.triangles.iter().map(rounded).collect(), vec![0.0; positions.len()])
            }
            Some(known) => {
                let bit = |h: u32| known.kept[self.triangles[(h / 3) as usize] as usize] >> (h % 3) & 1 == 1;
                // Each of the two triangles of an edge may have come out of another block.
                let kept = |h: u32| match half_edges.twin(h) {
                    NONE => bit(h),
                    g => bit(h) || bit(g) || self.cut[(h / 3) as usize] != self.cut[(g / 3) as usize],
                };
                let kept = (0..3 * self.triangles.len() as u32).map(kept).collect();
                let displacements = self.triangles.iter().map(|t| known.displacements[*t as usize]).collect();
                (kept, displacements, self.vertices.iter().map(|v| known.kept_moved[*v as usize]).collect())
            }
        };
        let mesh = EditedMesh::new(half_edges, positions, kept);
        (mesh, Motion { displacements, kept_moved, free: self.free(), bounds: self.bounds })
    }

    /// The vertices all of whose triangles lie strictly in the block.
    fn free(&self) -> Vec<bool> {
        let mut free: Vec<bool> = self.mesh.vertices.iter().map(|p| self.bounds.holds_inside(*p)).collect();
        let inside = free.clone();
        for t in &self.mesh.triangles {
            if t.iter().any(|v| !inside[*v as usize]) {
                t.iter().for_each(|v| free[*v as usize] = false);
            }
        }
        free
    }

    /// What is left of the triangles whose home is block `b`.
    pub fn finish(&self, work: &Simplification, blocks: &Blocks, b: usize) -> BlockResult {
        let mut done = BlockResult::default();
        let (mesh, motion) = (&work.mesh, &work.motion);
        let mut seen = vec![false; mesh.positions.len()];
        for (t, corners) in mesh.half_edges.triangles.iter().enumerate() {
            if corners[0] == NONE {
                continue;
            }
            let [p, q, r] = mesh.corners(t as u32);
            if blocks.home(scale(add(p, add(q, r)), 1.0 / 3.0)) != b {
                continue;
            }
            done.triangles.push(corners.map(|v| self.vertices[v as usize]));
            done.cut.push(self.cut[t]);
            done.kept.push((0..3).fold(0, |bits, k| bits | u8::from(mesh.kept[3 * t + k]) << k));
            done.displacements.push(motion.displacements[t]);
            for v in *corners {
                if motion.free[v as usize] && !std::mem::replace(&mut seen[v as usize], true) {
                    done.moved.push((self.vertices[v as usize], mesh.at(v), motion.kept_moved[v as usize]));
                }
            }
        }
        done
    }
}
