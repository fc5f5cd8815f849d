//! The first root of a cubic in [0, 1] that it crosses upwards.

use geometry::roots::{Bracket, Tolerance};

/// The first position in [0, 1] where the cubic of these ends (a ≤ 0 ≤ b) and end slopes is no longer negative.
pub(super) fn first_root(a: f64, b: f64, slope_a: f64, slope_b: f64) -> f64 {
    // a + s (c1 + s (c2 + s c3)).
    let c1 = slope_a;
    let c2 = 3.0 * (b - a) - 2.0 * slope_a - slope_b;
    let c3 = slope_a + slope_b - 2.0 * (b - a);
    let value = |s: f64| a + s * (c1 + s * (c2 + s * c3));
    let slope = |s: f64| c1 + s * (2.0 * c2 + 3.0 * s * c3);
    // Between its turning points the cubic is monotone.
    let mut stops = [1.0; 3];
    let inner = c2 * c2 - 3.0 * c1 * c3;
    if inner > 0.0 {
        let q = -(c2 + inner.sqrt().copysign(c2));
        let (x, y) = (q / (3.0 * c3), c1 / q);
        let inside = |s: f64| if s > 0.0 && s < 1.0 { s } else { 1.0 };
        let (x, y) = (inside(x), inside(y));
        stops = [x.min(y), x.max(y), 1.0];
    }
    let mut lo = 0.0;
    for hi in stops {
        if value(hi) < 0.0 && hi < 1.0 {
            lo = hi;
            continue;
        }
        let (l, h) = (value(lo), value(hi));
        // The chord's guess.
        let start = if h > l { lo - l * (hi - lo) / (h - l) } else { lo };
        return Bracket::of_signs(lo, hi).newton(start, Tolerance::absolute(1e-13), |s| [value(s), slope(s)]);
    }
    1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_root_is_found() {
        // (s − ¼)(s − ½)(s − ¾) rises through ¼, falls through ½, rises through ¾.
        let value = |s: f64| (s - 0.25) * (s - 0.5) * (s - 0.75);
        let slope = |s: f64| (s - 0.5) * (s - 0.75) + (s - 0.25) * (s - 0.75) + (s - 0.25) * (s - 0.5);
        let found = first_root(value(0.0), value(1.0), slope(0.0), slope(1.0));
        assert!((found - 0.25).abs() < 1e-12, "{found}");
        // Lines, and ends that are zero.
        assert!((first_root(-1.0, 3.0, 4.0, 4.0) - 0.25).abs() < 1e-12);
        assert_eq!(first_root(0.0, 1.0, 1.0, 1.0), 0.0);
        assert!(first_root(-1.0, 0.0, 1.0, 1.0) > 1.0 - 1e-6);
        // Whatever the slopes at its ends, a cubic from below to above has a root.
        for i in 0..200 {
            let g = [0.37, 0.71].map(|k: f64| 40.0 * ((k * f64::from(i)).fract() - 0.5));
            let s = first_root(-1.0, 2.0, g[0], g[1]);
            let at = |s: f64| {
                let (c2, c3) = (9.0 - 2.0 * g[0] - g[1], g[0] + g[1] - 6.0);
                -1.0 + s * (g[0] + s * (c2 + s * c3))
            };
            assert!((0.0..=1.0).contains(&s) && at(s).abs() < 1e-9, "{g:?} {s}");
            let before = (1..50).map(|k| s * f64::from(k) / 50.0);
            assert!(before.into_iter().all(|b| at(b) < 1e-9), "{g:?} {s}");
        }
    }
}
