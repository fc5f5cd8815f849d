//! Measures of a mesh.

use rayon::prelude::*;

use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::{EdgeCounts, Mesh, degenerate};

mod cavity;
mod components;
mod triangle_quality;

pub use crate::mesh::self_intersections;
pub use cavity::{Cavity, cavities};
use components::Components;
pub use components::non_manifold_vertices;
pub use triangle_quality::{ShapeCounts, Shapes, TriangleQuality, quality};

/// Triangles per unit of parallel work; sums are taken in this order whatever the thread count.
const CHUNK: usize = 1 << 16;

/// Volume, area and topology of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Size {
    /// Enclosed volume, mm³. Of a mesh that is not closed: that of the cones over its triangles from the centre of its bounds,
    /// which is near it where the gaps are small.
    pub volume: f64,
    /// Area, mm².
    pub area: f64,
    /// V − E + F, over the vertices that triangles use.
    pub euler: i64,
    /// Solids: connected components (through edges; contact in a point or an edge does not connect) of positive volume.
    pub pieces: usize,
    /// Closed voids inside solids: connected components of negative signed volume.
    pub cavities: usize,
    /// Whether every edge has exactly two triangles of opposite direction.
    pub closed: bool,
    /// Bounds of the vertices that triangles use.
    pub bounds: Aabb,
}

/// Measures a mesh (vertices already joined by index).
///
/// Time and memory are linear in the mesh.
pub fn size(mesh: &Mesh) -> Size {
    let edges = EdgeCounts::count(mesh);
    let joined = Components::of(mesh);
    let signed = match components::apart(mesh) {
        Some(apart) => Components::of(&apart).volumes(&apart),
        None => joined.volumes(mesh),
    };
    let closed = edges.all == edges.manifold && edges.loops == 0;
    let bounds = mesh.bounds();
    Size {
        // The cones over an open component depend on their apex: components that belong together need one apex.
        volume: match closed {
            true => signed.iter().sum(),
            false => cones(mesh, scale(add(bounds.min, bounds.max), 0.5)),
        },
        area: area(mesh),
        euler: joined.vertices as i64 - edges.all as i64 + mesh.triangles.len() as i64,
        pieces: signed.iter().filter(|v| **v > 0.0).count(),
        cavities: signed.iter().filter(|v| **v < 0.0).count(),
        closed,
        bounds,
    }
}

/// The signed volume of the cones over a mesh's triangles from one point, mm³.
fn cones(mesh: &Mesh, from: Vec3) -> f64 {
    let six = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|v| sub(mesh.vertices[v as usize], from));
        dot(a, cross(b, c))
    });
    six.sum::<f64>() / 6.0
}

/// Area by parts of equal size, so that the sum is the same for any number of threads.
fn area(mesh: &Mesh) -> f64 {
    let parts: Vec<f64> = mesh
        .triangles
        .par_chunks(CHUNK)
        .map(|part| {
            part.iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
                    norm(cross(sub(b, a), sub(c, a))) / 2.0
                })
                .sum()
        })
        .collect();
    parts.iter().sum()
}

/// Defects of a mesh as the boundary of one solid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub crowded_edges: usize,
    /// Edges with two triangles of the same direction (a flipped neighbour).
    pub flipped_edges: usize,
    /// Triangles with the vertices of another one, in any order.
    pub duplicate_triangles: usize,
    /// Triangles with two equal vertices or zero area (decided exactly).
    pub degenerate_triangles: usize,
    /// Connected components, through shared vertices.
    pub bodies: usize,
}

