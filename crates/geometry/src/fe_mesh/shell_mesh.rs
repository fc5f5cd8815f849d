//! Meshes of shells: linear or quadratic triangles on a mid-surface, with a thickness at each node.

use super::FeSet;
use super::surface_load::{Load, NodeShare};
use crate::math::{Vec3, cross, norm, sub};

/// A mesh of shells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShellMesh {
    /// Nodes (mm): corners first, then the nodes of edges.
    pub nodes: Vec<Vec3>,
    /// The corners of each triangle, counter-clockwise seen from the upper side.
    pub triangles: Vec<[u32; 3]>,
    /// The nodes on the edges of each triangle, from corner k to the next one; empty for linear ones.
    pub middles: Vec<[u32; 3]>,
    /// The thickness at each node, mm.
    pub thickness: Vec<f64>,
    /// Named sets; the faces of a set are edges on the border: triangle, and the corner from which the edge goes to the next one.
    pub sets: Vec<FeSet>,
}

impl ShellMesh {
    /// A set by its name.
    pub fn set(&self, name: &str) -> Option<&FeSet> {
        self.sets.iter().find(|s| s.name == name)
    }

    /// The nodes of triangle `i`: corners, then those of edges.
    pub fn nodes_of(&self, i: usize) -> impl Iterator<Item = u32> + use<> {
        self.triangles[i].into_iter().chain(self.middles.get(i).copied().into_iter().flatten())
    }

    /// The nodes of an edge: its ends, and its middle if the triangles are quadratic.
    pub fn edge(&self, (t, k): (u32, u8)) -> impl Iterator<Item = u32> + use<> {
        let corners = self.triangles[t as usize];
        let middle = self.middles.get(t as usize).map(|m| m[k as usize]);
        [corners[k as usize], corners[(k as usize + 1) % 3]].into_iter().chain(middle)
    }

    /// Area (mm²) of triangle `i` between its corners.
    pub fn triangle_area(&self, i: usize) -> f64 {
        let [p, q, r] = self.triangles[i].map(|n| self.nodes[n as usize]);
        0.5 * norm(cross(sub(q, p), sub(r, p)))
    }

    /// Area (mm²) and volume ∫ thickness dA (mm³), both between the corners.
    pub fn size(&self) -> (f64, f64) {
        (0..self.triangles.len()).fold((0.0, 0.0), |(area, volume), i| {
            let own = self.triangle_area(i);
            let mean = self.triangles[i].iter().map(|n| self.thickness[*n as usize]).sum::<f64>() / 3.0;
            (area + own, volume + own * mean)
        })
    }

    /// The forces at the nodes of a set's edges, ascending by node, of a uniform traction on the faces of the wall there: force · ∫ Nᵢ t ds / ∫ t ds with the shape functions Nᵢ of the edges and the thickness t between their ends.
    pub fn nodal_forces(&self, set: &FeSet, load: Load) -> Vec<(u32, Vec3)> {
        let mut shares: Vec<(u32, f64)> = Vec::with_capacity(3 * set.faces.len());
        for edge in &set.faces {
            let nodes: Vec<u32> = self.edge(*edge).collect();
            let long = norm(sub(self.nodes[nodes[1] as usize], self.nodes[nodes[0] as usize]));
            let [s, t] = [0, 1].map(|k| self.thickness[nodes[k] as usize]);
            // ∫ N t over a unit length, t linear from s to t.
            match nodes.get(2) {
                None => shares.extend([(nodes[0], long * (2.0 * s + t) / 6.0), (nodes[1], long * (s + 2.0 * t) / 6.0)]),
                Some(middle) => {
                    shares.extend([(nodes[0], long * s / 6.0), (nodes[1], long * t / 6.0)]);
                    shares.push((*middle, long * (s + t) / 3.0));
                }
            }
        }
        load.at_nodes(shares.into_iter().map(NodeShare::bare).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_add_up_and_follow_the_thickness() {
        let set =
            FeSet { name: "X0".into(), nodes: vec![0, 2, 5], elements: vec![0], faces: vec![(0, 2)], bulk: false };
        let linear = ShellMesh {
            nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            middles: Vec::new(),
            thickness: vec![1.0, 1.0, 2.0],
            sets: vec![set],
        };
        assert_eq!(linear.size(), (1.5, 2.0));
        // Half of the length has two thirds of the section: ∫ N t = (2 + 2) / 6 and (1 + 4) / 6 of 3 / 2.
        let found = linear.nodal_forces(&linear.sets[0], Load::Traction([0.0, 0.0, 9.0]));
        assert_eq!(found, [(0, [0.0, 0.0, 4.0]), (2, [0.0, 0.0, 5.0])]);
        let quadratic = ShellMesh {
            nodes: [linear.nodes.clone(), vec![[0.5, 0.0, 0.0], [0.5, 1.5, 0.0], [0.0, 1.5, 0.0]]].concat(),
            middles: vec![[3, 4, 5]],
            thickness: vec![1.0, 1.0, 2.0, 1.0, 1.5, 1.5],
            ..linear
        };
        let found = quadratic.nodal_forces(&quadratic.sets[0], Load::Traction([9.0, 0.0, 0.0]));
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(found.len() == 3 && near(found[0].1[0], 1.0) && near(found[1].1[0], 2.0) && near(found[2].1[0], 6.0));
    }
}
