//! Object File Format (OFF), read only.
//!
//! Source: Geomview manual, OFF files.

use super::join::Joiner;
use super::text::{NumberedLines, at_line, parse, position, shown, words};
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Reads text OFF with or without normals, colours and texture coordinates (NOFF, COFF, STOFF), which are dropped.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut lines = NumberedLines::new(bytes)
        .map(|(n, l)| (n, l.split(|b| *b == b'#').next().unwrap_or_default()))
        .filter(|(_, l)| words(l).next().is_some());
    let Some((mut line, mut text)) = lines.next() else {
        return Err(Fault::new("", "no line but comments: truncated or not OFF"));
    };
    let first = words(text).next().unwrap_or_default();
    if let Some(kind) = first.to_ascii_uppercase().strip_suffix(b"OFF") {
        if !matches!(kind, b"" | b"C" | b"N" | b"CN" | b"ST" | b"STC" | b"STN" | b"STCN") {
            return Err(at_line(line, format!("{} has four or more coordinates: give OFF in three", shown(first))));
        }
        if words(text).nth(1).is_some_and(|w| w.eq_ignore_ascii_case(b"binary")) {
            return Err(at_line(line, "binary OFF is not read: save it as text"));
        }
        if words(text).nth(1).is_some() {
            let skip = text.windows(first.len()).position(|w| w == first).unwrap_or(0) + first.len();
            text = &text[skip..];
        } else {
            (line, text) = lines.next().ok_or_else(|| at_line(line, "the counts are missing: truncated"))?;
        }
    }
    let counts: Vec<Option<usize>> = words(text).take(2).map(parse).collect();
    let [Some(vertex_count), Some(face_count)] = counts[..] else {
        return Err(at_line(line, format!("{} is not the counts of vertices, faces and edges", shown(text))));
    };
    // The least a vertex and a face take: "0 0 0" and "3 0 0 0" with a line end, though the last may lack one.
    let least = vertex_count.saturating_mul(6).saturating_add(face_count.saturating_mul(2));
    if least > bytes.len() {
        let found = format!("{vertex_count} vertices and {face_count} faces take at least {least} bytes");
        return Err(at_line(line, format!("{found}, but the file has {}: truncated", bytes.len())));
    }
    let mut vertices = Vec::with_capacity(vertex_count);
    for i in 0..vertex_count {
        let Some((line, text)) = lines.next() else {
            return Err(Fault::new("", format!("{vertex_count} vertices are named, the file ends after {i}")));
        };
        vertices.push(position(line, words(text))?);
    }
    let mut joiner = Joiner::default();
    let mut polygon = Vec::new();
    for i in 0..face_count {
        let Some((line, text)) = lines.next() else {
            return Err(Fault::new("", format!("{face_count} faces are named, the file ends after {i}")));
        };
        let mut w = words(text);
        let head = w.next().unwrap_or_default();
        let Some(n) = parse::<usize>(head) else {
            return Err(at_line(line, format!("{} is not a number of corners", shown(head))));
        };
        polygon.clear();
        for k in 0..n {
            let Some(word) = w.next() else {
                return Err(at_line(line, format!("a face of {n} corners names {k}")));
            };
            match parse::<u32>(word) {
                Some(v) if (v as usize) < vertices.len() => polygon.push(v),
                _ => {
                    let found = format!("{} is not a vertex", shown(word));
                    return Err(at_line(line, format!("{found}: they run from 0 to {}", vertices.len().max(1) - 1)));
                }
            }
        }
        joiner.fan(&vertices, &polygon)?;
    }
    Ok(joiner.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::tests::refuses_damage;

    const COFF: &str = "# made by hand\nCOFF # coloured\n\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 0\n1 1 0 0 0 0 0 # a comment\n\
                        0 1 0 0 0 0 0\n4 0 1 2 3 0.5 0.5 0.5\n3 2 1 0\n";

    #[test]
    fn coloured_with_comments_and_polygons() {
        let mesh = read(COFF.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
        refuses_damage("off", COFF.as_bytes(), COFF.len() - 1);
    }

    #[test]
    fn counts_beside_the_word_or_without_it() {
        let body = "3 1 3\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
        for head in ["OFF ", "off\n", "", "NOFF\n"] {
            assert_eq!(read(format!("{head}{body}").as_bytes()).unwrap().triangles, [[0, 1, 2]]);
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let cases = [
            "4OFF\n3 1 0\n",
            "OFF BINARY\n3 1 0\n",
            "OFF\n4000000000 1 0\n0 0 0\n",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n18446744073709551615 0 1 2\n",
        ];
        for text in cases {
            assert!(read(text.as_bytes()).is_err(), "{text}");
        }
    }
}
