//! Graphs as tables: rows of id, x, y, z and perhaps r, and rows of two ids.

use std::collections::HashMap;

use super::wire::Wire;
use geometry::fault::Fault;
use geometry::math::Vec3;

/// Nodes of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nodes {
    /// Their places, mm.
    pub places: Vec<Vec3>,
    /// Their radii (mm), NaN where none is given; empty if none is.
    pub radii: Vec<f64>,
    /// Their numbers by their names.
    pub names: HashMap<String, u32>,
}

/// The words of each line that is no comment and no heading, with its number.
fn rows<'a>(text: &'a str, heading: &'a dyn Fn(&[&str]) -> bool) -> impl Iterator<Item = (usize, Vec<&'a str>)> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut first = true;
    lines.filter_map(move |(n, line)| {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            return None;
        }
        // Between commas nothing may stand; between spaces something does.
        let words: Vec<&str> = if line.contains([',', ';', '\t']) {
            line.split([',', ';', '\t']).map(|w| w.trim().trim_matches('"')).collect()
        } else {
            line.split_whitespace().collect()
        };
        (!(std::mem::take(&mut first) && heading(&words))).then_some((n + 1, words))
    })
}

/// Nodes: rows of id, x, y, z (mm) and perhaps a radius (mm), apart by commas, semicolons, tabs or spaces. One line of
/// words before them is passed over, and what follows a #.
///
/// # Errors
/// Rows of something else, numbers that are not finite, radii that are not positive, an id that stands twice.
pub fn nodes(text: &str) -> Result<Nodes, Fault> {
    let mut found = Nodes::default();
    let heading = |words: &[&str]| words.iter().skip(1).all(|w| w.parse::<f64>().is_err());
    for (line, words) in rows(text, &heading) {
        let fault = |message: String| Fault::new("", format!("line {line}: {message}"));
        let numbers: Vec<Option<f64>> = words.iter().skip(1).map(|w| w.parse().ok()).collect();
        let (place, radius) = match numbers[..] {
            [Some(x), Some(y), Some(z)] => ([x, y, z], f64::NAN),
            [Some(x), Some(y), Some(z), Some(r)] => ([x, y, z], r),
            [Some(x), Some(y), Some(z), None] if words[4].is_empty() => ([x, y, z], f64::NAN),
            _ => {
                let row = words.join(", ");
                return Err(fault(format!("expected id, x, y, z and perhaps a radius, found \"{row}\"")));
            }
        };
        if place.iter().any(|v| !v.is_finite()) {
            return Err(fault(format!("node {} is at {place:?}; numbers must be finite", words[0])));
        }
        let given = words.len() == 5 && !words[4].is_empty();
        if given && !(radius > 0.0 && radius.is_finite()) {
            let message = format!(
                "node {} has the radius {}; it must be a finite number of mm greater than 0",
                words[0], words[4]
            );
            return Err(fault(message));
        }
        let number = found.places.len() as u32;
        if found.names.insert(words[0].to_string(), number).is_some() {
            return Err(fault(format!("the node {} stands twice", words[0])));
        }
        found.places.push(place);
        found.radii.push(radius);
    }
    if found.places.is_empty() {
        return Err(Fault::new("", "the file has no rows of id, x, y, z"));
    }
    if found.radii.iter().all(|r| r.is_nan()) {
        found.radii.clear();
    }
    Ok(found)
}

/// The frame of nodes and struts, these as rows of the ids of two nodes.
///
/// # Errors
/// Rows of something else, an id that no node has.
pub fn struts(text: &str, nodes: &Nodes) -> Result<Wire, Fault> {
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
            known.ok_or_else(|| fault(format!("no node has the id {id}")))
        };
        struts.push([number(a)?, number(b)?]);
    }
    if struts.is_empty() {
        return Err(Fault::new("", "the file has no rows of two ids"));
    }
    Ok(Wire { nodes: nodes.places.clone(), struts })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_with_or_without_headings_and_radii() {
        let text = "\u{feff}id, x, y, z, r\na, 0, 0, 0, 0.5\nb, 1, 0, 0,\n# a comment\n7; 0; 1e1; 0; 2\n";
        let n = nodes(text).expect("nodes");
        assert_eq!(n.places, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 10.0, 0.0]]);
        assert!(n.radii[0] == 0.5 && n.radii[1].is_nan() && n.radii[2] == 2.0);
        let wire = struts("from,to\na,b\nb\t7\n", &n).expect("struts");
        assert_eq!(wire.struts, [[0, 1], [1, 2]]);
        let plain = nodes("1 0 0 0\n2 0 0 1\n").expect("nodes");
        assert!(plain.radii.is_empty());
        assert_eq!(struts("1 2\n", &plain).expect("struts").struts, [[0, 1]]);
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, part) in [
            ("", "no rows"),
            ("a,0,0,0\na,1,0,0", "line 2: the node a stands twice"),
            ("a,0,0,nan", "line 1: node a"),
            ("a,0,0,0\nb,0,0", "line 2: expected id, x, y, z"),
            ("a,0,0,0,-1", "line 1: node a has the radius -1"),
            ("a,0,0,0,x", "line 1: expected"),
        ] {
            let fault = nodes(text).expect_err("refused");
            assert!(fault.message.contains(part), "{fault}");
        }
        let n = nodes("a,0,0,0\nb,1,0,0").expect("nodes");
        for (text, part) in [
            ("a,b\na,c", "line 2: no node has the id c"),
            ("a,b,c", "line 1: expected the ids of two"),
            ("x,y", "no rows"),
        ] {
            let fault = struts(text, &n).expect_err("refused");
            assert!(fault.message.contains(part), "{fault}");
        }
    }
}
