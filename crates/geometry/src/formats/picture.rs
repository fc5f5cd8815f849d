//! Grey pictures: PNG (ISO/IEC 15948), and the plain part of TIFF 6.0, of which a file may hold many.

use std::io::Read;

use flate2::read::ZlibDecoder;

use crate::fault::Fault;

/// Most pixels of a picture.
const MOST: usize = 1 << 28;

/// A grey picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row, and rows.
    pub size: [usize; 2],
    /// Numbers as they stand in the file, row by row from the top.
    pub values: Vec<f64>,
}

/// The pictures in a file: one in a PNG, one or more in a TIFF. What kind it is its first bytes say.
///
/// # Errors
/// Neither of the two, colours, interlaced or tiled pixels, a packing that is not read here, too few bytes.
pub fn read_pictures(bytes: &[u8]) -> Result<Vec<Picture>, Fault> {
    match bytes.get(..4) {
        Some(b"\x89PNG") => Ok(vec![png(bytes)?]),
        Some(b"II*\0" | b"MM\0*") => tiff(bytes),
        _ => Err(fault("neither a PNG nor a TIFF picture")),
    }
}

fn fault(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

fn cut() -> Fault {
    fault("the file ends early: truncated")
}

fn pixels(size: [usize; 2]) -> Result<usize, Fault> {
    let all = size[0].checked_mul(size[1]).filter(|n| *n > 0 && *n <= MOST);
    all.ok_or_else(|| fault(format!("a picture of {} × {} pixels", size[0], size[1])))
}

/// What is packed, no more than `most` bytes of it.
fn unpacked(packed: &[u8], most: usize) -> Result<Vec<u8>, Fault> {
    let mut out = Vec::new();
    let read = ZlibDecoder::new(packed).take(most as u64).read_to_end(&mut out);
    read.map_err(|e| fault(format!("its pixels do not unpack: {e}")))?;
    if out.len() < most { Err(cut()) } else { Ok(out) }
}

/// The numbers of a row of samples of some bits, the highest first.
fn samples(row: &[u8], bits: usize, count: usize) -> Vec<f64> {
    let one = |i: usize| match bits {
        8 => f64::from(row[i]),
        16 => f64::from(u16::from_be_bytes([row[2 * i], row[2 * i + 1]])),
        _ => {
            let at = i * bits;
            let shift = 8 - bits - at % 8;
            f64::from(row[at / 8] >> shift & ((1u16 << bits) - 1) as u8)
        }
    };
    (0..count).map(one).collect()
}

/// Grey of a pixel of several channels: the first, if those of a colour agree; the last of two or four is how opaque it is.
fn grey(row: &[f64], channels: usize) -> Result<Vec<f64>, Fault> {
    let each = row.chunks_exact(channels).map(|p| {
        let colours = &p[..channels - usize::from(channels.is_multiple_of(2))];
        let same = colours.iter().all(|v| *v == colours[0]);
        same.then_some(p[0]).ok_or_else(|| fault("a picture in colours; a grade needs grey ones"))
    });
    each.collect()
}

fn png(bytes: &[u8]) -> Result<Picture, Fault> {
    let (mut at, mut header, mut packed) = (8, None, Vec::new());
    loop {
        let head = bytes.get(at..at + 8).ok_or_else(cut)?;
        let long = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let data = bytes.get(at + 8..).and_then(|b| b.get(..long)).ok_or_else(cut)?;
        match &head[4..] {
            b"IHDR" => header = Some(data),
            b"IDAT" => packed.extend_from_slice(data),
            b"IEND" => break,
            _ => {}
        }
        at += long + 12;
    }
    let h = header.filter(|h| h.len() >= 13).ok_or_else(cut)?;
    let side = |i: usize| u32::from_be_bytes([h[i], h[i + 1], h[i + 2], h[i + 3]]) as usize;
    let (size, bits) = ([side(0), side(4)], usize::from(h[8]));
    let channels = match h[9] {
        0 => 1,
        2 => 3,
        4 => 2,
        6 => 4,
        _ => {
            return Err(fault("a picture with a palette of colours; a grade needs grey ones"));
        }
    };
    if h[12] != 0 {
        return Err(fault("an interlaced PNG; save it without interlacing"));
    }
    if ![1, 2, 4, 8, 16].contains(&bits) {
        return Err(fault(format!("a PNG of {bits} bits")));
    }
    pixels(size)?;
    let wide = (size[0] * channels * bits).div_ceil(8);
    let back = (channels * bits).div_ceil(8);
    let mut all = unpacked(&packed, (wide + 1) * size[1])?;
    let (mut above, mut values) = (vec![0u8; wide], Vec::new());
    for line in all.chunks_exact_mut(wide + 1) {
        let (kind, row) = (line[0], &mut line[1..]);
        for i in 0..wide {
            let left = if i < back { 0 } else { row[i - back] };
            let corner = if i < back { 0 } else { above[i - back] };
            let guess = match kind {
                0 => 0,
                1 => left,
                2 => above[i],
                3 => ((u16::from(left) + u16::from(above[i])) / 2) as u8,
                4 => nearest(left, above[i], corner),
                _ => return Err(fault(format!("a PNG row with filter {kind}"))),
            };
            row[i] = row[i].wrapping_add(guess);
        }
        values.extend(grey(&samples(row, bits, size[0] * channels), channels)?);
        above.copy_from_slice(row);
    }
    Ok(Picture { size, values })
}

/// Paeth's guess: of left, above and corner the one nearest to left + above − corner.
fn nearest(left: u8, above: u8, corner: u8) -> u8 {
    let [a, b, c] = [left, above, corner].map(i16::from);
    let off = |v: i16| (a + b - c - v).abs();
    if off(a) <= off(b) && off(a) <= off(c) {
        left
    } else if off(b) <= off(c) {
        above
    } else {
        corner
    }
}

/// The numbers of a TIFF file in its own order of bytes.
struct Tiff<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl Tiff<'_> {
    fn number(&self, at: usize, long: usize) -> Result<usize, Fault> {
        let b = self.bytes.get(at..at + long).ok_or_else(cut)?;
        let next = |n: usize, b: &u8| n << 8 | usize::from(*b);
        Ok(if self.little { b.iter().rev().fold(0, next) } else { b.iter().fold(0, next) })
    }

    /// The numbers of an entry of a directory.
    fn entry(&self, at: usize) -> Result<Vec<usize>, Fault> {
        let long = match self.number(at + 2, 2)? {
            3 => 2,
            4 => 4,
            _ => 1,
        };
        let count = self.number(at + 4, 4)?;
        if count > self.bytes.len() {
            return Err(cut());
        }
        let from = if count * long <= 4 { at + 8 } else { self.number(at + 8, 4)? };
        (0..count).map(|i| self.number(from + i * long, long)).collect()
    }
}

