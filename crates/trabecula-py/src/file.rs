//! Files: read whole if they are regular ones that memory can hold; written anew.

use std::fs::File;
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
        return wrong(ErrorKind::IsADirectory, format!("{name} is a directory, not a file"));
    }
    if !about.is_file() {
        let message = format!("{name} is a device or a pipe; only files are read");
        return wrong(ErrorKind::InvalidInput, message);
    }
    if machine::free_memory(Path::new("/")).is_some_and(|free| about.len() as f64 > 0.5 * free) {
        let message = format!("{name} has {:.3e} bytes, too many for the memory that is free", about.len() as f64);
        return wrong(ErrorKind::OutOfMemory, message);
    }
    std::fs::read(path).or_else(|e| wrong(e.kind(), format!("{name} cannot be read: {e}")))
}

/// An empty file next to the one at `path`, to be written and read back, of which nothing is left however the work ends: it has
/// no name any more where the system allows that, and elsewhere the system removes it when it is closed.
pub fn nameless(path: &Path, ending: &str) -> Result<File> {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    let mut options = File::options();
    options.read(true).write(true).create_new(true);
    #[cfg(windows)]
    {
        use std::os::windows::fs::OpenOptionsExt;
        const DELETE_ON_CLOSE: u32 = 0x0400_0000;
        options.custom_flags(DELETE_ON_CLOSE);
    }
    let file = options.open(&name)?;
    #[cfg(not(windows))]
    std::fs::remove_file(&name)?;
    Ok(file)
}

/// The file at `path`, empty, to be written and read back.
///
/// It is cut off only if there is something to cut: some systems flush a file to the disk when it is closed if it was
/// truncated when it was opened, and that takes as long as the writing.
pub fn anew(path: &Path) -> Result<File> {
    let mut options = File::options();
    let file = options.read(true).write(true).create(true).truncate(false);
    let file = file.open(path)?;
    if file.metadata()?.len() > 0 {
        file.set_len(0)?;
    }
    Ok(file)
}
