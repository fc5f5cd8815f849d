//! NumPy's NPY, version 1.0.
//!
//! Source: NumPy Enhancement Proposal 1, A Simple File Format for NumPy Arrays.

use std::io::{self, Write};

use super::invalid;
use super::scalar::Scalar;
use super::text::shown;
use crate::fault::Fault;

/// The numbers of an array and its shape, the first index running fastest.
///
/// **Errors**: no NPY file, a type that is not a number, too few bytes.
pub fn read_npy(bytes: &[u8]) -> Result<(Vec<usize>, Vec<f64>), Fault> {
    let fault = |message: String| Fault::new("", message);
    let cut = || Fault::new("", "the file ends early: truncated");
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(fault("not an NPY file: it does not begin with \\x93NUMPY".into()));
    }
    let version = *bytes.get(6).ok_or_else(cut)?;
    let (length, start): (usize, usize) = if version == 1 {
        let b = bytes.get(8..10).ok_or_else(cut)?;
        (usize::from(u16::from_le_bytes([b[0], b[1]])), 10)
    } else {
        let b = bytes.get(8..12).ok_or_else(cut)?;
        (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize, 12)
    };
    let end = start.checked_add(length).ok_or_else(cut)?;
    let header = String::from_utf8_lossy(bytes.get(start..end).ok_or_else(cut)?);
    let after = |key: &str| {
        let at = header.find(&format!("'{key}'"))? + key.len() + 2;
        header[at..].trim_start().strip_prefix(':').map(str::trim_start)
    };
    let malformed = || fault(format!("the header of the NPY file is malformed: {}", header.trim()));
    if after("descr").is_some_and(|t| t.starts_with('[')) {
        return Err(fault("an array of records holds no plain numbers; save one of their fields as float64".into()));
    }
    let quoted = after("descr").and_then(|t| t.strip_prefix('\'')).ok_or_else(malformed)?;
    let kind = &quoted[..quoted.find('\'').ok_or_else(malformed)?];
    let fortran = after("fortran_order").ok_or_else(malformed)?.starts_with("True");
    let inside = after("shape").and_then(|t| t.strip_prefix('(')).ok_or_else(malformed)?;
    let inside = &inside[..inside.find(')').ok_or_else(malformed)?];
    let shape = inside
        .split(',')
        .map(str::trim)
        .filter(|t| !t.is_empty())
        .map(|t| t.parse().map_err(|_| malformed()))
        .collect::<Result<Vec<usize>, Fault>>()?;
    let count = shape.iter().try_fold(1usize, |n, s| n.checked_mul(*s)).ok_or_else(malformed)?;
    let big = kind.starts_with('>');
    let scalar = match kind.get(1..).unwrap_or_default() {
        "f8" => Scalar::Float(8),
        "f4" => Scalar::Float(4),
        "i8" => Scalar::Signed(8),
        "i4" => Scalar::Signed(4),
        "i2" => Scalar::Signed(2),
        "i1" => Scalar::Signed(1),
        "u8" => Scalar::Unsigned(8),
        "u4" => Scalar::Unsigned(4),
        "u2" => Scalar::Unsigned(2),
        "u1" | "b1" => Scalar::Unsigned(1),
        "f2" => return Err(fault("half precision is not read; save the array as float32 or float64".into())),
        _ => {
            return Err(fault(no_numbers(kind)));
        }
    };
    let need = count.checked_mul(scalar.width()).ok_or_else(cut)?;
    let data = bytes.get(end..).filter(|d| d.len() >= need).ok_or_else(cut)?;
    let mut values = scalar.decode(&data[..need], big);
    if !fortran && shape.len() > 1 {
        // The last index ran fastest.
        let source = values.clone();
        let mut index = vec![0usize; shape.len()];
        for v in &mut values {
            let at = index.iter().zip(&shape).fold(0, |at, (i, n)| at * n + i);
            *v = source[at];
            for (i, n) in index.iter_mut().zip(&shape) {
                *i += 1;
                if *i < *n {
                    break;
                }
                *i = 0;
            }
        }
    }
    Ok((shape, values))
}

