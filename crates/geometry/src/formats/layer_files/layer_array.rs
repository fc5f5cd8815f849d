//! NPY: the area fraction of the solid in each pixel of each layer, 0 to 255, indexed `[x, y, layer]` with y upwards.

use std::io;

use super::coverage::coverage;
use super::{Encoded, LayerWriter, Plain, Stack, Target};
use crate::formats::ByteSpool;
use crate::formats::npy::write_header;
use crate::layer::Layer;

pub fn open<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let [x, y] = stack.raster()?.size;
    write_header([x, y, stack.layers()], &mut *out)?;
    Ok(Box::new(Plain { out, tail: b"" }))
}

pub fn encode(stack: &Stack, _: usize, layer: &Layer) -> io::Result<Encoded> {
    let raster = stack.raster()?;
    let [width, height] = raster.size;
    let mut rows = vec![0; width * height];
    coverage(&layer.loops, raster, |y, row| {
        // Pictures begin with the uppermost row.
        let at = (height - 1 - y) * width;
        rows[at..at + width].copy_from_slice(row);
        Ok(())
    })?;
    Ok(Encoded::Bytes(rows))
}
