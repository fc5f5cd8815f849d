//! The legacy format (versions 1 to 5.1): a header of text, then sections of text or big-endian numbers.

use super::{Data, DataArray, DataSet, Elements, Scalar, check, fault};
use crate::fault::Fault;
use crate::formats::text::{parse, shown};
use crate::math::Vec3;

/// The words, lines and numbers of a file, one after the other.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
}

impl<'a> Reader<'a> {
    /// The rest of the current line, without blanks at its ends.
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

    /// The next word as text; empty at the end of the file.
    fn text(&mut self) -> String {
        String::from_utf8_lossy(self.word().unwrap_or_default()).into_owned()
    }

    /// Takes the next word if it is `what`.
    fn takes(&mut self, what: &str) -> bool {
        let before = self.at;
        let found = self.word().is_some_and(|w| w.eq_ignore_ascii_case(what.as_bytes()));
        if !found {
            self.at = before;
        }
        found
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

    /// A given count of numbers of one type, and the block METADATA that may follow an array of `components`.
    fn array(&mut self, tuples: usize, components: usize, kind: &str) -> Result<Vec<f64>, Fault> {
        let values = self.numbers(tuples.saturating_mul(components), kind)?;
        if self.takes("METADATA") {
            self.skip_metadata(components);
        }
        Ok(values)
    }

    /// Passes over METADATA: the names of the components, one a line and possibly empty, then keys up to an empty line.
    fn skip_metadata(&mut self, components: usize) {
        self.line();
        while let Some(line) = self.line().filter(|l| !l.is_empty()) {
            if line == "COMPONENT_NAMES" {
                let named = (0..components).all(|_| self.line().is_some());
                if !named {
                    return;
                }
            }
        }
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
        let scalar = scalar(kind)?;
        // One line end, then the bytes.
        while self.bytes.get(self.at).is_some_and(|b| *b == b' ' || *b == b'\r') {
            self.at += 1;
        }
        self.at += 1;
        let end = count.checked_mul(scalar.width()).and_then(|n| n.checked_add(self.at)).ok_or_else(cut)?;
        let out = scalar.decode(self.bytes.get(self.at..end).ok_or_else(cut)?, true);
        self.at = end;
        Ok(out)
    }
}

/// A type of the legacy format.
fn scalar(kind: &str) -> Result<Scalar, Fault> {
    Ok(match kind.to_ascii_lowercase().as_str() {
        "double" => Scalar::Float(8),
        "float" => Scalar::Float(4),
        "long" | "vtktypeint64" => Scalar::Signed(8),
        "unsigned_long" | "vtktypeuint64" => Scalar::Unsigned(8),
        // VTK writes its index type as an int, whatever its width in memory.
        "int" | "vtktypeint32" | "vtkidtype" => Scalar::Signed(4),
        "unsigned_int" | "vtktypeuint32" => Scalar::Unsigned(4),
        "short" | "vtktypeint16" => Scalar::Signed(2),
        "unsigned_short" | "vtktypeuint16" => Scalar::Unsigned(2),
        "char" | "signed_char" | "vtktypeint8" => Scalar::Signed(1),
        "unsigned_char" | "vtktypeuint8" => Scalar::Unsigned(1),
        other => return Err(fault(format!("the type {} is not a number", shown(other.as_bytes())))),
    })
}

/// Where the arrays of a section belong.
#[derive(Clone, Copy, PartialEq)]
enum ArrayAssociation {
    /// The data set as a whole: arrays before POINT_DATA and CELL_DATA, such as the time. They are not kept.
    Whole,
    Points,
    Cells,
}

/// A file as read up to some section.
struct LegacyVtkFile<'a> {
    reader: Reader<'a>,
    /// Name of the data set, in capitals.
    kind: String,
    nodes: [usize; 3],
    origin: Vec3,
    step: Vec3,
    points: Vec<f64>,
    connectivity: Vec<f64>,
    /// Where each cell ends in `connectivity`.
    ends: Vec<f64>,
    types: Vec<f64>,
    association: ArrayAssociation,
    /// Tuples of the arrays of the current section.
    tuples: usize,
    arrays: Vec<DataArray>,
}

/// Reads a file of STRUCTURED_POINTS, an UNSTRUCTURED_GRID or POLYDATA.
pub(super) fn read(bytes: &[u8]) -> Result<Data, Fault> {
    let mut file = LegacyVtkFile::open(bytes)?;
    while let Some(word) = file.reader.word() {
        file.section(&String::from_utf8_lossy(word).to_ascii_uppercase())?;
    }
    file.finish()
}

