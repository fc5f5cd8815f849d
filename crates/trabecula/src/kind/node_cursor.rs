//! The cursor that reads a tree with the path and the line at hand.

use super::Key;
use super::error::DesignError;
use super::node::{Node, Value, describe};
use super::{Choice, Kind};
use geometry::fault::{counted, nearest, number};

/// A node and the path that leads to it.
#[derive(Clone)]
pub(crate) struct NodeCursor<'a> {
    pub node: &'a Node,
    pub path: String,
    line: Option<usize>,
}

impl<'a> NodeCursor<'a> {
    pub fn root(node: &'a Node) -> Self {
        NodeCursor { node, path: String::new(), line: None }
    }

    /// A node that stands at `path` of a design, outside any file.
    pub fn alone(node: &'a Node, path: &str) -> Self {
        NodeCursor { path: path.into(), ..NodeCursor::root(node) }
    }

    fn below(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }

    /// An error here.
    pub fn error(&self, message: impl Into<String>) -> DesignError {
        DesignError {
            line: self.line.or(self.node.line),
            found: Some(describe(self.node)),
            ..DesignError::new(&self.path, message)
        }
    }

    /// "expected X, found Y".
    pub fn expected(&self, what: &str) -> DesignError {
        let found = describe(self.node);
        let hint = self.number_in_text().filter(|_| what.starts_with("a number")).unwrap_or_default();
        self.error(format!("expected {what}, found {found}{hint}"))
    }

    /// How to write a number that stands here as text.
    fn number_in_text(&self) -> Option<String> {
        let text = self.node.as_text()?.trim();
        let parsed = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        match text.strip_suffix('%') {
            Some(share) => parsed(share).map(|v| format!("; for {} per cent write {}", number(v), number(v / 100.0))),
            None => parsed(text).map(|v| format!("; write {} without quotes", number(v))),
        }
    }

    /// The entries of a table with any keys.
    pub fn entries(&self, what: &str) -> Result<Vec<(&'a str, NodeCursor<'a>)>, DesignError> {
        let Value::Table(entries) = &self.node.value else {
            return Err(self.expected(what));
        };
        Ok(entries
            .iter()
            .map(|(k, line, node)| (k.as_str(), NodeCursor { node, path: self.below(k), line: *line }))
            .collect())
    }

