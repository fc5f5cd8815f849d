//! Tables of positions and values.

use geometry::fault::Fault;
use geometry::formats::column;

/// Rows of numbers, separated by commas, semicolons or spaces, x, y, z and a value if `widths` says so, all of one width. Where a
/// header line names x, y and z, they are taken from there.
pub(super) fn table(text: &str, widths: &[usize]) -> Result<Vec<Vec<f64>>, Fault> {
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
        if rows.is_empty() && row.iter().all(Option::is_none) {
            order = places(&split(line, separator(line)));
            continue;
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

/// The places of x, y, z and of what else there is, in this order, by the first line; none if it does not name these three.
fn places(names: &[String]) -> Vec<usize> {
    let Some(mut found) = ["x", "y", "z"].iter().map(|n| column(names, n)).collect::<Option<Vec<usize>>>() else {
        return Vec::new();
    };
    let others = (0..names.len()).filter(|i| !found.contains(i));
    found.extend(others.collect::<Vec<usize>>());
    found
}

/// The columns that the first line names so, in this order. Other columns may hold anything.
pub(super) fn named(text: &str, names: &[String]) -> Result<Vec<Vec<f64>>, Fault> {
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
