//! No two files of a crate import each other, by way of others or at once.
//!
//! Files of a folder may use what the file above it defines, such as the trait of which they are kinds, and that file calls them: apart from
//! one of these two directions, imports have no circle. A name that a module hands on counts as an import of the file that defines it.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{files, is_test, root, shipped};

/// The doors are left out: the Python classes of a mesh and a solid make each other.
const CRATES: [&str; 4] = ["geometry", "beams", "homogenise", "trabecula"];

/// The path of a module from its crate; empty for the crate itself.
type Module = Vec<String>;

/// The words, `::` and other signs of a source, without comments and what stands between quotes.
fn tokens(text: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            3 + raw.find("\"#").expect("the end of a raw text") + 2
        } else if c == '"' {
            let mut from = 1;
            while let Some(n) = rest[from..].find(['"', '\\']).filter(|n| rest[from + n..].starts_with('\\')) {
                from += n + 2;
            }
            from + rest[from..].find('"').expect("the end of a text") + 1
        } else if rest.starts_with("'\"'") {
            3
        } else if c.is_alphanumeric() || c == '_' {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            out.push(rest[..end].into());
            end
        } else if rest.starts_with("::") {
            out.push("::".into());
            2
        } else {
            if "{},;*".contains(c) {
                out.push(c.into());
            }
            c.len_utf8()
        };
        rest = &rest[length..];
    }
    out
}

/// A path that a file uses, and its other name, if it is one that the module hands on.
struct Import {
    path: Vec<String>,
    name: Option<String>,
}

/// What a module defines, and what it imports.
#[derive(Default)]
struct Source {
    defined: BTreeSet<String>,
    imports: Vec<Import>,
    handed_on: Vec<Import>,
}

impl Source {
    fn of(text: &str) -> Source {
        let tokens = tokens(text);
        let mut out = Source::default();
        let mut i = 0;
        while i < tokens.len() {
            match tokens[i].as_str() {
                // Not `use<'a>` of a type.
                "use" if tokens.get(i + 2).is_some_and(|t| t == "::") => {
                    let statement = tokens[..i].iter().rev().take_while(|t| !matches!(t.as_str(), ";" | "{" | "}"));
                    let handed_on = statement.into_iter().any(|t| t == "pub");
                    let into = if handed_on { &mut out.handed_on } else { &mut out.imports };
                    i = tree(&tokens, i + 1, &[], into);
                }
                "fn" | "struct" | "enum" | "trait" | "const" | "static" | "type" | "macro_rules" => {
                    out.defined.extend(tokens.get(i + 1).cloned());
                    i += 1;
                }
                _ if tokens.get(i + 1).is_some_and(|t| t == "::") && (i == 0 || tokens[i - 1] != "::") => {
                    let mut path = vec![tokens[i].clone()];
                    while tokens.get(i + 1).is_some_and(|t| t == "::") && tokens.get(i + 2).is_some_and(|t| t != "{") {
                        path.push(tokens[i + 2].clone());
                        i += 2;
                    }
                    out.imports.push(Import { path, name: None });
                    i += 1;
                }
                _ => i += 1,
            }
        }
        out
    }
}

/// Reads the tree of a `use` from a token on; returns the token behind it.
fn tree(tokens: &[String], mut i: usize, before: &[String], out: &mut Vec<Import>) -> usize {
    let mut path = before.to_vec();
    let mut name = None;
    while i < tokens.len() {
        match tokens[i].as_str() {
            "::" => i += 1,
            "{" => {
                i += 1;
                while tokens[i] != "}" {
                    i = tree(tokens, i, &path, out);
                    if tokens[i] == "," {
                        i += 1;
                    }
                }
                return i + 1;
            }
            "as" => {
                name = Some(tokens[i + 1].clone());
                i += 2;
            }
            "," | ";" | "}" => break,
            word => {
                path.push(word.to_string());
                i += 1;
            }
        }
    }
    out.push(Import { path, name });
    i
}

struct Crate(BTreeMap<Module, Source>);

impl Crate {
    fn of(name: &str) -> Crate {
        let src = root().join("crates").join(name).join("src");
        let kept = files(name).into_iter().filter(|(path, _)| !is_test(path));
        let module = |path: std::path::PathBuf| -> Module {
            let inner = path.strip_prefix(&src).expect("below src").with_extension("");
            inner.iter().map(|c| c.to_str().expect("name").to_string()).filter(|c| c != "lib").collect()
        };
        Crate(kept.map(|(path, text)| (module(path), Source::of(&shipped(&text)))).collect())
    }

