//! Tables of positions and values.

use crate::kind::Unit;
use geometry::fault::Fault;
use geometry::formats::{column, heading};

/// Rows of positions (mm) and values: of the columns `names`, or of all if none are named, as many as one of `widths`. A heading of a
/// coordinate that has a unit has to mean `unit`, mm where none is given.
pub(super) fn table(
    text: &str,
    names: Option<&[String]>,
    widths: &[usize],
    unit: Option<Unit>,
) -> Result<Vec<Vec<f64>>, Fault> {
    let mut rows = match names {
        Some(names) => named(text, names, unit),
        None => unnamed(text, widths, unit),
    }?;
    let mm = unit.map_or(1.0, Unit::in_mm);
    rows.iter_mut().for_each(|row| row[..3].iter_mut().for_each(|c| *c *= mm));
    Ok(rows)
}

/// Refuses headings of coordinates that have another unit.
fn check_units<'a>(headings: impl IntoIterator<Item = &'a String>, unit: Option<Unit>) -> Result<(), Fault> {
    let read = unit.unwrap_or(Unit::Mm);
    let other = |said: &str| !said.is_empty() && !read.has_name(said);
    let Some(found) = headings.into_iter().find(|h| other(heading(h).1)) else { return Ok(()) };
    let said = Unit::ALL.into_iter().find(|u| unit.is_none() && u.has_name(heading(found).1));
    let hint = said.map_or(String::new(), |u| format!("; give unit = \"{}\"", u.names()[0]));
    let read = read.names()[0];
    Err(Fault::new(
        "",
        format!("the heading \"{found}\" has another unit than {read}, in which positions are read{hint}"),
    ))
}

/// Rows of numbers, separated by commas, semicolons or spaces, x, y, z and a value if `widths` says so, all of one width. Where a
/// header line names x, y and z, they are taken from there.
fn unnamed(text: &str, widths: &[usize], unit: Option<Unit>) -> Result<Vec<Vec<f64>>, Fault> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut order: Vec<usize> = Vec::new();
    let what = match widths {
        [4] => "four numbers x, y, z, value",
        [9] => "nine numbers x, y, z, 11, 22, 33, 23, 13, 12 (or columns that name them)",
        _ => "x, y, z, or x, y, z, value in all rows",
    };
    let fault = |n: usize, message: String| Fault::new("", format!("line {}: {message}", n + 1));
    for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words: Vec<&str> = line.split([',', ';', '\t', ' ']).filter(|w| !w.is_empty()).collect();
        let row: Vec<Option<f64>> = words.iter().map(|w| w.trim_matches('"').parse().ok()).collect();
        // Headings may be numbers too: the components 11, 22.
        if rows.is_empty() && row.iter().any(Option::is_none) {
            let headings = split(line, separator(line));
            let named = places(&headings);
            if !named.is_empty() || row.iter().all(Option::is_none) {
                order = named;
                check_units(order.iter().take(3).map(|i| &headings[*i]), unit)?;
                continue;
            }
        }
        let wide = rows.first().map_or(row.len(), Vec::len);
        let numbers: Option<Vec<f64>> = row.into_iter().collect();
        let Some(row) = numbers.filter(|r| r.len() == wide && widths.contains(&wide)) else {
            return Err(fault(n, format!("expected {what}, found \"{line}\"")));
        };
        if row.iter().any(|v| !v.is_finite()) {
            return Err(fault(n, format!("numbers must be finite, found \"{line}\"")));
        }
        if order.is_empty() {
            rows.push(row);
            continue;
        }
        if order.len() != wide {
            return Err(fault(n, format!("the first line names {} columns, found \"{line}\"", order.len())));
        }
        rows.push(order.iter().map(|place| row[*place]).collect());
    }
    if rows.is_empty() {
        return Err(Fault::new("", format!("the file has no rows of {what}")));
    }
    Ok(rows)
}

/// What separates the words of a table by its line of headings: these may have spaces, unless these are it.
fn separator(headings: &str) -> char {
    [',', ';', '\t'].into_iter().find(|s| headings.contains(*s)).unwrap_or(' ')
}

/// The words of a line.
fn split(line: &str, separator: char) -> Vec<String> {
    let all = line.split(separator).map(|w| w.trim().trim_matches('"').trim().to_string());
    all.filter(|w| separator != ' ' || !w.is_empty()).collect()
}

