//! Tables of positions and values.

use geometry::fault::Fault;

/// Rows of numbers, separated by commas, semicolons or spaces, x, y, z and a value if `widths` says so, all of one width; one
/// header line is ignored.
pub(super) fn table(text: &str, widths: &[usize]) -> Result<Vec<Vec<f64>>, Fault> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let what = match widths {
        [4] => "four numbers x, y, z, value",
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
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Fault::new("", format!("the file has no rows of {what}")));
    }
    Ok(rows)
}
