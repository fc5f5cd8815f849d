//! PNG, 8-bit RGB (ISO/IEC 15948).

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Encodes RGB rows (from the top) as PNG. Rows missing from `rgb` are black, surplus bytes are left out.
pub fn png(rgb: &[u8], size: [usize; 2]) -> Vec<u8> {
    // The format knows no picture without pixels: one black pixel stands for it.
    let [w, h] = size.map(|n| n.clamp(1, 1 << 24));
    let stride = 3 * w;
    let mut deflater = ZlibEncoder::new(Vec::new(), Compression::new(6));
    let (mut row, mut above) = (vec![0u8; stride], vec![0u8; stride]);
    let mut filtered: [Vec<u8>; 4] = core::array::from_fn(|_| vec![0u8; stride + 1]);
    for y in 0..h {
        let source = rgb.get(y * stride..).unwrap_or(&[]);
        let n = source.len().min(stride);
        row[..n].copy_from_slice(&source[..n]);
        row[n..].fill(0);
        // The filter whose bytes are smallest as signed numbers usually packs best.
        for (kind, out) in [1u8, 2, 4, 0].into_iter().zip(&mut filtered) {
            filter(kind, &row, &above, out);
        }
        let cost = |f: &&Vec<u8>| f[1..].iter().map(|b| u64::from((*b as i8).unsigned_abs())).sum::<u64>();
        if let Some(best) = filtered.iter().min_by_key(cost) {
            // Writing to memory does not fail.
            let _ = deflater.write_all(best);
        }
        core::mem::swap(&mut row, &mut above);
    }
    let packed = deflater.finish().unwrap_or_default();
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::with_capacity(13);
    header.extend((w as u32).to_be_bytes());
    header.extend((h as u32).to_be_bytes());
    header.extend([8, 2, 0, 0, 0]);
    chunk(&mut out, b"IHDR", &header);
    chunk(&mut out, b"sRGB", &[0]);
    chunk(&mut out, b"IDAT", &packed);
    chunk(&mut out, b"IEND", &[]);
    out
}

fn chunk(out: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let start = out.len();
    out.extend(kind);
    out.extend(data);
    let mut crc = flate2::Crc::new();
    crc.update(&out[start..]);
    out.extend(crc.sum().to_be_bytes());
}

/// One filtered row with its leading filter number.
fn filter(kind: u8, row: &[u8], above: &[u8], out: &mut [u8]) {
    out[0] = kind;
    for i in 0..row.len() {
        let left = if i >= 3 { row[i - 3] } else { 0 };
        let corner = if i >= 3 { above[i - 3] } else { 0 };
        let guess = match kind {
            1 => left,
            2 => above[i],
            4 => paeth(left, above[i], corner),
            _ => 0,
        };
        out[i + 1] = row[i].wrapping_sub(guess);
    }
}

/// Whichever of left, above and corner is nearest to left + above − corner.
fn paeth(left: u8, above: u8, corner: u8) -> u8 {
    let (a, b, c) = (i16::from(left), i16::from(above), i16::from(corner));
    let p = a + b - c;
    let (da, db, dc) = ((p - a).abs(), (p - b).abs(), (p - c).abs());
    if da <= db && da <= dc {
        left
    } else if db <= dc {
        above
    } else {
        corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Reads back what `png` writes.
    fn decode(bytes: &[u8]) -> (usize, usize, Vec<u8>) {
        assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
        let mut at = 8;
        let (mut size, mut data) = ((0, 0), Vec::new());
        while at < bytes.len() {
            let word = |i: usize| u32::from_be_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
            let n = word(at) as usize;
            let mut crc = flate2::Crc::new();
            crc.update(&bytes[at + 4..at + 8 + n]);
            assert_eq!(crc.sum(), word(at + 8 + n));
            match &bytes[at + 4..at + 8] {
                b"IHDR" => size = (word(at + 8) as usize, word(at + 12) as usize),
                b"IDAT" => data.extend(&bytes[at + 8..at + 8 + n]),
                _ => {}
            }
            at += 12 + n;
        }
        let mut raw = Vec::new();
        assert!(flate2::read::ZlibDecoder::new(&data[..]).read_to_end(&mut raw).is_ok());
        let stride = 3 * size.0;
        let mut out = vec![0u8; stride * size.1];
        for y in 0..size.1 {
            let line = &raw[y * (stride + 1)..(y + 1) * (stride + 1)];
            for i in 0..stride {
                let get = |dy: usize, di: usize| {
                    if y < dy || i < di { 0 } else { out[(y - dy) * stride + i - di] }
                };
                let guess = match line[0] {
                    0 => 0,
                    1 => get(0, 3),
                    2 => get(1, 0),
                    _ => paeth(get(0, 3), get(1, 0), get(1, 3)),
                };
                out[y * stride + i] = line[i + 1].wrapping_add(guess);
            }
        }
        (size.0, size.1, out)
    }

    #[test]
    fn pictures_come_back() {
        for (w, h) in [(1, 1), (3, 2), (17, 31), (640, 5)] {
            let rgb: Vec<u8> = (0..w * h * 3).map(|i| ((i * i) ^ (i >> 3)) as u8).collect();
            assert_eq!(decode(&png(&rgb, [w, h])), (w, h, rgb));
        }
    }

    #[test]
    fn odd_input_is_no_panic() {
        assert_eq!(decode(&png(&[], [0, 0])), (1, 1, vec![0; 3]));
        assert_eq!(decode(&png(&[9], [2, 2])).2, [9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}