    /// A path from the crate, if it leads into it.
    fn path_in_crate(&self, of: &Module, path: &[String]) -> Option<Module> {
        let ups = path.iter().take_while(|p| *p == "super").count();
        let (base, rest) = match path[0].as_str() {
            "crate" => (Vec::new(), &path[1..]),
            "self" => (of.clone(), &path[1..]),
            _ if ups > 0 => (of[..of.len().checked_sub(ups)?].to_vec(), &path[ups..]),
            _ if self.0.contains_key(&[of.as_slice(), &path[..1]].concat()) => (of.clone(), path),
            _ => return None,
        };
        Some([base, rest.to_vec()].concat())
    }

    /// The file that defines what a path from the crate names.
    fn defining(&self, path: &Module, depth: usize) -> Module {
        let end = (0..=path.len()).rev().find(|n| self.0.contains_key(&path[..*n])).expect("the crate");
        let (module, rest) = (path[..end].to_vec(), &path[end..]);
        let source = &self.0[&module];
        let Some(name) = rest.first().filter(|n| !source.defined.contains(*n) && depth < 8) else { return module };
        let others = source.handed_on.iter().chain(&source.imports);
        let named = others.filter(|i| i.name.as_ref().or(i.path.last()).is_some_and(|n| n == name || n == "*"));
        let found = named.filter_map(|import| {
            let mut path = self.path_in_crate(&module, &import.path)?;
            if path.last().is_some_and(|n| n == "*") {
                path.pop();
                let holds = self.0.get(&path).is_some_and(|s| s.defined.contains(name));
                return holds.then_some(path);
            }
            Some(self.defining(&path, depth + 1))
        });
        found.into_iter().next().unwrap_or(module)
    }

    /// Which files each imports.
    fn imports(&self) -> BTreeMap<&Module, BTreeSet<Module>> {
        let each = self.0.iter().map(|(module, source)| {
            let paths = source.imports.iter().filter_map(|i| self.path_in_crate(module, &i.path));
            let found = paths.map(|p| self.defining(&p, 0)).filter(|m| m != module);
            (module, found.collect())
        });
        each.collect()
    }
}

/// The imports that lead back to the file that has them; of all that count.
fn circles(imports: &BTreeMap<&Module, BTreeSet<Module>>, counts: impl Fn(&Module, &Module) -> bool) -> Vec<String> {
    let of: BTreeMap<&Module, Vec<&Module>> =
        imports.iter().map(|(module, all)| (*module, all.iter().filter(|to| counts(module, to)).collect())).collect();
    let leads = |from: &Module, to: &Module| {
        let (mut seen, mut waiting) = (BTreeSet::new(), of[from].clone());
        while let Some(module) = waiting.pop() {
            if seen.insert(module) {
                waiting.extend(&of[module]);
            }
        }
        seen.contains(to)
    };
    let all = of.iter().flat_map(|(module, all)| all.iter().map(move |to| (*module, *to)));
    let back = all.filter(|(module, to)| leads(to, module));
    back.map(|(module, to)| format!("{} imports {}", module.join("/"), to.join("/"))).collect()
}

#[test]
fn no_two_files_import_each_other() {
    let above = |a: &Module, b: &Module| a.len() < b.len() && b.starts_with(a);
    let mut wrong = Vec::new();
    for name in CRATES {
        let all = Crate::of(name);
        let imports = all.imports();
        assert!(
            imports.values().map(BTreeSet::len).sum::<usize>() > 2 * imports.len() / 2,
            "{name}: imports are found"
        );
        for found in [circles(&imports, |of, to| !above(of, to)), circles(&imports, |of, to| !above(to, of))] {
            wrong.extend(found.into_iter().map(|line| format!("{name}: {line}")));
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(wrong.is_empty(), "imports in circles:\n{}", wrong.join("\n"));
}

#[test]
fn what_is_handed_on_is_found_where_it_is_defined() {
    let text = "pub(super) use a::{B, c::D as E};\nuse super::f::*;\nfn g() {\n    super::h::i(\"crate::no\"); // crate::no\n}\n";
    let source = Source::of(text);
    let shown =
        |of: &[Import]| of.iter().map(|i| format!("{} {:?}", i.path.join("::"), i.name)).collect::<Vec<_>>().join(", ");
    assert_eq!(shown(&source.handed_on), "a::B None, a::c::D Some(\"E\")");
    assert_eq!(shown(&source.imports), "super::f::* None, super::h::i None");
    assert!(source.defined.contains("g"));
    let module = |path: &str| path.split('/').map(String::from).collect::<Module>();
    let sources = [
        ("a", "mod b;\npub use b::C;"),
        ("a/b", "pub struct C;\nuse crate::d::e;"),
        ("d", "use crate::a::C;\npub fn e() {}"),
    ];
    let root = [(Module::new(), Source::default())];
    let all = Crate(sources.map(|(name, text)| (module(name), Source::of(text))).into_iter().chain(root).collect());
    let imports = all.imports();
    assert_eq!(imports[&module("d")], [module("a/b")].into());
    assert_eq!(circles(&imports, |_, _| true), ["a/b imports d", "d imports a/b"]);
}
