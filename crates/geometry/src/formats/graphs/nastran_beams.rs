//! Beams in Nastran bulk data: CBAR with rods as sections.
//!
//! Source: MSC Nastran Quick Reference Guide: GRID, CBAR, CBEAM, CROD, PBAR, PBARL, PROD; formats of fields.

use std::f64::consts::PI;
use std::io::{self, Write};

use rustc_hash::FxHashMap;

use super::{BeamGraph, Ids, positive};
use crate::fault::{Fault, counted};
use crate::formats::nastran_fields::{check_numbers, grid, real, value};
use crate::formats::text::{NumberedLines, at_line, parse, shown};
use crate::math::{sub, unit};

/// Beams by their mean radius, in the order in which these first occur; NaN for those without.
pub(super) fn by_radius(graph: &BeamGraph) -> Vec<(f64, Vec<usize>)> {
    let mut sets: Vec<(f64, Vec<usize>)> = Vec::new();
    let mut known: FxHashMap<u64, usize> = FxHashMap::default();
    for b in 0..graph.beams.len() {
        let [r, s] = graph.radii_of(b);
        let radius = if r == s { r } else { 0.5 * (r + s) };
        let set = *known.entry(radius.to_bits()).or_insert_with(|| {
            sets.push((radius, Vec::new()));
            sets.len() - 1
        });
        sets[set].1.push(b);
    }
    sets
}

/// Writes bars and a section for each radius; a beam has the mean of the radii at its ends. The material is left to the reader.
pub fn write(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    check_numbers([graph.nodes.len(), graph.beams.len()])?;
    out.write_all(b"$ Lengths in mm. Give the material MAT1 1.\nBEGIN BULK\n")?;
    for (i, p) in graph.nodes.iter().enumerate() {
        out.write_all(grid(i + 1, *p).as_bytes())?;
    }
    let sets = by_radius(graph);
    for (n, (radius, _)) in sets.iter().enumerate() {
        if radius.is_nan() {
            writeln!(out, "{:<8}{:>8}{:>8}", "PBARL", n + 1, 1)?;
        } else {
            let id = n + 1;
            writeln!(
                out,
                "{:<8}{id:>16}{:>16}{:>16}{:>16}\n{:<8}\n{:<8}{:>16}",
                "PBARL*",
                1,
                "",
                "ROD",
                "*",
                "*",
                real(*radius, 16)
            )?;
        }
    }
    for (n, (_, beams)) in sets.iter().enumerate() {
        for b in beams {
            let [p, q] = graph.beams[*b];
            let along = unit(sub(graph.nodes[q as usize], graph.nodes[p as usize]));
            // The orientation of a round section is of no account, but must not lie along the beam.
            let across = (0..3).min_by(|i, j| along[*i].abs().total_cmp(&along[*j].abs())).unwrap_or(0);
            let [x, y, z] = [0, 1, 2].map(|i| if i == across { "1." } else { "0." });
            let (set, id) = (n + 1, b + 1);
            writeln!(out, "{:<8}{id:>8}{set:>8}{:>8}{:>8}{x:>8}{y:>8}{z:>8}", "CBAR", p + 1, q + 1)?;
        }
    }
    out.write_all(b"ENDDATA\n")
}

/// A card: its line, its name in capitals, and its fields from the second on, continuations included.
struct Card {
    line: usize,
    name: String,
    fields: Vec<String>,
}

/// The cards of a file. Fields are between commas, or 8 or 16 characters wide.
fn cards(bytes: &[u8]) -> Vec<Card> {
    let mut cards: Vec<Card> = Vec::new();
    let begins = |t: &[u8]| t.trim_ascii().to_ascii_uppercase().starts_with(b"BEGIN");
    let mut waiting = NumberedLines::new(bytes).any(|(_, t)| begins(t));
    for (line, text) in NumberedLines::new(bytes) {
        if waiting {
            waiting = !begins(text);
            continue;
        }
        let text =
            String::from_utf8_lossy(text.split(|b| *b == b'$').next().unwrap_or_default()).replace('\t', "        ");
        if text.trim().is_empty() || !text.is_ascii() {
            continue;
        }
        let (head, rest): (String, Vec<String>) = if text.contains(',') {
            let mut parts = text.split(',').map(|w| w.trim().to_string());
            let head = parts.next().unwrap_or_default();
            let mut fields: Vec<String> = parts.take(8).collect();
            fields.resize(if head.ends_with('*') { 4 } else { 8 }, String::new());
            (head, fields)
        } else {
            let head = text.chars().take(8).collect::<String>();
            let (width, count) = if head.contains('*') { (16, 4) } else { (8, 8) };
            let body: Vec<char> = text.chars().skip(8).collect();
            let piece = |k: usize| body.iter().skip(k * width).take(width).collect::<String>().trim().to_string();
            (head.trim().to_string(), (0..count).map(piece).collect())
        };
        if head.eq_ignore_ascii_case("ENDDATA") {
            break;
        }
        match cards.last_mut() {
            Some(last) if head.is_empty() || head.starts_with(['+', '*']) => last.fields.extend(rest),
            _ => cards.push(Card { line, name: head.trim_end_matches('*').trim().to_ascii_uppercase(), fields: rest }),
        }
    }
    cards
}

