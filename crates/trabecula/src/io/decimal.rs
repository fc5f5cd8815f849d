//! Numbers as decimal text that parses back to the same value, fast.

use std::io::Write as _;

/// Appends an unsigned integer.
#[inline]
pub(super) fn push_u64(out: &mut Vec<u8>, mut n: u64) {
    let mut digits = [0u8; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (n % 10) as u8;
        n /= 10;
        if n == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[at..]);
}

/// Appends a finite f64 as the shortest text that parses back to it; zero has no sign.
pub(super) fn push_f64(out: &mut Vec<u8>, x: f64) {
    // Writing to a Vec cannot fail.
    let _ = match x.abs() {
        0.0 => write!(out, "0"),
        1e-6..1e16 => write!(out, "{x}"),
        _ => write!(out, "{x:e}"),
    };
}

const POWERS: [f64; 12] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11];

/// Decimals at which neighbouring decimals are closer than neighbouring f32 of exponent `e`: the least d with
/// 10^-d < 2^(e-24), the gap below 2^e. Rounding to d decimals then always parses back to the same f32.
const DECIMALS: [u8; 30] = {
    let mut table = [0; 30];
    let mut i = 0;
    while i < table.len() {
        let mut d = 0;
        // e = i - 10; 10^d > 2^(24-e) = 2^(34-i).
        while 10u64.pow(d) <= 1u64 << (34 - i as u32) {
            d += 1;
        }
        table[i] = d as u8;
        i += 1;
    }
    table
};

/// Appends a finite f32 as text that parses back to it, the shortest or one digit longer; zero has no sign.
#[inline]
pub(super) fn push_f32(out: &mut Vec<u8>, x: f32) {
    let exponent = (x.to_bits() >> 23 & 0xff) as i32 - 127;
    // Outside 2^-10 to 2^20 numbers are rare and may take their time.
    if !(-10..20).contains(&exponent) {
        // Writing to a Vec cannot fail.
        let _ = match x.abs() {
            0.0 => write!(out, "0"),
            1e-6..1e9 => write!(out, "{x}"),
            _ => write!(out, "{x:e}"),
        };
        return;
    }
    let wide = f64::from(x.abs());
    let mut decimals = DECIMALS[(exponent + 10) as usize] as usize;
    let mut scaled = (wide * POWERS[decimals] + 0.5) as u64;
    // Two decimals fewer often do; one fewer nearly always.
    for fewer in [2, 1] {
        if let Some(less) = decimals.checked_sub(fewer) {
            let n = (wide * POWERS[less] + 0.5) as u64;
            if (n as f64 / POWERS[less]) as f32 == x.abs() {
                (scaled, decimals) = (n, less);
                break;
            }
        }
    }
    while decimals > 0 && scaled.is_multiple_of(10) {
        scaled /= 10;
        decimals -= 1;
    }
    // Sign, whole part, point, decimals: written backwards.
    let mut digits = [0u8; 24];
    let mut at = digits.len();
    let mut written = 0;
    while written <= decimals || scaled > 0 {
        if written == decimals && decimals > 0 {
            at -= 1;
            digits[at] = b'.';
        }
        at -= 1;
        digits[at] = b'0' + (scaled % 10) as u8;
        scaled /= 10;
        written += 1;
    }
    if x < 0.0 {
        at -= 1;
        digits[at] = b'-';
    }
    out.extend_from_slice(&digits[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn f32_text(x: f32) -> String {
        let mut out = Vec::new();
        push_f32(&mut out, x);
        String::from_utf8(out).expect("digits are ASCII")
    }

    #[test]
    fn plain_numbers_are_plain() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-12.5, "-12.5"),
            (0.1, "0.1"),
            (10.0, "10"),
            (0.05, "0.05"),
            (-0.00125, "-0.00125"),
            (123456.0, "123456"),
            (1e-9, "1e-9"),
            (1e20, "1e20"),
        ] {
            assert_eq!(f32_text(x), text);
        }
    }

    #[test]
    fn every_f32_parses_back_and_is_short() {
        let mut state = 1u64;
        for i in 0..2_000_000u32 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let bits = (state >> 32) as u32;
            // Half over all bit patterns, half over the sizes of parts.
            let x = match i % 2 {
                0 => f32::from_bits(bits),
                _ => f32::from_bits(bits & 0x807f_ffff | (115 + (bits >> 23 & 0xff) % 36) << 23),
            };
            if !x.is_finite() {
                continue;
            }
            let text = f32_text(x);
            assert_eq!(text.parse::<f32>(), Ok(x), "{text}");
            // Readers that parse as f64 first must land on the same f32.
            assert_eq!(text.parse::<f64>().map(|w| w as f32), Ok(x), "{text}");
            let shortest = format!("{x}").len().min(format!("{x:e}").len() + 5);
            assert!(text.len() <= shortest + 1, "{text} for {x}");
        }
    }

    #[test]
    fn powers_of_two_and_their_neighbours_parse_back() {
        for e in -126..127i32 {
            let x = 2f32.powi(e);
            for x in [x.next_down(), x, x.next_up()] {
                assert_eq!(f32_text(x).parse::<f32>(), Ok(x));
                assert_eq!(f32_text(-x).parse::<f32>(), Ok(-x));
            }
        }
    }

    #[test]
    fn f64_parses_back() {
        for x in [0.1, -1.0 / 3.0, 1e300, -5e-324, 123456789.125, 1e16, 1e-6] {
            let mut out = Vec::new();
            push_f64(&mut out, x);
            assert_eq!(String::from_utf8(out).expect("ASCII").parse::<f64>(), Ok(x));
        }
    }
}
