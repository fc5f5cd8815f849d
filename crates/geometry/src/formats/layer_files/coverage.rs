//! Pictures of layers: the exact fraction of each pixel that contours cover.
//!
//! Every edge adds to the pixels that it crosses the signed area between it and their right ends, and to all pixels further right
//! its height; sums along a row are the covered fractions, exact but for rounding. Work is in proportion to the pixels that
//! contours cross.

use std::io;

use crate::layer::Point;

/// The pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelGrid {
    /// The lower left corner of the picture, mm.
    pub origin: Point,
    /// Edge of a pixel, mm.
    pub pixel: f64,
    /// Number of pixels along x and y.
    pub size: [usize; 2],
}

/// What edges add to a pixel.
#[derive(Clone, Copy)]
struct Cell {
    column: u32,
    /// The covered fraction of the pixel itself.
    area: f32,
    /// That of all further right.
    cover: f32,
}

/// Calls `take` with the number of each row from the top and its pixels, 0 (void) to 255 (solid).
pub fn coverage(
    loops: &[Vec<Point>],
    raster: &PixelGrid,
    mut take: impl FnMut(usize, &[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let [width, height] = raster.size;
    let mut cells: Vec<(u32, Cell)> = Vec::new();
    let to_pixels = |p: &Point| {
        let top = raster.origin[1] + height as f64 * raster.pixel;
        [(p[0] - raster.origin[0]) / raster.pixel, (top - p[1]) / raster.pixel]
    };
    for contour in loops {
        let points: Vec<Point> = contour.iter().map(to_pixels).collect();
        for (i, a) in points.iter().enumerate() {
            edge([*a, points[(i + 1) % points.len()]], raster.size, &mut cells);
        }
    }
    // Ordered by rows, then by columns; the order of edges is kept, so that sums are the same whatever the sorting.
    let mut starts = vec![0u32; height + 1];
    cells.iter().for_each(|(row, _)| starts[*row as usize + 1] += 1);
    (0..height).for_each(|i| starts[i + 1] += starts[i]);
    let mut next = starts.clone();
    let mut ordered = vec![Cell { column: 0, area: 0.0, cover: 0.0 }; cells.len()];
    for (row, cell) in &cells {
        ordered[next[*row as usize] as usize] = *cell;
        next[*row as usize] += 1;
    }
    drop(cells);
    let mut pixels = vec![0u8; width];
    let mut blank = true;
    for row in 0..height {
        let of = &mut ordered[starts[row] as usize..starts[row + 1] as usize];
        if of.is_empty() {
            if !blank {
                pixels.fill(0);
                blank = true;
            }
        } else {
            of.sort_by_key(|c| c.column);
            paint(of, &mut pixels);
            blank = false;
        }
        take(row, &pixels)?;
    }
    Ok(())
}

/// Fills a row from its cells, sorted.
fn paint(cells: &[Cell], pixels: &mut [u8]) {
    let grey = |share: f64| (255.0 * share.clamp(0.0, 1.0) + 0.5) as u8;
    let (mut done, mut cover) = (0, 0.0f64);
    for of in cells.chunk_by(|a, b| a.column == b.column) {
        let column = of[0].column as usize;
        pixels[done..column].fill(grey(cover));
        let area: f64 = of.iter().map(|c| f64::from(c.area)).sum();
        pixels[column] = grey(cover + area);
        cover += of.iter().map(|c| f64::from(c.cover)).sum::<f64>();
        done = column + 1;
    }
    pixels[done..].fill(grey(cover));
}

/// Adds an edge, in pixels, y downwards.
fn edge([a, b]: [Point; 2], [width, height]: [usize; 2], cells: &mut Vec<(u32, Cell)>) {
    if a[1] == b[1] {
        return;
    }
    // The solid is on the left with y upwards: edges that run down have it on their right.
    let (sign, [a, b]) = if a[1] < b[1] { (1.0, [a, b]) } else { (-1.0, [b, a]) };
    let slope = (b[0] - a[0]) / (b[1] - a[1]);
    let (from, to) = (a[1].max(0.0), b[1].min(height as f64));
    let mut y = from;
    while y < to {
        let row = y.floor();
        let end = (row + 1.0).min(to);
        let [x0, x1] = [y, end].map(|y| a[0] + (y - a[1]) * slope);
        strip([x0, x1], sign * (end - y), width, row as u32, cells);
        y = end;
    }
}

/// Adds the part of an edge in a row, from x0 to x1 with this signed height.
fn strip([x0, x1]: Point, height: f64, width: usize, row: u32, cells: &mut Vec<(u32, Cell)>) {
    let (low, high) = if x0 < x1 { (x0, x1) } else { (x1, x0) };
    let right = width as f64;
    let mut push = |column: f64, from: f64, to: f64, share: f64| {
        let cover = height * share;
        let area = cover * (1.0 - (0.5 * (from + to) - column));
        cells.push((row, Cell { column: column as u32, area: area as f32, cover: cover as f32 }));
    };
    if high <= 0.0 {
        return push(0.0, 0.0, 0.0, 1.0); // left of the picture: all of the row is to its right
    }
    if low >= right {
        return;
    }
    let span = high - low;
    if span < 1e-12 {
        let at = low.max(0.0);
        return push(at.floor().min(right - 1.0), at, at, 1.0);
    }
    if low < 0.0 {
        push(0.0, 0.0, 0.0, -low / span);
    }
    let (mut x, end) = (low.max(0.0), high.min(right));
    while x < end {
        let column = x.floor();
        let next = (column + 1.0).min(end);
        push(column, x, next, (next - x) / span);
        x = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(loops: &[Vec<Point>], raster: &PixelGrid) -> Vec<Vec<u8>> {
        let mut rows = Vec::new();
        let take = |_: usize, row: &[u8]| {
            rows.push(row.to_vec());
            Ok(())
        };
        coverage(loops, raster, take).unwrap();
        rows
    }

    #[test]
    fn boxes_and_triangles_have_their_fractions() {
        let raster = PixelGrid { origin: [0.0; 2], pixel: 0.5, size: [4, 3] };
        let square = vec![[0.25, 0.5], [1.0, 0.5], [1.0, 1.25], [0.25, 1.25]];
        let half = 128; // 127.5 rounded up
        let want = [[half / 2, half, 0, 0], [half, 255, 0, 0], [0, 0, 0, 0]];
        assert_eq!(picture(std::slice::from_ref(&square), &raster), want);
        let hole: Vec<Point> = square.iter().rev().copied().collect();
        assert_eq!(picture(&[square.clone(), hole], &raster), [[0; 4]; 3]);
        let triangle = vec![[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];
        assert_eq!(picture(&[triangle], &raster)[2], [half, 0, 0, 0]);
    }

    #[test]
    fn the_sum_of_pixels_is_the_area_wherever_the_picture_ends() {
        let circle: Vec<Point> = (0..360)
            .map(|i| crate::math::sin_cos_turns(f64::from(i) / 360.0))
            .map(|(s, c)| [1.0 + 0.9 * c, 1.0 + 0.9 * s])
            .collect();
        let area = |loops: &[Vec<Point>], raster: &PixelGrid| {
            let sum: f64 = picture(loops, raster).iter().flatten().map(|v| f64::from(*v)).sum();
            sum / 255.0 * raster.pixel * raster.pixel
        };
        let whole = PixelGrid { origin: [0.0; 2], pixel: 0.01, size: [200, 200] };
        let want = crate::layer::signed_area(&circle);
        // 600 pixels on the boundary, each rounded by up to half a 255th.
        assert!((area(std::slice::from_ref(&circle), &whole) - want).abs() < 600.0 * 1e-4 * 0.5 / 255.0);
        for origin in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let half = PixelGrid { origin, ..whole };
            let found = area(std::slice::from_ref(&circle), &half);
            assert!((found - 0.5 * want).abs() < 300.0 * 1e-4 * 0.5 / 255.0 + 1e-9, "{origin:?} {found}");
        }
    }
}
