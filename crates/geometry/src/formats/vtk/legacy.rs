//! The legacy format: a header of text, then text or big-endian numbers.

use super::{Array, Data, Elements, Shape, check, fault, numbers};
use crate::fault::Fault;
use crate::formats::text::{parse, shown};

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
}

impl<'a> Reader<'a> {
    fn line(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|r| !r.is_empty())?;
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at += end + 1;
        Some(String::from_utf8_lossy(&rest[..end]).trim().to_string())
    }

    fn word(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..)?;
        let from = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = rest[from..].iter().position(u8::is_ascii_whitespace).map_or(rest.len(), |e| from + e);
        self.at += end;
        Some(&rest[from..end])
    }

    fn text(&mut self) -> Option<String> {
        self.word().map(|w| String::from_utf8_lossy(w).into_owned())
    }

    fn count(&mut self, what: &str) -> Result<usize, Fault> {
        let word = self.word().unwrap_or_default();
        parse(word).ok_or_else(|| fault(format!("{what} should be a whole number, found {}", shown(word))))
    }

    fn three<T: core::str::FromStr + Copy + Default>(&mut self, what: &str) -> Result<[T; 3], Fault> {
        let mut out = [T::default(); 3];
        for o in &mut out {
            let word = self.word().unwrap_or_default();
            *o = parse(word).ok_or_else(|| fault(format!("{what} should be three numbers, found {}", shown(word))))?;
        }
        Ok(out)
    }

    /// A given count of numbers of one type.
    fn numbers(&mut self, count: usize, kind: &str) -> Result<Vec<f64>, Fault> {
        let cut = || fault("the file ends early: truncated");
        if !self.binary {
            let mut out = Vec::new();
            for _ in 0..count {
                let word = self.word().ok_or_else(cut)?;
                out.push(parse(word).ok_or_else(|| fault(format!("{} is not a number", shown(word))))?);
            }
            return Ok(out);
        }
        let (kind, width) = match kind.to_ascii_lowercase().as_str() {
            "double" => ("Float64", 8),
            "float" => ("Float32", 4),
            "long" | "vtktypeint64" | "vtkidtype" => ("Int64", 8),
            "unsigned_long" | "vtktypeuint64" => ("UInt64", 8),
            "int" | "vtktypeint32" => ("Int32", 4),
            "unsigned_int" | "vtktypeuint32" => ("UInt32", 4),
            "short" | "vtktypeint16" => ("Int16", 2),
            "unsigned_short" | "vtktypeuint16" => ("UInt16", 2),
            "char" | "signed_char" | "vtktypeint8" => ("Int8", 1),
            "unsigned_char" | "vtktypeuint8" => ("UInt8", 1),
            other => return Err(fault(format!("the type \"{other}\" is not a number"))),
        };
        // One line end, then the bytes.
        while self.bytes.get(self.at).is_some_and(|b| *b == b' ' || *b == b'\r') {
            self.at += 1;
        }
        self.at += 1;
        let end = count.checked_mul(width).and_then(|n| n.checked_add(self.at)).ok_or_else(cut)?;
        let out = numbers(self.bytes.get(self.at..end).ok_or_else(cut)?, kind, true);
        self.at = end;
        out
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Data, Fault> {
    let mut r = Reader { bytes, at: 0, binary: false };
    r.line();
    r.line();
    let form = r.line().unwrap_or_default();
    r.binary = match form.to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        _ => {
            return Err(fault(format!("the third line should say ASCII or BINARY, found \"{form}\"")));
        }
    };
    let (mut kind, mut nodes, mut origin, mut step) = (String::new(), [1usize; 3], [0.0; 3], [1.0; 3]);
    let (mut place, mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut arrays: Vec<Array> = Vec::new();
    let (mut of_cells, mut count) = (false, 0);
    while let Some(word) = r.text() {
        match word.to_ascii_uppercase().as_str() {
            "DATASET" => {
                kind = r.text().unwrap_or_default().to_ascii_uppercase();
                if kind != "STRUCTURED_POINTS" && kind != "UNSTRUCTURED_GRID" {
                    return Err(fault(format!(
                        "a data set of {kind}; STRUCTURED_POINTS and UNSTRUCTURED_GRID are read"
                    )));
                }
            }
            "DIMENSIONS" => nodes = r.three("DIMENSIONS")?,
            "ORIGIN" => origin = r.three("ORIGIN")?,
            "SPACING" | "ASPECT_RATIO" => step = r.three("SPACING")?,
            "POINTS" => {
                let n = r.count("the number of points")?;
                let of = r.text().unwrap_or_default();
                place = r.numbers(n.saturating_mul(3), &of)?;
            }
            "CELLS" => {
                let (n, size) = (r.count("the number of cells")?, r.count("the size of the cells")?);
                let at = r.at;
                if r.text().as_deref() == Some("OFFSETS") {
                    let of = r.text().unwrap_or_default();
                    offsets = r.numbers(n, &of)?;
                    // The first is zero; the last cell ends with the list.
                    offsets = offsets.split_off(1.min(offsets.len()));
                    r.text();
                    let of = r.text().unwrap_or_default();
                    connectivity = r.numbers(size, &of)?;
                } else {
                    r.at = at;
                    let all = r.numbers(size, "int")?;
                    let mut from = 0;
                    for _ in 0..n {
                        let m = all.get(from).copied().unwrap_or(0.0) as usize;
                        let corners = all.get(from + 1..(from + 1).saturating_add(m));
                        connectivity.extend(corners.ok_or_else(|| fault("a cell reaches beyond the list of cells"))?);
                        offsets.push(connectivity.len() as f64);
                        from += m + 1;
                    }
                }
            }
            "CELL_TYPES" => {
                let n = r.count("the number of cell types")?;
                types = r.numbers(n, "int")?;
            }
            "POINT_DATA" | "CELL_DATA" => {
                of_cells = word.eq_ignore_ascii_case("CELL_DATA");
                count = r.count("the number of values")?;
            }
            "SCALARS" => {
                let (name, of) = (r.text().unwrap_or_default(), r.text().unwrap_or_default());
                let rest = r.line().unwrap_or_default();
                let components = rest.parse().unwrap_or(1);
                let at = r.at;
                if r.text().as_deref() == Some("LOOKUP_TABLE") {
                    r.text();
                } else {
                    r.at = at;
                }
                let values = r.numbers(count.saturating_mul(components), &of)?;
                arrays.push(Array { name, of_cells, components, values });
            }
            "VECTORS" | "NORMALS" | "TENSORS" | "TENSORS6" => {
                let components = match word.to_ascii_uppercase().as_str() {
                    "TENSORS" => 9,
                    "TENSORS6" => 6,
                    _ => 3,
                };
                let (name, of) = (r.text().unwrap_or_default(), r.text().unwrap_or_default());
                let values = r.numbers(count.saturating_mul(components), &of)?;
                arrays.push(Array { name, of_cells, components, values });
            }
            "FIELD" => {
                r.text();
                let n = r.count("the number of arrays")?;
                for _ in 0..n {
                    let name = r.text().unwrap_or_default();
                    let (components, tuples) = (r.count("the number of components")?, r.count("the number of tuples")?);
                    let of = r.text().unwrap_or_default();
                    let values = r.numbers(components.saturating_mul(tuples), &of)?;
                    arrays.push(Array { name, of_cells, components, values });
                }
            }
            "LOOKUP_TABLE" => {
                r.text();
                let n = r.count("the size of the table")?;
                r.numbers(4 * n, "unsigned_char")?;
            }
            "METADATA" => while r.line().is_some_and(|l| !l.is_empty()) {},
            _ => {}
        }
    }
    let (shape, points, cells) = match kind.as_str() {
        "STRUCTURED_POINTS" => {
            let points = nodes.iter().try_fold(1usize, |n, m| n.checked_mul(*m)).unwrap_or(usize::MAX);
            let cells = nodes.iter().map(|n| n.saturating_sub(1).max(1)).fold(1usize, usize::saturating_mul);
            (Shape::Image { origin, step, nodes }, points, cells)
        }
        "UNSTRUCTURED_GRID" => {
            if offsets.len() + 1 == types.len() {
                offsets.push(connectivity.len() as f64);
            }
            if offsets.len() != types.len() {
                return Err(fault(format!("{} cells and {} cell types", offsets.len(), types.len())));
            }
            (Shape::Mesh(Elements::of_numbers(&place, &connectivity, &offsets, &types)?), place.len() / 3, types.len())
        }
        _ => return Err(fault("the file names no data set")),
    };
    check(&arrays, points, cells)?;
    Ok(Data { shape, arrays })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn text_and_bytes_give_the_same() {
        let head = |form: &str| {
            format!("# vtk DataFile Version 3.0\na tet\n{form}\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n")
        };
        let place = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0f32];
        let text = format!(
            "{}{}\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS T double 1\nLOOKUP_TABLE default\n1 2 3 4\nCELL_DATA 1\nFIELD f 1\nS 6 1 float\n1 2 3 4 5 6\n",
            head("ASCII"),
            place.map(|v| v.to_string()).join(" ")
        );
        let mut bytes = head("BINARY").into_bytes();
        bytes.extend(place.iter().flat_map(|v| v.to_be_bytes()));
        bytes.extend(b"\nCELLS 1 5\n");
        bytes.extend([4i32, 0, 1, 2, 3].iter().flat_map(|v| v.to_be_bytes()));
        bytes.extend(b"\nCELL_TYPES 1\n");
        bytes.extend(10i32.to_be_bytes());
        bytes.extend(b"\nPOINT_DATA 4\nSCALARS T double 1\nLOOKUP_TABLE default\n");
        bytes.extend([1.0, 2.0, 3.0, 4.0f64].iter().flat_map(|v| v.to_be_bytes()));
        bytes.extend(b"\nCELL_DATA 1\nFIELD f 1\nS 6 1 float\n");
        bytes.extend([1.0, 2.0, 3.0, 4.0, 5.0, 6.0f32].iter().flat_map(|v| v.to_be_bytes()));
        let (a, b) = (read(text.as_bytes()).unwrap(), read(&bytes).unwrap());
        assert_eq!(a, b);
        assert_eq!((a.arrays[0].values.as_slice(), a.arrays[1].components), (&[1.0, 2.0, 3.0, 4.0][..], 6));
        for n in 0..bytes.len() {
            // Whole up to an array: the ones before are all there.
            if let Ok(d) = read(&bytes[..n]) {
                assert!(d.arrays.len() < 2);
            }
        }
    }
}