impl<'a> LegacyVtkFile<'a> {
    /// Takes in the three lines of the header.
    fn open(bytes: &'a [u8]) -> Result<LegacyVtkFile<'a>, Fault> {
        let mut reader = Reader { bytes, at: 0, binary: false };
        reader.line();
        reader.line();
        let form = reader.line().unwrap_or_default();
        reader.binary = match form.to_ascii_uppercase().as_str() {
            "ASCII" => false,
            "BINARY" => true,
            _ => {
                return Err(fault(format!("the third line should say ASCII or BINARY, found \"{form}\"")));
            }
        };
        Ok(LegacyVtkFile {
            reader,
            kind: String::new(),
            nodes: [1; 3],
            origin: [0.0; 3],
            step: [1.0; 3],
            points: Vec::new(),
            connectivity: Vec::new(),
            ends: Vec::new(),
            types: Vec::new(),
            association: ArrayAssociation::Whole,
            tuples: 0,
            arrays: Vec::new(),
        })
    }

    /// Takes in the section that begins with a key word; other words are passed over.
    fn section(&mut self, word: &str) -> Result<(), Fault> {
        let r = &mut self.reader;
        match word {
            "DATASET" => {
                self.kind = r.text().to_ascii_uppercase();
                if !["STRUCTURED_POINTS", "UNSTRUCTURED_GRID", "POLYDATA"].contains(&self.kind.as_str()) {
                    let kind = &self.kind;
                    return Err(fault(format!(
                        "a data set of {kind}; STRUCTURED_POINTS, UNSTRUCTURED_GRID and POLYDATA are read"
                    )));
                }
            }
            "DIMENSIONS" => self.nodes = r.three("DIMENSIONS")?,
            "ORIGIN" => self.origin = r.three("ORIGIN")?,
            "SPACING" | "ASPECT_RATIO" => self.step = r.three("SPACING")?,
            "POINTS" => {
                let n = r.count("the number of points")?;
                let of = r.text();
                self.points = r.array(n, 3, &of)?;
            }
            "CELLS" => self.cells()?,
            "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" if self.kind == "POLYDATA" => {
                // VTK's numbers of the kinds that may have any number of points.
                let kind = match word {
                    "VERTICES" => 2.0,
                    "LINES" => 4.0,
                    "POLYGONS" => 7.0,
                    _ => 6.0,
                };
                self.cells()?;
                self.types.resize(self.ends.len(), kind);
            }
            "CELL_TYPES" => {
                let n = r.count("the number of cell types")?;
                self.types = r.numbers(n, "int")?;
            }
            "POINT_DATA" | "CELL_DATA" => {
                self.association = if word == "CELL_DATA" { ArrayAssociation::Cells } else { ArrayAssociation::Points };
                self.tuples = r.count("the number of values")?;
            }
            "SCALARS" => self.scalars()?,
            "VECTORS" | "NORMALS" => self.attribute(3)?,
            "TENSORS" => self.attribute(9)?,
            "TENSORS6" => self.attribute(6)?,
            "FIELD" => self.field()?,
            "LOOKUP_TABLE" => {
                r.text();
                let n = r.count("the size of the table")?;
                r.numbers(n.saturating_mul(4), "unsigned_char")?;
            }
            "METADATA" => r.skip_metadata(0),
            _ => {}
        }
        Ok(())
    }

    /// CELLS: offsets and connectivity (version 5.1), or cells each preceded by its number of points.
    fn cells(&mut self) -> Result<(), Fault> {
        let r = &mut self.reader;
        let (n, size) = (r.count("the number of cells")?, r.count("the size of the cells")?);
        if r.takes("OFFSETS") {
            let of = r.text();
            let offsets = r.numbers(n, &of)?;
            // The first is zero; the last cell ends with the list.
            let before = self.connectivity.len() as f64;
            self.ends.extend(offsets.get(1..).unwrap_or_default().iter().map(|end| before + end));
            r.text();
            let of = r.text();
            self.connectivity.extend(r.numbers(size, &of)?);
            return Ok(());
        }
        let all = r.numbers(size, "int")?;
        let mut from = 0;
        for _ in 0..n {
            let m = all.get(from).copied().unwrap_or(0.0) as usize;
            let corners = all.get(from + 1..(from + 1).saturating_add(m));
            self.connectivity.extend(corners.ok_or_else(|| fault("a cell reaches beyond the list of cells"))?);
            self.ends.push(self.connectivity.len() as f64);
            from += m + 1;
        }
        Ok(())
    }

    /// SCALARS: a number of components that may be left out, and the name of a table of colours that may too.
    fn scalars(&mut self) -> Result<(), Fault> {
        let r = &mut self.reader;
        let (name, of) = (r.text(), r.text());
        let components = r.line().and_then(|l| l.parse().ok()).unwrap_or(1);
        if r.takes("LOOKUP_TABLE") {
            r.text();
        }
        let values = r.array(self.tuples, components, &of)?;
        self.keep(name, components, values);
        Ok(())
    }

    /// An array whose key word gives the number of components.
    fn attribute(&mut self, components: usize) -> Result<(), Fault> {
        let r = &mut self.reader;
        let (name, of) = (r.text(), r.text());
        let values = r.array(self.tuples, components, &of)?;
        self.keep(name, components, values);
        Ok(())
    }

    /// FIELD: a number of arrays, each with its components and tuples.
    fn field(&mut self) -> Result<(), Fault> {
        self.reader.text();
        for _ in 0..self.reader.count("the number of arrays")? {
            let r = &mut self.reader;
            let name = r.text();
            let (components, tuples) = (r.count("the number of components")?, r.count("the number of tuples")?);
            let of = r.text();
            let values = r.array(tuples, components, &of)?;
            self.keep(name, components, values);
        }
        Ok(())
    }

    /// Keeps an array of points or cells.
    fn keep(&mut self, name: String, components: usize, values: Vec<f64>) {
        if self.association != ArrayAssociation::Whole {
            self.arrays.push(DataArray {
                name,
                of_cells: self.association == ArrayAssociation::Cells,
                components,
                values,
            });
        }
    }

    /// The data set, its parts checked against each other.
    fn finish(mut self) -> Result<Data, Fault> {
        let (shape, points, cells) = match self.kind.as_str() {
            "STRUCTURED_POINTS" => {
                let (origin, step, nodes) = (self.origin, self.step, self.nodes);
                let points = nodes.iter().try_fold(1usize, |n, m| n.checked_mul(*m)).unwrap_or(usize::MAX);
                let cells = nodes.iter().map(|n| n.saturating_sub(1).max(1)).fold(1usize, usize::saturating_mul);
                (DataSet::Image { origin, step, nodes }, points, cells)
            }
            "UNSTRUCTURED_GRID" | "POLYDATA" => {
                if self.ends.len() + 1 == self.types.len() {
                    self.ends.push(self.connectivity.len() as f64);
                }
                if self.ends.len() != self.types.len() {
                    return Err(fault(format!("{} cells and {} cell types", self.ends.len(), self.types.len())));
                }
                let mesh = Elements::of_numbers(&self.points, &self.connectivity, &self.ends, &self.types)?;
                (DataSet::Mesh(mesh), self.points.len() / 3, self.types.len())
            }
            _ => return Err(fault("the file names no data set")),
        };
        check(&self.arrays, points, cells)?;
        Ok(Data { shape, arrays: self.arrays })
    }
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

    const CELLS_4_2: &str = "CELLS 1 5\n<int 4 0 1 2 3>\n\nCELL_TYPES 1\n<int 10>\n\n";
    const CELLS_5_1: &str = "CELLS 2 4\nOFFSETS vtktypeint64\n<long 0 4>\nCONNECTIVITY vtktypeint64\n<long 0 1 2 3>\n\
                             CELL_TYPES 1\n<int 10>\n\n";
    /// The layout of VTK 9 from the points on, for arrays with named components and with a range that was computed.
    const POINTS: &str = "DATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTimeValue 1 1 double\n<double 0.5>\n\
        POINTS 4 float\n<float 0 0 0 1 0 0 0 1 0 0 0 1>\n\
        METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1 \n\n";
    const ARRAYS: &str = "CELL_DATA 1\nTENSORS t double\n<double 0 1 2 3 4 5 6 7 8>\n\n\
        METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 14.2829 14.2829 \n\n\
        FIELD FieldData 1\nzone 1 1 int\n<int 7>\n\
        POINT_DATA 4\nSCALARS T double \nLOOKUP_TABLE default\n<double 5 6 7 8>\nMETADATA\nCOMPONENT_NAMES\nkelvin\n\n\
        VECTORS u float\n<float 0 0 1 1 0 1 2 0 1 3 0 1>\n\
        METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 1 3.16228 \n\n\
        FIELD FieldData 4\nS 6 4 double\n\
        <double 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23>\n\
        METADATA\nCOMPONENT_NAMES\nxx\n\nVECTORS%20zz\nxy\nyz\nxz\nINFORMATION 1\n\
        NAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 7.4162 50.606 \n\n\
        v 3 4 double\n<double 0 1 2 3 4 5 6 7 8 9 10 11>\nMETADATA\nINFORMATION 0\n\n\
        id 1 4 vtkIdType\n<int 9 8 7 6>\nmises 1 4 double\n<double 1 2 3 4>\n";

    /// A file of some version; `<type numbers>` becomes text or bytes.
    fn file(version: &str, binary: bool, layout: &str) -> Vec<u8> {
        let form = if binary { "BINARY" } else { "ASCII" };
        let mut out = format!("# vtk DataFile Version {version}\nvtk output\n{form}\n").into_bytes();
        for part in layout.split('<') {
            let (numbers, text) = part.split_once('>').unwrap_or(("", part));
            let (kind, numbers) = numbers.split_once(' ').unwrap_or_default();
            for v in numbers.split_whitespace().map(|w| w.parse::<f64>().unwrap()) {
                match (binary, kind) {
                    (false, _) => out.extend(format!("{v} ").bytes()),
                    (true, "double") => out.extend(v.to_be_bytes()),
                    (true, "float") => out.extend((v as f32).to_be_bytes()),
                    (true, "long") => out.extend((v as i64).to_be_bytes()),
                    (true, _) => out.extend((v as i32).to_be_bytes()),
                }
            }
            out.extend(text.bytes());
        }
        out
    }

    #[test]
    fn metadata_after_arrays_is_passed_over() {
        for (version, cells) in [("4.2", CELLS_4_2), ("5.1", CELLS_5_1)] {
            for binary in [false, true] {
                let bytes = file(version, binary, &[POINTS, cells, ARRAYS].concat());
                let data = read(&bytes).unwrap();
                let DataSet::Mesh(mesh) = &data.shape else { panic!("no mesh") };
                assert_eq!((mesh.points.len(), mesh.connectivity.as_slice()), (4, &[0, 1, 2, 3][..]));
                let found = data.arrays.iter().map(|a| (a.name.as_str(), a.of_cells, a.components, a.values.clone()));
                let to = |n: i32| (0..n).map(f64::from).collect::<Vec<f64>>();
                let u = vec![0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 2.0, 0.0, 1.0, 3.0, 0.0, 1.0];
                let wanted = [
                    ("t", true, 9, to(9)),
                    ("zone", true, 1, vec![7.0]),
                    ("T", false, 1, vec![5.0, 6.0, 7.0, 8.0]),
                    ("u", false, 3, u),
                    ("S", false, 6, to(24)),
                    ("v", false, 3, to(12)),
                    ("id", false, 1, vec![9.0, 8.0, 7.0, 6.0]),
                    ("mises", false, 1, vec![1.0, 2.0, 3.0, 4.0]),
                ];
                assert!(found.eq(wanted), "{version} binary {binary}: {:?}", data.arrays);
                for n in 0..bytes.len() {
                    // Whole up to an array: the ones before are all there.
                    if let Ok(cut) = read(&bytes[..n]) {
                        assert!(data.arrays.starts_with(&cut.arrays) || !binary, "{n}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_image_keeps_its_grid_and_arrays() {
        let layout = "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 2\nSPACING 1 2 3\nORIGIN 4 5 6\nPOINT_DATA 4\n\
            FIELD FieldData 2\nS 2 4 double\n<double 0 1 2 3 4 5 6 7>\n\
            METADATA\nINFORMATION 0\n\nvm 1 4 double\n<double 1 2 3 4>\n";
        for binary in [false, true] {
            let data = read(&file("5.1", binary, layout)).unwrap();
            let (origin, step, nodes) = ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0], [2, 1, 2]);
            assert_eq!(data.shape, DataSet::Image { origin, step, nodes });
            assert_eq!((data.arrays.len(), data.arrays[1].values.as_slice()), (2, &[1.0, 2.0, 3.0, 4.0][..]));
        }
    }

    #[test]
    fn names_of_more_components_than_the_file_has_lines_end_with_it() {
        let layout = "DATASET STRUCTURED_POINTS\nDIMENSIONS 0 0 0\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 0\n\
            SCALARS S double 18446744073709551615\nLOOKUP_TABLE default\nMETADATA\nCOMPONENT_NAMES\nx\n";
        let data = read(&file("5.1", false, layout)).unwrap();
        let [array] = &data.arrays[..] else { panic!("{:?}", data.arrays) };
        assert_eq!((array.name.as_str(), array.components, array.values.len()), ("S", usize::MAX, 0));
    }
}
