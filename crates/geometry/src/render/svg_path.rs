//! Lines as data of SVG paths.

use std::fmt::Write;

use super::visible_parts::PicturePoint;

/// Lines with this many digits behind the point; one that ends where it begins is closed.
pub(super) fn path(lines: &[Vec<PicturePoint>], digits: usize) -> String {
    let mut out = String::new();
    for line in lines {
        let closed = line.len() > 2 && line.first() == line.last();
        let points = &line[..line.len() - usize::from(closed)];
        for (i, [x, y]) in points.iter().enumerate() {
            let before = ["M", "L", " "][i.min(2)];
            let _ = write!(out, "{before}{x:.digits$} {y:.digits$}");
        }
        out.push_str(if closed { "Z" } else { "" });
    }
    out
}
