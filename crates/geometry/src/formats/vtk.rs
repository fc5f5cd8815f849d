//! Results on grids and meshes in VTK's formats: image data (VTI), unstructured grids (VTU), and the legacy format (VTK).
//!
//! Source: Kitware, VTK File Formats.

mod image;
mod legacy;

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;

use quick_xml::events::{BytesStart, Event};

use super::elements::Elements;
use super::scalar::Scalar;
use super::text::shown;
use super::xml::{Scanner, attribute};
use crate::fault::Fault;
use crate::math::Vec3;
use image::{ALONG, Axis, Image, along};

/// A named array with a fixed count of numbers for each point or cell.
#[derive(Clone, Debug, PartialEq)]
pub struct DataArray {
    /// Its name.
    pub name: String,
    /// Whether it belongs to cells rather than points.
    pub of_cells: bool,
    /// Numbers for each point or cell.
    pub components: usize,
    /// All of them.
    pub values: Vec<f64>,
}

/// Where arrays are given.
#[derive(Clone, Debug, PartialEq)]
pub enum DataSet {
    /// Nodes of a grid along the axes, x fastest.
    Image {
        /// The first node, mm.
        origin: Vec3,
        /// Steps, mm.
        step: Vec3,
        /// Nodes along each axis.
        nodes: [usize; 3],
    },
    /// Points and cells.
    Mesh(Elements),
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Data {
    /// Where.
    pub shape: DataSet,
    /// What.
    pub arrays: Vec<DataArray>,
}

impl Data {
    /// Refuses cells of points that are not there and arrays that do not have a tuple for each point or cell; arrays without numbers
    /// pass.
    pub fn check(&self) -> Result<(), Fault> {
        let (points, cells) = match &self.shape {
            DataSet::Mesh(elements) => {
                elements.check()?;
                (elements.points.len(), elements.kinds.len())
            }
            DataSet::Image { nodes, .. } => {
                let product = |n: [usize; 3]| n.into_iter().fold(1, usize::saturating_mul);
                (product(*nodes), product(nodes.map(|n| n.saturating_sub(1).max(1))))
            }
        };
        self.arrays
            .iter()
            .filter(|a| !a.values.is_empty())
            .try_for_each(|a| check(core::slice::from_ref(a), points, cells))
    }
}

pub(super) fn fault(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// Reads VTI, VTU (ASCII, base64 or raw, compressed by zlib or not) or legacy VTK (ASCII or binary).
///
/// **Errors**: what is none of these; truncated or malformed files; other data sets.
pub fn read_vtk(bytes: &[u8]) -> Result<Data, Fault> {
    if bytes.trim_ascii_start().starts_with(b"# vtk") {
        return legacy::read(bytes);
    }
    xml(bytes)
}

/// Most numbers of an array that are read: two gibibytes.
const MOST: usize = 1 << 28;

/// A `DataArray` element, not yet decoded.
struct Raw<'a> {
    name: String,
    kind: String,
    components: usize,
    format: String,
    offset: usize,
    text: &'a [u8],
    section: String,
}

/// How the numbers of a file are laid down.
#[derive(Default)]
struct Layout<'a> {
    big: bool,
    wide: bool,
    zlib: bool,
    /// Bytes after the underscore of the appended data, and whether they are base64.
    appended: Option<(&'a [u8], bool)>,
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|w| w == what)
}

/// What the elements before the appended data say.
struct XmlVtkFile<'a> {
    layout: Layout<'a>,
    kind: String,
    extent: Option<[i64; 6]>,
    origin: Vec3,
    step: Vec3,
    along: [Axis; 3],
    pieces: usize,
    points: usize,
    cells: usize,
    section: String,
    arrays: Vec<Raw<'a>>,
}

fn xml(bytes: &[u8]) -> Result<Data, Fault> {
    let file = XmlVtkFile::read(bytes)?;
    if file.kind.is_empty() {
        return Err(fault("no VTK file: it begins neither with \"# vtk\" nor has an element VTKFile"));
    }
    if file.pieces != 1 {
        return Err(fault(format!("a file of {} pieces; save it as one", file.pieces)));
    }
    let (mut arrays, mut grid) = (Vec::new(), HashMap::new());
    for r in &file.arrays {
        let values = decode(r, &file.layout).map_err(|f| fault(format!("array \"{}\": {}", r.name, f.message)))?;
        match (r.section.as_str(), r.name.as_str()) {
            ("Points", _) => drop(grid.insert("points", values)),
            ("Cells", "connectivity") => drop(grid.insert("connectivity", values)),
            ("Cells", "offsets") => drop(grid.insert("offsets", values)),
            ("Cells", "types") => drop(grid.insert("cell types", values)),
            ("PointData" | "CellData", _) => arrays.push(DataArray {
                name: r.name.clone(),
                of_cells: r.section == "CellData",
                components: r.components.max(1),
                values,
            }),
            _ => {}
        }
    }
    if file.kind != "ImageData" {
        let (shape, points, cells) = file.mesh(grid)?;
        check(&arrays, points, cells)?;
        return Ok(Data { shape, arrays });
    }
    let image = file.image()?;
    let count = |of_cells| image.count(of_cells).into_iter().fold(1, usize::saturating_mul);
    check(&arrays, count(false), count(true))?;
    arrays.iter_mut().for_each(|a| image.turn(a));
    Ok(Data { shape: image.shape(), arrays })
}

