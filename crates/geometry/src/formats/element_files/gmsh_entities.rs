//! Entities of Gmsh: surfaces and volumes whose elements have the same physical groups, and the periodic links of surfaces.

use std::collections::BTreeMap;
use std::io::{self, Write};

use rustc_hash::FxHashMap;

use super::{lines, push};
use crate::fe_mesh::FeMesh;

/// Faces with the same groups; in a periodic cell their images have the same groups too.
pub(super) struct Surface {
    /// Sets, by number, of which the faces are.
    pub sets: Vec<usize>,
    /// The faces: tetrahedron, and the corner opposite.
    pub faces: Vec<(u32, u8)>,
    /// Of a surface on an upper bounding plane: the axis normal to it and the surface, by number, in which all images are.
    master: Option<(usize, usize)>,
}

/// Sets of faces; of faces on an upper bounding plane also the axis normal to it and the sets of their images.
type Key<'a> = (&'a [usize], Option<(usize, &'a [usize])>);

/// The surfaces of faces with these sets.
pub(super) fn surfaces(mesh: &FeMesh, sets: &BTreeMap<(u32, u8), Vec<usize>>) -> Vec<Surface> {
    let images = Images::of(mesh);
    let sorted = |mut nodes: [u32; 3]| {
        nodes.sort_unstable();
        nodes
    };
    let lower: FxHashMap<[u32; 3], &Vec<usize>> = match mesh.pairs.is_empty() {
        true => FxHashMap::default(),
        false => sets.iter().map(|(f, of)| (sorted(mesh.face(*f)), of)).collect(),
    };
    let mut found: BTreeMap<Key, Vec<(u32, u8)>> = BTreeMap::new();
    for (f, of) in sets {
        let nodes = mesh.face(*f);
        let image = (0..3).find_map(|axis| {
            let [a, b, c] = nodes.map(|n| images.along(n, axis));
            Some((axis, lower.get(&sorted([a?, b?, c?]))?.as_slice()))
        });
        found.entry((of, image)).or_default().push(*f);
    }
    // Images are on no upper plane: faces of lower planes make up one surface for each combination of sets.
    let number: BTreeMap<&[usize], usize> =
        found.keys().enumerate().filter(|(_, k)| k.1.is_none()).map(|(i, k)| (k.0, i)).collect();
    let master = |image: Option<(usize, &[usize])>| image.and_then(|(axis, of)| Some((axis, *number.get(of)?)));
    found
        .iter()
        .map(|((of, image), faces)| Surface { sets: of.to_vec(), faces: faces.clone(), master: master(*image) })
        .collect()
}

/// Writes which surfaces and nodes are periodic images of which, if any are; `affine` is what a version of the format has before the
/// sixteen numbers of a transformation.
pub(super) fn write_periodic(mesh: &FeMesh, surfaces: &[Surface], affine: &str, out: &mut dyn Write) -> io::Result<()> {
    let links: Vec<_> = (1..).zip(surfaces).filter_map(|(i, s)| Some((i, s, s.master?))).collect();
    if links.is_empty() {
        return Ok(());
    }
    let images = Images::of(mesh);
    writeln!(out, "$Periodic\n{}", links.len())?;
    for (number, surface, (axis, master)) in links {
        let mut nodes: Vec<u32> = surface
            .faces
            .iter()
            .flat_map(|f| mesh.face(*f).into_iter().chain(mesh.face_middles(*f).into_iter().flatten()))
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let pairs: Vec<(u32, u32)> = nodes.into_iter().filter_map(|n| Some((n, images.along(n, axis)?))).collect();
        // From the master to its copy: a shift by the period.
        let shift: [f64; 3] = core::array::from_fn(|k| if k == axis { mesh.period[k] } else { 0.0 });
        let row = |k: usize| core::array::from_fn::<_, 3, _>(|c| format!("{} ", u8::from(c == k))).concat();
        writeln!(out, "2 {number} {}", master + 1)?;
        write!(out, "{affine} ")?;
        (0..3).try_for_each(|k| write!(out, "{}{:?} ", row(k), shift[k]))?;
        writeln!(out, "0 0 0 1\n{}", pairs.len())?;
        lines(out, pairs.len(), |i, text| {
            push(text, pairs[i].0 as usize + 1);
            text.push(' ');
            push(text, pairs[i].1 as usize + 1);
            text.push('\n');
        })?;
    }
    writeln!(out, "$EndPeriodic")
}

/// The images of nodes of a periodic cell by one period alone.
struct Images {
    /// Of each node on upper planes its image on none, and by which periods they differ.
    of: FxHashMap<u32, (u32, [bool; 3])>,
    /// The reverse.
    from: FxHashMap<(u32, [bool; 3]), u32>,
}

impl Images {
    fn of(mesh: &FeMesh) -> Images {
        Images {
            of: mesh.pairs.iter().map(|p| (p.node, (p.image, p.along))).collect(),
            from: mesh.pairs.iter().map(|p| ((p.image, p.along), p.node)).collect(),
        }
    }

    /// The image of a node on the upper plane of an axis, on the lower one.
    fn along(&self, node: u32, axis: usize) -> Option<u32> {
        let (image, mut along) = *self.of.get(&node)?;
        if !core::mem::replace(&mut along[axis], false) {
            return None;
        }
        if along == [false; 3] { Some(image) } else { self.from.get(&(image, along)).copied() }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fe_mesh::{FeSet, Pair};

    #[test]
    fn surfaces_of_upper_planes_are_linked_to_those_of_their_images() {
        // Kuhn's six tetrahedra: periodic in all axes.
        let corner = |i: usize| [0, 1, 2].map(|k| f64::from(u8::from(i >> k & 1 == 1)));
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let tets: Vec<[u32; 4]> = orders.map(|[a, b, _]| [0, 1 << a, 1 << a | 1 << b, 7]).into();
        let pairs = (1..8u32).map(|n| Pair { node: n, image: 0, along: [0, 1, 2].map(|k| n >> k & 1 == 1) }).collect();
        let mut mesh = FeMesh {
            nodes: (0..8).map(corner).collect(),
            domain: vec![0; tets.len()],
            tets,
            domains: vec!["SOLID".into()],
            pairs,
            period: [1.0; 3],
            ..FeMesh::default()
        };
        let all = || (0..6u32).flat_map(|t| (0..4u8).map(move |k| (t, k)));
        let on =
            |mesh: &FeMesh, f, axis: usize, at: f64| mesh.face(f).iter().all(|n| mesh.nodes[*n as usize][axis] == at);
        for axis in 0..3 {
            for at in 0..2u8 {
                let faces: Vec<_> = all().filter(|f| on(&mesh, *f, axis, f64::from(at))).collect();
                assert_eq!(faces.len(), 2);
                mesh.sets.push(FeSet { name: format!("{axis}{at}"), faces, ..FeSet::default() });
            }
        }
        // A set of one of the two faces on X0: X1 is then two surfaces with masters of their own.
        let one = vec![mesh.sets[0].faces[0]];
        mesh.sets.push(FeSet { name: "HALF".into(), faces: one, ..FeSet::default() });
        let mut sets: BTreeMap<(u32, u8), Vec<usize>> = BTreeMap::new();
        for (s, set) in mesh.sets.iter().enumerate() {
            set.faces.iter().for_each(|f| sets.entry(*f).or_default().push(s));
        }
        let made = surfaces(&mesh, &sets);
        assert_eq!(made.iter().map(|s| s.faces.len()).sum::<usize>(), 12);
        let linked: Vec<_> = made.iter().filter_map(|s| Some((s, s.master?))).collect();
        assert_eq!(linked.len(), 4);
        for (surface, (axis, master)) in linked {
            assert_eq!(surface.sets, [2 * axis + 1]);
            assert_eq!(made[master].sets[0], 2 * axis);
            assert_eq!(made[master].faces.len(), surface.faces.len());
        }
        let mut text = Vec::new();
        write_periodic(&mesh, &made, "16", &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(text.starts_with("$Periodic\n4\n") && text.ends_with("$EndPeriodic\n"));
        assert!(text.contains("16 1 0 0 1.0 0 1 0 0.0 0 0 1 0.0 0 0 0 1\n"));
    }
}
