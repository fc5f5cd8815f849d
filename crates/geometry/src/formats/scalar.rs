//! Arrays of numbers as bytes.

/// The type of a number in a file, and its bytes: 4 or 8 of a float, 1, 2, 4 or 8 of an integer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
    Float(usize),
    Signed(usize),
    Unsigned(usize),
}

impl Scalar {
    /// Bytes of one.
    pub fn width(self) -> usize {
        match self {
            Scalar::Float(n) | Scalar::Signed(n) | Scalar::Unsigned(n) => n,
        }
    }

    /// Numbers from bytes, with the highest byte first if `big`; what is left after the last whole one is ignored.
    pub fn decode(self, bytes: &[u8], big: bool) -> Vec<f64> {
        let width = self.width();
        let read = |b: &[u8]| {
            let mut w = [0u8; 8];
            for (i, v) in b.iter().enumerate() {
                w[if big { width - 1 - i } else { i }] = *v;
            }
            let bits = u64::from_le_bytes(w);
            let unused = 64 - 8 * width as u32;
            match self {
                Scalar::Float(4) => f64::from(f32::from_bits(bits as u32)),
                Scalar::Float(_) => f64::from_bits(bits),
                Scalar::Signed(_) => ((bits << unused) as i64 >> unused) as f64,
                Scalar::Unsigned(_) => bits as f64,
            }
        };
        bytes.chunks_exact(width).map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Scalar::*;

    #[test]
    fn numbers_come_back_from_bytes_of_either_order() {
        for v in [0i64, 1, -1, 100, -128, 127] {
            for n in [1, 2, 4, 8] {
                let bytes = &v.to_le_bytes()[..n];
                let turned: Vec<u8> = bytes.iter().rev().copied().collect();
                assert_eq!(
                    (Signed(n).decode(bytes, false), Signed(n).decode(&turned, true)),
                    (vec![v as f64], vec![v as f64])
                );
            }
        }
        assert_eq!(Unsigned(2).decode(&[0xff, 0xfe, 7], false), [f64::from(0xfeff)]);
        assert_eq!(Unsigned(8).decode(&u64::MAX.to_le_bytes(), false), [u64::MAX as f64]);
        assert_eq!(Float(4).decode(&(-0.1f32).to_be_bytes(), true), [f64::from(-0.1f32)]);
        assert_eq!(Float(8).decode(&0.1f64.to_le_bytes(), false), [0.1]);
    }
}
