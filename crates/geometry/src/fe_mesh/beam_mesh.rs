//! Meshes of beams: linear or quadratic line elements with circular sections.

use super::FeSet;
use super::surface_load::{Load, NodeShare};
use crate::math::{Vec3, norm, sub, unit};

/// A mesh of beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BeamMesh {
    /// Nodes (mm): ends of elements first, then their middles.
    pub nodes: Vec<Vec3>,
    /// The ends of each element.
    pub elements: Vec<[u32; 2]>,
    /// The middle of each element; empty for linear ones.
    pub middles: Vec<u32>,
    /// The radius of each element, mm.
    pub radii: Vec<f64>,
    /// Named sets; the faces of a set are ends: element, and 0 or 1.
    pub sets: Vec<FeSet>,
}

/// Elements with one section.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamSection {
    /// Radius, mm, to five digits: areas are right to 10⁻⁴.
    pub radius: f64,
    /// A direction that none of the elements has: no angle to it is below 30 degrees.
    pub across: Vec3,
    /// The elements, ascending.
    pub elements: Vec<u32>,
}

impl BeamMesh {
    /// A set by its name.
    pub fn set(&self, name: &str) -> Option<&FeSet> {
        self.sets.iter().find(|s| s.name == name)
    }

    /// The nodes of element `i`: ends, then the middle of a quadratic one.
    pub fn nodes_of(&self, i: usize) -> impl Iterator<Item = u32> + use<> {
        self.elements[i].into_iter().chain(self.middles.get(i).copied())
    }

    /// From the first end of element `i` to the second, mm.
    pub fn axis(&self, i: usize) -> Vec3 {
        let [a, b] = self.elements[i].map(|n| self.nodes[n as usize]);
        sub(b, a)
    }

    /// The area of the section of element `i`, mm².
    pub fn area(&self, i: usize) -> f64 {
        core::f64::consts::PI * self.radii[i] * self.radii[i]
    }

    /// Length (mm) of all elements, and their volume Σ A L (mm³), which counts what beams share at hubs once for each.
    pub fn size(&self) -> (f64, f64) {
        (0..self.elements.len()).fold((0.0, 0.0), |(length, volume), i| {
            let own = norm(self.axis(i));
            (length + own, volume + own * self.area(i))
        })
    }

    /// The sections, in the order of their first elements.
    pub fn sections(&self) -> Vec<BeamSection> {
        let mut number = rustc_hash::FxHashMap::default();
        let mut sections: Vec<BeamSection> = Vec::new();
        for (i, radius) in self.radii.iter().enumerate() {
            let radius: f64 = format!("{radius:.4e}").parse().unwrap_or(*radius);
            // Of z and x the one farther from the beam's direction.
            let along = unit(self.axis(i));
            let is_upright = along[2].abs() > along[0].abs();
            let at = *number.entry((radius.to_bits(), is_upright)).or_insert_with(|| {
                let across = if is_upright { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
                sections.push(BeamSection { radius, across, elements: Vec::new() });
                sections.len() - 1
            });
            sections[at].elements.push(i as u32);
        }
        sections
    }

    /// The forces at the nodes of a set's ends, ascending by node, of a uniform traction on the sections there whose resultant is
    /// `force`: shares by their areas.
    pub fn nodal_forces(&self, set: &FeSet, load: Load) -> Vec<(u32, Vec3)> {
        let end = |(e, k): &(u32, u8)| (self.elements[*e as usize][*k as usize], self.area(*e as usize));
        load.at_nodes(set.faces.iter().map(end).map(NodeShare::bare).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle() -> BeamMesh {
        BeamMesh {
            nodes: vec![[0.0; 3], [3.0, 0.0, 0.0], [3.0, 0.0, 4.0]],
            elements: vec![[0, 1], [1, 2]],
            radii: vec![1.0, 0.5],
            ..BeamMesh::default()
        }
    }

    #[test]
    fn forces_are_shared_by_areas() {
        let ends = FeSet { faces: vec![(0, 1), (1, 0), (1, 1)], ..FeSet::default() };
        let found = angle().nodal_forces(&ends, Load::Traction([6.0, 0.0, -3.0]));
        assert_eq!(found, [(1, [5.0, 0.0, -2.5]), (2, [1.0, 0.0, -0.5])]);
        let (length, volume) = angle().size();
        assert!(length == 7.0 && (volume - 4.0 * core::f64::consts::PI).abs() < 1e-14);
    }

    #[test]
    fn no_section_has_a_direction_of_its_elements() {
        let turned = |i: i32| {
            let [a, b] = [f64::from(i), 1.7 * f64::from(i)];
            [a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]
        };
        let ends: Vec<Vec3> = (0..500).map(turned).collect();
        let mesh = BeamMesh {
            elements: (0..500).map(|i| [i, 500]).collect(),
            radii: (0..500).map(|i| if i % 2 == 0 { 0.2 } else { 0.300001 }).collect(),
            nodes: ends.into_iter().chain([[0.0; 3]]).collect(),
            ..BeamMesh::default()
        };
        let sections = mesh.sections();
        assert_eq!(sections.len(), 4);
        assert_eq!(sections.iter().map(|s| s.elements.len()).sum::<usize>(), 500);
        for section in sections {
            assert!(section.radius == 0.2 || section.radius == 0.3);
            for e in section.elements {
                let along = unit(mesh.axis(e as usize));
                let cosine = (0..3).map(|k| along[k] * section.across[k]).sum::<f64>().abs();
                // The greatest is of directions at 45 degrees between x and z.
                assert!(cosine <= 0.5_f64.sqrt() + 1e-12);
            }
        }
    }
}