fn tiff(bytes: &[u8]) -> Result<Vec<Picture>, Fault> {
    let file = Tiff { bytes, little: bytes[0] == b'I' };
    let (mut next, mut seen, mut out) = (file.number(4, 4)?, Vec::new(), Vec::new());
    while next != 0 {
        if seen.contains(&next) {
            return Err(fault("a TIFF whose pictures go round in a ring"));
        }
        seen.push(next);
        let count = file.number(next, 2)?;
        let tag = |wanted: usize| -> Result<Option<Vec<usize>>, Fault> {
            for i in 0..count {
                let at = next + 2 + 12 * i;
                if file.number(at, 2)? == wanted {
                    return file.entry(at).map(Some);
                }
            }
            Ok(None)
        };
        let one = |wanted: usize, usual: usize| -> Result<usize, Fault> {
            Ok(tag(wanted)?.and_then(|v| v.first().copied()).unwrap_or(usual))
        };
        let size = [one(256, 0)?, one(257, 0)?];
        let all = pixels(size)?;
        let (bits, packing, channels) = (one(258, 1)?, one(259, 1)?, one(277, 1)?);
        let (format, step) = (one(339, 1)?, one(317, 1)?);
        if channels != 1 || one(262, 1)? > 1 {
            return Err(fault("a TIFF in colours; a grade needs grey ones"));
        }
        let known = match format {
            1 | 2 => [8, 16, 32].contains(&bits),
            3 => [32, 64].contains(&bits),
            _ => false,
        };
        if !known {
            return Err(fault(format!(
                "a TIFF of {bits} bits (sample format {format}); whole numbers of 8, 16 or 32 bits and floating ones of 32 \
                 or 64 are read"
            )));
        }
        if step != 1 && !(step == 2 && format < 3) {
            return Err(fault(format!("a TIFF with predictor {step}; save it without one")));
        }
        let Some(starts) = tag(273)? else {
            return Err(fault("a TIFF in tiles; save it in strips"));
        };
        let lengths = tag(279)?.unwrap_or_default();
        let (rows, wide) = (one(278, size[1])?.clamp(1, size[1]), size[0] * bits / 8);
        let mut values = Vec::with_capacity(all);
        for (i, start) in starts.iter().enumerate() {
            let here = rows.min(size[1].saturating_sub(i * rows)) * wide;
            let long = lengths.get(i).copied().unwrap_or(here);
            let packed = bytes.get(*start..).and_then(|b| b.get(..long)).ok_or_else(cut)?;
            let strip = match packing {
                1 => packed.get(..here).ok_or_else(cut)?.to_vec(),
                8 | 32946 => unpacked(packed, here)?,
                other => {
                    return Err(fault(format!("a TIFF with compression {other}; save it without one, or deflated")));
                }
            };
            for row in strip.chunks_exact(wide) {
                values.extend(tiff_row(row, bits, format, file.little, step == 2));
            }
        }
        if values.len() != all {
            return Err(cut());
        }
        out.push(Picture { size, values });
        next = file.number(next + 2 + 12 * count, 4)?;
    }
    if out.is_empty() { Err(fault("a TIFF without pictures")) } else { Ok(out) }
}

