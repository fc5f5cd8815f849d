//! Beams in Abaqus input files: B31 with circular sections.
//!
//! Source: Dassault Systèmes, Abaqus Keywords Reference: *NODE, *ELEMENT, *ELSET, *BEAM SECTION.

use std::collections::BTreeMap;
use std::io::{self, Write};

use rustc_hash::FxHashMap;

use super::nastran_beams::by_radius;
use super::{BeamGraph, Ids, on_line, positive};
use crate::fault::{Fault, counted};
use crate::formats::text::{NumberedLines, at_line, parse, shown};
use crate::math::{Vec3, cross, norm, sub, unit};

/// Directions of the first axis of a section, of which the one least along the beams is taken.
const FIRST_AXES: [Vec3; 4] = [[0.0, 0.0, -1.0], [0.31, 0.59, 0.75], [0.75, -0.31, 0.59], [-0.59, 0.75, 0.31]];

/// Writes a set and a section for each radius; a beam has the mean of the radii at its ends. The material is left to the reader.
pub fn write(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(b"** Lengths in mm. Give the material SOLID. Sections have radii, as Abaqus takes them; CalculiX takes diameters.\n*NODE\n")?;
    for (i, [x, y, z]) in graph.nodes.iter().enumerate() {
        writeln!(out, "{}, {x}, {y}, {z}", i + 1)?;
    }
    let sets = by_radius(graph);
    for (n, (_, beams)) in sets.iter().enumerate() {
        writeln!(out, "*ELEMENT, TYPE=B31, ELSET=R{}", n + 1)?;
        for b in beams {
            let [p, q] = graph.beams[*b].map(|n| n + 1);
            writeln!(out, "{}, {p}, {q}", b + 1)?;
        }
    }
    for (n, (radius, beams)) in sets.iter().enumerate().filter(|s| !s.1.0.is_nan()) {
        let across = |axis: &Vec3| {
            let sine = |b: &usize| {
                let [p, q] = graph.beams[*b].map(|n| graph.nodes[n as usize]);
                norm(cross(unit(sub(q, p)), *axis))
            };
            beams.iter().map(sine).fold(f64::INFINITY, f64::min)
        };
        let [x, y, z] = FIRST_AXES.into_iter().max_by(|a, b| across(a).total_cmp(&across(b))).unwrap_or(FIRST_AXES[0]);
        writeln!(out, "*BEAM SECTION, ELSET=R{}, MATERIAL=SOLID, SECTION=CIRC\n{radius}\n{x}, {y}, {z}", n + 1)?;
    }
    Ok(())
}

/// A keyword line: its words without spaces in capitals, and its parameters.
struct Keyword {
    name: String,
    parameters: FxHashMap<String, String>,
}

impl Keyword {
    fn of(text: &str) -> Keyword {
        let mut parts = text.trim_start_matches('*').split(',');
        let bare = |s: &str| s.split_whitespace().collect::<String>().to_ascii_uppercase();
        let name = bare(parts.next().unwrap_or_default());
        let parameter = |p: &str| match p.split_once('=') {
            Some((k, v)) => (bare(k), v.trim().to_ascii_uppercase()),
            None => (bare(p), String::new()),
        };
        Keyword { name, parameters: parts.map(parameter).collect() }
    }

    fn get(&self, name: &str) -> &str {
        self.parameters.get(name).map_or("", String::as_str)
    }
}

/// What is read before sets are resolved.
#[derive(Default)]
struct Reading {
    graph: BeamGraph,
    nodes: Ids,
    /// Line and nodes by id of each beam, by id of the beam.
    beams: BTreeMap<i64, (usize, [i64; 2])>,
    /// Members of each set: ids, and names of other sets.
    sets: FxHashMap<String, (Vec<i64>, Vec<String>)>,
    /// Set, radius of its section.
    sections: Vec<(String, f64)>,
    others: usize,
}

/// Reads nodes and beams (B31, B32, B33, their variants, and rods T3D2); radii are those of circular sections.
pub fn read(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut reading, mut keyword, mut row) = (Reading::default(), None, Vec::new());
    let mut rows_of_keyword = 0;
    for (line, text) in NumberedLines::new(bytes) {
        let text = String::from_utf8_lossy(text);
        let text = text.trim();
        if text.is_empty() || text.starts_with("**") {
            continue;
        }
        if text.starts_with('*') {
            keyword = Some(Keyword::of(text));
            (rows_of_keyword, row) = (0, Vec::new());
            continue;
        }
        let Some(of) = &keyword else {
            return Err(at_line(line, "data before any keyword: not an Abaqus input file"));
        };
        // A comma at the end continues the row.
        row.extend(text.trim_end_matches(',').split(',').map(|w| w.trim().to_string()));
        if text.ends_with(',') && of.name == "ELEMENT" {
            continue;
        }
        reading.take(of, std::mem::take(&mut row), rows_of_keyword).map_err(on_line(line)).and_then(|beam| {
            if let Some((id, nodes)) = beam
                && reading.beams.insert(id, (line, nodes)).is_some()
            {
                return Err(at_line(line, format!("there are two elements with id {id}")));
            }
            Ok(())
        })?;
        rows_of_keyword += 1;
    }
    reading.finish()
}

