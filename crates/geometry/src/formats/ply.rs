//! PLY, written binary little-endian with double vertices, read in all three encodings.
//!
//! Source: G. Turk, The PLY Polygon File Format (1994).

use std::io::{self, Write};

use super::join::Joiner;
use super::text::{at_line, parse, shown, words};
use super::{Indexed, in_order, invalid};
use crate::fault::Fault;
use crate::math::Vec3;
use crate::mesh::Mesh;

/// Writes binary PLY. Coordinates are double precision: nothing is rounded.
pub fn write(mesh: &dyn Indexed, out: &mut dyn Write) -> io::Result<()> {
    let [v, t] = mesh.counts();
    if v > i32::MAX as usize {
        return Err(invalid(format!("PLY holds at most {} vertices here, the mesh has {v}", i32::MAX)));
    }
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment lengths in mm\nelement vertex {v}\nproperty double x\nproperty \
         double y\nproperty double z\nelement face {t}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    let points = |r: std::ops::Range<usize>| {
        let positions = mesh.positions(r)?;
        Ok(positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
    };
    in_order(v, 1 << 15, points, |bytes| out.write_all(&bytes))?;
    let faces = |r: std::ops::Range<usize>| {
        let mut bytes = vec![3; r.len() * 13];
        for (record, t) in bytes.chunks_exact_mut(13).zip(mesh.corners(r)?.iter()) {
            for (to, i) in record[1..].chunks_exact_mut(4).zip(t) {
                to.copy_from_slice(&i.to_le_bytes());
            }
        }
        Ok(bytes)
    };
    in_order(t, 1 << 15, faces, |bytes| out.write_all(&bytes))
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy)]
enum PropertyType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl PropertyType {
    fn named(word: &[u8]) -> Option<PropertyType> {
        Some(match word {
            b"char" | b"int8" => PropertyType::I8,
            b"uchar" | b"uint8" => PropertyType::U8,
            b"short" | b"int16" => PropertyType::I16,
            b"ushort" | b"uint16" => PropertyType::U16,
            b"int" | b"int32" => PropertyType::I32,
            b"uint" | b"uint32" => PropertyType::U32,
            b"float" | b"float32" => PropertyType::F32,
            b"double" | b"float64" => PropertyType::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            PropertyType::I8 | PropertyType::U8 => 1,
            PropertyType::I16 | PropertyType::U16 => 2,
            PropertyType::I32 | PropertyType::U32 | PropertyType::F32 => 4,
            PropertyType::F64 => 8,
        }
    }
}

struct Property {
    name: Vec<u8>,
    /// Type of the length that precedes a list.
    list: Option<PropertyType>,
    kind: PropertyType,
}

struct Element {
    name: Vec<u8>,
    count: usize,
    properties: Vec<Property>,
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
}

/// Reads the header; gives it and the number of bytes it takes.
fn header(bytes: &[u8]) -> Result<(Header, usize), Fault> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for line in 1.. {
        let Some(n) = bytes[at..].iter().position(|b| *b == b'\n') else {
            break;
        };
        let text = &bytes[at..at + n];
        at += n + 1;
        let all: Vec<&[u8]> = words(text).collect();
        let wrong = || at_line(line, format!("{} is not a line of a PLY header", shown(text)));
        let count = |w| parse::<usize>(w).ok_or_else(wrong);
        let kind =
            |w| PropertyType::named(w).ok_or_else(|| at_line(line, format!("unknown property type {}", shown(w))));
        match all.as_slice() {
            [b"ply"] if line == 1 => {}
            _ if line == 1 => break,
            [b"format", name, _] => {
                encoding = Some(match *name {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => return Err(at_line(line, format!("unknown format {}", shown(name)))),
                });
            }
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"element", name, n] => {
                elements.push(Element { name: name.to_vec(), count: count(n)?, properties: Vec::new() });
            }
            [b"property", rest @ ..] => {
                let (list, k, name) = match rest {
                    [b"list", length, k, name] => (Some(kind(length)?), kind(k)?, name),
                    [k, name] => (None, kind(k)?, name),
                    _ => return Err(wrong()),
                };
                let element = elements.last_mut().ok_or_else(wrong)?;
                element.properties.push(Property { name: name.to_vec(), list, kind: k });
            }
            [b"end_header"] => {
                let encoding = encoding.ok_or_else(|| at_line(line, "the header names no format"))?;
                return Ok((Header { encoding, elements }, at));
            }
            _ => return Err(wrong()),
        }
    }
    let what =
        if bytes.starts_with(b"ply") { "the header has no end_header line" } else { "no \"ply\" in the first line" };
    Err(Fault::new("", format!("{what}: truncated or not PLY")))
}

