//! Fast decimal text of integers and single-precision numbers.

use std::io::Write;

/// "00" to "99".
static PAIRS: [u8; 200] = {
    let mut t = [0; 200];
    let mut i = 0;
    while i < 100 {
        t[2 * i] = b'0' + (i / 10) as u8;
        t[2 * i + 1] = b'0' + (i % 10) as u8;
        i += 1;
    }
    t
};

/// Appends the digits of `n`, at least `width` (up to 20) of them.
#[inline]
fn push_padded(out: &mut Vec<u8>, mut n: u64, width: usize) {
    let mut text = [b'0'; 20];
    let digits = width.max(n.checked_ilog10().map_or(1, |d| d as usize + 1));
    let mut at = digits;
    while n >= 100 {
        let pair = (n % 100) as usize * 2;
        n /= 100;
        at -= 2;
        text[at..at + 2].copy_from_slice(&PAIRS[pair..pair + 2]);
    }
    if n >= 10 {
        at -= 2;
        text[at..at + 2].copy_from_slice(&PAIRS[n as usize * 2..n as usize * 2 + 2]);
    } else if n > 0 {
        at -= 1;
        text[at] = b'0' + n as u8;
    }
    // A copy of known size costs less than one of as many bytes as are wanted.
    let end = out.len() + digits;
    out.extend_from_slice(&text);
    out.truncate(end);
}

/// Appends the decimal text of `n`.
#[inline]
pub fn push_u32(out: &mut Vec<u8>, n: u32) {
    push_padded(out, u64::from(n), 1);
}

/// Appends decimal text that reads back as exactly `v` (finite) in single precision: seven to nine significant
/// digits, the fewest that do, without trailing zeros.
#[inline]
pub fn push_f32(out: &mut Vec<u8>, v: f32) {
    const POWERS: [u64; 13] = {
        let mut t = [1; 13];
        let mut i = 1;
        while i < 13 {
            t[i] = t[i - 1] * 10;
            i += 1;
        }
        t
    };
    let a = f64::from(v.abs());
    if !(1e-3..1e7).contains(&a) {
        if v == 0.0 {
            out.push(b'0');
        } else {
            // Writing to memory cannot fail.
            let _ = write!(out, "{v:e}");
        }
        return;
    }
    // Any decimal nearer than half the gap to the next number below is read as v.
    let reach = (a - f64::from(f32::from_bits(v.abs().to_bits() - 1))) * 0.4999;
    let mut decimals = [1e6, 1e5, 1e4, 1e3, 1e2, 1e1, 1e0, 1e-1, 1e-2].iter().take_while(|p| a < **p).count();
    let mut n = 0;
    for _ in 0..3 {
        let power = POWERS[decimals] as f64;
        n = (a * power + 0.5) as u64;
        if (n as f64 / power - a).abs() <= reach {
            break;
        }
        decimals += 1;
    }
    decimals = decimals.min(POWERS.len() - 1);
    if v < 0.0 {
        out.push(b'-');
    }
    let (whole, part) = (n / POWERS[decimals], n % POWERS[decimals]);
    push_padded(out, whole, 1);
    if part > 0 {
        out.push(b'.');
        push_padded(out, part, decimals);
        while out.last() == Some(&b'0') {
            out.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(v: f32) -> String {
        let mut out = Vec::new();
        push_f32(&mut out, v);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn known_numbers() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.1, "0.1"),
            (100.0, "100"),
            (1234567.0, "1234567"),
            (0.001, "0.001"),
            (16777216.0, "1.6777216e7"),
            (1e-5, "1e-5"),
        ];
        for (v, want) in cases {
            assert_eq!(text(v), want);
        }
        for n in [0, 7, 10, 99, 100, 12345, u32::MAX] {
            let mut out = Vec::new();
            push_u32(&mut out, n);
            assert_eq!(out, n.to_string().as_bytes());
        }
    }

    #[test]
    fn every_text_reads_back_to_the_same_bits() {
        let mut seed = 1u64;
        let mut check = |v: f32| {
            let t = text(v);
            assert_eq!(t.parse::<f32>().unwrap().to_bits(), (v + 0.0).to_bits(), "{t}");
            assert!(t.len() <= 16, "{t}");
        };
        for _ in 0..400_000 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let any = f32::from_bits((seed >> 32) as u32);
            if any.is_finite() {
                check(any);
            }
            check(((seed >> 20) as u32 as f32 / 2f32.powi(32) - 0.5) * 200.0);
        }
        for e in -30..30 {
            let p = 2f32.powi(e);
            let ten = 10f32.powi(e);
            [p, p.next_up(), p.next_down(), ten, ten.next_down()].into_iter().for_each(&mut check);
        }
    }
}
