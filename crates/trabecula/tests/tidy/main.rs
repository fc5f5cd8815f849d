//! The house rules that a machine can check, over the sources of all crates.
//!
//! - *Layers*: a module of `trabecula` imports only from modules of lower layers. (Between crates cargo checks it.)
//! - *Circles*: no two files of a crate import each other (`import_circles`).
//! - *Length*: a function has at most 100 lines, a file at most 600; tables of data apart.
//! - *Names*: no file name and no type name occurs twice in a crate, so that a name leads to one definition.
//! - *Words*: messages and documentation use the field's terms (docs/glossary.md), not private ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use sources::{CRATES, files, is_test, root, shipped};

mod import_circles;
mod sources;

/// The modules of `trabecula`, layer by layer. A module imports from lower layers only: not from its neighbours in its own.
const LAYERS: &[&[&str]] = &[
    &["field", "kind", "surface_maker"],
    &["implicit", "corner_normals"],
    &["csg_tree"],
    &["coincident"],
    &["region"],
    &["environment"],
    &["grade"],
    &["cell", "map"],
    &["conforming_tets"],
    &["mesher", "lattice", "tiling", "truss", "skin", "beam_surface"],
    &["blend"],
    &["solid"],
    &["extract", "layers", "patches", "volume_mesh", "voxel_fractions"],
    &["analysis", "beam_mesh", "shell_mesh"],
    &["report"],
    &["effective"],
    &["design"],
];

/// Modules that may not be imported although they are lower: what a module must work without knowing.
const UNKNOWN: &[(&str, &[&str])] = &[("extract", &["cell", "map", "lattice", "tiling", "blend", "truss", "mesher"])];

/// Most lines of a function and of a file.
const FUNCTION: usize = 100;
const FILE: usize = 600;

/// Words that say nothing to a reader of the field, each with what is meant.
const PRIVATE: &[(&str, &str)] = &[
    ("told", "reported, known"),
    ("beside", "adjacent to, in addition to"),
    ("looked at", "evaluated, searched"),
    ("so many", "the number"),
    ("as far as", "where"),
    ("rim", "boundary loop"),
    ("rims", "boundary loops"),
    ("road", "method"),
    ("roads", "methods"),
];

#[test]
fn what_follows_the_items_for_tests_is_checked_too() {
    let text = "use a;\n#[cfg(test)]\n#[allow(b)]\nmod tests {\n    fn c() {\n    }\n}\nuse d;\nimpl E {\n    #[cfg(test)]\n    fn f() {\n    }\n    \
                fn g() {}\n}\n#[cfg(test)]\nmod h;\nuse i;\n";
    assert_eq!(shipped(text), "use a;\nuse d;\nimpl E {\n    fn g() {}\n}\nuse i;\n");
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
        for rest in shipped(text).split("crate::").skip(1) {
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

/// The functions of a formatted source, each with its number of lines: from `fn` to the brace in its column.
fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut out = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let body = line.trim_start();
        let indent = &line[..line.len() - body.len()];
        let words: Vec<&str> =
            body.split_whitespace().take_while(|w| !w.contains('(') || w.starts_with("pub(")).collect();
        let after = words.iter().position(|w| *w == "fn").map(|at| at + 1);
        let Some(name) = after.and_then(|at| body.split_whitespace().nth(at)) else { continue };
        if body.starts_with("//") || body.ends_with(['}', ';']) {
            continue;
        }
        let closing = format!("{indent}}}");
        if let Some(length) = lines[i..].iter().position(|l| *l == closing) {
            let name = name.split(['(', '<']).next().unwrap_or(name);
            out.push((name.to_string(), length + 1));
        }
    }
    out
}

