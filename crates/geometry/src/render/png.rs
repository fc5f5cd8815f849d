//! Pictures as PNG, 8-bit RGB or RGBA (crate `png`).

use std::io::{self, Read, Write};

use png::{BitDepth, ColorType, Encoder, EncodingError, PixelDimensions, SrgbRenderingIntent, Unit};

/// Encodes rows (from the top) of `channels` bytes a pixel, RGB or RGBA, as PNG; `dpi` says how many pixels are an inch. Rows missing from
/// `bytes` are black or transparent, surplus bytes are left out.
pub fn png(bytes: &[u8], size: [usize; 2], channels: usize, dpi: Option<f64>) -> Vec<u8> {
    // The format knows no picture without pixels: one black pixel stands for it.
    let size = size.map(|n| n.clamp(1, 1 << 24));
    let mut out = Vec::new();
    // Writing to memory does not fail, and the sizes are within what the format holds.
    if encode(bytes, size, channels, dpi, &mut out).is_err() {
        out.clear();
    }
    out
}

fn encode(
    bytes: &[u8],
    [w, h]: [usize; 2],
    channels: usize,
    dpi: Option<f64>,
    out: &mut Vec<u8>,
) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(out, w as u32, h as u32);
    encoder.set_color(if channels == 4 { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_pixel_dims(dpi.map(|dpi| {
        let metre = (dpi / 0.0254).round() as u32;
        PixelDimensions { xppu: metre, yppu: metre, unit: Unit::Meter }
    }));
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let all = channels * w * h;
    let given = &bytes[..bytes.len().min(all)];
    stream.write_all(given)?;
    io::copy(&mut io::repeat(0).take((all - given.len()) as u64), &mut stream)?;
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
            assert_eq!(decode(&png(&rgb, [w, h], 3, None)), (w, h, rgb));
        }
    }

    #[test]
    fn odd_input_is_no_panic() {
        assert_eq!(decode(&png(&[], [0, 0], 3, None)), (1, 1, vec![0; 3]));
        assert_eq!(decode(&png(&[9], [2, 2], 3, None)).2, [9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}