impl Card {
    fn fault(&self, message: impl core::fmt::Display) -> Fault {
        at_line(self.line, format!("{}: {message}", self.name))
    }

    fn word(&self, k: usize) -> &str {
        self.fields.get(k).map_or("", String::as_str)
    }

    fn id(&self, k: usize) -> Result<i64, Fault> {
        let word = self.word(k);
        parse::<i64>(word.as_bytes())
            .ok_or_else(|| self.fault(format!("{} is not an id (field {})", shown(word.as_bytes()), k + 2)))
    }

    /// A real number, whose exponent may have no letter (1.5-3); 0 where the field is empty.
    fn real(&self, k: usize) -> Result<f64, Fault> {
        let word = self.word(k);
        if word.is_empty() {
            return Ok(0.0);
        }
        value(word)
            .ok_or_else(|| self.fault(format!("{} is not a finite number (field {})", shown(word.as_bytes()), k + 2)))
    }
}

/// Reads grid points and bars, beams and rods; radii are those of rods and tubes, or of circles of the section's area.
pub fn read(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut graph, mut ids, mut sections) = (BeamGraph::default(), Ids::default(), FxHashMap::default());
    let (mut bars, mut others) = (Vec::new(), 0);
    for card in cards(bytes) {
        match card.name.as_str() {
            "GRID" => {
                if !matches!(card.word(1), "" | "0") {
                    return Err(
                        card.fault("coordinates in a system of their own are not read: give them in the basic one")
                    );
                }
                let place = [card.real(2)?, card.real(3)?, card.real(4)?];
                ids.add(card.id(0)?, graph.nodes.len()).map_err(|m| card.fault(m))?;
                graph.nodes.push(place);
            }
            "CBAR" | "CBEAM" | "CROD" => {
                let property = if card.word(1).is_empty() { card.id(0)? } else { card.id(1)? };
                bars.push((property, [card.id(2)?, card.id(3)?], card));
            }
            "PBAR" | "PBEAM" | "PROD" => {
                let area = card.real(2)?;
                if area > 0.0 {
                    sections.insert(card.id(0)?, (area / PI).sqrt());
                    graph
                        .remarks
                        .push(format!("{} has an area: its beams have the radius of a circle of that area", card.name));
                }
            }
            "PBARL" | "PBEAML" => match card.word(3).to_ascii_uppercase().as_str() {
                "ROD" | "TUBE" | "TUBE2" => {
                    let radius = positive(card.real(8)?, "the radius of the section").map_err(|m| card.fault(m))?;
                    sections.insert(card.id(0)?, radius);
                    if !card.word(3).eq_ignore_ascii_case("ROD") {
                        graph.remarks.push("tubes are read as solid beams of their outer radius".into());
                    }
                }
                "" => {}
                other => {
                    graph
                        .remarks
                        .push(format!("sections {} have no radius: give one (radius)", shown(other.as_bytes())));
                }
            },
            name if name.starts_with('C') && !name.starts_with("CORD") && name != "CEND" => others += 1,
            _ => {}
        }
    }
    for (property, nodes, card) in bars {
        let node = |id: i64| ids.get(id).map_err(|m| card.fault(m));
        let ends = [node(nodes[0])?, node(nodes[1])?];
        let radius = sections.get(&property).copied().unwrap_or(f64::NAN);
        graph.join(ends, [radius; 2], |m| card.fault(m))?;
    }
    if others > 0 {
        graph.remarks.push(format!("{} left out: only beams are read", counted(others, "other card")));
    }
    graph.remarks.sort();
    graph.remarks.dedup();
    Ok(graph)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_wide_and_free_fields() {
        let wide = format!("{:<8}{:>16}{:>16}{:>16}{:>16}\n{:<8}{:>16}\n", "GRID*", 2, "", "1.+1", "0.", "*", "1.5-1");
        let text = "SOL 101\nCEND\nBEGIN BULK\nGRID           1              0.      0.     0.0\nWIDEGRID,3,,1.,1.,1.\nCBAR,1,7,1,2,0.,0.,1.\nCROD           2       8       2       3\n\
                    PBARL          7       1             ROD\n+            0.5\nPROD,8,1,3.141592653589793\nCQUAD4,9,1,1,2,3,1\nENDDATA\njunk";
        let made = read(text.replace("WIDE", &wide).as_bytes()).unwrap();
        assert_eq!(made.nodes, [[0.0; 3], [10.0, 0.0, 0.15], [1.0; 3]]);
        assert_eq!((&made.beams, &made.beam_radii), (&vec![[0, 1], [1, 2]], &vec![[0.5; 2], [1.0; 2]]));
        assert_eq!(made.remarks.len(), 2, "{:?}", made.remarks);
        for (text, expected) in [
            ("GRID,1,,a,0.,0.\n", "line 1: GRID: \"a\" is not a finite number (field 4)"),
            ("GRID,1,5,0.,0.,0.\n", "line 1: GRID: coordinates in a system"),
            ("GRID,1,,0.,0.,0.\nCBAR,1,1,1,2\n", "line 2: CBAR: there is no node with id 2"),
            ("GRID,1,,0.,0.,0.\nGRID,1,,0.,0.,0.\n", "line 2: GRID: there are two nodes with id 1"),
            ("CBAR,1,1,x,2\n", "line 1: CBAR: \"x\" is not an id (field 4)"),
        ] {
            let fault = read(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }
}
