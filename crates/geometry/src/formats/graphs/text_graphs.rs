//! Graphs as plain text: tables of end points, and rows of GRID and STRUT.

use std::io::{self, Write};

use rustc_hash::FxHashMap;

use super::{BeamGraph, Ids, on_line, positive};
use crate::fault::Fault;
use crate::formats::text::{NumberedLines, at_line, column, parse, shown, words};

/// Writes a row for each beam: both ends and the radii there, mm.
pub fn write_table(graph: &BeamGraph, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(b"x1,y1,z1,x2,y2,z2,r1,r2\n")?;
    for (i, ends) in graph.beams.iter().enumerate() {
        let [[a, b, c], [d, e, f]] = ends.map(|n| graph.nodes[n as usize]);
        write!(out, "{a},{b},{c},{d},{e},{f}")?;
        match graph.radii_of(i) {
            [r, _] if r.is_nan() => writeln!(out, ",,")?,
            [r, s] => writeln!(out, ",{r},{s}")?,
        }
    }
    Ok(())
}

/// The columns of a table of end points.
const COLUMNS: [&str; 6] = ["x1", "y1", "z1", "x2", "y2", "z2"];

/// The places of the ends' coordinates and of the radii (r1 and r2, or one r; r may be radius) by headings; `None` if these name none of
/// the coordinates, a fault if they lack one.
fn places(headings: &[&[u8]]) -> Result<Option<Vec<usize>>, String> {
    let headings: Vec<_> = headings.iter().map(|h| String::from_utf8_lossy(h)).collect();
    let named = |wanted: &str| column(&headings, wanted);
    let found: Vec<Option<usize>> = COLUMNS.iter().map(|c| named(c)).collect();
    if found.iter().all(Option::is_none) {
        return Ok(None);
    }
    if let Some(lacking) = found.iter().position(Option::is_none) {
        return Err(format!(
            "no column is named {}; expected {}, and perhaps r1, r2",
            COLUMNS[lacking],
            COLUMNS.join(", ")
        ));
    }
    let radius = |end: &str| named(&format!("r{end}")).or_else(|| named(&format!("radius{end}")));
    let radii = match [radius("1"), radius("2")] {
        [None, None] => [radius(""), None],
        [None, Some(_)] => return Err("a column is named r2, and none r1; give both, or one r".into()),
        both => both,
    };
    Ok(Some(found.into_iter().chain(radii).flatten().collect()))
}

/// Reads rows of x1, y1, z1, x2, y2, z2 and no, one or two radii, between commas, semicolons, tabs or spaces. Columns are found by
/// their headings, if a first line names these; others are left out then. Ends at the same position are one node.
pub fn read_table(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut graph, mut seen, mut first) = (BeamGraph::default(), FxHashMap::default(), true);
    let mut order: Option<Vec<usize>> = None;
    for (line, text) in NumberedLines::new(bytes) {
        let text = text.split(|b| *b == b'#').next().unwrap_or_default();
        let separated = text.iter().any(|b| b",;\t".contains(b));
        let fields: Vec<&[u8]> = match separated {
            true => text.split(|b| b",;\t".contains(b)).map(unquoted).collect(),
            false => words(text).collect(),
        };
        if fields.iter().all(|f| f.is_empty()) {
            continue;
        }
        let numbers: Vec<Option<f64>> = fields.iter().map(|f| parse(f)).collect();
        if std::mem::take(&mut first) && numbers.iter().all(Option::is_none) {
            order = places(&fields).map_err(|message| at_line(line, message))?;
            let used = order.as_deref().unwrap_or(&[]);
            let id = |name: &[u8]| [&b"id"[..], b"name"].iter().any(|i| name.eq_ignore_ascii_case(i));
            let left = (0..fields.len()).filter(|i| order.is_some() && !used.contains(i) && !id(fields[*i]));
            graph.remarks.extend(left.map(|i| format!("the column {} left out", shown(fields[i]))));
            continue;
        }
        let (fields, numbers) = match &order {
            None => (fields, numbers),
            Some(order) => order
                .iter()
                .map(|i| (fields.get(*i).copied().unwrap_or_default(), numbers.get(*i).copied().flatten()))
                .unzip(),
        };
        let expected = "x1, y1, z1, x2, y2, z2 and no, one or two radii";
        if !(6..=8).contains(&fields.len()) {
            return Err(at_line(line, format!("{} values found; expected {expected}", fields.len())));
        }
        let wrong = |f: &&[u8]| at_line(line, format!("{} is not a finite number; expected {expected}", shown(f)));
        let mut ends = [[0.0; 3]; 2];
        for (i, field) in fields.iter().enumerate().take(6) {
            ends[i / 3][i % 3] = numbers[i].filter(|v| v.is_finite()).ok_or_else(|| wrong(field))?;
        }
        let mut radii = [f64::NAN; 2];
        for (i, field) in fields.iter().enumerate().skip(6).filter(|(_, f)| !f.is_empty()) {
            let radius = numbers[i].ok_or_else(|| wrong(field))?;
            radii[i - 6] = positive(radius, ["r1", "r2"][i - 6]).map_err(on_line(line))?;
        }
        if radii[1].is_nan() {
            radii[1] = radii[0];
        }
        if radii[0].is_nan() {
            radii[0] = radii[1];
        }
        let ends = ends.map(|p| graph.node_at(&mut seen, p));
        graph.join(ends, radii, on_line(line))?;
    }
    Ok(graph)
}

