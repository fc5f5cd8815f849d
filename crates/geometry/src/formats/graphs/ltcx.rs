//! LTCX: the lattice graph of nTopology, XML.
//!
//! Source: nTopology, LTCX repository, Spec.md and schemas/NTLG_002.xsd (2016). The schema calls a radius `r`, the samples `rad`; it
//! asks for positive ids, and the samples begin with 0.

use std::io::{self, Write};

use quick_xml::events::{BytesStart, Event};

use super::{BeamGraph, Ids, positive, unit};
use crate::fault::{Fault, counted};
use crate::formats::text::shown;
use crate::formats::xml::{Scanner, attribute};

/// Writes nodes with radii, and beams.
pub fn write(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(
        b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<graph id=\"1\" units=\"mm\" type=\"rnd\">\n<nodegroup>\n",
    )?;
    for (i, [x, y, z]) in graph.nodes.iter().enumerate() {
        write!(out, "<node id=\"{i}\" x=\"{x}\" y=\"{y}\" z=\"{z}\"")?;
        match graph.radii.get(i) {
            Some(r) if !r.is_nan() => writeln!(out, " r=\"{r}\"/>")?,
            _ => writeln!(out, "/>")?,
        }
    }
    out.write_all(b"</nodegroup>\n<beamgroup>\n")?;
    for (i, [a, b]) in graph.beams.iter().enumerate() {
        writeln!(out, "<beam id=\"{i}\" n1=\"{a}\" n2=\"{b}\"/>")?;
    }
    out.write_all(b"</beamgroup>\n</graph>\n")
}

/// Reads nodes and beams.
pub fn read(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut buffer, mut s) = (Vec::new(), Scanner::new(bytes, "LTCX"));
    let (mut graph, mut ids, mut pairs) = (BeamGraph::default(), Ids::default(), Vec::new());
    let (mut scale, mut root, mut faces) = (None, false, 0);
    let (mut line, mut counted_to) = (1, 0);
    loop {
        let event = s.next(&mut buffer)?;
        let end = s.at().clamp(counted_to, bytes.len());
        line += bytes[counted_to..end].iter().filter(|b| **b == b'\n').count();
        counted_to = end;
        let at = |element: &str, message: String| Fault::new("", format!("line {line}: <{element}>: {message}"));
        match &event {
            Event::Start(tag) | Event::Empty(tag) => match tag.name().into_inner() {
                "graph" if !root => {
                    root = true;
                    if let Some(name) = attribute(tag, "units") {
                        scale = Some(unit(&name).map_err(|m| at("graph", m))?);
                    }
                }
                name if !root => {
                    let message = format!("the root is {}, not the graph of an LTCX", shown(name.as_bytes()));
                    return Err(Fault::new("", format!("line {line}: {message}")));
                }
                "node" => node(tag, &mut graph, &mut ids).map_err(|m| at("node", m))?,
                "beam" => {
                    let end = |name| integer(tag, name);
                    let ends = end("n1").and_then(|a| Ok([a, end("n2")?])).map_err(|m| at("beam", m))?;
                    pairs.push((line, ends));
                }
                "face" => faces += 1,
                _ => {}
            },
            Event::Eof if !root => return Err(Fault::new("", "no XML: truncated or not LTCX")),
            Event::Eof => break,
            _ => {}
        }
    }
    // Beams may stand before their nodes.
    for (line, [a, b]) in pairs {
        let fault = |message: String| Fault::new("", format!("line {line}: <beam>: {message}"));
        let ends = [ids.get(a).map_err(fault)?, ids.get(b).map_err(fault)?];
        graph.join(ends, [f64::NAN; 2], fault)?;
    }
    if faces > 0 {
        graph.remarks.push(format!("{} left out: only beams are read", counted(faces, "face")));
    }
    if let Some(scale) = scale {
        graph.scale(scale);
        graph.in_mm = true;
    }
    Ok(graph)
}

