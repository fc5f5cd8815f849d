//! Graphs as JSON: lists of nodes and beams; lists of end points as pyLattice has them.

use std::io::{self, Write};

use rustc_hash::FxHashMap;
use serde_json::Value;

use super::{BeamGraph, positive, unit};
use crate::fault::Fault;

/// Writes `{"units": "mm", "nodes": [[x, y, z, r], …], "beams": [[a, b, r1, r2], …]}`; radii that are not known are left out.
pub fn write(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(b"{\"units\": \"mm\",\n\"nodes\": [")?;
    for (i, [x, y, z]) in graph.nodes.iter().enumerate() {
        let gap = if i == 0 { "" } else { "," };
        write!(out, "{gap}\n[{x}, {y}, {z}")?;
        match graph.radii.get(i) {
            Some(r) if !r.is_nan() => write!(out, ", {r}]")?,
            _ => out.write_all(b"]")?,
        }
    }
    out.write_all(b"],\n\"beams\": [")?;
    for (i, [a, b]) in graph.beams.iter().enumerate() {
        let gap = if i == 0 { "" } else { "," };
        write!(out, "{gap}\n[{a}, {b}")?;
        match graph.radii_of(i) {
            [r, _] if r.is_nan() => out.write_all(b"]")?,
            [r, s] => write!(out, ", {r}, {s}]")?,
        }
    }
    out.write_all(b"]}\n")
}

/// Reads nodes (rows of x, y, z and perhaps a radius) and beams (rows of two numbers of nodes from 0 and perhaps one or two radii).
pub fn read(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let text: Value = serde_json::from_slice(bytes)
        .map_err(|e| Fault::new("", format!("line {}: {}", e.line(), no_place(&e.to_string()))))?;
    let wrong = |message: String| Fault::new("", message);
    if text.get("nodesX").is_some() {
        return of_end_points(&text).map_err(wrong);
    }
    let list = |names: &[&str]| {
        let found = names.iter().find_map(|n| text.get(n).and_then(Value::as_array).map(|v| (n.to_string(), v)));
        found.ok_or_else(|| wrong(format!("\"{}\" is missing, a list", names[0])))
    };
    let (of_nodes, nodes) = list(&["nodes", "vertices", "points"])?;
    let (of_beams, beams) = list(&["beams", "struts", "edges", "lines"])?;
    let mut graph = BeamGraph::default();
    for (i, row) in nodes.iter().enumerate() {
        let at = |m: String| wrong(format!("{of_nodes}[{i}]: {m}"));
        let row = numbers(row).filter(|r| matches!(r.len(), 3 | 4));
        let row = row.ok_or_else(|| at("expected [x, y, z] and perhaps a radius".into()))?;
        graph.nodes.push([row[0], row[1], row[2]]);
        graph.radii.push(row.get(3).map_or(Ok(f64::NAN), |r| positive(*r, "the radius")).map_err(at)?);
    }
    for (i, row) in beams.iter().enumerate() {
        let at = |m: String| wrong(format!("{of_beams}[{i}]: {m}"));
        let row = numbers(row).filter(|r| (2..=4).contains(&r.len()));
        let row = row.ok_or_else(|| at("expected two numbers of nodes and perhaps one or two radii".into()))?;
        let node = |v: f64| match v >= 0.0 && v.fract() == 0.0 && v < graph.nodes.len() as f64 {
            true => Ok(v as u32),
            false => Err(at(format!("there is no node {v}: there are {}, numbered from 0", graph.nodes.len()))),
        };
        let ends = [node(row[0])?, node(row[1])?];
        let radius = |k: usize| row.get(k).map_or(Ok(f64::NAN), |r| positive(*r, "the radius")).map_err(at);
        let first = radius(2)?;
        let second = if row.len() == 4 { radius(3)? } else { first };
        graph.join(ends, [first, second], at)?;
    }
    if let Some(name) = text.get("units") {
        let name = name.as_str().ok_or_else(|| wrong("units must be the name of a unit, such as mm".into()))?;
        graph.scale(unit(name).map_err(wrong)?);
        graph.in_mm = true;
    }
    Ok(graph)
}

