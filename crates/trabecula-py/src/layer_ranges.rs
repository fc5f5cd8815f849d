//! Files of layers for machines: written at once, or range by range of layers for other processes and later runs, and joined.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use geometry::fault::Fault;
use geometry::formats::{Encoded, LayerFormat, PixelGrid, Stack};
use geometry::layer::Layer;
use geometry::progress::{Progress, Stopped};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use trabecula::report::LayersReport;

use crate::error;
use crate::file;
use crate::layers::Layers;
use crate::ranges::handing_over;
use crate::report::report;
use crate::run::run;

/// What is known of an encoded layer besides its bytes: as many numbers of eight bytes, the lowest first.
const NUMBERS: usize = 7;
/// Of a layer that is not deflated.
const PLAIN: u64 = u64::MAX;

/// A layer as its file has it, and its figures.
struct EncodedLayer {
    figures: LayersReport,
    encoded: Encoded,
}

impl EncodedLayer {
    /// Adds its bytes to `data`, and what is known besides to `partial`.
    fn pack(self, data: &mut Vec<u8>, partial: &mut Vec<u8>) {
        let it = self.figures;
        let (bytes, about) = self.encoded.into_parts();
        let [crc, size] = about.unwrap_or([0, PLAIN]);
        let counts = [bytes.len() as u64, crc, size, it.contours as u64, it.points as u64];
        partial.extend(counts.into_iter().chain([it.volume, it.largest].map(f64::to_bits)).flat_map(u64::to_le_bytes));
        data.extend(bytes);
    }

    /// The next layer of what `pack` has put together.
    fn unpack(data: &mut impl Read, partial: &[u8]) -> Result<EncodedLayer, Stopped> {
        let number = |i: usize| partial[8 * i..].first_chunk().map_or(0, |b| u64::from_le_bytes(*b));
        let mut bytes = Vec::new();
        data.take(number(0)).read_to_end(&mut bytes).map_err(Stopped::Io)?;
        if bytes.len() as u64 != number(0) {
            return Err(damaged());
        }
        let about = [number(1), number(2)];
        let figures = LayersReport {
            layers: 1,
            contours: number(3) as usize,
            points: number(4) as usize,
            empty: usize::from(number(3) == 0),
            volume: f64::from_bits(number(5)),
            largest: f64::from_bits(number(6)),
        };
        Ok(EncodedLayer { figures, encoded: Encoded::of_parts(bytes, (about[1] != PLAIN).then_some(about)) })
    }
}

fn damaged() -> Stopped {
    Stopped::Refused(Fault::new("", "a range of layers is damaged; begin anew"))
}

/// Layers of a solid as a file of some format has them.
#[pyclass(frozen, module = "trabecula._core")]
pub struct LayerRanges {
    layers: Py<Layers>,
    format: &'static LayerFormat,
    stack: Stack,
}

impl LayerRanges {
    /// Makes some layers and gives each to `take`, in order, with its number.
    fn make(
        &self,
        layers: Range<usize>,
        progress: &dyn Progress,
        mut take: impl FnMut(usize, EncodedLayer) -> Result<(), Stopped>,
    ) -> Result<(), Stopped> {
        let encode = |index: usize, layer: &Layer| {
            let encoded = (self.format.encode)(&self.stack, index, layer);
            encoded.map(|encoded| (index, EncodedLayer { figures: LayersReport::from(layer), encoded }))
        };
        self.layers.get().slicer.each(layers, progress, encode, |made| {
            let (index, made) = made.map_err(Stopped::Io)?;
            take(index, made)
        })
    }

    /// Writes a file of the layers that `fill` gives, in order; gives their figures.
    fn write(
        &self,
        path: &Path,
        fill: impl FnOnce(&mut dyn FnMut(EncodedLayer) -> Result<(), Stopped>) -> Result<(), Stopped>,
    ) -> Result<LayersReport, Stopped> {
        let mut out = BufWriter::with_capacity(1 << 20, file::anew(path).map_err(Stopped::Io)?);
        let mut aside = file::nameless(path, ".1").map_err(Stopped::Io)?;
        let mut writer = (self.format.open)(&self.stack, &mut out, &mut aside).map_err(Stopped::Io)?;
        let mut total = LayersReport::default();
        fill(&mut |made: EncodedLayer| {
            total.add(&made.figures);
            writer.put(made.encoded, made.figures.largest).map_err(Stopped::Io)
        })?;
        writer.finish().map_err(Stopped::Io)?;
        drop(writer);
        out.flush().map_err(Stopped::Io)?;
        Ok(total)
    }
}

