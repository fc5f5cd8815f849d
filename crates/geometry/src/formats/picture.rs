//! Grey pictures: PNG, and TIFF, of which a file may hold many (crates `png` and `tiff`).

use std::io::{Cursor, ErrorKind};

use png::{ColorType, DecodingError};
use tiff::TiffError;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use crate::fault::Fault;

/// Most pixels of a picture, and of all pictures of a file.
const MOST: usize = 1 << 28;
const MOST_IN_ALL: usize = 1 << 30;

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
/// Neither of the two, colours, a compression that is not read here, too few bytes.
pub fn read_pictures(bytes: &[u8]) -> Result<Vec<Picture>, Fault> {
    match bytes.get(..4) {
        Some(b"\x89PNG") => Ok(vec![read_png(bytes)?]),
        Some(b"II*\0" | b"MM\0*") => read_tiff(bytes),
        _ => Err(fault("neither a PNG nor a TIFF picture")),
    }
}

fn fault(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

fn truncated() -> Fault {
    fault("the file ends early: truncated")
}

fn check_size(size: [usize; 2]) -> Result<usize, Fault> {
    let all = size[0].checked_mul(size[1]).filter(|n| *n > 0 && *n <= MOST);
    all.ok_or_else(|| fault(format!("a picture of {} × {} pixels; 1 to {MOST} are read", size[0], size[1])))
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

/// Grey of a pixel of several channels: the first, if those of a colour agree; the last of two or four is the opacity.
fn grey(row: &[f64], channels: usize) -> Result<Vec<f64>, Fault> {
    let each = row.chunks_exact(channels).map(|p| {
        let colours = &p[..channels - usize::from(channels.is_multiple_of(2))];
        let same = colours.iter().all(|v| *v == colours[0]);
        same.then_some(p[0]).ok_or_else(|| fault("a picture in colours; a grade needs grey ones"))
    });
    each.collect()
}

fn png_fault(e: DecodingError) -> Fault {
    match e {
        DecodingError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => truncated(),
        e => fault(format!("a PNG that cannot be read: {e}")),
    }
}

fn read_png(bytes: &[u8]) -> Result<Picture, Fault> {
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: 8 * MOST });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(png_fault)?;
    let info = reader.info();
    let size = [info.width as usize, info.height as usize];
    let (colour, bits) = (info.color_type, info.bit_depth as usize);
    if colour == ColorType::Indexed {
        return Err(fault("a picture with a palette of colours; a grade needs grey ones"));
    }
    check_size(size)?;
    let mut data = vec![0; reader.output_buffer_size().ok_or_else(truncated)?];
    let frame = reader.next_frame(&mut data).map_err(png_fault)?;
    reader.finish().map_err(png_fault)?;
    let channels = colour.samples();
    let mut values = Vec::with_capacity(size[0] * size[1]);
    for row in data.chunks_exact(frame.line_size) {
        values.extend(grey(&samples(row, bits, size[0] * channels), channels)?);
    }
    Ok(Picture { size, values })
}

fn tiff_fault(e: TiffError) -> Fault {
    match e {
        TiffError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => truncated(),
        e => fault(format!("a TIFF that cannot be read: {e}")),
    }
}

type Tiff<'a> = Decoder<Cursor<&'a [u8]>>;

fn open_tiff(bytes: &[u8]) -> Result<Tiff<'_>, Fault> {
    let mut limits = Limits::default();
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (8 * MOST, 8 * MOST);
    limits.ifd_value_size = bytes.len();
    Ok(Decoder::new(Cursor::new(bytes)).map_err(tiff_fault)?.with_limits(limits))
}

/// A copy in which white-is-zero pictures are black-is-zero ones: the numbers are wanted as they stand in the file.
fn as_black_is_zero(bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    let mut copy = bytes.to_vec();
    let mut file = open_tiff(bytes)?;
    let little = bytes[0] == b'I';
    loop {
        let at = file.ifd_pointer().map_or(0, |p| p.0 as usize);
        let two = |at: usize| {
            let b = bytes.get(at..at + 2).map_or([0; 2], |b| [b[0], b[1]]);
            if little { u16::from_le_bytes(b) } else { u16::from_be_bytes(b) }
        };
        let entries = (0..usize::from(two(at))).map(|i| at + 2 + 12 * i);
        for entry in entries.filter(|e| two(*e) == Tag::PhotometricInterpretation.to_u16()) {
            // The number is of two bytes (type 3) or four.
            let wide = if two(entry + 2) == 3 { 2 } else { 4 };
            if let Some(value) = copy.get_mut(entry + 8..entry + 8 + wide)
                && value.iter().all(|b| *b == 0)
            {
                value[if little { 0 } else { wide - 1 }] = 1;
            }
        }
        if !file.more_images() {
            return Ok(copy);
        }
        file.next_image().map_err(tiff_fault)?;
    }
}

