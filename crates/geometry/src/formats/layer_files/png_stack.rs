//! PNG pictures of layers in a ZIP archive: with a manifest, or as Prusa's SL1 for resin printers.
//!
//! Grey is the fraction of the pixel that the solid covers. Pictures are compressed already, so the archive stores them.
//!
//! Source: PrusaSlicer, SL1 archive format (keys of `config.ini` and `prusaslicer.ini`).

use std::io::{self, Write};

use png::{BitDepth, ColorType, Compression, Encoder, Filter};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::coverage::coverage;
use super::{Encoded, LayerWriter, Stack, Target};
use crate::formats::ByteSpool;
use crate::layer::Layer;

/// Encodes a layer as 8-bit grey PNG.
pub fn encode(stack: &Stack, _: usize, layer: &Layer) -> io::Result<Encoded> {
    let raster = stack.raster()?;
    let [width, height] = raster.size.map(|n| n as u32);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fastest);
    // Differences from the row above are zero nearly everywhere, and long runs of zeros are what compresses fastest.
    encoder.set_filter(Filter::Up);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    coverage(&layer.loops, raster, |_, row| stream.write_all(row))?;
    stream.finish()?;
    writer.finish()?;
    Ok(Encoded::Bytes(bytes))
}

/// How layers are described.
#[derive(Clone, Copy, PartialEq)]
enum StackFormat {
    Manifest,
    Sl1,
}

struct Pictures<'a> {
    stack: &'a Stack,
    archive: Option<ZipWriter<&'a mut dyn Target>>,
    kind: StackFormat,
    areas: Vec<f64>,
}

pub fn open_zip<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    open(stack, out, StackFormat::Manifest)
}

pub fn open_sl1<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    open(stack, out, StackFormat::Sl1)
}

fn open<'a>(stack: &'a Stack, out: &'a mut dyn Target, kind: StackFormat) -> io::Result<Box<dyn LayerWriter + 'a>> {
    stack.raster()?;
    Ok(Box::new(Pictures { stack, archive: Some(ZipWriter::new(out)), kind, areas: Vec::new() }))
}

impl Pictures<'_> {
    /// The name of the files of a job: that of the part, in letters that no file system refuses.
    fn job(&self) -> String {
        let safe = self.stack.title.chars().filter(|c| c.is_ascii_alphanumeric() || "-_".contains(*c));
        let name: String = safe.collect();
        if name.is_empty() { "part".into() } else { name }
    }

    fn name(&self, index: usize) -> String {
        match self.kind {
            StackFormat::Manifest => format!("{index:05}.png"),
            StackFormat::Sl1 => format!("{}{index:05}.png", self.job()),
        }
    }

    fn add(&mut self, name: &str, bytes: &[u8], method: CompressionMethod) -> io::Result<()> {
        // The first day that ZIP knows: the bytes depend on the content alone.
        let options = SimpleFileOptions::default().compression_method(method).last_modified_time(DateTime::default());
        let Some(archive) = &mut self.archive else { return Ok(()) };
        let written =
            archive.start_file(name, options).map_err(io::Error::from).and_then(|()| archive.write_all(bytes));
        if written.is_err() {
            // Dropped, it would try to finish the archive and print what that fails with.
            core::mem::forget(self.archive.take());
        }
        written
    }

    fn manifest(&self) -> String {
        let raster = self.stack.raster.as_ref();
        let (pixel, [w, h], [x, y]) = raster.map_or((0.0, [0; 2], [0.0; 2]), |r| (r.pixel, r.size, r.origin));
        let heights = self.stack.heights.windows(2).zip(&self.areas).enumerate();
        let rows: Vec<String> = heights
            .map(|(i, (ends, area))| {
                let [bottom, top] = [ends[0], ends[1]];
                let file = self.name(i);
                format!("{{\"file\": \"{file}\", \"bottom\": {bottom}, \"top\": {top}, \"area\": {area}}}")
            })
            .collect();
        format!(
            "{{\n\"unit\": \"mm\",\n\"pixel\": {pixel},\n\"width\": {w},\n\"height\": {h},\n\"origin\": [{x}, {y}],\n\
             \"grey\": \"fraction of the pixel that is solid, 0 to 255\",\n\"layers\": [\n{}\n]\n}}\n",
            rows.join(",\n")
        )
    }

    /// The settings of a print, and those of the printer's display.
    fn settings(&self) -> [(&'static str, String); 2] {
        let stack = self.stack;
        let layer = stack.thickness();
        let volume: f64 = stack.heights.windows(2).zip(&self.areas).map(|(h, a)| (h[1] - h[0]) * a).sum();
        let [exposure, first] = stack.exposure;
        let faded = 10usize.min(stack.layers());
        // A layer takes its exposure and some seconds of tilting.
        let time = stack.layers() as f64 * (exposure + 8.0) + faded as f64 * 0.5 * (first - exposure).max(0.0);
        let config = format!(
            "action = print\njobDir = {}\nexpTime = {exposure}\nexpTimeFirst = {first}\nlayerHeight = {layer}\n\
             materialName = resin\nnumFade = {faded}\nnumFast = {}\nnumSlow = 0\nprintProfile = {}\nprintTime = {time:.0}\n\
             printerModel = SL1\nprinterProfile = {}\nprinterVariant = default\nusedMaterial = {:.3}\n",
            self.job(),
            stack.layers(),
            stack.application,
            stack.application,
            volume / 1000.0
        );
        let raster = stack.raster.as_ref();
        let (pixel, [w, h]) = raster.map_or((0.0, [0; 2]), |r| (r.pixel, r.size));
        let high = stack.heights.last().copied().unwrap_or_default();
        let printer = format!(
            "display_width = {}\ndisplay_height = {}\ndisplay_pixels_x = {w}\ndisplay_pixels_y = {h}\n\
             display_orientation = landscape\ndisplay_mirror_x = 0\ndisplay_mirror_y = 0\nlayer_height = {layer}\n\
             initial_layer_height = {layer}\nexposure_time = {exposure}\ninitial_exposure_time = {first}\n\
             faded_layers = {faded}\nmax_print_height = {}\nprinter_model = SL1\nprinter_technology = SLA\n",
            w as f64 * pixel,
            h as f64 * pixel,
            high.max(150.0)
        );
        [("config.ini", config), ("prusaslicer.ini", printer)]
    }
}

impl LayerWriter for Pictures<'_> {
    fn put(&mut self, layer: Encoded, area: f64) -> io::Result<()> {
        let name = self.name(self.areas.len());
        self.areas.push(area);
        match layer {
            Encoded::Bytes(bytes) => self.add(&name, &bytes, CompressionMethod::Stored),
            Encoded::Deflated(_) => Err(crate::formats::invalid("pictures are compressed already".into())),
        }
    }

    fn finish(&mut self) -> io::Result<()> {
        match self.kind {
            StackFormat::Manifest => {
                let text = self.manifest();
                self.add("manifest.json", text.as_bytes(), CompressionMethod::Deflated)?;
            }
            StackFormat::Sl1 => {
                for (name, text) in self.settings() {
                    self.add(name, text.as_bytes(), CompressionMethod::Deflated)?;
                }
            }
        }
        self.archive.take().map_or(Ok(()), |archive| archive.finish()?.flush())
    }
}
