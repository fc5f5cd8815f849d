//! Decimal text of indices and coordinates.

/// Appends the decimal text of `n`.
#[inline]
pub fn push_u32(out: &mut Vec<u8>, n: u32) {
    out.extend_from_slice(itoa::Buffer::new().format(n).as_bytes());
}

/// Appends the shortest decimal text that reads back as exactly `v` (finite) in single precision; −0 becomes 0.
#[inline]
pub fn push_f32(out: &mut Vec<u8>, v: f32) {
    let mut buffer = zmij::Buffer::new();
    let text = buffer.format_finite(v + 0.0);
    out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
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
        for (v, want) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.1, "0.1"),
            (100.0, "100"),
            (1234567.0, "1234567"),
            (0.001, "0.001"),
            (16777216.0, "16777216"),
            (1e-7, "1e-7"),
        ] {
            assert_eq!(text(v), want);
        }
    }

    #[test]
    fn every_text_reads_back_to_the_same_bits_and_none_is_shorter() {
        let mut seed = 1u64;
        let mut check = |v: f32| {
            let t = text(v);
            assert_eq!(t.parse::<f32>().unwrap().to_bits(), (v + 0.0).to_bits(), "{t}");
            let significant = |t: &str| {
                let mantissa = t.split('e').next().unwrap_or_default().replace(['-', '.'], "");
                mantissa.trim_matches('0').len()
            };
            assert_eq!(significant(&t), significant(&format!("{v:e}")), "{t}");
            assert!(t.len() <= 16, "{t}");
        };
        for _ in 0..100_000 {
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
