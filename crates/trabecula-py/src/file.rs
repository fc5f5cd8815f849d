//! Files that are read whole: regular ones that memory can hold.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

use crate::machine;

/// The bytes of a file. Directories, devices and pipes, which may have no end, are refused, and so is a file larger than
/// the memory that is free; every error says which file.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let name = path.display();
    let wrong = |kind, message: String| Err(Error::new(kind, message));
    let about = match std::fs::metadata(path) {
        Ok(about) => about,
        Err(e) if e.kind() == ErrorKind::NotFound => {
            return wrong(e.kind(), format!("{name} does not exist"));
        }
        Err(e) => return wrong(e.kind(), format!("{name} cannot be read: {e}")),
    };
    if about.is_dir() {
        return wrong(
            ErrorKind::IsADirectory,
            format!("{name} is a directory, not a file"),
        );
    }
    if !about.is_file() {
        let message = format!("{name} is a device or a pipe; only files are read");
        return wrong(ErrorKind::InvalidInput, message);
    }
    if machine::free_memory(Path::new("/")).is_some_and(|free| about.len() as f64 > 0.5 * free) {
        let message = format!(
            "{name} has {:.3e} bytes, too many for the memory that is free",
            about.len() as f64
        );
        return wrong(ErrorKind::OutOfMemory, message);
    }
    std::fs::read(path).or_else(|e| wrong(e.kind(), format!("{name} cannot be read: {e}")))
}