fn tiff_row(row: &[u8], bits: usize, format: usize, little: bool, steps: bool) -> Vec<f64> {
    let mut last = 0u64;
    let each = row.chunks_exact(bits / 8).map(|b| {
        let mut v = 0u64;
        for i in 0..b.len() {
            v = v << 8 | u64::from(b[if little { b.len() - 1 - i } else { i }]);
        }
        if steps {
            v = v.wrapping_add(last) & (u64::MAX >> (64 - bits));
            last = v;
        }
        match (format, bits) {
            (3, 32) => f64::from(f32::from_bits(v as u32)),
            (3, _) => f64::from_bits(v),
            (2, 8) => f64::from(v as u8 as i8),
            (2, 16) => f64::from(v as u16 as i16),
            (2, _) => f64::from(v as u32 as i32),
            _ => v as f64,
        }
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render;

    /// A TIFF of pictures in one strip each, in either order of bytes.
    fn tiff_of(pictures: &[(usize, Vec<u8>)], wide: usize, format: usize, little: bool, packing: usize) -> Vec<u8> {
        let put = |out: &mut Vec<u8>, v: usize, long: usize| {
            let b = (v as u32).to_be_bytes();
            let b = &b[4 - long..];
            if little { out.extend(b.iter().rev()) } else { out.extend(b) }
        };
        let mut out = if little { b"II*\0".to_vec() } else { b"MM\0*".to_vec() };
        let directory = 2 + 12 * 8 + 4;
        let mut at = 8;
        put(&mut out, at, 4);
        for (i, (bits, data)) in pictures.iter().enumerate() {
            let high = data.len() * 8 / bits / wide;
            let data = match packing {
                1 => data.clone(),
                _ => {
                    let mut z = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
                    std::io::Write::write_all(&mut z, data).expect("memory");
                    z.finish().expect("memory")
                }
            };
            let tags = [
                (256, wide),
                (257, high),
                (258, *bits),
                (259, packing),
                (262, 1),
                (273, at + directory),
                (279, data.len()),
                (339, format),
            ];
            put(&mut out, tags.len(), 2);
            for (tag, v) in tags {
                put(&mut out, tag, 2);
                put(&mut out, 4, 2);
                put(&mut out, 1, 4);
                put(&mut out, v, 4);
            }
            at += directory + data.len();
            put(&mut out, if i + 1 < pictures.len() { at } else { 0 }, 4);
            out.extend(data);
        }
        out
    }

    #[test]
    fn our_own_pictures_come_back() {
        // Grey in all three channels, and every filter wins somewhere.
        let size = [37, 23];
        let level = |i: usize| ((i % 37) * 5 + (i / 37) * (i / 37) + (i * i) % 7) as u8;
        let rgb: Vec<u8> = (0..37 * 23).flat_map(|i| [level(i); 3]).collect();
        let bytes = render::png(&rgb, size);
        let made = read_pictures(&bytes).expect("picture");
        let want: Vec<f64> = (0..37 * 23).map(|i| f64::from(level(i))).collect();
        assert_eq!(made, [Picture { size, values: want }]);
        let coloured: Vec<u8> = (0..37 * 23).flat_map(|i| [level(i), 0, 9]).collect();
        let words = read_pictures(&render::png(&coloured, size)).expect_err("colours").message;
        assert!(words.contains("colours"), "{words}");
        for end in [3, 20, 60, bytes.len() - 13] {
            assert!(read_pictures(&bytes[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn tiffs_of_all_widths_and_orders_are_read() {
        for little in [true, false] {
            for packing in [1, 8] {
                let short = |v: u16| {
                    if little { v.to_le_bytes() } else { v.to_be_bytes() }
                };
                let float = |v: f32| {
                    if little { v.to_le_bytes() } else { v.to_be_bytes() }
                };
                let eight = tiff_of(&[(8, vec![0, 1, 200, 255, 7, 9]), (8, vec![1; 6])], 3, 1, little, packing);
                let made = read_pictures(&eight).expect("two");
                assert_eq!(made[0].values, [0.0, 1.0, 200.0, 255.0, 7.0, 9.0]);
                assert_eq!((made.len(), made[1].size), (2, [3, 2]));
                let data: Vec<u8> = [1u16, 65535, 300, 0].into_iter().flat_map(short).collect();
                let made = read_pictures(&tiff_of(&[(16, data)], 2, 1, little, packing)).expect("short");
                assert_eq!(made[0].values, [1.0, 65535.0, 300.0, 0.0]);
                let data: Vec<u8> = [0.5f32, -2.25].into_iter().flat_map(float).collect();
                let made = read_pictures(&tiff_of(&[(32, data)], 1, 3, little, packing)).expect("float");
                assert_eq!(made[0].values, [0.5, -2.25]);
                for end in 4..eight.len() {
                    assert!(read_pictures(&eight[..end]).is_err(), "{end}");
                }
            }
        }
        let odd = tiff_of(&[(8, vec![1; 6])], 3, 1, true, 1);
        let mut ring = odd.clone();
        // The offset of the next picture is that of the first.
        let at = 8 + 2 + 12 * 8;
        ring[at] = 8;
        assert!(read_pictures(&ring).expect_err("ring").message.contains("ring"));
        assert!(read_pictures(b"GIF89a").is_err() && read_pictures(b"").is_err());
    }
}
