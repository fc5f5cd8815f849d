//! The normals that a mesh is shaded by: smooth, but for its edges.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::surface_mesh::SurfaceMesh;

/// Normals at vertices, weighted by area: one for each vertex, but where faces meet in an edge or a cut ends, one for each side. And those
/// that are given at corners, which come first.
pub(super) struct ShadingNormals<'a> {
    given: Option<&'a [[f32; 3]]>,
    smooth: Vec<[f32; 3]>,
    /// The triangles about a vertex on an edge.
    edges: HashMap<usize, Vec<u32>>,
}

impl<'a> ShadingNormals<'a> {
    /// Cosine of the angle from which on faces meet in an edge: 35°.
    pub(super) const EDGE: f64 = 0.82;

    pub(super) fn of(surface: &SurfaceMesh, given: Option<&'a [[f32; 3]]>) -> ShadingNormals<'a> {
        let mesh = &surface.mesh;
        let given = given.filter(|n| n.len() == 3 * mesh.triangles.len());
        let mut sums = vec![[0.0f32; 3]; mesh.vertices.len()];
        // Whether a vertex is one of cuts, and of others.
        let mut kinds = vec![[false; 2]; mesh.vertices.len()];
        for (i, t) in mesh.triangles.iter().enumerate() {
            let n = area(surface, i);
            for v in t {
                (0..3).for_each(|k| sums[*v as usize][k] += n[k] as f32);
                kinds[*v as usize][usize::from(is_cut(surface, i))] = true;
            }
        }
        sums.par_iter_mut().for_each(|n| *n = unit(n.map(f64::from)).map(|c| c as f32));
        let apart = |i: usize, v: u32| {
            kinds[v as usize] == [true; 2] || dot(unit(area(surface, i)), sums[v as usize].map(f64::from)) < Self::EDGE
        };
        let mut edges = HashMap::new();
        for (i, t) in mesh.triangles.iter().enumerate() {
            for v in t.iter().filter(|v| apart(i, **v)) {
                edges.entry(*v as usize).or_insert_with(Vec::new);
            }
        }
        for (i, t) in mesh.triangles.iter().enumerate() {
            for v in t {
                if let Some(around) = edges.get_mut(&(*v as usize)) {
                    around.push(i as u32);
                }
            }
        }
        ShadingNormals { given, smooth: sums, edges }
    }

    /// The unit normal at a point of a triangle, by the weights of its corners.
    pub(super) fn within(&self, surface: &SurfaceMesh, triangle: u32, weights: [f64; 3]) -> Vec3 {
        let flat = unit(area(surface, triangle as usize));
        let n = (0..3).fold([0.0; 3], |n, i| add(n, scale(self.at_corner(surface, triangle, i, flat), weights[i])));
        if norm(n) > 0.0 { unit(n) } else { flat }
    }

    /// The normal at a corner of a triangle whose own is `flat`.
    pub(super) fn at_corner(&self, surface: &SurfaceMesh, triangle: u32, corner: usize, flat: Vec3) -> Vec3 {
        self.given(triangle, corner).unwrap_or_else(|| self.at(surface, triangle, corner, flat))
    }

    /// The same, of a vertex that lies on no edge which is drawn: one normal for all triangles about it.
    pub(super) fn at_vertex(&self, surface: &SurfaceMesh, triangle: u32, corner: usize) -> Vec3 {
        let vertex = surface.mesh.triangles[triangle as usize][corner] as usize;
        self.given(triangle, corner).unwrap_or_else(|| self.smooth[vertex].map(f64::from))
    }

    /// That which is given there, if there is one.
    pub(super) fn given(&self, triangle: u32, corner: usize) -> Option<Vec3> {
        let n = self.given?[3 * triangle as usize + corner];
        (n != [0.0; 3]).then(|| n.map(f64::from))
    }

    /// By the mesh: the sum over the triangles of the same kind that turn little from this one.
    fn at(&self, surface: &SurfaceMesh, triangle: u32, corner: usize, flat: Vec3) -> Vec3 {
        let vertex = surface.mesh.triangles[triangle as usize][corner] as usize;
        let Some(around) = self.edges.get(&vertex) else {
            return self.smooth[vertex].map(f64::from);
        };
        let cut = is_cut(surface, triangle as usize);
        let same = around.iter().map(|i| *i as usize).filter(|i| is_cut(surface, *i) == cut);
        let near = same.map(|i| area(surface, i)).filter(|n| dot(*n, flat) > Self::EDGE * norm(*n));
        let sum = near.fold([0.0; 3], add);
        if norm(sum) > 0.0 { unit(sum) } else { flat }
    }
}

/// Whether a triangle lies in a cut.
pub(super) fn is_cut(surface: &SurfaceMesh, triangle: usize) -> bool {
    surface.cut.get(triangle).copied().unwrap_or(false)
}

/// Twice the area of a triangle, along its normal.
pub(super) fn area(surface: &SurfaceMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = surface.mesh.corners(triangle);
    cross(sub(b, a), sub(c, a))
}