/// The numbers after the header, one after the other.
struct Numbers<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

impl Numbers<'_> {
    fn next(&mut self, kind: PropertyType, what: &dyn Fn() -> String) -> Result<f64, Fault> {
        let cut = |at: usize| Fault::new("", format!("the file ends at byte {at}, within {}", what()));
        if self.encoding == Encoding::Text {
            let rest = &self.bytes[self.at..];
            let from = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(|| cut(self.bytes.len()))?;
            let len = rest[from..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - from);
            let word = &rest[from..from + len];
            self.at += from + len;
            return parse(word).ok_or_else(|| {
                Fault::new("", format!("{} in {} (byte {}) is not a number", shown(word), what(), self.at - len))
            });
        }
        let mut b = [0; 8];
        let n = kind.size();
        let from = self.bytes.get(self.at..self.at + n).ok_or_else(|| cut(self.bytes.len()))?;
        self.at += n;
        b[..n].copy_from_slice(from);
        if self.encoding == Encoding::Big {
            b[..n].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        Ok(match kind {
            PropertyType::I8 => f64::from(b0 as i8),
            PropertyType::U8 => f64::from(b0),
            PropertyType::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            PropertyType::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            PropertyType::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            PropertyType::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            PropertyType::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            PropertyType::F64 => f64::from_le_bytes(b),
        })
    }

    /// A whole number from zero on, such as a list's length or an index.
    fn whole(&mut self, kind: PropertyType, what: &dyn Fn() -> String) -> Result<usize, Fault> {
        let v = self.next(kind, what)?;
        if v >= 0.0 && v.fract() == 0.0 && v <= f64::from(u32::MAX) {
            Ok(v as usize)
        } else {
            Err(Fault::new("", format!("{v} in {} is not an index or count", what())))
        }
    }

    /// Bytes that are left.
    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }
}

/// What an element of the file is to the mesh.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// A vertex, with the places of x, y and z among its properties.
    Vertex([usize; 3]),
    /// A polygon: a list of its corners.
    Face,
    /// Triangle strips: a list of vertices, −1 between one strip and the next.
    Strips,
    /// Passed over.
    Other,
}

impl Role {
    fn of(element: &Element) -> Result<Role, Fault> {
        Ok(match &*element.name {
            b"vertex" => {
                let mut slots = [0; 3];
                for (slot, axis) in slots.iter_mut().zip(["x", "y", "z"]) {
                    let found = element.properties.iter().position(|p| p.list.is_none() && p.name == axis.as_bytes());
                    *slot = found.ok_or_else(|| Fault::new("", format!("the vertices have no property {axis}")))?;
                }
                Role::Vertex(slots)
            }
            b"face" => Role::Face,
            b"tristrips" => Role::Strips,
            _ => Role::Other,
        })
    }
}

/// What is gathered from the elements.
#[derive(Default)]
struct Parts {
    vertices: Vec<Vec3>,
    /// Polygons, each preceded by its number of corners.
    faces: Vec<u32>,
    /// Vertices of triangle strips, `END` after each strip.
    strips: Vec<u32>,
}

/// The end of a triangle strip.
const END: u32 = u32::MAX;

/// Reads any PLY with vertices x, y, z and lists `vertex_indices` or `vertex_index` of faces or triangle strips.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let (header, at) = header(bytes)?;
    let mut numbers = Numbers { bytes, at, encoding: header.encoding };
    let mut parts = Parts::default();
    for element in header.elements.iter().filter(|e| !e.properties.is_empty()) {
        // The least an element takes: a text number and its space, or the sizes that the header names.
        let sizes = element.properties.iter();
        let least: usize =
            sizes.map(|p| if header.encoding == Encoding::Text { 2 } else { p.list.unwrap_or(p.kind).size() }).sum();
        if element.count.saturating_mul(least) > numbers.left() + 1 {
            return Err(Fault::new(
                "",
                format!(
                    "{} elements \"{}\" take at least {} bytes, but {} are left: truncated",
                    element.count,
                    String::from_utf8_lossy(&element.name),
                    element.count.saturating_mul(least),
                    numbers.left()
                ),
            ));
        }
        parts.read(element, &mut numbers)?;
    }
    parts.mesh()
}

