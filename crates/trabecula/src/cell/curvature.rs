//! Curvature of the mid-surface f = 0 in space.

use super::series::Series;
use super::thickness::least;
use geometry::math::{Mat3, Vec3, apply, dot, eigen, norm, product, scale, transpose};

/// Least radius of curvature (mm) of the surface f = 0 where phases are u = `to_phase` · x; infinite where it is flat,
/// `None` where there is no surface.
///
/// With n = ∇f/|∇f| and P = 1 − n nᵀ the principal curvatures are eigenvalues of P ∇∇f P / |∇f| (the third is zero).
pub(super) fn radius(series: &Series, to_phase: &Mat3) -> Option<f64> {
    let back = transpose(to_phase);
    let at = |u: Vec3| {
        let (_, g, h) = series.second(u);
        let g = apply(&back, g);
        let steep = norm(g);
        let n = scale(g, 1.0 / steep);
        let h = product(&back, &product(&h, to_phase));
        let hn = apply(&h, n);
        let nhn = dot(n, hn);
        // P H P = H − n (Hn)ᵀ − (Hn) nᵀ + (nᵀHn) n nᵀ.
        let shape = core::array::from_fn(|i| {
            core::array::from_fn(|j| (h[i][j] - n[i] * hn[j] - hn[i] * n[j] + nhn * n[i] * n[j]) / steep)
        });
        let (values, _) = eigen(&shape);
        let most = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        (!most.is_nan()).then_some(1.0 / most)
    };
    least(&|u, v, g| series.gradients(u, v, g), &at)
}

#[cfg(test)]
mod tests {
    use super::super::named;
    use super::*;

    fn series(name: &str) -> Series {
        Series::new(named(name).expect(name).terms()).expect(name)
    }

    /// Twice the least radius, in cells, as the conventions give it (section 4).
    #[test]
    fn folding_limits_of_cubic_cells() {
        for (name, limit) in [("gyroid", 0.37), ("diamond", 0.31), ("primitive", 0.32), ("iwp", 0.21)] {
            let unit = geometry::math::IDENTITY;
            let found = 2.0 * radius(&series(name), &unit).expect("a surface");
            println!("{name} {found:.5}");
            assert!((found - limit).abs() < 0.005, "{name} {found}");
            // Lengths scale, whatever the rotation.
            let turned = geometry::math::rotation([20.0, 35.0, 50.0]).map(|r| scale(r, 0.25));
            let again = 2.0 * radius(&series(name), &turned).expect("a surface");
            assert!((again / (4.0 * found) - 1.0).abs() < 1e-6, "{name} {again}");
        }
    }

    /// cos x + cos y = 1.9 is nearly a circle about the axis; its radius along x is sin a / 2π with cos a = 0.9, and the
    /// radius of curvature there |∇f|³ / (fₓₓ f_y² + …) = sin a / 2π in units of the cell.
    #[test]
    fn round_rods_have_their_radius_and_flat_walls_none() {
        let wave = |hkl, amplitude, phase| super::super::Term { hkl, amplitude, phase };
        let rods = Series::new(vec![wave([1, 0, 0], 1.0, 0.0), wave([0, 1, 0], 1.0, 0.0), wave([0, 0, 0], -1.9, 0.0)])
            .expect("series");
        let a = 0.9f64.acos();
        let found = radius(&rods, &geometry::math::IDENTITY).expect("a surface");
        // Curvature on the axis: f_yy / |f_x| = cos 0 / sin a; on the diagonal cos b / (√2 sin b), cos b = 0.95.
        let b = 0.95f64.acos();
        let on_axis = a.sin() / core::f64::consts::TAU;
        let on_diagonal = 2f64.sqrt() * b.sin() / b.cos() / core::f64::consts::TAU;
        assert!((found - on_axis.min(on_diagonal)).abs() < 1e-5, "{found} {on_axis} {on_diagonal}");
        let walls = Series::new(vec![wave([1, 0, 0], 1.0, 0.0)]).expect("series");
        assert!(radius(&walls, &geometry::math::IDENTITY).is_some_and(|r| r > 1e6));
    }
}
