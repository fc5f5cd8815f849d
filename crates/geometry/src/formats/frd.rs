//! Results of CalculiX (FRD): nodes, elements and what was computed at nodes, in the format's text forms.
//!
//! Source: K. Wittig, CalculiX GraphiX manual, "Result Format (.frd)". Columns are fixed; neighbouring numbers may touch.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use super::elements::Elements;
use super::text::{NumberedLines, shown};
use super::vtk::{Data, DataArray, DataSet, fault};
use crate::fault::{Fault, counted};

/// Most components of a result.
const COMPONENTS: usize = 64;

/// Reads the mesh of a file and, of its results, the numbers of the array `name`: "STRESS" is that of the last step, "STRESS@2"
/// that of the second. All arrays are listed, the others without numbers.
///
/// Elements are taken by their corners; shells and beams are left out.
///
/// **Errors**: binary files; lines that are not as the format says (with their numbers); a result that is missing at a node of an
/// element.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Data, Fault> {
    let mut file = FrdFile { name, ..FrdFile::default() };
    let mut lines = NumberedLines::new(bytes);
    while let Some((number, line)) = lines.next() {
        let at = |f: Fault| fault(format!("line {number}: {}", f.message));
        match field(line, 0, 6) {
            b"2C" => file.nodes(&mut lines, wide(line).map_err(at)?)?,
            b"3C" => file.elements(&mut lines, wide(line).map_err(at)?)?,
            b"100C" => {
                let step = whole(field(line, 58, 5)).unwrap_or(0);
                file.result(&mut lines, wide(line).map_err(at)?, step)?;
            }
            b"9999" => return file.finish(),
            _ => {}
        }
    }
    Err(fault(if file.elements.points.is_empty() {
        "no nodes: is this a result of CalculiX?"
    } else {
        "the file ends before its last line, 9999; was it cut off?"
    }))
}

/// Whether numbers of nodes have ten columns rather than five.
fn wide(line: &[u8]) -> Result<bool, Fault> {
    match field(line, 73, 2) {
        b"0" => Ok(false),
        b"1" => Ok(true),
        b"2" | b"3" => Err(fault("the file is binary; have CalculiX write text (*NODE FILE, *EL FILE)")),
        other => Err(fault(format!("a block of form 0 to 3 was expected, found {}", shown(other)))),
    }
}

/// Columns of a line, without blanks at their ends.
fn field(line: &[u8], from: usize, width: usize) -> &[u8] {
    line.get(from..(from + width).min(line.len())).unwrap_or_default().trim_ascii()
}

fn whole(text: &[u8]) -> Option<u32> {
    core::str::from_utf8(text).ok()?.parse().ok()
}

/// A number of a line: columns `from` to `from + 12`.
fn number(line: &[u8], from: usize, at: usize) -> Result<f64, Fault> {
    let text = field(line, from, 12);
    let read = core::str::from_utf8(text).ok().and_then(|t| t.parse().ok());
    read.ok_or_else(|| {
        fault(format!("line {at}: a number was expected from column {}, found {}", from + 1, shown(text)))
    })
}

#[derive(Default)]
struct FrdFile<'a> {
    /// The array that is wanted.
    name: &'a str,
    elements: Elements,
    /// Index of each node by its number.
    index: FxHashMap<u32, u32>,
    /// The arrays of all steps, without numbers.
    arrays: Vec<(u32, DataArray)>,
    /// The array that is wanted, of the last step that has it.
    found: Option<DataArray>,
}