fn value<T: core::str::FromStr>(tag: &BytesStart, name: &str) -> Result<Option<T>, String> {
    let Some(text) = attribute(tag, name) else { return Ok(None) };
    let found = || format!("{name} is {}; a number is expected", shown(text.as_bytes()));
    text.parse().map(Some).map_err(|_| found())
}

fn integer(tag: &BytesStart, name: &str) -> Result<i64, String> {
    value(tag, name)?.ok_or_else(|| format!("the attribute {name} is missing"))
}

fn node(tag: &BytesStart, graph: &mut BeamGraph, ids: &mut Ids) -> Result<(), String> {
    ids.add(integer(tag, "id")?, graph.nodes.len())?;
    let mut p = [0.0; 3];
    for (v, name) in p.iter_mut().zip(["x", "y", "z"]) {
        *v = value::<f64>(tag, name)?.ok_or_else(|| format!("the attribute {name} is missing"))?;
        if !v.is_finite() {
            return Err(format!("{name} is {v}; it must be finite"));
        }
    }
    let radius = match value::<f64>(tag, "r")? {
        Some(r) => Some(positive(r, "r")?),
        None => value::<f64>(tag, "rad")?.map(|r| positive(r, "rad")).transpose()?,
    };
    graph.nodes.push(p);
    graph.radii.push(radius.unwrap_or(f64::NAN));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_names_of_a_radius_and_all_units() {
        let text = |units: &str| {
            format!(
                "<?xml version=\"1.0\"?><graph id=\"0\"{units}><nodegroup><node id=\"0\" x=\"1\" y=\"0\" z=\"0\" rad=\"0.5\"/>\
                 <node id=\"7\" x=\"0\" y=\"2\" z=\"0\" r=\"0.25\"/></nodegroup><beamgroup><beam id=\"0\" n1=\"0\" n2=\"7\"/>\
                 </beamgroup><facegroup><face id=\"0\" n1=\"0\" n2=\"7\" n3=\"0\"/></facegroup></graph>"
            )
        };
        let plain = read(text("").as_bytes()).unwrap();
        assert!(!plain.in_mm && plain.radii == [0.5, 0.25] && plain.beams == [[0, 1]]);
        assert_eq!(plain.remarks, ["1 face left out: only beams are read"]);
        let inch = read(text(" units=\"in\"").as_bytes()).unwrap();
        assert!(inch.in_mm && inch.nodes[1] == [0.0, 50.8, 0.0] && inch.radii[0] == 12.7);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line_and_element() {
        let node = "<graph id='0'>\n<node id='1' x='0' y='0' z='0'/>\n";
        for (text, expected) in [
            (
                format!("{node}<node id='1' x='0' y='0' z='0'/></graph>"),
                "line 3: <node>: there are two nodes with id 1",
            ),
            (format!("{node}<node id='2' x='0' y='0'/></graph>"), "line 3: <node>: the attribute z is missing"),
            (
                format!("{node}<node id='2' x='a' y='0' z='0'/></graph>"),
                "line 3: <node>: x is \"a\"; a number is expected",
            ),
            (format!("{node}<node id='2' x='0' y='0' z='0' r='0'/></graph>"), "line 3: <node>: r is 0; a radius"),
            (format!("{node}<beam id='0' n1='1' n2='5'/></graph>"), "line 3: <beam>: there is no node with id 5"),
            (format!("{node}<beam id='0' n1='1' n2='1'/></graph>"), "line 3: <beam>: both ends"),
            (format!("{node}<beam id='0' n1='1'/></graph>"), "line 3: <beam>: the attribute n2 is missing"),
            (format!("{node}<node"), "truncated"),
            ("<graph units='parsec'/>".into(), "line 1: <graph>: units is \"parsec\"; it must be one of mm"),
            ("<kml/>".into(), "line 1: the root is \"kml\""),
            ("text".into(), "no XML"),
        ] {
            let fault = read(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }
}