impl Reading {
    /// A row of data; a beam if it is one.
    fn take(&mut self, of: &Keyword, row: Vec<String>, number: usize) -> Result<Option<(i64, [i64; 2])>, String> {
        let id = |k: usize| {
            let word = row.get(k).ok_or_else(|| format!("{} values found; more are expected", row.len()))?;
            parse::<i64>(word.as_bytes()).ok_or_else(|| format!("{} is not an id", shown(word.as_bytes())))
        };
        let real = |k: usize| match row.get(k).map(|w| w.replace(['d', 'D'], "e")) {
            None => Ok(0.0),
            Some(w) if w.is_empty() => Ok(0.0),
            Some(w) => {
                let v = parse::<f64>(w.as_bytes()).filter(|v| v.is_finite());
                v.ok_or_else(|| format!("{} is not a finite number", shown(w.as_bytes())))
            }
        };
        match of.name.as_str() {
            "NODE" => {
                let place = [real(1)?, real(2)?, real(3)?];
                self.nodes.add(id(0)?, self.graph.nodes.len())?;
                self.graph.nodes.push(place);
            }
            "ELEMENT" => {
                let kind = of.get("TYPE");
                let far = match kind.get(..3) {
                    Some("B31" | "B33") => 2,
                    _ if kind == "T3D2" => 2,
                    Some("B32") => 3,
                    _ if kind == "T3D3" => 3,
                    _ => {
                        self.others += 1;
                        return Ok(None);
                    }
                };
                let beam = (id(0)?, [id(1)?, id(far)?]);
                if let Some(set) = of.parameters.get("ELSET") {
                    self.sets.entry(set.clone()).or_default().0.push(beam.0);
                }
                return Ok(Some(beam));
            }
            "ELSET" => {
                let set = self.sets.entry(of.get("ELSET").to_string()).or_default();
                if of.parameters.contains_key("GENERATE") {
                    let step = if row.len() > 2 { id(2)?.max(1) } else { 1 };
                    let (from, to) = (id(0)?, id(1)?);
                    if to.saturating_sub(from) / step > 10_000_000 {
                        return Err("the set has more elements than a file can hold".into());
                    }
                    set.0.extend((from..=to).step_by(step as usize));
                } else {
                    for word in row.iter().filter(|w| !w.is_empty()) {
                        match parse::<i64>(word.as_bytes()) {
                            Some(id) => set.0.push(id),
                            None => set.1.push(word.to_ascii_uppercase()),
                        }
                    }
                }
            }
            "BEAMSECTION" | "BEAMGENERALSECTION" if number == 0 => match of.get("SECTION") {
                "CIRC" | "PIPE" | "THICKPIPE" => {
                    let radius = positive(real(0)?, "the radius of the section")?;
                    self.sections.push((of.get("ELSET").to_string(), radius));
                    if of.get("SECTION") != "CIRC" {
                        self.graph.remarks.push("pipes are read as solid beams of their outer radius".into());
                    }
                }
                other => {
                    let message = format!("sections {} have no radius: give one (radius)", shown(other.as_bytes()));
                    self.graph.remarks.push(message);
                }
            },
            "SOLIDSECTION" if number == 0 && !row.is_empty() => {
                let area = real(0)?;
                if area > 0.0 {
                    self.sections.push((of.get("ELSET").to_string(), (area / std::f64::consts::PI).sqrt()));
                }
            }
            _ => {}
        }
        Ok(None)
    }

    fn finish(mut self) -> Result<BeamGraph, Fault> {
        let mut radii: FxHashMap<i64, f64> = FxHashMap::default();
        for (set, radius) in &self.sections {
            let (mut waiting, mut seen) = (vec![set.clone()], Vec::new());
            while let Some(name) = waiting.pop() {
                if seen.contains(&name) {
                    continue;
                }
                if let Some((ids, names)) = self.sets.get(&name) {
                    radii.extend(ids.iter().map(|id| (*id, *radius)));
                    waiting.extend(names.iter().cloned());
                }
                seen.push(name);
            }
        }
        for (id, (line, nodes)) in &self.beams {
            let fault = |m: String| at_line(*line, format!("element {id}: {m}"));
            let ends = [self.nodes.get(nodes[0]).map_err(fault)?, self.nodes.get(nodes[1]).map_err(fault)?];
            self.graph.join(ends, [radii.get(id).copied().unwrap_or(f64::NAN); 2], fault)?;
        }
        if self.others > 0 {
            self.graph.remarks.push(format!("{} left out: only beams are read", counted(self.others, "other element")));
        }
        self.graph.remarks.dedup();
        Ok(self.graph)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_sets_and_generated_ones() {
        let text = "*Heading\n frame\n*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n*Element, type=B31\n1, 1, 2\n*Element, type=B32, \
                    elset=B\n2, 2, 1,\n 3\n*Elset, elset=A, generate\n1, 1, 1\n*Elset, elset=ALL\nA, B\n*Beam Section, elset=ALL, \
                    material=M, section=CIRC\n0.5\n0.,0.,-1.\n*Element, type=C3D4\n9, 1, 2, 3, 1\n";
        let made = read(text.as_bytes()).unwrap();
        assert_eq!((&made.beams, &made.beam_radii), (&vec![[0, 1], [1, 2]], &vec![[0.5; 2]; 2]));
        assert_eq!(made.remarks, ["1 other element left out: only beams are read"]);
        for (text, expected) in [
            ("1, 2\n", "line 1: data before any keyword"),
            ("*NODE\n1, a\n", "line 2: \"a\" is not a finite number"),
            ("*NODE\n1, 0\n1, 0\n", "line 3: there are two nodes with id 1"),
            ("*NODE\n1, 0\n*ELEMENT, TYPE=B31\n1, 1, 2\n", "line 4: element 1: there is no node with id 2"),
            ("*NODE\n1, 0\n*ELEMENT, TYPE=B31\n1, 1\n", "line 4: 2 values found"),
            ("*BEAM SECTION, SECTION=CIRC\n0\n", "line 2: the radius of the section is 0"),
            (&format!("*ELSET, ELSET=A, GENERATE\n{}, {}\n", i64::MIN, i64::MAX), "line 2: the set has more elements"),
        ] {
            let fault = read(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }
}