impl FrdFile<'_> {
    fn nodes(&mut self, lines: &mut NumberedLines, wide: bool) -> Result<(), Fault> {
        let digits = if wide { 10 } else { 5 };
        for (at, line) in lines.take_while(|(_, l)| field(l, 0, 3) != b"-3") {
            let node = self.named(line, digits, at)?;
            let mut point = [0.0; 3];
            for (a, c) in point.iter_mut().enumerate() {
                *c = number(line, 3 + digits + 12 * a, at)?;
            }
            self.index.insert(node, self.elements.points.len() as u32);
            self.elements.points.push(point);
        }
        Ok(())
    }

    fn elements(&mut self, lines: &mut NumberedLines, wide: bool) -> Result<(), Fault> {
        let digits = if wide { 10 } else { 5 };
        let (mut corners, mut left) = (&[][..], 0);
        for (at, line) in lines.take_while(|(_, l)| field(l, 0, 3) != b"-3") {
            if field(line, 0, 3) == b"-1" {
                let kind = field(line, 3 + digits, 5);
                // A wedge of VTK begins with the triangle whose normal points out of it.
                let (number, order): (u8, &[usize]) = match kind {
                    b"1" | b"4" => (12, &[0, 1, 2, 3, 4, 5, 6, 7]),
                    b"2" | b"5" => (13, &[0, 2, 1, 3, 5, 4]),
                    b"3" | b"6" => (10, &[0, 1, 2, 3]),
                    b"7" | b"8" | b"9" | b"10" | b"11" | b"12" => (0, &[]),
                    _ => {
                        return Err(fault(format!("line {at}: an element of kind {}; there are 1 to 12", shown(kind))));
                    }
                };
                (corners, left) = (order, order.len());
                if left > 0 {
                    self.elements.kinds.push(number);
                }
                continue;
            }
            // The corners stand first, in one line.
            if left > 0 {
                for k in corners {
                    let text = field(line, 3 + digits * k, digits);
                    let node = whole(text).and_then(|n| self.index.get(&n));
                    let node = node.ok_or_else(|| fault(format!("line {at}: {} is no node", shown(text))))?;
                    self.elements.connectivity.push(*node);
                }
                self.elements.ends.push(self.elements.connectivity.len());
                left = 0;
            }
        }
        Ok(())
    }

    /// The number of the node that a line begins with.
    fn named(&self, line: &[u8], digits: usize, at: usize) -> Result<u32, Fault> {
        let text = field(line, 3, digits);
        whole(text).ok_or_else(|| fault(format!("line {at}: the number of a node was expected, found {}", shown(text))))
    }

    fn result(&mut self, lines: &mut NumberedLines, wide: bool, step: u32) -> Result<(), Fault> {
        let digits = if wide { 10 } else { 5 };
        let mut array = DataArray { name: String::new(), of_cells: false, components: 0, values: Vec::new() };
        let (mut node, mut component) = (None, 0);
        for (at, line) in lines.take_while(|(_, l)| field(l, 0, 3) != b"-3") {
            match field(line, 0, 3) {
                b"-4" => array.name = String::from_utf8_lossy(field(line, 5, 8)).into_owned(),
                // What is computed from others, such as the length of a vector, does not stand in the file.
                b"-5" => {
                    array.components += usize::from(field(line, 33, 5) != b"1");
                    if array.components > COMPONENTS || !array.values.is_empty() {
                        let message = format!(
                            "line {at}: a result has at most {COMPONENTS} components, listed before its values"
                        );
                        return Err(fault(message));
                    }
                }
                head => {
                    if !self.wants(&array.name, step) {
                        continue;
                    }
                    if head == b"-1" {
                        let number = self.named(line, digits, at)?;
                        let found = self.index.get(&number).copied();
                        let found = found.ok_or_else(|| fault(format!("line {at}: {number} is no node")))?;
                        (node, component) = (Some(found as usize), 0);
                    }
                    let node =
                        node.ok_or_else(|| fault(format!("line {at}: values come before the number of their node")))?;
                    array.values.resize(array.components * self.elements.points.len(), f64::NAN);
                    for k in 0..6.min(array.components - component) {
                        array.values[array.components * node + component] = number(line, 3 + digits + 12 * k, at)?;
                        component += 1;
                    }
                }
            }
        }
        self.arrays.push((step, DataArray { values: Vec::new(), ..array.clone() }));
        if self.wants(&array.name, step) {
            self.found = Some(array);
        }
        Ok(())
    }

    /// Whether an array is the one asked for, of one step or of any.
    fn wants(&self, name: &str, step: u32) -> bool {
        let (wanted, of) = self.name.rsplit_once('@').unwrap_or((self.name, ""));
        wanted == name && (of.is_empty() || of.parse() == Ok(step))
    }

    /// Refuses an array that has no numbers at a node of an element; other nodes get zero.
    fn complete(&self, array: &mut DataArray) -> Result<(), Fault> {
        // Another length comes of a block without a line of numbers, and of nodes that follow a result.
        if array.values.len() != array.components * self.elements.points.len() {
            let nodes = counted(self.elements.points.len(), "node");
            return Err(fault(format!(
                "{} has {} in {} for {nodes}; the file is cut or its blocks are out of order",
                array.name,
                counted(array.values.len(), "number"),
                counted(array.components, "component")
            )));
        }
        let mut used = vec![false; self.elements.points.len()];
        self.elements.connectivity.iter().for_each(|n| used[*n as usize] = true);
        let mut missing = 0;
        for (tuple, used) in array.values.chunks_exact_mut(array.components.max(1)).zip(used) {
            if tuple.iter().any(|v| v.is_nan()) {
                missing += usize::from(used);
                tuple.fill(0.0);
            }
        }
        match missing {
            0 => Ok(()),
            n => Err(fault(format!("{} has no numbers at {} of elements", array.name, counted(n, "node")))),
        }
    }

    fn finish(mut self) -> Result<Data, Fault> {
        let steps = self.arrays.iter().map(|a| a.0).collect::<BTreeSet<u32>>();
        let mut arrays: Vec<DataArray> = Vec::new();
        for (step, array) in core::mem::take(&mut self.arrays) {
            if steps.len() > 1 {
                arrays.push(DataArray { name: format!("{}@{step}", array.name), ..array.clone() });
            }
            // The last step has the plain name.
            arrays.retain(|a| a.name != array.name);
            arrays.push(array);
        }
        if let Some(mut found) = self.found.take() {
            self.complete(&mut found)?;
            arrays.retain(|a| a.name != self.name);
            arrays.push(DataArray { name: self.name.to_string(), ..found });
        }
        self.elements.check()?;
        Ok(Data { shape: DataSet::Mesh(self.elements), arrays })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cubes and a wedge, and two steps of a vector and a tensor at their nodes, as CalculiX 2.20 writes them.
    fn file(wide: bool) -> String {
        let (w, form) = if wide { (10, "1") } else { (5, "0") };
        let mut nodes = Vec::new();
        for z in 0..2 {
            for y in 0..2 {
                (0..3).for_each(|x| nodes.push([f64::from(x), f64::from(y), f64::from(z)]));
            }
        }
        nodes.push([3.0, 0.0, 0.0]);
        nodes.push([3.0, 0.0, 1.0]);
        // Numbers of nodes need not follow each other.
        let name = |n: usize| 7 * n + 3;
        let mut text = format!("    1C\n    1UPGM               CalculiX\n    2C{:>30}{:>38}\n", nodes.len(), form);
        for (n, p) in nodes.iter().enumerate() {
            text += &format!(" -1{:>w$}{}\n", name(n), columns(p));
        }
        text += &format!(" -3\n    3C{:>30}{:>38}\n", 3, form);
        let hex = |x: usize| [x, x + 1, x + 4, x + 3, x + 6, x + 7, x + 10, x + 9];
        for (e, (kind, of)) in
            [(1, hex(0).to_vec()), (1, hex(1).to_vec()), (2, vec![2, 12, 5, 8, 13, 11])].iter().enumerate()
        {
            let line: String = of.iter().map(|n| format!("{:>w$}", name(*n))).collect();
            text += &format!(" -1{:>w$}{kind:>5}    0    1\n -2{line}\n", e + 1);
        }
        text += " -3\n";
        for step in 1..=2 {
            let head = format!(
                "    1PSTEP\n  100CL{:>5}{:>12}{:>12}{:>22}{step:>5}{:>12}\n",
                100 + step,
                "1.000000000",
                nodes.len(),
                0,
                form
            );
            for (array, parts) in [("DISP", "D1 D2 D3 ALL"), ("STRESS", "SXX SYY SZZ SXY SYZ SZX")] {
                text += &head;
                text += &format!(" -4  {array:<8}{:>5}    1\n", parts.split(' ').count());
                for (i, part) in parts.split(' ').enumerate() {
                    let there = if part == "ALL" { "    1ALL" } else { "" };
                    text += &format!(" -5  {part:<8}    1    4{:>5}    1{there}\n", i + 1);
                }
                for (n, p) in nodes.iter().enumerate() {
                    let of: Vec<f64> = if array == "DISP" { p.to_vec() } else { stress(p, step).to_vec() };
                    text += &format!(" -1{:>w$}{}\n", name(n), columns(&of));
                }
                text += " -3\n";
            }
        }
        text + " 9999\n"
    }

    /// Negative numbers touch their neighbours.
    fn stress(p: &[f64; 3], step: u32) -> [f64; 6] {
        let [x, y, z] = p.map(|c| c * f64::from(step));
        [-x, -y, -z, x - 1.0, y, -2.0 * z]
    }

    /// Numbers of twelve columns, as C writes %12.5E.
    fn columns(of: &[f64]) -> String {
        let one = |v: &f64| {
            let text = format!("{v:.5E}");
            let (mantissa, exponent) = text.split_once('E').expect("an exponent");
            format!("{:>12}", format!("{mantissa}E{:+03}", exponent.parse::<i32>().expect("a whole number")))
        };
        of.iter().map(one).collect()
    }

    #[test]
    fn results_are_those_of_the_step() {
        for wide in [false, true] {
            let text = file(wide);
            for (name, step) in [("STRESS", 2), ("STRESS@1", 1), ("STRESS@2", 2)] {
                let data = read(text.as_bytes(), name).expect("file");
                let DataSet::Mesh(elements) = &data.shape else { panic!("a mesh") };
                assert_eq!((elements.points.len(), &elements.kinds[..]), (14, &[12, 12, 13][..]));
                let array = data.arrays.iter().find(|a| a.name == name).expect(name);
                assert_eq!(array.components, 6);
                for (p, t) in elements.points.iter().zip(array.values.chunks(6)) {
                    assert_eq!(t, stress(p, step), "{name} at {p:?}");
                }
                let mut names: Vec<_> = data.arrays.iter().map(|a| (a.name.as_str(), a.components)).collect();
                names.sort_unstable();
                let all = [("DISP", 3), ("DISP@1", 3), ("DISP@2", 3), ("STRESS", 6), ("STRESS@1", 6), ("STRESS@2", 6)];
                assert_eq!(names, all);
                // The two cubes of side one and the half of one.
                let (mesh, _) = elements.tet_mesh(true).expect("solid");
                let volume: f64 =
                    mesh.tets.iter().map(|t| crate::tetmesh::volume(t.map(|i| mesh.nodes[i as usize]))).sum();
                assert!((volume - 2.5).abs() < 1e-12, "{volume}");
            }
        }
    }

    #[test]
    fn what_is_damaged_is_refused_with_its_line() {
        let text = file(true);
        let refused = |text: &str| read(text.as_bytes(), "STRESS").expect_err("refused").message;
        assert!(refused("solid\n").contains("no nodes"));
        let first = text.find("    1PSTEP").expect("a step");
        let (mesh, steps) = text.split_at(first);
        assert!(
            refused(&(mesh.to_string() + &steps.replace(" -1", " -2"))).contains("before the number of their node")
        );
        assert!(
            refused(&text.replace(
                "    2C                            14                                     1",
                "    2C                            14                                     2"
            ))
            .contains("line 3: the file is binary")
        );
        assert!(refused(&text.replacen("E+00", "E+0x", 1)).starts_with("line 4: a number was expected from column 14"));
        assert!(
            refused(&text.replacen(" -1         1    1", " -1         1   77", 1))
                .contains("an element of kind \"77\"")
        );
        let cut =
            text.lines().filter(|l| !l.starts_with(" -1         3") || l.len() < 60).collect::<Vec<_>>().join("\n");
        assert!(refused(&cut).contains("STRESS has no numbers at 1 node of elements"), "{}", refused(&cut));
        let (before, after) = text.split_once(" -4  STRESS").expect("a result");
        let empty: String = after.lines().filter(|l| !l.starts_with(" -1")).map(|l| format!("{l}\n")).collect();
        let refusal = refused(&format!("{before} -4  STRESS{empty}"));
        assert!(refusal.contains("has 0 numbers in 6 components for 14 nodes"), "{refusal}");
        let late = format!("    2C{:>30}{:>38}\n -1{:>10}{}\n -3\n 9999\n", 1, 1, 9999, columns(&[0.0; 3]));
        let refusal = refused(&text.replace(" 9999\n", &late));
        assert!(refusal.contains("has 84 numbers in 6 components for 15 nodes"), "{refusal}");
        for n in (0..text.len() - 5).step_by(37) {
            assert!(read(&text.as_bytes()[..n], "STRESS").is_err(), "{n} of {}", text.len());
        }
    }
}
