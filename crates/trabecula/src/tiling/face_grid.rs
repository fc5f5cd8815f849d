//! A regular grid of points on a face of a tetrahedron, on which what is solid of it is found.

/// A regular triangular grid on a face.
pub struct FaceGrid {
    /// Steps along an edge.
    pub steps: usize,
    /// Points by their barycentric coordinates in the face, in steps: row by row from the first corner.
    pub points: Vec<[usize; 3]>,
}

impl FaceGrid {
    /// The grid of `steps` along an edge.
    pub fn new(steps: usize) -> FaceGrid {
        let points = (0..=steps).flat_map(|i| (0..=i).map(move |j| [steps - i, i - j, j])).collect();
        FaceGrid { steps, points }
    }

    /// The number of a point among `points`.
    pub fn index([_, b, c]: [usize; 3]) -> usize {
        let row = b + c;
        row * (row + 1) / 2 + c
    }

    /// Each pair of adjacent points once, by their numbers.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> {
        let last = self.steps;
        // Those of the triangles that point to the first corner.
        self.points.iter().filter(move |p| p[1] + p[2] < last).flat_map(|[a, b, c]| {
            let [p, q, r] = [[*a, *b, *c], [a - 1, b + 1, *c], [a - 1, *b, c + 1]].map(FaceGrid::index);
            [[p, q], [p, r], [q, r]]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::FaceGrid;

    #[test]
    fn points_have_their_numbers_and_edges_join_neighbours() {
        let grid = FaceGrid::new(7);
        assert!(grid.points.iter().enumerate().all(|(n, p)| FaceGrid::index(*p) == n));
        let edges: std::collections::BTreeSet<[usize; 2]> = grid.edges().collect();
        // Three for each small triangle that points to the first corner.
        assert_eq!((edges.len(), grid.edges().count()), (3 * 28, 3 * 28));
        for [p, q] in edges {
            let off: usize = (0..3).map(|k| grid.points[p][k].abs_diff(grid.points[q][k])).sum();
            assert_eq!(off, 2);
        }
    }
}
