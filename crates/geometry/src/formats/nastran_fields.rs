//! Fields of Nastran's bulk data: real numbers in as many characters as there are, and grid points.
//!
//! Source: MSC Nastran Quick Reference Guide, section Bulk Data Entries: small fields have 8 characters, large ones 16; a real number has a
//! point; its exponent needs no letter.

use std::io;

use crate::math::Vec3;

/// Greatest number of a node or an element in a small field.
const MOST: usize = 99_999_999;

/// A real number in at most `width` characters: exact where that is enough, else the nearest that fits.
pub(crate) fn real(v: f64, width: usize) -> String {
    let whole = |text: String| if text.contains(['.', 'e']) { text } else { text + "." };
    let plain = whole(v.to_string());
    if plain.len() <= width {
        return plain;
    }
    let error = |text: &String| (value(text).unwrap_or(f64::INFINITY) - v).abs();
    // 1.5e-3 as 1.5-3, and 1.5e3 as 1.5+3.
    let short = |text: String| match text.split_once('e') {
        Some((digits, power)) if power.starts_with('-') => format!("{digits}{power}"),
        Some((digits, power)) => format!("{digits}+{power}"),
        None => text,
    };
    let powers = (1..17).map(|n| short(format!("{v:.n$e}")));
    let fixed = (1..15).map(|n| format!("{v:.n$}"));
    let fit = fixed.chain(powers).filter(|text| text.len() <= width);
    fit.min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(plain)
}

/// The number that a field of a real number holds.
pub(crate) fn value(word: &str) -> Option<f64> {
    let mut text = word.replace(['d', 'D', 'E'], "e");
    if !text.contains('e')
        && let Some(at) = text.rfind(['+', '-']).filter(|at| *at > 0)
    {
        text.insert(at, 'e');
    }
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

/// The two lines of a grid point, in large fields.
pub(crate) fn grid(number: usize, at: Vec3) -> String {
    let [x, y, z] = at.map(|v| real(v, 16));
    format!("GRID*   {number:>16}{:>16}{x:>16}{y:>16}\n*       {z:>16}\n", "")
}

/// Refuses more nodes or elements than small fields can number.
pub(crate) fn check_numbers(counts: [usize; 2]) -> io::Result<()> {
    let most = counts.into_iter().max().unwrap_or(0);
    if most <= MOST {
        return Ok(());
    }
    let message = format!("{most} nodes or elements are more than the {MOST} that fields of Nastran can number");
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// With a sign and an exponent of two digits and its sign two decimals are left of eight characters, ten of sixteen.
        #[test]
        fn a_number_fits_and_has_as_many_digits_as_fit(digits in 1.0f64..9.9, sign in prop::bool::ANY, power in -99i32..99) {
            let v = if sign { -digits } else { digits } * 10f64.powi(power);
            for (width, off) in [(8, 6e-3), (16, 1e-10)] {
                let text = real(v, width);
                let back = value(&text).unwrap_or(f64::NAN);
                prop_assert!(text.len() <= width && text.contains('.') && (back - v).abs() <= off * v.abs(), "{v:e} {text}");
            }
        }
    }

    #[test]
    fn numbers_that_fit_are_exact() {
        for (v, text) in [
            (0.1, "0.1"),
            (-2.5, "-2.5"),
            (110.002, "110.002"),
            (3.0, "3."),
            (110.00201, "110.002"),
            (4e-6, "0.000004"),
        ] {
            assert_eq!(real(v, 8), text);
        }
        assert!(check_numbers([5, 100_000_000]).is_err() && check_numbers([99_999_999, 5]).is_ok());
    }
}
