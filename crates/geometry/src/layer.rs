//! Layers: the cross-sections that machines build parts from.

/// A point in a layer's plane, mm.
pub type Point = [f64; 2];

/// The cross-section of a part in one layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// The height of the section, in the middle of the layer, mm.
    pub z: f64,
    /// The lower face of the layer, mm.
    pub bottom: f64,
    /// The upper face, mm.
    pub top: f64,
    /// Simple closed polygons that do not meet: the solid is on the left, so outer contours run counter-clockwise and holes
    /// clockwise. The first point is not repeated. Coordinates are single-precision numbers.
    pub loops: Vec<Vec<Point>>,
}

impl Layer {
    /// The layer's thickness, mm.
    pub fn height(&self) -> f64 {
        self.top - self.bottom
    }

    /// The area of the section, mm²: the sum of ½ Σ (x_i y_{i+1} − x_{i+1} y_i) over the contours.
    pub fn area(&self) -> f64 {
        self.loops.iter().map(|l| signed_area(l)).sum()
    }
}

/// The area of a closed polygon, mm²: positive if it runs counter-clockwise.
pub fn signed_area(polygon: &[Point]) -> f64 {
    let Some(&[ox, oy]) = polygon.first() else { return 0.0 };
    let next = polygon.iter().cycle().skip(1);
    // About a corner of its own: small polygons far from the origin lose nothing.
    0.5 * polygon.iter().zip(next).map(|(a, b)| (a[0] - ox) * (b[1] - oy) - (b[0] - ox) * (a[1] - oy)).sum::<f64>()
}

/// The length of a vector in the plane.
#[inline]
pub fn length([x, y]: Point) -> f64 {
    (x * x + y * y).sqrt()
}
