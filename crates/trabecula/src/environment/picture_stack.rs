//! Stacks of grey pictures, as a scanner writes them: one file for each layer, or one TIFF of all.

use super::{Loader, extension};
use crate::kind::DesignError;
use geometry::formats;

/// The formats of pictures.
const KINDS: [&str; 3] = ["png", "tif", "tiff"];

/// Whether a path names pictures: by its extension, or as a folder, with a slash at its end.
pub(crate) fn names_pictures(path: &str) -> bool {
    path.ends_with('/') || KINDS.contains(&extension(path).as_str())
}

/// The numbers of columns, rows and pictures, and the grey values, x fastest: of the file at `path`, of the files that match it
/// if its last part has a *, or of the pictures of a folder. Files stand in the order of their names, in which 10 comes after 9,
/// and each holds one picture or more. `at` is the place of `path` in the design.
pub(crate) fn picture_stack(path: &str, at: &str, loader: &dyn Loader) -> Result<([usize; 3], Vec<f64>), DesignError> {
    let wrong = |m: String| DesignError::new(at, m).found(path);
    let mut names = if path.ends_with('/') {
        let of_a_kind = |kind: &&str| loader.list(&format!("{path}*.{kind}")).ok();
        KINDS.iter().find_map(of_a_kind).ok_or_else(|| wrong(format!("no pictures (png, tif) in {path}")))?
    } else if path.contains('*') {
        loader.list(path).map_err(wrong)?
    } else {
        vec![path.to_string()]
    };
    names.sort_by_cached_key(|n| counted_name(n));
    let (mut size, mut values, mut count) = (None, Vec::new(), 0);
    for name in &names {
        let wrong = |message: String| DesignError::new(at, format!("{name}: {message}")).found(name);
        let file = loader.load(name).map_err(|m| DesignError::new(at, m).found(name))?;
        for picture in formats::read_pictures(&file).map_err(|f| wrong(f.message))? {
            let [w, h] = picture.size;
            let first = *size.get_or_insert(picture.size);
            if first != picture.size {
                let message = format!("a picture of {w} × {h} pixels among those of {} × {}", first[0], first[1]);
                return Err(wrong(message));
            }
            values.extend(picture.values);
            count += 1;
        }
    }
    let [w, h] = size.ok_or_else(|| wrong(format!("{path}: no pictures")))?;
    Ok(([w, h, count], values))
}

/// A name as its words and numbers, so that they sort as people count.
fn counted_name(name: &str) -> Vec<(String, u64)> {
    let mut parts: Vec<(String, u64)> = vec![(String::new(), 0)];
    let mut digits = false;
    for c in name.chars() {
        match (c.to_digit(10), parts.last_mut()) {
            (Some(d), Some(last)) => {
                last.1 = last.1.saturating_mul(10).saturating_add(u64::from(d));
                digits = true;
            }
            (None, Some(last)) if !digits => last.0.push(c),
            _ => {
                parts.push((c.to_string(), 0));
                digits = false;
            }
        }
    }
    parts
}