#[pymethods]
impl LayerRanges {
    /// The layers for a file with a suffix and a title; `pixel` is the edge of a pixel (mm), its numbers along x and y and the
    /// lower left corner.
    #[staticmethod]
    #[pyo3(signature = (layers, suffix, title, binary=false, pixel=None, exposure=[8.0, 35.0]))]
    fn of(
        layers: Py<Layers>,
        suffix: &str,
        title: String,
        binary: bool,
        pixel: Option<(f64, [usize; 2], [f64; 2])>,
        exposure: [f64; 2],
    ) -> PyResult<LayerRanges> {
        let format = LayerFormat::of(suffix)
            .ok_or_else(|| PyValueError::new_err(format!("no format of layers is named {suffix}")))?;
        let stack = Stack {
            heights: layers.get().slicer.heights().to_vec(),
            bounds: layers.get().bounds,
            title,
            application: format!("Trabecula {}", env!("CARGO_PKG_VERSION")),
            binary,
            raster: pixel.map(|(pixel, size, origin)| PixelGrid { origin, pixel, size }),
            exposure,
        };
        Ok(LayerRanges { layers, format, stack })
    }

    /// Number of layers.
    #[getter]
    fn count(&self) -> usize {
        self.stack.layers()
    }

    /// Makes all layers and writes them to a file. Gives its `reports.LayersReport`.
    #[pyo3(signature = (path, threads=None, progress=None))]
    fn save<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let work = |p: &dyn Progress| self.write(&path, |put| self.make(0..self.count(), p, |_, made| put(made)));
        let made = run(py, threads, progress, work)?;
        report(py, "LayersReport", &made.map_err(error::stopped)?)
    }

    /// As `TileRanges.each`, of layers: their bytes in the file, and what `join` needs besides.
    #[pyo3(signature = (start, end, size, take, threads=None))]
    fn each(
        &self,
        py: Python<'_>,
        start: usize,
        end: usize,
        size: usize,
        take: Py<PyAny>,
        threads: Option<usize>,
    ) -> PyResult<()> {
        let (end, size) = (end.min(self.count()), size.max(1));
        let (mut data, mut partial, mut first) = (Vec::new(), Vec::new(), start);
        handing_over(py, threads, &take, |hand, p| {
            self.make(start..end, p, |index, made| {
                made.pack(&mut data, &mut partial);
                let next = index + 1;
                if next % size == 0 || next == end {
                    hand(first, next, &data, &partial)?;
                    data.clear();
                    partial.clear();
                    first = next;
                }
                Ok(())
            })
        })
    }

    /// Writes the file of what `each` has made of all layers, in order: their bytes in the file `data`, and what there is besides. As `save`.
    #[pyo3(signature = (path, data, partials, progress=None))]
    fn join<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        data: PathBuf,
        partials: Vec<Vec<u8>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let join = |p: &dyn Progress| {
            let mut data = BufReader::with_capacity(1 << 20, File::open(&data).map_err(Stopped::Io)?);
            let (mut done, total) = (0, self.count());
            self.write(&path, |put| {
                for layer in partials.iter().flat_map(|range| range.chunks_exact(8 * NUMBERS)) {
                    put(EncodedLayer::unpack(&mut data, layer)?)?;
                    done += 1;
                    if !p.step(done as u64, total as u64) {
                        return Err(Stopped::Interrupted);
                    }
                }
                if done == total { Ok(()) } else { Err(damaged()) }
            })
        };
        let made = run(py, None, progress, join)?;
        report(py, "LayersReport", &made.map_err(error::stopped)?)
    }
}
