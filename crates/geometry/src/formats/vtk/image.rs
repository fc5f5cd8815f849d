//! Grids of images (VTI) whose indices may run along any axes of space.

use super::{DataArray, DataSet, fault};
use crate::fault::Fault;
use crate::math::Vec3;

/// The axis of space along which an index of an image runs, and whether it runs against it.
pub(super) type Axis = (usize, bool);
/// Indices along the axes, as they are without a Direction.
pub(super) const ALONG: [Axis; 3] = [(0, false), (1, false), (2, false)];
/// How far cosines of a Direction may be from those of an axis: writers round them.
const ROUNDED: f64 = 1e-6;

/// The axes along which the indices of an image run, by its Direction: the cosines of the axes of space, row by row.
pub(super) fn along(direction: &str) -> Result<[Axis; 3], Fault> {
    let found: Vec<f64> = direction.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let wrong = |why: &str| Err(fault(format!("Direction = \"{direction}\" of the ImageData {why}")));
    let Ok(m) = <[f64; 9]>::try_from(found) else { return wrong("is not nine numbers") };
    let axis = |of: usize| {
        let column = [0, 1, 2].map(|a| m[3 * a + of]);
        let a = column.iter().position(|c| (c.abs() - 1.0).abs() < ROUNDED)?;
        let alone = (0..3).all(|b| a == b || column[b].abs() < ROUNDED);
        alone.then_some((a, column[a] < 0.0))
    };
    match [0, 1, 2].map(axis) {
        [Some(x), Some(y), Some(z)] if (1 << x.0 | 1 << y.0 | 1 << z.0) == 7 => Ok([x, y, z]),
        _ => wrong(
            "turns the grid out of the axes, and numbers are read along them alone; resample it to an image without a turn (in ParaView \
             Resample To Image)",
        ),
    }
}

/// The grid of an image: the node of index i lies at origin + step · (first + i) along the axes of its indices.
pub(super) struct Image {
    pub origin: Vec3,
    pub step: Vec3,
    pub first: Vec3,
    pub nodes: [usize; 3],
    pub along: [Axis; 3],
}

impl Image {
    /// The number of nodes or cells along each index.
    pub fn count(&self, of_cells: bool) -> [usize; 3] {
        self.nodes.map(|n| if of_cells { n.saturating_sub(1).max(1) } else { n })
    }

    /// The index along each axis of space, and whether it runs against it.
    fn indices(&self) -> [Axis; 3] {
        let mut of = ALONG;
        self.along.iter().enumerate().for_each(|(i, (a, against))| of[*a] = (i, *against));
        of
    }

    /// The grid along the axes of space.
    pub fn shape(&self) -> DataSet {
        let (mut origin, of) = (self.origin, self.indices());
        for (at, (i, against)) in origin.iter_mut().zip(of) {
            let last = (self.nodes[i] - 1) as f64;
            *at += self.step[i] * if against { -self.first[i] - last } else { self.first[i] };
        }
        DataSet::Image { origin, step: of.map(|(i, _)| self.step[i]), nodes: of.map(|(i, _)| self.nodes[i]) }
    }

    /// Puts the numbers of an array in the order of the axes of space, x fastest. Components are those along the axes of space before and
    /// after.
    pub fn turn(&self, array: &mut DataArray) {
        if self.along == ALONG {
            return;
        }
        let (count, of) = (self.count(array.of_cells), self.indices());
        let stride = [1, count[0], count[0] * count[1]];
        let place = |a: usize, n: usize| {
            let (i, against) = of[a];
            stride[i] * if against { count[i] - 1 - n } else { n }
        };
        let [x, y, z] = of.map(|(i, _)| count[i]);
        let mut values = Vec::with_capacity(array.values.len());
        for k in 0..z {
            for j in 0..y {
                for i in 0..x {
                    let from = (place(0, i) + place(1, j) + place(2, k)) * array.components;
                    values.extend_from_slice(&array.values[from..from + array.components]);
                }
            }
        }
        array.values = values;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use crate::formats::{DataSet, read_vtk};
    use crate::math::{Mat3, Vec3, apply};

    /// Numbers of points and of cells, and the places of both, of an image of 3 × 4 × 2 nodes with this Direction.
    fn image(m: &Mat3) -> String {
        let (origin, step, first, nodes) = ([0.3, -1.0, 2.0], [0.5, 0.25, 2.0], [1.0, -2.0, 3.0], [3usize, 4, 2]);
        let list = |count: [usize; 3], shift: f64| {
            let mut numbers = String::new();
            for n in 0..count.iter().product() {
                let at = [n % count[0], n / count[0] % count[1], n / count[0] / count[1]];
                let local: Vec3 = core::array::from_fn(|a| step[a] * (first[a] + at[a] as f64 + shift));
                let turned = apply(m, local);
                numbers += &[0, 1, 2].map(|a| (origin[a] + turned[a]).to_string()).join(" ");
                numbers.push(' ');
            }
            numbers
        };
        let (points, cells) = (list(nodes, 0.0), list(nodes.map(|n| n - 1), 0.5));
        let direction = m.as_flattened().iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let array = "<DataArray type=\"Float64\" Name=\"p\" NumberOfComponents=\"3\" format=\"ascii\">";
        format!(
            "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"1 3 -2 1 3 4\" Origin=\"0.3 -1 2\" Spacing=\"0.5 0.25 2\" \
             Direction=\"{direction}\"><Piece Extent=\"1 3 -2 1 3 4\"><PointData>{array}{points}</DataArray></PointData>\
             <CellData>{array}{cells}</DataArray></CellData></Piece></ImageData></VTKFile>"
        )
    }

    /// All 48 ways in which indices run along the axes: each point and each cell has the place that its numbers say.
    #[test]
    fn indices_along_any_axes_are_put_in_order() {
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            for signs in 0..8 {
                let mut m = [[0.0; 3]; 3];
                for i in 0..3 {
                    m[order[i]][i] = if signs >> i & 1 == 1 { -1.0 } else { 1.0 };
                }
                let data = read_vtk(image(&m).as_bytes()).unwrap();
                let DataSet::Image { origin, step, nodes } = data.shape else { panic!("no image") };
                for (array, shift) in data.arrays.iter().zip([0.0, 0.5]) {
                    let count = nodes.map(|n| if array.of_cells { n - 1 } else { n });
                    for (n, place) in array.values.chunks_exact(3).enumerate() {
                        let at = [n % count[0], n / count[0] % count[1], n / count[0] / count[1]];
                        for a in 0..3 {
                            let want = origin[a] + step[a] * (at[a] as f64 + shift);
                            assert!((place[a] - want).abs() < 1e-12, "{m:?} {at:?} {place:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn turned_grids_are_refused() {
        let (s, c) = 20f64.to_radians().sin_cos();
        let turned = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let doubled = [[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        for m in [turned, doubled] {
            let f = read_vtk(image(&m).as_bytes()).unwrap_err();
            assert!(f.message.contains("Direction") && f.message.contains("resample"), "{f}");
        }
    }
}
