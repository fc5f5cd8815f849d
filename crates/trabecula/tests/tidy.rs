//! The house rules that a machine can check, over the sources of all crates.
//!
//! - *Layers*: a module of `trabecula` imports only from modules of lower layers. (Between crates cargo checks it.)

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The modules of `trabecula`, layer by layer. A module imports from lower layers only: not from its neighbours in its own.
const LAYERS: &[&[&str]] = &[
    &["field", "kind", "surface_maker"],
    &["implicit"],
    &["csg_tree"],
    &["coincident"],
    &["grade"],
    &["cell", "map", "region"],
    &["mesher", "lattice", "tiling", "truss", "skin", "beam_surface"],
    &["blend"],
    &["solid"],
    &["extract"],
    &["analysis"],
    &["report"],
    &["design"],
];

/// Modules that may not be imported although they are lower: what a module must work without knowing.
const UNKNOWN: &[(&str, &[&str])] = &[("extract", &["cell", "map", "lattice", "tiling", "blend", "truss", "mesher"])];

fn root() -> PathBuf {
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
fn files(of: &str) -> Vec<(PathBuf, String)> {
    let mut paths = Vec::new();
    sources(&root().join("crates").join(of).join("src"), &mut paths);
    assert!(!paths.is_empty(), "{of} has no sources");
    paths.into_iter().map(|p| (p.clone(), fs::read_to_string(p).expect("text"))).collect()
}

/// The part of a file that is compiled into the library: tests stand at its foot.
fn shipped(text: &str) -> &str {
    &text[..text.find("\n#[cfg(test)]").unwrap_or(text.len())]
}

fn is_test(path: &Path) -> bool {
    path.components().any(|c| ["tests", "tests.rs", "laws.rs"].iter().any(|t| c.as_os_str() == *t))
}

#[test]
fn modules_import_from_lower_layers_only() {
    let layers = LAYERS.iter().enumerate();
    let rank: BTreeMap<&str, usize> =
        layers.flat_map(|(layer, of)| of.iter().map(move |name| (*name, layer))).collect();
    let mut wrong = BTreeSet::new();
    let src = root().join("crates/trabecula/src");
    for (path, text) in files("trabecula").iter().filter(|(p, _)| !is_test(p)) {
        let inner = path.strip_prefix(&src).expect("below src");
        let own = inner.iter().next().and_then(|c| c.to_str()).expect("name").trim_end_matches(".rs");
        if own == "lib" {
            continue;
        }
        let Some(mine) = rank.get(own) else {
            wrong.insert(format!("module {own} stands in no layer"));
            continue;
        };
        for (i, _) in shipped(text).match_indices("crate::") {
            let rest = &text[i + 7..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            let other = &rest[..end];
            match rank.get(other) {
                Some(theirs) if other != own && theirs >= mine => {
                    wrong.insert(format!("{} imports {other}, which is no lower", inner.display()));
                }
                Some(_) if UNKNOWN.iter().any(|(of, names)| *of == own && names.contains(&other)) => {
                    wrong.insert(format!("{} imports {other}, which {own} must not know", inner.display()));
                }
                _ => {}
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.into_iter().collect::<Vec<_>>().join("\n"));
}