/// A field without the spaces and quotes about it.
fn unquoted(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    let inner = field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\""));
    inner.map_or(field, <[u8]>::trim_ascii)
}

/// Reads rows "GRID id x y z" and "STRUT id node node", perhaps with a radius, as TPMS Designer and homo3D have them; `//` begins a
/// comment.
pub fn read_grid(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let (mut graph, mut ids, mut pairs) = (BeamGraph::default(), Ids::default(), Vec::new());
    for (line, text) in NumberedLines::new(bytes) {
        let row: Vec<&[u8]> =
            text.split(|b| b.is_ascii_whitespace() || b",;".contains(b)).filter(|w| !w.is_empty()).collect();
        let Some(kind) = row.first().filter(|w| !w.starts_with(b"//") && !w.starts_with(b"#")) else { continue };
        let real = |w: &[u8]| {
            let v = parse::<f64>(w).filter(|v| v.is_finite());
            v.ok_or_else(|| at_line(line, format!("{} is not a finite number", shown(w))))
        };
        let id = |w: &[u8]| parse::<i64>(w).ok_or_else(|| at_line(line, format!("{} is not an id", shown(w))));
        match (kind.to_ascii_uppercase().as_slice(), &row[1..]) {
            (b"GRID", [name, x, y, z]) => {
                ids.add(id(name)?, graph.nodes.len()).map_err(on_line(line))?;
                graph.nodes.push([real(x)?, real(y)?, real(z)?]);
            }
            (b"STRUT", [name, a, b, more @ ..]) if more.len() < 2 => {
                id(name)?;
                let radius = more.first().map(|r| positive(real(r)?, "radius").map_err(on_line(line))).transpose()?;
                pairs.push((line, [id(a)?, id(b)?], radius.unwrap_or(f64::NAN)));
            }
            (b"GRID", _) => return Err(at_line(line, "a GRID row is: GRID id x y z")),
            (b"STRUT", _) => return Err(at_line(line, "a STRUT row is: STRUT id node node, and perhaps a radius")),
            _ => return Err(at_line(line, format!("{} found; expected GRID or STRUT", shown(kind)))),
        }
    }
    for (line, [a, b], radius) in pairs {
        let fault = on_line(line);
        let ends = [ids.get(a).map_err(&fault)?, ids.get(b).map_err(&fault)?];
        graph.join(ends, [radius; 2], fault)?;
    }
    Ok(graph)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_with_and_without_headings_and_radii() {
        let made = read_table(b"x1;y1;z1;x2;y2;z2;r\n0;0;0;1;0;0;0.5\n1;0;0;1;2;0;\n# end\n").unwrap();
        assert_eq!((made.nodes.len(), &made.beams), (3, &vec![[0, 1], [1, 2]]));
        assert!(made.beam_radii[0] == [0.5; 2] && made.beam_radii[1][0].is_nan());
        let named = read_table(b"id,\"x1\",x2,y1,y2,z1,z2,R2,r1,d\n7,\"0\",5,0,1,0,2,.5,.4,1\n").unwrap();
        assert!(named.nodes == [[0.0; 3], [5.0, 1.0, 2.0]] && named.beam_radii == [[0.4, 0.5]]);
        let plain = read_table(b"0 0 0 1 1 1\n-0 0 0 2 2 2 .1 .2\n").unwrap();
        assert!(plain.beams == [[0, 1], [0, 2]] && plain.beam_radii[1] == [0.1, 0.2]);
        for (text, expected) in [
            ("x1,y1,z1,x2,y2\n0,0,0,1,1", "line 1: no column is named z2; expected x1"),
            ("0,0,0,1,1", "line 1: 5 values found; expected x1"),
            ("a,b\n0,0,0,1,1,x", "line 2: \"x\" is not a finite number"),
            ("0,0,0,1,1,inf", "line 1: \"inf\" is not"),
            ("0,0,0,1,1,1,-2", "line 1: r1 is -2; a radius"),
            ("0,0,0,0,0,0", "line 1: both ends"),
        ] {
            let fault = read_table(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }

    #[test]
    fn grid_and_strut_rows() {
        let text = "//Grid  ID x y z\nGRID 1 0 0 0\nGRID 5 .5 1 0\nSTRUT 1 1 5\nstrut 2 5 1 0.2\n";
        let made = read_grid(text.as_bytes()).unwrap();
        assert!(made.beams == [[0, 1], [1, 0]] && made.beam_radii[1] == [0.2; 2]);
        for (text, expected) in [
            ("GRID 1 0 0", "line 1: a GRID row is"),
            ("GRID 1 0 0 0\nSTRUT 1 1 2", "line 2: there is no node with id 2"),
            ("GRID 1 0 0 0\nGRID 1 1 0 0", "line 2: there are two nodes with id 1"),
            ("NODE 1 0 0 0", "line 1: \"NODE\" found; expected GRID or STRUT"),
        ] {
            let fault = read_grid(text.as_bytes()).unwrap_err();
            assert!(fault.message.contains(expected), "{fault} ({expected})");
        }
    }
}
