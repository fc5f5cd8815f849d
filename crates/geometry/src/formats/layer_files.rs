//! Files of layers, for machines: one format a file, one row of [`LAYER_FORMATS`] each.
//!
//! Layers are encoded on any thread and written in order, so that a file of any length takes the memory of a few layers.

use std::io::{self, Seek, Write};

use super::threemf::DeflatedChunk;
use super::{ByteSpool, invalid};
use crate::layer::{Layer, Point};
use crate::math::Aabb;

mod cli_layers;
mod coverage;
mod layer_array;
mod png_stack;
mod slice_stack;
mod svg_layers;
mod tiff_pages;

pub use coverage::PixelGrid;

/// What a file of layers is about.
#[derive(Clone, Debug)]
pub struct Stack {
    /// Where layers begin, and the end of the last one, mm, rising.
    pub heights: Vec<f64>,
    /// A box that holds the part, mm.
    pub bounds: Aabb,
    /// The name of the part.
    pub title: String,
    /// Program and version.
    pub application: String,
    /// Whether a format that has both is written as bytes rather than as text.
    pub binary: bool,
    /// The pixels of pictures.
    pub raster: Option<PixelGrid>,
    /// Exposure of a layer and of the first ones, s, where a format says it.
    pub exposure: [f64; 2],
}

impl Stack {
    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.heights.len().saturating_sub(1)
    }

    /// The thickness of layers, all alike but for the last one, mm. Heights are sums, so their difference has a rounding that twelve
    /// digits leave out.
    fn thickness(&self) -> f64 {
        let layer = self.heights.windows(2).next().map_or(0.0, |h| h[1] - h[0]);
        format!("{layer:.11e}").parse().unwrap_or(layer)
    }

    fn raster(&self) -> io::Result<&PixelGrid> {
        self.raster.as_ref().ok_or_else(|| invalid("pictures need the size of a pixel".into()))
    }
}

/// An encoded layer.
pub enum Encoded {
    /// Bytes of the file.
    Bytes(Vec<u8>),
    /// A deflated piece of a part of an archive.
    Deflated(DeflatedChunk),
}

impl Encoded {
    /// Its bytes, and what they do not say of a deflated piece.
    pub fn into_parts(self) -> (Vec<u8>, Option<[u64; 2]>) {
        match self {
            Encoded::Bytes(bytes) => (bytes, None),
            Encoded::Deflated(piece) => {
                let (bytes, about) = piece.into_parts();
                (bytes, Some(about))
            }
        }
    }

    /// From what `into_parts` gave.
    pub fn of_parts(bytes: Vec<u8>, about: Option<[u64; 2]>) -> Encoded {
        match about {
            None => Encoded::Bytes(bytes),
            Some(about) => Encoded::Deflated(DeflatedChunk::of_parts(bytes, about)),
        }
    }
}

/// Where layers are written.
pub trait Target: Write + Seek {}
impl<T: Write + Seek> Target for T {}

/// A file of layers that is being written.
pub trait LayerWriter {
    /// Writes the next layer: encoded by the format's `encode`, and its area (mm²).
    fn put(&mut self, layer: Encoded, area: f64) -> io::Result<()>;
    /// Writes what follows the last layer.
    fn finish(&mut self) -> io::Result<()>;
}

type Open = for<'a> fn(&'a Stack, &'a mut dyn Target, &'a mut dyn ByteSpool) -> io::Result<Box<dyn LayerWriter + 'a>>;

/// A format of files of layers.
pub struct LayerFormat {
    /// End of the file's name, in small letters, without the dot.
    pub suffix: &'static str,
    /// What it is, for texts.
    pub title: &'static str,
    /// Whether it holds pictures rather than contours.
    pub pictures: bool,
    /// Whether all layers have to have one thickness (the last one apart).
    pub uniform: bool,
    /// Encodes a layer, given its number from 0.
    pub encode: fn(&Stack, usize, &Layer) -> io::Result<Encoded>,
    /// Begins a file.
    pub open: Open,
}

/// The formats of layers, in the order in which texts name them.
pub const LAYER_FORMATS: &[LayerFormat] = &[
    LayerFormat {
        suffix: "cli",
        title: "Common Layer Interface 2.0",
        pictures: false,
        uniform: false,
        encode: cli_layers::encode,
        open: cli_layers::open,
    },
    LayerFormat {
        suffix: "svg",
        title: "SVG, a group for each layer",
        pictures: false,
        uniform: false,
        encode: svg_layers::encode,
        open: svg_layers::open,
    },
    LayerFormat {
        suffix: "3mf",
        title: "3MF with a stack of slices",
        pictures: false,
        uniform: false,
        encode: slice_stack::encode,
        open: slice_stack::open,
    },
    LayerFormat {
        suffix: "sl1",
        title: "pictures for Prusa's resin printers",
        pictures: true,
        uniform: true,
        encode: png_stack::encode,
        open: png_stack::open_sl1,
    },
    LayerFormat {
        suffix: "zip",
        title: "PNG pictures with a manifest",
        pictures: true,
        uniform: false,
        encode: png_stack::encode,
        open: png_stack::open_zip,
    },
    LayerFormat {
        suffix: "tif",
        title: "TIFF, a page of grey for each layer",
        pictures: true,
        uniform: true,
        encode: tiff_pages::encode,
        open: tiff_pages::open,
    },
    LayerFormat {
        suffix: "npy",
        title: "an array of area fractions",
        pictures: true,
        uniform: false,
        encode: layer_array::encode,
        open: layer_array::open,
    },
];

impl LayerFormat {
    /// The format with a suffix, in any letter case.
    pub fn of(suffix: &str) -> Option<&'static LayerFormat> {
        LAYER_FORMATS.iter().find(|f| f.suffix.eq_ignore_ascii_case(suffix))
    }
}

/// A text or binary file whose layers follow one another.
struct Plain<'a> {
    out: &'a mut dyn Target,
    tail: &'static [u8],
}

impl LayerWriter for Plain<'_> {
    fn put(&mut self, layer: Encoded, _: f64) -> io::Result<()> {
        match layer {
            Encoded::Bytes(bytes) => self.out.write_all(&bytes),
            Encoded::Deflated(_) => Err(invalid("deflated layers belong to an archive".into())),
        }
    }

    fn finish(&mut self) -> io::Result<()> {
        self.out.write_all(self.tail)?;
        self.out.flush()
    }
}

/// The contours of a layer, larger ones first, so that what lies inside follows; each with whether it is a hole.
fn by_size(layer: &Layer) -> Vec<(&[Point], bool)> {
    let mut areas: Vec<(f64, &[Point])> = layer.loops.iter().map(|l| (crate::layer::signed_area(l), &l[..])).collect();
    areas.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    areas.into_iter().map(|(area, of)| (of, area < 0.0)).collect()
}