impl Parts {
    /// Takes in all elements of one name.
    fn read(&mut self, element: &Element, numbers: &mut Numbers) -> Result<(), Fault> {
        let role = Role::of(element)?;
        let name = String::from_utf8_lossy(&element.name);
        for i in 0..element.count {
            let what = || format!("{name} {i} of {}", element.count);
            let mut position = [0.0; 3];
            for (k, property) in element.properties.iter().enumerate() {
                if let Some(length) = property.list {
                    let n = numbers.whole(length, &what)?;
                    let corners = matches!(&*property.name, b"vertex_indices" | b"vertex_index");
                    self.list(if corners { role } else { Role::Other }, n, property.kind, numbers, &what)?;
                    continue;
                }
                let v = numbers.next(property.kind, &what)?;
                let Role::Vertex(slots) = role else { continue };
                if let Some(a) = slots.iter().position(|s| *s == k) {
                    if !v.is_finite() {
                        return Err(Fault::new("", format!("{} has the coordinate {v}: not finite", what())));
                    }
                    position[a] = v;
                }
            }
            if let Role::Vertex(_) = role {
                self.vertices.push(position);
            }
        }
        Ok(())
    }

    /// Takes in a list of `n` numbers.
    fn list(
        &mut self,
        role: Role,
        n: usize,
        kind: PropertyType,
        numbers: &mut Numbers,
        what: &dyn Fn() -> String,
    ) -> Result<(), Fault> {
        match role {
            Role::Face => {
                self.faces.push(n as u32);
                for _ in 0..n {
                    self.faces.push(numbers.whole(kind, what)? as u32);
                }
            }
            Role::Strips => {
                for _ in 0..n {
                    let before = numbers.at;
                    if numbers.next(kind, what)? == -1.0 {
                        self.strips.push(END);
                        continue;
                    }
                    numbers.at = before;
                    self.strips.push(numbers.whole(kind, what)? as u32);
                }
                self.strips.push(END);
            }
            _ => {
                for _ in 0..n {
                    numbers.next(kind, what)?;
                }
            }
        }
        Ok(())
    }

