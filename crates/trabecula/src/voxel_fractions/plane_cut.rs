//! A plane in the cube [−1, 1]³: the volume on its negative side, and its part within the cube.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};

/// The linear function `value` + `slope` · ξ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFunction {
    /// Value at the centre of the cube.
    pub value: f64,
    /// Gradient.
    pub slope: Vec3,
}

impl LinearFunction {
    /// The value at a point.
    pub fn at(&self, p: Vec3) -> f64 {
        self.value + dot(self.slope, p)
    }

    /// The length of the gradient.
    pub fn steepness(&self) -> f64 {
        norm(self.slope)
    }

    /// The greatest change from the centre to a corner.
    pub fn rise(&self) -> f64 {
        self.slope.iter().map(|s| s.abs()).sum()
    }

    /// The function, or its negative.
    pub fn oriented(&self, up: bool) -> LinearFunction {
        let s = if up { 1.0 } else { -1.0 };
        LinearFunction { value: s * self.value, slope: scale(self.slope, s) }
    }

    /// Whether the two are nowhere in the cube both positive: a positive combination of them is not.
    pub fn excludes(&self, other: &LinearFunction) -> bool {
        let (a, b) = (1.0 / self.steepness().max(f64::MIN_POSITIVE), 1.0 / other.steepness().max(f64::MIN_POSITIVE));
        let sum = LinearFunction {
            value: a * self.value + b * other.value,
            slope: add(scale(self.slope, a), scale(other.slope, b)),
        };
        sum.value + sum.rise() <= 0.0
    }
}

/// The share of the cube in which the function is negative (Scardovelli and Zaleski, J. Comput. Phys. 164 (2000) 228).
pub fn below(plane: &LinearFunction) -> f64 {
    let total = plane.rise();
    if total <= plane.value.abs() {
        return if plane.value < 0.0 { 1.0 } else { 0.0 };
    }
    let mut m = plane.slope.map(|s| s.abs() / total);
    m.sort_by(f64::total_cmp);
    let [mut m1, m2, m3] = m;
    // 0 at the lowest corner, 1 at the highest.
    let whole = 0.5 * (1.0 - plane.value / total);
    let mut a = whole.min(1.0 - whole);
    if m1 < 1e-5 {
        // The plane is as good as parallel to this axis: off by the square of the slope.
        a -= 0.5 * m1;
        m1 = 0.0;
        if a <= 0.0 {
            return if whole < 0.5 { 0.0 } else { 1.0 };
        }
    }
    let m12 = m1 + m2;
    let cube = |v: f64| v * v * v;
    let six = 6.0 * m1 * m2 * m3;
    let v = if a < m1 {
        cube(a) / six
    } else if a < m2 {
        (a * (a - m1) + m1 * m1 / 3.0) / (2.0 * m2 * m3)
    } else if a >= m12.min(m3) && m3 >= m12 {
        (2.0 * a - m12) / (2.0 * m3)
    } else if a < m3 {
        (cube(a) - cube(a - m1) - cube(a - m2)) / six
    } else {
        (cube(a) - cube(a - m1) - cube(a - m2) - cube(a - m3)) / six
    };
    let v = v.clamp(0.0, 0.5);
    if whole <= 0.5 { v } else { 1.0 - v }
}

/// Points and weights that integrate quadratic functions exactly over the part of the plane in the cube.
pub fn patch(plane: &LinearFunction) -> (Vec<Vec3>, Vec<f64>) {
    let polygon = section(plane);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    if polygon.len() < 3 {
        return (points, weights);
    }
    for pair in polygon[1..].windows(2) {
        let corners = [polygon[0], pair[0], pair[1]];
        let area = 0.5 * norm(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])));
        for i in 0..3 {
            points.push(scale(add(corners[i], corners[(i + 1) % 3]), 0.5));
            weights.push(area / 3.0);
        }
    }
    (points, weights)
}

/// The polygon in which the plane meets the cube: a square of the plane, clipped by the six faces.
fn section(plane: &LinearFunction) -> Vec<Vec3> {
    let steep = plane.steepness();
    if steep == 0.0 || plane.value.abs() >= plane.rise() {
        return Vec::new();
    }
    let normal = scale(plane.slope, 1.0 / steep);
    let foot = scale(normal, -plane.value / steep);
    let least = (0..3).min_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs())).unwrap_or(0);
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let u = cross(normal, axis);
    let u = scale(u, 4.0 / norm(u));
    let v = cross(normal, u);
    let corner = |a: f64, b: f64| add(foot, add(scale(u, a), scale(v, b)));
    let mut polygon = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    for face in 0..6 {
        let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let inside = |p: Vec3| 1.0 - sign * p[axis];
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for i in 0..polygon.len() {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (a, b) = (inside(p), inside(q));
            if a >= 0.0 {
                kept.push(p);
            }
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                kept.push(add(p, scale(sub(q, p), a / (a - b))));
            }
        }
        polygon = kept;
    }
    polygon
}
