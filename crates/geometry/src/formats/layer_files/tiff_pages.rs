//! TIFF: a page for each layer, of 8-bit grey: the fraction of the pixel that the solid covers.
//!
//! Sources: Adobe, TIFF 6.0, and technical note 2 of 2002 (deflate); the description that ImageJ reads the distance of pages from.

use std::io::{self, Write};

use flate2::{Compression, write::ZlibEncoder};
use tiff::TiffError;
use tiff::encoder::{Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, ResolutionUnit, Tag};

use super::coverage::coverage;
use super::{Encoded, LayerWriter, PixelGrid, Stack, Target};
use crate::formats::{ByteSpool, invalid};
use crate::layer::Layer;

/// Bytes that offsets of a plain TIFF reach; more pages need a BigTIFF.
const REACH: u64 = u32::MAX as u64;
/// Bytes of a page but for its pixels, at most.
const HEAD: u64 = 1024;

/// Encodes the pixels of a layer.
pub fn encode(stack: &Stack, _: usize, layer: &Layer) -> io::Result<Encoded> {
    let mut deflated = ZlibEncoder::new(Vec::new(), Compression::fast());
    coverage(&layer.loops, stack.raster()?, |_, row| deflated.write_all(row))?;
    deflated.finish().map(Encoded::Bytes)
}

struct Pages<'a, K: TiffKind> {
    stack: &'a Stack,
    file: TiffEncoder<&'a mut dyn Target, K>,
    page: usize,
}

pub fn open<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let [width, height] = stack.raster()?.size;
    if u32::try_from(width).is_err() || u32::try_from(height).is_err() {
        return Err(invalid(format!("TIFF holds at most {} pixels in a row", u32::MAX)));
    }
    // Deflated, noise grows by a thousandth.
    let page = (width as u64).saturating_mul(height as u64).saturating_mul(1001) / 1000 + HEAD;
    if page.saturating_mul(stack.layers() as u64) < REACH {
        begun::<TiffKindStandard>(stack, out)
    } else {
        begun::<TiffKindBig>(stack, out)
    }
}

fn begun<'a, K: TiffKind + 'a>(stack: &'a Stack, out: &'a mut dyn Target) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let file = TiffEncoder::<_, K>::new_generic(out).map_err(failed)?;
    Ok(Box::new(Pages { stack, file, page: 0 }))
}

/// A failure of the file as it is; others as words.
fn failed(e: TiffError) -> io::Error {
    match e {
        TiffError::IoError(e) => e,
        other => io::Error::other(other.to_string()),
    }
}

impl<K: TiffKind> Pages<'_, K> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), TiffError> {
        let PixelGrid { size: [width, height], pixel, .. } = *self.stack.raster()?;
        let mut page = self.file.image_directory()?;
        let at = page.write_data(bytes)?;
        let offsets = [K::convert_offset(at)?];
        page.write_tag(Tag::ImageWidth, width as u32)?;
        page.write_tag(Tag::ImageLength, height as u32)?;
        page.write_tag(Tag::BitsPerSample, 8u16)?;
        page.write_tag(Tag::Compression, CompressionMethod::Deflate)?;
        page.write_tag(Tag::PhotometricInterpretation, PhotometricInterpretation::BlackIsZero)?;
        page.write_tag(Tag::StripOffsets, K::convert_slice(&offsets))?;
        page.write_tag(Tag::SamplesPerPixel, 1u16)?;
        page.write_tag(Tag::RowsPerStrip, height as u32)?;
        page.write_tag(Tag::StripByteCounts, K::convert_slice(&[K::convert_offset(bytes.len() as u64)?]))?;
        // Pixels in the unit of the description, a millimetre, to six digits after the point: ImageJ takes the number as it is and
        // the unit of the description for that of the tag, and writes no unit but inch and cm into the tag itself.
        let density = || Rational { n: (1e6 / pixel).round().min(f64::from(u32::MAX)) as u32, d: 1_000_000 };
        page.write_tag(Tag::XResolution, density())?;
        page.write_tag(Tag::YResolution, density())?;
        page.write_tag(Tag::ResolutionUnit, ResolutionUnit::None)?;
        if self.page == 0 {
            let (count, spacing) = (self.stack.layers(), self.stack.thickness());
            let said =
                format!("ImageJ=1.54f\nimages={count}\nslices={count}\nunit=mm\nspacing={spacing}\nloop=false\n");
            page.write_tag(Tag::ImageDescription, said.as_str())?;
            let software: String = self.stack.application.chars().filter(char::is_ascii).collect();
            page.write_tag(Tag::Software, software.as_str())?;
        }
        self.page += 1;
        page.finish()
    }
}

impl<K: TiffKind> LayerWriter for Pages<'_, K> {
    fn put(&mut self, layer: Encoded, _: f64) -> io::Result<()> {
        match layer {
            Encoded::Bytes(bytes) => self.write(&bytes).map_err(failed),
            Encoded::Deflated(_) => Err(invalid("deflated layers belong to an archive".into())),
        }
    }

    fn finish(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use std::io::Cursor;
    use tiff::decoder::{Decoder, DecodingResult};

    /// A layer with a square of 2.5 x 1.5 pixels from the lower left corner of a raster of 4 x 3 pixels of 0.5 mm.
    fn written<K: TiffKind>() -> Vec<u8> {
        let raster = PixelGrid { origin: [0.0; 2], pixel: 0.5, size: [4, 3] };
        let stack = Stack {
            heights: vec![-4.8526, -4.6526, -4.5],
            bounds: Aabb { min: [0.0; 3], max: [2.0, 1.5, 0.4] },
            title: "part".into(),
            application: "Trabecula ü".into(),
            binary: false,
            raster: Some(raster),
            exposure: [0.0; 2],
        };
        let loops = vec![vec![[0.0, 0.0], [1.25, 0.0], [1.25, 0.75], [0.0, 0.75]]];
        let mut out = Cursor::new(Vec::new());
        let mut file = begun::<K>(&stack, &mut out).unwrap();
        for layer in [Layer { loops, ..Layer::default() }, Layer::default()] {
            file.put(encode(&stack, 0, &layer).unwrap(), 0.0).unwrap();
        }
        file.finish().unwrap();
        drop(file);
        out.into_inner()
    }

    #[test]
    fn pages_are_area_fractions() {
        for bytes in [written::<TiffKindStandard>(), written::<TiffKindBig>()] {
            let mut file = Decoder::new(Cursor::new(bytes)).unwrap();
            assert_eq!(file.dimensions().unwrap(), (4, 3));
            let DecodingResult::U8(first) = file.read_image().unwrap() else { panic!("not bytes") };
            // Rows from the top; half a pixel is 127.5, a quarter 63.75.
            assert_eq!(first, [0, 0, 0, 0, 128, 128, 64, 0, 255, 255, 128, 0]);
            let said = file.get_tag_ascii_string(Tag::ImageDescription).unwrap();
            assert!(said.contains("slices=2\n") && said.contains("spacing=0.2\n"), "{said}");
            file.next_image().unwrap();
            let DecodingResult::U8(second) = file.read_image().unwrap() else { panic!("not bytes") };
            assert_eq!(second, [0; 12]);
            assert!(!file.more_images());
        }
    }
}
