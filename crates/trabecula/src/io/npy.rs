//! NumPy's array file, version 1.0.

use std::io;

use crate::extract::Voxels;

/// Writes voxels as a uint8 array of shape (nx, ny, nz) in Fortran order: `a[x, y, z]` is 1 where solid.
pub fn write<W: io::Write>(voxels: &Voxels, out: &mut W) -> io::Result<()> {
    let [x, y, z] = voxels.shape;
    let dict = format!("{{'descr': '|u1', 'fortran_order': True, 'shape': ({x}, {y}, {z}), }}");
    // Magic, version and length take 10 bytes; the data begins at a multiple of 64, after a line break.
    let length = (10 + dict.len() + 1).next_multiple_of(64) - 10;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(length as u16).to_le_bytes())?;
    writeln!(out, "{dict:<width$}", width = length - 1)?;
    out.write_all(&voxels.solid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_is_aligned_and_names_the_shape() {
        let voxels = Voxels { origin: [0.0; 3], step: 1.0, shape: [2, 3, 1], solid: vec![1, 0, 1, 0, 0, 1] };
        let mut bytes = Vec::new();
        write(&voxels, &mut bytes).expect("a Vec takes everything");
        let length = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        assert_eq!((10 + length) % 64, 0);
        let text = std::str::from_utf8(&bytes[10..10 + length]).expect("the header is ASCII");
        assert!(text.starts_with("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3, 1), }"));
        assert!(text.ends_with('\n'));
        assert_eq!(bytes[10 + length..], voxels.solid);
    }
}