/// Refuses pictures whose pixels lie beyond the end of the file: the last bytes of a packed strip are a checksum.
fn check_ends(file: &mut Tiff, most: usize) -> Result<(), Fault> {
    for (starts, counts) in [(Tag::StripOffsets, Tag::StripByteCounts), (Tag::TileOffsets, Tag::TileByteCounts)] {
        let mut numbers =
            |tag| Ok::<Vec<u64>, Fault>(file.find_tag_unsigned_vec(tag).map_err(tiff_fault)?.unwrap_or_default());
        let (starts, counts) = (numbers(starts)?, numbers(counts)?);
        if starts.iter().zip(counts).any(|(start, count)| start.saturating_add(count) > most as u64) {
            return Err(truncated());
        }
    }
    Ok(())
}

fn read_tiff(bytes: &[u8]) -> Result<Vec<Picture>, Fault> {
    let bytes = as_black_is_zero(bytes)?;
    let mut file = open_tiff(&bytes)?;
    let (mut pictures, mut pixels) = (Vec::new(), 0);
    loop {
        check_ends(&mut file, bytes.len())?;
        let (width, height) = file.dimensions().map_err(tiff_fault)?;
        pixels += check_size([width as usize, height as usize])?;
        if pixels > MOST_IN_ALL {
            return Err(fault(format!("pictures of more than {MOST_IN_ALL} pixels in all, the most that are read")));
        }
        pictures.push(tiff_picture(&mut file)?);
        if !file.more_images() {
            return Ok(pictures);
        }
        file.next_image().map_err(tiff_fault)?;
    }
}

fn tiff_picture(file: &mut Tiff) -> Result<Picture, Fault> {
    let (width, height) = file.dimensions().map_err(tiff_fault)?;
    let size = [width as usize, height as usize];
    let tiff::ColorType::Gray(bits) = file.colortype().map_err(tiff_fault)? else {
        return Err(fault("a TIFF in colours; a grade needs grey ones"));
    };
    if bits < 8 {
        return Err(fault(format!("a TIFF of {bits} bits; 8, 16, 32 and 64 are read")));
    }
    fn wide<T: Copy>(v: Vec<T>, f: impl Fn(T) -> f64) -> Vec<f64> {
        v.into_iter().map(f).collect()
    }
    let values = match file.read_image().map_err(tiff_fault)? {
        DecodingResult::U8(v) => wide(v, f64::from),
        DecodingResult::U16(v) => wide(v, f64::from),
        DecodingResult::U32(v) => wide(v, f64::from),
        DecodingResult::U64(v) => wide(v, |x| x as f64),
        DecodingResult::I8(v) => wide(v, f64::from),
        DecodingResult::I16(v) => wide(v, f64::from),
        DecodingResult::I32(v) => wide(v, f64::from),
        DecodingResult::I64(v) => wide(v, |x| x as f64),
        DecodingResult::F16(v) => wide(v, f64::from),
        DecodingResult::F32(v) => wide(v, f64::from),
        DecodingResult::F64(v) => v,
    };
    Ok(Picture { size, values })
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
        let bytes = render::png(&rgb, size, 3, None);
        let made = read_pictures(&bytes).expect("picture");
        let want: Vec<f64> = (0..37 * 23).map(|i| f64::from(level(i))).collect();
        assert_eq!(made, [Picture { size, values: want }]);
        let coloured: Vec<u8> = (0..37 * 23).flat_map(|i| [level(i), 0, 9]).collect();
        let words = read_pictures(&render::png(&coloured, size, 3, None)).expect_err("colours").message;
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
        assert!(read_pictures(&ring).expect_err("ring").message.contains("cycle"));
        // White as zero: the numbers are those of the file.
        let at = 8 + 2 + 12 * 4 + 8;
        let mut white = odd;
        white[at] = 0;
        assert_eq!(read_pictures(&white).expect("white").first().map(|p| p.values.clone()), Some(vec![1.0; 6]));
        assert!(read_pictures(b"GIF89a").is_err() && read_pictures(b"").is_err());
    }

    #[test]
    fn tiffs_packed_by_lzw_are_read_with_and_without_differences() {
        use tiff::encoder::{Compression, Predictor, TiffEncoder, colortype::Gray16};
        let (width, height) = (61, 40);
        // Runs that repeat and noise: codes of several widths.
        let level = |i: u32| {
            if i % 300 < 200 { (i / 61) as u16 * 900 } else { (i * i).wrapping_mul(2654435761).to_be_bytes()[1].into() }
        };
        let data: Vec<u16> = (0..width * height).map(level).collect();
        for predictor in [Predictor::None, Predictor::Horizontal] {
            let mut file = Cursor::new(Vec::new());
            let encoder = TiffEncoder::new(&mut file).expect("memory").with_compression(Compression::Lzw);
            let mut encoder = encoder.with_predictor(predictor);
            for _ in 0..2 {
                encoder.write_image::<Gray16>(width, height, &data).expect("memory");
            }
            let bytes = file.into_inner();
            assert!(predictor == Predictor::None || bytes.len() < 4 * data.len());
            let made = read_pictures(&bytes).expect("pictures");
            let values: Vec<f64> = data.iter().map(|v| f64::from(*v)).collect();
            assert_eq!(made, vec![Picture { size: [61, 40], values }; 2]);
        }
    }
}