fn text(tag: &BytesStart, name: &str) -> Option<String> {
    attribute(tag, name).map(Cow::into_owned)
}

fn number(tag: &BytesStart, name: &str) -> Option<usize> {
    attribute(tag, name).and_then(|t| t.parse().ok())
}

fn three(tag: &BytesStart, name: &str) -> Result<Option<Vec3>, Fault> {
    let Some(t) = attribute(tag, name) else {
        return Ok(None);
    };
    let v: Vec<f64> = t.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    v.try_into().map(Some).map_err(|_| fault(format!("{name} = \"{t}\" is not three numbers")))
}

impl<'a> XmlVtkFile<'a> {
    fn read(bytes: &'a [u8]) -> Result<XmlVtkFile<'a>, Fault> {
        let start = find(bytes, b"<AppendedData");
        // What comes after may be raw bytes and is no XML.
        let head = &bytes[..start.unwrap_or(bytes.len())];
        let mut file = XmlVtkFile {
            layout: Layout::default(),
            kind: String::new(),
            extent: None,
            origin: [0.0; 3],
            step: [1.0; 3],
            along: ALONG,
            pieces: 0,
            points: 0,
            cells: 0,
            section: String::new(),
            arrays: Vec::new(),
        };
        let (mut buffer, mut scanner) = (Vec::new(), Scanner::new(head, "VTK file"));
        loop {
            match scanner.next(&mut buffer) {
                Ok(Event::Start(tag)) => file.element(&tag, &head[scanner.at()..])?,
                Ok(Event::Empty(tag)) => file.element(&tag, b"")?,
                Ok(Event::Eof) => break,
                Ok(_) => {}
                // The root has no end before the appended data.
                Err(_) if start.is_some() => break,
                Err(e) => return Err(e),
            }
        }
        if let Some(at) = start {
            let rest = &bytes[at..];
            let end = find(rest, b">").ok_or_else(|| fault("the file ends early: truncated"))?;
            let base64 = find(&rest[..end], b"base64").is_some();
            let from = find(&rest[end..], b"_").ok_or_else(|| fault("the appended data are missing"))?;
            file.layout.appended = Some((&rest[end + from + 1..], base64));
        }
        Ok(file)
    }

    /// Takes in an element; `rest` is what follows its tag.
    fn element(&mut self, tag: &BytesStart, rest: &'a [u8]) -> Result<(), Fault> {
        match tag.name().into_inner() {
            "VTKFile" => {
                self.kind = text(tag, "type").unwrap_or_default();
                self.layout.big = attribute(tag, "byte_order").is_some_and(|o| o == "BigEndian");
                self.layout.wide = attribute(tag, "header_type").is_some_and(|t| t == "UInt64");
                self.layout.zlib = match text(tag, "compressor").as_deref() {
                    None => false,
                    Some("vtkZLibDataCompressor") => true,
                    Some(other) => {
                        return Err(fault(format!("compressed by {other}; save it compressed by zlib or not at all")));
                    }
                };
                if self.kind != "ImageData" && self.kind != "UnstructuredGrid" {
                    let kind = &self.kind;
                    return Err(fault(format!(
                        "a VTK file of {kind}; ImageData (vti) and UnstructuredGrid (vtu) are read"
                    )));
                }
            }
            "ImageData" => {
                self.origin = three(tag, "Origin")?.unwrap_or(self.origin);
                self.step = three(tag, "Spacing")?.unwrap_or(self.step);
                let t = text(tag, "WholeExtent").unwrap_or_default();
                let v: Vec<i64> = t.split_whitespace().filter_map(|w| w.parse().ok()).collect();
                self.extent = <[i64; 6]>::try_from(v).ok();
                self.along = text(tag, "Direction").map_or(Ok(ALONG), |t| along(&t))?;
            }
            "Piece" => {
                self.pieces += 1;
                self.points = number(tag, "NumberOfPoints").unwrap_or(0);
                self.cells = number(tag, "NumberOfCells").unwrap_or(0);
            }
            section @ ("PointData" | "CellData" | "Points" | "Cells") => self.section = section.to_string(),
            "DataArray" => self.arrays.push(Raw {
                name: text(tag, "Name").unwrap_or_default(),
                kind: text(tag, "type").unwrap_or_default(),
                components: number(tag, "NumberOfComponents").unwrap_or(1),
                format: text(tag, "format").unwrap_or_else(|| "ascii".into()),
                offset: number(tag, "offset").unwrap_or(0),
                text: &rest[..find(rest, b"<").unwrap_or(rest.len())],
                section: self.section.clone(),
            }),
            _ => {}
        }
        Ok(())
    }

    /// The grid of an image.
    fn image(&self) -> Result<Image, Fault> {
        let e = self.extent.ok_or_else(|| fault("the image has no WholeExtent of six numbers"))?;
        let count = |a: usize| e[2 * a + 1].saturating_sub(e[2 * a]).saturating_add(1).clamp(1, 1 << 40) as usize;
        let nodes: [usize; 3] = core::array::from_fn(count);
        let first = core::array::from_fn(|a| e[2 * a] as f64);
        Ok(Image { origin: self.origin, step: self.step, first, nodes, along: self.along })
    }

    /// The elements of an unstructured grid, with the numbers of its points and cells.
    fn mesh(&self, mut grid: HashMap<&str, Vec<f64>>) -> Result<(DataSet, usize, usize), Fault> {
        let mut take = |what: &str| grid.remove(what).ok_or_else(|| fault(format!("the grid has no {what}")));
        let (place, connectivity) = (take("points")?, take("connectivity")?);
        let (offsets, types) = (take("offsets")?, take("cell types")?);
        let (points, cells) = (self.points, self.cells);
        if points.checked_mul(3) != Some(place.len()) || types.len() != cells || offsets.len() != cells {
            return Err(fault(format!(
                "the grid says {points} points and {cells} cells, and has {} and {}",
                place.len() / 3,
                types.len()
            )));
        }
        Ok((DataSet::Mesh(Elements::of_numbers(&place, &connectivity, &offsets, &types)?), points, cells))
    }
}

/// Refuses arrays that do not have a tuple for each point or cell.
pub(super) fn check(arrays: &[DataArray], points: usize, cells: usize) -> Result<(), Fault> {
    for a in arrays {
        let (count, what) = if a.of_cells { (cells, "cells") } else { (points, "points") };
        if count.checked_mul(a.components) != Some(a.values.len()) {
            return Err(fault(format!(
                "array \"{}\" has {} numbers; {count} {what} of {} components need {}",
                a.name,
                a.values.len(),
                a.components,
                count.saturating_mul(a.components)
            )));
        }
    }
    Ok(())
}

fn decode(r: &Raw, layout: &Layout) -> Result<Vec<f64>, Fault> {
    if r.format == "ascii" {
        let words = r.text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        return words
            .map(|w| super::text::parse(w).ok_or_else(|| fault(format!("{} is not a number", shown(w)))))
            .collect();
    }
    let kind = scalar(&r.kind)?;
    let most = MOST * kind.width();
    let bytes = match r.format.as_str() {
        "binary" => blocks(&unbase64(r.text, layout)?, layout, most)?,
        "appended" => {
            let (all, base64) = layout.appended.ok_or_else(|| fault("the file has no appended data"))?;
            let from = all.get(r.offset..).ok_or_else(|| fault("its data begin after the end of the file"))?;
            if base64 { blocks(&unbase64(from, layout)?, layout, most)? } else { blocks(from, layout, most)? }
        }
        other => return Err(fault(format!("the format \"{other}\" is not known"))),
    };
    Ok(kind.decode(&bytes, layout.big))
}

/// A type by its name.
fn scalar(kind: &str) -> Result<Scalar, Fault> {
    Ok(match kind {
        "Float64" => Scalar::Float(8),
        "Float32" => Scalar::Float(4),
        "Int64" => Scalar::Signed(8),
        "Int32" => Scalar::Signed(4),
        "Int16" => Scalar::Signed(2),
        "Int8" => Scalar::Signed(1),
        "UInt64" => Scalar::Unsigned(8),
        "UInt32" => Scalar::Unsigned(4),
        "UInt16" => Scalar::Unsigned(2),
        "UInt8" => Scalar::Unsigned(1),
        _ => return Err(fault(format!("the type \"{kind}\" is not a number"))),
    })
}

/// A number of the header's width at `at`.
fn header(bytes: &[u8], at: usize, layout: &Layout) -> Result<usize, Fault> {
    let width = if layout.wide { 8 } else { 4 };
    let cut = || fault("its data end early: truncated");
    let b = bytes.get(at * width..(at + 1) * width).ok_or_else(cut)?;
    Ok(Scalar::Unsigned(width).decode(b, layout.big)[0] as usize)
}

/// The bytes behind a header, `most` of them at most: their number, or the blocks that they are compressed in.
fn blocks(bytes: &[u8], layout: &Layout, most: usize) -> Result<Vec<u8>, Fault> {
    let width = if layout.wide { 8 } else { 4 };
    let cut = || fault("its data end early: truncated");
    if !layout.zlib {
        let n = header(bytes, 0, layout)?;
        let end = n.checked_add(width).ok_or_else(cut)?;
        return Ok(bytes.get(width..end).ok_or_else(cut)?.to_vec());
    }
    let count = header(bytes, 0, layout)?;
    let mut at = count.checked_add(3).and_then(|n| n.checked_mul(width)).ok_or_else(cut)?;
    let mut out = Vec::new();
    for i in 0..count {
        let end = at.checked_add(header(bytes, 3 + i, layout)?).ok_or_else(cut)?;
        let block = bytes.get(at..end).ok_or_else(cut)?;
        let left = (most - out.len()) as u64;
        flate2::read::ZlibDecoder::new(block)
            .take(left + 1)
            .read_to_end(&mut out)
            .map_err(|e| fault(format!("its compressed data are damaged: {e}")))?;
        if out.len() > most {
            return Err(fault(format!("it inflates to more than {MOST} numbers, the most that are read")));
        }
        at = end;
    }
    Ok(out)
}

/// How many bytes an array takes of which these are the first: of its header, until that is whole.
fn extent(bytes: &[u8], layout: &Layout) -> Result<usize, Fault> {
    let width = if layout.wide { 8 } else { 4 };
    let cut = || fault("its data end early: truncated");
    let sum = |from: usize, sizes: core::ops::Range<usize>| {
        sizes.into_iter().try_fold(from, |s, i| s.checked_add(header(bytes, i, layout)?).ok_or_else(cut))
    };
    if bytes.len() < width {
        return Ok(width);
    }
    if !layout.zlib {
        return sum(width, 0..1);
    }
    let count = header(bytes, 0, layout)?;
    let heads = count.checked_add(3).and_then(|n| n.checked_mul(width)).ok_or_else(cut)?;
    if bytes.len() < heads { Ok(heads) } else { sum(heads, 3..3 + count) }
}

/// One array in base64, which ends where its header says or at the first byte that is none; headers and data are encoded apart and
/// joined.
fn unbase64(text: &[u8], layout: &Layout) -> Result<Vec<u8>, Fault> {
    let digit = |b: u8| match b {
        b'A'..=b'Z' => Some(b - b'A'),
        b'a'..=b'z' => Some(b - b'a' + 26),
        b'0'..=b'9' => Some(b - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let mut out = Vec::new();
    let mut end = extent(&out, layout)?;
    let (mut bits, mut held, mut begun) = (0u32, 0, false);
    for &b in text.iter().filter(|b| !b.is_ascii_whitespace()) {
        if b == b'=' {
            // The end of a run of its own.
            (bits, held, begun) = (0, 0, true);
            continue;
        }
        let Some(d) = digit(b) else {
            if begun || !out.is_empty() {
                break;
            }
            return Err(fault(format!("{} is not base64", shown(&[b]))));
        };
        bits = bits << 6 | u32::from(d);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
        // Other arrays may follow in appended data.
        if out.len() == end {
            end = extent(&out, layout)?;
            if out.len() == end {
                break;
            }
        }
    }
    Ok(out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const HEX: &str = r#"<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="1">
<PointData><DataArray type="Float32" Name="T" format="ascii">0 1 2 3 4 5 6 7</DataArray></PointData>
<CellData><DataArray type="Float64" Name="S" NumberOfComponents="6" format="ascii">1 2 3 4 5 6</DataArray></CellData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">12</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"#;

    #[test]
    fn a_hexahedron_is_cut_into_its_whole_volume() {
        let data = read_vtk(HEX.as_bytes()).unwrap();
        let DataSet::Mesh(elements) = &data.shape else { panic!("mesh") };
        let (points, (tets, of)) = (&elements.points, elements.tets());
        let volume: f64 = tets
            .iter()
            .map(|t| {
                let p = t.map(|i| points[i as usize]);
                let e = [1, 2, 3].map(|i| crate::math::sub(p[i], p[0]));
                crate::math::determinant(&e) / 6.0
            })
            .sum();
        assert!((volume - 1.0).abs() < 1e-15 && of.iter().all(|c| *c == 0));
        assert_eq!(data.arrays[0].values, (0..8).map(f64::from).collect::<Vec<_>>());
        assert_eq!((data.arrays[1].of_cells, data.arrays[1].components), (true, 6));
    }

    #[test]
    fn encodings_agree_and_damage_is_refused() {
        let base64 = |b: &[u8]| {
            const D: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
            let mut out = String::new();
            for c in b.chunks(3) {
                let v = u32::from(c[0]) << 16
                    | u32::from(*c.get(1).unwrap_or(&0)) << 8
                    | u32::from(*c.get(2).unwrap_or(&0));
                for i in 0..4 {
                    out.push(if i <= c.len() { D[(v >> (18 - 6 * i) & 63) as usize] as char } else { '=' });
                }
            }
            out
        };
        let values: Vec<u8> = (0..8).flat_map(|v| (v as f32).to_le_bytes()).collect();
        let plain = base64(&[&32u32.to_le_bytes()[..], &values].concat());
        let inline = HEX.replace(
            "format=\"ascii\">0 1 2 3 4 5 6 7</DataArray></PointData>",
            &format!("format=\"binary\">{plain}</DataArray></PointData>"),
        );
        assert_eq!(read_vtk(inline.as_bytes()).unwrap(), read_vtk(HEX.as_bytes()).unwrap());
        let mut packed = Vec::new();
        flate2::read::ZlibEncoder::new(&values[..], flate2::Compression::default()).read_to_end(&mut packed).unwrap();
        let heads: Vec<u8> = [1u32, 32, 0, packed.len() as u32].iter().flat_map(|v| v.to_le_bytes()).collect();
        // No more is inflated than may be, whatever the header says.
        let layout = Layout { zlib: true, ..Layout::default() };
        let both = [&heads[..], &packed].concat();
        assert_eq!(blocks(&both, &layout, 32).unwrap(), values);
        assert!(blocks(&both, &layout, 31).unwrap_err().message.contains("inflates to more than"));
        // Other arrays are ASCII still; the compressor is named for the file.
        let text = format!("{}{}", base64(&heads), base64(&packed));
        let zlib = inline
            .replace(&plain, &text)
            .replace("version=\"0.1\"", "version=\"0.1\" compressor=\"vtkZLibDataCompressor\"");
        assert_eq!(read_vtk(zlib.as_bytes()).unwrap(), read_vtk(HEX.as_bytes()).unwrap());
        // Arrays that follow each other in base64: each is read to its own end.
        for (text, compressor) in [(&plain, ""), (&text, " compressor=\"vtkZLibDataCompressor\"")] {
            let offset = format!("format=\"appended\" offset=\"{}\"/></PointData>", text.len());
            let appended = HEX
                .replace("format=\"ascii\">0 1 2 3 4 5 6 7</DataArray></PointData>", &offset)
                .replace("version=\"0.1\"", &format!("version=\"0.1\"{compressor}"))
                .replace(
                    "</VTKFile>",
                    &format!("<AppendedData encoding=\"base64\">_{text}{text}</AppendedData></VTKFile>"),
                );
            let layout = Layout { appended: None, big: false, wide: false, zlib: !compressor.is_empty() };
            assert_eq!(unbase64(format!("{text}{text}").as_bytes(), &layout), unbase64(text.as_bytes(), &layout));
            assert_eq!(read_vtk(appended.as_bytes()).unwrap(), read_vtk(HEX.as_bytes()).unwrap());
        }
        let raw = HEX.replace(
            "format=\"ascii\">0 1 2 3 4 5 6 7</DataArray></PointData>",
            "format=\"appended\" offset=\"0\"/></PointData>",
        );
        let raw = raw.replace("</VTKFile>", "<AppendedData encoding=\"raw\">_");
        let raw = [raw.as_bytes(), &32u32.to_le_bytes(), &values, b"</AppendedData></VTKFile>"].concat();
        assert_eq!(read_vtk(&raw).unwrap(), read_vtk(HEX.as_bytes()).unwrap());
        for bytes in [inline.as_bytes(), &raw] {
            for n in (0..bytes.len() - 40).step_by(7) {
                assert!(read_vtk(&bytes[..n]).is_err(), "{n}");
            }
        }
    }
}