    fn mesh(&self) -> Result<Mesh, Fault> {
        let (vertices, count) = (&self.vertices, self.vertices.len());
        let known = |what: &str, i: usize, of: &[u32]| match of.iter().find(|v| **v as usize >= count) {
            Some(v) => Err(Fault::new("", format!("{what} {i} uses vertex {v}, but there are {count} (from 0)"))),
            None => Ok(()),
        };
        let mut joiner = Joiner::default();
        let (mut face, mut lists) = (0, self.faces.as_slice());
        while let [n, rest @ ..] = lists {
            let (polygon, after) = rest.split_at(*n as usize);
            known("face", face, polygon)?;
            joiner.fan(vertices, polygon)?;
            lists = after;
            face += 1;
        }
        for (i, strip) in self.strips.split(|v| *v == END).enumerate() {
            known("triangle strip", i, strip)?;
            for (k, t) in strip.windows(3).enumerate() {
                // Each second triangle runs the other way; one with a corner twice only turns the strip.
                let [a, b, c] = if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
                if a != b && b != c && c != a {
                    joiner.triangle([a, b, c].map(|v| vertices[v as usize]))?;
                }
            }
        }
        Ok(joiner.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::tests::{refuses_damage, tetrahedron};

    #[test]
    fn binary_comes_back_bit_by_bit() {
        let mut mesh = tetrahedron();
        mesh.vertices[3][2] = 1.0 / 3.0;
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let back = read(&bytes).unwrap();
        assert_eq!(back.volume(), mesh.volume());
        assert_eq!(back.triangles.len(), 4);
        refuses_damage("ply", &bytes, bytes.len());
    }

    #[test]
    fn text_with_other_elements_and_a_polygon() {
        let text = "ply\r\nformat ascii 1.0\r\ncomment c\r\nelement extra 1\r\nproperty list uchar int of\r\nelement vertex 4\r\n\
                    property float x\nproperty uchar red\nproperty float32 y\nproperty double z\nelement face 1\n\
                    property list uchar uint vertex_index\nproperty int flag\nend_header\n3 7 8 9\n0 1 0 0\n1 1 0 0\n1 1 1 0\n\
                    0 1 1 0\n4 0 1 2 3 9\n";
        let mesh = read(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.area(), 1.0);
        refuses_damage("ply", text.as_bytes(), text.len() - 2);
    }

    #[test]
    fn big_endian() {
        let mut bytes =
            b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty float y\nproperty \
                          char z\nelement face 1\nproperty list ushort short vertex_indices\nend_header\n"
                .to_vec();
        for (x, y, z) in [(0i16, 0f32, 0i8), (300, 0.0, -1), (0, 2.5, 0)] {
            bytes.extend(x.to_be_bytes());
            bytes.extend(y.to_be_bytes());
            bytes.push(z as u8);
        }
        [3u16, 0, 1, 2].iter().for_each(|v| bytes.extend(v.to_be_bytes()));
        let mesh = read(&bytes).unwrap();
        assert_eq!(mesh.vertices, [[0.0; 3], [300.0, 0.0, -1.0], [0.0, 2.5, 0.0]]);
        refuses_damage("ply", &bytes, bytes.len());
    }

    #[test]
    fn wild_counts_and_indices_are_refused_before_memory_is_taken() {
        let head = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float \
                    z\nend_header\n0 0 0\n";
        assert!(read(head.as_bytes()).unwrap_err().message.contains("4000000000 elements"));
        let mut bytes = Vec::new();
        write(&tetrahedron(), &mut bytes).unwrap();
        let n = bytes.len();
        bytes[n - 4..].copy_from_slice(&9i32.to_le_bytes());
        assert_eq!(read(&bytes).unwrap_err().message, "face 3 uses vertex 9, but there are 4 (from 0)");
        bytes[n - 4..].copy_from_slice(&(-1i32).to_le_bytes());
        assert!(read(&bytes).unwrap_err().message.contains("-1 in face 3 of 4"));
    }

    #[test]
    fn triangle_strips_turn_alike() {
        let head = |form: &str| {
            format!(
                "ply\nformat {form} 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement \
                 tristrips 1\nproperty list int int vertex_indices\nend_header\n"
            )
        };
        let places = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.5, 1.0f32]];
        // A square of two triangles; a strip that turns by a corner given twice; two corners, which are no triangle.
        let strips = [0i32, 1, 2, 3, -1, 4, 1, 0, 0, 2, 3, -1, 3, 4];
        let mut text = head("ascii");
        places.iter().for_each(|p| text += &format!("{} {} {}\n", p[0], p[1], p[2]));
        text += &format!("{}{}\n", strips.len(), strips.map(|v| format!(" {v}")).concat());
        let mut bytes = head("binary_little_endian").into_bytes();
        bytes.extend(places.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend((strips.len() as i32).to_le_bytes());
        bytes.extend(strips.iter().flat_map(|v| v.to_le_bytes()));
        let triangles = [[0, 1, 2], [2, 1, 3], [4, 1, 0], [2, 0, 3]];
        for file in [text.as_bytes(), &bytes] {
            let mesh = read(file).unwrap();
            let at = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize].map(|x| x as f32));
            let found: Vec<_> = mesh.triangles.iter().map(at).collect();
            assert_eq!(found, triangles.map(|t: [usize; 3]| t.map(|v| places[v])));
        }
        refuses_damage("ply", &bytes, bytes.len());
        let wrong = text.replace(" -1 3 4\n", " -1 3 9\n");
        let words = "triangle strip 2 uses vertex 9, but there are 5 (from 0)";
        assert_eq!(read(wrong.as_bytes()).unwrap_err().message, words);
        assert!(
            read(text.replace(" -1 3 4\n", " -2 3 4\n").as_bytes()).unwrap_err().message.contains("-2 in tristrips 0")
        );
    }
}
