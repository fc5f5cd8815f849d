//! NumPy's NPY, version 1.0.
//!
//! Source: NumPy Enhancement Proposal 1, A Simple File Format for NumPy Arrays.

use std::io::{self, Write};

use super::invalid;

/// Writes bytes that run with x fastest as an array that NumPy indexes `[x, y, z]` (`uint8`, Fortran order).
///
/// **Errors**: what `out` reports; `InvalidInput` if there are not x·y·z bytes.
pub fn write_npy<W: Write>(shape: [usize; 3], data: &[u8], out: &mut W) -> io::Result<()> {
    let [x, y, z] = shape;
    if x.checked_mul(y).and_then(|n| n.checked_mul(z)) != Some(data.len()) {
        return Err(invalid(format!(
            "an array of {x} × {y} × {z} does not have {} bytes",
            data.len()
        )));
    }
    let mut header =
        format!("{{'descr': '|u1', 'fortran_order': True, 'shape': ({x}, {y}, {z}), }}");
    // Magic, version and length take ten bytes; the data begin at a multiple of 64.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(header.len() as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    out.write_all(data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_is_padded_and_names_the_shape() {
        let mut bytes = Vec::new();
        write_npy([2, 3, 1], &[1, 0, 1, 0, 1, 0], &mut bytes).unwrap();
        assert_eq!(bytes.len(), 128 + 6);
        assert_eq!(bytes[8..10], 118u16.to_le_bytes());
        let header = String::from_utf8_lossy(&bytes[10..128]).to_string();
        assert!(
            header.starts_with("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3, 1), }")
        );
        assert!(header.ends_with(" \n"));
        assert!(write_npy([2, 3, 2], &[0; 6], &mut bytes).is_err());
        assert!(write_npy([usize::MAX, 3, 2], &[0; 6], &mut bytes).is_err());
    }
}