    /// The keys of a table, all among `keys`; `what` is what was expected.
    pub fn table(&self, what: &str, keys: Vec<Key>) -> Result<Fields<'a>, DesignError> {
        let entries = self.entries(what)?;
        for (key, at) in &entries {
            if !keys.iter().any(|k| k.name == *key) {
                return Err(at.unknown_of("key", key, &keys));
            }
        }
        Ok(Fields { at: self.clone(), entries })
    }

    /// `word` is none of `keys`; near to a word that others use, the right one is named.
    fn unknown_of(&self, what: &str, word: &str, keys: &[Key]) -> DesignError {
        let names: Vec<&str> = keys.iter().map(|k| k.name).collect();
        let of = |hint: &str| keys.iter().find(|k| k.hints.contains(&hint)).map(|k| k.name);
        let meant = || of(nearest(word, keys.iter().flat_map(|k| k.hints.iter().copied()))?);
        let near = of(word).or_else(|| nearest(word, names.iter().copied())).or_else(meant);
        let line = self.line.or(self.node.line);
        DesignError { line, ..DesignError::unknown_but(&self.path, what, word, &names, near) }
    }

    /// The kind that stands here: its key and where its value is. A word is its own value.
    pub fn choice(&self, noun: &str, choices: &[Choice]) -> Result<(&'static str, NodeCursor<'a>), DesignError> {
        let any = |word: bool| choices.iter().filter(move |c| c.word == word).map(|c| c.key).collect::<Vec<Key>>();
        let known = |name: &str| choices.iter().find(|c| c.key.name == name);
        let all: Vec<Key> = choices.iter().map(|c| c.key).collect();
        match &self.node.value {
            Value::Text(word) if !any(true).is_empty() => match known(word) {
                Some(c) if c.word => Ok((c.key.name, self.clone())),
                Some(c) => Err(self.error(format!("{word} needs a value: write {{ {} = … }}", c.key.name))),
                None => Err(self.unknown_of(noun, word, &all)),
            },
            Value::Table(_) if !any(false).is_empty() => {
                let entries = self.entries(noun)?;
                for (key, at) in &entries {
                    match known(key) {
                        Some(c) if c.word => {
                            return Err(at.error(format!("{key} is a word without a value: write \"{key}\"")));
                        }
                        Some(_) => {}
                        None => return Err(at.unknown_of(noun, key, &all)),
                    }
                }
                let mut entries = entries.into_iter();
                match (entries.next(), entries.next()) {
                    (Some((key, at)), None) => match known(key) {
                        Some(c) => Ok((c.key.name, at)),
                        None => Err(at.unknown_of(noun, key, &all)),
                    },
                    (Some(a), Some(b)) => {
                        Err(b.1.error(format!("two kinds of {noun} at once, {} and {}; give exactly one", a.0, b.0)))
                    }
                    (None, _) => {
                        let names = any(false).iter().map(|k| k.name).collect::<Vec<_>>().join(", ");
                        Err(self.error(format!("a {noun} is missing here; give one of {names}")))
                    }
                }
            }
            _ => Err(self.expected(&super::expected_choice(noun, choices))),
        }
    }

    /// A kind that is none of `choices`.
    pub fn unknown_kind(&self, noun: &str, choices: &[Choice]) -> DesignError {
        self.expected(&super::expected_choice(noun, choices))
    }

    /// Refuses fewer than `least` items.
    pub fn at_least(&self, found: usize, least: usize) -> Result<(), DesignError> {
        if found >= least {
            return Ok(());
        }
        let name = self.path.rsplit('.').next().unwrap_or_default();
        Err(self.error(format!("{name} needs at least {}, found {found}", counted(least, "item"))))
    }

    pub fn text(&self, what: &str) -> Result<&'a str, DesignError> {
        match &self.node.value {
            Value::Text(s) => Ok(s),
            _ => Err(self.expected(what)),
        }
    }

    /// One of `names`; `hints` are words that others use, each with the one to use here.
    pub fn word_of(
        &self,
        what: &str,
        names: &[&'static str],
        hints: &[(&str, &'static str)],
    ) -> Result<&'static str, DesignError> {
        let word = self.text(&format!("one of {}", names.join(", ")))?;
        if let Some(known) = names.iter().find(|n| **n == word) {
            return Ok(known);
        }
        let of = |hint: &str| hints.iter().find(|h| h.0 == hint).map(|h| h.1);
        let meant = || of(nearest(word, hints.iter().map(|h| h.0))?);
        let near = of(word).or_else(|| nearest(word, names.iter().copied())).or_else(meant);
        let line = self.line.or(self.node.line);
        Err(DesignError { line, ..DesignError::unknown_but(&self.path, what, word, names, near) })
    }

    pub fn number(&self) -> Result<f64, DesignError> {
        match &self.node.value {
            Value::Number(v) => Ok(*v),
            Value::Whole(v) => Ok(*v as f64),
            Value::Table(_) => {
                Err(self.error(format!("expected one number, found {}; it cannot vary in space", describe(self.node))))
            }
            _ => Err(self.expected("a number")),
        }
    }

    pub fn truth(&self) -> Result<bool, DesignError> {
        match &self.node.value {
            Value::Bool(b) => Ok(*b),
            _ => Err(self.expected("true or false")),
        }
    }

    pub fn list(&self, what: &str) -> Result<Vec<NodeCursor<'a>>, DesignError> {
        let Value::List(items) = &self.node.value else {
            return Err(self.expected(what));
        };
        let item =
            |(i, node): (usize, &'a Node)| NodeCursor { node, path: format!("{}[{i}]", self.path), line: node.line };
        Ok(items.iter().enumerate().map(item).collect())
    }

    pub fn numbers<const N: usize>(&self, what: &str) -> Result<[f64; N], DesignError> {
        let items = self.list(what)?;
        if items.len() != N {
            let found = counted(items.len(), "value");
            return Err(self.error(format!("expected {what}, found {found}")));
        }
        let mut out = [0.0; N];
        for (o, item) in out.iter_mut().zip(&items) {
            *o = item.number()?;
        }
        Ok(out)
    }

    pub fn is_list(&self) -> bool {
        matches!(self.node.value, Value::List(_))
    }

    pub fn is_number(&self) -> bool {
        matches!(self.node.value, Value::Number(_) | Value::Whole(_))
    }
}

/// A table whose keys are known to be allowed.
pub(crate) struct Fields<'a> {
    pub at: NodeCursor<'a>,
    entries: Vec<(&'a str, NodeCursor<'a>)>,
}

