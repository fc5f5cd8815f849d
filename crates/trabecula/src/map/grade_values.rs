//! Values of several grades at once.

use crate::grade::Grade;
use geometry::fault::{Fault, number, position};
use geometry::math::Vec3;

/// Values of several grades at points: one tuple for each point.
pub(super) fn grade_values<const N: usize>(
    of: &[Grade; N],
    points: &[Vec3],
    key: &str,
) -> Result<Vec<[f64; N]>, Fault> {
    let mut out = vec![[0.0; N]; points.len()];
    let mut values = vec![0.0; points.len()];
    for (c, grade) in of.iter().enumerate() {
        grade.values(points, &mut values);
        for (n, (o, v)) in out.iter_mut().zip(&values).enumerate() {
            if !v.is_finite() {
                return Err(Fault::new(
                    key,
                    format!(
                        "found {} at {}; it must be a finite number all over the region's bounds",
                        number(*v),
                        position(points[n])
                    ),
                ));
            }
            o[c] = *v;
        }
    }
    Ok(out)
}
