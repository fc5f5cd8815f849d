//! Wavefront OBJ: vertices and faces.
//!
//! Source: Wavefront Technologies, Advanced Visualizer, Appendix B1: Object Files.

use std::io::{self, Write};

use super::join::Joiner;
use super::number::push_u32;
use super::text::{NumberedLines, at_line, parse, position, shown, words};
use super::{Indexed, Metadata, in_order, invalid};
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Writes OBJ; coordinates are the shortest decimal text that reads back to the same double.
pub fn write(mesh: &dyn Indexed, meta: &Metadata, out: &mut dyn Write) -> io::Result<()> {
    let [v, t] = mesh.counts();
    if v >= u32::MAX as usize {
        return Err(invalid(format!("OBJ holds at most {} vertices here", u32::MAX - 1)));
    }
    for (key, text) in [("", meta.application.as_str()), ("title ", meta.title.as_str())] {
        if !text.is_empty() {
            writeln!(out, "# {key}{}", text.replace(['\n', '\r', '\\'], " "))?;
        }
    }
    out.write_all(b"# lengths in mm\n")?;
    let points = |r: std::ops::Range<usize>| {
        let mut text = Vec::with_capacity(r.len() * 40);
        for [x, y, z] in mesh.positions(r)?.iter() {
            // Writing to memory cannot fail.
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        Ok(text)
    };
    in_order(v, 1 << 14, points, |text| out.write_all(&text))?;
    let faces = |r: std::ops::Range<usize>| {
        let mut text = Vec::with_capacity(r.len() * 28);
        for t in mesh.corners(r)?.iter() {
            text.push(b'f');
            for v in t {
                text.push(b' ');
                push_u32(&mut text, v + 1);
            }
            text.push(b'\n');
        }
        Ok(text)
    };
    in_order(t, 1 << 14, faces, |text| out.write_all(&text))
}

/// Reads vertices and faces; everything else is passed over.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut vertices = Vec::new();
    let mut unknown = None;
    for (line, text) in NumberedLines::new(bytes) {
        let mut w = words(text);
        match w.next() {
            Some(b"v") => vertices.push(position(line, w)?),
            Some(k) if !k.starts_with(b"#") && !k.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_') => {
                unknown.get_or_insert((line, k));
            }
            _ => {}
        }
    }
    if let Some((line, k)) = unknown {
        return Err(at_line(line, format!("{} is not a keyword of OBJ: damaged or not OBJ", shown(k))));
    }
    let mut joiner = Joiner::default();
    let (mut so_far, mut polygon) = (0i64, Vec::new());
    for (line, text) in NumberedLines::new(bytes) {
        let mut w = words(text);
        match w.next() {
            Some(b"v") => so_far += 1,
            Some(b"f") => {
                polygon.clear();
                for corner in w.take_while(|c| !c.starts_with(b"#")) {
                    let number = corner.split(|b| *b == b'/').next().and_then(parse::<i64>);
                    let index = match number {
                        Some(n) if n < 0 => so_far + n,
                        Some(n) => n - 1,
                        None => {
                            return Err(at_line(line, format!("{} is not a vertex index", shown(corner))));
                        }
                    };
                    if index < 0 || index >= vertices.len() as i64 {
                        let count = vertices.len();
                        let message = format!("vertex {} does not exist: there are {count}", shown(corner));
                        return Err(at_line(line, message));
                    }
                    polygon.push(index as u32);
                }
                if polygon.len() < 3 {
                    return Err(at_line(line, format!("a face of {} vertices: three are the least", polygon.len())));
                }
                joiner.fan(&vertices, &polygon)?;
            }
            _ => {}
        }
    }
    if joiner.len() == 0 {
        return Err(Fault::new("", format!("{} vertices and no face: truncated or not OBJ", vertices.len())));
    }
    Ok(joiner.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::tests::{refuses_damage, tetrahedron};

    #[test]
    fn comes_back_bit_by_bit() {
        let mut mesh = tetrahedron();
        mesh.vertices[3] = [1.0 / 3.0, -1e-300, 1e22];
        let mut bytes = Vec::new();
        let meta = Metadata { title: "two\nlines".into(), ..Metadata::default() };
        write(&mesh, &meta, &mut bytes).unwrap();
        let back = read(&bytes).unwrap();
        assert_eq!(back.volume(), mesh.volume());
        assert_eq!(back.triangles.len(), 4);
    }

    #[test]
    fn all_forms_of_faces() {
        let text = "# c\nmtllib a.mtl\no thing\nv 0 0 0 1 0.5 0.5\nv 1 0 0\nvn 0 0 1\nvt 0 0\nv 1 1 0\nf 1/1/1 2//1 3/1\n\
                    v 0 1 0\nv -1 .5 0\nusemtl m\ns off\nf -5 -3 \\\n -2 5\n";
        let mesh = read(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        refuses_damage("obj", text.as_bytes(), text.find("f 1/1").unwrap() + 14);
    }

    #[test]
    fn faces_must_use_vertices_that_exist() {
        for (face, line) in [("f 1 2 4", 4), ("f 0 1 2", 4), ("f -4 1 2", 4), ("f 1 2", 4), ("f 1 2 x", 4)] {
            let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{face}\n");
            let fault = read(text.as_bytes()).unwrap_err();
            assert!(fault.message.starts_with(&format!("line {line}: ")), "{fault}");
        }
    }
}
