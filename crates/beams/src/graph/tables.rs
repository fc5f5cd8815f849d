//! Graphs as text tables: node rows of id, x, y, z and optional radius; strut rows of two ids.

use std::collections::HashMap;

use super::wireframe::Wireframe;
use geometry::fault::Fault;
use geometry::formats::column;
use geometry::math::Vec3;

/// Nodes of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nodes {
    /// Positions, mm.
    pub positions: Vec<Vec3>,
    /// Radii (mm), NaN where none is given; empty if none at all.
    pub radii: Vec<f64>,
    /// Node index by id.
    pub names: HashMap<String, u32>,
}

/// Fields of each line that is neither comment nor header, with its line number.
fn rows<'a>(text: &'a str, heading: &'a dyn Fn(&[&str]) -> bool) -> impl Iterator<Item = (usize, Vec<&'a str>)> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut first = true;
    lines.filter_map(move |(n, line)| {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            return None;
        }
        // Between commas a field may be empty; between spaces it may not.
        let words: Vec<&str> = if line.contains([',', ';', '\t']) {
            line.split([',', ';', '\t']).map(|w| w.trim().trim_matches('"')).collect()
        } else {
            line.split_whitespace().collect()
        };
        (!(std::mem::take(&mut first) && heading(&words))).then_some((n + 1, words))
    })
}

/// Parses node rows: id, x, y, z (mm) and optional radius (mm), separated by commas, semicolons, tabs or spaces. One
/// header line, and text after #, is skipped.
///
/// # Errors
/// Malformed rows, numbers that are not finite, radii that are not positive, duplicate ids.
pub fn nodes(text: &str) -> Result<Nodes, Fault> {
    let mut nodes = Nodes::default();
    let heading = |words: &[&str]| words.iter().skip(1).all(|w| w.parse::<f64>().is_err());
    check_order(text, &heading)?;
    for (line, words) in rows(text, &heading) {
        let fault = |message: String| Fault::new("", format!("line {line}: {message}"));
        let numbers: Vec<Option<f64>> = words.iter().skip(1).map(|w| w.parse().ok()).collect();
        let (position, radius) = match numbers[..] {
            [Some(x), Some(y), Some(z)] => ([x, y, z], f64::NAN),
            [Some(x), Some(y), Some(z), Some(r)] => ([x, y, z], r),
            [Some(x), Some(y), Some(z), None] if words[4].is_empty() => ([x, y, z], f64::NAN),
            _ => {
                let row = words.join(", ");
                return Err(fault(format!("expected id, x, y, z and an optional radius, found \"{row}\"")));
            }
        };
        if position.iter().any(|v| !v.is_finite()) {
            return Err(fault(format!("coordinates of node {} must be finite, found {position:?}", words[0])));
        }
        let given = words.len() == 5 && !words[4].is_empty();
        if given && !(radius > 0.0 && radius.is_finite()) {
            let message = format!("radius of node {} must be positive and finite (mm), found {}", words[0], words[4]);
            return Err(fault(message));
        }
        let number = nodes.positions.len() as u32;
        if nodes.names.insert(words[0].to_string(), number).is_some() {
            return Err(fault(format!("duplicate node id {}", words[0])));
        }
        nodes.positions.push(position);
        nodes.radii.push(radius);
    }
    if nodes.positions.is_empty() {
        return Err(Fault::new("", "no node rows (id, x, y, z) found"));
    }
    if nodes.radii.iter().all(|r| r.is_nan()) {
        nodes.radii.clear();
    }
    Ok(nodes)
}

/// Refuses headings that name x, y and z in other places than the table has them.
fn check_order(text: &str, heading: &dyn Fn(&[&str]) -> bool) -> Result<(), Fault> {
    let Some((line, names)) = rows(text, &|_| false).next().filter(|(_, words)| heading(words)) else { return Ok(()) };
    let found = ["x", "y", "z"].map(|n| column(&names, n));
    if found.iter().any(Option::is_none) || found == [Some(1), Some(2), Some(3)] {
        return Ok(());
    }
    let message = format!(
        "line {line}: the columns are {}; they must be id, x, y, z and perhaps a radius, in this order",
        names.join(", ")
    );
    Err(Fault::new("", message))
}

/// Parses strut rows, the ids of two nodes each, to a wireframe.
///
/// # Errors
/// Malformed rows, unknown ids.
pub fn struts(text: &str, nodes: &Nodes) -> Result<Wireframe, Fault> {
    let mut struts = Vec::new();
    let heading = |words: &[&str]| words.iter().all(|w| !nodes.names.contains_key(*w));
    for (line, words) in rows(text, &heading) {
        let fault = |message: String| Fault::new("", format!("line {line}: {message}"));
        let [a, b] = words[..] else {
            let row = words.join(", ");
            return Err(fault(format!("expected the ids of two nodes, found \"{row}\"")));
        };
        let number = |id: &str| {
            let known = nodes.names.get(id).copied();
            known.ok_or_else(|| fault(format!("unknown node id {id}")))
        };
        struts.push([number(a)?, number(b)?]);
    }
    if struts.is_empty() {
        return Err(Fault::new("", "no strut rows (two node ids) found"));
    }
    Ok(Wireframe { nodes: nodes.positions.clone(), struts })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_with_or_without_headings_and_radii() {
        let text = "\u{feff}id, x, y, z, r\na, 0, 0, 0, 0.5\nb, 1, 0, 0,\n# a comment\n7; 0; 1e1; 0; 2\n";
        let n = nodes(text).expect("nodes");
        assert_eq!(n.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 10.0, 0.0]]);
        assert!(n.radii[0] == 0.5 && n.radii[1].is_nan() && n.radii[2] == 2.0);
        let wireframe = struts("from,to\na,b\nb\t7\n", &n).expect("struts");
        assert_eq!(wireframe.struts, [[0, 1], [1, 2]]);
        let plain = nodes("1 0 0 0\n2 0 0 1\n").expect("nodes");
        assert!(plain.radii.is_empty());
        assert_eq!(struts("1 2\n", &plain).expect("struts").struts, [[0, 1]]);
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, part) in [
            ("", "rows"),
            ("a,0,0,0\na,1,0,0", "line 2: duplicate node id a"),
            ("a,0,0,nan", "line 1: coordinates of node a"),
            ("a,0,0,0\nb,0,0", "line 2: expected id, x, y, z"),
            ("a,0,0,0,-1", "line 1: radius of node a must be positive and finite (mm), found -1"),
            ("a,0,0,0,x", "line 1: expected"),
        ] {
            let fault = nodes(text).expect_err("refused");
            assert!(fault.message.contains(part), "{fault}");
        }
        let n = nodes("a,0,0,0\nb,1,0,0").expect("nodes");
        for (text, part) in
            [("a,b\na,c", "line 2: unknown node id c"), ("a,b,c", "line 1: expected the ids of two"), ("x,y", "rows")]
        {
            let fault = struts(text, &n).expect_err("refused");
            assert!(fault.message.contains(part), "{fault}");
        }
    }
}