impl<'a> Fields<'a> {
    pub fn get(&self, key: &str) -> Option<&NodeCursor<'a>> {
        self.entries.iter().find(|e| e.0 == key).map(|e| &e.1)
    }

    pub fn need(&self, key: &str, meaning: &str) -> Result<&NodeCursor<'a>, DesignError> {
        self.get(key)
            .ok_or_else(|| DesignError { found: None, ..self.at.error(format!("\"{key}\" is missing: {meaning}")) })
    }
}

impl<'a> Fields<'a> {
    /// The value of a key, if it is given.
    pub fn maybe<T: Kind>(&self, key: &str) -> Result<Option<T>, DesignError> {
        self.get(key).map(|at| T::read(at)).transpose()
    }

    /// The value of a key that must be given.
    pub fn required<T: Kind>(&self, key: &Key) -> Result<T, DesignError> {
        T::read(self.need(key.name, &key.meaning())?)
    }

    /// The one of `keys` that is given.
    pub fn one_of(&self, noun: &str, keys: &[Key]) -> Result<(&'static str, NodeCursor<'a>), DesignError> {
        let names = || keys.iter().map(|k| k.name).collect::<Vec<_>>().join(", ");
        let mut given = self.entries.iter().filter_map(|(name, at)| Some((keys.iter().find(|k| k.name == *name)?, at)));
        match (given.next(), given.next()) {
            (Some((key, at)), None) => Ok((key.name, at.clone())),
            (Some((a, _)), Some((b, at))) => {
                Err(at.error(format!("found {} and {}; give exactly one of {}", a.name, b.name, names())))
            }
            (None, _) => {
                let message = format!("the {noun} is missing; give exactly one of {}", names());
                Err(DesignError { found: None, ..self.at.error(message) })
            }
        }
    }

    /// Which of several sets of keys is given: the first of which there is a key that not all have.
    pub fn alternative(&self, sets: &[Vec<Key>]) -> Result<usize, DesignError> {
        let has = |set: &[Key], name: &str| set.iter().any(|k| k.name == name);
        let shared = |name: &str| sets.iter().all(|s| has(s, name));
        let given = |set: &[Key]| self.entries.iter().find(|(name, _)| has(set, name) && !shared(name)).map(|e| e.0);
        // The keys that a set needs, or else may have, of each set.
        let each = || {
            let own = |set: &Vec<Key>| {
                let own = set.iter().filter(|k| !shared(k.name));
                let needed: Vec<&str> = own.clone().filter(|k| k.required).map(|k| k.name).collect();
                match &needed[..] {
                    [] => own.map(|k| k.name).collect::<Vec<_>>().join(" or "),
                    [one] => (*one).into(),
                    [one, more @ ..] => format!("{one} with {}", more.join(" and ")),
                }
            };
            sets.iter().map(own).collect::<Vec<String>>().join(", ")
        };
        // The set of which most required keys are given, or else of which any key is.
        let needed = |set: &[Key]| {
            let own = |k: &&Key| k.required && !shared(k.name) && self.get(k.name).is_some();
            set.iter().filter(own).count()
        };
        let most = sets.iter().map(|s| needed(s)).max().unwrap_or(0);
        let first = sets.iter().position(|s| given(s).is_some() && needed(s) == most);
        let Some(first) = first.or(sets.iter().position(|s| given(s).is_some())) else {
            // None is: that of which no key is required, if there is one.
            if let Some(free) = sets.iter().position(|s| !s.iter().any(|k| k.required && !shared(k.name))) {
                return Ok(free);
            }
            return Err(DesignError { found: None, ..self.at.error(format!("give exactly one of {}", each())) });
        };
        let fits = |set: &[Key]| {
            given(set).is_some() && self.entries.iter().all(|(name, _)| has(set, name) || !known(sets, name))
        };
        if let Some(right) = sets.iter().position(|s| fits(s)) {
            return Ok(right);
        }
        let stray = self.entries.iter().find(|(name, _)| !has(&sets[first], name) && known(sets, name));
        match (given(&sets[first]), stray) {
            (Some(a), Some((b, at))) => Err(at.error(format!("found {a} and {b}; give exactly one of {}", each()))),
            _ => Ok(first),
        }
    }
}

/// Whether one of the sets has a key of this name.
fn known(sets: &[Vec<Key>], name: &str) -> bool {
    sets.iter().flatten().any(|k| k.name == name)
}