/// The places of x, y, z and of the six components of a tensor, or of what else there is, in this order, by the first line; none if it does
/// not name these three.
fn places(names: &[String]) -> Vec<usize> {
    let of = |wanted: &[&str]| wanted.iter().map(|n| column(names, n)).collect::<Option<Vec<usize>>>();
    let Some(mut found) = of(&["x", "y", "z"]) else { return Vec::new() };
    let others = || (0..names.len()).filter(|i| !found.contains(i)).collect();
    let others = of(&["11", "22", "33", "23", "13", "12"]).unwrap_or_else(others);
    found.extend(others);
    found
}

/// The columns that the first line names so, in this order. Other columns may hold anything.
fn named(text: &str, names: &[String], unit: Option<Unit>) -> Result<Vec<Vec<f64>>, Fault> {
    let fault = |n: usize, message: String| Fault::new("", format!("line {}: {message}", n + 1));
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines.map(|(n, l)| (n, l.trim())).filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    let Some((_, first)) = lines.next() else { return Err(Fault::new("", "the file is empty")) };
    let separator = separator(first);
    let all = split(first, separator);
    let place = |name: &String| {
        all.iter().position(|w| w == name).ok_or_else(|| {
            let there = all.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ");
            Fault::new("", format!("no column is named \"{name}\"; there are {there}"))
        })
    };
    let places = names.iter().map(place).collect::<Result<Vec<usize>, Fault>>()?;
    check_units(&names[..3], unit)?;
    let rows = lines.map(|(n, line)| {
        let row = split(line, separator);
        let read = |(place, name): (&usize, &String)| {
            let found = row.get(*place).map_or("", String::as_str);
            let value = found.parse().ok().filter(|v: &f64| v.is_finite());
            value.ok_or_else(|| fault(n, format!("expected a finite number as {name}, found \"{found}\"")))
        };
        places.iter().zip(names).map(read).collect::<Result<Vec<f64>, Fault>>()
    });
    let rows = rows.collect::<Result<Vec<_>, Fault>>()?;
    if rows.is_empty() { Err(Fault::new("", "the file has names of columns, but no rows")) } else { Ok(rows) }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn headings_name_columns_and_units() {
        let row = |heading: &str, unit| {
            table(&format!("{heading}\n1,2,3,0.5\n"), None, &[4], unit).map(|rows| rows[0].clone())
        };
        assert_eq!(row("Y [mm],X (mm),z,t", Some(Unit::Mm)).unwrap(), [2.0, 1.0, 3.0, 0.5]);
        assert_eq!(row("t,x,y,z", Some(Unit::Cm)).unwrap(), [20.0, 30.0, 5.0, 1.0]);
        assert_eq!(row("x (Metre),y [m],z,t [K]", Some(Unit::M)).unwrap(), [1000.0, 2000.0, 3000.0, 0.5]);
        assert_eq!(row("a,b,c,d", Some(Unit::Inch)).unwrap(), [25.4, 50.8, 3.0 * 25.4, 0.5]);
        let other = row("x,y [m],z,t", None).unwrap_err().message;
        assert_eq!(
            other,
            "the heading \"y [m]\" has another unit than mm, in which positions are read; give unit = \"m\""
        );
        let other = row("x,y [pixel],z,t", Some(Unit::Cm)).unwrap_err().message;
        assert_eq!(other, "the heading \"y [pixel]\" has another unit than cm, in which positions are read");

        let tensors = "x,y,z,11,12,13,22,23,33\n1,2,3,0.1,0.6,0.5,0.2,0.4,0.3\n";
        assert_eq!(table(tensors, None, &[9], None).unwrap(), [[1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]]);

        let text = "node,X Location (m),Y Location (m),Z Location (m),Stress (Pa)\n7,1,2,3,5e6\n";
        let names = ["X Location (m)", "Y Location (m)", "Z Location (m)", "Stress (Pa)"].map(String::from);
        assert_eq!(table(text, Some(&names), &[4], Some(Unit::M)).unwrap(), [[1000.0, 2000.0, 3000.0, 5e6]]);
        assert!(table(text, Some(&names), &[4], None).is_err());
        for unit in Unit::ALL {
            assert_eq!(unit.names()[0].parse::<Unit>().unwrap(), unit);
        }
    }
}