/// Counts the defects of a mesh.
pub fn defects(mesh: &Mesh) -> Defects {
    let edges = EdgeCounts::count(mesh);
    let mut keys = mesh.triangles.clone();
    keys.par_iter_mut().for_each(|t| t.sort_unstable());
    keys.par_sort_unstable();
    Defects {
        open_edges: edges.open,
        crowded_edges: edges.crowded,
        flipped_edges: edges.flipped,
        duplicate_triangles: keys.windows(2).filter(|w| w[0] == w[1]).count(),
        degenerate_triangles: (0..mesh.triangles.len()).into_par_iter().filter(|&i| degenerate(mesh, i)).count(),
        bodies: Components::of(mesh).count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::{cube, flipped, join, tetrahedron, torus};

    #[test]
    fn simple_solids() {
        let s = size(&tetrahedron());
        assert!((s.volume - 1.0 / 6.0).abs() < 1e-15);
        assert!((s.area - (1.5 + 0.75f64.sqrt())).abs() < 1e-15);
        assert_eq!((s.euler, s.pieces, s.cavities, s.closed), (2, 1, 0, true));
        let s = size(&cube([1.0, 2.0, 3.0], 2.0));
        assert_eq!((s.volume, s.area, s.euler, s.pieces, s.closed), (8.0, 24.0, 2, 1, true));
        assert_eq!(s.bounds, Aabb { min: [1.0, 2.0, 3.0], max: [3.0, 4.0, 5.0] });
        let s = size(&torus(40, 30));
        assert_eq!((s.euler, s.pieces, s.cavities, s.closed), (0, 1, 0, true));
        // An inscribed torus: below 2π²Rr², within the error of its polygons.
        let ideal = 4.0 * core::f64::consts::PI.powi(2);
        assert!(s.volume < ideal && s.volume > ideal * 0.98);
    }

    #[test]
    fn nothing_measures_as_nothing() {
        let s = size(&Mesh::default());
        assert_eq!((s.volume, s.area, s.euler, s.pieces, s.cavities, s.closed), (0.0, 0.0, 0, 0, 0, true));
        assert!(s.bounds.is_empty());
        assert_eq!(defects(&Mesh::default()), Defects::default());
    }

    #[test]
    fn cavities_pieces_and_unused_vertices() {
        let nested = join(&[cube([0.0; 3], 4.0), flipped(cube([1.0; 3], 2.0)), cube([1.5; 3], 1.0), tetrahedron()]);
        let s = size(&nested);
        assert_eq!((s.euler, s.pieces, s.cavities, s.closed), (8, 3, 1, true));
        assert!((s.volume - (64.0 - 8.0 + 1.0 + 1.0 / 6.0)).abs() < 1e-12);
        let mut stray = cube([0.0; 3], 1.0);
        stray.vertices.push([99.0; 3]);
        let s = size(&stray);
        assert_eq!((s.euler, s.bounds.max), (2, [1.0; 3]));
        assert_eq!(defects(&nested), Defects { bodies: 4, ..Defects::default() });
    }

    #[test]
    fn touching_components_differ_by_index_not_position() {
        let (a, b) = (cube([0.0; 3], 1.0), cube([1.0; 3], 1.0));
        let apart = join(&[a, b]);
        assert_eq!(size(&apart).pieces, 2);
        assert_eq!(non_manifold_vertices(&apart), 0);
        // The corner (1, 1, 1) made common: vertex 7 of the first, 8 of both.
        let mut joined = apart;
        joined.triangles.iter_mut().flatten().filter(|v| **v == 8).for_each(|v| *v = 7);
        let s = size(&joined);
        assert_eq!((s.pieces, s.closed, s.euler), (2, true, 3));
        assert_eq!(non_manifold_vertices(&joined), 1);
    }

    #[test]
    fn two_cubes_with_a_common_edge_have_a_crowded_edge() {
        let mut m = join(&[cube([0.0; 3], 1.0), cube([1.0, 1.0, 0.0], 1.0)]);
        m.triangles.iter_mut().flatten().for_each(|v| {
            *v = match *v {
                8 => 3,
                12 => 7,
                v => v,
            }
        });
        let d = defects(&m);
        assert_eq!((d.crowded_edges, d.open_edges, d.flipped_edges, d.bodies), (1, 0, 0, 1));
        assert!(!size(&m).closed);
    }

    #[test]
    fn the_volume_of_bodies_that_should_be_one() {
        // A cube of six faces that have no vertex in common, each in its place: six open bodies that enclose one volume.
        let whole = cube([5.0, -2.0, 1.0], 2.0);
        let mut apart = Mesh::default();
        for t in &whole.triangles {
            let first = apart.vertices.len() as u32;
            let corners = t.map(|v| whole.vertices[v as usize]);
            apart.vertices.extend(corners);
            apart.triangles.push([first, first + 1, first + 2]);
        }
        let s = size(&apart);
        assert!(!s.closed && (s.volume - 8.0).abs() < 1e-12, "{}", s.volume);
        // Corners that differ by a rounding are one; those of another size of part are not.
        let shift = |by: f64| {
            let mut m = apart.clone();
            let each = m.vertices.iter_mut().enumerate();
            each.for_each(|(i, v)| v[i % 3] += by * (i % 2) as f64);
            m.joined_where_open()
        };
        assert!(size(&shift(1e-8)).closed && !size(&shift(1e-3)).closed);
        assert_eq!(whole.clone().joined_where_open(), whole);
    }

    #[test]
    fn defects_are_counted() {
        let mut open = cube([0.0; 3], 1.0);
        open.triangles.pop();
        let d = defects(&open);
        assert_eq!((d.open_edges, d.flipped_edges, size(&open).closed), (3, 0, false));
        let mut turned = cube([0.0; 3], 1.0);
        turned.triangles[0].swap(0, 1);
        let d = defects(&turned);
        assert_eq!((d.open_edges, d.flipped_edges, size(&turned).closed), (0, 3, false));
        let mut twice = cube([0.0; 3], 1.0);
        twice.triangles.push([3, 0, 2]);
        let d = defects(&twice);
        assert_eq!((d.duplicate_triangles, d.crowded_edges), (1, 3));
        let mut thin = cube([0.0; 3], 1.0);
        thin.vertices.push([0.5, 0.5, 0.0]);
        thin.triangles.extend([[0, 8, 3], [1, 1, 2]]);
        assert_eq!(defects(&thin).degenerate_triangles, 2);
    }

    #[test]
    fn cubes_that_touch_are_two() {
        // In a vertex, in an edge: the second cube's corners on the first's are joined.
        for (shift, vertices, crowded) in [([1.0; 3], 15, 0), ([1.0, 1.0, 0.0], 14, 1)] {
            let mut two = join(&[cube([0.0; 3], 1.0), cube(shift, 1.0)]);
            for i in 8..16 {
                if let Some(j) = (0..8).find(|j| two.vertices[*j] == two.vertices[i]) {
                    let corners = two.triangles.iter_mut().flatten();
                    corners.filter(|c| **c == i as u32).for_each(|c| *c = j as u32);
                }
            }
            let s = size(&two);
            assert_eq!((s.pieces, s.cavities, s.volume), (2, 0, 2.0));
            assert_eq!((s.closed, defects(&two).crowded_edges), (crowded == 0, crowded));
            assert_eq!(s.euler, vertices - (36 - crowded as i64) + 24);
            let inverted = size(&flipped(two));
            assert_eq!((inverted.pieces, inverted.cavities, inverted.volume), (0, 2, -2.0));
        }
    }

    #[test]
    fn a_moebius_band_is_neither_closed_nor_oriented() {
        let n = 12u32;
        let mut m = Mesh::default();
        for i in 0..n {
            let t = f64::from(i) / f64::from(n) * core::f64::consts::TAU;
            for side in [-0.3, 0.3] {
                let r = 1.0 + side * (t / 2.0).cos();
                m.vertices.push([r * t.cos(), r * t.sin(), side * (t / 2.0).sin()]);
            }
            let (a, b) = (2 * i, 2 * i + 1);
            let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
            m.triangles.extend([[a, c, d], [a, d, b]]);
        }
        let d = defects(&m);
        assert_eq!((d.open_edges, d.flipped_edges, d.bodies), (2 * n as usize, 1, 1));
        assert_eq!((size(&m).euler, size(&m).closed), (0, false));
        assert_eq!(non_manifold_vertices(&m), 0);
    }
}