/// The message without the place that is said before it.
fn no_place(message: &str) -> &str {
    message.split(" at line").next().unwrap_or(message)
}

/// The finite numbers of a list, or of the coordinates of a table.
fn numbers(row: &Value) -> Option<Vec<f64>> {
    if let Value::Object(of) = row {
        let keys = if of.contains_key("x") { ["x", "y", "z"].as_slice() } else { &["a", "b"] };
        let mut found: Vec<f64> = keys.iter().map(|k| of.get(*k)?.as_f64()).collect::<Option<_>>()?;
        if let Some(r) = of.get("r").or(of.get("radius")) {
            found.push(r.as_f64()?);
        }
        return Some(found);
    }
    row.as_array()?.iter().map(Value::as_f64).collect()
}

/// Both ends of each beam, one after the other, in lists of coordinates.
fn of_end_points(text: &Value) -> Result<BeamGraph, String> {
    let list = |name: &str| text.get(name).and_then(numbers).ok_or(format!("\"{name}\" is missing, a list of numbers"));
    let [x, y, z] = [list("nodesX")?, list("nodesY")?, list("nodesZ")?];
    let radii = if text.get("radii").is_some() { list("radii")? } else { Vec::new() };
    let beams = x.len() / 2;
    if x.len() % 2 == 1 || y.len() != x.len() || z.len() != x.len() || !(radii.is_empty() || radii.len() == beams) {
        let found = format!("{}, {}, {} and {}", x.len(), y.len(), z.len(), radii.len());
        return Err(format!("nodesX, nodesY, nodesZ have two numbers for each beam and radii one; found {found}"));
    }
    let (mut graph, mut seen) = (BeamGraph::default(), FxHashMap::default());
    for i in 0..beams {
        let at = |m: String| Fault::new("", format!("beam {i}: {m}"));
        let ends = [2 * i, 2 * i + 1].map(|k| graph.node_at(&mut seen, [x[k], y[k], z[k]]));
        let radius = radii.get(i).map_or(Ok(f64::NAN), |r| positive(*r, "the radius"));
        let radius = radius.map_err(|m| at(m).message)?;
        graph.join(ends, [radius; 2], at).map_err(|f| f.message)?;
    }
    Ok(graph)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_tables_and_end_points() {
        let made = read(
            br#"{"vertices": [{"x": 0, "y": 0, "z": 0, "r": 2}, [1, 0, 0]], "edges": [[0, 1, 0.5]], "units": "cm"}"#,
        );
        let made = made.unwrap();
        assert!(made.nodes[1] == [10.0, 0.0, 0.0] && made.radii[0] == 20.0 && made.beam_radii == [[5.0; 2]]);
        let made =
            read(br#"{"nodesX": [0, 1, 1, 2], "nodesY": [0, 0, 0, 0], "nodesZ": [0, 0, 0, 0], "radii": [0.1, 0.2]}"#);
        assert_eq!(made.unwrap().beams, [[0, 1], [1, 2]]);
        for (text, expected) in [
            ("{\n\"nodes\": [\n", "line 3: EOF"),
            ("[1]", "\"nodes\" is missing"),
            (r#"{"nodes": [[0, 0, 0], [1, 0]], "beams": []}"#, "nodes[1]: expected [x, y, z]"),
            (r#"{"nodes": [[0, 0, 0], [1, 0, 0]], "beams": [[0, 2]]}"#, "beams[0]: there is no node 2"),
            (r#"{"nodes": [[0, 0, 0], [1, 0, 0]], "beams": [[0, 1, 0]]}"#, "beams[0]: the radius is 0"),
            (r#"{"nodes": [[0, 0, 0], [1, 0, 0]], "beams": [[1, 1]]}"#, "beams[0]: both ends"),
        ] {
            let fault = read(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }
}
