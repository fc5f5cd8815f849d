//! Pictures as PNG, 8-bit RGB (crate `png`).

use std::io::{self, Read, Write};

use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

/// Encodes RGB rows (from the top) as PNG. Rows missing from `rgb` are black, surplus bytes are left out.
pub fn png(rgb: &[u8], size: [usize; 2]) -> Vec<u8> {
    // The format knows no picture without pixels: one black pixel stands for it.
    let size = size.map(|n| n.clamp(1, 1 << 24));
    let mut out = Vec::new();
    // Writing to memory does not fail, and the sizes are within what the format holds.
    if encode(rgb, size, &mut out).is_err() {
        out.clear();
    }
    out
}

fn encode(rgb: &[u8], [w, h]: [usize; 2], out: &mut Vec<u8>) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(out, w as u32, h as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let given = &rgb[..rgb.len().min(3 * w * h)];
    stream.write_all(given)?;
    io::copy(&mut io::repeat(0).take((3 * w * h - given.len()) as u64), &mut stream)?;
    stream.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads back what `png` writes.
    fn decode(bytes: &[u8]) -> (usize, usize, Vec<u8>) {
        let mut reader = ::png::Decoder::new(io::Cursor::new(bytes)).read_info().expect("header");
        let mut rgb = vec![0; reader.output_buffer_size().expect("size")];
        let info = reader.next_frame(&mut rgb).expect("pixels");
        reader.finish().expect("end");
        (info.width as usize, info.height as usize, rgb)
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
