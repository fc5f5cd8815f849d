//! 3MF with the slice extension 1.0.2: a stack of slices, and the part's box as the mesh that the core specification requires,
//! marked as of low resolution.
//!
//! Source: 3MF Consortium, Slice Extension 1.0.2.

use std::io::{self, Write};

use super::{Encoded, LayerWriter, Stack, Target, by_size};
use crate::formats::number::{push_f32, push_u32};
use crate::formats::threemf::{DeflatedChunk, ModelWriter};
use crate::formats::xml::escaped;
use crate::formats::{ByteSpool, invalid};
use crate::layer::Layer;

const SLICE: &str = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07";

struct Slices<'a> {
    stack: &'a Stack,
    model: Option<ModelWriter<'a>>,
    out: &'a mut dyn Target,
}

pub fn open<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    aside: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let mut model = ModelWriter::new(aside);
    let mut head = ModelWriter::head(&format!(" xmlns:s=\"{SLICE}\" requiredextensions=\"s\""));
    for (name, text) in [("Title", &stack.title), ("Application", &stack.application)] {
        if !text.is_empty() {
            head.push_str(&format!("<metadata name=\"{name}\">{}</metadata>\n", escaped(text)));
        }
    }
    let bottom = stack.heights.first().copied().unwrap_or_default();
    head.push_str(&format!("<resources>\n<s:slicestack id=\"1\" zbottom=\"{}\">\n", bottom as f32));
    model.push(DeflatedChunk::of(head.as_bytes()))?;
    Ok(Box::new(Slices { stack, model: Some(model), out }))
}

pub fn encode(_: &Stack, _: usize, layer: &Layer) -> io::Result<Encoded> {
    let points: usize = layer.loops.iter().map(Vec::len).sum();
    let mut text = Vec::with_capacity(64 + 64 * points);
    text.extend(b"<s:slice ztop=\"");
    push_f32(&mut text, layer.top as f32);
    if points == 0 {
        text.extend(b"\"/>\n");
        return Ok(Encoded::Deflated(DeflatedChunk::of(&text)));
    }
    text.extend(b"\">\n<s:vertices>\n");
    let contours = by_size(layer);
    for [x, y] in contours.iter().flat_map(|(c, _)| c.iter()) {
        text.extend(b"<s:vertex x=\"");
        push_f32(&mut text, *x as f32);
        text.extend(b"\" y=\"");
        push_f32(&mut text, *y as f32);
        text.extend(b"\"/>\n");
    }
    text.extend(b"</s:vertices>\n");
    let mut first = 0;
    for (contour, _) in &contours {
        let count = contour.len() as u32;
        text.extend(b"<s:polygon startv=\"");
        push_u32(&mut text, first);
        text.extend(b"\">\n");
        for i in (1..count).chain([0]) {
            text.extend(b"<s:segment v2=\"");
            push_u32(&mut text, first + i);
            text.extend(b"\"/>\n");
        }
        text.extend(b"</s:polygon>\n");
        first += count;
    }
    text.extend(b"</s:slice>\n");
    Ok(Encoded::Deflated(DeflatedChunk::of(&text)))
}

impl LayerWriter for Slices<'_> {
    fn put(&mut self, layer: Encoded, _: f64) -> io::Result<()> {
        match (layer, &mut self.model) {
            (Encoded::Deflated(piece), Some(model)) => model.push(piece),
            _ => Err(invalid("a slice is a deflated piece of the model".into())),
        }
    }

    fn finish(&mut self) -> io::Result<()> {
        let Some(mut model) = self.model.take() else { return Ok(()) };
        let (low, high) = (self.stack.bounds.min, self.stack.bounds.max);
        let mut tail = Vec::new();
        tail.extend(
            b"</s:slicestack>\n<object id=\"2\" type=\"model\" s:slicestackid=\"1\" s:meshresolution=\"lowres\"",
        );
        if !self.stack.title.is_empty() {
            write!(tail, " name=\"{}\"", escaped(&self.stack.title).replace('"', "&quot;"))?;
        }
        tail.extend(b">\n<mesh>\n<vertices>\n");
        for i in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] } as f32);
            writeln!(tail, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")?;
        }
        tail.extend(b"</vertices>\n<triangles>\n");
        for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            for [p, q, r] in [[a, b, c], [a, c, d]] {
                writeln!(tail, "<triangle v1=\"{p}\" v2=\"{q}\" v3=\"{r}\"/>")?;
            }
        }
        tail.extend(
            b"</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"2\"/>\n</build>\n</model>\n",
        );
        model.push(DeflatedChunk::of(&tail))?;
        model.finish(self.out)
    }
}
