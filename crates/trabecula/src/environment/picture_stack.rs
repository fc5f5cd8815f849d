//! Stacks of grey pictures, as a scanner writes them: one file for each layer, one TIFF of all, or a series of DICOM.

use super::{Loader, extension};
use crate::kind::DesignError;
use geometry::formats;
use geometry::math::Vec3;

/// The formats of pictures.
const KINDS: [&str; 3] = ["png", "tif", "tiff"];

/// Most pixels of a stack: each takes 8 bytes here.
const MOST: usize = 1 << 29;
/// The extension of DICOM, which the loader reads.
const DICOM: &str = "dcm";

/// Grey values on a grid.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Columns, rows, pictures: along x, y, z.
    pub shape: [usize; 3],
    /// x fastest.
    pub values: Vec<f64>,
    /// The middle of the first pixel and the distances between pixels and pictures, mm, where the files say so.
    pub placed: Option<[Vec3; 2]>,
}

/// Whether a path names pictures: by its extension, or as a folder, with a slash at its end.
pub(crate) fn names_pictures(path: &str) -> bool {
    path.ends_with('/') || KINDS.contains(&extension(path).as_str()) || extension(path) == DICOM
}

/// The grey values of the file at `path`, of the files that match it if its last part has a *, or of the pictures of a folder.
/// Files stand in the order of their names, in which 10 comes after 9, and each holds one picture or more; those of a DICOM
/// series in the order of their positions. `at` is the place of `path` in the design.
pub(crate) fn picture_stack(path: &str, at: &str, loader: &dyn Loader) -> Result<Scan, DesignError> {
    let wrong = |m: String| DesignError::new(at, m).found(path);
    let in_folder = if path.ends_with('/') { loader.list(&format!("{path}*")).unwrap_or_default() } else { Vec::new() };
    let of_kind = |kinds: &[&str]| in_folder.iter().filter(|n| kinds.contains(&extension(n).as_str())).count();
    let counts = [of_kind(&KINDS[..1]), of_kind(&KINDS[1..])];
    if extension(path) == DICOM || path.ends_with('/') && counts == [0, 0] {
        return loader.scan(path).map_err(wrong);
    }
    if counts.iter().all(|c| *c > 0) {
        let [png, tif] = counts;
        return Err(wrong(format!(
            "{path} holds {png} png and {tif} tif; name those of one stack with a * in the last part"
        )));
    }
    let mut names: Vec<String> = if path.ends_with('/') {
        in_folder.into_iter().filter(|n| KINDS.contains(&extension(n).as_str())).collect()
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
            if values.len() > MOST {
                return Err(wrong(format!(
                    "more than {MOST} pixels in all; crop the pictures, or average several pixels to one"
                )));
            }
        }
    }
    let [w, h] = size.ok_or_else(|| wrong(format!("{path}: no pictures")))?;
    Ok(Scan { shape: [w, h, count], values, placed: None })
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