/// Explains that an array of a type, such as `<c16`, holds no plain numbers.
fn no_numbers(kind: &str) -> String {
    // Without the mark of the order of bytes.
    let name = kind.trim_start_matches(['<', '>', '|', '=']);
    let of = match name.as_bytes().first() {
        Some(b'c') => "complex numbers",
        Some(b'O') => "Python objects",
        Some(b'U' | b'S' | b'a') => "texts",
        Some(b'M' | b'm') => "times",
        Some(b'V') => "raw bytes",
        _ => return format!("an array of type {} holds no plain numbers; save it as float64", shown(name.as_bytes())),
    };
    format!("an array of {of} (type {}) holds no plain numbers; save real numbers as float64", shown(name.as_bytes()))
}

/// Writes bytes that run with x fastest as an array that NumPy indexes `[x, y, z]` (`uint8`, Fortran order).
///
/// **Errors**: what `out` reports; `InvalidInput` if there are not x·y·z bytes.
pub fn write_npy<W: Write>(shape: [usize; 3], data: &[u8], out: &mut W) -> io::Result<()> {
    let [x, y, z] = shape;
    if x.checked_mul(y).and_then(|n| n.checked_mul(z)) != Some(data.len()) {
        return Err(invalid(format!("an array of {x} × {y} × {z} does not have {} bytes", data.len())));
    }
    write_header(shape, &mut *out)?;
    out.write_all(data)
}

/// What precedes the bytes of such an array.
pub fn npy_head(shape: [usize; 3]) -> Vec<u8> {
    let mut head = Vec::new();
    // Memory takes all that is written.
    drop(write_header(shape, &mut head));
    head
}

/// Writes what precedes the bytes of such an array.
pub(super) fn write_header<W: Write + ?Sized>([x, y, z]: [usize; 3], out: &mut W) -> io::Result<()> {
    let mut header = format!("{{'descr': '|u1', 'fortran_order': True, 'shape': ({x}, {y}, {z}), }}");
    // Magic, version and length take ten bytes; the data begin at a multiple of 64.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(header.len() as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_come_back_in_either_order_and_damage_is_refused() {
        let mut bytes = Vec::new();
        write_npy([2, 3, 1], &[1, 2, 3, 4, 5, 6], &mut bytes).unwrap();
        let (shape, values) = read_npy(&bytes).unwrap();
        assert_eq!((shape, values), (vec![2, 3, 1], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        for n in 0..bytes.len() {
            assert!(read_npy(&bytes[..n]).is_err());
        }
        let of_kind = |kind: &[u8]| {
            let header = [b"{'descr': '", kind, b"', 'fortran_order': False, 'shape': (2, 3), }\n"].concat();
            let mut c = b"\x93NUMPY\x01\x00".to_vec();
            c.extend((header.len() as u16).to_le_bytes());
            c.extend(header);
            c.extend((0..6).flat_map(|v| (v as f32).to_le_bytes()));
            c
        };
        assert_eq!(read_npy(&of_kind(b"<f4")).unwrap().1, [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
        for kind in [&b"\xe9f4"[..], b"", b"<", b"<f3"] {
            assert!(read_npy(&of_kind(kind)).unwrap_err().message.contains("no plain numbers"));
        }
        for (kind, found) in [
            (&b"<c16"[..], "of complex numbers (type \"c16\")"),
            (&b"|O"[..], "of Python objects (type \"O\")"),
            (&b"<U3"[..], "of texts (type \"U3\")"),
            (&b"<f3"[..], "of type \"f3\""),
        ] {
            let why = read_npy(&of_kind(kind)).unwrap_err().message;
            assert!(why.contains(found) && why.contains("no plain numbers"), "{why}");
        }
    }

    #[test]
    fn header_is_padded_and_names_the_shape() {
        let mut bytes = Vec::new();
        write_npy([2, 3, 1], &[1, 0, 1, 0, 1, 0], &mut bytes).unwrap();
        assert_eq!(bytes.len(), 128 + 6);
        assert_eq!(bytes[8..10], 118u16.to_le_bytes());
        let header = String::from_utf8_lossy(&bytes[10..128]).to_string();
        assert!(header.starts_with("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3, 1), }"));
        assert!(header.ends_with(" \n"));
        assert!(write_npy([2, 3, 2], &[0; 6], &mut bytes).is_err());
        assert!(write_npy([usize::MAX, 3, 2], &[0; 6], &mut bytes).is_err());
    }
}