#[test]
fn functions_and_files_are_short() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (path, text) in CRATES.iter().flat_map(|c| files(c)) {
        let lines = text.lines().count();
        if lines > FILE {
            wrong.push(format!("{}: {lines} lines; at most {FILE}", path.display()));
        }
        for (name, length) in functions(&text) {
            seen += 1;
            if length > FUNCTION {
                wrong.push(format!("{}: {name} has {length} lines; at most {FUNCTION}", path.display()));
            }
        }
    }
    assert!(seen > 1000, "only {seen} functions found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The first of two kinds of one name would be what the schema says of both.
#[test]
fn a_kind_has_a_name_of_its_own() {
    let (mut names, mut wrong) = (BTreeSet::new(), Vec::new());
    for (path, text) in files("trabecula") {
        for before in ["#[kind(name = \"", "defs.named(\""] {
            for rest in text.split(before).skip(1) {
                let name = rest.split('"').next().unwrap_or_default();
                if !names.insert(name.to_string()) {
                    wrong.push(format!("{}: {name}", path.display()));
                }
            }
        }
    }
    assert!(names.len() > 50, "{}", names.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_file_name_occurs_once_in_a_crate() {
    let mut wrong = Vec::new();
    for of in CRATES {
        let mut by_name: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
        for (path, _) in files(of).into_iter().filter(|(p, _)| !is_test(p)) {
            let name = path.file_name().and_then(|n| n.to_str()).expect("name").to_string();
            by_name.entry(name).or_default().push(path);
        }
        wrong.extend(by_name.into_values().filter(|p| p.len() > 1).map(|p| format!("{p:?}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The types, traits and aliases that a formatted source defines for its module; those of functions and traits are indented.
fn type_names(text: &str) -> Vec<&str> {
    let name = |line| {
        let visible = |w: &&str| w.starts_with("pub") || w.ends_with(')') || *w == "unsafe";
        let mut words = str::split_whitespace(line).skip_while(visible);
        let kind = words.next().filter(|_| !line.starts_with(' '))?;
        let name = words.next().filter(|_| ["struct", "enum", "union", "trait", "type"].contains(&kind))?;
        name.split(|c: char| !c.is_alphanumeric() && c != '_').next()
    };
    text.lines().filter_map(name).collect()
}

#[test]
fn types_of_functions_and_traits_are_none_of_the_module() {
    let text = "/// struct A\npub(in crate::a) struct B<'a>(u8);\npub enum C {\n    D,\n}\ntrait E: F {\n    type G;\n}\n\
                pub type H = u8;\npub use i::J;\nfn k() {\n    struct L;\n}\nstruct M;\n";
    assert_eq!(type_names(text), ["B", "C", "E", "H", "M"]);
}

#[test]
fn a_type_name_occurs_once_in_a_crate() {
    let mut wrong = Vec::new();
    for of in CRATES {
        let src = root().join("crates").join(of).join("src");
        let mut by_name: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (path, text) in files(of).into_iter().filter(|(p, _)| !is_test(p)) {
            let file = path.strip_prefix(&src).expect("below src").display().to_string();
            for name in type_names(&shipped(&text)) {
                by_name.entry(name.to_string()).or_default().push(file.clone());
            }
        }
        assert!(by_name.len() > 5, "{of}: types are found");
        for (name, files) in by_name {
            if files.len() > 1 {
                wrong.push(format!("{of}: {name} in {}", files.join(", ")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The text of a line outside code: a comment, or what stands between quotes.
fn prose(line: &str) -> String {
    match line.find("//") {
        Some(at) => line[at..].to_string(),
        None => line.split('"').skip(1).step_by(2).collect::<Vec<_>>().join(" "),
    }
}

#[test]
fn messages_and_comments_use_the_terms_of_the_field() {
    let mut wrong = Vec::new();
    for (path, text) in CRATES.iter().flat_map(|c| files(c)) {
        for (number, line) in (1..).zip(text.lines()) {
            let prose = format!(" {} ", prose(line).to_lowercase().replace(|c: char| !c.is_alphanumeric(), " "));
            for (word, meant) in PRIVATE {
                if prose.contains(&format!(" {word} ")) {
                    wrong.push(format!("{}:{number}: \"{word}\"; say {meant}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}
