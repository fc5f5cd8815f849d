//! SVG with a group for each layer, as Slic3r writes and reads it: `slic3r:z` is the height of the section, contours are white and
//! holes black. Coordinates are the design's, mm.

use std::io::{self, Write};

use super::{Encoded, LayerWriter, Plain, Stack, Target, by_size};
use crate::formats::ByteSpool;
use crate::formats::number::{push_f32, push_u32};
use crate::layer::Layer;

pub fn open<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let ([x, y, _], [w, h, _]) = (stack.bounds.min.map(|v| v as f32), stack.bounds.size().map(|v| v as f32));
    write!(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n\
         <svg width=\"{w}mm\" height=\"{h}mm\" viewBox=\"{x} {y} {w} {h}\" xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:slic3r=\"http://slic3r.org/namespaces/slic3r\">\n"
    )?;
    Ok(Box::new(Plain { out, tail: b"</svg>\n" }))
}

pub fn encode(_: &Stack, index: usize, layer: &Layer) -> io::Result<Encoded> {
    let mut out = Vec::new();
    out.extend(b"<g id=\"layer");
    push_u32(&mut out, index as u32);
    out.extend(b"\" slic3r:z=\"");
    push_f32(&mut out, layer.z as f32);
    out.extend(b"\">\n");
    for (contour, hole) in by_size(layer) {
        let (kind, fill) = if hole { ("hole", "black") } else { ("contour", "white") };
        write!(out, "<polygon slic3r:type=\"{kind}\" style=\"fill: {fill}\" points=\"")?;
        for (i, [x, y]) in contour.iter().enumerate() {
            if i > 0 {
                out.push(b' ');
            }
            push_f32(&mut out, *x as f32);
            out.push(b',');
            push_f32(&mut out, *y as f32);
        }
        out.extend(b"\"/>\n");
    }
    out.extend(b"</g>\n");
    Ok(Encoded::Bytes(out))
}
