//! Common Layer Interface 2.0, as text or bytes.
//!
//! Readers disagree: units are always 1 mm, `$$ASCII` or `$$BINARY` is the second line, points of a closed contour count the
//! repeated first one. A layer is named by the height of its upper face; contours are the section in its middle.
//!
//! Source: Brite-EuRam BE2578, Common Layer Interface, version 2.0.

use std::io;

use super::{Encoded, LayerWriter, Plain, Stack, Target};
use crate::formats::ByteSpool;
use crate::formats::number::{push_f32, push_u32};
use crate::layer::{Layer, signed_area};

/// Commands of the binary form.
const LAYER: u16 = 127;
const POLYLINE: u16 = 130;
/// The one part of a file.
const PART: u32 = 1;

pub fn open<'a>(
    stack: &'a Stack,
    out: &'a mut dyn Target,
    _: &'a mut dyn ByteSpool,
) -> io::Result<Box<dyn LayerWriter + 'a>> {
    let kind = if stack.binary { "BINARY" } else { "ASCII" };
    let (low, high) = (stack.bounds.min.map(|v| v as f32), stack.bounds.max.map(|v| v as f32));
    // A label is one word, and commas divide.
    let label: String =
        stack.title.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    let label = if label.is_empty() { "part".into() } else { label };
    write!(
        out,
        "$$HEADERSTART\n$${kind}\n$$UNITS/1\n$$VERSION/200\n$$LABEL/{PART},{label}\n\
         $$DIMENSION/{},{},{},{},{},{}\n$$LAYERS/{}\n$$HEADEREND",
        low[0],
        low[1],
        low[2],
        high[0],
        high[1],
        high[2],
        stack.layers()
    )?;
    // Bytes follow the header at once.
    if !stack.binary {
        out.write_all(b"\n$$GEOMETRYSTART\n")?;
    }
    Ok(Box::new(Plain { out, tail: if stack.binary { b"" } else { b"$$GEOMETRYEND\n" } }))
}

pub fn encode(stack: &Stack, _: usize, layer: &Layer) -> io::Result<Encoded> {
    let points: usize = layer.loops.iter().map(|l| l.len() + 1).sum();
    let mut out = Vec::with_capacity(32 + points * if stack.binary { 8 } else { 20 });
    if stack.binary {
        out.extend(LAYER.to_le_bytes());
        out.extend((layer.top as f32).to_le_bytes());
    } else {
        out.extend(b"$$LAYER/");
        push_f32(&mut out, layer.top as f32);
        out.push(b'\n');
    }
    for contour in &layer.loops {
        let direction = u32::from(signed_area(contour) > 0.0);
        let count = contour.len() as u32 + 1;
        let closed = contour.iter().chain(contour.first());
        if stack.binary {
            out.extend(POLYLINE.to_le_bytes());
            out.extend([PART, direction, count].into_iter().flat_map(u32::to_le_bytes));
            out.extend(closed.flatten().flat_map(|v| (*v as f32).to_le_bytes()));
        } else {
            out.extend(b"$$POLYLINE/");
            for (i, n) in [PART, direction, count].into_iter().enumerate() {
                if i > 0 {
                    out.push(b',');
                }
                push_u32(&mut out, n);
            }
            for v in closed.flatten() {
                out.push(b',');
                push_f32(&mut out, *v as f32);
            }
            out.push(b'\n');
        }
    }
    Ok(Encoded::Bytes(out))
}
