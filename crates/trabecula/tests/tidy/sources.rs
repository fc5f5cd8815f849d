//! The sources of all crates.

use std::fs;
use std::path::{Path, PathBuf};

/// Whether a file holds tests.
pub fn is_test(path: &Path) -> bool {
    path.components().any(|c| ["tests", "tests.rs", "laws.rs"].iter().any(|t| c.as_os_str() == *t))
}

/// The crates.
pub const CRATES: [&str; 6] = ["geometry", "beams", "homogenise", "trabecula", "trabecula-py", "trabecula-wasm"];

/// The folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("root")
}

fn sources(dir: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(dir).expect("folder").map(|e| e.expect("entry").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Every source file of a crate with its text.
pub fn files(of: &str) -> Vec<(PathBuf, String)> {
    let mut paths = Vec::new();
    sources(&root().join("crates").join(of).join("src"), &mut paths);
    assert!(!paths.is_empty(), "{of} has no sources");
    paths.into_iter().map(|p| (p.clone(), fs::read_to_string(p).expect("text"))).collect()
}

/// What is compiled into the library of a formatted source: all but its items for tests, wherever they stand. Such an item ends with the
/// brace in its column, or in a line of its own.
pub fn shipped(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let body = line.trim_start();
        if body != "#[cfg(test)]" {
            out.push_str(line);
            out.push('\n');
            continue;
        }
        let closing = format!("{}}}", &line[..line.len() - body.len()]);
        let mut item = lines.by_ref().skip_while(|l| l.trim_start().starts_with("#["));
        if item.next().is_some_and(|first| !first.ends_with([';', '}'])) {
            item.find(|l| *l == closing);
        }
    }
    out
}
